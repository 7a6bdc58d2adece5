//! Fast looks: drafts of pictures, and what is seen in a pixel.

use serde_json::Value;
use spandrel_tests::program::{Ran, Scratch, run};
use std::path::Path;

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

/// A wall of 2 by 2 metres, 20 by 20 pixels in the middle of 80 by 40, moved right by a quarter of a pixel; a mark on it
/// with an edge; and a pane of glass before its left half.
const SCENE: &str = r##"Scene(
    materials: {"wall": (color: 0.5), "mark": (color: "#a03020"), "glass": (alpha: 0.5, alpha_mode: Blend)},
    plans: [(name: "yard", root: (children: [
        (name: "house", children: [(name: "wall", material: "wall", transform: [Move(0.025, 0, 0)], shape: Faces(
            materials: ["wall", "mark"],
            points: [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)],
            faces: [(outline: [0, 1, 2, 3], sides: (front: 0), seals: [
                (outline: [4, 5, 6, 7], sides: (front: 1), edge: (width: 2, color: "#000")),
            ])],
        ))]),
        (name: "pane", material: "glass", shape: Polygon(outline: [(-2, -2, 1), (0, -2, 1), (0, 2, 1), (-2, 2, 1)])),
    ]))],
)"##;

const GRAPH: &str = r#"Graph(nodes: {
    "eye": Camera(position: (EYE, 0, 9), look_at: (EYE, 0, 0), parallel_height: 4),
    "seen": Scanline(scene: "yard.ron", camera: "eye"),
    "picture": Resolve(image: "seen", size: (80, 40), lines: Sloped(4)),
    "file": Write(image: "picture", path: "a.png"),
})"#;

fn picked(folder: &Path, arguments: &[&str]) -> Ran {
    let all: Vec<&str> = ["pick", "graph.ron"].iter().chain(arguments).copied().collect();
    run(PROGRAM, &all, folder)
}

fn faces(folder: &Path, pixel: &str) -> Vec<Value> {
    let ran = picked(folder, &["--json", "--pixel", pixel]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let told: Value = serde_json::from_str(&ran.out).unwrap();
    told["faces"].as_array().unwrap().clone()
}

/// A draft takes the fast end of every dial that the user does not set, tells it, and leaves the finished picture alone.
#[test]
fn a_draft_takes_the_fast_end_of_every_dial() {
    let scratch = Scratch::new("draft");
    let folder = scratch.path();
    std::fs::write(folder.join("yard.ron"), SCENE).unwrap();
    let graph = GRAPH.replace("EYE", "0").replace(
        "\"picture\": Resolve(image: \"seen\"",
        "\"sun\": ParallelLight(), \"lit\": Illuminate(image: \"seen\", lights: [\"sun\"], samples: 1, white: 1),
         \"picture\": Resolve(image: \"lit\"",
    );
    std::fs::write(folder.join("graph.ron"), graph).unwrap();
    let render = |arguments: &[&str]| {
        let all: Vec<&str> = ["render", "graph.ron"].iter().chain(arguments).copied().collect();
        let ran = run(PROGRAM, &all, folder);
        assert_eq!(ran.code, Some(0), "{ran:?}");
        ran.out + &ran.err
    };
    render(&[]);
    let whole = std::fs::read(folder.join("a.png")).unwrap();
    let told = render(&["--draft"]);
    let draft = "draft: lit.shadows=Off, picture.lines=Sampled(1, Box), picture.textures=Nearest, picture.samples=1, \
                 --scale 0.5";
    assert!(told.contains(draft), "{told}");
    assert_eq!(std::fs::read(folder.join("a.png")).unwrap(), whole);
    let size = |name: &str| image::image_dimensions(folder.join(name)).unwrap();
    assert_eq!((size("a.png"), size("a.draft.png")), ((80, 40), (40, 20)));
    // What a draft takes is what its user could have set.
    let set = ["lit.shadows=Off", "picture.lines=Sampled(1, Box)", "picture.textures=Nearest"];
    let set: Vec<&str> = set.iter().flat_map(|set| ["--set", set]).collect();
    render(&[&set[..], &["--scale", "0.5", "-o", "b.png"]].concat());
    let read = |name: &str| std::fs::read(folder.join(name)).unwrap();
    assert_eq!(read("a.draft.png"), read("b.png"));
    let told = render(&["--draft", "--set", "picture.lines=Sloped(2)", "--size", "40x20"]);
    assert!(
        told.contains("draft: lit.shadows=Off, picture.textures=Nearest, picture.samples=1\n"),
        "{told}"
    );
    assert!(!told.contains("--scale"), "{told}");
    assert_eq!(size("a.draft.png"), (40, 20));
    // What the user sets through a parameter is the user's too.
    let graph = std::fs::read_to_string(folder.join("graph.ron")).unwrap();
    let graph =
        graph.replace("Graph(", "Graph(parameters: {\"quality\": Value(default: Sloped(4))}, ");
    let graph = graph.replace("lines: Sloped(4)", "lines: Ref(\"quality\")");
    std::fs::write(folder.join("graph.ron"), graph).unwrap();
    assert!(render(&["--draft"]).contains("picture.lines=Sampled(1, Box)"));
    let told = render(&["--draft", "--set", "quality=Sloped(2)"]);
    assert!(!told.contains("picture.lines") && told.contains("lit.shadows=Off"), "{told}");
}

/// What the author of a graph chooses for drafts goes before the fast end of fields, and the user before both. A field
/// is as fast as it can be beyond the fast end too, on whichever side that is.
#[test]
fn a_parameter_says_its_draft() {
    let scratch = Scratch::new("draft_parameter");
    let folder = scratch.path();
    std::fs::write(folder.join("yard.ron"), SCENE).unwrap();
    let graph =
        GRAPH.replace("EYE", "0").replace("lines: Sloped(4)", "lines: Ref(\"lines\")").replace(
            "Graph(",
            "Graph(parameters: {
            \"who\": Choice(default: \"cast\", of: [\"cast\", \"seen\"], draft: \"seen\"),
            \"lines\": Value(default: Sloped(4), draft: Sampled(2, Box)),
            \"apart\": Number(default: 1, range: (0, 5), draft: 1.0),
        },",
        );
    let graph = graph.replace("image: \"seen\"", "image: Ref(\"who\")").replace(
        "\"picture\":",
        "\"cast\": RayTracing(scene: \"yard.ron\", camera: \"eye\", rays: 2), \"picture\":",
    );
    let write = |text: &str| std::fs::write(folder.join("graph.ron"), text).unwrap();
    let render = |arguments: &[&str]| {
        let all: Vec<&str> = ["render", "graph.ron"].iter().chain(arguments).copied().collect();
        let ran = run(PROGRAM, &all, folder);
        (ran.code, ran.out + &ran.err)
    };
    write(&graph);
    let (code, told) = render(&["--draft"]);
    let draft = "draft: who=\"seen\", lines=Sampled(2, Box), cast.rays=1, picture.textures=Nearest, picture.samples=1, \
                 --scale 0.5";
    assert!(code == Some(0) && told.contains(draft), "{told}");
    let (code, told) =
        render(&["--draft", "--set", "who=cast", "--set", "picture.lines=Sloped(2)"]);
    assert!(code == Some(0), "{told}");
    assert!(!told.contains("who=") && told.contains("lines=Sampled(2, Box)"), "{told}");
    // Both are checked as defaults are.
    for (was, is, says) in [
        ("draft: \"seen\"", "draft: \"sen\"", "\"who\" is one of \"cast\", \"seen\""),
        ("draft: 1.0", "draft: 9", "\"apart\" is 9: it goes from 0 to 5"),
    ] {
        write(&graph.replace(was, is));
        let (code, told) = render(&[]);
        assert!(code != Some(0) && told.contains(says), "{told}");
        let at =
            format!("graph.ron:{}", graph.lines().position(|line| line.contains(was)).unwrap() + 1);
        assert!(told.contains(&at), "{told}");
    }
    // More than the fast end is as fast.
    let volume =
        "NRRD0004\ntype: float\ndimension: 3\nsizes: 2 2 2\nencoding: text\n\n0 0 0 0 1 1 1 1\n";
    std::fs::write(folder.join("v.nrrd"), volume).unwrap();
    for (step, told_of) in [("1", true), ("8", false)] {
        write(&format!(
            r#"Graph(nodes: {{
                "eye": Camera(),
                "half": Isosurface(volume: "v.nrrd", levels: [(value: 0.5)], step: {step}),
                "seen": Scanline(scene: "half", camera: "eye"),
                "picture": Resolve(image: "seen", size: (8, 8)),
            }})"#
        ));
        let (_, told) = render(&["--draft", "-w", "picture", "-o", "a.png"]);
        assert_eq!(told.contains("half.step=4"), told_of, "{told}");
        assert!(told.contains("draft: "), "{told}");
    }
}

#[test]
fn a_pixel_tells_what_is_seen_in_it() {
    let scratch = Scratch::new("picked");
    let folder = scratch.path();
    std::fs::write(folder.join("yard.ron"), SCENE).unwrap();
    std::fs::write(folder.join("graph.ron"), GRAPH.replace("EYE", "0")).unwrap();
    // The wall beside the mark.
    let found = faces(folder, "47,20");
    assert_eq!(found.len(), 1, "{found:?}");
    let wall = &found[0];
    assert_eq!(wall["object"], "yard.ron/house/wall");
    assert_eq!(
        (&wall["material"], &wall["face"], &wall["front"]),
        (&"wall".into(), &0.into(), &true.into())
    );
    assert!((wall["share"].as_f64().unwrap() - 1.0).abs() < 1e-6);
    assert!((wall["distance"].as_f64().unwrap() - 9.0).abs() < 1e-9);
    let x = wall["point"][0].as_f64().unwrap();
    assert!((x - 0.75).abs() < 0.06, "{x}");
    assert!(wall["file"].as_str().unwrap().ends_with("yard.ron") && wall["seal"].is_null());
    // Its right border: a quarter of pixel 50.
    let found = faces(folder, "50,20");
    assert!((found[0]["share"].as_f64().unwrap() - 0.25).abs() < 1e-4, "{found:?}");
    // The mark, its edge, and both behind the pane, which comes first.
    let found = faces(folder, "42,20");
    assert_eq!((&found[0]["seal"], &found[0]["edge"]), (&0.into(), &false.into()));
    assert_eq!(found[0]["material"], "mark");
    let found = faces(folder, "45,20");
    assert!(found.iter().any(|face| face["edge"] == true && face["seal"] == 0), "{found:?}");
    let found = faces(folder, "37,20");
    let order: Vec<(&str, u64)> = found
        .iter()
        .map(|face| (face["material"].as_str().unwrap(), face["behind"].as_u64().unwrap()))
        .collect();
    assert_eq!(order, [("glass", 0), ("mark", 1)]);
    assert!((found[0]["distance"].as_f64().unwrap() - 8.0).abs() < 1e-9);
    assert!(faces(folder, "79,0").is_empty());
    let ran = picked(folder, &["--pixel", "47,20"]);
    assert_eq!(
        ran.out,
        "seen, pixel 47,20 of 80x40:\n  100.0 %  yard.ron/house/wall, face 0, material \"wall\", \
         9.000 m away at (0.750, 0.050, 0.000)\n"
            .replace("0.050", "-0.050")
    );
    let ran = picked(folder, &["--pixel", "79,0"]);
    assert!(ran.out.contains("nothing is seen there"), "{ran:?}");
    for (pixel, message) in [("80,0", "80 columns and 40 rows"), ("1", "such as 400,300")] {
        let ran = picked(folder, &["--pixel", pixel]);
        assert!(ran.code != Some(0) && ran.err.contains(message), "{ran:?}");
    }
    // What stands behind everything has no distance.
    let sky = "\"sky\": Background(camera: \"eye\", color: \"#446688\"), \"all\": DepthMerge(inputs: [\"seen\", \"sky\"]),
         \"picture\": Resolve(image: \"all\"";
    let graph = GRAPH.replace("EYE", "0").replace("\"picture\": Resolve(image: \"seen\"", sky);
    std::fs::write(folder.join("graph.ron"), graph).unwrap();
    let found = faces(folder, "79,0");
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0]["distance"].is_null() && found[0]["point"].is_null(), "{found:?}");
    let ran = picked(folder, &["--pixel", "79,0"]);
    assert!(ran.out.ends_with("background, behind everything\n"), "{ran:?}");
    let ran = picked(folder, &["--pixel", "1,1", "-w", "sen"]);
    assert!(ran.err.contains("seen"), "{ran:?}");
}
