//! Attribute mapping (\[D]): *attribute domains* on a surface, each with an *attribute index*, and a table of
//! *bundles*, which are materials. Indices are never mixed: what a pixel covers of a surface is divided among its
//! domains.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::error::{Error, FirstError, Result};
use crate::image::texels::{self, Samples, Texels};
use crate::key::KeyHasher;
use crate::texture::{Filter, Footprint, Mapping, Meaning, Opened, Source, store};

/// Attribute domains of a surface, and what each looks like.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Domains {
    /// Which index is where.
    pub define: Define,
    /// How the canvas of the domains lies on the surface.
    #[serde(default)]
    pub mapping: Mapping,
    /// The bundle table: materials of the scene by attribute index.
    pub table: BTreeMap<u8, String>,
    /// Their numbers in the scene.
    #[serde(skip)]
    pub(super) numbers: BTreeMap<u8, u32>,
}

/// An attribute-domain definition function, over a canvas from 0 to 1 that repeats as its mapping says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Define {
    /// Tiles, 1, with joints between them, 0, as wide as this share of the canvas.
    Tiled(f64),
    /// Bricks, 1, with joints, 0; the canvas has two courses of one brick, the upper one moved by half.
    Bricked(f64),
    /// Squares, 0 and 1 in turns, two to a side of the canvas.
    Checker,
    /// A trigger pattern: the bytes of a grey PNG are indices.
    Picture(String),
}

/// Samples along each side of what a pixel covers: at least, and of a canvas of functions.
const SIDE: u32 = 8;

/// The most samples along a side.
const MOST_SAMPLES: f64 = 48.0;

/// The most indices of a table.
const MOST: usize = 64;

impl Define {
    /// The index at a place, if it is a function.
    fn index(&self, u: f64, v: f64) -> u8 {
        let (u, v) = (u - u.floor(), v - v.floor());
        match self {
            Define::Tiled(joint) => u8::from(u >= *joint && v >= *joint),
            Define::Bricked(joint) => {
                let course = v * 2.0;
                let upper = course >= 1.0;
                let along = if upper { u + 0.5 } else { u };
                u8::from(along - along.floor() >= *joint && course - course.floor() >= *joint)
            }
            Define::Checker => u8::from((u < 0.5) == (v < 0.5)),
            Define::Picture(_) => 0,
        }
    }
}

impl Domains {
    /// The numbers of the materials of its table.
    pub(super) fn bundles(&self) -> impl Iterator<Item = u32> + '_ {
        self.numbers.values().copied()
    }

    /// Whether they can be.
    ///
    /// # Errors
    /// If a number is out of range, or an index has no bundle.
    pub(super) fn check(&self) -> Result<()> {
        let indices: &[u8] = match &self.define {
            Define::Tiled(joint) | Define::Bricked(joint) => {
                if !(0.0..1.0).contains(joint) {
                    return Err(Error::invalid(format!(
                        "a joint of {joint}: must be 0 to below 1"
                    )));
                }
                &[0, 1]
            }
            Define::Checker => &[0, 1],
            Define::Picture(path) if path.is_empty() => {
                return Err(Error::invalid("the trigger pattern names no file"));
            }
            Define::Picture(_) => &[],
        };
        if let Some(index) = indices.iter().find(|index| !self.table.contains_key(index)) {
            return Err(Error::invalid(format!("the table has no attribute index {index}")));
        }
        if self.table.is_empty() || self.table.len() > MOST {
            return Err(Error::invalid(format!("the table has 1 to {MOST} attribute indices")));
        }
        self.mapping.check()
    }
}

/// Domains at hand.
#[derive(Debug)]
pub(super) struct Ready {
    pub(super) domains: Domains,
    path: PathBuf,
    /// Of a trigger pattern, four indices of the table each: how much of a texel is theirs.
    sources: Vec<Source>,
    fault: FirstError,
}

impl Ready {
    pub(super) fn new(domains: &Domains) -> Ready {
        let path = match &domains.define {
            Define::Picture(path) => PathBuf::from(path),
            _ => PathBuf::new(),
        };
        let known: Vec<u8> = domains.numbers.keys().copied().collect();
        let is_picture = matches!(domains.define, Define::Picture(_));
        let fours = known.chunks(4).filter(|_| is_picture);
        let source = |four: &[u8]| {
            let mut key = KeyHasher::new("trigger");
            key.value(&(&path, &known, four));
            if let Ok(about) = std::fs::metadata(&path) {
                key.value(&(about.len(), about.modified().ok()));
            }
            let (from, known, four) = (path.clone(), known.clone(), four.to_vec());
            let read = move || members(&from, &known, &four);
            Source { key: key.finish(), meaning: Meaning::Numbers, read: Box::new(read) }
        };
        let sources = fours.map(source).collect();
        Ready { domains: domains.clone(), path, sources, fault: FirstError::default() }
    }

    /// Whether its picture is there.
    ///
    /// # Errors
    /// If it is not.
    pub(super) fn offers(&self) -> Result<()> {
        if self.sources.is_empty() {
            return Ok(());
        }
        std::fs::metadata(&self.path).map(drop).map_err(|e| Error::file(&self.path, e))
    }

    pub(super) fn fault(&self) -> Option<Error> {
        self.fault.take()
    }

    /// The pictures at hand, for a batch of fragments.
    pub(super) fn open(&self) -> Vec<Opened<'_>> {
        let opened = self.sources.iter().map(|source| store().open(source));
        self.fault.sift(opened.collect()).unwrap_or_default()
    }

    /// The materials of what a pixel covers, with their shares of it: at least one.
    pub(super) fn shares(
        &self,
        opened: &[Opened<'_>],
        footprint: &Footprint,
        filter: Filter,
    ) -> Vec<(u32, f32)> {
        let numbers: Vec<u32> = self.domains.numbers.values().copied().collect();
        let mut shares = vec![0.0f32; numbers.len()];
        let wrap = self.domains.mapping.wrap;
        // So many to each canvas that a pixel covers.
        let count = |side: glam::DVec2| {
            let wanted = (side.length() * f64::from(SIDE)).ceil();
            let most = if opened.is_empty() { MOST_SAMPLES } else { f64::from(SIDE) };
            wanted.clamp(f64::from(SIDE), most) as u32
        };
        let (m, n) = (count(footprint.right), count(footprint.down));
        let each = |mut visit: Box<dyn FnMut(glam::DVec2) + '_>| {
            for j in 0..n {
                for i in 0..m {
                    let s = (f64::from(i) + 0.5) / f64::from(m) - 0.5;
                    let t = (f64::from(j) + 0.5) / f64::from(n) - 0.5;
                    visit(footprint.at + footprint.right * s + footprint.down * t);
                }
            }
        };
        let one = 1.0 / (m * n) as f32;
        match opened.first() {
            None => each(Box::new(|at| {
                let index = self.domains.define.index(at.x, at.y);
                let place = self.domains.numbers.keys().position(|known| *known == index);
                shares[place.unwrap_or(0)] += one;
            })),
            Some(first) => {
                let size = glam::DVec2::new(f64::from(first.size.0), f64::from(first.size.1));
                let texels =
                    (footprint.right * size).length().max((footprint.down * size).length());
                for (four, opened) in shares.chunks_mut(4).zip(opened) {
                    let mut add = |at: &Footprint, filter: Filter, weight: f32| {
                        let seen = at.see(opened, filter, wrap);
                        let seen = self.fault.sift(seen).unwrap_or_default();
                        four.iter_mut().zip(seen).for_each(|(share, v)| *share += v * weight);
                    };
                    if texels > f64::from(SIDE) {
                        add(footprint, filter, 1.0);
                    } else {
                        // Near enough, domains have edges, wherever a pixel is: no filter mixes them.
                        each(Box::new(|at| {
                            let at = Footprint { at, ..Footprint::default() };
                            add(&at, Filter::Nearest, one);
                        }));
                    }
                }
            }
        }
        let all: f32 = shares.iter().sum();
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

/// Of each texel of a trigger pattern, whether it is of four indices.
fn members(path: &Path, known: &[u8], four: &[u8]) -> Result<Texels> {
    let texels = texels::read(path)?;
    let Samples::Bytes(bytes) = &texels.samples else {
        return Err(Error::in_file(path, "a trigger pattern has 8 bits: its bytes are indices"));
    };
    let wrong = bytes.iter().position(|[index, ..]| !known.contains(index));
    if let Some(at) = wrong {
        let (x, y) = (at as u32 % texels.size.0, at as u32 / texels.size.0);
        let index = bytes[at][0];
        return Err(Error::in_file(
            path,
            format!(
                "pixel {x}, {y} has attribute index {index}, which is not in the table: {known:?}"
            ),
        ));
    }
    let of = |[index, ..]: &[u8; 4]| {
        let mut is = [0u8; 4];
        is.iter_mut().zip(four).for_each(|(is, known)| *is = 255 * u8::from(known == index));
        is
    };
    let samples = Samples::Bytes(bytes.iter().map(of).collect());
    Ok(Texels { size: texels.size, samples })
}
