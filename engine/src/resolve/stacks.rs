//! What is seen through translucent faces, as faces of its own kind.
//!
//! Where layers lie over a line, the line is divided into *stacks*: cells in which the same faces lie
//! over each other in the same order. A stack gets an id beyond those of all faces, so that coverage
//! treats it as it treats a face, and is taken apart again when it is shaded. Lines without layers are
//! taken as they are.

use std::collections::HashMap;

use super::hidden::Hidden;
use super::rule::Framing;
use crate::span::layer::{self, Segment, Stack};
use crate::span::{FaceId, Span, SpanImage};

/// The stacks of a few lines.
pub(super) struct Stacks<'a> {
    /// The id of the first stack: beyond all faces.
    first: u32,
    /// Faces from front to back; an opaque one ends the list.
    known: Vec<Vec<FaceId>>,
    ids: HashMap<Vec<FaceId>, FaceId>,
    line: Vec<Span>,
    segments: Vec<Segment>,
    /// What of a row is not seen, if that is looked for.
    hidden: Option<Hidden<'a>>,
}

impl<'a> Stacks<'a> {
    pub(super) fn new(image: &SpanImage) -> Stacks<'a> {
        let first = image.face_count() as u32;
        let (known, line, segments) = (Vec::new(), Vec::new(), Vec::new());
        Stacks { first, known, ids: HashMap::new(), line, segments, hidden: None }
    }

    /// The same without what is not seen.
    pub(super) fn without_hidden(self, image: &'a SpanImage, framing: &'a Framing) -> Stacks<'a> {
        Stacks { hidden: Hidden::new(image, framing), ..self }
    }

    /// Goes to a row, given by its lines: forgets all stacks.
    pub(super) fn go_to(&mut self, row: u32, lines: impl Iterator<Item = u32>) {
        self.known.clear();
        self.ids.clear();
        if let Some(hidden) = &mut self.hidden {
            hidden.look(row, &lines.collect::<Vec<_>>());
        }
    }

    /// The faces of a stack from front to back; `None` for a face or background.
    #[inline(always)]
    pub(super) fn get(&self, id: FaceId) -> Option<&[FaceId]> {
        if !id.is_some() || id.0 < self.first {
            return None;
        }
        Some(&self.known[(id.0 - self.first) as usize])
    }

    /// The faces of a stack, a face itself, or nothing for background.
    #[inline(always)]
    pub(super) fn members<'s>(&'s self, id: &'s FaceId) -> &'s [FaceId] {
        match self.get(*id) {
            Some(faces) => faces,
            None if id.is_some() => std::slice::from_ref(id),
            None => &[],
        }
    }

    /// The spans of a line, of faces and stacks. It must be the one that was prepared last.
    pub(super) fn spans<'s>(&'s self, image: &'s SpanImage, k: u32) -> &'s [Span] {
        if image.layers().line(k).is_empty() { image.lines().line(k) } else { &self.line }
    }

    /// Finds the stacks of a line, and gives them ids. `image` is the one that these stacks are of, or
    /// the same on [probes](crate::span::Probe); the line is of the row at hand.
    pub(super) fn prepare(&mut self, image: &SpanImage, k: u32) {
        let layers = image.layers().line(k);
        if layers.is_empty() {
            return;
        }
        let Stacks { first, known, ids, line, segments, hidden } = self;
        line.clear();
        let y = image.y(k);
        let layers = match hidden {
            Some(hidden) => {
                segments.clear();
                hidden.seen(y, layers, segments);
                &*segments
            }
            None => layers,
        };
        let cells = image.view().raster().cells();
        let on_line = |face| image.on_line(face, y);
        let opaque = image.lines().line(k);
        layer::stacks(opaque, layers, cells, on_line, |Stack { cells, mut layers, opaque }| {
            let face = if layers.is_empty() {
                opaque
            } else {
                // What lies over what, the opaque face included, is all that a stack is. Stacks
                // that are alike share an id on all lines of a row, and so are one cover of a
                // pixel.
                layers.extend(opaque.is_some().then_some(opaque));
                *ids.entry(layers).or_insert_with_key(|layers| {
                    known.push(layers.clone());
                    FaceId(*first + known.len() as u32 - 1)
                })
            };
            crate::span::line::push(line, 0, cells.start, face);
        });
    }
}
