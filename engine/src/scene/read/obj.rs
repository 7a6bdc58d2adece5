//! Wavefront OBJ.
//!
//! Read here and not by a library because polygons must stay polygons, and faults must name their
//! line. Each `o` begins an object; in files without any, each `g` does.

use glam::{DVec3, Vec2, Vec3};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use super::super::document::{Document, Object, Plan};
use super::super::material::Material;
use super::super::mesh::Mesh;
use super::super::shape::Shape;
use super::{Names, Reader, mtl};
use crate::error::{Error, Result};

/// The words of a line, with their columns for errors.
pub(super) struct Words<'a> {
    path: &'a Path,
    number: usize,
    line: &'a str,
    rest: &'a str,
}

impl<'a> Words<'a> {
    pub(super) fn new(path: &'a Path, number: usize, line: &'a str) -> Words<'a> {
        // A `#` within a word is part of a name.
        let comment = line
            .match_indices('#')
            .find(|(at, _)| *at == 0 || line[..*at].ends_with(char::is_whitespace));
        let line = comment.map_or(line, |(at, _)| &line[..at]);
        Words { path, number, line, rest: line.trim() }
    }

    pub(super) fn peek(&self) -> Option<&'a str> {
        self.rest.split_whitespace().next()
    }

    pub(super) fn rest(&self) -> &'a str {
        self.rest.trim()
    }

    /// The column, from 1, of a word of this line.
    fn column(&self, word: &str) -> usize {
        let bytes = word.as_ptr() as usize - self.line.as_ptr() as usize;
        self.line.get(..bytes).map_or(1, |before| before.chars().count() + 1)
    }

    fn fault(&self, word: &str, message: impl Into<String>) -> Error {
        Error::at_line(self.path, self.number, self.column(word), message)
    }

    pub(super) fn number(&mut self) -> Result<f64> {
        let end = self.rest;
        let word = self.next().ok_or_else(|| self.fault(end, "a number is missing"))?;
        let value: f64 =
            word.parse().map_err(|_| self.fault(word, format!("\"{word}\" is not a number")))?;
        if !value.is_finite() {
            return Err(self.fault(word, format!("\"{word}\" is not a finite number")));
        }
        Ok(value)
    }

    fn numbers<const N: usize>(&mut self) -> Result<[f64; N]> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.number()?;
        }
        Ok(numbers)
    }
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a str;

    fn next(&mut self) -> Option<&'a str> {
        let word = self.peek()?;
        let start = word.as_ptr() as usize - self.rest.as_ptr() as usize;
        self.rest = self.rest[start + word.len()..].trim_start();
        Some(word)
    }
}

/// The file's shared lists.
#[derive(Default)]
struct Lists {
    points: Vec<DVec3>,
    colors: Vec<[f32; 4]>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
}

/// A corner as the file has it: point, texture coordinates, normal.
type Corner = (u32, Option<u32>, Option<u32>);

/// An object under construction.
#[derive(Default)]
struct Part {
    name: String,
    corners: Vec<Corner>,
    known: HashMap<Corner, u32>,
    faces: Vec<(Vec<u32>, Option<u32>)>,
    materials: Vec<String>,
}

pub(super) fn read(reader: &mut Reader, bytes: &[u8]) -> Result<Document> {
    let path = reader.path.clone();
    let text = String::from_utf8_lossy(bytes).replace("\\\r\n", "  ").replace("\\\n", " ");
    let has_objects = text.lines().any(|line| line.trim_start().starts_with("o "));
    let mut lists = Lists::default();
    let mut materials: BTreeMap<String, Material> = BTreeMap::new();
    let mut parts = vec![Part::default()];
    let mut material: Option<String> = None;
    for (number, line) in text.lines().enumerate() {
        let mut words = Words::new(&path, number + 1, line);
        let Some(keyword) = words.next() else { continue };
        match keyword {
            "v" => {
                lists.points.push(DVec3::from(words.numbers::<3>()?));
                let rest: Vec<&str> = words.rest().split_whitespace().collect();
                if rest.len() >= 3 {
                    let [r, g, b] = words.numbers::<3>()?;
                    lists.colors.resize(lists.points.len() - 1, [1.0; 4]);
                    lists.colors.push([r as f32, g as f32, b as f32, 1.0]);
                }
            }
            "vt" => {
                let u = words.number()? as f32;
                let v = if words.peek().is_some() { words.number()? as f32 } else { 0.0 };
                lists.uvs.push(Vec2::new(u, v));
            }
            "vn" => {
                let [x, y, z] = words.numbers::<3>()?;
                lists.normals.push(DVec3::new(x, y, z).normalize_or_zero().as_vec3());
            }
            "f" => {
                let part = parts.last_mut().expect("there is always a part");
                if let Some(remark) = face(part, &lists, &mut words, material.as_deref())? {
                    reader.note(remark);
                }
            }
            "o" | "g" if (keyword == "o") == has_objects => {
                parts.push(Part { name: words.rest().to_owned(), ..Part::default() });
            }
            "usemtl" => material = Some(words.rest().to_owned()).filter(|name| !name.is_empty()),
            "mtllib" => libraries(reader, words.rest(), &mut materials)?,
            _ => {}
        }
    }
    let mut names = Names::default();
    let mut root = Object::default();
    for part in parts.into_iter().filter(|part| !part.faces.is_empty()) {
        for name in &part.materials {
            if !materials.contains_key(name) {
                reader.note(format!("material \"{name}\" is not defined: a plain one is used"));
                materials.insert(name.clone(), Material::default());
            }
        }
        let name = names.unique(if part.name.is_empty() { "object" } else { &part.name });
        let mesh = part.into_mesh(&lists).map_err(|e| reader.fault(e.to_string()))?;
        root.children.push(Object::new(name, Shape::Faces(mesh)));
    }
    if root.children.is_empty() {
        return Err(reader.fault("no faces: an OBJ file has lines that begin with `f`"));
    }
    let plan = Plan { name: reader.stem(), root, ..Plan::default() };
    Ok(Document { materials, ..Document::with_plan(plan) })
}

/// Reads material libraries. The names of several are separated by blanks, but one name may have
/// blanks too.
fn libraries(
    reader: &mut Reader,
    names: &str,
    materials: &mut BTreeMap<String, Material>,
) -> Result<()> {
    if let Ok((path, bytes)) = reader.sibling(names) {
        materials.extend(mtl::read(&path, &bytes)?);
        return Ok(());
    }
    for name in names.split_whitespace() {
        match reader.sibling(name) {
            Ok((path, bytes)) => materials.extend(mtl::read(&path, &bytes)?),
            Err(error) => reader.note(format!("a material library is missing: {error}")),
        }
    }
    Ok(())
}

/// Adds a face: corners such as `1`, `1/2`, `1//3` or `1/2/3`, from 1, or from -1 backwards. Normals and
/// texture coordinates that do not exist are left out, with a remark.
fn face(
    part: &mut Part,
    lists: &Lists,
    words: &mut Words<'_>,
    material: Option<&str>,
) -> Result<Option<String>> {
    let mut outline = Vec::new();
    let mut remark = None;
    let start = words.rest();
    while let Some(word) = words.next() {
        let mut fields = word.split('/');
        let mut field = |what: &str, count: usize, needed: bool| -> Result<Option<u32>> {
            let Some(text) = fields.next().filter(|text| !text.is_empty()) else { return Ok(None) };
            let index: i64 = text.parse().map_err(|_| {
                words.fault(word, format!("\"{word}\" is not a corner such as 1/2/3"))
            })?;
            let place = if index < 0 { count as i64 + index } else { index - 1 };
            if index == 0 || !(0..count as i64).contains(&place) {
                if !needed {
                    remark =
                        Some(format!("faces use a {what} that does not exist: it is left out"));
                    return Ok(None);
                }
                return Err(words.fault(
                    word,
                    format!("{what} {index} does not exist: the file has {count} so far"),
                ));
            }
            Ok(Some(place as u32))
        };
        let point = field("vertex", lists.points.len(), true)?;
        let uv = field("texture coordinate", lists.uvs.len(), false)?;
        let normal = field("normal", lists.normals.len(), false)?;
        let point = point.ok_or_else(|| words.fault(word, "a corner without a vertex"))?;
        outline.push(part.corner((point, uv, normal)));
    }
    if outline.len() < 3 {
        let found = outline.len();
        return Err(words.fault(start, format!("a face with {found} corners: it needs 3 or more")));
    }
    let front = material.map(|name| {
        let known = part.materials.iter().position(|known| known == name);
        known.unwrap_or_else(|| {
            part.materials.push(name.to_owned());
            part.materials.len() - 1
        }) as u32
    });
    part.faces.push((outline, front));
    Ok(remark)
}

impl Part {
    fn corner(&mut self, corner: Corner) -> u32 {
        let next = self.corners.len() as u32;
        *self.known.entry(corner).or_insert_with(|| {
            self.corners.push(corner);
            next
        })
    }

    fn into_mesh(self, lists: &Lists) -> Result<Mesh> {
        let mut mesh = Mesh { materials: self.materials, ..Mesh::default() };
        let corners = &self.corners;
        mesh.points = corners.iter().map(|c| lists.points[c.0 as usize]).collect();
        let normals: Option<Vec<Vec3>> =
            corners.iter().map(|c| Some(lists.normals[c.2? as usize])).collect();
        mesh.normals = normals.unwrap_or_default();
        if corners.iter().any(|c| c.1.is_some()) {
            let uv = |c: &Corner| c.1.map_or(Vec2::ZERO, |uv| lists.uvs[uv as usize]);
            mesh.uvs = corners.iter().map(uv).collect();
        }
        if corners.iter().any(|c| (c.0 as usize) < lists.colors.len()) {
            let color = |c: &Corner| lists.colors.get(c.0 as usize).copied().unwrap_or([1.0; 4]);
            mesh.colors = corners.iter().map(color).collect();
        }
        for (outline, front) in &self.faces {
            mesh.add_polygon(outline, *front)?;
        }
        mesh.validate()?;
        Ok(mesh)
    }
}
