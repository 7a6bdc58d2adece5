//! Documents, plans and objects: the model that people edit and files hold (\[D], "Geometry data
//! structure").
//!
//! A document holds several plans. A plan has a tree of objects under a root object that is always
//! there. An object has faces. Everything is a plain value that can be read, changed, removed and
//! written.

use glam::{DAffine3, DMat3, DVec3};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashSet};

use super::is_default;
use super::material::Material;
use super::mesh::Mesh;
use super::shape::Shape;
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::fragment::Environment;
use crate::light::list::LightEntry;
use crate::math;
use crate::moment::Moment;
use crate::text::AnyValue;

/// The version of the scene format that this library writes.
pub const VERSION: u32 = 1;

/// An axis of a file's space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Axis {
    /// The second coordinate.
    Y,
    /// The third.
    Z,
}

/// The contents of a scene file: plans that share materials.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename = "Scene", deny_unknown_fields, default)]
pub struct Document {
    /// The version of the format.
    pub version: u32,
    /// Values that a text's own expressions and references know by name, as they were when it was read.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, AnyValue>,
    /// Materials by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub materials: BTreeMap<String, Material>,
    /// The plans, in order.
    pub plans: Vec<Plan>,
    /// The plan to use if none is named and there are several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub default_plan: Option<String>,
    /// The moment that it was read at, if that was said: scenes that it names are read at the same.
    #[serde(skip)]
    pub moment: Option<Moment>,
}

impl Default for Document {
    fn default() -> Document {
        Document {
            version: VERSION,
            parameters: BTreeMap::new(),
            materials: BTreeMap::new(),
            plans: Vec::new(),
            default_plan: None,
            moment: None,
        }
    }
}

impl Document {
    /// A document with one plan.
    pub fn with_plan(plan: Plan) -> Document {
        Document { plans: vec![plan], ..Document::default() }
    }

    /// The plan called `name`. Without a name, the default plan, or the only one.
    ///
    /// # Errors
    /// If there is no such plan, or if there are several and none is the default. The message lists
    /// them.
    pub fn plan(&self, name: Option<&str>) -> Result<&Plan> {
        let names = || {
            let names: Vec<String> = self.plans.iter().map(|p| format!("\"{}\"", p.name)).collect();
            names.join(", ")
        };
        match (name.or(self.default_plan.as_deref()), &self.plans[..]) {
            (None, [only]) => Ok(only),
            (None, []) => Err(Error::invalid("the scene has no plan")),
            (None, _) => {
                Err(Error::invalid(format!("the scene has several plans: name one of {}", names())))
            }
            (Some(name), plans) => plans.iter().find(|plan| plan.name == name).ok_or_else(|| {
                Error::invalid(format!("the scene has no plan \"{name}\": it has {}", names()))
            }),
        }
    }

    /// Checks that names are unique: those of plans, and those of an object's children. Names of
    /// objects must not contain a slash.
    ///
    /// # Errors
    /// If a name is used twice, or contains a slash.
    pub fn check_names(&self) -> Result<()> {
        let mut plans = HashSet::new();
        for plan in &self.plans {
            if !plans.insert(plan.name.as_str()) {
                return Err(Error::invalid(format!("two plans are called \"{}\"", plan.name)));
            }
            plan.root.check_names()?;
            plan.definitions.values().try_for_each(Object::check_names)?;
        }
        Ok(())
    }

    /// The plan called `name`, to change it.
    pub fn plan_mut(&mut self, name: &str) -> Option<&mut Plan> {
        self.plans.iter_mut().find(|plan| plan.name == name)
    }
}

/// The largest entity: a project. Its root object moves everything in it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Plan {
    /// The plan's name.
    pub name: String,
    /// Cameras by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub cameras: BTreeMap<String, Camera>,
    /// Lights by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub lights: BTreeMap<String, LightEntry>,
    /// The environment, if the file has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub environment: Option<Environment>,
    /// Objects that [`Shape::Instance`] places any number of times; not seen themselves.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub definitions: BTreeMap<String, Object>,
    /// The root of all objects. Its name is not part of paths.
    pub root: Object,
}

impl Plan {
    /// An object by its path, such as `"house/roof"`. The empty path is the root.
    pub fn object(&self, path: &str) -> Option<&Object> {
        let mut names = path.split('/').filter(|name| !name.is_empty());
        names.try_fold(&self.root, |at, name| at.children.iter().find(|child| child.name == name))
    }

    /// An object by its path, to change it.
    pub fn object_mut(&mut self, path: &str) -> Option<&mut Object> {
        let mut names = path.split('/').filter(|name| !name.is_empty());
        names.try_fold(&mut self.root, |at, name| {
            at.children.iter_mut().find(|child| child.name == name)
        })
    }

    /// Adds an object under the one at `parent`. The root is `""`.
    ///
    /// # Errors
    /// If there is no such parent, if it has a child of that name, or if the name contains a `/`.
    pub fn add(&mut self, parent: &str, object: Object) -> Result<()> {
        if object.name.contains('/') {
            return Err(Error::invalid(format!("the object name \"{}\" has a slash", object.name)));
        }
        let at = self
            .object_mut(parent)
            .ok_or_else(|| Error::invalid(format!("there is no object \"{parent}\" to add to")))?;
        if at.children.iter().any(|child| child.name == object.name) {
            let name = &object.name;
            return Err(Error::invalid(format!("\"{parent}\" has a child \"{name}\" already")));
        }
        at.children.push(object);
        Ok(())
    }

    /// Removes the object at `path` with everything under it, and returns it. The root cannot be
    /// removed.
    pub fn remove(&mut self, path: &str) -> Option<Object> {
        let path = path.trim_matches('/');
        let (parent, name) = path.rsplit_once('/').unwrap_or(("", path));
        let parent = self.object_mut(parent)?;
        let at = parent.children.iter().position(|child| child.name == name)?;
        Some(parent.children.remove(at))
    }
}

/// A unit under a plan: faces with a place of their own, and objects under it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Object {
    /// The object's name, unique among its parent's children and without `/`.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// From its space to its parent's.
    #[serde(skip_serializing_if = "is_default")]
    pub transform: Transform,
    /// Which parts of it are seen. Children show no more than their parent. Under a hidden object
    /// everything is hidden; under one that shows faces only, no seal is seen.
    #[serde(skip_serializing_if = "is_default")]
    pub display: Display,
    /// The user's own data.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub user: BTreeMap<String, String>,
    /// The material of faces that name none. If absent, the parent's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Its faces.
    #[serde(skip_serializing_if = "is_default")]
    pub shape: Shape,
    /// The objects under it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub children: Vec<Object>,
}

impl Object {
    /// An object with a shape.
    pub fn new(name: impl Into<String>, shape: Shape) -> Object {
        Object { name: name.into(), shape, ..Object::default() }
    }

    /// The same object somewhere else.
    #[must_use]
    pub fn moved(mut self, by: impl Into<DVec3>) -> Object {
        let DVec3 { x, y, z } = by.into();
        self.transform.0.push(Step::Move(x, y, z));
        self
    }

    /// The same object with another material.
    #[must_use]
    pub fn of(mut self, material: impl Into<String>) -> Object {
        self.material = Some(material.into());
        self
    }

    fn check_names(&self) -> Result<()> {
        let mut names = HashSet::new();
        for child in &self.children {
            let name = child.name.as_str();
            if name.contains('/') {
                return Err(Error::invalid(format!("the object name \"{name}\" has a slash")));
            }
            if !name.is_empty() && !names.insert(name) {
                let of = &self.name;
                return Err(Error::invalid(format!(
                    "two objects in \"{of}\" are called \"{name}\""
                )));
            }
            child.check_names()?;
        }
        Ok(())
    }

    /// The object's faces, to change them. A primitive becomes a list of faces first.
    ///
    /// # Errors
    /// If the shape has no faces of its own (an instance, an array, a file), or if a primitive's
    /// parameters are wrong.
    pub fn faces_mut(&mut self) -> Result<&mut Mesh> {
        if !matches!(self.shape, Shape::Faces(_)) {
            self.shape = Shape::Faces(self.shape.mesh()?);
        }
        match &mut self.shape {
            Shape::Faces(mesh) => Ok(mesh),
            _ => Err(Error::invalid("an instance, array or file has no faces of its own")),
        }
    }
}

/// Which parts of an object are seen. A greater state shows more.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub enum Display {
    /// Nothing.
    Hidden,
    /// Faces without their seals.
    FacesOnly,
    /// Faces and seals.
    #[default]
    FacesAndSeals,
}

/// A transform as a person writes it: steps, the first applied first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Transform(pub Vec<Step>);

/// A step of a transform. Lengths are in metres. Angles are in degrees, counter-clockwise seen from
/// the tip of the axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Step {
    /// Moves along x, y, z.
    Move(f64, f64, f64),
    /// Turns about the x axis.
    TurnX(f64),
    /// Turns about the y axis, the vertical.
    TurnY(f64),
    /// Turns about the z axis.
    TurnZ(f64),
    /// Scales equally in all directions.
    Scale(f64),
    /// Scales along x, y, z; negative factors mirror.
    Stretch(f64, f64, f64),
    /// Any affine transform: the images of the x, y and z axes, and of the origin.
    Matrix([f64; 3], [f64; 3], [f64; 3], [f64; 3]),
}

impl Transform {
    /// A transform from its matrix.
    pub fn from_matrix(matrix: DAffine3) -> Transform {
        if matrix == DAffine3::IDENTITY {
            return Transform::default();
        }
        let DMat3 { x_axis, y_axis, z_axis } = matrix.matrix3;
        let [x, y, z, origin] = [x_axis, y_axis, z_axis, matrix.translation].map(|v| v.to_array());
        Transform(vec![Step::Matrix(x, y, z, origin)])
    }

    /// The transform as a matrix.
    pub fn to_matrix(&self) -> DAffine3 {
        self.0.iter().fold(DAffine3::IDENTITY, |all, step| step.to_matrix() * all)
    }
}

impl Step {
    fn to_matrix(self) -> DAffine3 {
        let turn = |degrees: f64, u: usize, v: usize| {
            // Whole quarter turns are exact, so that turned walls stay on their grid.
            let quarters = degrees / 90.0;
            let (sin, cos) = match quarters.rem_euclid(4.0) {
                0.0 => (0.0, 1.0),
                1.0 => (1.0, 0.0),
                2.0 => (0.0, -1.0),
                3.0 => (-1.0, 0.0),
                _ => (math::sin(degrees.to_radians()), math::cos(degrees.to_radians())),
            };
            let mut columns = DMat3::IDENTITY.to_cols_array_2d();
            columns[u][u] = cos;
            columns[u][v] = sin;
            columns[v][u] = -sin;
            columns[v][v] = cos;
            DAffine3::from_mat3(DMat3::from_cols_array_2d(&columns))
        };
        match self {
            Step::Move(x, y, z) => DAffine3::from_translation(DVec3::new(x, y, z)),
            Step::TurnX(degrees) => turn(degrees, 1, 2),
            Step::TurnY(degrees) => turn(degrees, 2, 0),
            Step::TurnZ(degrees) => turn(degrees, 0, 1),
            Step::Scale(k) => DAffine3::from_scale(DVec3::splat(k)),
            Step::Stretch(x, y, z) => DAffine3::from_scale(DVec3::new(x, y, z)),
            Step::Matrix(x, y, z, origin) => DAffine3 {
                matrix3: DMat3::from_cols(x.into(), y.into(), z.into()),
                translation: origin.into(),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_apply_in_the_order_written() {
        let transform =
            Transform(vec![Step::Move(1.0, 0.0, 0.0), Step::TurnY(90.0), Step::Scale(2.0)]);
        let moved = transform.to_matrix().transform_point3(DVec3::ZERO);
        assert_eq!(moved, DVec3::new(0.0, 0.0, -2.0));
    }

    #[test]
    fn turns_are_counter_clockwise_from_the_tip_of_the_axis() {
        let at = |step: Step, p: DVec3| step.to_matrix().transform_point3(p);
        assert_eq!(at(Step::TurnX(90.0), DVec3::Y), DVec3::Z);
        assert_eq!(at(Step::TurnY(90.0), DVec3::Z), DVec3::X);
        assert_eq!(at(Step::TurnZ(90.0), DVec3::X), DVec3::Y);
        assert!(
            (at(Step::TurnZ(45.0), DVec3::X) - at(Step::TurnZ(-315.0), DVec3::X)).length() < 1e-15
        );
    }

    #[test]
    fn objects_are_found_added_and_removed_by_path() {
        let mut plan = Plan::default();
        plan.add("", Object::new("house", Shape::Group)).unwrap();
        plan.add("house", Object::new("roof", Shape::Group)).unwrap();
        assert!(plan.object("house/roof").is_some());
        assert!(plan.add("house", Object::new("roof", Shape::Group)).is_err());
        assert!(plan.add("barn", Object::default()).is_err());
        assert_eq!(plan.remove("house/roof").unwrap().name, "roof");
        assert!(plan.object("house/roof").is_none());
        assert!(plan.remove("").is_none());
    }

    #[test]
    fn a_plan_must_be_named_where_there_are_several() {
        let plan = |name: &str| Plan { name: name.into(), ..Plan::default() };
        let mut document = Document::with_plan(plan("a"));
        assert_eq!(document.plan(None).unwrap().name, "a");
        document.plans.push(plan("b"));
        let message = document.plan(None).unwrap_err().to_string();
        assert!(message.contains("\"a\", \"b\""), "{message}");
        document.default_plan = Some("b".into());
        assert_eq!(document.plan(None).unwrap().name, "b");
        assert_eq!(document.plan(Some("a")).unwrap().name, "a");
    }
}
