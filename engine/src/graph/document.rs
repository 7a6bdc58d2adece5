//! Graph documents: RON, read in two passes.
//!
//! The first pass finds the nodes and keeps the text of each; the second parses every node by its own
//! kind. So the set of kinds stays open, every place in the text stays exact, and one run reports the
//! errors of all nodes.

use ron::value::RawValue;
use serde::de::{Deserialize, DeserializeOwned, Deserializer, MapAccess, Visitor};
use std::fmt;
use std::ops::Range;

use super::diagnostic::Diagnostic;
use crate::text::{Index, list, nearest, offset_in_text, options, parse};

/// The version of the graph format that this library reads.
pub const VERSION: u32 = 1;

/// A graph's text and its nodes, not yet parsed.
#[derive(Clone, Debug)]
pub struct Document {
    /// The text of the file; behind it a line for each parameter that was [set](Document::set) from outside. Faults have
    /// their places in it.
    pub text: String,
    /// The nodes in the order of the text.
    pub nodes: Vec<RawNode>,
    /// Where the settings from outside begin in the text.
    outside: usize,
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
    /// The text, with what was set from outside.
    pub text: String,
    /// Where its pieces come from, in their order.
    pieces: Vec<TextPiece>,
}

/// A part of a node's text that stands as it is in the document's.
#[derive(Clone, Debug, PartialEq, Eq)]
struct TextPiece {
    /// Where it begins in the node's text.
    at: usize,
    /// Where it stands in the document's.
    origin: Range<usize>,
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
            let kind = kind_of(body);
            if !is_name(&id) {
                faults.push(
                    Diagnostic::error(id_span.clone(), format!("\"{id}\" is no name for a node"))
                        .label("only letters, digits and _, not beginning with a digit"),
                );
            }
            let text = body.to_owned();
            let pieces = vec![TextPiece { at: 0, origin: span.clone() }];
            nodes.push(RawNode { id, id_span, kind, span, text, pieces });
        }
        faults.sort_by_key(|fault| fault.span.start);
        if !faults.is_empty() {
            return Err(faults);
        }
        Ok(Document { text: text.to_owned(), nodes, outside: text.len() })
    }

    /// What a fault of the document blames: the text of the file or, if it is true, the settings from outside, a line
    /// each; and the fault with its places there.
    pub fn blamed(&self, fault: &Diagnostic) -> (bool, &str, Diagnostic) {
        let (file, outside) = self.text.split_at(self.outside);
        let is_outside = |place: &Range<usize>| place.start > self.outside;
        let is_set = is_outside(&fault.span);
        let (text, start) = if is_set { (&outside[1..], self.outside + 1) } else { (file, 0) };
        let moved = |place: &Range<usize>| place.start - start..place.end - start;
        // Only what stands there too can be shown beside it.
        let other = fault.other.as_ref().filter(|(place, _)| is_outside(place) == is_set);
        let other = other.map(|(place, label)| (moved(place), label.clone()));
        (is_set, text, Diagnostic { span: moved(&fault.span), other, ..fault.clone() })
    }

    /// Adds a node from outside: `text` is what the file would say, such as `Write(image: "a")`.
    pub fn add(&mut self, id: &str, text: &str) {
        self.text.push('\n');
        let at = self.text.len();
        self.text.push_str(&format!("{id}: {text}"));
        let span = self.text.len() - text.len()..self.text.len();
        let pieces = vec![TextPiece { at: 0, origin: span.clone() }];
        let (id, id_span, kind) = (id.to_owned(), at..at + id.len(), kind_of(text));
        self.nodes.push(RawNode { id, id_span, kind, span, text: text.to_owned(), pieces });
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
        let known = field_span(&node.text, field);
        if known.is_none() && !node.text.contains('(') {
            return Err(format!("\"{id}\" has no list of fields to set one in"));
        }
        self.text.push('\n');
        let start = self.text.len() + id.len() + 1;
        self.text.push_str(&format!("{id}.{field}={value}"));
        let (name, sign) =
            (start..start + field.len(), start + field.len()..start + field.len() + 1);
        let value_at = sign.end..self.text.len();
        match known {
            Some(span) => node.replace(span, &[(value, value_at)]),
            None => {
                // Behind the last field, before whatever comment follows it; or behind the bracket.
                let last = Index::new(&node.text).fields().map(|(_, item)| item.value.end).max();
                let place = last.unwrap_or_else(|| node.text.find('(').map_or(0, |at| at + 1));
                let (before, behind) = if last.is_some() { (", ", "") } else { ("", ", ") };
                let written = [
                    (before, name.start..name.start),
                    (field, name),
                    (": ", sign),
                    (value, value_at.clone()),
                    (behind, value_at.end..value_at.end),
                ];
                node.replace(place..place, &written);
            }
        }
        Ok(())
    }
}

impl RawNode {
    /// Replaces a part of the text by texts that stand elsewhere in the document's.
    fn replace(&mut self, place: Range<usize>, by: &[(&str, Range<usize>)]) {
        let text: String = by.iter().map(|(text, _)| *text).collect();
        let ends = self.pieces[1..].iter().map(|piece| piece.at).chain([self.text.len()]);
        let mut pieces = Vec::new();
        let mut behind = Vec::new();
        for (TextPiece { at, origin }, end) in self.pieces.iter().zip(ends) {
            // What is left of it before the place and behind.
            if *at < place.start {
                pieces.push(TextPiece { at: *at, origin: origin.clone() });
            }
            if end > place.end {
                let from = (*at).max(place.end);
                let origin = (origin.start + from - at).min(origin.end)..origin.end;
                behind.push(TextPiece { at: from - place.end + place.start + text.len(), origin });
            }
        }
        let mut at = place.start;
        for (text, origin) in by {
            pieces.push(TextPiece { at, origin: origin.clone() });
            at += text.len();
        }
        pieces.append(&mut behind);
        self.text.replace_range(place, &text);
        self.pieces = pieces;
    }

    /// Where a byte of its text stands in the document's, and where the piece that it is in ends there.
    fn origin(&self, at: usize) -> (usize, usize) {
        let piece = &self.pieces[self.pieces.partition_point(|p| p.at <= at).saturating_sub(1)];
        ((piece.origin.start + at - piece.at).min(piece.origin.end), piece.origin.end)
    }

    /// Where a place of its text stands in the document's.
    pub(super) fn place(&self, place: Range<usize>) -> Range<usize> {
        let (start, till) = self.origin(place.start);
        let (last, _) = self.origin(place.end.max(place.start + 1) - 1);
        // A place that ends in another piece: as much of it as stands together.
        let end = if (start..till).contains(&last) { last + 1 } else { till };
        if place.is_empty() { start..start } else { start..end.max(start) }
    }

    /// Where a field's value stands in the document's text; the node as a whole if it is not there.
    pub fn field(&self, field: &str) -> Range<usize> {
        field_span(&self.text, field).map_or_else(|| self.id_span.clone(), |span| self.place(span))
    }

    /// Where a byte of a field's text stands in the document's, if the field is a text.
    pub fn inside(&self, field: &str, byte: usize) -> Option<Range<usize>> {
        let span = field_span(&self.text, field)?;
        let at = span.start + offset_in_text(&self.text[span.clone()], byte)?;
        Some(self.place(at..(at + 1).min(span.end)))
    }

    /// A field's value, if it is there and is one of the type.
    pub fn parsed<T: DeserializeOwned>(&self, field: &str) -> Option<T> {
        options().from_str(self.value(field)?).ok()
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

/// The name with which a node's text begins.
fn kind_of(text: &str) -> String {
    text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
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
        assert_eq!(document.nodes[1].text, "K(a: 4, )");
        let said = |node: usize, field| &document.text[document.nodes[node].field(field)];
        assert_eq!([said(0, "a"), said(0, "b"), said(1, "a")], ["2", "3", "4"]);
        assert!(document.text.ends_with("\nn.a=2\nn.b=3\nm.a=4"), "{}", document.text);
        let commented = "Graph(nodes: {\"n\": K(\n  a: 1, // one\n  // and no more\n)})";
        let mut document = Document::parse(commented).unwrap();
        document.set("n", "b", "3").unwrap();
        assert_eq!(document.nodes[0].text, "K(\n  a: 1, b: 3, // one\n  // and no more\n)");
        assert!(document.set("o", "a", "1").unwrap_err().contains("there is no node"));
    }

    #[test]
    fn syntax_errors_have_their_place() {
        let text = "Graph(\n  nodes: {\n    \"a\": Camera(,\n  }\n)";
        let faults = Document::parse(text).unwrap_err();
        assert!(faults[0].position(text).0 >= 3, "{:?}", faults[0].position(text));
    }
}
