//! The command line as a farm uses it: what is told, what is written, what stays whole.

use serde_json::Value as Json;
use spandrel_tests::program::{Ran, Scratch, run};
use std::path::PathBuf;

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

const GRAPH: &str = r#"Graph(nodes: {
    "eye": Camera(position: (2, 2, 5)),
    "boxes": Scanline(scene: "box.ron", camera: "eye"),
    "picture": Resolve(image: "boxes", size: (40, 30), lines: Sloped(2)),
    "file": Write(image: "picture", path: "out/a.png"),
    "blurred": Blur(image: "picture", radius: 1),
    "soft": Write(image: "blurred", path: "out/b.exr"),
})"#;

struct Folder(Scratch);

impl Folder {
    fn new(name: &str) -> Folder {
        let folder = Folder(Scratch::new(name));
        folder.put(
            "box.ron",
            "Scene(plans: [(name: \"p\", root: (name: \"table\", shape: Box(size: (1, 1, 1))))])",
        );
        folder.put("g.ron", GRAPH);
        folder
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn put(&self, name: &str, text: impl AsRef<[u8]>) {
        let path = self.at(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }

    fn run(&self, arguments: &[&str]) -> Ran {
        run(PROGRAM, arguments, self.0.path())
    }

    fn shell(&self, script: &str) -> Ran {
        let script = script.replace("spandrel", PROGRAM);
        run("bash", &["-c", &script], self.0.path())
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.at(name)).unwrap_or_default()
    }

    /// All names in a folder.
    fn names(&self, sub: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.at(sub)).into_iter().flatten().flatten();
        let mut names: Vec<String> =
            entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

fn stats(ran: &Ran) -> Json {
    serde_json::from_str(&ran.out).unwrap_or_else(|e| panic!("{e}: {ran:?}"))
}

/// The texts of a list of the statistics, or a field of its entries.
fn list(stats: &Json, of: &str, field: &str) -> Vec<String> {
    let entries = stats[of].as_array().unwrap_or_else(|| panic!("no {of}: {stats}"));
    let text = |entry: &Json| match field {
        "" => entry.as_str().unwrap().to_owned(),
        field => entry[field].as_str().unwrap().to_owned(),
    };
    entries.iter().map(text).collect()
}

#[test]
fn warnings_are_no_chatter_and_can_be_denied() {
    let folder = Folder::new("farm-warnings");
    let doubtful = GRAPH.replace("\"boxes\": ", "\"bare\": ").replace(
        "\"picture\": Resolve",
        "\"boxes\": Stream(image: \"bare\", code: \"if (object('tabel')) { color = 0; } color\"), \
         \"picture\": Resolve",
    );
    folder.put("w.ron", doubtful);
    let told = "warning: node \"boxes\": object('tabel') fits nothing: did you mean 'table'?\n";
    let ran = folder.run(&["render", "w.ron", "-q", "-w", "file"]);
    assert_eq!((ran.code, ran.out.as_str(), ran.err.as_str()), (Some(0), "", told));
    let ran =
        folder.run(&["render", "w.ron", "-q", "-w", "file", "--deny-warnings", "--stats=json"]);
    assert_eq!(ran.code, Some(1), "{ran:?}");
    assert!(ran.err.starts_with(told) && ran.err.contains("--deny-warnings"), "{ran:?}");
    let stats = stats(&ran);
    assert_eq!(list(&stats, "warnings", "").len(), 1);
    assert!(list(&stats, "warnings", "")[0].contains("object('tabel')"));
    // What is written is there all the same.
    assert_eq!(list(&stats, "outputs", "node"), ["file"]);
    let ran = folder.run(&["render", "g.ron", "-q", "--deny-warnings"]);
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""));
}

#[test]
fn statistics_are_whole_whatever_fails() {
    let folder = Folder::new("farm-stats");
    folder.put("bad.ron", GRAPH.replace("Sloped(2)", "Slopd(2)"));
    folder.put("lost.ron", GRAPH.replace("box.ron", "lost.obj"));
    folder.put("none.ron", "Graph(nodes: {})");
    folder.put("broken.ply", "ply\nformat ascii 1.0\nelement vertex 3\n");
    folder.put("broken.ron", GRAPH.replace("box.ron", "broken.ply"));
    folder.put("file", "");
    folder.put("late.ron", GRAPH.replace("out/b.exr", "file/b.exr"));
    for (arguments, code, word) in [
        (
            &["bad.ron"][..],
            3,
            "bad.ron:4:63: `Slopd` is not one of the choices: did you mean `Sloped`?",
        ),
        (&["lost.ron"], 4, "lost.obj"),
        (&["none.ron"], 3, "writes nothing"),
        (&["broken.ron"], 4, "broken.ply"),
        (&["late.ron"], 1, "file/b.exr: cannot be written"),
        (&["nowhere.ron"], 4, "nowhere.ron"),
        (&["g.ron", "-w", "fill"], 2, "did you mean file"),
        (&["g.ron", "--window", "900,0,1,1"], 1, "outside"),
    ] {
        let ran = folder.run(&[&["render", "-q", "--stats=json"], arguments].concat());
        assert_eq!(ran.code, Some(code), "{ran:?}");
        let stats = stats(&ran);
        let errors = list(&stats, "errors", "");
        assert!(errors.iter().any(|error| error.contains(word)), "{arguments:?}: {errors:?}");
        assert_eq!(stats["version"], env!("CARGO_PKG_VERSION"));
        for of in ["outputs", "skipped", "warnings", "notes"] {
            assert!(list(&stats, of, "node").is_empty(), "{arguments:?}: {stats}");
        }
        assert!(stats["nodes"].is_array());
    }
    let ran = folder.run(&["render", "g.ron", "-q", "--stats=json"]);
    let stats = stats(&ran);
    assert!(list(&stats, "errors", "").is_empty());
    assert_eq!(list(&stats, "outputs", "file").len(), 2);
    for output in stats["outputs"].as_array().unwrap() {
        let file = output["file"].as_str().unwrap();
        assert_eq!(output["bytes"].as_u64(), Some(folder.bytes(file).len() as u64), "{output}");
    }
    // Nothing else is printed where a program reads.
    let ran = folder.run(&["render", "g.ron", "-n", "--stats=json"]);
    assert!(serde_json::from_str::<Json>(&ran.out).is_ok() && ran.err.contains("would evaluate"));
}

#[test]
fn what_is_there_is_left_and_the_rest_is_made() {
    let folder = Folder::new("farm-resume");
    folder.put("out/a.png", "mine");
    let ran = folder.run(&["render", "g.ron", "--no-clobber", "--stats=json"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert!(ran.err.contains("kept out/a.png: it exists"), "{ran:?}");
    let told = stats(&ran);
    assert_eq!(list(&told, "skipped", "file"), ["out/a.png"]);
    assert_eq!(list(&told, "outputs", "file"), ["out/b.exr"]);
    assert_eq!(folder.bytes("out/a.png"), b"mine");
    assert!(!folder.bytes("out/b.exr").is_empty());
    // What only the file that is there needs is not evaluated.
    let _ = std::fs::remove_file(folder.at("out/a.png"));
    let ran = folder.run(&["render", "g.ron", "--no-clobber", "--stats=json", "-q"]);
    let nodes = list(&stats(&ran), "nodes", "node");
    assert!(nodes.iter().any(|n| n == "file") && nodes.iter().all(|n| n != "blurred"), "{nodes:?}");
    // And if all is there, nothing is.
    let ran = folder.run(&["render", "g.ron", "--no-clobber", "--stats=json", "-q"]);
    let told = stats(&ran);
    assert_eq!((ran.code, list(&told, "nodes", "node").len()), (Some(0), 0));
    assert_eq!(list(&told, "skipped", "node"), ["file", "soft"]);
    // A part of the picture is another file.
    let window = ["render", "g.ron", "--no-clobber", "-q", "--window", "3,4,10,5"];
    assert_eq!(folder.run(&window).code, Some(0));
    assert_eq!(folder.names("out"), ["a.3,4,10,5.png", "a.png", "b.3,4,10,5.exr", "b.exr"]);
    let named = ["render", "g.ron", "-q", "--window", "3,4,10,5", "-w", "file", "-o", "c.png"];
    assert_eq!(folder.run(&named).code, Some(0));
    assert_eq!(image::image_dimensions(folder.at("c.png")).unwrap(), (10, 5));
    // Files of spans are merged in the same manner.
    folder.put("m.span", "mine");
    let ran = folder.run(&["merge", "x.span", "y.span", "-o", "m.span", "--no-clobber"]);
    assert_eq!((ran.code, folder.bytes("m.span")), (Some(0), b"mine".to_vec()), "{ran:?}");
}

#[cfg(unix)]
#[test]
fn a_full_device_is_a_failure_whatever_it_is() {
    let folder = Folder::new("farm-full");
    folder.run(&["render", "g.ron", "-q", "-w", "boxes", "-o", "a.span"]);
    folder.put("lamp.ies", LAMP);
    for ending in ["png", "exr", "span", "ron", "scene", "svg", "csv"] {
        std::os::unix::fs::symlink("/dev/full", folder.at(&format!("full.{ending}"))).unwrap();
    }
    let before = folder.names("");
    for arguments in [
        "render g.ron -q -w file -o full.png",
        "render g.ron -q -w file -o full.exr",
        "render g.ron -q -w boxes -o full.span",
        "render g.ron -q -w picture -o - > /dev/full",
        "render g.ron -q -w picture -o -.exr > /dev/full",
        "render g.ron -q -w boxes -o - > /dev/full",
        "render g.ron -q -n > /dev/full",
        "render g.ron -q -w file -o c.png --stats=json > /dev/full",
        "merge a.span a.span -q -o full.span",
        "convert box.ron full.ron",
        "convert box.ron full.scene",
        "inspect g.ron --line 15 > /dev/full",
        "inspect g.ron --line 15 -o full.svg",
        "info box.ron > /dev/full",
        "info lamp.ies -o full.svg",
        "check g.ron > /dev/full",
        "nodes > /dev/full",
        "nodes Fog --json > /dev/full",
        "diff a.span a.span > /dev/full",
        "completions bash > /dev/full",
        "--help > /dev/full",
        "--version > /dev/full",
    ] {
        let ran = folder.shell(&format!("spandrel {arguments}"));
        assert_eq!(ran.code, Some(1), "{arguments}: {ran:?}");
        assert!(ran.err.contains("No space left"), "{arguments}: {ran:?}");
    }
    let _ = std::fs::remove_file(folder.at("c.png"));
    assert_eq!(folder.names(""), before, "nothing is left");
    assert!(std::fs::metadata("/dev/full").is_ok_and(|about| !about.is_file()));
}

#[cfg(unix)]
#[test]
fn a_file_that_cannot_grow_leaves_the_old_one() {
    let folder = Folder::new("farm-limit");
    let graph = GRAPH.replace("\"boxes\": ", "\"bare\": ").replace(
        "\"picture\": Resolve(image: \"boxes\", size: (40, 30)",
        "\"boxes\": Stream(image: \"bare\", code: \"0.5 + 0.5 * noise(P * 90)\"), \
         \"picture\": Resolve(image: \"boxes\", size: (300, 200)",
    );
    folder.put("n.ron", graph);
    for file in ["a.png", "a.exr", "a.span", "a.ron", "a.scene"] {
        folder.put(file, "old");
    }
    let before = folder.names("");
    for arguments in [
        "render n.ron -q -w picture -o a.png",
        "render n.ron -q -w picture -o a.exr",
        "render n.ron -q -w boxes -o a.span",
        "convert box.ron a.ron",
        "convert box.ron a.scene",
    ] {
        // No signal, so that the write fails as on a full disk; half a kilobyte is allowed.
        let limit = if arguments.starts_with("convert") { 0 } else { 1 };
        let ran = folder.shell(&format!("trap '' XFSZ; ulimit -f {limit}; spandrel {arguments}"));
        assert_eq!(ran.code, Some(1), "{arguments}: {ran:?}");
        assert!(ran.err.contains("too large"), "{arguments}: {ran:?}");
        let file = arguments.rsplit(' ').next().unwrap();
        assert_eq!(folder.bytes(file), b"old", "{arguments}");
    }
    assert_eq!(folder.names(""), before, "nothing is left");
}

#[cfg(unix)]
#[test]
fn links_stay_and_doubtful_places_are_told_first() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = Folder::new("farm-places");
    folder.put("deep/real.png", "old");
    symlink("deep/real.png", folder.at("link.png")).unwrap();
    symlink("deep", folder.at("other")).unwrap();
    let ran = folder.run(&["render", "g.ron", "-q", "-w", "file", "-o", "link.png"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert!(folder.at("link.png").is_symlink());
    assert_eq!(image::image_dimensions(folder.at("deep/real.png")).unwrap(), (40, 30));
    assert_eq!(folder.names("deep"), ["real.png"]);
    // One file by two names.
    folder.put(
        "twice.ron",
        GRAPH.replace("out/a.png", "deep/x.exr").replace("out/b.exr", "other/x.exr"),
    );
    let ran = folder.run(&["check", "twice.ron"]);
    assert!(ran.code == Some(3) && ran.err.contains("write the same file"), "{ran:?}");
    // Everything about a place is told before anything is computed.
    folder.put("kept.png", "old");
    let read_only = std::fs::Permissions::from_mode(0o444);
    std::fs::set_permissions(folder.at("kept.png"), read_only).unwrap();
    std::fs::create_dir(folder.at("folder.png")).unwrap();
    let long = format!("{}.png", "x".repeat(300));
    for (file, code, word) in [
        ("kept.png", 1, "read-only"),
        ("folder.png", 2, "it is a folder"),
        (&long, 1, "too long"),
        ("box.ron/a.png", 1, "Not a directory"),
        ("~/a.png", 2, "$HOME"),
        ("a.####.png", 2, "`####`"),
        ("a.%04d.png", 2, "`%04d`"),
        ("{size}.png", 2, "`{size}`"),
        ("deep", 2, "it is a folder"),
        ("a.tga", 3, ".tga"),
    ] {
        let ran = folder.run(&["render", "g.ron", "-v", "-w", "file", "-o", file]);
        assert_eq!(ran.code, Some(code), "{file}: {ran:?}");
        assert!(ran.err.contains(word), "{file}: {ran:?}");
        assert!(!ran.err.contains("Scanline"), "{file} is told late: {ran:?}");
    }
    folder.put("frames.ron", GRAPH.replace("out/a.png", "out/a.####.png"));
    let ran = folder.run(&["check", "frames.ron"]);
    assert!(ran.code == Some(3) && ran.err.contains("`####`"), "{ran:?}");
    // Drawings do not take the place of what they are drawn from.
    for arguments in [
        &["inspect", "g.ron", "--line", "3", "-o", "g.ron"][..],
        &["info", "box.ron", "-o", "g.ron"],
    ] {
        assert_eq!(folder.run(arguments).code, Some(2));
    }
    assert_eq!(folder.bytes("g.ron"), GRAPH.as_bytes());
    // Blanks, quotes and missing folders are nothing special.
    let spaced = "new folder/it's \"a\".png";
    let ran = folder.run(&["render", "g.ron", "-q", "-w", "file", "-o", spaced]);
    assert!(ran.code == Some(0) && folder.at(spaced).exists(), "{ran:?}");
}

#[test]
fn pictures_go_to_the_standard_output_and_graphs_come_from_the_input() {
    let folder = Folder::new("farm-pipes");
    for (arguments, file) in [
        ("-w file -o -", "-w file -o x.png"),
        ("-w soft -o -", "-w soft -o x.exr"),
        ("-w picture -o -", "-w picture -o x.png"),
        ("-w picture -o -.exr", "-w picture -o x.exr"),
        ("-w boxes -o -", "-w boxes -o x.span"),
        ("-w boxes -o -.span --explain --stats", "-w boxes -o x.span"),
    ] {
        let name = file.rsplit(' ').next().unwrap();
        let script = format!(
            "spandrel render g.ron {arguments} > piped && spandrel render g.ron -q {file} && cmp piped {name}"
        );
        let ran = folder.shell(&script);
        assert_eq!(ran.code, Some(0), "{arguments}: {ran:?}");
        assert!(ran.err.contains("wrote the standard output"), "{ran:?}");
    }
    let ran = folder.run(&["render", "g.ron", "-w", "file", "-o", "-", "--stats=json"]);
    assert!(ran.code == Some(2) && ran.err.contains("--stats=json"), "{ran:?}");
    // A graph that comes through a pipe lies in the current folder.
    let ran = folder
        .shell("cd out 2>/dev/null; spandrel render - -q < g.ron && spandrel check - < g.ron");
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(folder.names("out"), ["a.png", "b.exr"]);
    let ran = folder.shell("sed s/Sloped/Slopd/ g.ron | spandrel check -");
    assert!(ran.code == Some(3) && ran.err.contains("standard input:4:"), "{ran:?}");
    // A reader that goes away has not got its picture.
    let gone = "{ exec <&-; sleep 0.2; }; exit ${PIPESTATUS[0]}";
    let ran = folder.shell(&format!("spandrel render g.ron -q -w file -o - | {gone}"));
    assert_eq!(ran.code, Some(1), "{ran:?}");
}

#[test]
fn names_that_are_typed_wrong_are_guessed() {
    let folder = Folder::new("farm-guess");
    for (arguments, code, word) in [
        (&["render", "g.ron", "-w", "fiel"][..], 2, "did you mean file?"),
        (&["inspect", "g.ron", "--line", "3", "-w", "boxs"], 2, "did you mean boxes?"),
        (
            &[
                "measure",
                "g.ron",
                "-w",
                "pictur",
                "--vary",
                "picture.lines=Sloped(1)",
                "--reference",
                "picture.lines=Sloped(2)",
            ],
            2,
            "did you mean picture?",
        ),
        (
            &[
                "measure",
                "g.ron",
                "-w",
                "picture",
                "--vary",
                "pictur.lines=Sloped(1)",
                "--reference",
                "picture.lines=Sloped(2)",
            ],
            2,
            "did you mean \"picture\"?",
        ),
        (
            &[
                "measure",
                "g.ron",
                "-w",
                "picture",
                "--vary",
                "picture.lines=Sloped(1),Slopd(2)",
                "--reference",
                "picture.lines=Sloped(2)",
            ],
            3,
            "did you mean `Sloped`?",
        ),
        (&["check", "g.ron", "--set", "picture.lins=Sloped(1)"], 3, "did you mean `lines`?"),
        (&["check", "g.ron", "--set", "pictur.lines=Sloped(1)"], 2, "did you mean \"picture\"?"),
        (&["check", "g.ron", "--set", "picture.lines=Sloepd(1)"], 3, "did you mean `Sloped`?"),
        (&["nodes", "Resolv"], 2, "did you mean Resolve?"),
        (&["rendr", "g.ron"], 2, "'render'"),
        (&["render", "g.ron", "--no-clober"], 2, "'--no-clobber'"),
        (&["render", "g.ron", "--stats=jsn"], 2, "'json'"),
        (&["render", "g.rn"], 4, "g.rn"),
    ] {
        let ran = folder.run(arguments);
        assert_eq!(ran.code, Some(code), "{arguments:?}: {ran:?}");
        assert!(ran.err.contains(word), "{arguments:?} without \"{word}\": {}", ran.err);
        assert!(!ran.err.contains("reference:"), "{arguments:?} is told late: {}", ran.err);
    }
}

const LAMP: &str =
    "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n100 50 0\n";

#[test]
fn names_of_any_letters_are_read_written_and_told() {
    let folder = Folder::new("farm-letters");
    for letters in ["é", "€ uro", "😀", "e\u{301}", "tab\tbed", "\r", "\u{200b}", "-", "'\"\\"]
    {
        let (graph, scene) = (format!("g{letters}.ron"), format!("s{letters}.ron"));
        let (png, span) = (format!("p{letters}.png"), format!("p{letters}.span"));
        let quoted = |name: &str| {
            // As RON has it: what RON cannot have in a text is written out.
            let escaped: String = name.chars().map(|c| c.escape_default().to_string()).collect();
            format!("\"{escaped}\"")
        };
        folder.put(&scene, folder.bytes("box.ron"));
        let text =
            GRAPH.replace("\"box.ron\"", &quoted(&scene)).replace("\"out/a.png\"", &quoted(&png));
        folder.put(&graph, &text);
        folder.put("bad.ron", text.replace("Sloped", &format!("Sl{}", quoted(letters))));
        let name = format!("n{letters}");
        let set = format!("{name}.{letters}={letters}");
        let [field, value] = [format!("picture.{name}=1"), format!("picture.lines={name}")];
        let converted = format!("c{letters}.ron");
        for (arguments, code) in [
            (&["render", &graph, "-w", "file"][..], 0),
            (&["render", &graph, "-w", "file", "--window", "1,1,2,2"], 0),
            (&["render", &graph, "-w", "boxes", "-o", &span], 0),
            (&["info", &span], 0),
            (&["info", &scene], 0),
            (&["info", &graph], 0),
            (&["diff", &png, &png], 0),
            (&["convert", &scene, &converted], 0),
            (&["check", "bad.ron"], 3),
            (&["check", &graph, "--set", &set], 2),
            (&["check", &graph, "--set", &field], 3),
            (&["check", &graph, "--set", &value], 3),
            (&["render", &graph, "-w", &name], 2),
            (&["nodes", &name], 2),
            (&["render", &name], 4),
            (&["info", &name], 4),
            (&["inspect", &graph, "--line", "9", "-w", &name], 2),
            (&["render", &graph, "--stats", &name], 2),
        ] {
            let ran = folder.run(arguments);
            assert_eq!(ran.code, Some(code), "{arguments:?}: {ran:?}");
            let raw = ran.err.contains(['\r', '\u{200b}']) || ran.out.contains(['\r', '\u{200b}']);
            // What clap says of its own arguments it says as they are.
            assert!(!raw || arguments.contains(&"--stats"), "{arguments:?}: {ran:?}");
        }
        assert!(folder.at(&png).exists() && folder.at(&span).exists());
        assert!(folder.at(&format!("p{letters}.1,1,2,2.png")).exists());
    }
}

#[test]
fn what_was_written_before_a_failure_is_told() {
    let folder = Folder::new("farm-late");
    folder.put("broken.ply", "ply\nformat ascii 1.0\nelement vertex 3\n");
    let graph = GRAPH.replace(
        "\"blurred\": Blur(image: \"picture\"",
        "\"more\": Scanline(scene: \"broken.ply\", camera: \"eye\"), \
         \"other\": Resolve(image: \"more\", size: (40, 30)), \"blurred\": Blur(image: \"other\"",
    );
    folder.put("f.ron", graph);
    let ran = folder.run(&["render", "f.ron", "-j", "1", "--stats=json"]);
    assert_eq!(ran.code, Some(4), "{ran:?}");
    let (told, is_there) = (stats(&ran), folder.at("out/a.png").exists());
    assert_eq!(list(&told, "outputs", "node"), if is_there { vec!["file"] } else { vec![] });
    assert_eq!(ran.err.contains("wrote out/a.png"), is_there, "{ran:?}");
    assert!(list(&told, "errors", "")[0].contains("broken.ply"), "{ran:?}");
}
