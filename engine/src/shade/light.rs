//! Light sources.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;

use crate::color::Color;
use crate::error::{Error, Result};
use crate::fragment::{Columns, Fragments};

/// A light source: what it adds to fragments, each light by itself (\[N], "Illuminance calculation"). It
/// is what it is saved as, like a [`Shader`](crate::fragment::Shader).
#[typetag::serde]
pub trait Light: Send + Sync + Debug {
    /// The columns that it reads.
    fn reads(&self) -> Columns;

    /// Adds the light that each fragment's surface receives: its irradiance divided by pi, so that 1
    /// makes a white diffuse surface white. `out` has one entry for each fragment.
    fn add(&self, fragments: &Fragments<'_>, out: &mut [Color]);
}

/// Light from infinitely far: the sun.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ParallelLight {
    direction: DVec3,
    color: Color,
}

impl ParallelLight {
    /// A light that travels along `direction`. `color` is what a white surface that faces it shows.
    ///
    /// # Errors
    /// If the direction has no length, or a number is not finite.
    pub fn new(direction: DVec3, color: Color) -> Result<ParallelLight> {
        let direction = direction
            .try_normalize()
            .ok_or_else(|| Error::invalid("a light's direction must have a length"))?;
        if !color.is_finite() {
            return Err(Error::invalid("a light's colour must be finite"));
        }
        Ok(ParallelLight { direction, color })
    }
}

#[typetag::serde]
impl Light for ParallelLight {
    fn reads(&self) -> Columns {
        Columns::NORMAL
    }

    fn add(&self, fragments: &Fragments<'_>, out: &mut [Color]) {
        let to_light = -self.direction.as_vec3();
        for (sum, normal) in out.iter_mut().zip(&fragments.normal) {
            *sum = *sum + self.color * normal.dot(to_light).max(0.0);
        }
    }
}
