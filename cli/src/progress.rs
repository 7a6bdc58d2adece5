//! Progress: a bar on a terminal, lines in a log, nothing when quiet.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use spandrel_engine::graph::Report;
use spandrel_engine::graph::evaluate::{Outcome, Progress};
use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};

use crate::print;

/// How much is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Detail {
    /// Nothing.
    Quiet,
    /// A bar on a terminal.
    Bar,
    /// A line for every node.
    Lines,
}

impl Detail {
    pub(crate) fn new(quiet: bool, verbose: bool) -> Detail {
        match (quiet, verbose || !std::io::stderr().is_terminal()) {
            (true, _) => Detail::Quiet,
            (_, true) => Detail::Lines,
            _ => Detail::Bar,
        }
    }
}

/// Shows how an evaluation goes on.
pub(crate) struct Shown {
    detail: Detail,
    bar: ProgressBar,
    /// The nodes that are being evaluated.
    busy: Mutex<Vec<String>>,
    /// What has ended.
    reports: Mutex<Vec<Report>>,
}

impl Shown {
    /// For an evaluation of `nodes` nodes.
    pub(crate) fn new(detail: Detail, nodes: usize) -> Shown {
        let target = match detail {
            Detail::Bar => ProgressDrawTarget::stderr(),
            _ => ProgressDrawTarget::hidden(),
        };
        let bar = ProgressBar::with_draw_target(Some(nodes as u64), target);
        let style = ProgressStyle::with_template("{bar:24} {pos}/{len} {elapsed} {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        if detail == Detail::Bar {
            bar.enable_steady_tick(std::time::Duration::from_millis(100));
        }
        Shown { detail, bar, busy: Mutex::default(), reports: Mutex::default() }
    }

    /// Takes the bar away.
    pub(crate) fn clear(&self) {
        self.bar.finish_and_clear();
    }

    /// What has ended, also if something failed.
    pub(crate) fn reports(&self) -> Vec<Report> {
        self.reports.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn with_busy(&self, change: impl FnOnce(&mut Vec<String>)) {
        let mut busy = self.busy.lock().unwrap_or_else(PoisonError::into_inner);
        change(&mut busy);
        self.bar.set_message(busy.join(", "));
    }
}

impl Progress for Shown {
    fn started(&self, node: &str) {
        self.with_busy(|busy| busy.push(node.to_owned()));
    }

    fn noted(&self, node: &str, message: &str) {
        self.bar.suspend(|| print::note(format!("node \"{node}\": {message}")));
    }

    fn warned(&self, node: &str, message: &str) {
        self.bar.suspend(|| print::warning(format!("node \"{node}\": {message}")));
    }

    fn finished(&self, report: &Report) {
        self.with_busy(|busy| busy.retain(|node| *node != report.node));
        self.bar.inc(1);
        self.reports.lock().unwrap_or_else(PoisonError::into_inner).push(report.clone());
        if self.detail == Detail::Lines && report.outcome == Outcome::Evaluated {
            let facts: Vec<String> = report
                .facts
                .iter()
                .map(|(name, value)| format!("{} {name}", print::grouped(*value)))
                .collect();
            let time = print::seconds(report.seconds);
            print::err(&format!("{}: {} {time} {}", report.node, report.kind, facts.join(", ")));
        }
    }
}
