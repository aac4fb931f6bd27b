//! The candidate locations of `[analysis]` for motors and sensors, ranked.

use crate::study::AnalysisSpec;
use crate::study::check::massless_elimination::Mechanical;
use kardan_analysis::{Candidate, ConstrainedSystem, LinearSystem, Measure, Side, place, structure, with_candidates};
use kardan_math::num::{Matrix, Rational, rational_to_f64};
use kardan_results::signal_name::{Quantity, SignalName};
use kardan_results::{Placement, PlacementSearch, Structure};

/// A state as a combination of angles and speeds.
type Combination = Vec<(String, Rational)>;

/// The criterion for sets of locations of a system with these states.
type Ranking<'a> = dyn FnMut(&[Combination]) -> Option<Measure> + 'a;

/// A system and its candidate locations for motors and sensors.
pub(in crate::study) struct Places<'a> {
    pub spec: &'a AnalysisSpec,
    pub system: &'a ConstrainedSystem,
    pub basis: &'a Matrix<Rational>,
    pub linear: &'a LinearSystem,
    /// For a system with motions without inertia: locations are ranked by the remaining system with them as inputs (outputs).
    pub massless: Option<&'a Mechanical>,
    pub structure: &'a Structure,
}

impl Places<'_> {
    /// Ranks them; notes why motors are not placed.
    pub fn placement(&self, notes: &mut Vec<String>) -> Placement {
        let (spec, r) = (self.spec, self.basis.columns());
        let horizon = spec.horizon.to_f64();
        let motors = spec.actuators.iter().map(|place| Candidate {
            name: place.shaft.clone(),
            cost: place.cost,
            column: self.column(&place.shaft, r),
        });
        let unit = if spec.motion.is_empty() { "rad^2/(N^2 m^2 s)" } else { "N^2 m^2 s" };
        let inputs = self.search(Side::Inputs, motors.collect(), &mut |states| self.reach(states, notes), unit);
        let sensors = spec.sensors.iter().map(|place| {
            let begin = if SignalName::new(&place.signal).is_rate() { r } else { 0 };
            Candidate { name: place.signal.clone(), cost: place.cost, column: self.column(&place.shaft, begin) }
        });
        let unit = if spec.sensors.iter().all(|place| SignalName::new(&place.signal).is(Quantity::Angle)) {
            "s"
        } else {
            "SI"
        };
        let mut show = |states: &[Combination]| Some(scaled(states, horizon.recip()));
        Placement { inputs, outputs: self.search(Side::Outputs, sensors.collect(), &mut show, unit) }
    }

    /// The effect of a motor (sensor) at a shaft, over angles and speeds of the coordinates; starting at `begin`.
    fn column(&self, shaft: &str, begin: usize) -> Vec<Rational> {
        let r = self.basis.columns();
        let row =
            self.system.coordinates.iter().position(|candidate| candidate == shaft).expect("the place was checked");
        let entry = |j: usize| j.checked_sub(begin).filter(|j| *j < r).map(|j| self.basis[(row, j)].clone());
        (0..2 * r).map(|j| entry(j).unwrap_or(Rational::ZERO)).collect()
    }

    fn search(
        &self,
        side: Side,
        mut places: Vec<Candidate>,
        ranking: &mut Ranking<'_>,
        unit: &str,
    ) -> Option<PlacementSearch> {
        if places.is_empty() {
            return None;
        }
        let least = if side == Side::Inputs { self.structure.min_inputs } else { self.structure.min_outputs };
        let (linear, states) = self.with_places(side, &mut places)?;
        let mut out = place(&linear, side, &places, least, self.spec.horizon.to_f64(), &ranking(&states)?)?;
        out.unit = unit.into();
        if out.sets.is_empty() {
            out.infeasible_reason = Some(why_not(&linear, side, &places));
        }
        Some(out)
    }

    /// The system with the columns of the locations, and the composition of its states.
    fn with_places(&self, side: Side, places: &mut [Candidate]) -> Option<(LinearSystem, Vec<Combination>)> {
        let itself = |state: &String| vec![(state.clone(), Rational::ONE)];
        let Some(mechanical) = self.massless else {
            return Some((self.linear.clone(), self.linear.states.iter().map(itself).collect()));
        };
        let columns: Vec<Vec<Rational>> = places.iter().map(|place| place.column.clone()).collect();
        let rest = mechanical.eliminate_for(side, &columns).ok()?;
        let n = rest.system.states.len();
        for (k, place) in places.iter_mut().enumerate() {
            let entry = |i| if side == Side::Inputs { &rest.system.b[(i, k)] } else { &rest.system.c[(k, i)] };
            place.column = (0..n).map(|i| entry(i).clone()).collect();
        }
        let made = |state: &String| {
            let definition = rest.definitions.iter().find(|(name, _)| name == state);
            definition.map_or_else(|| itself(state), |(_, terms)| terms.clone())
        };
        let made = rest.system.states.iter().map(made).collect();
        Some((rest.system, made))
    }

    /// Motors are ranked by the energy of the target motion; without one, by the motion that is hardest to reach.
    fn reach(&self, states: &[Combination], notes: &mut Vec<String>) -> Option<Measure> {
        let motion = &self.spec.motion;
        if motion.is_empty() {
            return Some(scaled(states, self.spec.horizon.to_f64()));
        }
        let mut moved = motion.iter().filter(|(_, value)| *value != 0.0).map(|(name, _)| name);
        if let Some(name) = moved.find(|name| states.iter().flatten().all(|(candidate, _)| candidate != *name)) {
            notes.push(format!(
                "motors are not placed: the target motion names `{name}`, which is no state after the elimination"
            ));
            return None;
        }
        let value = |name: &String| motion.iter().find(|(signal, _)| signal == name).map_or(0.0, |(_, x)| *x);
        let sum = |terms: &Combination| terms.iter().map(|(name, x)| rational_to_f64(x) * value(name)).sum();
        Some(Measure::Energy(states.iter().map(sum).collect()))
    }
}

/// Speeds with this weight count as angles.
fn scaled(states: &[Combination], speed: f64) -> Measure {
    let is_speed = |terms: &Combination| terms.iter().all(|(name, _)| SignalName::new(name).is_rate());
    Measure::SmallestEigenvalue(states.iter().map(|s| if is_speed(s) { speed } else { 1.0 }).collect())
}

/// Why all locations together are not enough: which motions they miss.
fn why_not(system: &LinearSystem, side: Side, places: &[Candidate]) -> String {
    let (what, verb) = if side == Side::Inputs { ("motor", "reach") } else { ("sensor", "show") };
    let missed: Vec<String> = structure(&with_candidates(system, side, places)).map_or_else(
        |_| Vec::new(),
        |found| found.factors.into_iter().filter(|f| f.input_defect > 0).map(|f| f.polynomial).collect(),
    );
    format!(
        "a {what} at every place ({}) does not {verb} the modes that are roots of {}",
        places.iter().map(|place| place.name.as_str()).collect::<Vec<_>>().join(", "),
        missed.join(" and of ")
    )
}
