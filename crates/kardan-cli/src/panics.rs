//! Panics in builds that abort on them (`panic = "abort"`), where the library cannot catch those of foreign decoders.
//!
//! kardan checks all known assertions of such decoders before, so no known panic gets here. If one does, the log is damaged in an
//! unknown way; the program reports the same message as in other builds, where it would continue with the rows before.

use kardan::diagnostics::Diagnostic;
use kardan::tables::read as log;

use crate::exit::exit_code;

/// Handles panics of foreign decoders from now on; other panics are handled as before.
pub fn install(json: bool) {
    if cfg!(panic = "unwind") {
        return;
    }
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| match log::decoding() {
        Some(why) => {
            let diagnostic = Diagnostic::error("log::damaged", why.to_string())
                .help("this build of kardan cannot continue after such an error; one with `panic = \"unwind\"` uses the rows before it");
            let code = exit_code(Err(diagnostic.into()), json);
            std::process::exit(code.into());
        }
        None => usual(panic),
    }));
}
