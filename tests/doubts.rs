//! What shows a picture that nobody meant says so; and what nobody said is what most mean.

use glam::DVec3;
use spandrel_engine::image::Image;
use spandrel_engine::light::sun::{self, Moment};
use spandrel_engine::math;
use spandrel_tests::graphs::{Made, Nodes};
use spandrel_tests::program::Scratch;

/// A white floor of 20 by 20 m with a small roof over its middle, and a ball.
const SCENE: &str = r#"Scene(version: 1, materials: {"white": (color: 1)}, plans: [(name: "p", root: (material: "white", children: [
    (name: "floor", shape: Polygon(outline: [(-10, 0, 10), (10, 0, 10), (10, 0, -10), (-10, 0, -10)])),
    (name: "roof", transform: [Move(0, 2, 0)], shape: Box(size: (2, 0.1, 2))),
]))])"#;

fn nodes(name: &str, nodes: &str) -> (Scratch, Nodes) {
    let folder = Scratch::new(name);
    std::fs::write(folder.path().join("s.ron"), SCENE).unwrap();
    let text = format!(
        r#""eye": Camera(position: (0, 30, 0.01), look_at: (0, 0, 0), field_of_view: 30),
        "s": Scanline(scene: "s.ron", camera: "eye"), {nodes},
        "p": Resolve(image: "lit", size: (32, 32), lines: Sloped(2))"#
    );
    let nodes = Nodes::new(folder.path(), &text);
    (folder, nodes)
}

fn lit(name: &str, lights: &str, names: &str, fields: &str) -> Made {
    let text = format!(r#"{lights}, "lit": Illuminate(image: "s", lights: [{names}] {fields})"#);
    nodes(name, &text).1.picture("p", None).unwrap()
}

/// What the open floor shows, far from the roof.
fn floor(image: &Image) -> f32 {
    image.rgba(3, 3)[0]
}

#[test]
fn the_first_lit_picture_is_neither_white_nor_black() {
    // The sun of a clear day: some hundred thousand lux, and a picture.
    let sun = r#""sun": SunLight(latitude: 35, longitude: 135, time: "2026-06-21T12:00+09:00")"#;
    let made = lit("first", sun, r#""sun""#, ", ambient: 0");
    let moment = Moment::parse("2026-06-21T12:00+09:00").unwrap();
    let toward = sun::direction(moment, 35.0, 135.0, 0.0).unwrap();
    // The IES's clear sun, 127500 lux beyond the air, over what faces up; 100000 lux show 1.
    let up = toward.y;
    let expected = 127_500.0 * math::exp(-0.21 / up) * up / 1e5;
    let shown = f64::from(floor(&made.image));
    assert!((shown / expected - 1.0).abs() < 1e-4, "{shown} {expected}");
    let said = |made: &Made, word: &str| made.notes.iter().any(|note| note.contains(word));
    assert!(said(&made, "`white` is 100000"), "{:?}", made.notes);
    // Dimmed, it is seen to dim: by half.
    let half = r#""sun": SunLight(latitude: 35, longitude: 135, time: "2026-06-21T12:00+09:00", illuminance: 40000)"#;
    let whole = half.replace("40000", "80000");
    let [half, whole] =
        [half, &whole].map(|sun| floor(&lit("dim", sun, r#""sun""#, ", ambient: 0").image));
    assert!((half / whole - 0.5).abs() < 1e-4, "{half} {whole}");
    // Lights in units of one's own show what they say, without a word.
    let own = r#""sun": ParallelLight(direction: (0, -1, 0), illuminance: 0.5)"#;
    let made = lit("own", own, r#""sun""#, ", ambient: 0");
    assert!((floor(&made.image) - 0.5).abs() < 1e-5 && made.notes.is_empty(), "{:?}", made.notes);
    // What is said counts.
    let made = lit("said", sun, r#""sun""#, ", ambient: 0, white: 1000000");
    assert!(floor(&made.image) < 0.11 && made.notes.is_empty());
}

#[test]
fn light_that_is_there_twice_or_falls_on_fog_is_told() {
    let sky = r#""sky": SkyLight(model: Overcast, illuminance: 0.5)"#;
    let said = |made: &Made| [&made.notes[..], &made.warnings[..]].concat().join("\n");
    let alone = lit("sky", sky, r#""sky""#, ", white: 1");
    assert_eq!(said(&alone), "");
    let twice = lit("twice", sky, r#""sky""#, ", white: 1, ambient: 0.1");
    assert!(
        said(&twice).contains("`ambient` is added to the light of \"sky\""),
        "{}",
        said(&twice)
    );
    let none = lit("none", sky, r#""sky""#, ", white: 1, ambient: 0");
    assert_eq!(said(&none), "");
    let fog = r#""f": Fog(image: "s"), "lit": Illuminate(image: "f", ambient: 1)"#;
    let fogged = nodes("fogged", fog).1.picture("p", None).unwrap();
    assert!(said(&fogged).contains("Put Fog after Illuminate"), "{}", said(&fogged));
}

#[test]
fn shadows_fall_and_a_sky_is_all_the_light_from_around() {
    let sun = r#""sun": ParallelLight(direction: (0, -1, 0), illuminance: 0.5)"#;
    let made = lit("shadows", sun, r#""sun""#, "");
    // A tenth of white from around; under the roof, seen from above, nothing is seen of its shadow; beside it all is.
    assert!((floor(&made.image) - 0.6).abs() < 1e-5, "{}", floor(&made.image));
    let slanting = sun.replace("(0, -1, 0)", "(1, -1, 0)");
    let dark = |fields: &str| {
        let made = lit("slanting", &slanting, r#""sun""#, fields);
        (0..32).map(|x| made.image.rgba(x, 16)[0]).fold(1.0, f32::min)
    };
    assert!((dark("") - 0.1).abs() < 1e-5, "{}", dark(""));
    assert!(dark(", shadows: Off") > 0.4);
    // Beside a sky nothing is added.
    let sky = r#""sky": SkyLight(model: Uniform, illuminance: 0.5)"#;
    let made = lit("sky", sky, r#""sky""#, ", shadows: Off");
    assert!((floor(&made.image) - 0.5).abs() < 1e-3, "{}", floor(&made.image));
}

#[test]
fn lights_that_are_perhaps_not_meant_are_told() {
    let warned = |lights: &str, names: &str, word: &str| {
        let made = lit("told", lights, names, "");
        assert!(
            made.warnings.iter().any(|said| said.contains(word)),
            "{word}: {:?}",
            made.warnings
        );
    };
    let night = r#""sun": SunLight(latitude: 35, longitude: 135, time: "2026-06-21T23:00+09:00")"#;
    warned(night, r#""sun""#, "below the horizon");
    warned(night, r#""sun""#, "none of the lights");
    let sky = |sun: &str| {
        format!(
            r#""sun": ParallelLight(direction: (-1, -1, 0)), "sky": SkyLight(model: Clear, sun: {sun}, illuminance: 1)"#
        )
    };
    warned(&sky("(0, 1, 1)"), r#""sun", "sky""#, "sun: (0.707, 0.707, 0.000)");
    // What was told, pasted, says nothing more.
    let made = lit("pasted", &sky("(0.707, 0.707, 0.000)"), r#""sun", "sky""#, "");
    assert!(made.warnings.is_empty(), "{:?}", made.warnings);
}

#[test]
fn a_sky_follows_the_sun_that_it_names() {
    let sun = r#""sun": SunLight(latitude: 35, longitude: 135, time: "2026-06-21T09:00+09:00")"#;
    let toward = {
        let moment = Moment::parse("2026-06-21T09:00+09:00").unwrap();
        let DVec3 { x, y, z } = sun::direction(moment, 35.0, 135.0, 0.0).unwrap();
        format!("({x:?}, {y:?}, {z:?})")
    };
    let names = r#""sun", "sky""#;
    let made = |of: &str| {
        let lights =
            format!(r#"{sun}, "sky": SkyLight(model: Clear, sun: {of}, illuminance: 17000)"#);
        lit("follows", &lights, names, ", white: 100000")
    };
    let (named, given) = (made(r#""sun""#), made(&toward));
    assert!(named.warnings.is_empty(), "{:?}", named.warnings);
    assert_eq!(named.image, given.image);
    assert_ne!(named.image, made("(1, 1, 1)").image);
    // What is no sun cannot be followed.
    let lights = r#""lamp": PointLight(), "sky": SkyLight(model: Clear, sun: "lamp")"#;
    let (_folder, graph) =
        nodes("no_sun", &format!(r#"{lights}, "lit": Illuminate(image: "s", lights: ["sky"])"#));
    let fault = graph.picture("p", None).unwrap_err().to_string();
    assert!(fault.contains("\"lamp\" is no SunLight or ParallelLight"), "{fault}");
}

#[test]
fn a_program_that_lets_light_through_shows_what_is_behind() {
    let folder = Scratch::new("a_program_that_lets_light_through");
    let scene = r##"Scene(version: 1, materials: {"red": (color: (1, 0, 0), unlit: true), "blue": (color: (0, 0, 1), unlit: true)},
        plans: [(name: "p", root: (children: [
            (name: "near", material: "red", shape: Box(size: (1, 1, 1))),
            (name: "far", material: "blue", transform: [Move(0, -4, -3)], shape: Box(size: (9, 9, 1))),
        ]))])"##;
    std::fs::write(folder.path().join("s.ron"), scene).unwrap();
    let shown = |code: &str| {
        let text = format!(
            r#""eye": Camera(position: (0, 0.5, 5), look_at: (0, 0.5, 0)), "s": Scanline(scene: "s.ron", camera: "eye"),
            "m": DepthMerge(inputs: ["s"]), "lit": Stream(image: "m", code: "{code}"),
            "p": Resolve(image: "lit", size: (9, 9))"#
        );
        Nodes::new(folder.path(), &text).picture("p", None).unwrap().image.rgba(4, 4)
    };
    let close = |a: [f32; 4], b: [f32; 4]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
    // A front and a back of the box lie before the wall.
    let seen = shown("if (object('near')) { alpha = 0.3; }");
    let (red, blue) = (0.3 + 0.7 * 0.3, 0.49);
    assert!(close(seen, [red, 0.0, blue, 1.0]), "{seen:?}");
    assert!(close(shown("alpha = object('near') ? 0 : 1;"), [0.0, 0.0, 1.0, 1.0]));
    assert!(close(shown("color = color * 0.5;"), [0.5, 0.0, 0.0, 1.0]));
}

#[test]
fn a_floor_at_zero_is_at_zero() {
    let folder = Scratch::new("a_floor_at_zero");
    std::fs::write(folder.path().join("s.ron"), SCENE).unwrap();
    let code = "color = P.y == 0 ? [1, cellnoise([0.5, P.y, 0.5]), Po.y == 0] : 0;";
    for position in ["(3, 1.7, 9)", "(0.1, 0.02, 3)", "(70, 40, 90)"] {
        let text = format!(
            r#""eye": Camera(position: {position}), "s": Scanline(scene: "s.ron", camera: "eye"),
            "c": Stream(image: "s", code: "if (object('floor')) {{ {code} }} else {{ color = 0; }}"),
            "p": Resolve(image: "c", size: (60, 40), lines: Sampled(1, Box))"#
        );
        let image = Nodes::new(folder.path(), &text).picture("p", None).unwrap().image;
        let pixels: Vec<[f32; 4]> =
            image.pixels().filter(|[r, .., a]| *a == 1.0 && *r != 0.0).collect();
        let floor = pixels.iter().filter(|[r, ..]| *r == 1.0).count();
        assert!(floor > 0, "{position}");
        assert!(pixels.iter().all(|p| p[..3] == pixels[0][..3]), "{position}");
    }
}

#[test]
fn equal_lamps_of_other_names_are_layers_of_their_own_names() {
    let text = r#""one": PointLight(position: (0, 5, 0)), "two": PointLight(position: (0, 5, 0)),
        "a": Illuminate(image: "s", lights: ["one"], white: 1), "lit": Illuminate(image: "s", lights: ["two"], white: 1),
        "q": Resolve(image: "a", size: (32, 32), lines: Sloped(2))"#;
    use spandrel_engine::graph::demand::Wishes;
    use spandrel_engine::graph::document::Document;
    use spandrel_engine::graph::{Graph, Run, Schedule};
    use spandrel_engine::image::Channel;
    use spandrel_engine::values::{Override, PictureDemand};
    let folder = Scratch::new("equal_lamps");
    std::fs::write(folder.path().join("s.ron"), SCENE).unwrap();
    let text = format!(
        r#"Graph(nodes: {{"eye": Camera(position: (0, 30, 0.01), look_at: (0, 0, 0)),
        "s": Scanline(scene: "s.ron", camera: "eye"), {text}, "p": Resolve(image: "lit", size: (32, 32), lines: Sloped(2))}})"#
    );
    let document = Document::parse(&text).unwrap();
    let graph = Graph::check(&document, &spandrel::library(), folder.path()).unwrap();
    let mut wishes = Wishes::new();
    for node in ["p", "q"] {
        let channels = [Channel::Color, Channel::Light].into();
        wishes.want::<Image>(node, PictureDemand { channels, changed: Override::default() });
    }
    let plan = Schedule::new(&graph, &wishes).unwrap();
    let done = Run::new().evaluate(&graph, &plan, &()).unwrap();
    for (at, own, other) in [(0, "light_two.R", "light_one.R"), (1, "light_one.R", "light_two.R")] {
        let image = done.value::<Image>(at);
        assert!(image.float(own).is_some() && image.float(other).is_none(), "{own}");
    }
}

#[test]
fn a_camera_that_sees_nothing_says_so() {
    let made = |position: &str| {
        let folder = Scratch::new("a_camera_that_sees_nothing");
        std::fs::write(folder.path().join("s.ron"), SCENE).unwrap();
        let text = format!(
            r#""eye": Camera(position: {position}, look_at: (0, 90, 0), up: (0, 0, 1)), "s": Scanline(scene: "s.ron", camera: "eye"), "p": Resolve(image: "s", size: (8, 8))"#
        );
        Nodes::new(folder.path(), &text).picture("p", None).unwrap().warnings
    };
    let said = made("(0, 50, 0)");
    assert!(said.iter().any(|said| said.contains("sees none of the 7 faces")), "{said:?}");
    assert!(made("(0, 0.5, 0)").is_empty());
}

#[test]
fn a_background_is_infinitely_far() {
    let folder = Scratch::new("a_background_is_infinitely_far");
    for (distance, expected) in [("", f32::INFINITY), (", distance: 40", 40.0)] {
        let text = format!(
            r##"Graph(nodes: {{"eye": Camera(), "b": Background(camera: "eye", gradient: [(0, "#fff"), (90, "#00f")]{distance}),
            "p": Resolve(image: "b", size: (8, 8)), "w": Write(image: "p", path: "a.exr", channels: [Z])}})"##
        );
        std::fs::write(folder.path().join("g.ron"), text).unwrap();
        let program = env!("CARGO_BIN_EXE_spandrel-under-test");
        let ran = spandrel_tests::program::run(program, &["render", "g.ron"], folder.path());
        assert_eq!(ran.code, Some(0), "{ran:?}");
        let made = spandrel_engine::image::file::read(&folder.path().join("a.exr")).unwrap();
        assert!(
            made.float("Z").unwrap().iter().all(|z| *z == expected || (z - expected).abs() < 1e-3)
        );
    }
}

#[test]
fn pictures_that_show_nothing_say_so() {
    for (fields, word) in
        [(", ambient: 1, white: 1", "all white"), (", ambient: 0, white: 1", "all black")]
    {
        let (folder, _) = nodes(
            "blank",
            r#""sun": ParallelLight(direction: (0, 1, 0)), "lit": Illuminate(image: "s")"#,
        );
        let text = format!(
            r#"Graph(nodes: {{"eye": Camera(position: (0, 9, 0.01), look_at: (0, 0, 0), field_of_view: 10),
            "s": Scanline(scene: "s.ron", camera: "eye"), "lit": Illuminate(image: "s", lights: [] {fields}),
            "p": Resolve(image: "lit", size: (16, 16)), "w": Write(image: "p", path: "a.png")}})"#
        );
        std::fs::write(folder.path().join("g.ron"), text).unwrap();
        let ran = spandrel_tests::program::run(
            env!("CARGO_BIN_EXE_spandrel-under-test"),
            &["render", "g.ron"],
            folder.path(),
        );
        assert!(ran.code == Some(0) && ran.err.contains(word), "{ran:?}");
    }
}

#[test]
fn eight_bits_are_dithered_and_what_had_them_keeps_them() {
    use spandrel_engine::image::{Samples, Window, file};
    let folder = Scratch::new("dithered");
    let path = folder.path().join("a.png");
    // A ramp of a night sky: a step of eight bits over a hundred and twenty-eight pixels.
    let (width, height) = (256u32, 64u32);
    let coded = |x: u32| 10.2 + 2.0 * x as f32 / width as f32;
    let linear = |v: f32| spandrel_engine::color::decode_srgb(v / 255.0);
    let mut ramp = Image::new((width, height), Window::whole(width, height));
    for name in ["R", "G", "B"] {
        let values = (0..width * height).map(|at| linear(coded(at % width))).collect();
        ramp.insert(name, Samples::Float(values)).unwrap();
    }
    let codes = |is_dithered: bool| -> Vec<Vec<u8>> {
        file::write_as(&ramp, &path, None, is_dithered).unwrap();
        let picture = image::open(&path).unwrap().into_rgb8();
        (0..width).map(|x| (0..height).map(|y| picture.get_pixel(x, y).0[0]).collect()).collect()
    };
    // Without, a band has one value; with, the mean of a column is what it was.
    assert!(codes(false).iter().all(|column| column.iter().all(|v| *v == column[0])));
    for (x, column) in (0..).zip(codes(true)) {
        let mean = column.iter().map(|v| f32::from(*v)).sum::<f32>() / height as f32;
        assert!((mean - coded(x)).abs() < 0.05, "{x}: {mean} {}", coded(x));
    }
    // All codes come back as they were.
    let mut all = Image::new((256, 8), Window::whole(256, 8));
    for name in ["R", "G", "B"] {
        let decoded = |at: u32| spandrel_engine::color::decode_srgb((at % 256) as f32 / 255.0);
        all.insert(name, Samples::Float((0..256 * 8).map(decoded).collect())).unwrap();
    }
    file::write_as(&all, &path, None, true).unwrap();
    let picture = image::open(&path).unwrap().into_rgb8();
    assert!(picture.enumerate_pixels().all(|(x, _, pixel)| pixel.0 == [x as u8; 3]));
}
