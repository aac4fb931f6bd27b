//! The reduced equations of motion as text or LaTeX.

use std::collections::BTreeSet;
use std::fmt::Write;

use crate::study::check::multiplier_constraints::multiplier_elements;
use crate::study::check::redundant_torques::redundancy_notes;
use crate::study::equations::form::{EquationsForm, kinds};
use crate::study::equations::latex_lines::{aligned, index, motion, one_line};
use crate::study::equations::multiplier_equations::{effort_mark, multiplier_lines, of_time};
use crate::study::read::state_names::{motors, scaled_term};
use crate::study::run::model_summary::matrix_titles;
use crate::study::{PreparedVariant, Project};
use kardan_expr::expr::Style;
use kardan_expr::plan;
use kardan_math::names::{SignedTerm, signed_sum};
use kardan_math::num::{Matrix, Rational, Scalar, rational_to_f64};
use kardan_mechanics::assemble::DirectionalTerm;
use kardan_mechanics::equations::{Domain, InputKind, UnilateralConstraint};
use kardan_mechanics::reduce::{Kinematics, LinearModel, Motion, Reduced, is_linear_law, linearise};
use kardan_results::signal_name::Quantity;
use kardan_results::{ConstraintEquation, Equation, ExactMatrix, MotionEquations};
use kardan_schema::diagnostics::Diagnostic;

/// The reduced equations of motion `H_r q̈_r + D_r q̇_r + S_r q_r = F_r τ` of the first variant, with its constraints,
/// friction, and the warnings of the file.
///
/// For configuration-dependent constraints the matrices are those at the initial position.
///
/// # Errors
/// All errors of the file.
pub fn equations(source: &str, form: EquationsForm) -> Result<(String, Vec<Diagnostic>), Vec<Diagnostic>> {
    Project::open(source).equations(form)
}

impl Project {
    /// The equations of motion of the first variant; see [`equations`](crate::study::equations()).
    ///
    /// # Errors
    /// All errors.
    pub fn equations(&self, form: EquationsForm) -> Result<(String, Vec<Diagnostic>), Vec<Diagnostic>> {
        let (variant, diagnostics) = self.for_equations()?;
        let model = linear_part(variant);
        let text = match form {
            EquationsForm::Text => text(variant, &model),
            EquationsForm::Latex => latex(variant, &model),
            EquationsForm::Plan => operations(variant),
        };
        Ok((text, diagnostics))
    }

    /// The equations of motion of the first variant as data, and the warnings of the file.
    ///
    /// # Errors
    /// All errors.
    pub fn motion_equations(&self) -> Result<(MotionEquations, Vec<Diagnostic>), Vec<Diagnostic>> {
        let (variant, diagnostics) = self.for_equations()?;
        let model = linear_part(variant);
        let lines = lines(variant, &model, Style::Text, &text_mark).into_iter();
        let constraints = constraints(variant, Style::Text, &text_mark).into_iter();
        let exact = [&model.inertia, &model.damping, &model.stiffness, &model.input];
        let matrices = matrices(variant, &model).into_iter().zip(["H", "D", "S", "F"]).zip(exact);
        let matrices = matrices.map(|(((title, unit, matrix, columns), name), exact)| ExactMatrix {
            name: name.into(),
            title,
            unit: unit.into(),
            rows: model.coordinates.clone(),
            columns: columns.to_vec(),
            values: matrix.to_rows(),
            exact: Some(
                (0..exact.rows()).map(|i| (0..exact.columns()).map(|j| exact[(i, j)].to_string()).collect()).collect(),
            ),
        });
        let found = MotionEquations {
            model: variant.model.name.clone(),
            coordinates: model.coordinates.clone(),
            inputs: model.inputs.clone(),
            constant: Kinematics::new(&variant.reduced).is_constant(),
            equations: lines.map(|(left, right)| Equation { left, right }).collect(),
            constraints: constraints.map(|(element, equation)| ConstraintEquation { element, equation }).collect(),
            matrices: matrices.collect(),
            latex: latex(variant, &model),
            symbolic: None,
        };
        Ok((found, diagnostics))
    }
}

/// The matrices at the start, with the linear laws of torque; the others appear by name on the right.
fn linear_part(variant: &PreparedVariant) -> LinearModel {
    let mut reduced = variant.reduced.clone();
    let bent = bent_laws(&reduced);
    let mut number = 0..;
    reduced.equations.laws.retain(|_| number.next().is_none_or(|law| !bent.contains(&law)));
    linearise(&reduced, &variant.scenario.position)
}

/// Numbers of the laws of torque that are not linear.
fn bent_laws(reduced: &Reduced) -> Vec<usize> {
    (0..reduced.equations.laws.len()).filter(|law| !is_linear_law(reduced, *law)).collect()
}

/// The plan of the equations of motion, with its cost; [`kardan_expr::plan::parse`] reads it.
fn operations(variant: &PreparedVariant) -> String {
    // For motions without inertia the equations themselves, not the method of a run.
    let motion = Motion::new(&Reduced { massless: None, ..variant.reduced.clone() });
    let compiled = motion.compile(&motion.outputs(&variant.reduced));
    let counts: Vec<String> =
        compiled.counts().iter().map(|(operator, count)| format!("{count} {}", plan::word(*operator))).collect();
    format!(
        "# Equations of motion of {}: H q'' = force + forces of frictions and inputs along their directions{}; SI units.\n\
         # {} operations, {} floating-point operations: {}\n{compiled}",
        variant.model.name,
        if motion.multiplier_constraints.is_empty() {
            ""
        } else {
            " and of multipliers of constraints, where kept q'' + kept = 0"
        },
        compiled.operations(),
        compiled.flops(),
        counts.join(", "),
    )
}

/// Names with their coefficients, except zero, as terms of a sum.
fn terms(all: impl Iterator<Item = (Rational, String)>) -> impl Iterator<Item = SignedTerm> {
    let kept = all.filter(|(coefficient, _)| !Scalar::is_zero(coefficient));
    kept.map(|(coefficient, name)| scaled_term(rational_to_f64(&coefficient), &name))
}

fn row(matrix: &Matrix<Rational>, i: usize, names: &[String]) -> Vec<(Rational, String)> {
    names.iter().enumerate().map(|(j, name)| (matrix[(i, j)].clone(), name.clone())).collect()
}

/// Whether it is the loss of a gear.
fn is_loss(unilateral: &DirectionalTerm<UnilateralConstraint>) -> bool {
    matches!(unilateral.value, UnilateralConstraint::GearLoss(_))
}

/// Left-hand and right-hand side of each reduced equation.
fn lines(
    variant: &PreparedVariant,
    model: &LinearModel,
    style: Style,
    mark: &dyn Fn(&str, usize) -> String,
) -> Vec<(String, String)> {
    let marked = |order: usize| model.coordinates.iter().map(|name| mark(name, order)).collect::<Vec<_>>();
    let input = |input: &DirectionalTerm<InputKind>| match input.value {
        InputKind::Motor(_) => mark(&input.element, effort_mark(variant.reduced.equations.domain_of(input))),
        InputKind::Disturbance => mark(&input.element, 5),
    };
    let inputs: Vec<String> = variant.reduced.equations.inputs.iter().map(input).collect();
    let bent = bent_laws(&variant.reduced);
    let constraint_lines = multiplier_lines(variant, style, mark);
    let equations = &variant.reduced.equations;
    let effort = |domain: Domain| if domain == Domain::Translation { 7 } else { 3 };
    (0..model.coordinates.len())
        .map(|i| {
            let left = [(&model.inertia, 2), (&model.damping, 1), (&model.stiffness, 0)]
                .into_iter()
                .flat_map(|(matrix, order)| row(matrix, i, &marked(order)));
            let share = |row: &[(usize, Rational)]| {
                row.iter().fold(Rational::ZERO, |sum, (shaft, x)| sum.plus(&x.times(&model.basis[(*shaft, i)])))
            };
            let friction = equations.frictions.iter().filter_map(|friction| {
                let coefficient = share(&friction.row);
                (!Scalar::is_zero(&coefficient)).then(|| {
                    let torque = friction.value.torque.to_rational().times(&coefficient);
                    (torque, mark(&friction.element, 4))
                })
            });
            let unilaterals = equations.unilaterals.iter().enumerate().filter_map(|(k, unilateral)| {
                // Both sides of a stop are one torque; the loss of its gear is another.
                let same = |candidate: &DirectionalTerm<UnilateralConstraint>| {
                    candidate.element == unilateral.element && is_loss(candidate) == is_loss(unilateral)
                };
                let again = equations.unilaterals[..k].iter().any(same);
                let own = share(&unilateral.row);
                let signed = if unilateral.value.is_upper() { Rational::ZERO.minus(&own) } else { own };
                let kind = if is_loss(unilateral) { 8 } else { effort(equations.domain_of(unilateral)) };
                let counts = !again && !Scalar::is_zero(&signed);
                counts.then(|| (signed, mark(&unilateral.element, kind)))
            });
            let laws = bent.iter().map(|law| &equations.laws[*law]);
            let laws = laws.map(|law| (share(&law.row), mark(&law.element, effort(equations.domain_of(law)))));
            let right = row(&model.input, i, &inputs).into_iter().chain(laws);
            let multiplier_terms = constraint_lines.iter().filter_map(|line| line.shares[i].clone());
            let left = terms(left.chain(friction).chain(unilaterals));
            (signed_sum(left), signed_sum(terms(right).chain(multiplier_terms)))
        })
        .collect()
}

fn constraints(variant: &PreparedVariant, style: Style, mark: &dyn Fn(&str, usize) -> String) -> Vec<(String, String)> {
    let equations = &variant.reduced.equations;
    let angle = |name: &str| mark(name, 0);
    let redundant = variant.reduced.redundant.iter().map(|row| &row.constraint);
    let linear = equations.constraints.iter().chain(redundant).map(|constraint| {
        let row = constraint.row.iter().map(|(shaft, x)| (x.clone(), angle(&equations.coordinates[*shaft])));
        let offset = match equations.moving.get(&constraint.element) {
            Some(function) => of_time(function, style),
            None => equations.format_offset(constraint),
        };
        (constraint.element.clone(), format!("{} = {offset}", signed_sum(terms(row))))
    });
    let curves = equations.transmissions.iter().map(|t| {
        let (driven, driving) = (angle(&equations.coordinates[t.driven]), angle(&equations.coordinates[t.driving]));
        (t.element.clone(), format!("{driven} = γ({driving})"))
    });
    let constraint_lines = multiplier_lines(variant, style, mark).into_iter().map(|line| (line.element, line.equation));
    linear.chain(curves).chain(constraint_lines).collect()
}

/// A name in the text: of a coordinate by the order of its derivative, of a motor's torque, friction, disturbance, voltage or force.
fn text_mark(name: &str, order: usize) -> String {
    match order {
        0 | 5 => name.to_string(),
        1 => format!("{name}'"),
        2 => format!("{name}''"),
        3 => Quantity::Torque.of(name),
        6 => Quantity::Voltage.of(name),
        7 => Quantity::Force.of(name),
        8 => Quantity::Friction.of(name),
        9 => Quantity::Multiplier.of(name),
        _ => format!("sgn({name}')"),
    }
}

/// Remarks on the equations of motion.
fn notes(variant: &PreparedVariant, out: &mut String) {
    if !variant.reduced.equations.frictions.is_empty() {
        out.push_str("  sgn is set-valued at rest: any value from -1 to 1.\n");
    }
    let unilaterals = &variant.reduced.equations.unilaterals;
    let named = |gears: bool| {
        let own = unilaterals.iter().filter(|unilateral| is_loss(unilateral) == gears);
        let names: BTreeSet<&str> = own.map(|unilateral| unilateral.element.as_str()).collect();
        names.into_iter().collect::<Vec<_>>().join(", ")
    };
    let (gears, unilaterals) = (named(true), named(false));
    if !gears.is_empty() {
        let _ = writeln!(out, "  The gear losses of {gears} depend on the transmitted torque.");
    }
    if !unilaterals.is_empty() {
        let _ = writeln!(
            out,
            "  The forces of {unilaterals} depend on their states: in contact, slipping, sticking or open."
        );
    }
    if !Kinematics::new(&variant.reduced).is_constant() {
        out.push_str("  The matrices depend on the position; these are valid at the initial position, near rest.\n");
    }
    if !variant.reduced.equations.multiplier_constraints.is_empty() {
        let elements = multiplier_elements(&variant.reduced).collect::<Vec<_>>().join(", ");
        let _ = writeln!(
            out,
            "  Multipliers enforce {elements} at every position: forces on the right, whose values follow from the \
             constraints."
        );
    }
    if !variant.reduced.equations.moving.is_empty() {
        let moving = variant.reduced.equations.moving.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
        let _ = writeln!(
            out,
            "  Offsets that depend on the time ({moving}) are constant here; --plan includes their motion."
        );
    }
}

fn text(variant: &PreparedVariant, model: &LinearModel) -> String {
    let mut out = String::new();
    let kinds = kinds(variant);
    let kind_names: Vec<&str> = kinds.iter().map(|kind| kind.plural).collect();
    let kind_names = match kind_names.as_slice() {
        [kind_names @ .., last] if !kind_names.is_empty() => format!("{} and {last}", kind_names.join(", ")),
        kind_names => kind_names.concat(),
    };
    let kind_names = kind_names[..1].to_uppercase() + &kind_names[1..];
    let units: Vec<&str> = kinds.iter().map(|kind| kind.units).collect();
    let counts: Vec<String> = kinds.iter().map(|kind| format!("{} {}", kind.plural, kind.count)).collect();
    let (name, counts) = (&variant.model.name, counts.join(", "));
    let _ = writeln!(out, "Model {name}: {counts}, degrees of freedom {}", model.coordinates.len());
    let _ = writeln!(out, "Coordinates: {} ({})\n", model.coordinates.join(", "), units.join(", "));
    out.push_str("Equations of motion\n");
    for (left, right) in lines(variant, model, Style::Text, &text_mark) {
        let _ = writeln!(out, "  {left} = {right}");
    }
    notes(variant, &mut out);
    let constraints = constraints(variant, Style::Text, &text_mark);
    if !constraints.is_empty() {
        out.push_str("\nConstraints\n");
        for (element, line) in constraints {
            let _ = writeln!(out, "  {element}: {line}");
        }
        for note in redundancy_notes(&variant.reduced) {
            let _ = writeln!(out, "  {note}");
        }
    }
    let dependents = variant.reduced.dependents();
    if !dependents.is_empty() {
        let _ = writeln!(out, "\n{kind_names} from coordinates (rates)");
        let rates: Vec<String> = model.coordinates.iter().map(|name| format!("{name}'")).collect();
        for shaft in dependents {
            let _ = writeln!(
                out,
                "  {}' = {}",
                variant.reduced.equations.coordinates[shaft],
                signed_sum(terms(row(&model.basis, shaft, &rates).into_iter()))
            );
        }
    }
    for (title, unit, matrix, columns) in matrices(variant, model) {
        let _ = writeln!(out, "\n{title}{}", if unit.is_empty() { String::new() } else { format!(" [{unit}]") });
        table(&model.coordinates, columns, &matrix, &mut out);
    }
    out
}

fn matrices<'m>(
    variant: &PreparedVariant,
    model: &'m LinearModel,
) -> Vec<(String, &'static str, Matrix<f64>, &'m [String])> {
    let capital = |word: &str| word[..1].to_uppercase() + &word[1..];
    let numbers = [&model.inertia, &model.damping, &model.stiffness];
    let titles = matrix_titles(&variant.reduced).into_iter().zip(numbers);
    let own = titles.map(|((word, unit), matrix)| (capital(word), unit, matrix.to_f64(), model.coordinates.as_slice()));
    own.chain([("Input map".to_string(), "", model.input.to_f64(), model.inputs.as_slice())]).collect()
}

fn table(rows: &[String], columns: &[String], matrix: &Matrix<f64>, out: &mut String) {
    if columns.is_empty() {
        out.push_str("  (no columns)\n");
        return;
    }
    let head = rows.iter().map(String::len).max().unwrap_or(0);
    let cells: Vec<Vec<String>> = matrix.to_rows().iter().map(|row| row.iter().map(f64::to_string).collect()).collect();
    let widths: Vec<usize> = (0..columns.len())
        .map(|j| cells.iter().map(|row| row[j].len()).chain([columns[j].len()]).max().unwrap_or(0))
        .collect();
    let mut line = |name: &str, values: &[String]| {
        let mut text = format!("  {name:head$}");
        for (value, &width) in values.iter().zip(&widths) {
            let _ = write!(text, "  {value:>width$}");
        }
        let _ = writeln!(out, "{}", text.trim_end());
    };
    line("", columns);
    for (name, row) in rows.iter().zip(&cells) {
        line(name, row);
    }
}

/// A matrix of more columns needs a larger counter of amsmath.
const MOST_COLUMNS: usize = 10;

fn latex(variant: &PreparedVariant, model: &LinearModel) -> String {
    let kinds = kinds(variant);
    let mark = |name: &str, order: usize| {
        let index = index(name);
        let domain = variant.reduced.coordinate(name).map(|k| variant.reduced.equations.domain(k));
        let motion = |order: usize| motion(domain.unwrap_or_default(), order, name);
        match order {
            5 => index,
            0..=2 => motion(order),
            3 => format!(r"\tau_{{{index}}}"),
            6 => format!("u_{{{index}}}"),
            7 => format!("f_{{{index}}}"),
            8 => format!(r"\tau_{{{index},\mathrm{{loss}}}}"),
            9 => format!(r"\lambda_{{{index}}}"),
            _ => format!(r"\operatorname{{sgn}}{}", motion(1)),
        }
    };
    let mut out = String::new();
    let units: Vec<&str> = kinds.iter().map(|kind| kind.units).collect();
    let _ = writeln!(out, "% Model {}: {}. Needs amsmath.", one_line(&variant.model.name), units.join("; "));
    let mut note_lines = String::new();
    notes(variant, &mut note_lines);
    note_lines.lines().for_each(|line| out.push_str(&format!("% {}\n", line.trim())));
    let mut rows = lines(variant, model, Style::Latex, &mark);
    rows.extend(constraints(variant, Style::Latex, &mark).into_iter().map(|(_, line)| {
        let (left, right) = line.split_once(" = ").unwrap_or((&line, "0"));
        (left.to_string(), right.replace('γ', r"\gamma"))
    }));
    out.push_str(&aligned(&rows));
    let names = ["H_r", "D_r", "S_r", "F_r"];
    for (name, (_, _, matrix, _)) in names.iter().zip(matrices(variant, model)) {
        let rows: Vec<String> =
            matrix.to_rows().iter().map(|row| row.iter().map(f64::to_string).collect::<Vec<_>>().join(" & ")).collect();
        if matrix.columns() > MOST_COLUMNS {
            let _ = writeln!(out, "\\setcounter{{MaxMatrixCols}}{{{}}}", matrix.columns());
        }
        let _ = writeln!(out, "\\[ {name} = \\begin{{bmatrix}} {} \\end{{bmatrix}} \\]", rows.join(r" \\ "));
    }
    let motors: Vec<&str> = motors(&variant.reduced.equations).map(|input| input.element.as_str()).collect();
    let circuit = kinds.iter().any(|kind| kind.plural == "charges");
    let kind = if circuit { "motors and voltage sources" } else { "motors" };
    let _ = writeln!(out, "% Columns of F_r: all inputs in order of name; {kind}: {}", motors.join(", "));
    out
}
