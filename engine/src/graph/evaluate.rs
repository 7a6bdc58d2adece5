//! Evaluate: in parallel, each content once; what nobody uses any more is let go.
//!
//! A value is held until its last user has it, and then goes to the [`cache`], where it stays as
//! long as there is room. Its key says what it was made of: the kind of node and what it is asked to do, the
//! keys of its inputs, and the contents of all files that were read, those among them that only the making
//! told of. Before a kept value is taken, these are looked at again.

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use super::ask::{Inputs, Remark};
use super::checked::{Checked, Graph};
use super::demand::{Failure, Schedule, Task};
use super::link::Slot;
use super::report::{Evaluated, NodeReport, Outcome, Progress};
use super::stored::{Past, Stored};
use super::value::AnyValue;
use crate::cache::{self, Cache, Kept, Shelf};
use crate::error::{Error, Result};
use crate::key::{Key, KeyHasher};
use crate::open;
use crate::watch::Watch;

/// Evaluations that share their results: equal contents are computed once in a run, as long as the cache has room
/// for them.
#[derive(Debug)]
pub struct Run {
    cache: Arc<Cache>,
    kept: Shelf,
    /// Of each picture, what the next may have in common with it.
    before: Arc<Shelf>,
    stored: Option<Stored>,
    stop: Arc<AtomicBool>,
}

/// A value that was made: what it depends on beside its key, and what it cost.
struct Made {
    value: AnyValue,
    past: Past,
    seconds: f64,
}

impl Default for Run {
    fn default() -> Run {
        Run::new()
    }
}

impl Run {
    /// A run that knows nothing yet, and keeps its values in the cache of this process.
    pub fn new() -> Run {
        Run::with_cache(cache::cache())
    }

    /// A run that knows nothing yet, and keeps its values in a cache.
    pub fn with_cache(cache: &Arc<Cache>) -> Run {
        let (kept, before) = (cache.shelf(), Arc::new(cache.shelf()));
        Run { cache: cache.clone(), kept, before, stored: None, stop: Arc::default() }
    }

    /// The same run, which stores results on disk and takes them from there.
    #[must_use]
    pub fn stored(self, stored: Stored) -> Run {
        Run { stored: Some(stored), ..self }
    }

    /// Asks all evaluations of the run to stop: they end within a tenth of a second, with
    /// [`Error::Cancelled`].
    pub fn cancel(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Evaluates a schedule of a graph.
    ///
    /// # Errors
    /// The first failure; nodes that had begun are finished, others are not begun.
    pub fn evaluate(
        &self,
        graph: &Graph,
        schedule: &Schedule,
        progress: &dyn Progress,
    ) -> Result<Evaluated, Failure> {
        let count = schedule.tasks.len();
        let mut evaluation = Evaluation {
            graph,
            schedule,
            run: self,
            progress,
            recipes: Vec::new(),
            users: vec![Vec::new(); count],
            state: Mutex::new(State {
                open: vec![0; count],
                waiting: vec![0; count],
                held: (0..count).map(|_| None).collect(),
                busy: HashMap::new(),
                reports: Vec::new(),
                failure: None,
            }),
        };
        let ready = evaluation.prepare();
        rayon::scope(|scope| {
            for task in ready {
                evaluation.spawn(scope, task);
            }
        });
        let mut state = evaluation.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        let wanted: Option<Vec<AnyValue>> = schedule
            .wanted
            .iter()
            .map(|at| state.held[*at].as_ref().map(|held| held.value.clone()))
            .collect();
        // What was wanted is still held, and after a failure all that was made by then. The next
        // evaluation may use it.
        for held in state.held.iter_mut().filter_map(Option::take) {
            self.keep(held);
        }
        match (state.failure, wanted) {
            (None, Some(values)) => Ok(Evaluated { values, reports: state.reports }),
            (Some(failure), _) => Err(failure),
            (None, None) => unreachable!("without failure all are evaluated"),
        }
    }

    /// Drops what was kept and not used since this was called last: between frames of a film, what only frames before
    /// the last needed.
    pub fn forget_unused(&self) {
        self.kept.drop_unused();
        self.before.drop_unused();
    }

    /// Keeps what nobody holds any more.
    fn keep(&self, held: Holding) {
        let Holding { value, made, .. } = held;
        // From here on it is not in use.
        drop(value);
        // What was passed on is kept by the node that made it.
        if let Some((key, made)) = made {
            let (bytes, seconds) = (made.value.bytes, made.seconds);
            self.kept.put(key, 0, made as Kept, bytes, seconds);
        }
    }

    /// What is kept under a key, if the files that it was made of are what they were.
    fn kept(&self, key: Key) -> Option<Arc<Made>> {
        let made: Arc<Made> = self.kept.get(key, 0)?.downcast().ok()?;
        let is_same = |(path, was): (&PathBuf, &Option<Key>)| open::contents(path) == *was;
        if made.past.files.iter().all(is_same) {
            return Some(made);
        }
        self.kept.remove(key, 0);
        None
    }
}

/// A value in use.
struct Holding {
    value: AnyValue,
    /// What it was asked under, and what is kept of it; none if it was passed on.
    made: Option<(Key, Arc<Made>)>,
    /// All that it was made of, by itself and by what it is made of.
    past: Arc<Past>,
}

impl Holding {
    /// A value that was made, in use; `below` is the past of what it is made of.
    fn of(key: Key, made: Arc<Made>, below: &Past, cache: &Arc<Cache>) -> Holding {
        let mut past = below.clone();
        past.add(&made.past);
        let value = made.value.clone().used(cache);
        Holding { value, made: Some((key, made)), past: Arc::new(past) }
    }

    /// The same value for another.
    fn again(&self) -> Holding {
        let Holding { value, made, past } = self;
        Holding { value: value.clone(), made: made.clone(), past: past.clone() }
    }
}

struct State {
    /// Of each task: the inputs that are not there yet.
    open: Vec<usize>,
    /// Of each task: the users that have not ended.
    waiting: Vec<usize>,
    held: Vec<Option<Holding>>,
    /// Contents that are being computed or held: by whom, and the tasks that wait for them.
    busy: HashMap<Key, (usize, Vec<usize>)>,
    reports: Vec<NodeReport>,
    failure: Option<Failure>,
}

/// How a task gets its value.
enum Start {
    /// Its content was computed before.
    Known(Holding),
    /// Another task is computing it, and will pass it on.
    Waits,
    /// It computes it.
    Computes,
}

struct Evaluation<'a> {
    graph: &'a Graph,
    schedule: &'a Schedule,
    run: &'a Run,
    progress: &'a dyn Progress,
    /// Of each task: what it is made of, as far as that is known before, if results are stored.
    recipes: Vec<Option<Key>>,
    /// Of each task: those that use it.
    users: Vec<Vec<usize>>,
    state: Mutex<State>,
}

impl<'a> Evaluation<'a> {
    /// Finds what must be made: what is stored is taken, and what only that is made of is left out. Returns the tasks
    /// that can begin.
    fn prepare(&mut self) -> Vec<usize> {
        let tasks = &self.schedule.tasks;
        if self.run.stored.is_some() {
            let mut recipes = vec![None; tasks.len()];
            // Users stand before what they use.
            for at in (0..tasks.len()).rev() {
                recipes[at] = self.recipe(&tasks[at], &recipes);
            }
            self.recipes = recipes;
        }
        let mut is_needed = vec![false; tasks.len()];
        self.schedule.wanted.iter().for_each(|wanted| is_needed[*wanted] = true);
        let mut ready = Vec::new();
        for (at, task) in tasks.iter().enumerate() {
            if !is_needed[at] {
                continue;
            }
            let stored = self.stored(at);
            let is_stored = stored.is_some();
            if let Some(held) = stored {
                self.say_again(at, &held);
                self.tell(at, &held, Outcome::Stored);
                self.state().held[at] = Some(held);
                continue;
            }
            for (_, input) in &task.inputs {
                is_needed[*input] = true;
                self.users[*input].push(at);
            }
            if task.inputs.is_empty() && !is_stored {
                ready.push(at);
            }
        }
        let State { open, waiting, held, .. } =
            self.state.get_mut().unwrap_or_else(PoisonError::into_inner);
        for (at, users) in self.users.iter().enumerate() {
            waiting[at] = users.len();
            // What is stored is there already.
            if held[at].is_none() {
                users.iter().for_each(|user| open[*user] += 1);
            }
        }
        // Who asked for the evaluation uses what is wanted, and does not end before it.
        self.schedule.wanted.iter().for_each(|wanted| waiting[*wanted] += 1);
        let is_ready = |at: &usize| {
            is_needed[*at] && held[*at].is_none() && open[*at] == 0 && !tasks[*at].inputs.is_empty()
        };
        ready.extend((0..tasks.len()).filter(is_ready));
        ready.sort_unstable_by(|a, b| b.cmp(a));
        ready
    }

    /// What a task's value is made of, as far as it is known before anything is made; none if it cannot be told.
    fn recipe(&self, task: &Task, recipes: &[Option<Key>]) -> Option<Key> {
        if let Some(slot) = task.passes {
            return recipes[task.inputs[slot].1];
        }
        let inputs = task.inputs.iter().map(|(_, input)| recipes[*input]);
        let inputs: Vec<Key> = inputs.collect::<Option<_>>()?;
        self.key_of(task, inputs.into_iter()).ok()
    }

    /// The stored value of a task.
    fn stored(&self, at: usize) -> Option<Holding> {
        let task = &self.schedule.tasks[at];
        let (stored, packing) = (self.run.stored.as_ref()?, task.checked.kind.packing?);
        let recipe = self.recipes[at]?;
        let tell = |remark: &Remark| self.remark(&task.checked.id, remark);
        let folder = self.graph.directory();
        let clock = Instant::now();
        let (value, past) = stored.value(recipe, packing, folder, &tell)?;
        let seconds = clock.elapsed().as_secs_f64();
        let made = Arc::new(Made { value, past, seconds });
        Some(Holding::of(recipe, made, &Past::default(), &self.run.cache))
    }

    fn spawn<'s>(&'s self, scope: &rayon::Scope<'s>, at: usize)
    where
        'a: 's,
    {
        // While a thread waits for parts of its work, it may begin with another node: not under the same watch.
        scope.spawn(move |scope| Watch::default().run(|| self.start(scope, at)));
    }

    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Evaluates a task whose inputs are there.
    fn start<'s>(&'s self, scope: &rayon::Scope<'s>, at: usize)
    where
        'a: 's,
    {
        let task = &self.schedule.tasks[at];
        let node = &*task.checked;
        let mut values = Vec::new();
        let mut below = Past::default();
        {
            let state = self.state();
            if state.failure.is_some() {
                return;
            }
            for (link, input) in &task.inputs {
                let held = state.held[*input].as_ref().expect("a task starts after its inputs");
                values.push((*link, held.value.clone()));
                below.add(&held.past);
            }
        }
        if self.run.stop.load(Ordering::Relaxed) {
            return self.fail(at, Error::Cancelled);
        }
        if let Some(slot) = task.passes {
            let value = values.swap_remove(slot).1;
            let held = Holding { value, made: None, past: Arc::new(below) };
            return self.finish(scope, at, held, Outcome::Passed);
        }
        let keys = values.iter().map(|(_, value)| value.key.expect("every value has a key"));
        let key = match self.key_of(task, keys) {
            Ok(key) => key,
            Err(error) => return self.fail(at, error),
        };
        match self.begin(key, at, &below) {
            Start::Known(held) => {
                self.say_again(at, &held);
                return self.finish(scope, at, held, Outcome::Known);
            }
            Start::Waits => return,
            Start::Computes => {}
        }
        match self.make(node, task, values, key) {
            Ok(made) => {
                let held = Holding::of(key, Arc::new(made), &below, &self.run.cache);
                self.store(at, &held);
                let for_others = held.again();
                // In one step: whoever comes later finds the value, and waits no more.
                let waiting = {
                    let mut state = self.state();
                    state.held[at] = Some(held.again());
                    let waiting = state.busy.get_mut(&key).map(|(_, waiting)| waiting);
                    waiting.map(std::mem::take).unwrap_or_default()
                };
                self.finish(scope, at, held, Outcome::Evaluated);
                for other in waiting {
                    self.finish(scope, other, for_others.again(), Outcome::Known);
                }
            }
            Err(error) => self.fail(at, error),
        }
    }

    /// Computes a value.
    fn make(
        &self,
        node: &Checked,
        task: &Task,
        values: Vec<(Slot, AnyValue)>,
        key: Key,
    ) -> Result<Made> {
        let watch = Watch::together(&self.run.stop, &self.run.before);
        self.progress.started(&node.id, &watch);
        let tell = |remark: &Remark| self.remark(&node.id, remark);
        let directory = self.graph.directory();
        let moment = node.moves.then_some(task.moment);
        let stored = self.run.stored.as_ref().map(|stored| (stored, key));
        let said = Mutex::default();
        let inputs = Inputs { values, directory, moment, watch: &watch, stored, tell: &tell, said };
        let clock = Instant::now();
        let made = watch
            .run(|| catch_unwind(AssertUnwindSafe(|| node.node.evaluate(&*task.demand, &inputs))));
        let seconds = clock.elapsed().as_secs_f64();
        // Whatever came back may be half done.
        if watch.is_stopped() {
            return Err(Error::Cancelled);
        }
        let mut value = made.unwrap_or_else(|panic| Err(panicked(&*panic)))?;
        value.facts.extend(watch.counts());
        // Those that were read on the way, beside the ones that the node names.
        let files = watch.files();
        let said = std::mem::take(&mut *inputs.said());
        let said = said.into_iter().map(|remark| (node.id.clone(), remark)).collect();
        value.key.get_or_insert_with(|| {
            let mut whole = KeyHasher::new("made");
            whole.key(key);
            files.values().for_each(|contents| {
                whole.value(contents);
            });
            whole.finish()
        });
        Ok(Made { value, past: Past { files, said }, seconds })
    }

    /// Says again what was said while a value was made that is found.
    fn say_again(&self, at: usize, held: &Holding) {
        let Some((_, made)) = &held.made else { return };
        for (node, remark) in &made.past.said {
            // Another graph may call what made it by another name.
            let is_known = self.graph.names.contains_key(node);
            let own = &self.schedule.tasks[at].checked.id;
            self.remark(if is_known { node } else { own }, remark);
        }
    }

    /// Passes on what is said of a node.
    fn remark(&self, node: &str, remark: &Remark) {
        match remark {
            Remark::Note(message) => self.progress.noted(node, message),
            Remark::Warning(message) => self.progress.warned(node, message),
        }
    }

    /// Stores a value that was made.
    fn store(&self, at: usize, held: &Holding) {
        let task = &self.schedule.tasks[at];
        let (Some(stored), Some(packing)) = (&self.run.stored, task.checked.kind.packing) else {
            return;
        };
        let (Some(recipe), Some((_, made))) = (self.recipes[at], &held.made) else { return };
        let tell = |remark: &Remark| self.remark(&task.checked.id, remark);
        let past = (&*held.past, self.graph.directory());
        stored.put_value(recipe, (&made.value, packing), past, made.seconds, &tell);
    }

    /// Decides, in one step for all threads, how a task gets its value.
    fn begin(&self, key: Key, at: usize, below: &Past) -> Start {
        let mut state = self.state();
        let State { busy, held, .. } = &mut *state;
        // Two nodes of one content: the first computes it, and others take its value or wait.
        match busy.get_mut(&key) {
            Some((holder, waiting)) => match &held[*holder] {
                Some(held) => Start::Known(held.again()),
                None => {
                    waiting.push(at);
                    Start::Waits
                }
            },
            None => match self.run.kept(key) {
                Some(made) => Start::Known(Holding::of(key, made, below, &self.run.cache)),
                None => {
                    busy.insert(key, (at, Vec::new()));
                    Start::Computes
                }
            },
        }
    }

    /// What a task's value is made of, as far as it is known before: its kind, its parameters (the names of its
    /// links only where they matter), what is asked of it, the keys of its inputs, the contents of the files that it
    /// names.
    fn key_of(&self, task: &Task, inputs: impl Iterator<Item = Key>) -> Result<Key> {
        let node = &*task.checked;
        let mut key = KeyHasher::new("node");
        key.bytes(node.kind.name.as_bytes());
        key.value(&node.nameless);
        key.value(&task.demand.json());
        if node.moves {
            key.value(&task.moment);
        }
        for input in inputs {
            key.key(input);
        }
        for file in &node.files {
            let path = self.graph.directory().join(file);
            match open::contents(&path) {
                Some(contents) => key.key(contents),
                // What is wrong with it is said as everywhere.
                None => key.key(Key::of_bytes(&open::bytes(&path)?)),
            };
        }
        Ok(key.finish())
    }

    fn finish<'s>(&'s self, scope: &rayon::Scope<'s>, at: usize, held: Holding, outcome: Outcome)
    where
        'a: 's,
    {
        let task = &self.schedule.tasks[at];
        self.tell(at, &held, outcome);
        let mut ready = Vec::new();
        {
            let mut state = self.state();
            state.held[at] = Some(held);
            for user in &self.users[at] {
                state.open[*user] -= 1;
                if state.open[*user] == 0 {
                    ready.push(*user);
                }
            }
            for (_, input) in &task.inputs {
                state.waiting[*input] -= 1;
                if state.waiting[*input] == 0 {
                    state.let_go(*input).into_iter().for_each(|held| self.run.keep(held));
                }
            }
        }
        for user in ready {
            self.spawn(scope, user);
        }
    }

    /// Tells what became of a task.
    fn tell(&self, at: usize, held: &Holding, outcome: Outcome) {
        let task = &self.schedule.tasks[at];
        let node = &*task.checked;
        let value = &held.value;
        let made =
            held.made.as_ref().filter(|_| matches!(outcome, Outcome::Evaluated | Outcome::Stored));
        let report = NodeReport {
            node: node.id.clone(),
            kind: node.kind.name.clone(),
            frame: self.graph.nodes[task.node].varies.then_some(task.moment.frame),
            demand: task.demand.json(),
            key: value.key.expect("every value got a key when it was made"),
            outcome,
            seconds: made.map_or(0.0, |(_, made)| made.seconds),
            bytes: value.bytes,
            facts: value.facts.clone(),
        };
        self.progress.finished(&report);
        self.state().reports.push(report);
    }

    fn fail(&self, at: usize, error: Error) {
        let node = self.graph.nodes[self.schedule.tasks[at].node].id.clone();
        self.state().failure.get_or_insert(Failure { node, error });
    }
}

impl State {
    /// Takes away a value that nobody waits for any more.
    fn let_go(&mut self, at: usize) -> Option<Holding> {
        let held = self.held[at].take()?;
        if let Some((key, _)) = &held.made
            && self.busy.get(key).is_some_and(|(holder, _)| *holder == at)
        {
            // From here on, who wants this content finds it in the cache or makes it again.
            self.busy.remove(key);
        }
        Some(held)
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
