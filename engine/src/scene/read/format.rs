//! What format a scene file has: its first bytes say, and its ending where they do not.

use std::path::Path;

use super::reader::Reader;
use super::{binary, stl};
use crate::error::{Error, Result};
use crate::open;

/// A format that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Gltf,
    Glb,
    Obj,
    Ply,
    Stl,
    CityJson,
    CityGml,
    Text,
    Binary,
}

/// Endings and what they mean.
const ENDINGS: [(&str, Format); 12] = [
    ("gltf", Format::Gltf),
    ("glb", Format::Glb),
    ("obj", Format::Obj),
    ("ply", Format::Ply),
    ("stl", Format::Stl),
    ("json", Format::CityJson),
    ("jsonl", Format::CityJson),
    ("gml", Format::CityGml),
    ("xml", Format::CityGml),
    ("citygml", Format::CityGml),
    ("ron", Format::Text),
    ("scene", Format::Binary),
];

/// First words of OBJ files.
const OBJ: [&str; 15] =
    ["v", "vt", "vn", "vp", "f", "fo", "l", "p", "o", "g", "s", "mg", "mtllib", "usemtl", "cstype"];

impl Format {
    /// The format of a file. A name that says otherwise is noted.
    ///
    /// # Errors
    /// If it is no scene that is known, and what it is.
    pub(super) fn of(reader: &mut Reader, bytes: &[u8]) -> Result<Format> {
        let path = reader.path.clone();
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
        let by_ending = ENDINGS.iter().find(|(known, _)| *known == ending).map(|known| known.1);
        let by_content = Format::by_content(&path, bytes, by_ending)?;
        if let (Some(is), Some(called)) = (by_content, by_ending)
            && is.name() != called.name()
        {
            let (is, called) = (is.name(), called.name());
            reader.note(format!("it is {is}, and named as if it were {called}: read as {is}"));
        }
        let text =
            by_ending.map(|format| if format == Format::Glb { Format::Gltf } else { format });
        by_content.or(text).ok_or_else(|| {
            Error::in_file(
                &path,
                "not a scene format that is known: expected .gltf, .glb, .obj, .ply, .stl, .json \
                 (CityJSON), .gml or .xml (CityGML), .ron or .scene",
            )
        })
    }

    fn by_content(path: &Path, bytes: &[u8], by_ending: Option<Format>) -> Result<Option<Format>> {
        if bytes.starts_with(binary::MAGIC) {
            return Ok(Some(Format::Binary));
        }
        let head = open::head(bytes);
        match open::kind(bytes).or_else(|| open::kind(head.as_bytes())) {
            Some("a binary glTF scene (.glb)") => return Ok(Some(Format::Glb)),
            Some("a PLY mesh") => return Ok(Some(Format::Ply)),
            Some(other) => {
                let cure = match other {
                    "a zip archive" | "compressed by gzip" | "compressed by zstd" => {
                        "unpack it first"
                    }
                    "a web page" => "was it downloaded by a link to a page about it?",
                    other if other.ends_with(".span)") => "read it by `ReadSpans`",
                    other if other.contains("volume") => {
                        "`Isosurface` makes scenes of the surfaces in it"
                    }
                    other if other.contains("picture") || other.contains("photometry") => {
                        "is it the right file?"
                    }
                    _ => "export it as glTF, OBJ or CityJSON",
                };
                return Err(Error::in_file(
                    path,
                    format!("it is {other}, not a scene that is read: {cure}"),
                ));
            }
            None if stl::is_binary(bytes) => return Ok(Some(Format::Stl)),
            None => {}
        }
        let start = head.trim_start();
        let word = start.split_whitespace().next().unwrap_or("").to_ascii_lowercase();
        Ok(match start.chars().next() {
            Some('{') => Some(json(&head, bytes, by_ending)),
            Some('<') => Some(Format::CityGml),
            _ if word == "solid" && !head.contains('\0') => Some(Format::Stl),
            _ if word == "ply" => Some(Format::Ply),
            _ => own(path, start)?.or_else(|| {
                let mut lines = start.lines().map(str::trim);
                let first = lines.find(|line| !line.is_empty() && !line.starts_with('#'))?;
                let word = first.split_whitespace().next()?;
                OBJ.contains(&word).then_some(Format::Obj)
            }),
        })
    }

    /// What people call it.
    fn name(self) -> &'static str {
        match self {
            Format::Gltf | Format::Glb => "glTF",
            Format::Obj => "OBJ",
            Format::Ply => "PLY",
            Format::Stl => "STL",
            Format::CityJson => "CityJSON",
            Format::CityGml => "CityGML",
            Format::Text => "a scene in RON",
            Format::Binary => "a binary scene",
        }
    }
}

/// Which of the formats in JSON: what a file says of itself at its start, then its ending, then what it has anywhere.
fn json(head: &str, bytes: &[u8], by_ending: Option<Format>) -> Format {
    let says = |what: &[u8]| bytes.windows(what.len()).any(|window| window == what);
    match by_ending {
        _ if head.contains("\"CityJSON") => Format::CityJson,
        _ if head.contains("\"asset\"") => Format::Gltf,
        Some(Format::Gltf | Format::Glb) => Format::Gltf,
        Some(Format::CityJson) => Format::CityJson,
        _ if says(b"\"asset\"") && !says(b"\"CityObjects\"") => Format::Gltf,
        _ => Format::CityJson,
    }
}

/// Whether a text is a scene of the own format, behind its comments.
fn own(path: &Path, mut start: &str) -> Result<Option<Format>> {
    loop {
        start = start.trim_start();
        let comment = match start.get(..2) {
            Some("//") => "\n",
            Some("/*") => "*/",
            _ => break,
        };
        let Some((_, after)) = start[2..].split_once(comment) else { return Ok(None) };
        start = after;
    }
    let begins = |with: &str| {
        start.strip_prefix(with).is_some_and(|rest| rest.trim_start().starts_with('('))
    };
    if begins("Graph") {
        let message = "it is a graph, not a scene: `spandrel render` renders it";
        return Err(Error::in_file(path, message));
    }
    if start.starts_with("newmtl") {
        let message = "it is a library of materials (MTL): read the OBJ file that names it";
        return Err(Error::in_file(path, message));
    }
    Ok((begins("Scene") || start.starts_with('(') || start.starts_with("#!["))
        .then_some(Format::Text))
}
