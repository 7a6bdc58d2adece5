//! The words, texts and marks of RON.

/// A word, a text or a mark.
pub(crate) enum Token {
    Text,
    Word,
    Mark(u8),
}

pub(crate) fn is_number(word: &str) -> bool {
    let digits = word.trim_start_matches(['-', '+', '.']);
    digits.starts_with(|c: char| c.is_ascii_digit()) || matches!(digits, "inf" | "NaN")
}

/// Whether a field can hold a number, however small its type.
pub(super) fn can_be_held(word: &str) -> bool {
    let bare = word.replace('_', "");
    bare.parse::<f64>().map_or(true, |value| value.abs() <= f64::from(f32::MAX))
}

/// What begins at a place that is not blank, and where it ends.
pub(crate) fn token(text: &str, at: usize) -> (Token, usize) {
    if let Some(end) = text_end(text, at) {
        return (Token::Text, end);
    }
    let rest = &text[at..];
    // A letter in quotes.
    if let Some(letter) = rest.strip_prefix('\'') {
        let mut chars = letter.char_indices();
        let is_escape = chars.next().is_some_and(|(_, c)| c == '\\');
        let close = if is_escape { chars.find(|(_, c)| *c == '\'') } else { chars.next() };
        if let Some((close, '\'')) = close {
            return (Token::Text, at + 1 + close + 1);
        }
    }
    let is_of_word = |c: char| c.is_alphanumeric() || "_.+-#%".contains(c);
    let end = rest.find(|c: char| !is_of_word(c)).unwrap_or(rest.len());
    match rest.bytes().next() {
        _ if end > 0 => (Token::Word, at + end),
        Some(mark) if mark.is_ascii() => (Token::Mark(mark), at + 1),
        _ => (Token::Mark(b'?'), at + rest.chars().next().map_or(1, char::len_utf8)),
    }
}

/// Passes blanks and comments.
pub(crate) fn skip_blank(text: &str, mut i: usize) -> usize {
    loop {
        let rest = &text[i..];
        i += rest.len() - rest.trim_start().len();
        let rest = &text[i..];
        if rest.starts_with("//") {
            i += rest.find('\n').unwrap_or(rest.len());
        } else if rest.starts_with("/*") {
            i += comment_end(rest);
        } else {
            return i;
        }
    }
}

/// Where a comment ends that may have others in it.
fn comment_end(text: &str) -> usize {
    let bytes = text.as_bytes();
    let (mut i, mut depth) = (0, 0);
    while i < bytes.len() {
        match &bytes[i..(i + 2).min(bytes.len())] {
            b"/*" => (i, depth) = (i + 2, depth + 1),
            b"*/" => (i, depth) = (i + 2, depth - 1),
            _ => i += 1,
        }
        if depth == 0 {
            return i;
        }
    }
    bytes.len()
}

/// Where a text in quotes ends that begins at a place, plain or raw (`r#".."#`).
fn text_end(text: &str, start: usize) -> Option<usize> {
    let rest = &text[start..];
    if let Some(body) = rest.strip_prefix('"') {
        let bytes = body.as_bytes();
        let mut i = 0;
        while i < bytes.len() && bytes[i] != b'"' {
            i += 1 + usize::from(bytes[i] == b'\\');
        }
        let end = (start + i + 2).min(text.len());
        return Some((end..=text.len()).find(|at| text.is_char_boundary(*at)).unwrap_or(end));
    }
    let marks = rest.strip_prefix('r')?;
    let body = marks.trim_start_matches('#');
    let count = marks.len() - body.len();
    let closing = format!("\"{}", "#".repeat(count));
    let body = body.strip_prefix('"')?;
    let first = start + 2 + count;
    Some(body.find(&closing).map_or(text.len(), |end| first + end + closing.len()))
}

/// Where a byte of a text stands in what the document says for it, quotes and escapes included.
pub(crate) fn offset_in_text(written: &str, byte: usize) -> Option<usize> {
    if written.starts_with('r') {
        let open = written.find('"')? + 1;
        return (open + byte < written.len()).then_some(open + byte);
    }
    let body = written.strip_prefix('"')?;
    let (mut i, mut meant) = (0, 0);
    while meant < byte {
        let first = body.get(i..)?.chars().next()?;
        if first != '\\' {
            (i, meant) = (i + first.len_utf8(), meant + first.len_utf8());
            continue;
        }
        let escape = body.get(i + 1..)?;
        let (written, value) = match escape.chars().next()? {
            'x' => (3, u32::from_str_radix(escape.get(1..3)?, 16).ok()?),
            'u' => {
                let end = escape.find('}')?;
                (end + 1, u32::from_str_radix(escape.get(2..end)?, 16).ok()?)
            }
            other => (other.len_utf8(), 0),
        };
        i += 1 + written;
        meant += char::from_u32(value)?.len_utf8();
    }
    Some(1 + i)
}
