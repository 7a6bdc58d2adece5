//! How pictures are shown: before the filter, so that edges before what is very bright keep their antialiasing.

use spandrel_engine::color::Color;
use spandrel_engine::shade::{Display, DisplayView};
use spandrel_tests::graphs::Nodes;
use spandrel_tests::program::Scratch;

/// A dark bar before a glow of 31: each pixel is the mean of what is shown, by coverage. Without a view, or with one on the
/// finished picture, a pixel of which a tenth is glow is as white as the glow.
#[test]
fn a_bar_before_a_glow_keeps_its_antialiased_edge() {
    let scratch = Scratch::new("displayed");
    let scene = "Scene(
        materials: { \"bar\": (color: 0.05, unlit: true), \"glow\": (color: (31, 24, 9), unlit: true) },
        plans: [(name: \"p\", root: (children: [
            (name: \"glow\", material: \"glow\", shape: Polygon(outline: [(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)])),
            (name: \"bar\", material: \"bar\", shape: Polygon(outline: [(-1.3, -9, 0), (1.45, -9, 0), (1.45, 9, 0), (-1.3, 9, 0)])),
        ]))],
    )";
    std::fs::write(scratch.path().join("s.ron"), scene).unwrap();
    for (name, view) in [
        ("Linear", DisplayView::Linear),
        ("Neutral", DisplayView::Neutral),
        ("AgX", DisplayView::AgX),
        ("Filmic", DisplayView::Filmic),
    ] {
        let nodes = format!(
            "\"eye\": Camera(position: (0, 0, 9), look_at: (0, 0, 0), parallel_height: 4),
             \"seen\": Scanline(scene: \"s.ron\", camera: \"eye\"),
             \"shown\": Display(image: \"seen\", view: {name}, exposure: 1),
             \"picture\": Resolve(image: \"shown\", size: (8, 4), lines: Sloped(2)),"
        );
        let made = Nodes::new(scratch.path(), &nodes).picture("picture", None).unwrap();
        let display = Display { multiply: Color::grey(2.0), contrast: 1.0, saturation: 1.0, view };
        let [bar, glow] =
            [Color::grey(0.05), Color::new(31.0, 24.0, 9.0)].map(|c| display.shown(c));
        // One metre is a pixel; the bar goes from 2.7 to 5.45.
        for (x, covers) in [(0, 0.0f32), (2, 0.3), (3, 1.0), (5, 0.45), (7, 0.0)] {
            let expected = (bar * covers + glow * (1.0 - covers)).to_array();
            let found = made.image.rgba(x, 1);
            for (found, expected) in found.into_iter().zip(expected) {
                assert!(
                    (found - expected).abs() < 1.0 / 255.0,
                    "{name}, {x}: {found}, not {expected}"
                );
            }
        }
    }
}

/// Parts of a colour keep their shares, so that layers of lights still sum to the picture; light of a temperature is white.
#[test]
fn layers_sum_to_what_is_shown() {
    let scratch = Scratch::new("displayed-layers");
    let scene = "Scene(plans: [(name: \"p\", root: (shape: Sphere(radius: 1)))])";
    std::fs::write(scratch.path().join("s.ron"), scene).unwrap();
    let graph = "Graph(nodes: {
        \"eye\": Camera(position: (0, 0, 4), look_at: (0, 0, 0)), \"seen\": Scanline(scene: \"s.ron\", camera: \"eye\"),
        \"key\": ParallelLight(direction: (-1, -1, -1), illuminance: 5), \"fill\": ParallelLight(direction: (1, 0, -1), color: (0.2, 0.5, 1)),
        \"lit\": Illuminate(image: \"seen\", lights: [\"key\", \"fill\"], white: 1),
        \"shown\": Display(image: \"lit\", view: AgX, contrast: 1.2, saturation: 0.9),
        \"picture\": Resolve(image: \"shown\", size: (32, 24)),
        \"file\": Write(image: \"picture\", path: \"p.exr\", channels: [Color, Light], bits: 32),
        \"warm\": Illuminate(image: \"seen\", lights: [\"bulb\"], white: 1, ambient: 0, shadows: Off),
        \"bulb\": ParallelLight(direction: (0, 0, -1), temperature: 3000),
        \"balanced\": Display(image: \"warm\", temperature: 3000, view: Linear),
        \"white\": Resolve(image: \"balanced\", size: (32, 24)),
    })";
    std::fs::write(scratch.path().join("g.ron"), graph).unwrap();
    let program = env!("CARGO_BIN_EXE_spandrel-under-test");
    let ran = spandrel_tests::program::run(program, &["render", "g.ron"], scratch.path());
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let image = spandrel_engine::image::file::read(&scratch.path().join("p.exr")).unwrap();
    for channel in ["R", "G", "B"] {
        let of = |layer: &str| image.float(&format!("{layer}.{channel}")).unwrap().to_vec();
        let parts = ["light_key", "light_fill", "light_own_ambient", "rest"].map(of);
        for (i, whole) in image.float(channel).unwrap().iter().enumerate() {
            let sum: f32 = parts.iter().map(|part| part[i]).sum();
            assert!((sum - whole).abs() < 1e-4, "{channel}, {i}: {sum}, not {whole}");
        }
    }
    let ran = spandrel_tests::program::run(
        program,
        &["render", "g.ron", "-w", "white", "-o", "w.exr"],
        scratch.path(),
    );
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let image = spandrel_engine::image::file::read(&scratch.path().join("w.exr")).unwrap();
    let [r, g, b, _] = image.rgba(16, 12);
    assert!((r / g - 1.0).abs() < 0.06 && (b / g - 1.0).abs() < 0.06, "{r} {g} {b}");
}
