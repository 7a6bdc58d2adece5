//! Buffers, read when something needs them.

use ::gltf::json::Root;
use base64::Engine as _;
use std::path::Path;
use std::sync::Arc;

use super::super::reader::Reader;
use super::extensions;
use super::parse::File;
use crate::error::{Error, Result};

/// How many times over the data of a file may be used: a few bytes must not become gigabytes.
const MOST_USES: u64 = 64;
/// Values that any file may have, whatever its size.
const FREE: u64 = 1 << 20;

/// The buffers of a file.
pub(super) struct Buffers {
    data: Vec<Option<Arc<Vec<u8>>>>,
    blob: Option<Vec<u8>>,
    /// How many values may still be made of the file's data.
    left: u64,
}

impl Buffers {
    pub(super) fn new(root: &Root, blob: Option<Vec<u8>>) -> Buffers {
        Buffers { data: vec![None; root.buffers.len()], blob, left: FREE }
    }

    /// Counts values that are made of the file's data.
    ///
    /// # Errors
    /// If they are too many for a file of its size.
    pub(super) fn take(&mut self, count: u64) -> Result<()> {
        self.left = self.left.checked_sub(count).ok_or_else(|| {
            Error::invalid(format!(
                "the file's data is used more than {MOST_USES} times over: as damaged files do, or such as are \
                 made to fill the memory"
            ))
        })?;
        Ok(())
    }

    /// The bytes of a buffer: of the file's own chunk, a data URI, or another file.
    fn buffer(&mut self, reader: &mut Reader, file: &File, index: usize) -> Result<Arc<Vec<u8>>> {
        if let Some(Some(data)) = self.data.get(index) {
            return Ok(data.clone());
        }
        let buffer = file.root.buffers.get(index);
        let buffer = buffer.ok_or_else(|| Error::invalid(format!("there is no buffer {index}")))?;
        let data = match &buffer.uri {
            // Only the first may be the file's own.
            None => (index == 0).then(|| self.blob.take()).flatten().ok_or_else(|| {
                Error::invalid(format!("buffer {index} has no data: the file has no chunk for it"))
            })?,
            Some(uri) => match uri.strip_prefix("data:") {
                Some(data) => base64(data)
                    .map_err(|e| Error::invalid(format!("buffer {index} is not base64: {e}")))?,
                None => sibling(reader, uri)?,
            },
        };
        let announced = buffer.byte_length.0;
        // More is allowed: the chunk of a GLB is filled up to four bytes.
        if (data.len() as u64) < announced {
            let message =
                format!("buffer {index} has {} bytes, {announced} are announced", data.len());
            return Err(Error::invalid(message));
        }
        // What a file may use grows with what it holds.
        self.left = self.left.saturating_add((data.len() as u64).saturating_mul(MOST_USES));
        let data = Arc::new(data);
        self.data[index] = Some(data.clone());
        Ok(data)
    }

    /// A buffer view: the buffer, and where in it the view lies.
    pub(super) fn view(
        &mut self,
        reader: &mut Reader,
        file: &File,
        index: usize,
    ) -> Result<(Arc<Vec<u8>>, std::ops::Range<usize>)> {
        // Such views may have a plain buffer as a fallback, which is read.
        for compression in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
            let buffer = file.root.buffer_views.get(index).map(|view| view.buffer.value());
            let has_data = buffer.is_some_and(|buffer| {
                let is_read = self.data.get(buffer).is_some_and(Option::is_some);
                let is_own = buffer == 0 && self.blob.is_some();
                is_read || is_own || file.root.buffers.get(buffer).is_some_and(|b| b.uri.is_some())
            });
            if file.extension("bufferViews", index, compression).is_some() && !has_data {
                let cure = extensions::cure(compression);
                return Err(Error::invalid(format!(
                    "buffer view {index} is there by {compression} only, which is not read: {cure}"
                )));
            }
        }
        let view = file.root.buffer_views.get(index);
        let view =
            view.ok_or_else(|| Error::invalid(format!("there is no buffer view {index}")))?;
        let number = view.buffer.value();
        let buffer = self.buffer(reader, file, number)?;
        let at = view.byte_offset.map_or(0, |offset| offset.0);
        let length = view.byte_length.0;
        let end = at.checked_add(length).filter(|end| *end <= buffer.len() as u64);
        end.map(|end| (buffer.clone(), at as usize..end as usize)).ok_or_else(|| {
            Error::invalid(format!(
                "buffer view {index}: buffer {number} has {} bytes, not {length} from byte {at} on",
                buffer.len()
            ))
        })
    }
}

/// The bytes of a file that a URI names.
pub(super) fn sibling(reader: &mut Reader, uri: &str) -> Result<Vec<u8>> {
    let name = decoded(uri);
    let path = reader.path.parent().unwrap_or(Path::new("")).join(&name);
    // A device named by a file would be read for ever.
    if std::fs::metadata(&path).is_ok_and(|about| !about.is_file() && !about.is_dir()) {
        return Err(Error::in_file(&path, "it is a device or a pipe, no file"));
    }
    let scene = reader.path.display().to_string();
    let (_, bytes) = reader.sibling(&name).map_err(|error| match error {
        Error::File { path, source } => {
            let what = format!("{source} (\"{scene}\" names it)");
            Error::file(path, std::io::Error::new(source.kind(), what))
        }
        other => other,
    })?;
    Ok(bytes)
}

/// The bytes of a data URI, behind its `data:`.
pub(super) fn base64(data: &str) -> std::result::Result<Vec<u8>, String> {
    let (_, text) = data.split_once(";base64,").ok_or("it has no `;base64,`")?;
    // Some writers leave the end open.
    let engine = base64::engine::GeneralPurpose::new(
        &base64::alphabet::STANDARD,
        base64::engine::GeneralPurposeConfig::new()
            .with_decode_padding_mode(base64::engine::DecodePaddingMode::Indifferent),
    );
    engine.decode(text).map_err(|error| error.to_string())
}

/// A URI with its percent codes resolved.
pub(super) fn decoded(uri: &str) -> String {
    let bytes = uri.as_bytes();
    let mut out = Vec::new();
    let mut i = 0;
    while i < bytes.len() {
        let code = (bytes[i] == b'%').then(|| uri.get(i + 1..i + 3)).flatten();
        match code.and_then(|code| u8::from_str_radix(code, 16).ok()) {
            Some(byte) => {
                out.push(byte);
                i += 3;
            }
            None => {
                out.push(bytes[i]);
                i += 1;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}
