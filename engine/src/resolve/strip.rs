//! Strips of a row: what a line stands for, with boundaries that may lean.

use std::ops::Range;

use crate::span::FaceId;

/// A strip of a row, in pixels of the picture. Outermost on either side is what lies beyond.
#[derive(Debug, Default)]
pub(super) struct Strip {
    /// Its share of the row.
    pub(super) weight: f64,
    /// Where its points lie, in raster pixels from the top.
    pub(super) y: f64,
    /// The faces from left to right.
    pub(super) faces: Vec<FaceId>,
    /// The left boundary of each face, at the top and the bottom of the strip; one more than faces.
    pub(super) top: Vec<f64>,
    pub(super) bottom: Vec<f64>,
    /// The face at the pixel that is looked at.
    pub(super) cursor: usize,
    /// The rightmost point of its left boundary, and the leftmost and rightmost of its right one.
    pub(super) left_high: f64,
    pub(super) right_low: f64,
    right_high: f64,
}

/// How far a boundary that runs straight from `top` to `bottom` lies to the right of 0, cut off at 0 and
/// `width`: the mean over its height.
#[inline(always)]
pub(super) fn left_of(top: f64, bottom: f64, width: f64) -> f64 {
    if top <= 0.0 && bottom <= 0.0 {
        return 0.0;
    }
    if top >= width && bottom >= width {
        return width;
    }
    // The difference below would have no digits left.
    if (bottom - top).abs() < 1e-9 {
        return top.clamp(0.0, width);
    }
    // The integral of a line cut off at 0 and `width`, over its length.
    let integral = |z: f64| {
        let z = z.max(0.0);
        if z < width { z * z / 2.0 } else { (z - width / 2.0) * width }
    };
    ((integral(bottom) - integral(top)) / (bottom - top)).clamp(0.0, width)
}

impl Strip {
    /// Makes it a strip that shows `face` from far left on.
    pub(super) fn begin(&mut self, weight: f64, y: f64, face: FaceId) {
        (self.weight, self.y, self.cursor) = (weight, y, 0);
        self.faces.clear();
        self.top.clear();
        self.bottom.clear();
        self.faces.push(face);
        self.top.push(f64::NEG_INFINITY);
        self.bottom.push(f64::NEG_INFINITY);
    }

    /// Ends it far right.
    pub(super) fn end(&mut self) {
        self.top.push(f64::INFINITY);
        self.bottom.push(f64::INFINITY);
        self.cursor = 0;
        self.look();
    }

    /// The face at the cursor.
    #[inline(always)]
    pub(super) fn face(&self) -> FaceId {
        self.faces[self.cursor]
    }

    /// Goes to the face at a pixel.
    #[inline(always)]
    pub(super) fn go_to(&mut self, x: f64) {
        // The last face ends at infinity, so that this does not run off the end.
        while self.right_high <= x {
            self.cursor += 1;
            self.look();
        }
    }

    /// Goes back to the first face.
    pub(super) fn rewind(&mut self) {
        self.cursor = 0;
        self.look();
    }

    /// Notes the boundaries of the face at the cursor.
    #[inline(always)]
    fn look(&mut self) {
        let i = self.cursor;
        self.left_high = self.top[i].max(self.bottom[i]);
        self.right_low = self.top[i + 1].min(self.bottom[i + 1]);
        self.right_high = self.top[i + 1].max(self.bottom[i + 1]);
    }

    /// How far boundary `i` lies to the right of `x`, cut off at 0 and `width`: the mean over the strip's
    /// height.
    #[inline(always)]
    pub(super) fn clipped(&self, i: usize, x: f64, width: f64) -> f64 {
        left_of(self.top[i] - x, self.bottom[i] - x, width)
    }

    /// Along how much of the pixel at `x` this strip's bottom and the next strip's top show different
    /// faces. Cursors must not lie beyond the pixel.
    pub(super) fn apart(&self, next: &Strip, x: f64) -> f64 {
        let (mut i, mut j, mut at, mut sum) = (self.cursor, next.cursor, x, 0.0);
        while at < x + 1.0 {
            let (end, next_end) = (self.bottom[i + 1], next.top[j + 1]);
            let to = end.min(next_end).clamp(at, x + 1.0);
            if self.faces[i] != next.faces[j] {
                sum += to - at;
            }
            at = to;
            i += usize::from(end <= at);
            j += usize::from(next_end <= at);
        }
        sum
    }

    /// The places of the faces seen in the pixel at `x`, wherever the cursor is.
    fn range_at(&self, x: f64) -> Range<usize> {
        let first = |ends: &[f64], x: f64| ends[1..].partition_point(|end| *end <= x);
        // Boundaries lean: a face may reach into the pixel at one end of the strip only.
        let from = first(&self.top, x).min(first(&self.bottom, x));
        let to = first(&self.top, x + 1.0).max(first(&self.bottom, x + 1.0));
        from.min(self.faces.len() - 1)..(to + 1).min(self.faces.len())
    }

    /// The faces seen in the pixel at `x`, wherever the cursor is.
    pub(super) fn faces_at(&self, x: f64) -> &[FaceId] {
        &self.faces[self.range_at(x)]
    }

    /// The part of the strip in the pixel at `x`.
    pub(super) fn pixel(&self, x: f64) -> Strip {
        let range = self.range_at(x);
        let mut strip = Strip::default();
        strip.begin(self.weight, self.y, self.faces[range.start]);
        for i in range.skip(1) {
            strip.faces.push(self.faces[i]);
            strip.top.push(self.top[i]);
            strip.bottom.push(self.bottom[i]);
        }
        strip.end();
        strip
    }

    /// The height, from 0 at the top to 1 at the bottom, nearest to the middle at which boundaries cross in
    /// the pixel at `x`.
    pub(super) fn meet(&self, x: f64) -> Option<f64> {
        let meets = (2..self.faces.len()).filter_map(|i| {
            let above = self.top[i] - self.top[i - 1];
            let below = self.bottom[i] - self.bottom[i - 1];
            // The gap between two neighbours is affine in height, and t is where it is 0.
            let t = above / (above - below);
            let at = self.top[i] + (self.bottom[i] - self.top[i]) * t;
            let crosses = above.min(below) < -1e-9 && t > 1e-6 && t < 1.0 - 1e-6;
            (crosses && at > x - 1e-9 && at < x + 1.0 + 1e-9).then_some(t)
        });
        meets.min_by(|a, b| (a - 0.5).abs().total_cmp(&(b - 0.5).abs()))
    }
}
