//! What a node asks of its inputs, and what it gets of them.

use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use super::checked::Graph;
use super::link::{Link, Slot};
use super::stored::Stored;
use super::value::{AnyDemand, AnyValue, Value};
use crate::error::Result;
use crate::key::Key;
use crate::moment::Moment;
use crate::watch::Watch;

/// What a node asks of its inputs.
pub struct Upstream<'a> {
    graph: &'a Graph,
    moment: Moment,
    pub(super) asks: Vec<Ask>,
}

/// What is asked by a link.
pub(super) struct Ask {
    pub(super) by: Slot,
    /// The number of the node that is asked.
    pub(super) of: usize,
    pub(super) moment: Moment,
    pub(super) demand: Box<dyn AnyDemand>,
}

impl<'a> Upstream<'a> {
    /// Nothing yet, of a graph's nodes at a moment.
    pub(super) fn new(graph: &'a Graph, moment: Moment) -> Upstream<'a> {
        Upstream { graph, moment, asks: Vec::new() }
    }

    /// Asks a linked node for a value. Links that are not given are passed over. One link may be asked for several
    /// values: [`Inputs::each`] gives them in the same order.
    pub fn ask<T: Value>(&mut self, link: &Link<T>, demand: T::Demand) {
        self.ask_at(link, demand, 0.0);
    }

    /// Asks a linked node for a value some frames later, or earlier: for what a shutter sees.
    pub fn ask_at<T: Value>(&mut self, link: &Link<T>, demand: T::Demand, frames_later: f64) {
        let moment = self.moment.later(frames_later);
        self.ask_any((link.target(), link.slot()), Box::new(demand), moment);
    }

    /// Whether what a link leads to is another at another moment.
    pub fn varies<T: Value>(&self, link: &Link<T>) -> bool {
        let target = self.graph.names.get(link.target());
        target.is_some_and(|target| self.graph.nodes[*target].varies)
    }

    /// Asks what is asked of a node itself of one of its links.
    pub(super) fn pass_on(&mut self, link: (&str, Slot), demand: Box<dyn AnyDemand>) {
        self.ask_any(link, demand, self.moment);
    }

    /// The folder from which files are found.
    pub fn directory(&self) -> &Path {
        &self.graph.directory
    }

    fn ask_any(&mut self, (target, by): (&str, Slot), demand: Box<dyn AnyDemand>, moment: Moment) {
        if let Some(of) = self.graph.names.get(target).copied() {
            self.asks.push(Ask { by, of, moment, demand });
        }
    }
}

/// The inputs of a node that is being evaluated.
pub struct Inputs<'a> {
    /// In the order in which they were asked for.
    pub(super) values: Vec<(Slot, AnyValue)>,
    pub(super) directory: &'a Path,
    pub(super) moment: Option<Moment>,
    pub(super) watch: &'a Watch,
    /// Where results are stored, and the key of what is being made.
    pub(super) stored: Option<(&'a Stored, Key)>,
    pub(super) tell: &'a (dyn Fn(&Remark) + Sync),
    /// What the node said so far.
    pub(super) said: Mutex<Vec<Remark>>,
}

/// What a node says of its work.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) enum Remark {
    /// Something that is worth knowing.
    Note(String),
    /// Something doubtful.
    Warning(String),
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

    /// The moment that the value is for, if the node [said](super::Node::moves) that it makes another at another.
    pub fn moment(&self) -> Option<Moment> {
        self.moment
    }

    /// What takes long of a node's work: from where results are stored, if it is there, or made and stored. It depends
    /// on nothing but the node's fields, what it was asked, and its inputs. `unpack` refuses bytes that are none of
    /// its. What `make` says is said again when the bytes are found.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn remembered<T>(
        &self,
        unpack: impl FnOnce(&[u8]) -> Option<T>,
        make: impl FnOnce() -> Result<T>,
        pack: impl FnOnce(&T) -> Vec<u8>,
    ) -> Result<T> {
        let Some((stored, key)) = self.stored else { return make() };
        if let Some((bytes, said)) = stored.part(key, self.tell) {
            if let Some(known) = unpack(&bytes) {
                said.into_iter().for_each(|remark| self.say(remark));
                return Ok(known);
            }
            stored.refuse(key);
        }
        let (clock, before) = (Instant::now(), self.said().len());
        let made = make()?;
        // What was made while it was to stop may be half done.
        if !self.watch.is_stopped() {
            let said = self.said()[before..].to_vec();
            let seconds = clock.elapsed().as_secs_f64();
            stored.put_part(key, seconds, (&pack(&made), &said), self.tell);
        }
        Ok(made)
    }

    /// Tells the user what was done that is worth knowing, such as that colours were converted.
    pub fn note(&self, message: &str) {
        self.say(Remark::Note(message.to_owned()));
    }

    /// Tells the user of something doubtful, which is mostly a mistake.
    pub fn warn(&self, message: &str) {
        self.say(Remark::Warning(message.to_owned()));
    }

    fn say(&self, remark: Remark) {
        (self.tell)(&remark);
        self.said().push(remark);
    }

    /// What the node said so far.
    pub(super) fn said(&self) -> MutexGuard<'_, Vec<Remark>> {
        self.said.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whoever waits for the value: [begin](Watch::begin) and count [steps](Watch::step) of what takes long, and
    /// end early if the watch [is stopped](Watch::is_stopped): what is made then is thrown away.
    pub fn watch(&self) -> &Watch {
        self.watch
    }
}
