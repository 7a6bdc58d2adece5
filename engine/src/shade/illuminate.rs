//! Illumination by any number of lamps, each by itself (\[N], "Illuminance calculation").

use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f32::consts::PI;
use std::sync::Arc;
use std::time::Instant;

use super::bounces::{Bounces, Gather, Gathered, Gatherer, Place, tilted};
use super::pattern::{Pattern, Spread};
use super::records::Asked;
use super::{clipped, gloss};
use crate::color::Color;
use crate::fragment::{
    Around, Batch, Casting, Columns, Finish, Fragments, Gloss, Hiding, LightLayers, Shader,
    Shading, Stage, World,
};
use crate::key::{Key, KeyHasher};
use crate::light::{Lamp, Light, Receiver, Sample};
use crate::shadow;
use crate::trace::{Casters, Ray, Reductions, Toward};

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
    /// What is left out of the search for shadow volumes.
    pub less: Reductions,
    /// The light that surfaces send on.
    #[serde(default)]
    pub bounces: Bounces,
}

/// How shadows are found: time for accuracy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Shadows {
    /// There are none.
    #[default]
    Off,
    /// Of light from one place, exactly: shadow volumes. Of other light by rays.
    Volumes,
    /// As `Volumes`, but of light from polygons, bodies and tubes by cutting what stands in the way out of
    /// them: exact too, at the middle of each fragment. Where that leaves more than some hundred parts, by rays.
    Analytic,
    /// By this many rays per fragment, 1 to 16384, spread over the source, or over the pixel if that is in one place.
    Rays(u32),
}

/// What fragments receive of a lamp of unit strength.
#[derive(Debug, Default)]
struct Received {
    /// Irradiance in lux. Empty if there is none.
    diffuse: GreyOrColors,
    /// What its gloss sends to the eye: the factor of its own reflectance, and the rest. Empty if
    /// nothing shines.
    gloss: Vec<[Color; 2]>,
    /// By how much the irradiance may be off. Empty if nobody asks, or by nothing.
    error: Vec<f32>,
}

/// What a fragment receives of other surfaces, of a lamp of unit strength or of what glows.
#[derive(Debug)]
struct Reflected {
    /// Irradiance in lux.
    light: GreyOrColors,
    /// By how much it may be off. Empty if nobody asks, or by nothing.
    error: Vec<f32>,
}

/// Colours, most of which are grey.
#[derive(Debug)]
enum GreyOrColors {
    Grey(Vec<f32>),
    Colored(Vec<Color>),
}

impl Default for GreyOrColors {
    fn default() -> GreyOrColors {
        GreyOrColors::Grey(Vec::new())
    }
}

impl GreyOrColors {
    fn new(colors: Vec<Color>) -> GreyOrColors {
        if colors.iter().all(|c| c.r == c.g && c.g == c.b) {
            GreyOrColors::Grey(colors.into_iter().map(|c| c.r).collect())
        } else {
            GreyOrColors::Colored(colors)
        }
    }

    fn at(&self, i: usize) -> Color {
        match self {
            GreyOrColors::Grey(values) => Color::grey(values.get(i).copied().unwrap_or(0.0)),
            GreyOrColors::Colored(values) => values[i],
        }
    }

    fn bytes(&self) -> usize {
        match self {
            GreyOrColors::Grey(values) => size_of_val(&**values),
            GreyOrColors::Colored(values) => size_of_val(&**values),
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
        if self.looks_around() {
            let around = Columns::POSITION | Columns::FACING | Columns::WORLD;
            reads = reads | Columns::NORMAL | around;
        }
        reads
    }

    fn hiding(&self) -> Hiding {
        Hiding::Keeps
    }

    fn changes(&self) -> Columns {
        Columns::COLOR
    }

    fn white(&self) -> Option<f32> {
        Some(self.white)
    }

    fn layers(&self) -> Vec<String> {
        self.lamps.iter().map(|lamp| lamp.name.clone()).collect()
    }

    fn looks_toward(&self) -> Option<Vec<Toward>> {
        // Discs and skies are looked at in more than one direction.
        if self.shadows != Shadows::Volumes || self.looks_around() {
            return None;
        }
        let lamps = self.lamps.iter().filter(|lamp| lamp.shines() && !lamp.light.is_everywhere());
        lamps.map(|lamp| lamp.light.toward()).collect()
    }

    fn shade(&self, fragments: &mut Fragments<'_>, around: &Around<'_>) {
        let count = fragments.len();
        let scale = 1.0 / self.white;
        // What surfaces send on is seen by others and not by the camera.
        let is_sent_on = fragments.sight.as_ref().is_some_and(|sight| sight.bounced > 0);
        let reflected = self.reflected(fragments, around);
        let has_records = !reflected.is_empty();
        let mut reflected = reflected.iter();
        let to_all_sides: Vec<Color> = (0..count)
            .map(|i| gloss::to_all_sides(&fragments.finish[i], fragments.color[i]))
            .collect();
        let glow = |finish: &Finish| match is_sent_on && finish.is_lamp {
            true => Color::BLACK,
            false => finish.glow * (PI * scale),
        };
        let mut rest: Vec<Color> = fragments.finish.iter().map(glow).collect();
        let mut sum = rest.clone();
        let mut layers = fragments.layers.as_ref().map(|_| LightLayers::default());
        for lamp in self.lamps.iter().filter(|lamp| lamp.shines()) {
            let received = match has_records && self.is_recorded(lamp) {
                true => Arc::default(),
                false => self.received(lamp, fragments, around),
            };
            let strength = lamp.strength * scale;
            let is_everywhere = lamp.light.is_everywhere();
            let reflected = if is_everywhere { None } else { reflected.next() };
            let shown = |i: usize| {
                // Light from everywhere is mirrored from everywhere: gloss takes nothing of it.
                let (finish, color) = (&fragments.finish[i], fragments.color[i]);
                // So is light whose mirror image is not computed: else metals would be black under it.
                let reflects = match (is_everywhere, lamp.light.is_mirrored()) {
                    _ if is_sent_on && !is_everywhere => to_all_sides[i],
                    (true, _) => color * finish.ambient,
                    (false, false) => color * finish.diffuse,
                    (false, true) => color * (finish.diffuse * gloss::left_by(finish.gloss)),
                };
                let diffuse = reflects * received.diffuse.at(i);
                let shine = received.gloss.get(i).map_or(Color::BLACK, |[by_own, rest]| {
                    gloss::reflectance(finish.gloss, color) * *by_own + *rest
                });
                let beside = reflected.map_or(Color::BLACK, |r| to_all_sides[i] * r.light.at(i));
                (diffuse + shine + beside) * strength
            };
            for (i, sum) in sum.iter_mut().enumerate() {
                *sum = *sum + shown(i);
            }
            if let Some(layers) = &mut layers {
                for (i, color) in layers.layer(&lamp.name, count).iter_mut().enumerate() {
                    *color = if fragments.unlit[i] { Color::BLACK } else { *color + shown(i) };
                }
                let error_of = |i: usize| {
                    let direct = received.error.get(i).map_or(0.0, |off| *off);
                    let sent_on = reflected.and_then(|r| r.error.get(i)).map_or(0.0, |off| *off);
                    fragments.color[i] * (fragments.finish[i].diffuse * direct)
                        + to_all_sides[i] * sent_on
                };
                let is_off = |reflected: &&Arc<Reflected>| !reflected.error.is_empty();
                if !received.error.is_empty() || reflected.is_some_and(|r| is_off(&r)) {
                    let errors = layers.layer(LightLayers::ERROR, count);
                    for (i, error) in errors.iter_mut().enumerate() {
                        // Lamps are off independently of each other.
                        *error = quadrature(*error, error_of(i) * strength);
                    }
                }
            }
        }
        if let Some(glowing) = reflected.next() {
            for (i, (sum, rest)) in sum.iter_mut().zip(&mut rest).enumerate() {
                let beside = to_all_sides[i] * glowing.light.at(i) * scale;
                (*sum, *rest) = (*sum + beside, *rest + beside);
            }
        }
        for (i, sum) in sum.into_iter().enumerate() {
            let own = if is_sent_on { Color::BLACK } else { fragments.color[i] };
            let (color, rest) = if fragments.unlit[i] { (own, own) } else { (sum, rest[i]) };
            fragments.color[i] = color;
            if let Some(layers) = &mut layers {
                layers.layer(LightLayers::REST, count)[i] = rest;
            }
        }
        fragments.layers = layers;
    }
}

fn quadrature(a: Color, b: Color) -> Color {
    let one = |a: f32, b: f32| (a * a + b * b).sqrt();
    Color::new(one(a.r, b.r), one(a.g, b.g), one(a.b, b.b))
}

/// Whether anybody asks by how much light may be off: of what is sent on nobody does.
fn wants_error(fragments: &Fragments<'_>) -> bool {
    let bounced = fragments.sight.as_ref().map_or(0, |sight| sight.bounced);
    fragments.layers.is_some() && bounced == 0
}

fn shines(fragments: &Fragments<'_>) -> bool {
    fragments.finish.iter().any(|finish| finish.gloss != Gloss::None)
}

impl Illuminate {
    /// Whether what fragments receive of a lamp itself is found at records.
    fn is_recorded(&self, lamp: &Lamp) -> bool {
        let has_records = self.bounces.records(0).is_some();
        let is_exact = matches!(self.shadows, Shadows::Volumes | Shadows::Analytic);
        has_records && is_exact && lamp.light.luminance(DVec3::Y).is_some()
    }

    /// Whether light comes from all that is around.
    fn looks_around(&self) -> bool {
        let is_recorded = |lamp: &Lamp| lamp.shines() && self.is_recorded(lamp);
        self.bounces.times > 0 || self.lamps.iter().any(is_recorded)
    }

    /// What fragments receive of other surfaces, and of lamps that are recorded: of each lamp that does not shine
    /// everywhere, and then of what glows.
    fn reflected(&self, fragments: &Fragments<'_>, around: &Around<'_>) -> Vec<Arc<Reflected>> {
        let bounced = fragments.sight.as_ref().map_or(0, |sight| sight.bounced);
        let Some(Stage::Shade(own)) = around.stack.get(around.at) else { return Vec::new() };
        let is_recorded = |lamp: &Lamp| lamp.shines() && self.is_recorded(lamp);
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
        let place = |i: usize| {
            let spot = LitFragment::new(fragments, i);
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
            }
        };
        let goes_on = bounced < self.bounces.times;
        let recorded: Vec<usize> =
            (0..lamps.len()).filter(|lamp| self.is_recorded(lamps[*lamp])).collect();
        let lit: Vec<usize> = (0..fragments.len()).filter(|i| !fragments.unlit[*i]).collect();
        let count = lamps.len() + 1;
        let mut light = vec![vec![Color::BLACK; fragments.len()]; count];
        let mut error = vec![vec![0.0f32; if wants_error { fragments.len() } else { 0 }]; count];
        let mut take = |i: usize, found: &Gathered| {
            for (lamp, color) in found.light.iter().enumerate() {
                light[lamp][i] = light[lamp][i] + *color;
                if wants_error {
                    error[lamp][i] += found.error[lamp];
                }
            }
        };
        // From the first surface on, one ray is enough for each that comes.
        let mut rays = match self.bounces.gather {
            Gather::Rays(rays) if bounced == 0 => rays,
            _ => 1,
        };
        let mut by_itself = lit;
        if let Some(count) = self.bounces.records(bounced) {
            let field = self.bounces.field(gatherer.stage.key(), bounced);
            let casters: Vec<_> = world.casters().collect();
            let receives = |place: &Place| {
                let mut all = match goes_on {
                    true => gatherer.gather(std::slice::from_ref(place), count, true).pop(),
                    false => None,
                };
                let all = all.get_or_insert_with(|| Gathered::none(lamps.len(), true));
                for lamp in &recorded {
                    let light = &*lamps[*lamp].light;
                    of_sky(light, place, (world, &casters, fragments), (count, *lamp), all);
                }
                std::mem::take(all)
            };
            let asked = Asked { gatherer: &gatherer, casters: &casters, receives: &receives };
            let turns = !fragments.cards.is_empty();
            by_itself.retain(|i| {
                let (face, place) = ((&*fragments.label, fragments.ordinal[*i]), place(*i));
                if turns || field.is_small(face, &place, &asked) {
                    return true;
                }
                let found = field.at(&place, &asked);
                found.iter().for_each(|found| take(*i, found));
                found.is_none()
            });
            rays = if bounced == 0 { self.samples } else { 1 };
            for lamp in &recorded {
                let lighting = Lighting::new(self, lamps[*lamp], fragments, around);
                for i in &by_itself {
                    let one = lighting.of(*i);
                    let mut found = Gathered::none(lamps.len(), false);
                    (found.light[*lamp], found.error[*lamp]) = (one.diffuse, one.error);
                    take(*i, &found);
                }
            }
        }
        if goes_on {
            let places: Vec<Place> = by_itself.iter().map(|i| place(*i)).collect();
            for (i, found) in by_itself.iter().zip(gatherer.gather(&places, rays, false)) {
                take(*i, &found);
            }
        }
        let all = light.into_iter().zip(error);
        all.map(|(light, error)| Reflected { light: GreyOrColors::new(light), error }).collect()
    }

    /// What fragments receive of a lamp of unit strength: kept, so that its strength may change.
    fn received(
        &self,
        lamp: &Lamp,
        fragments: &Fragments<'_>,
        around: &Around<'_>,
    ) -> Arc<Received> {
        let mut key = KeyHasher::new("received");
        let wants_error = wants_error(fragments);
        key.key(lamp.key()).value(&(self.shadows, self.samples, wants_error));
        around.world.into_iter().for_each(|world| {
            key.key(world.geometry());
        });
        // Colours are not read here.
        around.changes_before().for_each(|stage| {
            key.key(stage.key());
        });
        around.batch.or_made(key.finish(), || {
            let received = Lighting::new(self, lamp, fragments, around).received();
            let Received { diffuse, gloss, error } = &received;
            let bytes = diffuse.bytes() + size_of_val(&**gloss) + size_of_val(&**error);
            (received, bytes)
        })
    }
}

/// Adds what a place receives of a sky, by samples of it.
fn of_sky(
    light: &dyn Light,
    place: &Place,
    (world, casters, like): (&World, &[(usize, &Casters)], &Fragments<'_>),
    (count, lamp): (u32, usize),
    all: &mut Gathered,
) {
    let receiver = Receiver { position: place.position, normal: place.normal };
    let whole = light.irradiance(&receiver);
    let (mut open, mut reaches) = (Color::BLACK, Color::BLACK);
    let mut tilts = [Color::BLACK; 3];
    let mut deviation = Deviation::default();
    for k in 0..count {
        let sample = light.sample(&receiver, place.pattern.at(k));
        let way = sample.toward.from(place.position).0.normalize_or_zero();
        let plane = (place.facing, place.position);
        let lit = match way.dot(place.facing) > 0.0 {
            true => passes(world, casters, like, plane, (place.position, sample.toward, 0.0)),
            false => 0.0,
        };
        deviation.add(sample.irradiance.luminance(), lit);
        let part = sample.irradiance * lit;
        (open, reaches) = (open + sample.irradiance, reaches + part);
        for (tilt, along) in tilts.iter_mut().zip(tilted(way, place.normal)) {
            *tilt = *tilt + part * along;
        }
    }
    // The share that reaches it, of what is known without a sample.
    let share =
        |part: f32, open: f32, whole: f32| if open > 0.0 { whole * (part / open) } else { 0.0 };
    let of = |part: Color| {
        Color::new(
            share(part.r, open.r, whole.r),
            share(part.g, open.g, whole.g),
            share(part.b, open.b, whole.b),
        )
    };
    all.light[lamp] = all.light[lamp] + of(reaches);
    for (own, tilt) in all.tilt[lamp].iter_mut().zip(tilts) {
        *own = *own + of(tilt);
    }
    all.error[lamp] += deviation.of_share() * whole.luminance();
}

/// What one fragment receives of a lamp of unit strength.
#[derive(Default)]
struct ReceivedByOne {
    diffuse: Color,
    gloss: [Color; 2],
    error: f32,
}

/// How far the share of light that reaches a place may be off that is found by samples.
#[derive(Default)]
struct Deviation {
    count: u32,
    /// Sums of what is open, of what reaches, and of their products.
    open: f32,
    reaches: f32,
    products: [f32; 3],
}

impl Deviation {
    fn add(&mut self, open: f32, lit: f32) {
        let reaches = open * lit;
        self.count += 1;
        self.open += open;
        self.reaches += reaches;
        let products = [open * open, open * reaches, reaches * reaches];
        self.products = [0, 1, 2].map(|k| self.products[k] + products[k]);
    }

    /// The standard error of the ratio of what reaches to what is open.
    fn of_share(&self) -> f32 {
        if self.open <= 0.0 {
            return 0.0;
        }
        // One sample says nothing of its error: a half is the greatest deviation that a share can
        // have.
        if self.count < 2 {
            return 0.5;
        }
        let share = self.reaches / self.open;
        let [open, both, reaches] = self.products;
        // The sum of (reaches - share open)^2, multiplied out.
        let squares = reaches - 2.0 * share * both + share * share * open;
        let count = self.count as f32;
        (squares.max(0.0) * count / (count - 1.0)).sqrt() / self.open
    }
}

/// One light on one batch of fragments.
struct Lighting<'a> {
    light: &'a dyn Light,
    /// The one place that its light comes from, as far as shadows are concerned.
    from: Option<Toward>,
    fragments: &'a Fragments<'a>,
    batch: &'a dyn Batch,
    /// What of each fragment is lit by the light's one place, if lines tell.
    exact: Option<Vec<f32>>,
    /// What rays may meet, if shadows are found by rays.
    world: Option<&'a World>,
    casters: Vec<(usize, &'a Casters)>,
    /// Rays or parts of the source for each fragment.
    samples: u32,
    /// Whether what is in the way is cut out of sources that can be cut.
    is_clipped: bool,
    /// Whether anything mirrors the light.
    shines: bool,
}

impl<'a> Lighting<'a> {
    fn new(
        shader: &Illuminate,
        lamp: &'a Lamp,
        fragments: &'a Fragments<'a>,
        around: &Around<'a>,
    ) -> Lighting<'a> {
        let light = &*lamp.light;
        let is_sent_on = fragments.sight.as_ref().is_some_and(|sight| sight.bounced > 0);
        let world = around.world.filter(|_| !light.is_everywhere());
        // A disc counts as one place where shadows are sharp anyhow.
        let is_soft = matches!(shader.shadows, Shadows::Analytic | Shadows::Rays(_));
        let from = light.toward().filter(|_| !is_soft || light.disc().is_none());
        let exact = match (shader.shadows, from, world) {
            (Shadows::Volumes | Shadows::Analytic, Some(from), Some(world)) => {
                around.batch.lit(&Casting { from, world, less: shader.less })
            }
            _ => None,
        };
        let samples = match shader.shadows {
            Shadows::Rays(rays) => rays,
            Shadows::Volumes | Shadows::Analytic if from.is_some() => 1,
            Shadows::Off | Shadows::Volumes | Shadows::Analytic => shader.samples,
        };
        let world = world.filter(|_| exact.is_none() && shader.shadows != Shadows::Off);
        Lighting {
            light,
            from,
            fragments,
            batch: around.batch,
            exact,
            world,
            casters: world.into_iter().flat_map(World::casters).collect(),
            samples: samples.max(1),
            is_clipped: shader.shadows == Shadows::Analytic,
            shines: light.is_mirrored() && !is_sent_on && shines(fragments),
        }
    }

    fn received(&self) -> Received {
        let count = self.fragments.len();
        let mut diffuse = Vec::with_capacity(count);
        let (mut gloss, mut error) = (Vec::new(), Vec::new());
        let wants_error = wants_error(self.fragments);
        for i in 0..count {
            let is_dark = self.fragments.unlit[i] || self.batch.is_stopped();
            let one = if is_dark { ReceivedByOne::default() } else { self.of(i) };
            diffuse.push(one.diffuse);
            gloss.extend(self.shines.then_some(one.gloss));
            error.extend(wants_error.then_some(one.error));
        }
        if error.iter().all(|error| *error == 0.0) {
            error = Vec::new();
        }
        Received { diffuse: GreyOrColors::new(diffuse), gloss, error }
    }

    /// What a fragment receives.
    fn of(&self, i: usize) -> ReceivedByOne {
        let spot = LitFragment::new(self.fragments, i);
        let whole = self.light.irradiance(&spot.receiver);
        // No light from behind a face, whatever its interpolated normal says; leaves lie all ways.
        let is_behind = |toward| self.fragments.cards.is_empty() && !spot.faces(toward);
        let whole = if self.from.is_some_and(is_behind) { Color::BLACK } else { whole };
        // Most fragments are turned away from most lamps: for these no shadow is looked for.
        if whole == Color::BLACK || self.light.is_everywhere() {
            return ReceivedByOne { diffuse: whole, ..ReceivedByOne::default() };
        }
        if let Some(diffuse) = self.clipped(&spot) {
            let shines = self.shines && spot.finish.shines();
            let gloss = shines.then(|| self.by_samples(&spot, i, whole).gloss);
            return ReceivedByOne { diffuse, gloss: gloss.unwrap_or_default(), error: 0.0 };
        }
        let is_soft = self.from.is_none();
        if self.world.is_some() || (self.shines && is_soft) {
            return self.by_samples(&spot, i, whole);
        }
        let lit = self.exact.as_ref().map_or(1.0, |exact| exact[i]);
        let sent = match self.shines {
            true => spot.sent(&self.light.sample(&spot.receiver, DVec2::splat(0.5))),
            false => Default::default(),
        };
        ReceivedByOne { diffuse: whole * lit, gloss: sent.map(|part| part * lit), error: 0.0 }
    }

    /// Irradiance with what stands in the way cut out of the source, if it is to be and can be.
    fn clipped(&self, spot: &LitFragment) -> Option<Color> {
        let world = self.world.filter(|_| self.is_clipped)?;
        let view = self.fragments.view;
        clipped::irradiance(self.light, &spot.receiver, spot.facing, world, &self.casters, view)
    }

    /// The same from parts of the source, each with what stands in its way.
    fn by_samples(&self, spot: &LitFragment, i: usize, whole: Color) -> ReceivedByOne {
        let fragments = self.fragments;
        let pattern = Pattern::of(fragments, i);
        // A source in one place is the same for all rays: they are spread over what is covered.
        let is_spread = self.from.is_some() && self.samples > 1;
        let spread = Spread::new(if is_spread { self.batch.pieces(i) } else { Vec::new() });
        // What counts for little in the picture, as mirrored light does, takes as little of the samples.
        let weight = fragments.sight.as_ref().map_or(1.0, |sight| sight.weight[i].greatest());
        let samples = ((self.samples as f32 * weight).ceil() as u32).clamp(1, self.samples);
        let (mut open, mut reaches) = (Color::BLACK, Color::BLACK);
        let mut spread_of = Deviation::default();
        let mut sent = [Color::BLACK; 2];
        let width = fragments.width(i);
        for k in 0..samples {
            let choice = pattern.at(k);
            let sample = self.light.sample(&spot.receiver, choice);
            let lit = match self.world {
                None => 1.0,
                Some(world) => {
                    let beside = spread.on_plane(choice, fragments, i, spot.facing);
                    let from = beside.unwrap_or(spot.receiver.position);
                    let turn = fragments.turn(i, sample.toward);
                    let (plane, from) = match &turn {
                        Some(turn) => (turn.plane(), turn.place(from)),
                        None => ((spot.facing, spot.receiver.position), from),
                    };
                    if turn.is_some() || spot.faces(sample.toward) {
                        let way = (from, sample.toward, width);
                        passes(world, &self.casters, fragments, plane, way)
                    } else {
                        0.0
                    }
                }
            };
            open = open + sample.irradiance;
            reaches = reaches + sample.irradiance * lit;
            spread_of.add(sample.irradiance.luminance(), lit);
            if self.shines {
                let part = spot.sent(&sample);
                sent = [0, 1].map(|k| sent[k] + part[k] * lit);
            }
        }
        // The share that reaches it, of what is known without a sample.
        let share = |open: f32, reaches: f32, whole: f32| {
            if open > 0.0 { whole * (reaches / open) } else { 0.0 }
        };
        let diffuse = Color::new(
            share(open.r, reaches.r, whole.r),
            share(open.g, reaches.g, whole.g),
            share(open.b, reaches.b, whole.b),
        );
        let error =
            if self.world.is_some() { spread_of.of_share() * whole.luminance() } else { 0.0 };
        ReceivedByOne { diffuse, gloss: sent.map(|part| part * (1.0 / samples as f32)), error }
    }
}

/// A fragment that receives light.
struct LitFragment {
    receiver: Receiver,
    /// The unit normal of the face itself.
    facing: DVec3,
    /// The unit vector to where it is seen from.
    to_eye: DVec3,
    finish: Finish,
}

impl LitFragment {
    fn new(fragments: &Fragments<'_>, i: usize) -> LitFragment {
        let position = fragments.position.get(i).copied().unwrap_or_default();
        let finish = fragments.finish[i];
        let smooth = fragments.normal.get(i).map_or(DVec3::ZERO, |n| n.as_dvec3());
        let facing = fragments.facing.get(i).copied().unwrap_or(smooth);
        let normal = if finish.flat { facing } else { smooth };
        let to_eye = if finish.gloss == Gloss::None { DVec3::ZERO } else { fragments.to_eye(i) };
        LitFragment { receiver: Receiver { position, normal }, facing, to_eye, finish }
    }

    /// What its gloss sends to the eye of a part of a source.
    fn sent(&self, sample: &Sample) -> [Color; 2] {
        gloss::sent(self.finish, &self.receiver, self.to_eye, sample)
    }

    /// Whether the face itself is turned to where light comes from.
    fn faces(&self, toward: Toward) -> bool {
        self.facing.dot(toward.from(self.receiver.position).0) > 0.0
    }
}

/// How much of the light on a way to a plane arrives, which is so wide where it starts: what stands in it holds back
/// its share.
fn passes(
    world: &World,
    casters: &[(usize, &Casters)],
    fragments: &Fragments<'_>,
    plane: (DVec3, DVec3),
    (from, toward, width): (DVec3, Toward, f64),
) -> f32 {
    let (way, reach) = toward.from(from);
    // The light's own surface, at the end of the way, is not in it.
    let ray = Ray::new(from, way, reach * (1.0 - 1e-9));
    let mut through = 1.0f32;
    for (member, casters) in casters {
        casters.meet_all(&ray, |hit| {
            if shadow::lies_in(casters, hit.piece, plane) {
                return true;
            }
            let surfaces = &*world.members()[*member].surfaces;
            let met = || {
                let narrows = 1.0 - (hit.t / reach).clamp(0.0, 1.0);
                let width = (width * narrows) as f32;
                shadow::Way { from, along: way, position: ray.at(hit.t), width }
            };
            let opacity = shadow::opacity(surfaces, fragments.view, casters, hit.piece, met);
            through *= 1.0 - opacity;
            // Behind what is opaque nothing more is met.
            through > 0.0
        });
        if through <= 0.0 {
            return 0.0;
        }
    }
    through
}
