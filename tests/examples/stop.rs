//! How soon an evaluation ends that is to stop: the graphs of the gallery are stopped again and again, each time later.
//!
//! `cargo run --release -p spandrel-tests --example stop -- graphs/town.ron graphs/room.ron`

use spandrel_engine::graph::demand::Wishes;
use spandrel_engine::graph::document::Document;
use spandrel_engine::graph::{Graph, Run, Schedule};
use spandrel_engine::values::{Delivery, Override};
use std::path::Path;
use std::time::{Duration, Instant};

/// Between one stop and the next.
const STEP: Duration = Duration::from_millis(170);
/// Stops of one graph, at most.
const STOPS: u32 = 40;

fn main() {
    println!("graph: stops, mean and longest time to the end, and what then was being evaluated");
    for path in std::env::args().skip(1) {
        let path = Path::new(&path);
        let text = std::fs::read_to_string(path).expect("a graph");
        let document = Document::parse(&text).expect("a graph");
        let graph = Graph::check(&document, &spandrel::library(), path.parent().expect("a folder"));
        let graph = graph.unwrap_or_else(|faults| panic!("{faults:?}"));
        let mut wishes = Wishes::new();
        let changed = Override { size: Some((960, 540)), ..Override::default() };
        for node in graph.nodes().filter(|node| node.kind == "Write") {
            wishes.want::<Delivery>(node.id, changed.clone());
        }
        let plan = Schedule::new(&graph, &wishes).expect("a plan");
        let mut times = Vec::new();
        for stop in 1..=STOPS {
            let run = Run::new();
            let (failure, waited) = std::thread::scope(|scope| {
                let evaluation = scope.spawn(|| {
                    let done = run.evaluate(&graph, &plan, &());
                    (done.err(), Instant::now())
                });
                std::thread::sleep(STEP * stop);
                let asked = Instant::now();
                run.cancel();
                let (failure, ended) = evaluation.join().expect("it does not break");
                (failure, ended.saturating_duration_since(asked))
            });
            let Some(failure) = failure else { break };
            times.push((waited.as_secs_f64(), failure.node));
        }
        let mean = times.iter().map(|(time, _)| time).sum::<f64>() / times.len().max(1) as f64;
        let longest = times.iter().max_by(|a, b| a.0.total_cmp(&b.0));
        let (most, node) = longest.map_or((0.0, ""), |(time, node)| (*time, node.as_str()));
        let (mean, most) = (mean * 1e3, most * 1e3);
        println!("{}: {}, {mean:.0} ms, {most:.0} ms in \"{node}\"", path.display(), times.len());
    }
}
