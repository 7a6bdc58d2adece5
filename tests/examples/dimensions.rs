//! How time grows with every dimension of the input: corners and holes of a face, faces, objects, sources,
//! translucent layers, lights, materials, nodes.
//!
//! `cargo run --release -p spandrel-tests --example dimensions [-- NAME ..]`
//!
//! Each is quadrupled three times over while all else stays. What is measured is whole renders by the command
//! line, 480x270, `Sloped(8)`; the growth is the power of the size with which the time grows between the last
//! two: 1 is in proportion, 2 quadratic.

use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

/// A dimension: its name, its smallest size, and what writes an input of a size into a folder.
type Dimension = (&'static str, usize, fn(usize) -> Input);

/// The files of an input.
struct Input {
    scenes: Vec<String>,
    /// Nodes between the scenes "s0", "s1", .. and the image "last".
    nodes: String,
    lines: &'static str,
}

const DIMENSIONS: [Dimension; 19] = [
    ("corners of a face", 625, |n| resolved(polygon(&star(n, 4.0), &[], &[]))),
    ("corners, `Exact`", 156, |n| Input {
        lines: "Exact",
        ..resolved(polygon(&star(n, 4.0), &[], &[]))
    }),
    ("corners, `Volumes`", 156, |n| lit(polygon(&star(n, 4.0), &[], &[]), "Volumes")),
    ("corners, `Rays(1)`", 156, |n| lit(polygon(&star(n, 4.0), &[], &[]), "Rays(1)")),
    ("holes of a face", 156, |n| resolved(polygon(&square(4.0), &holes(n), &[]))),
    ("holes, `Volumes`", 39, |n| lit(polygon(&square(4.0), &holes(n), &[]), "Volumes")),
    ("seals of a face", 156, |n| resolved(polygon(&square(4.0), &[], &holes(n)))),
    ("faces of an object", 2_500, |n| resolved(field(n))),
    ("objects", 625, |n| resolved(boxes(n, |_| "w".to_owned()))),
    ("objects, `Volumes`", 156, |n| lit(boxes(n, |_| "w".to_owned()), "Volumes")),
    ("materials", 625, |n| Input {
        scenes: vec![with_materials(n, &boxes(n, |i| format!("m{i}")))],
        ..resolved(String::new())
    }),
    ("faces of an OBJ", 2_500, |n| resolved(obj(n))),
    ("faces of a text PLY", 2_500, |n| resolved(ply(n))),
    ("faces of a text STL", 2_500, |n| resolved(stl(n))),
    ("sources", 16, sources),
    ("translucent layers", 8, |n| resolved(panes(n))),
    ("lights", 16, lights),
    ("nodes", 40, chain),
    ("nodes that nothing reads", 625, lonely),
];

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let folder = std::env::temp_dir().join(format!("spandrel-dimensions-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder can be made");
    println!("| | sizes | seconds | growth |\n|---|---|---|---|");
    for (name, least, input) in DIMENSIONS {
        if !wanted.is_empty() && !wanted.iter().any(|part| name.contains(part.as_str())) {
            continue;
        }
        let sizes = [least, least * 4, least * 16, least * 64];
        let times = sizes.map(|size| measure(&folder, &input(size)));
        let growth = (times[3] / times[2]).log10() / 4f64.log10();
        let list = |all: [String; 4]| all.join(", ");
        println!(
            "| {name} | {} | {} | {growth:.2} |",
            list(sizes.map(|size| size.to_string())),
            list(times.map(|time| format!("{time:.3}")))
        );
    }
    let _ = std::fs::remove_dir_all(&folder);
}

/// The time in seconds of a render, the better of two.
fn measure(folder: &Path, input: &Input) -> f64 {
    let mut graph = String::from("Graph(version: 1, nodes: {\n");
    graph += "\"eye\": Camera(position: (0, 0, 10), look_at: (0, 0, 0)),\n";
    for (i, scene) in input.scenes.iter().enumerate() {
        std::fs::write(folder.join(format!("s{i}.ron")), scene).expect("a scene can be written");
        let _ = writeln!(graph, "\"s{i}\": Scanline(scene: \"s{i}.ron\", camera: \"eye\"),");
    }
    graph += &input.nodes;
    let _ = writeln!(
        graph,
        "\"picture\": Resolve(image: \"last\", size: (480, 270), lines: {}),\n\
         \"file\": Write(image: \"picture\", path: \"out.exr\"),\n}})",
        input.lines
    );
    std::fs::write(folder.join("g.ron"), graph).expect("a graph can be written");
    let run = || {
        let clock = Instant::now();
        let program = std::env::current_exe().expect("this program is a file");
        // Built beside the examples.
        let program = program.parent().and_then(Path::parent).expect("it lies in a folder");
        let status = std::process::Command::new(program.join("spandrel-under-test"))
            .args(["render", "g.ron", "-q"])
            .current_dir(folder)
            // That a file is of another format than it is named is told.
            .stderr(std::process::Stdio::null())
            .status()
            .expect("the program can be run: build it with `cargo build --release --workspace`");
        assert!(status.success(), "it renders");
        clock.elapsed().as_secs_f64()
    };
    let first = run();
    if first > 5.0 { first } else { first.min(run()) }
}

/// The corners of triangles beside each other; a file is known by its first bytes, whatever its name.
fn triangles(count: usize) -> impl Iterator<Item = [[f64; 2]; 3]> {
    let side = (count as f64).sqrt().ceil();
    let at = move |v: f64| v / side * 8.0 - 4.0;
    (0..count).map(move |i| {
        let (x, y) = ((i as f64 % side).floor(), (i as f64 / side).floor());
        [[at(x), at(y)], [at(x + 0.9), at(y)], [at(x), at(y + 0.9)]]
    })
}

fn obj(count: usize) -> String {
    let mut text = String::new();
    for (i, corners) in triangles(count).enumerate() {
        corners.iter().for_each(|[x, y]| {
            let _ = writeln!(text, "v {x} {y} 0");
        });
        let _ = writeln!(text, "f {} {} {}", 3 * i + 1, 3 * i + 2, 3 * i + 3);
    }
    text
}

fn ply(count: usize) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {count}\nproperty list uchar int vertex_indices\nend_header\n",
        3 * count
    );
    for [x, y] in triangles(count).flatten() {
        let _ = writeln!(text, "{x} {y} 0");
    }
    for i in 0..count {
        let _ = writeln!(text, "3 {} {} {}", 3 * i, 3 * i + 1, 3 * i + 2);
    }
    text
}

fn stl(count: usize) -> String {
    let mut text = "solid field\n".to_owned();
    for corners in triangles(count) {
        text += "facet normal 0 0 1\nouter loop\n";
        for [x, y] in corners {
            // The format's unit is a millimetre, and z is up.
            let _ = writeln!(text, "vertex {} 0 {}", x * 1e3, y * 1e3);
        }
        text += "endloop\nendfacet\n";
    }
    text + "endsolid field\n"
}

fn resolved(scene: String) -> Input {
    let nodes = "\"last\": DepthMerge(inputs: [\"s0\"]),\n".to_owned();
    Input { scenes: vec![scene], nodes, lines: "Sloped(8)" }
}

fn lit(scene: String, shadows: &str) -> Input {
    let floor = scene_of(
        "(name: \"wall\", material: \"w\", shape: Polygon(outline: \
        [(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)]))",
    );
    let nodes = format!(
        "\"both\": DepthMerge(inputs: [\"s0\", \"s1\"]),\n\
         \"sun\": ParallelLight(direction: (-0.3, -0.2, -1)),\n\
         \"last\": Illuminate(image: \"both\", lights: [\"sun\"], shadows: {shadows}),\n"
    );
    Input { scenes: vec![scene, floor], nodes, lines: "Sloped(8)" }
}

fn scene_of(objects: &str) -> String {
    with_materials(0, objects)
}

fn with_materials(count: usize, objects: &str) -> String {
    if objects.starts_with("Scene") {
        return objects.replace("\"w\": (color: 1)", &materials(count));
    }
    format!(
        "Scene(version: 1, materials: {{\"w\": (color: 1), \"g\": (color: (0, 0, 1), alpha: 0.1, \
         alpha_mode: Blend)}}, plans: [(name: \"p\", root: (children: [{objects}]))])"
    )
}

fn materials(count: usize) -> String {
    let each = (0..count).map(|i| format!("\"m{i}\": (color: {})", i as f64 / count as f64));
    each.chain(["\"w\": (color: 1)".to_owned()]).collect::<Vec<_>>().join(", ")
}

type Ring = Vec<(f64, f64)>;

fn points(ring: &Ring) -> String {
    let each = ring.iter().map(|(x, y)| format!("({x:.6}, {y:.6}, 0)"));
    format!("[{}]", each.collect::<Vec<_>>().join(", "))
}

fn polygon(outline: &Ring, holes: &[Ring], seals: &[Ring]) -> String {
    let list = |rings: &[Ring]| rings.iter().map(points).collect::<Vec<_>>().join(", ");
    let seals = seals.iter().map(|ring| format!("(outline: {}, material: \"w\")", points(ring)));
    scene_of(&format!(
        "(name: \"face\", material: \"w\", shape: Polygon(outline: {}, holes: [{}], seals: [{}]))",
        points(outline),
        list(holes),
        seals.collect::<Vec<_>>().join(", ")
    ))
}

/// A circle whose radius goes up and down from corner to corner.
fn star(corners: usize, radius: f64) -> Ring {
    let at = |i: usize| {
        let angle = i as f64 / corners as f64 * std::f64::consts::TAU;
        let r = radius * if i.is_multiple_of(2) { 0.85 } else { 0.65 };
        (r * spandrel_engine::math::cos(angle), r * spandrel_engine::math::sin(angle))
    };
    (0..corners).map(at).collect()
}

fn square(half: f64) -> Ring {
    vec![(-half, -half), (half, -half), (half, half), (-half, half)]
}

/// Squares in rows, turned a little.
fn holes(count: usize) -> Vec<Ring> {
    let side = (count as f64).sqrt().ceil() as usize;
    let step = 7.6 / side as f64;
    let of = |i: usize| {
        let (x, y) = ((i % side) as f64 * step - 3.7, (i / side) as f64 * step - 3.7);
        let corner = |u: f64, v: f64| (x + step * (u - 0.1 * v), y + step * (v + 0.1 * u));
        vec![corner(0.2, 0.1), corner(0.7, 0.1), corner(0.7, 0.6), corner(0.2, 0.6)]
    };
    (0..count).map(of).collect()
}

/// Triangles over the view.
fn field(count: usize) -> String {
    let side = (count as f64).sqrt().ceil() as usize;
    let step = 8.0 / side as f64;
    let corner = |i: usize, u: f64, v: f64| {
        let (x, y) = ((i % side) as f64 * step - 4.0, (i / side) as f64 * step - 4.0);
        format!("({:.6}, {:.6}, {})", x + u * step, y + v * step, (i % 7) as f64 * 0.01)
    };
    let three = |i: usize| [corner(i, 0.1, 0.1), corner(i, 0.9, 0.2), corner(i, 0.4, 0.9)];
    let points = (0..count).flat_map(three).collect::<Vec<_>>().join(", ");
    let face = |i: usize| format!("(outline: [{}, {}, {}])", 3 * i, 3 * i + 1, 3 * i + 2);
    let faces = (0..count).map(face).collect::<Vec<_>>().join(", ");
    scene_of(&format!(
        "(name: \"field\", material: \"w\", shape: Faces(points: [{points}], faces: [{faces}]))"
    ))
}

fn boxes(count: usize, material: impl Fn(usize) -> String) -> String {
    let side = (count as f64).sqrt().ceil() as usize;
    let step = 8.0 / side as f64;
    let one = |i: usize| {
        let (x, y) = ((i % side) as f64 * step - 4.0, (i / side) as f64 * step - 4.0);
        format!(
            "(name: \"b{i}\", material: \"{}\", transform: [TurnX({}), Move({x:.6}, {y:.6}, 0)], \
             shape: Box(size: ({:.6}, {:.6}, {:.6})))",
            material(i),
            i % 40,
            step * 0.5,
            step * 0.6,
            step
        )
    };
    scene_of(&(0..count).map(one).collect::<Vec<_>>().join(",\n"))
}

/// Panes one behind the other that fill a part of the view.
fn panes(count: usize) -> String {
    let pane = |i: usize| {
        let z = i as f64 / count as f64;
        let (a, b) = (1.0 + z * 0.3, 1.5 - z * 0.4);
        format!(
            "(name: \"p{i}\", material: \"g\", shape: Polygon(outline: [({a}, -1, {z}), (2, {b}, {z}), \
             (-{b}, 1, {z}), (-1, -{a}, {z})]))"
        )
    };
    scene_of(&(0..count).map(pane).collect::<Vec<_>>().join(",\n"))
}

/// Images of sixteen boxes each, merged.
fn sources(count: usize) -> Input {
    let scene = |k: usize| {
        let one = |i: usize| {
            let (x, y) = ((i % 4) as f64 * 2.0 - 4.0, (i / 4) as f64 * 1.5 - 3.0);
            let shift = k as f64 / count as f64;
            format!(
                "(name: \"b{i}\", material: \"w\", transform: [TurnX(9), Move({:.4}, {:.4}, {:.4})], \
                 shape: Box(size: (0.3, 0.4, 0.3)))",
                x + shift * 1.7,
                y + shift,
                shift - 0.5
            )
        };
        scene_of(&(0..16).map(one).collect::<Vec<_>>().join(",\n"))
    };
    let names: Vec<String> = (0..count).map(|i| format!("\"s{i}\"")).collect();
    let nodes = format!("\"last\": DepthMerge(inputs: [{}]),\n", names.join(", "));
    Input { scenes: (0..count).map(scene).collect(), nodes, lines: "Sloped(8)" }
}

fn lights(count: usize) -> Input {
    let mut nodes = String::new();
    let mut names = Vec::new();
    for i in 0..count {
        let (x, y) = ((i % 8) as f64 - 4.0, (i / 8) as f64 * 8.0 / count as f64 * 8.0 - 4.0);
        let _ = writeln!(
            nodes,
            "\"l{i}\": PointLight(position: ({x}, {y}, 2), intensity: {}),",
            9.0 / count as f64
        );
        names.push(format!("\"l{i}\""));
    }
    let _ = writeln!(
        nodes,
        "\"last\": Illuminate(image: \"s0\", lights: [{}], shadows: Volumes, white: 1),",
        names.join(", ")
    );
    Input { scenes: vec![boxes(64, |_| "w".to_owned())], nodes, lines: "Sloped(8)" }
}

/// Nodes one after another.
fn chain(count: usize) -> Input {
    let mut nodes = String::new();
    for i in 0..count {
        let before = if i == 0 { "s0".to_owned() } else { format!("n{}", i - 1) };
        let name = if i + 1 == count { "last".to_owned() } else { format!("n{i}") };
        let _ = writeln!(nodes, "\"{name}\": Recolor(image: \"{before}\", multiply: 0.999),");
    }
    Input { nodes, ..resolved(boxes(16, |_| "w".to_owned())) }
}

/// Nodes beside those that are asked for.
fn lonely(count: usize) -> Input {
    let mut input = resolved(boxes(16, |_| "w".to_owned()));
    for i in 0..count {
        let _ = writeln!(input.nodes, "\"n{i}\": Recolor(image: \"s0\", multiply: 0.9),");
    }
    input
}
