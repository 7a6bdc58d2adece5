//! The tree of objects as a list of placed meshes: instances, arrays and files are followed, materials and parts are
//! numbered. What is wrong with single objects is collected, and the rest looked at all the same.

use glam::DAffine3;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::document::{Display, Document, Object, Plan};
use super::domains::Define;
use super::flat::Instance;
use super::geometry::Geometry;
use super::library::{Library, ReadOptions, Reading};
use super::maps;
use super::material::{AlphaMode, Material};
use super::shape::Shape;
use crate::error::{Error, Result};

/// The most objects that a scene may place.
const MAX_INSTANCES: usize = 1 << 24;
/// The deepest nesting of objects, definitions and files.
const MAX_DEPTH: usize = 64;
/// The most faults of a scene that are told at once.
const MOST_FAULTS: usize = 20;
/// The number of the material of faces that name none, until there is one.
pub(super) const UNNAMED: u32 = u32::MAX;

/// Files by path and how they were read.
pub(super) type Files = BTreeMap<(PathBuf, String), Reading>;

/// A shape's geometry, and the scene's materials that its indices mean.
type Ready = (Arc<Geometry>, Arc<[u32]>);

/// A file being flattened.
pub(super) struct OpenDocument<'a> {
    pub(super) document: &'a Document,
    pub(super) plan: &'a Plan,
    pub(super) directory: &'a Path,
}

/// What an object inherits.
pub(super) struct Inherited {
    pub(super) path: String,
    pub(super) world: DAffine3,
    pub(super) display: Display,
    pub(super) material: Option<u32>,
    pub(super) depth: usize,
}

/// A scene in the making: what was placed so far, and what was wrong with the rest.
pub(super) struct Flattening<'l> {
    reader: &'l dyn Library,
    pub(super) instances: Vec<Instance>,
    pub(super) materials: Vec<Material>,
    pub(super) material_names: Vec<String>,
    /// Numbers of materials by document and name.
    numbers: HashMap<(usize, String), u32>,
    /// Geometry and palette of shapes, by address: an instance or array visits one shape many times. Nothing of
    /// those that are faulty.
    ready: HashMap<usize, Option<Ready>>,
    /// What is wrong with single objects: the rest is looked at all the same.
    faults: Vec<String>,
    is_over: bool,
    /// Kept so that addresses stay theirs.
    pub(super) files: Files,
    /// The definitions and files that are being placed, outermost first.
    open: Vec<String>,
    visits: usize,
    parts: u64,
}

impl Flattening<'_> {
    pub(super) fn new(library: &Arc<dyn Library>, files: Files) -> Flattening<'_> {
        Flattening {
            reader: &**library,
            instances: Vec::new(),
            materials: Vec::new(),
            material_names: Vec::new(),
            numbers: HashMap::new(),
            ready: HashMap::new(),
            faults: Vec::new(),
            is_over: false,
            files,
            open: Vec::new(),
            visits: 0,
            parts: 0,
        }
    }

    pub(super) fn visit(
        &mut self,
        file: &OpenDocument<'_>,
        object: &Object,
        above: &Inherited,
    ) -> Result<()> {
        if above.depth > MAX_DEPTH {
            return Err(Error::invalid(format!(
                "\"{}\" is nested more than {MAX_DEPTH} deep: does it contain itself?",
                above.path
            )));
        }
        // Groups and instances nested in each other grow as a power. Visits are counted, not only
        // meshes.
        self.visits += 1;
        if self.visits > MAX_INSTANCES {
            self.is_over = true;
            return Err(Error::invalid(format!(
                "more than {MAX_INSTANCES} objects: divide the scene"
            )));
        }
        // What is hidden above stays hidden below, whatever the child says.
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
                // A faulty material is told and then replaced, so that the shape below is checked
                // too.
                self.sift(&path, number)?.or(above.material)
            }
            None => above.material,
        };
        let here = Inherited { path, world, display, material, depth: above.depth + 1 };
        let placed = self.place(file, &object.shape, &here);
        self.sift(&here.path, placed)?;
        for (i, child) in object.children.iter().enumerate() {
            // Siblings without a name are told apart by their number, so that paths stay unique.
            if child.name.is_empty() {
                let numbered = Inherited { path: numbered(&here.path, i), ..here };
                let visited = self.visit(file, child, &numbered);
                self.sift(&numbered.path, visited)?;
            } else {
                let visited = self.visit(file, child, &here);
                self.sift(&here.path, visited)?;
            }
        }
        Ok(())
    }

    fn place(&mut self, file: &OpenDocument<'_>, shape: &Shape, here: &Inherited) -> Result<()> {
        match shape {
            Shape::Group => Ok(()),
            Shape::Instance(name) => {
                let definition = file.plan.definitions.get(name).ok_or_else(|| {
                    Error::invalid(format!("there is no definition \"{name}\" in the plan"))
                })?;
                self.open(name)?;
                let visited = self.visit(file, definition, here);
                self.open.pop();
                visited
            }
            Shape::Array { of, count, step } => {
                // Asked before the loop, which would fail only after many millions of copies.
                let total = count.iter().map(|n| u128::from(*n)).product::<u128>();
                if total > MAX_INSTANCES as u128 {
                    return Err(Error::invalid(format!(
                        "an array of {total}: at most {MAX_INSTANCES}"
                    )));
                }
                let each = (0..count[2]).flat_map(|k| {
                    (0..count[1]).flat_map(move |j| (0..count[0]).map(move |i| [i, j, k]))
                });
                for (n, index) in each.enumerate() {
                    // Multiplied, not added up: the last copy is as exact as the first.
                    let offset = std::array::from_fn(|axis| f64::from(index[axis]) * step[axis]);
                    let world = here.world * DAffine3::from_translation(offset.into());
                    let one = Inherited { path: numbered(&here.path, n), world, ..*here };
                    let visited = self.visit(file, of, &one);
                    self.sift(&one.path, visited)?;
                }
                Ok(())
            }
            Shape::File { path, plan, unit, up, parameters } => {
                let (unit, up, moment) = (*unit, *up, file.document.moment);
                let parameters = parameters.clone();
                let options =
                    ReadOptions { unit, up, moment, parameters, ..ReadOptions::default() };
                // One file in two units is two documents.
                let id = (file.directory.join(path), options.for_key());
                if !self.files.contains_key(&id) {
                    let reading = self.reader.document(&id.0, &options)?;
                    self.files.insert(id.clone(), reading);
                }
                let document = self.files[&id].document.clone();
                let plan = document
                    .plan(plan.as_deref())
                    .map_err(|e| Error::in_file(&id.0, e.to_string()))?;
                let directory = id.0.parent().unwrap_or(Path::new(""));
                let document = OpenDocument { document: &document, plan, directory };
                self.open(&id.0.display().to_string())?;
                let visited = self.visit(&document, &plan.root, here);
                self.open.pop();
                visited
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
    fn make_ready(&mut self, file: &OpenDocument<'_>, shape: &Shape) -> Result<Ready> {
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
    /// If nothing more of the scene is to be looked at: it is too large, a file cannot be read, or there are too many
    /// faults.
    pub(super) fn sift<T>(&mut self, path: &str, made: Result<T>) -> Result<Option<T>> {
        match made.map_err(|error| in_object(path, error)) {
            Ok(made) => Ok(Some(made)),
            Err(Error::Invalid(message)) if !self.is_over => {
                self.is_over = self.faults.len() == MOST_FAULTS;
                if self.is_over {
                    return Err(Error::invalid("and there are more faults"));
                }
                self.faults.push(message);
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    /// All that is wrong with the scene, with what ended the search, if something did.
    pub(super) fn told(&mut self, last: Option<Error>) -> Option<Error> {
        let mut faults = std::mem::take(&mut self.faults);
        if faults.is_empty() {
            return last;
        }
        faults.extend(last.map(|error| error.to_string()));
        Some(Error::invalid(faults.join("\n")))
    }

    fn place_mesh(
        &mut self,
        file: &OpenDocument<'_>,
        shape: &Shape,
        here: &Inherited,
    ) -> Result<()> {
        // Documents are neither moved nor dropped while they are flattened, so an address names a
        // shape.
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
        // Exact: the test below ends the scene before it would wrap.
        let first_ordinal = self.parts as u32;
        self.parts += u64::from(geometry.part_count());
        if self.instances.len() >= MAX_INSTANCES || self.parts >= u64::from(u32::MAX) {
            self.is_over = true;
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

    fn material(&mut self, file: &OpenDocument<'_>, name: &str) -> Result<u32> {
        let id = (std::ptr::from_ref(file.document) as usize, name.to_owned());
        if let Some(number) = self.numbers.get(&id) {
            return Ok(*number);
        }
        let made = self.make_material(file, name);
        // One that is faulty is told once, whoever wears it.
        self.numbers.insert(id, *made.as_ref().unwrap_or(&0));
        made
    }

    fn make_material(&mut self, file: &OpenDocument<'_>, name: &str) -> Result<u32> {
        let material = file.document.materials.get(name).ok_or_else(|| {
            let names: Vec<&str> = file.document.materials.keys().map(String::as_str).collect();
            Error::invalid(format!(
                "there is no material \"{name}\": the scene has {}",
                names.join(", ")
            ))
        })?;
        // A text can say NaN, and a number too large for its type is infinite.
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
                // Only one level: without this test two materials could be bundles of each other,
                // for ever.
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
