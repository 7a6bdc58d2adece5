//! Picking: what is seen in a pixel (\[D], "Applications": "pick a visible polygon, and change the attributes").

use glam::DVec3;

use super::{Coverage, Framing, Rule, Weighting};
use crate::error::{Error, Result};
use crate::raster::{LinePlan, Phase};
use crate::span::{FaceId, SpanImage};

/// A face that is seen in a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Picked {
    /// The face.
    pub face: FaceId,
    /// The share of the pixel in which it is seen, in (0, 1].
    pub share: f64,
    /// How many translucent faces are before it there.
    pub behind: usize,
    /// The middle of what is seen of it, in the world, in metres.
    pub point: DVec3,
    /// How far that is from the eye, in metres; in a parallel view, from its plane.
    pub distance: f64,
}

/// The faces that the lines of an image see in a pixel of its raster, those with the greatest shares first, those behind
/// translucent ones after these.
///
/// # Errors
/// If the pixel lies outside of the raster, or no line of its row is there.
pub fn pick(image: &SpanImage, [column, row]: [u32; 2]) -> Result<Vec<Picked>> {
    let raster = image.view().raster();
    let (width, height) = (raster.width, raster.height);
    if column >= width || row >= height {
        return Err(Error::invalid(format!(
            "pixel {column},{row}: the image has {width} columns and {height} rows, from 0"
        )));
    }
    if !image.rows().contains(&row) {
        return Err(Error::invalid(format!("row {row} is not there")));
    }
    let LinePlan { per_row, phase, .. } = image.plan();
    let rule = match phase {
        Phase::Border => Rule::Sampled(per_row, Weighting::Trapezoid),
        Phase::Centre => Rule::Sloped(per_row),
    };
    let framing =
        Framing { columns: column..column + 1, rows: row..row + 1, ..Framing::whole(raster) };
    let mut coverage = Coverage::new(image, rule, &framing, None);
    let mut covers = Vec::new();
    coverage.row(row, &mut covers);
    let mut found: Vec<Picked> = Vec::new();
    for cover in covers.iter().filter(|cover| cover.start <= column && column < cover.end) {
        let one = [cover.face];
        let stack = coverage.stack(cover.face).unwrap_or(&one);
        for (behind, face) in stack.iter().enumerate().filter(|(_, face)| face.is_some()) {
            let plane = image.face(*face).1.plane;
            // A cover of whole pixels has its middle in the middle of all.
            let x = cover.x.clamp(f64::from(column), f64::from(column + 1));
            let rho = plane.depth(x, cover.y);
            let view = image.view();
            let (point, distance) = (view.world_point(x, cover.y, rho), view.distance(rho));
            let share = f64::from(cover.area);
            match found.iter_mut().find(|known| known.face == *face) {
                Some(known) => {
                    known.share += share;
                    known.behind = known.behind.max(behind);
                }
                None => found.push(Picked { face: *face, share, behind, point, distance }),
            }
        }
    }
    found.sort_by(|a, b| {
        a.behind.cmp(&b.behind).then(b.share.total_cmp(&a.share)).then(a.face.cmp(&b.face))
    });
    Ok(found)
}
