//! The node `Lookup`: display by a look-up table (\[D], "Near-real-time display").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::color::Color;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::Image;
use spandrel_engine::raster::Raster;
use spandrel_engine::resolve::lookup::{Brightness, Display};
use spandrel_engine::resolve::{Rule, Weighting};
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::{PictureDemand, SpanDemand};
use spandrel_engine::{Error, Result};
use std::collections::BTreeMap;

/// The rule by which each row has one line, through the middles of its pixels.
const MIDDLES: Rule = Rule::Sampled(1, Weighting::Box);

/// Shows spans fast, in at most 256 colours: each pixel is a number of a table, and each material
/// owns a part of the table, its colour from dark to bright. A change of `colors` changes the table
/// alone. Written as PNG, the picture is its numbers and its table.
///
/// There is one sample in the middle of each pixel: edges have steps. Textures show their mean, and
/// what is translucent is left out. For one frame of quality take `Resolve`.
///
/// Example: `Lookup(image: "landscape", size: (800, 800), colors: {"roof": "#804030"})`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Lookup {
    /// The image.
    pub image: Link<SpanImage>,
    /// Width and height, in pixels.
    #[schemars(extend("x-parts" = ["width", "height"]))]
    pub size: (u32, u32),
    /// How many steps from dark to bright each material has. If absent, as many as there is room for,
    /// up to 64.
    #[schemars(range(min = 1, max = 255))]
    pub entries: Option<u32>,
    /// What makes faces bright: a light at the eye (`Head`), or the image's shaders (`Shaded`).
    pub by: Brightness,
    /// Colours for materials, by their names, instead of their own. A material without a name is
    /// called as its object.
    pub colors: BTreeMap<String, Color>,
}

impl Default for Lookup {
    fn default() -> Lookup {
        Lookup {
            image: Link::default(),
            size: (1280, 720),
            entries: None,
            by: Brightness::Head,
            colors: BTreeMap::new(),
        }
    }
}

impl Lookup {
    fn raster(&self, wanted: &PictureDemand) -> Result<Raster> {
        let (width, height) = wanted.changed.size.unwrap_or(self.size);
        let (across, down) = wanted.changed.scale.unwrap_or((1.0, 1.0));
        let scaled = |side: u32, by: f64| (f64::from(side) * by).round().clamp(0.0, 1e9) as u32;
        Raster::new(scaled(width, across), scaled(height, down))
    }
}

impl Node for Lookup {
    type Output = Image;
    const KIND: &'static str = "Lookup";
    const GROUP: &'static str = "image";
    const ALIASES: &'static [&'static str] = &["Clut", "ColorTable", "IndexedDisplay", "Preview"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        let raster = Raster::new(self.size.0, self.size.1);
        raster.map(|_| ()).map_err(|error| FieldError::new("size", error.to_string()))?;
        if let Some((name, _)) = self.colors.iter().find(|(_, color)| !color.is_finite()) {
            return Err(FieldError::new("colors", format!("\"{name}\" is not finite")));
        }
        Ok(())
    }

    fn demand(&self, wanted: &PictureDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        let raster = self.raster(wanted)?;
        let rows = 0..raster.height;
        upstream
            .ask(&self.image, SpanDemand { raster, plan: MIDDLES.plan()?, rows, layered: false });
        Ok(())
    }

    fn evaluate(&self, wanted: &PictureDemand, inputs: &Inputs<'_>) -> Result<Image> {
        let fault = |error: Error| Error::invalid(format!("Lookup: {error}"));
        let image = inputs.get(&self.image);
        let mut display = Display::new(&image, self.by, self.entries).map_err(fault)?;
        for (name, color) in &self.colors {
            display.set_color(name, *color).map_err(fault)?;
        }
        wanted.part(display.picture()?)
    }
}
