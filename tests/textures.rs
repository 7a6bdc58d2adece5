//! Pictures on surfaces: places, filters, wraps and cut-outs in closed form; bumps and normals against faces
//! that lean; the store within its limit; files that are no pictures.

#![allow(clippy::disallowed_methods, reason = "what is expected may be computed by anybody's sine")]

use glam::{DVec2, DVec3, dvec3 as v};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::fragment::{Finish, Gloss, Optics};
use spandrel_engine::image::texels::Texels;
use spandrel_engine::image::{Channel, Coded, Codes, Coding, Image, Layout, Samples, Window, file};
use spandrel_engine::key::Key;
use spandrel_engine::raster::Raster;
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::scene::{AlphaMode, Map, Material, Picture, Scene, read};
use spandrel_engine::shade::{Illuminate, Shadows, Trace};
use spandrel_engine::span::SpanImage;
use spandrel_engine::texture::{
    By, Footprint, Mapping, Meaning, PictureSource, Store, StoreReport, TextureFilter, Wrap,
};
use spandrel_engine::trace::Accelerator;
use spandrel_tests::lights::{illuminate, sun};
use spandrel_tests::scenes::painted_faces;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

const RULE: Rule = Rule::Sloped(4);

pub(crate) fn scratch(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("spandrel-textures-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder.join(name)
}

/// Writes a picture of scene-linear colours, by column and row from the top.
pub(crate) fn painted(
    name: &str,
    width: u32,
    height: u32,
    color: impl Fn(u32, u32) -> [f32; 4],
) -> String {
    let mut picture = Image::new((width, height), Window::whole(width, height));
    let at = |i: u32| color(i % width, i / width);
    for (axis, channel) in ["R", "G", "B", "A"].into_iter().enumerate() {
        let values = (0..width * height).map(|i| at(i)[axis]).collect();
        picture.insert(channel, Samples::Float(values)).unwrap();
    }
    let path = scratch(name);
    file::write(&picture, &path, if name.ends_with("png") { Some(16) } else { Some(32) }).unwrap();
    path.to_string_lossy().into_owned()
}

pub(crate) fn map(path: &str, mapping: Mapping) -> Map {
    Map { mapping, ..Map::of(Picture::File(path.to_owned())) }
}

pub(crate) fn mapped(what: &str, map: Map, material: Material) -> Material {
    let mut material = material;
    material.maps.insert(what.to_owned(), map);
    material
}

pub(crate) fn unlit() -> Material {
    Material { color: Color::WHITE, unlit: true, ..Material::default() }
}

/// A scene of quadrilaterals whose corners are the picture's: lower left, lower right, upper right, upper left.
pub(crate) fn made(parts: &[([DVec3; 4], Material)]) -> Arc<Scene> {
    painted_faces(parts).unwrap()
}

pub(crate) fn spans(scene: Arc<Scene>, view: &View) -> SpanImage {
    scanline::render(&[scene.into()], view, RULE.plan().unwrap(), 0..view.raster().height).unwrap()
}

pub(crate) fn shown(
    image: &SpanImage,
    textures: TextureFilter,
    channels: &[Channel],
) -> Result<Image, String> {
    let framing = Framing::scaled(image.view().raster(), DVec2::ONE).unwrap();
    let framing = Framing { textures, ..framing };
    let channels: BTreeSet<Channel> = channels.iter().copied().collect();
    resolve(image, RULE, &framing, &channels).map_err(|error| error.to_string())
}

pub(crate) fn colors(image: &SpanImage, textures: TextureFilter) -> [Vec<f32>; 3] {
    let picture = shown(image, textures, &[Channel::Color]).unwrap();
    ["R", "G", "B"].map(|name| picture.float(name).unwrap().to_vec())
}

pub(crate) fn view(camera: &Camera, width: u32, height: u32) -> View {
    View::new(camera, Raster::new(width, height).unwrap()).unwrap()
}

/// Straight down on a square around the origin.
pub(crate) fn above(side: f64, pixels: u32) -> View {
    let camera = Camera {
        position: v(0.0, 10.0, 0.0),
        look_at: DVec3::ZERO,
        up: v(0.0, 0.0, -1.0),
        parallel_height: Some(side),
        ..Camera::default()
    };
    view(&camera, pixels, pixels)
}

/// The floor between -h and h, upright from above.
pub(crate) fn floor(h: f64) -> [DVec3; 4] {
    [v(-h, 0.0, h), v(h, 0.0, h), v(h, 0.0, -h), v(-h, 0.0, -h)]
}

/// Half way over a floor that reaches far.
fn street() -> Camera {
    Camera { position: v(0.3, 1.0, 6.0), look_at: v(0.0, 0.0, 0.0), ..Camera::default() }
}

const ALL: [TextureFilter; 4] = [
    TextureFilter::Nearest,
    TextureFilter::Trilinear,
    TextureFilter::Anisotropic(8),
    TextureFilter::Exact,
];

#[test]
fn a_ramp_lies_in_perspective_where_its_corners_say() {
    // u in red, v in green; by the vertices, and by the projection along the y axis.
    let ramp = painted("ramp.exr", 64, 64, |x, y| {
        [(x as f32 + 0.5) / 64.0, 1.0 - (y as f32 + 0.5) / 64.0, 0.0, 1.0]
    });
    let by_y = Mapping {
        by: By::Y,
        origin: v(-6.0, 0.0, 6.0),
        turn: 90.0,
        length: DVec2::splat(12.0),
        scale: DVec2::new(1.0, 1.0),
        ..Mapping::default()
    };
    for mapping in [Mapping::default(), by_y] {
        let material = mapped("color", map(&ramp, mapping), unlit());
        let image = spans(made(&[(floor(6.0), material)]), &view(&street(), 120, 80));
        for filter in ALL {
            let picture = shown(&image, filter, &[Channel::Color, Channel::P]).unwrap();
            let value = |name: &str, at: usize| f64::from(picture.float(name).unwrap()[at]);
            let mut counted = 0;
            for at in 0..120 * 80 {
                let (x, z) = (value("P.X", at), value("P.Z", at));
                let is_inner = value("A", at) == 1.0 && x.abs().max(z.abs()) < 4.0;
                // Near the horizon a pixel covers more than a texel of the border beside.
                if is_inner && z > -2.0 {
                    counted += 1;
                    let (u, w) = ((x + 6.0) / 12.0, (6.0 - z) / 12.0);
                    let within = if filter == TextureFilter::Nearest { 0.008 } else { 0.0012 };
                    let off = (value("R", at) - u).abs().max((value("G", at) - w).abs());
                    assert!(off < within, "{filter:?} {mapping:?} {at}: {off}");
                }
            }
            assert!(counted > 1000, "{counted}");
        }
    }
}

#[test]
fn filters_turn_fine_patterns_into_their_mean_each_better_than_the_last() {
    let checker = painted("checker.exr", 256, 256, |x, y| {
        let on = f32::from(u8::from((x / 4 + y / 4) % 2 == 0));
        [on, on, on, 1.0]
    });
    let mapping = Mapping { scale: DVec2::splat(24.0), ..Mapping::default() };
    let material = mapped("color", map(&checker, mapping), unlit());
    let scene = made(&[(floor(60.0), material)]);
    let camera = Camera { position: v(0.3, 1.0, 40.0), look_at: v(0.0, 0.0, 20.0), ..street() };
    // The truth: 24 by 24 pixels of the picture for each.
    let (width, height, factor) = (48u32, 32u32, 24u32);
    let fine = spans(scene.clone(), &view(&camera, width * factor, height * factor));
    let [fine, ..] = colors(&fine, TextureFilter::Anisotropic(16));
    let truth = |at: usize| {
        let (x, y) = (at as u32 % width * factor, at as u32 / width * factor);
        let rows =
            (y..y + factor).map(|y| &fine[(y * width * factor + x) as usize..][..factor as usize]);
        rows.flatten().map(|v| f64::from(*v)).sum::<f64>() / f64::from(factor * factor)
    };
    let image = spans(scene, &view(&camera, width, height));
    let errors = ALL.map(|filter| {
        let [red, ..] = colors(&image, filter);
        let below = (height / 2 * width) as usize..red.len();
        let squares = below.clone().map(|at| (f64::from(red[at]) - truth(at)).powi(2));
        (squares.sum::<f64>() / below.len() as f64).sqrt()
    });
    let [nearest, trilinear, anisotropic, exact] = errors;
    assert!(nearest > 2.0 * trilinear, "{errors:?}");
    assert!(trilinear > 1.25 * anisotropic, "{errors:?}");
    assert!(anisotropic > exact && exact < 0.02, "{errors:?}");
}

#[test]
fn pictures_are_enlarged_at_other_scales_without_new_texels() {
    // Twice the scale shows each texel twice as large: the mean of four pixels is the one of scale 1.
    let noise = painted("noise.exr", 32, 32, |x, y| {
        let value = ((x * 7 + y * 13) * (x + 3 * y) % 31) as f32 / 31.0;
        [value, value, value, 1.0]
    });
    let material = mapped("color", map(&noise, Mapping::default()), unlit());
    let image = spans(made(&[(floor(1.0), material)]), &above(2.0, 64));
    let at_scale = |scale: f64| {
        let framing = Framing::scaled(image.view().raster(), DVec2::splat(scale)).unwrap();
        let framing = Framing { textures: TextureFilter::Exact, ..framing };
        let color = BTreeSet::from([Channel::Color]);
        resolve(&image, RULE, &framing, &color).unwrap().float("R").unwrap().to_vec()
    };
    let (once, twice) = (at_scale(1.0), at_scale(2.0));
    for (at, once) in once.iter().enumerate() {
        let (x, y) = (at % 64 * 2, at / 64 * 2);
        let four = [0, 1, 128, 129].map(|step| twice[y * 128 + x + step]);
        let mean = four.iter().sum::<f32>() / 4.0;
        assert!((mean - once).abs() < 0.01, "{at}: {mean} {once}");
    }
}

#[test]
fn what_is_beside_a_picture_is_as_its_wrap_says() {
    // Four texels in a row, seen from -1 to 2.
    let row = painted("row.exr", 4, 1, |x, _| [0.1 + 0.2 * x as f32, 0.0, 0.0, 1.0]);
    let texels = [0.1, 0.3, 0.5, 0.7];
    let expected = |wrap: Wrap, k: i64| match wrap {
        Wrap::Repeat => texels[k.rem_euclid(4) as usize],
        Wrap::Mirror => {
            texels
                [(if k.rem_euclid(8) < 4 { k.rem_euclid(4) } else { 3 - k.rem_euclid(4) }) as usize]
        }
        Wrap::Clamp => texels[k.clamp(0, 3) as usize],
        Wrap::Nothing if (0..4).contains(&k) => texels[k as usize],
        // The material's own colour.
        Wrap::Nothing => 1.0,
    };
    for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp, Wrap::Nothing] {
        let mapping = Mapping {
            scale: DVec2::new(3.0, 1.0),
            offset: DVec2::new(-1.0, 0.0),
            wrap: [wrap, Wrap::Clamp],
            ..Mapping::default()
        };
        let material = mapped("color", map(&row, mapping), unlit());
        let image = spans(made(&[(floor(6.0), material)]), &above(12.0, 12));
        let [red, ..] = colors(&image, TextureFilter::Nearest);
        for x in 0..12 {
            let wanted: f32 = expected(wrap, x as i64 - 4);
            assert!((red[6 * 12 + x] - wanted).abs() < 1e-6, "{wrap:?} {x}: {}", red[6 * 12 + x]);
        }
    }
}

#[test]
fn beside_a_picture_every_map_changes_nothing() {
    // What a map says where it is, and that the rest of the surface is as without one.
    let red = painted("beside.exr", 8, 8, |_, _| [0.5, 0.2, 0.1, 1.0]);
    let mapping = Mapping {
        scale: DVec2::splat(4.0),
        offset: DVec2::splat(-1.5),
        wrap: [Wrap::Nothing; 2],
        ..Mapping::default()
    };
    let shiny = Material {
        finish: Finish {
            gloss: Gloss::Microfacets { roughness: 0.4, metal: 0.5, reflectance: 0.04 },
            glow: Color::grey(0.1),
            ..Finish::default()
        },
        ..Material::default()
    };
    let blend = Material { alpha: 0.6, alpha_mode: AlphaMode::Blend, ..shiny.clone() };
    let mask = Material { alpha_mode: AlphaMode::Mask(0.5), ..shiny.clone() };
    let picture = |material: Material| {
        let image = spans(made(&[(floor(6.0), material)]), &above(12.0, 24));
        let light =
            illuminate(vec![sun(v(-0.4, -0.8, 0.1), Color::WHITE)], Color::grey(0.3), Color::BLACK);
        let lit = image.shaded(Arc::new(light)).unwrap();
        let picture = shown(&lit, TextureFilter::default(), &[Channel::Color]).unwrap();
        ["R", "G", "B", "A"].map(|name| picture.float(name).unwrap().to_vec())
    };
    let names = ["color", "alpha", "normal", "bump", "metallic_roughness", "occlusion", "emission"];
    for (kind, material) in [("opaque", shiny), ("blend", blend), ("mask", mask)] {
        let bare = picture(material.clone());
        for name in names {
            let mapped = picture(mapped(name, map(&red, mapping), material.clone()));
            let differs = |x: usize, y: usize| {
                let at = y * 24 + x;
                (0..4).any(|k| (mapped[k][at] - bare[k][at]).abs() > 1e-5)
            };
            for (x, y) in [(1, 1), (12, 2), (3, 12), (22, 22)] {
                assert!(!differs(x, y), "{kind} {name} {x} {y}");
            }
            // Heights of one colour are flat but for their border; what is opaque has no alpha.
            let is_still = name == "bump" || (name == "alpha" && kind == "opaque");
            assert_eq!(differs(12, 12), !is_still, "{kind} {name}");
        }
    }
}

#[test]
fn masks_are_whole_or_nothing_at_their_threshold() {
    // The same grey as a colour's alpha and as a picture of alpha.
    for (grey, alpha, from, there) in [
        (1.0f32, 1.0, 1.0, 1.0),
        (0.99, 1.0, 1.0, 0.0),
        (1.0, 0.4, 0.5, 0.0),
        (1.0, 0.4, 0.4, 1.0),
        (0.5, 1.0, 0.9, 0.0),
        (0.5, 1.0, 0.1, 1.0),
        (0.3, 1.0, 0.02, 1.0),
        (0.0, 1.0, 0.02, 0.0),
        (0.0, 1.0, 0.0, 1.0),
        (1.0, 1.0, 0.98, 1.0),
    ] {
        let name = format!("mask{grey}.exr");
        let by_color = painted(&name, 8, 8, |_, _| [grey; 4]);
        let by_grey = painted(&format!("grey{grey}.exr"), 8, 8, |_, _| [grey, grey, grey, 1.0]);
        for (what, path) in [("color", &by_color), ("alpha", &by_grey)] {
            for pixels in [2, 8, 40, 200] {
                let mask = Material { alpha, alpha_mode: AlphaMode::Mask(from), ..unlit() };
                let material = mapped(what, map(path, Mapping::default()), mask);
                let image = spans(made(&[(floor(6.0), material)]), &above(8.0, pixels));
                let picture = shown(&image, TextureFilter::default(), &[Channel::Color]).unwrap();
                let seen = picture.float("A").unwrap();
                let off = seen.iter().map(|a| (a - there).abs()).fold(0.0, f32::max);
                assert!(off < 1e-5, "{what} {grey} x {alpha} from {from}, {pixels}: {off}");
            }
        }
    }
}

#[test]
fn cut_outs_cover_their_area_and_cast_shadows_of_their_shape() {
    // A disc, in a picture much finer and much coarser than the pixels.
    for (texels, name) in [(512u32, "disc512.exr"), (64, "disc64.exr")] {
        let disc = painted(name, texels, texels, |x, y| {
            let half = texels as f32 / 2.0;
            let (x, y) = ((x as f32 + 0.5 - half) / half, (y as f32 + 0.5 - half) / half);
            // Soft over three texels, half at the border: 0.8.
            let alpha = (0.5 + (0.8 - x.hypot(y)) * half / 3.0).clamp(0.0, 1.0);
            [alpha, alpha, alpha, alpha]
        });
        let area = std::f64::consts::PI * 0.64 * 4.0;
        for mode in [AlphaMode::Mask(0.5), AlphaMode::Blend] {
            let material = Material { alpha_mode: mode, ..unlit() };
            let material = mapped("color", map(&disc, Mapping::default()), material);
            let raised = floor(2.0).map(|p| p * 0.5 + v(0.0, 1.0, 0.0));
            let white = Material { color: Color::WHITE, ..Material::default() };
            let parts = [(raised, material), (floor(9.0), white)];
            for pixels in [48, 200] {
                let alone = spans(made(&parts[..1]), &above(4.0, pixels));
                let picture = shown(&alone, TextureFilter::default(), &[Channel::Color]).unwrap();
                let pixel = 16.0 / f64::from(pixels * pixels);
                let covered: f64 =
                    picture.float("A").unwrap().iter().map(|a| f64::from(*a) * pixel).sum();
                assert!(
                    (covered / (area / 4.0 * 1.0) - 1.0).abs() < 0.01,
                    "{mode:?} {texels} {pixels}: {covered}"
                );
            }
            // The shadow of a low sun lies beside it, twice as long.
            let image = spans(made(&parts), &above(12.0, 120));
            let dark = |shadows: Shadows| {
                let light = illuminate(
                    vec![sun(v(0.8, -0.2, 0.0), Color::WHITE)],
                    Color::BLACK,
                    Color::BLACK,
                );
                let lit = image.shaded(Arc::new(Illuminate { shadows, ..light })).unwrap();
                let [red, ..] = colors(&lit, TextureFilter::default());
                let open = 0.2 / 0.68f32.sqrt();
                // Only where the floor is seen and the shadow may be.
                let of_row = |y: usize| (75..120).map(move |x| y * 120 + x);
                let missing: f32 = (0..120).flat_map(of_row).map(|at| 1.0 - red[at] / open).sum();
                f64::from(missing) * 0.01
            };
            let by_volumes = dark(Shadows::Volumes);
            assert!(
                (by_volumes / (area / 4.0) - 1.0).abs() < 0.02,
                "{mode:?} {texels}: {by_volumes}"
            );
            let by_rays = dark(Shadows::Rays(16));
            assert!(
                (by_rays / by_volumes - 1.0).abs() < 0.02,
                "{mode:?} {texels}: {by_rays} {by_volumes}"
            );
        }
    }
}

/// What a floor with a map shows in a light from the side, at its middle, and the same floor leaning.
fn lit_floor(material: Material, corners: [DVec3; 4], from: DVec3) -> f32 {
    let image = spans(made(&[(corners, material)]), &above(1.0, 8));
    let light = illuminate(vec![sun(-from, Color::WHITE)], Color::BLACK, Color::BLACK);
    let lit = image.shaded(Arc::new(light)).unwrap();
    colors(&lit, TextureFilter::default())[0][4 * 8 + 4]
}

#[test]
fn normals_and_heights_light_a_floor_as_if_it_leant() {
    let white = || Material { color: Color::WHITE, ..Material::default() };
    let lambert = |normal: DVec3, from: DVec3| normal.normalize().dot(from.normalize()) as f32;
    for from in [v(1.0, 2.0, 0.0), v(0.0, 2.0, -1.0), v(-1.0, 1.0, 0.5)] {
        // Leaning to the picture's right and top: +x and -z.
        let code = |n: f64| (n / 2.0 + 0.5) as f32;
        let [x, y, z] = [0.48, 0.36, 0.8];
        let leaning = painted("normal.exr", 4, 4, |_, _| [code(x), code(y), code(z), 1.0]);
        for (mapping, normal) in [
            (Mapping::default(), v(x, z, -y)),
            // The picture turned to the left: its right is the floor's back.
            (Mapping { turn: 90.0, ..Mapping::default() }, v(-y, z, -x)),
            // Mirrored: its right is the floor's left.
            (Mapping { scale: DVec2::new(-1.0, 1.0), ..Mapping::default() }, v(-x, z, -y)),
        ] {
            let seen =
                lit_floor(mapped("normal", map(&leaning, mapping), white()), floor(2.0), from);
            assert!((seen - lambert(normal, from)).abs() < 1e-4, "{mapping:?} {from}: {seen}");
        }
        // A ramp of 3 m over a floor 4 m wide, up to the right.
        let ramp = painted("height.exr", 64, 4, |x, _| [(x as f32 + 0.5) / 64.0; 4]);
        let bump = Map { strength: 3.0, ..map(&ramp, Mapping::default()) };
        let seen = lit_floor(mapped("bump", bump, white()), floor(2.0), from);
        assert!((seen - lambert(v(-0.75, 1.0, 0.0), from)).abs() < 1e-3, "{from}: {seen}");
    }
}

#[test]
fn waves_have_the_slopes_of_a_cosine_and_vanish_far_away() {
    // Three waves to the right over 4 m, 0.1 m high: in the middle they are half way.
    let wave = |count: f64| Map {
        picture: Picture::Wave(count, 0.0),
        strength: 0.1,
        mapping: Mapping { offset: DVec2::new(0.25 / count, 0.0), ..Mapping::default() },
    };
    let white = Material { color: Color::WHITE, ..Material::default() };
    let from = v(1.0, 1.0, 0.0);
    let slope = 0.05 * std::f64::consts::TAU * 3.0 / 4.0;
    let lambert = v(-slope, 1.0, 0.0).normalize().dot(from.normalize()) as f32;
    let seen = lit_floor(mapped("bump", wave(3.0), white.clone()), floor(2.0), from);
    // A pixel beside the middle of the view, of which each is an eighth of a metre.
    assert!((seen - lambert).abs() < 0.02, "{seen} {lambert}");
    let flat = (0.5f32).sqrt();
    for count in [200.3, 5_000.7] {
        let seen = lit_floor(mapped("bump", wave(count), white.clone()), floor(2.0), from);
        assert!((seen - flat).abs() < 0.02, "{count}: {seen}");
    }
}

#[test]
fn mirrors_show_pictures_by_what_their_rays_stand_for() {
    // A fine checker over a mirror: its reflection is as grey as itself seen from as far.
    let checker = painted("fine.exr", 128, 128, |x, y| {
        let on = f32::from(u8::from((x + y) % 2 == 0));
        [on, on, on, 1.0]
    });
    let ceiling = floor(30.0).map(|p| v(p.x, 4.0, -p.z));
    let fine = Mapping { scale: DVec2::splat(9.0), ..Mapping::default() };
    let optics = Some(Optics { fresnel: false, ..Optics::default() });
    let mirror = Material { finish: Finish { optics, ..Finish::default() }, ..unlit() };
    let ceiling = (ceiling, mapped("color", map(&checker, fine), unlit()));
    let camera =
        Camera { position: v(0.0, 3.0, 5.0), look_at: v(0.0, 0.0, 0.0), ..Camera::default() };
    let image = spans(made(&[(floor(3.0), mirror), ceiling]), &view(&camera, 60, 40));
    let shader = Trace {
        rays: 1,
        depth: 2,
        least: 1e-3,
        background: Color::grey(0.5),
        sky: None,
        accelerator: Accelerator::Tree,
    };
    let traced = image.shaded(Arc::new(shader)).unwrap();
    let [red, ..] = colors(&traced, TextureFilter::Anisotropic(16));
    let [rough, ..] = colors(&traced, TextureFilter::Nearest);
    let off = |values: &[f32]| {
        let middle = (15..28).flat_map(|y| (20..40).map(move |x| y * 60 + x));
        middle.map(|at| (values[at] - 0.5).abs()).fold(0.0, f32::max)
    };
    assert!(off(&red) < 0.1, "{}", off(&red));
    assert!(off(&rough) > 0.4, "{}", off(&rough));
}

#[test]
fn reflection_maps_are_filtered_by_what_a_curved_mirror_gathers() {
    // A ball that mirrors a panorama of fine noise, against the mean of 8 x 8 times the pixels.
    painted("around.exr", 512, 256, |x, y| {
        let on = (x / 2 * 7919 + y / 2 * 104_729) % 97;
        [on as f32 / 96.0, f32::from(u8::from(x < 256)), 0.0, 1.0]
    });
    let path = scratch("ball.ron");
    let text = r#"Scene(version: 1,
        materials: {"mirror": (color: 0, maps: {"reflection": (picture: File("around.exr"))})},
        plans: [(name: "ball", root: (material: "mirror", shape: Sphere(radius: 1, segments: 128)))])"#;
    std::fs::write(&path, text).unwrap();
    let scene = Arc::new(read::scene(&path, None, "ball", &read::ReadOptions::default()).unwrap());
    let shown = |pixels: u32, filter: TextureFilter| {
        let camera = Camera {
            position: v(0.0, 0.8, 6.0),
            look_at: DVec3::ZERO,
            field_of_view: 14.0,
            ..Camera::default()
        };
        let image = spans(scene.clone(), &view(&camera, pixels, pixels));
        let lights = illuminate(vec![], Color::BLACK, Color::BLACK);
        colors(&image.shaded(Arc::new(lights)).unwrap(), filter)
    };
    let fine = shown(240, TextureFilter::Anisotropic(8));
    let error = |filter: TextureFilter| {
        let [red, green, _] = shown(30, filter);
        let mean = |channel: &[f32], x: usize, y: usize| {
            let all = (0..64).map(|k| channel[(y * 8 + k / 8) * 240 + x * 8 + k % 8]);
            all.sum::<f32>() / 64.0
        };
        let middle = (6..24).flat_map(|y| (6..24).map(move |x| (x, y)));
        let squares = middle.map(|(x, y)| {
            let at = y * 30 + x;
            (red[at] - mean(&fine[0], x, y)).powi(2) + (green[at] - mean(&fine[1], x, y)).powi(2)
        });
        (squares.sum::<f32>() / 324.0).sqrt()
    };
    let (filtered, nearest) = (error(TextureFilter::Anisotropic(8)), error(TextureFilter::Nearest));
    assert!(nearest > 0.4 && filtered < 0.1, "{filtered} {nearest}");
}

/// A square of red, green, blue and alpha.
fn bytes(size: u32, bytes: Vec<u8>) -> Texels {
    let (size, codes, coding) = ((size, size), Codes::Bytes(bytes), Coding::srgb());
    Texels::coded(Coded { size, layout: Layout::Rgba, codes, coding })
}

#[test]
fn more_pictures_than_the_limit_allows_are_shown_all_the_same() {
    let size = 64u32;
    let source = |number: u32| PictureSource {
        key: Key::of(&("picture", number)),
        meaning: Meaning::Color,
        read: Box::new(move || {
            let texels =
                (0..size * size).flat_map(|at| [((at * (number + 3)) % 251) as u8; 4]).collect();
            Ok(bytes(size, texels))
        }),
    };
    let sources: Vec<PictureSource> = (0..24).map(source).collect();
    let see = |store: &Store, source: &PictureSource, width: f64, k: u32| {
        let opened = store.open(source).unwrap();
        let at = DVec2::new(f64::from(k * 7 % 64) + 0.2, f64::from(k * 11 % 64) + 0.7) / 64.0;
        let right = DVec2::new(width / 64.0, 0.0);
        let footprint = Footprint { at, right, down: DVec2::new(0.0, -width / 64.0) };
        footprint.see(&opened, TextureFilter::Trilinear, [Wrap::Repeat; 2]).unwrap()
    };
    let picture = size as usize * size as usize * 4;
    let run = |limit: usize| {
        let store = Store::new(limit);
        let mut seen = Vec::new();
        for k in 0..200 {
            let source = &sources[(k * 5 % 24) as usize];
            seen.push(see(&store, source, f64::from(1 << (k % 5)), k));
        }
        (seen, store.report())
    };
    let (all, StoreReport { most, reads, .. }) = run(usize::MAX);
    assert!(most > 20 * picture && reads == 24, "{most} {reads}");
    for limit in [4 * picture, picture / 2 * 3, picture / 4] {
        let (seen, StoreReport { most, reads, .. }) = run(limit);
        assert_eq!(seen, all);
        // A level that is asked for is held, however large, and what is coarser with it.
        assert!(most <= limit.max(picture / 2 * 3), "{most} of {limit}");
        assert!(reads > 24);
    }
}

#[test]
fn what_is_far_away_takes_little_memory() {
    let store = Store::new(1 << 16);
    let size = 512u32;
    let source = PictureSource {
        key: Key::of("large"),
        meaning: Meaning::Color,
        read: Box::new(move || Ok(bytes(size, [90, 120, 150, 255].repeat((size * size) as usize)))),
    };
    let opened = store.open(&source).unwrap();
    for k in 0..50 {
        let right = DVec2::new(1.0 / 32.0, 0.0);
        let down = DVec2::new(0.0, 1.0 / 32.0);
        let at = DVec2::splat(f64::from(k) / 50.0);
        Footprint { at, right, down }
            .see(&opened, TextureFilter::Trilinear, [Wrap::Clamp; 2])
            .unwrap();
    }
    let StoreReport { most, reads, .. } = store.report();
    assert!(most < 1 << 16 && reads <= 2, "{most} {reads}");
}
