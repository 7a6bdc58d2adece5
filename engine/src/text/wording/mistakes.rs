//! Mistakes that are often made, with what to write instead.

use ron::Error as E;
use std::ops::Range;

use super::super::list;
use super::{Place, Wording, last_name, words};

impl Place<'_> {
    /// The words for a mistake that is often made, with what to write instead.
    pub(super) fn mistake(&self, error: &E) -> Option<Wording> {
        self.marks(error)
            .or_else(|| self.decimal_comma(error))
            .or_else(|| self.choices(error))
            .or_else(|| self.brackets_of_another_kind(error))
            .or_else(|| self.texts(error))
            .or_else(|| self.numbers(error))
    }

    /// `=` for `:`, `;` for `,`, comments that are none.
    fn marks(&self, error: &E) -> Option<Wording> {
        let rest = self.rest();
        let first = rest.chars().next()?;
        let name = last_name(self.before());
        match (error, first) {
            (E::ExpectedMapColon | E::ExpectedComma, '=') => {
                let name = name.unwrap_or("name");
                Some(
                    words("`=` stands where `:` belongs")
                        .label("write `:`")
                        .help(format!("write `{name}: ..`")),
                )
            }
            (_, '#') if is_color(Place::word(&rest[1..])) => {
                let color = Place::word(&rest[1..]);
                Some(words("a colour by its code needs quotes").help(format!("write \"#{color}\"")))
            }
            (_, '#' | '%' | ';') if first != ';' || rest[1..].trim_start().starts_with(';') => {
                Some(words("expected a field or a value here").help("comments begin with `//`"))
            }
            (_, '-') if rest.starts_with("--") => {
                Some(words("expected a field or a value here").help("comments begin with `//`"))
            }
            (E::ExpectedComma, ';') => {
                Some(words("`;` stands where `,` belongs").label("write `,`"))
            }
            (E::ExpectedIdentifier | E::SuggestRawIdentifier(_), ',') => {
                Some(words("a `,` without anything before it").help("leave it out"))
            }
            (E::ExpectedComma, ':') => Some(
                words("a `:` within a value")
                    .help("is a `,` missing before the name, or a `{` or `(` before it?"),
            ),
            _ => None,
        }
    }

    /// `1,5` for `1.5`.
    fn decimal_comma(&self, error: &E) -> Option<Wording> {
        let is_value_too_many = match error {
            E::ExpectedStructLikeEnd | E::ExpectedIdentifier | E::SuggestRawIdentifier(_) => true,
            // Such as "a tuple of size 3".
            E::ExpectedDifferentLength { expected, found } => {
                let length = expected.split(' ').find_map(|word| word.parse::<usize>().ok());
                length.is_none_or(|length| *found > length)
            }
            _ => false,
        };
        if !is_value_too_many {
            return None;
        }
        let text = self.text();
        let item = self.index.item(self.item);
        // In the field before, or among the values.
        let from = match error {
            E::ExpectedIdentifier | E::SuggestRawIdentifier(_) => {
                self.before().len().checked_sub(1)?
            }
            _ => item.value.start,
        };
        let bytes = text.as_bytes();
        let till = self.span.end.max(item.value.end).min(text.len());
        let is_digit = |at: usize| bytes.get(at).is_some_and(u8::is_ascii_digit);
        let comma = (from.max(1)..till)
            .find(|at| bytes[*at] == b',' && is_digit(at - 1) && is_digit(at + 1))?;
        if matches!(error, E::ExpectedIdentifier | E::SuggestRawIdentifier(_)) && comma != from {
            return None;
        }
        let start = (0..comma).rev().take_while(|at| is_digit(*at) || bytes[*at] == b'-').last()?;
        let end = (comma + 1..bytes.len()).take_while(|at| is_digit(*at)).last()? + 1;
        let (whole, fraction) = (&text[start..comma], &text[comma + 1..end]);
        Some(
            words(format!("`{whole},{fraction}` is two numbers"))
                .label("a comma parts values")
                .help(format!("if it is one, write {whole}.{fraction}"))
                .at(start..end),
        )
    }

    /// Values with names where they have none, and the reverse.
    fn choices(&self, error: &E) -> Option<Wording> {
        let rest = self.rest();
        let word = Place::word(rest);
        let is_named = !word.is_empty()
            && !word.starts_with(|c: char| c.is_ascii_digit())
            && rest[word.len()..].trim_start().starts_with([':', '=']);
        let is_value = matches!(
            error,
            E::ExpectedInteger
                | E::InvalidIntegerDigit { .. }
                | E::ExpectedFloat
                | E::ExpectedString
                | E::ExpectedBoolean
                | E::ExpectedArray
                | E::ExpectedStructLike
                | E::ExpectedNamedStructLike(_)
                | E::NoSuchEnumVariant { .. }
                | E::ExpectedDifferentStructName { .. }
                | E::ExpectedComma
                | E::ExpectedMap
        );
        let before = self.before();
        if is_value && is_named && before.ends_with(['(', ',']) {
            let open = self.opening()?;
            let variant = last_name(&self.text()[..open]);
            let is_empty = matches!(error, E::ExpectedComma);
            let name = variant.unwrap_or("");
            return Some(match (is_empty, variant) {
                (true, Some(name)) => {
                    words(format!("`{name}` takes no values")).help(format!("write {name}"))
                }
                _ => words(match variant {
                    Some(name) => format!("`{name}` takes its values without names"),
                    None => "these values have no names".to_owned(),
                })
                .label("a name")
                .help(format!("write {name}({})", self.values(open))),
            });
        }
        match error {
            E::ExpectedComma if before.ends_with('(') && rest.starts_with(')') => {
                let name = self.variant()?;
                Some(words(format!("`{name}` takes no values")).help(format!("write {name}")))
            }
            E::ExpectedStructLike
                if last_name(before).is_some() && !rest.starts_with(['[', '{']) =>
            {
                let name = last_name(before)?;
                let start = before.len() - name.len();
                let fields = self.fields_of(start..before.len(), &format!("{name}(__: 0)"));
                Some(
                    match fields {
                        Some(fields) => words(format!("`{name}` needs its fields")).help(format!(
                            "write {name}(..) with {}",
                            list(fields.iter().copied())
                        )),
                        None => words(format!("`{name}` needs its values in parentheses"))
                            .help(format!("write {name}(..)")),
                    }
                    .at(start..before.len()),
                )
            }
            E::ExpectedIdentifier | E::SuggestRawIdentifier(_) if before.ends_with('(') => {
                let open = before.len() - 1;
                let name = last_name(&self.text()[..open]).unwrap_or("");
                let end = self.closing(open);
                let fields = self.fields_of(open..end, "(__: 0)");
                let message = match name {
                    "" => "these values need names".to_owned(),
                    name => format!("the values of `{name}` need names"),
                };
                Some(words(message).label("a value without its name").help(match fields {
                    Some(fields) => {
                        format!(
                            "write {name}({}: ..); its fields: {}",
                            fields.first()?,
                            list(fields.iter().copied())
                        )
                    }
                    None => format!("write {name}(name: value)"),
                }))
            }
            E::ExpectedIdentifier | E::SuggestRawIdentifier(_) => {
                let is_value = rest.starts_with(['"', '.', '-', '+', '(', '[', '{'])
                    || rest.starts_with(|c: char| c.is_ascii_digit());
                if !is_value {
                    return (!rest.is_empty() && !rest.starts_with(|c: char| c.is_alphabetic()))
                        .then(|| {
                            words("expected a name here")
                                .help("perhaps a `)`, `]` or `,` is missing before it")
                        });
                }
                let value =
                    self.span.start..self.index.item(self.item).value.end.max(self.span.end);
                let words = words("expected one of the choices, by name");
                Some(match self.choices_of(value) {
                    Some(choices) => {
                        words.help(format!("the choices are {}", list(choices.iter().copied())))
                    }
                    None if before.ends_with(',') => {
                        words.help("is a name missing before this value?")
                    }
                    None => words,
                })
            }
            E::ExpectedDifferentStructName { found, .. } if is_named && found == word => {
                Some(words("expected values in parentheses").help(format!("write ({word}: ..)")))
            }
            _ => None,
        }
    }

    /// `[..]` for `(..)` and the like.
    fn brackets_of_another_kind(&self, error: &E) -> Option<Wording> {
        let rest = self.rest();
        let found = rest.chars().next()?;
        let (open, close, what) = match error {
            E::ExpectedStructLike | E::ExpectedNamedStructLike(_) => {
                ('(', ')', "values in parentheses")
            }
            E::ExpectedArray => ('[', ']', "a list in square brackets"),
            E::ExpectedMap => ('{', '}', "a map in braces"),
            _ => return None,
        };
        let words = words(format!("expected {what}"));
        if "([{".contains(found) && found != open {
            let end = self.closing(self.span.start);
            let inside = &self.text()[self.span.start + 1..end.max(self.span.start + 1)];
            let inside = inside.strip_suffix([')', ']', '}']).unwrap_or(inside).trim();
            let shown =
                if inside.chars().count() <= 40 && !inside.contains('\n') { inside } else { ".." };
            return Some(words.help(format!("write {open}{shown}{close}")));
        }
        let value = self.text().get(self.index.item(self.item).value.clone())?;
        let is_short = value.chars().count() <= 40 && !value.contains('\n') && !value.is_empty();
        match error {
            E::ExpectedArray if is_short => Some(words.help(format!("write [{value}]"))),
            _ => None,
        }
    }

    /// Texts without quotes, or with odd ones, and backslashes.
    fn texts(&self, error: &E) -> Option<Wording> {
        let rest = self.rest();
        match error {
            E::InvalidEscape(_) => {
                let item = self.index.item(self.item);
                let around = [item.key.clone(), Some(item.value.clone())];
                let holds = |place: &Range<usize>| {
                    place.start <= self.span.start && self.span.start <= place.end
                };
                let written =
                    around.into_iter().flatten().find(holds).and_then(|at| self.text().get(at));
                let written = written.filter(|text| text.starts_with('"') && text.len() <= 200);
                let cure = written.map_or_else(
                    || "a/b.png".to_owned(),
                    |text| text.replace("\\\\", "/").replace('\\', "/"),
                );
                let at = self.text()[self.span.start..self.span.end]
                    .rfind('\\')
                    .map(|at| self.span.start + at);
                let words = words("a backslash begins a letter that cannot be written so").help(
                    format!("in a path write `/`: {cure}; a backslash itself is written `\\\\`"),
                );
                Some(match at {
                    Some(at) => words.at(at..self.span.end.max(at + 1)),
                    None => words,
                })
            }
            E::ExpectedString => {
                let first = rest.chars().next()?;
                let bare = rest.trim_start_matches(['\'', '`', '“', '”', '‘', '’', '«', '»', '„']);
                let end = bare.find(|c: char| c.is_whitespace() || ",()[]{}'`“”‘’«»:".contains(c));
                let word = &bare[..end.unwrap_or(bare.len())];
                // A path with a colon, as `http://x`.
                let word = if bare[word.len()..].starts_with("://") { "http://.." } else { word };
                let message = match first {
                    '\'' | '`' | '“' | '”' | '‘' | '’' | '«' | '»' | '„' => {
                        "texts have straight double quotes"
                    }
                    c if c.is_ascii_digit() && word.parse::<f64>().is_err() => {
                        "a name that begins with a digit needs quotes, as all names do"
                    }
                    c if c.is_alphanumeric() || "_./~-+#".contains(c) => {
                        "texts and names need quotes"
                    }
                    _ => return None,
                };
                let at = self.span.start
                    ..self.span.start
                        + (rest.len() - bare.len() + word.len()).max(first.len_utf8());
                Some(
                    words(message)
                        .help(format!("write \"{word}\""))
                        .at(at.start..at.end.min(self.text().len())),
                )
            }
            _ => None,
        }
    }

    /// Numbers that are none.
    fn numbers(&self, error: &E) -> Option<Wording> {
        let rest = self.rest();
        let word = Place::word(rest);
        match error {
            E::ExpectedComma => {
                let before = &self.text()[..self.span.start];
                let is_number = before.ends_with(|c: char| c.is_ascii_digit());
                match rest.chars().next()? {
                    '.' if is_number => {
                        Some(words("expected a whole number").label("no fraction here"))
                    }
                    c if is_number && (c.is_alphabetic() || c == '%' || c == '°') => {
                        Some(words("a number without a unit is expected").help(
                            "leave the unit out; `spandrel nodes` and SCENES.md say which is meant",
                        ))
                    }
                    c if c.is_alphanumeric() || "\"([{_".contains(c) => {
                        let line = self.line(self.before().len());
                        Some(
                            words(format!("a `,` is missing after what stands in line {line}"))
                                .label("expected `,` before this")
                                .help("fields, entries and values are parted by commas"),
                        )
                    }
                    _ => None,
                }
            }
            E::ExpectedFloat
            | E::ExpectedInteger
            | E::InvalidIntegerDigit { .. }
            | E::ExpectedBoolean => {
                let of = match error {
                    E::ExpectedBoolean => "expected true or false",
                    _ => "expected a number",
                };
                let lower = word.to_lowercase();
                match lower.as_str() {
                    "null" | "nil" | "none" | "undefined" => {
                        Some(words(of).help("write None, or leave the field out"))
                    }
                    "yes" | "on" | "true" if of.ends_with("false") => {
                        Some(words(of).help("write true"))
                    }
                    "no" | "off" | "false" if of.ends_with("false") => {
                        Some(words(of).help("write false"))
                    }
                    "nan" | "inf" | "infinity" => Some(words("expected a finite number")),
                    _ if rest.starts_with('"')
                        && rest[1..].starts_with(|c: char| c.is_ascii_digit() || c == '-') =>
                    {
                        Some(words(of).help("numbers have no quotes"))
                    }
                    _ => None,
                }
            }
            _ => None,
        }
    }
}

/// Whether a word is the code of a colour.
fn is_color(word: &str) -> bool {
    matches!(word.len(), 3 | 4 | 6 | 8) && word.bytes().all(|b| b.is_ascii_hexdigit())
}
