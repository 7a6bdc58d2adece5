//! Integration rules: how lines become rows of pixels.
//!
//! | rule | lines lie | a line stands for | source |
//! |---|---|---|---|
//! | `Sampled(n, Trapezoid)` | on the row's borders and between, n + 1 | itself, weights 1/2n at the borders, 1/n between | \[N] eqs. 1 and 2 |
//! | `Sampled(n, Box)` | in the middle of n strips | its strip, weight 1/n | \[D] eq. 1 |
//! | `Sloped(n)` | in the middle of n strips | its strip, with the slopes of the edges that it crosses | ours |
//! | `Adaptive(n, tolerance)` | as for `Sloped(n)` | the same; pixels that may be off by more than the tolerance are divided where something happens | ours |
//! | `Exact` | as for `Sloped(16)` | the same; every pixel in which there may be an edge is divided until neighbouring strips agree | ours, the reference |
//!
//! Scaling changes neither spans nor visibility. In x it is a product. In y a row of the scaled picture
//! takes other lines: [`Vertical::Whole`] is \[N] eq. 7, whole lines with equal weights, which differ
//! from row to row; [`Vertical::Fractions`] weighs lines by the exact share of the row that they stand
//! for. A [`PixelFilter`] wider than the pixel weighs lines by its integral over the strips that they stand
//! for, whatever the rule.

use glam::DVec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::PixelFilter;
use crate::error::{Error, Result};
use crate::image::Window;
use crate::raster::{LinePlan, MAX_SIDE, Phase, Raster, Rows};
use crate::texture;

/// How lines are integrated over pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum Rule {
    /// `Sampled(n, weighting)`: n lines per row, each taken as it is. The papers' own.
    Sampled(u32, Weighting),
    /// `Sloped(n)`: n lines per row; the boundaries that a line crosses keep their slope within the
    /// line's strip, so that edges are straight at any scale.
    Sloped(u32),
    /// `Adaptive(n, tolerance)`: as `Sloped(n)`, but pixels whose coverage may be off by more than the
    /// tolerance, 0 to 1, are solved again between the lines. If the image, or one that was merged into
    /// it, was [written](crate::span::SpanWriter) line by line, nothing can be: it is `Sloped(n)`, and
    /// `aa_error` tells what is left.
    Adaptive(u32, f64),
    /// Every pixel in which something happens is solved again until nothing is left to find: areas to
    /// one part in a hundred thousand. Slow; what the others are measured against. Only where three faces
    /// cross in one point within a sixteenth of a row may a corner be missed.
    Exact,
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
    /// The rule that serves in place of this one where nothing can be asked for between the lines, as in a file.
    #[must_use]
    pub fn on_lines(self) -> Rule {
        match self {
            Rule::Adaptive(n, _) => Rule::Sloped(n),
            Rule::Exact => Rule::Sloped(16),
            Rule::Sampled(..) | Rule::Sloped(_) => self,
        }
    }

    /// The lines that the rule needs.
    ///
    /// # Errors
    /// If n is out of range.
    pub fn plan(self) -> Result<LinePlan> {
        match self {
            Rule::Sampled(n, Weighting::Trapezoid) => LinePlan::new(n, Phase::Border),
            Rule::Sampled(n, Weighting::Box) | Rule::Sloped(n) => LinePlan::new(n, Phase::Centre),
            Rule::Adaptive(n, tolerance) => {
                if !(0.0..=1.0).contains(&tolerance) {
                    return Err(Error::invalid(format!(
                        "a tolerance of {tolerance}: must be 0 to 1"
                    )));
                }
                Ok(LinePlan { probed: true, ..LinePlan::new(n, Phase::Centre)? })
            }
            Rule::Exact => Rule::Adaptive(16, 0.0).plan(),
        }
    }

    /// Whether the rule can be used with a filter.
    ///
    /// # Errors
    /// If it divides pixels and the filter reaches beyond them.
    pub fn check_filter(self, filter: PixelFilter) -> Result<()> {
        if self.tolerance().is_none() || filter == PixelFilter::Box {
            return Ok(());
        }
        Err(Error::invalid(format!(
            "{filter:?} with {self:?}: pixels are divided for the filter Box only; use Sloped with more lines"
        )))
    }

    /// By how much a pixel's coverage may be off before it is solved again; `None` if none ever is.
    pub fn tolerance(self) -> Option<f64> {
        match self {
            Rule::Sampled(..) | Rule::Sloped(_) => None,
            Rule::Adaptive(_, tolerance) => Some(tolerance),
            Rule::Exact => Some(0.0),
        }
    }
}

/// The most pixels that are computed at once: 8 GiB of colour.
pub const MAX_AREA: u64 = 1 << 29;

/// The longest side of a picture of which a part is computed, in pixels.
pub const MOST_SCALED: u32 = 1 << 30;

/// How a raster is placed in a picture: scaled, moved, and a window cut out.
#[derive(Clone, Debug, PartialEq, Serialize)]
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
    /// How much what lies beside a pixel's centre counts.
    pub filter: PixelFilter,
    /// How often faces are shaded.
    pub shading: Rate,
    /// How pictures on surfaces are filtered.
    pub textures: texture::TextureFilter,
}

/// How often faces are shaded: time for accuracy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub enum Rate {
    /// Each once, in the middle of its part of the picture, hidden there or not: \[N]'s stored intensity for all. Faces over each other, and the layers
    /// of lights, are shaded as by `Pixel`.
    Face,
    /// Each in each pixel, at the middle of what is seen of it there; once if it is alike all over.
    #[default]
    Pixel,
    /// Each on each line in each pixel.
    Line,
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
            filter: PixelFilter::Box,
            shading: Rate::default(),
            textures: texture::TextureFilter::default(),
        }
    }

    /// The raster scaled, in a picture that holds all of it.
    ///
    /// # Errors
    /// As [`size`](Framing::size).
    pub fn scaled(raster: Raster, scale: DVec2) -> Result<Framing> {
        let (width, height) = Framing::size(raster, scale)?;
        Ok(Framing { scale, columns: 0..width, rows: 0..height, ..Framing::whole(raster) })
    }

    /// Columns and rows of the picture that holds a scaled raster: the nearest whole numbers, at least 1. Only what
    /// is [cut](Framing::cut) out of it is computed, so that it may be far larger than what can be.
    ///
    /// # Errors
    /// As [`check_scale`](Framing::check_scale), or if a side is longer than [`MOST_SCALED`].
    pub fn size(raster: Raster, scale: DVec2) -> Result<(u32, u32)> {
        Framing::check_scale(scale)?;
        let sides = DVec2::new(f64::from(raster.width), f64::from(raster.height)) * scale;
        let sides = sides.round().max(DVec2::ONE);
        if sides.max_element() > f64::from(MOST_SCALED) {
            return Err(Error::invalid(format!(
                "a picture of {} by {} pixels: each side may be {MOST_SCALED}; scale it less",
                sides.x, sides.y
            )));
        }
        Ok((sides.x as u32, sides.y as u32))
    }

    /// Whether pictures can be scaled so.
    ///
    /// # Errors
    /// If a factor is not from 1e-6 to 1e6.
    pub fn check_scale(scale: DVec2) -> Result<()> {
        let fits = |factor: f64| (1e-6..=1e6).contains(&factor);
        if fits(scale.x) && fits(scale.y) {
            return Ok(());
        }
        let DVec2 { x, y } = scale;
        Err(Error::invalid(format!("a scale of {x} by {y}: both must be from 0.000001 to 1000000")))
    }

    /// The part of the picture that is computed: `window`, cut to the picture.
    ///
    /// # Errors
    /// If nothing is left, or more than [`MAX_AREA`] pixels.
    pub fn cut(self, window: Window) -> Result<Framing> {
        let (width, height) = (self.columns.end, self.rows.end);
        let Window { x, y, width: w, height: h } = window.within(width, height);
        if w == 0 || h == 0 {
            return Err(Error::invalid(format!(
                "a window of {} by {} pixels at {}, {} lies outside of the picture, which has {width} by {height}",
                window.width, window.height, window.x, window.y
            )));
        }
        if u64::from(w) * u64::from(h) > MAX_AREA || w.max(h) > MAX_SIDE {
            return Err(Error::invalid(format!(
                "{w} by {h} pixels at once: at most {MAX_AREA} fit, and {MAX_SIDE} to a side; compute the \
                 picture in windows"
            )));
        }
        Ok(Framing { columns: x..x + w, rows: y..y + h, ..self })
    }

    /// The part of the picture that is computed.
    pub fn window(&self) -> Window {
        Window {
            x: self.columns.start,
            y: self.rows.start,
            width: self.columns.len() as u32,
            height: self.rows.len() as u32,
        }
    }

    /// The rows of the raster that the picture's rows need.
    pub fn raster_rows(&self, raster: Raster) -> Rows {
        // How far the filter reaches beyond the pixel.
        let beyond = self.filter.radius() - 0.5;
        let at = |row: u32, beyond: f64| (f64::from(row) + beyond - self.pan.y) / self.scale.y;
        let height = f64::from(raster.height);
        // Eq. 7 may reach for the line before; one row more on either side is enough for every rule.
        let first = (at(self.rows.start, -beyond).floor() - 1.0).clamp(0.0, height) as u32;
        let last = (at(self.rows.end, beyond).ceil() + 1.0).clamp(0.0, height) as u32;
        first..last.max(first)
    }
}

/// A line's part in a row of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineShare {
    /// The line, or none where the row reaches beyond the raster.
    pub line: Option<u32>,
    /// Its weight; those of a row sum to 1.
    pub weight: f64,
    /// The part of the line's strip that lies in the row, from 0 at its top to 1 at its bottom.
    pub strip: (f64, f64),
}

/// The lines of a row of the picture and their weights. `lines` is how many the raster has.
pub fn shares(
    rule: Rule,
    plan: LinePlan,
    framing: &Framing,
    row: u32,
    lines: u32,
) -> Vec<LineShare> {
    let n = f64::from(plan.per_row);
    // The row in units of lines: from the line, or strip border, `top` to `bottom`.
    let at = |row: f64| (row - framing.pan.y) * n / framing.scale.y;
    let (top, bottom) = (at(f64::from(row)), at(f64::from(row) + 1.0));
    let all = (0.0, 1.0);
    if framing.filter != PixelFilter::Box {
        let kernel = framing.filter.kernel();
        let (middle, height) = ((top + bottom) / 2.0, bottom - top);
        let radius = framing.filter.radius() * height;
        // Where the strip that a line stands for begins, and where the last one ends.
        let (begin, end) = match plan.phase {
            Phase::Border => (-0.5, f64::from(lines) - 1.0),
            Phase::Centre => (0.0, f64::from(lines)),
        };
        let range = ((middle - radius - begin).floor(), (middle + radius - begin).ceil());
        let left_of = |y: f64| kernel.left_of((y.clamp(0.0, end) - middle) / height);
        return collect(range, lines, |k| (left_of(k + begin + 1.0) - left_of(k + begin), all));
    }
    match (rule, framing.vertical) {
        (Rule::Sampled(_, Weighting::Trapezoid), Vertical::Whole) => {
            // Eq. 7: rows I = row + 1 take the lines floor(n0 (I - 1) / T) to floor(n0 I / T); the two
            // on the borders also belong to the neighbouring rows, there with those rows' weights.
            let (first, last) = (top.floor(), bottom.floor());
            let count = last - first;
            let half = |k: f64| k == first || k == last;
            let weight = |k: f64| match count {
                0.0 => 1.0,
                _ if half(k) => 0.5 / count,
                _ => 1.0 / count,
            };
            collect((first, last + 1.0), lines, |k| (weight(k), all))
        }
        (Rule::Sampled(_, Weighting::Box), Vertical::Whole) => {
            let (first, last) = (top.floor(), bottom.floor());
            let count = (last - first).max(1.0);
            collect((first, first + count), lines, |_| (1.0 / count, all))
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
            let range = (top.floor(), bottom.ceil() + 1.0);
            collect(range, lines, |k| (integral(k) / (bottom - top), all))
        }
        _ => collect((top.floor(), bottom.ceil()), lines, |k| {
            let (from, to) = (top.max(k) - k, bottom.min(k + 1.0) - k);
            ((to - from) / (bottom - top), (from, to))
        }),
    }
}

/// The shares of the lines `range`, by a function that gives weight and part of the strip; what lies
/// beyond the raster, however much, is one share more.
fn collect(
    (from, to): (f64, f64),
    lines: u32,
    part: impl Fn(f64) -> (f64, (f64, f64)),
) -> Vec<LineShare> {
    let (first, last) = (from.max(0.0), to.min(f64::from(lines)));
    let count = (last - first).max(0.0) as u32;
    let share = |i: u32| {
        let k = first + f64::from(i);
        let (weight, strip) = part(k);
        LineShare { line: Some(k as u32), weight, strip }
    };
    let mut shares: Vec<LineShare> = (0..count).map(share).filter(|s| s.weight != 0.0).collect();
    if first > from || last < to {
        let inside: f64 = shares.iter().map(|share| share.weight).sum();
        if (1.0 - inside).abs() > 1e-12 {
            let beyond = LineShare { line: None, weight: 1.0 - inside, strip: (0.0, 1.0) };
            let is_above = first > from && last >= to;
            shares.insert(if is_above { 0 } else { shares.len() }, beyond);
        }
    }
    shares
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
