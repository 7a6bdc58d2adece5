//! Reads mutated files of every format and tells how they ended:
//! `cargo run --release -p spandrel-tests --example mutations -- 20000`, or `-- 1 4711` for the run 4711 alone.
//!
//! A run that panics, names no file, takes more than 5 seconds of processor time or a gigabyte of memory fails, and
//! its file is kept. One that ends the whole program leaves its file in the folder that is named first.

#![allow(clippy::print_stdout, reason = "it is a command")]

#[path = "../mutations/mod.rs"]
mod mutations;

use mutations::{End, Mutations};
use spandrel_engine::image::file;
use spandrel_tests::program::scratch;
use std::collections::BTreeMap;
use std::process::ExitCode;

/// The most processor time of a run, in hundredths of a second, and the most memory, in kilobytes.
const MOST_TICKS: u64 = 500;
const MOST_MEMORY: u64 = 1 << 20;

/// Processor time of this process in hundredths of a second, where the system tells.
fn ticks() -> u64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat.rsplit(") ").next().unwrap_or("").split(' ').collect();
    [11, 12].iter().filter_map(|i| fields.get(*i)?.parse::<u64>().ok()).sum()
}

/// The most memory that this process held since the last time, in kilobytes, where the system tells.
fn memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let _ = std::fs::write("/proc/self/clear_refs", "5");
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok()).unwrap_or(0)
}

fn main() -> ExitCode {
    let mut arguments =
        std::env::args().skip(1).filter_map(|argument| argument.parse::<u64>().ok());
    let count = arguments.next().unwrap_or(20_000);
    let first = arguments.next().unwrap_or(0);
    let folder = scratch("mutations");
    println!("{count} runs from {first} in {}", folder.display());
    // Sound pictures of a gigabyte are not what is looked for.
    file::set_largest(1 << 28);
    let mutations = Mutations::new(&folder);
    mutations.check_sound();
    let mut ends: BTreeMap<(&str, String), u64> = BTreeMap::new();
    let mut faults = 0;
    memory();
    for run in first..first + count {
        let (name, before) = (mutations.name(run), ticks());
        let end = mutations.one(run);
        let (took, held) = (ticks() - before, memory());
        let fault = match end {
            Err(fault) => Some(fault),
            Ok(_) if took > MOST_TICKS => Some(format!("it takes {} s", took / 100)),
            Ok(_) if held > MOST_MEMORY => Some(format!("it takes {} MB", held >> 10)),
            Ok(end) => {
                if end == End::Broke {
                    println!("run {run} of {name}: a library broke, and it was told as an error");
                }
                *ends.entry((name, format!("{end:?}"))).or_default() += 1;
                None
            }
        };
        if let Some(fault) = fault {
            faults += 1;
            let kept = folder.join(format!("{run}-{name}"));
            let _ = std::fs::copy(folder.join(name), &kept);
            println!("run {run} of {name}: {fault}; kept as {}", kept.display());
        }
    }
    for ((name, end), times) in ends {
        println!("{name:10} {end:8} {times}");
    }
    println!("{faults} faults in files of {} kinds", mutations.kinds());
    ExitCode::from(u8::from(faults > 0))
}
