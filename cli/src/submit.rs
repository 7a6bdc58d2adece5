//! `spandrel submit`: a job for farms, by the Open Job Description (2023-09).

use serde_json::{Value as Json, json};
use spandrel_engine::graph::Registry;
use spandrel_engine::{Error, output};
use std::path::Path;

use crate::args::Submit;
use crate::{check, exit, print};

pub(crate) fn run(registry: &Registry, args: &Submit) -> u8 {
    submit(registry, args).err().unwrap_or(exit::DONE)
}

fn submit(registry: &Registry, args: &Submit) -> Result<(), u8> {
    let (mut document, directory) = check::open(&args.graph)?;
    check::set(registry, &mut document, &args.set)?;
    let frames = args.frames.clone().unwrap_or_else(|| check::frames_of(&document));
    // What is wrong is told here, and not by a hundred machines.
    let graph = check::check(registry, &args.graph, &document, &directory, Some(&frames))?;
    let writes = graph.nodes().any(|node| node.output == "File");
    if !writes {
        print::error(format!("{} writes nothing: add a Write node", check::name(&args.graph)));
        return Err(exit::INVALID);
    }
    if check::is_standard(&args.graph) {
        print::error("a farm cannot read the standard input: name a file");
        return Err(exit::USAGE);
    }
    let tasks: Vec<String> =
        frames.chunks(args.chunk as usize).map(|frames| frames.to_string()).collect();
    if tasks.len() > MOST_TASKS {
        print::error(format!(
            "{} tasks: a job has {MOST_TASKS} at most: --chunk {} makes fewer",
            tasks.len(),
            frames.as_slice().len().div_ceil(MOST_TASKS)
        ));
        return Err(exit::USAGE);
    }
    let job = template(args, &tasks);
    let text = format!("{job:#}\n");
    match &args.output {
        None => print::out(&text),
        Some(file) => {
            exit::check_output(file, &["json"])?;
            let written = output::write(file, |out| {
                let written = std::io::Write::write_all(out, text.as_bytes());
                written.map_err(|error| Error::file(file, error))
            });
            written.map_err(|error| {
                print::error(&error);
                exit::of(&error)
            })?;
            print::chat(&format!("wrote {}: {} tasks", file.display(), tasks.len()));
        }
    }
    Ok(())
}

/// The most values that a parameter of a task may have.
const MOST_TASKS: usize = 1024;

fn template(args: &Submit, tasks: &[String]) -> Json {
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let text = |name: &str, value: &str, what: &str| json!({ "name": name, "type": "STRING", "default": value, "description": what });
    // Paths of a template are found from its folder, and lie in it; others are texts.
    let folder = args.output.as_deref().and_then(Path::parent).unwrap_or(Path::new(""));
    let (path, folder) = (absolute(&args.graph), absolute(&folder.join(".")));
    let what = "The graph; its other files are found from its folder";
    let graph = match path.strip_prefix(&folder) {
        Ok(within) => {
            json!({ "name": "Graph", "type": "PATH", "objectType": "FILE", "dataFlow": "IN",
            "default": within.display().to_string(), "description": what })
        }
        Err(_) => text("Graph", &path.display().to_string(), what),
    };
    let name = args.graph.file_stem().map_or("graph".into(), |stem| stem.to_string_lossy());
    let program = text("Program", "spandrel", "The program on the machines of the farm");
    let mut parameters = vec![graph, program];
    let mut arguments: Vec<String> =
        ["render", "{{Param.Graph}}", "-F", "{{Task.Param.Frames}}", "--keep-going"]
            .map(str::to_owned)
            .into();
    let mut amounts = Vec::new();
    if let Some(jobs) = args.jobs {
        arguments.extend(["-j".to_owned(), jobs.to_string()]);
        amounts.push(json!({ "name": "amount.worker.vcpu", "min": jobs }));
    }
    if let Some(memory) = args.memory {
        arguments.extend(["--memory".to_owned(), (memory >> 20).to_string() + "M"]);
        // Beside what is kept, something is in use.
        amounts.push(json!({ "name": "amount.worker.memory", "min": (memory >> 20) + 1024 }));
    }
    if let Some(cache) = &args.cache {
        let folder = absolute(cache).display().to_string();
        parameters.push(text("Cache", &folder, "A folder for results that all machines share"));
        arguments.extend(["--cache", "{{Param.Cache}}"].map(str::to_owned));
    }
    for setting in &args.set {
        arguments.extend(["--set".to_owned(), setting.to_string()]);
    }
    let frames = json!({ "name": "Frames", "type": "STRING", "range": tasks });
    let step = |name: &str, parameters: &[&Json], more: &[String]| {
        let arguments = [&arguments[..], more].concat();
        let action = json!({ "command": "{{Param.Program}}", "args": arguments });
        let mut step = json!({
            "name": name,
            "parameterSpace": { "taskParameterDefinitions": parameters },
            "script": { "actions": { "onRun": action } },
        });
        if !amounts.is_empty() {
            step["hostRequirements"] = json!({ "amounts": amounts });
        }
        step
    };
    let steps = match args.bands {
        None => vec![step("Render", &[&frames], &[])],
        Some(bands) => {
            let band = json!({ "name": "Band", "type": "INT", "range": format!("1-{bands}") });
            let more = ["--band".to_owned(), format!("{{{{Task.Param.Band}}}}/{bands}")];
            let render = step("Bands", &[&frames, &band], &more);
            let more = ["--bands".to_owned(), bands.to_string()];
            let mut join = step("Join", &[&frames], &more);
            join["dependencies"] = json!([{ "dependsOn": "Bands" }]);
            vec![render, join]
        }
    };
    json!({
        "specificationVersion": "jobtemplate-2023-09",
        "name": name,
        "parameterDefinitions": parameters,
        "steps": steps,
    })
}
