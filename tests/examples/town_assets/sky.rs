//! The sky, a wall of glowing bands.

use glam::DVec3;
use spandrel_engine::color::Color;
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
        children: vec![Object::new("sky", Shape::Faces(mesh)).of("sky")],
        ..Object::default()
    };
    document.plans.push(Plan { name: "sky".to_owned(), root, ..Plan::default() });
    document
}
