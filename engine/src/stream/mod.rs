//! The stream editor's language (after Perlin's Pixel Stream Editor, 1985): programs over what is visible,
//! fragment by fragment, before anything is resolved.
//!
//! A program is assignments, `if` and `else`, functions of its own, and at the end, if it likes, a colour.
//! There are numbers and vectors of three; a number stands for three alike. It makes `color`, `alpha` or
//! `normal`.
//!
//! ```text
//! def rings(p) { r = length([p.x, 0, p.z]) * 20; r - floor(r) }
//! wood = mix([0.5, 0.3, 0.15], [0.7, 0.5, 0.3], rings(Po + 0.1 * vfbm(Po * 3)));
//! if (object("*table*")) { color = wood; }
//! ```
//!
//! It is compiled once to instructions without jumps, each of which runs over some hundred fragments at a
//! time: every program ends, and none reads outside of its fragments. Noise, and sines and cosines, are weakened where
//! a pixel covers too much of them to be seen: what a pixel covers of a place goes through sums, products and quotients with it.

mod built_in;
mod compile;
mod expression;
pub mod noise;
mod parse;
mod real;
mod run;
mod shorten;
mod variable;

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

use crate::color::{Color, ValueKind};
use compile::{Compiled, Output};
pub use expression::Expression;
use run::{Op, Registers};
pub use variable::Variable;

/// A number or colour that a program knows by a name.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Parameter {
    /// A number.
    Number(f32),
    /// Three numbers.
    Color(Color),
}

/// What is wrong with a program, and where.
#[derive(Debug)]
pub struct ProgramFault {
    /// The byte of its text.
    pub at: usize,
    /// Its line and column, from 1.
    pub place: (usize, usize),
    /// What is wrong, and the cure.
    pub message: String,
}

impl ProgramFault {
    fn new(at: usize, message: String) -> ProgramFault {
        ProgramFault { at, place: (1, 1), message }
    }

    /// With its line and column.
    fn placed(self, text: &str) -> ProgramFault {
        let before = &text[..text.floor_char_boundary(self.at.min(text.len()))];
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        ProgramFault { place: (line, column), ..self }
    }
}

impl fmt::Display for ProgramFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (line, column) = self.place;
        write!(f, "line {line}, column {column}: {}", self.message)
    }
}

/// All names that a program reads, its own ones too.
///
/// # Errors
/// If it is no program.
pub fn names(text: &str) -> Result<Vec<String>, ProgramFault> {
    let tree = parse::parse(text).map_err(|fault| fault.placed(text))?;
    Ok(tree.names().into_iter().map(str::to_owned).collect())
}

/// What a program makes of fragments: what it does not make is empty.
#[derive(Debug, Default)]
pub struct Made {
    /// Colours. What is no finite number is 0.
    pub color: Vec<Color>,
    /// How much of what lies behind is hidden, 0 to 1.
    pub alpha: Vec<f32>,
    /// Normals, not of unit length.
    pub normal: Vec<Color>,
    /// Of each channel that the program was told of, its numbers: three, alike if the program gave one.
    pub channels: Vec<Vec<Color>>,
}

/// A program, compiled.
#[derive(Debug)]
pub struct Program {
    compiled: Compiled,
    channels: BTreeMap<String, ValueKind>,
}

impl Program {
    /// Compiles a program with parameters, and the channels that it may read and make.
    ///
    /// # Errors
    /// What is wrong with it, with its line and column.
    pub fn new(
        text: &str,
        parameters: &BTreeMap<String, Parameter>,
        channels: &BTreeMap<String, ValueKind>,
    ) -> Result<Program, ProgramFault> {
        let tree = parse::parse(text).map_err(|fault| fault.placed(text))?;
        let compiled = compile::compile(&tree, parameters, channels);
        let compiled = compiled.map_err(|fault| fault.placed(text))?;
        Ok(Program { compiled, channels: channels.clone() })
    }

    /// What it reads.
    pub fn reads(&self) -> impl Iterator<Item = Variable> + '_ {
        self.compiled.ops.iter().filter_map(|op| match op {
            Op::Input(variable) => Some(*variable),
            _ => None,
        })
    }

    /// The patterns of names that it asks for.
    pub fn patterns(&self) -> &[String] {
        &self.compiled.patterns
    }

    fn has(&self, output: Output) -> bool {
        self.compiled.outputs.iter().any(|(made, _)| *made == output)
    }

    /// Whether it makes colours, alphas and normals.
    pub fn makes(&self) -> [bool; 3] {
        [Output::Color, Output::Alpha, Output::Normal].map(|output| self.has(output))
    }

    /// The channels that it was told of, in order.
    pub fn channels(&self) -> &BTreeMap<String, ValueKind> {
        &self.channels
    }

    /// The channels that it makes, by their numbers, with their names.
    pub fn makes_channels(&self) -> impl Iterator<Item = (usize, &str)> {
        let all = self.channels.keys().enumerate();
        all.filter(|(k, _)| self.has(Output::Channel(*k as u32)))
            .map(|(k, name)| (k, name.as_str()))
    }

    /// The number of instructions.
    pub fn len(&self) -> usize {
        self.compiled.ops.len()
    }

    /// Whether it has none: it has at least one.
    pub fn is_empty(&self) -> bool {
        self.compiled.ops.is_empty()
    }

    /// Runs over `count` fragments; `read` gives a variable of those from one on. With the vectors that the machine has,
    /// and the same bits on all machines: nothing is contracted or put in another order.
    pub fn run(&self, count: usize, read: impl Fn(Variable, usize, &mut [f32])) -> Made {
        pulp::Arch::new().dispatch(Run { program: self, count, read })
    }
}

/// A run of a program, compiled once for each kind of vectors.
struct Run<'p, F> {
    program: &'p Program,
    count: usize,
    read: F,
}

impl<F: Fn(Variable, usize, &mut [f32])> pulp::NullaryFnOnce for Run<'_, F> {
    type Output = Made;

    #[inline(always)]
    fn call(self) -> Made {
        let Run { program, count, read } = self;
        let Compiled { ops, places, outputs, .. } = &program.compiled;
        let mut registers = Registers::new(ops, places);
        let mut made = Made::default();
        made.channels.resize_with(program.channels.len(), Vec::new);
        for (output, _) in outputs {
            match output {
                Output::Alpha => made.alpha.reserve(count),
                Output::Color => made.color.reserve(count),
                Output::Normal => made.normal.reserve(count),
                Output::Channel(k) => made.channels[*k as usize].reserve(count),
            }
        }
        let mut first = 0;
        while first < count {
            let lanes = run::LANES.min(count - first);
            registers.run(ops, places, lanes, |variable, out| read(variable, first, out));
            let finite = |v: f32| if v.is_finite() { v } else { 0.0 };
            for (output, at) in outputs {
                let [x, y, z] = at.map(|at| &registers.of(places[at as usize])[..lanes]);
                let colors = match output {
                    Output::Alpha => {
                        made.alpha.extend(x.iter().map(|alpha| finite(*alpha).clamp(0.0, 1.0)));
                        continue;
                    }
                    Output::Color => &mut made.color,
                    Output::Normal => &mut made.normal,
                    Output::Channel(k) => &mut made.channels[*k as usize],
                };
                let three = x.iter().zip(y).zip(z);
                colors.extend(
                    three.map(|((x, y), z)| Color::new(finite(*x), finite(*y), finite(*z))),
                );
            }
            first += lanes;
        }
        made
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::NullaryFnOnce;

    #[test]
    fn all_kinds_of_vectors_make_the_same_bits() {
        let code = "
            p = P * 3 + [0.1, -7, 2];
            a = mix(sin(p), cos(p.yzx), smoothstep(p.x, -1, 2)) / (abs(p) + 0.3);
            b = clamp(a ^ 2 - 0.5 * p, -2, 3) % 0.7 + fbm(p, 4) - turbulence(p) * noise(p);
            c = rgbtohsl(abs(b)) + hsltorgb([b.x % 1, 0.5, 0.5]) * exp(-length(a)) + log(2 + abs(p.z));
            d = b.x > 0.2 && p.y < 1 || !(c.z >= 0.5) ? voronoi(p, 3) : cellnoise(p);
            alpha = dot(a, b) + min(d, sqrt(abs(c.y))) + max(floor(p.x), round(c.x)) + atan2(p.x, p.y);
            color = c + d - [gaussstep(p.x, 0, 1), remap(p.y, 0, 1, 1, 1), bias(0.3, d)];
        ";
        let code = code.replace("p.yzx", "[p.y, p.z, p.x]");
        let program = Program::new(&code, &BTreeMap::new(), &BTreeMap::new()).unwrap();
        let read = |variable: Variable, first: usize, out: &mut [f32]| {
            let Variable::World(axis) = variable else { return out.fill(0.01) };
            for (out, i) in out.iter_mut().zip(first..) {
                *out = ((i * 37 + axis as usize * 3131) % 997) as f32 / 331.0 - 1.5;
            }
        };
        let plain = Run { program: &program, count: 1000, read }.call();
        let wide = program.run(1000, read);
        assert_eq!(format!("{:?}", plain.color), format!("{:?}", wide.color));
        assert_eq!(plain.alpha, wide.alpha);
        assert!(plain.color.iter().any(|color| color.r != 0.0 && color.r != plain.color[0].r));
    }
}
