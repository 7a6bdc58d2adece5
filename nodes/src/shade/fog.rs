//! The node `Fog`: fog by stored depths (\[N], "Shading effects due to various types of light
//! sources"; \[D], "Rendering condition data structure").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::color::Color;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::shade::{self, FogHeight, FogLaw};
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::{Lamps, SpanDemand};
use std::sync::Arc;

/// Adds fog by the distance of each visible surface, before anything is resolved. A wire in front
/// of a far mountain keeps its own fog. The background is not changed.
///
/// Example: `Fog(image: "lit", density: 0.0024, color: "#e6d3b3", start: 40)`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Fog {
    /// The image.
    pub image: Link<SpanImage>,
    /// Share of light lost per metre; after 1 / density metres, 37 % is left. With 0 the image is
    /// returned as it is, unless the law is `Linear`. If absent, the `fog` of the scene's
    /// `environment`; if no scene of the image has one, 0.01.
    #[schemars(range(min = 0.0))]
    pub density: Option<f32>,
    /// The fog's own colour.
    pub color: Color,
    /// A SkyLight that gives the fog its brightness in each direction, instead of a colour.
    pub sky: Option<Link<Lamps>>,
    /// With `sky`, the illuminance in lux under which a white surface shows 1. If absent, that of
    /// the `Illuminate` that lit the image; if none did, 1.
    #[schemars(range(min = 1e-9, max = 1e9))]
    pub white: Option<f32>,
    /// The distance in metres that is free of fog.
    #[schemars(range(min = 0.0))]
    pub start: f32,
    /// How fog grows with distance: `Exponential`; `Squared`, clearer near and denser far;
    /// `Linear(end)`, from none at `start` to full at `end` metres.
    pub law: FogLaw,
    /// If given, the fog lies on the ground: its density falls to 37 % over this many metres
    /// upwards.
    pub falloff: Option<f64>,
    /// With `falloff`, the height in metres at which the density is `density`.
    pub level: f64,
}

impl Default for Fog {
    fn default() -> Fog {
        Fog {
            image: Link::default(),
            density: None,
            color: Color::grey(0.6),
            sky: None,
            white: None,
            start: 0.0,
            law: FogLaw::Exponential,
            falloff: None,
            level: 0.0,
        }
    }
}

impl Node for Fog {
    type Output = SpanImage;
    const KIND: &'static str = "Fog";
    const GROUP: &'static str = "shade";
    const ALIASES: &'static [&'static str] = &["Mist", "Haze", "DepthFog", "Atmosphere"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        if self.falloff.is_some_and(|falloff| falloff.is_nan() || falloff <= 0.0) {
            return Err(FieldError::new("falloff", "must be above 0 metres"));
        }
        match self.law {
            FogLaw::Linear(end) if end.is_nan() || end <= self.start => {
                let what = format!("Linear({end}): must end beyond the start, {} m", self.start);
                Err(FieldError::new("law", what))
            }
            FogLaw::Linear(_) if self.falloff.is_some() => {
                Err(FieldError::new("falloff", "goes with Exponential or Squared, not with Linear"))
            }
            _ => Ok(()),
        }
    }

    fn demand(&self, wanted: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        self.sky.iter().for_each(|sky| upstream.ask(sky, ()));
        Ok(())
    }

    fn evaluate(&self, _: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let height = self.falloff.map(|falloff| FogHeight { level: self.level, falloff });
        let image = inputs.get(&self.image);
        if image.sources().iter().any(|source| source.surfaces.beyond().is_some()) {
            inputs.warn(
                "the background is in the fog, as far away as it stands: put Background after Fog, to be seen \
                 through it, or fog it with `sky`",
            );
        }
        let sky = match &self.sky {
            Some(link) => {
                let white = self.white.or(image.white()).unwrap_or(1.0);
                Some((Lamps::sky(inputs, link)?, white))
            }
            None => None,
        };
        let known = image.environment().map(|environment| environment.fog as f32);
        let density = self.density.or(known).unwrap_or(0.01);
        let Fog { color, start, law, .. } = *self;
        let fog = shade::Fog { density, color, start, law, height, sky };
        image.shaded(Arc::new(fog))
    }

    fn passes(&self) -> Option<&Link<SpanImage>> {
        let is_nothing = self.density == Some(0.0) && !matches!(self.law, FogLaw::Linear(_));
        is_nothing.then_some(&self.image)
    }
}
