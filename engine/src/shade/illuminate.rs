//! Illumination by any number of lamps, each by itself (\[N], "Illuminance calculation").

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f32::consts::PI;
use std::sync::Arc;

use super::bounces::Bounces;
use super::direct::{Lighting, Received, wants_error};
use super::gloss;
use crate::color::Color;
use crate::fragment::{Around, Columns, Finish, Fragments, Hiding, LightLayers, Shader};
use crate::key::KeyHasher;
use crate::light::Lamp;
use crate::trace::{Reductions, Toward};

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
        let is_sent_on = fragments.bounced() > 0;
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
            let received = match has_records && self.is_recorded(lamp, is_sent_on) {
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
                let is_off = reflected.is_some_and(|reflected| !reflected.error.is_empty());
                if is_off || !received.error.is_empty() {
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

impl Illuminate {
    /// Whether what fragments receive of a lamp itself is found at records: that of skies, and of all if only other
    /// surfaces see it.
    pub(super) fn is_recorded(&self, lamp: &Lamp, is_sent_on: bool) -> bool {
        if self.bounces.records(0).is_none() || lamp.light.is_everywhere() {
            return false;
        }
        let is_exact = matches!(self.shadows, Shadows::Volumes | Shadows::Analytic);
        is_sent_on || is_exact && lamp.light.luminance(DVec3::Y).is_some()
    }

    /// Whether light comes from all that is around.
    fn looks_around(&self) -> bool {
        let is_recorded = |lamp: &Lamp| lamp.shines() && self.is_recorded(lamp, false);
        self.bounces.times > 0 || self.lamps.iter().any(is_recorded)
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
