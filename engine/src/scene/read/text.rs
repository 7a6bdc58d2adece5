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

use std::path::Path;

use super::super::document::{Document, VERSION};
use crate::error::{Error, Result};
use crate::open;
use crate::text::{options, wording};

/// Parses a scene text.
///
/// # Errors
/// If the bytes are no text, not RON, or not a scene; with line and column.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<Document> {
    let text = &*open::text(path, bytes)?.text;
    let document: Document = options().from_str(text).map_err(|e| {
        let at = e.span.start;
        let line = text.lines().nth(at.line.saturating_sub(1)).unwrap_or("");
        let rest =
            line.char_indices().nth(at.col.saturating_sub(1)).map_or("", |(i, _)| &line[i..]);
        let said = wording(&e.code, rest);
        let message = match said.help {
            Some(help) => format!("{}: {help}", said.message),
            None => said.message,
        };
        Error::at_line(path, at.line, at.col, message)
    })?;
    if document.version != VERSION {
        return Err(Error::in_file(
            path,
            format!("scene version {}: this program reads {VERSION}", document.version),
        ));
    }
    Ok(document)
}

/// Writes a document as text that [`parse`] reads back to an equal document.
///
/// # Errors
/// If a number is not finite.
pub fn write(document: &Document) -> Result<String> {
    let pretty = ron::ser::PrettyConfig::new().struct_names(false).depth_limit(12).indentor("  ");
    let mut text = options()
        .to_string_pretty(document, pretty)
        .map_err(|e| Error::invalid(format!("this scene cannot be written: {e}")))?;
    text.insert_str(0, "Scene");
    text.push('\n');
    Ok(text)
}
