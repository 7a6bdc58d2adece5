//! What is said: warnings, statistics, guesses, and names of any letters.

use super::{Folder, GRAPH, list, stats};
use serde_json::Value as Json;

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

#[cfg(unix)]
#[cfg(unix)]
#[cfg(unix)]
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

#[test]
fn names_of_any_letters_are_read_written_and_told() {
    let folder = Folder::new("farm-letters");
    for letters in ["é", "€ uro", "😀", "e\u{301}", "\u{200b}", "-", "'\"\\"] {
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
            (&["cache", &name], 4),
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
