//! The painter: covers in, pixels out.
//!
//! Rows are taken in two steps. *Gathering* finds the fragments of a band of rows: what depends on spans,
//! rule and framing alone, and on which columns the stacks read. *Painting* shades them and adds them up.
//! What was gathered is kept with the image, and so is what shaders [keep](Batch::keep) of its batches: a
//! light that is dimmed finds both, and only sums are new.

mod ahead;
mod gather;

use glam::DVec2;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use super::channel::{Maker, Most, Needs, Point, Values};
use super::coverage::{Cover, Coverage};
use super::lit::BandShadows;
use super::rule::{Framing, Rule};
use super::select::Selected;
use crate::camera::Plane;
use crate::fragment::{
    Batch, Casting, Columns, Fragments, Kept, LightLayers, LinePiece, Painted, stack,
};
use crate::image::Samples;
use crate::key::{Key, KeyHasher};
use crate::raster::Rows;
use crate::span::image::Intensities;
use crate::span::{Held, SpanImage};
use crate::watch::Watch;
pub(super) use ahead::Ahead;
use gather::{Blend, Gathered, Group, Member};

/// A run of rows of a picture.
#[derive(Default)]
pub(super) struct Pixels<'p> {
    /// By maker of channels.
    pub(super) values: Vec<Values<'p>>,
    /// Which pixels were computed, if not all.
    pub(super) touched: &'p mut [bool],
}

impl Pixels<'_> {
    /// Of so many makers, without values.
    pub(super) fn of(makers: usize) -> Self {
        Pixels { values: (0..makers).map(|_| Values::default()).collect(), touched: &mut [] }
    }

    /// Takes the values of another picture, from a pixel of it on.
    pub(super) fn take(self, of: &[Vec<(String, Samples)>], from: usize) {
        for (values, of) in self.values.into_iter().zip(of) {
            let (mut ids, mut floats) = (values.ids.into_iter(), values.floats.into_iter());
            for (_, samples) in of {
                match samples {
                    Samples::Id(known) => ids.by_ref().take(1).for_each(|ids| {
                        ids.copy_from_slice(&known[from..from + ids.len()]);
                    }),
                    Samples::Float(known) => floats.by_ref().take(1).for_each(|floats| {
                        floats.copy_from_slice(&known[from..from + floats.len()]);
                    }),
                    Samples::FromFile(_) => {}
                }
            }
        }
    }
}

/// Shades the covers of rows and adds them up.
pub(super) struct Painter<'a> {
    image: &'a SpanImage,
    framing: &'a Framing,
    intensities: &'a Intensities,
    needs: Needs,
    coverage: Coverage<'a>,
    shadows: BandShadows<'a>,
    /// What gathered fragments are kept by.
    key: Key,
    covers: Vec<Cover>,
    /// Ids of objects by source and ordinal.
    objects: HashMap<(usize, u32), u32>,
    makers: &'a [Box<dyn Maker>],
    /// What is computed, if not all.
    selected: Option<&'a Selected>,
    watch: Watch,
}

/// What ids mean.
pub(super) type IdNames = BTreeMap<u32, String>;

/// Where a group of fragments stands in the picture.
struct GroupPlace<'s> {
    painter: &'s Painter<'s>,
    group: &'s Group,
    /// The band, and the group's number in it.
    part: u32,
    key: Key,
    /// What its pictures show, if that is known.
    painted: &'s [Painted],
}

impl Batch for GroupPlace<'_> {
    fn kept(&self, key: Key) -> Option<Kept> {
        self.painter.image.memo().get(self.key_of(key), self.part)
    }

    fn keep(&self, key: Key, value: Kept, bytes: usize, seconds: f64) {
        if !self.is_stopped() {
            self.painter.image.memo().put(self.key_of(key), self.part, value, bytes, seconds);
        }
    }

    fn is_stopped(&self) -> bool {
        self.painter.watch.is_stopped()
    }

    fn painted(&self) -> &[Painted] {
        self.painted
    }

    fn lit(&self, casting: &Casting<'_>) -> Option<Vec<f32>> {
        Some(self.painter.shadows.lit(&self.group.spots, casting))
    }

    fn count(&self, what: &'static str, number: u64) {
        self.painter.watch.count(what, number);
    }

    fn coverage(&self, fragment: usize) -> f32 {
        self.group.pixels[fragment].1
    }

    fn pieces(&self, fragment: usize) -> Vec<LinePiece> {
        let source = &self.painter.image.sources()[self.group.source];
        // Shaders work where faces were rendered, before every move of them.
        let (_, [right, down]) = stack::unmoved(&source.stack, &Plane::constant(1.0));
        let mut pieces = self.painter.shadows.pieces(&self.group.spots[fragment]);
        for piece in &mut pieces {
            piece.x = piece.x.map(|x| x - right);
            piece.y = piece.y.map(|y| y - down);
        }
        pieces
    }
}

impl GroupPlace<'_> {
    fn key_of(&self, key: Key) -> Key {
        let mut hasher = KeyHasher::new("channel");
        hasher.key(self.key).key(key);
        hasher.finish()
    }
}

impl<'a> Painter<'a> {
    pub(super) fn new(
        image: &'a SpanImage,
        rule: Rule,
        framing: &'a Framing,
        intensities: &'a Intensities,
        needs: Needs,
        coverage: Coverage<'a>,
        watch: &Watch,
    ) -> Painter<'a> {
        let reads: Vec<Columns> = image.sources().iter().map(|source| source.reads()).collect();
        let mut key = KeyHasher::new("fragments");
        // All that gathering depends on beside the image, which the memo belongs to.
        key.value(&(rule, framing, &reads, needs));
        Painter {
            image,
            framing,
            intensities,
            needs,
            coverage,
            shadows: BandShadows::new(image, rule, framing, watch),
            key: key.finish(),
            covers: Vec::new(),
            objects: HashMap::new(),
            makers: &[],
            selected: None,
            watch: watch.clone(),
        }
    }

    /// The same with what makes its channels.
    pub(super) fn with_makers(self, makers: &'a [Box<dyn Maker>]) -> Painter<'a> {
        Painter { makers, ..self }
    }

    /// The same, of pixels that show anything selected alone.
    pub(super) fn with_selected(self, selected: Option<&'a Selected>) -> Painter<'a> {
        let Some(selected) = selected else { return self };
        let mut key = KeyHasher::new("selected");
        key.key(self.key).bytes(selected.name.as_bytes());
        Painter { key: key.finish(), selected: Some(selected), ..self }
    }

    /// The fragments of rows of the picture, band `band`.
    fn gathered(&mut self, band: u32, rows: &Rows) -> Arc<Gathered> {
        let (image, watch) = (self.image, self.watch.clone());
        image.memo().or_made((self.key, band), &watch, || {
            let gathered = self.gather(rows);
            let bytes = gathered.bytes();
            (gathered, bytes)
        })
    }

    /// Computes the pixels of rows of the picture, band `band`.
    pub(super) fn rows(
        &mut self,
        band: u32,
        rows: Rows,
        ahead: Option<&Ahead>,
        mut pixels: Pixels<'_>,
    ) -> IdNames {
        pixels.values.iter_mut().for_each(Values::clear);
        self.watch.step();
        if self.watch.is_stopped() {
            return IdNames::default();
        }
        let gathered = match ahead {
            Some(ahead) => ahead.gathered.clone(),
            None => self.gathered(band, &rows),
        };
        let painted = |group: usize| ahead.map_or(&[][..], |ahead| ahead.painted(group));
        self.shadows.forget_all_but(&rows);
        gathered.touched.iter().for_each(|at| pixels.touched[*at as usize] = true);
        let mut most = gathered.most.clone();
        let makers = || self.makers.iter();
        if self.needs.shaded {
            for (face, first, count, area) in &gathered.alike {
                let Some(paint) = self.intensities.of(*face) else { continue };
                let run = *first as usize..(first + count) as usize;
                for (maker, to) in makers().zip(&mut pixels.values) {
                    maker.alike(to, run.clone(), paint, *area);
                }
            }
            for (number, group) in gathered.batches.iter().enumerate() {
                let fragments = self.shade(group, (band, number), painted(number));
                for (maker, to) in makers().zip(&mut pixels.values) {
                    maker.batch(to, &group.pixels, &fragments);
                }
            }
        }
        self.blend(&gathered, (band, &painted), &mut pixels, &mut most);
        let points = most.iter().map(|(_, point)| *point);
        let mut most = Most::of(self.image, points, &mut self.objects);
        for (maker, to) in self.makers.iter().zip(&mut pixels.values) {
            maker.most(to, &mut most);
            maker.estimates(to, &gathered.errors);
        }
        most.names
    }

    /// A group of fragments as a batch.
    fn fragments(&self, group: &Group) -> Fragments<'a> {
        let [x, y, depth] = group.points.clone();
        Fragments {
            ordinal: group.ordinal.clone(),
            sees_front: group.sees_front.clone(),
            x,
            y,
            depth,
            layers: self.needs.lights.then(LightLayers::default),
            pixel: DVec2::ONE / self.framing.scale,
            textures: self.framing.textures,
            ..Fragments::new(self.image.view())
        }
    }

    /// Shades a group of fragments, given its band and number.
    fn shade(
        &self,
        group: &Group,
        (part, number): (u32, usize),
        painted: &[Painted],
    ) -> Fragments<'a> {
        let mut fragments = self.fragments(group);
        let mut key = KeyHasher::new("batch");
        key.key(self.key).bytes(&(number as u64).to_le_bytes());
        let place = GroupPlace { painter: self, group, part, key: key.finish(), painted };
        self.image.sources()[group.source].shade(&mut fragments, &place);
        fragments
    }

    /// Shades what lies over each other and blends it, from front to back.
    fn blend<'p>(
        &self,
        gathered: &Gathered,
        (band, painted): (u32, &dyn Fn(usize) -> &'p [Painted]),
        pixels: &mut Pixels<'_>,
        most: &mut [(f32, Point)],
    ) {
        if gathered.blends.is_empty() {
            return;
        }
        let first = gathered.batches.len();
        // Shaded before any is blended: a face is one fragment of a pixel, in however many stacks
        // it lies.
        let layered: Vec<Fragments<'_>> = gathered
            .layered
            .iter()
            .enumerate()
            .map(|(n, group)| self.shade(group, (band, first + n), painted(first + n)))
            .collect();
        // By matte, how much it lets past so far.
        let mut mattes: Vec<(Key, f32)> = Vec::new();
        for Blend { pixel, area, members } in &gathered.blends {
            let (pixel, area) = (*pixel, *area);
            let mut through = 1.0;
            let mut solid = None;
            mattes.clear();
            for Member { point, source, index } in &gathered.members[members.clone()] {
                let known = &self.image.sources()[*source];
                let batch = &layered[*source];
                let mut alpha = batch.alpha[*index];
                if let Some(matte) = known.matte {
                    // It is not seen, but dims what it holds.
                    match mattes.iter_mut().find(|(by, _)| *by == matte) {
                        Some((_, past)) => *past *= 1.0 - alpha,
                        None => mattes.push((matte, 1.0 - alpha)),
                    }
                    continue;
                }
                // Members come from front to back, so only mattes that lie before this one were
                // counted.
                for Held { by, inside } in &known.held {
                    let past = mattes.iter().find(|(matte, _)| matte == by).map_or(1.0, |m| m.1);
                    alpha *= if *inside { 1.0 - past } else { past };
                }
                if self.needs.shaded {
                    let weight = area * through * alpha;
                    for (maker, to) in self.makers.iter().zip(&mut pixels.values) {
                        maker.fragment(to, pixel, batch, *index, weight);
                    }
                }
                through *= 1.0 - alpha;
                // What other channels show: the nearest through which less than half is seen.
                solid = solid.or((through < 0.5).then_some(*point));
            }
            if let Some(most) = most.get_mut(pixel).filter(|most| area > most.0)
                && let Some(point) = solid
            {
                *most = (area, point);
            }
        }
    }
}
