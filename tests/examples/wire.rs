//! Fog before and after resolve: wires and a mast in front of a mountain in mist. Writes both pictures, and
//! how far each is from one of 8 x 8 times as many pixels.
//!
//! `cargo run --release -p spandrel-tests --example wire -- FOLDER`

use glam::{DVec2, DVec3};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::image::{Channel, Image, Samples, file};
use spandrel_engine::math;
use spandrel_engine::raster::Raster;
use spandrel_engine::render::scanline::render;
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::scene::{Document, Material, Object, Plan, Scene, Shape};
use spandrel_engine::shade::Fog;
use spandrel_tests::lights::{illuminate, no_fog, sun};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

const DENSITY: f32 = 0.004;
const MIST: Color = Color { r: 0.62, g: 0.68, b: 0.74 };

fn main() {
    let folder = std::env::args().nth(1).expect("a folder");
    let scene = Arc::new(scene());
    let sizes = [(400u32, 250u32), (3200, 2000)];
    let [shown, large] = sizes.map(|(width, height)| {
        let camera = Camera {
            position: DVec3::new(0.0, 6.0, 14.0),
            look_at: DVec3::new(0.0, 11.0, -20.0),
            field_of_view: 48.0,
            ..Camera::default()
        };
        let view = View::new(&camera, Raster::new(width, height).unwrap()).unwrap();
        let rule = Rule::Sloped(8);
        let image =
            render(&[scene.clone().into()], &view, rule.plan().unwrap(), 0..height).unwrap();
        let light = illuminate(
            vec![sun((-0.5, -0.8, -0.6), Color::grey(0.8))],
            Color::grey(0.25),
            Color::grey(0.1),
        );
        let image = image.shaded(Arc::new(light)).unwrap();
        let fog = Fog { density: DENSITY, color: MIST, ..no_fog() };
        let misty = image.shaded(Arc::new(fog)).unwrap();
        let channels = BTreeSet::from([Channel::Color, Channel::Z]);
        let framing = Framing::scaled(view.raster(), DVec2::ONE).unwrap();
        (
            resolve(&misty, rule, &framing, &channels).unwrap(),
            resolve(&image, rule, &framing, &channels).unwrap(),
            view,
        )
    });
    let before = &shown.0;
    let after = fogged_later(&shown.1, &shown.2);
    let truth = shrunk(&large.0, 8, sizes[0]);
    for (name, picture) in [("before", before), ("after", &after), ("truth", &truth)] {
        let (mut sum, mut worst) = (0.0f64, 0.0f32);
        for axis in ["R", "G", "B"] {
            for (a, b) in picture.float(axis).unwrap().iter().zip(truth.float(axis).unwrap()) {
                sum += f64::from(a - b) * f64::from(a - b);
                worst = worst.max((a - b).abs());
            }
        }
        let count = 3 * truth.window.area();
        println!("{name}: RMSE {:.4}, worst {worst:.3}", (sum / count as f64).sqrt());
        file::write(picture, &Path::new(&folder).join(format!("wire_{name}.png")), None).unwrap();
    }
}

/// What fog does to finished pixels, by the Z channel.
fn fogged_later(image: &Image, view: &View) -> Image {
    let mut made = image.clone();
    let z = image.float("Z").unwrap().to_vec();
    let width = image.size.0;
    for (axis, fog) in ["R", "G", "B"].into_iter().zip(MIST.to_array()) {
        let mut values = image.float(axis).unwrap().to_vec();
        for (i, value) in values.iter_mut().enumerate() {
            let (x, y) = (i as u32 % width, i as u32 / width);
            let depth = view.depth(f64::from(z[i]));
            let way = view.eye_point(f64::from(x) + 0.5, f64::from(y) + 0.5, depth).length();
            let through = math::expf(-DENSITY * way as f32);
            let alpha = image.float("A").unwrap()[i];
            *value = *value * through + fog * (1.0 - through) * alpha;
        }
        made.insert(axis, Samples::Float(values)).unwrap();
    }
    made
}

fn shrunk(image: &Image, by: u32, size: (u32, u32)) -> Image {
    let mut made = Image::new(size, spandrel_engine::image::Window::whole(size.0, size.1));
    for axis in ["R", "G", "B", "A"] {
        let all = image.float(axis).unwrap();
        let mean = |i: u32| {
            let (x, y) = (i % size.0 * by, i / size.0 * by);
            let at = |k: u32| all[((y + k / by) * image.size.0 + x + k % by) as usize];
            (0..by * by).map(at).sum::<f32>() / (by * by) as f32
        };
        made.insert(axis, Samples::Float((0..size.0 * size.1).map(mean).collect())).unwrap();
    }
    made
}

fn scene() -> Scene {
    let mut document = Document::default();
    for (name, color) in
        [("rock", Color::new(0.32, 0.3, 0.27)), ("steel", Color::grey(0.03)), ("air", MIST)]
    {
        let unlit = name == "air";
        document
            .materials
            .insert(name.to_owned(), Material { color, unlit, ..Material::default() });
    }
    let mut root = Object::default();
    let backdrop = vec![
        DVec3::new(-4e3, -500.0, -2500.0),
        DVec3::new(4e3, -500.0, -2500.0),
        DVec3::new(4e3, 4e3, -2500.0),
        DVec3::new(-4e3, 4e3, -2500.0),
    ];
    root.children.push(
        Object::new("air", Shape::Polygon { outline: backdrop, holes: vec![], seals: vec![] })
            .of("air"),
    );
    let mountain = Shape::Terrain {
        size: [900.0, 500.0],
        height: 330.0,
        roughness: 0.52,
        levels: 7,
        seed: 5,
        smooth: false,
    };
    root.children.push(Object::new("mountain", mountain).moved([0.0, -60.0, -560.0]).of("rock"));
    let bar = |name: &str, from: DVec3, to: DVec3, radius: f64| {
        let profile =
            vec![[-radius, -radius], [radius, -radius], [radius, radius], [-radius, radius]];
        let shape = Shape::Sweep { profile, path: vec![from, to], closed: true, ring: false };
        Object::new(name, shape).of("steel")
    };
    let p = DVec3::new;
    for (i, x) in [-7.0, 7.5].into_iter().enumerate() {
        let foot = p(x, -2.0, -6.0 - 9.0 * i as f64);
        let head = foot + p(0.0, 24.0, 0.0);
        for (k, dx) in [-1.0, 1.0].into_iter().enumerate() {
            root.children.push(bar(&format!("leg {i} {k}"), foot + p(dx, 0.0, 0.0), head, 0.05));
        }
        for k in 0..9 {
            let t = f64::from(k) / 9.0;
            let (a, b) = (
                foot.lerp(head, t) + p(t - 1.0, 0.0, 0.0),
                foot.lerp(head, t + 0.11) + p(0.89 - t, 0.0, 0.0),
            );
            root.children.push(bar(&format!("brace {i} {k}"), a, b, 0.025));
        }
    }
    for k in 0..7 {
        let y = 9.0 + 1.7 * f64::from(k);
        let at =
            |t: f64| p(-60.0 + 120.0 * t, y + 9.0 * (t - 0.5) * (t - 0.5) * 4.0, 2.0 - 20.0 * t);
        for i in 0..24 {
            let (a, b) = (f64::from(i) / 24.0, f64::from(i + 1) / 24.0);
            root.children.push(bar(&format!("wire {k} {i}"), at(a), at(b), 0.012));
        }
    }
    document.plans.push(Plan { root, ..Plan::default() });
    let key = spandrel_engine::key::Key::of(&document);
    Scene::new(&document, None, "wires", key, Path::new("")).unwrap()
}
