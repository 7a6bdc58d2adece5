//! `spandrel new`: a studio's program with a node of its own, ready to be built.

use std::path::{Path, PathBuf};

use crate::args::New;
use crate::{exit, print};
use spandrel_engine::{Error, output};
use std::io::Write;

/// Where the sources of this program were when it was built.
const SOURCES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

pub(crate) fn run(args: &New) -> u8 {
    let folder = &args.folder;
    let name = folder.file_name().map(|name| name.to_string_lossy().into_owned());
    let is_name = |name: &str| {
        name.starts_with(|c: char| c.is_ascii_lowercase())
            && name
                .chars()
                .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_".contains(c))
    };
    let Some(name) = name.filter(|name| is_name(name) && name != "spandrel") else {
        print::error(format!(
            "{}: a program's name has small letters, digits, - and _, and begins with a letter, such as studio",
            folder.display()
        ));
        return exit::USAGE;
    };
    if folder.exists() {
        print::error(format!("{} exists already: give another name", folder.display()));
        return exit::USAGE;
    }
    let sources = args.sources.clone().unwrap_or_else(|| PathBuf::from(SOURCES));
    let sources = match sources.canonicalize() {
        Ok(sources) if sources.join("engine/Cargo.toml").is_file() => sources,
        _ => {
            print::error(format!(
                "there are no sources of Spandrel in {}: say where they are with --sources FOLDER",
                sources.display()
            ));
            return exit::INPUT;
        }
    };
    let manifest = manifest(&name, &sources);
    let files = [
        ("Cargo.toml", manifest.as_str()),
        ("src/main.rs", include_str!("main.rs.txt")),
        ("src/tint.rs", include_str!("tint.rs")),
        ("box.ron", include_str!("box.ron")),
        ("graph.ron", include_str!("graph.ron")),
        (".gitignore", "/target\n*.png\n"),
    ];
    for (file, text) in files {
        let path = folder.join(file);
        let written = output::write(&path, |out| {
            out.write_all(text.as_bytes()).map_err(|error| Error::output(&path, error))
        });
        if let Err(error) = written {
            // It is all there or not at all; the folder was not there before.
            let _ = std::fs::remove_dir_all(folder);
            print::error(error.to_string());
            return exit::FAILED;
        }
    }
    let shown = folder.display();
    print::words(&format!(
        "{shown} is a program with a node of its own, Tint, in src/tint.rs. To build it and render its graph:\n    \
         cd {shown}; cargo run --release -- render graph.ron\n"
    ));
    exit::DONE
}

/// The package: it stands on the sources of this program, and on the same versions as they do.
fn manifest(name: &str, sources: &Path) -> String {
    let path = |part: &str| format!("{{ path = {:?} }}", sources.join(part).to_string_lossy());
    let (engine, program) = (path("engine"), path("cli"));
    format!(
        "[package]\nname = {name:?}\nversion = \"0.1.0\"\nedition = \"2024\"\n\n[dependencies]\nschemars = \
         {{ version = \"1.2\", default-features = false, features = [\"derive\", \"std\"] }}\nserde = {{ version = \
         \"1\", features = [\"derive\"] }}\nspandrel = {program}\nspandrel-engine = {engine}\ntypetag = \"0.2\"\n\n\
         # It stands for itself, wherever its folder lies.\n[workspace]\n"
    )
}
