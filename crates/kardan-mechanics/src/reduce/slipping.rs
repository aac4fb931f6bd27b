//! Motions without inertia on which frictions alone act against springs: how they slip, together where springs couple
//! them.
//!
//! A slipping motion keeps the torques of its springs, `S_y ẏ = r` with `r = −T_yᵀ S q̇` of the other motions. With the
//! set A of those that slip, `ẏ_A = S_AA⁻¹ r_A`, the others are at rest. Relative to the speeds `r_i/S_ii` of each
//! alone these are factors, which are inputs: the set A changes between events.

use super::motion::Motion;
use super::{Kinematics, MasslessDynamics, Reduced, Slip};
use crate::assemble::{DirectionalTerm, SpringLaw};
use kardan_expr::expr::Expr;
use kardan_math::num::{Matrix, Rational, Scalar, dot, kernel, rational_to_f64};

/// Directions without inertia and damping in each of which one friction slips by one; `None` if there are not as many
/// as frictions.
pub(super) fn slips(
    damping: &Matrix<Rational>,
    felt: &Matrix<Rational>,
    directions: &Matrix<Rational>,
    damped: usize,
) -> Option<Matrix<Rational>> {
    let free = kernel(damping);
    let slipping = felt.multiply(&free);
    if damped + free.columns() != directions.columns() || slipping.rows() != slipping.columns() {
        return None;
    }
    let inverse = slipping.solve(&Matrix::identity(slipping.rows()))?;
    Some(directions.multiply(&free.multiply(&inverse)))
}

impl Reduced {
    /// The torque of each slider where it sticks at reduced coordinates `position`, N m: its friction and
    /// `−T_yᵀ(S q − s₀)`.
    pub fn slipping_friction_torques(&self, position: &[f64]) -> Vec<(usize, f64)> {
        let kinematics = Kinematics::at_rest(self, position);
        let slips = self.massless.iter().flat_map(|massless| &massless.slips);
        let jenkins_torques = self.jenkins_shares(&kinematics).into_iter().map(|shares| {
            let torque = |(spring, share): (usize, f64)| {
                let spring = &self.equations.springs[spring];
                let twist = spring.row.iter().map(|(shaft, x)| rational_to_f64(x) * kinematics.angles[*shaft]);
                share * (twist.sum::<f64>() - spring.value.rest.to_f64())
            };
            -shares.into_iter().map(torque).sum::<f64>()
        });
        slips.map(|slip| slip.friction).zip(jenkins_torques).collect()
    }

    /// The rate of the torque of each slider while it sticks by the speeds of the shafts, `−T_yᵀ S`, N m/rad: a row
    /// with its shafts for each.
    pub fn jenkins_rows(&self) -> Vec<Vec<(usize, f64)>> {
        let kinematics = Kinematics::at_rest(self, &vec![0.0; self.degrees_of_freedom()]);
        let row = |shares: Vec<(usize, f64)>| {
            let mut row = vec![0.0; self.equations.coordinates.len()];
            for (spring, share) in shares {
                let spring_row = &self.equations.springs[spring].row;
                spring_row.iter().for_each(|(shaft, x)| row[*shaft] -= share * rational_to_f64(x));
            }
            row.into_iter().enumerate().filter(|(_, x)| *x != 0.0).collect()
        };
        self.jenkins_shares(&kinematics).into_iter().map(row).collect()
    }

    /// For each slider the springs that it twists, and its share of their torque per unit of twist.
    fn jenkins_shares(&self, kinematics: &Kinematics) -> Vec<Vec<(usize, f64)>> {
        let Some(massless) = &self.massless else { return Vec::new() };
        let transform = massless.transform.to_f64();
        let shares = |slip: &Slip| {
            let moved: Vec<f64> = (0..self.degrees_of_freedom()).map(|i| transform[(i, slip.place)]).collect();
            let share = |spring: &DirectionalTerm<SpringLaw>| {
                let component =
                    |(shaft, x): &(usize, Rational)| rational_to_f64(x) * dot(kinematics.row(*shaft), &moved);
                spring.row.iter().map(component).sum::<f64>() * spring.value.stiffness.to_f64()
            };
            let shares = self.equations.springs.iter().map(share).enumerate();
            shares.filter(|(_, share)| *share != 0.0).collect()
        };
        massless.slips.iter().map(shares).collect()
    }
}

impl MasslessDynamics {
    /// Pairs of sliders whose slips depend on each other: those that springs couple, also through others, and each with
    /// itself.
    pub fn coupled_slips(&self) -> Vec<(usize, usize)> {
        let n = self.slips.len();
        // The least number of those that each is coupled with.
        let mut group: Vec<usize> = (0..n).collect();
        for (i, j) in (0..n * n).map(|k| (k / n, k % n)).filter(|(i, j)| !self.stiffness[(*i, *j)].is_zero()) {
            let (from, to) = (group[i].max(group[j]), group[i].min(group[j]));
            group.iter_mut().filter(|own| **own == from).for_each(|own| *own = to);
        }
        let is_uncoupled = |i: usize| group.iter().filter(|own| **own == group[i]).count() == 1;
        (0..n * n).map(|k| (k / n, k % n)).filter(|(i, j)| group[*i] == group[*j] && !is_uncoupled(*i)).collect()
    }

    /// The factors of [`Self::coupled_slips`] where all slip: `S_y⁻¹ diag S_y`.
    pub(super) fn all_slip(&self) -> Vec<Rational> {
        let inverse = self.stiffness.solve(&Matrix::identity(self.slips.len())).expect("a definite matrix is regular");
        let factor = |(i, j): (usize, usize)| inverse[(i, j)].times(&self.stiffness[(j, j)]);
        self.coupled_slips().into_iter().map(factor).collect()
    }
}

impl Motion {
    /// Adds the speeds of slipping motions to those of the shafts, and writes them among the forces; returns the speed
    /// of each if it slipped alone.
    ///
    /// Where a prescribed motion carries a friction, y moves back by as much while that sticks.
    pub(super) fn slip(
        &mut self,
        reduced: &Reduced,
        massless: &MasslessDynamics,
        forces: &mut [Expr],
        (senses, couplings): (&[Expr], &[Expr]),
    ) -> Vec<Expr> {
        let back = |out: &mut Self, slip: &Slip| {
            let row = &reduced.equations.frictions[slip.friction].row;
            let carried = out.sum(row, |out, shaft| out.carried[shaft]);
            out.graph.negate(carried)
        };
        let back: Vec<(usize, Expr)> = massless.slips.iter().map(|slip| (slip.place, back(self, slip))).collect();
        self.add_rates(back.iter().copied().filter(|(_, rate)| !self.graph.is_zero(*rate)).collect());
        let slip_speeds: Vec<Expr> =
            (0..massless.slips.len()).map(|element| self.uncoupled_slip_speed(reduced, massless, element)).collect();
        let pairs = massless.coupled_slips();
        let mut slipping = Vec::new();
        for (element, slip) in massless.slips.iter().enumerate() {
            let own = pairs.iter().zip(couplings).filter(|((i, _), _)| *i == element);
            let terms: Vec<(Expr, Rational)> =
                own.map(|((_, j), factor)| (self.graph.multiply(*factor, slip_speeds[*j]), Rational::ONE)).collect();
            let speed = if terms.is_empty() {
                self.graph.product(&[(senses[slip.friction], 2), (slip_speeds[element], 1)])
            } else {
                let speed = self.graph.sum(Rational::ZERO, &terms);
                self.graph.group(speed)
            };
            slipping.push((slip.place, speed));
        }
        for ((place, speed), (_, back)) in slipping.iter().zip(&back) {
            forces[*place] = self.graph.add(*speed, *back);
        }
        self.add_rates(slipping);
        slip_speeds
    }

    /// `T_yᵀ S x` of a motion that slips, with `of` evaluated for each spring; the springs on it, each with its share.
    fn slip_component(&mut self, reduced: &Reduced, slip: &Slip, of: impl Fn(&mut Self, usize) -> Expr) -> Expr {
        let mut terms = Vec::new();
        for (k, spring) in reduced.equations.springs.iter().enumerate() {
            let Some(share) = self.reduced_row(&spring.row).get(&slip.place).copied() else { continue };
            let share = self.graph.number_of(share).cloned().expect("directions of states are constant");
            terms.push((of(self, k), share));
        }
        self.graph.sum(Rational::ZERO, &terms)
    }

    /// `−T_yᵀ S q̇/S_ii`, the speed of a motion if it slipped alone.
    fn uncoupled_slip_speed(&mut self, reduced: &Reduced, massless: &MasslessDynamics, element: usize) -> Expr {
        let sum = self.slip_component(reduced, &massless.slips[element], |out, k| {
            let spring = &reduced.equations.springs[k];
            let twisting = out.sum(&spring.row, |out, shaft| out.speeds[shaft]);
            out.resisting(twisting, &spring.value.stiffness)
        });
        let scale = Rational::from(-1).over(&massless.stiffness[(element, element)]);
        let speed = self.graph.scale(scale, sum);
        self.graph.group(speed)
    }

    /// For each motion that may slip the torque of its friction, `−T_yᵀ(S q − s₀)`, and the speed that it would slip
    /// with alone.
    pub fn jenkins(&mut self, reduced: &Reduced) -> [Vec<Expr>; 2] {
        let Some(relaxing) = self.relaxing.take() else { return [Vec::new(), Vec::new()] };
        let torque = |out: &mut Self, slip: &Slip| {
            let sum = out.slip_component(reduced, slip, |out, k| out.spring_torque(reduced, k));
            let torque = out.graph.negate(sum);
            out.graph.group(torque)
        };
        let torques = relaxing.massless.slips.iter().map(|slip| torque(self, slip)).collect();
        let slip_speeds = relaxing.slip_speeds.clone();
        self.relaxing = Some(relaxing);
        [torques, slip_speeds]
    }
}
