//! Light from a segment: a thin tube.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::polygon::Polygon;
use super::{Body, Light, Receiver, Sample};
use crate::color::Color;
use crate::math;
use crate::trace::Toward;

/// Sides of a tube that is seen.
const SIDES: u32 = 16;

/// A thin tube of equal luminance all over (\[N], "linear sources"): every metre of it has 1 candela across
/// its axis, and the sine of that in other directions.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Line {
    /// Its ends, in metres.
    pub ends: [DVec3; 2],
}

#[typetag::serde(name = "Line")]
impl Light for Line {
    fn toward(&self) -> Option<Toward> {
        None
    }

    fn irradiance(&self, at: &Receiver) -> Color {
        // Along the axis l, from the foot of the receiver's perpendicular of length h. An element gives
        // sin . cos / r^2 dl = h (h n_across + l n_along) / r^4 dl.
        let [start, end] = self.ends.map(|end| end - at.position);
        let length = (end - start).length();
        let axis = (end - start) / length;
        let first = start.dot(axis);
        let foot = start - axis * first;
        let h = foot.length();
        // On the axis itself the sine is 0: the tube is seen end on.
        if h.is_nan() || h <= 1e-12 * start.length().max(end.length()) {
            return Color::BLACK;
        }
        let (across, along) = (at.normal.dot(foot / h), at.normal.dot(axis));
        // The part above the receiver's horizon: h across + l along >= 0.
        let (mut from, mut to) = (first, first + length);
        let horizon = -h * across / along;
        if along > 0.0 {
            from = from.max(horizon);
        } else if along < 0.0 {
            to = to.min(horizon);
        } else if across <= 0.0 {
            return Color::BLACK;
        }
        if from >= to {
            return Color::BLACK;
        }
        // The antiderivatives of h^2 / r^4 and h l / r^4, but for a factor 1 / h.
        let square = |l: f64| h * h + l * l;
        let integral = |l: f64| {
            across * (l * h / square(l) + math::atan2(l, h)) / 2.0 - along * h * h / square(l) / 2.0
        };
        Color::grey(((integral(to) - integral(from)) / h).max(0.0) as f32)
    }

    fn facets(&self, _: &Receiver) -> Option<Vec<Vec<DVec3>>> {
        Some(vec![self.ends.to_vec()])
    }

    fn of_facet(&self, points: &[DVec3], at: &Receiver) -> Color {
        match *points {
            [start, end] => Line { ends: [start, end] }.irradiance(at),
            _ => Color::BLACK,
        }
    }

    fn body(&self, radius: f64) -> Option<Body> {
        let [start, end] = self.ends;
        let (u, v) = (end - start).normalize_or_zero().any_orthonormal_pair();
        let at = |i: u32| {
            let turn = f64::from(i) / f64::from(SIDES) * std::f64::consts::TAU;
            (u * math::cos(turn) + v * math::sin(turn)) * radius
        };
        let side = |i: u32| {
            let (a, b) = (at(i), at((i + 1) % SIDES));
            let outline = vec![start + a, start + b, end + b, end + a];
            Polygon { outline, holes: Vec::new() }
        };
        // From the side a metre of it shows an area of one diameter.
        let polygons = (0..SIDES).map(side).collect();
        Some(Body { polygons, luminance: 0.5 / radius, two_sided: false, casts: false })
    }

    fn sample(&self, at: &Receiver, choice: DVec2) -> Sample {
        let [start, end] = self.ends;
        let point = start + (end - start) * choice.x;
        let way = point - at.position;
        let (distance, length) = (way.length(), (end - start).length());
        let direction = way / distance;
        let sine = direction.cross((end - start) / length).length();
        let lux = length * sine * at.normal.dot(direction).max(0.0) / distance / distance;
        let lux = if lux.is_finite() { lux as f32 } else { 0.0 };
        Sample { toward: Toward::Point(point), irradiance: Color::grey(lux) }
    }
}
