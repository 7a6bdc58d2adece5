//! Bands of a picture, made apart and joined: by one run, or by several that share a cache.

use spandrel_engine::image::{Image, Samples, Window, file};
use spandrel_tests::program::{Ran, Scratch, run};
use std::path::Path;

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

fn program(folder: &Path, arguments: &[&str]) -> Ran {
    run(PROGRAM, arguments, folder)
}

const SCENE: &str = r##"Scene(
    materials: {"red": (color: "#a03020"), "pane": (color: "#80a0c0", alpha: 0.5, alpha_mode: Blend)},
    plans: [(name: "p", root: (children: [
        (name: "ground", shape: Polygon(outline: [(-9, 0, 9), (9, 0, 9), (9, 0, -30), (-9, 0, -30)])),
        (name: "box", material: "red", transform: [TurnY(30)], shape: Box(size: (2, 3, 2))),
        (name: "pane", material: "pane", transform: [TurnY(-20), Move(1, 0, 2)], shape: Box(size: (1, 2, 0.1))),
    ]))],
)"##;

/// A picture of everything that a file can hold, one that was blurred, one that is read and written again, and spans.
const GRAPH: &str = r#"Graph(nodes: {
    "eye": Camera(position: (2, 3, 9), look_at: (0, 1, 0), field_of_view: 40),
    "seen": Scanline(scene: "scene.ron", camera: "eye"),
    "sun": ParallelLight(direction: (1, -1, -0.4)),
    "lit": Illuminate(image: "seen", lights: ["sun"], white: 2),
    "picture": Resolve(image: "lit", size: (40, 31), lines: Sloped(2), scale: (1.3, 1)),
    "all": Write(image: "picture", path: "out/all.exr", channels: [Color, Z, N, P, Id, Light]),
    "soft": Blur(image: "picture", radius: 0.05),
    "blurred": Write(image: "soft", path: "out/soft.png"),
    "plate": Read(file: "plate.png"),
    "copied": Write(image: "plate", path: "out/plate.png"),
    "holed": Read(file: "holed.exr"),
    "kept": Write(image: "holed", path: "out/holed.exr"),
    "over": Over(front: "holed", back: "small"),
    "small": Read(file: "small.exr"),
    "both": Write(image: "over", path: "out/both.exr"),
    "spans": WriteSpans(image: "seen", size: (40, 31), path: "out/seen.span"),
})"#;

const FILES: [&str; 6] = ["all.exr", "soft.png", "plate.png", "holed.exr", "both.exr", "seen.span"];

fn scratch(name: &str) -> Scratch {
    let scratch = Scratch::new(name);
    let write = |file: &str, text: &str| std::fs::write(scratch.path().join(file), text).unwrap();
    write("scene.ron", SCENE);
    write("g.ron", GRAPH);
    let pixel = |x: u32, y: u32| image::Rgb([x as u8 * 9, y as u8 * 8, 77]);
    image::RgbImage::from_fn(20, 23, pixel).save(scratch.path().join("plate.png")).unwrap();
    // Two that hold a part of their picture only, in other places.
    let held = [
        ("holed", Window { x: 3, y: 7, width: 9, height: 4 }),
        ("small", Window { x: 8, y: 15, width: 6, height: 5 }),
    ];
    for (name, window) in held {
        let mut picture = Image::new((30, 26), window);
        for (channel, value) in [("R", 0.25), ("G", 0.5), ("B", 0.125), ("A", 0.5)] {
            let values = (0..window.area()).map(|at| value * (1.0 + at as f32 / 64.0)).collect();
            picture.insert(channel, Samples::Float(values)).unwrap();
        }
        file::write(&picture, &scratch.path().join(format!("{name}.exr")), Some(32)).unwrap();
    }
    scratch
}

/// Takes away the files that were written.
fn taken(scratch: &Scratch) -> Vec<Vec<u8>> {
    let out = scratch.path().join("out");
    let bytes = FILES.map(|file| std::fs::read(out.join(file)).unwrap());
    std::fs::remove_dir_all(out).unwrap();
    bytes.into()
}

#[test]
fn bands_that_are_joined_are_the_picture() {
    let scratch = scratch("bands-joined");
    let rendered = |more: &[&str]| {
        let ran = program(scratch.path(), &[&["render", "g.ron"], more].concat());
        assert_eq!(ran.code, Some(0), "{ran:?}");
        taken(&scratch)
    };
    let whole = rendered(&[]);
    for bands in ["1", "2", "7", "23"] {
        assert_eq!(rendered(&["--bands", bands]), whole, "{bands} bands");
    }
    let part = ["--window", "3,2,9,11", "-w", "all", "-o", "out/all.exr"];
    let part = |bands: &[&str]| {
        let ran = program(scratch.path(), &[&["render", "g.ron"], &part[..], bands].concat());
        assert_eq!(ran.code, Some(0), "{ran:?}");
        std::fs::read(scratch.path().join("out/all.exr")).unwrap()
    };
    assert_eq!(part(&["--bands", "3"]), part(&[]));
    let ran = program(scratch.path(), &["render", "g.ron", "--bands", "32"]);
    assert_ne!(ran.code, Some(0));
    assert!(ran.err.contains("has no 32 bands: take fewer"), "{ran:?}");
}

#[test]
fn bands_that_others_made_are_taken_from_the_cache() {
    let scratch = scratch("bands-cache");
    let run =
        |arguments: &[&str]| program(scratch.path(), &[&["render", "g.ron"], arguments].concat());
    assert_eq!(run(&[]).code, Some(0));
    let whole = taken(&scratch);
    let ran = run(&["--band", "2/3"]);
    assert_eq!(ran.code, Some(2), "{ran:?}");
    assert!(ran.err.contains("--cache"), "{ran:?}");
    for band in ["1/3", "2/3", "3/3"] {
        let ran = run(&["--band", band, "--cache", "cache"]);
        assert_eq!(ran.code, Some(0), "{ran:?}");
        assert!(ran.err.contains(&format!("stored band {}", band.replace('/', " of "))), "{ran:?}");
        assert!(!scratch.path().join("out").exists(), "{ran:?}");
    }
    let ran = run(&["--bands", "3", "--cache", "cache", "--stats=json", "-w", "all"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let stats: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    let nodes = stats["nodes"].as_array().unwrap();
    let outcomes: Vec<&str> = { nodes.iter() }
        .filter(|node| node["node"] == "picture")
        .map(|node| node["outcome"].as_str().unwrap())
        .collect();
    assert_eq!(outcomes, ["stored"; 3], "{nodes:?}");
    // What lacks is made.
    assert_eq!(run(&["--bands", "3", "--cache", "cache"]).code, Some(0));
    assert_eq!(taken(&scratch), whole);
    for wrong in ["0/3", "4/3", "3", "1/0", "1/9999"] {
        let ran = run(&["--band", wrong, "--cache", "cache"]);
        assert_eq!(ran.code, Some(2), "{ran:?}");
    }
}

#[test]
fn a_job_of_bands_has_a_step_that_joins_them() {
    let scratch = scratch("bands-job");
    let arguments = ["submit", "g.ron", "-F", "1-2", "--chunk", "1", "--bands", "4"];
    let ran = program(scratch.path(), &arguments);
    assert_eq!(ran.code, Some(2), "without a cache: {ran:?}");
    let ran = program(scratch.path(), &[&arguments[..], &["--cache", "/shared"]].concat());
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let job: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    let steps = job["steps"].as_array().unwrap();
    let asked = |step: usize| {
        let arguments = steps[step]["script"]["actions"]["onRun"]["args"].as_array().unwrap();
        arguments.iter().map(|a| a.as_str().unwrap()).collect::<Vec<_>>().join(" ")
    };
    assert!(asked(0).ends_with("--cache {{Param.Cache}} --band {{Task.Param.Band}}/4"), "{job}");
    assert!(asked(1).ends_with("--cache {{Param.Cache}} --bands 4"), "{job}");
    assert_eq!(steps[0]["parameterSpace"]["taskParameterDefinitions"][1]["range"], "1-4");
    assert_eq!(steps[1]["dependencies"][0]["dependsOn"], "Bands");
}
