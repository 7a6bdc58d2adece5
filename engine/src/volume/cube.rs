//! Gaussian cube files: densities and orbitals.
//!
//! Two lines of words; the number of atoms and the origin; three lines of a count and a step; the atoms; the values,
//! the last axis fastest. What the variants say:
//!
//! - A negative count of an axis: coordinates are in angstrom. Else they are in bohr.
//! - A negative number of atoms: a line with the number of orbitals and their numbers follows the atoms, and each point
//!   has that many values.
//! - A fifth number in the atoms' line: each point has that many values.
//!
//! Lengths become bohr, and a bohr is shown as a metre: `unit` overrides it.

use glam::{DMat3, DVec3};
use std::path::Path;

use super::{MOST_SAMPLES, Volume};
use crate::error::{Error, Result};
use crate::open;
use crate::watch::Watch;

/// A bohr in angstrom (CODATA 2022).
const BOHR: f64 = 0.529_177_210_544;

/// The most atoms, values of a point and orbitals that are believed.
const MOST: i64 = 1_000_000;

/// Whether a file begins as one: its third line to its sixth are numbers, a whole one first.
pub(super) fn is_cube(bytes: &[u8]) -> bool {
    let head = open::head(bytes);
    let mut lines = head.lines().skip(2);
    (0..4).all(|_| {
        let Some(line) = lines.next() else { return false };
        let mut words = line.split_whitespace();
        let whole = words.next().is_some_and(|word| word.parse::<i64>().is_ok());
        let mut rest = words.map(|word| word.parse::<f64>().is_ok());
        whole && (0..3).all(|_| rest.next() == Some(true)) && rest.count() <= 1
    })
}

pub(super) fn read(path: &Path, bytes: &[u8], component: Option<u32>) -> Result<Volume> {
    let open::Text { text, note } = open::text(path, bytes)?;
    let mut lines = Lines { path, rest: text.split('\n'), number: 0 };
    let title: Vec<String> = (0..2)
        .map(|_| lines.next("a line of words").map(|line| line.trim().to_owned()))
        .collect::<Result<_>>()?;
    let (atoms, origin, more) = lines.grid("the number of atoms and the origin")?;
    let values = match more {
        None => 1,
        Some(values) if (1..=MOST).contains(&values) => values as usize,
        Some(values) => {
            return Err(lines.fault(format!("{values} values at each point: it must be 1 or more")));
        }
    };
    if atoms.abs() > MOST {
        return Err(lines.fault(format!("{atoms} atoms: at most {MOST}")));
    }
    let mut counts = [0usize; 3];
    let mut steps = [DVec3::ZERO; 3];
    let mut in_angstrom = false;
    for axis in 0..3 {
        let (count, step, _) = lines.grid("the count and the step of an axis")?;
        in_angstrom |= count < 0;
        counts[axis] = usize::try_from(count.unsigned_abs()).unwrap_or(usize::MAX);
        steps[axis] = step;
    }
    let scale = if in_angstrom { 1.0 / BOHR } else { 1.0 };
    let [a, b, c] = steps.map(|step| step * scale);
    let (origin, steps) = (origin * scale, DMat3::from_cols(a, b, c));
    super::check(counts, origin, steps).map_err(|error| lines.fault(error.to_string()))?;
    for _ in 0..atoms.unsigned_abs() {
        lines.next("an atom")?;
    }
    let orbitals = if atoms < 0 { lines.orbitals()? } else { Vec::new() };
    let values = values * orbitals.len().max(1);
    let chosen = component.unwrap_or(0) as usize;
    if chosen >= values {
        return Err(Error::in_file(
            path,
            format!("`component` {chosen}: each point has {values} values, 0 to {}", values - 1),
        ));
    }
    let samples = numbers(&mut lines, counts, values, chosen)?;
    let mut volume = Volume::new(counts, origin, steps, samples)
        .map_err(|e| Error::in_file(path, e.to_string()))?;
    volume.unit_name = "bohr".to_owned();
    volume.about.push(title.join("; "));
    volume.about.push(format!(
        "{} atoms, lengths in {}",
        atoms.unsigned_abs(),
        if in_angstrom { "angstrom (told in bohr)" } else { "bohr" }
    ));
    if !orbitals.is_empty() {
        let list: Vec<String> = orbitals.iter().map(i64::to_string).collect();
        volume.about.push(format!("orbitals {}", list.join(", ")));
    }
    if values > 1 && component.is_none() {
        volume.notes.push(format!(
            "{}: each point has {values} values; the first is taken: `component` chooses",
            path.display()
        ));
    }
    volume.notes.extend(note);
    Ok(volume)
}

/// The values, in the order of samples: the file has the last axis fastest.
fn numbers(
    lines: &mut Lines<'_>,
    counts: [usize; 3],
    values: usize,
    chosen: usize,
) -> Result<Vec<f32>> {
    let [columns, rows, layers] = counts;
    let points: usize = counts.iter().product();
    // What the text cannot hold is not made room for: a number and its space are two letters.
    let letters: usize = lines.rest.clone().map(str::len).sum();
    let wanted = points.checked_mul(values).filter(|wanted| *wanted <= MOST_SAMPLES.max(letters));
    if wanted.is_none_or(|wanted| letters / 2 + 1 < wanted) {
        return Err(lines.fault(format!(
            "{columns} x {rows} x {layers} points of {values} values are announced, and only {letters} letters \
             follow: it is cut short"
        )));
    }
    let watch = Watch::current();
    let mut samples = vec![0.0; points];
    let mut at = 0;
    let (mut point, mut value) = (0, 0);
    while point < points {
        watch.check()?;
        let line = lines.next("values").map_err(|_| {
            lines
                .fault(format!("it ends after {at} of {} values: it is cut short", points * values))
        })?;
        for word in line.split_whitespace() {
            if point == points {
                return Err(lines.fault(format!("{word:?} stands behind the last value")));
            }
            if value == chosen {
                // Fortran writes exponents of three digits without a letter, and D for doubles.
                let number =
                    number(word).ok_or_else(|| lines.fault(format!("{word:?} is no number")))?;
                let (i, j, k) = (point / (rows * layers), point / layers % rows, point % layers);
                samples[(k * rows + j) * columns + i] = number as f32;
            }
            at += 1;
            value += 1;
            if value == values {
                (point, value) = (point + 1, 0);
            }
        }
    }
    while let Ok(line) = lines.next("") {
        if let Some(word) = line.split_whitespace().next() {
            return Err(lines.fault(format!("{word:?} stands behind the last value")));
        }
    }
    Ok(samples)
}

fn number(word: &str) -> Option<f64> {
    let plain = word.parse::<f64>().ok();
    plain.or_else(|| {
        let word = word.to_ascii_lowercase().replace('d', "e");
        let sign = word.rfind(['+', '-']).filter(|at| *at > 0 && !word.contains('e'));
        let word = sign.map_or(word.clone(), |at| format!("{}e{}", &word[..at], &word[at..]));
        word.parse().ok()
    })
}

struct Lines<'t> {
    path: &'t Path,
    rest: std::str::Split<'t, char>,
    number: usize,
}

impl<'t> Lines<'t> {
    fn next(&mut self, what: &str) -> Result<&'t str> {
        self.number += 1;
        self.rest
            .next()
            .ok_or_else(|| self.fault(format!("the file ends, and {what} should stand here")))
    }

    fn fault(&self, message: impl Into<String>) -> Error {
        Error::at_line(self.path, self.number, 1, message)
    }

    /// A whole number, a place, and perhaps another whole number.
    fn grid(&mut self, what: &str) -> Result<(i64, DVec3, Option<i64>)> {
        let line = self.next(what)?;
        let words: Vec<&str> = line.split_whitespace().collect();
        let place: Vec<f64> =
            words.iter().skip(1).take(3).filter_map(|word| number(word)).collect();
        let count = words.first().and_then(|word| word.parse().ok());
        match (count, &place[..]) {
            (Some(count), [x, y, z]) => {
                let more = words.get(4).and_then(|word| word.parse().ok());
                Ok((count, DVec3::new(*x, *y, *z), more))
            }
            _ => Err(self.fault(format!("{line:?} should be {what}"))),
        }
    }

    /// How many orbitals there are, and their numbers, over as many lines as that takes.
    fn orbitals(&mut self) -> Result<Vec<i64>> {
        let mut words: Vec<i64> = Vec::new();
        loop {
            let line = self.next("the numbers of orbitals")?;
            for word in line.split_whitespace() {
                let number = word.parse().map_err(|_| {
                    self.fault(format!("{word:?} should be the number of an orbital"))
                })?;
                words.push(number);
            }
            match words.first() {
                Some(count) if !(1..=MOST).contains(count) => {
                    return Err(self.fault(format!("{count} orbitals: it must be 1 or more")));
                }
                Some(count) if words.len() > *count as usize + 1 => {
                    return Err(self.fault(format!("more numbers than {count} orbitals have")));
                }
                Some(count) if words.len() == *count as usize + 1 => return Ok(words.split_off(1)),
                _ => {}
            }
        }
    }
}
