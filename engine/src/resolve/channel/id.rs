//! `id`: the object of the face that covers most of the pixel, as a hash of its name.

use super::{Maker, Most, Needs, Values};
use crate::image::Samples;

pub(super) struct Ids;

impl Maker for Ids {
    fn needs(&self) -> Needs {
        Needs { most: true, ..Needs::default() }
    }

    fn values(&self, pixels: usize) -> Vec<(String, Samples)> {
        vec![("id".to_owned(), Samples::Id(vec![0; pixels]))]
    }

    fn most(&self, to: &mut Values<'_>, most: &mut Most<'_>) {
        for at in 0..most.nearest.len() {
            let near = &most.nearest[at];
            let (pixel, source, ordinal) = (near.pixel, near.source, near.ordinal);
            to.ids[0][pixel] = most.object(source, ordinal);
        }
    }
}
