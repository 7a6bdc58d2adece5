//! Scan line: scenes to span images, \[N] and \[D] "Shading display with shadow".
//!
//! [`setup`] makes the faces of scenes ready on the screen; which of them is seen where is found by
//! the module `visible`.

pub mod setup;

use std::sync::Arc;

use crate::camera::View;
use crate::error::{Error, Result};
use crate::fragment::Surfaces;
use crate::key::Key;
use crate::raster::{LinePlan, Rows};
use crate::scene::{Scene, SceneSurfaces};
use crate::span::{Source, SpanImage};
use crate::visible;

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
    frame(clusters, view, plan, rows).map(visible::solve)
}

/// Renders as [`render`] does, by [`visible::solve_by_merging`].
///
/// # Errors
/// As [`render`].
pub fn render_by_merging(
    clusters: &[Cluster],
    view: &View,
    plan: LinePlan,
    rows: Rows,
) -> Result<SpanImage> {
    visible::solve_by_merging(&frame(clusters, view, plan, rows)?)
}

/// The image of scenes before anything is solved.
///
/// # Errors
/// As [`render`].
pub fn frame(clusters: &[Cluster], view: &View, plan: LinePlan, rows: Rows) -> Result<SpanImage> {
    if rows.start > rows.end || rows.end > view.raster().height {
        let height = view.raster().height;
        return Err(Error::invalid(format!("rows {} to {} of {height}", rows.start, rows.end)));
    }
    let source = |cluster: &Cluster| -> Result<Source> {
        let scene = &cluster.scene;
        Ok(Source {
            label: scene.label.clone(),
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
