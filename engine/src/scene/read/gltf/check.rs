//! What must be true of a document before it is read: its numbers name what is there, and the rules that the
//! `gltf` library does not check.

use ::gltf::json::Root;
use ::gltf::json::accessor::{Accessor, ComponentType};
use ::gltf::json::validation::{Checked, Error as Invalid, Validate};
use serde_json::Value;

use crate::open;

/// Every place that names something by its number, and the list that it is in. `*` is every field.
const REFERENCES: [(&str, &str); 31] = [
    ("scene", "scenes"),
    ("scenes/*/nodes/*", "nodes"),
    ("nodes/*/children/*", "nodes"),
    ("nodes/*/mesh", "meshes"),
    ("nodes/*/camera", "cameras"),
    ("nodes/*/skin", "skins"),
    ("nodes/*/extensions/KHR_lights_punctual/light", "extensions/KHR_lights_punctual/lights"),
    ("nodes/*/extensions/EXT_mesh_gpu_instancing/attributes/*", "accessors"),
    ("meshes/*/primitives/*/attributes/*", "accessors"),
    ("meshes/*/primitives/*/targets/*/*", "accessors"),
    ("meshes/*/primitives/*/indices", "accessors"),
    ("meshes/*/primitives/*/material", "materials"),
    ("accessors/*/bufferView", "bufferViews"),
    ("accessors/*/sparse/indices/bufferView", "bufferViews"),
    ("accessors/*/sparse/values/bufferView", "bufferViews"),
    ("bufferViews/*/buffer", "buffers"),
    ("images/*/bufferView", "bufferViews"),
    ("textures/*/source", "images"),
    ("textures/*/sampler", "samplers"),
    ("textures/*/extensions/EXT_texture_webp/source", "images"),
    ("skins/*/inverseBindMatrices", "accessors"),
    ("skins/*/joints/*", "nodes"),
    ("skins/*/skeleton", "nodes"),
    ("animations/*/channels/*/target/node", "nodes"),
    ("animations/*/samplers/*/input", "accessors"),
    ("animations/*/samplers/*/output", "accessors"),
    ("materials/*/normalTexture/index", "textures"),
    ("materials/*/occlusionTexture/index", "textures"),
    ("materials/*/emissiveTexture/index", "textures"),
    ("materials/*/pbrMetallicRoughness/*/index", "textures"),
    ("materials/*/extensions/*/*/index", "textures"),
];

/// Finds numbers that name what is not there.
pub(super) fn references(json: &Value, faults: &mut Vec<String>) {
    for (pattern, list) in REFERENCES {
        let all = list.split('/').try_fold(json, |at, name| at.get(name));
        let count = all.and_then(Value::as_array).map_or(0, Vec::len) as u64;
        follow(json, pattern, "", &mut |place, value| {
            let list = list.rsplit('/').next().unwrap_or(list);
            match value.as_u64() {
                Some(number) if number < count => {}
                Some(number) => {
                    faults.push(format!("{place} is {number}, and the file has {count} {list}"));
                }
                None => faults.push(format!("{place} is {value}, no number of the file's {list}")),
            }
        });
    }
}

fn follow(value: &Value, pattern: &str, place: &str, found: &mut impl FnMut(&str, &Value)) {
    if pattern.is_empty() {
        return found(place, value);
    }
    let (name, rest) = pattern.split_once('/').unwrap_or((pattern, ""));
    let inner = |name: &str| match place {
        "" => name.to_owned(),
        place => format!("{place}.{name}"),
    };
    match value {
        Value::Array(list) if name == "*" => {
            for (i, value) in list.iter().enumerate() {
                follow(value, rest, &format!("{place}[{i}]"), found);
            }
        }
        Value::Object(fields) if name == "*" => {
            for (name, value) in fields {
                follow(value, rest, &inner(name), found);
            }
        }
        Value::Object(fields) => {
            if let Some(value) = fields.get(name) {
                follow(value, rest, &inner(name), found);
            }
        }
        _ => {}
    }
}

/// Nothing, or what is wrong.
pub(super) fn refuse(faults: &[String]) -> Result<(), String> {
    match faults {
        [] => Ok(()),
        few if few.len() <= 5 => Err(format!("not valid glTF: {}", few.join("; "))),
        many => Err(format!("not valid glTF: {}, and more", many[..5].join("; "))),
    }
}

/// Finds breaches of the format's rules.
pub(super) fn structure(root: &Root, faults: &mut Vec<String>) {
    let by_library = open::guarded(|| {
        let mut faults = Vec::new();
        root.validate(root, ::gltf::json::Path::new, &mut |path, fault| {
            let path = path().to_string();
            // The format allows accessors without data (they are zeros), textures without a picture and
            // primitives without positions; samplers may be as they like, and bounds are not used.
            let may_miss = [
                ".bufferView",
                ".source",
                "attributes[\"POSITION\"]",
                "[\"POSITION\"].min",
                "[\"POSITION\"].max",
            ];
            let is_known = path.ends_with(".sampler") || path.starts_with("extensionsRequired");
            let allowed = is_known
                || fault == Invalid::Missing && may_miss.iter().any(|end| path.ends_with(end));
            if !allowed {
                faults.push(format!("{path}: {fault}"));
            }
        });
        faults
    });
    match by_library {
        Ok(found) => faults.extend(found),
        Err(broken) => faults.push(broken),
    }
    accessors(root, faults);
    buffer_views(root, faults);
    for (i, camera) in root.cameras.iter().enumerate() {
        if let Some(lens) = &camera.orthographic
            && (lens.xmag == 0.0 || lens.ymag == 0.0 || lens.zfar <= lens.znear)
        {
            faults.push(format!("cameras[{i}].orthographic: shows nothing"));
        }
        if let Some(lens) = &camera.perspective
            && (lens.yfov <= 0.0 || lens.zfar.is_some_and(|zfar| zfar <= lens.znear))
        {
            faults.push(format!("cameras[{i}].perspective: shows nothing"));
        }
        if camera.orthographic.is_none() && camera.perspective.is_none() {
            faults.push(format!("cameras[{i}]: has neither lens"));
        }
    }
    for (i, node) in root.nodes.iter().enumerate() {
        let has_parts =
            node.translation.is_some() || node.rotation.is_some() || node.scale.is_some();
        if node.matrix.is_some() && has_parts {
            faults.push(format!("nodes[{i}]: has both a matrix and its parts"));
        }
    }
}

fn buffer_views(root: &Root, faults: &mut Vec<String>) {
    for (i, view) in root.buffer_views.iter().enumerate() {
        let buffer = root.buffers.get(view.buffer.value());
        let end = view.byte_offset.map_or(0, |offset| offset.0).checked_add(view.byte_length.0);
        if buffer.is_some_and(|buffer| end.is_none_or(|end| end > buffer.byte_length.0)) {
            faults.push(format!("bufferViews[{i}]: reaches beyond its buffer"));
        }
        if let Some(stride) = view.byte_stride
            && !(stride.0 % 4 == 0 && (4..=252).contains(&stride.0))
        {
            let stride = stride.0;
            faults.push(format!(
                "bufferViews[{i}].byteStride: {stride} is no multiple of 4 from 4 to 252"
            ));
        }
    }
}

fn accessors(root: &Root, faults: &mut Vec<String>) {
    for (i, accessor) in root.accessors.iter().enumerate() {
        let mut fault = |what: &str| faults.push(format!("accessors[{i}]: {what}"));
        let (Checked::Valid(kind), Checked::Valid(shape)) =
            (&accessor.component_type, &accessor.type_)
        else {
            continue;
        };
        let width = kind.0.size();
        let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
        if offset % width as u64 != 0 {
            fault("its offset is no multiple of its components' size");
        }
        if accessor.normalized && kind.0 == ComponentType::F32 {
            fault("floats cannot be normalized");
        }
        if accessor.sparse.as_ref().is_some_and(|sparse| sparse.count.0 > accessor.count.0) {
            fault("it has more sparse values than values");
        }
        match accessor.buffer_view.map(|view| root.buffer_views.get(view.value())) {
            None if accessor.byte_offset.is_some() => fault("it has an offset but no buffer view"),
            Some(Some(view)) => {
                let size = width * shape.multiplicity();
                if view.byte_stride.is_some_and(|stride| stride.0 < size) {
                    fault("its buffer view's stride is less than an element");
                }
            }
            _ => {}
        }
    }
    for (i, mesh) in root.meshes.iter().enumerate() {
        for primitive in &mesh.primitives {
            let count = |index: &::gltf::json::Index<_>| {
                root.accessors.get(index.value()).map(|accessor: &Accessor| accessor.count.0)
            };
            let mut counts = primitive.attributes.values().map(count);
            let first = counts.next();
            if counts.any(|count| Some(count) != first) {
                faults.push(format!("meshes[{i}]: its attributes differ in count"));
            }
        }
    }
}
