//! Lists by line.

use rayon::prelude::*;
use std::ops::Range;

/// Lists of the lines of a range of rows, one after another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PerLine<T> {
    first: u32,
    /// Where each line begins in `items`; one more entry than lines.
    starts: Vec<usize>,
    items: Vec<T>,
}

impl<T: Copy + Send + Sync> PerLine<T> {
    /// Computes the lines `lines`, in parallel, by a function that appends one line's items.
    pub fn compute(lines: Range<u32>, one: impl Fn(u32, &mut Vec<T>) + Sync) -> PerLine<T> {
        const CHUNK: u32 = 64;
        let chunks = lines.end.saturating_sub(lines.start).div_ceil(CHUNK);
        let parts: Vec<PerLine<T>> = (0..chunks)
            .into_par_iter()
            .map(|chunk| {
                let first = lines.start + chunk * CHUNK;
                let mut part = PerLine { first, starts: vec![0], items: Vec::new() };
                for k in first..lines.end.min(first + CHUNK) {
                    one(k, &mut part.items);
                    part.starts.push(part.items.len());
                }
                part
            })
            .collect();
        PerLine::join(lines.start, parts)
    }

    /// The lines `lines` with nothing on them.
    pub fn empty(lines: Range<u32>) -> PerLine<T> {
        PerLine { first: lines.start, starts: vec![0; lines.len() + 1], items: Vec::new() }
    }

    /// Joins runs of consecutive lines. `parts` must be in order and without gaps.
    pub fn join(first: u32, parts: Vec<PerLine<T>>) -> PerLine<T> {
        let lines: usize = parts.iter().map(|part| part.starts.len() - 1).sum();
        let items: usize = parts.iter().map(|part| part.items.len()).sum();
        let mut all = PerLine {
            first,
            starts: Vec::with_capacity(lines + 1),
            items: Vec::with_capacity(items),
        };
        all.starts.push(0);
        for part in parts {
            let offset = all.items.len();
            all.starts.extend(part.starts[1..].iter().map(|start| start + offset));
            all.items.extend_from_slice(&part.items);
        }
        all
    }

    /// Lines from their items, one after another; `starts` has one more entry than there are lines.
    pub fn from_parts(first: u32, starts: Vec<usize>, items: Vec<T>) -> PerLine<T> {
        debug_assert!(starts.first() == Some(&0) && starts.last() == Some(&items.len()));
        PerLine { first, starts, items }
    }

    /// The numbers of the lines held.
    pub fn range(&self) -> Range<u32> {
        self.first..self.first + (self.starts.len() - 1) as u32
    }

    /// The items of line `k`, which must be in [`range`](PerLine::range).
    #[inline]
    pub fn line(&self, k: u32) -> &[T] {
        let i = (k - self.first) as usize;
        &self.items[self.starts[i]..self.starts[i + 1]]
    }

    /// All items, line after line.
    pub fn items(&self) -> &[T] {
        &self.items
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.items) + size_of_val(&*self.starts)
    }
}
