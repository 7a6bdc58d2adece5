//! Tables over normals.

use glam::{DVec2, DVec3};

/// The side of a table; odd, so that it has the axes' own.
const SIDE: usize = 65;

/// Values by normal, interpolated: over the square of octahedral coordinates.
#[derive(Clone, Debug)]
pub(super) struct ByNormal<T>(Vec<T>);

impl<const N: usize> ByNormal<[f32; N]> {
    /// The table of a function of normals, unit vectors.
    pub(super) fn new(of: impl Fn(DVec3) -> [f32; N]) -> ByNormal<[f32; N]> {
        let at = |i: usize| i as f64 / (SIDE - 1) as f64 * 2.0 - 1.0;
        let normal = |i: usize| unfold(DVec2::new(at(i % SIDE), at(i / SIDE)));
        ByNormal((0..SIDE * SIDE).map(|i| of(normal(i))).collect())
    }

    /// The value at a normal.
    pub(super) fn at(&self, normal: DVec3) -> [f32; N] {
        let p = (fold(normal) + 1.0) / 2.0 * (SIDE - 1) as f64;
        // The last row belongs to the cell before it.
        let (x, y) = ((p.x as usize).min(SIDE - 2), (p.y as usize).min(SIDE - 2));
        let (u, v) = (p.x - x as f64, p.y - y as f64);
        std::array::from_fn(|i| {
            let at = |x: usize, y: usize| f64::from(self.0[y * SIDE + x][i]);
            let upper = at(x, y) * (1.0 - u) + at(x + 1, y) * u;
            (upper * (1.0 - v) + (at(x, y + 1) * (1.0 - u) + at(x + 1, y + 1) * u) * v) as f32
        })
    }
}

/// The unit vector at a place of the square of octahedral coordinates, in [-1, 1].
pub(super) fn unfold(p: DVec2) -> DVec3 {
    let y = 1.0 - p.x.abs() - p.y.abs();
    // The lower half is folded outwards over the diagonals.
    let fold = (-y).max(0.0);
    let away = |v: f64| if v >= 0.0 { v - fold } else { v + fold };
    DVec3::new(away(p.x), y, away(p.y)).normalize_or_zero()
}

/// The place of a unit vector in the square.
pub(super) fn fold(n: DVec3) -> DVec2 {
    let sum = n.x.abs() + n.y.abs() + n.z.abs();
    let p = DVec2::new(n.x, n.z) / sum;
    if n.y >= 0.0 {
        return p;
    }
    let over = DVec2::ONE - DVec2::new(p.y, p.x).abs();
    DVec2::new(over.x.copysign(p.x), over.y.copysign(p.y))
}
