//! By how much a pixel may be off, and what is done about it.
//!
//! Lines know nothing of each other, yet where nothing happens between two of them, the boundaries of
//! the one, followed to the height in the middle, are those of the other. So the estimate of a pixel's
//! error is what they disagree about there: the length along which they show different faces, times
//! half the distance of the lines. An edge that ends between two lines, a crossing, a horizontal edge,
//! all leave such a gap; an edge that goes on leaves none. What lies between two lines unseen leaves
//! none either; where the image can be probed, the faces that no line meets are looked up and counted.

use super::refine::{DividedPixel, Refiner};
use super::rule::Framing;
use super::stacks::Stacks;
use super::strip::Strip;
use super::unseen;
use crate::span::SpanImage;
use crate::visible::probe::FaceIndex;

/// Examines rows of pixels.
pub(super) struct Doubt<'a> {
    image: &'a SpanImage,
    framing: &'a Framing,
    errors: Vec<f32>,
    divided: Vec<DividedPixel>,
    refines: Option<Refines<'a>>,
}

struct Refines<'a> {
    refiner: Refiner<'a>,
    index: &'a FaceIndex,
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
        index: &'a FaceIndex,
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
    pub(super) fn divided(&self) -> &[DividedPixel] {
        &self.divided
    }

    /// Estimates the errors of a row and divides where it must. `beside` are the strips above and below
    /// the row, where there are any.
    pub(super) fn examine(
        &mut self,
        row: u32,
        strips: &mut [Strip],
        mut beside: [Option<&mut Strip>; 2],
        stacks: &mut Stacks<'_>,
    ) {
        self.disagreements(strips, &mut beside);
        self.divided.clear();
        let Some(refines) = &mut self.refines else { return };
        let row_of_pixels = unseen::PixelRow::new(self.image, self.framing, row, strips, stacks);
        let mut events = row_of_pixels.events(refines.index, refines.tolerance, &mut self.errors);
        events.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut events = events.into_iter().peekable();
        let mut doubtful = Vec::new();
        for (pixel, error) in self.framing.columns.clone().zip(&self.errors) {
            let mut cuts = Vec::new();
            while let Some((_, y)) = events.next_if(|event| event.0 == pixel) {
                cuts.push(y);
            }
            // Events of pixels that are good enough are taken off the list all the same: both go
            // from left to right.
            if f64::from(*error) > refines.tolerance {
                doubtful.push((pixel, cuts));
            }
        }
        // Strips have weights, not heights. Added up from the row's top, those are where one ends
        // and the next begins.
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
            // All lines show one face over whole pixels: nothing to disagree about.
            if whole && run as u32 > pixel {
                pixel = run as u32;
                continue;
            }
            let [above, below] = beside.each_ref().map(|strip| strip.as_deref());
            let all = above.into_iter().chain(strips.iter()).chain(below);
            // Half of the distance between the middles of two strips is a quarter of their weights.
            // What is beside the row weighs nothing.
            let apart = |(above, below): (&Strip, &Strip)| {
                above.apart(below, x) * (above.weight + below.weight) / 4.0
            };
            let error = all.clone().zip(all.skip(1)).map(apart).sum::<f64>() as f32;
            let error = if needs_all { error.max(unseen::SOME) } else { error };
            self.errors[(pixel - columns.start) as usize] = error.min(1.0);
            pixel += 1;
        }
        strips.iter_mut().for_each(Strip::rewind);
    }
}
