//! Channels that programs made of fragments, resolved as the colour is.

use super::{Maker, Names, Needs, Values, three};
use crate::color::ValueKind;
use crate::fragment::Fragments;
use crate::image::Samples;
use crate::span::SpanImage;

/// A channel of a program.
pub(super) struct Made {
    /// What the program calls it.
    channel: String,
    /// What its values are called.
    name: String,
    kind: ValueKind,
}

/// The channels that programs make of an image's fragments.
pub(super) fn of(image: &SpanImage, names: &mut Names) -> Vec<Made> {
    let made = image.made_channels().into_iter();
    made.map(|(channel, kind)| Made { name: names.unique(&channel), channel, kind }).collect()
}

impl Maker for Made {
    fn needs(&self) -> Needs {
        Needs { shaded: true, fragments: true, ..Needs::default() }
    }

    fn values(&self, pixels: usize) -> Vec<(String, Samples)> {
        match self.kind {
            ValueKind::Number => vec![(self.name.clone(), Samples::Float(vec![0.0; pixels]))],
            ValueKind::Color => three(&self.name, ["R", "G", "B"], pixels),
        }
    }

    fn fragment(
        &self,
        to: &mut Values<'_>,
        pixel: usize,
        fragments: &Fragments<'_>,
        i: usize,
        weight: f32,
    ) {
        let Some(values) = fragments.channels.get(&self.channel) else { return };
        // Of a number, the first of three that are alike.
        for (axis, value) in to.floats.iter_mut().zip(values[i].to_array()) {
            axis[pixel] += value * weight;
        }
    }
}
