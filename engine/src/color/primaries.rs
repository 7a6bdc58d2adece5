//! Colours of other primaries, brought to those of Rec. 709.

use glam::{DMat3, DVec2, DVec3};

/// The chromaticities of three primaries and of white, CIE 1931 x and y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Primaries {
    /// Red.
    pub red: DVec2,
    /// Green.
    pub green: DVec2,
    /// Blue.
    pub blue: DVec2,
    /// What equal parts of all three make.
    pub white: DVec2,
}

/// Those of Rec. 709 and of sRGB, with the white D65.
pub const REC_709: Primaries = Primaries {
    red: DVec2::new(0.64, 0.33),
    green: DVec2::new(0.3, 0.6),
    blue: DVec2::new(0.15, 0.06),
    white: DVec2::new(0.3127, 0.329),
};

/// The white of the connection space of ICC profiles, D50.
pub const D50: DVec3 = DVec3::new(0.9642, 1.0, 0.8249);

impl Primaries {
    /// Whether they are those of Rec. 709, but for rounding in files.
    pub fn are_rec_709(&self) -> bool {
        let near = |a: DVec2, b: DVec2| (a - b).abs().max_element() < 2e-3;
        near(self.red, REC_709.red)
            && near(self.green, REC_709.green)
            && near(self.blue, REC_709.blue)
            && near(self.white, REC_709.white)
    }

    /// From linear red, green and blue to X, Y and Z, white having the Y of 1; `None` if they span no colours.
    pub fn to_xyz(&self) -> Option<DMat3> {
        let xyz = |c: DVec2| DVec3::new(c.x / c.y, 1.0, (1.0 - c.x - c.y) / c.y);
        // A primary without luminance, as imaginary ones have, is given by its direction alone.
        let direction = |c: DVec2| DVec3::new(c.x, c.y, 1.0 - c.x - c.y);
        let columns =
            DMat3::from_cols(direction(self.red), direction(self.green), direction(self.blue));
        // Twice the triangle's area.
        if columns.determinant().abs() < 1e-6 {
            return None;
        }
        // How much of each primary makes white.
        let amounts = columns.inverse() * xyz(self.white);
        let all = columns * DMat3::from_diagonal(amounts);
        (all.is_finite() && all.determinant() != 0.0).then_some(all)
    }

    /// From linear colours of these primaries to those of Rec. 709, the white adapted (Bradford); `None` if they span
    /// no colours.
    pub fn to_rec_709(&self) -> Option<DMat3> {
        let white = DVec3::new(
            self.white.x / self.white.y,
            1.0,
            (1.0 - self.white.x - self.white.y) / self.white.y,
        );
        Some(xyz_to_rec_709(white) * self.to_xyz()?)
    }
}

/// From X, Y and Z of colours seen under a white to linear Rec. 709, that white adapted to D65 (Bradford).
pub fn xyz_to_rec_709(white: DVec3) -> DMat3 {
    let bradford = DMat3::from_cols(
        DVec3::new(0.8951, -0.7502, 0.0389),
        DVec3::new(0.2664, 1.7135, -0.0685),
        DVec3::new(-0.1614, 0.0367, 1.0296),
    );
    let own = REC_709.to_xyz().unwrap_or(DMat3::IDENTITY);
    let (from, to) = (bradford * white, bradford * (own * DVec3::ONE));
    own.inverse() * bradford.inverse() * DMat3::from_diagonal(to / from) * bradford
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn primaries_are_brought_to_rec_709() {
        let identity = REC_709.to_rec_709().unwrap();
        assert!((identity - DMat3::IDENTITY).to_cols_array().iter().all(|v| v.abs() < 1e-12));
        // ACEScg, to the digits that are published for it (Bradford, D60 to D65).
        let acescg = Primaries {
            red: DVec2::new(0.713, 0.293),
            green: DVec2::new(0.165, 0.83),
            blue: DVec2::new(0.128, 0.044),
            white: DVec2::new(0.32168, 0.33767),
        };
        let matrix = acescg.to_rec_709().unwrap();
        let published = [
            [1.70505, -0.62179, -0.08326],
            [-0.13026, 1.14080, -0.01055],
            [-0.02400, -0.12897, 1.15297],
        ];
        for (row, expected) in published.iter().enumerate() {
            for (column, expected) in expected.iter().enumerate() {
                let found = matrix.col(column)[row];
                assert!((found - expected).abs() < 2e-4, "{row} {column}: {found}");
            }
        }
        // White stays white, whatever its colour was.
        for white in [DVec2::new(0.3457, 0.3585), DVec2::new(0.31, 0.316)] {
            let made = Primaries { white, ..REC_709 }.to_rec_709().unwrap() * DVec3::ONE;
            assert!((made - DVec3::ONE).abs().max_element() < 1e-12);
        }
        let line = Primaries { blue: DVec2::new(0.47, 0.465), ..REC_709 };
        assert_eq!(line.to_rec_709(), None, "on the line between red and green");
    }
}
