//! The sky: a wall of glowing bands in front, and behind the camera half a dome, brightest around the sun,
//! which only windows show.

use glam::DVec3;
use spandrel_engine::color::Color;
use spandrel_engine::math;
use spandrel_engine::scene::{Document, Material, Mesh, Object, Plan, Shape};

/// The sky: bands of colour on a wall far away, not lit.
pub(crate) fn sky() -> Document {
    let mut document = Document::default();
    let material = Material { color: Color::WHITE, unlit: true, ..Material::default() };
    document.materials.insert("sky".to_owned(), material);
    let mut mesh = Mesh::default();
    let bands: [(f64, [u8; 3]); 6] = [
        (-120.0, [0xe9, 0xcf, 0xa8]),
        (60.0, [0xee, 0xd6, 0xb0]),
        (300.0, [0xe6, 0xd6, 0xbf]),
        (700.0, [0xc9, 0xcf, 0xcb]),
        (1300.0, [0xa3, 0xbb, 0xc9]),
        (2600.0, [0x7d, 0xa2, 0xbd]),
    ];
    for (y, color) in bands {
        let color = Color::from_srgb8(color);
        for x in [-12000.0, 12000.0] {
            mesh.points.push(DVec3::new(x, y, -3600.0));
            mesh.colors.push([color.r, color.g, color.b, 1.0].map(|v| (v * 1e4).round() / 1e4));
        }
    }
    for i in 0..bands.len() as u32 - 1 {
        mesh.add_polygon(&[2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2], None).expect("four corners");
    }
    let root = Object {
        children: vec![
            Object::new("sky", Shape::Faces(mesh)).of("sky"),
            Object::new("behind", Shape::Faces(behind())).of("sky"),
        ],
        ..Object::default()
    };
    document.plans.push(Plan { name: "sky".to_owned(), root, ..Plan::default() });
    document
}

/// The sky all round but in front: from 70 degrees to the right to 70 to the left.
fn behind() -> Mesh {
    let sun = DVec3::new(0.72, 0.42, 0.62).normalize();
    // Below the horizon, land in haze.
    let bands: [(f64, [f64; 3]); 9] = [
        (-50.0, [0.3, 0.28, 0.25]),
        (-4.0, [0.5, 0.43, 0.34]),
        (-0.5, [0.78, 0.62, 0.43]),
        (1.5, [0.86, 0.67, 0.44]),
        (6.0, [0.8, 0.68, 0.52]),
        (14.0, [0.58, 0.62, 0.6]),
        (28.0, [0.36, 0.5, 0.58]),
        (55.0, [0.22, 0.36, 0.5]),
        (90.0, [0.16, 0.28, 0.44]),
    ];
    let mut mesh = Mesh::default();
    const COLUMNS: u32 = 22;
    for i in 0..=COLUMNS {
        let round = (70.0 + 220.0 * f64::from(i) / f64::from(COLUMNS)).to_radians();
        for (up, color) in bands {
            let (sin, cos) = (math::sin(up.to_radians()), math::cos(up.to_radians()));
            let toward = DVec3::new(cos * math::sin(round), sin, -cos * math::cos(round));
            let off = math::acos(toward.dot(sun)).to_degrees();
            let glow = |wide: f64| math::exp(-(off / wide) * (off / wide));
            let warm = [1.5, 1.0, 0.5].map(|v| v * glow(24.0));
            let color = [0, 1, 2].map(|k| color[k] + warm[k] + 0.3 * glow(60.0) * color[k]);
            mesh.points.push((toward * 5000.0).round());
            let [r, g, b] = color.map(|v| (v * 1e3).round() as f32 / 1e3);
            mesh.colors.push([r, g, b, 1.0]);
        }
    }
    let rows = bands.len() as u32;
    for i in 0..COLUMNS {
        for j in 0..rows - 1 {
            let at = |column: u32, row: u32| column * rows + row;
            let corners = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            let top = if j == rows - 2 { &[0usize, 1, 3][..] } else { &[0, 1, 2, 3] };
            let corners: Vec<u32> = top.iter().map(|k| corners[*k]).collect();
            mesh.add_polygon(&corners, None).expect("three corners or four");
        }
    }
    mesh
}
