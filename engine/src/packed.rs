//! Many colours as text, for values that are saved in JSON.

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use std::io::{Error, ErrorKind, Read, Result, Write};

use crate::color::Color;

/// Red, green and blue of all colours as floats, packed by zlib, as text.
///
/// # Errors
/// If they cannot be packed.
pub(crate) fn pack(colors: &[Color]) -> Result<String> {
    let mut packer = ZlibEncoder::new(Vec::new(), Compression::fast());
    let floats = colors.iter().flat_map(|color| color.to_array());
    let bytes: Vec<u8> = floats.flat_map(f32::to_le_bytes).collect();
    packer.write_all(&bytes)?;
    Ok(BASE64.encode(packer.finish()?))
}

/// So many colours from their text.
///
/// # Errors
/// If it is damaged, or holds fewer or more.
pub(crate) fn unpack(text: &str, count: u64) -> Result<Vec<Color>> {
    let fault = |what: String| Error::new(ErrorKind::InvalidData, what);
    let packed = BASE64.decode(text).map_err(|e| fault(e.to_string()))?;
    let mut bytes = Vec::new();
    let most = count.saturating_mul(12).saturating_add(1);
    ZlibDecoder::new(&packed[..]).take(most).read_to_end(&mut bytes)?;
    if bytes.len() as u64 != count.saturating_mul(12) {
        return Err(fault("a picture does not have the pixels that it says".to_owned()));
    }
    let float = |bytes: &[u8]| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let color = |bytes: &[u8]| Color::new(float(bytes), float(&bytes[4..]), float(&bytes[8..]));
    Ok(bytes.chunks_exact(12).map(color).collect())
}
