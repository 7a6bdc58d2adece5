//! The words of formats that are made of lines, with their places for errors.

use std::path::Path;

use crate::error::{Error, Result};

/// The words of a statement, one after another.
#[derive(Clone)]
pub(super) struct Words<'t> {
    path: &'t Path,
    /// The whole text, for places in it.
    text: &'t str,
    rest: &'t str,
    /// The rest with what may be a comment.
    whole: &'t str,
}

/// The lines of a text.
pub(super) fn lines<'t>(path: &'t Path, text: &'t str) -> impl Iterator<Item = Words<'t>> {
    text.split('\n').map(move |line| Words { path, text, rest: line, whole: line })
}

/// The statements of OBJ and MTL: lines, of which one that ends in `\` goes on in the next, without their comments.
///
/// A `#` begins a comment where a word may begin, but the second word is never one: that is a name.
pub(super) fn statements<'t>(path: &'t Path, text: &'t str) -> impl Iterator<Item = Words<'t>> {
    let mut tail = Some(text);
    std::iter::from_fn(move || {
        let from = tail?;
        let mut end = 0;
        loop {
            let stop = from[end..].find('\n').map_or(from.len(), |at| end + at);
            let line = &from[end..stop];
            // A backslash that ends a comment is a path of Windows, not a line that goes on.
            if stop == from.len() || !line.ends_with('\\') || comment(line).is_some() {
                end = stop;
                break;
            }
            end = stop + 1;
        }
        let whole = &from[..end];
        tail = from.get(end + 1..);
        let rest = comment(whole).map_or(whole, |at| &whole[..at]);
        Some(Words { path, text, rest, whole })
    })
}

/// Where a comment begins.
fn comment(line: &str) -> Option<usize> {
    let is_start = |at: usize| match line[..at].split_whitespace().count() {
        0 => true,
        1 => false,
        _ => line[..at].ends_with(char::is_whitespace),
    };
    line.match_indices('#').map(|(at, _)| at).find(|at| is_start(*at))
}

impl<'t> Words<'t> {
    /// The words of a text from one of its places on.
    pub(super) fn from(path: &'t Path, text: &'t str, place: usize) -> Words<'t> {
        let rest = &text[place..];
        Words { path, text, rest, whole: rest }
    }

    pub(super) fn peek(&self) -> Option<&'t str> {
        self.clone().next()
    }

    /// All that is left, comments left out.
    pub(super) fn rest(&self) -> &'t str {
        self.rest.trim()
    }

    /// All that is left, of which some may be a comment or, with its `#`, a name.
    pub(super) fn name(&self) -> &'t str {
        let start = self.rest.as_ptr() as usize - self.whole.as_ptr() as usize;
        self.whole[start..].trim()
    }

    /// All of the statement or text that is left, blanks and all.
    pub(super) fn whole(&self) -> &'t str {
        self.whole
    }

    /// How many words are left.
    pub(super) fn left(&self) -> usize {
        self.clone().count()
    }

    /// Whether the next word is on another line, or there is none.
    pub(super) fn is_at_line_end(&self) -> bool {
        let word = self.rest.trim_start();
        word.is_empty() || self.rest[..self.rest.len() - word.len()].contains('\n')
    }

    /// The line of a word of this text, or of its end, from 1.
    pub(super) fn line(&self, word: &str) -> usize {
        self.place(word).0
    }

    /// The line and the column, from 1, of a word of this text.
    fn place(&self, word: &str) -> (usize, usize) {
        let at = word.as_ptr() as usize - self.text.as_ptr() as usize;
        let before = self.text.get(..at).unwrap_or(self.text);
        let column = before.rsplit('\n').next().map_or(0, |start| start.chars().count()) + 1;
        (before.matches('\n').count() + 1, column)
    }

    /// An error at a word.
    pub(super) fn fault(&self, word: &str, message: impl Into<String>) -> Error {
        let (line, column) = self.place(word);
        Error::at_line(self.path, line, column, message)
    }

    /// An error at what is left.
    pub(super) fn fault_here(&self, message: impl Into<String>) -> Error {
        self.fault(self.rest.trim_start(), message)
    }

    /// A number that may be infinite or none, such as the `-nan(ind)` and `1.#QNAN` of some compilers.
    pub(super) fn any_number(&mut self) -> Result<f64> {
        let Some(word) = self.next() else { return Err(self.fault_here("a number is missing")) };
        let bare = word.trim_start_matches(['+', '-']).to_ascii_lowercase();
        if bare.starts_with("nan") || bare.starts_with("1.#") {
            return Ok(f64::NAN);
        }
        word.parse().map_err(|_| {
            let cure = if word.contains(',') && word.replacen(',', ".", 1).parse::<f64>().is_ok() {
                ": write a point for the decimal comma"
            } else {
                ""
            };
            self.fault(word, format!("\"{word}\" is not a number{cure}"))
        })
    }

    pub(super) fn number(&mut self) -> Result<f64> {
        let mut here = self.clone();
        let value = self.any_number()?;
        if value.is_finite() {
            return Ok(value);
        }
        let word = here.next().unwrap_or_default();
        Err(self.fault(word, format!("\"{word}\" is not a finite number")))
    }

    pub(super) fn numbers<const N: usize>(&mut self) -> Result<[f64; N]> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.number()?;
        }
        Ok(numbers)
    }
}

impl<'t> Iterator for Words<'t> {
    type Item = &'t str;

    fn next(&mut self) -> Option<&'t str> {
        let mut from = self.rest.trim_start();
        while let Some(after) = from.strip_prefix("\\\n") {
            from = after.trim_start();
        }
        let mut end = from.find(char::is_whitespace).unwrap_or(from.len());
        if from[end..].starts_with('\n') && from[..end].ends_with('\\') && self.rest.len() > end {
            end -= 1;
        }
        let (word, rest) = from.split_at(end);
        self.rest = rest;
        (!word.is_empty()).then_some(word)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Vec<Vec<&str>> {
        statements(Path::new("a"), text)
            .map(Iterator::collect)
            .filter(|w: &Vec<_>| !w.is_empty())
            .collect()
    }

    #[test]
    fn statements_go_on_behind_a_backslash_and_end_before_a_comment() {
        assert_eq!(all("f 1 2 \\\n  3\nv 0"), [vec!["f", "1", "2", "3"], vec!["v", "0"]]);
        assert_eq!(all("f 1\\\n2\n"), [["f", "1", "2"]]);
        assert_eq!(all("# in C:\\temp\\\nv 0 # and D:\\\n\n  # x\nv 1"), [["v", "0"], ["v", "1"]]);
        assert_eq!(all("usemtl #7\ng a#b c # d"), [vec!["usemtl", "#7"], vec!["g", "a#b", "c"]]);
    }

    #[test]
    fn places_count_lines_that_go_on() {
        let text = "v 1\\\n 2 x3\nv 1 y";
        let mut faults = statements(Path::new("a"), text).map(|mut words| {
            words.next();
            words.numbers::<3>().unwrap_err().to_string()
        });
        assert_eq!(faults.next().unwrap(), "a:2:4: \"x3\" is not a number");
        assert_eq!(faults.next().unwrap(), "a:3:5: \"y\" is not a number");
    }
}
