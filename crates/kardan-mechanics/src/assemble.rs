//! Assembles named terms into numbered rows: the equations of motion of the unconstrained bodies and their constraints.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::equations::{
    Curve, Direction, Domain, Formula, GROUND, GearLoss, InputKind, Measured, MultiplierLaw, NamedTerm, Sensor,
    Stribeck, Term, UnilateralConstraint,
};
use kardan_expr::expr::OfTime;
use kardan_math::num::{Matrix, Rational, Scalar, dense_rows, rational_from_f64, rational_to_f64, sum_of_outer};
use kardan_math::units::{Dimension, Exact};
use kardan_results::Physical;
use kardan_results::signal_name::Quantity;

/// A law along a numbered direction, with numbers as coefficients or expressions in names.
#[derive(Debug, Clone)]
pub struct DirectionalTerm<T, C = Rational> {
    /// The element it belongs to.
    pub element: String,
    /// `(shaft number, coefficient)`, sorted, no zeros.
    pub row: Vec<(usize, C)>,
    /// The coefficient of the law.
    pub value: T,
}

impl<T> AsRef<[(usize, Rational)]> for DirectionalTerm<T> {
    fn as_ref(&self) -> &[(usize, Rational)] {
        &self.row
    }
}

impl<T> DirectionalTerm<T> {
    /// The row as numbers for fast evaluation.
    pub fn row_f64(&self) -> Vec<(usize, f64)> {
        row_f64(&self.row)
    }
}

/// A row as numbers for fast evaluation.
pub(crate) fn row_f64(row: &[(usize, Rational)]) -> Vec<(usize, f64)> {
    row.iter().map(|(shaft, x)| (*shaft, rational_to_f64(x))).collect()
}

/// A spring's coefficient and relaxed angle.
#[derive(Debug, Clone)]
pub struct SpringLaw<V = Exact> {
    /// N m/rad.
    pub stiffness: V,
    /// rad.
    pub rest: V,
}

/// How the springs and dampers of an element change during a run.
#[derive(Debug, Clone, Default)]
pub struct Weakened {
    /// Change over time of the remaining part of their torques: one plus this.
    pub share: Option<Arc<OfTime>>,
    /// Shift of their relaxed angle over time, rad.
    pub moved: Option<Arc<OfTime>>,
}

/// The torque of a friction at speed, and its law at rest.
#[derive(Debug, Clone)]
pub struct FrictionLaw<V = Exact> {
    /// Coulomb torque, N m.
    pub torque: V,
    /// The higher torque at rest and in slow motion.
    pub stribeck: Option<Stribeck<V>>,
}

/// The kind of a coefficient.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CoefficientKind {
    /// kg m²
    Inertia,
    /// N m s/rad
    Damping,
    /// N m/rad
    Stiffness,
    /// Coulomb torque, N m.
    Friction,
}

impl CoefficientKind {
    /// The key under which elements give it.
    pub fn key(self) -> &'static str {
        match self {
            Self::Inertia => "inertia",
            Self::Damping => "damping",
            Self::Stiffness => "stiffness",
            Self::Friction => "friction",
        }
    }

    /// Its SI unit along coordinates of a domain.
    pub fn unit(self, domain: Domain) -> &'static str {
        let [inertia, damping, stiffness] = domain.units();
        match self {
            Self::Inertia => inertia,
            Self::Damping => damping,
            Self::Stiffness => stiffness,
            Self::Friction => domain.effort().unit(),
        }
    }
}

/// The coefficient of one term.
#[derive(Debug, Clone, PartialEq)]
pub struct TermCoefficient {
    /// `fs.damping`
    pub name: String,
    /// Its kind.
    pub kind: CoefficientKind,
    /// Number of the term among those of its kind.
    pub term: usize,
    /// Its direction over the shafts.
    pub row: Vec<(usize, f64)>,
    /// SI
    pub value: f64,
}

/// A nonlinear transmission between numbered shafts, `q_driven = γ(q_driving)`.
#[derive(Debug, Clone)]
pub struct TransmissionRow {
    /// The element it belongs to.
    pub element: String,
    /// y
    pub driven: usize,
    /// x
    pub driving: usize,
    /// γ
    pub curve: Arc<dyn Curve>,
}

/// A constraint that a run enforces by its multiplier.
#[derive(Debug, Clone)]
pub struct MultiplierConstraint {
    /// The element it belongs to.
    pub element: String,
    /// The constraint over numbered coordinates.
    pub law: MultiplierLaw<usize>,
}

/// A row of speeds that is redundant.
#[derive(Debug, Clone)]
pub struct DependentConstraint {
    /// The row.
    pub row: MultiplierConstraint,
    /// The multiplier rows whose sum it is: elements, with factors.
    pub shares: Vec<(String, Rational)>,
}

/// A torque along a direction around a position at rest: `τ = τ₀ + gᵀ Δq`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RestTorque {
    /// τ₀, N m.
    pub value: f64,
    /// g, N m/rad.
    pub on_positions: Vec<(usize, Rational)>,
}

/// All terms of a model, by kind, over shafts numbered in the order of their names.
///
/// The result does not depend on the order of the file: shafts are sorted by name, terms by the shafts that they act on and by element name.
#[derive(Debug, Clone, Default)]
pub struct Equations {
    /// Names of shafts (their angles, rad) and charges (C), sorted; the coordinates q.
    pub coordinates: Vec<String>,
    /// The domain of each coordinate.
    pub domains: Vec<Domain>,
    /// Quantity of the directions of an element, by its name, where it differs from that of their coordinates.
    pub measures: BTreeMap<String, Domain>,
    /// Nodes of circuits, sorted; the last rows of `constraints` are their balances.
    pub nodes: Vec<String>,
    /// Inertias, kg m².
    pub inertias: Vec<DirectionalTerm<Exact>>,
    /// Springs.
    pub springs: Vec<DirectionalTerm<SpringLaw>>,
    /// Dampers, N m s/rad.
    pub dampers: Vec<DirectionalTerm<Exact>>,
    /// Frictions; each sticks at rest.
    pub frictions: Vec<DirectionalTerm<FrictionLaw>>,
    /// Other unilateral and switched laws: clutches, stops, locks.
    pub unilaterals: Vec<DirectionalTerm<UnilateralConstraint>>,
    /// Linear constraints, first those of elements, then those of nodes; the value is the offset, rad or C.
    pub constraints: Vec<DirectionalTerm<Exact>>,
    /// Right-hand sides of constraints that are functions of time, by element; the value of such a row is that at time zero.
    pub moving: BTreeMap<String, Arc<OfTime>>,
    /// Failures of springs and dampers during a run, by element. Analyses and designs ignore them.
    pub failing: BTreeMap<String, Weakened>,
    /// Constraints that are not solved for a coordinate.
    pub multiplier_constraints: Vec<MultiplierConstraint>,
    /// The redundant ones among them; set in a reduced model.
    pub dependent_constraints: Vec<DependentConstraint>,
    /// Constraints replaced by springs and dampers, which are among `springs` and `dampers` under the same name; the value is the
    /// scale: torque of the spring and damper over it is the multiplier.
    pub compliances: Vec<DirectionalTerm<Exact>>,
    /// Nonlinear transmissions.
    pub transmissions: Vec<TransmissionRow>,
    /// Inputs.
    pub inputs: Vec<DirectionalTerm<InputKind>>,
    /// Torques given by expressions.
    pub laws: Vec<DirectionalTerm<Arc<Formula>>>,
    /// Multiplier torques along coordinates where an analysis freezes rotating rows; empty for a run.
    pub carried: Vec<DirectionalTerm<RestTorque>>,
    /// Whether coordinates without inertia are determined by multiplier rows alone, which then give them inertia (`reduce/multiplier_constraints.rs`).
    pub braced: bool,
    /// Elements whose rows an analysis freezes with rounded coefficients; empty for a run.
    pub rounded: Vec<String>,
    /// Sensors by element name.
    pub sensors: Vec<(String, Sensor)>,
    /// Sensors of signals: only blocks and programs read them.
    pub signal_sensors: Vec<(String, Sensor)>,
    /// Names of coefficients that a run receives at its start: symbols of its equations of motion.
    pub run_parameters: Vec<String>,
}

/// Terms sorted by the names of their elements.
pub(crate) fn by_element(terms: &[NamedTerm]) -> Vec<&NamedTerm> {
    let mut sorted: Vec<&NamedTerm> = terms.iter().collect();
    sorted.sort_by(|a, b| a.element.cmp(&b.element));
    sorted
}

/// Numbers the shafts and sorts the terms of a model.
///
/// A transmission whose curve is exactly a shifted identity becomes a linear constraint.
///
/// # Panics
/// If a term names a shaft that is not in `shafts` (the model checks this before).
pub fn assemble(shafts: &[String], terms: &[NamedTerm]) -> Equations {
    let mut coordinates = shafts.to_vec();
    coordinates.sort();
    let number = |name: &str| {
        let found = coordinates.binary_search_by(|shaft| shaft.as_str().cmp(name));
        found.unwrap_or_else(|_| panic!("no shaft `{name}`"))
    };
    let row = |direction: &Direction| {
        let entries = direction.entries.iter().map(|(name, x)| (number(name), x.to_rational()));
        let mut row: Vec<(usize, Rational)> = entries.filter(|(_, x)| !Scalar::is_zero(x)).collect();
        row.sort_by_key(|(shaft, _)| *shaft);
        row
    };
    let sorted = by_element(terms);
    let mut next = Equations { domains: vec![Domain::Rotation; coordinates.len()], ..Equations::default() };
    let mut balances: BTreeMap<String, BTreeMap<usize, Rational>> = BTreeMap::new();
    for (element, term) in sorted.into_iter().map(|named| (named.element.clone(), &named.term)) {
        match term {
            Term::Inertia { direction, inertia: value } => {
                next.inertias.push(DirectionalTerm { element, row: row(direction), value: value.clone() });
            }
            Term::Spring { direction, stiffness, rest } => {
                let value = SpringLaw { stiffness: stiffness.clone(), rest: rest.clone() };
                next.springs.push(DirectionalTerm { element, row: row(direction), value });
            }
            Term::Damper { direction, damping } => {
                next.dampers.push(DirectionalTerm { element, row: row(direction), value: damping.clone() });
            }
            Term::Friction { direction, torque, stribeck } => {
                let value = FrictionLaw { torque: torque.clone(), stribeck: stribeck.clone() };
                next.frictions.push(DirectionalTerm { element, row: row(direction), value });
            }
            Term::UnilateralConstraint { direction, unilateral } => {
                next.unilaterals.push(DirectionalTerm { element, row: row(direction), value: unilateral.clone() });
            }
            Term::Constraint { direction, offset } => {
                next.constraints.push(DirectionalTerm { element, row: row(direction), value: offset.clone() });
            }
            Term::Compliance { direction, offset, scale, stiffness, damping } => {
                let rest = -&offset.div(scale).unwrap_or_else(Exact::zero);
                let spring = SpringLaw { stiffness: stiffness.clone(), rest };
                let constrained = DirectionalTerm { element, row: row(direction), value: scale.clone() };
                next.add_compliance(constrained, spring, damping);
            }
            Term::Transmission { driven, driving, curve } => match curve.shifted_identity() {
                Some(shift) => {
                    let direction = Direction::difference(driven, Some(driving));
                    let offset = Exact::new(rational_from_f64(shift).unwrap_or_default(), 0);
                    next.constraints.push(DirectionalTerm { element, row: row(&direction), value: offset });
                }
                None => {
                    let (driven, driving, curve) = (number(driven), number(driving), Arc::clone(curve));
                    next.transmissions.push(TransmissionRow { element, driven, driving, curve });
                }
            },
            Term::Input { direction, kind } => {
                next.inputs.push(DirectionalTerm { element, row: row(direction), value: kind.clone() });
            }
            Term::Torque { direction, law } => {
                next.laws.push(DirectionalTerm { element, row: row(direction), value: Arc::clone(law) });
            }
            Term::Output(sensor) => next.sensors_like(sensor).push((element, sensor.clone())),
            Term::Coordinate { name, domain } => next.domains[number(name)] = *domain,
            Term::Measure(domain) => drop(next.measures.insert(element, *domain)),
            Term::MultiplierLaw(law) => {
                let law = law.renamed(|name| number(name));
                next.multiplier_constraints.push(MultiplierConstraint { element, law });
            }
            Term::Moving(function) => drop(next.moving.insert(element, Arc::clone(function))),
            Term::Balance { node, .. } if node == GROUND => {}
            Term::Balance { node, direction } => add_shares(balances.entry(node.clone()).or_default(), row(direction)),
        }
    }
    next.add_balances(balances);
    next.read_compliances();
    next.sort_terms();
    Equations { coordinates, ..next }
}

impl Equations {
    /// A spring and a damper along a direction, in units of a scale, in place of its constraint.
    fn add_compliance(&mut self, constrained: DirectionalTerm<Exact>, spring: SpringLaw, damping: &Exact) {
        let inverse = Scalar::minus(&Rational::ZERO, &Rational::ONE.over(&constrained.value.to_rational()));
        let row = constrained.row.iter().map(|(k, x)| (*k, x.times(&inverse))).collect();
        self.add_spring(&constrained.element, row, spring, damping);
        self.compliances.push(constrained);
    }

    /// Adds a spring along a direction, and a damper unless its damping is zero.
    pub fn add_spring(&mut self, element: &str, row: Vec<(usize, Rational)>, spring: SpringLaw, damping: &Exact) {
        let element = element.to_string();
        if !damping.is_zero() {
            self.dampers.push(DirectionalTerm { element: element.clone(), row: row.clone(), value: damping.clone() });
        }
        self.springs.push(DirectionalTerm { element, row, value: spring });
    }

    /// Adds a linear constraint, before the balances of nodes.
    pub fn add_constraint(&mut self, constraint: DirectionalTerm<Exact>) {
        let place = self.constraints.len() - self.nodes.len();
        self.constraints.insert(place, constraint);
    }

    fn sort_terms(&mut self) {
        sort(&mut self.inertias);
        sort(&mut self.springs);
        sort(&mut self.dampers);
        sort(&mut self.frictions);
        sort(&mut self.unilaterals);
    }

    /// Kirchhoff's law at each node, from its shares.
    fn add_balances(&mut self, balances: BTreeMap<String, BTreeMap<usize, Rational>>) {
        for (node, mut shares) in balances {
            shares.retain(|_, x| !Scalar::is_zero(x));
            if !shares.is_empty() {
                let row = shares.into_iter().collect();
                self.constraints.push(DirectionalTerm { element: node.clone(), row, value: Exact::zero() });
                self.nodes.push(node);
            }
        }
    }

    /// Sensors of constraint torques of compliances read their springs and dampers.
    fn read_compliances(&mut self) {
        for (_, sensor) in &mut self.sensors {
            if let Measured::ConstraintTorque(element, shaft) = &sensor.measured
                && self.compliances.iter().any(|compliance| compliance.element == *element)
            {
                sensor.measured = Measured::ComplianceTorque(element.clone(), shaft.clone());
            }
        }
    }
}

fn add_shares(shares: &mut BTreeMap<usize, Rational>, more: Vec<(usize, Rational)>) {
    for (coordinate, x) in more {
        let sum = shares.entry(coordinate).or_default();
        *sum = sum.plus(&x);
    }
}

/// By the shafts that a term acts on: the order of sums then does not depend on element names.
fn sort<T>(terms: &mut [DirectionalTerm<T>]) {
    terms.sort_by_key(|term| term.row.iter().map(|(shaft, _)| *shaft).collect::<Vec<_>>());
}

impl Equations {
    /// Directions of set-valued torques, with their elements: first those of the frictions, then those of the unilateral and switched laws.
    pub fn set_valued(&self) -> impl Iterator<Item = (&str, &[(usize, Rational)])> {
        let frictions = self.frictions.iter().map(|term| (term.element.as_str(), term.row.as_slice()));
        frictions.chain(self.unilaterals.iter().map(|term| (term.element.as_str(), term.row.as_slice())))
    }

    /// The time constant of each input's motor, s; zero for an ideal one.
    pub fn lags(&self) -> Vec<f64> {
        let lag = |input: &DirectionalTerm<InputKind>| match &input.value {
            InputKind::Motor(motor) => motor.lag.as_ref().map_or(0.0, |lag| lag.to_f64()),
            InputKind::Disturbance => 0.0,
        };
        self.inputs.iter().map(lag).collect()
    }

    /// Gear losses, in the order of the unilateral and switched laws.
    pub fn gear_losses(&self) -> impl Iterator<Item = (&DirectionalTerm<UnilateralConstraint>, &GearLoss)> {
        self.unilaterals.iter().filter_map(|unilateral| {
            if let UnilateralConstraint::GearLoss(gear) = &unilateral.value { Some((unilateral, gear)) } else { None }
        })
    }

    /// The inertia of a shaft itself, without bodies coupled to it, kg m².
    pub fn own_inertia(&self, shaft: usize) -> Rational {
        let own = self.inertias.iter().filter_map(|term| match term.row.as_slice() {
            [(k, x)] if *k == shaft => Some(x.times(x).times(&term.value.to_rational())),
            _ => None,
        });
        own.fold(Rational::ZERO, |sum, inertia| sum.plus(&inertia))
    }

    /// The coefficients of all inertias, dampers, springs and Coulomb frictions, in this order.
    ///
    /// ```
    /// use kardan_mechanics::assemble::assemble;
    /// let (document, _) = kardan_model::read(kardan_model::builtin("harmonic-drive").unwrap().source);
    /// let (drive, _) = document.model(&[]);
    /// let found = assemble(&drive.all_coordinates, &drive.terms).coefficients();
    /// assert!(found.iter().any(|one| one.name == "wg.damping" && (one.value - 251.0 / 510_000.0).abs() < 1e-18));
    /// ```
    pub fn coefficients(&self) -> Vec<TermCoefficient> {
        let one = |(kind, term)| {
            let (element, row, value) = self.coefficient_parts((kind, term));
            let name = format!("{element}.{}", kind.key());
            TermCoefficient { name, kind, term, row: row_f64(row), value: value.to_f64() }
        };
        self.coefficient_slots().into_iter().map(one).collect()
    }

    /// Element, direction and value of a coefficient.
    fn coefficient_parts(&self, (kind, term): (CoefficientKind, usize)) -> (&str, &[(usize, Rational)], &Exact) {
        fn of<T>(term: &DirectionalTerm<T>, value: fn(&T) -> &Exact) -> (&str, &[(usize, Rational)], &Exact) {
            (term.element.as_str(), term.row.as_slice(), value(&term.value))
        }
        match kind {
            CoefficientKind::Inertia => of(&self.inertias[term], |inertia| inertia),
            CoefficientKind::Damping => of(&self.dampers[term], |damping| damping),
            CoefficientKind::Stiffness => of(&self.springs[term], |spring| &spring.stiffness),
            CoefficientKind::Friction => of(&self.frictions[term], |friction| &friction.torque),
        }
    }

    /// The coefficient of a kind and of the term of a number.
    pub fn coefficient(&self, slot: (CoefficientKind, usize)) -> &Exact {
        self.coefficient_parts(slot).2
    }

    /// The same, to be changed.
    pub fn coefficient_mut(&mut self, (kind, term): (CoefficientKind, usize)) -> &mut Exact {
        match kind {
            CoefficientKind::Inertia => &mut self.inertias[term].value,
            CoefficientKind::Damping => &mut self.dampers[term].value,
            CoefficientKind::Stiffness => &mut self.springs[term].value.stiffness,
            CoefficientKind::Friction => &mut self.frictions[term].value.torque,
        }
    }

    /// The direction of the term of a coefficient.
    pub fn coefficient_row(&self, slot: (CoefficientKind, usize)) -> &[(usize, Rational)] {
        self.coefficient_parts(slot).1
    }

    /// Kinds and term numbers of all coefficients.
    pub fn coefficient_slots(&self) -> Vec<(CoefficientKind, usize)> {
        let kinds = [
            (CoefficientKind::Inertia, self.inertias.len()),
            (CoefficientKind::Damping, self.dampers.len()),
            (CoefficientKind::Stiffness, self.springs.len()),
            (CoefficientKind::Friction, self.frictions.len()),
        ];
        kinds.into_iter().flat_map(|(kind, count)| (0..count).map(move |term| (kind, term))).collect()
    }

    /// The domain of a coordinate.
    pub fn domain(&self, coordinate: usize) -> Domain {
        self.domains.get(coordinate).copied().unwrap_or_default()
    }

    /// The domain of a law: that of its direction if declared, else that of its coordinates.
    pub fn domain_of<T>(&self, term: &DirectionalTerm<T>) -> Domain {
        if let Some(domain) = self.measures.get(&term.element) {
            return *domain;
        }
        term.row.first().map_or(Domain::Rotation, |(coordinate, _)| self.domain(*coordinate))
    }

    /// The domain of an element by its laws and inputs.
    pub fn domain_of_element(&self, element: &str) -> Domain {
        fn own<'a, T>(terms: &'a [DirectionalTerm<T>], element: &'a str, of: &Equations) -> Option<Domain> {
            terms.iter().find(|term| term.element == element).map(|term| of.domain_of(term))
        }
        let found = own(&self.frictions, element, self)
            .or_else(|| own(&self.dampers, element, self))
            .or_else(|| own(&self.springs, element, self))
            .or_else(|| own(&self.inertias, element, self))
            .or_else(|| own(&self.inputs, element, self));
        found.unwrap_or_default()
    }

    /// The domain of a unilateral or switched law along a direction; a gear loss acts along its first body, whatever the length in its constraint.
    pub fn domain_of_unilateral(&self, unilateral: &DirectionalTerm<UnilateralConstraint>) -> Domain {
        match (&unilateral.value, unilateral.row.first()) {
            (UnilateralConstraint::GearLoss(_), Some((coordinate, _))) => self.domain(*coordinate),
            _ => self.domain_of(unilateral),
        }
    }

    /// The list that contains a sensor.
    fn sensors_like(&mut self, sensor: &Sensor) -> &mut Vec<(String, Sensor)> {
        let of_signal = matches!(sensor.measured, Measured::Signal(_));
        if of_signal { &mut self.signal_sensors } else { &mut self.sensors }
    }

    /// A sensor by its name, also of a signal.
    pub fn sensor(&self, name: &str) -> Option<&Sensor> {
        let all = self.sensors.iter().chain(&self.signal_sensors);
        all.into_iter().find(|(candidate, _)| candidate == name).map(|(_, sensor)| sensor)
    }

    /// The quantity of a sensor's reading: of a mass a position, a velocity or a force.
    pub fn reading(&self, measured: &Measured) -> Quantity {
        let domain =
            |name: &str| self.coordinates.iter().position(|candidate| candidate == name).map(|k| self.domain(k));
        let motion = |name: &str, rate: usize| domain(name).unwrap_or_default().motion()[rate];
        match measured {
            Measured::Angle(name) => motion(name, 0),
            Measured::Speed(name) => motion(name, 1),
            Measured::NetTorque(name) | Measured::ConstraintTorque(_, name) | Measured::ComplianceTorque(_, name) => {
                domain(name).unwrap_or_default().effort()
            }
            // A signal has a unit of its own.
            Measured::Signal(_) => Quantity::State,
            Measured::SpringTorque(element) => {
                let spring = self.springs.iter().find(|spring| spring.element == *element);
                spring.map_or(Domain::Rotation, |spring| self.domain_of(spring)).effort()
            }
        }
    }

    /// The coordinates that a multiplier row acts on, by number.
    pub fn shafts_of(&self, law: &MultiplierLaw<usize>) -> Vec<usize> {
        let mut shafts: Vec<usize> = match law {
            MultiplierLaw::Surface(formula) => {
                formula.coordinates().filter_map(|name| self.coordinates.iter().position(|own| own == name)).collect()
            }
            law => law.summed().into_iter().copied().collect(),
        };
        shafts.sort_unstable();
        shafts.dedup();
        shafts
    }

    /// All coordinates that a multiplier row depends on, by number.
    pub fn coordinates_of_multiplier(&self, law: &MultiplierLaw<usize>) -> Vec<usize> {
        let mut found = self.shafts_of(law);
        if let MultiplierLaw::Rates(row) = law {
            let names = row.iter().flat_map(|(_, formula)| formula.coordinates());
            found.extend(names.filter_map(|name| self.coordinates.iter().position(|own| own == name)));
        }
        found
    }

    /// The domain of the sum in a multiplier row; none for a relation in another unit, such as an area.
    pub fn domain_of_multiplier(&self, constraint: &MultiplierConstraint) -> Option<Domain> {
        let own = || self.shafts_of(&constraint.law).first().map(|shaft| self.domain(*shaft));
        if constraint.law.prescribes() {
            return Some(self.measures.get(&constraint.element).copied().or_else(own).unwrap_or_default());
        }
        let found = self.dimension_of_multiplier(constraint);
        [Domain::Rotation, Domain::Translation].into_iter().find(|domain| domain.dimensions()[0].is_like(&found))
    }

    /// The quantity of the sum in a multiplier row; of rates, the quantity whose rate it is.
    pub fn dimension_of_multiplier(&self, constraint: &MultiplierConstraint) -> Dimension {
        let over = match &constraint.law {
            MultiplierLaw::Surface(formula) => Some(formula.dimension),
            MultiplierLaw::Rates(row) => {
                row.first().and_then(|(shaft, a)| a.dimension.times(&self.domain(*shaft).dimensions()[0], 1))
            }
            MultiplierLaw::Prescribed { .. } => {
                self.domain_of_multiplier(constraint).map(|domain| domain.dimensions()[0])
            }
        };
        over.unwrap_or(Dimension::NONE)
    }

    /// The quantity of the multiplier of a row: a torque, a force, a voltage, or energy divided by the quantity of the row.
    pub fn multiplier_quantity(&self, constraint: &MultiplierConstraint) -> (Quantity, Physical) {
        match self.domain_of_multiplier(constraint) {
            Some(domain) => (domain.effort(), domain.effort().physical()),
            None => {
                let found = Dimension { angle: 0, ..self.dimension_of_multiplier(constraint) };
                let unit = Dimension::TORQUE.times(&found, -1).unwrap_or(Dimension::NONE).si();
                (Quantity::Multiplier, Physical::of_unit(&unit))
            }
        }
    }

    /// Enforces moving constraints, by name, by multipliers instead of solving them for a coordinate.
    pub fn prefer_moving(&mut self, names: &[String]) {
        for name in names {
            let place = self.constraints.iter().position(|constraint| constraint.element == *name);
            let Some((place, function)) = place.zip(self.moving.remove(name)) else { continue };
            let row = self.constraints.remove(place).row;
            let row = row.into_iter().map(|(shaft, x)| (shaft, Exact::new(x, 0))).collect();
            let law = MultiplierLaw::Prescribed { row, order: 0, function };
            self.multiplier_constraints.push(MultiplierConstraint { element: name.clone(), law });
        }
        self.multiplier_constraints.sort_by(|a, b| a.element.cmp(&b.element));
    }

    /// Whether constraints prescribe speeds as functions of time.
    pub fn prescribes(&self) -> bool {
        !self.moving.is_empty() || self.multiplier_constraints.iter().any(|row| row.law.prescribes())
    }

    /// The right-hand side of a linear constraint: a number, or a function of time.
    pub fn format_offset(&self, constraint: &DirectionalTerm<Exact>) -> String {
        match self.moving.get(&constraint.element) {
            Some(function) => function.text(),
            None => constraint.value.to_f64().to_string(),
        }
    }

    /// The node whose balance a constraint is, by number.
    pub fn node(&self, constraint: usize) -> Option<&str> {
        let first = self.constraints.len() - self.nodes.len();
        constraint.checked_sub(first).and_then(|node| self.nodes.get(node)).map(String::as_str)
    }

    /// The coefficient matrix C of the linear constraints \[diss. (4.31)\], exact, one row per constraint.
    pub fn constraint_matrix(&self) -> Matrix<Rational> {
        dense_rows(&self.constraints, self.coordinates.len())
    }

    /// The inertia matrix `Σ J a aᵀ` over all shaft angles, exact, kg m².
    pub fn inertia_matrix(&self) -> Matrix<Rational> {
        self.sum(self.inertias.iter().map(|term| (&term.row, term.value.to_rational())))
    }

    /// The damping matrix `Σ d a aᵀ` over all shaft angles, exact, N m s/rad.
    pub fn damping_matrix(&self) -> Matrix<Rational> {
        self.sum(self.dampers.iter().map(|term| (&term.row, term.value.to_rational())))
    }

    /// The stiffness matrix `Σ s a aᵀ` over all shaft angles, exact, N m/rad.
    pub fn stiffness_matrix(&self) -> Matrix<Rational> {
        self.sum(self.springs.iter().map(|term| (&term.row, term.value.stiffness.to_rational())))
    }

    /// The input matrix over all shaft angles, one column per input, exact.
    pub fn input_matrix(&self) -> Matrix<Rational> {
        dense_rows(&self.inputs, self.coordinates.len()).transpose()
    }

    fn sum<'a>(&'a self, terms: impl Iterator<Item = (&'a Vec<(usize, Rational)>, Rational)>) -> Matrix<Rational> {
        sum_of_outer(terms, self.coordinates.len())
    }
}
