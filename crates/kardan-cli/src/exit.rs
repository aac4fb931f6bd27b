//! How a command ends: its exit code, and its error.

use kardan::diagnostics::Diagnostic;

use crate::output::print;
use crate::render::Failure;
use crate::stop;

/// Exit code: done.
pub const DONE: u8 = 0;
/// Exit code: a requirement of the study failed, or with `--strict` an identification or the numbers of a run are doubtful.
pub const REQUIREMENT_FAILED: u8 = 1;
/// Exit code: bad input, a file that cannot be read or written, a run that failed or whose energy balance does not close, or a command that a limit or a signal ended early.
pub const ERROR: u8 = 2;

/// Exit code of results that may be partial, and may violate requirements.
pub fn verdict(is_whole: bool, passes: bool) -> u8 {
    match (is_whole, passes) {
        (false, _) => ERROR,
        (true, true) => DONE,
        (true, false) => REQUIREMENT_FAILED,
    }
}

/// Prints what a command is about, all of it.
pub fn done(text: &str) -> Result<u8, Failure> {
    print(text)?;
    Ok(DONE)
}

/// The exit code; reports the error, and the reason if the command had to end early.
pub fn exit_code(done: Result<u8, Failure>, json: bool) -> u8 {
    done.unwrap_or_else(|mut failure| {
        if let Some(reason) = stop::reason() {
            let early =
                Diagnostic::error("command::interrupted", format!("{reason}: the results until then are not enough"));
            failure.diagnostics.insert(0, early);
        }
        if json {
            let object = kardan::export::json_error(&failure.message(), failure.text(), &failure.diagnostics);
            let _ = print(&(object + "\n"));
        }
        failure.show();
        ERROR
    })
}
