//! What a CityJSON file says, as it says it.

use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, Visitor};
use serde_json::Value;
use std::fmt;

use super::levels::Level;
use crate::error::{Error, Result};

/// A city, or a feature of one.
#[derive(Default, Deserialize)]
pub(in crate::scene::read) struct City {
    #[serde(rename = "type")]
    pub(super) kind: String,
    #[serde(default)]
    pub(super) version: String,
    #[serde(default)]
    pub(super) metadata: Value,
    /// The feature's name.
    #[serde(default)]
    pub(super) id: String,
    #[serde(default, rename = "CityObjects")]
    pub(in crate::scene::read) objects: Objects,
    #[serde(default)]
    pub(in crate::scene::read) vertices: Vec<[f64; 3]>,
    pub(super) transform: Option<Placement>,
    #[serde(default)]
    pub(in crate::scene::read) appearance: Appearance,
    #[serde(rename = "geometry-templates")]
    pub(super) templates: Option<Templates>,
}

impl City {
    /// A city in one piece.
    pub(in crate::scene::read) fn new(
        objects: Vec<(String, Value)>,
        vertices: Vec<[f64; 3]>,
        appearance: Appearance,
    ) -> City {
        City { objects: Objects(objects), vertices, appearance, ..City::default() }
    }
}

/// City objects by name, in order; of several that have one name, all.
#[derive(Default)]
pub(in crate::scene::read) struct Objects(pub(in crate::scene::read) Vec<(String, Value)>);

impl<'de> Deserialize<'de> for Objects {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Objects, D::Error> {
        struct All;
        impl<'de> Visitor<'de> for All {
            type Value = Objects;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("city objects by name")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Objects, A::Error> {
                let mut objects = Vec::new();
                while let Some(object) = map.next_entry()? {
                    objects.push(object);
                }
                Ok(Objects(objects))
            }
        }
        deserializer.deserialize_map(All)
    }
}

#[derive(Deserialize)]
pub(super) struct Placement {
    pub(super) scale: [f64; 3],
    pub(super) translate: [f64; 3],
}

#[derive(Default, Deserialize)]
pub(in crate::scene::read) struct Appearance {
    #[serde(default)]
    pub(in crate::scene::read) materials: Vec<CityMaterial>,
    #[serde(default)]
    pub(in crate::scene::read) textures: Vec<CityTexture>,
    #[serde(default, rename = "vertices-texture", alias = "vertex-texture")]
    pub(in crate::scene::read) places: Vec<[f32; 2]>,
}

#[derive(Deserialize)]
pub(in crate::scene::read) struct CityTexture {
    pub(in crate::scene::read) image: String,
    #[serde(rename = "wrapMode")]
    pub(in crate::scene::read) wrap: Option<String>,
}

#[derive(Deserialize)]
pub(in crate::scene::read) struct CityMaterial {
    pub(in crate::scene::read) name: Option<String>,
    #[serde(rename = "diffuseColor")]
    pub(in crate::scene::read) diffuse: Option<[f32; 3]>,
    pub(in crate::scene::read) transparency: Option<f32>,
}

#[derive(Deserialize)]
pub(super) struct Templates {
    pub(super) templates: Vec<CityGeometry>,
    #[serde(rename = "vertices-templates")]
    pub(super) vertices: Vec<[f64; 3]>,
}

#[derive(Deserialize)]
pub(super) struct CityObject {
    #[serde(rename = "type")]
    pub(super) kind: String,
    #[serde(default)]
    pub(super) geometry: Vec<CityGeometry>,
    #[serde(default)]
    pub(super) children: Vec<String>,
    #[serde(default)]
    pub(super) parents: Vec<String>,
    #[serde(default)]
    pub(super) attributes: serde_json::Map<String, Value>,
}

#[derive(Clone, Deserialize)]
pub(super) struct CityGeometry {
    #[serde(rename = "type")]
    pub(super) kind: String,
    #[serde(default)]
    pub(super) lod: Value,
    #[serde(default)]
    pub(super) boundaries: Value,
    #[serde(default)]
    pub(super) semantics: Value,
    #[serde(default)]
    pub(super) material: Value,
    #[serde(default)]
    pub(super) texture: Value,
    pub(super) template: Option<usize>,
    #[serde(rename = "transformationMatrix")]
    pub(super) matrix: Option<[f64; 16]>,
}

impl CityGeometry {
    /// How deep its surfaces lie in its boundaries; `None` if it has none.
    pub(super) fn depth(&self) -> Result<Option<usize>> {
        match self.kind.as_str() {
            "MultiSurface" | "CompositeSurface" => Ok(Some(0)),
            "Solid" => Ok(Some(1)),
            "MultiSolid" | "CompositeSolid" => Ok(Some(2)),
            "MultiPoint" | "MultiLineString" => Ok(None),
            kind => Err(Error::invalid(format!("a geometry of type \"{kind}\""))),
        }
    }

    pub(super) fn level(&self) -> Option<Level> {
        let number = match &self.lod {
            Value::Number(number) => number.as_f64(),
            Value::String(text) => text.trim().parse().ok(),
            _ => None,
        };
        number.filter(|number: &f64| number.is_finite()).map(Level::of)
    }
}
