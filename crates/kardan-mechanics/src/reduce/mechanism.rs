//! The data of a mechanism for the runtime.

use kardan_rt::{Mechanism, Real};

use super::motion::SparseRow;
use super::{Motion, Reduced, reduce};
use crate::assemble::{self, TransmissionRow};
use kardan_expr::expr::Expr;
use kardan_expr::plan::Plan;
use kardan_math::num::Rational;
use kardan_math::units::Exact;

/// There is no such cut, or it was made before.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no constraint of `{element}` acts on `{shaft}`, or it is cut already")]
pub struct MechanismError {
    /// The element.
    pub element: String,
    /// The shaft.
    pub shaft: String,
}

/// The plan of a [`kardan_rt::Mechanism`], owned: a reduced model as a controller evaluates it.
///
/// ```
/// use kardan_mechanics::reduce::{Dynamics, MechanismData};
/// let source = kardan_model::builtin("sia-steering").unwrap().source;
/// let (prepared, _) = kardan::study::prepare(source);
/// let reduced = &prepared.variants[2].reduced; // a joint angle of 20 deg
/// let data = MechanismData::new(reduced);
/// let mut memory = vec![0.0; data.block().memory()];
/// let now = data.block().evaluate(&[0.3, -0.7, 1.1], &[2.0, -3.0, 5.0], &mut memory).unwrap();
/// let (dynamics, mut work) = Dynamics::new(reduced);
/// dynamics.update(&[0.3, -0.7, 1.1], &[2.0, -3.0, 5.0], &mut work);
/// assert!((now.inertia[8] - work.inertia[8]).abs() < 1e-15);
/// // The same for a target with single precision.
/// let single = data.cast(|x| x as f32);
/// assert_eq!(single.block().memory(), memory.len());
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct MechanismData<T> {
    /// Names of the shafts, in the order of their numbers; those of cuts and of the ends they make come last.
    pub shafts: Vec<String>,
    coordinates: Vec<usize>,
    cuts: usize,
    inputs: usize,
    frictions: Vec<T>,
    /// The plan, with its numbers as `f64`.
    plan: Plan,
    constants: Vec<T>,
    numbers: Vec<T>,
}

impl MechanismData<f64> {
    /// The plan of a reduced model.
    pub fn new(reduced: &Reduced) -> Self {
        Self::opened(reduced, 0)
    }

    /// The plan of a reduced model with cuts, each between an element and one of the shafts that it constrains. The
    /// numbers of shafts, inputs and coordinates stay; each cut adds one coordinate behind them, in the order given:
    /// the angle by which the shaft runs ahead of its end in the element. At zero it changes no equation, and the
    /// generalised force that enforces zero is the constraint torque of the element on the shaft, \[diss. (4.18)\].
    ///
    /// # Errors
    /// [`MechanismError`]
    pub fn with_cuts(reduced: &Reduced, cuts: &[(&str, &str)]) -> Result<Self, MechanismError> {
        let mut opened = reduced.clone();
        for (element, shaft) in cuts {
            opened = cut(&opened, element, shaft)
                .ok_or_else(|| MechanismError { element: (*element).into(), shaft: (*shaft).into() })?;
        }
        Ok(Self::opened(&opened, cuts.len()))
    }

    fn opened(reduced: &Reduced, cuts: usize) -> Self {
        let (equations, mut motion) = (&reduced.equations, Motion::at_time_zero(reduced));
        let evaluated_lists = evaluated_lists(reduced, &mut motion);
        let plan = motion.compile(&evaluated_lists);
        Self {
            shafts: equations.coordinates.clone(),
            coordinates: reduced.coordinates.clone(),
            cuts,
            inputs: equations.inputs.len(),
            frictions: equations.frictions.iter().map(|friction| friction.value.torque.to_f64()).collect(),
            constants: plan.constants().to_vec(),
            numbers: plan.numbers().to_vec(),
            plan,
        }
    }
}

/// The lists of a [`kardan_rt::Evaluation`] in their order, by name.
fn evaluated_lists(reduced: &Reduced, motion: &mut Motion) -> Vec<(String, Expr)> {
    let (equations, r) = (&reduced.equations, reduced.degrees_of_freedom());
    let zero = motion.graph.integer(0);
    let dense = |rows: &[SparseRow]| -> Vec<Expr> {
        rows.iter().flat_map(|row| (0..r).map(|k| row.get(&k).copied().unwrap_or(zero))).collect()
    };
    let at = |i: usize, j: usize| motion.inertia.get(&(i.max(j), i.min(j))).copied().unwrap_or(zero);
    let inertia = (0..r * r).map(|entry| at(entry / r, entry % r)).collect();
    let (basis, inputs, frictions) =
        (dense(&motion.basis), dense(&motion.inputs), dense(&motion.frictions[..equations.frictions.len()]));
    let (angles, speeds, bias) = (motion.angles.clone(), motion.speeds.clone(), motion.bias.clone());
    let mut centrifugal: Vec<Vec<(Expr, Rational)>> = vec![Vec::new(); r];
    for body in &equations.inertias {
        let (row, bias) = (motion.reduced_row(&body.row), motion.sum(&body.row, |motion, k| motion.bias[k]));
        let coefficient = motion.exact(&body.value);
        for (column, entry) in row {
            let force = motion.graph.product(&[(coefficient, 1), (entry, 1), (bias, 1)]);
            centrifugal[column].push((force, Rational::from(-1)));
        }
    }
    let centrifugal = centrifugal.iter().map(|terms| motion.graph.sum(Rational::ZERO, terms)).collect();
    let reduced_row =
        |term: &assemble::DirectionalTerm<assemble::FrictionLaw>| motion.sum(&term.row, |motion, k| motion.speeds[k]);
    let friction_speeds = equations.frictions.iter().map(reduced_row).collect();
    let lists: [(&str, Vec<Expr>); 10] = [
        ("angle", angles),
        ("speed", speeds),
        ("bias", bias),
        ("basis", basis),
        ("inertia", inertia),
        ("passive", motion.passive.clone()),
        ("centrifugal", centrifugal),
        ("input", inputs),
        ("friction", frictions),
        ("friction_speed", friction_speeds),
    ];
    let named = |(name, list): (&str, Vec<Expr>)| -> Vec<(String, Expr)> {
        list.into_iter().enumerate().map(|(k, expr)| (format!("{name}.{k}"), expr)).collect()
    };
    lists.into_iter().flat_map(named).collect()
}

impl<T: Real> MechanismData<T> {
    /// The block, for an evaluation or a law.
    pub fn block(&self) -> Mechanism<'_, T> {
        Mechanism {
            shafts: self.shafts.len(),
            coordinates: self.coordinates.len(),
            cuts: self.cuts,
            inputs: self.inputs,
            frictions: &self.frictions,
            plan: self.plan.block_of(&self.constants, &self.numbers),
        }
    }

    /// The plan as numbers with names, for a file: each is a list of rows.
    ///
    /// `coordinates` (shaft of each), the rows of its [`Plan`](kardan_expr::plan::Plan::rows), `frictions` (Coulomb torques).
    pub fn tables(&self, number: impl Fn(T) -> f64) -> Vec<(String, Vec<Vec<f64>>)> {
        let numbers = |list: &[T]| list.iter().map(|x| number(*x)).collect::<Vec<f64>>();
        let column = |list: Vec<f64>| list.into_iter().map(|x| vec![x]).collect();
        let coordinates = ("coordinates", self.coordinates.iter().map(|k| vec![*k as f64]).collect());
        let plan = self.plan.rows(&numbers(&self.constants), &numbers(&self.numbers));
        let tables = std::iter::once(coordinates).chain(plan).chain([("frictions", column(numbers(&self.frictions)))]);
        tables.map(|(name, rows): (_, Vec<Vec<f64>>)| (name.to_string(), rows)).collect()
    }

    /// How many of the last coordinates are cuts.
    pub fn cuts(&self) -> usize {
        self.cuts
    }

    /// The same in another precision.
    pub fn cast<U: Real>(&self, to: impl Fn(T) -> U) -> MechanismData<U> {
        let list = |values: &[T]| values.iter().map(|x| to(*x)).collect();
        MechanismData {
            shafts: self.shafts.clone(),
            coordinates: self.coordinates.clone(),
            cuts: self.cuts,
            inputs: self.inputs,
            frictions: list(&self.frictions),
            plan: self.plan.clone(),
            constants: list(&self.constants),
            numbers: list(&self.numbers),
        }
    }
}

/// Adds the coordinate of a cut: the element then constrains the shaft's end, `q_shaft − z`, instead of the shaft.
fn cut(reduced: &Reduced, element: &str, shaft: &str) -> Option<Reduced> {
    let (mut equations, s) = (reduced.equations.clone(), reduced.coordinate(shaft)?);
    let domain = equations.domain(s);
    let mut add = |name: String| {
        let new = !equations.coordinates.contains(&name);
        equations.coordinates.push(name);
        equations.domains.push(domain);
        new.then_some(equations.coordinates.len() - 1)
    };
    let name = format!("{element}.{shaft}.cut");
    let z = add(name.clone())?;
    let (mut found, one) = (false, Rational::ONE);
    for constraint in equations.constraints.iter_mut().filter(|constraint| constraint.element == element) {
        if let Some((_, coefficient)) = constraint.row.iter().find(|(k, _)| *k == s) {
            let opposite = -coefficient.clone();
            constraint.row.push((z, opposite));
            found = true;
        }
    }
    let on_shaft = |t: &TransmissionRow| t.element == element && (t.driven == s || t.driving == s);
    if equations.transmissions.iter().any(on_shaft) {
        let end = add(format!("{element}.{shaft}.end"))?;
        for transmission in equations.transmissions.iter_mut().filter(|t| on_shaft(t)) {
            let side = if transmission.driven == s { &mut transmission.driven } else { &mut transmission.driving };
            *side = end;
        }
        let row = vec![(s, one.clone()), (z, -one.clone()), (end, -one)];
        equations.add_constraint(assemble::DirectionalTerm { element: name.clone(), row, value: Exact::zero() });
        found = true;
    }
    let mut coordinates = reduced.coordinate_names();
    coordinates.push(name);
    found.then(|| {
        reduce(equations, Some(&coordinates)).expect("a shaft determined without the cut is determined with its angle")
    })
}
