#!/usr/bin/env python3
"""Spandrel beside Embree (rays) and OpenImageIO (deep pictures): errors, times and bytes from one run.

    python3 tests/peers/run.py FOLDER [WIDTH HEIGHT [TRIANGLES ...]]

Installs the peers into FOLDER (Debian's libembree and libopenexr, PyPI's openimageio), builds what is needed,
generates towns, and prints one table for each comparison. Needs apt-get, g++ and python3 with venv; nothing is
installed outside FOLDER.
"""

import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
REFERENCE_SAMPLES = 4096
STRIDE = 9
RUNS = 5
PACKAGES = ["libembree-dev", "libopenexr-dev"]
NEEDED = ("libembree", "libtbb", "libopenexr", "libimath", "libhwloc")


def run(*command, **options):
    return subprocess.run([str(part) for part in command], check=True, text=True, **options)


def output(*command, **options):
    return run(*command, stdout=subprocess.PIPE, **options).stdout


def install(folder):
    """Puts the peers into `folder`; returns the programs and the environment that they need."""
    root, debs, venv = folder / "debian", folder / "debs", folder / "venv"
    if not root.exists():
        debs.mkdir(parents=True, exist_ok=True)
        tree = output("apt-cache", "depends", "--recurse", "--no-recommends", "--no-suggests", "--no-conflicts",
                      "--no-breaks", "--no-replaces", "--no-enhances", *PACKAGES)
        names = sorted({line for line in tree.splitlines() if line.startswith(NEEDED)})
        run("apt-get", "download", *names, cwd=debs, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        for package in debs.glob("*.deb"):
            run("dpkg-deb", "-x", package, root)
    library = next(root.glob("usr/lib/*/libembree3.so.3")).parent
    include = root / "usr/include"
    if not (folder / "embree").exists():
        run("g++", "-O3", "-march=native", "-std=c++17", "-I", include, HERE / "embree.cpp", "-o", folder / "embree",
            f"-L{library}", f"-Wl,-rpath-link,{library}", "-lembree3", "-lpthread")
        run("g++", "-O2", "-std=c++17", "-I", include / "OpenEXR", "-I", include / "Imath", "-I", include,
            HERE / "deep.cpp", "-o", folder / "deep", f"-L{library}", f"-Wl,-rpath-link,{library}", "-lOpenEXR-3_1",
            "-lImath-3_1", "-lIlmThread-3_1", "-lIex-3_1", "-lpthread")
    if not venv.exists():
        run(sys.executable, "-m", "venv", venv)
        run(venv / "bin/pip", "install", "-q", "openimageio", "numpy")
    return {**os.environ, "LD_LIBRARY_PATH": str(library)}


def lines(text):
    return [json.loads(line) for line in text.splitlines() if line.startswith("{")]


def timed(*command, **options):
    """The median seconds of several runs."""
    times = []
    for _ in range(RUNS):
        clock = time.perf_counter()
        run(*command, stdout=subprocess.DEVNULL, **options)
        times.append(time.perf_counter() - clock)
    return statistics.median(times)


def at_error(rays, rmse):
    """The seconds that rays need for an error: between the two measured that enclose it, as powers."""
    from math import exp, log
    rays = sorted(rays, key=lambda ray: ray["samples"])
    for a, b in zip(rays, rays[1:]):
        if b["rmse"] <= rmse <= a["rmse"]:
            share = (log(rmse) - log(a["rmse"])) / (log(b["rmse"]) - log(a["rmse"]))
            mix = lambda key: exp(log(a[key]) + share * (log(b[key]) - log(a[key])))
            return mix("trace"), mix("samples"), False
    # Beyond what was measured: by the last two's slope.
    a, b = rays[-2:]
    slope = (log(b["trace"]) - log(a["trace"])) / (log(b["rmse"]) - log(a["rmse"]))
    seconds = exp(log(b["trace"]) + slope * (log(rmse) - log(b["rmse"])))
    return seconds, b["samples"] * seconds / b["trace"], True


def graph(folder, width, height):
    names = ", ".join(f'"{i}.span"' for i in range(4))
    text = f"""Graph(nodes: {{
        "town": DepthMerge(inputs: [{names}]),
        "picture": Resolve(image: "town", size: ({width}, {height}), lines: Sloped(8)),
        "file": Write(image: "picture", path: "spans.exr"),
    }})"""
    (folder / "merge.ron").write_text(text)


def colors_of(folder, exr, raw):
    """Writes the colours of an EXR file as raw floats."""
    code = ("import sys, OpenImageIO as oiio, numpy\n"
            "image = oiio.ImageBuf(sys.argv[1])\n"
            "names = list(image.spec().channelnames)\n"
            "pixels = image.get_pixels(oiio.FLOAT)\n"
            "order = [names.index(name) for name in 'RGB']\n"
            "pixels[:, :, order].astype('<f4').tofile(sys.argv[2])\n")
    run(folder / "venv/bin/python", "-c", code, exr, raw)


def main():
    folder = Path(sys.argv[1]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    width, height = (sys.argv[2:4] + ["1920", "1080"])[:2] if len(sys.argv) > 3 else ("1920", "1080")
    sizes = sys.argv[4:] or ["10000", "100000", "1000000"]
    environment = install(folder)
    run("cargo", "build", "--release", cwd=ROOT)
    run("cargo", "build", "--release", "-p", "spandrel-tests", "--example", "peers", cwd=ROOT)
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release"
    rays_table, deep_table = [], []
    for size in sizes:
        work = folder / f"town-{size}"
        work.mkdir(exist_ok=True)
        ours = lines(output(target / "examples/peers", work, size, width, height))
        # Deep pictures, and both ways to merge them.
        for i in range(4):
            run(folder / "deep", width, height, work / f"{i}.deep", work / f"{i}.exr", env=environment)
            (work / f"{i}.deep").unlink()
        oiiotool = folder / "venv/bin/oiiotool"
        merge = [oiiotool, work / "0.exr"]
        for i in range(1, 4):
            merge += [work / f"{i}.exr", "--deepmerge"]
        merge += ["--flatten", "-o", work / "deep.exr"]
        graph(work, width, height)
        deep_seconds = timed(*merge)
        span_seconds = timed(target / "spandrel", "render", work / "merge.ron", "-q")
        colors_of(folder, work / "deep.exr", work / "deep.rgb")
        colors_of(folder, work / "spans.exr", work / "spans.rgb")
        bytes_of = lambda ending: sum((work / f"{i}.{ending}").stat().st_size for i in range(4)) / 1e6
        # Rays.
        pictures = [work / f"spans_{row['n']}.rgb" for row in ours] + [work / "deep.rgb", work / "spans.rgb"]
        rays = lines(output(folder / "embree", work, REFERENCE_SAMPLES, STRIDE, *pictures, env=environment))
        build, errors = rays[0], {Path(row["picture"]).name: row["rmse"] for row in rays if "picture" in row}
        rays = [row for row in rays if "samples" in row]
        for row in ours:
            rmse = errors[f"spans_{row['n']}.rgb"]
            own = row["visibility"] + row["resolve"]
            trace, samples, is_beyond = at_error(rays, rmse)
            total = build["build"] + trace
            rays_table.append(f"| {build['triangles']:,} | {row['n']} | {rmse:.5f} | {row['visibility'] * 1e3:.0f} + "
                              f"{row['resolve'] * 1e3:.0f} ms | {samples:.0f}{'*' if is_beyond else ''} | "
                              f"{build['build']:.2f} + {trace:.2f} s | {total / own:.1f} |")
        deep_table.append(f"| {build['triangles']:,} | {bytes_of('exr'):.1f} MB | {bytes_of('span'):.1f} MB | "
                          f"{bytes_of('exr') / bytes_of('span'):.1f} | {deep_seconds:.2f} s | {span_seconds:.2f} s | "
                          f"{deep_seconds / span_seconds:.1f} | {errors['deep.rgb']:.5f} | {errors['spans.rgb']:.5f} |")
    print(f"\nVisibility and resolve beside Embree at the same error, {width} x {height}; RMSE against "
          f"{REFERENCE_SAMPLES} samples on every {STRIDE}th pixel of both axes (* beyond what was traced)\n")
    print("| triangles | n | RMSE | spans | samples | Embree: build + trace | ratio |")
    print("|---|---|---|---|---|---|---|")
    print("\n".join(rays_table))
    print(f"\nFour clusters merged and resolved from files (n = 8), beside oiiotool --deepmerge --flatten\n")
    print("| triangles | deep EXR | .span | ratio | oiiotool | spandrel | ratio | RMSE deep | RMSE spans |")
    print("|---|---|---|---|---|---|---|---|---|")
    print("\n".join(deep_table))


main()
