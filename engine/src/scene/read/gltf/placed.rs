//! Meshes that stand elsewhere than at their node: moved by a skin, or placed many times.

use ::gltf::json::accessor::{ComponentType, Type};
use glam::{DAffine3, DMat4, DVec3};
use serde_json::Value;

use super::super::super::document::Object;
use super::super::reader::Names;
use super::meshes::Pose;
use super::values::{Kind, Values};
use super::{Builder, nodes};
use crate::error::{Error, Result};

impl Builder<'_> {
    /// A mesh that a skin moves, in the world.
    pub(super) fn skinned(&mut self, index: usize, siblings: &mut Names) -> Result<Option<Object>> {
        let node = &self.file.root.nodes[index];
        let (Some(mesh), Some(skin)) = (node.mesh, node.skin) else { return Ok(None) };
        let skin_number = skin.value();
        let skin = &self.file.root.skins[skin_number];
        let bound = match skin.inverse_bind_matrices {
            None => None,
            Some(accessor) => {
                let kind = Kind { shapes: &[Type::Mat4], components: &[ComponentType::F32] };
                let bound = self.values(accessor.value(), &kind);
                let bound = bound.map_err(|e| self.in_file(&format!("skin {skin_number}"), e))?;
                if bound.count < skin.joints.len() {
                    let (count, joints) = (bound.count, skin.joints.len());
                    return Err(self.reader.fault(format!(
                        "skin {skin_number}: {count} inverse bind matrices for {joints} joints"
                    )));
                }
                Some(bound)
            }
        };
        let joint = |(i, node): (usize, &::gltf::json::Index<_>)| {
            let bound = bound.as_ref().map_or(DAffine3::IDENTITY, |bound| {
                DAffine3::from_mat4(DMat4::from_cols_array(&bound.floats(i)))
            });
            self.tree.worlds[node.value()] * bound
        };
        let joints = skin.joints.iter().enumerate().map(joint).collect();
        let weights = self.weights(mesh.value(), Some(index));
        let object = self.mesh(mesh.value(), &weights, Some(&Pose { joints }))?;
        let name = siblings.unique(node.name.as_deref().unwrap_or(&format!("node {index}")));
        Ok(Some(Object { name, ..object }))
    }

    /// Where `EXT_mesh_gpu_instancing` places a mesh.
    pub(super) fn places(&mut self, instancing: &Value) -> Result<Vec<DAffine3>> {
        const SHARES: [ComponentType; 3] =
            [ComponentType::F32, ComponentType::I8, ComponentType::I16];
        let mut of = |name: &str, shape: Type| -> Result<Option<Values>> {
            let accessor = instancing.get("attributes").and_then(|all| all.get(name));
            let accessor = accessor.and_then(Value::as_u64);
            let kind = Kind { shapes: &[shape], components: &SHARES };
            accessor.map(|accessor| self.values(accessor as usize, &kind)).transpose()
        };
        let moves = of("TRANSLATION", Type::Vec3)?;
        let turns = of("ROTATION", Type::Vec4)?;
        let scales = of("SCALE", Type::Vec3)?;
        let counts: Vec<usize> =
            [&moves, &turns, &scales].into_iter().flatten().map(|values| values.count).collect();
        let Some(count) = counts.first().copied() else {
            return Err(Error::invalid("it has no TRANSLATION, ROTATION or SCALE"));
        };
        if counts.iter().any(|other| *other != count) {
            return Err(Error::invalid("its attributes differ in count"));
        }
        self.buffers.take(count as u64)?;
        let place = |i: usize| {
            let at = |values: &Option<Values>, absent: f64| {
                let values = values.as_ref().map(|values| values.floats::<3>(i));
                DVec3::from(values.unwrap_or([absent; 3]))
            };
            let turn = turns.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |turns| turns.floats(i));
            nodes::parts(at(&moves, 0.0), turn, at(&scales, 1.0))
        };
        Ok((0..count).map(place).collect())
    }
}
