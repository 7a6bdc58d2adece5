//! Names of files with the frame's number in them: `town.####.png`, `town.%04d.png`.

/// A name with a frame's number put in: two or more `#` stand for as many digits at least, and `%04d`, or `%d`, is
/// what programs in C make of it. None if the name has no place for it.
pub fn numbered(name: &str, frame: f64) -> Option<String> {
    let frame = frame.round() as i64;
    let mut made = String::new();
    let mut rest = name;
    let mut is_found = false;
    while let Some(at) = rest.find(['#', '%']) {
        made.push_str(&rest[..at]);
        rest = &rest[at..];
        let marks = rest.len() - rest.trim_start_matches('#').len();
        if marks >= 2 {
            let sign = if frame < 0 { "-" } else { "" };
            made.push_str(&format!("{sign}{:0marks$}", frame.unsigned_abs()));
            (rest, is_found) = (&rest[marks..], true);
        } else if let Some((width, length)) = of_c(rest) {
            made.push_str(&format!("{frame:0width$}"));
            (rest, is_found) = (&rest[length..], true);
        } else {
            made.push_str(&rest[..1]);
            rest = &rest[1..];
        }
    }
    made.push_str(rest);
    is_found.then_some(made)
}

/// The digits of a `%04d` or `%d` that a text begins with, and how long it is.
fn of_c(text: &str) -> Option<(usize, usize)> {
    let body = text.strip_prefix('%')?;
    let end = body.find('d')?;
    let width = match &body[..end] {
        "" => 0,
        digits if digits.starts_with('0') && digits.len() <= 3 => digits.parse().ok()?,
        _ => return None,
    };
    Some((width, end + 2))
}

#[cfg(test)]
mod tests {
    use super::numbered;

    #[test]
    fn numbers_are_put_in() {
        let made = |name: &str, frame: f64| numbered(name, frame).unwrap_or_default();
        assert_eq!(made("a/town.####.png", 7.0), "a/town.0007.png");
        assert_eq!(made("town.##.png", 12345.0), "town.12345.png");
        assert_eq!(made("town.####.png", -7.0), "town.-0007.png");
        assert_eq!(made("%04d/town_%d.exr", 7.0), "0007/town_7.exr");
        assert_eq!(made("%04d", -7.0), "-007");
        for name in ["take#1.png", "100%.png", "%d4".trim_end_matches("d4"), "%4x", "é%", "%99999d"]
        {
            assert_eq!(numbered(name, 1.0), None, "{name}");
        }
    }
}
