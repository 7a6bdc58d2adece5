//! Visible surfaces: from scenes to span images.
//!
//! The scan-line method of both papers, \[N] and \[D] "Shading display with shadow": faces are sorted
//! into buckets by y, and every line finds the visible one among the faces that it meets. "Visible" is
//! the winner rule of [`crate::span::order`], the same that merges images, so that rendering clusters
//! apart and merging them gives the same bits as rendering them together.
//!
//! Reading path: [`setup`] (faces on the screen), `band` (where a face meets lines), `tiles` (the
//! visible part of all), [`probe`] (the same anywhere, on demand).

mod band;
mod bins;
mod clip;
pub mod probe;
pub mod setup;
mod tiles;

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use crate::camera::View;
use crate::error::{Error, Result};
use crate::fragment::Surfaces;
use crate::key::Key;
use crate::raster::{LinePlan, Rows};
use crate::scene::{Scene, SceneSurfaces};
use crate::span::{Again, Layers, Lines, Segment, Source, SpanImage, layer, line};
use band::{Band, LANES, Limits};
use probe::Index;

/// A scene to render, and what decides where it coincides with others.
#[derive(Clone, Debug)]
pub struct Cluster {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Brings the scene nearer by `priority` 2^-24 of its distance: more than rounding, less than can
    /// be seen. Decides between surfaces that are meant to coincide but do not in every bit.
    pub priority: i32,
    /// What knows its faces, by their numbers in the scene. Absent, the scene.
    pub surfaces: Option<Arc<dyn Surfaces>>,
    /// Whether all faces are solved as those that let through what lies behind them: something is going to change
    /// how much of it they hide.
    pub layered: bool,
}

impl From<Arc<Scene>> for Cluster {
    fn from(scene: Arc<Scene>) -> Cluster {
        Cluster { scene, priority: 0, surfaces: None, layered: false }
    }
}

/// Renders scenes together into a span image of the given rows, by the scan-line method.
///
/// # Errors
/// If the rows exceed the raster, or the scenes have more faces than an image holds.
pub fn render(clusters: &[Cluster], view: &View, plan: LinePlan, rows: Rows) -> Result<SpanImage> {
    let frame = frame(clusters, view, plan, rows)?;
    let (lines, layers) = tiles::solve(&frame);
    // The image keeps its frame, so that a line at any height can be solved later. The index that
    // this needs is made with the first probe: most images are never asked.
    let again = plan.probed.then(|| {
        let (nowhere, index) = (frame.clone(), OnceLock::new());
        Again::new(move |probes| {
            let index = index.get_or_init(|| Index::new(&nowhere));
            Ok(probe::solve(&nowhere, index, probes))
        })
    });
    Ok(frame.with_lines(lines, layers).with_again(again))
}

/// Renders as [`render`] does, line by line and without any cleverness: all segments of a line, halved
/// and merged. Slow; what the fast way is tested against.
///
/// # Errors
/// As [`render`].
pub fn render_by_merging(
    clusters: &[Cluster],
    view: &View,
    plan: LinePlan,
    rows: Rows,
) -> Result<SpanImage> {
    let frame = frame(clusters, view, plan, rows)?;
    let raster = view.raster();
    let limits = Limits::new(view);
    let all = frame.plan().lines(&frame.rows());
    // Heights are taken from bands, as the fast way does: a line outside the viewport is infinitely
    // far away, and both ways leave it empty.
    let y_of = |k: u32| {
        let band = Band::new(view, plan, &all, (k - all.start) / LANES as u32);
        band.y[(k - band.first) as usize]
    };
    let segments = |k: u32, translucent: bool| {
        let y = y_of(k);
        let mut found = Vec::new();
        for (at, source) in frame.sources().iter().enumerate() {
            for (place, face) in source.faces.faces().iter().enumerate() {
                if face.is_translucent != translucent {
                    continue;
                }
                let id = frame.id(at, place);
                for segment in band::segments(&source.faces, face, y, raster) {
                    let seen = limits.cut(segment, &frame.on_line(id, y), y, raster);
                    if !seen.is_empty() {
                        found.push((seen, id));
                    }
                }
            }
        }
        found
    };
    let cells = raster.cells();
    let lines = Lines::compute(all.clone(), |k, out| {
        let y = y_of(k);
        line::envelope(&segments(k, false), cells, &|face| frame.on_line(face, y), out);
    });
    let layers = Layers::compute(all.clone(), |k, out| {
        let y = y_of(k);
        let own = |(Range { start, end }, face)| Segment { start, face, end };
        let own: Vec<Segment> = segments(k, true).into_iter().map(own).collect();
        let start = out.len();
        layer::clip(&own, lines.line(k), cells, |face| frame.on_line(face, y), out);
        layer::normalize(out, start);
    });
    Ok(frame.with_lines(lines, layers))
}

/// The image of scenes before anything is solved.
fn frame(clusters: &[Cluster], view: &View, plan: LinePlan, rows: Rows) -> Result<SpanImage> {
    if rows.start > rows.end || rows.end > view.raster().height {
        let height = view.raster().height;
        return Err(Error::invalid(format!("rows {} to {} of {height}", rows.start, rows.end)));
    }
    let source = |cluster: &Cluster| -> Result<Source> {
        let scene = &cluster.scene;
        Ok(Source {
            label: scene.label.clone(),
            // Layers are solved otherwise than opaque faces, so the same scene with and without
            // them is two sources.
            scene: match cluster.layered {
                false => Key::of(&(scene.key.to_bytes(), cluster.priority)),
                true => Key::of(&(scene.key.to_bytes(), cluster.priority, "layered")),
            },
            surfaces: match &cluster.surfaces {
                Some(surfaces) => surfaces.clone(),
                None => Arc::new(SceneSurfaces::new(scene.clone())),
            },
            stack: Vec::new(),
            matte: None,
            held: Vec::new(),
            faces: Arc::new(setup::face_table(cluster, view, plan)?),
        })
    };
    let sources = clusters.iter().map(source).collect::<Result<Vec<_>>>()?;
    SpanImage::frame(view.clone(), plan, rows, sources)
}
