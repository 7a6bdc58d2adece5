//! What a node asks of its inputs, and what it gets of them.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use super::link::{Link, Slot};
use super::value::{AnyDemand, AnyValue, Value};
use crate::watch::Watch;

/// What a node asks of its inputs.
pub struct Upstream<'a> {
    names: &'a HashMap<String, usize>,
    directory: &'a Path,
    pub(super) asks: Vec<Ask>,
}

/// What is asked by a link.
pub(super) struct Ask {
    pub(super) by: Slot,
    /// The number of the node that is asked.
    pub(super) of: usize,
    pub(super) demand: Box<dyn AnyDemand>,
}

impl<'a> Upstream<'a> {
    /// Nothing yet, of nodes with names.
    pub(super) fn new(names: &'a HashMap<String, usize>, directory: &'a Path) -> Upstream<'a> {
        Upstream { names, directory, asks: Vec::new() }
    }

    /// Asks a linked node for a value. Links that are not given are passed over. One link may be asked for several
    /// values: [`Inputs::each`] gives them in the same order.
    pub fn ask<T: Value>(&mut self, link: &Link<T>, demand: T::Demand) {
        self.ask_any((link.target(), link.slot()), Box::new(demand));
    }

    /// The folder from which files are found.
    pub fn directory(&self) -> &Path {
        self.directory
    }

    pub(super) fn ask_any(&mut self, (target, by): (&str, Slot), demand: Box<dyn AnyDemand>) {
        if let Some(of) = self.names.get(target).copied() {
            self.asks.push(Ask { by, of, demand });
        }
    }
}

/// The inputs of a node that is being evaluated.
pub struct Inputs<'a> {
    /// In the order in which they were asked for.
    pub(super) values: Vec<(Slot, AnyValue)>,
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
        self.each(link).next().expect("a node gets only what it asked for")
    }

    /// The values of a link that was asked several times, in the order of the demands.
    pub fn each<T: Value>(&self, link: &Link<T>) -> impl Iterator<Item = Arc<T>> {
        let slot = link.slot();
        self.values.iter().filter(move |(by, _)| *by == slot).map(|(_, value)| value.get())
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
