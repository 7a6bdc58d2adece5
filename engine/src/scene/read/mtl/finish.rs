//! A material of MTL, put together from its statements.

use super::super::super::material::{AlphaMode, Map, Material};
use super::Remarks;
use crate::color::Color;
use crate::fragment::{Gloss, Optics};

/// What a library has said of a material so far.
pub(super) struct Draft {
    pub(super) name: String,
    pub(super) material: Material,
    pub(super) ka: Option<Color>,
    pub(super) ks: Option<Color>,
    pub(super) tf: Option<Color>,
    pub(super) d: Option<f32>,
    pub(super) tr: Option<f32>,
    pub(super) ns: Option<f32>,
    pub(super) ni: Option<f32>,
    pub(super) illum: Option<u32>,
    pub(super) pr: Option<f32>,
    pub(super) pm: Option<f32>,
    pub(super) map_ka: Option<Map>,
    pub(super) map_pr: Option<Map>,
    pub(super) map_pm: Option<Map>,
}

impl Draft {
    pub(super) fn new(name: &str) -> Draft {
        let material = Material { color: Color::WHITE, ..Material::default() };
        let name = name.to_owned();
        let (ka, ks, tf, d, tr, ns) = (None, None, None, None, None, None);
        let (ni, illum, pr, pm) = (None, None, None, None);
        let (map_ka, map_pr, map_pm) = (None, None, None);
        Draft { name, material, ka, ks, tf, d, tr, ns, ni, illum, pr, pm, map_ka, map_pr, map_pm }
    }

    /// The material; what is not shown of it is told.
    pub(super) fn finish(mut self, told: &mut Remarks) -> (String, Material) {
        let name = self.name.clone();
        let mut tell = |what: &str| told.add(what, &name);
        self.alpha(&mut tell);
        let mut shows_ni = self.optics(&mut tell);
        if [&self.map_pr, &self.map_pm].iter().any(|map| map.is_some())
            || self.pr.or(self.pm).is_some()
        {
            self.microfacets(&mut tell);
            shows_ni = true;
        } else {
            self.highlight(&mut tell);
        }
        let said_nothing = [Color::BLACK, Color::WHITE, self.material.color];
        if self.ka.is_some_and(|ka| !said_nothing.contains(&ka)) {
            tell("Ka");
        }
        if self.map_ka.is_some_and(|map| self.material.maps.get("color") != Some(&map)) {
            tell("map_Ka");
        }
        // The illuminations up to 2 have no use for it, and Blender writes it beside them always.
        let has_no_use = matches!(self.illum, Some(0..=2)) && self.material.alpha == 1.0;
        if self.ni.is_some_and(|ni| ni != 1.0) && !shows_ni && !has_no_use {
            tell("Ni");
        }
        // Maps multiply, and many files have `map_Ke` without `Ke`.
        if self.material.maps.contains_key("emission") && self.material.finish.glow == Color::BLACK
        {
            self.material.finish.glow = Color::WHITE;
        }
        self.material.unlit = self.illum == Some(0);
        (name, self.material)
    }

    fn alpha(&mut self, tell: &mut dyn FnMut(&str)) {
        // `Tr` says the opposite of `d`, and some exporters write it the other way round.
        let clear = self.tr.map(|tr| 1.0 - tr);
        if let (Some(d), Some(clear)) = (self.d, clear)
            && (d - clear).abs() > 1e-3
        {
            tell("Tr, which contradicts d");
        }
        let material = &mut self.material;
        material.alpha = self.d.or(clear).unwrap_or(1.0).clamp(0.0, 1.0);
        if material.alpha == 0.0 {
            tell("anything, with a d of 0");
        }
        let has_alpha =
            material.maps.get("alpha").map(|map| Some(map) == material.maps.get("color"));
        if has_alpha == Some(true) {
            // The colour's own alpha does the same, and its picture is read once.
            material.maps.remove("alpha");
        }
        let is_cut = material.alpha < 1.0 || has_alpha.is_some();
        material.alpha_mode = if is_cut { AlphaMode::Blend } else { AlphaMode::Opaque };
    }

    /// What rays show of it. Returns whether its index of refraction counts.
    fn optics(&mut self, tell: &mut dyn FnMut(&str)) -> bool {
        let illum = self.illum.unwrap_or(2);
        let ks =
            self.ks.unwrap_or(if matches!(illum, 5 | 7) { Color::WHITE } else { Color::BLACK });
        let reflect = within(ks);
        let filter = within(self.tf.unwrap_or(Color::WHITE));
        let index = self.ni.unwrap_or(1.5).clamp(0.1, 10.0);
        let optics = |reflect, refract, fresnel| {
            Some(Optics { reflect, refract, index, fresnel, ..Optics::default() })
        };
        let refracts = matches!(illum, 6 | 7);
        self.material.finish.optics = match illum {
            3 | 4 | 8 | 9 if reflect != Color::BLACK => optics(reflect, Color::BLACK, false),
            5 => optics(reflect, Color::BLACK, true),
            // Without Fresnel's law the shares are fixed, and must not sum to more than all light.
            6 => optics(reflect, (Color::WHITE + reflect * -1.0) * filter, false),
            7 => optics(reflect, filter, true),
            0..=4 | 8 | 9 => None,
            _ => {
                tell(&format!("illum {illum}"));
                None
            }
        };
        if self.tf.is_some_and(|tf| tf != Color::WHITE) && !refracts {
            tell("Tf");
        }
        matches!(illum, 5..=7)
    }

    /// The highlight of the format is Ks cos^Ns of the angle at the half vector, which is half of the one at the
    /// mirrored direction: there it is as wide with a quarter of the exponent, and as bright in its middle if what
    /// leaves is 2 Ks / (exponent + 2) of all light.
    fn highlight(&mut self, tell: &mut dyn FnMut(&str)) {
        let has_highlight = !matches!(self.illum, Some(0 | 1));
        let Some(ks) = self.ks.filter(|ks| has_highlight && *ks != Color::BLACK) else { return };
        let Some(ns) = self.ns.filter(|ns| *ns > 0.0) else {
            if self.material.finish.optics.is_none() {
                tell("Ks without Ns");
            }
            return;
        };
        let [r, g, b] = ks.to_array();
        let mean = (r + g + b) / 3.0;
        if [r, g, b].iter().any(|v| (v - mean).abs() > 1e-3) {
            tell("the colour of Ks");
        }
        let exponent = (ns / 4.0).max(1.0);
        let share = (2.0 * mean / (exponent + 2.0)).clamp(0.0, 1.0);
        self.material.finish.gloss = Gloss::Phong { share, exponent };
    }

    fn microfacets(&mut self, tell: &mut dyn FnMut(&str)) {
        let unit = |value: f32| value.clamp(0.0, 1.0);
        // A picture is multiplied in: what is not said is all of it.
        let absent = |map: &Option<Map>, value: f32| if map.is_some() { 1.0 } else { value };
        let metal = unit(self.pm.unwrap_or(absent(&self.map_pm, 0.0)));
        // The width of Blinn's lobe.
        let by_ns = self.ns.map_or(0.5, |ns| (2.0 / (ns.max(0.0) + 2.0)).sqrt().sqrt());
        let roughness = unit(self.pr.unwrap_or(absent(&self.map_pr, by_ns)));
        let reflectance = self.ni.filter(|ni| *ni > 1.0).map_or(0.04, |ni| {
            // Fresnel's law, straight on.
            let share = (ni - 1.0) / (ni + 1.0);
            share * share
        });
        self.material.finish.gloss = Gloss::Microfacets { reflectance, roughness, metal };
        let rough = self.map_pr.take();
        let map = match (rough, self.map_pm.take()) {
            (Some(rough), Some(metal)) if rough == metal => Some(rough),
            // Without metal the other channel changes nothing.
            (Some(rough), None) if metal == 0.0 => Some(rough),
            (Some(_), None) => {
                tell("map_Pr beside metal");
                None
            }
            (None, Some(_)) => {
                tell("map_Pm without the same map_Pr");
                None
            }
            (Some(rough), Some(_)) => {
                tell("map_Pm, which is another picture than map_Pr");
                let Gloss::Microfacets { metal, .. } = &mut self.material.finish.gloss else {
                    return;
                };
                *metal = 0.0;
                Some(rough)
            }
            (None, None) => None,
        };
        self.material.maps.extend(map.map(|map| ("metallic_roughness".to_owned(), map)));
    }
}

fn within(color: Color) -> Color {
    let [r, g, b] = color.to_array().map(|v| v.clamp(0.0, 1.0));
    Color::new(r, g, b)
}
