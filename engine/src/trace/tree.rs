//! The tree over the pieces of a scene. It only finds candidates: its boxes, in 32 bits, are larger than any rounding
//! on the way to them.
//!
//! A node holds the boxes of four children side by side, so that a ray is tested against all of them at once. Each piece
//! has a box of its own: what is computed in 64 bits is far dearer than a box.

use glam::{DVec3, Vec3A, Vec4};
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

/// How many children a node has at most.
const WIDTH: usize = 4;

/// Which nodes wait, of trees that are not deeper than any but contrived ones.
const WAITING: usize = 96;

/// Along a direction's axis, what is nearer to 0 than this counts as this: over the way through the tree, less than
/// the margin.
const LEAST_SLOPE: f32 = f32::EPSILON;

/// A tree over pieces, in coordinates from -1 to 1.
pub(super) struct PieceTree {
    nodes: Vec<Node>,
    /// How many nodes wait at most while others are looked at.
    waiting: usize,
    centre: DVec3,
    /// From metres to the tree's units.
    scale: f64,
    low: DVec3,
    high: DVec3,
}

/// Boxes of four children, and where these are.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// The least x, y and z of the children, then the greatest. Where there is no child, what nothing meets.
    sides: [Vec4; 6],
    children: [Child; WIDTH],
}

/// The place of a node, or of a piece: told apart by the highest bit.
#[derive(Clone, Copy, Debug, Default)]
struct Child(u32);

impl Child {
    const PIECE: u32 = 1 << 31;

    fn piece(self) -> Option<usize> {
        (self.0 & Child::PIECE != 0).then_some((self.0 & !Child::PIECE) as usize)
    }
}

impl Default for Node {
    fn default() -> Node {
        let [low, high] = [Vec4::INFINITY, Vec4::NEG_INFINITY];
        Node { sides: [low, low, low, high, high, high], children: Default::default() }
    }
}

impl Node {
    fn set(&mut self, lane: usize, aabb: &Aabb, child: Child) {
        for axis in 0..3 {
            self.sides[axis][lane] = aabb.min[axis];
            self.sides[axis + 3][lane] = aabb.max[axis];
        }
        self.children[lane] = child;
    }

    /// The children there are: the least and greatest corner, and where it is.
    fn children(&self) -> impl Iterator<Item = (Vec3A, Vec3A, Child)> + '_ {
        let corner = |lane: usize, first: usize| {
            Vec3A::from([0, 1, 2].map(|axis| self.sides[first + axis][lane]))
        };
        let is_there = |lane: &usize| self.sides[0][*lane] <= self.sides[3][*lane];
        (0..WIDTH)
            .filter(is_there)
            .map(move |lane| (corner(lane, 0), corner(lane, 3), self.children[lane]))
    }
}

impl std::fmt::Debug for PieceTree {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "tree of {} nodes", self.nodes.len())
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
        let low = casters.corners.iter().fold(DVec3::INFINITY, |low, p| low.min(*p));
        let high = casters.corners.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
        // Halves first: the sum of two numbers near the largest is not finite.
        let (centre, half) = (low / 2.0 + high / 2.0, high / 2.0 - low / 2.0);
        let extent = half.max_element().max(1e-30);
        let scale = 1.0 / extent;
        let place = |p: DVec3| ((p - centre) * scale).clamp(DVec3::splat(-2.0), DVec3::splat(2.0));
        let bounds = |piece: &Piece| {
            let points = || casters.of(piece).iter().map(|p| place(*p));
            let low = points().fold(DVec3::INFINITY, DVec3::min) - MARGIN;
            let high = points().fold(DVec3::NEG_INFINITY, DVec3::max) + MARGIN;
            let single = |v: DVec3| Vec3A::new(v.x as f32, v.y as f32, v.z as f32);
            Bounds(Aabb::new(single(low), single(high)))
        };
        let boxes: Vec<Bounds> = casters.pieces.iter().map(bounds).collect();
        // Leaves of one piece each.
        let params = BvhBuildParams { max_prims_per_leaf: 1, ..BvhBuildParams::medium_build() };
        let bvh = build_bvh2(&boxes, params, &mut Duration::default());
        let mut widened = Widened::default();
        let depth = widened.add(&bvh);
        let order = widened.order.iter();
        casters.pieces = order.map(|index| casters.pieces[*index as usize]).collect();
        let margin = DVec3::splat(MARGIN * extent);
        let (low, high) = (low - margin, high + margin);
        let (nodes, waiting) = (widened.nodes, depth * (WIDTH - 1) + 1);
        Some(PieceTree { nodes, waiting, centre, scale, low, high })
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.nodes)
    }
}

/// A tree of two children a node on its way to one of four.
#[derive(Default)]
struct Widened {
    nodes: Vec<Node>,
    /// Pieces by their numbers before, in the order of the leaves.
    order: Vec<u32>,
}

impl Widened {
    /// Adds all nodes; returns how deep they stand.
    fn add(&mut self, bvh: &Bvh2) -> usize {
        let mut deepest = 1;
        // What is to be widened: the place in the other tree, where it goes, and its depth.
        let mut open = vec![(0u32, 0usize, 1usize)];
        self.nodes.push(Node::default());
        while let Some((from, to, depth)) = open.pop() {
            deepest = deepest.max(depth);
            let mut parts = [from; WIDTH];
            let mut count = 1;
            while count < WIDTH {
                // The greatest is met by most rays.
                let area = |part: &usize| bvh.nodes[parts[*part] as usize].aabb().half_area();
                let inner = (0..count).filter(|p| bvh.nodes[parts[*p] as usize].prim_count == 0);
                let Some(part) = inner.max_by(|a, b| area(a).total_cmp(&area(b))) else { break };
                let first = bvh.nodes[parts[part] as usize].first_index;
                parts[part] = first;
                parts[count] = first + 1;
                count += 1;
            }
            for (lane, part) in parts[..count].iter().enumerate() {
                let node = &bvh.nodes[*part as usize];
                let child = match node.prim_count {
                    0 => {
                        let place = self.nodes.len();
                        self.nodes.push(Node::default());
                        open.push((*part, place, depth + 1));
                        Child(place as u32)
                    }
                    _ => {
                        debug_assert_eq!(node.prim_count, 1, "leaves of one piece");
                        let place = self.order.len() as u32;
                        self.order.push(bvh.primitive_indices[node.first_index as usize]);
                        Child(place | Child::PIECE)
                    }
                };
                self.nodes[to].set(lane, node.aabb(), child);
            }
        }
        deepest
    }
}

impl Casters {
    /// Boxes around all pieces, by their least and greatest corners: a few dozens at most, near ones together.
    pub(crate) fn boxes(&self) -> Vec<[DVec3; 2]> {
        const LEVELS: u32 = 3;
        let Some(tree) = &self.tree else { return Vec::new() };
        let wide = |v: Vec3A| DVec3::from(v.to_array().map(f64::from)) / tree.scale + tree.centre;
        // As wide again as the margin: this goes back from 32 bits.
        let margin = DVec3::splat(MARGIN / tree.scale);
        let mut open = vec![(0u32, 1)];
        let mut boxes = Vec::new();
        while let Some((at, level)) = open.pop() {
            for (low, high, child) in tree.nodes[at as usize].children() {
                if child.piece().is_some() || level == LEVELS {
                    boxes.push([wide(low) - margin, wide(high) + margin]);
                } else {
                    open.push((child.0, level + 1));
                }
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
        let until = |t: f64| (((t - part.start) * length) as f32).max(0.0) * 1.000_001 + 1e-5;
        // The box is 2 wide, so that no way through it is longer than this.
        let mut reach = until(part.end).min(8.0);
        let along = (along / length).to_array().map(|slope| {
            let slope = slope as f32;
            if slope.abs() > LEAST_SLOPE { slope } else { LEAST_SLOPE.copysign(slope) }
        });
        // Where a direction falls, what is greatest is met first.
        let near = [0, 1, 2].map(|axis| if along[axis] < 0.0 { axis + 3 } else { axis });
        let far = [0, 1, 2].map(|axis| if along[axis] < 0.0 { axis } else { axis + 3 });
        let inverse = along.map(|slope| Vec4::splat(1.0 / slope));
        let origin = origin.to_array().map(|v| Vec4::splat(v as f32));

        let mut few = [(0.0f32, Child(0)); WAITING];
        let mut many = Vec::new();
        let waiting = match tree.waiting <= WAITING {
            true => &mut few[..],
            false => {
                many.resize(tree.waiting, few[0]);
                &mut many[..]
            }
        };
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (enters, child) = waiting[count];
            if enters > reach {
                continue;
            }
            if let Some(piece) = child.piece() {
                if let Some(end) = self.meet(piece, ray).and_then(&mut visit) {
                    if end <= 0.0 {
                        return;
                    }
                    reach = reach.min(until(end));
                }
                continue;
            }
            let node = &tree.nodes[child.0 as usize];
            let ways = |sides: [usize; 3]| {
                [0, 1, 2].map(|axis| (node.sides[sides[axis]] - origin[axis]) * inverse[axis])
            };
            let ([x, y, z], [u, v, w]) = (ways(near), ways(far));
            let enter = x.max(y).max(z.max(Vec4::ZERO));
            let leave = u.min(v).min(w.min(Vec4::splat(reach)));
            let mut met = enter.cmple(leave).bitmask();
            let enter = enter.to_array();
            let first = count;
            while met != 0 {
                let lane = met.trailing_zeros() as usize & (WIDTH - 1);
                met &= met - 1;
                // The nearest last, so that it is the next.
                let mut place = count;
                while place > first && waiting[place - 1].0 < enter[lane] {
                    waiting[place] = waiting[place - 1];
                    place -= 1;
                }
                waiting[place] = (enter[lane], node.children[lane]);
                count += 1;
            }
        }
    }

    /// Visits all pieces whose boxes may reach into a shaft.
    pub fn within(&self, shaft: &Shaft, mut visit: impl FnMut(usize)) {
        self.any_within(shaft, |piece| {
            visit(piece);
            false
        });
    }

    /// Whether something holds for any piece whose box may reach into a shaft; they are asked until it does for one.
    pub fn any_within(&self, shaft: &Shaft, mut holds: impl FnMut(usize) -> bool) -> bool {
        let Some(tree) = &self.tree else { return false };
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
        let reaches = |low: Vec3A, high: Vec3A| {
            let (middle, half) = ((low + high) * 0.5, (high - low) * 0.5);
            planes
                .iter()
                .all(|(normal, size, offset)| normal.dot(middle) + size.dot(half) + offset >= 0.0)
        };
        let mut open = vec![0u32];
        while let Some(at) = open.pop() {
            for (low, high, child) in tree.nodes[at as usize].children() {
                match child.piece() {
                    _ if !reaches(low, high) => {}
                    Some(piece) if holds(piece) => return true,
                    Some(_) => {}
                    None => open.push(child.0),
                }
            }
        }
        false
    }
}
