//! The catalogue: what declarations say of kinds of node, and the walk over a declaration that finds
//! links, files and ranges.

use serde_json::Value as Json;

use super::document::field_span;
use super::link::{FILE, LINK, NAMED, READER};

/// The schema's names of the parts of a field that has several, such as `["width", "height"]`.
const PARTS: &str = "x-parts";
/// The mark of a value that is fastest, for drafts.
const DRAFT: &str = "x-draft";
/// The schema's word for what a field holds, if its type does not say it.
const WHAT: &str = "x-what";

/// A field of a kind of node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// What it holds, in words.
    pub kind: String,
    /// Its default as it would be typed; none if it must be given. `None` if it may be left out.
    pub default: Option<String>,
    /// What it means.
    pub doc: String,
    /// The value that is fastest, if the field trades speed for accuracy.
    pub draft: Option<String>,
}

/// The documentation of a schema, as plain text.
pub(super) fn doc(schema: &Json) -> String {
    schema.get("description").and_then(Json::as_str).unwrap_or("").replace("\\[", "[")
}

/// The fields of a kind; `default` is the text of its default value.
pub(super) fn fields(schema: &Json, default: &str) -> Vec<Field> {
    let Some(properties) = schema.get("properties").and_then(Json::as_object) else {
        return Vec::new();
    };
    let field = |(name, schema): (&String, &Json)| {
        let text = field_span(default, name).map(|span| default[span].to_owned());
        let is_needed = schema.get(LINK).is_some() || schema.get(FILE).is_some();
        let default = text.filter(|text| !(is_needed && text == "\"\""));
        let draft = schema.get(DRAFT).and_then(Json::as_str).map(str::to_owned);
        Field { name: name.clone(), kind: words(schema), default, doc: doc(schema), draft }
    };
    properties.iter().map(field).collect()
}

/// What a schema allows, in words.
fn words(schema: &Json) -> String {
    let text = |key: &str| schema.get(key).and_then(Json::as_str);
    if let Some(of) = text(LINK) {
        return format!("link to {of}");
    }
    if let Some(how) = text(FILE) {
        return if how == "read" { "file".to_owned() } else { "file to write".to_owned() };
    }
    if let Some(what) = text(WHAT) {
        return what.to_owned();
    }
    if let Some(title) = text("title") {
        return title.to_lowercase();
    }
    for key in ["oneOf", "anyOf"] {
        if let Some(choices) = schema.get(key).and_then(Json::as_array) {
            let known =
                choices.iter().filter(|choice| choice.get("type") != Some(&Json::from("null")));
            return known.map(words).collect::<Vec<_>>().join(" | ");
        }
    }
    if let Some(constant) = text("const") {
        return constant.to_owned();
    }
    if let Some(choices) = schema.get("enum").and_then(Json::as_array) {
        let names = choices.iter().filter_map(Json::as_str);
        return names.collect::<Vec<_>>().join(" | ");
    }
    let types: Vec<&str> = match schema.get("type") {
        Some(Json::String(one)) => vec![one.as_str()],
        Some(Json::Array(some)) => some.iter().filter_map(Json::as_str).collect(),
        _ => Vec::new(),
    };
    let main = types.iter().find(|kind| **kind != "null").copied().unwrap_or("value");
    match main {
        "array" => match (schema.get("prefixItems"), schema.get("items")) {
            (Some(Json::Array(items)), _) => tuple(&parts(schema), items.iter().map(words)),
            (_, Some(items)) => match schema.get("maxItems").and_then(Json::as_u64) {
                Some(count) => tuple(&["x", "y", "z"], (0..count).map(|_| words(items))),
                None => match items.get("prefixItems").and_then(Json::as_array) {
                    Some(all) => {
                        format!("list of {}", tuple(&parts(schema), all.iter().map(words)))
                    }
                    None => format!("list of {}", words(items)),
                },
            },
            _ => "list".to_owned(),
        },
        "number" | "integer" => {
            let name = if main == "number" { "number" } else { "whole number" };
            match (bound(schema, "minimum"), bound(schema, "maximum")) {
                (Some(low), Some(high)) => format!("{name} {low} to {high}"),
                // Those that count have no sign.
                (Some(0.0), None) if main == "integer" => name.to_owned(),
                (Some(low), None) => format!("{name} {low} or more"),
                (None, Some(high)) => format!("{name} up to {high}"),
                (None, None) => name.to_owned(),
            }
        }
        "boolean" => "true | false".to_owned(),
        "string" => "text".to_owned(),
        // A variant with data: its name, and what it holds.
        "object" => match schema.get("properties").and_then(Json::as_object) {
            Some(properties) if properties.len() == 1 => {
                let (name, held) = properties.iter().next().expect("there is one");
                format!("{name}({})", words(held).trim_matches(['(', ')']))
            }
            Some(properties) if !properties.is_empty() => {
                let field = |(name, held): (&String, &Json)| format!("{name}: {}", words(held));
                format!("({})", properties.iter().map(field).collect::<Vec<_>>().join(", "))
            }
            _ => "fields".to_owned(),
        },
        other => other.to_owned(),
    }
}

/// The names of the parts of a field that has several.
fn parts(schema: &Json) -> Vec<&str> {
    let names = schema.get(PARTS).and_then(Json::as_array).into_iter().flatten();
    names.filter_map(Json::as_str).collect()
}

/// Values in parentheses, by their names if these are known.
fn tuple(names: &[&str], kinds: impl Iterator<Item = String>) -> String {
    let kinds: Vec<String> = kinds.collect();
    let Some(names) = names.get(..kinds.len()).filter(|names| !names.is_empty()) else {
        return format!("({})", kinds.join(", "));
    };
    let list = names.join(", ");
    let first = &kinds[0];
    match kinds.iter().all(|kind| kind == first) {
        true if first == "number" => format!("({list})"),
        true => format!("({list}) of {}", first.replacen("number", "numbers", 1)),
        false => {
            let named = names.iter().zip(&kinds).map(|(name, kind)| format!("{name}: {kind}"));
            format!("({})", named.collect::<Vec<_>>().join(", "))
        }
    }
}

fn bound(schema: &Json, key: &str) -> Option<f64> {
    schema.get(key).and_then(Json::as_f64)
}

/// A place in a node's parameters that the graph must know of.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Leaf {
    /// A link: the type, the kind of node that reads such a type, the target.
    Link { of: String, reader: Option<String>, target: String },
    /// A file that the node reads.
    Input(String),
    /// A file that the node writes.
    Output(String),
    /// A number that is out of its range: what is wrong.
    OutOfRange(String),
}

/// Visits the leaves of a node's parameters by its schema; `found` is told the top-level field.
pub(super) fn visit(schema: &Json, parameters: &Json, found: &mut impl FnMut(&str, Leaf)) {
    let Some(properties) = schema.get("properties").and_then(Json::as_object) else { return };
    for (name, schema) in properties {
        if let Some(value) = parameters.get(name) {
            visit_value(schema, value, &mut |leaf| found(name, leaf));
        }
    }
}

/// The parameters of a node without the names of its links, but for those whose [name matters](super::link::NamedLink):
/// what it makes does not depend on them.
pub(super) fn nameless(schema: &Json, parameters: &Json) -> Json {
    let mut nameless = parameters.clone();
    forget_names(schema, &mut nameless);
    nameless
}

fn forget_names(schema: &Json, value: &mut Json) {
    if schema.get(LINK).is_some() {
        let is_given = value.as_str().is_some_and(|target| !target.is_empty());
        if is_given && schema.get(NAMED).is_none() {
            *value = Json::from("a link");
        }
        return;
    }
    for key in ["oneOf", "anyOf"] {
        let choices = schema.get(key).and_then(Json::as_array).into_iter().flatten();
        choices.for_each(|choice| forget_names(choice, value));
    }
    if let Some(properties) = schema.get("properties").and_then(Json::as_object) {
        for (name, schema) in properties {
            value.get_mut(name).into_iter().for_each(|value| forget_names(schema, value));
        }
    }
    let tuple = schema.get("prefixItems").and_then(Json::as_array);
    for (i, value) in value.as_array_mut().into_iter().flatten().enumerate() {
        let schema = tuple.and_then(|items| items.get(i)).or_else(|| schema.get("items"));
        schema.into_iter().for_each(|schema| forget_names(schema, value));
    }
}

fn visit_value(schema: &Json, value: &Json, found: &mut dyn FnMut(Leaf)) {
    let text = |key: &str| schema.get(key).and_then(Json::as_str);
    if let (Some(of), Some(target)) = (text(LINK), value.as_str()) {
        let reader = text(READER).map(str::to_owned);
        found(Leaf::Link { of: of.to_owned(), reader, target: target.to_owned() });
        return;
    }
    if let (Some(use_), Some(path)) = (text(FILE), value.as_str()) {
        let path = path.to_owned();
        found(if use_ == "read" { Leaf::Input(path) } else { Leaf::Output(path) });
        return;
    }
    if let Some(number) = value.as_f64() {
        let (low, high) = (bound(schema, "minimum"), bound(schema, "maximum"));
        // A number of single precision may be its own bound, rounded.
        let below = |a: f64, b: f64| a < b && (a as f32) < (b as f32);
        if low.is_some_and(|low| below(number, low)) || high.is_some_and(|high| below(high, number))
        {
            found(Leaf::OutOfRange(format!("{number} is out of range: {}", words(schema))));
        }
    }
    for key in ["oneOf", "anyOf"] {
        for choice in schema.get(key).and_then(Json::as_array).into_iter().flatten() {
            visit_value(choice, value, found);
        }
    }
    if let (Some(properties), Some(values)) =
        (schema.get("properties").and_then(Json::as_object), value.as_object())
    {
        for (name, schema) in properties {
            if let Some(value) = values.get(name) {
                visit_value(schema, value, found);
            }
        }
    }
    if let Some(values) = value.as_array() {
        let tuple = schema.get("prefixItems").and_then(Json::as_array);
        for (i, value) in values.iter().enumerate() {
            let schema = tuple.and_then(|items| items.get(i)).or_else(|| schema.get("items"));
            if let Some(schema) = schema {
                visit_value(schema, value, found);
            }
        }
    }
}
