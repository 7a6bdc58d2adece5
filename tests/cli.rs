//! The command line: what `render` does and says, its manners, its exit codes.

use spandrel_tests::program::{Ran, run, scratch};
use std::path::{Path, PathBuf};

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

pub(crate) const GRAPH: &str = r#"Graph(nodes: {
    "eye": Camera(position: (2, 2, 5)),
    "boxes": Scanline(scene: "box.ron", camera: "eye"),
    "picture": Resolve(image: "boxes", size: (40, 30), lines: Sloped(2)),
    "wide": Resolve(image: "boxes", size: (40, 30), lines: Sloped(2), scale: (2, 1)),
    "file": Write(image: "picture", path: "out/a.png"),
})"#;

pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    pub(crate) fn new(name: &str) -> Folder {
        let folder = scratch(name);
        let scene = "Scene(plans: [(name: \"p\", root: (shape: Box(size: (1, 1, 1))))])";
        std::fs::write(folder.join("box.ron"), scene).unwrap();
        std::fs::write(folder.join("g.ron"), GRAPH).unwrap();
        Folder(folder)
    }

    pub(crate) fn run(&self, arguments: &[&str]) -> Ran {
        run(PROGRAM, arguments, &self.0)
    }

    pub(crate) fn png(&self, name: &str) -> Option<(u32, u32)> {
        image::image_dimensions(self.0.join(name)).ok()
    }

    pub(crate) fn files(&self, sub: &str) -> usize {
        std::fs::read_dir(self.0.join(sub)).map_or(0, Iterator::count)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn render_writes_what_the_graph_names() {
    let folder = Folder::new("render");
    let ran = folder.run(&["render", "g.ron"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(folder.png("out/a.png"), Some((40, 30)));
    assert!(ran.err.contains("wrote"), "{ran:?}");
    assert_eq!(folder.files("out"), 1, "nothing but the picture is left");
    let quiet = folder.run(&["render", "g.ron", "-q"]);
    assert_eq!((quiet.out.as_str(), quiet.err.as_str()), ("", ""));
}

#[test]
fn what_is_typed_overrides_the_graph() {
    let folder = Folder::new("override");
    let dimensions = |arguments: &[&str], file: &str| {
        let ran = folder.run(&[&["render", "g.ron", "-q"], arguments].concat());
        assert_eq!(ran.code, Some(0), "{arguments:?}: {ran:?}");
        folder.png(file)
    };
    assert_eq!(dimensions(&["-o", "b.png"], "b.png"), Some((40, 30)));
    assert_eq!(dimensions(&["--size", "16x12"], "out/a.png"), Some((16, 12)));
    assert_eq!(dimensions(&["--scale", "0.5"], "out/a.png"), Some((20, 15)));
    assert_eq!(dimensions(&["--scale", "2,1"], "out/a.png"), Some((80, 30)));
    assert_eq!(dimensions(&["--window", "3,4,10,5"], "out/a.3,4,10,5.png"), Some((10, 5)));
    assert_eq!(dimensions(&[], "out/a.png"), Some((40, 30)));
    assert_eq!(dimensions(&["--set", "picture.size=(8, 6)"], "out/a.png"), Some((8, 6)));
    assert_eq!(dimensions(&["-w", "wide", "-o", "w.png"], "w.png"), Some((80, 30)));
    assert_eq!(dimensions(&["-w", "file", "-j", "1"], "out/a.png"), Some((40, 30)));
}

#[test]
fn texts_need_no_quotes_within_the_shells() {
    let folder = Folder::new("quotes");
    let scene = "Scene(plans: [(name: \"p\", root: (shape: Box(size: (2, 2, 2))))])";
    std::fs::write(folder.0.join("two.ron"), scene).unwrap();
    for value in ["two.ron", "\"two.ron\""] {
        let set = format!("boxes.scene={value}");
        let ran = folder.run(&["render", "g.ron", "-n", "--set", &set]);
        assert_eq!(ran.code, Some(0), "{ran:?}");
        assert!(ran.out.contains("two.ron"), "{}", ran.out);
    }
    let ran = folder.run(&["render", "g.ron", "-q", "--set", "picture.size=(9, 7)"]);
    assert_eq!((ran.code, folder.png("out/a.png")), (Some(0), Some((9, 7))), "{ran:?}");
}

#[test]
fn a_window_of_a_merge_is_the_part_of_the_whole_where_an_input_is_moved() {
    let folder = Folder::new("moved");
    let graph =
        GRAPH.replace("boxes\": Scanline", "still\": Scanline").replace("a.png", "a.exr").replace(
            "\"picture\": R",
            "\"up\": Transform(image: \"still\", translate: (5, -7)), \
             \"boxes\": DepthMerge(inputs: [\"still\", \"up\"]), \"picture\": R",
        );
    std::fs::write(folder.0.join("g.ron"), graph).unwrap();
    let render = |window: &[&str]| {
        let named = ["render", "g.ron", "-q", "-w", "file", "-o", "a.exr"];
        let ran = folder.run(&[&named, window].concat());
        assert_eq!(ran.code, Some(0), "{ran:?}");
        spandrel_engine::image::file::read(&folder.0.join("a.exr")).unwrap()
    };
    let whole = render(&[]);
    let part = render(&["--window", "8,5,20,12"]);
    let mut shown = 0;
    for (x, y) in (8..28).flat_map(|x| (5..17).map(move |y| (x, y))) {
        assert_eq!(part.rgba(x - 8, y - 5), whole.rgba(x, y), "{x}, {y}");
        shown += u32::from(part.rgba(x - 8, y - 5)[3] > 0.0);
    }
    assert!(shown > 60, "{shown}");
}

#[test]
fn names_of_nothing_and_pictures_that_are_not_there_are_told() {
    let folder = Folder::new("names");
    let scene = "Scene(materials: {\"wood\": (color: 1, maps: {\"color\": (picture: File(\"no.png\"))}), \
                 \"floor\": (domains: (define: Checker, table: {0: \"wood\", 1: \"wood\"}))}, \
                 plans: [(name: \"p\", root: (name: \"house\", children: [(name: \"wall\", material: \"wood\", \
                 shape: Box(size: (1, 1, 1)))]))])";
    std::fs::write(folder.0.join("box.ron"), scene).unwrap();
    let graph = |code: &str| {
        let nodes = "\"eye\": Camera(position: (2, 2, 5)), \
                     \"scene\": ReadScene(file: \"box.ron\"), \
                     \"boxes\": Scanline(scene: \"scene\", camera: \"eye\"), \
                     \"picture\": Resolve(image: \"new\", size: (40, 30)), \
                     \"file\": Write(image: \"picture\", path: \"a.png\")";
        let text = format!(
            "Graph(nodes: {{{nodes}, \"new\": Stream(image: \"boxes\", code: \"{code}\")}})"
        );
        std::fs::write(folder.0.join("g.ron"), text).unwrap();
        folder.run(&["render", "g.ron"])
    };
    let ran = graph("if (object('wal') || material('glass')) { color = 0; } color");
    assert!(ran.err.contains("object('wal') fits nothing: did you mean 'wall'?"), "{}", ran.err);
    assert!(ran.err.contains("material('glass') fits nothing: there are wood"), "{}", ran.err);
    let missing = "material \"wood\", color: there is no file";
    assert!(ran.code == Some(4) && ran.err.contains(missing), "{ran:?}");
    let ran = graph("if (object('house') && material('w*')) { color = 0; } color");
    assert!(!ran.err.contains("fits nothing"), "{}", ran.err);
    let ran = folder.run(&["info", "box.ron"]);
    assert!(ran.out.contains("domains by Checker: 0 \"wood\", 1 \"wood\""), "{}", ran.out);
    std::fs::write(folder.0.join("box.ron"), scene.replace("File(\"no.png\")", "\"no.png\""))
        .unwrap();
    let ran = folder.run(&["info", "box.ron"]);
    assert!(ran.err.contains("expected one of the choices, by name"), "{}", ran.err);
}

#[test]
fn exit_codes_tell_what_failed() {
    let folder = Folder::new("codes");
    std::fs::write(folder.0.join("bad.ron"), GRAPH.replace("Resolve", "Resolv")).unwrap();
    std::fs::write(folder.0.join("lost.ron"), GRAPH.replace("box.ron", "lost.obj")).unwrap();
    std::fs::write(
        folder.0.join("none.ron"),
        GRAPH.replace("Write(image: \"picture\", path: \"out/a.png\")", "Camera()"),
    )
    .unwrap();
    let twice =
        GRAPH.replace("})", "\"copy\": Write(image: \"picture\", path: \"./out/../out/a.png\")})");
    std::fs::write(folder.0.join("twice.ron"), twice).unwrap();
    std::fs::write(folder.0.join("latin.ron"), [0x47, 0xe9]).unwrap();
    for (arguments, code, word) in [
        (&["render", "g.ron", "--scale", "0"][..], 2, "--scale"),
        (&["render", "g.ron", "--size", "0x9"], 2, "--size"),
        (&["render", "g.ron", "-w", "pictur", "-o", "a.png"], 2, "did you mean picture"),
        (&["render", "g.ron", "-w", "boxes", "-o", "a.png"], 2, "makes a SpanImage"),
        (&["render", "g.ron", "--window", "9000,0,5,5"], 1, "outside of the picture"),
        (&["render", "g.ron", "--size", "65536x65536"], 1, "windows"),
        (&["render", "g.ron", "-o", "/proc/no/a.png"], 1, "cannot be written"),
        (&["check", "lost.ron"], 4, "lost.obj"),
        (&["info", "box.ron", "-o", "a.svg"], 2, "only lamps"),
        (&["check", "twice.ron"], 3, "write the same file"),
        (&["render", "bad.ron"], 3, "Resolve"),
        (&["check", "bad.ron"], 3, "did you mean"),
        (&["check", "g.ron"], 0, ""),
        (&["render", "nowhere.ron"], 4, "nowhere.ron"),
        (&["render", "lost.ron"], 4, "lost.obj"),
        (&["render", "latin.ron"], 3, "UTF-8"),
        (&["render", "none.ron"], 3, "Write"),
        (&["render", "box.ron"], 3, "scene"),
        (&["render", "g.ron", "--size", "10"], 2, "1920x1080"),
        (&["render", "g.ron", "--set", "pictur.size=(1,1)"], 2, "did you mean \"picture\""),
        (&["render", "g.ron", "--set", "picture.sise=(1,1)"], 3, "did you mean `size`"),
        (&["render", "g.ron", "-w", "fill"], 2, "did you mean file"),
        (&["render", "g.ron", "-w", "eye"], 2, "Camera"),
        (&["convert", "box.ron", "./box.ron"], 1, "name another"),
        (&["nodes", "Fgo"], 2, "did you mean Fog"),
        (&["info", "nowhere.obj"], 4, "nowhere.obj"),
        (&["convert", "box.ron", "a.obj"], 1, ".scene"),
        (&["nonsense"], 2, ""),
    ] {
        let ran = folder.run(arguments);
        assert_eq!(ran.code, Some(code), "{arguments:?}: {ran:?}");
        assert!(ran.err.contains(word), "{arguments:?} without \"{word}\": {}", ran.err);
    }
}

#[test]
fn what_is_set_is_blamed_where_it_is_said() {
    let folder = Folder::new("blamed");
    // A fault of a setting stands under it; one of the file keeps its place there, and both are told.
    std::fs::write(folder.0.join("faulty.ron"), GRAPH.replace("box.ron\"", "box.ron\", seals: 3"))
        .unwrap();
    let ran = folder.run(&[
        "check",
        "faulty.ron",
        "--set",
        "picture.scale=1",
        "--set",
        "picture.size=(8, x)",
    ]);
    assert_eq!(ran.code, Some(3), "{ran:?}");
    let line = "2 | picture.size=(8, x)";
    let caret = ran.err.lines().skip_while(|text| *text != line).nth(1).unwrap_or_default();
    assert_eq!(caret.find('^'), line.find('x'), "{}", ran.err);
    assert!(
        ran.err.contains("--> the command line:2:18") && ran.err.contains("--> faulty.ron:"),
        "{}",
        ran.err
    );
}

#[test]
fn what_is_made_from_outside_is_blamed_on_the_command_line() {
    let folder = Folder::new("blamed-o");
    let lines = "file_of_the_command_line.lines=Sloped(x)";
    let ran = folder.run(&["render", "g.ron", "-w", "boxes", "-o", "a.span", "--set", lines]);
    assert_eq!(ran.code, Some(3), "{ran:?}");
    assert!(ran.err.contains("--> the command line:2:"), "{}", ran.err);
}

#[test]
fn errors_show_the_line_underlined() {
    let folder = Folder::new("underline");
    std::fs::write(folder.0.join("bad.ron"), GRAPH.replace("Sloped(2))", "Slopd(2))")).unwrap();
    let ran = folder.run(&["check", "bad.ron"]);
    assert!(ran.err.contains("bad.ron:4:"), "{}", ran.err);
    assert!(ran.err.contains("^^^^^"), "{}", ran.err);
    assert!(ran.err.contains("help: did you mean `Sloped`?"), "{}", ran.err);
    assert!(ran.err.contains("bad.ron has 1 error"), "{}", ran.err);
}

#[test]
fn a_dry_run_writes_nothing() {
    let folder = Folder::new("dry");
    let ran = folder.run(&["render", "g.ron", "-n"]);
    assert_eq!(ran.code, Some(0));
    assert!(ran.out.contains("picture") && !ran.out.contains("wide"), "{}", ran.out);
    assert_eq!(folder.files("out"), 0);
}

#[test]
fn statistics_show_what_ran() {
    let folder = Folder::new("stats");
    let ran = folder.run(&["render", "g.ron", "-q", "--stats=json"]);
    let stats: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    let node =
        |id: &str| stats["nodes"].as_array().unwrap().iter().find(|n| n["node"] == id).cloned();
    assert!(node("boxes").unwrap()["facts"]["spans"].as_u64().unwrap() > 60);
    assert!(node("wide").is_none());
    let ran = folder.run(&["render", "g.ron", "-q", "--explain"]);
    let plan = folder.run(&["render", "g.ron", "-n", "--explain"]);
    assert!(plan.out.contains("boxes (Scanline), wanted for picture"), "{}", plan.out);
    assert!(ran.out.contains("wide (Resolve): not needed"), "{}", ran.out);
    assert!(
        ran.out.contains("boxes (Scanline), evaluated for picture: raster.width=40"),
        "{}",
        ran.out
    );
}

#[test]
fn exr_files_hold_the_channels_that_were_asked_for() {
    let folder = Folder::new("exr");
    let graph = GRAPH.replace(
        "path: \"out/a.png\"",
        "path: \"a.exr\", bits: 32, channels: [Color, Z, N, P, Id]",
    );
    std::fs::write(folder.0.join("e.ron"), graph).unwrap();
    assert_eq!(folder.run(&["render", "e.ron", "-q"]).code, Some(0));
    let exr = exr::prelude::read_all_flat_layers_from_file(folder.0.join("a.exr")).unwrap();
    let layer = &exr.layer_data[0];
    let names: Vec<String> = layer.channel_data.list.iter().map(|c| c.name.to_string()).collect();
    assert_eq!(names, ["A", "B", "G", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "R", "Z", "id"]);
    let at = |name: &str, x: usize, y: usize| {
        let channel = layer.channel_data.list.iter().find(|c| c.name.to_string() == name).unwrap();
        channel.sample_data.value_by_flat_index(y * 40 + x).to_f32()
    };
    // The box in the middle, background in the corner.
    assert_eq!((at("A", 20, 12), at("A", 0, 0)), (1.0, 0.0));
    assert_eq!(at("Z", 0, 0), f32::INFINITY);
    assert_eq!(at("id", 0, 0), 0.0);
    assert!(at("id", 20, 12) > 0.0);
    let normal = ["N.X", "N.Y", "N.Z"].map(|name| at(name, 20, 12));
    assert!((normal.iter().map(|v| v * v).sum::<f32>() - 1.0).abs() < 1e-5);
    // The point that is seen lies on the box, Z metres away along the view axis.
    let p = ["P.X", "P.Y", "P.Z"].map(|name| f64::from(at(name, 20, 12)));
    assert!(
        p[0].abs() <= 0.501 && (-0.001..=1.001).contains(&p[1]) && p[2].abs() <= 0.501,
        "{p:?}"
    );
    let eye = glam::DVec3::new(2.0, 2.0, 5.0);
    let axis = -eye.normalize();
    let distance = (glam::DVec3::from(p) - eye).dot(axis);
    assert!((distance - f64::from(at("Z", 20, 12))).abs() < 1e-4, "{distance}");
}

#[test]
fn a_reader_that_goes_is_no_failure() {
    let folder = Folder::new("pipe");
    let script = format!("{PROGRAM} nodes --json | head -c 10 >/dev/null; echo ${{PIPESTATUS[0]}}");
    let ran = run("bash", &["-c", &script], Path::new(&folder.0));
    assert_eq!(ran.out.trim(), "0", "{ran:?}");
}

#[test]
fn an_interrupted_run_leaves_no_file() {
    let folder = Folder::new("interrupt");
    // Large enough to be caught while it writes.
    let graph = GRAPH.replace("size: (40, 30)", "size: (6000, 6000)");
    std::fs::write(folder.0.join("big.ron"), graph).unwrap();
    let script = format!(
        "{PROGRAM} render big.ron -q & pid=$!; for i in $(seq 1000); do \
         ls out/.a.png.*.tmp >/dev/null 2>&1 && break; sleep 0.01; done; \
         kill -INT $pid; wait $pid; echo $?"
    );
    let ran = run("bash", &["-c", &script], Path::new(&folder.0));
    assert_eq!(ran.out.trim(), "130", "{ran:?}");
    assert_eq!(folder.files("out"), 0, "{ran:?}");
}

#[test]
fn faults_at_letters_of_any_length_are_told() {
    let folder = Folder::new("letters");
    let letters = [
        "\u{e9}",
        "\u{65e5}",
        "\u{1f332}",
        "\u{200b}",
        "a\u{301}",
        "\u{feff}",
        "\\t",
        "\u{a0}",
        "\u{202e}",
    ];
    for letter in letters {
        let bodies = [
            format!(r#""s": Stream(image: "boxes", code: "color = {letter};")"#),
            format!(r#""s": Stream(image: "boxes", code: "{letter}")"#),
            format!(
                r#""s": Stream(image: "boxes", code: "color = 1 {letter}", numbers: {{"{letter}": 1}})"#
            ),
            format!(r#""s": Stream(image: "boxes", {letter}: 1)"#),
            format!(r#""s": Stream(image: "{letter}")"#),
            format!(r#""s{letter}": Strem{letter}(image: "boxes")"#),
            format!(r#""s": Stream(image: "boxes", code: "object('{letter}')" "#),
            format!(r#""s": Write(image: "picture", path: "{letter}.gif"){letter}"#),
        ];
        for body in bodies {
            let text = GRAPH.replace("\"file\"", &format!("{body},\n\"file\""));
            std::fs::write(folder.0.join("l.ron"), text).unwrap();
            let ran = folder.run(&["check", "l.ron"]);
            assert!(ran.code.is_some_and(|code| code != 101), "{body}: {ran:?}");
            assert!(ran.code == Some(0) || !ran.err.is_empty(), "{body}: {ran:?}");
        }
        for argument in [
            format!("p{letter}.size=3"),
            format!("picture.size=({letter})"),
            format!("picture.{letter}=1"),
        ] {
            let ran = folder.run(&["render", "g.ron", "--set", &argument]);
            assert!(ran.code.is_some_and(|code| code != 0 && code != 101), "{argument}: {ran:?}");
        }
    }
}
