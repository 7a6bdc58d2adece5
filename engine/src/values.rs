//! The types on the graph's arrows, and what can be asked of each.
//!
//! | value | asked | made by |
//! |---|---|---|
//! | [`Scene`] | nothing | readers |
//! | [`Volume`] | nothing | readers |
//! | [`Camera`] | nothing | cameras |
//! | [`BspTree`] | nothing | trees over scenes |
//! | [`SpanImage`] | a raster, a line plan, rows ([`SpanDemand`]) | renderers, merges, shaders |
//! | [`Lamps`] | nothing | lights |
//! | [`Image`] | channels, and what the command line overrides ([`PictureDemand`]) | resolve, image nodes |
//! | [`Delivery`] | what the command line overrides ([`Override`]) | writers |

use glam::DVec3;
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use crate::camera::{Camera, View};
use crate::error::{Error, Result};
use crate::graph::node::FieldError;
use crate::graph::{Demand, Inputs, Link, NamedLink, Value};
use crate::image::{Channel, Image, Window};
use crate::key::Key;
use crate::light::Lamp;
use crate::light::list::MakeLamp;
use crate::light::seen::SeenSky;
use crate::raster::{LinePlan, Raster, Rows};
use crate::render::priority::{BspTree, TreeCounts};
use crate::render::scanline::{self, Cluster};
use crate::resolve::Framing;
use crate::scene::Scene;
use crate::span::SpanImage;
use crate::visible;
use crate::volume::Volume;

impl Value for Scene {
    type Demand = ();
    const NAME: &'static str = "Scene";
    const READER: Option<&'static str> = Some("ReadScene");

    fn key(&self) -> Option<Key> {
        Some(Key::of(&(&self.label, self.key, self.pictures)))
    }

    fn bytes(&self) -> usize {
        let mut seen = std::collections::HashSet::new();
        let distinct = self.instances.iter().filter(|i| seen.insert(Arc::as_ptr(&i.geometry)));
        let meshes: usize = distinct.map(|i| i.geometry.bytes()).sum();
        meshes + self.instances.len() * size_of::<crate::scene::Instance>()
    }

    fn facts(&self) -> Vec<(&'static str, u64)> {
        vec![("faces", self.face_count() as u64), ("objects", self.instances.len() as u64)]
    }
}

impl Value for Volume {
    type Demand = ();
    const NAME: &'static str = "Volume";
    const READER: Option<&'static str> = Some("ReadVolume");

    fn key(&self) -> Option<Key> {
        Some(Volume::key(self))
    }

    fn bytes(&self) -> usize {
        Volume::bytes(self)
    }

    fn facts(&self) -> Vec<(&'static str, u64)> {
        vec![("samples", self.samples().len() as u64)]
    }
}

impl Value for Camera {
    type Demand = ();
    const NAME: &'static str = "Camera";

    fn bytes(&self) -> usize {
        size_of::<Camera>()
    }
}

impl Value for BspTree {
    type Demand = ();
    const NAME: &'static str = "BspTree";

    fn key(&self) -> Option<Key> {
        // It is a function of its scene.
        Some(Key::of(&("tree", Value::key(&**self.scene()))))
    }

    fn bytes(&self) -> usize {
        BspTree::bytes(self)
    }

    fn facts(&self) -> Vec<(&'static str, u64)> {
        let TreeCounts { faces, nodes, splits, .. } = self.counts();
        vec![("faces", faces), ("nodes", nodes), ("splits", splits)]
    }
}

/// What is asked of a [`SpanImage`]: where its lines lie, and which rows are needed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SpanDemand {
    /// The raster.
    pub raster: Raster,
    /// Where lines lie.
    pub plan: LinePlan,
    /// The rows that are needed.
    pub rows: Rows,
    /// Whether what lies behind opaque surfaces is needed too: something changes how much of it they hide.
    pub layered: bool,
}

impl SpanDemand {
    /// What a camera sees of a scene, found by `solve` of its [frame](scanline::frame). Where results are stored, what
    /// is seen is; faces are made ready again. Tells the user if nothing is seen.
    ///
    /// # Errors
    /// As [`scanline::frame`], and those of `solve`.
    pub fn seen(
        &self,
        scene: &Arc<Scene>,
        camera: &Camera,
        priority: i32,
        inputs: &Inputs<'_>,
        solve: impl FnOnce(&SpanImage) -> Result<SpanImage>,
    ) -> Result<SpanImage> {
        let view = View::new(camera, self.raster)?;
        let cluster = Cluster { priority, layered: self.layered, ..scene.clone().into() };
        let frame = scanline::frame(&[cluster], &view, self.plan, self.rows.clone())?;
        let image = inputs.remembered(
            |bytes| visible::restore(&frame, bytes),
            || solve(&frame),
            visible::stored::packed,
        )?;
        let faces = scene.face_count();
        if image.face_count() == 0 && faces > 0 {
            inputs.warn(&format!(
                "the camera sees none of the {faces} faces: `spandrel info` says where the scene lies"
            ));
        }
        Ok(image)
    }
}

impl Demand for SpanDemand {
    fn cover(&mut self, other: &SpanDemand) -> bool {
        let fits =
            (self.raster, self.plan, self.layered) == (other.raster, other.plan, other.layered);
        if fits {
            self.rows = self.rows.start.min(other.rows.start)..self.rows.end.max(other.rows.end);
        }
        fits
    }
}

impl Value for SpanImage {
    type Demand = SpanDemand;
    const NAME: &'static str = "SpanImage";
    const READER: Option<&'static str> = Some("ReadSpans");

    fn bytes(&self) -> usize {
        SpanImage::bytes(self)
    }

    fn facts(&self) -> Vec<(&'static str, u64)> {
        let spans = self.lines().items().len() as u64;
        let mut facts = vec![("spans", spans), ("faces", self.face_count() as u64)];
        let layers = self.layers().items().len() as u64;
        if layers > 0 {
            facts.push(("translucent segments", layers));
        }
        facts
    }
}

/// Lights: one, or those of a list.
#[derive(Clone, Debug)]
pub struct Lamps(pub Vec<Lamp>);

impl Lamps {
    /// The lamp of a node.
    ///
    /// # Errors
    /// If a number is out of range, or a file cannot be read.
    pub fn one(light: &dyn MakeLamp, inputs: &Inputs<'_>) -> Result<Lamps> {
        if let Some(doubt) = light.doubt() {
            inputs.warn(&doubt);
        }
        Ok(Lamps(vec![light.lamp("", inputs.directory())?]))
    }

    /// The first sky among the lights that a link leads to.
    ///
    /// # Errors
    /// If there is none.
    pub fn sky(inputs: &Inputs<'_>, link: &Link<Lamps>) -> Result<Lamp> {
        let lamps = inputs.get(link);
        let sky = lamps.0.iter().find(|lamp| lamp.light.luminance(DVec3::Y).is_some());
        let name = link.target();
        sky.cloned().ok_or_else(|| Error::invalid(format!("`sky`: \"{name}\" is no SkyLight")))
    }

    /// The lights that a link leads to, under names by which layers can be told apart: the link's for a light
    /// without a name, `link.name` for those of a list.
    pub fn named(inputs: &Inputs<'_>, link: &NamedLink<Lamps>) -> Vec<Lamp> {
        let name = |name: &str| match name {
            "" => link.name().to_owned(),
            name => format!("{}.{name}", link.name()),
        };
        let lamps = inputs.get(link);
        lamps.0.iter().map(|lamp| lamp.named(name(&lamp.name))).collect()
    }

    /// What is seen of a sky and of suns, as nodes ask for them by `sky` and `suns`.
    ///
    /// # Errors
    /// If there is no sky among the lights that `sky` names, or no disc among those that one of `suns` does.
    pub fn seen(
        inputs: &Inputs<'_>,
        sky: &Link<Lamps>,
        suns: &[Link<Lamps>],
        white: f32,
    ) -> Result<SeenSky> {
        let sky = Lamps::sky(inputs, sky)?;
        let mut discs = Vec::new();
        for link in suns {
            let lamps = inputs.get(link);
            let known = discs.len();
            discs.extend(lamps.0.iter().filter(|lamp| lamp.light.disc().is_some()).cloned());
            if discs.len() == known {
                let name = link.target();
                return Err(Error::invalid(format!(
                    "`suns`: \"{name}\" has no disc: a SunLight has, and a ParallelLight with an `angle`"
                )));
            }
        }
        Ok(SeenSky { sky, suns: discs, white })
    }

    /// Whether a node's lamp can be made, as far as no file tells.
    ///
    /// # Errors
    /// The field that is wrong.
    pub fn check(light: &dyn MakeLamp) -> std::result::Result<(), FieldError> {
        light.check().map_err(|fault| FieldError::new(fault.field, fault.error.to_string()))
    }
}

impl Value for Lamps {
    type Demand = ();
    const NAME: &'static str = "Light";

    fn key(&self) -> Option<Key> {
        Some(Key::of(&self.0))
    }

    fn bytes(&self) -> usize {
        0
    }

    fn facts(&self) -> Vec<(&'static str, u64)> {
        vec![("lights", self.0.len() as u64)]
    }
}

/// What the command line overrides in every picture.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Override {
    /// The size that visibility is solved for.
    pub size: Option<(u32, u32)>,
    /// The scale at which it is resolved.
    pub scale: Option<(f64, f64)>,
    /// The part that is computed.
    pub window: Option<Window>,
    /// That it is computed in bands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bands: Option<Bands>,
}

/// Pictures in bands of whole rows, so that several machines share the work. Bands are what a window of their rows
/// would be, and joined they are the picture, bit for bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Bands {
    /// How many there are, as equal as whole rows can be.
    pub of: u32,
    /// If only one is wanted, which, from 1 on. A picture is asked for one; who writes it asks for all and joins them.
    pub only: Option<u32>,
}

impl Override {
    /// The part of a picture or window that is wanted.
    ///
    /// # Errors
    /// If it has fewer rows than there are bands.
    pub fn part(&self, whole: Window) -> Result<Window> {
        let window = self.window.unwrap_or(whole);
        let Some(Bands { of, only: Some(number) }) = self.bands else { return Ok(window) };
        if window.height < of {
            return Err(Error::invalid(format!(
                "a picture of {} rows has no {of} bands: take fewer",
                window.height
            )));
        }
        let row = |at: u32| (u64::from(window.height) * u64::from(at) / u64::from(of)) as u32;
        let (top, bottom) = (row(number - 1), row(number));
        Ok(Window { y: window.y + top, height: bottom - top, ..window })
    }

    /// What is to be asked for by whoever writes a picture: all bands, or one.
    pub fn asked(&self) -> Vec<Override> {
        match self.bands {
            Some(Bands { of, only: None }) => { 1..=of }
                .map(|number| {
                    let bands = Some(Bands { of, only: Some(number) });
                    Override { bands, ..self.clone() }
                })
                .collect(),
            _ => vec![self.clone()],
        }
    }

    /// Whether a part is made for others to join, and nothing is written.
    pub fn is_for_others(&self) -> bool {
        self.bands.is_some_and(|bands| bands.only.is_some())
    }
}

/// What is asked of an [`Image`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PictureDemand {
    /// The channels that are needed.
    pub channels: BTreeSet<Channel>,
    /// What is overridden.
    pub changed: Override,
}

impl PictureDemand {
    /// The same of the whole picture, for what looks around each pixel.
    #[must_use]
    pub fn whole(&self) -> PictureDemand {
        let changed = Override { window: None, bands: None, ..self.changed.clone() };
        PictureDemand { channels: self.channels.clone(), changed }
    }

    /// The part of a whole picture that is asked for.
    ///
    /// # Errors
    /// As [`Override::part`].
    pub fn part(&self, image: Image) -> Result<Image> {
        let whole = Window::whole(image.size.0, image.size.1);
        let part = self.changed.part(whole)?;
        Ok(if part == whole { image } else { image.cropped(part) })
    }

    /// What visibility is solved for and what is shown of it, of a picture of a size, a scale and a window of
    /// its own; no window is the whole.
    ///
    /// # Errors
    /// If there is no such raster, scale or window.
    pub fn framing(
        &self,
        size: (u32, u32),
        scale: (f64, f64),
        window: Option<Window>,
    ) -> Result<(Raster, Framing)> {
        let (width, height) = self.changed.size.unwrap_or(size);
        let raster = Raster::new(width, height)?;
        let whole = Framing::scaled(raster, self.changed.scale.unwrap_or(scale).into())?;
        let all = Window::whole(whole.columns.end, whole.rows.end);
        let window = self.changed.part(window.unwrap_or(all))?;
        Ok((raster, whole.cut(window)?))
    }
}

impl Demand for PictureDemand {
    fn cover(&mut self, other: &PictureDemand) -> bool {
        let how = |demand: &PictureDemand| {
            let Override { size, scale, bands, .. } = demand.changed;
            (size, scale, bands)
        };
        let fits = how(self) == how(other);
        if fits {
            self.channels.extend(&other.channels);
            // No window is the whole picture.
            let windows = self.changed.window.zip(other.changed.window);
            self.changed.window = windows.map(|(a, b)| a.around(b));
        }
        fits
    }
}

impl Value for Image {
    type Demand = PictureDemand;
    const NAME: &'static str = "Image";
    const READER: Option<&'static str> = Some("Read");

    fn packed(&self) -> Option<Vec<u8>> {
        Image::packed(self)
    }

    fn unpacked(bytes: &[u8]) -> Option<Image> {
        Image::unpacked(bytes)
    }

    fn bytes(&self) -> usize {
        Image::bytes(self)
    }

    fn facts(&self) -> Vec<(&'static str, u64)> {
        vec![("pixels", self.window.area() as u64)]
    }
}

/// A file that was written.
#[derive(Clone, Debug)]
pub struct Delivery {
    /// Where it is.
    pub path: PathBuf,
    /// Its length.
    pub bytes: u64,
}

impl Demand for Override {
    fn cover(&mut self, other: &Override) -> bool {
        self == other
    }
}

impl Value for Delivery {
    type Demand = Override;
    const NAME: &'static str = "File";

    fn bytes(&self) -> usize {
        0
    }

    fn facts(&self) -> Vec<(&'static str, u64)> {
        vec![("file bytes", self.bytes)]
    }
}
