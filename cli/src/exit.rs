//! Exit codes.

use spandrel_engine::output;
use std::path::Path;

use spandrel_engine::Error;

use crate::print;

/// All is done.
pub(crate) const DONE: u8 = 0;
/// Evaluating failed, or something was doubtful and that is denied.
pub(crate) const FAILED: u8 = 1;
/// The command line was wrong.
pub(crate) const USAGE: u8 = 2;
/// The graph is invalid.
pub(crate) const INVALID: u8 = 3;
/// An input is missing or unreadable.
pub(crate) const INPUT: u8 = 4;

/// Some frames failed, and the others were made.
pub(crate) const SOME_FAILED: u8 = 5;

/// The code of a failure while evaluating: an input's fault, or another.
pub(crate) fn of(error: &Error) -> u8 {
    match error {
        Error::File { .. } | Error::Malformed { .. } | Error::Text(_) => INPUT,
        _ => FAILED,
    }
}

/// The code of a command that ends with another: it has failed if it could not print, or if there were warnings and
/// they are denied.
pub(crate) fn settled(code: u8, denies_warnings: bool) -> u8 {
    let warnings = print::said().warnings.len();
    match code {
        DONE if denies_warnings && warnings > 0 => {
            print::error(format!("{}, and --deny-warnings", print::count(warnings, "warning")));
            FAILED
        }
        DONE if print::has_failed() => FAILED,
        code => code,
    }
}

/// Whether a drawing or a table may be written to a file, by its name.
pub(crate) fn check_output(file: &Path, endings: &[&str]) -> Result<(), u8> {
    let ending = file.extension().and_then(|e| e.to_str()).unwrap_or("");
    let wrong = match output::check_name(file) {
        Ok(()) if endings.contains(&ending) => return Ok(()),
        Ok(()) => format!("name a file that ends in .{}", endings.join(", .")),
        Err(message) => message,
    };
    print::error(format!("-o {}: {wrong}", file.display()));
    Err(USAGE)
}
