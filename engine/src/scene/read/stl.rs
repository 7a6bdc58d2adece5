//! STL, by the `stl_io` library.

use glam::DVec3;
use std::io::Cursor;

use super::super::document::{Document, Object, Plan};
use super::super::mesh::Mesh;
use super::super::shape::Shape;
use super::Reader;
use crate::error::{Error, Result};

pub(super) fn read(reader: &mut Reader, bytes: &[u8]) -> Result<Document> {
    let mut bytes = bytes.to_vec();
    // Some binary files begin with "solid", the mark of the text form; their length tells.
    let count = bytes.get(80..84).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let is_binary = count.is_some_and(|n| bytes.len() as u64 == 84 + 50 * u64::from(n));
    if is_binary {
        bytes[0] = b' ';
    }
    let mut cursor = Cursor::new(&bytes[..]);
    let stl = stl_io::read_stl(&mut cursor).map_err(|e| {
        let is_text = !is_binary && bytes.starts_with(b"solid");
        if is_text {
            return Error::in_file(&reader.path, format!("not an STL file: {e}"));
        }
        let rest = bytes.len().saturating_sub(84) / 50;
        let message =
            format!("{e}: {} triangles are announced, {rest} are there", count.unwrap_or(0));
        Error::at_byte(&reader.path, cursor.position(), message)
    })?;
    let points = stl.vertices.iter().map(|v| DVec3::from([v[0], v[1], v[2]].map(f64::from)));
    let mut mesh = Mesh { points: points.collect(), ..Mesh::default() };
    for face in &stl.faces {
        let corners = face.vertices.map(|i| i as u32);
        mesh.add_polygon(&corners, None).map_err(|e| reader.fault(e.to_string()))?;
    }
    mesh.validate().map_err(|e| reader.fault(e.to_string()))?;
    if mesh.face_count() == 0 {
        return Err(reader.fault("no triangles"));
    }
    let root = Object {
        children: vec![Object::new(reader.stem(), Shape::Faces(mesh))],
        ..Object::default()
    };
    Ok(Document::with_plan(Plan { name: reader.stem(), root, ..Plan::default() }))
}
