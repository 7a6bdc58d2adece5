//! IES LM-63: the format of 1986, and its editions of 1991, 1995 and 2002.

use super::{About, Goniometer, MAX_ANGLES, Photometry, check_angles};
use crate::error::{Error, Result};

/// Numbers of a file, with their places.
struct Numbers<'t> {
    words: Vec<(usize, usize, &'t str)>,
    next: usize,
    last_line: usize,
}

impl<'t> Numbers<'t> {
    /// The words of the lines from `first` on, which is counted from 0.
    fn new(lines: &[&'t str], first: usize) -> Numbers<'t> {
        let mut words = Vec::new();
        for (at, line) in lines.iter().enumerate().skip(first) {
            // Words stand between blanks or commas.
            let is_gap = |c: char| c.is_whitespace() || c == ',' || c == '\u{1a}' || c == '\0';
            let mut start = None;
            for (column, c) in line.char_indices().chain([(line.len(), ' ')]) {
                match (is_gap(c), start) {
                    (false, None) => start = Some(column),
                    (true, Some(from)) => {
                        words.push((at + 1, from + 1, &line[from..column]));
                        start = None;
                    }
                    _ => {}
                }
            }
        }
        Numbers { words, next: 0, last_line: lines.len() }
    }

    fn next(&mut self, what: &str) -> Result<f64> {
        let Some((line, column, word)) = self.words.get(self.next) else {
            let line = self.last_line;
            return Err(Error::invalid(format!("line {line}: the file ends before {what}")));
        };
        self.next += 1;
        word.parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(|| {
            Error::invalid(format!(
                "line {line}, column {column}: {what} is \"{word}\", not a number"
            ))
        })
    }

    /// Says that the number read last is wrong.
    fn fault(&self, what: &str) -> Error {
        match self.words.get(self.next.saturating_sub(1)) {
            Some((line, column, _)) => {
                Error::invalid(format!("line {line}, column {column}: {what}"))
            }
            None => Error::invalid(what),
        }
    }

    fn count(&mut self, what: &str) -> Result<usize> {
        let value = self.next(what)?;
        if value.fract() != 0.0 || !(1.0..=MAX_ANGLES as f64).contains(&value) {
            return Err(self.fault(&format!("{what} is {value}: must be 1 to {MAX_ANGLES}")));
        }
        Ok(value as usize)
    }

    fn angles(&mut self, what: &str, count: usize, range: (f64, f64)) -> Result<Vec<f64>> {
        let mut angles = Vec::new();
        for _ in 0..count {
            let angle = self.next(&format!("a {what} angle"))?;
            if !(range.0..=range.1).contains(&angle) {
                let (least, most) = range;
                return Err(self.fault(&format!(
                    "a {what} angle of {angle}: must be {least} to {most} degrees"
                )));
            }
            angles.push(angle);
        }
        check_angles(what, &angles).map_err(|e| self.fault(&e))?;
        Ok(angles)
    }
}

pub(super) fn parse(text: &str) -> Result<Photometry> {
    let lines: Vec<&str> = text.lines().collect();
    let tilt =
        lines.iter().position(|line| line.trim_start().to_ascii_uppercase().starts_with("TILT="));
    let Some(tilt) = tilt else {
        return Err(Error::invalid(
            "there is no line \"TILT=\", which every IES file has: is it a photometric file?",
        ));
    };
    let first = lines[0].trim();
    let format = match first.to_ascii_uppercase() {
        upper if upper.starts_with("IESNA") => first.to_owned(),
        _ => "LM-63-1986".to_owned(),
    };
    let label = |line: &&str| line.trim().to_owned();
    let skip = usize::from(first.to_ascii_uppercase().starts_with("IESNA"));
    let about_lines = lines[skip.min(tilt)..tilt].iter().map(label);
    let text: Vec<String> = about_lines.filter(|line| !line.is_empty()).take(64).collect();
    let mut numbers = Numbers::new(&lines, tilt + 1);
    let how = lines[tilt].trim_start()[5..].trim();
    match how.to_ascii_uppercase().as_str() {
        // Some files leave the word out.
        "NONE" | "" => {}
        "INCLUDE" => {
            // How the lamps' flux changes when the luminaire is tilted: ours are as measured.
            numbers.next("the lamp's orientation to its luminaire")?;
            let pairs = numbers.count("the number of tilt angles")?;
            for _ in 0..2 * pairs {
                numbers.next("a tilt angle or its factor")?;
            }
        }
        _ => {
            return Err(Error::invalid(format!(
                "line {}: TILT={how}: the tilt table is in another file: put it in (TILT=INCLUDE) or \
                 leave it out (TILT=NONE)",
                tilt + 1
            )));
        }
    }
    let lamps = numbers.next("the number of lamps")?;
    if lamps < 0.0 {
        return Err(numbers.fault(&format!("{lamps} lamps")));
    }
    let per_lamp = numbers.next("the lumens per lamp")?;
    if per_lamp < 0.0 && per_lamp != -1.0 {
        return Err(
            numbers.fault(&format!("{per_lamp} lumens per lamp: -1 says that they are not known"))
        );
    }
    let mut factor = numbers.next("the multiplier of candela")?;
    if factor < 0.0 {
        return Err(numbers.fault(&format!("a multiplier of {factor}: must not be negative")));
    }
    let verticals = numbers.count("the number of vertical angles")?;
    let horizontals = numbers.count("the number of horizontal angles")?;
    let kind = match numbers.next("the photometric type")? {
        1.0 => Goniometer::C,
        2.0 => Goniometer::B,
        3.0 => Goniometer::A,
        other => {
            let what = format!("the photometric type is {other}: 1 is C, 2 is B, 3 is A");
            return Err(numbers.fault(&what));
        }
    };
    let unit = match numbers.next("the type of units")? {
        1.0 => 0.3048,
        2.0 => 1.0,
        other => {
            let what = format!("the type of units is {other}: 1 is feet, 2 is metres");
            return Err(numbers.fault(&what));
        }
    };
    // Negative sizes say that the shape is round.
    let mut size = [0.0; 3];
    for (size, what) in size.iter_mut().zip(["width", "length", "height"]) {
        *size = numbers.next(&format!("the luminous {what}"))?.abs() * unit;
    }
    for what in ["the ballast factor", "the ballast-lamp factor"] {
        let value = numbers.next(what)?;
        if value <= 0.0 {
            return Err(numbers.fault(&format!("{what} is {value}: must be above 0")));
        }
        // Measured candela are those of a reference ballast.
        factor *= value;
    }
    let watts = numbers.next("the input watts")?;
    let (up, round) = match kind {
        Goniometer::C => ((0.0, 180.0), (0.0, 360.0)),
        Goniometer::A | Goniometer::B => ((-90.0, 90.0), (-90.0, 90.0)),
    };
    let vertical = numbers.angles("vertical", verticals, up)?;
    let horizontal = numbers.angles("horizontal", horizontals, round)?;
    if kind == Goniometer::C {
        let (first, last) = (horizontal[0], horizontal[horizontals - 1]);
        let is_known = horizontals == 1
            || (first == 0.0 && (last == 90.0 || last >= 180.0))
            || (first == 90.0 && last == 270.0);
        if !is_known {
            return Err(numbers.fault(&format!(
                "horizontal angles from {first} to {last}: they go from 0 to 90, 180 or 360, or from 90 to 270"
            )));
        }
    }
    let mut candela = Vec::new();
    for plane in &horizontal {
        for angle in &vertical {
            let value = numbers.next(&format!("the candela at {angle}, {plane} degrees"))?;
            if value < 0.0 {
                return Err(numbers.fault(&format!("{value} candela: must not be negative")));
            }
            candela.push((value * factor).min(f64::from(f32::MAX)) as f32);
        }
    }
    // -1 stands for absolute photometry: the candela hold as they are.
    let lamp_flux = (per_lamp >= 0.0).then_some(lamps * per_lamp);
    let about = About { format, text, lamp_flux, stated_flux: None, watts, size };
    Ok(Photometry::new(kind, vertical, horizontal, candela, about))
}
