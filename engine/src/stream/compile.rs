//! From the tree to instructions: one register each, in order, without jumps. Both sides of a branch are
//! computed, and a choice keeps one; functions are written out where they are called. So every program ends.

use std::collections::{BTreeMap, HashMap};

use super::parse::{Expr, Function, Kind, Statement, Tree};
use super::run::{Binary, Input, Op, Unary};
use super::{Fault, Parameter};

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
struct Value {
    parts: Vec<u32>,
    /// By how much it differs from one pixel to the next, about.
    width: u32,
}

/// What a program makes.
#[derive(Debug, Default)]
pub(super) struct Compiled {
    pub(super) ops: Vec<Op>,
    pub(super) patterns: Vec<String>,
    pub(super) color: Option<[u32; 3]>,
    pub(super) alpha: Option<u32>,
    pub(super) normal: Option<[u32; 3]>,
}

pub(super) fn compile(
    tree: &Tree,
    parameters: &BTreeMap<String, Parameter>,
) -> Result<Compiled, Fault> {
    let mut compiler = Compiler {
        ops: Vec::new(),
        known: HashMap::new(),
        patterns: Vec::new(),
        functions: tree.functions.iter().map(|f| (f.name.as_str(), f)).collect(),
        calls: 0,
        visits: 0,
        inside: 0,
    };
    for (number, function) in tree.functions.iter().enumerate() {
        let before = &tree.functions[..number];
        if before.iter().any(|other| other.name == function.name) {
            let message = format!("there are two functions \"{}\"", function.name);
            return Err(Fault::new(function.at, message));
        }
        if BUILT_IN.contains(&function.name.as_str()) {
            let message = format!("there is a function \"{}\" already", function.name);
            return Err(Fault::new(function.at, message));
        }
    }
    let mut names = Names::new();
    for (name, parameter) in parameters {
        if is_given(name) {
            let message = format!("the parameter \"{name}\" has the name of a variable");
            return Err(Fault::new(0, message));
        }
        let numbers: Vec<f32> = match parameter {
            Parameter::Number(number) => vec![*number],
            Parameter::Color(color) => color.to_array().to_vec(),
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
    let three =
        |compiler: &Compiler<'_>, name: &str| named.get(name).map(|value| compiler.spread(value));
    let color = three(&compiler, "color");
    let normal = three(&compiler, "normal");
    let alpha = named.get("alpha").map(|v| v.parts[0]);
    if color.is_none() && normal.is_none() && alpha.is_none() {
        let message =
            "the program makes nothing: assign color, alpha or normal, or end with a colour";
        return Err(Fault::new(0, message.to_owned()));
    }
    let Compiler { ops, patterns, .. } = compiler;
    let mut made = Compiled { ops, patterns, color, alpha, normal };
    made.drop_unused();
    Ok(made)
}

type Names = BTreeMap<String, Value>;

struct Compiler<'a> {
    ops: Vec<Op>,
    known: HashMap<Op, u32>,
    patterns: Vec<String>,
    functions: HashMap<&'a str, &'a Function>,
    calls: usize,
    visits: usize,
    inside: usize,
}

/// Whether a name is that of something that is there before the program.
fn is_given(name: &str) -> bool {
    name == "PI" || Input::named(name).is_some()
}

/// The functions of the language; names and ranges are those of SeExpr and OSL.
const BUILT_IN: [&str; 56] = [
    "abs",
    "acos",
    "asin",
    "atan",
    "atan2",
    "bias",
    "boxstep",
    "cellnoise",
    "clamp",
    "contrast",
    "cos",
    "cross",
    "deg",
    "dist",
    "dot",
    "exp",
    "fbm",
    "fit",
    "floor",
    "ceil",
    "round",
    "fmod",
    "gamma",
    "gaussstep",
    "hsltorgb",
    "hypot",
    "invert",
    "length",
    "linearstep",
    "log",
    "log10",
    "luminance",
    "max",
    "min",
    "mix",
    "noise",
    "norm",
    "object",
    "pow",
    "rad",
    "rgbtohsl",
    "saturate",
    "sign",
    "sin",
    "smoothstep",
    "snoise",
    "sqrt",
    "step",
    "tan",
    "turbulence",
    "up",
    "vfbm",
    "vnoise",
    "vturbulence",
    "voronoi",
    "vcell",
];

impl Compiler<'_> {
    fn push(&mut self, op: Op) -> Result<u32, Fault> {
        let op = op.folded(&self.ops);
        if let Some(known) = self.known.get(&op) {
            return Ok(*known);
        }
        if self.ops.len() >= MOST {
            let message = format!(
                "the program has more than {MOST} instructions, with its functions written out"
            );
            return Err(Fault::new(0, message));
        }
        let at = self.ops.len() as u32;
        self.ops.push(op);
        self.known.insert(op, at);
        Ok(at)
    }

    fn number(&mut self, number: f32) -> Result<u32, Fault> {
        self.push(Op::number(number))
    }

    fn one(&mut self, op: Unary, a: u32) -> Result<u32, Fault> {
        self.push(Op::Unary(op, a))
    }

    fn two(&mut self, op: Binary, a: u32, b: u32) -> Result<u32, Fault> {
        self.push(Op::Binary(op, a, b))
    }

    fn choose(&mut self, c: u32, a: u32, b: u32) -> Result<u32, Fault> {
        self.push(Op::Select(c, a, b))
    }

    fn spread(&self, value: &Value) -> [u32; 3] {
        let at = |i: usize| value.parts[i.min(value.parts.len() - 1)];
        [at(0), at(1), at(2)]
    }

    fn run(&mut self, statements: &[Statement], names: &mut Names) -> Result<(), Fault> {
        for statement in statements {
            match statement {
                Statement::Let { name, at, value } => {
                    if is_given(name) && !["color", "alpha", "normal"].contains(&name.as_str()) {
                        let message = format!("\"{name}\" is what it is: assign to another name");
                        return Err(Fault::new(*at, message));
                    }
                    let value = self.value(value, names)?;
                    names.insert(name.clone(), value);
                }
                Statement::If { condition, then, otherwise } => {
                    let condition = self.condition(condition, names)?;
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

    fn merged(&mut self, c: u32, a: &Value, b: &Value) -> Result<Value, Fault> {
        let count = a.parts.len().max(b.parts.len());
        let (x, y) = (self.spread(a), self.spread(b));
        let parts = (0..count).map(|i| self.choose(c, x[i], y[i])).collect::<Result<_, _>>()?;
        let width = self.two(Binary::Max, a.width, b.width)?;
        Ok(Value { parts, width })
    }

    /// A variable of the fragments.
    fn variable(&mut self, name: &str) -> Result<Option<Value>, Fault> {
        let Some((first, count, width)) = Input::named(name) else { return Ok(None) };
        let part = |i: u32| Op::Input(first.part(i));
        let parts = (0..count).map(|i| self.push(part(i))).collect::<Result<_, _>>()?;
        let width = match width {
            Some(width) => self.push(Op::Input(width))?,
            None => self.number(0.0)?,
        };
        Ok(Some(Value { parts, width }))
    }

    /// One number that says whether.
    fn condition(&mut self, expr: &Expr, names: &Names) -> Result<u32, Fault> {
        match &self.value(expr, names)?.parts[..] {
            [one] => Ok(*one),
            _ => {
                let message = "a condition is one number, not a vector: compare its parts, its \
                               length, or all of it by == and !=";
                Err(Fault::new(expr.at, message.to_owned()))
            }
        }
    }

    fn value(&mut self, expr: &Expr, names: &Names) -> Result<Value, Fault> {
        self.visits += 1;
        if self.visits > MOST_VISITS {
            let message = "the program is too long with its functions written out where they are \
                           called";
            return Err(Fault::new(expr.at, message.to_owned()));
        }
        if self.inside >= MOST_INSIDE {
            let message = format!(
                "more than {MOST_INSIDE} operations inside each other: give parts of them names"
            );
            return Err(Fault::new(expr.at, message));
        }
        self.inside += 1;
        let value = self.value_of(expr, names);
        self.inside -= 1;
        value
    }

    fn value_of(&mut self, expr: &Expr, names: &Names) -> Result<Value, Fault> {
        match &expr.kind {
            Kind::Number(number) => {
                let (part, width) = (self.number(*number)?, self.number(0.0)?);
                Ok(Value { parts: vec![part], width })
            }
            Kind::Text(_) => {
                Err(Fault::new(expr.at, "a text stands in object(\"..\") only".to_owned()))
            }
            Kind::Name(name) => {
                if let Some(value) = names.get(name) {
                    return Ok(value.clone());
                }
                if name == "PI" {
                    let (part, width) = (self.number(std::f32::consts::PI)?, self.number(0.0)?);
                    return Ok(Value { parts: vec![part], width });
                }
                self.variable(name)?.ok_or_else(|| {
                    let mut known: Vec<&str> = Input::NAMES.to_vec();
                    known.extend(names.keys().map(String::as_str));
                    let list = known.join(", ");
                    Fault::new(expr.at, format!("there is no \"{name}\": there are {list}"))
                })
            }
            Kind::Vector(parts) => {
                let mut made = Vec::new();
                let mut width = self.number(0.0)?;
                for part in parts.iter() {
                    let value = self.value(part, names)?;
                    if value.parts.len() > 1 {
                        let message = "a vector is made of three numbers".to_owned();
                        return Err(Fault::new(part.at, message));
                    }
                    made.push(value.parts[0]);
                    width = self.two(Binary::Max, width, value.width)?;
                }
                Ok(Value { parts: made, width })
            }
            Kind::Part(of, part) => {
                let value = self.value(of, names)?;
                if value.parts.len() == 1 {
                    return Err(Fault::new(expr.at, "a number has no parts".to_owned()));
                }
                Ok(Value { parts: vec![value.parts[*part]], width: value.width })
            }
            Kind::Unary(sign, of) => {
                let value = self.value(of, names)?;
                let op = match sign {
                    '-' => Unary::Negate,
                    '!' => Unary::Not,
                    _ => return Ok(value),
                };
                self.each(op, &value)
            }
            Kind::Binary(sign, a, b) => {
                let (a, b) = (self.value(a, names)?, self.value(b, names)?);
                self.binary(sign, &a, &b)
            }
            Kind::Choose(parts) => {
                let c = self.condition(&parts[0], names)?;
                let (a, b) = (self.value(&parts[1], names)?, self.value(&parts[2], names)?);
                self.merged(c, &a, &b)
            }
            Kind::Call(name, arguments) => self.call(expr.at, name, arguments, names),
        }
    }

    fn each(&mut self, op: Unary, value: &Value) -> Result<Value, Fault> {
        let parts = value.parts.iter().map(|part| self.one(op, *part)).collect::<Result<_, _>>()?;
        Ok(Value { parts, width: value.width })
    }

    /// The same for every part, a number standing for three alike.
    fn pairs(&mut self, op: Binary, a: &Value, b: &Value) -> Result<Vec<u32>, Fault> {
        let count = a.parts.len().max(b.parts.len());
        let (x, y) = (self.spread(a), self.spread(b));
        (0..count).map(|i| self.two(op, x[i], y[i])).collect()
    }

    fn binary(&mut self, sign: &str, a: &Value, b: &Value) -> Result<Value, Fault> {
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
    fn most(&mut self, value: &Value) -> Result<u32, Fault> {
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
    ) -> Result<Value, Fault> {
        if name == "object" {
            let [Expr { kind: Kind::Text(pattern), .. }] = arguments else {
                let message =
                    "object wants a name in quotes, such as object(\"*tree*\")".to_owned();
                return Err(Fault::new(at, message));
            };
            let number = self.patterns.len() as u32;
            self.patterns.push(pattern.clone());
            let (part, width) = (self.push(Op::Fits(number))?, self.number(0.0)?);
            return Ok(Value { parts: vec![part], width });
        }
        let values: Vec<Value> = arguments
            .iter()
            .map(|argument| self.value(argument, names))
            .collect::<Result<_, _>>()?;
        if let Some(function) = self.functions.get(name).copied() {
            if values.len() != function.parameters.len() {
                let wanted = function.parameters.len();
                return Err(Fault::new(
                    at,
                    format!("{name} takes {wanted} values, not {}", values.len()),
                ));
            }
            if self.calls >= MOST_CALLS {
                return Err(Fault::new(at, format!("{name} calls itself: functions cannot")));
            }
            self.calls += 1;
            let mut own: Names = function.parameters.iter().cloned().zip(values).collect();
            self.run(&function.body, &mut own)?;
            let value = self.value(&function.value, &own);
            self.calls -= 1;
            return value;
        }
        self.built_in(at, name, &values)
    }

    fn built_in(&mut self, at: usize, name: &str, values: &[Value]) -> Result<Value, Fault> {
        let counts = match name {
            "abs" | "acos" | "asin" | "atan" | "cos" | "deg" | "exp" | "floor" | "ceil"
            | "round" | "hsltorgb" | "invert" | "length" | "log" | "log10" | "luminance"
            | "noise" | "norm" | "rad" | "rgbtohsl" | "sign" | "sin" | "snoise" | "sqrt"
            | "tan" | "vnoise" | "cellnoise" | "vcell" => 1..=1,
            "atan2" | "bias" | "boxstep" | "contrast" | "cross" | "dist" | "dot" | "fmod"
            | "gamma" | "hypot" | "pow" | "saturate" | "step" => 2..=2,
            "up" => 1..=2,
            "max" | "min" => 2..=8,
            "clamp" | "gaussstep" | "linearstep" | "mix" | "smoothstep" => 3..=3,
            "fit" => 5..=5,
            "fbm" | "turbulence" | "vfbm" | "vturbulence" => 1..=4,
            "voronoi" => 1..=3,
            _ => {
                let mut list: Vec<&str> = BUILT_IN.to_vec();
                list.extend(self.functions.keys().copied());
                list.sort_unstable();
                let message =
                    format!("there is no function \"{name}\": there are {}", list.join(", "));
                return Err(Fault::new(at, message));
            }
        };
        if !counts.contains(&values.len()) {
            let (least, most) = (*counts.start(), *counts.end());
            let wanted =
                if least == most { least.to_string() } else { format!("{least} to {most}") };
            return Err(Fault::new(
                at,
                format!("{name} takes {wanted} values, not {}", values.len()),
            ));
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
            "deg" => self.scaled(x, 180.0 / std::f32::consts::PI),
            "rad" => self.scaled(x, std::f32::consts::PI / 180.0),
            "log10" => {
                let log = plain(self, Unary::Log)?;
                self.scaled(&log, std::f32::consts::LOG10_E)
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
                let way = self.binary("-", &values[1], x)?;
                let part = self.binary("*", &way, &values[2])?;
                let mut mixed = self.binary("+", x, &part)?;
                let widths = self.two(Binary::Max, x.width, values[1].width)?;
                mixed.width = self.two(Binary::Add, widths, values[2].width)?;
                Ok(mixed)
            }
            "linearstep" | "smoothstep" | "gaussstep" => {
                let t = self.share(x, &values[1], &values[2])?;
                match name {
                    "linearstep" => Ok(t),
                    "smoothstep" => {
                        let (two, three) = (self.constant(2.0)?, self.constant(3.0)?);
                        let twice = self.binary("*", &two, &t)?;
                        let rest = self.binary("-", &three, &twice)?;
                        let square = self.binary("*", &t, &t)?;
                        self.binary("*", &square, &rest)
                    }
                    _ => {
                        // SeExpr's: 2^(-8 (1 - t)^2), and nothing below.
                        let one = self.constant(1.0)?;
                        let off = self.binary("-", &one, &t)?;
                        let square = self.binary("*", &off, &off)?;
                        let power = self.scaled(&square, -8.0 * std::f32::consts::LN_2)?;
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
                let power = self.scaled(&log, -1.0 / std::f32::consts::LN_2)?;
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
            // voronoi(v, kind, jitter): 1 the way to the nearest point, 2 to the second, 3 how much farther that
            // is, 4 a number of the nearest.
            _ => {
                let jitter = match values.get(2) {
                    Some(jitter) => jitter.parts[0],
                    None => self.number(0.5)?,
                };
                let kind = values.get(1).map_or(Ok(1.0), |kind| {
                    let known = self.ops[kind.parts[0] as usize].as_number();
                    let known = known.filter(|kind| [1.0, 2.0, 3.0, 4.0].contains(kind));
                    known.ok_or_else(|| {
                        Fault::new(at, "the kind of voronoi is 1, 2, 3 or 4".to_owned())
                    })
                })?;
                let from = self.spread(x);
                let mut part = |part: u32| self.push(Op::Voronoi { from, jitter, part });
                let part = match kind as u32 {
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

    fn constant(&mut self, number: f32) -> Result<Value, Fault> {
        Ok(Value { parts: vec![self.number(number)?], width: self.number(0.0)? })
    }

    fn scaled(&mut self, value: &Value, by: f32) -> Result<Value, Fault> {
        let by = self.constant(by)?;
        self.binary("*", value, &by)
    }

    fn parted(&mut self, op: Binary, a: &Value, b: &Value) -> Result<Value, Fault> {
        let parts = self.pairs(op, a, b)?;
        Ok(Value { parts, width: self.two(Binary::Max, a.width, b.width)? })
    }

    /// Where a value lies between two, 0 to 1.
    fn share(&mut self, x: &Value, from: &Value, to: &Value) -> Result<Value, Fault> {
        let way = self.binary("-", x, from)?;
        let whole = self.binary("-", to, from)?;
        let t = self.binary("/", &way, &whole)?;
        let (zero, one) = (self.constant(0.0)?, self.constant(1.0)?);
        let t = self.parted(Binary::Max, &t, &zero)?;
        self.parted(Binary::Min, &t, &one)
    }

    fn dot(&mut self, a: &Value, b: &Value) -> Result<u32, Fault> {
        let (x, y) = (self.spread(a), self.spread(b));
        let mut sum = self.two(Binary::Multiply, x[0], y[0])?;
        for i in 1..3 {
            let part = self.two(Binary::Multiply, x[i], y[i])?;
            sum = self.two(Binary::Add, sum, part)?;
        }
        Ok(sum)
    }

    fn luminance(&mut self, color: &Value) -> Result<u32, Fault> {
        let weights = [0.2126, 0.7152, 0.0722].map(|weight| self.number(weight));
        let mut parts = Vec::new();
        for weight in weights {
            parts.push(weight?);
        }
        let width = color.width;
        self.dot(color, &Value { parts, width })
    }

    /// A place, far from itself for other noise of it.
    fn moved(&mut self, value: &Value, k: u32) -> Result<[u32; 3], Fault> {
        let from = self.spread(value);
        let mut moved = from;
        if k > 0 {
            for (i, part) in moved.iter_mut().enumerate() {
                let by = self.number([17.3, 31.7, 43.1][i] * k as f32)?;
                *part = self.two(Binary::Add, from[i], by)?;
            }
        }
        Ok(moved)
    }

    /// From -1 to 1 to 0 to 1.
    fn halved(&mut self, value: u32) -> Result<u32, Fault> {
        let half = self.number(0.5)?;
        let scaled = self.two(Binary::Multiply, value, half)?;
        self.two(Binary::Add, scaled, half)
    }
}

impl Compiled {
    /// Leaves the instructions that something is made of.
    fn drop_unused(&mut self) {
        let mut used = vec![false; self.ops.len()];
        let made = self.color.iter().chain(&self.normal).flatten().chain(&self.alpha);
        made.for_each(|at| used[*at as usize] = true);
        for at in (0..self.ops.len()).rev() {
            if used[at] {
                self.ops[at].each(|from| used[*from as usize] = true);
            }
        }
        let mut places = vec![0u32; self.ops.len()];
        let mut kept = Vec::new();
        for (at, mut op) in std::mem::take(&mut self.ops).into_iter().enumerate() {
            if used[at] {
                op.each_mut(|from| *from = places[*from as usize]);
                places[at] = kept.len() as u32;
                kept.push(op);
            }
        }
        self.ops = kept;
        let place = |at: &mut u32| *at = places[*at as usize];
        self.color.iter_mut().chain(&mut self.normal).flatten().for_each(place);
        self.alpha.iter_mut().for_each(place);
    }
}
