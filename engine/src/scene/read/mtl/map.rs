//! The statements of MTL that name pictures: their options, and their files.

use glam::DVec2;

use super::super::super::material::{Map, Picture};
use crate::texture::Wrap;

/// A picture as a statement names it.
#[derive(Debug)]
pub(super) struct Named {
    pub(super) map: Map,
    /// The factor of heights.
    pub(super) bump: f32,
    /// Options that would change what is seen, and are not shown.
    pub(super) lost: Vec<&'static str>,
}

impl Named {
    /// The file as the statement has it, with `/` in its path.
    pub(super) fn file(&self) -> &str {
        self.map.picture.file().unwrap_or_default()
    }
}

/// How many words an option takes, at least and at most.
fn arguments(option: &str) -> Option<(usize, usize)> {
    Some(match option {
        "-s" | "-o" | "-t" => (1, 3),
        "-mm" => (2, 2),
        "-blendu" | "-blendv" | "-clamp" | "-cc" => (1, 1),
        "-bm" | "-boost" | "-texres" | "-imfchan" | "-type" => (1, 1),
        _ => return None,
    })
}

/// The picture of a statement: its options, and the file between or before them, whose name may have blanks and
/// quotes. `None` if it names no file.
pub(super) fn named(statement: &str) -> Option<Named> {
    let mut named =
        Named { map: Map::of(Picture::File(String::new())), bump: 1.0, lost: Vec::new() };
    let mut rest = statement.trim();
    while let Some(tail) = named.option(rest) {
        rest = tail;
    }
    // Some write options behind the name: then nothing but options is there.
    let behind = rest.match_indices(" -").map(|(at, _)| at).find(|at| {
        let mut tail = rest[*at..].trim_start();
        let mut others =
            Named { map: named.map.clone(), bump: named.bump, lost: named.lost.clone() };
        while let Some(after) = others.option(tail) {
            tail = after;
        }
        let is_all = tail.is_empty();
        if is_all {
            // Only if all of the tail is options: a name may have ` -` in it.
            named = others;
        }
        is_all
    });
    let name = behind.map_or(rest, |at| &rest[..at]).trim();
    let name = name.strip_prefix('"').and_then(|name| name.strip_suffix('"')).unwrap_or(name);
    named.map.picture = Picture::File(name.replace("\\ ", " ").replace('\\', "/"));
    (!name.is_empty()).then_some(named)
}

impl Named {
    /// Takes an option from the start of a text, and returns what is left.
    fn option<'t>(&mut self, text: &'t str) -> Option<&'t str> {
        let cut = |text: &'t str| {
            let text = text.trim_start();
            let end = text.find(char::is_whitespace).unwrap_or(text.len());
            (!text.is_empty()).then(|| text.split_at(end))
        };
        let (name, mut tail) = cut(text)?;
        let name = name.to_ascii_lowercase();
        // A word with a minus that is no option belongs to the file's name.
        let (least, most) = arguments(&name)?;
        let mut words = Vec::new();
        while words.len() < most {
            let Some((word, after)) = cut(tail) else { break };
            // Those that may be absent are numbers.
            if words.len() >= least && word.parse::<f64>().is_err() {
                break;
            }
            words.push(word);
            tail = after;
        }
        if words.len() < least {
            return None;
        }
        self.set(&name, &words);
        Some(tail.trim_start())
    }

    fn set(&mut self, name: &str, words: &[&str]) {
        let number = |at: usize, absent: f64| {
            let number = words.get(at).and_then(|word| word.parse::<f64>().ok());
            number.filter(|number| number.is_finite()).unwrap_or(absent)
        };
        let is_on = words[0].eq_ignore_ascii_case("on");
        let mapping = &mut self.map.mapping;
        let lost = match name {
            "-s" => {
                mapping.scale = DVec2::new(number(0, 1.0), number(1, 1.0));
                let is_sound = mapping.check().is_ok();
                if !is_sound {
                    mapping.scale = DVec2::ONE;
                }
                (!is_sound).then_some("-s")
            }
            "-o" => {
                mapping.offset = DVec2::new(number(0, 0.0), number(1, 0.0));
                None
            }
            "-clamp" => {
                mapping.wrap = [if is_on { Wrap::Clamp } else { Wrap::Repeat }; 2];
                None
            }
            "-bm" => {
                self.bump = number(0, 1.0) as f32;
                None
            }
            "-t" => (0..3).any(|at| number(at, 0.0) != 0.0).then_some("-t"),
            "-mm" => ((number(0, 0.0), number(1, 1.0)) != (0.0, 1.0)).then_some("-mm"),
            "-cc" => is_on.then_some("-cc"),
            "-imfchan" => (!words[0].eq_ignore_ascii_case("l")).then_some("-imfchan"),
            "-type" => Some("-type"),
            "-boost" => Some("-boost"),
            "-texres" => Some("-texres"),
            // Whether neighbouring texels are mixed is a choice of who renders.
            _ => None,
        };
        self.lost.extend(lost);
    }
}
