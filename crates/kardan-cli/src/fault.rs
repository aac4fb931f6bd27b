//! Every operation that changes a file passes through this module, so that tests can let each of them fail, or end the process there.
//!
//! In builds with debug assertions `KARDAN_FAULT=fail:N` makes operation N (from 0) fail as on a full disk, a writing one after
//! half of its bytes; `full:N` makes that one and all after it fail; `kill:N` aborts the process there. `kept:N` ends the command, as a signal
//! does, when it stores its partial results for the Nth time, and goes no further; `asked:N` when it checks for the Nth time whether to end.
//! In other builds this has no effect.

use std::io::{self, Write};
#[cfg(debug_assertions)]
use std::sync::atomic::{AtomicUsize, Ordering};

/// Performs an operation that changes files.
pub fn step<T>(operation: impl FnOnce() -> io::Result<T>) -> io::Result<T> {
    match requested_fault() {
        Some(fault) => Err(fault.happens()),
        None => operation(),
    }
}

/// Writes all bytes.
pub fn write(to: &mut impl Write, bytes: &[u8]) -> io::Result<()> {
    let fault = requested_fault();
    let count = if fault.is_some() { bytes.len() / 2 } else { bytes.len() };
    to.write_all(&bytes[..count])?;
    fault.map_or(Ok(()), |fault| Err(fault.happens()))
}

#[derive(Clone, Copy)]
#[cfg_attr(not(debug_assertions), allow(dead_code))]
enum Fault {
    Fails,
    Kills,
}

impl Fault {
    fn happens(self) -> io::Error {
        match self {
            Self::Fails => io::ErrorKind::StorageFull.into(),
            Self::Kills => std::process::abort(),
        }
    }
}

#[cfg(debug_assertions)]
fn requested_fault() -> Option<Fault> {
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    let number = COUNT.fetch_add(1, Ordering::Relaxed);
    let spec = std::env::var("KARDAN_FAULT").ok()?;
    let (what, at) = spec.split_once(':')?;
    match what {
        "fail" if at.parse() == Ok(number) => Some(Fault::Fails),
        "full" if at.parse().is_ok_and(|at: usize| number >= at) => Some(Fault::Fails),
        "kill" if at.parse() == Ok(number) => Some(Fault::Kills),
        _ => None,
    }
}

#[cfg(not(debug_assertions))]
fn requested_fault() -> Option<Fault> {
    None
}

/// Whether the command ends early here: `kept` or `asked`.
#[cfg(debug_assertions)]
pub fn early(what: &str) -> bool {
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    let Ok(spec) = std::env::var("KARDAN_FAULT") else { return false };
    let at = spec.strip_prefix(what).and_then(|rest| rest.strip_prefix(':'));
    at.is_some_and(|at| at.parse() == Ok(COUNT.fetch_add(1, Ordering::Relaxed)))
}

#[cfg(not(debug_assertions))]
pub fn early(_: &str) -> bool {
    false
}
