//! Times of the three steps that the project stands on, over generated towns at 1920x1080:
//! `cargo bench -p spandrel-tests --bench spans`. The README has the table.

#![allow(missing_docs, reason = "criterion's macros write the functions")]

use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};
use spandrel_engine::image::Channel;
use spandrel_engine::raster::{LinePlan, Phase};
use spandrel_engine::render::scanline::{self, Cluster};
use spandrel_engine::resolve::{Framing, Rule, Weighting, resolve};
use spandrel_engine::span::{Layers, Lines, SpanImage};
use spandrel_engine::span_file::{self, Options, SpanFile};
use spandrel_tests::town;
use std::collections::BTreeSet;
use std::hint::black_box;
use std::path::{Path, PathBuf};

const LINES: [u32; 3] = [1, 4, 8];

fn plan(n: u32) -> LinePlan {
    LinePlan::new(n, Phase::Centre).expect("n is in range")
}

fn clusters(triangles: usize, count: usize) -> Vec<Cluster> {
    town::clusters(triangles, count).into_iter().map(Cluster::from).collect()
}

/// The part of the next that brings faces onto the screen.
fn set_up(criterion: &mut Criterion) {
    let view = town::view(1920, 1080);
    let mut group = criterion.benchmark_group("set-up");
    group.sample_size(10);
    for (name, triangles) in [("10k", 10_000), ("100k", 100_000), ("1M", 1_000_000)] {
        let town = clusters(triangles, 1);
        group.bench_function(BenchmarkId::new(name, 8), |bencher| {
            bencher.iter(|| scanline::setup::face_table(black_box(&town[0]), &view, plan(8)));
        });
    }
    group.finish();
}

/// Four clusters to files, from files, and merged from file to file.
fn files(criterion: &mut Criterion) {
    let view = town::view(1920, 1080);
    let folder = std::env::temp_dir().join(format!("spandrel-bench-{}", std::process::id()));
    let mut group = criterion.benchmark_group("files of four clusters");
    group.sample_size(10);
    for (name, triangles) in [("10k", 10_000), ("100k", 100_000), ("1M", 1_000_000)] {
        let render = |cluster: &Cluster| {
            scanline::render(std::slice::from_ref(cluster), &view, plan(8), 0..1080)
                .expect("generated towns render")
        };
        let images: Vec<SpanImage> = clusters(triangles, 4).iter().map(render).collect();
        let paths: Vec<PathBuf> = (0..4).map(|i| folder.join(format!("{i}.span"))).collect();
        let write = || {
            for (image, path) in images.iter().zip(&paths) {
                span_file::write(image, path, Options::default()).expect("files can be written");
            }
        };
        group.bench_function(BenchmarkId::new("write", name), |bencher| bencher.iter(write));
        let read = |path: &PathBuf| {
            let file = SpanFile::open(path, None).expect("what was written can be read");
            file.read(0..1080).expect("what was written can be read")
        };
        group.bench_function(BenchmarkId::new("read", name), |bencher| {
            bencher.iter(|| paths.iter().map(read).collect::<Vec<_>>());
        });
        let inputs: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
        let output = folder.join("merged.span");
        group.bench_function(BenchmarkId::new("merge", name), |bencher| {
            bencher.iter(|| span_file::merge(&inputs, &output, &|_, _| {}));
        });
    }
    group.finish();
    let _ = std::fs::remove_dir_all(&folder);
}

/// From a scene to its spans: set-up (faces on the screen) and visible surfaces.
fn scanline(criterion: &mut Criterion) {
    let view = town::view(1920, 1080);
    let mut group = criterion.benchmark_group("scanline");
    group.sample_size(10);
    for (name, triangles) in [("10k", 10_000), ("100k", 100_000), ("1M", 1_000_000)] {
        let town = clusters(triangles, 1);
        for n in LINES {
            group.bench_function(BenchmarkId::new(name, n), |bencher| {
                bencher.iter(|| scanline::render(black_box(&town), &view, plan(n), 0..1080));
            });
        }
    }
    group.finish();
}

/// Four images of one town's clusters, merged by depth.
fn merge(criterion: &mut Criterion) {
    let view = town::view(1920, 1080);
    let mut group = criterion.benchmark_group("merge four clusters");
    group.sample_size(10);
    for (name, triangles) in [("10k", 10_000), ("100k", 100_000), ("1M", 1_000_000)] {
        let town = clusters(triangles, 4);
        for n in LINES {
            let render = |cluster: &Cluster| {
                scanline::render(std::slice::from_ref(cluster), &view, plan(n), 0..1080)
                    .expect("generated towns render")
            };
            let images: Vec<SpanImage> = town.iter().map(render).collect();
            group.bench_function(BenchmarkId::new(name, n), |bencher| {
                bencher.iter(|| SpanImage::merge(black_box(&images)));
            });
        }
    }
    group.finish();
}

/// The same image, of which nothing is kept yet.
fn fresh(image: &SpanImage) -> SpanImage {
    let all = image.lines().range();
    let lines = |k: u32, out: &mut Vec<_>| out.extend_from_slice(image.lines().line(k));
    let layers = |k: u32, out: &mut Vec<_>| out.extend_from_slice(image.layers().line(k));
    let (lines, layers) = (Lines::compute(all.clone(), lines), Layers::compute(all, layers));
    image.clone().with_lines(lines, layers)
}

/// From spans to a picture of the same size, colour only.
fn resolving(criterion: &mut Criterion) {
    let view = town::view(1920, 1080);
    let framing = Framing::whole(view.raster());
    let channels = BTreeSet::from([Channel::Color]);
    let mut group = criterion.benchmark_group("resolve");
    group.sample_size(10);
    for (name, triangles) in [("10k", 10_000), ("100k", 100_000), ("1M", 1_000_000)] {
        let town = clusters(triangles, 1);
        for n in LINES {
            let image = scanline::render(&town, &view, plan(n), 0..1080).expect("towns render");
            for (label, rule) in
                [("box", Rule::Sampled(n, Weighting::Box)), ("sloped", Rule::Sloped(n))]
            {
                group.bench_function(BenchmarkId::new(format!("{label} {name}"), n), |bencher| {
                    let work = |image| resolve(black_box(&image), rule, &framing, &channels);
                    bencher.iter_batched(|| fresh(&image), work, BatchSize::PerIteration);
                });
            }
        }
    }
    group.finish();
}

criterion_group!(benches, set_up, scanline, merge, files, resolving);
criterion_main!(benches);
