//! Drafts: the fast end of whatever trades speed for accuracy (\[D], fig. 1).

use spandrel_engine::graph::Registry;
use spandrel_engine::graph::document::Document;
use spandrel_engine::motion::Motion;

use crate::args::{Render, Setting};
use crate::print;

/// Sets every field that trades speed for accuracy to its fastest value, but for those that the user sets, and tells
/// which.
pub(crate) fn apply(registry: &Registry, document: &mut Document, args: &Render) {
    let mut taken = Vec::new();
    for raw in document.nodes.clone() {
        let fields = registry.kind(&raw.kind).map(|kind| &kind.fields[..]).unwrap_or_default();
        for field in fields {
            let Some(fast) = &field.draft else { continue };
            let now = raw.value(&field.name).or(field.default.as_deref()).unwrap_or("");
            let is_set = |setting: &Setting| match &setting.node {
                Some(node) => *node == raw.id && setting.field == field.name,
                None => names(now, &setting.field),
            };
            if args.set.iter().any(is_set) || is_as_fast(now, fast) {
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

/// Whether a value is, or is made of, a parameter of the graph.
fn names(value: &str, parameter: &str) -> bool {
    let text = format!("Field(value: {value})");
    let (motion, _) = Motion::find(&text, |_| false);
    motion.names(&(0..text.len())).contains(&parameter)
}

/// Whether a value is as fast as the fastest is: the same, or a number that is no greater.
fn is_as_fast(now: &str, fast: &str) -> bool {
    let bare = |text: &str| text.chars().filter(|c| !c.is_whitespace()).collect::<String>();
    let numbers = now.parse::<f64>().ok().zip(fast.parse::<f64>().ok());
    bare(now) == bare(fast) || numbers.is_some_and(|(now, fast)| now <= fast)
}

/// The scale of a draft, unless the user says how large pictures are.
pub(crate) fn scale(args: &Render) -> Option<(f64, f64)> {
    let is_free = args.size.is_none() && args.scale.is_none() && args.window.is_none();
    (args.draft && is_free).then_some((0.5, 0.5))
}
