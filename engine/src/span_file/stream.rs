//! Merging and comparing files without holding them: a few rows at a time.

use rayon::prelude::*;
use std::path::Path;

use super::read::SpanFile;
use super::write::{Options, Writer, Written};
use crate::error::{Error, Result};
use crate::output;
use crate::raster::Rows;
use crate::span::{FaceId, Segment, SpanImage, Union, line};

/// Merges span files into another, by depth, exactly as [`SpanImage::merge`] does, a few rows at a time: what
/// is held at once does not grow with the height. `progress` is told the rows done and all rows.
///
/// # Errors
/// If a file cannot be read, they differ in camera, raster, line plan or rows, or the result cannot be
/// written.
pub fn merge(inputs: &[&Path], output: &Path, progress: &dyn Fn(u32, u32)) -> Result<Written> {
    let files: Vec<SpanFile> =
        inputs.par_iter().map(|path| SpanFile::open_without_scenes(path)).collect::<Result<_>>()?;
    let Some(first) = files.first() else {
        return Err(Error::invalid("a merge needs at least one file"));
    };
    let rows = first.rows();
    files[1..].iter().try_for_each(|file| check_alike(first, file))?;
    let frames: Vec<SpanImage> =
        files.iter().map(|file| file.frame().over(rows.start..rows.start)).collect();
    let union = Union::new(&frames)?;
    let frame = union.merge(&frames)?;
    let mut written = Written::default();
    let bytes = output::write(output, |out| {
        let mut writer = Writer::new(out, output, &frame, rows.clone(), Options::default())?;
        for part in SpanFile::parts(&files.iter().collect::<Vec<_>>()) {
            let images: Vec<SpanImage> =
                files.iter().map(|file| file.read(part.clone())).collect::<Result<_>>()?;
            writer.lines(&union.merge(&images)?)?;
            progress(part.end - rows.start, rows.end - rows.start);
        }
        written = writer.finish()?;
        Ok(())
    })?;
    Ok(Written { bytes, ..written })
}

/// How far two images are apart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Difference {
    /// Lines of each.
    pub lines: u32,
    /// Lines that differ.
    pub differing: u32,
    /// The height of the first that differs, in pixels.
    pub first: Option<f64>,
    /// The share of the picture that shows another opaque face.
    pub area: f64,
    /// How much more or less of translucent faces one shows than the other, in pictures.
    pub translucent: f64,
    /// The sources that only the first, and only the second has.
    pub only: [Vec<String>; 2],
}

/// Compares two files: faces are the same if their sources and their numbers in them are.
///
/// # Errors
/// If they differ in camera, raster, line plan or rows, or are damaged.
pub fn compare(a: &SpanFile, b: &SpanFile) -> Result<Difference> {
    let rows = a.rows();
    check_alike(a, b)?;
    let files = [a, b];
    let frames = files.map(|file| file.frame().over(rows.start..rows.start));
    let union = Union::new(&frames)?;
    let mut found = Difference::default();
    for (i, only) in found.only.iter_mut().enumerate() {
        let (own, other) = (&frames[i], &frames[1 - i]);
        let missing = own
            .sources()
            .iter()
            .filter(|source| other.sources().iter().all(|known| known.order(source).is_ne()));
        *only = missing.map(|source| source.label.clone()).collect();
    }
    let cells = u64::from(a.view().raster().cells());
    let (mut apart, mut all, mut next) = ([0u64; 2], 0u64, 0);
    for part in SpanFile::parts(&files) {
        let [a, b] = [union.bring(0, &a.read(part.clone())?), union.bring(1, &b.read(part)?)];
        // With lines on the borders of rows, the last line of a part is the first of the next.
        for k in a.lines().range().filter(|k| *k >= next) {
            let spans = opaque_apart(a.lines().line(k), b.lines().line(k), cells as u32);
            let segments = segments_apart(a.layers().line(k), b.layers().line(k));
            if spans + segments > 0 {
                found.differing += 1;
                found.first.get_or_insert(a.y(k));
            }
            apart = [apart[0] + spans, apart[1] + segments];
            all += cells;
        }
        next = a.lines().range().end;
    }
    found.lines = a.plan().lines(&rows).len() as u32;
    [found.area, found.translucent] = apart.map(|cells| cells as f64 / all.max(1) as f64);
    Ok(found)
}

/// How many cells of two lines show different faces.
fn opaque_apart(a: &[line::Span], b: &[line::Span], cells: u32) -> u64 {
    let mut apart = 0;
    let mut b = line::segments(b, cells).peekable();
    for (range, face) in line::segments(a, cells) {
        while let Some((other, other_face)) = b.peek() {
            let shared = other.end.min(range.end) - other.start.max(range.start);
            apart += if face == *other_face { 0 } else { u64::from(shared) };
            if other.end > range.end {
                break;
            }
            let ends_here = other.end == range.end;
            b.next();
            if ends_here {
                break;
            }
        }
    }
    apart
}

/// How many cells, counted for every face, are in the segments of one line and not in those of the other.
fn segments_apart(a: &[Segment], b: &[Segment]) -> u64 {
    let mut ends: Vec<(FaceId, u32, i32)> = Vec::new();
    for (segments, sign) in [(a, 1), (b, -1)] {
        for segment in segments {
            ends.push((segment.face, segment.start, sign));
            ends.push((segment.face, segment.end, -sign));
        }
    }
    ends.sort_unstable();
    let (mut apart, mut sum) = (0, 0);
    for pair in ends.windows(2) {
        sum += pair[0].2;
        if sum != 0 {
            apart += u64::from(pair[1].1 - pair[0].1);
        }
    }
    apart
}

/// Whether two files hold the same rows of the same picture; an error names both.
fn check_alike(first: &SpanFile, other: &SpanFile) -> Result<()> {
    let frame = |file: &SpanFile| file.frame().over(0..0);
    let cameras = Union::new(&[frame(first), frame(other)]).map(|_| ());
    let rows = || match first.rows() == other.rows() {
        true => Ok(()),
        false => {
            let text = |rows: Rows| format!("rows {} to {}", rows.start, rows.end);
            let (left, right) = (text(first.rows()), text(other.rows()));
            Err(Error::Mismatch { what: "the range of rows", left, right })
        }
    };
    cameras.and_then(|()| rows()).map_err(|error| match error {
        Error::Mismatch { what, left, right } => {
            let [left, right] = [(left, first), (right, other)]
                .map(|(value, file)| format!("{value} in {}", file.path().display()));
            Error::Mismatch { what, left, right }
        }
        other => other,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_that_differ_are_counted() {
        let spans = |list: &[(u32, u32)]| -> Vec<line::Span> {
            list.iter().map(|(x, face)| line::Span { x: *x, face: FaceId(*face) }).collect()
        };
        let (a, b) =
            (spans(&[(0, 1), (10, 2), (30, 3)]), spans(&[(0, 1), (12, 2), (20, 3), (50, 1)]));
        assert_eq!(opaque_apart(&a, &b, 60), 2 + 10 + 10);
        assert_eq!(opaque_apart(&b, &a, 60), 22);
        assert_eq!(opaque_apart(&a, &a, 60), 0);
        let segment = |start, end, face| Segment { start, face: FaceId(face), end };
        let (a, b) = ([segment(0, 10, 1), segment(5, 8, 2)], [segment(4, 12, 1), segment(5, 8, 3)]);
        assert_eq!(segments_apart(&a, &b), 4 + 2 + 3 + 3);
        assert_eq!(segments_apart(&a, &a), 0);
    }
}
