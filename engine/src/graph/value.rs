//! Values: what flows between nodes, and what can be asked of it.

use serde::Serialize;
use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

use crate::cache::{Cache, InUse};
use crate::key::Key;

/// A type that flows between nodes.
pub trait Value: Any + Send + Sync {
    /// What a consumer asks of such a value, such as a size and the rows that it needs; `()` if there
    /// is nothing to ask.
    type Demand: Demand;

    /// The type's name in messages and in the catalogue.
    const NAME: &'static str;

    /// The kind of node that reads such a value from a file, by its field `file`: a link that names a
    /// file instead of a node stands for such a node.
    const READER: Option<&'static str> = None;

    /// The value's contents, if they are cheap to name. Nodes downstream are evaluated anew only if
    /// they change; without, if the node that made the value changes.
    fn key(&self) -> Option<Key> {
        None
    }

    /// Bytes held.
    fn bytes(&self) -> usize;

    /// The value as bytes, exactly, for nodes [that are stored](super::Node::STORED); `None` if this one cannot be.
    fn packed(&self) -> Option<Vec<u8>> {
        None
    }

    /// The value of bytes that [`packed`](Value::packed) made; `None` if they are none.
    fn unpacked(_bytes: &[u8]) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

    /// What a person wants to know of it, such as `("spans", 81234)`.
    fn facts(&self) -> Vec<(&'static str, u64)> {
        Vec::new()
    }
}

/// What is asked of a value.
pub trait Demand: Clone + Debug + PartialEq + Serialize + Send + Sync + 'static {
    /// Widens this demand so that it covers `other` too, if one value can serve both; otherwise leaves
    /// it and returns false. Widening must not depend on the order of demands.
    fn cover(&mut self, other: &Self) -> bool;
}

impl Demand for () {
    fn cover(&mut self, (): &()) -> bool {
        true
    }
}

/// A value of any type.
#[derive(Clone)]
pub(super) struct AnyValue {
    value: Arc<dyn Any + Send + Sync>,
    pub(super) key: Option<Key>,
    pub(super) bytes: usize,
    pub(super) facts: Vec<(&'static str, u64)>,
    /// Counts its bytes as long as somebody uses it.
    _in_use: Option<Arc<InUse>>,
}

impl AnyValue {
    pub(super) fn new<T: Value>(value: T) -> AnyValue {
        let (key, bytes, facts) = (value.key(), value.bytes(), value.facts());
        AnyValue { value: Arc::new(value), key, bytes, facts, _in_use: None }
    }

    /// The same, its bytes counted as long as somebody uses it.
    pub(super) fn used(self, cache: &Arc<Cache>) -> AnyValue {
        let _in_use = Some(Arc::new(cache.in_use(self.bytes)));
        AnyValue { _in_use, ..self }
    }

    /// The value, whose type the check of links has established.
    pub(super) fn get<T: Value>(&self) -> Arc<T> {
        self.value.clone().downcast().expect("links are checked to connect equal types")
    }
}

/// A demand of any type.
pub(super) trait AnyDemand: Any + Debug + Send + Sync {
    fn cover(&mut self, other: &dyn AnyDemand) -> bool;
    fn boxed(&self) -> Box<dyn AnyDemand>;
    fn json(&self) -> serde_json::Value;
    fn as_any(&self) -> &dyn Any;
}

impl<D: Demand> AnyDemand for D {
    fn cover(&mut self, other: &dyn AnyDemand) -> bool {
        other.as_any().downcast_ref::<D>().is_some_and(|other| Demand::cover(self, other))
    }

    fn boxed(&self) -> Box<dyn AnyDemand> {
        Box::new(self.clone())
    }

    fn json(&self) -> serde_json::Value {
        serde_json::to_value(self).unwrap_or_default()
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
