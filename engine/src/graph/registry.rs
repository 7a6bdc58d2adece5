//! The registry: all kinds of node that a graph may use.

use serde_json::Value as Json;
use std::collections::BTreeMap;
use std::sync::Arc;

use super::catalogue::{self, Field};
use super::link::{FILE, LINK};
use super::node::{AnyNode, Node};
use super::value::{AnyValue, Value};
use crate::text::options;

/// All kinds of node, by name.
///
/// A program registers the kinds that it wants, one call each; there is no registration by magic.
#[derive(Clone, Default)]
pub struct Registry {
    kinds: BTreeMap<String, Arc<Kind>>,
}

/// A kind of node: what its declaration says.
pub struct Kind {
    /// The name in graphs.
    pub name: String,
    /// The group of the catalogue.
    pub group: String,
    /// Other names under which people look for it.
    pub aliases: Vec<String>,
    /// The name of the type that it makes.
    pub output: &'static str,
    /// What it does.
    pub doc: String,
    /// Its fields, in order.
    pub fields: Vec<Field>,
    pub(super) schema: Json,
    pub(super) parse: Parse,
    /// How its values become bytes and come back, if they are stored.
    pub(super) packing: Option<Packing>,
}

/// How values become bytes and come back.
#[derive(Clone, Copy)]
pub(super) struct Packing {
    pub(super) pack: fn(&AnyValue) -> Option<Vec<u8>>,
    pub(super) unpack: fn(&[u8]) -> Option<AnyValue>,
}

fn packing<T: Value>() -> Packing {
    Packing {
        pack: |value| value.get::<T>().packed(),
        unpack: |bytes| T::unpacked(bytes).map(AnyValue::new),
    }
}

/// Parses a node's text.
type Parse =
    Box<dyn Fn(&str) -> Result<Box<dyn AnyNode>, Box<ron::error::SpannedError>> + Send + Sync>;

impl Registry {
    /// A registry without kinds.
    pub fn new() -> Registry {
        Registry::default()
    }

    /// Adds a kind of node.
    ///
    /// # Panics
    /// If there is a kind of that name already.
    pub fn register<N: Node>(&mut self) -> &mut Registry {
        let schema = schema_of::<N>();
        let default = ron::Options::default().to_string(&N::default()).unwrap_or_default();
        let kind = Kind {
            name: N::KIND.to_owned(),
            group: N::GROUP.to_owned(),
            aliases: N::ALIASES.iter().map(|alias| (*alias).to_owned()).collect(),
            output: N::Output::NAME,
            doc: catalogue::doc(&schema),
            fields: catalogue::fields(&schema, &default),
            schema,
            parse: Box::new(|text| {
                let node: N = options().from_str(text).map_err(Box::new)?;
                Ok(Box::new(node))
            }),
            packing: N::STORED.then(packing::<N::Output>),
        };
        self.add(kind)
    }

    fn add(&mut self, kind: Kind) -> &mut Registry {
        let name = kind.name.clone();
        assert!(!self.kinds.contains_key(&name), "two kinds of node are called {name}");
        self.kinds.insert(name, Arc::new(kind));
        self
    }

    /// A kind by its name.
    pub fn kind(&self, name: &str) -> Option<&Arc<Kind>> {
        self.kinds.get(name)
    }

    /// The kind that is known by another name.
    pub fn by_alias(&self, name: &str) -> Option<&Arc<Kind>> {
        let is = |alias: &String| alias.eq_ignore_ascii_case(name);
        self.kinds.values().find(|kind| kind.aliases.iter().any(is))
    }

    /// All kinds, by name.
    pub fn kinds(&self) -> impl Iterator<Item = &Kind> {
        self.kinds.values().map(|kind| &**kind)
    }
}

impl Kind {
    /// The JSON schema of its fields, with their documentation. `x-link` marks links with the type that they lead to,
    /// `x-reader` says which kind of node reads such a type from a file, and `x-named` that the link's name is shown;
    /// `x-file` marks files that are read or written; `x-draft` is the fastest value of a field that trades speed for accuracy, as text; `x-parts` names the values in parentheses, and `x-what` what a
    /// text holds.
    pub fn schema(&self) -> &Json {
        &self.schema
    }

    /// Whether a field is, or has in it, the name of a file, or a link, which may be one.
    pub(super) fn names_files(&self, field: &str) -> bool {
        fn has(schema: &Json) -> bool {
            match schema {
                Json::Object(map) => {
                    map.contains_key(LINK) || map.contains_key(FILE) || map.values().any(has)
                }
                Json::Array(list) => list.iter().any(has),
                _ => false,
            }
        }
        let fields = self.schema.get("properties");
        fields.and_then(|fields| fields.get(field)).is_some_and(has)
    }

    /// A field's value as the text of a graph has it, where people leave the quotes away that their shell takes: texts,
    /// files, nodes and colours.
    pub fn written(&self, field: &str, value: &str) -> String {
        let schema = self.schema.get("properties").and_then(|fields| fields.get(field));
        let is_text = |schema: &Json| {
            let is_string = |kind: &Json| kind.as_str() == Some("string");
            let kind = schema.get("type");
            let may_be =
                kind.and_then(Json::as_array).is_some_and(|kinds| kinds.iter().any(is_string));
            (may_be || kind.is_some_and(is_string)) && schema.get("enum").is_none()
        };
        // One of several forms may be a link.
        let forms = schema.and_then(|schema| schema.get("anyOf")).and_then(Json::as_array);
        let may_be_link = forms.is_some_and(|forms| forms.iter().any(|f| f.get(LINK).is_some()));
        let is_quoted = value.starts_with(['"', '[', '('])
            || value.starts_with("r\"")
            || value.starts_with("r#")
            || ["Curve(", "Expr(", "Ref("].iter().any(|moving| value.starts_with(moving));
        let wants_quotes = value.starts_with('#') || may_be_link || schema.is_some_and(is_text);
        if wants_quotes && !is_quoted && !matches!(value, "None" | "Some") {
            return format!("{value:?}");
        }
        value.to_owned()
    }
}

fn schema_of<N: Node>() -> Json {
    let settings =
        schemars::generate::SchemaSettings::default().with(|s| s.inline_subschemas = true);
    let schema = settings.into_generator().into_root_schema_for::<N>();
    schema.to_value()
}
