//! Constraints whose coefficients, or which themselves, are expressions of angles and positions.

use std::sync::Arc;

use super::Functions;
use super::smooth::find_kink;
use kardan_expr::expr::Graph;
use kardan_math::units::{Dimension, Expression};
use kardan_mechanics::equations::{Formula, FormulaRow, Meaning};
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::entries::Place;
use kardan_schema::schema::{Placed, Scalar};

impl Functions<'_, '_> {
    /// An expression of angles and positions that must be zero, of any unit.
    pub(crate) fn surface(
        &mut self,
        expression: &Expression,
        (place, what): (&Place, &str),
        out: &mut Vec<Diagnostic>,
    ) -> Option<Arc<Formula>> {
        let formula = self.of_positions(expression, (place, what), out)?;
        if formula.coordinates().next().is_none() {
            let at = place.inside(expression.text());
            let message = format!("{what}: it contains no angle or position, so it constrains nothing");
            let help =
                "write the expression that must be zero, such as `q1.phi - 0.5 * sin(q2.phi)` or `x.s^2 + y.s^2 - l^2`";
            out.push(Diagnostic::error("constraint::expression", message).at(at, formula.dimension.noun()).help(help));
            return None;
        }
        Some(formula)
    }

    /// Coefficients by shaft and mass, whose sum with the rates of these is of any unit.
    pub(crate) fn row(
        &mut self,
        entries: &[(Placed<String>, Placed<Scalar>)],
        what: &str,
        out: &mut Vec<Diagnostic>,
    ) -> Option<FormulaRow> {
        let before = out.len();
        let (mut row, mut sum) = (Vec::new(), None::<(Dimension, String)>);
        for (name, scalar) in entries {
            let Scalar::Expression(expression) = &scalar.value else { continue };
            let label = format!("`{}` in {what}", name.value);
            let before = out.len();
            self.reader.check_coordinate(&name.value, &name.place, &label, out);
            if out.len() > before {
                continue;
            }
            let Some(formula) = self.of_positions(expression, (&scalar.place, &label), out) else { continue };
            if self.reader.is_ground(&name.value) {
                continue;
            }
            let [_, rate] = self.reader.domain_of(&name.value).dimensions();
            let Some(product) = formula.dimension.times(&rate, 1) else { continue };
            match &sum {
                None => sum = Some((product, name.value.clone())),
                Some((first, other)) if !first.is_like(&product) => {
                    let message = format!(
                        "{label}: multiplied by the rate of `{}` it is {}, but the term of `{other}` is {}",
                        name.value,
                        product.noun(),
                        first.noun()
                    );
                    let help =
                        "all terms of a row must be the same quantity: give a coefficient a length, or remove one";
                    out.push(
                        Diagnostic::error("unit::dimension", message).at(&scalar.place, product.noun()).help(help),
                    );
                }
                Some(_) => {}
            }
            row.push((name.value.clone(), formula));
        }
        if sum.is_none() {
            if entries.is_empty() {
                return Some(row);
            }
            if let Some((name, _)) = entries.iter().find(|(name, _)| self.reader.is_ground(&name.value)) {
                let message = format!("{what}: it names nothing that can move");
                let diagnostic = Diagnostic::error("name::ground", message).at(&name.place, "fixed");
                out.push(diagnostic.help("name a shaft or mass that moves"));
            }
            return None;
        }
        (out.len() == before).then_some(row)
    }

    /// An expression of angles and positions, smooth, without rates and without the time.
    fn of_positions(
        &mut self,
        expression: &Expression,
        (place, what): (&Place, &str),
        out: &mut Vec<Diagnostic>,
    ) -> Option<Arc<Formula>> {
        let formula = self.formula_with(expression, Vec::new(), (place, what), out)?;
        let wrong = formula.names.iter().find_map(|(name, meaning)| match meaning {
            Meaning::Rate(_) => {
                Some((name, "a speed", "write the coefficients of rates in `rates`; they may depend on positions only"))
            }
            Meaning::Time | Meaning::Signal(_) | Meaning::Block(..) => Some((
                name,
                "a function of time",
                "for a motion over time use the `offset` of `coefficients`, or a prescribed_motion",
            )),
            Meaning::Shared(_) => Some((name, "a formula of coordinates", "write out how it depends on positions")),
            _ => None,
        });
        if let Some((name, kind, help)) = wrong {
            let span = expression.place_of(name).unwrap_or(0..expression.text().len());
            let message = format!("{what}: `{name}` is {kind}, and only angles and positions are allowed here");
            out.push(
                Diagnostic::error("constraint::expression", message)
                    .at(place.part(expression.text(), span), kind)
                    .help(help),
            );
            return None;
        }
        let is_bent = |part: &Expression| {
            let (mut graph, part) = (Graph::default(), Formula { expression: part.clone(), ..formula.clone() });
            let kinks = self.formula_expr(&part, &mut graph).map(|(value, _)| graph.kinks(value));
            kinks.is_ok_and(|kinks| kinks.into_iter().any(graph.varying()))
        };
        if is_bent(expression) {
            let message = format!("{what}: it may have a kink or a jump, which no motion can follow");
            let (span, reason) = find_kink(expression, is_bent);
            let at = place.part(expression.text(), span);
            let help = "leave out abs, min, max, if and sign; for a table use `interpolation = \"cubic\"` with `extrapolation = \"linear\"`, which continues without a kink";
            out.push(Diagnostic::error("motion::not-smooth", message).at(at, reason).help(help));
            return None;
        }
        Some(Arc::new(formula))
    }
}
