//! The frames of a render: what each writes, and their evaluation, some at once as memory allows.

use serde_json::{Value as Json, json};
use spandrel_engine::cache::cache;
use spandrel_engine::graph::demand::{Failure, Wishes};
use spandrel_engine::graph::{Graph, NodeReport, Run, Schedule, Stored};
use spandrel_engine::image::Window;
use spandrel_engine::key::Key;
use spandrel_engine::moment::Frames;
use spandrel_engine::output;
use spandrel_engine::store::Store;
use spandrel_engine::values::{Bands, Delivery, Override};
use std::collections::HashMap;
use std::path::PathBuf;
use std::time::Instant;

use crate::args::Render;
use crate::progress::{Detail, Shown};
use crate::stats::{Done, Written};
use crate::{check, draft, exit, print, stats};

/// A graph, and the frames that are to be made of it.
pub(crate) struct Film<'a> {
    args: &'a Render,
    graph: Graph,
    pub(crate) shots: Vec<Shot>,
}

/// What is written at a frame.
pub(crate) struct Shot {
    pub(crate) frame: i64,
    /// The nodes, and the files of each.
    pub(crate) writers: Vec<(String, Vec<PathBuf>)>,
}

impl<'a> Film<'a> {
    /// The frames of a graph, with the nodes that are to write. What is the same at all frames is written at the
    /// first.
    pub(crate) fn new(
        args: &'a Render,
        graph: Graph,
        outputs: &[String],
        frames: &Frames,
    ) -> Result<Film<'a>, u8> {
        let varies = |id: &str| graph.nodes().any(|node| node.id == id && node.varies);
        let has_many = frames.as_slice().len() > 1;
        let mut shots: Vec<Shot> = Vec::new();
        let mut written: HashMap<PathBuf, i64> = HashMap::new();
        for (number, frame) in frames.as_slice().iter().enumerate() {
            let mut writers = Vec::new();
            for id in outputs.iter().filter(|id| number == 0 || varies(id)) {
                let mut files = graph.writes(id, *frame as f64).map_err(|error| {
                    fail(args, Some(*frame), &Failure { node: id.clone(), error })
                })?;
                if args.band.is_some() {
                    // A band is stored, and not written.
                    files.clear();
                }
                for file in files.iter().filter(|file| !output::is_standard(file)) {
                    let Some(first) = written.insert(output::real(file), *frame) else { continue };
                    print::error(format!(
                        "{}: frames {first} and {frame} would both write {}: put #### into its path for the number of \
                         the frame, such as town.####.png",
                        check::name(&args.graph),
                        output::tidy(file).display()
                    ));
                    return Err(if args.frames.is_some() { exit::USAGE } else { exit::INVALID });
                }
                writers.push((id.clone(), files));
            }
            shots.push(Shot { frame: *frame, writers });
        }
        shots.retain(|shot| !shot.writers.is_empty());
        if has_many && shots.len() == 1 {
            print::note("nothing that is written changes with the frame: it is written once");
        }
        let is_one = args.frames.is_none() && !has_many;
        if is_one && outputs.iter().any(|id| varies(id)) {
            let frame = frames.as_slice()[0];
            print::note(format!(
                "this is frame {frame} of a graph that moves: -F 1-48 renders others"
            ));
        }
        Ok(Film { args, graph, shots })
    }

    /// All files that are written.
    pub(crate) fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.shots.iter().flat_map(|shot| &shot.writers).flat_map(|(_, files)| files)
    }

    /// Takes out the nodes whose files are all there; returns these files.
    pub(crate) fn leave_what_is_there(&mut self) -> Vec<Written> {
        let mut kept = Vec::new();
        for Shot { frame, writers } in &mut self.shots {
            let is_there = |file: &PathBuf| !output::is_standard(file) && file.exists();
            writers.retain(|(node, files)| {
                let is_kept = !files.is_empty() && files.iter().all(is_there);
                let written = |file: &PathBuf| Written {
                    node: node.clone(),
                    frame: *frame,
                    file: file.clone(),
                    bytes: None,
                };
                kept.extend(files.iter().filter(|_| is_kept).map(written));
                !is_kept
            });
        }
        self.shots.retain(|shot| !shot.writers.is_empty());
        kept
    }

    /// What would be evaluated, in words.
    pub(crate) fn intended(&self) -> Result<String, u8> {
        let Some(first) = self.shots.first() else { return Ok("nothing to do\n".to_owned()) };
        let schedule = self.schedule(&self.shots[..1])?;
        if self.args.explain {
            return Ok(stats::explanation(&self.graph, &schedule, &[]));
        }
        let mut nodes = schedule.nodes(&self.graph);
        nodes.reverse();
        let mut words = format!("would evaluate: {}\n", nodes.join(", "));
        if self.shots.len() > 1 {
            let varies: Vec<&str> = self
                .graph
                .nodes()
                .filter(|node| node.varies && nodes.contains(&node.id))
                .map(|node| node.id)
                .collect();
            let count = self.shots.len();
            let from = first.frame;
            words += &format!("at each of {count} frames from {from} on: {}\n", varies.join(", "));
        }
        Ok(words)
    }

    fn schedule(&self, shots: &[Shot]) -> Result<Schedule, u8> {
        let changed = Override {
            size: self.args.size,
            scale: self.args.scale.or_else(|| draft::scale(self.args)),
            window: self.args.window.map(|[x, y, width, height]| Window { x, y, width, height }),
            bands: match self.args.band {
                Some((number, of)) => Some(Bands { of, only: Some(number) }),
                None => self.args.bands.map(|of| Bands { of, only: None }),
            },
        };
        let mut wishes = Wishes::new();
        for shot in shots {
            for (node, _) in &shot.writers {
                wishes.want_at::<Delivery>(node, changed.clone(), shot.frame as f64);
            }
        }
        let frame = shots.first().map(|shot| shot.frame);
        Schedule::new(&self.graph, &wishes).map_err(|failure| self.fail(frame, &failure))
    }

    /// Renders all frames; returns those that failed, if it is to go on without them.
    pub(crate) fn render(&self, done: &mut Done, report: &dyn Fn(&str)) -> Result<Vec<i64>, u8> {
        let args = self.args;
        let shown = Shown::new(Detail::new(args.quiet, args.verbose));
        let run = run_of(args);
        let count = self.shots.len();
        self.tell(&json!({ "event": "started", "frames": count }));
        let mut failed = Vec::new();
        // How many frames at once: one, until it is known what that takes.
        let (mut at, mut step) = (0, 1);
        while at < count {
            let shots = &self.shots[at..(at + step).min(count)];
            let clock = Instant::now();
            let schedule = self.schedule(shots)?;
            let nodes = schedule.nodes(&self.graph).len();
            let title =
                if count > 1 { format!("frame {} ", shots[0].frame) } else { String::new() };
            shown.begin(title, nodes);
            let ended = run.evaluate(&self.graph, &schedule, &shown);
            shown.clear();
            let reports = shown.reports();
            self.written(shots, &reports, done);
            if args.stats.is_some() {
                done.reports.extend(reports.iter().cloned());
            }
            if let Err(failure) = ended {
                if shots.len() > 1 {
                    // Which of them it was; what is made is kept.
                    step = 1;
                    continue;
                }
                let frame = shots[0].frame;
                let error = failure.to_string();
                self.tell(&json!({ "event": "failed", "frame": frame, "error": error }));
                let code = self.fail((count > 1).then_some(frame), &failure);
                let is_over = !args.keep_going || count == 1;
                if is_over || matches!(failure.error, spandrel_engine::Error::Cancelled) {
                    return Err(code);
                }
                failed.push(frame);
            } else if args.explain {
                report(&stats::explanation(&self.graph, &schedule, &reports));
            }
            at += shots.len();
            for shot in shots.iter().filter(|shot| !failed.contains(&shot.frame)) {
                let seconds = clock.elapsed().as_secs_f64();
                let files: Vec<String> = { shot.writers.iter() }
                    .flat_map(|(_, files)| files)
                    .map(|file| output::tidy(file).display().to_string())
                    .collect();
                let (frame, done) = (shot.frame, at);
                self.tell(
                    &json!({ "event": "frame", "frame": frame, "files": files, "seconds": seconds,
                    "done": done, "frames": count }),
                );
            }
            // What no later frame used is not used again.
            run.forget_unused();
            if args.explain {
                continue;
            }
            let most = (cache().report().most_used / shots.len()).max(1);
            step = (cache().limit() / most).clamp(1, rayon::current_num_threads());
        }
        self.tell(&json!({ "event": "ended", "frames": count, "failed": failed }));
        Ok(failed)
    }

    /// Notes and tells what was written.
    fn written(&self, shots: &[Shot], reports: &[NodeReport], done: &mut Done) {
        for shot in shots {
            for (node, files) in &shot.writers {
                let is_it = |report: &&NodeReport| {
                    let is_then = report.frame.is_none_or(|frame| frame == shot.frame as f64);
                    report.node == *node && is_then
                };
                let report = reports.iter().find(is_it);
                let fact =
                    report.and_then(|r| r.facts.iter().find(|(name, _)| *name == "file bytes"));
                for file in files.iter().filter(|_| fact.is_some()) {
                    let bytes = fact.map(|(_, bytes)| *bytes);
                    let is_known =
                        |written: &Written| written.frame == shot.frame && written.file == *file;
                    // One of several frames failed, and they were made once more.
                    if done.outputs.iter().rev().take(64).any(is_known) {
                        continue;
                    }
                    let size = print::bytes(bytes.unwrap_or(0));
                    match output::is_standard(file) {
                        true => print::chat(&format!("wrote the standard output ({size})")),
                        false => {
                            print::chat(&format!(
                                "wrote {} ({size})",
                                output::tidy(file).display()
                            ));
                        }
                    }
                    let (node, file) = (node.clone(), file.clone());
                    done.outputs.push(Written { node, frame: shot.frame, file, bytes });
                }
            }
        }
    }

    /// Tells programs how it goes.
    fn tell(&self, event: &Json) {
        if self.args.json {
            print::out(&format!("{event}\n"));
        }
    }

    /// Prints a failure, at a frame if there are others, and returns the exit code.
    pub(crate) fn fail(&self, frame: Option<i64>, failure: &Failure) -> u8 {
        fail(self.args, frame.filter(|_| self.shots.len() > 1), failure)
    }
}

/// Where results are stored, if they are.
pub(crate) fn cache_folder(args: &Render) -> Option<PathBuf> {
    let said = || std::env::var_os("SPANDREL_CACHE").filter(|folder| !folder.is_empty());
    let folder = args.cache.clone().or_else(|| said().map(PathBuf::from));
    folder.filter(|_| !args.no_cache)
}

/// A run that stores its results, if that is wanted. Without the folder pictures are the same, and take longer.
fn run_of(args: &Render) -> Run {
    let Some(folder) = cache_folder(args) else { return Run::new() };
    // Every build of a program has results of its own.
    let program =
        || -> std::io::Result<Key> { Key::of_file(std::fs::File::open(std::env::current_exe()?)?) };
    let build = program().map_err(|error| format!("this program cannot be read: {error}"));
    let store = Store::open(&folder, args.cache_size as u64).map_err(|error| error.to_string());
    match store.and_then(|store| Ok(Stored::new(store, build?))) {
        Ok(stored) => Run::new().stored(stored),
        Err(error) => {
            print::warning(format!("{error}: results are not stored"));
            Run::new()
        }
    }
}

fn fail(args: &Render, frame: Option<i64>, failure: &Failure) -> u8 {
    let name = check::name(&args.graph);
    match frame {
        Some(frame) => print::error(format!("{name}: frame {frame}: {failure}")),
        None => print::error(format!("{name}: {failure}")),
    }
    exit::of(&failure.error)
}
