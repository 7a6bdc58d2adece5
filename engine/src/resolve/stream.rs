//! The stream of fragments: covers in, pixels out.
//!
//! Rows are taken in two steps. *Gathering* finds the fragments of a band of rows: what depends on spans,
//! rule and framing alone, and on which columns the stacks read. *Painting* shades them and adds them up.
//! What was gathered is kept with the image, and so is what shaders [keep](Batch::keep) of its batches: a
//! light that is dimmed finds both, and only sums are new.

mod ahead;
mod gather;

use glam::DVec2;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

use super::coverage::{Cover, Coverage};
use super::lit::Shadows;
use super::rule::{Framing, Rule};
use super::select::Selected;
use super::{Channel, Layer};
use crate::camera::Plane;
use crate::fragment::{
    Batch, Casting, Columns, FAR, Fragments, Kept, Layers, Painted, Piece, stack,
};
use crate::key::{Key, KeyHasher};
use crate::raster::Rows;
use crate::span::image::{Intensities, Paint};
use crate::span::{Held, SpanImage};
use crate::watch::Watch;
pub(super) use ahead::Ahead;
use gather::{Blend, Gathered, Group, Member, Point};

/// The channels of a run of rows, zero at first. Those that nobody asked for are empty.
#[derive(Debug, Default)]
pub(super) struct Pixels<'p> {
    pub(super) color: [&'p mut [f32]; 4],
    pub(super) z: &'p mut [f32],
    pub(super) normal: [&'p mut [f32]; 3],
    pub(super) position: [&'p mut [f32]; 3],
    pub(super) error: &'p mut [f32],
    pub(super) id: &'p mut [u32],
    /// Red, green and blue of each layer.
    pub(super) layers: Vec<&'p mut [f32]>,
    /// Which pixels were computed, if not all.
    pub(super) touched: &'p mut [bool],
}

/// Shades the covers of rows and adds them up.
pub(super) struct Stream<'a> {
    image: &'a SpanImage,
    framing: &'a Framing,
    intensities: &'a Intensities,
    channels: &'a BTreeSet<Channel>,
    coverage: Coverage<'a>,
    shadows: Shadows<'a>,
    /// What gathered fragments are kept by.
    key: Key,
    covers: Vec<Cover>,
    /// Ids of objects by source and ordinal.
    objects: HashMap<(usize, u32), u32>,
    /// The layers that are wanted.
    layers: &'a [Layer],
    /// What is computed, if not all.
    selected: Option<&'a Selected>,
    /// What shaders counted.
    counts: RefCell<BTreeMap<&'static str, u64>>,
    watch: Watch,
}

/// What rows tell beside their pixels.
#[derive(Debug, Default)]
pub(super) struct Told {
    /// What ids mean.
    pub(super) names: BTreeMap<u32, String>,
    /// What shaders counted.
    pub(super) counts: BTreeMap<&'static str, u64>,
}

/// Where a group of fragments stands in the stream.
struct Place<'s> {
    stream: &'s Stream<'s>,
    group: &'s Group,
    /// The band, and the group's number in it.
    part: u32,
    key: Key,
    /// What its pictures show, if that is known.
    painted: &'s [Painted],
}

impl Batch for Place<'_> {
    fn kept(&self, key: Key) -> Option<Kept> {
        self.stream.image.memo().get(self.key_of(key), self.part)
    }

    fn keep(&self, key: Key, value: Kept, bytes: usize, seconds: f64) {
        if !self.is_stopped() {
            self.stream.image.memo().put(self.key_of(key), self.part, value, bytes, seconds);
        }
    }

    fn is_stopped(&self) -> bool {
        self.stream.watch.is_stopped()
    }

    fn painted(&self) -> &[Painted] {
        self.painted
    }

    fn lit(&self, casting: &Casting<'_>) -> Option<Vec<f32>> {
        Some(self.stream.shadows.lit(&self.group.spots, casting))
    }

    fn count(&self, what: &'static str, number: u64) {
        *self.stream.counts.borrow_mut().entry(what).or_default() += number;
    }

    fn coverage(&self, fragment: usize) -> f32 {
        self.group.pixels[fragment].1
    }

    fn pieces(&self, fragment: usize) -> Vec<Piece> {
        let source = &self.stream.image.sources()[self.group.source];
        // Shaders work where faces were rendered, before every move of them.
        let (_, [right, down]) = stack::unmoved(&source.stack, &Plane::constant(1.0));
        let mut pieces = self.stream.shadows.pieces(&self.group.spots[fragment]);
        for piece in &mut pieces {
            piece.x = piece.x.map(|x| x - right);
            piece.y = piece.y.map(|y| y - down);
        }
        pieces
    }
}

impl Place<'_> {
    fn key_of(&self, key: Key) -> Key {
        let mut hasher = KeyHasher::new("channel");
        hasher.key(self.key).key(key);
        hasher.finish()
    }
}

impl<'a> Stream<'a> {
    pub(super) fn new(
        image: &'a SpanImage,
        rule: Rule,
        framing: &'a Framing,
        intensities: &'a Intensities,
        channels: &'a BTreeSet<Channel>,
        coverage: Coverage<'a>,
        watch: &Watch,
    ) -> Stream<'a> {
        let reads: Vec<Columns> = image.sources().iter().map(|source| source.reads()).collect();
        let mut key = KeyHasher::new("fragments");
        // All that gathering depends on beside the image, which the memo belongs to.
        key.value(&(rule, framing, &reads, channels));
        Stream {
            image,
            framing,
            intensities,
            channels,
            coverage,
            shadows: Shadows::new(image, rule, framing, watch),
            key: key.finish(),
            covers: Vec::new(),
            objects: HashMap::new(),
            layers: &[],
            selected: None,
            counts: RefCell::default(),
            watch: watch.clone(),
        }
    }

    /// The same with layers.
    pub(super) fn with_layers(self, layers: &'a [Layer]) -> Stream<'a> {
        Stream { layers, ..self }
    }

    /// The same, of pixels that show anything selected alone.
    pub(super) fn with_selected(self, selected: Option<&'a Selected>) -> Stream<'a> {
        let Some(selected) = selected else { return self };
        let mut key = KeyHasher::new("selected");
        key.key(self.key).bytes(selected.name.as_bytes());
        Stream { key: key.finish(), selected: Some(selected), ..self }
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
    ) -> Told {
        // Zero already, but written here: a fresh page that is read before it is written costs a fault
        // more and, with several threads, an interrupt of all processors. Measured: half of the time.
        pixels.color.iter_mut().for_each(|channel| channel.fill(0.0));
        pixels.layers.iter_mut().for_each(|channel| channel.fill(0.0));
        self.watch.step();
        if self.watch.is_stopped() {
            return Told::default();
        }
        let gathered = match ahead {
            Some(ahead) => ahead.gathered.clone(),
            None => self.gathered(band, &rows),
        };
        let painted = |group: usize| ahead.map_or(&[][..], |ahead| ahead.painted(group));
        self.shadows.forget_all_but(&rows);
        if !pixels.error.is_empty() {
            pixels.error.copy_from_slice(&gathered.errors);
        }
        gathered.touched.iter().for_each(|at| pixels.touched[*at as usize] = true);
        let mut most = gathered.most.clone();
        if self.wants_color() {
            // [N] eq. 2 with stored intensities: no shader runs.
            for (face, first, count, area) in &gathered.alike {
                let Some(paint) = self.intensities.of(*face) else { continue };
                (*first..first + count).for_each(|at| add(&mut pixels, at as usize, paint, *area));
            }
            for (number, group) in gathered.batches.iter().enumerate() {
                let fragments = self.shade(group, (band, number), painted(number));
                for (i, (at, area)) in group.pixels.iter().enumerate() {
                    let paint = Paint { color: fragments.color[i], alpha: fragments.alpha[i] };
                    add(&mut pixels, *at as usize, paint, *area);
                    self.add_layers(&mut pixels, *at as usize, &fragments, i, area * paint.alpha);
                }
            }
        }
        self.blend(&gathered, (band, &painted), &mut pixels, &mut most);
        let names = self.most(&most, &mut pixels);
        Told { names, counts: self.counts.take() }
    }

    fn wants_color(&self) -> bool {
        Channel::OF_COLOR.iter().any(|channel| self.channels.contains(channel))
    }

    /// A group of fragments as a batch.
    fn fragments(&self, group: &Group) -> Fragments<'a> {
        let [x, y, depth] = group.points.clone();
        let wants_lights = self.layers.iter().any(|layer| matches!(layer, Layer::Light(_)));
        Fragments {
            ordinal: group.ordinal.clone(),
            sees_front: group.sees_front.clone(),
            x,
            y,
            depth,
            layers: wants_lights.then(Layers::default),
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
        let place = Place { stream: self, group, part, key: key.finish(), painted };
        self.image.sources()[group.source].shade(&mut fragments, &place);
        fragments
    }

    /// Adds the layers of a fragment to a pixel.
    fn add_layers(
        &self,
        pixels: &mut Pixels<'_>,
        at: usize,
        fragments: &Fragments<'_>,
        i: usize,
        weight: f32,
    ) {
        let layers = fragments.layers.as_ref();
        for (first, layer) in self.layers.iter().enumerate() {
            let values = match layer {
                Layer::Light(name) => layers.and_then(|layers| layers.get(name)),
                Layer::Made(name, _) => fragments.channels.get(name).map(Vec::as_slice),
            };
            let Some(values) = values else { continue };
            for (axis, value) in values[i].to_array().into_iter().enumerate() {
                pixels.layers[3 * first + axis][at] += value * weight;
            }
        }
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
                let (color, mut alpha) = (batch.color[*index], batch.alpha[*index]);
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
                if self.wants_color() {
                    add(pixels, pixel, Paint { color, alpha }, area * through);
                    self.add_layers(pixels, pixel, batch, *index, area * through * alpha);
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

    /// The channels that are those of the face which covers most of a pixel; returns what ids mean.
    fn most(&mut self, most: &[(f32, Point)], pixels: &mut Pixels<'_>) -> BTreeMap<u32, String> {
        let view = self.image.view();
        let mut names = BTreeMap::new();
        let mut batches: Vec<(Fragments<'a>, Vec<usize>)> =
            self.image.sources().iter().map(|_| (Fragments::new(view), Vec::new())).collect();
        for (at, (_, point)) in most.iter().enumerate() {
            let Point { face, x, y } = *point;
            if !face.is_some() {
                pixels.z.get_mut(at).into_iter().for_each(|z| *z = f32::INFINITY);
                continue;
            }
            let (source, place) = self.image.locate(face);
            let face = &self.image.sources()[source].faces.faces()[place];
            let depth = face.plane.depth(x, y);
            if let Some(z) = pixels.z.get_mut(at) {
                // A backdrop without a distance of its own is background.
                let distance = view.distance(depth);
                let surfaces = &self.image.sources()[source].surfaces;
                let is_beyond = distance > 0.999 * FAR && surfaces.beyond().is_some();
                *z = if is_beyond { f32::INFINITY } else { distance as f32 };
            }
            let p = view.world_point(x, y, depth).to_array();
            for (axis, value) in pixels.position.iter_mut().zip(p) {
                axis.get_mut(at).into_iter().for_each(|p| *p = value as f32);
            }
            if !pixels.id.is_empty() {
                pixels.id[at] = self.object(source, face.ordinal, &mut names);
            }
            batches[source].0.push(face.ordinal, face.sees_front, x, y, depth);
            batches[source].1.push(at);
        }
        if !pixels.normal[0].is_empty() {
            for (source, (mut fragments, places)) in batches.into_iter().enumerate() {
                self.image.sources()[source].fill(Columns::NORMAL, &mut fragments);
                for (at, normal) in places.into_iter().zip(fragments.normal) {
                    for (axis, value) in pixels.normal.iter_mut().zip(normal.to_array()) {
                        axis[at] = value;
                    }
                }
            }
        }
        names
    }

    /// The id of the object that a face belongs to: a hash of its name, the same in every frame.
    fn object(&mut self, source: usize, ordinal: u32, names: &mut BTreeMap<u32, String>) -> u32 {
        let known = &self.image.sources()[source];
        let id = *self
            .objects
            .entry((source, ordinal))
            .or_insert_with(|| Key::id_of_name(&known.object(ordinal)));
        names.entry(id).or_insert_with(|| known.object(ordinal));
        id
    }
}

#[inline(always)]
fn add(pixels: &mut Pixels<'_>, at: usize, paint: Paint, area: f32) {
    let Paint { color, alpha } = paint;
    let [r, g, b, a] = &mut pixels.color;
    if r.is_empty() {
        return;
    }
    let weight = area * alpha;
    r[at] += color.r * weight;
    g[at] += color.g * weight;
    b[at] += color.b * weight;
    a[at] += weight;
}
