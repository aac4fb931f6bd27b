//! Multiplier constraints, unilateral and switched constraints, and prescribed motions in symbolic equations.

use super::names::{Names, both};
use crate::study::equations::latex_lines::{index, word};
use kardan_math::num::Rational;
use kardan_mechanics::assemble::MultiplierConstraint;
use kardan_mechanics::equations::{InputKind, Meaning, UnilateralConstraint};
use kardan_mechanics::reduce::Reduced;
use kardan_mechanics::symbolic::{
    FunctionSource, Laurent, Letter, Monomial, Symbol, SymbolicMotion, SymbolicMultiplier,
};
use kardan_model::NamedTerms;
use kardan_results::{SymbolicFormula, SymbolicMode, SymbolicMultiplierConstraint, SymbolicText};
use kardan_schema::diagnostics::Diagnostic;

/// A table in a multiplier constraint has no symbolic derivative.
pub(super) fn refuse_tables(reduced: &Reduced) -> Result<(), Diagnostic> {
    for constraint in &reduced.equations.multiplier_constraints {
        let names = constraint.law.formulas().into_iter().flat_map(|formula| &formula.names);
        let Some((table, _)) = names.into_iter().find(|(_, meaning)| matches!(meaning, Meaning::Table(_))) else {
            continue;
        };
        let message = format!("`{}` calls the table `{table}`, whose slopes have no symbolic form", constraint.element);
        let help = "write an expression in its place, or print the equations without --symbolic";
        return Err(Diagnostic::error("symbolic::table", message).help(help));
    }
    Ok(())
}

/// The constraints enforced by multipliers.
pub(super) fn multiplier_constraints(
    names: &Names<'_>,
    reduced: &Reduced,
    motion: &SymbolicMotion,
) -> Vec<SymbolicMultiplierConstraint> {
    let one = |(k, (constraint, found)): (usize, (&MultiplierConstraint, &SymbolicMultiplier))| {
        let element = &constraint.element;
        let entry = |(column, value): (&usize, &Laurent)| {
            let coordinate = reduced.coordinates[*column];
            let symbol = SymbolicText {
                text: format!("A[{}, {}]", word(element), names.coordinates[coordinate]),
                latex: format!("A_{{{},{}}}", index(element), index(&reduced.equations.coordinates[coordinate])),
            };
            SymbolicFormula { symbol, formula: names.formula(value) }
        };
        let [rates, accelerations] = found.left.each_ref().map(|left| names.sum(left));
        let rate = |right| SymbolicFormula { symbol: rates, formula: names.formula(right) };
        SymbolicMultiplierConstraint {
            element: element.clone(),
            multiplier: both(|form| names.multiplier(k, form)),
            position: found.position.as_ref().map(|position| {
                let term =
                    |(monomial, number): (&Monomial, &Rational)| Laurent::of([(monomial.clone(), number.clone())]);
                names.sum(&position.terms().map(term).collect::<Vec<_>>())
            }),
            row: found.row.iter().map(entry).collect(),
            rates: found.rate.as_ref().map(rate),
            accelerations: SymbolicFormula { symbol: accelerations, formula: names.formula(&found.acceleration) },
        }
    };
    reduced.equations.multiplier_constraints.iter().zip(&motion.multiplier_constraints).enumerate().map(one).collect()
}

/// The conditions of the torques of clutches, stops, locks and gears.
pub(super) fn modes(names: &Names<'_>, reduced: &Reduced, motion: &SymbolicMotion) -> Vec<SymbolicMode> {
    let unilaterals = &reduced.equations.unilaterals;
    let mode = |(element, is_loss, by_symbol): &(String, bool, [Laurent; 2])| {
        let [angle, speed] = by_symbol.each_ref().map(|by_symbol| names.formula(by_symbol).text);
        let own = unilaterals.iter().filter(|unilateral| unilateral.element == *element);
        let own = own.filter(|unilateral| matches!(unilateral.value, UnilateralConstraint::GearLoss(_)) == *is_loss);
        let texts: Vec<String> =
            own.map(|unilateral| describe_force_law(&unilateral.value, element, &angle, &speed)).collect();
        SymbolicMode {
            symbol: both(|form| names.unilateral(element, *is_loss, form)),
            element: element.clone(),
            description: texts.join("; "),
        }
    };
    motion.directions.iter().map(mode).collect()
}

/// Shares are rounded to these fractions in the text.
const DIGITS: f64 = 1e6;

/// The force law, over the angle and the speed along its element.
fn describe_force_law(unilateral: &UnilateralConstraint, element: &str, angle: &str, speed: &str) -> String {
    let signed = |value: f64| if value == 0.0 { 0.0 } else { value };
    let side = |upper: bool, offset: f64| match upper {
        false => (format!("{angle} > {}", signed(offset)), "below"),
        true => (format!("{angle} < {}", signed(-offset)), "above"),
    };
    match unilateral {
        UnilateralConstraint::Friction { torque, at_rest } => {
            let more = match at_rest.to_f64() {
                1.0 => "as much".to_string(),
                times => format!("{times} times as much"),
            };
            let size = torque.expression.text();
            format!(
                "against {speed} while it slips, of magnitude {size}; up to {more} in both directions while it sticks"
            )
        }
        UnilateralConstraint::OneWay => {
            format!("zero while {speed} > 0; else the torque that keeps it from falling below zero")
        }
        UnilateralConstraint::Stop { upper, offset, restitution } => {
            let (free, beyond) = side(*upper, offset.to_f64());
            let back = match restitution.to_f64() {
                0.0 => String::new(),
                part => format!(", from which it rebounds with {part} of its speed"),
            };
            format!("zero while {free}; else the torque that keeps it from going {beyond}{back}")
        }
        UnilateralConstraint::Cushion { upper, offset, stiffness, damping } => {
            let (free, beyond) = side(*upper, offset.to_f64());
            let [s, d] = [stiffness, damping].map(|value| value.to_f64());
            format!(
                "zero while {free}; {beyond} that, a stiffness of {s} and a damping of {d} press back, and never pull"
            )
        }
        UnilateralConstraint::Lock { engaged } => {
            format!("the torque that keeps {speed} at zero while {} > 0.5; else zero", engaged.expression.text())
        }
        UnilateralConstraint::GearLoss(gear) => {
            let [forth, back] = [&gear.forth, &gear.back].map(|share| (share.to_f64() * DIGITS).round() / DIGITS);
            let more = match &gear.loss {
                Some(loss) => format!(", and {}", loss.expression.text()),
                None => String::new(),
            };
            format!(
                "against {speed}, gear loss of {element}: {forth} of the transmitted torque while it drives, {back} \
                 while it is driven{more}"
            )
        }
    }
}

/// The prescribed motion as text, or by a rate.
pub(super) fn prescribed(names: &Names<'_>, used: &[Letter], named: &NamedTerms) -> Vec<SymbolicMode> {
    let mut out: Vec<SymbolicMode> = Vec::new();
    for letter in used {
        let Symbol::OfTime(element, _) = names.letters.symbol(*letter) else { continue };
        let Some(function) = named.functions.get(element).filter(|_| out.iter().all(|one| one.element != *element))
        else {
            continue;
        };
        let what = match (&function.source, function.rate) {
            (FunctionSource::Text(text), false) => text.clone(),
            (FunctionSource::Text(text), true) => format!("the integral over time, from zero, of {text}"),
            (_, true) => format!("the integral over time, from zero, of {}'", word(element)),
            (_, false) => continue,
        };
        let symbol = both(|form| names.of_time(element, 0, form));
        out.push(SymbolicMode { symbol, element: element.clone(), description: what });
    }
    out.sort_by(|a, b| a.element.cmp(&b.element));
    out
}

/// Motors with a ripple.
pub(super) fn ripples(reduced: &Reduced) -> Vec<String> {
    let rippled = reduced
        .equations
        .inputs
        .iter()
        .filter(|input| matches!(&input.value, InputKind::Motor(motor) if motor.ripple.is_some()));
    rippled.map(|input| input.element.clone()).collect()
}
