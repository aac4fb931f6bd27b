//! Ending early: signals (SIGINT, SIGTERM) and limits of time end any command, and what it has is written.
//!
//! What takes long and has partial results asks [`reason`] now and then and ends by itself. What has none is ended from
//! here after a short grace; files appear whole or not at all, so nothing half done is left.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use crate::output::print;
use crate::render::stderr;

/// Exit code of what ended early.
const ENDED_EARLY: i32 = 2;
/// Exit code after a second signal, as shells have it for SIGINT.
const KILLED: i32 = 130;
/// What a computation gets to answer, before it is ended from here.
const GRACE: Duration = Duration::from_millis(600);

static REASON: OnceLock<String> = OnceLock::new();
/// Whether something has heard of the end and now keeps what it has.
static HEARD: AtomicBool = AtomicBool::new(false);
/// Whether something is computed, not written.
static COMPUTING: AtomicBool = AtomicBool::new(true);
/// Whether the reader of the standard output waits for an object of JSON.
static JSON: AtomicBool = AtomicBool::new(false);

/// Listens to signals from now on. Where they cannot be heard, they end the program at once, as without this.
pub fn listen(json: bool) {
    JSON.store(json, Ordering::Relaxed);
    let _ = ctrlc::set_handler(|| {
        if REASON.get().is_some() {
            stderr("ended at once\n");
            std::process::exit(KILLED);
        }
        request("stopped by a signal (Ctrl-C, SIGINT or SIGTERM)".into());
    });
}

/// Ends the command after this time, s.
pub fn limit(seconds: f64) {
    thread::spawn(move || {
        thread::sleep(Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX));
        request(format!("the time limit of {seconds} s is reached (`--time-limit`)"));
    });
}

/// Why the command is to end now; who asks keeps what it has.
pub fn reason() -> Option<String> {
    let reason = REASON.get()?;
    HEARD.store(true, Ordering::SeqCst);
    Some(reason.clone())
}

/// Says whether something is computed from now on, or written.
pub fn computing(yes: bool) {
    COMPUTING.store(yes, Ordering::SeqCst);
}

fn request(reason: String) {
    if REASON.set(reason).is_err() {
        return;
    }
    let reason = REASON.get().map_or("", String::as_str);
    stderr(&format!("note: {reason}; what is there is kept (a second signal ends at once)\n"));
    thread::spawn(move || {
        thread::sleep(GRACE);
        if COMPUTING.load(Ordering::SeqCst) && !HEARD.load(Ordering::SeqCst) {
            let message =
                format!("{reason}: this command has no partial results; files that are there already are complete");
            if JSON.load(Ordering::Relaxed) {
                let _ = print(&(kardan::export::json_error(&message, "", &[]) + "\n"));
            }
            stderr(&format!("error: {message}\n"));
            std::process::exit(ENDED_EARLY);
        }
    });
}
