//! Pixels of 8 or 16 bits, kept as their file codes them until they are asked for as numbers.

use image::metadata::Orientation;

use super::Window;
use super::coding::Coding;

/// The samples of a picture with 8 or 16 bits, as its file codes them: row by row from the top, alpha straight.
#[derive(Clone, Debug)]
pub struct Coded {
    /// Columns and rows.
    pub size: (u32, u32),
    /// What the samples of a pixel are.
    pub layout: Layout,
    /// The samples, pixel after pixel.
    pub codes: Codes,
    /// How codes become colours.
    pub coding: Coding,
}

/// What the samples of a pixel are.
#[derive(Clone, Debug, PartialEq)]
pub enum Layout {
    /// Grey.
    Grey,
    /// Grey and alpha.
    GreyAlpha,
    /// Red, green and blue.
    Rgb,
    /// Red, green, blue and alpha.
    Rgba,
    /// The number of a colour: red, green, blue and alpha. What goes beyond the last is black.
    Palette(Vec<[u8; 4]>),
}

/// Samples.
#[derive(Clone, Debug, PartialEq)]
pub enum Codes {
    /// Of 8 bits.
    Bytes(Vec<u8>),
    /// Of 16 bits.
    Words(Vec<u16>),
}

impl Codes {
    fn len(&self) -> usize {
        match self {
            Codes::Bytes(codes) => codes.len(),
            Codes::Words(codes) => codes.len(),
        }
    }

    /// The samples, some to a pixel, of other pixels in another order.
    fn rearranged(&self, channels: usize, order: impl Iterator<Item = usize>) -> Codes {
        fn pick<T: Copy>(
            from: &[T],
            channels: usize,
            order: impl Iterator<Item = usize>,
        ) -> Vec<T> {
            let pixel = |at: usize| from[at * channels..][..channels].iter().copied();
            order.flat_map(pixel).collect()
        }
        match self {
            Codes::Bytes(codes) => Codes::Bytes(pick(codes, channels, order)),
            Codes::Words(codes) => Codes::Words(pick(codes, channels, order)),
        }
    }
}

impl Layout {
    /// Samples of a pixel.
    pub fn channels(&self) -> usize {
        match self {
            Layout::Grey | Layout::Palette(_) => 1,
            Layout::GreyAlpha => 2,
            Layout::Rgb => 3,
            Layout::Rgba => 4,
        }
    }

    /// The red, green, blue and alpha of a pixel whose samples are its colour.
    #[inline]
    fn pixel<T: Copy>(&self, codes: &[T], at: usize, opaque: T) -> [T; 4] {
        let at = at * self.channels();
        match self {
            Layout::Grey | Layout::Palette(_) => [codes[at], codes[at], codes[at], opaque],
            Layout::GreyAlpha => [codes[at], codes[at], codes[at], codes[at + 1]],
            Layout::Rgb => [codes[at], codes[at + 1], codes[at + 2], opaque],
            Layout::Rgba => [codes[at], codes[at + 1], codes[at + 2], codes[at + 3]],
        }
    }

    /// Whether pixels may have an alpha below 1.
    pub fn has_alpha(&self) -> bool {
        match self {
            Layout::Grey | Layout::Rgb => false,
            Layout::GreyAlpha | Layout::Rgba => true,
            Layout::Palette(colors) => colors.iter().any(|[.., a]| *a < 255),
        }
    }
}

impl Coded {
    /// The number of pixels.
    pub fn area(&self) -> usize {
        self.size.0 as usize * self.size.1 as usize
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        match &self.codes {
            Codes::Bytes(codes) => codes.len(),
            Codes::Words(codes) => 2 * codes.len(),
        }
    }

    /// Whether there is a sample for each.
    pub(super) fn is_whole(&self) -> bool {
        self.codes.len() == self.area() * self.layout.channels()
    }

    /// The red, green, blue and alpha of a pixel as they are coded, 65535 the most.
    #[inline]
    pub fn code(&self, at: usize) -> [u16; 4] {
        match &self.codes {
            Codes::Words(codes) => self.layout.pixel(codes, at, u16::MAX),
            // 255 becomes 65535: a byte written twice.
            Codes::Bytes(codes) => self.byte(codes, at).map(|v| u16::from(v) * 257),
        }
    }

    #[inline]
    fn byte(&self, codes: &[u8], at: usize) -> [u8; 4] {
        match &self.layout {
            Layout::Palette(colors) => {
                *colors.get(usize::from(codes[at])).unwrap_or(&[0, 0, 0, u8::MAX])
            }
            layout => layout.pixel(codes, at, u8::MAX),
        }
    }

    /// A pixel's first sample as it is: of a palette, the number of the colour.
    #[inline]
    pub fn index(&self, at: usize) -> u32 {
        let at = at * self.layout.channels();
        match &self.codes {
            Codes::Bytes(codes) => u32::from(codes[at]),
            Codes::Words(codes) => u32::from(codes[at]),
        }
    }

    /// A pixel as a scene-linear colour with associated alpha.
    #[inline]
    pub fn linear(&self, at: usize) -> [f32; 4] {
        let ([r, g, b], alpha) = match &self.codes {
            Codes::Bytes(codes) => {
                let [r, g, b, a] = self.byte(codes, at);
                (self.coding.linear_bytes([r, g, b]), f32::from(a) / f32::from(u8::MAX))
            }
            Codes::Words(codes) => {
                let [r, g, b, a] = self.layout.pixel(codes, at, u16::MAX);
                (self.coding.linear([r, g, b]), share(a))
            }
        };
        // Linear first: a product of codes is no code of a product.
        [r * alpha, g * alpha, b * alpha, alpha]
    }

    /// A pixel as numbers, whatever they mean, 1 the most.
    #[inline]
    pub fn numbers(&self, at: usize) -> [f32; 4] {
        self.code(at).map(share)
    }

    /// The same with one sample to a pixel, if all are opaque and as red as they are green and blue.
    pub fn greyed(&self) -> Option<Coded> {
        let channels = self.layout.channels();
        fn first<T: Copy + PartialEq>(codes: &[T], channels: usize, opaque: T) -> Option<Vec<T>> {
            let is_grey = |pixel: &[T]| {
                pixel[1] == pixel[0]
                    && pixel[2] == pixel[0]
                    && pixel.get(3).is_none_or(|a| *a == opaque)
            };
            let pixels = || codes.chunks_exact(channels);
            pixels().all(is_grey).then(|| pixels().map(|pixel| pixel[0]).collect())
        }
        let codes = match (&self.codes, channels) {
            (Codes::Bytes(codes), 3 | 4) => Codes::Bytes(first(codes, channels, u8::MAX)?),
            (Codes::Words(codes), 3 | 4) => Codes::Words(first(codes, channels, u16::MAX)?),
            _ => return None,
        };
        let (size, coding) = (self.size, self.coding.clone());
        Some(Coded { size, layout: Layout::Grey, codes, coding })
    }

    /// The same with the first samples, shrunk by alpha, for alpha, and white for the colour.
    #[must_use]
    pub fn into_alpha(&self) -> Coded {
        let product = |[v, .., a]: [u16; 4]| {
            ((u32::from(v) * u32::from(a) + u32::from(u16::MAX) / 2) / u32::from(u16::MAX)) as u16
        };
        let alphas = (0..self.area()).map(|at| product(self.code(at)));
        let codes = match self.codes {
            Codes::Bytes(_) => Codes::Bytes(
                alphas.flat_map(|a| [255, ((u32::from(a) + 128) / 257) as u8]).collect(),
            ),
            Codes::Words(_) => Codes::Words(alphas.flat_map(|a| [u16::MAX, a]).collect()),
        };
        let (size, coding) = (self.size, self.coding.clone());
        Coded { size, layout: Layout::GreyAlpha, codes, coding }
    }

    /// The part in a window, which lies in it.
    pub(super) fn cropped(&self, window: Window) -> Coded {
        let row = |y: u32| {
            let start = (window.y + y) as usize * self.size.0 as usize + window.x as usize;
            start..start + window.width as usize
        };
        let order = (0..window.height).flat_map(row);
        let codes = self.codes.rearranged(self.layout.channels(), order);
        let size = (window.width, window.height);
        Coded { size, layout: self.layout.clone(), codes, coding: self.coding.clone() }
    }

    /// Pictures of one width below each other; `None` if they are not coded alike.
    pub(super) fn joined(parts: &[&Coded]) -> Option<Coded> {
        let first = parts.first()?;
        let is_alike = |part: &&Coded| {
            part.size.0 == first.size.0
                && part.layout == first.layout
                && part.coding.is(&first.coding)
        };
        if !parts.iter().all(is_alike) {
            return None;
        }
        let bytes = parts.iter().map(|part| match &part.codes {
            Codes::Bytes(codes) => Some(&**codes),
            Codes::Words(_) => None,
        });
        let words = parts.iter().map(|part| match &part.codes {
            Codes::Words(codes) => Some(&**codes),
            Codes::Bytes(_) => None,
        });
        let codes = match bytes.collect::<Option<Vec<&[u8]>>>() {
            Some(bytes) => Codes::Bytes(bytes.concat()),
            None => Codes::Words(words.collect::<Option<Vec<&[u16]>>>()?.concat()),
        };
        let height = parts.iter().map(|part| part.size.1).sum();
        let size = (first.size.0, height);
        Some(Coded { size, layout: first.layout.clone(), codes, coding: first.coding.clone() })
    }

    /// The picture upright, as its camera says that it is held.
    #[must_use]
    pub(super) fn upright(self, orientation: Orientation) -> Coded {
        use Orientation::{
            FlipHorizontal, FlipVertical, NoTransforms, Rotate90, Rotate90FlipH, Rotate180,
            Rotate270, Rotate270FlipH,
        };
        let (width, height) = (self.size.0 as usize, self.size.1 as usize);
        let is_turned =
            matches!(orientation, Rotate90 | Rotate270 | Rotate90FlipH | Rotate270FlipH);
        let size = if is_turned { (self.size.1, self.size.0) } else { self.size };
        // From a place in the upright picture to that in the file.
        let place = |at: usize| {
            let (x, y) = (at % size.0 as usize, at / size.0 as usize);
            let (x, y) = match orientation {
                NoTransforms => (x, y),
                FlipHorizontal => (width - 1 - x, y),
                FlipVertical => (x, height - 1 - y),
                Rotate180 => (width - 1 - x, height - 1 - y),
                Rotate90 => (y, height - 1 - x),
                Rotate270 => (width - 1 - y, x),
                Rotate90FlipH => (y, x),
                Rotate270FlipH => (width - 1 - y, height - 1 - x),
            };
            y * width + x
        };
        if orientation == NoTransforms {
            return self;
        }
        let codes = self.codes.rearranged(self.layout.channels(), (0..self.area()).map(place));
        Coded { size, codes, ..self }
    }
}

#[inline]
fn share(code: u16) -> f32 {
    f32::from(code) / f32::from(u16::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{DynamicImage, RgbImage};

    fn coded(size: (u32, u32), layout: Layout, bytes: Vec<u8>) -> Coded {
        Coded { size, layout, codes: Codes::Bytes(bytes), coding: Coding::srgb() }
    }

    #[test]
    fn a_picture_is_turned_as_its_camera_says() {
        let bytes: Vec<u8> = (0..18).collect();
        for exif in 1..=8 {
            let orientation = Orientation::from_exif(exif).unwrap();
            let mut expected: DynamicImage =
                RgbImage::from_raw(3, 2, bytes.clone()).unwrap().into();
            expected.apply_orientation(orientation);
            let made = coded((3, 2), Layout::Rgb, bytes.clone()).upright(orientation);
            assert_eq!(made.size, (expected.width(), expected.height()), "{exif}");
            assert_eq!(made.codes, Codes::Bytes(expected.into_bytes()), "{exif}");
        }
    }

    #[test]
    fn layouts_mean_colours() {
        let grey = coded((2, 1), Layout::GreyAlpha, vec![255, 51, 0, 255]);
        assert_eq!(grey.linear(0), [0.2, 0.2, 0.2, 0.2]);
        assert_eq!(grey.numbers(1), [0.0, 0.0, 0.0, 1.0]);
        let colors = vec![[0, 0, 0, 255], [255, 0, 0, 0]];
        let own = coded((3, 1), Layout::Palette(colors), vec![1, 0, 9]);
        assert!(own.layout.has_alpha());
        assert_eq!([own.numbers(0), own.numbers(2)], [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]);
        assert_eq!((own.index(0), own.index(2)), (1, 9));
        let alpha = coded((2, 1), Layout::GreyAlpha, vec![255, 51, 128, 255]).into_alpha();
        assert_eq!(alpha.codes, Codes::Bytes(vec![255, 51, 255, 128]));
    }

    #[test]
    fn a_part_is_cut_out() {
        let whole = coded((4, 3), Layout::Grey, (0..12).collect());
        let part = whole.cropped(Window { x: 1, y: 1, width: 2, height: 2 });
        assert_eq!((part.size, part.codes), ((2, 2), Codes::Bytes(vec![5, 6, 9, 10])));
    }
}
