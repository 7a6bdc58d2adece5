use super::{straight, with_pixels};
use crate::color::Color;
use crate::error::Result;
use crate::image::Image;
use crate::math;

/// Changes of colour, in this order: times 2 ^ `exposure` and `multiply`, plus `add`, to the power 1 / `gamma`,
/// towards grey or away from it by `saturation`. They are done to the colour itself, not to what alpha left of
/// it.
#[derive(Clone, Copy, Debug)]
pub struct Grade {
    /// Stops: 1 makes it twice as bright.
    pub exposure: f32,
    /// Factor of each component.
    pub multiply: Color,
    /// What is added to each.
    pub add: Color,
    /// Above 1, what is darker than 1 becomes brighter. Above 0.
    pub gamma: Color,
    /// 0 makes grey, 1 changes nothing.
    pub saturation: f32,
}

impl Grade {
    /// The picture, graded.
    ///
    /// # Errors
    /// None.
    pub fn apply(&self, image: &Image) -> Result<Image> {
        let factor = self.multiply * math::powf(2.0, self.exposure);
        let change = |pixel: [f32; 4]| {
            let [r, g, b, a] = straight(pixel);
            let lit = Color::new(r, g, b) * factor + self.add;
            let bent = |v: f32, gamma: f32| {
                let power = math::powf(v.abs(), 1.0 / gamma).copysign(v);
                if gamma == 1.0 { v } else { power }
            };
            let Color { r, g, b } = self.gamma;
            let bent = Color::new(bent(lit.r, r), bent(lit.g, g), bent(lit.b, b));
            let done = Color::grey(bent.luminance()).mix(bent, self.saturation) * a;
            [done.r, done.g, done.b, a]
        };
        with_pixels(image, image.pixels().map(change))
    }
}
