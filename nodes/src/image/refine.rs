//! The node `Refine`: computes a part of a picture anew (\[N], "Local processing").

use glam::DVec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::diagnostic::list;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::{Image, Window};
use spandrel_engine::raster::Raster;
use spandrel_engine::resolve::{self, Framing, PixelFilter, Rate, Rule, Select, Vertical};
use spandrel_engine::span::SpanImage;
use spandrel_engine::texture;
use spandrel_engine::values::{PictureDemand, SpanDemand};

/// Computes a part of a picture anew, such as its mirrors with more rays. Pixels that show anything
/// selected become those of `image`, resolved here. All others stay as they are in `over`, and
/// nothing else is shaded. Size, lines, scale and the rest must be those with which the picture was
/// resolved.
///
/// Example: `Refine(over: "picture", image: "better", select: Objects(["ball*"]), size: (1280, 720), lines: Sloped(8))`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Refine {
    /// The picture.
    pub over: Link<Image>,
    /// The image that the picture was resolved from, better shaded.
    pub image: Link<SpanImage>,
    /// What is computed anew. `Objects(["table/*"])` selects objects by name, or by the end of the
    /// name after a `/`; `*` stands for anything. `spandrel info` of the scene lists the names.
    /// `Faces({"scene.ron": [3, 4]})` selects faces by number. `Region(left, top, width, height)`
    /// is in pixels. `Traced` selects everything that rays start from.
    pub select: Select,
    /// Width and height in pixels for which visibility is solved, each 1 to 65536.
    #[schemars(extend("x-parts" = ["width", "height"]))]
    pub size: (u32, u32),
    /// How lines become pixels, as in `Resolve`.
    #[schemars(extend("x-draft" = "Sampled(1, Box)"))]
    pub lines: Rule,
    /// Scale in x and y, as in `Resolve`.
    #[schemars(extend("x-parts" = ["x", "y"]))]
    pub scale: (f64, f64),
    /// Moves the scene right and down, as in `Resolve`.
    #[schemars(extend("x-parts" = ["right", "down"]))]
    pub pan: (f64, f64),
    /// The part to compute, as in `Resolve`.
    #[schemars(extend("x-parts" = ["left", "top", "width", "height"]))]
    pub window: Option<(u32, u32, u32, u32)>,
    /// Which lines a scaled row takes, as in `Resolve`.
    pub vertical: Vertical,
    /// The pixel filter, as in `Resolve`.
    pub filter: PixelFilter,
    /// How often faces are shaded, as in `Resolve`.
    pub shading: Rate,
    /// How pictures on surfaces are filtered, as in `Resolve`.
    #[schemars(extend("x-draft" = "Nearest"))]
    pub textures: texture::TextureFilter,
}

impl Default for Refine {
    fn default() -> Refine {
        Refine {
            over: Link::default(),
            image: Link::default(),
            select: Select::Traced,
            size: (1280, 720),
            lines: Rule::Sloped(8),
            scale: (1.0, 1.0),
            pan: (0.0, 0.0),
            window: None,
            vertical: Vertical::Fractions,
            filter: PixelFilter::Box,
            shading: Rate::Pixel,
            textures: texture::TextureFilter::default(),
        }
    }
}

impl Refine {
    fn framing(&self, wanted: &PictureDemand) -> Result<(Raster, Framing)> {
        let window = self.window.map(|(x, y, width, height)| Window { x, y, width, height });
        let (raster, framing) = wanted.framing(self.size, self.scale, window)?;
        let Refine { vertical, filter, shading, textures, .. } = *self;
        let pan = self.pan.into();
        Ok((raster, Framing { pan, vertical, filter, shading, textures, ..framing }))
    }
}

impl Node for Refine {
    type Output = Image;
    const KIND: &'static str = "Refine";
    const GROUP: &'static str = "image";
    const STORED: bool = true;
    const ALIASES: &'static [&'static str] = &["RegionRender", "ReRender", "LocalProcessing"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        let at = |field| move |e: spandrel_engine::Error| FieldError::new(field, e.to_string());
        let raster = Raster::new(self.size.0, self.size.1).map_err(at("size"))?;
        self.lines.plan().map_err(at("lines"))?;
        self.lines.check_filter(self.filter).map_err(at("filter"))?;
        Framing::scaled(raster, DVec2::from(self.scale)).map_err(at("scale"))?;
        self.textures.check().map_err(|what| FieldError::new("textures", what))?;
        Ok(())
    }

    fn demand(&self, wanted: &PictureDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        let (raster, framing) = self.framing(wanted)?;
        let rows = framing.raster_rows(raster);
        upstream.ask(&self.over, wanted.clone());
        upstream.ask(
            &self.image,
            SpanDemand { raster, plan: self.lines.plan()?, rows, layered: false },
        );
        Ok(())
    }

    fn evaluate(&self, wanted: &PictureDemand, inputs: &Inputs<'_>) -> Result<Image> {
        let (_, framing) = self.framing(wanted)?;
        let (over, image) = (inputs.get(&self.over), inputs.get(&self.image));
        let channels = &wanted.channels;
        let (refined, pixels) =
            resolve::refine(&over, &image, self.lines, &framing, channels, &self.select)?;
        if pixels == 0 {
            let known = image.names().map(|[objects, _]| {
                format!(". There are {}", list(objects.iter().map(String::as_str)))
            });
            let known = known.unwrap_or_default();
            inputs.warn(&format!(
                "nothing that is selected is seen: the picture stays as it is{known}"
            ));
        }
        Ok(refined)
    }
}
