//! Only what moves is made again ([N]), and what is taken from the picture before is what it would be, bit for bit.

use spandrel_engine::graph::demand::Wishes;
use spandrel_engine::graph::report::Evaluated;
use spandrel_engine::graph::{Graph, Run, Schedule};
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::values::{Override, PictureDemand};
use spandrel_tests::program::Scratch;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use crate::films::graph;

/// A picture's colours, depths and names.
fn evaluate(run: &Run, graph: &Graph, frame: u32) -> Evaluated {
    let channels = BTreeSet::from([Channel::Color, Channel::Z, Channel::Id]);
    let demand = PictureDemand { channels, changed: Override::default() };
    let mut wishes = Wishes::new();
    wishes.want_at::<Image>("picture", demand, f64::from(frame));
    run.evaluate(graph, &Schedule::new(graph, &wishes).unwrap(), &()).unwrap()
}

/// By a run that knows nothing of others.
fn alone(graph: &Graph, frame: u32) -> Arc<Image> {
    evaluate(&Run::new(), graph, frame).value(0)
}

/// How much of something was counted.
fn counted(done: &Evaluated, what: &str) -> u64 {
    let facts = done.reports.iter().flat_map(|report| &report.facts);
    facts.filter(|(name, _)| *name == what).map(|(_, number)| number).sum()
}

/// A yard with a house, and a pole that moves beside it: in the picture, or outside of it with its shadow within.
fn yard(folder: &Path, pole: &str) {
    let scene = |shape: &str| {
        format!("Scene(plans: [(name: \"p\", root: (children: [(name: \"a\", {shape})]))])")
    };
    let ground =
        "shape: Polygon(outline: [(-50, 0, 20), (50, 0, 20), (50, 0, -80), (-50, 0, -80)])";
    std::fs::write(folder.join("ground.ron"), scene(ground)).unwrap();
    let house = "transform: [Move(2, 0, -6)], shape: Box(size: (4, 3, 4))";
    std::fs::write(folder.join("house.ron"), scene(house)).unwrap();
    let pole = format!("transform: [Move({pole})], shape: Box(size: (0.4, 2, 0.4))");
    std::fs::write(folder.join("pole.ron"), scene(&pole)).unwrap();
}

/// [N]: only what moves is calculated again. What is taken from the picture before is what it would be, bit for bit.
#[test]
fn rows_that_nothing_moved_on_are_taken_from_the_picture_before() {
    let scratch = Scratch::new("again-rows");
    let lights = [
        ("ParallelLight(direction: (1, -1, -0.2))", true),
        ("PointLight(position: (-3, 6, 2), intensity: 400)", true),
        ("ParallelLight(direction: (Expr(\"frame\"), -1, -0.2))", false),
        ("SkyLight(model: Uniform)", false),
    ];
    let poles = [
        "Expr(\"-1 + frame * 0.3\"), 0, 1",
        "-9, 0, Expr(\"frame * -0.5\")",
        "Expr(\"frame\"), 0, 30",
    ];
    for (light, taken) in lights {
        for pole in poles {
            yard(scratch.path(), pole);
            let text = format!(
                "Graph(nodes: {{\"eye\": Camera(position: (0, 2.5, 9), look_at: (0, 1, 0), field_of_view: 40),
                    \"ground\": Scanline(scene: \"ground.ron\", camera: \"eye\"),
                    \"house\": Scanline(scene: \"house.ron\", camera: \"eye\"),
                    \"pole\": Scanline(scene: \"pole.ron\", camera: \"eye\"),
                    \"all\": DepthMerge(inputs: [\"ground\", \"house\", \"pole\"]),
                    \"sun\": {light},
                    \"lit\": Illuminate(image: \"all\", lights: [\"sun\"], shadows: Volumes, samples: 4, white: 2),
                    \"hazy\": Fog(image: \"lit\", density: 0.01),
                    \"picture\": Resolve(image: \"hazy\", size: (64, 96), lines: Sloped(3))}})"
            );
            let film = graph(scratch.path(), &text, "1-4");
            let run = Run::new();
            let mut rows = 0;
            for frame in 1..=4 {
                let done = evaluate(&run, &film, frame);
                let image = done.value::<Image>(0);
                assert_eq!(image, alone(&film, frame), "{light}, {pole}, frame {frame}");
                rows += counted(&done, "rows as before");
            }
            // Sixteen show nothing at all.
            assert_eq!(rows > 3 * 16, taken, "{light}, {pole}: {rows} rows");
        }
    }
}

/// A scene in one file, of which an edit at random changes a little.
struct Edited {
    state: u64,
    objects: Vec<Object>,
    /// The front corner of a sheet, as high as it is lifted.
    lifted: f64,
    color: u32,
}

#[derive(Clone)]
struct Object {
    name: u32,
    at: [i64; 3],
    material: usize,
}

const MATERIALS: [&str; 4] = ["plain", "pane", "sieve", "shiny"];

impl Edited {
    fn new(seed: u64) -> Edited {
        let mut edited = Edited { state: seed, objects: Vec::new(), lifted: 0.0, color: 0 };
        (0..7).for_each(|_| edited.add());
        edited
    }

    fn random(&mut self, below: u64) -> u64 {
        self.state = self.state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.state >> 33) % below
    }

    fn add(&mut self) {
        let at = [self.random(9) as i64 - 4, self.random(3) as i64, -(self.random(7) as i64)];
        let (name, material) = (self.random(1000) as u32, self.random(4) as usize);
        let place = self.random(self.objects.len() as u64 + 1) as usize;
        self.objects.insert(place, Object { name, at, material });
    }

    /// Changes something, and says what.
    fn edit(&mut self) -> &'static str {
        let one = self.random(self.objects.len() as u64) as usize;
        let axis = self.random(3) as usize;
        match self.random(9) {
            0 | 1 => {
                self.objects[one].at[axis] += 1;
                "moved"
            }
            2 => {
                self.objects[one].material = self.random(4) as usize;
                "of another material"
            }
            3 if self.objects.len() > 3 => {
                self.objects.remove(one);
                "gone"
            }
            4 if self.objects.len() < 12 => {
                self.add();
                "added"
            }
            5 => {
                let other = self.random(self.objects.len() as u64) as usize;
                self.objects.swap(one, other);
                "in another order"
            }
            6 => {
                self.objects[one].name += 1000;
                "under another name"
            }
            7 => {
                self.color = self.random(256) as u32;
                "of another colour"
            }
            _ => {
                self.lifted += 0.25;
                "lifted"
            }
        }
    }

    fn text(&self) -> String {
        let mut objects = String::new();
        for Object { name, at: [x, y, z], material } in &self.objects {
            let material = MATERIALS[*material];
            objects += &format!(
                "(name: \"{name}\", material: \"{material}\", transform: [Move({x}, {y}, {z}), TurnY(20)],
                  shape: Box(size: (0.9, 1.7, 0.6))),"
            );
        }
        let (lifted, color) = (self.lifted, self.color);
        format!(
            "Scene(
                materials: {{
                    \"plain\": (color: \"#{color:02x}8040\"),
                    \"pane\": (color: \"#80a0c0\", alpha: 0.4, alpha_mode: Blend),
                    \"sieve\": (color: \"#907050\", alpha_mode: Mask(0.5), maps: {{\"alpha\": (picture: Wave(2, 1), mapping: (by: Z))}}),
                    \"shiny\": (color: \"#404040\", finish: (gloss: Phong(share: 0.5, exponent: 20))),
                }},
                plans: [(name: \"p\", root: (children: [
                    (name: \"ground\", shape: Polygon(outline: [(-30, 0, 9), (30, 0, 9), (30, 0, -50), (-30, 0, -50)])),
                    (name: \"sheet\", shape: Faces(points: [(-3, 2, 1), (-2, 2, 1), (-2, 2.6, 0), (-3, {}, 0), (-2, 3, -1), (-3, 3, -1)],
                        faces: [(outline: [0, 1, 2]), (outline: [0, 2, 3]), (outline: [3, 2, 4]), (outline: [3, 4, 5])])),
                    {objects}
                ]))],
            )",
            2.6 + lifted
        )
    }
}

/// One file with everything in it: what of it changed is found face by face.
#[test]
fn an_edit_makes_anew_what_it_touches() {
    let scratch = Scratch::new("again-edit");
    let lights = [
        "ParallelLight(direction: (1, -1.3, -0.4))",
        "PointLight(position: (-3, 7, 2), intensity: 400)",
    ];
    let mut counts = [0; 4];
    for (seed, light) in (5..).zip(lights) {
        let mut scene = Edited::new(seed);
        let text = format!(
            "Graph(nodes: {{
                \"eye\": Camera(position: (0, 3.5, 9), look_at: (0, 1, 0), field_of_view: 48),
                \"scene\": Scanline(scene: \"scene.ron\", camera: \"eye\"),
                \"far\": Scanline(scene: \"far.ron\", camera: \"eye\"),
                \"all\": DepthMerge(inputs: [\"scene\", \"far\"]),
                \"sun\": {light},
                \"lit\": Illuminate(image: \"all\", lights: [\"sun\"], shadows: Volumes, white: 2),
                \"picture\": Resolve(image: \"lit\", size: (72, 54), lines: Sloped(2))}})"
        );
        let wall =
            "shape: Polygon(outline: [(-20, 0, -20), (20, 0, -20), (20, 8, -20), (-20, 8, -20)])";
        let far =
            format!("Scene(plans: [(name: \"p\", root: (children: [(name: \"a\", {wall})]))])");
        std::fs::write(scratch.path().join("far.ron"), far).unwrap();
        let run = Run::new();
        let mut edits = vec!["new"];
        for _ in 0..30 {
            std::fs::write(scratch.path().join("scene.ron"), scene.text()).unwrap();
            let still = graph(scratch.path(), &text, "1");
            let done = evaluate(&run, &still, 1);
            assert_eq!(
                done.value::<Image>(0),
                alone(&still, 1),
                "{light}: {edits:?}\n{}",
                scene.text()
            );
            let names =
                ["lines as before", "rows as before", "shadow patches", "shadow patches as before"];
            for (count, name) in counts.iter_mut().zip(names) {
                *count += counted(&done, name);
            }
            edits.push(scene.edit());
        }
    }
    let [lines, rows, patches, known] = counts;
    // Of 60 pictures with 108 lines of two clusters and 54 rows.
    assert!(lines > 60 * 108 / 3, "{counts:?}");
    assert!(rows > 60 * 54 / 10, "{counts:?}");
    assert!(known > patches / 2, "{counts:?}");
}
