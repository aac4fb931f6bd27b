//! A sampled law whose commands a blending signal scales.

use std::sync::Arc;

use kardan_rt::Health;

use super::{Block, Clock, ExactLoop, Frozen, Kinks, Law, LinearLaw, Observation, Reference};
use kardan_analysis::OutputSignal;
use kardan_expr::expr::Side;
use kardan_math::num::{Matrix, StateArchive};
use kardan_math::units::Dimension;
use kardan_results::{Design, Physical};
use kardan_schema::schema::Values;

/// The signal that multiplies the commands of a controller, if there is one.
pub fn blending_signal(values: &Values) -> Option<Reference> {
    let physical = Physical::of_unit(&Dimension::NONE.si());
    Reference::of(values, "blending_signal", physical, "share of the controller's commands that is applied".into())
}

/// A law whose commands the last of its references multiplies.
struct BlendedLaw {
    law: Arc<dyn Law>,
    references: Vec<Reference>,
}

/// The law with its commands times what `blending_signal` of its keys names; the law itself where that is left out.
pub fn blending(law: Arc<dyn Law>, values: &Values) -> Arc<dyn Law> {
    let Some(blending_signal) = blending_signal(values) else { return law };
    let references = law.references().iter().cloned().chain([blending_signal]).collect();
    Arc::new(BlendedLaw { law, references })
}

/// A block whose commands the last reference multiplies; it knows the scaled commands of its inputs.
struct BlendedBlock {
    block: Box<dyn Block>,
}

/// The observation of a block without a blending signal, and the share of its commands: from 0 to 1, and 0 where that is not a number.
fn split_share<'a>(observation: Observation<'a>) -> (Observation<'a>, f64) {
    match observation.references.split_last() {
        Some((share, references)) => {
            (Observation { references, ..observation }, if *share > 0.0 { share.min(1.0) } else { 0.0 })
        }
        None => (observation, 0.0),
    }
}

impl Block for BlendedBlock {
    fn command(&mut self, observation: Observation<'_>, out: &mut [f64]) -> bool {
        let (observation, share) = split_share(observation);
        let found = self.block.command(observation, out);
        out.iter_mut().for_each(|command| *command *= share);
        found
    }

    fn states(&mut self, observation: Observation<'_>, torques: &[f64], out: &mut [f64]) -> bool {
        self.block.states(split_share(observation).0, torques, out)
    }

    fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        self.block.archive_state(archive);
    }

    fn health(&self) -> Health {
        self.block.health()
    }
}

/// The linear part with all its commands: to first order the share has no effect there.
fn with_share(law: LinearLaw) -> LinearLaw {
    let wider = |columns: &Matrix<f64>| {
        let last = columns.columns();
        Matrix::from_fn(columns.rows(), last + 1, |i, j| if j < last { columns[(i, j)] } else { 0.0 })
    };
    LinearLaw { references: wider(&law.references), on_references: wider(&law.on_references), ..law }
}

impl Law for BlendedLaw {
    forward! {
        law;
        fn kinks(&self) -> Kinks;
        fn inputs(&self) -> &[String];
        fn states(&self) -> Vec<String>;
        fn estimates(&self) -> Vec<(String, usize)>;
        fn start(&self, angles: &[f64], speeds: &[f64], out: &mut [f64]);
        fn on_full_model(&self) -> bool;
        fn friction_width(&self) -> Option<f64>;
        fn sensors(&self) -> &[OutputSignal];
        fn clock(&self) -> Option<Clock>;
        fn exact(&self) -> Option<ExactLoop>;
        fn keeps(&self) -> Frozen;
        fn describe(&self) -> Design;
    }

    fn on_side(&self, side: &Side) -> Option<Arc<dyn Law>> {
        Some(Arc::new(Self { law: self.law.on_side(side)?, references: self.references.clone() }))
    }

    fn references(&self) -> &[Reference] {
        &self.references
    }

    fn references_at_rest(&self) -> Vec<f64> {
        self.law.references_at_rest().into_iter().chain([1.0]).collect()
    }

    fn block(&self, clock: Option<Clock>) -> Option<Box<dyn Block>> {
        Some(Box::new(BlendedBlock { block: self.law.block(clock)? }))
    }

    fn linear(&self) -> LinearLaw {
        with_share(self.law.linear())
    }

    fn linear_sampled(&self, clock: Clock) -> Option<LinearLaw> {
        Some(with_share(self.law.linear_sampled(clock)?))
    }

    fn is_nonlinear(&self) -> bool {
        true
    }

    fn linear_at(&self, position: &[f64], clock: Option<Clock>) -> Option<LinearLaw> {
        Some(with_share(self.law.linear_at(position, clock)?))
    }
}
