//! A piece of a face in the way of light: whether it can be, and how much it holds back.

use glam::DVec3;

use crate::camera::View;
use crate::fragment::{Meeting, Surfaces};
use crate::trace::{Casters, Toward};

/// How far the corners of a piece may leave the plane of a face, as a share of its size, to lie in it and
/// cast no shadow on it.
const IN_PLANE: f64 = 1e-7;

/// A way of light to a receiver, as far as a piece that it meets.
pub(crate) struct Way {
    /// The receiver, in metres.
    pub(crate) from: DVec3,
    /// Towards the light.
    pub(crate) along: DVec3,
    /// Where it meets the piece.
    pub(crate) position: DVec3,
    /// The width of what the way stands for there, in metres.
    pub(crate) width: f32,
}

/// How much of the light on a way a piece holds back; where that differs from place to place, `met` says
/// the way.
#[inline]
pub(crate) fn opacity(
    surfaces: &dyn Surfaces,
    view: &View,
    casters: &Casters,
    piece: usize,
    met: impl FnOnce() -> Way,
) -> f32 {
    let known = &casters.pieces()[piece];
    if !known.opacity.is_nan() {
        return known.opacity;
    }
    let Way { from, along, position, width } = met();
    // A card shows its front to whoever looks.
    let sees_front = casters.card(piece).is_some()
        || casters.normal(piece, Toward::Direction(-along)).dot(along) < 0.0;
    let met = Meeting { ordinal: known.face, sees_front, from, position, width };
    surfaces.alpha_at(view, &met)
}

/// How far the planes of two faces may lean and be apart, as a share of how far a piece reaches, to be one.
const ONE_PLANE: f64 = 1e-6;

/// Whether a piece lies in the plane of a face: its corners do, as a share of how far they reach from the point that the
/// plane is given by (a corner may be that very point, but for rounding), or its own face is seen in that plane, as flat
/// as its file has it. A card does that turns about a line in it: it casts nothing on itself as it is seen.
pub(crate) fn lies_in(casters: &Casters, piece: usize, (normal, point): (DVec3, DVec3)) -> bool {
    if let Some(card) = casters.card(piece) {
        let from = card.middle() - point;
        return normal.dot(from).abs() <= IN_PLANE * (from.length() + card.height);
    }
    // No card turns.
    let corners = casters.corners(piece, Toward::Direction(DVec3::Y));
    let (off, reach) = corners.fold((0.0f64, 0.0f64), |(off, reach), corner| {
        let from = corner - point;
        (off.max(normal.dot(from).abs()), reach.max(from.length_squared()))
    });
    let reach = reach.sqrt();
    off <= IN_PLANE * reach
        || casters.plane(piece).is_some_and(|(own, through)| {
            own.cross(normal).length_squared() <= ONE_PLANE * ONE_PLANE
                && own.dot(point - through).abs() <= ONE_PLANE * reach
        })
}
