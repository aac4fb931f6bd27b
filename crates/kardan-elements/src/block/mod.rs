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

pub use builder::{BlockBuilder, BlockKind, BlockOutput, BlockState, Expressions, Guard, List};

registry! {
    /// All kinds of blocks.
    BlockKind:
    gain::{Gain} => GAIN,
    table::{TableBlock} => TABLE,
    transfer_function::{TransferFunction} => TRANSFER_FUNCTION,
    low_pass::{LowPass} => LOW_PASS,
    lead_lag::{LeadLag} => LEAD_LAG,
    pid::{Pid} => PID,
    integrator::{Integrator} => INTEGRATOR,
    rate_limit::{RateLimit} => RATE_LIMIT,
    saturation::{Saturation} => SATURATION,
    dead_zone::{DeadZone} => DEAD_ZONE,
    hysteresis::{Hysteresis} => HYSTERESIS,
    delay::{Delay} => DELAY,
    hold::{Hold} => HOLD,
    observer::{ObserverBlock} => OBSERVER,
    monitor::{Monitor} => MONITOR,
    state_machine::{StateMachine, StateMachineTransition} => STATE_MACHINE,
}
