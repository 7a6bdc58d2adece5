//! Colours from a flat picture: what was made of a picture by other means goes back onto its surfaces.

use serde::de::Error as _;
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::sync::Arc;

use crate::color::Color;
use crate::error::{Error, Result};
use crate::fragment::{Around, Columns, Fragments, Hiding, LightLayers, Shader};
use crate::packed;

/// Gives surfaces the colour that a picture has where they are seen: the pixel's own, so that a picture of
/// the same size comes out again wherever its alpha is what the surfaces cover. Depth and coverage stay. In
/// mirrors, surfaces keep the colours that they have.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureColors {
    frame: PictureFrame,
    /// Colours without alpha of the part that is held, row by row.
    colors: Arc<[Color]>,
}

/// A picture's size in pixels, and the part of it that is held; elsewhere it is black.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PictureFrame {
    /// Width and height of the whole.
    pub size: (u32, u32),
    /// First column and row of the part.
    pub corner: (u32, u32),
    /// Columns and rows of the part.
    pub part: (u32, u32),
}

impl PictureFrame {
    /// The pixels of the part; `None` if the part is empty or not within the picture.
    fn count(&self) -> Option<u64> {
        let within = |corner: u32, part: u32, size: u32| {
            part > 0 && corner.checked_add(part).is_some_and(|end| end <= size)
        };
        let is_within = within(self.corner.0, self.part.0, self.size.0)
            && within(self.corner.1, self.part.1, self.size.1);
        is_within.then(|| u64::from(self.part.0) * u64::from(self.part.1))
    }
}

impl PictureColors {
    /// From red, green, blue and alpha, associated, of every pixel of the part that is held, row by row.
    /// Where alpha is 0 the colour is taken as it is.
    ///
    /// # Errors
    /// If there are no pixels, the part is not within the picture, or they are not as many as it has.
    pub fn new(
        frame: PictureFrame,
        pixels: impl Iterator<Item = [f32; 4]>,
    ) -> Result<PictureColors> {
        let plain = |[r, g, b, a]: [f32; 4]| {
            let a = if a > 0.0 { a } else { 1.0 };
            Color::new(r / a, g / a, b / a)
        };
        let colors: Arc<[Color]> = pixels.map(plain).collect();
        if frame.count() != Some(colors.len() as u64) {
            return Err(Error::invalid(format!(
                "{} colours for a picture of {frame:?}",
                colors.len()
            )));
        }
        Ok(PictureColors { frame, colors })
    }

    /// The colour at a point of the raster, given as shares of its width and height.
    fn at(&self, x: f64, y: f64) -> Color {
        let PictureFrame { size, corner, part } = self.frame;
        // The place in the part, if it is there.
        let place = |share: f64, size: u32, corner: u32, part: u32| {
            let last = f64::from(size - 1);
            let place = (share * f64::from(size)).clamp(0.0, last) as u32;
            place.checked_sub(corner).filter(|place| *place < part)
        };
        let column = place(x, size.0, corner.0, part.0);
        match column.zip(place(y, size.1, corner.1, part.1)) {
            Some((x, y)) => self.colors[y as usize * part.0 as usize + x as usize],
            None => Color::BLACK,
        }
    }
}

#[typetag::serde(name = "RecolorFrom")]
impl Shader for PictureColors {
    fn reads(&self) -> Columns {
        // Depth is not read, but what is read differs from place to place as depth does.
        Columns::COLOR | Columns::DEPTH
    }

    fn hiding(&self) -> Hiding {
        Hiding::Keeps
    }

    fn changes(&self) -> Columns {
        Columns::COLOR
    }

    fn shade(&self, fragments: &mut Fragments<'_>, _: &Around<'_>) {
        if fragments.sight.is_some() {
            // The picture does not say what mirrors show.
            return;
        }
        let raster = fragments.view.raster();
        let (width, height) = (f64::from(raster.width), f64::from(raster.height));
        for i in 0..fragments.len() {
            fragments.color[i] = self.at(fragments.x[i] / width, fragments.y[i] / height);
        }
        if let Some(layers) = &mut fragments.layers {
            layers.clear();
            let rest = layers.layer(LightLayers::REST, fragments.color.len());
            rest.copy_from_slice(&fragments.color);
        }
    }
}

/// How it is saved.
#[derive(Serialize, Deserialize)]
struct Saved {
    frame: PictureFrame,
    /// Red, green and blue of every pixel as floats, packed by zlib, as text.
    colors: String,
}

impl Serialize for PictureColors {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let colors = packed::pack(&self.colors).map_err(S::Error::custom)?;
        Saved { frame: self.frame, colors }.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for PictureColors {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<PictureColors, D::Error> {
        let Saved { frame, colors } = Saved::deserialize(deserializer)?;
        let count = frame.count().ok_or_else(|| D::Error::custom("a picture without pixels"))?;
        let colors = packed::unpack(&colors, count).map_err(D::Error::custom)?;
        Ok(PictureColors { frame, colors: colors.into() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_comes_back_from_its_saved_form() {
        let pixels = || (0..6).map(|i| [i as f32 / 3.0, 0.1, 0.2, 0.5]);
        // The right part of a picture four wide.
        let frame = PictureFrame { size: (4, 2), corner: (1, 0), part: (3, 2) };
        let picture = PictureColors::new(frame, pixels()).unwrap();
        assert_eq!(picture.at(0.99, 0.99), Color::new(10.0 / 3.0, 0.2, 0.4));
        assert_eq!(picture.at(0.3, -1.0), Color::new(0.0, 0.2, 0.4));
        assert_eq!(picture.at(0.2, 0.0), Color::BLACK);
        let shader: Arc<dyn Shader> = Arc::new(picture.clone());
        let text = serde_json::to_string(&*shader).unwrap();
        let back: Arc<dyn Shader> = serde_json::from_str(&text).unwrap();
        assert_eq!(serde_json::to_string(&*back).unwrap(), text);
        for wrong in ["[3,3]", "[0,2]", "[4294967295,2]"] {
            let text = text.replace("\"part\":[3,2]", &format!("\"part\":{wrong}"));
            assert!(serde_json::from_str::<Box<dyn Shader>>(&text).is_err());
        }
        let larger = PictureFrame { part: (3, 1), ..frame };
        assert!(PictureColors::new(larger, pixels()).is_err());
    }
}
