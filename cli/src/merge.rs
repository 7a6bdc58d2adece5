//! `spandrel merge`.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use spandrel_engine::{Error, span_file};
use std::io::IsTerminal;
use std::path::Path;

use crate::args::Merge;
use crate::{exit, print};

pub(crate) fn run(args: &Merge) -> u8 {
    print::be_quiet(args.quiet);
    if let Err(code) = exit::check_output(&args.output, &["span"]) {
        return code;
    }
    let real = |path: &Path| std::fs::canonicalize(path).ok();
    if real(&args.output)
        .is_some_and(|out| args.inputs.iter().any(|i| real(i).is_some_and(|i| i == out)))
    {
        print::error(format!(
            "-o {}: it is one of the inputs: name another file",
            args.output.display()
        ));
        return exit::USAGE;
    }
    if args.no_clobber && args.output.exists() {
        print::chat(&format!("kept {}: it exists", args.output.display()));
        return exit::DONE;
    }
    let is_shown = !args.quiet && std::io::stderr().is_terminal();
    let target = if is_shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let bar = ProgressBar::with_draw_target(None, target);
    let style = ProgressStyle::with_template("{bar:24} {pos}/{len} rows {elapsed}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let inputs: Vec<&Path> = args.inputs.iter().map(AsRef::as_ref).collect();
    let clock = std::time::Instant::now();
    let merged = span_file::merge(&inputs, &args.output, &|done, all| {
        bar.set_length(u64::from(all));
        bar.set_position(u64::from(done));
    });
    bar.finish_and_clear();
    match merged {
        Ok(written) => {
            print::chat(&format!(
                "wrote {} ({} spans, {} faces, {}, {})",
                args.output.display(),
                print::grouped(written.spans),
                print::grouped(written.faces),
                print::bytes(written.bytes),
                print::seconds(clock.elapsed().as_secs_f64())
            ));
            exit::DONE
        }
        Err(error) => {
            print::error(&error);
            if let Error::Mismatch { .. } = error {
                print::err("  `spandrel info FILE` says what a file holds");
            }
            exit::of(&error)
        }
    }
}
