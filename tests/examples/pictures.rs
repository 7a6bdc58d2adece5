//! More pictures on surfaces than memory holds ([N], "Texture mapping": "the number of texture maps required to be
//! simultaneously present in memory can be reduced"): a street in four clusters, each with eight photographs of its own,
//! within less and less memory. `cargo run --release -p spandrel-tests --example pictures`.

use glam::{DVec2, dvec3 as v};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::image::{Channel, Image, Samples, Window, file};
use spandrel_engine::key::KeyHasher;
use spandrel_engine::raster::Raster;
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::scene::read::{self, ReadOptions};
use spandrel_engine::span::SpanImage;
use spandrel_engine::stream::noise;
use spandrel_engine::texture::store;
use spandrel_engine::watch::Watch;
use spandrel_tests::lights::{illuminate, sun};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::time::Instant;

const RULE: Rule = Rule::Sloped(4);

/// Texels along a side of a picture, and pictures of a cluster.
const SIDE: u32 = 2048;
const PICTURES: u32 = 8;

/// A cluster: its name, the axis along which its pictures are projected, the corners of a face, and how far away the
/// next stands.
type Street = (&'static str, char, [[f64; 3]; 4], [f64; 3]);

const CLUSTERS: [Street; 4] = [
    ("left", 'X', [[-6., 0., 0.], [-6., 0., -9.], [-6., 12., -9.], [-6., 12., 0.]], [0., 0., -10.]),
    ("right", 'X', [[6., 0., -9.], [6., 0., 0.], [6., 9., 0.], [6., 9., -9.]], [0., 0., -10.]),
    ("road", 'Y', [[-6., 0., 0.], [6., 0., 0.], [6., 0., -10.], [-6., 0., -10.]], [0., 0., -10.]),
    (
        "boards",
        'Z',
        [[-5.5, 3., -3.], [-3., 3., -3.], [-3., 5., -3.], [-5.5, 5., -3.]],
        [1., 0.2, -7.],
    ),
];

/// A picture that has detail in every texel.
fn paint(path: &Path, seed: u32) {
    let mut picture = Image::new((SIDE, SIDE), Window::whole(SIDE, SIDE));
    let brick = |at: u32| {
        let (x, y) = ((at % SIDE) as f32, (at / SIDE) as f32);
        let is_joint = (x / 64.0).fract() < 0.06 || (y / 32.0).fract() < 0.12;
        let grain = noise::of_cell([x, y, seed as f32]);
        if is_joint { 0.5 + 0.1 * grain } else { 0.15 + 0.3 * grain }
    };
    let values: Vec<f32> = (0..SIDE * SIDE).map(brick).collect();
    for (axis, name) in ["R", "G", "B"].into_iter().enumerate() {
        let share = 0.5 + 0.5 * noise::of_cell([axis as f32, seed as f32, 90.0]);
        let values = values.iter().map(|value| value * share).collect();
        picture.insert(name, Samples::Float(values)).expect("as many as there are pixels");
    }
    file::write(&picture, path, Some(8)).expect("a writable folder");
}

fn scene(folder: &Path, cluster: usize) {
    let (name, axis, corners, step) = CLUSTERS[cluster];
    let (mut materials, mut children) = (String::new(), String::new());
    for i in 0..PICTURES {
        let file = format!("{name} {i}.png");
        paint(&folder.join(&file), cluster as u32 * PICTURES + i);
        let mapping = format!("mapping: (by: {axis}, length: (9, 9))");
        let map = format!("maps: {{\"color\": (picture: File(\"{file}\"), {mapping})}}");
        let _ = write!(materials, "\"{i}\": (color: 1, {map}), ");
        let place = |corner: [f64; 3], axis: usize| corner[axis] + step[axis] * f64::from(i);
        let points = corners.map(|corner| [0, 1, 2].map(|axis| place(corner, axis)));
        let points = points.map(|[x, y, z]| format!("({x}, {y}, {z})")).join(", ");
        let mesh = format!("Polygon(outline: [{points}])");
        let _ = write!(children, "(name: \"face {i}\", material: \"{i}\", shape: {mesh}), ");
    }
    let text = format!(
        "Scene(materials: {{{materials}}}, plans: [(name: \"all\", root: (children: [{children}]))])"
    );
    std::fs::write(folder.join(format!("{name}.ron")), text).expect("a writable folder");
}

fn street(folder: &Path) -> SpanImage {
    let camera =
        Camera { position: v(0.0, 2.5, 9.0), look_at: v(0.0, 3.5, -30.0), ..Camera::default() };
    let view = View::new(&camera, Raster::new(1280, 720).expect("a size")).expect("a camera");
    let render = |(name, ..): Street| {
        let path = folder.join(format!("{name}.ron"));
        let scene = read::scene(&path, None, name, &ReadOptions::default()).expect("a scene");
        let plan = RULE.plan().expect("a plan");
        scanline::render(&[Arc::new(scene).into()], &view, plan, 0..720).expect("spans")
    };
    let images = CLUSTERS.map(render);
    let merged = SpanImage::merge(&images).expect("a merge");
    let lamps = vec![sun(v(-0.3, -0.7, -0.6), Color::grey(0.9))];
    merged.shaded(Arc::new(illuminate(lamps, Color::grey(0.3), Color::grey(0.2)))).expect("light")
}

fn measure(folder: &Path, limit: usize) {
    store().set_limit(limit);
    let image = street(folder);
    let framing = Framing::scaled(image.view().raster(), DVec2::ONE).expect("a frame");
    let start = Instant::now();
    let watch = Watch::new();
    let picture = watch
        .run(|| resolve(&image, RULE, &framing, &BTreeSet::from([Channel::Color])))
        .expect("pixels");
    let seconds = start.elapsed().as_secs_f64();
    if std::env::var_os("SHOW").is_some() {
        file::write(&picture, &folder.join("street.png"), None).expect("a file");
    }
    let mut key = KeyHasher::new("picture");
    picture.pixels().for_each(|pixel| {
        key.bytes(&pixel.map(f32::to_le_bytes).concat());
    });
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let peak = peak.and_then(|line| line.trim().strip_suffix(" kB")?.parse::<f64>().ok());
    let passes = watch.counts().get("passes for pictures on surfaces").copied().unwrap_or(1);
    let report = store().report();
    println!(
        "| {} MB | {passes} | {} of {} | {:.0} MB | {:.0} MB | {seconds:.2} s | {} |",
        limit >> 20,
        report.reads,
        report.pictures,
        report.most as f64 / 1e6,
        peak.unwrap_or(f64::NAN) / 1e3,
        key.finish()
    );
}

fn main() {
    let folder = std::env::temp_dir().join("spandrel-pictures");
    std::fs::create_dir_all(&folder).expect("a writable folder");
    // Itself, alone with one limit: what it holds then.
    if let Some(limit) = std::env::args().nth(1) {
        return measure(&folder, limit.parse::<usize>().expect("megabytes") << 20);
    }
    (0..CLUSTERS.len()).for_each(|cluster| scene(&folder, cluster));
    println!(
        "| limit | passes | readings | pictures held | peak of the process | Resolve | picture |\n|---|---|---|---|---|---|---|"
    );
    let program = std::env::current_exe().expect("a path");
    for limit in ["1024", "256", "64", "24"] {
        Command::new(&program).arg(limit).status().expect("itself");
    }
    let _ = std::fs::remove_dir_all(&folder);
}
