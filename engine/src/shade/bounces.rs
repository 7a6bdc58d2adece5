//! Light that surfaces send on to others (\[D], "mutual interreflection of light, color bleeding").
//!
//! The colour of a lit surface stands for the illuminance under which a white one looks as bright. What a place receives
//! of other surfaces is therefore the mean of their colours over rays that are spread around its normal as the cosine
//! is. Rays meet fragments that run through the stacks of their sources, and then through the same lights at unit
//! strength: so what came from each lamp stays apart, and a lamp may be dimmed, coloured and switched afterwards.
//!
//! What shines counts here as if it reflected to all sides. What shows a light, and what is not lit, sends nothing on:
//! that light is counted where it comes from.

use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::sync::Arc;

use super::follow::{Followed, Follower, StackRun};
use super::pattern::Pattern;
use super::records::{Field, Fields};
use crate::color::Color;
use crate::fragment::{Batch, Fragments, LightLayers, Sight, Stage, World};
use crate::key::Key;
use crate::math;
use crate::trace::Accelerator;

/// Rays that are followed together, about: what they meet is held at once.
const SLICE: usize = 1 << 15;

/// What counts for less than this share of a ray is not followed.
const LEAST: f32 = 1e-3;

/// How often light goes on from surface to surface, and how that is found.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Bounces {
    /// The most surfaces that light goes on from before it is received.
    pub times: u32,
    /// How what is received is found.
    pub gather: Gather,
    #[serde(skip)]
    fields: Arc<Fields>,
}

/// How the light is found that surfaces send on to a place: time for accuracy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Gather {
    /// By so many rays, 16 to 65536, at places that are spread over each surface as finely as the light varies there;
    /// between them it is interpolated.
    Records(u32),
    /// By so many rays, 1 to 65536, from each fragment: right in the mean, and grainy.
    Rays(u32),
}

impl Default for Gather {
    fn default() -> Gather {
        Gather::Records(64)
    }
}

impl Bounces {
    /// Light goes on so often.
    pub fn new(times: u32, gather: Gather) -> Bounces {
        Bounces { times, gather, fields: Arc::default() }
    }

    /// What is known under a key.
    pub(super) fn field(&self, key: Key) -> Arc<Field> {
        self.fields.of(key)
    }

    /// How many rays gather for a record, if records are made: fewer for what is seen by others alone.
    pub(super) fn records(&self, bounced: u32) -> Option<u32> {
        match self.gather {
            Gather::Records(rays) if bounced == 0 => Some(rays),
            Gather::Records(rays) => Some((rays / 4).max(16)),
            Gather::Rays(_) => None,
        }
    }
}

/// A place that receives light of surfaces.
pub(super) struct Place {
    pub(super) position: DVec3,
    /// The unit normal of the face.
    pub(super) facing: DVec3,
    /// The unit normal about which rays are spread.
    pub(super) normal: DVec3,
    pub(super) screen: DVec2,
    pub(super) before: f64,
    /// The width of what it stands for.
    pub(super) width: f64,
    /// How much it counts in the picture.
    pub(super) weight: Color,
    pub(super) pattern: Pattern,
    /// Where its rays start, in turn; if nothing is here, at its position.
    pub(super) starts: Vec<DVec3>,
}

impl Place {
    /// Where one of its rays starts.
    pub(super) fn start(&self, ray: u32) -> DVec3 {
        let at = ray as usize % self.starts.len().max(1);
        self.starts.get(at).copied().unwrap_or(self.position)
    }
}

/// What a place receives: of each light at unit strength, in lux, and then of what glows.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Gathered {
    pub(super) light: Vec<Color>,
    /// By how much that grows as the normal turns toward each axis; empty if nobody asks.
    pub(super) tilt: Vec<[Color; 3]>,
    /// The standard error of each.
    pub(super) error: Vec<f32>,
}

impl Gathered {
    /// Nothing of so many lights.
    pub(super) fn none(lamps: usize, wants_tilt: bool) -> Gathered {
        Gathered {
            light: vec![Color::BLACK; lamps + 1],
            tilt: vec![[Color::BLACK; 3]; if wants_tilt { lamps + 1 } else { 0 }],
            error: vec![0.0; lamps + 1],
        }
    }

    /// Makes it nothing again.
    pub(super) fn clear(&mut self) {
        self.light.fill(Color::BLACK);
        self.tilt.fill([Color::BLACK; 3]);
        self.error.fill(0.0);
    }
}

/// Gathers what surfaces of a world send on.
pub(super) struct Gatherer<'a> {
    pub(super) world: &'a World,
    /// The lights at unit strength, with no names but numbers.
    pub(super) stage: Stage,
    pub(super) lamps: usize,
    pub(super) like: &'a Fragments<'a>,
    pub(super) batch: &'a dyn Batch,
    /// How often what is seen turned on the way to the camera, and went on to all sides.
    pub(super) turns: u32,
    pub(super) bounced: u32,
}

impl Gatherer<'_> {
    /// What places receive, by so many rays each.
    pub(super) fn gather(&self, places: &[Place], rays: u32, wants_tilt: bool) -> Vec<Gathered> {
        let mut all = Vec::with_capacity(places.len());
        let at_once = (SLICE / rays.max(1) as usize).max(1);
        for places in places.chunks(at_once) {
            if self.batch.is_stopped() {
                let nothing = Gathered::none(self.lamps, wants_tilt);
                all.extend(places.iter().map(|_| nothing.clone()));
                continue;
            }
            self.gather_slice(places, rays, wants_tilt, &mut all);
        }
        all
    }

    fn gather_slice(
        &self,
        places: &[Place],
        count: u32,
        wants_tilt: bool,
        all: &mut Vec<Gathered>,
    ) {
        let share = 1.0 / count as f32;
        // The part of a half-space that a ray stands for.
        let widens = (TAU / f64::from(count)).sqrt();
        let mut rays = Vec::with_capacity(places.len() * count as usize);
        for (from, place) in places.iter().enumerate() {
            let (u, v) = place.normal.any_orthonormal_pair();
            for k in 0..count {
                let choice = place.pattern.at(k);
                let (across, turn) = (choice.x.sqrt(), TAU * choice.y);
                let side = u * math::cos(turn) + v * math::sin(turn);
                let direction = side * across + place.normal * (1.0 - choice.x).sqrt();
                // Of what is below its face a place sees nothing, whatever its normal says: it sees what is above
                // instead.
                let below = direction.dot(place.facing).min(0.0);
                let direction = direction - place.facing * (2.0 * below);
                rays.push(Followed {
                    from,
                    origin: place.start(k),
                    direction,
                    share: Color::WHITE,
                    weight: place.weight * share,
                    absorb: Color::BLACK,
                    plane: (place.facing, place.position),
                    screen: place.screen,
                    before: place.before,
                    width: [place.width, widens],
                });
            }
        }
        let follower = Follower {
            world: self.world,
            view: self.like.view,
            accelerator: &Accelerator::Tree,
            least: LEAST * share,
            sees_beyond: false,
        };
        let met = follower.meet(&rays, self.batch);
        let mut empty = Fragments::new(self.like.view);
        (empty.pixel, empty.textures) = (self.like.pixel, self.like.textures);
        empty.layers = Some(LightLayers::default());
        let (turns, bounced) = (self.turns, self.bounced + 1);
        empty.sight = Some(Sight { turns, bounced, ..Sight::default() });
        let onward = std::slice::from_ref(&self.stage);
        let run =
            StackRun { empty: &empty, world: self.world, onward, batch: self.batch, key: None };
        let shaded = run.shade(&rays, &met);
        let lamps = self.lamps + 1;
        // What each ray finds: of the lamps one after the other, then of what glows.
        let mut found = vec![Color::BLACK; rays.len() * lamps];
        let mut number = 0;
        shaded.each(&rays, |ray, share, seen| {
            // Rays come in their order.
            while !std::ptr::eq(ray, &raw const rays[number]) {
                number += 1;
            }
            let Some((fragments, i)) = seen else { return };
            let layers = fragments.layers.iter().flat_map(LightLayers::iter);
            let layers = layers.filter(|(name, _)| *name != LightLayers::ERROR);
            for (sum, (_, colors)) in found[number * lamps..][..lamps].iter_mut().zip(layers) {
                *sum = *sum + colors[i] * share;
            }
        });
        for (at, place) in places.iter().enumerate() {
            let part = at * count as usize..(at + 1) * count as usize;
            let found = &found[part.start * lamps..part.end * lamps];
            let mut gathered = Gathered::none(self.lamps, wants_tilt);
            for (ray, found) in rays[part].iter().zip(found.chunks_exact(lamps)) {
                let along = tilted(ray.direction, place.normal);
                for (lamp, color) in found.iter().enumerate() {
                    let part = *color * share;
                    gathered.light[lamp] = gathered.light[lamp] + part;
                    for (tilt, along) in
                        gathered.tilt.get_mut(lamp).into_iter().flatten().zip(along)
                    {
                        *tilt = *tilt + part * along;
                    }
                }
            }
            for (lamp, error) in gathered.error.iter_mut().enumerate() {
                let of_rays = found[lamp..].iter().step_by(lamps).map(|color| color.luminance());
                *error = standard_error(of_rays, count);
            }
            all.push(gathered);
        }
    }
}

/// Into how many parts a pattern is divided to tell by how much its mean is off.
const PARTS: u32 = 16;

/// The standard error of the mean of what the points of a pattern give, by the means of its parts: each is spread as
/// evenly as the whole. Taken point by point it would be several times too large.
pub(super) fn standard_error(values: impl Iterator<Item = f32>, count: u32) -> f32 {
    let parts = if count >= 2 * PARTS { PARTS } else { count };
    let size = count / parts;
    let (mut sums, mut sizes) = ([0.0f64; 2 * PARTS as usize], [0.0f64; 2 * PARTS as usize]);
    for (k, value) in (0..count).zip(values) {
        let part = (k / size).min(parts - 1) as usize;
        sums[part] += f64::from(value);
        sizes[part] += 1.0;
    }
    let mean = sums.iter().sum::<f64>() / f64::from(count);
    // One says nothing of its error: as much as it is.
    if parts < 2 {
        return mean.abs() as f32;
    }
    let means = sums.iter().zip(&sizes).take(parts as usize).map(|(sum, size)| sum / size);
    let squares: f64 = means.map(|part| (part - mean) * (part - mean)).sum();
    (squares / f64::from(parts * (parts - 1))).sqrt() as f32
}

/// By how much light from a direction grows as a normal turns toward each axis, as a share of it; what grazes counts for
/// no more than at a small angle.
pub(super) fn tilted(direction: DVec3, normal: DVec3) -> [f32; 3] {
    let cosine = direction.dot(normal);
    let along = (direction - normal * cosine) / cosine.max(0.1);
    along.to_array().map(|v| v as f32)
}
