//! What changes in time: values of a text that are curves, expressions or references.
//!
//! Any value of a graph or scene may be one of these, whatever its type; at a moment, what it is then takes its place
//! in the text, and the text is read as if a person had written it.
//!
//! ```ron
//! "car":   Transform(image: "cars", shift: Curve([(1, (0, 0)), (48, (120, 0))], Linear)),
//! "sun":   ParallelLight(direction: (-1, -2, 0), illuminance: Expr("2 + sin(time)")),
//! "fog":   Fog(image: "lit", density: Ref("haze"), color: Ref("sky.color")),
//! ```
//!
//! - A **curve** has values at frames. Numbers, vectors, colours, and lists of anything with numbers in it
//!   move from key to key; what has no numbers changes in steps.
//! - An **expression** is one of the [stream language](crate::stream), in double precision. It knows `frame`, `time`
//!   in seconds, parameters by name and, in a graph, other nodes' fields as `node.field`.
//! - A **reference** is the value of a parameter, or of another node's field, of any type.

pub(crate) mod curve;
mod form;
mod sequence;

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use crate::moment::Moment;
use crate::stream::Expression;
use crate::text::token::{Token, skip_blank, token};
use crate::text::{Diagnostic, Index, Patch, Woven, offset_in_text};
use curve::Curve;
pub use sequence::numbered;

/// What expressions and references may name.
pub trait Names {
    /// The names without a dot.
    fn parameters(&self) -> Vec<&str>;

    /// What a name means: a parameter, or a field by `node.field`.
    ///
    /// # Errors
    /// If there is no such name.
    fn find(&self, name: &str) -> Result<Named<'_>, String>;
}

/// What a name means.
#[derive(Debug)]
pub enum Named<'n> {
    /// The text of a value.
    Value(&'n str),
    /// A part of a text, in which something may move.
    Part(&'n str, Range<usize>, &'n Motion),
}

/// Looks up what is named, at a moment.
struct Lookup<'n> {
    names: &'n dyn Names,
    moment: Moment,
    /// The names that are being looked up, one because of another.
    open: Vec<String>,
    /// What was looked up.
    known: HashMap<String, String>,
}

/// The longest text that a value may become, in bytes: references to lists of references grow fast.
const LONGEST: usize = 1 << 20;

impl Lookup<'_> {
    /// The text of what is named.
    fn text(&mut self, name: &str) -> Result<String, String> {
        if let Some(known) = self.known.get(name) {
            return Ok(known.clone());
        }
        if let Some(at) = self.open.iter().position(|open| open == name) {
            let way = self.open[at..].join("\" uses \"");
            return Err(format!("values use each other in a circle: \"{way}\" uses \"{name}\""));
        }
        let made = match self.names.find(name)? {
            Named::Value(text) => text.to_owned(),
            Named::Part(text, part, motion) => {
                self.open.push(name.to_owned());
                let made = motion.part_at(text, part, self);
                self.open.pop();
                made?
            }
        };
        if made.len() > LONGEST {
            return Err(format!("\"{name}\" becomes longer than {LONGEST} bytes"));
        }
        self.known.insert(name.to_owned(), made.clone());
        Ok(made)
    }
}

/// The values of a text that change in time, or come from elsewhere, in order.
#[derive(Debug, Default)]
pub struct Motion {
    values: Vec<MovingValue>,
}

#[derive(Debug)]
struct MovingValue {
    place: Range<usize>,
    what: What,
}

#[derive(Debug)]
enum What {
    Curve(Curve),
    /// An expression, and where its text stands.
    Expression(Box<Expression>, Range<usize>),
    Reference(String),
    /// The name of a file with a place for the frame's number.
    Sequence(String),
}

/// What is wrong with a value at a moment, and the byte of its text if that is known.
struct MotionFault {
    at: Option<usize>,
    message: String,
}

impl From<String> for MotionFault {
    fn from(message: String) -> MotionFault {
        MotionFault { at: None, message }
    }
}

/// A word that may stand for any value.
#[derive(Clone, Copy, Debug)]
pub struct Word {
    /// The word.
    pub name: &'static str,
    /// How it is written.
    pub form: &'static str,
    /// What it stands for.
    pub doc: &'static str,
}

/// The words that stand for such values.
pub const WORDS: [Word; 3] = [
    Word {
        name: "Curve",
        form: "Curve([(FRAME, VALUE), ..])",
        doc: "values at frames, and what lies between them",
    },
    Word {
        name: "Expr",
        form: "Expr(\"TEXT\")",
        doc: "an expression of frame, time and parameters",
    },
    Word {
        name: "Ref",
        form: "Ref(\"NAME\")",
        doc: "the value of a parameter, or of another node's field as NODE.FIELD",
    },
];

impl Motion {
    /// Finds the values of a text that move. In fields that name files, by `names_files`, names may have a place for
    /// the frame's number. Faults have their places in the text.
    pub fn find(text: &str, names_files: impl Fn(&str) -> bool) -> (Motion, Vec<Diagnostic>) {
        let (mut motion, mut faults) = (Motion::default(), Vec::new());
        let may_move = WORDS.iter().any(|word| text.contains(word.name));
        if !may_move && !text.contains("##") && !text.contains('%') {
            return (motion, faults);
        }
        let index = Index::new(text);
        let mut end = 0;
        for item in index.items().filter(|item| item.parent != 0) {
            let place = item.value.clone();
            let written = &text[place.clone()];
            let name = written.split(|c: char| !c.is_alphanumeric()).next().unwrap_or("");
            if place.start < end
                || item.bracket != Some(b'(')
                || WORDS.iter().all(|word| word.name != name)
            {
                continue;
            }
            end = place.end;
            match What::parse(name, text, &place) {
                Ok(what) => motion.values.push(MovingValue { place, what }),
                Err(fault) => faults.push(*fault),
            }
        }
        for (field, item) in index.fields() {
            let inside = |place: &Range<usize>| {
                item.value.start <= place.start && place.end <= item.value.end
            };
            if !names_files(field) {
                continue;
            }
            for (_, place) in index.texts().filter(|(_, place)| inside(place)) {
                let name: Option<String> = ron::from_str(&text[place.clone()]).ok();
                let is_free = !motion.values.iter().any(|value| value.place.contains(&place.start));
                let name = name.filter(|name| is_free && numbered(name, 0.0).is_some());
                motion
                    .values
                    .extend(name.map(|name| MovingValue { place, what: What::Sequence(name) }));
            }
        }
        motion.values.sort_by_key(|value| value.place.start);
        (motion, faults)
    }

    /// Whether nothing moves.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Whether something in a part of the text does.
    pub fn is_within(&self, part: &Range<usize>) -> bool {
        self.values.iter().any(|value| part.contains(&value.place.start))
    }

    /// What expressions and references in a part of the text name, as far as it is not the frame or the time.
    pub fn names(&self, part: &Range<usize>) -> Vec<&str> {
        let within = self.values.iter().filter(|value| part.contains(&value.place.start));
        within
            .flat_map(|value| match &value.what {
                What::Reference(name) => vec![&**name],
                What::Expression(expression, _) => expression.names(),
                What::Curve(_) | What::Sequence(_) => Vec::new(),
            })
            .filter(|name| !["frame", "time"].contains(name))
            .collect()
    }

    /// Whether anything in a part of the text depends on the frame by itself, and not by what it names.
    pub fn depends_on_frame(&self, part: &Range<usize>) -> bool {
        let mut within = self.values.iter().filter(|value| part.contains(&value.place.start));
        within.any(|value| match &value.what {
            What::Curve(_) | What::Sequence(_) => true,
            What::Reference(_) => false,
            What::Expression(expression, _) => {
                expression.names().iter().any(|name| ["frame", "time"].contains(name))
            }
        })
    }

    /// The text as it is at a moment.
    ///
    /// # Errors
    /// All values that cannot be made, with their places in the document.
    pub fn at(
        &self,
        text: &Woven,
        moment: Moment,
        names: &dyn Names,
    ) -> Result<Woven, Vec<Diagnostic>> {
        let mut names = Lookup { names, moment, open: Vec::new(), known: HashMap::new() };
        let mut made = text.clone();
        let mut faults = Vec::new();
        // From the last to the first, so that places stay.
        for value in self.values.iter().rev() {
            let origin = text.place(value.place.clone());
            match value.what.text(&mut names) {
                Ok(now) => made.replace(value.place.clone(), &[Patch::made(&now, origin)]),
                Err(MotionFault { at, message }) => {
                    let byte = at.and_then(|at| value.what.byte(text.text(), at));
                    let place = byte.map_or(origin, |at| text.place(at..at + 1));
                    faults.push(Diagnostic::error(place, message));
                }
            }
        }
        if faults.is_empty() { Ok(made) } else { Err(faults) }
    }

    /// A part of the text as it is at a moment.
    fn part_at(
        &self,
        text: &str,
        part: Range<usize>,
        names: &mut Lookup<'_>,
    ) -> Result<String, String> {
        let mut made = text[part.clone()].to_owned();
        for value in self.values.iter().rev().filter(|value| part.contains(&value.place.start)) {
            let now = value.what.text(names).map_err(|fault| fault.message)?;
            made.replace_range(value.place.start - part.start..value.place.end - part.start, &now);
        }
        Ok(made)
    }
}

impl What {
    fn parse(name: &str, text: &str, place: &Range<usize>) -> Result<What, Box<Diagnostic>> {
        if name == "Curve" {
            return Curve::parse(text, place.clone()).map(What::Curve);
        }
        let parts = parts(text, place);
        let only = match &parts[..] {
            [Part { key: None, value }] => Some(value.clone()),
            _ => None,
        };
        let said = only
            .and_then(|value| Some((ron::from_str::<String>(&text[value.clone()]).ok()?, value)));
        let Some((said, value)) = said else {
            let how = match name {
                "Ref" => "Ref(\"node.field\"), or Ref(\"parameter\")",
                _ => "Expr(\"2 + sin(time)\")",
            };
            let fault = Diagnostic::error(place.clone(), format!("this is no {name}"));
            return Err(Box::new(fault.help(format!("write {how}"))));
        };
        if name == "Ref" {
            return Ok(What::Reference(said));
        }
        match Expression::parse(&said) {
            Ok(expression) => Ok(What::Expression(Box::new(expression), value)),
            Err(fault) => {
                let at = offset_in_text(&text[value.clone()], fault.at).map(|at| value.start + at);
                let place = at.map_or(value, |at| at..at + 1);
                Err(Box::new(Diagnostic::error(place, fault.message)))
            }
        }
    }

    /// Where a byte of an expression stands in the text.
    fn byte(&self, text: &str, at: usize) -> Option<usize> {
        let What::Expression(_, place) = self else { return None };
        offset_in_text(&text[place.clone()], at).map(|at| place.start + at)
    }

    /// The text of its value at a moment.
    fn text(&self, names: &mut Lookup<'_>) -> Result<String, MotionFault> {
        let moment = names.moment;
        let (expression, name) = match self {
            What::Curve(curve) => return Ok(curve.at(moment.frame)),
            What::Reference(name) => return Ok(names.text(name)?),
            What::Sequence(name) => {
                let name = numbered(name, moment.frame).unwrap_or_default();
                return Ok(format!("{name:?}"));
            }
            What::Expression(expression, _) => (expression, "Expr"),
        };
        let parameters = names.names.parameters();
        let mut given = BTreeMap::new();
        given.insert("frame".to_owned(), vec![moment.frame]);
        given.insert("time".to_owned(), vec![moment.seconds()]);
        for known in expression.names() {
            let is_outside = known.contains('.') || parameters.contains(&known);
            if !is_outside || given.contains_key(known) {
                continue;
            }
            let text = names.text(known)?;
            let value = form::numbers(&text).ok_or_else(|| {
                format!("\"{known}\" is {text}, no number or vector: Ref(\"{known}\") copies it")
            })?;
            given.insert(known.to_owned(), value);
        }
        let value = expression
            .value(&given, &parameters)
            .map_err(|fault| MotionFault { at: Some(fault.at), message: fault.message })?;
        if let Some(number) = value.iter().find(|number| !number.is_finite()) {
            let frame = moment.frame;
            return Err(format!("this {name} is {number} at frame {frame}").into());
        }
        let written: Vec<String> = value.iter().map(|number| form::written(*number)).collect();
        Ok(if let [one] = &written[..] { one.clone() } else { format!("({})", written.join(", ")) })
    }
}

/// An item between brackets.
#[derive(Clone, Debug)]
struct Part {
    key: Option<Range<usize>>,
    value: Range<usize>,
}

/// The items of the outermost brackets of a part of a text.
fn parts(text: &str, place: &Range<usize>) -> Vec<Part> {
    let mut parts = Vec::new();
    let (mut key, mut value): (Option<Range<usize>>, Option<Range<usize>>) = (None, None);
    let mut depth = 0;
    let mut at = skip_blank(text, place.start);
    while at < place.end {
        let (kind, end) = token(text, at);
        let mark = if let Token::Mark(mark) = kind { mark } else { 0 };
        if depth > 0 {
            let ends = depth == 1 && matches!(mark, b',' | b')' | b']' | b'}');
            match (ends, value.take()) {
                (true, Some(value)) => parts.push(Part { key: key.take(), value }),
                (true, None) => {}
                (false, Some(name)) if depth == 1 && mark == b':' && key.is_none() => {
                    key = Some(name);
                }
                (false, whole) => {
                    let start = whole.map_or(at, |whole: Range<usize>| whole.start);
                    value = Some(start..end);
                }
            }
        }
        depth += i32::from(matches!(mark, b'(' | b'[' | b'{'));
        depth -= i32::from(matches!(mark, b')' | b']' | b'}'));
        if depth == 0 && mark != 0 {
            break;
        }
        at = skip_blank(text, end);
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Table(BTreeMap<&'static str, &'static str>);

    impl Names for Table {
        fn parameters(&self) -> Vec<&str> {
            self.0.keys().copied().filter(|name| !name.contains('.')).collect()
        }

        fn find(&self, name: &str) -> Result<Named<'_>, String> {
            self.0.get(name).map(|text| Named::Value(text)).ok_or(format!("there is no {name}"))
        }
    }

    fn at(text: &str, frame: f64) -> Result<String, Vec<Diagnostic>> {
        let (motion, faults) = Motion::find(text, |field| field == "path");
        if !faults.is_empty() {
            return Err(faults);
        }
        let table = [("haze", "0.25"), ("eye.position", "(1, 2, 3)"), ("look", "Sloped(8)")];
        let woven = Woven::new(text, 0..text.len());
        let names = Table(table.into_iter().collect());
        let made = motion.at(&woven, Moment::of_frame(frame), &names)?;
        Ok(made.text().to_owned())
    }

    #[test]
    fn values_take_the_place_of_what_moves() {
        let text = "Fog(a: Expr(\"haze * 2\"), b: [Curve([(1, 0), (3, 1)]), 7], c: Some(Expr(r#\"eye.position + [frame, 0, time]\"#)), d: Ref(\"look\"), path: \"o.####.png\", name: \"##\")";
        assert_eq!(
            at(text, 2.0).unwrap(),
            "Fog(a: 0.5, b: [0.5, 7], c: Some((3, 2, 3.0833333333333335)), d: Sloped(8), path: \"o.0002.png\", name: \"##\")"
        );
    }

    #[test]
    fn faults_stand_where_they_are() {
        let fault = |text: &str| {
            let faults = at(text, 1.0).unwrap_err();
            (faults[0].message.clone(), text[faults[0].span.clone()].to_owned())
        };
        let (message, place) = fault("K(a: Expr(\"1 + fram\"))");
        assert!(message.contains("did you mean \"frame\"?"), "{message}");
        assert_eq!(place, "f");
        let (message, _) = fault("K(a: Expr(\"haz + 1\"))");
        assert!(message.contains("did you mean \"haze\"?"), "{message}");
        let (message, place) = fault("K(a: Expr(\"1 +\"), b: 2)");
        assert!(message.contains("expected a value") && place == "\"", "{message} {place}");
        let (message, place) = fault("K(a: Expr(\"look * 2\"))");
        assert!(message.contains("Ref(\"look\") copies it"), "{message}");
        assert_eq!(place, "Expr(\"look * 2\")");
        let (message, _) = fault("K(a: Expr(\"1 / (frame - 1)\"))");
        assert!(message.contains("is inf at frame 1"), "{message}");
        let (message, _) = fault("K(a: Expr(\"P.x\"))");
        assert!(message.contains("there is no \"P\""), "{message}");
        assert!(fault("K(a: Ref(\"nobody\"))").0.contains("there is no nobody"));
        assert!(fault("K(a: Ref(3))").0.contains("this is no Ref"));
    }

    #[test]
    fn expressions_have_double_precision_and_every_function() {
        let value = |text: &str| at(&format!("K(a: Expr(\"{text}\"))"), 7.0).unwrap();
        assert_eq!(value("0.1 + 0.2"), format!("K(a: {:?})", 0.1 + 0.2));
        assert_eq!(value("100000.1 + 0"), "K(a: 100000.1)");
        assert_eq!(
            value("def twice(x) { x * 2 } y = twice(frame); if (y > 10) { y = 3; } y ^ 2"),
            "K(a: 9)"
        );
        assert_eq!(value("mix([0, 1, 2], 4, 0.5)"), "K(a: (2, 2.5, 3))");
        assert_eq!(value("frame % 2 == 1 ? 10 : 20"), "K(a: 10)");
        assert_eq!(value("max(round(2.5), clamp(9, 0, 1), dot([1, 2, 3], 1))"), "K(a: 6)");
        assert_eq!(value("smoothstep(0.5, 0, 1) + deg(PI)"), "K(a: 180.5)");
        let noise = value(
            "noise(time) + fbm([frame, 0, 0]) + voronoi(frame) + cellnoise(frame) + rgbtohsl([1, 0, 0]).z",
        );
        assert!(noise.starts_with("K(a: "), "{noise}");
    }
}
