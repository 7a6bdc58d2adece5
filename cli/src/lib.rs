//! Spandrel's command line, as a library: a studio's own program is five lines.
//!
//! ```no_run
//! fn main() -> std::process::ExitCode {
//!     let mut registry = spandrel::library();
//!     // registry.register::<studio::Grain>();
//!     spandrel::run(registry)
//! }
//! ```

mod args;
mod cache;
mod check;
mod contents;
mod convert;
mod diff;
mod difference;
mod draft;
mod exit;
mod film;
mod info;
mod inspect;
mod lamp;
mod lights;
mod measure;
mod merge;
mod new;
mod nodes;
mod pick;
mod picture;
mod print;
mod progress;
mod render;
mod spans;
mod stats;
mod submit;
mod volume;

use clap::{CommandFactory, Parser};
use spandrel_engine::graph::Registry;
use std::process::ExitCode;

use args::{Args, Command};

/// The registry with all of Spandrel's own kinds of node.
pub fn library() -> Registry {
    let mut registry = Registry::new();
    spandrel_nodes::register(&mut registry);
    registry
}

/// Runs the command line of this process with the kinds of node in `registry`.
pub fn run(registry: Registry) -> ExitCode {
    let args = match Args::try_parse() {
        Ok(args) => args,
        Err(error) => {
            // Help is no failure.
            if error.use_stderr() {
                let _ = error.print();
                return ExitCode::from(exit::USAGE);
            }
            let help = error.render();
            let is_terminal = std::io::IsTerminal::is_terminal(&std::io::stdout());
            print::out(&if is_terminal { help.ansi().to_string() } else { help.to_string() });
            return ExitCode::from(exit::settled(exit::DONE, false));
        }
    };
    // A file that is being written must not stay behind.
    let _ = ctrlc::set_handler(|| {
        spandrel_engine::output::abandon();
        std::process::exit(130);
    });
    // A picture on a surface is no place for the result.
    spandrel_engine::output::keep_inputs();
    if let Some(bytes) = args.largest_picture {
        spandrel_engine::image::file::set_largest(bytes as u64);
    }
    let denies_warnings = args.deny_warnings;
    let code = match args.command {
        Command::Render(args) => render::run(&registry, &args, denies_warnings),
        Command::Check(args) => check::run(&registry, &args),
        Command::Nodes(args) => nodes::run(&registry, &args),
        Command::Measure(args) => measure::run(&registry, &args),
        Command::Inspect(args) => inspect::run(&registry, &args),
        Command::Pick(args) => pick::run(&registry, &args),
        Command::Info(args) => info::run(&registry, &args),
        Command::Diff(args) => diff::run(&args),
        Command::Merge(args) => merge::run(&args),
        Command::Cache(args) => cache::run(&args),
        Command::New(args) => new::run(&args),
        Command::Submit(args) => submit::run(&registry, &args),
        Command::Convert(args) => convert::run(&args),
        Command::Completions(args) => {
            let mut script = Vec::new();
            clap_complete::generate(args.shell, &mut Args::command(), "spandrel", &mut script);
            print::out(&String::from_utf8_lossy(&script));
            exit::DONE
        }
    };
    ExitCode::from(exit::settled(code, denies_warnings))
}
