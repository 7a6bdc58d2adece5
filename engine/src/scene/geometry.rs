//! Meshes made ready for rendering: every face planar, every attribute affine on it, every plane
//! known.
//!
//! - A face whose outline crosses itself, or whose holes overlap, cross the outline or lie outside, becomes
//!   what is there of it (`polygon::areas`): one face or several, of which that can be said no more.
//! - A polygon whose corners leave its plane by more than [`PLANARITY`] of its size, or whose vertex
//!   attributes are not affine on it, is divided into triangles. One with seals or drawn edges stays
//!   whole and is taken as flat.
//! - Faces in one plane share one *support*, so that faces that coincide tie bit for bit and the
//!   documented order decides, not noise.
//! - Corners that repeat, and faces without area, are dropped.
//!
//! What was changed is counted and told.

mod planes;

use glam::{DAffine3, DVec3};
use std::sync::OnceLock;

use super::face::Face;
use super::mesh::Mesh;
use crate::error::{Error, Result};
use crate::math;
use crate::polygon::{self, Area, Corner};

/// How far a polygon's corners may leave its plane, as a share of its diameter. Its outline on the
/// picture stays exact; only depth is off, by no more than this.
pub const PLANARITY: f64 = 1e-3;

/// How far apart two faces' planes may be, as a share of the mesh's diameter, to count as one: the
/// noise of single-precision coordinates.
const COPLANARITY: f64 = 1e-7;

/// How far vertex attributes may leave the affine, in their own units.
const AFFINITY: f32 = 1e-3;

const TURNED: u32 = 1 << 31;

/// A face's plane in the object's space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Support {
    /// A point on it.
    pub point: DVec3,
    /// Its unit normal, to the front.
    pub normal: DVec3,
}

/// A mesh made ready.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    mesh: Mesh,
    supports: Vec<Support>,
    /// Which support is each face's, with [`TURNED`] where the face's front is on its other side.
    support_of: Vec<u32>,
    /// Where each face's parts begin, and the end; absent where every face is one part.
    parts: Option<Vec<u32>>,
    faults: Faults,
    /// The least and the greatest coordinates of what its faces use.
    bounds: Option<[DVec3; 2]>,
    body: OnceLock<i8>,
}

/// What had to be changed in a mesh to make it ready.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    /// Faces without area, dropped.
    pub without_area: usize,
    /// Faces whose rings cross, replaced by what is there of them.
    pub crossing: usize,
    /// Polygons that are not planar, divided into triangles.
    pub not_planar: usize,
    /// Polygons that are not planar but carry seals or drawn edges, taken as flat.
    pub flattened: usize,
    /// The farthest that a corner leaves its polygon's plane, in metres.
    pub worst_deviation: f64,
    /// Polygons whose vertex attributes are not affine, divided into triangles.
    pub not_affine: usize,
}

/// A part of a face: what gets an entry of its own in a span image's table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The face itself.
    Face,
    /// Its drawn edges.
    FaceEdges,
    /// A seal, by its index.
    Seal(u32),
    /// A seal's drawn edges.
    SealEdges(u32),
}

impl Part {
    /// Decides between parts of coinciding depth: a seal is over its face and earlier seals, drawn
    /// edges are over what they belong to.
    pub fn rank(self) -> u32 {
        match self {
            Part::Face => 0,
            Part::FaceEdges => 1,
            Part::Seal(i) => 2 * i + 2,
            Part::SealEdges(i) => 2 * i + 3,
        }
    }
}

impl Geometry {
    /// Makes a mesh ready.
    ///
    /// # Errors
    /// If the mesh has numbers that are not finite or lists of unequal length.
    pub fn new(mesh: &Mesh) -> Result<Geometry> {
        mesh.validate()?;
        if let Some(bounds) = bounds(mesh) {
            check_size(bounds)?;
        }
        let mut faults = Faults::default();
        // 1. Faces become planar and affine. 2. Faces of one plane get one support. 3. Parts are
        // numbered. Supports come second, as dividing a face makes new planes.
        let mesh = flat_and_affine(mesh, &mut faults)?;
        let (supports, support_of) = planes::shared(&mesh);
        let bounds = bounds(&mesh);
        let mut geometry =
            Geometry { mesh, supports, support_of, faults, bounds, ..Geometry::default() };
        if geometry.mesh.has_parts() {
            let mut first = 0;
            let counts =
                (0..geometry.mesh.face_count()).map(|at| geometry.parts_of(at).count() as u32);
            let mut parts = vec![0];
            for count in counts {
                first += count;
                parts.push(first);
            }
            geometry.parts = Some(parts);
        }
        Ok(geometry)
    }

    /// The mesh, with every face planar and every attribute affine.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The different planes of all faces.
    pub fn supports(&self) -> &[Support] {
        &self.supports
    }

    /// The place of a face's plane in [`supports`](Geometry::supports), and whether the face's front is
    /// on the side that the plane's normal points to.
    #[inline]
    pub fn support_of(&self, face: usize) -> (usize, bool) {
        let support = self.support_of[face];
        ((support & !TURNED) as usize, support & TURNED == 0)
    }

    /// The unit normal of a face's front, in the object's space.
    #[inline]
    pub fn normal(&self, face: usize) -> DVec3 {
        let (support, is_front) = self.support_of(face);
        let normal = self.supports[support].normal;
        if is_front { normal } else { -normal }
    }

    /// The plane in which a face is seen, if corners leave it by more than their noise.
    pub fn left_plane(&self, face: usize) -> Option<Support> {
        let support = self.supports[self.support_of(face).0];
        let holes = self.mesh.holes(face).iter().flatten();
        let corners = self.mesh.outline(face).iter().chain(holes);
        let (off, reach) = corners.fold((0.0f64, 0.0f64), |(off, reach), corner| {
            let from = self.mesh.points[*corner as usize] - support.point;
            (off.max(from.dot(support.normal).abs()), reach.max(from.length()))
        });
        // A tenth of what makes two planes one: what is less is rounding of the coordinates.
        (off > reach * COPLANARITY / 10.0).then_some(support)
    }

    /// A face in convex pieces that cover it, holes left out: itself, or triangles. Corners are vertices of
    /// the mesh.
    pub fn pieces(&self, at: usize, mut piece: impl FnMut(&[u32])) {
        let mesh = &self.mesh;
        let outline = mesh.outline(at);
        if mesh.holes(at).is_empty() && is_convex(mesh, outline, self.normal(at)) {
            piece(outline);
        // Convex faces stay whole: rays then meet no edges inside of them.
        } else if let Some(face) = mesh.face(at) {
            let normal = self.normal(at);
            triangles(mesh, &face, normal).iter().for_each(|triangle| piece(triangle));
        }
    }

    /// Whether its faces close a body: every edge belongs to two that run it in opposite directions. 1 if
    /// they look outwards, -1 if inwards, 0 if they close none.
    pub fn body(&self) -> i8 {
        *self.body.get_or_init(|| {
            let mesh = &self.mesh;
            let rings = (0..mesh.face_count()).flat_map(|face| {
                let holes = mesh.holes(face).iter().map(Vec::as_slice);
                std::iter::once(mesh.outline(face)).chain(holes)
            });
            let points = |ring| <[u32]>::iter(ring).map(|corner| mesh.points[*corner as usize]);
            let volume = polygon::volume(rings.map(points));
            match volume {
                Some(volume) if volume > 0.0 => 1,
                Some(volume) if volume < 0.0 => -1,
                _ => 0,
            }
        })
    }

    /// Whether the mesh, placed in the world, has a size that is handled exactly.
    ///
    /// # Errors
    /// If it reaches too far from the origin or is too small.
    pub fn check_place(&self, world: &DAffine3) -> Result<()> {
        let Some([low, high]) = self.bounds else { return Ok(()) };
        // The box of the placed box is larger than that of the placed points, if it is turned. It
        // is cheap, and only orders of magnitude matter here.
        let corner = |i: usize| {
            let pick = |axis: usize| if i >> axis & 1 == 1 { high[axis] } else { low[axis] };
            world.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
        };
        let corners = || (0..8).map(corner);
        let low = corners().fold(DVec3::INFINITY, DVec3::min);
        let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        check_size([low, high])
    }

    /// Bytes held, about.
    pub fn bytes(&self) -> usize {
        self.mesh.bytes()
            + size_of_val(&*self.supports)
            + size_of_val(&*self.support_of)
            + self.parts.as_ref().map_or(0, |parts| size_of_val(&**parts))
    }

    /// What was changed.
    pub fn faults(&self) -> Faults {
        self.faults
    }

    /// The parts of a face, in the order of their numbers.
    pub fn parts_of(&self, face: usize) -> impl Iterator<Item = Part> + '_ {
        let edges = self.mesh.edge(face).map(|_| Part::FaceEdges);
        let seals = self.mesh.seals(face).iter().enumerate().flat_map(|(i, seal)| {
            let edges = seal.edge.map(|_| Part::SealEdges(i as u32));
            std::iter::once(Part::Seal(i as u32)).chain(edges)
        });
        std::iter::once(Part::Face).chain(edges).chain(seals)
    }

    /// The number of parts of all faces.
    pub fn part_count(&self) -> u32 {
        match &self.parts {
            Some(parts) => parts.last().copied().unwrap_or(0),
            None => self.mesh.face_count() as u32,
        }
    }

    /// The number of a face's first part.
    #[inline]
    pub fn first_part(&self, face: usize) -> u32 {
        self.parts.as_ref().map_or(face as u32, |parts| parts[face])
    }

    /// The face and part of a number below [`part_count`](Geometry::part_count).
    pub fn part(&self, number: u32) -> (usize, Part) {
        match &self.parts {
            None => (number as usize, Part::Face),
            Some(parts) => {
                let face = parts.partition_point(|first| *first <= number) - 1;
                let part = self.parts_of(face).nth((number - parts[face]) as usize);
                (face, part.expect("a number below the count of parts names a part"))
            }
        }
    }
}

/// The least and the greatest coordinates of the corners of faces; `None` if there are none.
fn bounds(mesh: &Mesh) -> Option<[DVec3; 2]> {
    let corners = (0..mesh.face_count()).flat_map(|at| mesh.outline(at));
    let points = corners.map(|corner| mesh.points[*corner as usize]);
    points.fold(None, |bounds, p| {
        let [low, high] = bounds.unwrap_or([p, p]);
        Some([low.min(p), high.max(p)])
    })
}

/// Whether what takes so much space is handled exactly.
fn check_size([low, high]: [DVec3; 2]) -> Result<()> {
    let far = low.abs().max(high.abs()).max_element();
    let size = (high - low).max_element();
    if far.is_nan() || far > math::REACH {
        return Err(Error::invalid(format!(
            "it reaches {far:.1e} m from the origin, and what lies beyond {:e} m is not exact: make it \
             smaller or put it nearer",
            math::REACH
        )));
    }
    if size > 0.0 && size < 1.0 / math::REACH {
        return Err(Error::invalid(format!(
            "it is {size:.1e} m large, and what is smaller than {:e} m is not exact: make it larger",
            1.0 / math::REACH
        )));
    }
    Ok(())
}

fn flat_and_affine(mesh: &Mesh, faults: &mut Faults) -> Result<Mesh> {
    let mut flat = Mesh {
        points: mesh.points.clone(),
        normals: mesh.normals.clone(),
        uvs: mesh.uvs.clone(),
        colors: mesh.colors.clone(),
        materials: mesh.materials.clone(),
        ..Mesh::default()
    };
    let attributes = !(mesh.normals.is_empty() && mesh.uvs.is_empty() && mesh.colors.is_empty());
    let mut outline = Vec::new();
    for at in 0..mesh.face_count() {
        // A corner that repeats makes an edge without direction.
        without_repeats(mesh, mesh.outline(at), &mut outline);
        let points = || outline.iter().map(|corner| mesh.points[*corner as usize]);
        // The normal is the area's, summed over all edges. Three corners of a polygon may be in
        // line.
        let Some(normal) = polygon::plane_normal(points()) else {
            faults.without_area += 1;
            continue;
        };
        // A triangle is planar and affine by nature. Most meshes have nothing else.
        if outline.len() == 3 && mesh.is_plain(at) {
            flat.add_polygon(&outline, mesh.sides(at).front)?;
            continue;
        }
        let mut face = mesh.face(at).unwrap_or_default();
        face.outline.clone_from(&outline);
        face.holes.retain_mut(|hole| {
            without_repeats(mesh, &hole.clone(), hole);
            hole.len() >= 3
        });
        let is_plain = face.holes.is_empty() && is_convex(mesh, &face.outline, normal);
        let areas = if is_plain { None } else { areas(&mut flat, &face, normal) };
        faults.crossing += usize::from(areas.is_some());
        for face in areas.unwrap_or_else(|| vec![face]) {
            let deviation = deviation(&flat, &face, normal);
            faults.worst_deviation = faults.worst_deviation.max(deviation.0);
            let is_planar = deviation.0 <= PLANARITY * deviation.1;
            let is_affine = !attributes || is_affine(&flat, &face, normal);
            // Triangles would each need a piece of a seal, and edges would be drawn along the
            // diagonals.
            let is_whole = !face.seals.is_empty() || face.edge.is_some();
            match (is_planar, is_affine) {
                (true, true) => {
                    flat.add_face(face)?;
                }
                (false, _) if is_whole => {
                    faults.flattened += 1;
                    flat.add_face(face)?;
                }
                (true, false) if is_whole => {
                    flat.add_face(face)?;
                }
                (is_planar, _) => {
                    faults.not_planar += usize::from(!is_planar);
                    faults.not_affine += usize::from(is_planar);
                    for outline in triangles(&flat, &face, normal) {
                        let sides = face.sides;
                        let outline = outline.to_vec();
                        flat.add_face(Face { outline, sides, ..Face::default() })?;
                    }
                }
            }
        }
    }
    Ok(flat)
}

/// The corners of a face's rings, and where those of holes begin.
fn rings_of(face: &Face) -> (Vec<u32>, Vec<u32>) {
    let mut corners = face.outline.clone();
    let mut holes: Vec<u32> = Vec::new();
    for hole in &face.holes {
        holes.push(corners.len() as u32);
        corners.extend_from_slice(hole);
    }
    (corners, holes)
}

/// What is there of a face whose rings cross, as faces of their own; points at which edges cross are added to the
/// mesh. `None` if none do.
fn areas(mesh: &mut Mesh, face: &Face, normal: DVec3) -> Option<Vec<Face>> {
    let (corners, holes) = rings_of(face);
    let points: Vec<DVec3> = corners.iter().map(|c| mesh.points[*c as usize]).collect();
    let areas = polygon::areas(&points, &holes, normal)?;
    let frame = Frame::new(mesh, &face.outline, normal);
    let mut made: Vec<(DVec3, u32)> = Vec::new();
    let mut corner = |corner: Corner| match corner {
        Corner::Given(at) => corners[at as usize],
        // A crossing is a corner of several areas. They must share its vertex, bit for bit.
        Corner::Made(point) => match made.iter().find(|(known, _)| *known == point) {
            Some((_, at)) => *at,
            None => {
                let at = frame.add_point(mesh, point);
                made.push((point, at));
                at
            }
        },
    };
    let mut ring = |ring: Vec<Corner>| -> Vec<u32> { ring.into_iter().map(&mut corner).collect() };
    let area = |area: Area| Face {
        outline: ring(area.outline),
        holes: area.holes.into_iter().map(&mut ring).collect(),
        ..face.clone()
    };
    Some(areas.into_iter().map(area).collect())
}

fn without_repeats(mesh: &Mesh, corners: &[u32], out: &mut Vec<u32>) {
    let at = |corner: u32| mesh.points[corner as usize];
    out.clear();
    for corner in corners {
        if out.last().is_none_or(|last| at(*last) != at(*corner)) {
            out.push(*corner);
        }
    }
    // Many formats close a ring by saying its first corner again.
    while out.len() > 1 && at(out[0]) == at(out[out.len() - 1]) {
        out.pop();
    }
}

/// How far the corners of a face leave its plane, and the face's diameter.
fn deviation(mesh: &Mesh, face: &Face, normal: DVec3) -> (f64, f64) {
    let rings = std::iter::once(&face.outline).chain(&face.holes);
    let points: Vec<DVec3> = rings.flatten().map(|corner| mesh.points[*corner as usize]).collect();
    let outline = &points[..face.outline.len()];
    let centre = outline.iter().sum::<DVec3>() / outline.len() as f64;
    let off = points.iter().map(|p| (*p - centre).dot(normal).abs()).fold(0.0, f64::max);
    (off, extent(&points))
}

/// The diagonal of the box around points.
fn extent(points: &[DVec3]) -> f64 {
    let low = points.iter().fold(DVec3::INFINITY, |low, p| low.min(*p));
    let high = points.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
    if points.is_empty() { 0.0 } else { (high - low).length() }
}

/// Three corners of a polygon that span it well, and the weights with which they give a point of its
/// plane.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// The corners, as vertices of the mesh.
    pub corners: [u32; 3],
    origin: DVec3,
    u: DVec3,
    v: DVec3,
}

impl Frame {
    /// The frame of a polygon with a normal.
    pub fn new(mesh: &Mesh, outline: &[u32], normal: DVec3) -> Frame {
        let at = |corner: u32| mesh.points[corner as usize];
        let first = outline[0];
        let far = |from: &dyn Fn(DVec3) -> f64| {
            let best = outline.iter().max_by(|p, q| from(at(**p)).total_cmp(&from(at(**q))));
            best.copied().unwrap_or(first)
        };
        // Far corners make a well-conditioned basis: neighbours may be a hair apart or in line with
        // the first.
        let second = far(&|p| p.distance_squared(at(first)));
        let along = at(second) - at(first);
        let third = if outline.len() == 3 {
            outline.iter().copied().find(|c| *c != first && *c != second).unwrap_or(second)
        } else {
            far(&|p| along.cross(p - at(first)).dot(normal).abs())
        };
        let (p, q) = (along, at(third) - at(first));
        // The dual basis: u . p = 1, u . q = 0, and the other way round.
        let across = p.cross(q);
        let area = across.length_squared();
        let (u, v) = if area > 0.0 {
            (q.cross(across) / area, across.cross(p) / area)
        } else {
            // Without area the first corner has all the weight, and nothing becomes NaN.
            (DVec3::ZERO, DVec3::ZERO)
        };
        Frame { corners: [first, second, third], origin: at(first), u, v }
    }

    /// The weights of the three corners at a point of the plane; they sum to 1.
    pub fn exact_weights(&self, point: DVec3) -> [f64; 3] {
        let from = point - self.origin;
        let (s, t) = (from.dot(self.u), from.dot(self.v));
        [1.0 - s - t, s, t]
    }

    /// Adds a point of the plane to the mesh, with the attributes that the three corners give it; returns its
    /// number.
    fn add_point(&self, mesh: &mut Mesh, point: DVec3) -> u32 {
        let weights = self.weights(point);
        let [a, b, c] = self.corners.map(|corner| corner as usize);
        let [u, v, w] = weights;
        if !mesh.normals.is_empty() {
            let normal = mesh.normals[a] * u + mesh.normals[b] * v + mesh.normals[c] * w;
            mesh.normals.push(normal);
        }
        if !mesh.uvs.is_empty() {
            mesh.uvs.push(mesh.uvs[a] * u + mesh.uvs[b] * v + mesh.uvs[c] * w);
        }
        if !mesh.colors.is_empty() {
            let [p, q, r] = [a, b, c].map(|corner| mesh.colors[corner]);
            mesh.colors.push(std::array::from_fn(|i| p[i] * u + q[i] * v + r[i] * w));
        }
        mesh.points.push(point);
        mesh.points.len() as u32 - 1
    }

    /// The same in single precision.
    #[inline]
    pub fn weights(&self, point: DVec3) -> [f32; 3] {
        self.exact_weights(point).map(|weight| weight as f32)
    }
}

fn is_affine(mesh: &Mesh, face: &Face, normal: DVec3) -> bool {
    let frame = Frame::new(mesh, &face.outline, normal);
    let [a, b, c] = frame.corners.map(|corner| corner as usize);
    let rings = std::iter::once(&face.outline).chain(&face.holes);
    rings.flatten().all(|corner| {
        let at = *corner as usize;
        let w = frame.weights(mesh.points[at]);
        let near = |values: [f32; 4]| {
            (values[0] * w[0] + values[1] * w[1] + values[2] * w[2] - values[3]).abs() <= AFFINITY
        };
        let four = |i: usize| [a, b, c, at].map(|k| mesh.colors[k][i]);
        (mesh.normals.is_empty() || (0..3).all(|i| near([a, b, c, at].map(|k| mesh.normals[k][i]))))
            && (mesh.uvs.is_empty() || (0..2).all(|i| near([a, b, c, at].map(|k| mesh.uvs[k][i]))))
            && (mesh.colors.is_empty() || (0..4).all(|i| near(four(i))))
    })
}

/// Whether an outline turns to the left at every corner, and once round in all.
fn is_convex(mesh: &Mesh, outline: &[u32], normal: DVec3) -> bool {
    let count = outline.len();
    if count == 3 {
        return true;
    }
    let at = |i: usize| mesh.points[outline[i % count] as usize];
    let turns = (0..count).map(|i| (at(i + 1) - at(i)).cross(at(i + 2) - at(i + 1)).dot(normal));
    // A star turns left at every corner too, but not seen from its first; nor does what comes back to that.
    let fan = (1..count - 1).map(|i| (at(i) - at(0)).cross(at(i + 1) - at(0)).dot(normal));
    turns.chain(fan).all(|turn| turn >= 0.0) && (1..count).all(|i| at(i) != at(0))
}

/// A face whose rings do not cross, divided into triangles.
fn triangles(mesh: &Mesh, face: &Face, normal: DVec3) -> Vec<[u32; 3]> {
    let (corners, holes) = rings_of(face);
    let points: Vec<DVec3> = corners.iter().map(|c| mesh.points[*c as usize]).collect();
    let corner = |corner: Corner| match corner {
        Corner::Given(at) => Some(corners[at as usize]),
        // Where nothing crosses no point is made.
        Corner::Made(_) => None,
    };
    let triangles = polygon::triangles(&points, &holes, normal).into_iter();
    triangles.filter_map(|[a, b, c]| Some([corner(a)?, corner(b)?, corner(c)?])).collect()
}
