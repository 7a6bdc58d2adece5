//! Billboards against leaves: a tree of faces, and a card with its photograph, at the same size on screen.
//! `cargo run --release -p spandrel-tests --example foliage`.

use glam::{DVec2, DVec3, dvec3 as v};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::graph::Value;
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::light::Lamp;
use spandrel_engine::light::sky::{Sky, SkyModel};
use spandrel_engine::raster::Raster;
use spandrel_engine::render::billboards::{self, BillboardsOptions, Subject, Tree};
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::shade::{Illuminate, Shadows};
use spandrel_engine::span::SpanImage;
use spandrel_engine::texture::store;
use spandrel_tests::lights::{illuminate, sun};
use spandrel_tests::tree::{Kind, grow, grow_leaves, kinds};
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
        let stand = BillboardsOptions {
            label: "tree".to_owned(),
            color: Color::WHITE,
            lit: false,
            crown: 0.0,
            transmit: Color::BLACK,
        };
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
    from_all_sides(kind, &view, (low.y, high.y));
}

/// By how much cards are off under a sun from five sides, and faint light from everywhere: of each kind of card with the
/// brightness that serves it best. Both the tree and its photograph, which was taken under an even sky, have leaves that
/// half of the light goes through.
fn from_all_sides(kind: &Kind, view: &dyn Fn(u32) -> View, (low, high): (f64, f64)) {
    let scene = grow_leaves(kind, Color::grey(0.5));
    let plan = || RULE.plan().expect("a plan");
    let lit = |image: &SpanImage, lamps: Vec<Lamp>, rays: u32| {
        let (above, below) = (Color::grey(0.2), Color::grey(0.1));
        let all = Illuminate { shadows: Shadows::Rays(rays), ..illuminate(lamps, above, below) };
        shown(&image.shaded(Arc::new(all)).expect("light"))
    };
    let leaves = |pixels: u32| {
        scanline::render(&[scene.clone().into()], &view(pixels), plan(), 0..pixels).expect("leaves")
    };
    let sky = Lamp::new(
        "sky",
        true,
        Color::WHITE,
        Arc::new(Sky::new(SkyModel::Uniform, DVec3::Y, 0.0).expect("a sky")),
    );
    let photograph = Arc::new(lit(&leaves(768), vec![sky], 16));
    let sides = [
        ("front", v(0.3, -0.5, -0.8)),
        ("left", v(0.95, -0.5, -0.1)),
        ("above", v(0.1, -1.0, -0.1)),
        ("right, behind", v(-0.7, -0.5, 0.6)),
        ("behind", v(0.1, -0.4, 0.9)),
    ];
    let names = sides.map(|(name, _)| format!("{name:>14}")).concat();
    println!("pixels  crown transmit  color  rms  {names}");
    for pixels in [32u32, 128] {
        let spans = leaves(pixels);
        let suns = sides.map(|(_, along)| sun(along, Color::WHITE));
        let faces: Vec<Image> = suns.iter().map(|sun| lit(&spans, vec![sun.clone()], 1)).collect();
        for (crown, transmit) in [(0.0, 0.0), (0.0, 0.5), (0.5, 0.5), (1.0, 0.5)] {
            let subject = Subject::new(&photograph).expect("a subject");
            let stand = BillboardsOptions {
                label: "tree".to_owned(),
                color: Color::WHITE,
                lit: true,
                crown,
                transmit: Color::grey(transmit),
            };
            let (foot, height) = (v(0.0, low, 0.0), high - low);
            let tree = Tree { picture: 0, foot, height, mirrored: false };
            let card = billboards::image(
                vec![subject],
                vec![tree],
                stand,
                &view(pixels),
                plan(),
                0..pixels,
            );
            let card = card.expect("a card");
            let pictures: Vec<Image> =
                suns.iter().map(|sun| lit(&card, vec![sun.clone()], 1)).collect();
            let sums = faces.iter().zip(&pictures).map(|(faces, picture)| {
                let pairs = faces.pixels().zip(picture.pixels());
                let products = pairs.map(|(a, b)| {
                    let sum = |x: [f32; 4], y: [f32; 4]| (0..3).map(|k| x[k] * y[k]).sum::<f32>();
                    [sum(a, a), sum(a, b), sum(b, b), a[3]]
                });
                products.fold([0.0f32; 4], |sum, part| [0, 1, 2, 3].map(|k| sum[k] + part[k]))
            });
            let sums: Vec<[f32; 4]> = sums.collect();
            let all = sums.iter().fold([0.0f32; 4], |a, b| [0, 1, 2, 3].map(|k| a[k] + b[k]));
            let color = all[1] / all[2];
            let off = |[aa, ab, bb, covered]: [f32; 4]| {
                ((aa - 2.0 * color * ab + color * color * bb) / (3.0 * covered)).max(0.0).sqrt()
            };
            let each = sums.iter().map(|sums| format!("{:14.4}", off(*sums))).collect::<String>();
            println!("{pixels:6}  {crown:5.1} {transmit:8.1} {color:6.2} {:.4}  {each}", off(all));
        }
    }
}
