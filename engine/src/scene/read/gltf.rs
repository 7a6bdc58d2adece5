//! glTF 2.0, by the `gltf` library, which checks the document's structure. What it leaves unchecked,
//! and would trip over, is checked here: buffers, accessors, and nodes that contain themselves.

use base64::Engine as _;
use glam::{DAffine3, DMat4, DQuat, DVec3, Vec2, Vec3};
use gltf::accessor::{DataType, Dimensions};
use std::collections::HashSet;

use super::super::document::{Document, Object, Plan, Transform};
use super::super::material::{AlphaMode, Map, Material, Picture};
use super::super::mesh::Mesh;
use super::super::shape::Shape;
use super::{Names, Reader};
use crate::camera::Camera;
use crate::color::Color;
use crate::error::{Error, Result};

/// Extensions that a file may require. Those of materials and textures that are read later change the
/// look and not the geometry.
const EXTENSIONS: [&str; 1] = ["KHR_materials_unlit"];

pub(super) fn read(reader: &mut Reader, bytes: &[u8]) -> Result<Document> {
    let file = ::gltf::Gltf::from_slice(bytes).map_err(|e| parse_fault(reader, e))?;
    for extension in file.extensions_required() {
        if !EXTENSIONS.contains(&extension) {
            return Err(reader.fault(format!("the file needs the extension {extension}, which is not known")));
        }
    }
    let mut buffers = Vec::new();
    for buffer in file.buffers() {
        buffers.push(buffer_data(reader, &buffer, file.blob.as_deref())?);
    }
    let mut builder = Builder { reader, buffers, material_names: Vec::new() };
    let mut document = Document::default();
    let mut names = Names::default();
    for material in file.materials() {
        let index = material.index().unwrap_or(0);
        let name = names.unique(material.name().unwrap_or(&format!("material {index}")));
        builder.material_names.push(name.clone());
        document.materials.insert(name, builder.material(&material));
    }
    let mut definitions = std::collections::BTreeMap::new();
    let mut names = Names::default();
    let mut mesh_names = Vec::new();
    for mesh in file.meshes() {
        let name = names.unique(mesh.name().unwrap_or(&format!("mesh {}", mesh.index())));
        definitions.insert(name.clone(), builder.mesh(&mesh)?);
        mesh_names.push(name);
    }
    let mut names = Names::default();
    for scene in file.scenes() {
        let name = names.unique(scene.name().unwrap_or(&format!("scene {}", scene.index())));
        let mut plan =
            Plan { name: name.clone(), definitions: definitions.clone(), ..Plan::default() };
        let mut walk = Walk { mesh_names: &mesh_names, plan: &mut plan, open: HashSet::new() };
        let mut siblings = Names::default();
        for node in scene.nodes() {
            let object = walk.node(&node, &DAffine3::IDENTITY, &mut siblings);
            let object = object.map_err(|e| builder.reader.fault(e.to_string()))?;
            walk.plan.root.children.push(object);
        }
        if file.default_scene().is_some_and(|default| default.index() == scene.index()) {
            document.default_plan = Some(name);
        }
        document.plans.push(plan);
    }
    if document.plans.is_empty() {
        builder.reader.note("the file has no scene: nothing is shown");
        document.plans.push(Plan { name: builder.reader.stem(), ..Plan::default() });
    }
    Ok(document)
}

fn parse_fault(reader: &Reader, error: ::gltf::Error) -> Error {
    match error {
        ::gltf::Error::Deserialize(e) => {
            Error::at_line(&reader.path, e.line(), e.column(), format!("not glTF: {e}"))
        }
        ::gltf::Error::Validation(faults) => {
            let list: Vec<String> =
                faults.iter().take(5).map(|(path, fault)| format!("{path}: {fault}")).collect();
            let more = if faults.len() > 5 { ", and more" } else { "" };
            reader.fault(format!("not valid glTF: {}{more}", list.join("; ")))
        }
        other => reader.fault(format!("not glTF: {other}")),
    }
}

/// The bytes of a buffer: of the file's own chunk, a data URI, or another file.
fn buffer_data(
    reader: &mut Reader,
    buffer: &::gltf::Buffer<'_>,
    blob: Option<&[u8]>,
) -> Result<Vec<u8>> {
    let index = buffer.index();
    let data = match buffer.source() {
        ::gltf::buffer::Source::Bin => {
            let missing = || reader.fault(format!("buffer {index} has no data: the file has no chunk for it"));
            blob.ok_or_else(missing)?.to_vec()
        }
        ::gltf::buffer::Source::Uri(uri) => match uri.strip_prefix("data:") {
            Some(data) => {
                let text = data.split_once(";base64,").map(|(_, text)| text).unwrap_or("");
                base64::engine::general_purpose::STANDARD
                    .decode(text)
                    .map_err(|e| reader.fault(format!("buffer {index} is not base64: {e}")))?
            }
            None => reader.sibling(&decoded(uri))?.1,
        },
    };
    if data.len() < buffer.length() {
        return Err(reader.fault(format!(
            "buffer {index} has {} bytes, {} are announced",
            data.len(),
            buffer.length()
        )));
    }
    Ok(data)
}

/// A URI with its percent codes resolved.
fn decoded(uri: &str) -> String {
    let bytes = uri.as_bytes();
    let mut out = Vec::new();
    let mut i = 0;
    while i < bytes.len() {
        let code = (bytes[i] == b'%').then(|| uri.get(i + 1..i + 3)).flatten();
        match code.and_then(|code| u8::from_str_radix(code, 16).ok()) {
            Some(byte) => {
                out.push(byte);
                i += 3;
            }
            None => {
                out.push(bytes[i]);
                i += 1;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

struct Builder<'a> {
    reader: &'a mut Reader,
    buffers: Vec<Vec<u8>>,
    material_names: Vec<String>,
}

impl Builder<'_> {
    fn material(&mut self, material: &::gltf::Material<'_>) -> Material {
        let pbr = material.pbr_metallic_roughness();
        let [r, g, b, alpha] = pbr.base_color_factor();
        let mut maps = std::collections::BTreeMap::new();
        let mut map = |what: &str, texture: ::gltf::Texture<'_>, uv_set: u32| {
            let picture = match texture.source().source() {
                ::gltf::image::Source::Uri { uri, .. } if !uri.starts_with("data:") => {
                    Picture::File(decoded(uri))
                }
                _ => {
                    let name = self.reader.path.file_name().unwrap_or_default();
                    let index = texture.source().index() as u32;
                    Picture::Embedded(name.to_string_lossy().into_owned(), index)
                }
            };
            maps.insert(what.to_owned(), Map { picture, uv_set });
        };
        if let Some(info) = pbr.base_color_texture() {
            map("color", info.texture(), info.tex_coord());
        }
        if let Some(info) = pbr.metallic_roughness_texture() {
            map("metallic_roughness", info.texture(), info.tex_coord());
        }
        if let Some(info) = material.normal_texture() {
            map("normal", info.texture(), info.tex_coord());
        }
        if let Some(info) = material.emissive_texture() {
            map("emission", info.texture(), info.tex_coord());
        }
        if let Some(info) = material.occlusion_texture() {
            map("occlusion", info.texture(), info.tex_coord());
        }
        Material {
            color: Color::new(r, g, b),
            alpha,
            alpha_mode: match material.alpha_mode() {
                ::gltf::material::AlphaMode::Opaque => AlphaMode::Opaque,
                ::gltf::material::AlphaMode::Mask => {
                    AlphaMode::Mask(material.alpha_cutoff().unwrap_or(0.5))
                }
                ::gltf::material::AlphaMode::Blend => AlphaMode::Blend,
            },
            unlit: material.unlit(),
            one_sided: !material.double_sided(),
            maps,
        }
    }

    /// A mesh's primitives as one object, or as children if there are several.
    fn mesh(&mut self, mesh: &::gltf::Mesh<'_>) -> Result<Object> {
        let mut parts = Vec::new();
        for primitive in mesh.primitives() {
            let what = format!("mesh {} primitive {}", mesh.index(), primitive.index());
            let faces = self.primitive(&primitive, &what);
            let faces = faces.map_err(|e| self.reader.fault(format!("{what}: {e}")))?;
            if faces.face_count() > 0 {
                let name = format!("part {}", primitive.index());
                parts.push(Object::new(name, Shape::Faces(faces)));
            }
        }
        Ok(match <[Object; 1]>::try_from(parts) {
            Ok([only]) => Object { name: String::new(), ..only },
            Err(children) => Object { children, ..Object::default() },
        })
    }

    fn primitive(&mut self, primitive: &::gltf::Primitive<'_>, what: &str) -> Result<Mesh> {
        use ::gltf::mesh::{Mode, Semantic};
        let mode = primitive.mode();
        if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            self.reader.note(format!("{what} is points or lines: it is left out"));
            return Ok(Mesh::default());
        }
        let mut mesh = Mesh::default();
        let mut has_points = false;
        for (semantic, accessor) in primitive.attributes() {
            let float = [DataType::F32];
            let share = [DataType::F32, DataType::U8, DataType::U16];
            match semantic {
                Semantic::Positions => {
                    self.check(&accessor, &[Dimensions::Vec3], &float)?;
                    has_points = true;
                }
                Semantic::Normals => self.check(&accessor, &[Dimensions::Vec3], &float)?,
                Semantic::TexCoords(0) => self.check(&accessor, &[Dimensions::Vec2], &share)?,
                Semantic::Colors(0) => {
                    self.check(&accessor, &[Dimensions::Vec3, Dimensions::Vec4], &share)?;
                }
                _ => {}
            }
        }
        if !has_points {
            return Err(Error::invalid("there are no positions"));
        }
        if let Some(accessor) = primitive.indices() {
            let whole = [DataType::U8, DataType::U16, DataType::U32];
            self.check(&accessor, &[Dimensions::Scalar], &whole)?;
        }
        let buffers = &self.buffers;
        let data = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
        let points = data.read_positions().ok_or_else(|| Error::invalid("positions cannot be read"))?;
        mesh.points = points.map(|p| DVec3::from(p.map(f64::from))).collect();
        if let Some(normals) = data.read_normals() {
            mesh.normals = normals.map(|n| Vec3::from(n).normalize_or_zero()).collect();
        }
        if let Some(uvs) = data.read_tex_coords(0) {
            // glTF measures v downwards.
            mesh.uvs = uvs.into_f32().map(|[u, v]| Vec2::new(u, 1.0 - v)).collect();
        }
        if let Some(colors) = data.read_colors(0) {
            mesh.colors = colors.into_rgba_f32().collect();
        }
        mesh.validate()?;
        let corners: Vec<u32> = match data.read_indices() {
            Some(indices) => indices.into_u32().collect(),
            None => (0..mesh.points.len() as u32).collect(),
        };
        let front = primitive.material().index().map(|i| self.material_names[i].clone());
        let front = front.map(|name| mesh.material(&name));
        for at in 0..triangle_count(mode, corners.len()) {
            let triangle = match mode {
                Mode::TriangleStrip if at % 2 == 1 => [at + 1, at, at + 2],
                Mode::TriangleStrip => [at, at + 1, at + 2],
                Mode::TriangleFan => [0, at + 1, at + 2],
                _ => [3 * at, 3 * at + 1, 3 * at + 2],
            };
            mesh.add_polygon(&triangle.map(|i| corners[i]), front)?;
        }
        Ok(mesh)
    }

    /// Checks that an accessor is of a known type and that its data lies within its buffer.
    fn check(
        &self,
        accessor: &::gltf::Accessor<'_>,
        dimensions: &[Dimensions],
        types: &[DataType],
    ) -> Result<()> {
        let index = accessor.index();
        let fault = |what: &str| Error::invalid(format!("accessor {index} {what}"));
        if !dimensions.contains(&accessor.dimensions()) || !types.contains(&accessor.data_type()) {
            let (dimensions, kind) = (accessor.dimensions(), accessor.data_type());
            return Err(fault(&format!("is {dimensions:?} of {kind:?}, which does not fit its use")));
        }
        let count = accessor.count();
        let size = accessor.size();
        if count == 0 {
            return Err(fault("is empty"));
        }
        if let Some(view) = accessor.view() {
            self.check_view(&view, accessor.offset(), count, size).map_err(|e| fault(&e))?;
        }
        match accessor.sparse() {
            None if accessor.view().is_none() => Err(fault("has no data")),
            None => Ok(()),
            Some(sparse) => {
                // Without a view the rest is zeros, which cost a file nothing.
                if sparse.count() == 0 || sparse.count() > count || count > 1 << 26 {
                    return Err(fault("has more sparse values than it has values"));
                }
                let indices = sparse.indices();
                let width = indices.index_type().size();
                let view = indices.view();
                self.check_view(&view, indices.offset(), sparse.count(), width).map_err(|e| fault(&e))?;
                let values = sparse.values();
                self.check_view(&values.view(), values.offset(), sparse.count(), size)
                    .map_err(|e| fault(&e))
            }
        }
    }

    fn check_view(
        &self,
        view: &::gltf::buffer::View<'_>,
        offset: usize,
        count: usize,
        size: usize,
    ) -> Result<(), String> {
        let name = format!("uses buffer view {}", view.index());
        let stride = view.stride().unwrap_or(size);
        if stride < size {
            return Err(format!("{name}, whose stride {stride} is less than the {size} bytes of an element"));
        }
        let end = stride
            .checked_mul(count - 1)
            .and_then(|bytes| bytes.checked_add(size))
            .and_then(|bytes| bytes.checked_add(offset));
        if end.is_none_or(|end| end > view.length()) {
            return Err(format!("{name} of {} bytes, which is too short", view.length()));
        }
        let end = view.offset().checked_add(view.length());
        let buffer = self.buffers.get(view.buffer().index()).map_or(0, Vec::len);
        if end.is_none_or(|end| end > buffer) {
            return Err(format!("{name}, which reaches beyond its buffer of {buffer} bytes"));
        }
        Ok(())
    }
}

fn triangle_count(mode: ::gltf::mesh::Mode, corners: usize) -> usize {
    match mode {
        ::gltf::mesh::Mode::Triangles => corners / 3,
        _ => corners.saturating_sub(2),
    }
}

/// A walk over a scene's nodes.
struct Walk<'a> {
    mesh_names: &'a [String],
    plan: &'a mut Plan,
    open: HashSet<usize>,
}

impl Walk<'_> {
    fn node(
        &mut self,
        node: &::gltf::Node<'_>,
        above: &DAffine3,
        siblings: &mut Names,
    ) -> Result<Object> {
        let index = node.index();
        if !self.open.insert(index) {
            return Err(Error::invalid(format!("node {index} contains itself")));
        }
        if self.open.len() > 256 {
            return Err(Error::invalid("nodes are nested more than 256 deep"));
        }
        let local = match node.transform() {
            ::gltf::scene::Transform::Matrix { matrix } => {
                DAffine3::from_mat4(DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from))))
            }
            ::gltf::scene::Transform::Decomposed { translation, rotation, scale } => {
                let turn = DQuat::from_array(rotation.map(f64::from));
                DAffine3::from_scale_rotation_translation(
                    DVec3::from(scale.map(f64::from)),
                    if turn.length_squared() > 0.0 { turn.normalize() } else { DQuat::IDENTITY },
                    DVec3::from(translation.map(f64::from)),
                )
            }
        };
        let world = *above * local;
        if let Some(camera) = node.camera() {
            let name = camera.name().or(node.name()).map(str::to_owned);
            let name = name.unwrap_or_else(|| format!("camera {}", camera.index()));
            self.plan.cameras.insert(name, view(&camera, &world));
        }
        let name = siblings.unique(node.name().unwrap_or(&format!("node {index}")));
        let shape = match node.mesh() {
            Some(mesh) => Shape::Instance(self.mesh_names[mesh.index()].clone()),
            None => Shape::Group,
        };
        let mut object = Object { transform: Transform::from_matrix(local), ..Object::new(name, shape) };
        let mut names = Names::default();
        for child in node.children() {
            object.children.push(self.node(&child, &world, &mut names)?);
        }
        self.open.remove(&index);
        Ok(object)
    }
}

fn view(camera: &::gltf::Camera<'_>, world: &DAffine3) -> Camera {
    let position = world.translation;
    let mut view = Camera {
        position,
        look_at: position - world.matrix3.z_axis,
        up: world.matrix3.y_axis,
        ..Camera::default()
    };
    match camera.projection() {
        ::gltf::camera::Projection::Perspective(lens) => {
            view.field_of_view = f64::from(lens.yfov()).to_degrees();
            view.front = f64::from(lens.znear());
            view.back = lens.zfar().map(f64::from);
        }
        ::gltf::camera::Projection::Orthographic(lens) => {
            view.parallel_height = Some(2.0 * f64::from(lens.ymag()));
            view.front = f64::from(lens.znear());
            view.back = Some(f64::from(lens.zfar()));
        }
    }
    view
}
