//! Blocks: the parts of a program of signals, one file for each kind.
//!
//! [`REGISTRY`] is the one list from which the parser, its checks, the manual and the tests are derived. A block with a sample time is one of
//! `kardan-rt`: tracing its code gives expressions ([`Traced`](kardan_expr::expr::Traced)), so that a run, the linearisation of a design
//! and firmware use the same code. Without a sample time it is a differential equation, part of that of the loop.

mod builder;
mod dead_zone;
mod delay;
mod estimate;
mod gain;
mod hold;
mod hysteresis;
mod integrator;
mod lead_lag;
mod low_pass;
mod monitor;
mod observer;
mod pid;
mod rate_limit;
mod rational;
mod saturation;
mod state_machine;
mod table;
mod transfer_function;

pub use builder::{BlockBuilder, BlockKind, BlockOutput, BlockState, Expressions, Guard, List, Rule};
pub use dead_zone::DeadZone;
pub use delay::Delay;
pub use gain::Gain;
pub use hold::Hold;
pub use hysteresis::Hysteresis;
pub use integrator::Integrator;
pub use lead_lag::LeadLag;
pub use low_pass::LowPass;
pub use monitor::Monitor;
pub use observer::ObserverBlock;
pub use pid::Pid;
pub use rate_limit::RateLimit;
pub use saturation::Saturation;
pub use state_machine::{StateMachine, StateMachineTransition};
pub use table::TableBlock;
pub use transfer_function::TransferFunction;

/// All kinds of blocks.
pub const REGISTRY: &[BlockKind] = &[
    gain::GAIN,
    table::TABLE,
    transfer_function::TRANSFER_FUNCTION,
    low_pass::LOW_PASS,
    lead_lag::LEAD_LAG,
    pid::PID,
    integrator::INTEGRATOR,
    rate_limit::RATE_LIMIT,
    saturation::SATURATION,
    dead_zone::DEAD_ZONE,
    hysteresis::HYSTERESIS,
    delay::DELAY,
    hold::HOLD,
    observer::OBSERVER,
    monitor::MONITOR,
    state_machine::STATE_MACHINE,
];

/// The kind with that keyword.
pub fn find(keyword: &str) -> Option<&'static BlockKind> {
    REGISTRY.iter().find(|kind| kind.keyword == keyword)
}
