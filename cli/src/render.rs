//! `spandrel render`.

use spandrel_engine::graph::demand::{Failure, Wishes};
use spandrel_engine::graph::diagnostic::{list, nearest};
use spandrel_engine::graph::document::{Document, RawNode};
use spandrel_engine::graph::{Graph, Plan, Registry, Run};
use spandrel_engine::image::Window;
use spandrel_engine::output;
use spandrel_engine::texture::store;
use spandrel_engine::values::{Delivery, Override};
use std::path::Path;
use std::time::Instant;

use crate::args::{Format, Render, Setting};
use crate::progress::{Detail, Shown};
use crate::{check, exit, print, stats};

pub(crate) fn run(registry: &Registry, args: &Render) -> u8 {
    if let Some(jobs) = args.jobs {
        // Fails only if threads were started before, and then there are some.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(jobs.into()).build_global();
    }
    match render(registry, args) {
        Ok(()) => exit::DONE,
        Err(code) => code,
    }
}

fn render(registry: &Registry, args: &Render) -> Result<(), u8> {
    store().set_limit(args.textures);
    let (graph, outputs) = prepare(registry, args)?;
    let changed = Override {
        size: args.size,
        scale: args.scale,
        window: args.window.map(|[x, y, width, height]| Window { x, y, width, height }),
        no_clobber: args.no_clobber,
    };
    let mut wishes = Wishes::new();
    for output in &outputs {
        wishes.want::<Delivery>(output, changed.clone());
    }
    let plan = Plan::new(&graph, &wishes).map_err(|failure| fail(args, &failure))?;
    if args.dry_run && args.explain {
        print::out(&stats::explanation(&graph, &plan, &[]));
        return Ok(());
    }
    if args.dry_run {
        let mut nodes = plan.nodes(&graph);
        nodes.reverse();
        print::out(&format!("would evaluate: {}\n", nodes.join(", ")));
        return Ok(());
    }
    let detail = Detail::new(args.quiet, args.verbose);
    let shown = Shown::new(detail, plan.nodes(&graph).len());
    let clock = Instant::now();
    let evaluated = Run::new().evaluate(&graph, &plan, &shown);
    shown.clear();
    let seconds = clock.elapsed().as_secs_f64();
    let evaluated = evaluated.map_err(|failure| {
        let written = shown.written();
        if detail != Detail::Quiet && !written.is_empty() {
            print::err(&format!("written before the failure by: {}", written.join(", ")));
        }
        fail(args, &failure)
    })?;
    if args.explain {
        print::out(&stats::explanation(&graph, &plan, &evaluated.reports));
    }
    let textures = store().report();
    if detail != Detail::Quiet && textures.reads > 4 * textures.pictures as u64 {
        print::warning(format!(
            "{} pictures on surfaces were read {} times: more --textures than {} saves time",
            textures.pictures,
            textures.reads,
            print::bytes(args.textures as u64)
        ));
    }
    match args.stats {
        Some(Format::Table) => {
            print::out(&stats::table(&evaluated.reports, seconds));
            if textures.reads > 0 {
                let most = print::bytes(textures.most as u64);
                let reads = textures.reads;
                print::out(&format!("pictures on surfaces: {most} at most, {reads} times read\n"));
            }
        }
        Some(Format::Json) => print::out(&stats::json(&evaluated.reports, seconds)),
        None => {}
    }
    if detail != Detail::Quiet {
        for wish in 0..outputs.len() {
            let Delivery { path, bytes } = &*evaluated.value::<Delivery>(wish);
            print::err(&format!(
                "wrote {} ({})",
                output::tidy(path).display(),
                print::bytes(*bytes)
            ));
        }
        print::err(&format!("done in {}", print::seconds(seconds)));
    }
    Ok(())
}

/// Reads the graph and finds the nodes that write.
fn prepare(registry: &Registry, args: &Render) -> Result<(Graph, Vec<String>), u8> {
    let (mut document, directory) = check::open(&args.graph)?;
    let mut settings = args.set.clone();
    for name in &args.write {
        let Some(raw) = document.nodes.iter().find(|raw| raw.id == *name) else {
            let names = document.nodes.iter().map(|raw| raw.id.as_str());
            let cure = match nearest(name, names.clone()) {
                Some(near) => format!("did you mean {near}?"),
                None => format!("there are {}", list(names)),
            };
            print::error(format!("-w {name}: there is no such node: {cure}"));
            return Err(exit::USAGE);
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
    // A picture that is asked for by name gets a writer of its own.
    let mut outputs = args.write.clone();
    if let (Some(file), [node]) = (&args.output, &args.write[..]) {
        let makes = document.nodes.iter().find(|raw| raw.id == *node);
        let kind = makes.and_then(|raw| registry.kind(&raw.kind));
        if let Some(writer_kind) = kind.and_then(|kind| writer_of(kind.output, file)) {
            let lines =
                if writer_kind == "WriteSpans" { resolved(&document) } else { String::new() };
            document.nodes.push(writer(writer_kind, node, &absolute(file), &lines));
            outputs = vec![WRITER.to_owned()];
        }
    }
    if outputs.is_empty() {
        let writes =
            |raw: &&RawNode| registry.kind(&raw.kind).is_some_and(|kind| kind.output == "File");
        outputs = document.nodes.iter().filter(writes).map(|raw| raw.id.clone()).collect();
    }
    match (&args.output, &outputs[..]) {
        (Some(_), [only]) if only == WRITER => {}
        (Some(file), [only]) => settings.push(Setting {
            node: only.clone(),
            field: "path".to_owned(),
            value: format!("{:?}", absolute(file)),
        }),
        (Some(_), several) => {
            let message = format!(
                "-o names one file, but {} nodes write: choose one with -w: {}",
                several.len(),
                several.join(", ")
            );
            print::error(message);
            return Err(exit::USAGE);
        }
        (None, _) => {}
    }
    check::set(registry, &mut document, &settings)?;
    let graph = check::check(registry, &args.graph, &document, &directory)?;
    if outputs.is_empty() {
        print::error(format!(
            "{} writes nothing: add a Write node, or name a picture with -w NODE -o FILE",
            args.graph.display()
        ));
        return Err(exit::INVALID);
    }
    Ok((graph, outputs))
}

/// The node that writes a picture which is named on the command line.
pub(crate) const WRITER: &str = "file_of_the_command_line";

/// The kind of node that writes a type of value to a file.
fn writer_of(output: &str, file: &Path) -> Option<&'static str> {
    match (output, file.extension().is_some_and(|e| e == "span")) {
        ("Image", false) => Some("Write"),
        ("SpanImage", true) => Some("WriteSpans"),
        _ => None,
    }
}

/// The size and the lines with which the graph's spans are resolved, as fields, if all are resolved alike.
fn resolved(document: &Document) -> String {
    let mut all = document.nodes.iter().filter(|raw| raw.kind == "Resolve").map(|raw| {
        let lines = raw.value("lines").filter(|lines| !lines.starts_with(['A', 'E']));
        let field = |name, value: Option<&str>| {
            value.map_or(String::new(), |value| format!(", {name}: {value}"))
        };
        field("size", raw.value("size")) + &field("lines", lines)
    });
    let first = all.next().unwrap_or_default();
    if all.all(|other| other == first) { first } else { String::new() }
}

fn writer(kind: &str, image: &str, path: &str, fields: &str) -> RawNode {
    RawNode {
        id: WRITER.to_owned(),
        id_span: 0..0,
        kind: kind.to_owned(),
        span: 0..0,
        text: format!("{kind}(image: {image:?}, path: {path:?}{fields})"),
        settings: vec!["-o".to_owned()],
    }
}

/// A path that means the same from the graph's folder.
fn absolute(path: &Path) -> String {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).display().to_string()
}

fn fail(args: &Render, failure: &Failure) -> u8 {
    print::error(format!("{}: {failure}", args.graph.display()));
    exit::of(&failure.error)
}
