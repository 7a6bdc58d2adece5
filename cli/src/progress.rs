//! Progress: a bar on a terminal, lines in a log, nothing when quiet.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use spandrel_engine::graph::NodeReport;
use spandrel_engine::graph::report::{Outcome, Progress};
use spandrel_engine::watch::Watch;
use std::collections::HashSet;
use std::io::IsTerminal;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

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

type Busy = Arc<Mutex<Vec<(String, Watch)>>>;

fn lock(busy: &Busy) -> MutexGuard<'_, Vec<(String, Watch)>> {
    busy.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Writes the nodes that are being evaluated, and how far they are.
fn write_busy(busy: &Busy, out: &mut dyn std::fmt::Write) -> std::fmt::Result {
    for (i, (node, watch)) in lock(busy).iter().enumerate() {
        out.write_str(if i > 0 { ", " } else { "" })?;
        out.write_str(node)?;
        if let Some(share) = watch.share() {
            write!(out, " {:.0} %", share * 100.0)?;
        }
    }
    Ok(())
}

/// Shows how an evaluation goes on.
pub(crate) struct Shown {
    detail: Detail,
    bar: ProgressBar,
    /// The nodes that are being evaluated, and how far they are.
    busy: Busy,
    /// What has ended.
    reports: Mutex<Vec<NodeReport>>,
    /// What was told: a film tells it once.
    told: Mutex<HashSet<String>>,
}

impl Shown {
    /// For evaluations, one after the other.
    pub(crate) fn new(detail: Detail) -> Shown {
        let target = match detail {
            Detail::Bar => ProgressDrawTarget::stderr(),
            _ => ProgressDrawTarget::hidden(),
        };
        let bar = ProgressBar::with_draw_target(None, target);
        let busy = Busy::default();
        let style = ProgressStyle::with_template("{prefix}{bar:24} {pos}/{len} {elapsed} {busy}");
        let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
        let shown = busy.clone();
        bar.set_style(style.with_key(
            "busy",
            move |_: &ProgressState, out: &mut dyn std::fmt::Write| {
                // What is shown is not worth an error.
                let _ = write_busy(&shown, out);
            },
        ));
        Shown { detail, bar, busy, reports: Mutex::default(), told: Mutex::default() }
    }

    /// Begins an evaluation of `nodes` nodes.
    pub(crate) fn begin(&self, title: String, nodes: usize) {
        self.bar.reset();
        self.bar.set_prefix(title);
        self.bar.set_length(nodes as u64);
        if self.detail == Detail::Bar {
            self.bar.enable_steady_tick(std::time::Duration::from_millis(100));
        }
    }

    /// Whether this was not told before.
    fn is_new(&self, message: &str) -> bool {
        self.told.lock().unwrap_or_else(PoisonError::into_inner).insert(message.to_owned())
    }

    /// Takes the bar away.
    pub(crate) fn clear(&self) {
        self.bar.finish_and_clear();
    }

    /// What has ended since this was asked last, also if something failed.
    pub(crate) fn reports(&self) -> Vec<NodeReport> {
        std::mem::take(&mut self.reports.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Progress for Shown {
    fn started(&self, node: &str, watch: &Watch) {
        lock(&self.busy).push((node.to_owned(), watch.clone()));
    }

    fn noted(&self, node: &str, message: &str) {
        let message = format!("node \"{node}\": {message}");
        if self.is_new(&message) {
            self.bar.suspend(|| print::note(message));
        }
    }

    fn warned(&self, node: &str, message: &str) {
        let message = format!("node \"{node}\": {message}");
        if self.is_new(&message) {
            // Without `suspend` the bar would be drawn into the words.
            self.bar.suspend(|| print::warning(message));
        }
    }

    fn finished(&self, report: &NodeReport) {
        // Of two frames' nodes of one name, the first.
        let mut busy = lock(&self.busy);
        if let Some(at) = busy.iter().position(|(node, _)| *node == report.node) {
            busy.remove(at);
        }
        drop(busy);
        self.bar.inc(1);
        self.reports.lock().unwrap_or_else(PoisonError::into_inner).push(report.clone());
        if self.detail == Detail::Lines && report.outcome == Outcome::Evaluated {
            let facts: Vec<String> = report
                .facts
                .iter()
                .map(|(name, value)| format!("{} {name}", print::grouped(*value)))
                .collect();
            let time = print::seconds(report.seconds);
            let at = report.frame.map_or(String::new(), |frame| format!(" @ {frame}"));
            let NodeReport { node, kind, .. } = report;
            print::err(&format!("{node}{at}: {kind} {time} {}", facts.join(", ")));
        }
    }
}
