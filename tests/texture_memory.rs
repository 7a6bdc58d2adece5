//! More pictures on surfaces than memory holds ([N], "Texture mapping"): the same picture, and each is read once.

use spandrel_tests::program::{Scratch, run};
use std::path::Path;

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

/// Two clusters before each other, one of them moved: walls with pictures of their own, one with bumps and roughness,
/// leaves that are cut out, and a floor that is divided by a trigger pattern into domains with pictures.
const GRAPH: &str = r#"Graph(nodes: {
    "eye": Camera(position: (0, 2.5, 6), look_at: (0, 1, 0)),
    "walls": Scanline(scene: "walls.ron", camera: "eye"),
    "moved": Transform(image: "walls", translate: (5, -2)),
    "floor": Scanline(scene: "floor.ron", camera: "eye"),
    "all": DepthMerge(inputs: ["moved", "floor"]),
    "sun": ParallelLight(direction: (-0.3, -1, -0.8)),
    "lit": Illuminate(image: "all", lights: ["sun"], shadows: Off),
    "picture": Resolve(image: "lit", size: (120, 90), lines: Sloped(2)),
    "file": Write(image: "picture", path: "out.exr", bits: 32, channels: [Color, Light]),
})"#;

/// A picture of 256 by 256 texels that takes 350 kB as a pyramid.
fn paint(folder: &Path, name: &str, texel: impl Fn(u32, u32) -> [u8; 4]) {
    let picture = image::RgbaImage::from_fn(256, 256, |x, y| image::Rgba(texel(x, y)));
    picture.save(folder.join(name)).unwrap();
}

/// Runs the graph within a limit; returns the file and how many times pictures were read.
fn render(folder: &Path, limit: &str) -> (Vec<u8>, String, String) {
    let ran = run(PROGRAM, &["render", "g.ron", "--textures", limit, "--stats"], folder);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let told = ran.out.lines().find(|line| line.contains("times read")).unwrap().to_owned();
    (std::fs::read(folder.join("out.exr")).unwrap(), told, ran.out)
}

#[test]
fn pictures_that_do_not_fit_together_are_read_once_each_and_show_the_same() {
    let scratch = Scratch::new("texture-memory");
    let folder = scratch.path();
    let colored = |k: u32| {
        move |x: u32, y: u32| [(x * (k + 2) % 251) as u8, (y * (k + 5) % 239) as u8, 90, 255]
    };
    (0..4).for_each(|k| paint(folder, &format!("color{k}.png"), colored(k)));
    paint(folder, "rough.png", colored(7));
    paint(folder, "normal.png", |x, y| [118 + (x % 20) as u8, 118 + (y % 20) as u8, 250, 255]);
    paint(folder, "leaf.png", |x, y| {
        [40, 120, 30, if (x / 16 + y / 16) % 2 == 0 { 255 } else { 0 }]
    });
    let pattern = image::GrayImage::from_fn(256, 256, |x, y| image::Luma([u8::from(x + y > 256)]));
    pattern.save(folder.join("pattern.png")).unwrap();
    let by = |axis: char| format!("mapping: (by: {axis}, length: (2, 2))");
    let map = |what: &str, file: &str, axis: char| {
        format!("\"{what}\": (picture: File(\"{file}\"), {})", by(axis))
    };
    let wall = |name: &str, x: f64| {
        let outline = format!("[({x}, 0, 0), ({0}, 0, 0), ({0}, 2.5, 0), ({x}, 2.5, 0)]", x + 1.2);
        format!("(name: \"{name}\", material: \"{name}\", shape: Polygon(outline: {outline})),")
    };
    let shiny = "finish: (gloss: Microfacets(reflectance: 0.04, roughness: 1, metal: 1))";
    let walls = format!(
        "Scene(materials: {{
            \"a\": (color: 1, maps: {{{}, {}}}),
            \"b\": (color: 1, {shiny}, maps: {{{}, {}}}),
            \"leaf\": (color: 1, alpha_mode: Mask(0.5), maps: {{{}}}),
        }}, plans: [(name: \"p\", root: (children: [{} {} {}]))])",
        map("color", "color0.png", 'Z'),
        map("normal", "normal.png", 'Z'),
        map("color", "color1.png", 'Z'),
        map("metallic_roughness", "rough.png", 'Z'),
        map("color", "leaf.png", 'Z'),
        wall("a", -2.5),
        wall("b", -1.0),
        wall("leaf", 0.6),
    );
    std::fs::write(folder.join("walls.ron"), walls).unwrap();
    let floor = format!(
        "Scene(materials: {{
            \"floor\": (domains: (define: Picture(\"pattern.png\"), {}, table: {{0: \"c\", 1: \"d\"}})),
            \"c\": (color: 1, maps: {{{}}}),
            \"d\": (color: 1, maps: {{{}}}),
        }}, plans: [(name: \"p\", root: (material: \"floor\",
            shape: Polygon(outline: [(-5, 0, 3), (5, 0, 3), (5, 0, -9), (-5, 0, -9)])))])",
        by('Y'),
        map("color", "color2.png", 'Y'),
        map("color", "color3.png", 'Y'),
    );
    // And one that is divided without any picture.
    let floor = floor.replace("Scene(materials: {", "Scene(materials: {
            \"side\": (domains: (define: Checker, mapping: (by: X, length: (0.5, 0.5)), table: {0: \"e\", 1: \"f\"})),
            \"e\": (color: (1, 0, 0)), \"f\": (color: (0, 0, 1), maps: {\"bump\": (picture: Wave(3, 2), strength: 0.01)}),");
    let floor = floor.replace(
        "root: (material: \"floor\",",
        "root: (children: [(name: \"side\", material: \"side\",
            shape: Polygon(outline: [(-2, 0, 2), (-2, 0, -4), (-2, 2, -4), (-2, 2, 2)]))], material: \"floor\",",
    );
    std::fs::write(folder.join("floor.ron"), floor).unwrap();
    std::fs::write(folder.join("g.ron"), GRAPH).unwrap();
    let (all, told, _) = render(folder, "1G");
    assert!(told.ends_with(", 8 times read"), "{told}");
    let (few, told, stats) = render(folder, "1M");
    assert!(stats.contains("passes for pictures on surfaces"), "{stats}");
    assert!(told.ends_with(", 8 times read"), "{told}");
    assert!(all == few, "the picture is another one");
}
