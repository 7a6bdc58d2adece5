//! `spandrel render`.

use spandrel_engine::cache::cache;
use spandrel_engine::graph::demand::Failure;
use spandrel_engine::graph::document::{Document, RawNode};
use spandrel_engine::graph::{Graph, Registry};
use spandrel_engine::moment::Frames;
use spandrel_engine::motion::numbered;
use spandrel_engine::output;
use spandrel_engine::resolve::Rule;
use spandrel_engine::text;
use spandrel_engine::texture::store;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::args::{Format, Render, Setting};
use crate::film::{self, Film};
use crate::stats::{Done, Written};
use crate::{check, draft, exit, print, stats};

pub(crate) fn run(registry: &Registry, args: &Render, denies_warnings: bool) -> u8 {
    if let Some(jobs) = args.jobs {
        // Fails only if threads were started before, and then there are some.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(jobs.into()).build_global();
    }
    print::be_quiet(args.quiet);
    let mut done = Done::default();
    let code = render(registry, args, &mut done).err().unwrap_or(exit::DONE);
    let code = exit::settled(code, denies_warnings);
    if args.stats == Some(Format::Json) {
        let all = stats::json(&done, &print::said());
        print::out(&all);
    }
    code
}

fn render(registry: &Registry, args: &Render, done: &mut Done) -> Result<(), u8> {
    store().set_limit(args.textures);
    if let Some(bytes) = args.memory {
        cache().set_limit(bytes);
    }
    if args.band.is_some() && film::cache_folder(args).is_none() {
        print::error(
            "--band: a band is stored for the run that joins all: name a folder with --cache, and give the same to that \
             run",
        );
        return Err(exit::USAGE);
    }
    let Prepared { graph, outputs, frames } = prepare(registry, args)?;
    let mut film = Film::new(args, graph, &outputs, &frames)?;
    let is_for_programs = args.json || args.stats == Some(Format::Json);
    let writes_to_standard = film.files().any(|file| output::is_standard(file));
    if writes_to_standard && is_for_programs {
        let option = if args.json { "--json" } else { "--stats=json" };
        print::error(format!(
            "{option}: the standard output is the picture: write the picture to a file"
        ));
        return Err(exit::USAGE);
    }
    // Beside a picture or what programs read, the standard output has nothing else.
    let is_taken = writes_to_standard || is_for_programs;
    let report =
        |text: &str| if is_taken { print::err(text.trim_end()) } else { print::words(text) };
    if args.no_clobber {
        for Written { node, frame, file, .. } in film.leave_what_is_there() {
            print::chat(&format!("kept {}: it exists", output::tidy(&file).display()));
            done.skipped.push(Written { node, frame, file, bytes: None });
        }
    }
    if args.dry_run {
        report(&film.intended()?);
        return Ok(());
    }
    // What cannot be written is told before it is computed.
    for shot in &film.shots {
        for (node, files) in &shot.writers {
            for file in files {
                let checked = output::check(file);
                checked.map_err(|error| {
                    film.fail(Some(shot.frame), &Failure { node: node.clone(), error })
                })?;
            }
        }
    }
    let clock = Instant::now();
    let ended = film.render(done, &report);
    done.seconds = clock.elapsed().as_secs_f64();
    let failed = ended?;
    let textures = store().report();
    if textures.reads > 4 * textures.pictures as u64 * frames.as_slice().len() as u64 {
        print::note(format!(
            "{} pictures on surfaces were read {} times: more --textures than {} saves time",
            textures.pictures,
            textures.reads,
            print::bytes(args.textures as u64)
        ));
    }
    if args.stats == Some(Format::Table) {
        report(&stats::table(&done.reports, done.seconds));
        let values = cache().report();
        let [used, all] = [values.most_used, values.most].map(|bytes| print::bytes(bytes as u64));
        report(&format!("values of nodes: {used} in use at most, {all} with what was kept\n"));
        if textures.reads > 0 {
            let most = print::bytes(textures.most as u64);
            let reads = textures.reads;
            report(&format!("pictures on surfaces: {most} at most, {reads} times read\n"));
        }
    }
    if !failed.is_empty() {
        let list: Vec<String> = failed.iter().map(i64::to_string).collect();
        let frames = print::count(failed.len(), "frame");
        print::error(format!("{frames} failed: {}", list.join(",")));
        return Err(exit::SOME_FAILED);
    }
    if let Some((number, of)) = args.band {
        print::chat(&format!("stored band {number} of {of}: --bands {of} joins them"));
    }
    print::chat(&format!("done in {}", print::seconds(done.seconds)));
    Ok(())
}

/// A graph that was read for the command line.
struct Prepared {
    graph: Graph,
    /// The nodes that are to write.
    outputs: Vec<String>,
    frames: Frames,
}

/// Reads the graph and finds the nodes that write.
fn prepare(registry: &Registry, args: &Render) -> Result<Prepared, u8> {
    let (mut document, directory) = check::open(&args.graph)?;
    if let Some(file) = &args.output {
        // It becomes part of the graph, which is text.
        let is_text = file.to_str().map(drop).ok_or_else(|| "its name is not UTF-8".to_owned());
        let named = numbered(&file.to_string_lossy(), 0.0).map_or(file.clone(), PathBuf::from);
        is_text.and_then(|()| output::check_name(&named)).map_err(|message| {
            print::error(format!("-o {}: {message}", file.display()));
            exit::USAGE
        })?;
    }
    for name in &args.write {
        let Some(raw) = document.nodes.iter().find(|raw| raw.id == *name) else {
            return Err(check::unknown("-w", name, document.nodes.iter().map(|raw| &*raw.id)));
        };
        let makes = registry.kind(&raw.kind).map_or("File", |kind| kind.output);
        let (fits, needs) = match &args.output {
            None => (makes == "File", "a node that writes a file, or add -o FILE"),
            Some(file) => (
                makes == "File" || writer_of(makes, file).is_some(),
                "a node that makes an Image or, for a .span file, a SpanImage",
            ),
        };
        if !fits {
            print::error(format!("-w {name}: {} makes a {makes}: name {needs}", raw.kind));
            return Err(exit::USAGE);
        }
    }
    if args.draft {
        draft::apply(registry, &mut document, args);
    }
    // What is set may decide what a writer of its own gets, and may be a field of that.
    let is_known = |setting: &&Setting| {
        let node = setting.node.as_ref();
        node.is_none_or(|node| document.nodes.iter().any(|raw| raw.id == *node))
    };
    let (known, others): (Vec<&Setting>, Vec<&Setting>) = args.set.iter().partition(is_known);
    check::set(registry, &mut document, known)?;
    let outputs = outputs(registry, args, &mut document)?;
    check::set(registry, &mut document, others)?;
    let frames = args.frames.clone().unwrap_or_else(|| check::frames_of(&document));
    let checked = |document: &Document| {
        check::check(registry, &args.graph, document, &directory, Some(&frames))
    };
    let graph = checked(&document)?;
    if outputs.is_empty() {
        let name = check::name(&args.graph);
        print::error(format!(
            "{name} writes nothing: add a Write node, or name a picture with -w NODE -o FILE"
        ));
        return Err(exit::INVALID);
    }
    let marks: Vec<String> = [
        args.draft.then(|| "draft".to_owned()),
        args.window.map(|[x, y, width, height]| format!("{x},{y},{width},{height}")),
    ]
    .into_iter()
    .flatten()
    .collect();
    if marks.is_empty() || args.output.is_some() {
        return Ok(Prepared { graph, outputs, frames });
    }
    // A draft or a part of a picture must not replace the whole.
    for info in graph.nodes().filter(|node| outputs.iter().any(|id| id == node.id)) {
        for (field, file) in info.writes {
            // As the text has it, with a place for the number of the frame.
            let raw = document.nodes.iter().find(|raw| raw.id == info.id);
            let file = raw.and_then(|raw| raw.parsed(field)).unwrap_or_else(|| file.to_owned());
            let file = part_name(&file, &marks.join("."));
            // The node was read with this field, so that it can be set.
            let _ = document.set(info.id, field, &format!("{file:?}"));
        }
    }
    Ok(Prepared { graph: checked(&document)?, outputs, frames })
}

/// The nodes that are to write; what is named by `-o` is set, and gets a writer if it has none.
fn outputs(registry: &Registry, args: &Render, document: &mut Document) -> Result<Vec<String>, u8> {
    let kind = |raw: &RawNode| registry.kind(&raw.kind);
    let mut outputs = args.write.clone();
    if outputs.is_empty() {
        let writes = |raw: &&RawNode| kind(raw).is_some_and(|kind| kind.output == "File");
        outputs = document.nodes.iter().filter(writes).map(|raw| raw.id.clone()).collect();
    }
    let Some(file) = &args.output else { return Ok(outputs) };
    let [only] = &outputs[..] else {
        if outputs.is_empty() {
            return Ok(outputs);
        }
        print::error(format!(
            "-o names one file, but {} nodes write: choose one with -w: {}",
            outputs.len(),
            outputs.join(", ")
        ));
        return Err(exit::USAGE);
    };
    let Some(raw) = document.nodes.iter().find(|raw| raw.id == *only) else { return Ok(outputs) };
    let Some(writer_kind) = kind(raw).and_then(|kind| writer_of(kind.output, file)) else {
        let ending =
            raw.value("path").and_then(|path| path.trim_end_matches(['"', '#']).rsplit_once('.'));
        let file = with_ending(file, ending.map_or("png", |(_, ending)| ending));
        // `-o` is meant from where the user stands, paths of a graph from its folder.
        let set = document.set(&only.clone(), "path", &format!("{:?}", absolute(&file)));
        set.map_err(|message| {
            print::error(format!("-o {}: {message}", file.display()));
            exit::USAGE
        })?;
        return Ok(outputs);
    };
    // A picture that is asked for by name gets a writer of its own.
    let (lines, ending) = match writer_kind {
        "WriteSpans" => (resolved(document, &args.set), "span"),
        _ => (String::new(), "png"),
    };
    let path = absolute(&with_ending(file, ending));
    document.add(WRITER, &format!("{writer_kind}(image: {only:?}, path: {path:?}{lines})"));
    Ok(vec![WRITER.to_owned()])
}

/// The name of the standard output with the ending that says its format.
fn with_ending(file: &Path, ending: &str) -> PathBuf {
    if file == Path::new("-") { file.with_extension(ending) } else { file.to_owned() }
}

/// The name of a draft or a part of a picture: `town.png` becomes `town.draft.png`, or `town.40,30,10,5.png`.
fn part_name(file: &str, part: &str) -> String {
    match file.rsplit_once('.') {
        Some((stem, ending)) => format!("{stem}.{part}.{ending}"),
        None => format!("{file}.{part}"),
    }
}

/// The node that writes a picture which is named on the command line.
pub(crate) const WRITER: &str = "file_of_the_command_line";

/// The kind of node that writes a type of value to a file.
fn writer_of(output: &str, file: &Path) -> Option<&'static str> {
    let is_open = file == Path::new("-");
    match (output, file.extension().is_some_and(|e| e == "span")) {
        ("Image", false) => Some("Write"),
        ("SpanImage", is_span) if is_span || is_open => Some("WriteSpans"),
        _ => None,
    }
}

/// The size and the lines with which the graph's spans are resolved, as fields, if all are resolved alike.
fn resolved(document: &Document, settings: &[Setting]) -> String {
    let mut all: Vec<String> = Vec::new();
    for raw in document.nodes.iter().filter(|raw| raw.kind == "Resolve") {
        let size = raw.value("size").map_or(String::new(), |size| format!(", size: {size}"));
        // A file cannot be asked for more lines: this is what is made of them.
        let lines = raw.parsed("lines").map(|rule: Rule| text::written(&rule.on_lines()));
        let lines = lines.map_or(String::new(), |lines| format!(", lines: {lines}"));
        all.push(size + &lines);
    }
    all.dedup();
    match &all[..] {
        [] => String::new(),
        [only] => only.clone(),
        // Who says which is not asked.
        _ if ["size", "lines"].iter().all(|field| {
            settings.iter().any(|set| set.node.as_deref() == Some(WRITER) && set.field == *field)
        }) =>
        {
            String::new()
        }
        _ => {
            print::warning(format!(
                "the graph resolves with different sizes or lines, and the file has those that WriteSpans has by \
                 itself: say which, such as `--set {WRITER}.size=(640,360) --set {WRITER}.lines=Sloped(8)`"
            ));
            String::new()
        }
    }
}

/// A path that means the same from the graph's folder.
fn absolute(path: &Path) -> String {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).display().to_string()
}
