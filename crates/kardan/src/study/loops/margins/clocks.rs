//! The sample times of a loop.

use kardan_model::ControlSpec;
use kardan_synthesis::{Clock, clock};

pub(super) fn clocks(controls: &[ControlSpec]) -> Vec<Option<Clock>> {
    controls.iter().map(|control| clock(&control.values).ok().flatten()).collect()
}

/// The shortest sample time, s.
pub(super) fn shortest(clocks: &[Option<Clock>]) -> f64 {
    clocks.iter().flatten().map(|clock| clock.period).fold(f64::INFINITY, f64::min)
}
