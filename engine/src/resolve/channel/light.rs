//! `light_NAME`, `rest` and `light_error`: what each light adds to the colour, what comes from none, and by how much
//! light that is found by samples may be off.

use super::{Maker, Names, Needs, Values, three};
use crate::fragment::{Fragments, LightLayers, Stage};
use crate::image::Samples;
use crate::span::SpanImage;

/// A layer of light.
pub(super) struct Light {
    /// The light.
    light: String,
    /// What its values are called.
    name: String,
}

/// The estimate of the error.
pub(super) fn error(names: &mut Names) -> Light {
    Light { light: LightLayers::ERROR.to_owned(), name: names.unique("light_error") }
}

/// The layers of all lights of an image.
pub(super) fn of(image: &SpanImage, names: &mut Names) -> Vec<Light> {
    let mut lights = Vec::new();
    image.sources().iter().for_each(|source| add(&source.stack, &mut lights));
    lights.sort();
    lights.dedup();
    lights.push(LightLayers::REST.to_owned());
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let layer = |light: String| {
        let name = match light.as_str() {
            LightLayers::REST => "rest".to_owned(),
            light => format!("light_{}", light.chars().map(plain).collect::<String>()),
        };
        Light { name: names.unique(&name), light }
    };
    lights.into_iter().map(layer).collect()
}

/// Adds the lights of a stack, and of what rays see from it.
fn add(stack: &[Stage], lights: &mut Vec<String>) {
    for stage in stack {
        let Stage::Shade(shading) = stage else { continue };
        lights.extend(shading.shader().layers());
        let members = shading.world().into_iter().flat_map(|world| world.members());
        members.filter(|member| member.is_beside).for_each(|member| add(&member.stack, lights));
    }
}

impl Maker for Light {
    fn needs(&self) -> Needs {
        Needs { shaded: true, lights: true, fragments: true, ..Needs::default() }
    }

    fn values(&self, pixels: usize) -> Vec<(String, Samples)> {
        three(&self.name, ["R", "G", "B"], pixels)
    }

    fn fragment(
        &self,
        to: &mut Values<'_>,
        pixel: usize,
        fragments: &Fragments<'_>,
        i: usize,
        weight: f32,
    ) {
        let layers = fragments.layers.as_ref();
        let Some(layer) = layers.and_then(|layers| layers.get(&self.light)) else { return };
        for (axis, value) in to.floats.iter_mut().zip(layer[i].to_array()) {
            axis[pixel] += value * weight;
        }
    }
}
