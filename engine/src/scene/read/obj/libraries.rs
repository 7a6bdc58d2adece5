//! The libraries of materials that an OBJ names.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::super::super::absent::WITHOUT_PICTURES;
use super::super::super::material::Material;
use super::super::mtl;
use super::super::reader::Reader;
use crate::error::Result;
use crate::open::{self, Text};

/// Reads the libraries of a statement; those that cannot be read are missing, with what is wrong.
pub(super) fn read(
    reader: &mut Reader,
    names: &str,
    materials: &mut BTreeMap<String, Material>,
    missing: &mut Vec<(PathBuf, String)>,
) -> Result<()> {
    let folder = reader.path.parent().unwrap_or(Path::new("")).to_owned();
    for name in split(names, |name| open::is_file(&folder.join(name))) {
        // A path of another machine: the library usually came along.
        let bare = name.rsplit('/').next().unwrap_or(&name);
        let is_elsewhere = !open::is_file(&folder.join(&name)) && open::is_file(&folder.join(bare));
        let name = if is_elsewhere { bare } else { &name };
        let (path, bytes) = match reader.sibling(name) {
            Ok(library) => library,
            Err(error) => {
                if reader.wants_pictures {
                    reader.note(format!("library of materials: {error}: {WITHOUT_PICTURES}"));
                }
                missing.push((folder.join(name), error.message()));
                continue;
            }
        };
        let Text { text, note } = open::text(&path, &bytes)?;
        if let Some(note) = note {
            reader.note(format!("of {name}, {note}"));
        }
        let within = Path::new(name).parent().unwrap_or(Path::new(""));
        materials.extend(mtl::read(reader, &path, &text, within)?);
    }
    Ok(())
}

/// The names of a statement. Blanks stand between and within names, with `\`, quotes or nothing to tell: a name ends
/// where it has the ending of a library, and all is one name if such a file is there.
fn split(names: &str, is_there: impl Fn(&str) -> bool) -> Vec<String> {
    let plain = |name: &str| name.replace("\\ ", " ").replace('\\', "/").replace('"', "");
    let without_comment = names.split(" #").next().unwrap_or(names).trim();
    let whole = [plain(names), plain(without_comment)];
    if let Some(name) = whole.into_iter().find(|name| is_there(name)) {
        return vec![name];
    }
    let has_ending = |word: &str| word.trim_end_matches('"').to_ascii_lowercase().ends_with(".mtl");
    let words: Vec<&str> = without_comment.split_whitespace().collect();
    if !words.iter().any(|word| has_ending(word)) {
        return words.into_iter().map(plain).collect();
    }
    let parts = words.split_inclusive(|word| has_ending(word));
    parts.map(|part| plain(&part.join(" "))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_libraries_and_blanks_in_names_are_told_apart() {
        let none = |_: &str| false;
        assert_eq!(split("a.mtl b.MTL", none), ["a.mtl", "b.MTL"]);
        assert_eq!(split("my town.mtl other.mtl", none), ["my town.mtl", "other.mtl"]);
        assert_eq!(split("a\\ b.mtl", none), ["a b.mtl"]);
        assert_eq!(split("\"a b.mtl\" c.mtl", none), ["a b.mtl", "c.mtl"]);
        assert_eq!(split("sub\\a.mtl # by hand", none), ["sub/a.mtl"]);
        assert_eq!(split("one two", none), ["one", "two"]);
        assert_eq!(split("one two", |name| name == "one two"), ["one two"]);
        assert_eq!(split("a.mtl b.mtl", |name| name == "a.mtl b.mtl"), ["a.mtl b.mtl"]);
    }
}
