//! Integration rules: how lines become rows of pixels.
//!
//! | rule | lines lie | a line stands for | source |
//! |---|---|---|---|
//! | `Sampled(n, Trapezoid)` | on the row's borders and between, n + 1 | itself, weights 1/2n at the borders, 1/n between | \[N] eqs. 1 and 2 |
//! | `Sampled(n, Box)` | in the middle of n strips | its strip, weight 1/n | \[D] eq. 1 |
//! | `Sloped(n)` | in the middle of n strips | its strip, with the slopes of the edges that it crosses | ours |
//!
//! Scaling changes neither spans nor visibility. In x it is a product. In y a row of the scaled picture
//! takes other lines: [`Vertical::Whole`] is \[N] eq. 7, whole lines with equal weights, which differ
//! from row to row; [`Vertical::Fractions`] weighs lines by the exact share of the row that they stand
//! for.

use glam::DVec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::raster::{LinePlan, Phase, Raster, Rows};

/// How lines are integrated over pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub enum Rule {
    /// `Sampled(n, weighting)`: n lines per row, each taken as it is. The papers' own.
    Sampled(u32, Weighting),
    /// `Sloped(n)`: n lines per row; the boundaries that a line crosses keep their slope within the
    /// line's strip, so that edges are straight at any scale.
    Sloped(u32),
}

/// The weights of sampled lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub enum Weighting {
    /// \[N] eqs. 1 and 2: n + 1 lines, those on the row's borders weigh half.
    Trapezoid,
    /// \[D] eq. 1: n lines of equal weight.
    Box,
}

/// Which lines a row of a scaled picture takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub enum Vertical {
    /// Whole lines with equal weights, \[N] eq. 7. `Sloped` does not use it.
    Whole,
    /// Lines by the exact share of the row that they stand for.
    #[default]
    Fractions,
}

impl Rule {
    /// The lines that the rule needs.
    ///
    /// # Errors
    /// If n is out of range.
    pub fn plan(self) -> Result<LinePlan> {
        match self {
            Rule::Sampled(n, Weighting::Trapezoid) => LinePlan::new(n, Phase::Border),
            Rule::Sampled(n, Weighting::Box) | Rule::Sloped(n) => LinePlan::new(n, Phase::Centre),
        }
    }
}

/// How a raster is placed in a picture: scaled, moved, and a window cut out.
#[derive(Clone, Debug, PartialEq)]
pub struct Framing {
    /// Pixels of the picture per pixel of the raster, in x and y: T of \[N], above 0.
    pub scale: DVec2,
    /// Where the raster's top left corner lies in the picture, in pixels of the picture.
    pub pan: DVec2,
    /// The columns of the picture that are computed, half-open.
    pub columns: std::ops::Range<u32>,
    /// The rows of the picture that are computed, half-open.
    pub rows: Rows,
    /// Which lines a row takes.
    pub vertical: Vertical,
}

impl Framing {
    /// The raster as it is.
    pub fn whole(raster: Raster) -> Framing {
        Framing {
            scale: DVec2::ONE,
            pan: DVec2::ZERO,
            columns: 0..raster.width,
            rows: 0..raster.height,
            vertical: Vertical::default(),
        }
    }

    /// The raster scaled, in a picture that holds all of it.
    ///
    /// # Errors
    /// If a scale is not a positive number, or the picture would be longer than 65536 pixels on a side.
    pub fn scaled(raster: Raster, scale: DVec2) -> Result<Framing> {
        let size = Framing::size(raster, scale)?;
        Ok(Framing {
            scale,
            columns: 0..size.width,
            rows: 0..size.height,
            ..Framing::whole(raster)
        })
    }

    /// The size of the picture that holds a scaled raster: the nearest whole number of pixels, at
    /// least 1.
    ///
    /// # Errors
    /// As [`Framing::scaled`].
    pub fn size(raster: Raster, scale: DVec2) -> Result<Raster> {
        if !(scale.x > 0.0 && scale.y > 0.0 && scale.is_finite()) {
            return Err(Error::invalid(format!(
                "a scale of {} by {}: both must be numbers above 0",
                scale.x, scale.y
            )));
        }
        let side =
            |pixels: u32, scale: f64| (f64::from(pixels) * scale).round().clamp(1.0, 1e9) as u32;
        Raster::new(side(raster.width, scale.x), side(raster.height, scale.y))
    }

    /// The rows of the raster that the picture's rows need.
    pub fn raster_rows(&self, raster: Raster) -> Rows {
        let at = |row: u32| (f64::from(row) - self.pan.y) / self.scale.y;
        let height = f64::from(raster.height);
        // Eq. 7 may reach for the line before; one row more on either side is enough for every rule.
        let first = (at(self.rows.start).floor() - 1.0).clamp(0.0, height) as u32;
        let last = (at(self.rows.end).ceil() + 1.0).clamp(0.0, height) as u32;
        first..last.max(first)
    }
}

/// A line's part in a row of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share {
    /// The line, or none where the row reaches beyond the raster.
    pub line: Option<u32>,
    /// Its weight; those of a row sum to 1.
    pub weight: f64,
    /// The part of the line's strip that lies in the row, from 0 at its top to 1 at its bottom.
    pub strip: (f64, f64),
}

/// The lines of a row of the picture and their weights. `lines` is how many the raster has.
pub fn shares(rule: Rule, plan: LinePlan, framing: &Framing, row: u32, lines: u32) -> Vec<Share> {
    let n = f64::from(plan.per_row);
    // The row in units of lines: from the line, or strip border, `top` to `bottom`.
    let at = |row: f64| (row - framing.pan.y) * n / framing.scale.y;
    let (top, bottom) = (at(f64::from(row)), at(f64::from(row) + 1.0));
    let known = |k: f64| (k >= 0.0 && k < f64::from(lines)).then_some(k as u32);
    let share = |k: f64, weight: f64| Share { line: known(k), weight, strip: (0.0, 1.0) };
    match (rule, framing.vertical) {
        (Rule::Sampled(_, Weighting::Trapezoid), Vertical::Whole) => {
            // Eq. 7: rows I = row + 1 take the lines floor(n0 (I - 1) / T) to floor(n0 I / T); the two
            // on the borders also belong to the neighbouring rows, there with those rows' weights.
            let (first, last) = (top.floor(), bottom.floor());
            if first == last {
                return vec![share(first, 1.0)];
            }
            let count = last - first;
            let weight = |k: f64| if k == first || k == last { 0.5 / count } else { 1.0 / count };
            (0..=count as u32).map(|j| first + f64::from(j)).map(|k| share(k, weight(k))).collect()
        }
        (Rule::Sampled(_, Weighting::Box), Vertical::Whole) => {
            let (first, last) = (top.floor(), bottom.floor());
            let count = (last - first).max(1.0);
            (0..count as u32).map(|j| share(first + f64::from(j), 1.0 / count)).collect()
        }
        (Rule::Sampled(_, Weighting::Trapezoid), Vertical::Fractions) => {
            // The exact integral of the straight lines between neighbouring samples.
            let hat = |z: f64| {
                if z <= 0.0 {
                    (1.0 + z) * (1.0 + z) / 2.0
                } else {
                    1.0 - (1.0 - z) * (1.0 - z) / 2.0
                }
            };
            let integral =
                |k: f64| hat((bottom - k).clamp(-1.0, 1.0)) - hat((top - k).clamp(-1.0, 1.0));
            steps(top.floor(), bottom.ceil() + 1.0)
                .map(|k| share(k, integral(k) / (bottom - top)))
                .filter(|share| share.weight > 0.0)
                .collect()
        }
        (Rule::Sampled(_, Weighting::Box) | Rule::Sloped(_), _) => {
            steps(top.floor(), bottom.ceil())
                .map(|k| {
                    let (from, to) = (top.max(k) - k, bottom.min(k + 1.0) - k);
                    Share { strip: (from, to), ..share(k, (to - from) / (bottom - top)) }
                })
                .filter(|share| share.weight > 0.0)
                .collect()
        }
    }
}

/// The whole numbers of a half-open range.
fn steps(from: f64, to: f64) -> impl Iterator<Item = f64> {
    (0..(to - from).max(0.0) as u32).map(move |i| from + f64::from(i))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn framing(scale: f64, vertical: Vertical) -> Framing {
        let raster = Raster::new(10, 60).unwrap();
        Framing { vertical, ..Framing::scaled(raster, DVec2::new(1.0, scale)).unwrap() }
    }

    fn counts(n: u32, scale: f64) -> Vec<usize> {
        let rule = Rule::Sampled(n, Weighting::Trapezoid);
        let framing = framing(scale, Vertical::Whole);
        let shares = |row| shares(rule, rule.plan().unwrap(), &framing, row, 60 * n + 1);
        (0..6).map(|row| shares(row).len() - 1).collect()
    }

    #[test]
    fn equation_7_gives_the_papers_counts_of_lines() {
        // [N]: for n0 = 3 and T = 1.2 "the numbers of sub-scanlines for each scanline are 2, 3, 2, 3".
        assert_eq!(counts(3, 1.2), [2, 3, 2, 3, 2, 3]);
        // For T = 0.8 the paper's list drifts; the sums must stay on 3.75 a row.
        assert_eq!(counts(3, 0.8), [3, 4, 4, 4, 3, 4]);
        assert_eq!(counts(3, 1.0), [3; 6]);
    }

    #[test]
    fn weights_sum_to_one_whatever_the_scale() {
        for rule in [
            Rule::Sampled(3, Weighting::Trapezoid),
            Rule::Sampled(3, Weighting::Box),
            Rule::Sloped(3),
        ] {
            for vertical in [Vertical::Whole, Vertical::Fractions] {
                for scale in [0.05, 0.8, 1.0, 1.2, 2.5, 7.0] {
                    let framing = framing(scale, vertical);
                    for row in framing.rows.clone() {
                        let shares = shares(rule, rule.plan().unwrap(), &framing, row, 181);
                        let sum: f64 = shares.iter().map(|share| share.weight).sum();
                        assert!(
                            (sum - 1.0).abs() < 1e-12,
                            "{rule:?} {vertical:?} {scale} {row}: {sum}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn unscaled_fractions_are_the_papers_weights() {
        let at = |rule: Rule| {
            let framing = framing(1.0, Vertical::Fractions);
            let shares = shares(rule, rule.plan().unwrap(), &framing, 4, 181);
            shares.iter().map(|s| (s.line.unwrap(), s.weight)).collect::<Vec<_>>()
        };
        let close = |a: &[(u32, f64)], b: &[(u32, f64)]| {
            a.len() == b.len()
                && a.iter().zip(b).all(|(a, b)| a.0 == b.0 && (a.1 - b.1).abs() < 1e-12)
        };
        let third = 1.0 / 3.0;
        assert!(close(
            &at(Rule::Sampled(3, Weighting::Box)),
            &[(12, third), (13, third), (14, third)]
        ));
        // Between samples the trapezoid rule is the integral of straight lines; at whole rows both are
        // the same.
        let sixth = 1.0 / 6.0;
        let expected = [(12, sixth), (13, third), (14, third), (15, sixth)];
        assert!(close(&at(Rule::Sampled(3, Weighting::Trapezoid)), &expected));
    }
}
