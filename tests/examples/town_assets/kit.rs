//! Shorthands, and the parts that houses have in common.

use glam::DVec3;
use spandrel_engine::color::Color;
use spandrel_engine::fragment::Optics;
use spandrel_engine::scene::shape::Patch;
use spandrel_engine::scene::{Document, Material, Mesh, Object, Plan, Shape, Step};
use std::collections::HashMap;

pub(crate) fn document(
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
        let mut material = Material { color, ..Material::default() };
        if name.starts_with("glass") {
            // A coated pane before a dim room: it mirrors a fifth of what is straight ahead.
            material.finish.diffuse = 0.4;
            material.finish.optics = Some(Optics { index: 2.6, ..Optics::default() });
        }
        document.materials.insert((*name).to_owned(), material);
    }
    let mut root = Object { children, ..Object::default() };
    number(&mut root);
    let mut plan = Plan { name: "town".to_owned(), root, ..Plan::default() };
    for mut object in definitions {
        number(&mut object);
        let name = object.name.clone();
        plan.definitions.insert(name, Object { name: String::new(), ..object });
    }
    document.plans.push(plan);
    document
}

/// Numbers those of an object's children that have one name, from the second on.
fn number(object: &mut Object) {
    let mut counts: HashMap<String, usize> = HashMap::new();
    for child in &mut object.children {
        number(child);
        let count = counts.entry(child.name.clone()).or_insert(0);
        *count += 1;
        if *count > 1 && !child.name.is_empty() {
            child.name = format!("{} {count}", child.name);
        }
    }
}

pub(crate) fn mm(v: f64) -> f64 {
    (v * 1000.0).round() / 1000.0
}

pub(crate) fn p(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(mm(x), mm(y), mm(z))
}

pub(crate) fn cuboid(name: &str, material: &str, at: [f64; 3], size: [f64; 3]) -> Object {
    let shape = Shape::Box { size: size.map(mm) };
    Object::new(name, shape).of(material).moved(at.map(mm))
}

pub(crate) fn group(name: &str, children: Vec<Object>) -> Object {
    Object { children, ..Object::new(name, Shape::Group) }
}

pub(crate) fn instance(of: &str) -> Object {
    Object::new("", Shape::Instance(of.to_owned()))
}

pub(crate) fn rows(of: &str, at: [f64; 3], count: [u32; 3], step: [f64; 3]) -> Object {
    let shape = Shape::Array { of: Box::new(instance(of)), count, step: step.map(mm) };
    Object::new("", shape).moved(at.map(mm))
}

/// A mesh by polygons, each with a material; no material is the object's own.
pub(crate) fn faces(name: &str, polygons: &[(&str, Vec<DVec3>)]) -> Object {
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

pub(crate) fn turned(mut object: Object, degrees: f64) -> Object {
    object.transform.0.push(Step::TurnY(degrees));
    object
}

/// The roof of a house whose ridge runs along x: `over` is how far it stands out.
pub(crate) fn gable(width: f64, depth: f64, eaves: f64, rise: f64, over: f64) -> Object {
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
pub(crate) fn mansard(width: f64, depth: f64, eaves: f64, rise: f64) -> Object {
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
pub(crate) fn window(name: &str, width: f64, height: f64, bars: [u32; 2], glass: &str) -> Object {
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
pub(crate) fn grid(
    of: &str,
    width: f64,
    columns: u32,
    y: f64,
    floors: u32,
    storey: f64,
    z: f64,
) -> Object {
    let pitch = width / f64::from(columns);
    let x = -width / 2.0 + pitch / 2.0;
    rows(of, [x, y, z], [columns, floors, 1], [pitch, storey, 0.0])
}

/// The same on the wall at the right (1) or left (-1).
pub(crate) fn side_grid(
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

pub(crate) fn shop(name: &str, width: f64, awning: &str) -> Object {
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

pub(crate) fn chimney(x: f64, y: f64, z: f64, height: f64) -> Object {
    let pots = rows("pot", [x - 0.3, y + height, z], [3, 1, 1], [0.3, 0.0, 0.0]);
    group("chimney", vec![cuboid("stack", "brick", [x, y, z], [1.2, height, 0.6]), pots])
}
