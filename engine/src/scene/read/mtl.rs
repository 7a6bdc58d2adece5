//! MTL: the materials of OBJ files.

use std::collections::BTreeMap;
use std::path::Path;

use super::super::material::{AlphaMode, Map, Material, Picture};
use super::obj::Words;
use crate::color::Color;
use crate::error::Result;

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
            "map_Kd" => {
                if let Some(file) = picture(words.rest()) {
                    material.maps.insert("color".to_owned(), Map::of(Picture::File(file)));
                }
            }
            _ => {}
        }
        material.alpha = material.alpha.clamp(0.0, 1.0);
        material.alpha_mode =
            if material.alpha < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque };
    }
    materials.extend(current);
    Ok(materials)
}

/// The file of a texture statement, behind its options. File names may have blanks.
fn picture(statement: &str) -> Option<String> {
    let mut rest = statement.trim();
    while let Some(option) = rest.strip_prefix('-') {
        let (name, mut tail) = option.split_once(char::is_whitespace)?;
        let is_number = |word: &str| word.parse::<f64>().is_ok();
        let most = match name {
            "o" | "s" | "t" => 3,
            "mm" => 2,
            _ => 1,
        };
        for taken in 0..most {
            let (word, after) = tail.trim_start().split_once(char::is_whitespace)?;
            if taken > 0 && !is_number(word) {
                break;
            }
            tail = after;
        }
        rest = tail.trim_start();
    }
    (!rest.is_empty()).then(|| rest.replace('\\', "/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_options_are_passed_over() {
        assert_eq!(picture("brick wall.png").as_deref(), Some("brick wall.png"));
        assert_eq!(picture("-o 1 2 3 -bm 0.5 a.png").as_deref(), Some("a.png"));
        assert_eq!(picture("-s 2 a b.png").as_deref(), Some("a b.png"));
        assert_eq!(picture("-clamp on dir\\c.png").as_deref(), Some("dir/c.png"));
        assert_eq!(picture("").as_deref(), None);
    }
}
