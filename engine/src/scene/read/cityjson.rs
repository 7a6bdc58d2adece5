//! CityJSON 1.0 to 2.0 (and what older drafts have in common with them).
//!
//! City objects become objects, their parts children. Of several levels of detail the highest is
//! read. Interior rings become holes. A surface looks as its material says or, without one, as its
//! kind (wall, roof, window) usually does.

use glam::{DVec3, Vec2};
use serde::Deserialize;
use serde_json::Value;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

use super::super::document::{Document, Object, Plan};
use super::super::face::{Face, Sides};
use super::super::material::{AlphaMode, Map, Material, Picture};
use super::super::mesh::Mesh;
use super::super::shape::Shape;
use super::Reader;
use crate::color::Color;
use crate::error::{Error, Result};
use crate::texture::{Mapping, Wrap};

#[derive(Deserialize)]
pub(super) struct City {
    #[serde(rename = "type")]
    pub(super) kind: String,
    pub(super) version: String,
    #[serde(rename = "CityObjects")]
    pub(super) objects: serde_json::Map<String, Value>,
    pub(super) vertices: Vec<[f64; 3]>,
    pub(super) transform: Option<Placement>,
    #[serde(default)]
    pub(super) appearance: Appearance,
    #[serde(rename = "geometry-templates")]
    pub(super) templates: Option<Templates>,
}

#[derive(Deserialize)]
pub(super) struct Placement {
    scale: [f64; 3],
    translate: [f64; 3],
}

#[derive(Default, Deserialize)]
pub(super) struct Appearance {
    #[serde(default)]
    pub(super) materials: Vec<CityMaterial>,
    #[serde(default)]
    pub(super) textures: Vec<CityTexture>,
    #[serde(default, rename = "vertices-texture", alias = "vertex-texture")]
    pub(super) places: Vec<[f32; 2]>,
}

#[derive(Deserialize)]
pub(super) struct CityTexture {
    pub(super) image: String,
    #[serde(rename = "wrapMode")]
    pub(super) wrap: Option<String>,
}

#[derive(Deserialize)]
pub(super) struct CityMaterial {
    pub(super) name: Option<String>,
    #[serde(rename = "diffuseColor")]
    pub(super) diffuse: Option<[f32; 3]>,
    pub(super) transparency: Option<f32>,
}

#[derive(Deserialize)]
pub(super) struct Templates {
    templates: Vec<CityGeometry>,
    #[serde(rename = "vertices-templates")]
    vertices: Vec<[f64; 3]>,
}

#[derive(Deserialize)]
struct CityObject {
    #[serde(rename = "type")]
    kind: String,
    #[serde(default)]
    geometry: Vec<CityGeometry>,
    #[serde(default)]
    children: Vec<String>,
    #[serde(default)]
    parents: Vec<String>,
    #[serde(default)]
    attributes: serde_json::Map<String, Value>,
}

#[derive(Clone, Deserialize)]
struct CityGeometry {
    #[serde(rename = "type")]
    kind: String,
    #[serde(default)]
    lod: Value,
    #[serde(default)]
    boundaries: Value,
    #[serde(default)]
    semantics: Value,
    #[serde(default)]
    material: Value,
    #[serde(default)]
    texture: Value,
    template: Option<usize>,
    #[serde(rename = "transformationMatrix")]
    matrix: Option<[f64; 16]>,
}

pub(super) fn read(reader: &mut Reader, bytes: &[u8]) -> Result<Document> {
    let city: City = serde_json::from_slice(bytes).map_err(|e| {
        Error::at_line(&reader.path, e.line(), e.column(), format!("not CityJSON: {e}"))
    })?;
    if !matches!(city.kind.as_str(), "CityJSON" | "CityModel") {
        let kind = &city.kind;
        return Err(reader.fault(format!("a JSON file of type \"{kind}\": expected \"CityJSON\"")));
    }
    if !["1.0", "1.1", "2.0"].contains(&city.version.as_str()) {
        reader.note(format!(
            "CityJSON version \"{}\" is read as far as it is like 2.0",
            city.version
        ));
    }
    build(reader, &city)
}

/// Makes objects of a city's.
pub(super) fn build(reader: &mut Reader, city: &City) -> Result<Document> {
    let mut objects = BTreeMap::new();
    for (name, value) in &city.objects {
        let object = CityObject::deserialize(value)
            .map_err(|e| reader.fault(format!("object \"{name}\": {e}")))?;
        objects.insert(name.as_str(), object);
    }
    let points: Vec<DVec3> =
        city.vertices.iter().map(|v| place(*v, city.transform.as_ref())).collect();
    if points.iter().any(|p| !p.is_finite()) {
        return Err(reader.fault("a vertex is not finite"));
    }
    let mut builder = Builder {
        reader,
        city,
        points: &points,
        objects: &objects,
        placed: HashSet::new(),
        materials: BTreeMap::new(),
    };
    let mut root = Object::default();
    for (name, object) in &objects {
        if !object.parents.iter().any(|parent| objects.contains_key(parent.as_str())) {
            root.children.extend(builder.object(name)?);
        }
    }
    // What is left has only itself for ancestors.
    for name in objects.keys() {
        if !builder.placed.contains(name) {
            builder.reader.note(format!("object \"{name}\" is its own ancestor"));
            root.children.extend(builder.object(name)?);
        }
    }
    let materials = builder.materials;
    let plan = Plan { name: reader.stem(), root, ..Plan::default() };
    Ok(Document { materials, ..Document::with_plan(plan) })
}

fn place(v: [f64; 3], placement: Option<&Placement>) -> DVec3 {
    let v = DVec3::from(v);
    placement.map_or(v, |p| v * DVec3::from(p.scale) + DVec3::from(p.translate))
}

struct Builder<'a> {
    reader: &'a mut Reader,
    city: &'a City,
    points: &'a [DVec3],
    objects: &'a BTreeMap<&'a str, CityObject>,
    placed: HashSet<&'a str>,
    materials: BTreeMap<String, Material>,
}

impl<'a> Builder<'a> {
    fn object(&mut self, name: &'a str) -> Result<Option<Object>> {
        if !self.placed.insert(name) {
            return Ok(None);
        }
        let Some(city_object) = self.objects.get(name) else {
            self.reader.note(format!("object \"{name}\" is named as a child but does not exist"));
            return Ok(None);
        };
        let mut object = Object::new(name.replace('/', "_"), Shape::Group);
        object.user.insert("type".into(), city_object.kind.clone());
        for (key, value) in &city_object.attributes {
            let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            object.user.insert(key.clone(), text);
        }
        if let Some(geometry) = best(&city_object.geometry) {
            let mesh = self
                .mesh(geometry)
                .map_err(|e| self.reader.fault(format!("object \"{name}\": {e}")))?;
            object.shape = Shape::Faces(mesh);
        }
        for child in &city_object.children {
            object.children.extend(self.object(child)?);
        }
        Ok(Some(object))
    }

    fn mesh(&mut self, geometry: &CityGeometry) -> Result<Mesh> {
        if geometry.kind == "GeometryInstance" {
            return self.instance(geometry);
        }
        self.surfaces(geometry, self.points)
    }

    /// A template in its place: turned and scaled by a matrix, moved to a vertex.
    fn instance(&mut self, geometry: &CityGeometry) -> Result<Mesh> {
        let missing = |what: &str| Error::invalid(format!("an instance without {what}"));
        let templates = self.city.templates.as_ref().ok_or_else(|| missing("templates"))?;
        let template = geometry.template.and_then(|i| templates.templates.get(i));
        let template = template.ok_or_else(|| missing("its template"))?;
        let anchor = geometry.boundaries.get(0).and_then(Value::as_u64);
        let anchor = anchor.and_then(|i| self.points.get(usize::try_from(i).ok()?));
        let anchor = *anchor.ok_or_else(|| missing("its anchor"))?;
        let m = geometry.matrix.ok_or_else(|| missing("its matrix"))?;
        let points: Vec<DVec3> = templates
            .vertices
            .iter()
            .map(|v| {
                let row = |r: usize| m[r] * v[0] + m[r + 1] * v[1] + m[r + 2] * v[2] + m[r + 3];
                DVec3::new(row(0), row(4), row(8)) + anchor
            })
            .collect();
        self.surfaces(template, &points)
    }

    fn surfaces(&mut self, geometry: &CityGeometry, points: &[DVec3]) -> Result<Mesh> {
        let depth = match geometry.kind.as_str() {
            "MultiSurface" | "CompositeSurface" => 0,
            "Solid" => 1,
            "MultiSolid" | "CompositeSolid" => 2,
            "MultiPoint" | "MultiLineString" => return Ok(Mesh::default()),
            kind => return Err(Error::invalid(format!("a geometry of type \"{kind}\""))),
        };
        let mut surfaces = Vec::new();
        gather(&geometry.boundaries, depth, &mut Vec::new(), &mut surfaces)?;
        // Materials and semantics mirror the nesting of the surfaces.
        let first = |themes: &Value| match themes {
            // Drafts had one theme without a name.
            Value::Array(values) => Some(serde_json::json!({ "values": values })),
            themes => themes.as_object()?.values().next().cloned(),
        };
        let (theme, pictures) = (first(&geometry.material), first(&geometry.texture));
        let mut mesh = Mesh::default();
        // By vertex and place in a picture.
        let mut vertices: HashMap<(usize, [u32; 2]), u32> = HashMap::new();
        for (number, (path, rings)) in surfaces.into_iter().enumerate() {
            let placed = pictures.as_ref().and_then(|theme| nested(theme.get("values")?, &path));
            let picture = placed.and_then(|rings| self.picture(rings.get(0)?.get(0)?.as_u64()?));
            let mut outlines = Vec::new();
            for (k, ring) in rings.iter().enumerate() {
                let mut outline = Vec::new();
                for (i, corner) in ring.as_array().into_iter().flatten().enumerate() {
                    let place = placed.and_then(|rings| rings.get(k)?.get(i + 1)?.as_u64());
                    let place = place.and_then(|place| usize::try_from(place).ok());
                    let place = place.and_then(|place| self.city.appearance.places.get(place));
                    let uv = place.copied().unwrap_or_default();
                    let index = corner.as_u64().and_then(|i| usize::try_from(i).ok());
                    let known = index.filter(|i| *i < points.len()).ok_or_else(|| {
                        let count = points.len();
                        Error::invalid(format!("surface {number}: vertex {corner} of {count}"))
                    })?;
                    let next = mesh.points.len() as u32;
                    let id = (known, uv.map(f32::to_bits));
                    outline.push(*vertices.entry(id).or_insert_with(|| {
                        mesh.points.push(points[known]);
                        mesh.uvs.push(uv.into());
                        next
                    }));
                }
                outlines.push(outline);
            }
            let mut outlines = outlines.into_iter();
            let Some(outline) = outlines.next() else { continue };
            let material = picture
                .or_else(|| self.material(theme.as_ref()?, &path))
                .or_else(|| self.kind(&geometry.semantics, &path));
            let sides =
                Sides { front: material.map(|name| mesh.material(&name)), ..Sides::default() };
            let face = Face { outline, holes: outlines.collect(), sides, ..Face::default() };
            mesh.add_face(face).map_err(|e| Error::invalid(format!("surface {number}: {e}")))?;
        }
        if mesh.uvs.iter().all(|uv| *uv == Vec2::ZERO) {
            mesh.uvs.clear();
        }
        Ok(mesh)
    }

    /// The material that a theme gives to a surface.
    fn material(&mut self, theme: &Value, path: &[usize]) -> Option<String> {
        let number = theme.get("value").or_else(|| nested(theme.get("values")?, path))?.as_u64()?;
        let material = self.city.appearance.materials.get(usize::try_from(number).ok()?)?;
        let name = material.name.clone().unwrap_or_else(|| format!("material {number}"));
        let [r, g, b] = material.diffuse.unwrap_or([0.8; 3]);
        let alpha = 1.0 - material.transparency.unwrap_or(0.0).clamp(0.0, 1.0);
        let alpha_mode = if alpha < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque };
        let color = Color::new(r, g, b);
        let material = Material { color, alpha, alpha_mode, ..Material::default() };
        self.materials.insert(name.clone(), material);
        Some(name)
    }

    /// The material of surfaces with a picture.
    fn picture(&mut self, number: u64) -> Option<String> {
        let texture = self.city.appearance.textures.get(usize::try_from(number).ok()?)?;
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
        let name = format!("picture {number}");
        let material = Material { color: Color::WHITE, maps, ..Material::default() };
        self.materials.entry(name.clone()).or_insert(material);
        Some(name)
    }

    /// Where a picture is: files without a path may lie in a folder of their own.
    fn found(&self, image: String) -> String {
        let folder = self.reader.path.parent().unwrap_or(Path::new(""));
        let elsewhere = format!("appearances/{image}");
        let is_elsewhere = !folder.join(&image).exists() && folder.join(&elsewhere).exists();
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

/// The geometry with the highest level of detail.
fn best(geometries: &[CityGeometry]) -> Option<&CityGeometry> {
    let lod = |geometry: &CityGeometry| match &geometry.lod {
        Value::Number(number) => number.as_f64().unwrap_or(0.0),
        Value::String(text) => text.parse().unwrap_or(0.0),
        _ => 0.0,
    };
    geometries.iter().max_by(|a, b| lod(a).total_cmp(&lod(b)))
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
