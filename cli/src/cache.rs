//! `spandrel cache`: what a folder of stored results holds; and removing it.

use serde_json::{Value as Json, json};
use spandrel_engine::Result;
use spandrel_engine::store::{Holding, Stats, Store};
use std::fmt::Write;
use std::path::Path;
use std::time::SystemTime;

use crate::args::Cache;
use crate::{exit, print};

pub(crate) fn run(args: &Cache) -> u8 {
    match said(args) {
        Ok(text) => {
            print::words(&text);
            exit::DONE
        }
        Err(error) => {
            print::error(&error);
            exit::of(&error)
        }
    }
}

fn said(args: &Cache) -> Result<String> {
    let folder = &args.folder;
    if args.clear {
        let cleared = Store::clear(folder)?;
        return Ok(match args.json {
            true => format!("{:#}\n", json!({ "removed": size(&cleared) })),
            false => {
                let (objects, bytes) = (objects(&cleared), print::bytes(cleared.bytes));
                format!("{}: {objects} removed, {bytes}\n", folder.display())
            }
        });
    }
    let stats = Store::stats(folder)?;
    Ok(if args.json { as_json(&stats) } else { as_text(folder, &stats) })
}

fn objects(holding: &Holding) -> String {
    print::count(usize::try_from(holding.objects).unwrap_or(usize::MAX), "object")
}

fn as_text(folder: &Path, stats: &Stats) -> String {
    let all = stats.all();
    let mut out = format!("{}: a cache of {}\n", folder.display(), objects(&all));
    let _ = writeln!(out, "  {} on the disk", print::bytes(all.bytes));
    let _ = writeln!(out, "  {} to make them", print::seconds(all.seconds));
    if let Some((oldest, newest)) = all.oldest.zip(all.newest) {
        let (oldest, newest) = (ago(oldest), ago(newest));
        let _ = writeln!(out, "  last used {newest}; the one that was not for longest, {oldest}");
    }
    for (holding, what) in [
        (&stats.unfinished, "being written, or left by a process that was killed"),
        (&stats.other_versions, "of other versions of Spandrel, which only --clear removes"),
    ] {
        if holding.objects > 0 {
            let bytes = print::bytes(holding.bytes);
            let _ = writeln!(out, "  and {} {what}: {bytes}", objects(holding));
        }
    }
    out
}

/// How long ago something was, to a unit that suits it.
fn ago(then: SystemTime) -> String {
    // What another machine did may lie in the future of this one's clock.
    let seconds = SystemTime::now().duration_since(then).unwrap_or_default().as_secs();
    let units = [(86_400, "day"), (3600, "hour"), (60, "minute")];
    match units.into_iter().find(|(length, _)| seconds >= *length) {
        Some((length, unit)) => {
            format!("{} ago", print::count((seconds / length) as usize, unit))
        }
        None => "less than a minute ago".to_owned(),
    }
}

fn as_json(stats: &Stats) -> String {
    let mut all = full(&stats.all());
    let parts: Vec<Json> = stats.parts.iter().map(full).collect();
    all["version"] = json!(env!("CARGO_PKG_VERSION"));
    all["unfinished"] = size(&stats.unfinished);
    all["other_versions"] = size(&stats.other_versions);
    all["parts"] = json!(parts);
    format!("{all:#}\n")
}

fn size(holding: &Holding) -> Json {
    json!({ "objects": holding.objects, "bytes": holding.bytes })
}

/// Times are seconds since 1970.
fn full(holding: &Holding) -> Json {
    let since = |time: Option<SystemTime>| {
        time.and_then(|time| time.duration_since(SystemTime::UNIX_EPOCH).ok())
            .map(|time| time.as_secs())
    };
    json!({
        "objects": holding.objects,
        "bytes": holding.bytes,
        "seconds": holding.seconds,
        "oldest": since(holding.oldest),
        "newest": since(holding.newest),
    })
}
