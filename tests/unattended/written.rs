//! What is written, where, and what stays as it was.

use super::{Folder, GRAPH, list, stats};

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

#[test]
fn a_full_device_is_a_failure_whatever_it_is() {
    let folder = Folder::new("farm-full");
    folder.run(&["render", "g.ron", "-q", "-w", "boxes", "-o", "a.span"]);
    folder.put("lamp.ies", LAMP);
    folder.put("cache/spandrel-cache", "");
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
        "cache cache > /dev/full",
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
        ("a.@@@@.png", 2, "write ####"),
        ("a.%4d.png", 2, "`%4d`"),
        ("{size}.png", 2, "`{size}`"),
        ("deep", 2, "it is a folder"),
        ("a.tga", 3, ".tga"),
    ] {
        let ran = folder.run(&["render", "g.ron", "-v", "-w", "file", "-o", file]);
        assert_eq!(ran.code, Some(code), "{file}: {ran:?}");
        assert!(ran.err.contains(word), "{file}: {ran:?}");
        assert!(!ran.err.contains("Scanline"), "{file} is told late: {ran:?}");
    }
    folder.put("frames.ron", GRAPH.replace("out/a.png", "out/a.<frame>.png"));
    let ran = folder.run(&["check", "frames.ron"]);
    assert!(ran.code == Some(3) && ran.err.contains("`<frame>`"), "{ran:?}");
    // Nor does a picture take the place of one that is on a surface, which nobody knows before.
    let paint = "materials: {\"m\": (color: 1, maps: {\"color\": (picture: File(\"deep/real.png\"))})}, \
                 plans: [(name: \"p\", root: (material: \"m\", shape: Box(size: (1, 1, 1))))]";
    folder.put("painted.ron", format!("Scene({paint})"));
    folder.put("paint.ron", GRAPH.replace("box.ron", "painted.ron"));
    let before = folder.bytes("deep/real.png");
    for file in ["deep/real.png", "link.png"] {
        let ran = folder.run(&["render", "paint.ron", "-q", "-w", "file", "-o", file]);
        assert!(ran.code == Some(1) && ran.err.contains("were read"), "{ran:?}");
        assert_eq!(folder.bytes("deep/real.png"), before);
    }
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

const LAMP: &str =
    "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n100 50 0\n";
