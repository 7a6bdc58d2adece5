//! The node `Matte`: cuts a subject out of a photograph, as \[N] cuts out its trees ("Texture
//! mapping").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::color::Color;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::Image;
use spandrel_engine::image::Samples;
use spandrel_engine::picture::{self, ColorKey, Operator};
use spandrel_engine::values::PictureDemand;

/// Cuts a subject out of a photograph, such as a tree out of its sky. Keys say which colours are
/// surely subject and which are surely background. Pixels between get an alpha, and the
/// background's colour is removed from them.
///
/// Example: `Matte(image: "assets/photos/oak.jpg", keys: [Bluer(-0.02, 0.13)])`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Matte {
    /// The photograph.
    pub image: Link<Image>,
    /// How the background is recognised: `Brighter(0.6, 0.8)`, `Darker(0.3, 0.1)`, `Bluer(0.05,
    /// 0.15)`, `Hue(210, 40, 0.2)` (hue in degrees, tolerance, amount of colour), `Clean(0.1,
    /// 0.03)`. Each key says where the subject ends and where the background begins, in
    /// display-coded colours. All keys must agree.
    pub keys: Vec<ColorKey>,
    /// The same view without the subject.
    pub clean: Option<Link<Image>>,
    /// A polygon around the subject; everything outside it is background. Points are shares of
    /// width and height from the top left.
    #[schemars(extend("x-parts" = ["x", "y"]))]
    pub garbage: Vec<(f64, f64)>,
    /// A polygon inside the subject; everything inside it is subject.
    #[schemars(extend("x-parts" = ["x", "y"]))]
    pub keep: Vec<(f64, f64)>,
    /// How far soft edges reach into the background, as a share of the height.
    #[schemars(range(min = 0.0, max = 0.1))]
    pub edge: f64,
    /// How much of the background's colour is removed from soft edges.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub decontaminate: f32,
    /// If given, the subject is shown over this colour for inspection.
    pub preview: Option<Color>,
}

impl Default for Matte {
    fn default() -> Matte {
        Matte {
            image: Link::default(),
            keys: vec![ColorKey::Brighter(0.55, 0.75)],
            clean: None,
            garbage: Vec::new(),
            keep: Vec::new(),
            edge: 0.003,
            decontaminate: 1.0,
            preview: None,
        }
    }
}

impl Node for Matte {
    type Output = Image;
    const KIND: &'static str = "Matte";
    const GROUP: &'static str = "image";
    const ALIASES: &'static [&'static str] =
        &["Keyer", "Primatte", "Keylight", "ChromaKey", "LumaKey", "CutOut", "Difference"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        let keys = self.keys.iter().try_for_each(|key| key.check());
        keys.map_err(|what| FieldError::new("keys", what))?;
        if self.keys.is_empty() && self.garbage.is_empty() {
            return Err(FieldError::new("keys", "give at least one key, or a garbage polygon"));
        }
        if !(0.0..=0.1).contains(&self.edge) {
            return Err(FieldError::new("edge", "must be 0 to 0.1, as a share of the height"));
        }
        if self.clean.is_none() && self.keys.iter().any(|key| matches!(key, ColorKey::Clean(..))) {
            return Err(FieldError::new("clean", "a Clean key needs the view without the subject"));
        }
        for (field, polygon) in [("garbage", &self.garbage), ("keep", &self.keep)] {
            let finite = polygon.iter().all(|(x, y)| x.is_finite() && y.is_finite());
            if !finite || (1..3).contains(&polygon.len()) {
                return Err(FieldError::new(field, "a polygon has three corners or more"));
            }
            if polygon.iter().any(|(x, y)| x.abs().max(y.abs()) > 4.0) {
                let what = "corners are shares of the picture, 0 to 1, not pixels";
                return Err(FieldError::new(field, what));
            }
        }
        Ok(())
    }

    fn demand(&self, wanted: &PictureDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.whole());
        self.clean.iter().for_each(|clean| upstream.ask(clean, wanted.whole()));
        Ok(())
    }

    fn evaluate(&self, wanted: &PictureDemand, inputs: &Inputs<'_>) -> Result<Image> {
        let image = inputs.get(&self.image);
        let clean = self.clean.as_ref().map(|clean| inputs.get(clean));
        let Matte { keys, garbage, keep, edge, decontaminate, .. } = self;
        let matte = picture::Matte {
            keys: keys.clone(),
            garbage: garbage.clone(),
            keep: keep.clone(),
            edge: *edge,
            decontaminate: *decontaminate,
        };
        let pulled = matte.pull(&image, clean.as_deref())?;
        if pulled.shares[0] == 0.0 || pulled.shares[1] == 0.0 {
            let what = if pulled.shares[0] == 0.0 { "background" } else { "subject" };
            inputs.warn(&format!("no pixel is surely {what}: the keys' numbers do not fit"));
        }
        let Some(color) = self.preview else { return wanted.part(pulled.subject) };
        let mut ground = Image::new(image.size, image.window);
        for (name, value) in [("R", color.r), ("G", color.g), ("B", color.b), ("A", 1.0)] {
            ground.insert(name, Samples::Float(vec![value; image.window.area()]))?;
        }
        wanted.part(picture::composite(&pulled.subject, &ground, Operator::Over)?)
    }
}
