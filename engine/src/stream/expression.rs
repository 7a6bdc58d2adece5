//! Expressions of numbers that are given by name, such as `2 + sin(time)`: the same language, without fragments.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use super::ProgramFault;
use super::compile::{Compiled, Output, compile_value};
use super::parse::{self, SyntaxTree};
use super::variable::Variable;
use crate::color::ValueKind;

/// An expression: a program of the stream language that ends in a number or a vector. Computed in double precision.
///
/// ```
/// use std::collections::BTreeMap;
/// use spandrel_engine::stream::Expression;
///
/// let expression = Expression::parse("[time, 0, 0] * sun.speed").unwrap();
/// assert_eq!(expression.names(), ["sun.speed", "time"]);
/// let given = [("time", vec![1.5]), ("sun.speed", vec![2.0])];
/// let given: BTreeMap<String, Vec<f64>> =
///     given.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
/// assert_eq!(expression.value(&given, &[]).unwrap(), [3.0, 0.0, 0.0]);
/// ```
#[derive(Debug)]
pub struct Expression {
    text: String,
    tree: SyntaxTree,
    /// Compiled for the kinds of values that it was given first.
    compiled: OnceLock<(Kinds, Compiled, usize)>,
}

type Kinds = BTreeMap<String, ValueKind>;

impl Expression {
    /// Reads an expression.
    ///
    /// # Errors
    /// If its text is none.
    pub fn parse(text: &str) -> Result<Expression, ProgramFault> {
        let tree = parse::parse(text).map_err(|fault| fault.placed(text))?;
        Ok(Expression { text: text.to_owned(), tree, compiled: OnceLock::new() })
    }

    /// The names that it reads, its own ones too. Those of other things' fields have a dot in them.
    pub fn names(&self) -> Vec<&str> {
        self.tree.names().into_iter().collect()
    }

    /// Its value, one number or three, of what it is given by name: one number or three each. `known` are other names
    /// that there are, for messages.
    ///
    /// # Errors
    /// If it reads what it is not given, or mixes numbers and vectors where they do not go together.
    pub fn value(
        &self,
        given: &BTreeMap<String, Vec<f64>>,
        known: &[&str],
    ) -> Result<Vec<f64>, ProgramFault> {
        let kind = |value: &Vec<f64>| match value.len() {
            1 => ValueKind::Number,
            _ => ValueKind::Color,
        };
        let kinds: Kinds = given.iter().map(|(name, value)| (name.clone(), kind(value))).collect();
        let compile = || {
            let compiled = compile_value(&self.tree, &kinds, known);
            compiled.map_err(|fault| fault.placed(&self.text))
        };
        match self.compiled.get() {
            Some((known, compiled, parts)) if *known == kinds => {
                return Ok(run(compiled, *parts, given));
            }
            // What it is given became a vector, or is a number now.
            Some(_) => {
                let (compiled, parts) = compile()?;
                return Ok(run(&compiled, parts, given));
            }
            None => {}
        }
        let (compiled, parts) = compile()?;
        let value = run(&compiled, parts, given);
        // Another thread may have been first, with the same.
        let _ = self.compiled.set((kinds, compiled, parts));
        Ok(value)
    }
}

fn run(compiled: &Compiled, parts: usize, given: &BTreeMap<String, Vec<f64>>) -> Vec<f64> {
    let given: Vec<&Vec<f64>> = given.values().collect();
    let input = |variable: Variable| match variable {
        Variable::Channel(number, part) => given[number as usize][part as usize],
        _ => 0.0,
    };
    let mut registers: Vec<f64> = Vec::new();
    for op in &compiled.ops {
        let value = op.value(|at| registers[at as usize], input);
        registers.push(value);
    }
    let [(Output::Color, made)] = &compiled.outputs[..] else { return Vec::new() };
    made[..parts].iter().map(|at| registers[*at as usize]).collect()
}
