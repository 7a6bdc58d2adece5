//! Span images made by chance, and their pictures.

use glam::DVec2;
use spandrel_engine::camera::View;
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::raster::{LinePlan, Phase, Rows};
use spandrel_engine::render::scanline::render;
use spandrel_engine::resolve::{Framing, Rule, Weighting, resolve};
use spandrel_engine::span::SpanImage;
use std::collections::BTreeSet;

use crate::scenes::{random_faces, random_panes, scene};

/// One of seven clusters by the remainder of `seed`, with faces of all kinds, half of them panes if asked.
///
/// # Panics
/// If the rows are not those of the view.
pub fn image(seed: u64, panes: bool, view: &View, plan: LinePlan, rows: Rows) -> SpanImage {
    let mesh = if panes { random_panes(seed, 25) } else { random_faces(seed, 25) };
    let scene = scene(&format!("cluster {}", seed % 7), mesh);
    render(&[scene.into()], view, plan, rows).expect("faces of tests render")
}

/// Line plans of both phases.
pub fn plans() -> [LinePlan; 3] {
    [(4, Phase::Centre), (3, Phase::Border), (1, Phase::Centre)]
        .map(|(n, phase)| LinePlan::new(n, phase).expect("n is in range"))
}

/// The picture of an image by the rule that fits its lines.
///
/// # Panics
/// If the image cannot be resolved.
pub fn picture(image: &SpanImage, channels: &[Channel]) -> Image {
    let rule = match image.plan() {
        LinePlan { per_row, phase: Phase::Centre, .. } => Rule::Sloped(per_row),
        LinePlan { per_row, .. } => Rule::Sampled(per_row, Weighting::Trapezoid),
    };
    let framing = Framing::scaled(image.view().raster(), DVec2::ONE).expect("1 is a scale");
    let channels: BTreeSet<Channel> = channels.iter().copied().collect();
    resolve(image, rule, &framing, &channels).expect("the image has the rule's lines")
}
