//! A plan made ready for rendering: the tree of objects as a list of placed meshes, materials by
//! number, every face and seal numbered.

use glam::DAffine3;
use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::absent::WITHOUT_PICTURES;
use super::document::{Display, Document, Object, Plan};
use super::domains::Define;
use super::flatten::{Files, Flattening, Inherited, OpenDocument, UNNAMED};
use super::geometry::{Faults, Geometry, Part};
use super::library::{Library, NoFiles};
use super::material::Material;
use crate::camera::Camera;
use crate::color::Color;
use crate::error::{Error, Result};
use crate::fragment::{Environment, Origin};
use crate::image::file::Encoded;
use crate::key::{Key, KeyHasher};
use crate::light::list::{LightEntry, MakeLamp};
use crate::open;
use crate::text::{list, names_object, nearest};

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
    pub lights: BTreeMap<String, LightEntry>,
    /// Where the files that its lights name are found from.
    pub directory: PathBuf,
    /// The environment, if the file says anything of it.
    pub environment: Option<Environment>,
    /// The files that the document names.
    pub files: Vec<PathBuf>,
    /// Libraries of materials that surfaces need and that cannot be read, and why: the scene has its shapes only.
    pub missing: Vec<(PathBuf, String)>,
    /// What is doubtful in the files and was taken as well as could be.
    pub notes: Vec<String>,
    /// Who reads the pictures that files hold.
    pub(super) reader: Arc<dyn Library>,
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
        let sent = |of: &Material| {
            let through = Color::WHITE + of.finish.transmit;
            match of.finish.transmits() {
                true => of.color * through * of.finish.diffuse,
                false => of.color,
            }
        };
        let bright = named.filter(|(_, of)| !of.unlit && sent(of).greatest() > 1.0);
        let told = bright.map(|(name, material)| {
            let color = material.color.to_array().map(|v| v.to_string()).join(", ");
            format!(
                "material \"{name}\": the colour ({color}) sends back more light than it receives: a surface's \
                 colour is 0 to 1, less where its `finish` has `transmit`; what shines of itself is `unlit`, or has a \
                 `glow` in its `finish`"
            )
        });
        told.collect()
    }

    /// Makes a plan of a document ready. Files that it names are found from `directory`, and read by a library. Without
    /// a name the default plan is taken, or the only one.
    ///
    /// # Errors
    /// If there is no such plan, a material, definition or file that it names is missing or faulty, an
    /// object contains itself, or the scene is larger than 2^32 faces or 2^24 objects.
    pub fn with_library(
        document: &Document,
        plan: Option<&str>,
        label: &str,
        key: Key,
        (directory, library): (&Path, &Arc<dyn Library>),
    ) -> Result<Scene> {
        Scene::with_files(document, plan, label, key, (directory, library), Files::new())
            .map(|(scene, _)| scene)
    }

    /// The same, where some files that the document names are known. Returns all of them too.
    pub(super) fn with_files(
        document: &Document,
        plan: Option<&str>,
        label: &str,
        key: Key,
        (directory, library): (&Path, &Arc<dyn Library>),
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
        let lights = lights.collect::<Result<BTreeMap<String, LightEntry>>>()?;
        let mut flattening = Flattening::new(library, files);
        let root = DAffine3::IDENTITY;
        let top = Inherited {
            path: String::new(),
            world: root,
            display: Display::FacesAndSeals,
            material: None,
            depth: 0,
        };
        let file = OpenDocument { document, plan, directory };
        let visited = flattening.visit(&file, &plan.root, &top);
        let last = flattening.sift("", visited).err();
        if let Some(error) = flattening.told(last) {
            return Err(error);
        }
        let mut key_of_all = KeyHasher::new("scene");
        key_of_all.key(key).bytes(plan.name.as_bytes());
        // A file that the document names may change while the document does not.
        for reading in flattening.files.values() {
            key_of_all.key(reading.key);
        }
        let Flattening { mut materials, mut material_names, .. } = flattening;
        // Faces without a material get their number last, so that nothing else is numbered anew.
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
            reader: library.clone(),
            origin: None,
        };
        scene.notes.extend(scene.bright_colors());
        Ok((scene, files))
    }

    /// A scene of one object, for programs that make their own.
    ///
    /// # Errors
    /// As [`Scene::with_library`].
    pub fn from_object(label: &str, object: Object) -> Result<Scene> {
        let plan = Plan { root: object, ..Plan::default() };
        let document = Document::with_plan(plan);
        let library: Arc<dyn Library> = Arc::new(NoFiles);
        Scene::with_library(&document, None, label, Key::of(&document), (Path::new(""), &library))
    }

    /// Keeps the objects that some pattern names, as `house/*` or `roof`, and leaves out all others.
    ///
    /// # Errors
    /// If a pattern names none.
    pub(super) fn keep(&mut self, patterns: &[String]) -> std::result::Result<(), String> {
        let paths = || self.instances.iter().map(|instance| instance.path.as_str());
        let is_lost = |pattern: &&String| !paths().any(|path| names_object(pattern, path));
        if let Some(lost) = patterns.iter().find(is_lost) {
            let parts: BTreeSet<&str> = paths().flat_map(|path| path.split('/')).collect();
            return Err(match nearest(lost, parts.iter().copied()) {
                Some(near) => {
                    format!("the scene has no object \"{lost}\": did you mean \"{near}\"?")
                }
                None => format!("the scene has no object \"{lost}\": it has {}", list(parts)),
            });
        }
        let is_kept = |instance: &Instance| {
            patterns.iter().any(|pattern| names_object(pattern, &instance.path))
        };
        self.instances.retain(is_kept);
        let mut first = 0;
        for instance in &mut self.instances {
            instance.first_ordinal = first;
            first += instance.geometry.part_count();
        }
        Ok(())
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
        // The last that begins at or before it: an instance without parts shares its number with
        // the next.
        let at = self.instances.partition_point(|i| i.first_ordinal <= ordinal) - 1;
        let instance = &self.instances[at];
        let (face, part) = instance.geometry.part(ordinal - instance.first_ordinal);
        (at, face, part)
    }

    /// What had to be changed to make the meshes ready, mesh by mesh.
    pub fn faults(&self) -> impl Iterator<Item = (&str, Faults)> {
        // Instances share a mesh: its faults are told once, under the first that places it.
        let mut seen = std::collections::HashSet::new();
        self.instances
            .iter()
            .filter(move |instance| seen.insert(Arc::as_ptr(&instance.geometry)))
            .map(|instance| (instance.path.as_str(), instance.geometry.faults()))
            .filter(|(_, faults)| {
                // A deviation within the tolerance changes nothing and is no fault.
                *faults != Faults { worst_deviation: faults.worst_deviation, ..Faults::default() }
            })
    }
}
