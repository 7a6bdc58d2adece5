//! `spandrel info`: what is in a file, and what is wrong with it.

use spandrel_engine::graph::document::Document as GraphDocument;
use spandrel_engine::graph::{Graph, Registry};
use spandrel_engine::open;
use spandrel_engine::scene::examine::{MeshFault, examine};
use spandrel_engine::scene::read::{self, ReadOptions, Reading};
use spandrel_engine::scene::{Object, Plan, Scene, Shape};
use spandrel_engine::span::Stage;
use spandrel_engine::span_file::SpanFile;
use spandrel_engine::text::Faults;
use spandrel_engine::volume::Volume;
use spandrel_engine::{Error, Result};
use std::borrow::Cow;
use std::collections::{BTreeMap, HashSet};
use std::fmt::Write;
use std::io::Read;
use std::path::Path;

use crate::args::Info;
use crate::contents::Materials;
use crate::{check, contents, exit, lamp, lights, picture, print, volume};

pub(crate) fn run(registry: &Registry, args: &Info) -> u8 {
    if let Some(Err(code)) = args.output.as_ref().map(|file| exit::check_output(file, &["svg"])) {
        return code;
    }
    // What it is, its first bytes say; where they do not, its name.
    let mut start = Vec::new();
    if let Ok(file) = std::fs::File::open(&args.file) {
        let _ = file.take(4096).read_to_end(&mut start);
    }
    let kind = open::kind(&start).or_else(|| open::kind(open::head(&start).as_bytes()));
    let is_called = |ending: &str| args.file.extension().is_some_and(|e| e == ending);
    let is_graph = starts_with_graph(&open::head(&start))
        || is_called("ron") && text(&args.file).is_ok_and(|text| starts_with_graph(&text));
    let is_spans = kind.map_or(is_called("span"), |kind| kind.ends_with("(.span)"));
    let is_lamp = kind.map_or(lamp::is_lamp(&args.file), |kind| kind.ends_with("(IES)"));
    let info = match (is_graph, is_spans, is_lamp) {
        (_, _, true) => lamp::info(&args.file, args.output.as_deref()),
        _ if args.output.is_some() => {
            let file = args.file.display();
            print::error(format!("{file}: only lamps (.ies, .ldt) are drawn: leave out `-o`"));
            return exit::USAGE;
        }
        _ if Volume::is_volume(&start) => volume::info(args),
        _ if !args.level.is_empty() || args.component.is_some() => {
            let file = args.file.display();
            print::error(format!("{file}: it is no volume: leave out `--level` and `--component`"));
            return exit::USAGE;
        }
        (true, ..) => graph(registry, &args.file),
        (_, true, _) => spans(&args.file),
        _ if picture::is_picture(&args.file) => picture::info(&args.file),
        _ => scene(&args.file, args.all),
    };
    match info {
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

/// Whether a text's first word, behind comments, is `Graph`.
fn starts_with_graph(text: &str) -> bool {
    let code =
        text.lines().map(str::trim_start).find(|line| !line.is_empty() && !line.starts_with("//"));
    code.is_some_and(|line| line.starts_with("Graph"))
}

fn text(path: &Path) -> Result<String> {
    let bytes = open::bytes(path)?;
    Ok(open::text(path, &bytes)?.text.into_owned())
}

fn graph(registry: &Registry, path: &Path) -> Result<String> {
    let text = check::text(path)?;
    let mut out = format!("{}: a graph\n", path.display());
    match GraphDocument::parse(&text) {
        Ok(document) => {
            let folder = path.parent().unwrap_or(Path::new(""));
            let graph = Graph::check(&document, registry, folder).ok();
            let lights = graph.as_ref().map(lights::of_graph).unwrap_or_default();
            for node in &document.nodes {
                let about = lights.get(node.id.as_str()).filter(|about| !about.is_empty());
                let about = about.map_or(String::new(), |about| format!(", {about}"));
                let _ = writeln!(out, "  {}: {}{about}", node.id, node.kind);
            }
        }
        Err(list) => {
            let faults = Faults { path: path.to_owned(), text, list };
            return Err(Error::Text(Box::new(faults)));
        }
    }
    let _ = writeln!(out, "`spandrel check` says more");
    Ok(out)
}

fn spans(path: &Path) -> Result<String> {
    let file = SpanFile::open(path, None)?;
    let (view, plan, rows) = (file.view(), file.plan(), file.rows());
    let mut out = format!("{}: an image of spans, written by {}\n", path.display(), file.writer());
    let _ = writeln!(out, "  {}, {plan}, rows {} to {}", view.raster(), rows.start, rows.end);
    let camera = view.camera();
    let [eye, at] =
        [camera.position, camera.look_at].map(|p| format!("({}, {}, {})", p.x, p.y, p.z));
    let lens = match camera.parallel_height {
        Some(height) => format!("parallel, {height} m high"),
        None => format!("{} degrees high", camera.field_of_view),
    };
    let _ = writeln!(out, "  seen from {eye} towards {at}, {lens}");
    let (mut spans, mut segments) = (0, 0);
    for part in SpanFile::parts(&[&file]) {
        let image = file.read(part)?;
        spans += image.lines().items().len() as u64;
        segments += image.layers().items().len() as u64;
    }
    let [head, scenes, lines, faces] = file.bytes();
    let face_count = file.frame().face_count() as u64;
    let per = |bytes: u64, count: u64| bytes as f64 / count.max(1) as f64;
    let _ = writeln!(
        out,
        "  {} spans, {} segments of translucent faces: {}, {:.2} bytes each",
        print::grouped(spans),
        print::grouped(segments),
        print::bytes(lines),
        per(lines, spans + segments)
    );
    let _ = writeln!(
        out,
        "  {} faces: {}, {:.1} bytes each",
        print::grouped(face_count),
        print::bytes(faces),
        per(faces, face_count)
    );
    let _ = writeln!(out, "  head {}, scenes {}", print::bytes(head), print::bytes(scenes));
    let _ = writeln!(out, "sources");
    for source in file.frame().sources() {
        let faces = print::grouped(source.faces.faces().len() as u64);
        let mut stages: Vec<String> = source
            .stack
            .iter()
            .map(|stage| match stage {
                Stage::Shade(shading) => shading.shader().typetag_name().to_owned(),
                Stage::Place(_) => "moved".to_owned(),
                Stage::Kept(_) => "stored as shaded".to_owned(),
            })
            .collect();
        stages.dedup();
        let stack = match stages.is_empty() {
            true => String::new(),
            false => format!(", then {}", stages.join(", ")),
        };
        let matte = if source.matte.is_some() { ", a matte" } else { "" };
        let _ = writeln!(out, "  \"{}\": {faces} faces{stack}{matte}", source.label);
    }
    let mut is_whole = !file.scenes().is_empty();
    for scene in file.scenes() {
        let place = if scene.embedded { "within" } else { "found" };
        let _ = match &scene.missing {
            None => writeln!(out, "scene {}: {place}", scene.path.display()),
            Some(why) => writeln!(out, "scene {}: cannot be used: {why}", scene.path.display()),
        };
        is_whole &= scene.missing.is_none();
    }
    if !is_whole {
        let _ = writeln!(
            out,
            "without its scenes only merging, depth, stored colours and what acts on these work: no light can be set"
        );
        if file.varying() > 0 {
            let _ = writeln!(
                out,
                "the colour of {} faces differs from place to place; one place's is stored",
                print::grouped(file.varying() as u64)
            );
        }
    }
    Ok(out)
}

fn scene(path: &Path, all: bool) -> Result<String> {
    let reading = read::examined(path, &ReadOptions::default())?;
    let document = &reading.document;
    let mut out = format!("{}: a scene\n", path.display());
    let directory = path.parent().unwrap_or(Path::new(""));
    let mut materials = Materials::default();
    let mut notes = Vec::new();
    for plan in &document.plans {
        let scene = Scene::new(document, Some(&plan.name), "", reading.key, directory);
        let scene = scene.map_err(|error| match error {
            Error::Invalid(message) => Error::in_file(path, message),
            other => other,
        })?;
        let _ = writeln!(out, "plan \"{}\"", plan.name);
        describe(&mut out, plan, &scene, &reading);
        contents::objects(&mut out, &scene, all);
        faults(&mut out, plan, &scene);
        materials.of_scene(&scene);
        notes.extend(scene.notes.iter().cloned());
        notes.extend(scene.missing_pictures());
        notes.extend(scene.unreadable_pictures());
    }
    materials.of_file(&document.materials);
    materials.show(&mut out, all);
    for line in &reading.about {
        let _ = writeln!(out, "{line}");
    }
    let mut told = HashSet::new();
    for note in reading.notes.iter().chain(&notes).filter(|note| told.insert(*note)) {
        let _ = writeln!(out, "note: {note}");
    }
    Ok(out)
}

fn describe(out: &mut String, plan: &Plan, scene: &Scene, reading: &Reading) {
    let (mut corners, mut holes, mut seals) = (0, 0, 0);
    let mut low = glam::DVec3::INFINITY;
    let mut high = glam::DVec3::NEG_INFINITY;
    for instance in &scene.instances {
        let mesh = instance.geometry.mesh();
        for face in 0..mesh.face_count() {
            corners += mesh.outline(face).len();
            holes += mesh.holes(face).len();
            seals += mesh.seals(face).len();
        }
        for point in &mesh.points {
            let world = instance.world_from_object.transform_point3(*point);
            low = low.min(world);
            high = high.max(world);
        }
    }
    let faces = scene.face_count();
    let _ = writeln!(
        out,
        "  {}, {} with {}, {}, {}",
        print::count(scene.instances.len(), "object"),
        print::count(faces, "face"),
        print::count(corners, "corner"),
        print::count(holes, "hole"),
        print::count(seals, "seal")
    );
    if faces > 0 {
        let size = high - low;
        let _ = writeln!(
            out,
            "  {:.3} x {:.3} x {:.3} m, from ({:.3}, {:.3}, {:.3}) to ({:.3}, {:.3}, {:.3}), y up",
            size.x, size.y, size.z, low.x, low.y, low.z, high.x, high.y, high.z
        );
        let ground = glam::DVec3::new((low.x + high.x) / 2.0, low.y, (low.z + high.z) / 2.0);
        let origin = reading.in_file(ground).map(|v| ((v * 1e4).round() / 1e4 + 0.0).to_string());
        let _ = writeln!(
            out,
            "  `origin: ({})` in ReadScene puts the middle of its ground at (0, 0, 0)",
            origin.join(", ")
        );
    }
    for (what, names) in [
        ("cameras", plan.cameras.keys().cloned().collect::<Vec<_>>()),
        ("definitions", plan.definitions.keys().cloned().collect()),
    ] {
        if !names.is_empty() {
            let names = names.iter().map(String::as_str);
            let _ = writeln!(out, "  {what}: {}", spandrel_engine::graph::diagnostic::list(names));
        }
    }
    let lights = lights::of_scene(scene);
    if !lights.is_empty() {
        let _ = writeln!(out, "  lights");
        for line in &lights {
            let _ = writeln!(out, "    {line}");
        }
    }
    if let Some(known) = &plan.environment {
        let _ = writeln!(out, "  environment: {}", lights::environment(known));
    }
}

/// What had to be changed, and what is doubtful.
fn faults(out: &mut String, plan: &Plan, scene: &Scene) {
    let mut found: BTreeMap<MeshFault, (usize, String)> = BTreeMap::new();
    let mut visit = |object: &Object, path: &str| {
        // Of the others every corner is ours.
        let mesh = match &object.shape {
            Shape::Faces(mesh) => Cow::Borrowed(mesh),
            shape @ (Shape::Polygon { .. } | Shape::Prism { .. }) => match shape.mesh() {
                Ok(mesh) => Cow::Owned(mesh),
                Err(_) => return,
            },
            _ => return,
        };
        for (face, fault) in examine(&mesh) {
            let first =
                found.entry(fault).or_insert_with(|| (0, format!("face {face} of \"{path}\"")));
            first.0 += 1;
        }
    };
    walk(&plan.root, "", &mut visit);
    plan.definitions.iter().for_each(|(name, object)| walk(object, name, &mut visit));
    for (fault, (count, first)) in &found {
        let times = print::count(*count, "time");
        let _ = writeln!(out, "  {times}: {fault}; first {first}, counted from 0");
    }
    for (path, faults) in scene.faults() {
        if faults.without_area > 0 {
            let dropped = print::count(faults.without_area, "face");
            let _ = writeln!(out, "  \"{path}\": {dropped} without area, left out");
        }
        if faults.not_affine > 0 {
            let n = faults.not_affine;
            let _ =
                writeln!(out, "  \"{path}\": {n} polygons divided so that vertex attributes fit");
        }
        if faults.flattened > 0 {
            let (n, off) = (faults.flattened, faults.worst_deviation);
            let _ = writeln!(
                out,
                "  \"{path}\": {n} faces with seals or drawn edges taken as flat, off by up to {off:.4} m"
            );
        }
    }
}

fn walk(object: &Object, above: &str, visit: &mut impl FnMut(&Object, &str)) {
    let path = match (above, object.name.as_str()) {
        (above, "") => above.to_owned(),
        ("", name) => name.to_owned(),
        (above, name) => format!("{above}/{name}"),
    };
    visit(object, &path);
    object.children.iter().for_each(|child| walk(child, &path, visit));
}
