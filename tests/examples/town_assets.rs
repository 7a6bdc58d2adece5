//! Writes the scenes of `graphs/town.ron`: `cargo run --release -p spandrel-tests --example town_assets`.
//!
//! A street at the end of the day: old gabled houses, mansards, a brick warehouse, an office behind a
//! concrete grid, a corner house with a turret, and a church where the street ends. Everything is made
//! of the primitives and instances of the scene format, so that the files stay small enough to read.

use glam::{DVec3, Vec3};
use spandrel_engine::color::Color;
use spandrel_engine::math;
use spandrel_engine::scene::read::text;
use spandrel_engine::scene::shape::Patch;
use spandrel_engine::scene::{
    Document, Face, Material, Mesh, Object, Plan, Seal, Shape, Sides, Step,
};
use spandrel_tests::random::Random;
use std::path::Path;

/// Where the street's sides stand.
const FRONT: f64 = 11.0;

fn main() {
    let folder = Path::new("graphs/assets/town");
    std::fs::create_dir_all(folder).expect("the folder can be made");
    for (name, document) in [
        ("buildings", buildings()),
        ("roads", roads()),
        ("trees", trees()),
        ("cars", cars()),
        ("sky", sky()),
    ] {
        let text = text::write(&document).expect("generated numbers are finite");
        let path = folder.join(format!("{name}.ron"));
        std::fs::write(&path, &text).expect("the file can be written");
        println!("{} ({} bytes)", path.display(), text.len());
    }
}

// Shorthands.

fn document(
    materials: &[(&str, &str)],
    definitions: Vec<Object>,
    children: Vec<Object>,
) -> Document {
    let mut document = Document::default();
    for (name, color) in materials {
        let hex = |i: usize| u8::from_str_radix(&color[i..i + 2], 16).expect("six digits");
        let color = Color::from_srgb8([hex(1), hex(3), hex(5)]);
        let round = |v: f32| (v * 1e4).round() / 1e4;
        let color = Color::new(round(color.r), round(color.g), round(color.b));
        document.materials.insert((*name).to_owned(), Material { color, ..Material::default() });
    }
    let root = Object { children, ..Object::default() };
    let mut plan = Plan { name: "town".to_owned(), root, ..Plan::default() };
    for object in definitions {
        let name = object.name.clone();
        plan.definitions.insert(name, Object { name: String::new(), ..object });
    }
    document.plans.push(plan);
    document
}

fn mm(v: f64) -> f64 {
    (v * 1000.0).round() / 1000.0
}

fn p(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(mm(x), mm(y), mm(z))
}

fn cuboid(name: &str, material: &str, at: [f64; 3], size: [f64; 3]) -> Object {
    let shape = Shape::Box { size: size.map(mm) };
    Object::new(name, shape).of(material).moved(at.map(mm))
}

fn group(name: &str, children: Vec<Object>) -> Object {
    Object { children, ..Object::new(name, Shape::Group) }
}

fn instance(of: &str) -> Object {
    Object::new("", Shape::Instance(of.to_owned()))
}

fn rows(of: &str, at: [f64; 3], count: [u32; 3], step: [f64; 3]) -> Object {
    let shape = Shape::Array { of: Box::new(instance(of)), count, step: step.map(mm) };
    Object::new("", shape).moved(at.map(mm))
}

/// A mesh by polygons, each with a material; no material is the object's own.
fn faces(name: &str, polygons: &[(&str, Vec<DVec3>)]) -> Object {
    let mut mesh = Mesh::default();
    for (material, polygon) in polygons {
        let ring: Vec<u32> = polygon
            .iter()
            .map(|q| {
                let known = mesh.points.iter().position(|known| known == q);
                known.map_or_else(|| mesh.add_point(*q), |at| at as u32)
            })
            .collect();
        let front = (!material.is_empty()).then(|| mesh.material(material));
        mesh.add_polygon(&ring, front).expect("three corners or more");
    }
    Object::new(name, Shape::Faces(mesh))
}

fn turned(mut object: Object, degrees: f64) -> Object {
    object.transform.0.push(Step::TurnY(degrees));
    object
}

/// The roof of a house whose ridge runs along x: `over` is how far it stands out.
fn gable(width: f64, depth: f64, eaves: f64, rise: f64, over: f64) -> Object {
    let (x, front, back) = (width / 2.0, 0.0, -depth);
    let ridge = -depth / 2.0;
    let drop = rise * over / (depth / 2.0);
    let (low, high) = (eaves - drop, eaves + rise);
    let tile = "tile";
    faces(
        "gable",
        &[
            (
                tile,
                vec![
                    p(-x - 0.3, low, front + over),
                    p(x + 0.3, low, front + over),
                    p(x + 0.3, high, ridge),
                    p(-x - 0.3, high, ridge),
                ],
            ),
            (
                tile,
                vec![
                    p(x + 0.3, low, back - over),
                    p(-x - 0.3, low, back - over),
                    p(-x - 0.3, high, ridge),
                    p(x + 0.3, high, ridge),
                ],
            ),
            ("", vec![p(x, eaves, front), p(x, eaves, back), p(x, high, ridge)]),
            ("", vec![p(-x, eaves, back), p(-x, eaves, front), p(-x, high, ridge)]),
            (
                "trim",
                vec![
                    p(-x - 0.3, low - 0.12, front + over),
                    p(x + 0.3, low - 0.12, front + over),
                    p(x + 0.3, low, front + over),
                    p(-x - 0.3, low, front + over),
                ],
            ),
        ],
    )
}

/// A roof steep below and nearly flat above.
fn mansard(width: f64, depth: f64, eaves: f64, rise: f64) -> Object {
    let inset = rise * 0.45;
    let (x, z0, z1) = (width / 2.0 + 0.15, 0.15, -depth - 0.15);
    let low = |x: f64, z: f64| p(x, eaves, z);
    let high = |x: f64, z: f64| p(x, eaves + rise, z);
    let (a, b, c, d) = (low(-x, z0), low(x, z0), low(x, z1), low(-x, z1));
    let (xi, f, g) = (x - inset, z0 - inset, z1 + inset);
    let (e, h, i, j) = (high(-xi, f), high(xi, f), high(xi, g), high(-xi, g));
    let slate = "slate";
    faces(
        "mansard",
        &[
            (slate, vec![a, b, h, e]),
            (slate, vec![b, c, i, h]),
            (slate, vec![c, d, j, i]),
            (slate, vec![d, a, e, j]),
            ("zinc", vec![e, h, i, j]),
        ],
    )
}

/// A window of a wall that faces +z: a frame that stands out, and glass with bars as seals.
fn window(name: &str, width: f64, height: f64, bars: [u32; 2], glass: &str) -> Object {
    let (x, z) = (width / 2.0, 0.05);
    let outline = vec![p(-x, 0.0, z), p(x, 0.0, z), p(x, height, z), p(-x, height, z)];
    let mut seals = Vec::new();
    let mut bar = |x0: f64, y0: f64, x1: f64, y1: f64| {
        let outline = vec![p(x0, y0, z), p(x1, y0, z), p(x1, y1, z), p(x0, y1, z)];
        seals.push(Patch { outline, material: Some("frame".to_owned()) });
    };
    let t = 0.045;
    for edge in [(-x, 0.0, x, 2.0 * t), (-x, height - 2.0 * t, x, height)] {
        bar(edge.0, edge.1, edge.2, edge.3);
    }
    bar(-x, 0.0, -x + 2.0 * t, height);
    bar(x - 2.0 * t, 0.0, x, height);
    for i in 1..bars[0] {
        let at = -x + width * f64::from(i) / f64::from(bars[0]);
        bar(at - t / 2.0, 0.0, at + t / 2.0, height);
    }
    for i in 1..bars[1] {
        let at = height * f64::from(i) / f64::from(bars[1]);
        bar(-x, at - t / 2.0, x, at + t / 2.0);
    }
    let glass = Object::new("glass", Shape::Polygon { outline, holes: vec![], seals }).of(glass);
    let sill = cuboid("sill", "trim", [0.0, -0.12, 0.0], [width + 0.24, 0.12, 0.34]);
    let lintel = cuboid("lintel", "trim", [0.0, height, 0.0], [width + 0.24, 0.16, 0.2]);
    group(name, vec![glass, sill, lintel])
}

/// Evenly spaced windows: floors from `y`, over `width`, at the depth `z`.
fn grid(of: &str, width: f64, columns: u32, y: f64, floors: u32, storey: f64, z: f64) -> Object {
    let pitch = width / f64::from(columns);
    let x = -width / 2.0 + pitch / 2.0;
    rows(of, [x, y, z], [columns, floors, 1], [pitch, storey, 0.0])
}

/// The same on the wall at the right (1) or left (-1).
fn side_grid(
    of: &str,
    side: f64,
    [width, depth]: [f64; 2],
    columns: u32,
    y: f64,
    floors: u32,
    storey: f64,
) -> Object {
    let all = grid(of, depth, columns, y, floors, storey, 0.0);
    turned(group("side", vec![all]), 90.0 * side).moved([
        mm(side * width / 2.0),
        0.0,
        mm(-depth / 2.0),
    ])
}

fn shop(name: &str, width: f64, awning: &str) -> Object {
    let x = width / 2.0;
    let z = 0.12;
    let pane = |x0: f64, x1: f64, y0: f64, y1: f64| {
        vec![p(x0, y0, z), p(x1, y0, z), p(x1, y1, z), p(x0, y1, z)]
    };
    let seals = [
        (pane(-x + 0.3, -0.75, 0.5, 2.5), "glass_warm"),
        (pane(0.75, x - 0.3, 0.5, 2.5), "glass_warm"),
        (pane(-0.55, 0.55, 0.05, 2.5), "door"),
        (pane(-0.4, 0.4, 1.1, 2.3), "glass"),
    ];
    let seals = seals.map(|(outline, m)| Patch { outline, material: Some(m.to_owned()) }).to_vec();
    let front = Shape::Polygon { outline: pane(-x, x, 0.0, 3.1), holes: vec![], seals };
    let (y0, y1, out) = (2.55, 3.05, 1.3);
    let cloth = |i: u32| if i.is_multiple_of(2) { awning } else { "cloth" };
    let stripes = (width / 0.5).round() as u32;
    let mut polygons: Vec<(&str, Vec<DVec3>)> = Vec::new();
    for i in 0..stripes {
        let a = -x + width * f64::from(i) / f64::from(stripes);
        let b = -x + width * f64::from(i + 1) / f64::from(stripes);
        polygons.push((cloth(i), vec![p(a, y0, out), p(b, y0, out), p(b, y1, z), p(a, y1, z)]));
        polygons.push((
            cloth(i),
            vec![p(a, y0 - 0.2, out), p(b, y0 - 0.2, out), p(b, y0, out), p(a, y0, out)],
        ));
    }
    group(name, vec![Object::new("front", front).of("shopfront"), faces("awning", &polygons)])
}

fn chimney(x: f64, y: f64, z: f64, height: f64) -> Object {
    let pots = rows("pot", [x - 0.3, y + height, z], [3, 1, 1], [0.3, 0.0, 0.0]);
    group("chimney", vec![cuboid("stack", "brick", [x, y, z], [1.2, height, 0.6]), pots])
}

fn buildings() -> Document {
    let materials = [
        ("plaster", "#d3c4a6"),
        ("ochre", "#c6a677"),
        ("rose", "#bd9382"),
        ("cream", "#e0d8c4"),
        ("sage", "#a5ac95"),
        ("stone", "#b7ad9c"),
        ("grey stone", "#98948c"),
        ("brick", "#86584a"),
        ("dark brick", "#6b4a41"),
        ("concrete", "#b4b1a9"),
        ("tile", "#96634f"),
        ("slate", "#59616b"),
        ("zinc", "#7e868c"),
        ("trim", "#ece4d2"),
        ("frame", "#f0ebdf"),
        ("glass", "#3d4d5a"),
        ("glass_warm", "#d8a25e"),
        ("glass_sky", "#8ba3b4"),
        ("door", "#54423a"),
        ("iron", "#34383a"),
        ("shopfront", "#4d5c52"),
        ("cloth", "#efe6d0"),
        ("red", "#9b5246"),
        ("green", "#637a62"),
        ("blue", "#62778d"),
        ("copper", "#86a093"),
        ("dark", "#2c3136"),
        ("hill", "#8d9a86"),
        ("far", "#a9a79f"),
    ];
    let mut definitions = vec![
        window("window", 1.1, 1.7, [2, 3], "glass"),
        window("tall window", 1.15, 2.3, [2, 4], "glass_sky"),
        window("sunlit window", 1.1, 1.8, [2, 2], "glass_warm"),
        window("small window", 0.8, 1.1, [2, 2], "glass"),
        shop("red shop", 5.2, "red"),
        shop("green shop", 5.2, "green"),
        shop("blue shop", 4.6, "blue"),
        Object::new(
            "pot",
            Shape::Cone { radius: 0.1, top_radius: 0.13, height: 0.45, segments: 10, smooth: true },
        )
        .of("tile"),
    ];
    // A balcony: a slab, and a rail of thin bars.
    let rail = rows("bar", [-0.75, 0.15, 0.62], [11, 1, 1], [0.15, 0.0, 0.0]);
    definitions.push(cuboid("bar", "iron", [0.0; 3], [0.03, 0.85, 0.03]));
    definitions.push(group(
        "balcony",
        vec![
            cuboid("slab", "trim", [0.0, 0.0, 0.35], [1.7, 0.14, 0.7]),
            cuboid("rail", "iron", [0.0, 1.0, 0.62], [1.7, 0.06, 0.06]),
            rail,
        ],
    ));
    // A dormer: a little house in the roof.
    definitions.push(group(
        "dormer",
        vec![
            cuboid("cheeks", "trim", [0.0, 0.0, -0.9], [1.5, 1.7, 1.8]),
            instance("small window").moved([0.0, 0.35, 0.0]),
            faces(
                "roof",
                &[
                    (
                        "slate",
                        vec![
                            p(-0.9, 1.7, 0.15),
                            p(0.0, 2.25, 0.15),
                            p(0.0, 2.25, -1.9),
                            p(-0.9, 1.7, -1.9),
                        ],
                    ),
                    (
                        "slate",
                        vec![
                            p(0.9, 1.7, -1.9),
                            p(0.0, 2.25, -1.9),
                            p(0.0, 2.25, 0.15),
                            p(0.9, 1.7, 0.15),
                        ],
                    ),
                    ("trim", vec![p(-0.9, 1.7, 0.0), p(0.9, 1.7, 0.0), p(0.0, 2.25, 0.0)]),
                ],
            ),
        ],
    ));
    definitions.extend([
        old_house("old house", 11.0, 2, "window", "red shop"),
        old_house("narrow house", 7.6, 3, "window", "green shop"),
        old_house("low house", 13.0, 1, "sunlit window", "blue shop"),
        town_house("town house", 14.0, 4, "tall window"),
        town_house("sunlit town house", 17.0, 5, "sunlit window"),
        warehouse("warehouse", 18.0),
        office("office", 20.0, 6),
        office("tall office", 16.0, 9),
        corner_house("corner house"),
    ]);
    let mut children = Vec::new();
    // (kind, frontage, colour), from near to far; blocks are divided by two side streets.
    let left: [&[(&str, f64, &str)]; 4] = [
        &[
            ("corner house", 12.0, "plaster"),
            ("town house", 14.0, "cream"),
            ("narrow house", 7.6, "rose"),
            ("old house", 11.0, "ochre"),
        ],
        &[
            ("corner house", 12.0, "cream"),
            ("office", 20.0, "concrete"),
            ("old house", 11.0, "plaster"),
            ("town house", 14.0, "stone"),
        ],
        &[
            ("sunlit town house", 17.0, "plaster"),
            ("low house", 13.0, "sage"),
            ("tall office", 16.0, "concrete"),
            ("narrow house", 7.6, "ochre"),
        ],
        &[
            ("town house", 14.0, "cream"),
            ("old house", 11.0, "rose"),
            ("sunlit town house", 17.0, "stone"),
            ("old house", 11.0, "cream"),
        ],
    ];
    let right: [&[(&str, f64, &str)]; 4] = [
        &[
            ("town house", 14.0, "plaster"),
            ("low house", 13.0, "ochre"),
            ("warehouse", 18.0, "brick"),
            ("narrow house", 7.6, "sage"),
        ],
        &[
            ("sunlit town house", 17.0, "cream"),
            ("narrow house", 7.6, "rose"),
            ("town house", 14.0, "stone"),
            ("old house", 11.0, "ochre"),
        ],
        &[
            ("warehouse", 18.0, "dark brick"),
            ("old house", 11.0, "cream"),
            ("office", 20.0, "concrete"),
        ],
        &[
            ("old house", 11.0, "plaster"),
            ("town house", 14.0, "rose"),
            ("low house", 13.0, "cream"),
            ("town house", 14.0, "plaster"),
        ],
    ];
    for (side, blocks) in [(-1.0, left), (1.0, right)] {
        let mut z = if side < 0.0 { 2.0 } else { 6.0 };
        for (b, block) in blocks.iter().enumerate() {
            for (i, (kind, frontage, color)) in block.iter().enumerate() {
                let name = format!("{} {b}{i} {kind}", if side < 0.0 { "left" } else { "right" });
                let mut house = Object { name, ..instance(kind) }.of(*color);
                // Turrets stand at the near corner on both sides.
                if side < 0.0 && *kind == "corner house" {
                    house.transform.0.push(Step::Stretch(-1.0, 1.0, 1.0));
                }
                let place = [mm(side * FRONT), 0.15, mm(z - frontage / 2.0)];
                children.push(turned(house, -90.0 * side).moved(place));
                z -= frontage + 0.05;
            }
            z -= 11.0;
        }
    }
    children.push(church().moved([0.0, 0.15, -256.0]));
    children.extend(skyline());
    document(&materials, definitions, children)
}

fn old_house(name: &str, width: f64, floors: u32, of: &str, shop: &str) -> Object {
    let (depth, storey, ground) = (10.0, 3.0, 3.4);
    let eaves = ground + storey * f64::from(floors);
    let columns = (width / 2.3) as u32;
    let mut parts = vec![
        Object::new("walls", Shape::Box { size: [width, eaves, depth] }).moved([
            0.0,
            0.0,
            -depth / 2.0,
        ]),
        cuboid(
            "band",
            "trim",
            [0.0, ground - 0.15, -depth / 2.0],
            [width + 0.2, 0.22, depth + 0.2],
        ),
        gable(width, depth, eaves, depth * 0.42, 0.5),
        grid(of, width - 0.6, columns, ground + 0.75, floors, storey, 0.0),
        side_grid("small window", 1.0, [width, depth], 3, ground + 0.9, floors, storey),
        side_grid("small window", -1.0, [width, depth], 3, ground + 0.9, floors, storey),
        chimney(width * 0.3, eaves + depth * 0.3, -depth * 0.55, 2.2),
    ];
    let shops = ((width - 0.5) / 5.5) as u32;
    let pitch = width / f64::from(shops);
    parts.push(rows(
        shop,
        [-width / 2.0 + pitch / 2.0, 0.0, 0.0],
        [shops, 1, 1],
        [pitch, 0.0, 0.0],
    ));
    group(name, parts)
}

fn town_house(name: &str, width: f64, floors: u32, of: &str) -> Object {
    let (depth, storey, ground) = (12.0, 3.5, 4.2);
    let eaves = ground + storey * f64::from(floors - 1);
    let columns = (width / 2.5) as u32;
    let pitch = (width - 0.8) / f64::from(columns);
    let first = -(width - 0.8) / 2.0 + pitch / 2.0;
    let mut parts = vec![
        Object::new("walls", Shape::Box { size: [width, eaves, depth] }).moved([
            0.0,
            0.0,
            -depth / 2.0,
        ]),
        cuboid("base", "grey stone", [0.0, 0.0, -depth / 2.0], [width + 0.3, 0.9, depth + 0.3]),
        cuboid(
            "band",
            "trim",
            [0.0, ground - 0.3, -depth / 2.0],
            [width + 0.36, 0.35, depth + 0.36],
        ),
        cuboid(
            "cornice",
            "trim",
            [0.0, eaves - 0.4, -depth / 2.0],
            [width + 0.7, 0.4, depth + 0.7],
        ),
        mansard(width, depth, eaves, 3.0),
        grid(of, width - 0.8, columns, ground + 0.5, floors - 1, storey, 0.0),
        rows("balcony", [first, ground + storey + 0.12, 0.0], [columns, 1, 1], [pitch, 0.0, 0.0]),
        rows(
            "dormer",
            [first + pitch / 2.0, eaves + 0.35, -0.35],
            [columns - 1, 1, 1],
            [pitch, 0.0, 0.0],
        ),
        side_grid("window", 1.0, [width, depth], 4, ground + 0.6, floors - 1, storey),
        side_grid("window", -1.0, [width, depth], 4, ground + 0.6, floors - 1, storey),
        chimney(-width * 0.38, eaves + 1.4, -depth * 0.5, 3.0),
        chimney(width * 0.38, eaves + 1.4, -depth * 0.5, 3.0),
    ];
    let shops = (width / 6.0) as u32;
    let pitch = width / f64::from(shops);
    let kinds = ["green shop", "blue shop", "red shop"];
    for i in 0..shops {
        let x = -width / 2.0 + pitch * (f64::from(i) + 0.5);
        let kind = kinds[(i as usize + floors as usize) % 3];
        parts.push(instance(kind).moved([mm(x), 0.0, 0.16]));
    }
    group(name, parts)
}

/// A polygon's outline with a round arch on top, in the plane z.
fn arch(x: f64, width: f64, y: f64, spring: f64, z: f64) -> Vec<DVec3> {
    let r = width / 2.0;
    let mut outline = vec![p(x - r, y, z), p(x + r, y, z)];
    for i in 0..=8 {
        let angle = std::f64::consts::PI * f64::from(i) / 8.0;
        outline.push(p(x + r * math::cos(angle), spring + r * math::sin(angle), z));
    }
    outline
}

/// Brick, with arched windows as seals and a stepped parapet.
fn warehouse(name: &str, width: f64) -> Object {
    let (depth, storey, floors) = (14.0, 4.2, 3u32);
    let height = storey * f64::from(floors) + 0.8;
    let x = width / 2.0;
    let columns = 6u32;
    let pitch = width / f64::from(columns);
    let mut seals = Vec::new();
    for floor in 0..floors {
        for column in 0..columns {
            let at = -x + pitch * (f64::from(column) + 0.5);
            let y = storey * f64::from(floor) + 0.9;
            let is_gate = floor == 0 && column % 3 == 1;
            let (low, glass) = if is_gate { (0.0, "door") } else { (y, "glass") };
            let ring = |grow: f64| arch(at, 1.7 + grow, low - grow / 4.0, y + 1.5, 0.0);
            seals.push(Patch { outline: ring(0.35), material: Some("stone".to_owned()) });
            seals.push(Patch { outline: ring(0.0), material: Some(glass.to_owned()) });
            for bar in 1..4 {
                let bx = at - 0.85 + 1.7 * f64::from(bar) / 4.0;
                let bars = vec![
                    p(bx - 0.03, low, 0.0),
                    p(bx + 0.03, low, 0.0),
                    p(bx + 0.03, y + 2.1, 0.0),
                    p(bx - 0.03, y + 2.1, 0.0),
                ];
                seals.push(Patch { outline: bars, material: Some("iron".to_owned()) });
            }
        }
    }
    let front = vec![
        p(-x, 0.0, 0.0),
        p(x, 0.0, 0.0),
        p(x, height, 0.0),
        p(x * 0.4, height, 0.0),
        p(x * 0.4, height + 1.2, 0.0),
        p(-x * 0.4, height + 1.2, 0.0),
        p(-x * 0.4, height, 0.0),
        p(-x, height, 0.0),
    ];
    let tank = group(
        "tank",
        vec![
            Object::new(
                "body",
                Shape::Cylinder { radius: 1.6, height: 2.6, segments: 24, smooth: true },
            )
            .of("door")
            .moved([0.0, 1.4, 0.0]),
            Object::new(
                "lid",
                Shape::Cone {
                    radius: 1.75,
                    top_radius: 0.0,
                    height: 0.9,
                    segments: 24,
                    smooth: true,
                },
            )
            .of("zinc")
            .moved([0.0, 4.0, 0.0]),
            rows("bar", [-1.0, 0.0, -1.0], [2, 2, 2], [2.0, 0.75, 2.0]),
        ],
    );
    group(
        name,
        vec![
            Object::new("walls", Shape::Box { size: [width, height - 0.4, depth] }).moved([
                0.0,
                0.0,
                -depth / 2.0 - 0.02,
            ]),
            Object::new("front", Shape::Polygon { outline: front, holes: vec![], seals }),
            cuboid("coping", "stone", [0.0, height + 1.15, 0.0], [width * 0.4 + 0.3, 0.2, 0.5]),
            side_grid("window", 1.0, [width, depth], 4, 1.4, 3, storey),
            side_grid("window", -1.0, [width, depth], 4, 1.4, 3, storey),
            tank.moved([3.5, mm(height - 0.4), -7.0]),
        ],
    )
}

/// A concrete grid with holes, glass behind it.
fn office(name: &str, width: f64, floors: u32) -> Object {
    let (depth, storey) = (13.0, 3.3);
    let height = 4.4 + storey * f64::from(floors);
    let x = width / 2.0;
    let columns = (width / 2.0) as u32;
    let screen = |width: f64, columns: u32| {
        let x = width / 2.0;
        let pitch = (width - 0.6) / f64::from(columns);
        let mut holes = Vec::new();
        for floor in 0..floors {
            for column in 0..columns {
                let a = -x + 0.3 + pitch * f64::from(column) + 0.16;
                let (b, y) = (a + pitch - 0.32, 4.4 + storey * f64::from(floor) + 0.55);
                holes.push(vec![
                    p(a, y, 0.0),
                    p(b, y, 0.0),
                    p(b, y + storey - 0.8, 0.0),
                    p(a, y + storey - 0.8, 0.0),
                ]);
            }
        }
        let outline = vec![
            p(-x, 4.0, 0.0),
            p(x, 4.0, 0.0),
            p(x, height + 0.7, 0.0),
            p(-x, height + 0.7, 0.0),
        ];
        Object::new("screen", Shape::Polygon { outline, holes, seals: vec![] })
    };
    let front = screen(width, columns);
    let side = screen(depth, 6);
    let glass = |w: f64, d: f64, h: f64| Object::new("glass", Shape::Box { size: [w, h, d] });
    let lobby = vec![
        glass(width - 2.4, depth - 2.4, 4.0).of("glass_warm").moved([0.0, 0.0, -depth / 2.0]),
        rows(
            "column",
            [-x + 0.6, 0.0, -0.6],
            [(width / 4.0) as u32, 1, 2],
            [(width - 1.2) / f64::from((width / 4.0) as u32 - 1), 0.0, -(depth - 1.2)],
        ),
    ];
    let column = Object::new(
        "column",
        Shape::Cylinder { radius: 0.3, height: 4.0, segments: 20, smooth: true },
    );
    let mut parts = vec![
        glass(width - 1.0, depth - 1.0, height - 4.2).of("glass_sky").moved([
            0.0,
            4.2,
            -depth / 2.0,
        ]),
        cuboid("slab", "concrete", [0.0, 3.8, -depth / 2.0], [width, 0.5, depth]),
        front,
        turned(side.clone(), 90.0).moved([x, 0.0, -depth / 2.0]),
        turned(side, -90.0).moved([-x, 0.0, -depth / 2.0]),
        cuboid("roof", "concrete", [0.0, height, -depth / 2.0], [width - 0.4, 0.3, depth - 0.4]),
        cuboid("plant", "zinc", [1.5, height + 0.3, -depth / 2.0], [width * 0.4, 2.2, depth * 0.4]),
    ];
    // The floors' edges, seen through the holes.
    for floor in 0..floors {
        let y = 4.4 + storey * f64::from(floor) - 0.1;
        parts.push(cuboid(
            "floor",
            "concrete",
            [0.0, y, -depth / 2.0],
            [width - 0.5, 0.35, depth - 0.5],
        ));
    }
    parts.extend(lobby.into_iter().map(|mut part| {
        if let Shape::Array { of, .. } = &mut part.shape {
            **of = column.clone();
        }
        part
    }));
    group(name, parts)
}

/// A house with a round turret at its corner.
fn corner_house(name: &str) -> Object {
    let (width, depth, storey, ground, floors) = (12.0, 11.0, 3.3, 4.0, 3u32);
    let eaves = ground + storey * f64::from(floors);
    let (tx, tz, r) = (width / 2.0 - 1.2, -1.2, 2.3);
    let mut parts = vec![
        Object::new("walls", Shape::Box { size: [width, eaves, depth] }).moved([
            0.0,
            0.0,
            -depth / 2.0,
        ]),
        cuboid("band", "trim", [0.0, ground - 0.2, -depth / 2.0], [width + 0.3, 0.3, depth + 0.3]),
        cuboid(
            "cornice",
            "trim",
            [0.0, eaves - 0.3, -depth / 2.0],
            [width + 0.6, 0.3, depth + 0.6],
        ),
        mansard(width, depth, eaves, 3.2),
        grid("tall window", width - 3.4, 4, ground + 0.4, floors, storey, 0.0)
            .moved([-1.7, 0.0, 0.0]),
        side_grid("tall window", 1.0, [width, depth], 4, ground + 0.4, floors, storey),
        side_grid("window", -1.0, [width, depth], 3, ground + 0.6, floors, storey),
        instance("green shop").moved([-3.0, 0.0, 0.12]),
        Object::new(
            "turret",
            Shape::Cylinder { radius: r, height: eaves + 2.2, segments: 48, smooth: true },
        )
        .moved([tx, 0.0, tz]),
        Object::new("ring", Shape::Torus { radius: r, tube: 0.16, segments: 48 })
            .of("trim")
            .moved([tx, ground, tz]),
        Object::new("ring", Shape::Torus { radius: r, tube: 0.2, segments: 48 })
            .of("trim")
            .moved([tx, eaves + 2.1, tz]),
        Object::new(
            "helm",
            Shape::Revolve {
                profile: vec![[2.75, 0.0], [2.1, 1.3], [1.2, 3.0], [0.5, 4.6], [0.0, 6.4]],
                segments: 48,
                angle: 360.0,
                smooth: true,
            },
        )
        .of("copper")
        .moved([tx, eaves + 2.2, tz]),
        Object::new("ball", Shape::Sphere { radius: 0.22, segments: 16 }).of("trim").moved([
            tx,
            eaves + 8.6,
            tz,
        ]),
        chimney(-3.0, eaves + 1.6, -depth * 0.5, 3.0),
    ];
    for floor in 0..floors {
        for turn in [-30.0, 15.0, 60.0, 105.0] {
            let y = ground + storey * f64::from(floor) + 0.4;
            let placed = turned(instance("tall window").moved([0.0, mm(y), r + 0.02]), turn);
            parts.push(placed.moved([tx, 0.0, tz]));
        }
    }
    group(name, parts)
}

/// The church at the end of the street.
fn church() -> Object {
    let (w, tower) = (7.0, 30.0);
    let mut seals = Vec::new();
    let circle = |r: f64, y: f64| -> Vec<DVec3> {
        (0..24)
            .map(|i| {
                let a = std::f64::consts::TAU * f64::from(i) / 24.0;
                p(r * math::cos(a), y + r * math::sin(a), 0.0)
            })
            .collect()
    };
    let mut add = |outline: Vec<DVec3>, material: &str| {
        seals.push(Patch { outline, material: Some(material.to_owned()) });
    };
    add(arch(0.0, 3.6, 0.0, 3.6, 0.0), "trim");
    add(arch(0.0, 2.8, 0.0, 3.4, 0.0), "door");
    add(circle(2.0, 11.0), "trim");
    add(circle(1.7, 11.0), "glass_warm");
    for x in [-1.5, 1.5] {
        add(arch(x, 1.5, 21.0, 25.0, 0.0), "trim");
        add(arch(x, 1.1, 21.2, 24.8, 0.0), "dark");
    }
    let outline = vec![
        p(-w / 2.0, 0.0, 0.0),
        p(w / 2.0, 0.0, 0.0),
        p(w / 2.0, tower, 0.0),
        p(-w / 2.0, tower, 0.0),
    ];
    let mut parts = vec![
        Object::new("tower", Shape::Box { size: [w, tower, w] }).moved([0.0, 0.0, -w / 2.0 - 0.02]),
        Object::new("face", Shape::Polygon { outline, holes: vec![], seals }),
        cuboid("ledge", "trim", [0.0, 18.5, -w / 2.0], [w + 0.6, 0.5, w + 0.6]),
        cuboid("ledge", "trim", [0.0, tower, -w / 2.0], [w + 0.8, 0.6, w + 0.8]),
        Object::new(
            "spire",
            Shape::Cone { radius: 4.4, top_radius: 0.0, height: 26.0, segments: 8, smooth: false },
        )
        .of("copper")
        .moved([0.0, tower + 0.6, -w / 2.0]),
        Object::new("nave", Shape::Box { size: [16.0, 12.0, 40.0] }).moved([0.0, 0.0, -25.0]),
        turned(gable(40.0, 16.0, 12.0, 9.0, 0.6), 90.0).moved([8.0, 0.0, -25.0]),
    ];
    for x in [-1.0, 1.0] {
        for (y, z) in [(0.0, 0.3), (0.0, -w - 0.3)] {
            parts.push(cuboid("buttress", "stone", [x * w / 2.0, y, z], [1.2, 20.0, 1.2]));
        }
    }
    let mut church = group("church", parts).of("stone");
    for part in &mut church.children {
        if part.name == "nave" {
            part.material = Some("stone".to_owned());
        }
    }
    church
}

/// Hills and blocks far behind.
fn skyline() -> Vec<Object> {
    let mut random = Random::new(12);
    let mut all = Vec::new();
    for i in 0..46 {
        let side = if i % 2 == 0 { -1.0 } else { 1.0 };
        let z = -random.between(60.0, 520.0);
        let x = side * random.between(34.0, 90.0 - z * 0.55);
        let size =
            [random.between(12.0, 26.0), random.between(10.0, 26.0), random.between(12.0, 26.0)];
        let color = ["far", "stone", "plaster", "rose", "cream", "brick"][random.below(6) as usize];
        let name = format!("far {i}");
        let roof = if random.below(3) == 0 { 0.0 } else { 4.0 };
        let mut parts = vec![Object::new("walls", Shape::Box { size: size.map(mm) })];
        if roof > 0.0 {
            parts.push(gable(mm(size[0]), mm(size[2]), mm(size[1]), roof, 0.4).moved([
                0.0,
                0.0,
                mm(size[2] / 2.0),
            ]));
        }
        all.push(group(&name, parts).of(color).moved([mm(x), 0.0, mm(z)]));
    }
    let hills = Shape::Terrain {
        size: [2600.0, 900.0],
        height: 150.0,
        roughness: 0.5,
        levels: 6,
        seed: 5,
        smooth: true,
    };
    all.push(Object::new("hills", hills).of("hill").moved([0.0, -20.0, -1400.0]));
    all
}

fn roads() -> Document {
    let materials = [
        ("asphalt", "#6a6866"),
        ("paint", "#dcd8cc"),
        ("kerb", "#b3ada2"),
        ("paving", "#a8a094"),
        ("setts", "#8c857b"),
        ("rail", "#9da3a6"),
        ("iron", "#34383a"),
        ("lamp", "#f3e3bd"),
        ("earth", "#8f8a72"),
        ("green", "#5c7a5e"),
        ("wood", "#8a6a48"),
        ("skin", "#c99f84"),
        ("coat brown", "#6d5646"),
        ("coat blue", "#48576b"),
        ("coat green", "#5d6a55"),
        ("coat cream", "#cbbfa6"),
        ("coat wine", "#74453f"),
    ];
    let (near, far) = (60.0, -250.0);
    let mut seals = Vec::new();
    let mut paint = |x0: f64, x1: f64, z0: f64, z1: f64| {
        let outline = vec![p(x0, 0.0, z1), p(x1, 0.0, z1), p(x1, 0.0, z0), p(x0, 0.0, z0)];
        seals.push(Patch { outline, material: Some("paint".to_owned()) });
    };
    for i in 0..50 {
        let z = near - f64::from(i) * 6.0;
        paint(-3.35, -3.2, z - 2.6, z);
        paint(3.2, 3.35, z - 2.6, z);
    }
    // Zebra crossings before each side street.
    for z in [-44.5, -60.0, -113.0, -129.0] {
        for i in 0..8 {
            let x = -6.3 + f64::from(i) * 1.7;
            paint(x, x + 0.75, z - 1.6, z + 1.6);
        }
    }
    let outline = vec![p(-7.0, 0.0, near), p(7.0, 0.0, near), p(7.0, 0.0, far), p(-7.0, 0.0, far)];
    let road = Object::new("road", Shape::Polygon { outline, holes: vec![], seals }).of("asphalt");
    let earth = vec![
        p(-1500.0, -0.05, 80.0),
        p(1500.0, -0.05, 80.0),
        p(1500.0, -0.05, -3000.0),
        p(-1500.0, -0.05, -3000.0),
    ];
    let earth =
        Object::new("earth", Shape::Polygon { outline: earth, holes: vec![], seals: vec![] })
            .of("earth");
    let mut children = vec![earth, road];
    for z in [-52.3, -121.0, -181.0] {
        let outline = vec![
            p(-200.0, -0.02, z + 5.0),
            p(200.0, -0.02, z + 5.0),
            p(200.0, -0.02, z - 5.0),
            p(-200.0, -0.02, z - 5.0),
        ];
        children.push(
            Object::new(
                format!("street {z}"),
                Shape::Polygon { outline, holes: vec![], seals: vec![] },
            )
            .of("asphalt"),
        );
    }
    // Tram rails: two tracks of two.
    for x in [-2.35, -0.9, 0.9, 2.35] {
        children.push(cuboid(
            &format!("rail {x}"),
            "rail",
            [x, 0.0, (near + far) / 2.0],
            [0.09, 0.02, near - far],
        ));
    }
    let mut definitions = vec![lamp(), bench()];
    // Pavements with kerbs, block by block.
    for side in [-1.0, 1.0] {
        for (i, (z0, z1)) in
            [(60.0, -47.0), (-57.6, -115.8), (-126.2, -175.8), (-186.2, -250.0)].iter().enumerate()
        {
            let (inner, outer) = (7.0 * side, 40.0 * side);
            let (a, b) = if side > 0.0 { (inner, outer) } else { (outer, inner) };
            let outline = vec![[a, *z0], [b, *z0], [b, *z1], [a, *z1]];
            let name = format!("{} pavement {i}", if side > 0.0 { "right" } else { "left" });
            children.push(
                Object::new(name.clone(), Shape::Prism { outline, holes: vec![], height: 0.15 })
                    .of("paving"),
            );
            let edge = [7.12 * side, 0.0, (z0 + z1) / 2.0];
            children.push(cuboid(&format!("{name} kerb"), "kerb", edge, [0.3, 0.17, z0 - z1]));
        }
        let lamps = rows("lamp", [0.0; 3], [1, 1, 9], [0.0, 0.0, -26.0]);
        let lamps = Object { name: format!("lamps {side}"), ..lamps };
        children.push(turned(group("lamps", vec![lamps]), 0.0).moved([8.1 * side, 0.15, 8.0]));
        for i in 0..5 {
            let z = 2.0 - 38.0 * f64::from(i);
            let name = format!("bench {side} {i}");
            let seat = Object { name, ..instance("bench") };
            children.push(turned(seat, -90.0 * side).moved([mm(9.0 * side), 0.15, z]));
        }
    }
    children.push(kiosk().moved([8.9, 0.15, -30.0]));
    children.extend(wires(near, far));
    children.extend(walkers());
    definitions.push(walker());
    definitions.push(cuboid("slat", "wood", [0.0; 3], [1.7, 0.05, 0.12]));
    document(&materials, definitions, children)
}

/// The tram's wires, and the ropes between the houses that hold them.
fn wires(near: f64, far: f64) -> Vec<Object> {
    let mut all: Vec<Object> = [-1.62, 1.62]
        .iter()
        .map(|x| {
            cuboid(
                &format!("wire {x}"),
                "iron",
                [*x, 5.6, (near + far) / 2.0],
                [0.025, 0.025, near - far],
            )
        })
        .collect();
    for i in 0..9 {
        let z = 4.0 - 28.0 * f64::from(i);
        for side in [-1.0, 1.0] {
            let rope = vec![[-0.012, 0.0], [0.012, 0.0], [0.012, 0.024], [-0.012, 0.024]];
            let path = vec![p(FRONT * side, 8.2, z), p(1.62 * side, 5.62, z)];
            let shape = Shape::Sweep { profile: rope, path, closed: true, ring: false };
            all.push(Object::new(format!("rope {side} {i}"), shape).of("iron"));
        }
        all.push(cuboid(&format!("rope {i}"), "iron", [0.0, 5.6, z], [3.24, 0.024, 0.024]));
    }
    all
}

/// Somebody in a coat.
fn walker() -> Object {
    group(
        "walker",
        vec![
            Object::new(
                "coat",
                Shape::Revolve {
                    profile: vec![[0.2, 0.42], [0.24, 0.5], [0.21, 1.0], [0.24, 1.36], [0.1, 1.48]],
                    segments: 14,
                    angle: 360.0,
                    smooth: true,
                },
            ),
            Object::new("head", Shape::Sphere { radius: 0.115, segments: 14 })
                .of("skin")
                .moved([0.0, 1.62, 0.0]),
            Object::new(
                "hat",
                Shape::Cone {
                    radius: 0.16,
                    top_radius: 0.08,
                    height: 0.13,
                    segments: 14,
                    smooth: true,
                },
            )
            .of("iron")
            .moved([0.0, 1.68, 0.0]),
            cuboid("leg", "iron", [0.09, 0.0, 0.06], [0.11, 0.5, 0.13]),
            cuboid("leg", "iron", [-0.09, 0.0, -0.06], [0.11, 0.5, 0.13]),
        ],
    )
}

fn walkers() -> Vec<Object> {
    let mut random = Random::new(21);
    let coats = ["coat brown", "coat blue", "coat green", "coat cream", "coat wine"];
    (0..34)
        .map(|i| {
            let side = if i % 2 == 0 { -1.0 } else { 1.0 };
            let (x, z) = (
                side * random.between(9.1, 10.6),
                8.0 - 6.0 * f64::from(i) + random.between(-2.0, 2.0),
            );
            let mut somebody = instance("walker").of(coats[random.below(5) as usize]);
            somebody.name = format!("walker {i}");
            let size = mm(random.between(0.92, 1.06));
            somebody
                .transform
                .0
                .extend([Step::TurnY(mm(random.between(0.0, 360.0))), Step::Scale(size)]);
            somebody.moved([mm(x), 0.15, mm(z)])
        })
        .collect()
}

fn lamp() -> Object {
    group(
        "lamp",
        vec![
            Object::new(
                "foot",
                Shape::Cone {
                    radius: 0.22,
                    top_radius: 0.1,
                    height: 0.9,
                    segments: 16,
                    smooth: true,
                },
            )
            .of("iron"),
            Object::new(
                "pole",
                Shape::Cone {
                    radius: 0.08,
                    top_radius: 0.05,
                    height: 4.6,
                    segments: 12,
                    smooth: true,
                },
            )
            .of("iron"),
            Object::new("globe", Shape::Sphere { radius: 0.28, segments: 24 })
                .of("lamp")
                .moved([0.0, 4.85, 0.0]),
            Object::new(
                "cap",
                Shape::Cone {
                    radius: 0.24,
                    top_radius: 0.02,
                    height: 0.2,
                    segments: 16,
                    smooth: true,
                },
            )
            .of("iron")
            .moved([0.0, 5.1, 0.0]),
        ],
    )
}

fn bench() -> Object {
    let mut back = rows("slat", [0.0, 0.6, -0.25], [1, 3, 1], [0.0, 0.14, -0.02]);
    back.name = "back".to_owned();
    group(
        "bench",
        vec![
            Object {
                name: "seat".to_owned(),
                ..rows("slat", [0.0, 0.42, -0.15], [1, 1, 4], [0.0, 0.0, 0.14])
            },
            back,
            cuboid("leg", "iron", [-0.7, 0.0, 0.05], [0.07, 0.42, 0.5]),
            cuboid("leg", "iron", [0.7, 0.0, 0.05], [0.07, 0.42, 0.5]),
        ],
    )
}

/// A round column for bills.
fn kiosk() -> Object {
    group(
        "column for bills",
        vec![
            Object::new(
                "body",
                Shape::Cylinder { radius: 0.75, height: 3.0, segments: 40, smooth: true },
            )
            .of("green"),
            Object::new(
                "bills",
                Shape::Cylinder { radius: 0.77, height: 1.6, segments: 40, smooth: true },
            )
            .of("paint")
            .moved([0.0, 0.8, 0.0]),
            Object::new("rim", Shape::Torus { radius: 0.8, tube: 0.1, segments: 40 })
                .of("green")
                .moved([0.0, 3.0, 0.0]),
            Object::new(
                "dome",
                Shape::Revolve {
                    profile: vec![[0.85, 0.0], [0.8, 0.3], [0.55, 0.6], [0.2, 0.8], [0.0, 1.15]],
                    segments: 40,
                    angle: 360.0,
                    smooth: true,
                },
            )
            .of("green")
            .moved([0.0, 3.05, 0.0]),
        ],
    )
}

fn trees() -> Document {
    let materials = [
        ("bark", "#6b5a49"),
        ("leaves", "#7b8657"),
        ("gold leaves", "#ab9557"),
        ("rust leaves", "#9c714c"),
    ];
    let definitions = (0..3).map(|i| tree(&format!("tree {i}"), i)).collect();
    let mut random = Random::new(3);
    let mut children = Vec::new();
    let leaves = ["leaves", "leaves", "gold leaves", "leaves", "rust leaves"];
    for side in [-1.0, 1.0] {
        for i in 0..21 {
            let z = 14.0 - 12.5 * f64::from(i);
            // None where the side streets are.
            if [-52.3, -121.0, -181.0].iter().any(|street: &f64| (z - street).abs() < 7.0) {
                continue;
            }
            let kind = format!("tree {}", random.below(3));
            let (size, turn) = (mm(random.between(0.85, 1.2)), mm(random.between(0.0, 360.0)));
            let mut tree = instance(&kind).of(leaves[random.below(5) as usize]);
            tree.name = format!("{} {i}", if side < 0.0 { "left" } else { "right" });
            tree.transform.0.extend([Step::TurnY(turn), Step::Scale(size)]);
            children.push(tree.moved([mm(8.6 * side), 0.15, mm(z)]));
        }
    }
    document(&materials, definitions, children)
}

/// A tree of triangles: a trunk, boughs, and leaves whose normals are those of the crown.
fn tree(name: &str, seed: u64) -> Object {
    let mut random = Random::new(40 + seed);
    let mut parts = vec![
        Object::new(
            "trunk",
            Shape::Cone { radius: 0.2, top_radius: 0.1, height: 4.2, segments: 9, smooth: true },
        )
        .of("bark"),
    ];
    let mut mesh = Mesh::default();
    let crown = DVec3::new(0.0, 5.2, 0.0);
    let blobs: Vec<(DVec3, f64)> = (0..7)
        .map(|i| {
            let a = f64::from(i) * 2.4 + random.between(0.0, 0.6);
            let r = if i == 0 { 0.0 } else { random.between(0.7, 1.25) };
            let y = if i == 0 { 0.7 } else { random.between(-0.9, 1.2) };
            (crown + p(r * math::cos(a), y, r * math::sin(a)), random.between(0.95, 1.4))
        })
        .collect();
    for (at, _) in blobs.iter().skip(1) {
        let from = DVec3::new(0.0, 3.1, 0.0);
        let along = *at - from;
        let across = along.any_orthonormal_vector() * 0.055;
        let other = along.normalize().cross(across);
        let ring = [
            p(from.x, from.y, from.z) + across,
            from - across * 0.5 + other,
            from - across * 0.5 - other,
        ];
        let tip = p(at.x, at.y, at.z);
        let mut bough = Mesh::default();
        let corners: Vec<u32> = ring.iter().map(|q| bough.add_point(p(q.x, q.y, q.z))).collect();
        let top = bough.add_point(tip);
        for i in 0..3 {
            bough.add_polygon(&[corners[i], corners[(i + 1) % 3], top], None).expect("three");
        }
        parts.push(Object::new("bough", Shape::Faces(bough)).of("bark"));
    }
    for leaf in 0..820 {
        let (centre, radius) = blobs[leaf % blobs.len()];
        let mut direction = DVec3::new(
            random.between(-1.0, 1.0),
            random.between(-0.8, 1.0),
            random.between(-1.0, 1.0),
        );
        direction = direction.try_normalize().unwrap_or(DVec3::Y);
        let at = centre + direction * radius * random.between(0.62, 1.0);
        let out = (at - crown + DVec3::Y * 0.4).normalize() * 0.6 + direction * 0.4;
        let out = out.normalize();
        let lean = DVec3::new(
            random.between(-1.0, 1.0),
            random.between(-1.0, 1.0),
            random.between(-1.0, 1.0),
        );
        let u = (out + lean * 0.9).any_orthonormal_vector().normalize();
        let v = (out + lean * 0.5).normalize().cross(u).normalize();
        let size = random.between(0.15, 0.27);
        let shade = (random.between(0.7, 1.15)
            * (0.72 + 0.28 * ((at - crown).length() / 2.4).min(1.0))) as f32;
        let shade = (shade * 100.0).round() / 100.0;
        let mut corners: Vec<DVec3> = [0.2, 2.3, 4.4]
            .iter()
            .map(|angle| at + (u * math::cos(*angle) + v * math::sin(*angle)) * size)
            .collect();
        if (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(out) < 0.0 {
            corners.swap(1, 2);
        }
        let first = mesh.points.len() as u32;
        for corner in corners {
            mesh.points.push(p(corner.x, corner.y, corner.z));
            let n = out.as_vec3();
            let round = |v: f32| (v * 1000.0).round() / 1000.0;
            mesh.normals.push(Vec3::new(round(n.x), round(n.y), round(n.z)));
            mesh.colors.push([shade, shade, shade, 1.0]);
        }
        mesh.add_polygon(&[first, first + 1, first + 2], None).expect("three corners");
    }
    parts.push(Object::new("leaves", Shape::Faces(mesh)));
    group(name, parts)
}

fn cars() -> Document {
    let materials = [
        ("cream", "#d9cfb8"),
        ("wine", "#7a3b3c"),
        ("night", "#3d4d5e"),
        ("moss", "#5f6b4f"),
        ("silver", "#a9adb0"),
        ("tyre", "#2b2b2c"),
        ("hub", "#b9bcbd"),
        ("glass", "#33414b"),
        ("trim", "#d6d4cc"),
        ("lamp", "#f4e7c4"),
        ("rear lamp", "#a83a30"),
        ("tram red", "#8f3b33"),
        ("tram cream", "#e2d6b4"),
        ("iron", "#3a3d3f"),
    ];
    let definitions = vec![car(), wheel(), tram()];
    let mut children = Vec::new();
    let parked = [
        (-1.0, 6.0, "wine"),
        (-1.0, -9.0, "cream"),
        (-1.0, -16.0, "night"),
        (-1.0, -31.0, "silver"),
        (-1.0, -70.0, "moss"),
        (-1.0, -96.0, "cream"),
        (1.0, -2.0, "night"),
        (1.0, -14.0, "silver"),
        (1.0, -22.0, "moss"),
        (1.0, -66.0, "wine"),
        (1.0, -90.0, "cream"),
        (1.0, -140.0, "night"),
        (-1.0, -150.0, "wine"),
    ];
    for (i, (side, z, color)) in parked.iter().enumerate() {
        let mut car = instance("car").of(*color);
        car.name = format!("parked {i}");
        let turn = if *side < 0.0 { -90.0 } else { 90.0 };
        children.push(turned(car, turn).moved([mm(5.9 * side), 0.0, *z]));
    }
    for (i, (x, z, turn, color)) in [
        (-4.2, -24.0, -90.0, "cream"),
        (4.3, -38.0, 90.0, "wine"),
        (4.3, -82.0, 90.0, "silver"),
        (-4.2, -105.0, -90.0, "moss"),
    ]
    .iter()
    .enumerate()
    {
        let mut car = instance("car").of(*color);
        car.name = format!("driving {i}");
        children.push(turned(car, *turn).moved([*x, 0.0, *z]));
    }
    let mut line = instance("tram");
    line.name = "tram".to_owned();
    children.push(turned(line, 90.0).moved([-1.62, 0.02, -58.0]));
    document(&materials, definitions, children)
}

/// A closed side view drawn out along z: each edge has a material, the sides may have seals.
fn drawn(
    name: &str,
    outline: &[(f64, f64, &str)],
    width: f64,
    seals: &[(Vec<[f64; 2]>, &str)],
) -> Object {
    let mut mesh = Mesh::default();
    let half = width / 2.0;
    let n = outline.len() as u32;
    for z in [half, -half] {
        for (x, y, _) in outline {
            mesh.add_point(p(*x, *y, z));
        }
    }
    for i in 0..n {
        let j = (i + 1) % n;
        let material = outline[i as usize].2;
        let front = (!material.is_empty()).then(|| mesh.material(material));
        mesh.add_polygon(&[i, i + n, j + n, j], front).expect("four corners");
    }
    for (side, z) in [(0, half), (1, -half)] {
        let mut face = Face { outline: (0..n).map(|i| i + side * n).collect(), ..Face::default() };
        if side == 1 {
            face.outline.reverse();
        }
        for (seal, material) in seals {
            let outline = seal.iter().map(|q| mesh.add_point(p(q[0], q[1], z))).collect();
            let sides = Sides { front: Some(mesh.material(material)), ..Sides::default() };
            face.seals.push(Seal { outline, sides, edge: None });
        }
        mesh.add_face(face).expect("an outline");
    }
    Object::new(name, Shape::Faces(mesh))
}

/// A car of the fifties, 4.2 m long, its front to +x.
fn car() -> Object {
    // Counter-clockwise seen from +z.
    let body = [
        (-2.1, 0.32, ""),
        (2.1, 0.32, ""),
        (2.15, 0.62, ""),
        (2.0, 0.86, ""),
        (1.0, 0.98, "glass"),
        (0.42, 1.46, ""),
        (0.0, 1.53, ""),
        (-0.75, 1.5, "glass"),
        (-1.45, 1.02, ""),
        (-2.05, 0.88, ""),
        (-2.15, 0.6, ""),
    ];
    let seals = [
        (vec![[0.14, 1.0], [0.86, 1.0], [0.4, 1.4], [0.14, 1.42]], "glass"),
        (vec![[-0.02, 1.0], [-0.02, 1.44], [-0.7, 1.41], [-1.2, 1.04]], "glass"),
        (vec![[-2.05, 0.72], [2.06, 0.72], [2.06, 0.76], [-2.05, 0.76]], "trim"),
    ];
    let wheels = [[1.32, 0.78], [1.32, -0.78], [-1.3, 0.78], [-1.3, -0.78]];
    let mut parts = vec![drawn("body", &body, 1.66, &seals)];
    for (i, [x, z]) in wheels.iter().enumerate() {
        let mut wheel = instance("wheel");
        wheel.name = format!("wheel {i}");
        parts.push(wheel.moved([*x, 0.32, *z]));
    }
    for z in [-0.6, 0.6] {
        parts.push(
            Object::new("lamp", Shape::Sphere { radius: 0.13, segments: 16 })
                .of("lamp")
                .moved([2.08, 0.68, z]),
        );
        parts.push(cuboid("rear lamp", "rear lamp", [-2.14, 0.6, z], [0.08, 0.16, 0.2]));
    }
    parts.push(cuboid("bumper", "trim", [2.18, 0.38, 0.0], [0.1, 0.12, 1.6]));
    parts.push(cuboid("bumper", "trim", [-2.18, 0.38, 0.0], [0.1, 0.12, 1.6]));
    group("car", parts)
}

fn wheel() -> Object {
    let turn = |mut object: Object| {
        object.transform.0.insert(0, Step::TurnX(90.0));
        object
    };
    group(
        "wheel",
        vec![
            turn(
                Object::new("tyre", Shape::Torus { radius: 0.24, tube: 0.085, segments: 28 })
                    .of("tyre"),
            ),
            turn(
                Object::new(
                    "hub",
                    Shape::Cylinder { radius: 0.18, height: 0.12, segments: 20, smooth: true },
                )
                .of("hub"),
            )
            .moved([0.0, 0.0, -0.06]),
        ],
    )
}

/// A tram, 12 m long, its front to +x.
fn tram() -> Object {
    let body = [
        (-6.0, 0.5, ""),
        (6.0, 0.5, ""),
        (6.2, 1.5, "glass"),
        (6.05, 2.75, "tram cream"),
        (5.6, 3.2, "tram cream"),
        (-5.6, 3.2, "tram cream"),
        (-6.05, 2.75, "glass"),
        (-6.2, 1.5, ""),
    ];
    let mut seals: Vec<(Vec<[f64; 2]>, &str)> =
        vec![(vec![[-6.15, 1.7], [6.15, 1.7], [6.05, 2.75], [-6.05, 2.75]], "tram cream")];
    for i in 0..8 {
        let x = -5.6 + 1.42 * f64::from(i);
        seals.push((vec![[x, 1.75], [x + 1.2, 1.75], [x + 1.2, 2.65], [x, 2.65]], "glass"));
    }
    seals.push((vec![[-6.1, 1.3], [6.12, 1.3], [6.12, 1.36], [-6.1, 1.36]], "trim"));
    for x in [-4.3, 3.1] {
        seals.push((vec![[x, 0.6], [x + 1.1, 0.6], [x + 1.1, 2.65], [x, 2.65]], "tram cream"));
        seals.push((vec![[x + 0.1, 1.2], [x + 1.0, 1.2], [x + 1.0, 2.5], [x + 0.1, 2.5]], "glass"));
    }
    let mut parts = vec![
        drawn("body", &body, 2.3, &seals).of("tram red"),
        cuboid("roof", "iron", [0.0, 3.2, 0.0], [7.0, 0.25, 1.2]),
        cuboid("under", "iron", [0.0, 0.1, 0.0], [9.0, 0.4, 1.9]),
        faces(
            "pantograph",
            &[
                (
                    "iron",
                    vec![
                        p(-0.6, 3.45, -0.5),
                        p(0.6, 4.4, -0.5),
                        p(0.68, 4.4, -0.5),
                        p(-0.5, 3.45, -0.5),
                    ],
                ),
                (
                    "iron",
                    vec![
                        p(-0.6, 3.45, 0.5),
                        p(0.6, 4.4, 0.5),
                        p(0.68, 4.4, 0.5),
                        p(-0.5, 3.45, 0.5),
                    ],
                ),
            ],
        ),
        cuboid("bow", "iron", [0.64, 4.4, 0.0], [0.08, 0.06, 1.5]),
    ];
    for z in [-0.7, 0.7] {
        parts.push(
            Object::new("lamp", Shape::Sphere { radius: 0.15, segments: 16 })
                .of("lamp")
                .moved([6.12, 1.1, z]),
        );
    }
    group("tram", parts)
}

/// The sky: bands of colour on a wall far away, not lit.
fn sky() -> Document {
    let mut document = Document::default();
    let material = Material { color: Color::WHITE, unlit: true, ..Material::default() };
    document.materials.insert("sky".to_owned(), material);
    let mut mesh = Mesh::default();
    let bands: [(f64, [u8; 3]); 6] = [
        (-120.0, [0xe9, 0xcf, 0xa8]),
        (60.0, [0xee, 0xd6, 0xb0]),
        (300.0, [0xe6, 0xd6, 0xbf]),
        (700.0, [0xc9, 0xcf, 0xcb]),
        (1300.0, [0xa3, 0xbb, 0xc9]),
        (2600.0, [0x7d, 0xa2, 0xbd]),
    ];
    for (y, color) in bands {
        let color = Color::from_srgb8(color);
        for x in [-12000.0, 12000.0] {
            mesh.points.push(DVec3::new(x, y, -3600.0));
            mesh.colors.push([color.r, color.g, color.b, 1.0].map(|v| (v * 1e4).round() / 1e4));
        }
    }
    for i in 0..bands.len() as u32 - 1 {
        mesh.add_polygon(&[2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2], None).expect("four corners");
    }
    let root = Object {
        children: vec![Object::new("sky", Shape::Faces(mesh)).of("sky")],
        ..Object::default()
    };
    document.plans.push(Plan { name: "sky".to_owned(), root, ..Plan::default() });
    document
}
