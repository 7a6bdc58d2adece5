//! OpenEXR: all channels, scene-linear, associated alpha, ZIP compression.
//!
//! Colours and normals are half or float as asked; distances and positions are always float, ids
//! always whole numbers. What ids mean is in the attribute `spandrel/names`, one `id name` to a line.

use exr::block::writer::ChunksWriter;
use exr::block::{self, BlockIndex, UncompressedBlock, enumerate_ordered_header_block_indices};
use exr::image::write::layers::{LayersWriter, WritableLayers};
use exr::meta::MetaData;
use exr::meta::attribute::AttributeValue;
use exr::prelude::{
    AnyChannel, AnyChannels, ChannelDescription, Compression, Encoding, FlatSamples,
    Image as ExrImage, ImageAttributes, IntegerBounds, Layer, LayerAttributes, ReadChannels,
    ReadLayers, SampleType, SmallVec, Text, Vec2, f16,
};
use rayon::prelude::*;
use std::io::{Cursor, Seek, Write};
use std::ops::Range;
use std::path::Path;

use super::{Image, Samples, Window};
use crate::error::{Error, Result};

/// The attribute that says what ids mean.
const NAMES: &str = "spandrel/names";

/// Blocks of 16 rows that are packed at once.
const BLOCKS: usize = 64;

/// Samples of the window around all layers of a file, beyond which the layers must fill a quarter of it.
const MOST_APART: usize = 1 << 26;

/// Bytes that one byte of a deflated file can stand for, at most.
const MOST_DEFLATED: u64 = 1032;

/// Writes all channels of a picture.
pub(super) fn write(
    image: &Image,
    half: bool,
    path: &Path,
    out: &mut (impl Write + Seek),
) -> Result<()> {
    let mut channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = SmallVec::new();
    for (name, samples) in image.channels() {
        let exact = name == "Z" || name.starts_with("P.");
        let samples = match samples {
            Samples::Id(ids) => FlatSamples::U32(ids.clone()),
            Samples::Float(values) if half && !exact => {
                FlatSamples::F16(values.par_iter().map(|v| narrowed(*v)).collect())
            }
            Samples::Float(values) => FlatSamples::F32(values.clone()),
        };
        channels.push(AnyChannel::new(name, samples));
    }
    let size = Vec2(image.window.width as usize, image.window.height as usize);
    let mut attributes = LayerAttributes {
        layer_position: Vec2(image.window.x as i32, image.window.y as i32),
        software_name: Some(Text::from("Spandrel")),
        ..LayerAttributes::default()
    };
    if !image.names.is_empty() {
        let names: Vec<String> =
            image.names.iter().map(|(id, name)| format!("{id} {name}")).collect();
        let text = AttributeValue::Text(Text::from(names.join("\n").as_str()));
        attributes.other.insert(Text::from(NAMES), text);
    }
    let encoding = Encoding { compression: Compression::ZIP16, ..Encoding::default() };
    let layer = Layer::new(size, attributes, encoding, AnyChannels::sort(channels));
    let whole = IntegerBounds::from_dimensions((image.size.0 as usize, image.size.1 as usize));
    let image = ExrImage::empty(ImageAttributes::new(whole)).with_layer(layer);
    let headers = image.layer_data.infer_headers(&image.attributes);
    let layers = image.layer_data.create_writer(&headers);
    // The library would start threads of its own; so its blocks are packed by ours, some at a time.
    block::write(out, headers, true, |meta, chunks| {
        let blocks: Vec<_> = enumerate_ordered_header_block_indices(&meta.headers).collect();
        for some in blocks.chunks(BLOCKS) {
            let pack = |(place, index): &(usize, BlockIndex)| {
                let data = layers.extract_uncompressed_block(&meta.headers, *index);
                let block = UncompressedBlock { index: *index, data };
                block.compress_to_chunk(&meta.headers).map(|chunk| (*place, chunk))
            };
            for packed in some.par_iter().map(pack).collect::<Vec<_>>() {
                let (place, chunk) = packed?;
                chunks.write_chunk(place, chunk)?;
            }
        }
        Ok(())
    })
    .map_err(|e| Error::output(path, e))
}

/// Reads all channels of all flat layers; those of a named layer as `layer.channel`. What lies outside of the display
/// window (overscan) is left out; where a layer has no pixels it is 0.
pub(super) fn read(path: &Path) -> Result<Image> {
    let bytes = std::fs::read(path).map_err(|e| Error::file(path, e))?;
    let fault = |e: exr::error::Error| Error::in_file(path, format!("not a sound EXR file: {e}"));
    let meta = MetaData::read_from_buffered(Cursor::new(&bytes), true).map_err(fault)?;
    // Bytes before they were deflated, of all layers.
    let mut all = 0u64;
    for header in &meta.headers {
        if header.deep {
            return Err(Error::in_file(path, "a deep EXR: pictures are read from flat ones"));
        }
        let Vec2(width, height) = header.layer_size;
        let samples = (width as u64).saturating_mul(height as u64);
        let size = |channel: &ChannelDescription| match (channel.sample_type, header.compression) {
            (SampleType::F16, _) => 2,
            (SampleType::F32, Compression::PXR24) => 3,
            (SampleType::F32 | SampleType::U32, _) => 4,
        };
        let of_pixel: u64 = header.channels.list.iter().map(size).sum();
        all = all.saturating_add(samples.saturating_mul(of_pixel));
        if all > MOST_DEFLATED * bytes.len() as u64 {
            let message = format!("{width} by {height} pixels cannot be in {} bytes", bytes.len());
            return Err(Error::in_file(path, message));
        }
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(&bytes))
        .map_err(fault)?;
    if image.layer_data.is_empty() {
        return Err(Error::in_file(path, "an EXR without layers"));
    }
    let display = image.attributes.display_window;
    let size = (display.size.0 as u32, display.size.1 as u32);
    // Of each layer, what lies on the display: its corner there, and its corner and size of its own.
    let shown = |layer: &Layer<AnyChannels<FlatSamples>>| {
        let at = layer.attributes.layer_position - display.position;
        let ends = |at: i32, length: usize, limit: u32| {
            let end = (i64::from(at) + length as i64).clamp(0, i64::from(limit)) as u32;
            (at.max(0) as u32).min(end)..end
        };
        (at, [ends(at.0, layer.size.0, size.0), ends(at.1, layer.size.1, size.1)])
    };
    let parts: Vec<_> = image.layer_data.iter().map(shown).collect();
    let seen = parts.iter().filter(|(_, part)| part.iter().all(|side| !side.is_empty()));
    let around = |a: &Range<u32>, b: &Range<u32>| a.start.min(b.start)..a.end.max(b.end);
    let all = seen.map(|(_, part)| part.clone());
    let Some([columns, rows]) = all.reduce(|a, b| [around(&a[0], &b[0]), around(&a[1], &b[1])])
    else {
        return Err(Error::in_file(path, "all its pixels lie outside of its display window"));
    };
    let window = Window {
        x: columns.start,
        y: rows.start,
        width: columns.end - columns.start,
        height: rows.end - rows.start,
    };
    // Samples of the file, and of all its channels over the whole window.
    let channels = |layer: &Layer<AnyChannels<FlatSamples>>| layer.channel_data.list.len();
    let held = image.layer_data.iter().map(|layer| layer.size.area() * channels(layer)).sum();
    let count: usize = image.layer_data.iter().map(channels).sum();
    if window.area().saturating_mul(count) > MOST_APART.max(4usize.saturating_mul(held)) {
        return Err(Error::in_file(
            path,
            "its layers are small and lie far apart: read them one by one",
        ));
    }
    let mut picture = Image::new(size, window);
    for (layer, (at, part)) in image.layer_data.iter().zip(&parts) {
        for channel in &layer.channel_data.list {
            let name = match &layer.attributes.layer_name {
                Some(layer) => format!("{layer}.{}", channel.name),
                None => channel.name.to_string(),
            };
            if channel.sample_data.len() != layer.size.area() {
                let message =
                    format!("channel {name} has fewer samples than pixels: write it in full");
                return Err(Error::in_file(path, message));
            }
            // From the layer's own pixels to the window, by place; 0 beside them.
            let place = |i: usize| {
                let x = columns.start + (i as u32) % window.width;
                let y = rows.start + (i as u32) / window.width;
                let is_there = part[0].contains(&x) && part[1].contains(&y);
                let own = |place: u32, at: i32| (i64::from(place) - i64::from(at)) as usize;
                is_there.then(|| own(y, at.1) * layer.size.0 + own(x, at.0))
            };
            let places = (0..window.area()).map(place);
            let floats = |of: &dyn Fn(usize) -> f32| {
                Samples::Float(places.clone().map(|place| place.map_or(0.0, of)).collect())
            };
            let samples = match &channel.sample_data {
                FlatSamples::F16(values) => floats(&|i| values[i].to_f32()),
                FlatSamples::F32(values) => floats(&|i| values[i]),
                FlatSamples::U32(values) => {
                    Samples::Id(places.map(|place| place.map_or(0, |i| values[i])).collect())
                }
            };
            picture.insert(&name, samples).map_err(|e| Error::in_file(path, e.to_string()))?;
        }
        if let Some(AttributeValue::Text(names)) = layer.attributes.other.get(&Text::from(NAMES)) {
            let names = names.to_string();
            let pairs = names.lines().filter_map(|line| line.split_once(' '));
            picture
                .names
                .extend(pairs.filter_map(|(id, n)| Some((id.parse().ok()?, n.to_owned()))));
        }
    }
    Ok(picture)
}
/// A value in half precision; what is too large for it is the largest, not infinite.
fn narrowed(value: f32) -> f16 {
    if value.is_finite() {
        f16::from_f32(value.clamp(-65504.0, 65504.0))
    } else {
        f16::from_f32(value)
    }
}
