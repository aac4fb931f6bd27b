//! The equations of motion with symbols for their values.

mod names;
mod page;
mod unilateral;

use std::collections::BTreeSet;

use self::names::{Names, both};
use crate::study::equations::form::EquationsForm;
use crate::study::equations::latex_lines::index;
use crate::study::{PreparedVariant, Project};
use kardan_math::units::{Dimension, Exact, Expression};
use kardan_mechanics::assemble::{MultiplierConstraint, assemble};
use kardan_mechanics::equations::{Domain, MultiplierLaw};
use kardan_mechanics::reduce::{Reduced, reduce};
use kardan_mechanics::symbolic::{FunctionSource, Laurent, Letter, Symbol, SymbolicMotion};
use kardan_model::{NamedTerms, constants};
use kardan_results::signal_name::Quantity;
use kardan_results::{SymbolOfValue, SymbolicEquations, SymbolicFormula, SymbolicFunction, SymbolicLaw, SymbolicText};
use kardan_schema::diagnostics::{Diagnostic, quoted};

impl Project {
    /// The equations of motion of the first variant with symbols: parameters by their name, values of elements by a letter and
    /// the element's name. Also the warnings of the file.
    ///
    /// ```
    /// use kardan::project::Project;
    /// let project = Project::open("[shaft.axle]\ninertia = \"2 kg cm^2\"\ndamping = \"d\"\n[parameters]\nd = \"1 N m s/rad\"\n");
    /// let (found, _) = project.symbolic_equations().unwrap();
    /// assert_eq!(found.inertia[0].formula.text, "J_axle");
    /// assert_eq!(found.damping[0].formula.latex, "d");
    /// ```
    ///
    /// # Errors
    /// All errors of the file, or why there is no explicit form with joints at any angle.
    pub fn symbolic_equations(&self) -> Result<(SymbolicEquations, Vec<Diagnostic>), Vec<Diagnostic>> {
        let (_, found, diagnostics) = self.symbolic()?;
        Ok((found, diagnostics))
    }

    /// The same as text or LaTeX.
    ///
    /// # Errors
    /// Those of [`symbolic_equations`](Self::symbolic_equations); a plan contains only numbers.
    pub fn symbolic_text(&self, form: EquationsForm) -> Result<(String, Vec<Diagnostic>), Vec<Diagnostic>> {
        let (variant, found, diagnostics) = self.symbolic()?;
        let text = match form {
            EquationsForm::Text => page::text(variant, &found),
            EquationsForm::Latex => page::latex(variant, &found),
            EquationsForm::Plan => {
                let message = "a plan needs numbers, not symbols";
                return Err(Diagnostic::error("symbolic::plan", message).help("choose text, LaTeX or JSON").into());
            }
        };
        Ok((text, diagnostics))
    }

    fn symbolic(&self) -> Result<(&PreparedVariant, SymbolicEquations, Vec<Diagnostic>), Vec<Diagnostic>> {
        let (variant, diagnostics) = self.for_equations()?;
        let own = &variant.reduced.equations;
        if (0..own.constraints.len()).any(|row| own.is_equilibrium(row)) {
            let message = "motions without inertia follow only from springs here, for which there is no symbolic form";
            let help = "give them an inertia, or print the equations without --symbolic";
            return Err(Diagnostic::error("symbolic::massless", message).help(help).into());
        }
        unilateral::refuse_tables(&variant.reduced)?;
        let settings = self.document().variant_settings().into_iter().next().unwrap_or_default().settings;
        let named = self.document().named_terms(&settings);
        let coordinates = variant.reduced.coordinate_names();
        let equations = assemble(&variant.model.all_coordinates, &named.terms);
        let reduced = reduce(equations, Some(&coordinates)).map_err(|error| {
            let message = format!("with joints at any angle there is no explicit form over these coordinates: {error}");
            let help = "name other coordinates in `[model]`, or print the equations without --symbolic";
            Diagnostic::error("symbolic::explicit", message).help(help)
        })?;
        let behind = reduced
            .equations
            .multiplier_constraints
            .iter()
            .find(|constraint| matches!(constraint.law, MultiplierLaw::Prescribed { order: 0, .. }));
        if let Some(MultiplierConstraint { element, .. }) = behind {
            let message =
                format!("`{element}` prescribes a position behind a curve, for which there is no symbolic form");
            let help = "prescribe the end that drives the curve, or print the equations without --symbolic";
            return Err(Diagnostic::error("symbolic::curve", message).help(help).into());
        }
        if let Some(group) = reduced.redundant_groups().first() {
            let all = quoted(group);
            let message = format!(
                "the constraints {all} restrict the same motion, so their torques are not unique and have no formulas"
            );
            let help = "remove one of them, or print the equations without --symbolic";
            return Err(Diagnostic::error("symbolic::redundant", message).help(help).into());
        }
        let start = &variant.scenario.position;
        let (meanings, functions) = (named.meanings.clone(), &named.functions);
        let motion = SymbolicMotion::new(&named.terms, meanings, functions, &reduced, start).ok_or_else(|| {
            let message = "written in symbols, one entry of the equations has thousands of terms";
            let help = "print the numbers without --symbolic, or use a part of the model";
            Diagnostic::error("symbolic::size", message).help(help)
        })?;
        Ok((variant, found(&named, &reduced, &motion), diagnostics))
    }
}

/// The displayed equations.
fn found(named: &NamedTerms, reduced: &Reduced, motion: &SymbolicMotion) -> SymbolicEquations {
    let used = motion.letters.used_in(motion.all());
    let names = Names::new(&motion.letters, &used, &reduced.equations, &named.values);
    let values = values(named, reduced, &names, &used);
    let functions = functions(&names, &used);
    let formula = |symbol: SymbolicText, value: &Laurent| SymbolicFormula { symbol, formula: names.formula(value) };
    let mut dependents = Vec::new();
    for (order, list) in [&motion.angles, &motion.speeds, &motion.accelerations].into_iter().enumerate() {
        dependents.extend(list.iter().map(|(k, value)| formula(both(|form| names.motion(*k, order, form)), value)));
    }
    let coordinate = |k: usize| reduced.coordinates[k];
    let entry = |letter: &str, ((i, j), value): (&(usize, usize), &Laurent)| {
        let [i, j] = [i, j].map(|k| coordinate(*k));
        let symbol = SymbolicText {
            text: format!("{letter}[{}, {}]", names.coordinates[i], names.coordinates[j]),
            latex: format!(
                "{letter}_{{{},{}}}",
                index(&reduced.equations.coordinates[i]),
                index(&reduced.equations.coordinates[j])
            ),
        };
        formula(symbol, value)
    };
    let forces = |letter: &str, list: &[Laurent]| -> Vec<SymbolicFormula> {
        let one = |(k, value): (usize, &Laurent)| {
            let name = &reduced.equations.coordinates[coordinate(k)];
            let text = names.coordinates[coordinate(k)].clone();
            formula(SymbolicText { text, latex: format!("{letter}_{{{}}}", index(name)) }, value)
        };
        list.iter().enumerate().filter(|(_, value)| !value.is_zero()).map(one).collect()
    };
    let letters = motion.definitions.iter().filter(|one| used.contains(&one.letter));
    let own = |name: &String| values.iter().any(|value| value.name == *name);
    let is_zero = |name: &&String| named.values.get(*name).is_some_and(|one| one.value.is_zero());
    let excluded: BTreeSet<&String> = named.used.iter().filter(|name| is_zero(name) && !own(name)).collect();
    SymbolicEquations {
        intermediate_symbols: letters.map(|one| formula(names.letter(one.letter), &one.value)).collect(),
        dependent_coordinates: dependents,
        inertia: motion.inertia.iter().map(|one| entry("H", one)).collect(),
        velocity: forces(r"h^{\mathrm{v}}", &motion.velocity),
        damping: motion.damping.iter().map(|one| entry("D", one)).collect(),
        stiffness: forces(r"h^{\mathrm{s}}", &motion.stiffness),
        friction: forces(r"h^{\mathrm{c}}", &motion.friction),
        unilateral_forces: forces(r"h^{\mathrm{m}}", &motion.unilateral),
        contact_states: unilateral::modes(&names, reduced, motion),
        input: forces("(F u)", &motion.input),
        multiplier_forces: forces(r"(A^{\mathsf{T}} \lambda)", &motion.multiplier_forces),
        multiplier_constraints: unilateral::multiplier_constraints(&names, reduced, motion),
        prescribed: unilateral::prescribed(&names, &used, named),
        laws: named.laws.iter().map(|(of, law)| SymbolicLaw { element: of.clone(), law: law.clone() }).collect(),
        constraint_torques: constraint_torques(&names, reduced, motion),
        divisors: divisors(&names, motion),
        zeros: motion.zeros.iter().map(|value| names.formula(value)).collect(),
        zero_parameters: excluded.into_iter().cloned().collect(),
        ripples: unilateral::ripples(reduced),
        values,
        functions,
    }
}

/// Values of letters, of the texts of laws and modes, and of their sources.
fn values(named: &NamedTerms, reduced: &Reduced, names: &Names<'_>, used: &[Letter]) -> Vec<SymbolOfValue> {
    let described = |symbol: SymbolicText, of: &str, value: &Exact, dimension: Dimension| SymbolOfValue {
        symbol,
        name: of.to_string(),
        derived_from: named.values.get(of).and_then(|symbol_value| symbol_value.follows.clone()),
        value: value.to_f64(),
        unit: if dimension == Dimension::ANGLE { "rad".into() } else { dimension.si() },
    };
    let of_letter = |letter: &Letter| {
        let Symbol::Value(of) = names.letters.symbol(*letter) else { return None };
        let found = named.values.get(of)?;
        Some(described(names.letter(*letter), of, &found.value, found.dimension))
    };
    let mut out: Vec<SymbolOfValue> = used.iter().filter_map(of_letter).collect();
    let add = |out: &mut Vec<SymbolOfValue>, of: &str, value: &Exact, dimension: Dimension| {
        if out.iter().all(|one| one.name != of) {
            let symbol = SymbolicText { text: of.to_string(), latex: names::with_index(of, "") };
            out.push(described(symbol, of, value, dimension));
        }
    };
    let unilateral = reduced.equations.unilaterals.iter().filter_map(|unilateral| unilateral.value.formula());
    for (of, value, dimension) in
        named.named_in_laws.iter().cloned().chain(unilateral.flat_map(|formula| constants(formula)))
    {
        add(&mut out, &of, &value, dimension);
    }
    let texts = named.functions.values().filter_map(|function| match &function.source {
        FunctionSource::Text(text) => Expression::parse_law(text).ok(),
        _ => None,
    });
    for of in texts.collect::<Vec<_>>().iter().flat_map(Expression::names) {
        named.values.get(of).into_iter().for_each(|found| add(&mut out, of, &found.value, found.dimension));
    }
    // The source of a value follows it as text.
    let mut open = 0;
    while let Some(one) = out.get(open) {
        let read = one.derived_from.as_deref().and_then(|text| Expression::parse(text).ok());
        for of in read.iter().flat_map(Expression::names) {
            named.values.get(of).into_iter().for_each(|found| add(&mut out, of, &found.value, found.dimension));
        }
        open += 1;
    }
    out.sort_by(|a, b| a.symbol.text.cmp(&b.symbol.text));
    out
}

fn functions(names: &Names<'_>, used: &[Letter]) -> Vec<SymbolicFunction> {
    let element = |letter: &Letter| match names.letters.symbol(*letter) {
        Symbol::Curve(element, ..) => Some(element),
        _ => None,
    };
    let elements: BTreeSet<&String> = used.iter().filter_map(element).collect();
    elements.into_iter().map(|of| SymbolicFunction { symbol: names.curve(of), element: of.clone() }).collect()
}

fn constraint_torques(names: &Names<'_>, reduced: &Reduced, motion: &SymbolicMotion) -> Vec<SymbolicFormula> {
    let equations = &reduced.equations;
    let linear = equations.constraints.iter().enumerate().map(|(k, constraint)| match equations.node(k) {
        Some(node) => (node.to_string(), Quantity::Voltage),
        None => (constraint.element.clone(), equations.domain_of(constraint).effort()),
    });
    let curves = equations.transmissions.iter().map(|transmission| {
        let measured = equations.measures.get(&transmission.element).copied();
        let domain: Domain = measured.unwrap_or_else(|| equations.domain(transmission.driven));
        (transmission.element.clone(), domain.effort())
    });
    let one = |((element, quantity), value): ((String, Quantity), &Laurent)| {
        let symbol = SymbolicText { text: quantity.of(&element), latex: format!(r"\lambda_{{{}}}", index(&element)) };
        SymbolicFormula { symbol, formula: names.formula(value) }
    };
    linear.chain(curves).zip(&motion.multipliers).map(one).collect()
}

/// Values that must not be zero: every factor of a product.
fn divisors(names: &Names<'_>, motion: &SymbolicMotion) -> Vec<SymbolicText> {
    let mut out: Vec<SymbolicText> = Vec::new();
    for divisor in &motion.divisors {
        let parts: Vec<Laurent> = match divisor.single() {
            Some((monomial, _)) => {
                let values = monomial
                    .iter()
                    .filter(|(letter, _)| matches!(names.letters.symbol(*letter), Symbol::Value(_) | Symbol::Sum(_)));
                values.map(|(letter, _)| Laurent::letter(*letter)).collect()
            }
            None => vec![divisor.clone()],
        };
        for part in parts.iter().map(|part| names.formula(part)) {
            if !out.contains(&part) {
                out.push(part);
            }
        }
    }
    out
}
