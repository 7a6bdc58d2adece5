//! Local ray tracing: mirrors against scenes unfolded by hand, glass against Snell, Fresnel and Beer, and
//! what rays meet against what the camera sees of it.

#![allow(clippy::disallowed_methods, reason = "what is expected may be computed by anybody's sine")]

use glam::{DVec2, DVec3, dvec3 as v};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::fragment::{Finish, Optics};
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::key::Key;
use spandrel_engine::raster::Raster;
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::scene::{
    AlphaMode, Document, Face, Material, Mesh, Object, Plan, Scene, Seal, Shape, Sides,
};
use spandrel_engine::shade::Trace;
use spandrel_engine::span::SpanImage;
use spandrel_engine::trace::Accelerator;
use spandrel_tests::random::Random;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// A surface that shows its colour without light.
pub(crate) fn plain(color: Color) -> Material {
    Material { color, unlit: true, ..Material::default() }
}

/// A black surface with optics.
pub(crate) fn with(optics: Optics) -> Material {
    let finish = Finish { optics: Some(optics), ..Finish::default() };
    Material { finish, ..plain(Color::BLACK) }
}

/// Mirrors all.
pub(crate) fn mirror() -> Material {
    with(Optics { fresnel: false, ..Optics::default() })
}

/// Clear glass.
pub(crate) fn glass(index: f32) -> Material {
    with(Optics { refract: Color::WHITE, index, ..Optics::default() })
}

/// A scene of polygons, each with a material of its own.
pub(crate) fn made(label: &str, parts: &[(Vec<DVec3>, Material)]) -> Arc<Scene> {
    let (mut mesh, mut document) = (Mesh::default(), Document::default());
    for (at, (polygon, material)) in parts.iter().enumerate() {
        let outline = polygon.iter().map(|p| mesh.add_point(*p)).collect();
        let sides = Sides { front: Some(at as u32), ..Sides::default() };
        mesh.add_face(Face { outline, sides, ..Face::default() }).unwrap();
        mesh.materials.push(format!("{at}"));
        document.materials.insert(format!("{at}"), material.clone());
    }
    finished(label, mesh, document)
}

pub(crate) fn finished(label: &str, mesh: Mesh, mut document: Document) -> Arc<Scene> {
    document.plans.push(Plan { root: Object::new("mesh", Shape::Faces(mesh)), ..Plan::default() });
    let key = Key::of(&document);
    Arc::new(Scene::new(&document, None, label, key, Path::new("")).unwrap())
}

/// A rectangle in the plane at a height, seen from above.
pub(crate) fn level(x: [f64; 2], y: f64, z: [f64; 2]) -> Vec<DVec3> {
    vec![v(x[0], y, z[1]), v(x[1], y, z[1]), v(x[1], y, z[0]), v(x[0], y, z[0])]
}

pub(crate) fn turned(mut polygon: Vec<DVec3>) -> Vec<DVec3> {
    polygon.reverse();
    polygon
}

/// The six faces of a box, outwards.
pub(crate) fn block(low: DVec3, high: DVec3) -> Vec<Vec<DVec3>> {
    let at = |i: usize| {
        let pick = |bit: usize, axis: usize| if i >> bit & 1 == 1 { high[axis] } else { low[axis] };
        v(pick(0, 0), pick(1, 1), pick(2, 2))
    };
    let faces =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    faces.iter().map(|face| face.iter().map(|i| at(*i)).collect()).collect()
}

pub(crate) fn trace() -> Trace {
    Trace {
        rays: 1,
        depth: 8,
        least: 1e-3,
        background: Color::BLACK,
        sky: None,
        accelerator: Accelerator::Tree,
    }
}

pub(crate) fn spans(scenes: &[Arc<Scene>], view: &View) -> SpanImage {
    let (plan, rows) = (Rule::Sloped(4).plan().unwrap(), 0..view.raster().height);
    let one = |scene: &Arc<Scene>| {
        scanline::render(&[scene.clone().into()], view, plan, rows.clone()).unwrap()
    };
    SpanImage::merge(&scenes.iter().map(one).collect::<Vec<_>>()).unwrap()
}

pub(crate) fn traced(image: &SpanImage, shader: Trace) -> SpanImage {
    let image = image.shaded(Arc::new(shader)).unwrap();
    image.check_worlds().unwrap();
    image
}

pub(crate) fn shown(image: &SpanImage, channels: &[Channel]) -> Image {
    let framing = Framing::scaled(image.view().raster(), DVec2::ONE).unwrap();
    let channels: BTreeSet<Channel> = channels.iter().copied().collect();
    resolve(image, Rule::Sloped(4), &framing, &channels).unwrap()
}

pub(crate) fn red(image: &SpanImage) -> Vec<f32> {
    shown(image, &[Channel::Color]).float("R").unwrap().to_vec()
}

pub(crate) fn view(camera: &Camera, width: u32, height: u32) -> View {
    View::new(camera, Raster::new(width, height).unwrap()).unwrap()
}

/// A view in parallel along a direction to the origin.
pub(crate) fn along(direction: DVec3, height: f64, pixels: u32) -> View {
    let camera = Camera {
        position: direction * -20.0,
        look_at: DVec3::ZERO,
        parallel_height: Some(height),
        ..Camera::default()
    };
    view(&camera, pixels, pixels)
}

#[test]
fn a_mirror_shows_the_room_behind_it() {
    // Blocks over a floor that mirrors all, and the same blocks twice, upside down below: seen from above
    // they are one picture, but for pixels where one ray stands for several faces.
    for scale in [1e-6, 1.0, 1e6] {
        let mut random = Random::new(7);
        let (mut above, mut below) = (Vec::new(), Vec::new());
        for _ in 0..12 {
            let low =
                v(random.between(-2.0, 1.5), random.between(0.0, 0.6), random.between(-2.0, 1.5));
            let size =
                v(random.between(0.1, 0.8), random.between(0.1, 0.9), random.between(0.1, 0.8));
            for face in block(low * scale, (low + size) * scale) {
                let color = Color::grey(random.between(0.1, 1.0) as f32);
                let flat: Vec<DVec3> = face.iter().map(|p| v(p.x, -p.y, p.z)).collect();
                above.push((face, plain(color)));
                below.push((turned(flat), plain(color)));
            }
        }
        let camera = Camera {
            position: v(0.9, 2.2, 4.8) * scale,
            look_at: v(0.0, 0.2, 0.0) * scale,
            ..Camera::default()
        };
        let eye = view(&camera, 160, 120);
        let floor = level([-1e3 * scale, 1e3 * scale], 0.0, [-1e3 * scale, 1e3 * scale]);
        let floor = made("floor", &[(floor, mirror())]);
        let (above, below) = (made("above", &above), made("below", &below));
        let unfolded = red(&spans(&[above.clone(), below], &eye));
        let image = spans(&[above, floor], &eye);
        let differing = |rays: u32| {
            let mirrored = red(&traced(&image, Trace { rays, ..trace() }));
            let pairs = mirrored.iter().zip(&unfolded);
            let differences: Vec<f32> = pairs.map(|(a, b)| (a - b).abs()).collect();
            let count = differences.iter().filter(|d| **d > 1e-5).count();
            (count as f64 / differences.len() as f64, differences.iter().sum::<f32>())
        };
        let (one, many) = (differing(1), differing(16));
        // Only pixels on mirrored edges differ, and those less with more rays.
        assert!(one.0 > 0.01 && one.0 < 0.12, "at {scale}: {one:?}");
        assert!(many.1 < one.1 / 3.0, "at {scale}: {one:?} {many:?}");
    }
}

#[test]
fn what_is_mirrored_follows_fresnels_law() {
    // White light from everywhere: a surface that only mirrors shows what it mirrors; one that also lets
    // through shows all.
    for index in [1.1f32, 1.333, 1.5, 2.4] {
        for degrees in [0.5f64, 20.0, 45.0, 56.31, 70.0, 85.0] {
            let angle = degrees.to_radians();
            let eye = along(v(0.0, -angle.cos(), -angle.sin()), 0.1, 4);
            let floor = level([-9.0, 9.0], 0.0, [-9.0, 9.0]);
            let white = || Trace { background: Color::WHITE, ..trace() };
            let only = with(Optics { index, ..Optics::default() });
            let image = spans(&[made("floor", &[(floor.clone(), only)])], &eye);
            let mirrored = f64::from(red(&traced(&image, white()))[5]);
            // The textbook's form, by the two angles.
            let inner = (angle.sin() / f64::from(index)).asin();
            let across = ((angle - inner).sin() / (angle + inner).sin()).powi(2);
            let along = ((angle - inner).tan() / (angle + inner).tan()).powi(2);
            let expected = (across + along) / 2.0;
            assert!((mirrored - expected).abs() < 1e-6, "{index} {degrees}: {mirrored} {expected}");
            let image = spans(&[made("floor", &[(floor, glass(index))])], &eye);
            let all = f64::from(red(&traced(&image, white()))[5]);
            assert!((all - 1.0).abs() < 1e-6, "{index} {degrees}: {all}");
        }
    }
}

#[test]
fn a_slab_of_glass_moves_what_is_behind_it_as_snell_says() {
    // A dark and a bright half meet at x = 0, 1 m below a slab of .5 m. Seen along a slope the border is
    // moved by the slab's thickness times (tan a - tan b).
    let index = 1.5;
    for degrees in [0.0f64, 25.0, 50.0] {
        let angle = degrees.to_radians();
        let inner = (angle.sin() / index).asin();
        let shift = 0.5 * (angle.tan() - inner.tan());
        let camera = Camera {
            position: v(-angle.sin(), angle.cos(), 0.0) * 20.0,
            look_at: DVec3::ZERO,
            up: v(0.0, 0.0, -1.0),
            parallel_height: Some(0.03),
            ..Camera::default()
        };
        let eye = view(&camera, 400, 3);
        let halves = [
            (level([-9.0, 0.0], 0.0, [-9.0, 9.0]), plain(Color::BLACK)),
            (level([0.0, 9.0], 0.0, [-9.0, 9.0]), plain(Color::WHITE)),
        ];
        let slab = block(v(-8.0, 1.0, -8.0), v(8.0, 1.5, 8.0));
        let slab: Vec<_> = slab.into_iter().map(|face| (face, glass(index as f32))).collect();
        let image = spans(&[made("floor", &halves), made("slab", &slab)], &eye);
        let row = red(&traced(&image, trace()));
        let row = &row[400..800];
        // The border, by the bright part of the row: all of it is about as bright.
        let bright = row.iter().map(|v| f64::from(*v > row[390] / 2.0)).sum::<f64>();
        // A pixel is 1/100 m of the screen, and the floor's x is seen at x cos(angle).
        let border = (200.0 - bright) / 100.0;
        let expected = shift * angle.cos();
        assert!((border - expected).abs() < 0.006, "{degrees}: {border} {expected}");
        // And so weak: two surfaces straight on.
        if degrees == 0.0 {
            let once = 1.0 - (0.5f64 / 2.5).powi(2);
            assert!((f64::from(row[390]) - once * once).abs() < 2e-3, "{}", row[390]);
        }
    }
}

#[test]
fn beyond_the_critical_angle_everything_is_mirrored() {
    // From below the surface of water, whose front is above: the sky within 48.6 degrees, else the dark.
    let water = level([-1e4, 1e4], 0.0, [-1e4, 1e4]);
    let surface = made("water", &[(water, glass(1.333))]);
    for (degrees, is_open) in
        [(5.0f64, true), (45.0, true), (48.0, true), (49.5, false), (80.0, false)]
    {
        let angle = degrees.to_radians();
        let eye = along(v(0.0, angle.cos(), angle.sin()), 0.1, 4);
        let image = spans(std::slice::from_ref(&surface), &eye);
        let sky = Trace { background: Color::WHITE, ..trace() };
        let image = traced(&image, sky);
        // Only what comes through the surface is white if the bottom is black.
        let bottom = level([-1e4, 1e4], -50.0, [-1e4, 1e4]);
        let with_bottom = [surface.clone(), made("bottom", &[(bottom, plain(Color::BLACK))])];
        let below =
            traced(&spans(&with_bottom, &eye), Trace { background: Color::WHITE, ..trace() });
        let (all, through) = (red(&image)[5], red(&below)[5]);
        assert!((all - 1.0).abs() < 1e-5, "{degrees}: {all}");
        assert_eq!(through > 0.01, is_open, "{degrees}: {through}");
    }
}

#[test]
fn glass_absorbs_by_beers_law() {
    // Straight down through .5 m of green glass, index 1: nothing is mirrored.
    let absorb = Color::new(3.0, 0.2, 1.0);
    let optics = Optics { refract: Color::WHITE, index: 1.0, absorb, ..Optics::default() };
    let slab = block(v(-8.0, 1.0, -8.0), v(8.0, 1.5, 8.0));
    let slab: Vec<_> = slab.into_iter().map(|face| (face, with(optics))).collect();
    let floor = made("floor", &[(level([-9.0, 9.0], 0.0, [-9.0, 9.0]), plain(Color::WHITE))]);
    let eye = along(v(0.0, -1.0, 0.0), 0.1, 4);
    let image = traced(&spans(&[floor, made("slab", &slab)], &eye), trace());
    let picture = shown(&image, &[Channel::Color]);
    for (channel, absorb) in [("R", 3.0f64), ("G", 0.2), ("B", 1.0)] {
        let seen = f64::from(picture.float(channel).unwrap()[5]);
        assert!((seen - (-absorb * 0.5).exp()).abs() < 1e-5, "{channel} {seen}");
    }
    // A thing within the slab, seen through .2 m of it.
    let thing = made("thing", &[(level([-1.0, 1.0], 1.3, [-1.0, 1.0]), plain(Color::WHITE))]);
    let image = traced(&spans(&[thing, made("slab", &slab)], &eye), trace());
    let seen = f64::from(red(&image)[5]);
    assert!((seen - (-3.0f64 * 0.2).exp()).abs() < 1e-5, "{seen}");
}

#[test]
fn depth_limits_how_often_rays_turn() {
    // Between two mirrors of one half, glowing a little: the sum of a geometric series.
    let half = Optics { reflect: Color::grey(0.5), fresnel: false, ..Optics::default() };
    let finish = Finish { optics: Some(half), ..Finish::default() };
    let dim = Material { finish, ..plain(Color::grey(0.2)) };
    let parts = [
        (level([-9.0, 9.0], 0.0, [-9.0, 9.0]), dim.clone()),
        (turned(level([-9.0, 9.0], 2.0, [-9.0, 9.0])), dim),
    ];
    let camera = Camera {
        position: v(0.0, 1.0, 0.0),
        look_at: v(0.0, 0.0, 0.01),
        field_of_view: 5.0,
        ..Camera::default()
    };
    let image = spans(&[made("mirrors", &parts)], &view(&camera, 3, 3));
    for depth in 0..6 {
        // The last mirror shows its own colour alone, and all of it.
        let expected = (0..depth).fold(0.2f32, |behind, _| 0.2 * 0.5 + 0.5 * behind);
        let seen = red(&traced(&image, Trace { depth, ..trace() }))[4];
        assert!((seen - expected).abs() < 1e-6, "{depth}: {seen} {expected}");
    }
}

#[test]
fn rays_go_through_what_is_translucent_and_see_seals_but_no_culled_backs() {
    let eye = along(v(0.0, -1.0, -1.0).normalize(), 0.1, 4);
    let floor = (level([-9.0, 9.0], 0.0, [-9.0, 9.0]), mirror());
    let wall = |z: f64| vec![v(-9.0, 0.1, z), v(9.0, 0.1, z), v(9.0, 9.0, z), v(-9.0, 9.0, z)];
    let pane = Material { alpha: 0.25, alpha_mode: AlphaMode::Blend, ..plain(Color::WHITE) };
    let culled = Material { one_sided: true, ..plain(Color::WHITE) };
    let far = (wall(-4.0), plain(Color::grey(0.4)));
    let seen = |more: Vec<(Vec<DVec3>, Material)>| {
        let parts = [vec![floor.clone(), far.clone()], more].concat();
        red(&traced(&spans(&[made("all", &parts)], &eye), trace()))[5]
    };
    assert_eq!(seen(vec![]), 0.4);
    let behind = seen(vec![(wall(-2.0), pane.clone()), (wall(-3.0), pane)]);
    assert!((behind - (0.25 + 0.75 * (0.25 + 0.75 * 0.4))).abs() < 1e-6, "{behind}");
    assert_eq!(seen(vec![(turned(wall(-2.0)), culled.clone())]), 0.4);
    assert_eq!(seen(vec![(wall(-2.0), culled)]), 1.0);
    // A seal on the wall, where the ray arrives: x = 0, y = 4.
    let mut mesh = Mesh::default();
    let mut ring = |points: Vec<DVec3>| -> Vec<u32> {
        points.into_iter().map(|p| mesh.add_point(p)).collect()
    };
    let at = |x: f64, y: f64| v(x, y, -4.0);
    let sides = |i| Sides { front: Some(i), ..Sides::default() };
    let seal = |outline, i| Seal { outline, sides: sides(i), ..Seal::default() };
    let outline = ring(wall(-4.0));
    let seals = vec![
        seal(ring(vec![at(-1.0, 3.0), at(1.0, 3.0), at(1.0, 5.0), at(-1.0, 5.0)]), 1),
        // The later is seen over the earlier, and this one lies beside.
        seal(ring(vec![at(0.5, 3.0), at(1.0, 3.0), at(1.0, 5.0), at(0.5, 5.0)]), 0),
    ];
    let wall_face = Face { outline, seals, sides: sides(0), ..Face::default() };
    let floor_face = Face { outline: ring(floor.0.clone()), sides: sides(2), ..Face::default() };
    mesh.add_face(wall_face).unwrap();
    mesh.add_face(floor_face).unwrap();
    let under = |alpha: f32| {
        let (mut mesh, mut document) = (mesh.clone(), Document::default());
        let seal = Material { alpha, alpha_mode: AlphaMode::Blend, ..plain(Color::grey(0.9)) };
        for (at, material) in [plain(Color::grey(0.4)), seal, mirror()].into_iter().enumerate() {
            mesh.materials.push(format!("{at}"));
            document.materials.insert(format!("{at}"), material);
        }
        red(&traced(&spans(&[finished("sealed", mesh, document)], &eye), trace()))[5]
    };
    assert_eq!(under(1.0), 0.9);
    // A seal that is seen through shows the face that it lies on.
    let translucent = under(0.25);
    assert!((translucent - (0.25 * 0.9 + 0.75 * 0.4)).abs() < 1e-6, "{translucent}");
}
