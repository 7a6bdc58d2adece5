//! MTL: the materials of OBJ files.

use glam::DVec2;
use std::collections::BTreeMap;
use std::path::Path;

use super::super::material::{AlphaMode, Map, Material, Picture};
use super::obj::Words;
use crate::color::Color;
use crate::error::Result;
use crate::texture::Wrap;

/// Reads the materials of an MTL text. What this library does not use is skipped.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<BTreeMap<String, Material>> {
    let text = String::from_utf8_lossy(bytes);
    let mut materials = BTreeMap::new();
    let mut current: Option<(String, Material)> = None;
    for (number, line) in text.lines().enumerate() {
        let mut words = Words::new(path, number + 1, line);
        let Some(keyword) = words.next() else { continue };
        if keyword == "newmtl" {
            materials.extend(current.take());
            let material = Material { color: Color::WHITE, ..Material::default() };
            current = Some((words.rest().to_owned(), material));
            continue;
        }
        let Some((_, material)) = &mut current else { continue };
        match keyword {
            // Colours by spectrum or in XYZ are so rare that no reader takes them.
            "Kd" if !matches!(words.peek(), Some("spectral" | "xyz")) => {
                let r = words.number()? as f32;
                // The specification: a single value stands for all three.
                let (g, b) = match words.peek() {
                    Some(_) => (words.number()? as f32, words.number()? as f32),
                    None => (r, r),
                };
                material.color = Color::new(r, g, b);
            }
            "d" => {
                if words.peek() == Some("-halo") {
                    words.next();
                }
                material.alpha = words.number()? as f32;
            }
            "Tr" => material.alpha = 1.0 - words.number()? as f32,
            "Ke" if !matches!(words.peek(), Some("spectral" | "xyz")) => {
                let glow = [words.number()?, words.number()?, words.number()?].map(|v| v as f32);
                material.finish.glow = Color::new(glow[0], glow[1], glow[2]);
            }
            "map_Kd" => add(material, "color", words.rest(), 1.0),
            "map_d" => add(material, "alpha", words.rest(), 1.0),
            "map_Ke" => {
                if material.finish.glow == Color::BLACK {
                    material.finish.glow = Color::WHITE;
                }
                add(material, "emission", words.rest(), 1.0);
            }
            "norm" => add(material, "normal", words.rest(), 1.0),
            // The format has no unit for heights: a multiplier of 1 is taken for a centimetre.
            "bump" | "map_bump" | "map_Bump" => add(material, "bump", words.rest(), 0.01),
            _ => {}
        }
        material.alpha = material.alpha.clamp(0.0, 1.0);
        let is_cut = material.alpha < 1.0 || material.maps.contains_key("alpha");
        material.alpha_mode = if is_cut { AlphaMode::Blend } else { AlphaMode::Opaque };
    }
    materials.extend(current);
    Ok(materials)
}

fn add(material: &mut Material, what: &str, statement: &str, unit: f32) {
    if let Some(mut map) = map(statement) {
        map.strength *= unit;
        if what != "bump" {
            map.strength = 1.0;
        }
        material.maps.insert(what.to_owned(), map);
    }
}

/// The map of a texture statement: its options, and the file behind them. File names may have blanks.
fn map(statement: &str) -> Option<Map> {
    let mut map = Map::of(Picture::File(String::new()));
    let mut rest = statement.trim();
    while let Some(option) = rest.strip_prefix('-') {
        let (name, mut tail) = option.split_once(char::is_whitespace)?;
        let most = match name {
            "o" | "s" | "t" => 3,
            "mm" => 2,
            _ => 1,
        };
        let (mut numbers, mut word) = (Vec::new(), "");
        for taken in 0..most {
            let (next, after) = tail.trim_start().split_once(char::is_whitespace)?;
            let number = next.parse::<f64>().ok().filter(|number| number.is_finite());
            if taken > 0 && number.is_none() {
                break;
            }
            (word, tail) = (next, after);
            numbers.extend(number);
        }
        let pair = |absent: f64| {
            let at = |i: usize| numbers.get(i).copied().unwrap_or(absent);
            DVec2::new(at(0), at(1))
        };
        match name {
            "s" => map.mapping.scale = pair(1.0),
            "o" => map.mapping.offset = pair(0.0),
            "clamp" if word == "on" => map.mapping.wrap = [Wrap::Clamp; 2],
            "bm" => map.strength = numbers.first().map_or(1.0, |number| *number as f32),
            _ => {}
        }
        rest = tail.trim_start();
    }
    map.picture = Picture::File(rest.replace('\\', "/"));
    (!rest.is_empty() && map.mapping.check().is_ok()).then_some(map)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(statement: &str) -> Option<String> {
        match map(statement)?.picture {
            Picture::File(file) => Some(file),
            _ => None,
        }
    }

    #[test]
    fn texture_options_are_told_from_file_names() {
        assert_eq!(file("brick wall.png").as_deref(), Some("brick wall.png"));
        assert_eq!(file("-o 1 2 3 -bm 0.5 a.png").as_deref(), Some("a.png"));
        assert_eq!(file("-s 2 a b.png").as_deref(), Some("a b.png"));
        assert_eq!(file("-clamp on dir\\c.png").as_deref(), Some("dir/c.png"));
        assert_eq!(file("").as_deref(), None);
        let all = map("-s 2 3 1 -o 0.5 -clamp on -bm 4 a.png").unwrap();
        assert_eq!(
            (all.mapping.scale, all.mapping.offset),
            (DVec2::new(2.0, 3.0), DVec2::new(0.5, 0.0))
        );
        assert_eq!((all.mapping.wrap, all.strength), ([Wrap::Clamp; 2], 4.0));
        assert_eq!(map("-s 0 a.png"), None, "no picture is that large");
    }
}
