//! Moments of a film, and its frames.

use serde::{Deserialize, Serialize};
use std::collections::HashSet;

/// A moment of a film: a frame, or between two.
///
/// ```
/// use spandrel_engine::moment::Moment;
///
/// let moment = Moment { frame: 36.0, rate: 24.0 };
/// assert_eq!(moment.seconds(), 1.5);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Moment {
    /// The frame; with a fraction where a shutter is open between two.
    pub frame: f64,
    /// Frames of a second.
    pub rate: f64,
}

impl Moment {
    /// Frames of a second, if nobody says how many.
    pub const RATE: f64 = 24.0;

    /// A frame at the usual rate.
    pub fn of_frame(frame: f64) -> Moment {
        Moment { frame, rate: Moment::RATE }
    }

    /// The time in seconds: frame 0 is at 0.
    pub fn seconds(self) -> f64 {
        self.frame / self.rate
    }

    /// The moment some frames later.
    #[must_use]
    pub fn later(self, frames: f64) -> Moment {
        Moment { frame: self.frame + frames, ..self }
    }
}

impl Default for Moment {
    /// The first frame at the usual rate.
    fn default() -> Moment {
        Moment::of_frame(1.0)
    }
}

/// The most frames of a list: a slip of a finger must not fill a disk.
const MOST: u64 = 100_000;

/// Frames in the order in which they are made, each once.
///
/// ```
/// use spandrel_engine::moment::Frames;
///
/// let frames: Frames = "1-10x4,-2--1,5".parse().unwrap();
/// assert_eq!(frames.as_slice(), [1, 5, 9, -2, -1]);
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frames(Vec<i64>);

impl Frames {
    /// One frame.
    pub fn one(frame: i64) -> Frames {
        Frames(vec![frame])
    }

    /// Some frames at a time, in order.
    pub fn chunks(&self, size: usize) -> impl Iterator<Item = Frames> {
        self.0.chunks(size.max(1)).map(|frames| Frames(frames.to_vec()))
    }

    /// The frames; there is at least one.
    pub fn as_slice(&self) -> &[i64] {
        &self.0
    }
}

impl std::fmt::Display for Frames {
    /// As they can be read again; steps that are equal are written as a range.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut rest = &self.0[..];
        while let [first, ..] = rest {
            if rest.len() < self.0.len() {
                f.write_str(",")?;
            }
            let step = rest.get(1).map_or(1, |second| second - first);
            let is_next = |(at, frame): (usize, &i64)| *frame == first + step * at as i64;
            let run =
                rest.iter().enumerate().take_while(|(at, frame)| is_next((*at, frame))).count();
            // Two alone are no range.
            let run = if run == 2 && step.abs() != 1 { 1 } else { run };
            match (run, step.abs()) {
                (1, _) => write!(f, "{first}")?,
                (_, 1) => write!(f, "{first}-{}", rest[run - 1])?,
                (_, step) => write!(f, "{first}-{}x{step}", rest[run - 1])?,
            }
            rest = &rest[run..];
        }
        Ok(())
    }
}

impl std::str::FromStr for Frames {
    type Err = String;

    /// Frames as farms write them: `7`, `1-48`, `1-100x2` for every second (`1-100:2` is the same), several with commas
    /// between them; frames may be negative, and ranges may go down.
    fn from_str(text: &str) -> Result<Frames, String> {
        let how = "write frames as 7, 1-48, 1-100x2, or several with commas, such as 1-20,30";
        let mut frames = Vec::new();
        let mut known = HashSet::new();
        for part in text.split(',') {
            let part = part.trim();
            let wrong = || format!("\"{part}\" is no range of frames: {how}");
            let (first, rest) = whole_number(part).ok_or_else(wrong)?;
            let (last, rest) = match rest.strip_prefix('-') {
                Some(rest) => whole_number(rest).ok_or_else(wrong)?,
                None if rest.starts_with(':') => {
                    return Err(format!(
                        "\"{part}\": a colon means a step in some programs, and to in others: write {first}-LAST, or \
                         {first}-LASTxSTEP"
                    ));
                }
                None => (first, rest),
            };
            let step = match rest.strip_prefix(['x', 'X', ':']) {
                Some(step) => {
                    step.parse::<u64>().ok().filter(|step| *step > 0).ok_or_else(|| {
                        format!("\"{part}\": a step is a whole number above 0: {how}")
                    })?
                }
                None if rest.is_empty() => 1,
                None => return Err(wrong()),
            };
            let count = first.abs_diff(last) / step + 1;
            if count + frames.len() as u64 > MOST {
                return Err(format!("\"{text}\" has more than {MOST} frames: render it in parts"));
            }
            // Within the range, which has fewer than a million.
            let way = |i: u64| (i * step) as i64;
            let made =
                (0..count).map(|i| if last >= first { first + way(i) } else { first - way(i) });
            frames.extend(made.filter(|frame| known.insert(*frame)));
        }
        Ok(Frames(frames))
    }
}

/// The whole number that a text begins with, and the rest. Nobody counts frames in billions.
fn whole_number(text: &str) -> Option<(i64, &str)> {
    let digits = text.strip_prefix('-').unwrap_or(text);
    let length = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
    let (number, rest) = text.split_at(text.len() - digits.len() + length);
    Some((i64::from(number.parse::<i32>().ok()?), rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_written_as_they_are_read() {
        for text in ["7", "1-48", "1-9x4", "1,5,7-9", "-2--1,3-1", "1,100,2"] {
            assert_eq!(text.parse::<Frames>().unwrap().to_string(), text);
        }
        let frames: Frames = "1-10".parse().unwrap();
        let chunks: Vec<String> = frames.chunks(4).map(|chunk| chunk.to_string()).collect();
        assert_eq!(chunks, ["1-4", "5-8", "9-10"]);
    }

    #[test]
    fn frames_are_read_as_farms_write_them() {
        let frames = |text: &str| text.parse::<Frames>().map(|frames| frames.0);
        assert_eq!(frames("1-100x25,150"), Ok(vec![1, 26, 51, 76, 150]));
        assert_eq!(frames("1-7:3"), Ok(vec![1, 4, 7]));
        assert_eq!(frames("-3--1, -5"), Ok(vec![-3, -2, -1, -5]));
        assert_eq!(frames("3-1,2"), Ok(vec![3, 2, 1]));
        assert_eq!(frames("-1-1"), Ok(vec![-1, 0, 1]));
        assert_eq!(frames("2147483640-2147483647x100"), Ok(vec![2_147_483_640]));
        for wrong in ["", "1-", "a", "1-2x0", "1-2x", "1--", "1-2-3", "1,,2", "1.5", "99999999999"]
        {
            assert!(frames(wrong).unwrap_err().contains("write frames as"), "{wrong}");
        }
        assert!(frames("1:10").unwrap_err().contains("write 1-LAST"));
        assert!(frames("-2000000000-2000000000").unwrap_err().contains("in parts"));
    }
}
