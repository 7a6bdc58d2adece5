//! From a scene to the faces of a span image: project, cut, compute planes, leave out what no line can
//! meet.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::FRAC_1_SQRT_2;

use super::Cluster;
use crate::camera::{Homogeneous, Plane, View};
use crate::error::Result;
use crate::raster::LinePlan;
use crate::scene::{Geometry, Instance, Part, Scene, surfaces::normal_matrix};
use crate::span::{FaceHead, FaceTable, FaceTableBuilder, Role};
use crate::visible::clip::Guard;
use crate::watch::Watch;

/// Faces in one task.
const CHUNK: usize = 8192;

/// The faces of a scene over a view: a function of the scene, the view and the line plan alone.
///
/// # Errors
/// If the scene has more corners than a table holds.
pub fn face_table(cluster: &Cluster, view: &View, plan: LinePlan) -> Result<FaceTable> {
    let Cluster { scene, priority, layered, .. } = cluster;
    let watch = Watch::current();
    let parts: Vec<(Vec<DVec2>, Vec<FaceTableBuilder>)> = scene
        .instances
        .par_iter()
        .map(|instance| {
            watch.check()?;
            let setup = Setup::new(scene, *priority, instance, view, plan);
            Setup { layered: *layered, ..setup }.faces(&watch)
        })
        .collect::<Result<_>>()?;
    // Put together in the scene's order, whoever was ready first: faces ascend by ordinal, and the
    // table is the same bit for bit.
    let mut table = FaceTableBuilder::new();
    for (points, chunks) in parts {
        if chunks.iter().all(FaceTableBuilder::is_empty) {
            continue;
        }
        let base = table.points(points)?;
        for chunk in chunks {
            table.append(chunk, base)?;
        }
    }
    Ok(table.finish())
}

/// An instance on the screen.
struct Setup<'a> {
    scene: &'a Scene,
    instance: &'a Instance,
    geometry: &'a Geometry,
    view: &'a View,
    plan: LinePlan,
    guard: Guard,
    /// The vertices in homogeneous screen coordinates.
    vertices: Vec<Homogeneous>,
    /// Whether all faces are solved as those that let through what lies behind them.
    layered: bool,
    /// Of every support: its depth over the screen, and whether its normal faces the viewer.
    planes: Vec<(Plane, bool)>,
}

/// The extent of a face on the screen.
#[derive(Clone, Copy)]
struct Extent {
    low: DVec2,
    high: DVec2,
    nearest: f64,
    farthest: f64,
}

impl Extent {
    const EMPTY: Extent = Extent {
        low: DVec2::INFINITY,
        high: DVec2::NEG_INFINITY,
        nearest: f64::NEG_INFINITY,
        farthest: f64::INFINITY,
    };

    /// The same with so many pixels around it.
    fn grown(self, pixels: f64) -> Extent {
        Extent { low: self.low - pixels, high: self.high + pixels, ..self }
    }

    #[inline(always)]
    fn add(&mut self, point: DVec2, depth: f64) {
        self.low = self.low.min(point);
        self.high = self.high.max(point);
        self.nearest = self.nearest.max(depth);
        self.farthest = self.farthest.min(depth);
    }
}

impl<'a> Setup<'a> {
    fn new(
        scene: &'a Scene,
        priority: i32,
        instance: &'a Instance,
        view: &'a View,
        plan: LinePlan,
    ) -> Setup<'a> {
        let geometry = &*instance.geometry;
        let eye = view.eye_from_object(&instance.world_from_object);
        // Planes are computed from supports, not from projected corners: coplanar faces get one
        // plane, bit for bit.
        let normals = normal_matrix(&eye.matrix3);
        let project = |point: &DVec3| view.project(eye.transform_point3(*point));
        let vertices = geometry.mesh().points.par_iter().with_min_len(4096).map(project).collect();
        let planes = geometry
            .supports()
            .par_iter()
            .with_min_len(4096)
            .map(|support| {
                let (normal, point) =
                    (normals * support.normal, eye.transform_point3(support.point));
                (
                    nearer(view.plane(normal, point), priority, view),
                    view.faces_viewer(normal, point),
                )
            })
            .collect();
        let guard = Guard::new(view.raster());
        Setup { scene, instance, geometry, view, plan, guard, vertices, layered: false, planes }
    }

    /// The points of the mesh on the screen, and its faces over them.
    fn faces(&self, watch: &Watch) -> Result<(Vec<DVec2>, Vec<FaceTableBuilder>)> {
        // NaN marks what lies outside the guard: faces with such a corner are cut.
        let screen = |p: &Homogeneous| self.guard.screen(p).unwrap_or(DVec2::NAN);
        let points: Vec<DVec2> = self.vertices.par_iter().with_min_len(4096).map(screen).collect();
        let count = self.geometry.mesh().face_count();
        let chunks = (0..count.div_ceil(CHUNK)).into_par_iter().map(|chunk| {
            watch.check()?;
            // Chunks number the corners of one list of points, which is added to the whole table
            // once.
            let mut table = FaceTableBuilder::over(points.len() as u32);
            for face in chunk * CHUNK..count.min((chunk + 1) * CHUNK) {
                self.face(face, &points, &mut table)?;
            }
            Ok(table)
        });
        let chunks = chunks.collect::<Result<_>>()?;
        Ok((points, chunks))
    }

    fn face(&self, at: usize, points: &[DVec2], table: &mut FaceTableBuilder) -> Result<()> {
        let mesh = self.geometry.mesh();
        let outline = mesh.outline(at);
        let (support, is_front) = self.geometry.support_of(at);
        let (plane, faces_viewer) = self.planes[support];
        // Faces that share a plane may look to either side of it.
        let sees_front = faces_viewer == is_front;
        if self.scene.is_culled(self.instance, at, sees_front) {
            return Ok(());
        }
        let mut extent = Extent::EMPTY;
        let mut inside = true;
        for corner in outline {
            let (point, vertex) = (points[*corner as usize], &self.vertices[*corner as usize]);
            inside &= !point.x.is_nan();
            extent.add(point, vertex.r / vertex.w);
        }
        let ordinal = self.instance.first_ordinal + self.geometry.first_part(at);
        let head = |plane, part: Part, number| FaceHead {
            ordinal: ordinal + number,
            plane,
            rank: part.rank(),
            role: Role::Face,
            sees_front,
            is_translucent: self.layered
                || self.scene.is_translucent(self.instance, at, part, sees_front),
        };
        // Most faces: no copy of their corners, only their numbers.
        if inside && mesh.is_plain(at) {
            if self.is_met(&extent) {
                let plane = self.steady(plane, &extent);
                table.face(head(plane, Part::Face, 0), [outline])?;
            }
            return Ok(());
        }
        // The general case: rings that may need cutting, holes, seals, drawn edges.
        let mut rings = Rings { setup: self, points, table };
        let mut extent = Extent::EMPTY;
        let own: Vec<Vec<u32>> = std::iter::once(outline)
            .chain(mesh.holes(at).iter().map(Vec::as_slice))
            .enumerate()
            .map(|(i, ring)| rings.ring(ring, (i == 0).then_some(&mut extent)))
            .collect::<Result<_>>()?;
        // A drawn edge reaches beyond the face, at its corners by half of its width both ways: where no line meets the
        // face, one may meet its edges.
        let drawn = extent.grown(self.widest(at) * FRAC_1_SQRT_2);
        if own[0].len() < 3 || !self.is_met(&drawn) {
            return Ok(());
        }
        let plane = self.steady(plane, &extent);
        let mut parent = 0;
        for (number, part) in self.geometry.parts_of(at).enumerate() {
            let head = head(plane, part, number as u32);
            match part {
                Part::Face => {
                    parent = rings.table.face(head, own.iter().map(Vec::as_slice))?;
                }
                Part::FaceEdges => {
                    let all =
                        std::iter::once(outline).chain(mesh.holes(at).iter().map(Vec::as_slice));
                    let width = mesh.edge(at).map_or(0.0, |edge| edge.width);
                    rings.stroke(all, width, head)?;
                }
                Part::Seal(i) if self.instance.shows_seals => {
                    let seal = rings.ring(&mesh.seals(at)[i as usize].outline, None)?;
                    if seal.len() >= 3 {
                        rings
                            .table
                            .face(FaceHead { role: Role::Seal(parent), ..head }, [&seal[..]])?;
                    }
                }
                Part::SealEdges(i) if self.instance.shows_seals => {
                    let seal = &mesh.seals(at)[i as usize];
                    let width = seal.edge.map_or(0.0, |edge| edge.width);
                    rings.stroke([&seal.outline[..]], width, head)?;
                }
                Part::Seal(_) | Part::SealEdges(_) => {}
            }
        }
        Ok(())
    }

    /// The width in pixels of the widest edge that is drawn of a face and its seals.
    fn widest(&self, at: usize) -> f64 {
        let mesh = self.geometry.mesh();
        let seals = mesh.seals(at).iter().filter(|_| self.instance.shows_seals);
        let edges = mesh.edge(at).into_iter().chain(seals.filter_map(|seal| seal.edge));
        edges.map(|edge| f64::from(edge.width)).fold(0.0, f64::max)
    }

    /// Whether any line of the raster can meet the extent.
    fn is_met(&self, extent: &Extent) -> bool {
        let [left, top, right, bottom] = self.view.window();
        let (nearest, farthest) = self.view.depth_range();
        extent.high.x > left
            && extent.low.x < right
            && extent.high.y > top
            && extent.low.y < bottom
            && extent.farthest <= nearest
            && extent.nearest >= farthest
            // What lies between two lines is met by none of them, but may be met by a probe.
            && (self.plan.probed
                || self.plan.first_at_or_below(extent.low.y)
                    < self.plan.first_at_or_below(extent.high.y))
    }

    /// The plane, or constant depth for a face seen so nearly edge-on that all of its depths lie within
    /// one cell: there the plane would be extrapolated. Off by at most half the face's depth range.
    fn steady(&self, plane: Plane, extent: &Extent) -> Plane {
        let range = extent.nearest - extent.farthest;
        let per_cell = plane.a.abs() / self.view.raster().cells_per_pixel();
        let is_finite = plane.a.is_finite() && plane.b.is_finite() && plane.c.is_finite();
        let is_steep = per_cell > 1e-9 * extent.nearest.abs();
        if is_finite && !(is_steep && per_cell > range) {
            plane
        } else {
            Plane::constant(extent.farthest + range / 2.0)
        }
    }
}

/// A plane brought nearer by a priority.
fn nearer(plane: Plane, priority: i32, view: &View) -> Plane {
    if priority == 0 {
        return plane;
    }
    // Parallel depths are negative distances.
    let share = f64::from(priority) / f64::from(1 << 24);
    let k = if view.is_parallel() { 1.0 - share } else { 1.0 + share };
    Plane { a: plane.a * k, b: plane.b * k, c: plane.c * k }
}

/// Adds rings to a table.
struct Rings<'a, 'b> {
    setup: &'b Setup<'a>,
    points: &'b [DVec2],
    table: &'b mut FaceTableBuilder,
}

impl Rings<'_, '_> {
    /// A ring of the mesh as points of the table, cut if need be.
    fn ring(&mut self, ring: &[u32], mut extent: Option<&mut Extent>) -> Result<Vec<u32>> {
        let vertices: Vec<Homogeneous> =
            ring.iter().map(|corner| self.setup.vertices[*corner as usize]).collect();
        // Nothing to cut: neighbours go on sharing their corners.
        if ring.iter().all(|corner| !self.points[*corner as usize].x.is_nan()) {
            if let Some(extent) = extent.as_deref_mut() {
                for (corner, vertex) in ring.iter().zip(&vertices) {
                    extent.add(self.points[*corner as usize], vertex.r / vertex.w);
                }
            }
            return Ok(ring.to_vec());
        }
        let cut = self.setup.guard.clip(&vertices);
        let screen: Vec<DVec2> = cut.iter().map(|p| DVec2::new(p.x / p.w, p.y / p.w)).collect();
        if let Some(extent) = extent {
            screen.iter().zip(&cut).for_each(|(point, p)| extent.add(*point, p.r / p.w));
        }
        let first = self.table.points(screen)?;
        Ok((first..first + cut.len() as u32).collect())
    }

    /// The edges of rings as a face: a quadrilateral along each, `width` pixels wide, longer by half of
    /// that at both ends, so that corners close.
    fn stroke<'r>(
        &mut self,
        rings: impl IntoIterator<Item = &'r [u32]>,
        width: f32,
        head: FaceHead,
    ) -> Result<()> {
        let half = f64::from(width) / 2.0;
        let mut quads: Vec<[u32; 4]> = Vec::new();
        for ring in rings {
            for (i, q) in ring.iter().enumerate() {
                let p = ring[(i + ring.len() - 1) % ring.len()];
                let ends = [p, *q].map(|corner| self.setup.vertices[corner as usize]);
                // An edge is a ring of two corners, and each cut is met on the way there and back.
                let cut = self.setup.guard.clip(&ends);
                let screen = |p: &Homogeneous| DVec2::new(p.x / p.w, p.y / p.w);
                let Some(p) = cut.first().map(screen) else { continue };
                let Some(q) = cut.iter().map(screen).find(|q| *q != p) else { continue };
                let along = (q - p).try_normalize().unwrap_or(DVec2::X) * half;
                let across = along.perp();
                let corners = [
                    p - along - across,
                    q + along - across,
                    q + along + across,
                    p - along + across,
                ];
                let first = self.table.points(corners)?;
                quads.push([first, first + 1, first + 2, first + 3]);
            }
        }
        if !quads.is_empty() {
            let head = FaceHead { role: Role::Stroke, ..head };
            self.table.face(head, quads.iter().map(|quad| &quad[..]))?;
        }
        Ok(())
    }
}
