//! What the numbers of a file with 8 or 16 bits mean: how they become scene-linear colours of Rec. 709.
//!
//! A file that says nothing is sRGB. Others say it by a profile (ICC), by code points (cICP), or by a gamma
//! and primaries (PNG's gAMA and cHRM); of several the most exact counts, as the PNG standard has it: cICP
//! before iCCP before sRGB before gAMA and cHRM.

use glam::{DMat3, DVec2, DVec3, Vec3};
use moxcms::{ColorProfile, DataColorSpace, ToneReprCurve, TransferCharacteristics};
use std::sync::{Arc, LazyLock};

use crate::color::{D50, Primaries, decode_srgb, xyz_to_rec_709};
use crate::math;

/// By code what is linear.
#[derive(Clone, Debug)]
struct Curve {
    /// By codes of 8 bits, which are looked up together.
    bytes: Arc<[f32]>,
    /// By codes of 16 bits.
    words: Arc<[f32]>,
}

impl Curve {
    /// By what is linear at a code as a share of the greatest.
    fn new(linear: impl Fn(f32) -> f32) -> Curve {
        let words: Arc<[f32]> =
            (0..=u16::MAX).map(|code| linear(f32::from(code) / f32::from(u16::MAX))).collect();
        // Both tables agree at codes that both have.
        let bytes = words.iter().step_by(257).copied().collect();
        Curve { bytes, words }
    }

    fn is(&self, other: &Curve) -> bool {
        Arc::ptr_eq(&self.words, &other.words)
    }
}

/// How coded colours become scene-linear ones: by a curve each, and then, for primaries other than those of
/// Rec. 709, by a matrix.
#[derive(Clone, Debug)]
pub struct Coding {
    curves: [Curve; 3],
    matrix: Option<[Vec3; 3]>,
    /// What it is, if it is not sRGB: for whoever reads the picture.
    pub note: Option<String>,
}

static SRGB: LazyLock<Curve> = LazyLock::new(|| Curve::new(decode_srgb));

impl Coding {
    /// Whether codes become the same colours.
    pub(super) fn is(&self, other: &Coding) -> bool {
        let mut curves = self.curves.iter().zip(&other.curves);
        curves.all(|(a, b)| a.is(b) || a.words == b.words)
            && (&self.matrix, &self.note) == (&other.matrix, &other.note)
    }

    /// sRGB.
    pub fn srgb() -> Coding {
        Coding { curves: [(); 3].map(|()| SRGB.clone()), matrix: None, note: None }
    }

    /// A power of the code, and primaries if they are not those of Rec. 709.
    ///
    /// # Errors
    /// If the gamma is not from 0.1 to 10, or the primaries span no colours.
    pub fn of_gamma(gamma: f64, primaries: Option<Primaries>) -> Result<Coding, String> {
        if !(0.1..=10.0).contains(&gamma) {
            return Err(format!("a gamma of {gamma}"));
        }
        let curve = Curve::new(|code| math::pow(f64::from(code), gamma) as f32);
        let coding = Coding { curves: [(); 3].map(|()| curve.clone()), ..Coding::srgb() };
        let coding = coding.with_primaries(primaries)?;
        let words = if coding.matrix.is_some() { " and primaries of its own" } else { "" };
        Ok(Coding { note: Some(format!("a gamma of {gamma:.3}{words}")), ..coding })
    }

    /// sRGB's curve with other primaries.
    ///
    /// # Errors
    /// If they span no colours.
    pub fn of_primaries(primaries: Primaries) -> Result<Coding, String> {
        let coding = Coding::srgb().with_primaries(Some(primaries))?;
        let note = coding.matrix.is_some().then(|| "primaries of its own".to_owned());
        Ok(Coding { note, ..coding })
    }

    fn with_primaries(self, primaries: Option<Primaries>) -> Result<Coding, String> {
        let Some(primaries) = primaries.filter(|primaries| !primaries.are_rec_709()) else {
            return Ok(self);
        };
        let matrix = primaries.to_rec_709().ok_or("primaries that span no colours")?;
        Ok(Coding { matrix: Some(columns(matrix)), ..self })
    }

    /// By the code points of ITU-T H.273: primaries and transfer characteristics.
    ///
    /// # Errors
    /// If they are not known here, or code by what a display can show (PQ, HLG).
    pub fn of_code_points(primaries: u8, transfer: u8) -> Result<Coding, String> {
        let xy = |x: f64, y: f64| DVec2::new(x, y);
        let d65 = xy(0.3127, 0.329);
        let of = |red, green, blue, white| Primaries { red, green, blue, white };
        let (name, primaries) = match primaries {
            1 => ("Rec. 709", None),
            4 => {
                ("NTSC", Some(of(xy(0.67, 0.33), xy(0.21, 0.71), xy(0.14, 0.08), xy(0.31, 0.316))))
            }
            5 => ("PAL", Some(of(xy(0.64, 0.33), xy(0.29, 0.6), xy(0.15, 0.06), d65))),
            6 | 7 => ("Rec. 601", Some(of(xy(0.63, 0.34), xy(0.31, 0.595), xy(0.155, 0.07), d65))),
            9 => ("Rec. 2020", Some(of(xy(0.708, 0.292), xy(0.17, 0.797), xy(0.131, 0.046), d65))),
            11 => {
                let white = xy(0.314, 0.351);
                ("DCI P3", Some(of(xy(0.68, 0.32), xy(0.265, 0.69), xy(0.15, 0.06), white)))
            }
            12 => ("Display P3", Some(of(xy(0.68, 0.32), xy(0.265, 0.69), xy(0.15, 0.06), d65))),
            other => return Err(format!("cICP primaries {other}")),
        };
        let coding = match transfer {
            13 => Coding::srgb(),
            8 => Coding::of_gamma(1.0, None)?,
            4 => Coding::of_gamma(2.2, None)?,
            5 => Coding::of_gamma(2.8, None)?,
            // The curve that cameras code by, not that of a display.
            1 | 6 | 14 | 15 => {
                let own = moxcms::ToneReprCurve::make_cicp_linear_evaluator(
                    TransferCharacteristics::Bt709,
                );
                let own = own.map_err(|e| e.to_string())?;
                let curve = Curve::new(|code| own.evaluate_value(code));
                Coding { curves: [(); 3].map(|()| curve.clone()), ..Coding::srgb() }
            }
            16 | 18 => {
                return Err("brightness as a display shows it (PQ or HLG): save it as .exr".into());
            }
            other => return Err(format!("cICP transfer characteristics {other}")),
        };
        let is_srgb = primaries.is_none() && transfer == 13;
        let note = (!is_srgb).then(|| format!("{name}, by its code points (cICP)"));
        Ok(Coding { note, ..coding.with_primaries(primaries)? })
    }

    /// By an ICC profile of `channels` colours, 1 or 3; `None` if that is sRGB's own.
    ///
    /// # Errors
    /// If the profile is damaged or of a kind that is not read: by tables instead of curves, or of other colours.
    pub fn of_profile(profile: &[u8], channels: u8) -> Result<Option<Coding>, String> {
        let profile = ColorProfile::new_from_slice(profile).map_err(|e| e.to_string())?;
        let linear = |curve: &Option<ToneReprCurve>| -> Result<Curve, String> {
            let curve = curve.as_ref().ok_or("it has no curves")?;
            let own = curve.make_linear_evaluator().map_err(|e| e.to_string())?;
            // As far as 8 bits tell.
            let near = |byte: usize| {
                let (a, b) = (own.evaluate_value(byte as f32 / 255.0), SRGB.bytes[byte]);
                // Profiles of sRGB round its curve in many ways: all are to take the quick way.
                (a - b).abs() < 1.0 / 512.0 * b.max(0.05)
            };
            let is_srgb = (0..256).all(near);
            Ok(if is_srgb { SRGB.clone() } else { Curve::new(|code| own.evaluate_value(code)) })
        };
        let name = profile.description.as_ref().and_then(|text| match text {
            moxcms::ProfileText::PlainString(text) => Some(text.clone()),
            moxcms::ProfileText::Localizable(all) => all.first().map(|one| one.value.clone()),
            moxcms::ProfileText::Description(text) => Some(text.ascii_string.clone()),
        });
        let name = name.map(|name| name.trim_end_matches('\0').trim().to_owned());
        let name = name.filter(|name| !name.is_empty()).unwrap_or_else(|| "a profile".to_owned());
        let coding = match (profile.color_space, channels) {
            (DataColorSpace::Gray, 1) => {
                let own = linear(&profile.gray_trc)?;
                Coding { curves: [(); 3].map(|()| own.clone()), ..Coding::srgb() }
            }
            (DataColorSpace::Rgb, 1 | 3) => {
                let curves = [&profile.red_trc, &profile.green_trc, &profile.blue_trc].map(linear);
                let [red, green, blue] = curves;
                let xyz = |c: moxcms::Xyzd| DVec3::new(c.x, c.y, c.z);
                let to_xyz = DMat3::from_cols(
                    xyz(profile.red_colorant),
                    xyz(profile.green_colorant),
                    xyz(profile.blue_colorant),
                );
                // Colorants of profiles are adapted to D50 already.
                let matrix = xyz_to_rec_709(D50) * to_xyz;
                if !matrix.is_finite() || matrix.determinant().abs() < 1e-9 {
                    return Err(format!("\"{name}\" has primaries that span no colours"));
                }
                // Profiles round to 16 bits.
                let off = (matrix - DMat3::IDENTITY).to_cols_array();
                let is_own = off.iter().all(|v| v.abs() < 2e-3);
                let matrix = (!is_own).then(|| columns(matrix));
                Coding { curves: [red?, green?, blue?], matrix, ..Coding::srgb() }
            }
            (space, _) => {
                return Err(format!("\"{name}\" is of {space:?}, and the picture is not"));
            }
        };
        if coding.is_srgb() {
            return Ok(None);
        }
        Ok(Some(Coding { note: Some(format!("\"{name}\" (ICC)")), ..coding }))
    }

    /// The scene-linear colour of codes of 16 bits.
    #[inline]
    pub fn linear(&self, codes: [u16; 3]) -> [f32; 3] {
        self.mixed(std::array::from_fn(|i| self.curves[i].words[usize::from(codes[i])]))
    }

    /// The scene-linear colour of codes of 8 bits.
    #[inline]
    pub fn linear_bytes(&self, codes: [u8; 3]) -> [f32; 3] {
        self.mixed(std::array::from_fn(|i| self.curves[i].bytes[usize::from(codes[i])]))
    }

    #[inline]
    fn mixed(&self, own: [f32; 3]) -> [f32; 3] {
        match &self.matrix {
            None => own,
            Some([r, g, b]) => (*r * own[0] + *g * own[1] + *b * own[2]).to_array(),
        }
    }

    /// Whether it is sRGB.
    pub fn is_srgb(&self) -> bool {
        self.matrix.is_none() && self.curves.iter().all(|curve| curve.is(&SRGB))
    }

    /// Whether its colours are those of Rec. 709.
    pub fn is_rec_709(&self) -> bool {
        self.matrix.is_none()
    }
}

fn columns(matrix: DMat3) -> [Vec3; 3] {
    [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| axis.as_vec3())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: [f32; 3], expected: [f32; 3], within: f32) {
        let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < within);
        assert!(near, "{found:?} {expected:?}");
    }

    #[test]
    fn codes_are_what_their_files_say() {
        let half = [32_768; 3];
        close(Coding::srgb().linear(half), [0.21404; 3], 1e-4);
        close(Coding::of_gamma(2.2, None).unwrap().linear(half), [0.21764; 3], 1e-4);
        assert!(Coding::of_code_points(1, 13).unwrap().is_srgb());
        // Full red of Display P3 lies outside of Rec. 709.
        let p3 = Coding::of_code_points(12, 13).unwrap();
        close(p3.linear([65_535, 0, 0]), [1.2249, -0.0421, -0.0196], 1e-3);
        close(p3.linear([65_535; 3]), [1.0; 3], 1e-4);
        assert!(Coding::of_code_points(9, 16).is_err() && Coding::of_code_points(77, 13).is_err());
    }

    #[test]
    fn profiles_are_read() {
        let srgb = ColorProfile::new_srgb().encode().unwrap();
        assert!(Coding::of_profile(&srgb, 3).unwrap().is_none());
        // Adobe RGB: a gamma of 563/256, a wider green.
        let adobe = ColorProfile::new_adobe_rgb().encode().unwrap();
        let adobe = Coding::of_profile(&adobe, 3).unwrap().unwrap();
        close(adobe.linear([0, 65_535, 0]), [-0.3983, 1.0, -0.0430], 2e-3);
        close(adobe.linear([32_768; 3]), [0.2178; 3], 2e-3);
        let grey = ColorProfile::new_gray_with_gamma(1.8).encode().unwrap();
        let grey = Coding::of_profile(&grey, 1).unwrap().unwrap();
        close(grey.linear([32_768; 3]), [0.2872; 3], 2e-3);
        assert!(Coding::of_profile(b"no profile", 3).is_err());
    }
}
