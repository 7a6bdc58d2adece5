//! Blocks: what a span file consists of.

use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;

use crate::error::{Error, Result};

pub(super) const MAGIC: &[u8; 12] = b"SPANDRELspan";
pub(super) const VERSION: u32 = 1;
/// Bytes before the first block.
const PREFACE: u64 = 16;
/// Bytes of a block's head.
const HEAD: usize = 36;
/// What a block may hold.
const MAX_RAW: u64 = 1 << 30;
/// A block above this length is not packed more densely than [`MAX_DENSITY`] to one: what a reader must
/// hold stays in proportion to the file.
const ALWAYS: u64 = 1 << 16;
const MAX_DENSITY: u64 = 32;
/// Lines in a block, at most: what a reader must unpack for one of them.
pub(super) const MAX_LINES: u32 = 4096;
const COMPRESSION: u32 = 5;

/// What a block holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BlockKind {
    /// What the file is of, as JSON.
    Head,
    /// A scene: `a` is its place in the head's list.
    Scene,
    /// The lines from `a` on, `b` of them.
    Lines,
    /// `b` faces of the source `a`.
    Faces,
    /// Nothing: the file is whole. `a` is the number of blocks before.
    End,
    /// What this program does not know.
    Unknown([u8; 4]),
}

impl BlockKind {
    fn name(self) -> [u8; 4] {
        match self {
            BlockKind::Head => *b"head",
            BlockKind::Scene => *b"scen",
            BlockKind::Lines => *b"line",
            BlockKind::Faces => *b"face",
            BlockKind::End => *b"end ",
            BlockKind::Unknown(name) => name,
        }
    }

    fn of(name: [u8; 4]) -> BlockKind {
        let known =
            [BlockKind::Head, BlockKind::Scene, BlockKind::Lines, BlockKind::Faces, BlockKind::End];
        known.into_iter().find(|kind| kind.name() == name).unwrap_or(BlockKind::Unknown(name))
    }
}

/// A block ready to be written.
#[derive(Debug)]
pub(super) struct Packed {
    head: [u8; HEAD],
    body: Vec<u8>,
}

impl Packed {
    /// Packs a block's contents.
    ///
    /// # Errors
    /// If they are more than a block holds.
    pub(super) fn new(kind: BlockKind, a: u32, b: u32, raw: Vec<u8>) -> Result<Packed> {
        if raw.len() as u64 > MAX_RAW {
            let what = String::from_utf8_lossy(&kind.name()).into_owned();
            return Err(Error::invalid(format!(
                "a block \"{what}\" of more than {MAX_RAW} bytes: divide the scene"
            )));
        }
        let mut packer = ZlibEncoder::new(Vec::new(), Compression::new(COMPRESSION));
        let packed = packer.write_all(&raw).and_then(|()| packer.finish());
        let packed =
            packed.map_err(|e| Error::invalid(format!("a block cannot be packed: {e}")))?;
        let length = raw.len() as u64;
        // Stored as it is where packing gains nothing, or where readers would refuse it as too
        // dense.
        let is_dense = length > ALWAYS && length > packed.len() as u64 * MAX_DENSITY;
        let body = if packed.len() >= raw.len() || is_dense { raw } else { packed };
        let mut head = [0; HEAD];
        head[0..4].copy_from_slice(&kind.name());
        head[4..8].copy_from_slice(&a.to_le_bytes());
        head[8..12].copy_from_slice(&b.to_le_bytes());
        head[12..20].copy_from_slice(&(body.len() as u64).to_le_bytes());
        head[20..28].copy_from_slice(&length.to_le_bytes());
        head[28..32].copy_from_slice(&crc32fast::hash(&body).to_le_bytes());
        let checksum = crc32fast::hash(&head[..32]);
        head[32..36].copy_from_slice(&checksum.to_le_bytes());
        Ok(Packed { head, body })
    }

    pub(super) fn write(&self, out: &mut impl Write) -> std::io::Result<()> {
        out.write_all(&self.head)?;
        out.write_all(&self.body)
    }
}

/// Writes what stands before the first block.
pub(super) fn write_preface(out: &mut impl Write) -> std::io::Result<()> {
    out.write_all(MAGIC)?;
    out.write_all(&VERSION.to_le_bytes())
}

/// A block in a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub(super) kind: BlockKind,
    pub(super) a: u32,
    pub(super) b: u32,
    /// Where its head begins.
    pub(super) offset: u64,
    /// Bytes in the file, without the head.
    pub(super) stored: u64,
    /// Bytes of its contents.
    pub(super) raw: u64,
    checksum: u32,
}

impl Block {
    /// An error about this block.
    pub(super) fn fault(&self, path: &Path, message: impl std::fmt::Display) -> Error {
        Error::at_byte(path, self.offset, format!("the {self}: {message}"))
    }

    fn at(path: &Path, offset: u64, head: &[u8; HEAD]) -> Result<Block> {
        let four = |at: usize| [head[at], head[at + 1], head[at + 2], head[at + 3]];
        let u32_at = |at: usize| u32::from_le_bytes(four(at));
        let u64_at = |at: usize| u64::from(u32_at(at)) | u64::from(u32_at(at + 4)) << 32;
        // No number of a head is believed before its checksum is right.
        if u32_at(32) != crc32fast::hash(&head[..32]) {
            return Err(Error::at_byte(
                path,
                offset,
                "the head of a block is damaged: its checksum is wrong",
            ));
        }
        let block = Block {
            kind: BlockKind::of(four(0)),
            a: u32_at(4),
            b: u32_at(8),
            offset,
            stored: u64_at(12),
            raw: u64_at(20),
            checksum: u32_at(28),
        };
        let is_dense = block.raw > ALWAYS && block.raw > block.stored.saturating_mul(MAX_DENSITY);
        if block.raw > MAX_RAW || is_dense || block.raw < block.stored {
            let (raw, stored) = (block.raw, block.stored);
            let message = format!("{raw} bytes packed into {stored} are not possible");
            return Err(block.fault(path, message));
        }
        Ok(block)
    }

    /// Reads the block as it is stored.
    pub(super) fn read(&self, path: &Path, file: &mut File) -> Result<Vec<u8>> {
        let mut body = vec![0; self.stored as usize];
        file.seek(SeekFrom::Start(self.offset + HEAD as u64))
            .and_then(|_| file.read_exact(&mut body))
            .map_err(|e| Error::file(path, e))?;
        Ok(body)
    }

    /// The contents of what was read.
    pub(super) fn unpack(&self, path: &Path, body: Vec<u8>) -> Result<Vec<u8>> {
        if crc32fast::hash(&body) != self.checksum {
            return Err(self.fault(path, "it is damaged: its checksum is wrong"));
        }
        if self.raw == self.stored {
            return Ok(body);
        }
        let mut raw = Vec::with_capacity(self.raw as usize);
        // One byte more than was promised shows that there are too many: no more are unpacked.
        let read = ZlibDecoder::new(&body[..]).take(self.raw + 1).read_to_end(&mut raw);
        match read {
            Ok(length) if length as u64 == self.raw => Ok(raw),
            Ok(_) => Err(self.fault(path, format!("it does not hold {} bytes", self.raw))),
            Err(e) => Err(self.fault(path, format!("it cannot be unpacked: {e}"))),
        }
    }
}

impl std::fmt::Display for Block {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (a, b) = (self.a, self.b);
        let name = self.kind.name();
        write!(f, "block \"{}\"", String::from_utf8_lossy(&name).escape_debug())?;
        match self.kind {
            BlockKind::Scene => write!(f, " (scene {a})"),
            BlockKind::Lines => write!(f, " (lines {a} to {})", u64::from(a) + u64::from(b)),
            BlockKind::Faces => write!(f, " ({b} faces of source {a})"),
            BlockKind::Head | BlockKind::End | BlockKind::Unknown(_) => Ok(()),
        }
    }
}

/// The blocks of a file, the last without: it only says that all are there.
pub(super) fn scan(path: &Path, file: &mut File) -> Result<Vec<Block>> {
    let io = |e| Error::file(path, e);
    let length = file.metadata().map_err(io)?.len();
    let mut preface = [0; PREFACE as usize];
    if length >= PREFACE {
        file.seek(SeekFrom::Start(0)).map_err(io)?;
        file.read_exact(&mut preface).map_err(io)?;
    }
    if !preface.starts_with(MAGIC) {
        return Err(Error::at_byte(
            path,
            0,
            "not a span file: it does not begin with SPANDRELspan",
        ));
    }
    let version = u32::from_le_bytes([preface[12], preface[13], preface[14], preface[15]]);
    if version != VERSION {
        let message = format!("span file version {version}: this program reads {VERSION}");
        return Err(Error::at_byte(path, 12, message));
    }
    // From head to head; no contents are read yet.
    let mut blocks: Vec<Block> = Vec::new();
    let mut offset = PREFACE;
    loop {
        let truncated = |last: Option<&Block>| {
            let after = last.map_or("its first block".to_owned(), |block| format!("the {block}"));
            Error::at_byte(
                path,
                length,
                format!("the file is truncated after {after}: write it again"),
            )
        };
        let body = offset.saturating_add(HEAD as u64);
        if body > length {
            return Err(truncated(blocks.last()));
        }
        let mut head = [0; HEAD];
        file.seek(SeekFrom::Start(offset)).map_err(io)?;
        file.read_exact(&mut head).map_err(io)?;
        let block = Block::at(path, offset, &head)?;
        let end = body.saturating_add(block.stored);
        if end > length {
            return Err(block.fault(
                path,
                format!("the file is truncated in it, at byte {length}: write it again"),
            ));
        }
        if block.kind == BlockKind::End {
            if block.a as usize != blocks.len() {
                let message = format!("{} blocks stand before it, not {}", blocks.len(), block.a);
                return Err(block.fault(path, message));
            }
            if end != length {
                return Err(Error::at_byte(path, end, "bytes follow the end of the span file"));
            }
            return Ok(blocks);
        }
        blocks.push(block);
        offset = end;
    }
}
