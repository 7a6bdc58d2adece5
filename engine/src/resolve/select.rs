//! What of a picture is computed anew (\[N], "Local processing").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::coverage::{Cover, Coverage};
use crate::fragment::Columns;
use crate::image::Window;
use crate::span::{FaceId, SpanImage};
use crate::text::names_object;

/// Which fragments are selected.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Select {
    /// Those of objects by name, or the end of it after a `/`; `*` stands for anything.
    Objects(Vec<String>),
    /// Those of faces, by their numbers in the scene of a name.
    Faces(BTreeMap<String, BTreeSet<u32>>),
    /// Those in a part of the picture: left, top, width, height, in pixels.
    Region(u32, u32, u32, u32),
    /// Those that rays start from: whose material has `optics`.
    Traced,
}

/// A selection made of an image.
#[derive(Debug)]
pub(super) struct Selected {
    /// By face.
    faces: Vec<bool>,
    window: Option<Window>,
    /// What the selection is, for keys.
    pub(super) name: String,
}

impl Select {
    pub(super) fn of(&self, image: &SpanImage) -> Selected {
        let name = format!("{self:?}");
        let mut selected = Selected { faces: vec![false; image.face_count()], window: None, name };
        if let Select::Region(x, y, width, height) = *self {
            selected.window = Some(Window { x, y, width, height });
            return selected;
        }
        let mut id = 0;
        for source in image.sources() {
            for face in source.faces.faces() {
                selected.faces[id] = match self {
                    Select::Objects(names) => {
                        let object = source.object(face.ordinal);
                        names.iter().any(|name| names_object(name, &object))
                    }
                    Select::Faces(faces) => {
                        let numbers = faces.get(&source.label);
                        numbers.is_some_and(|numbers| numbers.contains(&face.ordinal))
                    }
                    Select::Traced => {
                        source.surfaces.varying(face.ordinal).contains(Columns::TRACED)
                    }
                    Select::Region(..) => false,
                };
                id += 1;
            }
        }
        selected
    }
}

impl Selected {
    fn has(&self, face: FaceId) -> bool {
        self.faces.get(face.0 as usize).is_some_and(|is_selected| *is_selected)
    }

    /// Leaves, of the covers of a row, what lies in pixels that show anything selected; marks these pixels.
    pub(super) fn keep(
        &self,
        covers: &mut Vec<Cover>,
        row: u32,
        columns: &Range<u32>,
        coverage: &Coverage<'_>,
        touched: &mut [bool],
    ) {
        let place = |pixel: u32| (pixel - columns.start) as usize;
        if let Some(window) = self.window {
            let within = window.x.max(columns.start)
                ..(window.x.saturating_add(window.width)).min(columns.end);
            let is_in = (window.y..window.y.saturating_add(window.height)).contains(&row);
            within.filter(|_| is_in).for_each(|pixel| touched[place(pixel)] = true);
        }
        for cover in covers.iter() {
            let is_selected = match coverage.stack(cover.face) {
                Some(stack) => stack.iter().any(|face| self.has(*face)),
                None => self.has(cover.face),
            };
            if is_selected {
                touched[place(cover.start)..place(cover.end)].fill(true);
            }
        }
        let all = std::mem::take(covers);
        for cover in all {
            let mut pixel = cover.start;
            while pixel < cover.end {
                let start = pixel;
                let is_kept = touched[place(pixel)];
                while pixel < cover.end && touched[place(pixel)] == is_kept {
                    pixel += 1;
                }
                if is_kept {
                    let x = cover.x + f64::from(start - cover.start);
                    covers.push(Cover { start, end: pixel, x, ..cover });
                }
            }
        }
    }
}
