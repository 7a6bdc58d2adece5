//! Rays, and where they go.

use glam::DVec3;
use std::cell::OnceCell;
use std::ops::Range;

use super::card::CardAxes;
use crate::camera::View;

/// A part of a straight line.
#[derive(Clone, Debug)]
pub struct Ray {
    pub(super) origin: DVec3,
    pub(super) direction: DVec3,
    pub(super) reach: f64,
    /// The axis that it follows most.
    along: usize,
    /// By how much the two axes after that one lean along it.
    lean: [f64; 2],
    /// How cards stand that it turns to where it comes from, once it has met one.
    level: OnceCell<CardAxes>,
}

/// The part of a line that lies in a box, of the ways `within`, in lengths of `along`.
pub(crate) fn part_in(
    (origin, along): (DVec3, DVec3),
    [low, high]: [DVec3; 2],
    within: Range<f64>,
) -> Option<Range<f64>> {
    let Range { start: mut from, end: mut to } = within;
    for axis in 0..3 {
        let (origin, along) = (origin[axis], along[axis]);
        let (low, high) = (low[axis], high[axis]);
        if along == 0.0 {
            if origin < low || origin > high {
                return None;
            }
            continue;
        }
        let (a, b) = ((low - origin) / along, (high - origin) / along);
        from = from.max(a.min(b));
        to = to.min(a.max(b));
    }
    (from <= to).then_some(from..to)
}

impl Ray {
    /// The part of a line from `origin` to `reach` lengths of `direction`.
    pub fn new(origin: DVec3, direction: DVec3, reach: f64) -> Ray {
        let size = direction.abs();
        // Divided by the greatest of the three, so that no lean is more than 1.
        let along = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(2);
        let lean = [1, 2].map(|next| direction[(along + next) % 3] / direction[along]);
        Ray { origin, direction, reach, along, lean, level: OnceCell::new() }
    }

    /// The point at a way, in lengths of its direction.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }

    /// Where it starts.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Where it goes; its length is the unit of ways along it.
    pub fn direction(&self) -> DVec3 {
        self.direction
    }

    /// To what a card turns that it meets: to its end, the light, if it has one, else back to where it comes
    /// from.
    pub(super) fn turns(&self) -> Toward {
        if self.reach.is_finite() {
            Toward::Point(self.at(self.reach))
        } else {
            Toward::Direction(-self.direction)
        }
    }

    /// How cards stand that it turns to where it comes from.
    pub(super) fn level(&self) -> &CardAxes {
        self.level.get_or_init(|| CardAxes::toward(-self.direction))
    }

    /// A point as seen along the ray, which is in the middle.
    #[inline(always)]
    pub(super) fn seen(&self, point: DVec3) -> (f64, f64) {
        // Points are sheared, not turned, until the ray runs along an axis. Each is rounded once,
        // alike for all pieces that share it.
        let from = point - self.origin;
        let (u, v, along) = match self.along {
            0 => (from.y, from.z, from.x),
            1 => (from.z, from.x, from.y),
            _ => (from.x, from.y, from.z),
        };
        (u - self.lean[0] * along, v - self.lean[1] * along)
    }
}

/// Where light comes from, or a ray goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Toward {
    /// Infinitely far in a direction, a unit vector.
    Direction(DVec3),
    /// To a point, in metres.
    Point(DVec3),
}

impl Toward {
    /// To the eye of a view.
    pub fn eye(view: &View) -> Toward {
        match view.is_parallel() {
            true => Toward::Direction(view.world_direction(DVec3::Z)),
            false => Toward::Point(view.camera().position),
        }
    }

    /// The way from a point: to the end at 1, or endless with length 1.
    pub fn from(self, point: DVec3) -> (DVec3, f64) {
        match self {
            Toward::Direction(direction) => (direction, f64::INFINITY),
            Toward::Point(end) => (end - point, 1.0),
        }
    }
}
