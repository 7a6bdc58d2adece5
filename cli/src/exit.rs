//! Exit codes.

use spandrel_engine::Error;

/// All is done.
pub(crate) const DONE: u8 = 0;
/// Evaluating failed.
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
        Error::File { .. } | Error::Malformed { .. } => INPUT,
        _ => FAILED,
    }
}
