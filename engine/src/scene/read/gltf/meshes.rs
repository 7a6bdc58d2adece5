//! Meshes: the vertices that their triangles use, morphed by weights and, if a skin is posed, moved by its joints.
//!
//! Morph targets move positions, normals, texture coordinates and colours. Joints move positions by the mean of their
//! matrices, and normals by the inverse transposed of this mean.

use ::gltf::json::accessor::{ComponentType, Type};
use ::gltf::json::mesh::{Mode, Primitive, Semantic};
use ::gltf::json::validation::Checked;
use glam::{DAffine3, DMat3, DVec3, Vec2};

use super::super::super::mesh::Mesh;
use super::Builder;
use super::extensions;
use super::parse::File;
use super::values::{Kind, Values};
use super::within;
use crate::error::{Error, Result};

const FLOAT: &[ComponentType] = &[ComponentType::F32];
const SHARES: &[ComponentType] = &[ComponentType::F32, ComponentType::U8, ComponentType::U16];
const WHOLE: &[ComponentType] = &[ComponentType::U8, ComponentType::U16, ComponentType::U32];
/// What `KHR_mesh_quantization` allows beside, of positions and texture coordinates.
const SMALL: &[ComponentType] = &[
    ComponentType::F32,
    ComponentType::I8,
    ComponentType::U8,
    ComponentType::I16,
    ComponentType::U16,
];

/// A skin in the pose of the scene's nodes.
pub(super) struct Pose {
    /// From the space of the mesh to the world, by joint.
    pub(super) joints: Vec<DAffine3>,
}

/// A primitive, and where it is in the file.
pub(super) struct Part<'a> {
    pub(super) primitive: &'a Primitive,
    pub(super) mesh: usize,
    pub(super) number: usize,
    /// The weights of its morph targets.
    pub(super) weights: &'a [f64],
}

impl Part<'_> {
    /// The accessor that an attribute has in a morph target, which the library knows for some attributes only.
    fn target(&self, file: &File, target: usize, semantic: &Semantic) -> Option<usize> {
        let Part { mesh, number, .. } = self;
        let target =
            file.json.pointer(&format!("/meshes/{mesh}/primitives/{number}/targets/{target}"))?;
        target.get(semantic.to_string())?.as_u64().map(|accessor| accessor as usize)
    }
}

impl Builder<'_> {
    /// A primitive's triangles.
    pub(super) fn primitive(
        &mut self,
        part: &Part<'_>,
        what: &str,
        pose: Option<&Pose>,
    ) -> Result<Mesh> {
        let primitive = part.primitive;
        let Checked::Valid(mode) = primitive.mode else { return Ok(Mesh::default()) };
        if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            self.reader.note(format!("{what} is points or lines: it is left out"));
            return Ok(Mesh::default());
        }
        let material = self.material(primitive.material.map(|index| index.value()));
        let Some(positions) = self.attribute(primitive, Semantic::Positions)? else {
            // Valid, but nothing to see.
            self.reader.note(format!("{what} has no positions: it is left out"));
            return Ok(Mesh::default());
        };
        let indices = primitive.indices.map(|index| {
            let kind = Kind { shapes: &[Type::Scalar], components: WHOLE };
            self.values(index.value(), &kind)
        });
        let indices = indices.transpose()?;
        if !positions.has_data() || indices.as_ref().is_some_and(|indices| !indices.has_data()) {
            if self.is_compressed(primitive) {
                let name = "KHR_draco_mesh_compression";
                return Err(Error::invalid(format!(
                    "its data is there by {name} only, which is not read: {}",
                    extensions::cure(name)
                )));
            }
            // What is wrong with its indices is wrong all the same.
            if let Some(indices) = indices.filter(Values::has_data) {
                self.corners(&positions, Some(&indices))?;
            }
            self.reader.note(format!("{what} has no data: all its points are one, it is left out"));
            return Ok(Mesh::default());
        }
        // 1. Vertices that are used. 2. Morph targets. 3. The skin, which the specification applies
        // to what is morphed. 4. Normals of length 1, which neither keeps.
        let (corners, used) = self.corners(&positions, indices.as_ref())?;
        let points = used.iter().map(|i| DVec3::from(positions.floats(*i as usize))).collect();
        let mut mesh = Mesh { points, ..Mesh::default() };
        let mut normals: Vec<DVec3> = match self.attribute(primitive, Semantic::Normals)? {
            Some(normals) if normals.has_data() => {
                used.iter().map(|i| DVec3::from(normals.floats(*i as usize))).collect()
            }
            _ => Vec::new(),
        };
        let vertices = (&used[..], positions.count);
        self.morph(part, Semantic::Positions, vertices, &mut mesh.points, |point, by, weight| {
            *point += DVec3::from(by) * weight;
        })?;
        self.morph(part, Semantic::Normals, vertices, &mut normals, |normal, by, weight| {
            *normal += DVec3::from(by) * weight;
        })?;
        if let Some(pose) = pose {
            self.pose(primitive, pose, &used, &mut mesh.points, &mut normals)?;
        }
        mesh.normals = normals.iter().map(|n| n.normalize_or_zero().as_vec3()).collect();
        if let Some(set) = material.uv_set
            && !primitive.attributes.contains_key(&Checked::Valid(Semantic::TexCoords(set)))
        {
            self.reader.note(format!(
                "{what} has no texture coordinates {set}, by which its pictures lie: they lie by x and y"
            ));
        }
        // A mesh keeps one set: the one that its pictures lie by.
        let set = Semantic::TexCoords(material.uv_set.unwrap_or(0));
        if let Some(uvs) = self.attribute(primitive, set.clone())? {
            let mut uvs: Vec<[f64; 2]> = used.iter().map(|i| uvs.floats(*i as usize)).collect();
            self.morph(part, set, vertices, &mut uvs, add)?;
            // glTF measures v downwards.
            mesh.uvs = uvs.iter().map(|[u, v]| Vec2::new(*u as f32, 1.0 - *v as f32)).collect();
        }
        let set = Semantic::Colors(0);
        if let Some(colors) = self.attribute(primitive, set.clone())? {
            let has_alpha = colors.components == 4;
            let mut colors: Vec<[f64; 4]> =
                used.iter().map(|i| colors.floats(*i as usize)).collect();
            if self.morph(part, set, vertices, &mut colors, add)? {
                colors.iter_mut().flatten().for_each(|share| *share = share.clamp(0.0, 1.0));
            }
            let color = |color: &[f64; 4]| {
                let [r, g, b, a] = color.map(|share| share as f32);
                [r, g, b, if has_alpha { a } else { 1.0 }]
            };
            mesh.colors = colors.iter().map(color).collect();
        }
        mesh.validate()?;
        let front = Some(mesh.material(&material.name));
        for at in 0..triangle_count(mode, corners.len()) {
            let triangle = match mode {
                // Every second triangle of a strip is turned, so that all face one way.
                Mode::TriangleStrip if at % 2 == 1 => [at + 1, at, at + 2],
                Mode::TriangleStrip => [at, at + 1, at + 2],
                Mode::TriangleFan => [0, at + 1, at + 2],
                _ => [3 * at, 3 * at + 1, 3 * at + 2],
            };
            mesh.add_polygon(&triangle.map(|i| corners[i]), front)?;
        }
        Ok(mesh)
    }

    fn is_compressed(&self, primitive: &Primitive) -> bool {
        let name = "KHR_draco_mesh_compression";
        self.file.declares(name)
            && primitive.attributes.values().any(|index| {
                self.file.root.accessors.get(index.value()).is_some_and(|a| a.buffer_view.is_none())
            })
    }

    /// The values of an attribute; `None` if the primitive has it not.
    fn attribute(&mut self, primitive: &Primitive, semantic: Semantic) -> Result<Option<Values>> {
        let kind = self.kind(&semantic);
        let index = primitive.attributes.get(&Checked::Valid(semantic));
        index.map(|index| self.values(index.value(), &kind)).transpose()
    }

    /// What an attribute may be.
    fn kind(&self, semantic: &Semantic) -> Kind<'static> {
        let is_small = self.file.declares("KHR_mesh_quantization");
        let or_small = |components| if is_small { SMALL } else { components };
        let (shapes, components): (&[Type], _) = match semantic {
            Semantic::Positions | Semantic::Normals => (&[Type::Vec3], or_small(FLOAT)),
            Semantic::TexCoords(_) => (&[Type::Vec2], or_small(SHARES)),
            Semantic::Colors(_) => (&[Type::Vec3, Type::Vec4], SHARES),
            Semantic::Joints(_) => (&[Type::Vec4], WHOLE),
            Semantic::Tangents | Semantic::Weights(_) => (&[Type::Vec4], SHARES),
        };
        Kind { shapes, components }
    }

    /// The corners of triangles, and the vertices that they use by their numbers in the file: primitives often
    /// share one list of vertices, of which each uses a few.
    fn corners(
        &mut self,
        positions: &Values,
        indices: Option<&Values>,
    ) -> Result<(Vec<u32>, Vec<u32>)> {
        let count = positions.count;
        let corners = indices.map_or(count, |indices| indices.count);
        if count > u32::MAX as usize || corners > u32::MAX as usize {
            return Err(Error::invalid("more than 2^32 vertices"));
        }
        self.buffers.take(corners as u64)?;
        let Some(indices) = indices else {
            let all: Vec<u32> = (0..count as u32).collect();
            return Ok((all.clone(), all));
        };
        let mut corners: Vec<u32> = (0..indices.count).map(|i| indices.wholes::<1>(i)[0]).collect();
        if let Some(wrong) = corners.iter().find(|corner| **corner as usize >= count) {
            return Err(Error::invalid(format!(
                "its indices name vertex {wrong}, and it has {count} vertices"
            )));
        }
        // Nearly all are used then, and sorting would cost more than it saves.
        if corners.len() >= count {
            return Ok((corners, (0..count as u32).collect()));
        }
        let mut used = corners.clone();
        used.sort_unstable();
        used.dedup();
        for corner in &mut corners {
            *corner = used.partition_point(|vertex| vertex < corner) as u32;
        }
        Ok((corners, used))
    }

    /// Moves what vertices have towards morph targets; returns whether a target moves it.
    fn morph<T, const N: usize>(
        &mut self,
        part: &Part<'_>,
        semantic: Semantic,
        (used, count): (&[u32], usize),
        places: &mut [T],
        add: impl Fn(&mut T, [f64; N], f64),
    ) -> Result<bool> {
        let kind = match &semantic {
            Semantic::TexCoords(_) => Kind { shapes: &[Type::Vec2], components: SMALL },
            Semantic::Colors(_) => Kind { shapes: &[Type::Vec3, Type::Vec4], components: SMALL },
            semantic => self.kind(semantic),
        };
        let mut is_moved = false;
        let targets = part.primitive.targets.as_ref().map_or(0, Vec::len);
        let weights = part.weights.iter().enumerate().take(targets);
        for (at, weight) in weights.filter(|(_, weight)| **weight != 0.0) {
            let Some(index) = part.target(self.file, at, &semantic) else { continue };
            let moves = self.values(index, &kind);
            let moves = moves.map_err(|e| within(&format!("morph target {at}"), e))?;
            if moves.count != count {
                let moves = moves.count;
                return Err(Error::invalid(format!(
                    "morph target {at}: accessor {index} has {moves} values for {count} vertices"
                )));
            }
            self.buffers.take(used.len() as u64)?;
            for (place, vertex) in places.iter_mut().zip(used) {
                add(place, moves.floats(*vertex as usize), *weight);
            }
            is_moved = true;
        }
        Ok(is_moved)
    }

    /// Moves vertices as the joints of a skin stand.
    fn pose(
        &mut self,
        primitive: &Primitive,
        pose: &Pose,
        used: &[u32],
        points: &mut [DVec3],
        normals: &mut [DVec3],
    ) -> Result<()> {
        let mut sets = Vec::new();
        while let (Some(joints), Some(weights)) = {
            let set = sets.len() as u32;
            let joints = self.attribute(primitive, Semantic::Joints(set))?;
            (joints, self.attribute(primitive, Semantic::Weights(set))?)
        } {
            sets.push((joints, weights));
            self.buffers.take(used.len() as u64)?;
        }
        if sets.is_empty() {
            return Err(Error::invalid("a skin moves it, and it has no JOINTS_0 and WEIGHTS_0"));
        }
        for (at, vertex) in used.iter().enumerate() {
            let mut parts = Vec::new();
            for (joints, weights) in &sets {
                let weights: [f64; 4] = weights.floats(*vertex as usize);
                parts.extend(joints.wholes::<4>(*vertex as usize).into_iter().zip(weights));
            }
            let sum: f64 = parts.iter().map(|(_, weight)| weight).sum();
            // Where nothing is said the first joint moves all.
            let shares: Vec<(u32, f64)> = if sum > 0.0 {
                parts.iter().filter(|(_, w)| *w != 0.0).map(|(j, w)| (*j, w / sum)).collect()
            } else {
                vec![(parts[0].0, 1.0)]
            };
            // Linear blending: the mean of the joints' matrices, by weight.
            let mut matrix = DMat3::ZERO;
            let mut moved = DVec3::ZERO;
            for (joint, share) in shares {
                let joint = pose.joints.get(joint as usize).ok_or_else(|| {
                    let count = pose.joints.len();
                    Error::invalid(format!(
                        "vertex {vertex} hangs on joint {joint}, and its skin has {count}"
                    ))
                })?;
                matrix += joint.matrix3 * share;
                moved += joint.translation * share;
            }
            points[at] = matrix * points[at] + moved;
            if let Some(normal) = normals.get_mut(at) {
                *normal = turned(&matrix, *normal);
            }
        }
        Ok(())
    }
}

fn add<const N: usize>(to: &mut [f64; N], by: [f64; N], weight: f64) {
    to.iter_mut().zip(by).for_each(|(to, by)| *to += by * weight);
}

/// A normal where a surface was moved: by the inverse transposed, which its cofactors are but for a factor.
fn turned(matrix: &DMat3, normal: DVec3) -> DVec3 {
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = *matrix;
    let side = if matrix.determinant() < 0.0 { -1.0 } else { 1.0 };
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * normal * side
}

fn triangle_count(mode: Mode, corners: usize) -> usize {
    match mode {
        Mode::Triangles => corners / 3,
        _ => corners.saturating_sub(2),
    }
}
