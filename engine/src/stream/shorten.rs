//! What a compiled program can do without: instructions that others do along, places that are free again.

use super::compile::Compiled;
use super::run::{Binary, Op, Pair};

impl Compiled {
    /// Makes one instruction of two of sums, products and the like, where nothing else needs the first.
    pub(super) fn fuse(&mut self) {
        let mut uses = vec![0u32; self.ops.len()];
        self.ops.iter().for_each(|op| op.each(|from| uses[*from as usize] += 1));
        let outputs = self.outputs.iter().flat_map(|(_, parts)| parts);
        // What is given out must stay in a register of its own, even if one other instruction reads
        // it.
        outputs.for_each(|at| uses[*at as usize] += 2);
        for at in 0..self.ops.len() {
            let Op::Binary(second, x, y) = self.ops[at] else { continue };
            let inner = |at: u32| match self.ops[at as usize] {
                Op::Binary(first, a, b) if uses[at as usize] == 1 => Some((first, a, b)),
                _ => None,
            };
            let of = |inner: Option<(Binary, u32, u32)>, c: u32, is_last: bool| {
                let (first, a, b) = inner?;
                Some(Op::Pair { pair: Pair::of(first, second, is_last)?, from: [a, b, c] })
            };
            let pair = of(inner(x), y, false).or_else(|| of(inner(y), x, true));
            self.ops[at] = pair.unwrap_or(self.ops[at]);
        }
        self.drop_unused();
    }

    /// Gives instructions their places.
    pub(super) fn place(&mut self) {
        let mut last_use = vec![0; self.ops.len()];
        for (at, op) in self.ops.iter().enumerate() {
            op.each(|from| last_use[*from as usize] = at);
        }
        let outputs = self.outputs.iter().flat_map(|(_, parts)| parts);
        outputs.for_each(|at| last_use[*at as usize] = usize::MAX);
        let (mut free, mut count) = (Vec::new(), 0u32);
        self.places.clear();
        for (at, op) in self.ops.iter().enumerate() {
            // Never one that it reads.
            let place = if op.as_number().is_none() { free.pop() } else { None };
            let place = place.unwrap_or_else(|| {
                count += 1;
                count - 1
            });
            self.places.push(place);
            op.each(|from| {
                let from = *from as usize;
                let is_over = last_use[from] == at && self.ops[from].as_number().is_none();
                if is_over && !free.contains(&self.places[from]) {
                    free.push(self.places[from]);
                }
            });
        }
    }

    /// Leaves the instructions that something is made of.
    pub(super) fn drop_unused(&mut self) {
        let mut used = vec![false; self.ops.len()];
        let made = self.outputs.iter().flat_map(|(_, parts)| parts);
        made.for_each(|at| used[*at as usize] = true);
        for at in (0..self.ops.len()).rev() {
            // Instructions read only those before them: one pass from the end finds all that are
            // needed.
            if used[at] {
                self.ops[at].each(|from| used[*from as usize] = true);
            }
        }
        let mut places = vec![0u32; self.ops.len()];
        let mut kept = Vec::new();
        for (at, mut op) in std::mem::take(&mut self.ops).into_iter().enumerate() {
            if used[at] {
                op.each_mut(|from| *from = places[*from as usize]);
                places[at] = kept.len() as u32;
                kept.push(op);
            }
        }
        self.ops = kept;
        let parts = self.outputs.iter_mut().flat_map(|(_, parts)| parts);
        parts.for_each(|at| *at = places[*at as usize]);
    }
}
