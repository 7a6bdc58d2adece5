//! Light without shadows: closed forms against textbooks and sums, samples against closed forms, measured
//! lamps against the flux that their makers state, and numbers that no light has.

use glam::{DVec2, DVec3, dvec3 as v};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::error::Error;
use spandrel_engine::fragment::Environment;
use spandrel_engine::image::Channel;
use spandrel_engine::key::Key;
use spandrel_engine::light::line::Line;
use spandrel_engine::light::list::{
    AmbientLight, AreaLight, LightEntry, LinearLight, MakeLamp, ParallelLight, PointLight,
    PolyhedralLight, SkyLight, SpotLight, SunLight,
};
use spandrel_engine::light::polygon::{Polygon, Surface};
use spandrel_engine::light::sky::{Sky, SkyModel};
use spandrel_engine::light::{Light, Receiver};
use spandrel_engine::raster::Raster;
use spandrel_engine::render::scanline::render;
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::scene::{Document, Mesh, Object, Plan, Scene, Shape};
use spandrel_engine::shade::Illuminate;
use spandrel_tests::lights::{close, illuminate};
use spandrel_tests::random::Random;

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

/// A receiver in the origin that faces up.
fn floor() -> Receiver {
    Receiver { position: DVec3::ZERO, normal: DVec3::Y }
}

fn lux(light: &dyn Light, at: &Receiver) -> f64 {
    f64::from(light.irradiance(at).r)
}

fn surface(outline: Vec<DVec3>, holes: Vec<Vec<DVec3>>) -> Surface {
    Surface::new(vec![Polygon { outline, holes }], false).unwrap()
}

/// A rectangle over the first quadrant at height c, that shines down.
fn ceiling(a: f64, b: f64, c: f64) -> Vec<DVec3> {
    vec![v(0.0, c, 0.0), v(a, c, 0.0), v(a, c, b), v(0.0, c, b)]
}

#[test]
fn rectangles_give_what_the_textbooks_configuration_factors_say() {
    let atan = |x: f64| spandrel_engine::math::atan2(x, 1.0);
    for (a, b, c) in [(1.0f64, 1.0f64, 1.0f64), (3.0, 0.5, 2.0), (0.01, 40.0, 0.3), (1e5, 1e5, 1.0)]
    {
        // Parallel to the receiver, a corner above it.
        let (p, q) = (a / c, b / c);
        let (r, s) = ((1.0 + p * p).sqrt(), (1.0 + q * q).sqrt());
        let factor = (p / r * atan(q / r) + q / s * atan(p / s)) / (2.0 * PI);
        close(lux(&surface(ceiling(a, b, c), vec![]), &floor()), PI * factor, 1e-5);
        // At right angles to the receiver, which lies c before the foot of one side, b long, a high.
        let wall = surface(vec![v(c, 0.0, 0.0), v(c, 0.0, b), v(c, a, b), v(c, a, 0.0)], vec![]);
        let factor = (atan(b / c) - c / (a * a + c * c).sqrt() * atan(b / (a * a + c * c).sqrt()))
            / (2.0 * PI);
        close(lux(&wall, &floor()), PI * factor, 1e-5);
    }
}

#[test]
fn a_disc_gives_the_square_of_the_sine() {
    for (radius, height) in [(1.0, 1.0), (5.0, 0.2), (0.1, 3.0)] {
        let at = |i: u32| {
            let t = f64::from(i) / 4000.0 * 2.0 * PI;
            v(
                spandrel_engine::math::cos(t) * radius,
                height,
                spandrel_engine::math::sin(t) * radius,
            )
        };
        let disc = surface((0..4000).map(at).collect(), vec![]);
        let sine = radius * radius / (radius * radius + height * height);
        close(lux(&disc, &floor()), PI * sine, 1e-5);
    }
}

#[test]
fn holes_backs_and_horizons_are_cut_off() {
    let hole = vec![v(0.2, 1.0, 0.2), v(0.8, 1.0, 0.2), v(0.8, 1.0, 0.8), v(0.2, 1.0, 0.8)];
    let whole = lux(&surface(ceiling(1.0, 1.0, 1.0), vec![]), &floor());
    let plug = lux(&surface(hole.clone(), vec![]), &floor());
    for hole in [hole.clone(), hole.into_iter().rev().collect()] {
        let with_hole = surface(ceiling(1.0, 1.0, 1.0), vec![hole]);
        close(lux(&with_hole, &floor()), whole - plug, 1e-5);
    }
    // From behind there is nothing, unless it shines to both sides.
    let above = Receiver { position: v(0.5, 2.0, 0.5), normal: DVec3::NEG_Y };
    let panel = || Polygon { outline: ceiling(1.0, 1.0, 1.0), holes: vec![] };
    assert_eq!(lux(&Surface::new(vec![panel()], false).unwrap(), &above), 0.0);
    let below = Receiver { position: v(0.5, 0.0, 0.5), normal: DVec3::Y };
    let both = Surface::new(vec![panel()], true).unwrap();
    close(lux(&both, &above), lux(&both, &below), 1e-6);
    // A wall that reaches as far below the horizon as above gives what its upper half gives.
    let wall =
        |low: f64| vec![v(1.0, low, -1.0), v(1.0, low, 1.0), v(1.0, 1.0, 1.0), v(1.0, 1.0, -1.0)];
    close(
        lux(&surface(wall(-1.0), vec![]), &floor()),
        lux(&surface(wall(0.0), vec![]), &floor()),
        1e-6,
    );
    // Wholly below there is nothing; nor in the plane of the source.
    assert_eq!(lux(&surface(ceiling(1.0, 1.0, -1.0), vec![]), &floor()), 0.0);
    let beside = Receiver { position: v(-1.0, 1.0, 0.0), normal: DVec3::Y };
    assert_eq!(lux(&surface(ceiling(1.0, 1.0, 1.0), vec![]), &beside), 0.0);
}

#[test]
fn concave_polygons_are_the_sum_of_their_parts() {
    let ell = vec![
        v(0.0, 1.0, 0.0),
        v(2.0, 1.0, 0.0),
        v(2.0, 1.0, 1.0),
        v(1.0, 1.0, 1.0),
        v(1.0, 1.0, 2.0),
        v(0.0, 1.0, 2.0),
    ];
    let parts = [
        ceiling(2.0, 1.0, 1.0),
        vec![v(0.0, 1.0, 1.0), v(1.0, 1.0, 1.0), v(1.0, 1.0, 2.0), v(0.0, 1.0, 2.0)],
    ];
    let mut random = Random::new(7);
    for _ in 0..50 {
        let position =
            v(random.between(-3.0, 3.0), random.between(-2.0, 0.9), random.between(-3.0, 3.0));
        let normal =
            v(random.between(-1.0, 1.0), random.between(-0.2, 1.0), random.between(-1.0, 1.0));
        let at = Receiver { position, normal: normal.normalize() };
        let sum: f64 = parts.iter().map(|part| lux(&surface(part.clone(), vec![]), &at)).sum();
        assert!((lux(&surface(ell.clone(), vec![]), &at) - sum).abs() < 1e-6);
    }
}

#[test]
fn a_tube_gives_the_sum_of_its_elements() {
    let mut random = Random::new(3);
    for _ in 0..100 {
        let mut any =
            || v(random.between(-2.0, 2.0), random.between(-2.0, 2.0), random.between(-2.0, 2.0));
        let line = Line { ends: [any(), any()] };
        let at = Receiver { position: any(), normal: any().normalize() };
        // Simpson's rule over many elements, cut at the horizon by the cosine.
        let [from, to] = line.ends;
        let axis = (to - from).normalize();
        let element = |t: f64| {
            let way = from.lerp(to, t) - at.position;
            let d = way.normalize();
            d.cross(axis).length() * d.dot(at.normal).max(0.0) / way.length_squared()
        };
        let n = 20_000;
        let weight = |i: i32| {
            if i == 0 || i == n {
                1.0
            } else if i % 2 == 1 {
                4.0
            } else {
                2.0
            }
        };
        let sum: f64 = (0..=n).map(|i| weight(i) * element(f64::from(i) / f64::from(n))).sum();
        let expected = sum * (to - from).length() / f64::from(n) / 3.0;
        assert!((lux(&line, &at) - expected).abs() <= 1e-5 * expected.max(1e-3), "{expected}");
    }
    // A receiver on the axis sees the tube end on.
    let line = Line { ends: [v(0.0, 1.0, 0.0), v(0.0, 2.0, 0.0)] };
    assert_eq!(lux(&line, &floor()), 0.0);
}

#[test]
fn skies_give_what_their_formulas_say() {
    let sky = |model, ground| Sky::new(model, v(1.0, 1.0, 0.3), ground).unwrap();
    let facing = |normal: DVec3| Receiver { position: DVec3::ZERO, normal: normal.normalize() };
    let (up, level, down) = (facing(DVec3::Y), facing(DVec3::X), facing(DVec3::NEG_Y));
    let uniform = sky(SkyModel::Uniform, 0.0);
    close(lux(&uniform, &up), 1.0, 1e-6);
    close(lux(&uniform, &level), 0.5, 1e-6);
    assert_eq!(lux(&uniform, &down), 0.0);
    close(lux(&uniform, &facing(v(1.0, 1.0, 0.0))), (1.0 + 0.5f64.sqrt()) / 2.0, 1e-6);
    // Of the overcast sky a wall gets (pi/6 + 4/9) / (7 pi/9) of what the ground gets (Moon and Spencer).
    let overcast = sky(SkyModel::Overcast, 0.0);
    close(lux(&overcast, &up), 1.0, 2e-4);
    close(lux(&overcast, &level), (PI / 6.0 + 4.0 / 9.0) / (7.0 * PI / 9.0), 2e-3);
    // Its zenith is 9 / 7 pi of the illuminance, its horizon a third.
    close(overcast.luminance(DVec3::Y), 9.0 / (7.0 * PI), 1e-4);
    close(overcast.luminance(DVec3::X), 3.0 / (7.0 * PI), 1e-4);
    // The ground sends back its share.
    close(lux(&sky(SkyModel::Overcast, 0.2), &down), 0.2, 1e-3);
    for model in (1..=15).map(SkyModel::General).chain([SkyModel::Clear, SkyModel::Intermediate]) {
        let sky = sky(model, 0.0);
        close(lux(&sky, &up), 1.0, 2e-3);
        assert!(lux(&sky, &facing(v(1.0, 0.3, 0.3))) > 0.0, "{model:?}");
    }
    // Types 5 and 12 are the uniform and the clear one.
    close(lux(&sky(SkyModel::General(5), 0.0), &level), 0.5, 1e-3);
    let (clear, twelve) = (sky(SkyModel::Clear, 0.0), sky(SkyModel::General(12), 0.0));
    assert_eq!(clear.luminance(v(0.6, 0.8, 0.0)), twelve.luminance(v(0.6, 0.8, 0.0)));
    // A blend is between, by its share.
    let half = sky(SkyModel::Blend(0.5), 0.0);
    let at = v(0.48, 0.6, 0.64);
    close(half.luminance(at), (clear.luminance(at) + overcast.luminance(at)) / 2.0, 2e-3);
    for (model, ground) in [
        (SkyModel::General(0), 0.0),
        (SkyModel::General(16), 0.0),
        (SkyModel::Blend(1.5), 0.0),
        (SkyModel::Blend(f64::NAN), 0.0),
        (SkyModel::Clear, -0.1),
        (SkyModel::Clear, 1.1),
    ] {
        assert!(Sky::new(model, DVec3::Y, ground).is_err(), "{model:?} {ground}");
    }
    assert!(Sky::new(SkyModel::Clear, DVec3::NEG_Y, 0.0).is_err());
    assert!(Sky::new(SkyModel::Clear, DVec3::ZERO, 0.0).is_err());
}

#[test]
fn samples_of_a_source_are_its_closed_form_on_the_mean() {
    let panel = ceiling(1.5, 0.7, 1.2);
    let body = PolyhedralLight::default().lamp("", Path::new("")).unwrap();
    let sources: Vec<Box<dyn Light>> = vec![
        Box::new(Line { ends: [v(-1.0, 1.0, 0.5), v(0.5, 1.5, 0.2)] }),
        Box::new(surface(panel, vec![vec![v(0.5, 1.2, 0.2), v(0.9, 1.2, 0.2), v(0.7, 1.2, 0.5)]])),
        Box::new(Sky::new(SkyModel::Clear, v(1.0, 1.0, 0.3), 0.2).unwrap()),
        Box::new(Sky::new(SkyModel::Uniform, v(1.0, 1.0, 0.3), 0.0).unwrap()),
    ];
    let body: &dyn Light = &*body.light;
    let away = Receiver { position: v(0.0, -2.0, 1.0), normal: v(0.1, 1.0, -0.3).normalize() };
    let floor = floor();
    let each = sources.iter().map(|source| (&**source, &floor)).chain([(body, &away)]);
    for (source, at) in each {
        let (n, m) = (8192, 16);
        let place = |i: i32, n: i32| (f64::from(i) + 0.5) / f64::from(n);
        let choices =
            (0..n).flat_map(|i| (0..m).map(move |j| DVec2::new(place(i, n), place(j, m))));
        let sum: f64 =
            choices.map(|choice| f64::from(source.sample(at, choice).irradiance.r)).sum();
        close(sum / f64::from(n * m), lux(source, at), 2e-3);
    }
}

#[test]
fn points_spots_and_flux_keep_their_units() {
    let none = Path::new("");
    let point =
        PointLight { position: v(0.0, 3.0, 0.0), intensity: Some(90.0), ..PointLight::default() };
    let lamp = point.lamp("", none).unwrap();
    close(lux(&*lamp.light, &floor()) * f64::from(lamp.strength.r), 10.0, 1e-6);
    let flux = PointLight { intensity: None, flux: Some(4.0 * PI * 90.0), ..point };
    close(f64::from(flux.lamp("", none).unwrap().strength.r), 90.0, 1e-6);
    let spot = SpotLight {
        position: v(0.0, 2.0, 0.0),
        angle: 60.0,
        inner_angle: Some(20.0),
        intensity: 8.0,
        ..SpotLight::default()
    };
    let lamp = spot.lamp("", none).unwrap();
    let under = |x: f64| Receiver { position: v(x, 0.0, 0.0), normal: DVec3::Y };
    close(lux(&*lamp.light, &under(0.0)) * f64::from(lamp.strength.r), 2.0, 1e-6);
    // Half way between the cones it is half of what a point would give.
    let x = 2.0 * spandrel_engine::math::tan(40f64.to_radians());
    let cosine = spandrel_engine::math::cos(40f64.to_radians());
    close(lux(&*lamp.light, &under(x)), 0.5 * cosine * cosine * cosine / 4.0, 1e-6);
    assert_eq!(lux(&*lamp.light, &under(4.0)), 0.0);
    // A tube of 1 m across is seen from afar as its candela.
    let tube = LinearLight {
        from: v(-0.5, 100.0, 0.0),
        to: v(0.5, 100.0, 0.0),
        flux: Some(PI * PI * 70.0),
        ..LinearLight::default()
    };
    let lamp = tube.lamp("", none).unwrap();
    close(lux(&*lamp.light, &floor()) * f64::from(lamp.strength.r), 70.0 / 1e4, 1e-4);
    let sun = SunLight { time: "2026-06-21T23:59+09:00".into(), ..SunLight::default() };
    assert!(!sun.lamp("", none).unwrap().shines(), "at night");
}

#[test]
fn lights_refuse_what_no_light_has() {
    let none = Path::new("");
    let bad_numbers = [f64::NAN, f64::INFINITY, -1.0];
    for bad in bad_numbers {
        let faults = [
            (
                ParallelLight { illuminance: bad, ..Default::default() }.lamp("", none),
                "illuminance",
            ),
            (PointLight { intensity: Some(bad), ..Default::default() }.lamp("", none), "intensity"),
            (PointLight { flux: Some(bad), ..Default::default() }.lamp("", none), "flux"),
            (SpotLight { intensity: bad, ..Default::default() }.lamp("", none), "intensity"),
            (
                LinearLight { intensity: Some(bad), ..Default::default() }.lamp("", none),
                "intensity",
            ),
            (AreaLight { luminance: bad, ..Default::default() }.lamp("", none), "luminance"),
            (PolyhedralLight { luminance: bad, ..Default::default() }.lamp("", none), "luminance"),
            (SkyLight { illuminance: bad, ..Default::default() }.lamp("", none), "illuminance"),
            (AmbientLight { illuminance: bad, ..Default::default() }.lamp("", none), "illuminance"),
            (
                SunLight { illuminance: Some(bad), ..Default::default() }.lamp("", none),
                "illuminance",
            ),
            (
                ParallelLight { temperature: Some(bad), ..Default::default() }.lamp("", none),
                "temperature",
            ),
            (
                ParallelLight { color: Color::new(0.0, bad as f32, 0.0), ..Default::default() }
                    .lamp("", none),
                "color",
            ),
        ];
        for (made, field) in faults {
            assert_eq!(made.unwrap_err().field, field, "{bad}");
        }
    }
    let line = vec![v(0.0, 0.0, 0.0), v(1.0, 0.0, 0.0), v(2.0, 0.0, 0.0)];
    let faults = [
        (AreaLight { outline: line, ..Default::default() }.lamp("", none), "outline"),
        (AreaLight { outline: vec![], ..Default::default() }.lamp("", none), "outline"),
        (
            AreaLight { outline: vec![DVec3::NAN; 3], ..Default::default() }.lamp("", none),
            "outline",
        ),
        (
            AreaLight {
                outline: vec![DVec3::ZERO, DVec3::X, v(1.0, 1.0, 1.0), DVec3::Y],
                ..Default::default()
            }
            .lamp("", none),
            "outline",
        ),
        (LinearLight { to: v(-0.5, 0.0, 0.0), ..Default::default() }.lamp("", none), "to"),
        (
            PolyhedralLight { faces: vec![vec![0, 1, 9]], ..Default::default() }.lamp("", none),
            "faces",
        ),
        (PolyhedralLight { faces: vec![], ..Default::default() }.lamp("", none), "faces"),
        (
            SpotLight { angle: 10.0, inner_angle: Some(20.0), ..Default::default() }.lamp("", none),
            "inner_angle",
        ),
        (SunLight { time: "noon".into(), ..Default::default() }.lamp("", none), "time"),
        (SunLight { latitude: 95.0, ..Default::default() }.lamp("", none), "latitude"),
        (
            PointLight { intensity: Some(1.0), flux: Some(1.0), ..Default::default() }
                .lamp("", none),
            "flux",
        ),
    ];
    for (made, field) in faults {
        assert_eq!(made.unwrap_err().field, field);
    }
}

#[test]
fn no_receiver_makes_light_that_is_not_finite() {
    let none = Path::new("");
    let entries = [
        LightEntry::PointLight(PointLight::default()),
        LightEntry::SpotLight(SpotLight::default()),
        LightEntry::LinearLight(LinearLight::default()),
        LightEntry::AreaLight(AreaLight::default()),
        LightEntry::PolyhedralLight(PolyhedralLight::default()),
        LightEntry::SkyLight(SkyLight::default()),
    ];
    // In the source, on its edge, on its corner, in its plane, far away.
    let places = [
        DVec3::ZERO,
        v(0.5, 0.0, 0.0),
        v(0.5, 0.0, 0.5),
        v(9.0, 0.0, 0.0),
        v(1e-300, 0.0, 0.0),
        v(1e20, 1e20, 0.0),
        v(0.5, -0.5, 0.5),
    ];
    for entry in entries {
        let lamp = entry.lamp("", none).unwrap();
        for position in places {
            for normal in [DVec3::Y, DVec3::NEG_Y, DVec3::X] {
                let at = Receiver { position, normal };
                assert!(lamp.light.irradiance(&at).is_finite(), "{entry:?} {position}");
                for choice in [DVec2::ZERO, DVec2::splat(0.5), DVec2::new(0.999_999_999, 0.0)] {
                    let sample = lamp.light.sample(&at, choice);
                    assert!(sample.irradiance.is_finite(), "{entry:?} {position}");
                }
            }
        }
    }
}

#[test]
fn lights_are_seen_as_bright_as_they_are() {
    // A panel of 40 cd/m2 that fills the picture shows pi times that under the exposure of 100 lux; from
    // behind it is black. A tube's luminance is its candela per metre over its diameter.
    let none = Path::new("");
    let outline = vec![v(-9.0, -9.0, 0.0), v(9.0, -9.0, 0.0), v(9.0, 9.0, 0.0), v(-9.0, 9.0, 0.0)];
    let panel = AreaLight { outline, luminance: 40.0, ..AreaLight::default() };
    let tube = LinearLight {
        from: v(-9.0, 0.0, 0.0),
        to: v(9.0, 0.0, 0.0),
        intensity: Some(30.0),
        ..LinearLight::default()
    };
    let shown = |light: &dyn MakeLamp, z: f64| {
        let scene = Scene::of_lamps("lights", &[light.lamp("it", none).unwrap()], 0.25).unwrap();
        let camera = Camera { position: v(0.0, 0.0, z), field_of_view: 2.0, ..Camera::default() };
        let view = View::new(&camera, Raster::new(3, 3).unwrap()).unwrap();
        let rule = Rule::Sloped(2);
        let image = render(&[Arc::new(scene).into()], &view, rule.plan().unwrap(), 0..3).unwrap();
        let shader = illuminate(Vec::new(), Color::BLACK, Color::BLACK);
        let image = image.shaded(Arc::new(Illuminate { white: 100.0, ..shader })).unwrap();
        let channels = BTreeSet::from([Channel::Color]);
        let picture = resolve(&image, rule, &Framing::whole(view.raster()), &channels).unwrap();
        f64::from(picture.float("R").unwrap()[4])
    };
    close(shown(&panel, 2.0), 40.0 * PI / 100.0, 1e-5);
    assert_eq!(shown(&panel, -2.0), 0.0);
    close(shown(&tube, 2.0), 60.0 * PI / 100.0, 1e-5);
    let off = AreaLight { on: false, ..panel };
    assert_eq!(shown(&off, 2.0), 0.0);
    let point = PointLight::default().lamp("point", none).unwrap();
    assert!(Scene::of_lamps("lights", &[point], 0.1).is_err());
}

#[test]
fn a_sky_that_names_no_model_is_as_overcast_as_its_scene() {
    let listed = |light: SkyLight, overcast: Option<f64>| {
        let environment =
            overcast.map(|overcast| Environment { overcast, ..Environment::default() });
        let lights = BTreeMap::from([("sky".to_owned(), LightEntry::SkyLight(light))]);
        let root = Object::new("none", Shape::Faces(Mesh::default()));
        let plan = Plan { lights, environment, root, ..Plan::default() };
        let document = Document::with_plan(plan);
        let scene = Scene::new(&document, None, "", Key::of(&document), Path::new(""))?;
        let lamp = scene.lights["sky"].lamp("sky", Path::new("")).unwrap();
        Ok::<_, Error>(lamp.light.luminance(v(0.3, 0.4, 0.5).normalize()).unwrap())
    };
    let of = |model| SkyLight { model: Some(model), ..SkyLight::default() };
    let named = |model| listed(of(model), Some(0.3)).unwrap();
    let open = |overcast| listed(SkyLight::default(), overcast).unwrap();
    assert_eq!(open(Some(0.3)), named(SkyModel::Blend(0.3)));
    assert_eq!(open(Some(0.0)), named(SkyModel::Blend(0.0)));
    assert_ne!(open(Some(0.3)), open(Some(0.0)));
    assert_eq!(open(None), named(SkyModel::Overcast));
    let error = listed(SkyLight::default(), Some(1.5)).unwrap_err().to_string();
    assert!(error.contains("sky") && error.contains("not 1.5"), "{error}");
}
