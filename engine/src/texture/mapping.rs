//! From surfaces to pictures: processes 2 and 3 of \[D]'s mapping pipeline.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

use super::filter::{Footprint, Wrap};
use crate::error::{Error, Result};
use crate::math;

/// How a picture lies on a surface (\[D], "Geometry-dependent attribute data").
///
/// A mapping function takes a point of the object's own space to two lengths; origin, turn, length, scale and
/// offset take these to places of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Mapping {
    /// The mapping function.
    pub by: By,
    /// The point of the object that is the picture's lower left corner, or the middle of a cylinder or sphere, in
    /// metres. `Uv` has its own.
    pub origin: DVec3,
    /// By how much the picture is turned to the left, in degrees.
    pub turn: f64,
    /// \[D]'s actual length: what one picture takes to the right and upwards. In metres; round a cylinder or
    /// sphere, and with `Uv`, in the whole of these.
    pub length: DVec2,
    /// How often the picture stands in that, to the right and upwards. Below 0 it is mirrored.
    pub scale: DVec2,
    /// By how much the picture is moved to the left and down, in pictures.
    pub offset: DVec2,
    /// \[D]'s wraparound: what is beside the picture, to the right and left, and above and below.
    pub wrap: [Wrap; 2],
}

/// A mapping function: from three dimensions to two.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum By {
    /// The coordinates that the vertices carry, such as a patch's s and t.
    #[default]
    Uv,
    /// y to the right, z upwards: the projection to a plane of constant x.
    X,
    /// z to the right, x upwards: the projection to a plane of constant y.
    Y,
    /// x to the right, y upwards: the projection to a plane of constant z.
    Z,
    /// The projection to any plane: \[D]'s virtual rectangular canvas.
    Canvas {
        /// To the right.
        right: DVec3,
        /// Upwards.
        up: DVec3,
    },
    /// As from the six sides of a box, upright: by the axis to which a face is turned most.
    Box,
    /// Once round the y axis to the right, from behind; metres along it upwards.
    Cylinder,
    /// Once round the y axis to the right, from behind; from pole to pole upwards.
    Sphere,
}

impl Default for Mapping {
    fn default() -> Mapping {
        Mapping {
            by: By::Uv,
            origin: DVec3::ZERO,
            turn: 0.0,
            length: DVec2::ONE,
            scale: DVec2::ONE,
            offset: DVec2::ZERO,
            wrap: [Wrap::Repeat; 2],
        }
    }
}

/// A place on a surface, in its object's space.
pub struct SurfacePoint<'a> {
    /// The point, in metres.
    pub point: DVec3,
    /// From there by one pixel to the right and down, along the face.
    pub steps: [DVec3; 2],
    /// The face's normal.
    pub normal: DVec3,
    /// The coordinates that the vertices carry, at points of the face.
    pub uv: &'a dyn Fn(DVec3) -> DVec2,
}

impl Mapping {
    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<()> {
        let fault = |what: &str| Err(Error::invalid(format!("`mapping`: {what}")));
        let is_sound = |v: DVec2| v.is_finite() && v.abs().min_element() > 1e-12;
        if !is_sound(self.length) || self.length.min_element() < 0.0 {
            return fault("`length` must be above 0");
        }
        if !is_sound(self.scale) {
            return fault("`scale` must be finite and not 0");
        }
        if !(self.origin.is_finite() && self.offset.is_finite() && self.turn.is_finite()) {
            return fault("`origin`, `offset` and `turn` must be finite");
        }
        if let By::Canvas { right, up } = self.by {
            let across = right.normalize_or_zero().cross(up.normalize_or_zero());
            if across.is_nan() || across.length() < 1e-9 {
                return fault("`right` and `up` of a Canvas must point to different directions");
            }
        }
        Ok(())
    }

    /// What a pixel covers of the picture.
    pub fn footprint(&self, place: &SurfacePoint<'_>) -> Footprint {
        let of = |point: DVec3| self.lengths(point, place);
        let middle = of(place.point);
        let step = |step: DVec3| {
            let mut way = of(place.point + step) - middle;
            if matches!(self.by, By::Cylinder | By::Sphere) {
                // The seam is nowhere near.
                way.x -= way.x.round();
            }
            self.scaled(way)
        };
        let [right, down] = place.steps.map(step);
        Footprint { at: self.scaled(middle) + self.offset, right, down }
    }

    fn scaled(&self, way: DVec2) -> DVec2 {
        // [D], process 3: direction, actual length and scale. The offset is added to places alone,
        // not to steps, and wraparound is left to the filter.
        let way = match self.turn {
            0.0 => way,
            turn => {
                let (sin, cos) = (math::sin(turn.to_radians()), math::cos(turn.to_radians()));
                DVec2::new(way.x * cos + way.y * sin, way.y * cos - way.x * sin)
            }
        };
        way / self.length * self.scale
    }

    /// The mapping function.
    fn lengths(&self, point: DVec3, place: &SurfacePoint<'_>) -> DVec2 {
        // [D], process 2: from three dimensions to two lengths.
        let p = point - self.origin;
        match self.by {
            By::Uv => (place.uv)(point),
            By::X => DVec2::new(p.y, p.z),
            By::Y => DVec2::new(p.z, p.x),
            By::Z => DVec2::new(p.x, p.y),
            By::Canvas { right, up } => {
                // The dual basis, so that directions need not be at right angles.
                let (right, up) = (right.normalize(), up.normalize());
                let skew = right.dot(up);
                let (a, b) = (p.dot(right), p.dot(up));
                DVec2::new(a - b * skew, b - a * skew) / (1.0 - skew * skew)
            }
            By::Box => {
                let n = place.normal;
                let size = n.abs();
                if size.x >= size.y && size.x >= size.z {
                    DVec2::new(-p.z * n.x.signum(), p.y)
                } else if size.y >= size.z {
                    DVec2::new(p.x, -p.z * n.y.signum())
                } else {
                    DVec2::new(p.x * n.z.signum(), p.y)
                }
            }
            By::Cylinder => DVec2::new(round(p), p.y),
            By::Sphere => {
                let up = p.y / p.length();
                let up = if up.is_finite() { up } else { 0.0 };
                DVec2::new(round(p), 1.0 - math::acos(up.clamp(-1.0, 1.0)) / PI)
            }
        }
    }
}

/// The angle round the y axis from behind, to the right seen from outside, in turns.
fn round(p: DVec3) -> f64 {
    math::atan2(p.x, p.z) / TAU + 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(mapping: Mapping, point: DVec3, normal: DVec3) -> DVec2 {
        let uv = |p: DVec3| DVec2::new(p.x * 10.0, p.z * 10.0);
        let footprint =
            mapping.footprint(&SurfacePoint { point, steps: [DVec3::ZERO; 2], normal, uv: &uv });
        footprint.at
    }

    #[test]
    fn functions_are_those_of_the_paper() {
        let p = DVec3::new(2.0, 3.0, 5.0);
        let by = |by| at(Mapping { by, ..Mapping::default() }, p, DVec3::Y).to_array();
        assert_eq!(by(By::Uv), [20.0, 50.0]);
        assert_eq!(by(By::X), [3.0, 5.0]);
        assert_eq!(by(By::Y), [5.0, 2.0]);
        assert_eq!(by(By::Z), [2.0, 3.0]);
        assert_eq!(by(By::Canvas { right: DVec3::Z * 7.0, up: DVec3::Y }), [5.0, 3.0]);
        // Skew directions: 2 along x and 3 along (1, 1, 0) from (2, 3, 5) - 3 (1, 1, 0) = (-1, 0, 5).
        let skew = by(By::Canvas { right: DVec3::X, up: DVec3::new(1.0, 1.0, 0.0) });
        assert!((DVec2::from(skew) - DVec2::new(-1.0, 3.0 * 2f64.sqrt())).length() < 1e-12);
        assert_eq!(by(By::Box), [2.0, -5.0]);
    }

    #[test]
    fn boxes_are_upright_and_not_mirrored_from_all_sides() {
        let mapping = Mapping { by: By::Box, ..Mapping::default() };
        for normal in [DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z] {
            let right = DVec3::Y.cross(normal);
            let step = at(mapping, right, normal) - at(mapping, DVec3::ZERO, normal);
            assert_eq!(step, DVec2::X, "{normal}");
            assert_eq!(at(mapping, DVec3::Y, normal), DVec2::Y);
        }
    }

    #[test]
    fn round_things_have_their_middle_in_front_and_no_seam_in_footprints() {
        let front = |by| at(Mapping { by, ..Mapping::default() }, DVec3::Z, DVec3::Z);
        assert_eq!(front(By::Cylinder), DVec2::new(0.5, 0.0));
        assert_eq!(front(By::Sphere), DVec2::new(0.5, 0.5));
        let right = DVec3::new(1.0, 0.0, 1.0);
        let beside = at(Mapping { by: By::Cylinder, ..Mapping::default() }, right, right);
        assert!((beside.x - 0.625).abs() < 1e-12);
        let behind = SurfacePoint {
            point: DVec3::new(-1e-3, 0.0, -1.0),
            steps: [DVec3::X * 2e-3, DVec3::Y * 2e-3],
            normal: DVec3::NEG_Z,
            uv: &|_| DVec2::ZERO,
        };
        for by in [By::Cylinder, By::Sphere] {
            let seen = Mapping { by, ..Mapping::default() }.footprint(&behind);
            assert!((seen.right.x.abs() - 2e-3 / TAU).abs() < 1e-8, "{by:?} {seen:?}");
        }
    }

    #[test]
    fn lengths_scales_turns_and_offsets_do_what_they_say() {
        let mapping = Mapping {
            by: By::Z,
            origin: DVec3::new(1.0, 1.0, 0.0),
            turn: 90.0,
            length: DVec2::new(2.0, 4.0),
            scale: DVec2::new(3.0, -1.0),
            offset: DVec2::new(0.25, 0.5),
            ..Mapping::default()
        };
        // Two metres up from the origin are two to the right of a picture that is turned to the left.
        let seen = at(mapping, DVec3::new(1.0, 3.0, 9.0), DVec3::Z);
        assert!((seen - DVec2::new(3.25, 0.5)).length() < 1e-12, "{seen}");
        assert!(mapping.check().is_ok());
        for wrong in [
            Mapping { length: DVec2::new(0.0, 1.0), ..mapping },
            Mapping { length: DVec2::new(1.0, -1.0), ..mapping },
            Mapping { scale: DVec2::new(1.0, 0.0), ..mapping },
            Mapping { turn: f64::NAN, ..mapping },
            Mapping { by: By::Canvas { right: DVec3::X, up: DVec3::X * 2.0 }, ..mapping },
        ] {
            assert!(wrong.check().is_err(), "{wrong:?}");
        }
    }
}
