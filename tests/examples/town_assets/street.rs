//! The road, its wires, lamps and people.

use spandrel_engine::scene::shape::Patch;
use spandrel_engine::scene::{Document, Object, Shape, Step};
use spandrel_tests::random::Random;

use super::FRONT;
use super::kit::*;

pub(crate) fn roads() -> Document {
    let materials = [
        ("asphalt", "#6a6866"),
        ("paint", "#dcd8cc"),
        ("kerb", "#b3ada2"),
        ("paving", "#a8a094"),
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
pub(crate) fn wires(near: f64, far: f64) -> Vec<Object> {
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
pub(crate) fn walker() -> Object {
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

pub(crate) fn walkers() -> Vec<Object> {
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

pub(crate) fn lamp() -> Object {
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

pub(crate) fn bench() -> Object {
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
pub(crate) fn kiosk() -> Object {
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
