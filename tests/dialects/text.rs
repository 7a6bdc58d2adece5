//! Text however it was saved, and files under wrong names.

use super::*;

#[test]
fn text_is_read_the_same_however_it_was_saved_and_whatever_it_is_called() {
    let folder = Folder::new("saved");
    for (ending, text) in
        [("obj", OBJ), ("stl", STL), ("ply", PLY), ("ron", RON), ("city.json", CITY)]
    {
        for (at, bytes) in saved(text).iter().enumerate() {
            for name in [format!("a.{ending}"), "a.xyz".to_owned(), "a".to_owned()] {
                let reading =
                    folder.take(&name, bytes).unwrap_or_else(|e| panic!("{ending} {at}: {e}"));
                assert_eq!(first(&reading), TRIANGLE, "{ending}, way {at}");
                assert_eq!(reading.notes, NOTHING, "{ending}, way {at}");
            }
        }
        let reading = folder.take("a.glb", text).unwrap();
        told(&reading, &["named as if it were glTF"]);
        assert_eq!(first(&reading), TRIANGLE, "{ending}");
    }
}

#[test]
fn names_beyond_ascii_are_kept_and_latin_1_is_noted() {
    let folder = Folder::new("latin");
    let obj = "mtllib stra\u{df}e.mtl\nusemtl t\u{fc}r\n".to_owned() + OBJ;
    let mtl = "newmtl t\u{fc}r\nKd 1 0 0\n";
    let latin = |text: &str| -> Vec<u8> { text.chars().map(|c| c as u32 as u8).collect() };
    folder.put("stra\u{df}e.mtl", latin(mtl));
    let reading = folder.take("a.obj", latin(&obj)).unwrap();
    assert_eq!(reading.document.materials["t\u{fc}r"].color, Color::new(1.0, 0.0, 0.0));
    told(&reading, &["line 1 is not UTF-8", "of stra\u{df}e.mtl, line 1 is not UTF-8"]);
    let reading = folder.take("a.stl", latin(&STL.replace("solid t", "solid T\u{fc}r"))).unwrap();
    assert_eq!(meshes(&reading)[0].0, "T\u{fc}r");
    let reading =
        folder.take("a.ply", latin(&PLY.replace("element v", "comment \u{fc}\nelement v")));
    assert_eq!(first(&reading.unwrap()), TRIANGLE);
    assert_eq!(folder.put("stra\u{df}e.mtl", mtl).take("a.obj", obj).unwrap().notes, NOTHING);
}

#[test]
fn what_is_no_scene_is_told_as_what_it_is() {
    let folder = Folder::new("kinds");
    let png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
    for (name, bytes, said) in [
        ("a.obj", png.clone(), "a.obj: it is a PNG picture"),
        (
            "a.stl",
            b"PK\x03\x04 whatever".to_vec(),
            "a zip archive, not a scene that is read: unpack it",
        ),
        ("a.ply", b"\x1f\x8b\x08\0".to_vec(), "compressed by gzip"),
        ("a.gltf", b"<!doctype HTML><html>".to_vec(), "a web page"),
        ("a.json", b"ISO-10303-21;\nHEADER;".to_vec(), "a STEP or IFC file"),
        (
            "a.ron",
            b"// c\n/* Scene( */ Graph(version: 1, nodes: {})".to_vec(),
            "a graph, not a scene",
        ),
        ("a.mtl", b"newmtl x\n".to_vec(), "read the OBJ file"),
        ("a.xyz", b"1 2 3\n4 5 6\n".to_vec(), "not a scene format that is known"),
        ("b.obj", Vec::new(), "b.obj: the file is empty"),
        ("b.ron", Vec::new(), "b.ron: the file is empty"),
    ] {
        let error = folder.take(name, bytes).unwrap_err();
        assert!(error.contains(said), "{name}: {error}");
    }
    let error = folder.put("library.mtl", png).take("c.obj", "mtllib library.mtl\n").unwrap_err();
    assert!(error.contains("library.mtl: it is a PNG picture, not text"), "{error}");
    let error = folder.read("b.opj").unwrap_err();
    assert!(
        error.starts_with("b.opj: No such file") && error.contains("did you mean \"b.obj\"?"),
        "{error}"
    );
}

#[test]
fn lamps_and_graphs_are_opened_as_scenes_are() {
    let folder = Folder::new("others");
    let ies = "IESNA:LM-63-2002\n[TEST] x\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 100\n0 45 90\n0\n1 2 3\n";
    let right = Photometry::parse(ies.as_bytes(), false).unwrap();
    for bytes in saved(ies) {
        for name in ["a.ies", "a.ldt"] {
            folder.put(name, &bytes);
            assert_eq!(Photometry::read(&folder.0.path().join(name)).unwrap(), right);
        }
    }
    folder.put("e.ies", "");
    let error = Photometry::read(&folder.0.path().join("e.ies")).unwrap_err().to_string();
    assert!(error.ends_with("the file is empty: was it copied or downloaded whole?"), "{error}");
    let graph = "Graph(version: 1, nodes: {\n\"eye\": Camera(),\n})\n";
    for bytes in saved(graph) {
        folder.put("g.ron", bytes);
        let ran = run(PROGRAM, &["check", "g.ron"], folder.0.path());
        assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""));
        let ran = run(PROGRAM, &["info", "g.ron"], folder.0.path());
        assert!(ran.out.starts_with("g.ron: a graph\n  eye: Camera"), "{}{}", ran.out, ran.err);
    }
}

#[test]
fn a_scene_within_a_scene_is_found_by_what_it_is() {
    let folder = Folder::new("within");
    folder.put("part.obj", STL);
    folder.put(
        "all.ron",
        "Scene(version: 1, plans: [(name: \"p\", root: (shape: File(path: \"part.obj\")))])",
    );
    let scene =
        read::scene(&folder.0.path().join("all.ron"), None, "s", &ReadOptions::default()).unwrap();
    assert_eq!(scene.face_count(), 1);
    assert!(scene.notes.iter().any(|note| note.contains("it is STL, and named as if it were OBJ")));
    let missing =
        read::document(Path::new("/nowhere/at/all.obj"), &ReadOptions::default()).unwrap_err();
    assert!(
        missing.to_string().contains("is it in another folder, or named otherwise?"),
        "{missing}"
    );
}
