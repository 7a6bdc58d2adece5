//! Places where light is gathered that surfaces send on, and what is interpolated between them.
//!
//! Each plane has squares, divided into quarters where something stands nearer than they are wide, or where the light
//! differs between their corners. Light is gathered at corners. What is known of a square or a corner is a function of
//! nothing but the world, the eye, the plane and its place: so it is the same whoever asks first, and on any number of threads.
//!
//! Nothing is interpolated across what stands on a plane or close above it: of a square that something reaches into, a
//! fragment takes the corners that it can see and that are covered as it is. One that has none gathers by itself.

use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::bounces::{Gathered, Gatherer, Place};
use super::pattern::Pattern;
use crate::color::Color;
use crate::fragment::World;
use crate::key::Key;
use crate::polygon::split;
use crate::trace::{Casters, Ray, Shaft, Toward};

/// The least width of a square, in widths of what asks for it.
const FINEST: f64 = 6.0;

/// The least width of a square of what only others see, as a part of the way from there to the camera.
const FINEST_BEYOND: f64 = 1.0 / 12.0;

/// The widest squares, as a part of the world.
const COARSEST: f64 = 0.25;

/// Nothing may stand nearer to a square than this many times its width, unless it is as fine as it may be.
const APART: f64 = 1.0;

/// By how much light may differ between the corners of a square, as a share of their mean.
const DIFFERS: f32 = 0.12;

/// By how much it may differ in the middle from the mean of the corners, as a share of that.
const BENDS: f32 = 0.02;

/// Records that differ by no more than this many standard errors count as the same light.
const ALIKE: f32 = 2.5;

/// How far above its plane light is gathered, as a part of the world.
const ABOVE: f64 = 2e-6;

/// How far the corners of squares are moved, as a part of the world: walls stand in its middle and at its ends.
const ASIDE: [f64; 2] = [0.017_321, 0.026_458];

/// How much further than a corner a fragment must be able to see: what stands just there has another light on its other
/// side.
const BEYOND: f64 = 1.01;

const SHARDS: usize = 64;

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
#[derive(Debug)]
pub(super) struct Field {
    records: Vec<Mutex<HashMap<SquareKey, Arc<Gathered>>>>,
    squares: Vec<Mutex<HashMap<SquareKey, Arc<Square>>>>,
    extent: OnceLock<Option<(DVec3, f64)>>,
    /// By scene, the widths of its faces.
    widths: OnceLock<HashMap<String, Vec<f64>>>,
}

impl Default for Field {
    fn default() -> Field {
        let (records, squares) = (0..SHARDS).map(|_| Default::default()).unzip();
        Field { records, squares, extent: OnceLock::new(), widths: OnceLock::new() }
    }
}

/// A square of a plane, or its lower corner: the plane by its normal and distance, in steps that are too small to be
/// seen; how often squares were divided; and the place among these.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct SquareKey {
    plane: ([i32; 3], i64),
    level: u32,
    at: [i64; 2],
}

/// What is known of a square.
#[derive(Debug, Default)]
struct Square {
    /// Whether something stands nearer than it is wide.
    is_near: bool,
    /// Whether something reaches into it.
    is_crossed: bool,
    /// Whether something covers its corners from near above.
    is_covered: [bool; 4],
    /// What is received at its corners: x, then y.
    corners: OnceLock<[Arc<Gathered>; 4]>,
}

/// The plane of a surface in a world.
struct SurfacePlane {
    key: ([i32; 3], i64),
    normal: DVec3,
    axes: [DVec3; 2],
    /// A point of it, a little above.
    origin: DVec3,
    /// The widest squares.
    widest: f64,
}

impl SurfacePlane {
    fn point(&self, at: DVec2) -> DVec3 {
        self.origin + self.axes[0] * at.x + self.axes[1] * at.y
    }

    /// Whether something opaque stands above a point, nearer than squares are wide.
    fn is_covered(&self, point: DVec3, width: f64, casters: &[(usize, &Casters)]) -> bool {
        !is_open(casters, point, point + self.normal * width)
    }
}

/// Who asks for light.
pub(super) struct Asked<'a> {
    pub(super) gatherer: &'a Gatherer<'a>,
    pub(super) casters: &'a [(usize, &'a Casters)],
    /// What a place receives.
    pub(super) receives: &'a dyn Fn(&Place) -> Gathered,
}

impl Asked<'_> {
    /// Whether a face of a width is so small that records on its plane are of no use to a place on it.
    pub(super) fn is_too_small(&self, width: Option<&f64>, place: &Place) -> bool {
        width.is_some_and(|width| *width > 0.0 && *width < self.finest(place))
    }

    /// The least width of squares for a place.
    fn finest(&self, place: &Place) -> f64 {
        match self.gatherer.bounced {
            0 => place.width * FINEST,
            _ => place.width.max(place.before * FINEST_BEYOND),
        }
    }
}

impl Field {
    /// What a place receives, between records. `None` if no record is seen from it.
    pub(super) fn at(&self, place: &Place, asked: &Asked<'_>) -> Option<Gathered> {
        let plane = self.plane(place, asked.gatherer.world)?;
        let from = place.position - plane.origin;
        let at = DVec2::new(plane.axes[0].dot(from), plane.axes[1].dot(from));
        let finest = asked.finest(place);
        let mut level = 0;
        let (square, key, within) = loop {
            let width = plane.widest / f64::from(1u32 << level);
            let scaled = at / width;
            let low = scaled.floor();
            let key = SquareKey { plane: plane.key, level, at: [low.x as i64, low.y as i64] };
            let square = self.square(key, &plane, width, asked);
            // What only stands near divides it no further than that; light that differs does once more.
            let is_near = square.is_near && width * 0.5 >= finest;
            let is_last = width < finest || level >= 24;
            if is_last || !(is_near || self.differs(&square, key, &plane, asked)) {
                break (square, key, scaled - low);
            }
            level += 1;
        };
        let width = plane.widest / f64::from(1u32 << level);
        let corners = self.corners(&square, key, &plane, asked);
        let weights = [
            (1.0 - within.x) * (1.0 - within.y),
            within.x * (1.0 - within.y),
            (1.0 - within.x) * within.y,
            within.x * within.y,
        ];
        let mut sum = Gathered::none(asked.gatherer.lamps, false);
        let mut all = 0.0f32;
        let turned = (place.normal - place.facing).to_array().map(|v| v as f32);
        let here = plane.point(at);
        let is_mixed = square.is_crossed || square.is_covered.iter().any(|it| *it);
        let is_covered = is_mixed && plane.is_covered(here, width, asked.casters);
        for (k, (corner, weight)) in corners.iter().zip(weights).enumerate() {
            // What lies under something has another light than what lies beside it.
            let is_beside = || {
                let there = corner_at(&plane, key, width, k);
                is_covered == square.is_covered[k] && is_open(asked.casters, here, there)
            };
            if is_mixed && !is_beside() {
                continue;
            }
            // A corner that lies just here counts for a little in any case.
            let weight = weight.max(1e-6) as f32;
            all += weight;
            for (lamp, light) in sum.light.iter_mut().enumerate() {
                let [x, y, z] = corner.tilt[lamp];
                let tilted = x * turned[0] + y * turned[1] + z * turned[2];
                *light = *light + (corner.light[lamp] + tilted) * weight;
                sum.error[lamp] += corner.error[lamp] * weight;
            }
        }
        if all <= 1e-3 {
            return None;
        }
        let not_dark =
            |color: Color| Color::new(color.r.max(0.0), color.g.max(0.0), color.b.max(0.0));
        sum.light.iter_mut().for_each(|color| *color = not_dark(*color * (1.0 / all)));
        sum.error.iter_mut().for_each(|error| *error /= all);
        Some(sum)
    }

    /// The widths of a scene's faces; what lies on a face has none of its own.
    pub(super) fn widths(&self, label: &str, asked: &Asked<'_>) -> &[f64] {
        let widths = self.widths.get_or_init(|| {
            let members = asked.gatherer.world.members();
            let of = |casters: &Casters| {
                let mut areas: Vec<f64> = Vec::new();
                for (at, piece) in casters.pieces().iter().enumerate() {
                    let face = piece.face as usize;
                    if areas.len() <= face {
                        areas.resize(face + 1, 0.0);
                    }
                    areas[face] += casters.normal(at, Toward::Direction(DVec3::Y)).length() / 2.0;
                }
                areas.into_iter().map(f64::sqrt).collect()
            };
            let casters = asked.casters.iter();
            casters.map(|(member, casters)| (members[*member].label.clone(), of(casters))).collect()
        });
        widths.get(label).map_or(&[], Vec::as_slice)
    }

    fn plane(&self, place: &Place, world: &World) -> Option<SurfacePlane> {
        let bounds = || {
            let all = world.casters().filter_map(|(_, casters)| casters.bounds());
            let [low, high] = all.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])?;
            let extent = (high - low).max_element();
            (extent > 0.0).then(|| ((low + high) / 2.0, extent))
        };
        let (centre, extent) = (*self.extent.get_or_init(bounds))?;
        let steps = (place.facing * 1e6).round();
        let normal = (steps / 1e6).normalize_or_zero();
        let step = extent * ABOVE;
        let distance = (normal.dot(place.position - centre) / step).round();
        let axes = normal.any_orthonormal_pair();
        // Above the plane, however its distance was rounded; and not where things begin and end.
        let aside = axes.0 * (ASIDE[0] * extent) + axes.1 * (ASIDE[1] * extent);
        let origin = centre + aside + normal * ((distance + 1.0) * step);
        let key = (steps.as_ivec3().to_array(), distance as i64);
        let axes = [axes.0, axes.1];
        Some(SurfacePlane { key, normal, axes, origin, widest: extent * COARSEST })
    }

    fn square(
        &self,
        key: SquareKey,
        plane: &SurfacePlane,
        width: f64,
        asked: &Asked<'_>,
    ) -> Arc<Square> {
        let shard = &self.squares[shard(&key)];
        if let Some(known) = shard.lock().unwrap_or_else(PoisonError::into_inner).get(&key) {
            return known.clone();
        }
        let middle = DVec2::new(key.at[0] as f64 + 0.5, key.at[1] as f64 + 0.5) * width;
        let stands = |beside: f64, above: f64| {
            let half = width * 0.5 + beside;
            let box_of = BoxOnPlane { plane, middle, half, above };
            asked.casters.iter().any(|(_, casters)| box_of.is_reached(casters))
        };
        let is_near = stands(width * APART, width * APART);
        let is_crossed = is_near && stands(width * 1e-3, width * 0.05);
        let is_covered = std::array::from_fn(|k| {
            is_near && plane.is_covered(corner_at(plane, key, width, k), width, asked.casters)
        });
        let made = Arc::new(Square { is_near, is_crossed, is_covered, corners: OnceLock::new() });
        let mut shard = shard.lock().unwrap_or_else(PoisonError::into_inner);
        shard.entry(key).or_insert(made).clone()
    }

    /// Whether light in a square differs from what its corners tell.
    fn differs(
        &self,
        square: &Square,
        key: SquareKey,
        plane: &SurfacePlane,
        asked: &Asked<'_>,
    ) -> bool {
        let corners = self.corners(square, key, plane, asked);
        let lights = |lamp: usize| corners.each_ref().map(|corner| corner.light[lamp].luminance());
        let mean = |lamp: usize| lights(lamp).iter().sum::<f32>() / 4.0;
        let error = |lamp: usize| corners.iter().map(|c| c.error[lamp]).fold(0.0, f32::max);
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
        let middle = self.record(SquareKey { level: key.level + 1, at, ..key }, plane, asked);
        lamps.into_iter().any(|lamp| {
            let off = (middle.light[lamp].luminance() - mean(lamp)).abs();
            off > BENDS * mean(lamp) + 2.0 * (error(lamp) + middle.error[lamp])
        })
    }

    fn corners<'s>(
        &self,
        square: &'s Square,
        key: SquareKey,
        plane: &SurfacePlane,
        asked: &Asked<'_>,
    ) -> &'s [Arc<Gathered>; 4] {
        // Not under a lock: what gathers may wait for others, who want these.
        if square.corners.get().is_none() {
            let _ = square.corners.set(std::array::from_fn(|k| {
                let at = [key.at[0] + (k & 1) as i64, key.at[1] + (k >> 1) as i64];
                Arc::new(self.smoothed(SquareKey { at, ..key }, plane, asked))
            }));
        }
        square.corners.get().expect("they are there")
    }

    /// What is received at a corner of squares of a level: the mean of the records around it, as far as it sees them and
    /// no more than noise tells them apart.
    fn smoothed(&self, key: SquareKey, plane: &SurfacePlane, asked: &Asked<'_>) -> Gathered {
        let own = self.record(key, plane, asked);
        let width = plane.widest / f64::from(1u32 << key.level);
        let here = corner_at(plane, key, width, 0);
        let is_covered = plane.is_covered(here, width, asked.casters);
        let mut sum = Gathered::none(asked.gatherer.lamps, true);
        let (mut all, mut squares) = (0.0f32, 0.0f32);
        for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
            let around = SquareKey { at: [key.at[0] + dx, key.at[1] + dy], ..key };
            let is_own = (dx, dy) == (0, 0);
            let there = corner_at(plane, around, width, 0);
            let is_beside = || {
                is_open(asked.casters, here, there)
                    && plane.is_covered(there, width, asked.casters) == is_covered
            };
            if !is_own && !is_beside() {
                continue;
            }
            let record = if is_own { own.clone() } else { self.record(around, plane, asked) };
            let is_alike = |lamp: usize| {
                let [a, b] = [&own, &record].map(|r| (r.light[lamp].luminance(), r.error[lamp]));
                let noise = (a.1 * a.1 + b.1 * b.1).sqrt();
                (a.0 - b.0).abs() <= ALIKE * noise
            };
            if !is_own && !(0..own.light.len()).all(is_alike) {
                continue;
            }
            let weight = [4.0, 2.0, 1.0][(dx.abs() + dy.abs()) as usize];
            (all, squares) = (all + weight, squares + weight * weight);
            for lamp in 0..own.light.len() {
                sum.light[lamp] = sum.light[lamp] + record.light[lamp] * weight;
                sum.error[lamp] += record.error[lamp] * weight;
                for (tilt, part) in sum.tilt[lamp].iter_mut().zip(record.tilt[lamp]) {
                    *tilt = *tilt + part * weight;
                }
            }
        }
        // Independent of each other, they are off together by less than one is.
        let less = squares.sqrt() / all;
        sum.light.iter_mut().for_each(|light| *light = *light * (1.0 / all));
        sum.tilt.iter_mut().flatten().for_each(|tilt| *tilt = *tilt * (1.0 / all));
        sum.error.iter_mut().for_each(|error| *error *= less / all);
        sum
    }

    fn record(&self, mut key: SquareKey, plane: &SurfacePlane, asked: &Asked<'_>) -> Arc<Gathered> {
        // The corners of wider squares are corners of finer ones.
        while key.level > 0 && key.at.iter().all(|at| at % 2 == 0) {
            key = SquareKey { level: key.level - 1, at: key.at.map(|at| at / 2), ..key };
        }
        let shard = &self.records[shard(&key)];
        if let Some(known) = shard.lock().unwrap_or_else(PoisonError::into_inner).get(&key) {
            return known.clone();
        }
        let width = plane.widest / f64::from(1u32 << key.level);
        let position = corner_at(plane, key, width, 0);
        let place = Place {
            position,
            facing: plane.normal,
            normal: plane.normal,
            screen: DVec2::ZERO,
            before: (position - asked.gatherer.like.view.camera().position).length(),
            width: 0.0,
            weight: Color::WHITE,
            pattern: Pattern::from_seed(seed(&key)),
        };
        let made = (asked.receives)(&place);
        let mut shard = shard.lock().unwrap_or_else(PoisonError::into_inner);
        // Another may have made it meanwhile: it is the same.
        shard.entry(key).or_insert(Arc::new(made)).clone()
    }
}

fn shard(key: &SquareKey) -> usize {
    let mut hasher = DefaultHasher::new();
    key.hash(&mut hasher);
    hasher.finish() as usize % SHARDS
}

/// A number that differs from place to place, and not with the size of the world.
fn seed(key: &SquareKey) -> u64 {
    let SquareKey { plane: ([x, y, z], distance), level, at: [u, v] } = *key;
    let parts = [i64::from(x), i64::from(y), i64::from(z), distance, i64::from(level), u, v];
    let mix = |sum: u64, part: i64| {
        (sum ^ part as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29)
    };
    parts.into_iter().fold(0, mix)
}

/// A corner of a square.
fn corner_at(plane: &SurfacePlane, key: SquareKey, width: f64, k: usize) -> DVec3 {
    let at = DVec2::new((key.at[0] + (k & 1) as i64) as f64, (key.at[1] + (k >> 1) as i64) as f64);
    plane.point(at * width)
}

/// Whether nothing opaque stands between two points.
fn is_open(casters: &[(usize, &Casters)], from: DVec3, to: DVec3) -> bool {
    let ray = Ray::new(from, to - from, BEYOND);
    casters.iter().all(|(_, casters)| {
        let mut is_open = true;
        casters.meet_all(&ray, |hit| {
            is_open = casters.pieces()[hit.piece].opacity != 1.0;
            is_open
        });
        is_open
    })
}

/// A box that stands on a square.
struct BoxOnPlane<'a> {
    plane: &'a SurfacePlane,
    middle: DVec2,
    half: f64,
    above: f64,
}

impl BoxOnPlane<'_> {
    /// Whether an opaque piece reaches into it.
    fn is_reached(&self, casters: &Casters) -> bool {
        let SurfacePlane { normal, axes, .. } = *self.plane;
        let middle = self.plane.point(self.middle);
        let side = |way: DVec3, least: f64| (way, -way.dot(middle) - least);
        let planes = vec![
            side(axes[0], -self.half),
            side(-axes[0], -self.half),
            side(axes[1], -self.half),
            side(-axes[1], -self.half),
            side(normal, 0.0),
            side(-normal, -self.above),
        ];
        let shaft = Shaft { planes };
        let mut is_reached = false;
        casters.within(&shaft, |piece| {
            if is_reached || casters.pieces()[piece].opacity != 1.0 || casters.card(piece).is_some()
            {
                return;
            }
            let mut points: Vec<DVec3> =
                casters.corners(piece, Toward::Direction(normal)).collect();
            for (way, offset) in &shaft.planes {
                let sides: Vec<f64> = points.iter().map(|point| way.dot(*point) + offset).collect();
                if sides.iter().all(|side| *side <= 0.0) {
                    return;
                }
                if sides.iter().any(|side| *side < 0.0) {
                    points = split(&points, &sides).0;
                }
                if points.len() < 3 {
                    return;
                }
            }
            is_reached = true;
        });
        is_reached
    }
}
