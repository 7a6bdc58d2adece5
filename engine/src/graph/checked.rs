//! A checked graph: its nodes, as they are at any moment.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use super::check::{self, Wish};
use super::diagnostic::{list, nearest};
use super::film::Film;
use super::node::AnyNode;
use super::parameter::ParameterInfo;
use super::registry::{Kind, Registry};
use crate::error::{Error, Result};
use crate::moment::Moment;

/// A checked graph: every node parsed, every link resolved and of the right type, without cycles.
pub struct Graph {
    pub(super) nodes: Vec<GraphNode>,
    pub(super) names: HashMap<String, usize>,
    /// Nodes, those that use others before those that they use.
    pub(super) order: Vec<usize>,
    pub(super) directory: PathBuf,
    /// The first moment that it was checked for.
    pub(super) first: Moment,
    pub(super) parameters: Vec<ParameterInfo>,
    pub(super) film: Film,
    pub(super) registry: Registry,
}

/// A node of a graph, at all moments.
pub(super) struct GraphNode {
    pub(super) id: String,
    pub(super) kind: Arc<Kind>,
    /// Whether what it makes is another at another moment: something in it does, or in what it uses.
    pub(super) varies: bool,
    /// As it is at the first moment.
    pub(super) first: Arc<Checked>,
    /// As it is at others, by their frames, if its own text is another.
    pub(super) others: Mutex<HashMap<u64, Arc<Checked>>>,
}

/// A node as it is at a moment.
pub(super) struct Checked {
    pub(super) id: String,
    pub(super) kind: Arc<Kind>,
    pub(super) node: Box<dyn AnyNode>,
    /// What it is asked to do, whatever its inputs are called.
    pub(super) nameless: serde_json::Value,
    /// Whether it reads something that is another at another moment.
    pub(super) moves: bool,
    pub(super) files: Vec<String>,
    /// The fields that name files which it writes, and the files.
    pub(super) writes: Vec<(String, String)>,
    pub(super) links: Vec<usize>,
}

/// A node of a graph, as others see it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeInfo<'g> {
    /// Its name.
    pub id: &'g str,
    /// Its kind.
    pub kind: &'g str,
    /// The name of the type that it makes.
    pub output: &'static str,
    /// Whether what it makes is another at another frame.
    pub varies: bool,
    /// The names of the nodes that it uses.
    pub uses: Vec<&'g str>,
    /// The fields that name files which it writes, and the files, at the first frame.
    pub writes: Vec<(&'g str, &'g str)>,
}

/// The most moments at which a node is kept ready.
pub(super) const MOST_KEPT: usize = 64;

impl Graph {
    /// The nodes in the order of the document, files that links name after them.
    pub fn nodes(&self) -> impl Iterator<Item = NodeInfo<'_>> {
        self.nodes.iter().map(|node| NodeInfo {
            id: &node.id,
            kind: &node.kind.name,
            output: node.kind.output,
            varies: node.varies,
            uses: node.first.links.iter().map(|link| self.nodes[*link].id.as_str()).collect(),
            writes: node.first.writes.iter().map(|(field, file)| (&**field, &**file)).collect(),
        })
    }

    /// The files that a node writes at a frame, as seen from the graph's folder.
    ///
    /// # Errors
    /// If there is no such node, or it cannot be made at that frame.
    pub fn writes(&self, id: &str, frame: f64) -> Result<Vec<PathBuf>> {
        let checked = self.at(self.find(id)?, self.moment(frame))?;
        Ok(checked.writes.iter().map(|(_, file)| self.directory.join(file)).collect())
    }

    /// The graph's parameters, at the first frame.
    pub fn parameters(&self) -> &[ParameterInfo] {
        &self.parameters
    }

    /// The folder from which files are found.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// The first frame that it was checked for.
    pub fn first_frame(&self) -> i64 {
        self.first.frame as i64
    }

    /// A frame as a moment, at the graph's rate.
    pub fn moment(&self, frame: f64) -> Moment {
        Moment { frame, ..self.first }
    }

    /// A node as it is at a moment.
    ///
    /// # Errors
    /// If its text is none that can be read then, or it uses what it does not use at the frames that were checked.
    pub(super) fn at(&self, node: usize, moment: Moment) -> Result<Arc<Checked>> {
        let known = &self.nodes[node];
        if !self.film.varies(node) || moment == self.first {
            return Ok(known.first.clone());
        }
        let frame = moment.frame.to_bits();
        let others = || known.others.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(checked) = others().get(&frame) {
            return Ok(checked.clone());
        }
        let (mut checked, wishes) = check::node_at(self, node, moment)?;
        // Its place among those that it may use is settled.
        let place = |at: usize| self.order.iter().position(|other| *other == at);
        let fits = |link: &usize, wish: &Wish| {
            place(node) < place(*link) && self.nodes[*link].kind.output == wish.of
        };
        let link =
            |wish: &Wish| self.names.get(&wish.target).copied().filter(|link| fits(link, wish));
        let links: Option<Vec<usize>> = wishes.iter().map(link).collect();
        checked.links = links.ok_or_else(|| {
            Error::invalid(format!(
                "at frame {} it uses a node or a file that it uses at none of the frames that were asked for",
                moment.frame
            ))
        })?;
        let mut others = others();
        if others.len() >= MOST_KEPT {
            others.clear();
        }
        Ok(others.entry(frame).or_insert(Arc::new(checked)).clone())
    }

    /// The place of a node.
    pub(super) fn find(&self, id: &str) -> Result<usize> {
        self.names.get(id).copied().ok_or_else(|| {
            let known = self.nodes.iter().map(|node| node.id.as_str());
            let message = match nearest(id, known.clone()) {
                Some(near) => format!("did you mean \"{near}\"?"),
                None => format!("there are {}", list(known)),
            };
            Error::invalid(format!("there is no node \"{id}\": {message}"))
        })
    }
}

impl GraphNode {
    /// The node as it is at all moments that are known.
    pub(super) fn all(&self) -> Vec<Arc<Checked>> {
        let others = self.others.lock().unwrap_or_else(PoisonError::into_inner);
        others.values().chain([&self.first]).cloned().collect()
    }
}
