//! Equations in symbols for a terminal and for a document.

use std::fmt::Write;

use super::super::PreparedVariant;
use super::super::equations::kinds;
use super::names::{index, word};
use crate::results::{SymbolicEquations, SymbolicFormula, SymbolicText};

/// Lists of formulas under their titles; what is empty is left out.
fn sections<'e>(found: &'e SymbolicEquations, force: &str) -> Vec<(String, &'e [SymbolicFormula])> {
    let sections: [(String, &[SymbolicFormula]); 9] = [
        ("Letters".into(), &found.letters),
        ("Coordinates that follow".into(), &found.dependents),
        ("Inertia H, symmetric".into(), &found.inertia),
        (format!("Velocity-dependent {force}"), &found.velocity),
        ("Damping D, symmetric".into(), &found.damping),
        (format!("Stiffness {force}"), &found.stiffness),
        (format!("Friction {force}; sgn is set-valued at rest: any value from -1 to 1"), &found.friction),
        ("Input map F u".into(), &found.input),
        ("Constraint torques (multipliers), from the motion of all coordinates".into(), &found.constraint_torques),
    ];
    sections.into_iter().filter(|(_, formulas)| !formulas.is_empty()).collect()
}

/// What the equations assume, in sentences; `mark` writes a formula.
fn assumptions(found: &SymbolicEquations, mark: impl Fn(&SymbolicText) -> String) -> Vec<String> {
    let list = |formulas: &[SymbolicText]| formulas.iter().map(&mark).collect::<Vec<_>>().join(", ");
    let mut out = Vec::new();
    if !found.divisors.is_empty() {
        out.push(format!("None of these may be zero: {}", list(&found.divisors)));
    }
    if !found.zeros.is_empty() {
        out.push(format!(
            "Taken as zero, as for the values of the model; otherwise these equations do not hold: {}",
            list(&found.zeros)
        ));
    }
    out
}

/// The form of all equations.
const FORM: &str = "H q'' + velocity-dependent + D q' + stiffness + friction = F u";

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
    let _ = writeln!(out, "{FORM}");
    if !found.values.is_empty() {
        let widths = [0, 1].map(|k| {
            let width = found.values.iter().map(|value| if k == 0 { value.symbol.text.len() } else { value.of.len() });
            width.max().unwrap_or(0)
        });
        out.push_str("\nValues\n");
        for value in &found.values {
            let follows = value.follows.as_ref().map(|text| format!(", from {text}")).unwrap_or_default();
            let number = format!("{} {}", value.value, value.unit);
            let [a, b] = widths;
            let _ = writeln!(out, "  {:a$}  {:b$}  {}{follows}", value.symbol.text, value.of, number.trim_end());
        }
    }
    for function in &found.functions {
        let _ = writeln!(
            out,
            "\n{0}(x) is the curve of {1}, {0}'(x) and {0}''(x) are its derivatives.",
            function.symbol.text, function.of
        );
    }
    for (title, formulas) in sections(found, "forces") {
        let width = formulas.iter().map(|one| one.symbol.text.len()).max().unwrap_or(0);
        let _ = writeln!(out, "\n{title}");
        for SymbolicFormula { symbol, formula } in formulas {
            let _ = writeln!(out, "  {:width$} = {}", symbol.text, formula.text);
        }
    }
    if !found.laws.is_empty() {
        out.push_str("\nInputs that are laws, as they are written\n");
        found.laws.iter().for_each(|one| out.push_str(&format!("  {} = {}\n", one.of, one.law)));
    }
    let assumed = assumptions(found, |one| one.text.clone());
    if !assumed.is_empty() {
        out.push_str("\nAssumed\n");
        assumed.iter().for_each(|sentence| out.push_str(&format!("  {sentence}\n")));
    }
    if !found.left_out.is_empty() {
        let _ = writeln!(out, "\nNot in the equations, as their value is zero: {}", found.left_out.join(", "));
    }
    out
}

pub(super) fn latex(variant: &PreparedVariant, found: &SymbolicEquations) -> String {
    let mut out = String::new();
    let units: Vec<&str> = kinds(variant).iter().map(|kind| kind.units).collect();
    let _ = writeln!(out, "% Model {}: {}; numbers in SI units. Needs amsmath.", variant.model.name, units.join("; "));
    let _ = writeln!(out, "% {FORM}");
    for value in &found.values {
        let follows = value.follows.as_ref().map(|text| format!(", from {text}")).unwrap_or_default();
        let number = format!("{} {}", value.value, value.unit);
        let _ = writeln!(out, "% {}: {} = {}{follows}", value.symbol.latex, value.of, number.trim_end());
    }
    for function in &found.functions {
        let _ = writeln!(out, "% {}: the curve of {}", function.symbol.latex, function.of);
    }
    let names = variant.reduced.coordinate_names();
    for (title, formulas) in sections(found, "forces") {
        let _ = writeln!(out, "\n% {title}");
        let square = title.starts_with("Inertia") || title.starts_with("Damping");
        if square && names.len() <= MOST_COLUMNS {
            out.push_str(&matrix(formulas, &names));
            continue;
        }
        out.push_str("\\begin{align}\n");
        let rows: Vec<String> =
            formulas.iter().map(|one| format!("  {} &= {}", one.symbol.latex, one.formula.latex)).collect();
        out.push_str(&rows.join(" \\\\\n"));
        out.push_str("\n\\end{align}\n");
    }
    for law in &found.laws {
        let _ = writeln!(out, "% Input {}, as it is written: {}", law.of, law.law);
    }
    for sentence in assumptions(found, |one| one.latex.clone()) {
        let _ = writeln!(out, "% {sentence}");
    }
    if !found.left_out.is_empty() {
        let _ = writeln!(out, "% Not in the equations, as their value is zero: {}", found.left_out.join(", "));
    }
    out
}

/// Matrices of more columns are listed by entries; amsmath sets no more either.
const MOST_COLUMNS: usize = 5;

fn matrix(formulas: &[SymbolicFormula], names: &[String]) -> String {
    let letter = &formulas[0].symbol.latex[..1];
    let at = |i: usize, j: usize| {
        let (low, high) = (i.min(j), i.max(j));
        let symbol = format!("{letter}_{{{},{}}}", index(&names[high]), index(&names[low]));
        let found = formulas.iter().find(|one| one.symbol.latex == symbol);
        found.map_or("0", |one| one.formula.latex.as_str())
    };
    let row = |i: usize| (0..names.len()).map(|j| at(i, j)).collect::<Vec<_>>().join(" & ");
    let rows: Vec<String> = (0..names.len()).map(|i| format!("  {}", row(i))).collect();
    format!("\\[ {letter} = \\begin{{bmatrix}}\n{}\n\\end{{bmatrix}} \\]\n", rows.join(" \\\\\n"))
}
