//! Laws as firmware computes them: sample times, blocks, and the steering on a control unit.

#[path = "../common/mod.rs"]
mod common;

mod blocks_between;
mod ecu;
mod programs;
mod regulator_block;
mod runtime_blocks;
mod sampled;
mod sampled_runs;
mod schedule;
