//! By how much a pixel may be off, and what is done about it.
//!
//! Lines know nothing of each other, yet where nothing happens between two of them, the boundaries of
//! the one, followed to the height in the middle, are those of the other. So the estimate of a pixel's
//! error is what they disagree about there: the length along which they show different faces, times
//! half the distance of the lines. An edge that ends between two lines, a crossing, a horizontal edge,
//! all leave such a gap; an edge that goes on leaves none. What lies between two lines unseen leaves
//! none either; where the image can be probed, the faces that no line meets are looked up and counted.

use super::refine::{Divided, Refiner};
use super::rule::Framing;
use super::stacks::Stacks;
use super::strip::Strip;
use crate::raster::LinePlan;
use crate::span::{Edge, Face, FaceId, FaceTable, Role, SpanImage};
use crate::visible::probe::Index;

/// The doubt that is cast on every pixel in which an edge lies, if none is tolerated.
const SOME: f32 = 1e-7;

/// Examines rows of pixels.
pub(super) struct Doubt<'a> {
    image: &'a SpanImage,
    framing: &'a Framing,
    errors: Vec<f32>,
    divided: Vec<Divided>,
    refines: Option<Refines<'a>>,
}

struct Refines<'a> {
    refiner: Refiner<'a>,
    index: &'a Index,
    tolerance: f64,
}

impl<'a> Doubt<'a> {
    /// Estimates errors.
    pub(super) fn estimate(image: &'a SpanImage, framing: &'a Framing) -> Doubt<'a> {
        Doubt { image, framing, errors: Vec::new(), divided: Vec::new(), refines: None }
    }

    /// Estimates errors, and divides pixels that may be off by more than `tolerance`.
    pub(super) fn new(
        image: &'a SpanImage,
        index: &'a Index,
        framing: &'a Framing,
        tolerance: f64,
    ) -> Doubt<'a> {
        let refiner = Refiner::new(image, framing, tolerance);
        let refines = Some(Refines { refiner, index, tolerance });
        Doubt { refines, ..Doubt::estimate(image, framing) }
    }

    /// By pixel of the last row.
    pub(super) fn errors(&self) -> &[f32] {
        &self.errors
    }

    /// The pixels of the last row that were divided, from left to right.
    pub(super) fn divided(&self) -> &[Divided] {
        &self.divided
    }

    /// Estimates the errors of a row and divides where it must. `beside` are the strips above and below
    /// the row, where there are any.
    pub(super) fn examine(
        &mut self,
        row: u32,
        strips: &mut [Strip],
        mut beside: [Option<&mut Strip>; 2],
        stacks: &mut Stacks,
    ) {
        self.disagreements(strips, &mut beside);
        self.divided.clear();
        let Some(refines) = &mut self.refines else { return };
        let mut events =
            unseen(self.image, self.framing, refines, row, strips, stacks, &mut self.errors);
        events.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut events = events.into_iter().peekable();
        let mut doubtful = Vec::new();
        for (pixel, error) in self.framing.columns.clone().zip(&self.errors) {
            let mut cuts = Vec::new();
            while let Some((_, y)) = events.next_if(|event| event.0 == pixel) {
                cuts.push(y);
            }
            if f64::from(*error) > refines.tolerance {
                doubtful.push((pixel, cuts));
            }
        }
        let at = |y: f64| (y - self.framing.pan.y) / self.framing.scale.y;
        let mut ends = vec![at(f64::from(row))];
        let mut sum = 0.0;
        for strip in strips.iter() {
            sum += strip.weight;
            ends.push(at(f64::from(row) + sum));
        }
        let beside = beside.map(|strip| strip.map(|strip| &*strip));
        self.divided = refines.refiner.divide(doubtful, &ends, beside, stacks);
        for divided in &self.divided {
            let at = (divided.pixel - self.framing.columns.start) as usize;
            self.errors[at] = divided.error as f32;
        }
    }

    /// What neighbouring lines disagree about.
    fn disagreements(&mut self, strips: &mut [Strip], beside: &mut [Option<&mut Strip>; 2]) {
        let columns = self.framing.columns.clone();
        self.errors.clear();
        self.errors.resize(columns.len(), 0.0);
        let needs_all = self.refines.as_ref().is_some_and(|refines| refines.tolerance == 0.0);
        let mut pixel = columns.start;
        while pixel < columns.end {
            let x = f64::from(pixel);
            let mut run = f64::from(columns.end);
            let mut face = None;
            let mut whole = true;
            let others = beside.iter_mut().flatten().map(|strip| &mut **strip);
            for strip in strips.iter_mut().chain(others) {
                strip.go_to(x);
                whole &= strip.left_high <= x && *face.get_or_insert(strip.face()) == strip.face();
                run = run.min(strip.right_low);
            }
            if whole && run as u32 > pixel {
                pixel = run as u32;
                continue;
            }
            let all: Vec<&Strip> = beside[0]
                .iter()
                .map(|strip| &**strip)
                .chain(strips.iter())
                .chain(beside[1].iter().map(|strip| &**strip))
                .collect();
            let apart = |pair: &[&Strip]| {
                pair[0].apart(pair[1], x) * (pair[0].weight + pair[1].weight) / 4.0
            };
            let error = all.windows(2).map(apart).sum::<f64>() as f32;
            let error = if needs_all { error.max(SOME) } else { error };
            self.errors[(pixel - columns.start) as usize] = error.min(1.0);
            pixel += 1;
        }
        strips.iter_mut().for_each(Strip::rewind);
    }
}

/// The opaque face that ends a stack, or the face itself.
fn opaque(stacks: &Stacks, id: FaceId) -> Option<FaceId> {
    match stacks.get(id) {
        Some(faces) => faces.last().copied(),
        None => id.is_some().then_some(id),
    }
}

/// Casts doubt on the pixels in which faces may be seen that no line met; and, if nothing is tolerated,
/// on every pixel in which an edge may be seen. Returns the pixels and heights at which their edges end
/// or enter.
fn unseen(
    image: &SpanImage,
    framing: &Framing,
    refines: &Refines<'_>,
    row: u32,
    strips: &[Strip],
    stacks: &Stacks,
    errors: &mut [f32],
) -> Vec<(u32, f64)> {
    let raster = image.view().raster();
    let y_at = |row: u32| (f64::from(row) - framing.pan.y) / framing.scale.y;
    let (top, bottom) = (y_at(row), y_at(row + 1));
    let row_at = |y: f64| y.clamp(0.0, f64::from(raster.height)) as u32;
    let rows = row_at(top)..row_at(bottom.ceil());
    let height = bottom - top;
    let place = |x: f64| x * framing.scale.x + framing.pan.x;
    let columns = f64::from(framing.columns.start)..f64::from(framing.columns.end);
    // Beyond the outermost lines there is no other to disagree with.
    let is_outermost = rows.start == 0 || rows.end == raster.height;
    let mut events = Vec::new();
    // By pixel, the farthest that is seen; NaN where nobody looked yet.
    let mut depths = vec![f64::NAN; errors.len()];
    for id in refines.index.faces(rows) {
        let (source, face) = image.face(id);
        let thickness = unmet(&source.faces, face, image.plan());
        if refines.tolerance > 0.0 && thickness.is_none() && !is_outermost {
            continue;
        }
        for edge in source.faces.edges(face) {
            let Some((left, right)) = reach(&edge, top, bottom) else { continue };
            let thickness = thickness.or_else(|| ends_beyond(&edge, image));
            let (left, right) = (place(left), place(right));
            if right < columns.start || left >= columns.end {
                continue;
            }
            let first = left.max(columns.start) as u32;
            let last = right.min(columns.end - 1.0) as u32;
            for pixel in first..=last {
                let at = (pixel - framing.columns.start) as usize;
                let x = f64::from(pixel);
                let sides = [x, x + 1.0].map(|x| (x - framing.pan.x) / framing.scale.x);
                let corners = |id| {
                    let plane = image.face(id).1.plane;
                    let at = |x: f64| [top, bottom].map(|y| plane.depth(x, y));
                    let [p, q] = sides.map(at);
                    [p[0], p[1], q[0], q[1]].into_iter()
                };
                if depths[at].is_nan() {
                    let farthest = |id: Option<FaceId>| match id {
                        Some(id) => corners(id).fold(f64::INFINITY, f64::min),
                        None => f64::NEG_INFINITY,
                    };
                    let seen = strips.iter().flat_map(|strip| strip.faces_at(x));
                    let mut seen = seen.map(|id| opaque(stacks, *id));
                    depths[at] = if refines.tolerance == 0.0 {
                        // Between the lines there may be gaps: only what covers the pixel hides.
                        let covers = |id: &Option<FaceId>| {
                            id.is_some_and(|id| covers(image, id, sides, top, bottom))
                        };
                        seen.find(covers).map_or(f64::NEG_INFINITY, farthest)
                    } else {
                        seen.map(farthest).fold(f64::INFINITY, f64::min)
                    };
                }
                if corners(id).fold(f64::NEG_INFINITY, f64::max) < depths[at] {
                    continue;
                }
                // Of a face that no line meets, each edge counts half of what it may hide.
                let width = right.min(x + 1.0) - left.max(x);
                let share = thickness.map_or(0.0, |thick| width * (thick / height).min(1.0) / 2.0);
                let more = if refines.tolerance == 0.0 { SOME } else { share as f32 };
                if more == 0.0 {
                    continue;
                }
                errors[at] = (errors[at] + more).min(1.0);
                events.extend([edge.top.y, edge.bottom.y].map(|y| (pixel, y)));
                let along = (edge.bottom.y - edge.top.y) / (edge.bottom.x - edge.top.x);
                let entries = sides.map(|side| edge.top.y + (side - edge.top.x) * along);
                let is_on = |y: &f64| *y > edge.top.y && *y < edge.bottom.y;
                events.extend(entries.into_iter().filter(is_on).map(|y| (pixel, y)));
            }
        }
    }
    events.retain(|event| event.1 > top && event.1 < bottom);
    events
}

/// Whether a face that is seen in a part of the raster has no edge in it.
fn covers(image: &SpanImage, id: FaceId, sides: [f64; 2], top: f64, bottom: f64) -> bool {
    let (source, face) = image.face(id);
    let is_in = |edge: Edge| {
        reach(&edge, top, bottom).is_some_and(|(left, right)| left < sides[1] && right > sides[0])
    };
    let is_plain = face.role == Role::Face && !face.is_translucent;
    is_plain && !source.faces.edges(face).any(is_in)
}

/// The height of a face that no line of a plan meets; `None` if one does.
fn unmet(table: &FaceTable, face: &Face, plan: LinePlan) -> Option<f64> {
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    let points = table.rings(face).flat_map(|ring| ring.points());
    let (top, bottom) = points.fold(ends, |(top, bottom), p| (top.min(p.y), bottom.max(p.y)));
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

/// From which x to which an edge reaches between two heights.
fn reach(edge: &Edge, top: f64, bottom: f64) -> Option<(f64, f64)> {
    if edge.bottom.y < top || edge.top.y > bottom {
        return None;
    }
    let (p, q) = match edge.top.y == edge.bottom.y {
        true => (edge.top.x, edge.bottom.x),
        false => (edge.x_at(top.max(edge.top.y)), edge.x_at(bottom.min(edge.bottom.y))),
    };
    Some((p.min(q), p.max(q)))
}
