//! `spandrel nodes`: the catalogue, from the declarations.

use serde_json::json;
use spandrel_engine::graph::Registry;
use spandrel_engine::graph::diagnostic::nearest;
use spandrel_engine::graph::registry::Kind;
use spandrel_engine::motion::{WORDS, Word};
use std::collections::BTreeMap;
use std::fmt::Write;

use crate::args::Nodes;
use crate::{exit, print};

pub(crate) fn run(registry: &Registry, args: &Nodes) -> u8 {
    let chosen: Vec<&Kind> = match &args.kind {
        None => registry.kinds().collect(),
        Some(name) => {
            let kind = registry.kind(name).or_else(|| registry.by_alias(name));
            let Some(kind) = kind else {
                let near = nearest(name, registry.kinds().map(|kind| kind.name.as_str()));
                let hint = near.map_or(String::new(), |near| format!(": did you mean {near}?"));
                print::error(format!("there is no kind of node {name}{hint}"));
                return exit::USAGE;
            };
            vec![&**kind]
        }
    };
    if args.json {
        let kinds: Vec<_> = chosen.iter().map(|kind| as_json(kind)).collect();
        let word = |word: &Word| json!({"name": word.name, "form": word.form, "doc": word.doc});
        let words: Vec<_> = WORDS.iter().map(word).collect();
        let all = json!({"version": env!("CARGO_PKG_VERSION"), "any_value": words, "kinds": kinds});
        print::out(&format!("{all:#}\n"));
    } else if args.kind.is_some() {
        chosen.iter().for_each(|kind| print::out(&description(kind)));
    } else {
        print::out(&list(&chosen));
    }
    exit::DONE
}

fn list(kinds: &[&Kind]) -> String {
    let mut groups: BTreeMap<&str, Vec<&Kind>> = BTreeMap::new();
    for kind in kinds {
        groups.entry(&kind.group).or_default().push(kind);
    }
    let width = kinds.iter().map(|kind| kind.name.len()).max().unwrap_or(0);
    let mut out = String::new();
    for (group, kinds) in groups {
        let _ = writeln!(out, "{group}");
        for kind in kinds {
            let first = kind.doc.split_once(". ").map_or(kind.doc.as_str(), |(first, _)| first);
            let first = first.trim_end_matches('.').replace('\n', " ");
            let _ = writeln!(out, "  {:width$}  {first}", kind.name);
        }
    }
    let _ = writeln!(out, "\n`spandrel nodes KIND` describes one. Any value of a field may be:");
    for Word { form, doc, .. } in &WORDS {
        let _ = writeln!(out, "  {form:27}  {doc}");
    }
    out
}

fn description(kind: &Kind) -> String {
    let mut out = String::new();
    let _ = writeln!(out, "{} ({}) -> {}\n", kind.name, kind.group, kind.output);
    let _ = writeln!(out, "{}\n", wrapped(&kind.doc, ""));
    if !kind.aliases.is_empty() {
        let _ = writeln!(out, "Elsewhere: {}\n", kind.aliases.join(", "));
    }
    for field in &kind.fields {
        let default = match field.default.as_deref() {
            Some("None") => ", optional".to_owned(),
            Some(default) => format!(" = {default}"),
            None => ", needed".to_owned(),
        };
        let _ = writeln!(out, "  {}: {}{default}", field.name, field.kind);
        let _ = writeln!(out, "{}\n", wrapped(&field.doc, "      "));
    }
    out
}

/// A text in lines of at most 88 characters.
fn wrapped(text: &str, indent: &str) -> String {
    let mut lines = vec![String::from(indent)];
    for word in text.split_whitespace() {
        let line = lines.last_mut().expect("there is a line");
        if line.len() + word.len() > 88 && line.len() > indent.len() {
            lines.push(format!("{indent}{word}"));
        } else {
            if line.len() > indent.len() {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines.join("\n")
}

fn as_json(kind: &Kind) -> serde_json::Value {
    let defaults =
        kind.fields.iter().map(|field| (field.name.clone(), field.default.clone().into()));
    json!({
        "kind": kind.name,
        "group": kind.group,
        "makes": kind.output,
        "aliases": kind.aliases,
        "doc": kind.doc,
        "defaults": serde_json::Map::from_iter(defaults),
        "schema": kind.schema(),
    })
}
