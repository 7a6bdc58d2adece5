//! Fog by depth, before resolve: right at edges, where fog on resolved pixels is wrong.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::color::Color;
use crate::fragment::{Around, Columns, Fragments, Hiding, LightLayers, Shader};
use crate::light::Lamp;
use crate::math;

/// Mixes surfaces with the fog's colour by the length of the way from the eye. \[N], "Shading effects":
/// "fog effect can be calculated using only depths".
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Fog {
    /// Share of light lost per metre, 0 or more: after a way of 1 / density, 37 % are left.
    pub density: f32,
    /// The fog's own colour.
    pub color: Color,
    /// The way in metres that is free of fog.
    pub start: f32,
    /// How it grows with the way.
    pub law: FogLaw,
    /// How it grows thinner upwards, if it does.
    pub height: Option<FogHeight>,
    /// A sky whose brightness it has in each direction, instead of its colour; and the illuminance in lux
    /// under which a white surface shows 1.
    pub sky: Option<(Lamp, f32)>,
}

/// How fog grows with the way w in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum FogLaw {
    /// exp(-density w) is left: air that is alike everywhere.
    #[default]
    Exponential,
    /// exp(-(density w)^2) is left: clearer near, denser far.
    Squared,
    /// All is left up to `start`, nothing beyond this way in metres, evenly between; density does nothing.
    Linear(f32),
}

/// Fog that lies on the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FogHeight {
    /// The height in metres, along y, at which the density is as said.
    pub level: f64,
    /// By how many metres upwards it falls to 37 %, above 0.
    pub falloff: f64,
}

impl FogHeight {
    /// The length of the way through fog of the full density that weakens light as much as a straight way
    /// of `length` between two heights.
    fn thinned(&self, length: f64, from: f64, to: f64) -> f64 {
        // exp(80) is thick enough, and stays finite in what follows.
        let thin = |y: f64| math::exp((-(y - self.level) / self.falloff).min(80.0));
        let rise = (to - from) / self.falloff;
        // The mean of the exponential between the ends.
        // A level way would be 0 over 0.
        let mean = if rise.abs() < 1e-6 { thin(from) } else { (thin(from) - thin(to)) / rise };
        length * mean
    }
}

impl Fog {
    /// The share of light that is left after a way between two heights, of what goes on for a way `before` it
    /// is seen.
    fn through(&self, way: f64, heights: [f64; 2], before: f64) -> f32 {
        let start = f64::from(self.start);
        // What of both ways lies behind the start.
        let gone = (before - start).max(0.0);
        let rest = (way - (start - before).max(0.0)).max(0.0);
        if let FogLaw::Linear(end) = self.law {
            let left = |way: f64| (1.0 - way / (f64::from(end) - start)).max(0.0);
            let (first, both) = (left(gone), left(gone + rest));
            // The way on and the way before multiply to what the whole way leaves.
            return if f64::from(end) > start && first > 0.0 { (both / first) as f32 } else { 0.0 };
        }
        let [from, to] = heights;
        let thinned = match &self.height {
            Some(height) if rest > 0.0 => {
                height.thinned(rest, from + (to - from) * ((way - rest) / way), to)
            }
            _ => rest,
        };
        let depth = f64::from(self.density) * thinned;
        let depth = match self.law {
            // What the way on adds counts as if it were as thick there.
            FogLaw::Squared if rest > 0.0 => depth * depth * (1.0 + 2.0 * gone / rest),
            FogLaw::Squared => 0.0,
            _ => depth,
        };
        math::expf(-depth as f32)
    }
}

#[typetag::serde]
impl Shader for Fog {
    fn reads(&self) -> Columns {
        Columns::COLOR | Columns::DEPTH
    }

    fn hiding(&self) -> Hiding {
        Hiding::Keeps
    }

    fn changes(&self) -> Columns {
        Columns::COLOR
    }

    fn shade(&self, fragments: &mut Fragments<'_>, _: &Around<'_>) {
        let mut all = Vec::with_capacity(fragments.len());
        for i in 0..fragments.len() {
            let (from, along, way) = fragments.way(i);
            let before = fragments.sight.as_ref().map_or(0.0, |sight| sight.before[i]);
            let through = self.through(way, [from.y, from.y + along.y * way], before);
            let color = match &self.sky {
                Some((lamp, white)) => {
                    let luminance = lamp.light.luminance(along).unwrap_or(Color::BLACK);
                    luminance * lamp.strength * (std::f32::consts::PI / white)
                }
                None => self.color,
            };
            fragments.color[i] = color.mix(fragments.color[i], through);
            all.push((through, color * (1.0 - through)));
        }
        if let Some(layers) = &mut fragments.layers {
            layers.map(|i, color| color * all[i].0);
            let rest = layers.layer(LightLayers::REST, all.len());
            rest.iter_mut().zip(&all).for_each(|(rest, (_, added))| *rest = *rest + *added);
        }
    }
}
