//! The samples of a channel.

use exr::prelude::f16;
use std::sync::{Arc, OnceLock};

use super::{Coded, Window};

/// The samples of a channel, row by row over the data window.
#[derive(Clone, Debug)]
pub enum Samples {
    /// Numbers.
    Float(Vec<f32>),
    /// Names: they are never mixed.
    Id(Vec<u32>),
    /// Numbers as a file has them. They are written as they were read: what has 32 bits keeps them.
    FromFile(FromFile),
}

/// Numbers as a file has them; made into floats when they are asked for, and then kept.
#[derive(Clone, Debug)]
pub struct FromFile {
    kept: KeptSamples,
    floats: OnceLock<Arc<[f32]>>,
}

#[derive(Clone, Debug)]
enum KeptSamples {
    Half(Arc<[f16]>),
    Float(Arc<[f32]>),
    /// Red, green, blue or alpha of coded pixels: 0 to 3.
    Coded(Arc<Coded>, usize),
}

impl Samples {
    /// Numbers of 16 bits, as a file has them.
    pub fn half(values: Vec<f16>) -> Samples {
        Samples::kept(KeptSamples::Half(values.into()))
    }

    /// Numbers of 32 bits, as a file has them.
    pub fn exact(values: Vec<f32>) -> Samples {
        Samples::kept(KeptSamples::Float(values.into()))
    }

    /// Red, green, blue or alpha of coded pixels, 0 to 3.
    pub fn of_coded(coded: &Arc<Coded>, channel: usize) -> Samples {
        Samples::kept(KeptSamples::Coded(coded.clone(), channel))
    }

    fn kept(kept: KeptSamples) -> Samples {
        Samples::FromFile(FromFile { kept, floats: OnceLock::new() })
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Samples::Float(values) => values.len(),
            Samples::Id(values) => values.len(),
            Samples::FromFile(FromFile { kept, .. }) => match kept {
                KeptSamples::Half(values) => values.len(),
                KeptSamples::Float(values) => values.len(),
                KeptSamples::Coded(coded, _) => coded.area(),
            },
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One of the numbers; nothing if they are names.
    #[inline]
    pub fn number(&self, at: usize) -> Option<f32> {
        match self {
            Samples::Float(values) => values.get(at).copied(),
            Samples::Id(_) => None,
            Samples::FromFile(FromFile { kept, .. }) => match kept {
                KeptSamples::Half(values) => values.get(at).map(|v| v.to_f32()),
                KeptSamples::Float(values) => values.get(at).copied(),
                KeptSamples::Coded(coded, channel) => {
                    (at < coded.area()).then(|| coded.linear(at)[*channel])
                }
            },
        }
    }

    /// All numbers; nothing if they are names.
    pub fn floats(&self) -> Option<&[f32]> {
        match self {
            Samples::Float(values) => Some(values),
            Samples::Id(_) => None,
            Samples::FromFile(FromFile { kept: KeptSamples::Float(values), .. }) => Some(values),
            Samples::FromFile(FromFile { kept, floats }) => {
                Some(floats.get_or_init(|| match kept {
                    KeptSamples::Half(values) => values.iter().map(|v| v.to_f32()).collect(),
                    KeptSamples::Float(values) => values.clone(),
                    KeptSamples::Coded(coded, channel) => {
                        (0..coded.area()).map(|at| coded.linear(at)[*channel]).collect()
                    }
                }))
            }
        }
    }

    /// Numbers of 16 bits, if a file has them so.
    pub(super) fn halves(&self) -> Option<&[f16]> {
        match self {
            Samples::FromFile(FromFile { kept: KeptSamples::Half(values), .. }) => Some(values),
            _ => None,
        }
    }

    /// Whether a file has them as numbers of 32 bits.
    pub(super) fn is_exact(&self) -> bool {
        matches!(self, Samples::FromFile(FromFile { kept: KeptSamples::Float(_), .. }))
    }

    pub(super) fn coded(&self) -> Option<(&Arc<Coded>, usize)> {
        match self {
            Samples::FromFile(FromFile { kept: KeptSamples::Coded(coded, channel), .. }) => {
                Some((coded, *channel))
            }
            _ => None,
        }
    }

    /// Those at some places; 0 where there is none.
    pub fn moved(&self, places: &[Option<usize>]) -> Samples {
        fn each<T: Copy + Default>(all: &[T], places: &[Option<usize>]) -> Vec<T> {
            places.iter().map(|place| place.map_or_else(T::default, |at| all[at])).collect()
        }
        match self {
            Samples::Float(all) => Samples::Float(each(all, places)),
            Samples::Id(all) => Samples::Id(each(all, places)),
            Samples::FromFile(FromFile { kept, .. }) => match kept {
                KeptSamples::Half(all) => Samples::half(each(all, places)),
                KeptSamples::Float(all) => Samples::exact(each(all, places)),
                KeptSamples::Coded(coded, channel) => Samples::Float(
                    places
                        .iter()
                        // Not all codes have a transparent pixel to put in, so these become
                        // numbers.
                        .map(|at| at.map_or(0.0, |at| coded.linear(at)[*channel]))
                        .collect(),
                ),
            },
        }
    }

    /// Whether a file has them, and nothing was done to them since.
    pub fn is_from_file(&self) -> bool {
        matches!(self, Samples::FromFile(_))
    }

    /// Those in a window of pixels in rows of a size. Channels share what was `cut` of coded pixels.
    pub(super) fn cropped(
        &self,
        size: (u32, u32),
        window: Window,
        cut: &mut Vec<(*const Coded, Arc<Coded>)>,
    ) -> Samples {
        fn part<T: Copy>(all: &[T], size: (u32, u32), window: Window) -> Vec<T> {
            let row = |y: u32| {
                let start = (window.y + y) as usize * size.0 as usize + window.x as usize;
                &all[start..start + window.width as usize]
            };
            (0..window.height).flat_map(row).copied().collect()
        }
        match self {
            Samples::Float(all) => Samples::Float(part(all, size, window)),
            Samples::Id(all) => Samples::Id(part(all, size, window)),
            Samples::FromFile(FromFile { kept, .. }) => match kept {
                KeptSamples::Half(all) => Samples::half(part(all, size, window)),
                KeptSamples::Float(all) => Samples::exact(part(all, size, window)),
                KeptSamples::Coded(coded, channel) => {
                    let known = cut.iter().find(|(of, _)| *of == Arc::as_ptr(coded));
                    let own = known.map(|(_, own)| own.clone()).unwrap_or_else(|| {
                        let own = Arc::new(coded.cropped(window));
                        cut.push((Arc::as_ptr(coded), own.clone()));
                        own
                    });
                    Samples::of_coded(&own, *channel)
                }
            },
        }
    }

    /// One after another. Channels share what is `known` of coded pixels.
    pub(super) fn joined(
        parts: &[&Samples],
        known: &mut Vec<(*const Coded, Arc<Coded>)>,
    ) -> Samples {
        // What all have in one form keeps it.
        fn all<'s, T: Clone + 's>(
            parts: &[&'s Samples],
            of: impl Fn(&'s Samples) -> Option<&'s [T]>,
        ) -> Option<Vec<T>> {
            let parts: Option<Vec<&[T]>> = parts.iter().map(|part| of(part)).collect();
            parts.map(|parts| parts.concat())
        }
        let ids = |part: &'_ Samples| matches!(part, Samples::Id(_));
        if parts.iter().all(|part| ids(part)) {
            let ids = parts.iter().filter_map(|part| match part {
                Samples::Id(ids) => Some(&**ids),
                _ => None,
            });
            return Samples::Id(ids.collect::<Vec<&[u32]>>().concat());
        }
        if let Some(halves) = all(parts, Samples::halves) {
            return Samples::half(halves);
        }
        let exact = |part| Samples::is_exact(part).then(|| part.floats()).flatten();
        if let Some(exact) = all(parts, exact) {
            return Samples::exact(exact);
        }
        let coded: Option<Vec<(&Arc<Coded>, usize)>> =
            parts.iter().map(|part| part.coded()).collect();
        if let Some(coded) = coded
            && let Some(first) = coded.first()
        {
            let made = known.iter().find(|(of, _)| *of == Arc::as_ptr(first.0));
            let made = made.map(|(_, made)| made.clone()).or_else(|| {
                let of: Vec<&Coded> = coded.iter().map(|(coded, _)| &***coded).collect();
                let made = Arc::new(Coded::joined(&of)?);
                known.push((Arc::as_ptr(first.0), made.clone()));
                Some(made)
            });
            if let Some(made) = made {
                return Samples::of_coded(&made, first.1);
            }
        }
        let floats = parts.iter().filter_map(|part| part.floats());
        Samples::Float(floats.collect::<Vec<&[f32]>>().concat())
    }

    /// Bytes held, but for coded pixels, which channels share.
    pub(super) fn bytes(&self) -> usize {
        match self {
            Samples::Float(values) => size_of_val(&**values),
            Samples::Id(values) => size_of_val(&**values),
            Samples::FromFile(FromFile { kept, floats }) => {
                let decoded = floats.get().map_or(0, |values| size_of_val(&**values));
                decoded
                    + match kept {
                        KeptSamples::Half(values) => size_of_val(&**values),
                        KeptSamples::Float(values) => size_of_val(&**values),
                        KeptSamples::Coded(..) => 0,
                    }
            }
        }
    }
}

impl PartialEq for Samples {
    /// Whether they are the same numbers or names, however they are kept.
    fn eq(&self, other: &Samples) -> bool {
        match (self, other) {
            (Samples::Id(own), Samples::Id(others)) => own == others,
            (Samples::Id(_), _) | (_, Samples::Id(_)) => false,
            (own, others) => {
                // NaN is unequal to itself here too.
                own.len() == others.len()
                    && (0..own.len()).all(|at| own.number(at) == others.number(at))
            }
        }
    }
}
