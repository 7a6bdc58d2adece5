//! A plan made ready for rendering: the tree of objects as a list of placed meshes, materials by
//! number, every face and seal numbered.

use glam::DAffine3;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::document::{Display, Document, Object, Plan};
use super::domains::Define;
use super::geometry::{Faults, Geometry, Part};
use super::maps;
use super::material::{AlphaMode, Material};
use super::read::{self, ReadOptions, Reading};
use super::shape::Shape;
use crate::camera::Camera;
use crate::color::Color;
use crate::error::{Error, Result};
use crate::fragment::{Environment, Origin};
use crate::image::file::Encoded;
use crate::key::{Key, KeyHasher};
use crate::light::list::{Entry, MakeLamp};
use crate::open;

/// The most objects that a scene may place.
const MAX_INSTANCES: usize = 1 << 24;
/// The deepest nesting of objects, definitions and files.
const MAX_DEPTH: usize = 64;
/// The most faults of a scene that are told at once.
const MOST_FAULTS: usize = 20;
/// What to do about a file that gives surfaces their colours, and cannot be read.
pub(super) const WITHOUT_PICTURES: &str =
    "put it there, or read the scene with `pictures: false`, which shows it without";

/// Whether a file is there that gives surfaces their colours; `whose` is what the error says of it.
///
/// # Errors
/// If it is not.
pub(super) fn is_there(path: &Path, whose: impl std::fmt::Display) -> Result<()> {
    std::fs::metadata(path).map(drop).map_err(|e| {
        let what = format!("{e} ({whose}): {WITHOUT_PICTURES}");
        Error::file(path, std::io::Error::new(e.kind(), what))
    })
}

/// A plan made ready for rendering. Immutable; its key stands for its contents.
#[derive(Clone, Debug)]
pub struct Scene {
    /// What the scene is called: its file, as the graph names it.
    pub label: String,
    /// The contents, without those of the pictures that materials name.
    pub key: Key,
    /// The contents of these pictures, if it was read from a file.
    pub pictures: Option<Key>,
    /// The placed meshes, in the order of the tree.
    pub instances: Vec<Instance>,
    /// All materials. The last is the one of faces that name none.
    pub materials: Vec<Material>,
    /// Their names; that of the last is empty.
    pub material_names: Vec<String>,
    /// Cameras by name.
    pub cameras: BTreeMap<String, Camera>,
    /// The lights of its list.
    pub lights: BTreeMap<String, Entry>,
    /// Where the files that its lights name are found from.
    pub directory: PathBuf,
    /// The environment, if the file says anything of it.
    pub environment: Option<Environment>,
    /// The files that the document names.
    pub files: Vec<PathBuf>,
    /// Libraries of materials that surfaces need and that are not there: the scene has its shapes only.
    pub missing: Vec<PathBuf>,
    /// What is doubtful in the files and was taken as well as could be.
    pub notes: Vec<String>,
    /// The file that it was read from.
    pub origin: Option<Origin>,
}

/// A mesh in its place.
#[derive(Clone, Debug)]
pub struct Instance {
    /// The object's path in the tree.
    pub path: String,
    /// From the object's space to the world.
    pub world_from_object: DAffine3,
    /// The mesh.
    pub geometry: Arc<Geometry>,
    /// The scene's materials that the mesh's indices mean.
    pub palette: Arc<[u32]>,
    /// The material of faces that name none.
    pub material: u32,
    /// Whether seals are seen.
    pub shows_seals: bool,
    /// The number, among all parts of faces of the scene, of this one's first.
    pub first_ordinal: u32,
}

impl Scene {
    /// The pictures of its materials that have files of their own: of which material, what they are there, and the
    /// file.
    fn pictures(&self) -> impl Iterator<Item = (&str, &str, &Path)> {
        let named = self.material_names.iter().zip(&self.materials);
        named.flat_map(|(name, material)| {
            let maps = material.maps.iter();
            let maps = maps.filter_map(|(what, map)| Some((what.as_str(), map.picture.file()?)));
            let domains = material.domains.iter().filter_map(|domains| match &domains.define {
                Define::Picture(path) => Some(("domains", path.as_str())),
                _ => None,
            });
            maps.chain(domains).map(move |(what, path)| (name.as_str(), what, Path::new(path)))
        })
    }

    /// The contents of the pictures of its materials.
    pub(super) fn key_of_pictures(&self) -> Key {
        let mut key = KeyHasher::new("pictures");
        let files: BTreeSet<&Path> = self.pictures().map(|(.., path)| path).collect();
        files.into_iter().for_each(|path| {
            key.value(&open::contents(path));
        });
        key.finish()
    }

    /// The pictures of its materials whose files are not there: which, of which material, and the cure.
    pub fn missing_pictures(&self) -> Vec<String> {
        let missing = self.pictures().filter(|(.., path)| !open::is_file(path));
        let told = missing.map(|(name, what, path)| {
            let path = path.display();
            format!("material \"{name}\", {what}: there is no file {path}: {WITHOUT_PICTURES}")
        });
        told.collect()
    }

    /// The pictures of its materials whose files are there but are no pictures, or damaged at their beginning. Opens
    /// each of them.
    pub fn unreadable_pictures(&self) -> Vec<String> {
        let mut looked = HashSet::new();
        let files =
            self.pictures().filter(|(.., path)| open::is_file(path) && looked.insert(*path));
        let told = files.filter_map(|(name, what, path)| {
            let error = Encoded::open(path).and_then(|picture| picture.head()).err()?;
            Some(format!("material \"{name}\", {what}: {error}: {WITHOUT_PICTURES}"))
        });
        told.collect()
    }

    /// Colours of surfaces that nobody means: they would send back more light than they receive.
    fn bright_colors(&self) -> Vec<String> {
        let named = self.material_names.iter().zip(&self.materials);
        let bright = named.filter(|(_, of)| !of.unlit && of.color.greatest() > 1.0);
        let told = bright.map(|(name, material)| {
            let color = material.color.to_array().map(|v| v.to_string()).join(", ");
            format!(
                "material \"{name}\": the colour ({color}) sends back more light than it receives: a surface's \
                 colour is 0 to 1; what shines of itself is `unlit`, or has a `glow` in its `finish`"
            )
        });
        told.collect()
    }

    /// Makes a plan of a document ready. Files that it names are found from `directory`. Without a
    /// name the default plan is taken, or the only one.
    ///
    /// # Errors
    /// If there is no such plan, a material, definition or file that it names is missing or faulty, an
    /// object contains itself, or the scene is larger than 2^32 faces or 2^24 objects.
    pub fn new(
        document: &Document,
        plan: Option<&str>,
        label: &str,
        key: Key,
        directory: &Path,
    ) -> Result<Scene> {
        Scene::with_files(document, plan, label, key, directory, Files::new())
            .map(|(scene, _)| scene)
    }

    /// The same, where some files that the document names are known. Returns all of them too.
    pub(super) fn with_files(
        document: &Document,
        plan: Option<&str>,
        label: &str,
        key: Key,
        directory: &Path,
        files: Files,
    ) -> Result<(Scene, Files)> {
        let plan = document.plan(plan)?;
        let environment = plan.environment.as_ref();
        let lights = plan.lights.iter().map(|(name, light)| {
            let fault = |fault| Error::invalid(format!("light \"{name}\": {}", Error::from(fault)));
            let light = light.clone().within(environment, &plan.lights).map_err(fault)?;
            light.check().map_err(fault)?;
            Ok((name.clone(), light))
        });
        let lights = lights.collect::<Result<BTreeMap<String, Entry>>>()?;
        let mut flattening = Flattening { files, ..Flattening::default() };
        let root = DAffine3::IDENTITY;
        let top = Place {
            path: String::new(),
            world: root,
            display: Display::FacesAndSeals,
            material: None,
            depth: 0,
        };
        let file = File { document, plan, directory };
        flattening.visit(&file, &plan.root, &top)?;
        if !flattening.faults.is_empty() {
            return Err(Error::invalid(flattening.faults.join("\n")));
        }
        let mut key_of_all = KeyHasher::new("scene");
        key_of_all.key(key).bytes(plan.name.as_bytes());
        for reading in flattening.files.values() {
            key_of_all.key(reading.key);
        }
        let Flattening { mut materials, mut material_names, .. } = flattening;
        let unnamed = materials.len() as u32;
        materials.push(Material::default());
        material_names.push(String::new());
        let mut instances = flattening.instances;
        let is_unnamed = |instance: &&mut Instance| instance.material == UNNAMED;
        for instance in instances.iter_mut().filter(is_unnamed) {
            let has_colors = !instance.geometry.mesh().colors.is_empty();
            if has_colors && materials.len() as u32 == unnamed + 1 {
                // What has colours by vertex shows these as they are.
                materials.push(Material { color: Color::WHITE, ..Material::default() });
                material_names.push(String::new());
            }
            instance.material = unnamed + u32::from(has_colors);
        }
        let files = flattening.files;
        let mut scene = Scene {
            label: label.to_owned(),
            key: key_of_all.finish(),
            pictures: None,
            instances,
            materials,
            material_names,
            cameras: plan.cameras.clone(),
            lights,
            directory: directory.to_owned(),
            environment: plan.environment.clone(),
            notes: files.values().flat_map(|reading| reading.notes.clone()).collect(),
            files: files.keys().map(|(path, _)| path.clone()).collect(),
            missing: files.values().flat_map(|reading| reading.missing.clone()).collect(),
            origin: None,
        };
        scene.notes.extend(scene.bright_colors());
        Ok((scene, files))
    }

    /// A scene of one object, for programs that make their own.
    ///
    /// # Errors
    /// As [`Scene::new`].
    pub fn from_object(label: &str, object: Object) -> Result<Scene> {
        let plan = Plan { root: object, ..Plan::default() };
        let document = Document::with_plan(plan);
        Scene::new(&document, None, label, Key::of(&document), Path::new(""))
    }

    /// The number of faces, seals and drawn edges.
    pub fn part_count(&self) -> u32 {
        self.instances.last().map_or(0, |last| last.first_ordinal + last.geometry.part_count())
    }

    /// The number of faces.
    pub fn face_count(&self) -> usize {
        self.instances.iter().map(|instance| instance.geometry.mesh().face_count()).sum()
    }

    /// The place of the instance, the face and the part of a number below
    /// [`part_count`](Scene::part_count).
    pub fn part(&self, ordinal: u32) -> (usize, usize, Part) {
        let at = self.instances.partition_point(|i| i.first_ordinal <= ordinal) - 1;
        let instance = &self.instances[at];
        let (face, part) = instance.geometry.part(ordinal - instance.first_ordinal);
        (at, face, part)
    }

    /// What had to be changed to make the meshes ready, mesh by mesh.
    pub fn faults(&self) -> impl Iterator<Item = (&str, Faults)> {
        let mut seen = std::collections::HashSet::new();
        self.instances
            .iter()
            .filter(move |instance| seen.insert(Arc::as_ptr(&instance.geometry)))
            .map(|instance| (instance.path.as_str(), instance.geometry.faults()))
            .filter(|(_, faults)| {
                *faults != Faults { worst_deviation: faults.worst_deviation, ..Faults::default() }
            })
    }
}

const UNNAMED: u32 = u32::MAX;

/// Files by path and how they were read.
pub(super) type Files = BTreeMap<(PathBuf, String), Reading>;

/// A file being flattened.
struct File<'a> {
    document: &'a Document,
    plan: &'a Plan,
    directory: &'a Path,
}

/// What an object inherits.
struct Place {
    path: String,
    world: DAffine3,
    display: Display,
    material: Option<u32>,
    depth: usize,
}

#[derive(Default)]
struct Flattening {
    instances: Vec<Instance>,
    materials: Vec<Material>,
    material_names: Vec<String>,
    /// Numbers of materials by document and name.
    numbers: HashMap<(usize, String), u32>,
    /// Geometry and palette of shapes, by address: an instance or array visits one shape many times. Nothing of
    /// those that are faulty.
    ready: HashMap<usize, Option<(Arc<Geometry>, Arc<[u32]>)>>,
    /// What is wrong with single objects: the rest is looked at all the same.
    faults: Vec<String>,
    is_too_large: bool,
    /// Kept so that addresses stay theirs.
    files: Files,
    /// The definitions and files that are being placed, outermost first.
    open: Vec<String>,
    visits: usize,
    parts: u64,
}

impl Flattening {
    fn visit(&mut self, file: &File<'_>, object: &Object, above: &Place) -> Result<()> {
        if above.depth > MAX_DEPTH {
            return Err(Error::invalid(format!(
                "\"{}\" is nested more than {MAX_DEPTH} deep: does it contain itself?",
                above.path
            )));
        }
        self.visits += 1;
        if self.visits > MAX_INSTANCES {
            self.is_too_large = true;
            return Err(Error::invalid(format!(
                "more than {MAX_INSTANCES} objects: divide the scene"
            )));
        }
        let display = object.display.min(above.display);
        if display == Display::Hidden {
            return Ok(());
        }
        let path = match (above.path.as_str(), object.name.as_str()) {
            (path, "") => path.to_owned(),
            ("", name) => name.to_owned(),
            (path, name) => format!("{path}/{name}"),
        };
        let world = above.world * object.transform.to_matrix();
        if !world.is_finite() {
            return Err(Error::invalid(format!("object \"{path}\": its place is not finite")));
        }
        let material = match &object.material {
            Some(name) => {
                let number = self.material(file, name);
                self.sift(&path, number)?.or(above.material)
            }
            None => above.material,
        };
        let here = Place { path, world, display, material, depth: above.depth + 1 };
        let placed = self.place(file, &object.shape, &here);
        self.sift(&here.path, placed)?;
        for (i, child) in object.children.iter().enumerate() {
            if child.name.is_empty() {
                let numbered = Place { path: numbered(&here.path, i), ..here };
                self.visit(file, child, &numbered)?;
            } else {
                self.visit(file, child, &here)?;
            }
        }
        Ok(())
    }

    fn place(&mut self, file: &File<'_>, shape: &Shape, here: &Place) -> Result<()> {
        match shape {
            Shape::Group => Ok(()),
            Shape::Instance(name) => {
                let definition = file.plan.definitions.get(name).ok_or_else(|| {
                    Error::invalid(format!("there is no definition \"{name}\" in the plan"))
                })?;
                self.open(name)?;
                self.visit(file, definition, here)?;
                self.open.pop();
                Ok(())
            }
            Shape::Array { of, count, step } => {
                let total = count.iter().map(|n| u64::from(*n)).product::<u64>();
                if total > MAX_INSTANCES as u64 {
                    return Err(Error::invalid(format!(
                        "an array of {total}: at most {MAX_INSTANCES}"
                    )));
                }
                let each = (0..count[2]).flat_map(|k| {
                    (0..count[1]).flat_map(move |j| (0..count[0]).map(move |i| [i, j, k]))
                });
                for (n, index) in each.enumerate() {
                    let offset = std::array::from_fn(|axis| f64::from(index[axis]) * step[axis]);
                    let world = here.world * DAffine3::from_translation(offset.into());
                    let path = numbered(&here.path, n);
                    self.visit(file, of, &Place { path, world, ..*here })?;
                }
                Ok(())
            }
            Shape::File { path, plan, unit, up } => {
                let options = ReadOptions { unit: *unit, up: *up, ..ReadOptions::default() };
                let id = (file.directory.join(path), format!("{options:?}"));
                if !self.files.contains_key(&id) {
                    let reading = read::document(&id.0, &options)?;
                    self.files.insert(id.clone(), reading);
                }
                self.open(&id.0.display().to_string())?;
                let document = self.files[&id].document.clone();
                let plan = document
                    .plan(plan.as_deref())
                    .map_err(|e| Error::in_file(&id.0, e.to_string()))?;
                let directory = id.0.parent().unwrap_or(Path::new(""));
                self.visit(&File { document: &document, plan, directory }, &plan.root, here)?;
                self.open.pop();
                Ok(())
            }
            shape => self.place_mesh(file, shape, here),
        }
    }

    /// Notes that a definition or file is being placed.
    fn open(&mut self, name: &str) -> Result<()> {
        if let Some(at) = self.open.iter().position(|open| open == name) {
            let way = self.open[at..].join("\" in \"");
            let message = format!("an object contains itself: \"{way}\" in \"{name}\"");
            return Err(Error::invalid(message));
        }
        self.open.push(name.to_owned());
        Ok(())
    }

    /// A shape's geometry, and the scene's materials that its indices mean.
    fn make_ready(
        &mut self,
        file: &File<'_>,
        shape: &Shape,
    ) -> Result<(Arc<Geometry>, Arc<[u32]>)> {
        let geometry = match shape {
            Shape::Faces(mesh) => Geometry::new(mesh)?,
            shape => Geometry::new(&shape.mesh()?)?,
        };
        let names = &geometry.mesh().materials;
        let palette: Result<Arc<[u32]>> =
            names.iter().map(|name| self.material(file, name)).collect();
        Ok((Arc::new(geometry), palette?))
    }

    /// What was made of an object, or nothing: its fault is kept, for the rest to be looked at too.
    ///
    /// # Errors
    /// If the scene is too large, a file cannot be read, or there are too many faults.
    fn sift<T>(&mut self, path: &str, made: Result<T>) -> Result<Option<T>> {
        match made.map_err(|error| in_object(path, error)) {
            Ok(made) => Ok(Some(made)),
            Err(Error::Invalid(message)) if !self.is_too_large => {
                if self.faults.len() == MOST_FAULTS {
                    self.faults.push("and more".to_owned());
                    return Err(Error::invalid(self.faults.join("\n")));
                }
                if !self.faults.contains(&message) {
                    self.faults.push(message);
                }
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    fn place_mesh(&mut self, file: &File<'_>, shape: &Shape, here: &Place) -> Result<()> {
        let address = std::ptr::from_ref(shape) as usize;
        let ready = match self.ready.get(&address) {
            Some(ready) => ready.clone(),
            None => {
                // Nothing until it is ready: a faulty shape is told once, wherever it is placed.
                self.ready.insert(address, None);
                let ready = Some(self.make_ready(file, shape)?);
                self.ready.insert(address, ready.clone());
                ready
            }
        };
        let Some((geometry, palette)) = ready else { return Ok(()) };
        geometry.check_place(&here.world)?;
        let first_ordinal = self.parts as u32;
        self.parts += u64::from(geometry.part_count());
        if self.instances.len() >= MAX_INSTANCES || self.parts >= u64::from(u32::MAX) {
            self.is_too_large = true;
            return Err(Error::invalid(format!(
                "more than {MAX_INSTANCES} objects or 2^32 faces: divide the scene"
            )));
        }
        self.instances.push(Instance {
            path: here.path.clone(),
            world_from_object: here.world,
            geometry,
            palette,
            material: here.material.unwrap_or(UNNAMED),
            shows_seals: here.display == Display::FacesAndSeals,
            first_ordinal,
        });
        Ok(())
    }

    fn material(&mut self, file: &File<'_>, name: &str) -> Result<u32> {
        let id = (std::ptr::from_ref(file.document) as usize, name.to_owned());
        if let Some(number) = self.numbers.get(&id) {
            return Ok(*number);
        }
        let made = self.make_material(file, name);
        // One that is faulty is told once, whoever wears it.
        self.numbers.insert(id, *made.as_ref().unwrap_or(&0));
        made
    }

    fn make_material(&mut self, file: &File<'_>, name: &str) -> Result<u32> {
        let material = file.document.materials.get(name).ok_or_else(|| {
            let names: Vec<&str> = file.document.materials.keys().map(String::as_str).collect();
            Error::invalid(format!(
                "there is no material \"{name}\": the scene has {}",
                names.join(", ")
            ))
        })?;
        let finite = material.color.is_finite() && material.alpha.is_finite();
        if !finite {
            return Err(Error::invalid(format!(
                "material \"{name}\" has a number that is not finite"
            )));
        }
        let in_material = |e: Error| Error::invalid(format!("material \"{name}\": {e}"));
        material.finish.check().map_err(in_material)?;
        // Files of others may be off by their rounding.
        if !(-1e-3..=1.001).contains(&material.alpha) {
            let message = format!("`alpha` is {}: must be 0 to 1", material.alpha);
            return Err(in_material(Error::invalid(message)));
        }
        let mut material = material.clone();
        for (what, map) in &mut material.maps {
            let in_map = |e: Error| in_material(Error::invalid(format!("map \"{what}\": {e}")));
            maps::check(what, map).map_err(in_map)?;
            if let Some(path) = map.picture.path_mut() {
                *path = file.directory.join(&path).to_string_lossy().into_owned();
            }
        }
        if let Some(domains) = &mut material.domains {
            let in_domains = |e: Error| in_material(Error::invalid(format!("domains: {e}")));
            domains.check().map_err(in_domains)?;
            if material.alpha_mode != AlphaMode::Opaque {
                let message = "what is divided is its bundles: give them the alpha_mode";
                return Err(in_domains(Error::invalid(message)));
            }
            if let Define::Picture(path) = &mut domains.define {
                *path = file.directory.join(&path).to_string_lossy().into_owned();
            }
            for (index, bundle) in &domains.table {
                let known = file.document.materials.get(bundle);
                if known.is_some_and(|known| known.domains.is_some()) {
                    let message =
                        format!("the bundle of {index}, \"{bundle}\", has domains itself");
                    return Err(in_domains(Error::invalid(message)));
                }
                let number = self.material(file, bundle).map_err(in_domains)?;
                domains.numbers.insert(*index, number);
            }
        }
        let number = self.materials.len() as u32;
        self.materials.push(material);
        self.material_names.push(name.to_owned());
        Ok(number)
    }
}

fn numbered(path: &str, i: usize) -> String {
    format!("{path}[{i}]")
}

fn in_object(path: &str, error: Error) -> Error {
    match error {
        Error::Invalid(message) if !message.starts_with("object \"") && !path.is_empty() => {
            Error::Invalid(format!("object \"{path}\": {message}"))
        }
        other => other,
    }
}
