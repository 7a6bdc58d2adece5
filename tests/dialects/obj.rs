//! OBJ, its libraries, and what the formats do not say.

use super::*;

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
            "2 lines are not shown, the first in line 5",
            "1 points are not shown, the first in line 7",
            "1 free-form curves and surfaces are not shown, the first in line 10",
            "1 statements \"call\" are not read, the first in line 13",
            "1 lines of colours in comments (#MRGB) are not read, the first in line 14",
            "1 faces use texture coordinates that do not exist, which are left out, the first in line 17",
            "1 faces use normals that do not exist, which are left out, the first in line 18",
            "1 faces of smoothing groups have no normals and are shown flat (`crease` smooths them), the first in line 20",
        ],
    );
    let text = OBJ
        .replace("f 1", "vt nan 1\nvn -nan(ind) 1.#QNAN nan\nf 1")
        .replace("1 2 3", "1/1/1 2/1/1 3/1/1");
    let reading = folder.take("a.obj", text).unwrap();
    let (_, mesh) = meshes(&reading)[0];
    assert_eq!((mesh.uvs[0].to_array(), mesh.normals[0].to_array()), ([0.0; 2], [0.0; 3]));
    told(
        &reading,
        &[
            "1 texture coordinates are not finite, and 0, the first in line 4",
            "1 normals are not finite: their faces are flat, the first in line 5",
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
    let text = format!("mtllib D.mtl lost.mtl\nusemtl x\n{OBJ}usemtl y\nf 1 2 3\n");
    let reading = folder.take("a.obj", &text).unwrap();
    let said = [
        "D.mtl: No such file or directory: did you mean \"d.mtl\"?: put it there, or read the scene with \
         `pictures: false`",
        "lost.mtl: No such",
        "2 materials are not defined, plain ones are used: x, y",
    ];
    told(&reading, &said);
    assert_eq!(reading.notes.len(), 3);
    // The cure cures.
    let path = folder.0.path().join("a.obj");
    let bare = ReadOptions { pictures: Some(false), ..ReadOptions::default() };
    assert_eq!(read::document(&path, &bare).unwrap().notes, NOTHING);
    // What is called the same is no library.
    let reading = folder.take("lost.obj", format!("mtllib lost.mtl\n{OBJ}")).unwrap();
    assert!(!reading.notes[0].contains("did you mean"), "{:?}", reading.notes);
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
