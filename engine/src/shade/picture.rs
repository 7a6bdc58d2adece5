//! Colours from a flat picture: what was made of a picture by other means goes back onto its surfaces.

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use serde::de::Error as _;
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::io::{Read, Write};
use std::sync::Arc;

use crate::color::Color;
use crate::fragment::{Columns, Fragments, Shader};

/// Gives surfaces the colour that a picture has where they are seen: the pixel's own, so that a picture of
/// the same size comes out again wherever its alpha is what the surfaces cover. Depth and coverage stay.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureColors {
    width: u32,
    height: u32,
    /// Colours without alpha, row by row.
    colors: Arc<[Color]>,
}

impl PictureColors {
    /// From red, green, blue and alpha, associated, of every pixel, row by row. Where alpha is 0 the colour
    /// is taken as it is. `None` if there are no pixels, or not `width` times `height`.
    pub fn new(width: u32, height: u32, pixels: &[[f32; 4]]) -> Option<PictureColors> {
        let is_whole = pixels.len() as u64 == u64::from(width) * u64::from(height);
        let plain = |[r, g, b, a]: &[f32; 4]| {
            let a = if *a > 0.0 { *a } else { 1.0 };
            Color::new(r / a, g / a, b / a)
        };
        let colors = pixels.iter().map(plain).collect();
        (is_whole && !pixels.is_empty()).then_some(PictureColors { width, height, colors })
    }

    /// The colour at a point of the raster, given as shares of its width and height.
    fn at(&self, x: f64, y: f64) -> Color {
        let place = |share: f64, count: u32| {
            let place = (share * f64::from(count)).clamp(0.0, f64::from(count - 1));
            place as usize
        };
        self.colors[place(y, self.height) * self.width as usize + place(x, self.width)]
    }
}

#[typetag::serde(name = "RecolorFrom")]
impl Shader for PictureColors {
    fn reads(&self) -> Columns {
        // Depth is not read, but what is read differs from place to place as depth does.
        Columns::COLOR | Columns::DEPTH
    }

    fn shade(&self, fragments: &mut Fragments<'_>) {
        let raster = fragments.view.raster();
        let (width, height) = (f64::from(raster.width), f64::from(raster.height));
        for i in 0..fragments.len() {
            fragments.color[i] = self.at(fragments.x[i] / width, fragments.y[i] / height);
        }
    }
}

/// How it is saved.
#[derive(Serialize, Deserialize)]
struct Saved {
    width: u32,
    height: u32,
    /// Red, green and blue of every pixel as floats, packed by zlib, as text.
    colors: String,
}

impl Serialize for PictureColors {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut packer = ZlibEncoder::new(Vec::new(), Compression::fast());
        let floats = self.colors.iter().flat_map(|color| color.to_array());
        let bytes: Vec<u8> = floats.flat_map(f32::to_le_bytes).collect();
        let packed = packer.write_all(&bytes).and_then(|()| packer.finish());
        let colors = BASE64.encode(packed.map_err(S::Error::custom)?);
        Saved { width: self.width, height: self.height, colors }.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for PictureColors {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<PictureColors, D::Error> {
        let Saved { width, height, colors } = Saved::deserialize(deserializer)?;
        let count = u64::from(width) * u64::from(height);
        let packed = BASE64.decode(colors).map_err(D::Error::custom)?;
        let mut bytes = Vec::new();
        let mut unpacker =
            ZlibDecoder::new(&packed[..]).take(count.saturating_mul(12).saturating_add(1));
        unpacker.read_to_end(&mut bytes).map_err(D::Error::custom)?;
        if count == 0 || bytes.len() as u64 != count * 12 {
            return Err(D::Error::custom("a picture does not have the pixels that it says"));
        }
        let float = |bytes: &[u8]| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        let color = |bytes: &[u8]| Color::new(float(bytes), float(&bytes[4..]), float(&bytes[8..]));
        Ok(PictureColors { width, height, colors: bytes.chunks_exact(12).map(color).collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_comes_back_from_its_saved_form() {
        let pixels: Vec<[f32; 4]> = (0..6).map(|i| [i as f32 / 3.0, 0.1, 0.2, 0.5]).collect();
        let picture = PictureColors::new(3, 2, &pixels).unwrap();
        assert_eq!(picture.at(0.99, 0.99), Color::new(10.0 / 3.0, 0.2, 0.4));
        assert_eq!(picture.at(-1.0, 0.0), Color::new(0.0, 0.2, 0.4));
        let shader: Arc<dyn Shader> = Arc::new(picture.clone());
        let text = serde_json::to_string(&*shader).unwrap();
        let back: Arc<dyn Shader> = serde_json::from_str(&text).unwrap();
        assert_eq!(serde_json::to_string(&*back).unwrap(), text);
        let short = text.replace("\"width\":3", "\"width\":4");
        assert!(serde_json::from_str::<Box<dyn Shader>>(&short).is_err());
        assert!(PictureColors::new(3, 3, &pixels).is_none());
    }
}
