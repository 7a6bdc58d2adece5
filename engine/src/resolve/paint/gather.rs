//! Which fragments the rows of a picture have, before any is shaded.

use std::collections::HashMap;
use std::ops::Range;

use super::Painter;
use crate::raster::Rows;
use crate::resolve::channel::Point;
use crate::resolve::coverage::Cover;
use crate::resolve::lit::Spot;
use crate::resolve::rule::Rate;
use crate::span::{FaceId, SpanImage};

/// Fragments shaded in one batch, about.
const BATCH: usize = 4096;

/// By pixel and face, the place among fragments of those that lie over each other, and the areas so far, whatever their
/// sign: a face is shaded once in a pixel, however many stacks there it is in.
type Laid = HashMap<(usize, FaceId), (usize, f32)>;

/// The fragments of a band of rows.
#[derive(Debug, Default)]
pub(super) struct Gathered {
    /// Faces that are shaded alike all over: first pixel, number of pixels, and their share of each.
    pub(super) alike: Vec<(FaceId, u32, u32, f32)>,
    pub(super) batches: Vec<Group>,
    /// By source: the fragments that lie over each other, to be shaded before they are blended.
    pub(super) layered: Vec<Group>,
    pub(super) blends: Vec<Blend>,
    pub(super) members: Vec<Member>,
    /// By pixel, the share and the place of the face that covers most of it, if anything wants to know.
    pub(super) most: Vec<(f32, Point)>,
    pub(super) errors: Vec<f32>,
    /// The pixels that show anything selected.
    pub(super) touched: Vec<u32>,
}

/// Fragments of one source.
#[derive(Debug, Default)]
pub(super) struct Group {
    pub(super) source: usize,
    pub(super) ordinal: Vec<u32>,
    pub(super) sees_front: Vec<bool>,
    /// x, y and depth.
    pub(super) points: [Vec<f64>; 3],
    pub(super) spots: Vec<Spot>,
    /// The pixel that each fragment belongs to, and its share of it.
    pub(super) pixels: Vec<(u32, f32)>,
}

/// A stack's share of a pixel.
#[derive(Debug)]
pub(super) struct Blend {
    pub(super) pixel: usize,
    pub(super) area: f32,
    /// Where its fragments stand in the list of members, from front to back.
    pub(super) members: Range<usize>,
}

/// A fragment of a stack.
#[derive(Debug)]
pub(super) struct Member {
    pub(super) point: Point,
    /// Its place in the group of its source.
    pub(super) source: usize,
    pub(super) index: usize,
}

impl Painter<'_> {
    /// Finds the fragments of rows.
    pub(super) fn gather(&mut self, rows: &Rows) -> Gathered {
        let width = self.framing.columns.len();
        let nothing = (0.0f32, Point { face: FaceId::NONE, x: 0.0, y: 0.0 });
        let sources = self.image.sources().len();
        let group = |source| Group { source, ..Group::default() };
        let mut gathered = Gathered {
            layered: (0..sources).map(group).collect(),
            most: vec![nothing; if self.needs.most { width * rows.len() } else { 0 }],
            ..Gathered::default()
        };
        let mut open: Vec<Group> = (0..sources).map(group).collect();
        let mut laid = Laid::new();
        for (i, row) in rows.clone().enumerate() {
            if self.watch.is_stopped() {
                break;
            }
            let mut covers = std::mem::take(&mut self.covers);
            covers.clear();
            self.coverage.row(row, &mut covers);
            let first = i * width;
            if self.needs.estimates {
                gathered.errors.extend_from_slice(self.coverage.errors());
            }
            if let Some(selected) = self.selected {
                let columns = &self.framing.columns;
                let mut touched = vec![false; width];
                selected.keep(&mut covers, row, columns, &self.coverage, &mut touched);
                let places = (first as u32..).zip(&touched).filter(|(_, is_touched)| **is_touched);
                gathered.touched.extend(places.map(|(at, _)| at));
            }
            laid.clear();
            for cover in &covers {
                let start = first + (cover.start - self.framing.columns.start) as usize;
                if self.coverage.stack(cover.face).is_some() {
                    self.stack(cover, row, start, &mut laid, &mut gathered);
                    continue;
                }
                if self.needs.shaded && cover.face.is_some() {
                    self.color(cover, row, start, &mut open, &mut gathered);
                }
                if self.needs.most {
                    for (pixel, at) in (cover.start..cover.end).zip(start..) {
                        if cover.area > gathered.most[at].0 {
                            gathered.most[at] = (cover.area, self.point(cover, pixel));
                        }
                    }
                }
            }
            self.covers = covers;
        }
        gathered.batches.extend(open.into_iter().filter(|group| !group.ordinal.is_empty()));
        gathered
    }

    /// The point of the raster at which a cover is shaded in one of its pixels.
    fn point(&self, cover: &Cover, pixel: u32) -> Point {
        let x = cover.x + f64::from(pixel - cover.start);
        Point { face: cover.face, x: (x - self.framing.pan.x) / self.framing.scale.x, y: cover.y }
    }

    /// Adds the pixels of a cover to what is alike all over, or to the batch of its source.
    fn color(
        &self,
        cover: &Cover,
        row: u32,
        start: usize,
        open: &mut [Group],
        gathered: &mut Gathered,
    ) {
        if self.intensities.of(cover.face).is_some() {
            let count = cover.end - cover.start;
            gathered.alike.push((cover.face, start as u32, count, cover.area));
            return;
        }
        let (source, _) = self.image.locate(cover.face);
        let group = &mut open[source];
        for (pixel, at) in (cover.start..cover.end).zip(start..) {
            let point = self.point(cover, pixel);
            let is_whole = cover.area == 1.0;
            if self.framing.shading == Rate::Line {
                let lines =
                    self.shadows.by_line(&Spot { row, column: pixel, face: cover.face, is_whole });
                let all: f64 = lines.iter().map(|(_, weight)| weight).sum();
                for ([x, y], weight) in &lines {
                    group.push(self.image, Point { x: *x, y: *y, ..point }, row, pixel, is_whole);
                    group.pixels.push((at as u32, cover.area * (weight / all) as f32));
                }
                // By its slopes a face may reach into a pixel where no line meets it.
                if lines.is_empty() {
                    group.push(self.image, point, row, pixel, is_whole);
                    group.pixels.push((at as u32, cover.area));
                }
            } else {
                group.push(self.image, point, row, pixel, is_whole);
                group.pixels.push((at as u32, cover.area));
            }
            if group.pixels.len() >= BATCH {
                let full = std::mem::replace(group, Group { source, ..Group::default() });
                gathered.batches.push(full);
            }
        }
    }

    /// Adds the fragments of a cover whose faces lie over each other to the groups of their sources.
    fn stack(
        &self,
        cover: &Cover,
        row: u32,
        start: usize,
        laid: &mut Laid,
        gathered: &mut Gathered,
    ) {
        let area = cover.area;
        for (column, pixel) in (cover.start..cover.end).zip(start..) {
            let at = self.point(cover, column);
            let first = gathered.members.len();
            for face in self.coverage.stack(cover.face).unwrap_or(&[]) {
                let (source, _) = self.image.locate(*face);
                let group = &mut gathered.layered[source];
                let point = Point { face: *face, ..at };
                let known = laid.entry((pixel, *face)).or_insert((group.ordinal.len(), 0.0));
                known.1 += area.abs();
                let (index, all) = *known;
                gathered.members.push(Member { point, source, index });
                if index < group.ordinal.len() {
                    group.widen(self.image, index, point, (area, all));
                } else {
                    group.push(self.image, point, row, column, area == 1.0);
                    group.pixels.push((pixel as u32, area));
                }
            }
            let members = first..gathered.members.len();
            gathered.blends.push(Blend { pixel, area, members });
        }
    }
}

impl Gathered {
    /// All groups, by their numbers.
    pub(super) fn groups(&self) -> impl Iterator<Item = &Group> {
        self.batches.iter().chain(&self.layered)
    }

    pub(super) fn bytes(&self) -> usize {
        let of_groups: usize = self.groups().map(Group::bytes).sum();
        of_groups
            + size_of_val(&*self.alike)
            + size_of_val(&*self.blends)
            + size_of_val(&*self.members)
            + size_of_val(&*self.most)
            + size_of_val(&*self.errors)
            + size_of_val(&*self.touched)
    }
}

impl Group {
    fn bytes(&self) -> usize {
        size_of_val(&*self.ordinal)
            + size_of_val(&*self.sees_front)
            + self.points.iter().map(|column| size_of_val(&**column)).sum::<usize>()
            + size_of_val(&*self.spots)
            + size_of_val(&*self.pixels)
    }

    /// Adds an area at a point to what a fragment covers: it is shaded in the middle of all. Filters have areas below
    /// 0; they draw it as those above do.
    fn widen(&mut self, image: &SpanImage, index: usize, point: Point, (area, all): (f32, f32)) {
        let (_, face) = image.face(point.face);
        self.pixels[index].1 += area;
        let share = if all > 0.0 { f64::from(area.abs() / all) } else { 0.0 };
        let place = [point.x, point.y, face.plane.depth(point.x, point.y)];
        for (column, value) in self.points.iter_mut().zip(place) {
            column[index] += (value - column[index]) * share;
        }
    }

    fn push(&mut self, image: &SpanImage, point: Point, row: u32, column: u32, is_whole: bool) {
        let (_, face) = image.face(point.face);
        self.ordinal.push(face.ordinal);
        self.sees_front.push(face.sees_front);
        let place = [point.x, point.y, face.plane.depth(point.x, point.y)];
        self.points.iter_mut().zip(place).for_each(|(column, value)| column.push(value));
        self.spots.push(Spot { row, column, face: point.face, is_whole });
    }
}
