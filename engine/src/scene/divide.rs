//! What a pixel covers of a surface, divided among its attribute domains (\[D], "Attribute mapping").

use glam::DVec2;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::absent::{is_there, without_pictures};
use super::domains::{Define, Domains};
use super::maps::Sizes;
use crate::error::{Error, FirstError, Result};
use crate::image::file::Encoded;
use crate::image::texels::{Samples, Texels};
use crate::image::{Codes, Layout};
use crate::key::{Key, KeyHasher};
use crate::open;
use crate::texture::{Footprint, Meaning, Opened, PictureSource, TextureFilter, is_in, store};

/// The most texels of a trigger pattern, or canvases, along a side of what a pixel covers for which
/// shares are exact.
const NEAR: f64 = 8.0;
const NEAR_CANVASES: f64 = 3.0;

/// Samples of a canvas along a side of what a pixel covers, if it covers many; and the most in all.
const SAMPLES: f64 = 8.0;
const MOST_SAMPLES: f64 = 48.0;

impl Define {
    /// Where a canvas has the index 1, if it is a function. Elsewhere it is 0.
    fn ones(&self) -> [[DVec2; 2]; 2] {
        let rectangle = |u: [f64; 2], v: [f64; 2]| [DVec2::new(u[0], v[0]), DVec2::new(u[1], v[1])];
        match *self {
            // The second rectangle is empty: every function has two, so that shares are computed
            // alike.
            Define::Tiled(joint) => [rectangle([joint, 1.0], [joint, 1.0]), [DVec2::ZERO; 2]],
            // Two courses of bricks in a canvas, the upper one moved by half of a brick.
            Define::Bricked(joint) => [
                rectangle([joint, 1.0], [joint / 2.0, 0.5]),
                rectangle([joint - 0.5, 0.5], [0.5 + joint / 2.0, 1.0]),
            ],
            Define::Checker => {
                [rectangle([0.0, 0.5], [0.0, 0.5]), rectangle([0.5, 1.0], [0.5, 1.0])]
            }
            Define::Picture(_) => [[DVec2::ZERO; 2]; 2],
        }
    }

    /// How much of what a pixel covers has the index 1, if it is a function.
    fn share(&self, footprint: &Footprint) -> f64 {
        let ones = self.ones();
        let (right, down) = (footprint.right.length(), footprint.down.length());
        if right.max(down) <= NEAR_CANVASES {
            // Few canvases: the area of the footprint in each rectangle, exactly.
            return footprint.share_of(&ones);
        }
        // Many canvases: what single samples miss is far below what a pixel shows.
        let count = |side: f64| (side * SAMPLES).ceil().clamp(SAMPLES, MOST_SAMPLES);
        let (m, n) = (count(right), count(down));
        let mut sum = 0.0;
        for j in 0..n as u32 {
            for i in 0..m as u32 {
                let s = (f64::from(i) + 0.5) / m - 0.5;
                let t = (f64::from(j) + 0.5) / n - 0.5;
                let at = footprint.at + footprint.right * s + footprint.down * t;
                sum += f64::from(u8::from(is_in(&ones, at)));
            }
        }
        sum / (m * n)
    }
}

/// Domains, ready to use.
#[derive(Debug)]
pub(super) struct ReadyDomains {
    pub(super) domains: Domains,
    path: PathBuf,
    /// For a trigger pattern, four indices of the table each: the pattern, and how much of its
    /// coarser texels they have.
    sources: Vec<PictureSource>,
    fault: FirstError,
}

impl ReadyDomains {
    pub(super) fn new(domains: &Domains) -> ReadyDomains {
        let mut ready = ReadyDomains {
            domains: domains.clone(),
            path: PathBuf::new(),
            sources: Vec::new(),
            fault: FirstError::default(),
        };
        let Define::Picture(path) = &domains.define else { return ready };
        ready.path = PathBuf::from(path);
        let known: Vec<u8> = domains.numbers.keys().copied().collect();
        let contents = open::contents(&ready.path);
        // Two files that are not there must not count as one picture: without contents, the path
        // tells.
        let absent = contents.is_none().then(|| ready.path.clone());
        let source = |four: &[u8]| {
            // A last group of fewer than four repeats its last index; nobody reads the repeats.
            let four = std::array::from_fn(|k| four[k.min(four.len() - 1)]);
            let mut key = KeyHasher::new("trigger");
            key.value(&(contents, &absent, &known, four));
            let (from, known) = (ready.path.clone(), known.clone());
            let read = Box::new(move || indices(&from, &known));
            PictureSource { key: key.finish(), meaning: Meaning::Indices(four), read }
        };
        ready.sources = known.chunks(4).map(source).collect();
        ready
    }

    /// Checks that its picture is there.
    ///
    /// # Errors
    /// If it is not.
    pub(super) fn offers(&self) -> Result<()> {
        if self.sources.is_empty() {
            return Ok(());
        }
        is_there(&self.path, "a trigger pattern")
    }

    pub(super) fn fault(&self) -> Option<Error> {
        self.fault.take().map(without_pictures)
    }

    /// Its trigger patterns, and the most bytes that each takes.
    pub(super) fn pictures(&self, sizes: &mut Sizes<'_>) -> Vec<(Key, u64)> {
        let sources = self.sources.iter();
        sources.map(|source| (source.key, sizes.of(source.key, &self.path, None))).collect()
    }

    /// The opened pictures, for a batch of fragments.
    pub(super) fn open(&self) -> Vec<Opened<'_>> {
        let opened = self.sources.iter().map(|source| store().open(source));
        self.fault.sift(opened.collect()).unwrap_or_default()
    }

    /// The materials of what a pixel covers, with their shares of it: at least one.
    pub(super) fn shares(
        &self,
        opened: &[Opened<'_>],
        footprint: &Footprint,
        filter: TextureFilter,
    ) -> Vec<(u32, f32)> {
        let numbers: Vec<u32> = self.domains.numbers.values().copied().collect();
        let mut shares = vec![0.0f32; numbers.len()];
        let wrap = self.domains.mapping.wrap;
        let place = |index: u8| self.domains.numbers.keys().position(|known| *known == index);
        let Some(first) = opened.first() else {
            let ones = self.domains.define.share(footprint) as f32;
            for (index, share) in [(0, 1.0 - ones), (1, ones)] {
                shares[place(index).unwrap_or(0)] += share;
            }
            return self.there(numbers, shares);
        };
        let size = DVec2::new(f64::from(first.size.0), f64::from(first.size.1));
        let texels = (footprint.right * size).length().max((footprint.down * size).length());
        if texels > NEAR {
            // Indices are names: their mean means nothing. Each has a channel with its share
            // instead, and shares can be filtered.
            for (four, opened) in shares.chunks_mut(4).zip(opened) {
                let seen = self.fault.sift(footprint.see(opened, filter, wrap));
                four.iter_mut().zip(seen.unwrap_or_default()).for_each(|(share, v)| *share = v);
            }
        } else {
            // Near enough, domains have edges, wherever a pixel is: no filter mixes them.
            let mut last = None;
            let told = footprint.indices(first, wrap, |index, share| {
                let known = last.filter(|(known, _)| *known == index);
                let (_, at) = *last.insert(known.unwrap_or((index, place(index))));
                if let Some(at) = at {
                    shares[at] += share;
                }
            });
            self.fault.sift(told);
        }
        self.there(numbers, shares)
    }

    /// The materials that have any share, with shares that sum to 1: at least one.
    fn there(&self, numbers: Vec<u32>, shares: Vec<f32>) -> Vec<(u32, f32)> {
        let all: f32 = shares.iter().sum();
        // Each material that is left is shaded by itself. The rest of a filter's tail is not worth
        // it.
        let there = numbers.into_iter().zip(shares).filter(|(_, share)| *share > 1e-4 * all);
        let there: Vec<(u32, f32)> = there.map(|(number, share)| (number, share / all)).collect();
        if there.is_empty() {
            let first = self.domains.numbers.values().next().copied().unwrap_or(0);
            return vec![(first, 1.0)];
        }
        let kept: f32 = there.iter().map(|(_, share)| share).sum();
        there.into_iter().map(|(number, share)| (number, share / kept)).collect()
    }
}

/// A trigger pattern, all of whose indices are known.
fn indices(path: &Path, known: &[u8]) -> Result<Texels> {
    let texels = Encoded::open(path)?.texels(true)?;
    let fault = |what: &str| Err(Error::in_file(path, format!("a trigger pattern {what}")));
    let Samples::Coded(coded) = &texels.samples else {
        return fault("has 8 bits: its bytes are indices");
    };
    if matches!(coded.codes, Codes::Words(_)) {
        return fault("has 8 bits: its bytes are indices");
    }
    // What is red, green and blue may be grey all the same.
    let grey = match coded.layout {
        Layout::Grey | Layout::Palette(_) => Some(coded.clone()),
        _ => coded.greyed().map(Arc::new),
    };
    let Some(coded) = grey else {
        return fault(
            "is grey, or has a palette, so that each pixel is one number: this one is red, green and blue; save \
             it with a palette, or make it with `Segment`",
        );
    };
    let wrong = (0..coded.area()).find(|at| !known.contains(&(coded.index(*at) as u8)));
    if let Some(at) = wrong {
        let (x, y) = (at as u32 % coded.size.0, at as u32 / coded.size.0);
        let index = coded.index(at);
        return Err(Error::in_file(
            path,
            format!(
                "pixel {x}, {y} has attribute index {index}, which is not in the table: {known:?}"
            ),
        ));
    }
    Ok(Texels::coded(coded))
}
