//! Refinement: pixels whose lines do not suffice are divided until neighbouring strips agree.
//!
//! A strip holds the boundaries of one line, followed straight to its top and its bottom. Where nothing
//! *happens* between two lines, no edge ends and none crosses another, the bottom of the one strip is the
//! top of the next, and both are exact. Where they disagree, or boundaries cross within a strip, it is
//! cut, where its boundaries meet or in the middle, and [probes](crate::span::Probe) in the middle of its
//! parts tell what is there; until what is left of the disagreement is tolerated. What lies between two
//! lines altogether makes none disagree; heights at which unseen edges end are told beforehand, and
//! strips are cut there first.
//!
//! Probes are asked of the image as it was made, so merges, holdouts and slices are refined as they are.

use std::ops::Range;
use std::sync::Arc;

use super::boundary::Boundaries;
use super::rule::Framing;
use super::stacks::Stacks;
use super::strip::Strip;
use crate::raster::Raster;
use crate::span::{Cut, FaceId, Probe, Span, SpanImage};

/// The error at which even the exact rule is content, in shares of a pixel.
const CONTENT: f64 = 1.0 / (1 << 22) as f64;
/// The most strips of a pixel.
const MOST: usize = 2048;
/// How near to a border a strip is cut that disagrees there, as a part of it: what happens at the very
/// border is closed in upon fast.
const NEAR: f64 = 1.0 / 16.0;

/// Divides pixels.
pub(super) struct Refiner<'a> {
    image: &'a SpanImage,
    framing: &'a Framing,
    tolerance: f64,
    boundaries: Boundaries<'a>,
    raster: Raster,
}

/// A pixel in strips.
#[derive(Debug)]
pub(super) struct DividedPixel {
    /// A column of the picture.
    pub(super) pixel: u32,
    /// From top to bottom.
    pub(super) strips: Vec<Strip>,
    /// By how much its coverage may be off.
    pub(super) error: f64,
}

/// A part of a pixel, between two heights of the raster, with what is known of it.
struct PixelPart {
    top: f64,
    bottom: f64,
    strip: Option<Strip>,
}

/// A pixel that is being divided.
struct OpenPixel {
    pixel: u32,
    cells: Range<u32>,
    parts: Vec<PixelPart>,
    /// What the rows above and below show of it at their borders.
    above: Option<Strip>,
    below: Option<Strip>,
    error: f64,
}

impl<'a> Refiner<'a> {
    pub(super) fn new(image: &'a SpanImage, framing: &'a Framing, tolerance: f64) -> Refiner<'a> {
        let (boundaries, raster) = (Boundaries::new(image), image.view().raster());
        Refiner { image, framing, tolerance, boundaries, raster }
    }

    /// Divides pixels, each given with the heights on the raster at which unseen edges end. `ends` are the
    /// heights between the strips of the row, and its own, and `beside` the strips above and below it.
    /// What cannot be probed is left out.
    ///
    /// The row's own strips do not serve: there the slopes of edges that end nearby fade, and such a strip
    /// may agree with both neighbours and be wrong between.
    pub(super) fn divide(
        &mut self,
        pixels: Vec<(u32, Vec<f64>)>,
        ends: &[f64],
        beside: [Option<&Strip>; 2],
        stacks: &mut Stacks<'_>,
    ) -> Vec<DividedPixel> {
        let whole = ends[ends.len() - 1] - ends[0];
        let inside = 0.0..f64::from(self.raster.height);
        let mut all: Vec<OpenPixel> = pixels
            .into_iter()
            .map(|(pixel, cuts)| {
                let x = f64::from(pixel);
                let mut parts = Vec::new();
                // More heights than there may be parts: those that lie close together count as one.
                let finest = if cuts.len() > MOST { 1.0 / MOST as f64 } else { CONTENT };
                for ends in ends.windows(2) {
                    let part = PixelPart { top: ends[0], bottom: ends[1], strip: None };
                    part.cut(&cuts, whole * finest, &mut parts);
                }
                let [above, below] = beside.map(|strip| strip.map(|strip| strip.pixel(x)));
                OpenPixel { pixel, cells: self.cells(pixel), parts, above, below, error: 0.0 }
            })
            .filter(|work| !work.cells.is_empty())
            .collect();
        let mut open: Vec<usize> = (0..all.len()).collect();
        while !open.is_empty() {
            let wanted = |at: &usize| {
                let work = &all[*at];
                let unknown = work.parts.iter().filter(|part| part.strip.is_none());
                let middle = |part: &PixelPart| (part.top + part.bottom) / 2.0;
                unknown.map(move |part| Probe { y: middle(part), cells: work.cells.clone() })
            };
            // All pixels of the row ask at once, round by round: probes that are neighbours share
            // their search.
            let probes: Arc<[Probe]> =
                open.iter().flat_map(wanted).filter(|probe| inside.contains(&probe.y)).collect();
            let made = self.image.probed(&probes).expect("what made the image makes it again");
            let Some(made) = made else { return Vec::new() };
            // Counts probes, not parts: beyond the raster none was asked for.
            let mut k = 0;
            for at in &open {
                let work = &mut all[*at];
                for part in work.parts.iter_mut().filter(|part| part.strip.is_none()) {
                    let y = (part.top + part.bottom) / 2.0;
                    let weight = (part.bottom - part.top) / whole;
                    let mut strip = Strip::default();
                    if inside.contains(&y) {
                        stacks.prepare(&made, k);
                        let line = within(stacks.spans(&made, k), &work.cells);
                        self.fill(&mut strip, part, weight, (&line, made.cuts().line(k)), stacks);
                        k += 1;
                    } else {
                        strip.begin(weight, y, FaceId::NONE);
                        strip.end();
                    }
                    part.strip = Some(strip);
                }
            }
            open.retain(|at| self.cut(&mut all[*at]));
        }
        let divided = |work: OpenPixel| DividedPixel {
            pixel: work.pixel,
            strips: work.parts.into_iter().filter_map(|part| part.strip).collect(),
            error: work.error,
        };
        all.into_iter().map(divided).collect()
    }

    /// The cells of a pixel.
    fn cells(&self, pixel: u32) -> Range<u32> {
        let at = |pixel: f64| {
            let x = (pixel - self.framing.pan.x) / self.framing.scale.x;
            (x * self.raster.cells_per_pixel()).clamp(0.0, f64::from(self.raster.cells()))
        };
        at(f64::from(pixel)).floor() as u32..at(f64::from(pixel) + 1.0).ceil() as u32
    }

    /// Cuts the parts of a pixel that disagree, unless that is tolerated; returns whether it did.
    fn cut(&self, work: &mut OpenPixel) -> bool {
        let x = f64::from(work.pixel);
        let strips: Vec<&Strip> =
            work.parts.iter().filter_map(|part| part.strip.as_ref()).collect();
        // By part: what it and its upper and its lower neighbour leave in doubt.
        let all = work.above.iter().chain(strips.iter().copied()).chain(&work.below);
        let borders = all.clone().zip(all.skip(1));
        let mut apart = borders.map(|(above, below)| above.apart(below, x));
        let mut above = if work.above.is_some() { apart.next().unwrap_or(0.0) } else { 0.0 };
        let doubt = |strip: &&Strip| {
            let below = apart.next().unwrap_or(0.0);
            let ends = [std::mem::replace(&mut above, below), below];
            ends.map(|apart| apart * strip.weight / 4.0)
        };
        let doubts: Vec<[f64; 2]> = strips.iter().map(doubt).collect();
        let mut error: f64 = doubts.iter().flatten().sum();
        let meets: Vec<Option<f64>> = strips.iter().map(|strip| strip.meet(x)).collect();
        let crossing = meets.iter().zip(&strips).filter(|(meet, _)| meet.is_some());
        error += crossing.map(|(_, strip)| strip.weight / 4.0).sum::<f64>();
        work.error = error;
        let content = self.tolerance.max(CONTENT);
        if error <= content || work.parts.len() >= MOST {
            return false;
        }
        // Each border's fair share of what is tolerated: if all together exceed it, at least one
        // exceeds its own.
        let least = content / (2.0 * strips.len() as f64);
        let mut has_cut = false;
        let mut parts = Vec::with_capacity(work.parts.len() * 2);
        for ((part, doubts), meet) in work.parts.drain(..).zip(doubts).zip(meets) {
            let height = part.bottom - part.top;
            let mut cuts = Vec::new();
            let is_in_doubt = doubts[0] + doubts[1] > least;
            if is_in_doubt || meet.is_some() {
                cuts.push(part.top + height * meet.unwrap_or(0.5));
            }
            if doubts[0] > least {
                cuts.push(part.top + height * NEAR);
            }
            if doubts[1] > least {
                cuts.push(part.bottom - height * NEAR);
            }
            let count = parts.len();
            part.cut(&cuts, 0.0, &mut parts);
            has_cut |= parts.len() > count + 1;
        }
        work.parts = parts;
        has_cut
    }

    /// The boundaries of a line, followed to the ends of a part.
    fn fill(
        &mut self,
        strip: &mut Strip,
        part: &PixelPart,
        weight: f64,
        (line, cuts): (&[Span], &[Cut]),
        stacks: &Stacks<'_>,
    ) {
        let y = (part.top + part.bottom) / 2.0;
        let place = |x: f64| x * self.framing.scale.x + self.framing.pan.x;
        let width = f64::from(self.raster.width);
        let push = |strip: &mut Strip, face, ends: [f64; 2]| {
            strip.faces.push(face);
            strip.top.push(place(ends[0]));
            strip.bottom.push(place(ends[1]));
        };
        // Left of the raster there is nothing. Left of any other pixel its first face goes on: only
        // the pixel counts.
        let left_end = line[0].x == 0;
        strip.begin(weight, y, if left_end { FaceId::NONE } else { line[0].face });
        if left_end {
            push(strip, line[0].face, [0.0, 0.0]);
        }
        self.boundaries.look_around(y);
        for pair in line.windows(2) {
            let faces = (pair[0].face, pair[1].face);
            let passing = self.boundaries.passing(stacks, cuts, faces, pair[1].x, y);
            let ends = [part.top, part.bottom].map(|end| passing.x(end, y));
            let here = self.raster.pixels(pair[1].x);
            let known = if ends.iter().all(|x| x.is_finite()) { ends } else { [here, here] };
            push(strip, pair[1].face, known);
        }
        // Only the pixel counts, so that what ends with the raster may as well do so in every one.
        push(strip, FaceId::NONE, [width, width]);
        strip.end();
    }
}

impl PixelPart {
    /// Appends the parts between heights, in any order, or the whole, if none lies in it by more than
    /// `margin`.
    fn cut(self, cuts: &[f64], margin: f64, out: &mut Vec<PixelPart>) {
        let margin = margin.max((self.bottom - self.top) * 1e-3);
        let mut inside: Vec<f64> = cuts.to_vec();
        inside.retain(|y| *y > self.top + margin && *y < self.bottom - margin);
        if inside.is_empty() {
            out.push(self);
            return;
        }
        inside.sort_unstable_by(f64::total_cmp);
        inside.dedup_by(|next, last| *next - *last < margin);
        let mut top = self.top;
        for bottom in inside.into_iter().chain([self.bottom]) {
            out.push(PixelPart { top, bottom, strip: None });
            top = bottom;
        }
    }
}

/// The part of a line within some cells; its first span begins with them.
fn within(line: &[Span], cells: &Range<u32>) -> Vec<Span> {
    let first = line.partition_point(|span| span.x <= cells.start) - 1;
    let inside = line[first..].iter().take_while(|span| span.x < cells.end);
    inside.map(|span| Span { x: span.x.max(cells.start), ..*span }).collect()
}
