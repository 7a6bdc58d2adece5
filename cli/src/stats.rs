//! `--stats` and `--explain`: what an evaluation did.

use serde_json::{Value as Json, json};
use spandrel_engine::graph::demand::Asked;
use spandrel_engine::graph::report::Outcome;
use spandrel_engine::graph::{Graph, NodeReport, Schedule};
use spandrel_engine::output;
use std::fmt::Write;
use std::path::PathBuf;

use crate::print::{self, Said};

/// What a render did, as far as it came.
#[derive(Default)]
pub(crate) struct Done {
    /// What was written.
    pub(crate) outputs: Vec<Written>,
    /// What was there, and was left alone.
    pub(crate) skipped: Vec<Written>,
    /// Nodes that have ended.
    pub(crate) reports: Vec<NodeReport>,
    /// Time of the evaluation.
    pub(crate) seconds: f64,
}

/// A file of a node.
pub(crate) struct Written {
    pub(crate) node: String,
    pub(crate) frame: i64,
    pub(crate) file: PathBuf,
    pub(crate) bytes: Option<u64>,
}

impl Written {
    pub(crate) fn json(&self) -> Json {
        let file = output::tidy(&self.file).display().to_string();
        json!({ "node": self.node, "frame": self.frame, "file": file, "bytes": self.bytes })
    }
}

fn outcome(report: &NodeReport) -> &'static str {
    match report.outcome {
        Outcome::Evaluated => "evaluated",
        Outcome::Known => "known",
        Outcome::Stored => "stored",
        Outcome::Passed => "passed on",
    }
}

/// A table of time, spans and bytes, node by node.
pub(crate) fn table(reports: &[NodeReport], seconds: f64) -> String {
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
            let size =
                if report.bytes > 0 { print::bytes(report.bytes as u64) } else { String::new() };
            let at = report.frame.map_or(String::new(), |frame| format!(" @ {frame}"));
            [report.node.clone() + &at, report.kind.to_owned(), time, size, facts.join(", ")]
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

/// All that is known of a render, for programs.
pub(crate) fn json(done: &Done, said: &Said) -> String {
    let nodes: Vec<_> = done
        .reports
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
                "frame": report.frame,
                "outcome": outcome(report),
                "key": report.key,
                "seconds": report.seconds,
                "bytes": report.bytes,
                "facts": facts,
                "demand": report.demand,
            })
        })
        .collect();
    let files = |files: &[Written]| files.iter().map(Written::json).collect::<Vec<_>>();
    let all = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "outputs": files(&done.outputs),
        "skipped": files(&done.skipped),
        "errors": said.errors,
        "warnings": said.warnings,
        "notes": said.notes,
        "seconds": done.seconds,
        "peak_bytes": peak_memory(),
        "nodes": nodes,
    });
    format!("{all:#}\n")
}

/// The most memory that this process has held, where the system says so.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}

/// Who asks what of every node of the graph, and, where it was evaluated, what became of it.
pub(crate) fn explanation(graph: &Graph, plan: &Schedule, reports: &[NodeReport]) -> String {
    let mut out = String::new();
    let asks = plan.asks(graph);
    for node in graph.nodes() {
        let mut asked = asks.iter().filter(|asked| asked.node == node.id).peekable();
        if asked.peek().is_none() {
            let _ = writeln!(out, "{} ({}): not needed", node.id, node.kind);
        }
        for Asked { demand, by, frame, .. } in asked {
            let done = |report: &&NodeReport| {
                report.node == node.id && report.demand == *demand && report.frame == *frame
            };
            let done = reports.iter().find(done).map_or("wanted", outcome);
            let by = if by.is_empty() { "you".to_owned() } else { by.join(", ") };
            let mut words = Vec::new();
            flatten("", demand, &mut words);
            let what =
                if words.is_empty() { String::new() } else { format!(": {}", words.join(" ")) };
            let at = frame.map_or(String::new(), |frame| format!(" at frame {frame}"));
            let _ = writeln!(out, "{} ({}), {done} for {by}{at}{what}", node.id, node.kind);
        }
    }
    out
}

/// The leaves of a demand that say something, as `place=value`.
fn flatten(place: &str, value: &Json, words: &mut Vec<String>) {
    let below = |name: &str| match place {
        "" => name.to_owned(),
        place => format!("{place}.{name}"),
    };
    match value {
        Json::Null | Json::Bool(false) => {}
        Json::Object(fields) => {
            fields.iter().for_each(|(name, value)| flatten(&below(name), value, words));
        }
        Json::String(text) => words.push(format!("{place}={text}")),
        other => words.push(format!("{place}={other}")),
    }
}
