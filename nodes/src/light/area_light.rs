use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Node, Upstream};
use spandrel_engine::light::list;
use spandrel_engine::values::Lamps;
use std::borrow::Cow;

/// The light as scenes list it.
#[derive(Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct AreaLight(list::AreaLight);

impl JsonSchema for AreaLight {
    fn schema_name() -> Cow<'static, str> {
        list::AreaLight::schema_name()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        list::AreaLight::json_schema(generator)
    }
}

impl Node for AreaLight {
    type Output = Lamps;
    const KIND: &'static str = "AreaLight";
    const GROUP: &'static str = "light";
    const ALIASES: &'static [&'static str] =
        &["RectLight", "QuadLight", "WindowLight", "PortalLight"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        Lamps::check(&self.0)
    }

    fn demand(&self, (): &(), _: &mut Upstream<'_>) -> Result<()> {
        Ok(())
    }

    fn evaluate(&self, (): &(), inputs: &Inputs<'_>) -> Result<Lamps> {
        Lamps::one(&self.0, inputs)
    }
}
