//! Reading RON whatever is wrong with it: all faults at once.
//!
//! The RON library stops at the first fault. What is to blame, a field or an item of a list, is then left out, and the
//! rest is read again.

use ron::error::{Position, SpannedError};
use std::ops::Range;

use super::index::Index;
use super::wording::{Place, wording};
use super::{Diagnostic, Wording};

/// How many faults are reported at most.
const MOST: usize = 32;

/// What could be read of a text, and what is wrong with it.
#[derive(Debug)]
pub struct Parsed<T> {
    /// What the text says, without what is wrong; `None` if that cannot be told apart.
    pub value: Option<T>,
    /// The text without what is wrong, which is blank: places are the same.
    pub text: String,
    /// The faults, in the order in which they were found.
    pub faults: Vec<Diagnostic>,
}

/// Reads a text with `parse`. In what is blamed by one fault no others are looked for.
pub fn parse<T>(text: &str, parse: impl Fn(&str) -> Result<T, SpannedError>) -> Parsed<T> {
    let mut parsed = Parsed { value: None, text: text.to_owned(), faults: Vec::new() };
    let error = match parse(text) {
        Ok(value) => return Parsed { value: Some(value), ..parsed },
        Err(error) => error,
    };
    let index = Index::new(text);
    let mut blank: Vec<Range<usize>> = Vec::new();
    let mut error = error;
    while parsed.faults.len() < MOST {
        let at = byte_of(&parsed.text, &error.span.start);
        let end = byte_of(&parsed.text, &error.span.end);
        let span = word_at(text, at..end);
        let is_blank = |range: &Range<usize>| {
            blank.iter().any(|b| b.start <= range.start && range.end <= b.end)
        };
        let mut item = index.at(span.start.min(text.len()));
        while item != 0 && is_blank(&index.item(item).whole) {
            item = index.item(item).parent;
        }
        let whole = index.item(item).whole.clone();
        // What misses something that was left out has no fault of its own.
        let is_left = blank.iter().any(|b| whole.start <= b.start && b.end <= whole.end);
        if !is_left || parsed.faults.is_empty() {
            let probe = |text: &str| parse(text).err().map(|error| error.code);
            let working = parsed.text.as_str();
            let place = Place { index: &index, span: span.clone(), item, working, probe: &probe };
            let Wording { message, label, help, at } = wording(&error.code, &place);
            let span = at.unwrap_or(span);
            parsed
                .faults
                .push(Diagnostic { help, ..Diagnostic::error(span, message).label(label) });
        }
        let is_lost = matches!(error.code, ron::Error::Eof | ron::Error::ExpectedStringEnd);
        if is_lost
            || index.item(item).parent == item
            || index.crossed().is_some()
            || index.unclosed().is_some()
        {
            break;
        }
        // As many bytes, so that places stay.
        let spaces = text[whole.clone()].bytes().map(|b| if b == b'\n' { '\n' } else { ' ' });
        let spaces: String = spaces.collect();
        parsed.text.replace_range(whole.clone(), &spaces);
        blank.push(whole);
        error = match parse(&parsed.text) {
            Ok(value) => {
                parsed.value = Some(value);
                break;
            }
            Err(error) => error,
        };
    }
    parsed
}

/// Names that are given twice: entries of a map, objects beside each other.
pub fn doubles(index: &Index<'_>) -> Vec<Diagnostic> {
    let double = |(name, first, second): (String, Range<usize>, Range<usize>)| {
        let line = index.text()[..first.start].matches('\n').count() + 1;
        Diagnostic::error(second, format!("\"{name}\" is there twice"))
            .label("the second")
            .other(first, "the first")
            .help(format!("rename it; the first is in line {line}"))
    };
    index.doubles().into_iter().map(double).collect()
}

/// Numbers that no field can hold.
pub fn numbers(index: &Index<'_>) -> Vec<Diagnostic> {
    let fault = |number: &Range<usize>| {
        Diagnostic::error(number.clone(), NOT_FINITE).label("no field can hold it")
    };
    index.numbers().iter().map(fault).collect()
}

/// What is said of a number that is not finite, or too large.
pub const NOT_FINITE: &str = "this number is not finite, or larger than 3.4e38";

/// The byte of a text at a line and column of the RON library.
pub fn byte_of(text: &str, position: &Position) -> usize {
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
    let start = span.start.min(text.len()) + rest.len() - rest.trim_start().len();
    if start < span.end {
        // The library leaves out the quote that begins a string.
        let quoted = text[..start].ends_with('"') && text[start..span.end].ends_with('"');
        return start - usize::from(quoted)..span.end;
    }
    let end = text[start..].find(|c: char| c.is_whitespace() || ",()[]{}".contains(c));
    let first = text[start..].chars().next().map_or(1, char::len_utf8);
    start..start + end.unwrap_or(text.len() - start).max(first)
}
