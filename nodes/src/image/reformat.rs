use glam::DVec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Error;
use spandrel_engine::Result;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::Image;
use spandrel_engine::picture;
use spandrel_engine::texture::Filter;
use spandrel_engine::values::Picture;

/// Lays a picture into another size: a part of it, moved, scaled and turned, filtered by what each new pixel
/// covers of it. Colour and alpha only.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Reformat {
    /// The picture.
    pub image: Link<Image>,
    /// Columns and rows of the new picture. Absent, those of the old.
    pub size: Option<(u32, u32)>,
    /// The part that is shown: left, top, width and height, as shares of the picture.
    pub part: (f64, f64, f64, f64),
    /// Whether the part fills the new picture in both directions, whatever becomes of its proportions. Else all of
    /// it is shown, with nothing beside it.
    pub stretch: bool,
    /// Moves it right and down, in shares of the new width and height.
    pub shift: (f64, f64),
    /// Larger to the right and downwards; below 0 mirrored.
    pub scale: (f64, f64),
    /// Turns it clockwise about its middle, in degrees.
    pub turn: f64,
    /// How it is filtered: `Nearest`, `Trilinear`, `Anisotropic(n)` or `Exact`.
    pub filter: Filter,
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
            filter: Filter::Exact,
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
        if ![left, top, width, height].iter().all(|v| v.is_finite())
            || width <= 0.0
            || height <= 0.0
        {
            return Err(FieldError::new(
                "part",
                "give left, top, width and height, the last above 0",
            ));
        }
        let is_some = |v: f64| v.is_finite() && v != 0.0;
        if !is_some(self.scale.0) || !is_some(self.scale.1) {
            return Err(FieldError::new("scale", "must be finite, and not 0"));
        }
        if ![self.shift.0, self.shift.1, self.turn].iter().all(|v| v.is_finite()) {
            return Err(FieldError::new("shift", "must be finite, as the turn"));
        }
        if let Some((width, height)) = self.size
            && !((1..=65_536).contains(&width) && (1..=65_536).contains(&height))
        {
            return Err(FieldError::new("size", "must be 1 to 65536 in each direction"));
        }
        self.filter.check().map_err(|what| FieldError::new("filter", what))
    }

    fn demand(&self, wanted: &Picture, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.whole());
        Ok(())
    }

    fn evaluate(&self, wanted: &Picture, inputs: &Inputs<'_>) -> Result<Image> {
        let image = inputs.get(&self.image);
        let size = self.size.unwrap_or(image.size);
        if u64::from(size.0) * u64::from(size.1) > 1 << 30 {
            return Err(Error::invalid("`size` has more than a thousand million pixels"));
        }
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
        Ok(wanted.part(reformat.apply(&image)?))
    }
}
