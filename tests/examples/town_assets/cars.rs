//! Cars and a tram.

use spandrel_engine::scene::{Document, Face, Mesh, Object, Seal, Shape, Sides, Step};

use super::kit::*;

pub(crate) fn cars() -> Document {
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
pub(crate) fn drawn(
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
pub(crate) fn car() -> Object {
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

pub(crate) fn wheel() -> Object {
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
pub(crate) fn tram() -> Object {
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
