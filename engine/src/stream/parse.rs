//! The text of a program as a tree.

use std::collections::BTreeSet;

use super::ProgramFault;

/// A statement.
#[derive(Debug, Clone)]
pub(super) enum Statement {
    /// `name = value;`
    Let { name: String, at: usize, value: Expr },
    /// `if (condition) { .. } else { .. }`
    If { condition: Expr, then: Vec<Statement>, otherwise: Vec<Statement> },
}

/// A function of the program's own: `def name(a, b) { statements; value }`.
#[derive(Debug, Clone)]
pub(super) struct Function {
    pub(super) name: String,
    pub(super) at: usize,
    pub(super) parameters: Vec<String>,
    pub(super) body: Vec<Statement>,
    pub(super) value: Expr,
}

/// An expression, and where it stands.
#[derive(Debug, Clone)]
pub(super) struct Expr {
    pub(super) at: usize,
    pub(super) kind: ExprKind,
    /// Expressions inside each other, this one included.
    height: usize,
}

#[derive(Debug, Clone)]
pub(super) enum ExprKind {
    Number(f64),
    Text(String),
    /// A name; that of a node's field has a dot in it.
    Name(String),
    Vector(Box<[Expr; 3]>),
    Call(String, Vec<Expr>),
    Part(Box<Expr>, usize),
    Unary(char, Box<Expr>),
    Binary(&'static str, Box<Expr>, Box<Expr>),
    Choose(Box<[Expr; 3]>),
}

impl Expr {
    /// # Errors
    /// If more are inside each other than anybody writes.
    fn new(at: usize, kind: ExprKind) -> Result<Expr, ProgramFault> {
        let inside: usize = match &kind {
            ExprKind::Number(_) | ExprKind::Text(_) | ExprKind::Name(_) => 0,
            ExprKind::Vector(parts) | ExprKind::Choose(parts) => tallest(&parts[..]),
            ExprKind::Call(_, arguments) => tallest(arguments),
            ExprKind::Part(of, _) | ExprKind::Unary(_, of) => of.height,
            ExprKind::Binary(_, a, b) => a.height.max(b.height),
        };
        if inside >= MOST_INSIDE {
            let message = format!(
                "more than {MOST_INSIDE} operations in one expression: give parts of it names"
            );
            return Err(ProgramFault::new(at, message));
        }
        Ok(Expr { at, kind, height: inside + 1 })
    }
}

fn tallest(parts: &[Expr]) -> usize {
    parts.iter().map(|part| part.height).max().unwrap_or(0)
}

/// A program.
#[derive(Debug, Clone, Default)]
pub(super) struct SyntaxTree {
    pub(super) functions: Vec<Function>,
    pub(super) body: Vec<Statement>,
    /// A value at the end: the colour.
    pub(super) value: Option<Expr>,
}

#[derive(Clone, Debug, PartialEq)]
enum Token {
    Number(f64),
    Name(String),
    Text(String),
    Sign(&'static str),
    End,
}

const SIGNS: [&str; 28] = [
    "&&", "||", "==", "!=", "<=", ">=", "+=", "-=", "*=", "/=", "+", "-", "*", "/", "%", "^", "<",
    ">", "!", "=", "(", ")", "{", "}", "[", "]", ",", ";",
];
const MORE: [&str; 3] = ["?", ":", "."];

/// How deep expressions and blocks may be nested.
const MOST_DEPTH: usize = 100;

/// How many expressions may be inside each other: a long sum is, term by term.
const MOST_INSIDE: usize = 400;

pub(super) fn parse(text: &str) -> Result<SyntaxTree, ProgramFault> {
    let tokens = tokens(text)?;
    let mut parser = Parser { tokens, next: 0, depth: 0 };
    let mut tree = SyntaxTree::default();
    while parser.peek_name() == Some("def") {
        tree.functions.push(parser.function()?);
    }
    let (body, value) = parser.block(&Token::End)?;
    (tree.body, tree.value) = (body, value);
    Ok(tree)
}

fn tokens(text: &str) -> Result<Vec<(Token, usize)>, ProgramFault> {
    let bytes = text.as_bytes();
    let mut tokens = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let rest = &text[at..];
        let first = rest.chars().next().unwrap_or(' ');
        if first.is_whitespace() {
            at += first.len_utf8();
        } else if first == '#' {
            at += rest.find('\n').unwrap_or(rest.len());
        } else if rest.starts_with("//") || rest.starts_with("/*") {
            let message = "a comment begins with # and goes to the end of its line".to_owned();
            return Err(ProgramFault::new(at, message));
        } else if first.is_ascii_digit()
            || first == '.' && rest[1..].starts_with(|c: char| c.is_ascii_digit())
        {
            let mut len = 0;
            let mut last = ' ';
            for c in rest.chars() {
                let is_sign = matches!(c, '+' | '-') && matches!(last, 'e' | 'E');
                if !(c.is_ascii_digit() || c == '.' || c == 'e' || c == 'E' || is_sign) {
                    break;
                }
                last = c;
                len += 1;
            }
            let number: f64 = rest[..len]
                .parse()
                .map_err(|_| ProgramFault::new(at, format!("\"{}\" is no number", &rest[..len])))?;
            tokens.push((Token::Number(number), at));
            at += len;
        } else if first.is_ascii_alphabetic() || first == '_' || first == '$' {
            let skip = usize::from(first == '$');
            let name = &rest[skip..];
            let len =
                name.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(name.len());
            if len == 0 {
                return Err(ProgramFault::new(at, "a name must follow the $".to_owned()));
            }
            tokens.push((Token::Name(name[..len].to_owned()), at));
            at += skip + len;
        } else if first == '"' || first == '\'' {
            let Some(len) = rest[1..].find(first) else {
                return Err(ProgramFault::new(at, "this text has no end".to_owned()));
            };
            tokens.push((Token::Text(rest[1..=len].to_owned()), at));
            at += len + 2;
        } else if let Some(sign) = SIGNS.iter().chain(&MORE).find(|sign| rest.starts_with(**sign)) {
            tokens.push((Token::Sign(sign), at));
            at += sign.len();
        } else {
            let cure = match first {
                '\u{201c}' | '\u{201d}' | '\u{201e}' | '\u{2018}' | '\u{2019}' => {
                    ": quotes are ' or \""
                }
                '\u{2212}' | '\u{2013}' => ": a minus is -",
                '\u{d7}' => ": times is *",
                c if c.is_alphabetic() => ": names are letters a to z, digits and _",
                _ => "",
            };
            return Err(ProgramFault::new(
                at,
                format!("\"{}\" means nothing here{cure}", first.escape_debug()),
            ));
        }
    }
    tokens.push((Token::End, text.len()));
    Ok(tokens)
}

struct Parser {
    tokens: Vec<(Token, usize)>,
    next: usize,
    depth: usize,
}

/// Signs between two values, the weakest first.
const LEVELS: [&[&str]; 6] =
    [&["||"], &["&&"], &["==", "!="], &["<", ">", "<=", ">="], &["+", "-"], &["*", "/", "%"]];

impl Parser {
    fn peek(&self) -> &Token {
        &self.tokens[self.next.min(self.tokens.len() - 1)].0
    }

    fn at(&self) -> usize {
        self.tokens[self.next.min(self.tokens.len() - 1)].1
    }

    fn peek_name(&self) -> Option<&str> {
        match self.peek() {
            Token::Name(name) => Some(name),
            _ => None,
        }
    }

    fn is(&self, sign: &str) -> bool {
        *self.peek() == Token::Sign(sign_of(sign))
    }

    fn take(&mut self, sign: &str) -> bool {
        let is = self.is(sign);
        self.next += usize::from(is);
        is
    }

    fn need(&mut self, sign: &str) -> Result<(), ProgramFault> {
        match self.take(sign) {
            true => Ok(()),
            false => {
                // What is assigned where it was to be compared.
                let cure = if self.is("=") { ": two values are compared by ==" } else { "" };
                let message = format!("expected \"{sign}\", found {}{cure}", self.found());
                Err(ProgramFault::new(self.at(), message))
            }
        }
    }

    fn found(&self) -> String {
        match self.peek() {
            Token::Number(number) => number.to_string(),
            Token::Name(name) => format!("\"{name}\""),
            Token::Text(_) => "a text".to_owned(),
            Token::Sign(sign) => format!("\"{sign}\""),
            Token::End => "the end".to_owned(),
        }
    }

    fn name(&mut self) -> Result<String, ProgramFault> {
        let name = self.peek_name().map(str::to_owned);
        let name = name.ok_or_else(|| {
            ProgramFault::new(self.at(), format!("expected a name, found {}", self.found()))
        })?;
        self.next += 1;
        Ok(name)
    }

    fn deeper<T>(
        &mut self,
        of: impl FnOnce(&mut Parser) -> Result<T, ProgramFault>,
    ) -> Result<T, ProgramFault> {
        if self.depth >= MOST_DEPTH {
            let message = format!("nested more than {MOST_DEPTH} deep");
            return Err(ProgramFault::new(self.at(), message));
        }
        self.depth += 1;
        let made = of(self);
        self.depth -= 1;
        made
    }

    fn function(&mut self) -> Result<Function, ProgramFault> {
        self.next += 1;
        let at = self.at();
        let name = self.name()?;
        self.need("(")?;
        let mut parameters = Vec::new();
        while !self.take(")") {
            if !parameters.is_empty() {
                self.need(",")?;
            }
            let at = self.at();
            let parameter = self.name()?;
            if parameters.contains(&parameter) {
                return Err(ProgramFault::new(at, format!("{name} takes \"{parameter}\" twice")));
            }
            parameters.push(parameter);
        }
        self.need("{")?;
        let (body, value) = self.block(&Token::Sign("}"))?;
        let end = self.at();
        self.need("}")?;
        let value = value.ok_or_else(|| {
            ProgramFault::new(
                end,
                format!("the function \"{name}\" must end with a value, without a \";\""),
            )
        })?;
        Ok(Function { name, at, parameters, body, value })
    }

    /// Statements up to a token, and the value that may stand at their end.
    fn block(&mut self, end: &Token) -> Result<(Vec<Statement>, Option<Expr>), ProgramFault> {
        let mut statements = Vec::new();
        while self.peek() != end {
            if *self.peek() == Token::End {
                return Err(ProgramFault::new(self.at(), "a \"}\" is missing".to_owned()));
            }
            if self.peek_name() == Some("if") {
                let statement = self.deeper(Parser::branch)?;
                statements.push(statement);
                continue;
            }
            let follows = self.tokens.get(self.next + 1).map(|(token, _)| token);
            let change = match follows {
                Some(Token::Sign(sign @ ("=" | "+=" | "-=" | "*=" | "/="))) => Some(*sign),
                _ => None,
            };
            let Some(change) = change.filter(|_| self.peek_name().is_some()) else {
                let value = self.expression()?;
                if self.peek() != end {
                    let message =
                        format!("expected the end or an operator, found {}", self.found());
                    return Err(ProgramFault::new(self.at(), message));
                }
                return Ok((statements, Some(value)));
            };
            let at = self.at();
            let name = self.name()?;
            self.next += 1;
            let mut value = self.expression()?;
            if change != "=" {
                let own = Expr::new(at, ExprKind::Name(name.clone()))?;
                let kind = ExprKind::Binary(sign_of(&change[..1]), Box::new(own), Box::new(value));
                value = Expr::new(at, kind)?;
            }
            self.need(";")?;
            statements.push(Statement::Let { name, at, value });
        }
        Ok((statements, None))
    }

    fn branch(&mut self) -> Result<Statement, ProgramFault> {
        self.next += 1;
        self.need("(")?;
        let condition = self.expression()?;
        self.need(")")?;
        let then = self.braces()?;
        let mut otherwise = Vec::new();
        if self.peek_name() == Some("else") {
            self.next += 1;
            if self.peek_name() == Some("if") {
                otherwise.push(self.deeper(Parser::branch)?);
            } else {
                otherwise = self.braces()?;
            }
        }
        Ok(Statement::If { condition, then, otherwise })
    }

    fn braces(&mut self) -> Result<Vec<Statement>, ProgramFault> {
        self.need("{")?;
        let (statements, value) = self.deeper(|parser| parser.block(&Token::Sign("}")))?;
        if let Some(value) = value {
            return Err(ProgramFault::new(
                value.at,
                "this value goes nowhere: give it a name".to_owned(),
            ));
        }
        self.need("}")?;
        Ok(statements)
    }

    fn expression(&mut self) -> Result<Expr, ProgramFault> {
        self.deeper(|parser| {
            let condition = parser.binary(0)?;
            if !parser.take("?") {
                return Ok(condition);
            }
            let at = condition.at;
            let then = parser.expression()?;
            parser.need(":")?;
            let otherwise = parser.expression()?;
            Expr::new(at, ExprKind::Choose(Box::new([condition, then, otherwise])))
        })
    }

    fn binary(&mut self, level: usize) -> Result<Expr, ProgramFault> {
        let Some(signs) = LEVELS.get(level) else { return self.unary() };
        let mut left = self.binary(level + 1)?;
        while let Some(sign) = signs.iter().find(|sign| self.is(sign)) {
            let at = self.at();
            self.next += 1;
            let right = self.binary(level + 1)?;
            left = Expr::new(at, ExprKind::Binary(sign, Box::new(left), Box::new(right)))?;
        }
        Ok(left)
    }

    fn unary(&mut self) -> Result<Expr, ProgramFault> {
        let at = self.at();
        for sign in ['-', '!', '+'] {
            if self.take(&sign.to_string()) {
                let of = self.deeper(Parser::unary)?;
                return Expr::new(at, ExprKind::Unary(sign, Box::new(of)));
            }
        }
        let base = self.postfix()?;
        if !self.take("^") {
            return Ok(base);
        }
        // To the right first: 2 ^ 3 ^ 2 is 2 ^ 9.
        let power = self.deeper(Parser::unary)?;
        Expr::new(at, ExprKind::Binary("^", Box::new(base), Box::new(power)))
    }

    fn postfix(&mut self) -> Result<Expr, ProgramFault> {
        let mut value = self.primary()?;
        loop {
            let at = self.at();
            let part = if self.take("[") {
                let part = match self.peek() {
                    Token::Number(n) if [0.0, 1.0, 2.0].contains(n) => *n as usize,
                    _ => {
                        return Err(ProgramFault::new(self.at(), "a part is 0, 1 or 2".to_owned()));
                    }
                };
                self.next += 1;
                self.need("]")?;
                part
            } else if self.take(".") {
                let name = self.name()?;
                match name.as_str() {
                    "x" | "r" => 0,
                    "y" | "g" => 1,
                    "z" | "b" => 2,
                    _ => match &mut value.kind {
                        // What has no dot yet may be a node.
                        ExprKind::Name(node) if !node.contains('.') => {
                            *node = format!("{node}.{name}");
                            continue;
                        }
                        _ => return Err(ProgramFault::new(at, no_part(&name))),
                    },
                }
            } else {
                return Ok(value);
            };
            value = Expr::new(at, ExprKind::Part(Box::new(value), part))?;
        }
    }

    fn primary(&mut self) -> Result<Expr, ProgramFault> {
        let at = self.at();
        let kind = match self.peek().clone() {
            Token::Number(number) => {
                self.next += 1;
                ExprKind::Number(number)
            }
            Token::Text(text) => {
                self.next += 1;
                ExprKind::Text(text)
            }
            Token::Name(name) => {
                self.next += 1;
                if self.take("(") {
                    let mut arguments = Vec::new();
                    while !self.take(")") {
                        if !arguments.is_empty() {
                            self.need(",")?;
                        }
                        arguments.push(self.expression()?);
                    }
                    ExprKind::Call(name, arguments)
                } else {
                    ExprKind::Name(name)
                }
            }
            Token::Sign("(") => {
                self.next += 1;
                let value = self.expression()?;
                self.need(")")?;
                return Ok(value);
            }
            Token::Sign("[") => {
                self.next += 1;
                let a = self.expression()?;
                self.need(",")?;
                let b = self.expression()?;
                self.need(",")?;
                let c = self.expression()?;
                self.need("]")?;
                ExprKind::Vector(Box::new([a, b, c]))
            }
            _ => {
                let message = format!("expected a value, found {}", self.found());
                return Err(ProgramFault::new(at, message));
            }
        };
        Expr::new(at, kind)
    }
}

/// What is said of a part that no vector has.
pub(super) fn no_part(name: &str) -> String {
    format!("there is no part \"{name}\": it is x, y, z or r, g, b")
}

impl SyntaxTree {
    /// All names that are read, each once.
    pub(super) fn names(&self) -> BTreeSet<&str> {
        let mut names = BTreeSet::new();
        for function in &self.functions {
            of_statements(&function.body, &mut names);
            of_expression(&function.value, &mut names);
        }
        of_statements(&self.body, &mut names);
        self.value.iter().for_each(|value| of_expression(value, &mut names));
        names
    }
}

fn of_statements<'t>(statements: &'t [Statement], names: &mut BTreeSet<&'t str>) {
    for statement in statements {
        match statement {
            Statement::Let { value, .. } => of_expression(value, names),
            Statement::If { condition, then, otherwise } => {
                of_expression(condition, names);
                of_statements(then, names);
                of_statements(otherwise, names);
            }
        }
    }
}

fn of_expression<'t>(expr: &'t Expr, names: &mut BTreeSet<&'t str>) {
    match &expr.kind {
        ExprKind::Number(_) | ExprKind::Text(_) => {}
        ExprKind::Name(name) => {
            names.insert(name);
        }
        ExprKind::Vector(parts) | ExprKind::Choose(parts) => {
            parts.iter().for_each(|part| of_expression(part, names));
        }
        ExprKind::Call(_, arguments) => {
            arguments.iter().for_each(|argument| of_expression(argument, names));
        }
        ExprKind::Part(of, _) | ExprKind::Unary(_, of) => of_expression(of, names),
        ExprKind::Binary(_, a, b) => {
            of_expression(a, names);
            of_expression(b, names);
        }
    }
}

/// A sign of the language, as the language has it.
fn sign_of(sign: &str) -> &'static str {
    SIGNS.iter().chain(&MORE).find(|known| **known == sign).copied().unwrap_or("")
}
