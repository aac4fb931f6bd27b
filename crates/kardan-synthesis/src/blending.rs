//! The commands of a sampled law times a blending signal.

use super::matrix_parts::side_by_side;
use super::{Block, LinearLaw, Observation, Reference};
use kardan_math::num::Matrix;
use kardan_math::units::Dimension;
use kardan_results::Physical;
use kardan_schema::schema::Values;

/// The signal that multiplies the commands of a controller, if there is one.
pub fn blending_signal(values: &Values) -> Option<Reference> {
    let physical = Physical::of_unit(&Dimension::NONE.si());
    Reference::of(values, "blending_signal", physical, "share of the controller's commands that is applied".into())
}

/// A block whose commands the last reference multiplies; it knows the scaled commands of its inputs.
pub(super) struct BlendedBlock {
    pub block: Box<dyn Block>,
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

    forward_rest! { block }
}

/// The linear part with all its commands: to first order the share has no effect there.
pub(super) fn with_share(law: LinearLaw) -> LinearLaw {
    let wider = |columns: &Matrix<f64>| side_by_side(&[columns, &Matrix::zeros(columns.rows(), 1)]);
    LinearLaw { references: wider(&law.references), on_references: wider(&law.on_references), ..law }
}
