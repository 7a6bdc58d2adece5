//! What a surface of triangles measures.

use glam::DVec3;
use std::collections::HashMap;

use crate::scene::Mesh;

/// What a surface measures, in its own unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measure {
    /// Its triangles.
    pub triangles: usize,
    /// Its vertices, without those that no face has.
    pub vertices: usize,
    /// The sum of its faces' areas.
    pub area: f64,
    /// What it encloses, as far as it is closed: positive if its faces are seen from outside.
    pub volume: f64,
    /// Vertices less edges plus faces: two for each ball, two less for each handle.
    pub euler: i64,
    /// Its edges with one face only: 0 if it is closed.
    pub open_edges: usize,
    /// Its edges with more than two faces, or two that are turned against each other.
    pub faulty_edges: usize,
    /// Its parts that no edge connects.
    pub parts: usize,
}

/// Measures a surface; its polygons are fans of triangles around their first corners.
pub fn measure(mesh: &Mesh) -> Measure {
    let mut measure = Measure { triangles: mesh.face_count(), ..Measure::default() };
    // By edge, from its smaller vertex to its greater: how often it is gone along, and against.
    let mut edges: HashMap<[u32; 2], [u32; 2]> = HashMap::new();
    let mut sets = Sets((0..mesh.points.len() as u32).collect());
    let mut used = vec![false; mesh.points.len()];
    // Volumes are added from a point of the surface: from far away they would cancel.
    let base = mesh.points.first().copied().unwrap_or(DVec3::ZERO);
    for face in 0..mesh.face_count() {
        let outline = mesh.outline(face);
        let point = |corner: u32| mesh.points[corner as usize] - base;
        for pair in outline[1..].windows(2) {
            let [a, b, c] = [outline[0], pair[0], pair[1]].map(point);
            measure.area += (b - a).cross(c - a).length() / 2.0;
            measure.volume += a.dot(b.cross(c)) / 6.0;
        }
        for (at, from) in outline.iter().enumerate() {
            let to = outline[(at + 1) % outline.len()];
            used[*from as usize] = true;
            sets.join(*from, to);
            edges.entry([*from.min(&to), *from.max(&to)]).or_default()[usize::from(*from > to)] +=
                1;
        }
    }
    measure.vertices = used.iter().filter(|used| **used).count();
    measure.euler = measure.vertices as i64 - edges.len() as i64 + measure.triangles as i64;
    for times in edges.values() {
        match times {
            [1, 1] => {}
            [1, 0] | [0, 1] => measure.open_edges += 1,
            _ => measure.faulty_edges += 1,
        }
    }
    let is_root = |at: &usize| used[*at] && sets.0[*at] == *at as u32;
    measure.parts = (0..used.len()).filter(is_root).count();
    measure
}

/// Sets of vertices, each led by one of them.
struct Sets(Vec<u32>);

impl Sets {
    fn root(&mut self, mut at: u32) -> u32 {
        while self.0[at as usize] != at {
            // Half of the path is left out the next time.
            self.0[at as usize] = self.0[self.0[at as usize] as usize];
            at = self.0[at as usize];
        }
        at
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}
