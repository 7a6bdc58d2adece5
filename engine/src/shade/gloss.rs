//! How glossy surfaces mirror light sources.

use glam::DVec3;

use crate::color::Color;
use crate::fragment::{Finish, Gloss};
use crate::light::{Receiver, Sample};
use crate::math;

/// The reflectance of a gloss's own, by which the first part of what is [`sent`] is multiplied.
pub(super) fn reflectance(gloss: Gloss, color: Color) -> Color {
    match gloss {
        Gloss::None => Color::BLACK,
        Gloss::Phong { share, .. } => Color::grey(share),
        Gloss::Microfacets { reflectance, metal, .. } => Color::grey(reflectance).mix(color, metal),
    }
}

/// The share of light that a gloss leaves to the diffuse colour below it.
pub(super) fn left_by(gloss: Gloss) -> f32 {
    match gloss {
        Gloss::None | Gloss::Phong { .. } => 1.0,
        Gloss::Microfacets { reflectance, metal, .. } => (1.0 - metal) * (1.0 - reflectance),
    }
}

/// The share of light that a surface reflects to all sides, if what shines does so too.
pub(super) fn to_all_sides(finish: &Finish, color: Color) -> Color {
    color * (finish.diffuse * left_by(finish.gloss)) + reflectance(finish.gloss, color)
}

/// What a gloss sends to the eye of a part of a source's light, as the illuminance of a white diffuse
/// surface that would look as bright: the factor of its own reflectance, and what is added to it towards
/// grazing angles, where everything is a mirror.
pub(super) fn sent(finish: Finish, at: &Receiver, to_eye: DVec3, sample: &Sample) -> [Color; 2] {
    let black = [Color::BLACK; 2];
    let to_light = sample.toward.from(at.position).0.normalize_or_zero();
    let (n_l, n_v) = (at.normal.dot(to_light), at.normal.dot(to_eye));
    if n_l <= 0.0 || n_v <= 0.0 {
        return black;
    }
    match finish.gloss {
        Gloss::None => black,
        Gloss::Phong { exponent, .. } => {
            let mirrored = at.normal * (2.0 * n_l) - to_light;
            let cosine = mirrored.dot(to_eye).max(0.0);
            let exponent = f64::from(exponent.max(1.0));
            // Normalised (Lafortune and Willems 1994), and not divided by the cosine of the light.
            let lobe = (exponent + 2.0) / 2.0 * math::pow(cosine, exponent);
            [sample.irradiance * lobe as f32, Color::BLACK]
        }
        Gloss::Microfacets { roughness, .. } => {
            let half = (to_light + to_eye).normalize_or_zero();
            let (n_h, v_h) = (at.normal.dot(half).max(0.0), to_eye.dot(half).max(0.0));
            let alpha = f64::from(roughness.clamp(0.0, 1.0));
            // The square of GGX's alpha, which is roughness squared, as in glTF. The floor keeps
            // the lobe of a mirror finite.
            let a2 = (alpha * alpha * alpha * alpha).max(1e-8);
            let d = n_h * n_h * (a2 - 1.0) + 1.0;
            let distribution = a2 / (d * d);
            let smith = n_l * (n_v * n_v * (1.0 - a2) + a2).sqrt()
                + n_v * (n_l * n_l * (1.0 - a2) + a2).sqrt();
            // GGX with Smith's height-correlated term (Heitz 2014), times pi, as this is an
            // illuminance.
            let lobe = distribution * 0.5 / smith.max(1e-12);
            // Schlick (1994).
            let grazing = math::pow(1.0 - v_h.min(1.0), 5.0);
            let part = |share: f64| sample.irradiance * (lobe * share) as f32;
            [part(1.0 - grazing), part(grazing)]
        }
    }
}
