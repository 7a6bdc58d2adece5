//! Reading OpenEXR.

use exr::meta::attribute::{AttributeValue, Chromaticities};
use exr::meta::header::Header;
use exr::prelude::{Text, Vec2};
use glam::{DMat3, DVec2, DVec3};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use super::chunks::{File, Plane, bytes_of};
use super::layers::{Channel, Layers, Recipe, Select, deep};
use super::{Attributes, NAMES};
use crate::color::{Primaries, REC_709};
use crate::error::{Error, Result};
use crate::image::Channel as PictureChannel;
use crate::image::format::{Format, check_largest};
use crate::image::head::Head;
use crate::image::{Image, Samples, Window};

/// What the file of a picture says of it.
pub(in crate::image) fn head(path: &Path, bytes: &[u8]) -> Result<Head> {
    let file = File::open(path, bytes)?;
    let headers = &file.meta.headers;
    let layers = Layers::of(headers);
    let first = headers.first().ok_or_else(|| Error::in_file(path, "an OpenEXR without parts"))?;
    let display = first.shared_attributes.display_window.size;
    let size = (display.0 as u32, display.1 as u32);
    let of_all = |header: &Header| -> u64 {
        header.channels.list.iter().map(|channel| bytes_of(header, channel)).sum()
    };
    let bytes = headers.iter().filter(|h| !h.deep).map(of_all).fold(0, u64::saturating_add);
    let mut notes = Vec::new();
    let kinds: BTreeSet<&str> = layers
        .layers
        .iter()
        .flat_map(|layer| layer.components.iter().map(|(_, kind)| *kind))
        .collect();
    if layers.layers.is_empty() && !layers.deep.is_empty() {
        notes.push("it is deep: no picture is read of it".to_owned());
    }
    for header in headers.iter().filter(|header| !header.deep) {
        notes.extend(windows(header));
        let sampled = header.channels.list.iter().find(|channel| channel.sampling != Vec2(1, 1));
        notes.extend(sampled.map(|channel| {
            format!(
                "channel {} has a sample for every {} by {} pixels",
                channel.name, channel.sampling.0, channel.sampling.1
            )
        }));
    }
    let aspect = first.shared_attributes.pixel_aspect;
    notes.extend(not_square(aspect));
    if let Some(own) = first.shared_attributes.chromaticities.map(primaries)
        && !own.are_rec_709()
    {
        notes
            .push("its colours are of primaries of its own (chromaticities): converted".to_owned());
    }
    notes.dedup();
    let mapped = u64::from(size.0).saturating_mul(u64::from(size.1)).saturating_mul(16);
    Ok(Head {
        format: Format::Exr,
        size,
        samples: kinds.into_iter().collect::<Vec<_>>().join(" and "),
        bytes,
        mapped: mapped.saturating_add(mapped / 3),
        layers: Some(layers),
        notes,
    })
}

fn not_square(aspect: f32) -> Option<String> {
    let is_square = !aspect.is_finite() || (aspect - 1.0).abs() < 1e-3;
    (!is_square).then(|| format!("its pixels are {aspect} times as wide as high: read as square"))
}

fn primaries(own: Chromaticities) -> Primaries {
    let xy = |v: Vec2<f32>| DVec2::new(f64::from(v.0), f64::from(v.1));
    Primaries { red: xy(own.red), green: xy(own.green), blue: xy(own.blue), white: xy(own.white) }
}

/// How the pixels that a part has lie on what is displayed, if not as it does.
fn windows(header: &Header) -> Option<String> {
    let (data, all) = (header.data_window(), header.shared_attributes.display_window);
    if data == all {
        return None;
    }
    let (from, to) = (data.position - all.position, data.end() - all.position);
    let is_within =
        from.0 >= 0 && from.1 >= 0 && to.0 <= all.size.0 as i32 && to.1 <= all.size.1 as i32;
    let place = format!(
        "{} by {} pixels at {}, {} of {} by {}",
        data.size.0, data.size.1, from.0, from.1, all.size.0, all.size.1
    );
    Some(match is_within {
        true => format!("it has {place}: transparent beside them"),
        false => format!("it has {place}: what lies beside the display is left out"),
    })
}

/// Where the pixels of a part lie on the display: its corner, and the columns and rows that are seen.
struct Shown {
    corner: Vec2<i32>,
    columns: Range<u32>,
    rows: Range<u32>,
}

impl Shown {
    fn of(header: &Header, size: (u32, u32)) -> Shown {
        let corner =
            header.own_attributes.layer_position - header.shared_attributes.display_window.position;
        let ends = |at: i32, length: usize, limit: u32| {
            let end = (i64::from(at) + length as i64).clamp(0, i64::from(limit)) as u32;
            (at.max(0) as u32).min(end)..end
        };
        let Vec2(width, height) = header.layer_size;
        Shown {
            corner,
            columns: ends(corner.0, width, size.0),
            rows: ends(corner.1, height, size.1),
        }
    }

    /// From each pixel of a window to the pixel of the part that is there.
    fn places(&self, window: Window, width: usize) -> impl Iterator<Item = Option<usize>> + '_ {
        (0..window.area()).map(move |i| {
            let x = window.x + i as u32 % window.width;
            let y = window.y + i as u32 / window.width;
            let is_there = self.columns.contains(&x) && self.rows.contains(&y);
            let own = |place: u32, at: i32| (i64::from(place) - i64::from(at)) as usize;
            is_there.then(|| own(y, self.corner.1) * width + own(x, self.corner.0))
        })
    }
}

/// The samples of a plane over a window; 0 where its part has no pixels.
fn laid(plane: Plane, shown: &Shown, window: Window, header: &Header) -> Samples {
    let Vec2(width, height) = header.layer_size;
    let is_same = shown.corner == Vec2(window.x as i32, window.y as i32)
        && (width, height) == (window.width as usize, window.height as usize);
    fn moved<T: Copy + Default>(
        values: Vec<T>,
        places: impl Iterator<Item = Option<usize>>,
    ) -> Vec<T> {
        places.map(|place| place.map_or_else(T::default, |at| values[at])).collect()
    }
    let places = || shown.places(window, width);
    match plane {
        Plane::Half(values) if is_same => Samples::half(values),
        Plane::Float(values) if is_same => Samples::exact(values),
        Plane::Whole(values) if is_same => Samples::Id(values),
        Plane::Half(values) => Samples::half(moved(values, places())),
        Plane::Float(values) => Samples::exact(moved(values, places())),
        Plane::Whole(values) => Samples::Id(moved(values, places())),
    }
}

/// What becomes of each channel that is read.
struct Wanted<'c> {
    channel: &'c Channel,
    name: String,
}

/// Reads what is selected of a file. What lies beside the display window (overscan) is left out.
pub(in crate::image) fn read(
    path: &Path,
    bytes: &[u8],
    select: &Select<'_>,
) -> Result<(Image, Vec<String>)> {
    let file = File::open(path, bytes)?;
    let headers = &file.meta.headers;
    let layers = Layers::of(headers);
    if layers.channels.is_empty() && !layers.deep.is_empty() {
        return Err(deep(path, &layers.deep));
    }
    let channels = layers.selected(path, headers, select)?;
    let wants_color = ["R", "G", "B", "A"].iter().any(|name| (select.wants)(name));
    let color = if wants_color { layers.color(path, &channels, select)? } else { None };
    let mut notes = Vec::new();
    let mut wanted: Vec<Wanted<'_>> = Vec::new();
    let mut push = |channel, name: &str| wanted.push(Wanted { channel, name: name.to_owned() });
    let own_layer = color.as_ref().map(|(layer, _)| layer.as_str());
    let mut luminance = None;
    if let Some((layer, recipe)) = &color {
        match recipe {
            Recipe::Colors(all) => {
                for (channel, name) in all.iter().zip(["R", "G", "B", "A"]) {
                    channel.iter().for_each(|channel| push(*channel, name));
                }
            }
            Recipe::Luminance { y, chroma, alpha } => {
                push(*y, "R");
                if let Some([red, blue]) = chroma {
                    push(*red, "G");
                    push(*blue, "B");
                }
                alpha.iter().for_each(|alpha| push(*alpha, "A"));
                luminance = Some(chroma.is_some());
                if chroma.is_none() && y.component != "Y" {
                    notes.push(format!("of one channel ({}): it is grey", y.name()));
                }
            }
        }
        if !layer.is_empty() {
            notes.push(format!("its colour is that of layer \"{layer}\""));
        }
    }
    for channel in &channels {
        let is_main_color =
            channel.layer.is_empty() && matches!(&*channel.component, "R" | "G" | "B" | "A");
        if own_layer == Some(&channel.layer) && wants_color
            || (own_layer.is_some() && is_main_color)
        {
            // It is the colour, or gives way to it; what else its layer has is kept.
            let is_used = match color.as_ref().map(|(_, recipe)| recipe) {
                Some(Recipe::Colors(all)) => {
                    all.iter().flatten().any(|used| std::ptr::eq(*used, *channel))
                }
                Some(Recipe::Luminance { y, chroma, alpha }) => {
                    std::ptr::eq(*y, *channel)
                        || chroma.iter().flatten().any(|used| std::ptr::eq(*used, *channel))
                        || alpha.is_some_and(|used| std::ptr::eq(used, *channel))
                }
                None => false,
            };
            if is_used || is_main_color {
                continue;
            }
        }
        let name = channel.name();
        if (select.wants)(&name) {
            push(channel, &name);
        }
    }
    let mut taken: BTreeSet<String> = BTreeSet::new();
    for one in &mut wanted {
        if !taken.insert(one.name.clone()) {
            // Of several parts that call theirs alike.
            one.name = format!("{}:{}", one.channel.part, one.name);
            taken.insert(one.name.clone());
        }
    }
    let mut by_part: BTreeMap<usize, Vec<Wanted<'_>>> = BTreeMap::new();
    let first_part = wanted.first().map(|one| one.channel.part);
    wanted.into_iter().for_each(|one| by_part.entry(one.channel.part).or_default().push(one));
    let Some(first_part) = first_part else {
        let all: Vec<String> = channels.iter().map(|channel| channel.name()).collect();
        let all = crate::text::list(all.iter().map(String::as_str));
        let what =
            format!("it has none of the channels that are asked for: its channels are {all}");
        return Err(Error::in_file(path, what));
    };
    let display = file.header(first_part).shared_attributes.display_window;
    let size = (display.size.0 as u32, display.size.1 as u32);
    let shown: BTreeMap<usize, Shown> =
        by_part.keys().map(|part| (*part, Shown::of(file.header(*part), size))).collect();
    let around = |a: Range<u32>, b: &Range<u32>| a.start.min(b.start)..a.end.max(b.end);
    let seen = shown.values().filter(|shown| !shown.columns.is_empty() && !shown.rows.is_empty());
    let all = seen.map(|shown| (shown.columns.clone(), shown.rows.clone()));
    let Some((columns, rows)) = all.reduce(|a, b| (around(a.0, &b.0), around(a.1, &b.1))) else {
        return Err(Error::in_file(path, "all its pixels lie outside of its display window"));
    };
    let window = Window {
        x: columns.start,
        y: rows.start,
        width: columns.end - columns.start,
        height: rows.end - rows.start,
    };
    let count: usize = by_part.values().map(Vec::len).sum();
    let whole = [window.width, window.height].map(u64::from);
    check_largest(path, whole, (window.area() as u64).saturating_mul(count as u64 * 4))?;
    let mut picture = Image::new(size, window);
    for (part, own) in &by_part {
        let header = file.header(*part);
        let numbers: Vec<usize> = own.iter().map(|one| one.channel.at).collect();
        for (one, plane) in own.iter().zip(file.planes(*part, &numbers)?) {
            let plane = full(plane, header, one.channel.at);
            let samples = laid(plane, &shown[part], window, header);
            picture.insert(&one.name, samples).map_err(|e| Error::in_file(path, e.to_string()))?;
        }
        if let Some(AttributeValue::Text(names)) =
            header.own_attributes.other.get(&Text::from(NAMES))
        {
            let names = names.to_string();
            let pairs = names.lines().filter_map(|line| line.split_once(' '));
            picture
                .names
                .extend(pairs.filter_map(|(id, n)| Some((id.parse().ok()?, n.to_owned()))));
        }
        notes.extend(windows(header));
    }
    let own = file.header(first_part).shared_attributes.chromaticities.map(primaries);
    if let Some(has_chroma) = luminance {
        spread_luminance(&mut picture, has_chroma, own.unwrap_or(REC_709))?;
    }
    if let Some(own) = own.filter(|own| !own.are_rec_709()) {
        let what = "not a sound OpenEXR file: its chromaticities span no colours";
        let matrix = own.to_rec_709().ok_or_else(|| Error::in_file(path, what))?;
        if convert(&mut picture, matrix)? {
            notes.push(
                "its colours are of primaries of its own (chromaticities): converted to Rec. 709"
                    .to_owned(),
            );
        }
    }
    notes.extend(not_square(file.header(first_part).shared_attributes.pixel_aspect));
    if !layers.deep.is_empty() {
        notes.push("its deep parts are left out".to_owned());
    }
    notes.dedup();
    let others = by_part.keys().filter(|part| **part != first_part);
    let parts = std::iter::once(&first_part).chain(others).map(|part| file.header(*part));
    picture.attributes = Attributes::of(parts).map(Arc::new);
    Ok((picture, notes))
}

/// A plane with a sample for each pixel.
fn full(plane: Plane, header: &Header, at: usize) -> Plane {
    let Vec2(across, down) = header.channels.list[at].sampling;
    if (across, down) == (1, 1) {
        return plane;
    }
    let Vec2(width, height) = header.layer_size;
    let values: Vec<f32> = match plane {
        Plane::Half(values) => values.iter().map(|v| v.to_f32()).collect(),
        Plane::Float(values) => values,
        Plane::Whole(values) => {
            let each = |i: usize| values[i / width / down * (width / across) + i % width / across];
            return Plane::Whole((0..width * height).map(each).collect());
        }
    };
    let (w, h) = (width / across, height / down);
    // Along rows first, then along columns: the filter is a product.
    let rows: Vec<f32> = values.chunks_exact(w).flat_map(|row| between(row, across)).collect();
    let mut all = vec![0.0; width * height];
    for x in 0..width {
        let column: Vec<f32> = (0..h).map(|y| rows[y * width + x]).collect();
        for (y, v) in between(&column, down).into_iter().enumerate() {
            all[y * width + x] = v;
        }
    }
    Plane::Float(all)
}

/// Between every two numbers those that are missing. Where one is missing, by the filter that OpenEXR's own library
/// has for it; where more are, on straight lines.
fn between(values: &[f32], sampling: usize) -> Vec<f32> {
    const FILTER: [f64; 7] =
        [0.627_123, -0.186_077, 0.087_929, -0.043_159, 0.019_597, -0.007_540, 0.002_128];
    let at = |i: i64| f64::from(values[i.clamp(0, values.len() as i64 - 1) as usize]);
    let one = |i: usize| {
        let (low, part) = ((i / sampling) as i64, i % sampling);
        let value = match (part, sampling) {
            (0, _) => at(low),
            (_, 2) => {
                let both = |k: usize| at(low - k as i64) + at(low + 1 + k as i64);
                FILTER.iter().enumerate().map(|(k, weight)| weight * both(k)).sum()
            }
            _ => {
                let share = part as f64 / sampling as f64;
                at(low) * (1.0 - share) + at(low + 1) * share
            }
        };
        value as f32
    };
    (0..values.len() * sampling).map(one).collect()
}

/// Makes red, green and blue of luminance, which is in R, and, if there is chroma, of what red and blue have more than
/// it as shares of it, which are in G and B.
fn spread_luminance(picture: &mut Image, has_chroma: bool, own: Primaries) -> Result<()> {
    if !has_chroma {
        let Some(grey) = picture.channel("R").cloned() else { return Ok(()) };
        picture.insert("G", grey.clone())?;
        return picture.insert("B", grey);
    }
    // The luminance of each primary.
    let weights = own.to_xyz().or_else(|| REC_709.to_xyz()).map_or(DVec3::ONE / 3.0, |m| m.row(1));
    let channels = ["R", "G", "B"].map(|name| picture.float(name).unwrap_or_default());
    let made: Vec<[f32; 3]> = (0..picture.window.area())
        .map(|at| {
            let [y, ry, by] = channels.map(|values| f64::from(values[at]));
            // RY is (R - Y) / Y, and BY alike; green is what is then missing to Y.
            let (r, b) = ((ry + 1.0) * y, (by + 1.0) * y);
            let g = (y - r * weights.x - b * weights.z) / weights.y;
            [r, g, b].map(|v| v as f32)
        })
        .collect();
    for (k, name) in ["R", "G", "B"].into_iter().enumerate() {
        picture.insert(name, Samples::Float(made.iter().map(|v| v[k]).collect()))?;
    }
    Ok(())
}

/// Brings the colours of a picture, and of its layers of light, to Rec. 709; whether there are any.
fn convert(picture: &mut Image, matrix: DMat3) -> Result<bool> {
    let prefixes: BTreeSet<String> = picture
        .channels()
        .filter(|(name, _)| PictureChannel::is_color(name))
        .filter_map(|(name, _)| Some(name.strip_suffix('R')?.to_owned()))
        .collect();
    let mut any = false;
    for prefix in prefixes {
        let names = ["R", "G", "B"].map(|component| format!("{prefix}{component}"));
        let [Some(r), Some(g), Some(b)] = [0, 1, 2].map(|k| picture.float(&names[k])) else {
            continue;
        };
        let one = |((r, g), b): ((&f32, &f32), &f32)| {
            (matrix * DVec3::new(f64::from(*r), f64::from(*g), f64::from(*b))).as_vec3().to_array()
        };
        let made: Vec<[f32; 3]> = r.iter().zip(g).zip(b).map(one).collect();
        for (k, name) in names.iter().enumerate() {
            picture.insert(name, Samples::Float(made.iter().map(|v| v[k]).collect()))?;
        }
        any = true;
    }
    Ok(any)
}
