//! What fragments receive of other surfaces, and of lamps that are found at records.

use glam::DVec2;
use std::sync::Arc;
use std::time::Instant;

use super::bounces::{Bounces, Gather, Gathered, Gatherer, Place};
use super::direct::{GreyOrColors, Lighting, LitFragment, wants_error};
use super::illuminate::{Illuminate, Shadows};
use super::pattern::Pattern;
use super::recorded::RecordedLamp;
use super::records::{Asked, AskedFace};
use crate::color::Color;
use crate::fragment::{Around, Fragments, Shading, Stage, World};
use crate::key::{Key, KeyHasher};
use crate::light::Lamp;

/// What a fragment receives of other surfaces, of a lamp of unit strength or of what glows.
#[derive(Debug)]
pub(super) struct Reflected {
    /// Irradiance in lux.
    pub(super) light: GreyOrColors,
    /// By how much it may be off. Empty if nobody asks, or by nothing.
    pub(super) error: Vec<f32>,
}

/// One side of a fragment.
#[derive(Clone, Copy)]
struct Side {
    i: usize,
    is_back: bool,
}

impl Side {
    fn of(self, fragments: &Fragments<'_>) -> LitFragment {
        let front = LitFragment::new(fragments, self.i);
        if self.is_back { front.behind().unwrap_or(front) } else { front }
    }
}

impl Illuminate {
    /// What fragments receive of other surfaces, and of lamps that are recorded: of each lamp that does not shine
    /// everywhere, and then of what glows.
    pub(super) fn reflected(
        &self,
        fragments: &Fragments<'_>,
        around: &Around<'_>,
    ) -> Vec<Arc<Reflected>> {
        let bounced = fragments.bounced();
        let Some(Stage::Shade(own)) = around.stack.get(around.at) else { return Vec::new() };
        let is_recorded = |lamp: &Lamp| lamp.shines() && self.is_recorded(lamp, bounced > 0);
        let is_needed = bounced < self.bounces.times || self.lamps.iter().any(is_recorded);
        let Some(world) = own.world().filter(|_| is_needed) else {
            return Vec::new();
        };
        let goes_on = |lamp: &&Lamp| lamp.shines() && !lamp.light.is_everywhere();
        let lamps: Vec<&Lamp> = self.lamps.iter().filter(goes_on).collect();
        let wants_error = wants_error(fragments);
        let key = |what: Key| {
            let mut key = KeyHasher::new("reflected");
            let Bounces { times, gather, .. } = self.bounces;
            key.key(what).value(&(self.shadows, self.samples, times, gather, wants_error));
            // Colours are read of all that is around.
            key.key(world.key());
            around.changes_before().for_each(|stage| {
                key.key(stage.key());
            });
            key.finish()
        };
        let glow = Key::of_bytes(b"glow");
        let keys: Vec<Key> = lamps.iter().map(|lamp| lamp.key()).chain([glow]).map(key).collect();
        let mut known: Vec<Option<Arc<Reflected>>> = keys
            .iter()
            .map(|key| around.batch.kept(*key).and_then(|kept| kept.downcast().ok()))
            .collect();
        if known.iter().any(Option::is_none) {
            let clock = Instant::now();
            let missing: Vec<usize> = (0..lamps.len()).filter(|at| known[*at].is_none()).collect();
            let made = self.gathered(
                (&missing.iter().map(|at| lamps[*at]).collect::<Vec<_>>(), bounced),
                (fragments, wants_error),
                (around, world),
            );
            let seconds = clock.elapsed().as_secs_f64() / made.len() as f64;
            for (at, made) in missing.into_iter().chain([lamps.len()]).zip(made) {
                let bytes = made.light.bytes() + size_of_val(&*made.error);
                let made = Arc::new(made);
                around.batch.keep(keys[at], made.clone(), bytes, seconds);
                known[at] = Some(made);
            }
        }
        known.into_iter().flatten().collect()
    }

    /// What fragments receive of other surfaces of some lamps, and then of what glows.
    fn gathered(
        &self,
        (lamps, bounced): (&[&Lamp], u32),
        (fragments, wants_error): (&Fragments<'_>, bool),
        (around, world): (&Around<'_>, &Arc<World>),
    ) -> Vec<Reflected> {
        let batch = around.batch;
        let stage = if bounced > 0 {
            // They have unit strength already.
            around.stack[around.at].clone()
        } else {
            let unit = |(number, lamp): (usize, &&Lamp)| {
                Lamp::new(number.to_string(), true, Color::WHITE, lamp.light.clone())
            };
            let lamps = lamps.iter().enumerate().map(unit).collect();
            let unit = Illuminate { lamps, white: 1.0, ..self.clone() };
            Stage::Shade(Shading::new(Arc::new(unit), || world.clone()))
        };
        let gatherer = Gatherer {
            world,
            stage,
            lamps: lamps.len(),
            like: fragments,
            batch,
            turns: fragments.sight.as_ref().map_or(0, |sight| sight.turns),
            bounced,
        };
        let place = |side: Side| {
            let Side { i, .. } = side;
            let spot = side.of(fragments);
            let sight = fragments.sight.as_ref();
            Place {
                position: spot.receiver.position,
                facing: spot.facing,
                normal: spot.receiver.normal,
                screen: DVec2::new(fragments.x[i], fragments.y[i]),
                before: sight.map_or(0.0, |sight| sight.before[i]) + fragments.way(i).2,
                width: fragments.width(i),
                weight: sight.map_or(Color::WHITE, |sight| sight.weight[i]),
                pattern: Pattern::of(fragments, i),
                starts: Vec::new(),
            }
        };
        let goes_on = bounced < self.bounces.times;
        let recorded: Vec<usize> =
            (0..lamps.len()).filter(|lamp| self.is_recorded(lamps[*lamp], bounced > 0)).collect();
        let lit = (0..fragments.len()).filter(|i| !fragments.unlit[*i]);
        let sides = lit.flat_map(|i| {
            let back = fragments.finish[i].transmits().then_some(Side { i, is_back: true });
            [Side { i, is_back: false }].into_iter().chain(back)
        });
        let count = lamps.len() + 1;
        let mut light = vec![vec![Color::BLACK; fragments.len()]; count];
        let mut error = vec![vec![0.0f32; if wants_error { fragments.len() } else { 0 }]; count];
        let mut take = |side: Side, found: &Gathered| {
            let Side { i, is_back } = side;
            let through = if is_back { fragments.finish[i].transmit } else { Color::WHITE };
            for (lamp, color) in found.light.iter().enumerate() {
                light[lamp][i] = light[lamp][i] + *color * through;
                if wants_error {
                    error[lamp][i] += found.error[lamp] * through.luminance();
                }
            }
        };
        // From the first surface on, one ray is enough for each that comes.
        let mut rays = match self.bounces.gather {
            Gather::Rays(rays) if bounced == 0 => rays,
            _ => 1,
        };
        let mut by_itself: Vec<Side> = sides.collect();
        if let Some(count) = self.bounces.records(bounced) {
            let mut key = KeyHasher::new("field");
            // Pictures may look different to others who resolve the same image, and how many rays a corner takes depends
            // on the view and its pixels.
            key.key(gatherer.stage.key()).value(&(bounced, fragments.textures));
            let raster = fragments.view.raster();
            let pixel = (raster.width, raster.height, fragments.pixel.to_array());
            key.value(&(fragments.view.camera(), pixel));
            let field = self.bounces.field(key.finish());
            let casters: Vec<_> = world.casters().collect();
            let (gatherer, casters) = (&gatherer, &*casters);
            let casts = (self.shadows != Shadows::Off).then_some(casters);
            let recorded_lamp = |number: &usize| {
                let (number, light) = (*number, &*lamps[*number].light);
                RecordedLamp { number, light, casts, world, like: fragments }
            };
            let recorded: Vec<_> = recorded.iter().map(recorded_lamp).collect();
            let asked = Asked { gatherer, casters, rays: count, goes_on, lamps: &recorded };
            let turns = !fragments.cards.is_empty();
            let (scene, faces) = (fragments.scene, field.faces(fragments.scene, &asked));
            let mut found = Gathered::none(lamps.len(), false);
            by_itself.retain(|side| {
                if turns {
                    return true;
                }
                let ordinal = fragments.ordinal[side.i];
                let is_front = fragments.sees_front[side.i] != side.is_back;
                let extent = faces.get(ordinal as usize);
                let face = AskedFace { scene, ordinal, is_front, extent };
                let is_found = field.at(&place(*side), &face, &asked, &mut found);
                if is_found {
                    take(*side, &found);
                }
                !is_found
            });
            // What mirrors show is averaged over their rays.
            let is_mirrored = fragments.sight.is_some();
            rays = if bounced == 0 && !is_mirrored { self.samples } else { 1 };
            for lamp in &recorded {
                let number = lamp.number;
                let lighting = Lighting::new(self, lamps[number], fragments, around);
                for side in &by_itself {
                    let one = lighting.on_side(&side.of(fragments), side.i);
                    let mut found = Gathered::none(lamps.len(), false);
                    (found.light[number], found.error[number]) = (one.diffuse, one.error);
                    take(*side, &found);
                }
            }
        }
        if goes_on {
            let places: Vec<Place> = by_itself.iter().map(|side| place(*side)).collect();
            for (side, found) in by_itself.iter().zip(gatherer.gather(&places, rays, false)) {
                take(*side, &found);
            }
        }
        let all = light.into_iter().zip(error);
        all.map(|(light, error)| Reflected { light: GreyOrColors::new(light), error }).collect()
    }
}
