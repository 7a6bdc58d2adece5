//! PLY, in text and both binary forms.
//!
//! A file is one object, called as the file. Points (`x y z`), normals (`nx ny nz`), texture coordinates (`s t`,
//! `u v`, `texture_u texture_v`, or `texcoord` by corner of a face), colours (`red green blue alpha`, also as `r`,
//! `diffuse_red`), faces (`vertex_indices`, `vertex_index`) and strips of triangles are read; a picture that a
//! comment `TextureFile` names lies on the faces. What else there is, is noted.
//!
//! What the format does not say: units are metres and up is y; whole numbers of a colour are sRGB, of which 1 is the
//! largest of bytes and of 16 bits, and other numbers are scene-linear. What has colours is white but for them, what
//! has none is a grey of 0.8. Alpha lets through what is behind, unless it is 0 everywhere. Without normals faces are
//! flat (`crease` smooths them).

mod header;
mod values;

use glam::{DVec3, Vec2, Vec3};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use self::header::{Element, Encoding, Property, Type};
use self::values::Values;
use super::super::document::{Document, Object, Plan};
use super::super::material::{AlphaMode, Map, Material, Picture};
use super::super::mesh::Mesh;
use super::super::shape::Shape;
use super::colors;
use super::reader::Reader;
use crate::color::{Color, decode_srgb};
use crate::error::{Error, Result};
use crate::watch::Watch;

pub(super) fn read(reader: &mut Reader, bytes: &[u8]) -> Result<Document> {
    let path = reader.path.clone();
    let end = header::end(bytes);
    // The head is text, even in front of binary data: only it is read as such.
    let head = end.map(|end| &bytes[..end]).filter(|head| head.starts_with(b"ply"));
    let head = head.map(|head| reader.text(head)).transpose()?;
    let header = head.map(|head| header::parse(&path, &head)).transpose()?;
    let text;
    let (header, mut values) = match (header, end) {
        (Some(header), Some(end)) if header.encoding != Encoding::Ascii => {
            let values = Values::binary(&path, bytes, end, header.encoding);
            (header, values)
        }
        _ => {
            text = reader.text(bytes)?;
            let header = header::parse(&path, &text)?;
            let end = header::end(text.as_bytes()).unwrap_or(text.len());
            (header, Values::Ascii(super::words::Words::from(&path, &text, end)))
        }
    };
    let mut body = Body::default();
    for element in &header.elements {
        body.read(reader, element, &mut values)?;
    }
    if values.left() > 0 {
        let left = values.left();
        reader.note(format!("{left} bytes behind the last element are not read"));
    }
    let (mesh, materials) = body.into_mesh(reader, &header.pictures)?;
    let children = vec![Object::new(reader.stem(), Shape::Faces(mesh))];
    let root = Object { children, ..Object::default() };
    let plan = Plan { name: reader.stem(), root, ..Plan::default() };
    Ok(Document { materials, ..Document::with_plan(plan) })
}

/// Where a number of a vertex goes.
#[derive(Clone, Copy)]
enum Slot {
    Point(usize),
    Normal(usize),
    Uv(usize),
    Color(usize, Type),
    Unused,
}

impl Slot {
    fn of(property: &Property) -> Slot {
        if property.length.is_some() {
            return Slot::Unused;
        }
        match property.name.as_str() {
            "x" => Slot::Point(0),
            "y" => Slot::Point(1),
            "z" => Slot::Point(2),
            "nx" => Slot::Normal(0),
            "ny" => Slot::Normal(1),
            "nz" => Slot::Normal(2),
            "s" | "u" | "texture_u" => Slot::Uv(0),
            "t" | "v" | "texture_v" => Slot::Uv(1),
            "red" | "r" | "diffuse_red" => Slot::Color(0, property.of),
            "green" | "g" | "diffuse_green" => Slot::Color(1, property.of),
            "blue" | "b" | "diffuse_blue" => Slot::Color(2, property.of),
            "alpha" | "a" | "diffuse_alpha" => Slot::Color(3, property.of),
            _ => Slot::Unused,
        }
    }
}

/// What was read.
#[derive(Default)]
struct Body {
    points: Vec<DVec3>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    colors: Vec<[f32; 4]>,
    /// Whether colours came as numbers that are not whole.
    are_linear: bool,
    faces: Vec<Vec<u32>>,
    /// By face, texture coordinates by corner, and the number of the picture.
    corners: HashMap<usize, Vec<f32>>,
    pictures: HashMap<usize, Option<u32>>,
}

impl Body {
    fn read(
        &mut self,
        reader: &mut Reader,
        element: &Element,
        values: &mut Values<'_>,
    ) -> Result<()> {
        let Element { name, count, properties, line } = element;
        // Without properties it takes no bytes, and the test below would refuse it.
        if properties.is_empty() {
            return Ok(());
        }
        // Each takes a byte at the least.
        if *count > values.left() {
            let message = format!(
                "{count} of \"{name}\" are announced, and {} bytes are left",
                values.left()
            );
            return Err(Error::at_line(&reader.path, *line, 1, message));
        }
        let unused = match name.as_str() {
            "vertex" => self.vertices(&reader.path, element, values)?,
            "face" => self.polygons(element, values)?,
            "tristrips" => self.strips(element, values)?,
            _ => {
                for _ in 0..*count {
                    // What is not shown must be read all the same: only its properties tell how
                    // long it is.
                    for property in properties {
                        self::list(property, values)?;
                    }
                    values.end(element)?;
                }
                reader.note(format!("{count} elements \"{name}\" are not shown"));
                return Ok(());
            }
        };
        if !unused.is_empty() {
            let unused = unused.join(", ");
            reader.note(format!("of each \"{name}\" these are not shown: {unused}"));
        }
        Ok(())
    }

    fn vertices(
        &mut self,
        path: &Path,
        element: &Element,
        values: &mut Values<'_>,
    ) -> Result<Vec<String>> {
        let slots: Vec<Slot> = element.properties.iter().map(Slot::of).collect();
        let has = |wanted: fn(&Slot) -> bool| slots.iter().any(wanted);
        let points = slots.iter().filter(|slot| matches!(slot, Slot::Point(_))).count();
        if points != 3 {
            let message = format!("vertices have {points} of the numbers x, y and z");
            return Err(Error::at_line(path, element.line, 1, message));
        }
        let has_normals = has(|slot| matches!(slot, Slot::Normal(_)));
        let has_uvs = has(|slot| matches!(slot, Slot::Uv(_)));
        let has_colors = has(|slot| matches!(slot, Slot::Color(0..=2, _)));
        self.are_linear = has(|slot| matches!(slot, Slot::Color(0..=2, of) if !of.is_whole()));
        let watch = Watch::current();
        for at in 0..element.count {
            watch.check()?;
            let (mut point, mut normal) = ([0.0; 3], [0.0; 3]);
            let (mut uv, mut color) = ([0.0; 2], [0.0, 0.0, 0.0, 1.0]);
            for (property, slot) in element.properties.iter().zip(&slots) {
                if property.length.is_some() {
                    list(property, values)?;
                    continue;
                }
                let value = values.next(property.of)?;
                match *slot {
                    Slot::Point(_) if !value.is_finite() => {
                        return Err(values
                            .fault(format!("vertex {at} has a coordinate that is not finite")));
                    }
                    Slot::Point(i) => point[i] = value,
                    Slot::Normal(i) => normal[i] = value as f32,
                    Slot::Uv(i) => uv[i] = value as f32,
                    Slot::Color(i, of) => {
                        let share = (value / of.one()) as f32;
                        // Alpha is a share, never coded.
                        color[i] = if i < 3 && of.is_whole() { decode_srgb(share) } else { share };
                    }
                    Slot::Unused => {}
                }
            }
            values.end(element)?;
            self.points.push(DVec3::from(point));
            if has_normals {
                self.normals.push(Vec3::from(normal).normalize_or_zero());
            }
            if has_uvs {
                self.uvs.push(Vec2::from(uv));
            }
            if has_colors {
                self.colors.push(color);
            }
        }
        let is_unused = |(slot, _): &(&Slot, &Property)| match slot {
            Slot::Unused => true,
            Slot::Color(3, _) => !has_colors,
            _ => false,
        };
        let all = slots.iter().zip(&element.properties);
        Ok(all.filter(is_unused).map(|(_, property)| property.name.clone()).collect())
    }

    fn polygons(&mut self, element: &Element, values: &mut Values<'_>) -> Result<Vec<String>> {
        let is_list = |at: &usize| element.properties[*at].length.is_some();
        let indices = element.find(&["vertex_indices", "vertex_index"]).filter(is_list);
        let corners = element.find(&["texcoord"]).filter(is_list);
        let picture = element.find(&["texnumber"]).filter(|at| !is_list(at));
        let watch = Watch::current();
        for _ in 0..element.count {
            watch.check()?;
            let at = self.faces.len();
            for (i, property) in element.properties.iter().enumerate() {
                let list = list(property, values)?;
                if Some(i) == indices {
                    self.faces.push(self::indices(&list, values)?);
                } else if Some(i) == corners && !list.is_empty() {
                    // An empty list leaves the face without coordinates.
                    self.corners.insert(at, list.iter().map(|v| *v as f32).collect());
                } else if Some(i) == picture {
                    // Below 0: it has none.
                    let number = (list[0] >= 0.0).then_some(list[0] as u32);
                    self.pictures.insert(at, number);
                }
            }
            values.end(element)?;
        }
        let used = [indices, corners, picture];
        let unused =
            element.properties.iter().enumerate().filter(|(i, _)| !used.contains(&Some(*i)));
        Ok(unused.map(|(_, property)| property.name.clone()).collect())
    }

    /// Strips of triangles, of which every second is turned; -1 begins another.
    fn strips(&mut self, element: &Element, values: &mut Values<'_>) -> Result<Vec<String>> {
        let indices = element.find(&["vertex_indices", "vertex_index"]);
        let watch = Watch::current();
        for _ in 0..element.count {
            watch.check()?;
            for (i, property) in element.properties.iter().enumerate() {
                let list = list(property, values)?;
                if Some(i) != indices {
                    continue;
                }
                // Every strip begins anew with a triangle that is not turned.
                for strip in list.split(|index| *index == -1.0) {
                    let strip = self::indices(strip, values)?;
                    for (k, corners) in strip.windows(3).enumerate() {
                        let [a, b, c] = [corners[0], corners[1], corners[2]];
                        // Those are for turning round corners.
                        if a != b && b != c && c != a {
                            self.faces.push(if k % 2 == 0 { vec![a, b, c] } else { vec![b, a, c] });
                        }
                    }
                }
            }
            values.end(element)?;
        }
        let unused = element.properties.iter().enumerate().filter(|(i, _)| Some(*i) != indices);
        Ok(unused.map(|(_, property)| property.name.clone()).collect())
    }

    fn into_mesh(
        mut self,
        reader: &mut Reader,
        pictures: &[String],
    ) -> Result<(Mesh, BTreeMap<String, Material>)> {
        if self.faces.is_empty() {
            let count = self.points.len();
            let message =
                format!("no faces: {count} points alone are not shown, make a mesh of them first");
            return Err(reader.fault(message));
        }
        colors::settle(reader, &mut self.colors, self.are_linear);
        let mut materials = BTreeMap::new();
        let mut mesh = Mesh { points: self.points, normals: self.normals, ..Mesh::default() };
        (mesh.uvs, mesh.colors) = (self.uvs, self.colors);
        let alpha_mode = colors::alpha_mode(reader, &mut mesh.colors);
        for (at, name) in pictures.iter().enumerate() {
            let maps = BTreeMap::from([(
                "color".to_owned(),
                Map::of(Picture::File(name.replace('\\', "/"))),
            )]);
            let material =
                Material { color: Color::WHITE, alpha_mode, maps, ..Material::default() };
            let name = format!("picture {at}");
            mesh.materials.push(name.clone());
            materials.insert(name, material);
        }
        if pictures.is_empty() && alpha_mode == AlphaMode::Blend {
            // Alpha by vertex needs a material that blends; all else is what faces without a
            // material show.
            mesh.materials.push("by vertex".to_owned());
            let material = Material { color: Color::WHITE, alpha_mode, ..Material::default() };
            materials.insert("by vertex".to_owned(), material);
        }
        let mut corner = Corners::default();
        if pictures.is_empty() {
            self.corners.clear();
        } else if self.corners.is_empty() && mesh.uvs.is_empty() {
            reader.note("it has a picture and no coordinates for it");
        }
        // Every vertex needs coordinates as soon as one has some.
        if !self.corners.is_empty() {
            mesh.uvs.resize(mesh.points.len(), Vec2::ZERO);
        }
        let count = mesh.points.len();
        for (at, mut face) in self.faces.into_iter().enumerate() {
            let fault = |e: Error| reader.fault(format!("face {at}: {e}"));
            if let Some(index) = face.iter().find(|index| **index as usize >= count) {
                let message = format!("corner {index} of a mesh with {count} vertices");
                return Err(fault(Error::invalid(message)));
            }
            if let Some(uvs) = self.corners.get(&at) {
                if uvs.len() != 2 * face.len() {
                    let message =
                        format!("{} texture coordinates for {} corners", uvs.len(), face.len());
                    return Err(fault(Error::invalid(message)));
                }
                for (index, uv) in face.iter_mut().zip(uvs.chunks_exact(2)) {
                    *index = corner.with_uv(&mut mesh, *index, Vec2::new(uv[0], uv[1]));
                }
            }
            let front = match mesh.materials.len() as u32 {
                0 => None,
                count => {
                    let number = self.pictures.get(&at).copied().unwrap_or(Some(0));
                    number.map(|number| number.min(count - 1))
                }
            };
            mesh.add_polygon(&face, front).map_err(fault)?;
        }
        mesh.validate().map_err(|e| reader.fault(e.to_string()))?;
        Ok((mesh, materials))
    }
}

/// Vertices with texture coordinates by corner: one is doubled for each that it has.
#[derive(Default)]
struct Corners(HashMap<(u32, [u32; 2]), u32>);

impl Corners {
    fn with_uv(&mut self, mesh: &mut Mesh, index: u32, uv: Vec2) -> u32 {
        let from = index as usize;
        *self.0.entry((index, uv.to_array().map(f32::to_bits))).or_insert_with(|| {
            mesh.points.push(mesh.points[from]);
            mesh.uvs.push(uv);
            if !mesh.normals.is_empty() {
                mesh.normals.push(mesh.normals[from]);
            }
            if !mesh.colors.is_empty() {
                mesh.colors.push(mesh.colors[from]);
            }
            mesh.points.len() as u32 - 1
        })
    }
}

/// The numbers of a property: one, or those of its list.
fn list(property: &Property, values: &mut Values<'_>) -> Result<Vec<f64>> {
    let count = match property.length {
        Some(of) => values.length(of)?,
        None => 1,
    };
    (0..count).map(|_| values.next(property.of)).collect()
}

fn indices(list: &[f64], values: &Values<'_>) -> Result<Vec<u32>> {
    let index = |value: &f64| {
        let is_index = *value >= 0.0 && value.fract() == 0.0 && *value < f64::from(u32::MAX);
        is_index
            .then_some(*value as u32)
            .ok_or_else(|| values.fault(format!("{value} is no number of a vertex")))
    };
    list.iter().map(index).collect()
}
