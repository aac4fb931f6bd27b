//! Explains why outputs cannot be controlled independently.

use super::Obstruction;
use super::polynomial_matrix::derivative;
use crate::notation::listed;
use kardan_analysis::{ConstrainedSystem, OutputSignal};
use kardan_math::num::{Matrix, Polynomial, Rational, Scalar};
use kardan_mechanics::equations::Measured;

/// Why outputs cannot be controlled independently, as text and in terms of shafts and elements; one sentence each.
///
/// `outputs` are those of the obstruction, in its order; `element` names one for reports: ``the harmonic drive `hd` ``.
///
/// Method: outputs that are angles, speeds or torques of springs make a relation a row `a(s)ᵀ q = 0` over the shafts. With
/// `M(s) = Hs² + Ds + S`, it follows from the equations of motion as `a = M K η + Cᵀ μ`, `(KᵀMK) η = Kᵀ a`: the parts
/// of the constraints with μ ≠ 0 and the springs and dampers that the virtual motion K η moves are the reason; inputs
/// do not act along it. Polynomials are proven zero at more numbers s than their degree. Where this names no element, only the
/// relation is reported.
///
/// ```
/// use kardan_analysis::{ConstrainedSystem, OutputSignal};
/// use kardan_mechanics::assemble::DirectionalTerm;
/// use kardan_mechanics::equations::Measured;
/// use kardan_math::num::{Polynomial, Rational};
/// use kardan_synthesis::inversion::{Obstruction, reasons};
/// let number = |x: i64| Rational::from(x);
/// let term = |element: &str, row: &[(usize, i64)]| DirectionalTerm {
///     element: element.into(), row: row.iter().map(|&(shaft, x)| (shaft, number(x))).collect(), value: (),
/// };
/// let gearbox = ConstrainedSystem {
///     coordinates: vec!["a".into(), "b".into()], constraints: vec![term("gear", &[(0, 1), (1, -3)])], ..Default::default()
/// };
/// let signal = |shaft: &str| OutputSignal { name: format!("{shaft}.phi"), measured: Measured::Angle(shaft.into()) };
/// let constant = |x: i64| Polynomial::new(vec![number(x)]);
/// let found = Obstruction {
///     rank: 1, inputs: vec!["motor".into(), "brake".into()], outputs: vec!["a.phi".into(), "b.phi".into()],
///     relations: vec![vec![constant(1), constant(-3)]],
/// };
/// assert_eq!(
///     reasons(&found, &[signal("a"), signal("b")], &gearbox, &|name| format!("the gear `{name}`")),
///     ["a.phi = 3 b.phi for all inputs: the gear `gear` ties them together"],
/// );
/// ```
pub fn reasons(
    obstruction: &Obstruction,
    outputs: &[OutputSignal],
    constrained: &ConstrainedSystem,
    element: &dyn Fn(&str) -> String,
) -> Vec<String> {
    let mut out = Vec::new();
    let (m, p) = (obstruction.outputs.len(), obstruction.inputs.len());
    if p < m {
        let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
        out.push(format!("{}, {}", count(m, "output"), count(p, "input")));
    }
    for relation in &obstruction.relations {
        let taking_part: Vec<usize> = (0..relation.len()).filter(|&i| !relation[i].is_zero()).collect();
        if let [only] = taking_part[..] {
            out.push(format!("no input reaches {}", obstruction.outputs[only]));
            continue;
        }
        let because = over_shafts(relation, outputs, constrained)
            .and_then(|row| Cause::of(&row, constrained))
            .and_then(|cause| cause.notation(constrained, element));
        let text = format!("{} for all inputs", obstruction.notation(relation));
        out.push(because.map_or(text.clone(), |because| format!("{text}: {because}")));
    }
    out
}

/// a(s) with `π(s) y = a(s)ᵀ q`; `None` if an output is not a function of angles and speeds alone.
fn over_shafts(
    relation: &[Polynomial],
    outputs: &[OutputSignal],
    system: &ConstrainedSystem,
) -> Option<Vec<Polynomial>> {
    let number = |name: &String| system.coordinates.iter().position(|shaft| shaft == name);
    let mut out = vec![Polynomial::default(); system.coordinates.len()];
    for (i, factor) in relation.iter().enumerate().filter(|(_, factor)| !factor.is_zero()) {
        match &outputs.get(i)?.measured {
            Measured::Angle(shaft) => {
                let shaft = number(shaft)?;
                out[shaft] = out[shaft].plus(factor);
            }
            Measured::Speed(shaft) => {
                let shaft = number(shaft)?;
                out[shaft] = out[shaft].plus(&derivative(factor));
            }
            Measured::SpringTorque(element) => {
                for spring in system.springs.iter().filter(|spring| spring.element == *element) {
                    for (shaft, x) in &spring.row {
                        out[*shaft] = out[*shaft].plus(&factor.scale(&spring.value.times(x)));
                    }
                }
            }
            Measured::NetTorque(name) => {
                let shaft = number(name)?;
                let term = derivative(&derivative(factor)).scale(&system.own_inertia(shaft));
                out[shaft] = out[shaft].plus(&term);
            }
            Measured::ConstraintTorque(..) | Measured::ComplianceTorque(..) | Measured::Signal(_) => return None,
        }
    }
    Some(out)
}

/// The cause of a relation between shafts.
struct Cause {
    /// Shafts that move in the virtual motion K η; none if constraints alone are the cause.
    moving: Vec<bool>,
    /// Constraints with μ ≠ 0.
    constraints: Vec<bool>,
    /// Springs, then dampers, that the virtual motion moves.
    couplings: Vec<bool>,
}

impl Cause {
    fn of(row: &[Polynomial], system: &ConstrainedSystem) -> Option<Self> {
        let n = system.coordinates.len();
        let (coordinates, basis) = system.explicit_basis(&[]);
        let (inertia, damping, stiffness) =
            (system.inertia_matrix(), system.damping_matrix(), system.stiffness_matrix());
        let constraints = system.constraint_matrix();
        let gram = constraints.multiply(&constraints.transpose());
        let couplings: Vec<&[(usize, Rational)]> = directions(system).map(|(_, row)| row).collect();
        let mut out = Self {
            moving: vec![false; n],
            constraints: vec![false; constraints.rows()],
            couplings: vec![false; couplings.len()],
        };
        let degree = row.iter().map(Polynomial::degree).max().unwrap_or(0);
        // Numerators of η and μ over det KᵀMK have at most this degree.
        let enough = degree + 2 * coordinates.len() + 1;
        let (mut trials, mut number) = (0, 0i64);
        while trials < enough {
            number += 1;
            // A pencil that is singular everywhere has no cause.
            if number > 2 * (enough as i64 + 2 * coordinates.len() as i64) {
                return None;
            }
            let s = Rational::from(number);
            // The virtual motion is that of the transposed system; they are one without loads.
            let m = inertia.scale(&s.times(&s)).plus(&damping.scale(&s)).plus(&stiffness).transpose();
            let a = Matrix::from_fn(n, 1, |i, _| row[i].evaluate(&s));
            let forced = basis.transpose().multiply(&a);
            let eta = if forced.as_slice().iter().all(Scalar::is_zero) {
                // The constraints alone are the cause, whatever M is.
                forced
            } else {
                let reduced = basis.transpose().multiply(&m).multiply(&basis);
                let Some(eta) = reduced.solve(&forced) else { continue };
                eta
            };
            trials += 1;
            let motion = basis.multiply(&eta);
            let rest = a.minus(&m.multiply(&motion));
            let mu = gram.solve(&constraints.multiply(&rest))?;
            let mark = |flags: &mut [bool], values: &[Rational]| {
                flags.iter_mut().zip(values).for_each(|(flag, x)| *flag |= !Scalar::is_zero(x));
            };
            mark(&mut out.moving, motion.as_slice());
            mark(&mut out.constraints, mu.as_slice());
            let projections: Vec<Rational> = couplings
                .iter()
                .map(|row| row.iter().fold(Rational::ZERO, |sum, (i, x)| sum.plus(&x.times(&motion[(*i, 0)]))))
                .collect();
            mark(&mut out.couplings, &projections);
        }
        Some(out)
    }

    fn notation(&self, system: &ConstrainedSystem, element: &dyn Fn(&str) -> String) -> Option<String> {
        let constraints = system.constraints.iter().zip(&self.constraints).filter(|(_, at)| **at);
        // An element on one shaft alone connects no shafts.
        let couplings = directions(system).zip(&self.couplings).filter(|((_, row), at)| **at && row.len() > 1);
        let mut names: Vec<&str> = Vec::new();
        for name in constraints.map(|(c, _)| c.element.as_str()).chain(couplings.map(|((name, _), _)| name)) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        let moving: Vec<&String> =
            system.coordinates.iter().zip(&self.moving).filter(|(_, moves)| **moves).map(|(shaft, _)| shaft).collect();
        if names.is_empty() {
            return moving.is_empty().then(|| "they measure the same motion".to_string());
        }
        let list = listed(&names.iter().map(|name| element(name)).collect::<Vec<_>>());
        if let ([shaft], false) = (&moving[..], self.constraints.contains(&true)) {
            return Some(format!("{shaft} moves only through {list}"));
        }
        Some(format!("{list} {} them together", if names.len() == 1 { "ties" } else { "tie" }))
    }
}

/// Elements and directions of all springs, then all dampers.
fn directions(system: &ConstrainedSystem) -> impl Iterator<Item = (&str, &[(usize, Rational)])> {
    let laws = system.springs.iter().chain(&system.dampers).map(|term| (term.element.as_str(), term.row.as_slice()));
    laws.chain(system.loads.iter().map(|load| (load.element.as_str(), load.row.as_slice())))
}
