//! `Z`: the distance along the view axis in metres, of the face that covers most of the pixel.

use super::{Maker, Most, Needs, Values};
use crate::fragment::FAR;
use crate::image::Samples;

pub(super) struct Distances;

impl Maker for Distances {
    fn needs(&self) -> Needs {
        Needs { most: true, ..Needs::default() }
    }

    fn values(&self, pixels: usize) -> Vec<(String, Samples)> {
        vec![("Z".to_owned(), Samples::Float(vec![0.0; pixels]))]
    }

    fn most(&self, to: &mut Values<'_>, most: &mut Most<'_>) {
        let z = &mut *to.floats[0];
        most.empty.iter().for_each(|pixel| z[*pixel] = f32::INFINITY);
        for near in &most.nearest {
            // A backdrop without a distance of its own is background.
            let distance = most.image.view().distance(near.depth);
            let surfaces = &most.image.sources()[near.source].surfaces;
            let is_beyond = distance > 0.999 * FAR && surfaces.beyond().is_some();
            z[near.pixel] = if is_beyond { f32::INFINITY } else { distance as f32 };
        }
    }
}
