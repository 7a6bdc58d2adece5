//! PLY, by the `ply-rs-bw` library.

use glam::{DVec3, Vec2, Vec3};
use ply_rs_bw::parser::{self, Parser};
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult, PropertyType};

use super::super::document::{Document, Object, Plan};
use super::super::mesh::Mesh;
use super::super::shape::Shape;
use super::Reader;
use crate::color::decode_srgb;
use crate::error::{Error, Result};

/// One element of any kind: a vertex fills the numbers, a face the corners.
#[derive(Default)]
struct Element {
    point: [f64; 3],
    normal: [f32; 3],
    uv: [f32; 2],
    color: [f32; 4],
    corners: Vec<u32>,
    bad_corner: bool,
}

impl PropertyAccess for Element {
    fn new() -> Element {
        Element { color: [0.0, 0.0, 0.0, 1.0], ..Element::default() }
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        if matches!(name, "vertex_indices" | "vertex_index") {
            match indices(&value) {
                Some(corners) => self.corners = corners,
                None => self.bad_corner = true,
            }
            return PropertyAccessResult::Set;
        }
        let Some((number, whole)) = number(&value) else { return PropertyAccessResult::Ignored };
        // Colours in whole numbers are sRGB, others linear; alpha always is a share.
        let share = if whole { number / 255.0 } else { number } as f32;
        let color = if whole { decode_srgb(share) } else { share };
        match name {
            "x" => self.point[0] = number,
            "y" => self.point[1] = number,
            "z" => self.point[2] = number,
            "nx" => self.normal[0] = number as f32,
            "ny" => self.normal[1] = number as f32,
            "nz" => self.normal[2] = number as f32,
            "s" | "u" | "texture_u" => self.uv[0] = number as f32,
            "t" | "v" | "texture_v" => self.uv[1] = number as f32,
            "red" | "r" => self.color[0] = color,
            "green" | "g" => self.color[1] = color,
            "blue" | "b" => self.color[2] = color,
            "alpha" | "a" => self.color[3] = share,
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

/// A scalar, and whether its type holds whole numbers.
fn number(value: &Property) -> Option<(f64, bool)> {
    Some(match value {
        Property::Char(v) => (f64::from(*v), true),
        Property::UChar(v) => (f64::from(*v), true),
        Property::Short(v) => (f64::from(*v), true),
        Property::UShort(v) => (f64::from(*v), true),
        Property::Int(v) => (f64::from(*v), true),
        Property::UInt(v) => (f64::from(*v), true),
        Property::Float(v) => (f64::from(*v), false),
        Property::Double(v) => (*v, false),
        _ => return None,
    })
}

fn indices(value: &Property) -> Option<Vec<u32>> {
    fn all<T: Copy + TryInto<u32>>(list: &[T]) -> Option<Vec<u32>> {
        list.iter().map(|v| (*v).try_into().ok()).collect()
    }
    match value {
        Property::ListChar(v) => all(v),
        Property::ListUChar(v) => all(v),
        Property::ListShort(v) => all(v),
        Property::ListUShort(v) => all(v),
        Property::ListInt(v) => all(v),
        Property::ListUInt(v) => all(v),
        _ => None,
    }
}

pub(super) fn read(reader: &mut Reader, bytes: &[u8]) -> Result<Document> {
    let path = reader.path.clone();
    let mut source = parser::Reader::new(bytes);
    let parser = Parser::<Element>::new();
    let fault = |source: &parser::Reader<&[u8]>, e: parser::ParseError| match e.line() {
        Some(line) => Error::at_line(&path, line, 1, e.to_string()),
        None => Error::at_byte(&path, (bytes.len() - source.get_ref().len()) as u64, e.to_string()),
    };
    let header = parser.read_header(&mut source).map_err(|e| fault(&source, e))?;
    let mut vertices = Vec::new();
    let mut faces = Vec::new();
    let mut names: Vec<String> = Vec::new();
    for element in header.elements.values() {
        let read = parser.read_payload_for_element(&mut source, element, &header);
        let elements = read.map_err(|e| fault(&source, e))?;
        match element.name.as_str() {
            "vertex" => {
                names = element.properties.keys().cloned().collect();
                check_types(reader, element)?;
                vertices = elements;
            }
            "face" => faces = elements,
            name => reader.note(format!("elements \"{name}\" are not used")),
        }
    }
    let given = |all: &[&str]| all.iter().any(|name| names.iter().any(|known| known == name));
    if !given(&["x"]) || faces.is_empty() {
        return Err(reader.fault("no vertices with x, y, z, or no faces with vertex_indices"));
    }
    let points = vertices.iter().map(|v| DVec3::from(v.point)).collect();
    let mut mesh = Mesh { points, ..Mesh::default() };
    if given(&["nx"]) {
        mesh.normals = vertices.iter().map(|v| Vec3::from(v.normal).normalize_or_zero()).collect();
    }
    if given(&["s", "u", "texture_u"]) {
        mesh.uvs = vertices.iter().map(|v| Vec2::from(v.uv)).collect();
    }
    if given(&["red", "r"]) {
        mesh.colors = vertices.iter().map(|v| v.color).collect();
    }
    for (at, face) in faces.iter().enumerate() {
        let added = if face.bad_corner {
            Err(Error::invalid("a corner below 0"))
        } else {
            mesh.add_polygon(&face.corners, None)
        };
        added.map_err(|e| reader.fault(format!("face {at}: {e}")))?;
    }
    mesh.validate().map_err(|e| reader.fault(e.to_string()))?;
    let root = Object {
        children: vec![Object::new(reader.stem(), Shape::Faces(mesh))],
        ..Object::default()
    };
    Ok(Document::with_plan(Plan { name: reader.stem(), root, ..Plan::default() }))
}

/// Refuses vertices whose coordinates are lists.
fn check_types(reader: &Reader, element: &ply_rs_bw::ply::ElementDef) -> Result<()> {
    for name in ["x", "y", "z"] {
        if let Some(property) = element.properties.get(name)
            && !matches!(property.data_type, PropertyType::Scalar(_))
        {
            return Err(reader.fault(format!("the vertex property \"{name}\" is a list")));
        }
    }
    Ok(())
}
