//! The node `Trace`: mirrors and glass by rays (\[N], "Local ray tracing"; \[D], "High-quality
//! image display").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::color::Color;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::shade;
use spandrel_engine::span::SpanImage;
use spandrel_engine::trace::Accelerator;
use spandrel_engine::values::{Lamps, SpanDemand};
use std::sync::Arc;

/// Local ray tracing: shows reflections and refractions where a material's `finish` has `optics`,
/// and traces nothing else. What a ray meets is shaded like what the camera sees. Lights before
/// this node light it; fog after this node covers it, along the way from the mirror. Put `Trace`
/// after `Illuminate` and before `Fog`.
///
/// Example: `Trace(image: "lit", rays: 4, depth: 4, sky: "sky")`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Trace {
    /// The image.
    pub image: Link<SpanImage>,
    /// Images that rays also see, as they are: such as a sky that is merged later, behind the fog.
    pub beside: Vec<Link<SpanImage>>,
    /// Rays from each face in a pixel, spread over the visible part of the face.
    #[schemars(range(min = 1, max = 1024), extend("x-draft" = "1"))]
    pub rays: u32,
    /// How many times in a row a ray is reflected or refracted: 1 shows mirrors, but not mirrors in
    /// them. A pane of glass with two sides takes 2.
    #[schemars(range(min = 0, max = 64), extend("x-draft" = "1"))]
    pub depth: u32,
    /// Rays that count for less than this share of the picture are not followed. The surface they
    /// would leave shows its own colour.
    #[schemars(range(min = 1e-6, max = 1.0))]
    pub least: f32,
    /// What rays show that meet nothing. If absent, the `background` of the scene's `environment`;
    /// if no scene of the image has one, black.
    pub background: Option<Color>,
    /// A SkyLight that they show instead.
    pub sky: Option<Link<Lamps>>,
    /// With `sky`, the SunLights whose discs they show in front of it.
    pub suns: Vec<Link<Lamps>>,
    /// With `sky`, the illuminance in lux under which a white surface shows 1. If absent, that of
    /// the `Illuminate` that lit the image; if none did, 1.
    #[schemars(range(min = 1e-9, max = 1e9))]
    pub white: Option<f32>,
    /// How rays find what they meet; the picture is the same. `Tree`, or voxels that are stepped
    /// through: `Grid(cells: (32, 32, 32))`, or `Grid(size: 2.0)` with voxels of this many metres.
    /// A grid spans the whole scene, or a `window: ((-1, 0, -1), (1, 2, 1))` from corner to corner.
    pub accelerator: Accelerator,
}

impl Default for Trace {
    fn default() -> Trace {
        Trace {
            image: Link::default(),
            beside: Vec::new(),
            rays: 1,
            depth: 4,
            least: 0.002,
            background: None,
            sky: None,
            suns: Vec::new(),
            white: None,
            accelerator: Accelerator::Tree,
        }
    }
}

impl Node for Trace {
    type Output = SpanImage;
    const KIND: &'static str = "Trace";
    const GROUP: &'static str = "shade";
    const ALIASES: &'static [&'static str] =
        &["RayTrace", "Mirror", "Reflect", "Refract", "LocalRays"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        if self.sky.is_none() && !self.suns.is_empty() {
            return Err(FieldError::new("suns", "stand before a `sky`: there is none"));
        }
        match &self.accelerator {
            Accelerator::Tree => Ok(()),
            Accelerator::Grid(voxels) => {
                voxels.check().map_err(|what| FieldError::new("accelerator", what))
            }
        }
    }

    fn demand(&self, wanted: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        self.beside.iter().for_each(|image| upstream.ask(image, wanted.clone()));
        self.sky.iter().chain(&self.suns).for_each(|light| upstream.ask(light, ()));
        Ok(())
    }

    fn evaluate(&self, _: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let image = inputs.get(&self.image);
        let sky = match &self.sky {
            Some(link) => {
                let white = self.white.or(image.white()).unwrap_or(1.0);
                Some(Lamps::seen(inputs, link, &self.suns, white)?)
            }
            None => None,
        };
        let known = image.environment().map(|environment| environment.background);
        let background = self.background.or(known).unwrap_or(Color::BLACK);
        let others: Vec<_> = self.beside.iter().map(|link| inputs.get(link)).collect();
        let others: Vec<&SpanImage> = others.iter().map(|image| &**image).collect();
        let Trace { rays, depth, least, accelerator, .. } = *self;
        let shader = shade::Trace { rays, depth, least, background, sky, accelerator };
        if !image.is_mirroring() {
            inputs.warn(
                "nothing of the image mirrors or refracts: a material does that has `optics` in its \
                 `finish`",
            );
        }
        let traced = image.shaded_beside(Arc::new(shader), &others)?;
        traced.check_worlds()?;
        Ok(traced)
    }

    fn passes(&self) -> Option<&Link<SpanImage>> {
        (self.depth == 0).then_some(&self.image)
    }
}
