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
