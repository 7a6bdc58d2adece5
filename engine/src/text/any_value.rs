//! Values of any type, as text.

use ron::value::RawValue;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A value of any type, as a file has it: whoever takes it reads its text.
///
/// ```
/// use spandrel_engine::text::AnyValue;
///
/// assert_eq!(AnyValue::read("[TurnY(30)]").unwrap().text(), "[TurnY(30)]");
/// assert!(AnyValue::read("(1, 2").is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct AnyValue(Box<RawValue>);

impl AnyValue {
    /// A value from its text.
    ///
    /// # Errors
    /// If the text is not one value.
    pub fn read(text: &str) -> Result<AnyValue, String> {
        let value = RawValue::from_boxed_ron(text.trim().into());
        value.map(AnyValue).map_err(|error| error.code.to_string())
    }

    /// Its text.
    pub fn text(&self) -> &str {
        self.0.get_ron().trim()
    }
}

impl JsonSchema for AnyValue {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "AnyValue".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "x-what": "any value" })
    }
}
