//! The node `Display`: how a picture is shown.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::color::Color;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::light::tint;
use spandrel_engine::math;
use spandrel_engine::shade::{self, DisplayView};
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::SpanDemand;
use std::sync::Arc;

/// Brings colours of any brightness into the range of a screen, surface by surface, before anything is
/// resolved: a lamp fades to white, and an edge before it keeps its antialiasing. Put it last, after
/// the merge with what stands behind everything. For an EXR file, which stays scene-linear, resolve the
/// image without it.
///
/// Exposure and white balance come first, then contrast and saturation, then the view. Surfaces that
/// shine through each other are shown each by itself.
///
/// Example: `Display(image: "all", exposure: 0.5, view: Neutral)`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Display {
    /// The image.
    pub image: Link<SpanImage>,
    /// In stops: 1 is twice as bright.
    #[schemars(range(min = -32, max = 32))]
    pub exposure: f32,
    /// The temperature in kelvin of the light that shows as white, 800 to 100000. If absent, colours
    /// stay as they are.
    pub temperature: Option<f64>,
    /// Contrast about a grey of 0.18: 1 changes nothing.
    #[schemars(range(min = 0.1, max = 10))]
    pub contrast: f32,
    /// 0 makes grey, 1 changes nothing, more is more colourful.
    #[schemars(range(min = 0, max = 10))]
    pub saturation: f32,
    /// How the range is compressed. `Linear`: not at all. `Neutral` (Khronos): up to 0.8 colours stay as
    /// they are. `AgX`: as film, over sixteen stops. `Filmic`: a curve of film in each component.
    pub view: DisplayView,
}

impl Default for Display {
    fn default() -> Display {
        Display {
            image: Link::default(),
            exposure: 0.0,
            temperature: None,
            contrast: 1.0,
            saturation: 1.0,
            view: DisplayView::default(),
        }
    }
}

/// The temperature of a light that shows as white by itself, in kelvin.
const WHITE: f64 = 6504.0;

impl Display {
    /// The factors that make light of a temperature white, and leave greys as bright as they are.
    fn balance(&self) -> Result<Color> {
        let Some(temperature) = self.temperature else { return Ok(Color::WHITE) };
        let [was, is] = [tint::black_body(temperature)?, tint::black_body(WHITE)?];
        let share = |is: f32, was: f32| is / was.max(1e-3);
        let factors = Color::new(share(is.r, was.r), share(is.g, was.g), share(is.b, was.b));
        Ok(factors * (1.0 / factors.luminance()))
    }
}

impl Node for Display {
    type Output = SpanImage;
    const KIND: &'static str = "Display";
    const GROUP: &'static str = "shade";
    const ALIASES: &'static [&'static str] =
        &["ToneMap", "Tonemap", "ViewTransform", "ColorTransform", "OCIODisplay"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        self.balance().map_err(|error| FieldError::new("temperature", error.to_string()))?;
        Ok(())
    }

    fn demand(&self, wanted: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        Ok(())
    }

    fn evaluate(&self, _: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let Display { exposure, contrast, saturation, view, .. } = *self;
        let multiply = self.balance()? * math::powf(2.0, exposure);
        let shader = shade::Display { multiply, contrast, saturation, view };
        inputs.get(&self.image).shaded(Arc::new(shader))
    }
}
