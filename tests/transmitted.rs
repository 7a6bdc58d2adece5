//! Light that comes through leaves and paper: closed forms, shadows on the back, and trees of which one side is lit.

use spandrel_engine::image::Image;
use spandrel_tests::graphs::Nodes;
use spandrel_tests::program::Scratch;
use std::path::Path;
use std::sync::Arc;

fn picture(folder: &Path, nodes: &str) -> Arc<Image> {
    Nodes::new(folder, nodes).picture("picture", None).unwrap().image
}

const SHEET: &str = "Scene(
    materials: {
        \"paper\": (color: 0.5, finish: (transmit: (0.6, 0.4, 0.2))),
        \"card\": (color: 0.5),
    },
    plans: [(name: \"p\", root: (children: [
        (name: \"paper\", material: \"paper\", shape: Polygon(outline: [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])),
        // Behind it: its shadow falls on the left half of the back.
        (name: \"post\", material: \"card\", shape: Polygon(outline: [(-4, -9, -1), (0, -9, -1), (0, 9, -1), (-4, 9, -1)])),
    ]))],
)";

/// Lambert's law on both sides: of light from behind, its share of what the front would send back. What stands behind casts
/// its shadow through, however shadows are found.
#[test]
fn light_from_behind_comes_through_by_lamberts_law_with_its_shadows() {
    let scratch = Scratch::new("transmitted");
    std::fs::write(scratch.path().join("s.ron"), SHEET).unwrap();
    for shadows in ["Off", "Volumes", "Analytic", "Rays(1)", "Rays(7)"] {
        for (direction, through) in [("(0, -0.6, 0.8)", true), ("(0, -0.6, -0.8)", false)] {
            let nodes = format!(
                "\"eye\": Camera(position: (0, 0, 5), look_at: (0, 0, 0), parallel_height: 2),
                 \"seen\": Scanline(scene: \"s.ron\", camera: \"eye\"),
                 \"sun\": ParallelLight(direction: {direction}, illuminance: 2),
                 \"lit\": Illuminate(image: \"seen\", lights: [\"sun\"], white: 1, ambient: 0, shadows: {shadows}),
                 \"picture\": Resolve(image: \"lit\", size: (8, 8)),"
            );
            let made = picture(scratch.path(), &nodes);
            for (x, is_behind_post) in [(1, true), (6, false)] {
                let is_dark = through && is_behind_post && shadows != "Off";
                let shares = if through { [0.6, 0.4, 0.2] } else { [1.0; 3] };
                let found = made.rgba(x, 4);
                for (found, share) in found.into_iter().zip(shares) {
                    let expected = if is_dark { 0.0 } else { 0.5 * share * 2.0 * 0.8 };
                    assert!(
                        (found - expected).abs() < 1e-5,
                        "{shadows}, {direction}, {x}: {found}, not {expected}"
                    );
                }
            }
        }
    }
}

/// A sheet under a uniform sky, seen from below.
#[test]
fn a_sky_is_seen_through_a_sheet() {
    let scratch = Scratch::new("transmitted-sky");
    std::fs::write(scratch.path().join("s.ron"), SHEET).unwrap();
    for shadows in ["Off", "Volumes", "Rays(64)"] {
        let nodes = format!(
            "\"eye\": Camera(position: (0, -5, 0), look_at: (0, 0, 0), up: (0, 0, 1), parallel_height: 1),
             \"seen\": Scanline(scene: \"lying.ron\", camera: \"eye\"),
             \"sky\": SkyLight(model: Uniform, illuminance: 1),
             \"lit\": Illuminate(image: \"seen\", lights: [\"sky\"], white: 1, ambient: 0, shadows: {shadows}),
             \"picture\": Resolve(image: \"lit\", size: (4, 4)),"
        );
        let lying = "Scene(
            materials: { \"paper\": (color: 0.5, finish: (transmit: 0.6)) },
            plans: [(name: \"p\", root: (material: \"paper\", shape: Polygon(outline: [(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)])))],
        )";
        std::fs::write(scratch.path().join("lying.ron"), lying).unwrap();
        let found = picture(scratch.path(), &nodes).rgba(2, 2)[0];
        assert!((found - 0.3).abs() < 0.003, "{shadows}: {found}");
    }
}

/// In a room of one material that glows, sheets that let light through are as bright as all else, if they send on as much in
/// all: nothing is lost in them, and nothing is made.
#[test]
fn sheets_in_a_white_furnace_are_white() {
    let scratch = Scratch::new("transmitted-furnace");
    let glow = 1.0 / std::f32::consts::PI;
    let scene = format!(
        "Scene(materials: {{
            \"wall\": (color: 0.6, finish: (glow: {glow})),
            \"sheet\": (color: 0.4, finish: (transmit: 0.5, glow: {glow})),
        }}, plans: [(name: \"p\", root: (material: \"wall\", children: [
            (name: \"room\", shape: Box(size: (6, 3, 4))),
            (name: \"sheet\", material: \"sheet\", transform: [TurnY(30), Move(0, 0.5, -0.5)],
             shape: Polygon(outline: [(-1, 0, 0), (1, 0, 0), (1, 1.5, 0), (-1, 1.5, 0)])),
        ]))])"
    );
    std::fs::write(scratch.path().join("s.ron"), scene).unwrap();
    let expected: f32 = (0..=3).map(|k| 0.6f32.powi(k)).sum();
    for (gather, within) in [("Rays(16)", 1e-4), ("Records(64)", 0.01)] {
        let nodes = format!(
            "\"eye\": Camera(position: (2.6, 1.4, 1.8), look_at: (0, 1.1, -0.4), field_of_view: 70),
             \"seen\": Scanline(scene: \"s.ron\", camera: \"eye\"),
             \"lit\": Illuminate(image: \"seen\", lights: [], white: 1, ambient: 0, bounces: 3, gather: {gather}),
             \"picture\": Resolve(image: \"lit\", size: (24, 16)),"
        );
        for [r, ..] in picture(scratch.path(), &nodes).pixels() {
            assert!((r - expected).abs() < within * expected, "{gather}: {r}, not {expected}");
        }
    }
}
