//! Pictures: pixels with named channels.
//!
//! Colours are scene-linear with associated (premultiplied) alpha. Row 0 is the top. A picture knows the
//! size of the whole, its *display window*, and may hold only a part of it, its *data window*.

mod exr;
pub mod file;
mod hdr;
mod png;
pub mod texels;

use std::collections::BTreeMap;

use crate::error::{Error, Result};

/// A rectangle of pixels: left, top, width, height.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize)]
pub struct Window {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Window {
    /// The whole of a picture.
    pub fn whole(width: u32, height: u32) -> Window {
        Window { x: 0, y: 0, width, height }
    }

    /// The smallest window around two.
    #[must_use]
    pub fn around(self, other: Window) -> Window {
        let (x, y) = (self.x.min(other.x), self.y.min(other.y));
        let right = (self.x + self.width).max(other.x + other.width);
        let bottom = (self.y + self.height).max(other.y + other.height);
        Window { x, y, width: right - x, height: bottom - y }
    }

    /// The part that lies in a picture of some size.
    #[must_use]
    pub fn within(self, width: u32, height: u32) -> Window {
        let (x, y) = (self.x.min(width), self.y.min(height));
        let right = self.x.saturating_add(self.width).min(width);
        let bottom = self.y.saturating_add(self.height).min(height);
        Window { x, y, width: right - x, height: bottom - y }
    }

    /// The number of pixels.
    pub fn area(self) -> usize {
        self.width as usize * self.height as usize
    }
}

impl std::fmt::Display for Window {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} by {} at {}, {}", self.width, self.height, self.x, self.y)
    }
}

/// The samples of a channel, row by row over the data window.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Numbers.
    Float(Vec<f32>),
    /// Names: they are never mixed.
    Id(Vec<u32>),
}

/// A picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Columns and rows of the whole picture.
    pub size: (u32, u32),
    /// The part that is held.
    pub window: Window,
    channels: BTreeMap<String, Samples>,
    /// What ids mean.
    pub names: BTreeMap<u32, String>,
    /// How it was resolved, if it was: pictures that differ in it have not the same pixels.
    pub how: Option<String>,
    /// What was done to make it, counted.
    pub counts: BTreeMap<&'static str, u64>,
}

impl Image {
    /// A picture without channels.
    pub fn new(size: (u32, u32), window: Window) -> Image {
        let (channels, names, how, counts) = Default::default();
        Image { size, window, channels, names, how, counts }
    }

    /// Adds or replaces a channel.
    ///
    /// # Errors
    /// If it has not one sample for every pixel of the data window.
    pub fn insert(&mut self, name: &str, samples: Samples) -> Result<()> {
        let len = match &samples {
            Samples::Float(values) => values.len(),
            Samples::Id(values) => values.len(),
        };
        if len != self.window.area() {
            return Err(Error::invalid(format!(
                "channel {name} has {len} samples for {} pixels",
                self.window.area()
            )));
        }
        self.channels.insert(name.to_owned(), samples);
        Ok(())
    }

    /// A channel by its name.
    pub fn channel(&self, name: &str) -> Option<&Samples> {
        self.channels.get(name)
    }

    /// A channel of numbers by its name.
    pub fn float(&self, name: &str) -> Option<&[f32]> {
        match self.channels.get(name)? {
            Samples::Float(values) => Some(values),
            Samples::Id(_) => None,
        }
    }

    /// All channels by name.
    pub fn channels(&self) -> impl Iterator<Item = (&str, &Samples)> {
        self.channels.iter().map(|(name, samples)| (name.as_str(), samples))
    }

    /// Red, green, blue and alpha of a pixel of the data window, counted from its top left. Channels
    /// that are absent are 0, alpha 1.
    pub fn rgba(&self, x: u32, y: u32) -> [f32; 4] {
        let at = y as usize * self.window.width as usize + x as usize;
        let value = |name: &str, absent: f32| {
            self.float(name).and_then(|values| values.get(at)).copied().unwrap_or(absent)
        };
        [value("R", 0.0), value("G", 0.0), value("B", 0.0), value("A", 1.0)]
    }

    /// Red, green, blue and alpha of all pixels of the data window, row by row, as [`rgba`](Image::rgba)
    /// has them.
    pub fn pixels(&self) -> impl Iterator<Item = [f32; 4]> + '_ {
        let channels = ["R", "G", "B", "A"].map(|name| self.float(name));
        (0..self.window.area()).map(move |at| {
            let [r, g, b, a] = channels.map(|values| values.map(|values| values[at]));
            [r.unwrap_or(0.0), g.unwrap_or(0.0), b.unwrap_or(0.0), a.unwrap_or(1.0)]
        })
    }

    /// The part of the picture in a window.
    #[must_use]
    pub fn cropped(&self, window: Window) -> Image {
        let mut part = Image { channels: BTreeMap::new(), ..self.clone() };
        let (left, top) = (window.x.max(self.window.x), window.y.max(self.window.y));
        let right = (window.x + window.width).min(self.window.x + self.window.width).max(left);
        let bottom = (window.y + window.height).min(self.window.y + self.window.height).max(top);
        part.window = Window { x: left, y: top, width: right - left, height: bottom - top };
        fn cut<T: Copy>(all: &[T], from: Window, part: Window) -> Vec<T> {
            let row = |y: u32| {
                let start = (part.y - from.y + y) as usize * from.width as usize;
                let start = start + (part.x - from.x) as usize;
                &all[start..start + part.width as usize]
            };
            (0..part.height).flat_map(row).copied().collect()
        }
        for (name, samples) in &self.channels {
            let samples = match samples {
                Samples::Float(all) => Samples::Float(cut(all, self.window, part.window)),
                Samples::Id(all) => Samples::Id(cut(all, self.window, part.window)),
            };
            part.channels.insert(name.clone(), samples);
        }
        part
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.channels.len() * self.window.area() * 4
    }
}
