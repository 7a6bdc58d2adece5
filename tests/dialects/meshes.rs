//! STL and PLY as programs write them.

use super::*;

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
