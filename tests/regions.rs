//! One region for every way to look at a face: faces whose outlines cross themselves, whose holes overlap
//! and reach beyond them, as the eye, the light, mirrors and lamps see them, against a test of points that
//! shares no code with any.

use glam::{DVec2, DVec3, dvec3 as v};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::fragment::{Finish, Optics};
use spandrel_engine::image::Channel;
use spandrel_engine::key::Key;
use spandrel_engine::light::polygon::{Polygon, Surface};
use spandrel_engine::light::{Light, Receiver};
use spandrel_engine::raster::Raster;
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, Rule, Weighting, resolve};
use spandrel_engine::scene::{Document, Face, Material, Mesh, Object, Plan, Scene, Seal, Shape};
use spandrel_engine::shade::{Illuminate, Shadows, Trace};
use spandrel_engine::span::SpanImage;
use spandrel_engine::trace::Accelerator;
use spandrel_tests::lights::{illuminate, sun};
use spandrel_tests::random::Random;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

const PIXELS: u32 = 64;
const RULE: Rule = Rule::Sampled(8, Weighting::Box);

/// A face over the square from -1 to 1, as rings seen along z, in a plane of its own.
struct Made {
    outline: Vec<DVec2>,
    holes: Vec<Vec<DVec2>>,
    seals: Vec<Vec<DVec2>>,
    /// Its height over the origin, and how it leans.
    plane: DVec3,
}

fn ring(random: &mut Random, corners: u32, size: f64) -> Vec<DVec2> {
    let mut place =
        |reach: f64| DVec2::new(random.between(-reach, reach), random.between(-reach, reach));
    let middle = place(1.0 - size);
    (0..corners).map(|_| middle + place(size)).collect()
}

fn made(seed: u64) -> Vec<Made> {
    let mut random = Random::new(seed);
    (0..3)
        .map(|i| {
            let outline = ring(&mut random, 4 + i * 2, 0.95);
            let holes = (0..3).map(|_| ring(&mut random, 4, 0.5)).collect();
            let seals = (0..1).map(|_| ring(&mut random, 5, 0.6)).collect();
            let lean = |random: &mut Random| random.between(-0.15, 0.15);
            let plane = v(2.0 + f64::from(i), lean(&mut random), lean(&mut random));
            Made { outline, holes, seals, plane }
        })
        .collect()
}

/// Whether a point lies in a ring, by the even-odd rule.
fn inside(ring: &[DVec2], p: DVec2) -> bool {
    let next = ring.iter().cycle().skip(1);
    let crosses = |(a, b): (&DVec2, &DVec2)| {
        (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
    };
    ring.iter().zip(next).filter(|pair| crosses(*pair)).count() % 2 == 1
}

impl Made {
    fn is_there(&self, p: DVec2) -> bool {
        inside(&self.outline, p) && !self.holes.iter().any(|hole| inside(hole, p))
    }
}

/// The faces white and their seals black, each a scene of its own.
fn scenes(faces: &[Made], scale: f64) -> Vec<Arc<Scene>> {
    let material =
        |grey: f32| Material { color: Color::grey(grey), unlit: true, ..Material::default() };
    let scene = |(at, made): (usize, &Made)| {
        let mut mesh = Mesh::default();
        mesh.materials = vec!["face".into(), "seal".into()];
        let mut ring = |points: &Vec<DVec2>| -> Vec<u32> {
            let lift = |p: &DVec2| made.plane.x + made.plane.y * p.x + made.plane.z * p.y;
            points.iter().map(|p| mesh.add_point(v(p.x, p.y, lift(p)) * scale)).collect()
        };
        let outline = ring(&made.outline);
        let holes = made.holes.iter().map(&mut ring).collect();
        let seal = |outline: Vec<u32>| Seal { outline, sides: Sides::front(1), ..Seal::default() };
        let seals = made.seals.iter().map(&mut ring).map(seal).collect();
        let face = Face { outline, holes, seals, sides: Sides::front(0), ..Face::default() };
        mesh.add_face(face).unwrap();
        let mut document = Document::default();
        document.materials.insert("face".into(), material(1.0));
        document.materials.insert("seal".into(), material(0.25));
        finished(&format!("face {at}"), mesh, document)
    };
    faces.iter().enumerate().map(scene).collect()
}

struct Sides;

impl Sides {
    fn front(material: u32) -> spandrel_engine::scene::Sides {
        spandrel_engine::scene::Sides { front: Some(material), ..Default::default() }
    }
}

fn finished(label: &str, mesh: Mesh, mut document: Document) -> Arc<Scene> {
    document.plans.push(Plan { root: Object::new("mesh", Shape::Faces(mesh)), ..Plan::default() });
    let key = Key::of(&document);
    Arc::new(Scene::new(&document, None, label, key, Path::new("")).unwrap())
}

/// A wall behind all at z = 0, with a material.
fn wall(scale: f64, material: Material) -> Arc<Scene> {
    let mut mesh = Mesh::default();
    mesh.materials = vec!["wall".into()];
    let corners = [(-3.0, -3.0), (3.0, -3.0), (3.0, 3.0), (-3.0, 3.0)];
    let outline = corners.map(|(x, y)| mesh.add_point(v(x, y, 0.0) * scale)).to_vec();
    mesh.add_face(Face { outline, sides: Sides::front(0), ..Face::default() }).unwrap();
    let mut document = Document::default();
    document.materials.insert("wall".into(), material);
    finished("wall", mesh, document)
}

/// The square from -1 to 1 seen in parallel along -z, from a height.
fn view(height: f64, scale: f64) -> View {
    let position = v(0.0, 0.0, height) * scale;
    let camera = Camera {
        position,
        look_at: position - v(0.0, 0.0, scale),
        parallel_height: Some(2.0 * scale),
        ..Camera::default()
    };
    View::new(&camera, Raster::new(PIXELS, PIXELS).unwrap()).unwrap()
}

fn spans(scenes: &[Arc<Scene>], view: &View) -> SpanImage {
    let plan = RULE.plan().unwrap();
    let one = |scene: &Arc<Scene>| {
        scanline::render(&[scene.clone().into()], view, plan, 0..PIXELS).unwrap()
    };
    SpanImage::merge(&scenes.iter().map(one).collect::<Vec<_>>()).unwrap()
}

fn shown(image: &SpanImage) -> Vec<[f32; 4]> {
    let framing = Framing::whole(image.view().raster());
    let picture = resolve(image, RULE, &framing, &BTreeSet::from([Channel::Color])).unwrap();
    let pixels = (0..PIXELS).flat_map(|y| (0..PIXELS).map(move |x| (x, y)));
    pixels.map(|(x, y)| picture.rgba(x, y)).collect()
}

/// By pixel, the share of it in which `is_there` holds, by 16 x 16 points.
fn share(is_there: impl Fn(DVec2) -> bool) -> Vec<f64> {
    let step = 2.0 / f64::from(PIXELS);
    let pixels = (0..PIXELS).flat_map(|y| (0..PIXELS).map(move |x| (x, y)));
    let of = |(x, y): (u32, u32)| {
        let points = (0..16).flat_map(|j| (0..16).map(move |i| (i, j)));
        let point = |(i, j): (i32, i32)| {
            let at = |pixel: u32, k: i32| f64::from(pixel) + (f64::from(k) + 0.5) / 16.0;
            DVec2::new(at(x, i) * step - 1.0, 1.0 - at(y, j) * step)
        };
        points.filter(|p| is_there(point(*p))).count() as f64 / 256.0
    };
    pixels.map(of).collect()
}

/// The mean difference of two pictures, and the greatest.
fn apart(a: impl Iterator<Item = f64>, b: &[f64]) -> (f64, f64) {
    let each: Vec<f64> = a.zip(b).map(|(a, b)| (a - b).abs()).collect();
    (each.iter().sum::<f64>() / each.len() as f64, each.iter().fold(0.0, |a, b| a.max(*b)))
}

#[test]
fn eye_light_and_mirror_see_one_region() {
    for scale in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
        for seed in 0..4 {
            let faces = made(seed);
            let all = scenes(&faces, scale);
            let there = share(|p| faces.iter().any(|face| face.is_there(p)));
            // The eye, from above.
            let seen = shown(&spans(&all, &view(9.0, scale)));
            let (mean, worst) = apart(seen.iter().map(|p| f64::from(p[3])), &there);
            assert!(mean < 0.002 && worst < 0.1, "eye x {scale}, seed {seed}: {mean} {worst}");
            // Light from above on the wall, as seen from below all faces.
            let white = wall(scale, Material { color: Color::WHITE, ..Material::default() });
            let with_wall: Vec<Arc<Scene>> = all.iter().cloned().chain([white]).collect();
            let image = spans(&with_wall, &view(0.5, scale));
            let lamps = vec![sun(v(0.0, 0.0, -1.0), Color::WHITE)];
            for shadows in [Shadows::Volumes, Shadows::Rays(16)] {
                let light =
                    Illuminate { shadows, ..illuminate(lamps.clone(), Color::BLACK, Color::BLACK) };
                let lit = shown(&image.shaded(Arc::new(light)).unwrap());
                let dark = lit.iter().map(|p| 1.0 - f64::from(p[0]));
                let (mean, worst) = apart(dark, &there);
                let (bound, most) =
                    if shadows == Shadows::Volumes { (0.002, 0.1) } else { (0.02, 0.6) };
                assert!(
                    mean < bound && worst < most,
                    "{shadows:?} x {scale}, {seed}: {mean} {worst}"
                );
                // Bit for bit what the eye sees, line by line.
                if shadows == Shadows::Volumes {
                    let pairs = lit.iter().zip(&seen).map(|(l, s)| (1.0 - l[0] - s[3]).abs());
                    let worst = pairs.fold(0.0, f32::max);
                    assert!(worst < 2e-5, "light and eye x {scale}, {seed}: {worst}");
                }
            }
            // A mirror in the wall's place: each ray goes straight up. Seals show what they are.
            let optics = Optics { fresnel: false, ..Optics::default() };
            let finish = Finish { optics: Some(optics), ..Finish::default() };
            let glass =
                Material { color: Color::BLACK, finish, unlit: true, ..Material::default() };
            let with_mirror: Vec<Arc<Scene>> =
                all.iter().cloned().chain([wall(scale, glass)]).collect();
            let trace = Trace {
                rays: 1,
                depth: 2,
                least: 1e-3,
                background: Color::BLACK,
                sky: None,
                accelerator: Accelerator::Tree,
            };
            let image = spans(&with_mirror, &view(0.5, scale)).shaded(Arc::new(trace)).unwrap();
            let mirrored = shown(&image);
            // From below the lowest is seen.
            let colors = |p: DVec2| {
                let lowest = faces.iter().find(|face| face.is_there(p))?;
                Some(if lowest.seals.iter().any(|seal| inside(seal, p)) { 0.25 } else { 1.0 })
            };
            let exact =
                |share: f64, whole: f64| (share == 1.0 || share == 0.0).then_some(share * whole);
            let face = share(|p| colors(p) == Some(1.0));
            let seal = share(|p| colors(p) == Some(0.25));
            for ((found, face), seal) in mirrored.iter().zip(face).zip(seal) {
                let Some(expected) = exact(face, 1.0).zip(exact(seal, 0.25)) else { continue };
                let expected = expected.0 + expected.1;
                assert!((f64::from(found[0]) - expected).abs() < 1e-5, "mirror x {scale}, {seed}");
            }
        }
    }
}

/// Cosines of directions spread evenly over the half-space above, as their projections on the disc.
fn directions(count: u32) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |i| {
        let u = (f64::from(i) + 0.5) / f64::from(count);
        let turn = f64::from(i) * 0.618_033_988_749_895 * std::f64::consts::TAU;
        let r = u.sqrt();
        let (s, c) = (spandrel_engine::math::sin(turn), spandrel_engine::math::cos(turn));
        v(r * c, (1.0 - u).sqrt(), r * s)
    })
}

/// The mean of many samples.
fn sampled(light: &dyn Light, at: &Receiver) -> f64 {
    // The plastic number's powers spread points evenly over the square.
    let count = 100_000u32;
    let choice = |i: u32| {
        let at = f64::from(i) + 0.5;
        DVec2::new((at * 0.754_877_666_246_693).fract(), (at * 0.569_840_290_998_053).fract())
    };
    let sum: f64 = (0..count).map(|i| f64::from(light.sample(at, choice(i)).irradiance.r)).sum();
    sum / f64::from(count)
}

#[test]
fn a_lamp_shines_where_its_outline_is_by_every_method() {
    let floor = |x: f64| Receiver { position: v(x, 0.0, 0.2), normal: DVec3::Y };
    for seed in 0..6 {
        let made = &made(seed)[1];
        // The ring at a height of 1, seen from below.
        let lift =
            |ring: &Vec<DVec2>| -> Vec<DVec3> { ring.iter().map(|p| v(p.x, 1.0, p.y)).collect() };
        let polygon =
            Polygon { outline: lift(&made.outline), holes: made.holes.iter().map(&lift).collect() };
        let surface = Surface::new(vec![polygon], true).unwrap();
        for at in [-0.6, 0.1, 0.9].map(floor) {
            let closed = f64::from(surface.irradiance(&at).r);
            let facets = surface.facets(&at).unwrap();
            let parts: f64 = facets.iter().map(|f| f64::from(surface.of_facet(f, &at).r)).sum();
            let count = 200_000;
            let hits = directions(count).filter(|d| {
                let p = at.position + *d * ((1.0 - at.position.y) / d.y);
                made.is_there(DVec2::new(p.x, p.z))
            });
            let expected = hits.count() as f64 / f64::from(count) * std::f64::consts::PI;
            let sampled = sampled(&surface, &at);
            for (what, found) in [("closed form", closed), ("facets", parts), ("samples", sampled)]
            {
                let off = (found - expected).abs();
                assert!(off < 0.004 * (expected + 0.1), "{what}, seed {seed}: {found} {expected}");
            }
        }
    }
}

/// A prism over an outline seen from above, as the faces of a body.
fn prism(outline: &[(f64, f64)], low: f64, high: f64) -> Vec<Polygon> {
    let at = |(x, z): (f64, f64), y: f64| v(x, y, z);
    let cap = |y: f64| -> Vec<DVec3> { outline.iter().map(|p| at(*p, y)).collect() };
    let (mut bottom, top) = (cap(low), cap(high));
    bottom.reverse();
    let mut faces = vec![bottom, top];
    for (i, p) in outline.iter().enumerate() {
        let q = outline[(i + 1) % outline.len()];
        faces.push(vec![at(*p, low), at(q, low), at(q, high), at(*p, high)]);
    }
    faces.into_iter().map(|outline| Polygon { outline, holes: Vec::new() }).collect()
}

#[test]
fn a_body_that_is_not_convex_hides_parts_of_itself() {
    // An L, a U and a convex block, lying on the side; what a receiver gets is what the silhouette takes of its sky.
    let l = [(0.0, 0.0), (0.0, 0.3), (0.7, 0.3), (0.7, 1.0), (1.0, 1.0), (1.0, 0.0)];
    let u = [
        (0.0, 0.0),
        (0.0, 1.0),
        (0.3, 1.0),
        (0.3, 0.3),
        (0.7, 0.3),
        (0.7, 1.0),
        (1.0, 1.0),
        (1.0, 0.0),
    ];
    let block = [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)];
    for outline in [&l[..], &u, &block] {
        for scale in [1e-6, 1.0, 1e6] {
            let mut faces = prism(outline, 0.5, 1.2);
            for point in faces.iter_mut().flat_map(|face| &mut face.outline) {
                *point *= scale;
            }
            let surface = Surface::of_body(faces).unwrap();
            let receivers =
                [v(0.35, 0.1, 0.7), v(-0.8, 0.4, 0.2), v(0.5, 0.8, 2.0), v(1.6, 0.9, -0.7)];
            for (i, position) in receivers.into_iter().enumerate() {
                let normal =
                    [DVec3::Y, v(1.0, 0.2, 0.1), -DVec3::Z, v(-0.7, 0.0, 1.0)][i].normalize();
                let at = Receiver { position: position * scale, normal };
                let (across, along) = normal.any_orthonormal_pair();
                let count = 100_000;
                let hits = directions(count).filter(|d| {
                    let way = across * d.x + normal * d.y + along * d.z;
                    meets(outline, 0.5, 1.2, position, way)
                });
                let expected = hits.count() as f64 / f64::from(count) * std::f64::consts::PI;
                let closed = f64::from(surface.irradiance(&at).r);
                let sampled = sampled(&surface, &at);
                let off = |found: f64| (found - expected).abs() / (expected + 0.02);
                assert!(off(closed) < 0.005, "{i} x {scale}: closed form {closed}, {expected}");
                assert!(off(sampled) < 0.01, "{i} x {scale}: samples {sampled}, {expected}");
            }
        }
    }
}

/// Whether a ray meets a prism: where it is between the caps, step by step through the outline's columns.
fn meets(outline: &[(f64, f64)], low: f64, high: f64, from: DVec3, way: DVec3) -> bool {
    let ring: Vec<DVec2> = outline.iter().map(|(x, z)| DVec2::new(*x, *z)).collect();
    let mut t: Vec<f64> = vec![(low - from.y) / way.y, (high - from.y) / way.y];
    for (i, a) in ring.iter().enumerate() {
        let edge = ring[(i + 1) % ring.len()] - *a;
        let to = *a - DVec2::new(from.x, from.z);
        t.push(to.perp_dot(edge) / DVec2::new(way.x, way.z).perp_dot(edge));
    }
    t.retain(|t| t.is_finite() && *t > 0.0);
    t.push(0.0);
    t.sort_unstable_by(f64::total_cmp);
    t.windows(2).any(|pair| {
        let p = from + way * ((pair[0] + pair[1]) / 2.0);
        pair[1] - pair[0] > 1e-12 && p.y > low && p.y < high && inside(&ring, DVec2::new(p.x, p.z))
    })
}
