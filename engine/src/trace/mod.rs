//! What casts shadows and is met by rays: convex pieces of faces in the world, and a tree over them.
//!
//! A face enters whole if it is convex and without holes, else as triangles. Everything that decides is
//! computed in 64 bits on the faces' own points. Seen along the ray, points are rounded once, alike for
//! all faces that share them; on which side of an edge the ray passes is the sign of a difference of two
//! products, which rounding may make zero but never turns (Woop, Benthin and Wald 2013). So nothing leaks
//! between faces that share an edge. The tree only finds candidates: its boxes, in 32 bits, are larger
//! than any rounding on the way to them.

mod card;
mod grid;
mod ray;
mod reductions;
mod tree;

pub use card::{Card, Turn, Turned};
pub use grid::Voxels;
pub(crate) use ray::part_in;
pub use ray::{Ray, Toward};
pub use reductions::{CasterSearch, Reductions, Spaces, spaces_of};

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::sync::{Arc, Mutex, PoisonError};

use self::grid::Grid;
use self::tree::PieceTree;
use crate::polygon::area_vector;

/// A convex piece of a face.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// The face, by its number in the scene.
    pub face: u32,
    /// How much of the light that meets it is held back, in [0, 1]: 1 is opaque, 0 casts no shadow. NaN
    /// if that differs from place to place.
    pub opacity: f32,
    /// If it is of an opaque closed body, the body's number from 1 on, negative if its faces look inwards; else
    /// 0.
    pub body: i32,
    /// If it turns to the light, the number of its card.
    card: Option<u32>,
    /// If its corners leave the plane in which its face is seen, the number of that plane.
    plane: Option<u32>,
    first: u32,
    count: u32,
}

/// The pieces of all faces of a scene.
#[derive(Debug, Default)]
pub struct Casters {
    /// Corners of pieces, one piece after the other: what two share stands twice, as it is met once at a time.
    corners: Vec<DVec3>,
    pieces: Vec<Piece>,
    cards: Vec<Card>,
    /// The planes in which faces are seen that are not quite flat, by unit normals and points.
    planes: Vec<(DVec3, DVec3)>,
    /// The least and the greatest corner of each closed body.
    bodies: Vec<[DVec3; 2]>,
    tree: Option<PieceTree>,
    /// Grids that somebody asked for.
    grids: Mutex<Vec<(Voxels, Arc<Grid>)>>,
    /// Pieces by the six spaces around points.
    spaces: Mutex<Vec<(DVec3, Arc<Spaces>)>>,
}

/// How the pieces that a ray meets are found. What is found is the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum Accelerator {
    /// By a tree of boxes.
    #[default]
    Tree,
    /// By \[D]'s voxels.
    Grid(Voxels),
}

/// Where a ray meets a piece.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// The way from the origin, in lengths of the direction.
    pub t: f64,
    /// The piece's place among all.
    pub piece: usize,
}

/// The space in which something can stand between a patch of a face and a light: inside all planes.
#[derive(Clone, Debug, Default)]
pub struct Shaft {
    /// Planes as normal and offset: inside is where `normal . p + offset >= 0`.
    pub planes: Vec<(DVec3, f64)>,
}

/// Collects the pieces of a scene.
#[derive(Debug, Default)]
pub struct CastersBuilder {
    casters: Casters,
    points: Vec<DVec3>,
}

impl CastersBuilder {
    /// Adds points; returns the number of the first.
    pub fn points(&mut self, points: impl Iterator<Item = DVec3>) -> u32 {
        let base = self.points.len() as u32;
        self.points.extend(points);
        base
    }

    /// Adds a closed body in a box; returns its number.
    pub fn body(&mut self, low: DVec3, high: DVec3) -> i32 {
        self.casters.bodies.push([low, high]);
        self.casters.bodies.len() as i32
    }

    /// Adds the plane in which a face is seen that is not quite flat, by its unit normal and a point; returns its number.
    pub fn plane(&mut self, normal: DVec3, point: DVec3) -> u32 {
        self.casters.planes.push((normal, point));
        self.casters.planes.len() as u32 - 1
    }

    /// Adds a convex piece of a face by the numbers of its corners. Pieces that are not finite are left
    /// out.
    pub fn piece(
        &mut self,
        face: u32,
        opacity: f32,
        (body, plane): (i32, Option<u32>),
        corners: impl Iterator<Item = u32>,
    ) {
        let first = self.casters.corners.len();
        self.casters.corners.extend(corners.map(|corner| self.points[corner as usize]));
        let count = self.casters.corners.len() - first;
        if count < 3 || !self.casters.corners[first..].iter().all(|corner| corner.is_finite()) {
            self.casters.corners.truncate(first);
            return;
        }
        let (first, count) = (first as u32, count as u32);
        self.casters.pieces.push(Piece { face, opacity, body, card: None, plane, first, count });
    }

    /// Adds a face that turns to the light; what it holds back differs from place to place.
    pub fn card(&mut self, face: u32, card: Card) {
        // Its corners here are only what it takes of space at most.
        let [low, high] = card.bounds();
        let across =
            [low, DVec3::new(high.x, low.y, high.z), high, DVec3::new(low.x, high.y, low.z)];
        let first = self.points(across.into_iter());
        let before = self.casters.pieces.len();
        self.piece(face, f32::NAN, (0, None), first..first + 4);
        if let Some(piece) = self.casters.pieces.get_mut(before) {
            piece.card = Some(self.casters.cards.len() as u32);
            self.casters.cards.push(card);
        }
    }

    /// All pieces, with a tree over them.
    pub fn finish(self) -> Casters {
        let mut casters = self.casters;
        casters.tree = PieceTree::new(&mut casters);
        // As the leaves stand, so that neighbours lie side by side.
        let mut corners = Vec::with_capacity(casters.corners.len());
        for piece in &mut casters.pieces {
            let first = corners.len() as u32;
            corners.extend_from_slice(
                &casters.corners[piece.first as usize..][..piece.count as usize],
            );
            piece.first = first;
        }
        casters.corners = corners;
        casters
    }
}

/// Finds the pieces of a scene that rays meet.
#[derive(Debug)]
pub struct Finder<'c> {
    casters: &'c Casters,
    grid: Option<Arc<Grid>>,
}

impl Finder<'_> {
    /// The nearest piece that a ray meets, of those that `accept` lets count. Of two at one distance the
    /// first of all, whatever finds it.
    pub fn nearest(&self, ray: &Ray, mut accept: impl FnMut(&Hit) -> bool) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        self.visit(ray, |hit: Hit| {
            let beats = best.is_none_or(|best| (hit.t, hit.piece) < (best.t, best.piece));
            if !beats || !accept(&hit) {
                return None;
            }
            best = Some(hit);
            Some(hit.t)
        });
        best
    }

    /// Visits pieces that a ray meets, in no order: all up to the way that `visit` returned last, and perhaps some
    /// beyond it.
    pub fn visit(&self, ray: &Ray, visit: impl FnMut(Hit) -> Option<f64>) {
        match &self.grid {
            None => self.casters.traverse(ray, visit),
            Some(grid) => grid.traverse(self.casters, ray, visit),
        }
    }

    /// The pieces.
    pub fn casters(&self) -> &Casters {
        self.casters
    }
}

impl Casters {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// The least and the greatest coordinates of all pieces; `None` if there are none.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let corners = self.corners.iter().map(|corner| [*corner, *corner]);
        let all = corners.chain(self.cards.iter().map(Card::bounds));
        all.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])
    }

    /// The pieces.
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// The corners of a piece, in metres, as it is turned to somebody if it turns.
    pub fn corners(
        &self,
        piece: usize,
        toward: Toward,
    ) -> impl ExactSizeIterator<Item = DVec3> + Clone + '_ {
        let piece = &self.pieces[piece];
        let turned = piece.card.map(|card| self.cards[card as usize].corners(toward));
        let corners = &self.corners[piece.first as usize..][..piece.count as usize];
        corners.iter().enumerate().map(move |(i, corner)| match &turned {
            Some(turned) => turned[i],
            None => *corner,
        })
    }

    /// The plane in which the face of a piece is seen, by its unit normal and a point, if the piece leaves it.
    pub fn plane(&self, piece: usize) -> Option<(DVec3, DVec3)> {
        self.pieces[piece].plane.map(|plane| self.planes[plane as usize])
    }

    /// The card that a piece is, if it turns.
    pub fn card(&self, piece: usize) -> Option<&Card> {
        self.pieces[piece].card.map(|card| &self.cards[card as usize])
    }

    /// Corners of what a piece takes of space, however it is turned.
    pub(super) fn reach(&self, piece: usize) -> impl Iterator<Item = DVec3> + Clone + '_ {
        self.of(&self.pieces[piece]).iter().copied()
    }

    fn of(&self, piece: &Piece) -> &[DVec3] {
        &self.corners[piece.first as usize..][..piece.count as usize]
    }

    /// The normal of a piece's plane, as long as twice its area, as it is turned to somebody if it turns.
    pub fn normal(&self, piece: usize, toward: Toward) -> DVec3 {
        area_vector(self.corners(piece, toward))
    }

    /// The pieces that only one of two scenes has, as pieces of a scene; `was` says which faces of this one the other has
    /// too.
    pub(crate) fn differing(&self, other: &Casters, was: impl Fn(u32) -> Option<u32>) -> Casters {
        // Of one face there may be several pieces. What they hold back may depend on the body that they are of.
        let key = |casters: &Casters, piece: &Piece, face: u32| {
            let body = (piece.body.unsigned_abs() as usize).checked_sub(1);
            let around = body.map(|at| casters.bodies[at]).unwrap_or_default();
            let around = around.map(|corner| corner.to_array().map(f64::to_bits));
            (face, piece.opacity.to_bits(), piece.body.signum(), around)
        };
        let theirs: Vec<_> = other.pieces.iter().map(|p| key(other, p, p.face)).collect();
        let mine: Vec<_> = { self.pieces.iter() }
            .map(|piece| was(piece.face).map(|face| key(self, piece, face)))
            .collect();
        let known: HashSet<_> = theirs.iter().collect();
        let shared: HashSet<_> = mine.iter().flatten().filter(|key| known.contains(key)).collect();
        let only_mine = mine.iter().map(|key| key.as_ref().is_none_or(|key| !shared.contains(key)));
        let only_theirs = theirs.iter().map(|key| !shared.contains(key));
        let mut builder = CastersBuilder::default();
        let mut add = |casters: &Casters, piece: usize| {
            let first = builder.points(casters.reach(piece));
            let Piece { face, count, .. } = casters.pieces[piece];
            builder.piece(face, 1.0, (0, None), first..first + count);
        };
        only_mine.enumerate().filter(|(_, only)| *only).for_each(|(piece, _)| add(self, piece));
        only_theirs.enumerate().filter(|(_, only)| *only).for_each(|(piece, _)| add(other, piece));
        builder.finish()
    }

    /// Bytes held, about.
    pub fn bytes(&self) -> usize {
        let nodes = self.tree.as_ref().map_or(0, PieceTree::bytes);
        size_of_val(&*self.corners)
            + size_of_val(&*self.pieces)
            + size_of_val(&*self.cards)
            + size_of_val(&*self.planes)
            + nodes
    }

    /// Where a ray meets a piece, if it does before its end. What it only touches along its own plane it
    /// does not meet.
    #[inline]
    pub fn meet(&self, piece: usize, ray: &Ray) -> Option<Hit> {
        if let Some(card) = self.card(piece) {
            return card.meet(ray).map(|t| Hit { t, piece });
        }
        let corners = self.of(&self.pieces[piece]);
        let (mut is_left, mut is_right) = (true, true);
        let mut last = ray.seen(*corners.last()?);
        for corner in corners {
            // Left of all edges or right of all: a piece is met from both sides. A ray through an
            // edge itself is on both sides of it, and so meets both faces that share it.
            let next = ray.seen(*corner);
            let (left, right) = (last.0 * next.1, last.1 * next.0);
            is_left &= left >= right;
            is_right &= left <= right;
            if !is_left && !is_right {
                return None;
            }
            last = next;
        }
        let corner = corners[0];
        let normal = area_vector(corners.iter().copied());
        let t = normal.dot(corner - ray.origin) / normal.dot(ray.direction);
        (t > 0.0 && t < ray.reach).then_some(Hit { t, piece })
    }

    /// Visits all pieces that a ray meets, in no order, until `visit` returns false.
    pub fn meet_all(&self, ray: &Ray, mut visit: impl FnMut(Hit) -> bool) {
        // Beyond a way of 0 nothing matters: that ends it.
        self.traverse(ray, |hit| if visit(hit) { None } else { Some(0.0) });
    }

    /// What finds the pieces that rays meet.
    pub fn finder(&self, by: &Accelerator) -> Finder<'_> {
        let grid = match by {
            Accelerator::Tree => None,
            Accelerator::Grid(voxels) => Some(self.grid(voxels)),
        };
        Finder { casters: self, grid }
    }

    /// The grid of some voxels, made when it is asked for first.
    fn grid(&self, voxels: &Voxels) -> Arc<Grid> {
        let mut grids = self.grids.lock().unwrap_or_else(PoisonError::into_inner);
        let known = grids.iter().find(|(known, _)| known == voxels);
        if let Some((_, grid)) = known {
            return grid.clone();
        }
        // Made under the lock: whoever asks meanwhile waits for it, and does not make another.
        let grid = Arc::new(Grid::new(self, voxels));
        grids.push((*voxels, grid.clone()));
        grid
    }

    /// Whether light from one place goes into a piece's closed body at the piece, so that what comes out of the
    /// body elsewhere casts no other shadow: `Some(false)` where it comes out. `None` if the piece is of no
    /// body, or the light may be within it.
    pub fn goes_in(&self, piece: usize, from: Toward) -> Option<bool> {
        let number = self.pieces[piece].body;
        let [low, high] = self.bodies.get((number.unsigned_abs() as usize).checked_sub(1)?)?;
        if let Toward::Point(light) = from
            && light.cmpge(*low).all()
            && light.cmple(*high).all()
        {
            return None;
        }
        let toward = from.from(self.corners(piece, from).next()?).0;
        Some(self.normal(piece, from).dot(toward) * f64::from(number.signum()) > 0.0)
    }

    /// The pieces by the six spaces around a point, made when they are asked for first.
    pub fn spaces(&self, around: DVec3) -> Arc<Spaces> {
        let mut known = self.spaces.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, spaces)) = known.iter().find(|(point, _)| *point == around) {
            return spaces.clone();
        }
        let mut spaces = Spaces::default();
        for piece in 0..self.pieces.len() {
            if self.pieces[piece].card.is_some() {
                spaces.iter_mut().for_each(|space| space.push(piece as u32));
                continue;
            }
            for space in spaces_of(self.reach(piece).map(|corner| corner - around)) {
                spaces[space].push(piece as u32);
            }
        }
        let spaces = Arc::new(spaces);
        known.push((around, spaces.clone()));
        spaces
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball of triangles around the origin.
    fn ball(radius: f64, rings: u32) -> Casters {
        let mut builder = CastersBuilder::default();
        let point = |i: u32, j: u32| {
            let pi = std::f64::consts::PI;
            let up = pi * f64::from(i) / f64::from(rings);
            let round = pi * f64::from(j % (2 * rings)) / f64::from(rings);
            // The poles are one point each.
            let s = if i.is_multiple_of(rings) { 0.0 } else { crate::math::sin(up) };
            let c = crate::math::cos(up);
            DVec3::new(s * crate::math::cos(round), c, s * crate::math::sin(round)) * radius
        };
        let columns = 2 * rings;
        let base = builder.points((0..=rings).flat_map(|i| (0..columns).map(move |j| point(i, j))));
        let at = |i: u32, j: u32| base + i * columns + j % columns;
        for i in 0..rings {
            for j in 0..columns {
                let quad = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
                builder.piece(
                    i * columns + j,
                    1.0,
                    (0, None),
                    [quad[0], quad[1], quad[2]].into_iter(),
                );
                builder.piece(
                    i * columns + j,
                    1.0,
                    (0, None),
                    [quad[0], quad[2], quad[3]].into_iter(),
                );
            }
        }
        builder.finish()
    }

    #[test]
    fn nothing_leaks_out_of_a_closed_ball_at_any_scale() {
        for scale in [1e-20, 1e-6, 1.0, 1e6, 1e20] {
            let ball = ball(scale, 40);
            let mut leaks = 0;
            // Aimed at the corners and edges themselves, where rounding would open gaps.
            for piece in 0..ball.pieces().len() {
                let corners: Vec<DVec3> = ball.reach(piece).collect();
                let aims = [
                    corners[0],
                    (corners[0] + corners[1]) / 2.0,
                    corners[2] * 0.3 + corners[1] * 0.7,
                ];
                for aim in aims {
                    let origin = DVec3::new(0.1, -0.2, 0.05) * scale;
                    let ray = Ray::new(origin, aim - origin, 10.0);
                    leaks += u32::from(
                        ball.finder(&Accelerator::Tree).nearest(&ray, |_| true).is_none(),
                    );
                }
            }
            assert_eq!(leaks, 0, "at {scale}");
        }
    }

    #[test]
    fn tree_and_grids_find_what_a_search_through_all_finds() {
        let ball = ball(3.0, 12);
        let voxels = Voxels::default();
        let window = Some([DVec3::new(-1.0, -4.0, -1.5), DVec3::new(2.0, 4.0, 4.0)]);
        let grids = [
            voxels,
            Voxels { cells: (1, 7, 3), ..voxels },
            Voxels { size: Some(0.3), ..voxels },
            Voxels { size: Some(1e-9), window, ..voxels },
            Voxels { window, ..voxels },
        ];
        let mut met = 0;
        for i in 0..2000u32 {
            let t = f64::from(i);
            let at = |a: f64, b: f64| crate::math::sin(t * a + b) * 5.0;
            let origin = DVec3::new(at(1.3, 0.0), at(2.1, 1.0), at(0.7, 2.0));
            let direction = DVec3::new(at(3.3, 4.0), at(1.9, 3.0), at(2.7, 1.5));
            let ray = Ray::new(origin, direction, 2.0);
            let all = (0..ball.pieces().len()).filter_map(|piece| ball.meet(piece, &ray));
            let expected = all.min_by(|a, b| a.t.total_cmp(&b.t)).map(|hit| hit.t);
            for by in grids.map(Accelerator::Grid).into_iter().chain([Accelerator::Tree]) {
                let found = ball.finder(&by).nearest(&ray, |_| true).map(|hit| hit.t);
                assert_eq!(found, expected, "{by:?}");
            }
            // Beyond the nearest there are others, each met once.
            let beyond = |t: f64| {
                let by = Accelerator::Grid(voxels);
                ball.finder(&by).nearest(&ray, |hit| hit.t > t).map(|hit| hit.t)
            };
            let all = (0..ball.pieces().len()).filter_map(|piece| ball.meet(piece, &ray));
            let mut all: Vec<f64> = all.map(|hit| hit.t).collect();
            all.sort_by(f64::total_cmp);
            all.dedup();
            let found = std::iter::successors(beyond(0.0), |t| beyond(*t));
            assert_eq!(found.collect::<Vec<f64>>(), all);
            met += u32::from(expected.is_some());
        }
        assert!(met > 200 && met < 1990, "{met}");
    }
}
