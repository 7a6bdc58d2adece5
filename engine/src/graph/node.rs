//! Nodes: one struct each. Links and parameters are its fields, typed, documented, with defaults; serde
//! parses it, its documentation is the manual, its schema says links, files and ranges.

use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::borrow::Cow;
use std::path::Path;

use super::ask::{Inputs, Upstream};
use super::link::{Link, Slot};
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

    /// Whether what it makes is stored where results are kept on disk: if it takes longer to make than to read.
    const STORED: bool = false;

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

    /// Whether what it makes is another at another moment though its fields are the same: what it reads moves, as seen
    /// from the folder of the graph. [`Inputs::moment`] then says which it is.
    fn moves(&self, _directory: &Path) -> bool {
        false
    }

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
    pub field: Cow<'static, str>,
    /// What is wrong, and the cure.
    pub message: String,
    /// The byte of its text where it is wrong, if it is a text and that is known.
    pub at: Option<usize>,
}

impl FieldError {
    /// A fault of a field.
    pub fn new(field: impl Into<Cow<'static, str>>, message: impl Into<String>) -> FieldError {
        FieldError { field: field.into(), message: message.into(), at: None }
    }

    /// A fault at a byte of a field's text.
    #[must_use]
    pub fn at(self, byte: usize) -> FieldError {
        FieldError { at: Some(byte), ..self }
    }
}

/// A node of any kind, in a graph.
pub(super) trait AnyNode: Send + Sync {
    fn check(&self) -> std::result::Result<(), FieldError>;
    fn parameters(&self) -> serde_json::Value;
    fn demand(&self, wanted: &dyn AnyDemand, upstream: &mut Upstream<'_>) -> Result<()>;
    fn evaluate(&self, wanted: &dyn AnyDemand, inputs: &Inputs<'_>) -> Result<AnyValue>;
    fn passes(&self) -> Option<(&str, Slot)>;
    fn moves(&self, directory: &Path) -> bool;
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

    fn passes(&self) -> Option<(&str, Slot)> {
        Node::passes(self).map(|link| (link.target(), link.slot()))
    }

    fn moves(&self, directory: &Path) -> bool {
        Node::moves(self, directory)
    }
}

fn typed<N: Node>(wanted: &dyn AnyDemand) -> &Wanted<N> {
    wanted.as_any().downcast_ref().expect("demands are made by the type of the link")
}
