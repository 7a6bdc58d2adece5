//! The tree over the pieces of a scene. It only finds candidates: its boxes, in 32 bits, are larger than any rounding
//! on the way to them.

use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};
use std::time::Duration;

use super::ray::part_in;
use super::{Casters, Hit, Piece, Ray, Shaft};

/// By how much boxes are enlarged, in units of half the extent of all pieces: more than the rounding of
/// a ray that was cut at the outermost box.
const MARGIN: f64 = 4e-6;

/// A tree over pieces, in coordinates from -1 to 1.
pub(super) struct PieceTree {
    bvh: Bvh2,
    centre: DVec3,
    /// From metres to the tree's units.
    scale: f64,
    low: DVec3,
    high: DVec3,
}

impl std::fmt::Debug for PieceTree {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "tree of {} nodes", self.bvh.nodes.len())
    }
}

struct Bounds(Aabb);

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl PieceTree {
    pub(super) fn new(casters: &mut Casters) -> Option<PieceTree> {
        if casters.pieces.is_empty() {
            return None;
        }
        let used = || casters.corners.iter().map(|corner| casters.points[*corner as usize]);
        let low = used().fold(DVec3::INFINITY, DVec3::min);
        let high = used().fold(DVec3::NEG_INFINITY, DVec3::max);
        // Halves first: the sum of two numbers near the largest is not finite.
        let (centre, half) = (low / 2.0 + high / 2.0, high / 2.0 - low / 2.0);
        let extent = half.max_element().max(1e-30);
        let scale = 1.0 / extent;
        let place = |p: DVec3| ((p - centre) * scale).clamp(DVec3::splat(-2.0), DVec3::splat(2.0));
        let bounds = |piece: &Piece| {
            let points = || casters.of(piece).map(place);
            let low = points().fold(DVec3::INFINITY, DVec3::min) - MARGIN;
            let high = points().fold(DVec3::NEG_INFINITY, DVec3::max) + MARGIN;
            let single = |v: DVec3| Vec3A::new(v.x as f32, v.y as f32, v.z as f32);
            Bounds(Aabb::new(single(low), single(high)))
        };
        let boxes: Vec<Bounds> = casters.pieces.iter().map(bounds).collect();
        let bvh = build_bvh2(&boxes, BvhBuildParams::fast_build(), &mut Duration::default());
        // In the order of the leaves, so that neighbours lie side by side.
        let order = &bvh.primitive_indices;
        casters.pieces = order.iter().map(|index| casters.pieces[*index as usize]).collect();
        let margin = DVec3::splat(MARGIN * extent);
        Some(PieceTree { bvh, centre, scale, low: low - margin, high: high + margin })
    }
}

impl PieceTree {
    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.bvh.nodes)
    }
}

impl Casters {
    /// Boxes around all pieces, by their least and greatest corners: a few dozens at most, near ones together.
    pub(crate) fn boxes(&self) -> Vec<[DVec3; 2]> {
        const LEVELS: u32 = 6;
        let Some(tree) = &self.tree else { return Vec::new() };
        let wide = |v: Vec3A| DVec3::from(v.to_array().map(f64::from)) / tree.scale + tree.centre;
        let mut open = vec![(0u32, 0)];
        let mut boxes = Vec::new();
        while let Some((at, level)) = open.pop() {
            let node = &tree.bvh.nodes[at as usize];
            if node.prim_count > 0 || level == LEVELS {
                // As wide again as the margin: this goes back from 32 bits.
                let margin = DVec3::splat(MARGIN / tree.scale);
                boxes.push([wide(node.aabb().min) - margin, wide(node.aabb().max) + margin]);
            } else {
                open.extend([0, 1].map(|child| (node.first_index + child, level + 1)));
            }
        }
        boxes
    }

    /// Visits the pieces that a ray meets; `visit` may say beyond which way nothing matters any more.
    pub(super) fn traverse(&self, ray: &Ray, mut visit: impl FnMut(Hit) -> Option<f64>) {
        let Some(tree) = &self.tree else { return };
        let Some(part) =
            part_in((ray.origin, ray.direction), [tree.low, tree.high], 0.0..ray.reach)
        else {
            return;
        };
        // From where the ray enters the outermost box: a start far outside would leave 32 bits no
        // digits for the rest.
        let origin = (ray.origin - tree.centre + ray.direction * part.start) * tree.scale;
        let along = ray.direction * tree.scale;
        let length = along.length();
        if !(length > 0.0 && origin.is_finite()) {
            return;
        }
        let single = |v: DVec3| Vec3A::new(v.x as f32, v.y as f32, v.z as f32);
        let until = |t: f64| (((t - part.start) * length) as f32).max(0.0) * 1.000_001 + 1e-5;
        // The box is 2 wide, so that no way through it is longer than this.
        let reach = until(part.end).min(8.0);
        let candidate = obvhs::ray::Ray::new(single(origin), single(along / length), 0.0, reach);
        let mut nearest = obvhs::ray::RayHit::none();
        tree.bvh.ray_traverse(candidate, &mut nearest, |_, piece| {
            let end = self.meet(piece, ray).and_then(&mut visit);
            end.map_or(f32::INFINITY, |t| if t > 0.0 { until(t) } else { 0.0 })
        });
    }

    /// Visits all pieces whose boxes may reach into a shaft.
    pub fn within(&self, shaft: &Shaft, mut visit: impl FnMut(usize)) {
        let Some(tree) = &self.tree else { return };
        // The planes over the tree's coordinates, with unit normals; single precision is enough, as boxes
        // are larger than its rounding.
        let single = |v: DVec3| Vec3A::new(v.x as f32, v.y as f32, v.z as f32);
        let planes: Vec<(Vec3A, Vec3A, f32)> = shaft
            .planes
            .iter()
            .filter_map(|(normal, offset)| {
                let length = normal.length();
                let offset = (normal.dot(tree.centre) + offset) * tree.scale / length;
                let normal = single(*normal / length);
                let plane = (normal, normal.abs(), offset as f32 + 1e-6);
                (plane.0.is_finite() && plane.2.is_finite()).then_some(plane)
            })
            .collect();
        let reaches = |aabb: &Aabb| {
            let (middle, half) = ((aabb.min + aabb.max) * 0.5, (aabb.max - aabb.min) * 0.5);
            planes
                .iter()
                .all(|(normal, size, offset)| normal.dot(middle) + size.dot(half) + offset >= 0.0)
        };
        let mut stack = vec![0u32];
        while let Some(at) = stack.pop() {
            let node = &tree.bvh.nodes[at as usize];
            if !reaches(node.aabb()) {
                continue;
            }
            if node.prim_count > 0 {
                (node.first_index..node.first_index + node.prim_count)
                    .for_each(|piece| visit(piece as usize));
            } else {
                stack.extend([node.first_index + 1, node.first_index]);
            }
        }
    }
}
