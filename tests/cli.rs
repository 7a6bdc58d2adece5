//! The command line: its answers, its manners, its exit codes.

use spandrel_tests::program::{Ran, run, scratch};
use std::path::{Path, PathBuf};

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

const GRAPH: &str = r#"Graph(nodes: {
    "eye": Camera(position: (2, 2, 5)),
    "boxes": Scanline(scene: "box.ron", camera: "eye"),
    "picture": Resolve(image: "boxes", size: (40, 30), lines: Sloped(2)),
    "wide": Resolve(image: "boxes", size: (40, 30), lines: Sloped(2), scale: (2, 1)),
    "file": Write(image: "picture", path: "out/a.png"),
})"#;

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let folder = scratch(name);
        let scene = "Scene(plans: [(name: \"p\", root: (shape: Box(size: (1, 1, 1))))])";
        std::fs::write(folder.join("box.ron"), scene).unwrap();
        std::fs::write(folder.join("g.ron"), GRAPH).unwrap();
        Folder(folder)
    }

    fn run(&self, arguments: &[&str]) -> Ran {
        run(PROGRAM, arguments, &self.0)
    }

    fn png(&self, name: &str) -> Option<(u32, u32)> {
        image::image_dimensions(self.0.join(name)).ok()
    }

    fn files(&self, sub: &str) -> usize {
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
fn scenes_convert_and_are_described() {
    let folder = Folder::new("convert");
    assert_eq!(folder.run(&["convert", "box.ron", "box.scene"]).code, Some(0));
    assert_eq!(folder.run(&["convert", "box.scene", "again.ron"]).code, Some(0));
    for file in ["box.ron", "box.scene", "again.ron"] {
        let ran = folder.run(&["info", file]);
        assert!(ran.out.contains("1 object, 6 faces"), "{file}: {ran:?}");
    }
    let ran = folder.run(&["info", "g.ron"]);
    assert!(ran.out.contains("a graph"), "{ran:?}");
}

#[test]
fn the_catalogue_says_what_fields_take_and_holds_their_schema() {
    let folder = Folder::new("catalogue");
    let said = folder.run(&["nodes", "Resolve"]).out;
    for line in [
        "  size: (width, height) of whole numbers = (1280,720)",
        "  scale: (x, y) = (1.0,1.0)",
        "  window: (left, top, width, height) of whole numbers, optional",
    ] {
        assert!(said.contains(line), "{line}: {said}");
    }
    let said = folder.run(&["nodes", "Stream"]).out;
    assert!(said.contains("  code: program of the stream editor"), "{said}");
    let json = folder.run(&["nodes", "--json"]).out;
    let all: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(all["version"], env!("CARGO_PKG_VERSION"));
    let kinds = all["kinds"].as_array().unwrap();
    let resolve = kinds.iter().find(|kind| kind["kind"] == "Resolve").unwrap();
    let fields = &resolve["schema"]["properties"];
    assert_eq!(fields["image"]["x-link"], "SpanImage");
    assert_eq!(fields["size"]["x-parts"], serde_json::json!(["width", "height"]));
    assert_eq!(resolve["defaults"]["lines"], "Sloped(8)");
    // An editor knows every field from the schema: there is no other.
    for kind in kinds {
        let fields = kind["schema"]["properties"].as_object().map_or(0, |all| all.len());
        assert_eq!(kind["defaults"].as_object().unwrap().len(), fields, "{}", kind["kind"]);
    }
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
fn measure_puts_error_against_time() {
    let folder = Folder::new("measure");
    let vary = "picture.lines=Sampled(1, Box),Sloped(4)";
    let measure = |vary: &str, reference: &str| {
        let mut arguments = vec!["measure", "g.ron", "--vary", vary, "--reference", reference];
        arguments.extend(["--runs", "1", "-o", "m.csv", "-o", "m.svg", "-o", "m.html"]);
        folder.run(&arguments)
    };
    let ran = measure(vary, "picture.lines=Sloped(64)");
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let csv = std::fs::read_to_string(folder.0.join("m.csv")).unwrap();
    let column = |line: &str, i: usize| -> f64 {
        // The value is quoted, and has a comma in it.
        line.rsplit('"').next().unwrap().split(',').nth(i).unwrap().parse().unwrap()
    };
    let rows: Vec<&str> = csv.lines().skip(1).collect();
    assert_eq!(rows.len(), 2, "{csv}");
    assert!(column(rows[0], 1) > column(rows[1], 1), "{csv}");
    assert!(column(rows[1], 3) >= column(rows[1], 2) && column(rows[1], 5) > 0.0, "{csv}");
    assert!(ran.out.contains("Sloped(4)") && ran.out.contains("best"), "{}", ran.out);
    let page = std::fs::read_to_string(folder.0.join("m.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("</table>"));
    assert!(folder.0.join("m.svg").exists());

    let same = measure("picture.lines=Sloped(2)", "picture.lines=Sloped(2)");
    assert!(same.out.contains("0.000000"), "{}", same.out);
    let wrong = measure("picture.lines=Slopped(2)", "picture.lines=Sloped(2)");
    assert_eq!(wrong.code, Some(3), "{wrong:?}");
    assert!(wrong.err.contains("did you mean `Sloped`"), "{}", wrong.err);
    let ran = folder.run(&["measure", "g.ron", "--vary", vary, "--reference", vary, "-o", "m.pdf"]);
    assert_eq!(ran.code, Some(2), "{ran:?}");
}

#[test]
fn pictures_are_compared_channel_by_channel() {
    let folder = Folder::new("diff");
    let render = |lines: &str, file: &str, more: &[&str]| {
        let set = format!("picture.lines={lines}");
        let mut arguments =
            vec!["render", "g.ron", "-q", "-w", "picture", "-o", file, "--set", &set];
        arguments.extend(more);
        assert_eq!(folder.run(&arguments).code, Some(0));
    };
    render("Sloped(4)", "a.exr", &[]);
    render("Sloped(4)", "b.exr", &["-j", "1"]);
    render("Sampled(1, Box)", "c.exr", &[]);
    // A PNG has 8 bits; dithered, it is off by up to a whole step, else by half of one.
    render("Sloped(4)", "d.png", &["--set", "file_of_the_command_line.dither=false"]);
    render("Sloped(4)", "f.png", &[]);
    render("Sloped(4)", "e.exr", &["--scale", "2"]);
    let code = |arguments: &[&str]| folder.run(&[&["diff"], arguments].concat()).code;
    assert_eq!(code(&["a.exr", "b.exr"]), Some(0));
    assert_eq!(code(&["a.exr", "c.exr"]), Some(1));
    assert_eq!(code(&["a.exr", "c.exr", "--tolerance", "1"]), Some(0));
    assert_eq!(code(&["a.exr", "d.png"]), Some(1));
    assert_eq!(code(&["a.exr", "d.png", "--tolerance", "0.005"]), Some(0));
    assert_eq!(code(&["a.exr", "f.png", "--tolerance", "0.01"]), Some(0));
    assert_eq!(code(&["a.exr", "e.exr"]), Some(1));
    assert_eq!(code(&["a.exr", "g.ron"]), Some(4));
}

#[test]
fn spans_are_written_merged_compared_and_read() {
    let folder = Folder::new("spans");
    let scene = "Scene(plans: [(name: \"p\", root: (shape: Sphere(radius: 0.8)))])";
    std::fs::write(folder.0.join("ball.ron"), scene).unwrap();
    let graph = r#"Graph(nodes: {
        "eye": Camera(position: (2, 2, 5)),
        "boxes": Scanline(scene: "box.ron", camera: "eye"),
        "balls": Scanline(scene: "ball.ron", camera: "eye"),
        "both": DepthMerge(inputs: ["boxes", "balls"]),
        "sun": ParallelLight(direction: (-1, -2, -1)),
        "lit": Illuminate(image: "both", lights: ["sun"]),
        "picture": Resolve(image: "lit", size: (40, 30), lines: Sloped(2)),
        "file": Write(image: "picture", path: "a.exr", bits: 32),
        "spans": WriteSpans(image: "boxes", path: "boxes.span", size: (40, 30), lines: Sloped(2)),
    })"#;
    std::fs::write(folder.0.join("s.ron"), graph).unwrap();
    assert_eq!(folder.run(&["render", "s.ron"]).code, Some(0));
    std::fs::write(folder.0.join("t.ron"), graph.replace("\"spans\"", "\"unused\"")).unwrap();
    // A node that makes spans is written as spans, with the size and lines with which the graph resolves: as it is set,
    // and of what divides lines, with those that it begins with.
    for (lines, count) in [("Sloped(3)", 3), ("Adaptive(5,0.1)", 5), ("Exact", 16)] {
        let set = format!("picture.lines={lines}");
        let ran = folder.run(&["render", "t.ron", "-w", "balls", "-o", "x.span", "--set", &set]);
        assert!(ran.code == Some(0) && !ran.err.contains("warning"), "{ran:?}");
        let out = folder.run(&["info", "x.span"]).out;
        assert!(out.contains(&format!("40 x 30 pixels, {count} lines per row")), "{lines}: {out}");
    }
    let other = "\"other\": Resolve(image: \"boxes\", size: (9, 9)), \"unused\"";
    let two = std::fs::read_to_string(folder.0.join("t.ron")).unwrap();
    std::fs::write(folder.0.join("two.ron"), two.replace("\"unused\"", other)).unwrap();
    let ran = folder.run(&["render", "two.ron", "-w", "balls", "-o", "x.span"]);
    assert!(ran.err.contains("resolves with different sizes or lines"), "{ran:?}");
    // The cure cures.
    let said = ["size=(9,9)", "lines=Sloped(2)"].map(|v| format!("file_of_the_command_line.{v}"));
    let [size, lines] = said.each_ref().map(String::as_str);
    let cured = ["render", "two.ron", "-w", "balls", "-o", "x.span", "--set", size, "--set", lines];
    let ran = folder.run(&cured);
    assert!(ran.code == Some(0) && !ran.err.contains("warning"), "{ran:?}");
    let ran = folder.run(&["render", "t.ron", "-w", "balls", "-o", "balls.span"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let info = folder.run(&["info", "balls.span"]);
    assert!(info.out.contains("40 x 30 pixels, 2 lines per row"), "{info:?}");
    let set = "file_of_the_command_line.lines=Sloped(8)";
    let ran = folder.run(&["render", "t.ron", "-w", "balls", "-o", "balls.span", "--set", set]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    // The lines differ: 2 here, 8 there.
    let ran = folder.run(&["merge", "boxes.span", "balls.span", "-o", "both.span"]);
    assert_eq!(ran.code, Some(1), "{ran:?}");
    let named =
        ["2 lines per row, centred in boxes.span", "8 lines per row, centred in balls.span"];
    assert!(named.iter().all(|part| ran.err.contains(part)), "{ran:?}");
    assert_eq!(folder.run(&["render", "t.ron", "-w", "balls", "-o", "balls.span"]).code, Some(0));
    let onto_itself = folder.run(&["merge", "boxes.span", "balls.span", "-o", "balls.span"]);
    assert_eq!(onto_itself.code, Some(2), "{onto_itself:?}");
    let ran = folder.run(&["merge", "boxes.span", "balls.span", "-o", "both.span"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert!(ran.err.contains("wrote both.span"), "{ran:?}");

    // A link may name the file; lit after reading, it is the same picture.
    let read = graph.replace("\"both\": DepthMerge(inputs: [\"boxes\", \"balls\"]),", "");
    let read = read.replace("image: \"both\"", "image: \"both.span\"").replace("a.exr", "b.exr");
    let read = read.replace("\"balls\": Scanline(scene: \"ball.ron\", camera: \"eye\"),", "");
    std::fs::write(folder.0.join("r.ron"), read).unwrap();
    let ran = folder.run(&["render", "r.ron", "-w", "file"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(folder.run(&["diff", "a.exr", "b.exr"]).code, Some(0));
    // Other lines are asked for than there are.
    let ran = folder.run(&["render", "r.ron", "-w", "file", "--set", "picture.lines=Sloped(3)"]);
    assert!(ran.err.contains("the lines `Sloped(2)`"), "{ran:?}");
    let dry = ["render", "r.ron", "-n", "-w", "file", "--set", "picture.lines=Sloped(3)"];
    assert_eq!(folder.run(&dry).code, Some(4));
    // What a graph is made from is not overwritten by it; what is no file of spans is not read as one.
    let ran = folder.run(&["render", "r.ron", "-w", "lit", "-o", "both.span"]);
    assert_eq!(ran.code, Some(3), "{ran:?}");
    assert!(ran.err.contains("would overwrite a file that it is made from"), "{ran:?}");
    let wrong =
        std::fs::read_to_string(folder.0.join("r.ron")).unwrap().replace("both.span", "a.exr");
    std::fs::write(folder.0.join("wrong.ron"), wrong).unwrap();
    let ran = folder.run(&["check", "wrong.ron"]);
    assert!(ran.code == Some(3) && ran.err.contains("its name ends in .span"), "{ran:?}");

    let same = folder.run(&["diff", "both.span", "both.span"]);
    assert_eq!((same.code, same.out.as_str()), (Some(0), "0 of 60 lines differ\n"));
    let other = folder.run(&["diff", "both.span", "boxes.span"]);
    assert_eq!(other.code, Some(1), "{other:?}");
    assert!(other.out.contains("only in both.span"), "{other:?}");
    assert_eq!(folder.run(&["diff", "both.span", "boxes.span", "--tolerance", "1"]).code, Some(0));
    assert_eq!(folder.run(&["diff", "both.span", "a.exr"]).code, Some(1));

    // A scene that has moved is found by its name.
    std::fs::create_dir(folder.0.join("moved")).unwrap();
    std::fs::rename(folder.0.join("ball.ron"), folder.0.join("moved/ball.ron")).unwrap();
    let found = std::fs::read_to_string(folder.0.join("r.ron")).unwrap();
    let read = "\"both\": ReadSpans(file: \"both.span\", scenes: \"moved\"), \"sun\":";
    let found = found.replace("image: \"both.span\"", "image: \"both\"").replace("\"sun\":", read);
    std::fs::write(folder.0.join("found.ron"), found.replace("b.exr", "c.exr")).unwrap();
    let ran = folder.run(&["render", "found.ron", "-w", "file"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(folder.run(&["diff", "a.exr", "c.exr"]).code, Some(0));

    // Without a scene `info` says what is left, and lights say what they miss.
    std::fs::remove_file(folder.0.join("moved/ball.ron")).unwrap();
    let info = folder.run(&["info", "both.span"]);
    assert!(
        info.out.contains("no light can be set") && info.out.contains("ball.ron: cannot be used"),
        "{info:?}"
    );
    let ran = folder.run(&["render", "r.ron", "-w", "file"]);
    assert_eq!(ran.code, Some(1), "{ran:?}");
    assert!(ran.err.contains("normals") && ran.err.contains("ball.ron"), "{ran:?}");
}

#[test]
fn inspect_draws_a_line_of_an_image_and_of_what_it_is_made_of() {
    let folder = Folder::new("inspect");
    let merged = GRAPH
        .replace("Scanline(scene: \"box.ron\", camera: \"eye\"),", "Scanline(scene: \"box.ron\", camera: \"eye\"),\n    \"more\": Scanline(scene: \"more.ron\", camera: \"eye\"),\n    \"both\": DepthMerge(inputs: [\"boxes\", \"more\"]),")
        .replace("Resolve(image: \"boxes\"", "Resolve(image: \"both\"");
    std::fs::write(folder.0.join("merged.ron"), merged).unwrap();
    let more =
        "Scene(plans: [(name: \"p\", root: (name: \"<ball>\", shape: Sphere(radius: 0.6)))])";
    std::fs::write(folder.0.join("more.ron"), more).unwrap();
    let ran = folder.run(&["inspect", "merged.ron", "--line", "15"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    for panel in ["boxes: ", "more: ", "both: "] {
        assert!(ran.out.contains(panel), "{panel}: {}", ran.out);
    }
    // Text is text, whatever it is.
    assert!(ran.out.contains("more.ron") && !ran.out.contains("<ball>"), "{}", ran.out);
    let one = folder.run(&["inspect", "merged.ron", "--line", "15", "-w", "more", "-o", "l.svg"]);
    assert_eq!(one.code, Some(0), "{one:?}");
    let svg = std::fs::read_to_string(folder.0.join("l.svg")).unwrap();
    assert!(!svg.contains("boxes: ") && svg.contains("more: "));
    for (arguments, word) in [
        (&["--line", "30"][..], "0 to 30"),
        (&["--line", "nan"], "0 to 30"),
        (&["--line", "3", "--columns", "30,90"], "0 to 40"),
        (&["--line", "3", "-w", "eye"], "no span image"),
    ] {
        let ran = folder.run(&[&["inspect", "merged.ron"], arguments].concat());
        assert_eq!(ran.code, Some(1), "{ran:?}");
        assert!(ran.err.contains(word), "{}", ran.err);
    }
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
