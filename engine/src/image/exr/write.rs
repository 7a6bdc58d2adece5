//! Writing OpenEXR: scene-linear, associated alpha, ZIP compression.
//!
//! What has 32 bits in the file that it was read from keeps them; what is computed is half or float as asked.
//! Distances and positions are always float, ids always whole numbers.

use exr::block::writer::ChunksWriter;
use exr::block::{self, BlockIndex, UncompressedBlock, enumerate_ordered_header_block_indices};
use exr::image::write::layers::{LayersWriter, WritableLayers};
use exr::meta::attribute::AttributeValue;
use exr::prelude::{
    AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, Image as ExrImage,
    ImageAttributes, IntegerBounds, Layer, LayerAttributes, SmallVec, Text, Vec2, f16,
};
use rayon::prelude::*;
use std::io::{Seek, Write};
use std::path::Path;

use super::super::{Channel, Image, Samples};
use super::NAMES;
use crate::error::{Error, Result};

/// Blocks of 16 rows that are packed at once.
const BLOCKS: usize = 64;

/// Writes all channels of a picture, with 16 or 32 bits, or as they are best.
pub(in crate::image) fn write(
    image: &Image,
    bits: Option<u32>,
    path: &Path,
    out: &mut (impl Write + Seek),
) -> Result<()> {
    let mut channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = SmallVec::new();
    for (name, samples) in image.channels() {
        channels.push(AnyChannel::new(name, stored(name, samples, bits)));
    }
    let size = Vec2(image.window.width as usize, image.window.height as usize);
    let kept = image.attributes.as_deref();
    let mut attributes = LayerAttributes {
        layer_position: Vec2(image.window.x as i32, image.window.y as i32),
        software_name: Some(Text::from(concat!("Spandrel ", env!("CARGO_PKG_VERSION")))),
        ..kept.map_or_else(LayerAttributes::default, |kept| kept.layer.clone())
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
    let shared = ImageAttributes {
        display_window: whole,
        ..kept.map_or_else(|| ImageAttributes::new(whole), |kept| kept.image.clone())
    };
    let image = ExrImage::empty(shared).with_layer(layer);
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

/// The samples of a channel as they are stored.
fn stored(name: &str, samples: &Samples, bits: Option<u32>) -> FlatSamples {
    if let Samples::Id(ids) = samples {
        return FlatSamples::U32(ids.clone());
    }
    let is_exact = match bits {
        Some(32) => true,
        // The number of bits is about colours: other numbers keep those that their file had.
        Some(_) => samples.is_exact() && !Channel::is_color(name),
        None => samples.is_exact(),
    };
    match samples.halves() {
        Some(halves) if !is_exact => FlatSamples::F16(halves.to_vec()),
        _ => {
            let values = samples.floats().unwrap_or_default();
            if is_exact || Channel::is_exact(name) {
                FlatSamples::F32(values.to_vec())
            } else {
                FlatSamples::F16(values.par_iter().map(|v| narrowed(*v)).collect())
            }
        }
    }
}

/// A value in half precision; what is too large for it is the largest, not infinite.
fn narrowed(value: f32) -> f16 {
    if value.is_finite() {
        f16::from_f32(value.clamp(-65504.0, 65504.0))
    } else {
        f16::from_f32(value)
    }
}
