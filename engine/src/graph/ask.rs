//! What a node asks of its inputs, and what it gets of them.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use super::link::Link;
use super::value::{AnyDemand, AnyValue, Value};
use crate::watch::Watch;

/// What a node asks of its inputs.
pub struct Upstream<'a> {
    names: &'a HashMap<String, usize>,
    directory: &'a Path,
    /// Nodes by number, and what is asked of them.
    pub(super) asks: Vec<(usize, Box<dyn AnyDemand>)>,
}

impl<'a> Upstream<'a> {
    /// Nothing yet, of nodes with names.
    pub(super) fn new(names: &'a HashMap<String, usize>, directory: &'a Path) -> Upstream<'a> {
        Upstream { names, directory, asks: Vec::new() }
    }

    /// Asks a linked node for a value. Links that are not given are passed over.
    pub fn ask<T: Value>(&mut self, link: &Link<T>, demand: T::Demand) {
        self.ask_any(link.target(), Box::new(demand));
    }

    /// The folder from which files are found.
    pub fn directory(&self) -> &Path {
        self.directory
    }

    pub(super) fn ask_any(&mut self, target: &str, demand: Box<dyn AnyDemand>) {
        if let Some(node) = self.names.get(target) {
            self.asks.push((*node, demand));
        }
    }
}

/// The inputs of a node that is being evaluated.
pub struct Inputs<'a> {
    pub(super) values: Vec<(&'a str, AnyValue)>,
    pub(super) directory: &'a Path,
    pub(super) watch: &'a Watch,
    pub(super) tell: &'a (dyn Fn(Remark<'_>) + Sync),
}

/// What a node says of its work.
#[derive(Clone, Copy, Debug)]
pub(super) enum Remark<'t> {
    /// Something that is worth knowing.
    Note(&'t str),
    /// Something doubtful.
    Warning(&'t str),
}

impl Inputs<'_> {
    /// The value of a link that was asked for.
    ///
    /// # Panics
    /// If the node did not ask for it.
    pub fn get<T: Value>(&self, link: &Link<T>) -> Arc<T> {
        let value = self.values.iter().find(|(target, _)| *target == link.target());
        value.expect("a node gets only what it asked for").1.get()
    }

    /// The folder from which files are found.
    pub fn directory(&self) -> &Path {
        self.directory
    }

    /// Tells the user what was done that is worth knowing, such as that colours were converted.
    pub fn note(&self, message: &str) {
        (self.tell)(Remark::Note(message));
    }

    /// Tells the user of something doubtful, which is mostly a mistake.
    pub fn warn(&self, message: &str) {
        (self.tell)(Remark::Warning(message));
    }

    /// Whoever waits for the value: [begin](Watch::begin) and count [steps](Watch::step) of what takes long, and
    /// end early if the watch [is stopped](Watch::is_stopped): what is made then is thrown away.
    pub fn watch(&self) -> &Watch {
        self.watch
    }
}
