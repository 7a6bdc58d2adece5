//! Lines as bytes: each is told by what changed since the one before it.

use super::column::{Bytes, Fault, put, put_run, put_signed};
use crate::span::line::Span;
use crate::span::{Cut, FaceId, Segment};

/// How far ahead in the line before an item is looked for.
const LOOK: usize = 16;
/// An item farther than this from where it was expected is told anew.
const FAR: u64 = 1 << 24;

/// Items that a block's lines may have.
const MAX_ITEMS: usize = 1 << 24;

/// Items of a line stay.
const KEEP: u64 = 0;
/// Items of the line before are gone.
const DROP: u64 = 1;
/// Items are new.
const NEW: u64 = 2;

/// A span or segment: a face, and the places of its boundaries.
pub(super) trait Item: Copy {
    type Places: AsRef<[u32]> + AsMut<[u32]> + Copy + Default;

    fn parts(&self) -> (FaceId, Self::Places);

    fn of(face: FaceId, places: Self::Places) -> Self;

    /// Whether `self` may stand behind `before` on a line, `None` being the line's beginning.
    fn may_follow(&self, before: Option<&Self>, cells: u32) -> bool;
}

impl Item for Span {
    type Places = [u32; 1];

    fn parts(&self) -> (FaceId, [u32; 1]) {
        (self.face, [self.x])
    }

    fn of(face: FaceId, [x]: [u32; 1]) -> Span {
        Span { x, face }
    }

    fn may_follow(&self, before: Option<&Span>, cells: u32) -> bool {
        match before {
            None => self.x == 0,
            Some(before) => before.x < self.x && self.x < cells && before.face != self.face,
        }
    }
}

impl Item for Segment {
    type Places = [u32; 2];

    fn parts(&self) -> (FaceId, [u32; 2]) {
        (self.face, [self.start, self.end])
    }

    fn of(face: FaceId, [start, end]: [u32; 2]) -> Segment {
        Segment { start, face, end }
    }

    fn may_follow(&self, before: Option<&Segment>, cells: u32) -> bool {
        self.start < self.end
            && self.end <= cells
            && self.face.is_some()
            && before.is_none_or(|before| before.start <= self.start)
    }
}

impl Item for Cut {
    type Places = [u32; 1];

    fn parts(&self) -> (FaceId, [u32; 1]) {
        (self.face, [self.x])
    }

    fn of(face: FaceId, [x]: [u32; 1]) -> Cut {
        Cut { x, face }
    }

    fn may_follow(&self, before: Option<&Cut>, cells: u32) -> bool {
        let is_inside = self.x > 0 && self.x < cells && self.face.is_some();
        is_inside && before.is_none_or(|before| before.x <= self.x)
    }
}

/// A face's number in the file; the background is -1.
fn number(face: FaceId) -> i64 {
    if face.is_some() { i64::from(face.0) } else { -1 }
}

/// An item, and how its boundaries moved from the line before it.
#[derive(Clone, Copy)]
struct Known<P> {
    number: i64,
    face: FaceId,
    places: P,
    steps: [i64; 2],
}

/// Puts lines down.
pub(super) struct Encoder<T: Item> {
    runs: Vec<u8>,
    moves: Vec<u8>,
    faces: Vec<u8>,
    places: Vec<u8>,
    before: Vec<Known<T::Places>>,
    now: Vec<Known<T::Places>>,
}

impl<T: Item> Encoder<T> {
    pub(super) fn new() -> Encoder<T> {
        let (runs, moves, faces, places) = Default::default();
        Encoder { runs, moves, faces, places, before: Vec::new(), now: Vec::new() }
    }

    /// Puts down the next line.
    pub(super) fn line(&mut self, items: &[T]) {
        put(&mut self.runs, items.len() as u64);
        let mut at = 0;
        let mut run = (KEEP, 0);
        let mut last = (0, 0);
        self.now.clear();
        for item in items {
            let (face, places) = item.parts();
            let number = number(face);
            let ahead = &self.before[at..self.before.len().min(at + LOOK)];
            let is_same = |known: &Known<T::Places>| {
                known.number == number && residual(known, places.as_ref(), 0).unsigned_abs() < FAR
            };
            let mut known = Known { number, face, places, steps: [0; 2] };
            if let Some(skipped) = ahead.iter().position(is_same) {
                if skipped > 0 {
                    extend(&mut self.runs, &mut run, DROP, skipped as u64);
                }
                extend(&mut self.runs, &mut run, KEEP, 1);
                let before = self.before[at + skipped];
                at += skipped + 1;
                for (i, place) in places.as_ref().iter().enumerate() {
                    put_signed(&mut self.moves, residual(&before, places.as_ref(), i));
                    known.steps[i] = i64::from(*place) - i64::from(before.places.as_ref()[i]);
                }
            } else {
                extend(&mut self.runs, &mut run, NEW, 1);
                put_signed(&mut self.faces, number - last.0);
                let mut from = last.1;
                for place in places.as_ref() {
                    put(&mut self.places, u64::from(place.wrapping_sub(from)));
                    from = *place;
                }
            }
            last = (number, places.as_ref()[0]);
            self.now.push(known);
        }
        extend(&mut self.runs, &mut run, u64::MAX, 0);
        std::mem::swap(&mut self.before, &mut self.now);
    }

    /// Appends what was put down.
    pub(super) fn finish(&self, out: &mut Vec<u8>) {
        for run in [&self.runs, &self.moves, &self.faces, &self.places] {
            put_run(out, run);
        }
    }

    /// Bytes put down so far.
    pub(super) fn bytes(&self) -> usize {
        self.runs.len() + self.moves.len() + self.faces.len() + self.places.len()
    }
}

/// How far a boundary lies from where it would be, had it moved as before.
fn residual<P: AsRef<[u32]>>(before: &Known<P>, places: &[u32], i: usize) -> i64 {
    i64::from(places[i]) - (i64::from(before.places.as_ref()[i]) + before.steps[i])
}

/// Makes a run of operations longer, or puts it down and begins another.
fn extend(runs: &mut Vec<u8>, run: &mut (u64, u64), kind: u64, count: u64) {
    if run.0 != kind {
        if run.1 > 0 {
            put(runs, (run.1 - 1) << 2 | run.0);
        }
        *run = (kind, 0);
    }
    run.1 += count;
}

/// Reads `count` lines: where each begins among all items, and the items. `face` tells a face by its number
/// in the file.
pub(super) fn decode<T: Item>(
    bytes: &mut Bytes<'_>,
    count: u32,
    cells: u32,
    face: impl Fn(u32) -> Option<FaceId>,
) -> Result<(Vec<usize>, Vec<T>), Fault> {
    let mut columns = [bytes.run()?, bytes.run()?, bytes.run()?, bytes.run()?];
    let [runs, moves, faces, places] = &mut columns;
    let mut starts = vec![0];
    let mut items: Vec<T> = Vec::new();
    let mut before: Vec<Known<T::Places>> = Vec::new();
    let mut now: Vec<Known<T::Places>> = Vec::new();
    for line in 0..count {
        let fault = |message: &str| format!("its line {line}: {message}");
        let length = runs.number()?;
        if length > (MAX_ITEMS - items.len()) as u64 {
            return Err(fault("more than 2^24 spans in one block"));
        }
        let mut at = 0;
        let mut last = (0i64, 0u32);
        now.clear();
        while (now.len() as u64) < length {
            let run = runs.number()?;
            let times = (run >> 2).saturating_add(1);
            if run & 3 != DROP && times > length - now.len() as u64 {
                return Err(fault("it has more spans than it says"));
            }
            match run & 3 {
                DROP => at = usize::try_from(times).map_or(usize::MAX, |n| at.saturating_add(n)),
                KEEP => {
                    for _ in 0..times {
                        let Some(known) = before.get(at) else {
                            return Err(fault("it keeps what the line before does not have"));
                        };
                        let mut known = *known;
                        at += 1;
                        for (place, step) in known.places.as_mut().iter_mut().zip(&mut known.steps)
                        {
                            let by = moves.signed()?.checked_add(*step);
                            let to = by.and_then(|by| i64::from(*place).checked_add(by));
                            let to = to.and_then(|to| u32::try_from(to).ok());
                            let to =
                                to.ok_or_else(|| fault("a boundary lies outside the picture"))?;
                            *step = i64::from(to) - i64::from(*place);
                            *place = to;
                        }
                        last = (known.number, known.places.as_ref()[0]);
                        now.push(known);
                    }
                }
                NEW => {
                    for _ in 0..times {
                        let number = faces.signed()?.checked_add(last.0);
                        let number = number.ok_or_else(|| fault("a face's number is too large"))?;
                        let known = match u32::try_from(number) {
                            _ if number == -1 => Some(FaceId::NONE),
                            Ok(number) => face(number),
                            Err(_) => None,
                        };
                        let known =
                            known.ok_or_else(|| fault(&format!("there is no face {number}")))?;
                        let mut at = T::Places::default();
                        let mut from = last.1;
                        for place in at.as_mut() {
                            let to = places.number()?.checked_add(u64::from(from));
                            let to = to.and_then(|to| u32::try_from(to).ok());
                            *place =
                                to.ok_or_else(|| fault("a boundary lies outside the picture"))?;
                            from = *place;
                        }
                        last = (number, at.as_ref()[0]);
                        now.push(Known { number, face: known, places: at, steps: [0; 2] });
                    }
                }
                _ => return Err(fault("an operation is unknown")),
            }
        }
        let start = items.len();
        for known in &now {
            let item = T::of(known.face, known.places);
            if !item.may_follow(items.get(start..).and_then(<[T]>::last), cells) {
                return Err(fault("its spans are not in order"));
            }
            items.push(item);
        }
        starts.push(items.len());
        std::mem::swap(&mut before, &mut now);
    }
    columns.iter().try_for_each(Bytes::end)?;
    Ok((starts, items))
}
