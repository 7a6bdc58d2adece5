//! What stands behind everything, or in front of it: one face over the whole picture (\[N], "Background
//! processing"; \[D], figure 15).
//!
//! A backdrop is a source of spans like any other, so it is merged by depth, shaded by programs, and seen by
//! rays that meet nothing else. Without a distance of its own it stands [`FAR`] away.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use crate::camera::{Plane, View};
use crate::color::Color;
use crate::error::{Error, FirstError, Result};
use crate::fragment::{Batch, Columns, FAR, Fragments, Provenance, Sight, Surfaces, beyond, stack};
use crate::image::{Image, Samples, Window};
use crate::key::Key;
use crate::light::seen::SeenSky;
use crate::math;
use crate::raster::{LinePlan, Rows};
use crate::span::{
    self, Candidates, FaceHead, FaceId, FaceTableBuilder, LineRenderer, Role, SpanImage,
};
use crate::texture::{Footprint, Opened, PictureSource, Wrap, store};
use crate::watch::Watch;

/// What a backdrop shows.
#[derive(Debug)]
pub enum Show {
    /// Colours by degrees above the horizon, from below upwards, mixed between; at least one.
    Gradient(Vec<(f64, Color)>),
    /// A sky, and suns.
    Sky(SeenSky),
    /// A picture that lies as its [`PictureFit`] says.
    Picture(Photograph),
}

/// A picture that a backdrop shows.
#[derive(Debug)]
pub struct Photograph {
    source: PictureSource,
    size: DVec2,
    is_opaque: bool,
    /// How it lies.
    pub by: PictureFit,
    /// By how many degrees a panorama is turned clockwise, seen from above.
    pub turn: f64,
}

/// How a picture lies behind a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum PictureFit {
    /// It fills the view; what does not fit is cut off.
    #[default]
    Fill,
    /// All of it is in the view; beside it is nothing.
    Whole,
    /// It is stretched to the view.
    Stretch,
    /// By direction: a panorama all around, twice as wide as high. Its middle lies towards -z.
    Direction,
}

impl Photograph {
    /// A picture in memory.
    ///
    /// # Errors
    /// If it is empty, not whole, or has no colour.
    pub fn new(image: &Arc<Image>, by: PictureFit, turn: f64) -> Result<Photograph> {
        let (width, height) = image.size;
        if by == PictureFit::Direction && width != 2 * height {
            return Err(Error::invalid(format!(
                "the picture has {width} x {height} pixels: one that lies by Direction is twice as wide as \
                 high"
            )));
        }
        let (source, is_opaque) = PictureSource::of(image)?;
        let size = DVec2::new(f64::from(width), f64::from(height));
        Ok(Photograph { source, size, is_opaque, by, turn: turn.to_radians() })
    }

    /// What it is.
    pub fn key(&self) -> Key {
        self.source.key
    }

    fn wrap(&self) -> [Wrap; 2] {
        match self.by {
            PictureFit::Direction => [Wrap::Repeat, Wrap::Clamp],
            PictureFit::Whole => [Wrap::Nothing; 2],
            PictureFit::Fill | PictureFit::Stretch => [Wrap::Clamp; 2],
        }
    }

    /// How often the picture stands in the view, to the right and upwards.
    fn scale(&self, view: &View) -> DVec2 {
        let [left, top, right, bottom] = view.window();
        let ratio = (right - left) / (bottom - top) / (self.size.x / self.size.y);
        let (wide, high) = match self.by {
            // The view is wider than the picture: all columns are seen, and some rows are not.
            PictureFit::Fill if ratio > 1.0 => (1.0, 1.0 / ratio),
            PictureFit::Fill => (ratio, 1.0),
            PictureFit::Whole if ratio > 1.0 => (ratio, 1.0),
            PictureFit::Whole => (1.0, 1.0 / ratio),
            PictureFit::Stretch | PictureFit::Direction => (1.0, 1.0),
        };
        DVec2::new(wide, high)
    }

    /// What a fragment covers of it.
    fn footprint(&self, fragments: &Fragments<'_>, i: usize) -> Footprint {
        if self.by == PictureFit::Direction {
            let (along, steps) = directions(fragments, i);
            let place = |way: DVec3| {
                let u = (math::atan2(way.x, -way.z) - self.turn) / TAU + 0.5;
                DVec2::new(u, 0.5 + elevation(way) / PI)
            };
            let at = place(along);
            let [right, down] = steps.map(|step| {
                let step = place((along + step).normalize_or(along)) - at;
                DVec2::new(step.x - step.x.round(), step.y)
            });
            return Footprint { at, right, down };
        }
        if fragments.sight.is_some() {
            // A flat picture does not say what lies beside the view: a mirror shows its mean.
            return Footprint { at: DVec2::splat(0.5), right: DVec2::X, down: DVec2::NEG_Y };
        }
        let [left, top, right, bottom] = fragments.view.window();
        let size = DVec2::new(right - left, bottom - top);
        let scale = self.scale(fragments.view);
        let at = DVec2::new(fragments.x[i] - left, bottom - fragments.y[i]) / size;
        let step = fragments.pixel / size * scale;
        Footprint {
            at: (at - 0.5) * scale + 0.5,
            right: DVec2::new(step.x, 0.0),
            down: DVec2::new(0.0, -step.y),
        }
    }
}

/// The direction in which a fragment is seen, and how it changes to the next pixel on the right and below.
fn directions(fragments: &Fragments<'_>, i: usize) -> (DVec3, [DVec3; 2]) {
    let (_, along, length) = fragments.way(i);
    let steps = fragments.footprint(i, fragments.point(i), -along);
    (along, steps.map(|step| step / length))
}

/// The angle above the horizon, in radians.
fn elevation(way: DVec3) -> f64 {
    FRAC_PI_2 - math::acos(way.y.clamp(-1.0, 1.0))
}

/// The surfaces of a backdrop: one face that lights leave alone.
#[derive(Debug)]
struct Backdrop {
    show: Show,
    strength: Color,
    /// Along the view axis, in metres.
    distance: f64,
    fault: FirstError,
}

impl Backdrop {
    fn color(&self, fragments: &Fragments<'_>, opened: Option<&Opened<'_>>, i: usize) -> [f32; 4] {
        let opaque = |color: Color| [color.r, color.g, color.b, 1.0];
        match &self.show {
            Show::Gradient(colors) => {
                let angle = elevation(fragments.way(i).1).to_degrees();
                let next = colors.partition_point(|(at, _)| *at <= angle);
                let color = match (next.checked_sub(1).map(|at| colors[at]), colors.get(next)) {
                    (Some((from, below)), Some((to, above))) => {
                        below.mix(*above, ((angle - from) / (to - from)) as f32)
                    }
                    (Some((_, color)), None) | (None, Some(&(_, color))) => color,
                    (None, None) => Color::BLACK,
                };
                opaque(color)
            }
            Show::Sky(sky) if sky.suns.is_empty() => opaque(sky.color(fragments.way(i).1, None)),
            Show::Sky(sky) => {
                let (along, steps) = directions(fragments, i);
                opaque(sky.color(along, Some(steps)))
            }
            Show::Picture(picture) => {
                let Some(opened) = opened else { return [0.0; 4] };
                let footprint = picture.footprint(fragments, i);
                let seen = footprint.see(opened, fragments.textures, picture.wrap());
                let [r, g, b, a, _] = self.fault.sift(seen).unwrap_or_default();
                let straight = if a > 0.0 { 1.0 / a } else { 0.0 };
                [r * straight, g * straight, b * straight, a]
            }
        }
    }

    fn is_opaque(&self) -> bool {
        match &self.show {
            Show::Picture(picture) => picture.is_opaque && picture.by != PictureFit::Whole,
            Show::Gradient(_) | Show::Sky(..) => true,
        }
    }
}

impl Surfaces for Backdrop {
    fn fill(&self, wanted: Columns, fragments: &mut Fragments<'_>) {
        let opened = match &self.show {
            Show::Picture(picture) => self.fault.sift(store().open(&picture.source)),
            Show::Gradient(_) | Show::Sky(..) => None,
        };
        for i in 0..fragments.len() {
            if wanted.contains(Columns::COLOR) {
                let [r, g, b, a] = self.color(fragments, opened.as_ref(), i);
                fragments.color.push(Color::new(r, g, b) * self.strength);
                fragments.alpha.push(a);
                fragments.unlit.push(true);
            }
            if wanted.meets(Columns::NORMAL | Columns::FACING) {
                let toward = -fragments.way(i).1;
                if wanted.contains(Columns::NORMAL) {
                    fragments.normal.push(toward.as_vec3());
                }
                if wanted.contains(Columns::FACING) {
                    fragments.facing.push(toward);
                }
            }
        }
    }

    fn varying(&self, _: u32) -> Columns {
        Columns::COLOR | Columns::NORMAL
    }

    fn object(&self, _: u32) -> String {
        String::new()
    }

    fn beyond(&self) -> Option<(u32, f64)> {
        Some((0, self.distance))
    }

    fn fault(&self) -> Option<Error> {
        self.fault.take()
    }

    fn provenance(&self) -> Option<&dyn Provenance> {
        Some(self)
    }
}

impl Provenance for Backdrop {
    fn names(&self) -> Option<[Vec<String>; 2]> {
        Some([vec![String::new()], Vec::new()])
    }
}

/// Where and how a backdrop stands.
#[derive(Clone, Debug)]
pub struct BackgroundOptions {
    /// What it is called.
    pub label: String,
    /// What is shown, whatever is told apart by it.
    pub key: Key,
    /// By how much its colours are multiplied.
    pub strength: Color,
    /// Its distance along the view axis in metres; [`FAR`] if there is none.
    pub distance: Option<f64>,
}

/// The image of a backdrop.
///
/// # Errors
/// If the distance is not above 0 (of a parallel view: not finite).
pub fn image(
    show: Show,
    stand: BackgroundOptions,
    view: &View,
    plan: LinePlan,
    rows: Rows,
) -> Result<SpanImage> {
    let distance = stand.distance.unwrap_or(FAR);
    if !distance.is_finite() || (!view.is_parallel() && distance <= 0.0) {
        return Err(Error::invalid(format!("`distance` is {distance} m: it must be above 0")));
    }
    let fault = FirstError::default();
    let surfaces = Backdrop { show, strength: stand.strength, distance, fault };
    let is_translucent = !surfaces.is_opaque();
    let [left, top, right, bottom] = view.window();
    let corners = [[left, top], [right, top], [right, bottom], [left, bottom]].map(DVec2::from);
    let mut faces = FaceTableBuilder::new();
    let first = faces.points(corners)?;
    let plane = Plane::constant(view.depth(distance));
    let head =
        FaceHead { ordinal: 0, plane, rank: 0, role: Role::Face, sees_front: true, is_translucent };
    faces.face(head, [&(first..first + 4).collect::<Vec<u32>>()[..]])?;
    let source = span::Source {
        label: stand.label,
        scene: stand.key,
        surfaces: Arc::new(surfaces),
        stack: Vec::new(),
        matte: None,
        held: Vec::new(),
        faces: Arc::new(faces.finish()),
    };
    let frame = SpanImage::frame(view.clone(), plan, rows, vec![source])?;
    let face = frame.id(0, 0);
    frame.rendered(Arc::new(Everywhere { face, window: view.window() }))
}

/// One face that is seen wherever the camera's window is.
struct Everywhere {
    face: FaceId,
    /// Left, top, right and bottom, in pixels.
    window: [f64; 4],
}

impl LineRenderer for Everywhere {
    fn line(&self, _: &SpanImage, y: f64, found: &mut Candidates<'_>) -> Result<()> {
        let [left, top, right, bottom] = self.window;
        if y >= top && y < bottom { found.add(self.face, left..right) } else { Ok(()) }
    }
}

/// What stands behind an image in all directions, as a panorama of so many rows, twice as wide, with colour and
/// alpha: its backdrops over each other, each with all that was done to it. Its middle lies towards -z, its top is the
/// zenith; a camera's place counts only for programs that ask where they are.
///
/// # Errors
/// If nothing stands behind the image, or it cannot be computed.
pub fn panorama(image: &SpanImage, rows: u32) -> Result<Image> {
    let behind = beyond(image.sources().iter().map(|source| &*source.surfaces));
    if behind.is_empty() {
        return Err(Error::invalid("nothing stands behind this image: give it a Background"));
    }
    let columns = 2 * rows;
    let watch = Watch::current();
    watch.begin(rows as usize);
    let row = |row: u32| {
        let mut shown = vec![[0.0f32; 4]; columns as usize];
        watch.step();
        for (at, face) in behind.iter().filter(|_| !watch.is_stopped()) {
            let source = &image.sources()[*at];
            let mut fragments = all_round(image.view(), *face, row, rows);
            fragments.label.clone_from(&source.label);
            fragments.scene = source.scene;
            stack::shade(&source.stack, &*source.surfaces, &Alone, &mut fragments);
            for (i, shown) in shown.iter_mut().enumerate() {
                let (color, share) = (fragments.color[i], fragments.alpha[i] * (1.0 - shown[3]));
                let [r, g, b] = color.to_array().map(|value| value * share);
                // Front to back: each shows what those before it leave.
                shown.iter_mut().zip([r, g, b, share]).for_each(|(sum, part)| *sum += part);
            }
        }
        shown
    };
    let pixels: Vec<[f32; 4]> = (0..rows).into_par_iter().flat_map_iter(row).collect();
    if let Some(fault) = behind.iter().find_map(|(at, _)| image.sources()[*at].surfaces.fault()) {
        return Err(fault);
    }
    let mut made = Image::new((columns, rows), Window::whole(columns, rows));
    for (k, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
        made.insert(name, Samples::Float(pixels.iter().map(|pixel| pixel[k]).collect()))?;
    }
    Ok(made)
}

/// The fragments of a face that is seen in all directions of a row of a panorama.
fn all_round(view: &View, face: u32, row: u32, rows: u32) -> Fragments<'_> {
    let mut fragments = Fragments::new(view);
    let mut sight = Sight { turns: 1, ..Sight::default() };
    let from = view.camera().position;
    let step = PI / f64::from(rows);
    let panorama = DVec2::new(f64::from(2 * rows), f64::from(rows));
    let raster = DVec2::new(f64::from(view.raster().width), f64::from(view.raster().height));
    let up = FRAC_PI_2 - (f64::from(row) + 0.5) * step;
    for column in 0..2 * rows {
        let round = (f64::from(column) + 0.5) * step - PI;
        let level = math::cos(up);
        let way = DVec3::new(level * math::sin(round), math::sin(up), -level * math::cos(round));
        // The place in the panorama, as a share of the picture at hand.
        let place = DVec2::new(f64::from(column) + 0.5, f64::from(row) + 0.5);
        let DVec2 { x, y } = place / panorama * raster;
        fragments.push(face, true, x, y, view.depth(FAR));
        fragments.position.push(from + way * FAR);
        sight.from.push(from);
        sight.weight.push(Color::WHITE);
        sight.before.push(0.0);
        sight.width.push((FAR * step) as f32);
    }
    fragments.sight = Some(sight);
    fragments
}

/// Fragments with nothing around them.
struct Alone;

impl Batch for Alone {}
