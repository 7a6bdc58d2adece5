//! Resolve: from spans to pixels, at any size, without solving visibility again.
//!
//! 1. *Coverage* ([`coverage`]): the covers of every pixel, by an integration rule ([`rule`]) and a
//!    pixel filter ([`filter`]).
//!    Pixels that may be off by more than the rule tolerates are divided (`doubt`, `refine`).
//! 2. *Intensity*: faces whose shading is the same all over are shaded once; this is \[N]'s stored
//!    intensity, a memo of the image, which a new light replaces without touching spans.
//! 3. *Fragments*: covers of other faces are shaded one by one, in batches ([`shade`](self)).
//! 4. Where translucent faces lie over others, colours are blended fragment by fragment.
//! 5. Colours are added up, weighted by coverage (\[N] eq. 2).

mod boundary;
pub mod coverage;
mod doubt;
pub mod filter;
mod hidden;
mod intensity;
mod lit;
mod refine;
pub mod rule;
mod select;
mod stacks;
mod stream;
mod strip;
mod unseen;

pub use coverage::{Cover, Coverage};
pub use filter::Filter;
pub use rule::{Framing, Rate, Rule, Vertical, Weighting};
pub use select::Select;

use rayon::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

use crate::color::Kind;
use crate::error::{Error, Result};
use crate::fragment::{Columns, Layers, Stage};
use crate::image::{Image, Samples, is_layer_of_light};
use crate::raster::Rows;
use crate::span::SpanImage;
use crate::span::image::Intensities;
use crate::visible::probe::Index;
use crate::watch::Watch;
use select::Selected;
use stream::{Ahead, Pixels, Stream, Told};

/// Rows of a task.
const BAND: u32 = 8;

/// A channel, or group of channels, of a picture.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
pub enum Channel {
    /// `R`, `G`, `B`, `A`: colour with associated alpha.
    Color,
    /// `Z`: the distance along the view axis in metres, infinite where there is background.
    Z,
    /// `N.X`, `N.Y`, `N.Z`: the unit normal in world axes.
    N,
    /// `P.X`, `P.Y`, `P.Z`: the position in the world in metres.
    P,
    /// `id`: the object, as a hash of its name; 0 is background.
    Id,
    /// `light_NAME.R`, `.G`, `.B` for each light: what it adds to the colour, as it is shown; and
    /// `rest.R`, `.G`, `.B`, what comes from none. They sum to the colour.
    Light,
    /// `NAME`, or `NAME.R`, `.G`, `.B`, for each channel that programs made of fragments (the node `Stream`),
    /// resolved as the colour is: the mean over the pixel, nothing where nothing is.
    Made,
    /// Of pictures that were read: whatever else they have, under its own names. Nothing else has any.
    Others,
    /// `light_error.R`, `.G`, `.B`: an estimate of the error of light that is found by samples, soft light and
    /// that of `Rays`: by how much the colour may be off, as the standard deviation of as many random
    /// samples, of which those taken are mostly better. One sample estimates nothing, and is taken to be off by
    /// half of the light. Gloss is not in it.
    #[serde(rename = "light_error")]
    LightError,
    /// `aa_error`: an estimate of the error of antialiasing: by which share of the pixel its coverage may
    /// be off, 0 to 1.
    #[serde(rename = "aa_error")]
    Error,
}

impl Channel {
    /// Those for which fragments are shaded.
    const OF_COLOR: [Channel; 4] =
        [Channel::Color, Channel::Light, Channel::Made, Channel::LightError];

    /// Which of them a picture's channel of a name is; `None` for those that programs or files have beside them.
    pub fn of(name: &str) -> Option<Channel> {
        let layer = name.rsplit_once('.').map_or("", |(layer, _)| layer);
        Some(match name {
            "R" | "G" | "B" | "A" => Channel::Color,
            "Z" => Channel::Z,
            "id" => Channel::Id,
            "aa_error" => Channel::Error,
            "N.X" | "N.Y" | "N.Z" => Channel::N,
            "P.X" | "P.Y" | "P.Z" => Channel::P,
            _ if layer == "light_error" => Channel::LightError,
            _ if is_layer_of_light(layer) => Channel::Light,
            _ => return None,
        })
    }
}

/// Three numbers for each pixel beside its colour.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Layer {
    /// What a light gives, by its name.
    Light(String),
    /// A channel that programs made.
    Made(String, Kind),
}

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
    Ok(paint(image, rule, framing, channels, None)?.0)
}

/// Computes a part of a picture anew: pixels that show anything selected are those of
/// [`resolve`], bit for bit, and all others those of `over`. Only fragments in these pixels are shaded.
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
) -> Result<Image> {
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
    let (mut picture, touched) = paint(image, rule, framing, channels, Some(&selected))?;
    if let (Some(old), Some(new)) = (&over.how, &picture.how)
        && old != new
    {
        return Err(Error::invalid(format!(
            "the picture to refine was resolved with {old}; what is refined with {new}: both must be alike"
        )));
    }
    let mut refined = over.clone();
    refined.counts = std::mem::take(&mut picture.counts);
    refined
        .counts
        .insert("pixels refined", touched.iter().filter(|is_touched| **is_touched).count() as u64);
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
    Ok(refined)
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
fn paint(
    image: &SpanImage,
    rule: Rule,
    framing: &Framing,
    channels: &BTreeSet<Channel>,
    selected: Option<&Selected>,
) -> Result<(Image, Vec<bool>)> {
    let channels: BTreeSet<Channel> =
        channels.iter().copied().filter(|channel| *channel != Channel::Others).collect();
    let channels = &channels;
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
    let wants_color = Channel::OF_COLOR.iter().any(|c| channels.contains(c));
    for source in image.sources().iter().filter(|source| !source.faces.faces().is_empty()) {
        let shading = if wants_color { source.reads() } else { Columns::NONE };
        let normals = if channels.contains(&Channel::N) { Columns::NORMAL } else { Columns::NONE };
        source.surfaces.offers(shading | normals)?;
    }
    if wants_color {
        image.check_worlds()?;
    }
    // Only rules that divide pixels ask for faces that no line has met.
    let index = rule.tolerance().map(|_| Index::new(image));
    let window = framing.window();
    let mut wanted = Vec::new();
    if channels.contains(&Channel::LightError) {
        wanted.push(Layer::Light(Layers::ERROR.to_owned()));
    }
    if channels.contains(&Channel::Light) {
        wanted.extend(lights(image).into_iter().map(Layer::Light));
    }
    if channels.contains(&Channel::Made) {
        wanted
            .extend(image.made_channels().into_iter().map(|(name, kind)| Layer::Made(name, kind)));
    }
    let nothing = Intensities::new(vec![None; image.face_count()]);
    // What is kept of faces has no layers.
    let intensities = match framing.shading {
        _ if !wanted.is_empty() => Arc::new(nothing),
        Rate::Face => intensity::of_all(image),
        Rate::Pixel | Rate::Line => intensity::of(image),
    };
    let mut touched = vec![false; if selected.is_some() { window.area() } else { 0 }];
    let area = |channel: Channel| if channels.contains(&channel) { window.area() } else { 0 };
    let float = |channel: Channel| vec![0.0f32; area(channel)];
    let mut color: [Vec<f32>; 4] = std::array::from_fn(|_| float(Channel::Color));
    let mut normal: [Vec<f32>; 3] = std::array::from_fn(|_| float(Channel::N));
    let mut position: [Vec<f32>; 3] = std::array::from_fn(|_| float(Channel::P));
    let mut z = float(Channel::Z);
    let mut error = float(Channel::Error);
    let mut id = vec![0u32; area(Channel::Id)];
    let mut layers = vec![vec![0.0f32; window.area()]; 3 * wanted.len()];
    let bands: Vec<(u32, Rows)> = (framing.rows.clone().step_by(BAND as usize))
        .map(|first| (first / BAND, first..framing.rows.end.min(first + BAND)))
        .collect();
    // Each band gets its own slices of all channels: tasks write side by side without a lock, and
    // no sum depends on which is first.
    let mut parts: Vec<Pixels<'_>> = bands.iter().map(|_| Pixels::default()).collect();
    let rows = BAND as usize * window.width as usize;
    deal(&mut color, rows, &mut parts, |part, i, values| part.color[i] = values);
    deal(&mut normal, rows, &mut parts, |part, i, values| part.normal[i] = values);
    deal(&mut position, rows, &mut parts, |part, i, values| part.position[i] = values);
    deal(&mut layers, rows, &mut parts, |part, _, values| part.layers.push(values));
    deal(std::slice::from_mut(&mut z), rows, &mut parts, |part, _, values| part.z = values);
    deal(std::slice::from_mut(&mut error), rows, &mut parts, |part, _, values| part.error = values);
    deal(std::slice::from_mut(&mut touched), rows, &mut parts, |part, _, values| {
        part.touched = values
    });
    deal(std::slice::from_mut(&mut id), rows, &mut parts, |part, _, values| part.id = values);
    let watch = Watch::current();
    let stream = || {
        let mut coverage = Coverage::new(image, rule, framing, index.as_ref()).without_hidden();
        if channels.contains(&Channel::Error) {
            coverage = coverage.with_estimates();
        }
        Stream::new(image, rule, framing, &intensities, channels, coverage, &watch)
            .with_layers(&wanted)
            .with_selected(selected)
    };
    let ahead = if wants_color { Ahead::of(image, &bands, stream) } else { None };
    let (ahead, passes) = ahead.unzip();
    watch.begin(bands.len());
    let told: Vec<Told> = bands
        .par_iter()
        .zip(parts)
        .enumerate()
        // A thread keeps its stream from band to band, and with it the memory of its rows.
        .map_init(stream, |stream, (at, ((band, rows), part))| {
            let ahead = ahead.as_ref().map(|ahead| &ahead[at]);
            stream.rows(*band, rows.clone(), ahead, part)
        })
        .collect();
    // Surfaces are asked by value and have no way to fail there. What went wrong is asked for at
    // the end.
    if let Some(fault) = image.sources().iter().find_map(|source| source.surfaces.fault()) {
        return Err(fault);
    }
    let size = Framing::size(raster, framing.scale)?;
    let mut picture = Image::new(size, window);
    let Framing { scale, pan, vertical, filter, .. } = framing;
    picture.how = Some(format!(
        "lines {rule:?}, scale ({}, {}), pan ({}, {}), vertical {vertical:?}, filter {filter:?}",
        scale.x, scale.y, pan.x, pan.y
    ));
    let groups = [
        (Channel::Color, &["R", "G", "B", "A"][..], Vec::from(color)),
        (Channel::N, &["N.X", "N.Y", "N.Z"], Vec::from(normal)),
        (Channel::P, &["P.X", "P.Y", "P.Z"], Vec::from(position)),
        (Channel::Z, &["Z"], vec![z]),
        (Channel::Error, &["aa_error"], vec![error]),
    ];
    for (channel, channel_names, values) in groups {
        if channels.contains(&channel) {
            for (name, values) in channel_names.iter().zip(values) {
                picture.insert(name, Samples::Float(values))?;
            }
        }
    }
    let mut layers = layers.into_iter();
    for (name, layer) in layer_names(&wanted).iter().zip(&wanted) {
        let is_number = matches!(layer, Layer::Made(_, Kind::Number));
        for (axis, values) in ["R", "G", "B"].into_iter().zip(layers.by_ref()) {
            match axis {
                "R" if is_number => picture.insert(name, Samples::Float(values))?,
                _ if is_number => {}
                _ => picture.insert(&format!("{name}.{axis}"), Samples::Float(values))?,
            }
        }
    }
    if channels.contains(&Channel::Id) {
        picture.insert("id", Samples::Id(id))?;
    }
    if let Some(passes) = passes {
        picture.counts.insert("passes for pictures on surfaces", passes);
    }
    for Told { names, counts } in told {
        picture.names.extend(names);
        for (what, number) in counts {
            *picture.counts.entry(what).or_default() += number;
        }
    }
    Ok((picture, touched))
}

/// The names of all layers of light of an image.
fn lights(image: &SpanImage) -> Vec<String> {
    let mut names = Vec::new();
    image.sources().iter().for_each(|source| add_layers(&source.stack, &mut names));
    names.sort();
    names.dedup();
    names.push(Layers::REST.to_owned());
    names
}

/// Adds the names of the layers of a stack, and of what rays see from it.
fn add_layers(stack: &[Stage], names: &mut Vec<String>) {
    for stage in stack {
        let Stage::Shade(shading) = stage else { continue };
        names.extend(shading.shader().layers());
        let members = shading.world().into_iter().flat_map(|world| world.members());
        members.filter(|member| member.is_beside).for_each(|m| add_layers(&m.stack, names));
    }
}

/// The names of layers as compositors take them: letters, digits and `_`, no two alike.
fn layer_names(layers: &[Layer]) -> Vec<String> {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let mut made: Vec<String> = Vec::new();
    for layer in layers {
        let known = match layer {
            Layer::Made(name, _) => name.clone(),
            Layer::Light(name) => match name.as_str() {
                Layers::REST => "rest".to_owned(),
                Layers::ERROR => "light_error".to_owned(),
                name => format!("light_{}", name.chars().map(plain).collect::<String>()),
            },
        };
        let numbered = |n: usize| if n == 1 { known.clone() } else { format!("{known}_{n}") };
        let free = (1..).map(numbered).find(|name| !made.contains(name));
        made.extend(free);
    }
    made
}

/// Deals runs of values to the parts of a picture, channel by channel.
fn deal<'p, T>(
    channels: &'p mut [Vec<T>],
    run: usize,
    parts: &mut [Pixels<'p>],
    give: impl Fn(&mut Pixels<'p>, usize, &'p mut [T]),
) {
    for (i, channel) in channels.iter_mut().enumerate() {
        for (part, values) in parts.iter_mut().zip(channel.chunks_mut(run.max(1))) {
            give(part, i, values);
        }
    }
}
