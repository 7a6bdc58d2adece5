//! The lights of a scene's list as nodes (\[N], "Shading effects due to various types of light
//! sources"; \[D], "Rendering condition data structure").

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use spandrel_engine::Result;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::light::list::{self, LightFault, MakeLamp};
use spandrel_engine::trace::Toward;
use spandrel_engine::values::Lamps;
use std::borrow::Cow;

/// A light of a scene's list, as a node. Its fields and their documentation are the light's own.
#[derive(Default)]
pub struct Listed<L> {
    light: L,
    /// The sun that it follows, if it follows one: its text says where it is.
    sun: Link<Lamps>,
}

impl<L: ListedLight> From<L> for Listed<L> {
    fn from(light: L) -> Listed<L> {
        let sun = Link::to(light.follows().unwrap_or_default());
        Listed { light, sun }
    }
}

impl<L: ListedLight> Serialize for Listed<L> {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        self.light.serialize(serializer)
    }
}

impl<'de, L: ListedLight> Deserialize<'de> for Listed<L> {
    fn deserialize<D: Deserializer<'de>>(reader: D) -> std::result::Result<Self, D::Error> {
        L::deserialize(reader).map(Listed::from)
    }
}

/// A light that can stand in a scene's list.
pub trait ListedLight:
    MakeLamp + Serialize + DeserializeOwned + JsonSchema + Default + Clone + Send + Sync + 'static
{
    /// Its name in graphs.
    const KIND: &'static str;
    /// Its names in other programs.
    const ALIASES: &'static [&'static str];
}

impl ListedLight for list::ParallelLight {
    const KIND: &'static str = "ParallelLight";
    const ALIASES: &'static [&'static str] = &["DirectLight", "DirectionalLight", "DistantLight"];
}

impl ListedLight for list::SunLight {
    const KIND: &'static str = "SunLight";
    const ALIASES: &'static [&'static str] = &["Sun", "Daylight", "SunSky"];
}

impl ListedLight for list::PointLight {
    const KIND: &'static str = "PointLight";
    const ALIASES: &'static [&'static str] =
        &["OmniLight", "Light", "IesLight", "PhotometricLight"];
}

impl ListedLight for list::SpotLight {
    const KIND: &'static str = "SpotLight";
    const ALIASES: &'static [&'static str] = &["Spotlight", "ConeLight"];
}

impl ListedLight for list::LinearLight {
    const KIND: &'static str = "LinearLight";
    const ALIASES: &'static [&'static str] = &["LineLight", "TubeLight", "FluorescentLight"];
}

impl ListedLight for list::AreaLight {
    const KIND: &'static str = "AreaLight";
    const ALIASES: &'static [&'static str] =
        &["RectLight", "QuadLight", "WindowLight", "PortalLight"];
}

impl ListedLight for list::PolyhedralLight {
    const KIND: &'static str = "PolyhedralLight";
    const ALIASES: &'static [&'static str] = &["MeshLight", "GeometryLight", "LanternLight"];
}

impl ListedLight for list::SkyLight {
    const KIND: &'static str = "SkyLight";
    const ALIASES: &'static [&'static str] = &["DomeLight", "Skydome", "HemisphereLight"];
}

impl ListedLight for list::AmbientLight {
    const KIND: &'static str = "AmbientLight";
    const ALIASES: &'static [&'static str] = &["Ambient", "ConstantLight"];
}

impl<L: ListedLight> JsonSchema for Listed<L> {
    fn schema_name() -> Cow<'static, str> {
        L::schema_name()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        L::json_schema(generator)
    }
}

impl<L: ListedLight> Node for Listed<L> {
    type Output = Lamps;
    const KIND: &'static str = L::KIND;
    const GROUP: &'static str = "light";
    const ALIASES: &'static [&'static str] = L::ALIASES;

    fn check(&self) -> std::result::Result<(), FieldError> {
        Lamps::check(&self.light)
    }

    fn demand(&self, (): &(), upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.sun, ());
        Ok(())
    }

    fn evaluate(&self, (): &(), inputs: &Inputs<'_>) -> Result<Lamps> {
        let Some(name) = self.light.follows() else { return Lamps::one(&self.light, inputs) };
        let lamps = inputs.get(&self.sun);
        let sun = lamps.0.iter().find_map(|lamp| match lamp.light.toward()? {
            Toward::Direction(sun) => Some(sun),
            Toward::Point(_) => None,
        });
        let mut light = self.light.clone();
        light.follow(sun.ok_or_else(|| LightFault::no_sun(name))?);
        Lamps::one(&light, inputs)
    }
}
