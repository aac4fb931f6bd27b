//! How accurately and by which method a run is integrated.

use kardan_mechanics::equations::Domain;
use kardan_mechanics::reduce::Reduced;

/// Steps after which a run ends, unless fewer are requested.
const MOST_STEPS: usize = 100_000_000;
/// Absolute error allowed per step in the work of the inputs and in the loss, J per unit of the relative tolerance; it
/// limits steps whose other error estimates are small by accident.
const ENERGY: f64 = 10.0;
/// A charge of a circuit (C), its current (A) and its energy (J) against an angle (rad) and an energy of a drivetrain: the
/// absolute tolerances are smaller by this factor.
const SMALL: f64 = 1e-6;

/// How accurately a run is integrated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Relative error allowed per step.
    pub relative: f64,
    /// Absolute error allowed per step, rad and rad/s.
    pub absolute: f64,
    /// Steps after which a run ends.
    pub most_steps: usize,
    /// How it is integrated.
    pub method: Method,
}

/// How a run is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Always the Runge-Kutta method of order 8 of Dormand and Prince: the reference.
    Dop853,
    /// Taylor series of the loop's expressions, with the order that the tolerance needs. Loops in which a law computes
    /// at every instant, or gears have losses, use the reference.
    #[default]
    Taylor,
    /// Radau IIA of order 5, 9 or 13 with an exact Jacobian, for stiff loops: its steps do not depend on how fast motions decay. Loops in
    /// which a law computes by itself at every instant, by the reference.
    Radau,
    /// Loops that are linear between the breakpoints of the scenario by matrix exponentials, where the end of the run is known
    /// ([`Simulation`](crate::Simulation) goes step by step). Others by Radau IIA where the rates at the start show that this
    /// takes less time, else by Taylor series.
    Automatic,
    /// The same without exponentials: every run goes step by step.
    Stepping,
}

impl Tolerance {
    /// A relative error allowed per step, and a hundredth of it in rad and rad/s.
    ///
    /// ```
    /// use kardan_simulate::Tolerance;
    /// assert_eq!(Tolerance::relative(1e-10), Tolerance::default());
    /// ```
    pub fn relative(relative: f64) -> Self {
        Self { relative, absolute: 1e-2 * relative, most_steps: MOST_STEPS, method: Method::default() }
    }
}

impl Default for Tolerance {
    fn default() -> Self {
        Self::relative(1e-10)
    }
}

/// The absolute error allowed in each state.
pub(crate) fn absolute_tolerances(reduced: &Reduced, tolerance: Tolerance, size: usize) -> Vec<f64> {
    let r = reduced.degrees_of_freedom();
    let mut absolute = vec![tolerance.absolute; size];
    absolute[size - 2..].fill(ENERGY * tolerance.relative);
    for (k, &coordinate) in reduced.coordinates.iter().enumerate() {
        if reduced.equations.domain(coordinate) == Domain::Charge {
            absolute[k] *= SMALL;
            absolute[r + k] *= SMALL;
        }
    }
    if reduced.equations.domains.iter().all(|domain| *domain == Domain::Charge) {
        absolute[size - 2..].fill(SMALL * ENERGY * tolerance.relative);
    }
    absolute
}
