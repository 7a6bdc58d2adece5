//! Resolve: from spans to pixels, at any size, without solving visibility again.
//!
//! 1. *Coverage* ([`coverage`]): the covers of every pixel, by an integration rule ([`rule`]).
//! 2. *Intensity*: faces whose shading is the same all over are shaded once; this is [N]'s stored
//!    intensity, a memo of the image, which a new light replaces without touching spans.
//! 3. *Fragments*: covers of other faces are shaded one by one, in batches ([`shade`](self)).
//! 4. Colours are added up, weighted by coverage ([N] eq. 2).

mod boundary;
pub mod coverage;
mod intensity;
pub mod rule;
mod stream;

pub use coverage::{Cover, Coverage};
pub use rule::{Framing, Rule, Vertical, Weighting};

use rayon::prelude::*;
use std::collections::BTreeSet;

use crate::error::{Error, Result};
use crate::image::{Image, Samples, Window};
use crate::span::SpanImage;
use stream::{Pixels, Stream};

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
}

/// Resolves an image into a picture with the given channels. Colour is the mean over the pixel; all
/// other channels are those of the face that covers most of it, at the middle of what it covers.
///
/// # Errors
/// If the image does not have the rule's line plan or not all rows that the framing needs.
pub fn resolve(
    image: &SpanImage,
    rule: Rule,
    framing: &Framing,
    channels: &BTreeSet<Channel>,
) -> Result<Image> {
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
    let window = Window {
        x: framing.columns.start,
        y: framing.rows.start,
        width: framing.columns.len() as u32,
        height: framing.rows.len() as u32,
    };
    let intensities = intensity::of(image);
    let bands = window.height.div_ceil(BAND);
    let parts: Vec<Pixels> = (0..bands)
        .into_par_iter()
        .map_init(
            || Stream::new(image, framing, intensities, channels, Coverage::new(image, rule, framing)),
            |stream, band| {
                let first = framing.rows.start + band * BAND;
                stream.rows(first..framing.rows.end.min(first + BAND))
            },
        )
        .collect();
    let size = Framing::size(raster, framing.scale)?;
    let mut picture = Image::new((size.width, size.height), window);
    let mut join = |name: &str, pick: &dyn Fn(&Pixels) -> &[f32]| {
        let values = parts.iter().flat_map(|part| pick(part).iter().copied()).collect();
        picture.insert(name, Samples::Float(values))
    };
    for channel in channels {
        let names: &[&str] = match channel {
            Channel::Color => &["R", "G", "B", "A"],
            Channel::Z => &["Z"],
            Channel::N => &["N.X", "N.Y", "N.Z"],
            Channel::P => &["P.X", "P.Y", "P.Z"],
            Channel::Id => continue,
        };
        for (i, name) in names.iter().enumerate() {
            join(name, &|part| match channel {
                Channel::Color => &part.color[i],
                Channel::Z => &part.z,
                Channel::N => &part.normal[i],
                _ => &part.position[i],
            })?;
        }
    }
    if channels.contains(&Channel::Id) {
        let ids = parts.iter().flat_map(|part| part.id.iter().copied()).collect();
        picture.insert("id", Samples::Id(ids))?;
        picture.names = parts.iter().flat_map(|part| part.names.clone()).collect();
    }
    Ok(picture)
}
