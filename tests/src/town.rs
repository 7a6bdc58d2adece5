//! Generated towns of any size: what speed is measured on.

use glam::DVec3;
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::raster::Raster;
use spandrel_engine::scene::{Document, Material, Mesh, Object, Plan, Scene, Shape};
use std::path::Path;
use std::sync::Arc;

use crate::random::Random;

/// Colours of walls and roofs.
const COLORS: usize = 24;

/// The clusters of a town of about `triangles` triangles, `count` of them, by streets. Houses are boxes
/// with gables and windows that stand out of the walls; every polygon is convex and has one flat
/// colour.
pub fn clusters(triangles: usize, count: usize) -> Vec<Arc<Scene>> {
    let meshes = meshes(triangles, count);
    let build = |(i, mesh): (usize, Mesh)| {
        let mut random = Random::new(99);
        let mut document = Document::default();
        for i in 0..COLORS {
            let color = Color::new(
                random.between(0.1, 0.9) as f32,
                random.between(0.1, 0.9) as f32,
                random.between(0.1, 0.9) as f32,
            );
            let material = Material { color, unlit: true, ..Material::default() };
            document.materials.insert(format!("color {i}"), material);
        }
        let root = Object { shape: Shape::Faces(mesh), ..Object::default() };
        document.plans.push(Plan { root, ..Plan::default() });
        let label = format!("cluster {i}");
        let key = spandrel_engine::key::Key::of(&(triangles, count, i));
        let scene = Scene::new(&document, None, &label, key, Path::new(""));
        Arc::new(scene.expect("generated towns are sound"))
    };
    meshes.into_iter().enumerate().map(build).collect()
}

/// The view over a town: low, along the streets.
pub fn view(width: u32, height: u32) -> View {
    let camera = Camera {
        position: DVec3::new(-20.0, 60.0, 150.0),
        look_at: DVec3::new(40.0, 0.0, -60.0),
        field_of_view: 45.0,
        ..Camera::default()
    };
    let raster = Raster::new(width, height).expect("sizes of tests are in range");
    View::new(&camera, raster).expect("a camera")
}

fn meshes(triangles: usize, count: usize) -> Vec<Mesh> {
    let mut random = Random::new(7);
    // A house with windows has about 60 to 300 triangles; smaller towns get plainer houses.
    let per_house = if triangles > 200_000 { 250 } else { 90 };
    let houses = (triangles / per_house).max(1);
    let side = (houses as f64).sqrt().ceil() as usize;
    let pitch = 240.0 / side as f64;
    let mut meshes = vec![Mesh::default(); count];
    for mesh in &mut meshes {
        mesh.materials = (0..COLORS).map(|i| format!("color {i}")).collect();
    }
    for house in 0..houses {
        let (i, j) = (house % side, house / side);
        let mesh = &mut meshes[(i / 2) % count];
        let centre = DVec3::new(
            (i as f64 - side as f64 / 2.0) * pitch,
            0.0,
            (j as f64 - side as f64 / 2.0) * pitch,
        );
        let size = DVec3::new(
            pitch * random.between(0.5, 0.8),
            pitch * random.between(0.4, 2.2),
            pitch * random.between(0.5, 0.8),
        );
        build_house(mesh, centre, size, per_house, &mut random);
    }
    let half = 130.0;
    let ground = [[-half, -half], [half, -half], [half, half], [-half, half]];
    let ring: Vec<u32> =
        ground.iter().rev().map(|p| meshes[0].add_point([p[0], 0.0, p[1]])).collect();
    meshes[0].add_polygon(&ring, Some(0)).expect("four corners");
    meshes
}

fn build_house(mesh: &mut Mesh, centre: DVec3, size: DVec3, triangles: usize, random: &mut Random) {
    let half = DVec3::new(size.x / 2.0, size.y, size.z / 2.0);
    let wall = random.below(COLORS as u32);
    build_box(mesh, centre, half, wall);
    // The gable: two sloping sides and two triangles.
    let roof = random.below(COLORS as u32);
    let ridge = size.y + size.x * 0.3;
    let at = |mesh: &mut Mesh, x: f64, y: f64, z: f64| mesh.add_point(centre + DVec3::new(x, y, z));
    let corners: Vec<u32> = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .iter()
        .map(|(x, z)| at(mesh, x * half.x, size.y, z * half.z))
        .collect();
    let (back, front) = (at(mesh, 0.0, ridge, -half.z), at(mesh, 0.0, ridge, half.z));
    let mut add = |ring: &[u32], color| {
        mesh.add_polygon(ring, Some(color)).expect("three corners or four");
    };
    add(&[corners[1], back, front, corners[2]], roof);
    add(&[corners[3], front, back, corners[0]], roof);
    add(&[corners[0], back, corners[1]], wall);
    add(&[corners[2], front, corners[3]], wall);
    // Windows: shallow boxes on the four walls.
    let windows = triangles.saturating_sub(18) / 10;
    let per_wall = windows.div_ceil(4);
    let columns = (per_wall as f64).sqrt().ceil() as usize;
    for w in 0..windows {
        let (side, n) = (w % 4, w / 4);
        let (column, row) = (n % columns, n / columns);
        let rows = per_wall.div_ceil(columns);
        let u = ((column as f64 + 0.5) / columns as f64 - 0.5) * 2.0;
        let v = (row as f64 + 0.6) / (rows as f64 + 0.2) * size.y;
        let across = if side % 2 == 0 { half.x } else { half.z };
        let (w, h, d) = (across / columns as f64 * 0.5, size.y / rows as f64 * 0.3, size.x * 0.02);
        let sign = if side < 2 { 1.0 } else { -1.0 };
        let (offset, extent) = if side % 2 == 0 {
            (DVec3::new(u * across, v, sign * half.z), DVec3::new(w, h, d))
        } else {
            (DVec3::new(sign * half.x, v, u * across), DVec3::new(d, h, w))
        };
        build_box(mesh, centre + offset - DVec3::Y * h / 2.0, extent, random.below(COLORS as u32));
    }
}

/// A box on its base's centre, without its underside.
fn build_box(mesh: &mut Mesh, base: DVec3, half: DVec3, color: u32) {
    let corner = |i: u32| {
        let sign = |bit: u32| if i & bit == 0 { -1.0 } else { 1.0 };
        base + DVec3::new(half.x * sign(1), if i & 2 == 0 { 0.0 } else { half.y }, half.z * sign(4))
    };
    let c: Vec<u32> = (0..8).map(|i| mesh.add_point(corner(i))).collect();
    for quad in [[4, 5, 7, 6], [1, 0, 2, 3], [5, 1, 3, 7], [0, 4, 6, 2], [6, 7, 3, 2]] {
        mesh.add_polygon(&quad.map(|i| c[i]), Some(color)).expect("four corners");
    }
}
