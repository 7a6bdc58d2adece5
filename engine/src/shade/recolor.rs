//! Colour correction by fragment, before resolve: no fringe where an object ends.

use serde::{Deserialize, Serialize};

use crate::color::Color;
use crate::fragment::{Around, Columns, Fragments, Hiding, LightLayers, Shader};

/// Changes colours: times `multiply`, plus `add`, towards grey or away from it by `saturation`.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Recolor {
    /// Factor of each component.
    pub multiply: Color,
    /// What is added to each, after that.
    pub add: Color,
    /// 0 makes grey, 1 changes nothing.
    pub saturation: f32,
}

#[typetag::serde]
impl Shader for Recolor {
    fn reads(&self) -> Columns {
        Columns::COLOR
    }

    fn hiding(&self) -> Hiding {
        Hiding::Keeps
    }

    fn changes(&self) -> Columns {
        Columns::COLOR
    }

    fn shade(&self, fragments: &mut Fragments<'_>, _: &Around<'_>) {
        let change = |color: Color, add: Color| {
            let bright = color * self.multiply + add;
            // Luminance of Rec. 709 primaries.
            let grey = bright.luminance();
            Color::grey(grey).mix(bright, self.saturation)
        };
        fragments.color.iter_mut().for_each(|color| *color = change(*color, self.add));
        if let Some(layers) = &mut fragments.layers {
            layers.map(|_, color| change(color, Color::BLACK));
            let added = change(Color::BLACK, self.add);
            let rest = layers.layer(LightLayers::REST, fragments.color.len());
            rest.iter_mut().for_each(|rest| *rest = *rest + added);
        }
    }
}
