//! Local ray tracing (\[N], "Local ray tracing"; \[D], "High-quality image display"): what surfaces mirror
//! and let through, followed by rays from the fragments that they cover, and from no other.
//!
//! What a ray meets runs through the stack of its own source, and its mirrors are followed in turn.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::follow::{Followed, Follower, Met, StackRun};
use super::pattern::{Pattern, Spread};
use crate::color::Color;
use crate::fragment::{
    Around, Batch, Columns, Finish, Fragments, Hiding, LightLayers, Optics, Shader, Sight, World,
};
use crate::key::{Key, KeyHasher};
use crate::light::seen::SeenSky;
use crate::trace::Accelerator;

/// Rays that are followed together, about: what they meet is held at once.
const SLICE: usize = 1 << 16;

/// Follows rays from surfaces whose [`Optics`] mirror or refract.
///
/// What is mirrored takes the place of the surface's own colour, by its share; what is refracted is added.
/// A translucent surface hides more of what is behind it by what it mirrors.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Trace {
    /// Rays from each visible fragment, spread over what it covers, 1 or more. Each of them is followed by
    /// one ray of each kind at the surfaces that it meets.
    pub rays: u32,
    /// At how many surfaces one behind the other rays turn, 0 or more.
    pub depth: u32,
    /// Rays that count for less in the picture are not followed, as a share of it: 0 or more.
    pub least: f32,
    /// What rays find that meet nothing.
    pub background: Color,
    /// A sky that they find instead, and suns.
    pub sky: Option<SeenSky>,
    /// How the surfaces that rays meet are found.
    pub accelerator: Accelerator,
}

#[typetag::serde]
impl Shader for Trace {
    fn reads(&self) -> Columns {
        Columns::COLOR | Columns::FINISH | Columns::NORMAL | Columns::FACING | Columns::TRACED
    }

    fn hiding(&self) -> Hiding {
        Hiding::Raises
    }

    fn changes(&self) -> Columns {
        Columns::COLOR
    }

    fn shade(&self, fragments: &mut Fragments<'_>, around: &Around<'_>) {
        let turns = fragments.sight.as_ref().map_or(0, |sight| sight.turns);
        let Some(world) = around.world.filter(|_| turns < self.depth) else { return };
        let mut mirrored = vec![Color::BLACK; fragments.len()];
        let mut shown: Option<TracedColors> = None;
        let mut next = 0;
        // A slice of fragments at a time: what all rays of a batch meet could fill the memory.
        while next < fragments.len() {
            let key = self.key(world, around, next);
            let rays = self.rays(fragments, around.batch, &mut mirrored, &mut next);
            if rays.is_empty() {
                continue;
            }
            let met = around.batch.or_made(key, || {
                let follower = Follower {
                    world,
                    view: fragments.view,
                    accelerator: &self.accelerator,
                    least: self.least,
                    sees_beyond: true,
                };
                let met = follower.meet(&rays, around.batch);
                let bytes = size_of_val(&*met);
                (met, bytes)
            });
            let shown = shown.get_or_insert_with(|| TracedColors::new(fragments));
            self.show(&rays, &met, fragments, (world, around, key), shown);
        }
        if let Some(shown) = shown {
            blend(fragments, &mirrored, shown);
        }
    }
}

impl Trace {
    /// What is kept of rays depends on this, beside the fragments that they start from.
    fn key(&self, world: &World, around: &Around<'_>, first: usize) -> Key {
        let mut key = KeyHasher::new("trace");
        key.value(&(self.rays, self.depth, self.least, first)).key(world.geometry());
        around.changes_before().for_each(|stage| {
            key.key(stage.key());
        });
        key.finish()
    }

    /// The rays of fragments from the `next` on, a slice of them, and by fragment the share that is
    /// mirrored.
    fn rays(
        &self,
        fragments: &Fragments<'_>,
        batch: &dyn Batch,
        mirrored: &mut [Color],
        next: &mut usize,
    ) -> Vec<Followed> {
        // Only what the camera sees has many rays: with several at each turn they would grow as a
        // power.
        let is_first = fragments.sight.is_none();
        let count = if is_first { self.rays.max(1) } else { 1 };
        let mut rays = Vec::new();
        while *next < fragments.len() && rays.len() < SLICE {
            let (i, mirrored) = (*next, &mut mirrored[*next]);
            *next += 1;
            let finish = fragments.finish[i];
            let Some(optics) = finish.optics else { continue };
            let spread = Spread::new(if count > 1 { batch.pieces(i) } else { Vec::new() });
            let pattern = Pattern::of(fragments, i);
            let surface = TracedSurface::new(fragments, i, &finish);
            let plane = (surface.facing, fragments.position[i]);
            let screen = DVec2::new(fragments.x[i], fragments.y[i]);
            let before = fragments.sight.as_ref().map_or(0.0, |sight| sight.before[i]);
            let before = before + fragments.way(i).2;
            let widens = fragments.view.pixel_width(0.0).1 * fragments.pixel.x;
            let width = [fragments.width(i), widens];
            let weight = fragments.sight.as_ref().map_or(Color::WHITE, |sight| sight.weight[i]);
            let share = 1.0 / count as f32;
            let alpha = fragments.alpha[i];
            // The space in front of the seen side, and the one behind it.
            let spaces = match fragments.sees_front[i] {
                true => [Color::BLACK, optics.absorb],
                false => [optics.absorb, Color::BLACK],
            };
            let counts = |part: Color| (part * weight).greatest() > self.least;
            for k in 0..count {
                let beside = spread.on_plane(pattern.at(k), fragments, i, surface.facing);
                let origin = beside.unwrap_or(fragments.position[i]);
                let along = -fragments.to_eye_from(i, origin);
                let turned = surface.turn(along, &optics, fragments.sees_front[i]);
                let mut follow = |direction: DVec3, part: Color, absorb: Color| {
                    rays.push(Followed {
                        from: i,
                        origin,
                        direction,
                        share: part * share,
                        weight: weight * part,
                        absorb,
                        plane,
                        screen,
                        before,
                        width,
                    });
                };
                // What is not followed leaves the surface its own colour.
                if counts(turned.reflect) {
                    *mirrored = *mirrored + turned.reflect * share;
                    follow(turned.mirrored, turned.reflect, spaces[0]);
                }
                // What is behind is seen past the surface where it hides nothing, and through it where it does.
                let refract = turned.refract * alpha;
                if let Some(refracted) = turned.refracted.filter(|_| counts(refract)) {
                    follow(refracted, refract, spaces[1]);
                }
            }
        }
        rays
    }

    /// What rays show of the surfaces that they met: by fragment, and by layer if fragments have them.
    fn show(
        &self,
        rays: &[Followed],
        met: &[Met],
        fragments: &Fragments<'_>,
        (world, around, key): (&World, &Around<'_>, Key),
        shown: &mut TracedColors,
    ) {
        let mut empty = Fragments::new(fragments.view);
        (empty.pixel, empty.textures) = (fragments.pixel, fragments.textures);
        let before = fragments.sight.as_ref();
        let turns = before.map_or(0, |sight| sight.turns) + 1;
        let bounced = fragments.bounced();
        let sent = before.map_or(self.rays, |sight| sight.rays);
        empty.sight = Some(Sight { turns, bounced, rays: sent, ..Sight::default() });
        empty.layers = fragments.layers.as_ref().map(|_| LightLayers::default());
        // What is done from here on to everything in the image.
        let onward = &around.stack[around.at..];
        let run = StackRun { empty: &empty, world, onward, batch: around.batch, key: Some(key) };
        let shaded = run.shade(rays, met);
        shaded.each(rays, |ray, share, seen| match seen {
            Some((seen, i)) => shown.add(ray.from, share, seen, i),
            None => shown.add_rest(ray.from, share * self.beyond(ray.direction)),
        });
    }

    /// What is seen in a direction where nothing is.
    fn beyond(&self, direction: DVec3) -> Color {
        match &self.sky {
            Some(sky) => sky.color(direction, None),
            None => self.background,
        }
    }
}

/// A surface where a ray turns.
struct TracedSurface {
    normal: DVec3,
    facing: DVec3,
}

/// How a ray goes on.
struct Onward {
    mirrored: DVec3,
    refracted: Option<DVec3>,
    reflect: Color,
    refract: Color,
}

impl TracedSurface {
    fn new(fragments: &Fragments<'_>, i: usize, finish: &Finish) -> TracedSurface {
        let smooth = fragments.normal[i].as_dvec3();
        let facing = fragments.facing.get(i).copied().unwrap_or(smooth);
        TracedSurface { normal: if finish.flat { facing } else { smooth }, facing }
    }

    /// The ways on of a ray that comes along a unit vector, to the front or the back.
    fn turn(&self, along: DVec3, optics: &Optics, sees_front: bool) -> Onward {
        // A smooth normal may be turned away from where it is seen.
        let cosine = |normal: DVec3| -normal.dot(along);
        let normal = if cosine(self.normal) > 1e-6 { self.normal } else { self.facing };
        let cos = cosine(normal).clamp(1e-9, 1.0);
        // What lets nothing through has no inside.
        let is_solid = optics.refract == Color::BLACK;
        let index = f64::from(optics.index);
        let ratio = if sees_front || is_solid { 1.0 / index } else { index };
        let sine2 = ratio * ratio * (1.0 - cos * cos);
        let inner = (sine2 < 1.0).then(|| (1.0 - sine2).sqrt());
        let bounce = |normal: DVec3| along + normal * (2.0 * cosine(normal));
        // Smooth normals may send a mirrored ray into the face itself.
        let mirrored = match bounce(normal) {
            way if way.dot(self.facing) > 0.0 => way,
            _ => bounce(self.facing),
        };
        let bend = |inner: f64| {
            let way = along * ratio + normal * (ratio * cos - inner);
            if way.dot(self.facing) < 0.0 { way } else { along }
        };
        let refracted = inner.filter(|_| !is_solid).map(bend).map(DVec3::normalize_or_zero);
        let (reflect, refract) = match (optics.fresnel, inner) {
            (true, Some(inner)) => {
                let share = fresnel(cos, inner, ratio) as f32;
                (optics.reflect * share, optics.refract * (1.0 - share))
            }
            (true, None) => (optics.reflect, Color::BLACK),
            (false, Some(_)) => (optics.reflect, optics.refract),
            // Reflected totally.
            (false, None) if !is_solid => (optics.reflect + optics.refract, Color::BLACK),
            (false, None) => (optics.reflect, Color::BLACK),
        };
        Onward { mirrored: mirrored.normalize_or_zero(), refracted, reflect, refract }
    }
}

/// The share of light that is mirrored, by the cosines outside and inside and the ratio of the indices
/// outside and inside.
fn fresnel(outer: f64, inner: f64, ratio: f64) -> f64 {
    let across = (ratio * outer - inner) / (ratio * outer + inner);
    let along = (ratio * inner - outer) / (ratio * inner + outer);
    (across * across + along * along) / 2.0
}

/// What rays show, by fragment.
struct TracedColors {
    color: Vec<Color>,
    layers: Option<LightLayers>,
}

impl TracedColors {
    fn new(fragments: &Fragments<'_>) -> TracedColors {
        let layers = fragments.layers.as_ref().map(|_| LightLayers::default());
        TracedColors { color: vec![Color::BLACK; fragments.len()], layers }
    }

    fn add(&mut self, fragment: usize, share: Color, seen: &Fragments<'_>, i: usize) {
        self.color[fragment] = self.color[fragment] + seen.color[i] * share;
        if let (Some(own), Some(layers)) = (&mut self.layers, &seen.layers) {
            for (name, colors) in layers.iter() {
                let layer = &mut own.layer(name, self.color.len())[fragment];
                *layer = *layer + colors[i] * share;
            }
        }
    }

    fn add_rest(&mut self, fragment: usize, color: Color) {
        self.color[fragment] = self.color[fragment] + color;
        if let Some(layers) = &mut self.layers {
            let rest = &mut layers.layer(LightLayers::REST, self.color.len())[fragment];
            *rest = *rest + color;
        }
    }
}

/// Adds what rays show to what is left of the fragments' own colours.
fn blend(fragments: &mut Fragments<'_>, mirrored: &[Color], shown: TracedColors) {
    let one = |color: Color| Color::WHITE + color * -1.0;
    let count = fragments.len();
    // By fragment: the factors of its own colour, and of what rays show.
    let factors: Vec<(Color, f32)> = (0..count)
        .map(|i| {
            let (own, alpha) = (one(mirrored[i]), fragments.alpha[i]);
            if alpha >= 1.0 {
                return (own, 1.0);
            }
            // What is mirrored hides what is behind, even where the surface itself is clear.
            let hides = 1.0 - (1.0 - alpha) * (1.0 - mirrored[i].greatest().min(1.0));
            fragments.alpha[i] = hides;
            if hides > 0.0 { (own * (alpha / hides), 1.0 / hides) } else { (own, 0.0) }
        })
        .collect();
    let mix = |i: usize, own: Color, shown: Color| own * factors[i].0 + shown * factors[i].1;
    for i in 0..count {
        fragments.color[i] = mix(i, fragments.color[i], shown.color[i]);
    }
    if let Some(layers) = &mut fragments.layers {
        layers.map(|i, color| color * factors[i].0);
        for (name, colors) in shown.layers.iter().flat_map(LightLayers::iter) {
            let layer = layers.layer(name, count);
            for (i, (layer, color)) in layer.iter_mut().zip(colors).enumerate() {
                *layer = *layer + *color * factors[i].1;
            }
        }
    }
}
