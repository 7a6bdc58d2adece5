//! What mirrors show of a whole image: lights and their layers, fog, what is beside, veils before and behind; and which
//! rays are followed for it.

#![allow(clippy::disallowed_methods, reason = "what is expected may be computed by anybody's sine")]

use glam::{DVec3, dvec3 as v};
use spandrel_engine::camera::Camera;
use spandrel_engine::color::Color;
use spandrel_engine::fragment::{Finish, Optics};
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::scene::{AlphaMode, Material, Scene};
use spandrel_engine::shade::{
    Fog, FogHeight, FogLaw, Illuminate, PictureColors, PictureFrame, Shadows, Trace,
};
use spandrel_engine::span::SpanImage;
use spandrel_engine::trace::{Accelerator, Voxels};
use spandrel_engine::watch::Watch;
use spandrel_tests::lights::{illuminate, no_fog, sun};
use spandrel_tests::random::Random;
use std::collections::BTreeMap;
use std::sync::Arc;

use crate::traced::{
    along, block, glass, level, made, mirror, plain, red, shown, spans, trace, traced, turned,
    view, with,
};

/// A picture, and what was counted while it was made.
fn counted(image: &SpanImage) -> (Image, BTreeMap<&'static str, u64>) {
    let watch = Watch::new();
    let picture = watch.run(|| shown(image, &[Channel::Color]));
    (picture, watch.counts())
}

#[test]
fn what_a_mirror_shows_is_lit_shadowed_and_fogged_as_everything() {
    // A mirror straight ahead, a wall behind the camera, which the mirror shows: lit by the sun, in part in
    // the shadow of a beam that is not seen, through fog on both ways.
    let wall = |x: [f64; 2], y: [f64; 2], z: f64| {
        vec![v(x[0], y[0], z), v(x[1], y[0], z), v(x[1], y[1], z), v(x[0], y[1], z)]
    };
    let white = Material { color: Color::WHITE, ..Material::default() };
    let parts = [
        (wall([-3.0, 3.0], [-3.0, 3.0], -5.0), mirror()),
        (turned(wall([-30.0, 30.0], [-30.0, 30.0], 10.0)), white.clone()),
        (wall([-30.0, 0.0], [3.0, 30.0], 9.0), white),
    ];
    let camera = Camera { position: DVec3::ZERO, look_at: v(0.0, 0.0, -1.0), ..Camera::default() };
    let image = spans(&[made("all", &parts)], &view(&camera, 40, 40));
    let lamp = || sun(v(0.0, -1.0, 0.2), Color::WHITE);
    let cosine = 0.2 / 1.04f32.sqrt();
    for shadows in [Shadows::Volumes, Shadows::Rays(1), Shadows::Off] {
        let light = illuminate(vec![lamp()], Color::BLACK, Color::BLACK);
        let light = Illuminate { shadows, ..light };
        let lit = image.shaded(Arc::new(light)).unwrap();
        let fog = Fog { density: 0.05, color: Color::BLACK, ..no_fog() };
        let all = traced(&lit, trace()).shaded(Arc::new(fog)).unwrap();
        let picture = shown(&all, &[Channel::Color, Channel::Light]);
        let red = picture.float("R").unwrap();
        // Mirrored, left is left: the beam is on the left, its shadow too.
        for (x, is_dark) in [(17, true), (22, false)] {
            let (dx, dy) = ((x as f64 + 0.5 - 20.0) / 20.0, 0.5 / 20.0);
            let tan = 20f64.to_radians().tan();
            let way = (5.0 + 15.0) * (1.0 + (dx * dx + dy * dy) * tan * tan).sqrt();
            let clear = (-0.05 * way).exp() as f32;
            let dark = is_dark && shadows != Shadows::Off;
            let expected = if dark { 0.0 } else { cosine * clear };
            let seen = red[19 * 40 + x];
            assert!((seen - expected).abs() < 1e-5, "{shadows:?} {x}: {seen} {expected}");
        }
        // The light's layer is the picture: nothing else gives light.
        let layer = picture.float("light_sun.R").unwrap();
        assert_eq!(layer, red);
    }
}

/// A room with a mirror, some things and a lamp.
fn room() -> Vec<Arc<Scene>> {
    let mut random = Random::new(3);
    let shiny = Optics { reflect: Color::grey(0.4), fresnel: false, ..Optics::default() };
    let finish = Finish { optics: Some(shiny), ..Finish::default() };
    let floor = Material { finish, ..Material::default() };
    let mut things = Vec::new();
    for i in 0..30 {
        let low = v(random.between(-2.0, 1.8), 0.0, random.between(-2.0, 1.8));
        let size = v(0.2, random.between(0.1, 1.0), 0.2);
        let material = match i % 5 {
            0 => glass(1.5),
            1 => floor.clone(),
            _ => Material { color: Color::grey(0.2 + i as f32 / 50.0), ..Material::default() },
        };
        things.extend(block(low, low + size).into_iter().map(|face| (face, material.clone())));
    }
    let ground = (level([-3.0, 3.0], 0.0, [-3.0, 3.0]), floor);
    vec![made("ground", &[ground]), made("things", &things)]
}

fn lit_room(strength: f32) -> (SpanImage, Illuminate) {
    let camera =
        Camera { position: v(1.0, 1.5, 4.0), look_at: v(0.0, 0.2, 0.0), ..Camera::default() };
    let image = spans(&room(), &view(&camera, 96, 64));
    let lamps = vec![sun(v(-0.4, -1.0, -0.3), Color::grey(strength))];
    let light = illuminate(lamps, Color::grey(0.1), Color::grey(0.1));
    (image, Illuminate { shadows: Shadows::Volumes, ..light })
}

#[test]
fn the_grid_shows_what_the_tree_shows_and_layers_sum_to_the_picture() {
    let (image, light) = lit_room(1.0);
    let lit = image.shaded(Arc::new(light)).unwrap();
    let tree = red(&traced(&lit, Trace { rays: 2, ..trace() }));
    let window = Some([v(-1.0, 0.0, -2.0), v(1.0, 0.3, 2.0)]);
    for voxels in [Voxels::default(), Voxels { window, size: Some(0.11), ..Voxels::default() }] {
        let accelerator = Accelerator::Grid(voxels);
        let (image, light) = lit_room(1.0);
        let lit = image.shaded(Arc::new(light)).unwrap();
        assert_eq!(red(&traced(&lit, Trace { rays: 2, accelerator, ..trace() })), tree);
    }
    let picture = shown(&traced(&lit, trace()), &[Channel::Color, Channel::Light]);
    let layers =
        ["light_sun.R", "light_ambient.R", "rest.R"].map(|name| picture.float(name).unwrap());
    for (at, all) in picture.float("R").unwrap().iter().enumerate() {
        let sum: f32 = layers.iter().map(|layer| layer[at]).sum();
        assert!((sum - all).abs() < 1e-5 * all.max(1.0), "{sum} {all}");
    }
}

#[test]
fn rays_start_only_where_surfaces_mirror_and_are_kept() {
    let (image, light) = lit_room(1.0);
    let plainly = image.shaded(Arc::new(light.clone())).unwrap();
    let (_, first) = counted(&traced(&plainly, trace()));
    assert!(first["rays"] > 1000);
    // A dimmed light is a sum in mirrors too: no ray is new, and the picture is that of a new image.
    let (again, dimmed) = lit_room(0.25);
    let known = traced(&image.shaded(Arc::new(dimmed.clone())).unwrap(), trace());
    let new = traced(&again.shaded(Arc::new(dimmed)).unwrap(), trace());
    let ((known, of_known), (new, of_new)) = (counted(&known), counted(&new));
    assert_eq!(of_known.get("rays"), None);
    assert_eq!(known.float("R"), new.float("R"));
    assert_eq!(of_new["rays"], first["rays"]);
    // Nothing mirrors: no rays, and the picture is the one without.
    let dull = made("dull", &[(level([-3.0, 3.0], 0.0, [-3.0, 3.0]), plain(Color::WHITE))]);
    let image = spans(&[dull], image.view());
    let (picture, counts) = counted(&traced(&image, trace()));
    assert_eq!(counts.get("rays"), None);
    assert_eq!(picture.float("R"), shown(&image, &[Channel::Color]).float("R"));
}

#[test]
fn images_beside_are_seen_in_mirrors_without_the_fog_of_the_others() {
    let (image, light) = lit_room(1.0);
    let sky =
        made("sky", &[(turned(level([-99.0, 99.0], 50.0, [-99.0, 99.0])), plain(Color::WHITE))]);
    let sky = spans(&[sky], image.view());
    let lit = image.shaded(Arc::new(light)).unwrap();
    let seen = lit.shaded_beside(Arc::new(trace()), &[&sky]).unwrap();
    // Light through black fog is what the fog leaves; the sky's, in mirrors, is not less by its way there.
    let (with, without) = (red(&seen), red(&traced(&lit, trace())));
    assert!(with.iter().sum::<f32>() > without.iter().sum::<f32>() * 1.05);
    let fog = Fog { density: 0.1, color: Color::BLACK, ..no_fog() };
    let [with, without] = [&seen, &traced(&lit, trace())]
        .map(|image| red(&image.shaded(Arc::new(fog.clone())).unwrap()));
    // The floor's middle: 4 m from the eye.
    let brightest = with.iter().zip(&without).map(|(a, b)| a - b).fold(0.0, f32::max);
    assert!(brightest > 0.4 * (-0.1f32 * 6.0).exp() && brightest < 0.4, "{brightest}");
}

#[test]
fn a_picture_put_on_surfaces_is_not_put_on_what_mirrors_show() {
    let eye = along(v(0.0, -1.0, -1.0).normalize(), 0.1, 4);
    let wall = vec![v(-9.0, 0.1, -4.0), v(9.0, 0.1, -4.0), v(9.0, 9.0, -4.0), v(-9.0, 9.0, -4.0)];
    let floor = (level([-9.0, 9.0], 0.0, [-9.0, 9.0]), mirror());
    let image = spans(&[made("all", &[floor, (wall, plain(Color::grey(0.4)))])], &eye);
    let frame = PictureFrame { size: (4, 4), corner: (0, 0), part: (4, 4) };
    let white = PictureColors::new(frame, [[1.0; 4]; 16].into_iter()).unwrap();
    let painted = image.shaded(Arc::new(white)).unwrap();
    assert_eq!((red(&painted)[5], red(&traced(&painted, trace()))[5]), (1.0, 0.4));
}

/// Sheets across the view, one behind the other, and a wall behind them.
fn sheets(sheet: &Material, count: u32, wall: Option<Material>) -> SpanImage {
    let across = |z: f64| vec![v(-9.0, -9.0, z), v(9.0, -9.0, z), v(9.0, 9.0, z), v(-9.0, 9.0, z)];
    let mut parts: Vec<_> =
        (0..count).map(|i| (across(-1.0 - f64::from(i)), sheet.clone())).collect();
    parts.extend(wall.map(|wall| (across(-200.0), wall)));
    spans(&[made("sheets", &parts)], &along(v(0.0, 0.0, -1.0), 0.1, 2))
}

#[test]
fn what_is_behind_is_seen_once_however_it_is_let_through() {
    for (alpha, refract, reflect) in
        [(1.0, 1.0, 0.0), (0.2, 1.0, 0.0), (0.0, 1.0, 0.0), (0.4, 0.7, 0.3)]
    {
        let [reflect, refract] = [reflect, refract].map(Color::grey);
        let optics = Optics { reflect, refract, index: 1.0, fresnel: false, absorb: Color::BLACK };
        let mode = if alpha < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque };
        let sheet = Material { alpha, alpha_mode: mode, ..with(optics) };
        let image = sheets(&sheet, 1, Some(plain(Color::WHITE)));
        // A white world all around: nothing is lost, nothing is added.
        let white = Trace { background: Color::WHITE, ..trace() };
        let seen = red(&traced(&image, white))[0];
        assert!((seen - 1.0).abs() < 1e-6, "alpha {alpha}, refract {refract:?}: {seen}");
    }
    // What absorbs two colours lets the background through in the third.
    let absorb = Color::new(0.0, 5.0, 5.0);
    let tinted = Optics {
        refract: Color::WHITE,
        reflect: Color::BLACK,
        index: 1.0,
        absorb,
        ..Optics::default()
    };
    let seen =
        traced(&sheets(&with(tinted), 1, None), Trace { background: Color::WHITE, ..trace() });
    let seen = shown(&seen, &[Channel::Color]);
    assert_eq!(["R", "G"].map(|name| seen.float(name).unwrap()[0]), [1.0, 0.0]);
}

#[test]
fn rays_go_through_any_number_of_veils_and_are_not_followed_where_nothing_is_left() {
    let veil = Material { alpha: 0.01, alpha_mode: AlphaMode::Blend, ..plain(Color::BLACK) };
    let pane = glass(1.0);
    let across = |z: f64| vec![v(-9.0, -9.0, z), v(9.0, -9.0, z), v(9.0, 9.0, z), v(-9.0, 9.0, z)];
    let mut parts = vec![(across(-0.5), pane), (across(-90.0), plain(Color::WHITE))];
    parts.extend((1..80).map(|i| (across(-f64::from(i)), veil.clone())));
    let image = spans(&[made("veils", &parts)], &along(v(0.0, 0.0, -1.0), 0.1, 2));
    let seen = red(&traced(&image, trace()))[0];
    assert!((seen - 0.99f32.powi(79)).abs() < 1e-4, "{seen}");
    // Red is mirrored, the rest is let through: of what did both nothing is left.
    let optics = Optics {
        reflect: Color::new(1.0, 0.0, 0.0),
        refract: Color::new(0.0, 1.0, 1.0),
        index: 1.0,
        fresnel: false,
        absorb: Color::BLACK,
    };
    let image = sheets(&with(optics), 20, Some(plain(Color::WHITE)));
    let image = traced(&image, Trace { depth: 20, ..trace() });
    let rays = counted(&image).1["rays"];
    assert!(rays < 4 * 22 * 2, "{rays}");
}

#[test]
fn fog_goes_on_behind_a_mirror_where_it_was_before_it() {
    // A wall behind the camera in a mirror, and as far ahead without one.
    let across =
        |z: f64| vec![v(-90.0, -90.0, z), v(90.0, -90.0, z), v(90.0, 90.0, z), v(-90.0, 90.0, z)];
    let wall = plain(Color::new(1.0, 0.5, 0.25));
    let mirrored = [(across(-6.0), mirror()), (turned(across(30.0)), wall.clone())];
    let ahead = [(across(-42.0), wall)];
    let eye = along(v(0.0, 0.0, -1.0), 0.1, 2);
    let [mirrored, ahead] = [&mirrored[..], &ahead].map(|parts| spans(&[made("all", parts)], &eye));
    let mirrored = traced(&mirrored, trace());
    let air = Fog { density: 0.03, color: Color::grey(0.7), ..no_fog() };
    for law in [FogLaw::Exponential, FogLaw::Squared, FogLaw::Linear(70.0), FogLaw::Linear(50.0)] {
        for start in [0.0, 13.0, 26.0, 40.0, 90.0] {
            for height in [None, Some(FogHeight { level: 0.5, falloff: 3.0 })] {
                let fog = Fog { law, start, height, ..air.clone() };
                let seen =
                    |image: &SpanImage| red(&image.shaded(Arc::new(fog.clone())).unwrap())[0];
                let [a, b] = [&mirrored, &ahead].map(seen);
                assert!((a - b).abs() < 1e-5, "{law:?} from {start}, {height:?}: {a} {b}");
            }
        }
    }
}
