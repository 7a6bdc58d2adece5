//! Local ray tracing (\[N], "Local ray tracing"; \[D], "High-quality image display"): what surfaces mirror
//! and let through, followed by rays from the fragments that they cover, and from no other.
//!
//! What a ray meets is a fragment like those that the camera sees: it runs through the stack of its own
//! source, so it is lit, shadowed and fogged as everything is, and its mirrors are followed in turn.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::pattern::{Pattern, Spread};
use crate::color::Color;
use crate::fragment::{
    Around, Batch, Columns, FAR, Finish, Fragments, Hiding, Kept, LightLayers, Meeting, Member,
    Optics, Shader, Sight, Stage, World, stack,
};
use crate::key::{Key, KeyHasher};
use crate::light::seen::SeenSky;
use crate::math;
use crate::shadow;
use crate::trace::{Accelerator, Casters, Finder, Hit, Ray, Toward};

/// The most translucent surfaces that a ray goes through: so many that next to nothing is left.
const MOST_LAYERS: usize = 4096;

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

/// A ray from a fragment.
struct Followed {
    fragment: usize,
    origin: DVec3,
    direction: DVec3,
    /// The share of what it finds that the fragment shows.
    share: Color,
    /// How much a fragment counts in the picture that shows all that its rays of this kind find.
    weight: Color,
    /// What the space that it goes through takes of light, per metre.
    absorb: Color,
    /// The plane that it starts on.
    plane: (DVec3, DVec3),
}

/// A surface that a ray met.
#[derive(Clone, Copy, Debug)]
struct Met {
    ray: u32,
    /// Its place among what casts in the world, the same in all worlds of one geometry, or behind the last of
    /// them for what is beyond.
    caster: u32,
    ordinal: u32,
    sees_front: bool,
    way: f32,
    position: DVec3,
    /// The width of what the ray stands for there.
    width: f32,
}

/// The fragments that rays met of one member.
struct MetFragments<'v> {
    member: usize,
    fragments: Fragments<'v>,
    /// The places of its fragments in the list of all that were met.
    places: Vec<usize>,
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
                let met = self.meet(&rays, fragments, world, around.batch);
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
                        fragment: i,
                        origin,
                        direction,
                        share: part * share,
                        weight: weight * part,
                        absorb,
                        plane,
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

    /// The surfaces that rays meet, ray by ray and the nearest first.
    fn meet(
        &self,
        rays: &[Followed],
        fragments: &Fragments<'_>,
        world: &World,
        batch: &dyn Batch,
    ) -> Vec<Met> {
        let (members, finders): (Vec<usize>, Vec<Finder<'_>>) = world
            .casters()
            .map(|(member, casters)| (member, casters.finder(&self.accelerator)))
            .unzip();
        let beyond = world.beyond();
        batch.count("rays", rays.len() as u64);
        let mut all = Vec::new();
        for (number, followed) in rays.iter().enumerate() {
            if batch.is_stopped() {
                break;
            }
            let ray = Ray::new(followed.origin, followed.direction, f64::INFINITY);
            let mut last = (0.0, 0, 0);
            // What is left of its weight, so that a ray ends behind many panes too.
            let mut left = followed.weight.greatest();
            for _ in 0..MOST_LAYERS {
                let Some((at, hit)) = nearest(&finders, &ray, followed.plane, last) else { break };
                last = (hit.t, at, hit.piece);
                let casters = finders[at].casters();
                let surfaces = &*world.members()[members[at]].surfaces;
                let toward = Toward::Direction(-followed.direction);
                let sees_front = casters.normal(hit.piece, toward).dot(followed.direction) < 0.0;
                let position = ray.at(hit.t);
                let known = &casters.pieces()[hit.piece];
                let widens = fragments.view.pixel_width(0.0).1 * fragments.pixel.x;
                let width = (fragments.width(followed.fragment) + hit.t * widens) as f32;
                let rays = surfaces.rays();
                let part = rays.and_then(|rays| rays.met(known.face, sees_front, position));
                // A back that its material leaves out: the ray goes on.
                let Some(seen) = part else { continue };
                // A seal that lets something through shows the face that it lies on.
                let below = (seen != known.face).then_some(known.face);
                for ordinal in std::iter::once(seen).chain(below) {
                    let (ray, caster) = (number as u32, at as u32);
                    let way = hit.t as f32;
                    all.push(Met { ray, caster, ordinal, sees_front, way, position, width });
                    let is_solid = ordinal == known.face && known.opacity == 1.0;
                    let from = followed.origin;
                    let met = Meeting { ordinal, sees_front, from, position, width };
                    let one = || surfaces.alpha_at(fragments.view, &met);
                    left *= if is_solid { 0.0 } else { 1.0 - one() };
                    if left == 0.0 {
                        break;
                    }
                }
                if left <= self.least {
                    break;
                }
            }
            for (place, (member, ordinal)) in beyond.iter().enumerate() {
                if left <= self.least {
                    break;
                }
                let (ordinal, sees_front, position) = (*ordinal, true, ray.at(FAR));
                let (caster, way) = ((members.len() + place) as u32, FAR as f32);
                let width = (FAR * fragments.view.pixel_width(0.0).1 * fragments.pixel.x) as f32;
                let ray = number as u32;
                all.push(Met { ray, caster, ordinal, sees_front, way, position, width });
                // Nothing lies behind the last of them, so nobody asks how much it hides.
                if place + 1 < beyond.len() {
                    let from = followed.origin;
                    let met = Meeting { ordinal, sees_front, from, position, width };
                    left *= 1.0 - world.members()[*member].surfaces.alpha_at(fragments.view, &met);
                }
            }
        }
        all
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
        let casters = world.casters().map(|(member, _)| member);
        // What is beyond them all stands at the end.
        let beyond = world.beyond().into_iter().map(|(member, _)| member);
        let members: Vec<usize> = casters.chain(beyond).collect();
        let mut groups: Vec<MetFragments<'_>> = Vec::new();
        for (place, met) in met.iter().enumerate() {
            let member = members[met.caster as usize];
            let known = groups.iter().position(|group| group.member == member);
            let at = known.unwrap_or_else(|| {
                let mut empty = Fragments::new(fragments.view);
                (empty.pixel, empty.textures) = (fragments.pixel, fragments.textures);
                empty.label.clone_from(&world.members()[member].label);
                let turns = fragments.sight.as_ref().map_or(0, |sight| sight.turns) + 1;
                empty.sight = Some(Sight { turns, ..Sight::default() });
                empty.layers = fragments.layers.as_ref().map(|_| LightLayers::default());
                groups.push(MetFragments { member, fragments: empty, places: Vec::new() });
                groups.len() - 1
            });
            groups[at].push(place, met, &rays[met.ray as usize], fragments);
        }
        // Of each surface: its group, and its place there.
        let mut places = vec![(0usize, 0usize); met.len()];
        for (at, group) in groups.iter_mut().enumerate() {
            group.shade(&world.members()[group.member], around, key);
            for (i, place) in group.places.iter().enumerate() {
                places[*place] = (at, i);
            }
        }
        let mut next = 0;
        for (number, ray) in rays.iter().enumerate() {
            let mut left = ray.share;
            while next < met.len() && met[next].ray as usize == number {
                let (group, i) = places[next];
                let seen = &groups[group].fragments;
                let part = left * (absorbed(ray.absorb, met[next].way) * seen.alpha[i]);
                shown.add(ray.fragment, part, seen, i);
                left = left * (1.0 - seen.alpha[i]);
                next += 1;
            }
            // What goes on for ever through what absorbs is gone.
            let left = left * absorbed(ray.absorb, f32::INFINITY);
            if left.greatest() > 0.0 {
                shown.add_rest(ray.fragment, left * self.beyond(ray.direction));
            }
        }
    }

    /// What is seen in a direction where nothing is.
    fn beyond(&self, direction: DVec3) -> Color {
        match &self.sky {
            Some(sky) => sky.color(direction, None),
            None => self.background,
        }
    }
}

fn absorbed(absorb: Color, way: f32) -> Color {
    // The test spares 0 times infinity, which is NaN.
    let left = |absorb: f32| if absorb > 0.0 { math::expf(-absorb * way) } else { 1.0 };
    Color::new(left(absorb.r), left(absorb.g), left(absorb.b))
}

/// The nearest surface behind the last, of all members.
fn nearest(
    finders: &[Finder<'_>],
    ray: &Ray,
    plane: (DVec3, DVec3),
    last: (f64, usize, usize),
) -> Option<(usize, Hit)> {
    let mut best: Option<(usize, Hit)> = None;
    for (at, finder) in finders.iter().enumerate() {
        let casters: &Casters = finder.casters();
        let found = finder.nearest(ray, |hit| {
            // Surfaces that coincide have one t: member and number tell them apart, and each is met
            // once.
            (hit.t, at, hit.piece) > last && !shadow::lies_in(casters, hit.piece, plane)
        });
        if let Some(hit) = found
            && best.is_none_or(|(_, best)| hit.t < best.t)
        {
            best = Some((at, hit));
        }
    }
    best
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

impl MetFragments<'_> {
    fn push(&mut self, place: usize, met: &Met, ray: &Followed, from: &Fragments<'_>) {
        let fragments = &mut self.fragments;
        let (i, way) = (ray.fragment, f64::from(met.way));
        let view = from.view;
        fragments.push(met.ordinal, met.sees_front, from.x[i], from.y[i], view.depth(way));
        fragments.position.push(met.position);
        let (_, _, last) = from.way(i);
        let before = from.sight.as_ref().map_or(0.0, |sight| sight.before[i]) + last;
        if let Some(sight) = &mut fragments.sight {
            sight.from.push(ray.origin);
            sight.weight.push(ray.weight);
            sight.width.push(met.width);
            sight.before.push(before);
        }
        self.places.push(place);
    }

    /// Runs the fragments through the stack of their source: what was done to it before, and what is done
    /// from here on to everything in the image.
    fn shade(&mut self, member: &Member, around: &Around<'_>, key: Key) {
        let onward = if member.is_beside { &[] } else { &around.stack[around.at..] };
        let stages: Vec<Stage> = member.stack.iter().chain(onward).cloned().collect();
        let mut salt = KeyHasher::new("met");
        salt.key(key).value(&self.member);
        let batch = Within { outer: around.batch, key: salt.finish() };
        // What was moved is not in any world: there is nothing to undo.
        stack::shade(&stages, &*member.surfaces, &batch, &mut self.fragments);
    }
}

/// Fragments that the rays of others met.
struct Within<'a> {
    outer: &'a dyn Batch,
    key: Key,
}

impl Within<'_> {
    fn key_of(&self, key: Key) -> Key {
        let mut hasher = KeyHasher::new("within");
        hasher.key(self.key).key(key);
        hasher.finish()
    }
}

impl Batch for Within<'_> {
    fn kept(&self, key: Key) -> Option<Kept> {
        self.outer.kept(self.key_of(key))
    }

    fn keep(&self, key: Key, value: Kept, bytes: usize, seconds: f64) {
        self.outer.keep(self.key_of(key), value, bytes, seconds);
    }

    fn is_stopped(&self) -> bool {
        self.outer.is_stopped()
    }

    fn count(&self, what: &'static str, number: u64) {
        self.outer.count(what, number);
    }
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
