//! Images brought together: their sources united, so that ids mean the same in all.

use std::cmp::Ordering;
use std::sync::Arc;

use super::cut::{self, Cut};
use super::layer::{self, Segment};
use super::line::{self, Span};
use super::probe::probing;
use super::{Cuts, FaceId, Layers, Lines, OnLine, Probing, Source, SpanImage};
use crate::error::{Error, Result};

/// The united sources of some images, and where the faces of each stand in them. Merges those images,
/// or others of the same sources on other rows.
#[derive(Debug)]
pub struct Union {
    sources: Vec<Arc<Source>>,
    bases: Vec<u32>,
    /// By image.
    places: Vec<Places>,
}

impl Union {
    /// Unites the sources of images.
    ///
    /// # Errors
    /// If the images differ in camera, raster, line plan or rows, or have more faces than ids (2^32 - 1).
    pub fn new(images: &[SpanImage]) -> Result<Union> {
        if let Some((first, others)) = images.split_first() {
            others.iter().try_for_each(|other| first.check_mergeable(other))?;
        }
        Union::of(images.iter().map(|image| image.sources().to_vec()).collect())
    }

    /// Brings the sources of images into their order, without doubles.
    ///
    /// # Errors
    /// If there are more faces than ids.
    pub(super) fn of(images: Vec<Vec<Arc<Source>>>) -> Result<Union> {
        let counts: Vec<usize> = images.iter().map(Vec::len).collect();
        let mut slots: Vec<(usize, Arc<Source>)> =
            images.into_iter().flatten().enumerate().collect();
        let count = slots.len();
        // By content, not by who comes first: ids decide where faces coincide, so their order must
        // not depend on the order of the images.
        slots.sort_by(|a, b| a.1.order(&b.1).then(a.0.cmp(&b.0)));

        // Unite the tables of equal sources; `place_of[old]` tells where each face of a source went.
        let mut united: Vec<Arc<Source>> = Vec::new();
        let mut place_of: Vec<(usize, Option<Vec<u32>>)> = vec![(0, None); count];
        let mut members: Vec<usize> = Vec::new();
        for (old, source) in slots {
            match united.last_mut().filter(|last| last.order(&source) == Ordering::Equal) {
                Some(last) => {
                    let (both, [before, added]) = last.unite(&source)?;
                    // The union put new faces between the old ones. What earlier members know of
                    // their places is led on to the new places.
                    if let Some(before) = before {
                        for member in &members {
                            let table = &mut place_of[*member].1;
                            *table = Some(match table.take() {
                                None => before.clone(),
                                Some(old) => {
                                    old.iter().map(|place| before[*place as usize]).collect()
                                }
                            });
                        }
                    }
                    *last = Arc::new(both);
                    place_of[old].1 = added;
                    members.push(old);
                }
                None => {
                    united.push(source);
                    members = vec![old];
                }
            }
            place_of[old].0 = united.len() - 1;
        }

        let mut bases = Vec::with_capacity(united.len());
        let mut total = 0u64;
        for source in &united {
            bases.push(total as u32);
            total += source.faces.faces().len() as u64;
            if total >= u64::from(u32::MAX) {
                return Err(Error::invalid(
                    "more than 2^32 faces in one image: merge fewer clusters",
                ));
            }
        }

        let mut place_of = place_of.into_iter();
        let of_image = |count: usize| {
            let own = place_of.by_ref().take(count);
            Places(own.map(|(slot, table)| (bases[slot], table)).collect())
        };
        let places = counts.into_iter().map(of_image).collect();
        Ok(Union { sources: united, bases, places })
    }

    /// An image whose ids are the union's already, or that has none.
    pub(super) fn frame(&self, image: &SpanImage) -> SpanImage {
        image.with_sources_of(self.sources.clone(), self.bases.clone())
    }

    /// An image in the place of the i-th, with ids that mean the same in all.
    pub fn bring(&self, i: usize, image: &SpanImage) -> SpanImage {
        let places = &self.places[i];
        if places.stay(image) {
            return self.frame(image);
        }
        image.renamed(self.frame(image), |face| places.of(image, face))
    }

    /// Merges images in the places of those that were united, as [`SpanImage::merge`] says.
    ///
    /// # Errors
    /// If the images differ in camera, raster, line plan or rows.
    pub fn merge(&self, images: &[SpanImage]) -> Result<SpanImage> {
        let Some((first, others)) = images.split_first() else {
            return Err(Error::invalid("a merge needs at least one image"));
        };
        others.iter().try_for_each(|other| first.check_mergeable(other))?;
        let frame = self.frame(first);
        let cells = frame.view().raster().cells();
        let all = frame.lines().range();
        let each = || images.iter().zip(&self.places);
        // [N], "Compositing 3D images": sub-scanline by sub-scanline, reading the span buffers of
        // the images and writing that of the composite.
        let lines = Lines::compute(all.clone(), |k, out| {
            let y = frame.y(k);
            let on_line = |face| frame.on_line(face, y);
            let own: Vec<Vec<Span>> =
                each().map(|(image, map)| map.line(image, k).collect()).collect();
            merge_lines(&own, cells, &on_line, out);
        });
        let layers = if images.iter().all(|image| image.layers().items().is_empty()) {
            Layers::empty(all.clone())
        } else {
            Layers::compute(all.clone(), |k, out| {
                let y = frame.y(k);
                let on_line = |face| frame.on_line(face, y);
                let start = out.len();
                for (image, map) in each() {
                    let own: Vec<Segment> = map.layers(image, k).collect();
                    // Clipped by the merged line, as what hides a layer may come from another
                    // image.
                    layer::clip(&own, lines.line(k), cells, on_line, out);
                }
                layer::normalize(out, start);
            })
        };
        let cuts = if images.iter().all(|image| image.cuts().items().is_empty()) {
            Cuts::empty(all)
        } else {
            Cuts::compute(all, |k, out| {
                let start = out.len();
                each().for_each(|(image, map)| out.extend(map.cuts(image, k)));
                cut::normalize(out, start);
            })
        };
        let limits = images.iter().flat_map(|image| image.limits().iter().copied());
        // One image that cannot be probed makes a merge that cannot be.
        let makers: Option<Vec<Arc<dyn Probing>>> =
            images.iter().map(|image| image.probing().cloned()).collect();
        let again = makers.map(|all| {
            probing(move |probes| {
                let made = all.iter().map(|one| one.probed(probes)).collect::<Result<Vec<_>>>()?;
                SpanImage::merge(&made)
            })
        });
        let merged = frame.with_lines(lines, layers).with_cuts(cuts).with_limits(limits);
        Ok(merged.with_probing(again))
    }
}

/// Merges any number of lines, halves first, so that no line is copied more than log K times.
fn merge_lines(
    lines: &[Vec<Span>],
    cells: u32,
    on_line: &impl Fn(FaceId) -> OnLine,
    out: &mut Vec<Span>,
) {
    match lines {
        [] => out.push(Span { x: 0, face: FaceId::NONE }),
        [only] => out.extend_from_slice(only),
        [a, b] => line::merge(a, b, cells, on_line, out),
        _ => {
            let (front, back) = lines.split_at(lines.len() / 2);
            let (mut a, mut b) = (Vec::new(), Vec::new());
            merge_lines(front, cells, on_line, &mut a);
            merge_lines(back, cells, on_line, &mut b);
            line::merge(&a, &b, cells, on_line, out);
        }
    }
}

/// Where the faces of an image stand in the union: by source, the new id of its first face and, if its
/// table was united with another, the place of each.
#[derive(Debug)]
struct Places(Vec<(u32, Option<Vec<u32>>)>);

impl Places {
    /// Whether all faces of an image keep their ids.
    fn stay(&self, image: &SpanImage) -> bool {
        let places = self.0.iter().enumerate();
        places.into_iter().all(|(i, (base, table))| *base == image.id(i, 0).0 && table.is_none())
    }

    /// The new id of a face.
    fn of(&self, image: &SpanImage, face: FaceId) -> FaceId {
        let (source, place) = image.locate(face);
        let (base, table) = &self.0[source];
        FaceId(base + table.as_ref().map_or(place as u32, |table| table[place]))
    }

    fn line<'s>(&'s self, image: &'s SpanImage, k: u32) -> impl Iterator<Item = Span> + 's {
        image.lines().line(k).iter().map(|span| span.renamed(|face| self.of(image, face)))
    }

    fn layers<'s>(&'s self, image: &'s SpanImage, k: u32) -> impl Iterator<Item = Segment> + 's {
        let rename = |segment: &Segment| Segment { face: self.of(image, segment.face), ..*segment };
        image.layers().line(k).iter().map(rename)
    }

    fn cuts<'s>(&'s self, image: &'s SpanImage, k: u32) -> impl Iterator<Item = Cut> + 's {
        let rename = |cut: &Cut| Cut { face: self.of(image, cut.face), ..*cut };
        image.cuts().line(k).iter().map(rename)
    }
}
