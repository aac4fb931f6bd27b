//! Expressions of coordinates: torques as laws.

use std::sync::Arc;

use super::{Functions, not_of_time};
use crate::keys::{GUESSES, unknown_in};
use kardan_elements::element::is_composite;
use kardan_expr::expr::{Expr, Graph, Named};
use kardan_math::names::circle;
use kardan_math::num::Rational;
use kardan_math::units::{Dimension, Exact, Expression, UnitError};
use kardan_mechanics::equations::{Formula, Meaning};
use kardan_results::signal_name::SignalName;
use kardan_schema::diagnostics::{Diagnostic, nearest, quoted, shortened};
use kardan_schema::entries::Place;

impl Functions<'_, '_> {
    /// A formula of a dimension, with local names; `None` if it has an error, which was reported.
    pub(crate) fn formula(
        &mut self,
        expression: &Expression,
        expected: Dimension,
        own: Vec<(String, Meaning)>,
        (place, what): (&Place, &str),
        out: &mut Vec<Diagnostic>,
    ) -> Option<Formula> {
        let mut formula = self.formula_with(expression, own, (place, what), out)?;
        let found = std::mem::replace(&mut formula.dimension, expected);
        if found != expected && (expected == Dimension::NONE || !expected.is_like(&found)) {
            let at = place.inside(expression.text());
            let unit = found.si();
            let help = match expected {
                Dimension::NONE => format!(
                    "divide it by its unit, `(...) / (1 {unit})`, or compare it with a threshold: `if(... > 1 {unit}, \
                     1, 0)`"
                ),
                _ => format!("the result needs a unit such as {}", expected.example()),
            };
            out.push(Diagnostic::wrong_dimension(what, [expected, found], at).help(help));
            return None;
        }
        let rate =
            |name: &str| formula.names.iter().any(|(own, meaning)| own == name && matches!(meaning, Meaning::Rate(_)));
        let signs = expression.signs_of(&rate);
        if let Some((span, _)) = signs.into_iter().find(|(_, of)| self.jumps_where(&formula, of)) {
            let message =
                format!("{what}: it jumps where this speed changes its sign, so the integrator cannot step to rest");
            let help = "model Coulomb friction by `friction` of a shaft, a mass or a spring_damper: it sticks at rest";
            let at = place.part(expression.text(), span);
            out.push(Diagnostic::warning("law::discontinuous", message).at(at, "jumps").help(help));
        }
        Some(formula)
    }

    /// A formula of the dimension that it has, with local names; `None` if it has an error, which was reported.
    pub(super) fn formula_with(
        &mut self,
        expression: &Expression,
        own: Vec<(String, Meaning)>,
        at: (&Place, &str),
        out: &mut Vec<Diagnostic>,
    ) -> Option<Formula> {
        let mut names = self.meanings(expression, at, out)?;
        names.retain(|(name, _)| own.iter().all(|(candidate, _)| candidate != name));
        let own_names: Vec<[String; 2]> = own.iter().map(|(name, _)| [name.clone(), name.clone()]).collect();
        names.extend(own);
        let formula = Formula { expression: expression.clone(), names, dimension: Dimension::NONE };
        match self.formula_expr(&formula, &mut Graph::default()) {
            Ok((_, dimension)) => Some(Formula { dimension, ..formula }),
            Err(error) => {
                out.push(self.formula_diagnostic(error, expression.text(), own_names, (at, out.len() < GUESSES)));
                None
            }
        }
    }

    /// Whether a name is that of a block, or of a block output, when none has outputs because of a reported error in one of them.
    fn is_of_broken_block(&self, name: &str) -> bool {
        let head = SignalName::new(name).element;
        self.broken_blocks && (self.document.blocks.has(head) || self.document.blocks.has(name))
    }

    /// The meanings of the names of a formula; unknown ones are omitted. `None` if one of them has a reported error.
    fn meanings(
        &mut self,
        expression: &Expression,
        (place, what): (&Place, &str),
        out: &mut Vec<Diagnostic>,
    ) -> Option<Vec<(String, Meaning)>> {
        let mut names = Vec::new();
        for name in expression.names() {
            let meaning = if let Some((carrier, number)) = self.reader.motion(name) {
                if number == 0 { Meaning::Position(carrier.into()) } else { Meaning::Rate(carrier.into()) }
            } else if let Some(dimension) = self.reader.motion_of_ground(name) {
                Meaning::Constant(Exact::zero(), dimension)
            } else if name == "t" {
                Meaning::Time
            } else if let Some(shared) = self.shared(name, place, out) {
                Meaning::Shared(shared?)
            } else if let Some(dimension) = self.blocks.get(name) {
                Meaning::Block(name.to_string(), *dimension)
            } else if self.is_of_broken_block(name) {
                return None;
            } else if self.document.moves(name) {
                let help = "write its formula here, or let a block with a `sample_time` read it: `kind = \"hold\"`";
                out.push(not_of_time("the signal ", name, expression, (place, what)).help(help));
                return None;
            } else if self.document.signals.has(name) {
                Meaning::Signal(self.of_time_named(name, out)?)
            } else if let Some(value) = self.reader.value_of(name, out) {
                let (value, dimension) = value?;
                Meaning::Constant(value, dimension)
            } else if self.document.suppressed.has(name) || self.document.suppressed.has(SignalName::new(name).element)
            {
                return None;
            } else {
                continue;
            };
            names.push((name.to_string(), meaning));
        }
        for name in expression.tables() {
            match self.table(name, out) {
                Some(table) => names.push((name.to_string(), Meaning::Table(table?))),
                None if self.document.suppressed.has(name) => return None,
                None => {}
            }
        }
        Some(names)
    }

    /// A formula of a composite element, shared by laws; the outer option is `None` if it is not one, the inner if it has
    /// an error, which was reported.
    fn shared(&mut self, name: &str, place: &Place, out: &mut Vec<Diagnostic>) -> Option<Option<Arc<Formula>>> {
        let signal = self.document.signals.get(name)?;
        let head = SignalName::new(name).element;
        self.document.elements.all(head).find(|one| head != name && is_composite(one.kind.keyword))?;
        let formula = signal.formula.as_ref()?;
        let what = format!("signal `{}`", shortened(name));
        if let Some(first) = self.open.iter().position(|open| *open == name) {
            let message = format!("{what}: it depends on itself: {}", circle(&self.open[first..]));
            let help = "make one of them depend on something else, such as a state or a block with a `sample_time`";
            out.push(Diagnostic::error("signal::cyclic-definition", message).at(place, "circular").help(help));
            return Some(None);
        }
        self.open.push(&signal.name);
        let found = self.formula_with(&formula.value, Vec::new(), (place, &what), out);
        self.open.pop();
        Some(found.map(Arc::new))
    }

    /// A formula over symbols of its names.
    pub(super) fn formula_expr(&self, formula: &Formula, graph: &mut Graph) -> Result<(Expr, Dimension), UnitError> {
        let mut named = |graph: &mut Graph, name: &str| {
            let (_, meaning) = formula.names.iter().find(|(candidate, _)| candidate == name)?;
            let dimension = match meaning {
                Meaning::Constant(value, dimension) => return Some(Named::Constant(value.clone(), *dimension)),
                Meaning::Table(table) => return Some(Named::Table(Arc::clone(table))),
                Meaning::Position(body) => self.reader.domain_of(body).dimensions()[0],
                Meaning::Rate(body) => self.reader.domain_of(body).dimensions()[1],
                Meaning::Time => Dimension::TIME,
                Meaning::Signal(function) => function.dimension(),
                Meaning::Block(_, dimension) => *dimension,
                Meaning::Shared(shared) => shared.dimension,
                Meaning::Load(dimension) | Meaning::Slip(dimension) => *dimension,
            };
            Some(Named::Varying(graph.symbol(name, dimension), dimension))
        };
        graph.lowered(&formula.expression, &mut named)
    }

    /// Whether a formula jumps where a part of it vanishes; if that part is not a linear combination of its names, it may.
    fn jumps_where(&self, formula: &Formula, part: &Expression) -> bool {
        let mut graph = Graph::default();
        let of = Formula { expression: part.clone(), ..formula.clone() };
        let exprs = [formula, &of].map(|formula| self.formula_expr(formula, &mut graph).map(|(value, _)| value));
        let [Ok(value), Ok(part)] = exprs else { return true };
        let solved = graph.symbols(&[part]).into_iter().find_map(|symbol| {
            let slope = graph.derivative(part, symbol);
            let slope = graph.number_of(slope).cloned().filter(|slope| !slope.is_zero())?;
            // At part = 0 the symbol equals its value minus part / slope.
            let own = graph.of_symbol(symbol)?;
            Some((symbol, graph.sum(Rational::ZERO, &[(own, Rational::ONE), (part, -(Rational::ONE / slope))])))
        });
        let Some(place) = solved else { return true };
        let guards: Vec<Expr> = graph.kinks(value).into_iter().map(|kink| graph.guard(kink).0).collect();
        let shifted = graph.substitute(&guards, &[place]);
        let vanishing: Vec<Expr> = guards
            .into_iter()
            .zip(shifted)
            .filter(|(_, shifted)| graph.is_zero(*shifted))
            .map(|(guard, _)| guard)
            .collect();
        let Some(sides) = graph.all_sides(&[value], &|guard| vanishing.contains(&guard)) else { return true };
        let sides: Vec<Expr> = sides.into_iter().map(|side| side.exprs[0]).collect();
        let sides = graph.substitute(&sides, &[place]);
        sides.iter().any(|side| *side != sides[0])
    }

    fn formula_diagnostic(
        &self,
        error: UnitError,
        text: &str,
        own_names: Vec<[String; 2]>,
        (at, guesses): ((&Place, &str), bool),
    ) -> Diagnostic {
        unknown_in(error, text, at, |name| {
            if !guesses {
                let help =
                    "a law names angles and speeds, positions and velocities, parameters, signals and the time `t`";
                return (
                    format!("`{}` is no angle or speed, no parameter and no signal", shortened(name)),
                    help.into(),
                );
            }
            let motions: Vec<[String; 2]> = own_names.into_iter().chain(self.reader.all_motions()).collect();
            let own = || motions.iter().flatten().map(String::as_str);
            let signals = self.document.signals.iter().map(|signal| signal.name.as_str());
            let parameters = self.document.parameters.iter().map(|parameter| parameter.name.as_str());
            let head = SignalName::new(name).element;
            let of_head = || own().filter(|other| SignalName::new(other).element == head);
            let near = nearest(name, of_head())
                .or_else(|| nearest(name, own().chain(signals.clone()).chain(parameters.clone()).chain(["t"])));
            let split_name = |other: &&str| other.contains('-') && other.contains(name) && text.contains(*other);
            let help = match near {
                _ if let Some(whole) = own().chain(signals.clone()).chain(parameters.clone()).find(split_name) => {
                    format!("quote a name with `-`: `'{whole}'`")
                }
                Some(near) if near.contains('-') => format!("did you mean `'{near}'`?"),
                Some(near) => format!("did you mean `{near}`?"),
                None if of_head().next().is_some() => format!("`{}` has {}", shortened(head), quoted(of_head())),
                None => "a law names angles and speeds (`arm.phi`, `arm.w`), positions and velocities (`car.s`, `car.v`), parameters, \
                         signals and the time `t`"
                    .into(),
            };
            (format!("`{}` is no angle or speed, no parameter and no signal", shortened(name)), help)
        })
    }
}
