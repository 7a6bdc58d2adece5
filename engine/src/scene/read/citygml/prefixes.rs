//! Prefixes of names that a file uses and does not declare.

use roxmltree::{Document as Tree, TextPos};
use std::borrow::Cow;

use super::super::reader::Reader;
use crate::error::{Error, Result};

/// How many prefixes are declared for a file that does not, at most.
const MOST_PREFIXES: usize = 32;

/// Declarations that were added to a text: where, in which line and column, and how many characters.
#[derive(Clone, Copy, Default)]
pub(super) struct Added {
    line: u32,
    column: u32,
    count: u32,
}

impl Added {
    /// The place in the file of a place in the text.
    pub(super) fn in_file(&self, at: TextPos) -> (usize, usize) {
        let is_behind = at.row == self.line && at.col > self.column;
        let moved =
            if is_behind { at.col.saturating_sub(self.count).max(self.column) } else { at.col };
        (at.row as usize, moved as usize)
    }
}

pub(super) fn not_city_gml(reader: &Reader, error: &roxmltree::Error, added: &Added) -> Error {
    let (line, column) = added.in_file(error.pos());
    Error::at_line(&reader.path, line, column, format!("not CityGML: {error}"))
}

/// The text with all prefixes of names declared, with remarks on those that are not: names are read without them.
pub(super) fn declared<'t>(reader: &mut Reader, text: &'t str) -> Result<(Cow<'t, str>, Added)> {
    let (mut text, mut added) = (Cow::Borrowed(text), Added::default());
    for _ in 0..MOST_PREFIXES {
        // The parser tells one prefix at a time, so each is declared and the text parsed again.
        let (prefix, place) = match Tree::parse(&text) {
            Err(roxmltree::Error::UnknownNamespace(prefix, place)) => (prefix, place),
            _ => break,
        };
        let Some(at) = root_name_end(&text) else { break };
        let (line, column) = added.in_file(place);
        reader.note(format!(
            "line {line}, column {column}: the prefix \"{prefix}\" is declared nowhere; names are read without it"
        ));
        let before = &text[..at];
        let line_start = before.rfind('\n').map_or(0, |end| end + 1);
        added.line = before.matches('\n').count() as u32 + 1;
        added.column = before[line_start..].chars().count() as u32 + 1;
        let declaration = format!(" xmlns:{prefix}=\"urn:undeclared:{prefix}\"");
        added.count += declaration.chars().count() as u32;
        text.to_mut().insert_str(at, &declaration);
    }
    Ok((text, added))
}

/// Where the name of the root element ends.
fn root_name_end(text: &str) -> Option<usize> {
    let mut at = 0;
    loop {
        at += text[at..].find('<')?;
        let rest = &text[at..];
        let end = match rest {
            _ if rest.starts_with("<?") => rest.find("?>")?,
            _ if rest.starts_with("<!--") => rest.find("-->")?,
            _ if rest.starts_with("<!") => rest.find('>')?,
            _ => {
                let name = rest[1..].find(|c: char| c.is_whitespace() || c == '>' || c == '/')?;
                return Some(at + 1 + name);
            }
        };
        at += end;
    }
}
