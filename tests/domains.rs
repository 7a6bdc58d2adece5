//! Attribute mapping: domains by functions and pictures, each shaded by its bundle, blended by area.

use glam::{DVec2, DVec3, dvec3 as v};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::{Color, decode_srgb};
use spandrel_engine::fragment::{Finish, Gloss, Optics};
use spandrel_engine::image::{Channel, Image, Samples, Window, file};
use spandrel_engine::key::Key;
use spandrel_engine::raster::Raster;
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, Rate, Rule, resolve};
use spandrel_engine::scene::{
    AlphaMode, Define, Document, Domains, Face, Material, Mesh, Object, Plan, Scene, Shape, Sides,
};
use spandrel_engine::shade::{Illuminate, Shadows, Stream, Trace};
use spandrel_engine::span::SpanImage;
use spandrel_engine::texture::{By, Mapping};
use spandrel_engine::trace::Accelerator;
use spandrel_tests::graphs::Nodes;
use spandrel_tests::lights::{illuminate, sun};
use spandrel_tests::program::Scratch;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

const RULE: Rule = Rule::Sloped(4);

/// Domains as a scene file says them.
fn domains(define: Define, mapping: Mapping, table: &[(u8, &str)]) -> Domains {
    let table = table.iter().map(|(index, name)| (index, (*name).to_owned()));
    let table: BTreeMap<&u8, String> = table.collect();
    let parts = serde_json::json!({ "define": define, "mapping": mapping, "table": table });
    serde_json::from_value(parts).unwrap()
}

/// A floor between -h and h of a material called "floor", beside others.
fn floor(h: f64, materials: &[(&str, Material)]) -> Result<Arc<Scene>, String> {
    let mut mesh = Mesh::default();
    let corners = [v(-h, 0.0, h), v(h, 0.0, h), v(h, 0.0, -h), v(-h, 0.0, -h)];
    let outline = corners.iter().map(|p| mesh.add_point(*p)).collect();
    let sides = Sides { front: Some(0), ..Sides::default() };
    mesh.add_face(Face { outline, sides, ..Face::default() }).unwrap();
    mesh.materials.push("floor".to_owned());
    let root = Object::new("mesh", Shape::Faces(mesh));
    let mut document = Document::with_plan(Plan { root, ..Plan::default() });
    for (name, material) in materials {
        document.materials.insert((*name).to_owned(), material.clone());
    }
    let key = Key::of(&document);
    Scene::new(&document, None, "scene", key, Path::new(""))
        .map(Arc::new)
        .map_err(|e| e.to_string())
}

fn unlit(color: Color) -> Material {
    Material { color, unlit: true, ..Material::default() }
}

fn red() -> Material {
    unlit(Color::new(1.0, 0.0, 0.0))
}

fn green() -> Material {
    unlit(Color::new(0.0, 1.0, 0.0))
}

fn divided(define: Define, length: f64, table: &[(u8, &str)]) -> Material {
    let mapping = Mapping { by: By::Y, length: DVec2::splat(length), ..Mapping::default() };
    Material { domains: Some(domains(define, mapping, table)), ..Material::default() }
}

/// Straight down on a square around the origin.
fn above(side: f64, pixels: u32) -> View {
    let camera = Camera {
        position: v(0.0, 10.0, 0.0),
        look_at: DVec3::ZERO,
        up: v(0.0, 0.0, -1.0),
        parallel_height: Some(side),
        ..Camera::default()
    };
    View::new(&camera, Raster::new(pixels, pixels).unwrap()).unwrap()
}

fn spans(scene: &Arc<Scene>, view: &View) -> SpanImage {
    let rows = 0..view.raster().height;
    scanline::render(&[scene.clone().into()], view, RULE.plan().unwrap(), rows).unwrap()
}

fn shown(image: &SpanImage) -> Result<Image, String> {
    shown_by(image, Rate::Pixel)
}

fn shown_by(image: &SpanImage, shading: Rate) -> Result<Image, String> {
    let framing = Framing::scaled(image.view().raster(), DVec2::ONE).unwrap();
    let framing = Framing { shading, ..framing };
    resolve(image, RULE, &framing, &BTreeSet::from([Channel::Color])).map_err(|e| e.to_string())
}

fn mean(image: &Image) -> [f32; 4] {
    let count = image.window.area() as f32;
    let mut sum = [0.0; 4];
    for pixel in image.pixels() {
        sum.iter_mut().zip(pixel).for_each(|(sum, v)| *sum += v / count);
    }
    sum
}

/// A grey picture whose bytes are indices.
fn pattern(name: &str, size: u32, index: impl Fn(u32, u32) -> u8) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/domains");
    std::fs::create_dir_all(&folder).unwrap();
    let path: PathBuf = folder.join(name);
    let mut image = Image::new((size, size), Window::whole(size, size));
    let values: Vec<f32> = (0..size * size)
        .map(|at| decode_srgb(f32::from(index(at % size, at / size)) / 255.0))
        .collect();
    for name in ["R", "G", "B"] {
        image.insert(name, Samples::Float(values.clone())).unwrap();
    }
    image.insert("A", Samples::Float(vec![1.0; values.len()])).unwrap();
    file::write(&image, &path, Some(8)).unwrap();
    path.to_string_lossy().into_owned()
}

#[test]
fn domains_cover_their_area_and_are_never_mixed_near_by() {
    let table = [(0, "red"), (1, "green")];
    let cases = [
        (Define::Checker, 0.5),
        (Define::Tiled(0.25), 1.0 - 0.5625),
        (Define::Bricked(0.25), 1.0 - 0.5625),
    ];
    for (define, share) in cases {
        let materials =
            [("floor", divided(define.clone(), 2.0, &table)), ("red", red()), ("green", green())];
        let scene = floor(8.0, &materials).unwrap();
        // From near every pixel is one domain or the other, but on borders; from far their mean.
        let near = shown(&spans(&scene, &above(4.0, 64))).unwrap();
        let pure = near.pixels().filter(|p| p[0] > 0.999 || p[1] > 0.999).count();
        assert!(pure > 64 * 64 * 3 / 4, "{define:?}: {pure}");
        assert!(near.pixels().all(|p| (p[0] + p[1] - 1.0).abs() < 1e-5 && p[3] > 0.99999));
        assert!((mean(&near)[0] - share).abs() < 0.01, "{define:?}: {:?}", mean(&near));
        let far = shown(&spans(&scene, &above(16.0, 2))).unwrap();
        assert!(far.pixels().all(|p| (p[0] - share).abs() < 0.04), "{define:?}");
    }
}

#[test]
fn trigger_patterns_divide_by_area_at_every_distance() {
    let stone = pattern("stone.png", 64, |x, y| match (x / 8 + y / 8 * 3) % 5 {
        0 => 7,
        1 | 2 => 20,
        _ => 200,
    });
    let shares = [(7u8, 0.2f32), (20, 0.4), (200, 0.4)];
    let blue = unlit(Color::new(0.0, 0.0, 1.0));
    let table = [(7, "red"), (20, "green"), (200, "blue")];
    let material = divided(Define::Picture(stone), 2.0, &table);
    let materials = [("floor", material), ("red", red()), ("green", green()), ("blue", blue)];
    let scene = floor(8.0, &materials).unwrap();
    for (side, pixels, within) in
        [(1.0, 64, 0.02), (4.0, 64, 0.02), (16.0, 16, 0.03), (16.0, 2, 0.03)]
    {
        let picture = shown(&spans(&scene, &above(side, pixels))).unwrap();
        assert!(picture.pixels().all(|p| (p[0] + p[1] + p[2] - 1.0).abs() < 1e-4));
        for (k, (index, share)) in shares.iter().enumerate() {
            if side >= 4.0 {
                let seen = mean(&picture)[k];
                assert!((seen - share).abs() < within, "{index} of {pixels}: {seen}");
            }
        }
        let pure = picture.pixels().filter(|p| p[..3].iter().any(|v| *v > 0.999)).count();
        assert!(side > 1.0 || pure as u32 > pixels * pixels * 9 / 10, "{pure}");
    }
}

#[test]
fn every_bundle_is_shaded_by_its_own_model() {
    // What is divided shows, domain by domain, what a floor of the bundle alone shows there.
    let shiny = Material {
        color: Color::new(0.2, 0.1, 0.1),
        finish: Finish { gloss: Gloss::Phong { share: 0.5, exponent: 20.0 }, ..Finish::default() },
        ..Material::default()
    };
    let matt = Material { color: Color::new(0.1, 0.5, 0.2), ..Material::default() };
    let optics = Optics { reflect: Color::grey(0.8), fresnel: false, ..Optics::default() };
    let finish = Finish { optics: Some(optics), ..Finish::default() };
    let mirror = Material { color: Color::BLACK, finish, ..Material::default() };
    let table = [(0, "a"), (1, "b")];
    let camera = Camera {
        position: v(0.0, 4.0, 7.0),
        look_at: DVec3::ZERO,
        field_of_view: 30.0,
        ..Camera::default()
    };
    let view = View::new(&camera, Raster::new(48, 36).unwrap()).unwrap();
    let lit = |scene: &Arc<Scene>, shadows: Shadows, rate: Rate| {
        let light =
            illuminate(vec![sun(v(0.3, -0.7, -0.9), Color::WHITE)], Color::grey(0.2), Color::BLACK);
        let image = spans(scene, &view).shaded(Arc::new(Illuminate { shadows, ..light })).unwrap();
        let trace = Trace {
            rays: 1,
            depth: 2,
            least: 1e-6,
            background: Color::new(0.3, 0.4, 0.6),
            sky: None,
            accelerator: Accelerator::Tree,
        };
        shown_by(&image.shaded(Arc::new(trace)).unwrap(), rate).unwrap()
    };
    for (a, b) in [(&shiny, &matt), (&mirror, &matt), (&mirror, &shiny)] {
        for (shadows, rate) in [(Shadows::Volumes, Rate::Pixel), (Shadows::Rays(1), Rate::Line)] {
            let plain = |material: &Material| {
                lit(&floor(3.0, &[("floor", material.clone())]).unwrap(), shadows, rate)
            };
            let materials = [
                ("floor", divided(Define::Checker, 3.0, &table)),
                ("a", a.clone()),
                ("b", b.clone()),
            ];
            let both = lit(&floor(3.0, &materials).unwrap(), shadows, rate);
            let (first, second) = (plain(a), plain(b));
            let (mut of_first, mut of_second, mut between) = (0, 0, 0);
            for ((p, q), r) in both.pixels().zip(first.pixels()).zip(second.pixels()) {
                let off = |x: [f32; 4]| (0..4).map(|k| (p[k] - x[k]).abs()).fold(0.0, f32::max);
                let is_within =
                    (0..3).all(|k| p[k] >= q[k].min(r[k]) - 1e-4 && p[k] <= q[k].max(r[k]) + 1e-4);
                assert!(is_within, "{p:?} {q:?} {r:?}");
                match (off(q) < 1e-5, off(r) < 1e-5) {
                    (true, false) => of_first += 1,
                    (false, true) => of_second += 1,
                    (false, false) => between += 1,
                    _ => {}
                }
            }
            assert!(of_first > 200 && of_second > 200, "{of_first} {of_second} {between}");
            assert!(between < of_first + of_second, "{between}");
        }
    }
}

#[test]
fn programs_know_materials_by_name_and_bundles_are_materials() {
    let dark = unlit(Color::grey(0.2));
    let table = [(0, "red brick"), (1, "grout")];
    let materials = [
        ("floor", divided(Define::Checker, 2.0, &table)),
        ("red brick", dark.clone()),
        ("grout", dark),
    ];
    let scene = floor(3.0, &materials).unwrap();
    let code = "color = material('red*') ? [1, 0, 0] : material('grout') ? [0, 1, 0] : [0, 0, 1];";
    let stream = Stream::new(code, BTreeMap::new(), BTreeMap::new()).unwrap();
    let by_name = shown(&spans(&scene, &above(3.0, 64)).shaded(Arc::new(stream)).unwrap());
    let materials = [
        ("floor", divided(Define::Checker, 2.0, &table)),
        ("red brick", red()),
        ("grout", green()),
    ];
    let plain = shown(&spans(&floor(3.0, &materials).unwrap(), &above(3.0, 64)));
    let (by_name, plain) = (by_name.unwrap(), plain.unwrap());
    for (a, b) in by_name.pixels().zip(plain.pixels()) {
        assert!((0..4).all(|k| (a[k] - b[k]).abs() < 1e-6), "{a:?} {b:?}");
    }
    assert!(plain.pixels().any(|p| p[0] == 1.0) && plain.pixels().any(|p| p[1] == 1.0));
}

#[test]
fn mirrors_show_domains_and_tables_without_an_index_are_told() {
    let bad = |define: Define, table: &[(u8, &str)], cure: &str| {
        let materials =
            [("floor", divided(define, 2.0, table)), ("red", red()), ("green", green())];
        let error = floor(2.0, &materials).err().unwrap_or_else(|| panic!("{cure}"));
        assert!(error.contains(cure) && error.contains("floor"), "{error}");
    };
    bad(Define::Checker, &[(0, "red")], "no attribute index 1");
    bad(Define::Tiled(1.5), &[(0, "red"), (1, "red")], "a joint of 1.5");
    bad(Define::Checker, &[(0, "red"), (1, "blue")], "no material \"blue\"");
    bad(Define::Checker, &[(0, "red"), (1, "floor")], "has domains itself");
    bad(Define::Picture(String::new()), &[(0, "red")], "names no file");
    let glass = Material {
        alpha_mode: AlphaMode::Blend,
        ..divided(Define::Checker, 2.0, &[(0, "red"), (1, "green")])
    };
    let materials = [("floor", glass), ("red", red()), ("green", green())];
    assert!(floor(2.0, &materials).unwrap_err().contains("give them the alpha_mode"));
    // An index that only the picture knows.
    let stray = pattern("stray.png", 8, |x, y| if (x, y) == (3, 5) { 9 } else { 1 });
    let material = divided(Define::Picture(stray.clone()), 2.0, &[(1, "red")]);
    let scene = floor(2.0, &[("floor", material), ("red", red())]).unwrap();
    let error = shown(&spans(&scene, &above(2.0, 8))).unwrap_err();
    assert!(
        error.contains("pixel 3, 5 has attribute index 9") && error.contains(&stray),
        "{error}"
    );
    let material = divided(Define::Picture("no such.png".into()), 2.0, &[(1, "red")]);
    let scene = floor(2.0, &[("floor", material), ("red", red())]).unwrap();
    assert!(shown(&spans(&scene, &above(2.0, 8))).unwrap_err().contains("no such.png"));
}

#[test]
fn bundles_may_let_light_through() {
    // Squares of red beside squares that are cut away, or of which a quarter is there: seen, half of a floor is red.
    let table: &[(u8, &str)] = &[(0, "gone"), (1, "red")];
    let gone = Material { alpha: 0.0, alpha_mode: AlphaMode::Mask(0.5), ..green() };
    let thin = Material { alpha: 0.25, alpha_mode: AlphaMode::Blend, ..green() };
    for (other, expected) in
        [(gone.clone(), [0.5, 0.0, 0.0, 0.5]), (thin, [0.5, 0.125, 0.0, 0.625])]
    {
        let materials =
            [("floor", divided(Define::Checker, 0.5, table)), ("gone", other), ("red", red())];
        let scene = floor(2.0, &materials).unwrap();
        let seen = mean(&shown(&spans(&scene, &above(2.0, 24))).unwrap());
        assert!(seen.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-3), "{seen:?}");
    }
    // Its shadow has the same holes: half of the light of a sun straight above arrives on what lies below.
    let folder = Scratch::new("bundles_may_let_light_through");
    let scene = r#"Scene(materials: {
            "roof": (domains: (define: Checker, mapping: (by: Y, length: (0.5, 0.5)), table: {0: "gone", 1: "red"})),
            "gone": (alpha: 0, alpha_mode: Mask(0.5)), "red": (color: (1, 0, 0)), "white": (color: 1),
        }, plans: [(name: "p", root: (children: [
            (material: "roof", shape: Polygon(outline: [(-2, 0, 2), (2, 0, 2), (2, 0, -2), (-2, 0, -2)])),
            (material: "white", shape: Polygon(outline: [(-1, -1, 1), (1, -1, 1), (1, -1, -1), (-1, -1, -1)])),
        ]))])"#;
    std::fs::write(folder.path().join("s.ron"), scene).unwrap();
    for shadows in ["Volumes", "Rays(16)"] {
        let nodes = format!(
            r#""eye": Camera(position: (0, -0.5, 0), look_at: (0, -2, 0), up: (0, 0, -1), parallel_height: 2),
            "s": Scanline(scene: "s.ron", camera: "eye"), "sun": ParallelLight(direction: (0, -1, 0)),
            "lit": Illuminate(image: "s", lights: ["sun"], ambient: 0, white: 1, shadows: {shadows}),
            "p": Resolve(image: "lit", size: (32, 32), lines: Sloped(4))"#
        );
        let made = Nodes::new(folder.path(), &nodes).picture("p", None).unwrap();
        let [seen, ..] = mean(&made.image);
        assert!((seen - 0.5).abs() < 0.02, "{shadows}: {seen}");
    }
}

#[test]
fn a_table_may_have_all_indices_that_a_byte_has() {
    let path = pattern("all.png", 16, |x, y| (x + 16 * y) as u8);
    let names: Vec<String> = (0..=255u8).map(|i| format!("m{i}")).collect();
    let table: Vec<(u8, &str)> = (0..=255).zip(names.iter().map(String::as_str)).collect();
    let grey = |i: usize| unlit(Color::grey(i as f32 / 255.0));
    let mut materials = vec![("floor", divided(Define::Picture(path), 2.0, &table))];
    materials.extend(names.iter().enumerate().map(|(i, name)| (name.as_str(), grey(i))));
    let scene = floor(1.0, &materials).unwrap();
    let seen = shown(&spans(&scene, &above(2.0, 16))).unwrap();
    let mut values: Vec<u32> = seen.pixels().map(|[r, ..]| (r * 255.0).round() as u32).collect();
    values.sort_unstable();
    assert!(values.iter().copied().eq(0..256), "{values:?}");
}
