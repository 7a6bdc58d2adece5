//! Printing: to readers that may have gone, and diagnostics with the text that they blame.

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use spandrel_engine::graph::{Diagnostic, Severity};
pub(crate) use spandrel_engine::text::bytes;
use std::io::{IsTerminal, Write};
use std::path::Path;

/// Prints to the standard output. A reader that has gone, as in `| head`, is no failure.
pub(crate) fn out(text: &str) {
    let _ = std::io::stdout().lock().write_all(text.as_bytes());
}

/// Prints to the standard error.
pub(crate) fn err(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// Prints an error in one line.
pub(crate) fn error(message: impl std::fmt::Display) {
    let styled = std::io::stderr().is_terminal();
    let (bold, end) = if styled { ("\x1b[1;31m", "\x1b[0m") } else { ("", "") };
    err(&format!("{bold}error{end}: {message}"));
}

/// Prints a warning in one line.
pub(crate) fn warning(message: impl std::fmt::Display) {
    let styled = std::io::stderr().is_terminal();
    let (bold, end) = if styled { ("\x1b[1;33m", "\x1b[0m") } else { ("", "") };
    err(&format!("{bold}warning{end}: {message}"));
}

/// Prints a note in one line.
pub(crate) fn note(message: impl std::fmt::Display) {
    let styled = std::io::stderr().is_terminal();
    let (bold, end) = if styled { ("\x1b[1;36m", "\x1b[0m") } else { ("", "") };
    err(&format!("{bold}note{end}: {message}"));
}

/// Prints diagnostics with the lines that they blame, underlined.
pub(crate) fn diagnostics(path: &Path, text: &str, diagnostics: &[Diagnostic]) {
    let renderer =
        if std::io::stderr().is_terminal() { Renderer::styled() } else { Renderer::plain() };
    let path = path.display().to_string();
    for diagnostic in diagnostics {
        let level = match diagnostic.severity {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
        };
        // Whole letters, whatever bytes are blamed.
        let end = text.ceil_char_boundary(diagnostic.span.end.min(text.len()));
        let span = text.floor_char_boundary(diagnostic.span.start.min(end))..end;
        let blamed = AnnotationKind::Primary.span(span).label(diagnostic.label.as_str());
        let snippet = Snippet::source(text).path(path.as_str()).annotation(blamed);
        let mut group = level.primary_title(diagnostic.message.as_str()).element(snippet);
        if let Some(help) = &diagnostic.help {
            group = group.element(Level::HELP.message(help.as_str()));
        }
        err(&renderer.render(&[group]).to_string());
        err("");
    }
    let errors = diagnostics.iter().filter(|d| d.severity == Severity::Error).count();
    if errors > 0 {
        let s = if errors == 1 { "" } else { "s" };
        error(format!("{path} has {errors} error{s}"));
    }
}

/// A number of things.
pub(crate) fn count(number: usize, thing: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{} {thing}{plural}", grouped(number as u64))
}

/// A number with thin groups of three digits.
pub(crate) fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(' ');
        }
        out.push(digit);
    }
    out
}

/// A time in a unit that suits it.
pub(crate) fn seconds(time: f64) -> String {
    match time {
        t if t < 1e-3 => format!("{:.0} us", t * 1e6),
        t if t < 1.0 => format!("{:.1} ms", t * 1e3),
        t => format!("{t:.2} s"),
    }
}

/// A text in XML.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
