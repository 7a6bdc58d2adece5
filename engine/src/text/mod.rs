//! The text of the project's own files, RON: where everything stands in it ([`index`]), reading it with all faults at
//! once ([`parse`]), what is said of them, and how they are shown ([`Diagnostic`]); names, and what is said of wrong
//! ones.

mod any_value;
pub mod diagnostic;
pub mod index;
pub mod parse;
pub(crate) mod token;
mod wording;
pub mod woven;

pub use any_value::AnyValue;
pub use diagnostic::{Diagnostic, Faults, Severity};
pub use index::Index;
pub(crate) use token::offset_in_text;
use wording::Wording;
pub use woven::{Patch, Woven};

/// The extensions of RON that all of them may use: `Some(x)` may be written `x`, and what wraps one
/// value is left out.
pub fn options() -> ron::Options {
    use ron::extensions::Extensions;
    ron::Options::default().with_default_extension(
        Extensions::IMPLICIT_SOME
            | Extensions::UNWRAP_NEWTYPES
            | Extensions::UNWRAP_VARIANT_NEWTYPES,
    )
}

/// A value as texts have it.
pub fn written<T: serde::Serialize>(value: &T) -> String {
    options().to_string(value).unwrap_or_default()
}

/// The name that was probably meant: the nearest by edits, if it is near.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = name.to_lowercase();
    let distance = |known: &str| strsim::damerau_levenshtein(&lower, &known.to_lowercase());
    let near = known.into_iter().map(|known| (distance(known), known));
    let (edits, best) = near.min_by_key(|(edits, known)| (*edits, *known))?;
    (edits <= 1 + name.chars().count() / 3).then_some(best)
}

/// A list of names for a message, shortened.
pub fn list<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.into_iter().collect();
    match names.len() {
        0 => "none".to_owned(),
        1..=12 => names.join(", "),
        n => format!("{}, and {} more", names[..12].join(", "), n - 12),
    }
}

/// Whether a pattern, in which `*` stands for anything, names an object: whole parts of its path, as `truck`,
/// `wheel` and `truck/wheel` name `cars.glb/truck/wheel`. The name of a group names all that is in it.
pub fn names_object(pattern: &str, object: &str) -> bool {
    let ends = || object.match_indices('/').map(|(at, _)| at);
    let starts = std::iter::once(0).chain(ends().map(|at| at + 1));
    starts.into_iter().any(|from| {
        let mut till = ends().filter(|at| *at >= from).chain([object.len()]);
        till.any(|till| fits(pattern, &object[from..till]))
    })
}

/// Whether a name fits a pattern in which `*` stands for anything.
fn fits(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let Some(mut rest) = parts.next().and_then(|first| name.strip_prefix(first)) else {
        return false;
    };
    let Some(last) = parts.next_back() else { return rest.is_empty() };
    for part in parts {
        let Some(at) = rest.find(part) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.len() >= last.len() && rest.ends_with(last)
}

/// What was meant by a text of a document, quotes included, that looks like a path with backslashes, of which some
/// became control letters: `"maps\\new.png"` has a line end in it.
pub fn meant_path(written: &str) -> Option<String> {
    let meant: String = ron::from_str(written).ok()?;
    let (_, ending) = meant.rsplit_once('.')?;
    let is_ending =
        (1..=5).contains(&ending.len()) && ending.bytes().all(|b| b.is_ascii_alphanumeric());
    let is_path =
        is_ending && meant.contains(['\n', '\t', '\r', '\0']) && !meant.contains([' ', ';', '=']);
    let is_one_line = written.starts_with('"') && !written.contains('\n');
    (is_path && is_one_line).then(|| written.replace("\\\\", "/").replace('\\', "/"))
}

/// A number of bytes in a unit that suits it.
pub fn bytes(count: u64) -> String {
    let count = count as f64;
    match count {
        c if c < 1e3 => format!("{c} B"),
        c if c < 1e6 => format!("{:.1} kB", c / 1e3),
        c if c < 1e9 => format!("{:.1} MB", c / 1e6),
        c => format!("{:.2} GB", c / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_a_path_name_an_object_and_what_is_in_it() {
        let object = "cars.glb/truck/wheel 2";
        for name in
            ["wheel 2", "truck", "cars.glb", "truck/wheel 2", "cars.glb/truck", "wheel*", "*"]
        {
            assert!(names_object(name, object), "{name}");
        }
        for name in ["wheel", "ruck", "cars", "truck/wheel", "cars.glb/wheel 2", ""] {
            assert!(!names_object(name, object), "{name}");
        }
    }

    #[test]
    fn names_are_guessed_only_if_they_are_near() {
        assert_eq!(nearest("Fgo", ["Fog", "Write"]), Some("Fog"));
        assert_eq!(nearest("scanline", ["Scanline"]), Some("Scanline"));
        assert_eq!(nearest("x", ["Illuminate"]), None);
        assert_eq!(nearest("a", []), None);
    }

    #[test]
    fn stars_stand_for_anything() {
        let yes = [
            ("a/b", "a/b"),
            ("*", ""),
            ("*", "x"),
            ("a*", "a/b/c"),
            ("*b*", "abc"),
            ("a*b*c", "a1b2c"),
        ];
        yes.iter().for_each(|(pattern, name)| assert!(fits(pattern, name), "{pattern} {name}"));
        let no = [("a", "ab"), ("", "a"), ("a*a", "a"), ("a*b", "abc"), ("*bb*b", "abb")];
        no.iter().for_each(|(pattern, name)| assert!(!fits(pattern, name), "{pattern} {name}"));
    }
}
