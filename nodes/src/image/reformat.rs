//! The node `Reformat`: crops, moves, scales and turns a finished picture.

use glam::DVec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::Image;
use spandrel_engine::picture;
use spandrel_engine::texture::TextureFilter;
use spandrel_engine::values::PictureDemand;

/// Fits a picture, or a part of it, into another size: moved, scaled and turned. Each new pixel is
/// filtered by what it covers of the old picture. Colour and alpha only.
///
/// Example: `Reformat(image: "plate", size: (1920, 1080))`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Reformat {
    /// The picture.
    pub image: Link<Image>,
    /// Columns and rows of the new picture. If absent, those of the old. `--size` and `--scale` of
    /// the command line change it, as they change all pictures.
    #[schemars(extend("x-parts" = ["width", "height"]))]
    pub size: Option<(u32, u32)>,
    /// The part that is shown: left, top, width and height, as shares of the picture.
    #[schemars(extend("x-parts" = ["left", "top", "width", "height"]))]
    pub part: (f64, f64, f64, f64),
    /// Whether the part fills the new picture in both directions, changing its proportions. If not,
    /// all of it is shown, with nothing beside it.
    pub stretch: bool,
    /// Moves the picture right and down, in shares of the new width and height.
    #[schemars(extend("x-parts" = ["right", "down"]))]
    pub shift: (f64, f64),
    /// Scales it to the right and downwards; below 0 mirrors it.
    #[schemars(extend("x-parts" = ["x", "y"]))]
    pub scale: (f64, f64),
    /// Turns it clockwise about its middle, in degrees.
    pub turn: f64,
    /// The filter: `Nearest`, `Trilinear`, `Anisotropic(n)` or `Exact`.
    pub filter: TextureFilter,
}

impl Default for Reformat {
    fn default() -> Reformat {
        Reformat {
            image: Link::default(),
            size: None,
            part: (0.0, 0.0, 1.0, 1.0),
            stretch: false,
            shift: (0.0, 0.0),
            scale: (1.0, 1.0),
            turn: 0.0,
            filter: TextureFilter::default(),
        }
    }
}

impl Node for Reformat {
    type Output = Image;
    const KIND: &'static str = "Reformat";
    const GROUP: &'static str = "image";
    const ALIASES: &'static [&'static str] =
        &["Resize", "Scale", "Rotate", "TransformImage", "CropImage", "CornerPin"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        let (left, top, width, height) = self.part;
        let is_place = |v: f64| v.abs() <= 1e6;
        let is_size = |v: f64| (1e-6..=1e6).contains(&v);
        let is_share = |v: f64| v.abs() <= 16.0;
        let is_part = [left, top].into_iter().all(is_share)
            && [width, height].into_iter().all(|v| is_size(v) && is_share(v));
        if !is_part {
            let what = "left, top, width and height are shares of the picture, not pixels: (0, 0, 1, 1) is all of it";
            return Err(FieldError::new("part", what));
        }
        if !is_size(self.scale.0.abs()) || !is_size(self.scale.1.abs()) {
            return Err(FieldError::new("scale", "must be 0.000001 to 1000000, or that below 0"));
        }
        if ![self.shift.0, self.shift.1, self.turn].into_iter().all(is_place) {
            return Err(FieldError::new("shift", "must be -1000000 to 1000000, as the turn"));
        }
        if let Some((width, height)) = self.size
            && !((1..=65_536).contains(&width) && (1..=65_536).contains(&height))
        {
            return Err(FieldError::new("size", "must be 1 to 65536 in each direction"));
        }
        self.filter.check().map_err(|what| FieldError::new("filter", what))
    }

    fn demand(&self, wanted: &PictureDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.whole());
        Ok(())
    }

    fn evaluate(&self, wanted: &PictureDemand, inputs: &Inputs<'_>) -> Result<Image> {
        let image = inputs.get(&self.image);
        let scaled = |(width, height): (u32, u32)| {
            let (x, y) = wanted.changed.scale.unwrap_or((1.0, 1.0));
            let side =
                |size: u32, by: f64| (f64::from(size) * by).round().clamp(1.0, 65_536.0) as u32;
            (side(width, x), side(height, y))
        };
        let said = self.size.map(|size| scaled(wanted.changed.size.unwrap_or(size)));
        let size = said.unwrap_or(image.size);
        let (left, top, width, height) = self.part;
        let reformat = picture::Reformat {
            size,
            part: [left, top, width, height],
            keeps_shape: !self.stretch,
            shift: DVec2::from(self.shift),
            scale: DVec2::from(self.scale),
            turn: self.turn.to_radians(),
            filter: self.filter,
        };
        wanted.part(reformat.apply(&image)?)
    }
}
