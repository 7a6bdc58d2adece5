//! `P.X`, `P.Y`, `P.Z`: the position in the world, of the face that covers most of the pixel.

use super::{Maker, Most, Needs, Values, three};
use crate::image::Samples;

pub(super) struct Positions;

impl Maker for Positions {
    fn needs(&self) -> Needs {
        Needs { most: true, ..Needs::default() }
    }

    fn values(&self, pixels: usize) -> Vec<(String, Samples)> {
        three("P", ["X", "Y", "Z"], pixels)
    }

    fn most(&self, to: &mut Values<'_>, most: &mut Most<'_>) {
        for near in &most.nearest {
            let place = most.image.view().world_point(near.x, near.y, near.depth).to_array();
            for (axis, value) in to.floats.iter_mut().zip(place) {
                axis[near.pixel] = value as f32;
            }
        }
    }
}
