//! The head of a PLY file: which elements there are, and of what.

use std::path::Path;

use super::super::words::{Words, lines};
use crate::error::{Error, Result};

/// How the numbers are held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    Little,
    Big,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Type {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Type {
    fn named(name: &str) -> Option<Type> {
        Some(match name {
            "char" | "int8" => Type::I8,
            "uchar" | "uint8" => Type::U8,
            "short" | "int16" => Type::I16,
            "ushort" | "uint16" => Type::U16,
            "int" | "int32" => Type::I32,
            "uint" | "uint32" => Type::U32,
            "float" | "float32" => Type::F32,
            "double" | "float64" => Type::F64,
            _ => return None,
        })
    }

    /// What stands for 1 if it is a share: a whole number's largest value; of 32 bits, that of a byte.
    pub(super) fn one(self) -> f64 {
        match self {
            Type::F32 | Type::F64 => 1.0,
            Type::I16 | Type::U16 => 65535.0,
            _ => 255.0,
        }
    }

    pub(super) fn is_whole(self) -> bool {
        !matches!(self, Type::F32 | Type::F64)
    }
}

/// A property of an element: a number or, with a type for its length, a list of numbers.
#[derive(Clone, Debug)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) length: Option<Type>,
    pub(super) of: Type,
}

/// A kind of element, and how many there are.
#[derive(Clone, Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
    /// The line that announces it.
    pub(super) line: usize,
}

impl Element {
    /// The place of the first property of some names.
    pub(super) fn find(&self, names: &[&str]) -> Option<usize> {
        names.iter().find_map(|name| self.properties.iter().position(|p| p.name == *name))
    }
}

#[derive(Debug)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// The pictures that comments name.
    pub(super) pictures: Vec<String>,
}

/// Where the head of a file ends: behind the line `end_header`.
pub(super) fn end(bytes: &[u8]) -> Option<usize> {
    let word = b"end_header";
    let starts = bytes.windows(word.len()).enumerate().filter(|(_, window)| window == word);
    for (at, _) in starts {
        let blanks =
            bytes[at + word.len()..].iter().take_while(|b| matches!(b, b' ' | b'\t')).count();
        let end = at + word.len() + blanks;
        let begins = at == 0 || matches!(bytes[at - 1], b'\n' | b'\r');
        match &bytes[end..] {
            _ if !begins => {}
            [] => return Some(end),
            [b'\n', ..] => return Some(end + 1),
            // What follows a lone return is data, though it may look like a line feed: the first line tells.
            [b'\r', b'\n', ..] if !bytes.starts_with(b"ply\r") || bytes.starts_with(b"ply\r\n") => {
                return Some(end + 2);
            }
            [b'\r', ..] => return Some(end + 1),
            _ => {}
        }
    }
    None
}

fn kind(words: &mut Words<'_>) -> Result<Type> {
    let here = words.clone();
    let name = words.next().unwrap_or_default();
    Type::named(name)
        .ok_or_else(|| here.fault_here(format!("\"{name}\" where a type of numbers is expected")))
}

/// Reads the head.
pub(super) fn parse(path: &Path, text: &str) -> Result<Header> {
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut pictures = Vec::new();
    for (at, mut words) in lines(path, text).enumerate() {
        let Some(word) = words.next() else { continue };
        match word {
            "ply" if at == 0 => {}
            "comment" => {
                if words.peek().is_some_and(|word| word.eq_ignore_ascii_case("TextureFile")) {
                    words.next();
                    pictures.push(words.rest().to_owned());
                }
            }
            "obj_info" => {}
            "format" => {
                let name = words.next().unwrap_or_default();
                encoding = Some(match name {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::Little,
                    "binary_big_endian" => Encoding::Big,
                    _ => {
                        let message = format!(
                            "\"{name}\" where ascii, binary_little_endian or binary_big_endian is expected"
                        );
                        return Err(words.fault_here(message));
                    }
                });
            }
            "element" => {
                let Some(name) = words.next() else {
                    return Err(words.fault_here("an element without a name"));
                };
                let count = words.next().unwrap_or_default();
                let Ok(count) = count.parse() else {
                    return Err(
                        words.fault(word, format!("the element \"{name}\" has no number of them"))
                    );
                };
                elements.push(Element {
                    name: name.to_owned(),
                    count,
                    properties: Vec::new(),
                    line: at + 1,
                });
            }
            "property" => {
                let Some(element) = elements.last_mut() else {
                    return Err(words.fault(word, "a property before any element"));
                };
                let length = (words.peek() == Some("list")).then(|| words.next());
                let length = length.map(|_| kind(&mut words)).transpose()?;
                let of = kind(&mut words)?;
                let name = words.rest().to_owned();
                element.properties.push(Property { name, length, of });
            }
            "end_header" => {
                let encoding =
                    encoding.ok_or_else(|| words.fault(word, "the head has no line `format`"))?;
                return Ok(Header { encoding, elements, pictures });
            }
            _ => return Err(words.fault(word, format!("\"{word}\" is no line of a PLY's head"))),
        }
    }
    Err(Error::in_file(path, "its head has no end: the line `end_header` is missing"))
}
