//! Shadows: known areas, the methods against each other, holes, panes, clusters, extremes.

use glam::{DVec2, DVec3};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::light::list::{AreaLight, LinearLight, MakeLamp, PolyhedralLight};
use spandrel_engine::light::polygon::{Polygon, Surface};
use spandrel_engine::light::sky::{Sky, SkyModel};
use spandrel_engine::light::{Lamp, point};
use spandrel_engine::raster::Raster;
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::scene::{
    AlphaMode, Document, Face, Material, Mesh, Object, Plan, Scene, Shape, Transform,
};
use spandrel_engine::shade::{Illuminate, Shadows};
use spandrel_engine::span::SpanImage;
use spandrel_engine::trace::{CasterSearch, Reductions};
use spandrel_tests::lights::{illuminate, lamp, sun};
use spandrel_tests::random::Random;
use spandrel_tests::scenes::polygons;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

pub(crate) fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A camera that looks straight down on a square of `side` metres around the origin.
fn plan_view(side: f64, pixels: u32) -> View {
    let camera = Camera {
        position: v(0.0, side, 0.0),
        look_at: DVec3::ZERO,
        parallel_height: Some(side),
        ..Camera::default()
    };
    View::new(&camera, Raster::new(pixels, pixels).unwrap()).unwrap()
}

/// A view from the side, in perspective.
pub(crate) fn side_view(side: f64, width: u32, height: u32) -> View {
    let camera = Camera {
        position: v(0.3, 0.7, 1.1) * side,
        look_at: v(0.02, 0.05, 0.0) * side,
        field_of_view: 45.0,
        ..Camera::default()
    };
    View::new(&camera, Raster::new(width, height).unwrap()).unwrap()
}

pub(crate) fn level(x: [f64; 2], y: f64, z: [f64; 2]) -> Vec<DVec3> {
    vec![v(x[0], y, z[1]), v(x[1], y, z[1]), v(x[1], y, z[0]), v(x[0], y, z[0])]
}

pub(crate) fn scene(label: &str, mesh: Mesh) -> Arc<Scene> {
    let white = Material { color: Color::WHITE, ..Material::default() };
    let pane = Material { alpha: 0.25, alpha_mode: AlphaMode::Blend, ..white.clone() };
    let root = Object::new("mesh", Shape::Faces(mesh)).of("white");
    let mut document = Document::with_plan(Plan { root, ..Plan::default() });
    document.materials.insert("white".into(), white);
    document.materials.insert("pane".into(), pane);
    let key = spandrel_engine::key::Key::of(&document);
    Arc::new(Scene::new(&document, None, label, key, Path::new("")).unwrap())
}

pub(crate) fn spans(scenes: &[Arc<Scene>], view: &View, n: u32) -> SpanImage {
    let plan = Rule::Sloped(n).plan().unwrap();
    let rows = 0..view.raster().height;
    let images: Vec<SpanImage> = scenes
        .iter()
        .map(|scene| scanline::render(&[scene.clone().into()], view, plan, rows.clone()).unwrap())
        .collect();
    SpanImage::merge(&images).unwrap()
}

pub(crate) fn lit(image: &SpanImage, lamps: Vec<Lamp>, shadows: Shadows) -> SpanImage {
    let shader = Illuminate { shadows, ..illuminate(lamps, Color::BLACK, Color::BLACK) };
    let image = image.shaded(Arc::new(shader)).unwrap();
    image.check_worlds().unwrap();
    image
}

pub(crate) fn picture(image: &SpanImage) -> Image {
    let rule = Rule::Sloped(image.plan().per_row);
    let framing = Framing::scaled(image.view().raster(), DVec2::ONE).unwrap();
    resolve(image, rule, &framing, &BTreeSet::from([Channel::Color])).unwrap()
}

pub(crate) fn red(image: &Image) -> &[f32] {
    image.float("R").unwrap()
}

fn mean(image: &Image) -> f64 {
    let values = red(image);
    values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64
}

/// A lamp at a point of so many candela that the floor's middle, below it, gets 1.
pub(crate) fn point_lamp(position: DVec3) -> Lamp {
    let beam = point::Beam::All;
    let light = point::Point { position, beam };
    let strength = (position.y * position.y) as f32;
    Lamp::new("point", true, Color::grey(strength), Arc::new(light))
}

const METHODS: [Shadows; 2] = [Shadows::Volumes, Shadows::Rays(1)];

#[test]
fn a_shadow_has_the_area_that_geometry_gives_it() {
    // A square of half a metre, 1 m over a floor of 10 x 10 m, under light along (-1, -2, -0.5): its shadow
    // is a square as large, moved by 0.5 and 0.25; the light on the floor is the cosine.
    let mut mesh = polygons(&[level([-5.0, 5.0], 0.0, [-5.0, 5.0])]);
    let square = level([-0.25, 0.25], 1.0, [-0.25, 0.25]);
    let ring: Vec<u32> = square.iter().map(|p| mesh.add_point(*p)).collect();
    mesh.add_polygon(&ring, None).unwrap();
    let direction = v(-1.0, -2.0, -0.5);
    let cosine = 2.0 / direction.length();
    // Seen from below the square, so that it hides nothing of the floor: the camera looks down from 0.9.
    let camera = Camera {
        position: v(0.0, 0.9, 0.0),
        look_at: DVec3::ZERO,
        parallel_height: Some(4.0),
        ..Camera::default()
    };
    for pixels in [7, 64, 200] {
        let view = View::new(&camera, Raster::new(pixels, pixels).unwrap()).unwrap();
        let image = spans(&[scene("floor", mesh.clone())], &view, 8);
        let shown = picture(&lit(&image, vec![sun(direction, Color::WHITE)], Shadows::Volumes));
        let expected = cosine * (1.0 - 0.25 / 16.0);
        assert!((mean(&shown) - expected).abs() < 2e-4, "{pixels}: {} {expected}", mean(&shown));
        // Where it is: its middle is dark, and one beside it is not.
        let at = |x: f64, z: f64| {
            let pixel = |t: f64| ((t + 2.0) / 4.0 * f64::from(pixels)) as usize;
            red(&shown)[pixel(z) * pixels as usize + pixel(x)]
        };
        if pixels > 10 {
            assert!(at(-0.5, -0.25) == 0.0 && at(0.5, 0.25) > 0.5);
        }
        let rays = picture(&lit(&image, vec![sun(direction, Color::WHITE)], Shadows::Rays(16)));
        assert!((mean(&rays) - expected).abs() < 6e-3, "{pixels}: rays {}", mean(&rays));
    }
}

/// Boxes on a floor.
pub(crate) fn boxes(seed: u64, count: usize, size: f64) -> Mesh {
    let mut random = Random::new(seed);
    let mut mesh = polygons(&[level([-size, size], 0.0, [-size, size])]);
    for _ in 0..count {
        let side = |random: &mut Random| random.between(0.03, 0.25) * size;
        let (a, b, c) = (side(&mut random), side(&mut random), side(&mut random));
        let (x, z) = (random.between(-0.7, 0.7) * size, random.between(-0.7, 0.7) * size);
        let mut part = Shape::Box { size: [a, b, c] }.mesh().unwrap();
        let turn = random.between(0.0, 90.0);
        let place = Transform(vec![
            spandrel_engine::scene::Step::TurnY(turn),
            spandrel_engine::scene::Step::Move(x, b / 2.0, z),
        ]);
        let matrix = place.to_matrix();
        part.points.iter_mut().for_each(|p| *p = matrix.transform_point3(*p));
        mesh.append(&part).unwrap();
    }
    mesh
}

#[test]
fn volumes_and_rays_agree_but_for_pixels_on_edges() {
    for seed in 0..4 {
        let scene = scene("boxes", boxes(seed, 14, 5.0));
        let view = side_view(5.0, 160, 120);
        let image = spans(&[scene], &view, 4);
        for light in [sun((-0.6, -1.0, 0.35), Color::WHITE), point_lamp(v(1.0, 4.0, 2.0))] {
            let [exact, rays] =
                METHODS.map(|shadows| picture(&lit(&image, vec![light.clone()], shadows)));
            let off = red(&exact).iter().zip(red(&rays)).filter(|(a, b)| (*a - *b).abs() > 0.02);
            let share = off.count() as f64 / red(&exact).len() as f64;
            assert!(share < 0.04, "seed {seed}: {share}");
            // More rays come nearer.
            let many = picture(&lit(&image, vec![light], Shadows::Rays(64)));
            let rms = |other: &Image| {
                let pairs = red(&exact).iter().zip(red(other));
                let sum: f64 = pairs.map(|(a, b)| f64::from(a - b) * f64::from(a - b)).sum();
                (sum / red(&exact).len() as f64).sqrt()
            };
            assert!(rms(&many) < rms(&rays) / 2.0, "{} {}", rms(&many), rms(&rays));
            assert!(rms(&many) < 0.02, "{}", rms(&many));
        }
    }
}

#[test]
fn nothing_shadows_itself_and_nothing_leaks_at_any_scale() {
    for scale in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
        // The inside of a closed room, lit from outside: all dark. From within: none of it is.
        let mut room = Shape::Box { size: [2.0 * scale, 2.0 * scale, 2.0 * scale] }.mesh().unwrap();
        room.points.iter_mut().for_each(|p| *p += v(0.01, 0.02, 0.03) * scale);
        let scene = scene("room", room);
        let camera = Camera {
            position: v(-0.7, 0.6, 0.8) * scale,
            look_at: v(0.5, -0.4, -0.6) * scale,
            field_of_view: 80.0,
            ..Camera::default()
        };
        let view = View::new(&camera, Raster::new(64, 48).unwrap()).unwrap();
        let image = spans(&[scene], &view, 4);
        for shadows in METHODS {
            let outside =
                [sun((-0.3, -1.0, -0.2), Color::WHITE), point_lamp(v(3.0, 4.0, 5.0) * scale)];
            for light in outside {
                let shown = picture(&lit(&image, vec![light], shadows));
                let leak = red(&shown).iter().copied().fold(0.0, f32::max);
                assert!(leak < 1e-6, "{shadows:?} at {scale}: {leak}");
            }
            let light = point_lamp(v(0.2, 0.3, -0.1) * scale);
            let [free, shadowed] = [Shadows::Off, shadows]
                .map(|shadows| picture(&lit(&image, vec![light.clone()], shadows)));
            for (a, b) in red(&free).iter().zip(red(&shadowed)) {
                assert!(*a > 0.0 && (a - b).abs() <= 1e-4 * a, "{shadows:?} at {scale}: {a} {b}");
            }
        }
    }
}

#[test]
fn roofs_far_from_the_origin_do_not_shadow_themselves() {
    // Folded by millimetres, as surveyed roofs are, in coordinates of a whole country.
    let folded = |origin: DVec3| {
        let mut random = Random::new(8);
        let mut mesh = Mesh::default();
        let mut points = Vec::new();
        for i in 0..7u32 {
            for k in 0..7u32 {
                let (x, z) = (f64::from(i) * 2.0 - 6.0, f64::from(k) * 2.0 - 6.0);
                let y = 0.3 * x + random.between(-0.004, 0.004);
                points.push(mesh.add_point(v(x, y, z) + origin));
            }
        }
        for i in 0..6usize {
            for k in 0..6usize {
                let [a, b, c, d] = [(i, k), (i, k + 1), (i + 1, k + 1), (i + 1, k)]
                    .map(|(i, k)| points[i * 7 + k]);
                mesh.add_polygon(&[a, b, c], None).unwrap();
                mesh.add_polygon(&[a, c, d], None).unwrap();
            }
        }
        let camera = Camera {
            position: origin + v(0.0, 20.0, 0.0),
            look_at: origin,
            up: DVec3::Z,
            parallel_height: Some(10.0),
            ..Camera::default()
        };
        let view = View::new(&camera, Raster::new(60, 60).unwrap()).unwrap();
        spans(&[scene("roof", mesh)], &view, 2)
    };
    let near = folded(DVec3::ZERO);
    let far = folded(v(92_526.0, 7.0, -436_640.0));
    for shadows in [Shadows::Volumes, Shadows::Rays(1), Shadows::Rays(4)] {
        let lamps = || vec![sun((-0.4, -1.0, -0.3), Color::WHITE)];
        let open = picture(&lit(&near, lamps(), Shadows::Off));
        for (name, image) in [("near", &near), ("far", &far)] {
            let shown = picture(&lit(image, lamps(), shadows));
            let pairs = red(&shown).iter().zip(red(&open)).enumerate();
            let off: Vec<_> = pairs.filter(|(_, (a, b))| (*a - *b).abs() > 0.01).collect();
            assert!(
                off.is_empty(),
                "{shadows:?}, {name}: {} pixels, {:?}",
                off.len(),
                off.iter().map(|(at, (a, _))| (at % 60, at / 60, *a)).collect::<Vec<_>>()
            );
        }
    }
}

#[test]
fn light_passes_through_holes() {
    // A ceiling with a square hole over a floor: the floor gets light only through it.
    let mut mesh = polygons(&[level([-5.0, 5.0], 0.0, [-5.0, 5.0])]);
    let ring = |mesh: &mut Mesh, points: Vec<DVec3>| -> Vec<u32> {
        points.iter().map(|p| mesh.add_point(*p)).collect()
    };
    let outline = ring(&mut mesh, level([-5.0, 5.0], 1.0, [-5.0, 5.0]));
    let hole = ring(&mut mesh, level([-0.5, 0.5], 1.0, [-0.25, 0.25]));
    mesh.add_face(Face { outline, holes: vec![hole], ..Face::default() }).unwrap();
    let camera = Camera {
        position: v(0.0, 0.9, 0.0),
        look_at: DVec3::ZERO,
        parallel_height: Some(4.0),
        ..Camera::default()
    };
    let view = View::new(&camera, Raster::new(80, 80).unwrap()).unwrap();
    let image = spans(&[scene("holes", mesh)], &view, 4);
    let down = sun(v(0.0, -1.0, 0.0), Color::WHITE);
    let shown = picture(&lit(&image, vec![down], Shadows::Volumes));
    assert!((mean(&shown) - 0.5 / 16.0).abs() < 1e-5, "{}", mean(&shown));
    // From a point two metres up, the hole is twice as large on the floor.
    let lamp = point_lamp(v(0.0, 1000.0, 0.0));
    let shown = picture(&lit(&image, vec![lamp], Shadows::Volumes));
    let scale = (1000.0 / 999.0) * (1000.0 / 999.0);
    assert!((mean(&shown) - 0.5 / 16.0 * scale).abs() < 1e-4, "{}", mean(&shown));
}

#[test]
fn panes_dim_by_their_alpha_each_for_itself() {
    // Two panes of alpha 1/4 that overlap, over a floor.
    let mut mesh = polygons(&[level([-5.0, 5.0], 0.0, [-5.0, 5.0])]);
    mesh.materials = vec!["pane".into()];
    for (x, y) in [([-1.0, 0.5], 1.0), ([-0.5, 1.0], 1.5)] {
        let outline = level(x, y, [-1.0, 1.0]);
        let ring: Vec<u32> = outline.iter().map(|p| mesh.add_point(*p)).collect();
        mesh.add_polygon(&ring, Some(0)).unwrap();
    }
    let camera = Camera {
        position: v(0.0, 0.9, 0.0),
        look_at: DVec3::ZERO,
        parallel_height: Some(4.0),
        ..Camera::default()
    };
    let view = View::new(&camera, Raster::new(64, 64).unwrap()).unwrap();
    let image = spans(&[scene("panes", mesh)], &view, 2);
    let down = sun(v(0.0, -1.0, 0.0), Color::WHITE);
    for shadows in METHODS {
        let shown = picture(&lit(&image, vec![down.clone()], shadows));
        let at = |x: f64| red(&shown)[32 * 64 + ((x + 2.0) / 4.0 * 64.0) as usize];
        for (x, expected) in [(-1.5, 1.0), (-0.75, 0.75), (0.01, 0.5625), (0.75, 0.75), (1.5, 1.0)]
        {
            assert!((at(x) - expected).abs() < 1e-5, "{shadows:?} {x}: {}", at(x));
        }
    }
}

#[test]
fn shadows_fall_across_clusters_that_were_rendered_apart() {
    let floor = scene("floor", polygons(&[level([-5.0, 5.0], 0.0, [-5.0, 5.0])]));
    let roof = scene("roof", polygons(&[level([-0.5, 0.5], 1.0, [-0.5, 0.5])]));
    let mut both = polygons(&[level([-5.0, 5.0], 0.0, [-5.0, 5.0])]);
    both.append(&polygons(&[level([-0.5, 0.5], 1.0, [-0.5, 0.5])])).unwrap();
    let view = side_view(4.0, 96, 64);
    let light = || vec![sun((-1.0, -1.5, 0.4), Color::WHITE)];
    for shadows in METHODS {
        let together =
            picture(&lit(&spans(&[scene("both", both.clone())], &view, 4), light(), shadows));
        let apart =
            picture(&lit(&spans(&[floor.clone(), roof.clone()], &view, 4), light(), shadows));
        assert_eq!(red(&together), red(&apart), "{shadows:?}");
        // Lit before the merge, each is alone.
        let alone = [&floor, &roof]
            .map(|scene| lit(&spans(std::slice::from_ref(scene), &view, 4), light(), shadows));
        let merged = picture(&SpanImage::merge(&alone).unwrap());
        assert!(mean(&merged) > mean(&together) * 1.01, "{shadows:?}");
    }
    // The other half of the world casts even where none of it is seen.
    let away = scene("away", polygons(&[level([2.5, 3.5], 40.0, [-5.0, 5.0])]));
    let image = spans(&[floor.clone(), away], &plan_view(1.0, 16), 2);
    let steep = vec![sun(v(-3.0, -40.0, 0.0), Color::WHITE)];
    let shown = picture(&lit(&image, steep, Shadows::Volumes));
    assert!(mean(&shown) < 0.01, "{}", mean(&shown));
}

#[test]
fn eyes_and_lights_in_awkward_places() {
    let mesh = boxes(5, 6, 3.0);
    let scene = scene("boxes", mesh);
    // The eye under a roof, inside its shadow; a light in the view; a light in the plane of the floor and
    // of a wall; one exactly on a face.
    let camera =
        Camera { position: v(0.5, 0.2, 2.9), look_at: v(0.0, 0.3, 0.0), ..Camera::default() };
    let view = View::new(&camera, Raster::new(80, 60).unwrap()).unwrap();
    let image = spans(&[scene], &view, 4);
    for position in
        [v(0.1, 0.5, 1.0), v(2.0, 0.0, 1.0), v(0.5, 1e-9, 0.5), v(0.5, 0.2, 2.9), v(0.5, 3.0, 9.0)]
    {
        let [exact, rays] = METHODS.map(|shadows| {
            let mut light = point_lamp(position);
            light.strength = Color::WHITE;
            picture(&lit(&image, vec![light], shadows))
        });
        assert!(red(&exact).iter().chain(red(&rays)).all(|v| v.is_finite()));
        let off =
            red(&exact).iter().zip(red(&rays)).filter(|(a, b)| (*a - *b).abs() > 0.02 * a.max(1.0));
        let share = off.count() as f64 / red(&exact).len() as f64;
        assert!(share < 0.05, "{position}: {share}");
    }
}

#[test]
fn what_hides_a_soft_source_in_part_hides_its_part() {
    // A panel 2 m over a floor; a screen half way hides exactly the half x < 0 of it from the middle.
    let panel = |x: [f64; 2]| {
        let outline =
            vec![v(x[0], 2.0, -1.0), v(x[1], 2.0, -1.0), v(x[1], 2.0, 1.0), v(x[0], 2.0, 1.0)];
        Surface::new(vec![Polygon { outline, holes: vec![] }], false).unwrap()
    };
    let mut mesh = polygons(&[level([-5.0, 5.0], 0.0, [-5.0, 5.0])]);
    mesh.append(&polygons(&[level([-3.0, 0.0], 1.0, [-3.0, 3.0])])).unwrap();
    let camera = Camera {
        position: v(0.0, 0.5, 0.0),
        look_at: DVec3::ZERO,
        parallel_height: Some(0.02),
        ..Camera::default()
    };
    let view = View::new(&camera, Raster::new(16, 16).unwrap()).unwrap();
    let image = spans(&[scene("screen", mesh)], &view, 1);
    let whole = picture(&lit(&image, vec![lamp(panel([-1.0, 1.0]))], Shadows::Rays(256)));
    let half = picture(&lit(&image, vec![lamp(panel([0.0, 1.0]))], Shadows::Off));
    assert!((mean(&whole) / mean(&half) - 1.0).abs() < 0.01, "{} {}", mean(&whole), mean(&half));
    // A wall to the horizon takes half of a uniform sky.
    let mut mesh = polygons(&[level([-5.0, 5.0], 0.0, [-5.0, 5.0])]);
    let wall = vec![v(0.02, 0.0, -1e4), v(0.02, 0.0, 1e4), v(0.02, 1e4, 1e4), v(0.02, 1e4, -1e4)];
    mesh.append(&polygons(&[wall])).unwrap();
    let image = spans(&[scene("wall", mesh)], &view, 1);
    let sky = || lamp(Sky::new(SkyModel::Uniform, DVec3::Y, 0.0).unwrap());
    let shown = picture(&lit(&image, vec![sky()], Shadows::Rays(256)));
    assert!((mean(&shown) - 0.5).abs() < 0.01, "{}", mean(&shown));
}

#[test]
fn lights_that_are_seen_do_not_stand_in_their_own_way() {
    // A floor under a tube, a panel and a lantern, each with its faces in the scene and without.
    let floor = scene("floor", polygons(&[level([-3.0, 3.0], 0.0, [-3.0, 3.0])]));
    let none = Path::new("");
    let tube = LinearLight { from: v(-1.0, 1.0, 0.0), to: v(1.0, 1.0, 0.0), ..Default::default() };
    let outline = level([-0.5, 0.5], 1.5, [-0.5, 0.5]).into_iter().rev().collect();
    let panel = AreaLight { outline, ..Default::default() };
    let mut lantern = PolyhedralLight::default();
    lantern.points.iter_mut().for_each(|point| point.y += 1.5);
    let lights: [&dyn MakeLamp; 3] = [&tube, &panel, &lantern];
    for light in lights {
        let lamp = light.lamp("light", none).unwrap();
        let faces = Arc::new(Scene::of_lamps("lights", std::slice::from_ref(&lamp), 0.05).unwrap());
        let view = side_view(4.0, 64, 48);
        let with = spans(&[floor.clone(), faces], &view, 2);
        let without = spans(std::slice::from_ref(&floor), &view, 2);
        let [with, without] = [with, without]
            .map(|image| picture(&lit(&image, vec![lamp.clone()], Shadows::Rays(64))));
        // Where the floor is seen in both.
        let pairs = red(&with).iter().zip(red(&without)).filter(|(a, b)| **a < 1.0 && **b > 0.0);
        let off = pairs.filter(|(a, b)| (*a - *b).abs() > 1e-3 + 0.01 * **b).count();
        assert!(off < 64 * 48 / 50, "{off} pixels");
        assert!(mean(&without) > 0.01);
    }
}

#[test]
fn what_is_left_out_of_the_search_changes_no_shadow() {
    // Closed boxes, one of them inside out and one mirrored, an open one, panes, and lights of both kinds: one
    // far, one between the boxes, one within a box.
    let mut mesh = boxes(4, 12, 1.0);
    let mut add = |faces: &[usize], place: Transform, turned: bool| {
        let part = Shape::Box { size: [0.3, 0.4, 0.2] }.mesh().unwrap();
        let base = mesh.points.len() as u32;
        mesh.points.extend(part.points.iter().map(|p| place.to_matrix().transform_point3(*p)));
        for face in faces {
            let mut ring: Vec<u32> = part.outline(*face).iter().map(|i| base + i).collect();
            if turned {
                ring.reverse();
            }
            mesh.add_polygon(&ring, None).unwrap();
        }
    };
    add(
        &[0, 1, 2, 3, 4],
        Transform(vec![spandrel_engine::scene::Step::Move(0.6, 0.1, 0.2)]),
        false,
    );
    let at = |x: f64, y: f64| Transform(vec![spandrel_engine::scene::Step::Move(x, y, -0.3)]);
    let closed = |turned: bool, size: f64| {
        let part = Shape::Box { size: [size, 0.3, 0.2] }.mesh().unwrap();
        let mut made = Mesh::default();
        made.points = part.points.clone();
        for face in 0..part.face_count() {
            let mut ring = part.outline(face).to_vec();
            if turned {
                ring.reverse();
            }
            made.add_polygon(&ring, None).unwrap();
        }
        made
    };
    let placed = |mesh: Mesh, place: Transform| Object {
        transform: place,
        ..Object::new("body", Shape::Faces(mesh))
    };
    let bodies =
        [placed(closed(true, 0.2), at(-0.4, 0.2)), placed(closed(false, 0.4), at(0.1, 0.5))];
    let parts: Vec<Arc<Scene>> = std::iter::once(scene("open", mesh))
        .chain(
            bodies
                .into_iter()
                .enumerate()
                .map(|(i, body)| Arc::new(Scene::from_object(&format!("body {i}"), body).unwrap())),
        )
        .collect();
    let view = side_view(2.0, 96, 72);
    let lamps = || {
        let sun = sun(v(-0.5, -0.8, -0.3), Color::grey(0.5));
        [sun, point_lamp(v(0.05, 0.45, 0.1)), point_lamp(v(0.1, 0.6, -0.3))]
    };
    for lamp in lamps() {
        let shown = |candidates: CasterSearch, contours: bool| {
            let image = spans(&parts, &view, 4);
            let less = Reductions { candidates, contours };
            let light = illuminate(vec![lamp.clone()], Color::BLACK, Color::BLACK);
            let light = Illuminate { shadows: Shadows::Volumes, less, ..light };
            picture(&image.shaded(Arc::new(light)).unwrap())
        };
        let all = shown(CasterSearch::All, false);
        let dark = picture(&lit(&spans(&parts, &view, 4), vec![lamp.clone()], Shadows::Off));
        assert!(mean(&all) < 0.97 * mean(&dark), "{}: nothing is dark", lamp.name);
        for candidates in [
            CasterSearch::Shafts,
            CasterSearch::Clusters,
            CasterSearch::SixSpaces,
            CasterSearch::All,
        ] {
            for contours in [false, true] {
                let less = shown(candidates, contours);
                let pairs = red(&less).iter().zip(red(&all));
                let greatest = pairs.map(|(a, b)| (a - b).abs() / b.max(1.0)).fold(0.0, f32::max);
                assert!(greatest < 1e-5, "{} {candidates:?} {contours}: {greatest}", lamp.name);
            }
        }
    }
}
