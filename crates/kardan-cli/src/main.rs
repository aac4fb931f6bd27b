//! The kardan command: from a model file to equations, runs and reports.
//!
//! All that touches files, terminal and processes is here; the library is pure.
#![deny(clippy::disallowed_methods)]

mod args;
mod commands;
mod exit;
mod fault;
mod files;
mod folder;
mod input;
mod lock;
mod output;
mod panics;
mod progress;
mod render;
mod source;
mod stop;
mod watch;

fn main() -> std::process::ExitCode {
    std::process::ExitCode::from(commands::main(std::env::args_os().collect()))
}
