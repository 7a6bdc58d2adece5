//! The document: its container, its JSON, and checks that the `gltf` library does not make.

use ::gltf::binary::Glb;
use ::gltf::json::Root;
use ::gltf::json::accessor::{Accessor, ComponentType};
use ::gltf::json::texture::WrappingMode;
use ::gltf::json::validation::{Checked, Error as Invalid, Validate};
use glam::DVec2;
use serde::Deserialize;
use serde_json::{Map, Value};

use super::super::Reader;
use crate::error::{Error, Result};
use crate::math;
use crate::texture::{Mapping, Wrap};

/// Extensions that a file may require.
const EXTENSIONS: [&str; 2] = ["KHR_materials_unlit", "KHR_texture_transform"];

/// Parses and checks a file; returns its document and its own chunk of data.
pub(super) fn parse(reader: &Reader, bytes: &[u8]) -> Result<(::gltf::Document, Option<Vec<u8>>)> {
    let (json, blob) = container(reader, bytes)?;
    let root = root(reader, &json)?;
    if !root.asset.version.starts_with("2.") {
        let version = &root.asset.version;
        return Err(reader.fault(format!("glTF version \"{version}\": this program reads 2.0")));
    }
    for extension in &root.extensions_required {
        if !EXTENSIONS.contains(&extension.as_str()) {
            let message = format!("the file needs the extension {extension}, which is not known");
            return Err(reader.fault(message));
        }
    }
    let mut faults = Vec::new();
    root.validate(&root, ::gltf::json::Path::new, &mut |path, fault| {
        let path = path().to_string();
        // The format allows accessors without data (they are zeros), textures without a picture and
        // primitives without positions; skins and samplers are not used.
        let may_miss = [".bufferView", ".source", "attributes[\"POSITION\"]"];
        let is_unused = path.ends_with(".skin") || path.ends_with(".sampler");
        // Which are known was looked at above.
        let allowed = is_unused
            || path.starts_with("extensionsRequired")
            || fault == Invalid::Missing && may_miss.iter().any(|end| path.ends_with(end));
        if !allowed {
            faults.push(format!("{path}: {fault}"));
        }
    });
    further_checks(&root, &mut faults);
    if !faults.is_empty() {
        let more = if faults.len() > 5 { ", and more" } else { "" };
        faults.truncate(5);
        return Err(reader.fault(format!("not valid glTF: {}{more}", faults.join("; "))));
    }
    Ok((::gltf::Document::from_json_without_validation(root), blob))
}

/// The JSON of a file and, if it is a GLB, its data.
fn container(reader: &Reader, bytes: &[u8]) -> Result<(Vec<u8>, Option<Vec<u8>>)> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes.to_vec(), None));
    }
    let word =
        |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let length = word(8).unwrap_or(0) as usize;
    if length < 12 || length > bytes.len() {
        let message = format!("the GLB announces {length} bytes, the file has {}", bytes.len());
        return Err(Error::at_byte(&reader.path, 8, message));
    }
    let glb = Glb::from_slice(&bytes[..length])
        .map_err(|e| Error::at_byte(&reader.path, 12, format!("not a GLB: {e}")))?;
    Ok((glb.json.into_owned(), glb.bin.map(|bin| bin.into_owned())))
}

fn root(reader: &Reader, json: &[u8]) -> Result<Root> {
    serde_json::from_slice(json).or_else(|error| {
        // Parts that a scene does not use may be as they like.
        let stripped = serde_json::from_slice::<Value>(json).ok().and_then(|mut value| {
            for unused in ["animations", "skins", "samplers"] {
                value.as_object_mut()?.remove(unused);
            }
            serde_json::from_value(value).ok()
        });
        stripped.ok_or_else(|| {
            Error::at_line(&reader.path, error.line(), error.column(), format!("not glTF: {error}"))
        })
    })
}

/// Rules of the format that the library does not check.
fn further_checks(root: &Root, faults: &mut Vec<String>) {
    check_accessors(root, faults);
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
    }
    for (i, node) in root.nodes.iter().enumerate() {
        let has_parts =
            node.translation.is_some() || node.rotation.is_some() || node.scale.is_some();
        if node.matrix.is_some() && has_parts {
            faults.push(format!("nodes[{i}]: has both a matrix and its parts"));
        }
    }
}

fn check_accessors(root: &Root, faults: &mut Vec<String>) {
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

/// Whether a texture has a picture.
pub(super) fn has_picture(file: &::gltf::Document, texture: usize) -> bool {
    let root = file.as_json();
    root.textures.get(texture).is_some_and(|texture| texture.source.value() < root.images.len())
}

/// What is beside the picture of a texture, if its sampler is sound; else the picture again.
pub(super) fn wrap(file: &::gltf::Document, texture: usize) -> [Wrap; 2] {
    let root = file.as_json();
    let sampler = root.textures.get(texture).and_then(|texture| texture.sampler);
    let Some(sampler) = sampler.and_then(|index| root.samplers.get(index.value())) else {
        return [Wrap::Repeat; 2];
    };
    [sampler.wrap_s, sampler.wrap_t].map(|mode| match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    })
}

/// How a texture lies, as the extension KHR_texture_transform says.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Placed {
    offset: [f64; 2],
    rotation: f64,
    scale: [f64; 2],
}

impl Default for Placed {
    fn default() -> Placed {
        Placed { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2] }
    }
}

/// How a texture lies: by which texture coordinates, what is done to these, and what of it is not as the file says.
pub(super) fn placing(
    others: Option<&Map<String, Value>>,
    uv_set: u32,
    wrap: [Wrap; 2],
) -> (Mapping, u32, Option<String>) {
    let plain = Mapping { wrap, ..Mapping::default() };
    let Some(value) = others.and_then(|others| others.get("KHR_texture_transform")) else {
        return (plain, uv_set, None);
    };
    // Which coordinates holds even where what is done to them cannot be.
    let own_set = value.get("texCoord").and_then(Value::as_u64).and_then(|set| set.try_into().ok());
    let uv_set = own_set.unwrap_or(uv_set);
    let placed = serde_json::from_value(value.clone()).map_err(|error| error.to_string());
    match placed.and_then(|placed: Placed| placed.mapping(wrap)) {
        Ok(mapping) => (mapping, uv_set, None),
        Err(what) => (plain, uv_set, Some(format!("KHR_texture_transform: {what}"))),
    }
}

impl Placed {
    /// What it does to coordinates.
    fn mapping(self, wrap: [Wrap; 2]) -> std::result::Result<Mapping, String> {
        let Placed { offset: [left, up], rotation, scale: [x, y] } = self;
        // There v goes down, and is stretched before it is turned; here v goes up, and is stretched afterwards. The two
        // can be exchanged where nothing is skewed.
        let (sin, cos) = (math::sin(rotation), math::cos(rotation));
        let is_even = (x.abs() - y.abs()).abs() <= 1e-6 * x.abs().max(y.abs());
        // A turn goes the other way in a mirror.
        let turn = if is_even && x * y < 0.0 { rotation } else { -rotation };
        let scale = match (cos.abs() > 1.0 - 1e-9, sin.abs() > 1.0 - 1e-9) {
            (is_straight, _) if is_straight || is_even => DVec2::new(x, y),
            (_, true) => DVec2::new(y, x),
            _ => {
                return Err(
                    "it is turned and stretched unevenly, which skews it: give its vertices \
                 the coordinates instead"
                        .to_owned(),
                );
            }
        };
        let offset = DVec2::new(left + sin * y, 1.0 - cos * y - up);
        let turn = turn.to_degrees();
        let mapping = Mapping { wrap, turn, scale, offset, ..Mapping::default() };
        mapping.check().map_err(|error| error.to_string())?;
        Ok(mapping)
    }
}
