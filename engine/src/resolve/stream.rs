//! The stream of fragments: covers in, pixels out.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::Range;

use super::Channel;
use super::coverage::{Cover, Coverage};
use super::rule::Framing;
use crate::fragment::{Columns, Fragments};
use crate::key::Key;
use crate::raster::Rows;
use crate::span::image::{Intensities, Paint};
use crate::span::{FaceId, Held, SpanImage};

/// Fragments shaded in one batch, about.
const BATCH: usize = 4096;

/// The channels of a run of rows, zero at first. Those that nobody asked for are empty.
#[derive(Debug, Default)]
pub(super) struct Pixels<'p> {
    pub(super) color: [&'p mut [f32]; 4],
    pub(super) z: &'p mut [f32],
    pub(super) normal: [&'p mut [f32]; 3],
    pub(super) position: [&'p mut [f32]; 3],
    pub(super) error: &'p mut [f32],
    pub(super) id: &'p mut [u32],
}

/// Shades the covers of rows and adds them up.
pub(super) struct Stream<'a> {
    image: &'a SpanImage,
    framing: &'a Framing,
    intensities: &'a Intensities,
    channels: &'a BTreeSet<Channel>,
    coverage: Coverage<'a>,
    /// By source: the fragments that wait to be shaded.
    waiting: Vec<Waiting<'a>>,
    /// By source: the fragments that lie over each other, to be shaded before they are blended.
    layered: Vec<Fragments<'a>>,
    blends: Vec<Blend>,
    members: Vec<Member>,
    covers: Vec<Cover>,
    /// Ids of objects by source and ordinal.
    objects: HashMap<(usize, u32), u32>,
}

struct Waiting<'a> {
    fragments: Fragments<'a>,
    /// The pixel that each fragment belongs to, and its share of it.
    pixels: Vec<(usize, f32)>,
}

/// A stack's share of a pixel.
struct Blend {
    pixel: usize,
    area: f32,
    /// Where its fragments stand in the list of members, from front to back.
    members: Range<usize>,
}

/// A fragment of a stack.
struct Member {
    point: Point,
    /// Its place in the batch of its source.
    source: usize,
    index: usize,
}

/// A point on a face.
#[derive(Clone, Copy)]
struct Point {
    face: FaceId,
    x: f64,
    y: f64,
}

impl<'a> Stream<'a> {
    pub(super) fn new(
        image: &'a SpanImage,
        framing: &'a Framing,
        intensities: &'a Intensities,
        channels: &'a BTreeSet<Channel>,
        coverage: Coverage<'a>,
    ) -> Stream<'a> {
        let waiting =
            |_: &_| Waiting { fragments: Fragments::new(image.view()), pixels: Vec::new() };
        let waiting = image.sources().iter().map(waiting).collect();
        let layered = image.sources().iter().map(|_| Fragments::new(image.view())).collect();
        Stream {
            image,
            framing,
            intensities,
            channels,
            coverage,
            waiting,
            layered,
            blends: Vec::new(),
            members: Vec::new(),
            covers: Vec::new(),
            objects: HashMap::new(),
        }
    }

    /// Computes the pixels of rows of the picture; returns what ids mean.
    pub(super) fn rows(&mut self, rows: Rows, mut pixels: Pixels<'_>) -> BTreeMap<u32, String> {
        let width = self.framing.columns.len();
        let wants_color = self.channels.contains(&Channel::Color);
        let wants_most =
            self.channels.iter().any(|c| !matches!(c, Channel::Color | Channel::Error));
        // Zero already, but written here: a fresh page that is read before it is written costs a fault
        // more and, with several threads, an interrupt of all processors. Measured: half of the time.
        pixels.color.iter_mut().for_each(|channel| channel.fill(0.0));
        let nothing = (0.0f32, Point { face: FaceId::NONE, x: 0.0, y: 0.0 });
        let mut most = vec![nothing; if wants_most { width * rows.len() } else { 0 }];
        for (i, row) in rows.enumerate() {
            let mut covers = std::mem::take(&mut self.covers);
            covers.clear();
            self.coverage.row(row, &mut covers);
            let first = i * width;
            if !pixels.error.is_empty() {
                pixels.error[first..first + width].copy_from_slice(self.coverage.errors());
            }
            for cover in &covers {
                if self.coverage.stack(cover.face).is_some() {
                    self.stack(cover, first);
                    continue;
                }
                if wants_color {
                    self.color(cover, first, &mut pixels);
                }
                if wants_most {
                    for pixel in cover.start..cover.end {
                        let at = first + (pixel - self.framing.columns.start) as usize;
                        if cover.area > most[at].0 {
                            most[at] = (cover.area, self.point(cover, pixel));
                        }
                    }
                }
            }
            self.covers = covers;
        }
        if wants_color {
            for source in 0..self.waiting.len() {
                self.shade(source, &mut pixels);
            }
        }
        self.blend(&mut pixels, &mut most);
        self.most(&most, &mut pixels)
    }

    /// The point of the raster at which a cover is shaded in one of its pixels.
    fn point(&self, cover: &Cover, pixel: u32) -> Point {
        let x = cover.x + f64::from(pixel - cover.start);
        Point { face: cover.face, x: (x - self.framing.pan.x) / self.framing.scale.x, y: cover.y }
    }

    /// Adds the colour of a cover, now if it is known, or when its batch is full.
    fn color(&mut self, cover: &Cover, first: usize, pixels: &mut Pixels<'_>) {
        if !cover.face.is_some() {
            return;
        }
        let start = first + (cover.start - self.framing.columns.start) as usize;
        let end = start + (cover.end - cover.start) as usize;
        if let Some(paint) = self.intensities.of(cover.face) {
            for at in start..end {
                add(pixels, at, paint, cover.area);
            }
            return;
        }
        let (source, place) = self.image.locate(cover.face);
        let face = &self.image.sources()[source].faces.faces()[place];
        for (pixel, at) in (cover.start..).zip(start..end) {
            let Point { x, y, .. } = self.point(cover, pixel);
            let waiting = &mut self.waiting[source];
            waiting.fragments.push(face.ordinal, face.sees_front, x, y, face.plane.depth(x, y));
            waiting.pixels.push((at, cover.area));
            if waiting.pixels.len() >= BATCH {
                self.shade(source, pixels);
            }
        }
    }

    fn shade(&mut self, source: usize, pixels: &mut Pixels<'_>) {
        let waiting = &mut self.waiting[source];
        let mut fragments =
            std::mem::replace(&mut waiting.fragments, Fragments::new(self.image.view()));
        self.image.sources()[source].shade(&mut fragments);
        let paints = fragments.color.into_iter().zip(fragments.alpha);
        for ((at, area), (color, alpha)) in waiting.pixels.drain(..).zip(paints) {
            add(pixels, at, Paint { color, alpha }, area);
        }
    }

    /// Adds the fragments of a cover whose faces lie over each other to their batches.
    fn stack(&mut self, cover: &Cover, first: usize) {
        for pixel in cover.start..cover.end {
            let Point { x, y, .. } = self.point(cover, pixel);
            let start = self.members.len();
            for face in self.coverage.stack(cover.face).unwrap_or(&[]) {
                let (source, place) = self.image.locate(*face);
                let known = &self.image.sources()[source].faces.faces()[place];
                let batch = &mut self.layered[source];
                let point = Point { face: *face, x, y };
                self.members.push(Member { point, source, index: batch.len() });
                batch.push(known.ordinal, known.sees_front, x, y, known.plane.depth(x, y));
            }
            let pixel = first + (pixel - self.framing.columns.start) as usize;
            let members = start..self.members.len();
            self.blends.push(Blend { pixel, area: cover.area, members });
        }
    }

    /// Shades what lies over each other and blends it, from front to back.
    fn blend(&mut self, pixels: &mut Pixels<'_>, most: &mut [(f32, Point)]) {
        if self.blends.is_empty() {
            return;
        }
        for (source, batch) in self.image.sources().iter().zip(&mut self.layered) {
            source.shade(batch);
        }
        // By matte, how much it lets past so far.
        let mut mattes: Vec<(Key, f32)> = Vec::new();
        for Blend { pixel, area, members } in self.blends.drain(..) {
            let members = &self.members[members];
            let mut through = 1.0;
            let mut solid = None;
            mattes.clear();
            for Member { point, source, index } in members {
                let known = &self.image.sources()[*source];
                let batch = &self.layered[*source];
                let (color, mut alpha) = (batch.color[*index], batch.alpha[*index]);
                if let Some(matte) = known.matte {
                    // It is not seen, but dims what it holds.
                    match mattes.iter_mut().find(|(by, _)| *by == matte) {
                        Some((_, past)) => *past *= 1.0 - alpha,
                        None => mattes.push((matte, 1.0 - alpha)),
                    }
                    continue;
                }
                for Held { by, inside } in &known.held {
                    let past = mattes.iter().find(|(matte, _)| matte == by).map_or(1.0, |m| m.1);
                    alpha *= if *inside { 1.0 - past } else { past };
                }
                if !pixels.color[0].is_empty() {
                    add(pixels, pixel, Paint { color, alpha }, area * through);
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
        self.members.clear();
        for batch in &mut self.layered {
            *batch = Fragments::new(self.image.view());
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
                *z = view.distance(depth) as f32;
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
        let id = *self.objects.entry((source, ordinal)).or_insert_with(|| {
            let name = known.object(ordinal);
            let bytes = Key::of_bytes(name.as_bytes()).to_bytes();
            u32::from_be_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]).max(1)
        });
        names.entry(id).or_insert_with(|| known.object(ordinal));
        id
    }
}

#[inline(always)]
fn add(pixels: &mut Pixels<'_>, at: usize, paint: Paint, area: f32) {
    let Paint { color, alpha } = paint;
    let [r, g, b, a] = &mut pixels.color;
    let weight = area * alpha;
    r[at] += color.r * weight;
    g[at] += color.g * weight;
    b[at] += color.b * weight;
    a[at] += weight;
}
