//! Demand: from the outputs up, what each node must deliver.

use std::sync::Arc;

use super::ask::{self, Upstream};
use super::checked::{Checked, Graph};
use super::link::Slot;
use super::value::{AnyDemand, Value};
use crate::error::{Error, Result};
use crate::moment::Moment;

/// What is to be evaluated: nodes, each with all that its users ask of it.
pub struct Schedule {
    pub(super) tasks: Vec<Task>,
    /// The tasks that were wanted, in order.
    pub(super) wanted: Vec<usize>,
}

/// A node with one demand. A node has several if its users ask what one value cannot serve.
pub(super) struct Task {
    pub(super) node: usize,
    /// The node as it is at the moment.
    pub(super) checked: Arc<Checked>,
    pub(super) moment: Moment,
    pub(super) demand: Box<dyn AnyDemand>,
    /// The tasks that it uses, and its links that ask them, in the order of asking.
    pub(super) inputs: Vec<(Slot, usize)>,
    /// The input that it returns unchanged.
    pub(super) passes: Option<usize>,
}

/// What is wanted of a graph.
#[derive(Default)]
pub struct Wishes(Vec<Wish>);

/// Something that is wanted.
struct Wish {
    node: String,
    /// The frame; without, the first that the graph was checked for.
    frame: Option<f64>,
    demand: Box<dyn AnyDemand>,
    /// The name of its type.
    of: &'static str,
}

impl Wishes {
    /// Nothing.
    pub fn new() -> Wishes {
        Wishes::default()
    }

    /// A value of a node, at the first frame that the graph was checked for.
    pub fn want<T: Value>(&mut self, id: &str, demand: T::Demand) -> &mut Wishes {
        self.push::<T>(id, demand, None)
    }

    /// A value of a node at a frame.
    pub fn want_at<T: Value>(&mut self, id: &str, demand: T::Demand, frame: f64) -> &mut Wishes {
        self.push::<T>(id, demand, Some(frame))
    }

    fn push<T: Value>(&mut self, id: &str, demand: T::Demand, frame: Option<f64>) -> &mut Wishes {
        let (node, demand) = (id.to_owned(), Box::new(demand));
        self.0.push(Wish { node, frame, demand, of: T::NAME });
        self
    }
}

impl Schedule {
    /// Finds what must be evaluated to get what is wanted.
    ///
    /// # Errors
    /// If there is no such node, it makes another type of value, or a node cannot deliver what is asked.
    pub fn new(graph: &Graph, wishes: &Wishes) -> Result<Schedule, Failure> {
        let mut asked: Vec<Vec<Ask>> = (0..graph.nodes.len()).map(|_| Vec::new()).collect();
        for (i, Wish { node: id, frame, demand, of }) in wishes.0.iter().enumerate() {
            let node = graph.find(id).map_err(|error| Failure { node: id.clone(), error })?;
            let kind = &graph.nodes[node].kind;
            if kind.output != *of {
                let message = format!("a {} makes a {}, not a {of}", kind.name, kind.output);
                return Err(Failure { node: id.clone(), error: Error::invalid(message) });
            }
            let moment = frame.map_or(graph.first, |frame| graph.moment(frame));
            asked[node].push(Ask { by: User::Outside(i), moment, demand: demand.boxed() });
        }
        let mut schedule = Schedule { tasks: Vec::new(), wanted: vec![0; wishes.0.len()] };
        for node in &graph.order {
            // Users come before what they use: by now all that is asked of this node is known.
            let asks = std::mem::take(&mut asked[*node]);
            for (moment, demand, users) in merged(asks, graph.nodes[*node].varies) {
                let at = schedule.tasks.len();
                for user in users {
                    match user {
                        User::Outside(i) => schedule.wanted[i] = at,
                        User::Input(task, number) => {
                            schedule.tasks[task].inputs[number].1 = at;
                        }
                    }
                }
                let task = schedule_one(graph, *node, (moment, demand), at, &mut asked)?;
                schedule.tasks.push(task);
            }
        }
        Ok(schedule)
    }

    /// What is asked of every node that will be evaluated, users before what they use.
    pub fn asks<'g>(&self, graph: &'g Graph) -> Vec<Asked<'g>> {
        let id = |task: &Task| graph.nodes[task.node].id.as_str();
        let asked = |(at, task): (usize, &Task)| {
            let uses = |user: &&Task| user.inputs.iter().any(|(_, input)| *input == at);
            let by = self.tasks.iter().filter(uses).map(id).collect();
            let frame = graph.nodes[task.node].varies.then_some(task.moment.frame);
            Asked { node: id(task), frame, demand: task.demand.json(), by }
        };
        self.tasks.iter().enumerate().map(asked).collect()
    }

    /// The names of the nodes that will be evaluated, users before what they use.
    pub fn nodes<'g>(&self, graph: &'g Graph) -> Vec<&'g str> {
        self.tasks.iter().map(|task| graph.nodes[task.node].id.as_str()).collect()
    }
}

/// What is asked of a node, and by whom.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked<'g> {
    /// The node.
    pub node: &'g str,
    /// The frame, if it is another at another.
    pub frame: Option<f64>,
    /// What is asked, as JSON.
    pub demand: serde_json::Value,
    /// The nodes that ask; none if the program does.
    pub by: Vec<&'g str>,
}

/// A failure, and the node that failed.
#[derive(Debug, thiserror::Error)]
#[error("node \"{node}\": {error}")]
pub struct Failure {
    /// The node.
    pub node: String,
    /// What went wrong.
    pub error: Error,
}

struct Ask {
    by: User,
    moment: Moment,
    demand: Box<dyn AnyDemand>,
}

/// Who asks.
enum User {
    /// The program: the wish of this number.
    Outside(usize),
    /// A task, for the input of this number.
    Input(usize, usize),
}

/// The fewest demands that cover all that is asked, each with its moment and who asked it. What is the same at all
/// moments is asked once.
fn merged(asks: Vec<Ask>, varies: bool) -> Vec<(Moment, Box<dyn AnyDemand>, Vec<User>)> {
    let mut merged: Vec<(Moment, Box<dyn AnyDemand>, Vec<User>)> = Vec::new();
    for ask in asks {
        let covering = merged.iter_mut().find_map(|(moment, demand, users)| {
            let is_then = !varies || *moment == ask.moment;
            (is_then && demand.cover(&*ask.demand)).then_some(users)
        });
        match covering {
            Some(users) => users.push(ask.by),
            None => merged.push((ask.moment, ask.demand, vec![ask.by])),
        }
    }
    merged
}

fn schedule_one(
    graph: &Graph,
    node: usize,
    (moment, demand): (Moment, Box<dyn AnyDemand>),
    at: usize,
    asked: &mut [Vec<Ask>],
) -> Result<Task, Failure> {
    let failed = |error| Failure { node: graph.nodes[node].id.clone(), error };
    let checked = graph.at(node, moment).map_err(failed)?;
    let mut upstream = Upstream::new(graph, moment);
    let passes = checked.node.passes();
    match &passes {
        // What returns its input unchanged asks of it just what it is asked itself.
        Some(link) => upstream.pass_on(*link, demand.boxed()),
        None => checked.node.demand(&*demand, &mut upstream).map_err(failed)?,
    }
    let mut inputs = Vec::new();
    for (number, ask::Ask { by, of, moment, demand }) in upstream.asks.into_iter().enumerate() {
        // The task is filled in when it is the input's turn.
        inputs.push((by, usize::MAX));
        asked[of].push(Ask { by: User::Input(at, number), moment, demand });
    }
    let passes = passes.map(|_| 0);
    Ok(Task { node, checked, moment, demand, inputs, passes })
}
