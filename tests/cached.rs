//! Results on disk: what is taken from them and what is made anew, for every change of a graph.

use spandrel_engine::graph::demand::Wishes;
use spandrel_engine::graph::document::Document;
use spandrel_engine::graph::report::{Evaluated, Outcome, Progress};
use spandrel_engine::graph::{Graph, Run, Schedule, Stored};
use spandrel_engine::image::{Channel, Image, Window};
use spandrel_engine::key::Key;
use spandrel_engine::store::Store;
use spandrel_engine::values::{Override, PictureDemand};
use spandrel_tests::program::{Scratch, run};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::{Arc, Mutex};

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

const NODES: &str = r##"
    "eye": Camera(position: (0, 3, 12), look_at: (0, 1, 0)),
    "land": Scanline(scene: "land.ron", camera: "eye"),
    "ball": Scanline(scene: "ball.ron", camera: "eye"),
    "all": DepthMerge(inputs: ["land", "ball"]),
    "sun": ParallelLight(direction: (-1, -2, -1)),
    "lit": Illuminate(image: "all", lights: ["sun"], shadows: Volumes, white: 1),
    "misty": Fog(image: "lit", density: 0.02),
    "picture": Resolve(image: "misty", size: (80, 60), lines: Sloped(3)),
    "graded": Grade(image: "picture", multiply: 0.5),
"##;

fn ball(x: &str) -> String {
    format!(
        "Scene(materials: {{\"m\": (color: \"#c04020\", maps: {{\"color\": (picture: File(\"skin.png\"), mapping: (by: Box))}})}},
         plans: [(name: \"p\", root: (material: \"m\", transform: [Move({x}, 1, 0)], shape: Sphere(radius: 1)))])"
    )
}

fn folder(name: &str) -> Scratch {
    let scratch = Scratch::new(name);
    let land = "Scene(plans: [(name: \"p\", root: (shape: Terrain(size: (9, 9), height: 1, levels: 4, seed: 1)))])";
    std::fs::write(scratch.path().join("land.ron"), land).unwrap();
    std::fs::write(scratch.path().join("ball.ron"), ball("0")).unwrap();
    skin(scratch.path(), 40);
    scratch
}

fn skin(folder: &Path, grey: u8) {
    let picture =
        image::GrayImage::from_fn(8, 8, |x, y| image::Luma([grey + ((x ^ y) * 16) as u8]));
    picture.save(folder.join("skin.png")).unwrap();
}

fn graph(folder: &Path, nodes: &str) -> Graph {
    let document = Document::parse(&format!("Graph(nodes: {{{nodes}}})")).unwrap();
    let graph = Graph::check(&document, &spandrel::library(), folder);
    graph.unwrap_or_else(|faults| panic!("{faults:?}"))
}

/// A run of a build of the program, with results in a folder.
fn run_of(folder: &Path, build: &str) -> Run {
    let store = Store::open(&folder.join("cache"), 1 << 30).unwrap();
    Run::new().stored(Stored::new(store, Key::of(&build)))
}

#[derive(Default)]
struct Warnings(Mutex<Vec<String>>);

impl Progress for Warnings {
    fn warned(&self, node: &str, message: &str) {
        self.0.lock().unwrap().push(format!("{node}: {message}"));
    }
}

fn evaluate(run: &Run, graph: &Graph, changed: &Override) -> (Evaluated, Vec<String>) {
    let mut wishes = Wishes::new();
    let channels = BTreeSet::from([Channel::Color, Channel::Id]);
    wishes.want::<Image>("graded", PictureDemand { channels, changed: changed.clone() });
    let schedule = Schedule::new(graph, &wishes).unwrap();
    let warnings = Warnings::default();
    let done = run.evaluate(graph, &schedule, &warnings).unwrap();
    (done, warnings.0.into_inner().unwrap())
}

/// The nodes that were made, and those that were taken from the disk.
fn nodes(done: &Evaluated) -> [Vec<&str>; 2] {
    [Outcome::Evaluated, Outcome::Stored].map(|outcome| {
        let of = done.reports.iter().filter(|report| report.outcome == outcome);
        let mut names: Vec<&str> = of.map(|report| report.node.as_str()).collect();
        names.sort_unstable();
        names
    })
}

fn pixels(done: &Evaluated) -> Arc<Image> {
    done.value::<Image>(0)
}

const ALL: [&str; 11] = [
    "all", "ball", "ball.ron", "eye", "graded", "land", "land.ron", "lit", "misty", "picture",
    "sun",
];

/// What is made for each change: with nothing known, with the values of the run before in memory, and by another
/// process with its results on disk.
#[test]
fn what_a_change_makes_anew() {
    let with = |from: &str, to: &str| NODES.replace(from, to);
    let wide = Override { scale: Some((2.0, 1.0)), ..Override::default() };
    let part = Override {
        window: Some(Window { x: 8, y: 8, width: 16, height: 16 }),
        ..Override::default()
    };
    let plain = Override::default;
    // The change, and what is made anew from memory. From disk, whatever is not a picture that is known or a surface
    // that was solved is made too: reading scenes, merging and preparing shaders takes next to nothing.
    let cases: [(&str, String, Override, &[&str]); 8] = [
        ("nothing", NODES.to_owned(), plain(), &[]),
        (
            "camera",
            with("(0, 3, 12)", "(1, 3, 12)"),
            plain(),
            &["all", "ball", "eye", "graded", "land", "lit", "misty", "picture"],
        ),
        (
            "light",
            with("(-1, -2, -1)", "(-1, -2, -2)"),
            plain(),
            &["graded", "lit", "misty", "picture", "sun"],
        ),
        ("fog", with("0.02", "0.03"), plain(), &["graded", "misty", "picture"]),
        (
            "object",
            with("ball.ron", "moved.ron"),
            plain(),
            &["all", "ball", "graded", "lit", "misty", "moved.ron", "picture"],
        ),
        ("grade", with("0.5", "0.7"), plain(), &["graded"]),
        ("scale", NODES.to_owned(), wide, &["graded", "picture"]),
        (
            "window",
            NODES.to_owned(),
            part,
            &["all", "ball", "graded", "land", "lit", "misty", "picture"],
        ),
    ];
    for (what, changed_nodes, changed, warm) in cases {
        let scratch = folder(&format!("cached-{what}"));
        std::fs::write(scratch.path().join("moved.ron"), ball("0.5")).unwrap();
        let before = graph(scratch.path(), NODES);
        let after = graph(scratch.path(), &changed_nodes);
        let run = run_of(scratch.path(), "a");
        let (cold, _) = evaluate(&run, &before, &Override::default());
        assert_eq!(nodes(&cold), [ALL.to_vec(), vec![]], "{what}, cold");
        let plain_run = Run::new();
        evaluate(&plain_run, &before, &Override::default());
        let (from_memory, _) = evaluate(&plain_run, &after, &changed);
        assert_eq!(nodes(&from_memory)[0], warm, "{what}, from memory");
        // Another process, of which the first time nothing but the folder is known.
        let (from_disk, warnings) = evaluate(&run_of(scratch.path(), "a"), &after, &changed);
        assert_eq!(pixels(&from_disk).channel("R"), pixels(&from_memory).channel("R"), "{what}");
        assert_eq!(pixels(&from_disk).channel("id"), pixels(&from_memory).channel("id"), "{what}");
        assert_eq!(warnings, [""; 0], "{what}");
        let [made, stored] = nodes(&from_disk);
        let is_known = matches!(what, "nothing" | "grade");
        assert_eq!(stored, if is_known { vec!["picture"] } else { vec![] }, "{what}: {made:?}");
        if is_known {
            assert_eq!(made, ["graded"], "{what}");
        }
        let (again, _) = evaluate(&run_of(scratch.path(), "a"), &after, &changed);
        assert_eq!(nodes(&again), [vec!["graded"], vec!["picture"]], "{what}, once more");
        assert_eq!(pixels(&again).channel("R"), pixels(&from_memory).channel("R"), "{what}");
        // Another build knows nothing of it.
        let (other, _) = evaluate(&run_of(scratch.path(), "b"), &before, &Override::default());
        assert_eq!(nodes(&other), [ALL.to_vec(), vec![]], "{what}, another build");
    }
}

#[test]
fn files_that_were_read_on_the_way_count_too() {
    let scratch = folder("cached-files");
    let graph = graph(scratch.path(), NODES);
    let of = || evaluate(&run_of(scratch.path(), "a"), &graph, &Override::default()).0;
    let first = of();
    assert_eq!(nodes(&of())[1], ["picture"]);
    // The picture on the ball's skin, which no node names.
    skin(scratch.path(), 90);
    let other = of();
    assert_eq!(nodes(&other)[1], [""; 0]);
    assert_ne!(pixels(&other).channel("R"), pixels(&first).channel("R"));
    assert_eq!(nodes(&of())[1], ["picture"]);
    skin(scratch.path(), 40);
    let back = of();
    assert_eq!(pixels(&back).channel("R"), pixels(&first).channel("R"));
    // The same graph elsewhere, whose skin is another.
    let elsewhere = folder("cached-elsewhere");
    skin(elsewhere.path(), 120);
    let there = self::graph(elsewhere.path(), NODES);
    let run = run_of(scratch.path(), "a");
    let (there, _) = evaluate(&run, &there, &Override::default());
    assert_eq!(nodes(&there)[1], [""; 0]);
    assert_ne!(pixels(&there).channel("R"), pixels(&first).channel("R"));
}

#[test]
fn what_is_damaged_is_made_again_and_told() {
    let scratch = folder("cached-damage");
    let graph = graph(scratch.path(), NODES);
    let (whole, _) = evaluate(&run_of(scratch.path(), "a"), &graph, &Override::default());
    let objects = spandrel_tests::data::files(&scratch.path().join("cache"), &[""]);
    let objects: Vec<_> =
        objects.into_iter().filter(|file| file.to_string_lossy().contains("objects")).collect();
    assert!(objects.len() >= 4, "two images of spans, a picture and its record: {objects:?}");
    for object in &objects {
        let mut bytes = std::fs::read(object).unwrap();
        let last = bytes.len() - 1;
        bytes[last] ^= 1;
        std::fs::write(object, bytes).unwrap();
    }
    let (again, warnings) = evaluate(&run_of(scratch.path(), "a"), &graph, &Override::default());
    assert_eq!(pixels(&again).channel("R"), pixels(&whole).channel("R"));
    assert!(
        !warnings.is_empty() && warnings.iter().all(|w| w.contains("computed again")),
        "{warnings:?}"
    );
    let (third, warnings) = evaluate(&run_of(scratch.path(), "a"), &graph, &Override::default());
    assert_eq!((nodes(&third)[1].clone(), warnings), (vec!["picture"], vec![]));
}

/// What was said while a value was made is said again where it is found: of the picture, and of all that it was made of.
#[test]
fn warnings_are_stored_with_what_they_are_of() {
    let scratch = folder("cached-warnings");
    // A camera that looks away, and a sun below the ground.
    let text = NODES.replace("look_at: (0, 1, 0)", "look_at: (0, 9, 90)");
    let text = text.replace("direction: (-1, -2, -1)", "direction: (-1, 2, -1)");
    let before = graph(scratch.path(), &text);
    let sorted = |(_, mut warnings): (Evaluated, Vec<String>)| {
        warnings.sort_unstable();
        warnings
    };
    let run = run_of(scratch.path(), "a");
    let first = sorted(evaluate(&run, &before, &Override::default()));
    assert!(first.iter().any(|said| said.starts_with("land: the camera sees none")), "{first:?}");
    assert_eq!(first.len(), 2, "{first:?}");
    // In the same process, from another's, and where only a part is found.
    assert_eq!(sorted(evaluate(&run, &before, &Override::default())), first);
    let again = evaluate(&run_of(scratch.path(), "a"), &before, &Override::default());
    assert_eq!(nodes(&again.0)[1], ["picture"]);
    assert_eq!(sorted(again), first);
    // Two nodes and the picture's warnings under the names that they have in another graph.
    let renamed = graph(scratch.path(), &text.replace("\"land\"", "\"soil\""));
    let other = sorted(evaluate(&run_of(scratch.path(), "a"), &renamed, &Override::default()));
    assert_eq!(other.len(), first.len(), "{other:?}");
    assert!(other.iter().all(|said| !said.starts_with("land:")), "{other:?}");
}

#[test]
fn the_command_line_shares_a_folder() {
    let scratch = folder("cached-program");
    let text =
        format!("Graph(nodes: {{{NODES} \"file\": Write(image: \"graded\", path: \"a.png\")}})");
    std::fs::write(scratch.path().join("g.ron"), text).unwrap();
    let render = |more: &[&str]| {
        let arguments = [&["render", "g.ron", "--stats=json", "-q"], more].concat();
        let ran = run(PROGRAM, &arguments, scratch.path());
        assert_eq!(ran.code, Some(0), "{ran:?}");
        let stats: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
        let of = |outcome: &str| {
            let nodes = stats["nodes"].as_array().unwrap();
            nodes.iter().filter(|node| node["outcome"] == outcome).count()
        };
        (of("evaluated"), of("stored"), std::fs::read(scratch.path().join("a.png")).unwrap())
    };
    let (made, stored, first) = render(&["--cache", "c"]);
    assert_eq!((made, stored), (ALL.len() + 1, 0));
    let (made, stored, second) = render(&["--cache", "c"]);
    assert_eq!((made, stored), (2, 1), "the grade and the file are made, the picture is taken");
    assert_eq!(first, second);
    let (made, ..) = render(&["--no-cache"]);
    assert_eq!(made, ALL.len() + 1);
    // A folder that is something else is left alone, and the picture is made.
    std::fs::create_dir(scratch.path().join("home")).unwrap();
    std::fs::write(scratch.path().join("home/thesis.txt"), "precious").unwrap();
    let ran = run(PROGRAM, &["render", "g.ron", "--cache", "home"], scratch.path());
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert!(ran.err.contains("results are not stored"), "{ran:?}");
    assert_eq!(std::fs::read_dir(scratch.path().join("home")).unwrap().count(), 1);
}
