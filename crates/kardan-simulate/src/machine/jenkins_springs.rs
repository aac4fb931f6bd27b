//! Friction elements in series with springs on a motion without inertia, and these springs.

use kardan_math::num::rational_to_f64;
use kardan_mechanics::reduce::{MasslessDynamics, Reduced};

/// The friction elements (sliders) of a machine.
pub(super) struct JenkinsElements {
    /// Their numbers among the directions.
    pub directions: Vec<usize>,
    /// S_y over them, row by row.
    pub stiffness: Vec<f64>,
    /// The rate of the torque of each by the speeds of shafts, N m/rad.
    pub rows: Vec<Vec<(usize, f64)>>,
    /// For each reduced coordinate whether a motion without inertia replaces it.
    pub is_state: Vec<bool>,
    /// Pairs whose slips depend on each other, and in the present modes the factor of the first on the speed that the
    /// second would slip with alone.
    pub pairs: Vec<(usize, usize)>,
    pub couplings: Vec<f64>,
}

impl JenkinsElements {
    pub(super) fn new(reduced: &Reduced) -> Self {
        let slips = reduced.massless.iter().flat_map(|one| &one.slips);
        let stiffness = reduced.massless.iter().flat_map(|one| one.stiffness.as_slice());
        let states: Vec<usize> = reduced.massless.iter().flat_map(MasslessDynamics::states).collect();
        let pairs: Vec<(usize, usize)> = reduced.massless.iter().flat_map(MasslessDynamics::coupled_slips).collect();
        Self {
            directions: slips.map(|slip| slip.friction).collect(),
            stiffness: stiffness.map(rational_to_f64).collect(),
            rows: reduced.jenkins_rows(),
            is_state: (0..reduced.degrees_of_freedom()).map(|place| states.contains(&place)).collect(),
            couplings: vec![0.0; pairs.len()],
            pairs,
        }
    }

    /// `T_yᵀ S T_y` of one of them, N m/rad.
    pub(super) fn stiffness(&self, element: usize) -> f64 {
        self.stiffness[element * (self.directions.len() + 1)]
    }
}
