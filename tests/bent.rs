//! Faces that are not quite flat, as surveys have them: they cast no shadow on themselves, and theirs on others.

use glam::DVec3;
use spandrel_engine::camera::Camera;
use spandrel_engine::color::Color;
use spandrel_engine::key::Key;
use spandrel_engine::resolve::Rule;
use spandrel_engine::scene::read::text;
use spandrel_engine::scene::{Face, Mesh, Scene};
use spandrel_engine::shade::{Illuminate, Shadows};
use spandrel_tests::lights::{self, illuminate};
use spandrel_tests::random::Random;
use spandrel_tests::scenes;
use std::path::Path;
use std::sync::Arc;

use crate::extremes::{picture, render};

#[test]
fn walls_that_are_not_quite_flat_cast_no_shadow_on_themselves() {
    // Coordinates of a survey, to a millimetre, far from the origin: a wall with windows, none of whose corners lies
    // exactly in its plane, and a panel that is bent as little.
    let mut random = Random::new(11);
    let (east, north) = (678_000.0, 5_403_000.0);
    let mut corner = |x: f64, y: f64| {
        let off = (random.unit() - 0.5) * 1.4e-3;
        DVec3::new(east + x, y, -north + off)
    };
    let mut wall = |low: (f64, f64), high: (f64, f64)| {
        [(low.0, low.1), (high.0, low.1), (high.0, high.1), (low.0, high.1)]
            .map(|(x, y)| corner(x, y))
            .to_vec()
    };
    let mut mesh = Mesh::default();
    let add = |mesh: &mut Mesh, points: Vec<DVec3>| -> Vec<u32> {
        points.into_iter().map(|p| mesh.add_point(p)).collect()
    };
    let outline = add(&mut mesh, wall((0.0, 0.0), (16.0, 12.0)));
    let mut holes = Vec::new();
    for i in 0..5 {
        for j in 0..4 {
            let (x, y) = (1.5 + 3.0 * f64::from(i), 1.0 + 3.0 * f64::from(j));
            let mut hole = add(&mut mesh, wall((x, y), (x + 1.2, y + 1.5)));
            hole.reverse();
            holes.push(hole);
        }
    }
    mesh.add_face(Face { outline, holes, ..Face::default() }).unwrap();
    let outline = add(&mut mesh, wall((18.0, 0.0), (34.0, 12.0)));
    mesh.add_face(Face { outline, ..Face::default() }).unwrap();
    let scene = scenes::scene("walls", mesh);
    assert_eq!(scene.instances[0].geometry.mesh().face_count(), 2, "they count as flat");
    let camera = Camera {
        position: DVec3::new(east + 12.0, 9.0, -north + 30.0),
        look_at: DVec3::new(east + 17.0, 6.0, -north),
        ..Camera::default()
    };
    let image = render(&scene, &camera, (160, 90), Rule::Sloped(4));
    let lit = |shadows: Shadows| {
        let lamps = vec![lights::sun((-0.5, -0.4, -0.8), Color::WHITE)];
        let light = Illuminate { shadows, ..illuminate(lamps, Color::BLACK, Color::BLACK) };
        picture(&image.shaded(Arc::new(light)).unwrap(), Rule::Sloped(4))
    };
    let open = lit(Shadows::Off);
    for shadows in [Shadows::Volumes, Shadows::Rays(4)] {
        let shown = lit(shadows);
        let pairs = open.float("R").unwrap().iter().zip(shown.float("R").unwrap());
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0f32, f32::max);
        assert!(worst < 1e-6, "{shadows:?}: {worst}");
    }
}

#[test]
fn faces_that_are_not_quite_flat_cast_their_shadows_on_others() {
    // An L over a floor: flat; bent within what counts as flat; and with a drawn edge, which is taken as flat however bent.
    let slab = |bend: f64, edge: &str| {
        format!(
            "Scene(materials: {{\"w\": (color: 1)}}, plans: [(name: \"p\", root: (material: \"w\", children: [
            (name: \"floor\", shape: Polygon(outline: [(-5, 0, 5), (5, 0, 5), (5, 0, -5), (-5, 0, -5)])),
            (name: \"slab\", shape: Faces(points: [(-1, 0.02, 1), (1, 0.02, 1), (1, 0.02, 0), (0, 0.02, 0),
            (0, 0.02, -1), (-1, {}, -1)], faces: [(outline: [0, 1, 2, 3, 4, 5]{edge})]))]))])",
            0.02 + bend
        )
    };
    let dark = |bend: f64, edge: &str, shadows: Shadows| {
        let document = text::parse(Path::new("slab.ron"), slab(bend, edge).as_bytes()).unwrap();
        let scene = Scene::new(&document, None, "s", Key::of(&document), Path::new("")).unwrap();
        let camera = Camera { position: DVec3::new(0.0, 5.0, 5.0), ..Camera::default() };
        let image = render(&Arc::new(scene), &camera, (240, 160), Rule::Sloped(4));
        let lamps = vec![lights::sun((0.97, -0.24, -0.1), Color::WHITE)];
        let light = Illuminate { shadows, ..illuminate(lamps, Color::BLACK, Color::BLACK) };
        let shown = picture(&image.shaded(Arc::new(light)).unwrap(), Rule::Sloped(4));
        let pairs = shown.float("R").unwrap().iter().zip(shown.float("A").unwrap());
        pairs.map(|(r, a)| f64::from(*a) - f64::from(*r) / 0.24).sum::<f64>()
    };
    for shadows in [Shadows::Volumes, Shadows::Rays(4)] {
        let flat = dark(0.0, "", shadows);
        assert!(flat > 20.0, "{flat}");
        let bent = dark(1.5e-3, "", shadows);
        assert!((bent / flat - 1.0).abs() < 0.05, "{shadows:?}: {bent} of {flat}");
        let edge = ", edge: (width: 1, color: \"#203040\")";
        let (flat, bent) = (dark(0.0, edge, shadows), dark(0.15, edge, shadows));
        assert!(bent > 0.9 * flat, "{shadows:?}: {bent} of {flat}");
    }
}
