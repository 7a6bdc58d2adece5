//! Instructions, each over some hundred fragments at a time.

use super::noise;
use crate::math;

/// Fragments that an instruction runs over at once: few enough for all registers to stay near.
pub(super) const LANES: usize = 128;

/// A variable of the fragments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Input {
    /// The place in the world.
    P(u32),
    /// The place in the object.
    Po(u32),
    /// The normal.
    N(u32),
    /// The vector to the eye.
    I(u32),
    /// Texture coordinates.
    Uv(u32),
    /// The place in the picture, in shares of its width and height.
    Screen(u32),
    Color(u32),
    Alpha,
    /// The distance along the view axis.
    Depth,
    /// What a pixel covers of the face, across, in metres.
    Width,
    /// The same in the object, in texture coordinates, and in the picture.
    WidthOf(u32),
    Face,
    Front,
}

impl Input {
    /// The names of variables.
    pub(super) const NAMES: [&'static str; 16] = [
        "P", "Po", "N", "I", "u", "v", "x", "y", "color", "Cs", "alpha", "normal", "depth",
        "width", "face", "front",
    ];

    /// A variable by its name: its first part, the number of parts, and what a pixel covers of it.
    pub(super) fn named(name: &str) -> Option<(Input, u32, Option<Input>)> {
        Some(match name {
            "P" => (Input::P(0), 3, Some(Input::Width)),
            "Po" => (Input::Po(0), 3, Some(Input::WidthOf(0))),
            "N" | "normal" => (Input::N(0), 3, None),
            "I" => (Input::I(0), 3, None),
            "u" => (Input::Uv(0), 1, Some(Input::WidthOf(1))),
            "v" => (Input::Uv(1), 1, Some(Input::WidthOf(1))),
            "x" => (Input::Screen(0), 1, Some(Input::WidthOf(2))),
            "y" => (Input::Screen(1), 1, Some(Input::WidthOf(2))),
            "color" | "Cs" => (Input::Color(0), 3, None),
            "alpha" => (Input::Alpha, 1, None),
            "depth" => (Input::Depth, 1, None),
            "width" => (Input::Width, 1, None),
            "face" => (Input::Face, 1, None),
            "front" => (Input::Front, 1, None),
            _ => return None,
        })
    }

    pub(super) fn part(self, by: u32) -> Input {
        match self {
            Input::P(i) => Input::P(i + by),
            Input::Po(i) => Input::Po(i + by),
            Input::N(i) => Input::N(i + by),
            Input::I(i) => Input::I(i + by),
            Input::Color(i) => Input::Color(i + by),
            other => other,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Unary {
    Negate,
    Not,
    Abs,
    Acos,
    Asin,
    Atan,
    Cos,
    Sin,
    Tan,
    Exp,
    Log,
    Sqrt,
    Floor,
    Ceil,
    Round,
    Sign,
    /// What is left of a wave where a pixel covers so much of it, in radians.
    Sinc,
}

impl Unary {
    #[inline(always)]
    fn of(self, a: f32) -> f32 {
        let wide = |function: fn(f64) -> f64| function(f64::from(a)) as f32;
        match self {
            Unary::Negate => -a,
            Unary::Not => f32::from(u8::from(a == 0.0)),
            Unary::Abs => a.abs(),
            Unary::Acos => wide(math::acos),
            Unary::Asin => std::f32::consts::FRAC_PI_2 - wide(math::acos),
            Unary::Atan => math::atan2(f64::from(a), 1.0) as f32,
            Unary::Cos => wide(math::cos),
            Unary::Sin => wide(math::sin),
            Unary::Tan => wide(math::tan),
            Unary::Exp => math::expf(a),
            Unary::Log => (math::log2(f64::from(a)) * std::f64::consts::LN_2) as f32,
            Unary::Sqrt => a.sqrt(),
            Unary::Floor => a.floor(),
            Unary::Ceil => a.ceil(),
            Unary::Round => a.round(),
            Unary::Sinc => match a.abs() / 2.0 {
                half if half < 1e-3 => 1.0,
                half if half < std::f32::consts::PI => math::sin(f64::from(half)) as f32 / half,
                _ => 0.0,
            },
            Unary::Sign => f32::from(u8::from(a > 0.0)) - f32::from(u8::from(a < 0.0)),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Modulo,
    Power,
    Min,
    Max,
    Atan2,
    Less,
    Greater,
    LessEqual,
    GreaterEqual,
    Equal,
    Unequal,
    And,
    Or,
}

impl Binary {
    #[inline(always)]
    fn of(self, a: f32, b: f32) -> f32 {
        let truth = |is: bool| f32::from(u8::from(is));
        match self {
            Binary::Add => a + b,
            Binary::Subtract => a - b,
            Binary::Multiply => a * b,
            Binary::Divide => a / b,
            // As floor division leaves it: patterns go on across zero.
            Binary::Modulo => a - b * (a / b).floor(),
            Binary::Power => math::powf(a, b),
            Binary::Min => a.min(b),
            Binary::Max => a.max(b),
            Binary::Atan2 => math::atan2(f64::from(a), f64::from(b)) as f32,
            Binary::Less => truth(a < b),
            Binary::Greater => truth(a > b),
            Binary::LessEqual => truth(a <= b),
            Binary::GreaterEqual => truth(a >= b),
            Binary::Equal => truth(a == b),
            Binary::Unequal => truth(a != b),
            Binary::And => truth(a != 0.0 && b != 0.0),
            Binary::Or => truth(a != 0.0 || b != 0.0),
        }
    }
}

/// An instruction: what a register is made of. Numbers are registers before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Op {
    /// The bits of a number.
    Number(u32),
    Input(Input),
    /// Whether the object's name fits a pattern.
    Fits(u32),
    Unary(Unary, u32),
    Binary(Binary, u32, u32),
    Select(u32, u32, u32),
    Perlin {
        from: [u32; 3],
        width: u32,
    },
    Octaves {
        from: [u32; 3],
        width: u32,
        shape: [u32; 3],
        turbulent: bool,
    },
    Cell {
        from: [u32; 3],
    },
    Voronoi {
        from: [u32; 3],
        jitter: u32,
        part: u32,
    },
    Hue {
        from: [u32; 3],
        part: u32,
        is_back: bool,
    },
}

impl Op {
    pub(super) fn number(number: f32) -> Op {
        Op::Number(number.to_bits())
    }

    pub(super) fn as_number(&self) -> Option<f32> {
        match self {
            Op::Number(bits) => Some(f32::from_bits(*bits)),
            _ => None,
        }
    }

    /// A number, if it is made of numbers alone.
    pub(super) fn folded(self, ops: &[Op]) -> Op {
        let known = |at: u32| ops[at as usize].as_number();
        let folded = match self {
            Op::Unary(op, a) => known(a).map(|a| op.of(a)),
            Op::Binary(op, a, b) => known(a).zip(known(b)).map(|(a, b)| op.of(a, b)),
            Op::Select(c, a, b) => match known(c) {
                Some(c) => return ops[if c != 0.0 { a } else { b } as usize],
                None => None,
            },
            _ => None,
        };
        folded.map_or(self, Op::number)
    }

    /// The registers that it reads.
    pub(super) fn each(&self, mut visit: impl FnMut(&u32)) {
        let mut copy = *self;
        copy.each_mut(|from| visit(from));
    }

    pub(super) fn each_mut(&mut self, mut visit: impl FnMut(&mut u32)) {
        match self {
            Op::Number(_) | Op::Input(_) | Op::Fits(_) => {}
            Op::Unary(_, a) => visit(a),
            Op::Binary(_, a, b) => [a, b].into_iter().for_each(visit),
            Op::Select(c, a, b) => [c, a, b].into_iter().for_each(visit),
            Op::Perlin { from, width } => {
                from.iter_mut().for_each(&mut visit);
                visit(width);
            }
            Op::Octaves { from, width, shape, .. } => {
                from.iter_mut().chain(shape).for_each(&mut visit);
                visit(width);
            }
            Op::Cell { from } | Op::Hue { from, .. } => from.iter_mut().for_each(visit),
            Op::Voronoi { from, jitter, .. } => {
                from.iter_mut().for_each(&mut visit);
                visit(jitter);
            }
        }
    }
}

/// The registers of a run.
pub(super) struct Registers(Vec<[f32; LANES]>);

impl Registers {
    /// Registers for instructions; numbers are there already.
    pub(super) fn new(ops: &[Op]) -> Registers {
        Registers(ops.iter().map(|op| [op.as_number().unwrap_or(0.0); LANES]).collect())
    }

    pub(super) fn of(&self, at: u32) -> &[f32; LANES] {
        &self.0[at as usize]
    }

    /// Runs all instructions for the first `count` lanes; `input` fills what comes from outside.
    pub(super) fn run(&mut self, ops: &[Op], count: usize, mut input: impl FnMut(&Op, &mut [f32])) {
        for (at, op) in ops.iter().enumerate() {
            let (before, rest) = self.0.split_at_mut(at);
            let out = &mut rest[0][..count];
            let reg = |at: &u32| &before[*at as usize][..count];
            let three = |from: &[u32; 3]| [reg(&from[0]), reg(&from[1]), reg(&from[2])];
            match op {
                Op::Number(_) => {}
                Op::Input(_) | Op::Fits(_) => input(op, out),
                Op::Unary(op, a) => unary(*op, reg(a), out),
                Op::Binary(op, a, b) => binary(*op, reg(a), reg(b), out),
                Op::Select(c, a, b) => {
                    let sides = reg(a).iter().zip(reg(b));
                    for ((out, c), (a, b)) in out.iter_mut().zip(reg(c)).zip(sides) {
                        *out = if *c != 0.0 { *a } else { *b };
                    }
                }
                Op::Perlin { from, width } => {
                    let ([x, y, z], width) = (three(from), reg(width));
                    for (i, out) in out.iter_mut().enumerate() {
                        let left = noise::left(width[i]);
                        *out =
                            if left > 0.0 { noise::perlin([x[i], y[i], z[i]]) * left } else { 0.0 };
                    }
                }
                Op::Octaves { from, width, shape, turbulent } => {
                    let ([x, y, z], [a, b, c], width) = (three(from), three(shape), reg(width));
                    for (i, out) in out.iter_mut().enumerate() {
                        let shape = [a[i], b[i], c[i]];
                        *out = noise::octaves([x[i], y[i], z[i]], width[i], shape, *turbulent);
                    }
                }
                Op::Cell { from } => {
                    let [x, y, z] = three(from);
                    for (i, out) in out.iter_mut().enumerate() {
                        *out = noise::of_cell([x[i], y[i], z[i]]);
                    }
                }
                Op::Voronoi { from, jitter, part } => {
                    let ([x, y, z], jitter) = (three(from), reg(jitter));
                    for (i, out) in out.iter_mut().enumerate() {
                        *out = noise::voronoi([x[i], y[i], z[i]], jitter[i])[*part as usize];
                    }
                }
                Op::Hue { from, part, is_back } => {
                    let [x, y, z] = three(from);
                    let change = if *is_back { to_rgb } else { to_hsl };
                    for (i, out) in out.iter_mut().enumerate() {
                        *out = change([x[i], y[i], z[i]])[*part as usize];
                    }
                }
            }
        }
    }
}

/// One operation for all lanes: told apart outside of the loop, so that it is done by vectors.
fn unary(op: Unary, a: &[f32], out: &mut [f32]) {
    macro_rules! each {
        ($($op:ident),*) => {
            match op {
                $(Unary::$op => out.iter_mut().zip(a).for_each(|(out, a)| *out = Unary::$op.of(*a)),)*
            }
        };
    }
    each!(
        Negate, Not, Abs, Acos, Asin, Atan, Cos, Sin, Tan, Exp, Log, Sqrt, Floor, Ceil, Round,
        Sign, Sinc
    );
}

fn binary(op: Binary, a: &[f32], b: &[f32], out: &mut [f32]) {
    macro_rules! each {
        ($($op:ident),*) => {
            match op {
                $(Binary::$op => {
                    out.iter_mut().zip(a.iter().zip(b)).for_each(|(out, (a, b))| {
                        *out = Binary::$op.of(*a, *b);
                    });
                })*
            }
        };
    }
    each!(
        Add,
        Subtract,
        Multiply,
        Divide,
        Modulo,
        Power,
        Min,
        Max,
        Atan2,
        Less,
        Greater,
        LessEqual,
        GreaterEqual,
        Equal,
        Unequal,
        And,
        Or
    );
}

/// Hue, saturation and lightness, each 0 to 1.
fn to_hsl([r, g, b]: [f32; 3]) -> [f32; 3] {
    let (most, least) = (r.max(g).max(b), r.min(g).min(b));
    let (sum, range) = (most + least, most - least);
    if range <= 0.0 {
        return [0.0, 0.0, sum / 2.0];
    }
    let saturation = range / if sum <= 1.0 { sum } else { 2.0 - sum };
    let hue = if most == r {
        (g - b) / range
    } else if most == g {
        2.0 + (b - r) / range
    } else {
        4.0 + (r - g) / range
    };
    [(hue / 6.0).rem_euclid(1.0), saturation, sum / 2.0]
}

fn to_rgb([hue, saturation, lightness]: [f32; 3]) -> [f32; 3] {
    let most = if lightness <= 0.5 {
        lightness * (1.0 + saturation)
    } else {
        lightness + saturation - lightness * saturation
    };
    let least = 2.0 * lightness - most;
    [1.0 / 3.0, 0.0, -1.0 / 3.0].map(|off| {
        let h = (hue + off).rem_euclid(1.0) * 6.0;
        let part = h.min(4.0 - h).clamp(0.0, 1.0);
        least + (most - least) * part
    })
}
