//! Resolve: from spans to pixels, at any size, without solving visibility again.
//!
//! 1. *Coverage* ([`coverage`]): the covers of every pixel, by an integration rule ([`rule`]) and a
//!    pixel filter ([`filter`]).
//!    Pixels that may be off by more than the rule tolerates are divided (`doubt`, `refine`).
//! 2. *Intensity*: faces whose shading is the same all over are shaded once; this is \[N]'s stored
//!    intensity, a memo of the image, which a new light replaces without touching spans.
//! 3. *Fragments*: covers of other faces are shaded one by one, in batches (`paint`).
//! 4. Where translucent faces lie over others, colours are blended fragment by fragment.
//! 5. Colours, and what other channels hold, are added up, weighted by coverage (\[N] eq. 2; `channel`).

mod again;
mod boundary;
mod channel;
pub mod coverage;
mod doubt;
pub mod filter;
mod hidden;
mod intensity;
mod lit;
pub mod lookup;
mod paint;
pub mod pick;
mod refine;
pub mod rule;
mod select;
pub mod shutter;
mod stacks;
mod strip;
mod unseen;

pub use coverage::{Cover, Coverage};
pub use filter::PixelFilter;
pub use rule::{Framing, Rate, Rule, Vertical, Weighting};
pub use select::Select;

use glam::{DAffine3, DMat4, DVec2, DVec3, DVec4};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::ops::BitOr;
use std::sync::Arc;
use std::time::Instant;

use crate::camera::View;
use crate::error::{Error, Result};
use crate::image::{Attributes, Channel, Image, Samples};
use crate::raster::Rows;
use crate::span::SpanImage;
use crate::span::image::Intensities;
use crate::visible::probe::FaceIndex;
use crate::watch::Watch;
use again::Last;
use channel::Needs;
use paint::{Ahead, IdNames, Painter, Pixels};
use select::Selected;

/// Rows of a task.
const BAND: u32 = 8;

/// Resolves an image into a picture with the given channels. Colour is the mean over the pixel; all
/// other channels are those of the face that covers most of it, at the middle of what it covers.
///
/// # Errors
/// If the image does not have the rule's line plan or not all rows that the framing needs, or the scene of
/// its faces is not there and they must be lit.
pub fn resolve(
    image: &SpanImage,
    rule: Rule,
    framing: &Framing,
    channels: &BTreeSet<Channel>,
) -> Result<Image> {
    Ok(painted(image, rule, framing, channels, None)?.0)
}

/// Computes a part of a picture anew: pixels that show anything selected are those of
/// [`resolve`], bit for bit, and all others those of `over`. Only fragments in these pixels are shaded. Returns also how
/// many pixels are new.
///
/// # Errors
/// As [`resolve`], or if `over` has not the framing's window or not all channels.
pub fn refine(
    over: &Image,
    image: &SpanImage,
    rule: Rule,
    framing: &Framing,
    channels: &BTreeSet<Channel>,
    select: &Select,
) -> Result<(Image, u64)> {
    let size = Framing::size(image.view().raster(), framing.scale)?;
    if (over.size, over.window) != (size, framing.window()) {
        let ((w, h), (width, height)) = (over.size, size);
        return Err(Error::invalid(format!(
            "the picture to refine has {w} by {h} pixels, of which {} are here; what is refined has \
             {width} by {height}, and {}: give `size`, `scale` and `window` as its Resolve has them",
            over.window,
            framing.window(),
        )));
    }
    let window = framing.window();
    let selected = select.of(image);
    let (mut picture, touched) = painted(image, rule, framing, channels, Some(&selected))?;
    if let (Some(old), Some(new)) = (&over.how, &picture.how)
        && old != new
    {
        return Err(Error::invalid(format!(
            "the picture to refine was resolved with {old}; what is refined with {new}: both must be alike"
        )));
    }
    let mut refined = over.clone();
    let anew = touched.iter().filter(|is_touched| **is_touched).count() as u64;
    Watch::current().count("pixels refined", anew);
    refined.names.append(&mut picture.names);
    // A layer that only one of them has is black in the other.
    let black = Samples::Float(vec![0.0; window.area()]);
    for (name, known) in over.channels().filter(|(name, _)| is_layer(name)) {
        if let (None, Some(old)) = (picture.channel(name), known.floats()) {
            let black = vec![0.0; old.len()];
            refined.insert(name, Samples::Float(chosen(old, &black, &touched)))?;
        }
    }
    for (name, samples) in picture.channels() {
        let known = over.channel(name).or_else(|| is_layer(name).then_some(&black));
        let known = known.ok_or_else(|| {
            Error::invalid(format!(
                "the picture to refine has no channel {name}: write both with the same `channels`"
            ))
        })?;
        let blended = match (known, samples) {
            (Samples::Id(old), Samples::Id(new)) => Samples::Id(chosen(old, new, &touched)),
            (old, new) => match old.floats().zip(new.floats()) {
                Some((old, new)) => Samples::Float(chosen(old, new, &touched)),
                None => return Err(Error::invalid(format!("the channel {name} is of two kinds"))),
            },
        };
        refined.insert(name, blended)?;
    }
    Ok((refined, anew))
}

/// Whether a channel is of a light's layer.
fn is_layer(channel: &str) -> bool {
    channel.starts_with("light_")
}

fn chosen<T: Copy>(old: &[T], new: &[T], is_new: &[bool]) -> Vec<T> {
    let pairs = old.iter().zip(new).zip(is_new);
    pairs.map(|((old, new), is_new)| if *is_new { *new } else { *old }).collect()
}

/// The picture, and which of its pixels were computed if not all.
fn painted(
    image: &SpanImage,
    rule: Rule,
    framing: &Framing,
    channels: &BTreeSet<Channel>,
    selected: Option<&Selected>,
) -> Result<(Image, Vec<bool>)> {
    let plan = rule.plan()?;
    if plan != image.plan() {
        return Err(Error::invalid(format!(
            "an image with {} cannot be resolved by {rule:?}, which needs {plan}",
            image.plan()
        )));
    }
    let raster = image.view().raster();
    let needed = framing.raster_rows(raster);
    let held = image.rows();
    if needed.start < held.start || needed.end > held.end {
        return Err(Error::invalid(format!("rows {needed:?} are needed, the image has {held:?}")));
    }
    rule.check_filter(framing.filter)?;
    let makers = channel::makers(image, channels);
    let needs = makers.iter().map(|maker| maker.needs()).fold(Needs::default(), BitOr::bitor);
    for source in image.sources().iter().filter(|source| !source.faces.faces().is_empty()) {
        source.surfaces.offers(channel::columns(needs, source.reads()))?;
    }
    if needs.shaded {
        image.check_worlds()?;
    }
    // Only rules that divide pixels ask for faces that no line has met.
    let index = rule.tolerance().map(|_| FaceIndex::new(image));
    let window = framing.window();
    // What is kept of faces is their colour and no more.
    let intensities = match framing.shading {
        _ if needs.fragments => Arc::new(Intensities::new(vec![None; image.face_count()])),
        Rate::Face => intensity::of_all(image),
        Rate::Pixel | Rate::Line => intensity::of(image),
    };
    let mut touched = vec![false; if selected.is_some() { window.area() } else { 0 }];
    let mut values: Vec<Vec<(String, Samples)>> =
        makers.iter().map(|maker| maker.values(window.area())).collect();
    let clock = Instant::now();
    let bands: Vec<(u32, Rows)> = (framing.rows.clone().step_by(BAND as usize))
        .map(|first| (first / BAND, first..framing.rows.end.min(first + BAND)))
        .collect();
    // Rules that divide pixels look at more than lines.
    let way = (selected.is_none() && rule.tolerance().is_none())
        .then(|| again::key(image, (rule, framing), channels, &values));
    let watch = Watch::current();
    let last = way.and_then(|way| Last::of(way, &watch));
    let is_same = last.as_ref().map(|last| last.same(image, framing, &bands));
    let is_same = is_same.unwrap_or_else(|| vec![false; bands.len()]);
    // Each band gets its own slices of all channels: tasks write side by side without a lock, and
    // no sum depends on which is first.
    let rows = BAND as usize * window.width as usize;
    let mut parts: Vec<Pixels<'_>> = bands.iter().map(|_| Pixels::of(makers.len())).collect();
    for (maker, values) in values.iter_mut().enumerate() {
        for (_, samples) in values {
            match samples {
                Samples::Id(ids) => deal(ids, rows, &mut parts, |part, ids| {
                    part.values[maker].ids.push(ids);
                }),
                Samples::Float(floats) => deal(floats, rows, &mut parts, |part, floats| {
                    part.values[maker].floats.push(floats);
                }),
                _ => unreachable!("what is made is floats or ids"),
            }
        }
    }
    deal(&mut touched, rows, &mut parts, |part, touched| part.touched = touched);
    let mut names: Vec<IdNames> = vec![IdNames::default(); bands.len()];
    let mut to_do = Vec::new();
    for (at, part) in parts.into_iter().enumerate() {
        match last.as_ref().filter(|_| is_same[at]) {
            Some(last) => {
                part.take(&last.values, at * rows);
                names[at] = last.names[at].clone();
            }
            None => to_do.push((at, bands[at].clone(), part)),
        }
    }
    let painter = || {
        let mut coverage = Coverage::new(image, rule, framing, index.as_ref()).without_hidden();
        if needs.estimates {
            coverage = coverage.with_estimates();
        }
        Painter::new(image, rule, framing, &intensities, needs, coverage, &watch)
            .with_makers(&makers)
            .with_selected(selected)
    };
    let open: Vec<(u32, Rows)> = to_do.iter().map(|(_, band, _)| band.clone()).collect();
    let ahead = if needs.shaded { Ahead::of(image, &open, painter) } else { None };
    let (ahead, passes) = ahead.unzip();
    watch.begin(bands.len());
    (open.len()..bands.len()).for_each(|_| watch.step());
    let new: Vec<(usize, IdNames)> = to_do
        .into_par_iter()
        .enumerate()
        // A thread keeps its painter from band to band, and with it the memory of its rows.
        .map_init(painter, |painter, (number, (at, (band, rows), part))| {
            let ahead = ahead.as_ref().map(|ahead| &ahead[number]);
            (at, painter.rows(band, rows, ahead, part))
        })
        .collect();
    new.into_iter().for_each(|(at, of_band)| names[at] = of_band);
    // Surfaces are asked by value and have no way to fail there. What went wrong is asked for at
    // the end.
    if let Some(fault) = image.sources().iter().find_map(|source| source.surfaces.fault()) {
        return Err(fault);
    }
    if let Some(way) = way {
        Last::keep(way, image, (&values, &names), (&watch, clock.elapsed().as_secs_f64()));
    }
    let size = Framing::size(raster, framing.scale)?;
    let mut picture = Image::new(size, window);
    let taken = bands.iter().zip(&is_same).filter(|(_, is_same)| **is_same);
    let taken: u64 = taken.map(|((_, rows), _)| rows.len() as u64).sum();
    if taken > 0 {
        watch.count("rows as before", taken);
    }
    let Framing { scale, pan, vertical, filter, .. } = framing;
    picture.attributes = Some(Arc::new(attributes(image.view(), framing, size)));
    picture.how = Some(format!(
        "lines {rule:?}, scale ({}, {}), pan ({}, {}), vertical {vertical:?}, filter {filter:?}",
        scale.x, scale.y, pan.x, pan.y
    ));
    for (name, samples) in values.into_iter().flatten() {
        picture.insert(&name, samples)?;
    }
    if let Some(passes) = passes {
        watch.count("passes for pictures on surfaces", passes);
    }
    picture.names.extend(names.into_iter().flatten());
    Ok((picture, touched))
}

/// What files say of the camera that took a picture of a size.
fn attributes(view: &View, framing: &Framing, size: (u32, u32)) -> Attributes {
    let size = DVec2::new(f64::from(size.0), f64::from(size.1));
    let (scale, pan) = (framing.scale / size, framing.pan / size);
    let frame = DMat4::from_cols(
        DVec4::X * scale.x,
        DVec4::Y * scale.y,
        DVec4::Z,
        DVec4::new(pan.x, pan.y, 0.0, 1.0),
    );
    // The eye looks along -z.
    let looking = DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0));
    let camera = looking * view.eye_from_object(&DAffine3::IDENTITY);
    let front = Some(view.camera().front).filter(|front| *front > 0.0);
    Attributes::of_camera(camera, frame * view.screen_from_world(), [front, view.camera().back])
}

/// Deals runs of a channel's values to the parts of a picture.
fn deal<'p, T>(
    values: &'p mut [T],
    run: usize,
    parts: &mut [Pixels<'p>],
    give: impl Fn(&mut Pixels<'p>, &'p mut [T]),
) {
    for (part, values) in parts.iter_mut().zip(values.chunks_mut(run.max(1))) {
        give(part, values);
    }
}
