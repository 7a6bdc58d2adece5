//! A picture and what is left of it at half, a quarter, and so on of its size.

use crate::color::{decode_srgb, encode_srgb};
use crate::image::texels::{Samples, Texels};
use std::sync::OnceLock;

/// What the samples of a picture mean.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub enum Meaning {
    /// A colour, sRGB where it is coded, and how much of what is behind it hides.
    Color,
    /// A colour that hides what is behind it where its alpha is not below this, and nothing elsewhere.
    CutOut(f32),
    /// Numbers as they are: normals, heights, shares.
    Numbers,
    /// A byte is an index, which is never mixed with another: of each of these four, how much of a texel has it.
    Indices([u8; 4]),
}

impl Meaning {
    /// Whether alpha weighs the other samples.
    fn is_color(self) -> bool {
        matches!(self, Meaning::Color | Meaning::CutOut(_))
    }

    /// Of each of its indices, whether a byte is it.
    fn is_index(self, byte: u8) -> [f32; 4] {
        match self {
            Meaning::Indices(four) => four.map(|index| f32::from(u8::from(index == byte))),
            _ => [0.0; 4],
        }
    }
}

/// A level of a pyramid.
#[derive(Debug)]
pub struct Level {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    texels: Stored,
    meaning: Meaning,
}

#[derive(Debug)]
enum Stored {
    /// As they are coded, alpha straight.
    Bytes(Vec<[u8; 4]>),
    /// Grey and opaque, as it is coded.
    Grey(Vec<u8>),
    /// Indices.
    Indices(Vec<u8>),
    /// Decoded; colours with associated alpha.
    Floats(Vec<[f32; 4]>),
}

/// By how a byte is coded, the number that it means.
fn decoded() -> &'static [f32; 256] {
    static TABLE: OnceLock<[f32; 256]> = OnceLock::new();
    TABLE.get_or_init(|| std::array::from_fn(|byte| decode_srgb(byte as f32 / 255.0)))
}

impl Level {
    /// Bytes held.
    pub fn bytes(&self) -> usize {
        match &self.texels {
            Stored::Bytes(texels) => size_of_val(&**texels),
            Stored::Grey(texels) | Stored::Indices(texels) => size_of_val(&**texels),
            Stored::Floats(texels) => size_of_val(&**texels),
        }
    }

    /// A texel: linear, colours with associated alpha.
    #[inline]
    pub fn texel(&self, x: u32, y: u32) -> [f32; 4] {
        let at = y as usize * self.width as usize + x as usize;
        match &self.texels {
            Stored::Floats(texels) => texels[at],
            Stored::Grey(texels) => {
                let v = texels[at];
                let share = f32::from(v) * (1.0 / 255.0);
                let v = if self.meaning.is_color() { decoded()[usize::from(v)] } else { share };
                [v, v, v, 1.0]
            }
            Stored::Indices(texels) => self.meaning.is_index(texels[at]),
            Stored::Bytes(texels) => {
                let [r, g, b, a] = texels[at];
                let share = |v: u8| f32::from(v) * (1.0 / 255.0);
                if !self.meaning.is_color() {
                    return [r, g, b, a].map(share);
                }
                let (table, alpha) = (decoded(), share(a));
                let [r, g, b] = [r, g, b].map(|v| table[usize::from(v)] * alpha);
                [r, g, b, alpha]
            }
        }
    }

    /// The index of a texel of a picture of indices.
    pub(super) fn index(&self, x: u32, y: u32) -> u8 {
        match &self.texels {
            Stored::Indices(texels) => texels[y as usize * self.width as usize + x as usize],
            _ => 0,
        }
    }

    /// The picture itself.
    fn first(picture: Texels, meaning: Meaning) -> Level {
        let (width, height) = picture.size;
        let texels = match picture.samples {
            Samples::Bytes(texels) if matches!(meaning, Meaning::Indices(_)) => {
                Stored::Indices(texels.into_iter().map(|[index, ..]| index).collect())
            }
            Samples::Bytes(texels) => Stored::Bytes(texels),
            Samples::Linear(texels) => Stored::Floats(texels),
            Samples::Words(texels) if meaning.is_color() => {
                let linear = |[r, g, b, a]: [f32; 4]| {
                    let [r, g, b] = [r, g, b].map(|v| decode_srgb(v) * a);
                    [r, g, b, a]
                };
                Stored::Floats(texels.into_iter().map(linear).collect())
            }
            Samples::Words(texels) => Stored::Floats(texels),
        };
        Level { width, height, texels, meaning }
    }

    /// The same with bytes for numbers, if the picture has no more.
    fn stored(self, as_bytes: bool) -> Level {
        let texels = match &self.texels {
            Stored::Floats(texels) if as_bytes => texels,
            _ => return self.grey(),
        };
        let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
        let coded = |[r, g, b, a]: &[f32; 4]| {
            if !self.meaning.is_color() {
                return [*r, *g, *b, *a].map(byte);
            }
            let straight = if *a > 0.0 { 1.0 / a } else { 0.0 };
            let [r, g, b] = [r, g, b].map(|v| byte(encode_srgb((v * straight).clamp(0.0, 1.0))));
            [r, g, b, byte(*a)]
        };
        Level { texels: Stored::Bytes(texels.iter().map(coded).collect()), ..self }.grey()
    }

    /// The same with one byte for a texel, if all are grey and opaque.
    fn grey(self) -> Level {
        match &self.texels {
            Stored::Bytes(texels)
                if texels.iter().all(|[r, g, b, a]| r == g && g == b && *a == 255) =>
            {
                let texels = Stored::Grey(texels.iter().map(|[v, ..]| *v).collect());
                Level { texels, ..self }
            }
            _ => self,
        }
    }

    /// What is left at half of the size: each texel is the mean of what it covers.
    fn half(&self, is_first: bool) -> Level {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let (columns, rows) = (shares(self.width, width), shares(self.height, height));
        let mut texels = Vec::with_capacity(width as usize * height as usize);
        for (top, down) in &rows {
            for (left, right) in &columns {
                let mut sum = [0.0f32; 4];
                for (j, by_row) in down.iter().enumerate() {
                    for (i, by_column) in right.iter().enumerate() {
                        let texel = self.texel(left + i as u32, top + j as u32);
                        let texel = if is_first { self.cut(texel) } else { texel };
                        let weight = by_row * by_column;
                        sum.iter_mut().zip(texel).for_each(|(sum, v)| *sum += v * weight);
                    }
                }
                texels.push(sum);
            }
        }
        Level { width, height, texels: Stored::Floats(texels), meaning: self.meaning }
    }

    /// A texel of a picture that is cut out: it is there, or not.
    fn cut(&self, [r, g, b, a]: [f32; 4]) -> [f32; 4] {
        match self.meaning {
            Meaning::CutOut(from) if a >= from && a > 0.0 => [r / a, g / a, b / a, 1.0],
            Meaning::CutOut(_) => [0.0; 4],
            _ => [r, g, b, a],
        }
    }
}

/// For each of `few` texels, the first of the `many` that it covers, and how much of it each of them is.
fn shares(many: u32, few: u32) -> Vec<(u32, Vec<f32>)> {
    let (n, m) = (u64::from(many), u64::from(few));
    // In units of 1 / few of a texel of the many.
    let share = |k: u64| {
        let (from, to) = (k * n, (k + 1) * n);
        let first = from / m;
        let part = |i: u64| (to.min((i + 1) * m) - from.max(i * m)) as f32 / n as f32;
        (first as u32, (first..to.div_ceil(m)).map(part).collect())
    };
    (0..m).map(share).collect()
}

/// All levels of a picture, down to one texel.
pub fn pyramid(picture: Texels, meaning: Meaning) -> Vec<Level> {
    let first = Level::first(picture, meaning);
    let as_bytes = !matches!(first.texels, Stored::Floats(_));
    let mut levels = vec![first.grey()];
    // Levels are made of what is exact, and rounded only where they are stored.
    let mut exact: Option<Level> = None;
    loop {
        let last = exact.as_ref().unwrap_or(&levels[0]);
        if (last.width, last.height) == (1, 1) {
            break;
        }
        let next = last.half(exact.is_none());
        if let Some(last) = exact.replace(next) {
            levels.push(last.stored(as_bytes));
        }
    }
    levels.extend(exact.map(|last| last.stored(as_bytes)));
    levels
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(level: &Level) -> [f32; 4] {
        let mut sum = [0.0f64; 4];
        for y in 0..level.height {
            for x in 0..level.width {
                let texel = level.texel(x, y);
                sum.iter_mut().zip(texel).for_each(|(sum, v)| *sum += f64::from(v));
            }
        }
        sum.map(|v| (v / f64::from(level.width * level.height)) as f32)
    }

    fn picture(width: u32, height: u32) -> Vec<[f32; 4]> {
        let value = |at: u32| {
            let [r, g, b, a] = [7u32, 11, 13, 17].map(|k| (at * at * k % 101) as f32 / 100.0);
            [r * a, g * a, b * a, a]
        };
        (0..width * height).map(value).collect()
    }

    #[test]
    fn every_level_has_the_mean_of_the_picture() {
        for size in [(1, 1), (2, 1), (1, 7), (8, 8), (13, 5), (31, 64), (100, 3)] {
            let texels = picture(size.0, size.1);
            let linear = Texels { size, samples: Samples::Linear(texels.clone()) };
            let code = |[r, g, b, a]: &[f32; 4]| {
                let straight = |v: &f32| encode_srgb(if *a > 0.0 { v / a } else { 0.0 });
                [straight(r), straight(g), straight(b), *a].map(|v| (v * 255.0).round() as u8)
            };
            let bytes = Samples::Bytes(texels.iter().map(code).collect());
            for (picture, within) in [(linear, 1e-5), (Texels { size, samples: bytes }, 3e-3)] {
                for meaning in [Meaning::Color, Meaning::Numbers] {
                    let levels = pyramid(picture.clone(), meaning);
                    let most = size.0.max(size.1);
                    assert_eq!(levels.len() as u32, 32 - most.leading_zeros(), "{size:?}");
                    let whole = mean(&levels[0]);
                    for level in &levels {
                        let off = mean(level).into_iter().zip(whole).map(|(a, b)| (a - b).abs());
                        let off = off.fold(0.0, f32::max);
                        assert!(off < within, "{size:?} {meaning:?} {}: {off}", level.width);
                    }
                }
            }
        }
    }

    #[test]
    fn grey_takes_a_byte_and_is_what_it_was() {
        let size = (8, 4);
        let texels: Vec<[u8; 4]> = (0..32u8).map(|i| [i * 7, i * 7, i * 7, 255]).collect();
        for meaning in [Meaning::Color, Meaning::Numbers] {
            let of = |texels: Vec<[u8; 4]>| {
                pyramid(Texels { size, samples: Samples::Bytes(texels) }, meaning)
            };
            let mut beside = texels.clone();
            beside[31] = [217, 217, 217, 254];
            let (grey, plain) = (of(texels.clone()), of(beside));
            assert_eq!((grey[0].bytes(), grey[1].bytes(), plain[0].bytes()), (32, 8, 128));
            for (x, y) in [(0, 0), (3, 1), (6, 3)] {
                assert_eq!(grey[0].texel(x, y), plain[0].texel(x, y));
            }
            assert_eq!(grey[1].texel(1, 1), plain[1].texel(1, 1));
        }
    }

    #[test]
    fn indices_take_a_byte_and_are_never_mixed() {
        let size = (2, 2);
        let samples = Samples::Bytes([7, 9, 9, 200].map(|index| [index; 4]).to_vec());
        let levels = pyramid(Texels { size, samples }, Meaning::Indices([9, 7, 8, 8]));
        assert_eq!((levels[0].bytes(), levels[0].index(1, 1)), (4, 200));
        assert_eq!(levels[0].texel(1, 0), [1.0, 0.0, 0.0, 0.0]);
        let [nines, sevens, eights, _] = levels[1].texel(0, 0).map(|v| (v * 255.0).round());
        assert_eq!([nines, sevens, eights], [128.0, 64.0, 0.0]);
    }

    #[test]
    fn a_cut_out_keeps_its_area() {
        let size = (16, 16);
        let texels: Vec<[f32; 4]> = picture(16, 16);
        let there = texels.iter().filter(|texel| texel[3] >= 0.4).count() as f32 / 256.0;
        let picture = Texels { size, samples: Samples::Linear(texels) };
        for level in &pyramid(picture, Meaning::CutOut(0.4))[1..] {
            assert!((mean(level)[3] - there).abs() < 1e-5);
        }
    }
}
