//! Laws as firmware runs them: once every sample time, on readings of sensors, in single or double precision.

use std::sync::Arc;

use crate::{Block, Clock, ExactLoop, Frozen, Law, LinearLaw, Reference};
use kardan_analysis::OutputSignal;
use kardan_results::Design;

/// A law as it runs at a sample time; `None` if its numbers overflow there, or if it is for another sample time.
///
/// The states of a law in continuous time are integrated exactly for signals that are constant over the sample time (zero-order hold).
pub fn sampled(law: Arc<dyn Law>, clock: Clock) -> Option<Arc<dyn Law>> {
    let linear = law.linear_sampled(clock)?;
    law.block(Some(clock))?;
    Some(Arc::new(Sampled { law, linear, clock }))
}

struct Sampled {
    law: Arc<dyn Law>,
    linear: LinearLaw,
    clock: Clock,
}

impl Law for Sampled {
    forward! {
        law;
        fn inputs(&self) -> &[String];
        fn references(&self) -> &[Reference];
        fn references_at_rest(&self) -> Vec<f64>;
        fn sensors(&self) -> &[OutputSignal];
        fn states(&self) -> Vec<String>;
        fn start(&self, angles: &[f64], speeds: &[f64], out: &mut [f64]);
        fn block(&self, clock: Option<Clock>) -> Option<Box<dyn Block>>;
        fn linear_sampled(&self, clock: Clock) -> Option<LinearLaw>;
        fn is_nonlinear(&self) -> bool;
        fn keeps(&self) -> Frozen;
        fn exact(&self) -> Option<ExactLoop>;
        fn describe(&self) -> Design;
    }

    fn clock(&self) -> Option<Clock> {
        Some(self.clock)
    }

    fn linear(&self) -> LinearLaw {
        self.linear.clone()
    }

    fn linear_at(&self, position: &[f64], _: Option<Clock>) -> Option<LinearLaw> {
        self.law.linear_at(position, Some(self.clock))
    }
}
