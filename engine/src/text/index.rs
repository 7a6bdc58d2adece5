//! Where everything stands in a text of RON: fields, entries of maps, items of lists, as far as the text has their form.
//!
//! The RON library says at which place it gave up. This index says what stands there, however wrong the text is: what
//! is to blame, what can be left out to read the rest, and where a name was given before.

use std::collections::HashMap;
use std::ops::Range;

use super::token::{Token, can_be_held, is_number, skip_blank, token};

/// The places of a text.
#[derive(Debug)]
pub struct Index<'t> {
    text: &'t str,
    items: Vec<Item>,
    /// Numbers that no field can hold.
    numbers: Vec<Range<usize>>,
    /// Brackets that are open at the end, innermost last.
    open: Vec<usize>,
    /// The first bracket that closes another kind than is open: the open one, and it.
    crossed: Option<(Option<usize>, usize)>,
}

/// A field, an entry of a map or an item of a list. Numbers without a name are not items of their own.
#[derive(Clone, Debug)]
pub struct Item {
    /// The item that it lies in; the first, which is the whole text, in itself.
    pub parent: usize,
    /// All of it, with the comma after it.
    pub whole: Range<usize>,
    /// The name before the colon, quotes included.
    pub key: Option<Range<usize>>,
    /// What is said for it.
    pub value: Range<usize>,
    /// The bracket that its values stand in, if they do.
    pub bracket: Option<u8>,
}

/// A bracket that is open.
struct Open {
    /// The item whose value it is.
    owner: usize,
    bracket: u8,
    at: usize,
    current: Option<Current>,
}

/// An item that is being read.
struct Current {
    /// Its number, once it has one.
    item: Option<usize>,
    start: usize,
    key: Option<Range<usize>>,
    value: Option<Range<usize>>,
    /// Whether the last of it is a word, so that a bracket may follow.
    ends_in_word: bool,
    bracket: Option<u8>,
}

impl<'t> Index<'t> {
    /// Finds what stands where.
    pub fn new(text: &'t str) -> Index<'t> {
        let whole = 0..text.len();
        let all = Item { parent: 0, whole: whole.clone(), key: None, value: whole, bracket: None };
        let mut index =
            Index { text, items: vec![all], numbers: Vec::new(), open: Vec::new(), crossed: None };
        let mut stack = vec![Open { owner: 0, bracket: 0, at: 0, current: None }];
        let mut at = skip_blank(text, 0);
        while at < text.len() {
            let (token, end) = token(text, at);
            index.take(&mut stack, token, at..end);
            at = skip_blank(text, end);
        }
        while let Some(mut open) = stack.pop() {
            index.finish(&mut open, text.len());
            if open.bracket != 0 {
                index.open.insert(0, open.at);
                let owner = open.owner;
                index.items[owner].value.end = text.len();
                index.items[owner].whole.end = text.len();
            }
        }
        index
    }

    fn take(&mut self, stack: &mut Vec<Open>, token: Token, place: Range<usize>) {
        let Some(top) = stack.last_mut() else { return };
        match token {
            Token::Mark(bracket @ (b'(' | b'[' | b'{')) => {
                // `Name(`, but not `"text"(` or `(..)(`: there a comma is missing.
                let follows = top.current.as_ref().is_some_and(|current| current.ends_in_word);
                if top.current.as_ref().is_some_and(|c| c.value.is_some()) && !follows {
                    self.finish(top, place.start);
                }
                let owner = self.begin(top, &place, true);
                if let Some(current) = &mut top.current {
                    current.bracket = Some(bracket);
                    current.ends_in_word = false;
                }
                stack.push(Open { owner, bracket, at: place.start, current: None });
            }
            Token::Mark(closing @ (b')' | b']' | b'}')) => {
                let fits =
                    matches!((top.bracket, closing), (b'(', b')') | (b'[', b']') | (b'{', b'}'));
                if !fits && self.crossed.is_none() {
                    let open = (top.bracket != 0).then_some(top.at);
                    self.crossed = Some((open, place.start));
                }
                if top.bracket == 0 {
                    return;
                }
                self.finish(top, place.start);
                stack.pop();
                if let Some(Open { current: Some(current), .. }) = stack.last_mut()
                    && let Some(value) = &mut current.value
                {
                    value.end = place.end;
                }
            }
            Token::Mark(b',') => self.finish(top, place.end),
            Token::Mark(b':' | b'=') => {
                if let Some(current) = &mut top.current
                    && current.key.is_none()
                    && current.bracket.is_none()
                {
                    current.key = current.value.take();
                    current.ends_in_word = false;
                }
            }
            Token::Mark(_) => {
                self.begin(top, &place, false);
            }
            Token::Text | Token::Word => {
                let is_word = matches!(token, Token::Word);
                if top.current.as_ref().is_some_and(|current| current.value.is_some()) {
                    self.finish(top, place.start);
                }
                let word = &self.text[place.clone()];
                let is_number = is_word && is_number(word);
                if is_number && !can_be_held(word) {
                    self.numbers.push(place.clone());
                }
                self.begin(top, &place, !is_number);
                if let Some(current) = &mut top.current {
                    current.ends_in_word = is_word && !is_number;
                }
            }
        }
    }

    /// Adds what stands at a place to the item being read; returns the item's number, 0 if it has none.
    fn begin(&mut self, open: &mut Open, place: &Range<usize>, counts: bool) -> usize {
        let owner = open.owner;
        let current = open.current.get_or_insert(Current {
            item: None,
            start: place.start,
            key: None,
            value: None,
            ends_in_word: false,
            bracket: None,
        });
        match &mut current.value {
            Some(value) => value.end = place.end,
            None => current.value = Some(place.clone()),
        }
        if current.item.is_none() && (counts || current.key.is_some()) {
            current.item = Some(self.items.len());
            let whole = current.start..place.end;
            self.items.push(Item {
                parent: owner,
                whole,
                key: None,
                value: place.clone(),
                bracket: None,
            });
        }
        current.item.unwrap_or(owner)
    }

    /// Ends the item being read.
    fn finish(&mut self, open: &mut Open, end: usize) {
        let Some(Current { item, start, key, value, bracket, .. }) = open.current.take() else {
            return;
        };
        let value = value.unwrap_or_else(|| {
            let after = key.as_ref().map_or(start, |key| key.end);
            after..after
        });
        match item {
            Some(item) => {
                let item = &mut self.items[item];
                (item.whole.end, item.key, item.value, item.bracket) = (end, key, value, bracket);
            }
            None if key.is_some() => {
                let whole = start..end;
                self.items.push(Item { parent: open.owner, whole, key, value, bracket });
            }
            None => {}
        }
    }

    /// The text.
    pub fn text(&self) -> &'t str {
        self.text
    }

    /// All items, in the order of their beginnings; the first is the whole text.
    pub fn items(&self) -> impl Iterator<Item = &Item> + '_ {
        self.items.iter()
    }

    /// An item.
    pub fn item(&self, at: usize) -> &Item {
        &self.items[at]
    }

    /// The items in an item.
    pub fn children(&self, parent: usize) -> impl Iterator<Item = (usize, &Item)> + '_ {
        let later = self.items.iter().enumerate().skip(parent + 1);
        let end = self.items[parent].whole.end;
        let within = later.take_while(move |(_, item)| item.whole.start < end || parent == 0);
        within.filter(move |(_, item)| item.parent == parent)
    }

    /// The innermost item at a byte; where one ends and the next begins, the next.
    pub fn at(&self, byte: usize) -> usize {
        let is_there = |item: &&Item| item.whole.start <= byte && byte <= item.whole.end;
        self.items.iter().rposition(|item| is_there(&item)).unwrap_or(0)
    }

    /// The fields of the structure that the text is, such as `Kind(a: 1, b: (2, 3))`.
    pub fn fields(&self) -> impl Iterator<Item = (&'t str, &Item)> + '_ {
        let of = if self.items.len() > 1 { 1 } else { 0 };
        let fields = self.children(of).filter(move |_| of == 1);
        fields.filter_map(|(_, item)| Some((&self.text[item.key.clone()?], item)))
    }

    /// What is said for a field of the structure that the text is.
    pub fn field(&self, name: &str) -> Option<Range<usize>> {
        let found = self.fields().find(|(known, _)| *known == name);
        found.map(|(_, item)| item.value.clone())
    }

    /// The texts that are said for fields, those in lists and maps, and those of variants, such as `Instance("post")`,
    /// each with the name of its field, list, map or variant.
    pub fn texts(&self) -> impl Iterator<Item = (&'t str, Range<usize>)> + '_ {
        let is_text = |item: &&Item| {
            self.text[item.value.clone()].starts_with(['"', 'r']) && item.bracket.is_none()
        };
        self.items.iter().skip(1).filter(is_text).filter_map(|item| {
            let around = &self.items[item.parent];
            let of = match (around.bracket, item.key.clone()) {
                (Some(b'[' | b'{'), _) => around.key.clone()?,
                (_, Some(key)) => key,
                _ => {
                    let value = around.value.clone();
                    let end = self.text[value.clone()].find('(')?;
                    value.start..value.start + end
                }
            };
            Some((&self.text[of], item.value.clone()))
        })
    }

    /// The numbers that no field can hold: not finite, or larger than any single-precision number.
    pub fn numbers(&self) -> &[Range<usize>] {
        &self.numbers
    }

    /// The innermost bracket that is not closed at the end.
    pub fn unclosed(&self) -> Option<usize> {
        self.open.last().copied()
    }

    /// The first bracket that closes another kind than is open, and the open one.
    pub fn crossed(&self) -> Option<(Option<usize>, usize)> {
        self.crossed
    }

    /// Names that are given twice: entries of one map, and objects or plans of one list, each with the first.
    pub fn doubles(&self) -> Vec<(String, Range<usize>, Range<usize>)> {
        let mut first: HashMap<(usize, String), Range<usize>> = HashMap::new();
        let mut doubles = Vec::new();
        for item in &self.items[1..] {
            let Some(key) = item.key.clone() else { continue };
            let around = &self.items[item.parent];
            let of = match around.bracket {
                Some(b'{') => Some((item.parent, key)),
                // An object in a list of them.
                _ if &self.text[key.clone()] == "name" && self.is_listed(item.parent) => {
                    Some((around.parent, item.value.clone()))
                }
                _ => None,
            };
            let Some((of, place)) = of else { continue };
            let written = &self.text[place.clone()];
            let name = ron::from_str(written).unwrap_or_else(|_| written.to_owned());
            match first.get(&(of, name.clone())) {
                Some(known) => doubles.push((name, known.clone(), place)),
                None => {
                    first.insert((of, name), place);
                }
            }
        }
        doubles
    }

    /// Whether an item stands in a list of objects or plans.
    fn is_listed(&self, at: usize) -> bool {
        let list = &self.items[self.items[at].parent];
        let key = list.key.clone().map_or("", |key| &self.text[key]);
        list.bracket == Some(b'[') && matches!(key, "children" | "plans")
    }
}

#[cfg(test)]
mod tests {
    use super::super::token::offset_in_text;
    use super::*;

    #[test]
    fn fields_are_found() {
        let text = "K(a: 1, /* b: 9 /* */ */ b: (x: \"),\", y: [1, 2]), c: E(4) )";
        let index = Index::new(text);
        let at = |field: &str| index.field(field).map(|span| &text[span]);
        assert_eq!(at("a"), Some("1"));
        assert_eq!(at("b"), Some("(x: \"),\", y: [1, 2])"));
        assert_eq!(at("c"), Some("E(4)"));
        assert_eq!(at("x"), None);
    }

    #[test]
    fn texts_are_passed_whole_and_their_bytes_found() {
        let text = r###"K(a: r#"x("y)") // ,"#, b: "q\"\u{e9}(z", c: 3)"###;
        let index = Index::new(text);
        let at = |field: &str| index.field(field).map(|span| &text[span]);
        assert_eq!(at("a"), Some(r###"r#"x("y)") // ,"#"###));
        assert_eq!(at("b"), Some(r#""q\"\u{e9}(z""#));
        assert_eq!(at("c"), Some("3"));
        let raw = at("a").unwrap();
        assert_eq!(&raw[offset_in_text(raw, 4).unwrap()..][..2], ")\"");
        // q"é(z: the z is byte 5.
        let plain = at("b").unwrap();
        assert_eq!(&plain[offset_in_text(plain, 5).unwrap()..], "z\"");
        assert_eq!((offset_in_text(plain, 900), offset_in_text(raw, 900)), (None, None));
    }

    #[test]
    fn the_innermost_item_is_found_in_texts_with_faults() {
        let text = "S(a = (1, 2), b: [\"x\" \"y\"], c: 3 d: N(e: 4), f: )";
        let index = Index::new(text);
        let at = |part: &str| &text[index.item(index.at(text.find(part).unwrap())).whole.clone()];
        assert_eq!(at("="), "a = (1, 2),");
        assert_eq!(at("\"y\""), "\"y\"");
        assert_eq!(at("3 "), "c: 3 ");
        assert_eq!(at("d:"), "d: N(e: 4),");
        assert_eq!(at("4"), "e: 4");
        assert_eq!(at("f"), "f: ");
    }

    #[test]
    fn doubles_and_numbers_are_found_with_their_places() {
        let text = "S(m: {\"a\": 1, r\"a\": 2, \"b\": {\"a\": 3}}, children: [(name: \"n\"), (x: 1e39, name: \"n\")],
            children: [(name: \"n\", y: [1e38, -inf, 5])])";
        let index = Index::new(text);
        let doubles = index.doubles();
        let said: Vec<_> =
            doubles.iter().map(|(n, a, b)| (n.as_str(), &text[a.clone()], b.start)).collect();
        let second = text.rfind("\"n\"), (x").map(|_| text.find("1e39, name: ").unwrap() + 12);
        assert_eq!(
            said,
            [("a", "\"a\"", text.find("r\"a\"").unwrap()), ("n", "\"n\"", second.unwrap())]
        );
        let numbers: Vec<&str> = index.numbers().iter().map(|at| &text[at.clone()]).collect();
        assert_eq!(numbers, ["1e39", "-inf"]);
    }

    #[test]
    fn brackets_that_do_not_fit_are_found() {
        let index = Index::new("S(a: [1, 2), b: (3");
        assert_eq!(index.crossed(), Some((Some(5), 10)));
        assert_eq!(Index::new("S(a: (3").unclosed(), Some(5));
        assert_eq!(Index::new("S(a: (3)) )").crossed(), Some((None, 10)));
    }
}
