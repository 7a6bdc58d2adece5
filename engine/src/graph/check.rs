//! Check: from a document to a graph, or to all of its errors.

use petgraph::algo::{tarjan_scc, toposort};
use petgraph::graph::{DiGraph, NodeIndex};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::catalogue::{self, Leaf};
use super::diagnostic::{Diagnostic, list, nearest};
use super::document::{Document, RawNode, field_span};
use super::link::is_file;
use super::node::AnyNode;
use super::registry::{Kind, Registry};
use crate::error::{Error, Result};
use crate::text::index::{Index, Item};
use crate::text::{meant_path, parse};

/// A checked graph: every node parsed, every link resolved and of the right type, without cycles.
pub struct Graph {
    pub(super) nodes: Vec<Checked>,
    pub(super) names: HashMap<String, usize>,
    /// Nodes, those that use others before those that they use.
    pub(super) order: Vec<usize>,
    pub(super) directory: PathBuf,
}

/// A checked node.
pub(super) struct Checked {
    pub(super) id: String,
    pub(super) kind: Arc<Kind>,
    pub(super) node: Box<dyn AnyNode>,
    /// What it is asked to do, whatever its inputs are called.
    pub(super) nameless: serde_json::Value,
    pub(super) files: Vec<String>,
    /// The fields that name files which it writes, and the files.
    writes: Vec<(String, String)>,
    links: Vec<usize>,
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
    /// The names of the nodes that it uses.
    pub uses: Vec<&'g str>,
    /// The fields that name files which it writes, and the files, as the graph has them.
    pub writes: Vec<(&'g str, &'g str)>,
}

/// A link before it is resolved.
struct Wish {
    from: usize,
    field: String,
    of: String,
    reader: Option<String>,
    target: String,
}

impl Graph {
    /// Checks a document. Files are found from `directory`.
    ///
    /// # Errors
    /// All that is wrong with it.
    pub fn check(
        document: &Document,
        registry: &Registry,
        directory: &Path,
    ) -> Result<Graph, Vec<Diagnostic>> {
        let mut check = Check {
            document,
            registry,
            directory,
            nodes: Vec::new(),
            wishes: Vec::new(),
            outputs: HashMap::new(),
            faults: Vec::new(),
        };
        for raw in &document.nodes {
            check.node(raw);
        }
        let mut names: HashMap<String, usize> =
            check.nodes.iter().enumerate().map(|(i, node)| (node.id.clone(), i)).collect();
        check.link(&mut names);
        check.overwritten();
        let order = check.order();
        let Check { nodes, mut faults, .. } = check;
        if !faults.is_empty() {
            faults.sort_by_key(|fault| fault.span.start);
            return Err(faults);
        }
        Ok(Graph { nodes, names, order, directory: directory.to_owned() })
    }

    /// The nodes in the order of the document, files that links name after them.
    pub fn nodes(&self) -> impl Iterator<Item = NodeInfo<'_>> {
        self.nodes.iter().map(|node| NodeInfo {
            id: &node.id,
            kind: &node.kind.name,
            output: node.kind.output,
            uses: node.links.iter().map(|link| self.nodes[*link].id.as_str()).collect(),
            writes: node.writes.iter().map(|(field, file)| (&**field, &**file)).collect(),
        })
    }

    /// The folder from which files are found.
    pub fn directory(&self) -> &Path {
        &self.directory
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

struct Check<'a> {
    document: &'a Document,
    registry: &'a Registry,
    directory: &'a Path,
    nodes: Vec<Checked>,
    wishes: Vec<Wish>,
    /// The files that are written, by which node, and where that is said.
    outputs: HashMap<PathBuf, (usize, std::ops::Range<usize>)>,
    faults: Vec<Diagnostic>,
}

impl Check<'_> {
    /// Parses a node and finds its links.
    fn node(&mut self, raw: &RawNode) {
        let Some(kind) = self.registry.kind(&raw.kind).cloned() else {
            self.faults.push(self.unknown(raw));
            return;
        };
        let before = self.faults.len();
        let Some((node, unread)) = self.parse(raw, &kind) else { return };
        let index = Index::new(&raw.text);
        for number in index.numbers() {
            let holds = |(_, item): &(&str, &Item)| item.value.contains(&number.start);
            let field = index.fields().find(holds).map_or("this", |(name, _)| name);
            let message = format!("`{field}`: {}", parse::NOT_FINITE);
            self.faults.push(Diagnostic::error(raw.place(number.clone()), message));
        }
        for (_, place) in index.texts() {
            if let Some(cure) = meant_path(&raw.text[place.clone()]) {
                let message = "a backslash of this path stands for a control letter";
                let fault = Diagnostic::error(raw.place(place), message);
                self.faults.push(fault.help(format!("in a path write `/`: {cure}")));
            }
        }
        let from = self.nodes.len();
        let (mut files, mut writes) = (Vec::new(), Vec::new());
        let (wishes, faults, outputs) = (&mut self.wishes, &mut self.faults, &mut self.outputs);
        let nodes = &self.nodes;
        let directory = self.directory;
        let parameters = node.parameters();
        catalogue::visit(&kind.schema, &parameters, &mut |field, leaf| match leaf {
            Leaf::Link { ref target, .. } if target.is_empty() && unread.contains(field) => {}
            Leaf::Input(ref path) if path.is_empty() && unread.contains(field) => {}
            Leaf::Link { of, reader, target } => {
                wishes.push(Wish { from, field: field.to_owned(), of, reader, target });
            }
            Leaf::Input(path) if path.is_empty() => faults.push(missing(raw, field, "a file")),
            Leaf::Input(path) => {
                faults.extend(absent(directory, &path, raw.field(field)));
                files.push(path);
            }
            Leaf::Output(path) if path.is_empty() => {}
            Leaf::Output(path) => {
                let place = directory.join(&path);
                if let Err(message) = crate::output::check_name(&place) {
                    let message = format!("`{field}`: \"{path}\": {message}");
                    faults.push(Diagnostic::error(raw.field(field), message));
                }
                writes.push((field.to_owned(), path));
                let place = crate::output::real(&place);
                if let Some((first, _)) = outputs.insert(place, (from, raw.field(field))) {
                    let first = nodes.get(first).map_or(&raw.id, |node| &node.id);
                    let message = format!("\"{first}\" and \"{}\" write the same file", raw.id);
                    let fault = Diagnostic::error(raw.field(field), message);
                    faults.push(fault.label("the second").help("name another file"));
                }
            }
            Leaf::OutOfRange(message) => {
                faults.push(Diagnostic::error(raw.field(field), format!("`{field}`: {message}")));
            }
        });
        if self.faults.len() == before
            && let Err(fault) = node.check()
        {
            let message = format!("`{}`: {}", fault.field, fault.message);
            let span = fault.at.and_then(|at| raw.inside(&fault.field, at));
            let span = span.unwrap_or_else(|| raw.field(&fault.field));
            self.faults.push(Diagnostic::error(span, message));
        }
        let id = raw.id.clone();
        let nameless = catalogue::nameless(&kind.schema, &parameters);
        self.nodes.push(Checked { id, kind, node, nameless, files, writes, links: Vec::new() });
    }

    /// Parses a node. What is wrong is reported, and the rest is read without it, for all errors to be found at once;
    /// returns the names of the fields that something is wrong with.
    fn parse(&mut self, raw: &RawNode, kind: &Kind) -> Option<(Box<dyn AnyNode>, HashSet<String>)> {
        let parsed = parse::parse(&raw.text, |text| (kind.parse)(text).map_err(|error| *error));
        let index = Index::new(&raw.text);
        let mut unread = HashSet::new();
        for mut fault in parsed.faults {
            let at = fault.span.start;
            // Where one ends, the next may begin.
            let blamed =
                index.fields().filter(|(_, item)| item.whole.start <= at && at <= item.whole.end);
            let blamed = blamed.last().map(|(name, _)| name);
            unread.extend(blamed.map(str::to_owned));
            let known = kind.fields.iter().find(|known| Some(known.name.as_str()) == blamed);
            fault.help = fault.help.or_else(|| match known {
                Some(known) => Some(format!("`{}` takes {}", known.name, known.kind)),
                None => Some(format!(
                    "write the kind's name and its fields, such as {}(), even if there are none",
                    kind.name
                )),
            });
            fault.span = raw.place(fault.span);
            fault.other = fault.other.map(|(span, label)| (raw.place(span), label));
            self.faults.push(fault);
        }
        parsed.value.map(|node| (node, unread))
    }

    fn unknown(&self, raw: &RawNode) -> Diagnostic {
        let fault =
            Diagnostic::error(raw.kind_span(), format!("there is no kind of node `{}`", raw.kind))
                .label("unknown kind");
        if let Some(known) = self.registry.by_alias(&raw.kind) {
            return fault.help(format!("`{}` is called `{}` here", raw.kind, known.name));
        }
        match nearest(&raw.kind, self.registry.kinds().map(|kind| kind.name.as_str())) {
            Some(near) => fault.help(format!("did you mean `{near}`?")),
            None => fault.help("`spandrel nodes` lists all kinds"),
        }
    }

    /// Resolves links: to nodes by name, to files by nodes that read them.
    fn link(&mut self, names: &mut HashMap<String, usize>) {
        // Names of nodes that have errors of their own are known, so that their users get none.
        let document: HashMap<&str, &RawNode> =
            self.document.nodes.iter().map(|raw| (raw.id.as_str(), raw)).collect();
        for wish in std::mem::take(&mut self.wishes) {
            let raw = document.get(self.nodes[wish.from].id.as_str()).copied();
            let Some(raw) = raw else { continue };
            let span = || link_span(raw, &wish);
            if wish.target.is_empty() {
                self.faults.push(missing(raw, &wish.field, &format!("a {}", wish.of)));
                continue;
            }
            if !names.contains_key(&wish.target) && is_file(&wish.target) {
                self.read(&wish, span(), names);
            }
            let Some(target) = names.get(&wish.target).copied() else {
                if !document.contains_key(wish.target.as_str()) && !is_file(&wish.target) {
                    let fault =
                        Diagnostic::error(span(), format!("there is no node \"{}\"", wish.target))
                            .label(format!("`{}` needs a {}", wish.field, wish.of));
                    let known = self.nodes.iter().map(|node| node.id.as_str());
                    self.faults.push(match nearest(&wish.target, known) {
                        Some(near) => fault.help(format!("did you mean \"{near}\"?")),
                        None => fault,
                    });
                }
                continue;
            };
            let kind = &self.nodes[target].kind;
            if kind.output != wish.of {
                let message = format!(
                    "`{}` needs a {}, but \"{}\" is a {} and makes a {}",
                    wish.field, wish.of, wish.target, kind.name, kind.output
                );
                let fault = Diagnostic::error(span(), message).label("wrong type");
                let fits = |node: &&Checked| node.kind.output == wish.of && node.id != raw.id;
                let others: Vec<&str> =
                    self.nodes.iter().filter(fits).map(|node| node.id.as_str()).collect();
                self.faults.push(match others.len() {
                    0 => fault,
                    _ => fault.help(format!("nodes that make a {}: {}", wish.of, list(others))),
                });
                continue;
            }
            self.nodes[wish.from].links.push(target);
        }
    }

    /// Adds a node that reads the file that a link names.
    fn read(
        &mut self,
        wish: &Wish,
        span: std::ops::Range<usize>,
        names: &mut HashMap<String, usize>,
    ) {
        let kind = wish.reader.as_ref().and_then(|name| self.registry.kind(name)).cloned();
        let Some(kind) = kind else {
            let message =
                format!("\"{}\" is a file, but a {} cannot be read from one", wish.target, wish.of);
            self.faults.push(
                Diagnostic::error(span, message)
                    .help(format!("link a node that makes a {}", wish.of)),
            );
            return;
        };
        let text = format!("{}(file: {:?})", kind.name, wish.target);
        match (kind.parse)(&text) {
            Ok(node) => {
                if let Err(fault) = node.check() {
                    self.faults.push(Diagnostic::error(span.clone(), fault.message));
                }
                self.faults.extend(absent(self.directory, &wish.target, span));
                names.insert(wish.target.clone(), self.nodes.len());
                let files = vec![wish.target.clone()];
                let id = wish.target.clone();
                let (writes, links) = (Vec::new(), Vec::new());
                let nameless = catalogue::nameless(&kind.schema, &node.parameters());
                self.nodes.push(Checked { id, kind, node, nameless, files, writes, links });
            }
            Err(error) => {
                self.faults
                    .push(Diagnostic::error(span, format!("this file cannot be named: {error}")));
            }
        }
    }

    /// Reports every node that would overwrite a file which it is made from.
    fn overwritten(&mut self) {
        use crate::output::real;
        let readers = self.nodes.iter().flat_map(|node| &node.files);
        let read: HashSet<PathBuf> = readers.map(|file| real(&self.directory.join(file))).collect();
        for (path, (writer, span)) in &self.outputs {
            if !read.contains(path) {
                continue;
            }
            let (mut open, mut seen) = (vec![*writer], vec![false; self.nodes.len()]);
            while let Some(at) = open.pop() {
                if std::mem::replace(&mut seen[at], true) {
                    continue;
                }
                let node = &self.nodes[at];
                open.extend(&node.links);
                if node.files.iter().any(|file| real(&self.directory.join(file)) == *path) {
                    let writer = &self.nodes[*writer].id;
                    let message =
                        format!("\"{writer}\" would overwrite a file that it is made from");
                    let fault = Diagnostic::error(span.clone(), message);
                    self.faults.push(fault.label("is read too").help("name another file"));
                    break;
                }
            }
        }
    }

    /// Orders the nodes; reports every cycle with all nodes in it.
    fn order(&mut self) -> Vec<usize> {
        let mut graph = DiGraph::<usize, ()>::new();
        let indices: Vec<NodeIndex> = (0..self.nodes.len()).map(|i| graph.add_node(i)).collect();
        for (i, node) in self.nodes.iter().enumerate() {
            for link in &node.links {
                graph.add_edge(indices[i], indices[*link], ());
            }
        }
        for cycle in tarjan_scc(&graph) {
            let is_loop = cycle.len() > 1 || graph.contains_edge(cycle[0], cycle[0]);
            if is_loop {
                let mut ids: Vec<&str> =
                    cycle.iter().rev().map(|i| self.nodes[graph[*i]].id.as_str()).collect();
                // Begin with the node that stands first in the text.
                let first = ids.iter().enumerate().min_by_key(|(_, id)| {
                    self.document.nodes.iter().position(|raw| raw.id == **id)
                });
                let first = first.map_or(0, |(at, _)| at);
                ids.rotate_left(first);
                let raw = self.document.nodes.iter().find(|raw| raw.id == ids[0]);
                let span = raw.map_or(0..1, |raw| raw.id_span.clone());
                let way = ids.join("\" uses \"");
                let message =
                    format!("nodes use each other in a circle: \"{way}\" uses \"{}\"", ids[0]);
                self.faults.push(Diagnostic::error(span, message).label("one of them"));
            }
        }
        toposort(&graph, None)
            .map_or_else(|_| Vec::new(), |order| order.iter().map(|i| graph[*i]).collect())
    }
}

/// What is wrong with a file that is to be read, if it is not there.
fn absent(directory: &Path, file: &str, span: std::ops::Range<usize>) -> Option<Diagnostic> {
    let path = directory.join(file);
    if path.exists() {
        return None;
    }
    let message = format!("there is no file {}", crate::output::tidy(&path).display());
    let fault = Diagnostic { is_input: true, ..Diagnostic::error(span, message) };
    Some(match crate::open::beside(&path) {
        Some(near) => fault.help(format!("did you mean \"{near}\"?")),
        None if directory.as_os_str().is_empty() => {
            fault.help("paths begin at the current folder, in which the graph is")
        }
        None => fault.help("paths begin at the graph's own folder"),
    })
}

fn missing(raw: &RawNode, field: &str, what: &str) -> Diagnostic {
    Diagnostic::error(raw.id_span.clone(), format!("\"{}\" needs {what}", raw.id))
        .label(format!("`{field}` is not given"))
        .help(format!("add `{field}: \"...\"`; `spandrel nodes {}` says more", raw.kind))
}

/// Where a link's target stands.
fn link_span(raw: &RawNode, wish: &Wish) -> std::ops::Range<usize> {
    let Some(span) = field_span(&raw.text, &wish.field) else { return raw.field(&wish.field) };
    // In a list of links, the one that is meant.
    let quoted = format!("\"{}\"", wish.target);
    match raw.text[span.clone()].find(&quoted) {
        Some(at) => raw.place(span.start + at..span.start + at + quoted.len()),
        None => raw.place(span),
    }
}
