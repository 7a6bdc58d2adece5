//! Buffers, read when something needs them, and the checks that make accessors safe to read.

use ::gltf::accessor::{DataType, Dimensions};
use base64::Engine as _;

use super::super::Reader;
use crate::error::{Error, Result};

/// Where a buffer's bytes are.
enum Place {
    /// In the file's own chunk.
    Chunk,
    /// Behind a URI.
    Uri(String),
}

/// The buffers of a file.
pub(super) struct Buffers {
    places: Vec<(Place, usize)>,
    data: Vec<Option<Vec<u8>>>,
    blob: Option<Vec<u8>>,
}

impl Buffers {
    pub(super) fn new(file: &::gltf::Document, blob: Option<Vec<u8>>) -> Buffers {
        let place = |buffer: ::gltf::Buffer<'_>| {
            let place = match buffer.source() {
                ::gltf::buffer::Source::Bin => Place::Chunk,
                ::gltf::buffer::Source::Uri(uri) => Place::Uri(uri.to_owned()),
            };
            (place, buffer.length())
        };
        let places: Vec<_> = file.buffers().map(place).collect();
        let data = places.iter().map(|_| None).collect();
        Buffers { places, data, blob }
    }

    /// The bytes of a buffer that was loaded.
    pub(super) fn get(&self, index: usize) -> Option<&[u8]> {
        self.data.get(index)?.as_deref()
    }

    /// Reads a buffer: of the file's own chunk, a data URI, or another file.
    fn load(&mut self, reader: &mut Reader, index: usize) -> Result<()> {
        let known = self.data.get(index).is_none_or(Option::is_some);
        let Some((place, length)) = self.places.get(index).filter(|_| !known) else {
            return Ok(());
        };
        let data = match place {
            Place::Chunk => self.blob.clone().ok_or_else(|| {
                Error::invalid(format!("buffer {index} has no data: the file has no chunk for it"))
            })?,
            Place::Uri(uri) => match uri.strip_prefix("data:") {
                Some(data) => base64(data)
                    .map_err(|e| Error::invalid(format!("buffer {index} is not base64: {e}")))?,
                None => reader.sibling(&decoded(uri))?.1,
            },
        };
        if data.len() < *length {
            let message =
                format!("buffer {index} has {} bytes, {length} are announced", data.len());
            return Err(Error::invalid(message));
        }
        self.data[index] = Some(data);
        Ok(())
    }

    /// Checks that an accessor is of a known type and that its data lies within its buffer.
    pub(super) fn check(
        &mut self,
        reader: &mut Reader,
        accessor: &::gltf::Accessor<'_>,
        dimensions: &[Dimensions],
        types: &[DataType],
    ) -> Result<()> {
        let index = accessor.index();
        let fault = |what: &str| Error::invalid(format!("accessor {index} {what}"));
        if !dimensions.contains(&accessor.dimensions()) || !types.contains(&accessor.data_type()) {
            let (dimensions, kind) = (accessor.dimensions(), accessor.data_type());
            return Err(fault(&format!(
                "is {dimensions:?} of {kind:?}, which does not fit its use"
            )));
        }
        let count = accessor.count();
        let size = accessor.size();
        if count == 0 {
            return Err(fault("is empty"));
        }
        if let Some(view) = accessor.view() {
            self.load(reader, view.buffer().index())?;
            self.check_view(&view, accessor.offset(), count, size).map_err(|e| fault(&e))?;
        }
        match accessor.sparse() {
            None => Ok(()),
            Some(sparse) => {
                // Without a view the rest is zeros, which cost a file nothing.
                if sparse.count() == 0 || sparse.count() > count || count > 1 << 26 {
                    return Err(fault("has more sparse values than it has values"));
                }
                let indices = sparse.indices();
                self.load(reader, indices.view().buffer().index())?;
                self.load(reader, sparse.values().view().buffer().index())?;
                let width = indices.index_type().size();
                let view = indices.view();
                self.check_view(&view, indices.offset(), sparse.count(), width)
                    .map_err(|e| fault(&e))?;
                let values = sparse.values();
                self.check_view(&values.view(), values.offset(), sparse.count(), size)
                    .map_err(|e| fault(&e))
            }
        }
    }

    /// The bytes of a view.
    pub(super) fn view(
        &mut self,
        reader: &mut Reader,
        view: &::gltf::buffer::View<'_>,
    ) -> Result<&[u8]> {
        let buffer = view.buffer().index();
        self.load(reader, buffer)?;
        let bytes = self.get(buffer).unwrap_or_default();
        let end = view.offset().checked_add(view.length());
        end.and_then(|end| bytes.get(view.offset()..end)).ok_or_else(|| {
            let (at, length) = (view.offset(), view.length());
            Error::invalid(format!(
                "buffer {buffer} has {} bytes, not {length} from byte {at} on",
                bytes.len()
            ))
        })
    }

    fn check_view(
        &self,
        view: &::gltf::buffer::View<'_>,
        offset: usize,
        count: usize,
        size: usize,
    ) -> Result<(), String> {
        let name = format!("uses buffer view {}", view.index());
        let stride = view.stride().unwrap_or(size);
        if stride < size {
            return Err(format!(
                "{name}, whose stride {stride} is less than the {size} bytes of an element"
            ));
        }
        let end = stride
            .checked_mul(count - 1)
            .and_then(|bytes| bytes.checked_add(size))
            .and_then(|bytes| bytes.checked_add(offset));
        if end.is_none_or(|end| end > view.length()) {
            return Err(format!("{name} of {} bytes, which is too short", view.length()));
        }
        let end = view.offset().checked_add(view.length());
        let buffer =
            self.data.get(view.buffer().index()).and_then(Option::as_ref).map_or(0, Vec::len);
        if end.is_none_or(|end| end > buffer) {
            return Err(format!("{name}, which reaches beyond its buffer of {buffer} bytes"));
        }
        Ok(())
    }
}

/// The bytes of a data URI, behind its `data:`.
pub(super) fn base64(data: &str) -> std::result::Result<Vec<u8>, base64::DecodeError> {
    let text = data.split_once(";base64,").map(|(_, text)| text).unwrap_or("");
    base64::engine::general_purpose::STANDARD.decode(text)
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
