#!/usr/bin/env python3
"""Merging span files of a thousand and of 64 thousand rows: peak memory beside size.

    python3 tests/peers/tall.py [SPANDREL]

The same wall of random triangles is seen through 1024 x 1024 and, stretched, through 1024 x 65536 pixels: the
faces are as many, and the lines 64 times as many.
"""

import os
import random
import subprocess
import sys
import tempfile

SPANDREL = os.path.abspath(sys.argv[1] if len(sys.argv) > 1 else "target/release/spandrel")
TRIANGLES = 20_000


def wall(path, seed, height):
    """Triangles over 16 x `height` metres, in layers of depth."""
    rng = random.Random(seed)
    with open(path, "w") as out:
        for i in range(TRIANGLES):
            x, y, z = rng.uniform(-8, 8), rng.uniform(-0.5, 0.5) * height, rng.uniform(0, 5)
            for _ in range(3):
                dx, dy, dz = (rng.uniform(-0.4, 0.4) for _ in range(3))
                out.write(f"v {x + dx} {y + dy * height / 16} {z + dz}\n")
            out.write(f"f {3 * i + 1} {3 * i + 2} {3 * i + 3}\n")


def run(*arguments):
    """Runs the program; returns its seconds and its peak memory in bytes."""
    pid = os.posix_spawn(SPANDREL, [SPANDREL, *arguments], os.environ)
    before = os.times().elapsed
    _, status, usage = os.wait4(pid, 0)
    if status != 0:
        sys.exit(f"{arguments} failed")
    return os.times().elapsed - before, usage.ru_maxrss * 1024


def main():
    print(f"{'rows':>6} {'spans':>12} {'inputs':>10} {'output':>10} {'render peak':>12} {'merge peak':>11} {'merge':>8}")
    for rows in (1024, 65536):
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            height = rows / 64
            for name, seed in (("a", 1), ("b", 2)):
                wall(f"{name}.obj", seed, height)
            graph = f"""Graph(nodes: {{
                "eye": Camera(position: (0, 0, 100), look_at: (0, 0, 0), parallel_height: {height}),
                "a": Scanline(scene: "a.obj", camera: "eye"),
                "b": Scanline(scene: "b.obj", camera: "eye"),
                "as": WriteSpans(image: "a", path: "a.span", size: (1024, {rows}), lines: Sloped(2)),
                "bs": WriteSpans(image: "b", path: "b.span", size: (1024, {rows}), lines: Sloped(2)),
            }})"""
            with open("g.ron", "w") as out:
                out.write(graph)
            _, rendering = run("render", "g.ron", "-q", "-w", "as", "-w", "bs")
            seconds, merging = run("merge", "a.span", "b.span", "-o", "c.span", "-q")
            info = subprocess.run([SPANDREL, "info", "c.span"], capture_output=True, text=True, check=True).stdout
            spans = next(line for line in info.splitlines() if " segments of " in line).split(" spans")[0].strip()
            size = lambda *names: sum(os.path.getsize(name) for name in names) / 1e6
            print(
                f"{rows:>6} {spans:>12} {size('a.span', 'b.span'):>7.1f} MB {size('c.span'):>7.1f} MB"
                f" {rendering / 1e6:>9.0f} MB {merging / 1e6:>8.0f} MB {seconds:>6.2f} s"
            )
            os.chdir("/")


main()
