//! Wavefront OBJ.
//!
//! Read here and not by a library because polygons must stay polygons, and faults must name their line. Each `o`
//! begins an object; in files without any, each `g` does, whose several names are one. Lines, points, and free-form
//! curves and surfaces are counted and told.
//!
//! What the format does not say: units are metres and up is y. Faces without `usemtl` are a grey of 0.8 or, where
//! vertices have colours (three numbers behind x, y and z, scene-linear), white but for these; so are faces of
//! materials that are not there. A vertex without a colour beside others that have one is white. Faces without
//! normals are flat (`crease` smooths them); smoothing groups are told where they would change that.

mod libraries;
mod part;

use glam::{DVec3, Vec2};
use std::collections::BTreeMap;

use self::part::{Lists, Part};
use super::super::document::{Document, Object, Plan};
use super::super::material::Material;
use super::super::shape::Shape;
use super::colors;
use super::reader::{Names, Reader};
use super::words::{Words, statements};
use crate::color::Color;
use crate::error::Result;
use crate::text::list;
use crate::watch::Watch;

/// Statements that are not shown, as they are told.
const NOT_SHOWN: [(&[&str], &str); 3] = [
    (&["l"], "lines are not shown"),
    (&["p"], "points are not shown"),
    (
        &["curv", "curv2", "surf", "bzp", "bsp", "cdc", "cdp", "res"],
        "free-form curves and surfaces are not shown",
    ),
];

/// Statements that change nothing that is shown, or belong to what is told.
const SILENT: [&str; 27] = [
    "vp",
    "cstype",
    "deg",
    "bmat",
    "step",
    "parm",
    "trim",
    "hole",
    "scrv",
    "sp",
    "end",
    "con",
    "mg",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "ctech",
    "stech",
    "shadow_obj",
    "trace_obj",
    "usemap",
    "maplib",
    "csh",
    "o",
    "g",
    "s",
];

/// Statements that are told: how many, and where the first is. Its line is counted only when it is told.
#[derive(Default)]
struct Remarks<'t>(BTreeMap<String, (usize, &'t str)>);

impl<'t> Remarks<'t> {
    fn add(&mut self, what: &str, word: &'t str) {
        match self.0.get_mut(what) {
            Some((count, _)) => *count += 1,
            None => drop(self.0.insert(what.to_owned(), (1, word))),
        }
    }
}

pub(super) fn read(reader: &mut Reader, text: &str) -> Result<Document> {
    let path = reader.path.clone();
    // Asked first: whether a `g` begins an object depends on all of the file.
    let has_objects = statements(&path, text).any(|mut words| words.next() == Some("o"));
    let mut lists = Lists::default();
    let mut materials: BTreeMap<String, Material> = BTreeMap::new();
    let mut missing = Vec::new();
    let mut parts = vec![Part::default()];
    let mut material: Option<String> = None;
    let mut told = Remarks::default();
    let mut is_smooth = false;
    let watch = Watch::current();
    for mut words in statements(&path, text) {
        watch.check()?;
        let Some(keyword) = words.next() else {
            if words.name().starts_with("#MRGB") {
                told.add("lines of colours in comments (#MRGB) are not read", words.name());
            }
            continue;
        };
        match keyword {
            "v" => {
                if let Some(what) = lists.vertex(&mut words)? {
                    told.add(what, keyword);
                }
            }
            "vt" => {
                let u = words.any_number()? as f32;
                let v = if words.peek().is_some() { words.any_number()? as f32 } else { 0.0 };
                let uv = Vec2::new(u, v);
                if !uv.is_finite() {
                    let what = "texture coordinates are not finite, and 0";
                    told.add(what, keyword);
                }
                lists.uvs.push(if uv.is_finite() { uv } else { Vec2::ZERO });
            }
            "vn" => {
                let mut number = || words.any_number();
                let normal = DVec3::new(number()?, number()?, number()?);
                if !normal.is_finite() {
                    let what = "normals are not finite: their faces are flat";
                    told.add(what, keyword);
                }
                // 0, if it has no direction.
                lists.normals.push(normal.normalize_or_zero().as_vec3());
            }
            "f" | "fo" => {
                let part = parts.last_mut().expect("there is always a part");
                let seen = part.face(&lists, &mut words, material.as_deref())?;
                seen.into_iter().for_each(|what| told.add(what, keyword));
                if is_smooth && !part.last_has_normals() {
                    let what = "faces of smoothing groups have no normals and are shown flat (`crease` smooths them)";
                    told.add(what, keyword);
                }
            }
            "o" | "g" if (keyword == "o") == has_objects => {
                parts.push(Part::new(words.rest()));
            }
            "s" => is_smooth = !matches!(words.peek(), None | Some("off" | "0")),
            // It holds for all faces that follow, across `o` and `g`.
            "usemtl" => material = Some(words.name().to_owned()).filter(|name| !name.is_empty()),
            "mtllib" => {
                libraries::read(reader, words.name(), &mut materials, &mut missing)?;
            }
            _ => match NOT_SHOWN.iter().find(|(words, _)| words.contains(&keyword)) {
                Some((_, what)) => told.add(what, keyword),
                None if SILENT.contains(&keyword) => {}
                None => told.add(&format!("statements \"{keyword}\" are not read"), keyword),
            },
        }
    }
    let whole = Words::from(&path, text, 0);
    for (what, (count, word)) in told.0 {
        let line = whole.line(word);
        reader.note(format!("{count} {what}, the first in line {line}"));
    }
    // Exporters write `g` without faces, and the first part is there before any statement.
    parts.retain(|part| !part.faces.is_empty());
    if parts.is_empty() {
        return Err(reader.fault("no faces: an OBJ file has lines that begin with `f`"));
    }
    colors::settle(reader, &mut lists.colors, true);
    // A library that is not there matters only if some face needs it.
    if define(reader, &mut parts, &mut materials, &lists) {
        reader.missing.append(&mut missing);
    }
    let mut names = Names::default();
    let mut root = Object::default();
    for part in parts {
        let name = names.unique(if part.name.is_empty() { "object" } else { &part.name });
        let mesh = part.into_mesh(&lists).map_err(|e| reader.fault(e.to_string()))?;
        root.children.push(Object::new(name, Shape::Faces(mesh)));
    }
    let plan = Plan { name: reader.stem(), root, ..Plan::default() };
    Ok(Document { materials, ..Document::with_plan(plan) })
}

/// Gives plain materials to faces whose `usemtl` no library defines, and tells what pictures have no place. Returns
/// whether there are such faces.
fn define(
    reader: &mut Reader,
    parts: &mut [Part],
    materials: &mut BTreeMap<String, Material>,
    lists: &Lists,
) -> bool {
    let without_comment = |name: &str| name.split(" #").next().unwrap_or(name).trim().to_owned();
    let mut missing: Vec<String> = Vec::new();
    let mut unplaced = 0;
    for part in parts {
        let has_colors = part.has_colors(lists);
        for name in &mut part.materials {
            if materials.contains_key(name) {
                continue;
            }
            // A comment behind a name, here or in the library.
            let bare = without_comment(name);
            let near =
                materials.keys().find(|known| **known == bare || without_comment(known) == *name);
            if let Some(near) = near {
                name.clone_from(near);
                continue;
            }
            let plain = Material::default();
            let color = if has_colors { Color::WHITE } else { plain.color };
            missing.push(name.clone());
            materials.insert(name.clone(), Material { color, ..plain });
        }
        let has_picture =
            |name: &String| materials.get(name).is_some_and(|material| !material.maps.is_empty());
        let pictured: Vec<bool> = part.materials.iter().map(has_picture).collect();
        unplaced += part.faces_without_uvs(&pictured);
    }
    match &missing[..] {
        _ if !reader.wants_pictures => {}
        [] => {}
        [name] => reader.note(format!("material \"{name}\" is not defined: a plain one is used")),
        names => {
            let (count, names) = (names.len(), list(names.iter().map(String::as_str)));
            reader.note(format!("{count} materials are not defined, plain ones are used: {names}"));
        }
    }
    if unplaced > 0 {
        reader.note(format!(
            "{unplaced} faces have a material with pictures, and no texture coordinates (`vt`) for them"
        ));
    }
    !missing.is_empty()
}
