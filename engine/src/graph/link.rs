//! Links and files: the fields of nodes that the graph knows of.

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use super::value::Value;

/// A link to the node that makes a `T`: in graphs, the node's name, or the path of a file that
/// [can be read](Value::READER) as such a value.
pub struct Link<T> {
    target: String,
    slot: Slot,
    of: PhantomData<fn() -> T>,
}

/// Which of all links one is: a node finds by it what it asked for. A copy of a link is the same link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Slot(u64);

impl Slot {
    fn new() -> Slot {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Slot(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

impl<T> Link<T> {
    /// A link to a node, or a file.
    pub fn to(target: impl Into<String>) -> Link<T> {
        Link { target: target.into(), slot: Slot::new(), of: PhantomData }
    }

    /// The name of the node, or the path of the file; empty if the link is not given. What a node makes must not
    /// depend on it: see [`NamedLink`].
    pub(crate) fn target(&self) -> &str {
        &self.target
    }

    pub(super) fn slot(&self) -> Slot {
        self.slot
    }
}

/// A link whose name is part of what is made of it: lights give it to their layers. Nodes with other links are the
/// same under whatever names they find their inputs.
pub struct NamedLink<T>(Link<T>);

impl<T> NamedLink<T> {
    /// The name of the node, or the path of the file; empty if the link is not given.
    pub fn name(&self) -> &str {
        self.0.target()
    }
}

impl<T> From<Link<T>> for NamedLink<T> {
    fn from(link: Link<T>) -> NamedLink<T> {
        NamedLink(link)
    }
}

impl<T> std::ops::Deref for NamedLink<T> {
    type Target = Link<T>;

    fn deref(&self) -> &Link<T> {
        &self.0
    }
}

impl<T> Serialize for NamedLink<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl<'de, T> Deserialize<'de> for NamedLink<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<NamedLink<T>, D::Error> {
        Link::deserialize(deserializer).map(NamedLink)
    }
}

impl<T> Default for Link<T> {
    fn default() -> Link<T> {
        Link::to("")
    }
}

impl<T> Clone for Link<T> {
    fn clone(&self) -> Link<T> {
        Link { target: self.target.clone(), slot: self.slot, of: PhantomData }
    }
}

impl<T> std::fmt::Debug for Link<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.target)
    }
}

impl<T> PartialEq for Link<T> {
    fn eq(&self, other: &Link<T>) -> bool {
        self.target == other.target
    }
}

impl<T> Serialize for Link<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.target.serialize(serializer)
    }
}

impl<'de, T> Deserialize<'de> for Link<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Link<T>, D::Error> {
        String::deserialize(deserializer).map(Link::to)
    }
}

/// The schema's mark of a link: the name of the type that it leads to.
pub(super) const LINK: &str = "x-link";
/// The schema's mark of a link that may be a file: the kind of node that reads it.
pub(super) const READER: &str = "x-reader";
/// The schema's mark of a file: `"read"` or `"write"`.
pub(super) const FILE: &str = "x-file";
/// The schema's mark of a link whose name matters.
pub(super) const NAMED: &str = "x-named";

impl<T: Value> JsonSchema for Link<T> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("Link of {}", T::NAME).into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", LINK: T::NAME, READER: T::READER })
    }
}

impl<T: Value> JsonSchema for NamedLink<T> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        Link::<T>::schema_name()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let mut schema = Link::<T>::json_schema(generator);
        schema.insert(NAMED.to_owned(), true.into());
        schema
    }
}

/// A file that a node reads; relative to the graph's file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct InFile(pub String);

/// A file that a node writes; relative to the graph's file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct OutFile(pub String);

impl InFile {
    /// The file's path, from the folder of the graph.
    pub fn under(&self, directory: &Path) -> PathBuf {
        directory.join(&self.0)
    }
}

impl OutFile {
    /// The file's path, from the folder of the graph.
    pub fn under(&self, directory: &Path) -> PathBuf {
        directory.join(&self.0)
    }
}

impl JsonSchema for InFile {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "file".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", FILE: "read" })
    }
}

impl JsonSchema for OutFile {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "file to write".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", FILE: "write" })
    }
}

/// Whether a link's target is a file and not a node: it has a dot or a slash.
pub(super) fn is_file(target: &str) -> bool {
    Path::new(target).extension().is_some() || target.contains(['/', '\\'])
}
