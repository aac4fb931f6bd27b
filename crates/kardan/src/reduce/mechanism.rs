use kardan_rt::{Along, Mechanism, Operation, Real, Row};

use super::{Affine, Kinematics, Reduced, Step, reduce};
use crate::assemble::{self, TransmissionRow};
use crate::num::{Matrix, Rational, rational_to_f64};
use crate::units::Exact;

/// Why a reduced model cannot become a block of the runtime.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MechanismError {
    /// The curve of a transmission is none that the runtime knows.
    #[error("the transmission that gives the angle of `{shaft}` has no runtime block")]
    UnknownCurve {
        /// The shaft found by it.
        shaft: String,
    },
    /// There is no such cut, or it was made before.
    #[error("no constraint of `{element}` acts on `{shaft}`, or it is cut already")]
    NoConstraint {
        /// The element.
        element: String,
        /// The shaft.
        shaft: String,
    },
}

/// The tables of a [`kardan_rt::Mechanism`], owned: a reduced model as a controller evaluates it.
///
/// ```
/// use kardan::reduce::{Dynamics, MechanismData};
/// let source = kardan::model::builtin("sia-steering").unwrap().source;
/// let (prepared, _) = kardan::study::prepare(source);
/// let reduced = &prepared.variants[2].reduced; // a joint angle of 20 deg
/// let data = MechanismData::new(reduced).unwrap();
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
    held: usize,
    coordinates: Vec<usize>,
    entries: Vec<(usize, T)>,
    operations: Vec<Operation<T>>,
    basis: Vec<T>,
    inertia: Vec<T>,
    damping: Vec<T>,
    stiffness: Vec<T>,
    force: Vec<T>,
    inertias: Vec<Along<T>>,
    dampers: Vec<Along<T>>,
    springs: Vec<Along<T>>,
    frictions: Vec<Along<T>>,
    inputs: Vec<Row>,
}

impl MechanismData<f64> {
    /// Tabulates a reduced model.
    ///
    /// # Errors
    /// [`MechanismError::UnknownCurve`] if [`crate::equations::Curve::block`] of a transmission gives none.
    pub fn new(reduced: &Reduced) -> Result<Self, MechanismError> {
        Self::with_cuts(reduced, &[])
    }

    /// Tabulates a reduced model with cuts, each between an element and one of the shafts that it constrains. The numbers of
    /// shafts, inputs and coordinates stay; behind the coordinates stands one for each cut, in the order given: the angle by
    /// which the shaft runs ahead of its end in the element. Held at zero it changes nothing, and the generalised force that
    /// holds it is the constraint torque of the element on the shaft, \[diss. (4.18)\].
    ///
    /// # Errors
    /// [`MechanismError`]
    pub fn with_cuts(reduced: &Reduced, cuts: &[(&str, &str)]) -> Result<Self, MechanismError> {
        let mut opened = reduced.clone();
        for (element, shaft) in cuts {
            opened = cut(&opened, element, shaft)
                .ok_or_else(|| MechanismError::NoConstraint { element: (*element).into(), shaft: (*shaft).into() })?;
        }
        tabulate(&opened, cuts.len())
    }
}

impl<T: Real> MechanismData<T> {
    /// The block, for an evaluation or a law.
    pub fn block(&self) -> Mechanism<'_, T> {
        Mechanism {
            shafts: self.shafts.len(),
            held: self.held,
            coordinates: &self.coordinates,
            entries: &self.entries,
            operations: &self.operations,
            basis: &self.basis,
            inertia: &self.inertia,
            damping: &self.damping,
            stiffness: &self.stiffness,
            force: &self.force,
            inertias: &self.inertias,
            dampers: &self.dampers,
            springs: &self.springs,
            frictions: &self.frictions,
            inputs: &self.inputs,
        }
    }

    /// The tables as numbers with names, for a file: each is a list of rows.
    ///
    /// `coordinates` (shaft of each), `entries` (shaft, coefficient), `operations` (shaft, first entry, entries, constant,
    /// ratio, phase_in, phase_out of a universal joint or zeros, varying), `basis`, `inertia`, `damping`, `stiffness`,
    /// `force`, the varying `inertias`, `dampers`, `springs` and all `frictions` (first entry, entries, coefficient, rest),
    /// `inputs` (first entry, entries).
    pub fn tables(&self, number: impl Fn(T) -> f64) -> Vec<(String, Vec<Vec<f64>>)> {
        let r = self.coordinates.len().max(1);
        let matrix = |values: &[T]| -> Vec<Vec<f64>> {
            values.chunks(r).map(|row| row.iter().map(|x| number(*x)).collect()).collect()
        };
        let row = |row: &Row| vec![row.first as f64, row.count as f64];
        let along = |terms: &[Along<T>]| -> Vec<Vec<f64>> {
            terms
                .iter()
                .map(|term| [row(&term.row), vec![number(term.coefficient), number(term.rest)]].concat())
                .collect()
        };
        let operation = |operation: &Operation<T>| {
            let joint = operation
                .curve
                .map_or([0.0; 3], |joint| [number(joint.ratio), number(joint.phase_in), number(joint.phase_out)]);
            let mut out = vec![operation.shaft as f64];
            out.extend(row(&operation.argument));
            out.push(number(operation.constant));
            out.extend(joint);
            out.push(f64::from(u8::from(operation.varying)));
            out
        };
        let tables = [
            ("coordinates", self.coordinates.iter().map(|k| vec![*k as f64]).collect()),
            ("entries", self.entries.iter().map(|(shaft, x)| vec![*shaft as f64, number(*x)]).collect()),
            ("operations", self.operations.iter().map(operation).collect()),
            ("basis", matrix(&self.basis)),
            ("inertia", matrix(&self.inertia)),
            ("damping", matrix(&self.damping)),
            ("stiffness", matrix(&self.stiffness)),
            ("force", matrix(&self.force)),
            ("inertias", along(&self.inertias)),
            ("dampers", along(&self.dampers)),
            ("springs", along(&self.springs)),
            ("frictions", along(&self.frictions)),
            ("inputs", self.inputs.iter().map(row).collect()),
        ];
        tables.into_iter().map(|(name, rows): (_, Vec<Vec<f64>>)| (name.to_string(), rows)).collect()
    }

    /// How many of the last coordinates are cuts.
    pub fn held(&self) -> usize {
        self.held
    }

    /// The same tables in another precision.
    pub fn cast<U: Real>(&self, to: impl Fn(T) -> U) -> MechanismData<U> {
        let list = |values: &[T]| values.iter().map(|x| to(*x)).collect();
        let along = |terms: &[Along<T>]| {
            let one = |term: &Along<T>| Along { row: term.row, coefficient: to(term.coefficient), rest: to(term.rest) };
            terms.iter().map(one).collect()
        };
        let operation = |operation: &Operation<T>| Operation {
            shaft: operation.shaft,
            argument: operation.argument,
            constant: to(operation.constant),
            curve: operation.curve.map(|joint| kardan_rt::UniversalJoint {
                ratio: to(joint.ratio),
                phase_in: to(joint.phase_in),
                phase_out: to(joint.phase_out),
            }),
            varying: operation.varying,
        };
        MechanismData {
            shafts: self.shafts.clone(),
            held: self.held,
            coordinates: self.coordinates.clone(),
            entries: self.entries.iter().map(|(shaft, x)| (*shaft, to(*x))).collect(),
            operations: self.operations.iter().map(operation).collect(),
            basis: list(&self.basis),
            inertia: list(&self.inertia),
            damping: list(&self.damping),
            stiffness: list(&self.stiffness),
            force: list(&self.force),
            inertias: along(&self.inertias),
            dampers: along(&self.dampers),
            springs: along(&self.springs),
            frictions: along(&self.frictions),
            inputs: self.inputs.clone(),
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
        // Balances of nodes stay last.
        let place = equations.constraints.len() - equations.nodes.len();
        equations.constraints.insert(place, assemble::Along { element: name.clone(), row, value: Exact::zero() });
        found = true;
    }
    let mut coordinates = reduced.coordinate_names();
    coordinates.push(name);
    found.then(|| reduce(equations, Some(&coordinates)).expect("what followed without the cut follows with its angle"))
}

fn tabulate(reduced: &Reduced, held: usize) -> Result<MechanismData<f64>, MechanismError> {
    let (equations, r) = (&reduced.equations, reduced.degrees_of_freedom());
    let mut kinematics = Kinematics::new(reduced);
    let mut entries = Vec::new();
    let mut enter = |terms: &[(usize, Rational)]| {
        let first = entries.len();
        entries.extend(terms.iter().map(|(shaft, x)| (*shaft, rational_to_f64(x))));
        Row { first, count: terms.len() }
    };
    let mut operations = Vec::new();
    for step in &reduced.steps {
        let (curve, Affine { constant, terms }) = match step {
            Step::Linear { value, .. } => (None, value),
            Step::Curve { shaft, curve, argument } => {
                let unknown = || MechanismError::UnknownCurve { shaft: equations.coordinates[*shaft].clone() };
                (Some(curve.block().ok_or_else(unknown)?), argument)
            }
        };
        let (shaft, argument) = (step.shaft(), enter(terms));
        operations.push(Operation {
            shaft,
            argument,
            constant: *constant,
            curve,
            varying: kinematics.is_varying(shaft),
        });
    }
    // Springs along constant directions are summed as the twist at q_r = 0 and a stiffness.
    kinematics.update(&vec![0.0; r], &vec![0.0; r]);
    let template = Kinematics::new(reduced).basis;
    let mut constant = |terms: Vec<Term<'_>>| {
        let (mut sum, mut force, mut varying) = (Matrix::<f64>::zeros(r, r), vec![0.0; r], Vec::new());
        for Term { row, coefficient, rest } in terms {
            if row.iter().any(|(shaft, _)| kinematics.is_varying(*shaft)) {
                varying.push(Along { row: enter(row), coefficient, rest });
                continue;
            }
            let along = |values: &dyn Fn(usize) -> f64| -> f64 {
                row.iter().map(|(shaft, x)| rational_to_f64(x) * values(*shaft)).sum()
            };
            let direction: Vec<f64> = (0..r).map(|j| along(&|shaft| template[shaft * r + j])).collect();
            sum.add_outer(&coefficient, &direction);
            let twist = along(&|shaft| kinematics.angles[shaft]) - rest;
            force.iter_mut().zip(&direction).for_each(|(force, g)| *force -= coefficient * twist * g);
        }
        (sum.as_slice().to_vec(), force, varying)
    };
    let (inertia, _, inertias) = constant(terms(&equations.inertias, |x| (x.to_f64(), 0.0)));
    let (damping, _, dampers) = constant(terms(&equations.dampers, |x| (x.to_f64(), 0.0)));
    let (stiffness, force, springs) = constant(terms(&equations.springs, |x| (x.stiffness.to_f64(), x.rest.to_f64())));
    let friction = |term: &assemble::Along<assemble::FrictionLaw>| (term.row.clone(), term.value.torque.to_f64());
    let frictions = equations.frictions.iter().map(friction);
    let frictions = frictions.map(|(row, coefficient)| Along { row: enter(&row), coefficient, rest: 0.0 }).collect();
    let inputs = equations.inputs.iter().map(|input| enter(&input.row)).collect();
    Ok(MechanismData {
        shafts: equations.coordinates.clone(),
        held,
        coordinates: reduced.coordinates.clone(),
        operations,
        basis: template,
        inertia,
        damping,
        stiffness,
        force,
        inertias,
        dampers,
        springs,
        frictions,
        inputs,
        entries,
    })
}

/// A law along a direction, its coefficient as a number.
struct Term<'a> {
    row: &'a [(usize, Rational)],
    coefficient: f64,
    rest: f64,
}

fn terms<T>(terms: &[assemble::Along<T>], value: impl Fn(&T) -> (f64, f64)) -> Vec<Term<'_>> {
    let mut out = Vec::new();
    for term in terms {
        let (coefficient, rest) = value(&term.value);
        out.push(Term { row: &term.row, coefficient, rest });
    }
    out
}
