//! The node `WriteSpans`: stores spans in a file (\[N], "Image data structure").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::fragment::Columns;
use spandrel_engine::graph::OutFile;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::raster::Raster;
use spandrel_engine::resolve::Rule;
use spandrel_engine::span::SpanImage;
use spandrel_engine::span_file::{self, Options};
use spandrel_engine::values::{Delivery, Override, SpanDemand};
use spandrel_engine::{Error, Result};

/// Writes an image of spans to a .span file. Visibility is then solved once; the file can be
/// merged, lit and resolved at any scale later. The file is never half written: it is written
/// beside its place and then renamed.
///
/// Example: `WriteSpans(image: "town", path: "town.span", size: (1600, 900), lines: Sloped(8))`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct WriteSpans {
    /// The image.
    pub image: Link<SpanImage>,
    /// The file, ending in `.span`. Folders are made as needed.
    pub path: OutFile,
    /// Width and height in pixels for which visibility is solved, each 1 to 65536.
    #[schemars(extend("x-parts" = ["width", "height"]))]
    pub size: (u32, u32),
    /// The lines to write, as in `Resolve`. `Sloped(n)` and `Sampled(n, Box)` have the same lines;
    /// `Sampled(n, Trapezoid)` has others. `Adaptive` and `Exact` are errors, because they ask for
    /// more lines as they go.
    pub lines: Rule,
    /// What the file holds of the scenes. `ByPath`: where they are, and a hash of their contents.
    /// `Embedded`: everything in them. `Left`: nothing, and the image can no longer be lit.
    pub scenes: Scenes,
    /// Stores faces with their shading applied; no scene is then stored. A face whose shading
    /// varies is stored with the shading of one place. That is right for lights on flat faces; add
    /// fog and pictures after reading.
    pub shaded: bool,
}

/// What a span file holds of the scenes.
#[derive(Clone, Copy, Default, Serialize, Deserialize, JsonSchema)]
pub enum Scenes {
    /// Where they are, and a hash of their contents.
    #[default]
    ByPath,
    /// Everything in them.
    Embedded,
    /// Nothing.
    Left,
}

impl Default for WriteSpans {
    fn default() -> WriteSpans {
        WriteSpans {
            image: Link::default(),
            path: OutFile::default(),
            size: (1280, 720),
            lines: Rule::Sloped(8),
            scenes: Scenes::ByPath,
            shaded: false,
        }
    }
}

impl Node for WriteSpans {
    type Output = Delivery;
    const KIND: &'static str = "WriteSpans";
    const GROUP: &'static str = "output";

    fn check(&self) -> std::result::Result<(), FieldError> {
        let at = |field| move |e: Error| FieldError::new(field, e.to_string());
        if std::path::Path::new(&self.path.0).extension().is_none_or(|e| e != "span") {
            return Err(FieldError::new(
                "path",
                "name a file that ends in .span, such as \"out/town.span\"",
            ));
        }
        if self.lines.tolerance().is_some() {
            return Err(FieldError::new(
                "lines",
                "a file cannot be asked for more lines: write it with `Sloped(n)` or `Sampled(n, ..)`",
            ));
        }
        Raster::new(self.size.0, self.size.1).map_err(at("size"))?;
        self.lines.plan().map_err(at("lines"))?;
        Ok(())
    }

    fn demand(&self, wanted: &Override, upstream: &mut Upstream<'_>) -> Result<()> {
        // Spans are written whole, by whoever joins the bands of pictures.
        if wanted.is_for_others() {
            return Ok(());
        }
        let (width, height) = wanted.size.unwrap_or(self.size);
        let raster = Raster::new(width, height)?;
        let rows = match wanted.window {
            Some(window) => {
                window.y.min(height)..(window.y.saturating_add(window.height)).min(height)
            }
            None => 0..height,
        };
        upstream.ask(
            &self.image,
            SpanDemand { raster, plan: self.lines.plan()?, rows, layered: false },
        );
        Ok(())
    }

    fn evaluate(&self, wanted: &Override, inputs: &Inputs<'_>) -> Result<Delivery> {
        let path = self.path.under(inputs.directory());
        if wanted.is_for_others() {
            return Ok(Delivery { path, bytes: 0 });
        }
        let scenes = match self.scenes {
            Scenes::ByPath => span_file::Scenes::ByPath,
            Scenes::Embedded => span_file::Scenes::Embedded,
            Scenes::Left => span_file::Scenes::Left,
        };
        let options = Options { scenes, shaded: self.shaded };
        let written = span_file::write(&inputs.get(&self.image), &path, options)?;
        if self.shaded && written.varying > 0 {
            inputs.warn(&format!(
                "{} of {} faces are not shaded alike all over, and of each the colour of one place is stored: add fog and \
                 pictures after reading",
                written.varying, written.faces
            ));
        }
        for source in inputs.get(&self.image).sources() {
            let surfaces = &source.surfaces;
            let varies = |ordinal: u32| surfaces.varying(ordinal).contains(Columns::COLOR);
            let mut faces = source.faces.faces().iter();
            if surfaces.origin().is_none() && faces.any(|face| varies(face.ordinal)) {
                inputs.warn(&format!(
                    "\"{}\" is of no scene file, so that of each face the colour of one place is stored: merge \
                     it after reading",
                    source.label
                ));
            }
        }
        Ok(Delivery { path, bytes: written.bytes })
    }
}
