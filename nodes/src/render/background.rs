//! The node `Background`: what is behind a scene, as spans (\[N], "Background processing").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::key::KeyHasher;
use spandrel_engine::render::background::{self, BackgroundOptions, Photograph, PictureFit, Show};
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::{Lamps, Override, PictureDemand, SpanDemand};
use std::collections::BTreeSet;

/// Fills the whole view behind a scene with a colour, a gradient over the horizon, a sky or a
/// picture, as spans. `DepthMerge` puts the scene in front of it, exactly at every edge. `Stream`
/// draws clouds on it. `Trace` shows it where rays meet nothing, if it is in the image or `beside`.
/// Merge it after `Fog`, or fog covers it. With a `distance` it stands there, such as a
/// photographed foreground cut out by its alpha.
///
/// Lights do not change it, and it casts no shadows.
///
/// Example: `Background(camera: "eye", sky: "sky", suns: ["sun"], white: 90000)`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Background {
    /// The camera.
    pub camera: Link<Camera>,
    /// One colour. A gradient, sky or picture is multiplied by it.
    pub color: Color,
    /// Colours by degrees above the horizon, from below upwards, such as `[(0, "#e8d8c0"), (90,
    /// "#4070b0")]`.
    pub gradient: Vec<(f64, Color)>,
    /// A SkyLight, as bright as it lights the scene.
    pub sky: Option<Link<Lamps>>,
    /// With `sky`, the SunLights whose discs are seen in front of it.
    pub suns: Vec<Link<Lamps>>,
    /// With `sky`, the illuminance in lux under which a white surface shows 1.
    #[schemars(range(min = 1e-9, max = 1e9))]
    pub white: f32,
    /// A picture.
    pub picture: Option<Link<Image>>,
    /// How the picture is placed. `Fill` fills the view and cuts off the rest. `Whole` shows all of
    /// it, and nothing beside it. `Stretch` changes its proportions. `Direction` is a panorama
    /// around everything, twice as wide as high, its middle facing -z. Mirrors show the mean of a
    /// picture that is not placed by direction.
    pub by: PictureFit,
    /// Turns a panorama, in degrees clockwise seen from above.
    pub turn: f64,
    /// The distance along the view axis, in metres. If absent, it is behind everything, and its `Z`
    /// is infinite.
    pub distance: Option<f64>,
    /// Its name, for `object(..)` in programs.
    pub name: String,
}

impl Default for Background {
    fn default() -> Background {
        Background {
            camera: Link::default(),
            color: Color::WHITE,
            gradient: Vec::new(),
            sky: None,
            suns: Vec::new(),
            white: 1.0,
            picture: None,
            by: PictureFit::Fill,
            turn: 0.0,
            distance: None,
            name: "background".to_owned(),
        }
    }
}

impl Node for Background {
    type Output = SpanImage;
    const KIND: &'static str = "Background";
    const GROUP: &'static str = "render";
    const ALIASES: &'static [&'static str] =
        &["Plate", "Backdrop", "Sky", "Constant", "Ramp", "Environment", "ForegroundPlate"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        let given = [!self.gradient.is_empty(), self.sky.is_some(), self.picture.is_some()];
        if given.into_iter().filter(|is| *is).count() > 1 {
            return Err(FieldError::new("picture", "give a gradient, a sky or a picture, not two"));
        }
        let rises = |pair: &[(f64, Color)]| pair[0].0 < pair[1].0;
        let angles = self.gradient.iter().all(|(angle, _)| (-90.0..=90.0).contains(angle));
        if !angles || !self.gradient.windows(2).all(rises) {
            let what = "degrees above the horizon, -90 to 90, each greater than the last";
            return Err(FieldError::new("gradient", what));
        }
        if !self.turn.is_finite() {
            return Err(FieldError::new("turn", "must be finite"));
        }
        if self.turn != 0.0 && self.by != PictureFit::Direction {
            let what = "turns a panorama: say `by: Direction` of a picture that is one";
            return Err(FieldError::new("turn", what));
        }
        if self.by != PictureFit::Fill && self.picture.is_none() {
            return Err(FieldError::new("by", "says how a `picture` lies: there is none"));
        }
        if self.sky.is_none() && !self.suns.is_empty() {
            return Err(FieldError::new("suns", "stand before a `sky`: there is none"));
        }
        if self.white.to_bits() != 1f32.to_bits() && self.sky.is_none() {
            return Err(FieldError::new("white", "is the exposure of a `sky`: there is none"));
        }
        if self.distance.is_some_and(|distance| !(1e-6..=1e12).contains(&distance.abs())) {
            let what = "must be 0.000001 to 10^12 metres; below 0 for parallel cameras only";
            return Err(FieldError::new("distance", what));
        }
        Ok(())
    }

    fn demand(&self, _: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.camera, ());
        self.sky.iter().chain(&self.suns).for_each(|light| upstream.ask(light, ()));
        let channels = BTreeSet::from([Channel::Color]);
        let whole = PictureDemand { channels, changed: Override::default() };
        self.picture.iter().for_each(|picture| upstream.ask(picture, whole.clone()));
        Ok(())
    }

    fn evaluate(&self, wanted: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let view = View::new(&inputs.get(&self.camera), wanted.raster)?;
        let mut key = KeyHasher::new("background");
        key.value(&(self.color, &self.gradient, self.white, self.by, self.turn, self.distance));
        let show = match (&self.sky, &self.picture) {
            (Some(link), _) => {
                let seen = Lamps::seen(inputs, link, &self.suns, self.white)?;
                for lamp in seen.suns.iter().chain([&seen.sky]) {
                    key.key(lamp.key()).value(&lamp.strength);
                }
                Show::Sky(seen)
            }
            (None, Some(link)) => {
                let picture = Photograph::new(&inputs.get(link), self.by, self.turn)?;
                key.key(picture.key());
                Show::Picture(picture)
            }
            (None, None) if self.gradient.is_empty() => Show::Gradient(vec![(0.0, Color::WHITE)]),
            (None, None) => Show::Gradient(self.gradient.clone()),
        };
        let (label, strength, distance) = (self.name.clone(), self.color, self.distance);
        let stand = BackgroundOptions { label, key: key.finish(), strength, distance };
        background::image(show, stand, &view, wanted.plan, wanted.rows.clone())
    }
}
