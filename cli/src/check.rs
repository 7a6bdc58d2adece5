//! `spandrel check`, and the reading of graphs that other commands share.

use spandrel_engine::graph::document::Document;
use spandrel_engine::graph::{Graph, Registry};
use std::path::Path;

use crate::args::{Check, Setting};
use crate::{exit, print};

pub(crate) fn run(registry: &Registry, args: &Check) -> u8 {
    match read(registry, &args.graph, &args.set) {
        Ok(graph) => {
            let count = graph.nodes().count();
            print::out(&format!("{}: {count} nodes, no errors\n", args.graph.display()));
            exit::DONE
        }
        Err(code) => code,
    }
}

/// Reads and checks a graph; prints what is wrong and returns the exit code if it is unusable.
pub(crate) fn read(registry: &Registry, path: &Path, settings: &[Setting]) -> Result<Graph, u8> {
    let (mut document, directory) = open(path)?;
    set(registry, &mut document, settings)?;
    check(registry, path, &document, &directory)
}

/// Sets parameters of a document; quotes may be missing.
pub(crate) fn set(
    registry: &Registry,
    document: &mut Document,
    settings: &[Setting],
) -> Result<(), u8> {
    for Setting { node, field, value } in settings {
        let raw = document.nodes.iter().find(|raw| raw.id == *node);
        let kind = raw.and_then(|raw| registry.kind(&raw.kind));
        let value = kind.map_or_else(|| value.clone(), |kind| kind.written(field, value));
        document.set(node, field, &value).map_err(|message| {
            print::error(format!("--set {node}.{field}: {message}"));
            exit::USAGE
        })?;
    }
    Ok(())
}

/// Checks a document.
pub(crate) fn check(
    registry: &Registry,
    path: &Path,
    document: &Document,
    directory: &Path,
) -> Result<Graph, u8> {
    Graph::check(document, registry, directory).map_err(|faults| {
        print::diagnostics(path, &document.text, &faults);
        if faults.iter().all(|fault| fault.is_input) { exit::INPUT } else { exit::INVALID }
    })
}

/// Reads a graph's document; returns it with the folder from which its files are found.
pub(crate) fn open(path: &Path) -> Result<(Document, std::path::PathBuf), u8> {
    let bytes = std::fs::read(path).map_err(|error| {
        print::error(format!("{}: {error}", path.display()));
        exit::INPUT
    })?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let byte = error.utf8_error().valid_up_to();
        print::error(format!(
            "{}: byte {byte}: not UTF-8 text: save the file as UTF-8",
            path.display()
        ));
        exit::INVALID
    })?;
    let document = Document::parse(&text).map_err(|faults| {
        print::diagnostics(path, &text, &faults);
        exit::INVALID
    })?;
    let directory = path.parent().unwrap_or(Path::new("")).to_owned();
    Ok((document, directory))
}
