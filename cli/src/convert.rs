//! `spandrel convert`.

use spandrel_engine::output;
use spandrel_engine::scene::read::{self, ReadOptions, binary, text};
use spandrel_engine::{Error, Result};
use std::io::Write;

use crate::args::Convert;
use crate::{exit, print};

pub(crate) fn run(args: &Convert) -> u8 {
    match convert(args) {
        Ok((bytes, notes)) => {
            notes.iter().for_each(print::warning);
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

fn convert(args: &Convert) -> Result<(u64, Vec<String>)> {
    let extension = args.to.extension().and_then(|e| e.to_str()).unwrap_or("");
    if !["ron", "scene"].contains(&extension) {
        return Err(Error::output(
            &args.to,
            "scenes are written as text (.ron) or binary (.scene)",
        ));
    }
    let same = |path: &std::path::Path| path.canonicalize().ok();
    if same(&args.from).is_some_and(|from| Some(from) == same(&args.to)) {
        return Err(Error::output(&args.to, "it is the file that is read: name another"));
    }
    let reading = read::document(&args.from, &ReadOptions::default())?;
    let contents = if extension == "ron" {
        text::write(&reading.document)?.into_bytes()
    } else {
        binary::write(&reading.document)?
    };
    let bytes = output::write(&args.to, |out| {
        out.write_all(&contents).map_err(|e| Error::output(&args.to, e))
    })?;
    Ok((bytes, reading.notes))
}
