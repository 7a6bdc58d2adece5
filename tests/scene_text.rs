//! What is wrong with texts of the project's own, graphs and scenes alike: all at once, with the places, and with what
//! to write instead.

use spandrel_engine::error::Error;
use spandrel_engine::graph::Graph;
use spandrel_engine::graph::document::Document;
use spandrel_engine::scene::read::{self, ReadOptions};
use spandrel_engine::text::Diagnostic;
use spandrel_tests::program::Scratch;
use std::path::Path;

/// The faults of a graph.
fn of_graph(text: &str) -> Vec<Diagnostic> {
    match Document::parse(text) {
        Err(faults) => faults,
        Ok(document) => match Graph::check(&document, &spandrel::library(), Path::new("")) {
            Err(faults) => faults,
            Ok(_) => Vec::new(),
        },
    }
}

/// The faults of a scene, and how they are shown.
fn of_scene(folder: &Path, text: &str) -> (Vec<Diagnostic>, String) {
    let path = folder.join("s.ron");
    std::fs::write(&path, text).unwrap();
    match read::document(&path, &ReadOptions::default()) {
        Ok(_) => (Vec::new(), String::new()),
        Err(Error::Text(faults)) => {
            let shown = faults.to_string();
            (faults.list, shown)
        }
        Err(other) => panic!("{text}: {other}"),
    }
}

/// A scene of one object with fields.
fn object(fields: &str) -> String {
    format!(
        "Scene(\n  materials: {{\"brick\": (color: \"#a0563c\")}},\n  plans: [(name: \"p\", root: (children: [\n    ({fields}),\n  ]))],\n)"
    )
}

fn said(faults: &[Diagnostic]) -> Vec<String> {
    let say = |fault: &Diagnostic| {
        format!("{} | {} | {}", fault.message, fault.label, fault.help.clone().unwrap_or_default())
    };
    faults.iter().map(say).collect()
}

#[test]
fn common_mistakes_say_what_to_write_instead_in_graphs_and_scenes() {
    let scratch = Scratch::new("mistakes");
    let mut wrong: Vec<String> = Vec::new();
    // The mistake, what is blamed, and what is said.
    let graphs = [
        ("Resolve(image: \"i\", lines: Sloped(count: 8))", "count", "write Sloped(8)"),
        (
            "Resolve(image: \"i\", lines: Sampled(lines: 8, filter: Box))",
            "lines",
            "write Sampled(8, Box)",
        ),
        ("Resolve(image: \"i\", lines: Sloped)", "Sloped", "write Sloped(..)"),
        ("Resolve(image: \"i\", lines: 8)", "8", "Sloped"),
        ("Camera(field_of_view: 38,5)", "38,5", "write 38.5"),
        ("Camera(field_of_view: 38,5, position: (1, 2, 3))", "38,5", "write 38.5"),
        ("Camera(position: (-1,5, 2, 3))", "-1,5", "write -1.5"),
        ("Camera(position: [1, 2, 3])", "[", "write (1, 2, 3)"),
        ("Resolve(image: \"i\", size: [100, 80])", "[", "write (100, 80)"),
        ("DepthMerge(inputs: (\"i\", \"i\"))", "(", "write [\"i\", \"i\"]"),
        ("DepthMerge(inputs: \"i\")", "\"i\"", "write [\"i\"]"),
        ("Scanline(scene: \"maps\\city.obj\")", "\\c", "write `/`: \"maps/city.obj\""),
        (
            "Scanline(scene: \"maps\\new.obj\", camera: \"i\")",
            "\"maps\\new.obj\"",
            "write `/`: \"maps/new.obj\"",
        ),
        ("Camera(field_of_view = 38)", "=", "write `field_of_view: ..`"),
        ("Camera(field_of_view: 38 position: (1, 2, 3))", "position", "`,` is missing"),
        ("Camera(field_of_view: 38; position: (1, 2, 3))", ";", "`;` stands where `,`"),
        (
            "Camera(field_of_view: 38, # wide\n position: (1, 2, 3))",
            "#",
            "comments begin with `//`",
        ),
        (
            "Camera(field_of_view: 38, -- wide\n position: (1, 2, 3))",
            "--",
            "comments begin with `//`",
        ),
        ("Scanline(scene: i, camera: \"i\")", "i", "write \"i\""),
        ("Scanline(scene: 2nd, camera: \"i\")", "2nd", "begins with a digit"),
        ("Scanline(scene: 'i', camera: \"i\")", "'i", "straight double quotes"),
        ("Scanline(scene: “é”, camera: \"i\")", "“é", "straight double quotes"),
        ("Camera(field_of_view: 38deg)", "deg", "unit"),
        ("Camera(field_of_view: \"38\")", "\"", "no quotes"),
    ];
    for (node, blamed, cure) in graphs {
        let text = format!("Graph(nodes: {{\n \"é\t日\": 1,\n \"n\": {node},\n}})")
            .replace("\"é\t日\": 1,", "// é\t日\u{200b}");
        let faults = of_graph(&text);
        let found = faults.iter().zip(said(&faults)).find(|(_, said)| said.contains(cure));
        let Some((fault, _)) = found else {
            wrong.push(format!("{node}: {:?}", said(&faults)));
            continue;
        };
        if !text[fault.span.clone()].starts_with(blamed) {
            wrong.push(format!("{node} blames {:?}", &text[fault.span.clone()]));
        }
    }
    let scenes = [
        ("shape: Box(1, 2, 3)", "1", "its fields: size"),
        ("shape: Box", "Box", "size"),
        ("shape: \"Box\"", "\"Box\"", "the choices are"),
        ("shape: Instance(name: \"post\")", "name", "write Instance(\"post\")"),
        ("shape: Group()", ")", "write Group"),
        ("transform: [Move(x: 1, y: 2, z: 3)]", "x", "write Move(1, 2, 3)"),
        ("transform: [Move(1,5, 2, 3)]", "1,5", "write 1.5"),
        ("transform: Move(1, 2, 3)", "Move", "write [Move(1, 2, 3)]"),
        ("shape: Box(size: [1, 2, 3])", "[", "write (1, 2, 3)"),
        ("name = \"x\"", "=", "write `name: ..`"),
        ("name: \"x\" material: \"brick\"", "material", "`,` is missing"),
        ("name: 2nd", "2nd", "write \"2nd\""),
        ("name: \"a\\c\"", "\\c", "write `/`: \"a/c\""),
        ("name: \"a\\t.png\"", "\"a\\t.png\"", "write `/`: \"a/t.png\""),
        ("name: \"x\", # a box\n", "#", "comments begin with `//`"),
        ("material: \"brik\"", "\"brik\"", "did you mean \"brick\""),
        ("shape: Instance(\"post\")", "\"post\"", "there is no definition"),
        ("name: \"a/b\"", "\"a/b\"", "slash"),
        ("shape: Sphere(radius: 1e39)", "1e39", "not finite"),
        ("shape: Sphere(radius: 1e999)", "1e999", "not finite"),
        ("shape: Sphere(radius: NaN)", "NaN", "not finite"),
        ("shape: Sphere(radius: -inf)", "-inf", "not finite"),
        ("shape: Sphere(radius: 1, segments: 2.5)", ".5", "whole number"),
        ("shape: Sphere(radius: 1, segments: -3)", "-3", "out of range"),
    ];
    for (fields, blamed, cure) in scenes {
        let text = object(fields).replacen("\n", "\n// é\t日\u{200b}\n", 1);
        let (faults, shown) = of_scene(scratch.path(), &text);
        let found = faults.iter().zip(said(&faults)).find(|(_, said)| said.contains(cure));
        let Some((fault, _)) = found else {
            wrong.push(format!("{fields}: {:?}", said(&faults)));
            continue;
        };
        if !text[fault.span.clone()].starts_with(blamed) {
            wrong.push(format!("{fields} blames {:?}", &text[fault.span.clone()]));
        }
        let (line, column) = fault.position(&text);
        assert!(
            shown.contains(&format!("s.ron:{line}:{column}")) && shown.contains('^'),
            "{shown}"
        );
    }
}

#[test]
fn brackets_that_do_not_fit_are_told_with_both_ends() {
    let scratch = Scratch::new("brackets");
    let one = |text: &str| {
        let (faults, _) = of_scene(scratch.path(), text);
        assert_eq!(faults.len(), 1, "{:?}", said(&faults));
        (said(&faults).remove(0), faults[0].position(text))
    };
    let (said_of, at) = one("Scene(\n  plans: [(name: \"p\"],\n)");
    assert!(said_of.contains("`]` closes a `(`, which stands in line 2"), "{said_of}");
    assert_eq!(at, (2, 21));
    let (said_of, at) = one("Scene(\n  plans: [(name: \"p\")]\n");
    assert!(said_of.contains("the `(` of line 1 is not closed"), "{said_of}");
    assert_eq!(at, (1, 6));
    let (said_of, _) = one("Scene(\n  plans: [(name: \"p\")], // the end )\n");
    assert!(said_of.contains("the comment in line 2 hides a `)`"), "{said_of}");
    let (said_of, _) = one("Scene(plans: [])\n)");
    assert!(said_of.contains("closes nothing"), "{said_of}");
    let (said_of, _) = one("Scene(plans: [(name: \"p)])");
    assert!(said_of.contains("no closing quote"), "{said_of}");
}

#[test]
fn all_faults_of_a_scene_are_told_at_once() {
    let scratch = Scratch::new("all-faults");
    let text = "Scene(
  materials: {\"brick\": (colour: \"#a0563c\", alpha: \"x\"), \"é\": (color: (1, 2))},
  plans: [(
    name: \"p\",
    rot: 5,
    root: (children: [
      (name: \"a\", shape: Box(size: (1, true, 3))),
      (name: \"b\", shape: Blob(size: (1, 2, 3)), material: \"brik\"),
      (name: \"c\", transform: [Move(1, 2), TurnX(\"a\")]),
    ]),
  )],
)";
    let (faults, shown) = of_scene(scratch.path(), text);
    let places: Vec<&str> = faults.iter().map(|fault| &text[fault.span.clone()]).collect();
    for place in ["colour", "rot", "true", "Blob", "\"brik\""] {
        assert!(places.contains(&place), "{place} of {places:?}\n{shown}");
    }
    assert!(said(&faults).iter().any(|said| said.contains("did you mean `color`")), "{shown}");
    assert!(faults.len() >= 8, "{shown}");
    assert!(faults.is_sorted_by_key(|fault| fault.span.start));
    // What lacks something that is blamed is not blamed too.
    let (faults, shown) = of_scene(scratch.path(), &object("shape: Box(sise: (1, 2, 3))"));
    assert_eq!(faults.len(), 1, "{shown}");
    // A number too few is no comma that should be a point.
    let flat = object("shape: Polygon(outline: [(-2,1), (2,1), (0,3)])");
    let (faults, shown) = of_scene(scratch.path(), &flat);
    assert_eq!(faults.len(), 3, "{shown}");
    assert!(said(&faults).iter().all(|said| said.contains("found 2")), "{shown}");
}

#[test]
fn all_faulty_objects_of_a_scene_are_told_at_once() {
    let scratch = Scratch::new("faulty-objects");
    let path = scratch.path().join("s.ron");
    let text = r#"Scene(materials: {"m": (alpha: 3)}, plans: [(name: "p",
        definitions: {"loop": (name: "in", shape: Instance("loop"))},
        root: (children: [
            (name: "ball", shape: Sphere(radius: -1)),
            (name: "good", shape: Box(size: (1, 1, 1))),
            (name: "row", shape: Array(of: (name: "disc", shape: Cylinder(radius: 1, height: 1, segments: 2)), count: (9, 9, 9), step: (2, 2, 2))),
            (name: "one", material: "m", shape: Box(size: (1, 1, 1))),
            (name: "two", material: "m", shape: Box(size: (1, 1, 1))),
            (name: "round", shape: Instance("loop")),
        ]))])"#;
    std::fs::write(&path, text).unwrap();
    let Err(error) = read::scene(&path, None, "", &ReadOptions::default()) else { panic!() };
    let told = error.to_string();
    let lines: Vec<&str> = told.lines().collect();
    let words = ["\"ball\"", "\"row[0]/disc\"", "\"one\"", "contains itself"];
    assert_eq!(lines.len(), words.len(), "{told}");
    assert!(lines.iter().zip(words).all(|(line, word)| line.contains(word)), "{told}");
}

#[test]
fn faults_of_objects_do_not_hide_each_other() {
    let scratch = Scratch::new("hidden-faults");
    let path = scratch.path().join("s.ron");
    let told = |definitions: &str, children: &str| {
        let text = format!(
            "Scene(plans: [(name: \"p\", definitions: {{{definitions}}}, root: (children: [{children}]))])"
        );
        std::fs::write(&path, text).unwrap();
        let Err(error) = read::scene(&path, None, "", &ReadOptions::default()) else { panic!() };
        error.to_string()
    };
    // Very many faults end in twenty, wherever they are.
    let row = "Array(of: (shape: Box(size: (1, 1, 1))), count: (1000, 1, 1), step: (1e30, 0, 0))";
    let said = told(
        "",
        &format!(
            "(name: \"a\", shape: Array(of: (shape: {row}), count: (1000, 1, 1), step: (0, 1, 0)))"
        ),
    );
    assert_eq!(said.lines().count(), 21, "{said}");
    assert!(said.ends_with("more faults"), "{said}");
    // What went wrong within a definition does not make the next use of it a circle.
    let far = ["Scale(1e30)"; 11].join(", ");
    let said = told(
        &format!("\"d\": (name: \"in\", transform: [{far}], shape: Box(size: (1, 1, 1)))"),
        "(name: \"a\", shape: Instance(\"d\")), (name: \"b\", shape: Instance(\"d\"))",
    );
    assert_eq!(said.lines().filter(|line| line.contains("not finite")).count(), 2, "{said}");
    assert!(!said.contains("contains itself"), "{said}");
    // As many as no number counts are too many.
    let huge = "Array(of: (shape: Box(size: (1, 1, 1))), count: (2147483648, 2147483648, 4), step: (1, 0, 0))";
    let said = told("", &format!("(name: \"a\", shape: {huge})"));
    assert!(said.contains("an array of 18446744073709551616"), "{said}");
    // What ends the search comes last, and what was found before it is told.
    let said = told(
        "",
        "(name: \"ball\", shape: Sphere(radius: -1)), (name: \"f\", shape: File(path: \"gone.obj\"))",
    );
    assert!(said.contains("\"ball\"") && said.contains("gone.obj"), "{said}");
}

#[test]
fn what_is_there_twice_is_told_with_both_places() {
    let scratch = Scratch::new("twice");
    let head = "Scene(plans: [(name: \"p\",\n";
    let texts = [
        ("Scene(materials: {\"m\": (),\n\"m\": ()})".to_owned(), "\"m\""),
        (format!("{head}cameras: {{\"m\": (),\n\"m\": ()}})])"), "\"m\""),
        (format!("{head}lights: {{\"m\": Parallel(),\nr\"m\": Parallel()}})])"), "r\"m\""),
        (format!("{head}definitions: {{\"m\": (),\n\"m\": ()}})])"), "\"m\""),
        (format!("{head}root: (children: [(name: \"m\"),\n(name: \"m\")]))])"), "\"m\""),
        (
            format!("{head}root: (children: [(children: [(name: \"m\"),\n(name: \"m\")])]))])"),
            "\"m\"",
        ),
        ("Scene(plans: [(name: \"m\"),\n(name: \"m\")])".to_owned(), "\"m\""),
    ];
    for (text, second) in texts {
        let (faults, shown) = of_scene(scratch.path(), &text);
        let fault = faults.iter().find(|fault| fault.message.contains("twice"));
        let fault = fault.unwrap_or_else(|| panic!("{text}: {shown}"));
        let line = text.lines().count();
        assert_eq!((&text[fault.span.clone()], fault.position(&text).0), (second, line), "{text}");
        let (first, _) = fault.other.clone().unwrap();
        assert_eq!(
            (&text[first.clone()], first.start < fault.span.start),
            ("\"m\"", true),
            "{text}"
        );
        assert!(shown.contains("the first") && shown.contains("the second"), "{shown}");
    }
    // Names of other parents, and of maps within maps, are their own.
    let apart = format!(
        "{head}cameras: {{\"m\": ()}}, definitions: {{\"m\": (children: [(name: \"m\", children: [(name: \"m\")])])}})])"
    );
    assert!(of_scene(scratch.path(), &apart).0.is_empty());
    let graph = of_graph("Graph(nodes: {\"a\": Camera(),\n \"a\": Camera()})");
    assert!(graph[0].message.contains("twice") && graph[0].other.is_some(), "{graph:?}");
}

#[test]
fn no_text_breaks_its_faults() {
    let scratch = Scratch::new("odd-texts");
    let marks = [
        "é", "日", "🌲", "\t", "\r", "\u{200b}", "\u{feff}", "\\", "\"", "'", "(", "]", "=", ",",
        ":", "r#\"", "//", "/*", "1,5", "#",
    ];
    let scene = object(
        "name: \"a\", material: \"brick\", shape: Box(size: (1, 2, 3)), transform: [Move(1, 2, 3)]",
    );
    let graph = "Graph(nodes: {\"n\": Camera(position: (1, 2, 3), field_of_view: 38)})";
    for (k, mark) in marks.into_iter().enumerate() {
        for at in 0..scene.len() {
            let mut text = scene.clone();
            text.insert_str(at, mark);
            if (at + k).is_multiple_of(7) {
                of_scene(scratch.path(), &text);
            }
            if at < graph.len() && (at + k).is_multiple_of(3) {
                let mut text = graph.to_owned();
                text.insert_str(at, mark);
                for fault in of_graph(&text) {
                    let (line, _) = fault.position(&text);
                    assert!(
                        fault.excerpt("g", &text, false).contains(&format!("g:{line}:")),
                        "{text}"
                    );
                }
            }
        }
    }
}
