//! Films: what changes in time, what is computed anew for it, and what is not.

use spandrel_engine::graph::demand::Wishes;
use spandrel_engine::graph::document::Document;
use spandrel_engine::graph::report::{Evaluated, Outcome};
use spandrel_engine::graph::{Graph, Run, Schedule};
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::values::{Override, PictureDemand};
use spandrel_tests::program::{Ran, Scratch, run};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

/// A board of 2 by 2 metres before a parallel camera that sees 8 by 4 metres, 10 pixels to the metre.
pub(crate) const BOARD: &str = r##"Scene(
    materials: {"white": (color: "#fff", unlit: true)},
    plans: [(name: "p", root: (material: "white", shape: Polygon(outline: [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])))],
)"##;

const NODES: &str = r#"
    "eye": Camera(position: (EYE, 0, 9), look_at: (EYE, 0, 0), parallel_height: 4),
    "board": Scanline(scene: "board.ron", camera: "eye"),
    "still": Camera(position: (2.5, 0, 9), look_at: (2.5, 0, 0), parallel_height: 4),
    "wall": Scanline(scene: "board.ron", camera: "still"),
    "picture": Resolve(image: "board", size: (80, 40), lines: Sloped(4) MORE),
    "of_wall": Resolve(image: "wall", size: (80, 40), lines: Sloped(4)),
    "both": Over(front: "picture", back: "of_wall"),
    "file": Write(image: "both", path: "out/a.####.png"),
"#;

pub(crate) fn nodes(eye: &str, more: &str) -> String {
    NODES.replace("EYE", eye).replace("MORE", more)
}

pub(crate) fn folder(name: &str) -> Scratch {
    let scratch = Scratch::new(name);
    std::fs::write(scratch.path().join("board.ron"), BOARD).unwrap();
    scratch
}

fn parse(text: &str) -> Document {
    Document::parse(text).unwrap_or_else(|faults| panic!("{faults:?}"))
}

/// A graph that was checked for some frames.
pub(crate) fn graph(folder: &Path, text: &str, frames: &str) -> Graph {
    let graph =
        Graph::check_frames(&parse(text), &spandrel::library(), folder, &frames.parse().unwrap());
    graph.unwrap_or_else(|faults| panic!("{faults:?}"))
}

/// What is wrong with a graph at frames: the messages, and the texts that they blame.
fn faults(folder: &Path, text: &str, frames: &str) -> Vec<(String, String)> {
    let document = parse(text);
    let graph =
        Graph::check_frames(&document, &spandrel::library(), folder, &frames.parse().unwrap());
    let Err(faults) = graph else { return Vec::new() };
    let blamed = faults.into_iter().map(|fault| {
        let text = document.text[fault.span.clone()].to_owned();
        (fault.message, text)
    });
    blamed.collect()
}

pub(crate) fn evaluate(run: &Run, graph: &Graph, node: &str, frames: &[f64]) -> Evaluated {
    let mut wishes = Wishes::new();
    for frame in frames {
        let channels = BTreeSet::from([Channel::Color]);
        let demand = PictureDemand { channels, changed: Override::default() };
        wishes.want_at::<Image>(node, demand, *frame);
    }
    let schedule = Schedule::new(graph, &wishes).unwrap();
    run.evaluate(graph, &schedule, &()).unwrap()
}

pub(crate) fn picture(graph: &Graph, node: &str, frame: f64) -> Arc<Image> {
    evaluate(&Run::new(), graph, node, &[frame]).value(0)
}

/// How often each node was computed.
pub(crate) fn computed(done: &Evaluated) -> BTreeMap<&str, usize> {
    let mut counts = BTreeMap::new();
    for report in done.reports.iter().filter(|report| report.outcome == Outcome::Evaluated) {
        *counts.entry(report.node.as_str()).or_insert(0) += 1;
    }
    counts
}

#[test]
fn a_frame_is_the_graph_that_somebody_would_have_written_for_it() {
    let scratch = folder("films-frame");
    let moving = [
        "Curve([(1, 0), (5, 2)], Linear)",
        "Expr(\"(frame - 1) / 2\")",
        "Expr(\"time * 12 - 0.5\")",
        "Ref(\"place\")",
        "Expr(\"place * 1\")",
        "Expr(\"other.position.y\")",
    ];
    for eye in moving {
        let text = format!(
            "Graph(parameters: {{\"place\": Number(default: Curve([(1, 0), (5, 2)], Linear))}},
             nodes: {{{}, \"other\": Camera(position: (0, Expr(\"frame / 2 - 0.5\"), 5))}})",
            nodes(eye, "").trim().trim_end_matches(',')
        );
        let film = graph(scratch.path(), &text, "1-5");
        for frame in 1..=5 {
            let eye = f64::from(frame - 1) / 2.0;
            let still = format!("Graph(nodes: {{{}}})", nodes(&eye.to_string(), ""));
            let still = graph(scratch.path(), &still, "1");
            let (a, b) = (picture(&film, "both", f64::from(frame)), picture(&still, "both", 1.0));
            assert_eq!(a, b, "{eye} at frame {frame}");
        }
    }
}

#[test]
fn what_does_not_move_is_computed_once() {
    let scratch = folder("films-once");
    let text = format!("Graph(nodes: {{{}}})", nodes("Curve([(1, 0), (3, 1)])", ""));
    let film = graph(scratch.path(), &text, "1-4");
    // One by one, and all at once.
    let run = Run::new();
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for frame in 1..=4 {
        let done = evaluate(&run, &film, "both", &[f64::from(frame)]);
        for (node, count) in computed(&done) {
            *counts.entry(node.to_owned()).or_insert(0) += count;
        }
        run.forget_unused();
    }
    let all = evaluate(&Run::new(), &film, "both", &[1.0, 2.0, 3.0, 4.0]);
    let all: BTreeMap<String, usize> =
        computed(&all).into_iter().map(|(node, count)| (node.to_owned(), count)).collect();
    assert_eq!(counts, all);
    // Frame 4 is frame 3: the curve holds.
    let expected = [
        ("board", 3),
        ("board.ron", 1),
        ("both", 3),
        ("eye", 3),
        ("of_wall", 1),
        ("picture", 3),
        ("still", 1),
        ("wall", 1),
    ];
    let expected = expected.map(|(node, count)| (node.to_owned(), count));
    assert_eq!(counts, BTreeMap::from(expected));
}

#[test]
fn what_is_wrong_at_some_frame_is_told_before_any_is_made() {
    let scratch = folder("films-faults");
    let of = |eye: &str, frames: &str| {
        let text = format!(
            "Graph(parameters: {{\"deep\": Number(default: Expr(\"frame\"), range: (0, 9))}}, nodes: {{{}}})",
            nodes(eye, "")
        );
        faults(scratch.path(), &text, frames)
    };
    assert_eq!(of("Expr(\"still.position.x\")", "1-9"), []);
    let found = of("Expr(\"1 / (frame - 3)\")", "1-5");
    assert_eq!(found.len(), 2, "position and look_at: {found:?}");
    assert!(found[0].0.contains("inf at frame 3"), "{found:?}");
    assert_eq!(found[0].1, "Expr(\"1 / (frame - 3)\")");
    // Out of its range, from a frame on: told once.
    let found = of("0", "8-30");
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].0.contains("\"deep\" is 10") && found[0].0.contains("frame 10"), "{found:?}");
    for (eye, message, place) in [
        (
            "Expr(\"eye.position.x\")",
            "in a circle: \"eye.position\" uses \"eye.position\"",
            "Expr(",
        ),
        ("Ref(\"nobody.at\")", "there is no node \"nobody\"", "Ref("),
        ("Ref(\"still.positon\")", "did you mean `position`?", "Ref("),
        ("Ref(\"still\")", "still.FIELD", "Ref("),
        ("Expr(\"depe\")", "did you mean \"deep\"?", "d"),
        ("Expr(\"board.scene\")", "no number or vector", "Expr("),
        ("Curve([(1, 0), (0, 1)])", "not behind", "(0, 1)"),
        ("Expr(\"[1, 2, 3]\")", "", "Expr("),
    ] {
        let found = of(eye, "1-2");
        assert!(!found.is_empty() && found[0].0.contains(message), "{eye}: {found:?}");
        assert!(found[0].1.starts_with(place), "{eye}: {found:?}");
    }
    let circle = format!(
        "Graph(parameters: {{\"a\": Number(default: Expr(\"b + 1\")), \"b\": Number(default: Ref(\"eye.field_of_view\"))}},
         nodes: {{{}}})",
        nodes("1", "").replace("parallel_height: 4", "field_of_view: Expr(\"a\")"),
    );
    let found = faults(scratch.path(), &circle, "1");
    let way = "\"b\" uses \"eye.field_of_view\" uses \"a\" uses \"b\"";
    assert!(found.iter().any(|(message, _)| message.contains(way)), "{found:?}");
    // Two fields of one node may use each other's neighbours.
    let crossed =
        nodes("0", "").replace("parallel_height: 4", "parallel_height: Expr(\"still.front + 4\")");
    let crossed =
        crossed.replace("\"still\": Camera(", "\"still\": Camera(front: Expr(\"eye.front\"), ");
    assert_eq!(faults(scratch.path(), &format!("Graph(nodes: {{{crossed}}})"), "1"), []);
}

#[test]
fn parameters_have_types_and_ranges_and_are_set() {
    let scratch = folder("films-parameters");
    let text = |parameters: &str| {
        format!(
            "Graph(parameters: {{{parameters}}}, nodes: {{{}}})",
            nodes("0", "")
                .replace("(80, 40), lines: Sloped(4) ", "Ref(\"size\"), lines: Ref(\"rule\")")
        )
    };
    let sound = "\"size\": Value(default: (20, 10), doc: \"of it\"),
        \"rule\": Choice(default: Sloped(2), of: [Sloped(2), Sampled(1, Box)])";
    let document = parse(&text(sound));
    let check = |document: &Document| Graph::check(document, &spandrel::library(), scratch.path());
    let graph = check(&document).unwrap_or_else(|faults| panic!("{faults:?}"));
    assert_eq!(picture(&graph, "picture", 1.0).size, (20, 10));
    let info = &graph.parameters()[1];
    assert_eq!(
        (info.name.as_str(), info.value.as_str(), info.choices.len()),
        ("rule", "Sloped(2)", 2)
    );
    let mut set = document.clone();
    set.set_parameter("size", "(30, 10)").unwrap();
    let graph = check(&set).unwrap_or_else(|faults| panic!("{faults:?}"));
    assert_eq!(picture(&graph, "picture", 1.0).size, (30, 10));
    assert!(
        document.clone().set_parameter("sice", "1").unwrap_err().contains("did you mean \"size\"")
    );
    set.set_parameter("rule", "Exact").unwrap();
    let Err(faults) = check(&set) else { panic!("Exact is no choice") };
    assert!(faults[0].message.contains("is one of Sloped(2), Sampled(1, Box)"), "{faults:?}");
    assert_eq!(set.blamed(&faults[0]).1.lines().last(), Some("rule=Exact"));
    for (parameter, message) in [
        ("\"x\": Number(default: 3, range: (0, 1))", "it goes from 0 to 1"),
        ("\"x\": Number(default: \"a\")", "\"x\" is a number"),
        ("\"x\": Whole(default: 1.5)", "a whole number"),
        ("\"x\": Flag(default: 1)", "true or false"),
        ("\"x\": Color(default: \"#12\")", "a colour"),
        ("\"x\": Vector(default: (1, 2))", "three numbers"),
        ("\"x\": Text(default: 1)", "a text"),
        ("\"x\": Numbr(default: 1)", "is no kind of parameter"),
        ("\"x\": (default: 1)", "begins with its kind"),
        ("\"x\": Number(defalt: 1)", "a Number has no `defalt`"),
        ("\"x\": Number()", "needs a `default`"),
        ("\"x\": Flag(default: true, range: (0, 1))", "a Flag has no `range`"),
        ("\"x\": Number(default: 1, range: (2, 1))", "the least and the greatest"),
        ("\"frame\": Number(default: 1)", "cannot be called \"frame\""),
        ("\"x\": Choice(default: A)", "needs `of`"),
    ] {
        let text = text(&format!("{sound}, {parameter}"));
        let Err(faults) = check(&parse(&text)) else { panic!("{parameter}") };
        assert!(
            faults.iter().any(|fault| fault.message.contains(message)),
            "{parameter}: {faults:?}"
        );
    }
}

/// The board of a film is by half a metre for each frame further to the right: as if the eye were to the left.
pub(crate) fn moves_right(film: &Graph, folder: &Path, frame: u32) {
    let eye = -f64::from(frame - 1) / 2.0;
    let still = format!("Graph(nodes: {{{}}})", nodes(&eye.to_string(), ""));
    let still = graph(folder, &still, "1");
    let (a, b) = (picture(film, "both", f64::from(frame)), picture(&still, "both", 1.0));
    assert_eq!(a.channel("R").unwrap(), b.channel("R").unwrap(), "frame {frame}");
}

#[test]
fn scenes_move_and_so_do_those_that_they_name() {
    let scratch = folder("films-scenes");
    let moving = BOARD.replace(
        "root: (material",
        "cameras: {\"front\": (position: (Expr(\"time * 24\"), 0, 9), look_at: (0, 0, 0))},
         root: (transform: [Move(Curve([(1, 0), (5, 2)], Linear), 0, 0)], material",
    );
    std::fs::write(scratch.path().join("moving.ron"), &moving).unwrap();
    let around = "Scene(plans: [(name: \"p\", root: (children: [(name: \"it\", shape: File(path: \"moving.ron\"))]))])";
    std::fs::write(scratch.path().join("around.ron"), around).unwrap();
    for scene in ["moving.ron", "around.ron"] {
        let film = format!("Graph(nodes: {{{}}})", nodes("0", "").replacen("board.ron", scene, 1));
        let film = graph(scratch.path(), &film, "1-5");
        [1, 3, 5].iter().for_each(|frame| moves_right(&film, scratch.path(), *frame));
        let done = evaluate(&Run::new(), &film, "both", &[1.0, 2.0]);
        let counts = computed(&done);
        assert_eq!([counts["board"], counts["wall"], counts[scene]], [2, 1, 2]);
    }
    std::fs::write(scratch.path().join("moving.ron"), moving.replace("(5, 2)]", "(5, x)]"))
        .unwrap();
    let film =
        format!("Graph(nodes: {{{}}})", nodes("0", "").replacen("board.ron", "moving.ron", 1));
    let film = graph(scratch.path(), &film, "1");
    let mut wishes = Wishes::new();
    wishes.want::<spandrel_engine::scene::Scene>("moving.ron", ());
    let schedule = Schedule::new(&film, &wishes).unwrap();
    let Err(failure) = Run::new().evaluate(&film, &schedule, &()) else { panic!("x is no number") };
    assert!(failure.to_string().contains("moving.ron"), "{failure}");
}

/// The coverage of a pixel by a board whose right edge moves: the mean over the time, in closed form.
#[test]
fn a_shutter_sees_the_mean_of_what_passes() {
    let scratch = folder("films-shutter");
    // 2 metres to the left in a frame: the board moves 20 pixels to the right.
    let blurred = |samples: u32| {
        let more = format!(", shutter: (-0.5, 0.5), samples: {samples}");
        let text = format!("Graph(nodes: {{{}}})", nodes("Expr(\"-2 * (frame - 1)\")", &more));
        let film = graph(scratch.path(), &text, "1");
        let done = evaluate(&Run::new(), &film, "picture", &[1.0]);
        let counts = computed(&done);
        assert_eq!(counts["board"], samples as usize);
        let image = done.value::<Image>(0);
        let alpha = image.channel("A").and_then(|samples| samples.floats()).unwrap();
        alpha[20 * 80..21 * 80].to_vec()
    };
    // At time t, -1/2 to 1/2, it covers pixels 30 + 20 t to 50 + 20 t.
    let covered = |column: usize| {
        let steps = 4000;
        let at = |k: usize| {
            let left = 30.0 + 20.0 * ((k as f64 + 0.5) / f64::from(steps as u32) - 0.5);
            let (a, b) = (column as f64, column as f64 + 1.0);
            ((left + 20.0).min(b) - left.max(a)).max(0.0)
        };
        (0..steps).map(at).sum::<f64>() / f64::from(steps as u32)
    };
    let mut last = f64::INFINITY;
    for samples in [1, 4, 16, 64] {
        let alpha = blurred(samples);
        let sum: f64 = alpha.iter().map(|alpha| f64::from(*alpha)).sum();
        assert!((sum - 20.0).abs() < 1e-4, "{samples}: nothing is lost, {sum}");
        let error = |(column, alpha): (usize, &f32)| (f64::from(*alpha) - covered(column)).abs();
        let worst = alpha.iter().enumerate().map(error).fold(0.0, f64::max);
        assert!(worst < last, "{samples}: {worst} after {last}");
        last = worst;
    }
    // 64 moments are a third of a pixel apart: exact, but for the edges of edges.
    assert!(last < 1e-3, "{last}");
    // What stands still is solved once, and is what it is without a shutter.
    let text = format!("Graph(nodes: {{{}}})", nodes("0", ", shutter: (-0.5, 0.5)"));
    let done = evaluate(&Run::new(), &graph(scratch.path(), &text, "1"), "picture", &[1.0]);
    assert_eq!(computed(&done)["board"], 1);
}

fn program(folder: &Path, arguments: &[&str]) -> Ran {
    run(PROGRAM, arguments, folder)
}

#[test]
fn frames_are_written_to_files_of_their_own() {
    let scratch = folder("films-files");
    let text = format!("Graph(frames: \"-1-1\", nodes: {{{}}})", nodes("Expr(\"frame\")", ""));
    std::fs::write(scratch.path().join("g.ron"), &text).unwrap();
    let names = || {
        let entries = std::fs::read_dir(scratch.path().join("out")).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        std::fs::remove_dir_all(scratch.path().join("out")).unwrap();
        names
    };
    let ran = program(scratch.path(), &["render", "g.ron"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(names(), ["a.-0001.png", "a.0000.png", "a.0001.png"]);
    let ran =
        program(scratch.path(), &["render", "g.ron", "-F", "1-5x2,10", "-o", "out/b_%03d.png"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(names(), ["b_001.png", "b_003.png", "b_005.png", "b_010.png"]);
    let ran = program(scratch.path(), &["render", "g.ron", "-F", "-3--2", "--window", "0,0,8,8"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(names(), ["a.-0002.0,0,8,8.png", "a.-0003.0,0,8,8.png"]);
    let ran = program(scratch.path(), &["render", "g.ron", "-F", "1-2", "-o", "out/c.png"]);
    assert_eq!(ran.code, Some(2), "{ran:?}");
    assert!(
        ran.err.contains("frames 1 and 2 would both write") && ran.err.contains("####"),
        "{ran:?}"
    );
    let ran = program(scratch.path(), &["render", "g.ron", "-F", "1:5"]);
    assert_eq!(ran.code, Some(2), "{ran:?}");
    assert!(ran.err.contains("colon"), "{ran:?}");
    let ran = program(scratch.path(), &["render", "g.ron", "-n"]);
    assert!(ran.out.contains("at each of 3 frames from -1 on: eye, board"), "{ran:?}");
    // What is the same in all frames is written once, under one name.
    let still = format!("Graph(nodes: {{{}}})", nodes("0", "").replace("a.####", "a"));
    std::fs::write(scratch.path().join("still.ron"), still).unwrap();
    let ran = program(scratch.path(), &["render", "still.ron", "-F", "1-5"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert!(ran.err.contains("written once"), "{ran:?}");
    assert_eq!(names(), ["a.png"]);
    // A sequence is read by its frames; a missing one is told before anything is made.
    program(scratch.path(), &["render", "g.ron", "-F", "1-3"]);
    let read = "Graph(nodes: {\"plate\": Read(file: \"out/a.####.png\"), \"file\": Write(image: \"plate\", path: \"out/c.####.png\"),
        \"direct\": Write(image: \"out/a.%04d.png\", path: \"out/d.####.png\")})";
    std::fs::write(scratch.path().join("read.ron"), read).unwrap();
    let ran = program(scratch.path(), &["render", "read.ron", "-F", "1-4"]);
    assert_eq!(ran.code, Some(4), "{ran:?}");
    assert!(
        ran.err.contains("a.0004.png") && !scratch.path().join("out/c.0001.png").exists(),
        "{ran:?}"
    );
    let ran = program(scratch.path(), &["render", "read.ron", "-F", "1-3"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    for frame in 1..=3 {
        let bytes = |name: &str| {
            let path = scratch.path().join(format!("out/{name}.{frame:04}.png"));
            image::open(path).unwrap().to_rgba8().into_raw()
        };
        assert_eq!(bytes("a"), bytes("c"), "frame {frame}");
        assert_eq!(bytes("a"), bytes("d"), "frame {frame}");
    }
}

#[test]
fn a_farm_goes_on_and_is_told() {
    let scratch = folder("films-farm");
    // At frame 2 the scene's file says nothing.
    std::fs::write(scratch.path().join("board.0001.ron"), BOARD).unwrap();
    std::fs::write(scratch.path().join("board.0002.ron"), "Scene(plans: [])").unwrap();
    std::fs::write(scratch.path().join("board.0003.ron"), BOARD).unwrap();
    let text =
        format!("Graph(nodes: {{{}}})", nodes("0", "").replacen("board.ron", "board.####.ron", 1));
    std::fs::write(scratch.path().join("g.ron"), text).unwrap();
    let ran = program(scratch.path(), &["render", "g.ron", "-F", "1-3"]);
    assert!(matches!(ran.code, Some(1 | 4)), "{ran:?}");
    assert!(ran.err.contains("frame 2: node"), "{ran:?}");
    assert!(scratch.path().join("out/a.0001.png").exists());
    let ran =
        program(scratch.path(), &["render", "g.ron", "-F", "1-3", "--keep-going", "--json", "-q"]);
    assert_eq!(ran.code, Some(5), "{ran:?}");
    assert!(ran.err.contains("1 frame failed: 2"), "{ran:?}");
    assert!(scratch.path().join("out/a.0003.png").exists());
    let events: Vec<serde_json::Value> =
        ran.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let kinds: Vec<&str> = events.iter().map(|event| event["event"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["started", "frame", "failed", "frame", "ended"], "{events:?}");
    assert_eq!(events[2]["frame"], 2);
    assert_eq!(events[4]["failed"], serde_json::json!([2]));
}

/// [N]'s film: what stands is computed once, what moves at each frame, and nothing else.
#[test]
fn the_town_solves_at_each_frame_what_moves() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../graphs");
    let text = std::fs::read_to_string(folder.join("cg_town.ron")).unwrap();
    let mut document = parse(&text);
    // As the film of 1987 was.
    document.set_parameter("lines", "Sampled(1, Box)").unwrap();
    // What is made anew is the same without, and takes a tenth of the time.
    document.set("lit", "shadows", "Off").unwrap();
    let frames = "1-48".parse().unwrap();
    let film = Graph::check_frames(&document, &spandrel::library(), &folder, &frames);
    let film = film.unwrap_or_else(|faults| panic!("{faults:?}"));
    let stands: BTreeSet<&str> =
        film.nodes().filter(|node| !node.varies).map(|node| node.id).collect();
    let expected = [
        "assets/town/buildings.ron",
        "assets/town/parked.ron",
        "assets/town/roads.ron",
        "assets/town/trees.ron",
        "buildings",
        "eye",
        "parked",
        "roads",
        "standing",
        "trees",
    ];
    assert_eq!(stands.iter().copied().collect::<Vec<_>>(), expected);
    let moves = [
        "air",
        "assets/town/driving.ron",
        "cars",
        "hazy",
        "lit",
        "picture",
        "sky",
        "street",
        "sun",
        "town",
        "turning",
    ];
    let run = Run::new();
    let mut last = None;
    for frame in 1..=48 {
        let done = evaluate(&run, &film, "picture", &[f64::from(frame)]);
        run.forget_unused();
        let made: Vec<&str> = computed(&done).into_keys().collect();
        match frame {
            1 => {
                let all: BTreeSet<&str> = stands.iter().copied().chain(moves).collect();
                assert_eq!(made, all.into_iter().collect::<Vec<_>>(), "frame 1");
            }
            // The weather holds for a while: its sun and its air are what they were.
            2..=4 | 45..=48 => {
                let still = ["air", "sun"];
                let moves: Vec<&str> =
                    moves.into_iter().filter(|node| !still.contains(node)).collect();
                assert_eq!(made, moves, "frame {frame}");
            }
            _ => assert_eq!(made, moves, "frame {frame}"),
        }
        let image = done.value::<Image>(0);
        assert_eq!(image.size, (480, 270));
        assert_ne!(last.as_ref(), Some(&image), "frame {frame} is that before it");
        last = Some(image);
    }
}

/// The job has what the Open Job Description asks for: checked and run by its own program, `openjd`, by hand.
#[test]
fn a_film_becomes_a_job() {
    let scratch = folder("films-job");
    let text = format!("Graph(frames: \"1-5\", nodes: {{{}}})", nodes("Expr(\"frame\")", ""));
    std::fs::write(scratch.path().join("g.ron"), text).unwrap();
    let more = [
        "--chunk",
        "2",
        "-j",
        "3",
        "--memory",
        "2G",
        "--cache",
        "/shared",
        "--set",
        "still.front=0.2",
    ];
    let ran = program(scratch.path(), &[&["submit", "g.ron"], &more[..]].concat());
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let job: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    assert_eq!(job["specificationVersion"], "jobtemplate-2023-09");
    let step = &job["steps"][0];
    let frames = &step["parameterSpace"]["taskParameterDefinitions"][0]["range"];
    assert_eq!(*frames, serde_json::json!(["1-2", "3-4", "5"]));
    let arguments = step["script"]["actions"]["onRun"]["args"].as_array().unwrap();
    let arguments: Vec<&str> =
        arguments.iter().map(|argument| argument.as_str().unwrap()).collect();
    assert_eq!(
        arguments.join(" "),
        "render {{Param.Graph}} -F {{Task.Param.Frames}} --keep-going -j 3 --memory 2048M --cache {{Param.Cache}} --set still.front=0.2"
    );
    let amounts = &step["hostRequirements"]["amounts"];
    assert_eq!((&amounts[0]["min"], &amounts[1]["min"]), (&3.into(), &3072.into()));
    // A path must be one below the template's folder.
    assert_eq!(job["parameterDefinitions"][0]["default"], "g.ron");
    let ran = program(scratch.path(), &["submit", "g.ron", "-o", "jobs/g.json"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let job = std::fs::read_to_string(scratch.path().join("jobs/g.json")).unwrap();
    let job: serde_json::Value = serde_json::from_str(&job).unwrap();
    assert_eq!(job["parameterDefinitions"][0]["type"], "STRING");
    let ran = program(scratch.path(), &["submit", "g.ron", "-F", "1-2000", "--chunk", "1"]);
    assert_eq!(ran.code, Some(2), "{ran:?}");
    assert!(ran.err.contains("--chunk 2"), "{ran:?}");
}

/// Values that name each other many times over are looked up once, and none grows without end.
#[test]
fn values_of_values_of_values_end() {
    let scratch = folder("films-deep");
    let check = |parameters: Vec<String>, eye: &str| {
        let text = format!(
            "Graph(parameters: {{{}}}, nodes: {{{}}})",
            parameters.join(", "),
            nodes(eye, "")
        );
        faults(scratch.path(), &text, "1-3")
    };
    let sums = (2..80)
        .map(|i| format!("\"p{i}\": Number(default: Expr(\"(p{} + p{}) / 2\"))", i - 1, i - 2));
    let first = [
        "\"p0\": Number(default: 1)".to_owned(),
        "\"p1\": Number(default: Expr(\"frame\"))".to_owned(),
    ];
    assert_eq!(check(first.into_iter().chain(sums).collect(), "Ref(\"p79\")"), []);
    let lists = (1..40)
        .map(|i| format!("\"l{i}\": Value(default: [Ref(\"l{}\"), Ref(\"l{}\")])", i - 1, i - 1));
    let first = ["\"l0\": Value(default: [1, 2, 3])".to_owned()];
    let found = check(first.into_iter().chain(lists).collect(), "0");
    assert!(
        found.iter().any(|(message, _)| message.contains("longer than")),
        "{:?}",
        found.first()
    );
}
