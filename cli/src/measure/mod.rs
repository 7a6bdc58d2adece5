//! `spandrel measure`: what accuracy costs, for a graph of the user's own.
//!
//! Every setting is rendered by a process of its own, so that nothing is remembered between them and
//! the memory that each needs can be told; time is that of the evaluation, without writing the file.

mod plot;
mod report;

use serde_json::Value as Json;
use spandrel_engine::graph::Registry;
use spandrel_engine::image::Image;
use spandrel_engine::{Error, Result, output};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::args::{Measure, Setting};
use crate::difference::{self, Difference};
use crate::{check, exit, print, render};

/// One setting, measured.
#[derive(Clone, Debug)]
pub(crate) struct Measured {
    /// The value of each varied parameter.
    pub(crate) values: Vec<String>,
    /// The picture's distance from the reference.
    pub(crate) error: Difference,
    /// Time of the evaluation, the median of all runs.
    pub(crate) seconds: f64,
    /// The most memory held, where the system says so.
    pub(crate) peak_bytes: Option<u64>,
    /// Bytes of the largest span image.
    pub(crate) span_bytes: u64,
    /// Whether no other setting is both faster and better.
    pub(crate) is_best: bool,
}

/// All that was measured of a graph.
pub(crate) struct Measurement {
    pub(crate) graph: String,
    pub(crate) reference: String,
    pub(crate) runs: u32,
    /// The varied parameters.
    pub(crate) parameters: Vec<String>,
    pub(crate) rows: Vec<Measured>,
}

pub(crate) fn run(registry: &Registry, args: &Measure) -> u8 {
    match measure(registry, args) {
        Ok(()) => exit::DONE,
        Err(code) => code,
    }
}

fn measure(registry: &Registry, args: &Measure) -> Result<(), u8> {
    print::be_quiet(args.quiet);
    for path in &args.output {
        exit::check_output(path, &["csv", "svg", "html"])?;
    }
    if check::is_standard(&args.graph) {
        print::error("-: a graph that is measured is read many times: name its file");
        return Err(exit::USAGE);
    }
    let (node, frame) = picture(registry, args)?;
    let folder = std::env::temp_dir().join(format!("spandrel-measure-{}", std::process::id()));
    let measured = std::fs::create_dir_all(&folder)
        .map_err(|e| Error::output(&folder, e))
        .and_then(|()| Runner { args, node: &node, frame, folder: &folder }.all());
    // A folder of the system's for temporary files; nothing is lost if it stays.
    let _ = std::fs::remove_dir_all(&folder);
    let done = measured.and_then(|measurement| {
        print::words(&report::table(&measurement));
        args.output.iter().try_for_each(|path| write(path, &measurement))
    });
    done.map_err(|error| {
        print::error(&error);
        exit::of(&error)
    })
}

/// The picture that is measured, the one named or the only one that is written, and the frame.
fn picture(registry: &Registry, args: &Measure) -> Result<(String, i64), u8> {
    // What is wrong with a setting is told before hours of rendering the others.
    let known = |settings: &[Setting]| {
        let own = |setting: &&Setting| setting.node.as_deref() != Some(render::WRITER);
        let settings: Vec<Setting> = settings.iter().filter(own).cloned().collect();
        check::read(registry, &args.graph, &settings, args.frame.as_ref())
    };
    combinations(&args.vary).iter().try_for_each(|settings| known(settings).map(drop))?;
    let graph = known(&args.reference)?;
    if let Some(node) = &args.write {
        if graph.nodes().all(|known| known.id != node) {
            return Err(check::unknown("-w", node, graph.nodes().map(|known| known.id)));
        }
        return Ok((node.clone(), graph.first_frame()));
    }
    let written = graph.nodes().filter(|node| node.output == "File");
    let mut pictures: Vec<&str> = written.flat_map(|node| node.uses).collect();
    pictures.dedup();
    match pictures[..] {
        [only] => Ok((only.to_owned(), graph.first_frame())),
        _ => {
            print::error(format!(
                "{} pictures are written: choose one with -w: {}",
                pictures.len(),
                pictures.join(", ")
            ));
            Err(exit::USAGE)
        }
    }
}

/// Renders settings in processes of their own.
struct Runner<'a> {
    args: &'a Measure,
    node: &'a str,
    frame: i64,
    folder: &'a Path,
}

/// What one run said.
struct Ran {
    seconds: f64,
    peak_bytes: Option<u64>,
    span_bytes: u64,
}

impl Runner<'_> {
    fn all(&self) -> Result<Measurement> {
        let parameters = self.args.vary.iter().map(Setting::place).collect();
        let reference = self.args.reference.iter().map(Setting::to_string);
        let reference = reference.collect::<Vec<_>>().join(", ");
        print::chat(&format!("reference: {reference}"));
        let place = self.folder.join("reference.exr");
        self.run(&self.args.reference, &place)?;
        let truth = difference::read(&place)?;
        let mut rows = Vec::new();
        let combinations = combinations(&self.args.vary);
        for (i, settings) in combinations.iter().enumerate() {
            let words = settings.iter().map(Setting::to_string).collect::<Vec<_>>().join(", ");
            print::chat(&format!("{} of {}: {words}", i + 1, combinations.len()));
            rows.push(self.measure(settings, &truth)?);
        }
        mark_best(&mut rows);
        Ok(Measurement {
            graph: self.args.graph.display().to_string(),
            reference,
            runs: self.args.runs,
            parameters,
            rows,
        })
    }

    fn measure(&self, settings: &[Setting], truth: &Image) -> Result<Measured> {
        let place = self.folder.join("picture.exr");
        let runs: Vec<Ran> =
            (0..self.args.runs).map(|_| self.run(settings, &place)).collect::<Result<_>>()?;
        let mut times: Vec<f64> = runs.iter().map(|ran| ran.seconds).collect();
        // The median, as other work on the machine makes single runs slow.
        times.sort_by(f64::total_cmp);
        Ok(Measured {
            values: settings.iter().map(|setting| setting.value.clone()).collect(),
            error: difference::of_colors(&difference::read(&place)?, truth)?,
            seconds: times[times.len() / 2],
            peak_bytes: runs.iter().filter_map(|ran| ran.peak_bytes).max(),
            span_bytes: runs.iter().map(|ran| ran.span_bytes).max().unwrap_or(0),
            is_best: false,
        })
    }

    fn run(&self, settings: &[Setting], picture: &Path) -> Result<Ran> {
        let program = std::env::current_exe().map_err(|e| Error::file("this program", e))?;
        let mut command = Command::new(&program);
        // What is measured is made, and not taken from anywhere.
        command.args(["render", "-q", "--stats=json", "--no-cache", "-F", &self.frame.to_string()]);
        command.args(["-w", self.node, "-o"]).arg(picture);
        // Halves would round away the errors of the best settings.
        command.args(["--set", &format!("{}.bits=32", render::WRITER)]);
        for setting in settings {
            command.args(["--set", &setting.to_string()]);
        }
        if let Some((width, height)) = self.args.size {
            command.args(["--size", &format!("{width}x{height}")]);
        }
        // A graph's name may begin with a minus.
        let ran = command.arg("--").arg(&self.args.graph).output();
        let ran = ran.map_err(|e| Error::file(&program, e))?;
        if !ran.status.success() {
            let said = String::from_utf8_lossy(&ran.stderr).trim().to_owned();
            let words = settings.iter().map(Setting::to_string).collect::<Vec<_>>().join(", ");
            return Err(Error::invalid(format!("with {words}:\n{said}")));
        }
        let stats: Json = serde_json::from_slice(&ran.stdout).unwrap_or_default();
        for warning in stats["warnings"].as_array().into_iter().flatten().filter_map(Json::as_str) {
            let is_new = !print::said().warnings.iter().any(|known| known == warning);
            if is_new {
                print::warning(warning);
            }
        }
        let nodes = stats["nodes"].as_array().cloned().unwrap_or_default();
        let seconds = |value: &Json| value["seconds"].as_f64().unwrap_or(0.0);
        let writing: f64 = nodes.iter().filter(|n| n["node"] == render::WRITER).map(seconds).sum();
        let spans = nodes.iter().filter(|node| node["facts"].get("spans").is_some());
        Ok(Ran {
            seconds: seconds(&stats) - writing,
            peak_bytes: stats["peak_bytes"].as_u64(),
            span_bytes: spans.filter_map(|node| node["bytes"].as_u64()).max().unwrap_or(0),
        })
    }
}

/// All combinations of the values of the varied parameters, the last varying fastest.
fn combinations(vary: &[Setting]) -> Vec<Vec<Setting>> {
    vary.iter().fold(vec![Vec::new()], |all, setting| {
        let values = values(&setting.value);
        let with = |before: &Vec<Setting>| {
            let before = before.clone();
            let next = values.clone().into_iter();
            next.map(move |value| {
                let mut settings = before.clone();
                settings.push(Setting { value, ..setting.clone() });
                settings
            })
            .collect::<Vec<_>>()
        };
        all.iter().flat_map(with).collect()
    })
}

/// The values of a list such as `Sloped(4),Sampled(4, Box)`: divided at commas outside of brackets.
fn values(list: &str) -> Vec<String> {
    let mut values = vec![String::new()];
    let (mut depth, mut quoted) = (0, false);
    for c in list.chars() {
        quoted ^= c == '"';
        match c {
            '(' | '[' | '{' if !quoted => depth += 1,
            ')' | ']' | '}' if !quoted => depth -= 1,
            _ => {}
        }
        if c == ',' && depth == 0 && !quoted {
            values.push(String::new());
        } else if let Some(last) = values.last_mut() {
            last.push(c);
        }
    }
    values.into_iter().map(|value| value.trim().to_owned()).filter(|v| !v.is_empty()).collect()
}

/// Marks the settings than which no other is both faster and better.
fn mark_best(rows: &mut [Measured]) {
    let known: Vec<(f64, f64)> = rows.iter().map(|row| (row.seconds, row.error.rmse)).collect();
    for row in rows {
        let (seconds, rmse) = (row.seconds, row.error.rmse);
        let beats =
            |(s, e): &(f64, f64)| *s <= seconds && *e <= rmse && (*s, *e) != (seconds, rmse);
        row.is_best = !known.iter().any(beats);
    }
}

fn write(path: &PathBuf, measurement: &Measurement) -> Result<()> {
    let text = match path.extension().and_then(|e| e.to_str()) {
        Some("csv") => report::csv(measurement),
        Some("svg") => plot::svg(measurement),
        _ => report::html(measurement),
    };
    output::write(path, |out| out.write_all(text.as_bytes()).map_err(|e| Error::output(path, e)))?;
    print::chat(&format!("wrote {}", path.display()));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_divided_outside_of_brackets() {
        assert_eq!(
            values("Sloped(4), Sampled(4, Box),\"a,b\""),
            ["Sloped(4)", "Sampled(4, Box)", "\"a,b\""]
        );
        assert_eq!(values("1"), ["1"]);
    }

    #[test]
    fn the_last_parameter_varies_fastest() {
        let vary = |field: &str, value: &str| Setting {
            node: Some("n".to_owned()),
            field: field.to_owned(),
            value: value.to_owned(),
        };
        let all = combinations(&[vary("a", "1,2"), vary("b", "x,y")]);
        let words: Vec<String> = all
            .iter()
            .map(|settings| settings.iter().map(|s| s.value.as_str()).collect::<Vec<_>>().join(""))
            .collect();
        assert_eq!(words, ["1x", "1y", "2x", "2y"]);
    }
}
