//! Graph documents: RON, read in two passes.
//!
//! The first pass finds the nodes and keeps the text of each; the second parses every node by its own
//! kind. So the set of kinds stays open, every place in the text stays exact, and one run reports the
//! errors of all nodes.

use ron::value::RawValue;
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use std::collections::HashMap;
use std::fmt;
use std::ops::Range;

use super::diagnostic::Diagnostic;
use crate::text::{Wording, list, nearest, options, wording};

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
        let raw: Raw<'_> = options().from_str(text).map_err(|e| vec![ron_error(text, 0, &e)])?;
        let mut faults = Vec::new();
        if raw.version != VERSION {
            let message = format!("graph version {}: this program reads {VERSION}", raw.version);
            faults.push(Diagnostic::error(0..text.len().min(5), message));
        }
        let mut nodes: Vec<RawNode> = Vec::new();
        let mut first_of: HashMap<String, Range<usize>> = HashMap::new();
        for (id, value) in raw.nodes.0 {
            let body = value.trim().get_ron();
            let start = body.as_ptr() as usize - text.as_ptr() as usize;
            let id_span = quoted_before(text, start, &id);
            let kind: String =
                body.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            if let Some(first) = first_of.get(&id) {
                let (line, _) = Diagnostic::error(first.clone(), "").position(text);
                faults.push(
                    Diagnostic::error(id_span.clone(), format!("two nodes are called \"{id}\""))
                        .label("the second")
                        .help(format!("rename it; the first is in line {line}")),
                );
            }
            if !is_name(&id) {
                faults.push(
                    Diagnostic::error(id_span.clone(), format!("\"{id}\" is no name for a node"))
                        .label("only letters, digits and _, not beginning with a digit"),
                );
            }
            first_of.entry(id.clone()).or_insert_with(|| id_span.clone());
            let span = start..start + body.len();
            let text = body.to_owned();
            nodes.push(RawNode { id, id_span, kind, span, text, settings: Vec::new() });
        }
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

/// Where the name of a node stands that is followed by a value at `start`.
fn quoted_before(text: &str, start: usize, id: &str) -> Range<usize> {
    let quoted = format!("\"{id}\"");
    match text[..start].rfind(&quoted) {
        Some(at) => at..at + quoted.len(),
        None => start..start + 1,
    }
}

/// An error of the RON library, placed in the document; `base` is where the parsed text begins in it.
pub(super) fn ron_error(text: &str, base: usize, error: &ron::error::SpannedError) -> Diagnostic {
    let part = &text[base..];
    let byte = |position| base + byte_of(part, position);
    let span = word_at(text, byte(&error.span.start)..byte(&error.span.end));
    let Wording { message, label, help } = wording(&error.code, &text[span.start..]);
    Diagnostic { help, ..Diagnostic::error(span, message).label(label) }
}

/// The byte of a text at a line and column of the RON library.
pub(super) fn byte_of(text: &str, position: &ron::error::Position) -> usize {
    let line_start = match position.line {
        0 | 1 => 0,
        line => text.match_indices('\n').nth(line - 2).map_or(text.len(), |(at, _)| at + 1),
    };
    let column = position.col.saturating_sub(1);
    let line = &text[line_start..];
    line_start + line.char_indices().nth(column).map_or(line.len(), |(at, _)| at)
}

/// A place without the blanks before it; if nothing is left, the word that follows.
fn word_at(text: &str, span: Range<usize>) -> Range<usize> {
    let rest = &text[span.start.min(text.len())..];
    let start = span.start + rest.len() - rest.trim_start().len();
    if start < span.end {
        // The library leaves out the quote that begins a string.
        let quoted = text[..start].ends_with('"') && text[start..span.end].ends_with('"');
        return start - usize::from(quoted)..span.end;
    }
    let end = text[start..].find(|c: char| c.is_whitespace() || ",()[]{}".contains(c));
    start..start + end.unwrap_or(text.len() - start).max(1)
}

/// The bytes of a field's value in the text of a structure such as `Kind(a: 1, b: (2, 3))`.
pub(super) fn field_span(text: &str, field: &str) -> Option<Range<usize>> {
    fields(text).into_iter().find(|known| known.name == field).map(|known| known.value)
}

/// A field in the text of a structure.
pub(super) struct FieldText<'t> {
    pub(super) name: &'t str,
    pub(super) value: Range<usize>,
    /// Its name, its value and the comma after it.
    pub(super) whole: Range<usize>,
}

/// The fields of a structure such as `Kind(a: 1, b: (2, 3))`, as far as it has the form of one.
pub(super) fn fields(text: &str) -> Vec<FieldText<'_>> {
    let bytes = text.as_bytes();
    let mut fields = Vec::new();
    let Some(open) = text.find('(') else { return fields };
    let mut i = open + 1;
    loop {
        i = skip_blank(text, i);
        let name_end = text[i..].find(|c: char| !(c.is_alphanumeric() || c == '_'));
        let Some(name_end) = name_end.map(|end| i + end) else { return fields };
        let colon = skip_blank(text, name_end);
        if bytes.get(colon) != Some(&b':') {
            return fields;
        }
        let start = skip_blank(text, colon + 1);
        let end = value_end(text, start);
        let has_comma = bytes.get(end) == Some(&b',');
        fields.push(FieldText {
            name: &text[i..name_end],
            value: start..text[start..end].trim_end().len() + start,
            whole: i..end + usize::from(has_comma),
        });
        if !has_comma {
            return fields;
        }
        i = end + 1;
    }
}

/// Passes blanks and comments.
fn skip_blank(text: &str, mut i: usize) -> usize {
    loop {
        let rest = &text[i..];
        let blank = rest.len() - rest.trim_start().len();
        i += blank;
        let rest = &text[i..];
        if rest.starts_with("//") {
            i += rest.find('\n').unwrap_or(rest.len());
        } else if rest.starts_with("/*") {
            i += rest.find("*/").map_or(rest.len(), |at| at + 2);
        } else {
            return i;
        }
    }
}

/// Where a text in quotes ends that begins at a place, plain or raw (`r#".."#`).
fn text_end(text: &str, start: usize) -> Option<usize> {
    let rest = &text.as_bytes()[start..];
    if rest.first() == Some(&b'"') {
        let mut i = 1;
        while i < rest.len() && rest[i] != b'"' {
            i += 1 + usize::from(rest[i] == b'\\');
        }
        return Some((start + i + 1).min(text.len()));
    }
    let before = text.as_bytes()[..start].last();
    let is_in_word =
        before.is_some_and(|c| c.is_ascii_alphanumeric() || *c == b'_' || !c.is_ascii());
    let marks = rest.strip_prefix(b"r").filter(|_| !is_in_word)?;
    let marks = marks.iter().take_while(|c| **c == b'#').count();
    let first = start + 1 + marks;
    if text.as_bytes().get(first) != Some(&b'"') {
        return None;
    }
    let closing = format!("\"{}", "#".repeat(marks));
    let end = text[first + 1..].find(&closing);
    Some(end.map_or(text.len(), |end| first + 1 + end + closing.len()))
}

/// Where a byte of a text stands in what the document says for it, quotes and escapes included.
fn offset_in_text(written: &str, byte: usize) -> Option<usize> {
    if written.starts_with('r') {
        let open = written.find('"')? + 1;
        return (open + byte < written.len()).then_some(open + byte);
    }
    let body = written.strip_prefix('"')?;
    let (mut i, mut meant) = (0, 0);
    while meant < byte {
        let first = body[i..].chars().next()?;
        if first != '\\' {
            (i, meant) = (i + first.len_utf8(), meant + first.len_utf8());
            continue;
        }
        let escape = &body[i + 1..];
        let (written, value) = match escape.chars().next()? {
            'x' => (3, u32::from_str_radix(escape.get(1..3)?, 16).ok()?),
            'u' => {
                let end = escape.find('}')?;
                (end + 1, u32::from_str_radix(escape.get(2..end)?, 16).ok()?)
            }
            other => (other.len_utf8(), 0),
        };
        i += 1 + written;
        meant += char::from_u32(value)?.len_utf8();
    }
    Some(1 + i)
}

/// Where a value ends: at a comma or a closing bracket of the structure around it.
fn value_end(text: &str, start: usize) -> usize {
    let bytes = text.as_bytes();
    let mut depth = 0;
    let mut i = start;
    while i < bytes.len() {
        if let Some(end) = text_end(text, i) {
            i = end;
            continue;
        }
        match bytes[i] {
            b'/' if bytes.get(i + 1) == Some(&b'/') || bytes.get(i + 1) == Some(&b'*') => {
                i = skip_blank(text, i);
                continue;
            }
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' if depth == 0 => return i,
            b')' | b']' | b'}' => depth -= 1,
            b',' if depth == 0 => return i,
            _ => {}
        }
        i += 1;
    }
    bytes.len()
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
    fn fields_are_found_and_set() {
        let text = "K(a: 1, /* b: 9 */ b: (x: \"),\", y: [1, 2]), c: E(4) )";
        let at = |field: &str| field_span(text, field).map(|span| &text[span]);
        assert_eq!(at("a"), Some("1"));
        assert_eq!(at("b"), Some("(x: \"),\", y: [1, 2])"));
        assert_eq!(at("c"), Some("E(4)"));
        assert_eq!(at("x"), None);
        let mut document = Document::parse("Graph(nodes: {\"n\": K(a: 1), \"m\": K()})").unwrap();
        document.set("n", "a", "2").unwrap();
        document.set("n", "b", "3").unwrap();
        document.set("m", "a", "4").unwrap();
        assert_eq!(document.nodes[0].text, "K(a: 2, b: 3)");
        assert_eq!(document.nodes[1].text, "K( a: 4)");
        assert!(document.set("o", "a", "1").unwrap_err().contains("there is no node"));
    }

    #[test]
    fn texts_are_passed_whole_and_their_bytes_found() {
        let text = r###"K(a: r#"x("y)") // ,"#, b: "q\"\u{e9}(z", c: 3)"###;
        let at = |field: &str| field_span(text, field).map(|span| &text[span]);
        assert_eq!(at("a"), Some(r###"r#"x("y)") // ,"#"###));
        assert_eq!(at("b"), Some(r#""q\"\u{e9}(z""#));
        assert_eq!(at("c"), Some("3"));
        let raw = at("a").unwrap();
        assert_eq!(&raw[offset_in_text(raw, 4).unwrap()..][..2], ")\"");
        // q"é(z: the z is byte 5.
        let plain = at("b").unwrap();
        assert_eq!(&plain[offset_in_text(plain, 5).unwrap()..], "z\"");
        assert_eq!((offset_in_text(plain, 900), offset_in_text(raw, 900)), (None, None));
    }

    #[test]
    fn syntax_errors_have_their_place() {
        let text = "Graph(\n  nodes: {\n    \"a\": Camera(,\n  }\n)";
        let faults = Document::parse(text).unwrap_err();
        assert!(faults[0].position(text).0 >= 3, "{:?}", faults[0].position(text));
    }
}
