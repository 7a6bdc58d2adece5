//! Illumination by any number of lamps, each by itself (\[N], "Illuminance calculation").

use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f32::consts::PI;
use std::sync::Arc;

use super::gloss;
use crate::color::Color;
use crate::fragment::{
    Around, Columns, Finish, Fragments, Gloss, Kept, Layers, Piece, Shader, World,
};
use crate::key::KeyHasher;
use crate::light::{Lamp, Receiver, Sample};
use crate::shadow::lies_in;
use crate::trace::{Casters, Ray, Toward};

/// Lights surfaces: colour times the light received, and what shines on them. Unlit surfaces stay as they
/// are.
///
/// Flat faces under parallel light without shadows have one intensity all over, \[N]'s stored intensity;
/// on curved patches normals are interpolated.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Illuminate {
    /// The sources.
    pub lamps: Vec<Lamp>,
    /// The illuminance in lux under which a white surface shows 1.
    pub white: f32,
    /// How shadows are found.
    pub shadows: Shadows,
    /// Rays to a source that is not in one place.
    pub samples: u32,
}

/// How shadows are found: time for accuracy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Shadows {
    /// There are none.
    #[default]
    Off,
    /// Of light from one place, exactly: [shadow volumes](crate::shadow). Of other light by rays.
    Volumes,
    /// By this many rays per fragment, 1 to 4096, spread over the pixel and the source.
    Rays(u32),
}

/// What a fragment receives of a lamp of unit strength.
#[derive(Debug)]
struct Received {
    /// Irradiance in lux.
    diffuse: Values,
    /// What its gloss sends to the eye: the factor of its own reflectance, and the rest. Empty if
    /// nothing shines.
    gloss: Vec<[Color; 2]>,
}

/// Colours, most of which are grey.
#[derive(Debug)]
enum Values {
    Grey(Vec<f32>),
    Colored(Vec<Color>),
}

impl Values {
    fn new(colors: Vec<Color>) -> Values {
        if colors.iter().all(|c| c.r == c.g && c.g == c.b) {
            Values::Grey(colors.into_iter().map(|c| c.r).collect())
        } else {
            Values::Colored(colors)
        }
    }

    fn at(&self, i: usize) -> Color {
        match self {
            Values::Grey(values) => Color::grey(values[i]),
            Values::Colored(values) => values[i],
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Values::Grey(values) => size_of_val(&**values),
            Values::Colored(values) => size_of_val(&**values),
        }
    }
}

#[typetag::serde]
impl Shader for Illuminate {
    fn reads(&self) -> Columns {
        let mut reads = Columns::COLOR | Columns::FINISH;
        for lamp in self.lamps.iter().filter(|lamp| lamp.shines()) {
            reads = reads | Columns::NORMAL;
            let is_parallel = matches!(lamp.light.toward(), Some(Toward::Direction(_)));
            if !is_parallel && !lamp.light.is_everywhere() {
                reads = reads | Columns::POSITION;
            }
            if self.shadows != Shadows::Off && !lamp.light.is_everywhere() {
                reads = reads | Columns::POSITION | Columns::FACING | Columns::WORLD;
            }
        }
        reads
    }

    fn layers(&self) -> Vec<String> {
        self.lamps.iter().map(|lamp| lamp.name.clone()).collect()
    }

    fn shade(&self, fragments: &mut Fragments<'_>, around: &Around<'_>) {
        let count = fragments.len();
        let scale = 1.0 / self.white;
        let own: Vec<Color> = (0..count)
            .map(|i| {
                let gloss = fragments.finish.get(i).map_or(Gloss::None, |finish| finish.gloss);
                gloss::reflectance(gloss, fragments.color[i])
            })
            .collect();
        let glow = |finish: &Finish| finish.glow * (PI * scale);
        let matt = Finish::default();
        let finishes: Vec<Finish> =
            (0..count).map(|i| fragments.finish.get(i).copied().unwrap_or(matt)).collect();
        let mut sum: Vec<Color> = finishes.iter().map(glow).collect();
        let mut layers = fragments.layers.take().map(|_| Layers::default());
        for lamp in self.lamps.iter().filter(|lamp| lamp.shines()) {
            let received = self.received(lamp, fragments, around);
            let strength = lamp.strength * scale;
            let is_everywhere = lamp.light.is_everywhere();
            let shown = |i: usize| {
                // Light from everywhere is mirrored from everywhere: gloss takes nothing of it.
                let finish = &finishes[i];
                // So is light whose mirror image is not computed: else metals would be black under it.
                let share = match (is_everywhere, lamp.light.shines()) {
                    (true, _) => finish.ambient,
                    (false, false) => finish.diffuse,
                    (false, true) => finish.diffuse * gloss::left_by(finish.gloss),
                };
                let diffuse = fragments.color[i] * received.diffuse.at(i) * share;
                let [by_own, rest] = received.gloss.get(i).copied().unwrap_or_default();
                (diffuse + own[i] * by_own + rest) * strength
            };
            for (i, sum) in sum.iter_mut().enumerate() {
                *sum = *sum + shown(i);
            }
            if let Some(layers) = &mut layers {
                for (i, color) in layers.layer(&lamp.name, count).iter_mut().enumerate() {
                    *color = if fragments.unlit[i] { Color::BLACK } else { *color + shown(i) };
                }
            }
        }
        for (i, sum) in sum.into_iter().enumerate() {
            let color = if fragments.unlit[i] { fragments.color[i] } else { sum };
            let rest = if fragments.unlit[i] { color } else { glow(&finishes[i]) };
            fragments.color[i] = color;
            if let Some(layers) = &mut layers {
                layers.layer(Layers::REST, count)[i] = rest;
            }
        }
        fragments.layers = layers;
    }
}

fn shines(fragments: &Fragments<'_>) -> bool {
    fragments.finish.iter().any(|finish| finish.gloss != Gloss::None)
}

impl Illuminate {
    /// What fragments receive of a lamp of unit strength: kept, so that its strength may change.
    fn received(
        &self,
        lamp: &Lamp,
        fragments: &Fragments<'_>,
        around: &Around<'_>,
    ) -> Arc<Received> {
        let mut key = KeyHasher::new("received");
        key.key(lamp.key()).value(&(self.shadows, self.samples));
        around.world.into_iter().for_each(|world| {
            key.key(world.key());
        });
        // What was done to the normals and places of fragments before is part of what they receive.
        key.bytes(&[around.rest.len() as u8]);
        let key = key.finish();
        if let Some(known) = around.batch.kept(key).and_then(|kept| kept.downcast().ok()) {
            return known;
        }
        let received = Arc::new(self.compute(lamp, fragments, around));
        let bytes = received.diffuse.bytes() + size_of_val(&*received.gloss);
        around.batch.keep(key, received.clone() as Kept, bytes);
        received
    }

    fn compute(&self, lamp: &Lamp, fragments: &Fragments<'_>, around: &Around<'_>) -> Received {
        let light = &*lamp.light;
        let world = around.world.filter(|_| !light.is_everywhere());
        // Sharp shadows that the lines know.
        let exact = match (self.shadows, light.toward(), world) {
            (Shadows::Volumes, Some(from), Some(world)) => around.batch.lit(from, world),
            _ => None,
        };
        let rays = match self.shadows {
            Shadows::Off => 0,
            Shadows::Rays(rays) => rays.max(1),
            Shadows::Volumes if light.toward().is_some() => 1,
            Shadows::Volumes => self.samples.max(1),
        };
        let world = world.filter(|_| exact.is_none() && rays > 0);
        let casters: Vec<(usize, &Casters)> = world.into_iter().flat_map(World::casters).collect();
        let shines = light.shines() && shines(fragments);
        let mut diffuse = Vec::with_capacity(fragments.len());
        let mut gloss = Vec::with_capacity(if shines { fragments.len() } else { 0 });
        for i in 0..fragments.len() {
            let spot = Spot::new(fragments, i);
            if fragments.unlit[i] {
                diffuse.push(Color::BLACK);
                gloss.extend(shines.then_some([Color::BLACK; 2]));
                continue;
            }
            let at = spot.receiver;
            let shine = |sample: &Sample| gloss::sent(spot.finish, &at, spot.to_eye, sample);
            if light.is_everywhere() {
                diffuse.push(light.irradiance(&at));
                gloss.extend(shines.then_some([Color::BLACK; 2]));
                continue;
            }
            let whole = spot.irradiance(light.toward(), light.irradiance(&at));
            let needs_samples = world.is_some() || (shines && light.toward().is_none());
            if !needs_samples {
                let lit = exact.as_ref().map_or(1.0, |exact| exact[i]);
                diffuse.push(whole * lit);
                if shines {
                    let sent = shine(&light.sample(&at, DVec2::splat(0.5)));
                    gloss.push(
                        sent.map(
                            |part| if whole == Color::BLACK { Color::BLACK } else { part * lit },
                        ),
                    );
                }
                continue;
            }
            if whole == Color::BLACK {
                diffuse.push(Color::BLACK);
                gloss.extend(shines.then_some([Color::BLACK; 2]));
                continue;
            }
            let count = if world.is_some() { rays } else { self.samples.max(1) };
            let (mut open, mut reaches) = (Color::BLACK, Color::BLACK);
            let mut sent = [Color::BLACK; 2];
            let pattern = Pattern::new(fragments.x[i], fragments.y[i]);
            // A source in one place is the same for all rays: they are spread over what is covered.
            let is_spread = light.toward().is_some() && count > 1;
            let spread = Spread::new(if is_spread { around.batch.pieces(i) } else { Vec::new() });
            for k in 0..count {
                let choice = pattern.at(k);
                let sample = light.sample(&at, choice);
                let from = spread.at(choice).map_or(at.position, |p| spot.beside(fragments, p));
                let lit = match world {
                    None => 1.0,
                    Some(world) if spot.faces(sample.toward) => {
                        passes(world, &casters, fragments, &spot, from, sample.toward)
                    }
                    Some(_) => 0.0,
                };
                open = open + sample.irradiance;
                reaches = reaches + sample.irradiance * lit;
                if shines {
                    let part = shine(&sample);
                    sent = [0, 1].map(|k| sent[k] + part[k] * lit);
                }
            }
            // The share that reaches it, of what is known without a sample.
            let share = |open: f32, reaches: f32, whole: f32| {
                if open > 0.0 { whole * (reaches / open) } else { 0.0 }
            };
            diffuse.push(Color::new(
                share(open.r, reaches.r, whole.r),
                share(open.g, reaches.g, whole.g),
                share(open.b, reaches.b, whole.b),
            ));
            gloss.extend(shines.then(|| sent.map(|part| part * (1.0 / count as f32))));
        }
        Received { diffuse: Values::new(diffuse), gloss }
    }
}

/// A fragment that receives light.
struct Spot {
    receiver: Receiver,
    /// The unit normal of the face itself.
    facing: DVec3,
    /// The unit vector to where it is seen from.
    to_eye: DVec3,
    finish: Finish,
}

impl Spot {
    fn new(fragments: &Fragments<'_>, i: usize) -> Spot {
        let position = fragments.position.get(i).copied().unwrap_or_default();
        let finish = fragments.finish.get(i).copied().unwrap_or_default();
        let smooth = fragments.normal.get(i).map_or(DVec3::ZERO, |n| n.as_dvec3());
        let facing = fragments.facing.get(i).copied().unwrap_or(smooth);
        let normal = if finish.flat { facing } else { smooth };
        let to_eye = if finish.gloss == Gloss::None { DVec3::ZERO } else { fragments.to_eye(i) };
        Spot { receiver: Receiver { position, normal }, facing, to_eye, finish }
    }

    /// Whether the face itself is turned to where light comes from.
    fn faces(&self, toward: Toward) -> bool {
        self.facing.dot(toward.from(self.receiver.position).0) > 0.0
    }

    /// No light from behind the face, whatever its interpolated normal says.
    fn irradiance(&self, toward: Option<Toward>, whole: Color) -> Color {
        match toward {
            Some(toward) if !self.faces(toward) => Color::BLACK,
            _ => whole,
        }
    }

    /// The point of the face's plane that is seen at a point of the screen.
    fn beside(&self, fragments: &Fragments<'_>, at: DVec2) -> DVec3 {
        let view = fragments.view;
        let DVec2 { x, y } = at;
        let (near, far) =
            (view.world_point(x, y, view.depth(1.0)), view.world_point(x, y, view.depth(2.0)));
        let along = far - near;
        let t = self.facing.dot(self.receiver.position - near) / self.facing.dot(along);
        let point = near + along * t;
        if point.is_finite() { point } else { self.receiver.position }
    }
}

/// How much of the light on a way arrives: what stands in it holds back its share.
fn passes(
    world: &World,
    casters: &[(usize, &Casters)],
    fragments: &Fragments<'_>,
    spot: &Spot,
    from: DVec3,
    toward: Toward,
) -> f32 {
    let (way, reach) = toward.from(from);
    // The light's own surface, at the end of the way, is not in it.
    let ray = Ray::new(from, way, reach * (1.0 - 1e-9));
    let plane = (spot.facing, spot.receiver.position);
    let mut through = 1.0f32;
    for (member, casters) in casters {
        casters.meet_all(&ray, |hit| {
            if lies_in(casters, hit.piece, plane) {
                return true;
            }
            let piece = &casters.pieces()[hit.piece];
            let opacity = if piece.opacity.is_nan() {
                let surfaces = &*world.members()[*member].surfaces;
                let sees_front = casters.normal(hit.piece).dot(way) < 0.0;
                crate::shadow::opacity(
                    surfaces,
                    fragments.view,
                    piece.face,
                    sees_front,
                    ray.at(hit.t),
                )
            } else {
                piece.opacity
            };
            through *= 1.0 - opacity;
            through > 0.0
        });
        if through <= 0.0 {
            return 0.0;
        }
    }
    through
}

/// Points of what a fragment covers.
struct Spread {
    pieces: Vec<Piece>,
    /// The length of all pieces.
    length: f64,
}

impl Spread {
    fn new(pieces: Vec<Piece>) -> Spread {
        let length = pieces.iter().map(|piece| piece.x[1] - piece.x[0]).sum();
        Spread { pieces, length }
    }

    /// The point for two numbers in [0, 1); `None` if nothing is known.
    fn at(&self, choice: DVec2) -> Option<DVec2> {
        let mut rest = choice.y * self.length;
        for (i, Piece { x, y }) in self.pieces.iter().enumerate() {
            let length = x[1] - x[0];
            if rest < length || i + 1 == self.pieces.len() {
                // One piece is a whole pixel: the second number is free for its height.
                let down = if self.pieces.len() == 1 { rest / length } else { 0.5 };
                let across = if self.pieces.len() == 1 { choice.x } else { rest / length };
                return Some(DVec2::new(
                    x[0] + length * across.clamp(0.0, 1.0),
                    y[0] + (y[1] - y[0]) * down.clamp(0.0, 1.0),
                ));
            }
            rest -= length;
        }
        None
    }
}

/// Points of the unit square, spread evenly however many are taken: the first two dimensions of Sobol's
/// sequence, shifted by digits that differ from fragment to fragment.
struct Pattern([u32; 2]);

impl Pattern {
    fn new(x: f64, y: f64) -> Pattern {
        let mut state = x.to_bits() ^ y.to_bits().rotate_left(32);
        let mut next = || {
            // SplitMix64 (Steele, Lea and Flood 2014).
            state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let z = (state ^ (state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            (z ^ (z >> 31)) as u32
        };
        Pattern([next(), next()])
    }

    fn at(&self, k: u32) -> DVec2 {
        let mut second = 0u32;
        let (mut bits, mut direction) = (k, 1u32 << 31);
        while bits != 0 {
            if bits & 1 == 1 {
                second ^= direction;
            }
            bits >>= 1;
            direction ^= direction >> 1;
        }
        let unit = |bits: u32| f64::from(bits) / 4_294_967_296.0;
        DVec2::new(unit(k.reverse_bits() ^ self.0[0]), unit(second ^ self.0[1]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pattern_fills_every_quarter_sixteenth_and_row_alike() {
        for seed in 0..20 {
            let pattern = Pattern::new(f64::from(seed) + 0.5, 3.25);
            for (columns, rows) in [(4, 4), (16, 1), (1, 16), (2, 8), (8, 2)] {
                let mut counts = vec![0; 16];
                for k in 0..16 {
                    let p = pattern.at(k);
                    let (x, y) = (p.x * f64::from(columns), p.y * f64::from(rows));
                    counts[(x as u32 * rows + y as u32) as usize] += 1;
                }
                assert_eq!(counts, [1; 16], "{columns} by {rows}");
            }
        }
    }
}
