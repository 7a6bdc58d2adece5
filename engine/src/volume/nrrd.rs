//! NRRD files: volumes of scanners, and of anything.
//!
//! Read are versions 1 to 5 with three axes, or four of which one counts the values of a point; all types of numbers;
//! `raw`, `gzip` and `text`; data in the file or in one beside it; `spacings` or `space directions`, `space origin`,
//! `axis mins`. Without units lengths are millimetres, as scanners have them. Coordinates stay those of the file's
//! space, such as left-posterior-superior, with z up.

use flate2::read::MultiGzDecoder;
use glam::{DMat3, DVec3};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use super::{MOST_SAMPLES, Volume};
use crate::error::{Error, Result};
use crate::open;
use crate::scene::document::Axis;
use crate::watch::Watch;

/// The most values at each point that are believed.
const MOST_VALUES: usize = 4096;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Type {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Type {
    fn of(name: &str) -> Option<Type> {
        Some(match name {
            "signed char" | "int8" | "int8_t" => Type::I8,
            "uchar" | "unsigned char" | "uint8" | "uint8_t" => Type::U8,
            "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => {
                Type::I16
            }
            "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => Type::U16,
            "int" | "signed int" | "int32" | "int32_t" => Type::I32,
            "uint" | "unsigned int" | "uint32" | "uint32_t" => Type::U32,
            "longlong"
            | "long long"
            | "long long int"
            | "signed long long"
            | "signed long long int"
            | "int64"
            | "int64_t" => Type::I64,
            "ulonglong"
            | "unsigned long long"
            | "unsigned long long int"
            | "uint64"
            | "uint64_t" => Type::U64,
            "float" => Type::F32,
            "double" => Type::F64,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Type::I8 | Type::U8 => 1,
            Type::I16 | Type::U16 => 2,
            Type::I32 | Type::U32 | Type::F32 => 4,
            Type::I64 | Type::U64 | Type::F64 => 8,
        }
    }

    /// A number of bytes that are little endian.
    fn number(self, b: &[u8]) -> f32 {
        match self {
            Type::I8 => f32::from(b[0] as i8),
            Type::U8 => f32::from(b[0]),
            Type::I16 => f32::from(i16::from_le_bytes([b[0], b[1]])),
            Type::U16 => f32::from(u16::from_le_bytes([b[0], b[1]])),
            Type::I32 => i32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32,
            Type::U32 => u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32,
            Type::F32 => f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
            Type::I64 => i64::from_le_bytes(eight(b)) as f32,
            Type::U64 => u64::from_le_bytes(eight(b)) as f32,
            Type::F64 => f64::from_le_bytes(eight(b)) as f32,
        }
    }
}

fn eight(b: &[u8]) -> [u8; 8] {
    [b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]
}

/// The head: fields by name, each with its line.
struct Head<'f> {
    path: &'f Path,
    fields: BTreeMap<String, (usize, String)>,
}

impl<'f> Head<'f> {
    /// Reads the head; returns where the data begins, if they are in the file.
    fn read(path: &'f Path, bytes: &[u8]) -> Result<(Head<'f>, usize)> {
        let mut head = Head { path, fields: BTreeMap::new() };
        let (mut at, mut number) = (0, 0);
        loop {
            let rest = &bytes[at..];
            let end = rest.iter().position(|byte| *byte == b'\n');
            // A head without an end is text to its end: the data is elsewhere, or missing.
            let line = &rest[..end.unwrap_or(rest.len())];
            number += 1;
            let line = line.strip_suffix(b"\r").unwrap_or(line);
            let line = std::str::from_utf8(line).map_err(|_| {
                Error::at_line(path, number, 1, "not text: the head has no empty line at its end")
            })?;
            at = (at + end.map_or(rest.len(), |end| end + 1)).min(bytes.len());
            if line.is_empty() || at == bytes.len() && end.is_none() {
                return Ok((head, at));
            }
            if number == 1 || line.starts_with('#') || line.contains(":=") {
                continue;
            }
            let Some((name, value)) = line.split_once(": ").or_else(|| line.split_once(':')) else {
                let message = format!("{line:?} should be a field, such as `type: short`");
                return Err(Error::at_line(path, number, 1, message));
            };
            let name = name.trim().to_ascii_lowercase().replace(' ', "");
            head.fields.insert(name, (number, value.trim().to_owned()));
            if at == bytes.len() {
                return Ok((head, at));
            }
        }
    }

    fn get(&self, name: &str) -> Option<&str> {
        self.fields.get(name).map(|(_, value)| value.as_str())
    }

    fn needs(&self, name: &str) -> Result<&str> {
        self.get(name)
            .ok_or_else(|| Error::in_file(self.path, format!("its head has no field `{name}`")))
    }

    /// An error of a field's value.
    fn fault(&self, name: &str, message: impl Into<String>) -> Error {
        let line = self.fields.get(name).map_or(1, |(line, _)| *line);
        Error::at_line(self.path, line, 1, message)
    }

    /// The words of a field, one for each axis.
    fn words(&self, name: &str, axes: usize) -> Result<Option<Vec<String>>> {
        let Some(text) = self.get(name) else { return Ok(None) };
        // Vectors and quoted words have spaces of their own.
        let (mut words, mut word, mut open) = (Vec::new(), String::new(), None);
        for letter in text.chars() {
            match (open, letter) {
                (None, '(') => open = Some(')'),
                (None, '"') => open = Some('"'),
                (Some(closing), letter) if closing == letter => open = None,
                (None, letter) if letter.is_whitespace() => {
                    words.push(std::mem::take(&mut word));
                    continue;
                }
                _ => word.push(letter),
            }
        }
        words.push(word);
        words.retain(|word| !word.is_empty());
        if words.len() != axes {
            let there = words.len();
            return Err(
                self.fault(name, format!("`{name}` has {there} values, and there are {axes} axes"))
            );
        }
        Ok(Some(words))
    }

    fn vector(&self, name: &str, text: &str) -> Result<DVec3> {
        let text = text.trim_matches(['(', ')']);
        let parts: Vec<f64> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
        match parts[..] {
            [x, y, z] if text.split(',').count() == 3 => Ok(DVec3::new(x, y, z)),
            _ => Err(self.fault(
                name,
                format!("`{name}`: {text:?} should be three numbers, such as (0, 0, 1.5)"),
            )),
        }
    }
}

/// Which axis counts the values of a point, and the counts of the others.
struct Shape {
    values: Option<usize>,
    sizes: Vec<usize>,
}

pub(super) fn read(path: &Path, bytes: &[u8], component: Option<u32>) -> Result<Volume> {
    let (head, data) = Head::read(path, bytes)?;
    let shape = shape(&head)?;
    let space: Vec<usize> =
        (0..shape.sizes.len()).filter(|axis| Some(*axis) != shape.values).collect();
    let counts: [usize; 3] = std::array::from_fn(|axis| shape.sizes[space[axis]]);
    let (origin, steps) = placed(&head, &space, shape.sizes.len())?;
    super::check(counts, origin, steps).map_err(|error| head.fault("sizes", error.to_string()))?;
    let values = shape.values.map_or(1, |axis| shape.sizes[axis]);
    let chosen = component.unwrap_or(0) as usize;
    if chosen >= values {
        let message =
            format!("`component` {chosen}: each point has {values} values, 0 to {}", values - 1);
        return Err(Error::in_file(path, message));
    }
    let all = counts.iter().product::<usize>() * values;
    let numbers = numbers(&head, bytes, data, all)?;
    let samples = match shape.values {
        None => numbers,
        // The axis of values has this many numbers in front of it.
        Some(axis) => {
            let inner: usize = shape.sizes[..axis].iter().product();
            let blocks = numbers.chunks(inner * values);
            let taken = blocks.map(|block| &block[chosen * inner..(chosen + 1) * inner]);
            taken.flatten().copied().collect()
        }
    };
    let mut volume = Volume::new(counts, origin, steps, samples)
        .map_err(|e| Error::in_file(path, e.to_string()))?;
    volume.up = Axis::Z;
    (volume.unit, volume.unit_name) = unit(&head, &space, shape.sizes.len())?;
    let told = ["content", "space", "type", "encoding"];
    let told = told.iter().filter_map(|name| Some(format!("{name}: {}", head.get(name)?)));
    volume.about.push(told.collect::<Vec<_>>().join(", "));
    let space_name = head.get("space").unwrap_or_default().to_ascii_lowercase();
    let is_left = ["left-anterior-superior", "las", "3d-left-handed"];
    if is_left.iter().any(|name| space_name.trim_end_matches("-time") == *name) {
        volume.notes.push(format!(
            "{}: its space, {space_name}, is left-handed: what is shown is its mirror image",
            path.display()
        ));
    }
    if values > 1 && component.is_none() {
        volume.notes.push(format!(
            "{}: each point has {values} values; the first is taken: `component` chooses",
            path.display()
        ));
    }
    Ok(volume)
}

fn shape(head: &Head<'_>) -> Result<Shape> {
    let dimension = head.needs("dimension")?;
    let axes = match dimension {
        "3" => 3,
        "4" => 4,
        _ => {
            let message = format!(
                "{dimension} axes: three are read, and a fourth that counts the values of a point"
            );
            return Err(head.fault("dimension", message));
        }
    };
    head.needs("sizes")?;
    let words = head.words("sizes", axes)?.unwrap_or_default();
    let sizes: Vec<usize> = words
        .iter()
        .map(|word| {
            let size = word.parse().ok().filter(|size| (1..=MOST_SAMPLES).contains(size));
            size.ok_or_else(|| head.fault("sizes", format!("{word:?} is no count of samples")))
        })
        .collect::<Result<_>>()?;
    if axes == 3 {
        return Ok(Shape { values: None, sizes });
    }
    // It has no direction in space, or is of a kind that has none; else the first, as writers put it.
    let directions = head.words("spacedirections", axes)?;
    let kinds = head.words("kinds", axes)?;
    let by_direction = directions.and_then(|all| all.iter().position(|word| word == "none"));
    let in_space = ["domain", "space", "???", "none"];
    let by_kind = kinds.and_then(|all| {
        all.iter().position(|kind| !in_space.contains(&kind.to_ascii_lowercase().as_str()))
    });
    let values = by_direction.or(by_kind).unwrap_or(0);
    if sizes[values] > MOST_VALUES {
        let message = format!("{} values at each point: at most {MOST_VALUES}", sizes[values]);
        return Err(head.fault("sizes", message));
    }
    Ok(Shape { values: Some(values), sizes })
}

/// Where the first sample lies, and the steps from sample to sample.
fn placed(head: &Head<'_>, space: &[usize], axes: usize) -> Result<(DVec3, DMat3)> {
    if let Some(directions) = head.words("spacedirections", axes)? {
        let step = |axis: usize| head.vector("spacedirections", &directions[space[axis]]);
        let steps = DMat3::from_cols(step(0)?, step(1)?, step(2)?);
        let origin = head.get("spaceorigin").map(|text| head.vector("spaceorigin", text));
        return Ok((origin.transpose()?.unwrap_or(DVec3::ZERO), steps));
    }
    let numbers = |name: &str, absent: f64| -> Result<DVec3> {
        let Some(words) = head.words(name, axes)? else { return Ok(DVec3::splat(absent)) };
        let number = |axis: usize| -> Result<f64> {
            let word = &words[space[axis]];
            let number = word.parse::<f64>();
            let number =
                number.map_err(|_| head.fault(name, format!("`{name}`: {word:?} is no number")))?;
            // The format's word for what is not known.
            Ok(if number.is_nan() { absent } else { number })
        };
        Ok(DVec3::new(number(0)?, number(1)?, number(2)?))
    };
    Ok((numbers("axismins", 0.0)?, DMat3::from_diagonal(numbers("spacings", 1.0)?)))
}

/// Metres per unit, and its name.
fn unit(head: &Head<'_>, space: &[usize], axes: usize) -> Result<(f64, String)> {
    let units = match head.get("spaceunits") {
        Some(_) => head.words("spaceunits", 3)?,
        None => head
            .words("units", axes)?
            .map(|all| space.iter().map(|axis| all[*axis].clone()).collect()),
    };
    let Some(units) = units.filter(|units| units.iter().all(|unit| !unit.is_empty())) else {
        return Ok((1e-3, "mm (not told)".to_owned()));
    };
    if units.iter().any(|unit| *unit != units[0]) {
        return Err(head.fault("spaceunits", "the axes have different units: convert it to one"));
    }
    let metres = match units[0].to_ascii_lowercase().as_str() {
        "nm" | "nanometer" | "nanometre" => 1e-9,
        "um" | "micron" | "microns" | "\u{b5}m" | "micrometer" | "micrometre" => 1e-6,
        "mm" | "millimeter" | "millimetre" | "millimeters" | "???" | "" => 1e-3,
        "cm" | "centimeter" | "centimetre" => 1e-2,
        "m" | "meter" | "metre" | "meters" => 1.0,
        "km" => 1e3,
        other => {
            let message = format!("the unit {other:?} is not known: nm, um, mm, cm, m or km");
            return Err(head.fault("spaceunits", message));
        }
    };
    Ok((metres, units[0].clone()))
}

/// The numbers, all of them.
fn numbers(head: &Head<'_>, bytes: &[u8], data: usize, all: usize) -> Result<Vec<f32>> {
    let name = head.needs("type")?;
    let of = Type::of(name);
    let of =
        of.ok_or_else(|| head.fault("type", format!("numbers of type {name:?} are not read")))?;
    let (path, bytes) = match head.get("datafile") {
        None => (head.path.to_owned(), Cow::Borrowed(bytes.get(data..).unwrap_or(&[]))),
        Some(name) if name.starts_with("LIST") || name.contains('%') => {
            return Err(
                head.fault("datafile", "data in several files is not read: join them first")
            );
        }
        Some(name) => {
            let path = head.path.parent().unwrap_or(Path::new("")).join(name);
            let bytes = open::bytes(&path)?;
            (path, Cow::Owned(bytes))
        }
    };
    let mut rest = &bytes[..];
    let lines = whole(head, "lineskip")?.unwrap_or(0);
    for _ in 0..lines {
        let end = rest.iter().position(|byte| *byte == b'\n');
        let end =
            end.ok_or_else(|| head.fault("lineskip", "there are fewer lines than are skipped"))?;
        rest = &rest[end + 1..];
    }
    let wanted = all * of.bytes();
    let encoding = head.needs("encoding")?;
    let encoding = encoding.to_ascii_lowercase();
    let unpacked;
    match encoding.as_str() {
        "raw" => {}
        "gzip" | "gz" => {
            unpacked = unpack(&path, rest, wanted)?;
            rest = &unpacked;
        }
        "text" | "txt" | "ascii" => return written(&path, rest, all),
        other => {
            let message = format!("the encoding {other:?} is not read: raw, gzip or text are");
            return Err(head.fault("encoding", message));
        }
    }
    // -1 says that the data is at the end.
    match whole(head, "byteskip")? {
        Some(-1) => rest = &rest[rest.len().saturating_sub(wanted)..],
        Some(skip) => rest = rest.get(usize::try_from(skip).unwrap_or(0)..).unwrap_or(&[]),
        None => {}
    }
    if rest.len() < wanted {
        let message = format!(
            "{wanted} bytes of samples are announced, {} are there: it is cut short",
            rest.len()
        );
        return Err(Error::in_file(&path, message));
    }
    let is_big = match (head.get("endian"), of.bytes()) {
        (Some("big"), _) => true,
        (Some("little"), _) | (None, 1) => false,
        (None, _) => {
            return Err(Error::in_file(&path, "its head has no field `endian`: little or big"));
        }
        (Some(other), _) => {
            return Err(head.fault("endian", format!("`endian` is little or big, not {other:?}")));
        }
    };
    let watch = Watch::current();
    let mut numbers = Vec::with_capacity(all);
    for some in rest[..wanted].chunks(of.bytes() << 16) {
        watch.check()?;
        numbers.extend(some.chunks_exact(of.bytes()).map(|number| {
            let mut bytes = [0; 8];
            let bytes = &mut bytes[..of.bytes()];
            bytes.copy_from_slice(number);
            if is_big {
                bytes.reverse();
            }
            of.number(bytes)
        }));
    }
    Ok(numbers)
}

fn whole(head: &Head<'_>, name: &str) -> Result<Option<i64>> {
    let Some(text) = head.get(name) else { return Ok(None) };
    let number = text.parse().ok().filter(|number| *number >= -1);
    number.map(Some).ok_or_else(|| head.fault(name, format!("`{name}`: {text:?} is no count")))
}

/// Unpacks what is wanted and no more.
fn unpack(path: &Path, bytes: &[u8], wanted: usize) -> Result<Vec<u8>> {
    let watch = Watch::current();
    let mut decoder = MultiGzDecoder::new(bytes);
    // Room is made as the bytes come: what is announced may not be there.
    let mut unpacked = Vec::new();
    loop {
        watch.check()?;
        let part = (wanted + 1 - unpacked.len()).min(1 << 22);
        let read = decoder.by_ref().take(part as u64).read_to_end(&mut unpacked);
        match read {
            Ok(0) => return Ok(unpacked),
            Ok(_) if unpacked.len() > wanted => {
                unpacked.truncate(wanted);
                return Ok(unpacked);
            }
            Ok(_) => {}
            Err(error) => {
                let there = unpacked.len();
                let message =
                    format!("its gzip data breaks off after {there} of {wanted} bytes: {error}");
                return Err(Error::in_file(path, message));
            }
        }
    }
}

fn written(path: &Path, bytes: &[u8], all: usize) -> Result<Vec<f32>> {
    let open::Text { text, .. } = open::text(path, bytes)?;
    let mut numbers = Vec::new();
    for word in text.split_whitespace().take(all) {
        let number = word.trim_end_matches(',').parse::<f32>();
        let number = number.map_err(|_| {
            Error::in_file(path, format!("sample {}: {word:?} is no number", numbers.len()))
        });
        numbers.push(number?);
    }
    if numbers.len() < all {
        let message =
            format!("{all} samples are announced, {} are there: it is cut short", numbers.len());
        return Err(Error::in_file(path, message));
    }
    Ok(numbers)
}
