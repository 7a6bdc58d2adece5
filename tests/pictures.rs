//! Pictures before and after a scene: backdrops at every edge, operators by their laws, mattes against known
//! alphas.

#![allow(clippy::disallowed_methods, reason = "what is expected may be computed by anybody's sine")]

use glam::{DVec2, DVec3, dvec3 as v};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::{Color, encode_srgb};
use spandrel_engine::fragment::{Finish, Optics};
use spandrel_engine::image::{Channel, Image, Samples, Window, file};
use spandrel_engine::key::Key;
use spandrel_engine::picture::{self, Dither, Grade, Matte, Operator, Palette, Reformat, Segments};
use spandrel_engine::raster::Raster;
use spandrel_engine::render::background::{self, BackgroundOptions, Photograph, PictureFit, Show};
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::scene::Material;
use spandrel_engine::shade::Trace;
use spandrel_engine::span::SpanImage;
use spandrel_engine::texture::TextureFilter;
use spandrel_engine::trace::Accelerator;
use spandrel_tests::data;
use spandrel_tests::random::Random;
use spandrel_tests::scenes::{front_view, painted_faces, random_faces, scene};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

fn made(width: u32, height: u32, mut pixel: impl FnMut(u32, u32) -> [f32; 4]) -> Image {
    let mut image = Image::new((width, height), Window::whole(width, height));
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let pixels: Vec<[f32; 4]> = places.map(|(x, y)| pixel(x, y)).collect();
    for (k, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
        let channel = pixels.iter().map(|pixel| pixel[k]).collect();
        image.insert(name, Samples::Float(channel)).unwrap();
    }
    image
}

fn noisy(size: u32, seed: u64) -> Image {
    let mut random = Random::new(seed);
    made(size, size, |_, _| {
        let mut number = || random.between(0.0, 1.0) as f32;
        let a = number();
        [number() * a, number() * a, number() * a, a]
    })
}

fn difference(a: &Image, b: &Image) -> f32 {
    assert_eq!((a.size, a.window), (b.size, b.window));
    let off = |(a, b): ([f32; 4], [f32; 4])| {
        a.into_iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    a.pixels().zip(b.pixels()).map(off).fold(0.0, f32::max)
}

fn background(view: &View, rule: Rule, show: Show, distance: Option<f64>) -> SpanImage {
    let stand = BackgroundOptions {
        label: "background".to_owned(),
        key: Key::of(&format!("{show:?} {distance:?}")),
        strength: Color::WHITE,
        distance,
    };
    let rows = 0..view.raster().height;
    background::image(show, stand, view, rule.plan().unwrap(), rows).unwrap()
}

fn spans(of: &Arc<spandrel_engine::scene::Scene>, view: &View, rule: Rule) -> SpanImage {
    let rows = 0..view.raster().height;
    scanline::render(&[of.clone().into()], view, rule.plan().unwrap(), rows).unwrap()
}

fn shown(image: &SpanImage, rule: Rule) -> Image {
    let framing = Framing::scaled(image.view().raster(), DVec2::ONE).unwrap();
    resolve(image, rule, &framing, &BTreeSet::from([Channel::Color])).unwrap()
}

#[test]
fn a_backdrop_is_seen_by_exactly_what_nothing_covers() {
    let view = front_view(40, 30);
    let of = scene("faces", random_faces(7, 12));
    let bright = Color::new(0.9, 0.4, 0.1);
    let parallel = Camera { parallel_height: Some(9.0), ..view.camera().clone() };
    let parallel = View::new(&parallel, view.raster()).unwrap();
    for view in [&view, &parallel] {
        for rule in [Rule::Sloped(4), Rule::Adaptive(4, 0.02), Rule::Exact] {
            let front = spans(&of, view, rule);
            let alone = shown(&front, rule);
            let behind = background(view, rule, Show::Gradient(vec![(0.0, bright)]), None);
            let both = shown(&SpanImage::merge(&[front.clone(), behind.clone()]).unwrap(), rule);
            let plate = made(40, 30, |_, _| [bright.r, bright.g, bright.b, 1.0]);
            let expected = picture::composite(&alone, &plate, Operator::Over).unwrap();
            let off = difference(&both, &expected);
            assert!(off < 2e-5, "{rule:?}: {off}");
            let covered = alone.float("A").unwrap().iter().sum::<f32>() / 1200.0;
            assert!(covered > 0.1 && covered < 0.95, "{covered}");
            // Nearer than everything it hides all.
            let near = Show::Gradient(vec![(0.0, bright)]);
            let near = background(view, rule, near, Some(1e-3));
            let hidden = shown(&SpanImage::merge(&[front, near]).unwrap(), rule);
            assert!(difference(&hidden, &plate) < 1e-6);
        }
    }
}

#[test]
fn panoramas_and_gradients_lie_by_direction_and_rays_see_them() {
    // What is seen in a direction is the direction itself.
    let color = |d: DVec3| [d.x, d.y, d.z].map(|v| (0.5 + 0.5 * v) as f32);
    let rows = 256u32;
    let panorama = made(2 * rows, rows, |x, y| {
        let round = ((f64::from(x) + 0.5) / f64::from(2 * rows) - 0.5) * std::f64::consts::TAU;
        let up = std::f64::consts::FRAC_PI_2
            - (f64::from(y) + 0.5) / f64::from(rows) * std::f64::consts::PI;
        let d = v(up.cos() * round.sin(), up.sin(), -up.cos() * round.cos());
        let [r, g, b] = color(d);
        [r, g, b, 1.0]
    });
    let panorama = Arc::new(panorama);
    let rule = Rule::Sloped(4);
    for look_at in [v(0.0, 0.3, -1.0), v(1.0, 0.0, 0.2), v(-0.3, 0.9, 0.8)] {
        let camera =
            Camera { position: DVec3::ZERO, look_at, field_of_view: 60.0, ..Camera::default() };
        let view = View::new(&camera, Raster::new(32, 24).unwrap()).unwrap();
        let photograph = Photograph::new(&panorama, PictureFit::Direction, 0.0).unwrap();
        let picture = shown(&background(&view, rule, Show::Picture(photograph), None), rule);
        let gradient = Show::Gradient(vec![(-90.0, Color::BLACK), (90.0, Color::WHITE)]);
        let heights = shown(&background(&view, rule, gradient, None), rule);
        for (x, y) in [(0u32, 0u32), (31, 0), (16, 12), (5, 20), (31, 23)] {
            let seen = view.eye_point(f64::from(x) + 0.5, f64::from(y) + 0.5, 1.0);
            let direction = view.world_direction(seen).normalize();
            let expected = color(direction);
            let got = picture.rgba(x, y);
            let off = expected.iter().zip(got).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(off < 0.01, "{look_at} {x} {y}: {off}");
            let height = (direction.y.asin().to_degrees() / 180.0 + 0.5) as f32;
            assert!((heights.rgba(x, y)[0] - height).abs() < 1e-3);
        }
    }
    // A mirror on the ground shows what is above.
    let camera = Camera { position: v(0.0, 2.0, 3.0), look_at: DVec3::ZERO, ..Camera::default() };
    let view = View::new(&camera, Raster::new(32, 24).unwrap()).unwrap();
    let ground = [v(-9.0, 0.0, 9.0), v(9.0, 0.0, 9.0), v(9.0, 0.0, -9.0), v(-9.0, 0.0, -9.0)];
    let optics = Optics { reflect: Color::WHITE, fresnel: false, ..Optics::default() };
    let finish = Finish { optics: Some(optics), ..Finish::default() };
    let mirror = Material { color: Color::BLACK, finish, ..Material::default() };
    let image = spans(&painted_faces(&[(ground, mirror)]).unwrap(), &view, rule);
    let photograph = Photograph::new(&panorama, PictureFit::Direction, 0.0).unwrap();
    let behind = background(&view, rule, Show::Picture(photograph), None);
    let all = SpanImage::merge(&[image, behind]).unwrap();
    let shader = Trace {
        rays: 1,
        depth: 2,
        least: 1e-6,
        background: Color::BLACK,
        sky: None,
        accelerator: Accelerator::Tree,
    };
    let picture = shown(&all.shaded(Arc::new(shader)).unwrap(), rule);
    let direction = view.world_direction(view.eye_point(16.5, 12.5, 1.0)).normalize();
    let expected = color(direction * v(1.0, -1.0, 1.0));
    let got = picture.rgba(16, 12);
    let off = expected.iter().zip(got).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(off < 0.02, "{got:?} {expected:?}");
}

#[test]
fn plates_fill_fit_or_stretch_and_stand_at_their_distance() {
    let view = front_view(60, 30);
    let rule = Rule::Sloped(4);
    let square = Arc::new(made(8, 8, |x, y| [x as f32 / 8.0, y as f32 / 8.0, 0.0, 1.0]));
    let lies = |by: PictureFit| {
        let photograph = Photograph::new(&square, by, 0.0).unwrap();
        shown(&background(&view, rule, Show::Picture(photograph), None), rule)
    };
    let (fill, whole, stretch) =
        (lies(PictureFit::Fill), lies(PictureFit::Whole), lies(PictureFit::Stretch));
    assert!((fill.rgba(30, 0)[1] - 0.22).abs() < 0.05, "{:?}", fill.rgba(30, 0));
    assert!((stretch.rgba(30, 0)[1] - 0.0).abs() < 0.05, "{:?}", stretch.rgba(30, 0));
    assert!(whole.rgba(2, 15)[3] == 0.0 && whole.rgba(30, 15)[3] > 0.999);
    // A foreground that is half transparent stands between two walls.
    let veil = Arc::new(made(2, 2, |_, _| [0.0, 0.4, 0.0, 0.5]));
    let veil = Show::Picture(Photograph::new(&veil, PictureFit::Stretch, 0.0).unwrap());
    let wall = |distance: f64, color: Color| {
        background(&view, rule, Show::Gradient(vec![(0.0, color)]), Some(distance))
    };
    let far = wall(9.0, Color::new(1.0, 0.0, 0.0));
    let all = SpanImage::merge(&[background(&view, rule, veil, Some(5.0)), far]).unwrap();
    let [r, g, _, a] = shown(&all, rule).rgba(20, 20);
    assert!((r - 0.5).abs() < 1e-5 && (g - 0.4).abs() < 1e-5 && a > 0.99999, "{r} {g} {a}");
    let near = SpanImage::merge(&[all, wall(4.0, Color::new(0.0, 0.0, 1.0))]).unwrap();
    assert_eq!(shown(&near, rule).rgba(20, 20), [0.0, 0.0, 1.0, 1.0]);
    let rows = Arc::new(made(6, 4, |_, _| [1.0; 4]));
    let error = Photograph::new(&rows, PictureFit::Direction, 0.0).unwrap_err().to_string();
    assert!(error.contains("twice as wide as high"), "{error}");
    let error = Photograph::new(&Arc::new(made(2, 1, |_, _| [f32::NAN; 4])), PictureFit::Fill, 0.0);
    assert!(error.unwrap_err().to_string().contains("finite"));
}

#[test]
fn operators_keep_their_laws() {
    let [a, b, c] = [1, 2, 3].map(|seed| noisy(16, seed));
    let put = |a: &Image, b: &Image, by| picture::composite(a, b, by).unwrap();
    let over = |a: &Image, b: &Image| put(a, b, Operator::Over);
    assert!(difference(&over(&over(&a, &b), &c), &over(&a, &over(&b, &c))) < 1e-6);
    // What is in and what is out of the back is all of the front.
    let (inside, outside) = (put(&a, &b, Operator::In), put(&a, &b, Operator::Out));
    assert!(difference(&put(&inside, &outside, Operator::Plus), &a) < 1e-6);
    // Atop is in, before what is left of the back.
    let left = put(&b, &a, Operator::Out);
    let atop = put(&inside, &left, Operator::Plus);
    assert!(difference(&put(&a, &b, Operator::Atop), &atop) < 1e-6);
    assert!(difference(&put(&a, &b, Operator::Xor), &put(&b, &a, Operator::Xor)) < 1e-6);
    let nothing = made(16, 16, |_, _| [0.0; 4]);
    assert_eq!(difference(&over(&a, &nothing), &a), 0.0);
    assert_eq!(difference(&over(&nothing, &a), &a), 0.0);
    // Parts of pictures are parts of the result.
    let part = Window { x: 3, y: 5, width: 7, height: 9 };
    let (whole, cut) = (over(&a, &b), over(&a.cropped(part), &b.cropped(part)));
    assert_eq!(difference(&whole.cropped(part), &cut), 0.0);
    let error = picture::composite(&a, &noisy(8, 1), Operator::Over).unwrap_err().to_string();
    assert!(error.contains("16 x 16") && error.contains("8 x 8"), "{error}");
}

#[test]
fn grades_blurs_and_sizes_do_what_they_say() {
    let image = noisy(24, 5);
    let plain = Grade {
        exposure: 0.0,
        multiply: Color::WHITE,
        add: Color::BLACK,
        gamma: Color::WHITE,
        saturation: 1.0,
    };
    assert!(difference(&plain.apply(&image).unwrap(), &image) < 1e-6);
    let bright = Grade { exposure: 1.0, ..plain }.apply(&image).unwrap();
    for ([r, .., a], [x, .., b]) in image.pixels().zip(bright.pixels()) {
        assert!((2.0 * r - x).abs() < 1e-5 && a == b);
    }
    // Alpha weighs what is added: nothing stays nothing.
    let hole = made(2, 2, |_, _| [0.0; 4]);
    let lifted = Grade { add: Color::WHITE, ..plain }.apply(&hole).unwrap();
    assert_eq!(difference(&lifted, &hole), 0.0);
    let grey = Grade { saturation: 0.0, ..plain }.apply(&image).unwrap();
    assert!(grey.pixels().all(|[r, g, b, _]| (r - g).abs() < 1e-6 && (g - b).abs() < 1e-6));
    let root = made(1, 1, |_, _| [0.25, 0.25, 0.25, 1.0]);
    let bent = Grade { gamma: Color::grey(2.0), ..plain }.apply(&root).unwrap();
    assert!((bent.rgba(0, 0)[0] - 0.5).abs() < 1e-6);
    // A point becomes a bell of the same sum, whose variance is the square of the deviation.
    let point = made(41, 41, |x, y| [f32::from(u8::from((x, y) == (20, 20))); 4]);
    let bell = picture::blur(&point, 3.0).unwrap();
    let (mut sum, mut square) = (0.0f64, 0.0f64);
    for (at, [r, ..]) in bell.pixels().enumerate() {
        sum += f64::from(r);
        square += f64::from(r) * (at as f64 % 41.0 - 20.0).powi(2);
    }
    assert!((sum - 1.0).abs() < 1e-5 && (square - 9.0).abs() < 0.25, "{sum} {square}");
    // Sizes.
    let same = Reformat {
        size: (24, 24),
        part: [0.0, 0.0, 1.0, 1.0],
        keeps_shape: true,
        shift: DVec2::ZERO,
        scale: DVec2::ONE,
        turn: 0.0,
        filter: TextureFilter::Exact,
    };
    assert_eq!(
        difference(
            &Reformat { filter: TextureFilter::Nearest, ..same }.apply(&image).unwrap(),
            &image
        ),
        0.0
    );
    // All of it is all of it, however it is filtered but by the mean of what is between texels.
    for filter in [TextureFilter::Nearest, TextureFilter::Trilinear, TextureFilter::Anisotropic(8)]
    {
        let again = Reformat { filter, ..same }.apply(&image).unwrap();
        assert!(difference(&again, &image) < 1e-6, "{filter:?}");
    }
    // What is opaque stays so to its border, at every size; beside it is nothing, and a small one keeps its area.
    let white = made(30, 20, |_, _| [1.0; 4]);
    for size in [(7, 5), (60, 40), (64, 43), (1, 1)] {
        let filter = TextureFilter::default();
        let stretched =
            Reformat { size, keeps_shape: false, filter, ..same }.apply(&white).unwrap();
        assert!(stretched.pixels().all(|p| p.iter().all(|v| (v - 1.0).abs() < 1e-5)), "{size:?}");
    }
    for scale in [0.5, 0.13, 0.01, 1e-6] {
        let small = Reformat { size: (60, 40), scale: DVec2::splat(scale), ..same };
        let small = small.apply(&white).unwrap();
        let area: f32 = small.float("A").unwrap().iter().sum();
        let expected = 2400.0 * (scale * scale) as f32;
        assert!((area - expected).abs() < 1e-3 * expected + 1e-9, "{scale}: {area} {expected}");
    }
    // A part that lies beside what is shown is left away.
    let mut beside = Image::new((6, 4), Window { x: 4, y: 0, width: 5, height: 4 });
    for name in ["R", "G", "B", "A"] {
        beside.insert(name, Samples::Float(vec![1.0; 20])).unwrap();
    }
    let cut =
        Reformat { size: (6, 4), filter: TextureFilter::Nearest, ..same }.apply(&beside).unwrap();
    let alpha: Vec<f32> = cut.float("A").unwrap()[..6].to_vec();
    assert_eq!(alpha, [0.0, 0.0, 0.0, 0.0, 1.0, 1.0]);
    let half = Reformat { size: (12, 12), ..same }.apply(&image).unwrap();
    for (x, y) in [(1, 1), (5, 8), (10, 10)] {
        let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| image.rgba(2 * x + i, 2 * y + j));
        let mean = |k: usize| four.iter().map(|pixel| pixel[k]).sum::<f32>() / 4.0;
        let got = half.rgba(x, y);
        for (k, got) in got.into_iter().enumerate() {
            assert!((got - mean(k)).abs() < 0.12, "{x} {y}: {got} {}", mean(k));
        }
    }
    let turned =
        Reformat { turn: std::f64::consts::FRAC_PI_2, filter: TextureFilter::Nearest, ..same };
    let turned = turned.apply(&image).unwrap();
    for (x, y) in [(0, 0), (3, 9), (23, 4)] {
        // Clockwise: what was on the left is above.
        assert_eq!(turned.rgba(23 - y, x), image.rgba(x, y));
    }
    let mirrored =
        Reformat { scale: DVec2::new(-1.0, 1.0), filter: TextureFilter::Nearest, ..same };
    assert_eq!(mirrored.apply(&image).unwrap().rgba(2, 5), image.rgba(21, 5));
    let cut = Reformat {
        size: (12, 6),
        part: [0.5, 0.25, 0.5, 0.25],
        filter: TextureFilter::Nearest,
        ..same
    };
    assert_eq!(cut.apply(&image).unwrap().rgba(3, 2), image.rgba(15, 8));
}

#[test]
fn few_colours_keep_the_mean_and_segments_their_thresholds() {
    let ramp = made(64, 64, |x, y| {
        let t = (x as f32 + 0.5) / 64.0;
        [t, t * 0.5, (y as f32 + 0.5) / 64.0, 1.0]
    });
    let colors = |image: &Image| -> BTreeSet<[u32; 3]> {
        image.pixels().map(|[r, g, b, _]| [r, g, b].map(f32::to_bits)).collect()
    };
    for dither in [Dither::None, Dither::Ordered(1.0), Dither::Diffused] {
        let own = picture::quantize(&ramp, &Palette::Own(8), dither).unwrap();
        assert!(colors(&own).len() <= 8, "{dither:?}: {}", colors(&own).len());
        assert_eq!(
            difference(&own, &picture::quantize(&ramp, &Palette::Own(8), dither).unwrap()),
            0.0
        );
        let given = vec![Color::BLACK, Color::WHITE];
        let two = picture::quantize(&ramp, &Palette::Given(given), dither).unwrap();
        assert!(two.pixels().all(|[r, ..]| r == 0.0 || (r - 1.0).abs() < 1e-6));
    }
    // A grey between black and white: what is diffused has its coded mean.
    let grey = made(64, 64, |_, _| [0.2, 0.2, 0.2, 1.0]);
    let two = Palette::Given(vec![Color::BLACK, Color::WHITE]);
    let dots = picture::quantize(&grey, &two, Dither::Diffused).unwrap();
    let share = dots.float("R").unwrap().iter().sum::<f32>() / 4096.0;
    assert!(share > 0.1 && share < 0.6, "{share}");
    assert!(picture::quantize(&grey, &Palette::Own(0), Dither::None).is_err());
    assert!(picture::quantize(&grey, &Palette::Given(Vec::new()), Dither::None).is_err());
    // Thresholds.
    let three = picture::segment(&ramp, &Segments::Thresholds(vec![0.4, 0.7])).unwrap();
    for ([r, g, b, _], [index, ..]) in ramp.pixels().zip(three.pixels()) {
        let bright = encode_srgb(Color::new(r, g, b).luminance());
        let expected = u8::from(bright >= 0.4) + u8::from(bright >= 0.7);
        assert_eq!((encode_srgb(index) * 255.0).round() as u8, expected);
    }
    assert!(picture::segment(&ramp, &Segments::Thresholds(vec![0.7, 0.4])).is_err());
    // Three colours with noise are found again, the darkest first.
    let mut random = Random::new(3);
    let of = |x: u32| [0.05, 0.3, 0.8][x as usize / 20 % 3];
    let stone = made(60, 40, |x, _| {
        let noise = random.between(-0.02, 0.02) as f32;
        [of(x) + noise, of(x), of(x) * 0.8, 1.0]
    });
    let found = picture::segment(&stone, &Segments::Colors(3)).unwrap();
    for (at, [index, ..]) in found.pixels().enumerate() {
        let index = (encode_srgb(index) * 255.0).round() as u32;
        assert_eq!(index, at as u32 % 60 / 20, "{at}");
    }
}

/// A sky: bluer above, paler below, with noise.
fn sky(random: &mut Random, height: f32) -> [f32; 3] {
    let mut noise = || random.between(-0.012, 0.012) as f32;
    [0.22 + 0.25 * height + noise(), 0.40 + 0.25 * height + noise(), 0.82 + 0.06 * height + noise()]
}

#[test]
fn subjects_are_cut_out_of_a_sky_they_were_put_before() {
    let keys = vec![picture::ColorKey::Bluer(-0.2, 0.14)];
    let pulled = |subject: &Image,
                  keys: &[picture::ColorKey],
                  with_plate: bool,
                  edge: f64|
     -> (Image, f64, f64) {
        let mut random = Random::new(11);
        let (width, height) = subject.size;
        let mut plate = Vec::new();
        let photograph = made(width, height, |x, y| {
            let behind = sky(&mut random, y as f32 / height as f32);
            plate.push(behind);
            let [r, g, b, a] = subject.rgba(x, y);
            let [p, q, s] = behind.map(|v| v * (1.0 - a));
            [r + p, g + q, b + s, 1.0]
        });
        let plate = made(width, height, |x, y| {
            let [r, g, b] = plate[(y * width + x) as usize];
            [r, g, b, 1.0]
        });
        let keys = keys.to_vec();
        let matte = Matte { keys, edge, decontaminate: 1.0, ..Matte::default() };
        let cut = matte.pull(&photograph, with_plate.then_some(&plate)).unwrap().subject;
        let count = f64::from(width * height);
        let (mut alpha, mut color) = (0.0, 0.0);
        for (known, found) in subject.pixels().zip(cut.pixels()) {
            alpha += f64::from((known[3] - found[3]).abs());
            color += (0..3).map(|k| f64::from((known[k] - found[k]).abs())).fold(0.0, f64::max);
        }
        (cut, alpha / count, color / count)
    };
    // A green disc with a soft edge.
    let disc = made(96, 96, |x, y| {
        let off = (x as f32 - 47.5).hypot(y as f32 - 47.5);
        let a = ((30.0 - off) / 6.0 + 0.5).clamp(0.0, 1.0);
        [0.12 * a, 0.3 * a, 0.05 * a, a]
    });
    let (_, alpha, color) = pulled(&disc, &keys, false, 0.05);
    assert!(alpha < 0.004 && color < 0.004, "{alpha} {color}");
    let (_, alpha, color) = pulled(&disc, &[picture::ColorKey::Clean(0.62, 0.03)], true, 0.05);
    assert!(alpha < 0.004 && color < 0.004, "by a plate: {alpha} {color}");
    // Real cut-outs, whose alpha is known.
    let Some(folder) = data::find("photos") else { return };
    let mut bad = Vec::new();
    // Green and brown are far from a sky's blue, snow and stone are not.
    let far = picture::ColorKey::Bluer(-0.2, 0.14);
    let near = picture::ColorKey::Bluer(0.03, 0.14);
    let bounds = BTreeMap::from([
        ("guereins1", (far, 0.006)),
        ("guereins2", (far, 0.012)),
        ("guereins8", (near, 0.03)),
        ("hurricane1", (near, 0.05)),
        ("trees_512", (far, 0.01)),
        ("horse-chestnut-tree", (far, 0.004)),
        ("purple-leaf-plum", (far, 0.004)),
        ("fir", (far, 0.004)),
        ("bland-birch", (far, 0.03)),
        ("spruce", (far, 0.004)),
    ]);
    for (name, (key, bound)) in bounds {
        let subject = file::read(&folder.join(format!("{name}.png"))).unwrap();
        let (cut, alpha, color) = pulled(&subject, &[key], false, 0.003);
        let magenta = made(subject.size.0, subject.size.1, |_, _| [1.0, 0.0, 1.0, 1.0]);
        let shown = picture::composite(&cut, &magenta, Operator::Over).unwrap();
        let path = format!("{}/../target/mattes/{name}.png", env!("CARGO_MANIFEST_DIR"));
        file::write(&shown, std::path::Path::new(&path), None).unwrap();
        println!("{name}: alpha off by {alpha:.4}, colour by {color:.4}");
        bad.extend((alpha >= bound).then_some(name));
    }
    assert!(bad.is_empty(), "{bad:?}");
}

#[test]
fn keys_polygons_and_plates_are_checked_and_do_as_they_say() {
    let grey =
        made(20, 20, |x, _| if x < 10 { [0.1, 0.1, 0.1, 1.0] } else { [0.8, 0.8, 0.8, 1.0] });
    let pull = |matte: &Matte| matte.pull(&grey, None).map(|pulled| pulled.subject);
    let by = |key| Matte { keys: vec![key], decontaminate: 1.0, ..Matte::default() };
    let dark = pull(&by(picture::ColorKey::Brighter(0.5, 0.7))).unwrap();
    assert!(dark.rgba(3, 3)[3] == 1.0 && dark.rgba(15, 3)[3] == 0.0);
    let bright = pull(&by(picture::ColorKey::Darker(0.6, 0.5))).unwrap();
    assert!(bright.rgba(3, 3)[3] == 0.0 && bright.rgba(15, 3)[3] == 1.0);
    let garbage = vec![(0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (0.0, 0.5)];
    let upper = Matte { garbage, ..by(picture::ColorKey::Brighter(0.5, 0.7)) };
    let upper = pull(&upper).unwrap();
    assert!(upper.rgba(3, 3)[3] == 1.0 && upper.rgba(3, 15)[3] == 0.0);
    // A garbage polygon alone, and a picture that was cut out before.
    let lower = vec![(0.0, 0.5), (1.0, 0.5), (1.0, 1.0), (0.0, 1.0)];
    let alone = pull(&Matte { garbage: lower, ..Matte::default() }).unwrap();
    assert!(alone.rgba(3, 3)[3] == 0.0 && alone.rgba(15, 15)[3] == 1.0);
    let thin = made(4, 4, |_, _| [0.05, 0.05, 0.05, 0.5]);
    let again = by(picture::ColorKey::Brighter(0.5, 0.7)).pull(&thin, None).unwrap().subject;
    assert!(difference(&again, &thin) < 1e-6);
    let keep = vec![(0.5, 0.0), (1.0, 0.0), (1.0, 1.0), (0.5, 1.0)];
    let all = pull(&Matte { keep, ..by(picture::ColorKey::Brighter(0.5, 0.7)) }).unwrap();
    assert_eq!(all.rgba(15, 3)[3], 1.0);
    let error = pull(&by(picture::ColorKey::Clean(0.1, 0.05))).unwrap_err().to_string();
    assert!(error.contains("clean plate"), "{error}");
    let small = made(3, 3, |_, _| [0.0; 4]);
    let matte = by(picture::ColorKey::Clean(0.1, 0.05));
    assert!(matte.pull(&grey, Some(&small)).unwrap_err().to_string().contains("3 x 3"));
    for key in [
        picture::ColorKey::Brighter(0.7, 0.5),
        picture::ColorKey::Darker(0.1, 0.5),
        picture::ColorKey::Bluer(0.1, f32::NAN),
        picture::ColorKey::Hue(0.0, 0.0, 0.1),
    ] {
        assert!(key.check().is_err(), "{key:?}");
    }
}

#[test]
fn real_panoramas_stand_behind_scenes_with_all_their_light() {
    // What six views see, each pixel by its solid angle, is what the panorama holds, each row by its own.
    for name in ["hdri/aristea_wreck_puresky_1k.hdr", "hdri/modern_buildings_2_1k.hdr"] {
        let Some(path) = data::find(name) else { return };
        let panorama = Arc::new(file::read(&path).unwrap());
        let (width, height) = (panorama.size.0 as usize, panorama.size.1 as usize);
        let light = |channel: &str| {
            let values = panorama.float(channel).unwrap();
            let row = |y: usize| {
                let edge = |y: usize| (std::f64::consts::PI * y as f64 / height as f64).cos();
                let solid = (edge(y) - edge(y + 1)) * std::f64::consts::TAU / width as f64;
                values[y * width..][..width].iter().map(|v| f64::from(*v)).sum::<f64>() * solid
            };
            (0..height).map(row).sum::<f64>()
        };
        let size = 256u32;
        let mut seen = [0.0f64; 3];
        for (look_at, up) in [
            (v(1.0, 0.0, 0.0), DVec3::Y),
            (v(-1.0, 0.0, 0.0), DVec3::Y),
            (v(0.0, 0.0, 1.0), DVec3::Y),
            (v(0.0, 0.0, -1.0), DVec3::Y),
            (DVec3::Y, DVec3::Z),
            (DVec3::NEG_Y, DVec3::Z),
        ] {
            let camera = Camera {
                position: DVec3::ZERO,
                look_at,
                up,
                field_of_view: 90.0,
                ..Camera::default()
            };
            let view = View::new(&camera, Raster::new(size, size).unwrap()).unwrap();
            let rule = Rule::Sloped(1);
            let photograph = Photograph::new(&panorama, PictureFit::Direction, 0.0).unwrap();
            let image = shown(&background(&view, rule, Show::Picture(photograph), None), rule);
            for (at, pixel) in image.pixels().enumerate() {
                let place = |i: u32| (f64::from(i) + 0.5) / f64::from(size) * 2.0 - 1.0;
                let (x, y) = (place(at as u32 % size), place(at as u32 / size));
                let solid = (2.0 / f64::from(size)).powi(2) / (1.0 + x * x + y * y).powf(1.5);
                (0..3).for_each(|k| seen[k] += f64::from(pixel[k]) * solid);
            }
        }
        for (k, channel) in ["R", "G", "B"].into_iter().enumerate() {
            let all = light(channel);
            println!("{name} {channel}: {:.4} of {all:.4}", seen[k]);
            assert!((seen[k] / all - 1.0).abs() < 0.02, "{name} {channel}: {} {all}", seen[k]);
        }
    }
}
