//! PNG files chunk by chunk, for those that no encoder would write.

use std::io::Write;

/// What every PNG begins with.
pub const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// The file of some chunks, each a name and its data, with their lengths and checksums.
pub fn file<'a>(chunks: impl IntoIterator<Item = (&'a [u8], &'a [u8])>) -> Vec<u8> {
    let mut out = SIGNATURE.to_vec();
    for (name, data) in chunks {
        out.extend((data.len() as u32).to_be_bytes());
        let start = out.len();
        out.extend(name);
        out.extend(data);
        let checksum = crc32fast::hash(&out[start..]);
        out.extend(checksum.to_be_bytes());
    }
    out
}

/// Rows as `IDAT` holds them.
pub fn packed(rows: &[u8]) -> Vec<u8> {
    let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    packer.write_all(rows).and_then(|()| packer.finish()).unwrap_or_default()
}
