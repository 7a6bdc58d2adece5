//! Nodes: one struct each. Links and parameters are its fields, typed, documented, with defaults; serde
//! parses it, its documentation is the manual, its schema says links, files and ranges.

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use super::demand::Upstream;
use super::evaluate::Inputs;
use super::value::{AnyDemand, AnyValue, Value};
use crate::error::Result;

/// A kind of node.
///
/// ```
/// use schemars::JsonSchema;
/// use serde::{Deserialize, Serialize};
/// use spandrel_engine::graph::{Inputs, Link, Node, Upstream, Value};
/// # use spandrel_engine::Result;
/// # pub struct Number(f64);
/// # impl Value for Number {
/// #     type Demand = ();
/// #     const NAME: &'static str = "Number";
/// #     fn bytes(&self) -> usize { 8 }
/// # }
///
/// /// Doubles a number.
/// #[derive(Serialize, Deserialize, JsonSchema, Default)]
/// #[serde(deny_unknown_fields, default)]
/// pub struct Double {
///     /// The number.
///     pub of: Link<Number>,
/// }
///
/// impl Node for Double {
///     type Output = Number;
///     const KIND: &'static str = "Double";
///     const GROUP: &'static str = "arithmetic";
///
///     fn demand(&self, (): &(), upstream: &mut Upstream<'_>) -> Result<()> {
///         upstream.ask(&self.of, ());
///         Ok(())
///     }
///
///     fn evaluate(&self, (): &(), inputs: &Inputs<'_>) -> Result<Number> {
///         Ok(Number(inputs.get(&self.of).0 * 2.0))
///     }
/// }
/// ```
pub trait Node:
    Serialize + DeserializeOwned + JsonSchema + Default + Send + Sync + 'static
{
    /// What it makes.
    type Output: Value;

    /// Its name in graphs.
    const KIND: &'static str;

    /// The group of the catalogue that it stands in.
    const GROUP: &'static str;

    /// Names under which people who come from other programs look for it.
    const ALIASES: &'static [&'static str] = &[];

    /// Checks what types and ranges do not say.
    ///
    /// # Errors
    /// The field's name and what is wrong with it.
    fn check(&self) -> std::result::Result<(), FieldError> {
        Ok(())
    }

    /// Asks of its inputs what it needs to deliver what is wanted. An input that is not asked for is
    /// not computed.
    ///
    /// # Errors
    /// If what is wanted cannot be delivered.
    fn demand(&self, wanted: &Wanted<Self>, upstream: &mut Upstream<'_>) -> Result<()>;

    /// Makes what is wanted from what was asked for.
    ///
    /// # Errors
    /// If it cannot be made.
    fn evaluate(&self, wanted: &Wanted<Self>, inputs: &Inputs<'_>) -> Result<Self::Output>;

    /// The input that this node returns unchanged, if its parameters make it do nothing: the input's
    /// value and key then are its own.
    fn passes(&self) -> Option<&Link<Self::Output>> {
        None
    }
}

/// The demand of a node's output.
pub type Wanted<N> = <<N as Node>::Output as Value>::Demand;

/// What is wrong with a field of a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FieldError {
    /// The field's name.
    pub field: &'static str,
    /// What is wrong, and the cure.
    pub message: String,
    /// The byte of its text where it is wrong, if it is a text and that is known.
    pub at: Option<usize>,
}

impl FieldError {
    /// A fault of a field.
    pub fn new(field: &'static str, message: impl Into<String>) -> FieldError {
        FieldError { field, message: message.into(), at: None }
    }

    /// A fault at a byte of a field's text.
    #[must_use]
    pub fn at(self, byte: usize) -> FieldError {
        FieldError { at: Some(byte), ..self }
    }
}

/// A link to the node that makes a `T`: in graphs, the node's name, or the path of a file that
/// [can be read](Value::READER) as such a value.
pub struct Link<T> {
    target: String,
    of: PhantomData<fn() -> T>,
}

impl<T> Link<T> {
    /// A link to a node, or a file.
    pub fn to(target: impl Into<String>) -> Link<T> {
        Link { target: target.into(), of: PhantomData }
    }

    /// The name of the node, or the path of the file; empty if the link is not given.
    pub fn target(&self) -> &str {
        &self.target
    }
}

impl<T> Default for Link<T> {
    fn default() -> Link<T> {
        Link::to("")
    }
}

impl<T> Clone for Link<T> {
    fn clone(&self) -> Link<T> {
        Link::to(self.target.clone())
    }
}

impl<T> std::fmt::Debug for Link<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.target)
    }
}

impl<T> PartialEq for Link<T> {
    fn eq(&self, other: &Link<T>) -> bool {
        self.target == other.target
    }
}

impl<T> Serialize for Link<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.target.serialize(serializer)
    }
}

impl<'de, T> Deserialize<'de> for Link<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Link<T>, D::Error> {
        String::deserialize(deserializer).map(Link::to)
    }
}

/// The schema's mark of a link: the name of the type that it leads to.
pub(super) const LINK: &str = "x-link";
/// The schema's mark of a file: `"read"` or `"write"`.
pub(super) const FILE: &str = "x-file";

impl<T: Value> JsonSchema for Link<T> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("Link of {}", T::NAME).into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", LINK: T::NAME, "x-reader": T::READER })
    }
}

/// A file that a node reads; relative to the graph's file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct InFile(pub String);

/// A file that a node writes; relative to the graph's file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct OutFile(pub String);

impl InFile {
    /// The file's path.
    pub fn resolve(&self, inputs: &Inputs<'_>) -> PathBuf {
        inputs.directory().join(&self.0)
    }
}

impl OutFile {
    /// The file's path.
    pub fn resolve(&self, inputs: &Inputs<'_>) -> PathBuf {
        inputs.directory().join(&self.0)
    }
}

impl JsonSchema for InFile {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "file".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", FILE: "read" })
    }
}

impl JsonSchema for OutFile {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "file to write".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", FILE: "write" })
    }
}

/// A node of any kind, in a graph.
pub(super) trait AnyNode: Send + Sync {
    fn check(&self) -> std::result::Result<(), FieldError>;
    fn parameters(&self) -> serde_json::Value;
    fn demand(&self, wanted: &dyn AnyDemand, upstream: &mut Upstream<'_>) -> Result<()>;
    fn evaluate(&self, wanted: &dyn AnyDemand, inputs: &Inputs<'_>) -> Result<AnyValue>;
    fn passes(&self) -> Option<String>;
}

impl<N: Node> AnyNode for N {
    fn check(&self) -> std::result::Result<(), FieldError> {
        Node::check(self)
    }

    fn parameters(&self) -> serde_json::Value {
        serde_json::to_value(self).unwrap_or_default()
    }

    fn demand(&self, wanted: &dyn AnyDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        Node::demand(self, typed::<N>(wanted), upstream)
    }

    fn evaluate(&self, wanted: &dyn AnyDemand, inputs: &Inputs<'_>) -> Result<AnyValue> {
        Node::evaluate(self, typed::<N>(wanted), inputs).map(AnyValue::new)
    }

    fn passes(&self) -> Option<String> {
        Node::passes(self).map(|link| link.target.clone())
    }
}

fn typed<N: Node>(wanted: &dyn AnyDemand) -> &Wanted<N> {
    wanted.as_any().downcast_ref().expect("demands are made by the type of the link")
}

/// Whether a link's target is a file and not a node: it has a dot or a slash.
pub(super) fn is_file(target: &str) -> bool {
    Path::new(target).extension().is_some() || target.contains(['/', '\\'])
}
