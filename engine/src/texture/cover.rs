//! How much of a footprint texels and rectangles are: exact, for indices, which are never mixed.

use glam::DVec2;

use super::Opened;
use super::filter::{Footprint, PictureView, Wrap};
use crate::error::Result;

/// A convex polygon of few corners: a parallelogram, and what is left of it between four lines.
#[derive(Clone, Copy)]
struct Outline {
    corners: [DVec2; 8],
    count: usize,
}

impl Outline {
    /// What a pixel covers, from a middle by two sides.
    fn new(middle: DVec2, right: DVec2, down: DVec2) -> Outline {
        let (a, b) = (right / 2.0, down / 2.0);
        let mut corners = [DVec2::ZERO; 8];
        let four = [middle - a - b, middle + a - b, middle + a + b, middle - a + b];
        corners[..4].copy_from_slice(&four);
        Outline { corners, count: 4 }
    }

    fn corners(&self) -> &[DVec2] {
        &self.corners[..self.count]
    }

    /// What of it lies between two places along an axis.
    fn between(&self, axis: usize, from: f64, to: f64) -> Outline {
        self.beyond(axis, from, 1.0).beyond(axis, to, -1.0)
    }

    /// What of it lies beyond a place along an axis. A convex polygon gets at most one corner more.
    fn beyond(&self, axis: usize, place: f64, sign: f64) -> Outline {
        let mut kept = Outline { corners: [DVec2::ZERO; 8], count: 0 };
        let mut push = |corner: DVec2| {
            if kept.count < kept.corners.len() {
                kept.corners[kept.count] = corner;
                kept.count += 1;
            }
        };
        let corners = self.corners();
        for (i, p) in corners.iter().enumerate() {
            let q = &corners[(i + 1) % corners.len()];
            let (a, b) = ((p[axis] - place) * sign, (q[axis] - place) * sign);
            if a >= 0.0 {
                push(*p);
            }
            if (a < 0.0) != (b < 0.0) && a != 0.0 {
                push(*p + (*q - *p) * (a / (a - b)));
            }
        }
        kept
    }

    fn area(&self) -> f64 {
        let corners = self.corners();
        let Some(first) = corners.first() else { return 0.0 };
        // As a fan from one corner: differences first, so that nothing is lost far from the origin.
        let fan = corners.windows(2).map(|pair| (pair[0] - *first).perp_dot(pair[1] - *first));
        fan.sum::<f64>().abs() / 2.0
    }

    /// From where to where it reaches along an axis.
    fn reach(&self, axis: usize) -> [f64; 2] {
        let places = self.corners().iter().map(|corner| corner[axis]);
        places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    }

    /// The whole numbers whose units it reaches into along an axis.
    fn range(&self, axis: usize) -> std::ops::RangeInclusive<i64> {
        let [low, high] = self.reach(axis);
        low.floor() as i64..=(high.ceil() as i64 - 1).max(low.floor() as i64)
    }
}

fn finite(v: DVec2) -> DVec2 {
    if v.is_finite() { v } else { DVec2::ZERO }
}

impl Footprint {
    /// The indices of a picture of indices that it covers, each texel's with its share of the footprint: shares sum
    /// to 1, or less where the picture ends. For footprints of few texels: the time is that of all of them.
    ///
    /// # Errors
    /// If the picture must be read and cannot be.
    pub fn indices(
        &self,
        picture: &Opened<'_>,
        wrap: [Wrap; 2],
        mut visit: impl FnMut(u8, f32),
    ) -> Result<()> {
        let look = PictureView { picture, wrap };
        let level = picture.level(0)?;
        // v is upwards.
        let size = DVec2::new(f64::from(level.width), -f64::from(level.height));
        let middle = DVec2::from(look.place(finite(self.at), &level));
        let whole = Outline::new(middle, finite(self.right) * size, finite(self.down) * size);
        let mut visit = |x: i64, y: i64, share: f64| {
            if let Some((x, y)) = look.within(&level, x, y) {
                visit(level.index(x, y), share as f32);
            }
        };
        let all = whole.area();
        let (columns, rows) = (whole.range(0), whole.range(1));
        if all <= 0.0 || columns.start() == columns.end() && rows.start() == rows.end() {
            let [x, y] = [middle.x, middle.y].map(|v| v.floor() as i64);
            visit(x, y, 1.0);
            return Ok(());
        }
        for y in rows {
            // A row of texels first: its columns cut what is left of four sides, and only where it
            // reaches.
            let row = whole.between(1, y as f64, y as f64 + 1.0);
            if row.count < 3 {
                continue;
            }
            for x in row.range(0) {
                let share = row.between(0, x as f64, x as f64 + 1.0).area() / all;
                if share > 0.0 {
                    visit(x, y, share);
                }
            }
        }
        Ok(())
    }

    /// How much of it lies in rectangles that repeat all over, each from its lower left to its upper right corner
    /// within -1 to 1; they do not overlap. For footprints of few units: the time is that of all of them.
    pub fn share_of(&self, rectangles: &[[DVec2; 2]]) -> f64 {
        // Near the origin, so that nothing is lost far away.
        let at = finite(self.at);
        let middle = at - at.floor();
        let whole = Outline::new(middle, finite(self.right), finite(self.down));
        let all = whole.area();
        if all <= 0.0 {
            return f64::from(u8::from(is_in(rectangles, middle)));
        }
        let [left, right] = whole.reach(0);
        let [bottom, top] = whole.reach(1);
        let mut sum = 0.0;
        for [low, high] in rectangles {
            // Those of its repetitions that are met.
            for i in (left - high.x).floor() as i64..=(right - low.x).floor() as i64 {
                for j in (bottom - high.y).floor() as i64..=(top - low.y).floor() as i64 {
                    let origin = DVec2::new(i as f64, j as f64);
                    let (low, high) = (*low + origin, *high + origin);
                    let part = whole.between(0, low.x, high.x).between(1, low.y, high.y);
                    sum += part.area() / all;
                }
            }
        }
        sum.clamp(0.0, 1.0)
    }
}

/// Whether a place is in rectangles that repeat all over, as [`Footprint::share_of`] has them.
pub fn is_in(rectangles: &[[DVec2; 2]], place: DVec2) -> bool {
    let place = place - place.floor();
    let mut around = [0.0, 1.0].into_iter().flat_map(|x| [0.0, 1.0].map(|y| DVec2::new(x, y)));
    around.any(|back| {
        let at = place - back;
        rectangles.iter().any(|[low, high]| at.cmpge(*low).all() && at.cmplt(*high).all())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::texels::Texels;
    use crate::image::{Coded, Codes, Coding, Layout};
    use crate::key::Key;
    use crate::texture::{Meaning, PictureSource, Store};
    use std::sync::Arc;

    fn footprint(at: [f64; 2], right: [f64; 2], down: [f64; 2]) -> Footprint {
        let [at, right, down] = [at, right, down].map(DVec2::from);
        Footprint { at, right, down }
    }

    /// The share of points of a footprint that are somewhere.
    fn counted(footprint: &Footprint, is_there: impl Fn(DVec2) -> bool) -> f64 {
        let n = 400;
        let part = |k: u32| (f64::from(k) + 0.5) / f64::from(n) - 0.5;
        let all = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
        let there = all
            .filter(|(i, j)| {
                is_there(footprint.at + footprint.right * part(*i) + footprint.down * part(*j))
            })
            .count();
        there as f64 / f64::from(n * n)
    }

    const CASES: [([f64; 2], [f64; 2], [f64; 2]); 6] = [
        ([0.3, 0.6], [0.2, 0.1], [-0.1, 0.3]),
        ([0.0, 0.0], [1.0, 0.0], [0.0, -1.0]),
        ([-7.9, 3.2], [1.7, 0.4], [0.9, -1.1]),
        ([1e6 + 0.25, -1e6 - 0.25], [0.5, -0.5], [0.5, 0.5]),
        ([0.5, 0.499], [0.0, 0.004], [0.9, 0.0]),
        ([0.51, 0.26], [1e-5, 0.0], [0.0, 1e-5]),
    ];

    #[test]
    fn rectangles_have_the_share_that_points_say() {
        let rectangles = [
            [DVec2::new(0.1, 0.0), DVec2::new(1.0, 0.45)],
            [DVec2::new(-0.4, 0.5), DVec2::new(0.5, 0.95)],
        ];
        let is_there = |p: DVec2| {
            let p = p - p.floor();
            let in_upper = (0.5..0.95).contains(&p.y) && !(0.5..0.6).contains(&p.x);
            (p.x >= 0.1 && p.y < 0.45) || in_upper
        };
        for (at, right, down) in CASES {
            let footprint = footprint(at, right, down);
            let share = footprint.share_of(&rectangles);
            let counted = counted(&footprint, is_there);
            assert!((share - counted).abs() < 4e-3, "{footprint:?}: {share} {counted}");
        }
        let point = footprint([0.55, 0.7], [0.0; 2], [0.0; 2]);
        assert_eq!(point.share_of(&rectangles), 0.0);
        assert_eq!(Footprint { at: DVec2::new(0.05, 0.7), ..point }.share_of(&rectangles), 1.0);
    }

    #[test]
    fn indices_have_the_share_that_points_say() {
        let (width, height) = (5u32, 3u32);
        let index = |x: u32, y: u32| (x * 7 + y * 3) % 4;
        let texel = |at: u32| index(at % width, at / width) as u8;
        let codes = Codes::Bytes((0..width * height).map(texel).collect());
        let (size, coding) = ((width, height), Coding::srgb());
        let coded = Arc::new(Coded { size, layout: Layout::Grey, codes, coding });
        let read = move || Ok(Texels::coded(coded.clone()));
        let meaning = Meaning::Indices([0, 1, 2, 3]);
        let source = PictureSource { key: Key::of("indices"), meaning, read: Box::new(read) };
        let store = Store::new(1 << 20);
        let opened = store.open(&source).unwrap();
        for (at, right, down) in CASES {
            let footprint = footprint(at, right, down);
            let mut shares = [0.0f64; 4];
            let visit = |index: u8, share: f32| shares[usize::from(index)] += f64::from(share);
            footprint.indices(&opened, [Wrap::Repeat; 2], visit).unwrap();
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-5, "{shares:?}");
            for (wanted, share) in (0..).zip(shares) {
                let counted = counted(&footprint, |p| {
                    let p = p - p.floor();
                    let x = (p.x * f64::from(width)) as u32;
                    let y = ((1.0 - p.y) * f64::from(height)) as u32;
                    index(x, y.min(height - 1)) == wanted
                });
                assert!((share - counted).abs() < 6e-3, "{footprint:?}: {share} {counted}");
            }
        }
    }
}
