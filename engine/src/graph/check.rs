//! Check: from a document to a graph, or to all of its errors.

use petgraph::algo::{tarjan_scc, toposort};
use petgraph::graph::{DiGraph, NodeIndex};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use super::catalogue::{self, Leaf};
use super::checked::{Checked, Graph, GraphNode, MOST_KEPT};
use super::diagnostic::{Diagnostic, list, nearest};
use super::document::{Document, RawNode, field_span};
use super::film::Film;
use super::link::is_file;
use super::node::AnyNode;
use super::registry::{Kind, Registry};
use crate::error::{Error, Result};
use crate::moment::{Frames, Moment};
use crate::text::index::{Index, Item};
use crate::text::{meant_path, parse};

/// A link before it is resolved.
pub(super) struct Wish {
    field: String,
    pub(super) of: String,
    reader: Option<String>,
    pub(super) target: String,
}

impl Graph {
    /// Checks a document for the first of its frames. Files are found from `directory`.
    ///
    /// # Errors
    /// All that is wrong with it.
    pub fn check(
        document: &Document,
        registry: &Registry,
        directory: &Path,
    ) -> Result<Graph, Vec<Diagnostic>> {
        let first = document.frames.as_ref().map_or(1, |frames| frames.as_slice()[0]);
        Graph::check_frames(document, registry, directory, &Frames::one(first))
    }

    /// Checks a document for frames. Files are found from `directory`.
    ///
    /// # Errors
    /// All that is wrong with it, each fault once; one that a later frame brings says which.
    pub fn check_frames(
        document: &Document,
        registry: &Registry,
        directory: &Path,
        frames: &Frames,
    ) -> Result<Graph, Vec<Diagnostic>> {
        let moments: Vec<Moment> =
            frames.as_slice().iter().map(|frame| document.moment(*frame as f64)).collect();
        let first = moments[0];
        let (film, faults) = Film::new(document, registry);
        let nodes = document.nodes.iter().map(|raw| {
            let kind = registry.kind(&raw.kind).cloned();
            Draft { id: raw.id.clone(), kind, ..Draft::default() }
        });
        let nodes = nodes.collect();
        let mut check = Check { document: &document.nodes, registry, directory, nodes, faults };
        let parameters = film.parameters(first, &mut check.faults);
        for i in 0..document.nodes.len() {
            check.add(&film, i, first);
        }
        for moment in &moments[1..] {
            let before = check.faults.len();
            if film.some_parameter_varies() {
                film.parameters(*moment, &mut check.faults);
            }
            for i in (0..document.nodes.len()).filter(|i| film.varies(*i)) {
                check.add(&film, i, *moment);
            }
            if check.are_new(before, *moment) >= MOST_FAULTS {
                break;
            }
        }
        let known = check.nodes.iter().enumerate().filter(|(_, draft)| !draft.instances.is_empty());
        let mut names: HashMap<String, usize> =
            known.map(|(i, draft)| (draft.id.clone(), i)).collect();
        check.link(&mut names);
        // Which files are written may be others at each frame.
        let writes =
            |draft: &Draft| draft.instances.iter().any(|made| !made.checked.writes.is_empty());
        let files_vary =
            (0..document.nodes.len()).any(|i| film.varies(i) && writes(&check.nodes[i]));
        let of_files = if files_vary { &moments[..] } else { &moments[..1] };
        for moment in of_files {
            let before = check.faults.len();
            check.outputs(*moment);
            if check.are_new(before, *moment) > before && *moment != first {
                break;
            }
        }
        let order = check.order();
        let Check { nodes, mut faults, .. } = check;
        if !faults.is_empty() {
            faults.sort_by_key(|fault| fault.span.start);
            return Err(faults);
        }
        let varies = |i: usize, draft: &Draft| film.varies(i) || draft.instances[0].checked.moves;
        let mut nodes: Vec<GraphNode> = nodes
            .into_iter()
            .enumerate()
            .map(|(i, draft)| {
                let varies = varies(i, &draft);
                draft.finished(varies)
            })
            .collect();
        // Users stand before what they use.
        for at in order.iter().rev() {
            let uses = nodes[*at].all().into_iter().flat_map(|checked| checked.links.clone());
            let varies = uses.into_iter().any(|link| nodes[link].varies);
            nodes[*at].varies |= varies;
        }
        let (directory, registry) = (directory.to_owned(), registry.clone());
        Ok(Graph { nodes, names, order, directory, first, parameters, film, registry })
    }
}

/// A node of a graph as it is at a moment, and its links, not yet resolved.
///
/// # Errors
/// If its text is none that can be read then.
pub(super) fn node_at(graph: &Graph, node: usize, moment: Moment) -> Result<(Checked, Vec<Wish>)> {
    let Graph { film, registry, directory, .. } = graph;
    let mut check =
        Check { document: &[], registry, directory, nodes: Vec::new(), faults: Vec::new() };
    let made = film.node(node, moment).map_err(|faults| check.faults.extend(faults));
    let made = made.ok().and_then(|raw| check.node(&raw, graph.nodes[node].kind.clone()));
    let (Some(made), []) = (made, &check.faults[..]) else {
        let fault = check.faults.first().map_or("", |fault| &fault.message);
        return Err(Error::invalid(format!("at frame {}: {fault}", moment.frame)));
    };
    Ok(made)
}

/// The most faults that are looked for at frames behind the first.
const MOST_FAULTS: usize = 20;

struct Check<'a> {
    document: &'a [RawNode],
    registry: &'a Registry,
    directory: &'a Path,
    /// Those of the document, then files that links name.
    nodes: Vec<Draft>,
    faults: Vec<Diagnostic>,
}

/// A node that is being checked.
#[derive(Default)]
struct Draft {
    id: String,
    kind: Option<Arc<Kind>>,
    /// As it is at the moments that were asked for, each text once.
    instances: Vec<Instance>,
    /// By their texts.
    texts: HashMap<String, usize>,
    /// Which of them it is at which moment, by its frame.
    moments: HashMap<u64, usize>,
}

/// A node at a moment that is being checked.
struct Instance {
    raw: RawNode,
    checked: Checked,
    /// The first moment at which it is so.
    moment: Moment,
    wishes: Vec<Wish>,
}

impl Draft {
    /// The node of the graph.
    fn finished(self, varies: bool) -> GraphNode {
        let Draft { id, instances, moments, .. } = self;
        let checked: Vec<Arc<Checked>> =
            instances.into_iter().map(|made| Arc::new(made.checked)).collect();
        // Those of a long film are made again when their frames come.
        let few = moments.into_iter().take(MOST_KEPT);
        let others = few.map(|(frame, at)| (frame, checked[at].clone()));
        let others = Mutex::new(others.collect());
        let first = checked[0].clone();
        GraphNode { id, kind: first.kind.clone(), varies, first, others }
    }

    /// The node at a moment; one that does not change in time is what it was at the first.
    fn at(&self, moment: Moment) -> Option<&Instance> {
        self.instances.get(self.moments.get(&moment.frame.to_bits()).copied().unwrap_or(0))
    }
}

impl Check<'_> {
    /// Adds a node of the document as it is at a moment. With a text that it had before, it is the same.
    fn add(&mut self, film: &Film, at: usize, moment: Moment) {
        let raw = match film.node(at, moment) {
            Ok(raw) => raw.into_owned(),
            Err(faults) => return self.faults.extend(faults),
        };
        let draft = &mut self.nodes[at];
        let frame = moment.frame.to_bits();
        if let Some(same) = draft.texts.get(raw.text.text()).copied() {
            draft.moments.insert(frame, same);
            return;
        }
        let Some(kind) = draft.kind.clone() else {
            let fault = self.unknown(&raw);
            return self.faults.push(fault);
        };
        let Some((checked, wishes)) = self.node(&raw, kind) else { return };
        let draft = &mut self.nodes[at];
        draft.moments.insert(frame, draft.instances.len());
        draft.texts.insert(raw.text.text().to_owned(), draft.instances.len());
        draft.instances.push(Instance { raw, checked, moment, wishes });
    }

    /// Keeps of the faults behind a number those of which none was told before at their places, and says at which moment
    /// they come; returns how many there are now.
    fn are_new(&mut self, before: usize, moment: Moment) -> usize {
        let is_first =
            |draft: &Draft| draft.instances.first().is_none_or(|made| made.moment == moment);
        let is_first = self.nodes.iter().all(is_first);
        for mut fault in self.faults.split_off(before) {
            if is_first || !self.faults.iter().any(|known| known.span == fault.span) {
                if !is_first {
                    fault.message += &format!(" (at frame {})", moment.frame);
                }
                self.faults.push(fault);
            }
        }
        self.faults.len()
    }

    /// Parses a node and finds its links.
    fn node(&mut self, raw: &RawNode, kind: Arc<Kind>) -> Option<(Checked, Vec<Wish>)> {
        let before = self.faults.len();
        let (node, unread) = self.parse(raw, &kind)?;
        let text = raw.text.text();
        let index = Index::new(text);
        for number in index.numbers() {
            let holds = |(_, item): &(&str, &Item)| item.value.contains(&number.start);
            let field = index.fields().find(holds).map_or("this", |(name, _)| name);
            let message = format!("`{field}`: {}", parse::NOT_FINITE);
            self.faults.push(Diagnostic::error(raw.place(number.clone()), message));
        }
        for (_, place) in index.texts() {
            if let Some(cure) = meant_path(&text[place.clone()]) {
                let message = "a backslash of this path stands for a control letter";
                let fault = Diagnostic::error(raw.place(place), message);
                self.faults.push(fault.help(format!("in a path write `/`: {cure}")));
            }
        }
        let (mut files, mut writes, mut wishes) = (Vec::new(), Vec::new(), Vec::new());
        let (faults, directory) = (&mut self.faults, self.directory);
        let parameters = node.parameters();
        catalogue::visit(&kind.schema, &parameters, &mut |field, leaf| match leaf {
            Leaf::Link { ref target, .. } if target.is_empty() && unread.contains(field) => {}
            Leaf::Input(ref path) if path.is_empty() && unread.contains(field) => {}
            Leaf::Link { of, reader, target } => {
                wishes.push(Wish { field: field.to_owned(), of, reader, target });
            }
            Leaf::Input(path) if path.is_empty() => faults.push(missing(raw, field, "a file")),
            Leaf::Input(path) => {
                faults.extend(absent(directory, &path, raw.field(field)));
                files.push(path);
            }
            Leaf::Output(path) if path.is_empty() => {}
            Leaf::Output(path) => {
                if let Err(message) = crate::output::check_name(&directory.join(&path)) {
                    let message = format!("`{field}`: \"{path}\": {message}");
                    faults.push(Diagnostic::error(raw.field(field), message));
                }
                writes.push((field.to_owned(), path));
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
        let nameless = catalogue::nameless(&kind.schema, &parameters);
        let (id, moves, links) = (raw.id.clone(), node.moves(directory), Vec::new());
        Some((Checked { id, kind, node, nameless, moves, files, writes, links }, wishes))
    }

    /// Resolves links: to nodes by name, to files by nodes that read them.
    fn link(&mut self, names: &mut HashMap<String, usize>) {
        // Names of nodes that have errors of their own are known, so that their users get none.
        let known: HashSet<&str> = self.document.iter().map(|raw| raw.id.as_str()).collect();
        for at in 0..self.document.len() {
            for which in 0..self.nodes[at].instances.len() {
                let before = self.faults.len();
                let wishes = std::mem::take(&mut self.nodes[at].instances[which].wishes);
                let links =
                    wishes.iter().filter_map(|wish| self.linked(at, which, wish, &known, names));
                let links: Vec<usize> = links.collect();
                self.nodes[at].instances[which].checked.links = links;
                if which > 0 {
                    self.are_new(before, self.nodes[at].instances[which].moment);
                }
            }
        }
    }

    /// The node that a link leads to, if it leads to one of the right type; if not, that is told.
    fn linked(
        &mut self,
        at: usize,
        which: usize,
        wish: &Wish,
        known: &HashSet<&str>,
        names: &mut HashMap<String, usize>,
    ) -> Option<usize> {
        let raw = &self.nodes[at].instances[which].raw;
        let span = link_span(raw, wish);
        if wish.target.is_empty() {
            self.faults.push(missing(raw, &wish.field, &format!("a {}", wish.of)));
            return None;
        }
        if !names.contains_key(&wish.target) && is_file(&wish.target) {
            self.read(wish, (at, which), span.clone(), names);
        }
        let Some(target) = names.get(&wish.target).copied() else {
            if !known.contains(wish.target.as_str()) && !is_file(&wish.target) {
                let fault =
                    Diagnostic::error(span, format!("there is no node \"{}\"", wish.target))
                        .label(format!("`{}` needs a {}", wish.field, wish.of));
                let nodes = self.nodes.iter().filter(|draft| !draft.instances.is_empty());
                let fault = match nearest(&wish.target, nodes.map(|draft| draft.id.as_str())) {
                    Some(near) => fault.help(format!("did you mean \"{near}\"?")),
                    None => fault,
                };
                self.faults.push(fault);
            }
            return None;
        };
        let made = |draft: &Draft| draft.kind.as_ref().is_some_and(|kind| kind.output == wish.of);
        if made(&self.nodes[target]) {
            return Some(target);
        }
        let (kind, output) =
            self.nodes[target].kind.as_ref().map_or(("", ""), |kind| (&kind.name, kind.output));
        let message = format!(
            "`{}` needs a {}, but \"{}\" is a {kind} and makes a {output}",
            wish.field, wish.of, wish.target
        );
        let fault = Diagnostic::error(span, message).label("wrong type");
        let fits =
            |(i, draft): &(usize, &Draft)| *i != at && made(draft) && !draft.instances.is_empty();
        let others: Vec<&str> = self
            .nodes
            .iter()
            .enumerate()
            .filter(fits)
            .map(|(_, draft)| draft.id.as_str())
            .collect();
        let fault = match others.len() {
            0 => fault,
            _ => fault.help(format!("nodes that make a {}: {}", wish.of, list(others))),
        };
        self.faults.push(fault);
        None
    }

    /// Adds a node that reads the file that a link names.
    fn read(
        &mut self,
        wish: &Wish,
        (at, which): (usize, usize),
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
        let node = match (kind.parse)(&text) {
            Ok(node) => node,
            Err(error) => {
                let message = format!("this file cannot be named: {error}");
                return self.faults.push(Diagnostic::error(span, message));
            }
        };
        if let Err(fault) = node.check() {
            self.faults.push(Diagnostic::error(span.clone(), fault.message));
        }
        self.faults.extend(absent(self.directory, &wish.target, span.clone()));
        names.insert(wish.target.clone(), self.nodes.len());
        let (id, files) = (wish.target.clone(), vec![wish.target.clone()]);
        let nameless = catalogue::nameless(&kind.schema, &node.parameters());
        let moves = node.moves(self.directory);
        let (writes, links) = (Vec::new(), Vec::new());
        let raw = RawNode::outside(&id, &kind.name, span, &text);
        let checked = Checked {
            id: id.clone(),
            kind: kind.clone(),
            node,
            nameless,
            moves,
            files,
            writes,
            links,
        };
        let moment = self.nodes[at].instances[which].moment;
        let instances = vec![Instance { raw, checked, moment, wishes: Vec::new() }];
        self.nodes.push(Draft { id, kind: Some(kind), instances, ..Draft::default() });
    }

    /// Reports nodes that write one file, or would overwrite a file that they are made from, at a moment.
    fn outputs(&mut self, moment: Moment) {
        use crate::output::real;
        let place = |file: &str| real(&self.directory.join(file));
        let nodes: Vec<Option<&Instance>> =
            self.nodes.iter().map(|draft| draft.at(moment)).collect();
        let made = || nodes.iter().enumerate().filter_map(|(i, made)| Some((i, (*made)?)));
        let read: HashSet<PathBuf> =
            made().flat_map(|(_, made)| &made.checked.files).map(|file| place(file)).collect();
        let mut faults = Vec::new();
        let mut written: HashMap<PathBuf, usize> = HashMap::new();
        for (writer, Instance { raw, checked, .. }) in made() {
            for (field, file) in &checked.writes {
                let path = place(file);
                if let Some(first) = written.get(&path) {
                    let first = &self.nodes[*first].id;
                    let message = format!("\"{first}\" and \"{}\" write the same file", raw.id);
                    let fault = Diagnostic::error(raw.field(field), message);
                    faults.push(fault.label("the second").help("name another file"));
                }
                let is_read = read.contains(&path) && {
                    let (mut open, mut seen) = (vec![writer], vec![false; nodes.len()]);
                    let mut is_read = false;
                    while let Some(at) = open.pop() {
                        let Some(made) =
                            nodes[at].filter(|_| !std::mem::replace(&mut seen[at], true))
                        else {
                            continue;
                        };
                        open.extend(&made.checked.links);
                        is_read |= made.checked.files.iter().any(|file| place(file) == path);
                    }
                    is_read
                };
                if is_read {
                    let message =
                        format!("\"{}\" would overwrite a file that it is made from", raw.id);
                    let fault = Diagnostic::error(raw.field(field), message);
                    faults.push(fault.label("is read too").help("name another file"));
                }
                written.insert(path, writer);
            }
        }
        self.faults.extend(faults);
    }

    /// Orders the nodes; reports every cycle with all nodes in it.
    fn order(&mut self) -> Vec<usize> {
        let mut graph = DiGraph::<usize, ()>::new();
        let indices: Vec<NodeIndex> = (0..self.nodes.len()).map(|i| graph.add_node(i)).collect();
        for (i, draft) in self.nodes.iter().enumerate() {
            for link in draft.instances.iter().flat_map(|made| &made.checked.links) {
                graph.update_edge(indices[i], indices[*link], ());
            }
        }
        for cycle in tarjan_scc(&graph) {
            let is_loop = cycle.len() > 1 || graph.contains_edge(cycle[0], cycle[0]);
            if is_loop {
                let mut ids: Vec<&str> =
                    cycle.iter().rev().map(|i| self.nodes[graph[*i]].id.as_str()).collect();
                // Begin with the node that stands first in the text.
                let first = ids
                    .iter()
                    .enumerate()
                    .min_by_key(|(_, id)| self.document.iter().position(|raw| raw.id == **id));
                let first = first.map_or(0, |(at, _)| at);
                ids.rotate_left(first);
                let raw = self.document.iter().find(|raw| raw.id == ids[0]);
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

    /// Parses a node. What is wrong is reported, and the rest is read without it, for all errors to be found at once;
    /// returns the names of the fields that something is wrong with.
    fn parse(&mut self, raw: &RawNode, kind: &Kind) -> Option<(Box<dyn AnyNode>, HashSet<String>)> {
        let parsed =
            parse::parse(raw.text.text(), |text| (kind.parse)(text).map_err(|error| *error));
        let index = Index::new(raw.text.text());
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
    let Some(span) = field_span(raw.text.text(), &wish.field) else {
        return raw.field(&wish.field);
    };
    // In a list of links, the one that is meant.
    let quoted = format!("\"{}\"", wish.target);
    match raw.text.text()[span.clone()].find(&quoted) {
        Some(at) => raw.place(span.start + at..span.start + at + quoted.len()),
        None => raw.place(span),
    }
}
