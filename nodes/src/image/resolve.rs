//! The node `Resolve`: from spans to pixels (\[N], "Regeneration of images" and "Regeneration of
//! images with scaling"; \[D], "Shading display with shadow", eq. 1).

use glam::DVec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::{Image, Window};
use spandrel_engine::raster::Raster;
use spandrel_engine::resolve::{self, Framing, PixelFilter, Rate, Rule, Vertical, shutter};
use spandrel_engine::span::SpanImage;
use spandrel_engine::texture;
use spandrel_engine::values::{PictureDemand, SpanDemand};
use std::sync::Arc;

/// Turns spans into pixels, antialiased, at any scale. `size` and `lines` decide what visibility is
/// solved for. `scale`, `pan` and `window` only decide how it is shown: nodes that differ only in
/// these share one visibility.
///
/// Example: `Resolve(image: "hazy", size: (1600, 900), lines: Sloped(8))`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Resolve {
    /// The image.
    pub image: Link<SpanImage>,
    /// Width and height in pixels for which visibility is solved, each 1 to 65536.
    #[schemars(extend("x-parts" = ["width", "height"]))]
    pub size: (u32, u32),
    /// How lines become pixels. `Sloped(n)` has n lines per row and uses the slopes of edges.
    /// `Sampled(n, Trapezoid)` and `Sampled(n, Box)` take lines as they are, weighted as in the
    /// papers. n is 1 to 1024: more is more accurate and slower. `Adaptive(n, tolerance)` is
    /// `Sloped(n)`, with pixels solved again whose coverage may be off by more than the tolerance,
    /// 0 to 1. `Exact` goes on until no error is left, slowly. The channel `aa_error` shows the
    /// estimate that decides.
    #[schemars(extend("x-draft" = "Sampled(1, Box)"))]
    pub lines: Rule,
    /// Scale in x and y. The picture is this many times `size`; visibility is not solved again.
    #[schemars(extend("x-parts" = ["x", "y"]))]
    pub scale: (f64, f64),
    /// Moves the scene right and down, in pixels of the picture.
    #[schemars(extend("x-parts" = ["right", "down"]))]
    pub pan: (f64, f64),
    /// The part to compute: left, top, width and height, in pixels of the picture.
    #[schemars(extend("x-parts" = ["left", "top", "width", "height"]))]
    pub window: Option<(u32, u32, u32, u32)>,
    /// For `Sampled` at scales other than 1: `Whole` lines with equal weights, as in \[N] eq. 7, or
    /// exact `Fractions`.
    pub vertical: Vertical,
    /// The pixel filter: `Box`, `Tent`, `Gaussian`, `Mitchell` or `Lanczos`. It is integrated along
    /// spans, which is sharper than filtering finished pixels. `Adaptive` and `Exact` take `Box`
    /// only.
    pub filter: PixelFilter,
    /// How often faces are shaded: `Face`, once each; `Pixel`, once in each pixel; `Line`, once on
    /// each line in each pixel.
    pub shading: Rate,
    /// How pictures on surfaces are filtered: `Nearest`; `Trilinear`; `Anisotropic(n)`, up to n
    /// samples along what a pixel covers; or `Exact`, the mean of what it covers, slowly.
    #[schemars(extend("x-draft" = "Nearest"))]
    pub textures: texture::TextureFilter,
    /// Motion blur: from when to when the shutter is open, in frames around the frame, such as
    /// `(-0.25, 0.25)`. Colours are the mean of what is seen meanwhile; distances, normals and ids
    /// are those of the middle. What does not move is solved once.
    #[schemars(extend("x-parts" = ["opens", "closes"]))]
    pub shutter: Option<(f64, f64)>,
    /// The moments at which a picture with a shutter is solved: more is smoother and slower.
    #[schemars(range(min = 1, max = 256), extend("x-draft" = "1"))]
    pub samples: u32,
}

impl Default for Resolve {
    fn default() -> Resolve {
        Resolve {
            image: Link::default(),
            size: (1280, 720),
            lines: Rule::Sloped(8),
            scale: (1.0, 1.0),
            pan: (0.0, 0.0),
            window: None,
            vertical: Vertical::Fractions,
            filter: PixelFilter::Box,
            shading: Rate::Pixel,
            textures: texture::TextureFilter::default(),
            shutter: None,
            samples: 8,
        }
    }
}

impl Resolve {
    /// What visibility is solved for, and how it is shown.
    fn framing(&self, wanted: &PictureDemand) -> Result<(Raster, Framing)> {
        let window = self.window.map(|(x, y, width, height)| Window { x, y, width, height });
        let (raster, framing) = wanted.framing(self.size, self.scale, window)?;
        let Resolve { vertical, filter, shading, textures, .. } = *self;
        let pan = self.pan.into();
        Ok((raster, Framing { pan, vertical, filter, shading, textures, ..framing }))
    }
}

impl Node for Resolve {
    type Output = Image;
    const KIND: &'static str = "Resolve";
    const GROUP: &'static str = "image";
    const ALIASES: &'static [&'static str] = &["DeepToImage", "Flatten", "Antialias"];
    const STORED: bool = true;

    fn check(&self) -> std::result::Result<(), FieldError> {
        let at = |field| move |e: spandrel_engine::Error| FieldError::new(field, e.to_string());
        let raster = Raster::new(self.size.0, self.size.1).map_err(at("size"))?;
        self.lines.plan().map_err(at("lines"))?;
        self.lines.check_filter(self.filter).map_err(at("filter"))?;
        Framing::scaled(raster, DVec2::from(self.scale)).map_err(at("scale"))?;
        self.textures.check().map_err(|what| FieldError::new("textures", what))?;
        if let Some((opens, closes)) = self.shutter
            && !(opens <= closes && closes - opens <= 1000.0)
        {
            let what = "a shutter opens before it closes, such as (-0.25, 0.25)";
            return Err(FieldError::new("shutter", what));
        }
        Ok(())
    }

    fn demand(&self, wanted: &PictureDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        let (raster, framing) = self.framing(wanted)?;
        let rows = framing.raster_rows(raster);
        let demand = SpanDemand { raster, plan: self.lines.plan()?, rows, layered: false };
        match self.shutter.filter(|_| upstream.varies(&self.image)) {
            Some(open) => {
                for moment in shutter::moments(open, self.samples) {
                    upstream.ask_at(&self.image, demand.clone(), moment);
                }
            }
            None => upstream.ask(&self.image, demand),
        }
        Ok(())
    }

    fn evaluate(&self, wanted: &PictureDemand, inputs: &Inputs<'_>) -> Result<Image> {
        let (_, framing) = self.framing(wanted)?;
        let images: Vec<_> = inputs.each(&self.image).collect();
        let mut pictures: Vec<Image> = Vec::new();
        for (i, image) in images.iter().enumerate() {
            // What stands still for a while is one value.
            let same = images[..i].iter().position(|other| Arc::ptr_eq(other, image));
            pictures.push(match same {
                Some(same) => pictures[same].clone(),
                None => resolve::resolve(image, self.lines, &framing, &wanted.channels)?,
            });
        }
        match pictures[..] {
            [_] => Ok(pictures.remove(0)),
            _ => shutter::averaged(&pictures),
        }
    }
}
