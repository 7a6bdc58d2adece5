//! Attribute mapping against ordinary texture mapping of the same surface ([D]: "more efficiently than ordinary texture
//! mapping for surfaces with complex textures"): granite of three minerals, as a trigger pattern and a table, and as
//! maps of colour, roughness and normals. True is what sixteen hard-edged samples to a pixel show.
//! `cargo run --release -p spandrel-tests --example attribute`.

use glam::{DVec2, dvec3 as v};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::image::{Channel, Image, Samples, Window, file};
use spandrel_engine::math;
use spandrel_engine::picture::Reformat;
use spandrel_engine::raster::Raster;
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::scene::read::{self, ReadOptions};
use spandrel_engine::shade::{Illuminate, Shadows};
use spandrel_engine::stream::noise;
use spandrel_engine::texture::{TextureFilter, store};
use spandrel_tests::lights::{illuminate, sun};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::time::Instant;

const RULE: Rule = Rule::Sloped(4);

/// Texels along a side of the pattern, and metres that it covers.
const SIDE: u32 = 2048;
const METRES: f64 = 2.0;

/// Of each mineral, its name, colour and roughness.
const MINERALS: [(&str, [f32; 3], f32); 3] = [
    ("mica", [0.03, 0.03, 0.035], 0.25),
    ("feldspar", [0.45, 0.22, 0.16], 0.8),
    ("quartz", [0.7, 0.68, 0.64], 0.12),
];

/// Waves of the quartz over the pattern, to the right and up, and how high they are, in metres.
const WAVES: [f64; 2] = [9.0, 7.0];
const HEIGHT: f64 = 0.02;

/// The mineral at a texel.
fn mineral(x: u32, y: u32) -> usize {
    let at = [x as f32 / 40.0, y as f32 / 40.0, 0.5];
    let [_, _, whose] = noise::voronoi(at, 1.0);
    match whose {
        w if w < 0.2 => 0,
        w if w < 0.6 => 1,
        _ => 2,
    }
}

/// A picture of 8 bits, of colours or of numbers as they are.
fn paint(path: &Path, is_color: bool, texel: impl Fn(u32, u32) -> [f32; 3]) {
    let mut picture = Image::new((SIDE, SIDE), Window::whole(SIDE, SIDE));
    let linear = |v: f32| if is_color { v } else { spandrel_engine::color::decode_srgb(v) };
    let texels: Vec<[f32; 3]> =
        (0..SIDE * SIDE).map(|at| texel(at % SIDE, at / SIDE).map(linear)).collect();
    for (axis, name) in ["R", "G", "B"].into_iter().enumerate() {
        let values = texels.iter().map(|texel| texel[axis]).collect();
        picture.insert(name, Samples::Float(values)).expect("as many as there are pixels");
    }
    file::write(&picture, path, Some(8)).expect("a writable folder");
}

fn scene(folder: &Path, is_attribute: bool) -> PathBuf {
    let mapping = format!("(by: Y, length: ({METRES}, {METRES}))");
    let materials = if is_attribute {
        let bundle = |(name, [r, g, b], roughness): &(&str, [f32; 3], f32)| {
            let [right, up] = WAVES;
            let wave = format!("picture: Wave({right}, {up}), strength: {HEIGHT}");
            let bump = format!("\"bump\": ({wave}, mapping: {mapping})");
            let maps = if *name == "quartz" { bump } else { String::new() };
            format!(
                "\"{name}\": (color: ({r}, {g}, {b}), maps: {{{maps}}}, \
                 finish: (gloss: Microfacets(reflectance: 0.04, roughness: {roughness}, metal: 0))),\n"
            )
        };
        let bundles: String = MINERALS.iter().map(bundle).collect();
        format!(
            "\"stone\": (domains: (define: Picture(\"pattern.png\"), mapping: {mapping}, \
             table: {{0: \"mica\", 1: \"feldspar\", 2: \"quartz\"}})),\n{bundles}"
        )
    } else {
        format!(
            "\"stone\": (color: 1, finish: (gloss: Microfacets(reflectance: 0.04, roughness: 1, metal: 0)), maps: {{\n\
             \"color\": (picture: File(\"color.png\"), mapping: {mapping}),\n\
             \"metallic_roughness\": (picture: File(\"rough.png\"), mapping: {mapping}),\n\
             \"normal\": (picture: File(\"normal.png\"), mapping: {mapping})}}),\n"
        )
    };
    let text = format!(
        "Scene(materials: {{{materials}}}, plans: [(name: \"floor\", root: (material: \"stone\", \
         shape: Polygon(outline: [(-20, 0, 4), (20, 0, 4), (20, 0, -60), (-20, 0, -60)])))])"
    );
    let path = folder.join(if is_attribute { "attribute.ron" } else { "ordinary.ron" });
    std::fs::write(&path, text).expect("a writable folder");
    path
}

fn view(name: &str, pixels: u32) -> View {
    let camera = match name {
        "near" => {
            Camera { position: v(0.3, 0.35, 1.0), look_at: v(0.1, 0.0, 0.6), ..Camera::default() }
        }
        _ => Camera { position: v(0.0, 1.6, 4.0), look_at: v(0.0, 0.0, -4.0), ..Camera::default() },
    };
    View::new(&camera, Raster::new(pixels * 4 / 3, pixels).expect("a size")).expect("a camera")
}

fn shown(path: &Path, view: &View, textures: TextureFilter) -> Image {
    let scene = read::scene(path, None, "floor", &ReadOptions::default()).expect("a scene");
    let rows = 0..view.raster().height;
    let plan = RULE.plan().expect("a plan");
    let image = scanline::render(&[Arc::new(scene).into()], view, plan, rows).expect("spans");
    let lamps = vec![sun(v(-0.3, -0.5, -0.6), Color::grey(0.9))];
    let lit = illuminate(lamps, Color::grey(0.25), Color::grey(0.1));
    let lit = Illuminate { shadows: Shadows::Off, ..lit };
    let image = image.shaded(Arc::new(lit)).expect("light");
    let framing = Framing::scaled(view.raster(), DVec2::ONE).expect("a frame");
    let framing = Framing { textures, ..framing };
    resolve(&image, RULE, &framing, &BTreeSet::from([Channel::Color])).expect("pixels")
}

/// The root of the mean square of what two pictures differ by.
fn off(a: &Image, b: &Image) -> f64 {
    let square =
        |(p, q): ([f32; 4], [f32; 4])| (0..3).map(|k| f64::from(p[k] - q[k]).powi(2)).sum::<f64>();
    let count = a.window.area() as f64 * 3.0;
    (a.pixels().zip(b.pixels()).map(square).sum::<f64>() / count).sqrt()
}

fn measure(folder: &Path, method: &str) {
    let path = scene(folder, method == "attribute");
    let mut line = format!("| {method} |");
    for place in ["near", "far"] {
        let start = Instant::now();
        let picture = shown(&path, &view(place, 600), TextureFilter::default());
        let seconds = start.elapsed().as_secs_f64();
        let again = Instant::now();
        let _ = shown(&path, &view(place, 600), TextureFilter::default());
        let second = again.elapsed().as_secs_f64();
        // What is true: sixteen pixels to one, of hard edges.
        let fine = shown(&scene(folder, true), &view(place, 2400), TextureFilter::Exact);
        let all = Reformat {
            size: picture.size,
            part: [0.0, 0.0, 1.0, 1.0],
            keeps_shape: false,
            shift: DVec2::ZERO,
            scale: DVec2::ONE,
            turn: 0.0,
            filter: TextureFilter::Exact,
        };
        let truth = all.apply(&Arc::new(fine)).expect("a picture");
        if std::env::var_os("SHOW").is_some() {
            file::write(&picture, &folder.join(format!("{method} {place}.png")), None)
                .expect("a file");
        }
        line += &format!(" {seconds:.2} s, {second:.2} s | {:.4} |", off(&picture, &truth));
    }
    println!("{line}");
}

fn main() {
    let folder = std::env::temp_dir().join("spandrel-attribute");
    std::fs::create_dir_all(&folder).expect("a writable folder");
    // Itself, alone with one method: what it holds then.
    if let (Some("bytes"), Some(method)) =
        (std::env::args().nth(1).as_deref(), std::env::args().nth(2))
    {
        let path = scene(&folder, method == "attribute");
        for place in ["near", "far"] {
            let _ = shown(&path, &view(place, 600), TextureFilter::default());
        }
        print!("{:.1} MB", store().report().most as f64 / 1e6);
        return;
    }
    let index = |x: u32, y: u32| [mineral(x, y) as f32 / 255.0; 3];
    paint(&folder.join("pattern.png"), false, index);
    paint(&folder.join("color.png"), true, |x, y| MINERALS[mineral(x, y)].1);
    let rough = |x: u32, y: u32| [0.0, MINERALS[mineral(x, y)].2, 0.0];
    paint(&folder.join("rough.png"), false, rough);
    let normal = |x: u32, y: u32| {
        if mineral(x, y) != 2 {
            return [0.5, 0.5, 1.0];
        }
        // Of half of the height times 1 + cos cos, upwards from below.
        let place = [f64::from(x) + 0.5, f64::from(SIDE - y) - 0.5].map(|v| v / f64::from(SIDE));
        let turn = |axis: usize| std::f64::consts::TAU * WAVES[axis];
        let [(su, cu), (sv, cv)] = [0, 1].map(|axis| {
            let angle = turn(axis) * place[axis];
            (math::sin(angle), math::cos(angle))
        });
        let rises = [-su * cv * turn(0), -cu * sv * turn(1)].map(|v| v * HEIGHT / 2.0 / METRES);
        let normal = v(-rises[0], -rises[1], 1.0).normalize();
        normal.to_array().map(|v| (v * 0.5 + 0.5) as f32)
    };
    paint(&folder.join("normal.png"), false, normal);
    println!("| | near: first, again | error | far: first, again | error |\n|---|---|---|---|---|");
    for method in ["attribute", "ordinary"] {
        measure(&folder, method);
    }
    let own = std::env::current_exe().expect("a program");
    for method in ["attribute", "ordinary"] {
        let told = Command::new(&own).args(["bytes", method]).output().expect("itself");
        println!("{method}: {} of pictures held", String::from_utf8_lossy(&told.stdout));
    }
}
