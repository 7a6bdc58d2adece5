//! The stream editor: its language against sums done by hand, its programs on pictures, and texts that are no
//! programs.

#![allow(clippy::disallowed_methods, reason = "what is expected may be computed by anybody's sine")]

use glam::{DVec2, dvec3 as v};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::{Color, ValueKind};
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::raster::Raster;
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::scene::Scene;
use spandrel_engine::shade::{Recolor, Stream};
use spandrel_engine::span::SpanImage;
use spandrel_engine::stream::{Parameter, Program, Variable};
use spandrel_tests::graphs::Nodes;
use spandrel_tests::lights::{illuminate, sun};
use spandrel_tests::program::Scratch;
use spandrel_tests::random::Random;
use spandrel_tests::scenes::{front_view, polygons, random_faces, scene};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

const RULE: Rule = Rule::Sloped(4);

fn program(code: &str) -> Result<Program, String> {
    let parameters = BTreeMap::from([
        ("scale".to_owned(), Parameter::Number(2.5)),
        ("tint".to_owned(), Parameter::Color(Color::new(0.2, 0.4, 0.6))),
    ]);
    Program::new(code, &parameters, &BTreeMap::new()).map_err(|error| error.to_string())
}

/// What a program makes where P is (1, 2, 3) and a pixel covers so much.
fn seen(code: &str, width: f32) -> [f32; 3] {
    let program = program(code).unwrap_or_else(|error| panic!("{code}: {error}"));
    let read = |variable: Variable, _: usize, out: &mut [f32]| {
        out.fill(match variable {
            Variable::World(k) => 1.0 + k as f32,
            Variable::Color(k) => 0.1 * (k + 1) as f32,
            Variable::Width => width,
            Variable::Depth => 7.0,
            _ => 0.0,
        });
    };
    program.run(1, read).color[0].to_array()
}

#[test]
fn expressions_mean_what_they_mean_by_hand() {
    let cases: [(&str, f32); 56] = [
        ("1 + 2 * 3", 7.0),
        ("(1 + 2) * 3", 9.0),
        ("2 ^ 3 ^ 2", 512.0),
        ("-2 ^ 2", -4.0),
        ("7 % 3", 1.0),
        ("-1 % 3", 2.0),
        ("10 / 4", 2.5),
        ("1e-2 * 300", 3.0),
        ("1 < 2 && 2 < 3", 1.0),
        ("1 > 2 || !1", 0.0),
        ("3 == 3 ? 5 : 6", 5.0),
        ("P.y", 2.0),
        ("$P[2]", 3.0),
        ("depth", 7.0),
        ("scale * 2", 5.0),
        ("tint.g", 0.4),
        ("dot(P, [1, 1, 1])", 6.0),
        ("length([3, 4, 0])", 5.0),
        ("dist(P, [1, 2, 8])", 5.0),
        ("cross([1, 0, 0], [0, 1, 0]).z", 1.0),
        ("norm([0, 5, 0]).y", 1.0),
        ("clamp(5, 0, 1)", 1.0),
        ("mix(2, 4, 0.25)", 2.5),
        ("smoothstep(0.5, 0, 1)", 0.5),
        ("smoothstep(0.25, 0, 1)", 0.15625),
        ("linearstep(0.25, 0, 1)", 0.25),
        ("fit(5, 0, 10, 100, 200)", 150.0),
        ("gamma(0.25, 2)", 0.5),
        ("bias(0.3, 0.5)", 0.3),
        ("contrast(0.5, 0.9)", 0.5),
        ("luminance([1, 1, 1])", 1.0),
        ("max(1, 7, 3)", 7.0),
        ("min(P.x, P.y)", 1.0),
        ("abs(-3) + floor(2.7) + ceil(2.1) + round(2.6)", 11.0),
        ("sqrt(16) + hypot(3, 4)", 9.0),
        ("sin(PI / 2) + cos(0) + atan2(0, 1)", 2.0),
        ("exp(log(5))", 5.0),
        ("a = 3; a += 4; a *= 2; a", 14.0),
        ("def twice(a) { b = a * 2; b } def four(a) { twice(twice(a)) } four(3)", 12.0),
        ("P == [1, 2, 3] ? 1 : 0", 1.0),
        ("P == [1, 2, 4] ? 1 : 0", 0.0),
        ("P != [1, 2, 4] ? 1 : 0", 1.0),
        ("P != [1, 2, 3] ? 1 : 0", 0.0),
        ("gaussstep(-0.1, 0, 1)", 0.0),
        ("gaussstep(0.5, 0, 1)", 0.25),
        ("gaussstep(2, 0, 1)", 1.0),
        ("fmod(-1, 3)", 2.0),
        ("remap(5.5, 5, 1, 2, 0)", 1.0),
        ("remap(7, 5, 1, 2, 0)", 0.5),
        ("remap(3.5, 5, 1, 2, 0)", 0.75),
        ("remap(7.5, 5, 1, 2, 1)", 0.15625),
        ("remap(7, 5, 1, 2, 2)", 0.25),
        ("remap(9, 5, 1, 2, 2) + remap(0, 5, 1, 2, 1)", 0.0),
        ("remap(6, 5, 1, 0, 0) - remap(6.1, 5, 1, 0, 0)", 1.0),
        // Whichever of two sums is done in one go with its user.
        ("(P.x - P.y) - (P.z - depth) + (3 - P.x * P.y) * P.z", 6.0),
        ("x1 = 1; if (P.x > 0) { x1 = 5; } else { x1 = 6; } x1", 5.0),
    ];
    for (code, expected) in cases {
        let [r, ..] = seen(code, 0.0);
        assert!((r - expected).abs() < 1e-5 * expected.abs().max(1.0), "{code}: {r}");
    }
    assert_eq!(seen("P * 2 + 1", 0.0), [3.0, 5.0, 7.0]);
    assert_eq!(seen("color = [P.z, 0, 1];", 0.0), [3.0, 0.0, 1.0]);
    assert_eq!(seen("if (P.x > 5) { color = [1, 1, 1]; }", 0.0), [0.1, 0.2, 0.3]);
    let back = seen("hsltorgb(rgbtohsl([0.7, 0.3, 0.1]))", 0.0);
    assert!(back.iter().zip([0.7, 0.3, 0.1]).all(|(a, b)| (a - b).abs() < 1e-6), "{back:?}");
}

#[test]
fn patterns_too_fine_to_be_seen_become_their_mean() {
    let fine = |code: &str| seen(code, 100.0)[0];
    assert_eq!(fine("noise(P * 10)"), 0.5);
    assert_eq!(fine("snoise(P + 0.3)"), 0.0);
    assert_eq!(fine("fbm(P * 3, 5)"), 0.5);
    assert_eq!(fine("sin(P.x * 40)"), 0.0);
    // What a place is multiplied by, its pixels are too.
    let sharp = |factor: f32| seen(&format!("snoise([0.3, 0.7, 0.1] + P * {factor})"), 0.05)[0];
    assert!(sharp(1.0) != 0.0);
    assert_eq!(sharp(1000.0), 0.0);
    assert_ne!(seen("sin(P.x)", 0.01)[0], 0.0);
    // A constant is the same everywhere, however large a pixel.
    assert_eq!(seen("noise([0.3, 0.2, 0.9])", 100.0), seen("noise([0.3, 0.2, 0.9])", 0.0));
}

#[test]
fn texts_that_are_no_programs_are_told_where() {
    let cases = [
        ("", "line 1, column 1: the program makes nothing"),
        ("a = 1;", "makes nothing"),
        ("color = ;", "line 1, column 9: expected a value, found \";\""),
        ("color = [1, 2];", "expected \",\", found \"]\""),
        ("a = 1;\n  color = b;", "line 2, column 11: there is no \"b\""),
        ("\n\ncolour(3)", "line 3, column 1: there is no function \"colour\""),
        ("mix(1, 2)", "mix takes 3 values, not 2"),
        ("1 + ", "expected a value, found the end"),
        ("(1", "expected \")\""),
        ("if (1) { color = 1;", "a \"}\" is missing"),
        ("P = [1, 2, 3];", "\"P\" is what it is"),
        ("@", "\"@\" means nothing"),
        ("1.2.3", "is no number"),
        ("'x", "no end"),
        ("object(3)", "a name in quotes"),
        ("P.q", "no part \"q\""),
        ("scale.x", "a number has no parts"),
        ("[P, 1, 2]", "three numbers"),
        ("voronoi(P, 9)", "1, 2, 3 or 4"),
        ("remap(P, 1, 1, 1, 3)", "0, 1 or 2"),
        ("material(P)", "material wants a name in quotes"),
        ("def f(a) { f(a) } f(1)", "f calls itself: functions cannot"),
        ("def f(a) { g(a) } def g(a) { f(a) } f(1)", "(f calls g calls f)"),
        ("smothstep(x, 0, 1)", "did you mean \"smoothstep\"?"),
        ("noize(P)", "did you mean \"noise\"?"),
        ("color = colour;", "did you mean \"color\"?"),
        ("color = 1; // red", "line 1, column 12: a comment begins with #"),
        ("/* red */ 1", "a comment begins with #"),
        ("if (x = 1) { color = 1; }", "two values are compared by =="),
        ("a\u{df}e = 1;", "names are letters a to z"),
        ("object(\u{201c}x\u{201d})", "quotes are"),
        ("1 \u{2212} 2", "a minus is -"),
        ("def f(a) { a = 1; } f(1)", "must end with a value"),
        ("def sin(a) { a } sin(1)", "already"),
        ("def f(a) { a } def f(a) { a + 1 } f(1)", "two functions \"f\""),
        ("def f(a, a) { a } f(1, 2)", "f takes \"a\" twice"),
        ("PI = 3;", "\"PI\" is what it is"),
        ("P ? 1 : 2", "a condition is one number"),
        ("if (P > 1) { color = 1; }", "a condition is one number"),
        ("1 2", "expected the end"),
        ("if (1) { 3 }", "goes nowhere"),
        ("\u{e4}", "means nothing"),
    ];
    for (code, expected) in cases {
        let error = program(code).err().unwrap_or_else(|| panic!("{code}"));
        assert!(error.contains(expected), "{code}: {error}");
    }
    // Deep is not around.
    let mut chain = "def f0(a) { a }\n".to_owned();
    (1..40).for_each(|i| chain += &format!("def f{i}(a) {{ f{}(a) }}\n", i - 1));
    let error = program(&(chain + "f39(1)")).unwrap_err();
    assert!(error.contains("more than 32 deep") && !error.contains("itself"), "{error}");
    let deep = format!("{}1{}", "(".repeat(5000), ")".repeat(5000));
    assert!(program(&deep).unwrap_err().contains("nested"));
    assert!(program(&"-".repeat(100_000)).unwrap_err().contains("nested"));
    assert!(program(&"1+".repeat(200_000)).unwrap_err().contains("give parts of it names"));
    let long = format!("{}1", "1+".repeat(300));
    assert_eq!(seen(&long, 0.0)[0], 301.0);
    let named = "a".repeat(3) + &".x".repeat(100_000);
    assert!(program(&named).is_err());
    // Calls inside calls, each within its limit, and a doubling that makes no instruction.
    let mut code = format!("def f0(a) {{ a + {long} }}\n");
    for i in 1..31 {
        code += &format!("def f{i}(a) {{ f{}(a){} }}\n", i - 1, "+1".repeat(300));
    }
    assert!(program(&(code + "f30(1)")).unwrap_err().contains("inside each other"));
    let mut code = "def f0(a) { a }\n".to_owned();
    for i in 1..31 {
        code += &format!("def f{i}(a) {{ f{}(a) + f{}(a) }}\n", i - 1, i - 1);
    }
    assert!(program(&(code + "f30(1)")).unwrap_err().contains("too long"));
    let given = BTreeMap::from([("color".to_owned(), Parameter::Number(1.0))]);
    let error = Program::new("color = 1;", &given, &BTreeMap::new()).unwrap_err().to_string();
    assert!(error.contains("the name of a variable"), "{error}");
    // Functions that double what they are given, thirty times: too much, and told so at once.
    let mut code = "def f0(a) { noise(a + P) + noise(a * P) }\n".to_owned();
    for i in 1..30 {
        code += &format!("def f{i}(a) {{ f{}(a + {i}) + f{}(a * {i}) }}\n", i - 1, i - 1);
    }
    assert!(program(&(code + "f29(1)")).unwrap_err().contains("instructions"));
}

#[test]
fn no_text_crashes() {
    let words = [
        "P", "color", "=", ";", "(", ")", "[", "]", "{", "}", "if", "else", "def", "f", "1", "0",
        "1e39", ".x", "+", "-", "*", "/", "%", "^", "?", ":", ",", "noise", "fbm", "voronoi",
        "mix", "'a'", "object", "#", "\n", "sqrt", "log", "&&", "<",
    ];
    let mut random = Random::new(5);
    let mut sound = 0;
    for _ in 0..20_000 {
        let count = random.between(1.0, 14.0) as usize;
        let word = |random: &mut Random| {
            words[random.between(0.0, words.len() as f64) as usize % words.len()]
        };
        let code: Vec<&str> = (0..count).map(|_| word(&mut random)).collect();
        if let Ok(program) = program(&code.join(" ")) {
            sound += 1;
            let made =
                program.run(3, |_, _, out| out.copy_from_slice(&[f32::NAN, f32::INFINITY, -1e30]));
            assert!(made.color.iter().all(|color| color.is_finite()), "{code:?}");
        }
    }
    assert!(sound > 100, "{sound}");
}

fn shown(image: &SpanImage, channels: &[Channel]) -> Image {
    let framing = Framing::scaled(image.view().raster(), DVec2::ONE).unwrap();
    let channels: BTreeSet<Channel> = channels.iter().copied().collect();
    resolve(image, RULE, &framing, &channels).unwrap()
}

fn streamed(image: &SpanImage, code: &str) -> SpanImage {
    image.shaded(Arc::new(Stream::new(code, BTreeMap::new(), BTreeMap::new()).unwrap())).unwrap()
}

fn named(label: &str, of: &Arc<Scene>) -> Arc<Scene> {
    let mut named = Scene::clone(of);
    named.label = label.to_owned();
    Arc::new(named)
}

#[test]
fn one_object_is_graded_by_name_without_a_fringe() {
    // Two clusters that cross: the one graded by name after the merge is the one graded before it, bit for bit,
    // and so is the one that a node of Rust grades.
    let (a, b) = (
        named("town", &scene("", random_faces(3, 20))),
        named("trees", &scene("", random_faces(4, 20))),
    );
    let view = front_view(120, 80);
    let spans = |scene: &Arc<Scene>| {
        scanline::render(&[scene.clone().into()], &view, RULE.plan().unwrap(), 0..80).unwrap()
    };
    let light = || {
        Arc::new(illuminate(
            vec![sun(v(-1.0, -2.0, -1.0), Color::WHITE)],
            Color::grey(0.2),
            Color::grey(0.1),
        ))
    };
    let grade =
        |color: &str| format!("{color} = [color.r * 1.3 + 0.02, color.g * 0.7, color.b * 0.5];");
    let after = SpanImage::merge(&[spans(&a), spans(&b)]).unwrap().shaded(light()).unwrap();
    let after = streamed(&after, &format!("if (object('trees*')) {{ {} }}", grade("color")));
    let own = streamed(&spans(&b).shaded(light()).unwrap(), &grade("color"));
    let before = SpanImage::merge(&[spans(&a).shaded(light()).unwrap(), own]).unwrap();
    let recolored = Recolor {
        multiply: Color::new(1.3, 0.7, 0.5),
        add: Color::new(0.02, 0.0, 0.0),
        saturation: 1.0,
    };
    let by_node = spans(&b).shaded(light()).unwrap().shaded(Arc::new(recolored)).unwrap();
    let by_node = SpanImage::merge(&[spans(&a).shaded(light()).unwrap(), by_node]).unwrap();
    let [after, before, by_node] =
        [after, before, by_node].map(|image| shown(&image, &[Channel::Color]));
    for name in ["R", "G", "B", "A"] {
        let [after, before, by_node] = [&after, &before, &by_node].map(|p| p.float(name).unwrap());
        assert_eq!(after, before);
        let off = after.iter().zip(by_node).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(off < 1e-5, "{name}: {off}");
    }
}

#[test]
fn places_are_those_of_the_picture_and_layers_go_on_summing() {
    let floor = |x: f64| {
        vec![v(x, -1.0, 2.0), v(x + 3.0, -1.0, 2.0), v(x + 3.0, -1.0, -4.0), v(x, -1.0, -4.0)]
    };
    let scene = scene("floor", polygons(&[floor(-3.0), floor(0.0)]));
    let camera =
        Camera { position: v(0.0, 1.0, 5.0), look_at: v(0.0, -1.0, 0.0), ..Camera::default() };
    let view = View::new(&camera, Raster::new(80, 60).unwrap()).unwrap();
    let image = scanline::render(&[scene.into()], &view, RULE.plan().unwrap(), 0..60).unwrap();
    let unlit = streamed(&image, "P / 10 + 0.5");
    let picture = shown(&unlit, &[Channel::Color, Channel::P]);
    let value = |name: &str, at: usize| picture.float(name).unwrap()[at];
    for at in (0..80 * 60).filter(|at| value("A", *at) == 1.0) {
        for (color, place) in [("R", "P.X"), ("G", "P.Y"), ("B", "P.Z")] {
            let off = value(color, at) - (value(place, at) / 10.0 + 0.5);
            // A pixel that shows two faces shows both of their places.
            assert!(off.abs() < 0.01, "{color} {at}: {off}");
        }
    }
    let light = illuminate(
        vec![sun(v(-1.0, -2.0, -1.0), Color::WHITE)],
        Color::grey(0.2),
        Color::grey(0.1),
    );
    let lit = image.shaded(Arc::new(light)).unwrap();
    let graded = streamed(&lit, "color ^ 1.7 + [0.1, 0, 0] * cellnoise(P)");
    let picture = shown(&graded, &[Channel::Color, Channel::Light]);
    let red = picture.float("R").unwrap();
    let parts: Vec<&[f32]> = picture
        .channels()
        .filter(|(name, _)| name.ends_with(".R"))
        .map(|(name, _)| picture.float(name).unwrap())
        .collect();
    assert!(parts.len() >= 3);
    for (at, red) in red.iter().enumerate() {
        let sum: f32 = parts.iter().map(|part| part[at]).sum();
        assert!((sum - red).abs() < 1e-5, "{at}: {sum} {red}");
    }
}

fn told(image: &SpanImage, code: &str, channels: &[&str]) -> Result<SpanImage, String> {
    let kind = |name: &str| if name == "way" { ValueKind::Color } else { ValueKind::Number };
    let channels = channels.iter().map(|name| ((*name).to_owned(), kind(name))).collect();
    let stream = Stream::new(code, BTreeMap::new(), channels).map_err(|fault| fault.to_string())?;
    image.shaded(Arc::new(stream)).map_err(|error| error.to_string())
}

#[test]
fn channels_go_from_program_to_program_and_into_the_picture() {
    let view = front_view(120, 80);
    let spans = |label: &str, seed: u64| {
        let scene = named(label, &scene("", random_faces(seed, 20)));
        scanline::render(&[scene.into()], &view, RULE.plan().unwrap(), 0..80).unwrap()
    };
    let both = SpanImage::merge(&[spans("town", 3), spans("trees", 4)]).unwrap();
    let made =
        told(&both, "if (object('trees*')) { wet = 0.5; way = [depth, 1, 0]; }", &["wet", "way"])
            .unwrap();
    let after = told(&made, "color = wet > 0 ? [way.x, wet, way.y] : [0, 0, 0];", &["wet", "way"]);
    let after = after.unwrap();
    let picture = shown(&after, &[Channel::Color, Channel::Made]);
    // What a later program reads of them is what was made, at the very fragments, and so is what is resolved.
    let value = |name: &str| picture.float(name).unwrap();
    assert_eq!(
        (value("R"), value("G"), value("B")),
        (value("way.R"), value("wet"), value("way.G"))
    );
    assert!(value("way.B").iter().all(|v| *v == 0.0));
    // Alone and covered by the other, the trees cover what their channel says.
    let held = streamed(&both, "color = object('trees*') ? 1 : 0;");
    let held = shown(&held, &[Channel::Color]);
    for (way, covered) in value("way.G").iter().zip(held.float("R").unwrap()) {
        assert!((way - covered).abs() < 1e-6);
    }
    assert!(value("wet").contains(&0.5) && value("wet").contains(&0.0));
    // Those that nobody made, or nobody may make.
    let error = told(&made, "color = dry;", &["dry"]).unwrap_err();
    assert!(
        error.contains("no node before makes the channel \"dry\"") && error.contains("way, wet")
    );
    assert!(told(&made, "dry = dry + 1;", &["dry"]).is_ok());
    assert!(
        told(&made, "N1 = 1;", &["N1", "P"]).unwrap_err().contains("the name of something else")
    );
    assert!(told(&made, "N1 = 1;", &["N1", "a-b"]).unwrap_err().contains("letters, digits"));
    assert!(told(&made, "b = P;", &["b"]).unwrap_err().contains("is given a vector"));
    assert!(told(&made, "a = 1;", &["b"]).unwrap_err().contains("makes nothing"));
}

#[test]
fn coverage_is_the_share_of_the_pixel_and_objects_have_numbers() {
    let view = front_view(60, 40);
    let triangle = vec![v(-3.1, -1.7, 0.0), v(2.9, -1.1, 0.0), v(0.3, 2.3, 0.0)];
    let scene = named("one", &scene("", polygons(&[triangle])));
    let image = scanline::render(&[scene.into()], &view, RULE.plan().unwrap(), 0..40).unwrap();
    let picture =
        shown(&streamed(&image, "color = [coverage, object, 1];"), &[Channel::Color, Channel::Id]);
    let value = |name: &str| picture.float(name).unwrap();
    let mut partial = 0;
    for at in 0..60 * 40 {
        let alpha = value("A")[at];
        assert!((value("R")[at] - alpha * alpha).abs() < 1e-6, "{at}");
        partial += usize::from(alpha > 0.01 && alpha < 0.99);
    }
    assert!(partial > 30, "{partial}");
    let id = *picture.names.keys().next().unwrap();
    let middle = 20 * 60 + 30;
    assert_eq!((value("A")[middle], value("G")[middle]), (1.0, (id >> 8) as f32));
}

#[test]
fn programs_are_kept_with_their_spans() {
    let image = streamed(
        &scanline::render(
            &[scene("", random_faces(3, 20)).into()],
            &front_view(40, 30),
            RULE.plan().unwrap(),
            0..30,
        )
        .unwrap(),
        "turbulence(P * 2)",
    );
    let shader = image.shaders().next().unwrap();
    let text = serde_json::to_string(shader).unwrap();
    assert!(text.contains("turbulence(P * 2)"), "{text}");
    let back: Box<dyn spandrel_engine::fragment::Shader> = serde_json::from_str(&text).unwrap();
    assert_eq!(serde_json::to_string(&back).unwrap(), text);
    assert!(
        serde_json::from_str::<Box<dyn spandrel_engine::fragment::Shader>>(
            &text.replace("* 2", "* ")
        )
        .is_err()
    );
}

#[test]
fn texture_coordinates_are_the_meshs_own_without_a_picture_on_it() {
    // A square whose coordinates run the other way than its corners.
    let folder = Scratch::new("stream-uv");
    let square = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 1 0\nvt 0 0\nvt 0 1\nvt 1 1\nf 1/1 2/2 3/3 4/4\n";
    std::fs::write(folder.path().join("s.obj"), square).unwrap();
    let nodes = Nodes::new(
        folder.path(),
        r#""eye": Camera(position: (0, 0, 5), parallel_height: 2), "s": Scanline(scene: "s.obj", camera: "eye"),
        "c": Stream(image: "s", code: "color = [u, v, 0];"),
        "p": Resolve(image: "c", size: (8, 8), lines: Sloped(2))"#,
    );
    let made = nodes.picture("p", None).unwrap();
    for (x, y) in [(0, 0), (7, 0), (2, 5)] {
        let [u, v, ..] = made.image.rgba(x, y);
        let expected = [1.0 - (x as f32 + 0.5) / 8.0, 1.0 - (y as f32 + 0.5) / 8.0];
        let near = (u - expected[0]).abs() < 1e-5 && (v - expected[1]).abs() < 1e-5;
        assert!(near, "{x}, {y}: {u} {v}, {expected:?}");
    }
}
