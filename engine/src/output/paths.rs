//! Paths of files that are written: what they mean, where they lead, and whether they can be meant.

use std::path::{Path, PathBuf};

/// A path without the detours through `.` and `..` that can be left out unseen.
pub fn tidy(path: &Path) -> PathBuf {
    use std::path::Component;
    let mut tidy = PathBuf::new();
    for part in path.components() {
        let into = matches!(tidy.components().next_back(), Some(Component::Normal(_)));
        match part {
            Component::CurDir => {}
            // `..` after `..` cannot be left out.
            Component::ParentDir if into => {
                tidy.pop();
            }
            other => tidy.push(other),
        }
    }
    tidy
}

/// Whether a path stands for the standard output: its name is `-`, which may have an ending that says the
/// format, as in `-.png`.
pub fn is_standard(path: &Path) -> bool {
    path.file_stem().is_some_and(|stem| stem == "-")
}

/// Where a path leads: through links as far as there are files, the rest without detours. Paths of one file are
/// equal.
pub fn real(path: &Path) -> PathBuf {
    let path = followed(path).unwrap_or_else(|_| path.to_owned());
    let whole = std::path::absolute(&path).map_or(path, |whole| tidy(&whole));
    let mut missing = Vec::new();
    // The longest part that is there is resolved, and what is missing added again.
    for known in whole.ancestors() {
        if let Ok(known) = std::fs::canonicalize(known) {
            return known.join(missing.iter().rev().collect::<PathBuf>());
        }
        missing.extend(known.file_name());
    }
    whole
}

/// A path as seen from a folder, if one leads to the other. It leads through links as far as there are files, so that
/// `..` in it means what it says.
pub fn relative(path: &Path, folder: &Path) -> PathBuf {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let (path, folder) = (real(path), real(folder));
    let names = |path: &Path| -> Vec<PathBuf> {
        path.components().map(|part| PathBuf::from(part.as_os_str())).collect()
    };
    let (to, from) = (names(&path), names(&folder));
    let shared = to.iter().zip(&from).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return path;
    }
    let up = std::iter::repeat_n(PathBuf::from(".."), from.len() - shared);
    up.chain(to[shared..].iter().cloned()).collect()
}

/// What a path's links lead to at last, there or not.
pub(super) fn followed(path: &Path) -> std::io::Result<PathBuf> {
    let mut path = path.to_owned();
    // As many as Linux follows.
    for _ in 0..40 {
        match std::fs::read_link(&path) {
            Ok(target) => path = path.parent().unwrap_or(Path::new("")).join(target),
            Err(_) => return Ok(path),
        }
    }
    Err(std::io::Error::other("its links lead in a circle"))
}

/// Whether a name can be one of a file that is written: it is no folder, and it has nothing in it that another
/// program would have replaced, `~` or the number of a frame. A part of the path that is there is as it should be.
///
/// # Errors
/// What is wrong with it, and the cure.
pub fn check_name(path: &Path) -> Result<(), String> {
    if is_standard(path) {
        return Ok(());
    }
    if path.is_dir() {
        return Err("it is a folder: name a file in it".to_owned());
    }
    let mut at = PathBuf::new();
    for part in path.components() {
        at.push(part);
        let name = part.as_os_str().to_string_lossy();
        let is_there = std::fs::symlink_metadata(&at).is_ok();
        if is_there || !matches!(part, std::path::Component::Normal(_)) {
            continue;
        }
        if name.starts_with('~') && at != path {
            return Err(format!(
                "there is no folder `{name}`, which a shell replaces only where a word begins with it: write the \
                 whole path, or $HOME"
            ));
        }
        if let Some(place) = placeholder(&name) {
            let cure = match place.starts_with(['#', '%']) && place.len() > 1 {
                true => {
                    "only renders of a graph have frames, whose number it would be: write the name itself"
                }
                false => {
                    "in a graph, and behind `render -o`, write #### for the number of the frame"
                }
            };
            return Err(format!("nothing is put in place of `{place}`: {cure}"));
        }
    }
    Ok(())
}

/// The first part of a name that other programs replace: `####`, `@@@@`, `%04d`, `{size}`, `<frame>`, `$F4`.
fn placeholder(name: &str) -> Option<&str> {
    let length = |c: char, rest: &str| -> Option<usize> {
        match c {
            '#' | '@' => Some(rest.find(|other| other != c).unwrap_or(rest.len())),
            '%' => {
                let digits = rest[1..].find(|c: char| !c.is_ascii_digit())?;
                let after = rest[1 + digits..].strip_prefix('d')?;
                (!after.starts_with(char::is_alphabetic)).then_some(digits + 2)
            }
            '$' => {
                let word = rest[1..].find(|c: char| !c.is_alphanumeric()).unwrap_or(rest.len() - 1);
                rest[1..].starts_with(char::is_alphabetic).then_some(1 + word)
            }
            '{' => rest.find('}').map(|end| end + 1),
            '<' => rest.find('>').map(|end| end + 1),
            _ => None,
        }
    };
    name.char_indices().find_map(|(at, c)| {
        let rest = &name[at..];
        length(c, rest).filter(|length| *length > 1).map(|length| &rest[..length])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_seen_from_the_files_folder() {
        let seen = |path: &str, folder: &str| relative(Path::new(path), Path::new(folder));
        assert_eq!(seen("/a/b/c.ron", "/a/b"), Path::new("c.ron"));
        assert_eq!(seen("/a/b/c.ron", "/a/x/y"), Path::new("../../b/c.ron"));
        assert_eq!(seen("a/../c.ron", ""), Path::new("c.ron"));
    }

    #[test]
    fn names_have_nothing_that_would_be_replaced() {
        let folder = std::env::temp_dir().join(format!("spandrel-names-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("{here}")).unwrap();
        for (name, word) in [
            ("a.####.png", "`####`"),
            ("a.%04d.png", "`%04d`"),
            ("a.%d.png", "`%d`"),
            ("{size}/a.png", "`{size}`"),
            ("é{frame:04}.png", "`{frame:04}`"),
            ("a.<UDIM>.exr", "`<UDIM>`"),
            ("a.$F4.exr", "`$F4`"),
            ("~/a.png", "no folder `~`"),
            ("~me/a.png", "no folder `~me`"),
            ("{here}", "a folder"),
        ] {
            let said = check_name(&folder.join(name)).unwrap_err();
            assert!(said.contains(word), "{name}: {said}");
        }
        for name in [
            "a.png",
            "no.#1.png",
            "100%done.png",
            "é%.png",
            "{here}/a.png",
            "~.png",
            "$.png",
            "-.png",
        ] {
            assert_eq!(check_name(&folder.join(name)), Ok(()), "{name}");
        }
        std::fs::remove_dir_all(folder).unwrap();
    }
}
