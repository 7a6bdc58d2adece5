//! glTF 2.0, by the `gltf` library, which checks the document's structure. What it leaves unchecked, and
//! would trip over, is checked here: containers ([`parse`]), buffers and accessors ([`buffers`]), nodes
//! that contain themselves. Parts that a scene does not use, such as animations, may be broken.

mod buffers;
mod parse;

use ::gltf::accessor::{DataType, Dimensions};
use buffers::Buffers;
use glam::{DAffine3, DMat4, DQuat, DVec3, Vec2, Vec3};
use std::collections::HashSet;

use super::super::document::{Document, Object, Plan, Transform};
use super::super::material::{AlphaMode, Map, Material, Picture};
use super::super::mesh::Mesh;
use super::super::shape::Shape;
use super::{Names, Reader};
use crate::camera::Camera;
use crate::color::Color;
use crate::error::{Error, Result};
use crate::fragment::{Finish, Gloss};
use crate::image::file::Encoded;

pub(super) fn read(reader: &mut Reader, bytes: &[u8]) -> Result<Document> {
    let (file, blob) = parse::parse(reader, bytes)?;
    let buffers = Buffers::new(&file, blob);
    let mut builder = Builder {
        reader,
        buffers,
        material_names: Vec::new(),
        uv_sets: Vec::new(),
        is_mapped: Vec::new(),
    };
    let mut document = Document::default();
    let mut names = Names::default();
    for material in file.materials() {
        let index = material.index().unwrap_or(0);
        let name = names.unique(material.name().unwrap_or(&format!("material {index}")));
        builder.material_names.push(name.clone());
        document.materials.insert(name, builder.material(&file, &material));
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

/// Reads a picture that a file holds itself, by its number, as PNG or JPEG.
///
/// # Errors
/// If there is none.
pub(in crate::scene) fn picture(path: &std::path::Path, number: u32) -> Result<Vec<u8>> {
    let mut reader = Reader::new(path);
    let bytes = reader.bytes(path)?;
    let (file, blob) = parse::parse(&reader, &bytes)?;
    let mut buffers = Buffers::new(&file, blob);
    let image = file.images().nth(number as usize).ok_or_else(|| {
        Error::in_file(path, format!("picture {number}: the file has no such picture"))
    })?;
    held(&mut reader, &mut buffers, &image)
}

/// The bytes that the pictures of a file take as pyramids, at most; 0 for those that are not to be read.
///
/// # Errors
/// If the file cannot be read.
pub(in crate::scene) fn picture_bytes(path: &std::path::Path) -> Result<Vec<u64>> {
    let mut reader = Reader::new(path);
    let bytes = reader.bytes(path)?;
    let (file, blob) = parse::parse(&reader, &bytes)?;
    let mut buffers = Buffers::new(&file, blob);
    let one = |image: ::gltf::Image<'_>| {
        let bytes = held(&mut reader, &mut buffers, &image).unwrap_or_default();
        let picture = Encoded::of(path, &bytes);
        picture.and_then(|picture| picture.head()).map_or(0, |head| head.mapped)
    };
    Ok(file.images().map(one).collect())
}

/// The bytes of a picture of a file.
fn held(reader: &mut Reader, buffers: &mut Buffers, image: &::gltf::Image<'_>) -> Result<Vec<u8>> {
    let path = reader.path.clone();
    let fault = |what: String| Error::in_file(&path, format!("picture {}: {what}", image.index()));
    match image.source() {
        ::gltf::image::Source::View { view, .. } => {
            let bytes = buffers.view(reader, &view).map_err(|e| fault(e.to_string()))?;
            Ok(bytes.to_vec())
        }
        ::gltf::image::Source::Uri { uri, .. } => match uri.strip_prefix("data:") {
            Some(data) => buffers::base64(data).map_err(|e| fault(e.to_string())),
            None => Ok(reader.sibling(&buffers::decoded(uri))?.1),
        },
    }
}

struct Builder<'a> {
    reader: &'a mut Reader,
    buffers: Buffers,
    material_names: Vec<String>,
    /// By material, the texture coordinates that its pictures lie by.
    uv_sets: Vec<u32>,
    /// By material, whether it has pictures.
    is_mapped: Vec<bool>,
}

impl Builder<'_> {
    fn material(&mut self, file: &::gltf::Document, material: &::gltf::Material<'_>) -> Material {
        let pbr = material.pbr_metallic_roughness();
        let [r, g, b, alpha] = pbr.base_color_factor();
        let mut maps = std::collections::BTreeMap::new();
        let mut uv_set: Option<u32> = None;
        let mut map = |what: &str,
                       texture: usize,
                       of_uv: u32,
                       others: Option<&serde_json::Map<String, serde_json::Value>>,
                       strength: f32| {
            // The format allows textures without a picture.
            if !parse::has_picture(file, texture) {
                return;
            }
            let wrap = parse::wrap(file, texture);
            let (mapping, of_uv, fault) = parse::placing(others, of_uv, wrap);
            fault.into_iter().for_each(|what| self.reader.note(what));
            let taken = *uv_set.get_or_insert(of_uv);
            if of_uv != taken {
                self.reader.note(format!(
                    "the {what} of a material lies by texture coordinates {of_uv}: it is taken by {taken}, as its \
                     other pictures are"
                ));
            }
            let Some(texture) = file.textures().nth(texture) else { return };
            let picture = match texture.source().source() {
                ::gltf::image::Source::Uri { uri, .. } if !uri.starts_with("data:") => {
                    Picture::Raw(buffers::decoded(uri))
                }
                _ => {
                    let name = self.reader.path.file_name().unwrap_or_default();
                    let index = texture.source().index() as u32;
                    Picture::Embedded(name.to_string_lossy().into_owned(), index)
                }
            };
            maps.insert(what.to_owned(), Map { picture, strength, mapping });
        };
        let json = material.index().and_then(|index| file.as_json().materials.get(index));
        if let Some(json) = json {
            let pbr = &json.pbr_metallic_roughness;
            let infos = [
                ("color", &pbr.base_color_texture),
                ("metallic_roughness", &pbr.metallic_roughness_texture),
                ("emission", &json.emissive_texture),
            ];
            for (what, info) in infos {
                if let Some(info) = info {
                    let others = info.extensions.as_ref().map(|known| &known.others);
                    map(what, info.index.value(), info.tex_coord, others, 1.0);
                }
            }
            if let Some(info) = &json.normal_texture {
                let others = info.extensions.as_ref().map(|known| &known.others);
                map("normal", info.index.value(), info.tex_coord, others, info.scale);
            }
            if let Some(info) = &json.occlusion_texture {
                let others = info.extensions.as_ref().map(|known| &known.others);
                map("occlusion", info.index.value(), info.tex_coord, others, info.strength.0);
            }
        }
        self.is_mapped.push(uv_set.is_some());
        self.uv_sets.push(uv_set.unwrap_or(0));
        let [glow_r, glow_g, glow_b] = material.emissive_factor();
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
            finish: Finish {
                gloss: Gloss::Microfacets {
                    reflectance: 0.04,
                    roughness: pbr.roughness_factor().clamp(0.0, 1.0),
                    metal: pbr.metallic_factor().clamp(0.0, 1.0),
                },
                glow: Color::new(glow_r, glow_g, glow_b),
                ..Finish::default()
            },
            one_sided: !material.double_sided(),
            casts: true,
            domains: None,
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
        let uv_set = primitive.material().index().map_or(0, |index| self.uv_sets[index]);
        // The number of points, and whether there is data for them: without, they are zeros.
        let mut positions = None;
        for (semantic, accessor) in primitive.attributes() {
            let float = [DataType::F32];
            let share = [DataType::F32, DataType::U8, DataType::U16];
            match semantic {
                Semantic::Positions => {
                    self.buffers.check(self.reader, &accessor, &[Dimensions::Vec3], &float)?;
                    let has_data = accessor.view().is_some() || accessor.sparse().is_some();
                    positions = Some((accessor.count(), has_data));
                }
                Semantic::Normals => {
                    self.buffers.check(self.reader, &accessor, &[Dimensions::Vec3], &float)?
                }
                Semantic::TexCoords(set) if set == uv_set => {
                    self.buffers.check(self.reader, &accessor, &[Dimensions::Vec2], &share)?
                }
                Semantic::Colors(0) => {
                    self.buffers.check(
                        self.reader,
                        &accessor,
                        &[Dimensions::Vec3, Dimensions::Vec4],
                        &share,
                    )?;
                }
                _ => {}
            }
        }
        let Some((count, has_data)) = positions else {
            // Valid, but nothing to see.
            self.reader.note(format!("{what} has no positions: it is left out"));
            return Ok(Mesh::default());
        };
        if let Some(accessor) = primitive.indices() {
            let whole = [DataType::U8, DataType::U16, DataType::U32];
            self.buffers.check(self.reader, &accessor, &[Dimensions::Scalar], &whole)?;
        }
        let buffers = &self.buffers;
        let data = primitive.reader(|buffer| buffers.get(buffer.index()));
        if has_data {
            let points =
                data.read_positions().ok_or_else(|| Error::invalid("positions cannot be read"))?;
            mesh.points = points.map(|p| DVec3::from(p.map(f64::from))).collect();
        } else {
            mesh.points = vec![DVec3::ZERO; count.min(1 << 20)];
        }
        if let Some(normals) = data.read_normals() {
            mesh.normals = normals.map(|n| Vec3::from(n).normalize_or_zero()).collect();
        }
        let is_mapped = primitive.material().index().is_some_and(|index| self.is_mapped[index]);
        if is_mapped && primitive.get(&Semantic::TexCoords(uv_set)).is_none() {
            self.reader.note(format!(
                "{what} has no texture coordinates {uv_set}, by which its pictures lie: they lie by x and y"
            ));
        }
        if let Some(uvs) = data.read_tex_coords(uv_set) {
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
            ::gltf::scene::Transform::Matrix { matrix } => DAffine3::from_mat4(
                DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from))),
            ),
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
        let mut object =
            Object { transform: Transform::from_matrix(local), ..Object::new(name, shape) };
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
