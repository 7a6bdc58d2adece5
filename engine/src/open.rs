//! Opening files that other programs made: their bytes, their text, what they are, and a guard around the
//! libraries that decode them.
//!
//! Every reader of pictures, scenes, lamps and graphs opens its files here, so that an empty file, a byte
//! order mark or a file under a wrong name is the same to all of them.

use std::borrow::Cow;
use std::cell::Cell;
use std::collections::HashMap;
use std::fs::Metadata;
use std::io::ErrorKind;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, Once, OnceLock, PoisonError};
use std::time::SystemTime;

use crate::error::{Error, Result};
use crate::key::Key;
use crate::text::nearest;
use crate::watch::Watch;

/// Reads a file.
///
/// # Errors
/// If it cannot be read, is a folder, or is empty; of one that is not there, with the name beside it that is nearest.
pub fn bytes(path: &Path) -> Result<Vec<u8>> {
    let about = About::of(path);
    if about.is_none() {
        Watch::current().saw(path, None);
    }
    let bytes = std::fs::read(path).map_err(|error| match error.kind() {
        _ if path.is_dir() => Error::in_file(path, "it is a folder, not a file"),
        ErrorKind::NotFound => {
            let cure = match beside(path) {
                Some(near) => format!("did you mean \"{near}\"?"),
                None => "is it in another folder, or named otherwise?".to_owned(),
            };
            let said = format!("No such file or directory: {cure}");
            Error::file(path, std::io::Error::new(ErrorKind::NotFound, said))
        }
        _ => Error::file(path, error),
    })?;
    crate::output::keep(path);
    let contents = remembered(path, about.as_ref()).unwrap_or_else(|| Key::of_bytes(&bytes));
    if let Some(about) = about {
        known().insert(path.to_owned(), (about, contents));
    }
    Watch::current().saw(path, Some(contents));
    if bytes.is_empty() {
        return Err(Error::in_file(path, "the file is empty: was it copied or downloaded whole?"));
    }
    Ok(bytes)
}

/// What a file holds, as a key: that of its bytes, under whatever name. They are read once, until size, time or place
/// of the file change. `None` if it cannot be read.
pub fn contents(path: &Path) -> Option<Key> {
    let about = About::of(path);
    let contents = match (remembered(path, about.as_ref()), about) {
        (Some(contents), _) => Some(contents),
        (None, Some(about)) => {
            let contents = std::fs::File::open(path).ok().and_then(|file| Key::of_file(file).ok());
            if let Some(contents) = contents {
                known().insert(path.to_owned(), (about, contents));
            }
            contents
        }
        (None, None) => None,
    };
    Watch::current().saw(path, contents);
    contents
}

/// What is known of a file that did not change since.
fn remembered(path: &Path, about: Option<&About>) -> Option<Key> {
    known().get(path).filter(|(of, _)| Some(of) == about).map(|(_, contents)| *contents)
}

/// Whether there is a file of this name.
pub fn is_file(path: &Path) -> bool {
    let is_file = path.is_file();
    if !is_file {
        Watch::current().saw(path, None);
    }
    is_file
}

/// What tells that a file is the one that was read, within this process.
#[derive(Clone, Debug, PartialEq, Eq)]
struct About {
    length: u64,
    modified: Option<SystemTime>,
    /// The device and its number there, where the system has such.
    place: [u64; 2],
}

impl About {
    /// Of a file; pipes and devices are not asked.
    fn of(path: &Path) -> Option<About> {
        let about = std::fs::metadata(path).ok().filter(Metadata::is_file)?;
        #[cfg(unix)]
        let place = {
            use std::os::unix::fs::MetadataExt;
            [about.dev(), about.ino()]
        };
        #[cfg(not(unix))]
        let place = [0; 2];
        Some(About { length: about.len(), modified: about.modified().ok(), place })
    }
}

/// What is known of files.
fn known() -> std::sync::MutexGuard<'static, HashMap<PathBuf, (About, Key)>> {
    static KNOWN: OnceLock<Mutex<HashMap<PathBuf, (About, Key)>>> = OnceLock::new();
    KNOWN.get_or_init(Mutex::default).lock().unwrap_or_else(PoisonError::into_inner)
}

/// The name in a file's folder that is nearest to its own, if one is near.
pub fn beside(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_string_lossy().into_owned();
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let entries = std::fs::read_dir(folder.unwrap_or(Path::new("."))).ok()?;
    let names = entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned());
    // A file of another kind is not meant, though it may be called the same.
    let ending = |name: &str| name.rsplit_once('.').map(|(_, ending)| ending.to_owned());
    let is_kin = |other: &String| match (ending(&name), ending(other)) {
        (Some(own), Some(other)) => nearest(&own, [other.as_str()]).is_some(),
        _ => true,
    };
    let names: Vec<String> = names.filter(is_kin).collect();
    nearest(&name, names.iter().map(String::as_str)).map(str::to_owned)
}

/// The text of a file.
#[derive(Clone, Debug)]
pub struct Text<'b> {
    /// The text, its lines ended by `\n`, without a byte order mark.
    pub text: Cow<'b, str>,
    /// What is doubtful in it, for its reader.
    pub note: Option<String>,
}

/// The text that bytes are: UTF-8; UTF-16, by its byte order mark or by its zeros; or else Windows-1252,
/// of which Latin-1 is a part. Lines may end as they do on any system; zeros and the mark of DOS at the end are left
/// out.
///
/// # Errors
/// If they are no text: what they are, or the line and column that show it.
pub fn text<'b>(path: &Path, bytes: &'b [u8]) -> Result<Text<'b>> {
    let (text, note) = match bytes {
        [0xff, 0xfe, 0, 0, ..] | [0, 0, 0xfe, 0xff, ..] => {
            return Err(Error::at_byte(path, 0, "UTF-32 text: save it as UTF-8"));
        }
        [0xff, 0xfe, rest @ ..] => (utf_16(path, rest, u16::from_le_bytes, 2)?, None),
        [0xfe, 0xff, rest @ ..] => (utf_16(path, rest, u16::from_be_bytes, 2)?, None),
        [0xef, 0xbb, 0xbf, rest @ ..] => utf_8(rest),
        // UTF-16 without a mark: every second byte of western letters is 0.
        [first, 0, second, 0, ..] if *first != 0 && *second != 0 => {
            (utf_16(path, bytes, u16::from_le_bytes, 0)?, None)
        }
        [0, first, 0, second, ..] if *first != 0 && *second != 0 => {
            (utf_16(path, bytes, u16::from_be_bytes, 0)?, None)
        }
        _ => utf_8(bytes),
    };
    let text = match text.trim_end_matches(['\0', '\x1a']).len() {
        whole if whole == text.len() => text,
        end => Cow::Owned(text[..end].to_owned()),
    };
    let text = if text.contains('\r') {
        Cow::Owned(text.replace("\r\n", "\n").replace('\r', "\n"))
    } else {
        text
    };
    let is_control = |byte: u8| matches!(byte, 0..=0x08 | 0x0e..=0x1f) && byte != 0x1b;
    if let Some(at) = text.bytes().position(is_control) {
        if let Some(kind) = kind(bytes) {
            return Err(Error::in_file(path, format!("it is {kind}, not text")));
        }
        let before = &text[..at];
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().map_or(0, |rest| rest.chars().count()) + 1;
        let message = format!("not text: it has a character {:#04x}", text.as_bytes()[at]);
        return Err(Error::at_line(path, line, column, message));
    }
    Ok(Text { text, note })
}

/// How text begins, as far as can be told: to know a format by it. Letters that are wrong do not matter.
pub fn head(bytes: &[u8]) -> String {
    let start = &bytes[..bytes.len().min(4096)];
    // An odd end would cut a letter of UTF-16 in two.
    let start = &start[..start.len() & !1];
    match text(Path::new(""), start) {
        Ok(text) => text.text.into_owned(),
        Err(_) => String::from_utf8_lossy(start).into_owned(),
    }
}

fn utf_8(bytes: &[u8]) -> (Cow<'_, str>, Option<String>) {
    match std::str::from_utf8(bytes) {
        Ok(text) => (Cow::Borrowed(text), None),
        Err(error) => {
            let line = bytes[..error.valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1;
            let note = format!(
                "line {line} is not UTF-8: all of it is read as Windows-1252 (Latin-1); if names look \
                 wrong, save it as UTF-8"
            );
            (Cow::Owned(bytes.iter().map(|byte| windows_1252(*byte)).collect()), Some(note))
        }
    }
}

fn utf_16<'b>(
    path: &Path,
    bytes: &[u8],
    unit: impl Fn([u8; 2]) -> u16,
    before: u64,
) -> Result<Cow<'b, str>> {
    let pairs = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    let mut text = String::with_capacity(bytes.len() / 2);
    for (at, c) in char::decode_utf16(pairs).enumerate() {
        text.push(c.map_err(|_| {
            let byte = before + 2 * at as u64;
            Error::at_byte(path, byte, "not sound UTF-16 text: save it as UTF-8")
        })?);
    }
    if !bytes.len().is_multiple_of(2) {
        let byte = before + bytes.len() as u64 - 1;
        return Err(Error::at_byte(path, byte, "UTF-16 text that ends within a letter"));
    }
    Ok(Cow::Owned(text))
}

/// The letter of a byte: as in Latin-1, but for those that Windows puts in place of its control characters.
fn windows_1252(byte: u8) -> char {
    const UPPER: [char; 32] = [
        '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž',
        '\u{8f}', '\u{90}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}',
        'ž', 'Ÿ',
    ];
    match byte {
        0x80..=0x9f => UPPER[usize::from(byte - 0x80)],
        _ => char::from(byte),
    }
}

/// What a file is, by its first bytes, in the words of an error: "a PNG picture"; `None` if they say nothing.
pub fn kind(bytes: &[u8]) -> Option<&'static str> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let starts: [(&[u8], &str); 36] = [
        (b"\x89PNG\r\n\x1a\n", "a PNG picture"),
        (b"\xff\xd8\xff", "a JPEG picture"),
        (b"\x76\x2f\x31\x01", "an OpenEXR picture"),
        (b"#?RADIANCE", "a Radiance picture (.hdr)"),
        (b"#?RGBE", "a Radiance picture (.hdr)"),
        (b"II*\0", "a TIFF picture"),
        (b"MM\0*", "a TIFF picture"),
        (b"II+\0", "a BigTIFF picture"),
        (b"MM\0+", "a BigTIFF picture"),
        (b"GIF8", "a GIF picture"),
        (b"8BPS", "a Photoshop picture (.psd)"),
        (b"DDS ", "a DDS texture"),
        (b"\xabKTX", "a KTX texture"),
        (b"qoif", "a QOI picture"),
        (b"\xff\x0a", "a JPEG XL picture"),
        (b"\0\0\0\x0cJXL ", "a JPEG XL picture"),
        (b"SIMPLE  =", "a FITS picture"),
        (b"SDPX", "a DPX picture"),
        (b"XPDS", "a DPX picture"),
        (b"glTF", "a binary glTF scene (.glb)"),
        (b"ply\n", "a PLY mesh"),
        (b"ply\r", "a PLY mesh"),
        (b"SPANDRELscen", "a binary scene of Spandrel (.scene)"),
        (b"SPANDRELspan", "a file of spans (.span)"),
        (b"NRRD00", "a volume (NRRD)"),
        (b"Kaydara FBX", "an FBX scene"),
        (b"BLENDER", "a Blender file"),
        (b"PXR-USDC", "a USD scene"),
        (b"#usda", "a USD scene"),
        (b"Ogawa", "an Alembic archive"),
        (b"ISO-10303-21", "a STEP or IFC file"),
        (b"PK\x03\x04", "a zip archive"),
        (b"\x1f\x8b", "compressed by gzip"),
        (b"\x28\xb5\x2f\xfd", "compressed by zstd"),
        (b"%PDF", "a PDF document"),
        (b"IESNA", "a lamp's photometry (IES)"),
    ];
    if let Some((_, name)) = starts.iter().find(|(start, _)| bytes.starts_with(start)) {
        return Some(name);
    }
    match bytes {
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some("a WebP picture"),
        [_, _, _, _, b'f', b't', b'y', b'p', b'a', b'v', b'i', b'f' | b's', ..] => {
            Some("an AVIF picture")
        }
        [_, _, _, _, b'f', b't', b'y', b'p', b'h' | b'm', ..] => Some("a HEIF picture"),
        [b'B', b'M', _, _, _, _, 0, 0, 0, 0, ..] => Some("a BMP picture"),
        _ => {
            let start = bytes[..bytes.len().min(14)].to_ascii_lowercase();
            let is_page = start.starts_with(b"<!doctype html") || start.starts_with(b"<html");
            is_page.then_some("a web page")
        }
    }
}

thread_local! {
    static IS_GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Runs a decoder that may break on bytes that nobody tried: a panic becomes an error that says so. Nothing is
/// printed of it.
///
/// # Errors
/// If it panics; the message.
pub fn guarded<T>(run: impl FnOnce() -> T) -> std::result::Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let others = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |about| {
            if !IS_GUARDED.get() {
                others(about);
            }
        }));
    });
    // By thread: panics elsewhere are printed as always.
    let before = IS_GUARDED.replace(true);
    let made = catch_unwind(AssertUnwindSafe(run));
    IS_GUARDED.set(before);
    made.map_err(|panic| {
        let said = panic.downcast_ref::<String>().map(String::as_str);
        let said = said.or_else(|| panic.downcast_ref::<&str>().copied());
        format!("the file is damaged: its decoder broke ({})", said.unwrap_or("without a word"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> std::result::Result<(String, bool), String> {
        let read = text(Path::new("a.txt"), bytes);
        read.map(|t| (t.text.into_owned(), t.note.is_some())).map_err(|e| e.to_string())
    }

    #[test]
    fn text_is_the_same_however_it_was_saved() {
        let text = "Häuser\n€ 5\n";
        let utf_16 =
            |unit: fn(u16) -> [u8; 2]| -> Vec<u8> { text.encode_utf16().flat_map(unit).collect() };
        let mark = |mark: &[u8], rest: &[u8]| [mark, rest].concat();
        for bytes in [
            text.as_bytes().to_vec(),
            mark(b"\xef\xbb\xbf", text.as_bytes()),
            mark(b"\xff\xfe", &utf_16(u16::to_le_bytes)),
            mark(b"\xfe\xff", &utf_16(u16::to_be_bytes)),
            "Häuser\r\n€ 5\r\n".as_bytes().to_vec(),
            "Häuser\r€ 5\r".as_bytes().to_vec(),
        ] {
            assert_eq!(read(&bytes).unwrap(), (text.to_owned(), false), "{bytes:?}");
        }
        assert_eq!(read(b"H\xe4user\n\x80 5\n").unwrap(), (text.to_owned(), true));
        assert_eq!(read(b"ab\r\n\x1a\0\0").unwrap(), ("ab\n".to_owned(), false), "an end of DOS");
        let plain: Vec<u8> = "ply x".encode_utf16().flat_map(u16::to_le_bytes).collect();
        assert_eq!(read(&plain).unwrap(), ("ply x".to_owned(), false), "without a mark");
    }

    #[test]
    fn what_is_no_text_is_told_with_its_byte() {
        assert!(read(b"ab\r\ncd\0def").unwrap_err().starts_with("a.txt:2:3: not text"));
        assert!(read(b"\x89PNG\r\n\x1a\n\0").unwrap_err().contains("it is a PNG picture"));
        assert!(read(b"\xff\xfea\0b").unwrap_err().contains("byte 4"));
        assert!(read(b"\xff\xfe\x00\xd8").unwrap_err().contains("UTF-16"));
        assert!(read(b"\xff\xfe\0\0a\0\0\0").unwrap_err().contains("UTF-32"));
    }

    #[test]
    fn a_decoder_that_breaks_is_an_error() {
        let broken = guarded(|| -> u32 { panic!("index 7") });
        assert!(broken.unwrap_err().contains("index 7"));
        assert_eq!(guarded(|| 5), Ok(5));
    }
}
