//! `N.X`, `N.Y`, `N.Z`: the unit normal in world axes, of the face that covers most of the pixel.

use super::{Maker, Most, Needs, Values, three};
use crate::fragment::{Columns, Fragments};
use crate::image::Samples;

pub(super) struct Normals;

impl Maker for Normals {
    fn needs(&self) -> Needs {
        Needs { most: true, normals: true, ..Needs::default() }
    }

    fn values(&self, pixels: usize) -> Vec<(String, Samples)> {
        three("N", ["X", "Y", "Z"], pixels)
    }

    fn most(&self, to: &mut Values<'_>, most: &mut Most<'_>) {
        let sources = most.image.sources();
        let view = most.image.view();
        let mut batches: Vec<(Fragments<'_>, Vec<usize>)> =
            sources.iter().map(|_| (Fragments::new(view), Vec::new())).collect();
        for near in &most.nearest {
            let (fragments, pixels) = &mut batches[near.source];
            fragments.push(near.ordinal, near.sees_front, near.x, near.y, near.depth);
            pixels.push(near.pixel);
        }
        for (source, (mut fragments, pixels)) in sources.iter().zip(batches) {
            source.fill(Columns::NORMAL, &mut fragments);
            for (pixel, normal) in pixels.into_iter().zip(fragments.normal) {
                for (axis, value) in to.floats.iter_mut().zip(normal.to_array()) {
                    axis[pixel] = value;
                }
            }
        }
    }
}
