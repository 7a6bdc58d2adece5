//! Lighting anew on visibility that is solved: lights are summed, dimmed and moved each for itself, move along with their
//! surfaces, and make up the picture layer by layer.

use glam::{DVec2, DVec3};
use spandrel_engine::color::Color;
use spandrel_engine::fragment::Gloss;
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::light::sky::{Sky, SkyModel};
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::scene::Scene;
use spandrel_engine::shade::{Fog, Recolor, Shadows};
use spandrel_engine::span::SpanImage;
use spandrel_tests::lights::no_fog;
use spandrel_tests::lights::{lamp, sun};
use std::collections::BTreeSet;
use std::sync::Arc;

use crate::shadows::{boxes, level, lit, picture, point_lamp, red, scene, side_view, spans, v};

#[test]
fn lights_add_up_and_threads_do_not_matter() {
    let image = spans(&[scene("boxes", boxes(2, 10, 4.0))], &side_view(4.0, 96, 64), 4);
    let lamps = || {
        vec![
            sun((-0.6, -1.0, 0.35), Color::new(0.5, 0.4, 0.3)),
            point_lamp(v(1.0, 3.0, 1.5)),
            lamp(Sky::new(SkyModel::Overcast, DVec3::Y, 0.1).unwrap()),
        ]
    };
    let all = picture(&lit(&image, lamps(), Shadows::Volumes));
    let each: Vec<Image> = lamps()
        .into_iter()
        .map(|lamp| picture(&lit(&image, vec![lamp], Shadows::Volumes)))
        .collect();
    for i in 0..red(&all).len() {
        let sum: f32 = each.iter().map(|one| red(one)[i]).sum();
        assert!((sum - red(&all)[i]).abs() < 1e-5 * sum.max(1.0));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let fresh = || spans(&[scene("boxes", boxes(2, 10, 4.0))], &side_view(4.0, 96, 64), 4);
    let alone = pool.install(|| picture(&lit(&fresh(), lamps(), Shadows::Volumes)));
    assert_eq!(red(&alone), red(&all));
}

#[test]
fn a_dimmed_light_is_a_sum_and_a_moved_one_is_itself_alone() {
    let image = spans(&[scene("boxes", boxes(3, 10, 4.0))], &side_view(4.0, 96, 64), 4);
    let lamps = |dim: f32, x: f64, is_on: bool| {
        let mut first = sun((-0.6, -1.0, 0.35), Color::grey(dim));
        first.on = is_on;
        vec![first, point_lamp(v(x, 3.0, 1.5))]
    };
    let shown =
        |image: &SpanImage, dim, x, on| picture(&lit(image, lamps(dim, x, on), Shadows::Volumes));
    let first = shown(&image, 1.0, 1.0, true);
    let kept = image.memo().count();
    // Dimmed, coloured, switched off and on: nothing is computed anew.
    let dimmed = shown(&image, 0.5, 1.0, true);
    assert_eq!(image.memo().count(), kept);
    let off = shown(&image, 1.0, 1.0, false);
    assert_eq!(image.memo().count(), kept);
    assert_eq!(red(&shown(&image, 1.0, 1.0, true)), red(&first));
    for i in 0..red(&first).len() {
        let expected = (red(&first)[i] + red(&off)[i]) / 2.0;
        assert!((red(&dimmed)[i] - expected).abs() < 1e-6);
    }
    // Moved: that light is new, the other is not. Its channel, and its shadows.
    let moved = shown(&image, 1.0, 1.5, true);
    let (keys, _) = image.memo().count();
    assert!(keys > kept.0);
    let fresh = spans(&[scene("boxes", boxes(3, 10, 4.0))], &side_view(4.0, 96, 64), 4);
    assert_eq!(red(&shown(&fresh, 1.0, 1.5, true)), red(&moved));
}

#[test]
fn what_is_moved_after_it_is_lit_takes_its_shadows_along() {
    let image = spans(&[scene("boxes", boxes(3, 10, 4.0))], &side_view(4.0, 96, 64), 4);
    for shadows in [Shadows::Volumes, Shadows::Rays(16)] {
        let shaded = lit(&image, vec![sun((-0.6, -1.0, 0.35), Color::WHITE)], shadows);
        let still = picture(&shaded);
        let moved = picture(&shaded.moved(7.0, 12, 0..64).unwrap());
        // Away from the raster's sides, where slopes end. Rays are spread by chance, which moves too.
        let places = (0..60).flat_map(|y| (2..88).map(move |x| (x, y)));
        let off = places.map(|(x, y)| red(&still)[y * 96 + x] - red(&moved)[(y + 3) * 96 + x + 7]);
        let off: Vec<f32> = off.map(f32::abs).collect();
        let worst = off.iter().copied().fold(0.0, f32::max);
        match shadows {
            Shadows::Volumes => assert!(worst < 1e-4, "{worst}"),
            _ => assert!(off.iter().filter(|off| **off > 0.1).count() < off.len() / 100),
        }
        let nearer = picture(&shaded.with_depths(1.25, 0.0).unwrap());
        let off = red(&still).iter().zip(red(&nearer)).filter(|(a, b)| (*a - *b).abs() > 0.1);
        assert!(off.count() < red(&still).len() / 100, "{shadows:?}");
    }
}

#[test]
fn layers_of_lights_sum_to_the_picture() {
    // Boxes, panes over them, gloss, glow, a fog, a correction.
    let mut mesh = boxes(4, 8, 4.0);
    mesh.materials = vec!["pane".into()];
    let ring: Vec<u32> =
        level([-2.0, 2.0], 1.5, [-2.0, 2.0]).iter().map(|p| mesh.add_point(*p)).collect();
    mesh.add_polygon(&ring, Some(0)).unwrap();
    let mut scene = Scene::clone(&scene("boxes", mesh));
    scene.materials[0].finish.gloss = Gloss::Phong { share: 0.3, exponent: 12.0 };
    scene.materials[0].finish.glow = Color::new(0.02, 0.01, 0.0);
    let image = spans(&[Arc::new(scene)], &side_view(4.0, 64, 48), 4);
    let lamps = || {
        let mut first = sun((-0.6, -1.0, 0.35), Color::new(0.5, 0.4, 0.3));
        first.name = "key light".into();
        vec![first, point_lamp(v(1.0, 3.0, 1.5))]
    };
    let fog = Fog { density: 0.05, color: Color::new(0.5, 0.6, 0.7), start: 1.0, ..no_fog() };
    let grade =
        Recolor { multiply: Color::new(1.1, 0.9, 1.0), add: Color::grey(0.01), saturation: 0.7 };
    let shaded = lit(&image, lamps(), Shadows::Volumes);
    let shaded = shaded.shaded(Arc::new(fog)).unwrap().shaded(Arc::new(grade)).unwrap();
    let framing = Framing::scaled(image.view().raster(), DVec2::ONE).unwrap();
    let both = BTreeSet::from([Channel::Color, Channel::Light]);
    let shown = resolve(&shaded, Rule::Sloped(4), &framing, &both).unwrap();
    let layers = ["light_key_light", "light_point", "light_ambient", "rest"];
    for axis in ["R", "G", "B"] {
        let parts = layers.map(|layer| shown.float(&format!("{layer}.{axis}")).unwrap());
        for (i, whole) in shown.float(axis).unwrap().iter().enumerate() {
            let sum: f32 = parts.iter().map(|part| part[i]).sum();
            assert!((sum - whole).abs() < 1e-5, "{axis} {i}: {sum} {whole}");
        }
        assert!(parts[0].iter().any(|v| *v > 0.01) && parts[1].iter().any(|v| *v > 0.01));
    }
    assert_eq!(shown.float("R"), picture(&shaded).float("R"));
}
