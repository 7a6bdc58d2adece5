//! `spandrel diff`.

use spandrel_engine::span_file::{self, SpanFile};
use spandrel_engine::{Error, Result};
use std::fmt::Write;
use std::path::Path;

use crate::args::Diff;
use crate::{difference, exit, print};

pub(crate) fn run(args: &Diff) -> u8 {
    match diff(args) {
        Ok(true) => exit::DONE,
        Ok(false) => exit::FAILED,
        Err(error) => {
            print::error(&error);
            match error {
                Error::Mismatch { .. } => exit::USAGE,
                error => exit::of(&error),
            }
        }
    }
}

/// Prints how far two files are apart; returns whether they are within the tolerance.
fn diff(args: &Diff) -> Result<bool> {
    let is_spans = |path: &Path| path.extension().is_some_and(|e| e == "span");
    match (is_spans(&args.a), is_spans(&args.b)) {
        (true, true) => spans(args),
        (false, false) => pictures(args),
        _ => Err(Error::invalid(
            "a span file and a picture cannot be compared: resolve the spans first",
        )),
    }
}

fn spans(args: &Diff) -> Result<bool> {
    let open = |path| SpanFile::open_without_scenes(path);
    let found = span_file::compare(&open(&args.a)?, &open(&args.b)?)?;
    let mut out = String::new();
    for (labels, file) in found.only.iter().zip([&args.a, &args.b]) {
        for label in labels {
            let _ = writeln!(out, "source \"{label}\" only in {}", file.display());
        }
    }
    let (differing, lines) = (found.differing, found.lines);
    let _ = write!(out, "{differing} of {lines} lines differ");
    if let Some(first) = found.first {
        let share = found.area * 100.0;
        let _ = write!(
            out,
            ", the first at y = {first}; {share:.6} % of the picture show another face"
        );
        if found.translucent > 0.0 {
            let share = found.translucent * 100.0;
            let _ = write!(out, ", and {share:.6} % of a picture are translucent in one only");
        }
    }
    print::out(&(out + "\n"));
    Ok(found.area + found.translucent <= args.tolerance && (differing == 0 || args.tolerance > 0.0))
}

fn pictures(args: &Diff) -> Result<bool> {
    let (a, b) = (difference::read(&args.a)?, difference::read(&args.b)?);
    let mut out = format!(
        "{:<10}  {:>10}  {:>10}  {:>10}  {:>8}\n",
        "channel", "rmse", "99.9 %", "greatest", "> 1/255"
    );
    let mut near = true;
    for (name, d) in difference::by_channel(&a, &b)? {
        let share = d.above_step * 100.0;
        let _ = writeln!(
            out,
            "{name:<10}  {:>10.6}  {:>10.6}  {:>10.6}  {share:>6.3} %",
            d.rmse, d.high, d.most
        );
        near &= d.most <= args.tolerance;
    }
    let names = |image: &spandrel_engine::image::Image| -> Vec<String> {
        image.channels().map(|(name, _)| name.to_owned()).collect()
    };
    for (here, there, file) in [(&a, &b, &args.a), (&b, &a, &args.b)] {
        let known = names(there);
        for name in names(here).iter().filter(|name| !known.contains(name)) {
            let _ = writeln!(out, "{name:<10}  only in {}", file.display());
            near = false;
        }
    }
    print::out(&out);
    Ok(near)
}
