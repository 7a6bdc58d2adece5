//! What an evaluation made, and what is told of it.

use std::sync::Arc;

use super::value::{AnyValue, Value};
use crate::key::Key;
use crate::watch::Watch;

/// What happened to a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It was computed.
    Evaluated,
    /// Its content was known.
    Known,
    /// It was stored on disk; what it is made of was not needed for it.
    Stored,
    /// It returned its input unchanged.
    Passed,
}

/// A node's part in an evaluation.
#[derive(Clone, Debug)]
pub struct NodeReport {
    /// The node.
    pub node: String,
    /// Its kind.
    pub kind: String,
    /// The frame, if it is another at another.
    pub frame: Option<f64>,
    /// What was asked of it, as JSON.
    pub demand: serde_json::Value,
    /// What its value is: two with one key are alike bit for bit.
    pub key: Key,
    /// What happened.
    pub outcome: Outcome,
    /// Time from its start to its end; while it waits for its own parallel parts, the thread may work
    /// for other nodes.
    pub seconds: f64,
    /// Bytes of its value.
    pub bytes: usize,
    /// What is known of its value.
    pub facts: Vec<(&'static str, u64)>,
}

/// Is told how an evaluation goes on; from any thread.
pub trait Progress: Sync {
    /// A node begins. Its watch tells [how far it is](Watch::share).
    fn started(&self, _node: &str, _watch: &Watch) {}
    /// A node did something that is worth knowing.
    fn noted(&self, _node: &str, _message: &str) {}
    /// A node found something doubtful.
    fn warned(&self, _node: &str, _message: &str) {}
    /// A node has ended.
    fn finished(&self, _report: &NodeReport) {}
}

impl Progress for () {}

/// The values that were wanted, and what happened on the way.
pub struct Evaluated {
    pub(super) values: Vec<AnyValue>,
    /// What happened, node by node, in the order of their ends.
    pub reports: Vec<NodeReport>,
}

impl Evaluated {
    /// The value of a wish, by its number.
    pub fn value<T: Value>(&self, wish: usize) -> Arc<T> {
        self.values[wish].get()
    }
}
