//! Radiance's pictures, scene-linear: read only.
//!
//! The library decodes rows of pixels; what the header says of them is done here: `EXPOSURE` and `COLORCORR`,
//! by which values were multiplied, are taken out, X, Y and Z and other primaries become Rec. 709, and rows lie
//! as the line of the resolution says, in any of eight ways.

use glam::{DVec2, DVec3};
use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;
use image::metadata::Orientation;
use std::io::{Cursor, Read};
use std::path::Path;

use super::Coding;
use super::format::Format;
use super::raster::{Pixels, Started, fault, too_small};
use crate::color::{Primaries, xyz_to_rec_709};
use crate::error::{Error, Result};

/// What a header says.
struct Header {
    /// Values of the file over those that are meant.
    factor: DVec3,
    is_xyz: bool,
    primaries: Option<Primaries>,
    /// Whether rows go along y instead of x; whether x and y grow to the left and upwards.
    is_turned: bool,
    flips: [bool; 2],
    /// Pixels of a row of the file, and rows.
    length: u32,
    count: u32,
    /// Where rows begin.
    start: usize,
    notes: Vec<String>,
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    let numbers: Option<Vec<f64>> = text.split_whitespace().map(|n| n.parse().ok()).collect();
    numbers.filter(|numbers| numbers.iter().all(|n| n.is_finite()))
}

fn header(path: &Path, bytes: &[u8]) -> Result<Header> {
    let mut made = Header {
        factor: DVec3::ONE,
        is_xyz: false,
        primaries: None,
        is_turned: false,
        flips: [false; 2],
        length: 0,
        count: 0,
        start: 0,
        notes: Vec::new(),
    };
    let mut at = 0;
    let mut is_resolution = false;
    loop {
        let (start, rest) = (at, &bytes[at..]);
        let Some(end) = rest.iter().take(65_536).position(|byte| *byte == b'\n') else {
            let what = "not a sound Radiance file: its header breaks off";
            return Err(Error::at_byte(path, at as u64, what));
        };
        let line = String::from_utf8_lossy(&rest[..end]);
        let line = line.trim_end_matches('\r');
        let wrong = |what: &str| {
            Error::at_byte(
                path,
                start as u64,
                format!("not a sound Radiance file: {what}: \"{line}\""),
            )
        };
        if is_resolution {
            let words: Vec<&str> = line.split_whitespace().collect();
            let [first, count, second, length] = words[..] else {
                return Err(wrong("this is no resolution, such as -Y 512 +X 1024"));
            };
            let axis = |word: &str| match word {
                "-Y" => Some((1, false)),
                "+Y" => Some((1, true)),
                "+X" => Some((0, false)),
                "-X" => Some((0, true)),
                _ => None,
            };
            let axes = axis(first).zip(axis(second)).filter(|(a, b)| a.0 != b.0);
            let sizes = count.parse().ok().zip(length.parse().ok());
            let (Some((slow, fast)), Some((count, length))) = (axes, sizes) else {
                return Err(wrong("this is no resolution, such as -Y 512 +X 1024"));
            };
            made.is_turned = slow.0 == 0;
            made.flips[slow.0] = slow.1;
            made.flips[fast.0] = fast.1;
            (made.count, made.length, made.start) = (count, length, at + end + 1);
            return Ok(made);
        }
        at += end + 1;
        // Lines without `=` are the magic word and commands. An empty one ends the header.
        let Some((name, value)) = line.split_once('=') else {
            is_resolution = line.is_empty();
            continue;
        };
        let value = value.trim();
        match (name.trim(), numbers(value).as_deref()) {
            ("FORMAT", _) => match value {
                "32-bit_rle_rgbe" => {}
                "32-bit_rle_xyze" => made.is_xyz = true,
                _ => return Err(wrong("a format that is not known")),
            },
            // Each program that changes a picture adds a line: they multiply.
            ("EXPOSURE", Some([exposure])) if *exposure > 0.0 => made.factor *= *exposure,
            ("COLORCORR", Some([r, g, b])) if r.min(*g).min(*b) > 0.0 => {
                made.factor *= DVec3::new(*r, *g, *b);
            }
            ("PRIMARIES", Some([xr, yr, xg, yg, xb, yb, xw, yw])) => {
                made.primaries = Some(Primaries {
                    red: DVec2::new(*xr, *yr),
                    green: DVec2::new(*xg, *yg),
                    blue: DVec2::new(*xb, *yb),
                    white: DVec2::new(*xw, *yw),
                });
            }
            ("PIXASPECT", Some([aspect])) if (aspect - 1.0).abs() > 1e-3 => {
                made.notes
                    .push(format!("its pixels are {aspect} times as high as wide: read as square"));
            }
            ("EXPOSURE" | "COLORCORR" | "PRIMARIES", _) => {
                return Err(wrong("its numbers are wrong"));
            }
            _ => {}
        }
    }
}

pub(super) fn start<'b>(path: &Path, bytes: &'b [u8]) -> Result<Started<'b>> {
    let header = header(path, bytes)?;
    let (length, count) = (header.length, header.count);
    let size = if header.is_turned { (count, length) } else { (length, count) };
    // A run of 127 takes two bytes of each of four parts; older files repeat by one, two, or more.
    let rest = bytes.len() - header.start;
    if (rest as u64).saturating_mul(1 << 24) < u64::from(length) * u64::from(count) {
        return Err(too_small(path, size, bytes));
    }
    let mut notes = header.notes;
    if header.factor != DVec3::ONE {
        let [r, g, b] = header.factor.to_array();
        let by = if r == g && g == b { format!("{r}") } else { format!("{r} {g} {b}") };
        notes.push(format!("its values were multiplied by {by} (EXPOSURE): divided by it"));
    }
    let own = header.primaries.filter(|own| !own.are_rec_709() && !header.is_xyz);
    let matrix = match (header.is_xyz, own) {
        (true, _) => {
            notes.push("its colours are X, Y and Z: converted".to_owned());
            // Radiance's white is that of equal energy.
            Some(xyz_to_rec_709(DVec3::ONE))
        }
        (false, Some(own)) => {
            notes.push("its colours are of primaries of its own: converted".to_owned());
            let what = "not a sound Radiance file: its PRIMARIES span no colours";
            Some(own.to_rec_709().ok_or_else(|| Error::in_file(path, what))?)
        }
        (false, None) => None,
    };
    let name = path.to_owned();
    let decode = move || -> Result<Pixels> {
        // A head with nothing that the library might apply itself, and rows the one way round that
        // it knows.
        let plain = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {count} +X {length}\n");
        let rows = Cursor::new(plain.into_bytes()).chain(&bytes[header.start..]);
        let wrong = |error| fault(&name, Format::Hdr, &error);
        let decoder = HdrDecoder::new(rows).map_err(wrong)?;
        let mut samples = vec![0u8; decoder.total_bytes() as usize];
        decoder.read_image(&mut samples).map_err(wrong)?;
        let (width, height) = (size.0 as usize, size.1 as usize);
        let pixel = |at: usize| {
            let (x, y) = (at % width, at / width);
            let x = if header.flips[0] { width - 1 - x } else { x };
            let y = if header.flips[1] { height - 1 - y } else { y };
            let (row, column) = if header.is_turned { (x, y) } else { (y, x) };
            let from = (row * length as usize + column) * 12;
            let value = |k: usize| {
                let four = &samples[from + 4 * k..][..4];
                f64::from(f32::from_ne_bytes([four[0], four[1], four[2], four[3]]))
            };
            let own = DVec3::new(value(0), value(1), value(2)) / header.factor;
            let [r, g, b] = matrix.map_or(own, |matrix| matrix * own).as_vec3().to_array();
            [r, g, b, 1.0]
        };
        Ok(Pixels::Linear((0..width * height).map(pixel).collect()))
    };
    Ok(Started {
        size,
        samples: "float by shared exponents, red green blue, scene-linear".to_owned(),
        // As the library makes them, and as they are kept.
        pixel: 28,
        coding: Coding::srgb(),
        orientation: Orientation::NoTransforms,
        notes,
        decode: Box::new(decode),
    })
}
