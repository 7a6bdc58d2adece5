//! Fog: its laws, and a thin wire in it.

use glam::{DVec3, dvec3 as v};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::image::Channel;
use spandrel_engine::light::sky::{Sky, SkyModel};
use spandrel_engine::raster::Raster;
use spandrel_engine::render::scanline::render;
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::scene::Scene;
use spandrel_engine::shade::{Fog, FogHeight, FogLaw};
use spandrel_tests::lights::{lamp, no_fog};
use spandrel_tests::scenes::{polygons, scene};
use std::collections::BTreeSet;
use std::sync::Arc;

/// What is seen of a black floor in white fog from 2 m above it, straight down in parallel or along a slope
/// in perspective.
fn fogged(fog: Fog, camera: &Camera) -> f32 {
    let mesh = polygons(&[vec![
        v(-1e3, 0.0, 1e3),
        v(1e3, 0.0, 1e3),
        v(1e3, 0.0, -1e3),
        v(-1e3, 0.0, -1e3),
    ]]);
    let mut scene = Scene::clone(&scene("floor", mesh));
    scene.materials.iter_mut().for_each(|material| material.color = Color::BLACK);
    let view = View::new(camera, Raster::new(3, 3).unwrap()).unwrap();
    let rule = Rule::Sloped(1);
    let image = render(&[Arc::new(scene).into()], &view, rule.plan().unwrap(), 0..3).unwrap();
    let image = image.shaded(Arc::new(fog)).unwrap();
    let channels = BTreeSet::from([Channel::Color]);
    let picture = resolve(&image, rule, &Framing::whole(view.raster()), &channels).unwrap();
    picture.float("R").unwrap()[4]
}

#[test]
fn fog_is_what_its_law_says_in_layers_too() {
    let down = Camera {
        position: v(0.0, 2.0, 0.0),
        look_at: DVec3::ZERO,
        parallel_height: Some(0.1),
        ..Camera::default()
    };
    let slope =
        Camera { position: v(0.0, 2.0, 3.0), look_at: v(0.0, 0.0, 0.0), ..Camera::default() };
    let length = 13f64.sqrt();
    let e = spandrel_engine::math::exp;
    let fog = |law| Fog { density: 0.3, law, ..no_fog() };
    let near = |shown: f32, expected: f64| {
        assert!((f64::from(shown) - expected).abs() < 1e-5, "{shown} {expected}");
    };
    near(fogged(fog(FogLaw::Exponential), &down), 1.0 - e(-0.6));
    near(fogged(fog(FogLaw::Exponential), &slope), 1.0 - e(-0.3 * length));
    near(fogged(Fog { start: 1.5, ..fog(FogLaw::Exponential) }, &down), 1.0 - e(-0.15));
    near(fogged(fog(FogLaw::Squared), &down), 1.0 - e(-0.36));
    near(fogged(Fog { start: 1.0, ..fog(FogLaw::Linear(5.0)) }, &down), 0.25);
    near(fogged(fog(FogLaw::Linear(1.0)), &down), 1.0);
    // A layer: the integral of the density along the way, from 2 m down to 0, straight or on a slope.
    let layer =
        |level| Fog { height: Some(FogHeight { level, falloff: 0.7 }), ..fog(FogLaw::Exponential) };
    for level in [0.0, 1.0] {
        let integral = 0.7 * (e(level / 0.7) - e((level - 2.0) / 0.7));
        near(fogged(layer(level), &down), 1.0 - e(-0.3 * integral));
        near(fogged(layer(level), &slope), 1.0 - e(-0.3 * integral * length / 2.0));
    }
    // Level ways are the limit.
    let level =
        Camera { position: v(0.0, 0.001, 0.0), look_at: v(1.0, 0.0, 0.0), ..Camera::default() };
    let way = (1.0f64 + 1e-6).sqrt();
    near(fogged(layer(0.0), &level), 1.0 - e(-0.3 * way * (1.0 - 0.0005 / 0.7)));
    // The sky's own brightness, in the direction of view.
    let sky = lamp(Sky::new(SkyModel::Uniform, DVec3::Y, 0.4).unwrap());
    let shown = fogged(Fog { sky: Some((sky, 2.0)), ..fog(FogLaw::Exponential) }, &down);
    // Down, it sends 0.4 / pi; under 2 lux a white surface shows 1.
    near(shown, 0.2 * (1.0 - e(-0.6)));
}

#[test]
fn a_thin_wire_before_a_mountain_in_mist_keeps_its_own_fog() {
    // A black wire a fifth of a pixel thick, 5 m away, before a white mountain at 500 m, in grey fog.
    let quad = |half: f64, z: f64| {
        vec![v(-half, -900.0, z), v(half, -900.0, z), v(half, 900.0, z), v(-half, 900.0, z)]
    };
    let camera = Camera { position: DVec3::ZERO, look_at: v(0.0, 0.0, -1.0), ..Camera::default() };
    let view = View::new(&camera, Raster::new(9, 9).unwrap()).unwrap();
    let pixel = 2.0 * 5.0 * spandrel_engine::math::tan(20f64.to_radians()) / 9.0;
    let mut mesh = polygons(&[quad(0.1 * pixel, -5.0), quad(900.0, -500.0)]);
    mesh.colors = vec![[0.0, 0.0, 0.0, 1.0]; 4].into_iter().chain(vec![[1.0; 4]; 4]).collect();
    let mut scene = Scene::clone(&scene("wire", mesh));
    scene.materials.iter_mut().for_each(|material| {
        material.color = Color::WHITE;
        material.unlit = true;
    });
    let rule = Rule::Sloped(16);
    let image = render(&[Arc::new(scene).into()], &view, rule.plan().unwrap(), 0..9).unwrap();
    let fog = Fog { density: 0.01, color: Color::grey(0.5), ..no_fog() };
    let channels = BTreeSet::from([Channel::Color, Channel::Z]);
    let framing = Framing::whole(view.raster());
    let through = |way: f64| spandrel_engine::math::exp(-0.01 * way);
    let (near, far) = (0.5 * (1.0 - through(5.0)), 0.5 + 0.5 * through(500.0));
    let right = 0.2 * near + 0.8 * far;
    let before = resolve(&image.shaded(Arc::new(fog)).unwrap(), rule, &framing, &channels).unwrap();
    let before = f64::from(before.float("R").unwrap()[4 * 9 + 4]);
    // After resolve there is one depth for the pixel, whichever is chosen.
    let flat = resolve(&image, rule, &framing, &channels).unwrap();
    let (color, z) = (flat.float("R").unwrap()[4 * 9 + 4], flat.float("Z").unwrap()[4 * 9 + 4]);
    let fogged = |way: f64| 0.5 + (f64::from(color) - 0.5) * through(way);
    let after = [f64::from(z), 5.0, 0.2 * 5.0 + 0.8 * 500.0].map(fogged);
    assert!((before - right).abs() < 1e-4, "{before} {right}");
    assert!(after.iter().all(|after| (after - right).abs() > 0.09), "{after:?} {right}");
}
