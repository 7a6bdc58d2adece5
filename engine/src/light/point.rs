//! Light from one place: parallel, points, spots, measured lamps.

use glam::{DMat3, DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::photometry::Photometry;
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
        let lux = self.beam.intensity(-direction) * cosine / distance / distance;
        Color::grey(lux.min(f64::from(f32::MAX)) as f32)
    }

    fn sample(&self, at: &Receiver, _: DVec2) -> Sample {
        Sample { toward: Toward::Point(self.position), irradiance: self.irradiance(at) }
    }
}
