//! A studio's kinds of node, among the library's own.

use spandrel_engine::graph::demand::Wishes;
use spandrel_engine::graph::document::Document;
use spandrel_engine::graph::{Graph, Run, Schedule};
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::values::{Override, PictureDemand};
use spandrel_tests::program::scratch;
use std::collections::BTreeSet;
use std::path::Path;

fn render(text: &str, folder: &Path, channels: &[Channel]) -> Image {
    let mut registry = spandrel::library();
    spandrel_plugin_example::register(&mut registry);
    let document = Document::parse(text).unwrap();
    let graph = match Graph::check(&document, &registry, folder) {
        Ok(graph) => graph,
        Err(faults) => panic!("{faults:?}"),
    };
    let mut wishes = Wishes::new();
    let channels = BTreeSet::from_iter(channels.iter().copied());
    wishes.want::<Image>("picture", PictureDemand { channels, changed: Override::default() });
    let plan = Schedule::new(&graph, &wishes).unwrap();
    let evaluated = Run::new().evaluate(&graph, &plan, &()).unwrap();
    Image::clone(&evaluated.value::<Image>(0))
}

/// The root of the mean square difference of a channel.
fn rmse(a: &Image, b: &Image, channel: &str) -> f64 {
    let (a, b) = (a.float(channel).unwrap(), b.float(channel).unwrap());
    let square = |(a, b): (&f32, &f32)| f64::from(a - b).powi(2);
    (a.iter().zip(b).map(square).sum::<f64>() / a.len() as f64).sqrt()
}

fn graph(balls: &str, shader: &str, last: &str) -> String {
    format!(
        r#"Graph(nodes: {{
            "eye": Camera(position: (1, 2, 6), look_at: (0, 0.6, 0), field_of_view: 30),
            "boxes": Scanline(scene: "boxes.ron", camera: "eye"),
            "balls": {balls},
            "both": DepthMerge(inputs: ["boxes", "balls"]),
            "sun": ParallelLight(),
            "lit": Illuminate(image: "both", lights: ["sun"], ambient: 0.2, shadows: Off),
            "last": {shader},
            "flat": Resolve(image: "last", size: (320, 240), lines: Sampled(8, Box)),
            "picture": {last},
        }})"#
    )
}

const BALLS: &str = r#"Spheres(camera: "eye", balls: [(centre: (0, 0.7, 0.2), radius: 0.7, color: (0.8, 0.5, 0.2))])"#;
const MESH: &str = r#"Scanline(scene: "ball.ron", camera: "eye")"#;
const PLAIN: &str = r#"Fog(image: "lit", density: 0)"#;

fn scenes(name: &str) -> std::path::PathBuf {
    let folder = scratch(name);
    // A box that the ball sinks into.
    let boxes = "Scene(plans: [(name: \"p\", root: (transform: [TurnY(30)], shape: Box(size: (1, 1, 1))))])";
    let ball = "Scene(materials: {\"m\": (color: (0.8, 0.5, 0.2))}, plans: [(name: \"p\", root: (
        material: \"m\", transform: [Move(0, 0.7, 0.2)], shape: Sphere(radius: 0.7, segments: 400)))])";
    std::fs::write(folder.join("boxes.ron"), boxes).unwrap();
    std::fs::write(folder.join("ball.ron"), ball).unwrap();
    folder
}

#[test]
fn another_programs_spans_merge_as_if_they_were_our_own() {
    let folder = scenes("spheres");
    let whole = r#"Vignette(image: "flat", strength: 0)"#;
    let channels = [Channel::Color, Channel::Z];
    let analytic = render(&graph(BALLS, PLAIN, whole), &folder, &channels);
    let meshed = render(&graph(MESH, PLAIN, whole), &folder, &channels);
    // The same picture, seam with the box included, but for the mesh's facets.
    for channel in ["R", "G", "B", "A"] {
        let error = rmse(&analytic, &meshed, channel);
        assert!(error < 0.002, "{channel}: {error}");
    }
    let none =
        render(&graph(r#"Spheres(camera: "eye", balls: [])"#, PLAIN, whole), &folder, &channels);
    assert!(rmse(&analytic, &none, "R") > 0.05, "the ball is seen");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn shaders_and_image_nodes_take_their_places() {
    let folder = scenes("studio");
    let whole = r#"Vignette(image: "flat", strength: 0)"#;
    let plain = render(&graph(BALLS, PLAIN, whole), &folder, &[Channel::Color]);
    let lined = r#"Contours(image: "lit", interval: 0.25, width: 0.2)"#;
    let lined = render(&graph(BALLS, lined, whole), &folder, &[Channel::Color]);
    assert!(rmse(&plain, &lined, "G") > 0.02, "lines are drawn");
    // Sums in another order: the same but for rounding.
    assert!(rmse(&plain, &lined, "A") < 1e-6, "coverage stays as it was");
    let dark = r#"Vignette(image: "flat", strength: 0.8)"#;
    let dark = render(&graph(BALLS, PLAIN, dark), &folder, &[Channel::Color]);
    let middle = 120 * 320 + 160;
    let at = |image: &Image, i: usize| image.float("R").unwrap()[i];
    assert!((at(&dark, middle) / at(&plain, middle) - 1.0).abs() < 1e-3);
    std::fs::remove_dir_all(folder).unwrap();
}

/// A light of the studio's own: its closed form on a floor, and the shadow of a block of the studio's own format.
#[test]
fn a_light_and_a_reader_work_as_the_librarys_do() {
    let folder = scratch("plugin-light");
    std::fs::write(folder.join("blocks.txt"), "0 0 1 1\n\n3 0 1 2\n").unwrap();
    let floor = "Scene(plans: [(name: \"p\", root: (shape: Polygon(outline: [(-20, 0, 20), (20, 0, 20), (20, 0, -20), (-20, 0, -20)])))])";
    std::fs::write(folder.join("floor.ron"), floor).unwrap();
    let text = |scenes: &str| {
        format!(
            r#"Graph(nodes: {{
                "eye": Camera(position: (0, 10, 0), look_at: (0, 0, 0), up: (0, 0, -1), parallel_height: 10),
                "floor": Scanline(scene: "floor.ron", camera: "eye"),
                "read": ReadBlocks(file: "blocks.txt", color: 0.5),
                "blocks": Scanline(scene: "read", camera: "eye"),
                "both": DepthMerge(inputs: [{scenes}]),
                "lamp": FalloffLight(position: (0, 4, 0), illuminance: 2, range: 8),
                "lit": Illuminate(image: "both", lights: ["lamp"], ambient: 0, white: 1),
                "picture": Resolve(image: "lit", size: (100, 100), lines: Sloped(4)),
            }})"#
        )
    };
    let bare = render(&text("\"floor\""), &folder, &[Channel::Color]);
    // The default material sends 0.8 back.
    let expected = |x: f64, z: f64| {
        let distance = (x * x + z * z + 16.0).sqrt();
        0.8 * 2.0 * 4.0 / distance * (1.0 - distance / 8.0)
    };
    for (x, y) in [(50, 50), (20, 50), (80, 30)] {
        let place = |at: u32| f64::from(at) / 10.0 + 0.05 - 5.0;
        let found = f64::from(bare.rgba(x, y)[0]);
        assert!((found - expected(place(x), place(y))).abs() < 1e-4, "{x}, {y}: {found}");
    }
    let built = render(&text("\"floor\", \"blocks\""), &folder, &[Channel::Color]);
    // Behind the block of two metres at x = 3 it is dark: its top edge at 3.5 shades to 7; before it, it is not.
    assert_eq!(built.rgba(95, 50)[0], 0.0);
    assert_eq!(built.rgba(70, 50)[0], bare.rgba(70, 50)[0]);
    // A fault of the studio's file is told as all others are.
    std::fs::write(folder.join("blocks.txt"), "0 0 1 1\n3 0 one 2\n").unwrap();
    let mut registry = spandrel::library();
    spandrel_plugin_example::register(&mut registry);
    let document = Document::parse(&text("\"blocks\"")).unwrap();
    let graph = Graph::check(&document, &registry, &folder).ok().unwrap();
    let mut wishes = Wishes::new();
    let channels = BTreeSet::from([Channel::Color]);
    wishes.want::<Image>("picture", PictureDemand { channels, changed: Override::default() });
    let plan = Schedule::new(&graph, &wishes).unwrap();
    let Err(failure) = Run::new().evaluate(&graph, &plan, &()) else { panic!("it is wrong") };
    assert!(failure.to_string().contains("blocks.txt:2:1: a block is four numbers"), "{failure}");
}

/// What `spandrel new` writes: its graph is sound with its node, its sources are there; a second time it is refused.
#[test]
fn a_new_program_is_whole() {
    let folder = scratch("plugin-new");
    let program = env!("CARGO_BIN_EXE_spandrel-under-test");
    let ran = spandrel_tests::program::run(program, &["new", "studio"], &folder);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.out.contains("cd studio; cargo run --release -- render graph.ron"), "{}", ran.out);
    let made = folder.join("studio");
    let read = |file: &str| std::fs::read_to_string(made.join(file)).unwrap();
    assert!(read("src/main.rs").contains("register::<tint::Tint>"));
    for line in read("Cargo.toml").lines().filter(|line| line.contains("path = ")) {
        let path = line.split('"').nth(1).unwrap();
        assert!(Path::new(path).join("Cargo.toml").is_file(), "{path}");
    }
    let mut registry = spandrel::library();
    registry.register::<spandrel_plugin_example::Tint>();
    let document = Document::parse(&read("graph.ron")).unwrap();
    if let Err(faults) = Graph::check(&document, &registry, &made) {
        panic!("{faults:?}");
    }
    for (arguments, word) in [
        (&["new", "studio"][..], "exists already"),
        (&["new", "My Studio"], "small letters"),
        (&["new", "other", "--sources", "studio"], "no sources of Spandrel"),
    ] {
        let ran = spandrel_tests::program::run(program, arguments, &folder);
        assert!(ran.code != Some(0) && ran.err.contains(word), "{arguments:?}: {}", ran.err);
    }
    assert!(!folder.join("other").exists());
}

#[test]
fn a_renderer_that_answers_for_any_line_is_exact() {
    let folder = scenes("discs");
    // A unit is a pixel. One disc alone, one that a wall cuts through its middle, one that a nearer one covers in part.
    let graph = |lines: &str, scale: u32| {
        format!(
            r#"Graph(nodes: {{
                "eye": Camera(position: (0, 0, 10), parallel_height: 40),
                "discs": Discs(camera: "eye", discs: [
                    (centre: (-12.3, 0.4, 0), radius: 5.5, color: (1, 0, 0)),
                    (centre: (9, 0.2, 0), radius: 6, color: (0, 1, 0)),
                    (centre: (15, 0.2, 1), radius: 6, color: (0, 0, 1)),
                ]),
                "wall": Scanline(scene: "half.ron", camera: "eye"),
                "both": DepthMerge(inputs: ["wall", "discs"]),
                "picture": Resolve(image: "both", size: (60, 40), lines: {lines}, scale: ({scale}, {scale})),
            }})"#
        )
    };
    let half = r##"Scene(materials: {"m": (color: 0, unlit: true)}, plans: [(name: "p", root: (material: "m",
        shape: Polygon(outline: [(-40, -40, 2), (-12.3, -40, 2), (-12.3, 40, 2), (-40, 40, 2)])))])"##;
    std::fs::write(folder.join("half.ron"), half).unwrap();
    let pi = std::f64::consts::PI;
    // Two equal circles whose middles are a radius apart.
    let lens = 36.0 * (2.0 * pi / 3.0 - 3f64.sqrt() / 2.0);
    let expected = [pi * 5.5 * 5.5 / 2.0, pi * 36.0 - lens, pi * 36.0];
    for scale in [1, 4] {
        let error = |lines: &str| {
            let picture = render(&graph(lines, scale), &folder, &[Channel::Color]);
            let area = |name| {
                let sum = picture.float(name).unwrap().iter().map(|v| f64::from(*v)).sum::<f64>();
                sum / f64::from(scale * scale)
            };
            let errors = ["R", "G", "B"].map(area).into_iter().zip(expected);
            errors.map(|(found, expected)| (found - expected).abs()).fold(0.0, f64::max)
        };
        let (sampled, adaptive, exact) =
            (error("Sampled(2, Box)"), error("Adaptive(2, 0.01)"), error("Exact"));
        println!("x{scale}: {sampled:.5} {adaptive:.5} {exact:.6}");
        assert!(exact < 2e-3, "x{scale}: {exact}");
        assert!(adaptive < 0.1 && exact < adaptive && adaptive < sampled, "{sampled} {adaptive}");
    }
}
