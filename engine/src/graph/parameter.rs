//! The parameters of a graph: what a user may set by name, and how far.
//!
//! ```ron
//! parameters: {
//!     "haze":  Number(default: 0.02, range: (0, 1), doc: "Fog in the valley, per metre"),
//!     "look":  Choice(default: Sloped(8), of: [Sampled(1, Box), Sloped(8)], draft: Sampled(1, Box), doc: "How fine"),
//! }
//! ```

use ron::value::RawValue;
use serde::de::DeserializeOwned;

use super::diagnostic::{Diagnostic, list, nearest};
use super::document::RawNode;
use crate::color::Color;
use crate::text::{Index, options};

/// A parameter of a graph.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterInfo {
    /// Its name.
    pub name: String,
    /// What it takes: `Number`, `Whole`, `Vector`, `Color`, `Text`, `Flag`, `Choice` or `Value`.
    pub kind: String,
    /// Its value, as a graph has it.
    pub value: String,
    /// The least and the greatest value of a number.
    pub range: Option<(f64, f64)>,
    /// What a choice may be.
    pub choices: Vec<String>,
    /// Its value in drafts, as a graph has it.
    pub draft: Option<String>,
    /// What it does.
    pub doc: String,
}

/// Kinds of parameters, and what their values are.
const KINDS: [(&str, &str); 8] = [
    ("Number", "a number"),
    ("Whole", "a whole number"),
    ("Vector", "three numbers, such as (1, 0, 2)"),
    ("Color", "a colour, such as \"#8fa4c0\" or (0.2, 0.3, 0.4)"),
    ("Text", "a text in quotes"),
    ("Flag", "true or false"),
    ("Choice", "one of those in `of`"),
    ("Value", "whatever the fields take that name it"),
];

const FIELDS: [&str; 5] = ["default", "range", "of", "draft", "doc"];

/// Reads a parameter as it is at a moment.
///
/// # Errors
/// All that is wrong with it.
pub(super) fn check(raw: &RawNode) -> Result<ParameterInfo, Vec<Diagnostic>> {
    let fault = |field: &str, message: String| vec![Diagnostic::error(raw.field(field), message)];
    let Some((kind, what)) = KINDS.iter().find(|(kind, _)| *kind == raw.kind) else {
        let kinds = KINDS.iter().map(|(kind, _)| *kind);
        let message = match raw.kind.as_str() {
            "" => "a parameter begins with its kind, such as `Number(default: 1)`".to_owned(),
            kind => format!("`{kind}` is no kind of parameter"),
        };
        let found = Diagnostic::error(raw.kind_span(), message);
        return Err(vec![match nearest(&raw.kind, kinds.clone()) {
            Some(near) => found.help(format!("did you mean `{near}`?")),
            None => found.help(format!("there are {}", list(kinds))),
        }]);
    };
    let index = Index::new(raw.text.text());
    for (name, _) in index.fields() {
        let belongs = match name {
            "range" => ["Number", "Whole"].contains(kind),
            "of" => *kind == "Choice",
            name => FIELDS.contains(&name),
        };
        if !belongs {
            let message = format!(
                "a {kind} has no `{name}`: `default`, `draft`, `doc`, `range` of numbers, `of` of a Choice"
            );
            return Err(fault(name, message));
        }
    }
    let Some(value) = raw.value("default").map(str::to_owned) else {
        let message = format!("the parameter \"{}\" needs a `default`", raw.id);
        return Err(vec![Diagnostic::error(raw.id_span.clone(), message)]);
    };
    let range = match raw.value("range") {
        None => None,
        Some(_) => match raw.parsed::<(f64, f64)>("range").filter(|(low, high)| low <= high) {
            Some(range) => Some(range),
            None => {
                let message = "`range` is the least and the greatest value, such as (0, 1)";
                return Err(fault("range", message.to_owned()));
            }
        },
    };
    let doc = match raw.value("doc") {
        None => String::new(),
        Some(_) => match raw.parsed("doc") {
            Some(doc) => doc,
            None => return Err(fault("doc", "`doc` is a text in quotes".to_owned())),
        },
    };
    let choices: Option<Vec<Box<RawValue>>> = raw.parsed("of");
    let choices: Vec<String> = choices
        .unwrap_or_default()
        .iter()
        .map(|choice| choice.trim().get_ron().to_owned())
        .collect();
    if *kind == "Choice" && choices.is_empty() {
        return Err(fault("of", "a Choice needs `of`: a list of what it may be".to_owned()));
    }
    let draft = raw.value("draft").map(str::to_owned);
    for (field, value) in [("default", Some(&value)), ("draft", draft.as_ref())] {
        let fits = value.map_or(Ok(()), |value| fits((kind, what), value, &choices, range));
        fits.map_err(|what| fault(field, format!("\"{}\" is {what}", raw.id)))?;
    }
    let name = raw.id.clone();
    Ok(ParameterInfo { name, kind: (*kind).to_owned(), value, range, choices, draft, doc })
}

/// Whether a parameter may have a value; if not, what it is.
fn fits(
    (kind, what): (&str, &str),
    value: &str,
    choices: &[String],
    range: Option<(f64, f64)>,
) -> Result<(), String> {
    let is = match kind {
        "Number" => reads::<f64>(value),
        "Whole" => reads::<i64>(value),
        "Vector" => reads::<[f64; 3]>(value),
        "Color" => reads::<Color>(value),
        "Text" => reads::<String>(value),
        "Flag" => reads::<bool>(value),
        "Choice" => choices.iter().any(|choice| bare(choice) == bare(value)),
        _ => true,
    };
    if !is {
        return Err(match kind {
            "Choice" => format!("one of {}", choices.join(", ")),
            _ => what.to_owned(),
        });
    }
    match (range, options().from_str::<f64>(value)) {
        (Some((low, high)), Ok(number)) if !(low..=high).contains(&number) => {
            Err(format!("{number}: it goes from {low} to {high}"))
        }
        _ => Ok(()),
    }
}

fn reads<T: DeserializeOwned>(text: &str) -> bool {
    options().from_str::<T>(text).is_ok()
}

/// A value without what blanks make of it.
fn bare(text: &str) -> String {
    text.chars().filter(|c| !c.is_whitespace()).collect()
}
