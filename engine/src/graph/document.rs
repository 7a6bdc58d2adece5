//! Graph documents: RON, read in two passes.
//!
//! The first pass finds the nodes and keeps the text of each; the second parses every node by its own
//! kind. So the set of kinds stays open, every place in the text stays exact, and one run reports the
//! errors of all nodes.

use ron::value::RawValue;
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use std::fmt;
use std::ops::Range;

use super::diagnostic::Diagnostic;
use crate::text::{Index, list, nearest, offset_in_text, options, parse};

/// The version of the graph format that this library reads.
pub const VERSION: u32 = 1;

/// A graph's text and its nodes, not yet parsed.
#[derive(Clone, Debug)]
pub struct Document {
    /// The text.
    pub text: String,
    /// The nodes in the order of the text.
    pub nodes: Vec<RawNode>,
}

/// A node of the text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawNode {
    /// Its name in the graph.
    pub id: String,
    /// Where the name stands.
    pub id_span: Range<usize>,
    /// The kind of node.
    pub kind: String,
    /// Where its text, kind and fields, stands.
    pub span: Range<usize>,
    /// The text.
    pub text: String,
    /// Parameters that were set from outside, as `field=value`: with any, the text is not the
    /// document's.
    pub settings: Vec<String>,
}

#[derive(serde::Deserialize)]
#[serde(rename = "Graph", deny_unknown_fields)]
struct Raw<'a> {
    #[serde(default = "version")]
    version: u32,
    #[serde(borrow)]
    nodes: RawNodes<'a>,
}

fn version() -> u32 {
    VERSION
}

/// The nodes in order; doubles are kept, so that they can be reported.
struct RawNodes<'a>(Vec<(String, &'a RawValue)>);

impl<'de: 'a, 'a> Deserialize<'de> for RawNodes<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<RawNodes<'a>, D::Error> {
        struct Nodes;
        impl<'de> Visitor<'de> for Nodes {
            type Value = Vec<(String, &'de RawValue)>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("nodes by name, such as {\"eye\": Camera(..)}")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut nodes = Vec::new();
                while let Some(node) = map.next_entry()? {
                    nodes.push(node);
                }
                Ok(nodes)
            }
        }
        deserializer.deserialize_map(Nodes).map(RawNodes)
    }
}

impl Document {
    /// Finds the nodes of a graph's text.
    ///
    /// # Errors
    /// All that is wrong with the text's outer form: its syntax, its version, names that are no names.
    pub fn parse(text: &str) -> Result<Document, Vec<Diagnostic>> {
        // The version, and of each node the name and where its text begins and ends.
        let read = |text: &str| {
            let raw: Raw<'_> = options().from_str(text)?;
            let place = |value: &RawValue| {
                let body = value.trim().get_ron();
                let start = body.as_ptr() as usize - text.as_ptr() as usize;
                start..start + body.len()
            };
            let nodes = raw.nodes.0.into_iter().map(|(id, value)| (id, place(value)));
            Ok((raw.version, nodes.collect::<Vec<_>>()))
        };
        let parse::Parsed { value, mut faults, .. } = parse::parse(text, read);
        let index = Index::new(text);
        faults.extend(parse::doubles(&index));
        let Some((version, raw)) = value else { return Err(faults) };
        if version != VERSION {
            let message = format!("graph version {version}: this program reads {VERSION}");
            faults.push(Diagnostic::error(0..text.len().min(5), message));
        }
        let mut nodes: Vec<RawNode> = Vec::new();
        for (id, span) in raw {
            let body = &text[span.clone()];
            let id_span = index.item(index.at(span.start)).key.clone();
            let id_span = id_span.unwrap_or(span.start..span.start + 1);
            let kind: String =
                body.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            if !is_name(&id) {
                faults.push(
                    Diagnostic::error(id_span.clone(), format!("\"{id}\" is no name for a node"))
                        .label("only letters, digits and _, not beginning with a digit"),
                );
            }
            let text = body.to_owned();
            nodes.push(RawNode { id, id_span, kind, span, text, settings: Vec::new() });
        }
        faults.sort_by_key(|fault| fault.span.start);
        if faults.is_empty() { Ok(Document { text: text.to_owned(), nodes }) } else { Err(faults) }
    }

    /// Sets a parameter of a node, as if the text said so.
    ///
    /// # Errors
    /// If there is no such node, or its text has no list of fields.
    pub fn set(&mut self, id: &str, field: &str, value: &str) -> Result<(), String> {
        let names: Vec<String> = self.nodes.iter().map(|node| node.id.clone()).collect();
        let node = self.nodes.iter_mut().find(|node| node.id == id).ok_or_else(|| {
            let names = names.iter().map(String::as_str);
            match nearest(id, names.clone()) {
                Some(near) => format!("there is no node \"{id}\": did you mean \"{near}\"?"),
                None => format!("there is no node \"{id}\": there are {}", list(names)),
            }
        })?;
        node.settings.push(format!("{field}={value}"));
        match field_span(&node.text, field) {
            Some(span) => node.text.replace_range(span, value),
            None => {
                let end = node
                    .text
                    .rfind(')')
                    .ok_or_else(|| format!("\"{id}\" has no list of fields to set one in"))?;
                let body = node.text[..end].trim_end();
                let comma = if body.ends_with([',', '(']) { "" } else { "," };
                node.text = format!("{body}{comma} {field}: {value})");
            }
        }
        Ok(())
    }
}

impl RawNode {
    /// Where a place of its text stands in the document: with settings from outside, its name stands for all.
    pub(super) fn place(&self, place: Range<usize>) -> Range<usize> {
        match self.settings.is_empty() {
            true => self.span.start + place.start..self.span.start + place.end,
            false => self.id_span.clone(),
        }
    }

    /// Where a field's value stands in the document; the node as a whole if it is not there.
    pub fn field(&self, field: &str) -> Range<usize> {
        match field_span(&self.text, field) {
            Some(span) if self.settings.is_empty() => {
                self.span.start + span.start..self.span.start + span.end
            }
            _ => self.id_span.clone(),
        }
    }

    /// Where a byte of a field's text stands in the document, if the field is a text of the document.
    pub fn inside(&self, field: &str, byte: usize) -> Option<Range<usize>> {
        let span = field_span(&self.text, field).filter(|_| self.settings.is_empty())?;
        let start = self.span.start + span.start;
        let at = start + offset_in_text(&self.text[span.clone()], byte)?;
        Some(at..(at + 1).min(start + span.len()))
    }

    /// What a field says, if it is there.
    pub fn value(&self, field: &str) -> Option<&str> {
        field_span(&self.text, field).map(|span| &self.text[span])
    }

    /// Where the kind's name stands.
    pub fn kind_span(&self) -> Range<usize> {
        self.span.start..self.span.start + self.kind.len().max(1)
    }
}

fn is_name(id: &str) -> bool {
    let mut chars = id.chars();
    let first = chars.next();
    first.is_some_and(|c| c.is_alphabetic() || c == '_')
        && chars.all(|c| c.is_alphanumeric() || c == '_')
}

/// The bytes of a field's value in the text of a structure such as `Kind(a: 1, b: (2, 3))`.
pub(super) fn field_span(text: &str, field: &str) -> Option<Range<usize>> {
    Index::new(text).field(field)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_found_with_their_places() {
        let text = "Graph(nodes: {\n  \"é\": Camera(a: 1), // \"b\"\n  \"b\": Fog(),\n})";
        let document = Document::parse(text).unwrap();
        let texts: Vec<&str> = document.nodes.iter().map(|n| &text[n.span.clone()]).collect();
        assert_eq!(texts, ["Camera(a: 1)", "Fog()"]);
        assert_eq!(&text[document.nodes[0].id_span.clone()], "\"é\"");
        assert_eq!(document.nodes[1].kind, "Fog");
    }

    #[test]
    fn doubles_and_bad_names_are_all_reported() {
        let text = "Graph(nodes: {\"a\": A(), \"a\": B(), \"1x\": C(), \"a-b\": D()})";
        let faults = Document::parse(text).unwrap_err();
        assert_eq!(faults.len(), 3, "{faults:?}");
    }

    #[test]
    fn fields_are_set() {
        let mut document = Document::parse("Graph(nodes: {\"n\": K(a: 1), \"m\": K()})").unwrap();
        document.set("n", "a", "2").unwrap();
        document.set("n", "b", "3").unwrap();
        document.set("m", "a", "4").unwrap();
        assert_eq!(document.nodes[0].text, "K(a: 2, b: 3)");
        assert_eq!(document.nodes[1].text, "K( a: 4)");
        assert!(document.set("o", "a", "1").unwrap_err().contains("there is no node"));
    }

    #[test]
    fn syntax_errors_have_their_place() {
        let text = "Graph(\n  nodes: {\n    \"a\": Camera(,\n  }\n)";
        let faults = Document::parse(text).unwrap_err();
        assert!(faults[0].position(text).0 >= 3, "{:?}", faults[0].position(text));
    }
}
