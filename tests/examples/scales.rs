//! How accurate a finished merge is at other scales: beside a fresh solution with as many lines to a row of the
//! result, and beside a finished picture that is resampled.
//!
//! `cargo run --release -p spandrel-tests --example scales`

use glam::DVec2;
use image::imageops::{FilterType, resize};
use image::{ImageBuffer, Rgb};
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::render::scanline::{self, Cluster};
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::span::SpanImage;
use spandrel_tests::town;
use std::collections::BTreeSet;

type Picture = ImageBuffer<Rgb<f32>, Vec<f32>>;

const SIZE: (u32, u32) = (640, 480);
const LINES: u32 = 8;
const REFERENCE: u32 = 256;

fn main() {
    println!(
        "Town of 34 thousand triangles, four clusters, solved at {} x {} with {LINES} lines per row.",
        SIZE.0, SIZE.1
    );
    println!("RMSE against {REFERENCE} lines per row at the size of the result.\n");
    println!(
        "| scale | from the spans | fresh, lines per row | error | picture, bilinear | picture, Lanczos 3 |"
    );
    println!("|---|---|---|---|---|---|");
    let solved = merged(SIZE, LINES);
    let finished = picture(&solved, LINES, 1.0);
    for scale in [0.8, 1.2, 2.0, 3.0] {
        let size = [SIZE.0, SIZE.1].map(|side| (f64::from(side) * scale).round() as u32);
        let truth = picture(&merged(size.into(), REFERENCE), REFERENCE, 1.0);
        let own = picture(&solved, LINES, scale);
        let fresh_lines = (f64::from(LINES) / scale).round() as u32;
        let fresh = picture(&merged(size.into(), fresh_lines), fresh_lines, 1.0);
        let resampled = |filter| resize(&finished, size[0], size[1], filter);
        println!(
            "| {scale} | {:.5} | {fresh_lines} | {:.5} | {:.4} | {:.4} |",
            rmse(&own, &truth),
            rmse(&fresh, &truth),
            rmse(&resampled(FilterType::Triangle), &truth),
            rmse(&resampled(FilterType::Lanczos3), &truth)
        );
    }
}

fn merged((width, height): (u32, u32), n: u32) -> SpanImage {
    let view = town::view(width, height);
    let plan = Rule::Sloped(n).plan().expect("n is in range");
    let render = |scene| {
        scanline::render(&[Cluster::from(scene)], &view, plan, 0..height).expect("towns render")
    };
    let images: Vec<SpanImage> = town::clusters(34_000, 4).into_iter().map(render).collect();
    SpanImage::merge(&images).expect("clusters of one view merge")
}

fn picture(image: &SpanImage, n: u32, scale: f64) -> Picture {
    let framing = Framing::scaled(image.view().raster(), DVec2::splat(scale)).expect("in range");
    let channels = BTreeSet::from([Channel::Color]);
    let picture: Image =
        resolve(image, Rule::Sloped(n), &framing, &channels).expect("towns resolve");
    let (width, height) = picture.size;
    ImageBuffer::from_fn(width, height, |x, y| {
        let [r, g, b, _] = picture.rgba(x, y);
        Rgb([r, g, b])
    })
}

fn rmse(a: &Picture, b: &Picture) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let squares = a.iter().zip(b.iter()).map(|(a, b)| f64::from(a - b).powi(2));
    (squares.sum::<f64>() / a.len() as f64).sqrt()
}
