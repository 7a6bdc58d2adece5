//! Rays for the whole picture (\[D], "High-quality image display").
//!
//! Rays go from the eye through points of every line, by the tree or by \[D]'s voxels, and **only nominate**: a face is
//! nominated that a ray meets first, or meets before what hides the rest. Among the nominated faces visibility is solved
//! as everywhere, so that edges and seams are exact, and the image is spans as all others are. It is that of the
//! [scan line](super::scanline), bit for bit, but for faces that no ray met.
//!
//! Drawn edges are nominated always. How much is hidden by what no ray met is [estimated](Missed) by more rays at random
//! places: the share of them that meets a face that was not nominated. What they find is nominated too, and others look
//! again, a few times. So the last estimate is an upper bound.
//!
//! Without refinement each ray's answer stands for its share of its line: plain samples. Lines that are asked for later,
//! where a rule is in doubt, are solved among all faces in either case.

use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::camera::View;
use crate::error::{Error, Result};
use crate::fragment::RayTarget;
use crate::span::{Face, FaceId, Layers, Lines, Role, Segment, Span, SpanImage, layer};
use crate::trace::{Accelerator, Finder, Ray};
use crate::visible;
use crate::watch::Watch;

/// How rays are cast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayOptions {
    /// Rays through each pixel on every line, 1 to 64.
    pub rays: u32,
    /// How they find what they meet.
    pub accelerator: Accelerator,
    /// Whether visibility is solved among what they meet. If not, they are samples.
    pub refine: bool,
}

impl Default for RayOptions {
    fn default() -> RayOptions {
        RayOptions { rays: 1, accelerator: Accelerator::Tree, refine: true }
    }
}

/// What rays miss, by other rays.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Missed {
    /// Rays that were cast to see what is missed.
    pub tested: u64,
    /// Those of them that met a face that no ray had met before.
    pub missed: u64,
}

impl Missed {
    /// The share of the picture in which faces are seen that no ray met: at least and at most, by two standard errors
    /// (Wilson's interval).
    pub fn share(&self) -> Range<f64> {
        if self.tested == 0 {
            return 0.0..1.0;
        }
        let (n, z) = (self.tested as f64, 2.0);
        let p = self.missed as f64 / n;
        let middle = p + z * z / (2.0 * n);
        let width = z * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        let all = 1.0 + z * z / n;
        ((middle - width) / all).max(0.0)..(middle + width) / all
    }
}

/// Solves a frame of one scene by rays.
///
/// # Errors
/// If the work is stopped, or the frame is not one of one scene.
pub fn solve(frame: &SpanImage, options: &RayOptions) -> Result<(SpanImage, Missed)> {
    let [source] = frame.sources() else {
        return Err(Error::invalid("rays are cast into one scene at a time"));
    };
    let target = source.surfaces.rays();
    let target = target.ok_or_else(|| Error::invalid("a scene whose faces rays do not meet"))?;
    let rays = Rays::new(frame, target, options);
    let missed = rays.cast()?;
    let image = visible::solve_among(frame.clone(), &rays.nominated());
    Ok((if options.refine { image } else { sampled(&image, options.rays) }, missed))
}

/// Faces coincide whose ways along a ray differ by less than this share.
const COINCIDES: f64 = 1e-9;

/// How often rays look for what others missed, and the share of them that may find some.
const ROUNDS: u32 = 4;
const ENOUGH: f64 = 2e-4;

/// At least so many rays look for what others missed.
const LEAST_TESTS: u32 = 16_384;

/// Where on its share of a line a ray goes, in [0, 1): another place on each line of a row.
fn place(line: u32) -> f64 {
    // Van der Corput's sequence, from the middle on.
    f64::from((line + 1).reverse_bits()) / 4_294_967_296.0
}

struct Rays<'f> {
    frame: &'f SpanImage,
    finder: Finder<'f>,
    options: &'f RayOptions,
    /// By piece: the places in the table of its face and of what lies on it; none where the face is not in the frame.
    places: Vec<Range<u32>>,
    /// By piece: whether something is seen through it.
    is_translucent: Vec<bool>,
    /// By place in the table.
    is_nominated: Vec<AtomicBool>,
    /// Where parallel rays begin, before everything.
    start: f64,
}

impl<'f> Rays<'f> {
    fn new(frame: &'f SpanImage, target: &'f dyn RayTarget, options: &'f RayOptions) -> Rays<'f> {
        let casters = target.casters();
        let faces = frame.sources()[0].faces.faces();
        let place = |ordinal: u32| {
            let start = faces.partition_point(|face| face.ordinal < ordinal);
            let is_there = faces.get(start).is_some_and(|face| face.ordinal == ordinal);
            let on_it = faces[start..].iter().skip(1).take_while(|face| face.role != Role::Face);
            let end = if is_there { start + 1 + on_it.count() } else { start };
            start as u32..end as u32
        };
        let places: Vec<Range<u32>> =
            casters.pieces().par_iter().map(|piece| place(piece.face)).collect();
        let seen_through = |places: &Range<u32>| {
            let parts = &faces[places.start as usize..places.end as usize];
            parts.iter().any(|face| face.is_translucent)
        };
        let is_translucent = places.iter().map(seen_through).collect();
        // Drawn edges have a width on the screen and none in the world: no ray meets them.
        let is_edge = |face: &Face| AtomicBool::new(face.role == Role::Stroke);
        let is_nominated = faces.iter().map(is_edge).collect();
        let view = frame.view();
        let back = view.world_direction(DVec3::Z);
        let start = casters.bounds().map_or(0.0, |[low, high]| {
            let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0);
            let reach = (middle - view.camera().position).dot(back) + half.dot(back.abs());
            reach.max(0.0) + 1.0
        });
        let finder = casters.finder(&options.accelerator);
        Rays { frame, finder, options, places, is_translucent, is_nominated, start }
    }

    /// Casts all rays; returns what they missed.
    fn cast(&self) -> Result<Missed> {
        let (watch, raster) = (Watch::current(), self.frame.view().raster());
        let lines = self.frame.lines().range();
        let across = raster.width * self.options.rays;
        watch.begin(lines.len());
        lines.clone().into_par_iter().try_for_each(|k| {
            watch.check()?;
            let at = place(k);
            for number in 0..across {
                let x = (f64::from(number) + at) / f64::from(self.options.rays);
                self.through(x, self.frame.y(k), |place| self.nominate(place));
            }
            watch.step();
            watch.count("rays", u64::from(across));
            Ok::<(), Error>(())
        })?;
        // Others look for what these missed, until it is little or they do not find enough of it.
        let mut missed = self.missed(0)?;
        for round in 1..ROUNDS {
            if missed.missed as f64 <= ENOUGH * missed.tested as f64 {
                break;
            }
            missed = self.missed(round)?;
        }
        Ok(missed)
    }

    /// Casts an eighth as many rays at places of no pattern. They find each on its own: what one of them nominates is
    /// missed by all.
    fn missed(&self, round: u32) -> Result<Missed> {
        let (watch, raster) = (Watch::current(), self.frame.view().raster());
        let lines = self.frame.lines().range();
        let share = raster.width * self.options.rays / 8;
        let tests = share.max(LEAST_TESTS.div_ceil(lines.len().max(1) as u32));
        let [top, bottom] = {
            let rows = self.frame.rows();
            [rows.start, rows.end].map(f64::from)
        };
        let found: Vec<(u64, Vec<u32>)> = lines
            .into_par_iter()
            .map(|k| {
                watch.check()?;
                let (mut missed, mut new) = (0, Vec::new());
                for number in 0..tests {
                    let [u, v] = chance(k, round * tests + number);
                    let before = new.len();
                    let (x, y) = (u * f64::from(raster.width), top + v * (bottom - top));
                    self.through(x, y, |place| {
                        if !self.is_nominated[place as usize].load(Ordering::Relaxed) {
                            new.push(place);
                        }
                    });
                    missed += u64::from(new.len() > before);
                }
                Ok((missed, new))
            })
            .collect::<Result<_>>()?;
        let tested = u64::from(tests) * found.len() as u64;
        watch.count("rays", tested);
        for (_, new) in &found {
            new.iter().for_each(|place| self.nominate(*place));
        }
        Ok(Missed { tested, missed: found.iter().map(|(missed, _)| missed).sum() })
    }

    fn nominate(&self, place: u32) {
        let is_nominated = &self.is_nominated[place as usize];
        // A write would take the line of the cache from the other threads.
        if !is_nominated.load(Ordering::Relaxed) {
            is_nominated.store(true, Ordering::Relaxed);
        }
    }

    /// Tells the places of what is seen at (x, y) pixels: the nearest that hides the rest, what coincides with it, and all
    /// before it.
    fn through(&self, x: f64, y: f64, mut seen: impl FnMut(u32)) {
        let view = self.frame.view();
        let (origin, direction, before) = self.ray(view, x, y);
        let (nearest, farthest) = view.depth_range();
        let ray = Ray::new(origin, direction, f64::INFINITY);
        let is_within = |t: f64| {
            let depth = view.depth(t - before);
            depth <= nearest && depth >= farthest
        };
        let mut met: Vec<(f64, usize)> = Vec::new();
        let mut end = f64::INFINITY;
        self.finder.visit(&ray, |hit| {
            if self.places[hit.piece].is_empty() || !is_within(hit.t) || hit.t > end {
                return None;
            }
            met.push((hit.t, hit.piece));
            if self.is_translucent[hit.piece] {
                return None;
            }
            // Of faces that coincide others may be seen than the one that is met first.
            end = end.min(hit.t * (1.0 + COINCIDES));
            Some(end)
        });
        for (_, piece) in met.into_iter().filter(|(t, _)| *t <= end) {
            self.places[piece].clone().for_each(&mut seen);
        }
    }

    /// A ray whose ways are distances along the view axis, but for how far before the eye it begins.
    fn ray(&self, view: &View, x: f64, y: f64) -> (DVec3, DVec3, f64) {
        if view.is_parallel() {
            let direction = view.world_direction(DVec3::NEG_Z);
            let start = view.world_point(x, y, view.depth(-self.start));
            (start, direction, self.start)
        } else {
            (view.camera().position, view.world_direction(view.eye_point(x, y, 1.0)), 0.0)
        }
    }

    fn nominated(&self) -> Vec<FaceId> {
        let all = self.is_nominated.iter().enumerate();
        let nominated = all.filter(|(_, is_nominated)| is_nominated.load(Ordering::Relaxed));
        nominated.map(|(place, _)| self.frame.id(0, place)).collect()
    }
}

/// Two numbers in [0, 1) that look like chance, the same everywhere.
fn chance(line: u32, number: u32) -> [f64; 2] {
    let mut z = (u64::from(line) << 32 | u64::from(number)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    [z as u32, (z >> 32) as u32].map(|bits| f64::from(bits) / 4_294_967_296.0)
}

/// An image of which only samples are known, `rays` to a pixel on each line: each stands for its share of the line.
fn sampled(image: &SpanImage, rays: u32) -> SpanImage {
    let raster = image.view().raster();
    let across = raster.width * rays;
    let border = |number: u32| raster.cell(f64::from(number) / f64::from(rays));
    let samples = |k: u32| {
        let at = place(k);
        (0..across).map(move |number| {
            let cell = raster.cell((f64::from(number) + at) / f64::from(rays));
            (border(number)..border(number + 1), cell.min(raster.cells() - 1))
        })
    };
    let range = image.lines().range();
    let lines = Lines::compute(range.clone(), |k, spans| {
        let known = image.lines().line(k);
        let first = spans.len();
        for (share, cell) in samples(k) {
            let at = known.partition_point(|span| span.x <= cell) - 1;
            let face = known[at].face;
            if spans[first..].last().is_none_or(|last: &Span| last.face != face) {
                spans.push(Span { x: share.start, face });
            }
        }
    });
    let layers = Layers::compute(range, |k, segments| {
        let known = image.layers().line(k);
        if known.is_empty() {
            return;
        }
        let first = segments.len();
        for (share, cell) in samples(k) {
            let through = known.iter().filter(|s| s.start <= cell && cell < s.end);
            segments.extend(through.map(|s| Segment {
                start: share.start,
                end: share.end,
                face: s.face,
            }));
        }
        layer::normalize(segments, first);
    });
    image.clone().with_lines(lines, layers)
}
