//! Lights as scenes: what can be seen of them.

use std::path::Path;
use std::sync::Arc;

use super::document::{Document, Object, Plan};
use super::face::{Back, Face, Outline, Sides};
use super::flat::Scene;
use super::library::{Library, NoFiles};
use super::material::Material;
use super::mesh::Mesh;
use super::shape::Shape;
use crate::color::Color;
use crate::error::{Error, Result};
use crate::fragment::Finish;
use crate::key::Key;
use crate::light::Lamp;
use crate::light::polygon::Polygon;

impl Scene {
    /// The faces of lights, glowing with their luminance while they are on; an object for each. Tubes have
    /// a radius in metres.
    ///
    /// # Errors
    /// If a light has no extent, or the radius is not above 0.
    pub fn of_lamps(label: &str, lamps: &[Lamp], radius: f64) -> Result<Scene> {
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(Error::invalid(format!("tubes of radius {radius} m: must be above 0")));
        }
        let mut document = Document::default();
        let dark = Material { color: Color::BLACK, ..Material::default() };
        document.materials.insert("off".to_owned(), dark.clone());
        let mut root = Object::default();
        for (at, lamp) in lamps.iter().enumerate() {
            let body = lamp.light.body(radius).ok_or_else(|| {
                let name = &lamp.name;
                Error::invalid(format!("the light \"{name}\" has no extent that could be seen"))
            })?;
            let material = format!("light {at}");
            let glow = if lamp.on { lamp.strength * body.luminance as f32 } else { Color::BLACK };
            let finish = Finish { glow, is_lamp: true, ..Finish::default() };
            // A tube's light comes from its axis.
            let casts = body.casts;
            document.materials.insert(material.clone(), Material { finish, casts, ..dark.clone() });
            let mut mesh = Mesh { materials: vec![material, "off".to_owned()], ..Mesh::default() };
            let back = if body.two_sided { Back::Same } else { Back::Material(1) };
            for Polygon { outline, holes } in &body.polygons {
                let mut ring = |points: &[glam::DVec3]| -> Outline {
                    points.iter().map(|point| mesh.add_point(*point)).collect()
                };
                let outline = ring(outline);
                let holes = holes.iter().map(|hole| ring(hole)).collect();
                let sides = Sides { front: Some(0), back };
                mesh.add_face(Face { outline, holes, sides, ..Face::default() })?;
            }
            let name = match lamp.name.as_str() {
                "" => format!("light {at}"),
                name => name.replace('/', " "),
            };
            root.children.push(Object::new(name, Shape::Faces(mesh)));
        }
        document.plans.push(Plan { root, ..Plan::default() });
        let key = Key::of(&document);
        let library: Arc<dyn Library> = Arc::new(NoFiles);
        Scene::with_library(&document, None, label, key, (Path::new(""), &library))
    }
}
