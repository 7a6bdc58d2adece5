//! Light from one place: parallel, discs such as the sun's, points, spots, measured lamps.

use glam::{DMat3, DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, TAU};

use super::photometry::Photometry;
use super::polygon::ring;
use super::{Light, Receiver, Sample};
use crate::color::Color;
use crate::math;
use crate::trace::Toward;

/// Light from infinitely far, of 1 lux on what faces it.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Parallel {
    /// The unit vector to the light.
    pub toward: DVec3,
}

#[typetag::serde(name = "Parallel")]
impl Light for Parallel {
    fn toward(&self) -> Option<Toward> {
        Some(Toward::Direction(self.toward))
    }

    fn irradiance(&self, at: &Receiver) -> Color {
        Color::grey(at.normal.dot(self.toward).max(0.0) as f32)
    }

    fn sample(&self, at: &Receiver, _: DVec2) -> Sample {
        Sample { toward: Toward::Direction(self.toward), irradiance: self.irradiance(at) }
    }
}

/// Corners of the polygon that stands for a disc where it is cut.
const CORNERS: usize = 32;

/// How far away that polygon stands: behind everything, and so that numbers stay exact.
const DISTANCE: f64 = 1e15;

/// Light from a disc infinitely far away, of 1 lux on what faces it: the sun.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Disc {
    /// The unit vector to its middle.
    pub toward: DVec3,
    /// Its radius in radians, above 0 and at most a tenth.
    pub radius: f64,
}

impl Disc {
    /// The angle between two corners of the polygon, and its radius in its own distances: it has the disc's area.
    fn corners(&self) -> (f64, f64) {
        let step = TAU / CORNERS as f64;
        (step, math::tan(self.radius) * (step / math::sin(step)).sqrt())
    }

    /// The polygon that stands for the disc, seen from a point.
    fn polygon(&self, from: DVec3) -> Vec<DVec3> {
        let (step, radius) = self.corners();
        let (u, v) = self.toward.any_orthonormal_pair();
        let corner = |k: usize| {
            let turn = step * k as f64;
            let beside = u * math::cos(turn) + v * math::sin(turn);
            from + (self.toward + beside * radius) * DISTANCE
        };
        (0..CORNERS).map(corner).collect()
    }

    /// What the polygon gives, with a luminance of 1, to what faces it: Lambert's sum over equal edges.
    fn facing(&self) -> f64 {
        let (step, radius) = self.corners();
        // By symmetry all edges give the same: the angle of one, times the cosine of its plane.
        let to_edge = radius * math::cos(step / 2.0);
        let reach = (1.0 + to_edge * to_edge).sqrt();
        let angle = math::atan2(radius * math::sin(step / 2.0), reach);
        CORNERS as f64 * angle * to_edge / reach
    }
}

#[typetag::serde(name = "Disc")]
impl Light for Disc {
    fn toward(&self) -> Option<Toward> {
        Some(Toward::Direction(self.toward))
    }

    fn disc(&self) -> Option<(DVec3, f64)> {
        Some((self.toward, self.radius))
    }

    fn irradiance(&self, at: &Receiver) -> Color {
        let cosine = at.normal.dot(self.toward);
        // The horizon may cut it.
        if cosine.abs() < math::sin((self.radius * 1.01).min(FRAC_PI_2)) {
            return self.of_facet(&self.polygon(at.position), at);
        }
        Color::grey(cosine.max(0.0) as f32)
    }

    fn facets(&self, at: &Receiver) -> Option<Vec<Vec<DVec3>>> {
        Some(vec![self.polygon(at.position)])
    }

    fn of_facet(&self, points: &[DVec3], at: &Receiver) -> Color {
        Color::grey((ring(points, at).abs() / self.facing()) as f32)
    }

    fn sample(&self, at: &Receiver, choice: DVec2) -> Sample {
        let round = choice.x * TAU;
        // Spread evenly over the disc as it projects onto the plane that faces it.
        let across = math::sin(self.radius) * choice.y.sqrt();
        let along = (1.0 - across * across).sqrt();
        let (u, v) = self.toward.any_orthonormal_pair();
        let beside = u * math::cos(round) + v * math::sin(round);
        let direction = self.toward * along + beside * across;
        // Directions are spread by their cosine with the middle, which is taken out again.
        let lux = at.normal.dot(direction).max(0.0) / along;
        Sample { toward: Toward::Direction(direction), irradiance: Color::grey(lux as f32) }
    }
}

/// Light from a point.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Point {
    /// Where it is, in metres.
    pub position: DVec3,
    /// Where it goes.
    pub beam: Beam,
}

/// The luminous intensity of a point by direction, in candela.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Beam {
    /// 1 in all directions.
    All,
    /// 1 within a cone, falling off to nothing at a wider one: smoothly, as a function of the angle.
    Cone {
        /// The unit vector along the axis.
        axis: DVec3,
        /// The angle from the axis at which it is gone, in radians.
        outer: f64,
        /// The angle up to which it is whole.
        inner: f64,
        /// What goes through it, if it is not alike in all directions.
        of: Option<Measured>,
    },
    /// As measured.
    Measured(Measured),
}

/// The luminous intensity of a lamp as it was measured.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Measured {
    /// From the world's axes to the lamp's: to the right, up, and along its aim.
    pub frame: DMat3,
    /// The measurement.
    pub photometry: Box<Photometry>,
}

impl Measured {
    fn intensity(&self, direction: DVec3) -> f64 {
        self.photometry.intensity(self.frame * direction)
    }
}

impl Beam {
    /// The intensity in a direction, a unit vector.
    pub fn intensity(&self, direction: DVec3) -> f64 {
        match self {
            Beam::All => 1.0,
            Beam::Cone { axis, outer, inner, of } => {
                let angle = math::acos(axis.dot(direction).clamp(-1.0, 1.0));
                if angle >= *outer {
                    return 0.0;
                }
                // A cone with a hard edge has equal angles.
                let t = ((outer - angle) / (outer - inner).max(1e-12)).clamp(0.0, 1.0);
                let through = t * t * (3.0 - 2.0 * t);
                through * of.as_ref().map_or(1.0, |of| of.intensity(direction))
            }
            Beam::Measured(of) => of.intensity(direction),
        }
    }
}

#[typetag::serde(name = "Point")]
impl Light for Point {
    fn toward(&self) -> Option<Toward> {
        Some(Toward::Point(self.position))
    }

    fn irradiance(&self, at: &Receiver) -> Color {
        let way = self.position - at.position;
        let distance = way.length();
        let direction = way / distance;
        let cosine = at.normal.dot(direction);
        // In the point itself there is no light to speak of: NaN fails the test.
        if cosine.is_nan() || cosine <= 0.0 {
            return Color::BLACK;
        }
        // Divided twice, as the square of a large distance may overflow.
        let lux = self.beam.intensity(-direction) * cosine / distance / distance;
        Color::grey(lux.min(f64::from(f32::MAX)) as f32)
    }

    fn sample(&self, at: &Receiver, _: DVec2) -> Sample {
        Sample { toward: Toward::Point(self.position), irradiance: self.irradiance(at) }
    }
}
