//! PNG, 8 or 16 bits, sRGB, with straight alpha.

use glam::DVec2;
use image::metadata::Orientation;
use png::{BitDepth, ColorType, Decoder, DecodingError, Encoder, Limits, Transformations};
use std::io::{Cursor, Write};
use std::path::Path;

use super::format::{Format, largest};
use super::raster::{Pixels, Started, too_small};
use super::{Coded, Codes, Coding, Image, Layout};
use crate::color::{Primaries, encode_srgb};
use crate::error::{Error, Result};

/// The most bytes that a byte of a deflated file stands for.
const MOST_DEFLATED: u64 = 1032;

/// Rows that are encoded at once.
const ROWS: u32 = 64;

/// By how much a code of 8 bits is moved before it is rounded, less than half a step, so that what is a code stays it:
/// a gradient has no bands. By place alone, so that parts of a picture join (the gradient noise of Jimenez, 2014).
fn dither(x: u32, y: u32, channel: usize) -> f32 {
    let along = 0.067_110_56 * (f64::from(x) + 5.588_238 * channel as f64);
    let noise = (52.982_918_9 * (along + 0.005_837_15 * f64::from(y)).fract()).fract();
    0.98 * (noise as f32 - 0.5)
}

/// Writes the colour and alpha of a picture; `bits` is 8 or 16.
pub(super) fn write(
    image: &Image,
    bits: u32,
    is_dithered: bool,
    path: &Path,
    out: &mut impl Write,
) -> Result<()> {
    let (width, height) = (image.window.width, image.window.height);
    let fault = |e: png::EncodingError| Error::output(path, e);
    if let Some(Coded {
        layout: Layout::Palette(colors), codes: Codes::Bytes(numbers), coding, ..
    }) = image.coded().map(|coded| &**coded)
        && bits == 8
        && coding.is(&Coding::srgb())
    {
        return write_numbers(colors, numbers, (width, height), path, out);
    }
    let mut encoder = Encoder::new(out, width, height);
    encoder.set_color(ColorType::Rgba);
    encoder.set_depth(if bits == 16 { BitDepth::Sixteen } else { BitDepth::Eight });
    // Without it some viewers guess a gamma.
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.set_compression(png::Compression::Balanced);
    let mut writer = encoder.write_header().map_err(fault)?;
    let mut stream = writer.stream_writer().map_err(fault)?;
    for top in (0..height).step_by(ROWS as usize) {
        let mut bytes = Vec::new();
        let rows = top..(top + ROWS).min(height);
        let places = rows.clone().flat_map(|y| (0..width).map(move |x| (x, y)));
        for ([r, g, b, a], (x, y)) in image.pixels_of(rows).zip(places) {
            let (x, y) = (image.window.x + x, image.window.y + y);
            let alpha = if a > 0.0 { a.min(1.0) } else { 0.0 };
            // PNG has straight alpha, and colours are coded after the division.
            let straight = if alpha > 0.0 { 1.0 / alpha } else { 0.0 };
            let [r, g, b] = [r, g, b].map(|v| encode_srgb(v * straight));
            for (channel, v) in [r, g, b, alpha].into_iter().enumerate() {
                if bits == 8 && is_dithered && channel < 3 {
                    bytes.push((v * 255.0 + dither(x, y, channel)).round() as u8);
                } else if bits == 16 {
                    bytes.extend(((v * 65_535.0).round() as u16).to_be_bytes());
                } else {
                    bytes.push((v * 255.0).round() as u8);
                }
            }
        }
        stream.write_all(&bytes).map_err(|e| Error::output(path, e))?;
    }
    stream.finish().map_err(fault)?;
    writer.finish().map_err(fault)
}

/// Writes a picture that is numbers of colours as such.
fn write_numbers(
    colors: &[[u8; 4]],
    numbers: &[u8],
    (width, height): (u32, u32),
    path: &Path,
    out: &mut impl Write,
) -> Result<()> {
    let fault = |e: png::EncodingError| Error::output(path, e);
    let mut encoder = Encoder::new(out, width, height);
    encoder.set_color(ColorType::Indexed);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.set_compression(png::Compression::Balanced);
    // What goes beyond the last colour is black.
    let all = colors.len().max(numbers.iter().max().map_or(0, |most| usize::from(*most) + 1));
    let colors = || colors.iter().copied().chain(std::iter::repeat([0, 0, 0, 255])).take(all);
    encoder.set_palette(colors().flat_map(|[r, g, b, _]| [r, g, b]).collect::<Vec<u8>>());
    if colors().any(|[.., alpha]| alpha < 255) {
        encoder.set_trns(colors().map(|[.., alpha]| alpha).collect::<Vec<u8>>());
    }
    let mut writer = encoder.write_header().map_err(fault)?;
    writer.write_image_data(numbers).map_err(fault)?;
    writer.finish().map_err(fault)
}

/// The first palette must have three bytes to a colour: the decoder relies on it.
fn check_palette(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut at = 8usize;
    while let Some([a, b, c, d, name @ ..]) = bytes.get(at..at + 8) {
        let length = u32::from_be_bytes([*a, *b, *c, *d]) as usize;
        if name == b"PLTE" && !length.is_multiple_of(3) {
            let what =
                format!("not a sound PNG file: its palette has {length} bytes, no multiple of 3");
            return Err(Error::at_byte(path, at as u64, what));
        }
        let Some(next) = at.checked_add(length).and_then(|at| at.checked_add(12)) else { break };
        at = next;
    }
    Ok(())
}

fn fault(path: &Path, error: &DecodingError) -> Error {
    Error::in_file(path, format!("not a sound {} file: {error}", Format::Png.name()))
}

pub(super) fn start<'b>(path: &Path, bytes: &'b [u8]) -> Result<Started<'b>> {
    check_palette(path, bytes)?;
    let limits = Limits { bytes: usize::try_from(largest()).unwrap_or(usize::MAX) };
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), limits);
    let (is_indexed, packed, size) = {
        let info = decoder.read_header_info().map_err(|e| fault(path, &e))?;
        let row = u64::from(info.width) * info.bits_per_pixel() as u64 / 8;
        (info.color_type == ColorType::Indexed, row * u64::from(info.height), info.size())
    };
    // Before any memory is taken: a head may claim anything.
    if packed / MOST_DEFLATED > bytes.len() as u64 {
        return Err(too_small(path, size, bytes));
    }
    // The numbers of a palette's colours are kept; all else becomes 8 or 16 bits.
    let change = if is_indexed { Transformations::IDENTITY } else { Transformations::EXPAND };
    decoder.set_transformations(change);
    let mut reader = decoder.read_info().map_err(|e| fault(path, &e))?;
    let info = reader.info();
    let own_bits = info.bit_depth as u32;
    let (color, depth) = reader.output_color_type();
    let layout = match color {
        ColorType::Grayscale => Layout::Grey,
        ColorType::GrayscaleAlpha => Layout::GreyAlpha,
        ColorType::Rgb => Layout::Rgb,
        ColorType::Rgba => Layout::Rgba,
        ColorType::Indexed => {
            let colors = info.palette.as_deref().unwrap_or_default();
            if colors.is_empty() {
                let what = "not a sound PNG file: it has numbers of colours and no palette";
                return Err(Error::in_file(path, what));
            }
            let alphas = info.trns.as_deref().unwrap_or_default();
            let color = |(k, rgb): (usize, &[u8])| {
                [rgb[0], rgb[1], rgb[2], alphas.get(k).copied().unwrap_or(255)]
            };
            Layout::Palette(colors.chunks_exact(3).enumerate().map(color).collect())
        }
    };
    let mut notes = Vec::new();
    let coding = coding(path, info, layout.channels() < 3, &mut notes)?;
    if info.is_animated() {
        notes.push("it moves: its first picture is read".to_owned());
    }
    let exif = info.exif_metadata.as_deref();
    let orientation = exif.and_then(Orientation::from_exif_chunk);
    let words = match &layout {
        Layout::Grey => "grey".to_owned(),
        Layout::GreyAlpha => "grey and alpha".to_owned(),
        Layout::Rgb => "red green blue".to_owned(),
        Layout::Rgba => "red green blue alpha".to_owned(),
        Layout::Palette(colors) => format!("numbers of {} colours", colors.len()),
    };
    let plural = if own_bits == 1 { "bit" } else { "bits" };
    let is_wide = depth == BitDepth::Sixteen;
    let pixel = layout.channels() as u64 * if is_wide { 2 } else { 1 };
    let name = path.to_owned();
    let decode = move || -> Result<Pixels> {
        let length = reader.output_buffer_size().unwrap_or(usize::MAX);
        // What its head says is known to fit: nothing greater is taken.
        let most = u64::from(size.0).saturating_mul(u64::from(size.1)).saturating_mul(pixel);
        if length as u64 > most.max(1) {
            return Err(Error::in_file(&name, "not a sound PNG file: its rows are too long"));
        }
        let mut rows = vec![0u8; length];
        reader.next_frame(&mut rows).map_err(|e| fault(&name, &e))?;
        // What follows is read too: a file that breaks off is told.
        reader.finish().map_err(|e| fault(&name, &e))?;
        let codes = if is_wide {
            let word = |pair: &[u8]| u16::from_be_bytes([pair[0], pair[1]]);
            Codes::Words(rows.chunks_exact(2).map(word).collect())
        } else if is_indexed && own_bits < 8 {
            Codes::Bytes(unpacked(&rows, size, own_bits))
        } else {
            Codes::Bytes(rows)
        };
        Ok(Pixels::Coded(layout, codes))
    };
    Ok(Started {
        size,
        samples: format!("{own_bits} {plural}, {words}"),
        pixel,
        coding,
        orientation: orientation.unwrap_or(Orientation::NoTransforms),
        notes,
        decode: Box::new(decode),
    })
}

/// One byte for each of the numbers that rows hold in fewer bits.
fn unpacked(rows: &[u8], (width, height): (u32, u32), bits: u32) -> Vec<u8> {
    let row = (width as usize * bits as usize).div_ceil(8);
    let per_byte = 8 / bits;
    let mut numbers = Vec::with_capacity(width as usize * height as usize);
    for row in rows.chunks_exact(row) {
        numbers.extend((0..width).map(|x| {
            // The leftmost pixel is in the high bits.
            let shift = 8 - bits - x % per_byte * bits;
            (row[(x / per_byte) as usize] >> shift) & ((1u16 << bits) - 1) as u8
        }));
    }
    numbers
}

/// What its codes mean: of what the file says of it, what is most exact.
fn coding(
    path: &Path,
    info: &png::Info<'_>,
    is_grey: bool,
    notes: &mut Vec<String>,
) -> Result<Coding> {
    let wrong = |what: String| Error::in_file(path, what);
    if let Some(points) = &info.coding_independent_code_points {
        let coding = Coding::of_code_points(points.color_primaries, points.transfer_function);
        return coding.map_err(wrong);
    }
    if let Some(profile) = info.icc_profile.as_deref() {
        match Coding::of_profile(profile, if is_grey { 1 } else { 3 }) {
            Ok(own) => return Ok(own.unwrap_or_else(Coding::srgb)),
            Err(what) => {
                notes.push(format!("its profile is not used ({what}): it is read as sRGB"));
                return Ok(Coding::srgb());
            }
        }
    }
    if info.srgb.is_some() {
        return Ok(Coding::srgb());
    }
    let primaries = info.chrm_chunk.map(|own| {
        let xy = |(x, y): (png::ScaledFloat, png::ScaledFloat)| {
            DVec2::new(f64::from(x.into_value()), f64::from(y.into_value()))
        };
        let (red, green, blue, white) = (xy(own.red), xy(own.green), xy(own.blue), xy(own.white));
        Primaries { red, green, blue, white }
    });
    let made = match (info.gama_chunk, primaries) {
        (Some(gamma), primaries) => {
            Coding::of_gamma(1.0 / f64::from(gamma.into_value()), primaries.filter(|_| !is_grey))
        }
        (None, Some(primaries)) if !is_grey => Coding::of_primaries(primaries),
        _ => Ok(Coding::srgb()),
    };
    Ok(made.unwrap_or_else(|what| {
        notes.push(format!("what it says of its colours is not used ({what}): it is read as sRGB"));
        Coding::srgb()
    }))
}
