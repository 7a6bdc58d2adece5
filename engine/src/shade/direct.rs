//! What fragments receive of a lamp itself (\[N], "Illuminance calculation").

use glam::{DVec2, DVec3};
use std::cell::Cell;

use super::illuminate::{Illuminate, Shadows};
use super::pattern::{Pattern, Spread};
use super::{clipped, gloss};
use crate::color::Color;
use crate::fragment::{Around, Batch, Casting, Finish, Fragments, Gloss, World};
use crate::light::{Lamp, Light, Receiver, Sample};
use crate::shadow;
use crate::trace::{Casters, Ray, Toward};

/// What fragments receive of a lamp of unit strength.
#[derive(Debug, Default)]
pub(super) struct Received {
    /// Irradiance in lux. Empty if there is none.
    pub(super) diffuse: GreyOrColors,
    /// What its gloss sends to the eye: the factor of its own reflectance, and the rest. Empty if
    /// nothing shines.
    pub(super) gloss: Vec<[Color; 2]>,
    /// By how much the irradiance may be off. Empty if nobody asks, or by nothing.
    pub(super) error: Vec<f32>,
}

/// Colours, most of which are grey.
#[derive(Debug)]
pub(super) enum GreyOrColors {
    Grey(Vec<f32>),
    Colored(Vec<Color>),
}

impl Default for GreyOrColors {
    fn default() -> GreyOrColors {
        GreyOrColors::Grey(Vec::new())
    }
}

impl GreyOrColors {
    pub(super) fn new(colors: Vec<Color>) -> GreyOrColors {
        if colors.iter().all(|c| c.r == c.g && c.g == c.b) {
            GreyOrColors::Grey(colors.into_iter().map(|c| c.r).collect())
        } else {
            GreyOrColors::Colored(colors)
        }
    }

    pub(super) fn at(&self, i: usize) -> Color {
        match self {
            GreyOrColors::Grey(values) => Color::grey(values.get(i).copied().unwrap_or(0.0)),
            GreyOrColors::Colored(values) => values[i],
        }
    }

    pub(super) fn bytes(&self) -> usize {
        match self {
            GreyOrColors::Grey(values) => size_of_val(&**values),
            GreyOrColors::Colored(values) => size_of_val(&**values),
        }
    }
}

/// Whether anybody asks by how much light may be off: of what is sent on nobody does.
pub(super) fn wants_error(fragments: &Fragments<'_>) -> bool {
    fragments.layers.is_some() && fragments.bounced() == 0
}

fn shines(fragments: &Fragments<'_>) -> bool {
    fragments.finish.iter().any(|finish| finish.gloss != Gloss::None)
}

/// What one fragment receives of a lamp of unit strength.
#[derive(Default)]
pub(super) struct ReceivedByOne {
    pub(super) diffuse: Color,
    gloss: [Color; 2],
    pub(super) error: f32,
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

/// Of how many parts of a source one is chosen.
const CANDIDATES: usize = 8;

/// One light on one batch of fragments.
pub(super) struct Lighting<'a> {
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
    blocker: Blocker,
}

impl<'a> Lighting<'a> {
    pub(super) fn new(
        shader: &Illuminate,
        lamp: &'a Lamp,
        fragments: &'a Fragments<'a>,
        around: &Around<'a>,
    ) -> Lighting<'a> {
        let light = &*lamp.light;
        let is_sent_on = fragments.bounced() > 0;
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
            // Of what others see one part of a source is enough: it is one of many.
            is_clipped: shader.shadows == Shadows::Analytic && !is_sent_on,
            shines: light.is_mirrored() && !is_sent_on && shines(fragments),
            blocker: Blocker::default(),
        }
    }

    pub(super) fn received(&self) -> Received {
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

    /// What a fragment receives, on its back too if that comes through.
    pub(super) fn of(&self, i: usize) -> ReceivedByOne {
        let spot = LitFragment::new(self.fragments, i);
        let mut all = self.on_side(&spot, i);
        let through = spot.transmit();
        // Light from everywhere is on both sides: how much of it is sent back is one number.
        let back = spot.behind().filter(|_| !self.light.is_everywhere());
        if let Some(back) = back.map(|back| self.on_side(&back, i)) {
            all.diffuse = all.diffuse + back.diffuse * through;
            all.error += back.error * through.luminance();
        }
        all
    }

    /// What one side of a fragment receives.
    pub(super) fn on_side(&self, spot: &LitFragment, i: usize) -> ReceivedByOne {
        let whole = self.light.irradiance(&spot.receiver);
        // No light from behind a face, whatever its interpolated normal says; leaves lie all ways.
        let is_behind = |toward| self.fragments.cards.is_empty() && !spot.faces(toward);
        let whole = if self.from.is_some_and(is_behind) { Color::BLACK } else { whole };
        // Most fragments are turned away from most lamps: for these no shadow is looked for.
        if whole == Color::BLACK || self.light.is_everywhere() {
            return ReceivedByOne { diffuse: whole, ..ReceivedByOne::default() };
        }
        if let Some(diffuse) = self.clipped(spot) {
            let shines = self.shines && spot.finish.shines();
            let gloss = shines.then(|| self.by_samples(spot, i, whole).gloss);
            return ReceivedByOne { diffuse, gloss: gloss.unwrap_or_default(), error: 0.0 };
        }
        let is_soft = self.from.is_none();
        if self.world.is_some() || (self.shines && is_soft) {
            return self.by_samples(spot, i, whole);
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
        // What counts for little in the picture, as mirrored light does, takes as little of the samples; what several
        // rays show is averaged over them.
        let weight = fragments
            .sight
            .as_ref()
            .map_or(1.0, |sight| sight.weight[i].greatest() / sight.rays.max(1) as f32);
        let samples = ((self.samples as f32 * weight).ceil() as u32).clamp(1, self.samples);
        let (mut open, mut reaches) = (Color::BLACK, Color::BLACK);
        let mut spread_of = Deviation::default();
        let mut sent = [Color::BLACK; 2];
        let width = fragments.width(i);
        let is_one_of_many = samples == 1 && fragments.bounced() > 0 && self.from.is_none();
        for k in 0..samples {
            let choice = pattern.at(k);
            let sample = match is_one_of_many {
                true => self.likely(&spot.receiver, &pattern),
                false => self.light.sample(&spot.receiver, choice),
            };
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
                        let around = (world, &*self.casters, fragments);
                        passes(around, plane, way, &self.blocker)
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
        let diffuse = arriving(whole, open, reaches);
        let error =
            if self.world.is_some() { spread_of.of_share() * whole.luminance() } else { 0.0 };
        ReceivedByOne { diffuse, gloss: sent.map(|part| part * (1.0 / samples as f32)), error }
    }
}

impl Lighting<'_> {
    /// One of a few parts of the source, chosen as often as it is bright at a receiver (resampling: Talbot, Cline and
    /// Egbert 2005). The ratio of one evenly chosen part would be off in the mean, which many rays do not mend.
    fn likely(&self, receiver: &Receiver, pattern: &Pattern) -> Sample {
        let parts: [Sample; CANDIDATES] =
            std::array::from_fn(|k| self.light.sample(receiver, pattern.at(k as u32)));
        let sum: f32 = parts.iter().map(|part| part.irradiance.luminance()).sum();
        let mut left = pattern.chance() * sum;
        let chosen = parts.iter().position(|part| {
            left -= part.irradiance.luminance();
            left < 0.0
        });
        parts[chosen.unwrap_or(0)]
    }
}

/// What arrives of what is known without a sample: the share that reaches a place of what samples have open.
pub(super) fn arriving(whole: Color, open: Color, reaches: Color) -> Color {
    let share = |whole: f32, open: f32, reaches: f32| {
        if open > 0.0 { whole * (reaches / open) } else { 0.0 }
    };
    Color::new(
        share(whole.r, open.r, reaches.r),
        share(whole.g, open.g, reaches.g),
        share(whole.b, open.b, reaches.b),
    )
}

/// A fragment that receives light.
pub(super) struct LitFragment {
    pub(super) receiver: Receiver,
    /// The unit normal of the face itself.
    pub(super) facing: DVec3,
    /// The unit vector to where it is seen from.
    to_eye: DVec3,
    finish: Finish,
}

impl LitFragment {
    pub(super) fn new(fragments: &Fragments<'_>, i: usize) -> LitFragment {
        let position = fragments.position.get(i).copied().unwrap_or_default();
        let finish = fragments.finish[i];
        let smooth = fragments.normal.get(i).map_or(DVec3::ZERO, |n| n.as_dvec3());
        let facing = fragments.facing.get(i).copied().unwrap_or(smooth);
        let normal = if finish.flat { facing } else { smooth };
        let to_eye = if finish.gloss == Gloss::None { DVec3::ZERO } else { fragments.to_eye(i) };
        LitFragment { receiver: Receiver { position, normal }, facing, to_eye, finish }
    }

    /// Its back, if what falls on it comes through; that does not shine.
    pub(super) fn behind(&self) -> Option<LitFragment> {
        let Receiver { position, normal } = self.receiver;
        self.finish.transmits().then(|| LitFragment {
            receiver: Receiver { position, normal: -normal },
            facing: -self.facing,
            to_eye: self.to_eye,
            finish: Finish { gloss: Gloss::None, ..self.finish },
        })
    }

    /// By how much what falls on its back is multiplied that comes through.
    pub(super) fn transmit(&self) -> Color {
        self.finish.transmit
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

/// The opaque piece that last stood in a way, by its scene's place among those that cast: it may stand in the next.
#[derive(Debug, Default)]
pub(super) struct Blocker(Cell<Option<(usize, usize)>>);

/// How much of the light on a way to a plane arrives, which is so wide where it starts: what stands in it holds back
/// its share.
pub(super) fn passes(
    (world, casters, fragments): (&World, &[(usize, &Casters)], &Fragments<'_>),
    plane: (DVec3, DVec3),
    (from, toward, width): (DVec3, Toward, f64),
    blocker: &Blocker,
) -> f32 {
    let (way, reach) = toward.from(from);
    // The light's own surface, at the end of the way, is not in it.
    let ray = Ray::new(from, way, reach * (1.0 - 1e-9));
    let is_in_it = |(place, piece): (usize, usize)| {
        let casters = casters[place].1;
        casters.meet(piece, &ray).is_some() && !shadow::lies_in(casters, piece, plane)
    };
    if blocker.0.get().is_some_and(is_in_it) {
        return 0.0;
    }
    let mut through = 1.0f32;
    for (place, (member, casters)) in casters.iter().enumerate() {
        casters.meet_all(&ray, |hit| {
            if shadow::lies_in(casters, hit.piece, plane) {
                return true;
            }
            if casters.pieces()[hit.piece].opacity == 1.0 {
                blocker.0.set(Some((place, hit.piece)));
                through = 0.0;
                return false;
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
