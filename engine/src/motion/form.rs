//! Values as their numbers, and what stands around them.

use crate::color::Color;
use crate::text::token::{Token, is_number, skip_blank, token};

/// A value of a text, such as `[Move(1, 0, 2), TurnY(30)]`: its numbers, and the marks and words around them. Values
/// of one form can be mixed number by number. Colours in quotes are their three linear numbers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Form {
    /// What stands before each number, and behind the last.
    around: Vec<String>,
    pub(super) numbers: Vec<f64>,
}

impl Form {
    /// Takes a value apart.
    pub(super) fn of(text: &str) -> Form {
        let mut form = Form { around: vec![String::new()], numbers: Vec::new() };
        let mut at = skip_blank(text, 0);
        let mut follows_word = false;
        while at < text.len() {
            let (kind, end) = token(text, at);
            let word = &text[at..end];
            let is_word = matches!(kind, Token::Word);
            let number = is_number(word).then(|| word.replace('_', "").parse().ok()).flatten();
            match (kind, number) {
                (Token::Word, Some(number)) => form.push(number),
                (Token::Text, _) if word.starts_with("\"#") => match color(word) {
                    Some(color) => {
                        form.add("(");
                        for (i, part) in color.into_iter().enumerate() {
                            form.add(if i == 0 { "" } else { ", " });
                            form.push(part);
                        }
                        form.add(")");
                    }
                    None => form.add(word),
                },
                // Two words must not become one, and no comma needs a space.
                _ => form.add(&format!("{}{word}", if follows_word && is_word { " " } else { "" })),
            }
            follows_word = is_word;
            at = skip_blank(text, end);
        }
        form
    }

    fn add(&mut self, text: &str) {
        if let Some(last) = self.around.last_mut() {
            last.push_str(text);
        }
    }

    fn push(&mut self, number: f64) {
        self.numbers.push(number);
        self.around.push(String::new());
    }

    /// Whether two values differ in their numbers only.
    pub(super) fn is_like(&self, other: &Form) -> bool {
        let bare = |form: &Form| {
            let around = form.around.iter();
            around.map(|text| text.replace([' ', '\n'], "")).collect::<Vec<_>>()
        };
        bare(self) == bare(other)
    }

    /// The value with other numbers.
    pub(super) fn with(&self, numbers: &[f64]) -> String {
        let mut text = String::new();
        for (i, around) in self.around.iter().enumerate() {
            text.push_str(around);
            if let Some(number) = numbers.get(i) {
                text.push_str(&written(*number));
            }
        }
        text
    }
}

/// A number as texts have it. Whole ones are without a point, so that fields that count can take them.
pub(super) fn written(number: f64) -> String {
    if number == number.trunc() && number.abs() < 1e15 {
        return format!("{}", number as i64);
    }
    format!("{number:?}")
}

/// One number, or the three of a vector or a colour.
pub(super) fn numbers(text: &str) -> Option<Vec<f64>> {
    let form = Form::of(text);
    let marks: String = form.around.concat().replace([' ', '\n'], "");
    let is_one = form.numbers.len() == 1 && marks.is_empty();
    let is_three = form.numbers.len() == 3 && matches!(&*marks, "(,,)" | "(,,,)" | "[,,]");
    (is_one || is_three).then_some(form.numbers)
}

fn color(text: &str) -> Option<[f64; 3]> {
    let color: Color = crate::text::options().from_str(text).ok()?;
    Some(color.to_array().map(f64::from))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_apart_and_together() {
        let form = Form::of("[Move(1, 0.5, -2e3), /* as it is */ TurnY( 30 )]");
        assert_eq!(form.numbers, [1.0, 0.5, -2000.0, 30.0]);
        assert_eq!(form.with(&[1.0, 2.5, 0.0, 1e-9]), "[Move(1,2.5,0),TurnY(1e-9)]");
        assert!(form.is_like(&Form::of("[Move(0,0,0), TurnY(1)]")));
        assert!(!form.is_like(&Form::of("[Move(0,0,0), TurnX(1)]")));
        assert_eq!(numbers("( 1, 2,3 )"), Some(vec![1.0, 2.0, 3.0]));
        assert_eq!(numbers("\"#fff\""), Some(vec![1.0; 3]));
        assert_eq!(numbers("-4"), Some(vec![-4.0]));
        for other in ["Sloped(8)", "(1, 2)", "\"a\"", "true", "None", "[1]"] {
            assert_eq!(numbers(other), None, "{other}");
        }
        assert_eq!(Form::of("(a: \"x #1\", b: true)").with(&[]), "(a:\"x #1\",b:true)");
    }
}
