//! Reads mutated files of every format and tells how they ended:
//! `cargo run --release -p spandrel-tests --example mutations -- 20000`, or `-- 1 4711` for the run 4711 alone.
//!
//! A run that panics, ends the program, names no file, takes more than 5 seconds of processor time or a gigabyte
//! of memory is a fault, and its file is kept. The runs are those of a process of its own with little memory, which
//! begins again behind one that ended it.

#![allow(clippy::print_stdout, reason = "it is a command")]

#[path = "../mutations/mod.rs"]
mod mutations;

use mutations::{End, Mutations};
use spandrel_engine::image::file;
use spandrel_tests::program::scratch;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

/// The most processor time of a run, in hundredths of a second, and the most memory, in kilobytes.
const MOST_TICKS: u64 = 500;
const MOST_MEMORY: u64 = 1 << 20;
/// The most time on the clock, on whatever machine.
const MOST_TIME: Duration = Duration::from_secs(60);

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

fn keep(folder: &Path, run: u64, name: &str, fault: &str) {
    let kept = folder.join(format!("{run}-{name}"));
    let _ = std::fs::copy(folder.join(name), &kept);
    println!("run {run} of {name}: {fault}; kept as {}", kept.display());
}

/// Makes runs, and says in a file which one is being made.
fn make(folder: &Path, runs: Range<u64>) -> ExitCode {
    // Sound pictures of a gigabyte are not what is looked for.
    file::set_largest(1 << 28);
    let mutations = Mutations::new(folder);
    mutations.check_sound();
    let mut ends: BTreeMap<(&str, String), u64> = BTreeMap::new();
    let mut faults = 0;
    memory();
    for run in runs {
        let name = mutations.name(run);
        let _ = std::fs::write(folder.join("run"), format!("{run} {name}"));
        let before = ticks();
        let end = mutations.one(run);
        let (took, held) = (ticks() - before, memory());
        let fault = match end.clone() {
            Err(fault) => Some(fault),
            Ok(_) if took > MOST_TICKS => Some(format!("it takes {} s", took / 100)),
            Ok(_) if held > MOST_MEMORY => Some(format!("it takes {} MB", held >> 10)),
            Ok(End::Broke) => {
                println!("run {run} of {name}: a library broke, and it was told as an error");
                None
            }
            Ok(_) => None,
        };
        match (fault, end) {
            (None, Ok(end)) => *ends.entry((name, format!("{end:?}"))).or_default() += 1,
            (fault, _) => {
                faults += 1;
                keep(folder, run, name, &fault.unwrap_or_default());
            }
        }
    }
    for ((name, end), times) in ends {
        println!("{name:10} {end:8} {times}");
    }
    println!("{faults} faults in files of {} kinds", mutations.kinds());
    ExitCode::from(u8::from(faults > 0))
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize| arguments.get(i).and_then(|argument| argument.parse::<u64>().ok());
    if let [word, folder, ..] = &arguments[..]
        && word == "make"
    {
        return make(Path::new(folder), number(2).unwrap_or(0)..number(3).unwrap_or(0));
    }
    let (count, mut first) = (number(0).unwrap_or(20_000), number(1).unwrap_or(0));
    let (folder, end) = (scratch("mutations"), first + count);
    println!("{count} runs from {first} in {}", folder.display());
    let program = std::env::current_exe().expect("this program is somewhere");
    let mut is_well = true;
    while first < end {
        let mut child = Command::new("sh")
            .args(["-c", "ulimit -v 3000000; exec \"$0\" \"$@\""])
            .arg(&program)
            .args(["make", &folder.to_string_lossy(), &first.to_string(), &end.to_string()])
            .spawn()
            .expect("a shell can be started");
        let at = || std::fs::read_to_string(folder.join("run")).unwrap_or_default();
        let (mut last, mut since) = (String::new(), Instant::now());
        let status = loop {
            if let Some(status) = child.try_wait().expect("a child can be asked") {
                break status;
            }
            let now = at();
            if now != last {
                (last, since) = (now, Instant::now());
            } else if since.elapsed() > MOST_TIME {
                let _ = child.kill();
            }
            std::thread::sleep(Duration::from_millis(50));
        };
        is_well &= status.success();
        if matches!(status.code(), Some(0 | 1)) {
            break;
        }
        let at = at();
        let Some((run, name)) = at.split_once(' ') else { break };
        keep(
            &folder,
            run.parse().unwrap_or(first),
            name,
            &format!("it ends the program: {status}"),
        );
        first = run.parse::<u64>().unwrap_or(end).max(first) + 1;
    }
    ExitCode::from(u8::from(!is_well))
}
