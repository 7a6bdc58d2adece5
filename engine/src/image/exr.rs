//! OpenEXR: all channels, scene-linear, associated alpha, ZIP compression.
//!
//! Colours and normals are half or float as asked; distances and positions are always float, ids
//! always whole numbers. What ids mean is in the attribute `spandrel/names`, one `id name` to a line.

use exr::prelude::{
    AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, Image as ExrImage,
    ImageAttributes, IntegerBounds, Layer, LayerAttributes, SmallVec, Text, Vec2, WritableImage,
    f16,
};
use std::io::{Seek, Write};
use std::path::Path;

use super::{Image, Samples};
use crate::error::{Error, Result};

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
                FlatSamples::F16(values.iter().map(|v| f16::from_f32(*v)).collect())
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
        let text =
            exr::meta::attribute::AttributeValue::Text(Text::from(names.join("\n").as_str()));
        attributes.other.insert(Text::from("spandrel/names"), text);
    }
    let encoding = Encoding { compression: Compression::ZIP16, ..Encoding::default() };
    let layer = Layer::new(size, attributes, encoding, AnyChannels::sort(channels));
    let whole = IntegerBounds::from_dimensions((image.size.0 as usize, image.size.1 as usize));
    ExrImage::empty(ImageAttributes::new(whole))
        .with_layer(layer)
        .write()
        // The library would start threads of its own.
        .non_parallel()
        .to_buffered(out)
        .map_err(|e| Error::output(path, e))
}
