//! STL, in text and binary.
//!
//! Each solid of a text is an object, called as it is or, without a name, as the file; a binary file is one. The
//! vertices of triangles are shared where they are equal.
//!
//! What the format does not have: units are millimetres and up is z, as most programs write it; the colour is that of
//! faces without a material, a grey of 0.8; faces are flat (`crease` smooths them), turned as their corners say. The
//! normals of the file are not looked at: a facet has that of its corners.

use glam::DVec3;
use std::collections::HashMap;

use super::super::document::{Document, Object, Plan};
use super::super::mesh::Mesh;
use super::super::shape::Shape;
use super::reader::{Names, Reader};
use super::words::{Words, lines};
use crate::error::{Error, Result};
use crate::open;
use crate::watch::Watch;

/// The bytes before the triangles of a binary file, and those of a triangle.
const HEAD: usize = 84;
const TRIANGLE: usize = 50;

/// Whether a file has the length of a binary one with as many triangles as it announces. Some begin with "solid",
/// the mark of the text.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    let length = |n: u32| HEAD as u64 + TRIANGLE as u64 * u64::from(n);
    announced(bytes).is_some_and(|n| bytes.len() as u64 == length(n))
}

fn announced(bytes: &[u8]) -> Option<u32> {
    bytes.get(80..HEAD).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
}

/// A solid under construction.
#[derive(Default)]
struct Solid {
    name: String,
    mesh: Mesh,
    known: HashMap<[u64; 3], u32>,
}

impl Solid {
    fn add(&mut self, corners: &[DVec3]) -> Result<()> {
        let mesh = &mut self.mesh;
        // The sum makes a zero of each sign the same.
        let place = |point: &DVec3| (*point + DVec3::ZERO).to_array().map(f64::to_bits);
        let index = |point: &DVec3| {
            *self.known.entry(place(point)).or_insert_with(|| mesh.add_point(*point))
        };
        let corners: Vec<u32> = corners.iter().map(index).collect();
        mesh.add_polygon(&corners, None).map(|_| ())
    }
}

pub(super) fn read(reader: &mut Reader, bytes: &[u8]) -> Result<Document> {
    let head = open::head(bytes);
    let begins = head.trim_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case("solid"));
    // Many binary files begin with "solid" too: their length is the surer sign.
    let solids = if !is_binary(bytes) && begins && !head.contains('\0') {
        let text = reader.text(bytes)?;
        ascii(reader, &text)?
    } else {
        vec![binary(reader, bytes)?]
    };
    let mut names = Names::default();
    let mut root = Object::default();
    for Solid { name, mesh, .. } in solids {
        if mesh.face_count() == 0 {
            reader.note(format!("the solid \"{name}\" has no facets"));
            continue;
        }
        let name = if name.is_empty() { reader.stem() } else { name };
        root.children.push(Object::new(names.unique(&name), Shape::Faces(mesh)));
    }
    if root.children.is_empty() {
        return Err(reader.fault("no triangles"));
    }
    Ok(Document::with_plan(Plan { name: reader.stem(), root, ..Plan::default() }))
}

fn binary(reader: &mut Reader, bytes: &[u8]) -> Result<Solid> {
    let Some(count) = announced(bytes) else {
        let message =
            "not an STL file: it begins neither with \"solid\" nor with 84 bytes of a head";
        return Err(reader.fault(message));
    };
    let triangles = &bytes[HEAD..];
    let there = triangles.len() / TRIANGLE;
    if (there as u64) < u64::from(count) {
        let message = format!(
            "{count} triangles are announced, {there} are there: it is cut short, or no STL file"
        );
        return Err(Error::at_byte(&reader.path, 80, message));
    }
    let watch = Watch::current();
    let (mut solid, mut colored) = (Solid::default(), 0);
    for (at, triangle) in triangles.chunks_exact(TRIANGLE).take(count as usize).enumerate() {
        watch.check()?;
        let number = |i: usize| {
            let word = &triangle[4 * i..4 * i + 4];
            f64::from(f32::from_le_bytes([word[0], word[1], word[2], word[3]]))
        };
        let corners = [3, 6, 9].map(|i| DVec3::new(number(i), number(i + 1), number(i + 2)));
        if !corners.iter().all(|corner| corner.is_finite()) {
            let byte = (HEAD + at * TRIANGLE) as u64;
            let message = format!("triangle {at} has a coordinate that is not finite");
            return Err(Error::at_byte(&reader.path, byte, message));
        }
        solid.add(&corners).map_err(|e| reader.fault(e.to_string()))?;
        // The format calls the last two bytes an attribute count, and gives them no other meaning.
        colored += usize::from(triangle[48..] != [0, 0]);
    }
    if colored > 0 {
        reader.note(format!("{colored} triangles have attributes, which some programs take for colours: they are not shown"));
    }
    let behind = triangles.len() - count as usize * TRIANGLE;
    if behind > 0 {
        reader.note(format!("{behind} bytes behind the last of {count} triangles are not read"));
    }
    Ok(solid)
}

fn ascii(reader: &mut Reader, text: &str) -> Result<Vec<Solid>> {
    let path = reader.path.clone();
    let mut solids: Vec<Solid> = Vec::new();
    let mut corners: Vec<DVec3> = Vec::new();
    // Whether a solid and a facet are open.
    let (mut in_solid, mut in_facet) = (false, false);
    let watch = Watch::current();
    for mut words in lines(&path, text) {
        watch.check()?;
        while let Some(word) = words.next() {
            let mut lower = word.to_ascii_lowercase();
            // Some writers put a blank into `end facet`.
            if lower == "end" {
                lower.push_str(&words.next().unwrap_or_default().to_ascii_lowercase());
            }
            match lower.as_str() {
                "solid" => {
                    solids.push(Solid { name: name(&mut words), ..Solid::default() });
                    (in_solid, in_facet) = (true, false);
                }
                "facet" if in_solid && !in_facet => in_facet = true,
                // It is computed: what stands here may be anything.
                "normal" if in_facet => {
                    let is_next = |word: &str| {
                        ["outer", "vertex"].iter().any(|w| word.eq_ignore_ascii_case(w))
                    };
                    skip(&mut words, |word| !is_next(word));
                }
                "outer" | "loop" | "endloop" if in_facet => {}
                "vertex" if in_facet => corners.push(DVec3::from(words.numbers::<3>()?)),
                "endfacet" if in_facet => {
                    let count = corners.len();
                    if count < 3 {
                        let message = format!("a facet with {count} vertices: it needs 3");
                        return Err(words.fault(word, message));
                    }
                    let solid = solids.last_mut().expect("a facet is within a solid");
                    solid.add(&corners).map_err(|e| words.fault(word, e.to_string()))?;
                    corners.clear();
                    in_facet = false;
                }
                // Its name may be any words, `facet` among them.
                "endsolid" if in_solid && !in_facet => {
                    in_solid = false;
                    break;
                }
                "color" if in_solid => {
                    reader.note("colours are not shown: the format has none");
                    skip(&mut words, |word| word.parse::<f64>().is_ok());
                }
                _ => {
                    let wanted = match (in_solid, in_facet) {
                        (_, true) => "`vertex` and three numbers, or `endfacet`",
                        (true, _) => "`facet` or `endsolid`",
                        _ => "`solid`",
                    };
                    return Err(words.fault(word, format!("\"{word}\" where {wanted} is expected")));
                }
            }
        }
    }
    if in_facet {
        let words = Words::from(&path, text, text.trim_end().len());
        return Err(words.fault(words.whole(), "it ends within a facet: it is cut short"));
    }
    if in_solid {
        reader.note("it ends without `endsolid`: it may be cut short");
    }
    Ok(solids)
}

/// The name of a solid: the rest of the line, where no facet begins on it.
fn name(words: &mut Words<'_>) -> String {
    let mut name: Vec<&str> = Vec::new();
    loop {
        let mut ahead = words.clone();
        let (word, next) = (ahead.next(), ahead.next().unwrap_or_default());
        let Some(word) = word else { break };
        if word.eq_ignore_ascii_case("facet") && next.eq_ignore_ascii_case("normal") {
            break;
        }
        words.next();
        name.push(word);
    }
    name.join(" ")
}

/// Passes up to three words that fit.
fn skip(words: &mut Words<'_>, fits: impl Fn(&str) -> bool) {
    for _ in 0..3 {
        if words.peek().is_some_and(&fits) {
            words.next();
        }
    }
}
