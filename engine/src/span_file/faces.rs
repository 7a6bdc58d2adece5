//! Faces as bytes, in columns.

use glam::DVec2;
use std::collections::HashMap;

use super::column::{Bytes, Fault, put, put_doubles, put_floats, put_run};
use super::stored::{FaceLook, Looks, StoredLook};
use crate::camera::Plane;
use crate::color::Color;
use crate::error::Error;
use crate::span::{FaceHead, FaceTable, FaceTableBuilder, Role};

/// Faces in a block, so that what one block takes stays within bounds.
pub(super) const CHUNK: usize = 1 << 15;

const SEES_FRONT: u8 = 1;
const TRANSLUCENT: u8 = 2;
const SEAL: u8 = 4;
const STROKE: u8 = 8;
/// Its colour differs from place to place; what is stored is the colour of one.
const VARIES: u8 = 16;
const UNLIT: u8 = 32;
const KNOWN: u8 = 63;

/// A chunk of faces as bytes: those at `places` of a table, whose ids are `first_id` and their places, with
/// what they look like.
pub(super) fn encode(
    table: &FaceTable,
    places: &[u32],
    first_id: u32,
    looks: &[StoredLook],
) -> Vec<u8> {
    let faces = || places.iter().map(|place| &table.faces()[*place as usize]);
    let (mut ids, mut ordinals, mut flags) = (Vec::new(), Vec::new(), Vec::new());
    let (mut ranks, mut parents) = (Vec::new(), Vec::new());
    let (mut rings, mut corners, mut points) = (Vec::new(), Vec::new(), Vec::new());
    let (mut paint_of, mut object_of) = (Vec::new(), Vec::new());
    let mut paints: Table<[u32; 4]> = Table::default();
    let mut objects: Table<&str> = Table::default();
    let mut known: HashMap<u32, u64> = HashMap::new();
    let (mut last_id, mut last_ordinal) = (0, 0);
    for ((face, place), look) in faces().zip(places).zip(looks) {
        let id = first_id + place;
        put(&mut ids, u64::from(id - last_id));
        put(&mut ordinals, u64::from(face.ordinal - last_ordinal));
        (last_id, last_ordinal) = (id, face.ordinal);
        put(&mut ranks, u64::from(face.rank));
        let role = match face.role {
            Role::Face => 0,
            Role::Seal(parent) => {
                let parent = table.faces()[parent as usize].ordinal;
                put(&mut parents, u64::from(face.ordinal - parent));
                SEAL
            }
            Role::Stroke => STROKE,
        };
        let flag = |is: bool, flag: u8| if is { flag } else { 0 };
        flags.push(
            role | flag(face.sees_front, SEES_FRONT)
                | flag(face.is_translucent, TRANSLUCENT)
                | flag(look.varies, VARIES)
                | flag(look.unlit, UNLIT),
        );
        let mut length = 0u64;
        let mut lengths = Vec::new();
        for (point, is_last) in table.corners(face) {
            let next = known.len() as u64;
            let index = *known.entry(point).or_insert(next);
            if index == next {
                points.push(table.points()[point as usize]);
                put(&mut corners, 0);
            } else {
                put(&mut corners, next - index);
            }
            length += 1;
            if is_last {
                lengths.push(std::mem::take(&mut length));
            }
        }
        put(&mut rings, lengths.len() as u64);
        lengths.iter().for_each(|length| put(&mut rings, *length));
        let [r, g, b] = look.color.to_array();
        put(&mut paint_of, paints.place([r, g, b, look.alpha].map(f32::to_bits)));
        put(&mut object_of, objects.place(&look.object));
    }
    let (mut planes, mut places) = (Vec::new(), Vec::new());
    put_doubles(&mut planes, faces().map(|face| face.plane.a));
    put_doubles(&mut planes, faces().map(|face| face.plane.b));
    put_doubles(&mut planes, faces().map(|face| face.plane.c));
    put(&mut places, points.len() as u64);
    put_doubles(&mut places, points.iter().map(|point| point.x));
    put_doubles(&mut places, points.iter().map(|point| point.y));
    let mut colors = Vec::new();
    put(&mut colors, paints.items.len() as u64);
    for i in 0..4 {
        put_floats(&mut colors, paints.items.iter().map(|paint| f32::from_bits(paint[i])));
    }
    let mut names = Vec::new();
    put(&mut names, objects.items.len() as u64);
    objects.items.iter().for_each(|name| put_run(&mut names, name.as_bytes()));
    let columns = [
        ids, ordinals, flags, ranks, parents, planes, rings, corners, places, paint_of, colors,
        object_of, names,
    ];
    let mut out = Vec::new();
    columns.iter().for_each(|column| put_run(&mut out, column));
    out
}

/// Different values, in the order in which they came.
#[derive(Default)]
struct Table<T> {
    items: Vec<T>,
    places: HashMap<T, u64>,
}

impl<T: Copy + Eq + std::hash::Hash> Table<T> {
    fn place(&mut self, item: T) -> u64 {
        *self.places.entry(item).or_insert_with(|| {
            self.items.push(item);
            self.items.len() as u64 - 1
        })
    }
}

/// A source's faces being read, chunk by chunk.
#[derive(Debug, Default)]
pub(super) struct Faces {
    table: FaceTableBuilder,
    /// Their numbers in the file.
    pub(super) ids: Vec<u32>,
    pub(super) looks: Looks,
}

impl Faces {
    /// Reads a chunk of `count` faces.
    pub(super) fn read(&mut self, raw: &[u8], count: u32) -> Result<(), Fault> {
        let mut bytes = Bytes::new(raw);
        let mut next = || bytes.run();
        let [mut ids, mut ordinals, mut flags, mut ranks, mut parents] =
            [next()?, next()?, next()?, next()?, next()?];
        let [mut planes, mut rings, mut corners, mut places] = [next()?, next()?, next()?, next()?];
        let [mut paint_of, mut colors, mut object_of, mut names] =
            [next()?, next()?, next()?, next()?];
        bytes.end()?;
        let count = count as usize;
        let flags = flags.take(count).map(<[u8]>::to_vec)?;
        let planes = [planes.doubles(count)?, planes.doubles(count)?, planes.doubles(count)?];
        let length = places.index()? as usize;
        let (x, y) = (places.doubles(length)?, places.doubles(length)?);
        if x.iter().chain(&y).any(|v| !v.is_finite()) {
            return Err("a corner is not finite".into());
        }
        let points = x.into_iter().zip(y).map(|(x, y)| DVec2::new(x, y));
        let invalid = |error: Error| error.to_string();
        let first_point = self.table.points(points).map_err(invalid)?;
        let paints = read_paints(&mut colors)?;
        let objects = read_names(&mut names)?;
        let paint_base = self.looks.add_paints(paints.iter().copied());
        let object_base = self.looks.add_objects(objects.iter().cloned());
        let (mut id, mut ordinal, mut seen) = (0u32, 0u32, 0u64);
        for (i, flag) in flags.into_iter().enumerate() {
            let too_large = || "a number is too large".to_owned();
            id = id.checked_add(ids.index()?).ok_or_else(too_large)?;
            ordinal = ordinal.checked_add(ordinals.index()?).ok_or_else(too_large)?;
            if self.ids.last().is_some_and(|last| *last >= id) || id == u32::MAX {
                return Err(format!("the face {id} is not in order"));
            }
            let role = match flag & (SEAL | STROKE) {
                0 => Role::Face,
                SEAL => {
                    let parent = ordinal.checked_sub(parents.index()?);
                    let place = parent.and_then(|parent| self.looks.place(parent));
                    Role::Seal(place.ok_or("a seal lies on no face")? as u32)
                }
                STROKE => Role::Stroke,
                _ => return Err("a face is a seal and a stroke".into()),
            };
            if flag & !KNOWN != 0 {
                return Err(format!("a face has the flags {flag}"));
            }
            let mut outline = Vec::new();
            for _ in 0..rings.number()? {
                let mut ring = Vec::new();
                for _ in 0..rings.number()? {
                    let index = match corners.number()? {
                        0 => {
                            seen += 1;
                            seen - 1
                        }
                        back => seen.checked_sub(back).ok_or("a corner is no point")?,
                    };
                    if index >= length as u64 {
                        return Err("a corner is no point".into());
                    }
                    ring.push(first_point + index as u32);
                }
                outline.push(ring);
            }
            let head = FaceHead {
                ordinal,
                plane: Plane { a: planes[0][i], b: planes[1][i], c: planes[2][i] },
                rank: ranks.index()?,
                role,
                sees_front: flag & SEES_FRONT != 0,
                is_translucent: flag & TRANSLUCENT != 0,
            };
            let (paint, object) = (paint_of.index()?, object_of.index()?);
            if paint as usize >= paints.len() || object as usize >= objects.len() {
                return Err("a face's colour or object is not in the table".into());
            }
            self.table.face(head, outline.iter().map(Vec::as_slice)).map_err(invalid)?;
            self.ids.push(id);
            self.looks.push(FaceLook {
                ordinal,
                paint: paint_base + paint,
                object: object_base + object,
                varies: flag & VARIES != 0,
                unlit: flag & UNLIT != 0,
            });
        }
        let rest = [ids, ordinals, ranks, parents, rings, corners, places];
        rest.iter().chain([&paint_of, &colors, &object_of, &names]).try_for_each(Bytes::end)
    }

    /// The finished table, and what its faces look like.
    pub(super) fn finish(self) -> (FaceTable, Looks) {
        (self.table.finish(), self.looks)
    }
}

fn read_paints(bytes: &mut Bytes<'_>) -> Result<Vec<(Color, f32)>, Fault> {
    let count = bytes.index()? as usize;
    let columns =
        [bytes.floats(count)?, bytes.floats(count)?, bytes.floats(count)?, bytes.floats(count)?];
    let [r, g, b, alpha] = columns;
    if r.iter().chain(&g).chain(&b).chain(&alpha).any(|v| !v.is_finite()) {
        return Err("a colour is not finite".into());
    }
    Ok((0..count).map(|i| (Color::new(r[i], g[i], b[i]), alpha[i].clamp(0.0, 1.0))).collect())
}

fn read_names(bytes: &mut Bytes<'_>) -> Result<Vec<String>, Fault> {
    let mut names = Vec::new();
    for _ in 0..bytes.number()? {
        let mut run = bytes.run()?;
        let text = run.take(run.left())?;
        names.push(String::from_utf8(text.to_vec()).map_err(|_| "a name is not UTF-8")?);
    }
    Ok(names)
}
