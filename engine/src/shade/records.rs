//! Places where light is gathered that surfaces send on, and what is interpolated between them.
//!
//! Each plane has squares, divided into quarters where something stands nearer than they are wide, or where the light
//! differs between their corners. Light is gathered at corners. What is known of a square or a corner is a function of
//! nothing but the world, the eye, the plane and its place: so it is the same whoever asks first, and on any number of threads.
//!
//! A corner between others is first predicted from those of the squares before they were divided, and what is gathered
//! there changes that as far as it differs by more than noise (as wavelets are shrunk: Donoho and Johnstone 1994). So
//! where light is even, fine squares add no noise and meet wide ones without a seam. Wide squares are few, and their
//! corners take more rays.
//!
//! Nothing is interpolated across what stands on a plane or close above it: of a square that something reaches into, a
//! fragment takes the corners that it can see and that are covered as it is. One that has none gathers by itself. Faces
//! that are hardly wider than a pixel have one record each.
//!
//! Of what only other surfaces see, all light is found in this way, that of lamps too: what is wanted there is the mean
//! over what a ray stands for. So a corner takes the mean over a square about it, and squares are as wide as the ray is.

use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::beyond;
use super::bounces::{Gathered, Gatherer, Place};
use super::openings::{Openings, Seen};
use super::pattern::Pattern;
use super::plane::{self, FaceExtent, PlaneKey, SurfacePlane, face_extents, is_open};
use super::recorded::RecordedLamp;
use super::shards::Shards;
use crate::color::Color;
use crate::key::Key;
use crate::math;
use crate::trace::Casters;

/// The least width of a square, in widths of what asks for it.
const FINEST: f64 = 6.0;

/// Nothing may stand nearer to a square than this many times its width, unless it is as fine as it may be.
const APART: f64 = 1.0;

/// By how much light may differ between the corners of a square, as a share of their mean.
const DIFFERS: f32 = 0.06;

/// By how much it may differ in the middle from the mean of the corners, as a share of that.
const BENDS: f32 = 0.02;

/// What is gathered counts as what was predicted if it differs by no more than this many standard errors.
const NOISE: f32 = 0.7;

/// By how much what is gathered at corners beside each other may differ, in standard errors, to be averaged.
const ALIKE: f32 = 2.5;

/// By which power of the number of rays the error of what surfaces give is taken to fall: by chance it would be a half, but
/// few rays tell of less than they miss.
const FALLS: f32 = 0.25;

/// The widest squares of a face, in widths of the face.
const AROUND: f64 = 2.0;

/// How many times as many rays the corners of wide squares take at most.
const MOST_RAYS: f64 = 16.0;

/// How many rays a record sends to a sky that is seen through openings for each that it sends to surfaces.
const RAYS_TO_OPENINGS: u32 = 4;

/// Faces that are less wide than this, in widths of what asks for them, have no record; up to the finest squares, one.
const FINEST_FACE: f64 = 2.0;

/// How many times as many rays the one record of a face takes.
const RAYS_OF_FACE: u32 = 4;

/// The squares from about which openings to a sky are looked for, as a part of the way to the camera; how often they are
/// halved; and from how many places of each.
const OPENINGS: f64 = 1.0 / 4.0;
const NEARER: u32 = 2;
const ABOUT: u32 = 64;

/// How often squares are divided at most.
const DEEPEST: u32 = 24;

/// What is known of worlds under lights, by what it is made of.
#[derive(Debug, Default)]
pub(super) struct Fields(Mutex<Vec<(Key, Arc<Field>)>>);

impl Fields {
    /// What is known under a key, nothing at first.
    pub(super) fn of(&self, key: Key) -> Arc<Field> {
        let mut fields = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, known)) = fields.iter().find(|(known, _)| *known == key) {
            return known.clone();
        }
        let field = Arc::new(Field::default());
        fields.push((key, field.clone()));
        field
    }
}

/// What is known of a world under some lights.
#[derive(Debug, Default)]
pub(super) struct Field {
    /// What was gathered at corners.
    records: Shards<SquareKey, Arc<Record>>,
    /// By how much that differs from what was predicted.
    details: Shards<SquareKey, Arc<Detail>>,
    /// What is known of corners.
    corners: Shards<SquareKey, Arc<Record>>,
    squares: Shards<SquareKey, Arc<Square>>,
    /// What falls on squares about corners that only others see.
    pub(super) beyond: Shards<SquareKey, Arc<Gathered>>,
    /// By lamp, through which openings it is seen from about a corner.
    openings: Shards<(SquareKey, usize), Option<Arc<Openings>>>,
    /// What was gathered for faces that have one record each: by their scene, number, and side.
    of_faces: Shards<(Key, u32, bool), Arc<Gathered>>,
    extent: OnceLock<Option<(DVec3, f64)>>,
    /// By scene, where its faces are and how wide.
    faces: OnceLock<HashMap<Key, Vec<FaceExtent>>>,
}

/// What is received at a corner.
#[derive(Clone, Debug)]
struct Record {
    gathered: Gathered,
    /// The error that the least number of rays has about here: what a few rays miss by chance, their own error does not
    /// tell.
    spread: Vec<f32>,
}

/// What is predicted of a corner from wider squares, and what was gathered there.
#[derive(Debug)]
struct Detail {
    predicted: Option<Record>,
    own: Arc<Record>,
    /// By how much they may differ by chance.
    noise: Vec<f32>,
}

/// A square of a plane, or its lower corner: the plane by its normal and distance, in steps that are too small to be
/// seen; how often the widest of all were divided to be the widest of the face, and then to be these; and the place
/// among these.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct SquareKey {
    pub(super) plane: PlaneKey,
    pub(super) first: u32,
    pub(super) level: u32,
    pub(super) at: [i64; 2],
}

/// What is known of a square.
#[derive(Debug, Default)]
pub(super) struct Square {
    /// Whether something stands nearer than it is wide.
    pub(super) is_near: bool,
    /// Whether something reaches into it.
    is_crossed: bool,
    /// Whether something covers its corners from near above.
    is_covered: [bool; 4],
    /// What is received at its corners: x, then y.
    corners: OnceLock<[Arc<Record>; 4]>,
    /// Whether light in it differs from what they tell.
    differs: OnceLock<bool>,
    /// What falls about its corners, if only others see it.
    pub(super) beyond: OnceLock<[Arc<Gathered>; 4]>,
}

/// Who asks for light.
pub(super) struct Asked<'a> {
    pub(super) gatherer: &'a Gatherer<'a>,
    pub(super) casters: &'a [(usize, &'a Casters)],
    /// How many rays a record takes at least.
    pub(super) rays: u32,
    /// Whether surfaces send light on to what asks.
    pub(super) goes_on: bool,
    /// The lamps that are found here.
    pub(super) lamps: &'a [RecordedLamp<'a>],
}

/// A face that somebody asks for light on.
pub(super) struct AskedFace<'a> {
    pub(super) scene: Key,
    pub(super) ordinal: u32,
    pub(super) is_front: bool,
    /// `None` of what lies on another.
    pub(super) extent: Option<&'a FaceExtent>,
}

impl Asked<'_> {
    /// How many times as many rays a corner of squares takes.
    fn times(&self, position: DVec3, width: f64) -> f64 {
        let like = self.gatherer.like;
        let before = (position - like.view.camera().position).length();
        let finest = like.view.pixel_width(before).0 * like.pixel.x * FINEST;
        (width / finest).clamp(1.0, MOST_RAYS)
    }
}

impl Field {
    /// What a place on a face receives, if a record is seen from it and the face is not too small for any.
    pub(super) fn at(
        &self,
        place: &Place,
        face: &AskedFace<'_>,
        asked: &Asked<'_>,
        found: &mut Gathered,
    ) -> bool {
        let is_seen = asked.gatherer.bounced == 0;
        let finest = match is_seen {
            true => place.width * FINEST,
            false => beyond::finest(place, asked),
        };
        let least = if is_seen { place.width * FINEST_FACE } else { finest * beyond::FINEST_FACE };
        found.clear();
        let width = match face.extent.map(|extent| extent.width).filter(|width| *width > 0.0) {
            Some(width) if width < least => return false,
            Some(width) if width < finest => {
                let made = self.of_face(place, face, asked);
                add(found, &made, 1.0, turned(place));
                bright(found, 1.0);
                return true;
            }
            width => width,
        };
        let Some(extent) = *self.extent.get_or_init(|| plane::extent(asked.gatherer.world)) else {
            return false;
        };
        let plane = SurfacePlane::new(place.position, place.facing, extent);
        match is_seen {
            true => self.seen(place, (&plane, finest, width), asked, found),
            false => self.beyond(place, (&plane, finest), asked, found),
        }
    }

    /// The one record of a small face.
    fn of_face(&self, place: &Place, face: &AskedFace<'_>, asked: &Asked<'_>) -> Arc<Gathered> {
        self.of_faces.or_made((face.scene, face.ordinal, face.is_front), || {
            let side = [i64::from(face.ordinal), i64::from(face.is_front)];
            let middle = face.extent.map_or(place.position, |extent| extent.middle);
            let times = if asked.gatherer.bounced == 0 { RAYS_OF_FACE } else { 1 };
            let made = unseen((middle, place.facing), seed(side), asked);
            Arc::new(gathered(&made, asked.rays * times, asked, |_| None).0)
        })
    }

    /// What a place on a plane receives that the camera sees, between records.
    fn seen(
        &self,
        place: &Place,
        (plane, finest, face): (&SurfacePlane, f64, Option<f64>),
        asked: &Asked<'_>,
        sum: &mut Gathered,
    ) -> bool {
        let at = plane.place(place.position);
        // Squares that are much wider than the face lie in the air.
        let around = face.map_or(1.0, |face| plane.widest / (face * AROUND));
        let first = math::log2(around.clamp(1.0, 1e9)) as u32;
        let mut level = first;
        let (square, key) = loop {
            let width = plane.width(level);
            let key = SquareKey { plane: plane.key, first, level, at: lower(at, width) };
            let square = self.square(key, plane, width, asked);
            // What only stands near divides it no further than that; light that differs does once more.
            let is_near = square.is_near && width * 0.5 >= finest;
            let is_last = width < finest || level >= first + DEEPEST;
            if is_last || !(is_near || self.differs(&square, key, plane, asked)) {
                break (square, key);
            }
            level += 1;
        };
        let corners = self.corners(&square, key, plane, asked);
        let corners = corners.each_ref().map(|corner| &corner.gathered);
        between(place, (&square, key, plane), corners, asked.casters, sum)
    }

    /// Where a scene's faces are; what lies on a face is nowhere by itself.
    pub(super) fn faces(&self, scene: Key, asked: &Asked<'_>) -> &[FaceExtent] {
        let faces = self.faces.get_or_init(|| {
            let members = asked.gatherer.world.members();
            let casters = asked.casters.iter();
            casters
                .map(|(member, casters)| (members[*member].scene, face_extents(casters)))
                .collect()
        });
        faces.get(&scene).map_or(&[], Vec::as_slice)
    }

    pub(super) fn square(
        &self,
        key: SquareKey,
        plane: &SurfacePlane,
        width: f64,
        asked: &Asked<'_>,
    ) -> Arc<Square> {
        self.squares.or_made(key, || {
            let middle = DVec2::new(key.at[0] as f64 + 0.5, key.at[1] as f64 + 0.5) * width;
            let stands = |beside: f64, above: f64| {
                let base = (middle, width * 0.5 + beside, above);
                asked.casters.iter().any(|(_, casters)| plane.is_reached(base, casters))
            };
            let is_near = stands(width * APART, width * APART);
            let is_crossed = is_near && stands(width * 1e-3, width * 0.05);
            let is_covered = std::array::from_fn(|k| {
                is_near && plane.is_covered(corner_at(plane, key, width, k), width, asked.casters)
            });
            Arc::new(Square { is_near, is_crossed, is_covered, ..Square::default() })
        })
    }

    /// Whether light in a square differs from what its corners tell.
    fn differs(
        &self,
        square: &Square,
        key: SquareKey,
        plane: &SurfacePlane,
        asked: &Asked<'_>,
    ) -> bool {
        if let Some(differs) = square.differs.get() {
            return *differs;
        }
        let differs = self.is_uneven(square, key, plane, asked);
        *square.differs.get_or_init(|| differs)
    }

    fn is_uneven(
        &self,
        square: &Square,
        key: SquareKey,
        plane: &SurfacePlane,
        asked: &Asked<'_>,
    ) -> bool {
        let corners = self.corners(square, key, plane, asked);
        let light = |corner: &Record, lamp: usize| corner.gathered.light[lamp].luminance();
        let lights = |lamp: usize| corners.each_ref().map(|corner| light(corner, lamp));
        let mean = |lamp: usize| lights(lamp).iter().sum::<f32>() / 4.0;
        let error =
            |lamp: usize| corners.iter().map(|c| c.gathered.error[lamp]).fold(0.0, f32::max);
        // What is but noise is not divided.
        let is_apart = |lamp: usize| {
            let all = lights(lamp).into_iter();
            let (low, high) = all.fold((f32::MAX, 0.0f32), |(a, b), v| (a.min(v), b.max(v)));
            high - low > DIFFERS * mean(lamp) + 3.0 * error(lamp)
        };
        let lamps = 0..=asked.gatherer.lamps;
        if lamps.clone().any(is_apart) {
            return true;
        }
        // Between corners that are alike it may be brighter or darker.
        let at = key.at.map(|at| at * 2 + 1);
        let middle = self.detail(SquareKey { level: key.level + 1, at, ..key }, plane, asked);
        lamps.into_iter().any(|lamp| {
            let off = (light(&middle.own, lamp) - mean(lamp)).abs();
            off > BENDS * mean(lamp) + 2.0 * (error(lamp) + middle.own.gathered.error[lamp])
        })
    }

    fn corners<'s>(
        &self,
        square: &'s Square,
        key: SquareKey,
        plane: &SurfacePlane,
        asked: &Asked<'_>,
    ) -> &'s [Arc<Record>; 4] {
        // Not under a lock: what gathers may wait for others, who want these.
        if square.corners.get().is_none() {
            let _ = square.corners.set(std::array::from_fn(|k| {
                let at = [key.at[0] + (k & 1) as i64, key.at[1] + (k >> 1) as i64];
                self.corner(SquareKey { at, ..key }, plane, asked)
            }));
        }
        square.corners.get().expect("they are there")
    }

    /// What is received at a corner of squares.
    fn corner(&self, mut key: SquareKey, plane: &SurfacePlane, asked: &Asked<'_>) -> Arc<Record> {
        // The corners of wider squares are corners of finer ones.
        while key.level > key.first && key.at.iter().all(|at| at % 2 == 0) {
            key = SquareKey { level: key.level - 1, at: key.at.map(|at| at / 2), ..key };
        }
        if key.level == key.first {
            return self.record(key, plane, asked);
        }
        self.corners.or_made(key, || {
            let detail = self.detail(key, plane, asked);
            match &detail.predicted {
                Some(predicted) => {
                    let around = self.around(key, plane, asked);
                    Arc::new(corrected(predicted, &detail, &around))
                }
                None => detail.own.clone(),
            }
        })
    }

    /// What differs from what was predicted, of a corner between wider squares.
    fn detail(&self, key: SquareKey, plane: &SurfacePlane, asked: &Asked<'_>) -> Arc<Detail> {
        self.details.or_made(key, || {
            let own = self.record(key, plane, asked);
            let predicted = self.predicted(key, plane, asked);
            let noise = |lamp: usize| {
                let own = own.gathered.error[lamp];
                predicted.as_ref().map_or(own, |predicted| {
                    own.max(predicted.spread[lamp]).hypot(predicted.gathered.error[lamp])
                })
            };
            let noise = (0..own.spread.len()).map(noise).collect();
            Arc::new(Detail { predicted, own, noise })
        })
    }

    /// The corners beside one that it sees and that are covered as it is: how much each counts, and what differs there.
    fn around(
        &self,
        key: SquareKey,
        plane: &SurfacePlane,
        asked: &Asked<'_>,
    ) -> Vec<(f32, Arc<Detail>)> {
        let width = plane.width(key.level);
        let here = corner_at(plane, key, width, 0);
        let is_covered = plane.is_covered(here, width, asked.casters);
        let mut around = Vec::with_capacity(8);
        for (dx, dy) in (-1..=1i64).flat_map(|dy| (-1..=1i64).map(move |dx| (dx, dy))) {
            let beside = SquareKey { at: [key.at[0] + dx, key.at[1] + dy], ..key };
            // The corners of wider squares have no detail.
            if (dx, dy) == (0, 0) || beside.at.iter().all(|at| at % 2 == 0) {
                continue;
            }
            let there = corner_at(plane, beside, width, 0);
            if is_open(asked.casters, here, there)
                && plane.is_covered(there, width, asked.casters) == is_covered
            {
                let weight = if dx == 0 || dy == 0 { 0.5 } else { 0.25 };
                around.push((weight, self.detail(beside, plane, asked)));
            }
        }
        around
    }

    /// What the corners of the squares before tell of one that lies between them: the mean of those that it sees and
    /// that are covered as it is. `None` if there are none.
    fn predicted(&self, key: SquareKey, plane: &SurfacePlane, asked: &Asked<'_>) -> Option<Record> {
        let width = plane.width(key.level);
        let here = corner_at(plane, key, width, 0);
        let is_covered = plane.is_covered(here, width, asked.casters);
        let [x, y] = key.at.map(|at| [(at - at.rem_euclid(2)) / 2, (at + at.rem_euclid(2)) / 2]);
        let lamps = asked.gatherer.lamps;
        let mut sum =
            Record { gathered: Gathered::none(lamps, true), spread: vec![0.0; lamps + 1] };
        let Record { gathered, spread } = &mut sum;
        let mut count = 0.0f32;
        for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let is_twice = i == 1 && x[0] == x[1] || j == 1 && y[0] == y[1];
            let wide = SquareKey { level: key.level - 1, at: [x[i], y[j]], ..key };
            let there = corner_at(plane, wide, plane.width(wide.level), 0);
            let is_beside = || {
                is_open(asked.casters, here, there)
                    && plane.is_covered(there, width, asked.casters) == is_covered
            };
            if is_twice || !is_beside() {
                continue;
            }
            let corner = self.corner(wide, plane, asked);
            count += 1.0;
            mix(gathered, &corner.gathered);
            for (sum, error) in gathered.error.iter_mut().zip(&corner.gathered.error) {
                *sum += error * error;
            }
            spread.iter_mut().zip(&corner.spread).for_each(|(sum, spread)| *sum += spread);
        }
        let share = 1.0 / count;
        gathered.light.iter_mut().for_each(|light| *light = *light * share);
        gathered.tilt.iter_mut().flatten().for_each(|tilt| *tilt = *tilt * share);
        gathered.error.iter_mut().for_each(|squares| *squares = squares.sqrt() * share);
        spread.iter_mut().for_each(|spread| *spread *= share);
        (count > 0.0).then_some(sum)
    }

    /// Through which openings a lamp is seen from about a place, if that is known of a corner near it.
    pub(super) fn openings(
        &self,
        lamp: &RecordedLamp<'_>,
        place: &Place,
        plane: &SurfacePlane,
        asked: &Asked<'_>,
    ) -> Option<Arc<Openings>> {
        if lamp.casts.is_none() || !lamp.is_sky() {
            return None;
        }
        let first = plane.level(place.before * OPENINGS);
        // What others see is averaged by them.
        let nearer = if asked.gatherer.bounced == 0 { NEARER } else { 0 };
        self.openings_near(lamp, place.position, (plane, first, first + nearer), asked)
    }

    /// The same, of corners of squares of a level: looked for where they are seen from wider ones.
    fn openings_near(
        &self,
        lamp: &RecordedLamp<'_>,
        position: DVec3,
        (plane, first, level): (&SurfacePlane, u32, u32),
        asked: &Asked<'_>,
    ) -> Option<Arc<Openings>> {
        let width = plane.width(level);
        let low = lower(plane.place(position), width);
        let near = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[dx, dy]| {
            let at = [low[0] + dx, low[1] + dy];
            SquareKey { plane: plane.key, first, level, at }
        });
        let corner = |key: SquareKey| corner_at(plane, key, width, 0);
        let key = near.into_iter().find(|key| is_open(asked.casters, position, corner(*key)))?;
        self.openings.or_made((key, lamp.number), || {
            let corner = corner(key);
            let near = match level > first {
                true => Some(self.openings_near(lamp, corner, (plane, first, level - 1), asked)?),
                false => None,
            };
            let mut about = unseen((corner, plane.normal), seed(key.numbers()), asked);
            about.starts = beyond::starts(plane, corner, (width, ABOUT), asked);
            match Openings::seen(lamp, &about, near.as_deref()) {
                Seen::Through(openings) => Some(openings),
                Seen::Nothing => near,
                Seen::Most => None,
            }
        })
    }

    fn record(&self, key: SquareKey, plane: &SurfacePlane, asked: &Asked<'_>) -> Arc<Record> {
        self.records.or_made(key, || {
            let width = plane.width(key.level);
            let position = corner_at(plane, key, width, 0);
            let rays = (f64::from(asked.rays) * asked.times(position, width)) as u32;
            let place = unseen((position, plane.normal), seed(key.numbers()), asked);
            // On a small face records are too few to be worth the rays that look for openings.
            let nearest = place.before * OPENINGS / f64::from(1u32 << NEARER);
            let is_wide = plane.width(key.first) >= nearest;
            let openings = |lamp: &RecordedLamp<'_>| match is_wide {
                true => self.openings(lamp, &place, plane, asked),
                false => None,
            };
            let (gathered, of_surfaces) = gathered(&place, rays, asked, openings);
            let more = math::powf(rays as f32 / asked.rays as f32, FALLS);
            let errors = gathered.error.iter().zip(&of_surfaces);
            let spread = errors.map(|(all, error)| all.hypot(error * more)).collect();
            Arc::new(Record { gathered, spread })
        })
    }
}

impl SquareKey {
    pub(super) fn numbers(self) -> [i64; 7] {
        let SquareKey { plane: ([x, y, z], distance), level, at: [u, v], .. } = self;
        [i64::from(x), i64::from(y), i64::from(z), distance, i64::from(level), u, v]
    }
}

/// A place that nobody asks for itself.
pub(super) fn unseen((position, facing): (DVec3, DVec3), seed: u64, asked: &Asked<'_>) -> Place {
    Place {
        position,
        facing,
        normal: facing,
        screen: DVec2::ZERO,
        before: (position - asked.gatherer.like.view.camera().position).length(),
        width: 0.0,
        weight: Color::WHITE,
        pattern: Pattern::from_seed(seed),
        starts: Vec::new(),
    }
}

/// What is received at a place, of other surfaces and of lamps that are found here; and the error of what surfaces give.
pub(super) fn gathered(
    place: &Place,
    rays: u32,
    asked: &Asked<'_>,
    openings: impl Fn(&RecordedLamp<'_>) -> Option<Arc<Openings>>,
) -> (Gathered, Vec<f32>) {
    let gatherer = asked.gatherer;
    gatherer.batch.count("records", 1);
    let of_surfaces = match asked.goes_on {
        true => gatherer.gather(std::slice::from_ref(place), rays, true).pop(),
        false => None,
    };
    let mut all = of_surfaces.unwrap_or_else(|| Gathered::none(gatherer.lamps, true));
    let error = all.error.clone();
    for lamp in asked.lamps {
        let openings = openings(lamp);
        // Of a sky that is seen through openings more is uncertain than of one that is open.
        let count = if openings.is_some() { rays * RAYS_TO_OPENINGS } else { rays };
        lamp.add(place, count, openings.as_deref(), &mut all);
    }
    (all, error)
}

/// What a place in a square receives, between the corners of it that it sees and that are covered as it is. False if there
/// are none.
pub(super) fn between(
    place: &Place,
    (square, key, plane): (&Square, SquareKey, &SurfacePlane),
    corners: [&Gathered; 4],
    casters: &[(usize, &Casters)],
    sum: &mut Gathered,
) -> bool {
    let width = plane.width(key.level);
    let at = plane.place(place.position);
    let within = at / width - DVec2::new(key.at[0] as f64, key.at[1] as f64);
    let weights = [
        (1.0 - within.x) * (1.0 - within.y),
        within.x * (1.0 - within.y),
        (1.0 - within.x) * within.y,
        within.x * within.y,
    ];
    let mut all = 0.0f32;
    let here = plane.point(at);
    let is_mixed = square.is_crossed || square.is_covered.iter().any(|it| *it);
    let is_covered = is_mixed && plane.is_covered(here, width, casters);
    for (k, (corner, weight)) in corners.into_iter().zip(weights).enumerate() {
        // What lies under something has another light than what lies beside it.
        let is_beside = || {
            let there = corner_at(plane, key, width, k);
            is_covered == square.is_covered[k] && is_open(casters, here, there)
        };
        if is_mixed && !is_beside() {
            continue;
        }
        // A corner that lies just here counts for a little in any case.
        let weight = weight.max(1e-6) as f32;
        all += weight;
        add(sum, corner, weight, turned(place));
    }
    if all <= 1e-3 {
        return false;
    }
    bright(sum, 1.0 / all);
    true
}

/// The lower corner of the square of a width that a place lies in.
pub(super) fn lower(at: DVec2, width: f64) -> [i64; 2] {
    (at / width).floor().to_array().map(|at| at as i64)
}

/// A prediction, changed by what was gathered there and beside as far as that differs by more than noise.
fn corrected(predicted: &Record, own: &Detail, around: &[(f32, Arc<Detail>)]) -> Record {
    let Record { mut gathered, spread } = predicted.clone();
    for lamp in 0..spread.len() {
        let off = |detail: &Detail| {
            let before = detail.predicted.as_ref().unwrap_or(predicted);
            detail.own.gathered.light[lamp] + before.gathered.light[lamp] * -1.0
        };
        let here = off(own).luminance();
        let is_alike = |(_, other): &&(f32, Arc<Detail>)| {
            let noise = own.noise[lamp].hypot(other.noise[lamp]);
            other.predicted.is_some() && (off(other).luminance() - here).abs() <= ALIKE * noise
        };
        let (mut light, mut all) = (off(own), 1.0f32);
        let mut squares = own.noise[lamp].powi(2);
        let error_of = |detail: &Detail| detail.own.gathered.error[lamp];
        let mut errors = error_of(own).powi(2);
        for (weight, other) in around.iter().filter(is_alike) {
            light = light + off(other) * *weight;
            all += weight;
            squares += (other.noise[lamp] * weight).powi(2);
            errors += (error_of(other) * weight).powi(2);
        }
        let (light, noise) = (light * (1.0 / all), squares.sqrt() / all);
        // Of a signal in noise, the share that is no noise (James and Stein 1961).
        let share = NOISE * noise / light.luminance().abs().max(f32::MIN_POSITIVE);
        let keeps = f32::max(1.0 - share * share, 0.0);
        gathered.light[lamp] = gathered.light[lamp] + light * keeps;
        for (tilt, own) in gathered.tilt[lamp].iter_mut().zip(own.own.gathered.tilt[lamp]) {
            *tilt = *tilt * (1.0 - keeps) + own * keeps;
        }
        let error = &mut gathered.error[lamp];
        *error = *error * (1.0 - keeps) + errors.sqrt() / all * keeps;
    }
    Record { gathered, spread }
}

/// Adds what another corner receives, but for errors.
fn mix(sum: &mut Gathered, record: &Gathered) {
    for (light, other) in sum.light.iter_mut().zip(&record.light) {
        *light = *light + *other;
    }
    for (tilt, other) in sum.tilt.iter_mut().flatten().zip(record.tilt.iter().flatten()) {
        *tilt = *tilt + *other;
    }
}

/// By how much the normal of a place is turned away from that of its face.
fn turned(place: &Place) -> [f32; 3] {
    (place.normal - place.facing).to_array().map(|v| v as f32)
}

/// Adds a share of a record as a turned normal has it.
fn add(sum: &mut Gathered, record: &Gathered, weight: f32, turned: [f32; 3]) {
    for (lamp, light) in sum.light.iter_mut().enumerate() {
        let [x, y, z] = record.tilt[lamp];
        let tilted = x * turned[0] + y * turned[1] + z * turned[2];
        *light = *light + (record.light[lamp] + tilted) * weight;
        sum.error[lamp] += record.error[lamp] * weight;
    }
}

/// Multiplies all, and lets nothing be darker than black.
fn bright(sum: &mut Gathered, by: f32) {
    for light in &mut sum.light {
        let Color { r, g, b } = *light * by;
        *light = Color::new(r.max(0.0), g.max(0.0), b.max(0.0));
    }
    sum.error.iter_mut().for_each(|error| *error *= by);
}

/// A number that differs from place to place.
pub(super) fn seed(parts: impl IntoIterator<Item = i64>) -> u64 {
    let mix = |sum: u64, part: i64| {
        (sum ^ part as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29)
    };
    parts.into_iter().fold(0, mix)
}

/// A corner of a square.
pub(super) fn corner_at(plane: &SurfacePlane, key: SquareKey, width: f64, k: usize) -> DVec3 {
    let at = DVec2::new((key.at[0] + (k & 1) as i64) as f64, (key.at[1] + (k >> 1) as i64) as f64);
    plane.point(at * width)
}
