//! Fewer triangles within a distance.
//!
//! Vertices are taken away one by one: all triangles of one are pulled to a neighbour, if nothing folds, the surface
//! stays one, and every vertex of the first surface stays within the distance of the triangles that took the place of
//! its own. So what is promised is checked: no vertex of the first surface lies further from the new one. What is left
//! are vertices of the first, with their normals. Borders stay as they are.

use glam::{DVec3, Vec3};

use crate::error::{Error, Result};
use crate::scene::Mesh;
use crate::watch::Watch;

/// A mesh of triangles with as few as can be found of which no vertex of the first lies further than `error`, in the
/// mesh's own unit.
///
/// # Errors
/// If the error is not above 0, or a face is no triangle.
pub fn decimate(mesh: &Mesh, error: f64) -> Result<Mesh> {
    if !(error > 0.0 && error.is_finite()) {
        return Err(Error::invalid("the error of decimation must be above 0"));
    }
    let mut triangles = Vec::with_capacity(mesh.face_count());
    for face in 0..mesh.face_count() {
        let corners: [u32; 3] = mesh
            .outline(face)
            .try_into()
            .map_err(|_| Error::invalid(format!("face {face} is no triangle")))?;
        triangles.push(corners);
    }
    let mut surface = Surface::new(mesh, triangles);
    // Flat places first, so that curved ones keep what room there is.
    for share in [0.25, 1.0] {
        surface.is_new.fill(true);
        while surface.pass(share * error)? > surface.left / 200 {}
    }
    surface.mesh(mesh)
}

/// The least cosine between a triangle and what it was, and the normals at its corners.
const LEAN: f64 = 0.25;

struct Surface<'m> {
    points: &'m [DVec3],
    /// The normals of the points; or none.
    normals: &'m [Vec3],
    /// By triangle; those that are gone have three corners alike.
    triangles: Vec<[u32; 3]>,
    /// The triangles of each vertex.
    stars: Vec<Vec<u32>>,
    /// The vertices that are gone and lie nearest to each triangle, of those that were asked.
    near: Vec<Vec<u32>>,
    /// Which vertices something changed around since they were tried.
    is_new: Vec<bool>,
    /// How many triangles are left.
    left: usize,
}

impl<'m> Surface<'m> {
    fn new(mesh: &'m Mesh, triangles: Vec<[u32; 3]>) -> Surface<'m> {
        let mut stars = vec![Vec::new(); mesh.points.len()];
        for (number, corners) in triangles.iter().enumerate() {
            corners.iter().for_each(|corner| stars[*corner as usize].push(number as u32));
        }
        let near = vec![Vec::new(); triangles.len()];
        let left = triangles.len();
        let is_new = vec![true; mesh.points.len()];
        Surface {
            points: &mesh.points,
            normals: &mesh.normals,
            triangles,
            stars,
            near,
            is_new,
            left,
        }
    }

    /// Takes vertices away, none beside another that this pass took; returns how many triangles went with them.
    fn pass(&mut self, error: f64) -> Result<usize> {
        let watch = Watch::current();
        let mut changed = vec![false; self.points.len()];
        let mut around = Vec::new();
        let before = self.left;
        for vertex in 0..self.points.len() as u32 {
            watch.check()?;
            if !self.is_new[vertex as usize] || changed[vertex as usize] {
                continue;
            }
            self.is_new[vertex as usize] = false;
            if !self.ring(vertex, &mut around) {
                continue;
            }
            let near = around.iter().filter_map(|to| {
                self.lies_near(vertex, *to, error).map(|distance| (distance, *to))
            });
            let mut near: Vec<(f64, u32)> = near.collect();
            near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            // The nearest may take it, if all that is gone near it stays near.
            if let Some((_, to)) = near.into_iter().find(|(_, to)| self.holds(vertex, *to, error)) {
                self.pull(vertex, to);
                for beside in &around {
                    changed[*beside as usize] = true;
                    self.is_new[*beside as usize] = true;
                }
            }
        }
        Ok(before - self.left)
    }

    /// The neighbours of a vertex, if its triangles go once around it.
    fn ring(&self, vertex: u32, around: &mut Vec<u32>) -> bool {
        around.clear();
        let star = &self.stars[vertex as usize];
        if star.len() < 3 {
            return false;
        }
        let after = |from: Option<u32>| {
            star.iter().find_map(|triangle| {
                let [a, b] = opposite(self.triangles[*triangle as usize], vertex);
                (from.is_none() || from == Some(a)).then_some((a, b))
            })
        };
        let Some((first, mut next)) = after(None) else { return false };
        around.push(first);
        while next != first {
            if around.len() >= star.len() {
                return false;
            }
            around.push(next);
            match after(Some(next)) {
                Some((_, to)) => next = to,
                None => return false,
            }
        }
        around.len() == star.len()
    }

    /// The triangles that stay when a vertex is pulled to another, with their new corners.
    fn pulled(&self, vertex: u32, to: u32) -> impl Iterator<Item = (u32, [u32; 3])> + Clone + '_ {
        let star = self.stars[vertex as usize].iter();
        star.filter_map(move |number| {
            let corners = self.triangles[*number as usize];
            let new = corners.map(|corner| if corner == vertex { to } else { corner });
            (!corners.contains(&to)).then_some((*number, new))
        })
    }

    /// How far a vertex would lie from the surface if it were pulled to another; none if that is more than an error, or
    /// the surface would fold.
    fn lies_near(&self, vertex: u32, to: u32, error: f64) -> Option<f64> {
        let straight = |corners: [u32; 3]| {
            let [a, b, c] = corners.map(|corner| self.points[corner as usize]);
            (b - a).cross(c - a)
        };
        for (number, new) in self.pulled(vertex, to) {
            let old = straight(self.triangles[number as usize]);
            let straight = straight(new);
            // Not turned by much, nor, step by step, away from the normals of the first surface.
            let leans =
                |normal: DVec3| straight.dot(normal) <= LEAN * straight.length() * normal.length();
            let normals = || new.iter().filter_map(|corner| self.normals.get(*corner as usize));
            if leans(old) || normals().any(|normal| leans(normal.as_dvec3())) {
                return None;
            }
        }
        let nearest = self.nearest(vertex, self.pulled(vertex, to));
        nearest.map(|(distance, _)| distance).filter(|distance| *distance <= error)
    }

    /// Whether a vertex can be pulled to another, so that the surface does not touch itself and all vertices that are gone
    /// near it stay near.
    fn holds(&self, vertex: u32, to: u32, error: f64) -> bool {
        // Of the vertices beside both there are two, or the surface would touch itself.
        let beside = |of: u32| {
            let star = self.stars[of as usize].iter();
            star.flat_map(move |triangle| opposite(self.triangles[*triangle as usize], of))
        };
        let mut both: Vec<u32> =
            beside(vertex).filter(|other| beside(to).any(|also| also == *other)).collect();
        both.sort_unstable();
        both.dedup();
        if both.len() != 2 {
            return false;
        }
        let gone = self.stars[vertex as usize].iter();
        let mut gone = gone.flat_map(|triangle| &self.near[*triangle as usize]);
        gone.all(|gone| {
            let point = self.points[*gone as usize];
            let mut kept = self.pulled(vertex, to);
            kept.any(|(_, corners)| {
                distance(point, corners.map(|corner| self.points[corner as usize])) <= error
            })
        })
    }

    fn nearest(
        &self,
        vertex: u32,
        triangles: impl Iterator<Item = (u32, [u32; 3])>,
    ) -> Option<(f64, u32)> {
        let point = self.points[vertex as usize];
        let each = triangles.map(|(number, corners)| {
            (distance(point, corners.map(|corner| self.points[corner as usize])), number)
        });
        each.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    fn pull(&mut self, vertex: u32, to: u32) {
        let kept: Vec<(u32, [u32; 3])> = self.pulled(vertex, to).collect();
        let star = std::mem::take(&mut self.stars[vertex as usize]);
        let mut gone = vec![vertex];
        for number in &star {
            gone.append(&mut self.near[*number as usize]);
            let corners = self.triangles[*number as usize];
            if corners.contains(&to) {
                for corner in corners {
                    self.stars[corner as usize].retain(|other| other != number);
                }
                self.triangles[*number as usize] = [to; 3];
                self.left -= 1;
            }
        }
        for (number, corners) in &kept {
            self.triangles[*number as usize] = *corners;
            self.stars[to as usize].push(*number);
        }
        for vertex in gone {
            if let Some((_, number)) = self.nearest(vertex, kept.iter().copied()) {
                self.near[number as usize].push(vertex);
            }
        }
    }

    fn mesh(&self, first: &Mesh) -> Result<Mesh> {
        let mut mesh = Mesh::default();
        mesh.materials.clone_from(&first.materials);
        let mut numbers = vec![None; self.points.len()];
        for (at, corners) in self.triangles.iter().enumerate() {
            if corners[0] == corners[1] {
                continue;
            }
            let corners = corners.map(|corner| {
                let corner = corner as usize;
                *numbers[corner].get_or_insert_with(|| {
                    mesh.points.push(first.points[corner]);
                    mesh.normals.extend(first.normals.get(corner));
                    mesh.points.len() as u32 - 1
                })
            });
            mesh.add_polygon(&corners, first.sides(at).front)?;
        }
        Ok(mesh)
    }
}

/// The other two corners of a triangle, in its order.
fn opposite([a, b, c]: [u32; 3], vertex: u32) -> [u32; 2] {
    if a == vertex {
        [b, c]
    } else if b == vertex {
        [c, a]
    } else {
        [a, b]
    }
}

/// How far a point lies from a triangle.
fn distance(point: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    let square = normal.length_squared();
    let within = [(a, b), (b, c), (c, a)]
        .into_iter()
        .all(|(from, to)| normal.dot((to - from).cross(point - from)) >= 0.0);
    if square > 0.0 && within {
        return (point - a).dot(normal).abs() / square.sqrt();
    }
    let to_edge = |from: DVec3, to: DVec3| {
        let along = to - from;
        let length = along.length_squared();
        let share =
            if length > 0.0 { ((point - from).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
        (from + along * share).distance(point)
    };
    to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
}
