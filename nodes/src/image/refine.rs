use glam::DVec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::{Image, Window};
use spandrel_engine::raster::Raster;
use spandrel_engine::resolve::{self, Framing, Rule, Select};
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::{Lines, Picture};

/// Computes a part of a picture anew, such as what mirrors, with more rays: pixels that show anything selected
/// become those of `image`, resolved here, and all others stay as they are in `over`. Nothing else is shaded.
/// Size, lines and scale are those with which the picture was resolved.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Refine {
    /// The picture.
    pub over: Link<Image>,
    /// The image that it was resolved from, shaded better.
    pub image: Link<SpanImage>,
    /// What is computed anew: `Objects(["table/*"])` by the names of the channel `id`, where `*` stands for
    /// anything; `Faces({"scene.ron": [3, 4]})` by their numbers; `Region(left, top, width, height)` in pixels;
    /// `Traced`, what rays start from.
    pub select: Select,
    /// Width and height in pixels for which visibility is solved, each 1 to 65536.
    pub size: (u32, u32),
    /// How lines become pixels, as in `Resolve`.
    pub lines: Rule,
    /// Scale in x and y, as in `Resolve`.
    pub scale: (f64, f64),
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
        }
    }
}

impl Refine {
    fn framing(&self, wanted: &Picture) -> Result<(Raster, Framing)> {
        let (width, height) = wanted.changed.size.unwrap_or(self.size);
        let raster = Raster::new(width, height)?;
        let scale = DVec2::from(wanted.changed.scale.unwrap_or(self.scale));
        let whole = Framing::scaled(raster, scale)?;
        let window = Window::whole(whole.columns.end, whole.rows.end);
        Ok((raster, whole.cut(wanted.changed.window.unwrap_or(window))?))
    }
}

impl Node for Refine {
    type Output = Image;
    const KIND: &'static str = "Refine";
    const GROUP: &'static str = "image";
    const ALIASES: &'static [&'static str] = &["RegionRender", "ReRender", "LocalProcessing"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        let at = |field| move |e: spandrel_engine::Error| FieldError::new(field, e.to_string());
        let raster = Raster::new(self.size.0, self.size.1).map_err(at("size"))?;
        self.lines.plan().map_err(at("lines"))?;
        Framing::scaled(raster, DVec2::from(self.scale)).map_err(at("scale"))?;
        Ok(())
    }

    fn demand(&self, wanted: &Picture, upstream: &mut Upstream<'_>) -> Result<()> {
        let (raster, framing) = self.framing(wanted)?;
        let rows = framing.raster_rows(raster);
        upstream.ask(&self.over, wanted.clone());
        upstream.ask(&self.image, Lines { raster, plan: self.lines.plan()?, rows });
        Ok(())
    }

    fn evaluate(&self, wanted: &Picture, inputs: &Inputs<'_>) -> Result<Image> {
        let (_, framing) = self.framing(wanted)?;
        let (over, image) = (inputs.get(&self.over), inputs.get(&self.image));
        let channels = &wanted.channels;
        let refined = resolve::refine(&over, &image, self.lines, &framing, channels, &self.select)?;
        if refined.counts.get("pixels refined") == Some(&0) {
            inputs.warn("nothing that is selected is seen: the picture stays as it is");
        }
        Ok(refined)
    }
}
