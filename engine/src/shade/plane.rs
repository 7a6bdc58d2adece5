//! Planes of surfaces, and what stands on them.

use glam::{DVec2, DVec3};

use crate::fragment::World;
use crate::math;
use crate::polygon::split;
use crate::trace::{Casters, Ray, Shaft, Toward};

/// The widest squares, as a part of the world.
const COARSEST: f64 = 0.25;

/// How far above its plane light is gathered, as a part of the world.
const ABOVE: f64 = 2e-6;

/// How far the corners of squares are moved, as a part of the world: walls stand in its middle and at its ends.
const ASIDE: [f64; 2] = [0.017_321, 0.026_458];

/// How much further than to a point somebody must be able to see: what stands just there has another light on its other
/// side.
const BEYOND: f64 = 1.01;

/// A plane by its normal and its distance, in steps that are too small to be seen.
pub(super) type PlaneKey = ([i32; 3], i64);

/// The plane of a surface in a world, divided into squares.
pub(super) struct SurfacePlane {
    pub(super) key: PlaneKey,
    pub(super) normal: DVec3,
    axes: [DVec3; 2],
    /// A point of it, a little above.
    origin: DVec3,
    /// The widest squares.
    pub(super) widest: f64,
}

/// The middle of all that casts in a world, and its greatest length; `None` if there is nothing.
pub(super) fn extent(world: &World) -> Option<(DVec3, f64)> {
    let all = world.casters().filter_map(|(_, casters)| casters.bounds());
    let [low, high] = all.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])?;
    let extent = (high - low).max_element();
    (extent > 0.0).then(|| ((low + high) / 2.0, extent))
}

/// Where a face is, and how wide.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FaceExtent {
    pub(super) middle: DVec3,
    /// The root of its area.
    pub(super) width: f64,
}

/// Where the faces of a scene are, by number. What lies on a face is nowhere by itself.
pub(super) fn face_extents(casters: &Casters) -> Vec<FaceExtent> {
    // By area until all pieces are there.
    let mut faces: Vec<FaceExtent> = Vec::new();
    for (at, piece) in casters.pieces().iter().enumerate() {
        let face = piece.face as usize;
        if faces.len() <= face {
            faces.resize(face + 1, FaceExtent::default());
        }
        let corners = casters.corners(at, Toward::Direction(DVec3::Y));
        let middle = corners.clone().sum::<DVec3>() / corners.len() as f64;
        let area = casters.normal(at, Toward::Direction(DVec3::Y)).length() / 2.0;
        faces[face].middle += middle * area;
        faces[face].width += area;
    }
    let whole = |FaceExtent { middle, width: area }| match area > 0.0 {
        true => FaceExtent { middle: middle / area, width: area.sqrt() },
        false => FaceExtent::default(),
    };
    faces.into_iter().map(whole).collect()
}

impl SurfacePlane {
    /// The plane through a point, by its unit normal, in a world of an [`extent`].
    pub(super) fn new(point: DVec3, normal: DVec3, (centre, extent): (DVec3, f64)) -> SurfacePlane {
        let steps = (normal * 1e6).round();
        let normal = (steps / 1e6).normalize_or_zero();
        let step = extent * ABOVE;
        let distance = (normal.dot(point - centre) / step).round();
        let axes = normal.any_orthonormal_pair();
        // Above the plane, however its distance was rounded; and not where things begin and end.
        let aside = axes.0 * (ASIDE[0] * extent) + axes.1 * (ASIDE[1] * extent);
        let origin = centre + aside + normal * ((distance + 1.0) * step);
        let key = (steps.as_ivec3().to_array(), distance as i64);
        let axes = [axes.0, axes.1];
        SurfacePlane { key, normal, axes, origin, widest: extent * COARSEST }
    }

    /// The width of squares of a level.
    pub(super) fn width(&self, level: u32) -> f64 {
        self.widest / (1u64 << level) as f64
    }

    /// The level of the widest squares that are no wider than a width.
    pub(super) fn level(&self, width: f64) -> u32 {
        math::log2((self.widest / width).clamp(1.0, 1e9)).ceil() as u32
    }

    /// The place of a point along both axes.
    pub(super) fn place(&self, point: DVec3) -> DVec2 {
        let from = point - self.origin;
        DVec2::new(self.axes[0].dot(from), self.axes[1].dot(from))
    }

    /// The point at a place.
    pub(super) fn point(&self, at: DVec2) -> DVec3 {
        self.origin + self.along(at)
    }

    /// The way between two places.
    pub(super) fn along(&self, way: DVec2) -> DVec3 {
        self.axes[0] * way.x + self.axes[1] * way.y
    }

    /// Whether something opaque stands above a point, nearer than squares are wide.
    pub(super) fn is_covered(
        &self,
        point: DVec3,
        width: f64,
        casters: &[(usize, &Casters)],
    ) -> bool {
        !is_open(casters, point, point + self.normal * width)
    }

    /// Whether an opaque piece reaches into a box that stands on it: by the middle of its square, half of that's width,
    /// and its height.
    pub(super) fn is_reached(
        &self,
        (middle, half, above): (DVec2, f64, f64),
        casters: &Casters,
    ) -> bool {
        let SurfacePlane { normal, axes, .. } = *self;
        let middle = self.point(middle);
        let side = |way: DVec3, least: f64| (way, -way.dot(middle) - least);
        let planes = vec![
            side(axes[0], -half),
            side(-axes[0], -half),
            side(axes[1], -half),
            side(-axes[1], -half),
            side(normal, 0.0),
            side(-normal, -above),
        ];
        let shaft = Shaft { planes };
        casters.any_within(&shaft, |piece| {
            if casters.pieces()[piece].opacity != 1.0 || casters.card(piece).is_some() {
                return false;
            }
            let mut points: Vec<DVec3> =
                casters.corners(piece, Toward::Direction(normal)).collect();
            for (way, offset) in &shaft.planes {
                let sides: Vec<f64> = points.iter().map(|point| way.dot(*point) + offset).collect();
                if sides.iter().all(|side| *side <= 0.0) {
                    return false;
                }
                if sides.iter().any(|side| *side < 0.0) {
                    points = split(&points, &sides).0;
                }
                if points.len() < 3 {
                    return false;
                }
            }
            true
        })
    }
}

/// Whether nothing opaque stands between two points.
pub(super) fn is_open(casters: &[(usize, &Casters)], from: DVec3, to: DVec3) -> bool {
    let ray = Ray::new(from, to - from, BEYOND);
    casters.iter().all(|(_, casters)| {
        let mut is_open = true;
        casters.meet_all(&ray, |hit| {
            is_open = casters.pieces()[hit.piece].opacity != 1.0;
            is_open
        });
        is_open
    })
}
