//! Graphs that are evaluated within a test, with what they say.

use spandrel_engine::graph::demand::Wishes;
use spandrel_engine::graph::document::Document;
use spandrel_engine::graph::report::Progress;
use spandrel_engine::graph::{Graph, Run, Schedule};
use spandrel_engine::image::{Channel, Image, Window};
use spandrel_engine::values::{Override, PictureDemand};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::{Arc, Mutex};

/// A graph of nodes that may be evaluated again and again, keeping what it knows.
pub struct Nodes {
    graph: Graph,
    run: Run,
}

impl std::fmt::Debug for Nodes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.graph.nodes().map(|node| node.id)).finish()
    }
}

/// What nodes said: warnings and notes.
#[derive(Debug, Default)]
struct Said(Mutex<[Vec<String>; 2]>);

impl Progress for Said {
    fn warned(&self, _: &str, message: &str) {
        self.0.lock().expect("nobody breaks with it")[0].push(message.to_owned());
    }

    fn noted(&self, _: &str, message: &str) {
        self.0.lock().expect("nobody breaks with it")[1].push(message.to_owned());
    }
}

/// A picture, and what was said while it was made.
#[derive(Debug)]
pub struct Made {
    /// The picture.
    pub image: Arc<Image>,
    /// The warnings.
    pub warnings: Vec<String>,
    /// The notes.
    pub notes: Vec<String>,
}

impl Nodes {
    /// Nodes as a graph lists them, whose files are found from a folder.
    ///
    /// # Panics
    /// If they are no sound graph.
    pub fn new(folder: &Path, nodes: &str) -> Nodes {
        let text = format!("Graph(version: 1, nodes: {{{nodes}}})");
        let document = Document::parse(&text).unwrap_or_else(|faults| panic!("{faults:?}"));
        let graph = Graph::check(&document, &spandrel::library(), folder);
        let graph = graph.unwrap_or_else(|faults| panic!("{text}: {faults:?}"));
        Nodes { graph, run: Run::new() }
    }

    /// The picture of a node, or a part of it.
    ///
    /// # Errors
    /// What went wrong, in words.
    pub fn picture(&self, node: &str, window: Option<Window>) -> Result<Made, String> {
        let mut wishes = Wishes::new();
        let changed = Override { window, ..Override::default() };
        let channels = BTreeSet::from([Channel::Color]);
        wishes.want::<Image>(node, PictureDemand { channels, changed });
        let plan = Schedule::new(&self.graph, &wishes).map_err(|error| error.to_string())?;
        let said = Said::default();
        let done = self.run.evaluate(&self.graph, &plan, &said).map_err(|e| e.to_string())?;
        let [warnings, notes] = said.0.into_inner().expect("nobody breaks with it");
        Ok(Made { image: done.value::<Image>(0), warnings, notes })
    }
}
