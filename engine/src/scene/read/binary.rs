//! The own scene format as binary, for large scenes: read and written fast (\[D], "System overview").
//!
//! | bytes | contents |
//! |---|---|
//! | 8 | `SPANDREL` |
//! | 4 | `scen` |
//! | 4 | version, little end first |
//! | 8 | length of the body |
//! | 32 | BLAKE3 hash of the body |
//! | ... | body: the document in MessagePack, structures as maps by field name |

use std::path::Path;

use super::super::document::{Document, VERSION};
use crate::error::{Error, Result};

pub(super) const MAGIC: &[u8; 12] = b"SPANDRELscen";
const HEADER: usize = 56;

/// Parses a binary scene.
///
/// # Errors
/// If the file is not a binary scene, of another version, truncated, or damaged, or names in it mean two things.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<Document> {
    let Some((header, body)) = bytes.split_at_checked(HEADER).filter(|(h, _)| h.starts_with(MAGIC))
    else {
        return Err(Error::at_byte(path, 0, "not a binary Spandrel scene"));
    };
    let version = u32::from_le_bytes(header[12..16].try_into().expect("four bytes are four bytes"));
    if version != VERSION {
        return Err(Error::at_byte(
            path,
            12,
            format!("scene version {version}: this program reads {VERSION}"),
        ));
    }
    let length =
        u64::from_le_bytes(header[16..24].try_into().expect("eight bytes are eight bytes"));
    if length != body.len() as u64 {
        return Err(Error::at_byte(
            path,
            16,
            format!(
                "the body is {} bytes long, not {length}: the file is truncated or damaged",
                body.len()
            ),
        ));
    }
    if blake3::hash(body).as_bytes() != &header[24..56] {
        return Err(Error::at_byte(path, 24, "the checksum is wrong: the file is damaged"));
    }
    let document: Document = rmp_serde::from_slice(body)
        .map_err(|e| Error::at_byte(path, HEADER as u64, e.to_string()))?;
    document.check_names().map_err(|e| Error::in_file(path, e.to_string()))?;
    Ok(document)
}

/// A document as a binary scene.
///
/// # Errors
/// If the document cannot be encoded.
pub fn write(document: &Document) -> Result<Vec<u8>> {
    let body = rmp_serde::to_vec_named(document)
        .map_err(|e| Error::invalid(format!("this scene cannot be written: {e}")))?;
    let mut bytes = Vec::with_capacity(HEADER + body.len());
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&VERSION.to_le_bytes());
    bytes.extend_from_slice(&(body.len() as u64).to_le_bytes());
    bytes.extend_from_slice(blake3::hash(&body).as_bytes());
    bytes.extend_from_slice(&body);
    Ok(bytes)
}
