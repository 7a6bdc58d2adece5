//! The kinds of house.

use glam::DVec3;
use spandrel_engine::math;
use spandrel_engine::scene::shape::Patch;
use spandrel_engine::scene::{Object, Shape};

use super::kit::*;

pub(crate) fn old_house(name: &str, width: f64, floors: u32, of: &str, shop: &str) -> Object {
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

pub(crate) fn town_house(name: &str, width: f64, floors: u32, of: &str) -> Object {
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
pub(crate) fn arch(x: f64, width: f64, y: f64, spring: f64, z: f64) -> Vec<DVec3> {
    let r = width / 2.0;
    let mut outline = vec![p(x - r, y, z), p(x + r, y, z)];
    for i in 0..=8 {
        let angle = std::f64::consts::PI * f64::from(i) / 8.0;
        outline.push(p(x + r * math::cos(angle), spring + r * math::sin(angle), z));
    }
    outline
}

/// Brick, with arched windows as seals and a stepped parapet.
pub(crate) fn warehouse(name: &str, width: f64) -> Object {
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
pub(crate) fn office(name: &str, width: f64, floors: u32) -> Object {
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
pub(crate) fn corner_house(name: &str) -> Object {
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
pub(crate) fn church() -> Object {
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
