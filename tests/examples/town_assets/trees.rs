//! Trees made of triangles.

use glam::{DVec3, Vec3};
use spandrel_engine::math;
use spandrel_engine::scene::{Document, Mesh, Object, Shape, Step};
use spandrel_tests::random::Random;

use super::kit::*;

pub(crate) fn trees() -> Document {
    let materials = [
        ("bark", "#6b5a49"),
        ("leaves", "#7b8657"),
        ("gold leaves", "#ab9557"),
        ("rust leaves", "#9c714c"),
    ];
    let definitions = (0..3).map(|i| tree(&format!("tree {i}"), i)).collect();
    let mut random = Random::new(3);
    let mut children = Vec::new();
    let leaves = ["leaves", "leaves", "gold leaves", "leaves", "rust leaves"];
    for side in [-1.0, 1.0] {
        for i in 0..21 {
            let z = 14.0 - 12.5 * f64::from(i);
            // None where the side streets are.
            if [-52.3, -121.0, -181.0].iter().any(|street: &f64| (z - street).abs() < 7.0) {
                continue;
            }
            let kind = format!("tree {}", random.below(3));
            let (size, turn) = (mm(random.between(0.85, 1.2)), mm(random.between(0.0, 360.0)));
            let mut tree = instance(&kind).of(leaves[random.below(5) as usize]);
            tree.name = format!("{} {i}", if side < 0.0 { "left" } else { "right" });
            tree.transform.0.extend([Step::TurnY(turn), Step::Scale(size)]);
            children.push(tree.moved([mm(8.6 * side), 0.15, mm(z)]));
        }
    }
    document(&materials, definitions, children)
}

/// A tree of triangles: a trunk, boughs, and leaves whose normals are those of the crown.
pub(crate) fn tree(name: &str, seed: u64) -> Object {
    let mut random = Random::new(40 + seed);
    let mut parts = vec![
        Object::new(
            "trunk",
            Shape::Cone { radius: 0.2, top_radius: 0.1, height: 4.2, segments: 9, smooth: true },
        )
        .of("bark"),
    ];
    let mut mesh = Mesh::default();
    let crown = DVec3::new(0.0, 5.2, 0.0);
    let blobs: Vec<(DVec3, f64)> = (0..7)
        .map(|i| {
            let a = f64::from(i) * 2.4 + random.between(0.0, 0.6);
            let r = if i == 0 { 0.0 } else { random.between(0.7, 1.25) };
            let y = if i == 0 { 0.7 } else { random.between(-0.9, 1.2) };
            (crown + p(r * math::cos(a), y, r * math::sin(a)), random.between(0.95, 1.4))
        })
        .collect();
    for (at, _) in blobs.iter().skip(1) {
        let from = DVec3::new(0.0, 3.1, 0.0);
        let along = *at - from;
        let across = along.any_orthonormal_vector() * 0.055;
        let other = along.normalize().cross(across);
        let ring = [
            p(from.x, from.y, from.z) + across,
            from - across * 0.5 + other,
            from - across * 0.5 - other,
        ];
        let tip = p(at.x, at.y, at.z);
        let mut bough = Mesh::default();
        let corners: Vec<u32> = ring.iter().map(|q| bough.add_point(p(q.x, q.y, q.z))).collect();
        let top = bough.add_point(tip);
        for i in 0..3 {
            bough.add_polygon(&[corners[i], corners[(i + 1) % 3], top], None).expect("three");
        }
        parts.push(Object::new("bough", Shape::Faces(bough)).of("bark"));
    }
    for leaf in 0..820 {
        let (centre, radius) = blobs[leaf % blobs.len()];
        let mut direction = DVec3::new(
            random.between(-1.0, 1.0),
            random.between(-0.8, 1.0),
            random.between(-1.0, 1.0),
        );
        direction = direction.try_normalize().unwrap_or(DVec3::Y);
        let at = centre + direction * radius * random.between(0.62, 1.0);
        let out = (at - crown + DVec3::Y * 0.4).normalize() * 0.6 + direction * 0.4;
        let out = out.normalize();
        let lean = DVec3::new(
            random.between(-1.0, 1.0),
            random.between(-1.0, 1.0),
            random.between(-1.0, 1.0),
        );
        let u = (out + lean * 0.9).any_orthonormal_vector().normalize();
        let v = (out + lean * 0.5).normalize().cross(u).normalize();
        let size = random.between(0.15, 0.27);
        let shade = (random.between(0.7, 1.15)
            * (0.72 + 0.28 * ((at - crown).length() / 2.4).min(1.0))) as f32;
        let shade = (shade * 100.0).round() / 100.0;
        let mut corners: Vec<DVec3> = [0.2, 2.3, 4.4]
            .iter()
            .map(|angle| at + (u * math::cos(*angle) + v * math::sin(*angle)) * size)
            .collect();
        if (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(out) < 0.0 {
            corners.swap(1, 2);
        }
        let first = mesh.points.len() as u32;
        for corner in corners {
            mesh.points.push(p(corner.x, corner.y, corner.z));
            let n = out.as_vec3();
            let round = |v: f32| (v * 1000.0).round() / 1000.0;
            mesh.normals.push(Vec3::new(round(n.x), round(n.y), round(n.z)));
            mesh.colors.push([shade, shade, shade, 1.0]);
        }
        mesh.add_polygon(&[first, first + 1, first + 2], None).expect("three corners");
    }
    parts.push(Object::new("leaves", Shape::Faces(mesh)));
    group(name, parts)
}
