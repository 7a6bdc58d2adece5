//! Mutations of files of every format that is read. What they must end in: a picture, a scene, a lamp, a graph or
//! spans, or an error that names the file; without a panic, a hang or a huge allocation.
//!
//! Damage knows how each format is built ([`damage`]): counts, lengths and indices lie, and checksums are made
//! right again, so that it reaches what stands behind them. All files are small and made here ([`seeds`]). A run is told
//! by its number: `one(n)` is always the same file.

pub(crate) mod damage;
pub(crate) mod seeds;

use spandrel_engine::graph::Graph;
use spandrel_engine::graph::document::Document;
use spandrel_engine::image::file::{self, Encoded};
use spandrel_engine::light::photometry::Photometry;
use spandrel_engine::moment::Moment;
use spandrel_engine::scene::examine::examine;
use spandrel_engine::scene::read::{self, ReadOptions};
use spandrel_engine::scene::{Object, Shape};
use spandrel_engine::span_file::SpanFile;
use spandrel_engine::volume::decimate::decimate;
use spandrel_engine::volume::{Inside, Volume, isosurface};
use spandrel_engine::{Result, open};
use spandrel_tests::random::Random;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use seeds::Seed;

/// How a run ended, if it ended well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum End {
    /// It was read.
    Made,
    /// It was refused.
    Refused,
    /// A library broke on it, which was told as an error.
    Broke,
}

/// Reads mutated files.
pub(crate) struct Mutations {
    seeds: Vec<Seed>,
    folder: PathBuf,
}

impl Mutations {
    pub(crate) fn new(folder: &Path) -> Mutations {
        Mutations { seeds: seeds::all(folder), folder: folder.to_owned() }
    }

    /// The kinds of files.
    pub(crate) fn kinds(&self) -> usize {
        self.seeds.len()
    }

    /// Checks that every file is sound before it is damaged.
    ///
    /// # Panics
    /// If one is not.
    pub(crate) fn check_sound(&self) {
        for seed in &self.seeds {
            let path = self.write(seed, &seed.bytes);
            let read = read_one(&path);
            assert!(read.is_ok(), "{} is not sound: {read:?}", seed.name);
        }
    }

    /// The name of the file that a run mutates.
    pub(crate) fn name(&self, run: u64) -> &'static str {
        self.seeds[run as usize % self.seeds.len()].name
    }

    /// Mutates a file and reads it: how it ended, or what was wrong with that.
    pub(crate) fn one(&self, run: u64) -> std::result::Result<End, String> {
        let seed = &self.seeds[run as usize % self.seeds.len()];
        let mut random = Random::new(run);
        let bytes = damage::damage(seed.form, &seed.bytes, &mut random);
        let path = self.write(seed, &bytes);
        let read = catch_unwind(AssertUnwindSafe(|| read_one(&path)));
        match read {
            Err(_) => Err("it panics".to_owned()),
            Ok(Ok(())) => Ok(End::Made),
            Ok(Err(error)) if !error.contains("it.") => Err(format!("no file is named: {error}")),
            Ok(Err(error)) if error.contains("its decoder broke") => Ok(End::Broke),
            Ok(Err(_)) => Ok(End::Refused),
        }
    }

    /// Writes a file; returns the one to be opened.
    fn write(&self, seed: &Seed, bytes: &[u8]) -> PathBuf {
        let path = self.folder.join(seed.name);
        std::fs::write(&path, bytes).expect("a file can be written");
        match &seed.opened_by {
            Some((name, bytes)) => {
                let path = self.folder.join(name);
                std::fs::write(&path, bytes).expect("a file can be written");
                path
            }
            None => path,
        }
    }
}

/// Opens a file as the program does.
fn read_one(path: &Path) -> std::result::Result<(), String> {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    let read = match ending {
        "png" | "jpg" | "exr" | "tif" | "webp" | "bmp" | "tga" | "hdr" => {
            let texels = Encoded::open(path).and_then(|picture| picture.texels(false)).map(drop);
            let image = file::read(path).map(drop);
            texels.and(image)
        }
        "ies" | "ldt" => Photometry::read(path).map(|lamp| {
            assert!(lamp.flux() >= 0.0, "a lamp of {} lm", lamp.flux());
        }),
        "span" => SpanFile::open(path, None).and_then(|file| file.read(file.rows())).map(drop),
        "nrrd" | "cube" => volume(path),
        "graph" => return graph(path),
        _ => scene(path),
    };
    read.map_err(|error| error.to_string())
}

/// Reads a volume and makes a surface in the middle of its values.
fn volume(path: &Path) -> Result<()> {
    let volume = Volume::read(path, None)?;
    if let Some((low, high)) = volume.range() {
        let middle = f64::from(low) / 2.0 + f64::from(high) / 2.0;
        let finer = if volume.samples().len() < 1000 { volume.resampled(0.5)? } else { volume };
        if middle.is_finite() {
            let mesh = isosurface(&finer, middle, Inside::Above)?;
            mesh.validate()?;
            decimate(&mesh, 0.3)?;
        }
    }
    Ok(())
}

fn scene(path: &Path) -> Result<()> {
    fn look(object: &Object) {
        if let Shape::Faces(mesh) = &object.shape {
            let _ = examine(mesh);
        }
        object.children.iter().for_each(look);
    }
    let document = read::document(path, &ReadOptions::default())?.document;
    for plan in &document.plans {
        look(&plan.root);
        plan.definitions.values().for_each(look);
    }
    read::scene(path, None, "it", &ReadOptions::default())?;
    if read::moves(path)? {
        let moment = Some(Moment::default());
        read::document(path, &ReadOptions { moment, ..ReadOptions::default() })?;
    }
    Ok(())
}

/// Diagnostics of graphs have no file, which the command line adds.
fn graph(path: &Path) -> std::result::Result<(), String> {
    let bytes = open::bytes(path).map_err(|error| error.to_string())?;
    let text = open::text(path, &bytes).map_err(|error| error.to_string())?;
    let told = |faults: Vec<_>| format!("it.graph: {} faults", faults.len());
    let document = Document::parse(&text.text).map_err(told)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    Graph::check(&document, &spandrel::library(), folder).map(drop).map_err(told)
}
