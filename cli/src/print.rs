//! Printing: to readers that may have gone, and diagnostics with the text that they blame. What is said is kept for
//! `--stats=json` and `--deny-warnings`.

use spandrel_engine::graph::document::Document;
use spandrel_engine::graph::{Diagnostic, Severity};
pub(crate) use spandrel_engine::text::bytes;
use std::borrow::Cow;
use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What was said of what went wrong, what is doubtful and what is worth knowing.
#[derive(Clone, Default)]
pub(crate) struct Said {
    pub(crate) errors: Vec<String>,
    pub(crate) warnings: Vec<String>,
    pub(crate) notes: Vec<String>,
}

static SAID: Mutex<Said> =
    Mutex::new(Said { errors: Vec::new(), warnings: Vec::new(), notes: Vec::new() });
static IS_QUIET: AtomicBool = AtomicBool::new(false);
static HAS_FAILED: AtomicBool = AtomicBool::new(false);

/// All that was said so far.
pub(crate) fn said() -> MutexGuard<'static, Said> {
    SAID.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Leaves out whatever is neither an error nor a warning.
pub(crate) fn be_quiet(quiet: bool) {
    IS_QUIET.store(quiet, Ordering::Relaxed);
}

/// Whether something could not be printed to the standard output.
pub(crate) fn has_failed() -> bool {
    HAS_FAILED.load(Ordering::Relaxed)
}

/// Prints to the standard output. A reader that has gone, as in `| head`, is no failure; a full disk is.
pub(crate) fn out(text: &str) {
    let mut to = std::io::stdout().lock();
    let printed = to.write_all(text.as_bytes()).and_then(|()| to.flush());
    if let Err(e) = printed.as_ref()
        && e.kind() != ErrorKind::BrokenPipe
        && !HAS_FAILED.swap(true, Ordering::Relaxed)
    {
        error(format!("the standard output: cannot be written: {e}"));
    }
}

/// Prints words to the standard output.
pub(crate) fn words(text: &str) {
    out(&visible(text));
}

/// Prints words to the standard error.
pub(crate) fn err(text: &str) {
    styled(&visible(text));
}

fn styled(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

fn is_hidden(c: char) -> bool {
    (c.is_control() && !matches!(c, '\n' | '\t'))
        || matches!(c, '\u{ad}' | '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}')
        || matches!(c, '\u{2060}'..='\u{206f}' | '\u{feff}')
}

/// Words as they can be shown: what moves the cursor, is not seen or turns the order of letters is written out, as
/// names of files may have any letters.
pub(crate) fn visible(text: &str) -> Cow<'_, str> {
    if !text.contains(is_hidden) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::new();
    for c in text.chars() {
        if is_hidden(c) { shown.extend(c.escape_default()) } else { shown.push(c) }
    }
    Cow::Owned(shown)
}

/// Prints how things go to the standard error, unless that is not wanted.
pub(crate) fn chat(text: &str) {
    if !IS_QUIET.load(Ordering::Relaxed) {
        err(text);
    }
}

/// Prints an error in one line.
pub(crate) fn error(message: impl std::fmt::Display) {
    styled(&titled("error", "31", &message));
    said().errors.push(message.to_string());
}

/// Prints a warning in one line.
pub(crate) fn warning(message: impl std::fmt::Display) {
    styled(&titled("warning", "33", &message));
    said().warnings.push(message.to_string());
}

/// Prints a note in one line.
pub(crate) fn note(message: impl std::fmt::Display) {
    if !IS_QUIET.load(Ordering::Relaxed) {
        styled(&titled("note", "36", &message));
    }
    said().notes.push(message.to_string());
}

fn titled(title: &str, color: &str, message: &dyn std::fmt::Display) -> String {
    let message = message.to_string();
    let message = visible(&message);
    match std::io::stderr().is_terminal() {
        true => format!("\x1b[1;{color}m{title}\x1b[0m: {message}"),
        false => format!("{title}: {message}"),
    }
}

/// Prints diagnostics with the lines that they blame, underlined; `name` is what the text is called.
pub(crate) fn diagnostics(name: &str, text: &str, diagnostics: &[Diagnostic]) {
    diagnostics.iter().for_each(|diagnostic| one(name, text, diagnostic));
    sum(name, diagnostics);
}

/// Prints what is wrong with a graph, in its file or in what was set from outside.
pub(crate) fn faults(name: &str, document: &Document, diagnostics: &[Diagnostic]) {
    for diagnostic in diagnostics {
        let (is_set, text, diagnostic) = document.blamed(diagnostic);
        one(if is_set { "the command line" } else { name }, text, &diagnostic);
    }
    sum(name, diagnostics);
}

fn one(name: &str, text: &str, diagnostic: &Diagnostic) {
    let is_styled = std::io::stderr().is_terminal();
    styled(&underlined(name, text, diagnostic, is_styled));
    styled("");
    let (line, column) = diagnostic.position(text);
    let help = diagnostic.help.as_ref().map(|help| format!(": {help}")).unwrap_or_default();
    let message = format!("{name}:{line}:{column}: {}{help}", diagnostic.message);
    match diagnostic.severity {
        Severity::Error => said().errors.push(message),
        Severity::Warning => said().warnings.push(message),
    }
}

fn sum(name: &str, diagnostics: &[Diagnostic]) {
    let errors = diagnostics.iter().filter(|d| d.severity == Severity::Error).count();
    if errors > 0 {
        let s = if errors == 1 { "" } else { "s" };
        styled(&titled("error", "31", &format!("{name} has {errors} error{s}")));
    }
}

/// A diagnostic with the lines that it blames.
fn underlined(name: &str, text: &str, diagnostic: &Diagnostic, is_styled: bool) -> String {
    let shown = |words: &str| visible(words).into_owned();
    let diagnostic = Diagnostic {
        message: shown(&diagnostic.message),
        label: shown(&diagnostic.label),
        help: diagnostic.help.as_deref().map(shown),
        ..diagnostic.clone()
    };
    diagnostic.excerpt(&visible(name), text, is_styled)
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

#[cfg(test)]
mod tests {
    use super::*;
    use spandrel_engine::graph::Graph;
    use std::path::Path;

    /// Letters of two, three and four bytes, one that is added to the letter before it, and what is not seen.
    const LETTERS: [&str; 8] = ["é", "€", "😀", "\u{301}", "\t", "\r", "\u{200b}", "\0"];

    const GRAPH: &str = r#"Graph(nodes: {
  "eye": Camera(position: (2, 2, 5)),
  "b": Scanline(scene: "box.ron", camera: "eya"),
  "s": Stream(image: "b", code: "x = 'é' * colr; // no
    color(y"),
  "p": Resolv(image: "s"), "w": Write(image: "s", path: "~/a.####.png", sise: 3),
})"#;

    /// All that is said of a graph's text.
    fn said_of(text: &str, registry: &spandrel_engine::graph::Registry) -> Vec<String> {
        let checked = Document::parse(text)
            .and_then(|document| Graph::check(&document, registry, Path::new("")).map(drop));
        let faults = checked.err().unwrap_or_default();
        let shown = |fault| underlined("é\r.ron", text, fault, false);
        faults.iter().map(shown).collect()
    }

    #[test]
    fn messages_point_into_any_text() {
        let registry = crate::library();
        let known = said_of(GRAPH, &registry);
        assert!(known.len() >= 6, "{known:?}");
        let mut said = 0;
        for (i, (at, c)) in GRAPH.char_indices().enumerate() {
            // Every place meets two of the letters, one before what is there and one instead of it.
            for (letter, till) in
                [(LETTERS[i % 8], at), (LETTERS[(i / 8 + i + 3) % 8], at + c.len_utf8())]
            {
                let text = [&GRAPH[..at], letter, &GRAPH[till..]].concat();
                let shown = said_of(&text, &registry);
                said += shown.len();
                for message in shown {
                    let hidden = ['\r', '\u{200b}', '\0'];
                    assert!(!message.contains(hidden), "{text:?}: {message:?}");
                }
            }
        }
        assert!(said > 900, "{said}");
    }

    #[test]
    fn places_within_a_letter_are_shown() {
        let text = "a é 😀 b";
        for start in 0..text.len() + 3 {
            for end in start..text.len() + 3 {
                let fault = Diagnostic::error(start..end, "wrong").label("here");
                let shown = underlined("g.ron", text, &fault, false);
                assert!(shown.contains("wrong"), "{shown}");
            }
        }
    }

    #[test]
    fn what_is_not_seen_is_written_out() {
        assert_eq!(visible("Häuser\t😀\n e\u{301}"), "Häuser\t😀\n e\u{301}");
        assert_eq!(visible("a\rb\u{200b}\u{202e}\x1b[2J"), "a\\rb\\u{200b}\\u{202e}\\u{1b}[2J");
    }
}
