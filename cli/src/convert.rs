//! `spandrel convert`.

use spandrel_engine::output::{self, relative};
use spandrel_engine::scene::files::{Named, held};
use spandrel_engine::scene::read::{self, ReadOptions, binary, text};
use spandrel_engine::scene::{Document, Picture};
use spandrel_engine::{Error, Result, open};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::args::Convert;
use crate::{exit, print};

pub(crate) fn run(args: &Convert) -> u8 {
    match convert(args) {
        Ok(bytes) => {
            let size = print::bytes(bytes);
            print::err(&format!("wrote {} ({size})", args.to.display()));
            exit::DONE
        }
        Err(error) => {
            print::error(&error);
            exit::of(&error)
        }
    }
}

fn convert(args: &Convert) -> Result<u64> {
    let to = &args.to;
    let extension = to.extension().and_then(|e| e.to_str()).unwrap_or("");
    if !["ron", "scene"].contains(&extension) {
        return Err(Error::output(to, "scenes are written as text (.ron) or binary (.scene)"));
    }
    if output::real(&args.from) == output::real(to) {
        return Err(Error::output(to, "it is the file that is read: name another"));
    }
    output::check(to)?;
    let reading = read::document(&args.from, &ReadOptions::default())?;
    reading.notes.iter().for_each(print::warning);
    if read::moves(&args.from)? {
        let from = args.from.display();
        print::warning(format!("{from} moves: {} holds what it is at frame 1", to.display()));
    }
    let mut document = Document::clone(&reading.document);
    Move { from: folder(&args.from), to, copies: args.copy_pictures, copied: BTreeMap::new() }
        .files(&mut document)?;
    let contents = written(&document, to, extension == "ron")?;
    output::write(to, |out| out.write_all(&contents).map_err(|e| Error::output(to, e)))
}

/// The contents of a file that is read back to the same scene.
fn written(document: &Document, to: &Path, is_text: bool) -> Result<Vec<u8>> {
    let (contents, again) = if is_text {
        let contents = text::write(document).map_err(|e| Error::output(to, e))?.into_bytes();
        let again = text::parse(to, &contents);
        (contents, again)
    } else {
        let contents = binary::write(document)?;
        let again = binary::parse(to, &contents);
        (contents, again)
    };
    let other = match again {
        Ok(again) if again == *document => return Ok(contents),
        Ok(_) => "it would be read as another scene".to_owned(),
        Err(error) if is_text => format!("{}: convert it to a .scene", error.message()),
        Err(error) => error.message(),
    };
    Err(Error::output(to, format!("this format does not hold the scene: {other}")))
}

fn folder(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}

/// A document that moves from one folder to another, and the files that it names.
struct Move<'a> {
    from: &'a Path,
    /// The new file.
    to: &'a Path,
    copies: bool,
    /// The files that were copied, and their paths as the new file has them.
    copied: BTreeMap<(PathBuf, Option<u32>), String>,
}

impl Move<'_> {
    fn files(&mut self, document: &mut Document) -> Result<()> {
        let stays = output::real(self.from) == output::real(folder(self.to));
        document.visit_files(&mut |mut named| {
            let copies = self.copies && !matches!(named, Named::Scene(_));
            let number = match &named {
                Named::Picture(Picture::Embedded(_, number)) => Some(*number),
                _ => None,
            };
            let Some(path) = named.path_mut() else { return Ok(()) };
            let file = self.from.join(&*path);
            if !file.exists() {
                let message = format!("{}: there is no such file", output::tidy(&file).display());
                if !print::said().warnings.contains(&message) {
                    print::warning(message);
                }
            } else if copies {
                *path = self.copy(&file, number)?;
                let path = path.clone();
                if let Named::Picture(picture @ Picture::Embedded(..)) = named {
                    *picture = Picture::Raw(path);
                }
                return Ok(());
            }
            if !stays && Path::new(&*path).is_relative() {
                *path = slashed(&relative(&file, folder(self.to)));
            }
            Ok(())
        })
    }

    /// Copies a file, or a picture in it, to a folder beside the new file; returns its path from there.
    fn copy(&mut self, file: &Path, number: Option<u32>) -> Result<String> {
        let id = (output::real(file), number);
        if let Some(known) = self.copied.get(&id) {
            return Ok(known.clone());
        }
        let (bytes, name) = match number {
            None => (
                open::bytes(file)?,
                file.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            ),
            Some(number) => {
                let bytes = held(file, number)?;
                let kind = open::kind(&bytes).unwrap_or("");
                let endings = [("PNG", "png"), ("JPEG", "jpg"), ("WebP", "webp")];
                let ending = endings.iter().find(|(name, _)| kind.contains(name));
                let stem = file.file_stem().unwrap_or_default().to_string_lossy();
                (bytes, format!("{stem}_{number}.{}", ending.map_or("bin", |(_, ending)| ending)))
            }
        };
        let stem = self.to.file_stem().unwrap_or_default().to_string_lossy();
        let place = |name: &str| format!("{stem}_pictures/{name}");
        let is_taken = |name: &str| self.copied.values().any(|known| *known == place(name));
        let names = (1..).map(|n| if n == 1 { name.clone() } else { format!("{n}_{name}") });
        let name = { names }.find(|name| !is_taken(name)).expect("there is always another number");
        let path = place(&name);
        let whole = folder(self.to).join(&path);
        if output::real(&whole) != id.0 {
            output::write(&whole, |out| {
                out.write_all(&bytes).map_err(|e| Error::output(&whole, e))
            })?;
        }
        self.copied.insert(id, path.clone());
        Ok(path)
    }
}

/// A path as scenes have it on all systems.
fn slashed(path: &Path) -> String {
    if path.is_absolute() {
        return path.to_string_lossy().into_owned();
    }
    let names: Vec<_> = path.iter().map(|name| name.to_string_lossy()).collect();
    names.join("/")
}
