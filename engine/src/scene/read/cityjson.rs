//! CityJSON 1.0 to 2.0 (and what older drafts have in common with them).
//!
//! City objects become objects, their parts children; [`levels`] says which level of detail is shown. Interior rings
//! become holes. A surface looks as its material says or, without one, as its kind (wall, roof, window) usually does.
//! A city may be in one piece, or by lines (CityJSONSeq): a city with its transform, then features, each with vertices
//! and looks of its own.

mod levels;
mod model;
mod shells;
mod surfaces;

use glam::DVec3;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use super::super::document::{Document, Object, Plan};
use super::super::material::Material;
use super::super::shape::Shape;
use super::citygml::degrees::is_degrees;
use super::reader::{LeftOut, Names, Reader};
use crate::error::{Error, Result};
use crate::watch::Watch;
use levels::{Level, Wanted, is_meant, is_part, near};
pub(super) use model::{Appearance, City, CityMaterial, CityTexture};
use model::{CityObject, Placement, Templates};
use shells::Shells;

/// How deep parts lie in each other, at most.
const DEEPEST: usize = 60;

pub(super) fn read(reader: &mut Reader, bytes: &[u8], lod: Option<f64>) -> Result<Document> {
    let mut cities: Vec<City> = Vec::new();
    for city in serde_json::Deserializer::from_slice(bytes).into_iter::<City>() {
        let city = city.map_err(|e| {
            Error::at_line(&reader.path, e.line(), e.column(), format!("not CityJSON: {e}"))
        })?;
        let (kind, line) = (city.kind.as_str(), cities.len() + 1);
        match (kind, cities.is_empty()) {
            ("CityJSON" | "CityModel", true) | ("CityJSONFeature", false) => cities.push(city),
            ("CityJSONFeature", true) => {
                return Err(reader.fault(
                    "it begins with a CityJSONFeature: the first line must be the CityJSON object with the \
                     transform of all (such files are joined by `cat header.json features.jsonl`)",
                ));
            }
            (_, true) => {
                return Err(
                    reader.fault(format!("a JSON file of type \"{kind}\": expected \"CityJSON\""))
                );
            }
            (_, false) => {
                return Err(reader.fault(format!(
                    "its object {line} is of type \"{kind}\": after the first, \"CityJSONFeature\" is expected"
                )));
            }
        }
    }
    let version = cities.first().map_or("", |city| city.version.as_str());
    if !["1.0", "1.1", "2.0"].contains(&version) {
        reader.note(format!("CityJSON version \"{version}\" is read as far as it is like 2.0"));
    }
    let system = cities.first().and_then(|city| city.metadata.get("referenceSystem")?.as_str());
    if system.is_some_and(is_degrees) {
        reader.note("its reference system is in degrees, but its positions are read as metres");
    }
    build(reader, &cities, lod)
}

/// Makes objects of a city's and its features'.
pub(super) fn build(reader: &mut Reader, cities: &[City], lod: Option<f64>) -> Result<Document> {
    let mut objects = BTreeMap::new();
    let mut doubled = LeftOut::default();
    for (at, city) in cities.iter().enumerate() {
        for (name, value) in &city.objects.0 {
            let object = CityObject::deserialize(value)
                .map_err(|e| reader.fault(format!("object \"{name}\": {e}")))?;
            if objects.contains_key(name.as_str()) {
                doubled.add(|| format!("\"{name}\""));
            } else {
                objects.insert(name.as_str(), (at, object));
            }
        }
    }
    doubled.tell(reader, "objects have names that others have before them, and are left out");
    let shared = cities.first().and_then(|city| city.transform.as_ref());
    let points: Vec<Vec<DVec3>> = cities
        .iter()
        .map(|city| {
            // Features take the transform of the first line.
            let placement = city.transform.as_ref().or(shared);
            city.vertices.iter().map(|v| place(*v, placement)).collect()
        })
        .collect();
    if points.iter().flatten().any(|p| !p.is_finite()) {
        return Err(reader.fault("a vertex is not finite"));
    }
    let mut builder = Builder {
        wanted: lod.map_or(Wanted::Finest, |lod| Wanted::Near(Level::of(lod))),
        reader,
        cities,
        points: &points,
        objects: &objects,
        placed: HashSet::new(),
        own: HashMap::new(),
        materials: BTreeMap::new(),
        looks: HashMap::new(),
        told: Remarks::default(),
        faces: BTreeMap::new(),
        shells: Shells::default(),
    };
    builder.measure();
    let mut root = Object::default();
    for (name, (_, object)) in &objects {
        if !object.parents.iter().any(|parent| objects.contains_key(parent.as_str())) {
            root.children.extend(builder.object(name, builder.wanted, 0)?);
        }
    }
    // What is left has only itself for ancestors.
    for name in objects.keys() {
        if !builder.placed.contains(name) {
            builder.reader.note(format!("object \"{name}\" is its own ancestor"));
            root.children.extend(builder.object(name, builder.wanted, 0)?);
        }
    }
    unique(&mut root);
    let materials = builder.finish();
    let plan = Plan { name: reader.stem(), root, ..Plan::default() };
    Ok(Document { materials, ..Document::with_plan(plan) })
}

fn place(v: [f64; 3], placement: Option<&Placement>) -> DVec3 {
    let v = DVec3::from(v);
    placement.map_or(v, |p| v * DVec3::from(p.scale) + DVec3::from(p.translate))
}

/// Makes the names of an object's children such as may stand in paths.
fn unique(object: &mut Object) {
    let mut names = Names::default();
    object.children.iter_mut().for_each(|child| child.name = names.unique(&child.name));
}

/// What is told of a city, each once.
#[derive(Default)]
struct Remarks {
    nearest: LeftOut,
    covered: LeftOut,
    finer: LeftOut,
    lines: LeftOut,
    levels: LeftOut,
    surfaces: LeftOut,
    holes: LeftOut,
}

struct Builder<'a> {
    reader: &'a mut Reader,
    wanted: Wanted,
    cities: &'a [City],
    /// By city.
    points: &'a [Vec<DVec3>],
    /// Each with its city.
    objects: &'a BTreeMap<&'a str, (usize, CityObject)>,
    placed: HashSet<&'a str>,
    /// By object, the level of each of its geometries and the number of surfaces; `None` for what has none.
    own: HashMap<&'a str, Vec<Option<(Level, usize)>>>,
    materials: BTreeMap<String, Material>,
    /// The names of materials by city, what they are made of, and number.
    looks: HashMap<(usize, surfaces::Look, u64), String>,
    told: Remarks,
    /// By level, how many faces there are and how many are shown.
    faces: BTreeMap<Level, [usize; 2]>,
    shells: Shells,
}

impl<'a> Builder<'a> {
    fn object(&mut self, name: &'a str, wanted: Wanted, depth: usize) -> Result<Option<Object>> {
        if depth > DEEPEST {
            let message = format!("object \"{name}\" is nested more than {DEEPEST} deep");
            return Err(self.reader.fault(message));
        }
        // Files exist in which two parents name one child.
        if !self.placed.insert(name) {
            return Ok(None);
        }
        let Some((city, city_object)) = self.objects.get(name) else {
            self.reader.note(format!("object \"{name}\" is named as a child but does not exist"));
            return Ok(None);
        };
        Watch::current().check()?;
        let mut object = Object::new(name, Shape::Group);
        object.user.insert("type".into(), city_object.kind.clone());
        for (key, value) in &city_object.attributes {
            let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            object.user.insert(key.clone(), text);
        }
        let is_addition = depth > 0 && !self.is_part(name);
        let (shown, for_parts) = self.choose(name, wanted, is_addition);
        for (geometry, level) in city_object.geometry.iter().zip(&self.own[name]) {
            let Some((level, count)) = *level else { continue };
            let faces = self.faces.entry(level).or_default();
            faces[0] += count;
            faces[1] += if shown == Some(level) { count } else { 0 };
            if shown == Some(level) && self.reader.examines {
                self.shells.examine(name, geometry, &self.points[*city]);
            }
        }
        if let Some(level) = shown {
            object.user.insert("lod".into(), level.to_string());
            let mesh = self
                .mesh(name, *city, level)
                .map_err(|e| self.reader.fault(format!("object \"{name}\": {e}")))?;
            object.shape = Shape::Faces(mesh);
        }
        for child in &city_object.children {
            let wanted = if self.is_part(child) { for_parts } else { self.wanted };
            object.children.extend(self.object(child, wanted, depth + 1)?);
        }
        unique(&mut object);
        Ok(Some(object))
    }

    /// Which level of an object is shown, and what is asked of its parts.
    fn choose(&mut self, name: &str, wanted: Wanted, is_addition: bool) -> (Option<Level>, Wanted) {
        let own: Vec<Level> = self.own[name].iter().flatten().map(|(level, _)| *level).collect();
        let all = self.all_levels(name);
        let level = match wanted {
            Wanted::Only(level) => {
                if !own.is_empty() && !all.contains(&level) {
                    self.told.covered.add(|| format!("\"{name}\""));
                }
                return (own.contains(&level).then_some(level), wanted);
            }
            Wanted::Finest => all.last().copied(),
            Wanted::Near(level) => near(&all, level),
        };
        let Some(level) = level else { return (None, wanted) };
        let mut for_parts = Wanted::Near(level);
        if let Wanted::Near(asked) = wanted {
            if is_meant(level, asked) {
                for_parts = wanted;
            } else if level > asked && is_addition {
                self.told.finer.add(|| format!("\"{name}\""));
                return (None, Wanted::Only(asked));
            } else {
                self.told
                    .nearest
                    .add(|| format!("\"{name}\", shown in {level} instead of {asked}"));
            }
        }
        // A coarser geometry of the whole would hide its parts.
        match own.contains(&level) {
            true => (Some(level), Wanted::Only(level)),
            false => (None, for_parts),
        }
    }

    /// Finds the level of each geometry of all objects, and how many surfaces it has.
    fn measure(&mut self) {
        for (name, (city, object)) in self.objects {
            let mut own = Vec::with_capacity(object.geometry.len());
            for geometry in &object.geometry {
                let drawn = self.templates(*city).zip(geometry.template);
                let drawn = drawn.and_then(|(templates, at)| templates.templates.get(at));
                let drawn = drawn.unwrap_or(geometry);
                let count = match drawn.depth() {
                    Ok(Some(depth)) => surfaces::count(&drawn.boundaries, depth),
                    // The fault is told when it is built.
                    Err(_) => 1,
                    Ok(None) => {
                        self.told.lines.add(|| format!("of \"{name}\""));
                        0
                    }
                };
                let level = drawn.level().or_else(|| geometry.level());
                if level.is_none() && count > 0 {
                    self.told.levels.add(|| format!("of \"{name}\""));
                }
                own.push((count > 0).then(|| (level.unwrap_or_default(), count)));
            }
            self.own.insert(name, own);
        }
    }

    /// The templates that a city's instances are of.
    fn templates(&self, city: usize) -> Option<&'a Templates> {
        self.cities[city].templates.as_ref().or_else(|| self.cities[0].templates.as_ref())
    }

    /// The levels that an object and its parts have.
    fn all_levels(&self, name: &str) -> BTreeSet<Level> {
        let mut all = BTreeSet::new();
        let (mut open, mut seen) = (vec![name], HashSet::new());
        while let Some(at) = open.pop() {
            let Some((_, object)) = self.objects.get(at).filter(|_| seen.insert(at)) else {
                continue;
            };
            all.extend(self.own[at].iter().flatten().map(|(level, _)| *level));
            let parts = object.children.iter().map(String::as_str);
            open.extend(parts.filter(|child| self.is_part(child)));
        }
        all
    }

    fn is_part(&self, name: &str) -> bool {
        self.objects.get(name).is_some_and(|(_, object)| is_part(&object.kind))
    }

    /// What was made, once all is told.
    fn finish(self) -> BTreeMap<String, Material> {
        let Builder { reader, told, faces, shells, materials, .. } = self;
        let Remarks { nearest, covered, finer, lines, levels, surfaces, holes } = told;
        nearest.tell(reader, "buildings or parts are not there in the level of detail of the rest");
        covered.tell(
            reader,
            "parts are not there in the level of detail in which the building around them is shown, and are left out",
        );
        finer.tell(
            reader,
            "additions to buildings are there in finer levels only, and are left out",
        );
        lines.tell(reader, "geometries are points or lines, and are not shown");
        levels.tell(reader, "geometries have no level of detail, and count as level 0");
        surfaces.tell(reader, "surfaces with fewer than three corners apart are left out");
        holes.tell(reader, "holes with fewer than three corners apart are left out");
        for (level, [all, shown]) in faces {
            let shown = match shown {
                0 => "not shown".to_owned(),
                _ if shown == all => "shown".to_owned(),
                _ => format!("{shown} of them shown"),
            };
            reader.about.push(format!("level of detail {level}: {all} faces, {shown}"));
        }
        reader.about.extend(shells.told());
        materials
    }
}
