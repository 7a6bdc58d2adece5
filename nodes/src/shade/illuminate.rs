//! The node `Illuminate`: light and shadows (\[N], "Illuminance calculation" and "Shadow
//! processing"; \[D], "Shading display with shadow").

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::color::Color;
use spandrel_engine::fragment::Shader;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, NamedLink, Node, Upstream};
use spandrel_engine::light::sky::Ambient;
use spandrel_engine::light::{Lamp, Receiver};
use spandrel_engine::shade::{self, Bounces, Gather, Shadows};
use spandrel_engine::span::SpanImage;
use spandrel_engine::trace::{Reductions, Toward};
use spandrel_engine::values::{Lamps, SpanDemand};
use std::cell::LazyCell;
use std::sync::Arc;

/// Lights the surfaces of an image by any number of lights and an ambient light. A flat face under
/// parallel light has one intensity all over; curved faces are smooth. Surfaces of unlit materials
/// stay as they are. Every scene of the image casts shadows, seen or not. Light after a merge, and
/// shadows fall across clusters.
///
/// Example: `Illuminate(image: "town", lights: ["sun", "sky"], white: 90000, shadows: Volumes)`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Illuminate {
    /// The image.
    pub image: Link<SpanImage>,
    /// The lights.
    pub lights: Vec<NamedLink<Lamps>>,
    /// Light from above: what a white surface that faces straight up shows without any other light.
    /// If absent, that of the scene's `environment`. If no scene of the image has one: none beside
    /// a SkyLight, a PanoramaLight or an AmbientLight, else a tenth of white.
    pub ambient: Option<Color>,
    /// Light from below: what a white surface that faces straight down shows. If absent, the same
    /// as `ambient`, and every surface gets the same.
    pub ground: Option<Color>,
    /// The exposure: the illuminance in lux under which a white surface shows 1. A room needs some
    /// hundred, daylight some ten thousand. If absent, it is found from what the lights give to the
    /// middle of the scenes with nothing in the way. Up to 10 lux it is 1, for lights in units of
    /// your own. Above, it is the next power of ten (or the one up to 1.4 times less, if there is
    /// one), so that dimming is seen. A note gives the number.
    #[schemars(range(min = 1e-9, max = 1e9))]
    pub white: Option<f32>,
    /// How shadows are found. `Off`: none. `Volumes`: exact for light from one place, by rays for
    /// other light. `Analytic`: as `Volumes`, and exact also for panels, bodies and tubes where not
    /// too much is in front of them. `Rays(n)`: n rays to each light, 1 to 16384, spread over the
    /// pixel and the light. If absent, `Volumes`, or none if a scene's `environment` turns shadows
    /// off.
    #[schemars(extend("x-draft" = "Off"))]
    pub shadows: Option<Shadows>,
    /// With `Volumes`, the number of rays to each light that is not in one place, other than skies.
    /// With `Analytic`, to those that cannot be cut. With every setting, how finely such lights are
    /// seen in gloss, and the rays of faces too small for records.
    #[schemars(range(min = 1, max = 16384), extend("x-draft" = "1"))]
    pub samples: u32,
    /// How faces that may cast shadow volumes are found; affects speed only. `candidates`:
    /// `Shafts`, by a tree for every patch of a face; `Clusters`, \[N]'s; `SixSpaces`, \[D]'s,
    /// around point lights; `All` faces. `contours`: of closed bodies, only faces turned to the
    /// light cast.
    pub less: Reductions,
    /// How often light goes on from surface to surface before it is seen, 0 to 64: 0 is direct light
    /// alone, 1 shows how walls light each other, and with 8 next to nothing is left to come in most
    /// rooms. Then `ambient` is none if it is absent.
    #[schemars(range(min = 0, max = 64), extend("x-draft" = "0"))]
    pub bounces: u32,
    /// How the light is found that surfaces send on. `Records(n)`: by n rays, 16 to 65536, at places
    /// spread over each surface as finely as it varies there, and interpolated; with shadows that are
    /// `Volumes` or `Analytic`, light of skies is found so too. `Rays(n)`: by n rays, 1 to 65536, from
    /// each fragment: right in the mean, and grainy.
    pub gather: Gather,
}

impl Default for Illuminate {
    fn default() -> Illuminate {
        Illuminate {
            image: Link::default(),
            lights: Vec::new(),
            ambient: None,
            ground: None,
            white: None,
            shadows: None,
            samples: 16,
            less: Reductions::default(),
            bounces: 0,
            gather: Gather::default(),
        }
    }
}

/// The middle of an image's scenes, and the middles of its eight octants: a lamp may stand in one
/// of them.
fn middles(image: &SpanImage) -> Vec<DVec3> {
    let bounds =
        image.sources().iter().filter_map(|source| source.surfaces.rays()?.casters().bounds());
    let bounds = bounds.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)]);
    let [low, high] = bounds.unwrap_or_default();
    let eighths =
        (0..8).map(|k| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)));
    // Places where a room is, rather than its walls.
    let shares = eighths.map(|k| 0.25 + 0.5 * k).chain([DVec3::splat(0.5)]);
    shares.map(|share| low + share * (high - low)).collect()
}

/// The illuminance in lux that a lamp gives to a surface facing it, with nothing in the way. If it
/// varies, the median over some places.
fn declared(lamp: &Lamp, middles: impl FnOnce() -> Vec<DVec3>) -> f64 {
    if !lamp.shines() {
        return 0.0;
    }
    let light = &lamp.light;
    let is_far = matches!(light.toward(), Some(Toward::Direction(_)))
        || light.is_everywhere()
        || light.luminance(DVec3::Y).is_some();
    let places = if is_far { vec![DVec3::ZERO] } else { middles() };
    let most = |position: DVec3| {
        let toward = light.toward().map(|toward| toward.from(position).0);
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis, -axis]);
        let at = |normal| light.irradiance(&Receiver { position, normal }).luminance();
        f64::from(toward.into_iter().chain(axes).map(at).fold(0.0, f32::max))
    };
    let mut lux: Vec<f64> = places.into_iter().map(most).collect();
    lux.sort_by(f64::total_cmp);
    // The median: a place right beside the lamp would count for all.
    f64::from(lamp.strength.luminance()) * lux[lux.len() / 2]
}

/// Warnings about lights that are perhaps not as intended.
fn doubts(lamps: &[Lamp]) -> Vec<String> {
    let mut doubts = Vec::new();
    if !lamps.is_empty() && !lamps.iter().any(Lamp::shines) {
        doubts.push("none of the lights gives any light".to_owned());
    }
    let suns: Vec<(&Lamp, DVec3)> = lamps
        .iter()
        .filter(|lamp| lamp.shines())
        .filter_map(|lamp| match lamp.light.toward()? {
            Toward::Direction(direction) => Some((lamp, direction.normalize_or_zero())),
            Toward::Point(_) => None,
        })
        .collect();
    // With several it is not known which is the sun.
    if let [(sun, toward)] = suns[..] {
        for (sky, own) in lamps.iter().filter_map(|lamp| Some((lamp, lamp.light.sun()?))) {
            // About two degrees.
            if own.dot(toward) < 0.9994 {
                let [x, y, z] = toward.to_array().map(|v| (v * 1000.0).round() / 1000.0 + 0.0);
                doubts.push(format!(
                    "the sky of \"{}\" is not made for the sun of \"{}\", which stands elsewhere: give it \
                     `sun: ({x:.3}, {y:.3}, {z:.3})`",
                    sky.name, sun.name
                ));
            }
        }
    }
    doubts
}

impl Node for Illuminate {
    type Output = SpanImage;
    const KIND: &'static str = "Illuminate";
    const GROUP: &'static str = "shade";
    const ALIASES: &'static [&'static str] = &["ReLight", "Lighting", "Shade"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        for (field, color) in [("ambient", self.ambient), ("ground", self.ground)] {
            if color.is_some_and(|color| color.to_array().iter().any(|v| *v < 0.0)) {
                return Err(FieldError::new(field, "light must be 0 or more"));
            }
        }
        match self.shadows {
            Some(Shadows::Rays(n)) if !(1..=16384).contains(&n) => {
                Err(FieldError::new("shadows", format!("Rays({n}): must be 1 to 16384")))
            }
            _ => Ok(()),
        }?;
        match self.gather {
            Gather::Records(n) if !(16..=65536).contains(&n) => {
                Err(FieldError::new("gather", format!("Records({n}): must be 16 to 65536")))
            }
            Gather::Rays(n) if !(1..=65536).contains(&n) => {
                Err(FieldError::new("gather", format!("Rays({n}): must be 1 to 65536")))
            }
            _ => Ok(()),
        }
    }

    fn demand(&self, wanted: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        self.lights.iter().for_each(|light| upstream.ask(light, ()));
        Ok(())
    }

    fn evaluate(&self, _: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let image = inputs.get(&self.image);
        let named = |link| Lamps::named(inputs, link);
        let mut lamps: Vec<Lamp> = self.lights.iter().flat_map(named).collect();
        if image.shaders().any(<dyn Shader>::is::<shade::Trace>) {
            inputs.warn(
                "the image is traced already: its lights fall on what mirrors show. Put Trace after \
                 Illuminate",
            );
        }
        if image.shaders().any(<dyn Shader>::is::<shade::Fog>) {
            inputs.warn(
                "there is fog in the image already: it is lit as if it were paint. Put Fog after Illuminate",
            );
        }
        let environment = image.environment();
        doubts(&lamps).iter().for_each(|doubt| inputs.warn(doubt));
        let above = self.ambient.or(environment.map(|known| known.ambient));
        let is_around =
            |lamp: &&Lamp| lamp.light.is_everywhere() || lamp.light.luminance(DVec3::Y).is_some();
        let around = lamps.iter().find(is_around);
        if let (Some(lamp), Some(above)) = (around, above)
            && above.greatest() > 0.0
        {
            let whose =
                if self.ambient.is_some() { "`ambient`" } else { "the scene's ambient light" };
            inputs.note(&format!(
                "{whose} is added to the light of \"{}\", which comes from all around too; `ambient: (0, 0, 0)` \
                 leaves it out",
                lamp.name
            ));
        }
        let has_more = around.is_some() || self.bounces > 0;
        let above = above.unwrap_or(Color::grey(if has_more { 0.0 } else { 0.1 }));
        let mut shadows = self.shadows.unwrap_or(match environment {
            Some(known) if !known.shadows => {
                inputs.note(
                    "the scene's environment wants no shadows; `shadows: Volumes` casts them",
                );
                Shadows::Off
            }
            _ => Shadows::Volumes,
        });
        let white = self.white.unwrap_or_else(|| {
            // Found once, and only if a lamp stands somewhere: it takes all that casts.
            let middles = LazyCell::new(|| middles(&image));
            let lux = lamps.iter().map(|lamp| declared(lamp, || middles.clone())).sum::<f64>();
            let white = if lux > 10.0 { 10f64.powi((lux.log10() - 0.15).ceil() as i32) } else { 1.0 };
            if white > 1.0 {
                let lux = format!("{lux:.0}");
                inputs.note(&format!(
                    "the lights give some {lux} lux: `white` is {white:.0}, the illuminance that shows 1"
                ));
            }
            white as f32
        });
        let ambient = Ambient { above, below: self.ground.unwrap_or(above) };
        lamps.push(Lamp::new("own.ambient", true, Color::grey(white), Arc::new(ambient)));
        let Illuminate { samples, less, .. } = *self;
        let bounces = Bounces::new(self.bounces, self.gather);
        let shaded = |shadows: Shadows, lamps: Vec<Lamp>| {
            let bounces = bounces.clone();
            let lit = shade::Illuminate { lamps, white, shadows, samples, less, bounces };
            image.shaded(Arc::new(lit))
        };
        let mut lit = shaded(shadows, lamps.clone())?;
        if shadows != Shadows::Off
            && let Err(error) = lit.check_worlds()
        {
            if self.shadows.is_some() {
                return Err(error);
            }
            inputs.warn(&format!("there are no shadows: {error}"));
            shadows = Shadows::Off;
            lit = shaded(shadows, lamps)?;
        }
        if shadows != Shadows::Off {
            for source in image.sources().iter().filter(|source| source.surfaces.rays().is_none()) {
                inputs.warn(&format!(
                    "\"{}\" casts no shadows: its renderer does not say where its surfaces are",
                    source.label
                ));
            }
        }
        Ok(lit)
    }
}
