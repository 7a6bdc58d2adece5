//! The papers' figures at their own size: which graph shows each, and what the papers say of it.

use spandrel_engine::graph::demand::Wishes;
use spandrel_engine::graph::document::Document;
use spandrel_engine::graph::report::Evaluated;
use spandrel_engine::graph::{Graph, Run, Schedule};
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::values::{Override, PictureDemand};
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Instant;

/// A figure of a paper.
pub struct Figure {
    /// The paper and the figure.
    pub name: &'static str,
    /// Its graph, in `graphs/papers`, and the node that is the picture.
    pub graph: &'static str,
    /// The node of its picture, and that of what is resolved for it.
    pub nodes: [&'static str; 2],
    /// How many faces it has, if that is said.
    pub faces: Option<u32>,
    /// its size in pixels.
    pub size: (u32, u32),
    /// How it is integrated.
    pub lines: &'static str,
    /// How long it took, in seconds.
    pub seconds: f64,
}

/// All figures of which times are given.
pub const FIGURES: [Figure; 7] = [
    // Generating the tree, and traversing and displaying it.
    Figure {
        name: "[D] fig. 12, a landscape by list priority",
        graph: "landscape.ron",
        nodes: ["fig_12", "fig_12"],
        faces: Some(1135),
        size: (800, 800),
        lines: "Sampled(1, Box)",
        seconds: 0.29 + 0.05,
    },
    Figure {
        name: "[D] fig. 13, a room with a carpet",
        graph: "lounge.ron",
        nodes: ["fig_13", "fig_13"],
        faces: Some(1641),
        size: (800, 800),
        lines: "Sampled(2, Box)",
        seconds: 262.2,
    },
    Figure {
        name: "[D] fig. 14, the same with polished tiles, by rays",
        graph: "lounge.ron",
        nodes: ["fig_14", "fig_14"],
        faces: Some(1641),
        size: (800, 800),
        lines: "Sampled(2, Box)",
        seconds: 2189.22,
    },
    Figure {
        name: "[D] fig. 15, a photograph over what was computed",
        graph: "branch.ron",
        nodes: ["fig_15", "computed"],
        faces: None,
        size: (800, 800),
        lines: "Sampled(2, Box)",
        seconds: 28.51,
    },
    Figure {
        name: "[D] fig. 16, transoms by attribute mapping",
        graph: "zashiki.ron",
        nodes: ["fig_16", "fig_16"],
        faces: Some(10_981),
        size: (800, 800),
        lines: "Sampled(1, Box)",
        seconds: 308.71,
    },
    Figure {
        name: "[D] fig. 17, the electron density of ethanol",
        graph: "ethanol.ron",
        nodes: ["fig_17", "fig_17"],
        faces: Some(7174),
        size: (512, 512),
        lines: "Sampled(1, Box)",
        seconds: 139.61,
    },
    // Four clusters at 2.8 minutes each, and 26.8 minutes for the final composite with ray tracing.
    Figure {
        name: "[N] fig. 7 (c), a district in four clusters, with rays",
        graph: "district.ron",
        nodes: ["fig_7c", "fig_7c"],
        faces: Some(870),
        size: (640, 480),
        lines: "Sampled(3, Trapezoid)",
        seconds: 4.0 * 168.0 + 1608.0,
    },
];

impl Figure {
    /// The text of its graph.
    pub fn text(&self) -> String {
        std::fs::read_to_string(self.folder().join(self.graph)).expect("the graph")
    }

    fn folder(&self) -> std::path::PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../graphs/papers")
    }

    /// Computes it, at its own size or a smaller one: what happened, its picture, and the seconds that all took, from the
    /// files on.
    pub fn compute(&self, size: Option<(u32, u32)>) -> (Evaluated, f64) {
        let clock = Instant::now();
        let document = Document::parse(&self.text()).expect("a graph");
        let graph = match Graph::check(&document, &spandrel::library(), &self.folder()) {
            Ok(graph) => graph,
            Err(faults) => panic!("{}: {faults:?}", self.graph),
        };
        let mut wishes = Wishes::new();
        let changed = Override { size, ..Override::default() };
        let channels = BTreeSet::from([Channel::Color]);
        wishes.want::<Image>(self.nodes[0], PictureDemand { channels, changed });
        let plan = Schedule::new(&graph, &wishes).expect("a plan");
        let evaluated = Run::new().evaluate(&graph, &plan, &()).expect("a picture");
        (evaluated, clock.elapsed().as_secs_f64())
    }
}

/// The faces of all scenes and cards that were computed.
pub fn faces(evaluated: &Evaluated) -> u64 {
    let scenes = evaluated
        .reports
        .iter()
        .filter(|report| ["ReadScene", "Isosurface", "Billboards"].contains(&report.kind.as_str()));
    scenes
        .flat_map(|report| &report.facts)
        .filter(|(what, _)| *what == "faces")
        .map(|(_, n)| n)
        .sum()
}
