//! Fog by depth, before resolve: right at edges, where fog on resolved pixels is wrong.

use serde::{Deserialize, Serialize};

use crate::color::Color;
use crate::fragment::{Around, Columns, Fragments, Layers, Shader};
use crate::math;

/// Mixes surfaces with the fog's colour by the length of the way from the eye. \[N], "Shading effects":
/// "fog effect can be calculated using only depths".
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Fog {
    /// Share of light lost per metre, 0 or more: after a way of 1 / density, 37 % are left.
    pub density: f32,
    /// The fog's own colour.
    pub color: Color,
    /// The way in metres that is free of fog.
    pub start: f32,
}

#[typetag::serde]
impl Shader for Fog {
    fn reads(&self) -> Columns {
        Columns::COLOR | Columns::DEPTH
    }

    fn shade(&self, fragments: &mut Fragments<'_>, _: &Around<'_>) {
        let mut all = Vec::with_capacity(fragments.len());
        for i in 0..fragments.len() {
            let (x, y, depth) = (fragments.x[i], fragments.y[i], fragments.depth[i]);
            let view = fragments.view;
            let way = if view.is_parallel() {
                view.distance(depth)
            } else {
                view.eye_point(x, y, depth).length()
            };
            let through = math::expf(-self.density * (way as f32 - self.start).max(0.0));
            fragments.color[i] = self.color.mix(fragments.color[i], through);
            all.push(through);
        }
        if let Some(layers) = &mut fragments.layers {
            layers.map(|i, color| color * all[i]);
            let rest = layers.layer(Layers::REST, all.len());
            rest.iter_mut().zip(&all).for_each(|(rest, t)| *rest = *rest + self.color * (1.0 - t));
        }
    }
}
