//! Rays for the whole picture: they nominate faces, and what they miss is told.

use glam::DVec3;
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::raster::{LinePlan, Phase, Raster};
use spandrel_engine::render::priority::{self, BspTree, Roots};
use spandrel_engine::render::rays::{self, Missed, RayOptions};
use spandrel_engine::render::scanline;
use spandrel_engine::scene::Scene;
use spandrel_engine::span::{FaceId, SpanImage};
use spandrel_engine::trace::{Accelerator, Voxels};
use spandrel_tests::program::Scratch;
use spandrel_tests::{known, scenes, town};
use std::path::Path;
use std::sync::Arc;

const ROWS: u32 = 23;

fn plan() -> LinePlan {
    LinePlan::new(3, Phase::Centre).unwrap()
}

fn view(position: DVec3, parallel: bool) -> View {
    let parallel_height = parallel.then_some(7.0);
    let camera = Camera { position, look_at: DVec3::ZERO, parallel_height, ..Camera::default() };
    View::new(&camera, Raster::new(61, ROWS).unwrap()).unwrap()
}

fn scanned(scene: &Arc<Scene>, view: &View) -> SpanImage {
    let rows = 0..view.raster().height;
    scanline::render(&[scene.clone().into()], view, plan(), rows).unwrap()
}

fn cast(scene: &Arc<Scene>, view: &View, options: RayOptions) -> (SpanImage, Missed) {
    let rows = 0..view.raster().height;
    let frame = scanline::frame(&[scene.clone().into()], view, plan(), rows).unwrap();
    rays::solve(&frame, &options).unwrap()
}

/// The face that is seen in a cell of a line.
fn seen(image: &SpanImage, line: u32, cell: u32) -> FaceId {
    let spans = image.lines().line(line);
    spans[spans.partition_point(|span| span.x <= cell) - 1].face
}

/// The share of all lines on which two images show different faces.
fn differing(a: &SpanImage, b: &SpanImage) -> f64 {
    let cells = f64::from(a.view().raster().cells());
    let mut differing = 0.0;
    for line in a.lines().range() {
        let mut borders: Vec<u32> =
            [a, b].iter().flat_map(|i| i.lines().line(line)).map(|s| s.x).collect();
        borders.push(a.view().raster().cells());
        borders.sort_unstable();
        borders.dedup();
        for pair in borders.windows(2) {
            if seen(a, line, pair[0]) != seen(b, line, pair[0]) {
                differing += f64::from(pair[1] - pair[0]) / cells;
            }
        }
    }
    differing / a.lines().range().len() as f64
}

/// Faces of all kinds, crossing, coincident, with holes, seals and edges, some of glass. What is seen and was met by a ray
/// is where the scan line has it, to the last bit; and what is missed is no more than is told.
#[test]
fn rays_find_the_spans_of_the_scan_line_and_tell_what_they_miss() {
    let (mut whole, mut wrong, mut told, mut tested) = (0, 0.0, 0.0, 0);
    for seed in 0..48u64 {
        let scene = scenes::scene("a", scenes::random_panes(seed, 4 + seed as usize));
        let view = view(DVec3::new(seed as f64 / 8.0 - 3.0, 2.0, 10.0), seed % 3 == 0);
        let exact = scanned(&scene, &view);
        let (found, missed) = cast(&scene, &view, RayOptions { rays: 2, ..RayOptions::default() });
        let share = differing(&exact, &found);
        // Where no face differs no bit does.
        if share == 0.0 {
            assert_eq!(found.lines(), exact.lines(), "{seed}");
            whole += usize::from(found == exact);
        }
        for line in found.lines().range() {
            for span in found.lines().line(line) {
                // A face that is seen where the scan line has another stands behind one that was missed.
                let right = seen(&exact, line, span.x);
                assert!(right == span.face || share > 0.0);
            }
        }
        assert!(share <= missed.share().end + 0.002, "{seed}: {share} {missed:?}");
        wrong += share;
        told += missed.missed as f64 / missed.tested as f64;
        tested += missed.tested;
        // Voxels find what the tree does.
        let accelerator = Accelerator::Grid(Voxels { cells: (5, 4, 7), ..Voxels::default() });
        let (by_grid, same) =
            cast(&scene, &view, RayOptions { rays: 2, accelerator, refine: true });
        assert!(by_grid == found && same == missed, "{seed}");
    }
    assert!(whole > 24, "{whole}");
    // What is missed in the end is less than what was told: the other rays found some of it.
    assert!(wrong <= told + 0.01 && tested > 10_000, "{wrong} {told}");
}

/// A thousand wires before a wall, each a five hundredth of a pixel wide, and some rays.
#[test]
fn what_is_missed_is_told_truly() {
    let mut polygons = vec![vec![
        DVec3::new(-9.0, -9.0, -1.0),
        DVec3::new(9.0, -9.0, -1.0),
        DVec3::new(9.0, 9.0, -1.0),
        DVec3::new(-9.0, 9.0, -1.0),
    ]];
    for wire in 0..1000 {
        let x = -5.0 + f64::from(wire) * 0.01003;
        let low = -3.0 + f64::from(wire % 7) * 0.8;
        polygons.push(vec![
            DVec3::new(x, low, 0.0),
            DVec3::new(x + 0.0006, low, 0.0),
            DVec3::new(x + 0.0006, low + 0.5, 0.0),
            DVec3::new(x, low + 0.5, 0.0),
        ]);
    }
    let scene = scenes::scene("wires", scenes::polygons(&polygons));
    let view = view(DVec3::new(0.0, 0.0, 10.0), true);
    let exact = scanned(&scene, &view);
    let (found, missed) = cast(&scene, &view, RayOptions::default());
    let share = differing(&exact, &found);
    assert!(share > 0.001, "{share}");
    assert!(missed.missed > 0 && share <= missed.share().end, "{share} {missed:?}");
    // More rays find more.
    let (finer, fewer) = cast(&scene, &view, RayOptions { rays: 64, ..RayOptions::default() });
    assert!(differing(&exact, &finer) < 0.9 * share && fewer.share().end < missed.share().end);
}

/// Without refinement each ray's answer stands for its share of its line.
#[test]
fn plain_samples_are_what_the_scan_line_has_at_their_places() {
    let scene = scenes::scene("a", scenes::random_panes(5, 9));
    let view = view(DVec3::new(1.0, 2.0, 10.0), false);
    let exact = scanned(&scene, &view);
    for count in [1, 3, 4] {
        let options = RayOptions { rays: count, refine: false, ..RayOptions::default() };
        let (samples, _) = cast(&scene, &view, options);
        let raster = view.raster();
        let share = |number: u32| raster.cell(f64::from(number) / f64::from(count));
        for line in samples.lines().range() {
            for number in 0..raster.width * count {
                let (start, end) = (share(number), share(number + 1));
                let face = seen(&samples, line, start);
                assert_eq!(seen(&samples, line, end - 1), face);
                // The scan line has it somewhere in this share, and everything that is seen through there.
                let within = exact
                    .lines()
                    .line(line)
                    .iter()
                    .any(|s| s.x >= start && s.x < end && s.face == face);
                assert!(within || seen(&exact, line, start) == face, "{line} {number}");
            }
            for segment in samples.layers().line(line) {
                assert!((0..=raster.width * count).any(|number| share(number) == segment.start));
                let known = exact.layers().line(line).iter();
                let mut known = known.filter(|other| other.face == segment.face);
                assert!(known.any(|other| other.start < segment.end && segment.start < other.end));
            }
        }
        // They are no better than samples are, and no worse.
        let off = differing(&exact, &samples);
        assert!(off > 0.0 && off < 0.2 / f64::from(count), "{count}: {off}");
    }
}

/// The shapes of known coverage, from all three renderers: the same spans.
#[test]
fn known_answers_come_from_every_renderer() {
    for offset in known::offsets().into_iter().take(6) {
        let shapes = [
            known::half_plane(0.3, offset),
            known::rotated_square(offset),
            known::hole(offset),
            known::seal(offset),
            known::crossing_planes(offset),
            known::three_bars(offset),
        ];
        for shape in shapes {
            let view = scenes::pixel_view(known::SIZE, known::SIZE);
            let exact = scanned(&shape.scene, &view);
            let tree = BspTree::generate(shape.scene.clone(), Roots::Best).unwrap();
            let listed = priority::render(&tree, 0, &view, plan(), 0..known::SIZE).unwrap();
            let (found, missed) = cast(&shape.scene, &view, RayOptions::default());
            assert!(listed == exact, "{}", shape.name);
            assert!(found == exact && missed.missed == 0, "{}: {missed:?}", shape.name);
        }
    }
}

/// A town, and the eye among its houses; front and back planes count.
#[test]
fn a_town_is_found_by_a_ray_a_pixel() {
    for scene in town::clusters(4000, 2) {
        for (front, back) in [(0.0, None), (30.0, Some(90.0))] {
            let camera = Camera { front, back, ..town::view(160, 90).camera().clone() };
            let view = View::new(&camera, Raster::new(160, 90).unwrap()).unwrap();
            let exact = scanned(&scene, &view);
            let (found, missed) = cast(&scene, &view, RayOptions::default());
            let share = differing(&exact, &found);
            assert!(share <= missed.share().end && share < 0.01, "{share} {missed:?}");
        }
    }
}

/// A scene with lists of cameras and lights, and objects that show everything, faces alone, and nothing; among them
/// holes, seals, drawn edges, a cut-out, glass, faces that cross, and a copy of an object.
const SHARED: &str = r##"Scene(
    materials: {
        "wall": (color: "#b0a090"), "mark": (color: "#a03020"), "line": (color: "#102030"),
        "glass": (color: "#80a0c0", alpha: 0.4, alpha_mode: Blend),
    },
    plans: [(
        name: "p",
        cameras: {
            "front": (position: (3, 4, 9), look_at: (0, 0.5, 0)),
            "flat": (position: (3, 4, 9), look_at: (0, 0.5, 0), parallel_height: 5, roll: 20),
            "sliced": (position: (3, 4, 9), look_at: (0, 0.5, 0), front: 9.2, back: 10.9),
            "cornered": (position: (3, 4, 9), look_at: (0, 0.5, 0), viewport: (0.1, 0.3, 0.7, 0.9), shift: (0.1, 0.2)),
        },
        lights: {
            "sun": ParallelLight(direction: (-1, -2, -1), illuminance: 0.8),
            "lamp": PointLight(position: (1, 3, 3), intensity: 6),
            "off": PointLight(position: (-1, 3, 3), intensity: 60, on: false),
        },
        definitions: { "block": (shape: Box(size: (0.5, 0.7, 0.5)), material: "mark") },
        root: (children: [
            (name: "box", material: "wall", transform: [TurnY(30)], shape: Box(size: (2, 1, 2))),
            (name: "ball", material: "wall", transform: [Move(0, 1.5, 1)], shape: Sphere(radius: 0.8, segments: 12)),
            (name: "pane", material: "glass", transform: [Move(0, 0, 2)], shape: Box(size: (3, 2, 0.1))),
            (name: "copy", transform: [Move(1.3, 0.2, 1.2), TurnZ(20)], shape: Instance("block")),
            (name: "sheet", DISPLAY transform: [Move(-1.2, 0, 1.5), TurnY(-20)], shape: Faces(
                materials: ["wall", "mark", "line"],
                points: [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (-0.7, -0.6, 0), (-0.1, -0.6, 0), (-0.1, 0.6, 0),
                         (-0.7, 0.6, 0), (0.2, -0.5, 0), (0.8, -0.5, 0), (0.8, 0.5, 0), (0.2, 0.5, 0)],
                faces: [(outline: [0, 1, 2, 3], holes: [[4, 5, 6, 7]], sides: (front: 0),
                    edge: (width: 1.5, color: "#102030"),
                    seals: [(outline: [8, 9, 10, 11], sides: (front: 1), edge: (width: 1, color: "#e0e0e0"))])],
            )),
        ]),
    )],
)"##;

const CHOICE: &str = r#"Graph(
    parameters: { "renderer": Choice(default: "scanned", of: ["scanned", "listed", "cast", "few"], doc: "Which") },
    nodes: {
        "eye": SceneCamera(scene: "scene.ron", name: "CAMERA"),
        "tree": BspTree(scene: "scene.ron"),
        "listed": ListPriority(tree: "tree", camera: "eye"),
        "scanned": Scanline(scene: "scene.ron", camera: "eye"),
        "cast": RayTracing(scene: "scene.ron", camera: "eye", rays: 64),
        "few": RayTracing(scene: "scene.ron", camera: "eye", refine: false),
        "lamps": SceneLights(scene: "scene.ron"),
        "lit": Illuminate(image: Ref("renderer"), lights: ["lamps"], shadows: Rays(1), white: 1),
        "picture": Resolve(image: "lit", size: (96, 64), lines: Sampled(4, Box)),
    },
)"#;

/// The renderer is a parameter of a graph: the same file from all three, bit for bit, from each camera of the scene's
/// list (perspective, parallel, between planes, in a part of the picture), in the light of its list, whatever of an
/// object is displayed.
#[test]
fn a_graph_chooses_its_renderer() {
    let scratch = Scratch::new("nominated_graph");
    let write = |name: &str, text: &str| std::fs::write(scratch.path().join(name), text).unwrap();
    let program = env!("CARGO_BIN_EXE_spandrel-under-test");
    let made = |renderer: &str| {
        let (out, set) = (format!("{renderer}.exr"), format!("renderer={renderer}"));
        let arguments = ["render", "graph.ron", "-w", "picture", "-o", &out, "--set", &set];
        let ran = spandrel_tests::program::run(program, &arguments, scratch.path());
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        assert!(!ran.err.contains("no ray met"), "{}", ran.err);
        std::fs::read(scratch.path().join(&out)).unwrap()
    };
    let mut all = Vec::new();
    for (camera, display) in [
        ("front", ""),
        ("flat", ""),
        ("sliced", ""),
        ("cornered", ""),
        ("front", "display: FacesOnly,"),
        ("front", "display: Hidden,"),
    ] {
        write("scene.ron", &SHARED.replace("DISPLAY", display));
        write("graph.ron", &CHOICE.replace("CAMERA", camera));
        let scanned = made("scanned");
        assert!(scanned == made("listed"), "{camera} {display}: by the tree");
        assert!(scanned == made("cast"), "{camera} {display}: by rays");
        all.push(scanned);
    }
    assert!(made("few") != all[5], "plain samples are another picture");
    // Each camera and each display shows something else.
    let different: std::collections::HashSet<&Vec<u8>> = all.iter().collect();
    assert_eq!(different.len(), all.len());
}

/// Who misses much says so: thousands of faces smaller than a pixel.
#[test]
fn what_is_missed_is_a_warning() {
    let scratch = Scratch::new("nominated_warning");
    let solids = Path::new(env!("CARGO_MANIFEST_DIR")).join("../graphs/assets/solids.ron");
    let solids = solids.to_string_lossy().replace('\\', "/");
    let text = format!(
        r#"Graph(nodes: {{
            "eye": SceneCamera(scene: "{solids}", name: "front"),
            "cast": RayTracing(scene: "{solids}", camera: "eye"),
            "picture": Resolve(image: "cast", size: (96, 64), lines: Sampled(1, Box)),
        }})"#
    );
    std::fs::write(scratch.path().join("g.ron"), text).unwrap();
    let program = env!("CARGO_BIN_EXE_spandrel-under-test");
    // From the disk too: the picture as a whole, and its spans for another picture.
    let first = ["render", "g.ron", "-w", "picture", "-o", "p.png", "--cache", "cache"];
    let other = [&first[..], &["--set", "picture.scale=(2, 2)"]].concat();
    for arguments in [&first[..], &first, &other] {
        let ran = spandrel_tests::program::run(program, arguments, scratch.path());
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        assert!(ran.err.contains("faces that no ray met are seen in"), "{}", ran.err);
    }
}
