//! The text of the project's own files: RON.

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

/// Whether a pattern, in which `*` stands for anything, names an object: its whole path, or what of it follows
/// any `/`, as `wheel` names `cars.glb/truck/wheel`.
pub fn names_object(pattern: &str, object: &str) -> bool {
    let tails = object.match_indices('/').map(|(at, _)| &object[at + 1..]);
    std::iter::once(object).chain(tails).any(|tail| fits(pattern, tail))
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

#[cfg(test)]
mod tests {
    use super::fits;

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
