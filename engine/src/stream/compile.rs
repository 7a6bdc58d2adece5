//! From the tree to instructions: one register each, in order, without jumps. Both sides of a branch are
//! computed, and a choice keeps one; functions are written out where they are called. So every program ends.

use std::collections::{BTreeMap, HashMap};

use super::built_in;
use super::parse::{Expr, ExprKind, Function, Statement, SyntaxTree, no_part};
use super::run::{Binary, Op, Unary};
use super::variable::Variable;
use super::{Parameter, ProgramFault};
use crate::color;
use crate::text::{list, nearest};

/// The most instructions of a program.
const MOST: usize = 20_000;

/// How deep functions may call each other.
const MOST_CALLS: usize = 32;

/// The most expressions that are gone through, functions as often as they are called.
const MOST_VISITS: usize = 1_000_000;

/// How many expressions may be inside each other, those of called functions inside of the call.
const MOST_INSIDE: usize = 600;

/// A value: a number or three, and how much of it a pixel covers.
#[derive(Clone, Debug)]
pub(super) struct Value {
    pub(super) parts: Vec<u32>,
    /// By how much it differs from one pixel to the next, about.
    pub(super) width: u32,
}

/// Something that a program makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Output {
    Color,
    Alpha,
    Normal,
    /// One of the channels that it was told of.
    Channel(u32),
}

/// A compiled program.
#[derive(Debug, Default)]
pub(super) struct Compiled {
    pub(super) ops: Vec<Op>,
    /// The place of what each instruction makes: numbers have their own, and another's is free again for what comes
    /// after all that it is needed for.
    pub(super) places: Vec<u32>,
    pub(super) patterns: Vec<String>,
    /// What it makes, and the registers of its parts; a number stands for three alike.
    pub(super) outputs: Vec<(Output, [u32; 3])>,
}

pub(super) fn compile(
    tree: &SyntaxTree,
    parameters: &BTreeMap<String, Parameter>,
    channels: &BTreeMap<String, color::ValueKind>,
) -> Result<Compiled, ProgramFault> {
    let mut compiler = Compiler::new(tree, channels, true)?;
    for name in channels.keys() {
        let is_name = name.starts_with(|c: char| c.is_ascii_alphabetic())
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        if !is_name {
            let message = format!("a channel \"{name}\": a name is letters, digits and _");
            return Err(ProgramFault::new(0, message));
        }
        if is_given(name) || parameters.contains_key(name) {
            let message = format!("the channel \"{name}\" has the name of something else");
            return Err(ProgramFault::new(0, message));
        }
    }
    let mut names = Names::new();
    for (name, parameter) in parameters {
        if is_given(name) {
            let message = format!("the parameter \"{name}\" has the name of a variable");
            return Err(ProgramFault::new(0, message));
        }
        let numbers: Vec<f64> = match parameter {
            Parameter::Number(number) => vec![f64::from(*number)],
            Parameter::Color(color) => color.to_array().map(f64::from).to_vec(),
        };
        let parts =
            numbers.into_iter().map(|number| compiler.number(number)).collect::<Result<_, _>>()?;
        let value = Value { parts, width: compiler.number(0.0)? };
        names.insert(name.clone(), value);
    }
    let mut named = names.clone();
    compiler.run(&tree.body, &mut named)?;
    if let Some(value) = &tree.value {
        let value = compiler.value(value, &named)?;
        named.insert("color".to_owned(), value);
    }
    let outputs = [("color", Output::Color), ("alpha", Output::Alpha), ("normal", Output::Normal)];
    for (name, kind) in channels {
        if *kind == color::ValueKind::Number
            && named.get(name).is_some_and(|value| value.parts.len() > 1)
        {
            let message = format!("the channel \"{name}\" is a Number, and is given a vector");
            return Err(ProgramFault::new(0, message));
        }
    }
    let of_channels = (0..).zip(channels.keys());
    let of_channels = of_channels.map(|(k, name)| (name.as_str(), Output::Channel(k)));
    let outputs = outputs.into_iter().chain(of_channels);
    let outputs: Vec<(Output, [u32; 3])> = outputs
        .filter_map(|(name, output)| Some((output, compiler.spread(named.get(name)?))))
        .collect();
    if outputs.is_empty() {
        let message = "the program makes nothing: assign color, alpha, normal or a channel, or end with a colour";
        return Err(ProgramFault::new(0, message.to_owned()));
    }
    let Compiler { ops, patterns, .. } = compiler;
    let mut made = Compiled { ops, places: Vec::new(), patterns, outputs };
    // Places come last, as they depend on which instructions are left.
    made.drop_unused();
    made.fuse();
    made.place();
    Ok(made)
}

/// Compiles a program that ends in a value, and knows what it is given alone: in double precision. Returns how many
/// parts the value has.
pub(super) fn compile_value<'a>(
    tree: &'a SyntaxTree,
    given: &'a BTreeMap<String, color::ValueKind>,
    known: &[&'a str],
) -> Result<(Compiled, usize), ProgramFault> {
    let mut compiler = Compiler::new(tree, given, false)?;
    compiler.others = known.to_vec();
    let mut names = Names::new();
    compiler.run(&tree.body, &mut names)?;
    let Some(value) = &tree.value else {
        let message = "it must end with a value, without a \";\"";
        return Err(ProgramFault::new(0, message.to_owned()));
    };
    let value = compiler.value(value, &names)?;
    let outputs = vec![(Output::Color, compiler.spread(&value))];
    let mut made = Compiled { ops: compiler.ops, outputs, ..Compiled::default() };
    made.drop_unused();
    Ok((made, value.parts.len()))
}

type Names = BTreeMap<String, Value>;

pub(super) struct Compiler<'a> {
    pub(super) ops: Vec<Op>,
    known: HashMap<Op, u32>,
    patterns: Vec<String>,
    /// What it is given by name.
    channels: &'a BTreeMap<String, color::ValueKind>,
    /// Whether it runs over fragments, in single precision.
    has_fragments: bool,
    /// Names that there are beside, for messages.
    others: Vec<&'a str>,
    pub(super) functions: HashMap<&'a str, &'a Function>,
    /// The functions that are written out, one inside of another.
    calls: Vec<&'a str>,
    visits: usize,
    inside: usize,
}

/// The name that was probably meant, or those that there are.
pub(super) fn meant(name: &str, known: &[&str]) -> String {
    match nearest(name, known.iter().copied()) {
        Some(near) => format!("did you mean \"{near}\"?"),
        None => format!("there are {}", list(known.iter().copied())),
    }
}

/// Whether a name is that of something that is there before the program.
fn is_given(name: &str) -> bool {
    name == "PI" || Variable::named(name).is_some()
}

impl<'a> Compiler<'a> {
    fn new(
        tree: &'a SyntaxTree,
        channels: &'a BTreeMap<String, color::ValueKind>,
        has_fragments: bool,
    ) -> Result<Compiler<'a>, ProgramFault> {
        for (number, function) in tree.functions.iter().enumerate() {
            let before = &tree.functions[..number];
            if before.iter().any(|other| other.name == function.name) {
                let message = format!("there are two functions \"{}\"", function.name);
                return Err(ProgramFault::new(function.at, message));
            }
            if built_in::names().any(|name| name == function.name) {
                let message = format!("there is a function \"{}\" already", function.name);
                return Err(ProgramFault::new(function.at, message));
            }
        }
        Ok(Compiler {
            ops: Vec::new(),
            known: HashMap::new(),
            patterns: Vec::new(),
            functions: tree.functions.iter().map(|f| (f.name.as_str(), f)).collect(),
            channels,
            has_fragments,
            others: Vec::new(),
            calls: Vec::new(),
            visits: 0,
            inside: 0,
        })
    }

    pub(super) fn push(&mut self, op: Op) -> Result<u32, ProgramFault> {
        let op = match self.has_fragments {
            true => op.folded::<f32>(&self.ops),
            false => op.folded::<f64>(&self.ops),
        };
        // The same instruction on the same registers makes the same value: it is there already.
        if let Some(known) = self.known.get(&op) {
            return Ok(*known);
        }
        if self.ops.len() >= MOST {
            let message = format!(
                "the program has more than {MOST} instructions, with its functions written out"
            );
            return Err(ProgramFault::new(0, message));
        }
        let at = self.ops.len() as u32;
        self.ops.push(op);
        self.known.insert(op, at);
        Ok(at)
    }

    pub(super) fn number(&mut self, number: f64) -> Result<u32, ProgramFault> {
        let rounded = if self.has_fragments { f64::from(number as f32) } else { number };
        self.push(Op::number(rounded))
    }

    pub(super) fn one(&mut self, op: Unary, a: u32) -> Result<u32, ProgramFault> {
        self.push(Op::Unary(op, a))
    }

    pub(super) fn two(&mut self, op: Binary, a: u32, b: u32) -> Result<u32, ProgramFault> {
        self.push(Op::Binary(op, a, b))
    }

    pub(super) fn choose(&mut self, c: u32, a: u32, b: u32) -> Result<u32, ProgramFault> {
        self.push(Op::Select(c, a, b))
    }

    pub(super) fn spread(&self, value: &Value) -> [u32; 3] {
        let at = |i: usize| value.parts[i.min(value.parts.len() - 1)];
        [at(0), at(1), at(2)]
    }

    fn run(&mut self, statements: &[Statement], names: &mut Names) -> Result<(), ProgramFault> {
        for statement in statements {
            match statement {
                Statement::Let { name, at, value } => {
                    if self.has_fragments
                        && is_given(name)
                        && !["color", "alpha", "normal"].contains(&name.as_str())
                    {
                        let message = format!("\"{name}\" is what it is: assign to another name");
                        return Err(ProgramFault::new(*at, message));
                    }
                    let value = self.value(value, names)?;
                    names.insert(name.clone(), value);
                }
                Statement::If { condition, then, otherwise } => {
                    let condition = self.condition(condition, names)?;
                    // There are no jumps. Both sides run, each from the names before the branch,
                    // and every name that either of them gives is chosen between.
                    let (mut yes, mut no) = (names.clone(), names.clone());
                    self.run(then, &mut yes)?;
                    self.run(otherwise, &mut no)?;
                    for (name, a) in yes {
                        // A name that only one side gives is what it was before on the other, if anything.
                        let b = match no.remove(&name) {
                            Some(b) => b,
                            None => match self.variable(&name)? {
                                Some(b) => b,
                                None => continue,
                            },
                        };
                        let merged = self.merged(condition, &a, &b)?;
                        names.insert(name, merged);
                    }
                    for (name, b) in no {
                        if let Some(a) = self.variable(&name)? {
                            let merged = self.merged(condition, &a, &b)?;
                            names.insert(name, merged);
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn merged(&mut self, c: u32, a: &Value, b: &Value) -> Result<Value, ProgramFault> {
        let count = a.parts.len().max(b.parts.len());
        let (x, y) = (self.spread(a), self.spread(b));
        let parts = (0..count).map(|i| self.choose(c, x[i], y[i])).collect::<Result<_, _>>()?;
        let width = self.two(Binary::Max, a.width, b.width)?;
        Ok(Value { parts, width })
    }

    /// A variable of the fragments.
    fn variable(&mut self, name: &str) -> Result<Option<Value>, ProgramFault> {
        let channel = (0..).zip(self.channels).find(|(_, (channel, _))| *channel == name);
        let of_channel = |(number, (_, kind)): (u32, (&String, &color::ValueKind))| {
            let parts = if *kind == color::ValueKind::Number { 0..1 } else { 0..3 };
            (parts.map(|k| Variable::Channel(number, k)).collect(), None)
        };
        let of_fragments = || Variable::named(name).filter(|_| self.has_fragments);
        let Some((parts, width)) = channel.map(of_channel).or_else(of_fragments) else {
            return Ok(None);
        };
        let parts: Vec<Variable> = parts;
        let parts =
            parts.into_iter().map(|part| self.push(Op::Input(part))).collect::<Result<_, _>>()?;
        let width = match width {
            Some(width) => self.push(Op::Input(width))?,
            None => self.number(0.0)?,
        };
        Ok(Some(Value { parts, width }))
    }

    /// One number that says whether.
    fn condition(&mut self, expr: &Expr, names: &Names) -> Result<u32, ProgramFault> {
        match &self.value(expr, names)?.parts[..] {
            [one] => Ok(*one),
            _ => {
                let message = "a condition is one number, not a vector: compare its parts, its \
                               length, or all of it by == and !=";
                Err(ProgramFault::new(expr.at, message.to_owned()))
            }
        }
    }

    fn value(&mut self, expr: &Expr, names: &Names) -> Result<Value, ProgramFault> {
        // Functions are written out where they are called. A few that each call another twice make
        // a short text very long.
        self.visits += 1;
        if self.visits > MOST_VISITS {
            let message = "the program is too long with its functions written out where they are \
                           called";
            return Err(ProgramFault::new(expr.at, message.to_owned()));
        }
        // The compiler calls itself as deep as expressions lie inside each other, and stacks end.
        if self.inside >= MOST_INSIDE {
            let message = format!(
                "more than {MOST_INSIDE} operations inside each other: give parts of them names"
            );
            return Err(ProgramFault::new(expr.at, message));
        }
        self.inside += 1;
        let value = self.value_of(expr, names);
        self.inside -= 1;
        value
    }

    fn value_of(&mut self, expr: &Expr, names: &Names) -> Result<Value, ProgramFault> {
        match &expr.kind {
            ExprKind::Number(number) => {
                let (part, width) = (self.number(*number)?, self.number(0.0)?);
                Ok(Value { parts: vec![part], width })
            }
            ExprKind::Text(_) => Err(ProgramFault::new(
                expr.at,
                "a text stands in object(\"..\") and material(\"..\") only".to_owned(),
            )),
            ExprKind::Name(name) => {
                if let Some(value) = names.get(name) {
                    return Ok(value.clone());
                }
                if name == "PI" {
                    let (part, width) = (self.number(std::f64::consts::PI)?, self.number(0.0)?);
                    return Ok(Value { parts: vec![part], width });
                }
                self.variable(name)?.ok_or_else(|| {
                    if let Some((_, part)) = name.split_once('.') {
                        return ProgramFault::new(expr.at, no_part(part));
                    }
                    let mut known: Vec<&str> = match self.has_fragments {
                        true => Variable::NAMES.to_vec(),
                        false => Vec::new(),
                    };
                    let others = self.channels.keys().chain(names.keys());
                    known.extend(others.map(String::as_str).chain(self.others.iter().copied()));
                    ProgramFault::new(
                        expr.at,
                        format!("there is no \"{name}\": {}", meant(name, &known)),
                    )
                })
            }
            ExprKind::Vector(parts) => {
                let mut made = Vec::new();
                let mut width = self.number(0.0)?;
                for part in parts.iter() {
                    let value = self.value(part, names)?;
                    if value.parts.len() > 1 {
                        let message = "a vector is made of three numbers".to_owned();
                        return Err(ProgramFault::new(part.at, message));
                    }
                    made.push(value.parts[0]);
                    width = self.two(Binary::Max, width, value.width)?;
                }
                Ok(Value { parts: made, width })
            }
            ExprKind::Part(of, part) => {
                let value = self.value(of, names)?;
                if value.parts.len() == 1 {
                    return Err(ProgramFault::new(expr.at, "a number has no parts".to_owned()));
                }
                Ok(Value { parts: vec![value.parts[*part]], width: value.width })
            }
            ExprKind::Unary(sign, of) => {
                let value = self.value(of, names)?;
                let op = match sign {
                    '-' => Unary::Negate,
                    '!' => Unary::Not,
                    _ => return Ok(value),
                };
                self.each(op, &value)
            }
            ExprKind::Binary(sign, a, b) => {
                let (a, b) = (self.value(a, names)?, self.value(b, names)?);
                self.binary(sign, &a, &b)
            }
            ExprKind::Choose(parts) => {
                let c = self.condition(&parts[0], names)?;
                let (a, b) = (self.value(&parts[1], names)?, self.value(&parts[2], names)?);
                self.merged(c, &a, &b)
            }
            ExprKind::Call(name, arguments) => self.call(expr.at, name, arguments, names),
        }
    }

    pub(super) fn each(&mut self, op: Unary, value: &Value) -> Result<Value, ProgramFault> {
        let parts = value.parts.iter().map(|part| self.one(op, *part)).collect::<Result<_, _>>()?;
        Ok(Value { parts, width: value.width })
    }

    /// The same for every part, a number standing for three alike.
    pub(super) fn pairs(
        &mut self,
        op: Binary,
        a: &Value,
        b: &Value,
    ) -> Result<Vec<u32>, ProgramFault> {
        let count = a.parts.len().max(b.parts.len());
        let (x, y) = (self.spread(a), self.spread(b));
        (0..count).map(|i| self.two(op, x[i], y[i])).collect()
    }

    pub(super) fn binary(
        &mut self,
        sign: &str,
        a: &Value,
        b: &Value,
    ) -> Result<Value, ProgramFault> {
        let op = match sign {
            "+" => Binary::Add,
            "-" => Binary::Subtract,
            "*" => Binary::Multiply,
            "/" => Binary::Divide,
            "%" => Binary::Modulo,
            "^" => Binary::Power,
            "<" => Binary::Less,
            ">" => Binary::Greater,
            "<=" => Binary::LessEqual,
            ">=" => Binary::GreaterEqual,
            "==" => Binary::Equal,
            "!=" => Binary::Unequal,
            "&&" => Binary::And,
            _ => Binary::Or,
        };
        let mut parts = self.pairs(op, a, b)?;
        // Vectors are equal if all of their parts are.
        let all = match op {
            Binary::Equal => Some(Binary::And),
            Binary::Unequal => Some(Binary::Or),
            _ => None,
        };
        if let Some(all) = all {
            let (mut one, rest) = (parts[0], parts.split_off(1));
            for part in rest {
                one = self.two(all, one, part)?;
            }
            parts = vec![one];
        }
        let width = match op {
            Binary::Add | Binary::Subtract => self.two(Binary::Add, a.width, b.width)?,
            Binary::Multiply => {
                // From one pixel to the next a product changes by |x| dy + |y| dx, in first order.
                let (x, y) = (self.most(a)?, self.most(b)?);
                let (p, q) = (
                    self.two(Binary::Multiply, x, b.width)?,
                    self.two(Binary::Multiply, y, a.width)?,
                );
                self.two(Binary::Add, p, q)?
            }
            Binary::Divide => {
                let y = self.most(b)?;
                self.two(Binary::Divide, a.width, y)?
            }
            _ => self.two(Binary::Max, a.width, b.width)?,
        };
        Ok(Value { parts, width })
    }

    /// The greatest amount of the parts.
    fn most(&mut self, value: &Value) -> Result<u32, ProgramFault> {
        let mut most = self.one(Unary::Abs, value.parts[0])?;
        for part in &value.parts[1..] {
            let part = self.one(Unary::Abs, *part)?;
            most = self.two(Binary::Max, most, part)?;
        }
        Ok(most)
    }

    fn call(
        &mut self,
        at: usize,
        name: &str,
        arguments: &[Expr],
        names: &Names,
    ) -> Result<Value, ProgramFault> {
        if built_in::OF_NAMES.contains(&name) {
            if !self.has_fragments {
                let message = format!("{name} is asked where something is seen, not here");
                return Err(ProgramFault::new(at, message));
            }
            let [Expr { kind: ExprKind::Text(pattern), .. }] = arguments else {
                let message = format!("{name} wants a name in quotes, such as {name}(\"*tree*\")");
                return Err(ProgramFault::new(at, message));
            };
            let number = self.patterns.len() as u32;
            self.patterns.push(pattern.clone());
            let fits = match name {
                "object" => Variable::ObjectFits(number),
                _ => Variable::MaterialFits(number),
            };
            let (part, width) = (self.push(Op::Input(fits))?, self.number(0.0)?);
            return Ok(Value { parts: vec![part], width });
        }
        let values: Vec<Value> = arguments
            .iter()
            .map(|argument| self.value(argument, names))
            .collect::<Result<_, _>>()?;
        if let Some(function) = self.functions.get(name).copied() {
            if values.len() != function.parameters.len() {
                let wanted = function.parameters.len();
                return Err(ProgramFault::new(
                    at,
                    format!("{name} takes {wanted} values, not {}", values.len()),
                ));
            }
            if let Some(first) = self.calls.iter().position(|called| *called == function.name) {
                let called = self.calls[first..].iter().copied();
                let around: Vec<&str> = called.chain([function.name.as_str()]).collect();
                let way = match around.len() {
                    2 => String::new(),
                    _ => format!(" ({})", around.join(" calls ")),
                };
                let message = format!("{name} calls itself{way}: functions cannot");
                return Err(ProgramFault::new(at, message));
            }
            if self.calls.len() >= MOST_CALLS {
                let message = format!(
                    "functions call each other more than {MOST_CALLS} deep: write some of them out"
                );
                return Err(ProgramFault::new(at, message));
            }
            // A function sees its own parameters and what every program is given, and no name of
            // its caller.
            self.calls.push(&function.name);
            let mut own: Names = function.parameters.iter().cloned().zip(values).collect();
            self.run(&function.body, &mut own)?;
            let value = self.value(&function.value, &own);
            self.calls.pop();
            return value;
        }
        self.built_in(at, name, &values)
    }
}
