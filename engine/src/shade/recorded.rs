//! What places receive of a lamp, by samples of it.

use glam::{DVec2, DVec3};

use super::bounces::{Gathered, Place, standard_error, tilted};
use super::direct::{Blocker, arriving, passes};
use super::openings::Openings;
use crate::color::Color;
use crate::fragment::{Fragments, World};
use crate::light::{Light, Receiver};
use crate::trace::Casters;

/// A lamp of unit strength that is found at records.
pub(super) struct RecordedLamp<'a> {
    /// Its place among those that do not shine everywhere.
    pub(super) number: usize,
    pub(super) light: &'a dyn Light,
    /// What may stand in its way; `None` if nothing does.
    pub(super) casts: Option<&'a [(usize, &'a Casters)]>,
    pub(super) world: &'a World,
    pub(super) like: &'a Fragments<'a>,
}

/// What one sample of a lamp gives to a place.
pub(super) struct LampSample {
    /// The irradiance that the lamp would give if all of it were like this.
    pub(super) irradiance: Color,
    /// How much of that reaches the place.
    pub(super) lit: f32,
    /// The unit vector to it.
    way: DVec3,
}

impl RecordedLamp<'_> {
    /// Whether it is a sky: it looks the same from everywhere.
    pub(super) fn is_sky(&self) -> bool {
        self.light.luminance(DVec3::Y).is_some()
    }

    /// A sample by two numbers in [0, 1), from one of the starts of a place.
    pub(super) fn sample(
        &self,
        place: &Place,
        (start, choice): (DVec3, DVec2),
        blocker: &Blocker,
    ) -> LampSample {
        let receiver = Receiver { position: start, normal: place.normal };
        let sample = self.light.sample(&receiver, choice);
        let way = sample.toward.from(start).0.normalize_or_zero();
        let plane = (place.facing, place.position);
        let lit = match (way.dot(place.facing) > 0.0, self.casts) {
            (false, _) => 0.0,
            (true, None) => 1.0,
            (true, Some(casters)) => {
                let around = (self.world, casters, self.like);
                passes(around, plane, (start, sample.toward, 0.0), blocker)
            }
        };
        LampSample { irradiance: sample.irradiance, lit, way }
    }

    /// Adds what a place receives of it, by so many samples, most of them where it is seen.
    pub(super) fn add(
        &self,
        place: &Place,
        count: u32,
        openings: Option<&Openings>,
        all: &mut Gathered,
    ) {
        let share = 1.0 / count as f32;
        let receiver = |position: DVec3| Receiver { position, normal: place.normal };
        let mut whole = self.light.irradiance(&receiver(place.position));
        if !place.starts.is_empty() && !self.is_sky() {
            let wholes = (0..count).map(|k| self.light.irradiance(&receiver(place.start(k))));
            whole = wholes.fold(Color::BLACK, |sum, one| sum + one) * share;
        }
        if whole == Color::BLACK {
            return;
        }
        let (mut open, mut reaches) = (Color::BLACK, Color::BLACK);
        let mut tilts = [Color::BLACK; 3];
        let mut parts = Vec::with_capacity(count as usize);
        let blocker = Blocker::default();
        for k in 0..count {
            let choice = place.pattern.at(k);
            let (choice, weight) = openings.map_or((choice, 1.0), |openings| openings.at(choice));
            let LampSample { irradiance, lit, way } =
                self.sample(place, (place.start(k), choice), &blocker);
            let irradiance = irradiance * weight;
            let part = irradiance * lit;
            parts.push([irradiance, part].map(Color::luminance));
            (open, reaches) = (open + irradiance, reaches + part);
            for (tilt, along) in tilts.iter_mut().zip(tilted(way, place.normal)) {
                *tilt = *tilt + part * along;
            }
        }
        // Where most of it is hidden, the few samples there say little of how much all of it is.
        let is_share = openings.is_none();
        let arrives = |part: Color| match is_share {
            true => arriving(whole, open, part),
            false => part * share,
        };
        let lamp = self.number;
        all.light[lamp] = all.light[lamp] + arrives(reaches);
        for (own, tilt) in all.tilt[lamp].iter_mut().zip(tilts) {
            *own = *own + arrives(tilt);
        }
        // Of a ratio, what is left of each part when the ratio is taken away.
        let ratio = match is_share {
            true => reaches.luminance() / open.luminance().max(f32::MIN_POSITIVE),
            false => 0.0,
        };
        let left = parts.iter().map(|[open, reaches]| reaches - ratio * open);
        let scale = match is_share {
            true => whole.luminance() * count as f32 / open.luminance().max(f32::MIN_POSITIVE),
            false => 1.0,
        };
        all.error[lamp] += standard_error(left, count) * scale;
    }
}
