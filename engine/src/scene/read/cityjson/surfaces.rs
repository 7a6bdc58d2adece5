//! The surfaces of a city's geometries as meshes, and how they look.

use glam::{DVec3, Vec2};
use serde_json::Value;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use super::super::super::face::{Face, Sides};
use super::super::super::material::{AlphaMode, Map, Material, Picture};
use super::super::super::mesh::Mesh;
use super::Builder;
use super::levels::Level;
use super::model::CityGeometry;
use crate::color::Color;
use crate::error::{Error, Result};
use crate::open;
use crate::texture::{Mapping, Wrap};

/// What a material is made of.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Look {
    Material,
    Picture,
}

/// A mesh being made, its vertices by number in the city and place in a picture.
#[derive(Default)]
struct Making {
    mesh: Mesh,
    vertices: HashMap<(usize, [u32; 2]), u32>,
}

impl Builder<'_> {
    /// The mesh of an object's geometries in a level.
    pub(super) fn mesh(&mut self, name: &str, city: usize, level: Level) -> Result<Mesh> {
        let mut making = Making::default();
        let object = &self.objects[name].1;
        let has_level: Vec<bool> =
            self.own[name].iter().map(|own| own.is_some_and(|(own, _)| own == level)).collect();
        for (geometry, _) in object.geometry.iter().zip(has_level).filter(|(_, has)| *has) {
            if geometry.kind == "GeometryInstance" {
                // Vertices of a template are others than the city's.
                making.vertices.clear();
                self.instance(name, city, geometry, &mut making)?;
                making.vertices.clear();
            } else {
                self.surfaces(name, city, geometry, &self.points[city], &mut making)?;
            }
        }
        let Making { mut mesh, .. } = making;
        // Corners without a picture were given 0: without any picture there are no coordinates.
        if mesh.uvs.iter().all(|uv| *uv == Vec2::ZERO) {
            mesh.uvs.clear();
        }
        Ok(mesh)
    }

    /// A template in its place: turned and scaled by a matrix, moved to a vertex.
    fn instance(
        &mut self,
        name: &str,
        city: usize,
        geometry: &CityGeometry,
        making: &mut Making,
    ) -> Result<()> {
        let missing = |what: &str| Error::invalid(format!("an instance without {what}"));
        let templates = self.templates(city).ok_or_else(|| missing("templates"))?;
        let template = geometry.template.and_then(|i| templates.templates.get(i));
        let template = template.ok_or_else(|| missing("its template"))?;
        let anchor = geometry.boundaries.get(0).and_then(Value::as_u64);
        let anchor = anchor.and_then(|i| self.points[city].get(usize::try_from(i).ok()?));
        let anchor = *anchor.ok_or_else(|| missing("its anchor"))?;
        let m = geometry.matrix.ok_or_else(|| missing("its matrix"))?;
        let points: Vec<DVec3> = templates
            .vertices
            .iter()
            .map(|v| {
                // The matrix is stored row by row, as the specification says.
                let row = |r: usize| m[r] * v[0] + m[r + 1] * v[1] + m[r + 2] * v[2] + m[r + 3];
                DVec3::new(row(0), row(4), row(8)) + anchor
            })
            .collect();
        self.surfaces(name, city, template, &points, making)
    }

    fn surfaces(
        &mut self,
        name: &str,
        city: usize,
        geometry: &CityGeometry,
        points: &[DVec3],
        making: &mut Making,
    ) -> Result<()> {
        let Some(depth) = geometry.depth()? else { return Ok(()) };
        let mut surfaces = Vec::new();
        gather(&geometry.boundaries, depth, &mut Vec::new(), &mut surfaces)?;
        // Materials and semantics mirror the nesting of the surfaces.
        let theme = self.first_theme(&geometry.material, "materials");
        let pictures = self.first_theme(&geometry.texture, "pictures");
        for (number, (path, rings)) in surfaces.into_iter().enumerate() {
            let which = || format!("surface {number} of \"{name}\"");
            let placed = pictures.as_ref().and_then(|theme| nested(theme.get("values")?, &path));
            let picture =
                placed.and_then(|rings| self.picture(city, rings.get(0)?.get(0)?.as_u64()?));
            let mut outlines = Vec::new();
            for (k, ring) in rings.iter().enumerate() {
                let mut corners = Vec::new();
                for (i, corner) in ring.as_array().into_iter().flatten().enumerate() {
                    // A ring's first number is that of the picture; the places of its corners
                    // follow.
                    let place = placed.and_then(|rings| rings.get(k)?.get(i + 1)?.as_u64());
                    let place = place.and_then(|place| usize::try_from(place).ok());
                    let places = &self.cities[city].appearance.places;
                    let uv = place.and_then(|place| places.get(place)).copied();
                    let index = corner.as_u64().and_then(|i| usize::try_from(i).ok());
                    let known = index.filter(|i| *i < points.len()).ok_or_else(|| {
                        let count = points.len();
                        Error::invalid(format!("surface {number}: vertex {corner} of {count}"))
                    })?;
                    corners.push((known, uv.unwrap_or_default()));
                }
                if !has_three_apart(corners.iter().map(|(at, _)| points[*at])) {
                    // Without an outline there is no face, however many holes there are.
                    if k == 0 {
                        break;
                    }
                    self.told.holes.add(which);
                    continue;
                }
                let corners = corners.into_iter().map(|(at, uv)| making.corner(at, uv, points));
                outlines.push(corners.collect::<Vec<u32>>());
            }
            let mut outlines = outlines.into_iter();
            let Some(outline) = outlines.next() else {
                self.told.surfaces.add(which);
                continue;
            };
            let holes = outlines.collect();
            let material = picture
                .or_else(|| self.material(city, theme.as_ref()?, &path))
                .or_else(|| self.kind(&geometry.semantics, &path));
            let front = material.map(|name| making.mesh.material(&name));
            let sides = Sides { front, ..Sides::default() };
            let face = Face { outline, holes, sides, ..Face::default() };
            making.mesh.add_face(face).map_err(|e| Error::invalid(format!("{}: {e}", which())))?;
        }
        Ok(())
    }

    /// The first of several themes of materials or pictures.
    fn first_theme(&mut self, themes: &Value, what: &str) -> Option<Value> {
        if let Value::Array(values) = themes {
            // Drafts had one theme without a name.
            return Some(serde_json::json!({ "values": values }));
        }
        let mut themes = themes.as_object()?.iter();
        let (name, first) = themes.next()?;
        if let Some((other, _)) = themes.next() {
            self.reader.note(format!(
                "of several themes of {what} the first of each geometry is shown: \"{name}\", not \"{other}\""
            ));
        }
        Some(first.clone())
    }

    /// The material that a theme gives to a surface.
    fn material(&mut self, city: usize, theme: &Value, path: &[usize]) -> Option<String> {
        let number = theme.get("value").or_else(|| nested(theme.get("values")?, path))?.as_u64()?;
        if let Some(known) = self.looks.get(&(city, Look::Material, number)) {
            return Some(known.clone());
        }
        let materials = &self.cities[city].appearance.materials;
        let material = materials.get(usize::try_from(number).ok()?)?;
        let name = material.name.clone().unwrap_or_else(|| format!("material {number}"));
        let [r, g, b] = material.diffuse.unwrap_or([0.8; 3]);
        let alpha = 1.0 - material.transparency.unwrap_or(0.0).clamp(0.0, 1.0);
        let alpha_mode = if alpha < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque };
        let color = Color::new(r, g, b);
        let material = Material { color, alpha, alpha_mode, ..Material::default() };
        Some(self.keep(city, Look::Material, number, name, material))
    }

    /// The material of surfaces with a picture.
    fn picture(&mut self, city: usize, number: u64) -> Option<String> {
        if let Some(known) = self.looks.get(&(city, Look::Picture, number)) {
            return Some(known.clone());
        }
        let textures = &self.cities[city].appearance.textures;
        let texture = textures.get(usize::try_from(number).ok()?)?;
        let wrap = match texture.wrap.as_deref() {
            Some("mirror") => Wrap::Mirror,
            Some("clamp" | "border") => Wrap::Clamp,
            Some("none") => Wrap::Nothing,
            _ => Wrap::Repeat,
        };
        let mapping = Mapping { wrap: [wrap; 2], ..Mapping::default() };
        let picture = Picture::File(self.found(texture.image.replace('\\', "/")));
        let map = Map { mapping, ..Map::of(picture) };
        let maps = BTreeMap::from([("color".to_owned(), map)]);
        let material = Material { color: Color::WHITE, maps, ..Material::default() };
        let name = format!("picture {number}");
        Some(self.keep(city, Look::Picture, number, name, material))
    }

    /// Adds a material under its name or, if another has that, under one of its own.
    fn keep(
        &mut self,
        city: usize,
        look: Look,
        number: u64,
        wished: String,
        material: Material,
    ) -> String {
        let id = &self.cities[city].id;
        let of = if id.is_empty() { wished.clone() } else { format!("{wished} of {id}") };
        let names = (2..).map(|count| format!("{of}#{count}"));
        // Features of one city repeat their materials: equal ones share a name.
        let is_free = |name: &String| self.materials.get(name).is_none_or(|had| *had == material);
        let name = [wished.clone(), of.clone()].into_iter().chain(names).find(is_free);
        let name = name.unwrap_or(wished);
        self.materials.insert(name.clone(), material);
        self.looks.insert((city, look, number), name.clone());
        name
    }

    /// Where a picture is: files without a path may lie in a folder of their own.
    fn found(&self, image: String) -> String {
        let folder = self.reader.path.parent().unwrap_or(Path::new(""));
        let elsewhere = format!("appearances/{image}");
        let is_elsewhere =
            !open::is_file(&folder.join(&image)) && open::is_file(&folder.join(&elsewhere));
        if is_elsewhere { elsewhere } else { image }
    }

    /// A plain material by what kind of surface it is.
    fn kind(&mut self, semantics: &Value, path: &[usize]) -> Option<String> {
        let number = nested(semantics.get("values")?, path)?.as_u64()?;
        let surface = semantics.get("surfaces")?.get(usize::try_from(number).ok()?)?;
        let kind = surface.get("type")?.as_str()?;
        let srgb = match kind {
            "WallSurface" | "InteriorWallSurface" => [0xd8, 0xcf, 0xc0],
            "RoofSurface" | "OuterCeilingSurface" => [0x9c, 0x5a, 0x44],
            "GroundSurface" | "OuterFloorSurface" | "FloorSurface" => [0x8a, 0x8a, 0x80],
            "Window" => [0x4c, 0x5b, 0x66],
            "Door" => [0x6b, 0x4a, 0x36],
            _ => [0xb0, 0xb0, 0xb0],
        };
        let plain = || Material { color: Color::from_srgb8(srgb), ..Material::default() };
        self.materials.entry(kind.to_owned()).or_insert_with(plain);
        Some(kind.to_owned())
    }
}

impl Making {
    /// The vertex of a corner.
    fn corner(&mut self, at: usize, uv: [f32; 2], points: &[DVec3]) -> u32 {
        let next = self.mesh.points.len() as u32;
        *self.vertices.entry((at, uv.map(f32::to_bits))).or_insert_with(|| {
            self.mesh.points.push(points[at]);
            self.mesh.uvs.push(uv.into());
            next
        })
    }
}

/// Whether three of a ring's corners are apart, so that it may have an area.
fn has_three_apart(corners: impl Iterator<Item = DVec3>) -> bool {
    let mut apart: Vec<DVec3> = Vec::with_capacity(3);
    for corner in corners {
        if !apart.contains(&corner) {
            apart.push(corner);
            if apart.len() == 3 {
                return true;
            }
        }
    }
    false
}

/// How many surfaces nested boundaries have.
pub(super) fn count(boundaries: &Value, depth: usize) -> usize {
    let list = boundaries.as_array().map_or(&[][..], Vec::as_slice);
    match depth {
        0 => list.len(),
        _ => list.iter().map(|item| count(item, depth - 1)).sum(),
    }
}

/// Lists the surfaces of nested boundaries, each with its place in them.
fn gather<'v>(
    value: &'v Value,
    depth: usize,
    path: &mut Vec<usize>,
    out: &mut Vec<(Vec<usize>, &'v [Value])>,
) -> Result<()> {
    let list = value.as_array().ok_or_else(|| Error::invalid("boundaries that are not a list"))?;
    for (i, item) in list.iter().enumerate() {
        path.push(i);
        if depth == 0 {
            let rings =
                item.as_array().ok_or_else(|| Error::invalid("a surface that is not a list"))?;
            out.push((path.clone(), rings));
        } else {
            gather(item, depth - 1, path, out)?;
        }
        path.pop();
    }
    Ok(())
}

fn nested<'v>(value: &'v Value, path: &[usize]) -> Option<&'v Value> {
    path.iter().try_fold(value, |value, i| value.get(i))
}
