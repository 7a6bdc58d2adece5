"""What a film costs, and whether a cache can be trusted.

    python film.py SPANDREL sheet OUT.png       frames of graphs/cg_town.ron on one sheet (needs Pillow)
    python film.py SPANDREL views OUT.png       [D] fig. 12 from sixteen sides, from one tree (needs Pillow)
    python film.py SPANDREL times               48 frames at once and one by one, without and with a cache
    python film.py SPANDREL memory OUT.svg      memory of a film of a thousand frames, frame by frame
    python film.py SPANDREL crowd [SECONDS]     16 processes on one cache, killed at random
    python film.py SPANDREL blur                motion blur at 4 to 32 moments against 64 (needs OpenEXR)
    python film.py SPANDREL share               what is made anew where little changes
    python film.py SPANDREL lines OUT.png       a frame by three line rules (needs Pillow)
    python film.py SPANDREL farm OPENJD         jobs of frames and of bands, by the farm's own program

SPANDREL is the program, built with --release. Everything is written to a folder of its own.
"""

import hashlib
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

TOWN = Path(__file__).resolve().parents[2] / "graphs" / "cg_town.ron"


def run(arguments, **more):
    """Runs a program that must succeed; returns its seconds."""
    clock = time.monotonic()
    subprocess.run([str(a) for a in arguments], check=True, **more)
    return time.monotonic() - clock


def sheet(spandrel, out, graph=TOWN, frames=(1, 8, 15, 22, 28, 34, 41, 48), shrink=2):
    from PIL import Image

    with tempfile.TemporaryDirectory() as folder:
        run([spandrel, "render", graph, "-q", "-F", ",".join(map(str, frames)), "-o", f"{folder}/f.####.png"])
        pictures = [Image.open(f"{folder}/f.{frame:04}.png").convert("RGB") for frame in frames]
        width, height = pictures[0].size
        made = Image.new("RGB", (4 * width + 15, len(frames) // 4 * (height + 5) - 5), "white")
        for i, picture in enumerate(pictures):
            made.paste(picture, ((i % 4) * (width + 5), (i // 4) * (height + 5)))
        made.resize((made.width // shrink, made.height // shrink), Image.LANCZOS).save(out)


def views(spandrel, out):
    """[D] fig. 12 from sixteen sides, from one tree."""
    sheet(spandrel, out, TOWN.parent / "papers/landscape.ron", range(1, 17), 4)


def times(spandrel):
    with tempfile.TemporaryDirectory() as folder:
        def film(*more):
            return run([spandrel, "render", TOWN, "-q", "-F", "1-48", "-o", f"{folder}/f.####.png", *more])

        at_once = film()
        alone = 0.0
        for frame in range(1, 49):
            alone += run([spandrel, "render", TOWN, "-q", "-F", frame, "-o", f"{folder}/g.####.png"])
        for frame in range(1, 49):
            a, b = (Path(f"{folder}/{name}.{frame:04}.png").read_bytes() for name in "fg")
            assert a == b, f"frame {frame} differs"
        cold = film("--cache", f"{folder}/cache")
        warm = film("--cache", f"{folder}/cache")
        print(f"48 frames at once {at_once:.1f} s, one by one {alone:.1f} s, the same bytes")
        print(f"with a cache: cold {cold:.1f} s, from it {warm:.1f} s")


def memory(spandrel, out):
    with tempfile.TemporaryDirectory() as folder:
        # Without shadows, which take most of the time and none of the memory that is looked at.
        command = [spandrel, "render", TOWN, "-q", "--json", "-F", "1-1000", "--size", "160x90", "--memory", "1G",
                   "--set", "lit.shadows=Off", "-o", f"{folder}/f.####.png"]
        process = subprocess.Popen([str(a) for a in command], stdout=subprocess.PIPE, text=True)
        held = []
        for line in process.stdout:
            if json.loads(line)["event"] != "frame":
                continue
            status = Path(f"/proc/{process.pid}/status").read_text()
            held.append(int(status.split("VmRSS:")[1].split()[0]) / 1024)
        assert process.wait() == 0
    tenth, most = held[9], max(held[10:])
    print(f"{len(held)} frames: {tenth:.0f} MiB after the tenth, {most:.0f} MiB at most after it, {held[-1]:.0f} at the end")
    width, height, top = 800, 240, 1.2 * max(held)
    points = " ".join(f"{40 + 740 * i / len(held):.1f},{height - 30 - 190 * mib / top:.1f}" for i, mib in enumerate(held))
    labels = "".join(
        f'<text x="{40 + 740 * frame / len(held):.0f}" y="{height - 12}" text-anchor="middle">{frame}</text>'
        for frame in range(0, len(held) + 1, 200)
    )
    Path(out).write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" '
        f'font-size="12"><rect width="100%" height="100%" fill="white"/>'
        f'<path d="M40 20V{height - 30}H780" fill="none" stroke="#888"/>'
        f'<polyline points="{points}" fill="none" stroke="#2d5fa6" stroke-width="1.5"/>{labels}'
        f'<text x="46" y="26">resident memory in MiB, {max(held):.0f} at most, over frames</text></svg>\n'
    )


def crowd(spandrel, seconds):
    """Processes that share a cache, some of which are killed: every picture that is whole is right."""
    # Less than there is to store: much has to go for what comes.
    limit = 4 << 20
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        graph = ["render", str(TOWN), "-q", "--size", "96x54", "-j", "1"]
        hash_of = lambda path: hashlib.sha256(path.read_bytes()).hexdigest()
        skies = [0.1, 0.4, 0.7, 1]
        right = {}
        for sky in skies:
            run([spandrel, *graph, "-F", "1-24", "--set", f"clear={sky}", "-o", folder / "right.####.png"])
            right |= {(sky, frame): hash_of(folder / f"right.{frame:04}.png") for frame in range(1, 25)}
        cache = folder / "cache"
        busy, done, killed, most = [], 0, 0, 0
        end = time.monotonic() + seconds
        number = 0
        while time.monotonic() < end or busy:
            while len(busy) < 16 and time.monotonic() < end:
                sky, first = random.choice(skies), random.randint(1, 22)
                name = folder / f"p{number}"
                number += 1
                command = [spandrel, *graph, "-F", f"{first}-{first + 2}", "--set", f"clear={sky}", "--cache", cache,
                           "--cache-size", str(limit), "-o", f"{name}.####.png"]
                doom = time.monotonic() + random.uniform(0.1, 4) if random.random() < 0.4 else None
                process = subprocess.Popen([str(a) for a in command], stderr=subprocess.PIPE, text=True)
                busy.append((process, name, sky, first, doom))
            for entry in list(busy):
                process, name, sky, first, doom = entry
                if process.poll() is None:
                    if doom and time.monotonic() > doom:
                        process.kill()
                    continue
                busy.remove(entry)
                said = process.stderr.read()
                if process.returncode == 0:
                    done += 1
                    assert said == "", said
                else:
                    assert process.returncode == -9, said
                    killed += 1
                for frame in range(first, first + 3):
                    file = Path(f"{name}.{frame:04}.png")
                    if file.exists():
                        assert hash_of(file) == right[sky, frame], f"{file} is wrong"
                        file.unlink()
            stats = cache.exists() and sum(file.stat().st_size for file in cache.rglob("*") if file.is_file())
            most = max(most, stats or 0)
            time.sleep(0.05)
        # Whoever comes after finds no lock that nobody holds.
        after = run([spandrel, *graph, "-F", "1-24", "--set", "clear=1", "--cache", cache, "--cache-size", str(limit),
                     "-o", folder / "last.####.png"])
        assert all(hash_of(folder / f"last.{frame:04}.png") == right[1, frame] for frame in range(1, 25))
        print(f"{done} renders ended, {killed} were killed; every picture right")
        print(f"the cache held {most / limit:.2f} of its limit at most; a render after it took {after:.1f} s")


def blur(spandrel):
    import numpy
    import OpenEXR

    with tempfile.TemporaryDirectory() as folder:
        pictures, seconds = {}, {}
        for samples in [1, 4, 8, 16, 32, 64]:
            file = f"{folder}/{samples}.exr"
            seconds[samples] = run([spandrel, "render", TOWN, "-q", "-F", "24", "-w", "picture", "-o", file, "--set",
                                    "picture.shutter=(-0.5,0.5)", "--set", f"picture.samples={samples}"])
            part = OpenEXR.File(file).channels()
            pictures[samples] = part["RGBA" if "RGBA" in part else "RGB"].pixels[..., :3].astype(float)
        for samples in [1, 4, 8, 16, 32]:
            error = numpy.sqrt(((pictures[samples] - pictures[64]) ** 2).mean())
            print(f"{samples} moments: {seconds[samples]:.2f} s, error {error:.5f}")
        print(f"64 moments: {seconds[64]:.2f} s")


def share(spandrel):
    """The second of two frames of the town, where little is another than in the first."""
    still = TOWN.read_text().replace("time * 0.05", "0")
    cars = (TOWN.parent / "assets/town/driving.ron").read_text()
    houses = (TOWN.parent / "assets/town/buildings.ron").read_text()
    moves = re.compile(r"Curve\(keys: \[\(1, (-?\d+)\).*?\)\)")
    parked = lambda text: moves.sub(r"\1)", text)
    first = moves.search(cars).end()
    sign = """(name: "sign", material: "cream", shape: Polygon(outline: [(-6, 5, -8), (-4, 5, -8), (-4, Expr("6 + frame * 0.2"), -8), (-6, 6, -8)])),"""
    at = houses.index("children: [", houses.index("root:")) + len("children: [")
    signed = houses[:at] + sign + houses[at:]
    cases = {
        "nothing": ({}, still),
        "the weather": ({"clear": 'Expr("frame / 4")'}, still),
        "one car drives": ({}, still, cars[:first] + parked(cars[first:])),
        "all cars drive": ({}, still, cars),
        "a corner of one face": ({}, still, parked(cars), signed),
        "the sun": ({}, still.replace("direction: (-0.72", 'direction: (Expr("-0.72 + frame / 50")')),
        "zoom and pan": ({}, still.replace("lines: Ref", 'scale: (Expr("1 + frame / 8"), Expr("1 + frame / 8")), pan: (Expr("-9 * frame"), 0), lines: Ref')),
    }
    print("| what changes | lines rendered | shadows found | rows resolved | bytes of values | time |")
    print("|---|---|---|---|---|---|")
    for name, (settings, graph, *scenes) in cases.items():
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            shutil.copytree(TOWN.parent / "assets", folder / "graphs" / "assets")
            (folder / "graphs/town.ron").write_text(graph)
            for file, text in zip(["driving", "buildings"], scenes or [parked(cars)]):
                (folder / f"graphs/assets/town/{file}.ron").write_text(text)
            settings = {"clear": "0.5", "autumn": "0.5"} | settings
            settings = [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
            command = [spandrel, "render", folder / "graphs/town.ron", "-q", "-F", "1-2", *settings, "-o", folder / "f.####.png"]
            done = subprocess.run([str(a) for a in [*command, "--stats=json"]], check=True, capture_output=True, text=True)
            nodes = json.loads(done.stdout)["nodes"]
            done = subprocess.run([str(a) for a in [*command, "--json"]], check=True, capture_output=True, text=True)
            events = [json.loads(line) for line in done.stdout.splitlines()]
            seconds = [event["seconds"] for event in events if event["event"] == "frame"]
            made = lambda frame: [n for n in nodes if n["frame"] == frame and n["outcome"] == "evaluated"]
            start = [n for n in nodes if n["frame"] in (None, 1) and n["outcome"] == "evaluated"]
            total = lambda nodes, fact: sum(n["facts"].get(fact, 0) for n in nodes)
            rendered = [n for n in made(2) if n["kind"] == "Scanline"]
            lines = len(rendered) * 810 - total(rendered, "lines as before")
            patches = total(made(2), "shadow patches") - total(made(2), "shadow patches as before")
            resolved = [n for n in made(2) if n["kind"] == "Resolve"]
            rows = len(resolved) * 270 - total(resolved, "rows as before")
            of = sum(n["kind"] == "Scanline" for n in start) * 810
            kept = sum(n["bytes"] for n in made(2)) / sum(n["bytes"] for n in start)
            now = f"{seconds[1] / seconds[0]:.1%}" if len(seconds) > 1 else "not made"
            print(
                f"| {name} | {lines / of:.1%} | {patches / total(start, 'shadow patches'):.1%} | {rows / 270:.1%} |"
                f" {kept:.1%} | {now} |"
            )


def lines(spandrel, out):
    """A frame as the film of 1987 was made, as the papers' later stills were, and as is the default here."""
    from PIL import Image

    rules = ["Sampled(1, Box)", "Sampled(3, Trapezoid)", "Sloped(8)"]
    made = Image.new("RGB", (3 * 480 + 20, 270 + 10 + 268), "white")
    with tempfile.TemporaryDirectory() as folder:
        for i, rule in enumerate(rules):
            command = [spandrel, "render", TOWN, "-q", "--set", f"lines={rule}", "-o", f"{folder}/f.####.png"]
            seconds = run([*command, "-F", "1-48"])
            print(f"{rule}: 48 frames in {seconds:.1f} s")
            picture = Image.open(f"{folder}/f.0040.png").convert("RGB")
            made.paste(picture, (i * 490, 0))
            made.paste(picture.crop((150, 128, 270, 195)).resize((480, 268), Image.NEAREST), (i * 490, 280))
        made.save(out, optimize=True)


def farm(spandrel, openjd):
    """Jobs are what the farm's own program takes, and what it makes of them is what one run makes."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        frames = ["-F", "1-4", "--chunk", "2", "--set", "picture.size=(96, 54)"]
        # Written where the graph says, into a copy.
        shutil.copytree(TOWN.parent, folder / "graphs")
        town = folder / "graphs/cg_town.ron"
        picture = lambda: {file.name: file.read_bytes() for file in sorted((folder / "out").glob("cg_town.*.png"))}
        run([spandrel, "render", town, "-q", "-F", "1-4", "--set", "picture.size=(96, 54)"])
        right = picture()
        for more, steps in [([], ["Render"]), (["--bands", "3"], ["Bands", "Join"])]:
            shutil.rmtree(folder / "out")
            job = folder / "graphs/job.json"
            run([spandrel, "submit", town, *frames, "--cache", folder / "cache", *more, "-o", job], stderr=subprocess.DEVNULL)
            run([openjd, "check", job], stdout=subprocess.DEVNULL)
            for step in steps:
                parameters = ["-p", f"Program={spandrel}"]
                run([openjd, "run", job, "--step", step, *parameters], stdout=subprocess.DEVNULL)
            assert picture() == right and len(right) == 4, more
            print(f"a job of the steps {', '.join(steps)} makes the same four pictures")
            shutil.rmtree(folder / "cache")


if __name__ == "__main__":
    commands = {f.__name__: f for f in [sheet, views, times, memory, crowd, blur, share, lines, farm]}
    if len(sys.argv) < 3 or sys.argv[2] not in commands:
        sys.exit(__doc__)
    rest = sys.argv[3:]
    if sys.argv[2] == "crowd":
        rest = [float(*rest)] if rest else [300]
    commands[sys.argv[2]](os.path.abspath(sys.argv[1]), *rest)
