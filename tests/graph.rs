//! Graphs: what is wrong with them, all at once and with its place; what is computed, and what is not.

use spandrel_engine::graph::demand::Wishes;
use spandrel_engine::graph::document::Document;
use spandrel_engine::graph::report::Outcome;
use spandrel_engine::graph::{Diagnostic, Graph, Registry, Run, Schedule};
use spandrel_engine::image::{Channel, Image, Window};
use spandrel_engine::values::{Override, PictureDemand};
use spandrel_tests::program::scratch;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn repository() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn registry() -> Registry {
    spandrel::library()
}

fn faults(text: &str) -> Vec<Diagnostic> {
    match Document::parse(text) {
        Ok(document) => match Graph::check(&document, &registry(), repository()) {
            Ok(_) => Vec::new(),
            Err(faults) => faults,
        },
        Err(faults) => faults,
    }
}

/// Checks that a graph has exactly one fault, that its message and help have some words, and that it
/// blames a text.
fn fault(text: &str, blamed: &str, words: &[&str]) {
    let faults = faults(text);
    assert_eq!(faults.len(), 1, "{text}: {faults:?}");
    let fault = &faults[0];
    let said =
        format!("{} {} {}", fault.message, fault.label, fault.help.clone().unwrap_or_default());
    for word in words {
        assert!(said.contains(word), "{said} without \"{word}\"");
    }
    assert_eq!(&text[fault.span.clone()], blamed, "{said}");
}

fn nodes(body: &str) -> String {
    format!("Graph(nodes: {{{body}}})")
}

#[test]
fn faults_say_where_they_are_and_what_helps() {
    fault(&nodes("\"a\": Camra()"), "Camra", &["no kind of node `Camra`", "did you mean `Camera`"]);
    fault(&nodes("\"a\": DeepMerge(inputs: [])"), "DeepMerge", &["called `DepthMerge` here"]);
    fault(&nodes("\"a\": Camera(fov: 3)"), "fov", &["no field `fov`"]);
    fault(&nodes("\"a\": Camera(rol: 3)"), "rol", &["did you mean `roll`"]);
    fault(&nodes("\"a\": Camera(roll: 3,rol: 3)"), "rol", &["did you mean `roll`"]);
    fault(&nodes("\"a\": Camera(roll: 1, roll: 2)"), "roll", &["twice"]);
    fault(&nodes("\"a\": Camera(roll: \"x\")"), "\"x\"", &[]);
    let trees = "\"a\": Camera(), \"b\": Billboards(camera: \"a\", trees: [(0, (0, 0, 0), 5)])";
    fault(&nodes(trees), "\"b\"", &["cut-out photographs"]);
    fault(&nodes("\"a\": Camera(field_of_view: 200)"), "200", &["out of range"]);
    fault(&nodes("\"a\": Camera(roll: NaN)"), "NaN", &["not finite"]);
    fault(&nodes("\"a\": Camera(back: inf)"), "inf", &["not finite"]);
    fault(&nodes("\"a\": Camera(roll: 1e999)"), "1e999", &["not finite"]);
    fault(&nodes("\"a\": Camera(position: (0, 0, 0))"), "(0, 0, 0)", &["same point"]);
    fault(&nodes("\"a\": ParallelLight(color: \"#12\")"), "\"#12\"", &["a colour such as"]);
    fault(&nodes("\"a\": ParallelLight(illuminance: -1)"), "-1", &["0 or more"]);
    fault(
        &nodes("\"s\": Scanline(scene: \"tests/graph.rs\")"),
        "\"s\"",
        &["needs a Camera", "`camera`"],
    );
    fault(&nodes("\"f\": Fog(image: \"x\")"), "\"x\"", &["no node \"x\"", "SpanImage"]);
    let typo =
        nodes("\"eye\": Camera(), \"s\": Scanline(scene: \"tests/graph.rs\", camera: \"eyes\")");
    fault(&typo, "\"eyes\"", &["did you mean \"eye\""]);
    let wrong = nodes("\"eye\": Camera(), \"f\": Fog(image: \"eye\")");
    fault(&wrong, "\"eye\"", &["needs a SpanImage", "makes a Camera"]);
    let file = nodes("\"s\": Scanline(scene: \"tests/graph.rs\", camera: \"cam.ron\")");
    fault(&file, "\"cam.ron\"", &["cannot be read from"]);
    let near = nodes("\"s\": Scanline(scene: \"tests/graf.rs\", camera: \"s\")");
    assert!(faults(&near)[0].is_input);
    let scene = "\"eye\": Camera(), \"s\": Scanline(scene: \"tests/graph.rs\", camera: \"eye\"), ";
    for (code, blamed) in [
        ("\"a = 1;\\n color = b + a;\"", "b"),
        ("r#\"color = object(\"x\") + ;\"#", ";"),
        ("\"\\\"\"", "\\"),
    ] {
        let text = nodes(&format!(
            "{scene}\"f\": Stream(image: \"s\", code: {code}, numbers: {{\"frame\": 3}})"
        ));
        fault(&text, blamed, &["`code`: line"]);
    }
    let lost = nodes("\"r\": ReadScene(file: \"tests/graf.rs\")");
    fault(&lost, "\"tests/graf.rs\"", &["no file", "did you mean \"graph.rs\""]);
    let picture = |fields| {
        let town = "\"eye\": Camera(), \"s\": Scanline(scene: \"tests/graph.rs\", camera: \"eye\")";
        nodes(&format!("{town}, \"p\": Resolve(image: \"s\", {fields})"))
    };
    let filtered = picture("lines: Adaptive(4, 0.1), filter: Tent");
    fault(&filtered, "Tent", &["filter Box only", "use Sloped"]);
    fault(&picture("lines: Adaptive(4, -1)"), "Adaptive(4, -1)", &["tolerance", "0 to 1"]);
    fault(&picture("lines: Sloped(0)"), "Sloped(0)", &["1 to 1024"]);
    fault("Graph(version: 7, nodes: {})", "Graph", &["version 7"]);
}

#[test]
fn kinds_and_fields_are_the_declarations() {
    fault(&nodes("\"a\": Camera"), "Camera", &["parentheses"]);
    let list =
        nodes("\"m\": DepthMerge(inputs: [\"a\", \"b\"]), \"a\": Fog(image: \"m\", density: 1)");
    let faults = faults(&list);
    assert!(faults.iter().any(|f| f.message.contains("no node \"b\"")), "{faults:?}");
    assert!(faults.iter().any(|f| f.message.contains("circle")), "{faults:?}");
}

#[test]
fn all_errors_of_a_file_are_reported_in_one_run() {
    let text = nodes(
        "\n\"eye\": Camera(rol: 1),\n\"s\": Scanlin(),\n\"f\": Fog(image: \"nobody\"),\n\"w\": Write(image: \"f\", path: \"a.gif\"),\n",
    );
    let found = faults(&text);
    let lines: Vec<usize> = found.iter().map(|fault| fault.position(&text).0).collect();
    assert!(found.len() >= 4, "{found:?}");
    assert!(lines.is_sorted() && lines.contains(&2) && lines.contains(&5), "{lines:?}");
}

#[test]
fn all_errors_of_a_node_are_reported_with_what_its_fields_take() {
    let text = nodes(
        "\"eye\": Camera(),
         \"p\": Resolve(image: \"eye\", size: \"320x180\", lines: Slopd(4), scale: 1.5, filter: 5, pan: (é, 2))",
    );
    let faults = faults(&text);
    let said: Vec<(&str, String)> = faults
        .iter()
        .map(|fault| {
            let words = format!("{} {}", fault.message, fault.help.clone().unwrap_or_default());
            (&text[fault.span.clone()], words)
        })
        .collect();
    let expected = [
        ("\"eye\"", "needs a SpanImage"),
        ("\"320x180\"", "`size` takes (width, height) of whole numbers"),
        ("Slopd", "`Sloped`"),
        ("1.5", "`scale` takes (x, y)"),
        ("5", "the choices are Box, Tent"),
    ];
    for (blamed, words) in expected {
        let is_told = |(span, said): &(&str, String)| *span == blamed && said.contains(words);
        assert!(said.iter().any(is_told), "{blamed}: {words} of {said:?}");
    }
    assert_eq!(said.len(), 6, "{said:?}");
    fault(
        &nodes("\"t\": Write(image: \"graphs/pictures/town.png\", path: \"out.jpg\")"),
        "\"out.jpg\"",
        &["`path`", "write .png"],
    );
}

#[test]
fn circles_name_every_node_in_them() {
    let text = nodes(
        "\"a\": Fog(image: \"b\"), \"b\": Fog(image: \"c\"), \"c\": Fog(image: \"a\"), \"d\": Fog(image: \"d\")",
    );
    let found = faults(&text);
    assert_eq!(found.len(), 2, "{found:?}");
    for id in ["\"a\"", "\"b\"", "\"c\""] {
        assert!(found[0].message.contains(id), "{}", found[0].message);
    }
    assert!(found[1].message.contains("\"d\" uses \"d\""), "{}", found[1].message);
}

// What is computed.

/// A small scene, and a graph over it.
struct Small {
    folder: PathBuf,
    document: Document,
    run: Run,
}

const SMALL: &str = r#"Graph(nodes: {
    "eye": Camera(position: (0, 1, 6)),
    "left": Scanline(scene: "left.ron", camera: "eye"),
    "right": Scanline(scene: "right.ron", camera: "eye"),
    "both": DepthMerge(inputs: ["left", "right"]),
    "sun": ParallelLight(),
    "lit": Illuminate(image: "both", lights: ["sun"]),
    "clear": Fog(image: "lit", density: 0),
    "picture": Resolve(image: "clear", size: (32, 24), lines: Sloped(2)),
    "small": Resolve(image: "clear", size: (32, 24), lines: Sloped(2), scale: (0.5, 0.5)),
    "unused": Fog(image: "left"),
})"#;

impl Small {
    fn new(name: &str) -> Small {
        let folder = scratch(name);
        for (file, x) in [("left.ron", -1.0), ("right.ron", 0.5)] {
            let text = format!(
                "Scene(plans: [(name: \"p\", root: (transform: [Move({x}, 0, 0)], shape: Box(size: (1, 1, 1))))])"
            );
            std::fs::write(folder.join(file), text).unwrap();
        }
        Small { folder, document: Document::parse(SMALL).unwrap(), run: Run::new() }
    }

    /// Evaluates pictures; returns the first, and what was computed, sorted.
    fn evaluate(&self, pictures: &[(&str, Option<Window>)]) -> (Image, Vec<String>) {
        let graph = Graph::check(&self.document, &registry(), &self.folder).ok().unwrap();
        let mut wishes = Wishes::new();
        for (id, window) in pictures {
            let changed = Override { window: *window, ..Override::default() };
            wishes.want::<Image>(
                id,
                PictureDemand { channels: BTreeSet::from([Channel::Color]), changed },
            );
        }
        let plan = Schedule::new(&graph, &wishes).unwrap();
        let evaluated = self.run.evaluate(&graph, &plan, &()).unwrap();
        let computed = evaluated.reports.iter().filter(|r| r.outcome == Outcome::Evaluated);
        let mut computed: Vec<String> = computed.map(|r| r.node.clone()).collect();
        computed.sort();
        (Image::clone(&evaluated.value::<Image>(0)), computed)
    }
}

impl Drop for Small {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

#[test]
fn only_what_is_asked_for_is_computed_and_only_once() {
    let small = Small::new("once");
    let (_, first) = small.evaluate(&[("picture", None), ("small", None)]);
    // Not: "unused", which nobody asks for, and "clear", which passes its input on.
    let all =
        ["both", "eye", "left", "left.ron", "lit", "picture", "right", "right.ron", "small", "sun"];
    assert_eq!(first, all);
    assert_eq!(small.evaluate(&[("picture", None), ("small", None)]).1, Vec::<String>::new());
}

#[test]
fn an_edit_recomputes_what_depends_on_it() {
    let mut small = Small::new("edit");
    small.evaluate(&[("picture", None)]);
    let mut edit = |node: &str, field: &str, value: &str| {
        small.document.set(node, field, value).unwrap();
        small.evaluate(&[("picture", None)]).1
    };
    // A light: no visibility.
    assert_eq!(edit("sun", "illuminance", "0.5"), ["lit", "picture", "sun"]);
    // The scale: nothing but the picture.
    assert_eq!(edit("picture", "scale", "(2, 1)"), ["picture"]);
    // A switched-off light is the same light as one of no strength.
    assert_eq!(edit("sun", "on", "false"), ["lit", "picture", "sun"]);
    assert_eq!(edit("sun", "illuminance", "0.25"), ["sun"]);
    // One cluster's file.
    let path = small.folder.join("right.ron");
    let text = std::fs::read_to_string(&path).unwrap().replace("0.5", "0.75");
    std::fs::write(&path, text).unwrap();
    assert_eq!(
        small.evaluate(&[("picture", None)]).1,
        ["both", "lit", "picture", "right", "right.ron"]
    );
    // A comment in it changes nothing that anybody sees; the file alone is read again.
    small.document.set("both", "inputs", "[\"right\", \"left\"]").unwrap();
    assert_eq!(small.evaluate(&[("picture", None)]).1, ["both", "lit", "picture"]);
}

#[test]
fn equal_nodes_are_computed_once() {
    let mut small = Small::new("equal");
    let twin = SMALL.replace(
        "\"unused\": Fog(image: \"left\")",
        "\"twin\": Scanline(scene: \"left.ron\", camera: \"eye\")",
    );
    let twin = twin.replace("inputs: [\"left\", \"right\"]", "inputs: [\"left\", \"twin\"]");
    small.document = Document::parse(&twin).unwrap();
    let (_, computed) = small.evaluate(&[("picture", None)]);
    let renderers = computed.iter().filter(|id| *id == "left" || *id == "twin").count();
    assert_eq!(renderers, 1, "{computed:?}");
}

#[test]
fn a_window_is_the_part_of_the_whole() {
    let small = Small::new("window");
    let window = Window { x: 5, y: 7, width: 11, height: 9 };
    let (whole, _) = small.evaluate(&[("picture", None)]);
    let other = Small::new("window2");
    let (part, _) = other.evaluate(&[("picture", Some(window))]);
    assert_eq!(part, whole.cropped(window));
    assert_eq!(part.window, window);
}

#[test]
fn failures_name_the_node_and_the_file() {
    let small = Small::new("missing");
    let graph = Graph::check(&small.document, &registry(), &small.folder).ok().unwrap();
    // It goes between the check and the evaluation.
    std::fs::remove_file(small.folder.join("left.ron")).unwrap();
    let mut wishes = Wishes::new();
    let changed = Override::default();
    wishes.want::<Image>(
        "picture",
        PictureDemand { channels: BTreeSet::from([Channel::Color]), changed },
    );
    let plan = Schedule::new(&graph, &wishes).unwrap();
    let failure = small.run.evaluate(&graph, &plan, &()).err().unwrap();
    assert_eq!(failure.node, "left.ron");
    assert!(failure.error.to_string().contains("left.ron"), "{failure}");
}

#[test]
fn a_scenes_environment_is_the_default_of_light_and_fog() {
    let folder = scratch("a_scenes_environment_is_the_default_of_light_and_fog");
    let scene = |environment: &str| {
        format!(
            "Scene(materials: {{\"white\": (color: \"#fff\")}}, plans: [(name: \"p\", {environment} root: \
             (material: \"white\", children: [(shape: Box(size: (8, 0.1, 8))), \
             (transform: [Move(0, 1, 0)], shape: Box(size: (2, 0.1, 2)))]))])"
        )
    };
    std::fs::write(folder.join("bare.ron"), scene("")).unwrap();
    let known = "environment: (ambient: 0.25, fog: 0.125, shadows: true),";
    std::fs::write(folder.join("known.ron"), scene(known)).unwrap();
    let picture = |file: &str, light: &str, fog: &str| {
        let text = format!(
            "Graph(nodes: {{\"eye\": Camera(position: (0, 3, 6)), \"sun\": ParallelLight(), \
             \"spans\": Scanline(scene: \"{file}.ron\", camera: \"eye\"), \
             \"lit\": Illuminate(image: \"spans\", lights: [\"sun\"], {light}), \
             \"misty\": Fog(image: \"lit\", {fog}), \
             \"picture\": Resolve(image: \"misty\", size: (32, 24), lines: Sloped(2))}})"
        );
        let document = Document::parse(&text).unwrap();
        let graph = Graph::check(&document, &registry(), &folder).ok().unwrap();
        let mut wishes = Wishes::new();
        let channels = BTreeSet::from([Channel::Color]);
        wishes.want::<Image>("picture", PictureDemand { channels, changed: Override::default() });
        let plan = Schedule::new(&graph, &wishes).unwrap();
        Image::clone(&Run::new().evaluate(&graph, &plan, &()).unwrap().value::<Image>(0))
    };
    let said = picture("bare", "ambient: 0.25, shadows: Volumes", "density: 0.125");
    assert!(picture("known", "", "") == said);
    // What is said counts for more; without an environment there are defaults.
    let bare = picture("bare", "", "");
    assert!(bare != said);
    assert!(picture("known", "ambient: 0.1, shadows: Volumes", "density: 0.01") == bare);
    std::fs::remove_dir_all(&folder).ok();
}
