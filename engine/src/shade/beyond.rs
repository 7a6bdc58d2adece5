//! Light on surfaces that only other surfaces see.
//!
//! A ray stands for a part of space that widens on its way. What it finds is the mean of what falls on a square as wide as
//! it, of lamps and of other surfaces alike: so borders of shadows are neither missed nor hit by chance, and many rays
//! share what was found once.

use glam::DVec3;
use std::sync::Arc;

use super::bounces::{Gathered, Place};
use super::pattern::spread_over_a_square;
use super::plane::{SurfacePlane, is_open};
use super::recorded::RecordedLamp;
use super::records::{Asked, Field, SquareKey, between, corner_at, gathered, lower, seed, unseen};

/// The least width of a square, as a part of the way from there to the camera.
const FINEST: f64 = 1.0 / 48.0;

/// The most times that light goes on after which squares are twice as wide as before.
const MOST_TURNS: u32 = 3;

/// How often squares are halved that something stands near to.
const CLOSER: u32 = 1;

/// Faces that are less wide than this, in widths of squares, have no record; up to the squares, one.
pub(super) const FINEST_FACE: f64 = 1.0 / 8.0;

/// The least width of squares for a place.
pub(super) fn finest(place: &Place, asked: &Asked<'_>) -> f64 {
    let turns = asked.gatherer.bounced.clamp(1, MOST_TURNS) - 1;
    place.width.max(place.before * FINEST * f64::from(1u32 << turns))
}

impl Field {
    /// What a place on a plane receives that only others see. False if no corner of its square is seen from it.
    pub(super) fn beyond(
        &self,
        place: &Place,
        (plane, finest): (&SurfacePlane, f64),
        asked: &Asked<'_>,
        sum: &mut Gathered,
    ) -> bool {
        let place_on_plane = plane.place(place.position);
        let mut level = plane.level(finest);
        let mut closer = CLOSER;
        let (square, key) = loop {
            let width = plane.width(level);
            let at = lower(place_on_plane, width);
            let key = SquareKey { plane: plane.key, first: 0, level, at };
            let square = self.square(key, plane, width, asked);
            // Toward what stands on a surface light falls off.
            if closer == 0 || !square.is_near {
                break (square, key);
            }
            (level, closer) = (level + 1, closer - 1);
        };
        // Not under a lock: what gathers may wait for others, who want these.
        if square.beyond.get().is_none() {
            let _ = square.beyond.set(std::array::from_fn(|k| {
                let at = [key.at[0] + (k & 1) as i64, key.at[1] + (k >> 1) as i64];
                self.about(SquareKey { at, ..key }, plane, asked)
            }));
        }
        let corners = square.beyond.get().expect("they are there").each_ref();
        between(place, (&square, key, plane), corners.map(|corner| &**corner), asked.casters, sum)
    }

    /// What falls on the square about a corner.
    fn about(&self, key: SquareKey, plane: &SurfacePlane, asked: &Asked<'_>) -> Arc<Gathered> {
        self.beyond.or_made(key, || {
            let width = plane.width(key.level);
            let corner = corner_at(plane, key, width, 0);
            let mut place = unseen((corner, plane.normal), seed(key.numbers()), asked);
            place.starts = starts(plane, corner, (width, asked.rays), asked);
            let openings = |lamp: &RecordedLamp<'_>| self.openings(lamp, &place, plane, asked);
            Arc::new(gathered(&place, asked.rays, asked, openings).0)
        })
    }
}

/// Places that are spread over a square about a corner and seen from it, of so many: what stands on the plane hides others.
pub(super) fn starts(
    plane: &SurfacePlane,
    corner: DVec3,
    (width, count): (f64, u32),
    asked: &Asked<'_>,
) -> Vec<DVec3> {
    let seed = seed(corner.to_array().map(|v| v.to_bits() as i64));
    let spread =
        (0..count).map(|k| corner + plane.along((spread_over_a_square(seed, k) - 0.5) * width));
    spread.filter(|at| is_open(asked.casters, corner, *at)).collect()
}
