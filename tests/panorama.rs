//! Light from pictures of everything around: painted skies against the skies themselves, and real ones.

use glam::{DVec2, DVec3, dvec3 as v};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::error::Error;
use spandrel_engine::image::{Channel, Image, Samples, Window, file};
use spandrel_engine::key::Key;
use spandrel_engine::light::list::{LampFile, MakeLamp, SkyLight};
use spandrel_engine::light::panorama::Panorama;
use spandrel_engine::light::point::Disc;
use spandrel_engine::light::seen::SeenSky;
use spandrel_engine::light::sky::{Sky, SkyModel};
use spandrel_engine::light::{Lamp, Light, Receiver};
use spandrel_engine::math;
use spandrel_engine::raster::Raster;
use spandrel_engine::render::background::{self, BackgroundOptions, Show};
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::shade::Stream;
use spandrel_engine::span::SpanImage;
use spandrel_tests::data;
use spandrel_tests::lights::close;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

const PI: f64 = std::f64::consts::PI;

/// A picture of what is seen in each direction.
fn painted(rows: u32, color: impl Fn(DVec3) -> Color) -> Image {
    let mut picture = Image::new((2 * rows, rows), Window::whole(2 * rows, rows));
    let mut channels: [Vec<f32>; 3] = Default::default();
    for at in 0..2 * rows * rows {
        let (x, y) = (f64::from(at % (2 * rows)) + 0.5, f64::from(at / (2 * rows)) + 0.5);
        let (round, down) = ((x / f64::from(2 * rows) - 0.5) * 2.0 * PI, y / f64::from(rows) * PI);
        let (sin, cos) = (math::sin, math::cos);
        let toward = v(sin(round) * sin(down), cos(down), -cos(round) * sin(down));
        let color = color(toward).to_array();
        channels.iter_mut().zip(color).for_each(|(channel, value)| channel.push(value));
    }
    for (name, values) in ["R", "G", "B"].into_iter().zip(channels) {
        picture.insert(name, Samples::Float(values)).unwrap();
    }
    picture
}

fn scratch(name: &str) -> std::path::PathBuf {
    let folder = std::env::temp_dir().join(format!("spandrel_panorama_{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder.join(name)
}

fn lux(light: &dyn Light, normal: DVec3) -> [f64; 3] {
    let at = Receiver { position: DVec3::ZERO, normal: normal.normalize() };
    light.irradiance(&at).to_array().map(f64::from)
}

#[test]
fn a_painted_sky_gives_what_the_sky_gives() {
    let sun = v(0.5, 0.6, -0.4).normalize();
    let models = [SkyModel::Uniform, SkyModel::Overcast, SkyModel::Clear];
    for (at, model) in models.into_iter().enumerate() {
        let sky = Sky::new(model, sun, 0.3).unwrap();
        let path = scratch(&format!("{at}.exr"));
        let tint = Color::new(1.5, 1.0, 0.5);
        let picture = painted(256, |d| tint * (40.0 * sky.luminance(d)) as f32);
        file::write(&picture, &path, Some(32)).unwrap();
        let panorama = Panorama::read(&path, 0.0).unwrap();
        let normals = [
            v(0.0, 1.0, 0.0),
            v(1.0, 0.0, 0.0),
            v(0.0, 0.0, -1.0),
            v(-0.3, -1.0, 0.2),
            v(0.7, 0.4, -0.5),
        ];
        for normal in normals {
            let [expected, ..] = lux(&sky, normal);
            let [r, g, b] = lux(&panorama, normal);
            close(g, expected, 0.006);
            close(r, 1.5 * expected, 0.006);
            close(b, 0.5 * expected, 0.006);
            // Samples give the same on the mean.
            let receiver = Receiver { position: DVec3::ZERO, normal: normal.normalize() };
            let mut sum = 0.0;
            for i in 0..128 {
                for j in 0..128 {
                    let choice = DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5) / 128.0;
                    sum += f64::from(panorama.sample(&receiver, choice).irradiance.g);
                }
            }
            close(sum / 16384.0, expected, 0.01);
        }
        for toward in [sun, v(0.1, 0.2, 0.9).normalize(), v(-0.6, -0.4, 0.1).normalize()] {
            let seen = f64::from(Light::luminance(&panorama, toward).unwrap().g);
            close(seen, sky.luminance(toward), 0.02);
        }
        // Turned by a right angle, north is east.
        let turned = Panorama::read(&path, PI / 2.0).unwrap();
        let east = |d: DVec3| v(-d.z, d.y, d.x);
        close(
            lux(&turned, east(v(0.3, 0.2, -0.8)))[1],
            lux(&panorama, v(0.3, 0.2, -0.8))[1],
            0.006,
        );
        // What is saved comes back.
        let light: Box<dyn Light> = Box::new(turned);
        let text = serde_json::to_string(&light).unwrap();
        let back: Box<dyn Light> = serde_json::from_str(&text).unwrap();
        assert_eq!(lux(&*back, v(0.2, 0.7, 0.1)), lux(&*light, v(0.2, 0.7, 0.1)));
        std::fs::remove_file(&path).unwrap();
    }
}

#[test]
fn the_disc_of_the_sun_is_as_bright_as_its_light() {
    let toward = v(0.1, 0.4, -0.9).normalize();
    let radius = 0.533f64.to_radians() / 2.0;
    let night = Lamp::new(
        "",
        true,
        Color::BLACK,
        Arc::new(Sky::new(SkyModel::Uniform, DVec3::Y, 0.0).unwrap()),
    );
    let lux = 1000.0;
    let sun = Lamp::new("", true, Color::grey(lux as f32), Arc::new(Disc { toward, radius }));
    let seen = SeenSky { sky: night, suns: vec![sun], white: 50.0 };
    // Of a thousand lux over a disc, every point has this luminance; a white surface under 50 lux shows 1.
    let sine = math::sin(radius);
    let bright = lux / (PI * sine * sine) * PI / 50.0;
    for (degrees, pixels) in [(5.0, 200), (5.0, 40), (40.0, 41)] {
        let camera = Camera {
            position: v(3.0, 1.0, 2.0),
            look_at: v(3.0, 1.0, 2.0) + toward,
            field_of_view: degrees,
            ..Camera::default()
        };
        let view = View::new(&camera, Raster::new(pixels, pixels).unwrap()).unwrap();
        let (label, key) = ("sky".to_owned(), Key::of(&0));
        let stand = BackgroundOptions { label, key, strength: Color::WHITE, distance: None };
        let rule = Rule::Sloped(2);
        let show = Show::Sky(seen.clone());
        let image = background::image(show, stand, &view, rule.plan().unwrap(), 0..pixels).unwrap();
        let framing = Framing::scaled(view.raster(), DVec2::ONE).unwrap();
        let picture = resolve(&image, rule, &framing, &BTreeSet::from([Channel::Color])).unwrap();
        let picture = picture.float("R").unwrap().to_vec();
        let most = picture.iter().copied().fold(0.0, f32::max);
        assert!(f64::from(most) <= bright * 1.0001, "{most} {bright}");
        if pixels == 200 {
            close(f64::from(most), bright, 1e-4);
        }
        // All pixels together, each by its solid angle, are the light.
        let half = math::tan((degrees / 2.0f64).to_radians());
        let step = 2.0 * half / f64::from(pixels);
        let mut sum = 0.0;
        for (at, value) in (0..).zip(&picture) {
            let place = |k: u32| (f64::from(k) + 0.5) * step - half;
            let (x, y) = (place(at % pixels), place(at / pixels));
            let cosine = 1.0 / (1.0 + x * x + y * y).sqrt();
            sum += f64::from(*value) * 50.0 / PI * step * step * cosine.powi(3) * cosine;
        }
        close(sum, lux, 0.01);
    }
}

#[test]
fn what_stands_behind_lights_as_it_is_seen() {
    // A sky behind a scene, taken in all directions, gives what the sky gives; and a program that dims its east
    // takes the light of the east.
    let sun = v(0.5, 0.6, -0.4).normalize();
    let sky = Sky::new(SkyModel::Clear, sun, 0.3).unwrap();
    let lamp = Lamp::new("", true, Color::grey(500.0), Arc::new(sky.clone()));
    let camera = Camera { position: v(3.0, 1.0, 2.0), ..Camera::default() };
    let view = View::new(&camera, Raster::new(2, 1).unwrap()).unwrap();
    let key = Key::of(&0);
    let stand =
        BackgroundOptions { label: "sky".to_owned(), key, strength: Color::WHITE, distance: None };
    let plan = Rule::Sloped(1).plan().unwrap();
    let show = Show::Sky(SeenSky { sky: lamp, suns: vec![], white: 800.0 });
    let image = background::image(show, stand, &view, plan, 0..1).unwrap();
    let lux_of = |image: &SpanImage, normal: DVec3| {
        let (light, open) = Panorama::of(&background::panorama(image, 256).unwrap(), 0.0).unwrap();
        lux(&light, normal)[1] * open * 800.0 / PI
    };
    for normal in [v(0.0, 1.0, 0.0), v(1.0, 0.0, 0.0), v(0.0, 0.0, -1.0), v(-0.3, -1.0, 0.2)] {
        close(lux_of(&image, normal), 500.0 * lux(&sky, normal)[1], 0.006);
    }
    let code = "if (-I.x > 0) { color = color * 0.25; }";
    let dimmed = Stream::new(code, BTreeMap::new(), BTreeMap::new()).unwrap();
    let dimmed = image.shaded(Arc::new(dimmed)).unwrap();
    let (east, west) = (v(1.0, 0.0, 0.0), v(-1.0, 0.0, 0.0));
    close(lux_of(&dimmed, east), 0.25 * 500.0 * lux(&sky, east)[1], 0.006);
    close(lux_of(&dimmed, west), 500.0 * lux(&sky, west)[1], 0.006);
    // A program knows its place in the panorama.
    let places = Stream::new("color = [x, y, 0];", BTreeMap::new(), BTreeMap::new()).unwrap();
    let places = background::panorama(&image.shaded(Arc::new(places)).unwrap(), 16).unwrap();
    let [red, green, ..] = places.rgba(31, 15);
    close(f64::from(red), 31.5 / 32.0, 1e-5);
    close(f64::from(green), 15.5 / 16.0, 1e-5);
    // Of several what is in front is seen, as in a picture: half a veil before the sky, and of two at one distance the
    // same as there.
    let flat = |label: &str, level: f32, distance: Option<f64>| {
        let stand = BackgroundOptions {
            label: label.to_owned(),
            key: Key::of(&(label, level.to_bits())),
            strength: Color::grey(level),
            distance,
        };
        let show = Show::Gradient(vec![(0.0, Color::WHITE)]);
        background::image(show, stand, &view, plan, 0..1).unwrap()
    };
    let veil = Stream::new("alpha = 0.5;", BTreeMap::new(), BTreeMap::new()).unwrap();
    let veil = flat("a veil", 1.0, Some(1e8)).shaded(Arc::new(veil)).unwrap();
    for order in [[veil.clone(), flat("sky", 0.2, None)], [flat("sky", 0.2, None), veil]] {
        let [seen, ..] =
            background::panorama(&SpanImage::merge(&order).unwrap(), 8).unwrap().rgba(3, 3);
        close(f64::from(seen), 0.5 + 0.5 * 0.2, 1e-6);
    }
    let framing = Framing::whole(view.raster());
    for (a, b) in [(0.25, 0.5), (0.5, 0.25), (0.75, 0.3), (0.1, 0.9)] {
        let both = SpanImage::merge(&[flat("b", a, None), flat("b", b, None)]).unwrap();
        let picture = resolve(&both, Rule::Sloped(1), &framing, &BTreeSet::from([Channel::Color]));
        let (shown, round) = (picture.unwrap().rgba(0, 0), background::panorama(&both, 8).unwrap());
        assert_eq!(shown[0], round.rgba(3, 3)[0], "{a} {b}");
    }
    // Without anything behind it there is none.
    let empty = SpanImage::empty(view.clone(), plan, 0..1);
    let error = background::panorama(&empty, 16).unwrap_err();
    assert!(error.to_string().contains("Background"), "{error}");
}

#[test]
fn pictures_that_are_no_panorama_are_refused() {
    let sky = |file: &Path| SkyLight {
        picture: Some(LampFile(file.to_string_lossy().into_owned())),
        ..SkyLight::default()
    };
    let error = |name: &str, picture: Option<Image>| {
        let path = scratch(name);
        picture.iter().for_each(|picture| {
            file::write(picture, &path, Some(32)).unwrap();
        });
        let error = Error::from(sky(&path).lamp("", Path::new("")).unwrap_err());
        assert_eq!(error.path(), Some(&*path), "{error}");
        error.to_string()
    };
    assert!(matches!(error("missing.exr", None), text if text.contains("missing.exr")));
    let black = painted(8, |d| Color::grey(if d.y > 0.0 { 0.0 } else { 1.0 }));
    assert!(error("black.exr", Some(black)).contains("upper half"));
    let wrong = painted(8, |d| Color::grey(if d.y > 0.9 { f32::NAN } else { 1.0 }));
    assert!(error("wrong.exr", Some(wrong)).contains("pixel 0, 0"));
    let mut narrow = Image::new((3, 2), Window::whole(3, 2));
    narrow.insert("R", Samples::Float(vec![1.0; 6])).unwrap();
    assert!(error("narrow.exr", Some(narrow)).contains("twice as wide as high"));
    let low = painted(4, |_| Color::WHITE);
    assert!(error("low.exr", Some(low)).contains("4 rows"));
    let mut grey = Image::new((16, 8), Window::whole(16, 8));
    grey.insert("Z", Samples::Float(vec![1.0; 128])).unwrap();
    assert!(error("depth.exr", Some(grey)).contains("channel"));
    // One pixel as bright as numbers go, beside a sky as dark as numbers go.
    let wild = painted(8, |d| Color::grey(if d.y < -0.9 { 3e38 } else { 1e-42 }));
    assert!(error("wild.exr", Some(wild)).contains("too bright"));
    let text = scratch("text.hdr");
    std::fs::write(&text, "no picture").unwrap();
    let fault = Error::from(sky(&text).lamp("", Path::new("")).unwrap_err()).to_string();
    assert!(fault.contains("does not begin as a Radiance"), "{fault}");
    // Checked without its file, a light of a graph is sound.
    assert!(sky(&scratch("missing.exr")).check().is_ok());
}

#[test]
fn real_panoramas_give_an_open_plane_the_lux_that_is_asked() {
    let Some(folder) = data::find("hdri") else { return };
    let mut read = 0;
    for path in data::files(&folder, &[".hdr", ".exr"]) {
        let panorama = match Panorama::read(&path, 0.4) {
            Ok(panorama) => panorama,
            Err(error) => {
                assert!(error.to_string().contains("twice as wide"), "{error}");
                continue;
            }
        };
        read += 1;
        let [r, g, b] = lux(&panorama, DVec3::Y);
        close((r + g + b) / 3.0, 1.0, 0.02);
        // Summed by looking everywhere.
        let mut sum = 0.0;
        for i in 0..200_000u32 {
            let up = (f64::from(i) + 0.5) / 200_000.0;
            let round = f64::from(i) * 2.399_963_229_728_653;
            let across = (1.0 - up * up).sqrt();
            let (sin, cos) = (math::sin(round), math::cos(round));
            let seen = Light::luminance(&panorama, v(cos * across, up, sin * across)).unwrap();
            sum += f64::from(seen.r + seen.g + seen.b) / 3.0 * up * 2.0 * PI / 200_000.0;
        }
        close(sum, 1.0, 0.05);
    }
    assert!(read > 0);
}

#[test]
fn a_panorama_of_few_rows_gives_what_one_of_many_gives() {
    for (rows, brightness) in [(8, 1.0), (9, 1e-30), (16, 1e30), (64, 1.0)] {
        let path = scratch(&format!("white{rows}.exr"));
        file::write(&painted(rows, |_| Color::grey(brightness)), &path, Some(32)).unwrap();
        let panorama = Panorama::read(&path, 0.0).unwrap();
        let seen = panorama.luminance(DVec3::Y).unwrap();
        assert!((f64::from(seen.r) * std::f64::consts::PI - 1.0).abs() < 1e-5, "{rows}: {seen:?}");
    }
}
