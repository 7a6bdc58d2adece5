//! Curves: values at frames, and what lies between them.

use std::ops::Range;

use super::form::Form;
use super::parts;
use crate::text::{Diagnostic, list, nearest};

/// How a value gets from one key to the next.
#[derive(Clone, Debug, PartialEq)]
enum Way {
    /// Not before the next key.
    Step,
    /// By a straight line.
    Linear,
    /// By a cubic that never leaves the range of the two: monotone, by the slopes of Fritsch and Butland (1984).
    Smooth,
    /// By a cubic with slopes of its own, per frame: the one that arrives at the key, and the one that leaves it.
    Cubic(Vec<f64>, Vec<f64>),
}

/// What there is before the first key, or behind the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Beyond {
    /// The value of that key.
    Hold,
    /// The straight line at that key.
    Linear,
    /// The keys once more, again and again.
    Cycle,
}

#[derive(Debug)]
struct CurveKey {
    frame: f64,
    value: Form,
    way: Way,
}

/// `Curve([(1, 0), (48, 2)])`, `Curve([(1, 0), (48, 2)], Linear)`, or with all its parts named:
/// `Curve(keys: [(1, 0), (24, 5, Linear), (48, 2)], between: Smooth, before: Hold, after: Cycle)`.
#[derive(Debug)]
pub(super) struct Curve {
    keys: Vec<CurveKey>,
    before: Beyond,
    after: Beyond,
}

const WAYS: &str = "Step, Linear, Smooth, Cubic(slope) or Cubic(slope in, slope out)";
/// What is said of curves that have values by place and by name.
pub(crate) const NAMED: &str =
    "write Curve([..], Linear), or name all: Curve(keys: [..], between: Linear, after: Cycle)";
const HOW: &str = "write Curve([(1, 0.5), (24, 2)]): frames with values";

impl Curve {
    /// Reads a curve of a text; all places are the text's.
    pub(super) fn parse(text: &str, place: Range<usize>) -> Result<Curve, Box<Diagnostic>> {
        let fault =
            |at: &Range<usize>, message: String| Box::new(Diagnostic::error(at.clone(), message));
        let helped = |fault: Box<Diagnostic>, how: &str| Box::new(fault.help(how));
        let (mut keys, mut between) = (None, Way::Smooth);
        let (mut before, mut after) = (Beyond::Hold, Beyond::Hold);
        let all = parts(text, &place);
        // RON has values by place or by name, not both in one.
        if let [first, .., last] = &all[..]
            && first.key.is_none() != last.key.is_none()
        {
            let fault = fault(&place, "a curve has some parts by name and some without".to_owned());
            return Err(helped(fault, NAMED));
        }
        for (number, part) in all.into_iter().enumerate() {
            let (name, value) = (&part.key, part.value);
            match name.as_ref().map(|name| &text[name.clone()]) {
                None if number == 0 => keys = Some(value),
                None if number == 1 => between = way(text, &value, None)?,
                Some("keys") => keys = Some(value),
                Some("between") => between = way(text, &value, None)?,
                Some(side @ ("before" | "after")) => {
                    let beyond = match &text[value.clone()] {
                        "Hold" => Beyond::Hold,
                        "Linear" => Beyond::Linear,
                        "Cycle" => Beyond::Cycle,
                        _ => {
                            let message = format!("`{side}` of a curve is Hold, Linear or Cycle");
                            return Err(fault(&value, message));
                        }
                    };
                    *(if side == "before" { &mut before } else { &mut after }) = beyond;
                }
                other => {
                    let other = other.unwrap_or("this");
                    let known = ["keys", "between", "before", "after"];
                    let cure = match nearest(other, known) {
                        Some(near) => format!("did you mean `{near}`?"),
                        None => format!("it has {}", list(known)),
                    };
                    let at = name.clone().unwrap_or(value);
                    return Err(fault(&at, format!("a curve has no `{other}`: {cure}")));
                }
            }
        }
        let list = keys.filter(|keys| text[keys.clone()].starts_with('['));
        let list =
            list.ok_or_else(|| helped(fault(&place, "a curve needs its keys".to_owned()), HOW))?;
        let keys: Vec<CurveKey> = parts(text, &list)
            .into_iter()
            .map(|part| key(text, &part.value, &between))
            .collect::<Result<_, _>>()?;
        let Some(first) = keys.first() else {
            return Err(helped(fault(&list, "a curve needs at least one key".to_owned()), HOW));
        };
        for (pair, part) in keys.windows(2).zip(parts(text, &list).iter().skip(1)) {
            let [a, b] = pair else { continue };
            if b.frame <= a.frame {
                let message = format!(
                    "this key's frame, {}, is not behind that of the one before, {}",
                    b.frame, a.frame
                );
                return Err(helped(
                    fault(&part.value, message),
                    "put the keys in the order of their frames",
                ));
            }
            let is_mixed = a.way != Way::Step || !keys.iter().all(|key| key.way == Way::Step);
            if is_mixed && !b.value.is_like(&first.value) {
                let message = "this value has another form than the first, so that there is nothing between them";
                let cure = "give all keys values of one form, or make it a curve of steps: `between: Step`";
                return Err(helped(fault(&part.value, message.to_owned()), cure));
            }
        }
        let linear = [before, after].contains(&Beyond::Linear);
        if linear && keys.iter().any(|key| !key.value.is_like(&first.value)) {
            let message = "these values have no slope to go on by: use Hold or Cycle";
            return Err(fault(&place, message.to_owned()));
        }
        Ok(Curve { keys, before, after })
    }

    /// The value at a frame, as a text.
    pub(super) fn at(&self, frame: f64) -> String {
        let (first, last) = (&self.keys[0], &self.keys[self.keys.len() - 1]);
        let (start, end) = (first.frame, last.frame);
        let side = if frame < start { self.before } else { self.after };
        let is_beyond = frame < start || frame > end;
        let frame = match side {
            Beyond::Cycle if is_beyond && end > start => {
                start + (frame - start).rem_euclid(end - start)
            }
            Beyond::Linear if is_beyond && self.keys.len() > 1 => {
                let (key, slopes) = match frame < start {
                    true => (first, self.slopes(0).0),
                    false => (last, self.slopes(self.keys.len() - 2).1),
                };
                let all = key.value.numbers.iter().zip(&slopes);
                let numbers: Vec<f64> =
                    all.map(|(value, slope)| value + slope * (frame - key.frame)).collect();
                return key.value.with(&numbers);
            }
            _ => frame.clamp(start, end),
        };
        let at = self.keys.partition_point(|key| key.frame <= frame).saturating_sub(1);
        let key = &self.keys[at];
        let Some(next) =
            self.keys.get(at + 1).filter(|_| frame > key.frame && key.way != Way::Step)
        else {
            return key.value.with(&key.value.numbers);
        };
        let width = next.frame - key.frame;
        let t = (frame - key.frame) / width;
        let (leaves, arrives) = self.slopes(at);
        let mixed = |i: usize| {
            let (a, b) = (key.value.numbers[i], next.value.numbers[i]);
            if key.way == Way::Linear {
                return a + (b - a) * t;
            }
            // Hermite's cubic, as the straight line and what bends it.
            let (p, q) = (leaves[i] * width - (b - a), (b - a) - arrives[i] * width);
            a + (b - a) * t + t * (1.0 - t) * (p * (1.0 - t) + q * t)
        };
        key.value.with(&(0..key.value.numbers.len()).map(mixed).collect::<Vec<f64>>())
    }

    /// The slopes with which the way from a key to the next leaves and arrives.
    fn slopes(&self, at: usize) -> (Vec<f64>, Vec<f64>) {
        let (key, next) = (&self.keys[at], &self.keys[at + 1]);
        let monotone = |at: usize| -> Vec<f64> {
            (0..key.value.numbers.len()).map(|i| self.monotone(at, i)).collect()
        };
        match (&key.way, &next.way) {
            (Way::Step, _) => {
                let none = vec![0.0; key.value.numbers.len()];
                (none.clone(), none)
            }
            (Way::Linear, _) => {
                let line: Vec<f64> =
                    (0..key.value.numbers.len()).map(|i| self.secant(at, i)).collect();
                (line.clone(), line)
            }
            (Way::Smooth, _) => (monotone(at), monotone(at + 1)),
            (Way::Cubic(_, leaves), Way::Cubic(arrives, _)) => (leaves.clone(), arrives.clone()),
            (Way::Cubic(_, leaves), _) => (leaves.clone(), monotone(at + 1)),
        }
    }

    /// The slope of the straight line from a key to the next, of one of the numbers.
    fn secant(&self, at: usize, i: usize) -> f64 {
        let (a, b) = (&self.keys[at], &self.keys[at + 1]);
        (b.value.numbers[i] - a.value.numbers[i]) / (b.frame - a.frame)
    }

    /// The slope at a key with which no cubic leaves the range of its ends.
    fn monotone(&self, at: usize, i: usize) -> f64 {
        let last = self.keys.len() - 1;
        let width = |at: usize| self.keys[at + 1].frame - self.keys[at].frame;
        if last == 1 {
            return self.secant(0, i);
        }
        // At an end: by the three nearest keys, held back where it would leave the range.
        let end = |near: usize, far: usize| {
            let (h, g) = (width(near), width(far));
            let (d, e) = (self.secant(near, i), self.secant(far, i));
            let slope = ((2.0 * h + g) * d - h * e) / (h + g);
            if slope * d <= 0.0 {
                0.0
            } else if d * e <= 0.0 && slope.abs() > 3.0 * d.abs() {
                3.0 * d
            } else {
                slope
            }
        };
        if at == 0 {
            return end(0, 1);
        }
        if at == last {
            return end(last - 1, last - 2);
        }
        let (d, e) = (self.secant(at - 1, i), self.secant(at, i));
        if d * e <= 0.0 {
            return 0.0;
        }
        let (h, g) = (width(at - 1), width(at));
        let (v, w) = (2.0 * g + h, g + 2.0 * h);
        (v + w) / (v / d + w / e)
    }
}

/// A key: its frame, its value, and how it gets to the next.
fn key(text: &str, place: &Range<usize>, between: &Way) -> Result<CurveKey, Box<Diagnostic>> {
    let written = &text[place.clone()];
    let wrong = |at: &Range<usize>, message: &str| {
        Err(Box::new(Diagnostic::error(at.clone(), message.to_owned()).help(HOW)))
    };
    let parts = if written.starts_with('(') { parts(text, place) } else { Vec::new() };
    let [frame, value, rest @ ..] = &parts[..] else {
        return wrong(place, "a key is a frame and a value in parentheses");
    };
    if rest.len() > 1 || parts.iter().any(|part| part.key.is_some()) {
        return wrong(place, "a key is a frame, a value, and perhaps how it gets to the next");
    }
    let number = text[frame.value.clone()].replace('_', "").parse::<f64>();
    let Some(number) = number.ok().filter(|frame| frame.is_finite() && frame.abs() <= 1e9) else {
        return wrong(&frame.value, "a key's frame is a number");
    };
    let form = Form::of(&text[value.value.clone()]);
    if form.numbers.iter().any(|number| !number.is_finite()) {
        return wrong(&value.value, "this number is not finite");
    }
    let way = match rest {
        [own] => way(text, &own.value, Some(&form))?,
        _ => between.clone(),
    };
    Ok(CurveKey { frame: number, value: form, way })
}

/// How a value gets on; slopes must have the form of the value.
fn way(text: &str, place: &Range<usize>, value: Option<&Form>) -> Result<Way, Box<Diagnostic>> {
    let fault = |message: String| Err(Box::new(Diagnostic::error(place.clone(), message)));
    match &text[place.clone()] {
        "Step" => Ok(Way::Step),
        "Linear" => Ok(Way::Linear),
        "Smooth" => Ok(Way::Smooth),
        cubic if cubic.starts_with("Cubic") && cubic.ends_with(')') => {
            let Some(value) = value else {
                return fault("a cubic has slopes of its own at each key: say it there".to_owned());
            };
            let slopes: Vec<Form> =
                parts(text, place).iter().map(|part| Form::of(&text[part.value.clone()])).collect();
            let (arrives, leaves) = match &slopes[..] {
                [both] => (both, both),
                [arrives, leaves] => (arrives, leaves),
                _ => return fault(format!("this is {}: {WAYS}", "no way to the next key")),
            };
            match [arrives, leaves].iter().all(|slope| slope.is_like(value)) {
                true => Ok(Way::Cubic(arrives.numbers.clone(), leaves.numbers.clone())),
                false => fault("a slope has the form of its value, per frame".to_owned()),
            }
        }
        _ => fault(format!("this is no way to the next key: it is {WAYS}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(text: &str) -> Curve {
        Curve::parse(text, 0..text.len()).unwrap()
    }

    fn at(text: &str, frame: f64) -> f64 {
        curve(text).at(frame).parse().unwrap()
    }

    #[test]
    fn ways_from_key_to_key() {
        let keys = |way: &str| format!("Curve([(0, 0), (10, 10), (20, 0)], {way})");
        assert_eq!(at(&keys("Step"), 9.9), 0.0);
        assert_eq!(at(&keys("Step"), 10.0), 10.0);
        assert_eq!(at(&keys("Linear"), 12.5), 7.5);
        // Level at the top: Hermite's cubic with slopes (15 + ... )/2 at the start, 0 at the top.
        let smooth = at(&keys("Smooth"), 5.0);
        assert!((smooth - (5.0 + 10.0 * (2.0 - 0.0) / 8.0)).abs() < 1e-12, "{smooth}");
        // A cubic through y = x^3 with its own slopes is y = x^3.
        let cube = "Curve([(0, 0, Cubic(0)), (2, 8, Cubic(12, 12)), (3, 27, Cubic(27))])";
        for frame in [0.0, 0.5, 1.7, 2.0, 2.9, 3.0] {
            assert!((at(cube, frame) - frame * frame * frame).abs() < 1e-12, "{frame}");
        }
    }

    #[test]
    fn smooth_never_leaves_the_range_of_its_keys() {
        let text = "Curve([(0, 0), (1, 0), (2, 1), (3, 10), (4, 10), (5, -3), (6, -3.5)])";
        let values = [0.0, 0.0, 1.0, 10.0, 10.0, -3.0, -3.5];
        for step in 0..600 {
            let frame = f64::from(step) / 100.0;
            let (a, b) = (values[step as usize / 100], values[step as usize / 100 + 1]);
            let value = at(text, frame);
            assert!(
                value >= f64::min(a, b) - 1e-12 && value <= f64::max(a, b) + 1e-12,
                "{frame}: {value}"
            );
        }
    }

    #[test]
    fn beyond_the_keys() {
        let keys = |side: &str| {
            format!(
                "Curve(keys: [(10, 1), (20, 3)], between: Linear, before: {side}, after: {side})"
            )
        };
        assert_eq!((at(&keys("Hold"), 0.0), at(&keys("Hold"), 99.0)), (1.0, 3.0));
        assert_eq!((at(&keys("Linear"), 0.0), at(&keys("Linear"), 25.0)), (-1.0, 4.0));
        assert_eq!((at(&keys("Cycle"), 5.0), at(&keys("Cycle"), 25.0)), (2.0, 2.0));
        assert_eq!((at(&keys("Cycle"), 20.0), at(&keys("Cycle"), 30.0)), (3.0, 1.0));
        assert_eq!(at("Curve(keys: [(10, 1)], before: Cycle, after: Linear)", 50.0), 1.0);
    }

    #[test]
    fn values_of_any_form_move() {
        let step = curve(
            "Curve([(1, [Move(0, 0, 0), TurnY(0)]), (3, [Move(4, 0, 2), TurnY(90)])], Linear)",
        );
        assert_eq!(step.at(2.0), "[Move(2,0,1),TurnY(45)]");
        let names = curve("Curve([(1, \"a.png\"), (5, \"b.png\")], Step)");
        assert_eq!([names.at(4.9), names.at(5.0)], ["\"a.png\"", "\"b.png\""]);
        let color = curve("Curve([(1, \"#000\"), (3, \"#fff\")], Linear)");
        assert_eq!(color.at(2.0), "(0.5, 0.5, 0.5)");
        let vector = curve("Curve(keys: [(1, (0, 0), Cubic((1, 2))), (2, (1, 2))])");
        assert_eq!(vector.at(1.5), "(0.5,1)");
    }

    #[test]
    fn faults_name_their_place() {
        let fault = |text: &str| {
            let fault = Curve::parse(text, 0..text.len()).unwrap_err();
            (text[fault.span.clone()].to_owned(), fault.message)
        };
        assert_eq!(fault("Curve([(1, 0), (1, 2)])").0, "(1, 2)");
        assert_eq!(fault("Curve([(1, 0), (2, (2, 3, 4))])").0, "(2, (2, 3, 4))");
        assert_eq!(fault("Curve([(1, 0), (x, 2)])").0, "x");
        assert_eq!(fault("Curve([(1, 0, Fast)])").0, "Fast");
        assert_eq!(fault("Curve(keys: [(1, 0)], after: Loop)").0, "Loop");
        assert_eq!(fault("Curve(keys: [(1, 0)], befor: Hold)").0, "befor");
        assert_eq!(fault("Curve([(1, 0, Cubic((1, 2)))])").0, "Cubic((1, 2))");
        assert_eq!(fault("Curve([])").0, "[]");
        assert!(fault("Curve([(1, 0)], after: Hold)").1.contains("by name"));
        assert!(fault("Curve()").1.contains("needs its keys"));
        assert!(fault("Curve([(1, true), (2, false)])").1.contains("another form"));
        assert!(fault("Curve([(1, 1e999)])").1.contains("finite"));
    }
}
