//! The closed loop as a differential equation in one set of modes, and the decisions between modes.

mod connected_law;
mod construction;
mod contact_expressions;
mod contact_modes;
mod derivatives;
mod expansion;
mod expressions;
mod flow;
mod forces;
mod friction_margins;
mod friction_modes;
mod gear_loads;
mod gear_loss_modes;
mod gear_loss_terms;
mod gear_losses;
mod jacobian;
mod jenkins;
mod jenkins_springs;
mod kinks;
mod laws;
mod motor_modes;
mod multiplier_constraints;
mod resolution;
mod resolved;
mod response;
mod series;
mod simd_taylor;
mod sticking_directions;
mod time_discontinuities;
mod timed;
mod torque_distribution;
mod torque_sharing;
mod unilateral_kinds;
mod watched;

pub use connected_law::Setup;
pub use expansion::Prospect;
pub use expressions::Found;
pub(super) use simd_taylor::{Lane, SimdTaylor};
pub(super) use time_discontinuities::Discontinuity;
pub(super) use timed::SAME;
pub(super) use unilateral_kinds::InvalidBound;

use std::ops::Range;

use super::drive::Drive;
use super::friction::{BoxProblem, Mode};
use super::scenario::{Profile, SourceSignal, SourceTarget};
use connected_law::{Computer, ConnectedLaw};
use expansion::Expansion;
use expressions::Places;
use flow::Flow;
use gear_losses::GearLosses;
use jacobian::Jacobian;
use jenkins_springs::JenkinsElements;
use kardan_math::num::{Cholesky, StateArchive};
use kardan_mechanics::reduce::{Dynamics, Work};
use kinks::Kinks;
use resolved::Resolved;
use response::Response;
use timed::Timed;
use torque_distribution::TorqueDistribution;
use unilateral_kinds::Unilaterals;
use watched::WatchedRows;

/// The closed loop: plant, motors, laws and sources, with the current modes.
///
/// State: reduced coordinates, their speeds, states of motors and laws, work of the inputs \[J\], loss \[J\].
pub struct Machine {
    pub(super) dynamics: Dynamics,
    pub(super) work: Work,
    /// Whether motions without inertia are states of first order.
    has_massless: bool,
    /// Frictions of motions without inertia, and all other directions.
    jenkins: JenkinsElements,
    directions: Vec<usize>,
    /// Names of the elements of all directions, those of multiplier constraints last; of the shafts.
    pub(super) names: Vec<String>,
    shaft_names: Vec<String>,
    laws: Vec<ConnectedLaw>,
    /// Whether any of them has its own code that computes at every instant.
    own_laws: bool,
    /// The commands of such laws and of those with a clock.
    zoh_output: Vec<f64>,
    /// The indices of the loop's inputs and outputs.
    places: Places,
    drives: Vec<Drive>,
    pub(super) profiles: Vec<Profile>,
    targets: Vec<SourceTarget>,
    /// Blocks that compute at every instant.
    flow: Option<Flow>,
    /// Functions of time that are added to sources.
    signals: Vec<SourceSignal>,
    /// `(value, slope, start)` of each source in the current segment.
    lines: Vec<(f64, f64, f64)>,
    /// Further time-dependent inputs.
    pub(super) timed: Timed,
    /// Its jumps and kinks.
    pub(super) kinks: Kinks,
    pub(super) modes: Vec<Mode>,
    /// Unilateral and switched constraints, and the largest torques against motion forward and backward of all
    /// directions, N m.
    pub(super) unilaterals: Unilaterals,
    /// The gear losses.
    pub(super) gear_losses: GearLosses,
    bounds: [Vec<f64>; 2],
    /// Independent directions among those that stick.
    pub(super) holding: Vec<usize>,
    /// Directions that stick but depend on the active ones.
    following: Vec<usize>,
    /// Those among them that depend on multiplier constraints alone at this position.
    turning: Vec<usize>,
    /// For each direction whether constraints prescribe its speed, in whole or in part; and whether there is such a
    /// direction.
    moving: Vec<bool>,
    moves: bool,
    /// Reduced coordinates that are exactly at rest, and whether all are.
    still: Vec<usize>,
    at_rest: bool,
    /// The integrator step in which modes are checked: its length, s, and the largest size of each reduced speed at its
    /// two ends, rad/s.
    step_length: f64,
    step_speeds: Vec<f64>,
    degrees_of_freedom: usize,
    size: usize,
    /// Of each source its steps and ramps.
    pub(super) sources: Vec<f64>,
    pub(super) commands: Vec<f64>,
    /// Memory for the rates of the commands: slope of the state, and a state on the way.
    ahead: [Vec<f64>; 2],
    /// Reported torques of the inputs.
    pub(super) torques: Vec<f64>,
    /// Their applied torques: with ripple.
    pub(super) applied: Vec<f64>,
    force: Vec<f64>,
    pub(super) acceleration: Vec<f64>,
    /// H⁻¹ g of each active direction, row by row, and which part of each row is not zero.
    weighted: Vec<f64>,
    weighted_parts: Vec<Range<usize>>,
    active_matrix: Vec<f64>,
    active_factor: Cholesky,
    active_torque: Vec<f64>,
    /// Whether `weighted` and `active_factor` are the same at every position, and computed.
    active_constant: bool,
    active_distribution: bool,
    torque_distribution_unique: bool,
    torque_distribution: TorqueDistribution,
    box_problem: BoxProblem,
    /// Directions that rigidly require two values of one motion, from the last mode selection; for multiplier constraints
    /// the number behind all others.
    pub(super) contradiction: Vec<usize>,
    /// Its events so far, as text.
    happened: Vec<String>,
    scratch: Vec<f64>,
    /// Accelerations and torques for forces at the point of expansion, where there are few coordinates.
    response: Option<Response>,
    /// Series of the motion, where they are requested.
    expansion: Option<Box<Expansion>>,
    /// The data that judge steps, where an operation of the loop is not polynomial.
    resolved: Option<Box<Resolved>>,
    /// Derivatives of the rates, where they are requested.
    jacobian: Option<Box<Jacobian>>,
    /// Evaluations of the equations so far.
    pub(super) evaluated: u64,
    /// Numbers of the multiplier constraints among the directions: behind the frictions.
    pub(super) multiplier_constraints: Range<usize>,
    /// Their values that are monitored from step to step.
    watched: WatchedRows,
    pub(super) friction_torques: Vec<f64>,
}

impl Machine {
    /// All values that the further motion depends on, besides the state itself.
    pub(crate) fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        for mode in &mut self.modes {
            let mut number = *mode as usize;
            archive.count(&mut number);
            *mode = [Mode::Stick, Mode::Forward, Mode::Backward][number.min(2)];
        }
        for list in [&mut self.holding, &mut self.following, &mut self.turning, &mut self.still] {
            archive.counts(list);
        }
        archive.flag(&mut self.at_rest);
        self.unilaterals.archive_state(archive);
        self.watched.archive_state(archive);
        self.prepare_holding();
        self.couple_jenkins();
        archive.number(&mut self.step_length);
        for list in [&mut self.step_speeds, &mut self.active_torque, &mut self.sources, &mut self.commands] {
            archive.numbers(list);
        }
        for (value, slope, start) in &mut self.lines {
            [value, slope, start].into_iter().for_each(|x| archive.number(x));
        }
        self.profiles.iter_mut().for_each(|profile| profile.archive_state(archive));
        self.timed.archive_state(archive);
        self.drives.iter_mut().for_each(|drive| drive.archive_state(archive));
        self.find_what_rests();
        for ConnectedLaw { computer, reference_values, commands, torques, .. } in &mut self.laws {
            [reference_values, commands, torques].into_iter().for_each(|list| archive.numbers(list));
            match computer {
                Computer::Linear(_) | Computer::Inlined(_) => {}
                Computer::Continuous(law) => law.archive_state(archive),
                Computer::SampledRuntime(sampled) => sampled.archive_state(archive),
            }
        }
    }

    /// Number of state variables.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Degrees of freedom.
    pub fn degrees_of_freedom(&self) -> usize {
        self.degrees_of_freedom
    }
}
