//! The own scene format as text: RON, the "character file format" of \[D].
//!
//! ```ron
//! Scene(
//!     version: 1,
//!     materials: { "brick": (color: "#a0563c"), "glass": (color: "#2a3a44") },
//!     plans: [(
//!         name: "yard",
//!         root: (children: [
//!             (name: "wall", material: "brick", shape: Polygon(
//!                 outline: [(0, 0, 0), (4, 0, 0), (4, 3, 0), (0, 3, 0)],
//!                 holes: [[(1, 0, 0), (2, 0, 0), (2, 2, 0), (1, 2, 0)]],
//!                 seals: [(outline: [(2.5, 1, 0), (3.5, 1, 0), (3.5, 2, 0)], material: "glass")],
//!             )),
//!             (name: "shed", material: "brick", transform: [Move(6, 0, -1)], shape: Box(size: (2, 2, 3))),
//!         ]),
//!     )],
//! )
//! ```

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::Path;

use super::super::document::{Document, VERSION};
use crate::error::{Error, Result};
use crate::moment::Moment;
use crate::motion::{Motion, Named, Names};
use crate::open;
use crate::text::{
    AnyValue, Diagnostic, Faults, Index, Patch, Woven, list, meant_path, nearest, options, parse,
};

/// Parses a scene text, as it is at the first frame, with its own values for its parameters.
///
/// # Errors
/// If the bytes are no text, not RON, or not a scene: all that is wrong, with the places.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<Document> {
    parse_at(path, bytes, Moment::default(), &BTreeMap::new())
}

/// Parses a scene text as it is at a moment, with values for its parameters.
///
/// # Errors
/// As [`parse()`]; if the text has no parameter of a name.
pub fn parse_at(
    path: &Path,
    bytes: &[u8],
    moment: Moment,
    given: &BTreeMap<String, AnyValue>,
) -> Result<Document> {
    let whole = &*open::text(path, bytes)?.text;
    let refuse = |list: Vec<Diagnostic>| {
        let faults = Faults { path: path.to_owned(), text: whole.to_owned(), list };
        Err(Error::Text(Box::new(faults)))
    };
    let mut woven = Woven::new(whole, 0..whole.len());
    give(&mut woven, given).map_err(|message| Error::in_file(path, message))?;
    let (motion, mut faults) = Motion::find(woven.text(), |_| false);
    for fault in &mut faults {
        fault.span = woven.place(fault.span.clone());
    }
    if !faults.is_empty() {
        return refuse(faults);
    }
    if !motion.is_empty() {
        let text = woven.text();
        let names = Parameters { text, motion: &motion, places: parameters(text) };
        woven = match motion.at(&woven, moment, &names) {
            Ok(woven) => woven,
            Err(faults) => return refuse(faults),
        };
    }
    let text = woven.text();
    let read = |text: &str| options().from_str::<Document>(text);
    let parse::Parsed { value, mut faults, .. } = parse::parse(text, read);
    let index = Index::new(text);
    faults.extend(parse::doubles(&index));
    faults.extend(parse::numbers(&index));
    if let Some(document) = &value {
        faults.extend(names(document, &index));
    }
    faults.sort_by_key(|fault| fault.span.start);
    let document = match value {
        Some(document) if faults.is_empty() => document,
        _ => {
            for fault in &mut faults {
                fault.span = woven.place(fault.span.clone());
                fault.other = fault.other.take().map(|(place, label)| (woven.place(place), label));
            }
            return refuse(faults);
        }
    };
    if document.version != VERSION {
        return Err(Error::in_file(
            path,
            format!("scene version {}: this program reads {VERSION}", document.version),
        ));
    }
    Ok(document)
}

/// The parameters of a scene text, by name, and where their values stand.
fn parameters(text: &str) -> Vec<(String, Range<usize>)> {
    if !text.contains("parameters") {
        return Vec::new();
    }
    let index = Index::new(text);
    let Some(at) = index.items().position(|item| {
        let is_named = item.key.clone().is_some_and(|key| &text[key] == "parameters");
        is_named && item.parent == 1
    }) else {
        return Vec::new();
    };
    let entry = |item: &crate::text::index::Item| {
        let name = ron::from_str(&text[item.key.clone()?]).ok()?;
        Some((name, item.value.clone()))
    };
    index.children(at).filter_map(|(_, item)| entry(item)).collect()
}

/// Puts values in the place of those that a text has for its parameters.
fn give(woven: &mut Woven, given: &BTreeMap<String, AnyValue>) -> std::result::Result<(), String> {
    let known = parameters(woven.text());
    if let Some(name) = given.keys().find(|name| known.iter().all(|(known, _)| known != *name)) {
        let names = || known.iter().map(|(name, _)| name.as_str());
        return Err(match nearest(name, names()) {
            Some(near) => {
                format!("the scene has no parameter \"{name}\": did you mean \"{near}\"?")
            }
            None => format!("the scene has no parameter \"{name}\": it has {}", list(names())),
        });
    }
    // From the last to the first, so that places stay.
    for (name, place) in known.iter().rev() {
        if let Some(value) = given.get(name) {
            let origin = woven.place(place.clone());
            woven.replace(place.clone(), &[Patch::made(value.text(), origin)]);
        }
    }
    Ok(())
}

/// What the values of a scene text may name: its own parameters.
struct Parameters<'t> {
    text: &'t str,
    motion: &'t Motion,
    places: Vec<(String, Range<usize>)>,
}

impl Names for Parameters<'_> {
    fn parameters(&self) -> Vec<&str> {
        self.places.iter().map(|(name, _)| name.as_str()).collect()
    }

    fn find(&self, name: &str) -> std::result::Result<Named<'_>, String> {
        if let Some((_, place)) = self.places.iter().find(|(known, _)| known == name) {
            return Ok(Named::Part(self.text, place.clone(), self.motion));
        }
        Err(match nearest(name, self.parameters()) {
            Some(near) => format!("there is no parameter \"{name}\": did you mean \"{near}\"?"),
            None if self.places.is_empty() => format!(
                "there is no \"{name}\" here: `frame`, `time` and the scene's own `parameters` are known"
            ),
            None => {
                let known = list(self.parameters());
                format!("there is no parameter \"{name}\": the scene has {known}")
            }
        })
    }
}

/// Whether a scene text is another at another moment, and the scenes that it names.
pub(super) fn moves(bytes: &[u8]) -> (bool, Vec<String>) {
    let text = String::from_utf8_lossy(bytes);
    let (motion, _) = Motion::find(&text, |_| false);
    let files = match text.contains("File(") {
        true => Index::new(&text)
            .texts()
            .filter(|(of, _)| *of == "path")
            .filter_map(|(_, place)| ron::from_str(&text[place]).ok())
            .collect(),
        false => Vec::new(),
    };
    (motion.depends_on_frame(&(0..text.len())), files)
}

/// Names that mean nothing: of materials and definitions that are not there, and of objects with a slash.
fn names(document: &Document, index: &Index<'_>) -> Vec<Diagnostic> {
    let materials: BTreeSet<&str> = document.materials.keys().map(String::as_str).collect();
    let plans = document.plans.iter();
    let definitions = plans.flat_map(|plan| plan.definitions.keys().map(String::as_str)).collect();
    let fault = |(key, place): (&str, Range<usize>)| {
        let name: String = ron::from_str(&index.text()[place.clone()]).ok()?;
        if let Some(cure) = meant_path(&index.text()[place.clone()]) {
            let fault =
                Diagnostic::error(place, "a backslash of this path stands for a control letter");
            return Some(fault.help(format!("in a path write `/`: {cure}")));
        }
        let (known, what): (&BTreeSet<&str>, _) = match key {
            "material" | "materials" | "table" => (&materials, "material"),
            "Instance" => (&definitions, "definition"),
            "name" if name.contains('/') => {
                let fault = Diagnostic::error(place, format!("the name \"{name}\" has a slash"));
                let help =
                    "a `/` parts the names of a path, such as \"house/roof\": write another mark";
                return Some(fault.help(help));
            }
            _ => return None,
        };
        if known.contains(name.as_str()) {
            return None;
        }
        let fault =
            Diagnostic::error(place, format!("there is no {what} \"{name}\"")).label("unknown");
        Some(match nearest(&name, known.iter().copied()) {
            Some(near) => fault.help(format!("did you mean \"{near}\"?")),
            None => fault.help(format!("the scene has {}", list(known.iter().copied()))),
        })
    };
    index.texts().filter_map(fault).collect()
}

/// Writes a document as text that [`parse()`] reads back to an equal document.
///
/// # Errors
/// If a number is not finite, or a name means two things.
pub fn write(document: &Document) -> Result<String> {
    document.check_names()?;
    let pretty = ron::ser::PrettyConfig::new().struct_names(false).depth_limit(12).indentor("  ");
    let mut text = options()
        .to_string_pretty(document, pretty)
        .map_err(|e| Error::invalid(format!("this scene cannot be written: {e}")))?;
    text.insert_str(0, "Scene");
    text.push('\n');
    Ok(text)
}
