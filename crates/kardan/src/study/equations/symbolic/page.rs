//! Symbolic equations for a terminal and for a document.

use std::fmt::Write;

use crate::study::PreparedVariant;
use crate::study::equations::form::kinds;
use crate::study::equations::latex_lines::{LINE, aligned, index, one_line, width, word};
use kardan_results::{
    SymbolOfValue, SymbolicEquations, SymbolicFormula, SymbolicMode, SymbolicMultiplierConstraint, SymbolicText,
};

/// Lists of formulas under their titles; empty ones are left out.
fn sections<'e>(variant: &PreparedVariant, found: &'e SymbolicEquations) -> Vec<(String, &'e [SymbolicFormula])> {
    let prescribed = if variant.reduced.equations.prescribes() { ", with those of prescribed motions" } else { "" };
    let sections: [(String, &[SymbolicFormula]); 11] = [
        ("Letters".into(), &found.intermediate_symbols),
        ("Dependent coordinates".into(), &found.dependent_coordinates),
        ("Inertia H, symmetric".into(), &found.inertia),
        (format!("Velocity-dependent forces{prescribed}"), &found.velocity),
        ("Damping D, symmetric".into(), &found.damping),
        ("Stiffness forces".into(), &found.stiffness),
        ("Friction forces; sgn is set-valued at rest: any value from -1 to 1".into(), &found.friction),
        ("Forces of unilateral and switched constraints".into(), &found.unilateral_forces),
        ("Input map F u".into(), &found.input),
        ("Forces of constraints enforced by multipliers, A^T lambda".into(), &found.multiplier_forces),
        ("Constraint torques (multipliers), from the motion of all coordinates".into(), &found.constraint_torques),
    ];
    sections.into_iter().filter(|(_, formulas)| !formulas.is_empty()).collect()
}

/// The assumptions of the equations, as sentences; `mark` writes a formula.
fn assumptions(found: &SymbolicEquations, mark: impl Fn(&SymbolicText) -> String) -> Vec<String> {
    let list = |formulas: &[SymbolicText]| formulas.iter().map(&mark).collect::<Vec<_>>().join(", ");
    let mut out = Vec::new();
    if !found.divisors.is_empty() {
        out.push(format!("None of these may be zero: {}", list(&found.divisors)));
    }
    if !found.zeros.is_empty() {
        out.push(format!(
            "Assumed to be zero, as for the values of the model; otherwise these equations are not valid: {}",
            list(&found.zeros)
        ));
    }
    out
}

/// The form of all equations.
fn form(found: &SymbolicEquations) -> String {
    let unilateral = if found.unilateral_forces.is_empty() { "" } else { " + unilateral" };
    let multiplier_constraints = match found.multiplier_constraints.is_empty() {
        true => "",
        false => " + A^T lambda; lambda follows from A q'' = c",
    };
    format!("H q'' + velocity-dependent + D q' + stiffness + friction{unilateral} = F u{multiplier_constraints}")
}

/// The equations of multiplier constraints, each with its sides: position, rates, accelerations.
fn multiplier_lines(one: &SymbolicMultiplierConstraint) -> Vec<[SymbolicText; 2]> {
    let zero = SymbolicText { text: "0".into(), latex: "0".into() };
    let position = one.position.iter().map(|position| [position.clone(), zero.clone()]);
    let sides = one.rates.iter().chain([&one.accelerations]);
    position.chain(sides.map(|line| [line.symbol.clone(), line.formula.clone()])).collect()
}

/// Explanations of constraint states, functions of time and ripples, as lines.
fn remarks(found: &SymbolicEquations, mark: impl Fn(&SymbolicText) -> String) -> Vec<(String, Vec<String>)> {
    let lines = |list: &[SymbolicMode]| {
        list.iter().map(|one| format!("{}: {}", mark(&one.symbol), one_line(&one.description))).collect()
    };
    let ripples = found.ripples.iter().map(|name| format!("the ripple of {name}, {name}.ripple, which acts beside it"));
    let remarks = [
        (
            "Unilateral and switched constraints; names and numbers as in the model, SI units".to_string(),
            lines(&found.contact_states),
        ),
        ("Functions of time, as they are written".to_string(), lines(&found.prescribed)),
        ("Not in the equations".to_string(), ripples.collect()),
    ];
    remarks.into_iter().filter(|(_, lines): &(_, Vec<String>)| !lines.is_empty()).collect()
}

/// The number of a value with its unit, and what it follows from.
fn number(value: &SymbolOfValue) -> String {
    let follows = value.derived_from.as_ref().map(|text| format!(", from {}", one_line(text))).unwrap_or_default();
    let number = format!("{} {}", value.value, value.unit);
    format!("{}{follows}", number.trim_end())
}

pub(super) fn text(variant: &PreparedVariant, found: &SymbolicEquations) -> String {
    let mut out = String::new();
    let kinds = kinds(variant);
    let counts: Vec<String> = kinds.iter().map(|kind| format!("{} {}", kind.plural, kind.count)).collect();
    let units: Vec<&str> = kinds.iter().map(|kind| kind.units).collect();
    let names = variant.reduced.coordinate_names();
    let shown =
        names.iter().map(|name| if word(name) == *name { name.clone() } else { format!("{} ({name})", word(name)) });
    let shown: Vec<String> = shown.collect();
    let _ = writeln!(out, "Model {}: {}, degrees of freedom {}", variant.model.name, counts.join(", "), names.len());
    let _ = writeln!(out, "Coordinates q: {} ({}; numbers in SI units)", shown.join(", "), units.join(", "));
    let _ = writeln!(out, "{}", form(found));
    if !found.values.is_empty() {
        let width = |of: fn(&SymbolOfValue) -> &String| found.values.iter().map(|value| of(value).len()).max();
        let [a, b] = [width(|value| &value.symbol.text), width(|value| &value.name)].map(Option::unwrap_or_default);
        out.push_str("\nValues\n");
        for value in &found.values {
            let _ = writeln!(out, "  {:a$}  {:b$}  {}", value.symbol.text, value.name, number(value));
        }
    }
    for function in &found.functions {
        let _ = writeln!(
            out,
            "\n{0}(x) is the curve of {1}, {0}'(x) and {0}''(x) are its derivatives.",
            function.symbol.text, function.element
        );
    }
    for (title, formulas) in sections(variant, found) {
        let width = formulas.iter().map(|one| one.symbol.text.len()).max().unwrap_or(0);
        let _ = writeln!(out, "\n{title}");
        // For rigid gears with backlash the multiplier is the torque of the unilateral constraint.
        for SymbolicFormula { symbol, formula } in formulas.iter().filter(|one| one.symbol.text != one.formula.text) {
            let _ = writeln!(out, "  {:width$} = {}", symbol.text, formula.text);
        }
    }
    if !found.multiplier_constraints.is_empty() {
        out.push_str("\nConstraints enforced by multipliers: A q' = b, hence A q'' = c with c = b' - A' q'\n");
        for one in &found.multiplier_constraints {
            let _ = writeln!(out, "  {} with {}", one.element, one.multiplier.text);
            multiplier_lines(one)
                .iter()
                .for_each(|[left, right]| out.push_str(&format!("    {} = {}\n", left.text, right.text)));
        }
    }
    for (title, lines) in remarks(found, |one| one.text.clone()) {
        let _ = writeln!(out, "\n{title}");
        lines.iter().for_each(|line| out.push_str(&format!("  {line}\n")));
    }
    if !found.laws.is_empty() {
        out.push_str("\nInputs that are laws, as they are written; names and numbers as in the model\n");
        found.laws.iter().for_each(|one| out.push_str(&format!("  {} = {}\n", one.element, one_line(&one.law))));
    }
    let assumed = assumptions(found, |one| one.text.clone());
    if !assumed.is_empty() {
        out.push_str("\nAssumed\n");
        assumed.iter().for_each(|sentence| out.push_str(&format!("  {sentence}\n")));
    }
    if !found.zero_parameters.is_empty() {
        let _ = writeln!(out, "\nNot in the equations, as their value is zero: {}", found.zero_parameters.join(", "));
    }
    out
}

pub(super) fn latex(variant: &PreparedVariant, found: &SymbolicEquations) -> String {
    let mut out = String::new();
    let units: Vec<&str> = kinds(variant).iter().map(|kind| kind.units).collect();
    let _ = writeln!(
        out,
        "% Model {}: {}; numbers in SI units. Needs amsmath.",
        one_line(&variant.model.name),
        units.join("; ")
    );
    let _ = writeln!(out, "% {}", form(found));
    for value in &found.values {
        let _ = writeln!(out, "% {}: {} = {}", value.symbol.latex, value.name, number(value));
    }
    for function in &found.functions {
        let _ = writeln!(out, "% {}: the curve of {}", function.symbol.latex, function.element);
    }
    let names = variant.reduced.coordinate_names();
    for (title, formulas) in sections(variant, found) {
        let _ = writeln!(out, "\n% {title}");
        let square = title.starts_with("Inertia") || title.starts_with("Damping");
        if let Some(matrix) = matrix(formulas, &names).filter(|_| square) {
            out.push_str(&matrix);
            continue;
        }
        let pair = |one: &SymbolicFormula| (one.symbol.latex.clone(), one.formula.latex.clone());
        out.push_str(&aligned(&formulas.iter().map(pair).collect::<Vec<_>>()));
    }
    if !found.multiplier_constraints.is_empty() {
        out.push_str("\n% Constraints enforced by multipliers: A q' = b, hence A q'' = c with c = b' - A' q'\n");
        let lines = found.multiplier_constraints.iter().flat_map(multiplier_lines);
        out.push_str(&aligned(&lines.map(|[left, right]| (left.latex, right.latex)).collect::<Vec<_>>()));
    }
    for (title, lines) in remarks(found, |one| one.latex.clone()) {
        let _ = writeln!(out, "\n% {title}");
        lines.iter().for_each(|line| out.push_str(&format!("% {line}\n")));
    }
    for law in &found.laws {
        let _ = writeln!(out, "% Input {}, as it is written: {}", law.element, one_line(&law.law));
    }
    for sentence in assumptions(found, |one| one.latex.clone()) {
        let _ = writeln!(out, "% {sentence}");
    }
    if !found.zero_parameters.is_empty() {
        let _ = writeln!(out, "% Not in the equations, as their value is zero: {}", found.zero_parameters.join(", "));
    }
    out
}

/// Matrices of more columns are listed by entries.
const MOST_COLUMNS: usize = 5;

/// A symmetric matrix, if it fits on a page.
fn matrix(formulas: &[SymbolicFormula], names: &[String]) -> Option<String> {
    if names.len() > MOST_COLUMNS {
        return None;
    }
    let letter = &formulas[0].symbol.latex[..1];
    let at = |i: usize, j: usize| {
        let (low, high) = (i.min(j), i.max(j));
        let symbol = format!("{letter}_{{{},{}}}", index(&names[high]), index(&names[low]));
        let found = formulas.iter().find(|one| one.symbol.latex == symbol);
        found.map_or("0", |one| one.formula.latex.as_str())
    };
    let column = |j: usize| (0..names.len()).map(|i| width(at(i, j))).fold(2.0, f64::max);
    if (0..names.len()).map(column).sum::<f64>() > LINE {
        return None;
    }
    let row = |i: usize| (0..names.len()).map(|j| at(i, j)).collect::<Vec<_>>().join(" & ");
    let rows: Vec<String> = (0..names.len()).map(|i| format!("  {}", row(i))).collect();
    // Fractions on several levels need some room.
    let end = if rows.iter().any(|row| row.contains(r"\frac")) { " \\\\[4pt]\n" } else { " \\\\\n" };
    Some(format!("\\[ {letter} = \\begin{{bmatrix}}\n{}\n\\end{{bmatrix}} \\]\n", rows.join(end)))
}
