//! Exit codes.

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
