//! The class of a model and of its constraints.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::integrable::{Integrable, Integrals, integrable};
use super::massless::signed_sum;
use kardan_expr::expr::{Expr, Rationals, lower};
use kardan_math::num::{Definiteness, Rational, definiteness, rational_to_f64};
use kardan_math::units::Exact;
use kardan_mechanics::assemble::{DirectionalTerm, Equations, MultiplierConstraint};
use kardan_mechanics::equations::{Domain, Formula, MultiplierLaw, UnilateralConstraint};
use kardan_mechanics::reduce::{Contact, Kinematics, Motion, Reduced, Redundant, contacts, is_linear_law};
use kardan_results::{Assumption, Breach, Class, ConstraintClass, FrictionState, OperatingPoint, ShaftAngle};

/// Whether a model is a constant linear constrained mechanical system \[diss. Definition 4.4\], which element breaks which
/// assumption, the class of every constraint \[diss. Tables 4.1, 4.2\], and where it is linearised.
///
/// `position` is the reduced position in rad; elements in `stuck` stick by their Coulomb friction.
///
/// # Panics
/// If `position` has not one entry per coordinate.
pub fn class(reduced: &Reduced, position: &[f64], stuck: &BTreeSet<String>) -> Class {
    let equations = &reduced.equations;
    let kinematics = Kinematics::at_rest(reduced, position);
    let mut assumptions = vec![
        assumption(
            "the inertia matrix is constant, symmetric and positive definite (source, eq. 4.27)",
            massless(equations),
        ),
        assumption(
            "the potential energy is a quadratic form, positive semidefinite (source, eq. 4.28)",
            equations
                .springs
                .iter()
                .filter(|spring| !spring.value.rest.is_zero())
                .map(|s| {
                    let rest = s.value.rest.to_f64();
                    (s.element.clone(), format!("its rest angle of {rest} rad adds a constant torque"))
                })
                .collect(),
        ),
        assumption("the damping is linear in the speeds and passive (source, eq. 4.29)", lossy(equations)),
        assumption("the input matrix is constant (source, eq. 4.30)", Vec::new()),
        assumption(
            "the constraints are holonomic, scleronomic and linear with constant coefficients (source, eq. 4.31)",
            equations
                .constraints
                .iter()
                .filter(|constraint| !constraint.value.is_zero())
                .filter(|constraint| !equations.moving.contains_key(&constraint.element))
                .map(|c| (c.element.clone(), format!("its offset of {} rad is not zero", c.value.to_f64())))
                .chain(equations.moving.iter().map(|(element, function)| {
                    (element.clone(), format!("it is rheonomic: its offset {} depends on the time", function.text()))
                }))
                .chain(
                    equations
                        .transmissions
                        .iter()
                        .map(|t| (t.element.clone(), "its transmission ratio depends on the angle".to_string())),
                )
                .collect(),
        ),
    ];
    let opens = |(_, unilateral): &(usize, &DirectionalTerm<UnilateralConstraint>)| {
        !matches!(unilateral.value, UnilateralConstraint::GearLoss(_)) && !stuck.contains(&unilateral.element)
    };
    let here: BTreeMap<usize, Contact> =
        contacts(reduced, position).into_iter().map(|one| (one.unilateral, one)).collect();
    let open = equations.unilaterals.iter().enumerate().filter(opens);
    let open: BTreeMap<String, String> = open
        .map(|(number, unilateral)| (unilateral.element.clone(), describe_contact_state(here.get(&number)).to_string()))
        .collect();
    if !open.is_empty() {
        let open = open.into_iter().collect();
        assumptions.push(assumption("no constraint is unilateral or switched (source, Table 4.2)", open));
    }
    let bent = (0..equations.laws.len()).filter(|law| !is_linear_law(reduced, *law)).map(|law| &equations.laws[law]);
    let bent: Vec<_> = bent.map(|law| (law.element.clone(), describe_law(&law.value))).collect();
    if !bent.is_empty() {
        let statement = "no other torques act than those of springs, dampers and inputs (source, eq. 4.36)";
        assumptions.push(assumption(statement, bent));
    }
    let constraints = constraints(reduced, stuck);
    Class {
        constant_linear: assumptions.iter().all(|assumption| assumption.satisfied),
        assumptions,
        constraints,
        operating_point: operating_point(equations, &kinematics.angles, stuck),
    }
}

/// The class of every constraint, those of stuck frictions included.
fn constraints(reduced: &Reduced, stuck: &BTreeSet<String>) -> Vec<ConstraintClass> {
    let equations = &reduced.equations;
    let shafts = &equations.coordinates;
    let linear = equations.constraints.iter().map(|c| {
        let excited = equations.moving.contains_key(&c.element).then_some(
            "linear, its right-hand side depends on the time: a kinematic excitation (source, sec. 4.1.1); solved exactly, the matrices are \
             those of Theorem 4.1",
        );
        ConstraintClass {
            scleronomic: excited.is_none(),
            reason: excited.map(String::from),
            ..equality(&c.element, format!("{} = {}", format_row(&c.row, shafts, ""), equations.format_offset(c)))
        }
    });
    let curves = equations.transmissions.iter().map(|t| ConstraintClass {
        linear: false,
        ..equality(&t.element, format!("{} = γ({})", shafts[t.driven], shafts[t.driving]))
    });
    let redundant = reduced.redundant.iter().map(|Redundant { constraint: c, shares }| {
        let independent: Vec<&str> =
            shares.iter().map(|(independent, _)| equations.constraints[*independent].element.as_str()).collect();
        let equation = format!("{} = {}", format_row(&c.row, shafts, ""), c.value.to_f64());
        equality(&c.element, format!("{equation}, which follows from {}", independent.join(", ")))
    });
    let stuck_frictions = equations.frictions.iter().filter(|f| stuck.contains(&f.element));
    let sticking = stuck_frictions
        .map(|f| equality(&f.element, format!("{} = 0 while it sticks", format_row(&f.row, shafts, "'"))));
    let unilaterals = equations
        .unilaterals
        .iter()
        .filter_map(|unilateral| unilateral_class(unilateral, shafts, stuck.contains(&unilateral.element)));
    linear.chain(redundant).chain(curves).chain(sticking).chain(unilaterals).collect()
}

/// An equality between positions with constant coefficients.
fn equality(element: &str, equation: String) -> ConstraintClass {
    ConstraintClass {
        element: element.into(),
        equation,
        equality: true,
        holonomic: Some(true),
        scleronomic: true,
        linear: true,
        reason: None,
    }
}

/// How an analysis treats a unilateral or switched constraint.
fn describe_contact_state(contact: Option<&Contact>) -> &'static str {
    match contact {
        Some(one) if one.soft && one.is_passed() => {
            "it is unilateral; here it is in contact, and its stiffness and damping count as long as it stays so"
        }
        Some(one) if one.is_touched() => "it is unilateral; here it is touched and treated as open",
        _ => "it is unilateral or switched; here it is open",
    }
}

/// The class of a unilateral or switched constraint; `None` for a pure friction or contact torque.
fn unilateral_class(
    unilateral: &DirectionalTerm<UnilateralConstraint>,
    shafts: &[String],
    stuck: bool,
) -> Option<ConstraintClass> {
    let row = |mark: &str| format_row(&unilateral.row, shafts, mark);
    let open =
        format!("the linear analysis treats it as open; with `stuck = [\"{}\"]` it is enforced", unilateral.element);
    let (equation, is_equality, holonomic, scleronomic) = match &unilateral.value {
        _ if stuck => (format!("{} = 0 while it is enforced", row("'")), true, true, true),
        UnilateralConstraint::Friction { .. }
        | UnilateralConstraint::Cushion { .. }
        | UnilateralConstraint::GearLoss(_) => return None,
        UnilateralConstraint::OneWay => (format!("{} >= 0", row("'")), false, false, true),
        UnilateralConstraint::Stop { offset, .. } => (format!("{} >= {}", row(""), offset.to_f64()), false, true, true),
        UnilateralConstraint::Lock { engaged } => {
            let while_engaged = engaged.expression.text();
            (format!("{} = 0 while {while_engaged} > 0.5", row("'")), true, true, !engaged.is_of_time())
        }
    };
    Some(ConstraintClass {
        equality: is_equality,
        holonomic: Some(holonomic),
        scleronomic,
        reason: (!stuck).then_some(open),
        ..equality(&unilateral.element, equation)
    })
}

/// Which part of (4.31) of the source a constraint enforced by a multiplier violates, if any.
fn multiplier_breach(class: &ConstraintClass, value_at_zero: Option<&Rational>) -> Option<String> {
    let scope_note = "the analysis describes small motions around the operating point, with its row evaluated there";
    match class {
        ConstraintClass { linear: false, .. } => {
            Some(format!("it is not linear with constant coefficients: {scope_note}"))
        }
        ConstraintClass { scleronomic: false, .. } => Some(format!("it is rheonomic: {scope_note}")),
        _ => value_at_zero.filter(|value| !value.is_zero()).map(|value| {
            format!("its expression is not zero at zero angles but {}: {scope_note}", rational_to_f64(value))
        }),
    }
}

/// The classes of constraints that a simulation enforces by multipliers, how they were decided, and which part of (4.31) of the source each violates.
pub fn multiplier_constraint_classes(reduced: &Reduced) -> Vec<(ConstraintClass, Option<String>)> {
    let again = &reduced.equations.dependent_constraints;
    if again.is_empty() {
        return multiplier_classes(reduced);
    }
    let mut all = reduced.clone();
    all.equations
        .multiplier_constraints
        .extend(std::mem::take(&mut all.equations.dependent_constraints).into_iter().map(|one| one.row));
    let mut found = multiplier_classes(&all);
    for (class, _) in &mut found {
        if let Some(one) = again.iter().find(|one| one.row.element == class.element) {
            let from: Vec<&str> = one.shares.iter().map(|(name, _)| name.as_str()).collect();
            class.equation += &format!(", which follows from {}", from.join(", "));
        }
    }
    found
}

fn multiplier_classes(reduced: &Reduced) -> Vec<(ConstraintClass, Option<String>)> {
    let equations = &reduced.equations;
    let shafts = &equations.coordinates;
    let tests = integrable(reduced);
    let motion = Motion::new(reduced);
    let combined = combined(reduced, &tests, &motion);
    let begin = Motion::at_time_zero(reduced);
    let varying = motion.graph.varying();
    let first = motion.frictions.len() - motion.multiplier_constraints.len();
    let timed = motion.timed.symbols(&motion.graph);
    let one = |(k, constraint): (usize, &MultiplierConstraint)| {
        let row: Vec<Expr> = motion.frictions[first + k].values().copied().collect();
        let linear = row.iter().all(|entry| !varying(*entry));
        // What follows from the time by other constraints is part of the row.
        let all: Vec<Expr> = row.iter().copied().chain(motion.multiplier_constraints[k].speed).collect();
        let of_time = motion.graph.symbols(&all).iter().any(|symbol| timed.contains(symbol));
        let multiplier =
            "no theorem of the source solves it; a simulation enforces it with its multiplier (source, eq. 4.18)";
        let prescribed = |row: &[(usize, Exact)], mark: &str, function: String, why: &str| {
            let row: Vec<(usize, Rational)> = row.iter().map(|(shaft, x)| (*shaft, x.to_rational())).collect();
            let equation = format!("{} = {function}", format_row(&row, shafts, mark));
            (equation, Some(true), false, format!("constant coefficients: {why}; {multiplier}"))
        };
        let (equation, holonomic, scleronomic, reason) = match &constraint.law {
            MultiplierLaw::Surface(formula) => {
                let slopes = if linear { "are constant" } else { "depend on positions" };
                let reason = format!(
                    "it has no speeds, so it is holonomic; its exact derivatives {slopes}; of the form (4.5), with the row of (4.6), but \
                     not solved for a coordinate: a simulation enforces it with its multiplier (source, eq. 4.18)"
                );
                (format!("{} = 0", formula.expression.text()), Some(true), !of_time, reason)
            }
            MultiplierLaw::Rates(row) => {
                let term = |(shaft, a): &(usize, _)| -> String {
                    let formula: &Arc<Formula> = a;
                    format!("({}) {}'", formula.expression.text(), shafts[*shaft])
                };
                let equation = format!("{} = 0", row.iter().map(term).collect::<Vec<_>>().join(" + "));
                let (holonomic, why) = judged(&tests.rows[k], linear, &combined);
                let moves =
                    if of_time { "; its coefficients depend on the time through other prescribed motions" } else { "" };
                (equation, holonomic, !of_time, if linear { why } else { format!("{why}{moves}; {multiplier}") })
            }
            MultiplierLaw::Prescribed { row, order, function } => {
                let why = match order {
                    0 => "a kinematic excitation (source, sec. 4.1.1) that drives a curve from its output side",
                    1 => "its integral over time is a relation between positions",
                    _ => "its second integral over time is a relation between positions",
                };
                prescribed(row, &"'".repeat(*order), function.text(), why)
            }
        };
        let reason = Some(reason);
        let class =
            ConstraintClass { holonomic, scleronomic, linear, reason, ..equality(&constraint.element, equation) };
        let origin = begin.multiplier_constraints[k].position.and_then(|position| {
            lower(&begin.graph, &[position], &mut Rationals, |_| Some(Rational::ZERO)).pop().flatten()
        });
        let breach = multiplier_breach(&class, origin.as_ref());
        (class, breach)
    };
    equations.multiplier_constraints.iter().enumerate().map(one).collect()
}

/// Longer expressions are truncated.
const MOST_OF_LAW: usize = 160;

/// Whether a row of speeds is a relation between positions, if that is decided, and how.
fn judged(test: &Integrable, linear: bool, combined: &str) -> (Option<bool>, String) {
    let (holonomic, why) = match test {
        Integrable::No(point) => (
            Some(false),
            format!(
                "Frobenius' test is not zero, exactly, at the generic point {point}: no relation between positions is equivalent to it"
            ),
        ),
        _ if linear => {
            let why = "its coefficients are constant, given the other constraints: it is the rate of a linear relation \
                       between positions; the matrices are those of Theorem 4.1; a simulation enforces it with its \
                       multiplier (source, eq. 4.18)";
            return (Some(true), why.into());
        }
        Integrable::Closed => {
            let why = "the cross derivatives of its coefficients are equal, exactly: it is the rate of a relation between positions";
            (Some(true), why.to_string())
        }
        Integrable::AtAllPoints(points, accident) => (
            Some(true),
            format!(
                "Frobenius' test is zero at {points} random points modulo random primes: it is a relation between \
                 positions; wrong with a probability below {accident:.0e}"
            ),
        ),
        Integrable::NotDecided(why) => {
            let open = "it is not decided whether a relation between positions is equivalent to it";
            return (None, format!("{open}: no integrating factor was found, and {why}"));
        }
    };
    (holonomic, why + combined)
}

/// What several rows imply together: how many relations between positions, and the simple ones.
fn combined(reduced: &Reduced, tests: &Integrals, motion: &Motion) -> String {
    let multiplier_constraints = &reduced.equations.multiplier_constraints;
    let Some(relations) = tests.relations.filter(|_| multiplier_constraints.len() > 1) else { return String::new() };
    let names = reduced.coordinate_names();
    let elements: Vec<String> = multiplier_constraints.iter().map(|constraint| constraint.element.clone()).collect();
    let sum = |(factors, row): &(Vec<Rational>, Vec<(usize, Rational)>)| {
        let factors = factors.iter().cloned().enumerate().filter(|(_, factor)| !factor.is_zero());
        let factors: Vec<(usize, Rational)> = factors.collect();
        format!("{} gives {} = 0", format_row(&factors, &elements, ""), format_row(row, &names, "'"))
    };
    let sums: Vec<String> = tests.sums.iter().map(sum).collect();
    let sums = if sums.is_empty() { String::new() } else { format!(" ({})", sums.join("; ")) };
    let of_time = if motion.timed.time.is_some() { " and the time" } else { "" };
    let some = match relations {
        0 => "no relation".to_string(),
        1 => "one relation".to_string(),
        more => format!("{more} independent relations"),
    };
    format!("; all {} rows together imply {some} between positions{of_time}{sums}", multiplier_constraints.len())
}

/// Text of a torque expression.
fn describe_law(law: &Formula) -> String {
    let text: String = match law.expression.text() {
        long if long.chars().count() > MOST_OF_LAW => long.chars().take(MOST_OF_LAW).chain(" ...".chars()).collect(),
        text => text.into(),
    };
    let of_time = if law.is_of_time() { ", and depends on the time" } else { "" };
    format!(
        "its torque is the expression {text}{of_time}: the analysis describes small motions around the operating point"
    )
}

/// The operating point: angles (rad) and which frictions stick.
fn operating_point(equations: &Equations, angles: &[f64], stuck: &BTreeSet<String>) -> OperatingPoint {
    OperatingPoint {
        angles: (0..equations.coordinates.len())
            .filter(|&k| equations.domain(k) == Domain::Rotation)
            .map(|k| ShaftAngle { shaft: equations.coordinates[k].clone(), angle: angles[k] })
            .collect(),
        friction: equations
            .frictions
            .iter()
            .map(|f| FrictionState {
                element: f.element.clone(),
                coulomb_torque: f.value.torque.to_f64(),
                stuck: stuck.contains(&f.element),
            })
            .collect(),
        ..OperatingPoint::default()
    }
}

fn assumption(statement: &str, breaches: Vec<(String, String)>) -> Assumption {
    let breaches: Vec<Breach> = breaches.into_iter().map(|(element, why)| Breach { element, reason: why }).collect();
    Assumption { statement: statement.into(), satisfied: breaches.is_empty(), violations: breaches }
}

/// Shafts that keep the inertia matrix of all shafts from being definite.
fn massless(equations: &Equations) -> Vec<(String, String)> {
    match definiteness(&equations.inertia_matrix()) {
        Definiteness::Positive => Vec::new(),
        Definiteness::PositiveSemi { .. } => {
            let with: BTreeSet<usize> =
                equations.inertias.iter().flat_map(|term| term.row.iter().map(|(shaft, _)| *shaft)).collect();
            let massless_shafts = (0..equations.coordinates.len()).filter(|shaft| !with.contains(shaft));
            let what = |shaft| match equations.domain(shaft) {
                Domain::Rotation => "it has no inertia of its own",
                Domain::Translation => "it has no mass of its own",
                Domain::Charge => "it has no inductance of its own",
                Domain::Number => "it has no rate of its own",
            };
            let mut out: Vec<_> =
                massless_shafts.map(|shaft| (equations.coordinates[shaft].clone(), what(shaft).into())).collect();
            if out.is_empty() {
                out.push(("(all)".into(), "a motion of the shafts has no kinetic energy".into()));
            }
            out
        }
        Definiteness::Indefinite { .. } => vec![("(all)".into(), "a motion has negative kinetic energy".into())],
    }
}

fn lossy(equations: &Equations) -> Vec<(String, String)> {
    let mut out: Vec<(String, String)> = equations
        .frictions
        .iter()
        .map(|f| {
            (
                f.element.clone(),
                format!("its Coulomb friction of {} N m is not linear in the speed", f.value.torque.to_f64()),
            )
        })
        .collect();
    let teeth =
        equations.unilaterals.iter().filter(|unilateral| matches!(unilateral.value, UnilateralConstraint::GearLoss(_)));
    out.extend(teeth.map(|unilateral| {
        let why = "its load-dependent gear friction is not linear; the analysis neglects it";
        (unilateral.element.clone(), why.to_string())
    }));
    let mut negative = equations.dampers.iter().filter(|d| d.value.signum() < 0).peekable();
    if negative.peek().is_some()
        && let Definiteness::Indefinite { .. } = definiteness(&equations.damping_matrix())
    {
        out.extend(negative.map(|d| (d.element.clone(), "its negative damping gives energy to some motion".into())));
    }
    out
}

/// `wg - 51 cs + 50 fs`, each name followed by `mark`.
fn format_row(row: &[(usize, Rational)], shafts: &[String], mark: &str) -> String {
    signed_sum(row, "-", |shaft, size| match size {
        None => format!("{}{mark}", shafts[*shaft]),
        Some(size) => format!("{} {}{mark}", rational_to_f64(size), shafts[*shaft]),
    })
}
