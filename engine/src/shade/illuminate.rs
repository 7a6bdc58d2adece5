//! Diffuse illumination by any number of lights.

use serde::{Deserialize, Serialize};
use std::sync::Arc;

use super::light::Light;
use crate::color::Color;
use crate::fragment::{Columns, Fragments, Shader};

/// Lights surfaces by Lambert's law: colour times the light received. Unlit surfaces stay as they are.
///
/// Flat faces under parallel light have one intensity all over, \[N]'s stored intensity; on curved
/// patches normals are interpolated.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Illuminate {
    /// The sources.
    pub lights: Vec<Arc<dyn Light>>,
    /// What a white surface that faces straight up shows of the light that is everywhere.
    pub sky: Color,
    /// What one that faces straight down shows. Between, the light of two uniform half-spaces,
    /// unoccluded: their irradiance goes with the cosine of the tilt.
    pub ground: Color,
}

#[typetag::serde]
impl Shader for Illuminate {
    fn reads(&self) -> Columns {
        let lights = self.lights.iter().fold(Columns::COLOR, |all, light| all | light.reads());
        if self.sky == self.ground { lights } else { lights | Columns::NORMAL }
    }

    fn shade(&self, fragments: &mut Fragments<'_>) {
        let mut light = if self.sky == self.ground {
            vec![self.sky; fragments.len()]
        } else {
            let up = |normal: &glam::Vec3| self.ground.mix(self.sky, 0.5 + 0.5 * normal.y);
            fragments.normal.iter().map(up).collect()
        };
        for source in &self.lights {
            source.add(fragments, &mut light);
        }
        let surfaces = fragments.color.iter_mut().zip(&fragments.unlit);
        for ((color, unlit), light) in surfaces.zip(light) {
            if !unlit {
                *color = *color * light;
            }
        }
    }
}
