//! Scenes made by chance, and shorthands for making scenes by hand.

use glam::{DVec3, Vec2};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::key::Key;
use spandrel_engine::raster::Raster;
use spandrel_engine::scene::{
    AlphaMode, Document, Face, Material, Mesh, Object, Plan, Scene, Seal, Shape, Sides,
};
use std::path::Path;
use std::sync::Arc;

use crate::random::Random;

/// A view of a raster along -z from (0, 0, 10), 40 degrees high.
pub fn front_view(width: u32, height: u32) -> View {
    let raster = Raster::new(width, height).expect("sizes of tests are in range");
    View::new(&Camera::default(), raster).expect("the default camera is a camera")
}

/// A parallel view along -z in which one unit is one pixel and (0, 0) the lower left corner.
pub fn pixel_view(width: u32, height: u32) -> View {
    let centre = DVec3::new(f64::from(width) / 2.0, f64::from(height) / 2.0, 0.0);
    let camera = Camera {
        position: centre + DVec3::Z * 1000.0,
        look_at: centre,
        parallel_height: Some(f64::from(height)),
        ..Camera::default()
    };
    let raster = Raster::new(width, height).expect("sizes of tests are in range");
    View::new(&camera, raster).expect("a parallel camera is a camera")
}

/// A scene of one mesh, with the materials "pane" (red, half of it shines through) and "tint" (blue,
/// three quarters of it).
pub fn scene(label: &str, mesh: Mesh) -> Arc<Scene> {
    let root = Object::new("mesh", Shape::Faces(mesh));
    let mut document = Document::with_plan(Plan { root, ..Plan::default() });
    for (name, color, alpha) in
        [("pane", Color::new(0.8, 0.2, 0.1), 0.5), ("tint", Color::new(0.1, 0.3, 0.9), 0.25)]
    {
        let alpha_mode = AlphaMode::Blend;
        let material = Material { color, alpha, alpha_mode, ..Material::default() };
        document.materials.insert(name.to_owned(), material);
    }
    let scene = Scene::new(&document, None, label, Key::of(&document), Path::new(""));
    Arc::new(scene.expect("meshes of tests are sound"))
}

/// A scene of quadrangles with a material each, whose texture coordinates go from corner to corner.
///
/// # Errors
/// If a material cannot be.
pub fn painted_faces(parts: &[([DVec3; 4], Material)]) -> Result<Arc<Scene>, String> {
    let (mut mesh, mut document) = (Mesh::default(), Document::default());
    for (at, (corners, material)) in parts.iter().enumerate() {
        let outline = corners.iter().map(|p| mesh.add_point(*p)).collect();
        mesh.uvs.extend([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Vec2::from));
        let sides = Sides { front: Some(at as u32), ..Sides::default() };
        mesh.add_face(Face { outline, sides, ..Face::default() }).map_err(|e| e.to_string())?;
        mesh.materials.push(format!("{at}"));
        document.materials.insert(format!("{at}"), material.clone());
    }
    document.plans.push(Plan { root: Object::new("mesh", Shape::Faces(mesh)), ..Plan::default() });
    let key = Key::of(&document);
    Scene::new(&document, None, "scene", key, Path::new(""))
        .map(Arc::new)
        .map_err(|error| error.to_string())
}

/// A mesh of polygons.
pub fn polygons(polygons: &[Vec<DVec3>]) -> Mesh {
    let mut mesh = Mesh::default();
    for polygon in polygons {
        let ring: Vec<u32> = polygon.iter().map(|p| mesh.add_point(*p)).collect();
        mesh.add_polygon(&ring, None).expect("polygons of tests have three corners");
    }
    mesh
}

/// Faces of all kinds, many of them crossing, some coincident, some reaching behind the eye.
pub fn random_faces(seed: u64, count: usize) -> Mesh {
    faces(seed, count, false)
}

/// The same, but about half of them let something through.
pub fn random_panes(seed: u64, count: usize) -> Mesh {
    faces(seed, count, true)
}

fn faces(seed: u64, count: usize, panes: bool) -> Mesh {
    let mut random = Random::new(seed);
    let mut materials = Random::new(seed ^ 0x5eed);
    let mut sides = || match materials.below(4) {
        i @ 0..2 if panes => Sides { front: Some(i), ..Sides::default() },
        _ => Sides::default(),
    };
    let mut mesh = Mesh::default();
    mesh.materials = vec!["pane".into(), "tint".into()];
    let mut last = Vec::new();
    for _ in 0..count {
        let far = if random.below(8) == 0 { 30.0 } else { 4.0 };
        let centre = DVec3::new(
            random.between(-4.0, 4.0),
            random.between(-3.0, 3.0),
            random.between(-far, far.min(9.0)),
        );
        let mut axis = || {
            let v = DVec3::new(
                random.between(-1.0, 1.0),
                random.between(-1.0, 1.0),
                random.between(-1.0, 1.0),
            );
            v * 2.0
        };
        let (u, v) = (axis(), axis());
        let at = |s: f64, t: f64| centre + u * s + v * t;
        let star = |n: u32, inner: f64| -> Vec<DVec3> {
            (0..n)
                .map(|i| {
                    let angle = f64::from(i) / f64::from(n) * std::f64::consts::TAU;
                    let r = if i % 2 == 0 { 1.0 } else { inner };
                    let (s, c) =
                        (spandrel_engine::math::sin(angle), spandrel_engine::math::cos(angle));
                    at(r * c, r * s)
                })
                .collect()
        };
        let ring = |mesh: &mut Mesh, points: &[DVec3]| -> Vec<u32> {
            points.iter().map(|p| mesh.add_point(*p)).collect()
        };
        let face = match random.below(6) {
            // The last face again, or a part of its plane.
            0 if !last.is_empty() => Face { outline: ring(&mut mesh, &last), ..Face::default() },
            1 => Face { outline: ring(&mut mesh, &star(10, 0.4)), ..Face::default() },
            2 => {
                let hole =
                    star(4, 0.5).iter().map(|p| centre + (*p - centre) * 0.5).collect::<Vec<_>>();
                Face {
                    outline: ring(&mut mesh, &star(8, 0.9)),
                    holes: vec![ring(&mut mesh, &hole)],
                    ..Face::default()
                }
            }
            3 => {
                let outline = ring(&mut mesh, &star(6, 0.3));
                let seal = Seal { outline, sides: sides(), ..Seal::default() };
                Face {
                    outline: ring(&mut mesh, &star(4, 1.0)),
                    seals: vec![seal],
                    ..Face::default()
                }
            }
            _ => {
                last = vec![at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)];
                Face { outline: ring(&mut mesh, &last), ..Face::default() }
            }
        };
        let face = Face { sides: sides(), ..face };
        mesh.add_face(face).expect("faces of tests have three corners");
    }
    mesh
}
