//! Motions without inertia that dampers or friction elements determine: states of first order.

use std::collections::BTreeMap;

use super::equilibrium_rows::row_dot;
use super::motion::{Motion, Relaxing, SparseRow};
use super::slipping::slips;
use super::{LawSlopes, MasslessDynamics, OperatingPoint, Reduced, Slip, is_linear_law, law_slopes_at, linearise};
use crate::assemble::DirectionalTerm;
use crate::equations::UnilateralConstraint;
use kardan_expr::expr::{Expr, Graph};
use kardan_math::num::{
    Definiteness, Matrix, Rational, Scalar, definiteness, dense_rows, dot, kernel, reduced_form, side_by_side,
};
use kardan_math::units::Exact;

/// Why motions without inertia cannot be states of first order.
#[derive(Debug, Clone, PartialEq)]
pub enum NoMasslessDynamics {
    /// Torques of expressions act on them or depend on them, otherwise than linearly on speeds.
    Laws(Vec<String>),
    /// The ratio of a transmission changes with its angle.
    PositionDependent,
    /// Frictions act on them beside dampers, or more frictions than there are motions.
    Friction {
        /// Elements of the frictions.
        frictions: Vec<String>,
        /// Elements of dampers on them.
        dampers: Vec<String>,
    },
    /// Springs couple a slipping motion to a first-order one: these frictions.
    Coupled(Vec<String>),
    /// Frictions on them have a breakaway torque above the sliding torque.
    Falls(Vec<String>),
    /// Frictions slip on them without any spring.
    Slides(Vec<String>),
    /// A constraint enforced by a multiplier depends on them: its element.
    MultiplierConstraint(String),
    /// A unilateral or switched constraint acts on them or depends on them, or gear losses act beside sliding
    /// frictions: these elements.
    Unilaterals(Vec<String>),
    /// Frictions alone balance inputs on them.
    Driven {
        /// Elements of the frictions.
        frictions: Vec<String>,
        /// Elements of the inputs.
        inputs: Vec<String>,
    },
    /// The coordinates named by the user move without inertia together with others.
    Coordinates,
    /// The damping on them is not positive definite.
    Damping,
}

/// Rows of terms over the reduced coordinates.
fn projected<T>(terms: &[DirectionalTerm<T>], basis: &Matrix<Rational>) -> Matrix<Rational> {
    dense_rows(terms, basis.rows()).multiply(basis)
}

/// Whether a row has a part in one of these directions, columns over all coordinates.
fn is_felt(row: &[(usize, Rational)], directions: &Matrix<Rational>) -> bool {
    (0..directions.columns()).any(|column| !row_dot(row, directions, column).is_zero())
}

/// Frictions on motions of all coordinates, with the dampers there.
fn friction_error(reduced: &Reduced, frictions: Vec<String>, motions: &Matrix<Rational>) -> NoMasslessDynamics {
    let dampers = &reduced.equations.dampers;
    let own = dampers.iter().filter(|damper| is_felt(&damper.row, motions));
    NoMasslessDynamics::Friction { frictions, dampers: own.map(|damper| damper.element.clone()).collect() }
}

/// Separates the motions without inertia of a model from the others, exactly; `None` if there are none.
///
/// Where dampers act on them, they have first-order dynamics; where there are as many frictions as motions and no
/// damper, they slip.
///
/// # Errors
/// [`NoMasslessDynamics`]
pub fn massless_dynamics(reduced: &Reduced) -> Result<Option<MasslessDynamics>, NoMasslessDynamics> {
    let r = reduced.degrees_of_freedom();
    let model = linearise(reduced, &vec![0.0; r]);
    let e = reduced_form(&model.inertia);
    let (slots, directions) = (e.free(), e.kernel());
    if slots.is_empty() {
        return Ok(None);
    }
    if let Some(element) = multiplier_moved_by(reduced, &model.basis.multiply(&directions)) {
        return Err(NoMasslessDynamics::MultiplierConstraint(element));
    }
    if !reduced.equations.transmissions.is_empty() {
        return Err(NoMasslessDynamics::PositionDependent);
    }
    if (0..r).any(|i| !slots.contains(&i) && directions.row(i).iter().any(|x| !x.is_zero())) {
        return Err(NoMasslessDynamics::Coordinates);
    }
    let frictions = &reduced.equations.frictions;
    let sliding = projected(frictions, &model.basis);
    let felt = sliding.multiply(&directions);
    let jenkins: Vec<usize> = (0..frictions.len()).filter(|&k| felt.row(k).iter().any(|x| !x.is_zero())).collect();
    let moved = model.basis.multiply(&directions);
    check_unilaterals(reduced, &moved, !jenkins.is_empty())?;
    check_laws(reduced, &moved, !jenkins.is_empty())?;
    let names = || jenkins.iter().map(|&k| frictions[k].element.clone()).collect::<Vec<_>>();
    let falls = jenkins.iter().map(|&k| &frictions[k]).filter(|friction| friction.value.stribeck.is_some());
    let falls: Vec<String> = falls.map(|friction| friction.element.clone()).collect();
    if !falls.is_empty() {
        return Err(NoMasslessDynamics::Falls(falls));
    }
    let felt = Matrix::from_fn(jenkins.len(), slots.len(), |i, j| felt[(jenkins[i], j)].clone());
    let damped = directions.multiply(&kernel(&felt));
    let across = damped.transpose().multiply(&model.damping);
    let own = across.multiply(&damped);
    let slips = if jenkins.is_empty() {
        Matrix::zeros(r, 0)
    } else {
        slips(&model.damping.multiply(&directions), &felt, &directions, damped.columns())
            .ok_or_else(|| friction_error(reduced, names(), &model.basis.multiply(&directions)))?
    };
    if damped.columns() > 0 && definiteness(&own) != Definiteness::Positive {
        return Err(NoMasslessDynamics::Damping);
    }
    let pushed = model.input.transpose().multiply(&slips);
    let inputs = &reduced.equations.inputs;
    let inputs: Vec<String> = (0..inputs.len())
        .filter(|&k| pushed.row(k).iter().any(|x| !x.is_zero()))
        .map(|k| inputs[k].element.clone())
        .collect();
    if !inputs.is_empty() {
        return Err(NoMasslessDynamics::Driven { frictions: names(), inputs });
    }
    let stiffness = slips.transpose().multiply(&model.stiffness).multiply(&slips);
    let coupled = slips.transpose().multiply(&model.stiffness).multiply(&damped);
    check_slips(&stiffness, &coupled, names)?;
    let compliance = own.solve(&Matrix::identity(own.rows())).expect("a definite matrix is regular");
    let carried = damped.multiply(&compliance.multiply(&across));
    let slid = Matrix::from_fn(jenkins.len(), r, |i, j| sliding[(jenkins[i], j)].clone());
    let carried = carried.plus(&slips.multiply(&slid));
    let states = side_by_side(&[&damped, &slips]);
    let transform = Matrix::from_fn(r, r, |i, j| match slots.binary_search(&j) {
        Ok(column) => states[(i, column)].clone(),
        Err(_) if i == j => Rational::ONE.minus(&carried[(i, j)]),
        Err(_) => Rational::ZERO.minus(&carried[(i, j)]),
    });
    let inverse = transform.solve(&Matrix::identity(r)).expect("columns of two complements");
    let reaction = transform.transpose().multiply(&model.damping).multiply(&damped);
    let (places, slipping) = slots.split_at(damped.columns());
    let slip = |(&place, &friction): (&usize, &usize)| Slip { place, friction };
    Ok(Some(MasslessDynamics {
        places: places.to_vec(),
        slips: slipping.iter().zip(&jenkins).map(slip).collect(),
        stiffness,
        transform,
        inverse,
        compliance,
        reaction,
    }))
}

/// Rejects unilateral and switched constraints on such motions, or dependent on them; and gear losses where frictions
/// slide, which their load may depend on.
fn check_unilaterals(reduced: &Reduced, moved: &Matrix<Rational>, slides: bool) -> Result<(), NoMasslessDynamics> {
    let feels = |shaft: usize| moved.row(shaft).iter().any(|x| !x.is_zero());
    let hinders = |unilateral: &&DirectionalTerm<UnilateralConstraint>| {
        let depends = || unilateral.value.formula().into_iter().flat_map(|formula| formula.coordinates());
        (slides && matches!(unilateral.value, UnilateralConstraint::GearLoss(_)))
            || is_felt(&unilateral.row, moved)
            || depends().filter_map(|name| reduced.coordinate(name)).any(feels)
    };
    let hindering = reduced.equations.unilaterals.iter().filter(hinders).map(|unilateral| unilateral.element.clone());
    let hindering: Vec<String> = hindering.collect();
    if hindering.is_empty() { Ok(()) } else { Err(NoMasslessDynamics::Unilaterals(hindering)) }
}

/// Rejects laws that act on motions without inertia, or depend on them, otherwise than linearly on speeds, or between
/// themselves, or where frictions slide.
fn check_laws(reduced: &Reduced, moved: &Matrix<Rational>, slides: bool) -> Result<(), NoMasslessDynamics> {
    let equations = &reduced.equations;
    let slopes = law_slopes_at(reduced, &OperatingPoint::zero(reduced));
    let hinders = |(k, slopes): (usize, &LawSlopes)| {
        let law = &equations.laws[k];
        let mut coordinates = law.value.coordinates().filter_map(|name| reduced.coordinate(name));
        let depends = coordinates.any(|shaft| moved.row(shaft).iter().any(|x| !x.is_zero()));
        let acts = is_felt(&law.row, moved);
        let apart = !(depends && acts) && slopes.on_positions.is_empty() && is_linear_law(reduced, k);
        (depends || acts) && (slides || !apart)
    };
    let hindering = slopes.iter().enumerate().filter(|one| hinders(*one));
    let hindering: Vec<String> = hindering.map(|(k, _)| equations.laws[k].element.clone()).collect();
    if hindering.is_empty() { Ok(()) } else { Err(NoMasslessDynamics::Laws(hindering)) }
}

impl Reduced {
    /// The states of a run at reduced coordinates `position` and speeds `speed`: these, or for motions without inertia
    /// y in place of a speed. The entry of y among the angles contains its integral, which no equation depends on.
    pub fn state(&self, position: &[f64], speed: &[f64]) -> Vec<f64> {
        let mut state = [position, speed].concat();
        let Some(massless) = &self.massless else { return state };
        let (r, inverse) = (position.len(), massless.inverse.to_f64());
        for place in massless.states() {
            (state[place], state[r + place]) = (0.0, dot(inverse.row(place), position));
        }
        state
    }
}

impl MasslessDynamics {
    /// Places of all states y.
    pub fn states(&self) -> impl Iterator<Item = usize> {
        self.places.iter().copied().chain(self.slips.iter().map(|slip| slip.place))
    }

    pub(super) fn is_state(&self, place: usize) -> bool {
        self.states().any(|candidate| candidate == place)
    }

    fn slips_at(&self, place: usize) -> bool {
        self.slips.iter().any(|slip| slip.place == place)
    }
}

impl Motion {
    /// Writes angles, speeds and directions of the reduced coordinates over x and y, while y is at rest.
    pub(super) fn set_relaxing(&mut self, reduced: &Reduced, position: &[Expr], speed: &[Expr]) {
        let Some(massless) = &reduced.massless else { return };
        for (k, &shaft) in reduced.coordinates.iter().enumerate() {
            let (mut angle, mut rate) = (Vec::new(), Vec::new());
            self.basis[shaft].clear();
            for (j, entry) in massless.transform.row(k).iter().enumerate().filter(|(_, entry)| !entry.is_zero()) {
                let is_state = massless.is_state(j);
                angle.push((if is_state { speed[j] } else { position[j] }, entry.clone()));
                if !is_state {
                    rate.push((speed[j], entry.clone()));
                }
                let entry = self.graph.number(entry.clone());
                self.basis[shaft].insert(j, entry);
            }
            self.angles[shaft] = self.graph.sum(Rational::ZERO, &angle);
            self.speeds[shaft] = self.graph.sum(Rational::ZERO, &rate);
        }
    }

    /// The torque of a spring on reduced coordinates: for motions that slip, friction decides.
    pub(super) fn spring_row(reduced: &Reduced, mut row: SparseRow) -> SparseRow {
        if let Some(massless) = &reduced.massless {
            row.retain(|place, _| !massless.slips_at(*place));
        }
        row
    }

    /// A damper: its torque while y is at rest acts on x, and `D_y` takes the role of the inertia of x. On y acts the
    /// prescribed part of its speed; its other effects cancel with others.
    pub(super) fn damp_relaxing(
        &mut self,
        reduced: &Reduced,
        row: &[(usize, Rational)],
        (torque, coefficient): (Expr, &Exact),
        inertia: &mut BTreeMap<(usize, usize), Vec<(Expr, Rational)>>,
    ) {
        let Some(massless) = &reduced.massless else { return };
        let carried = self.sum(row, |out, k| out.carried[k]);
        let carried = self.resisting(carried, coefficient);
        let row = self.reduced_row(row);
        let (first_order, moves): (SparseRow, SparseRow) =
            row.into_iter().partition(|(place, _)| massless.is_state(*place));
        self.passive_terms.add(&mut self.graph, &moves, torque, &Rational::from(-1));
        if !self.graph.is_zero(carried) {
            self.passive_terms.add(&mut self.graph, &first_order, carried, &Rational::from(-1));
        }
        let coefficient = self.exact(coefficient);
        for (i, first) in &first_order {
            for (j, second) in first_order.range(..=i) {
                let product = self.graph.product(&[(coefficient, 1), (*first, 1), (*second, 1)]);
                inertia.entry((*i, *j)).or_default().push((product, Rational::ONE));
            }
        }
    }

    /// Starts the first-order motion: the forces without inputs move y, and every slider that may slip slips.
    pub(super) fn begin_massless_rates(&mut self, reduced: &Reduced) {
        let Some(massless) = &reduced.massless else { return };
        for slip in &massless.slips {
            let one = self.graph.integer(1);
            self.inertia.insert((slip.place, slip.place), one);
        }
        let relaxing =
            Relaxing { massless: massless.clone(), base_speeds: self.speeds.clone(), slip_speeds: Vec::new() };
        self.relaxing = Some(Box::new(relaxing));
        let one = self.graph.integer(1);
        let couplings = massless.all_slip().into_iter().map(|coupling| self.graph.number(coupling)).collect::<Vec<_>>();
        let mut forces = self.passive.clone();
        self.massless_rates(reduced, &mut forces, (&vec![one; reduced.equations.frictions.len()], &couplings));
        let moves = (0..forces.len()).filter(|place| !massless.is_state(*place));
        moves.for_each(|place| self.passive[place] = forces[place]);
    }

    /// Speeds of all shafts with `ẏ = D_y⁻¹ f_y`, from the forces on the reduced coordinates, and of slipping motions,
    /// which are written among the forces too. The effect of ẏ on x through laws is added to the forces. Senses are
    /// those of the frictions' motions, zero where they stick; then the mutual slip factors of sliders that springs
    /// couple ([`MasslessDynamics::coupled_slips`]). Without first-order motions nothing changes.
    pub fn massless_rates(&mut self, reduced: &Reduced, forces: &mut [Expr], slipping: (&[Expr], &[Expr])) {
        let Some(mut relaxing) = self.relaxing.take() else { return };
        let Relaxing { massless, base_speeds, slip_speeds } = &mut *relaxing;
        let rate = |graph: &mut Graph, row: &[Rational]| {
            let terms = massless.places.iter().zip(row).map(|(&place, entry)| (forces[place], entry.clone()));
            let sum = graph.sum(Rational::ZERO, &terms.collect::<Vec<_>>());
            graph.group(sum)
        };
        let rates = massless.places.iter().enumerate();
        let rates: Vec<(usize, Expr)> =
            rates.map(|(k, &place)| (place, rate(&mut self.graph, massless.compliance.row(k)))).collect();
        for place in (0..forces.len()).filter(|place| !massless.is_state(*place)) {
            let shares = massless.reaction.row(place).iter().zip(&rates);
            let shares = shares.filter(|(share, _)| !share.is_zero());
            let mut terms: Vec<(Expr, Rational)> = shares.map(|(share, (_, rate))| (*rate, -share.clone())).collect();
            if !terms.is_empty() {
                terms.push((forces[place], Rational::ONE));
                forces[place] = self.graph.sum(Rational::ZERO, &terms);
            }
        }
        self.speeds.clone_from(base_speeds);
        self.add_rates(rates);
        *slip_speeds = self.slip(reduced, massless, forces, slipping);
        self.laws = reduced.equations.laws.iter().map(|law| self.formula(reduced, &law.value)).collect();
        self.relaxing = Some(relaxing);
    }

    /// Adds rates of states y to the speeds of the shafts.
    pub(super) fn add_rates(&mut self, rates: Vec<(usize, Expr)>) {
        for shaft in 0..self.speeds.len() {
            let mut terms = vec![(self.speeds[shaft], Rational::ONE)];
            for (place, rate) in &rates {
                let Some(entry) = self.basis[shaft].get(place) else { continue };
                let share = self.graph.number_of(*entry).cloned().expect("directions of states are constant");
                terms.push((*rate, share));
            }
            if terms.len() > 1 {
                self.speeds[shaft] = self.graph.sum(Rational::ZERO, &terms);
            }
        }
    }
}

/// The element of a constraint enforced by a multiplier that depends on motions, columns over all coordinates; the
/// first one.
fn multiplier_moved_by(reduced: &Reduced, motions: &Matrix<Rational>) -> Option<String> {
    let equations = &reduced.equations;
    let moves = |shaft: usize| motions.row(shaft).iter().any(|x| !x.is_zero());
    let found = equations
        .multiplier_constraints
        .iter()
        .find(|constraint| equations.coordinates_of_multiplier(&constraint.law).into_iter().any(moves));
    found.map(|constraint| constraint.element.clone())
}

/// Rejects sliders without springs, returning their stiffness, and those that springs couple with first-order motions.
fn check_slips(
    stiffness: &Matrix<Rational>,
    coupled: &Matrix<Rational>,
    names: impl Fn() -> Vec<String>,
) -> Result<(), NoMasslessDynamics> {
    match definiteness(stiffness) {
        _ if stiffness.rows() == 0 => Ok(()),
        Definiteness::Positive if coupled.as_slice().iter().all(Scalar::is_zero) => Ok(()),
        Definiteness::Positive => Err(NoMasslessDynamics::Coupled(names())),
        _ => Err(NoMasslessDynamics::Slides(names())),
    }
}
