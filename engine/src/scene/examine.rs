//! What is wrong with faces: outlines that cross themselves, holes outside their face, and the like.
//!
//! All of these have a defined picture (see [`face`](super::face)); none is silently wrong. But they are
//! seldom meant.

use glam::{DVec2, DVec3};
use std::collections::HashMap;

use super::geometry::PLANARITY;
use super::mesh::Mesh;
use crate::polygon::plane_normal;

/// A kind of fault of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MeshFault {
    /// Two corners in a row are one point.
    RepeatedCorner,
    /// The face has no area.
    NoArea,
    /// The corners do not lie in a plane.
    NotPlanar,
    /// The corners of a face with seals or drawn edges do not lie in a plane.
    Bent,
    /// The outline, a hole or a seal crosses or touches itself.
    CrossesItself,
    /// A hole crosses the outline.
    HoleCrossesOutline,
    /// A hole lies outside the outline.
    HoleOutside,
    /// Two holes overlap or touch, or are one inside the other.
    HolesOverlap,
    /// A seal reaches beyond the outline.
    SealOutside,
    /// Two faces have the same corners.
    Doubled,
}

impl std::fmt::Display for MeshFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            MeshFault::RepeatedCorner => "two corners in a row are one point (the second is dropped)",
            MeshFault::NoArea => "the face has no area (it is dropped)",
            MeshFault::NotPlanar => "the corners do not lie in a plane (it is divided into triangles)",
            MeshFault::Bent => {
                "the corners do not lie in a plane (a face with seals or drawn edges is taken as flat)"
            }
            MeshFault::CrossesItself => {
                "an outline crosses or touches itself (the even-odd rule holds)"
            }
            MeshFault::HoleCrossesOutline => {
                "a hole crosses the outline (what is outside has no effect)"
            }
            MeshFault::HoleOutside => "a hole lies outside the outline (it has no effect)",
            MeshFault::HolesOverlap => "two holes overlap, touch or contain each other (all is hole)",
            MeshFault::SealOutside => "a seal reaches beyond the outline (it is cut there)",
            MeshFault::Doubled => "two faces have the same corners (the later is seen)",
        })
    }
}

/// Rings with more corners are not compared edge by edge.
const MOST: usize = 4000;

/// The faults of a mesh's faces: the face's index and the fault, each once per face.
pub fn examine(mesh: &Mesh) -> Vec<(usize, MeshFault)> {
    let mut found = Vec::new();
    let mut known: HashMap<Vec<u32>, usize> = HashMap::new();
    for at in 0..mesh.face_count() {
        let mut faults = examine_face(mesh, at);
        let mut corners = mesh.outline(at).to_vec();
        // Sorted, as a double may begin elsewhere or run the other way round.
        corners.sort_unstable();
        if known.insert(corners, at).is_some() {
            faults.push(MeshFault::Doubled);
        }
        faults.sort_unstable();
        faults.dedup();
        found.extend(faults.into_iter().map(|fault| (at, fault)));
    }
    found
}

fn examine_face(mesh: &Mesh, at: usize) -> Vec<MeshFault> {
    let points =
        |ring: &[u32]| -> Vec<DVec3> { ring.iter().map(|c| mesh.points[*c as usize]).collect() };
    let outline = points(mesh.outline(at));
    let holes: Vec<Vec<DVec3>> = mesh.holes(at).iter().map(|hole| points(hole)).collect();
    let seals: Vec<Vec<DVec3>> = mesh.seals(at).iter().map(|seal| points(&seal.outline)).collect();
    let mut faults = Vec::new();
    let repeats = |ring: &[DVec3]| (0..ring.len()).any(|i| ring[i] == ring[(i + 1) % ring.len()]);
    if repeats(&outline) || holes.iter().any(|hole| repeats(hole)) {
        faults.push(MeshFault::RepeatedCorner);
    }
    let Some(normal) = plane_normal(outline.iter().copied()) else {
        faults.push(MeshFault::NoArea);
        return faults;
    };
    let centre = outline.iter().sum::<DVec3>() / outline.len() as f64;
    let all = || outline.iter().chain(holes.iter().flatten());
    let off = all().map(|p| (*p - centre).dot(normal).abs()).fold(0.0, f64::max);
    let size = all().map(|p| (*p - centre).length()).fold(0.0, f64::max) * 2.0;
    if off > PLANARITY * size {
        let is_whole = !mesh.seals(at).is_empty() || mesh.edge(at).is_some();
        faults.push(if is_whole { MeshFault::Bent } else { MeshFault::NotPlanar });
    }
    let count = outline.len() + holes.iter().chain(&seals).map(Vec::len).sum::<usize>();
    // Edges are compared by pairs. A triangle with area cannot cross itself.
    if (outline.len() == 3 && holes.is_empty() && seals.is_empty()) || count > MOST {
        return faults;
    }
    let u = normal.any_orthonormal_vector();
    let v = normal.cross(u);
    let flat = |ring: &[DVec3]| -> Vec<DVec2> {
        ring.iter().map(|p| DVec2::new((*p - centre).dot(u), (*p - centre).dot(v))).collect()
    };
    let outline = flat(&outline);
    let holes: Vec<Vec<DVec2>> = holes.iter().map(|hole| flat(hole)).collect();
    let seals: Vec<Vec<DVec2>> = seals.iter().map(|seal| flat(seal)).collect();
    if std::iter::once(&outline).chain(&holes).chain(&seals).any(|ring| crosses_itself(ring)) {
        faults.push(MeshFault::CrossesItself);
    }
    for (i, hole) in holes.iter().enumerate() {
        if cross(hole, &outline) {
            faults.push(MeshFault::HoleCrossesOutline);
        } else if !hole.iter().all(|p| contains(&outline, *p)) {
            faults.push(MeshFault::HoleOutside);
        }
        for other in &holes[..i] {
            // Rings that do not meet are apart or one within the other, and one corner tells which.
            if meet(hole, other) || contains(hole, other[0]) || contains(other, hole[0]) {
                faults.push(MeshFault::HolesOverlap);
            }
        }
    }
    for seal in &seals {
        if cross(seal, &outline)
            || !contains(&outline, middle(seal)) && !contains(&outline, seal[0])
        {
            faults.push(MeshFault::SealOutside);
        }
    }
    faults
}

fn middle(ring: &[DVec2]) -> DVec2 {
    ring.iter().sum::<DVec2>() / ring.len() as f64
}

pub(super) fn edges(ring: &[DVec2]) -> impl Iterator<Item = (DVec2, DVec2)> + Clone + '_ {
    (0..ring.len()).map(|i| (ring[i], ring[(i + 1) % ring.len()]))
}

fn side(p: DVec2, q: DVec2, r: DVec2) -> f64 {
    let area = (q - p).perp_dot(r - p);
    // Within rounding of the coordinates three points are on a line.
    let scale = (q - p).length() * (r - p).length();
    if area.abs() <= 1e-12 * scale { 0.0 } else { area.signum() }
}

/// Whether two edges cross at a point inside both.
fn cross_inside(a: (DVec2, DVec2), b: (DVec2, DVec2)) -> bool {
    // Strictly opposite sides: a corner that lies on the other edge touches and does not cross.
    side(a.0, a.1, b.0) * side(a.0, a.1, b.1) < 0.0
        && side(b.0, b.1, a.0) * side(b.0, b.1, a.1) < 0.0
}

/// Whether a point lies on an edge.
fn on_edge(p: DVec2, edge: (DVec2, DVec2)) -> bool {
    // On the line, and the ends lie in opposite directions from it.
    side(edge.0, edge.1, p) == 0.0 && (p - edge.0).dot(p - edge.1) <= 0.0
}

fn crosses_itself(ring: &[DVec2]) -> bool {
    let all: Vec<_> = edges(ring).filter(|(p, q)| p != q).collect();
    let n = all.len();
    (0..n).any(|i| {
        (i + 1..n).any(|j| {
            let neighbours = j == i + 1 || (i == 0 && j == n - 1);
            if neighbours {
                // Neighbours may only fold back onto each other.
                let (p, q, r) = if j == i + 1 {
                    (all[i].0, all[i].1, all[j].1)
                } else {
                    (all[j].0, all[j].1, all[i].1)
                };
                return side(p, q, r) == 0.0 && (p - q).dot(r - q) > 0.0;
            }
            cross_inside(all[i], all[j]) || on_edge(all[j].0, all[i]) || on_edge(all[i].0, all[j])
        })
    })
}

/// Whether two rings' edges cross.
fn cross(a: &[DVec2], b: &[DVec2]) -> bool {
    edges(a).any(|p| edges(b).any(|q| cross_inside(p, q)))
}

/// Whether two rings cross or touch.
fn meet(a: &[DVec2], b: &[DVec2]) -> bool {
    cross(a, b)
        || edges(a).any(|edge| b.iter().any(|p| on_edge(*p, edge)))
        || edges(b).any(|edge| a.iter().any(|p| on_edge(*p, edge)))
}

/// Whether a point is inside a ring or on it.
pub(super) fn contains(ring: &[DVec2], p: DVec2) -> bool {
    if edges(ring).any(|edge| on_edge(p, edge)) {
        return true;
    }
    let crossings = edges(ring).filter(|(a, b)| {
        // Half open in y: a corner at the height of the point is counted for one of its edges only.
        (a.y <= p.y) != (b.y <= p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
    });
    crossings.count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Face, Seal};

    fn face(
        outline: &[(f64, f64)],
        holes: &[&[(f64, f64)]],
        seals: &[&[(f64, f64)]],
    ) -> Vec<MeshFault> {
        let mut mesh = Mesh::default();
        let mut ring = |points: &[(f64, f64)]| -> Vec<u32> {
            points.iter().map(|(x, y)| mesh.add_point([*x, *y, 0.0])).collect()
        };
        let face = Face {
            outline: ring(outline),
            holes: holes.iter().map(|hole| ring(hole)).collect(),
            seals: seals.iter().map(|s| Seal { outline: ring(s), ..Seal::default() }).collect(),
            ..Face::default()
        };
        mesh.add_face(face).unwrap();
        examine(&mesh).into_iter().map(|(_, fault)| fault).collect()
    }

    const SQUARE: [(f64, f64); 4] = [(0.0, 0.0), (9.0, 0.0), (9.0, 9.0), (0.0, 9.0)];

    fn small(x: f64, y: f64) -> Vec<(f64, f64)> {
        vec![(x, y), (x + 2.0, y), (x + 2.0, y + 2.0), (x, y + 2.0)]
    }

    #[test]
    fn sound_faces_have_no_faults() {
        assert_eq!(face(&SQUARE, &[&small(1.0, 1.0), &small(4.0, 1.0)], &[&small(1.0, 5.0)]), []);
    }

    #[test]
    fn each_fault_is_found() {
        let bow = [(0.0, 0.0), (9.0, 9.0), (9.0, 0.0), (0.0, 6.0)];
        assert_eq!(face(&bow, &[], &[]), [MeshFault::CrossesItself]);
        assert_eq!(face(&SQUARE, &[&small(8.0, 1.0)], &[]), [MeshFault::HoleCrossesOutline]);
        assert_eq!(face(&SQUARE, &[&small(20.0, 1.0)], &[]), [MeshFault::HoleOutside]);
        assert_eq!(
            face(&SQUARE, &[&small(1.0, 1.0), &small(2.0, 2.0)], &[]),
            [MeshFault::HolesOverlap]
        );
        assert_eq!(
            face(&SQUARE, &[&small(1.0, 1.0), &small(1.0, 1.0)], &[]),
            [MeshFault::HolesOverlap]
        );
        assert_eq!(face(&SQUARE, &[], &[&small(8.0, 8.0)]), [MeshFault::SealOutside]);
        let line = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)];
        assert_eq!(face(&line, &[], &[]), [MeshFault::NoArea]);
    }
}
