//! The algebra of the merge, on lines that are made to break it: planes in one plane, a unit in the last
//! place apart, nearly parallel, through one point, edge-on, denormal, huge. A million triples.

use rayon::prelude::*;
use spandrel_engine::camera::Plane;
use spandrel_engine::raster::Raster;
use spandrel_engine::span::{FaceId, OnLine, Segment, Span, layer, line};
use spandrel_tests::random::Random;
use std::cmp::Ordering;
use std::ops::Range;

const TRIPLES: u64 = 1_000_000;
/// Faces on a line.
const FACES: u32 = 6;

/// Faces on one line, and where they are.
struct Case {
    raster: Raster,
    faces: Vec<OnLine>,
    /// For comparison in whole numbers: a and c of those whose planes are whole numbers.
    whole: Vec<Option<(i128, i128)>>,
}

impl Case {
    fn new(random: &mut Random) -> Case {
        let raster = Raster::new([1, 4, 64, 1920, 65_536][random.below(5) as usize], 1).unwrap();
        let width = f64::from(raster.width);
        let meeting = (random.unit() * width, random.between(-2.0, 2.0));
        let mut planes: Vec<Plane> = Vec::new();
        let mut whole = Vec::new();
        let all_whole = random.below(4) == 0;
        for _ in 0..FACES {
            let last = planes.last().copied().unwrap_or(Plane::constant(1.0));
            let spread = |random: &mut Random| random.between(-1.0, 1.0);
            let nudge = |random: &mut Random, v: f64| match random.below(3) {
                0 => v,
                1 => v.next_up(),
                _ => v.next_down(),
            };
            let plane = match random.below(9) {
                _ if all_whole => {
                    // Small enough for products to stay whole; many coincide.
                    let small = |random: &mut Random| f64::from(random.below(9)) - 4.0;
                    Plane { a: small(random), b: 0.0, c: small(random) * width }
                }
                0 => last,
                1 => Plane { a: nudge(random, last.a), b: last.b, c: nudge(random, last.c) },
                // Through one point, so that all crossings lie in a few cells.
                2..=4 => {
                    let a = spread(random);
                    let c = meeting.1 - a * meeting.0;
                    Plane { a, b: 0.0, c: nudge(random, c) }
                }
                // Nearly parallel to the last.
                5 => Plane { a: last.a * (1.0 + spread(random) * 1e-15), b: 0.0, c: last.c },
                6 => Plane { a: spread(random) * 1e12, b: 0.0, c: spread(random) * 1e12 },
                7 => {
                    let tiny = |random: &mut Random| f64::from_bits(u64::from(random.below(40)));
                    Plane { a: tiny(random), b: 0.0, c: -tiny(random) }
                }
                _ => Plane { a: spread(random) * 1e285, b: 0.0, c: spread(random) * 1e288 },
            };
            planes.push(plane);
            // In half cells from the left: depth times 2 cells per pixel.
            let scale = 2 * (1i128 << raster.fraction_bits());
            whole.push(all_whole.then(|| (plane.a as i128, plane.c as i128 * scale)));
        }
        let rank = |random: &mut Random| random.below(2);
        let faces = planes
            .iter()
            .enumerate()
            .map(|(id, plane)| OnLine::new(plane, rank(random), FaceId(id as u32), 0.0, raster))
            .collect();
        Case { raster, faces, whole }
    }

    fn on_line(&self, face: FaceId) -> OnLine {
        self.faces[face.0 as usize]
    }

    fn segments(&self, random: &mut Random) -> Vec<(Range<u32>, FaceId)> {
        let cells = self.raster.cells();
        let any = |random: &mut Random| (random.unit() * f64::from(cells)) as u32;
        (0..random.below(4))
            .map(|_| {
                let (p, q) = match random.below(3) {
                    0 => (0, cells),
                    _ => (any(random), any(random)),
                };
                (p.min(q)..p.max(q), FaceId(random.below(FACES)))
            })
            .collect()
    }

    /// A line of some faces.
    fn line(&self, random: &mut Random) -> Vec<Span> {
        let mut out = Vec::new();
        let segments = self.segments(random);
        line::envelope(&segments, self.raster.cells(), &|face| self.on_line(face), &mut out);
        out
    }

    fn merge(&self, a: &[Span], b: &[Span]) -> Vec<Span> {
        let mut out = Vec::new();
        line::merge(a, b, self.raster.cells(), |face| self.on_line(face), &mut out);
        out
    }

    /// Translucent segments before a line.
    fn clip(&self, segments: &[Segment], line: &[Span]) -> Vec<Segment> {
        let mut out = Vec::new();
        layer::clip(segments, line, self.raster.cells(), |face| self.on_line(face), &mut out);
        layer::normalize(&mut out, 0);
        out
    }

    /// The face seen in a cell of a line.
    fn at(line: &[Span], cell: u32) -> FaceId {
        line[line.partition_point(|span| span.x <= cell) - 1].face
    }

    /// How two faces compare in a cell, in whole numbers where planes are.
    fn compare(&self, a: FaceId, b: FaceId, cell: u32) -> Ordering {
        let (p, q) = (self.on_line(a), self.on_line(b));
        let found = p.compare(&q, cell);
        if let (Some(p), Some(q)) = (self.whole[a.0 as usize], self.whole[b.0 as usize]) {
            let x = 2 * i128::from(cell) + 1;
            let exact = (p.0 * x + p.1).cmp(&(q.0 * x + q.1));
            if exact != Ordering::Equal {
                assert_eq!(found, exact, "cell {cell} of {:?}", self.faces);
            }
        }
        found
    }
}

fn is_a_line(line: &[Span], cells: u32) -> bool {
    line[0].x == 0
        && line.windows(2).all(|pair| pair[0].x < pair[1].x && pair[0].face != pair[1].face)
        && line.iter().all(|span| span.x < cells)
}

fn check(seed: u64) {
    let mut random = Random::new(seed);
    let case = Case::new(&mut random);
    let [a, b, c] = [0; 3].map(|_| case.line(&mut random));
    let ab = case.merge(&a, &b);
    let all = case.merge(&ab, &c);
    let nothing = [Span { x: 0, face: FaceId::NONE }];
    assert_eq!(ab, case.merge(&b, &a), "commutative: {seed}");
    assert_eq!(all, case.merge(&a, &case.merge(&b, &c)), "associative: {seed}");
    assert_eq!(all, case.merge(&case.merge(&c, &a), &b), "in any order: {seed}");
    assert_eq!(ab, case.merge(&ab, &ab), "idempotent: {seed}");
    assert_eq!(all, case.merge(&all, &b), "absorbing: {seed}");
    assert_eq!(a, case.merge(&a, &nothing), "identity: {seed}");
    assert!(is_a_line(&all, case.raster.cells()), "form: {seed}");
    // Not only consistent but right, where it can go wrong: about the boundaries.
    for x in a.iter().chain(&b).chain(&c).chain(&all).map(|span| span.x) {
        for cell in [x.saturating_sub(1), x] {
            let seen = Case::at(&all, cell);
            for other in [&a, &b, &c].map(|line| Case::at(line, cell)) {
                if other.is_some() {
                    assert!(seen.is_some(), "{seed}: nothing is seen in cell {cell}");
                    assert!(case.compare(seen, other, cell).is_ge(), "{seed}: cell {cell}");
                }
            }
        }
    }
    // Translucent segments: what is left of a set does not depend on when it was clipped.
    let segments: Vec<Segment> = case
        .segments(&mut random)
        .into_iter()
        .filter(|(range, _)| !range.is_empty())
        .map(|(Range { start, end }, face)| Segment { start, face, end })
        .collect();
    let late = case.clip(&segments, &ab);
    assert_eq!(late, case.clip(&case.clip(&segments, &a), &ab), "clipped twice: {seed}");
    assert_eq!(
        case.clip(&case.clip(&segments, &a), &b),
        case.clip(&case.clip(&segments, &b), &a),
        "clipped in any order: {seed}"
    );
    assert_eq!(late, case.clip(&case.clip(&segments, &a), &b), "clipped by parts: {seed}");
    let stacks = |each: &mut dyn FnMut(layer::Stack)| {
        let on_line = |face| case.on_line(face);
        layer::stacks(&ab, &late, case.raster.cells(), on_line, each);
    };
    let mut end = 0;
    stacks(&mut |stack| {
        assert_eq!(stack.cells.start, end, "{seed}: stacks have no gaps");
        end = stack.cells.end;
        for cell in [stack.cells.start, stack.cells.end - 1] {
            let ordered = stack.layers.windows(2).all(|p| case.compare(p[0], p[1], cell).is_ge());
            assert!(ordered, "{seed}: a stack out of order");
        }
    });
    assert_eq!(end, case.raster.cells());
}

#[test]
fn a_million_triples_obey_the_algebra() {
    (0..TRIPLES).into_par_iter().for_each(check);
}
