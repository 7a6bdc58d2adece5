//! The other commands: what scenes, pictures and files of spans are told to be, compared with and made into.

use crate::cli::{Folder, GRAPH};

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
    let words = all["any_value"].as_array().unwrap();
    let words: Vec<&str> = words.iter().map(|word| word["name"].as_str().unwrap()).collect();
    assert_eq!(words, ["Curve", "Expr", "Ref"]);
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
