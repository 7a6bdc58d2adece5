"""Surfaces of volumes beside marching cubes.

    python volumes.py EXAMPLE FILE LEVEL [FILE LEVEL]...

EXAMPLE is the built example `display` (target/release/examples/display). Needs numpy and scikit-image. Both programs run
on one core; the best of five counts. Read are NRRD files of 16 bits with gzip, and Gaussian cubes of one value a point.
"""

import gzip
import os
import subprocess
import sys
import time

import numpy as np
from skimage import measure


def cube(path):
    lines = open(path).read().split("\n")
    atoms = int(lines[2].split()[0])
    axes = [lines[3 + axis].split() for axis in range(3)]
    counts = [int(axis[0]) for axis in axes]
    steps = tuple(float(axes[axis][1 + axis]) for axis in range(3))
    values = np.array(" ".join(lines[6 + atoms :]).split(), dtype=np.float32)
    return values.reshape(counts), steps


def nrrd(path):
    data = open(path, "rb").read()
    end = data.index(b"\n\n")
    head = dict(line.split(": ", 1) for line in data[:end].decode().split("\n") if ": " in line)
    counts = [int(count) for count in head["sizes"].split()]
    values = np.frombuffer(gzip.decompress(data[end + 2 :]), "<i2").astype(np.float32)
    vectors = [text.strip("()").split(",") for text in head["space directions"].split()]
    steps = [float(vectors[axis][axis]) for axis in range(3)]
    return values.reshape(counts[::-1]), tuple(steps[::-1])


def cubes(path, level):
    values, steps = cube(path) if path.endswith(".cube") else nrrd(path)
    best = float("inf")
    for _ in range(5):
        clock = time.perf_counter()
        points, faces, _, _ = measure.marching_cubes(values, level, spacing=steps)
        best = min(best, time.perf_counter() - clock)
    corners = points[faces].astype(np.float64)
    held = abs(np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6)
    return len(faces), best * 1e3, measure.mesh_surface_area(points, faces), held


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    os.sched_setaffinity(0, {0})
    print("| volume | level | triangles | ms | area | volume |\n|---|---|---|---|---|---|")
    for path, level in zip(sys.argv[2::2], sys.argv[3::2]):
        triangles, ms, area, held = cubes(path, float(level))
        print(f"| {os.path.basename(path)} | {level} | {triangles} | {ms:.0f} | {area:.2f} | {held:.2f} |")
    print()
    subprocess.run([sys.argv[1], *sys.argv[2:]], check=True, env={**os.environ, "RAYON_NUM_THREADS": "1"})
