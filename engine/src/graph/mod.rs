//! The graph: a document of nodes, checked, asked and evaluated.
//!
//! A document's values may change in time (`motion`): at a moment a node is what its text says then, and one schedule
//! may ask for many moments.
//!
//! This module knows no picture. It knows *values* with their *demands* ([`value`]), *nodes* that make
//! one value from others ([`node`]), the *registry* of all kinds of node, and three phases:
//!
//! 1. **check** ([`check`]): parse the document, link it, report every error at once.
//! 2. **demand** ([`demand`]): from the outputs up, what each node must deliver; what nobody asks for is
//!    not computed.
//! 3. **evaluate** ([`evaluate`]): in parallel, each content once.

pub mod ask;
pub mod catalogue;
pub mod check;
pub mod checked;
pub mod demand;
pub mod diagnostic;
pub mod document;
pub mod evaluate;
mod film;
pub mod link;
pub mod node;
pub mod parameter;
pub mod registry;
pub mod report;
pub mod stored;
pub mod value;

pub use ask::{Inputs, Upstream};
pub use checked::Graph;
pub use demand::Schedule;
pub use diagnostic::{Diagnostic, Severity};
pub use evaluate::Run;
pub use link::{InFile, Link, NamedLink, OutFile};
pub use node::Node;
pub use registry::Registry;
pub use report::NodeReport;
pub use stored::Stored;
pub use value::{Demand, Value};
