//! Trees that grow by chance: many thousand leaves, each a face.

#![allow(
    clippy::disallowed_methods,
    reason = "nothing depends on the last bits of where a leaf is"
)]

use glam::{DVec3, dvec3 as v};
use spandrel_engine::color::Color;
use spandrel_engine::fragment::Finish;
use spandrel_engine::key::Key;
use spandrel_engine::scene::{Document, Face, Material, Mesh, Object, Plan, Scene, Shape, Sides};
use std::f64::consts::TAU;
use std::path::Path;
use std::sync::Arc;

use crate::random::Random;

/// How a kind of tree grows.
pub struct Kind {
    /// Its name.
    pub name: &'static str,
    /// Its height.
    pub height: f64,
    /// Branches from a branch, and by how much they lean away from it, in radians.
    pub forks: u32,
    /// By how much they lean.
    pub lean: f64,
    /// The length of a branch as a share of the one that it grows from.
    pub share: f64,
    /// By how much branches turn upwards.
    pub rise: f64,
    /// Its levels.
    pub levels: u32,
    /// The length of the trunk before it forks, in lengths of the first branches.
    pub trunk: f64,
    /// Leaves on a twig.
    pub leaves: u32,
    /// Their length, in lengths of the first branches.
    pub leaf: f64,
    /// Its green.
    pub green: [Color; 3],
    /// Its bark.
    pub bark: Color,
    /// Its seed.
    pub seed: u64,
}

struct Tree<'k> {
    kind: &'k Kind,
    mesh: Mesh,
    random: Random,
}

impl Tree<'_> {
    fn face(&mut self, points: &[DVec3], material: u32) {
        let outline = points.iter().map(|p| self.mesh.add_point(*p)).collect();
        let sides = Sides { front: Some(material), ..Sides::default() };
        self.mesh.add_face(Face { outline, sides, ..Face::default() }).expect("three corners");
    }

    fn branch(&mut self, from: DVec3, way: DVec3, length: f64, radius: f64, level: u32) {
        let bend = self.aside(0.12);
        let to = from + (way + bend).normalize() * length;
        let (u, w) = way.any_orthonormal_pair();
        let thin = radius * 0.68;
        for k in 0..6 {
            let at = |k: u32, middle: DVec3, radius: f64| {
                let angle = TAU * f64::from(k) / 6.0;
                middle + (u * angle.cos() + w * angle.sin()) * radius
            };
            let (a, b) = (at(k, from, radius), at(k + 1, from, radius));
            let (c, d) = (at(k + 1, to, thin), at(k, to, thin));
            self.face(&[a, b, c], 3);
            self.face(&[a, c, d], 3);
        }
        if level == 0 {
            return self.twig(from, to);
        }
        let turn = self.random.between(0.0, TAU);
        for k in 0..self.kind.forks {
            let angle = turn + TAU * f64::from(k) / f64::from(self.kind.forks);
            let side = u * angle.cos() + w * angle.sin();
            let lean = self.kind.lean * self.random.between(0.6, 1.3);
            let next = (way + side * lean.tan() + DVec3::Y * self.kind.rise).normalize();
            let share = self.kind.share * self.random.between(0.8, 1.15);
            // What grows from the trunk is not shorter for its being short.
            let length = if level == self.kind.levels { 1.0 } else { length };
            let start = from + (to - from) * self.random.between(0.62, 1.0);
            self.branch(start, next, length * share, thin * 0.72, level - 1);
        }
        // The branch itself goes on.
        let length = if level == self.kind.levels { 1.0 } else { length };
        self.branch(to, (to - from).normalize(), length * self.kind.share, thin * 0.85, level - 1);
    }

    fn aside(&mut self, by: f64) -> DVec3 {
        let mut one = || self.random.between(-by, by);
        v(one(), one(), one())
    }

    fn twig(&mut self, from: DVec3, to: DVec3) {
        for _ in 0..self.kind.leaves {
            let along = self.random.between(0.1, 1.2);
            let at = from + (to - from) * along + self.aside(self.kind.leaf * 2.2);
            let way = (self.aside(1.0) + DVec3::Y * 0.2).normalize_or(DVec3::X);
            let side = way.cross(self.aside(1.0)).normalize_or(DVec3::Z);
            let long = way * (self.kind.leaf * self.random.between(0.7, 1.2));
            let wide = side * (self.kind.leaf * 0.32);
            let material = self.random.below(3);
            self.face(&[at, at + long * 0.5 + wide, at + long, at + long * 0.5 - wide], material);
        }
    }
}

/// A tree of a kind, at the origin.
///
/// # Panics
/// Never: its faces are sound.
pub fn grow(kind: &Kind) -> Arc<Scene> {
    grow_leaves(kind, Color::BLACK)
}

/// A tree whose leaves let light through from their backs.
///
/// # Panics
/// Never: its faces are sound.
pub fn grow_leaves(kind: &Kind, transmit: Color) -> Arc<Scene> {
    let (mesh, random) = (Mesh::default(), Random::new(kind.seed));
    let mut tree = Tree { kind, mesh, random };
    // A trunk, and what grows from it, scaled to its height at the end.
    tree.branch(DVec3::ZERO, DVec3::Y, kind.trunk, 0.075, kind.levels);
    let [a, b, c] = kind.green;
    scene(tree.mesh, (kind.name, kind.height), [a, b, c, kind.bark], transmit)
}

/// A tuft of grass, a metre wide: blades that bend, some with ears.
///
/// # Panics
/// Never: its faces are sound.
pub fn grass() -> Arc<Scene> {
    let mut mesh = Mesh::default();
    let mut random = Random::new(31);
    for _ in 0..1500 {
        // Denser in the middle.
        let place = |random: &mut Random| random.between(-0.5, 0.5) * random.between(0.5, 1.0);
        let foot = v(place(&mut random), 0.0, 0.5 * place(&mut random));
        let high = random.between(0.4, 1.0) * (0.62 - foot.x.abs() * 1.05);
        let lean = v(random.between(-0.5, 0.5) + foot.x, 0.0, random.between(-0.4, 0.4)) * high;
        let wide = v(random.between(0.6, 1.0), 0.0, random.between(-0.8, 0.8)) * 0.0055;
        let at = |t: f64| foot + v(0.0, high * (1.0 - 0.3 * t * t), 0.0) * t + lean * (t * t);
        let material = random.below(3);
        for part in 0..4 {
            let (t, u) = (f64::from(part) / 4.0, f64::from(part + 1) / 4.0);
            let (low, top) = (wide * (1.0 - t * t), wide * (1.0 - u * u));
            let points = [at(t) - low, at(t) + low, at(u) + top, at(u) - top];
            for corners in [[0, 1, 2], [0, 2, 3]] {
                let outline = corners.map(|k| mesh.add_point(points[k])).to_vec();
                let sides = Sides { front: Some(material), ..Sides::default() };
                mesh.add_face(Face { outline, sides, ..Face::default() }).expect("three corners");
            }
        }
    }
    let colors = [[0.17, 0.26, 0.06], [0.24, 0.31, 0.09], [0.36, 0.34, 0.15], [0.2, 0.2, 0.1]];
    scene(mesh, ("grass", 0.5), colors.map(|[r, g, b]| Color::new(r, g, b)), Color::BLACK)
}

/// A scene of leaves of three colours and bark, so high.
fn scene(
    mut mesh: Mesh,
    (name, height): (&str, f64),
    colors: [Color; 4],
    transmit: Color,
) -> Arc<Scene> {
    let top = mesh.points.iter().map(|p| p.y).fold(0.0, f64::max);
    mesh.points.iter_mut().for_each(|p| *p *= height / top);
    mesh.materials = ["leaf 0", "leaf 1", "leaf 2", "bark"].map(String::from).to_vec();
    let mut document = Document::with_plan(Plan {
        root: Object::new("tree", Shape::Faces(mesh)),
        ..Plan::default()
    });
    for (name, color) in ["leaf 0", "leaf 1", "leaf 2", "bark"].into_iter().zip(colors) {
        let transmit = if name == "bark" { Color::BLACK } else { transmit };
        let finish = Finish { transmit, ..Finish::default() };
        document
            .materials
            .insert(name.to_owned(), Material { color, finish, ..Material::default() });
    }
    let key = Key::of(&(name, transmit));
    Arc::new(Scene::new(&document, None, name, key, Path::new("")).expect("a tree"))
}

/// An oak, a birch, a maple in autumn, a bush, and an elm.
pub fn kinds() -> [Kind; 5] {
    [
        Kind {
            name: "oak",
            height: 11.0,
            forks: 3,
            lean: 0.72,
            share: 0.72,
            rise: 0.12,
            levels: 5,
            trunk: 0.6,
            leaves: 24,
            leaf: 0.042,
            green: [
                Color::new(0.10, 0.19, 0.04),
                Color::new(0.14, 0.24, 0.06),
                Color::new(0.20, 0.28, 0.07),
            ],
            bark: Color::new(0.16, 0.12, 0.09),
            seed: 4,
        },
        Kind {
            name: "birch",
            height: 13.0,
            forks: 3,
            lean: 0.45,
            share: 0.7,
            rise: 0.3,
            levels: 5,
            trunk: 0.8,
            leaves: 15,
            leaf: 0.036,
            green: [
                Color::new(0.20, 0.30, 0.06),
                Color::new(0.26, 0.34, 0.08),
                Color::new(0.16, 0.25, 0.05),
            ],
            bark: Color::new(0.42, 0.39, 0.35),
            seed: 9,
        },
        Kind {
            name: "maple",
            height: 9.0,
            forks: 4,
            lean: 0.62,
            share: 0.66,
            rise: 0.18,
            levels: 4,
            trunk: 0.6,
            leaves: 30,
            leaf: 0.05,
            green: [
                Color::new(0.34, 0.12, 0.03),
                Color::new(0.42, 0.20, 0.04),
                Color::new(0.28, 0.20, 0.05),
            ],
            bark: Color::new(0.13, 0.10, 0.08),
            seed: 15,
        },
        Kind {
            name: "bush",
            height: 1.6,
            forks: 5,
            lean: 0.8,
            share: 0.8,
            rise: 0.45,
            levels: 3,
            trunk: 0.2,
            leaves: 30,
            leaf: 0.085,
            green: [
                Color::new(0.09, 0.18, 0.05),
                Color::new(0.12, 0.22, 0.06),
                Color::new(0.17, 0.25, 0.08),
            ],
            bark: Color::new(0.14, 0.11, 0.08),
            seed: 23,
        },
        Kind {
            name: "elm",
            height: 15.0,
            forks: 4,
            lean: 0.42,
            share: 0.7,
            rise: 0.62,
            levels: 5,
            trunk: 0.45,
            leaves: 11,
            leaf: 0.05,
            green: [
                Color::new(0.11, 0.22, 0.05),
                Color::new(0.16, 0.27, 0.07),
                Color::new(0.24, 0.31, 0.08),
            ],
            bark: Color::new(0.2, 0.17, 0.13),
            seed: 41,
        },
    ]
}
