//! Billboards against leaves: a tree of faces, and a card with its photograph, at the same size on screen.
//! `cargo run --release -p spandrel-tests --example foliage`.

use glam::{DVec2, DVec3, dvec3 as v};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::graph::Value;
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::raster::Raster;
use spandrel_engine::render::billboards::{self, BillboardsOptions, Subject, Tree};
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::shade::{Illuminate, Shadows};
use spandrel_engine::span::SpanImage;
use spandrel_engine::texture::store;
use spandrel_tests::lights::{illuminate, sun};
use spandrel_tests::tree::{grow, kinds};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Instant;

const RULE: Rule = Rule::Sloped(4);

fn shown(image: &SpanImage) -> Image {
    let framing = Framing::scaled(image.view().raster(), DVec2::ONE).expect("a frame");
    resolve(image, RULE, &framing, &BTreeSet::from([Channel::Color])).expect("pixels")
}

fn main() {
    let kind = &kinds()[0];
    let scene = grow(kind);
    let light = || {
        let lamps = vec![sun(v(-0.55, -0.75, -0.5), Color::new(0.82, 0.76, 0.66))];
        let all = illuminate(lamps, Color::new(0.34, 0.38, 0.44), Color::new(0.16, 0.17, 0.12));
        Arc::new(Illuminate { shadows: Shadows::Rays(1), ..all })
    };
    let points = scene.instances.iter().flat_map(|instance| &instance.geometry.mesh().points);
    let (low, high) = points
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
    let middle = v(0.0, (low.y + high.y) / 2.0, 0.0);
    let reach = (high.x.max(-low.x) * 2.0).max(high.y - low.y) * 1.05;
    let view = |pixels: u32| {
        let camera = Camera {
            position: middle + v(0.0, 0.0, 90.0),
            look_at: middle,
            parallel_height: Some(reach),
            ..Camera::default()
        };
        View::new(&camera, Raster::new(pixels, pixels).expect("a size")).expect("a camera")
    };
    let leaves = |pixels: u32| {
        let plan = RULE.plan().expect("a plan");
        scanline::render(&[scene.clone().into()], &view(pixels), plan, 0..pixels).expect("leaves")
    };
    let photograph = Arc::new(shown(&leaves(768).shaded(light()).expect("light")));
    println!(
        "{} faces, {} kB; a photograph of 768 x 768",
        scene.face_count(),
        Value::bytes(&*scene) / 1000
    );
    println!("pixels  leaves        card          their difference (rms, of 1)");
    for pixels in [32u32, 64, 128, 256, 512] {
        let clock = Instant::now();
        let spans = leaves(pixels);
        let faces = shown(&spans.shaded(light()).expect("light"));
        let first = clock.elapsed();
        let subject = Subject::new(&photograph).expect("a subject");
        let clock = Instant::now();
        let stand = BillboardsOptions { label: "tree".to_owned(), color: Color::WHITE, lit: false };
        let tree =
            Tree { picture: 0, foot: v(0.0, low.y, 0.0), height: high.y - low.y, mirrored: false };
        let plan = RULE.plan().expect("a plan");
        let card =
            billboards::image(vec![subject], vec![tree], stand, &view(pixels), plan, 0..pixels);
        let card = card.expect("a card");
        let picture = shown(&card);
        let second = clock.elapsed();
        let off =
            |(a, b): ([f32; 4], [f32; 4])| (0..4).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>() / 4.0;
        let sum: f32 = faces.pixels().zip(picture.pixels()).map(off).sum();
        println!(
            "{pixels:6}  {:6.1} ms {:5} kB {:6.2} ms {:5} kB  {:.4}",
            first.as_secs_f64() * 1e3,
            spans.bytes() / 1000,
            second.as_secs_f64() * 1e3,
            card.bytes() / 1000,
            (sum / (pixels * pixels) as f32).sqrt()
        );
    }
    println!("the photograph with its smaller sizes: {} kB", store().report().most / 1000);
}
