//! What a scene knows of its faces: the colours and normals of fragments.

use glam::{DAffine3, DMat3, DVec2, DVec3, Vec3};
use std::any::Any;
use std::sync::{Arc, OnceLock};

mod alike;
mod pictures;
mod rays;

use super::absent::WITHOUT_PICTURES;
use super::divide::ReadyDomains;
use super::face::{Back, Sides};
use super::flat::{Instance, Scene};
use super::geometry::{Frame, Part};
use super::maps::{Appearance, At, Maps, Sizes};
use super::material::{AlphaMode, Material};
use super::mesh::Mesh;
use crate::color::Color;
use crate::error::{Error, Result};
use crate::fragment::{
    Alike, Columns, Environment, FacePart, Finish, Fragments, Local, Origin, PictureSet, Pictured,
    Provenance, RayTarget, Surfaces, Uv,
};
use crate::key::Key;
use crate::texture::Opened;
use crate::trace::Casters;

/// A scene as the surfaces of a source.
#[derive(Debug)]
pub struct SceneSurfaces {
    scene: Arc<Scene>,
    /// Of each instance: from the world to the object, and how normals turn to the world.
    places: Vec<(DAffine3, DMat3)>,
    /// By material, the pictures on it.
    maps: Vec<Option<Maps>>,
    /// By material, the domains that it is divided into.
    domains: Vec<Option<ReadyDomains>>,
    /// The sets of its pictures, once somebody asked.
    picture_sets: OnceLock<Vec<PictureSet>>,
    /// Its faces in the world, once somebody asked.
    casters: OnceLock<Casters>,
}

/// What all fragments of a part have in common.
struct CommonLook<'s> {
    instance: &'s Instance,
    place: &'s (DAffine3, DMat3),
    /// Material colour, or the edge's.
    color: Color,
    alpha: f32,
    /// Whether vertex alpha counts.
    blends: bool,
    unlit: bool,
    finish: Finish,
    /// The number of its material if there are pictures on it, and the pictures.
    maps: Option<(u32, &'s Maps)>,
    /// The unit normal of the front in the object's axes.
    front: DVec3,
    /// The unit normal of the front in world axes.
    normal: DVec3,
    /// Present where a vertex attribute is interpolated.
    frame: Option<Frame>,
}

impl SceneSurfaces {
    /// The surfaces of a scene.
    pub fn new(scene: Arc<Scene>) -> SceneSurfaces {
        let place = |instance: &Instance| {
            let world = &instance.world_from_object;
            (world.inverse(), normal_matrix(&world.matrix3))
        };
        let places = scene.instances.iter().map(place).collect();
        let maps =
            scene.materials.iter().map(|material| Maps::of(material, &scene.reader)).collect();
        let ready = |material: &Material| material.domains.as_ref().map(ReadyDomains::new);
        let domains = scene.materials.iter().map(ready).collect();
        let (picture_sets, casters) = (OnceLock::new(), OnceLock::new());
        SceneSurfaces { scene, places, maps, domains, picture_sets, casters }
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The number of the material of a part of a face, if it is no edge.
    fn material_of(&self, ordinal: u32, sees_front: bool) -> Option<u32> {
        let (at, face, part) = self.scene.part(ordinal);
        let instance = &self.scene.instances[at];
        let is_edge = matches!(part, Part::FaceEdges | Part::SealEdges(_));
        let sides = sides_of(instance.geometry.mesh(), face, part);
        (!is_edge).then(|| instance.material_of(sides, sees_front))
    }

    /// The domains that a part of a face is divided into.
    fn domains_of(&self, ordinal: u32, sees_front: bool) -> Option<(u32, &ReadyDomains)> {
        let number = self.material_of(ordinal, sees_front)?;
        self.domains[number as usize].as_ref().map(|ready| (number, ready))
    }

    /// The pictures of a material and its bundles.
    fn pictures_of(&self, number: u32, sizes: &mut Sizes<'_>) -> Vec<(Key, u64)> {
        let domains = self.domains[number as usize].as_ref();
        let bundles = domains.into_iter().flat_map(|ready| ready.domains.bundles());
        let numbers = std::iter::once(number).chain(bundles);
        let maps = numbers.filter_map(|number| self.maps[number as usize].as_ref());
        let mut pictures: Vec<(Key, u64)> = maps.flat_map(|maps| maps.pictures(sizes)).collect();
        pictures.extend(domains.into_iter().flat_map(|ready| ready.pictures(sizes)));
        pictures
    }

    /// What all fragments of a part have in common; `wants_uv` if its texture coordinates are asked for.
    fn look(
        &self,
        (ordinal, sees_front): (u32, bool),
        bundle: Option<u32>,
        wants_uv: bool,
    ) -> CommonLook<'_> {
        let (at, face, part) = self.scene.part(ordinal);
        let instance = &self.scene.instances[at];
        let mesh = instance.geometry.mesh();
        let sides = sides_of(mesh, face, part);
        let edge = match part {
            Part::FaceEdges => mesh.edge(face),
            Part::SealEdges(i) => mesh.seals(face)[i as usize].edge,
            _ => None,
        };
        let number = instance.material_of(sides, sees_front);
        let is_divided = self.domains[number as usize].is_some();
        let number = bundle.unwrap_or(number);
        let material = &self.scene.materials[number as usize];
        // A drawn edge is ink: no picture, no light.
        let maps = self.maps[number as usize].as_ref().filter(|_| edge.is_none());
        let maps = maps.map(|maps| (number, maps));
        let (color, alpha, unlit) = match edge {
            Some(edge) => (edge.color, 1.0, true),
            None => (material.color, material.opacity(), material.unlit),
        };
        let blends = edge.is_none() && material.alpha_mode == AlphaMode::Blend;
        let place = &self.places[at];
        let front = instance.geometry.normal(face);
        let carries = !(mesh.colors.is_empty() && mesh.normals.is_empty())
            || ((maps.is_some() || is_divided || wants_uv) && !mesh.uvs.is_empty());
        let interpolates = edge.is_none() && carries;
        let frame = interpolates.then(|| Frame::new(mesh, mesh.outline(face), front));
        let normal = (place.1 * front).normalize_or_zero();
        let finish = material.finish;
        CommonLook {
            instance,
            place,
            color,
            alpha,
            blends,
            unlit,
            finish,
            maps,
            front,
            normal,
            frame,
        }
    }
}

/// The materials of a part of a face.
fn sides_of(mesh: &Mesh, face: usize, part: Part) -> Sides {
    match part {
        Part::Face | Part::FaceEdges => mesh.sides(face),
        Part::Seal(i) | Part::SealEdges(i) => mesh.seals(face)[i as usize].sides,
    }
}

/// The number of a material that is divided and its domains, if it is, and what its fragments have in common.
type MaterialLook<'s> = (Option<(u32, &'s ReadyDomains)>, CommonLook<'s>);

impl CommonLook<'_> {
    /// What is seen at a point, without pictures.
    fn at(&self, world: DVec3) -> Appearance {
        let (mut color, mut alpha, mut normal) = (self.color, self.alpha, self.normal);
        if let Some(frame) = &self.frame {
            let mesh = self.instance.geometry.mesh();
            let weights = frame.weights(self.place.0.transform_point3(world));
            let corners = frame.corners.map(|corner| corner as usize);
            if !mesh.colors.is_empty() {
                let mixed = |i: usize| {
                    let values = corners.iter().zip(weights).map(|(c, w)| mesh.colors[*c][i] * w);
                    values.sum::<f32>()
                };
                color = color * Color::new(mixed(0), mixed(1), mixed(2));
                if self.blends {
                    alpha = (alpha * mixed(3)).clamp(0.0, 1.0);
                }
            }
            if !mesh.normals.is_empty() {
                let mixed: Vec3 =
                    corners.iter().zip(weights).map(|(c, w)| mesh.normals[*c] * w).sum();
                // Normals that cancel each other, or are 0 in the file, leave the face's own.
                normal = (self.place.1 * mixed.as_dvec3()).try_normalize().unwrap_or(self.normal);
            }
        }
        Appearance { color, alpha, normal, finish: self.finish }
    }

    /// The texture coordinates at a point of the object.
    fn uv(&self, point: DVec3) -> DVec2 {
        let mesh = self.instance.geometry.mesh();
        match &self.frame {
            Some(frame) if !mesh.uvs.is_empty() => {
                let corners = frame.corners.map(|corner| mesh.uvs[corner as usize].as_dvec2());
                let [a, b, c] = frame.exact_weights(point);
                corners[0] * a + corners[1] * b + corners[2] * c
            }
            // Without any, a picture lies as seen along the z axis.
            _ => DVec2::new(point.x, point.y),
        }
    }
}

impl Surfaces for SceneSurfaces {
    fn fill(&self, wanted: Columns, fragments: &mut Fragments<'_>) {
        let (colors, normals) = (wanted.contains(Columns::COLOR), wanted.contains(Columns::NORMAL));
        let (facing, finish) = (wanted.contains(Columns::FACING), wanted.contains(Columns::FINISH));
        let (local, uv) = (wanted.contains(Columns::LOCAL), wanted.contains(Columns::UV));
        if !(colors || normals || facing || finish || local || uv) {
            return;
        }
        let mut last: Option<((u32, Option<u32>), CommonLook<'_>)> = None;
        let mut opened: Vec<(u32, Vec<Option<Opened<'_>>>)> = Vec::new();
        for i in 0..fragments.len() {
            let (ordinal, sees_front) = (fragments.ordinal[i], fragments.sees_front[i]);
            let bundle = fragments.bundle.get(i).copied().flatten();
            // Fragments of one face stand together, so the last look mostly holds.
            let (_, look) = match last.take().filter(|(known, _)| *known == (ordinal, bundle)) {
                Some(known) => last.insert(known),
                None => {
                    last.insert(((ordinal, bundle), self.look((ordinal, sees_front), bundle, uv)))
                }
            };
            // A plain face looks the same everywhere: its points in the world need not be computed.
            let is_alike = look.frame.is_none() && look.maps.is_none() && !local && !uv;
            let world = if is_alike { DVec3::ZERO } else { fragments.point(i) };
            if local || uv {
                let point = look.place.0.transform_point3(world);
                // The mean of the three axes, where they are stretched differently.
                let scale = look.place.0.matrix3.determinant().abs().cbrt();
                if local {
                    fragments.local.push(Local { point, scale });
                }
                if uv {
                    let at = look.uv(point);
                    let step = look.front.any_orthonormal_vector();
                    let across = look.front.cross(step);
                    let [a, b] = [step, across].map(|step| look.uv(point + step) - at);
                    fragments.uv.push(Uv { at, scale: scale * a.perp_dot(b).abs().sqrt() });
                }
            }
            if facing {
                fragments.facing.push(if sees_front { look.normal } else { -look.normal });
            }
            let mut seen = look.at(world);
            let shown = fragments.shown.get(i).copied().flatten();
            if let Some(shown) = &shown {
                // What was read ahead for a whole set of pictures is not read again.
                (seen.color, seen.alpha) = (shown.color, shown.alpha);
                seen.finish = shown.finish.unwrap_or(seen.finish);
            } else if let Some((number, maps)) = look.maps {
                let known = opened.iter().position(|(known, _)| *known == number);
                let at = known.unwrap_or_else(|| {
                    opened.push((number, maps.open()));
                    opened.len() - 1
                });
                let place = At {
                    object_from_world: &look.place.0,
                    point: world,
                    steps: fragments.footprint(i, world, look.normal),
                    facing: look.normal,
                    front: look.front,
                    uv: &|point| look.uv(point),
                    seen_from: &|moved| {
                        let point = world + moved;
                        (look.at(point).normal, fragments.to_eye_from(i, point))
                    },
                    sees_front,
                    filter: fragments.textures,
                };
                maps.apply(&opened[at].1, wanted, &place, &mut seen);
            }
            if finish {
                fragments.finish.push(seen.finish);
            }
            if colors {
                fragments.color.push(seen.color);
                fragments.alpha.push(seen.alpha);
                fragments.unlit.push(look.unlit);
            }
            if normals {
                let normal = if sees_front { seen.normal } else { -seen.normal };
                let known = shown.and_then(|shown| shown.normal);
                fragments.normal.push(known.unwrap_or(normal.as_vec3()));
            }
        }
    }

    fn varying(&self, ordinal: u32) -> Columns {
        let (at, face, part) = self.scene.part(ordinal);
        let instance = &self.scene.instances[at];
        if matches!(part, Part::FaceEdges | Part::SealEdges(_)) {
            return Columns::NONE;
        }
        let mesh = instance.geometry.mesh();
        let outline = mesh.outline(face);
        let first = outline[0] as usize;
        let differs = |same: &dyn Fn(usize) -> bool| outline.iter().any(|c| !same(*c as usize));
        let mut varying = Columns::NONE;
        let sides = match part {
            Part::Seal(i) => mesh.seals(face)[i as usize].sides,
            _ => mesh.sides(face),
        };
        let shines = |front| {
            let material = instance.material_of(sides, front) as usize;
            self.scene.materials[material].finish.shines()
        };
        // Either side may be seen, and the answer must hold for both.
        if shines(true) || shines(false) {
            varying = varying | Columns::FINISH;
        }
        let is_traced = |front| {
            let material = instance.material_of(sides, front) as usize;
            self.scene.materials[material].finish.optics.is_some()
        };
        if is_traced(true) || is_traced(false) {
            varying = varying | Columns::TRACED;
        }
        for front in [true, false] {
            let number = instance.material_of(sides, front) as usize;
            varying = varying | self.maps[number].as_ref().map_or(Columns::NONE, Maps::varying);
            let Some(ready) = &self.domains[number] else { continue };
            // Bundles differ from each other even if each is plain.
            varying = varying | Columns::COLOR | Columns::FINISH | Columns::NORMAL;
            let mut bundles = ready.domains.bundles().map(|b| &self.scene.materials[b as usize]);
            if bundles.any(|bundle| bundle.finish.optics.is_some()) {
                varying = varying | Columns::TRACED;
            }
        }
        if !mesh.colors.is_empty() && differs(&|c| mesh.colors[c] == mesh.colors[first]) {
            varying = varying | Columns::COLOR;
        }
        if !mesh.normals.is_empty() && differs(&|c| mesh.normals[c] == mesh.normals[first]) {
            varying = varying | Columns::NORMAL;
        }
        varying
    }

    fn offers(&self, wanted: Columns) -> Result<()> {
        let is_wanted = wanted.meets(Columns::COLOR | Columns::NORMAL | Columns::FINISH);
        if let Some((library, why)) = self.scene.missing.first().filter(|_| is_wanted) {
            let what = format!("{why} (a library of materials): {WITHOUT_PICTURES}");
            return Err(Error::file(library, std::io::Error::other(what)));
        }
        let named = self.maps.iter().zip(&self.scene.material_names).filter(|_| is_wanted);
        let mut maps = named.filter_map(|(maps, name)| Some((maps.as_ref()?, name)));
        maps.try_for_each(|(maps, name)| maps.offers(name))?;
        let mut domains = self.domains.iter().flatten().filter(|_| is_wanted);
        domains.try_for_each(ReadyDomains::offers)
    }

    fn fault(&self) -> Option<Error> {
        let of_domains = || self.domains.iter().flatten().find_map(ReadyDomains::fault);
        self.maps.iter().flatten().find_map(Maps::fault).or_else(of_domains)
    }

    fn object(&self, ordinal: u32) -> String {
        self.scene.instances[self.scene.part(ordinal).0].path.clone()
    }

    fn material(&self, ordinal: u32, sees_front: bool, bundle: Option<u32>) -> String {
        let (at, face, part) = self.scene.part(ordinal);
        let instance = &self.scene.instances[at];
        let sides = sides_of(instance.geometry.mesh(), face, part);
        let number = bundle.unwrap_or_else(|| instance.material_of(sides, sees_front));
        self.scene.material_names[number as usize].clone()
    }

    fn alike(&self, before: &dyn Surfaces) -> Option<Alike> {
        let before: &dyn Any = before;
        Some(alike::alike(self, before.downcast_ref()?))
    }

    fn rays(&self) -> Option<&dyn RayTarget> {
        Some(self)
    }

    fn pictures(&self) -> Option<&dyn Pictured> {
        Some(self)
    }

    fn provenance(&self) -> Option<&dyn Provenance> {
        Some(self)
    }
}

impl Provenance for SceneSurfaces {
    fn names(&self) -> Option<[Vec<String>; 2]> {
        let objects = self.scene.instances.iter().map(|instance| instance.path.clone());
        Some([objects.collect(), self.scene.material_names.clone()])
    }

    fn part(&self, ordinal: u32) -> Option<FacePart> {
        let (_, face, part) = self.scene.part(ordinal);
        let (seal, is_edge) = match part {
            Part::Face => (None, false),
            Part::FaceEdges => (None, true),
            Part::Seal(seal) => (Some(seal), false),
            Part::SealEdges(seal) => (Some(seal), true),
        };
        Some(FacePart { face: face as u32, seal, is_edge })
    }

    fn environment(&self) -> Option<&Environment> {
        self.scene.environment.as_ref()
    }

    fn origin(&self) -> Option<Origin> {
        self.scene.origin.clone()
    }
}

impl Scene {
    /// Whether a face is seen from the side that its material leaves out.
    pub fn is_culled(&self, instance: &Instance, face: usize, sees_front: bool) -> bool {
        let sides = instance.geometry.mesh().sides(face);
        let number = instance.material_of(sides, sees_front);
        // A back with a material of its own is there to be seen.
        !sees_front && sides.back == Back::Same && self.materials[number as usize].one_sided
    }

    /// The materials of what one is divided into.
    fn bundles_of(&self, material: &Material) -> impl Iterator<Item = &Material> {
        let bundles = material.domains.iter().flat_map(|domains| domains.bundles());
        bundles.map(|number| &self.materials[number as usize])
    }

    /// Whether a part of an instance's face lets through what lies behind it, from the side that is
    /// seen.
    pub fn is_translucent(
        &self,
        instance: &Instance,
        face: usize,
        part: Part,
        sees_front: bool,
    ) -> bool {
        let mesh = instance.geometry.mesh();
        let sides = match part {
            Part::Face => mesh.sides(face),
            Part::Seal(i) => mesh.seals(face)[i as usize].sides,
            Part::FaceEdges | Part::SealEdges(_) => return false,
        };
        let material = &self.materials[instance.material_of(sides, sees_front) as usize];
        if material.is_cut() || self.bundles_of(material).any(Material::lets_through) {
            return true;
        }
        if material.alpha_mode != AlphaMode::Blend {
            return false;
        }
        let vertex = |corner: &u32| mesh.colors.get(*corner as usize).is_some_and(|c| c[3] < 1.0);
        // A texture's alpha is not asked here: `is_cut` stands for it.
        material.alpha < 1.0 || mesh.outline(face).iter().any(vertex)
    }
}

impl Instance {
    /// The number of the material that the front or the back of a face or seal shows.
    pub fn material_of(&self, sides: Sides, front: bool) -> u32 {
        let index = match (front, sides.back) {
            (false, Back::Material(index)) => Some(index),
            _ => sides.front,
        };
        index.and_then(|i| self.palette.get(i as usize).copied()).unwrap_or(self.material)
    }
}

/// The matrix that turns normals as a matrix turns surfaces: its cofactors, signed so that a mirrored
/// object's fronts stay fronts.
pub fn normal_matrix(matrix: &DMat3) -> DMat3 {
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = *matrix;
    // They are the inverse transposed times the determinant. Unlike the inverse, they exist for
    // flattened objects too.
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    if matrix.determinant() < 0.0 { cofactors * -1.0 } else { cofactors }
}
