//! Numbers at the extremes: the right answer or an error, never a panic, a NaN pixel or a black frame.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::key::Key;
use spandrel_engine::light::list::{MakeLamp, ParallelLight};
use spandrel_engine::raster::Raster;
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, Rule, Weighting, resolve};
use spandrel_engine::scene::read::text;
use spandrel_engine::scene::{Mesh, Object, Scene, Shape, Step, Transform};
use spandrel_engine::shade::{Fog, Illuminate, Shadows};
use spandrel_engine::span::SpanImage;
use spandrel_tests::lights::{self, illuminate, no_fog};
use spandrel_tests::random::Random;
use spandrel_tests::scenes;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

const RULES: [Rule; 5] = [
    Rule::Sampled(3, Weighting::Trapezoid),
    Rule::Sampled(4, Weighting::Box),
    Rule::Sloped(4),
    Rule::Adaptive(2, 0.01),
    Rule::Exact,
];

pub(crate) fn render(
    scene: &Arc<Scene>,
    camera: &Camera,
    size: (u32, u32),
    rule: Rule,
) -> SpanImage {
    let view = View::new(camera, Raster::new(size.0, size.1).unwrap()).unwrap();
    scanline::render(&[scene.clone().into()], &view, rule.plan().unwrap(), 0..size.1).unwrap()
}

pub(crate) fn picture(image: &SpanImage, rule: Rule) -> Image {
    let channels = BTreeSet::from([Channel::Color, Channel::Z, Channel::N, Channel::P]);
    resolve(image, rule, &Framing::whole(image.view().raster()), &channels).unwrap()
}

/// The covered area in pixels.
fn area(image: &SpanImage, rule: Rule) -> f64 {
    picture(image, rule).float("A").unwrap().iter().map(|a| f64::from(*a)).sum()
}

fn has_nan(picture: &Image) -> bool {
    let names = ["R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z"];
    names.iter().any(|name| picture.float(name).unwrap().iter().any(|v| v.is_nan()))
}

fn wall(z: f64, half: f64) -> Vec<DVec3> {
    [(-half, -half), (half, -half), (half, half), (-half, half)]
        .map(|(x, y)| DVec3::new(x, y, z))
        .to_vec()
}

#[test]
fn the_size_of_the_world_changes_no_bit() {
    // Powers of two about 1e28 and 1e-28: what is refused begins at 1e30 and 1e-30.
    for power in [93, -93, 30, -30] {
        let scale = f64::from(power).exp2();
        for seed in 0..6 {
            let mesh = scenes::random_panes(seed, 20);
            let mut scaled = mesh.clone();
            scaled.points.iter_mut().for_each(|p| *p *= scale);
            let camera = Camera::default();
            let far = Camera {
                position: camera.position * scale,
                look_at: camera.look_at * scale,
                ..camera.clone()
            };
            for rule in RULES {
                let a = render(&scenes::scene("a", mesh.clone()), &camera, (40, 30), rule);
                let b = render(&scenes::scene("a", scaled.clone()), &far, (40, 30), rule);
                assert_eq!(a.lines(), b.lines(), "2^{power}, seed {seed}, {rule:?}");
                assert_eq!(a.layers(), b.layers(), "2^{power}, seed {seed}, {rule:?}");
                // Light too, with what stands in its way, by both methods.
                let shadows = [Shadows::Off, Shadows::Volumes, Shadows::Rays(4)][seed as usize % 3];
                let lit = |image: &SpanImage| {
                    let lamps = vec![lights::sun((-0.5, -0.4, -0.8), Color::WHITE)];
                    let light = illuminate(lamps, Color::BLACK, Color::BLACK);
                    let light = Illuminate { shadows, ..light };
                    picture(&image.shaded(Arc::new(light)).unwrap(), rule)
                };
                let (a, b) = (lit(&a), lit(&b));
                for name in ["R", "A", "N.X"] {
                    assert_eq!(a.float(name), b.float(name), "2^{power} {shadows:?} {name}");
                }
            }
        }
    }
}

#[test]
fn depth_holds_nine_digits_from_a_millimetre_to_a_thousand_kilometres() {
    // Walls, each a billionth farther than the last, at distances over nine powers of ten.
    for distance in [1e-3, 1.0, 1e3, 1e6] {
        // Objects of their own: faces of one object that are so near to one plane share it.
        let object = |i: u32| {
            let z = 10.0 - distance * (1.0 + f64::from(i) * 1e-9);
            let mesh = scenes::polygons(&[wall(z, distance * 9.0)]);
            Object::new(format!("wall {i}"), Shape::Faces(mesh))
        };
        let mut root = Object::new("walls", Shape::Group);
        root.children = (0..4).map(object).collect();
        let scene = Arc::new(Scene::from_object("walls", root).unwrap());
        let camera = Camera { position: DVec3::Z * 10.0, ..Camera::default() };
        for rule in RULES {
            let image = render(&scene, &camera, (9, 7), rule);
            let seen: BTreeSet<u32> = image.lines().items().iter().map(|s| s.face.0).collect();
            // The camera's own place at 10 m leaves 2e-15 / distance of it.
            assert_eq!(seen, BTreeSet::from([0]), "at {distance}: the nearest, everywhere");
            let plane = image.face(spandrel_engine::span::FaceId(0)).1.plane;
            let found = image.view().distance(plane.depth(4.3, 3.2));
            let bound = 1e-12 + 4e-15 / distance;
            assert!((found / distance - 1.0).abs() < bound, "{found} for {distance}");
        }
    }
}

#[test]
fn the_ground_ends_at_the_horizon() {
    // A plane 1 m under the eye, from behind it to a thousand kilometres ahead.
    let ground = |reach: f64| {
        let ring = [(-reach, reach), (reach, reach), (reach, -reach), (-reach, -reach)];
        let ring = ring.map(|(x, z)| DVec3::new(x, -1.0, z)).to_vec();
        scenes::scene("ground", scenes::polygons(&[ring]))
    };
    let camera = Camera { position: DVec3::ZERO, look_at: DVec3::NEG_Z, ..Camera::default() };
    for reach in [1e3, 1e6, 1e9, 1e12] {
        for rule in RULES {
            let image = render(&ground(reach), &camera, (40, 40), rule);
            let picture = picture(&image, rule);
            let alpha = picture.float("A").unwrap();
            let rows: Vec<f32> = (0..40).map(|y| alpha[y * 40 + 13]).collect();
            assert!(rows[..19].iter().all(|a| *a == 0.0), "{reach} {rule:?}: {rows:?}");
            assert!(rows[21..].iter().all(|a| (*a - 1.0).abs() < 1e-6), "{reach}: {rows:?}");
            // Z on the ground is the height over the tangent of the angle below the horizon.
            for y in 25..40usize {
                let tangent = (y as f64 + 0.5 - 20.0) / 20.0
                    * spandrel_engine::math::tan(camera.field_of_view.to_radians() / 2.0);
                let z = f64::from(picture.float("Z").unwrap()[y * 40 + 13]);
                assert!((z * tangent - 1.0).abs() < 0.03, "{reach} row {y}: {z}");
            }
        }
    }
}

#[test]
fn slivers_of_a_millionth_of_a_pixel_keep_their_area() {
    let mut random = Random::new(3);
    let (count, width) = (4000, 1e-6);
    let mut polygons = Vec::new();
    for i in 0..count {
        let (x, y) = (random.between(0.5, 15.0), f64::from(i % 16));
        let lean = random.between(-0.4, 0.4);
        let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        polygons.push(vec![
            at(x, y),
            at(x + width, y),
            at(x + width + lean, y + 1.0),
            at(x + lean, y + 1.0),
        ]);
    }
    let scene = scenes::scene("slivers", scenes::polygons(&polygons));
    for rule in RULES {
        let view = scenes::pixel_view(16, 16);
        let plan = rule.plan().unwrap();
        let image = scanline::render(&[scene.clone().into()], &view, plan, 0..16).unwrap();
        let (found, expected) = (area(&image, rule), f64::from(count) * width);
        assert!((found / expected - 1.0).abs() < 0.02, "{rule:?}: {found} of {expected}");
        assert!(!has_nan(&picture(&image, rule)));
    }
}

#[test]
fn ten_thousand_coincident_faces_are_one() {
    let polygons = vec![wall(0.0, 2.0); 10_000];
    let scene = scenes::scene("stack", scenes::polygons(&polygons));
    for rule in RULES {
        let image = render(&scene, &Camera::default(), (64, 48), rule);
        let seen: BTreeSet<u32> =
            image.lines().items().iter().map(|s| s.face.0).filter(|id| *id != u32::MAX).collect();
        assert_eq!(seen.len(), 1, "{rule:?}: {seen:?}");
        assert_eq!(
            image.face(spandrel_engine::span::FaceId(*seen.first().unwrap())).1.ordinal,
            9999
        );
    }
}

#[test]
fn planes_a_unit_in_the_last_place_apart_do_not_fight() {
    for z in [0.0, 1.0, -3.0, 9.0] {
        // Tilted, so that every number of the planes is rounded.
        let tilted = |lift: f64| -> Vec<DVec3> {
            let turn = |p: DVec3| DVec3::new(p.x, p.y, z + lift + p.x * 0.3 - p.y * 0.7);
            wall(0.0, 3.0).into_iter().map(turn).collect()
        };
        let step = 1.0f64.next_up() - 1.0;
        for lift in [step, 4.0 * step, 64.0 * step] {
            // Objects of their own: no plane is shared.
            let [a, b] = [0.0, lift].map(|lift| scenes::polygons(&[tilted(lift)]));
            let object = |name: &str, mesh: Mesh| Object::new(name, Shape::Faces(mesh));
            let mut root = Object::new("both", Shape::Group);
            root.children = vec![object("a", a), object("b", b)];
            let scene = Arc::new(Scene::from_object("walls", root).unwrap());
            for rule in RULES {
                let image = render(&scene, &Camera::default(), (64, 48), rule);
                // At most one seam: planes that close may cross once on a line, but never flicker.
                for k in image.lines().range() {
                    let faces = image.lines().line(k).iter().filter(|s| s.face.is_some()).count();
                    assert!(faces <= 2, "z {z}, {lift}: {faces} spans on a line");
                }
            }
        }
    }
}

#[test]
fn faces_edge_on_are_thin_and_keep_their_depth() {
    let camera = Camera { position: DVec3::Z * 10.0, look_at: DVec3::ZERO, ..Camera::default() };
    let focal = 32.0 / spandrel_engine::math::tan(camera.field_of_view.to_radians() / 2.0);
    for (tilt, far) in
        [0.0, 1e-15, 1e-9, 1e-6, 1e-3, 0.1].into_iter().flat_map(|t| [(t, 0.0), (t, 1.0)])
    {
        // A square along the view axis, whose plane goes through the eye, or through its own near edge.
        let x = |z: f64| tilt * ((10.0 - z) - far * 6.0);
        let at = |y: f64, z: f64| DVec3::new(x(z), y, z);
        let ring = vec![at(-1.0, 4.0), at(1.0, 4.0), at(1.0, -4.0), at(-1.0, -4.0)];
        let scene = scenes::scene("card", scenes::polygons(&[ring]));
        // On the screen it is a trapezoid, or a line.
        let width = (x(-4.0) / 14.0 - x(4.0) / 6.0).abs() * focal;
        let expected = width * focal * (1.0 / 6.0 + 1.0 / 14.0);
        for rule in RULES {
            let image = render(&scene, &camera, (64, 64), rule);
            let picture = picture(&image, rule);
            assert!(!has_nan(&picture), "{tilt} {rule:?}");
            let depths = picture.float("Z").unwrap().iter().filter(|z| z.is_finite());
            for z in depths {
                assert!((5.99..14.01).contains(z), "{tilt} {rule:?}: Z {z}");
            }
            let found = area(&image, rule);
            // Boundaries are whole cells, 2^-25 of a pixel here, on some thirty rows.
            let slack = 30.0 * 2.0 / f64::from(1 << 25) + 0.02 * expected;
            assert!((found - expected).abs() < slack, "{tilt} {rule:?}: {found} of {expected}");
        }
    }
}

#[test]
fn nothing_behind_the_eye_is_seen() {
    let mut random = Random::new(8);
    let mut polygons = Vec::new();
    for _ in 0..200 {
        let mut corner = || {
            DVec3::new(
                random.between(-1e3, 1e3),
                random.between(-1e3, 1e3),
                10.0 + random.between(0.0, 1e3) + f64::MIN_POSITIVE,
            )
        };
        polygons.push(vec![corner(), corner(), corner()]);
    }
    let scene = scenes::scene("behind", scenes::polygons(&polygons));
    for rule in RULES {
        assert_eq!(area(&render(&scene, &Camera::default(), (32, 24), rule), rule), 0.0);
    }
}

#[test]
fn pictures_of_one_pixel_and_of_65536_are_pictures() {
    // The middle of the view, three fifths high, and as wide as it is high.
    let camera = Camera::default();
    let half = spandrel_engine::math::tan(camera.field_of_view.to_radians() / 2.0) * 10.0 * 0.6;
    let scene = scenes::scene("square", scenes::polygons(&[wall(0.0, half)]));
    for rule in RULES {
        for (width, height, slack) in
            [(1, 1, 0.3), (65_536, 1, 0.3), (1, 65_536, 1e-3), (65_536, 3, 0.15), (7, 1000, 1e-2)]
        {
            let image = render(&scene, &camera, (width, height), rule);
            // Pixels are square: the square covers 0.6 of the height, and as much of the width.
            let wide = (0.6 * f64::from(height)).min(f64::from(width));
            let expected = wide * 0.6 * f64::from(height);
            let found = area(&image, rule);
            assert!(
                (found / expected - 1.0).abs() < slack,
                "{width}x{height} {rule:?}: {found} {expected}"
            );
        }
    }
}

#[test]
fn scales_from_a_thousandth_to_a_thousand_keep_the_share() {
    let scene = scenes::scene("faces", scenes::random_faces(4, 20));
    for rule in RULES {
        let image = render(&scene, &Camera::default(), (600, 400), rule);
        let share = area(&image, rule) / 240_000.0;
        for scale in [1e-3, 1e-2, 0.3, 3.0] {
            let raster = image.view().raster();
            let framing = Framing::scaled(raster, DVec2::splat(scale)).unwrap();
            let channels = BTreeSet::from([Channel::Color]);
            let scaled = resolve(&image, rule, &framing, &channels).unwrap();
            let pixels = scaled.float("A").unwrap();
            let sum: f64 = pixels.iter().map(|a| f64::from(*a)).sum();
            let found = sum / (240_000.0 * scale * scale);
            assert!((found / share - 1.0).abs() < 0.01, "{rule:?} {scale}: {found} {share}");
        }
    }
}

#[test]
fn a_thousand_times_an_edge_is_still_straight() {
    // In each of the windows the coverage is that of the half plane beside the one edge that crosses it.
    let corners = [(0.7, 0.9), (7.1, 2.3), (3.3, 7.2)];
    let triangle = corners.map(|(x, y)| DVec3::new(x, y, 0.0));
    let scene = scenes::scene("triangle", scenes::polygons(&[triangle.to_vec()]));
    for rule in RULES {
        let view = scenes::pixel_view(8, 8);
        let plan = rule.plan().unwrap();
        let image = scanline::render(&[scene.clone().into()], &view, plan, 0..8).unwrap();
        let whole = Framing::scaled(view.raster(), DVec2::splat(1000.0)).unwrap();
        for (i, (px, py)) in corners.into_iter().enumerate() {
            let (qx, qy) = corners[(i + 1) % 3];
            // Where an edge crosses a line of every rule, halfway down a row and away from its ends.
            let y = ((py + qy) / 2.0).floor() + 0.5;
            let x = px + (qx - px) * (y - py) / (qy - py);
            let (column, row) = ((x * 1000.0) as u32 - 16, ((8.0 - y) * 1000.0) as u32 - 16);
            let window =
                spandrel_engine::image::Window { x: column, y: row, width: 32, height: 32 };
            let channels = BTreeSet::from([Channel::Color]);
            let part =
                resolve(&image, rule, &whole.clone().cut(window).unwrap(), &channels).unwrap();
            let found: f64 = part.float("A").unwrap().iter().map(|a| f64::from(*a)).sum();
            // Through the middle of the window: half of it, whatever the slope; sampled, the steps of
            // a line are a hundred pixels high.
            let off = (found / 1024.0 - 0.5).abs();
            let bound = if matches!(rule, Rule::Sampled(..)) { 0.51 } else { 0.04 };
            assert!(off < bound, "{rule:?} edge {i}: {found}");
            if !matches!(rule, Rule::Sampled(..)) {
                // Straight: each row of pixels differs from the one above it by the slope.
                let rows: Vec<f64> = part
                    .float("A")
                    .unwrap()
                    .chunks(32)
                    .map(|row| row.iter().map(|a| f64::from(*a)).sum())
                    .collect();
                let slope = -(qx - px) / (qy - py);
                for pair in rows.windows(2).filter(|p| p.iter().all(|a| (6.0..26.0).contains(a))) {
                    let step = (pair[1] - pair[0]).abs();
                    assert!((step - slope.abs()).abs() < 1e-3, "{rule:?} edge {i}: {step} {slope}");
                }
            }
        }
    }
}

#[test]
fn any_number_of_lines_from_1_to_1024_gives_the_area() {
    let triangle = [(0.7, 0.9), (7.1, 2.3), (3.3, 7.2)].map(|(x, y)| DVec3::new(x, y, 0.0));
    let scene = scenes::scene("triangle", scenes::polygons(&[triangle.to_vec()]));
    let exact = 18.34;
    for n in [1, 2, 5, 16, 100, 1024] {
        for rule in [
            Rule::Sampled(n, Weighting::Trapezoid),
            Rule::Sampled(n, Weighting::Box),
            Rule::Sloped(n),
        ] {
            let view = scenes::pixel_view(8, 8);
            let plan = rule.plan().unwrap();
            let image = scanline::render(&[scene.clone().into()], &view, plan, 0..8).unwrap();
            let error = (area(&image, rule) - exact).abs();
            // The length of a line is straight between corners: all error is at these, an eighth of the
            // square of the lines' distance times the bends, which sum to 10.8.
            let bound = 10.8 / 8.0 / f64::from(n).powi(2) + 1e-4;
            assert!(error < bound, "{rule:?}: off by {error}");
        }
    }
    assert!(Rule::Sloped(0).plan().is_err() && Rule::Sloped(1025).plan().is_err());
}

#[test]
fn empty_scenes_are_empty_pictures() {
    let scene = Arc::new(Scene::from_object("nothing", Object::default()).unwrap());
    for rule in RULES {
        let image = render(&scene, &Camera::default(), (5, 4), rule);
        let lit = illuminate(Vec::new(), Color::WHITE, Color::WHITE);
        let fog = Fog { density: 1.0, color: Color::WHITE, start: 0.0, ..no_fog() };
        let image = image.shaded(Arc::new(lit)).unwrap().shaded(Arc::new(fog)).unwrap();
        let picture = picture(&SpanImage::merge(&[image.clone(), image]).unwrap(), rule);
        assert!(picture.float("A").unwrap().iter().all(|a| *a == 0.0));
        assert!(picture.float("Z").unwrap().iter().all(|z| z.is_infinite()));
        assert!(!has_nan(&picture));
    }
}

#[test]
fn cameras_lights_and_transforms_refuse_what_is_no_number() {
    let raster = Raster::new(4, 4).unwrap();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let v = DVec3::new(0.0, bad, 0.0);
        let base = Camera::default;
        for camera in [
            Camera { position: v, ..base() },
            Camera { look_at: v, ..base() },
            Camera { field_of_view: bad, ..base() },
            Camera { roll: bad, ..base() },
            Camera { parallel_height: Some(bad), ..base() },
            Camera { front: bad, ..base() },
        ] {
            assert!(View::new(&camera, raster).is_err(), "{camera:?}");
        }
        let color = Color::new(bad as f32, 0.0, 0.0);
        for light in [
            ParallelLight { direction: v, ..ParallelLight::default() },
            ParallelLight { color, ..ParallelLight::default() },
            ParallelLight { illuminance: bad, ..ParallelLight::default() },
        ] {
            assert!(light.lamp("", Path::new("")).is_err(), "{light:?}");
        }
        let mut object = Object::new("box", Shape::Box { size: [1.0; 3] });
        object.transform = Transform(vec![Step::Move(bad, 0.0, 0.0)]);
        assert!(Scene::from_object("moved", object).is_err());
        let object = Object::new("box", Shape::Box { size: [1.0, bad, 1.0] });
        assert!(Scene::from_object("box", object).is_err());
        let mut mesh = scenes::polygons(&[wall(0.0, 1.0)]);
        mesh.points[2].x = bad;
        assert!(Scene::from_object("mesh", Object::new("mesh", Shape::Faces(mesh))).is_err());
    }
}

#[test]
fn beyond_the_range_that_is_exact_there_is_an_error() {
    let square = |half: f64, z: f64| {
        let root = Object::new("square", Shape::Faces(scenes::polygons(&[wall(z, half)])));
        Scene::from_object("scene", root)
    };
    let placed = |step: Step| {
        let mut object = Object::new("box", Shape::Box { size: [1.0; 3] });
        object.transform = Transform(vec![step]);
        Scene::from_object("scene", object)
    };
    let refused = [
        square(1e100, 0.0),
        square(1e31, 0.0),
        square(1.0, -1e31),
        square(1e-31, 0.0),
        square(1e-100, 0.0),
        placed(Step::Scale(1e40)),
        placed(Step::Scale(1e-40)),
        placed(Step::Move(0.0, 1e35, 0.0)),
    ];
    for (at, scene) in refused.into_iter().enumerate() {
        let error = scene.map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("exact") && error.contains("object \""), "{at}: {error}");
    }
    for scene in [square(1e29, 0.0), square(1e-29, 0.0), placed(Step::Scale(1e28))] {
        assert_eq!(scene.unwrap().instances.len(), 1);
    }
    let raster = Raster::new(4, 4).unwrap();
    for camera in [
        Camera { position: DVec3::X * 1e31, ..Camera::default() },
        Camera { parallel_height: Some(1e31), ..Camera::default() },
        Camera { back: Some(1e31), ..Camera::default() },
    ] {
        assert!(View::new(&camera, raster).unwrap_err().to_string().contains("1e30"));
    }
    let light = spandrel_engine::light::list::PointLight {
        position: DVec3::Z * 1e100,
        ..Default::default()
    };
    assert!(light.lamp("", Path::new("")).is_err());
}

/// Every number of a text in turn becomes an extreme one.
#[test]
fn extreme_numbers_anywhere_in_a_scene_end_in_a_picture_or_an_error() {
    let values =
        ["NaN", "inf", "-1e308", "1e308", "1e-308", "0", "-1", "1e20", "1e999", "4294967295"];
    for source in
        [include_str!("../graphs/assets/panes.ron"), include_str!("../graphs/assets/solids.ron")]
    {
        let bytes = source.as_bytes();
        let starts_number = |i: usize| {
            bytes[i].is_ascii_digit()
                && !(bytes[i - 1].is_ascii_alphanumeric() || b".#\"".contains(&bytes[i - 1]))
        };
        let numbers: Vec<(usize, usize)> = (1..bytes.len())
            .filter(|i| starts_number(*i))
            .map(|i| {
                let end = source[i..].find(|c: char| !(c.is_ascii_digit() || c == '.'));
                (i, i + end.unwrap_or(0))
            })
            .collect();
        assert!(numbers.len() > 40);
        let ends: Vec<bool> = numbers
            .par_iter()
            .enumerate()
            .map(|(n, (from, to))| {
                let value = values[n % values.len()];
                let changed = format!("{}{value}{}", &source[..*from], &source[*to..]);
                let Ok(document) = text::parse(Path::new("t.ron"), changed.as_bytes()) else {
                    return false;
                };
                let key = Key::of(&changed);
                let Ok(scene) = Scene::new(&document, None, "t", key, Path::new("")) else {
                    return false;
                };
                let (scene, camera) = (
                    Arc::new(scene),
                    Camera { position: DVec3::new(1.5, 7.2, 15.5), ..Camera::default() },
                );
                let view = View::new(&camera, Raster::new(24, 16).unwrap()).unwrap();
                let plan = RULES[2].plan().unwrap();
                let Ok(image) = scanline::render(&[scene.into()], &view, plan, 0..16) else {
                    return false;
                };
                assert!(!has_nan(&picture(&image, RULES[2])), "{value} at byte {from}");
                true
            })
            .collect();
        let pictures = ends.iter().filter(|drawn| **drawn).count();
        // Some are harmless, some are refused.
        assert!(pictures > ends.len() / 8 && pictures < ends.len(), "{pictures} of {}", ends.len());
    }
}
