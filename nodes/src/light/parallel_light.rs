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
pub struct ParallelLight(list::ParallelLight);

impl JsonSchema for ParallelLight {
    fn schema_name() -> Cow<'static, str> {
        list::ParallelLight::schema_name()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        list::ParallelLight::json_schema(generator)
    }
}

impl Node for ParallelLight {
    type Output = Lamps;
    const KIND: &'static str = "ParallelLight";
    const GROUP: &'static str = "light";
    const ALIASES: &'static [&'static str] = &["DirectLight", "DirectionalLight", "DistantLight"];

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
