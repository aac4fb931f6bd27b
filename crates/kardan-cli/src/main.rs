//! The kardan command: from a model file to equations, runs and reports.
//!
//! All that touches files, terminal and processes is here; the library is pure.

mod analysis_text;
mod args;
mod bench_text;
mod commands;
mod design_text;
mod fault;
mod identify_text;
mod input;
mod layout;
mod output;
mod panics;
mod progress;
mod render;
mod stop;
mod summary;

fn main() -> std::process::ExitCode {
    std::process::ExitCode::from(commands::main(std::env::args_os().collect()))
}
