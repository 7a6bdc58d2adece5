"""Compares direct irradiance with Radiance: a room with an area source, a courtyard under three skies of
the CIE, a lamp with an IES file over a floor; twenty points each.

    python3 tests/peers/light.py FOLDER [BIN]

FOLDER is scratch; BIN is where Radiance's programs are (PyPI: pyradiance/bin), unless they are in the path.
"""

import os
import subprocess
import sys

FOLDER = os.path.abspath(sys.argv[1])
BIN = sys.argv[2] if len(sys.argv) > 2 else ""
ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
ALTITUDE, AZIMUTH = "38", "-52"


def run(*words, text=None):
    program = os.path.join(BIN, words[0]) if BIN else words[0]
    env = dict(os.environ)
    if BIN:
        env["RAYPATH"] = f".:{os.path.join(os.path.dirname(BIN), 'lib')}"
        env["PATH"] = BIN + os.pathsep + env["PATH"]
    made = subprocess.run([program, *words[1:]], input=text, capture_output=True, text=True, cwd=FOLDER, env=env)
    if made.returncode:
        sys.exit(f"{words}: {made.stderr}")
    return made.stdout


def save(name, text):
    with open(os.path.join(FOLDER, name), "w") as file:
        file.write(text)


def read(name):
    with open(os.path.join(FOLDER, name)) as file:
        return file.read()


def numbers(name):
    return [float(line) for line in read(name).split()]


SKY = """
skyfunc glow sky_glow
0
0
4 1 1 1 0
sky_glow source sky
0
0
4 0 0 1 180
"""


def irradiance(name, files, *options):
    octree = name + ".oct"
    program = os.path.join(BIN, "oconv") if BIN else "oconv"
    with open(os.path.join(FOLDER, octree), "wb") as out:
        subprocess.run([program, *files], stdout=out, cwd=FOLDER, check=True,
                       env={**os.environ, "RAYPATH": f".:{os.path.join(os.path.dirname(BIN), 'lib')}"})
    out = run("rtrace", "-h", "-I", *options, octree, text=read(name + ".pts"))
    # Grey: the three channels are alike.
    return [float(line.split()[1]) for line in out.splitlines() if line.strip()]


def main():
    os.makedirs(FOLDER, exist_ok=True)
    skies = {}
    # Radiance fades its skies into the ground around the horizon; here they are as the CIE has them.
    if BIN:
        with open(os.path.join(os.path.dirname(BIN), "lib", "skybright.cal")) as file:
            models = file.read()
    else:
        models = run("sh", "-c", "cat $(echo $RAYPATH | tr ':' '\\n' | sed 's|$|/skybright.cal|') 2>/dev/null")
    bare = "\nbare = if(Dz, select(A1, sunnysky, cloudysky, unifsky, intersky), 0);\n"
    save("bare.cal", models + bare)
    for name, kind in [("overcast", "-c"), ("intermediate", "-i"), ("clear", "-s")]:
        # Grey, no ground.
        sky = run("gensky", "-ang", ALTITUDE, AZIMUTH, kind, "-g", "0")
        skies[name] = sky.replace("skybr skybright.cal", "bare bare.cal")
        save(name + "_sky.rad", skies[name] + SKY)
    # The last three numbers of the clear sky's function are the direction to the sun.
    words = skies["clear"].split()
    sun = words[-3:]
    subprocess.run(["cargo", "run", "--release", "-q", "-p", "spandrel-tests", "--example", "irradiance", "--",
                    FOLDER, *sun], cwd=ROOT, check=True)
    save("lamp_source.rad", "")
    run("ies2rad", "-dm", "-t", "default", "-o", "source", "lamp.ies")
    placed = run("xform", "-t", "0.2", "0.3", "3", "source.rad")
    save("lamp_source.rad", placed)
    cases = [
        ("room", ["room.rad"], ["-ab", "0", "-ds", ".005", "-dt", "0", "-dj", "0"], 1.0, "an area source in a room"),
        ("overcast", ["overcast.rad", "overcast_sky.rad"], None, None, "a courtyard under the CIE overcast sky"),
        ("intermediate", ["intermediate.rad", "intermediate_sky.rad"], None, None,
         "the same under the CIE intermediate sky"),
        ("clear", ["clear.rad", "clear_sky.rad"], None, None, "the same under the CIE clear sky"),
        # ies2rad divides candela by 179 lumen per watt.
        ("lamp", ["lamp.rad", "lamp_source.rad"], ["-ab", "0", "-ds", "0", "-dt", "0"], 179.0,
         "a lamp with an IES file beside a pillar"),
    ]
    print("| scene | points in the dark by both | mean difference | worst |\n|---|---|---|---|")
    for name, files, options, scale, title in cases:
        options = options or ["-ab", "1", "-ad", "262144", "-as", "0", "-aa", "0", "-lw", "1e-9"]
        theirs, ours = irradiance(name, files, *options), numbers(name + ".ours")
        if scale is None:
            # Skies: as shares of what the open plane receives.
            theirs, ours = ([v / values[-1] for v in values[:-1]] for values in (theirs, ours))
            scale = 1.0
        theirs = [v * scale for v in theirs]
        most = max(theirs)
        lit = [(a, b) for a, b in zip(ours, theirs) if max(a, b) > 1e-4 * most]
        off = [abs(a / b - 1) if b else 1.0 for a, b in lit]
        print(f"| {title} | {len(theirs) - len(lit)} | {100 * sum(off) / len(off):.2f} % | {100 * max(off):.2f} % |")
        if "-v" in sys.argv:
            for a, b in zip(ours, theirs):
                print(f"    {a:.5g} {b:.5g}")


main()
