//! Generation of a tree (\[D], "BSP tree": steps 1 to 3).

use glam::DVec3;
use std::sync::Arc;

use super::{BspTree, NONE, Node};
use crate::error::Result;
use crate::polygon::split;
use crate::scene::{Scene, surfaces::normal_matrix};
use crate::watch::Watch;

/// Which faces become roots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Roots {
    /// Of a few, the one whose plane cuts fewest pieces and leaves the sides most even.
    #[default]
    Best,
    /// Any, by a seed: the paper's "arbitrary polygon". For a convex body of n faces it takes n^2.
    Any(u64),
}

/// Faces that are looked at for a root.
const CANDIDATES: usize = 8;
/// More pieces than these are divided by a plane across an axis near their middle, and not by that of a face: a body that
/// is convex has all of its faces behind each of them, and a tree of such planes would be a chain.
const CROWD: usize = 48;
/// Pieces that may come to be for each face.
const MOST_PIECES: usize = 8;

/// A convex piece of a face.
#[derive(Clone, Debug)]
struct Piece {
    /// The face, among the tree's.
    face: u32,
    /// The plane it lies in, among all: pieces of one lie in it whatever rounding says.
    support: u32,
    points: Vec<DVec3>,
}

/// A plane by its unit normal and its distance from the centre.
#[derive(Clone, Copy, Debug)]
struct Support {
    normal: DVec3,
    distance: f64,
}

/// Where a piece lies.
enum Side {
    On,
    Front,
    Back,
    Both,
}

struct Generator {
    supports: Vec<Support>,
    /// What is nearer to a plane lies on it: coordinates have that much of rounding.
    tolerance: f64,
    random: u64,
    roots: Roots,
    /// Pieces that may still be cut.
    cuts: usize,
}

pub(super) fn tree(scene: Arc<Scene>, roots: Roots) -> Result<BspTree> {
    let watch = Watch::current();
    let mut faces = Vec::new();
    let (mut pieces, mut supports): (Vec<Piece>, Vec<Support>) = (Vec::new(), Vec::new());
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for instance in &scene.instances {
        watch.check()?;
        let (geometry, world) = (&*instance.geometry, &instance.world_from_object);
        let (mesh, base) = (geometry.mesh(), supports.len() as u32);
        let turned = normal_matrix(&world.matrix3);
        supports.extend(geometry.supports().iter().map(|support| {
            let normal = (turned * support.normal).normalize_or_zero();
            Support { normal, distance: normal.dot(world.transform_point3(support.point)) }
        }));
        for at in 0..mesh.face_count() {
            let (face, (support, _)) = (faces.len() as u32, geometry.support_of(at));
            faces.push(instance.first_ordinal + geometry.first_part(at));
            geometry.pieces(at, |corners| {
                let corners = corners.iter().map(|corner| mesh.points[*corner as usize]);
                let points: Vec<DVec3> = corners.map(|p| world.transform_point3(p)).collect();
                // What has no area or lies nowhere divides nothing: a traversal lists it last.
                let is_flat = supports[base as usize + support].normal == DVec3::ZERO;
                if !is_flat && points.iter().all(|point| point.is_finite()) {
                    low = points.iter().fold(low, |low, point| low.min(*point));
                    high = points.iter().fold(high, |high, point| high.max(*point));
                    pieces.push(Piece { face, support: base + support as u32, points });
                }
            });
        }
    }
    // Halves first: the sum of two numbers near the largest is not finite.
    let centre = if pieces.is_empty() { DVec3::ZERO } else { low / 2.0 + high / 2.0 };
    pieces.iter_mut().flat_map(|piece| &mut piece.points).for_each(|point| *point -= centre);
    supports.iter_mut().for_each(|support| support.distance -= support.normal.dot(centre));
    let reach = if pieces.is_empty() { 0.0 } else { (high / 2.0 - low / 2.0).length() };
    let random = match roots {
        Roots::Best => 1,
        Roots::Any(seed) => seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1,
    };
    let cuts = MOST_PIECES * pieces.len() + 1024;
    let generator = Generator { supports, tolerance: 1e-10 * reach, random, roots, cuts };
    let tree = BspTree {
        scene,
        faces,
        nodes: Vec::new(),
        listed: Vec::new(),
        centre,
        splits: 0,
        depth: 0,
    };
    generator.divide(tree, pieces, &watch)
}

impl Generator {
    fn divide(mut self, mut tree: BspTree, pieces: Vec<Piece>, watch: &Watch) -> Result<BspTree> {
        // The node and the side that waits for its child, the pieces, and how deep they are.
        let mut waiting = vec![(NONE, 0, pieces, 1)];
        while let Some((parent, side, pieces, depth)) = waiting.pop() {
            if pieces.is_empty() {
                continue;
            }
            watch.check()?;
            let at = tree.nodes.len() as u32;
            if let Some(parent) = tree.nodes.get_mut(parent as usize) {
                parent.children[side] = at;
            }
            tree.depth = tree.depth.max(depth);
            let (plane, own) = match self.cuts {
                0 => (None, NONE),
                _ => self.plane(&pieces),
            };
            // Enough was cut: the rest keeps no order.
            let Some(plane) = plane else {
                tree.listed.extend(pieces.iter().map(|piece| piece.face));
                tree.push(DVec3::ZERO, 0.0);
                continue;
            };
            let (mut front, mut back) = (Vec::new(), Vec::new());
            for piece in pieces {
                match self.side(&piece, plane, own) {
                    Side::On => {
                        if tree.listed.last() != Some(&piece.face) {
                            tree.listed.push(piece.face);
                        }
                    }
                    Side::Front => front.push(piece),
                    Side::Back => back.push(piece),
                    Side::Both => {
                        let (before, behind) = piece.cut(plane);
                        tree.splits += 1;
                        self.cuts = self.cuts.saturating_sub(1);
                        front.push(before);
                        back.push(behind);
                    }
                }
            }
            tree.push(plane.normal, plane.distance);
            waiting.push((at, 1, back, depth + 1));
            waiting.push((at, 0, front, depth + 1));
        }
        Ok(tree)
    }

    /// The plane that divides some pieces, and its number if faces lie in it; none if nothing can be divided.
    fn plane(&mut self, pieces: &[Piece]) -> (Option<Support>, u32) {
        if let Roots::Any(_) = self.roots {
            let own = pieces[self.any(pieces.len())].support;
            return (Some(self.supports[own as usize]), own);
        }
        if pieces.len() > CROWD {
            let across = self.across(pieces);
            let best = self.best(pieces, across.into_iter().map(|plane| (plane, NONE)));
            // One that cuts much, or leaves nearly all on one side, does not help.
            if let Some((plane, cuts, larger)) = best
                && cuts * 4 < pieces.len()
                && larger * 5 < pieces.len() * 4
            {
                return (Some(plane.0), NONE);
            }
        }
        let mut candidate = |_| {
            let own = pieces[self.any(pieces.len())].support;
            (self.supports[own as usize], own)
        };
        let candidates: Vec<(Support, u32)> =
            (0..CANDIDATES.min(pieces.len())).map(&mut candidate).collect();
        let best = self.best(pieces, candidates.into_iter());
        best.map_or((None, NONE), |((plane, own), ..)| (Some(plane), own))
    }

    /// Of some planes the one that cuts fewest pieces and leaves its sides most even, how many it cuts, and how many are
    /// on its larger side.
    fn best(
        &self,
        pieces: &[Piece],
        planes: impl Iterator<Item = (Support, u32)>,
    ) -> Option<((Support, u32), usize, usize)> {
        let judged = planes.map(|(plane, own)| {
            let (mut cuts, mut sides) = (0, [0usize; 2]);
            for piece in pieces {
                match self.side(piece, plane, own) {
                    Side::On => {}
                    Side::Front => sides[0] += 1,
                    Side::Back => sides[1] += 1,
                    Side::Both => cuts += 1,
                }
            }
            let badness = 6 * cuts + sides[0].abs_diff(sides[1]);
            (badness, ((plane, own), cuts, sides[0].max(sides[1]) + cuts))
        });
        judged.min_by_key(|(badness, _)| *badness).map(|(_, best)| best)
    }

    /// Planes across the axes, through corners near the middle: where corners are, fewer faces are cut.
    fn across(&self, pieces: &[Piece]) -> Vec<Support> {
        let planes = |normal: DVec3| {
            let mut along: Vec<f64> =
                pieces.iter().map(|piece| piece.points[0].dot(normal)).collect();
            let count = along.len();
            let mut at = |share: usize| {
                let (_, place, _) =
                    along.select_nth_unstable_by(count * share / 16, f64::total_cmp);
                Support { normal, distance: *place }
            };
            [6, 7, 8, 9, 10].map(&mut at)
        };
        DVec3::AXES.into_iter().flat_map(planes).collect()
    }

    fn side(&self, piece: &Piece, plane: Support, own: u32) -> Side {
        if piece.support == own {
            return Side::On;
        }
        let (mut is_front, mut is_back) = (false, false);
        for point in &piece.points {
            let distance = plane.normal.dot(*point) - plane.distance;
            is_front |= distance > self.tolerance;
            is_back |= distance < -self.tolerance;
        }
        match (is_front, is_back) {
            (false, false) => Side::On,
            (true, false) => Side::Front,
            (false, true) => Side::Back,
            (true, true) => Side::Both,
        }
    }

    /// Any number below another.
    fn any(&mut self, below: usize) -> usize {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        (self.random % below.max(1) as u64) as usize
    }
}

impl BspTree {
    fn push(&mut self, normal: DVec3, distance: f64) {
        let (end, children) = (self.listed.len() as u32, [NONE; 2]);
        self.nodes.push(Node { normal, distance, end, children });
    }
}

impl Piece {
    /// Its parts before and behind a plane.
    fn cut(self, plane: Support) -> (Piece, Piece) {
        let Piece { face, support, points } = self;
        let part = |points| Piece { face, support, points };
        let sides: Vec<f64> =
            points.iter().map(|point| plane.normal.dot(*point) - plane.distance).collect();
        let (front, back) = split(&points, &sides);
        (part(front), part(back))
    }
}
