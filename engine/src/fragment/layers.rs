//! What a colour is the sum of.

use crate::color::Color;

/// Colours by what they come from: the lights by their names, and [`LightLayers::REST`] for all else. Each has
/// a colour for every fragment, and their sum, without [`LightLayers::ERROR`], is the fragments' colour.
///
/// A shader that only weakens colour weakens all layers alike; what it adds itself goes to the rest. One
/// that replaces the colour leaves nothing but the rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightLayers(Vec<(String, Vec<Color>)>);

impl LightLayers {
    /// The name of what comes from no light: glow, fog, surfaces that are not lit. No light has it.
    pub const REST: &'static str = "";

    /// The name of a layer that is no part of the sum: by how much the others may be off together, where
    /// light was found by samples. It is weakened and mirrored as they are.
    pub const ERROR: &'static str = "\u{0}";

    /// The layers by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &[Color])> {
        self.0.iter().map(|(name, colors)| (name.as_str(), &colors[..]))
    }

    /// The layer of a name, if there is one.
    pub fn get(&self, name: &str) -> Option<&[Color]> {
        self.iter().find(|(known, _)| *known == name).map(|(_, colors)| colors)
    }

    /// The layer of a name, black at first, of so many fragments.
    pub fn layer(&mut self, name: &str, count: usize) -> &mut [Color] {
        let known = self.0.iter().position(|(known, _)| known == name);
        let at = known.unwrap_or_else(|| {
            self.0.push((name.to_owned(), vec![Color::BLACK; count]));
            self.0.len() - 1
        });
        &mut self.0[at].1
    }

    /// Takes all layers away.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Changes all layers of each fragment.
    pub fn map(&mut self, change: impl Fn(usize, Color) -> Color) {
        for (_, colors) in &mut self.0 {
            colors.iter_mut().enumerate().for_each(|(i, color)| *color = change(i, *color));
        }
    }
}
