//! Takes the photographs of trees in `graphs/assets/photos`: trees that grow by chance, rendered in the sun before
//! a graded sky with the noise of a film, and stored as JPEG, like any photograph.
//! `cargo run --release -p spandrel-tests --example photo_assets`.

#![allow(
    clippy::disallowed_methods,
    reason = "nothing depends on the last bits of a photographed tree"
)]

use glam::{DVec2, DVec3, dvec3 as v};
use image::codecs::jpeg::JpegEncoder;
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::{Color, encode_srgb};
use spandrel_engine::image::Channel;
use spandrel_engine::raster::Raster;
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::scene::Scene;
use spandrel_engine::shade::{Illuminate, Shadows};
use spandrel_tests::lights::{illuminate, sun};
use spandrel_tests::random::Random;
use spandrel_tests::tree::{grass, grow, kinds};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

fn photograph(scene: Arc<Scene>, height_of: f64, seed: u64) {
    let name = scene.label.clone();
    println!("{name}: {} faces", scene.face_count());
    let (width, height) = (768u32, 768u32);
    let points = scene.instances.iter().flat_map(|instance| &instance.geometry.mesh().points);
    let (low, high) = points
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
    let middle = (low + high) / 2.0;
    let away = v(0.0, -height_of * 0.25, height_of * 6.0);
    let size = (high - low).x.max((high - low).y) * 1.06;
    let camera = Camera {
        position: middle + away,
        look_at: middle,
        field_of_view: 2.0 * (size / 2.0 / away.length()).atan().to_degrees(),
        ..Camera::default()
    };
    let view = View::new(&camera, Raster::new(width, height).expect("a size")).expect("a camera");
    let rule = Rule::Sloped(6);
    let plan = rule.plan().expect("a plan");
    let spans = scanline::render(&[scene.into()], &view, plan, 0..height).expect("a tree");
    let lights = illuminate(
        vec![sun(v(-0.55, -0.75, -0.5), Color::new(0.82, 0.76, 0.66))],
        Color::new(0.34, 0.38, 0.44),
        Color::new(0.16, 0.17, 0.12),
    );
    let lights = Illuminate { shadows: Shadows::Rays(2), ..lights };
    let lit = spans.shaded(Arc::new(lights)).expect("light");
    let framing = Framing::scaled(view.raster(), DVec2::ONE).expect("a frame");
    let picture = resolve(&lit, rule, &framing, &BTreeSet::from([Channel::Color])).expect("pixels");
    let mut random = Random::new(seed + 1);
    let mut bytes = Vec::new();
    for (at, pixel) in picture.pixels().enumerate() {
        let down = (at as u32 / width) as f32 / height as f32;
        let sky = [0.19 + 0.3 * down, 0.36 + 0.3 * down, 0.74 + 0.16 * down];
        for k in 0..3 {
            let light = pixel[k] + (1.0 - pixel[3]) * sky[k];
            // A film's noise grows with the root of what it sees.
            let noise = random.between(-1.0, 1.0) as f32 * 0.014 * (0.1 + light).sqrt();
            bytes.push((encode_srgb((light + noise).clamp(0.0, 1.0)) * 255.0).round() as u8);
        }
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../graphs/assets/photos");
    std::fs::create_dir_all(&folder).expect("a folder");
    let path = folder.join(format!("{name}.jpg"));
    let mut file = std::fs::File::create(&path).expect("a file");
    let encoder = JpegEncoder::new_with_quality(&mut file, 88);
    let written = image::ImageEncoder::write_image(
        encoder,
        &bytes,
        width,
        height,
        image::ExtendedColorType::Rgb8,
    );
    written.expect("a photograph");
}

fn main() {
    for kind in &kinds() {
        photograph(grow(kind), kind.height, kind.seed);
    }
    photograph(grass(), 1.0, 57);
}
