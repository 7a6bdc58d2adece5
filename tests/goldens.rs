//! Goldens: every picture of the gallery, small, as it was when somebody last looked at it.
//!
//! They say *same*, not *right*; what is right stands in the laws and the known answers. A picture that
//! changed leaves `target/goldens/NAME.png` (expected, eight times the difference, actual) for looking
//! at. `SPANDREL_GOLDENS=update cargo test -p spandrel-tests goldens` takes the new pictures, and
//! fails all the same, so that nobody updates without noticing.

use image::RgbaImage;
use spandrel_engine::graph::demand::Wishes;
use spandrel_engine::graph::document::Document;
use spandrel_engine::graph::report::Progress;
use spandrel_engine::graph::{Graph, Run, Schedule};
use spandrel_engine::image::{Channel, Image, file};
use spandrel_engine::values::{Override, PictureDemand};
use spandrel_tests::data;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

const SIZE: (u32, u32) = (120, 80);

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

/// The warnings of an evaluation.
#[derive(Default)]
struct Warnings(Mutex<Vec<String>>);

impl Progress for Warnings {
    fn warned(&self, node: &str, message: &str) {
        self.0.lock().unwrap().push(format!("{node}: {message}"));
    }
}

/// Renders all pictures of a graph into a folder; returns their names. What is made of them is computed too; nothing
/// of it all may be doubtful.
fn render(path: &Path, folder: &Path) -> Vec<String> {
    let document = Document::parse(&std::fs::read_to_string(path).unwrap()).unwrap();
    let graph = match Graph::check(&document, &spandrel::library(), path.parent().unwrap()) {
        Ok(graph) => graph,
        Err(faults) => panic!("{}: {faults:?}", path.display()),
    };
    // Spans from a file have the size that they have.
    let is_stored = graph.nodes().any(|node| node.kind == "ReadSpans");
    let size = Some(SIZE).filter(|_| !is_stored);
    let changed = Override { size, ..Override::default() };
    let wish = PictureDemand { channels: BTreeSet::from([Channel::Color]), changed };
    let pictures = graph.nodes().filter(|node| ["Resolve", "Refine"].contains(&node.kind));
    let ids: Vec<String> = pictures.map(|node| node.id.to_owned()).collect();
    let mut wishes = Wishes::new();
    let written = graph.nodes().filter(|node| node.kind == "Write").flat_map(|node| node.uses);
    for id in ids.iter().map(String::as_str).chain(written) {
        wishes.want::<Image>(id, wish.clone());
    }
    let plan = Schedule::new(&graph, &wishes).unwrap();
    let warnings = Warnings::default();
    let evaluated = Run::new().evaluate(&graph, &plan, &warnings).unwrap();
    let warnings = warnings.0.into_inner().unwrap();
    assert!(warnings.is_empty(), "{} warns: {warnings:?}", path.display());
    let stem = path.file_stem().unwrap().to_string_lossy();
    let names = ids.iter().enumerate().map(|(i, id)| {
        let name = format!("{stem}.{id}.png");
        file::write(&evaluated.value::<Image>(i), &folder.join(&name), None).unwrap();
        name
    });
    names.collect()
}

/// Writes expected, difference and actual side by side.
fn write_triptych(expected: &RgbaImage, actual: &RgbaImage, path: &Path) {
    let (width, height) =
        (expected.width().max(actual.width()), expected.height().max(actual.height()));
    let at = |picture: &RgbaImage, x, y| picture.get_pixel_checked(x, y).map_or([0; 4], |p| p.0);
    let triptych = RgbaImage::from_fn(width * 3, height, |x, y| {
        let (panel, x) = (x / width, x % width);
        let (a, b) = (at(expected, x, y), at(actual, x, y));
        let apart = |i: usize| a[i].abs_diff(b[i]).saturating_mul(8);
        image::Rgba(match panel {
            0 => a,
            1 => [apart(0), apart(1), apart(2), 255],
            _ => b,
        })
    });
    triptych.save(path).unwrap();
}

#[test]
fn the_gallery_looks_as_it_did() {
    let goldens = repository().join("tests/goldens");
    let folder = repository().join("target/goldens");
    std::fs::create_dir_all(folder.join("actual")).unwrap();
    let updates = std::env::var("SPANDREL_GOLDENS").is_ok_and(|word| word == "update");
    let mut changed = Vec::new();
    let graphs = data::files(&repository().join("graphs"), &[".ron"]);
    for graph in graphs.iter().filter(|path| !path.to_string_lossy().contains("/assets/")) {
        for name in render(graph, &folder.join("actual")) {
            let read = |path: &Path| image::open(path).map(|picture| picture.to_rgba8());
            let path = folder.join("actual").join(&name);
            let actual = read(&path).unwrap();
            let expected = read(&goldens.join(&name)).unwrap_or_default();
            if expected != actual {
                write_triptych(&expected, &actual, &folder.join(&name));
                if updates {
                    std::fs::create_dir_all(&goldens).unwrap();
                    std::fs::copy(&path, goldens.join(&name)).unwrap();
                }
                changed.push(name);
            }
        }
    }
    assert!(changed.is_empty(), "look at target/goldens/: {changed:?} (updated: {updates})");
}
