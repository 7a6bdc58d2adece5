//! What is said of a fault of a text: in the words of its users, with what to write instead.

mod mistakes;

use ron::Error as E;
use std::ops::Range;

use super::index::Index;
use super::{list, nearest};

/// What is wrong with a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Wording {
    /// What is wrong.
    pub(super) message: String,
    /// What stands at the blamed place.
    pub(super) label: &'static str,
    /// The cure.
    pub(super) help: Option<String>,
    /// The place, if it is another than the library's.
    pub(super) at: Option<Range<usize>>,
}

/// Where the RON library gave up.
pub(super) struct Place<'p> {
    pub(super) index: &'p Index<'p>,
    pub(super) span: Range<usize>,
    /// The innermost item there.
    pub(super) item: usize,
    /// The text that it gave up on: what was blamed before is left out.
    pub(super) working: &'p str,
    /// The library's error for another text.
    pub(super) probe: &'p dyn Fn(&str) -> Option<E>,
}

fn words(message: impl Into<String>) -> Wording {
    Wording { message: message.into(), label: "", help: None, at: None }
}

impl Wording {
    fn help(mut self, help: impl Into<String>) -> Wording {
        self.help = Some(help.into());
        self
    }

    fn label(mut self, label: &'static str) -> Wording {
        self.label = label;
        self
    }

    fn at(mut self, at: Range<usize>) -> Wording {
        self.at = Some(at);
        self
    }
}

/// The words for an error of the RON library at a place.
pub(super) fn wording(error: &E, place: &Place<'_>) -> Wording {
    if let Some(known) = place.bracket(error).or_else(|| place.mistake(error)) {
        return known;
    }
    let unknown = |message: String, name: &str, known: &[&'static str]| {
        words(message).label("unknown").help(match nearest(name, known.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("known are {}", list(known.iter().copied())),
        })
    };
    match error {
        E::NoSuchStructField { expected, found, outer } => {
            let of = outer.as_deref().unwrap_or("this");
            unknown(format!("{of} has no field `{found}`"), found, expected)
        }
        E::NoSuchEnumVariant { expected, found, .. } => {
            unknown(format!("`{found}` is not one of the choices"), found, expected)
        }
        E::DuplicateStructField { field, .. } => {
            words(format!("the field `{field}` is given twice")).label("the second")
        }
        E::MissingStructField { field, .. } => words(format!("the field `{field}` is missing")),
        E::InvalidValueForType { expected, found } => {
            words(format!("expected {expected}, found {found}")).label("wrong type")
        }
        E::ExpectedDifferentLength { expected, found } => {
            words(format!("expected {expected}, found {found}"))
        }
        E::ExpectedStructLike | E::ExpectedNamedStructLike(_) => {
            words("expected values in parentheses")
        }
        E::ExpectedStructLikeEnd => words("there are more values than belong here"),
        E::ExpectedDifferentStructName { expected, found } => {
            let words = words(format!("expected a `{expected}`, found a `{found}`"));
            match found.as_str() {
                "Scene" => words.help("a scene is shown by a graph: name it in a Scanline node"),
                "Graph" => words.help("this is a graph: `spandrel render` and `check` take it"),
                _ => words,
            }
        }
        E::ExpectedFloat | E::ExpectedInteger | E::InvalidIntegerDigit { .. } => {
            words("expected a number")
        }
        E::ExpectedBoolean => words("expected true or false"),
        E::ExpectedString => words("expected a text in quotes, such as \"sun\""),
        E::ExpectedArray => words("expected a list, such as [1, 2]"),
        E::ExpectedMap => words("expected a map, such as {\"name\": 1}"),
        E::IntegerOutOfBounds => {
            words("this whole number is out of range, or must not be negative")
        }
        E::ExpectedMapColon => words("a `:` is missing after the name").label("expected `:` here"),
        E::ExpectedComma => words("a `,` is missing here").label("expected `,` before this"),
        E::ExpectedIdentifier | E::SuggestRawIdentifier(_) => words("expected a name here"),
        E::ExpectedStringEnd => words("the text that begins here has no closing quote")
            .help("write `\"` where it ends; a `\"` within is written `\\\"`"),
        E::TrailingCharacters => words("there is more behind the end")
            .help("a `)`, `]` or `}` too many stands before it, or two documents are in one file"),
        E::ExceededRecursionLimit => words("nested too deeply"),
        E::Eof => {
            words("the text ends too soon").help("a closing `)`, `]`, `}` or `\"` is missing")
        }
        other => words(other.to_string()),
    }
}

impl Place<'_> {
    fn text(&self) -> &str {
        self.index.text()
    }

    fn rest(&self) -> &str {
        self.text().get(self.span.start..).unwrap_or("")
    }

    /// What stands before the place, without blanks.
    fn before(&self) -> &str {
        self.text().get(..self.span.start).unwrap_or("").trim_end()
    }

    /// The line of a byte.
    fn line(&self, at: usize) -> usize {
        self.text()[..at].matches('\n').count() + 1
    }

    /// A word that begins a text.
    fn word(text: &str) -> &str {
        let end = text.find(|c: char| !(c.is_alphanumeric() || "_.+-/\\".contains(c)));
        &text[..end.unwrap_or(text.len())]
    }

    /// The name before an opening bracket just before the place: `Sloped` of `Sloped(`.
    fn variant(&self) -> Option<&str> {
        last_name(self.before().strip_suffix('(')?)
    }

    /// The words for brackets that do not fit.
    fn bracket(&self, error: &E) -> Option<Wording> {
        let is_end = matches!(
            error,
            E::Eof
                | E::TrailingCharacters
                | E::ExpectedComma
                | E::ExpectedIdentifier
                | E::ExpectedMapColon
                | E::ExpectedStructLikeEnd
                | E::ExpectedArrayEnd
                | E::ExpectedMapEnd
        );
        let is_near = |at: usize| at >= self.span.start.min(self.text().len());
        if !is_end {
            return None;
        }
        if let Some((open, at)) =
            self.index.crossed().filter(|(_, at)| is_near(*at) || self.rest().is_empty())
        {
            let mark = &self.text()[at..=at];
            return Some(match open {
                Some(open) => {
                    let opened = &self.text()[open..=open];
                    let line = self.line(open);
                    words(format!("`{mark}` closes a `{opened}`, which stands in line {line}"))
                        .label("does not fit")
                        .help("one of the two is another bracket, or one between them is missing")
                        .at(at..at + 1)
                }
                None => {
                    words(format!("`{mark}` closes nothing")).label("one too many").at(at..at + 1)
                }
            });
        }
        let open = self.index.unclosed()?;
        let (mark, line) = (&self.text()[open..=open], self.line(open));
        let closing = match mark {
            "(" => ')',
            "[" => ']',
            _ => '}',
        };
        let words =
            words(format!("the `{mark}` of line {line} is not closed: the text ends too soon"));
        // A comment that swallows what closes.
        let hides = |(number, line): (usize, &str)| {
            let comment = line.split_once("//")?.1;
            comment.contains(closing).then_some(number + 1)
        };
        let hidden = self.text().lines().enumerate().skip(line - 1).find_map(hides);
        Some(match hidden {
            Some(line) => words.help(format!(
                "the comment in line {line} hides a `{closing}`: a comment goes to the end of its line"
            )),
            None => words.help(format!("a closing `{closing}` is missing")),
        }
        .label("opened here")
        .at(open..open + 1))
    }

    /// The bracket that is open at the place.
    fn opening(&self) -> Option<usize> {
        let mut depth = 0;
        // Texts have been passed by the library: brackets in them are rare, and cost a worse word only.
        self.text()[..self.span.start].char_indices().rev().find_map(|(at, c)| {
            match c {
                ')' | ']' | '}' => depth += 1,
                '(' | '[' | '{' if depth == 0 => return Some(at),
                '(' | '[' | '{' => depth -= 1,
                _ => {}
            }
            None
        })
    }

    /// The byte behind the bracket that closes the one at a place.
    fn closing(&self, open: usize) -> usize {
        let is_it = |item: &super::index::Item| {
            item.value.start <= open && open < item.value.end && item.bracket.is_some()
        };
        let mut at = self.index.at(open);
        while at != 0 && !is_it(self.index.item(at)) {
            at = self.index.item(at).parent;
        }
        if at == 0 { self.text().len() } else { self.index.item(at).value.end }
    }

    /// The values in a bracket without their names.
    fn values(&self, open: usize) -> String {
        let end = self.closing(open);
        let inside = self.text().get(open + 1..end.saturating_sub(1)).unwrap_or("");
        let index = Index::new(inside);
        let values = index.children(0).map(|(_, item)| &inside[item.value.clone()]);
        let values: Vec<&str> = values.filter(|value| !value.is_empty()).collect();
        let all = values.join(", ");
        if all.is_empty() || all.len() > 60 || all.contains('\n') { "..".to_owned() } else { all }
    }

    /// The fields that belong where `text` stands for a place.
    fn fields_of(&self, place: Range<usize>, text: &str) -> Option<&'static [&'static str]> {
        match self.probed(place, text)? {
            E::NoSuchStructField { expected, found, .. } if found == "__" => Some(expected),
            _ => None,
        }
    }

    /// The choices that belong at a place.
    fn choices_of(&self, place: Range<usize>) -> Option<&'static [&'static str]> {
        match self.probed(place, "__")? {
            E::NoSuchEnumVariant { expected, found, .. } if found == "__" => Some(expected),
            _ => None,
        }
    }

    fn probed(&self, place: Range<usize>, text: &str) -> Option<E> {
        let (before, behind) = (self.working.get(..place.start)?, self.working.get(place.end..)?);
        (self.probe)(&format!("{before}{text}{behind}"))
    }
}

/// The name that a text ends with.
fn last_name(text: &str) -> Option<&str> {
    let text = text.trim_end();
    let start = text.rfind(|c: char| !(c.is_alphanumeric() || c == '_'));
    let start = start.map_or(0, |at| at + text[at..].chars().next().map_or(1, char::len_utf8));
    let name = &text[start..];
    name.starts_with(|c: char| c.is_alphabetic() || c == '_').then_some(name)
}
