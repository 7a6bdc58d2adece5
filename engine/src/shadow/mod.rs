//! Shadow volumes: what of the spans on a line the light of one place does not reach, exactly.
//!
//! Every convex piece of a face casts a volume of its own (\[D], "Shading display with shadow", takes the
//! contours of closed bodies instead; most scenes are not closed, and what is counted wrong leaks). The
//! planes that bound a volume, through the light and the piece's edges and through the piece itself, are
//! affine on the screen along a visible face once multiplied by rho. So a volume takes one interval of a
//! line, its ends known exactly with their slopes, and a shadow is the *union* of intervals: nothing is
//! counted, and it does not matter where the eye is.
//!
//! Candidates come from the tree of [`Casters`] over the space between a patch of a face, a few rows high
//! and some dozens of pixels wide, and the light. The spans of the image are not cut: intervals stand beside
//! them, light by light, and fragments take the share of their area that is lit.
//!
//! What each scene casts on each patch is [kept](kept) for the next picture.

mod kept;
mod patch;
mod piece;
mod union;

use glam::DVec3;
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use self::kept::{Cast, Known};
use self::patch::{Boundary, Patch, interval, shaft_of_ball};
use self::union::{settle, unite};
use crate::fragment::{Casting, Stage, World};
use crate::key::{Key, KeyHasher};
use crate::span::layer::Segment;
use crate::span::{FaceId, SpanImage};
use crate::trace::{CasterSearch, Casters, Shaft, Spaces, Toward, spaces_of};
use crate::watch::Watch;
pub(crate) use piece::{Way, lies_in, opacity};

/// The width of a patch in pixels. Narrower, there are more patches to look for; wider, each has more
/// casters around it.
const TILE: f64 = 128.0;

/// An end of a shadow on a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct End {
    /// Where it is, in pixels from the left.
    pub(crate) x: f64,
    /// Pixels to the right per pixel downwards.
    pub(crate) slope: f64,
}

/// A part of a line where a face is in shadow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Dark {
    /// The face.
    pub(crate) face: FaceId,
    /// Where it begins.
    pub(crate) start: End,
    /// Where it ends.
    pub(crate) end: End,
    /// The share of the light that still arrives.
    pub(crate) through: f32,
}

/// A visible part of a face on a line.
#[derive(Clone, Copy, Debug)]
struct VisiblePart {
    face: FaceId,
    tile: u32,
    k: u32,
    from: f64,
    to: f64,
}

/// The shadows of lines: by line, sorted by face and then from left to right.
pub(crate) type Lines = Vec<Vec<Dark>>;

/// The visible parts of faces on some lines, patch by patch: the same for all lights.
#[derive(Debug, Default)]
pub(crate) struct Patches(Vec<VisiblePart>);

impl Patches {
    /// The patches of an image on the lines `lines`, of whose `layers` these are seen. Only faces of sources that
    /// are lit in the world receive its shadows.
    pub(crate) fn new<'l>(
        image: &SpanImage,
        world: &World,
        lines: Range<u32>,
        layers: impl Fn(u32) -> &'l [Segment],
    ) -> Patches {
        let looks_around = |stage: &Stage| match stage {
            Stage::Shade(shading) => shading.world().is_some_and(|w| w.key() == world.key()),
            _ => false,
        };
        let sources = image.sources().iter();
        let receives: Vec<bool> = sources.map(|s| s.stack.iter().any(looks_around)).collect();
        let raster = image.view().raster();
        let mut seen = Vec::new();
        for k in lines {
            let line = image.lines().line(k);
            let ends = line.iter().skip(1).map(|span| span.x).chain([raster.cells()]);
            let spans = line.iter().zip(ends).map(|(span, end)| (span.face, span.x, end));
            let layers = layers(k).iter().map(|s| (s.face, s.start, s.end));
            for (face, start, end) in spans.chain(layers) {
                if face.is_some() && receives[image.locate(face).0] {
                    let (mut left, end) = (raster.pixels(start), raster.pixels(end));
                    // Tiles begin at multiples of their width, whatever the span: lines above each
                    // other share them.
                    while left < end {
                        let tile = (left / TILE).floor();
                        let right = ((tile + 1.0) * TILE).min(end);
                        seen.push(VisiblePart {
                            face,
                            tile: tile as u32,
                            k,
                            from: left,
                            to: right,
                        });
                        left = right;
                    }
                }
            }
        }
        let key = |seen: &VisiblePart| (seen.face, seen.tile, seen.k);
        seen.sort_unstable_by(|a, b| key(a).cmp(&key(b)).then(a.from.total_cmp(&b.from)));
        Patches(seen)
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.0)
    }
}

/// The shadows that fall on the faces of an image on the lines `lines`, its chunk `chunk`, from everything in a world,
/// in the light from one place.
pub(crate) fn cast(
    image: &SpanImage,
    patches: &Patches,
    casting: &Casting<'_>,
    (chunk, lines): (u32, Range<u32>),
    watch: &Watch,
) -> Lines {
    let clock = Instant::now();
    let casters = casting.world.casters().map(|(member, casters)| {
        let spaces = match (casting.less.candidates, casting.from) {
            (CasterSearch::SixSpaces, Toward::Point(light)) => Some(casters.spaces(light)),
            _ => None,
        };
        Caster { member, casters, spaces, of_cluster: Vec::new() }
    });
    let casters: Vec<Caster<'_>> = casters.collect();
    let key = kept::key(image, casting);
    let known = Known::of((key, chunk), casting.world, watch);
    let nothing: Lines = vec![Vec::new(); lines.len()];
    let (first, cast, found) = (lines.start, Cast::new(casting.world), nothing.clone());
    let mut work = ShadowTask {
        image,
        casting,
        casters,
        first,
        known,
        cast,
        found,
        spans: Vec::new(),
        sides: Vec::new(),
        asked: 0,
        as_before: 0,
    };
    let mut dark = nothing;
    let source = |seen: &VisiblePart| image.locate(seen.face).0;
    // [N], "Shadow processing": cluster by cluster, with only the volumes that can fall on its
    // visible faces.
    for cluster in patches.0.chunk_by(|a, b| source(a) == source(b)) {
        if casting.less.candidates == CasterSearch::Clusters {
            let patches = cluster.chunk_by(|a, b| (a.face, a.tile) == (b.face, b.tile));
            work.look_around(patches.filter_map(|spans| Patch::new(image, spans, casting.from)));
        }
        let faces = cluster.chunk_by(|a, b| a.face == b.face);
        for parts in faces.take_while(|_| !watch.is_stopped()) {
            for (k, shadow) in work.face(parts) {
                dark[(k - first) as usize].push(Dark { face: parts[0].face, ..*shadow });
            }
        }
    }
    watch.count("shadow patches", work.asked);
    if work.as_before > 0 {
        watch.count("shadow patches as before", work.as_before);
    }
    work.cast.keep((key, chunk), watch, clock.elapsed().as_secs_f64());
    dark.iter_mut().for_each(Vec::shrink_to_fit);
    dark
}

struct ShadowTask<'a> {
    image: &'a SpanImage,
    casting: &'a Casting<'a>,
    casters: Vec<Caster<'a>>,
    /// The first of the lines.
    first: u32,
    /// What was cast on lines like these in the picture before.
    known: Option<Known>,
    cast: Cast,
    /// By line, what was found on a patch or a face.
    found: Lines,
    /// The parts of a line that show a face.
    spans: Vec<[f64; 2]>,
    sides: Vec<Boundary>,
    /// For how many patches and scenes shadows were asked, and how many of these were as before.
    asked: u64,
    as_before: u64,
}

/// What casts of one member of the world.
struct Caster<'a> {
    member: usize,
    casters: &'a Casters,
    /// Its pieces around the light.
    spaces: Option<Arc<Spaces>>,
    /// Its pieces between the light and the cluster at hand.
    of_cluster: Vec<u32>,
}

impl ShadowTask<'_> {
    /// Finds what stands between the light and all patches of a cluster: around their ball.
    fn look_around<'p>(&mut self, patches: impl Iterator<Item = Patch<'p>>) {
        let corners: Vec<DVec3> =
            patches.flat_map(|patch| patch.corners().unwrap_or_default()).collect();
        let low = corners.iter().fold(DVec3::INFINITY, |low, p| low.min(*p));
        let high = corners.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
        let (centre, radius) = ((low + high) / 2.0, (high - low).length() / 2.0);
        let shaft = shaft_of_ball(centre, radius, self.casting.from);
        for Caster { casters, of_cluster, .. } in &mut self.casters {
            of_cluster.clear();
            casters.within(&shaft, |piece| of_cluster.push(piece as u32));
        }
    }

    /// The shadows on the parts of a face that are seen: lines, and parts of them.
    fn face(&mut self, parts: &[VisiblePart]) -> &[(u32, Dark)] {
        let (count, as_before) = (self.cast.count(), self.as_before);
        let mut key = KeyHasher::new("face");
        let asked = self.asked;
        for spans in parts.chunk_by(|a, b| a.tile == b.tile) {
            if let Some(patch) = self.patch(spans) {
                key.key(patch);
            }
        }
        let key = key.finish();
        let is_as_before = self.asked - asked == self.as_before - as_before;
        let known = self.known.as_ref().filter(|_| is_as_before);
        if let Some(known) = known.and_then(|known| known.face(key)) {
            return self.cast.end_face(key, known.iter().copied());
        }
        for (k, shadow) in self.cast.since(count) {
            // What was found before had another number then.
            let shadow = Dark { face: parts[0].face, ..*shadow };
            self.found[(k - self.first) as usize].push(shadow);
        }
        let half = 0.5 / f64::from(self.image.plan().per_row);
        for (k, line) in (self.first..).zip(&mut self.found).filter(|(_, line)| !line.is_empty()) {
            unite(line);
            self.spans.clear();
            for part in parts.iter().filter(|part| part.k == k) {
                match self.spans.last_mut() {
                    // Parted by tiles alone.
                    Some(last) if last[1] == part.from => last[1] = part.to,
                    _ => self.spans.push([part.from, part.to]),
                }
            }
            settle(line, &self.spans, half);
        }
        let lines = (self.first..).zip(&mut self.found);
        let shadows = lines.flat_map(|(k, line)| line.drain(..).map(move |shadow| (k, shadow)));
        self.cast.end_face(key, shadows)
    }

    /// Finds the shadows on a patch of a face, scene by scene. Returns what the patch is, if it is turned to the light.
    fn patch(&mut self, spans: &[VisiblePart]) -> Option<Key> {
        let patch = Patch::new(self.image, spans, self.casting.from)?;
        let shaft = patch.shaft();
        let key = patch.key(spans);
        self.cast.begin(key);
        let was = self.known.as_ref().and_then(|known| known.patch(key));
        for number in 0..self.casters.len() {
            self.asked += 1;
            let known = self.known.as_ref().zip(was);
            if let Some(known) = known.and_then(|(known, was)| known.list(was, number, &shaft)) {
                self.as_before += 1;
                self.cast.end(known.iter().copied());
                continue;
            }
            self.find(number, spans, &patch, &shaft);
            let lines = (self.first..).zip(&mut self.found);
            self.cast.end(lines.flat_map(|(k, line)| {
                unite(line);
                line.drain(..).map(move |shadow| (k, shadow))
            }));
        }
        Some(key)
    }

    /// Finds what a scene casts on a patch.
    fn find(&mut self, number: usize, spans: &[VisiblePart], patch: &Patch<'_>, shaft: &Shaft) {
        let ShadowTask { image, casting, casters, first, found: dark, sides, .. } = self;
        let Casting { from, world, less } = **casting;
        let Caster { member, casters, spaces, of_cluster } = &casters[number];
        let surfaces = &*world.members()[*member].surfaces;
        let mut cast = |piece: usize| {
            if casters.pieces()[piece].opacity == 0.0 {
                return;
            }
            let corners = casters.corners(piece, from);
            // All of it may be outside one plane of the shaft.
            let is_outside = |(normal, offset): &(DVec3, f64)| {
                corners.clone().all(|corner| normal.dot(corner) + offset < 0.0)
            };
            if shaft.planes.iter().any(is_outside) {
                return;
            }
            // What comes out of a closed body went into it.
            if less.contours && casters.goes_in(piece, from) == Some(false) {
                return;
            }
            sides.clear();
            if !patch.volume(casters, piece, sides) {
                return;
            }
            // What differs from place to place is taken pixel by pixel.
            let differs = casters.pieces()[piece].opacity.is_nan();
            for line in spans.chunk_by(|a, b| a.k == b.k) {
                let (y, dark) = (image.y(line[0].k), &mut dark[(line[0].k - *first) as usize]);
                let whole = line[0].from..line[line.len() - 1].to;
                let Some((low, high)) = interval(sides, y, whole) else { continue };
                // Of the parts that the face is seen in, those that the volume meets.
                let met = line.partition_point(|seen| seen.to <= low.x);
                for seen in line[met..].iter().take_while(|seen| seen.from < high.x) {
                    let bound = |x| End { x, slope: 0.0 };
                    let mut start = if low.x > seen.from { low } else { bound(seen.from) };
                    let last = if high.x < seen.to { high } else { bound(seen.to) };
                    while start.x < last.x {
                        let next = if differs { start.x.floor() + 1.0 } else { f64::INFINITY };
                        let end = if next < last.x { bound(next) } else { last };
                        let middle = (start.x + end.x) / 2.0;
                        let opacity = patch.opacity(surfaces, casters, piece, middle, y);
                        if opacity > 0.0 {
                            let (face, through) = (seen.face, 1.0 - opacity);
                            dark.push(Dark { face, start, end, through });
                        }
                        start = end;
                    }
                }
            }
        };
        match (less.candidates, from) {
            (CasterSearch::Shafts, _) => casters.within(shaft, cast),
            (CasterSearch::Clusters, _) => of_cluster.iter().for_each(|p| cast(*p as usize)),
            (CasterSearch::SixSpaces, Toward::Point(light)) => {
                let Some((spaces, corners)) = spaces.as_ref().zip(patch.corners()) else {
                    (0..casters.pieces().len()).for_each(cast);
                    return;
                };
                let mut pieces: Vec<u32> = spaces_of(corners.iter().map(|c| *c - light))
                    .flat_map(|space| spaces[space].iter().copied())
                    .collect();
                pieces.sort_unstable();
                pieces.dedup();
                pieces.into_iter().for_each(|piece| cast(piece as usize));
            }
            (CasterSearch::SixSpaces | CasterSearch::All, _) => {
                (0..casters.pieces().len()).for_each(cast);
            }
        }
    }
}
