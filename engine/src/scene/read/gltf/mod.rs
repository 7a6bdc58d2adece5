//! glTF 2.0 and GLB. Metres, y up, right-handed, as the format has it; what materials are where a file says
//! nothing stands in [`materials`].
//!
//! The `gltf` library knows the document's structure; everything that it leaves unchecked is checked before it is
//! read: containers and JSON ([`parse`]), numbers that name what is not there ([`check`]), buffers ([`buffers`]),
//! accessors ([`values`]), nodes that are no trees ([`nodes`]). What extensions say is read where it belongs;
//! those that are not read are told ([`extensions`]).
//!
//! A file is a still, or an animation of it at a moment ([`animations`]): morph targets have the weights of the
//! animation, or else of their node, or else of their mesh; skins stand as the nodes do. Skinned meshes stand in the
//! world, directly under the root, as the place of their own node does not count. Groups in which nothing is seen, such
//! as the bones of a skin, are left away.

mod animations;
mod buffers;
mod check;
mod curves;
mod extensions;
mod lights;
mod materials;
mod meshes;
mod nodes;
mod parse;
mod placed;
mod placing;
mod values;

use animations::Movable;
use buffers::Buffers;
use glam::DAffine3;
use nodes::{Moved, Tree};
use parse::File;
use serde_json::Value;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use values::{Kind, Values};

use super::super::document::{Document, Object, Plan, Transform};
use super::super::library::ReadOptions;
use super::super::material::Material;
use super::super::shape::Shape;
use super::reader::{Names, Reader};
use crate::error::{Error, Result};
use crate::image::file::Encoded;
use crate::open;
use meshes::{Part, Pose};

pub(super) fn read(reader: &mut Reader, bytes: &[u8], options: &ReadOptions) -> Result<Document> {
    let path = reader.path.clone();
    guarded(&path, || document(reader, bytes, options))
}

/// Whether an animation moves something that is read.
///
/// # Errors
/// If the file is not valid.
pub(super) fn moves(reader: &mut Reader, bytes: &[u8]) -> Result<bool> {
    let path = reader.path.clone();
    guarded(&path, || {
        let (file, _) = parse::parse(reader, bytes)?;
        let tree = Tree::new(&file.root).map_err(|what| reader.fault(what))?;
        let movable = Movable::new(&file, &tree);
        Ok(file.root.animations.iter().any(|animation| movable.is_moved_by(animation)))
    })
}

fn document(reader: &mut Reader, bytes: &[u8], options: &ReadOptions) -> Result<Document> {
    let (file, blob) = parse::parse(reader, bytes)?;
    for name in file.extensions() {
        if let Some(missing) = extensions::missing(&name) {
            reader.note(missing);
        }
    }
    let tree = Tree::new(&file.root).map_err(|what| reader.fault(what))?;
    let buffers = Buffers::new(&file.root, blob);
    let mut builder = Builder {
        reader,
        file: &file,
        buffers,
        tree,
        moved: BTreeMap::new(),
        materials: Vec::new(),
        default_material: None,
        all_materials: BTreeMap::new(),
        definitions: BTreeMap::new(),
        known: HashMap::new(),
    };
    builder.play(options)?;
    let document = builder.document()?;
    if builder.reader.examines {
        builder.tell_animations();
    }
    Ok(document)
}

/// Reads a picture that a file holds itself, by its number.
///
/// # Errors
/// If there is none.
pub(in crate::scene) fn picture(path: &Path, number: u32) -> Result<Vec<u8>> {
    guarded(path, || {
        let mut reader = Reader::new(path);
        let bytes = reader.bytes(path)?;
        let (file, blob) = parse::parse(&mut reader, &bytes)?;
        let mut buffers = Buffers::new(&file.root, blob);
        held(&mut reader, &file, &mut buffers, number as usize)
    })
}

/// The bytes that the pictures of a file take as pyramids, at most; 0 for those that are not to be read.
///
/// # Errors
/// If the file cannot be read.
pub(in crate::scene) fn picture_bytes(path: &Path) -> Result<Vec<u64>> {
    guarded(path, || {
        let mut reader = Reader::new(path);
        let bytes = reader.bytes(path)?;
        let (file, blob) = parse::parse(&mut reader, &bytes)?;
        let mut buffers = Buffers::new(&file.root, blob);
        let one = |image: usize| {
            let bytes = held(&mut reader, &file, &mut buffers, image).unwrap_or_default();
            let picture = Encoded::of(path, &bytes);
            picture.and_then(|picture| picture.head()).map_or(0, |head| head.mapped)
        };
        Ok((0..file.root.images.len()).map(one).collect())
    })
}

fn guarded<T>(path: &Path, run: impl FnOnce() -> Result<T>) -> Result<T> {
    open::guarded(run).unwrap_or_else(|broken| Err(Error::in_file(path, broken)))
}

/// The bytes of a picture of a file.
fn held(reader: &mut Reader, file: &File, buffers: &mut Buffers, index: usize) -> Result<Vec<u8>> {
    let path = reader.path.clone();
    let fault = |what: String| Error::in_file(&path, format!("picture {index}: {what}"));
    let image = file.root.images.get(index);
    let image = image.ok_or_else(|| fault("the file has no such picture".to_owned()))?;
    match (&image.uri, image.buffer_view) {
        (Some(uri), _) => match uri.strip_prefix("data:") {
            Some(data) => buffers::base64(data).map_err(|what| fault(format!("no base64: {what}"))),
            None => buffers::sibling(reader, uri),
        },
        (None, Some(view)) => {
            let (data, part) =
                buffers.view(reader, file, view.value()).map_err(|e| fault(e.to_string()))?;
            Ok(data.get(part).unwrap_or_default().to_vec())
        }
        (None, None) => Err(fault("it has neither a uri nor a buffer view".to_owned())),
    }
}

/// What a mesh must know of its material.
#[derive(Clone)]
struct Look {
    name: String,
    uv_set: Option<u32>,
}

struct Builder<'a> {
    reader: &'a mut Reader,
    file: &'a File,
    buffers: Buffers,
    tree: Tree,
    /// What an animation moves, by node.
    moved: BTreeMap<usize, Moved>,
    materials: Vec<Look>,
    /// The material of primitives that name none, once one does.
    default_material: Option<Look>,
    all_materials: BTreeMap<String, Material>,
    /// Meshes, each under its name.
    definitions: BTreeMap<String, Object>,
    /// Their names by mesh and the weights of its targets.
    known: HashMap<(usize, Vec<u64>), String>,
}

impl Builder<'_> {
    fn document(&mut self) -> Result<Document> {
        let file = self.file;
        let mut names = Names::default();
        for (index, material) in file.root.materials.iter().enumerate() {
            let name = material.name.clone().unwrap_or_else(|| format!("material {index}"));
            let name = names.unique(&name);
            let made = materials::make(self.reader, file, index);
            self.all_materials.insert(name.clone(), made.material);
            self.materials.push(Look { name, uv_set: made.uv_set });
        }
        let mut names = Names::default();
        // All meshes, also those that no node places: a file with a faulty mesh is told whatever is
        // shown.
        for mesh in 0..file.root.meshes.len() {
            self.definition(mesh, &self.weights(mesh, None), &mut names)?;
        }
        let mut document = Document::default();
        let mut plan_names = Names::default();
        for (index, scene) in file.root.scenes.iter().enumerate() {
            let name = scene.name.clone().unwrap_or_else(|| format!("scene {index}"));
            let name = plan_names.unique(&name);
            let roots: Vec<usize> = scene.nodes.iter().map(|node| node.value()).collect();
            let plan = self.plan(name.clone(), &roots, &mut names)?;
            if file.root.scene.is_some_and(|default| default.value() == index) {
                document.default_plan = Some(name);
            }
            document.plans.push(plan);
        }
        if document.plans.is_empty() {
            let roots = self.tree.roots();
            self.reader.note(match roots.is_empty() {
                true => "the file has no scene and no nodes: nothing is shown",
                false => "the file has no scene: all its nodes are shown",
            });
            let plan = self.plan(self.reader.stem(), &roots, &mut names)?;
            document.plans.push(plan);
        }
        document.materials = std::mem::take(&mut self.all_materials);
        Ok(document)
    }

    fn plan(&mut self, name: String, roots: &[usize], names: &mut Names) -> Result<Plan> {
        let file = self.file;
        let all = self.tree.below(&file.root, roots).map_err(|what| self.reader.fault(what))?;
        let mut plan = Plan { name, ..Plan::default() };
        let (mut light_names, mut camera_names) = (Names::default(), Names::default());
        for node in &all {
            let world = self.tree.worlds[*node];
            self.light(*node, &world, &mut plan, &mut light_names);
            let json = &file.root.nodes[*node];
            let camera = json.camera.and_then(|index| file.root.cameras.get(index.value()));
            if let Some(camera) = camera {
                let name = camera.name.as_ref().or(json.name.as_ref()).cloned();
                let number = json.camera.map_or(0, |index| index.value());
                let name = name.unwrap_or_else(|| format!("camera {number}"));
                let name = camera_names.unique(&name);
                plan.cameras.insert(name, lights::camera(camera, &world));
            }
        }
        let mut siblings = Names::default();
        for root in roots {
            let object = self.object(*root, names, &mut siblings, 0)?;
            plan.root.children.extend(object);
        }
        for node in all {
            plan.root.children.extend(self.skinned(node, &mut siblings)?);
        }
        let mut used = std::collections::BTreeSet::new();
        instances(&plan.root, &mut used);
        for name in used {
            if let Some(object) = self.definitions.get(&name) {
                // Each scene has its own.
                let object = object.clone();
                self.buffers.take(faces(&object)).map_err(|e| self.reader.fault(e.to_string()))?;
                plan.definitions.insert(name, object);
            }
        }
        Ok(plan)
    }

    /// A node and those under it, if anything of them is seen.
    fn object(
        &mut self,
        index: usize,
        names: &mut Names,
        siblings: &mut Names,
        depth: usize,
    ) -> Result<Option<Object>> {
        let node = &self.file.root.nodes[index];
        if !self.tree.shows[index] {
            return Ok(None);
        }
        let name = siblings.unique(node.name.as_deref().unwrap_or(&format!("node {index}")));
        if depth > 256 {
            return Err(self.reader.fault("nodes are nested more than 256 deep"));
        }
        let transform = Transform::from_matrix(self.tree.locals[index]);
        let mut object = Object { transform, ..Object::new(name, Shape::Group) };
        if let Some(mesh) = node.mesh.filter(|_| node.skin.is_none()) {
            let weights = self.weights(mesh.value(), Some(index));
            let shape = Shape::Instance(self.definition(mesh.value(), &weights, names)?);
            match self.file.extension("nodes", index, "EXT_mesh_gpu_instancing") {
                None => object.shape = shape,
                Some(instancing) => {
                    let places = self.places(instancing).map_err(|e| {
                        self.in_file(&format!("node {index}, EXT_mesh_gpu_instancing"), e)
                    })?;
                    let instance = |(i, place): (usize, DAffine3)| Object {
                        transform: Transform::from_matrix(place),
                        ..Object::new(format!("instance {i}"), shape.clone())
                    };
                    object.children.extend(places.into_iter().enumerate().map(instance));
                }
            }
        }
        let mut below = Names::default();
        for child in node.children.iter().flatten() {
            object.children.extend(self.object(child.value(), names, &mut below, depth + 1)?);
        }
        Ok(Some(object))
    }

    /// The weights of a mesh's morph targets on a node: an animation's, or else the node's, or else its own.
    fn weights(&self, mesh: usize, node: Option<usize>) -> Vec<f64> {
        if let Some(weights) = node.and_then(|node| self.moved.get(&node)?.weights.clone()) {
            return weights;
        }
        let of_node = node.and_then(|node| self.file.root.nodes[node].weights.as_deref());
        let weights = of_node.or(self.file.root.meshes[mesh].weights.as_deref());
        weights.unwrap_or_default().iter().map(|weight| f64::from(*weight)).collect()
    }

    /// The name of a mesh's definition under some weights of its morph targets.
    fn definition(&mut self, mesh: usize, weights: &[f64], names: &mut Names) -> Result<String> {
        // One mesh under other weights is another shape.
        let key = (mesh, weights.iter().map(|weight| weight.to_bits()).collect::<Vec<u64>>());
        if let Some(name) = self.known.get(&key) {
            return Ok(name.clone());
        }
        let name = self.file.root.meshes[mesh].name.as_deref();
        let name = names.unique(name.unwrap_or(&format!("mesh {mesh}")));
        let object = self.mesh(mesh, weights, None)?;
        self.definitions.insert(name.clone(), object);
        self.known.insert(key, name.clone());
        Ok(name)
    }

    /// A mesh's primitives as one object, or as children if there are several.
    fn mesh(&mut self, mesh: usize, weights: &[f64], pose: Option<&Pose>) -> Result<Object> {
        let mut parts = Vec::new();
        for (at, primitive) in self.file.root.meshes[mesh].primitives.iter().enumerate() {
            let what = format!("mesh {mesh} primitive {at}");
            let part = Part { primitive, mesh, number: at, weights };
            let faces = self.primitive(&part, &what, pose);
            let faces = faces.map_err(|e| self.in_file(&what, e))?;
            if faces.face_count() > 0 {
                parts.push(Object::new(format!("part {at}"), Shape::Faces(faces)));
            }
        }
        Ok(match <[Object; 1]>::try_from(parts) {
            Ok([only]) => Object { name: String::new(), ..only },
            Err(children) => Object { children, ..Object::default() },
        })
    }

    /// Adds the light of a node to a plan.
    fn light(&mut self, node: usize, world: &DAffine3, plan: &mut Plan, names: &mut Names) {
        const NAME: &str = "KHR_lights_punctual";
        let number = self.file.extension("nodes", node, NAME).and_then(|of| of.get("light"));
        let Some(number) = number.and_then(Value::as_u64) else { return };
        let all = self.file.json.get("extensions").and_then(|all| all.get(NAME));
        let all = all.and_then(|all| all.get("lights"));
        let Some(light) = all.and_then(|all| all.get(number as usize)) else { return };
        let own = light.get("name").and_then(Value::as_str);
        let name = own.or(self.file.root.nodes[node].name.as_deref());
        let name = names.unique(name.unwrap_or(&format!("light {number}")));
        match lights::light(light, world) {
            Ok(entry) => drop(plan.lights.insert(name, entry)),
            Err(error) => self.reader.note(format!("light \"{name}\" is left out: {error}")),
        }
    }

    /// What a mesh must know of the material that it names.
    fn material(&mut self, index: Option<usize>) -> Look {
        if let Some(look) = index.and_then(|index| self.materials.get(index)) {
            return look.clone();
        }
        if let Some(look) = &self.default_material {
            return look.clone();
        }
        let mut name = "default".to_owned();
        while self.all_materials.contains_key(&name) {
            name.push('_');
        }
        self.all_materials.insert(name.clone(), materials::default());
        self.default_material.insert(Look { name, uv_set: None }).clone()
    }

    fn values(&mut self, accessor: usize, kind: &Kind<'_>) -> Result<Values> {
        Values::new(self.reader, self.file, &mut self.buffers, accessor, kind)
    }

    fn in_file(&self, what: &str, error: Error) -> Error {
        match error.path() {
            Some(_) => error,
            None => self.reader.fault(format!("{what}: {error}")),
        }
    }
}

/// A fault with where it is, if it says no file.
fn within(what: &str, error: Error) -> Error {
    match error.path() {
        Some(_) => error,
        None => Error::invalid(format!("{what}: {error}")),
    }
}

/// The definitions that an object and those under it place.
fn instances(object: &Object, all: &mut std::collections::BTreeSet<String>) {
    if let Shape::Instance(name) = &object.shape {
        all.insert(name.clone());
    }
    object.children.iter().for_each(|child| instances(child, all));
}

/// The faces of an object and those under it.
fn faces(object: &Object) -> u64 {
    let own = match &object.shape {
        Shape::Faces(mesh) => mesh.face_count() as u64,
        _ => 0,
    };
    own + object.children.iter().map(faces).sum::<u64>()
}
