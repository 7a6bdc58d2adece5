//! Drafts: the fast end of whatever trades speed for accuracy (\[D], fig. 1).

use spandrel_engine::graph::Registry;
use spandrel_engine::graph::document::Document;
use spandrel_engine::motion::Motion;

use crate::args::Render;
use crate::print;

/// Sets every parameter that has a `draft` to that, and every other field that trades speed for accuracy to its fastest
/// value, but for those that the user sets; tells which.
pub(crate) fn apply(registry: &Registry, document: &mut Document, args: &Render) {
    let mut taken = Vec::new();
    let sets = |node: Option<&str>, field: &str| {
        args.set.iter().any(|set| set.node.as_deref() == node && set.field == field)
    };
    let mut chosen = Vec::new();
    for raw in document.parameters.clone() {
        let Some(fast) = raw.value("draft").filter(|_| !sets(None, &raw.id)) else { continue };
        if !raw.value("default").is_some_and(|now| is_same(now, fast))
            && document.set_parameter(&raw.id, fast).is_ok()
        {
            taken.push(format!("{}={fast}", raw.id));
        }
        chosen.push(raw.id.clone());
    }
    for raw in document.nodes.clone() {
        let fields = registry.kind(&raw.kind).map(|kind| &kind.fields[..]).unwrap_or_default();
        for field in fields {
            let Some(fast) = &field.draft else { continue };
            let by_itself = field.default.as_deref().unwrap_or("");
            let now = raw.value(&field.name).unwrap_or(by_itself);
            // A parameter is the user's, or has been chosen by the author of the graph.
            let names = names(now);
            let is_set = sets(Some(&raw.id), &field.name)
                || names.iter().any(|name| sets(None, name) || chosen.contains(name));
            if is_set || is_as_fast(now, fast, by_itself) {
                continue;
            }
            // A node that cannot be set is told by the check.
            if document.set(&raw.id, &field.name, fast).is_ok() {
                taken.push(format!("{}.{}={fast}", raw.id, field.name));
            }
        }
    }
    taken.extend(scale(args).map(|(scale, _)| format!("--scale {scale}")));
    if taken.is_empty() {
        print::chat("draft: the graph is as fast as it can be");
    } else {
        print::chat(&format!("draft: {}", taken.join(", ")));
    }
}

/// The parameters of the graph that a value is made of.
fn names(value: &str) -> Vec<String> {
    let text = format!("Field(value: {value})");
    let (motion, _) = Motion::find(&text, |_| false);
    motion.names(&(0..text.len())).into_iter().map(str::to_owned).collect()
}

/// Whether a value is as fast as the fastest is: the same, or a number on its far side, seen from the value that a node
/// has by itself.
fn is_as_fast(now: &str, fast: &str, by_itself: &str) -> bool {
    let numbers = [now, fast, by_itself].map(|text| text.parse::<f64>().ok());
    is_same(now, fast)
        || match numbers {
            [Some(now), Some(fast), Some(by_itself)] if fast > by_itself => now >= fast,
            [Some(now), Some(fast), _] => now <= fast,
            _ => false,
        }
}

/// Whether two values are the same number, or the same text but for blanks.
fn is_same(one: &str, other: &str) -> bool {
    let bare = |text: &str| text.chars().filter(|c| !c.is_whitespace()).collect::<String>();
    let numbers = one.parse::<f64>().ok().zip(other.parse::<f64>().ok());
    bare(one) == bare(other) || numbers.is_some_and(|(one, other)| one == other)
}

/// The scale of a draft, unless the user says how large pictures are.
pub(crate) fn scale(args: &Render) -> Option<(f64, f64)> {
    let is_free = args.size.is_none() && args.scale.is_none() && args.window.is_none();
    (args.draft && is_free).then_some((0.5, 0.5))
}
