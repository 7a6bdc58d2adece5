//! Which faces of a scene another scene has too, such as those of an edited file or of another frame.

use std::collections::HashMap;

use super::SceneSurfaces;
use crate::fragment::Alike;
use crate::scene::domains::Define;
use crate::scene::flat::{Instance, Scene};
use crate::scene::geometry::Geometry;
use crate::scene::material::{Map, Material, Picture};
use crate::scene::mesh::Mesh;

/// The faces of a scene that another has too: in the same place, of the same shape and with the same look, in objects of
/// the same name.
pub(super) fn alike(now: &SceneSurfaces, was: &SceneSurfaces) -> Alike {
    let mut faces = Alike::none(now.scene.part_count());
    let mut materials = AlikeMaterials { now: &now.scene, was: &was.scene, known: HashMap::new() };
    let mut named: HashMap<&str, Vec<&Instance>> = HashMap::new();
    for instance in was.scene.instances.iter().rev() {
        named.entry(&instance.path).or_default().push(instance);
    }
    for instance in &now.scene.instances {
        // Of several objects of one name, the first is the first.
        let Some(old) = named.get_mut(&*instance.path).and_then(Vec::pop) else { continue };
        let is_there = instance.world_from_object == old.world_from_object
            && instance.shows_seals == old.shows_seals;
        if is_there {
            pair(instance, old, &mut materials, &mut faces);
        }
    }
    faces
}

/// Pairs the faces of two objects.
fn pair(now: &Instance, was: &Instance, materials: &mut AlikeMaterials<'_>, faces: &mut Alike) {
    let (a, b) = (&*now.geometry, &*was.geometry);
    let counts = [a, b].map(|geometry| geometry.mesh().face_count());
    let is_same = |at: (usize, usize), materials: &mut AlikeMaterials<'_>| {
        (std::ptr::eq(a, b) && at.0 == at.1 || is_face_alike(a, b, at))
            && is_look_alike((now, at.0), (was, at.1), materials)
    };
    let mut found = |at: (usize, usize)| {
        let first = now.first_ordinal + a.first_part(at.0);
        let first_was = was.first_ordinal + b.first_part(at.1);
        let parts = a.parts_of(at.0).count() as u32;
        (0..parts).for_each(|part| faces.set(first + part, first_was + part));
    };
    let shared = counts[0].min(counts[1]);
    if counts[0] == counts[1] {
        (0..shared).filter(|at| is_same((*at, *at), materials)).for_each(|at| found((at, at)));
        return;
    }
    // Faces came or went somewhere: those before and those after are the same.
    let head = (0..shared).take_while(|at| is_same((*at, *at), materials)).count();
    (0..head).for_each(|at| found((at, at)));
    let from_end = |at: usize| (counts[0] - 1 - at, counts[1] - 1 - at);
    let tail = (0..shared - head).take_while(|at| is_same(from_end(*at), materials)).count();
    (0..tail).for_each(|at| found(from_end(at)));
}

/// Whether two faces have the same shape, and the same of all that their corners carry.
fn is_face_alike(a: &Geometry, b: &Geometry, (at, at_was): (usize, usize)) -> bool {
    let (mesh, old) = (a.mesh(), b.mesh());
    let has_same_lists =
        |mesh: &Mesh| [!mesh.normals.is_empty(), !mesh.uvs.is_empty(), !mesh.colors.is_empty()];
    let corner = |(p, q): (&u32, &u32)| {
        let (p, q) = (*p as usize, *q as usize);
        mesh.points[p] == old.points[q]
            && mesh.normals.get(p) == old.normals.get(q)
            && mesh.uvs.get(p) == old.uvs.get(q)
            && mesh.colors.get(p) == old.colors.get(q)
    };
    let ring = |p: &[u32], q: &[u32]| p.len() == q.len() && p.iter().zip(q).all(corner);
    let (seals, old_seals) = (mesh.seals(at), old.seals(at_was));
    let (holes, old_holes) = (mesh.holes(at), old.holes(at_was));
    let plane = |geometry: &Geometry, face: usize| {
        let (support, is_front) = geometry.support_of(face);
        (geometry.supports()[support], is_front)
    };
    has_same_lists(mesh) == has_same_lists(old)
        && ring(mesh.outline(at), old.outline(at_was))
        && plane(a, at) == plane(b, at_was)
        && mesh.edge(at) == old.edge(at_was)
        && holes.len() == old_holes.len()
        && holes.iter().zip(old_holes).all(|(p, q)| ring(p, q))
        && seals.len() == old_seals.len()
        && seals
            .iter()
            .zip(old_seals)
            .all(|(p, q)| p.edge == q.edge && ring(&p.outline, &q.outline))
}

/// Whether two faces and their seals have the same materials on both sides.
fn is_look_alike(
    (now, at): (&Instance, usize),
    (was, at_was): (&Instance, usize),
    materials: &mut AlikeMaterials<'_>,
) -> bool {
    let (mesh, old) = (now.geometry.mesh(), was.geometry.mesh());
    let seals = mesh.seals(at).iter().map(|seal| seal.sides);
    let old_seals = old.seals(at_was).iter().map(|seal| seal.sides);
    let sides = std::iter::once(mesh.sides(at)).chain(seals);
    let old_sides = std::iter::once(old.sides(at_was)).chain(old_seals);
    sides.zip(old_sides).all(|(a, b)| {
        [true, false]
            .into_iter()
            .all(|front| materials.are_alike(now.material_of(a, front), was.material_of(b, front)))
    })
}

/// Which materials of two scenes look the same.
struct AlikeMaterials<'s> {
    now: &'s Scene,
    was: &'s Scene,
    known: HashMap<(u32, u32), bool>,
}

impl AlikeMaterials<'_> {
    fn are_alike(&mut self, now: u32, was: u32) -> bool {
        if let Some(known) = self.known.get(&(now, was)) {
            return *known;
        }
        let [a, b] = [(self.now, now), (self.was, was)].map(|(scene, number)| {
            (&scene.material_names[number as usize], &scene.materials[number as usize])
        });
        let mut is_alike = a == b;
        let bundles = |material: &Material| {
            let domains = material.domains.as_ref();
            domains.map_or_else(Vec::new, |domains| domains.bundles().collect())
        };
        for (now, was) in bundles(a.1).into_iter().zip(bundles(b.1)) {
            is_alike = is_alike && self.are_alike(now, was);
        }
        // Files may hold other pictures than they did.
        let has_files =
            a.1.domains.iter().any(|domains| matches!(domains.define, Define::Picture(_)))
                || a.1.maps.values().any(|map| map.picture.file().is_some());
        let holds = |map: &Map| matches!(map.picture, Picture::Embedded(..));
        is_alike &=
            !has_files || self.now.pictures.is_some() && self.now.pictures == self.was.pictures;
        is_alike &= !a.1.maps.values().any(holds) || self.now.key == self.was.key;
        self.known.insert((now, was), is_alike);
        is_alike
    }
}
