//! The document: its container and its JSON.
//!
//! The `gltf` library knows the structure of the format but is stricter than its specification. What it
//! would refuse without need is made plain before it sees the document: whole numbers written `1.0`, `extras` of
//! any kind, attributes of an application (`_NAME`), scenes without nodes, channels of animations that move no node.
//! Extensions are kept apart, as JSON.

use ::gltf::binary::Glb;
use ::gltf::json::Root;
use ::gltf::json::animation::VALID_PROPERTIES;
use serde_json::Value;
use std::collections::BTreeSet;

use super::super::reader::Reader;
use super::{check, extensions};
use crate::error::{Error, Result};
use crate::open;

/// A document that was checked.
pub(super) struct File {
    /// What the specification itself knows.
    pub(super) root: Root,
    /// All of it, for extensions.
    pub(super) json: Value,
    /// What is wrong with the animations, if they are left out.
    pub(super) unplayable: Option<String>,
}

impl File {
    /// What an extension says of an object of the document, such as `["nodes", "3"]`.
    pub(super) fn extension(&self, list: &str, index: usize, name: &str) -> Option<&Value> {
        self.json.get(list)?.get(index)?.get("extensions")?.get(name)
    }

    /// Whether an extension is declared.
    pub(super) fn declares(&self, name: &str) -> bool {
        let all = self.root.extensions_used.iter().chain(&self.root.extensions_required);
        all.into_iter().any(|declared| declared == name)
    }

    /// The names of all extensions that are declared, or used without.
    pub(super) fn extensions(&self) -> BTreeSet<String> {
        fn find(value: &Value, all: &mut BTreeSet<String>) {
            match value {
                Value::Array(list) => list.iter().for_each(|value| find(value, all)),
                Value::Object(fields) => {
                    if let Some(Value::Object(used)) = fields.get("extensions") {
                        all.extend(used.keys().cloned());
                    }
                    fields.values().for_each(|value| find(value, all));
                }
                _ => {}
            }
        }
        let declared = self.root.extensions_used.iter().chain(&self.root.extensions_required);
        let mut all: BTreeSet<String> = declared.cloned().collect();
        find(&self.json, &mut all);
        all
    }
}

/// Parses and checks a file; returns its document and its own chunk of data.
pub(super) fn parse(reader: &mut Reader, bytes: &[u8]) -> Result<(File, Option<Vec<u8>>)> {
    let (text, blob) = container(reader, bytes)?;
    let text = open::text(&reader.path, &text)?;
    if let Some(note) = text.note {
        reader.note(note);
    }
    let mut json: Value = serde_json::from_str(&text.text).map_err(|error| {
        let (line, column) = (error.line(), error.column());
        Error::at_line(&reader.path, line, column, format!("not glTF: {error}"))
    })?;
    make_plain(&mut json);
    let fault = |what: String| Error::in_file(&reader.path, what);
    version(&json).map_err(fault)?;
    extensions::check_required(&json).map_err(fault)?;
    let mut faults = Vec::new();
    check::references(&json, &mut faults);
    check::refuse(&faults).map_err(fault)?;
    let (root, unplayable) = root(&json).map_err(|error| {
        // The library sees no text: what it blames is looked for in it.
        let (line, column) = match serde_json::from_str::<Root>(&text.text) {
            Err(again) if again.to_string().starts_with(&error) => (again.line(), again.column()),
            _ => return fault(format!("not glTF: {error}")),
        };
        Error::at_line(&reader.path, line, column, format!("not glTF: {error}"))
    })?;
    check::structure(&root, &mut faults);
    check::refuse(&faults).map_err(fault)?;
    Ok((File { root, json, unplayable }, blob))
}

/// The JSON of a file and, if it is a GLB, its data.
fn container(reader: &Reader, bytes: &[u8]) -> Result<(Vec<u8>, Option<Vec<u8>>)> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes.to_vec(), None));
    }
    let word =
        |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let version = word(4).unwrap_or(0);
    if version != 2 {
        let message = format!("GLB version {version}: this program reads 2");
        return Err(Error::at_byte(&reader.path, 4, message));
    }
    let length = word(8).unwrap_or(0) as usize;
    if length < 12 || length > bytes.len() {
        let message = format!("the GLB announces {length} bytes, the file has {}", bytes.len());
        return Err(Error::at_byte(&reader.path, 8, message));
    }
    let glb = Glb::from_slice(&bytes[..length])
        .map_err(|e| Error::at_byte(&reader.path, 12, format!("not a GLB: {e}")))?;
    let mut json = glb.json.into_owned();
    // Some writers fill the chunk with zeros.
    while json.last() == Some(&0) {
        json.pop();
    }
    Ok((json, glb.bin.map(|bin| bin.into_owned())))
}

/// Makes whole numbers whole and takes what applications keep for themselves away.
fn make_plain(value: &mut Value) {
    match value {
        Value::Number(number) => {
            if let Some(float) = number.as_f64().filter(|_| number.is_f64())
                && float.fract() == 0.0
                // Beyond 2^53 a float does not tell whole numbers apart.
                && float.abs() < 9e15
                // A whole number has no negative zero.
                && !(float == 0.0 && float.is_sign_negative())
            {
                *value = Value::from(float as i64);
            }
        }
        Value::Array(list) => list.iter_mut().for_each(make_plain),
        Value::Object(fields) => {
            fields.remove("extras");
            fields.values_mut().for_each(make_plain);
        }
        _ => {}
    }
}

fn version(json: &Value) -> std::result::Result<(), String> {
    let asset = json.get("asset").ok_or("not glTF: it has no `asset`")?;
    let version = asset.get("version").and_then(Value::as_str).unwrap_or_default();
    if version.starts_with("2.") {
        return Ok(());
    }
    let cure =
        if version.starts_with('1') { ": open it in Blender and export it again" } else { "" };
    Err(format!("glTF version \"{version}\": this program reads 2.0{cure}"))
}

/// The document as the library has it, and what is wrong with its animations, if they are left out.
fn root(json: &Value) -> std::result::Result<(Root, Option<String>), String> {
    let mut plain = json.clone();
    without_extensions(&mut plain);
    for primitive in each(&mut plain, "meshes").flat_map(|mesh| each(mesh, "primitives")) {
        if let Some(Value::Object(attributes)) = primitive.get_mut("attributes") {
            attributes.retain(|name, _| !name.starts_with('_'));
        }
        for target in each(primitive, "targets") {
            if let Value::Object(attributes) = target {
                attributes.retain(|name, _| ["POSITION", "NORMAL", "TANGENT"].contains(&&**name));
            }
        }
    }
    for animation in each(&mut plain, "animations") {
        if let Some(Value::Array(channels)) = animation.get_mut("channels") {
            channels.retain(moves_a_node);
        }
    }
    for (list, field) in [("scenes", "nodes"), ("skins", "joints")] {
        for object in each(&mut plain, list).filter_map(Value::as_object_mut) {
            object.entry(field).or_insert_with(|| Value::Array(Vec::new()));
        }
    }
    let error = match serde_json::from_value(plain.clone()) {
        Ok(root) => return Ok((root, None)),
        Err(error) => error.to_string(),
    };
    // A still can be shown without these.
    for field in ["samplers", "animations"] {
        let had = plain.as_object_mut().and_then(|fields| fields.remove(field)).is_some();
        if let Ok(root) = serde_json::from_value(plain.clone()) {
            let is_unplayable = had && field == "animations";
            return Ok((root, is_unplayable.then_some(error)));
        }
    }
    Err(error)
}

/// Whether a channel of an animation moves a node, and not what an extension names.
fn moves_a_node(channel: &Value) -> bool {
    let target = channel.get("target");
    let path = target.and_then(|target| target.get("path")).and_then(Value::as_str);
    target.is_some_and(|target| target.get("node").is_some())
        && path.is_some_and(|path| VALID_PROPERTIES.contains(&path))
}

fn each<'v>(value: &'v mut Value, list: &str) -> impl Iterator<Item = &'v mut Value> {
    value.get_mut(list).and_then(Value::as_array_mut).into_iter().flatten()
}

fn without_extensions(value: &mut Value) {
    match value {
        Value::Array(list) => list.iter_mut().for_each(without_extensions),
        Value::Object(fields) => {
            fields.remove("extensions");
            fields.values_mut().for_each(without_extensions);
        }
        _ => {}
    }
}
