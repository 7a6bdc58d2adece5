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

mod compile;
mod noise;
mod parse;
mod run;

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use crate::color::Color;
use crate::error::Error;
use compile::Compiled;
use run::{Input, Op, Registers};

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
struct Fault {
    /// The byte of the text.
    at: usize,
    message: String,
}

impl Fault {
    fn new(at: usize, message: String) -> Fault {
        Fault { at, message }
    }

    fn tell(&self, text: &str) -> Error {
        let before = &text[..text.floor_char_boundary(self.at.min(text.len()))];
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        Error::invalid(format!("line {line}, column {column}: {}", self.message))
    }
}

/// What a program reads of fragments, in places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variable {
    /// The place in the world, in metres: x, y, z.
    World(u32),
    /// The place in the object's own space.
    Object(u32),
    /// The unit normal on the side that is seen.
    Normal(u32),
    /// The unit vector to where it is seen from.
    Eye(u32),
    /// Texture coordinates: u, v.
    Texture(u32),
    /// The place in the picture, in shares of its width and height from the top left.
    Screen(u32),
    /// The colour: red, green, blue.
    Color(u32),
    /// How much of what lies behind is hidden.
    Alpha,
    /// The distance along the view axis, in metres.
    Depth,
    /// What a pixel covers in the world, in metres.
    Width,
    /// What a pixel covers in the object's space, in texture coordinates (1), and in the picture (2).
    WidthOf(u32),
    /// The face, by its number.
    Face,
    /// 1 on the front of a face, 0 on its back.
    Front,
    /// Whether the object's name fits one of the program's patterns, by its number.
    Fits(u32),
}

/// What a program makes of fragments: what it does not make is empty.
#[derive(Debug, Default)]
pub struct Made {
    /// Colours. What is no finite number is 0.
    pub color: Vec<Color>,
    /// How much of what lies behind is hidden, 0 to 1.
    pub alpha: Vec<f32>,
    /// Normals, not of unit length.
    pub normal: Vec<[f32; 3]>,
}

/// A program, compiled.
#[derive(Debug)]
pub struct Program {
    compiled: Compiled,
}

impl Program {
    /// Compiles a program with parameters.
    ///
    /// # Errors
    /// What is wrong with it, with its line and column.
    pub fn new(text: &str, parameters: &BTreeMap<String, Parameter>) -> Result<Program, Error> {
        let compiled = parse::parse(text).and_then(|tree| compile::compile(&tree, parameters));
        Ok(Program { compiled: compiled.map_err(|fault| fault.tell(text))? })
    }

    /// What it reads.
    pub fn reads(&self) -> impl Iterator<Item = Variable> + '_ {
        self.compiled.ops.iter().filter_map(variable)
    }

    /// The patterns of names that it asks for.
    pub fn patterns(&self) -> &[String] {
        &self.compiled.patterns
    }

    /// Whether it makes colours, alphas and normals.
    pub fn makes(&self) -> [bool; 3] {
        let Compiled { color, alpha, normal, .. } = &self.compiled;
        [color.is_some(), alpha.is_some(), normal.is_some()]
    }

    /// The number of instructions.
    pub fn len(&self) -> usize {
        self.compiled.ops.len()
    }

    /// Whether it has none: it has at least one.
    pub fn is_empty(&self) -> bool {
        self.compiled.ops.is_empty()
    }

    /// Runs over `count` fragments; `read` gives a variable of those from one on.
    pub fn run(&self, count: usize, read: impl Fn(Variable, usize, &mut [f32])) -> Made {
        let Compiled { ops, color, alpha, normal, .. } = &self.compiled;
        let mut registers = Registers::new(ops);
        let mut made = Made::default();
        made.color.reserve(if color.is_some() { count } else { 0 });
        let mut first = 0;
        while first < count {
            let lanes = run::LANES.min(count - first);
            registers.run(ops, lanes, |op, out| {
                if let Some(variable) = variable(op) {
                    read(variable, first, out);
                }
            });
            let finite = |v: f32| if v.is_finite() { v } else { 0.0 };
            let three = |at: &[u32; 3]| {
                let [x, y, z] = at.map(|at| &registers.of(at)[..lanes]);
                (0..lanes).map(move |i| [finite(x[i]), finite(y[i]), finite(z[i])])
            };
            if let Some(at) = color {
                made.color.extend(three(at).map(|[r, g, b]| Color::new(r, g, b)));
            }
            if let Some(at) = normal {
                made.normal.extend(three(at));
            }
            if let Some(at) = alpha {
                let alphas = registers.of(*at)[..lanes].iter();
                made.alpha.extend(alphas.map(|alpha| finite(*alpha).clamp(0.0, 1.0)));
            }
            first += lanes;
        }
        made
    }
}

fn variable(op: &Op) -> Option<Variable> {
    let input = match op {
        Op::Fits(pattern) => return Some(Variable::Fits(*pattern)),
        Op::Input(input) => *input,
        _ => return None,
    };
    Some(match input {
        Input::P(i) => Variable::World(i),
        Input::Po(i) => Variable::Object(i),
        Input::N(i) => Variable::Normal(i),
        Input::I(i) => Variable::Eye(i),
        Input::Uv(i) => Variable::Texture(i),
        Input::Screen(i) => Variable::Screen(i),
        Input::Color(i) => Variable::Color(i),
        Input::Alpha => Variable::Alpha,
        Input::Depth => Variable::Depth,
        Input::Width => Variable::Width,
        Input::WidthOf(i) => Variable::WidthOf(i),
        Input::Face => Variable::Face,
        Input::Front => Variable::Front,
    })
}
