//! What is wrong with a graph, where, and the cure.

use std::ops::Range;

pub use crate::text::{list, nearest};

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The graph works, but perhaps not as meant.
    Warning,
    /// The graph cannot be evaluated.
    Error,
}

/// A fault of a graph's text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// What is wrong.
    pub message: String,
    /// The bytes of the text that are to blame.
    pub span: Range<usize>,
    /// What stands at the blamed place.
    pub label: String,
    /// The cure.
    pub help: Option<String>,
    /// Whether a file that the graph names is to blame, and not the graph.
    pub is_input: bool,
}

impl Diagnostic {
    /// An error at a place of the text.
    pub fn error(span: Range<usize>, message: impl Into<String>) -> Diagnostic {
        let (message, label) = (message.into(), String::new());
        Diagnostic { severity: Severity::Error, message, span, label, help: None, is_input: false }
    }

    /// The same with what stands at the place.
    #[must_use]
    pub fn label(mut self, label: impl Into<String>) -> Diagnostic {
        self.label = label.into();
        self
    }

    /// The same with the cure.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Diagnostic {
        self.help = Some(help.into());
        self
    }

    /// The line and column, from 1, at which the place begins; the column in characters.
    pub fn position(&self, text: &str) -> (usize, usize) {
        let before = &text[..text.floor_char_boundary(self.span.start.min(text.len()))];
        let line = before.matches('\n').count() + 1;
        let start = before.rfind('\n').map_or(0, |at| at + 1);
        (line, before[start..].chars().count() + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_counted_in_characters() {
        let text = "é\n  äb";
        let place = |span: Range<usize>| Diagnostic::error(span, "").position(text);
        assert_eq!(place(0..1), (1, 1));
        assert_eq!(place(5..7), (2, 3));
        assert_eq!(place(7..8), (2, 4));
    }
}
