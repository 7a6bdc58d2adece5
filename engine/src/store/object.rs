//! An object's file: a header, then blocks that are checked one by one, so that nobody holds more than a block.
//!
//! | byte | bytes | |
//! |---|---|---|
//! | 0 | 8 | `spanstor` |
//! | 8 | 8 | the version, 1 |
//! | 16 | 16 | the key, big end first |
//! | 32 | 8 | the length of the contents |
//! | 40 | 8 | the seconds that they took to make, a 64-bit float |
//! | 48 | 32 | blake3 of the 48 bytes before |
//! | 80 | | the contents in blocks of 262144 bytes, the last with the rest |
//!
//! Every block is followed by 32 bytes: blake3 of the key, the block's number from 0 in 8 bytes, and the block. Numbers
//! have their small end first. The file ends with the last block; an object without contents has none.

use std::fs::{File, Metadata};
use std::io::{BufRead, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::{is_gone, on_disk};
use crate::error::{Error, Result};
use crate::key::Key;

const MAGIC: &[u8; 8] = b"spanstor";
const HEAD: usize = 80;
const BLOCK: usize = 1 << 18;
const SUM: usize = 32;

/// The time within which a use is not noted again.
const TOUCHED: Duration = Duration::from_secs(3600);

/// The size of the file of an object with contents of some length.
pub(super) fn size(length: u64) -> u64 {
    let sums = length.div_ceil(BLOCK as u64).saturating_mul(SUM as u64);
    length.saturating_add(sums).saturating_add(HEAD as u64)
}

/// What stands at the head of an object's file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Header {
    key: [u8; 16],
    length: u64,
    pub(super) seconds: f64,
}

impl Header {
    fn to_bytes(self) -> [u8; HEAD] {
        let mut bytes = [0; HEAD];
        bytes[..8].copy_from_slice(MAGIC);
        bytes[8..16].copy_from_slice(&super::folder::VERSION.to_le_bytes());
        bytes[16..32].copy_from_slice(&self.key);
        bytes[32..40].copy_from_slice(&self.length.to_le_bytes());
        bytes[40..48].copy_from_slice(&self.seconds.to_le_bytes());
        let sum = blake3::hash(&bytes[..48]);
        bytes[48..].copy_from_slice(sum.as_bytes());
        bytes
    }

    /// Of a file of some size; or what is wrong with it.
    fn from_bytes(bytes: &[u8; HEAD], file_size: u64) -> Result<Header, &'static str> {
        let eight = |at: usize| -> [u8; 8] {
            bytes[at..at + 8].try_into().expect("a range of 8 bytes has 8 bytes")
        };
        if blake3::hash(&bytes[..48]).as_bytes() != &bytes[48..] {
            return Err("its head was changed");
        }
        if &bytes[..8] != MAGIC || eight(8) != super::folder::VERSION.to_le_bytes() {
            return Err("it is of another format");
        }
        let mut key = [0; 16];
        key.copy_from_slice(&bytes[16..32]);
        let length = u64::from_le_bytes(eight(32));
        if size(length) != file_size {
            return Err("it is not as long as it should be");
        }
        Ok(Header { key, length, seconds: f64::from_le_bytes(eight(40)) })
    }

    /// Reads the head of an open file of some size; or what is wrong with it.
    pub(super) fn read(
        file: &mut File,
        file_size: u64,
    ) -> std::io::Result<Result<Header, &'static str>> {
        let mut bytes = [0; HEAD];
        match file.read_exact(&mut bytes) {
            Err(e) if e.kind() == ErrorKind::UnexpectedEof => Ok(Err("it is cut off in its head")),
            read => read.map(|()| Header::from_bytes(&bytes, file_size)),
        }
    }
}

fn sum(key: &[u8; 16], number: u64, block: &[u8]) -> [u8; SUM] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(key).update(&number.to_le_bytes()).update(block);
    *hasher.finalize().as_bytes()
}

/// Takes the contents of an object that is being stored.
#[derive(Debug)]
pub struct Writer {
    file: File,
    key: [u8; 16],
    /// The block that is being filled, its number, and the bytes before it.
    block: Vec<u8>,
    number: u64,
    written: u64,
    /// The most bytes that the file may take on the disk.
    most: u64,
    is_too_large: bool,
    has_failed: bool,
}

impl Writer {
    /// For a new file, whose head is written at the end.
    pub(super) fn new(mut file: File, key: Key, most: u64) -> std::io::Result<Writer> {
        file.seek(SeekFrom::Start(HEAD as u64))?;
        Ok(Writer {
            file,
            key: key.to_bytes(),
            block: Vec::new(),
            number: 0,
            written: 0,
            most,
            is_too_large: false,
            has_failed: false,
        })
    }

    /// Whether more was written than may be stored.
    pub(super) fn is_too_large(&self) -> bool {
        self.is_too_large
    }

    /// Writes what is left, and the head. Returns the size of the file.
    pub(super) fn finish(mut self, seconds: f64) -> std::io::Result<u64> {
        if !self.block.is_empty() {
            self.end_block()?;
        }
        // Whoever wrote the contents may have overlooked it.
        if self.has_failed {
            return Err(std::io::Error::other("a part of it could not be written"));
        }
        // Not a number, less than none or endless: nobody can have measured that.
        let seconds = if seconds > 0.0 { seconds.min(1e12) } else { 0.0 };
        let header = Header { key: self.key, length: self.written, seconds };
        self.file.seek(SeekFrom::Start(0))?;
        self.file.write_all(&header.to_bytes())?;
        Ok(size(self.written))
    }

    fn end_block(&mut self) -> std::io::Result<()> {
        let length = self.block.len() as u64;
        let sum = sum(&self.key, self.number, &self.block);
        self.block.extend(sum);
        let written = self.file.write_all(&self.block);
        self.has_failed |= written.is_err();
        self.block.clear();
        self.number += 1;
        self.written += length;
        written
    }
}

impl Write for Writer {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let taken = bytes.len().min(BLOCK - self.block.len());
        let length = self.written + (self.block.len() + taken) as u64;
        if on_disk(size(length)) > self.most {
            self.is_too_large = true;
            return Err(ErrorKind::FileTooLarge.into());
        }
        self.block.extend_from_slice(&bytes[..taken]);
        if self.block.len() == BLOCK {
            self.end_block()?;
        }
        Ok(taken)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// An object that is being read. Its bytes are given out block by block, each after it was checked.
///
/// A block that is not what was written ends the reading with [`ErrorKind::InvalidData`]; the object is removed then,
/// and all that was read before is right.
#[derive(Debug)]
pub struct Object {
    file: File,
    path: PathBuf,
    header: Header,
    /// The block that is being given out, and how much of it was.
    block: Vec<u8>,
    given: usize,
    /// How many blocks were read.
    number: u64,
    /// The bytes behind them.
    left: u64,
    has_failed: bool,
}

impl Object {
    pub(super) fn open(path: PathBuf, key: Key) -> Result<Option<Object>> {
        match Object::opened(&path, key) {
            Ok(Ok(object)) => Ok(Some(object)),
            Ok(Err(what)) => Err(damaged(&path, what)),
            Err(e) if is_gone(&e) => Ok(None),
            Err(e) => Err(Error::file(path, e)),
        }
    }

    fn opened(path: &Path, key: Key) -> std::io::Result<Result<Object, &'static str>> {
        // To open a pipe would wait for somebody to write into it.
        if !std::fs::symlink_metadata(path)?.is_file() {
            return Ok(Err("there is something else in its place"));
        }
        let mut file = File::open(path)?;
        let about = file.metadata()?;
        let header = match Header::read(&mut file, about.len())? {
            Ok(header) if header.key == key.to_bytes() => header,
            Ok(_) => return Ok(Err("it is of another key")),
            Err(what) => return Ok(Err(what)),
        };
        touch(&file, &about);
        let left = header.length;
        let path = path.to_owned();
        let block = Vec::new();
        Ok(Ok(Object { file, path, header, block, given: 0, number: 0, left, has_failed: false }))
    }

    /// How many bytes it has.
    pub fn length(&self) -> u64 {
        self.header.length
    }

    /// The seconds that it took to make.
    pub fn seconds(&self) -> f64 {
        self.header.seconds
    }

    /// All bytes that were not read yet.
    ///
    /// # Errors
    /// If it is damaged, it cannot be read, or there is not the memory.
    pub fn into_bytes(mut self) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let read = self.read_all(&mut bytes);
        read.map(|()| bytes).map_err(|e| match e.downcast::<Error>() {
            Ok(error) => error,
            Err(e) => Error::file(&self.path, e),
        })
    }

    fn read_all(&mut self, bytes: &mut Vec<u8>) -> std::io::Result<()> {
        // The file is as long as its head says.
        let rest = usize::try_from(self.left).map_err(|_| ErrorKind::OutOfMemory)?;
        let rest = rest + self.block.len() - self.given;
        bytes.try_reserve_exact(rest).map_err(|_| ErrorKind::OutOfMemory)?;
        loop {
            let block = self.fill_buf()?;
            if block.is_empty() {
                return Ok(());
            }
            bytes.extend_from_slice(block);
            let given = block.len();
            self.consume(given);
        }
    }

    fn next_block(&mut self) -> std::io::Result<()> {
        let length = self.left.min(BLOCK as u64) as usize;
        // If anything fails there is no block to give out.
        let mut block = std::mem::take(&mut self.block);
        self.given = 0;
        block.resize(length + SUM, 0);
        let number = self.number;
        let wrong = |what| std::io::Error::new(ErrorKind::InvalidData, damaged(&self.path, what));
        self.file.read_exact(&mut block).map_err(|e| match e.kind() {
            ErrorKind::UnexpectedEof => wrong("it is cut off"),
            _ => e,
        })?;
        if sum(&self.header.key, number, &block[..length]) != block[length..] {
            return Err(wrong("its contents were changed"));
        }
        block.truncate(length);
        self.block = block;
        self.number += 1;
        self.left -= length as u64;
        Ok(())
    }
}

impl BufRead for Object {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        if self.has_failed {
            // The file stands anywhere.
            return Err(std::io::Error::new(
                ErrorKind::InvalidData,
                "reading it has failed before",
            ));
        }
        if self.given == self.block.len() && self.left > 0 {
            let read = self.next_block();
            self.has_failed = read.is_err();
            read?;
        }
        Ok(&self.block[self.given..])
    }

    fn consume(&mut self, amount: usize) {
        self.given = (self.given + amount).min(self.block.len());
    }
}

impl Read for Object {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        let read = self.fill_buf()?.read(into)?;
        self.consume(read);
        Ok(read)
    }
}

/// Notes that an object is used, once an hour. What fails is no matter: only the owner of a file may do it.
fn touch(file: &File, about: &Metadata) {
    let now = SystemTime::now();
    let is_recent = |then| super::evict::apart(now, then) < TOUCHED;
    if !about.modified().is_ok_and(is_recent) {
        let _ = file.set_modified(now);
    }
}

/// Removes an object that is not what was written; the error that says so.
fn damaged(path: &Path, what: &str) -> Error {
    let outcome = match std::fs::remove_file(path) {
        Err(e) if !is_gone(&e) => format!("it cannot be removed: {e}"),
        _ => "it was removed".to_owned(),
    };
    Error::in_file(
        path,
        format!("a stored result is damaged, and is computed again: {what}; {outcome}"),
    )
}
