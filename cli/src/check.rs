//! `spandrel check`, and the reading of graphs that other commands share.

use spandrel_engine::camera::Camera;
use spandrel_engine::graph::demand::Wishes;
use spandrel_engine::graph::diagnostic::{list, nearest};
use spandrel_engine::graph::document::Document;
use spandrel_engine::graph::parameter::ParameterInfo;
use spandrel_engine::graph::report::Progress;
use spandrel_engine::graph::{Graph, Registry, Run, Schedule};
use spandrel_engine::moment::Frames;
use spandrel_engine::open;
use spandrel_engine::scene::Scene;
use spandrel_engine::values::Lamps;
use std::borrow::Cow;
use std::collections::HashSet;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::args::{Check, Setting};
use crate::{exit, print};

pub(crate) fn run(registry: &Registry, args: &Check) -> u8 {
    match read(registry, &args.graph, &args.set, args.frames.as_ref()) {
        Ok(graph) => {
            let code = scenes(&graph, &args.graph);
            if code != exit::DONE {
                return code;
            }
            let count = graph.nodes().count();
            print::words(&format!("{}: {count} nodes, no errors\n", name(&args.graph)));
            graph.parameters().iter().for_each(|parameter| print::words(&described(parameter)));
            exit::DONE
        }
        Err(code) => code,
    }
}

/// Reads the scenes that a graph names, and what it takes of them by name; prints what is wrong, and returns the exit
/// code.
fn scenes(graph: &Graph, path: &Path) -> u8 {
    let run = Run::new();
    let mut told = HashSet::new();
    let mut code = exit::DONE;
    for node in graph.nodes() {
        let mut wishes = Wishes::new();
        match node.kind {
            "ReadScene" => wishes.want::<Scene>(node.id, ()),
            "SceneCamera" => wishes.want::<Camera>(node.id, ()),
            "SceneLights" => wishes.want::<Lamps>(node.id, ()),
            _ => continue,
        };
        let plan = Schedule::new(graph, &wishes);
        match plan.and_then(|plan| run.evaluate(graph, &plan, &Told)) {
            Ok(done) if node.kind == "ReadScene" => {
                let unreadable = done.value::<Scene>(0).unreadable_pictures();
                unreadable.iter().for_each(|picture| Told.warned(node.id, picture));
            }
            Ok(_) => {}
            Err(failure) => {
                let message = failure.to_string();
                if told.insert(message.clone()) {
                    print::error(format!("{}: {message}", name(path)));
                }
                code = exit::of(&failure.error);
            }
        }
    }
    code
}

/// Prints what nodes tell.
struct Told;

impl Progress for Told {
    fn noted(&self, node: &str, message: &str) {
        print::note(format!("node \"{node}\": {message}"));
    }

    fn warned(&self, node: &str, message: &str) {
        print::warning(format!("node \"{node}\": {message}"));
    }
}

/// Reads and checks a graph; prints what is wrong and returns the exit code if it is unusable.
pub(crate) fn read(
    registry: &Registry,
    path: &Path,
    settings: &[Setting],
    frames: Option<&Frames>,
) -> Result<Graph, u8> {
    let (mut document, directory) = open(path)?;
    set(registry, &mut document, settings)?;
    check(registry, path, &document, &directory, frames)
}

/// A parameter in a line.
fn described(parameter: &ParameterInfo) -> String {
    let ParameterInfo { name, kind, value, range, choices, draft, doc } = parameter;
    let mut line = format!("  {name}: {kind}, {value}");
    if let Some((low, high)) = range {
        line += &format!(" ({low} to {high})");
    }
    if !choices.is_empty() {
        line += &format!(" (of {})", choices.join(", "));
    }
    if let Some(draft) = draft {
        line += &format!(" (draft: {draft})");
    }
    if !doc.is_empty() {
        line += &format!(": {doc}");
    }
    line + "\n"
}

/// Sets parameters of a document; quotes may be missing.
pub(crate) fn set<'s>(
    registry: &Registry,
    document: &mut Document,
    settings: impl IntoIterator<Item = &'s Setting>,
) -> Result<(), u8> {
    for setting in settings {
        let Setting { node, field, value } = setting;
        let Some(node) = node else {
            document.set_parameter(field, &quoted(document, field, value)).map_err(|message| {
                print::error(format!("--set {field}: {message}"));
                exit::USAGE
            })?;
            continue;
        };
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

/// The value of a parameter, in the quotes that shells take.
fn quoted(document: &Document, name: &str, value: &str) -> String {
    let raw = document.parameters.iter().find(|raw| raw.id == name);
    let kind = raw.map(|raw| raw.kind.as_str());
    let is_moving = ["Curve(", "Expr(", "Ref("].iter().any(|moving| value.starts_with(moving));
    let choices = || raw.and_then(|raw| raw.parsed::<Vec<String>>("of")).unwrap_or_default();
    let is_text = match kind {
        Some("Text") => true,
        Some("Color") => value.starts_with('#'),
        Some("Choice") => choices().iter().any(|choice| choice == value),
        _ => false,
    };
    match is_text && !value.starts_with('"') && !is_moving {
        true => format!("{value:?}"),
        false => value.to_owned(),
    }
}

/// The frames of a document that are rendered if nobody says which.
pub(crate) fn frames_of(document: &Document) -> Frames {
    document.frames.clone().unwrap_or(Frames::one(1))
}

/// Checks a document, for its own frames if no others are said.
pub(crate) fn check(
    registry: &Registry,
    path: &Path,
    document: &Document,
    directory: &Path,
    frames: Option<&Frames>,
) -> Result<Graph, u8> {
    let own = frames_of(document);
    let frames = frames.unwrap_or(&own);
    Graph::check_frames(document, registry, directory, frames).map_err(|faults| {
        print::faults(&name(path), document, &faults);
        if faults.iter().all(|fault| fault.is_input) { exit::INPUT } else { exit::INVALID }
    })
}

/// Reads a graph's document; returns it with the folder from which its files are found. `-` is the standard input,
/// its files are found from the current folder.
pub(crate) fn open(path: &Path) -> Result<(Document, PathBuf), u8> {
    let text = text(path).map_err(|error| {
        print::error(&error);
        exit::of(&error)
    })?;
    let document = Document::parse(&text).map_err(|faults| {
        print::diagnostics(&name(path), &text, &faults);
        exit::INVALID
    })?;
    let folder = if is_standard(path) { None } else { path.parent() };
    Ok((document, folder.unwrap_or(Path::new("")).to_owned()))
}

/// The text of a graph; what is doubtful in it is printed.
pub(crate) fn text(path: &Path) -> spandrel_engine::Result<String> {
    let shown = PathBuf::from(&*name(path));
    let bytes = if is_standard(path) {
        let mut bytes = Vec::new();
        let read = std::io::stdin().lock().read_to_end(&mut bytes);
        read.map_err(|error| spandrel_engine::Error::file(&shown, error))?;
        bytes
    } else {
        open::bytes(path)?
    };
    let open::Text { text, note } = open::text(&shown, &bytes)?;
    note.iter().for_each(|note| print::warning(format!("{}: {note}", shown.display())));
    Ok(text.into_owned())
}

/// Whether a graph is the standard input.
pub(crate) fn is_standard(path: &Path) -> bool {
    path == Path::new("-")
}

/// What a graph is called in messages.
pub(crate) fn name(path: &Path) -> Cow<'_, str> {
    if is_standard(path) { "standard input".into() } else { path.to_string_lossy() }
}

/// Says that there is no node of a name that was typed behind an option, and which are near.
pub(crate) fn unknown<'a>(option: &str, name: &str, known: impl Iterator<Item = &'a str>) -> u8 {
    let known: Vec<&str> = known.collect();
    let cure = match nearest(name, known.iter().copied()) {
        Some(near) => format!("did you mean {near}?"),
        None => format!("there are {}", list(known)),
    };
    print::error(format!("{option} {name}: there is no such node: {cure}"));
    exit::USAGE
}
