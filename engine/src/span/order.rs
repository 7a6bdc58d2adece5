//! Which of two faces is seen: the one decision that everything rests on.
//!
//! On one line a face's depth is a pair of doubles, rounded once when the line is entered. In every
//! cell of the line the winner is the face with the greatest (depth at the cell's centre, rank, id).
//! Depths are compared *exactly*: first in floating point with a bound on its error, then, where the
//! bound does not decide, in exact arithmetic. So "nearer" is a total order in every cell, its maximum
//! does not depend on who is compared with whom first, and merging is associative, commutative and
//! idempotent bit for bit. There is no tolerance anywhere.
//!
//! That boundaries are whole cells is what makes this work: on five random faces whose crossings
//! nearly coincide, boundaries kept as doubles broke associativity in a fifth of the cases, even with
//! exact comparisons.

use std::cmp::Ordering;
use std::ops::Range;

use super::FaceId;
use crate::camera::Plane;
use crate::math;
use crate::raster::Raster;

/// A face on one line: what the winner rule compares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnLine {
    /// Depth slope: per half cell, times 2^(fraction bits + 1).
    a: f64,
    /// Depth at the line's left end, in the same unit.
    c: f64,
    /// Breaks ties of depth: a seal is over its face, an edge over both.
    rank: u32,
    /// Breaks ties of rank: the greater id wins.
    face: FaceId,
}

impl OnLine {
    /// No face.
    pub const BACKGROUND: OnLine = OnLine { a: 0.0, c: 0.0, rank: 0, face: FaceId::NONE };

    /// The face `face` with depth `plane` on the line at `y` pixels.
    #[inline(always)]
    pub fn new(plane: &Plane, rank: u32, face: FaceId, y: f64, raster: Raster) -> OnLine {
        // Scaling the intercept up by a power of two is exact; scaling the slope down might underflow.
        let scale = 2.0 * raster.cells_per_pixel();
        OnLine { a: plane.a, c: (plane.b * y + plane.c) * scale, rank, face }
    }

    /// The face.
    #[inline(always)]
    pub fn face(&self) -> FaceId {
        self.face
    }

    /// A bound, from below, of its depth rho over the centres of some cells.
    #[inline(always)]
    pub fn least_depth(&self, cells: Range<u32>, raster: Raster) -> f64 {
        let cell = if self.a > 0.0 { cells.start } else { cells.end - 1 };
        let p = self.a * (2.0 * f64::from(cell) + 1.0);
        let depth = p + self.c - (p.abs() + self.c.abs()) * 1e-14;
        depth / (2.0 * raster.cells_per_pixel())
    }

    /// How this face and `other` compare in a cell: `Greater` if this one is seen. `Equal` only for a
    /// face and itself.
    #[inline(always)]
    pub fn compare(&self, other: &OnLine, cell: u32) -> Ordering {
        self.compare_depth(other, cell)
            .then(self.rank.cmp(&other.rank))
            .then(self.face.cmp(&other.face))
    }

    /// The sign of the difference of depths at a cell's centre, exactly.
    #[inline(always)]
    fn compare_depth(&self, other: &OnLine, cell: u32) -> Ordering {
        // The cell's centre in half cells: a whole number below 2^33, so it is exact.
        let x = 2.0 * f64::from(cell) + 1.0;
        let (p, q) = (self.a * x, other.a * x);
        let difference = (p - q) + (self.c - other.c);
        // Five roundings, each at most half a unit of the largest sum that can occur.
        let magnitude = p.abs() + q.abs() + self.c.abs() + other.c.abs();
        if difference.abs() > magnitude * (8.0 * f64::EPSILON) {
            if difference > 0.0 { Ordering::Greater } else { Ordering::Less }
        } else {
            self.compare_depth_exactly(other, x)
        }
    }

    #[cold]
    #[inline(never)]
    fn compare_depth_exactly(&self, other: &OnLine, x: f64) -> Ordering {
        if self.a == other.a && self.c == other.c {
            return Ordering::Equal;
        }
        // x is an odd integer, so the products' errors are whole multiples of the smallest unit of a
        // and never underflow.
        let (p, p_error) = two_product(self.a, x);
        let (q, q_error) = two_product(other.a, x);
        sign_of_sum([p, p_error, self.c, -q, -q_error, -other.c])
    }

    /// Divides `cells` between this face and `other`: the cells below the returned boundary have the
    /// first winner, those from it on the second. \[N] fig. 6: the boundary is an end of `cells` where
    /// the faces do not cross (a) or overlap (c), and between where they cross (b).
    ///
    /// The exact difference of depths is affine in x, so the winner changes at most once.
    #[inline(always)]
    pub fn divide(&self, other: &OnLine, cells: Range<u32>) -> Division {
        debug_assert!(cells.start < cells.end, "a sample span has at least one cell");
        // A plane that cuts may be as near as the first face of all and have its rank and id: it loses, in all cells.
        let left = self.compare(other, cells.start).is_ge();
        let right = self.compare(other, cells.end - 1).is_ge();
        let boundary = if left == right { cells.end } else { self.crossing(other, cells, left) };
        Division { first_wins_left: left, boundary }
    }

    /// The first cell whose winner is not `left`, which is the winner at the start of `cells` but not
    /// at its end.
    #[inline(never)]
    fn crossing(&self, other: &OnLine, cells: Range<u32>, left: bool) -> u32 {
        // Invariant: the winner in `low` is `left`, in `high` it is not.
        let (mut low, mut high) = (cells.start, cells.end - 1);
        // Only a first guess: for planes that are nearly parallel it may be anything. NaN becomes
        // 0, and what lies outside is brought inside below. Exact comparisons decide.
        let estimate = -(self.c - other.c) / (self.a - other.a);
        let mut guess = ((estimate - 1.0) / 2.0).clamp(f64::from(low), f64::from(high)) as u32;
        let mut step = 1u32;
        // Close in on the estimate by growing steps, then bisect what is left.
        loop {
            if high - low <= 1 {
                return high;
            }
            guess = guess.clamp(low + 1, high - 1);
            if self.compare(other, guess).is_ge() == left {
                low = guess;
                if high - low <= 1 {
                    return high;
                }
                guess = low.saturating_add(step);
            } else {
                high = guess;
                guess = high.saturating_sub(step);
            }
            step = step.saturating_mul(2);
            if step > 64 {
                guess = low + (high - low) / 2;
            }
        }
    }
}

/// How two faces share a sample span.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Division {
    /// Whether the first face is seen at the left end.
    pub first_wins_left: bool,
    /// The first cell of the other winner, or the sample span's end if there is none.
    pub boundary: u32,
}

/// `a * b` as a double and its rounding error, exactly.
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    // A fused multiplication and addition rounds once, and the error of a product is a double.
    (product, math::fma(a, b, -product))
}

/// `a + b` as a double and its rounding error, exactly (Knuth).
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    (sum, (a - (sum - b_part)) + (b - b_part))
}

/// The sign of an exact sum, by Shewchuk's growing expansions: the parts do not overlap and grow in
/// magnitude, so the last that is not zero has the sign of the whole.
fn sign_of_sum<const N: usize>(terms: [f64; N]) -> Ordering {
    let mut expansion = [0.0; N];
    for (length, term) in terms.into_iter().enumerate() {
        let mut carry = term;
        for part in &mut expansion[..length] {
            let (sum, error) = two_sum(carry, *part);
            *part = error;
            carry = sum;
        }
        expansion[length] = carry;
    }
    let leading = expansion.iter().rev().find(|part| **part != 0.0);
    match leading {
        Some(part) if *part > 0.0 => Ordering::Greater,
        Some(_) => Ordering::Less,
        None => Ordering::Equal,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn on_line(a: f64, c: f64, rank: u32, id: u32) -> OnLine {
        OnLine { a, c, rank, face: FaceId(id) }
    }

    #[test]
    fn exact_sums_see_what_doubles_lose() {
        assert_eq!(sign_of_sum([1e300, 1.0, -1e300]), Ordering::Greater);
        assert_eq!(sign_of_sum([1e300, -1.0, -1e300, 1.0]), Ordering::Equal);
        assert_eq!(sign_of_sum([1.0, 1e-300, -1.0, -2e-300]), Ordering::Less);
        assert_eq!(sign_of_sum([0.0, -0.0]), Ordering::Equal);
    }

    #[test]
    fn nearer_wins_then_rank_then_id() {
        let near = on_line(0.0, 2.0, 0, 1);
        let far = on_line(0.0, 1.0, 9, 9);
        assert_eq!(near.compare(&far, 5), Ordering::Greater);
        let seal = on_line(0.0, 2.0, 1, 0);
        assert_eq!(seal.compare(&near, 5), Ordering::Greater);
        let later = on_line(0.0, 2.0, 0, 2);
        assert_eq!(later.compare(&near, 5), Ordering::Greater);
    }

    #[test]
    fn planes_a_unit_in_the_last_place_apart_are_told_apart() {
        let a = on_line(0.1, 1.0, 0, 0);
        let b = on_line(0.1, 1.0f64.next_up(), 0, 1);
        assert_eq!(b.compare(&a, 123_456_789), Ordering::Greater);
        let c = on_line(0.1f64.next_up(), 1.0, 0, 2);
        assert_eq!(c.compare(&a, 0), Ordering::Greater);
        assert_eq!(c.compare(&b, 0), Ordering::Less);
        assert_eq!(c.compare(&b, u32::MAX), Ordering::Greater);
    }

    #[test]
    fn slopes_too_small_for_their_products_do_not_underflow() {
        let tiny = f64::from_bits(3);
        let a = on_line(tiny, 0.0, 0, 0);
        let b = on_line(tiny, -f64::from_bits(1), 0, 1);
        assert_eq!(a.compare(&b, 7), Ordering::Greater);
    }

    #[test]
    fn crossing_faces_divide_at_the_cell_where_the_sign_flips() {
        let rising = on_line(1.0, 0.0, 0, 0);
        let falling = on_line(-1.0, 2001.0, 0, 1);
        // Depths are equal at x = 1000.5 half cells: cell 499 (999) is falling's, cell 500 (1001) not.
        let division = rising.divide(&falling, 0..10_000);
        assert_eq!(division, Division { first_wins_left: false, boundary: 500 });
        let division = rising.divide(&falling, 0..100);
        assert_eq!(division, Division { first_wins_left: false, boundary: 100 });
        let division = falling.divide(&rising, 500..501);
        assert_eq!(division, Division { first_wins_left: false, boundary: 501 });
    }

    #[test]
    fn every_cell_of_a_division_has_its_winner() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f64 / f64::from(1 << 23) - 1.0
        };
        for id in 0..500 {
            let a = on_line(random(), random() * 400.0, 0, id);
            let b = on_line(random(), random() * 400.0, 1, id + 1);
            let division = a.divide(&b, 3..401);
            for cell in 3..401 {
                let first = (cell < division.boundary) == division.first_wins_left;
                assert_eq!(a.compare(&b, cell).is_ge(), first, "{a:?} {b:?} {cell}");
            }
        }
    }

    #[test]
    fn a_face_at_the_very_depth_of_a_limit_divides_as_every_other() {
        // A limit of rank 0 and id 0, as the back plane is; the first face of all has these too.
        let limit = on_line(0.0, 9.0, 0, 0);
        for id in [0, 1] {
            // It is at the limit in the first cell and nearer behind it; and the other way round.
            let rising = on_line(1.0, 8.0, 0, id).divide(&limit, 0..10);
            assert_eq!(rising, Division { first_wins_left: true, boundary: 10 }, "{id}");
            let falling = on_line(-1.0, 28.0, 0, id).divide(&limit, 0..10);
            assert_eq!(falling, Division { first_wins_left: true, boundary: 10 }, "{id}");
        }
    }
}
