//! The text of the project's own files, RON; names, and what is said of wrong ones.

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

/// What is wrong with a text, in the words of its users.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wording {
    /// What is wrong.
    pub message: String,
    /// What stands at the blamed place.
    pub label: &'static str,
    /// The cure.
    pub help: Option<String>,
}

/// The words for an error of the RON library; `rest` is the text from the blamed place on.
pub fn wording(error: &ron::Error, rest: &str) -> Wording {
    use ron::Error as E;
    let words = |message: String| Wording { message, label: "", help: None };
    let unknown = |message: String, name: &str, known: &[&'static str]| Wording {
        message,
        label: "unknown",
        help: Some(match nearest(name, known.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("known are {}", list(known.iter().copied())),
        }),
    };
    let helped = |message: &str, help: &str| Wording {
        help: Some(help.to_owned()),
        ..words(message.to_owned())
    };
    match error {
        E::NoSuchStructField { expected, found, outer } => {
            let of = outer.as_deref().unwrap_or("this");
            unknown(format!("{of} has no field `{found}`"), found, expected)
        }
        E::NoSuchEnumVariant { expected, found, .. } => {
            unknown(format!("`{found}` is not one of the choices"), found, expected)
        }
        E::DuplicateStructField { field, .. } => {
            Wording { label: "the second", ..words(format!("the field `{field}` is given twice")) }
        }
        E::MissingStructField { field, .. } => words(format!("the field `{field}` is missing")),
        E::InvalidValueForType { expected, found } => {
            Wording { label: "wrong type", ..words(format!("expected {expected}, found {found}")) }
        }
        E::ExpectedStructLike | E::ExpectedNamedStructLike(_) => {
            words("expected values in parentheses".to_owned())
        }
        E::ExpectedDifferentStructName { expected, found } => Wording {
            help: (found == "Scene")
                .then(|| "a scene is shown by a graph: name it in a Scanline node".to_owned()),
            ..words(format!("expected a `{expected}`, found a `{found}`"))
        },
        E::ExpectedFloat | E::ExpectedInteger => words("expected a number".to_owned()),
        E::ExpectedBoolean => words("expected true or false".to_owned()),
        E::ExpectedString => words("expected a text in quotes, such as \"sun\"".to_owned()),
        E::ExpectedArray => words("expected a list, such as [1, 2]".to_owned()),
        E::ExpectedMap => words("expected a map, such as {\"name\": 1}".to_owned()),
        E::IntegerOutOfBounds => {
            words("this whole number is out of range, or must not be negative".to_owned())
        }
        E::ExpectedIdentifier
            if rest.trim_start().starts_with(['"', '.', '-', '+'])
                || rest.trim_start().starts_with(|c: char| c.is_ascii_digit()) =>
        {
            words("expected one of the choices, by name".to_owned())
        }
        E::ExpectedIdentifier => {
            helped("expected a name here", "perhaps a `)`, `]` or `,` is missing before it")
        }
        E::ExceededRecursionLimit => words("nested too deeply".to_owned()),
        E::Eof => helped("the text ends too soon", "a closing `)`, `]`, `}` or `\"` is missing"),
        other => words(other.to_string()),
    }
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
