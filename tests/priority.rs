//! List priority: the tree's order, and the spans of the scan line from it.

use glam::DVec3;
use proptest::prelude::*;
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::graph::Run;
use spandrel_engine::raster::{LinePlan, Phase, Raster};
use spandrel_engine::render::priority::{self, BspTree, Roots};
use spandrel_engine::render::scanline;
use spandrel_engine::scene::read::{self, ReadOptions};
use spandrel_engine::scene::{Mesh, Object, Scene, Shape};
use spandrel_engine::span::SpanImage;
use spandrel_tests::known;
use spandrel_tests::program::Scratch;
use spandrel_tests::random::Random;
use spandrel_tests::scenes;
use std::sync::Arc;

use super::films::graph;

fn plan(probed: bool) -> LinePlan {
    LinePlan { probed, ..LinePlan::new(3, Phase::Centre).unwrap() }
}

fn view(camera: &Camera) -> View {
    View::new(camera, Raster::new(61, 23).unwrap()).unwrap()
}

/// A view from a place, with or without perspective.
fn from(position: DVec3, parallel: bool) -> View {
    let parallel_height = parallel.then_some(7.0);
    view(&Camera { position, look_at: DVec3::ZERO, parallel_height, ..Camera::default() })
}

/// Both renderers' images of a scene.
fn both(scene: &Arc<Scene>, view: &View, roots: Roots) -> [SpanImage; 2] {
    let tree = BspTree::generate(scene.clone(), roots).unwrap();
    let listed = priority::render(&tree, 0, view, plan(true), 0..23).unwrap();
    let scanned = scanline::render(&[scene.clone().into()], view, plan(true), 0..23).unwrap();
    [listed, scanned]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Faces of all kinds, crossing, coincident, with holes, seals and edges, some of glass: the spans are those of the
    /// scan line, whatever the roots, from one tree for all eyes.
    #[test]
    fn list_priority_is_the_scan_line_bit_for_bit(
        seed in 0u64..1 << 40, count in 1usize..60, x in -9.0..9.0, y in -9.0..9.0, parallel: bool
    ) {
        let scene = scenes::scene("a", scenes::random_panes(seed, count));
        let view = from(DVec3::new(x, y, 10.0), parallel);
        for roots in [Roots::Best, Roots::Any(seed), Roots::Any(seed + 1)] {
            let [listed, scanned] = both(&scene, &view, roots);
            prop_assert_eq!(listed.lines(), scanned.lines());
            prop_assert_eq!(listed.layers(), scanned.layers());
            prop_assert!(listed == scanned);
        }
    }

    /// A tree that comes back from bytes is the tree; whatever else bytes say, nothing breaks.
    #[test]
    fn trees_come_back_from_bytes(seed in 0u64..1 << 40, count in 1usize..30, at: u16, to: u8) {
        let scene = scenes::scene("a", scenes::random_faces(seed, count));
        let tree = BspTree::generate(scene.clone(), Roots::Best).unwrap();
        let mut bytes = tree.packed();
        let again = BspTree::unpacked(&scene, &bytes).unwrap();
        let view = from(DVec3::new(1.0, 2.0, 9.0), false);
        prop_assert_eq!(again.front_to_back(&view), tree.front_to_back(&view));
        prop_assert_eq!(again.counts(), tree.counts());
        let at = usize::from(at) % bytes.len();
        prop_assert!(BspTree::unpacked(&scene, &bytes[..at]).is_none());
        bytes[at] = to;
        if let Some(other) = BspTree::unpacked(&scene, &bytes) {
            let image = priority::render(&other, 0, &view, plan(false), 0..23).unwrap();
            let scanned = scanline::render(&[scene.clone().into()], &view, plan(false), 0..23);
            prop_assert!(image == scanned.unwrap());
        }
    }
}

#[test]
fn a_tree_is_of_its_scene_alone() {
    let of = |count| scenes::scene("a", scenes::random_faces(7, count));
    let bytes = BspTree::generate(of(20), Roots::Best).unwrap().packed();
    assert!(BspTree::unpacked(&of(20), &bytes).is_some());
    assert!(BspTree::unpacked(&of(21), &bytes).is_none());
}

/// Walls across an axis at each whole number, in any order.
fn walls(axis: usize, seed: u64) -> (Arc<Scene>, Vec<i32>) {
    let mut random = Random::new(seed);
    let mut places: Vec<i32> = (-6..=6).collect();
    for i in (1..places.len()).rev() {
        places.swap(i, random.below(i as u32 + 1) as usize);
    }
    let wall = |place: &i32| {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corner = |(u, v): (f64, f64)| {
            let mut point = [u, v, 0.0];
            point.rotate_right((axis + 1) % 3);
            let mut point = DVec3::from_array(point);
            point[axis] = f64::from(*place);
            point
        };
        corners.map(corner).to_vec()
    };
    let walls: Vec<Vec<DVec3>> = places.iter().map(wall).collect();
    (scenes::scene("walls", scenes::polygons(&walls)), places)
}

/// The side of a plane on which the eye is decides, and not the direction in which it looks: walls that are seen along
/// their planes have an order too, from an eye between them.
#[test]
fn the_side_of_the_eye_decides() {
    for axis in 0..3 {
        for seed in 0..8 {
            let (scene, places) = walls(axis, seed);
            let roots = if seed % 2 == 0 { Roots::Best } else { Roots::Any(seed) };
            let tree = BspTree::generate(scene.clone(), roots).unwrap();
            assert_eq!(tree.counts().splits, 0);
            let mut position = DVec3::new(0.3, 0.2, 9.0);
            let eye = 0.5 - f64::from(seed as u32);
            position[axis] = eye;
            let look_at = position - DVec3::new(0.1, 0.0, 5.0);
            let order =
                tree.front_to_back(&view(&Camera { position, look_at, ..Camera::default() }));
            let placed: Vec<i32> = order.iter().map(|face| places[*face as usize]).collect();
            let side = |is_before: bool| -> Vec<i32> {
                let is_there = |place: &&i32| (f64::from(**place) > eye) == is_before;
                placed.iter().filter(is_there).copied().collect()
            };
            let ascending: Vec<i32> = (-6..=6).filter(|place| f64::from(*place) > eye).collect();
            let descending: Vec<i32> =
                (-6..=6).rev().filter(|place| f64::from(*place) < eye).collect();
            assert_eq!((side(true), side(false)), (ascending, descending), "{axis} {seed}");
        }
    }
}

#[test]
fn faces_that_overlap_in_a_circle_are_cut_and_seen_right() {
    let circle = known::three_bars((0.3, 0.7));
    let tree = BspTree::generate(circle.scene.clone(), Roots::Best).unwrap();
    assert!(tree.counts().splits > 0, "no order of whole faces is right");
    let view = scenes::pixel_view(40, 40);
    let listed = priority::render(&tree, 0, &view, plan(true), 0..40).unwrap();
    let scanned = scanline::render(&[circle.scene.into()], &view, plan(true), 0..40).unwrap();
    assert!(listed == scanned);
}

/// All faces of a convex body lie behind each of them: a tree of their planes alone would be a chain, and take the square
/// of their number to make.
#[test]
fn a_convex_body_makes_no_chain() {
    let ball = Shape::Sphere { radius: 3.0, segments: 160 };
    let scene = Arc::new(Scene::from_object("ball", Object::new("ball", ball)).unwrap());
    let tree = BspTree::generate(scene.clone(), Roots::Best).unwrap();
    let counts = tree.counts();
    assert!(counts.faces > 12_000 && counts.depth < 120, "{counts:?}");
    assert!(counts.splits < counts.faces / 4, "{counts:?}");
    let [listed, scanned] = both(&scene, &from(DVec3::new(5.0, 3.0, 9.0), false), Roots::Best);
    assert!(listed == scanned);
}

/// Many planes that cut each other end: what is left is not cut any more, and the picture is right.
#[test]
fn planes_that_all_cut_each_other_end() {
    let mut random = Random::new(3);
    let mut corner = || {
        let mut one = || random.between(-3.0, 3.0);
        DVec3::new(one(), one(), one())
    };
    let triangles: Vec<Vec<DVec3>> = (0..400).map(|_| vec![corner(), corner(), corner()]).collect();
    let scene = scenes::scene("crowd", scenes::polygons(&triangles));
    let tree = BspTree::generate(scene.clone(), Roots::Best).unwrap();
    assert!(tree.counts().splits <= 8 * 400 + 1024 + 400, "{:?}", tree.counts());
    let [listed, scanned] = both(&scene, &from(DVec3::new(1.0, 1.0, 9.0), false), Roots::Best);
    assert!(listed == scanned);
    let [listed, scanned] = both(&scene, &from(DVec3::new(1.0, 1.0, 9.0), true), Roots::Any(4));
    assert!(listed == scanned);
}

#[test]
fn scenes_without_faces_and_with_hidden_ones_are_rendered() {
    let scene = scenes::scene("nothing", Mesh::default());
    let [listed, scanned] = both(&scene, &scenes::front_view(61, 23), Roots::Best);
    assert!(listed == scanned && listed.face_count() == 0);
}

const YARD: &str = r##"Scene(
    materials: {"white": (color: "#fff")},
    plans: [(name: "p", root: (material: "white", children: [
        (name: "house", children: [
            (name: "wall", shape: Box(size: (2, 2, 2))),
            (name: "roof", transform: [Move(0, 1.5, 0)], shape: Box(size: (3, 0.3, 3))),
        ]),
        (name: "tree", transform: [Move(-1.5, 0, 1)], shape: Sphere(radius: 0.7, segments: 12)),
    ]))],
)"##;

/// Some objects of a scene, and the others, merge to the whole.
#[test]
fn objects_of_a_scene_are_chosen_by_name() {
    let scratch = Scratch::new("priority-objects");
    let path = scratch.path().join("yard.ron");
    std::fs::write(&path, YARD).unwrap();
    let some = |objects: &[&str]| {
        let objects = objects.iter().map(|name| (*name).to_owned()).collect();
        read::scene(&path, None, "yard", &ReadOptions { objects, ..ReadOptions::default() })
    };
    let faces = |objects: &[&str]| some(objects).unwrap().face_count();
    let parts = [faces(&["wall"]), faces(&["house/roof"]), faces(&["tree"])];
    assert_eq!(parts[..2], [6, 6]);
    assert_eq!(faces(&["house"]), 12);
    assert_eq!([faces(&[]), faces(&["*"])], [parts.iter().sum::<usize>(); 2]);
    let error = some(&["house", "tee"]).unwrap_err().to_string();
    assert!(error.contains("no object \"tee\": did you mean \"tree\"?"), "{error}");
    assert_ne!(some(&["wall"]).unwrap().key, some(&["tree"]).unwrap().key);
    let view = from(DVec3::new(3.0, 3.0, 9.0), false);
    let seen = |objects: &[&str]| {
        let scene = Arc::new(some(objects).unwrap());
        let tree = BspTree::generate(scene, Roots::Best).unwrap();
        priority::render(&tree, 0, &view, plan(true), 0..23).unwrap()
    };
    let whole = scanline::render(&[Arc::new(some(&[]).unwrap()).into()], &view, plan(true), 0..23);
    let merged = SpanImage::merge(&[seen(&["tree"]), seen(&["house"])]).unwrap();
    let ends = |image: &SpanImage| -> Vec<u32> {
        image.lines().items().iter().map(|span| span.x).collect()
    };
    assert_eq!(ends(&merged), ends(&whole.unwrap()));
}

/// A tree is made once for all cameras and frames, and the spans of both renderers are one image.
#[test]
fn a_new_view_is_a_traversal() {
    let scratch = Scratch::new("priority-views");
    std::fs::write(scratch.path().join("yard.ron"), YARD).unwrap();
    let text = r#"Graph(nodes: {
        "eye": Camera(position: Curve([(1, (6, 3, 9)), (3, (-6, 3, 9))]), look_at: (0, 0, 0)),
        "tree": BspTree(scene: "yard.ron"),
        "listed": ListPriority(tree: "tree", camera: "eye"),
        "scanned": Scanline(scene: "yard.ron", camera: "eye"),
        "a": Resolve(image: "listed", size: (60, 40)),
        "b": Resolve(image: "scanned", size: (60, 40)),
    })"#;
    let film = graph(scratch.path(), text, "1-3");
    for frame in [1.0, 2.0, 3.0] {
        let [a, b] = ["a", "b"].map(|node| super::films::picture(&film, node, frame));
        assert_eq!(a.channel("A").unwrap(), b.channel("A").unwrap());
        assert_eq!(a.channel("R").unwrap(), b.channel("R").unwrap());
    }
    let done = super::films::evaluate(&Run::new(), &film, "a", &[1.0, 2.0, 3.0]);
    let counts = super::films::computed(&done);
    assert_eq!([counts["tree"], counts["listed"]], [1, 3]);
}
