//! The faces of a scene for rays and shadows.

use glam::DVec3;

use super::{SceneSurfaces, normal_matrix};
use crate::fragment::RayTarget;
use crate::polygon;
use crate::scene::flat::{Instance, Scene};
use crate::scene::geometry::{Part, Support};
use crate::scene::material::{AlphaMode, Material};
use crate::trace::{Casters, CastersBuilder};

impl RayTarget for SceneSurfaces {
    fn casters(&self) -> &Casters {
        self.casters.get_or_init(|| self.scene.casters())
    }

    fn transmits(&self, ordinal: u32) -> bool {
        let mut sides = [true, false].into_iter().filter_map(|front| {
            let material = self.material_of(ordinal, front)?;
            Some(&self.scene.materials[material as usize])
        });
        sides.any(|of| {
            std::iter::once(of).chain(self.scene.bundles_of(of)).any(|m| m.finish.transmits())
        })
    }

    fn met(&self, face: u32, sees_front: bool, point: DVec3) -> Option<u32> {
        let (at, face_of_mesh, _) = self.scene.part(face);
        let instance = &self.scene.instances[at];
        if self.scene.is_culled(instance, face_of_mesh, sees_front) {
            return None;
        }
        let mesh = instance.geometry.mesh();
        if !instance.shows_seals || mesh.seals(face_of_mesh).is_empty() {
            return Some(face);
        }
        let point = self.places[at].0.transform_point3(point);
        let normal = instance.geometry.normal(face_of_mesh);
        let mut found = face;
        // Later seals lie over earlier ones: the last that contains the point is seen.
        for (number, part) in (face..).zip(instance.geometry.parts_of(face_of_mesh)) {
            if let Part::Seal(i) = part {
                let outline = &mesh.seals(face_of_mesh)[i as usize].outline;
                let corners = outline.iter().map(|corner| mesh.points[*corner as usize]);
                if polygon::contains(corners, normal, point) {
                    found = number;
                }
            }
        }
        Some(found)
    }
}

impl Scene {
    /// All faces as they stand in the world. Seals and drawn edges, which lie on faces, are left out.
    fn casters(&self) -> Casters {
        let mut builder = CastersBuilder::default();
        for instance in &self.instances {
            let geometry = &*instance.geometry;
            let mesh = geometry.mesh();
            let world = &instance.world_from_object;
            let base = builder.points(mesh.points.iter().map(|p| world.transform_point3(*p)));
            let opacities: Vec<f32> =
                (0..mesh.face_count()).map(|face| self.opacity(instance, face)).collect();
            // Only what is closed and opaque everywhere lets no light in, so that rays may be
            // spared.
            let is_opaque = opacities.iter().all(|opacity| *opacity == 1.0);
            let body = match geometry.body() {
                turns if is_opaque && turns != 0 => {
                    let points = mesh.points.iter().map(|p| world.transform_point3(*p));
                    let low = points.clone().fold(DVec3::INFINITY, DVec3::min);
                    let number = builder.body(low, points.fold(DVec3::NEG_INFINITY, DVec3::max));
                    let is_mirrored = world.matrix3.determinant() < 0.0;
                    // A mirrored place turns the inside out.
                    if is_mirrored == (turns > 0) { -number } else { number }
                }
                _ => 0,
            };
            let turned = normal_matrix(&world.matrix3);
            for (face, opacity) in opacities.into_iter().enumerate() {
                // Shadows and the picture must agree on where such a face lies: on the plane that
                // is drawn.
                let plane = geometry.left_plane(face).map(|Support { normal, point }| {
                    let normal = (turned * normal).normalize_or_zero();
                    builder.plane(normal, world.transform_point3(point))
                });
                let number = instance.first_ordinal + geometry.first_part(face);
                geometry.pieces(face, |corners| {
                    builder.piece(
                        number,
                        opacity,
                        (body, plane),
                        corners.iter().map(|corner| base + corner),
                    );
                });
            }
        }
        builder.finish()
    }

    /// How much light a face holds back; NaN if that differs from place to place or side to side.
    fn opacity(&self, instance: &Instance, face: usize) -> f32 {
        let mesh = instance.geometry.mesh();
        let of = |front| &self.materials[instance.material_of(mesh.sides(face), front) as usize];
        let (front, back) = (of(true), of(false));
        if !front.casts {
            return 0.0;
        }
        if self.bundles_of(front).chain(self.bundles_of(back)).any(Material::lets_through) {
            return f32::NAN;
        }
        let blends = front.alpha_mode == AlphaMode::Blend || back.alpha_mode == AlphaMode::Blend;
        let alpha = |corner: &u32| mesh.colors.get(*corner as usize).map_or(1.0, |c| c[3]);
        let is_cut = front.is_cut() || back.is_cut();
        let varies =
            is_cut || blends && mesh.outline(face).iter().any(|corner| alpha(corner) != 1.0);
        match (front.opacity(), back.opacity()) {
            // Light falls on either side, and the answer must not depend on which.
            (front, back) if varies || front != back => f32::NAN,
            (opacity, _) => opacity,
        }
    }
}
