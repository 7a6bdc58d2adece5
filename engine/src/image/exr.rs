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
    AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, Image as ExrImage,
    ImageAttributes, IntegerBounds, Layer, LayerAttributes, ReadChannels, ReadLayers, SmallVec,
    Text, Vec2, f16,
};
use rayon::prelude::*;
use std::io::{Cursor, Seek, Write};
use std::path::Path;

use super::{Image, Samples, Window};
use crate::error::{Error, Result};

/// The attribute that says what ids mean.
const NAMES: &str = "spandrel/names";

/// Blocks of 16 rows that are packed at once.
const BLOCKS: usize = 64;

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

/// Reads all channels of all flat layers; those of a named layer as `layer.channel`. What lies outside
/// of the first layer's window is left out.
pub(super) fn read(path: &Path) -> Result<Image> {
    let bytes = std::fs::read(path).map_err(|e| Error::file(path, e))?;
    let fault = |e: exr::error::Error| Error::in_file(path, format!("not a sound EXR file: {e}"));
    let meta = MetaData::read_from_buffered(Cursor::new(&bytes), true).map_err(fault)?;
    for header in &meta.headers {
        let Vec2(width, height) = header.layer_size;
        let samples = (width as u64).saturating_mul(height as u64);
        let all = samples.saturating_mul(4 * header.channels.list.len() as u64);
        if all > MOST_DEFLATED * bytes.len() as u64 {
            let message = format!("{width} by {height} pixels cannot be in {} bytes", bytes.len());
            return Err(Error::in_file(path, message));
        }
        if header.deep {
            return Err(Error::in_file(path, "a deep EXR: pictures are read from flat ones"));
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
    let Some(first) = image.layer_data.first() else {
        return Err(Error::in_file(path, "an EXR without layers"));
    };
    let display = image.attributes.display_window;
    let corner = first.attributes.layer_position - display.position;
    let (Ok(x), Ok(y)) = (u32::try_from(corner.0), u32::try_from(corner.1)) else {
        return Err(Error::in_file(path, "its pixels begin outside of its display window"));
    };
    let (width, height) = (first.size.0 as u32, first.size.1 as u32);
    let size = (display.size.0 as u32, display.size.1 as u32);
    let mut picture = Image::new(size, Window { x, y, width, height });
    for layer in image.layer_data.iter().filter(|layer| layer.size == first.size) {
        for channel in &layer.channel_data.list {
            let name = match &layer.attributes.layer_name {
                Some(layer) => format!("{layer}.{}", channel.name),
                None => channel.name.to_string(),
            };
            let samples = match &channel.sample_data {
                FlatSamples::F16(values) => {
                    Samples::Float(values.iter().map(|v| v.to_f32()).collect())
                }
                FlatSamples::F32(values) => Samples::Float(values.clone()),
                FlatSamples::U32(values) => Samples::Id(values.clone()),
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
