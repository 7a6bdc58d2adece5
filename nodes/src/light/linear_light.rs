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
pub struct LinearLight(list::LinearLight);

impl JsonSchema for LinearLight {
    fn schema_name() -> Cow<'static, str> {
        list::LinearLight::schema_name()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        list::LinearLight::json_schema(generator)
    }
}

impl Node for LinearLight {
    type Output = Lamps;
    const KIND: &'static str = "LinearLight";
    const GROUP: &'static str = "light";
    const ALIASES: &'static [&'static str] = &["LineLight", "TubeLight", "FluorescentLight"];

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
