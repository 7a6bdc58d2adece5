//! What is wrong with a graph, where, and the cure.

pub use crate::text::{Diagnostic, Severity, list, nearest};
