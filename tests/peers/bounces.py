"""Compares light between surfaces with Mitsuba 3: a coloured box, a room with a window, a courtyard. Of each, the
picture's error against time, and the light on twenty squares of three by three pixels.

    python3 tests/peers/bounces.py FOLDER [SCENE ..]

FOLDER is scratch. Mitsuba (PyPI: mitsuba) runs in its LLVM variant if it can. Both programs are measured against one
picture of Mitsuba's path tracer with many samples; what that is off by itself is told.
"""

import os
import subprocess
import sys
import time

import mitsuba as mi
import numpy as np

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
SPANDREL = os.path.join(ROOT, "target", "release", "spandrel")
FOLDER = os.path.abspath(sys.argv[1])
SIZE = (600, 400)
DEEP = 9


def box(low, high, inwards=False, skip=()):
    """The quads of a box, fronts outwards."""
    (a, b, c), (d, e, f) = low, high
    sides = {
        "left": [(a, b, c), (a, b, f), (a, e, f), (a, e, c)],
        "right": [(d, b, f), (d, b, c), (d, e, c), (d, e, f)],
        "floor": [(a, b, c), (d, b, c), (d, b, f), (a, b, f)],
        "ceiling": [(a, e, f), (d, e, f), (d, e, c), (a, e, c)],
        "back": [(d, b, c), (a, b, c), (a, e, c), (d, e, c)],
        "front": [(a, b, f), (d, b, f), (d, e, f), (a, e, f)],
    }
    return {name: quad[::-1] if inwards else quad for name, quad in sides.items() if name not in skip}


def turned(quads, degrees, about):
    angle = np.radians(degrees)
    c, s = np.cos(angle), np.sin(angle)
    turn = lambda p: (about[0] + c * (p[0] - about[0]) + s * (p[2] - about[1]), p[1],
                      about[1] - s * (p[0] - about[0]) + c * (p[2] - about[1]))
    return {name: [turn(p) for p in quad] for name, quad in quads.items()}


WHITE, RED, GREEN, BLUE, BROWN = (.75, .75, .75), (.63, .06, .05), (.14, .45, .09), (.2, .3, .7), (.5, .33, .2)


def coloured_box():
    faces = []
    for name, quad in box((-1, 0, -2), (1, 2, 0), inwards=True, skip=["front"]).items():
        faces.append((quad, {"left": RED, "right": GREEN}.get(name, WHITE)))
    for low, high, angle, about in [((-.65, 0, -1.6), (-.05, 1.2, -1), 18, (-.35, -1.3)), ((.1, 0, -1), (.7, .6, -.4), -17, (.4, -.7))]:
        faces += [(quad, WHITE) for name, quad in turned(box(low, high, skip=["floor"]), angle, about).items()]
    # Black on its back and before the camera in both programs.
    faces.append(([(-.25, 1.985, -1.25), (.25, 1.985, -1.25), (.25, 1.985, -.75), (-.25, 1.985, -.75)], (0, 0, 0)))
    panel = [(-.25, 1.98, -1.25), (.25, 1.98, -1.25), (.25, 1.98, -.75), (-.25, 1.98, -.75)]
    return faces, [("area", panel, 12)], ((0, 1, 3.9), (0, 1, 0), 28)


def window_room():
    """6 x 3 x 5 m; light comes through a window of 2 x 1.3 m from a uniform sky, and from a panel."""
    faces = [(quad, {"floor": BROWN, "back": BLUE}.get(name, WHITE))
             for name, quad in box((-3, 0, -5), (3, 3, 0), inwards=True, skip=["left", "front"]).items()]
    # The wall with the window, in four pieces, and its other side.
    x, low, high, a, b = -3, .9, 2.2, -3.4, -1.4
    pieces = [((0, -5), (3, a)), ((0, b), (3, 0)), ((0, a), (low, b)), ((high, a), (3, b))]
    for (y0, z0), (y1, z1) in pieces:
        faces.append(([(x, y0, z1), (x, y0, z0), (x, y1, z0), (x, y1, z1)], WHITE))
    faces.append(([(-3, 0, 0), (3, 0, 0), (3, 3, 0), (-3, 3, 0)][::-1], WHITE))
    faces += [(quad, BROWN) for quad in box((-.5, .68, -3.2), (1.6, .74, -2.2)).values()]
    for u, w in [(-.4, -3.1), (1.44, -3.1), (-.4, -2.36), (1.44, -2.36)]:
        faces += [(quad, BROWN) for quad in box((u, 0, w), (u + .06, .68, w + .06), skip=["floor", "ceiling"]).values()]
    faces += [(quad, WHITE) for quad in box((1.9, 0, -5), (2.9, 1.9, -4.45), skip=["floor", "back"]).values()]
    faces.append(([(.2, 2.955, -3), (1.2, 2.955, -3), (1.2, 2.955, -2.4), (.2, 2.955, -2.4)], (0, 0, 0)))
    panel = [(.2, 2.95, -3), (1.2, 2.95, -3), (1.2, 2.95, -2.4), (.2, 2.95, -2.4)]
    return faces, [("sky", 6), ("area", panel, 4)], ((1.4, 1.6, -.15), (-.9, 1.15, -4.2), 62)


def courtyard():
    faces = [([(-40, 0, 40), (40, 0, 40), (40, 0, -40), (-40, 0, -40)], (.45, .43, .4))]
    for low, high, color in [((-6, 0, -14), (6, 7, -11), (.6, .5, .4)), ((-9, 0, -14), (-6, 5, 2), (.7, .65, .55)),
                             ((6, 0, -14), (9, 9, 2), (.62, .3, .22))]:
        faces += [(quad, color) for quad in box(low, high, skip=["floor"]).values()]
    faces += [(quad, WHITE) for quad in box((-2, 0, -8), (2, .5, -5), skip=["floor"]).values()]
    return faces, [("sky", 1), ("sun", (-.5, -.8, -.35), 6)], ((0, 3.2, 5.5), (0, 2.2, -8), 58)


SCENES = {"box": coloured_box, "room": window_room, "courtyard": courtyard}


def spandrel_files(name, faces, lights, view):
    point = lambda p: "(" + ", ".join(f"{v:.9g}" for v in p) + ")"
    colors = sorted({color for _, color in faces})
    lines = ["Scene(", "    materials: {"]
    lines += [f'        "m{k}": (color: {point(color)}),' for k, color in enumerate(colors)]
    lines += ["    },", '    plans: [(name: "p", root: (children: [']
    for k, (quad, color) in enumerate(faces):
        outline = ", ".join(point(p) for p in quad)
        lines.append(f'        (name: "f{k}", material: "m{colors.index(color)}", shape: Polygon(outline: [{outline}])),')
    lines += ["    ]))],", ")"]
    save(name + ".scene.ron", "\n".join(lines))
    nodes = []
    for k, light in enumerate(lights):
        if light[0] == "area":
            outline = ", ".join(point(p) for p in light[1])
            nodes.append(f'"l{k}": AreaLight(outline: [{outline}], luminance: {light[2]}),')
        elif light[0] == "sky":
            nodes.append(f'"l{k}": SkyLight(model: Uniform, illuminance: {light[1] * np.pi}),')
        else:
            nodes.append(f'"l{k}": ParallelLight(direction: {point(light[1])}, illuminance: {light[2]}),')
    names = ", ".join(f'"l{k}"' for k in range(len(lights)))
    position, target, angle = view
    save(name + ".ron", f"""Graph(nodes: {{
    "eye": Camera(position: {point(position)}, look_at: {point(target)}, field_of_view: {angle}),
    "seen": Scanline(scene: "{name}.scene.ron", camera: "eye"),
    {chr(10).join(nodes)}
    "lit": Illuminate(image: "seen", lights: [{names}], white: {np.pi}, ambient: 0, shadows: Analytic, bounces: {DEEP - 1}),
    "picture": Resolve(image: "lit", size: {SIZE}, lines: Sloped(4)),
    "file": Write(image: "picture", path: "{name}.ours.exr"),
}})""")


def save(name, text):
    with open(os.path.join(FOLDER, name), "w") as file:
        file.write(text)


def mitsuba_scene(faces, lights, view):
    position, target, angle = view
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": DEEP + 1, "rr_depth": 1000, "hide_emitters": True},
        "sensor": {
            "type": "perspective", "fov": angle, "fov_axis": "y",
            "to_world": mi.ScalarTransform4f().look_at(position, target, (0, 1, 0)),
            "film": {"type": "hdrfilm", "width": SIZE[0], "height": SIZE[1], "rfilter": {"type": "box"},
                     "pixel_format": "rgb", "component_format": "float32"},
            "sampler": {"type": "independent"},
        },
    }

    def mesh(quads, props):
        made = mi.Mesh("quads", 4 * len(quads), 2 * len(quads), props=props)
        params = mi.traverse(made)
        params["vertex_positions"] = np.array(quads, dtype=np.float32).ravel()
        params["faces"] = np.array([[4 * k, 4 * k + 1, 4 * k + 2, 4 * k, 4 * k + 2, 4 * k + 3] for k in range(len(quads))],
                                   dtype=np.uint32).ravel()
        params.update()
        return made

    for k, color in enumerate(sorted({color for _, color in faces})):
        props = mi.Properties()
        bsdf = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": color}}}
        props["bsdf"] = mi.load_dict(bsdf)
        scene[f"m{k}"] = mesh([quad for quad, own in faces if own == color], props)
    for k, light in enumerate(lights):
        if light[0] == "area":
            props = mi.Properties()
            props["bsdf"] = mi.load_dict({"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.}})
            props["emitter"] = mi.load_dict({"type": "area", "radiance": {"type": "rgb", "value": float(light[2])}})
            scene[f"l{k}"] = mesh([light[1]], props)
        elif light[0] == "sky":
            # Of the upper half alone.
            data = np.zeros((64, 128, 3), dtype=np.float32)
            data[:32] = light[1]
            scene[f"l{k}"] = {"type": "envmap", "bitmap": mi.Bitmap(data),
                              "to_world": mi.ScalarTransform4f().rotate([0, 1, 0], 0)}
        else:
            scene[f"l{k}"] = {"type": "directional", "direction": light[1], "irradiance": {"type": "rgb", "value": float(light[2])}}
    return mi.load_dict(scene)


def picture(path):
    return np.array(mi.Bitmap(path).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32))


def rmse(a, b):
    return float(np.sqrt(np.mean((np.clip(a, 0, 1) - np.clip(b, 0, 1)) ** 2)))


def spots(a, b, count=20):
    """Relative differences on squares of pixels, where the truth is even."""
    random = np.random.default_rng(1)
    found = []
    while len(found) < count:
        x, y = random.integers(8, SIZE[0] - 8), random.integers(8, SIZE[1] - 8)
        wide = b[y - 4:y + 5, x - 4:x + 5].mean(axis=2)
        if wide.mean() < 1e-3 or wide.std() > .08 * wide.mean():
            continue
        one, other = a[y - 1:y + 2, x - 1:x + 2].mean(), b[y - 4:y + 5, x - 4:x + 5].mean()
        found.append(one / other - 1)
    return np.array(found)


def main():
    os.makedirs(FOLDER, exist_ok=True)
    mi.set_variant("llvm_ad_rgb" if "llvm_ad_rgb" in mi.variants() else "scalar_rgb")
    for name in sys.argv[2:] or SCENES:
        faces, lights, view = SCENES[name]()
        spandrel_files(name, faces, lights, view)
        scene = mitsuba_scene(faces, lights, view)
        truth_file = os.path.join(FOLDER, name + ".truth.npy")
        if not os.path.exists(truth_file):
            # Light through a window is found by few paths.
            count = 16 if name == "room" else 8
            parts = [np.array(mi.render(scene, spp=256, seed=1000 + k)) for k in range(count)]
            np.save(truth_file, np.array([np.mean(parts[::2], axis=0), np.mean(parts[1::2], axis=0)]))
        halves = np.load(truth_file)
        truth = halves.mean(axis=0)
        mi.Bitmap(truth.astype(np.float32)).write(os.path.join(FOLDER, name + ".truth.exr"))
        print(f"== {name}: the truth is off by {rmse(*halves) / 2:.5f}")
        print("| | time | RMSE | mean | squares: mean, worst |\n|---|---|---|---|---|")

        def row(label, seconds, made):
            off = spots(made, truth)
            print(f"| {label} | {seconds:.2f} s | {rmse(made, truth):.5f} | {made.mean() / truth.mean() - 1:+.4f} |"
                  f" {np.abs(off).mean():.4f}, {np.abs(off).max():.4f} |", flush=True)

        mi.render(scene, spp=1)
        for spp in [4, 16, 64, 256]:
            clock = time.time()
            made = np.array(mi.render(scene, spp=spp, seed=spp))
            row(f"Mitsuba, {spp} samples", time.time() - clock, made)
        for label, settings in [
            ("direct light alone", ["lit.bounces=0"]),
            ("Rays(16)", ["lit.gather=Rays(16)"]),
            ("Records(64)", []),
            ("Records(256)", ["lit.gather=Records(256)"]),
        ]:
            out = os.path.join(FOLDER, f"{name}.{label.replace(' ', '_')}.exr")
            words = [SPANDREL, "render", os.path.join(FOLDER, name + ".ron"), "-w", "picture", "-o", out, "-q"]
            for setting in settings:
                words += ["--set", setting]
            clock = time.time()
            made = subprocess.run(words, capture_output=True, text=True)
            seconds = time.time() - clock
            if made.returncode:
                sys.exit(made.stderr)
            row(label, seconds, picture(out))


main()
