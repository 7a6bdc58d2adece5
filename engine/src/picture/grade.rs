use super::{Lights, NAMES, finite, straight, with_pixels};
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
        // What the power makes of a colour.
        let bent = |lit: Color| {
            let bent = |v: f32, gamma: f32| {
                let power = math::powf(v.abs(), 1.0 / gamma).copysign(v);
                if gamma == 1.0 { v } else { finite(power) }
            };
            let Color { r, g, b } = self.gamma;
            Color::new(bent(lit.r, r), bent(lit.g, g), bent(lit.b, b))
        };
        let mixed = |v: Color| Color::grey(v.luminance()).mix(v, self.saturation);
        let lit = |pixel: [f32; 4]| {
            let [r, g, b, _] = straight(pixel);
            let lit = Color::new(r, g, b) * factor + self.add;
            Color::new(finite(lit.r), finite(lit.g), finite(lit.b))
        };
        let change = |pixel: [f32; 4]| {
            // Alpha goes out before the change and in again after it, or edges would be graded as
            // if they were darker.
            let done = mixed(bent(lit(pixel))) * pixel[3];
            [done.r, done.g, done.b, pixel[3]]
        };
        let mut graded = with_pixels(image, image.pixels().map(change))?;
        // What is linear is done to each layer of light, what is not to all by the share by which it changes their sum.
        let layers = Lights::of(image);
        if !layers.names.is_empty() {
            let shares: Vec<Color> = image
                .pixels()
                .map(|pixel| {
                    let lit = lit(pixel);
                    let bent = bent(lit);
                    let share =
                        |new: f32, old: f32| if old == 0.0 { 1.0 } else { finite(new / old) };
                    Color::new(share(bent.r, lit.r), share(bent.g, lit.g), share(bent.b, lit.b))
                })
                .collect();
            for name in &layers.names {
                let layer = Lights::layer(image, name).into_iter().zip(&shares);
                let one = |([r, g, b], share): ([f32; 3], &Color)| {
                    mixed(Color::new(r, g, b) * factor * *share).to_array()
                };
                Lights::put(&mut graded, name, &layer.map(one).collect::<Vec<_>>())?;
            }
            // What is added comes from no light.
            let color = NAMES.map(|name| graded.float(name).unwrap_or_default().to_vec());
            layers.close(&mut graded, &color)?;
        }
        Ok(graded)
    }
}
