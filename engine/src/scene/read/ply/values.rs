//! The numbers of a PLY file's body, in text and binary.

use std::path::Path;

use super::super::words::Words;
use super::header::{Element, Encoding, Type};
use crate::error::{Error, Result};

/// What of a body is not read yet.
pub(super) enum Values<'b> {
    Ascii(Words<'b>),
    Binary { path: &'b Path, bytes: &'b [u8], at: usize, is_big: bool },
}

impl<'b> Values<'b> {
    /// The body of a binary file.
    pub(super) fn binary(
        path: &'b Path,
        bytes: &'b [u8],
        at: usize,
        encoding: Encoding,
    ) -> Values<'b> {
        Values::Binary { path, bytes, at, is_big: encoding == Encoding::Big }
    }

    /// The bytes that are left: no more numbers can follow.
    pub(super) fn left(&self) -> u64 {
        match self {
            Values::Ascii(words) => words.rest().len() as u64,
            Values::Binary { bytes, at, .. } => (bytes.len() - at) as u64,
        }
    }

    /// The next number.
    pub(super) fn next(&mut self, of: Type) -> Result<f64> {
        match self {
            Values::Ascii(words) => words.any_number(),
            Values::Binary { path, bytes, at, is_big } => {
                let size = match of {
                    Type::I8 | Type::U8 => 1,
                    Type::I16 | Type::U16 => 2,
                    Type::I32 | Type::U32 | Type::F32 => 4,
                    Type::F64 => 8,
                };
                let Some(word) = bytes.get(*at..*at + size) else {
                    return Err(Error::at_byte(
                        *path,
                        *at as u64,
                        "it ends within its numbers: it is cut short",
                    ));
                };
                // The last byte first, and zeros before it.
                let mut whole = [0; 8];
                for (i, byte) in word.iter().enumerate() {
                    whole[if *is_big { size - 1 - i } else { i }] = *byte;
                }
                *at += size;
                let [a, b, c, d, ..] = whole;
                Ok(match of {
                    Type::U8 => f64::from(a),
                    Type::I8 => f64::from(a as i8),
                    Type::U16 => f64::from(u16::from_le_bytes([a, b])),
                    Type::I16 => f64::from(i16::from_le_bytes([a, b])),
                    Type::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
                    Type::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
                    Type::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
                    Type::F64 => f64::from_le_bytes(whole),
                })
            }
        }
    }

    /// The length of a list.
    pub(super) fn length(&mut self, of: Type) -> Result<usize> {
        let length = self.next(of)?;
        if length >= 0.0 && length.fract() == 0.0 && length <= self.left() as f64 {
            return Ok(length as usize);
        }
        Err(self.fault(format!("a list of {length} numbers, which are not there")))
    }

    /// Checks that an element's numbers end with its line, where there are lines.
    pub(super) fn end(&self, element: &Element) -> Result<()> {
        match self {
            Values::Ascii(words) if !words.is_at_line_end() => {
                let name = &element.name;
                Err(words.fault_here(format!(
                    "more numbers than a \"{name}\" has by the head of the file"
                )))
            }
            _ => Ok(()),
        }
    }

    pub(super) fn fault(&self, message: String) -> Error {
        match self {
            Values::Ascii(words) => words.fault_here(message),
            Values::Binary { path, at, .. } => Error::at_byte(*path, *at as u64, message),
        }
    }
}
