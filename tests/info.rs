//! What `info` lists of a scene, and what `check` finds in the scenes of a graph.

use spandrel_tests::program::{Ran, Scratch, run};

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

struct Folder(Scratch);

impl Folder {
    fn new(name: &str) -> Folder {
        Folder(Scratch::new(name))
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.0.path().join(name), text).unwrap();
    }

    fn run(&self, arguments: &[&str]) -> Ran {
        run(PROGRAM, arguments, self.0.path())
    }
}

#[test]
fn info_lists_objects_and_materials_by_the_names_that_programs_take() {
    let folder = Folder::new("info-tree");
    folder.write(
        "yard.ron",
        "Scene(
  materials: {\"brick\": (color: 0.5), \"glass\": (color: 0.1), \"gold\": (color: 0.9)},
  plans: [(name: \"p\", definitions: {\"post\": (material: \"brick\", shape: Box(size: (1, 1, 1)))}, root: (children: [
    (name: \"house\", material: \"glass\", children: [
      (name: \"roof\", shape: Polygon(outline: [(0, 3, 0), (4, 3, 0), (4, 3, 4)])),
      (name: \"walls\", material: \"brick\", shape: Box(size: (4, 3, 4))),
    ]),
    (name: \"fence\", shape: Array(of: (shape: Instance(\"post\")), count: (5, 1, 1), step: (2, 0, 0))),
    (name: \"plain\", shape: Box(size: (1, 1, 1))),
  ]))])",
    );
    let ran = folder.run(&["info", "yard.ron"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    for lines in [
        "    house: 7 faces\n      roof: 1 face\n      walls: 6 faces\n    fence[*]: 30 faces, 5 times\n    plain: 6 faces\n",
        "\"brick\": color (0.500, 0.500, 0.500); 36 faces\n",
        "\"glass\": color (0.100, 0.100, 0.100); 1 face\n",
        "\"gold\": color (0.900, 0.900, 0.900); on no face\n",
        "without a material: 6 faces\n",
    ] {
        assert!(ran.out.contains(lines), "{lines}\n{}", ran.out);
    }
    // What is listed is what a program names: the pattern of the fence fits all of its places and nothing else.
    assert!(spandrel_engine::text::names_object("fence[*]", "yard.ron/fence[3]"));
    assert!(!spandrel_engine::text::names_object("fence[*]", "yard.ron/plain"));
}

#[test]
fn long_lists_are_cut_with_the_count_unless_all_is_asked_for() {
    let folder = Folder::new("info-long");
    let materials: String = (0..90).map(|k| format!("\"m{k:02}\": (), ")).collect();
    let parts: String =
        (0..7).map(|k| format!("(name: \"part {k}\", shape: Box(size: (1, 1, 1))), ")).collect();
    let objects: String =
        (0..40).map(|k| format!("(name: \"house {k}\", children: [{parts}]), ")).collect();
    folder.write(
        "long.ron",
        &format!(
            "Scene(materials: {{{materials}}}, plans: [(name: \"p\", root: (children: [{objects}]))])"
        ),
    );
    let ran = folder.run(&["info", "long.ron"]);
    assert!(ran.out.lines().count() < 100, "{}", ran.out);
    assert!(ran.out.contains("    house 0: 42 faces, 7 objects in it\n"), "{}", ran.out);
    assert!(ran.out.contains("    and 28 more, 1 176 faces (--all lists them)\n"), "{}", ran.out);
    assert!(ran.out.contains("  and 30 more (--all lists them)\n"), "{}", ran.out);
    let all = folder.run(&["info", "long.ron", "--all"]);
    assert!(all.out.contains("    house 39: 42 faces\n      part 0: 6 faces\n"), "{}", all.out);
    assert!(all.out.contains("\"m89\"") && !all.out.contains("more"), "{}", all.out);
}

#[test]
fn check_finds_what_is_wrong_in_the_scenes_of_a_graph() {
    let folder = Folder::new("check-scenes");
    let scene = |material: &str| {
        format!(
            "Scene(\n  materials: {{\"brick\": ()}},\n  plans: [(name: \"p\", root: (\n    material: \"{material}\",\n    shape: Box(size: (1, 1, 1)),\n  ))])"
        )
    };
    let graph =
        "Graph(nodes: {\"eye\": Camera(), \"a\": Scanline(scene: \"a.ron\", camera: \"eye\"),
        \"r\": ReadScene(file: \"b.ron\"), \"b\": Scanline(scene: \"r\", camera: \"eye\")})";
    folder.write("g.ron", graph);
    folder.write("a.ron", &scene("brick"));
    folder.write("b.ron", &scene("brick"));
    let sound = folder.run(&["check", "g.ron"]);
    assert_eq!((sound.code, sound.err.as_str()), (Some(0), ""), "{sound:?}");
    // Both scenes, each with its line and the cure, as a graph has them.
    folder.write("a.ron", &scene("brik"));
    folder.write("b.ron", &scene("bricks"));
    let ran = folder.run(&["check", "g.ron"]);
    assert_eq!(ran.code, Some(4), "{ran:?}");
    for words in [
        "a.ron:4:15",
        "b.ron:4:15",
        "there is no material \"brik\"",
        "did you mean \"brick\"?",
        "^^^^",
    ] {
        assert!(ran.err.contains(words), "{words}: {}", ran.err);
    }
    for command in ["info", "convert"] {
        let to: &[&str] = if command == "convert" { &["a.scene"] } else { &[] };
        let ran = folder.run(&[&[command, "a.ron"], to].concat());
        assert_eq!(ran.code, Some(4), "{ran:?}");
        assert!(ran.err.contains("a.ron:4:15") && ran.err.contains("^^^^"), "{ran:?}");
    }
}

#[test]
fn check_and_info_find_pictures_and_libraries_before_a_render_does() {
    let folder = Folder::new("check-pictures");
    let scene = |picture: &str, fields: &str| {
        format!(
            "Scene(materials: {{\"sign\": (color: 1, {fields} maps: {{\"color\": (picture: File(\"{picture}\"))}})}},
            plans: [(name: \"p\", root: (material: \"sign\", shape: Box(size: (1, 1, 1))))])"
        )
    };
    let graph = |file: &str, fields: &str| {
        let text = format!(
            "Graph(nodes: {{\"eye\": Camera(position: (0, 0, 5)), \"r\": ReadScene(file: \"{file}\"{fields}),
            \"s\": Scanline(scene: \"r\", camera: \"eye\"),
            \"p\": Resolve(image: \"s\", size: (8, 8)), \"w\": Write(image: \"p\", path: \"p.png\")}})"
        );
        folder.write("g.ron", &text);
        folder.run(&["check", "g.ron"])
    };
    folder.write("broken.png", "\u{89}PNG\r\n");
    folder.write("gone.ron", &scene("gone.png", ""));
    folder.write("broken.ron", &scene("broken.png", ""));
    folder.write("a.obj", "mtllib gone.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    // One cure for all.
    let cure = "put it there, or read the scene with `pictures: false`";
    for (file, words) in [
        ("gone.ron", "material \"sign\", color: there is no file"),
        ("broken.ron", "material \"sign\", color: "),
        ("a.obj", "library of materials: "),
    ] {
        let named = if file == "broken.ron" { "broken.png" } else { "gone." };
        let is_told = |text: &str| {
            let is_in = |line: &str| line.contains(words) && line.contains(named);
            text.lines().any(|line| is_in(line) && line.contains(cure))
        };
        let checked = graph(file, "");
        assert!(checked.code == Some(0) && is_told(&checked.err), "{checked:?}");
        let listed = folder.run(&["info", file]);
        assert!(listed.code == Some(0) && is_told(&listed.out), "{listed:?}");
        let denied = folder.run(&["check", "g.ron", "--deny-warnings"]);
        assert_eq!(denied.code, Some(1), "{denied:?}");
        // What surfaces look like is asked for: a picture of the shapes alone would be wrong without a word.
        let rendered = folder.run(&["render", "g.ron", "-q"]);
        assert_eq!(rendered.code, Some(4), "{rendered:?}");
        assert!(rendered.err.contains(cure) && !folder.0.path().join("p.png").exists());
        let cured = graph(file, ", pictures: false");
        assert_eq!((cured.code, cured.err.as_str()), (Some(0), ""), "{file}");
        let rendered = folder.run(&["render", "g.ron", "-q"]);
        assert_eq!((rendered.code, rendered.err.as_str()), (Some(0), ""), "{file}");
        std::fs::remove_file(folder.0.path().join("p.png")).unwrap();
    }
    // A library that no surface needs is not missed.
    folder.write("b.obj", "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    graph("b.obj", "");
    assert_eq!(folder.run(&["render", "g.ron", "-q"]).code, Some(0));
}

#[test]
fn surfaces_send_back_no_more_than_they_receive_without_a_word() {
    let folder = Folder::new("bright");
    let checked = |material: &str| {
        let scene = format!(
            "Scene(materials: {{\"m\": ({material})}}, plans: [(name: \"p\", root: (material: \"m\", shape: Box(size: (1, 1, 1))))])"
        );
        folder.write("a.ron", &scene);
        folder.write(
            "g.ron",
            "Graph(nodes: {\"eye\": Camera(), \"s\": Scanline(scene: \"a.ron\", camera: \"eye\")})",
        );
        folder.run(&["check", "g.ron"]).err
    };
    let said = checked("color: (1.5, 0.2, 0.2)");
    assert!(said.contains("material \"m\": the colour (1.5, 0.2, 0.2) sends back more"), "{said}");
    assert_eq!(checked("color: (1, 1, 1)"), "");
    assert_eq!(checked("color: (9, 8, 7), unlit: true"), "");
}

#[test]
fn info_tells_where_the_sun_stands_and_what_is_around() {
    let folder = Folder::new("info-lights");
    // At the June solstice, at noon over the tropic, the sun is at the zenith.
    let sun = "SunLight(latitude: 23.44, longitude: 0, time: \"2026-06-21T12:02:00Z\", illuminance: 90000)";
    let scene = format!(
        "Scene(plans: [(name: \"p\", environment: (ambient: (0.1, 0.2, 0.3), fog: 0.004, overcast: 0.25, shadows: false),
        lights: {{\"day\": {sun}, \"sky\": SkyLight(sun: \"day\", illuminance: 5), \"lamp\": PointLight(position: (1, 2, 3), on: false)}})])"
    );
    folder.write("a.ron", &scene);
    let ran = folder.run(&["info", "a.ron"]);
    for words in [
        "\"day\": SunLight from direction (",
        " 1.000, ",
        "degrees high, 90000 lux\n",
        "\"sky\": SkyLight a sky whose sun is in direction (",
        "\"lamp\": PointLight at (1.000, 2.000, 3.000), gives no light\n",
        "environment: ambient (0.1, 0.2, 0.3), background (0, 0, 0), fog 0.004 per metre, overcast 0.25, no shadows\n",
    ] {
        assert!(ran.out.contains(words), "{words}\n{}", ran.out);
    }
    folder.write("g.ron", &format!("Graph(nodes: {{\"day\": {sun}}})"));
    let ran = folder.run(&["info", "g.ron"]);
    let up = ran.out.split(" degrees high").next().unwrap().rsplit(' ').next().unwrap();
    assert!(up.parse::<f64>().unwrap() > 89.8, "{}", ran.out);
    // In a list too, a sky follows only what is a sun.
    folder.write("b.ron", &scene.replace("sun: \"day\"", "sun: \"lamp\""));
    let ran = folder.run(&["info", "b.ron"]);
    assert!(ran.err.contains("light \"sky\": `sun`: \"lamp\" is no SunLight"), "{ran:?}");
    folder.write("b.ron", &scene.replace("sun: \"day\"", "sun: \"dai\""));
    assert!(folder.run(&["info", "b.ron"]).err.contains("the list has no light \"dai\""));
}

#[test]
fn check_finds_names_that_a_scene_does_not_have() {
    let folder = Folder::new("check-names");
    folder.write(
        "a.ron",
        "Scene(plans: [(name: \"p\", cameras: {\"front\": ()}, lights: {\"day\": SunLight()})])",
    );
    let checked = |nodes: &str| {
        let text = format!("Graph(nodes: {{\"r\": ReadScene(file: \"a.ron\"), {nodes}}})");
        folder.write("g.ron", &text);
        folder.run(&["check", "g.ron"])
    };
    for (node, word) in [
        ("\"c\": SceneCamera(scene: \"r\", name: \"zzz\")", "zzz"),
        ("\"l\": SceneLights(scene: \"r\", names: [\"yyy\"])", "yyy"),
    ] {
        let ran = checked(node);
        assert!(ran.code != Some(0) && ran.err.contains(word), "{ran:?}");
    }
    let both = "\"c\": SceneCamera(scene: \"r\", name: \"front\"), \"l\": SceneLights(scene: \"r\", names: [\"day\"])";
    assert_eq!(checked(both).code, Some(0));
    // What is wrong with a scene is said once, whoever uses it.
    folder.write("a.ron", "Scene(plans: 3)");
    let ran = checked(both);
    assert_eq!(ran.err.matches("a.ron:1:").count(), 2, "{}", ran.err);
}

#[test]
fn info_tells_what_is_bent_whatever_its_shape() {
    let folder = Folder::new("info-bent");
    let told = |shape: &str| {
        let text = format!(
            "Scene(materials: {{\"m\": ()}}, plans: [(name: \"p\", root: (material: \"m\", shape: {shape}))])"
        );
        folder.write("a.ron", &text);
        folder.run(&["info", "a.ron"]).out
    };
    let quad = "(0, 0, 0), (4, 0, 0), (4, 3, 0.5), (0, 3, 0)";
    let points = "points: [(0, 0, 0), (4, 0, 0), (4, 3, 0.5), (0, 3, 0)]";
    for (shape, words) in [
        (format!("Polygon(outline: [{quad}])"), "divided into triangles"),
        (format!("Faces({points}, faces: [(outline: [0, 1, 2, 3])])"), "divided into triangles"),
        (
            format!(
                "Faces({points}, faces: [(outline: [0, 1, 2, 3], edge: (width: 1, color: \"#fff\"))])"
            ),
            "is taken as flat",
        ),
        (
            format!(
                "Polygon(outline: [{quad}], seals: [(outline: [(1, 1, 0), (2, 1, 0), (2, 2, 0)], material: \"m\")])"
            ),
            "is taken as flat",
        ),
        ("Polygon(outline: [(0, 0, 0), (4, 4, 0), (4, 0, 0), (0, 4, 0.0)])".to_owned(), "crosses"),
        ("Prism(outline: [(0, 0), (4, 0), (4, 4), (1, -1)], height: 1)".to_owned(), "crosses"),
    ] {
        let out = told(&shape);
        assert!(out.contains(words), "{shape}\n{out}");
        let other = if words.contains("flat") { "divided into" } else { "taken as flat" };
        assert!(!out.contains(other), "{shape}\n{out}");
    }
    let flat = format!("Polygon(outline: [{}])", quad.replace("0.5", "0"));
    let out = told(&flat);
    assert!(!out.contains("divided") && !out.contains("flat") && !out.contains("cross"), "{out}");
}
