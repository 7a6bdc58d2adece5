//! What is there of a polygon with holes: inside the outline by the even-odd rule, outside of all holes.
//!
//! Files have outlines that cross themselves, holes that overlap or reach beyond the outline, rings that
//! run along each other. This is the one place that decides what such a face is; the result is *areas*,
//! simple outlines with holes that lie apart inside of them, for which every way to look at a face,
//! lines, rays, shadows, lamps and sums, gives the same.
//!
//! The work is done on a grid of whole numbers, 2^50 across the polygon, in its plane as seen along the
//! axis that its normal follows most. So it is exact but for the points at which edges cross, which move
//! by less than a part in 10^15. Corners stay the corners that were given.

use glam::DVec3;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay::{IntOverlayOptions, Overlay, ShapeType};
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::i_float::int::point::IntPoint;
use i_triangle::int::unchecked::IntUncheckedTriangulatable;
use std::collections::{HashMap, HashSet};

/// Cells of the grid across a polygon, as a power of two.
const BITS: i32 = 50;

/// A corner of an area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Corner {
    /// One that was given, by its place among all points.
    Given(u32),
    /// A point at which two edges cross.
    Made(DVec3),
}

/// A connected part of a polygon: an outline that runs counter-clockwise seen from the front, and holes
/// that run clockwise. No ring meets itself or another but in single points.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Area {
    /// The outline.
    pub(crate) outline: Vec<Corner>,
    /// Holes inside it, apart from each other.
    pub(crate) holes: Vec<Vec<Corner>>,
}

/// A polygon on its grid.
struct Grid<'p> {
    points: &'p [DVec3],
    normal: DVec3,
    /// The axes of the plane that it is seen in, and the one across it.
    axes: [usize; 3],
    low: DVec3,
    /// Cells per metre: a power of two.
    scale: f64,
    centre: DVec3,
    /// The first of the points given in a cell.
    given: HashMap<IntPoint<i64>, u32>,
}

type Contour = Vec<IntPoint<i64>>;

impl<'p> Grid<'p> {
    /// `None` if the points are so near to each other or so far apart that there is no grid.
    fn new(points: &'p [DVec3], normal: DVec3) -> Option<Grid<'p>> {
        let facing = normal.abs();
        let across = (0..3).max_by(|a, b| facing[*a].total_cmp(&facing[*b]))?;
        let (u, v) = ((across + 1) % 3, (across + 2) % 3);
        // Seen from the front, whichever way the normal points along the axis.
        let axes = if normal[across] < 0.0 { [v, u, across] } else { [u, v, across] };
        let low = points.iter().fold(DVec3::INFINITY, |low, p| low.min(*p));
        let high = points.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
        let extent = (high - low)[axes[0]].max((high - low)[axes[1]]);
        if !(extent.is_finite() && extent > 0.0 && normal[across] != 0.0) {
            return None;
        }
        // From the exponent alone: a scale by a power of two rounds nothing.
        let power = BITS - 1 - (extent.to_bits() >> 52) as i32 + 1023;
        if !(-1000..=1000).contains(&power) {
            return None;
        }
        let scale = f64::from_bits(((power + 1023) as u64) << 52);
        let centre = points.iter().sum::<DVec3>() / points.len() as f64;
        let mut grid = Grid { points, normal, axes, low, scale, centre, given: HashMap::new() };
        for (at, point) in points.iter().enumerate() {
            // Corners that fall into one cell become the first of them.
            grid.given.entry(grid.cell(*point)).or_insert(at as u32);
        }
        Some(grid)
    }

    fn cell(&self, point: DVec3) -> IntPoint<i64> {
        let [u, v, _] = self.axes;
        let from = (point - self.low) * self.scale;
        IntPoint::new(from[u].round() as i64, from[v].round() as i64)
    }

    fn contour(&self, points: &[DVec3]) -> Contour {
        let mut contour: Contour = points.iter().map(|point| self.cell(*point)).collect();
        contour.dedup();
        contour
    }

    fn corner(&self, cell: IntPoint<i64>) -> Corner {
        if let Some(at) = self.given.get(&cell) {
            return Corner::Given(*at);
        }
        let [u, v, w] = self.axes;
        let mut point = DVec3::ZERO;
        point[u] = self.low[u] + cell.x as f64 / self.scale;
        point[v] = self.low[v] + cell.y as f64 / self.scale;
        let from = point - self.centre;
        point[w] =
            self.centre[w] - (self.normal[u] * from[u] + self.normal[v] * from[v]) / self.normal[w];
        Corner::Made(point)
    }

    /// The shapes that there are: each an outline and holes.
    fn shapes(&self, holes: &[u32]) -> Vec<Vec<Contour>> {
        let (outline, rest) = self.points.split_at(first(holes, self.points.len()));
        let options = || IntOverlayOptions { ogc: true, ..IntOverlayOptions::keep_all_points() };
        let even_odd = |ring: &[DVec3]| {
            let contour = self.contour(ring);
            let mut overlay: Overlay<i64> =
                Overlay::new_custom(contour.len(), options(), Default::default());
            overlay.add_contour(&contour, ShapeType::Subject);
            overlay.overlay(OverlayRule::Subject, FillRule::EvenOdd)
        };
        let outline = even_odd(outline);
        if holes.is_empty() {
            return outline;
        }
        let ends = holes.iter().skip(1).map(|start| *start as usize).chain([self.points.len()]);
        let base = self.points.len() - rest.len();
        let rings =
            holes.iter().zip(ends).map(|(start, end)| &rest[*start as usize - base..end - base]);
        let holes: Vec<Vec<Contour>> = rings.flat_map(even_odd).collect();
        // 1. Outline and holes, each by the even-odd rule, so that rings that cross themselves mean
        // what they do alone. 2. All holes together, however often they cover a place. 3. The
        // difference.
        Overlay::from_subj_and_clip_custom(&outline, &holes, options(), Default::default())
            .overlay(OverlayRule::Difference, FillRule::NonZero)
    }

    /// Whether shapes are the rings that were given, and nothing else.
    fn is_as_given(&self, shapes: &[Vec<Contour>], holes: &[u32]) -> bool {
        let [shape] = shapes else { return false };
        if shape.len() != holes.len() + 1 {
            return false;
        }
        let sides = |contour: &Contour| -> Vec<[IntPoint<i64>; 2]> {
            let next = contour.iter().cycle().skip(1);
            let pairs = contour.iter().zip(next).filter(|(a, b)| a != b);
            pairs.map(|(a, b)| if (a.x, a.y) < (b.x, b.y) { [*a, *b] } else { [*b, *a] }).collect()
        };
        // Edges without direction, as the library may turn rings and begin them elsewhere.
        let found: HashSet<[IntPoint<i64>; 2]> = shape.iter().flat_map(sides).collect();
        let starts = std::iter::once(0).chain(holes.iter().map(|start| *start as usize));
        let ends = holes.iter().map(|start| *start as usize).chain([self.points.len()]);
        let mut count = 0;
        let all = starts.zip(ends).all(|(start, end)| {
            let sides = sides(&self.contour(&self.points[start..end]));
            count += sides.len();
            sides.iter().all(|side| found.contains(side))
        });
        all && count == found.len()
    }
}

/// Where the outline ends among the points of all rings.
fn first(holes: &[u32], count: usize) -> usize {
    holes.first().map_or(count, |first| *first as usize)
}

/// The areas of a polygon: `points` are those of its outline, and then those of the holes, each from one of
/// `holes` on; `normal` points to the front. `None` if it is one area as it is given.
pub(crate) fn areas(points: &[DVec3], holes: &[u32], normal: DVec3) -> Option<Vec<Area>> {
    let grid = Grid::new(points, normal)?;
    let shapes = grid.shapes(holes);
    if grid.is_as_given(&shapes, holes) {
        return None;
    }
    let ring = |contour: Contour| -> Vec<Corner> {
        contour.into_iter().map(|cell| grid.corner(cell)).collect()
    };
    let area = |shape: Vec<Contour>| {
        let mut rings = shape.into_iter().map(ring);
        let outline = rings.next().unwrap_or_default();
        Area { outline, holes: rings.collect() }
    };
    Some(shapes.into_iter().map(area).filter(|area| area.outline.len() >= 3).collect())
}

/// The region of a polygon, given as for [`areas`], in triangles that run counter-clockwise seen from the front;
/// their edges are those of a Delaunay triangulation where the polygon leaves the choice.
pub(crate) fn triangles(points: &[DVec3], holes: &[u32], normal: DVec3) -> Vec<[Corner; 3]> {
    if points.len() == 3 {
        return vec![[1, 2, 0].map(Corner::Given)];
    }
    let Some(grid) = Grid::new(points, normal) else { return Vec::new() };
    let mut all = Vec::new();
    for shape in grid.shapes(holes) {
        let found = shape.uncheck_triangulate().into_delaunay();
        for triangle in &found.triangles {
            all.push(triangle.vertices.map(|vertex| grid.corner(vertex.point)));
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(points: &[(f64, f64)]) -> Vec<DVec3> {
        points.iter().map(|(x, y)| DVec3::new(*x, *y, 0.5 * x - 0.25 * y)).collect()
    }

    const NORMAL: DVec3 = DVec3::new(-0.5, 0.25, 1.0);

    /// The area seen along z of a polygon's areas, and of its triangles.
    fn sizes(rings: &[&[(f64, f64)]]) -> (Option<usize>, f64, f64) {
        let mut points = Vec::new();
        let mut holes = Vec::new();
        for (i, ring) in rings.iter().enumerate() {
            if i > 0 {
                holes.push(points.len() as u32);
            }
            points.extend(flat(ring));
        }
        let at = |corner: Corner| match corner {
            Corner::Given(at) => points[at as usize],
            Corner::Made(point) => point,
        };
        let size = |ring: &[Corner]| -> f64 {
            let next = ring.iter().cycle().skip(1);
            let cross = |a: DVec3, b: DVec3| a.x * b.y - a.y * b.x;
            ring.iter().zip(next).map(|(a, b)| cross(at(*a), at(*b))).sum::<f64>() / 2.0
        };
        let found = areas(&points, &holes, NORMAL);
        let count = found.as_ref().map(Vec::len);
        let of_areas = |areas: Vec<Area>| {
            let rings = areas.into_iter().flat_map(|a| std::iter::once(a.outline).chain(a.holes));
            rings.map(|ring| size(&ring)).sum::<f64>()
        };
        let triangles = triangles(&points, &holes, NORMAL);
        assert!(triangles.iter().all(|t| size(t) > 0.0), "they run counter-clockwise");
        for corner in triangles.iter().flatten() {
            let p = at(*corner);
            assert!((p.z - (0.5 * p.x - 0.25 * p.y)).abs() < 1e-14, "{p:?} lies in the plane");
        }
        let sum = triangles.iter().map(|t| size(t)).sum();
        (count, found.map_or(f64::NAN, of_areas), sum)
    }

    #[test]
    fn what_is_there_is_the_outline_less_its_holes() {
        let square: &[(f64, f64)] = &[(0.0, 0.0), (8.0, 0.0), (8.0, 3.0), (0.0, 3.0)];
        let hole =
            |x: f64, y: f64, w: f64, h: f64| [(x, y), (x + w, y), (x + w, y + h), (x, y + h)];
        // As they are given, whichever way round holes run.
        let mut turned = hole(1.0, 1.0, 1.0, 1.0);
        assert_eq!(sizes(&[square]).0, None);
        assert_eq!(sizes(&[square, &turned]).0, None);
        turned.reverse();
        assert_eq!(sizes(&[square, &turned, &hole(4.0, 0.5, 1.0, 1.0)]).0, None);
        assert_eq!(sizes(&[square, &turned]).2, 23.0);
        let check = |rings: &[&[(f64, f64)]], count: usize, expected: f64| {
            let (found, areas, triangles) = sizes(rings);
            assert_eq!(found, Some(count), "{rings:?}");
            let close = |a: f64| (a - expected).abs() < 1e-12;
            assert!(close(areas) && close(triangles), "{areas} {triangles} {expected} {rings:?}");
        };
        // A hole that reaches beyond the outline, one outside, one that takes all, one that touches.
        check(&[square, &hole(3.0, 1.0, 2.0, 4.0)], 1, 24.0 - 4.0);
        check(&[square, &hole(9.0, 1.0, 2.0, 4.0)], 1, 24.0);
        check(&[square, &hole(-1.0, -1.0, 12.0, 9.0)], 0, 0.0);
        check(&[square, &hole(3.0, 1.0, 2.0, 2.0)], 1, 24.0 - 4.0);
        check(&[square, &hole(3.0, -1.0, 2.0, 9.0)], 2, 24.0 - 6.0);
        // Holes that overlap, lie in each other, are the same.
        check(&[square, &hole(1.0, 1.0, 2.0, 1.0), &hole(2.0, 0.5, 2.0, 1.0)], 1, 24.0 - 3.5);
        check(&[square, &hole(1.0, 1.0, 2.0, 1.0), &hole(1.5, 1.2, 0.5, 0.5)], 1, 24.0 - 2.0);
        check(&[square, &hole(1.0, 1.0, 2.0, 1.0), &hole(1.0, 1.0, 2.0, 1.0)], 1, 24.0 - 2.0);
        // A hole that crosses itself, an outline that does: once, and with as much to either side.
        let bow = [(1.0, 1.0), (3.0, 1.0), (1.0, 2.0), (3.0, 2.0)];
        check(&[square, &bow], 1, 24.0 - 1.0);
        check(&[&bow], 2, 1.0);
        // A pentagram: its middle is not inside.
        let tip = |i: i32| {
            let angle = f64::from(i) * 0.8 * std::f64::consts::PI;
            (crate::math::cos(angle), crate::math::sin(angle))
        };
        let star: Vec<(f64, f64)> = (0..5).map(tip).collect();
        let (count, areas, sum) = sizes(&[&star]);
        assert_eq!(count, Some(5));
        // Its ten corners, less the pentagon, whose corners lie at 1 / phi^2.
        let (inner, pi) = ((3.0 - 5f64.sqrt()) / 2.0, std::f64::consts::PI);
        let tips = 5.0 * inner * crate::math::sin(pi / 5.0)
            - 2.5 * inner * inner * crate::math::sin(pi * 0.4);
        assert!((areas - sum).abs() < 1e-12 && (areas - tips).abs() < 1e-12, "{areas} {tips}");
        // An outline that runs to a hole and back.
        let keyhole = [
            (0.0, 0.0),
            (4.0, 0.0),
            (4.0, 4.0),
            (0.0, 4.0),
            (0.0, 0.0),
            (1.0, 1.0),
            (1.0, 3.0),
            (3.0, 3.0),
            (3.0, 1.0),
            (1.0, 1.0),
        ];
        check(&[&keyhole], 1, 12.0);
    }

    #[test]
    fn by_chance_it_is_what_points_say() {
        let mut state = 7u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f64 / f64::from(1 << 24)
        };
        let inside = |ring: &[DVec3], p: DVec3| {
            let next = ring.iter().cycle().skip(1);
            let crosses = |(a, b): (&DVec3, &DVec3)| {
                (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
            };
            ring.iter().zip(next).filter(|pair| crosses(*pair)).count() % 2 == 1
        };
        for scale in [1.0, 1e-20, 1e20, 3e6] {
            for _ in 0..60 {
                let mut ring = |n: usize, size: f64| -> Vec<DVec3> {
                    let (x, y) = (random() * (1.0 - size), random() * (1.0 - size));
                    (0..n)
                        .map(|_| DVec3::new(x + random() * size, y + random() * size, 0.0) * scale)
                        .collect()
                };
                let rings = [ring(9, 1.0), ring(4, 0.6), ring(5, 0.5), ring(3, 0.3)];
                let mut points = rings[0].clone();
                let mut holes = Vec::new();
                for hole in &rings[1..] {
                    holes.push(points.len() as u32);
                    points.extend(hole);
                }
                let at = |corner: Corner| match corner {
                    Corner::Given(at) => points[at as usize],
                    Corner::Made(point) => point,
                };
                let triangles: Vec<Vec<DVec3>> = triangles(&points, &holes, DVec3::Z)
                    .into_iter()
                    .map(|triangle| triangle.map(at).to_vec())
                    .collect();
                for _ in 0..200 {
                    let p = DVec3::new(random(), random(), 0.0) * scale;
                    let is_there = inside(&rings[0], p) && !rings[1..].iter().any(|r| inside(r, p));
                    let found = triangles.iter().filter(|triangle| inside(triangle, p)).count();
                    assert_eq!(found, usize::from(is_there), "{p:?} in {rings:?}");
                }
            }
        }
    }
}
