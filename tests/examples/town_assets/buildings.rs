//! The buildings along the street and behind it.

use spandrel_engine::scene::{Document, Object, Shape, Step};
use spandrel_tests::random::Random;

use super::FRONT;
use super::houses::*;
use super::kit::*;

pub(crate) fn buildings() -> Document {
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

/// Hills and blocks far behind.
pub(crate) fn skyline() -> Vec<Object> {
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
