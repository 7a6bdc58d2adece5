//! Parameters of scenes: who gives them, and what is wrong with them.

use spandrel_engine::graph::demand::Wishes;
use spandrel_engine::graph::{Run, Schedule};

use super::films::{BOARD, computed, evaluate, folder, graph, moves_right, nodes};

/// What a graph's user sets reaches into scenes, and those that they name.
#[test]
fn scenes_take_values_of_the_graph() {
    let scratch = folder("films-parameters");
    let moving = BOARD.replace(
        "Scene(\n    materials: {\"white\": (color: \"#fff\", unlit: true)}",
        "Scene(
            parameters: {\"place\": 7, \"twice\": Expr(\"place * 2\"), \"paint\": (color: \"#fff\", unlit: true)},
            materials: {\"white\": Ref(\"paint\")}",
    );
    let moving = moving.replace(
        "root: (material",
        "root: (transform: [Move(Expr(\"twice / 2\"), 0, 0)], material",
    );
    std::fs::write(scratch.path().join("moving.ron"), &moving).unwrap();
    let around = "Scene(parameters: {\"place\": 3}, plans: [(name: \"p\", root: (children: [(name: \"it\", \
                  shape: File(path: \"moving.ron\", parameters: {\"place\": Ref(\"place\")}))]))])";
    std::fs::write(scratch.path().join("around.ron"), around).unwrap();
    let film = |scene: &str, given: &str| {
        let board = nodes("0", "").replacen("board.ron", "scene", 1);
        format!(
            "Graph(parameters: {{\"x\": Number(default: Curve([(1, 0), (5, 2)], Linear))}}, nodes: {{
                \"scene\": ReadScene(file: \"{scene}\", parameters: {{{given}}}), {board}
            }})"
        )
    };
    for scene in ["moving.ron", "around.ron"] {
        let film = graph(scratch.path(), &film(scene, "\"place\": Ref(\"x\")"), "1-5");
        [1, 4].iter().for_each(|frame| moves_right(&film, scratch.path(), *frame));
        // The scene is read again where its parameter is another, and only there.
        let counts = evaluate(&Run::new(), &film, "both", &[1.0, 2.0]);
        assert_eq!(computed(&counts)["scene"], 2);
    }
    let still = graph(scratch.path(), &film("moving.ron", "\"place\": 1"), "1-5");
    assert_eq!(computed(&evaluate(&Run::new(), &still, "both", &[1.0, 2.0]))["scene"], 1);
    let told = |scene: &str, given: &str| {
        let film = graph(scratch.path(), &film(scene, given), "1");
        let mut wishes = Wishes::new();
        wishes.want::<spandrel_engine::scene::Scene>("scene", ());
        let schedule = Schedule::new(&film, &wishes).unwrap();
        let Err(failure) = Run::new().evaluate(&film, &schedule, &()) else { panic!("{given}") };
        failure.to_string()
    };
    let unknown = told("moving.ron", "\"plaice\": 1");
    assert!(unknown.contains("did you mean \"place\"?") && unknown.contains("moving.ron"));
    assert!(told("board.ron", "\"place\": 1").contains("no parameter \"place\": it has none"));
    let circle = moving.replace("\"place\": 7", "\"place\": Expr(\"twice\")");
    std::fs::write(scratch.path().join("circle.ron"), circle).unwrap();
    let circle = told("circle.ron", "");
    assert!(circle.contains("\"twice\" uses \"place\" uses \"twice\""), "{circle}");
    let wrong = told("moving.ron", "\"place\": \"there\"");
    assert!(wrong.contains("\"place\" is \"there\", no number or vector"), "{wrong}");
    std::fs::write(scratch.path().join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    assert!(told("a.obj", "\"place\": 1").contains("only scenes in RON have parameters"));
}
