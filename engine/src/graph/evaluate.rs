//! Evaluate: in parallel, each content once.

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use super::check::Graph;
use super::demand::{Failure, Instance, Plan};
use super::node::Link;
use super::value::{AnyValue, Value};
use crate::error::{Error, Result};
use crate::key::{Key, KeyHasher};
use crate::open;

/// Evaluations that share their results: equal contents are computed once in a run.
#[derive(Default)]
pub struct Run {
    memo: Mutex<HashMap<Key, AnyValue>>,
    cancelled: AtomicBool,
}

/// The inputs of a node that is being evaluated.
pub struct Inputs<'a> {
    graph: &'a Graph,
    run: &'a Run,
    progress: &'a dyn Progress,
    node: &'a str,
    values: Vec<(&'a str, AnyValue)>,
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
        self.graph.directory()
    }

    /// Tells the user what was done that is worth knowing, such as that colours were converted.
    pub fn note(&self, message: &str) {
        self.progress.noted(self.node, message);
    }

    /// Tells the user of something doubtful, which is mostly a mistake.
    pub fn warn(&self, message: &str) {
        self.progress.warned(self.node, message);
    }

    /// Whether the user asked to stop.
    pub fn is_cancelled(&self) -> bool {
        self.run.cancelled.load(Ordering::Relaxed)
    }
}

/// What happened to a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It was computed.
    Evaluated,
    /// Its content was known.
    Known,
    /// It returned its input unchanged.
    Passed,
}

/// A node's part in an evaluation.
#[derive(Clone, Debug)]
pub struct Report {
    /// The node.
    pub node: String,
    /// Its kind.
    pub kind: &'static str,
    /// What was asked of it, as JSON.
    pub demand: serde_json::Value,
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
    /// A node begins.
    fn started(&self, _node: &str) {}
    /// A node did something that is worth knowing.
    fn noted(&self, _node: &str, _message: &str) {}
    /// A node found something doubtful.
    fn warned(&self, _node: &str, _message: &str) {}
    /// A node has ended.
    fn finished(&self, _report: &Report) {}
}

impl Progress for () {}

/// The values that were wanted, and what happened on the way.
pub struct Evaluated {
    values: Vec<AnyValue>,
    /// What happened, node by node, in the order of their ends.
    pub reports: Vec<Report>,
}

impl Evaluated {
    /// The value of a wish, by its number.
    pub fn value<T: Value>(&self, wish: usize) -> Arc<T> {
        self.values[wish].get()
    }
}

impl Run {
    /// A run that knows nothing yet.
    pub fn new() -> Run {
        Run::default()
    }

    /// Asks all evaluations of the run to stop soon.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Evaluates a plan of a graph.
    ///
    /// # Errors
    /// The first failure; nodes that had begun are finished, others are not begun.
    pub fn evaluate(
        &self,
        graph: &Graph,
        plan: &Plan,
        progress: &dyn Progress,
    ) -> Result<Evaluated, Failure> {
        let mut users: Vec<Vec<usize>> = vec![Vec::new(); plan.instances.len()];
        let mut open: Vec<usize> = vec![0; plan.instances.len()];
        for (i, instance) in plan.instances.iter().enumerate() {
            for (_, input) in &instance.inputs {
                users[*input].push(i);
                open[i] += 1;
            }
        }
        let ready: Vec<usize> = (0..open.len()).rev().filter(|i| open[*i] == 0).collect();
        let state = State {
            open,
            values: plan.instances.iter().map(|_| None).collect(),
            busy: HashMap::new(),
            reports: Vec::new(),
            failure: None,
        };
        let evaluation =
            Evaluation { graph, plan, run: self, progress, users, state: Mutex::new(state) };
        rayon::scope(|scope| {
            for instance in ready {
                evaluation.spawn(scope, instance);
            }
        });
        let state = evaluation.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        if let Some(failure) = state.failure {
            return Err(failure);
        }
        let value =
            |i: &usize| state.values[*i].clone().expect("without failure all are evaluated");
        Ok(Evaluated { values: plan.wanted.iter().map(value).collect(), reports: state.reports })
    }

    fn memo(&self) -> std::sync::MutexGuard<'_, HashMap<Key, AnyValue>> {
        self.memo.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

struct State {
    /// Of each instance: the inputs that are not there yet.
    open: Vec<usize>,
    values: Vec<Option<AnyValue>>,
    /// Contents that are being computed, and the instances that wait for them.
    busy: HashMap<Key, Vec<usize>>,
    reports: Vec<Report>,
    failure: Option<Failure>,
}

/// How an instance gets its value.
enum Start {
    /// Its content was computed before.
    Known(AnyValue),
    /// Another instance is computing it, and will pass it on.
    Waits,
    /// It computes it.
    Computes,
}

struct Evaluation<'a> {
    graph: &'a Graph,
    plan: &'a Plan,
    run: &'a Run,
    progress: &'a dyn Progress,
    /// Of each instance: those that use it.
    users: Vec<Vec<usize>>,
    state: Mutex<State>,
}

impl<'a> Evaluation<'a> {
    fn spawn<'s>(&'s self, scope: &rayon::Scope<'s>, at: usize)
    where
        'a: 's,
    {
        scope.spawn(move |scope| self.start(scope, at));
    }

    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Evaluates an instance whose inputs are there.
    fn start<'s>(&'s self, scope: &rayon::Scope<'s>, at: usize)
    where
        'a: 's,
    {
        let instance = &self.plan.instances[at];
        let node = &self.graph.nodes[instance.node];
        let mut values = Vec::new();
        {
            let state = self.state();
            if state.failure.is_some() {
                return;
            }
            for (target, input) in &instance.inputs {
                let value =
                    state.values[*input].clone().expect("an instance starts after its inputs");
                values.push((target.as_str(), value));
            }
        }
        if self.run.cancelled.load(Ordering::Relaxed) {
            return self.fail(at, Error::Cancelled);
        }
        if let Some(slot) = instance.passes {
            let value = values[slot].1.clone();
            return self.finish(scope, at, value, Outcome::Passed, 0.0);
        }
        let key = match self.key(instance, &values) {
            Ok(key) => key,
            Err(error) => return self.fail(at, error),
        };
        match self.begin(key, at) {
            Start::Known(value) => return self.finish(scope, at, value, Outcome::Known, 0.0),
            Start::Waits => return,
            Start::Computes => {}
        }
        self.progress.started(&node.id);
        let inputs = Inputs {
            graph: self.graph,
            run: self.run,
            progress: self.progress,
            node: &node.id,
            values,
        };
        let clock = Instant::now();
        let made =
            catch_unwind(AssertUnwindSafe(|| node.node.evaluate(&*instance.demand, &inputs)));
        let seconds = clock.elapsed().as_secs_f64();
        match made.unwrap_or_else(|panic| Err(panicked(&*panic))) {
            Ok(mut value) => {
                value.key.get_or_insert(key);
                let waiting = {
                    let mut state = self.state();
                    self.run.memo().insert(key, value.clone());
                    state.busy.remove(&key).unwrap_or_default()
                };
                self.finish(scope, at, value.clone(), Outcome::Evaluated, seconds);
                for other in waiting {
                    self.finish(scope, other, value.clone(), Outcome::Known, 0.0);
                }
            }
            Err(error) => self.fail(at, error),
        }
    }

    /// Decides, in one step for all threads, how an instance gets its value. Locks are taken in one
    /// order, state before memo, and none is held beyond this function.
    fn begin(&self, key: Key, at: usize) -> Start {
        let mut state = self.state();
        let known = self.run.memo().get(&key).cloned();
        if let Some(value) = known {
            return Start::Known(value);
        }
        match state.busy.get_mut(&key) {
            Some(waiting) => {
                waiting.push(at);
                Start::Waits
            }
            None => {
                state.busy.insert(key, Vec::new());
                Start::Computes
            }
        }
    }

    /// What an instance's value depends on: its kind and this build, its parameters, the names of the nodes that
    /// it links among them, what is asked of it, its inputs' contents, the contents of the files that it reads.
    fn key(&self, instance: &Instance, values: &[(&str, AnyValue)]) -> Result<Key> {
        let node = &self.graph.nodes[instance.node];
        let mut key = KeyHasher::new("node");
        key.bytes(env!("CARGO_PKG_VERSION").as_bytes());
        key.bytes(node.kind.name.as_bytes());
        key.value(&node.node.parameters());
        key.value(&instance.demand.json());
        for (_, value) in values {
            key.key(value.key.expect("every value got a key when it was made"));
        }
        for file in &node.files {
            let path = self.graph.directory().join(file);
            key.key(Key::of_bytes(&open::bytes(&path)?));
        }
        Ok(key.finish())
    }

    fn finish<'s>(
        &'s self,
        scope: &rayon::Scope<'s>,
        at: usize,
        value: AnyValue,
        outcome: Outcome,
        seconds: f64,
    ) where
        'a: 's,
    {
        let instance = &self.plan.instances[at];
        let node = &self.graph.nodes[instance.node];
        let report = Report {
            node: node.id.clone(),
            kind: node.kind.name,
            demand: instance.demand.json(),
            outcome,
            seconds,
            bytes: value.bytes,
            facts: value.facts.clone(),
        };
        self.progress.finished(&report);
        let mut ready = Vec::new();
        {
            let mut state = self.state();
            state.reports.push(report);
            state.values[at] = Some(value);
            for user in &self.users[at] {
                state.open[*user] -= 1;
                if state.open[*user] == 0 {
                    ready.push(*user);
                }
            }
        }
        for user in ready {
            self.spawn(scope, user);
        }
    }

    fn fail(&self, at: usize, error: Error) {
        let node = self.graph.nodes[self.plan.instances[at].node].id.clone();
        self.state().failure.get_or_insert(Failure { node, error });
    }
}

/// A panic of a node as an error: one broken node must not take down a farm's whole job.
fn panicked(panic: &(dyn std::any::Any + Send)) -> Error {
    let text = panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("no message");
    Error::invalid(format!("this kind of node is broken (it panicked: {text}): please report it"))
}
