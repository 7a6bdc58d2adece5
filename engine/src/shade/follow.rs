//! Rays that are followed from surfaces, and what they meet.
//!
//! What a ray meets is a fragment like those that the camera sees: it runs through the stack of its own source, so it is
//! lit, shadowed and fogged as everything is.

use glam::{DVec2, DVec3};

use crate::camera::View;
use crate::color::Color;
use crate::fragment::{Batch, FAR, Fragments, Kept, Meeting, Member, Sight, Stage, World, stack};
use crate::key::{Key, KeyHasher};
use crate::math;
use crate::shadow;
use crate::trace::{Accelerator, Casters, Finder, Hit, Ray, Toward};

/// The most translucent surfaces that a ray goes through: so many that next to nothing is left.
const MOST_LAYERS: usize = 4096;

/// A ray that is followed.
pub(super) struct Followed {
    /// The number of what it starts from.
    pub(super) from: usize,
    pub(super) origin: DVec3,
    pub(super) direction: DVec3,
    /// The share of what it finds that is shown where it starts.
    pub(super) share: Color,
    /// How much a fragment counts in the picture that shows all that its rays of this kind find.
    pub(super) weight: Color,
    /// What the space that it goes through takes of light, per metre.
    pub(super) absorb: Color,
    /// The plane that it starts on.
    pub(super) plane: (DVec3, DVec3),
    /// Where what it starts from stands on the screen, in pixels.
    pub(super) screen: DVec2,
    /// The way from its start on to the camera, in metres.
    pub(super) before: f64,
    /// The width of what it stands for where it starts, in metres, and by how much that grows in a metre.
    pub(super) width: [f64; 2],
}

/// A surface that a ray met.
#[derive(Clone, Copy, Debug)]
pub(super) struct Met {
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

/// Follows rays through a world.
pub(super) struct Follower<'a> {
    pub(super) world: &'a World,
    pub(super) view: &'a View,
    pub(super) accelerator: &'a Accelerator,
    /// What counts for no more in the picture is not looked for.
    pub(super) least: f32,
    /// Whether rays see what stands behind everything.
    pub(super) sees_beyond: bool,
}

impl Follower<'_> {
    /// The surfaces that rays meet, ray by ray and the nearest first.
    pub(super) fn meet(&self, rays: &[Followed], batch: &dyn Batch) -> Vec<Met> {
        let Follower { world, view, least, .. } = *self;
        let (members, finders): (Vec<usize>, Vec<Finder<'_>>) = world
            .casters()
            .map(|(member, casters)| (member, casters.finder(self.accelerator)))
            .unzip();
        let beyond = if self.sees_beyond { world.beyond() } else { Vec::new() };
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
            let width_at = |way: f64| (followed.width[0] + way * followed.width[1]) as f32;
            for _ in 0..MOST_LAYERS {
                let Some((at, hit)) = nearest(&finders, &ray, followed.plane, last) else { break };
                last = (hit.t, at, hit.piece);
                let casters = finders[at].casters();
                let surfaces = &*world.members()[members[at]].surfaces;
                let toward = Toward::Direction(-followed.direction);
                let sees_front = casters.normal(hit.piece, toward).dot(followed.direction) < 0.0;
                let position = ray.at(hit.t);
                let known = &casters.pieces()[hit.piece];
                let width = width_at(hit.t);
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
                    let one = || surfaces.alpha_at(view, &met);
                    left *= if is_solid { 0.0 } else { 1.0 - one() };
                    if left == 0.0 {
                        break;
                    }
                }
                if left <= least {
                    break;
                }
            }
            for (place, (member, ordinal)) in beyond.iter().enumerate() {
                if left <= least {
                    break;
                }
                let (ordinal, sees_front, position) = (*ordinal, true, ray.at(FAR));
                let (caster, way) = ((members.len() + place) as u32, FAR as f32);
                let width = (FAR * followed.width[1]) as f32;
                let ray = number as u32;
                all.push(Met { ray, caster, ordinal, sees_front, way, position, width });
                // Nothing lies behind the last of them, so nobody asks how much it hides.
                if place + 1 < beyond.len() {
                    let from = followed.origin;
                    let met = Meeting { ordinal, sees_front, from, position, width };
                    left *= 1.0 - world.members()[*member].surfaces.alpha_at(view, &met);
                }
            }
        }
        all
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

/// The fragments that rays met of one member.
struct MetFragments<'v> {
    member: usize,
    fragments: Fragments<'v>,
    /// The places of its fragments in the list of all that were met.
    places: Vec<usize>,
}

/// What rays met, shaded.
pub(super) struct ShadedSurfaces<'v> {
    met: Vec<(u32, f32)>,
    groups: Vec<MetFragments<'v>>,
    /// Of each surface: its group, and its place there.
    places: Vec<(usize, usize)>,
}

/// How what rays met is shaded.
pub(super) struct StackRun<'a, 'v> {
    /// What batches of it begin as.
    pub(super) empty: &'a Fragments<'v>,
    pub(super) world: &'a World,
    /// What is done to it beside what was done to its source before; what is beside the image is left alone.
    pub(super) onward: &'a [Stage],
    pub(super) batch: &'a dyn Batch,
    /// What is kept of it is kept under this.
    pub(super) key: Option<Key>,
}

impl<'v> StackRun<'_, 'v> {
    /// Runs what rays met through the stacks of its sources.
    pub(super) fn shade(&self, rays: &[Followed], met: &[Met]) -> ShadedSurfaces<'v> {
        let world = self.world;
        let casters = world.casters().map(|(member, _)| member);
        // What is beyond them all stands at the end.
        let beyond = world.beyond().into_iter().map(|(member, _)| member);
        let members: Vec<usize> = casters.chain(beyond).collect();
        let mut groups: Vec<MetFragments<'_>> = Vec::new();
        for (place, met) in met.iter().enumerate() {
            let member = members[met.caster as usize];
            let known = groups.iter().position(|group| group.member == member);
            let at = known.unwrap_or_else(|| {
                let mut fragments = self.empty.clone();
                let Member { label, scene, .. } = &world.members()[member];
                fragments.label.clone_from(label);
                fragments.scene = *scene;
                groups.push(MetFragments { member, fragments, places: Vec::new() });
                groups.len() - 1
            });
            groups[at].push(place, met, &rays[met.ray as usize]);
        }
        let mut places = vec![(0usize, 0usize); met.len()];
        for (at, group) in groups.iter_mut().enumerate() {
            let member = &world.members()[group.member];
            let onward = if member.is_beside { &[] } else { self.onward };
            let stages: Vec<Stage> = member.stack.iter().chain(onward).cloned().collect();
            let key = self.key.map(|key| {
                let mut salt = KeyHasher::new("met");
                salt.key(key).value(&group.member);
                salt.finish()
            });
            let batch = Within { outer: self.batch, key };
            // What was moved is not in any world: there is nothing to undo.
            stack::shade(&stages, &*member.surfaces, &batch, &mut group.fragments);
            for (i, place) in group.places.iter().enumerate() {
                places[*place] = (at, i);
            }
        }
        let met = met.iter().map(|met| (met.ray, met.way)).collect();
        ShadedSurfaces { met, groups, places }
    }
}

impl<'v> ShadedSurfaces<'v> {
    /// What each ray shows, one after the other: the share of what it starts from, and the fragment, or none for what it
    /// finds behind all.
    pub(super) fn each(
        &self,
        rays: &[Followed],
        mut visit: impl FnMut(&Followed, Color, Option<(&Fragments<'v>, usize)>),
    ) {
        let mut next = 0;
        for (number, ray) in rays.iter().enumerate() {
            let mut left = ray.share;
            while next < self.met.len() && self.met[next].0 as usize == number {
                let (group, i) = self.places[next];
                let seen = &self.groups[group].fragments;
                let part = left * (absorbed(ray.absorb, self.met[next].1) * seen.alpha[i]);
                visit(ray, part, Some((seen, i)));
                left = left * (1.0 - seen.alpha[i]);
                next += 1;
            }
            // What goes on for ever through what absorbs is gone.
            let left = left * absorbed(ray.absorb, f32::INFINITY);
            if left.greatest() > 0.0 {
                visit(ray, left, None);
            }
        }
    }
}

impl MetFragments<'_> {
    fn push(&mut self, place: usize, met: &Met, ray: &Followed) {
        let fragments = &mut self.fragments;
        let depth = fragments.view.depth(f64::from(met.way));
        fragments.push(met.ordinal, met.sees_front, ray.screen.x, ray.screen.y, depth);
        fragments.position.push(met.position);
        let sight = fragments.sight.get_or_insert_with(Sight::default);
        sight.from.push(ray.origin);
        sight.weight.push(ray.weight);
        sight.width.push(met.width);
        sight.before.push(ray.before);
        self.places.push(place);
    }
}

/// Fragments that the rays of others met. Without a key nothing is kept of them.
struct Within<'a> {
    outer: &'a dyn Batch,
    key: Option<Key>,
}

impl Within<'_> {
    fn key_of(&self, key: Key) -> Option<Key> {
        let mut hasher = KeyHasher::new("within");
        hasher.key(self.key?).key(key);
        Some(hasher.finish())
    }
}

impl Batch for Within<'_> {
    fn kept(&self, key: Key) -> Option<Kept> {
        self.outer.kept(self.key_of(key)?)
    }

    fn keep(&self, key: Key, value: Kept, bytes: usize, seconds: f64) {
        if let Some(key) = self.key_of(key) {
            self.outer.keep(key, value, bytes, seconds);
        }
    }

    fn is_stopped(&self) -> bool {
        self.outer.is_stopped()
    }

    fn count(&self, what: &'static str, number: u64) {
        self.outer.count(what, number);
    }
}
