//! Ending early: signals (SIGINT, SIGTERM) and limits of time end any command, and what it has is written.
//!
//! What can be ended in its middle asks [`reason`] now and then and ends by itself. What cannot (proofs, eigenvalues, fits) has
//! handed over by [`store_partial`] how to show what was finished before; after a short grace that is shown from here, and the process
//! ends. What has nothing to show is ended too, and what finishes a part before it ends ([`finish_parts`]) is waited for. Files appear
//! whole or not at all, so nothing half done is left.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crate::fault;
use crate::output::print;
use crate::render::stderr;

/// Exit code of what ended early.
const ENDED_EARLY: u8 = 2;
/// Exit code after a second signal, as shells have it for SIGINT.
const KILLED: i32 = 130;
/// What a computation gets to answer, before what was kept of it is shown from here.
const GRACE: Duration = Duration::from_millis(400);
/// What one gets that has asked whether to end, and of which nothing was kept.
const PATIENCE: Duration = Duration::from_secs(5);
const SIGNAL: &str = "stopped by a signal (Ctrl-C, SIGINT or SIGTERM)";

/// Shows what is finished of a command, told why it ends, and gives the exit code.
pub type Show = Box<dyn FnOnce(&str) -> u8 + Send>;

static REASON: OnceLock<String> = OnceLock::new();
/// When the time is over, and how many seconds it was.
static LIMIT: OnceLock<(Instant, f64)> = OnceLock::new();
/// Whether something has heard of the end and now keeps what it has.
static SIGNALLED: AtomicBool = AtomicBool::new(false);
/// Whether what is computed ends by itself behind the part that is begun, however long that takes.
static FINISHING: AtomicBool = AtomicBool::new(false);
/// Whether the reader of the standard output waits for an object of JSON.
static JSON: AtomicBool = AtomicBool::new(false);
/// What is done at this moment; locked by the one who writes.
static STATE: Mutex<State> = Mutex::new(State { computing: true, partial_output: None });

struct State {
    /// Whether something is computed, not written.
    computing: bool,
    partial_output: Option<Show>,
}

/// Listens to signals from now on. Where they cannot be heard, they end the program at once, as without this.
pub fn listen(json: bool) {
    JSON.store(json, Ordering::Relaxed);
    let _ = ctrlc::set_handler(|| {
        if REASON.get().is_some() {
            stderr("ended at once\n");
            std::process::exit(KILLED);
        }
        request(SIGNAL.into());
    });
}

/// Ends the command after this time, s.
pub fn limit(seconds: f64) {
    let time = Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
    if let Some(end) = Instant::now().checked_add(time) {
        let _ = LIMIT.set((end, seconds));
    }
    thread::spawn(move || {
        thread::sleep(time);
        request(limit_reached(seconds));
    });
}

fn limit_reached(seconds: f64) -> String {
    format!("the time limit of {seconds} s is reached (`--time-limit`)")
}

/// Why the command is to end now; who asks keeps what it has.
pub fn reason() -> Option<String> {
    if fault::early("asked") {
        request(SIGNAL.into());
    }
    // What waits for the time may be late.
    if let Some((end, seconds)) = LIMIT.get()
        && Instant::now() >= *end
    {
        request(limit_reached(*seconds));
    }
    let reason = REASON.get()?;
    SIGNALLED.store(true, Ordering::SeqCst);
    Some(reason.clone())
}

fn state() -> std::sync::MutexGuard<'static, State> {
    STATE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Says whether something is computed from now on, or written; what was kept is out of date then.
pub fn computing(yes: bool) {
    *state() = State { computing: yes, partial_output: None };
}

/// From now on a part that is begun is finished before the end.
pub fn finish_parts() {
    FINISHING.store(true, Ordering::SeqCst);
}

/// Keeps how to show what is finished, in place of what was kept before; nothing: all of it is done.
pub fn store_partial(show: Option<Show>) {
    let partial_output = show.is_some();
    state().partial_output = show;
    if partial_output && fault::early("kept") {
        request(SIGNAL.into());
        loop {
            thread::park();
        }
    }
}

fn request(reason: String) {
    if REASON.set(reason).is_err() {
        return;
    }
    let reason = REASON.get().map_or("", String::as_str);
    if FINISHING.load(Ordering::SeqCst) {
        stderr(&format!(
            "note: {reason}; kardan finishes and writes the current block of runs (a second signal ends at once and loses that block)\n"
        ));
        return;
    }
    stderr(&format!("note: {reason}; kardan keeps the results until then (a second signal ends at once)\n"));
    thread::spawn(move || {
        thread::sleep(GRACE);
        end(reason, true);
        thread::sleep(PATIENCE);
        end(reason, false);
    });
}

/// Ends a computation that does not end by itself; with `wait` not one that has asked and of which nothing was kept.
fn end(reason: &str, wait: bool) {
    // Whoever would write now waits for this lock, and does not come to it.
    let mut state = state();
    if !state.computing {
        return;
    }
    let code = match state.partial_output.take() {
        Some(show) => show(reason),
        None if wait && SIGNALLED.load(Ordering::SeqCst) => return,
        None => {
            let message = format!("{reason}: this command has no partial results; existing files are complete");
            if JSON.load(Ordering::Relaxed) {
                let _ = print(&(kardan::export::json_error(&message, "", &[]) + "\n"));
            }
            stderr(&format!("error: {message}\n"));
            ENDED_EARLY
        }
    };
    std::process::exit(code.into());
}
