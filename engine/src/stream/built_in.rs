//! The functions of the language; names and ranges are those of SeExpr and OSL.

use super::ProgramFault;
use super::compile::{Compiler, Value, meant};
use super::run::{Binary, Op, Unary};

/// Each by its name, with the least and the greatest number of values that it takes.
const FUNCTIONS: [(&str, usize, usize); 56] = [
    ("abs", 1, 1),
    ("acos", 1, 1),
    ("asin", 1, 1),
    ("atan", 1, 1),
    ("atan2", 2, 2),
    ("bias", 2, 2),
    ("boxstep", 2, 2),
    ("ceil", 1, 1),
    ("cellnoise", 1, 1),
    ("clamp", 3, 3),
    ("contrast", 2, 2),
    ("cos", 1, 1),
    ("cross", 2, 2),
    ("deg", 1, 1),
    ("dist", 2, 2),
    ("dot", 2, 2),
    ("exp", 1, 1),
    ("fbm", 1, 4),
    ("fit", 5, 5),
    ("floor", 1, 1),
    ("fmod", 2, 2),
    ("gamma", 2, 2),
    ("gaussstep", 3, 3),
    ("hsltorgb", 1, 1),
    ("hypot", 2, 2),
    ("invert", 1, 1),
    ("length", 1, 1),
    ("linearstep", 3, 3),
    ("log", 1, 1),
    ("log10", 1, 1),
    ("luminance", 1, 1),
    ("max", 2, 8),
    ("min", 2, 8),
    ("mix", 3, 3),
    ("noise", 1, 1),
    ("norm", 1, 1),
    ("pow", 2, 2),
    ("rad", 1, 1),
    ("remap", 5, 5),
    ("rgbtohsl", 1, 1),
    ("round", 1, 1),
    ("saturate", 2, 2),
    ("sign", 1, 1),
    ("sin", 1, 1),
    ("smoothstep", 3, 3),
    ("snoise", 1, 1),
    ("sqrt", 1, 1),
    ("step", 2, 2),
    ("tan", 1, 1),
    ("turbulence", 1, 4),
    ("up", 1, 2),
    ("vcell", 1, 1),
    ("vfbm", 1, 4),
    ("vnoise", 1, 1),
    ("voronoi", 1, 3),
    ("vturbulence", 1, 4),
];

/// The functions that take the names of things.
pub(super) const OF_NAMES: [&str; 2] = ["material", "object"];

/// The names of all functions.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    FUNCTIONS.iter().map(|(name, ..)| *name).chain(OF_NAMES)
}

impl Compiler<'_> {
    pub(super) fn built_in(
        &mut self,
        at: usize,
        name: &str,
        values: &[Value],
    ) -> Result<Value, ProgramFault> {
        let Some((_, least, most)) = FUNCTIONS.iter().find(|(known, ..)| *known == name) else {
            let mut known: Vec<&str> = names().collect();
            known.extend(self.functions.keys());
            known.sort_unstable();
            let message = format!("there is no function \"{name}\": {}", meant(name, &known));
            return Err(ProgramFault::new(at, message));
        };
        if !(least..=most).contains(&&values.len()) {
            let wanted =
                if least == most { least.to_string() } else { format!("{least} to {most}") };
            let message = format!("{name} takes {wanted} values, not {}", values.len());
            return Err(ProgramFault::new(at, message));
        }
        let x = &values[0];
        let plain = |this: &mut Self, op| this.each(op, x);
        match name {
            "abs" => plain(self, Unary::Abs),
            "acos" => plain(self, Unary::Acos),
            "asin" => plain(self, Unary::Asin),
            "atan" => plain(self, Unary::Atan),
            "cos" | "sin" => {
                let wave = plain(self, if name == "sin" { Unary::Sin } else { Unary::Cos })?;
                let left = self.one(Unary::Sinc, x.width)?;
                let left = Value { parts: vec![left], width: self.number(0.0)? };
                let filtered = self.binary("*", &wave, &left)?;
                Ok(Value { width: x.width, ..filtered })
            }
            "tan" => plain(self, Unary::Tan),
            "exp" => plain(self, Unary::Exp),
            "log" => plain(self, Unary::Log),
            "sqrt" => plain(self, Unary::Sqrt),
            "floor" => plain(self, Unary::Floor),
            "ceil" => plain(self, Unary::Ceil),
            "round" => plain(self, Unary::Round),
            "sign" => plain(self, Unary::Sign),
            "deg" => self.scaled(x, 180.0 / std::f64::consts::PI),
            "rad" => self.scaled(x, std::f64::consts::PI / 180.0),
            "log10" => {
                let log = plain(self, Unary::Log)?;
                self.scaled(&log, std::f64::consts::LOG10_E)
            }
            "invert" => {
                let one = self.constant(1.0)?;
                self.binary("-", &one, x)
            }
            "atan2" => self.parted(Binary::Atan2, x, &values[1]),
            "pow" => self.parted(Binary::Power, x, &values[1]),
            "fmod" => self.parted(Binary::Modulo, x, &values[1]),
            // Steps: 1 where the first is the second or more.
            "boxstep" | "step" => {
                let (value, from) = if name == "step" { (&values[1], x) } else { (x, &values[1]) };
                self.parted(Binary::GreaterEqual, value, from)
            }
            "hypot" => {
                let (a, b) = (self.binary("*", x, x)?, self.binary("*", &values[1], &values[1])?);
                let sum = self.binary("+", &a, &b)?;
                self.each(Unary::Sqrt, &sum)
            }
            "max" | "min" => {
                let op = if name == "max" { Binary::Max } else { Binary::Min };
                let mut value = x.clone();
                for other in &values[1..] {
                    value = self.parted(op, &value, other)?;
                }
                Ok(value)
            }
            "clamp" => {
                let low = self.parted(Binary::Max, x, &values[1])?;
                self.parted(Binary::Min, &low, &values[2])
            }
            "mix" => {
                let count = values.iter().map(|value| value.parts.len()).max().unwrap_or(1);
                let [a, b, t] = [0, 1, 2].map(|i| self.spread(&values[i]));
                let parts = (0..count)
                    .map(|i| self.push(Op::Mix([a[i], b[i], t[i]])))
                    .collect::<Result<_, _>>()?;
                let widths = self.two(Binary::Max, x.width, values[1].width)?;
                let width = self.two(Binary::Add, widths, values[2].width)?;
                Ok(Value { parts, width })
            }
            "linearstep" | "smoothstep" | "gaussstep" => {
                let t = self.share(x, &values[1], &values[2])?;
                match name {
                    "linearstep" => Ok(t),
                    "smoothstep" => self.each(Unary::Hermite, &t),
                    _ => {
                        // SeExpr's: 2^(-8 (1 - t)^2), and nothing below.
                        let one = self.constant(1.0)?;
                        let off = self.binary("-", &one, &t)?;
                        let square = self.binary("*", &off, &off)?;
                        let power = self.scaled(&square, -8.0 * std::f64::consts::LN_2)?;
                        let bell = self.each(Unary::Exp, &power)?;
                        let is_above = self.parted(Binary::GreaterEqual, x, &values[1])?;
                        self.binary("*", &bell, &is_above)
                    }
                }
            }
            "fit" => {
                let way = self.binary("-", x, &values[1])?;
                let whole = self.binary("-", &values[2], &values[1])?;
                let t = self.binary("/", &way, &whole)?;
                let to = self.binary("-", &values[4], &values[3])?;
                let part = self.binary("*", &t, &to)?;
                self.binary("+", &values[3], &part)
            }
            "bias" => {
                // x^(log b / log 0.5)
                let log = self.each(Unary::Log, &values[1])?;
                let power = self.scaled(&log, -1.0 / std::f64::consts::LN_2)?;
                self.parted(Binary::Power, x, &power)
            }
            "gamma" => {
                let one = self.constant(1.0)?;
                let power = self.binary("/", &one, &values[1])?;
                self.parted(Binary::Power, x, &power)
            }
            "contrast" => {
                // SeExpr's: bias from both ends.
                let (one, half) = (self.constant(1.0)?, self.constant(0.5)?);
                let c = self.binary("-", &one, &values[1])?;
                let twice = self.scaled(x, 2.0)?;
                let two = self.constant(2.0)?;
                let other = self.binary("-", &two, &twice)?;
                let low = self.built_in(at, "bias", &[twice, c.clone()])?;
                let high = self.built_in(at, "bias", &[other, c])?;
                let (low, high) = (self.scaled(&low, 0.5)?, self.scaled(&high, 0.5)?);
                let high = self.binary("-", &one, &high)?;
                let is_low = self.parted(Binary::Less, x, &half)?;
                let parts: Vec<u32> = (0..x.parts.len())
                    .map(|i| {
                        let (c, a, b) =
                            (self.spread(&is_low), self.spread(&low), self.spread(&high));
                        self.choose(c[i], a[i], b[i])
                    })
                    .collect::<Result<_, _>>()?;
                Ok(Value { parts, width: x.width })
            }
            "dot" | "dist" | "length" => {
                let (a, b) = match name {
                    "dot" => (x.clone(), values[1].clone()),
                    "dist" => {
                        let way = self.binary("-", x, &values[1])?;
                        (way.clone(), way)
                    }
                    _ => (x.clone(), x.clone()),
                };
                let dot = self.dot(&a, &b)?;
                let part = if name == "dot" { dot } else { self.one(Unary::Sqrt, dot)? };
                let width = if values.len() > 1 {
                    self.two(Binary::Add, x.width, values[1].width)?
                } else {
                    x.width
                };
                Ok(Value { parts: vec![part], width })
            }
            "norm" => {
                let square = self.dot(x, x)?;
                let length = self.one(Unary::Sqrt, square)?;
                let length = Value { parts: vec![length], width: x.width };
                self.binary("/", x, &length)
            }
            "cross" => {
                let (a, b) = (self.spread(x), self.spread(&values[1]));
                let mut parts = Vec::new();
                for (i, j) in [(1, 2), (2, 0), (0, 1)] {
                    let (p, q) = (
                        self.two(Binary::Multiply, a[i], b[j])?,
                        self.two(Binary::Multiply, a[j], b[i])?,
                    );
                    parts.push(self.two(Binary::Subtract, p, q)?);
                }
                let width = self.two(Binary::Add, x.width, values[1].width)?;
                Ok(Value { parts, width })
            }
            "luminance" => {
                let grey = self.luminance(x)?;
                Ok(Value { parts: vec![grey], width: x.width })
            }
            "saturate" => {
                let grey = self.luminance(x)?;
                let grey = Value { parts: vec![grey], width: x.width };
                self.built_in(at, "mix", &[grey, x.clone(), values[1].clone()])
            }
            // How far a normal faces up, or another direction: 0 to 1.
            "up" => {
                let to = match values.get(1) {
                    Some(to) => to.clone(),
                    None => {
                        let (zero, one) = (self.number(0.0)?, self.number(1.0)?);
                        Value { parts: vec![zero, one, zero], width: zero }
                    }
                };
                let dot = self.dot(x, &to)?;
                let zero = self.number(0.0)?;
                let part = self.two(Binary::Max, dot, zero)?;
                Ok(Value { parts: vec![part], width: x.width })
            }
            "rgbtohsl" | "hsltorgb" => {
                let from = self.spread(x);
                let is_back = name == "hsltorgb";
                let parts = (0..3)
                    .map(|part| self.push(Op::Hue { from, part, is_back }))
                    .collect::<Result<_, _>>()?;
                Ok(Value { parts, width: x.width })
            }
            "noise" | "snoise" | "vnoise" => {
                let mut parts = Vec::new();
                for k in 0..if name == "vnoise" { 3 } else { 1 } {
                    let from = self.moved(x, k)?;
                    let value = self.push(Op::Perlin { from, width: x.width })?;
                    parts.push(if name == "noise" { self.halved(value)? } else { value });
                }
                Ok(Value { parts, width: x.width })
            }
            "fbm" | "turbulence" | "vfbm" | "vturbulence" => {
                let turbulent = name.ends_with("turbulence");
                let mut numbers = [6.0, 2.0, 0.5].map(|number| self.number(number));
                let mut shape = [0; 3];
                for (i, (slot, usual)) in shape.iter_mut().zip(&mut numbers).enumerate() {
                    *slot = match values.get(i + 1) {
                        Some(value) => value.parts[0],
                        None => std::mem::replace(usual, Ok(0))?,
                    };
                }
                let mut parts = Vec::new();
                for k in 0..if name.starts_with('v') { 3 } else { 1 } {
                    let from = self.moved(x, k)?;
                    let op = Op::Octaves { from, width: x.width, shape, turbulent };
                    let value = self.push(op)?;
                    parts.push(if turbulent { value } else { self.halved(value)? });
                }
                Ok(Value { parts, width: x.width })
            }
            "cellnoise" | "vcell" => {
                let mut parts = Vec::new();
                for k in 0..if name == "vcell" { 3 } else { 1 } {
                    let from = self.moved(x, k)?;
                    parts.push(self.push(Op::Cell { from })?);
                }
                Ok(Value { parts, width: self.number(0.0)? })
            }
            // remap(x, source, range, falloff, interp): SeExpr's; 1 within the range, and nothing beyond the falloff.
            "remap" => {
                let way = self.binary("-", x, &values[1])?;
                let off = self.each(Unary::Abs, &way)?;
                let end = self.binary("+", &values[2], &values[3])?;
                let kind = self.kind(at, "the shape of remap is 0, 1 or 2", &values[4], 0..=2)?;
                let shape = ["linearstep", "smoothstep", "gaussstep"][kind as usize];
                // Falling outwards is rising inwards.
                let [near, low, high] =
                    [&off, &end, &values[2]].map(|value| self.each(Unary::Negate, value));
                let beside = self.built_in(at, shape, &[near?, low?, high?])?;
                let inside = self.parted(Binary::LessEqual, &off, &values[2])?;
                self.parted(Binary::Max, &beside, &inside)
            }
            // voronoi(v, kind, jitter): 1 the way to the nearest point, 2 to the second, 3 how much farther that
            // is, 4 a number of the nearest.
            _ => {
                let jitter = match values.get(2) {
                    Some(jitter) => jitter.parts[0],
                    None => self.number(0.5)?,
                };
                let kind = match values.get(1) {
                    Some(kind) => {
                        self.kind(at, "the kind of voronoi is 1, 2, 3 or 4", kind, 1..=4)?
                    }
                    None => 1,
                };
                let from = self.spread(x);
                let mut part = |part: u32| self.push(Op::Voronoi { from, jitter, part });
                let part = match kind {
                    1 => part(0)?,
                    2 => part(1)?,
                    3 => {
                        let (near, far) = (part(0)?, part(1)?);
                        self.two(Binary::Subtract, far, near)?
                    }
                    _ => part(2)?,
                };
                Ok(Value { parts: vec![part], width: x.width })
            }
        }
    }

    /// A choice that is known when the program is compiled.
    fn kind(
        &self,
        at: usize,
        message: &str,
        value: &Value,
        known: std::ops::RangeInclusive<u32>,
    ) -> Result<u32, ProgramFault> {
        let number = self.ops[value.parts[0] as usize].as_number();
        let kind = number.filter(|number| known.clone().any(|kind| f64::from(kind) == *number));
        kind.map(|kind| kind as u32).ok_or_else(|| ProgramFault::new(at, message.to_owned()))
    }

    fn constant(&mut self, number: f64) -> Result<Value, ProgramFault> {
        Ok(Value { parts: vec![self.number(number)?], width: self.number(0.0)? })
    }

    fn scaled(&mut self, value: &Value, by: f64) -> Result<Value, ProgramFault> {
        let by = self.constant(by)?;
        self.binary("*", value, &by)
    }

    fn parted(&mut self, op: Binary, a: &Value, b: &Value) -> Result<Value, ProgramFault> {
        let parts = self.pairs(op, a, b)?;
        Ok(Value { parts, width: self.two(Binary::Max, a.width, b.width)? })
    }

    /// Where a value lies between two, 0 to 1.
    fn share(&mut self, x: &Value, from: &Value, to: &Value) -> Result<Value, ProgramFault> {
        let way = self.binary("-", x, from)?;
        let whole = self.binary("-", to, from)?;
        let t = self.binary("/", &way, &whole)?;
        let (zero, one) = (self.constant(0.0)?, self.constant(1.0)?);
        let t = self.parted(Binary::Max, &t, &zero)?;
        self.parted(Binary::Min, &t, &one)
    }

    fn dot(&mut self, a: &Value, b: &Value) -> Result<u32, ProgramFault> {
        let (x, y) = (self.spread(a), self.spread(b));
        self.push(Op::Dot(x, y))
    }

    fn luminance(&mut self, color: &Value) -> Result<u32, ProgramFault> {
        let weights = [0.2126, 0.7152, 0.0722].map(|weight| self.number(weight));
        let mut parts = Vec::new();
        for weight in weights {
            parts.push(weight?);
        }
        let width = color.width;
        self.dot(color, &Value { parts, width })
    }

    /// A place, far from itself for other noise of it.
    fn moved(&mut self, value: &Value, k: u32) -> Result<[u32; 3], ProgramFault> {
        let from = self.spread(value);
        let mut moved = from;
        if k > 0 {
            for (i, part) in moved.iter_mut().enumerate() {
                let by = self.number([17.3, 31.7, 43.1][i] * f64::from(k))?;
                *part = self.two(Binary::Add, from[i], by)?;
            }
        }
        Ok(moved)
    }

    /// From -1 to 1 to 0 to 1.
    fn halved(&mut self, value: u32) -> Result<u32, ProgramFault> {
        let half = self.number(0.5)?;
        let scaled = self.two(Binary::Multiply, value, half)?;
        self.two(Binary::Add, scaled, half)
    }
}
