//! The binary `kardan` as its users meet it.

mod bench;
mod changes;
mod cli;
#[cfg(unix)]
mod cluster;
#[cfg(unix)]
mod damage;
mod design;
mod end_to_end;
mod files;
mod identify;
#[cfg(unix)]
mod limits;
mod plots;
mod readme;
mod safety;
mod schemas;
mod sweep;
mod verdicts;
