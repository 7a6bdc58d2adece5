//! A document in time: what its nodes and parameters say at a moment.

use std::borrow::Cow;
use std::collections::HashSet;
use std::ops::Range;

use super::diagnostic::{Diagnostic, list, nearest};
use super::document::{Document, RawNode, field_span};
use super::parameter::{self, ParameterInfo};
use super::registry::Registry;
use crate::moment::Moment;
use crate::motion::{Motion, Named, Names};

/// A document, some of whose values change in time or come from elsewhere.
pub(super) struct Film {
    nodes: Vec<Entry>,
    parameters: Vec<Entry>,
    registry: Registry,
}

/// A node or a parameter, and what moves in it.
struct Entry {
    raw: RawNode,
    motion: Motion,
    /// Whether it is another at another frame.
    varies: bool,
    /// Whether something in it that should move is faulty; that was told.
    is_faulty: bool,
}

impl Entry {
    fn new(
        raw: &RawNode,
        names_files: impl Fn(&str) -> bool,
        faults: &mut Vec<Diagnostic>,
    ) -> Entry {
        let (motion, found) = Motion::find(raw.text.text(), names_files);
        let is_faulty = !found.is_empty();
        faults.extend(found.into_iter().map(|mut fault| {
            fault.span = raw.place(fault.span);
            fault
        }));
        Entry { raw: raw.clone(), motion, varies: false, is_faulty }
    }

    fn whole(&self) -> Range<usize> {
        0..self.raw.text.text().len()
    }
}

impl Film {
    /// Finds what moves in a document, and what is wrong with it.
    pub(super) fn new(document: &Document, registry: &Registry) -> (Film, Vec<Diagnostic>) {
        let mut faults = Vec::new();
        let nodes = document.nodes.iter().map(|raw| {
            let kind = registry.kind(&raw.kind);
            let names_files = |field: &str| kind.is_some_and(|kind| kind.names_files(field));
            Entry::new(raw, names_files, &mut faults)
        });
        let nodes: Vec<Entry> = nodes.collect();
        let parameters = document.parameters.iter();
        let parameters = parameters.map(|raw| Entry::new(raw, |_| false, &mut faults)).collect();
        let mut film = Film { nodes, parameters, registry: registry.clone() };
        for raw in &document.parameters {
            if ["frame", "time"].contains(&&*raw.id) {
                let message =
                    format!("a parameter cannot be called \"{}\": expressions know it", raw.id);
                faults.push(Diagnostic::error(raw.id_span.clone(), message));
            }
        }
        for i in 0..film.nodes.len() {
            film.nodes[i].varies =
                film.part_varies(&film.nodes[i], &film.nodes[i].whole(), &mut HashSet::new());
        }
        (film, faults)
    }

    /// Whether a node's text is another at another frame.
    pub(super) fn varies(&self, node: usize) -> bool {
        self.nodes.get(node).is_some_and(|entry| entry.varies)
    }

    /// Whether a part of an entry is another at another frame; names that were looked at are not looked at again.
    fn part_varies<'a>(
        &'a self,
        entry: &'a Entry,
        part: &Range<usize>,
        seen: &mut HashSet<&'a str>,
    ) -> bool {
        entry.motion.depends_on_frame(part)
            || entry.motion.names(part).into_iter().any(|name| {
                let found = self.entry(name).ok().filter(|_| seen.insert(name));
                let found = found.and_then(|(entry, field)| {
                    Some((entry, field_span(entry.raw.text.text(), field)?))
                });
                found.is_some_and(|(entry, part)| self.part_varies(entry, &part, seen))
            })
    }

    /// What a name means, a parameter or `node.field`: where it stands, and the field.
    fn entry<'f, 'n>(&'f self, name: &'n str) -> Result<(&'f Entry, &'n str), String> {
        let known =
            |entries: &'f [Entry], id: &str| entries.iter().find(|entry| entry.raw.id == id);
        let meant = |what: &str, id: &str, entries: &'f [Entry]| {
            let ids = entries.iter().map(|entry| entry.raw.id.as_str());
            match nearest(id, ids.clone()) {
                Some(near) => format!("there is no {what} \"{id}\": did you mean \"{near}\"?"),
                None => format!("there is no {what} \"{id}\": there are {}", list(ids)),
            }
        };
        match name.split_once('.') {
            Some((id, field)) => {
                let entry = known(&self.nodes, id).ok_or_else(|| meant("node", id, &self.nodes))?;
                Ok((entry, field))
            }
            None => {
                let entry = known(&self.parameters, name);
                let entry = entry.ok_or_else(|| match known(&self.nodes, name) {
                    Some(_) => {
                        format!("\"{name}\" is a node: say which of its fields, as {name}.FIELD")
                    }
                    None => meant("parameter", name, &self.parameters),
                })?;
                Ok((entry, "default"))
            }
        }
    }

    /// A node as it is at a moment.
    pub(super) fn node(
        &self,
        at: usize,
        moment: Moment,
    ) -> Result<Cow<'_, RawNode>, Vec<Diagnostic>> {
        self.entry_at(&self.nodes[at], moment)
    }

    fn entry_at<'a>(
        &'a self,
        entry: &'a Entry,
        moment: Moment,
    ) -> Result<Cow<'a, RawNode>, Vec<Diagnostic>> {
        if entry.is_faulty {
            return Err(Vec::new());
        }
        if entry.motion.is_empty() {
            return Ok(Cow::Borrowed(&entry.raw));
        }
        let text = entry.motion.at(&entry.raw.text, moment, self)?;
        Ok(Cow::Owned(entry.raw.with(text)))
    }

    /// The parameters as they are at a moment; what is wrong with them is added to the faults.
    pub(super) fn parameters(
        &self,
        moment: Moment,
        faults: &mut Vec<Diagnostic>,
    ) -> Vec<ParameterInfo> {
        let mut infos = Vec::new();
        for entry in &self.parameters {
            let info = self.entry_at(entry, moment).and_then(|raw| parameter::check(&raw));
            match info {
                Ok(info) => infos.push(info),
                Err(found) => faults.extend(found),
            }
        }
        infos
    }

    /// Whether a parameter is another at another frame.
    pub(super) fn some_parameter_varies(&self) -> bool {
        self.parameters
            .iter()
            .any(|entry| self.part_varies(entry, &entry.whole(), &mut HashSet::new()))
    }
}

impl Names for Film {
    fn parameters(&self) -> Vec<&str> {
        self.parameters.iter().map(|entry| entry.raw.id.as_str()).collect()
    }

    fn find(&self, name: &str) -> Result<Named<'_>, String> {
        let (entry, field) = self.entry(name)?;
        if entry.is_faulty {
            return Err(format!("\"{name}\" is wrong itself"));
        }
        let text = entry.raw.text.text();
        if let Some(part) = field_span(text, field) {
            return Ok(Named::Part(text, part, &entry.motion));
        }
        let kind = self.registry.kind(&entry.raw.kind);
        let fields = kind.map(|kind| &kind.fields[..]).unwrap_or_default();
        if let Some(known) = fields.iter().find(|known| known.name == field) {
            let default = known.default.as_deref();
            return default.map(Named::Value).ok_or_else(|| format!("\"{name}\" is not given"));
        }
        let names = fields.iter().map(|field| field.name.as_str());
        let kind = &entry.raw.kind;
        Err(match nearest(field, names.clone()) {
            Some(near) => format!("a {kind} has no field `{field}`: did you mean `{near}`?"),
            None => format!("a {kind} has no field `{field}`: it has {}", list(names)),
        })
    }
}
