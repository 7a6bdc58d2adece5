//! Colours: scene-linear Rec. 709 primaries, 32-bit float. sRGB appears only at 8- and 16-bit files
//! and where a person types a colour as `#rrggbb`.

mod primaries;

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::ops::{Add, Mul};
use std::sync::LazyLock;

pub use primaries::{D50, Primaries, REC_709, xyz_to_rec_709};

use crate::math;

/// A scene-linear colour with Rec. 709 primaries. Components may exceed 1 and, after filtering with
/// negative lobes, fall below 0.
///
/// In files: `"#c8d2dc"` and `"#cde"` are sRGB; `(0.5, 0.5, 0.5)` is linear; a single number is a
/// linear grey.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Color {
    /// Red.
    pub r: f32,
    /// Green.
    pub g: f32,
    /// Blue.
    pub b: f32,
}

impl Color {
    /// No light.
    pub const BLACK: Color = Color::grey(0.0);
    /// A perfect diffuse reflector.
    pub const WHITE: Color = Color::grey(1.0);

    /// A colour from linear components.
    pub const fn new(r: f32, g: f32, b: f32) -> Color {
        Color { r, g, b }
    }

    /// A linear grey.
    pub const fn grey(v: f32) -> Color {
        Color { r: v, g: v, b: v }
    }

    /// A colour from three sRGB bytes.
    pub fn from_srgb8(bytes: [u8; 3]) -> Color {
        let [r, g, b] = bytes.map(|v| decode_srgb(f32::from(v) / 255.0));
        Color { r, g, b }
    }

    /// The three components in order.
    pub fn to_array(self) -> [f32; 3] {
        [self.r, self.g, self.b]
    }

    /// A mixture: `self` at 0, `other` at 1.
    pub fn mix(self, other: Color, t: f32) -> Color {
        self * (1.0 - t) + other * t
    }

    /// How bright it is: the Y of its primaries, of which white has 1.
    pub fn luminance(self) -> f32 {
        0.2126 * self.r + 0.7152 * self.g + 0.0722 * self.b
    }

    /// The greatest component.
    pub fn greatest(self) -> f32 {
        self.r.max(self.g).max(self.b)
    }

    /// Whether every component is a finite number.
    pub fn is_finite(self) -> bool {
        self.to_array().iter().all(|v| v.is_finite())
    }

    fn parse(text: &str) -> Option<Color> {
        let digits = text.strip_prefix('#')?;
        if !digits.is_ascii() {
            return None;
        }
        let byte = |s: &str| u8::from_str_radix(s, 16).ok();
        match digits.len() {
            6 => Some(Color::from_srgb8([
                byte(&digits[0..2])?,
                byte(&digits[2..4])?,
                byte(&digits[4..6])?,
            ])),
            3 => Some(Color::from_srgb8([
                byte(&digits[0..1])? * 17,
                byte(&digits[1..2])? * 17,
                byte(&digits[2..3])? * 17,
            ])),
            _ => None,
        }
    }
}

impl Add for Color {
    type Output = Color;
    fn add(self, o: Color) -> Color {
        Color::new(self.r + o.r, self.g + o.g, self.b + o.b)
    }
}

impl Mul<f32> for Color {
    type Output = Color;
    fn mul(self, k: f32) -> Color {
        Color::new(self.r * k, self.g * k, self.b * k)
    }
}

impl Mul for Color {
    type Output = Color;
    fn mul(self, o: Color) -> Color {
        Color::new(self.r * o.r, self.g * o.g, self.b * o.b)
    }
}

impl Serialize for Color {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (self.r, self.g, self.b).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Color {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Color, D::Error> {
        if deserializer.is_human_readable() {
            deserializer.deserialize_any(ColorVisitor)
        } else {
            deserializer.deserialize_tuple(3, ColorVisitor)
        }
    }
}

struct ColorVisitor;

impl<'de> de::Visitor<'de> for ColorVisitor {
    type Value = Color;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a colour such as \"#c8d2dc\" (sRGB) or (0.5, 0.4, 0.3) (linear)")
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Color, E> {
        Color::parse(text).ok_or_else(|| E::invalid_value(de::Unexpected::Str(text), &self))
    }

    fn visit_f64<E: de::Error>(self, v: f64) -> Result<Color, E> {
        Ok(Color::grey(v as f32))
    }

    fn visit_i64<E: de::Error>(self, v: i64) -> Result<Color, E> {
        Ok(Color::grey(v as f32))
    }

    fn visit_u64<E: de::Error>(self, v: u64) -> Result<Color, E> {
        Ok(Color::grey(v as f32))
    }

    fn visit_seq<A: de::SeqAccess<'de>>(self, mut seq: A) -> Result<Color, A::Error> {
        let mut next =
            |i| seq.next_element::<f32>()?.ok_or_else(|| de::Error::invalid_length(i, &self));
        let color = Color::new(next(0)?, next(1)?, next(2)?);
        match seq.next_element::<f32>()? {
            None => Ok(color),
            Some(_) => Err(de::Error::invalid_length(4, &self)),
        }
    }
}

impl JsonSchema for Color {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Color".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "title": "Color", "type": "array" })
    }
}

/// The sRGB transfer function: a linear value in [0, 1] to its encoded value. Values outside are
/// clamped; NaN gives 0.
pub fn encode_srgb(linear: f32) -> f32 {
    let v = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * math::powf(v, 1.0 / 2.4) - 0.055 }
}

/// [`encode_srgb`] to the nearest of 256 codes, by a table of where they begin.
pub fn srgb_byte(linear: f32) -> u8 {
    static BEGINS: LazyLock<[f32; 255]> = LazyLock::new(|| {
        let code = |bits: u32| (encode_srgb(f32::from_bits(bits)) * 255.0).round() as usize;
        std::array::from_fn(|below| {
            // The smallest number whose code is more; floats of one sign are in the order of their bits.
            let (mut low, mut high) = (0, 1f32.to_bits());
            while low < high {
                let middle = (low + high) / 2;
                if code(middle) > below { high = middle } else { low = middle + 1 }
            }
            f32::from_bits(low)
        })
    });
    // NaN is not above any, and gives 0 as the formula does.
    BEGINS.partition_point(|begin| *begin <= linear) as u8
}

/// The inverse of [`encode_srgb`], on [0, 1].
pub fn decode_srgb(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { math::powf((encoded + 0.055) / 1.055, 2.4) }
}

/// What a named value is: one number, or three.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
pub enum ValueKind {
    /// One number.
    Number,
    /// Three: a colour, or a vector.
    Color,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_by_the_table_are_bytes_by_the_formula() {
        let formula = |v: f32| (encode_srgb(v) * 255.0).round() as u8;
        let steps = (0..=1f32.to_bits()).step_by(997).map(f32::from_bits);
        let begins = (0..255u8).flat_map(|code| {
            let bits = decode_srgb((f32::from(code) + 0.5) / 255.0).to_bits();
            (bits - 200..bits + 200).map(f32::from_bits)
        });
        for v in steps.chain(begins).chain([-1.0, 2.0, f32::INFINITY, f32::NAN, -0.0]) {
            assert_eq!(srgb_byte(v), formula(v), "{v:e}");
        }
    }

    #[test]
    fn srgb_bytes_survive_the_round_trip() {
        for v in 0..=255u8 {
            let linear = decode_srgb(f32::from(v) / 255.0);
            assert_eq!((encode_srgb(linear) * 255.0).round() as u8, v);
        }
    }

    #[test]
    fn colours_parse_as_typed() {
        assert_eq!(Color::parse("#fff"), Some(Color::WHITE));
        assert_eq!(Color::parse("#000000"), Some(Color::BLACK));
        assert_eq!(Color::parse("#12345"), None);
        assert_eq!(Color::parse("#é12"), None);
        assert_eq!(Color::parse("red"), None);
    }
}
