//! `aa_error`: by which share of the pixel its coverage may be off.

use super::{Maker, Needs, Values};
use crate::image::Samples;

pub(super) struct Estimates;

impl Maker for Estimates {
    fn needs(&self) -> Needs {
        Needs { estimates: true, ..Needs::default() }
    }

    fn values(&self, pixels: usize) -> Vec<(String, Samples)> {
        vec![("aa_error".to_owned(), Samples::Float(vec![0.0; pixels]))]
    }

    fn estimates(&self, to: &mut Values<'_>, errors: &[f32]) {
        to.floats[0].copy_from_slice(errors);
    }
}
