//! What light costs on visibility that is solved: a town of 1920x1080, the first picture under one sun by
//! each method, then what is computed when a light is dimmed, coloured, switched or moved; and one
//! visibility with ten lights against ten renders.
//!
//! `cargo run --release -p spandrel-tests --example relight`

use glam::{DVec2, DVec3};
use spandrel_engine::color::Color;
use spandrel_engine::image::Channel;
use spandrel_engine::light::{Lamp, point};
use spandrel_engine::render::scanline::render;
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::scene::Scene;
use spandrel_engine::shade::{Illuminate, Shadows};
use spandrel_engine::span::SpanImage;
use spandrel_tests::lights::{illuminate, sun};
use spandrel_tests::town;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Instant;

const RULE: Rule = Rule::Sloped(8);

fn seconds<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let clock = Instant::now();
    let made = work();
    (clock.elapsed().as_secs_f64(), made)
}

fn milliseconds(seconds: f64) -> String {
    format!("{:.0} ms", seconds * 1e3)
}

fn main() {
    let triangles = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(100_000);
    let mut scene = Scene::clone(&town::clusters(triangles, 1)[0]);
    scene.materials.iter_mut().for_each(|material| material.unlit = false);
    let scene = Arc::new(scene);
    let view = town::view(1920, 1080);
    let plan = RULE.plan().unwrap();
    let spans = || render(&[scene.clone().into()], &view, plan, 0..1080).unwrap();
    let framing = Framing::scaled(view.raster(), DVec2::ONE).unwrap();
    let color = BTreeSet::from([Channel::Color]);
    let shown = |image: &SpanImage, lamps: Vec<Lamp>, shadows| {
        let shader =
            Illuminate { shadows, ..illuminate(lamps, Color::grey(0.1), Color::grey(0.1)) };
        let lit = image.shaded(Arc::new(shader)).unwrap();
        resolve(&lit, RULE, &framing, &color).unwrap()
    };
    let day = |dim: f32| vec![sun((-0.6, -1.0, -0.45), Color::new(0.9, 0.85, 0.7)).dimmed(dim)];
    println!("{} faces, {}x{}, {RULE:?}", scene.face_count(), 1920, 1080);
    // The tree over the casters is built once, whoever asks first.
    let (tree, _) = seconds(|| scene_casters(&spans()));
    println!("tree over what casts: {}", milliseconds(tree));
    println!(
        "| | visibility | light and resolve | dimmed | moved | kept |\n|---|---|---|---|---|---|"
    );
    for shadows in
        [Shadows::Off, Shadows::Volumes, Shadows::Rays(1), Shadows::Rays(4), Shadows::Rays(16)]
    {
        let (visible, image) = seconds(spans);
        let (first, _) = seconds(|| shown(&image, day(1.0), shadows));
        let (dimmed, _) = seconds(|| shown(&image, day(0.5), shadows));
        let moved = vec![sun((-0.5, -1.0, -0.5), Color::WHITE)];
        let (moved, _) = seconds(|| shown(&image, moved, shadows));
        println!(
            "| {shadows:?} | {} | {} | {} ({:.0} % of the first) | {} | {} MB |",
            milliseconds(visible),
            milliseconds(first),
            milliseconds(dimmed),
            100.0 * dimmed / (visible + first),
            milliseconds(moved),
            image.memo().bytes() >> 20
        );
    }
    let lamp = |i: u32| {
        let position = DVec3::new(f64::from(i % 5) * 30.0 - 60.0, 12.0, f64::from(i / 5) * -40.0);
        let light = point::Point { position, beam: point::Beam::All };
        Lamp::new(format!("lamp {i}"), true, Color::grey(400.0), Arc::new(light))
    };
    let (apart, _) = seconds(|| {
        (0..10).for_each(|i| {
            shown(&spans(), vec![lamp(i)], Shadows::Volumes);
        });
    });
    let (together, image) = seconds(|| {
        let image = spans();
        shown(&image, (0..10).map(lamp).collect(), Shadows::Volumes);
        image
    });
    let dimmed = || (0..10).map(|i| if i == 3 { lamp(i).dimmed(0.3) } else { lamp(i) }).collect();
    let (again, _) = seconds(|| shown(&image, dimmed(), Shadows::Volumes));
    println!(
        "ten lamps with Volumes: ten renders {}, one visibility {}, one of them dimmed {}; {} MB kept",
        milliseconds(apart),
        milliseconds(together),
        milliseconds(again),
        image.memo().bytes() >> 20
    );
}

fn scene_casters(image: &SpanImage) -> usize {
    let casters =
        image.sources().iter().filter_map(|source| Some(source.surfaces.rays()?.casters()));
    casters.map(|casters| casters.pieces().len()).sum()
}
