//! Panics in builds that abort on them (`panic = "abort"`), where the library cannot catch those of foreign decoders.
//!
//! All that such decoders are known to assert is checked before, so none is known that gets here. Should one, the log is damaged in a
//! way that nobody has thought of; the program says the same as in other builds, where it would go on with the rows before.

use kardan::diagnostics::Diagnostic;
use kardan::tables::read as log;

use crate::exit::exit_code;
use crate::render::Failure;

/// Answers panics of foreign decoders from now on; to all others happens what happened before.
pub fn answer(json: bool) {
    if cfg!(panic = "unwind") {
        return;
    }
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| match log::decoding() {
        Some(why) => {
            let diagnostic = Diagnostic::error("log::damaged", why.to_string())
                .help("this build of kardan cannot continue after such an error; one with `panic = \"unwind\"` uses the rows before it");
            let code = exit_code(Err(Failure { source: None, diagnostics: vec![diagnostic] }), json);
            std::process::exit(code.into());
        }
        None => usual(panic),
    }));
}
