//! MTL: the materials of OBJ files.
//!
//! | statement | becomes |
//! |---|---|
//! | `Kd`, `d`, `Tr`, `Ke` | colour, alpha, glow; where `d` and `Tr` differ, `d` counts |
//! | `Ks` with `Ns` | Phong's gloss, as bright in its middle and as wide as the format's highlight; not with `illum` 0 and 1 |
//! | `illum` | 0: unlit; 3, 4, 8, 9: mirrors a share of `Ks`; 5: mirrors by Fresnel's law; 6, 7: refracts too |
//! | `Ni`, `Tf` | index and colour of what is refracted |
//! | `Pr`, `Pm`, `map_Pr`, `map_Pm` | microfacets, in place of Phong's gloss; `Ni` is their reflectance |
//! | `map_Kd`, `map_d`, `map_Ke`, `bump`, `norm` | maps; a `map_d` that is `map_Kd` is the alpha of that picture |
//!
//! The keywords may be of either case. `Ka` is taken as `Kd` and told only if it is neither that, black or white.
//! Everything else that a file says of its materials is told: how many have it, and the first.
//!
//! What a material does not say: it is white, opaque, without gloss, seen from both sides.

mod finish;
mod map;

use std::collections::BTreeMap;
use std::path::Path;

use self::finish::Draft;
use self::map::{Named, named};
use super::super::material::{Map, Material, Picture};
use super::reader::Reader;
use super::words::{Words, statements};
use crate::color::Color;
use crate::error::Result;
use crate::open;

/// What a library says that is not shown: how many of its materials have it, and the first.
#[derive(Default)]
struct Remarks(BTreeMap<String, (usize, String)>);

impl Remarks {
    fn add(&mut self, statement: impl Into<String>, material: &str) {
        let (count, _) = self.0.entry(statement.into()).or_insert_with(|| (0, material.to_owned()));
        *count += 1;
    }
}

/// Reads the materials of a library's text. `folder` leads from the scene's folder to the library's.
pub(super) fn read(
    reader: &mut Reader,
    path: &Path,
    text: &str,
    folder: &Path,
) -> Result<BTreeMap<String, Material>> {
    let mut materials = BTreeMap::new();
    let mut told = Remarks::default();
    let mut current: Option<Draft> = None;
    let mut finish = |draft: Option<Draft>, told: &mut Remarks| {
        if let Some(draft) = draft {
            let (name, material) = draft.finish(told);
            if materials.insert(name.clone(), material).is_some() {
                told.add("an earlier material of the same name", &name);
            }
        }
    };
    for mut words in statements(path, text) {
        let Some(keyword) = words.next() else { continue };
        if keyword.eq_ignore_ascii_case("newmtl") {
            finish(current.take(), &mut told);
            current = Some(Draft::new(words.name()));
        } else if let Some(draft) = &mut current {
            draft.statement(keyword, &mut words, &mut told, &|file| found(reader, folder, file))?;
        } else {
            told.add(format!("{keyword} before the first newmtl"), "");
        }
    }
    finish(current, &mut told);
    if !told.0.is_empty() {
        let each = told.0.iter().map(|(what, (count, first))| match (count, first.as_str()) {
            (_, "") => what.clone(),
            (1, first) => format!("{what} (\"{first}\")"),
            (count, first) => format!("{what} ({count} materials, the first \"{first}\")"),
        });
        let each: Vec<String> = each.collect();
        let library = path.file_name().unwrap_or_default().to_string_lossy();
        reader.note(format!("of {library} these are not shown: {}", each.join(", ")));
    }
    Ok(materials)
}

/// Where a picture is, from the scene's folder: as the library says from its own folder or the scene's, or else under
/// its bare name there. As the library says, if it is nowhere.
fn found(reader: &Reader, folder: &Path, file: &str) -> String {
    let scene = reader.path.parent().unwrap_or(Path::new(""));
    let bare = file.rsplit('/').next().unwrap_or(file);
    // Paths of the machine on which the file was written lead nowhere here: the bare name often
    // does.
    let places = [folder.join(file), file.into(), folder.join(bare), bare.into()];
    let place = places.iter().find(|place| open::is_file(&scene.join(place))).unwrap_or(&places[0]);
    place.to_string_lossy().into_owned()
}

impl Draft {
    /// Takes a statement.
    fn statement(
        &mut self,
        keyword: &str,
        words: &mut Words<'_>,
        told: &mut Remarks,
        found: &dyn Fn(&str) -> String,
    ) -> Result<()> {
        let lower = keyword.to_ascii_lowercase();
        let is_color = matches!(lower.as_str(), "ka" | "kd" | "ks" | "ke" | "tf");
        // Colours by spectrum or in XYZ are so rare that no reader takes them.
        if is_color && matches!(words.peek(), Some("spectral" | "xyz")) {
            told.add(
                format!("{keyword} {}", words.rest().split(' ').next().unwrap_or_default()),
                &self.name,
            );
            return Ok(());
        }
        match lower.as_str() {
            "ka" => self.ka = Some(color(words)?),
            "kd" => self.material.color = color(words)?,
            "ks" => self.ks = Some(color(words)?),
            "ke" => {
                // A glow is not limited to 1.
                let [r, g, b] = color(words)?.to_array().map(|v| v.max(0.0));
                self.material.finish.glow = Color::new(r, g, b);
            }
            "tf" => self.tf = Some(color(words)?),
            "d" => {
                if words.peek() == Some("-halo") {
                    words.next();
                    told.add("d -halo", &self.name);
                }
                self.d = Some(words.number()? as f32);
            }
            "tr" => self.tr = Some(words.number()? as f32),
            "ns" => self.ns = Some(words.number()? as f32),
            "ni" => self.ni = Some(words.number()? as f32),
            "illum" => self.illum = Some(words.number()? as u32),
            "pr" => self.pr = Some(words.number()? as f32),
            "pm" => self.pm = Some(words.number()? as f32),
            "map_kd" | "map_d" | "map_ke" | "norm" | "bump" | "map_bump" | "map_pr" | "map_pm"
            | "map_ka" => {
                let Some(mut named) = named(words.rest()) else {
                    told.add(format!("{keyword} without a file"), &self.name);
                    return Ok(());
                };
                for option in &named.lost {
                    told.add(format!("{option} of {keyword}"), &self.name);
                }
                named.map.picture = Picture::File(found(named.file()));
                self.picture(&lower, named);
            }
            // Some write all that there might be.
            _ if words.left() > 0 && words.clone().all(|word| word.parse() == Ok(0.0)) => {}
            _ => told.add(keyword, &self.name),
        }
        Ok(())
    }

    fn picture(&mut self, keyword: &str, named: Named) {
        let mut add = |what: &str, map: Map| self.material.maps.insert(what.to_owned(), map);
        match keyword {
            "map_kd" => drop(add("color", named.map)),
            "map_d" => drop(add("alpha", named.map)),
            "map_ke" => drop(add("emission", named.map)),
            "norm" => drop(add("normal", named.map)),
            // The format has no unit for heights: a multiplier of 1 is taken for a centimetre.
            "bump" | "map_bump" => {
                drop(add("bump", Map { strength: 0.01 * named.bump, ..named.map }))
            }
            "map_pr" => self.map_pr = Some(named.map),
            "map_pm" => self.map_pm = Some(named.map),
            _ => self.map_ka = Some(named.map),
        }
    }
}

/// A colour. The specification: a single value stands for all three.
fn color(words: &mut Words<'_>) -> Result<Color> {
    let r = words.number()? as f32;
    let (g, b) = match words.peek() {
        Some(_) => (words.number()? as f32, words.number()? as f32),
        None => (r, r),
    };
    Ok(Color::new(r, g, b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::Wrap;
    use glam::DVec2;

    #[test]
    fn texture_options_are_told_from_file_names() {
        let file = |statement: &str| named(statement).map(|named| named.file().to_owned());
        for (statement, name) in [
            ("brick wall.png", "brick wall.png"),
            ("\"brick wall.png\"", "brick wall.png"),
            ("brick\\ wall.png", "brick wall.png"),
            ("-o 1 2 3 -bm 0.5 a.png", "a.png"),
            ("-s 1 a.png", "a.png"),
            ("-s 1 1 a.png", "a.png"),
            ("-s 2 a b.png", "a b.png"),
            ("-S 2 -T 0 a.png", "a.png"),
            ("-o -0.5 a.png", "a.png"),
            ("-clamp on dir\\c.png", "dir/c.png"),
            (
                "-blendu on -blendv off -boost 1 -mm 0 1 -texres 8 -imfchan r -cc on -type sphere a.png",
                "a.png",
            ),
            ("a.png -bm 0.5", "a.png"),
            ("a -b.png -s 2 2 -clamp on", "a -b.png"),
            ("a -s.png", "a -s.png"),
            ("-1.png", "-1.png"),
        ] {
            assert_eq!(file(statement).as_deref(), Some(name), "{statement}");
        }
        assert_eq!(file(""), None);
        assert_eq!(file("-s 1 1 1"), None);
        let all = named("-s 2 3 1 -o 0.5 -clamp on -bm 4 a.png").unwrap();
        let mapping = &all.map.mapping;
        assert_eq!((mapping.scale, mapping.offset), (DVec2::new(2.0, 3.0), DVec2::new(0.5, 0.0)));
        assert_eq!((mapping.wrap, all.bump), ([Wrap::Clamp; 2], 4.0));
        assert!(all.lost.is_empty());
        assert_eq!(named("-s 0 -mm 0 2 a.png").unwrap().lost, ["-s", "-mm"]);
    }
}
