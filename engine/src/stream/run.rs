//! Instructions, each over some hundred fragments at a time.

use super::noise;
use super::real::Real;
use super::variable::Variable;
use crate::math;

/// Fragments that an instruction runs over at once: few enough for all registers to stay near.
pub(super) const LANES: usize = 128;

/// Fragments that are worked on at once: known when this is compiled, so that it is done by vectors.
const WIDTH: usize = 16;

/// A register, or a part of one.
type Block = [f32; WIDTH];

/// The same for all lanes of registers. Written out, not handed on, as only what is inlined is done by vectors; and
/// stored block by block, as lanes could not be known to be others than those that are read.
macro_rules! lanes {
    ($a:ident, $out:ident => $of:expr) => {
        for (out, $a) in $out.iter_mut().zip($a) {
            let mut made = [0.0; WIDTH];
            for i in 0..WIDTH {
                let $a = $a[i];
                made[i] = $of;
            }
            *out = made;
        }
    };
    ($a:ident, $b:ident, $out:ident => $of:expr) => {
        for (out, ($a, $b)) in $out.iter_mut().zip($a.iter().zip($b)) {
            let mut made = [0.0; WIDTH];
            for i in 0..WIDTH {
                let ($a, $b) = ($a[i], $b[i]);
                made[i] = $of;
            }
            *out = made;
        }
    };
    ($a:ident, $b:ident, $c:ident, $out:ident => $of:expr) => {
        for (out, (($a, $b), $c)) in $out.iter_mut().zip($a.iter().zip($b).zip($c)) {
            let mut made = [0.0; WIDTH];
            for i in 0..WIDTH {
                let ($a, $b, $c) = ($a[i], $b[i], $c[i]);
                made[i] = $of;
            }
            *out = made;
        }
    };
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
    /// From 0 to 1, level at both.
    Hermite,
    /// What is left of a wave where a pixel covers so much of it, in radians.
    Sinc,
}

impl Unary {
    #[inline(always)]
    pub(super) fn of<R: Real>(self, a: R) -> R {
        let wide = |function: fn(f64) -> f64| R::of(function(a.wide()));
        let truth = |is: bool| R::of(f64::from(u8::from(is)));
        let zero = R::of(0.0);
        match self {
            Unary::Negate => -a,
            Unary::Not => truth(a == zero),
            Unary::Abs => a.abs(),
            Unary::Acos => wide(math::acos),
            Unary::Asin => R::of(std::f64::consts::FRAC_PI_2) - wide(math::acos),
            Unary::Atan => R::of(math::atan2(a.wide(), 1.0)),
            Unary::Cos => wide(math::cos),
            Unary::Sin => wide(math::sin),
            Unary::Tan => wide(math::tan),
            Unary::Exp => a.exp(),
            Unary::Log => R::of(math::log2(a.wide()) * std::f64::consts::LN_2),
            Unary::Sqrt => a.sqrt(),
            Unary::Floor => a.floor(),
            Unary::Ceil => a.ceil(),
            Unary::Round => a.round(),
            Unary::Hermite => a * a * (R::of(3.0) - R::of(2.0) * a),
            Unary::Sinc => match a.abs() / R::of(2.0) {
                // Less than 2e-7 from 1, and no division by 0.
                half if half < R::of(1e-3) => R::of(1.0),
                half if half < R::of(std::f64::consts::PI) => R::of(math::sin(half.wide())) / half,
                _ => zero,
            },
            Unary::Sign => truth(a > zero) - truth(a < zero),
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
    pub(super) fn of<R: Real>(self, a: R, b: R) -> R {
        let truth = |is: bool| R::of(f64::from(u8::from(is)));
        let zero = R::of(0.0);
        match self {
            Binary::Add => a + b,
            Binary::Subtract => a - b,
            Binary::Multiply => a * b,
            Binary::Divide => a / b,
            // As floor division leaves it: patterns go on across zero.
            Binary::Modulo => a - b * (a / b).floor(),
            Binary::Power => a.power(b),
            // As vectors have them: the second, if either is no number.
            Binary::Min => least(a, b),
            Binary::Max => most(a, b),
            Binary::Atan2 => R::of(math::atan2(a.wide(), b.wide())),
            Binary::Less => truth(a < b),
            Binary::Greater => truth(a > b),
            Binary::LessEqual => truth(a <= b),
            Binary::GreaterEqual => truth(a >= b),
            Binary::Equal => truth(a == b),
            Binary::Unequal => truth(a != b),
            Binary::And => truth(a != zero && b != zero),
            Binary::Or => truth(a != zero || b != zero),
        }
    }
}

/// What two operations in one may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Simple {
    Add,
    Subtract,
    Multiply,
    Min,
    Max,
    /// What the first takes from the second.
    Taken,
}

impl Simple {
    #[inline(always)]
    fn of<R: Real>(self, a: R, b: R) -> R {
        match self {
            Simple::Add => a + b,
            Simple::Subtract => a - b,
            Simple::Multiply => a * b,
            Simple::Min => least(a, b),
            Simple::Max => most(a, b),
            Simple::Taken => b - a,
        }
    }
}

/// Two operations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Pair(Simple, Simple);

impl Pair {
    /// One operation on what another gives, which is its first value or its last.
    pub(super) fn of(first: Binary, second: Binary, is_last: bool) -> Option<Pair> {
        let simple = |op: Binary| match op {
            Binary::Add => Some(Simple::Add),
            Binary::Subtract => Some(Simple::Subtract),
            Binary::Multiply => Some(Simple::Multiply),
            Binary::Min => Some(Simple::Min),
            Binary::Max => Some(Simple::Max),
            _ => None,
        };
        match (simple(first)?, simple(second)?) {
            (first, Simple::Subtract) if is_last => Some(Pair(first, Simple::Taken)),
            (first, second) => Some(Pair(first, second)),
        }
    }

    #[inline(always)]
    fn run(self, [a, b, c]: [&[Block]; 3], out: &mut [Block]) {
        let Pair(first, second) = self;
        macro_rules! by_second {
            ($first:ident: $($second:ident),*) => {
                match second {
                    $(Simple::$second => lanes!(a, b, c, out => {
                        Simple::$second.of(Simple::$first.of(a, b), c)
                    }),)*
                }
            };
        }
        macro_rules! by_first {
            ($($first:ident),*) => {
                match first {
                    $(Simple::$first => {
                        by_second!($first: Add, Subtract, Multiply, Min, Max, Taken);
                    })*
                }
            };
        }
        by_first!(Add, Subtract, Multiply, Min, Max, Taken);
    }
}

#[inline(always)]
fn mixed<R: Real>(a: R, b: R, t: R) -> R {
    a + (b - a) * t
}

#[inline(always)]
fn least<R: Real>(a: R, b: R) -> R {
    if a < b { a } else { b }
}

#[inline(always)]
fn most<R: Real>(a: R, b: R) -> R {
    if a > b { a } else { b }
}

/// An instruction: what a register is made of. Numbers are registers before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Op {
    /// The bits of a number.
    Number(u64),
    Input(Variable),
    Unary(Unary, u32),
    Binary(Binary, u32, u32),
    /// Two of a kind, the second of what the first gives and a third register.
    Pair {
        pair: Pair,
        from: [u32; 3],
    },
    Select(u32, u32, u32),
    /// Between two, by a share.
    Mix([u32; 3]),
    /// The product of two vectors.
    Dot([u32; 3], [u32; 3]),
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
    pub(super) fn number(number: f64) -> Op {
        Op::Number(number.to_bits())
    }

    pub(super) fn as_number(&self) -> Option<f64> {
        match self {
            Op::Number(bits) => Some(f64::from_bits(*bits)),
            _ => None,
        }
    }

    /// A number, if it is made of numbers alone, in the precision that it is computed in.
    pub(super) fn folded<R: Real>(self, ops: &[Op]) -> Op {
        let known = |at: u32| ops[at as usize].as_number().map(R::of);
        let folded = match self {
            Op::Unary(op, a) => known(a).map(|a| op.of(a)),
            Op::Binary(op, a, b) => known(a).zip(known(b)).map(|(a, b)| op.of(a, b)),
            Op::Select(c, a, b) => match known(c) {
                // The very instruction of the chosen register: whoever adds it finds that it is
                // there already.
                Some(c) => return ops[if c != R::of(0.0) { a } else { b } as usize],
                None => None,
            },
            Op::Mix([a, b, t]) => match known(t) {
                Some(zero) if zero == R::of(0.0) => return ops[a as usize],
                share => known(a).zip(known(b)).zip(share).map(|((a, b), t)| mixed(a, b, t)),
            },
            _ => None,
        };
        folded.map_or(self, |number| Op::number(number.wide()))
    }

    /// What it makes for one set of inputs, of what the registers before it hold. Noise and hues have single precision.
    pub(super) fn value(&self, at: impl Fn(u32) -> f64, input: impl Fn(Variable) -> f64) -> f64 {
        let three = |from: &[u32; 3]| from.map(|from| at(from) as f32);
        f64::from(match self {
            Op::Number(bits) => return f64::from_bits(*bits),
            Op::Input(variable) => return input(*variable),
            Op::Unary(op, a) => return op.of(at(*a)),
            Op::Binary(op, a, b) => return op.of(at(*a), at(*b)),
            Op::Pair { pair: Pair(first, second), from: [a, b, c] } => {
                return second.of(first.of(at(*a), at(*b)), at(*c));
            }
            Op::Select(c, a, b) => return at(if at(*c) != 0.0 { *a } else { *b }),
            Op::Mix([a, b, t]) => return mixed(at(*a), at(*b), at(*t)),
            Op::Dot(a, b) => return (0..3).map(|i| at(a[i]) * at(b[i])).sum(),
            Op::Perlin { from, width } => {
                noise::perlin(three(from)) * noise::left(at(*width) as f32)
            }
            Op::Octaves { from, width, shape, turbulent } => {
                noise::octaves(three(from), at(*width) as f32, three(shape), *turbulent)
            }
            Op::Cell { from } => noise::of_cell(three(from)),
            Op::Voronoi { from, jitter, part } => {
                noise::voronoi(three(from), at(*jitter) as f32)[*part as usize]
            }
            Op::Hue { from, part, is_back } => {
                (if *is_back { to_rgb } else { to_hsl })(three(from))[*part as usize]
            }
        })
    }

    /// The registers that it reads.
    pub(super) fn each(&self, mut visit: impl FnMut(&u32)) {
        let mut copy = *self;
        copy.each_mut(|from| visit(from));
    }

    pub(super) fn each_mut(&mut self, mut visit: impl FnMut(&mut u32)) {
        match self {
            Op::Number(_) | Op::Input(_) => {}
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
            Op::Cell { from } | Op::Hue { from, .. } | Op::Pair { from, .. } | Op::Mix(from) => {
                from.iter_mut().for_each(visit)
            }
            Op::Dot(a, b) => a.iter_mut().chain(b).for_each(visit),
            Op::Voronoi { from, jitter, .. } => {
                from.iter_mut().for_each(&mut visit);
                visit(jitter);
            }
        }
    }
}

/// What an instruction makes of all lanes: aligned, so that no vector lies across two lines of a cache.
#[derive(Clone)]
#[repr(align(64))]
struct Register([Block; LANES / WIDTH]);

/// The registers of a run.
pub(super) struct Registers {
    #[expect(
        clippy::vec_box,
        reason = "what was made is put in its place by exchanging two addresses"
    )]
    all: Vec<Box<Register>>,
    /// What is being written.
    made: Box<Register>,
}

impl Registers {
    /// Registers for instructions by their places; numbers are there already.
    pub(super) fn new(ops: &[Op], places: &[u32]) -> Registers {
        let count = places.iter().max().map_or(0, |most| *most as usize + 1);
        let made = Box::new(Register([[0.0; WIDTH]; LANES / WIDTH]));
        let mut all = vec![made.clone(); count];
        for (op, place) in ops.iter().zip(places) {
            if let Some(number) = op.as_number() {
                all[*place as usize].0.fill([number as f32; WIDTH]);
            }
        }
        Registers { all, made }
    }

    pub(super) fn of(&self, place: u32) -> &[f32] {
        self.all[place as usize].0.as_flattened()
    }

    /// Runs all instructions for the first `count` lanes; `input` fills what comes from outside.
    #[inline(always)]
    pub(super) fn run(
        &mut self,
        ops: &[Op],
        places: &[u32],
        count: usize,
        mut input: impl FnMut(Variable, &mut [f32]),
    ) {
        // Whole blocks: what is computed in lanes beyond `count` is never read.
        let blocks = count.div_ceil(WIDTH);
        for (op, place) in ops.iter().zip(places) {
            if op.as_number().is_some() {
                continue;
            }
            let Registers { all, made } = self;
            let out = &mut made.0[..blocks];
            let register = |at: &u32| &all[places[*at as usize] as usize].0;
            let reg = |at: &u32| &register(at)[..blocks];
            let lane = |at: &u32| &register(at).as_flattened()[..count];
            let lanes = |from: &[u32; 3]| [lane(&from[0]), lane(&from[1]), lane(&from[2])];
            match op {
                Op::Number(_) => {}
                Op::Input(variable) => input(*variable, &mut out.as_flattened_mut()[..count]),
                Op::Unary(op, a) => unary(*op, reg(a), out),
                Op::Binary(op, a, b) => binary(*op, reg(a), reg(b), out),
                Op::Pair { pair, from: [a, b, c] } => pair.run([reg(a), reg(b), reg(c)], out),
                Op::Select(c, a, b) => {
                    let (c, a, b) = (reg(c), reg(a), reg(b));
                    lanes!(c, a, b, out => if c != 0.0 { a } else { b });
                }
                Op::Mix([a, b, t]) => {
                    let (a, b, t) = (reg(a), reg(b), reg(t));
                    lanes!(a, b, t, out => mixed(a, b, t));
                }
                Op::Dot(a, b) => {
                    let ([a, b, c], [x, y, z]) = (a.map(|at| reg(&at)), b.map(|at| reg(&at)));
                    for k in 0..blocks {
                        let mut made = [0.0; WIDTH];
                        for (i, made) in made.iter_mut().enumerate() {
                            *made = a[k][i] * x[k][i] + b[k][i] * y[k][i] + c[k][i] * z[k][i];
                        }
                        out[k] = made;
                    }
                }
                Op::Perlin { from, width } => {
                    let ([x, y, z], width) = (lanes(from), lane(width));
                    each(out, count, |i| match noise::left(width[i]) {
                        left if left > 0.0 => noise::perlin([x[i], y[i], z[i]]) * left,
                        _ => 0.0,
                    });
                }
                Op::Octaves { from, width, shape, turbulent } => {
                    let ([x, y, z], [a, b, c], width) = (lanes(from), lanes(shape), lane(width));
                    each(out, count, |i| {
                        let shape = [a[i], b[i], c[i]];
                        noise::octaves([x[i], y[i], z[i]], width[i], shape, *turbulent)
                    });
                }
                Op::Cell { from } => {
                    let [x, y, z] = lanes(from);
                    each(out, count, |i| noise::of_cell([x[i], y[i], z[i]]));
                }
                Op::Voronoi { from, jitter, part } => {
                    let ([x, y, z], jitter) = (lanes(from), lane(jitter));
                    let part = *part as usize;
                    each(out, count, |i| noise::voronoi([x[i], y[i], z[i]], jitter[i])[part]);
                }
                Op::Hue { from, part, is_back } => {
                    let [x, y, z] = lanes(from);
                    let change = if *is_back { to_rgb } else { to_hsl };
                    each(out, count, |i| change([x[i], y[i], z[i]])[*part as usize]);
                }
            }
            // The old register becomes the next to be written. So no instruction writes where it
            // reads.
            std::mem::swap(made, &mut all[*place as usize]);
        }
    }
}

/// One lane after the other.
fn each(out: &mut [Block], count: usize, of: impl Fn(usize) -> f32) {
    out.as_flattened_mut()[..count].iter_mut().enumerate().for_each(|(i, out)| *out = of(i));
}

/// One operation for all lanes: told apart outside of the loop, so that it is done by vectors.
#[inline(always)]
fn unary(op: Unary, a: &[Block], out: &mut [Block]) {
    macro_rules! each {
        ($($op:ident),*) => {
            match op {
                $(Unary::$op => lanes!(a, out => Unary::$op.of(a)),)*
            }
        };
    }
    each!(
        Negate, Not, Abs, Acos, Asin, Atan, Cos, Sin, Tan, Exp, Log, Sqrt, Floor, Ceil, Round,
        Sign, Hermite, Sinc
    );
}

#[inline(always)]
fn binary(op: Binary, a: &[Block], b: &[Block], out: &mut [Block]) {
    macro_rules! each {
        ($($op:ident),*) => {
            match op {
                $(Binary::$op => lanes!(a, b, out => Binary::$op.of(a, b)),)*
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
