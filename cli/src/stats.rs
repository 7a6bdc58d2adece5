//! `--stats` and `--explain`: what an evaluation did.

use serde_json::json;
use spandrel_engine::graph::evaluate::Outcome;
use spandrel_engine::graph::{Graph, Report};
use std::fmt::Write;

use crate::print;

fn outcome(report: &Report) -> &'static str {
    match report.outcome {
        Outcome::Evaluated => "evaluated",
        Outcome::Known => "known",
        Outcome::Passed => "passed on",
    }
}

/// A table of time, spans and bytes, node by node.
pub(crate) fn table(reports: &[Report], seconds: f64) -> String {
    let rows: Vec<[String; 5]> = reports
        .iter()
        .map(|report| {
            let facts: Vec<String> = report
                .facts
                .iter()
                .map(|(name, value)| format!("{} {name}", print::grouped(*value)))
                .collect();
            let time = match report.outcome {
                Outcome::Evaluated => print::seconds(report.seconds),
                _ => outcome(report).to_owned(),
            };
            let size = if report.bytes > 0 { print::bytes(report.bytes) } else { String::new() };
            [report.node.clone(), report.kind.to_owned(), time, size, facts.join(", ")]
        })
        .collect();
    let head = ["node", "kind", "time", "memory", "holds"].map(str::to_owned);
    let width = |i: usize| {
        let cells = rows.iter().chain([&head]).map(|row| row[i].chars().count());
        cells.max().unwrap_or(0)
    };
    let widths: [usize; 5] = std::array::from_fn(width);
    let mut out = String::new();
    for row in std::iter::once(&head).chain(&rows) {
        let [node, kind, time, size, facts] = row;
        let [a, b, c, d, _] = widths;
        let _ = writeln!(out, "{node:a$}  {kind:b$}  {time:>c$}  {size:>d$}  {facts}");
    }
    let _ = writeln!(out, "in all {}", print::seconds(seconds));
    out
}

/// The same for programs.
pub(crate) fn json(reports: &[Report], seconds: f64) -> String {
    let nodes: Vec<_> = reports
        .iter()
        .map(|report| {
            let facts: serde_json::Map<String, serde_json::Value> = report
                .facts
                .iter()
                .map(|(name, value)| ((*name).to_owned(), json!(value)))
                .collect();
            json!({
                "node": report.node,
                "kind": report.kind,
                "outcome": outcome(report),
                "seconds": report.seconds,
                "bytes": report.bytes,
                "facts": facts,
                "demand": report.demand,
            })
        })
        .collect();
    format!("{:#}\n", json!({ "seconds": seconds, "nodes": nodes }))
}

/// What was asked of every node of the graph, and what became of it.
pub(crate) fn explanation(graph: &Graph, reports: &[Report]) -> String {
    let mut out = String::new();
    for node in graph.nodes() {
        let mut asked = reports.iter().filter(|report| report.node == node.id).peekable();
        if asked.peek().is_none() {
            let _ = writeln!(out, "{} ({}): not needed", node.id, node.kind);
        }
        for report in asked {
            let what = match &report.demand {
                serde_json::Value::Null => "for its value".to_owned(),
                demand => format!("for {demand}"),
            };
            let _ = writeln!(out, "{} ({}): {} {what}", node.id, node.kind, outcome(report));
        }
    }
    out
}
