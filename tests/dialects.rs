//! Scene files as programs really write them: text however it was saved, formats under wrong names, and the
//! dialects of STL, PLY, OBJ and MTL. Each is read as what it means, or told.

use glam::{DVec2, DVec3, dvec3 as v};
use spandrel_engine::color::{Color, decode_srgb};
use spandrel_engine::fragment::{Gloss, Optics};
use spandrel_engine::light::photometry::Photometry;
use spandrel_engine::raster::{LinePlan, Phase, Rows};
use spandrel_engine::resolve::Channel;
use spandrel_engine::scene::read::{self, Axis, ReadOptions, Reading};
use spandrel_engine::scene::{AlphaMode, Material, Mesh, Shape};
use spandrel_engine::shade::Illuminate;
use spandrel_engine::span::SpanImage;
use spandrel_engine::visible::render;
use spandrel_tests::lights::{illuminate, sun};
use spandrel_tests::program::{Scratch, run};
use spandrel_tests::scenes::front_view;
use spandrel_tests::spans::picture;
use std::path::Path;
use std::sync::Arc;

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

/// A folder with files.
struct Folder(Scratch);

impl Folder {
    fn new(name: &str) -> Folder {
        Folder(Scratch::new(&format!("dialects-{name}")))
    }

    fn put(&self, name: &str, bytes: impl AsRef<[u8]>) -> &Folder {
        let path = self.0.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
        self
    }

    fn read(&self, name: &str) -> Result<Reading, String> {
        let path = self.0.path().join(name);
        let before = format!("{}/", self.0.path().display());
        let read = read::document(&path, &ReadOptions::default());
        read.map_err(|e| e.to_string().replace(&before, ""))
    }

    /// Reads a file that has these contents.
    fn take(&self, name: &str, bytes: impl AsRef<[u8]>) -> Result<Reading, String> {
        self.put(name, bytes).read(name)
    }

    fn image(&self, name: &str) -> SpanImage {
        let path = self.0.path().join(name);
        let scene = read::scene(&path, None, "scene", &ReadOptions::default()).unwrap();
        let (plan, rows) = (LinePlan::new(4, Phase::Centre).unwrap(), Rows { start: 0, end: 9 });
        render(&[Arc::new(scene).into()], &front_view(9, 9), plan, rows).unwrap()
    }

    /// What is seen in the middle, before any light.
    fn seen(&self, name: &str) -> [f32; 4] {
        middle(&self.image(name))
    }
}

fn middle(image: &SpanImage) -> [f32; 4] {
    picture(image, &[Channel::Color]).pixels().nth(9 * 4 + 4).unwrap()
}

fn near(a: [f32; 4], b: [f32; 4]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5)
}

fn meshes(reading: &Reading) -> Vec<(&str, &Mesh)> {
    let children = reading.document.plans[0].root.children.iter();
    let named = children.map(|child| match &child.shape {
        Shape::Faces(mesh) => (child.name.as_str(), mesh),
        _ => panic!("no mesh"),
    });
    named.collect()
}

/// The points of a file's first face.
fn first(reading: &Reading) -> Vec<DVec3> {
    let (_, mesh) = meshes(reading)[0];
    mesh.outline(0).iter().map(|i| mesh.points[*i as usize]).collect()
}

fn told(reading: &Reading, words: &[&str]) {
    for word in words {
        assert!(
            reading.notes.iter().any(|note| note.contains(word)),
            "{word}: {:?}",
            reading.notes
        );
    }
}

const NOTHING: [String; 0] = [];

const TRIANGLE: [DVec3; 3] = [v(-4.0, -4.0, 0.0), v(4.0, -4.0, 0.0), v(0.0, 4.0, 0.0)];
const OBJ: &str = "v -4 -4 0\nv 4 -4 0\nv 0 4 0\nf 1 2 3\n";
const STL: &str = "solid t\nfacet normal 0 0 1\nouter loop\nvertex -4 -4 0\nvertex 4 -4 0\nvertex 0 4 0\n\
                   endloop\nendfacet\nendsolid t\n";
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                   property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
                   -4 -4 0\n4 -4 0\n0 4 0\n3 0 1 2\n";
const RON: &str = "Scene(version: 1, plans: [(name: \"p\", root: (children: [(name: \"t\", shape: Faces(\
                   points: [(-4, -4, 0), (4, -4, 0), (0, 4, 0)], faces: [(outline: [0, 1, 2])]))]))])";
const CITY: &str = r#"{"type":"CityJSON","version":"1.0","CityObjects":{"b":{"type":"Building","geometry":[
    {"type":"MultiSurface","lod":"2","boundaries":[[[0,1,2]]]}]}},"vertices":[[-4,-4,0],[4,-4,0],[0,4,0]]}"#;

/// A text as it may have been saved.
fn saved(text: &str) -> Vec<Vec<u8>> {
    let lines = |end: &str| text.replace('\n', end);
    let words = |unit: fn(u16) -> [u8; 2], mark: &[u8]| -> Vec<u8> {
        let units: Vec<u8> = lines("\r\n").encode_utf16().flat_map(unit).collect();
        [mark, &units].concat()
    };
    vec![
        text.into(),
        lines("\r\n").into(),
        lines("\r").into(),
        [b"\xef\xbb\xbf", lines("\r\n").as_bytes()].concat(),
        words(u16::to_le_bytes, b"\xff\xfe"),
        words(u16::to_be_bytes, b"\xfe\xff"),
        [text.as_bytes(), b"\x1a"].concat(),
    ]
}

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
        ("a.gltf", b"<!DOCTYPE html><html>".to_vec(), "a web page"),
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
fn solids_of_stl_are_objects_and_its_dialects_are_one() {
    let folder = Folder::new("stl");
    let second = STL.replace("-4 -4 0", "-4 -4 1").replace(" t\n", " part two\n");
    let third = STL.replace(" t\n", "\n");
    let reading = folder.take("three.stl", [STL, &second, &third].concat()).unwrap();
    let names: Vec<&str> = meshes(&reading).iter().map(|(name, _)| *name).collect();
    assert_eq!(names, ["t", "part two", "three"]);
    assert_eq!(meshes(&reading)[1].1.points[0], v(-4.0, -4.0, 1.0));
    assert_eq!(reading.notes, NOTHING);
    for text in [
        STL.to_uppercase(),
        format!("\n  \n{STL}"),
        STL.replace("endloop", "end loop")
            .replace("endfacet", "End Facet")
            .replace("endsolid", "end solid"),
        STL.replace("0 0 1\n", "nan NaN -nan(ind)\n"),
        STL.replace("0 0 1\n", "1.#QNAN 0 0\n"),
        STL.replace(" normal 0 0 1", ""),
        STL.replace('\n', "\n\n\t"),
        STL.replace("solid t\nfacet", "solid t facet")
            .replace("\nouter loop\n", " outer loop ")
            .replace("\nendloop\n", " endloop "),
        STL.replace("vertex 4 -4 0", "vertex +4.0e0 -.4E+01 0."),
        STL.replace("endsolid t\n", ""),
    ] {
        let reading = folder.take("a.stl", &text).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert_eq!(first(&reading), TRIANGLE, "{text}");
        assert_eq!(meshes(&reading).len(), 1, "{text}");
    }
    told(&folder.take("a.stl", STL.replace("endsolid t\n", "")).unwrap(), &["without `endsolid`"]);
    told(
        &folder.take("a.stl", format!("solid e\nendsolid\n{STL}")).unwrap(),
        &["\"e\" has no facets"],
    );
    for (text, said) in [
        (STL.replace("vertex 4 -4 0", "vertex 4 -4"), "a.stl:5:12: a number is missing"),
        (
            STL.replace("vertex 4 -4 0", "vertex 4,5 -4 0"),
            "a.stl:5:8: \"4,5\" is not a number: write a point",
        ),
        (
            STL.replace("vertex 4 -4 0", "vertex 4 nan 0"),
            "a.stl:5:10: \"nan\" is not a finite number",
        ),
        (STL.replace("vertex 4 -4 0\n", ""), "a.stl:7:1: a facet with 2 vertices"),
        (
            STL.replace("facet normal 0 0 1\n", ""),
            "a.stl:2:1: \"outer\" where `facet` or `endsolid`",
        ),
        (STL[..STL.find("endfacet").unwrap()].to_owned(), "a.stl:7:8: it ends within a facet"),
    ] {
        let error = folder.take("a.stl", text).unwrap_err();
        assert!(error.starts_with(said), "{said}: {error}");
    }
}

#[test]
fn binary_stl_is_told_by_its_length() {
    let folder = Folder::new("binary-stl");
    let file = |head: &str, count: u32, attribute: u16| {
        let mut bytes = head.as_bytes().to_vec();
        bytes.resize(80, b' ');
        bytes.extend(count.to_le_bytes());
        let numbers = [[f64::NAN; 3]].into_iter().chain(TRIANGLE.map(|p| p.to_array())).flatten();
        bytes.extend(numbers.flat_map(|number| (number as f32).to_le_bytes()));
        bytes.extend(attribute.to_le_bytes());
        bytes
    };
    for head in ["", "solid of a program", "solid facet normal"] {
        let reading = folder.take("a.stl", file(head, 1, 0)).unwrap();
        assert_eq!(first(&reading), TRIANGLE);
        assert_eq!((meshes(&reading)[0].0, &reading.notes[..]), ("a", &NOTHING[..]));
    }
    told(&folder.take("a.stl", file("", 1, 0x8001)).unwrap(), &["1 triangles have attributes"]);
    told(
        &folder.take("a.stl", [file("solid", 1, 0), vec![7; 9]].concat()).unwrap(),
        &["9 bytes behind the last"],
    );
    let error = folder.take("a.stl", file("solid", 3, 0)).unwrap_err();
    assert!(error.starts_with("a.stl: byte 80: 3 triangles are announced, 1 are there"), "{error}");
    let error = folder.take("a.stl", file("", u32::MAX, 0)).unwrap_err();
    assert!(error.contains("4294967295 triangles are announced"), "{error}");
}

#[test]
fn dialects_of_ply_are_one() {
    let folder = Folder::new("ply");
    let of = |from: &str, to: &str| {
        assert!(PLY.contains(from), "{from}");
        PLY.replace(from, to)
    };
    for text in [
        of("-4 -4 0\n4", "-.4e1 -4. +0\n+4.0E0"),
        of("-4 -4 0\n4", "\n -4\t-4 0 \n\n\n4"),
        of("vertex_indices", "vertex_index"),
        of("list uchar int", "list uint8 uint32"),
        of("list uchar int", "list int float"),
        of("property float z\n", "property float z \nobj_info made by hand\ncomment\n"),
        of("3 0 1 2", "3 0 1 2\n\n"),
    ] {
        let reading = folder.take("a.ply", &text).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert_eq!(first(&reading), TRIANGLE, "{text}");
        assert_eq!(reading.notes, NOTHING, "{text}");
    }
    // What is unknown is passed, and told.
    let text = of(
        "property float z\n",
        "property float z\nproperty uchar scalar_Label_#1\nproperty list uchar int ring\n",
    )
    .replace(
        "element face 1\n",
        "element edge 2\nproperty int a\nproperty int b\nelement face 1\nproperty int flags\n",
    )
    .replace(
        "-4 -4 0\n4 -4 0\n0 4 0\n3 0 1 2\n",
        "-4 -4 0 7 2 1 1\n4 -4 0 7 0\n0 4 0 7 0\n1 2\n3 4\n9 3 0 1 2\n",
    );
    let reading = folder.take("a.ply", &text).unwrap();
    assert_eq!(first(&reading), TRIANGLE);
    told(
        &reading,
        &[
            "2 elements \"edge\"",
            "\"vertex\" these are not shown: scalar_Label_#1, ring",
            "\"face\" these are not shown: flags",
        ],
    );
    let strips = of(
        "element face 1\nproperty list uchar int vertex_indices",
        "element tristrips 1\nproperty list int int vertex_indices",
    )
    .replace("3 0 1 2\n", "8 0 1 2 0 -1 0 1 2\n");
    let reading = folder.take("a.ply", strips).unwrap();
    let (_, mesh) = meshes(&reading)[0];
    let outlines: Vec<&[u32]> = (0..mesh.face_count()).map(|at| mesh.outline(at)).collect();
    assert_eq!(outlines, [[0, 1, 2], [2, 1, 0], [0, 1, 2]].map(|o: [u32; 3]| o.to_vec()));
    for (text, said) in [
        (of("4 -4 0\n0", "4 x 0\n0"), "a.ply:11:3: \"x\" is not a number"),
        (of("4 -4 0\n0", "4 -4 0 1\n0"), "a.ply:11:8: more numbers than a \"vertex\" has"),
        (of("0 4 0\n", "0 nan 0\n"), "vertex 2 has a coordinate that is not finite"),
        (of("3 0 1 2", "3 0 1 3"), "face 0: corner 3 of a mesh with 3 vertices"),
        (of("3 0 1 2", "3 0 1 -2"), "-2 is no number of a vertex"),
        (of("3 0 1 2", "3 0 1"), "a.ply:14:1: a number is missing"),
        (of("3 0 1 2", "300 0 1 2"), "a list of 300 numbers, which are not there"),
        (of("vertex 3", "vertex 4000000000"), "a.ply:3:1: 4000000000 of \"vertex\" are announced"),
        (
            of("element face 1\n", "element face 0\n").replace("3 0 1 2\n", ""),
            "no faces: 3 points alone",
        ),
        (of("property float y\n", ""), "vertices have 2 of the numbers x, y and z"),
        (of("float y", "real y"), "a.ply:5:10: \"real\" where a type of numbers"),
        (of("end_header\n", ""), "is no line of a PLY's head"),
    ] {
        let error = folder.take("a.ply", text).unwrap_err();
        assert!(error.contains(said), "{said}: {error}");
    }
}

#[test]
fn colours_of_ply_are_those_of_its_numbers() {
    let folder = Folder::new("ply-colours");
    let file = |names: &str, of: &str, color: &str| {
        let properties: String =
            names.split(' ').map(|name| format!("property {of} {name}\n")).collect();
        let text = PLY.replace("property float z\n", &format!("property float z\n{properties}"));
        let vertex = |at: &str, text: String| text.replace(at, &format!("{} {color}\n", at.trim()));
        let text = vertex("-4 -4 0\n", text).replace("\n4 -4 0\n", &format!("\n4 -4 0 {color}\n"));
        vertex("0 4 0\n", text)
    };
    let byte = |value: f32| decode_srgb(value / 255.0);
    let bytes = [byte(255.0), byte(128.0), byte(64.0), 1.0];
    for (names, of, color, right) in [
        ("red green blue", "uchar", "255 128 64", bytes),
        ("r g b", "uchar", "255 128 64", bytes),
        ("diffuse_red diffuse_green diffuse_blue", "uchar", "255 128 64", bytes),
        ("red green blue", "ushort", "65535 32896 16448", bytes),
        ("red green blue", "float", "1 .5 .25", [1.0, 0.5, 0.25, 1.0]),
        ("red green blue", "float", "255 128 64", bytes),
        ("red green blue alpha", "uchar", "255 128 64 0", bytes),
        ("red green blue alpha", "float", "1 .5 .25 .5", [0.5, 0.25, 0.125, 0.5]),
    ] {
        folder.put("a.ply", file(names, of, color));
        let seen = folder.seen("a.ply");
        assert!(near(seen, right), "{names} {of} {color}: {seen:?}");
    }
    told(
        &folder.take("a.ply", file("red green blue", "float", "255 128 64")).unwrap(),
        &["bytes of sRGB"],
    );
    told(
        &folder.take("a.ply", file("red green blue alpha", "uchar", "9 9 9 0")).unwrap(),
        &["alpha of all vertices is 0"],
    );
}

#[test]
fn a_picture_of_ply_lies_as_its_corners_say() {
    let folder = Folder::new("ply-picture");
    let text = PLY
        .replace("element v", "comment TextureFile my wood.png\nelement v")
        .replace("vertex_indices\n", "vertex_indices\nproperty list uchar float texcoord\n")
        .replace("3 0 1 2\n", "3 0 1 2 6 0 0 1 0 .5 1\n");
    let reading = folder.take("a.ply", text).unwrap();
    let (_, mesh) = meshes(&reading)[0];
    let uvs: Vec<[f32; 2]> =
        mesh.outline(0).iter().map(|i| mesh.uvs[*i as usize].to_array()).collect();
    assert_eq!(
        (first(&reading), uvs),
        (TRIANGLE.to_vec(), vec![[0.0, 0.0], [1.0, 0.0], [0.5, 1.0]])
    );
    let maps = &reading.document.materials[&mesh.materials[0]].maps;
    assert_eq!(maps["color"].picture.file(), Some("my wood.png"));
}

#[test]
fn what_a_format_does_not_say_is_as_it_is_written_down() {
    let folder = Folder::new("defaults");
    let grey = [0.8, 0.8, 0.8, 1.0];
    let space = |name: &str| {
        let scene =
            read::scene(&folder.0.path().join(name), None, "s", &ReadOptions::default()).unwrap();
        let instance = &scene.instances[0];
        assert!(instance.geometry.mesh().normals.is_empty(), "{name} is flat");
        instance.world_from_object.transform_vector3(v(1.0, 2.0, 3.0))
    };
    folder.put("a.obj", OBJ).put("a.ply", PLY).put("a.stl", STL).put("a.ron", RON);
    assert_eq!(folder.seen("a.obj"), grey);
    assert_eq!(folder.seen("a.ply"), grey);
    assert_eq!(folder.seen("a.ron"), grey);
    for name in ["a.obj", "a.ply", "a.ron"] {
        assert_eq!(space(name), v(1.0, 2.0, 3.0), "{name}: metres, y up");
    }
    assert!((space("a.stl") - v(0.001, 0.003, -0.002)).length() < 1e-15, "millimetres, z up");
    let options = ReadOptions { up: Some(Axis::Y), unit: Some(1.0), ..ReadOptions::default() };
    let stl = read::scene(&folder.0.path().join("a.stl"), None, "s", &options).unwrap();
    let material = &stl.materials[stl.instances[0].material as usize];
    assert_eq!(*material, Material::default());
    assert_eq!(material.color, Color::grey(0.8));
    // A material that says nothing is white; one that is missing is as none.
    folder.put("m.mtl", "newmtl m\n").put("m.obj", format!("mtllib m.mtl\nusemtl m\n{OBJ}"));
    assert_eq!(folder.seen("m.obj"), [1.0; 4]);
    folder.put("n.obj", format!("usemtl m\n{OBJ}"));
    assert_eq!(folder.seen("n.obj"), grey);
}

#[test]
fn colours_by_vertex_show_as_the_file_has_them() {
    let folder = Folder::new("vertex-colours");
    let colored = |color: &str| OBJ.replace(" 0\n", &format!(" 0 {color}\n"));
    let right = [1.0, 0.5, 0.25, 1.0];
    folder.put("a.obj", colored("1 .5 .25"));
    assert!(near(folder.seen("a.obj"), right), "{:?}", folder.seen("a.obj"));
    folder.put("b.obj", format!("usemtl nothing\n{}", colored("1 .5 .25")));
    assert!(near(folder.seen("b.obj"), right), "a material that is not there");
    folder.put(
        "c.ron",
        RON.replace(
            "faces: [",
            "colors: [(1, .5, .25, 1), (1, .5, .25, 1), (1, .5, .25, 1)], faces: [",
        ),
    );
    assert!(near(folder.seen("c.ron"), right), "the own format");
    folder.put("m.mtl", "newmtl m\nKd .5 1 1\n");
    folder.put("d.obj", format!("mtllib m.mtl\nusemtl m\n{}", colored("1 .5 .25")));
    assert!(near(folder.seen("d.obj"), [0.5, 0.5, 0.25, 1.0]), "times the material's");
    folder.put("e.obj", colored("255 128 64"));
    assert!(near(
        folder.seen("e.obj"),
        [1.0, decode_srgb(128.0 / 255.0), decode_srgb(64.0 / 255.0), 1.0]
    ));
    told(&folder.read("e.obj").unwrap(), &["bytes of sRGB"]);
    // A weight is no colour, and one file may have both kinds of object.
    folder.put(
        "f.obj",
        format!(
            "o plain\n{OBJ}o colored\n{}f -3 -2 -1\n",
            colored("0 0 1").replace("f 1 2 3\n", "")
        ),
    );
    let scene =
        read::scene(&folder.0.path().join("f.obj"), None, "s", &ReadOptions::default()).unwrap();
    let colors: Vec<Color> =
        scene.instances.iter().map(|i| scene.materials[i.material as usize].color).collect();
    assert_eq!(colors, [Color::grey(0.8), Color::WHITE]);
    assert_eq!(folder.take("g.obj", OBJ.replace(" 0\n", " 0 1\n")).unwrap().notes, NOTHING);
}

#[test]
fn statements_of_obj_are_read_or_told() {
    let folder = Folder::new("obj");
    for text in [
        OBJ.replace("f 1 2 3", "f -3 -2 -1"),
        OBJ.replace("f 1 2 3", "f 1// 2// 3//"),
        OBJ.replace("f 1 2 3", "fo 1 \\\n 2 \\\n3"),
        OBJ.replace("f 1 2 3", "vn 0 0 1\nf 1//1 2//-1 3//1"),
        OBJ.replace("f 1 2 3", "vt 0 0\n f\t1/1\t2/1\t3/1 # done"),
        format!("# exported to C:\\models\\\n{OBJ}"),
        format!("s off\ng a b c\n{OBJ}"),
        OBJ.replace("v 4 -4 0", "v +4.0 -.4e1 0."),
    ] {
        let reading = folder.take("a.obj", &text).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert_eq!(first(&reading), TRIANGLE, "{text}");
        assert_eq!(reading.notes, NOTHING, "{text}");
    }
    let text = format!(
        "{OBJ}l 1 2\nl 2 3\np 1\ncstype bezier\ndeg 3\ncurv 0 1 1 2 3\nparm u 0 1\nend\ncall other.obj\n#MRGB ff0000\n\
         vt 0 0\nvn 0 0 1\nf 1/7 2/1 3/1\nf 1//9 2//1 3//1\ns 1\nf 3 2 1\n"
    );
    told(
        &folder.take("a.obj", text).unwrap(),
        &[
            "2 lines from line 5 on are not read",
            "1 points from line 7",
            "1 free-form curves and surfaces from line 10",
            "1 statements \"call\" from line 13",
            "1 lines of colours in comments (#MRGB) from line 14",
            "1 faces with texture coordinates that do not exist from line 17",
            "1 faces with normals that do not exist from line 18",
            "1 faces of smoothing groups without normals, shown flat from line 20",
        ],
    );
    // Of faces with and without normals each has its own.
    let text = format!("{OBJ}vn 1 0 0\nf 1//1 2//1 3//1\n");
    let reading = folder.take("a.obj", text).unwrap();
    let (_, mesh) = meshes(&reading)[0];
    let normals: Vec<_> =
        (0..2).map(|at| mesh.normals[mesh.outline(at)[0] as usize].to_array()).collect();
    assert_eq!(normals, [[0.0; 3], [1.0, 0.0, 0.0]]);
    for (text, said) in [
        (OBJ.replace("f 1 2 3", "f 1 2"), "a.obj:4:3: a face with 2 corners"),
        (OBJ.replace("f 1 2 3", "\\\nf 1 \\\n2 9"), "a.obj:6:3: vertex 9 does not exist"),
        (OBJ.replace("f 1 2 3", "f 0 1 2"), "a.obj:4:3: vertex 0 does not exist"),
        (OBJ.replace("f 1 2 3", "f 1/2/3/4 2 3"), "is not a corner such as 1/2/3"),
        (OBJ.replace("v 4 -4", "v 4,0 -4"), "a.obj:2:3: \"4,0\" is not a number: write a point"),
        ("l 1 2\n".to_owned(), "no faces"),
    ] {
        let error = folder.take("a.obj", text).unwrap_err();
        assert!(error.contains(said), "{said}: {error}");
    }
    let names = |text: &str| -> Vec<String> {
        let reading = folder.take("n.obj", text).unwrap();
        meshes(&reading).iter().map(|(name, _)| (*name).to_owned()).collect()
    };
    assert_eq!(names(&format!("o\ta b\n{OBJ}g x\nf 1 2 3\no a b\nf 1 2 3\n")), ["a b", "a b#2"]);
    assert_eq!(names(&format!("g x y\n{OBJ}g z # last\nf 1 2 3\n")), ["x y", "z"]);
}

#[test]
fn libraries_are_found_however_they_are_named() {
    let folder = Folder::new("libraries");
    let red = "newmtl red\nKd 1 0 0\n";
    folder.put("my town.mtl", red).put("a b.mtl", red).put("sub/c.mtl", red).put("d.mtl", red);
    folder.put("e.mtl", "newmtl other\n").put("no ending", red);
    let color = |line: &str| {
        let reading = folder.take("a.obj", format!("{line}\nusemtl red\n{OBJ}")).unwrap();
        assert_eq!(reading.notes, NOTHING, "{line}");
        reading.document.materials["red"].color
    };
    for line in [
        "mtllib my town.mtl",
        "mtllib \"my town.mtl\"",
        "mtllib a\\ b.mtl",
        "mtllib e.mtl my town.mtl",
        "mtllib my town.mtl e.mtl",
        "mtllib e.mtl\nmtllib d.mtl",
        "mtllib sub\\c.mtl",
        "mtllib C:\\models\\d.mtl",
        "mtllib no ending",
        "mtllib d.mtl # by hand",
    ] {
        assert_eq!(color(line), Color::new(1.0, 0.0, 0.0), "{line}");
    }
    let reading = folder
        .take("a.obj", format!("mtllib D.mtl lost.mtl\nusemtl x\n{OBJ}usemtl y\nf 1 2 3\n"))
        .unwrap();
    told(
        &reading,
        &[
            "D.mtl: No such file or directory: did you mean \"d.mtl\"?",
            "lost.mtl: No such",
            "2 materials are not defined, plain ones are used: x, y",
        ],
    );
    assert_eq!(reading.notes.len(), 3);
    // Names with a mark of comments in them, and comments behind names.
    let mtl = "newmtl #1\nKd 1 0 0\nnewmtl wood #2\nKd 0 1 0\nnewmtl wood #3\nKd 0 0 1\nnewmtl wall # of brick\n";
    folder.put("n.mtl", mtl);
    for (line, name) in [
        ("#1", "#1"),
        ("wood #2", "wood #2"),
        ("wood #3", "wood #3"),
        ("wall", "wall # of brick"),
        ("#1 # red", "#1"),
    ] {
        let reading = folder.take("a.obj", format!("mtllib n.mtl\nusemtl {line}\n{OBJ}")).unwrap();
        assert_eq!(meshes(&reading)[0].1.materials, [name], "{line}");
        assert_eq!(reading.notes, NOTHING, "{line}");
    }
}

/// The material of a library's text, and what is told of it.
fn material(folder: &Folder, text: &str) -> (Material, Vec<String>) {
    folder.put("m.mtl", format!("newmtl m\n{text}"));
    let reading = folder
        .take(
            "m.obj",
            format!("mtllib m.mtl\nusemtl m\nvt 0 0\n{}", OBJ.replace("f 1 2 3", "f 1/1 2/1 3/1")),
        )
        .unwrap();
    (reading.document.materials["m"].clone(), reading.notes)
}

#[test]
fn pictures_of_mtl_keep_their_files_and_options() {
    let folder = Folder::new("mtl-maps");
    folder.put("green wall.png", "").put("sub/deep.png", "");
    for (line, file) in [
        ("map_Kd -s 1 a.png", "a.png"),
        ("map_Kd -o 1 1 -t 0 0 -s 1 1 1 a b.png", "a b.png"),
        ("MAP_KD -blendu on -blendv on -cc off -clamp off -mm 0 1 a.png", "a.png"),
        ("map_Kd C:\\work\\green wall.png", "green wall.png"),
        ("map_Kd ./a.png", "./a.png"),
    ] {
        let (material, notes) = material(&folder, line);
        assert_eq!(material.maps["color"].picture.file(), Some(file), "{line}");
        assert_eq!(notes, NOTHING, "{line}");
    }
    let (one, notes) =
        material(&folder, "map_Kd -s 2 -o .5 .25 -mm 0 2 -t 1 a.png\nmap_Bump -bm 3 h.png");
    let mapping = &one.maps["color"].mapping;
    assert_eq!((mapping.scale, mapping.offset), (DVec2::new(2.0, 1.0), DVec2::new(0.5, 0.25)));
    assert_eq!(one.maps["bump"].strength, 0.03);
    assert!(notes[0].contains("-mm of map_Kd (\"m\"), -t of map_Kd (\"m\")"), "{notes:?}");
    // A library in a folder of its own names its pictures from there.
    folder.put("sub/m.mtl", "newmtl m\nmap_Kd deep.png\n");
    let reading = folder
        .take(
            "s.obj",
            format!(
                "mtllib sub/m.mtl\nusemtl m\nvt 0 0\n{}",
                OBJ.replace("f 1 2 3", "f 1/1 2/1 3/1")
            ),
        )
        .unwrap();
    assert_eq!(reading.document.materials["m"].maps["color"].picture.file(), Some("sub/deep.png"));
    // The alpha of the picture itself, or of another.
    let (same, _) = material(&folder, "map_Kd a.png\nmap_d a.png");
    assert_eq!((same.alpha_mode, same.maps.len()), (AlphaMode::Blend, 1));
    let (other, _) = material(&folder, "map_Kd a.png\nmap_d b.png");
    assert_eq!((other.alpha_mode, other.maps.len()), (AlphaMode::Blend, 2));
    let reading = folder.take("u.obj", format!("mtllib sub/m.mtl\nusemtl m\n{OBJ}")).unwrap();
    told(&reading, &["1 faces have a material with pictures, and no texture coordinates"]);
}

#[test]
fn what_mtl_says_is_shown_or_told() {
    let folder = Folder::new("mtl");
    let shown = |text: &str| {
        let (material, notes) = material(&folder, text);
        assert_eq!(notes, NOTHING, "{text}");
        material
    };
    assert!(shown("Kd 1 .5 .25\nillum 0").unlit);
    assert_eq!(shown("kd .5").color, Color::grey(0.5));
    assert_eq!(shown("d .25\nTr .75").alpha, 0.25);
    assert_eq!(shown("Tr .75").alpha, 0.25);
    assert_eq!(shown("Ks 1 1 1\nNs 100\nillum 1").finish.gloss, Gloss::None);
    let optics = |text: &str| shown(text).finish.optics.unwrap();
    let mirror = Optics {
        reflect: Color::grey(0.25),
        refract: Color::BLACK,
        index: 1.5,
        fresnel: false,
        absorb: Color::BLACK,
    };
    assert_eq!(optics("Ks .25 .25 .25\nillum 3"), mirror);
    assert_eq!(
        optics("Ks .25 .25 .25\nillum 5\nNi 1.33"),
        Optics { fresnel: true, index: 1.33, ..mirror }
    );
    let glass = optics("Tf .5 1 .5\nillum 7\nNi 1.33");
    assert_eq!(
        (glass.reflect, glass.refract, glass.index),
        (Color::WHITE, Color::new(0.5, 1.0, 0.5), 1.33)
    );
    let clear = optics("Ks .25 .25 .25\nillum 6\nNi 1.1");
    assert_eq!(
        (clear.reflect, clear.refract, clear.fresnel),
        (Color::grey(0.25), Color::grey(0.75), false)
    );
    let facets =
        |reflectance, roughness, metal| Gloss::Microfacets { reflectance, roughness, metal };
    assert_eq!(shown("Pr .3\nPm 1").finish.gloss, facets(0.04, 0.3, 1.0));
    let rough = shown("map_Pr r.png");
    assert_eq!(
        (rough.finish.gloss, rough.maps["metallic_roughness"].picture.file()),
        (facets(0.04, 1.0, 0.0), Some("r.png"))
    );
    assert_eq!(shown("map_Pr r.png\nmap_Pm r.png").finish.gloss, facets(0.04, 1.0, 1.0));
    assert_eq!(shown("norm n.png").maps["normal"].picture.file(), Some("n.png"));
    assert_eq!(shown("Ka 1 1 1\nKs 0 0 0\nPs 0\nTf 1 1 1\nNi 1\nillum 2"), shown(""));
    for (line, said) in [
        ("Ka .1 0 0", "Ka (\"m\")"),
        ("Ni 1.5", "Ni (\"m\")"),
        ("Tf 1 0 0", "Tf (\"m\")"),
        ("Ks .5 .5 .5", "Ks without Ns"),
        ("Ks .5 0 0\nNs 9", "the colour of Ks"),
        ("illum 10", "illum 10"),
        ("refl -type sphere sky.png", "refl (\"m\")"),
        ("map_Ks s.png", "map_Ks"),
        ("map_Ns s.png", "map_Ns"),
        ("map_Ka s.png", "map_Ka"),
        ("map_Pm s.png", "map_Pm without the same map_Pr"),
        ("disp d.png", "disp"),
        ("decal d.png", "decal"),
        ("Pc .5", "Pc"),
        ("sharpness 60", "sharpness"),
        ("map_Kd", "map_Kd without a file"),
        ("Kd spectral a.rfl 1", "Kd spectral"),
        ("d -halo .5", "d -halo"),
        ("d 1\nTr 1", "Tr, which contradicts d"),
        ("Kd 1 1 1\nd 0", "with a d of 0"),
        ("newmtl m", "an earlier material of the same name"),
    ] {
        let (_, notes) = material(&folder, line);
        assert!(notes.len() == 1 && notes[0].contains(said), "{line}: {notes:?}");
    }
    folder.put("m.mtl", "Kd 1 0 0\nnewmtl m\nNi 2\nnewmtl n\nNi 3\nrefl x\n");
    let reading = folder.take("m.obj", format!("mtllib m.mtl\n{OBJ}")).unwrap();
    told(
        &reading,
        &["Kd before the first newmtl, Ni (2 materials, the first \"m\"), refl (\"n\")"],
    );
}

#[test]
fn the_highlight_of_mtl_is_ks_in_its_middle_and_half_as_bright_where_the_format_says() {
    let folder = Folder::new("mtl-highlight");
    folder.put("m.mtl", "newmtl m\nKd .25 .25 .25\nKs .5 .5 .5\nNs 80\nillum 2\n");
    // Seen from far in front, so that the eye is straight ahead.
    folder.put("m.obj", format!("mtllib m.mtl\nusemtl m\n{OBJ}"));
    let lit = |degrees: f64| {
        let angle = degrees.to_radians();
        let toward = v(spandrel_engine::math::sin(angle), 0.0, spandrel_engine::math::cos(angle));
        // As much light falls on the face from everywhere.
        let lamp = sun(-toward, Color::grey(1.0 / toward.z as f32));
        let shader = illuminate(vec![lamp], Color::BLACK, Color::BLACK);
        let image =
            folder.image("m.obj").shaded(Arc::new(Illuminate { white: 1.0, ..shader })).unwrap();
        f64::from(middle(&image)[0])
    };
    assert!((lit(0.0) - 0.75).abs() < 0.01, "{}", lit(0.0));
    // cos^80 of half the angle is a half at 2 acos(0.5^(1/80)), 15.1 degrees.
    let half = lit(15.076) - 0.25;
    assert!((half - 0.25).abs() < 0.02, "{half}");
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
