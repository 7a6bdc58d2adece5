//! What lies in a row of pixels and no line has met.
//!
//! Candidates are all faces that reach into the row, seen or not. One is passed over in a pixel if it lies
//! behind what is seen there. Of the others the edges tell two things: how much of the pixel may be
//! theirs, and at which heights something may happen in it.

use std::cell::RefCell;
use std::collections::HashMap;

use super::rule::Framing;
use super::stacks::Stacks;
use super::strip::Strip;
use crate::camera::Plane;
use crate::raster::LinePlan;
use crate::span::edges::{MANY, Occupied, Side};
use crate::span::{Edge, Face, FaceId, FaceTable, Role, SpanImage};
use crate::visible::probe::FaceIndex;

/// The doubt that is cast on every pixel in which an edge lies, if none is tolerated.
pub(super) const SOME: f32 = 1e-7;

/// A row of pixels.
pub(super) struct PixelRow<'a> {
    image: &'a SpanImage,
    framing: &'a Framing,
    strips: &'a [Strip],
    stacks: &'a Stacks<'a>,
    /// Its ends on the raster, in pixels from the top.
    top: f64,
    bottom: f64,
    /// Where there are edges of faces that have many.
    occupied: RefCell<HashMap<FaceId, Occupied>>,
}

impl<'a> PixelRow<'a> {
    pub(super) fn new(
        image: &'a SpanImage,
        framing: &'a Framing,
        row: u32,
        strips: &'a [Strip],
        stacks: &'a Stacks<'a>,
    ) -> PixelRow<'a> {
        let at = |row: u32| (f64::from(row) - framing.pan.y) / framing.scale.y;
        let (top, bottom) = (at(row), at(row + 1));
        PixelRow { image, framing, strips, stacks, top, bottom, occupied: RefCell::default() }
    }

    /// Casts doubt on the pixels in which faces may be seen that no line met; and, if nothing is
    /// tolerated, on every pixel in which an edge may be seen. Returns pixels with the heights on the
    /// raster at which the edges of such faces end or enter.
    pub(super) fn events(
        &self,
        index: &FaceIndex,
        tolerance: f64,
        errors: &mut [f32],
    ) -> Vec<(u32, f64)> {
        let PixelRow { image, framing, top, bottom, .. } = *self;
        let height = image.view().raster().height;
        let row_at = |y: f64| y.clamp(0.0, f64::from(height)) as u32;
        let rows = row_at(top)..row_at(bottom.ceil());
        let columns = f64::from(framing.columns.start)..f64::from(framing.columns.end);
        let place = |x: f64| x * framing.scale.x + framing.pan.x;
        // Beyond the outermost lines there is no other to disagree with.
        let is_outermost = rows.start == 0 || rows.end == height;
        let mut events = Vec::new();
        // By pixel, the depth behind which nothing is seen; NaN where nobody looked yet.
        let mut hidden = vec![f64::NAN; errors.len()];
        for id in index.faces(rows) {
            let (source, face) = image.face(id);
            let unmet = unmet(&source.faces, face, image.plan());
            // What a line meets shows in the lines' own disagreement.
            if tolerance > 0.0 && unmet.is_none() && !is_outermost {
                continue;
            }
            let mut sides: Vec<Side> = Vec::new();
            source.faces.sides_near(face, top, bottom, |side| sides.push(side));
            sides.sort_unstable_by_key(|side| side.place);
            for edge in sides.into_iter().map(|side| side.edge) {
                let Some((left, right)) = edge.reach(top, bottom) else { continue };
                let (left, right) = (place(left), place(right));
                if right < columns.start || left >= columns.end {
                    continue;
                }
                let thickness = unmet.or_else(|| ends_beyond(&edge, image)).unwrap_or(0.0);
                let part = (thickness / (bottom - top)).min(1.0);
                let first = left.max(columns.start) as u32;
                let last = right.min(columns.end - 1.0) as u32;
                for pixel in first..=last {
                    let x = f64::from(pixel);
                    // Each edge counts half of what its face may hide.
                    let width = right.min(x + 1.0) - left.max(x);
                    let share = (width * part / 2.0) as f32;
                    let doubt = if tolerance == 0.0 { SOME } else { share };
                    if doubt == 0.0 {
                        continue;
                    }
                    let at = (pixel - framing.columns.start) as usize;
                    if hidden[at].is_nan() {
                        hidden[at] = self.hides(pixel, tolerance == 0.0);
                    }
                    if self.depths(id, pixel).1 >= hidden[at] {
                        errors[at] = (errors[at] + doubt).min(1.0);
                        events.extend(self.heights(&edge, pixel).map(|y| (pixel, y)));
                    }
                }
            }
        }
        events
    }

    /// The sides of a pixel on the raster.
    fn sides(&self, pixel: u32) -> [f64; 2] {
        [pixel, pixel + 1].map(|x| (f64::from(x) - self.framing.pan.x) / self.framing.scale.x)
    }

    /// The least and the greatest depth of a face's plane over a pixel.
    fn depths(&self, id: FaceId, pixel: u32) -> (f64, f64) {
        self.image.face(id).1.plane.range(self.sides(pixel), [self.top, self.bottom])
    }

    /// The depth behind which nothing is seen in a pixel: of the farthest face that lines show; or,
    /// strictly, as there may be gaps between the lines, of one that covers all of it.
    fn hides(&self, pixel: u32, strictly: bool) -> f64 {
        let farthest =
            |id: Option<FaceId>| id.map_or(f64::NEG_INFINITY, |id| self.depths(id, pixel).0);
        let x = f64::from(pixel);
        let opaque = |id: &FaceId| self.stacks.members(id).last().copied();
        let mut seen = self.strips.iter().flat_map(|strip| strip.faces_at(x)).map(opaque);
        if strictly {
            let sides = self.sides(pixel);
            let covers = |id: &Option<FaceId>| id.is_some_and(|id| self.covers(id, sides));
            seen.find(covers).map_or(f64::NEG_INFINITY, farthest)
        } else {
            seen.map(farthest).fold(f64::INFINITY, f64::min)
        }
    }

    /// Whether nothing but its own edges can end a face in a pixel: no side of the viewport, no plane that cuts by
    /// depth, and no matte.
    fn is_uncut(&self, face: &Face, [left, right]: [f64; 2]) -> bool {
        let (view, y) = (self.image.view(), [self.top, self.bottom]);
        let [from, above, to, below] = view.window();
        let is_inside = from <= left && right <= to && above <= y[0] && y[1] <= below;
        let (front, back) = view.depth_range();
        let (least, most) = face.plane.range([left, right], y);
        let meets = |limit: &Plane| {
            let apart = Plane {
                a: face.plane.a - limit.a,
                b: face.plane.b - limit.b,
                c: face.plane.c - limit.c,
            };
            let (low, high) = apart.range([left, right], y);
            low <= 0.0 && high >= 0.0
        };
        is_inside
            && most <= front
            && least >= back
            && !self.image.limits().iter().any(meets)
            && self.image.cuts().items().is_empty()
    }

    /// Whether a face that is seen in a pixel, given by its sides on the raster, has no edge in it.
    fn covers(&self, id: FaceId, [left, right]: [f64; 2]) -> bool {
        let (source, face) = self.image.face(id);
        let (table, top, bottom) = (&*source.faces, self.top, self.bottom);
        // A seal may end at an edge of its face, and a stroke between its rings.
        if face.role != Role::Face || face.is_translucent || !self.is_uncut(face, [left, right]) {
            return false;
        }
        if table.corner_count(face) < MANY {
            let mut reached = table.edges(face).filter_map(|edge| edge.reach(top, bottom));
            return !reached.any(|(from, to)| from < right && to > left);
        }
        let mut known = self.occupied.borrow_mut();
        let occupied = known.entry(id).or_insert_with(|| table.occupied(face, top, bottom));
        !occupied.meets(left, right)
    }

    /// The heights within the row at which an edge ends, or enters a pixel from the side.
    fn heights(&self, edge: &Edge, pixel: u32) -> impl Iterator<Item = f64> + use<> {
        let (edge, top, bottom) = (*edge, self.top, self.bottom);
        // Not finite for an upright edge: no height passes `is_on`, as it enters no pixel from the
        // side.
        let along = (edge.bottom.y - edge.top.y) / (edge.bottom.x - edge.top.x);
        let enters = self.sides(pixel).map(|side| edge.top.y + (side - edge.top.x) * along);
        let is_on = move |y: &f64| *y > edge.top.y && *y < edge.bottom.y;
        let all = [edge.top.y, edge.bottom.y].into_iter().chain(enters.into_iter().filter(is_on));
        all.filter(move |y| *y > top && *y < bottom)
    }
}

/// The height of a face that no line of a plan meets; `None` if one does.
fn unmet(table: &FaceTable, face: &Face, plan: LinePlan) -> Option<f64> {
    let (top, bottom) = table.extent(face);
    let is_met = plan.first_at_or_below(top) < plan.first_at_or_below(bottom);
    (!is_met).then_some(bottom - top)
}

/// How far from the raster's border an edge ends beyond the outermost line, the nearer of its ends.
fn ends_beyond(edge: &Edge, image: &SpanImage) -> Option<f64> {
    let (plan, height) = (image.plan(), f64::from(image.view().raster().height));
    let (first, last) = (plan.y(0), height - plan.y(0));
    let beyond = |y: f64| match y {
        y if (0.0..first).contains(&y) => Some(y),
        y if y > last && y <= height => Some(height - y),
        _ => None,
    };
    beyond(edge.top.y).or_else(|| beyond(edge.bottom.y))
}
