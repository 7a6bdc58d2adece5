//! Faces as a span image knows them: a plane over the screen, an outline on the screen, a place in
//! the total order.

use glam::DVec2;
use rayon::prelude::*;

use super::edges::Trees;
use crate::camera::Plane;
use crate::error::{Error, Result};

/// A face of a span image: its place in the table of all faces, sources one after another. Faces
/// compare as their keys (source, then ordinal) do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct FaceId(pub u32);

impl FaceId {
    /// No face: the background. It is known by this id and never by a depth.
    pub const NONE: FaceId = FaceId(u32::MAX);

    /// Whether there is a face.
    pub fn is_some(self) -> bool {
        self != FaceId::NONE
    }
}

/// What a face is to the faces beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A polygon with holes: inside the first ring, outside all others.
    Face,
    /// An area on a face (\[D]): inside its first ring and inside the face, whose place in the table
    /// this is. It has the face's plane bit for bit and a higher rank.
    Seal(u32),
    /// The drawn edge of a face or seal: the union of its rings.
    Stroke,
}

/// A face in a [`FaceTable`].
#[derive(Clone, Debug)]
pub struct Face {
    /// The face's number in its source. Numbers increase along the table.
    pub ordinal: u32,
    /// Depth over the screen.
    pub plane: Plane,
    /// Decides between equal depths; greater is seen.
    pub rank: u32,
    /// What the face is.
    pub role: Role,
    /// Whether its front is seen.
    pub sees_front: bool,
    /// Whether it lets through what lies behind it: its segments are [layers](super::layer).
    pub is_translucent: bool,
    /// Whether it is one ring that no line crosses more than twice: every convex polygon, and others.
    pub is_monotone: bool,
    first_corner: u32,
    corners: u32,
}

impl Face {
    /// What a builder was told of it.
    pub fn head(&self) -> FaceHead {
        FaceHead {
            ordinal: self.ordinal,
            plane: self.plane,
            rank: self.rank,
            role: self.role,
            sees_front: self.sees_front,
            is_translucent: self.is_translucent,
        }
    }
}

/// The faces of one source over one view: a pure function of the two, so that every image of the
/// source over that view has the same table. Faces that no line can meet are left out.
///
/// Outlines are kept so that whoever needs an edge's slope derives it; a source whose outlines are
/// unknown has faces without corners.
#[derive(Clone, Debug, Default)]
pub struct FaceTable {
    faces: Vec<Face>,
    /// Indices into `points`; the last corner of a ring has [`END_OF_RING`] set.
    corners: Vec<u32>,
    /// On the screen, in pixels.
    points: Vec<DVec2>,
    /// Made of the others, on demand.
    trees: Trees,
}

const END_OF_RING: u32 = 1 << 31;

/// Depth coefficients beyond this would overflow when they are compared.
const MAX_COEFFICIENT: f64 = 1e290;

/// An edge on the screen. Its ends are sorted, so that neighbouring faces agree about it in every
/// bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// The end with the smaller y, in pixels.
    pub top: DVec2,
    /// The end with the greater y.
    pub bottom: DVec2,
}

impl Edge {
    /// The edge between two points, in either order.
    #[inline(always)]
    pub fn new(p: DVec2, q: DVec2) -> Edge {
        if (p.y, p.x) <= (q.y, q.x) {
            Edge { top: p, bottom: q }
        } else {
            Edge { top: q, bottom: p }
        }
    }

    /// Whether a line at `y` crosses it. The upper end belongs to it, the lower does not: the edges
    /// of a closed ring cross every line an even number of times.
    #[inline(always)]
    pub fn crosses(&self, y: f64) -> bool {
        self.top.y <= y && y < self.bottom.y
    }

    /// Pixels to the right per pixel downwards. Not finite for a horizontal edge.
    #[inline(always)]
    pub fn slope(&self) -> f64 {
        (self.bottom.x - self.top.x) / (self.bottom.y - self.top.y)
    }

    /// From which x to which it reaches between two heights; `None` if it lies above or below them.
    pub fn reach(&self, top: f64, bottom: f64) -> Option<(f64, f64)> {
        if self.bottom.y < top || self.top.y > bottom {
            return None;
        }
        let (p, q) = match self.top.y == self.bottom.y {
            true => (self.top.x, self.bottom.x),
            false => (self.x_at(top.max(self.top.y)), self.x_at(bottom.min(self.bottom.y))),
        };
        Some((p.min(q), p.max(q)))
    }

    /// Where it crosses the line at `y`, never outside its own ends.
    #[inline(always)]
    pub fn x_at(&self, y: f64) -> f64 {
        self.x_by(self.slope(), y)
    }

    /// The same by its [`slope`](Edge::slope), for whoever knows it.
    #[inline(always)]
    pub fn x_by(&self, slope: f64, y: f64) -> f64 {
        let x = self.top.x + (y - self.top.y) * slope;
        x.max(self.top.x.min(self.bottom.x)).min(self.top.x.max(self.bottom.x))
    }
}

impl FaceTable {
    /// The faces, by ascending ordinal.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// The rings of a face, each as its corners in pixels.
    pub fn rings<'a>(&'a self, face: &Face) -> impl Iterator<Item = Ring<'a>> + 'a {
        let first = face.first_corner as usize;
        let mut rest = &self.corners[first..first + face.corners as usize];
        std::iter::from_fn(move || {
            let end = rest.iter().position(|corner| corner & END_OF_RING != 0)?;
            let (ring, tail) = rest.split_at(end + 1);
            rest = tail;
            Some(Ring { corners: ring, points: &self.points })
        })
    }

    pub(super) fn trees(&self) -> &Trees {
        &self.trees
    }

    /// All edges of a face's rings.
    pub fn edges<'a>(&'a self, face: &Face) -> impl Iterator<Item = Edge> + 'a {
        self.rings(face).flat_map(|ring| ring.edges())
    }

    /// The edges of a face's rings that cross the line at `y`.
    pub fn crossing<'a>(&'a self, face: &Face, y: f64) -> impl Iterator<Item = Edge> + 'a {
        self.rings(face).flat_map(move |ring| ring.crossing(y))
    }

    /// How many corners a face has, in all its rings.
    pub fn corner_count(&self, face: &Face) -> usize {
        face.corners as usize
    }

    /// The only ring of a face that has one.
    pub fn outline(&self, face: &Face) -> Ring<'_> {
        let first = face.first_corner as usize;
        Ring { corners: &self.corners[first..first + face.corners as usize], points: &self.points }
    }

    /// The corners of a face's rings as places among the table's [`points`](FaceTable::points), each with
    /// whether it is its ring's last.
    pub(crate) fn corners(&self, face: &Face) -> impl Iterator<Item = (u32, bool)> + '_ {
        let first = face.first_corner as usize;
        let corners = &self.corners[first..first + face.corners as usize];
        corners.iter().map(|corner| (corner & !END_OF_RING, corner & END_OF_RING != 0))
    }

    /// All points on the screen, in pixels.
    pub(crate) fn points(&self) -> &[DVec2] {
        &self.points
    }

    /// Only the faces at the places `keep`, which ascend, and the points that they use. The faces that
    /// seals lie on must be among them.
    pub(super) fn only(&self, keep: &[u32]) -> Result<FaceTable> {
        let mut points = vec![u32::MAX; self.points.len()];
        let mut table = FaceTableBuilder::new();
        for place in keep {
            let face = &self.faces[*place as usize];
            let mut ring = Vec::new();
            let mut rings = Vec::new();
            for (point, is_last) in self.corners(face) {
                let known = &mut points[point as usize];
                if *known == u32::MAX {
                    *known = table.points([self.points[point as usize]])?;
                }
                ring.push(*known);
                if is_last {
                    rings.push(std::mem::take(&mut ring));
                }
            }
            let role = match face.role {
                Role::Seal(parent) => Role::Seal(keep.partition_point(|p| *p < parent) as u32),
                other => other,
            };
            table.face(FaceHead { role, ..face.head() }, rings.iter().map(Vec::as_slice))?;
        }
        Ok(table.finish())
    }

    /// A face by its ordinal.
    pub fn by_ordinal(&self, ordinal: u32) -> Option<&Face> {
        let at = self.faces.binary_search_by_key(&ordinal, |face| face.ordinal).ok()?;
        Some(&self.faces[at])
    }

    /// The table with all planes and points changed.
    ///
    /// # Errors
    /// If a coefficient of a plane is not finite any more.
    pub(super) fn changed(
        table: &FaceTable,
        plane: impl Fn(&Plane) -> Plane,
        point: impl Fn(DVec2) -> DVec2,
    ) -> Result<FaceTable> {
        let mut changed = FaceTable { trees: Trees::default(), ..table.clone() };
        changed.points.iter_mut().for_each(|p| *p = point(*p));
        for face in &mut changed.faces {
            face.plane = check_plane(plane(&face.plane), face.ordinal)?;
        }
        Ok(changed)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.faces) + size_of_val(&*self.corners) + size_of_val(&*self.points)
    }
}

/// A closed ring of corners.
#[derive(Clone, Copy, Debug)]
pub struct Ring<'a> {
    corners: &'a [u32],
    points: &'a [DVec2],
}

impl<'a> Ring<'a> {
    /// The number of corners.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.corners.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// A corner in pixels.
    #[inline(always)]
    pub fn point(&self, i: usize) -> DVec2 {
        self.points[(self.corners[i] & !END_OF_RING) as usize]
    }

    /// The corners in order.
    pub fn points(self) -> impl Iterator<Item = DVec2> + 'a {
        self.corners.iter().map(move |corner| self.points[(corner & !END_OF_RING) as usize])
    }

    /// The edges that cross the line at `y`, as [`Edge::crosses`] says.
    pub fn crossing(self, y: f64) -> impl Iterator<Item = Edge> + 'a {
        let mut previous = self.corners.last().map_or(DVec2::ZERO, |_| self.point(self.len() - 1));
        self.points().filter_map(move |point| {
            let from = std::mem::replace(&mut previous, point);
            ((from.y <= y) != (point.y <= y)).then(|| Edge::new(from, point))
        })
    }

    /// The edges in order, the closing one first.
    pub fn edges(self) -> impl Iterator<Item = Edge> + 'a {
        let mut previous = self.corners.last().map(|_| self.point(self.len() - 1));
        self.points().map(move |point| {
            let from = previous.replace(point).unwrap_or(point);
            Edge::new(from, point)
        })
    }
}

/// Builds a [`FaceTable`].
#[derive(Debug, Default)]
pub struct FaceTableBuilder {
    table: FaceTable,
    /// Points that the finished table will have before this builder's own.
    shared: u32,
}

/// What a builder is told of a face, beside its rings.
#[derive(Clone, Copy, Debug)]
pub struct FaceHead {
    /// The face's number in its source; must exceed the previous one's.
    pub ordinal: u32,
    /// Depth over the screen.
    pub plane: Plane,
    /// Decides between equal depths.
    pub rank: u32,
    /// What it is.
    pub role: Role,
    /// Whether its front is seen.
    pub sees_front: bool,
    /// Whether it lets through what lies behind it.
    pub is_translucent: bool,
}

impl FaceTableBuilder {
    /// An empty table.
    pub fn new() -> FaceTableBuilder {
        FaceTableBuilder::default()
    }

    /// A part of a table, to be [appended](FaceTableBuilder::append) where `shared` points stand
    /// already, which its faces may use as the points 0 to `shared`.
    pub fn over(shared: u32) -> FaceTableBuilder {
        FaceTableBuilder { shared, ..FaceTableBuilder::default() }
    }

    /// Whether no face was added.
    pub fn is_empty(&self) -> bool {
        self.table.faces.is_empty()
    }

    /// Adds points on the screen, in pixels, and returns the index of the first.
    ///
    /// # Errors
    /// If the table is full (2^31 points).
    pub fn points(&mut self, points: impl IntoIterator<Item = DVec2>) -> Result<u32> {
        let first = self.table.points.len() + self.shared as usize;
        self.table.points.extend(points);
        if self.table.points.len() + self.shared as usize >= END_OF_RING as usize {
            return Err(Error::invalid("a source with more than 2^31 vertices: divide the scene"));
        }
        Ok(first as u32)
    }

    /// Appends a part whose shared points begin at `base` of this table's points.
    ///
    /// # Errors
    /// If the table is full.
    pub fn append(&mut self, part: FaceTableBuilder, base: u32) -> Result<()> {
        let FaceTableBuilder { table: part, shared } = part;
        let own = self.points(part.points)?;
        let (corners, places) = (self.table.corners.len(), self.table.faces.len());
        if corners + part.corners.len() > u32::MAX as usize {
            return Err(Error::invalid("a source with more than 2^32 corners: divide the scene"));
        }
        self.table.corners.extend(part.corners.iter().map(|corner| {
            let (point, end) = (corner & !END_OF_RING, corner & END_OF_RING);
            end | if point < shared { base + point } else { own + (point - shared) }
        }));
        self.table.faces.extend(part.faces.into_iter().map(|mut face| {
            face.first_corner += corners as u32;
            if let Role::Seal(parent) = &mut face.role {
                *parent += places as u32;
            }
            face
        }));
        Ok(())
    }

    /// Adds a face with the rings given as indices of points; returns its place in the table.
    ///
    /// # Errors
    /// If a coefficient of its plane is not finite, ordinals do not increase, a seal lies on no face
    /// before it, or the table is full.
    pub fn face<'r>(
        &mut self,
        head: FaceHead,
        rings: impl IntoIterator<Item = &'r [u32]>,
    ) -> Result<u32> {
        let FaceHead { ordinal, plane, rank, role, sees_front, is_translucent } = head;
        let plane = check_plane(plane, ordinal)?;
        if self.table.faces.last().is_some_and(|last| last.ordinal >= ordinal) {
            return Err(Error::invalid("faces must be added by ascending ordinal"));
        }
        if let Role::Seal(parent) = role {
            let under = self.table.faces.get(parent as usize).map(|face| face.role);
            if under != Some(Role::Face) {
                return Err(Error::invalid(format!(
                    "the seal {ordinal} lies on no face before it"
                )));
            }
        }
        let first_corner = self.table.corners.len();
        let mut ring_count = 0;
        for ring in rings.into_iter().filter(|ring| ring.len() >= 3) {
            self.table.corners.extend_from_slice(ring);
            if let Some(last) = self.table.corners.last_mut() {
                *last |= END_OF_RING;
            }
            ring_count += 1;
        }
        let corners = self.table.corners.len() - first_corner;
        let place = self.table.faces.len() as u32;
        if place == u32::MAX || self.table.corners.len() > u32::MAX as usize {
            return Err(Error::invalid("a source with more than 2^32 corners: divide the scene"));
        }
        self.table.faces.push(Face {
            ordinal,
            plane,
            rank,
            role,
            sees_front,
            is_translucent,
            is_monotone: ring_count == 1 && role == Role::Face,
            first_corner: first_corner as u32,
            corners: corners as u32,
        });
        Ok(place)
    }

    /// The finished table.
    pub fn finish(self) -> FaceTable {
        let FaceTable { mut faces, corners, points, .. } = self.table;
        faces.par_iter_mut().filter(|face| face.is_monotone && face.corners > 3).for_each(|face| {
            let first = face.first_corner as usize;
            let corners = &corners[first..first + face.corners as usize];
            face.is_monotone = is_monotone(Ring { corners, points: &points });
        });
        FaceTable { faces, corners, points, trees: Trees::default() }
    }

    /// The union of two tables of one source, by ordinal, and the place in it of each face of either.
    pub(super) fn union(a: &FaceTable, b: &FaceTable) -> Result<(FaceTable, [Vec<u32>; 2])> {
        let tables = [a, b];
        let mut union = FaceTableBuilder::new();
        let mut offsets = [0; 2];
        for (offset, table) in offsets.iter_mut().zip(tables) {
            *offset = union.points(table.points.iter().copied())?;
        }
        let mut all: Vec<(u32, usize, usize)> = Vec::new();
        for (t, table) in tables.into_iter().enumerate() {
            all.extend(
                table.faces.iter().enumerate().map(|(place, face)| (face.ordinal, t, place)),
            );
        }
        all.sort_unstable();
        let mut places = tables.map(|table| vec![0; table.faces.len()]);
        let mut last = None;
        for (ordinal, t, place) in all {
            if last != Some(ordinal) {
                let face = &tables[t].faces[place];
                let role = match face.role {
                    Role::Seal(parent) => Role::Seal(places[t][parent as usize]),
                    other => other,
                };
                let rings: Vec<Vec<u32>> = tables[t]
                    .rings(face)
                    .map(|ring| {
                        ring.corners.iter().map(|c| (c & !END_OF_RING) + offsets[t]).collect()
                    })
                    .collect();
                let head = FaceHead { role, ..face.head() };
                union.face(head, rings.iter().map(Vec::as_slice))?;
            }
            places[t][place] = union.table.faces.len() as u32 - 1;
            last = Some(ordinal);
        }
        Ok((union.finish(), places))
    }
}

/// A plane whose coefficients can be compared without overflow.
fn check_plane(plane: Plane, ordinal: u32) -> Result<Plane> {
    let extreme = |v: f64| !v.is_finite() || v.abs() > MAX_COEFFICIENT;
    if extreme(plane.a) || extreme(plane.b) || extreme(plane.c) {
        return Err(Error::invalid(format!("face {ordinal} has no finite depth: {plane:?}")));
    }
    Ok(plane)
}

/// Whether every line crosses a ring at most twice: along y it goes down once and up once.
fn is_monotone(ring: Ring<'_>) -> bool {
    let n = ring.len();
    let mut changes = 0;
    let mut previous = None;
    let mut first = None;
    for i in 0..n {
        let step = ring.point((i + 1) % n).y - ring.point(i).y;
        if step != 0.0 {
            let down = step > 0.0;
            changes += usize::from(previous.is_some_and(|p| p != down));
            previous = Some(down);
            first = first.or(Some(down));
        }
    }
    changes += usize::from(previous != first);
    changes <= 2
}

#[cfg(test)]
mod tests {
    use super::*;

    fn monotone(points: &[(f64, f64)]) -> bool {
        let points: Vec<DVec2> = points.iter().map(|p| DVec2::new(p.0, p.1)).collect();
        let corners: Vec<u32> = (0..points.len() as u32).collect();
        is_monotone(Ring { corners: &corners, points: &points })
    }

    #[test]
    fn rings_that_lines_cross_once_are_told_from_others() {
        assert!(monotone(&[(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)]));
        assert!(!monotone(&[(0.0, 0.0), (2.0, 1.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)]));
        assert!(!monotone(&[(0.0, 0.0), (4.0, 4.0), (4.0, 0.0), (0.0, 4.0)]));
    }

    #[test]
    fn neighbours_agree_about_their_edge() {
        let (p, q) = (DVec2::new(0.1, 0.7), DVec2::new(9.3, 5.2));
        for y in [0.7, 1.0, 3.33, 5.1] {
            assert_eq!(Edge::new(p, q).x_at(y).to_bits(), Edge::new(q, p).x_at(y).to_bits());
        }
    }

    #[test]
    fn an_edge_of_no_height_stays_between_its_ends() {
        let edge = Edge::new(DVec2::new(-1e300, 0.0), DVec2::new(1e300, f64::from_bits(1)));
        assert!((-1e300..=1e300).contains(&edge.x_at(0.0)));
    }
}
