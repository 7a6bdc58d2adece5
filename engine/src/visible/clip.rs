//! Polygons that reach behind the eye or far off the raster.
//!
//! A polygon is cut, in homogeneous coordinates, at the four sides of a *guard*: the raster and a wide
//! margin. The four half-spaces meet only in front of the eye, so that no near plane is needed, and
//! what remains has finite corners with all their precision. Outside the raster it does not matter
//! where the cut runs; inside nothing is changed.

use glam::DVec2;

use crate::camera::Homogeneous;
use crate::raster::Raster;

/// Width of the margin around the raster, in pixels.
const MARGIN: f64 = 65_536.0;

/// The guard of a raster.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Guard {
    low: DVec2,
    high: DVec2,
}

impl Guard {
    pub(crate) fn new(raster: Raster) -> Guard {
        let high = DVec2::new(f64::from(raster.width), f64::from(raster.height)) + MARGIN;
        Guard { low: DVec2::splat(-MARGIN), high }
    }

    /// The point on the screen, in pixels, if it is in front of the eye and inside the guard.
    #[inline(always)]
    pub(crate) fn screen(&self, p: &Homogeneous) -> Option<DVec2> {
        let point = DVec2::new(p.x / p.w, p.y / p.w);
        let inside = p.w > 0.0
            && point.x >= self.low.x
            && point.x <= self.high.x
            && point.y >= self.low.y
            && point.y <= self.high.y;
        inside.then_some(point)
    }

    /// Cuts a ring (Sutherland and Hodgman). The cuts of a concave ring may be joined along the guard's
    /// sides; such joints lie outside the raster and enclose nothing.
    pub(crate) fn clip(&self, ring: &[Homogeneous]) -> Vec<Homogeneous> {
        // Linear in x, y and w, and so right on both sides of the eye. Dividing by w comes only
        // after the cut.
        let sides: [&dyn Fn(&Homogeneous) -> f64; 4] = [
            &|p| p.x - self.low.x * p.w,
            &|p| self.high.x * p.w - p.x,
            &|p| p.y - self.low.y * p.w,
            &|p| self.high.y * p.w - p.y,
        ];
        let mut cut_ring = sides.iter().fold(ring.to_vec(), |ring, inside| {
            let mut out = Vec::with_capacity(ring.len() + 2);
            for (i, q) in ring.iter().enumerate() {
                let p = &ring[(i + ring.len() - 1) % ring.len()];
                let (at_p, at_q) = (inside(p), inside(q));
                if (at_p >= 0.0) != (at_q >= 0.0) {
                    out.push(cut(p, at_p, q, at_q));
                }
                if at_q >= 0.0 {
                    out.push(*q);
                }
            }
            out
        });
        // Inside all four sides, w is 0 at the eye itself and above 0 elsewhere.
        cut_ring.retain(|p| p.w > 0.0);
        cut_ring
    }
}

/// The point of an edge at which a linear function vanishes. Each end is weighed by the other's
/// distance: exact even where one end is farther than the other by all the digits of a double, and the
/// same in every bit for both faces of an edge.
fn cut(p: &Homogeneous, at_p: f64, q: &Homogeneous, at_q: f64) -> Homogeneous {
    let (s, t) = (at_q / (at_q - at_p), at_p / (at_p - at_q));
    let mix = |a: f64, b: f64| a * s + b * t;
    Homogeneous { x: mix(p.x, q.x), y: mix(p.y, q.y), r: mix(p.r, q.r), w: mix(p.w, q.w) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_road_under_the_eye_is_cut_far_outside_the_raster() {
        let guard = Guard::new(Raster::new(100, 100).unwrap());
        // A strip on the ground, 100 below the eye, from far ahead to behind.
        let at =
            |x: f64, d: f64| Homogeneous { x: 50.0 * d + x, y: 50.0 * d + 100.0, r: 1.0, w: d };
        for offset in [-3000.0, 0.0, 3000.0] {
            let ring = [
                at(offset - 10.0, -5.0),
                at(offset + 10.0, -5.0),
                at(offset + 10.0, 100.0),
                at(offset - 10.0, 100.0),
            ];
            let ring: Vec<DVec2> =
                guard.clip(&ring).iter().map(|p| DVec2::new(p.x / p.w, p.y / p.w)).collect();
            // The strip's sides meet the horizon at (50 + offset / d, 50 + 100 / d); down there it runs
            // out of the guard, so that its outline has corners beyond the raster on the side it goes to.
            let reach = ring.iter().map(|p| (*p - DVec2::splat(50.0)).abs().max_element());
            assert!(reach.fold(0.0, f64::max) > 65_000.0, "{offset}: {ring:?}");
            // Its middle line, where it is in the raster's rows, is inside.
            let p = DVec2::new(50.0 + offset * 0.4, 90.0);
            let crossings = (0..ring.len()).filter(|i| {
                let (a, b) = (ring[*i], ring[(i + 1) % ring.len()]);
                (a.y <= p.y) != (b.y <= p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
            });
            assert_eq!(crossings.count() % 2, 1, "{offset}: {ring:?}");
        }
    }

    #[test]
    fn neighbours_cut_their_edge_at_one_point() {
        let p = Homogeneous { x: 3.0, y: 1.0, r: 1.0, w: 2.0 };
        let q = Homogeneous { x: -7.0, y: 5.0, r: 1.0, w: -1.0 };
        assert_eq!(cut(&p, 0.3, &q, -0.9), cut(&q, -0.9, &p, 0.3));
    }

    #[test]
    fn an_end_at_the_end_of_the_world_leaves_the_other_where_it_is() {
        let guard = Guard::new(Raster::new(100, 100).unwrap());
        let at = |x: f64, y: f64| Homogeneous { x, y, r: 1.0, w: 1.0 };
        for far in [1e6, 1e12, 1e20, 1e100, 1e300] {
            let ring = guard.clip(&[at(-far, 10.0), at(50.0, 10.0), at(50.0, 90.0)]);
            // The long side descends from 90 to 10 over the whole way: level, as far as we see.
            let left = ring.iter().filter(|p| p.x < -60_000.0).map(|p| p.y / p.w);
            assert!(left.clone().count() == 2, "{far}: {ring:?}");
            let high = left.fold(0.0, f64::max);
            assert!((high - 90.0).abs() <= 80.0 * 65_586.0 / far + 1e-9, "{far}: {high}");
        }
    }

    #[test]
    fn what_is_behind_the_eye_vanishes() {
        let guard = Guard::new(Raster::new(100, 100).unwrap());
        let behind = |x: f64| Homogeneous { x, y: x * x, r: 1.0, w: -1.0 };
        assert!(guard.clip(&[behind(0.0), behind(1.0), behind(2.0)]).is_empty());
    }
}
