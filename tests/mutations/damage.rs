//! Damage that knows how a file is built.

use serde_json::Value;
use spandrel_tests::png;
use spandrel_tests::random::Random;
use std::io::Read;

/// How a file is built.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Form {
    /// Bytes with numbers in them.
    Binary,
    /// Words and numbers in lines.
    Text,
    /// JSON.
    Json,
    /// Chunks of a length, a name, data and a checksum; packed pixels.
    Png,
    /// Segments of a marker and a length.
    Jpeg,
    /// Chunks of a name and a length.
    Riff,
    /// Chunks of JSON and data.
    Glb,
    /// The program's own binary scene: a body and its hash.
    Scene,
    /// The program's own spans: packed blocks with checksums.
    Spans,
}

const WORDS: [u32; 16] = [
    0,
    1,
    2,
    3,
    4,
    7,
    8,
    0xff,
    0x100,
    0x7fff,
    0xffff,
    0x1_0000,
    0x00ff_ffff,
    0x7fff_ffff,
    0xffff_fff0,
    u32::MAX,
];
const NUMBERS: [&str; 18] = [
    "0",
    "-1",
    "1",
    "2",
    "3",
    "65536",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "-9223372036854775808",
    "1e308",
    "-1e308",
    "1e-320",
    "1e999",
    "nan",
    "inf",
    ".",
    "0x7f",
];
const LETTERS: [&str; 14] =
    ["(", ")", "[", "}", "\"", "\\", "/", "\n", "\r", "\t", "\0", "é", "\u{feff}", "😀"];

/// A damaged file.
pub(crate) fn damage(form: Form, sound: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = sound.to_vec();
    // One in ten is torn as any file may be.
    if random.below(10) == 0 {
        return torn(bytes, random);
    }
    for _ in 0..1 + random.below(3) {
        bytes = match form {
            Form::Binary => binary(bytes, random),
            Form::Text => text(&bytes, random),
            Form::Json => json(&bytes, random),
            Form::Png => png(&bytes, random),
            Form::Jpeg => jpeg(bytes, random),
            Form::Riff => riff(&bytes, random),
            Form::Glb => glb(&bytes, random),
            Form::Scene => scene(&bytes, random),
            Form::Spans => spans(&bytes, random),
        };
    }
    bytes
}

fn pick<'a, T>(all: &'a [T], random: &mut Random) -> &'a T {
    &all[random.below(all.len() as u32) as usize]
}

fn place(bytes: &[u8], random: &mut Random) -> usize {
    random.below(bytes.len().max(1) as u32) as usize
}

fn torn(mut bytes: Vec<u8>, random: &mut Random) -> Vec<u8> {
    let at = place(&bytes, random);
    match random.below(3) {
        0 => bytes.truncate(at),
        1 => drop(bytes.drain(at..(at + 40).min(bytes.len()))),
        _ => {
            let part = bytes[at..(at + 40).min(bytes.len())].to_vec();
            bytes.splice(at..at, part);
        }
    }
    bytes
}

/// A number that lies, of one, two or four bytes; more often near the beginning, where heads are.
fn binary(mut bytes: Vec<u8>, random: &mut Random) -> Vec<u8> {
    let near = [16, 64, 256, u32::MAX][random.below(4) as usize].min(bytes.len() as u32);
    if near == 0 {
        return bytes;
    }
    let at = random.below(near) as usize;
    let word = if random.below(4) == 0 { random.bits() } else { *pick(&WORDS, random) };
    let word = if random.below(2) == 0 { word.to_le_bytes() } else { word.to_be_bytes() };
    let (of_two, of_four) = (&word[..2], &word[..]);
    let new = match random.below(4) {
        0 => &word[..1],
        1 => of_two,
        2 => of_four,
        _ => {
            bytes[at] ^= 1 << random.below(8);
            return bytes;
        }
    };
    for (byte, new) in bytes[at..].iter_mut().zip(new) {
        *byte = *new;
    }
    bytes
}

fn text(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let text = String::from_utf8_lossy(bytes).into_owned();
    if random.below(4) == 0 {
        let mut lines: Vec<&str> = text.split('\n').collect();
        let (a, b) =
            (random.below(lines.len() as u32) as usize, random.below(lines.len() as u32) as usize);
        match random.below(3) {
            0 => drop(lines.remove(a)),
            1 => lines.insert(a, lines[b]),
            _ => lines.swap(a, b),
        }
        return lines.join("\n").into_bytes();
    }
    // Words and numbers, and single letters between them.
    let is_word = |c: char| c.is_alphanumeric() || "_.+-".contains(c);
    let mut tokens: Vec<String> = Vec::new();
    let mut was_word = false;
    for c in text.chars() {
        match tokens.last_mut() {
            Some(last) if was_word && is_word(c) => last.push(c),
            _ => tokens.push(c.to_string()),
        }
        was_word = is_word(c);
    }
    let is_number = |token: &String| token.parse::<f64>().is_ok();
    let numbers: Vec<usize> = (0..tokens.len()).filter(|i| is_number(&tokens[*i])).collect();
    let at = if numbers.is_empty() || random.below(3) == 0 {
        random.below(tokens.len() as u32) as usize
    } else {
        *pick(&numbers, random)
    };
    match random.below(6) {
        0..=2 if is_number(&tokens[at]) => tokens[at] = (*pick(&NUMBERS, random)).to_owned(),
        0 => drop(tokens.remove(at)),
        1 => tokens[at] = pick(&tokens, random).clone(),
        2 => tokens.insert(at, (*pick(&LETTERS, random)).to_owned()),
        3 => tokens[at] = tokens[at].repeat(1 + random.below(300) as usize),
        4 => tokens[at] = (*pick(&NUMBERS, random)).to_owned(),
        _ => tokens.insert(at, (*pick(&NUMBERS, random)).to_owned()),
    }
    tokens.concat().into_bytes()
}

fn json(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let Ok(mut value) = serde_json::from_slice::<Value>(bytes) else { return text(bytes, random) };
    fn count(value: &Value) -> u32 {
        1 + match value {
            Value::Array(list) => list.iter().map(count).sum::<u32>(),
            Value::Object(fields) => fields.values().map(count).sum(),
            _ => 0,
        }
    }
    fn find<'v>(value: &'v mut Value, at: &mut u32) -> Option<&'v mut Value> {
        if *at == 0 {
            return Some(value);
        }
        *at -= 1;
        match value {
            Value::Array(list) => list.iter_mut().find_map(|value| find(value, at)),
            Value::Object(fields) => fields.values_mut().find_map(|value| find(value, at)),
            _ => None,
        }
    }
    let all = count(&value);
    let other = find(&mut value.clone(), &mut random.below(all)).cloned().unwrap_or(Value::Null);
    if let Some(value) = find(&mut value, &mut random.below(all)) {
        match value {
            Value::Number(number) => {
                let number = number.as_f64().unwrap_or(0.0);
                *value = match random.below(4) {
                    0 => Value::from(number + 1.0),
                    1 => Value::from(-1),
                    2 => Value::from(u64::from(*pick(&WORDS, random))),
                    _ => pick(&NUMBERS, random).parse().unwrap_or(Value::from(u64::MAX)),
                };
            }
            Value::Array(list) if !list.is_empty() => {
                let at = random.below(list.len() as u32) as usize;
                match random.below(4) {
                    0 => drop(list.remove(at)),
                    1 => list.push(list[at].clone()),
                    2 => list.clear(),
                    _ => list[at] = other,
                }
            }
            Value::Object(fields) if !fields.is_empty() => {
                let names: Vec<String> = fields.keys().cloned().collect();
                let name = pick(&names, random).clone();
                let old = fields.remove(&name);
                match random.below(3) {
                    0 => {}
                    1 => drop(fields.insert(name, other)),
                    _ => drop(fields.insert(pick(&names, random).clone(), old.unwrap_or_default())),
                }
            }
            value => *value = other,
        }
    }
    serde_json::to_vec(&value).unwrap_or_default()
}

fn be(bytes: &[u8]) -> usize {
    bytes.iter().fold(0, |all, byte| all << 8 | usize::from(*byte))
}

fn png(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut chunks: Vec<([u8; 4], Vec<u8>)> = Vec::new();
    let mut at = 8;
    while let (Some(head), Some(name)) = (bytes.get(at..at + 4), bytes.get(at + 4..at + 8)) {
        let end = (at + 8 + be(head)).min(bytes.len());
        chunks.push((name.try_into().expect("four bytes"), bytes[at + 8..end].to_vec()));
        at = end + 4;
    }
    if chunks.is_empty() {
        return binary(bytes.to_vec(), random);
    }
    let at = random.below(chunks.len() as u32) as usize;
    let (name, data) = &mut chunks[at];
    match random.below(6) {
        0 => drop(chunks.remove(at)),
        1 => chunks.insert(at, chunks[at].clone()),
        2 => data.truncate(place(data, random)),
        3 if name == b"IDAT" => {
            let mut raw = Vec::new();
            let _ = flate2::read::ZlibDecoder::new(&data[..]).read_to_end(&mut raw);
            *data = png::packed(&binary(raw, random));
        }
        3 => name[random.below(4) as usize] ^= 0x20,
        _ => *data = binary(std::mem::take(data), random),
    }
    png::file(chunks.iter().map(|(name, data)| (&name[..], &data[..])))
}

/// A number within a segment, whose length stays right, or the segment itself.
fn jpeg(mut bytes: Vec<u8>, random: &mut Random) -> Vec<u8> {
    let mut segments = Vec::new();
    let mut at = 2;
    while let Some([0xff, _, high, low]) = bytes.get(at..at + 4) {
        let end = (at + 2 + be(&[*high, *low])).min(bytes.len());
        segments.push(at..end);
        at = end;
    }
    if segments.is_empty() || random.below(8) == 0 {
        return binary(bytes, random);
    }
    let segment = pick(&segments, random).clone();
    let part = bytes[segment.clone()].to_vec();
    match random.below(8) {
        0 => drop(bytes.drain(segment)),
        1 => drop(bytes.splice(segment.start..segment.start, part)),
        _ => {
            let start = (segment.start + 4).min(segment.end);
            let new = binary(bytes[start..segment.end].to_vec(), random);
            bytes.splice(start..segment.end, new);
        }
    }
    bytes
}

fn riff(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut out = match bytes.get(12..) {
        Some(rest) if random.below(4) > 0 => {
            // Within a chunk, and all lengths right.
            [
                &bytes[..12],
                &rest[..8.min(rest.len())],
                &binary(rest[8.min(rest.len())..].to_vec(), random),
            ]
            .concat()
        }
        _ => binary(bytes.to_vec(), random),
    };
    let length = (out.len().saturating_sub(8) as u32).to_le_bytes();
    if let Some(place) = out.get_mut(4..8) {
        place.copy_from_slice(&length);
    }
    out
}

/// A GLB of JSON and data.
pub(crate) fn made_glb(json: &[u8], data: &[u8]) -> Vec<u8> {
    let mut all = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for (kind, fill, chunk) in [(b"JSON", b' ', json), (b"BIN\0", 0, data)] {
        let length = chunk.len().next_multiple_of(4);
        all.extend((length as u32).to_le_bytes());
        all.extend(kind);
        all.extend(chunk);
        all.resize(all.len() + length - chunk.len(), fill);
    }
    let length = all.len() as u32;
    all[8..12].copy_from_slice(&length.to_le_bytes());
    all
}

fn glb(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let length = |at: usize| {
        let length = bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        length.unwrap_or(0) as usize
    };
    let end = 20 + length(12);
    let (Some(text), Some(data)) = (bytes.get(20..end), bytes.get(end + 8..)) else {
        return binary(bytes.to_vec(), random);
    };
    match random.below(8) {
        0 => binary(bytes.to_vec(), random),
        1 | 2 => made_glb(text, &binary(data.to_vec(), random)),
        _ => made_glb(&json(text, random), data),
    }
}

fn scene(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let (Some(head), Some(body)) = (bytes.get(..16), bytes.get(56..)) else {
        return binary(bytes.to_vec(), random);
    };
    let body = if random.below(8) == 0 {
        torn(body.to_vec(), random)
    } else {
        binary_anywhere(body, random)
    };
    [head, &(body.len() as u64).to_le_bytes(), blake3::hash(&body).as_bytes(), &body].concat()
}

fn binary_anywhere(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let at = place(bytes, random);
    [&bytes[..at], &binary(bytes[at..].to_vec(), random)].concat()
}

fn spans(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut blocks: Vec<(Vec<u8>, Vec<u8>)> = Vec::new();
    let mut at = 16;
    while let Some(head) = bytes.get(at..at + 36) {
        let word = |i: usize| u32::from_le_bytes([head[i], head[i + 1], head[i + 2], head[i + 3]]);
        let end = (at + 36 + word(12) as usize).min(bytes.len());
        let stored = &bytes[at + 36..end];
        let mut body = Vec::new();
        match word(12) == word(20) {
            true => body.extend(stored),
            false => drop(flate2::read::ZlibDecoder::new(stored).read_to_end(&mut body)),
        }
        blocks.push((head[..12].to_vec(), body));
        at = end;
    }
    if blocks.is_empty() {
        return binary(bytes.to_vec(), random);
    }
    let which = random.below(blocks.len() as u32) as usize;
    let (head, body) = &mut blocks[which];
    match random.below(10) {
        0 => *head = [&head[..4], &binary(head[4..].to_vec(), random)].concat(),
        1 => drop(blocks.remove(which)),
        2 => blocks.insert(which, blocks[which].clone()),
        _ if head.starts_with(b"head") => *body = json(body, random),
        _ => *body = binary_anywhere(body, random),
    }
    let mut out = bytes[..16.min(bytes.len())].to_vec();
    for (head, body) in blocks {
        let start = out.len();
        out.extend(head);
        out.extend((body.len() as u64).to_le_bytes());
        out.extend((body.len() as u64).to_le_bytes());
        out.extend(crc32fast::hash(&body).to_le_bytes());
        let checksum = crc32fast::hash(&out[start..]);
        out.extend(checksum.to_le_bytes());
        out.extend(body);
    }
    out
}
