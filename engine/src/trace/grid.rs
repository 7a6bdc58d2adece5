//! \[D]'s voxels: a grid of cells that know the pieces in them, and a line generator that steps from cell to
//! cell (3DDDA: Fujimoto, Tanaka and Iwata 1986; stepped as Amanatides and Woo 1987).
//!
//! Pieces that reach out of the grid's window are tested for every ray: the window is a dial of speed and
//! memory, never of what is seen.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ray::part_in;
use super::{Casters, Hit, Ray};

/// The most cells along an axis, and in all.
const MOST: (u32, u64) = (1024, 1 << 24);

/// The most cells that a piece is entered in, and entries in all; what needs more is tested for every ray.
const ENTRIES: (u64, u64) = (1 << 16, 1 << 28);

/// By how much of a cell pieces are enlarged: more than the rounding of a step.
const MARGIN: f64 = 1e-6;

/// The cells of a grid, as \[D]'s rendering conditions have them: a window, and the number of cells along
/// each axis or their size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Voxels {
    /// Cells along x, y and z, each 1 to 1024, 2^24 in all.
    pub cells: (u32, u32, u32),
    /// The length of a cell's sides in metres, instead of their number; made larger if there would be too
    /// many.
    pub size: Option<f64>,
    /// The least and the greatest corner of the part of the world that is divided, in metres; absent, what
    /// is around all faces of a scene.
    #[schemars(with = "Option<[[f64; 3]; 2]>")]
    pub window: Option<[DVec3; 2]>,
}

impl Default for Voxels {
    fn default() -> Voxels {
        Voxels { cells: (32, 32, 32), size: None, window: None }
    }
}

impl Voxels {
    /// Whether there is such a grid.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn check(&self) -> Result<(), String> {
        let (x, y, z) = self.cells;
        let is_counted = [x, y, z].iter().all(|count| (1..=MOST.0).contains(count));
        if !is_counted || u64::from(x) * u64::from(y) * u64::from(z) > MOST.1 {
            let [most, all] = [u64::from(MOST.0), MOST.1];
            return Err(format!("{x} by {y} by {z} cells: 1 to {most} of each, {all} in all"));
        }
        if self.size.is_some_and(|size| !(size.is_finite() && size > 0.0)) {
            return Err("the size of a cell must be above 0 metres".to_owned());
        }
        match self.window {
            Some([low, high])
                if !(low.is_finite() && high.is_finite() && low.cmplt(high).all()) =>
            {
                Err("the window's first corner must be below its second".to_owned())
            }
            _ => Ok(()),
        }
    }
}

/// The pieces of a scene by the cells that they reach into.
#[derive(Debug)]
pub(super) struct Grid {
    low: DVec3,
    high: DVec3,
    /// The sides of a cell.
    side: DVec3,
    counts: [u32; 3],
    /// Where the pieces of each cell begin, and the end.
    starts: Vec<u32>,
    pieces: Vec<u32>,
    /// Pieces that are not wholly within the window, or reach into too many cells.
    outside: Vec<u32>,
}

impl Grid {
    /// The grid over all pieces of a scene.
    pub(super) fn new(casters: &Casters, voxels: &Voxels) -> Grid {
        let boxes: Vec<[DVec3; 2]> = (0..casters.pieces.len())
            .map(|piece| {
                let corners = || casters.reach(piece);
                let low = corners().fold(DVec3::INFINITY, DVec3::min);
                [low, corners().fold(DVec3::NEG_INFINITY, DVec3::max)]
            })
            .collect();
        let around = || {
            let low = boxes.iter().fold(DVec3::INFINITY, |low, [own, _]| low.min(*own));
            (low, boxes.iter().fold(DVec3::NEG_INFINITY, |high, [_, own]| high.max(*own)))
        };
        let (low, high) = match voxels.window {
            Some([low, high]) => (low, high),
            None if boxes.is_empty() => (DVec3::ZERO, DVec3::ONE),
            None => around(),
        };
        // A flat scene has a box without depth.
        let extent = high - low;
        let least = (extent.max_element() * 1e-6).max(1e-30);
        // Faces on the border are met on their very edges too.
        let pad = |i: usize| if extent[i] < least { least } else { extent[i] * MARGIN };
        let pad = DVec3::from_array([0, 1, 2].map(pad));
        let (low, high) = (low - pad, high + pad);
        let counts = match voxels.size {
            None => voxels.cells.into(),
            Some(size) => {
                let wanted = ((high - low) / size).ceil().clamp(DVec3::ONE, DVec3::splat(1024.0));
                let all = wanted.element_product() / MOST.1 as f64;
                let by = if all > 1.0 { all.cbrt() } else { 1.0 };
                (wanted / by).floor().max(DVec3::ONE).to_array().map(|count| count as u32)
            }
        };
        let side = (high - low) / DVec3::from(counts.map(f64::from));
        let mut grid = Grid {
            low,
            high,
            side,
            counts,
            starts: Vec::new(),
            pieces: Vec::new(),
            outside: Vec::new(),
        };
        grid.sort_in(&boxes);
        grid
    }

    /// Counts the pieces of each cell first, so that they lie side by side.
    fn sort_in(&mut self, boxes: &[[DVec3; 2]]) {
        let count = self.counts.iter().map(|c| *c as usize).product::<usize>();
        let mut starts = vec![0u32; count + 1];
        let margin = self.side * MARGIN;
        let mut reach = Vec::with_capacity(boxes.len());
        let mut entries = 0;
        for (piece, [low, high]) in boxes.iter().enumerate() {
            let cells = (self.cell(*low - margin), self.cell(*high + margin));
            let count = (0..3).map(|i| u64::from(cells.1[i] - cells.0[i] + 1)).product::<u64>();
            let is_within = low.cmpge(self.low).all() && high.cmple(self.high).all();
            if !is_within || count > ENTRIES.0 || entries + count > ENTRIES.1 {
                self.outside.push(piece as u32);
                reach.push(None);
                continue;
            }
            entries += count;
            self.each(cells, |cell| starts[cell + 1] += 1);
            reach.push(Some(cells));
        }
        for cell in 0..count {
            starts[cell + 1] += starts[cell];
        }
        let mut next = starts.clone();
        self.pieces = vec![0; starts[count] as usize];
        let mut pieces = std::mem::take(&mut self.pieces);
        for (piece, cells) in reach.into_iter().enumerate() {
            let Some(cells) = cells else { continue };
            self.each(cells, |cell| {
                pieces[next[cell] as usize] = piece as u32;
                next[cell] += 1;
            });
        }
        (self.pieces, self.starts) = (pieces, starts);
    }

    fn cell(&self, point: DVec3) -> [u32; 3] {
        let place = (point - self.low) / self.side;
        [0, 1, 2].map(|i| (place[i].floor().max(0.0) as u32).min(self.counts[i] - 1))
    }

    fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        let [nx, ny, _] = self.counts.map(|count| count as usize);
        (z as usize * ny + y as usize) * nx + x as usize
    }

    fn each(&self, (low, high): ([u32; 3], [u32; 3]), mut visit: impl FnMut(usize)) {
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    visit(self.index([x, y, z]));
                }
            }
        }
    }

    /// Visits the pieces that a ray meets, each once; `visit` may say beyond which way nothing matters any
    /// more.
    pub(super) fn traverse(
        &self,
        casters: &Casters,
        ray: &Ray,
        mut visit: impl FnMut(Hit) -> Option<f64>,
    ) {
        // What lies outside first: whatever is met there shortens the walk through the cells.
        let mut end = ray.reach;
        for piece in &self.outside {
            if let Some(hit) = casters.meet(*piece as usize, ray) {
                end = visit(hit).map_or(end, |t| end.min(t));
            }
        }
        let Some(part) = part_in((ray.origin, ray.direction), [self.low, self.high], 0.0..end)
        else {
            return;
        };
        let mut cell = self.cell(ray.at(part.start));
        // Along each axis: the way to the next border, and from border to border.
        let mut next = [f64::INFINITY; 3];
        let mut step = [f64::INFINITY; 3];
        for axis in 0..3 {
            let along = ray.direction[axis];
            if along != 0.0 {
                let border = cell[axis] + u32::from(along > 0.0);
                let border = self.low[axis] + f64::from(border) * self.side[axis];
                next[axis] = (border - ray.origin[axis]) / along;
                step[axis] = self.side[axis] / along.abs();
            }
        }
        let mut from = f64::NEG_INFINITY;
        loop {
            let axis = if next[0] < next[1] {
                if next[0] < next[2] { 0 } else { 2 }
            } else if next[1] < next[2] {
                1
            } else {
                2
            };
            let border = cell[axis] + u32::from(ray.direction[axis] > 0.0);
            let is_last = border == 0 || border == self.counts[axis] || next[axis] == f64::INFINITY;
            // Rounding must not let a cell end before it begins, or a piece would be met in none.
            let to = if is_last { f64::INFINITY } else { next[axis].max(from) };
            let at = self.index(cell);
            for piece in &self.pieces[self.starts[at] as usize..self.starts[at + 1] as usize] {
                // A piece in several cells is met in one of them.
                let hit = casters.meet(*piece as usize, ray).filter(|h| from <= h.t && h.t < to);
                if let Some(hit) = hit {
                    end = visit(hit).map_or(end, |t| end.min(t));
                }
            }
            if is_last || to > end {
                return;
            }
            from = to;
            // [D]: the motion from cell to cell is incremental, without multiplication or division.
            next[axis] += step[axis];
            cell[axis] = if ray.direction[axis] > 0.0 { cell[axis] + 1 } else { cell[axis] - 1 };
        }
    }
}
