//! Where rays start and what they aim at: points spread evenly over what a fragment covers, and over a
//! source.

use glam::{DVec2, DVec3};

use crate::fragment::{Fragments, LinePiece};

/// Points of what a fragment covers.
pub(super) struct Spread {
    pieces: Vec<LinePiece>,
    /// The length of all pieces.
    length: f64,
}

impl Spread {
    pub(super) fn new(pieces: Vec<LinePiece>) -> Spread {
        let length = pieces.iter().map(|piece| piece.x[1] - piece.x[0]).sum();
        Spread { pieces, length }
    }

    /// The point of the face's plane, on a fragment, for two numbers in [0, 1); `None` if nothing is known.
    pub(super) fn on_plane(
        &self,
        choice: DVec2,
        fragments: &Fragments<'_>,
        i: usize,
        normal: DVec3,
    ) -> Option<DVec3> {
        let DVec2 { x, y } = self.at(choice)?;
        let view = fragments.view;
        // On the line of sight, as far away as the fragment: nothing here depends on the size of the world.
        let there = view.world_point(x, y, fragments.depth[i]);
        let along = match view.is_parallel() {
            true => view.world_direction(DVec3::NEG_Z),
            false => there - view.camera().position,
        };
        // Then moved along the line of sight onto the face's plane.
        let t = normal.dot(fragments.position[i] - there) / normal.dot(along);
        Some(there + along * t).filter(|point| point.is_finite())
    }

    /// The point of the screen for two numbers in [0, 1).
    fn at(&self, choice: DVec2) -> Option<DVec2> {
        let mut rest = choice.y * self.length;
        let mut found = None;
        for LinePiece { x, y } in &self.pieces {
            let length = x[1] - x[0];
            // What is left of one number says how far down, the other how far to the right.
            let down = (rest / length).clamp(0.0, 1.0);
            found = Some(DVec2::new(x[0] + length * choice.x, y[0] + (y[1] - y[0]) * down));
            if rest < length {
                break;
            }
            rest -= length;
        }
        found
    }
}

/// Points of the unit square, spread evenly however many are taken: the first two dimensions of Sobol's
/// sequence, shifted by digits that differ from fragment to fragment.
pub(super) struct Pattern([u32; 2]);

impl Pattern {
    /// The pattern of a fragment.
    pub(super) fn of(fragments: &Fragments<'_>, i: usize) -> Pattern {
        match &fragments.sight {
            None => Pattern::new(fragments.x[i], fragments.y[i]),
            Some(_) => {
                // What rays met has the screen place of what they came from: many would share a
                // pattern.
                let [x, y, z] = fragments.position[i].to_array().map(f64::to_bits);
                Pattern::from_seed(x ^ y.rotate_left(21) ^ z.rotate_left(42))
            }
        }
    }

    fn new(x: f64, y: f64) -> Pattern {
        Pattern::from_seed(x.to_bits() ^ y.to_bits().rotate_left(32))
    }

    pub(super) fn from_seed(seed: u64) -> Pattern {
        let mut state = seed;
        let mut next = || {
            // SplitMix64 (Steele, Lea and Flood 2014).
            state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let z = (state ^ (state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            (z ^ (z >> 31)) as u32
        };
        Pattern([next(), next()])
    }

    /// A number in [0, 1) that no point of the pattern tells anything of.
    pub(super) fn chance(&self) -> f32 {
        let [a, b] = self.0;
        let Pattern([chance, _]) = Pattern::from_seed(u64::from(a) << 32 | u64::from(b));
        (chance >> 8) as f32 / (1u32 << 24) as f32
    }

    pub(super) fn at(&self, k: u32) -> DVec2 {
        let mut second = 0u32;
        let (mut bits, mut direction) = (k, 1u32 << 31);
        while bits != 0 {
            if bits & 1 == 1 {
                second ^= direction;
            }
            bits >>= 1;
            // The next direction number of Sobol's second dimension.
            direction ^= direction >> 1;
        }
        let unit = |bits: u32| f64::from(bits) / 4_294_967_296.0;
        DVec2::new(unit(k.reverse_bits() ^ self.0[0]), unit(second ^ self.0[1]))
    }
}

/// Points of the unit square, spread evenly however many are taken, and in another order than the points of a [`Pattern`]
/// (R2: Roberts 2018).
pub(super) fn spread_over_a_square(seed: u64, k: u32) -> DVec2 {
    let first = Pattern::from_seed(seed.rotate_left(32)).at(0);
    let step = DVec2::new(0.754_877_666_246_693, 0.569_840_290_998_053);
    (first + step * f64::from(k)).fract()
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
