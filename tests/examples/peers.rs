//! Makes what `tests/peers/run.py` compares with other programs: a generated town as triangles, as files of
//! spans and as samples of deep pictures, and this program's own pictures of it with their times.
//!
//! `cargo run --release -p spandrel-tests --example peers -- FOLDER TRIANGLES WIDTH HEIGHT`

use spandrel_engine::camera::View;
use spandrel_engine::image::{Channel, Image, Samples};
use spandrel_engine::render::scanline::{self, Cluster};
use spandrel_engine::resolve::{Coverage, Framing, Rule, resolve};
use spandrel_engine::scene::Scene;
use spandrel_engine::span::SpanImage;
use spandrel_engine::span_file::{self, Options};
use spandrel_tests::town;
use std::collections::BTreeSet;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Clusters of the town, as files.
const CLUSTERS: usize = 4;
/// Lines per row of the files.
const LINES: u32 = 8;
/// Lines per row from which deep samples get their coverage: as good as perfect beside what is compared.
const DEEP_LINES: u32 = 64;
const RUNS: usize = 5;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, triangles, width, height] = &arguments[..] else {
        panic!("FOLDER TRIANGLES WIDTH HEIGHT");
    };
    let folder = Path::new(folder);
    let number = |text: &String| text.parse::<u32>().expect("a number");
    let (triangles, view) = (number(triangles) as usize, town::view(number(width), number(height)));
    let whole = town::clusters(triangles, 1);
    write_triangles(&folder.join("town.tri"), &whole);
    write_view(&folder.join("view.txt"), &view);
    for n in [1, 2, 4, 8, 16] {
        let (picture, [render, resolve]) = picture(&whole, &view, n);
        println!("{{\"n\": {n}, \"visibility\": {render}, \"resolve\": {resolve}}}");
        write_colors(&folder.join(format!("spans_{n}.rgb")), &picture);
    }
    for (i, scene) in town::clusters(triangles, CLUSTERS).into_iter().enumerate() {
        let image = render(&[scene.into()], &view, LINES);
        span_file::write(&image, &folder.join(format!("{i}.span")), Options::default())
            .expect("a file can be written");
    }
    // Deep samples have flat colours by themselves, as the files of spans do.
    for (i, scene) in town::clusters(triangles, CLUSTERS).into_iter().enumerate() {
        write_deep(&folder.join(format!("{i}.deep")), &scene.into(), &view);
    }
}

fn render(clusters: &[Cluster], view: &View, n: u32) -> SpanImage {
    let plan = Rule::Sloped(n).plan().expect("n is in range");
    scanline::render(clusters, view, plan, 0..view.raster().height).expect("towns render")
}

/// A town's picture, and the seconds for visibility and for resolving: medians.
fn picture(scenes: &[Arc<Scene>], view: &View, n: u32) -> (Image, [f64; 2]) {
    let clusters: Vec<Cluster> = scenes.iter().cloned().map(Cluster::from).collect();
    let channels = BTreeSet::from([Channel::Color]);
    let framing = Framing::whole(view.raster());
    let mut times = [Vec::new(), Vec::new()];
    let mut last = None;
    for _ in 0..RUNS {
        let clock = Instant::now();
        let image = render(&clusters, view, n);
        times[0].push(clock.elapsed().as_secs_f64());
        let clock = Instant::now();
        let picture = resolve(&image, Rule::Sloped(n), &framing, &channels).expect("towns resolve");
        times[1].push(clock.elapsed().as_secs_f64());
        last = Some(picture);
    }
    let median = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    (last.expect("there are runs"), times.map(median))
}

fn create(path: &Path) -> BufWriter<std::fs::File> {
    BufWriter::new(std::fs::File::create(path).expect("a file can be made"))
}

fn put(out: &mut impl Write, values: impl IntoIterator<Item = f32>) {
    for value in values {
        out.write_all(&value.to_le_bytes()).expect("a file can be written");
    }
}

/// Nine coordinates and three colours for every triangle.
fn write_triangles(path: &Path, scenes: &[Arc<Scene>]) {
    let mut out = create(path);
    for scene in scenes {
        for instance in &scene.instances {
            let mesh = instance.geometry.mesh();
            for face in 0..mesh.face_count() {
                let material = instance.material_of(mesh.sides(face), true);
                let color = scene.materials[material as usize].color.to_array();
                let corners = mesh.outline(face);
                for pair in corners[1..].windows(2) {
                    for corner in [corners[0], pair[0], pair[1]] {
                        put(&mut out, mesh.points[corner as usize].as_vec3().to_array());
                    }
                    put(&mut out, color);
                }
            }
        }
    }
}

/// The size; the eye; the direction through the top left corner; its changes per pixel to the right and down.
fn write_view(path: &Path, view: &View) {
    let eye = view.camera().position;
    let towards = |x: f64, y: f64| view.world_point(x, y, 1.0) - eye;
    let corner = towards(0.0, 0.0);
    let numbers = [eye, corner, towards(1.0, 0.0) - corner, towards(0.0, 1.0) - corner];
    let text: Vec<String> =
        numbers.iter().flat_map(|v| v.to_array()).map(|v| v.to_string()).collect();
    let raster = view.raster();
    std::fs::write(path, format!("{} {} {}\n", raster.width, raster.height, text.join(" ")))
        .expect("a file can be written");
}

fn write_colors(path: &Path, picture: &Image) {
    let channel = |name: &str| match picture.channel(name) {
        Some(Samples::Float(values)) => values,
        _ => panic!("colours were asked for"),
    };
    let (r, g, b) = (channel("R"), channel("G"), channel("B"));
    let mut out = create(path);
    (0..r.len()).for_each(|i| put(&mut out, [r[i], g[i], b[i]]));
}

/// For every pixel the number of samples, then for each its Z, alpha and associated colour. Alpha is such that a
/// cluster flattened by itself is right: a sample's coverage by what those before it leave.
fn write_deep(path: &Path, cluster: &Cluster, view: &View) {
    let image = render(std::slice::from_ref(cluster), view, DEEP_LINES);
    let framing = Framing::whole(view.raster());
    let mut coverage = Coverage::new(&image, Rule::Sloped(DEEP_LINES), &framing, None);
    let scene = &cluster.scene;
    let color_of = |ordinal: u32| {
        let (at, face, _) = scene.part(ordinal);
        let instance = &scene.instances[at];
        let material = instance.material_of(instance.geometry.mesh().sides(face), true);
        scene.materials[material as usize].color.to_array()
    };
    let mut out = create(path);
    let mut covers = Vec::new();
    for row in 0..view.raster().height {
        covers.clear();
        coverage.row(row, &mut covers);
        let mut pixels: Vec<Vec<(f64, f32, [f32; 3])>> =
            vec![Vec::new(); view.raster().width as usize];
        for cover in covers.iter().filter(|cover| cover.face.is_some()) {
            for pixel in cover.start..cover.end {
                let (_, face) = image.face(cover.face);
                let x = if cover.end - cover.start > 1 { f64::from(pixel) + 0.5 } else { cover.x };
                let z = view.distance(face.plane.depth(x, cover.y));
                pixels[pixel as usize].push((z, cover.area, color_of(face.ordinal)));
            }
        }
        for samples in &mut pixels {
            samples.sort_by(|a, b| a.0.total_cmp(&b.0));
            out.write_all(&(samples.len() as u32).to_le_bytes()).expect("a file can be written");
            let mut left = 1.0f32;
            for (z, area, color) in samples {
                let alpha = if left > 1e-6 { (*area / left).min(1.0) } else { 0.0 };
                left -= *area;
                put(
                    &mut out,
                    [*z as f32, alpha, color[0] * alpha, color[1] * alpha, color[2] * alpha],
                );
            }
        }
    }
}
