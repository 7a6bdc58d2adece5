//! The edges of a face by height.
//!
//! Most faces have few edges, and walking along all of them is fastest. A face with many, a coastline or
//! a wall with a thousand windows, is asked for those near a line thousands of times: its edges are sorted
//! once, as an interval tree without pointers. A query then takes time in proportion to what it finds.

use glam::DVec2;
use std::sync::OnceLock;

use super::face::{Edge, Face, FaceTable};
use crate::raster::Raster;

/// Corners from which on a face's edges are sorted.
pub(crate) const MANY: usize = 64;

/// An edge of a face.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    /// The ring that it belongs to.
    pub ring: u32,
    /// Its place among all edges of the face.
    pub place: u32,
    /// The edge.
    pub edge: Edge,
}

/// What edges take of a band of heights: intervals of x, apart, from left to right.
#[derive(Clone, Debug)]
pub struct Occupied(Vec<(f64, f64)>);

impl Occupied {
    /// Whether there is an edge strictly between two x.
    pub fn meets(&self, left: f64, right: f64) -> bool {
        let at = self.0.partition_point(|(_, end)| *end <= left);
        self.0.get(at).is_some_and(|(start, _)| *start < right)
    }
}

/// The edges of one face, sorted by their upper ends. Every range of them is a tree whose root stands in
/// its middle.
#[derive(Clone, Debug)]
struct EdgeTree {
    sides: Vec<Side>,
    /// By place of a root: the lowest end of all edges of its tree.
    lowest: Vec<f64>,
}

impl EdgeTree {
    fn new(sides: impl Iterator<Item = Side>) -> EdgeTree {
        let mut sides: Vec<Side> = sides.collect();
        sides.sort_by(|a, b| a.edge.top.y.total_cmp(&b.edge.top.y));
        let mut tree = EdgeTree { lowest: vec![f64::NEG_INFINITY; sides.len()], sides };
        tree.lowest_of(0, tree.sides.len());
        tree
    }

    fn lowest_of(&mut self, from: usize, to: usize) -> f64 {
        if from >= to {
            return f64::NEG_INFINITY;
        }
        let root = usize::midpoint(from, to);
        let below = self.lowest_of(from, root).max(self.lowest_of(root + 1, to));
        self.lowest[root] = below.max(self.sides[root].edge.bottom.y);
        self.lowest[root]
    }

    fn near(&self, from: usize, to: usize, y: (f64, f64), each: &mut impl FnMut(Side)) {
        if from >= to {
            return;
        }
        let root = usize::midpoint(from, to);
        if self.lowest[root] < y.0 {
            return;
        }
        self.near(from, root, y, each);
        let side = self.sides[root];
        if side.edge.top.y <= y.1 {
            if side.edge.bottom.y >= y.0 {
                each(side);
            }
            self.near(root + 1, to, y, each);
        }
    }
}

/// The sorted edges of those faces of a table that have many, each made when it is first asked for.
#[derive(Clone, Debug, Default)]
pub(super) struct Trees(OnceLock<Vec<(u32, OnceLock<EdgeTree>)>>);

impl Trees {
    /// The tree of a face of `table`; `None` if it has few edges.
    fn of(&self, table: &FaceTable, face: &Face) -> Option<&EdgeTree> {
        if table.corner_count(face) < MANY {
            return None;
        }
        let trees = self.0.get_or_init(|| {
            let many = table.faces().iter().filter(|face| table.corner_count(face) >= MANY);
            many.map(|face| (face.ordinal, OnceLock::new())).collect()
        });
        let at = trees.binary_search_by_key(&face.ordinal, |(ordinal, _)| *ordinal).ok()?;
        Some(trees[at].1.get_or_init(|| EdgeTree::new(table.sides(face))))
    }
}

impl FaceTable {
    /// All edges of a face's rings.
    pub fn sides<'a>(&'a self, face: &Face) -> impl Iterator<Item = Side> + 'a {
        let rings = self.rings(face).zip(0u32..);
        let edges = rings.flat_map(|(ring, number)| ring.edges().map(move |edge| (number, edge)));
        edges.zip(0u32..).map(|((ring, edge), place)| Side { ring, place, edge })
    }

    /// From which height to which a face reaches, in pixels.
    pub fn extent(&self, face: &Face) -> (f64, f64) {
        if let Some(tree) = self.trees().of(self, face) {
            let root = tree.sides.len() / 2;
            return (tree.sides[0].edge.top.y, tree.lowest[root]);
        }
        let (mut top, mut bottom) = (f64::INFINITY, f64::NEG_INFINITY);
        for point in self.rings(face).flat_map(|ring| ring.points()) {
            top = top.min(point.y);
            bottom = bottom.max(point.y);
        }
        (top, bottom)
    }

    /// A place that stands for all of a face, in pixels: on the middle line of its part of the raster, the middle of the
    /// longest piece of it there. `None` if nothing of it lies in the raster.
    pub fn place(&self, face: &Face, raster: Raster) -> Option<DVec2> {
        let (width, height) = (f64::from(raster.width), f64::from(raster.height));
        let (top, bottom) = self.extent(face);
        let (top, bottom) = (top.max(0.0), bottom.min(height));
        if top > bottom {
            return None;
        }
        let y = f64::midpoint(top, bottom);
        let mut ends: Vec<f64> =
            self.crossing(face, y).map(|edge| edge.x_at(y).clamp(0.0, width)).collect();
        ends.sort_unstable_by(f64::total_cmp);
        let pieces = ends.chunks_exact(2).filter(|piece| piece[0] < piece[1]);
        let longest = pieces.max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))?;
        Some(DVec2::new(f64::midpoint(longest[0], longest[1]), y))
    }

    /// What the edges of a face take of the heights from `top` to `bottom`: intervals of x in pixels, apart,
    /// from left to right.
    pub fn occupied(&self, face: &Face, top: f64, bottom: f64) -> Occupied {
        let mut reached: Vec<(f64, f64)> = Vec::new();
        self.sides_near(face, top, bottom, |side| reached.extend(side.edge.reach(top, bottom)));
        reached.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        reached.dedup_by(|next, last| {
            let touches = next.0 <= last.1;
            if touches {
                last.1 = last.1.max(next.1);
            }
            touches
        });
        Occupied(reached)
    }

    /// The edges of a face that reach into the heights from `top` to `bottom`, both included, in any order.
    pub fn sides_near(&self, face: &Face, top: f64, bottom: f64, mut each: impl FnMut(Side)) {
        match self.trees().of(self, face) {
            Some(tree) => tree.near(0, tree.sides.len(), (top, bottom), &mut each),
            None => {
                let meets = |s: &Side| s.edge.top.y <= bottom && s.edge.bottom.y >= top;
                self.sides(face).filter(meets).for_each(each);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn a_tree_finds_what_walking_along_all_edges_finds() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f64 / f64::from(1 << 24)
        };
        for count in [1, 2, 3, 64, 500] {
            let mut side = |place: u32| {
                let (y, height) = (random() * 9.0, random() * random() * 9.0);
                let edge = Edge::new(DVec2::new(0.0, y), DVec2::new(1.0, y + height));
                Side { ring: place % 3, place, edge }
            };
            let sides: Vec<Side> = (0..count).map(&mut side).collect();
            let tree = EdgeTree::new(sides.iter().copied());
            for i in 0..200 {
                let (top, bottom) = (f64::from(i) * 0.1 - 1.0, f64::from(i) * 0.1 - 1.0);
                let bottom = bottom + f64::from(i % 5) * 0.3;
                let mut found = Vec::new();
                tree.near(0, sides.len(), (top, bottom), &mut |side| found.push(side.place));
                found.sort_unstable();
                let meets = |s: &&Side| s.edge.top.y <= bottom && s.edge.bottom.y >= top;
                let expected: Vec<u32> = sides.iter().filter(meets).map(|s| s.place).collect();
                assert_eq!(found, expected);
            }
        }
    }
}
