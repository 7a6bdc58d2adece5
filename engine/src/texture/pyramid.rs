//! A picture and what is left of it at half, a quarter, and so on of its size.

use std::collections::VecDeque;
use std::sync::Arc;

use crate::color::{encode_srgb, srgb_byte};
use crate::image::texels::{Samples, Texels};
use crate::image::{Coded, Codes, Coding, Layout};

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
    /// As they are coded.
    Coded(Arc<Coded>),
    /// Indices: the first samples of what is coded.
    Indices(Arc<Coded>),
    /// Decoded; colours with associated alpha.
    Floats(Vec<[f32; 4]>),
}

impl Level {
    /// Bytes held.
    pub fn bytes(&self) -> usize {
        match &self.texels {
            Stored::Coded(coded) | Stored::Indices(coded) => coded.bytes(),
            Stored::Floats(texels) => size_of_val(&**texels),
        }
    }

    /// A texel: linear, colours with associated alpha.
    #[inline]
    pub fn texel(&self, x: u32, y: u32) -> [f32; 4] {
        let at = y as usize * self.width as usize + x as usize;
        match &self.texels {
            Stored::Floats(texels) => texels[at],
            Stored::Coded(coded) if self.meaning.is_color() => coded.linear(at),
            Stored::Coded(coded) => coded.numbers(at),
            Stored::Indices(coded) => self.meaning.is_index(coded.index(at) as u8),
        }
    }

    /// The index of a texel of a picture of indices.
    pub(super) fn index(&self, x: u32, y: u32) -> u8 {
        match &self.texels {
            Stored::Indices(coded) => {
                coded.index(y as usize * self.width as usize + x as usize) as u8
            }
            _ => 0,
        }
    }

    /// The picture itself.
    fn first(picture: Texels, meaning: Meaning) -> Level {
        let (width, height) = picture.size;
        let texels = match picture.samples {
            Samples::Linear(texels) => Stored::Floats(texels),
            Samples::Coded(coded) if matches!(meaning, Meaning::Indices(_)) => {
                Stored::Indices(coded)
            }
            Samples::Coded(coded) => Stored::Coded(coded.greyed().map_or(coded, Arc::new)),
        };
        Level { width, height, texels, meaning }
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
        // Whole numbers: which texels are met is decided without rounding.
        let (from, to) = (k * n, (k + 1) * n);
        let first = from / m;
        let part = |i: u64| (to.min((i + 1) * m) - from.max(i * m)) as f32 / n as f32;
        (first as u32, (first..to.div_ceil(m)).map(part).collect())
    };
    (0..m).map(share).collect()
}

/// How the texels of smaller levels are stored: not finer than those of the picture.
enum Coder {
    Bytes(Vec<u8>, Layout),
    Words(Vec<u16>, Layout),
    Floats(Vec<[f32; 4]>),
}

impl Coder {
    /// For the smaller levels of a picture.
    fn new(first: &Level) -> Coder {
        match &first.texels {
            Stored::Floats(_) => Coder::Floats(Vec::new()),
            Stored::Indices(_) => Coder::Bytes(Vec::new(), Layout::Rgba),
            // What lies beyond the colours of Rec. 709 would be lost.
            Stored::Coded(coded) if first.meaning.is_color() && !coded.coding.is_rec_709() => {
                Coder::Floats(Vec::new())
            }
            Stored::Coded(coded) => {
                let layout = match &coded.layout {
                    Layout::Palette(_) if coded.layout.has_alpha() => Layout::Rgba,
                    Layout::Palette(_) => Layout::Rgb,
                    other => other.clone(),
                };
                match &coded.codes {
                    Codes::Bytes(_) => Coder::Bytes(Vec::new(), layout),
                    Codes::Words(_) => Coder::Words(Vec::new(), layout),
                }
            }
        }
    }

    fn push(&mut self, row: &[[f32; 4]], is_color: bool) {
        match self {
            Coder::Floats(texels) => texels.extend_from_slice(row),
            Coder::Bytes(bytes, layout) => {
                let number = |v: f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
                code(row, layout, is_color, srgb_byte, number, bytes);
            }
            Coder::Words(words, layout) => {
                let number = |v: f32| (v.clamp(0.0, 1.0) * 65_535.0).round() as u16;
                code(row, layout, is_color, |v| number(encode_srgb(v)), number, words);
            }
        }
    }

    fn finish(self, size: (u32, u32), meaning: Meaning) -> Level {
        let coded = |layout, codes| {
            Stored::Coded(Arc::new(Coded { size, layout, codes, coding: Coding::srgb() }))
        };
        let texels = match self {
            Coder::Floats(texels) => Stored::Floats(texels),
            Coder::Bytes(bytes, layout) => coded(layout, Codes::Bytes(bytes)),
            Coder::Words(words, layout) => coded(layout, Codes::Words(words)),
        };
        Level { width: size.0, height: size.1, texels, meaning }
    }
}

/// Adds the samples of texels in the order of a layout: of colours, what is not alpha by `color`, with alpha taken out;
/// all else by `number`.
fn code<T>(
    row: &[[f32; 4]],
    layout: &Layout,
    is_color: bool,
    color: impl Fn(f32) -> T,
    number: impl Fn(f32) -> T,
    codes: &mut Vec<T>,
) {
    let channels = layout.channels();
    let colors = if layout.has_alpha() { channels - 1 } else { channels };
    for [r, g, b, a] in row {
        // Codes hold colours with straight alpha, as files do.
        let straight = if *a > 0.0 { 1.0 / a } else { 0.0 };
        for v in [r, g, b].into_iter().take(colors) {
            codes.push(if is_color { color(v * straight) } else { number(*v) });
        }
        codes.extend(layout.has_alpha().then(|| number(*a)));
    }
}

/// A level of half a size that is made row by row, as its picture comes: each texel is the mean of what it covers.
struct Halved {
    size: (u32, u32),
    columns: Vec<(u32, Vec<f32>)>,
    rows: Vec<(u32, Vec<f32>)>,
    /// The first row that is not done, and what is known of it and those after it.
    next: usize,
    sums: VecDeque<Vec<[f32; 4]>>,
    coder: Coder,
}

impl Halved {
    fn new((width, height): (u32, u32), coder: Coder) -> Halved {
        let size = ((width / 2).max(1), (height / 2).max(1));
        let (columns, rows) = (shares(width, size.0), shares(height, size.1));
        Halved { size, columns, rows, next: 0, sums: VecDeque::new(), coder }
    }

    /// Takes row `y`, and returns the rows that are done by it.
    fn push(&mut self, y: u32, row: &[[f32; 4]], is_color: bool) -> Vec<(u32, Vec<[f32; 4]>)> {
        let mean = |(left, right): &(u32, Vec<f32>)| {
            let mut sum = [0.0f32; 4];
            for (texel, weight) in row[*left as usize..].iter().zip(right) {
                sum.iter_mut().zip(texel).for_each(|(sum, v)| *sum += v * weight);
            }
            sum
        };
        let means: Vec<[f32; 4]> = self.columns.iter().map(mean).collect();
        for (k, (top, down)) in self.rows.iter().enumerate().skip(self.next) {
            let Some(at) = y.checked_sub(*top) else { break };
            let Some(weight) = down.get(at as usize) else { continue };
            // Where the size is odd a row counts for two rows of the half, so that two or more may
            // be open.
            if self.sums.len() <= k - self.next {
                self.sums.push_back(vec![[0.0; 4]; means.len()]);
            }
            for (sum, mean) in self.sums[k - self.next].iter_mut().zip(&means) {
                sum.iter_mut().zip(mean).for_each(|(sum, v)| *sum += v * weight);
            }
        }
        let mut done = Vec::new();
        while let Some((top, down)) = self.rows.get(self.next)
            && top + down.len() as u32 <= y + 1
            && let Some(sum) = self.sums.pop_front()
        {
            self.coder.push(&sum, is_color);
            done.push((self.next as u32, sum));
            self.next += 1;
        }
        done
    }
}

/// All levels of a picture, down to one texel. Beside what is kept, some rows of each are held at a time.
pub fn pyramid(picture: Texels, meaning: Meaning) -> Vec<Level> {
    let first = Level::first(picture, meaning);
    let is_color = meaning.is_color();
    let mut halves: Vec<Halved> = Vec::new();
    let mut size = (first.width, first.height);
    while size != (1, 1) {
        let half = Halved::new(size, Coder::new(&first));
        size = half.size;
        halves.push(half);
    }
    for y in 0..first.height {
        let row: Vec<[f32; 4]> = (0..first.width).map(|x| first.cut(first.texel(x, y))).collect();
        let mut rows = vec![(y, row)];
        for half in &mut halves {
            // Levels are made of what is exact, and rounded only where they are stored.
            rows = rows.iter().flat_map(|(y, row)| half.push(*y, row, is_color)).collect();
            if rows.is_empty() {
                break;
            }
        }
    }
    let smaller = halves.into_iter().map(|half| half.coder.finish(half.size, meaning));
    std::iter::once(first).chain(smaller).collect()
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

    fn rgba(size: (u32, u32), texels: Vec<[u8; 4]>) -> Texels {
        let codes = Codes::Bytes(texels.into_flattened());
        Texels::coded(Coded { size, layout: Layout::Rgba, codes, coding: Coding::srgb() })
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
            let bytes = rgba(size, texels.iter().map(code).collect());
            for (picture, within) in [(linear, 1e-5), (bytes, 3e-3)] {
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
            let of = |texels: Vec<[u8; 4]>| pyramid(rgba(size, texels), meaning);
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
        let codes = Codes::Bytes(vec![7, 9, 9, 200]);
        let coded = Coded { size, layout: Layout::Grey, codes, coding: Coding::srgb() };
        let levels = pyramid(Texels::coded(coded), Meaning::Indices([9, 7, 8, 8]));
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
