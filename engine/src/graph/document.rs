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
use crate::moment::{Frames, Moment};
use crate::motion::curve::NAMED;
use crate::text::{Index, Patch, Woven, list, nearest, offset_in_text, options, parse};

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
    /// The graph's parameters, by name: what kind each is, and its fields, of which `default` is its value.
    pub parameters: Vec<RawNode>,
    /// The frames that are rendered if nobody says which.
    pub frames: Option<Frames>,
    /// Frames of a second.
    pub rate: f64,
    /// Where the settings from outside begin in the text.
    outside: usize,
}

/// A node of the text, or a parameter of the graph.
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
    pub text: Woven,
}

#[derive(serde::Deserialize)]
#[serde(rename = "Graph", deny_unknown_fields)]
struct Raw<'a> {
    #[serde(default = "version")]
    version: u32,
    #[serde(default)]
    frames: Option<String>,
    #[serde(default = "rate")]
    rate: f64,
    #[serde(borrow, default)]
    parameters: RawNodes<'a>,
    #[serde(borrow)]
    nodes: RawNodes<'a>,
}

fn version() -> u32 {
    VERSION
}

fn rate() -> f64 {
    Moment::RATE
}

/// What the outer form of a graph's text says.
struct Outline {
    version: u32,
    frames: Option<String>,
    rate: f64,
    /// Names, and where what they name begins and ends.
    parameters: Vec<(String, Range<usize>)>,
    nodes: Vec<(String, Range<usize>)>,
}

/// The nodes in order; doubles are kept, so that they can be reported.
#[derive(Default)]
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
        let read = |text: &str| {
            let raw: Raw<'_> = options().from_str(text)?;
            let place = |(id, value): (String, &RawValue)| {
                let body = value.trim().get_ron();
                let start = body.as_ptr() as usize - text.as_ptr() as usize;
                (id, start..start + body.len())
            };
            let Raw { version, frames, rate, parameters, nodes } = raw;
            let parameters = parameters.0.into_iter().map(place).collect();
            let nodes = nodes.0.into_iter().map(place).collect();
            Ok(Outline { version, frames, rate, parameters, nodes })
        };
        let parse::Parsed { value, mut faults, .. } = parse::parse(text, read);
        let index = Index::new(text);
        faults.extend(parse::doubles(&index));
        for fault in &mut faults {
            // A `:` behind values without names.
            let before = &text[..text.floor_char_boundary(fault.span.start)];
            let curve = before.rfind("Curve(").map(|at| &before[at..]);
            if curve.is_some_and(|curve| curve.matches('(').count() > curve.matches(')').count()) {
                fault.help = Some(NAMED.to_owned());
            }
        }
        let Some(Outline { version, frames, rate, parameters, nodes }) = value else {
            return Err(faults);
        };
        if version != VERSION {
            let message = format!("graph version {version}: this program reads {VERSION}");
            faults.push(Diagnostic::error(0..text.len().min(5), message));
        }
        let field = |name: &str| index.field(name).unwrap_or(0..text.len().min(5));
        let frames = frames.and_then(|frames| {
            let parsed = frames.parse();
            parsed.map_err(|fault| faults.push(Diagnostic::error(field("frames"), fault))).ok()
        });
        if !(rate > 0.0 && rate <= 1e6) {
            let message = format!("`rate` is {rate}: frames of a second, a number above 0");
            faults.push(Diagnostic::error(field("rate"), message));
        }
        let mut raw = |what: &str, (id, span): (String, Range<usize>)| {
            let body = &text[span.clone()];
            let id_span = index.item(index.at(span.start)).key.clone();
            let id_span = id_span.unwrap_or(span.start..span.start + 1);
            let kind = kind_of(body);
            if !is_name(&id) {
                faults.push(
                    Diagnostic::error(id_span.clone(), format!("\"{id}\" is no name for a {what}"))
                        .label("only letters, digits and _, not beginning with a digit"),
                );
            }
            let text = Woven::new(body, span.clone());
            RawNode { id, id_span, kind, span, text }
        };
        let nodes: Vec<RawNode> = nodes.into_iter().map(|node| raw("node", node)).collect();
        let parameters: Vec<RawNode> =
            parameters.into_iter().map(|parameter| raw("parameter", parameter)).collect();
        faults.sort_by_key(|fault| fault.span.start);
        if !faults.is_empty() {
            return Err(faults);
        }
        let outside = text.len();
        Ok(Document { text: text.to_owned(), nodes, parameters, frames, rate, outside })
    }

    /// A frame as a moment, at the graph's rate.
    pub fn moment(&self, frame: f64) -> Moment {
        Moment { frame, rate: self.rate }
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
        let (id, id_span, kind) = (id.to_owned(), at..at + id.len(), kind_of(text));
        let text = Woven::new(text, span.clone());
        self.nodes.push(RawNode { id, id_span, kind, span, text });
    }

    /// Sets a field of a node, as if the text said so.
    ///
    /// # Errors
    /// If there is no such node, or its text has no list of fields.
    pub fn set(&mut self, id: &str, field: &str, value: &str) -> Result<(), String> {
        let node = found(&mut self.nodes, id, "node")?;
        node.set(&mut self.text, &format!("{id}.{field}"), field, value)
    }

    /// Sets a parameter of the graph, as if the text said so.
    ///
    /// # Errors
    /// If there is no such parameter.
    pub fn set_parameter(&mut self, name: &str, value: &str) -> Result<(), String> {
        let parameter = found(&mut self.parameters, name, "parameter")?;
        parameter.set(&mut self.text, name, "default", value)
    }
}

/// The node or parameter of a name.
fn found<'n>(all: &'n mut [RawNode], id: &str, what: &str) -> Result<&'n mut RawNode, String> {
    let names: Vec<String> = all.iter().map(|raw| raw.id.clone()).collect();
    all.iter_mut().find(|raw| raw.id == id).ok_or_else(|| {
        let names = names.iter().map(String::as_str);
        match nearest(id, names.clone()) {
            Some(near) => format!("there is no {what} \"{id}\": did you mean \"{near}\"?"),
            None => format!("there is no {what} \"{id}\": there are {}", list(names)),
        }
    })
}

impl RawNode {
    /// Sets a field; `said` is how the user named it, for the line that is added to the document.
    fn set(
        &mut self,
        document: &mut String,
        said: &str,
        field: &str,
        value: &str,
    ) -> Result<(), String> {
        let known = field_span(self.text.text(), field);
        if known.is_none() && !self.text.text().contains('(') {
            return Err(format!("\"{}\" has no list of fields to set one in", self.id));
        }
        document.push('\n');
        let start = document.len();
        document.push_str(&format!("{said}={value}"));
        // The name is the last part of what was said, or stands for it.
        let sign = start + said.len()..start + said.len() + 1;
        let name = sign.start - field.len().min(said.len())..sign.start;
        let value_at = sign.end..document.len();
        match known {
            Some(span) => self.text.replace(span, &[Patch::of(value, value_at)]),
            None => {
                // Behind the last field, before whatever comment follows it; or behind the bracket.
                let text = self.text.text();
                let last = Index::new(text).fields().map(|(_, item)| item.value.end).max();
                let place = last.unwrap_or_else(|| text.find('(').map_or(0, |at| at + 1));
                let (before, behind) = if last.is_some() { (", ", "") } else { ("", ", ") };
                let written = [
                    Patch::of(before, name.start..name.start),
                    Patch::of(field, name),
                    Patch::of(": ", sign),
                    Patch::of(value, value_at.clone()),
                    Patch::of(behind, value_at.end..value_at.end),
                ];
                self.text.replace(place..place, &written);
            }
        }
        Ok(())
    }

    /// Where a place of its text stands in the document's.
    pub(super) fn place(&self, place: Range<usize>) -> Range<usize> {
        self.text.place(place)
    }

    /// A node that the document does not have: it stands for a link that names a file.
    pub(super) fn outside(id: &str, kind: &str, span: Range<usize>, text: &str) -> RawNode {
        let text = Woven::new(text, span.clone());
        let (id, kind) = (id.to_owned(), kind.to_owned());
        RawNode { id, id_span: span.clone(), kind, span, text }
    }

    /// The same node with another text.
    pub(super) fn with(&self, text: Woven) -> RawNode {
        RawNode { text, ..self.clone() }
    }

    /// Where a field's value stands in the document's text; the node as a whole if it is not there.
    pub fn field(&self, field: &str) -> Range<usize> {
        field_span(self.text.text(), field)
            .map_or_else(|| self.id_span.clone(), |span| self.place(span))
    }

    /// Where a byte of a field's text stands in the document's, if the field is a text.
    pub fn inside(&self, field: &str, byte: usize) -> Option<Range<usize>> {
        let span = field_span(self.text.text(), field)?;
        let at = span.start + offset_in_text(&self.text.text()[span.clone()], byte)?;
        Some(self.place(at..(at + 1).min(span.end)))
    }

    /// A field's value, if it is there and is one of the type.
    pub fn parsed<T: DeserializeOwned>(&self, field: &str) -> Option<T> {
        options().from_str(self.value(field)?).ok()
    }

    /// What a field says, if it is there.
    pub fn value(&self, field: &str) -> Option<&str> {
        field_span(self.text.text(), field).map(|span| &self.text.text()[span])
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
        assert_eq!(document.nodes[0].text.text(), "K(a: 2, b: 3)");
        assert_eq!(document.nodes[1].text.text(), "K(a: 4, )");
        let said = |node: usize, field| &document.text[document.nodes[node].field(field)];
        assert_eq!([said(0, "a"), said(0, "b"), said(1, "a")], ["2", "3", "4"]);
        assert!(document.text.ends_with("\nn.a=2\nn.b=3\nm.a=4"), "{}", document.text);
        let commented = "Graph(nodes: {\"n\": K(\n  a: 1, // one\n  // and no more\n)})";
        let mut document = Document::parse(commented).unwrap();
        document.set("n", "b", "3").unwrap();
        assert_eq!(document.nodes[0].text.text(), "K(\n  a: 1, b: 3, // one\n  // and no more\n)");
        assert!(document.set("o", "a", "1").unwrap_err().contains("there is no node"));
    }

    #[test]
    fn syntax_errors_have_their_place() {
        let text = "Graph(\n  nodes: {\n    \"a\": Camera(,\n  }\n)";
        let faults = Document::parse(text).unwrap_err();
        assert!(faults[0].position(text).0 >= 3, "{:?}", faults[0].position(text));
    }
}
