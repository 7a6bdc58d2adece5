//! Span files, byte by byte: their layout as it is documented, and damage of every kind, which can do no more
//! than fail.

use spandrel_engine::image::Channel;
use spandrel_engine::span::SpanImage;
use spandrel_engine::span_file::{self, Options, SpanFile};
use spandrel_tests::program::Scratch;
use spandrel_tests::random::Random;
use spandrel_tests::scenes::front_view;
use spandrel_tests::spans::{image, picture, plans};
use std::path::Path;

/// A small file with everything in it.
fn sample(path: &Path) -> Vec<u8> {
    let view = front_view(24, 20);
    let image = image(4, true, &view, plans()[0], 0..20);
    span_file::write(&image, path, Options::default()).unwrap();
    std::fs::read(path).unwrap()
}

fn try_read(path: &Path, bytes: &[u8]) -> spandrel_engine::Result<SpanImage> {
    std::fs::write(path, bytes).unwrap();
    let file = SpanFile::open(path, None)?;
    let image = file.read(file.rows())?;
    Ok(image)
}

#[test]
fn a_truncated_file_is_an_error_that_names_the_place() {
    let folder = Scratch::new("a_truncated_file_is_an_error_that_names_the_place");
    let path = folder.path().join("a.span");
    let bytes = sample(&path);
    for length in 0..bytes.len() {
        let error = try_read(&path, &bytes[..length]).unwrap_err().to_string();
        assert!(error.contains("a.span: byte "), "{length}: {error}");
        let named = error.contains("block") || length < 16;
        assert!(named && (length < 16 || error.contains("truncated")), "{length}: {error}");
    }
    let longer = [&bytes[..], b"more"].concat();
    assert!(try_read(&path, &longer).unwrap_err().to_string().contains("bytes follow the end"));
}

#[test]
fn every_changed_byte_is_found() {
    let folder = Scratch::new("every_changed_byte_is_found");
    let path = folder.path().join("a.span");
    let bytes = sample(&path);
    let mut random = Random::new(8);
    for at in 0..bytes.len() {
        let mut changed = bytes.clone();
        changed[at] ^= 1 << random.below(8);
        let error = try_read(&path, &changed).unwrap_err().to_string();
        assert!(error.contains("a.span: byte "), "{at}: {error}");
        assert!(at < 16 || error.contains("block"), "{at}: {error}");
    }
}

/// Heads of blocks: kind, a, b, and the contents unpacked.
fn blocks(bytes: &[u8]) -> Vec<([u8; 4], u32, u32, Vec<u8>)> {
    use std::io::Read;
    let mut at = 16;
    let mut found = Vec::new();
    while at < bytes.len() {
        let u32_at = |i: usize| u32::from_le_bytes(bytes[at + i..at + i + 4].try_into().unwrap());
        let (stored, raw) = (u32_at(12) as usize, u32_at(20) as usize);
        let body = &bytes[at + 36..at + 36 + stored];
        let mut unpacked = Vec::new();
        match stored == raw {
            true => unpacked.extend_from_slice(body),
            false => {
                flate2::read::ZlibDecoder::new(body).read_to_end(&mut unpacked).unwrap();
            }
        }
        found.push((bytes[at..at + 4].try_into().unwrap(), u32_at(4), u32_at(8), unpacked));
        at += 36 + stored;
    }
    found
}

/// A file of blocks that are not packed, by the documented layout alone.
fn file_of(blocks: &[([u8; 4], u32, u32, Vec<u8>)]) -> Vec<u8> {
    let mut bytes = b"SPANDRELspan".to_vec();
    bytes.extend(1u32.to_le_bytes());
    for (kind, a, b, body) in blocks {
        let mut head = kind.to_vec();
        head.extend(a.to_le_bytes());
        head.extend(b.to_le_bytes());
        head.extend((body.len() as u64).to_le_bytes());
        head.extend((body.len() as u64).to_le_bytes());
        head.extend(crc32fast::hash(body).to_le_bytes());
        head.extend(crc32fast::hash(&head).to_le_bytes());
        bytes.extend(head);
        bytes.extend(body);
    }
    bytes
}

/// Mutations below the checksums: what is read is an image that resolves, or an error that names a block or
/// the file.
#[test]
fn contents_that_lie_end_in_an_image_or_an_error() {
    let folder = Scratch::new("contents_that_lie_end_in_an_image_or_an_error");
    let path = folder.path().join("a.span");
    let sound = blocks(&sample(&path));
    assert!(try_read(&path, &file_of(&sound)).is_ok());
    let mut random = Random::new(21);
    let (mut images, mut errors) = (0, 0);
    for round in 0..6000 {
        let mut changed = sound.clone();
        for _ in 0..1 + random.below(3) {
            let at = random.below(changed.len() as u32) as usize;
            let (kind, a, b, body) = &mut changed[at];
            match random.below(8) {
                0 => *a = random.below(1 << 31) >> random.below(32),
                1 => *b = random.below(1 << 31) >> random.below(32),
                2 => *kind = [*b"head", *b"scen", *b"line", *b"face"][random.below(4) as usize],
                3 => body.truncate(random.below(body.len() as u32 + 1) as usize),
                _ if body.is_empty() => {}
                _ => {
                    let place = random.below(body.len() as u32) as usize;
                    body[place] = match random.below(3) {
                        0 => 0xff,
                        1 => body[place] ^ (1 << random.below(8)),
                        _ => random.below(256) as u8,
                    };
                }
            }
        }
        match try_read(&path, &file_of(&changed)) {
            Ok(image) => {
                images += 1;
                // Whatever it is of, it is an image.
                let side = image.view().raster();
                if side.width <= 200 && side.height <= 200 && image.rows() == (0..side.height) {
                    picture(&image, &[Channel::Color, Channel::Z, Channel::P, Channel::Id]);
                    let again = SpanImage::merge(&[image.clone(), image.clone()]).unwrap();
                    assert_eq!(again.lines().range(), image.lines().range(), "round {round}");
                }
            }
            Err(error) => {
                errors += 1;
                assert!(error.to_string().contains("a.span"), "round {round}: {error}");
            }
        }
    }
    assert!(images > 100 && errors > 1000, "{images} images, {errors} errors");
}

#[test]
fn lengths_that_lie_allocate_nothing() {
    let folder = Scratch::new("lengths_that_lie_allocate_nothing");
    let path = folder.path().join("a.span");
    let bytes = sample(&path);
    for (at, value) in [(12, u64::MAX), (12, 1 << 40), (20, u64::MAX), (20, 1 << 29)] {
        let mut changed = bytes.clone();
        changed[16 + at..16 + at + 8].copy_from_slice(&value.to_le_bytes());
        let checksum = crc32fast::hash(&changed[16..48]);
        changed[48..52].copy_from_slice(&checksum.to_le_bytes());
        let error = try_read(&path, &changed).unwrap_err().to_string();
        assert!(error.contains("block \"head\""), "{error}");
    }
}

/// A file written by hand from its documentation: two triangles' worth of walls, one before the other.
#[test]
fn any_program_can_write_one() {
    let head = r#"{
        "writer": "by hand", "width": 8, "height": 2, "lines_per_row": 1, "phase": "Centre", "rows": [0, 2],
        "camera": {"position": [0, 0, 10], "look_at": [0, 0, 0], "parallel_height": 2},
        "sources": [{"label": "walls", "scene": "00000000000000000000000000000001"}]
    }"#;
    let run = |bytes: &[u8]| {
        assert!(bytes.len() < 128);
        [&[bytes.len() as u8][..], bytes].concat()
    };
    let number = |mut n: u64| {
        let mut out = Vec::new();
        while n >= 128 {
            out.push(n as u8 | 128);
            n >>= 7;
        }
        out.push(n as u8);
        out
    };
    let signed = |n: i64| number(if n < 0 { (-2 * n - 1) as u64 } else { 2 * n as u64 });
    // A cell is 2^-28 pixels: 8 has 28 leading zeros.
    let cell = |pixels: f64| (pixels * (1u64 << 28) as f64) as u64;
    // Line 0: nothing, face 5 from 2 to 6, nothing. Line 1: the same, with face 9 from 4 on before it: keep
    // two, one new, keep one.
    let operations =
        [number(3), number(4 * 2 + 2), number(4), number(4), number(2), number(0)].concat();
    let moves = [signed(0), signed(0), signed(0)].concat();
    let faces = [signed(-1), signed(6), signed(-6), signed(4)].concat();
    let places = [number(0), number(cell(2.0)), number(cell(4.0)), number(cell(2.0))].concat();
    let spans = [run(&operations), run(&moves), run(&faces), run(&places)].concat();
    let none = [run(&[0, 0]), run(&[]), run(&[]), run(&[])].concat();
    let doubles = |values: &[f64]| {
        let bits: Vec<u64> = values.iter().map(|v| v.to_bits()).collect();
        let mixed: Vec<u64> =
            (0..bits.len()).map(|i| bits[i] ^ if i > 0 { bits[i - 1] } else { 0 }).collect();
        (0..8)
            .rev()
            .flat_map(|byte| mixed.iter().map(move |v| (v >> (8 * byte)) as u8))
            .collect::<Vec<u8>>()
    };
    let floats = |values: &[f32]| {
        let bits: Vec<u32> = values.iter().map(|v| v.to_bits()).collect();
        let mixed: Vec<u32> =
            (0..bits.len()).map(|i| bits[i] ^ if i > 0 { bits[i - 1] } else { 0 }).collect();
        (0..4)
            .rev()
            .flat_map(|byte| mixed.iter().map(move |v| (v >> (8 * byte)) as u8))
            .collect::<Vec<u8>>()
    };
    let table = [
        run(&[5, 4]),
        run(&[0, 1]),
        run(&[1, 1 + 32]),
        run(&[0, 0]),
        run(&[]),
        run(&[doubles(&[0.0, 0.0]), doubles(&[0.0, 0.0]), doubles(&[-10.0, -8.0])].concat()),
        run(&[1, 4, 0]),
        run(&[0, 0, 0, 0]),
        run(&[vec![4], doubles(&[2.0, 6.0, 6.0, 2.0]), doubles(&[0.0, 0.0, 2.0, 2.0])].concat()),
        run(&[0, 1]),
        run(&[
            vec![2],
            floats(&[1.0, 0.0]),
            floats(&[0.0, 0.5]),
            floats(&[0.0, 0.0]),
            floats(&[1.0, 1.0]),
        ]
        .concat()),
        run(&[0, 0]),
        run(&[vec![1], run(b"wall")].concat()),
    ]
    .concat();
    let bytes = file_of(&[
        (*b"head", 0, 0, head.as_bytes().to_vec()),
        (*b"line", 0, 2, [spans, none].concat()),
        (*b"note", 7, 7, b"skipped".to_vec()),
        (*b"face", 0, 2, table),
        (*b"end ", 4, 0, Vec::new()),
    ]);
    let folder = Scratch::new("any_program_can_write_one");
    let path = folder.path().join("a.span");
    let image = try_read(&path, &bytes).unwrap();
    let result = picture(&image, &[Channel::Color, Channel::Z]);
    let channel = |name: &str| result.float(name).unwrap().to_vec();
    let (red, green, z) = (channel("R"), channel("G"), channel("Z"));
    assert_eq!(red[..8], [0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0]);
    assert_eq!(red[8..], [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(green[8..], [0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0]);
    assert_eq!(z[8 + 3..8 + 6], [10.0, 8.0, 8.0]);
}

#[test]
fn a_file_holds_what_its_documentation_allows() {
    let scratch = Scratch::new("a_file_holds_what");
    let path = scratch.path().join("a.span");
    let sound = blocks(&sample(&path));
    let error = |blocks: &[([u8; 4], u32, u32, Vec<u8>)]| {
        try_read(&path, &file_of(blocks)).unwrap_err().to_string()
    };
    let mut twice = sound.clone();
    twice.insert(1, sound[0].clone());
    twice.last_mut().unwrap().1 += 1;
    assert!(error(&twice).contains("it is there twice"));
    let mut missing = sound.clone();
    missing.retain(|(kind, ..)| kind != b"line");
    missing.last_mut().unwrap().1 -= 1;
    assert!(error(&missing).contains("its lines end with 0, not 80"));
    let mut many = sound.clone();
    many[1].2 = 5000;
    assert!(error(&many).contains("at most 4096 lines"), "{}", error(&many));
    let mut uncounted = sound;
    uncounted.last_mut().unwrap().1 += 1;
    assert!(error(&uncounted).contains("blocks stand before it"));
}
