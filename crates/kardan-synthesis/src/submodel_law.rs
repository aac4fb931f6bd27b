//! A law that was designed on a submodel: its inputs are the angles of the submodel, and it does not know the rest.

use std::sync::Arc;

use super::matrix_parts::spread;
use super::{Block, Clock, ExactLoop, Frozen, Law, LinearLaw, Observation, Reference};
use kardan_analysis::OutputSignal;
use kardan_math::num::Matrix;
use kardan_mechanics::reduce::Reduced;
use kardan_results::Design;

/// A law on a part of a model.
struct SubmodelLaw {
    law: Arc<dyn Law>,
    part: Part,
    /// The elements that the part leaves out, as text.
    excluded: String,
}

/// The locations of the coordinates of a part in the whole model.
#[derive(Debug, Clone)]
struct Part {
    /// Of all its coordinates.
    all: Vec<usize>,
    /// Of its reduced coordinates among the reduced ones.
    reduced: Vec<usize>,
    /// How many coordinates the whole has.
    whole: usize,
}

/// A law of a part of a model as a law of the whole; `excluded` names what is left out.
///
/// # Panics
/// If the part has a coordinate that the whole has not, or reduced coordinates of its own.
pub fn submodel_law(law: Arc<dyn Law>, part: &Reduced, whole: &Reduced, excluded: &str) -> Arc<dyn Law> {
    let place = |name: &String| whole.coordinate(name).expect("a part has coordinates of the whole");
    let names = whole.coordinate_names();
    let among = |name: &String| {
        names.iter().position(|candidate| candidate == name).expect("a part has coordinates of the whole")
    };
    let part = Part {
        all: part.equations.coordinates.iter().map(place).collect(),
        reduced: part.coordinate_names().iter().map(among).collect(),
        whole: whole.equations.coordinates.len(),
    };
    Arc::new(SubmodelLaw { law, part, excluded: excluded.to_string() })
}

impl Part {
    fn of(places: &[usize], values: &[f64], out: &mut Vec<f64>) {
        out.clear();
        out.extend(places.iter().map(|place| values[*place]));
    }

    /// The law of the part, over all coordinates.
    fn linear(&self, law: LinearLaw) -> LinearLaw {
        let over_all = |columns: &Matrix<f64>| spread(columns, &self.all, self.whole);
        LinearLaw {
            angles: over_all(&law.angles),
            speeds: over_all(&law.speeds),
            on_angles: over_all(&law.on_angles),
            on_speeds: over_all(&law.on_speeds),
            ..law
        }
    }
}

/// A block whose inputs are the angles of a submodel.
struct SubmodelBlock {
    block: Box<dyn Block>,
    part: Part,
    angles: Vec<f64>,
    speeds: Vec<f64>,
}

impl SubmodelBlock {
    fn set_inputs(&mut self, observation: &Observation<'_>) {
        Part::of(&self.part.all, observation.angles, &mut self.angles);
        Part::of(&self.part.all, observation.speeds, &mut self.speeds);
    }
}

impl Block for SubmodelBlock {
    fn command(&mut self, observation: Observation<'_>, out: &mut [f64]) -> bool {
        self.set_inputs(&observation);
        self.block.command(Observation { angles: &self.angles, speeds: &self.speeds, ..observation }, out)
    }

    fn states(&mut self, observation: Observation<'_>, torques: &[f64], out: &mut [f64]) -> bool {
        self.set_inputs(&observation);
        self.block.states(Observation { angles: &self.angles, speeds: &self.speeds, ..observation }, torques, out)
    }

    forward_rest! { block }
}

impl Law for SubmodelLaw {
    forward! {
        law;
        fn inputs(&self) -> &[String];
        fn references(&self) -> &[Reference];
        fn references_at_rest(&self) -> Vec<f64>;
        fn states(&self) -> Vec<String>;
        fn estimates(&self) -> Vec<(String, usize)>;
        fn on_full_model(&self) -> bool;
        fn friction_width(&self) -> Option<f64>;
        fn is_nonlinear(&self) -> bool;
        fn sensors(&self) -> &[OutputSignal];
        fn clock(&self) -> Option<Clock>;
        fn exact(&self) -> Option<ExactLoop>;
        fn keeps(&self) -> Frozen;
    }

    fn start(&self, angles: &[f64], speeds: &[f64], out: &mut [f64]) {
        let (mut own, mut rates) = (Vec::new(), Vec::new());
        Part::of(&self.part.all, angles, &mut own);
        Part::of(&self.part.all, speeds, &mut rates);
        self.law.start(&own, &rates, out);
    }

    fn block(&self, clock: Option<Clock>) -> Option<Box<dyn Block>> {
        let block = self.law.block(clock)?;
        Some(Box::new(SubmodelBlock { block, part: self.part.clone(), angles: Vec::new(), speeds: Vec::new() }))
    }

    fn linear(&self) -> LinearLaw {
        self.part.linear(self.law.linear())
    }

    fn linear_sampled(&self, clock: Clock) -> Option<LinearLaw> {
        Some(self.part.linear(self.law.linear_sampled(clock)?))
    }

    fn linear_at(&self, position: &[f64], clock: Option<Clock>) -> Option<LinearLaw> {
        let mut own = Vec::new();
        Part::of(&self.part.reduced, position, &mut own);
        Some(self.part.linear(self.law.linear_at(&own, clock)?))
    }

    fn describe(&self) -> Design {
        let mut design = self.law.describe();
        design.notes.push(format!(
            "its design excludes {}: the proof of the loop applies without them; their effect on the rest is an unknown load",
            self.excluded
        ));
        design
    }
}
