//! From the bytes of a file to the samples of channels: only of those that are wanted.

use exr::block::chunk::TileCoordinates;
use exr::compression::Compression;
use exr::meta::attribute::{ChannelDescription, IntegerBounds};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::{LayerAttributes, SampleType, Vec2, f16};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::Path;

use super::super::format::check_largest;
use super::b44;
use crate::error::{Error, Result};
use crate::open;
use crate::watch::Watch;

/// Chunks that are unpacked at once.
const CHUNKS: usize = 64;

/// A file whose head is read.
pub(super) struct File<'b> {
    path: &'b Path,
    bytes: &'b [u8],
    pub(super) meta: MetaData,
    /// Where the first chunk lies.
    first: usize,
}

/// The samples of a channel, row by row over the data window of its part; fewer where it is subsampled.
pub(super) enum Plane {
    Half(Vec<f16>),
    Float(Vec<f32>),
    Whole(Vec<u32>),
}

fn fault(path: &Path, error: &exr::error::Error) -> Error {
    Error::in_file(path, format!("not a sound OpenEXR file: {error}"))
}

/// How many bytes one byte of a file stands for, at most.
fn most_packed(compression: Compression) -> u64 {
    match compression {
        Compression::Uncompressed => 1,
        Compression::RLE => 64,
        Compression::B44 | Compression::B44A => 12,
        Compression::PIZ => 4096,
        // Deflated, and of PXR24 four bytes as three.
        Compression::ZIP1 | Compression::ZIP16 | Compression::PXR24 => 1400,
        // A byte of a block of 64 pixels, deflated.
        _ => 66_048,
    }
}

/// Samples of a channel along a side of a length.
fn count(length: usize, sampling: usize) -> usize {
    length / sampling.max(1)
}

/// The bytes of a channel's samples.
pub(super) fn bytes_of(header: &Header, channel: &ChannelDescription) -> u64 {
    let samples = count(header.layer_size.0, channel.sampling.0) as u64
        * count(header.layer_size.1, channel.sampling.1) as u64;
    samples.saturating_mul(channel.sample_type.bytes_per_sample() as u64)
}

/// Where the headers of a file end.
fn end_of_headers(bytes: &[u8], is_multi_part: bool) -> Option<usize> {
    let text = |at: usize| {
        let length = bytes.get(at..)?.iter().take(4096).position(|byte| *byte == 0)?;
        Some(at + length + 1)
    };
    // Behind the magic number and the version. A header is a list of name, type, size and value,
    // which an empty name ends; one more empty name ends the headers of several parts.
    let mut at = 8;
    loop {
        if *bytes.get(at)? == 0 {
            at += 1;
            if !is_multi_part || *bytes.get(at)? == 0 {
                return Some(at + usize::from(is_multi_part));
            }
        }
        at = text(text(at)?)?;
        let size = i32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?);
        at = at.checked_add(4)?.checked_add(usize::try_from(size).ok()?)?;
    }
}

impl<'b> File<'b> {
    pub(super) fn open(path: &'b Path, bytes: &'b [u8]) -> Result<File<'b>> {
        let meta = MetaData::read_from_buffered(bytes, false).map_err(|e| fault(path, &e))?;
        let end = end_of_headers(bytes, meta.requirements.is_multilayer());
        let end = end
            .ok_or_else(|| Error::in_file(path, "not a sound OpenEXR file: its head breaks off"))?;
        let chunks = meta.headers.iter().fold(0usize, |sum, h| sum.saturating_add(h.chunk_count));
        // The table of offsets is passed over: programs that stop in between leave it empty, and
        // chunks say themselves where they belong.
        let first = end.saturating_add(chunks.saturating_mul(8));
        // A head of a few bytes must not make us take memory for pictures that cannot be there.
        let mut packed = 0.0;
        for header in &meta.headers {
            let Vec2(width, height) = header.layer_size;
            if width.min(height) == 0 || width.max(height) > 1 << 24 {
                let what =
                    format!("not a sound OpenEXR file: a part of {width} by {height} pixels");
                return Err(Error::in_file(path, what));
            }
            let wrong = header.channels.list.iter().find(|channel| {
                let Vec2(across, down) = channel.sampling;
                let side = |sampling: usize, length: usize| {
                    sampling == 0 || sampling > length || !length.is_multiple_of(sampling)
                };
                side(across, width) || side(down, height)
            });
            if let Some(channel) = wrong {
                let Vec2(across, down) = channel.sampling;
                let what = format!(
                    "not a sound OpenEXR file: channel {} has a sample for every {across} by {down} of \
                     {width} by {height} pixels",
                    channel.name
                );
                return Err(Error::in_file(path, what));
            }
            if !header.deep {
                let all: u64 = header.channels.list.iter().map(|c| bytes_of(header, c)).sum();
                packed += all as f64 / most_packed(header.compression) as f64;
            }
        }
        let size = meta.headers.first().map_or(Vec2(0, 0), |header| header.layer_size);
        let is_short = first.saturating_add(chunks.saturating_mul(8)) > bytes.len();
        if is_short || packed > bytes.len() as f64 {
            let message = format!(
                "{} by {} pixels cannot be in {} bytes: it is damaged, or not whole",
                size.0,
                size.1,
                bytes.len()
            );
            return Err(Error::in_file(path, message));
        }
        Ok(File { path, bytes, meta, first })
    }

    pub(super) fn header(&self, part: usize) -> &Header {
        &self.meta.headers[part]
    }

    /// The samples of some channels of a part, each by its number there.
    pub(super) fn planes(&self, part: usize, wanted: &[usize]) -> Result<Vec<Plane>> {
        let header = self.header(part);
        let channels = &header.channels.list;
        let bytes: u64 = wanted.iter().map(|at| bytes_of(header, &channels[*at])).sum();
        let Vec2(width, height) = header.layer_size;
        check_largest(self.path, [width as u64, height as u64], bytes)?;
        let mut planes: Vec<Plane> = wanted
            .iter()
            .map(|at| {
                let channel = &channels[*at];
                let samples = count(width, channel.sampling.0) * count(height, channel.sampling.1);
                match channel.sample_type {
                    SampleType::F16 => Plane::Half(vec![f16::ZERO; samples]),
                    SampleType::F32 => Plane::Float(vec![0.0; samples]),
                    SampleType::U32 => Plane::Whole(vec![0; samples]),
                }
            })
            .collect();
        let chunks = self.chunks(part)?;
        // What chunks need to be unpacked, without what the file says of its picture.
        let bare = Header {
            own_attributes: LayerAttributes {
                layer_position: header.own_attributes.layer_position,
                ..LayerAttributes::default()
            },
            ..header.clone()
        };
        let watch = Watch::current();
        for some in chunks.chunks(CHUNKS) {
            watch.check()?;
            let unpack = |(bounds, packed): &(IntegerBounds, &[u8])| {
                open::guarded(|| unpacked(&bare, *bounds, packed))
                    .map_err(|broke| Error::in_file(self.path, broke))?
                    .map_err(|e| fault(self.path, &e))
            };
            let unpacked: Vec<Result<Vec<u8>>> = some.par_iter().map(unpack).collect();
            for ((bounds, _), rows) in some.iter().zip(unpacked) {
                lay(header, wanted, *bounds, &rows?, &mut planes);
            }
        }
        Ok(planes)
    }

    /// The chunks of a part, of its greatest size: the pixels of each, and its bytes.
    fn chunks(&self, part: usize) -> Result<Vec<(IntegerBounds, &'b [u8])>> {
        let is_multi_part = self.meta.requirements.is_multilayer();
        let mut found = Vec::new();
        let mut known = BTreeSet::new();
        let mut at = self.first;
        while at < self.bytes.len() {
            let start = at;
            let breaks_off = || {
                let what = "not a sound OpenEXR file: it breaks off here: copy it again";
                Error::at_byte(self.path, start as u64, what)
            };
            let wrong = |what: &str| {
                Error::at_byte(self.path, start as u64, format!("not a sound OpenEXR file: {what}"))
            };
            let mut next = at;
            let mut number = || -> Option<i32> {
                let four = self.bytes.get(next..next.checked_add(4)?)?;
                next += 4;
                Some(i32::from_le_bytes(four.try_into().ok()?))
            };
            // Only chunks of several parts begin with the number of theirs.
            let own = if is_multi_part { number().ok_or_else(breaks_off)? } else { 0 };
            let own = usize::try_from(own).ok().filter(|own| *own < self.meta.headers.len());
            let own = own.ok_or_else(|| wrong("a chunk of a part that is not there"))?;
            let header = self.header(own);
            let tile = match header.blocks {
                BlockDescription::Tiles(_) => {
                    let mut place = || {
                        number()
                            .ok_or_else(breaks_off)
                            .map(|n| usize::try_from(n).unwrap_or(usize::MAX))
                    };
                    let (x, y, across, down) = (place()?, place()?, place()?, place()?);
                    TileCoordinates { tile_index: Vec2(x, y), level_index: Vec2(across, down) }
                }
                BlockDescription::ScanLines => {
                    let y = number().ok_or_else(breaks_off)?;
                    let tile = header.get_scan_line_block_tile_coordinates(y);
                    tile.map_err(|e| wrong(&e.to_string()))?
                }
            };
            let length = if header.deep {
                // Its table of samples, its samples, and their length when they are unpacked.
                let mut long = || {
                    let low = number().ok_or_else(breaks_off)? as u32;
                    let high = number().ok_or_else(breaks_off)? as u32;
                    Ok::<u64, Error>(u64::from(high) << 32 | u64::from(low))
                };
                let (table, samples, _) = (long()?, long()?, long()?);
                table.saturating_add(samples)
            } else {
                number().ok_or_else(breaks_off)? as u32 as u64
            };
            let end = usize::try_from(length).ok().and_then(|length| next.checked_add(length));
            let packed = end.and_then(|end| self.bytes.get(next..end)).ok_or_else(breaks_off)?;
            at = next + packed.len();
            let is_first = tile.level_index == Vec2(0, 0);
            if own == part && is_first {
                let bounds = header.get_absolute_block_pixel_coordinates(tile);
                let bounds = bounds.map_err(|e| wrong(&e.to_string()))?;
                bounds.validate(Some(header.layer_size)).map_err(|e| wrong(&e.to_string()))?;
                // A chunk that comes twice must not stand for one that is missing.
                if known.insert((tile.tile_index.0, tile.tile_index.1)) {
                    found.push((bounds, packed));
                }
            }
        }
        let header = self.header(part);
        let pixels: usize = found.iter().map(|(bounds, _)| bounds.size.area()).sum();
        if pixels < header.layer_size.area() {
            let missing = header.layer_size.area() - pixels;
            let what = format!(
                "not a sound OpenEXR file: {missing} of its {} pixels are missing: it was not finished, or not \
                 copied whole",
                header.layer_size.area()
            );
            return Err(Error::in_file(self.path, what));
        }
        Ok(found)
    }
}

/// The rows of a chunk: of each row, one channel after the other.
fn unpacked(header: &Header, bounds: IntegerBounds, packed: &[u8]) -> exr::error::Result<Vec<u8>> {
    let unpack = |header: &Header| {
        header.compression.decompress_image_section_from_le(header, packed.to_vec(), bounds, false)
    };
    if header.channels.list.iter().all(|channel| channel.sampling == Vec2(1, 1)) {
        return unpack(header);
    }
    // The library takes a chunk's length from the bytes of a pixel: here, of all of them, so many on the average.
    let top = bounds.position.1 as usize;
    let bytes: usize = (top..top + bounds.size.1)
        .map(|y| {
            let row = header.channels.list.iter().filter(|c| y.is_multiple_of(c.sampling.1));
            row.map(|c| count(bounds.size.0, c.sampling.0) * c.sample_type.bytes_per_sample())
                .sum::<usize>()
        })
        .sum();
    // A chunk that would not become smaller is stored as it is.
    let is_b44 = matches!(header.compression, Compression::B44 | Compression::B44A);
    if is_b44 && packed.len() < bytes {
        let broken = || exr::error::Error::Invalid("a chunk breaks off".into());
        return b44::unpacked(header, bounds, packed).ok_or_else(broken);
    }
    if !bytes.is_multiple_of(bounds.size.area()) {
        return Err(exr::error::Error::NotSupported("such subsampling".into()));
    }
    let mut header = header.clone();
    header.channels.bytes_per_pixel = bytes / bounds.size.area();
    unpack(&header)
}

/// Lays the rows of a chunk into planes.
fn lay(
    header: &Header,
    wanted: &[usize],
    bounds: IntegerBounds,
    rows: &[u8],
    planes: &mut [Plane],
) {
    let (left, top) = (bounds.position.0 as usize, bounds.position.1 as usize);
    let mut at = 0;
    for y in top..top + bounds.size.1 {
        for (number, channel) in header.channels.list.iter().enumerate() {
            let Vec2(across, down) = channel.sampling;
            // Rows between those that a subsampled channel has hold nothing of it.
            if !y.is_multiple_of(down) {
                continue;
            }
            let samples = count(bounds.size.0, across);
            let length = samples * channel.sample_type.bytes_per_sample();
            let row = &rows[at..at + length];
            at += length;
            let Some(own) = wanted.iter().position(|wanted| *wanted == number) else { continue };
            let start = y / down * count(header.layer_size.0, across) + left / across;
            match &mut planes[own] {
                Plane::Half(to) => {
                    let two = |v: &[u8]| f16::from_ne_bytes([v[0], v[1]]);
                    let row = row.chunks_exact(2).map(two);
                    to[start..start + samples].iter_mut().zip(row).for_each(|(to, v)| *to = v);
                }
                Plane::Float(to) => {
                    let four = |v: &[u8]| f32::from_ne_bytes([v[0], v[1], v[2], v[3]]);
                    let row = row.chunks_exact(4).map(four);
                    to[start..start + samples].iter_mut().zip(row).for_each(|(to, v)| *to = v);
                }
                Plane::Whole(to) => {
                    let four = |v: &[u8]| u32::from_ne_bytes([v[0], v[1], v[2], v[3]]);
                    let row = row.chunks_exact(4).map(four);
                    to[start..start + samples].iter_mut().zip(row).for_each(|(to, v)| *to = v);
                }
            }
        }
    }
}
