//! What is wrong with a text, where, and the cure.

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use std::fmt;
use std::ops::Range;
use std::path::PathBuf;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The graph works, but perhaps not as meant.
    Warning,
    /// The graph cannot be evaluated.
    Error,
}

/// A fault of a text: a graph's or a scene's.
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
    /// Another place that matters, and what stands there.
    pub other: Option<(Range<usize>, String)>,
    /// The cure.
    pub help: Option<String>,
    /// Whether a file that the graph names is to blame, and not the graph.
    pub is_input: bool,
}

impl Diagnostic {
    /// An error at a place of the text.
    pub fn error(span: Range<usize>, message: impl Into<String>) -> Diagnostic {
        Diagnostic {
            severity: Severity::Error,
            message: message.into(),
            span,
            label: String::new(),
            other: None,
            help: None,
            is_input: false,
        }
    }

    /// The same with what stands at the place.
    #[must_use]
    pub fn label(mut self, label: impl Into<String>) -> Diagnostic {
        self.label = label.into();
        self
    }

    /// The same with another place that matters.
    #[must_use]
    pub fn other(mut self, span: Range<usize>, label: impl Into<String>) -> Diagnostic {
        self.other = Some((span, label.into()));
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

    /// The fault with the lines that it blames, underlined; with colours for a terminal.
    pub fn excerpt(&self, path: &str, text: &str, is_styled: bool) -> String {
        let renderer = if is_styled { Renderer::styled() } else { Renderer::plain() };
        let level = match self.severity {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
        };
        // A letter that is shown otherwise than it is written would move what stands behind it.
        let places = [Some(&self.span), self.other.as_ref().map(|other| &other.0)];
        let Shown { text, line, places: [blamed, other] } = shown(text, places);
        let blamed = AnnotationKind::Primary.span(blamed).label(self.label.as_str());
        let mut snippet = Snippet::source(text).line_start(line).path(path).annotation(blamed);
        if let Some((_, label)) = &self.other {
            snippet = snippet.annotation(AnnotationKind::Context.span(other).label(label.as_str()));
        }
        let mut group = level.primary_title(self.message.as_str()).element(snippet);
        if let Some(help) = &self.help {
            group = group.element(Level::HELP.message(help.as_str()));
        }
        renderer.render(&[group])
    }
}

/// The lines of a text that have places, as they are shown.
struct Shown {
    text: String,
    /// The number of the first line.
    line: usize,
    places: [Range<usize>; 2],
}

/// Lines without marks that have no width, and with tabs as blanks; places begin and end with whole letters there.
fn shown(text: &str, places: [Option<&Range<usize>>; 2]) -> Shown {
    let down = |at: usize| {
        (0..=at.min(text.len())).rev().find(|at| text.is_char_boundary(*at)).unwrap_or(0)
    };
    let up = |at: usize| {
        (at.min(text.len())..text.len()).find(|at| text.is_char_boundary(*at)).unwrap_or(text.len())
    };
    let whole = |place: &Range<usize>| down(place.start)..up(place.end.max(place.start));
    let places = places.map(|place| place.map(whole));
    let all = || places.iter().flatten();
    let first = all().map(|place| place.start).min().unwrap_or(0);
    let last = all().map(|place| place.end).max().unwrap_or(0);
    let first = text[..first].rfind('\n').map_or(0, |at| at + 1);
    let last = text[last..].find('\n').map_or(text.len(), |at| last + at);
    let line = text[..first].matches('\n').count() + 1;
    // Where a byte of the lines is shown.
    let as_shown = |upto: usize| -> String {
        let letters =
            text[first..upto].chars().filter(|c| *c == '\n' || *c == '\t' || !has_no_width(*c));
        letters.collect::<String>().replace('\t', "    ")
    };
    let place = |place: Option<Range<usize>>| {
        place.map_or(0..0, |place| as_shown(place.start).len()..as_shown(place.end).len())
    };
    Shown { text: as_shown(last), line, places: places.map(place) }
}

/// Whether a letter takes no place on a terminal, or moves what is behind it.
fn has_no_width(c: char) -> bool {
    c.is_control()
        || matches!(c,
            '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}' | '\u{fe00}'..='\u{fe0f}' | '\u{feff}')
}

/// All that is wrong with a text.
#[derive(Clone)]
pub struct Faults {
    /// The file.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
    /// The faults, in the order of the text; at least one.
    pub list: Vec<Diagnostic>,
}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = self.path.display().to_string();
        let Some(first) = self.list.first() else { return write!(f, "{path}") };
        let (line, column) = first.position(&self.text);
        write!(f, "{path}:{line}:{column}: {}", first.message)?;
        match self.list.len() {
            1 => {}
            2 => write!(f, ", and another error")?,
            count => write!(f, ", and {} more errors", count - 1)?,
        }
        for fault in &self.list {
            write!(f, "\n\n{}", fault.excerpt(&path, &self.text, false))?;
        }
        Ok(())
    }
}

impl fmt::Debug for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.path.display(), self.in_short())
    }
}

impl Faults {
    /// What is wrong, in a line: each with its line and column.
    pub fn in_short(&self) -> String {
        let say = |fault: &Diagnostic| {
            let (line, column) = fault.position(&self.text);
            let help = fault.help.as_ref().map_or_else(String::new, |help| format!(" ({help})"));
            format!("{line}:{column}: {}{help}", fault.message)
        };
        self.list.iter().map(say).collect::<Vec<_>>().join("; ")
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

    #[test]
    fn the_caret_stands_under_its_letter_whatever_is_before_it() {
        // Letters of two, three and four bytes; double width; marks without width; tabs; line ends.
        for before in [
            "abc",
            "é",
            "ä→",
            "日本",
            "🌲",
            "\u{200b}\u{feff}x",
            "\tx",
            "e\u{301}",
            "\u{202e}x",
            "\u{7}x",
        ] {
            for end in ["\n", "\r\n"] {
                let text = format!("first{end}{before}!{end}last");
                let at = text.find('!').unwrap();
                let excerpt = Diagnostic::error(at..at + 1, "m").excerpt("p", &text, false);
                let mut lines = excerpt.lines().skip_while(|line| !line.contains('!'));
                let (line, caret) = (lines.next().unwrap(), lines.next().unwrap());
                let width = |text: &str| -> usize {
                    let wide = |c: char| usize::from(matches!(c, '日' | '本' | '🌲'));
                    let none = |c: char| usize::from(c == '\u{301}');
                    text.chars().map(|c| 1 + wide(c) - none(c)).sum()
                };
                let [there, here] =
                    [(line, '!'), (caret, '^')].map(|(l, c)| width(&l[..l.find(c).unwrap()]));
                assert_eq!(there, here, "{before:?}\n{excerpt}");
            }
        }
    }

    #[test]
    fn no_place_breaks_an_excerpt() {
        let text = "a\té\u{200b}\r\n日\u{feff}🌲\n\u{301}";
        for start in 0..text.len() + 3 {
            for end in start..text.len() + 3 {
                let fault = Diagnostic::error(start..end, "m").label("l").other(0..end, "o");
                assert!(fault.excerpt("p", text, false).contains("p:"), "{start}..{end}");
                fault.position(text);
            }
        }
    }
}
