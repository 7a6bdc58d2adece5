//! Trees on cards: turned to the eye, to each light and to each mirror, in front of each other, by chance.

#![allow(clippy::disallowed_methods, reason = "what is expected may be computed by anybody's sine")]

use glam::{DVec2, DVec3, dvec3 as v};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::fragment::{Finish, Optics};
use spandrel_engine::image::{Channel, Image, Samples, Window};
use spandrel_engine::raster::Raster;
use spandrel_engine::render::billboards::{self, BillboardsOptions, Chance, Subject, Tree};
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::filter::PixelFilter as Pixels;
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::scene::{AlphaMode, Material};
use spandrel_engine::shade::{Illuminate, Shadows, Stream, Trace};
use spandrel_engine::span::SpanImage;
use spandrel_engine::trace::Accelerator;
use spandrel_tests::lights::{illuminate, sun};
use spandrel_tests::scenes::painted_faces;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

const RULE: Rule = Rule::Sloped(4);

fn picture(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [f32; 4]) -> Arc<Image> {
    let mut image = Image::new((width, height), Window::whole(width, height));
    let all: Vec<[f32; 4]> = (0..width * height).map(|at| pixel(at % width, at / width)).collect();
    for (k, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
        image.insert(name, Samples::Float(all.iter().map(|p| p[k]).collect())).unwrap();
    }
    Arc::new(image)
}

/// A crown as a disc on a trunk, off the middle of its picture: its width is 0.8 of its height.
fn tree() -> Arc<Image> {
    picture(80, 120, |x, y| {
        let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        let crown = (x - 35.0).hypot(y - 42.0) < 32.0;
        let trunk = (x - 35.0).abs() < 3.0 && (42.0..110.0).contains(&y);
        match (crown, trunk) {
            (true, _) => [0.1, 0.5, 0.1, 1.0],
            (_, true) => [0.4, 0.2, 0.1, 1.0],
            _ => [0.0; 4],
        }
    })
}

fn trees(places: &[Tree], pictures: &[Arc<Image>], view: &View, lit: bool) -> SpanImage {
    let subjects = pictures.iter().map(|picture| Subject::new(picture).unwrap()).collect();
    let stand = BillboardsOptions {
        label: "trees".to_owned(),
        color: Color::WHITE,
        lit,
        crown: 0.0,
        transmit: Color::BLACK,
    };
    let rows = 0..view.raster().height;
    let plan = RULE.plan().unwrap();
    billboards::image(subjects, places.to_vec(), stand, view, plan, rows).unwrap()
}

fn one(foot: DVec3, height: f64) -> Tree {
    Tree { picture: 0, foot, height, mirrored: false }
}

fn shown(image: &SpanImage) -> Image {
    let framing = Framing::scaled(image.view().raster(), DVec2::ONE).unwrap();
    resolve(image, RULE, &framing, &BTreeSet::from([Channel::Color])).unwrap()
}

fn view(position: DVec3, look_at: DVec3, size: (u32, u32)) -> View {
    let camera = Camera { position, look_at, field_of_view: 40.0, ..Camera::default() };
    View::new(&camera, Raster::new(size.0, size.1).unwrap()).unwrap()
}

fn difference(a: &Image, b: &Image) -> f32 {
    let off = |(a, b): ([f32; 4], [f32; 4])| {
        a.into_iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    a.pixels().zip(b.pixels()).map(off).fold(0.0, f32::max)
}

#[test]
fn a_tree_looks_alike_from_all_sides_and_is_as_high_as_it_is() {
    let foot = v(3.0, 0.5, -2.0);
    let seen = |angle: f64| {
        let position = foot + v(angle.sin() * 14.0, 3.0, angle.cos() * 14.0);
        shown(&trees(
            &[one(foot, 6.0)],
            &[tree()],
            &view(position, foot + DVec3::Y * 3.0, (60, 60)),
            false,
        ))
    };
    let first = seen(0.0);
    for angle in [0.7, 1.6, 2.9, 4.4] {
        let other = seen(angle);
        // A texel on the border may be taken or not.
        let off = first.pixels().zip(other.pixels()).filter(|(a, b)| (a[3] - b[3]).abs() > 0.01);
        assert!(off.count() < 8 && difference(&first, &other) < 0.2, "{angle}");
    }
    // Seen level from 1 pixel a centimetre: rows of 6 m.
    let camera = Camera {
        position: foot + v(0.0, 3.0, 20.0),
        look_at: foot + v(0.0, 3.0, 0.0),
        parallel_height: Some(8.0),
        ..Camera::default()
    };
    let level = View::new(&camera, Raster::new(80, 80).unwrap()).unwrap();
    let image = shown(&trees(&[one(foot, 6.0)], &[tree()], &level, false));
    let alpha = image.float("A").unwrap();
    let area: f64 = alpha.iter().map(|a| f64::from(*a)).sum::<f64>() * 0.01;
    // In pixels of the picture: a disc, and the trunk below it; 100 of them are 6 m.
    let expected = (std::f64::consts::PI * 1024.0 + 6.0 * 36.0) * 0.0036;
    assert!((area / expected - 1.0).abs() < 0.01, "{area} {expected}");
    let column = |x: usize| (0..80).map(|y| alpha[y * 80 + x]).sum::<f32>();
    // It stands on its trunk, which is not in the middle of its picture.
    let middle: f64 = (0..80).map(|x| (x as f64 + 0.5) * f64::from(column(x))).sum::<f64>()
        / f64::from(alpha.iter().sum::<f32>());
    assert!((middle - 40.0).abs() < 0.2, "{middle}");
}

/// A floor, seen from straight above.
fn above(side: f64, pixels: u32) -> View {
    let camera = Camera {
        position: v(0.0, 40.0, 0.0),
        look_at: DVec3::ZERO,
        up: v(0.0, 0.0, -1.0),
        parallel_height: Some(side),
        ..Camera::default()
    };
    View::new(&camera, Raster::new(pixels, pixels).unwrap()).unwrap()
}

fn floor(material: Material, h: f64, view: &View) -> SpanImage {
    let corners = [v(-h, 0.0, h), v(h, 0.0, h), v(h, 0.0, -h), v(-h, 0.0, -h)];
    let scene = painted_faces(&[(corners, material)]).unwrap();
    let rows = 0..view.raster().height;
    scanline::render(&[scene.into()], view, RULE.plan().unwrap(), rows).unwrap()
}

#[test]
fn shadows_are_of_the_whole_tree_wherever_the_light_comes_from() {
    // The floor alone is lit, the tree is out of sight: only its shadow is seen.
    let area = (std::f64::consts::PI * 1024.0 + 6.0 * 36.0) * 0.0004;
    let view = above(16.0, 160);
    let ground = floor(Material { color: Color::WHITE, ..Material::default() }, 9.0, &view);
    let wood = trees(&[one(DVec3::ZERO, 2.0)], &[tree()], &view, true);
    for (azimuth, height) in [(0.0f64, 30.0f64), (1.0, 30.0), (2.6, 45.0), (4.0, 20.0), (5.5, 58.0)]
    {
        let height = height.to_radians();
        let way = v(azimuth.sin() * height.cos(), -height.sin(), azimuth.cos() * height.cos());
        let dark = |shadows: Shadows| {
            let light = illuminate(vec![sun(way, Color::WHITE)], Color::BLACK, Color::BLACK);
            let light = Arc::new(Illuminate { shadows, ..light });
            // The ground is shaded beside the tree, which is not in the picture.
            let lit = ground.shaded_beside(light, &[&wood]).unwrap();
            let picture = shown(&lit);
            let open = height.sin() as f32;
            let missing: f32 = picture.float("R").unwrap().iter().map(|r| 1.0 - r / open).sum();
            (f64::from(missing) * 0.01, picture)
        };
        let (by_volumes, volumes) = dark(Shadows::Volumes);
        let expected = area / height.tan();
        assert!((by_volumes / expected - 1.0).abs() < 0.03, "{azimuth}: {by_volumes} {expected}");
        let (by_rays, rays) = dark(Shadows::Rays(16));
        assert!((by_rays / expected - 1.0).abs() < 0.03, "{azimuth}: {by_rays} {expected}");
        // The same shadow, but for pixels on its border.
        let off = volumes.pixels().zip(rays.pixels()).filter(|(a, b)| (a[0] - b[0]).abs() > 0.25);
        assert!(off.count() < 40);
    }
    // From straight above an upright card would have none: it leans.
    let light = illuminate(vec![sun(v(0.0, -1.0, 0.0), Color::WHITE)], Color::BLACK, Color::BLACK);
    let light = Arc::new(Illuminate { shadows: Shadows::Volumes, ..light });
    let picture = shown(&ground.shaded_beside(light, &[&wood]).unwrap());
    let dark: f32 = picture.float("R").unwrap().iter().map(|r| 1.0 - r).sum();
    let expected = area * 0.5;
    assert!((f64::from(dark) * 0.01 / expected - 1.0).abs() < 0.05, "{dark}");
}

#[test]
fn trees_cast_no_shadow_on_themselves_and_lie_in_those_of_others() {
    let view = view(v(0.0, 2.0, 14.0), v(0.0, 2.0, 0.0), (80, 60));
    let lit = |places: &[Tree], shadows: Shadows, way: DVec3| {
        let image = trees(places, &[tree()], &view, true);
        let light = illuminate(vec![sun(way, Color::WHITE)], Color::BLACK, Color::BLACK);
        shown(&image.shaded(Arc::new(Illuminate { shadows, ..light })).unwrap())
    };
    for way in [v(-1.0, -0.5, -0.6), v(0.8, -0.3, -0.2), v(0.0, -0.2, -1.0)] {
        let alone = [one(v(1.0, 0.0, 0.0), 4.0)];
        let free = lit(&alone, Shadows::Off, way);
        assert!(free.pixels().any(|p| p[1] > 0.05));
        for shadows in [Shadows::Volumes, Shadows::Rays(4)] {
            let off = difference(&free, &lit(&alone, shadows, way));
            assert!(off < 1e-4, "{way} {shadows:?}: {off}");
        }
    }
    // One stands in the way of the other's light.
    let both = [one(v(1.0, 0.0, 0.0), 4.0), one(v(1.0, 0.0, 30.0), 9.0)];
    let way = v(0.0, -0.1, -1.0);
    let shaded = lit(&both, Shadows::Volumes, way);
    let free = lit(&both, Shadows::Off, way);
    let sum = |image: &Image| image.float("G").unwrap().iter().sum::<f32>();
    assert!(sum(&shaded) < 0.3 * sum(&free), "{} {}", sum(&shaded), sum(&free));
}

#[test]
fn mirrors_show_trees_turned_to_them() {
    // A mirror on the ground: what it shows is what a camera below would see.
    let eye = v(0.0, 3.0, 12.0);
    let look = v(0.0, 0.0, 2.0);
    let size = (64, 48);
    let camera = view(eye, look, size);
    let optics = Optics { reflect: Color::WHITE, fresnel: false, ..Optics::default() };
    let finish = Finish { optics: Some(optics), ..Finish::default() };
    let mirror = Material { color: Color::BLACK, finish, ..Material::default() };
    let wood = trees(&[one(v(0.0, 0.0, -3.0), 4.0)], &[tree()], &camera, false);
    let shader = Trace {
        rays: 4,
        depth: 2,
        least: 1e-6,
        background: Color::BLACK,
        sky: None,
        accelerator: Accelerator::Tree,
    };
    let ground = floor(mirror, 8.0, &camera);
    let seen = shown(&ground.shaded_beside(Arc::new(shader), &[&wood]).unwrap());
    let flip = v(1.0, -1.0, 1.0);
    let below = Camera {
        position: eye * flip,
        look_at: look * flip,
        field_of_view: 40.0,
        ..Camera::default()
    };
    let below = View::new(&below, Raster::new(size.0, size.1).unwrap()).unwrap();
    let mirrored = shown(&trees(&[one(v(0.0, 0.0, -3.0), 4.0)], &[tree()], &below, false));
    // Upside down, and where the mirror is.
    let (mut off, mut there) = (0.0, 0.0);
    for y in 0..48u32 {
        for x in 0..64u32 {
            if shown(&ground).rgba(x, y)[3] < 1.0 {
                continue;
            }
            let (a, b) = (seen.rgba(x, y)[1], mirrored.rgba(x, 47 - y)[1]);
            off += f64::from((a - b).abs());
            there += f64::from(b);
        }
    }
    assert!(there > 20.0 && off / there < 0.06, "{off} of {there}");
}

#[test]
fn nearer_trees_stand_before_farther_ones_and_veils_let_them_through() {
    let veil = picture(4, 8, |_, _| [0.0, 0.3, 0.0, 0.5]);
    let solid = picture(4, 8, |_, _| [0.8, 0.0, 0.0, 1.0]);
    let camera = view(v(0.0, 2.0, 12.0), v(0.0, 2.0, 0.0), (41, 41));
    let place = |picture: u32, z: f64| Tree { picture, ..one(v(0.0, 0.0, z), 4.0) };
    let middle = |places: &[Tree]| {
        shown(&trees(places, &[veil.clone(), solid.clone()], &camera, false)).rgba(20, 20)
    };
    let front = middle(&[place(0, 1.0), place(1, -1.0)]);
    let back = middle(&[place(1, 1.0), place(0, -1.0)]);
    assert!((front[0] - 0.4).abs() < 1e-4 && (front[1] - 0.3).abs() < 1e-4, "{front:?}");
    assert!((back[0] - 0.8).abs() < 1e-4 && back[1] < 1e-4, "{back:?}");
    // Three veils.
    let three = middle(&[place(0, 1.0), place(0, 0.0), place(0, -1.0)]);
    assert!((three[3] - 0.875).abs() < 1e-4, "{three:?}");
}

#[test]
fn a_dense_stand_is_what_its_cards_over_each_other_are() {
    // Cards that cross each other, a hundred over one line, nearly opaque: what hides the rest is looked through
    // before stacks are made. Beside it, each card by itself along rays of the eye.
    let colors = [[0.8, 0.1, 0.1], [0.1, 0.7, 0.2], [0.15, 0.2, 0.9]];
    let pictures: Vec<Arc<Image>> = colors
        .iter()
        .map(|c| picture(32, 64, |_, _| [c[0] * 0.9, c[1] * 0.9, c[2] * 0.9, 0.9]))
        .collect();
    let mut chance = Chance::new(11);
    let places: Vec<Tree> = (0..240)
        .map(|i| {
            let (x, z) = (chance.unit() * 4.0 - 2.0, chance.unit() * 4.0 - 2.0);
            Tree { picture: i % 3, ..one(v(x, 0.0, z), 1.0 + 2.0 * chance.unit()) }
        })
        .collect();
    let eye = v(0.0, 1.5, 11.0);
    let camera = view(eye, v(0.0, 1.4, 0.0), (48, 36));
    let image = trees(&places, &pictures, &camera, false);
    let deepest = (0..36 * 4).map(|k| image.layers().line(k).len()).max();
    assert!(deepest > Some(150), "{deepest:?}");
    let actual = shown(&image);
    // A program may lessen alpha: then nothing is looked through.
    let kept = Stream::new("alpha = alpha * 1;", BTreeMap::new(), BTreeMap::new()).unwrap();
    let kept = shown(&image.shaded(Arc::new(kept)).unwrap());
    assert!(difference(&actual, &kept) < 1e-3, "{}", difference(&actual, &kept));

    let card_color = |direction: DVec3| {
        let mut met: Vec<(f64, usize)> = Vec::new();
        for tree in &places {
            let towards = (eye - tree.foot).with_y(0.0).normalize();
            let t = (tree.foot - eye).dot(towards) / direction.dot(towards);
            let at = eye + direction * t - tree.foot;
            let across = at.dot(towards.cross(DVec3::Y));
            if (0.0..tree.height).contains(&at.y) && across.abs() < tree.height / 4.0 {
                met.push((t, tree.picture as usize));
            }
        }
        met.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut left, mut sum) = (1.0, [0.0; 4]);
        for (_, picture) in met {
            let [r, g, b] = colors[picture];
            for (sum, c) in sum.iter_mut().zip([r, g, b, 1.0]) {
                *sum += left * 0.9 * c;
            }
            left *= 0.1;
        }
        sum
    };
    let forward = (v(0.0, 1.4, 0.0) - eye).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let half = 20f64.to_radians().tan();
    let n = 12;
    let (mut squares, mut worst) = (0.0f64, 0.0f32);
    for y in 0..36u32 {
        for x in 0..48u32 {
            let mut mean = [0.0f32; 4];
            for s in 0..n * n {
                let px = f64::from(x) + (f64::from(s % n) + 0.5) / f64::from(n);
                let py = f64::from(y) + (f64::from(s / n) + 0.5) / f64::from(n);
                let (sx, sy) = ((px - 24.0) / 18.0 * half, (18.0 - py) / 18.0 * half);
                let color = card_color(forward + right * sx + up * sy);
                mean.iter_mut().zip(color).for_each(|(m, c)| *m += c / (n * n) as f32);
            }
            for (a, e) in actual.rgba(x, y).iter().zip(mean) {
                squares += f64::from(a - e).powi(2);
                worst = worst.max((a - e).abs());
            }
        }
    }
    let rms = (squares / f64::from(36 * 48 * 4)).sqrt();
    // Half a texel of a card's border is soft, and the samples are 144 to a pixel.
    assert!(rms < 0.012 && worst < 0.15, "{rms} {worst}");
}

/// A stand of soft cards that cross, a dozen over each pixel and more.
fn soft_stand() -> SpanImage {
    let soft = picture(32, 64, |x, y| {
        let a = if (x / 4 + y / 4) % 3 == 0 { 1.0 } else { 0.4 };
        [0.7 * a, (x as f32 / 32.0) * a, (y as f32 / 64.0) * a, a]
    });
    let mut chance = Chance::new(5);
    let places: Vec<Tree> = (0..200)
        .map(|_| {
            let (x, z) = (chance.unit() * 5.0 - 2.5, chance.unit() * 4.0 - 2.0);
            one(v(x, 0.0, z), 1.5 + 1.5 * chance.unit())
        })
        .collect();
    trees(&places, &[soft], &view(v(0.0, 1.5, 11.0), v(0.0, 1.4, 0.0), (72, 54)), false)
}

#[test]
fn windows_of_dense_stands_are_parts_of_the_whole_by_every_filter() {
    let image = soft_stand();
    let whole = Framing::scaled(image.view().raster(), DVec2::ONE).unwrap();
    let channels = BTreeSet::from([Channel::Color]);
    for filter in [Pixels::Box, Pixels::Tent, Pixels::Gaussian, Pixels::Mitchell, Pixels::Lanczos] {
        let whole = Framing { filter, ..whole.clone() };
        let all = resolve(&image, RULE, &whole, &channels).unwrap();
        let window = Window { x: 21, y: 17, width: 30, height: 23 };
        let part = resolve(&image, RULE, &whole.cut(window).unwrap(), &channels).unwrap();
        assert!(all.pixels().flatten().all(|value| (-1.0..2.0).contains(&value)), "{filter:?}");
        for y in 0..window.height {
            for x in 0..window.width {
                let (a, b) = (all.rgba(window.x + x, window.y + y), part.rgba(x, y));
                let off = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                assert!(off < 1e-5, "{filter:?} at {x}, {y}: {off}");
            }
        }
    }
}

#[test]
fn what_is_written_beside_the_colour_changes_no_other_channel() {
    let image = soft_stand();
    let framing = Framing::scaled(image.view().raster(), DVec2::ONE).unwrap();
    let others = BTreeSet::from([Channel::Z, Channel::N, Channel::P, Channel::Id, Channel::Error]);
    let with: BTreeSet<Channel> = others.iter().copied().chain([Channel::Color]).collect();
    let (alone, both) =
        (resolve(&image, RULE, &framing, &others), resolve(&image, RULE, &framing, &with));
    let (alone, both) = (alone.unwrap(), both.unwrap());
    for (name, samples) in alone.channels() {
        let (_, same) = both.channels().find(|(other, _)| *other == name).unwrap();
        assert_eq!(samples, same, "{name}");
    }
}

#[test]
fn a_mirror_that_lets_all_through_is_seen_before_many_layers() {
    // A pane of no alpha whose glass mirrors six tenths of a white sky, before ever more veils.
    let optics = Some(Optics { reflect: Color::grey(0.6), fresnel: false, ..Optics::default() });
    let pane = |color: f32, alpha: f32, optics: Option<Optics>| Material {
        color: Color::grey(color),
        alpha,
        alpha_mode: AlphaMode::Blend,
        unlit: true,
        finish: Finish { optics, ..Finish::default() },
        ..Material::default()
    };
    let corners = |z: f64| [v(-2.0, -2.0, z), v(2.0, -2.0, z), v(2.0, 2.0, z), v(-2.0, 2.0, z)];
    let camera = view(v(0.0, 0.0, 6.0), DVec3::ZERO, (9, 9));
    for count in [1u32, 6, 7, 8, 12, 40] {
        let mut parts = vec![(corners(1.0), pane(0.0, 0.0, optics))];
        parts.extend((0..count).map(|i| (corners(-0.1 * f64::from(i)), pane(0.0, 0.02, None))));
        let scene = painted_faces(&parts).unwrap();
        let image = scanline::render(&[scene.into()], &camera, RULE.plan().unwrap(), 0..9).unwrap();
        let shader = Trace {
            rays: 1,
            depth: 1,
            least: 1e-3,
            background: Color::WHITE,
            sky: None,
            accelerator: Accelerator::Tree,
        };
        let [red, .., alpha] = shown(&image.shaded(Arc::new(shader)).unwrap()).rgba(4, 4);
        let through = 0.98f32.powi(count as i32);
        assert!((red - 0.6).abs() < 1e-4, "{count}: {red}");
        assert!((alpha - (1.0 - 0.4 * through)).abs() < 1e-4, "{count}: {alpha}");
    }
}

#[test]
fn areas_are_planted_by_seed_and_never_too_near() {
    let corners = [v(0.0, 1.0, 0.0), v(40.0, 1.0, 0.0), v(40.0, 1.0, 20.0), v(20.0, 1.0, 5.0)];
    let plant = |seed: u64, count: u32, apart: f64| {
        let mut feet = Vec::new();
        let planted =
            billboards::scatter(&corners, count, apart, seed, |foot, _| feet.push(foot)).unwrap();
        assert_eq!(planted as usize, feet.len());
        feet
    };
    let feet = plant(3, 60, 1.2);
    assert_eq!(feet, plant(3, 60, 1.2));
    assert_ne!(feet, plant(4, 60, 1.2));
    assert_eq!(feet.len(), 60);
    for (i, a) in feet.iter().enumerate() {
        assert!(a.y == 1.0 && a.z <= 20.0 && feet[..i].iter().all(|b| a.distance(*b) >= 1.2));
    }
    // What finds no room is left out.
    let few = plant(3, 10_000, 4.0);
    assert!(few.len() > 8 && few.len() < 60, "{}", few.len());
    assert!(billboards::scatter(&corners[..2], 5, 0.0, 1, |_, _| ()).is_err());
    let line = [v(0.0, 0.0, 0.0), v(1.0, 0.0, 0.0), v(2.0, 0.0, 0.0)];
    assert!(billboards::scatter(&line, 5, 0.0, 1, |_, _| ()).is_err());
}

#[test]
fn pictures_without_a_subject_and_trees_without_a_picture_are_told() {
    let nothing = picture(4, 4, |_, _| [0.0; 4]);
    assert!(Subject::new(&nothing).unwrap_err().to_string().contains("transparent"));
    let bad = picture(2, 2, |_, _| [f32::INFINITY; 4]);
    assert!(Subject::new(&bad).unwrap_err().to_string().contains("pixel 0, 0"));
    let camera = view(v(0.0, 2.0, 12.0), v(0.0, 2.0, 0.0), (8, 8));
    let made = |tree_: Tree| {
        let stand = BillboardsOptions {
            label: "trees".to_owned(),
            color: Color::WHITE,
            lit: true,
            crown: 0.0,
            transmit: Color::BLACK,
        };
        let subjects = vec![Subject::new(&tree()).unwrap()];
        billboards::image(subjects, vec![tree_], stand, &camera, RULE.plan().unwrap(), 0..8)
            .map(drop)
            .unwrap_err()
            .to_string()
    };
    let three = made(Tree { picture: 3, ..one(DVec3::ZERO, 1.0) });
    assert!(three.contains("tree 0 has picture 3"), "{three}");
    assert!(made(one(DVec3::ZERO, 0.0)).contains("above 0"));
    assert!(made(one(v(0.0, f64::NAN, 0.0), 1.0)).contains("finite"));
}
