//! List priority beside the scan line: a tree's generation, its traversal, and visibility by its order and without one.
//!
//! `cargo run --release -p spandrel-tests --example priority`
//!
//! Times are the best of five. The landscape is that of \[D] fig. 12, at 800x800; towns are at 1920x1080. One line to a row.

use spandrel_engine::camera::{Camera, View};
use spandrel_engine::raster::{LinePlan, Phase, Raster};
use spandrel_engine::render::priority::{self, BspTree, Roots};
use spandrel_engine::render::scanline;
use spandrel_engine::scene::Scene;
use spandrel_engine::scene::read::{self, ReadOptions};
use spandrel_engine::visible;
use spandrel_tests::town;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// The least time of a few, in milliseconds, and what was made.
fn best<T>(mut work: impl FnMut() -> T) -> (f64, T) {
    let mut timed = || {
        let clock = Instant::now();
        let made = work();
        (clock.elapsed().as_secs_f64() * 1e3, made)
    };
    let first = timed();
    (0..4).map(|_| timed()).fold(first, |best, next| if next.0 < best.0 { next } else { best })
}

fn measure(name: &str, scene: &Arc<Scene>, view: &View) {
    let plan = LinePlan::new(1, Phase::Centre).expect("one line is a plan");
    let rows = 0..view.raster().height;
    let (generation, tree) =
        best(|| BspTree::generate(scene.clone(), Roots::Best).expect("a tree"));
    let (set_up, frame) = best(|| {
        scanline::frame(&[scene.clone().into()], view, plan, rows.clone()).expect("a frame")
    });
    let (traversal, order) = best(|| priority::listed(&tree, &frame));
    let (in_order, listed) = best(|| visible::solve_in_order(frame.clone(), &order));
    let (by_depth, scanned) = best(|| visible::solve(frame.clone()));
    assert!(listed == scanned, "the spans are the same");
    let counts = tree.counts();
    println!(
        "| {name} | {} | {generation:.2} | {} | {} | {traversal:.2} | {set_up:.2} | {in_order:.2} | {by_depth:.2} |",
        counts.faces, counts.splits, counts.depth,
    );
}

fn main() {
    println!(
        "| scene | faces | generate | splits | depth | traverse | set-up | visibility by the order | without |\n\
         |---|---|---|---|---|---|---|---|---|"
    );
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../graphs/assets/papers/landscape.ron");
    let scene = read::scene(&path, None, "landscape", &ReadOptions::default()).expect("a scene");
    let camera = Camera {
        position: [22.9, 24.0, 32.8].into(),
        look_at: [0.0, 1.5, 0.0].into(),
        field_of_view: 34.0,
        ..Camera::default()
    };
    let raster = Raster::new(800, 800).expect("a raster");
    let view = View::new(&camera, raster).expect("a view");
    measure("[D] fig. 12", &Arc::new(scene), &view);
    for triangles in [1_000, 10_000, 100_000] {
        let [scene] = &town::clusters(triangles, 1)[..] else { unreachable!("one was asked for") };
        measure(&format!("town, {triangles} triangles"), scene, &town::view(1920, 1080));
    }
}
