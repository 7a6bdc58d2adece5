//! `R`, `G`, `B`, `A`: the mean colour over the pixel, with associated alpha (\[N] eq. 2).

use std::ops::Range;

use super::{Maker, Needs, Values, three};
use crate::color::Color;
use crate::fragment::Fragments;
use crate::image::Samples;
use crate::span::image::Paint;

pub(super) struct Colors;

impl Colors {
    #[inline(always)]
    fn add(to: &mut Values<'_>, pixel: usize, color: Color, weight: f32) {
        let [r, g, b, a] = &mut to.floats[..] else { return };
        r[pixel] += color.r * weight;
        g[pixel] += color.g * weight;
        b[pixel] += color.b * weight;
        a[pixel] += weight;
    }
}

impl Maker for Colors {
    fn needs(&self) -> Needs {
        Needs { shaded: true, ..Needs::default() }
    }

    fn values(&self, pixels: usize) -> Vec<(String, Samples)> {
        let mut values = three("", ["R", "G", "B"], pixels);
        values.push(("A".to_owned(), Samples::Float(vec![0.0; pixels])));
        values
    }

    fn fragment(
        &self,
        to: &mut Values<'_>,
        pixel: usize,
        fragments: &Fragments<'_>,
        i: usize,
        weight: f32,
    ) {
        Colors::add(to, pixel, fragments.color[i], weight);
    }

    // With stored intensities: no shader runs.
    fn alike(&self, to: &mut Values<'_>, pixels: Range<usize>, paint: Paint, area: f32) {
        let weight = area * paint.alpha;
        pixels.for_each(|pixel| Colors::add(to, pixel, paint.color, weight));
    }
}
