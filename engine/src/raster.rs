//! The raster that visibility is solved for: rows, lines and cells.
//!
//! A *row* is a row of pixels. A *line* is a sub-scanline: a horizontal line across the raster, at
//! which the visible segments are known exactly. A *cell* is the smallest unit of x: boundaries
//! between segments are whole numbers of cells. Pixel (0, 0) is top left, y grows downwards, pixel
//! centres lie at +0.5, ranges are half-open.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

use crate::error::{Error, Result};

/// The largest width and height of a raster, in pixels.
pub const MAX_SIDE: u32 = 65_536;
/// The largest number of lines per row.
pub const MAX_LINES_PER_ROW: u32 = 1024;

/// The size of a raster in pixels, 1 to [`MAX_SIDE`] on each side, and the grid of its cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Raster {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Raster {
    /// A raster of the given size in pixels.
    ///
    /// # Errors
    /// If a side is 0 or longer than [`MAX_SIDE`].
    pub fn new(width: u32, height: u32) -> Result<Raster> {
        let sides = 1..=MAX_SIDE;
        if !sides.contains(&width) || !sides.contains(&height) {
            return Err(Error::invalid(format!(
                "a picture of {width} x {height} pixels: each side must be 1 to {MAX_SIDE}"
            )));
        }
        Ok(Raster { width, height })
    }

    /// Bits of fraction in a cell number: as many as the width leaves of 32. A cell of a raster
    /// 1920 pixels wide is 2^-21 pixels.
    pub fn fraction_bits(self) -> u32 {
        self.width.leading_zeros()
    }

    /// Cells in a line.
    pub fn cells(self) -> u32 {
        self.width << self.fraction_bits()
    }

    /// Cells in a pixel.
    pub fn cells_per_pixel(self) -> f64 {
        f64::from(1u32 << self.fraction_bits())
    }

    /// The boundary in cells of the point `x` pixels from the left, clamped to the raster. NaN
    /// gives 0.
    ///
    /// This is the only place where a boundary is rounded: to the nearest whole number of cells,
    /// ties to even. Everything after it is exact.
    #[inline(always)]
    pub fn cell(self, x: f64) -> u32 {
        // In [2^52, 2^53) a double's unit is 1, so adding 2^52 rounds to nearest.
        const ROUND: f64 = (1u64 << 52) as f64;
        let cells = (x * self.cells_per_pixel()).max(0.0).min(f64::from(self.cells()));
        (cells + ROUND).to_bits() as u32
    }

    /// The point in pixels from the left of a boundary in cells.
    #[inline(always)]
    pub fn pixels(self, cell: u32) -> f64 {
        f64::from(cell) / self.cells_per_pixel()
    }
}

impl fmt::Display for Raster {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} x {} pixels", self.width, self.height)
    }
}

/// Where the lines of a row lie.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
pub enum Phase {
    /// On the row's borders and evenly between: `y = k / n`. The lines on a border are shared by two
    /// rows, and the raster has one more line in all. The lines of \[N] eq. 1.
    Border,
    /// In the middle of n equal strips: `y = (k + 1/2) / n`. The lines of \[D] eq. 1.
    Centre,
}

/// The lines of a raster: how many to a row, and where they lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct LinePlan {
    /// Lines per row, 1 to [`MAX_LINES_PER_ROW`]: the n of both papers.
    pub per_row: u32,
    /// Where they lie.
    pub phase: Phase,
    /// Whether probes between the lines will be asked for, so that faces which no
    /// line meets must be kept.
    pub probed: bool,
}

impl LinePlan {
    /// A plan.
    ///
    /// # Errors
    /// If `per_row` is 0 or more than [`MAX_LINES_PER_ROW`].
    pub fn new(per_row: u32, phase: Phase) -> Result<LinePlan> {
        if !(1..=MAX_LINES_PER_ROW).contains(&per_row) {
            return Err(Error::invalid(format!(
                "{per_row} lines per row: must be 1 to {MAX_LINES_PER_ROW}"
            )));
        }
        Ok(LinePlan { per_row, phase, probed: false })
    }

    /// The height of line `k` in pixels from the top of the raster.
    #[inline(always)]
    pub fn y(self, k: u32) -> f64 {
        let half = if self.phase == Phase::Centre { 0.5 } else { 0.0 };
        (f64::from(k) + half) / f64::from(self.per_row)
    }

    /// The lines that the rows `rows` need, as a half-open range. With [`Phase::Border`] the
    /// last row's lower border is included.
    pub fn lines(self, rows: &Rows) -> std::ops::Range<u32> {
        let last = if self.phase == Phase::Border { 1 } else { 0 };
        rows.start * self.per_row..rows.end * self.per_row + last
    }

    /// The first line at or below `y` pixels, that is, with `self.y(k) >= y`. No line lies more than
    /// [`MAX_SIDE`] rows down: for a greater `y` the result is beyond all of them.
    #[inline(always)]
    pub fn first_at_or_below(self, y: f64) -> u32 {
        let half = if self.phase == Phase::Centre { 0.5 } else { 0.0 };
        let y = y.clamp(-1.0, f64::from(MAX_SIDE + 1));
        let mut k = (y * f64::from(self.per_row) - half).ceil().max(0.0) as u32;
        // The product above rounds; the definition is by `self.y`, which all code shares.
        while self.y(k) < y {
            k += 1;
        }
        while k > 0 && self.y(k - 1) >= y {
            k -= 1;
        }
        k
    }
}

impl fmt::Display for LinePlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = match self.phase {
            Phase::Border => "from the border",
            Phase::Centre => "centred",
        };
        let probed = if self.probed { ", probed" } else { "" };
        write!(f, "{} lines per row, {place}{probed}", self.per_row)
    }
}

/// A half-open range of rows.
pub type Rows = std::ops::Range<u32>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_use_all_the_bits_that_the_width_leaves() {
        for (width, bits) in [(1, 31), (2, 30), (640, 22), (1920, 21), (65_535, 16), (65_536, 15)] {
            let raster = Raster::new(width, 1).unwrap();
            assert_eq!(raster.fraction_bits(), bits);
            assert_eq!(u64::from(raster.cells()), u64::from(width) << bits);
        }
    }

    #[test]
    fn boundaries_round_to_nearest_and_clamp() {
        let raster = Raster::new(1920, 1080).unwrap();
        let cell = 1.0 / raster.cells_per_pixel();
        assert_eq!(raster.cell(10.0), 10 << 21);
        assert_eq!(raster.cell(10.0 + 0.6 * cell), (10 << 21) + 1);
        assert_eq!(raster.cell(10.0 + 0.4 * cell), 10 << 21);
        assert_eq!(raster.cell(-3.0), 0);
        assert_eq!(raster.cell(f64::NEG_INFINITY), 0);
        assert_eq!(raster.cell(f64::INFINITY), raster.cells());
        assert_eq!(raster.cell(f64::NAN), 0);
    }

    #[test]
    fn the_first_line_below_a_point_agrees_with_the_lines_own_heights() {
        for per_row in [1, 3, 7, 8, 100] {
            for phase in [Phase::Border, Phase::Centre] {
                let plan = LinePlan::new(per_row, phase).unwrap();
                for k in 0..2000 {
                    assert_eq!(plan.first_at_or_below(plan.y(k)), k);
                    assert_eq!(plan.first_at_or_below(plan.y(k) + 1e-9), k + 1);
                }
                assert_eq!(plan.first_at_or_below(f64::NEG_INFINITY), 0);
                assert!(plan.first_at_or_below(f64::INFINITY) > MAX_SIDE * per_row);
            }
        }
    }
}
