//! Texts that are made of pieces of another: whatever is wrong with one is shown where its piece stands.

use std::ops::Range;

/// A text made of pieces that stand in another, the document's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Woven {
    text: String,
    /// Where its pieces come from, in their order.
    pieces: Vec<Piece>,
}

/// A part of a text.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Piece {
    /// Where it begins in the text.
    at: usize,
    /// Where it stands in the document.
    origin: Range<usize>,
    /// Whether it is not what stands there, but was made of it.
    is_made: bool,
}

/// What a part of a text is replaced by: the new text, and where in the document it stands or what there it was made
/// of.
#[derive(Clone, Debug)]
pub struct Patch<'t> {
    /// The new text.
    pub text: &'t str,
    /// Its place in the document.
    pub origin: Range<usize>,
    /// Whether it is not what stands there, but was made of it.
    pub is_made: bool,
}

impl<'t> Patch<'t> {
    /// A text that stands in the document.
    pub fn of(text: &'t str, origin: Range<usize>) -> Patch<'t> {
        Patch { text, origin, is_made: false }
    }

    /// A text that was made of what stands in the document.
    pub fn made(text: &'t str, origin: Range<usize>) -> Patch<'t> {
        Patch { text, origin, is_made: true }
    }
}

impl Woven {
    /// A text of one piece, with its place in the document.
    pub fn new(text: impl Into<String>, origin: Range<usize>) -> Woven {
        Woven { text: text.into(), pieces: vec![Piece { at: 0, origin, is_made: false }] }
    }

    /// The text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Replaces a part of the text by others.
    pub fn replace(&mut self, place: Range<usize>, by: &[Patch<'_>]) {
        let text: String = by.iter().map(|patch| patch.text).collect();
        let ends = self.pieces[1..].iter().map(|piece| piece.at).chain([self.text.len()]);
        let mut pieces = Vec::new();
        let mut behind = Vec::new();
        for (piece, end) in self.pieces.iter().zip(ends) {
            // What is left of it before the place and behind.
            if piece.at < place.start {
                pieces.push(piece.clone());
            }
            if end > place.end {
                let from = piece.at.max(place.end);
                let Range { start, end } = piece.origin;
                let start = if piece.is_made { start } else { (start + from - piece.at).min(end) };
                let at = from - place.end + place.start + text.len();
                behind.push(Piece { at, origin: start..end, is_made: piece.is_made });
            }
        }
        let mut at = place.start;
        for Patch { text, origin, is_made } in by {
            pieces.push(Piece { at, origin: origin.clone(), is_made: *is_made });
            at += text.len();
        }
        pieces.append(&mut behind);
        self.text.replace_range(place, &text);
        self.pieces = pieces;
    }

    /// Where a byte of the text stands in the document, and where what can be shown with it ends there.
    fn origin(&self, at: usize) -> (Range<usize>, usize) {
        let piece = &self.pieces[self.pieces.partition_point(|p| p.at <= at).saturating_sub(1)];
        let Range { start, end } = piece.origin;
        if piece.is_made {
            return (start..end, end);
        }
        let byte = (start + at - piece.at).min(end);
        (byte..byte + 1, end)
    }

    /// Where a place of the text stands in the document.
    pub fn place(&self, place: Range<usize>) -> Range<usize> {
        let (first, till) = self.origin(place.start);
        if place.is_empty() {
            return first.start..first.start;
        }
        let (last, _) = self.origin(place.end.max(place.start + 1) - 1);
        // A place that ends in another piece: as much of it as stands together.
        let end = if (first.start..till).contains(&last.start) { last.end } else { till };
        first.start..end.max(first.start)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_lead_back_to_the_document() {
        let document = "ab(x: 1, y: Curve(..), z: 3) set=44";
        let mut woven = Woven::new(&document[..28], 0..28);
        let curve = document.find("Curve").unwrap();
        woven.replace(curve..curve + 9, &[Patch::made("0.25", curve..curve + 9)]);
        let z = woven.text().find("3)").unwrap();
        woven.replace(z..z + 1, &[Patch::of("44", 33..35)]);
        assert_eq!(woven.text(), "ab(x: 1, y: 0.25, z: 44)");
        let shown = |part: &str| {
            let at = woven.text().find(part).unwrap();
            &document[woven.place(at..at + part.len())]
        };
        assert_eq!(shown("x: 1"), "x: 1");
        assert_eq!(shown("25"), "Curve(..)");
        assert_eq!(shown("z:"), "z:");
        assert_eq!(shown("44"), "44");
        assert_eq!(shown(")"), ")");
        assert_eq!(shown("1, y: 0.25"), "1, y: Curve(..)");
    }
}
