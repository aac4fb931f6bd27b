//! A sampled law whose commands a signal takes away.

use std::sync::Arc;

use kardan_rt::Health;

use super::{Block, Clock, ExactLoop, Kept, Kinks, Law, LinearLaw, Reference, Seen};
use crate::analysis::OutputSignal;
use crate::element::Values;
use crate::expr::Side;
use crate::num::{Keeper, Matrix};
use crate::results::{Design, Physical};
use crate::units::Dimension;

/// The signal that multiplies the commands of a controller, if there is one.
pub fn fade(values: &Values) -> Option<Reference> {
    let description = "share of its commands that a controller gives".to_string();
    Some(Reference { name: values.word("fade")?.into(), physical: Physical::other(&Dimension::NONE.si()), description })
}

/// A law whose commands the last of its references multiplies.
struct Faded {
    law: Arc<dyn Law>,
    references: Vec<Reference>,
}

/// The law with its commands times what `fade` of its keys names; the law itself where that is left out.
pub fn faded(law: Arc<dyn Law>, values: &Values) -> Arc<dyn Law> {
    let Some(fade) = fade(values) else { return law };
    let references = law.references().iter().cloned().chain([fade]).collect();
    Arc::new(Faded { law, references })
}

/// A block whose commands the last reference multiplies; it knows what its inputs really get.
struct FadedBlock {
    block: Box<dyn Block>,
}

/// What a block without a fade sees, and the share of its commands: from 0 to 1, and 0 where that is no number.
fn parted<'a>(seen: Seen<'a>) -> (Seen<'a>, f64) {
    match seen.references.split_last() {
        Some((share, references)) => (Seen { references, ..seen }, if *share > 0.0 { share.min(1.0) } else { 0.0 }),
        None => (seen, 0.0),
    }
}

impl Block for FadedBlock {
    fn command(&mut self, seen: Seen<'_>, out: &mut [f64]) -> bool {
        let (seen, share) = parted(seen);
        let found = self.block.command(seen, out);
        out.iter_mut().for_each(|command| *command *= share);
        found
    }

    fn states(&mut self, seen: Seen<'_>, torques: &[f64], out: &mut [f64]) -> bool {
        self.block.states(parted(seen).0, torques, out)
    }

    fn keep(&mut self, keeper: &mut Keeper<'_>) {
        self.block.keep(keeper);
    }

    fn health(&self) -> Health {
        self.block.health()
    }
}

/// The linear part with all its commands: to first order nothing follows from the share there.
fn with_share(law: LinearLaw) -> LinearLaw {
    let wider = |columns: &Matrix<f64>| {
        let last = columns.columns();
        Matrix::from_fn(columns.rows(), last + 1, |i, j| if j < last { columns[(i, j)] } else { 0.0 })
    };
    LinearLaw { references: wider(&law.references), on_references: wider(&law.on_references), ..law }
}

impl Law for Faded {
    fn kinks(&self) -> Kinks {
        self.law.kinks()
    }

    fn on_side(&self, side: &Side) -> Option<Arc<dyn Law>> {
        Some(Arc::new(Self { law: self.law.on_side(side)?, references: self.references.clone() }))
    }

    fn inputs(&self) -> &[String] {
        self.law.inputs()
    }

    fn references(&self) -> &[Reference] {
        &self.references
    }

    fn references_at_rest(&self) -> Vec<f64> {
        self.law.references_at_rest().into_iter().chain([1.0]).collect()
    }

    fn states(&self) -> Vec<String> {
        self.law.states()
    }

    fn estimates(&self) -> Vec<(String, usize)> {
        self.law.estimates()
    }

    fn start(&self, angles: &[f64], speeds: &[f64], out: &mut [f64]) {
        self.law.start(angles, speeds, out);
    }

    fn block(&self, clock: Option<Clock>) -> Option<Box<dyn Block>> {
        Some(Box::new(FadedBlock { block: self.law.block(clock)? }))
    }

    fn on_full_model(&self) -> bool {
        self.law.on_full_model()
    }

    fn friction_width(&self) -> Option<f64> {
        self.law.friction_width()
    }

    fn linear(&self) -> LinearLaw {
        with_share(self.law.linear())
    }

    fn linear_sampled(&self, clock: Clock) -> Option<LinearLaw> {
        Some(with_share(self.law.linear_sampled(clock)?))
    }

    fn bends(&self) -> bool {
        true
    }

    fn linear_at(&self, position: &[f64], clock: Option<Clock>) -> Option<LinearLaw> {
        Some(with_share(self.law.linear_at(position, clock)?))
    }

    fn sensors(&self) -> &[OutputSignal] {
        self.law.sensors()
    }

    fn clock(&self) -> Option<Clock> {
        self.law.clock()
    }

    fn exact(&self) -> Option<ExactLoop> {
        self.law.exact()
    }

    fn keeps(&self) -> Kept {
        self.law.keeps()
    }

    fn describe(&self) -> Design {
        self.law.describe()
    }
}
