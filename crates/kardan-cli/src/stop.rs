//! Ending early: signals (SIGINT, SIGTERM) and time limits end any command, which writes its partial results.
//!
//! Computations that can be interrupted poll [`reason`] and end by themselves. Others (proofs, eigenvalues, fits) have
//! stored by [`store_partial`] how to show earlier results; after a short grace period this module shows them, and the process
//! ends. Computations without partial results are ended too; those that finish a part first ([`finish_parts`]) are waited for. Files appear
//! complete or not at all, so no partial file remains.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crate::fault;
use crate::output::print;
use crate::render::stderr;

/// Exit code of a command that ended early.
const ENDED_EARLY: u8 = 2;
/// Exit code after a second signal, as shells have it for SIGINT.
const KILLED: i32 = 130;
/// Time that a computation has to react before this module shows its stored results.
const GRACE: Duration = Duration::from_millis(400);
/// Time for a computation that has polled the end and has no stored results.
const PATIENCE: Duration = Duration::from_secs(5);
const SIGNAL: &str = "stopped by a signal (Ctrl-C, SIGINT or SIGTERM)";

/// Shows the partial results of a command, given why it ends, and returns the exit code.
pub type Show = Box<dyn FnOnce(&str) -> u8 + Send>;

static REASON: OnceLock<String> = OnceLock::new();
/// The deadline, and the time limit in seconds.
static LIMIT: OnceLock<(Instant, f64)> = OnceLock::new();
/// Whether a computation has polled the end and now returns its partial results.
static SIGNALLED: AtomicBool = AtomicBool::new(false);
/// Whether the computation ends by itself after its current part, however long that takes.
static FINISHING: AtomicBool = AtomicBool::new(false);
/// Whether the reader of the standard output waits for an object of JSON.
static JSON: AtomicBool = AtomicBool::new(false);
/// The current activity; the writer holds the lock.
static STATE: Mutex<State> = Mutex::new(State { computing: true, partial_output: None });

struct State {
    /// Whether kardan is computing, not writing.
    computing: bool,
    partial_output: Option<Show>,
}

/// Handles signals from now on. If that is not possible, they end the program at once, as without this.
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

/// Why the command has to end now; the caller returns its partial results.
pub fn reason() -> Option<String> {
    if fault::early("asked") {
        request(SIGNAL.into());
    }
    // The thread that waits for the deadline may be late.
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

/// Sets whether kardan computes or writes from now on; stored partial results become obsolete.
pub fn computing(yes: bool) {
    *state() = State { computing: yes, partial_output: None };
}

/// From now on the current part is finished before the end.
pub fn finish_parts() {
    FINISHING.store(true, Ordering::SeqCst);
}

/// Stores how to show the partial results, replacing what was stored before; `None`: all is done.
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

/// Ends a computation that does not end by itself; with `wait` not one that has polled the end and has no stored results.
fn end(reason: &str, wait: bool) {
    // A thread that would write now waits for this lock until the process ends.
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
