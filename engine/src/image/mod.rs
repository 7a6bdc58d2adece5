//! Pictures: pixels with named channels.
//!
//! Colours are scene-linear with associated (premultiplied) alpha. Row 0 is the top. A picture knows the
//! size of the whole, its *display window*, and may hold only a part of it, its *data window*.

mod channel;
mod coded;
mod coding;
mod exr;
pub mod file;
mod format;
mod hdr;
mod head;
mod png;
mod raster;
mod samples;
mod stored;

pub mod texels;
mod tiff;

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::error::{Error, Result};

pub use channel::Channel;
pub(crate) use channel::is_layer_of_light;
pub use coded::{Coded, Codes, Layout};
pub use coding::Coding;
pub use exr::Attributes;
pub use samples::{FromFile, Samples};

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
    /// What the OpenEXR file that it was read from says of it: it is written again.
    pub attributes: Option<Arc<Attributes>>,
}

impl Image {
    /// A picture without channels.
    pub fn new(size: (u32, u32), window: Window) -> Image {
        let (channels, names, how, attributes) = Default::default();
        Image { size, window, channels, names, how, attributes }
    }

    /// Adds or replaces a channel.
    ///
    /// # Errors
    /// If it has not one sample for every pixel of the data window.
    pub fn insert(&mut self, name: &str, samples: Samples) -> Result<()> {
        if samples.len() != self.window.area() {
            return Err(Error::invalid(format!(
                "channel {name} has {} samples for {} pixels",
                samples.len(),
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

    /// Takes a channel out.
    pub fn remove(&mut self, name: &str) -> Option<Samples> {
        self.channels.remove(name)
    }

    /// A channel of numbers by its name. What is kept as a file has it is decoded, once; [`pixels`](Image::pixels)
    /// goes through a picture without that.
    pub fn float(&self, name: &str) -> Option<&[f32]> {
        self.channels.get(name)?.floats()
    }

    /// The pixels of the file that the picture was read from, if they are its colour and have 8 or 16 bits.
    pub fn coded(&self) -> Option<&Arc<Coded>> {
        let (coded, _) = self.channels.get("R")?.coded()?;
        let names =
            ["R", "G", "B", "A"].into_iter().take(3 + usize::from(coded.layout.has_alpha()));
        let is_of_it = |(k, name): (usize, &str)| {
            let own = self.channels.get(name).and_then(Samples::coded);
            own.is_some_and(|(other, channel)| Arc::ptr_eq(other, coded) && channel == k)
        };
        let has_other_alpha = !coded.layout.has_alpha() && self.channels.contains_key("A");
        (!has_other_alpha && names.enumerate().all(is_of_it)).then_some(coded)
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
            self.channels.get(name).and_then(|samples| samples.number(at)).unwrap_or(absent)
        };
        [value("R", 0.0), value("G", 0.0), value("B", 0.0), value("A", 1.0)]
    }

    /// Red, green, blue and alpha of all pixels of the data window, row by row, as [`rgba`](Image::rgba)
    /// has them.
    pub fn pixels(&self) -> impl Iterator<Item = [f32; 4]> + '_ {
        self.pixels_of(0..self.window.height)
    }

    /// The same of some rows of the data window, counted from its top.
    pub fn pixels_of(&self, rows: std::ops::Range<u32>) -> impl Iterator<Item = [f32; 4]> + '_ {
        let coded = self.coded();
        let channels = ["R", "G", "B", "A"].map(|name| self.channels.get(name));
        let width = self.window.width as usize;
        (rows.start as usize * width..rows.end as usize * width).map(move |at| {
            if let Some(coded) = coded {
                return coded.linear(at);
            }
            let [r, g, b, a] = channels.map(|samples| samples.and_then(|all| all.number(at)));
            [r.unwrap_or(0.0), g.unwrap_or(0.0), b.unwrap_or(0.0), a.unwrap_or(1.0)]
        })
    }

    /// The picture with all its pixels: where it holds none, they are 0 and transparent.
    #[must_use]
    pub fn whole(&self) -> Image {
        self.laid(Window::whole(self.size.0, self.size.1))
    }

    /// The picture over another window: where it holds nothing, it is 0 and transparent.
    #[must_use]
    pub fn laid(&self, window: Window) -> Image {
        if self.window == window {
            return self.clone();
        }
        let mut laid = Image { channels: BTreeMap::new(), window, ..self.clone() };
        // From a place in the window to that in what is held.
        let place = |at: usize| {
            let (x, y) = (window.x + at as u32 % window.width, window.y + at as u32 / window.width);
            let (x, y) = (x.checked_sub(self.window.x)?, y.checked_sub(self.window.y)?);
            let is_there = x < self.window.width && y < self.window.height;
            is_there.then(|| y as usize * self.window.width as usize + x as usize)
        };
        let places: Vec<Option<usize>> = (0..window.area()).map(place).collect();
        for (name, samples) in &self.channels {
            laid.channels.insert(name.clone(), samples.moved(&places));
        }
        if self.channels.contains_key("R") && !self.channels.contains_key("A") {
            let alpha = places.iter().map(|place| f32::from(u8::from(place.is_some()))).collect();
            laid.channels.insert("A".to_owned(), Samples::Float(alpha));
        }
        laid
    }

    /// The part of the picture in a window.
    #[must_use]
    pub fn cropped(&self, window: Window) -> Image {
        let mut part = Image { channels: BTreeMap::new(), ..self.clone() };
        let (left, top) = (window.x.max(self.window.x), window.y.max(self.window.y));
        let right = (window.x + window.width).min(self.window.x + self.window.width).max(left);
        let bottom = (window.y + window.height).min(self.window.y + self.window.height).max(top);
        part.window = Window { x: left, y: top, width: right - left, height: bottom - top };
        let window = Window {
            x: part.window.x.saturating_sub(self.window.x),
            y: part.window.y.saturating_sub(self.window.y),
            ..part.window
        };
        let of = (self.window.width, self.window.height);
        let mut cut: Vec<(*const Coded, Arc<Coded>)> = Vec::new();
        for (name, samples) in &self.channels {
            part.channels.insert(name.clone(), samples.cropped(of, window, &mut cut));
        }
        part
    }

    /// The bands of one picture as one. Of each band: its rows, and the picture there, of which it holds what there is.
    ///
    /// # Errors
    /// If they are not of one picture.
    pub fn joined(bands: &[(Window, Arc<Image>)]) -> Result<Image> {
        let all = bands.iter().map(|(_, band)| band);
        let held = all.clone().map(|band| band.window).filter(|window| window.area() > 0);
        let Some(held) = held.reduce(Window::around) else {
            let none = || Error::invalid("a picture has a band at least");
            return all.clone().next().map(|band| Image::clone(band)).ok_or_else(none);
        };
        let mut parts = Vec::new();
        for (own, band) in bands {
            let (y, bottom) = (own.y.max(held.y), (own.y + own.height).min(held.y + held.height));
            if y < bottom {
                parts.push(band.laid(Window { y, height: bottom - y, ..held }));
            }
        }
        let [first, rest @ ..] = &parts[..] else { return Err(Error::invalid("bands of nothing")) };
        let mut joined = Image { window: held, channels: BTreeMap::new(), ..first.clone() };
        for band in rest {
            if band.size != first.size || !band.channels.keys().eq(first.channels.keys()) {
                return Err(Error::invalid("bands of different pictures, or with other channels"));
            }
            joined.names.extend(band.names.iter().map(|(id, name)| (*id, name.clone())));
        }
        let mut known: Vec<(*const Coded, Arc<Coded>)> = Vec::new();
        for name in first.channels.keys() {
            let parts: Vec<&Samples> = parts.iter().map(|part| &part.channels[name]).collect();
            joined.insert(name, Samples::joined(&parts, &mut known))?;
        }
        Ok(joined)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let coded = self.coded().map_or(0, |coded| coded.bytes());
        coded + self.channels.values().map(Samples::bytes).sum::<usize>()
    }
}
