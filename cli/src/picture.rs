//! `spandrel info` of a picture.

use spandrel_engine::Result;
use spandrel_engine::image::file::{Encoded, Head, Select, largest};
use std::fmt::Write;
use std::path::Path;

use crate::print;

/// Whether a file is a picture, by its first bytes.
pub(crate) fn is_picture(path: &Path) -> bool {
    Encoded::open(path).is_ok()
}

pub(crate) fn info(path: &Path) -> Result<String> {
    let file = Encoded::open(path)?;
    let head = file.head()?;
    let mut out = format!("{}: a picture, {}\n", path.display(), head.format.name());
    let (width, height) = head.size;
    let _ = writeln!(
        out,
        "  {width} x {height} pixels, {}, {} decoded",
        head.samples,
        print::bytes(head.bytes)
    );
    layers(&mut out, &head);
    let mut notes = head.notes;
    if head.bytes > largest() {
        notes.push(format!(
            "larger than a picture may be ({}): --largest-picture allows more",
            print::bytes(largest())
        ));
    } else {
        // All of it is decoded: what is damaged or not finite shows.
        let all = file.image(&Select::all(), None);
        if let Err(error) = &all {
            notes.push(error.message());
        }
        for (name, samples) in all.iter().flat_map(|(image, _)| image.channels()) {
            let values = samples.floats().unwrap_or_default();
            let count = values.iter().filter(|v| !v.is_finite()).count();
            if count > 0 {
                notes.push(format!("channel {name}: {} not finite", print::count(count, "sample")));
            }
        }
    }
    for note in &notes {
        let _ = writeln!(out, "note: {note}");
    }
    Ok(out)
}

fn layers(out: &mut String, head: &Head) {
    let Some(layers) = &head.layers else { return };
    for layer in &layers.layers {
        let name = if layer.name.is_empty() {
            "main layer".to_owned()
        } else {
            format!("layer \"{}\"", layer.name)
        };
        let part = layer.part.as_ref().map(|part| format!(", part \"{part}\"")).unwrap_or_default();
        let view = match &*layer.view {
            "" => String::new(),
            view => format!(", view \"{view}\""),
        };
        let mut line = String::new();
        let mut last = "";
        for (component, kind) in layer.components.iter().rev() {
            let kind_words = if *kind == last { String::new() } else { format!(" {kind}") };
            last = kind;
            line = format!(" {component}{kind_words}{line}");
        }
        let _ = writeln!(out, "  {name}{part}{view}:{line}");
    }
    for part in &layers.deep {
        let _ = writeln!(out, "  part \"{part}\": deep");
    }
}
