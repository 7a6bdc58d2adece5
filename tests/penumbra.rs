//! Soft shadows in closed form: what is cut out of a source is what stands before it.

use glam::{DVec2, DVec3, dvec3 as v};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::image::Channel;
use spandrel_engine::key::Key;
use spandrel_engine::light::line::Line;
use spandrel_engine::light::point::{Disc, Parallel};
use spandrel_engine::light::polygon::{Polygon, Surface};
use spandrel_engine::light::{Lamp, Light, Receiver};
use spandrel_engine::math;
use spandrel_engine::raster::Raster;
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::scene::{
    AlphaMode, Document, Face, Material, Mesh, Object, Plan, Scene, Shape, Sides,
};
use spandrel_engine::shade::{Fog, Illuminate, Shadows};
use spandrel_engine::span::SpanImage;
use spandrel_tests::lights::{close, illuminate, lamp, no_fog};
use spandrel_tests::random::Random;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

const PI: f64 = std::f64::consts::PI;

/// A scene of polygons, some of which let three quarters of the light through.
fn made(label: &str, parts: &[(Vec<DVec3>, bool)]) -> Arc<Scene> {
    let mut mesh = Mesh::default();
    mesh.materials = vec!["white".into(), "pane".into()];
    for (polygon, is_pane) in parts {
        let outline = polygon.iter().map(|p| mesh.add_point(*p)).collect();
        let sides = Sides { front: Some(u32::from(*is_pane)), ..Sides::default() };
        mesh.add_face(Face { outline, sides, ..Face::default() }).unwrap();
    }
    let root = Object::new("mesh", Shape::Faces(mesh));
    let mut document = Document::with_plan(Plan { root, ..Plan::default() });
    let white = Material { color: Color::WHITE, ..Material::default() };
    let pane = Material { alpha: 0.25, alpha_mode: AlphaMode::Blend, ..white.clone() };
    document.materials.extend([("white".to_owned(), white), ("pane".to_owned(), pane)]);
    let key = Key::of(&document);
    Arc::new(Scene::new(&document, None, label, key, Path::new("")).unwrap())
}

fn level(x: [f64; 2], y: f64, z: [f64; 2]) -> Vec<DVec3> {
    vec![v(x[0], y, z[1]), v(x[1], y, z[1]), v(x[1], y, z[0]), v(x[0], y, z[0])]
}

/// A floor seen from above, `side` metres wide, below everything else.
fn floor_under(parts: &[(Vec<DVec3>, bool)], side: f64, pixels: u32) -> SpanImage {
    let camera = Camera {
        position: v(0.0, 0.01, 0.0) * side,
        look_at: DVec3::ZERO,
        parallel_height: Some(side),
        ..Camera::default()
    };
    let view = View::new(&camera, Raster::new(pixels, pixels).unwrap()).unwrap();
    let floor = made("floor", &[(level([-side, side], 0.0, [-side, side]), false)]);
    let scenes = [floor, made("things", parts)];
    let plan = Rule::Sloped(2).plan().unwrap();
    let parts =
        scenes.map(|scene| scanline::render(&[scene.into()], &view, plan, 0..pixels).unwrap());
    SpanImage::merge(&parts).unwrap()
}

fn lit(image: &SpanImage, lamp: Lamp, shadows: Shadows) -> Vec<f32> {
    let light = Illuminate { shadows, ..illuminate(vec![lamp], Color::BLACK, Color::BLACK) };
    let image = image.shaded(Arc::new(light)).unwrap();
    let framing = Framing::scaled(image.view().raster(), DVec2::ONE).unwrap();
    let picture = resolve(&image, Rule::Sloped(2), &framing, &BTreeSet::from([Channel::Color]));
    picture.unwrap().float("R").unwrap().to_vec()
}

fn panel(x: [f64; 2], y: f64, z: [f64; 2]) -> Surface {
    let mut outline = level(x, y, z);
    outline.reverse();
    Surface::new(vec![Polygon { outline, holes: Vec::new() }], false).unwrap()
}

#[test]
fn a_source_half_hidden_gives_what_its_other_half_gives() {
    for scale in [1e-6, 1.0, 1e6] {
        let half = |x: [f64; 2]| panel(x.map(|x| x * scale), 2.0 * scale, [-scale, scale]);
        let far = [-50.0 * scale, 50.0 * scale];
        let board = level([0.0, 50.0 * scale], scale, far);
        // One pixel, its middle under the board's edge.
        let whole = || lamp(half([-1.0, 1.0]));
        let floor = Receiver { position: DVec3::ZERO, normal: DVec3::Y };
        let open = f64::from(half([-1.0, 0.0]).irradiance(&floor).r);
        let hidden = f64::from(half([0.0, 1.0]).irradiance(&floor).r);
        let seen = |parts: &[(Vec<DVec3>, bool)]| {
            f64::from(lit(&floor_under(parts, scale * 0.01, 1), whole(), Shadows::Analytic)[0])
        };
        close(seen(&[]), open + hidden, 1e-6);
        close(seen(&[(board.clone(), false)]), open, 1e-6);
        close(seen(&[(board.clone(), true)]), open + 0.75 * hidden, 1e-6);
        // Two boards over each other, and the source's own face, hide no more.
        let higher = level([0.2 * scale, 50.0 * scale], 1.3 * scale, far);
        let own = level([-scale, scale], 2.0 * scale, [-scale, scale]);
        close(seen(&[(board.clone(), false), (higher, false), (own, false)]), open, 1e-6);
        // What stands above the source or below the floor is not in the way.
        let above = level(far, 2.1 * scale, far);
        let below = level(far, -0.1 * scale, far);
        close(seen(&[(above, false), (below, false)]), open + hidden, 1e-6);
    }
}

#[test]
fn a_board_before_the_sun_leaves_a_segment_of_its_disc() {
    let radius = 0.533f64.to_radians() / 2.0;
    let height = 10.0;
    let (pixels, side) = (24u32, 0.12);
    let board = level([0.0, 50.0], height, [-50.0, 50.0]);
    let image = floor_under(&[(board, false)], side, pixels);
    let sun = || lamp(Disc { toward: DVec3::Y, radius });
    let row = |lamp, shadows| lit(&image, lamp, shadows)[..pixels as usize].to_vec();
    let cut = row(sun(), Shadows::Analytic);
    let rays = row(sun(), Shadows::Rays(1024));
    // Volumes take the middle of the disc: they are those of a sun without extent.
    let middle = row(sun(), Shadows::Volumes);
    assert_eq!(middle, row(lamp(Parallel { toward: DVec3::Y }), Shadows::Volumes));
    let mut soft = 0;
    for k in 0..pixels {
        let x = ((f64::from(k) + 0.5) / f64::from(pixels) - 0.5) * side;
        // The board's edge in the plane of the disc, in radii of it: what lies left of it is seen.
        let t = (-x / height / math::tan(radius)).clamp(-1.0, 1.0);
        let seen = 1.0 - (math::acos(t) - t * (1.0 - t * t).sqrt()) / PI;
        let off = |row: &[f32]| (f64::from(row[k as usize]) - seen).abs();
        assert!(off(&cut) < 0.003, "{x}: {} is not {seen}", cut[k as usize]);
        assert!(off(&rays) < 0.03, "{x}: {} is not {seen}", rays[k as usize]);
        assert_eq!(middle[k as usize], if x < 0.0 { 1.0 } else { 0.0 }, "{x}");
        soft += u32::from(seen > 0.01 && seen < 0.99);
    }
    assert!(soft > 12, "{soft}");
}

#[test]
fn a_disc_gives_what_the_horizon_leaves_of_it() {
    let toward = v(0.3, 0.8, -0.5).normalize();
    let (u, w) = toward.any_orthonormal_pair();
    for radius in [1e-4, 0.00465, 0.08] {
        let disc = Disc { toward, radius };
        let uniform = |k: u32, n: u32| (f64::from(k) + 0.5) / f64::from(n);
        for height in [1.5, 1.0, 0.9, 0.5, 0.0, -0.5, -0.9, -1.0, -1.5] {
            // A receiver over whose horizon the middle of the disc stands so many radii high.
            let angle = height * radius;
            let normal = toward * math::sin(angle) + u * math::cos(angle);
            let at = Receiver { position: v(7.0, -2.0, 3.0), normal };
            let given = f64::from(disc.irradiance(&at).r);
            // The disc in rings and sectors, in one plane.
            let n = 400;
            let lux = |k: u32| {
                let across = math::tan(radius) * uniform(k / n, n).sqrt();
                let round = std::f64::consts::TAU * uniform(k % n, n);
                let way = toward + (u * math::cos(round) + w * math::sin(round)) * across;
                way.normalize().dot(normal).max(0.0)
            };
            let summed = (0..n * n).map(lux).sum::<f64>() / f64::from(n * n);
            assert!((given - summed).abs() < 0.004 * radius, "{radius} {height}: {given} {summed}");
            let sampled = (0..64 * 64).map(|k| {
                let choice = DVec2::new(uniform(k % 64, 64), uniform(k / 64, 64));
                f64::from(disc.sample(&at, choice).irradiance.r)
            });
            let sampled = sampled.sum::<f64>() / f64::from(64 * 64);
            assert!((given - sampled).abs() < 0.006 * radius, "{radius} {height}: {sampled}");
        }
        let facing = Receiver { position: DVec3::ZERO, normal: toward };
        close(f64::from(disc.irradiance(&facing).r), 1.0, 1e-6);
        let parts = disc.facets(&facing).unwrap();
        close(f64::from(disc.of_facet(&parts[0], &facing).r), 1.0, 1e-6);
    }
}

#[test]
fn a_tube_half_hidden_gives_what_its_other_half_gives() {
    let tube = |from: f64, to: f64| Line { ends: [v(from, 2.0, 0.3), v(to, 2.0, 0.3)] };
    let board = level([0.0, 50.0], 1.0, [-50.0, 50.0]);
    let floor = Receiver { position: DVec3::ZERO, normal: DVec3::Y };
    let seen =
        lit(&floor_under(&[(board, false)], 1e-4, 1), lamp(tube(-1.0, 1.5)), Shadows::Analytic);
    close(f64::from(seen[0]), f64::from(tube(-1.0, 0.0).irradiance(&floor).r), 1e-5);
}

/// Polygons in the air by chance.
fn things(seed: u64, count: usize) -> Vec<(Vec<DVec3>, bool)> {
    let mut random = Random::new(seed);
    let mut all = Vec::new();
    for i in 0..count {
        let mut point = |spread: f64| {
            v(random.between(-1.0, 1.0), random.between(-0.5, 0.5), random.between(-1.0, 1.0))
                * spread
        };
        let middle = point(1.2) + v(0.0, 1.0, 0.0);
        let corners: Vec<DVec3> = (0..3).map(|_| middle + point(0.5)).collect();
        all.push((corners, i % 4 == 0));
    }
    all
}

#[test]
fn cutting_agrees_with_very_many_rays() {
    let corner = |x: f64, y: f64, z: f64| v(x, y + 2.2, z) * 0.6;
    let points = [
        corner(0.0, 1.0, 0.0),
        corner(1.0, 0.0, 0.0),
        corner(0.0, 0.0, 1.0),
        corner(-1.0, 0.0, 0.0),
        corner(0.0, 0.0, -1.0),
        corner(0.0, -1.0, 0.0),
    ];
    let faces =
        [[0, 2, 1], [0, 3, 2], [0, 4, 3], [0, 1, 4], [5, 1, 2], [5, 2, 3], [5, 3, 4], [5, 4, 1]];
    let polygon = |face: &[usize; 3]| Polygon {
        outline: face.iter().map(|i| points[*i]).collect(),
        holes: Vec::new(),
    };
    let body = || Surface::of_body(faces.iter().map(polygon).collect()).unwrap();
    let with_hole = || {
        let mut outline = level([-1.0, 1.0], 2.0, [-1.0, 1.0]);
        outline.reverse();
        let hole = level([-0.5, 0.6], 2.0, [-0.4, 0.7]);
        Surface::new(vec![Polygon { outline, holes: vec![hole] }], true).unwrap()
    };
    let image = floor_under(&things(5, 40), 3.0, 16);
    let sources = [
        ("body", lamp(body())),
        ("panel", lamp(with_hole())),
        ("tube", lamp(Line { ends: [v(-1.0, 2.0, 0.3), v(1.2, 1.8, -0.5)] })),
    ];
    for (name, lamp) in sources {
        let exact = lit(&image, lamp.clone(), Shadows::Analytic);
        let open = lit(&image, lamp.clone(), Shadows::Off);
        // Rays are spread over the pixel too: by their own number they come nearer to the middle's value
        // only as far as light is straight within a pixel.
        let errors = [64, 1024].map(|rays| {
            let rays = lit(&image, lamp.clone(), Shadows::Rays(rays));
            let pairs = rays.iter().zip(&exact).zip(&open);
            pairs.map(|((a, b), open)| f64::from((a - b) / open).powi(2)).sum::<f64>() / 256.0
        });
        let errors = errors.map(f64::sqrt);
        assert!(errors[1] < 0.006 && errors[1] < errors[0] / 2.0, "{name}: {errors:?}");
        assert!(exact.iter().zip(&open).any(|(a, b)| *a < 0.8 * b), "{name}: nothing is hidden");
    }
}

#[test]
fn clusters_apart_hide_what_they_hide_together() {
    let things = things(9, 30);
    let together = floor_under(&things, 2.0, 8);
    let apart: Vec<SpanImage> = things.chunks(7).map(|part| floor_under(part, 2.0, 8)).collect();
    // The label decides which scenes are one: their contents differ.
    let apart = SpanImage::merge(&apart).unwrap();
    let lamp = lamp(panel([-1.0, 1.0], 2.0, [-1.0, 1.0]));
    let a = lit(&together, lamp.clone(), Shadows::Analytic);
    let b = lit(&apart, lamp, Shadows::Analytic);
    for (a, b) in a.iter().zip(&b) {
        assert!((a - b).abs() < 1e-5, "{a} {b}");
    }
}

#[test]
fn samples_tell_by_how_much_they_may_be_off() {
    let boards = [
        (level([-0.5, 0.4], 0.9, [-0.6, 0.2]), false),
        (level([0.1, 0.6], 1.2, [-0.2, 0.7]), true),
    ];
    let image = floor_under(&boards, 3.0, 40);
    let lamp = || lamp(panel([-0.7, 0.5], 2.0, [-0.5, 0.6]));
    let truth = lit(&image, lamp(), Shadows::Analytic);
    let shown = |lamps: Vec<Lamp>, shadows, fogged: bool| {
        let light = Illuminate { shadows, ..illuminate(lamps, Color::BLACK, Color::BLACK) };
        let mut image = image.shaded(Arc::new(light)).unwrap();
        if fogged {
            // Everything is 0.03 m away from the eye's plane.
            let density = std::f32::consts::LN_2 / 0.03;
            image = image.shaded(Arc::new(Fog { density, ..no_fog() })).unwrap();
        }
        let framing = Framing::scaled(image.view().raster(), DVec2::ONE).unwrap();
        let wanted = BTreeSet::from([Channel::Color, Channel::LightError, Channel::Light]);
        resolve(&image, Rule::Sloped(2), &framing, &wanted).unwrap()
    };
    let mean = |values: &[f32]| {
        (values.iter().map(|v| f64::from(v * v)).sum::<f64>() / values.len() as f64).sqrt()
    };
    let mut last = f64::INFINITY;
    for rays in [4, 16, 64] {
        let picture = shown(vec![lamp()], Shadows::Rays(rays), false);
        let (red, error) = (picture.float("R").unwrap(), picture.float("light_error.R").unwrap());
        let off: Vec<f32> = red.iter().zip(&truth).map(|(a, b)| a - b).collect();
        let (off, estimate) = (mean(&off), mean(error));
        // Rays that are spread evenly do better than random ones.
        assert!(off < estimate && off > 0.05 * estimate, "{rays}: {off} {estimate}");
        assert!(estimate < 0.7 * last, "{rays}: {estimate} after {last}");
        last = estimate;
        // Nothing stands before the light of some: all rays agree.
        assert!(error.contains(&0.0) && error.iter().all(|e| e.is_finite()));
        let sum: Vec<f32> = picture.float("light_lamp.R").unwrap().to_vec();
        assert_eq!(sum, red, "the error is no part of the sum");
    }
    let one = shown(vec![lamp()], Shadows::Rays(1), false);
    let open = lit(&floor_under(&[], 3.0, 40), lamp(), Shadows::Off);
    let least = one.float("light_error.R").unwrap().iter().zip(&open).map(|(e, l)| e / l);
    assert!(
        least.clone().all(|share| (share - 0.5).abs() < 1e-4),
        "{:?}",
        least.clone().fold(9.0, f32::min)
    );
    // Two lamps alike are off independently; fog weakens what is off as it weakens light.
    let of =
        |picture: &spandrel_engine::image::Image| mean(picture.float("light_error.R").unwrap());
    let two = || {
        let lamp = |name: &str| Lamp::new(name, true, Color::WHITE, lamp().light.clone());
        vec![lamp("a"), lamp("b")]
    };
    let both = of(&shown(two(), Shadows::Rays(16), false));
    close(both, of(&shown(vec![lamp()], Shadows::Rays(16), false)) * 2f64.sqrt(), 1e-5);
    close(of(&shown(two(), Shadows::Rays(16), true)), both / 2.0, 1e-4);
}
