//! Laws as firmware runs them: once every sample time, on readings of sensors, in single or double precision.

use std::sync::Arc;

use crate::blending::{BlendedBlock, with_share};
use crate::{Block, Clock, ExactLoop, Frozen, Law, LinearLaw, Reference};
use kardan_analysis::OutputSignal;
use kardan_results::Design;

/// A law as it runs at a sample time; `None` if its numbers overflow there, or if it is for another sample time.
///
/// The states of a law in continuous time are integrated exactly for signals that are constant over the sample time (zero-order hold).
pub fn sampled(law: Arc<dyn Law>, clock: Clock) -> Option<Arc<dyn Law>> {
    sampled_with(law, clock, None)
}

/// The same, its commands times a blending signal if there is one.
pub(crate) fn sampled_with(law: Arc<dyn Law>, clock: Clock, blending: Option<Reference>) -> Option<Arc<dyn Law>> {
    let linear = law.linear_sampled(clock)?;
    law.block(Some(clock))?;
    let blended = blending.is_some();
    let references = law.references().iter().cloned().chain(blending).collect();
    let linear = if blended { with_share(linear) } else { linear };
    Some(Arc::new(Sampled { law, linear, clock, references, blended }))
}

struct Sampled {
    law: Arc<dyn Law>,
    linear: LinearLaw,
    clock: Clock,
    /// Those of the law, then the blending signal.
    references: Vec<Reference>,
    blended: bool,
}

impl Sampled {
    /// A linear part of the law with the blending signal, if there is one.
    fn blended(&self, linear: LinearLaw) -> LinearLaw {
        if self.blended { with_share(linear) } else { linear }
    }
}

impl Law for Sampled {
    forward! {
        law;
        fn inputs(&self) -> &[String];
        fn sensors(&self) -> &[OutputSignal];
        fn states(&self) -> Vec<String>;
        fn start(&self, angles: &[f64], speeds: &[f64], out: &mut [f64]);
        fn keeps(&self) -> Frozen;
        fn exact(&self) -> Option<ExactLoop>;
        fn describe(&self) -> Design;
    }

    fn references(&self) -> &[Reference] {
        &self.references
    }

    fn references_at_rest(&self) -> Vec<f64> {
        self.law.references_at_rest().into_iter().chain(self.blended.then_some(1.0)).collect()
    }

    fn clock(&self) -> Option<Clock> {
        Some(self.clock)
    }

    fn block(&self, clock: Option<Clock>) -> Option<Box<dyn Block>> {
        let block = self.law.block(clock)?;
        Some(if self.blended { Box::new(BlendedBlock { block }) } else { block })
    }

    fn linear(&self) -> LinearLaw {
        self.linear.clone()
    }

    fn linear_sampled(&self, clock: Clock) -> Option<LinearLaw> {
        Some(self.blended(self.law.linear_sampled(clock)?))
    }

    fn is_nonlinear(&self) -> bool {
        self.blended || self.law.is_nonlinear()
    }

    fn linear_at(&self, position: &[f64], _: Option<Clock>) -> Option<LinearLaw> {
        Some(self.blended(self.law.linear_at(position, Some(self.clock))?))
    }
}
