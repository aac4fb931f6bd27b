//! Numbers of a run: measured from signals, or computed from other figures.

use std::collections::HashMap;

use crate::study::measure::computed_signals::{Computed, Track, lowered};
use crate::study::measure::requirement_verdict::{Ran, Requirement, judge};
use crate::study::measure::selected_variants::selects;
use kardan_expr::expr::Graph;
use kardan_expr::plan::compile;
use kardan_math::names::HasName;
use kardan_math::units::{Dimension, Exact, Expression};
use kardan_results::{DisplayUnit, FigureResult, Series};

/// A number of each run.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Its name.
    pub name: String,
    /// Its definition.
    pub of: FigureOf,
    /// Its quantity.
    pub dimension: Dimension,
    /// Its SI unit.
    pub unit: String,
    /// The display unit, if it is another one.
    pub display: Option<DisplayUnit>,
    /// Variants that it applies to; empty: all.
    pub variants: Vec<String>,
}

impl HasName for Figure {
    fn name(&self) -> &str {
        &self.name
    }
}

/// The definition of a figure.
#[derive(Debug, Clone, PartialEq)]
pub enum FigureOf {
    /// The measure of a signal: a requirement without a bound.
    Measure(Box<Requirement>),
    /// An expression of parameters and of figures before it.
    Value(String),
}

impl Figure {
    /// Its description.
    pub(in crate::study) fn describe(&self) -> String {
        match &self.of {
            FigureOf::Measure(measure) => measure.describe(),
            FigureOf::Value(text) => text.clone(),
        }
    }

    /// What it measures; none of an expression.
    pub(in crate::study) fn measure(&self) -> Option<&Requirement> {
        match &self.of {
            FigureOf::Measure(measure) => Some(measure),
            FigureOf::Value(_) => None,
        }
    }
}

/// What expressions of figures may name.
struct Known<'a> {
    figures: HashMap<&'a str, &'a Figure>,
    parameters: HashMap<&'a str, &'a (String, Exact, Dimension)>,
    /// The values of figures of a run so far, as far as they have one.
    values: HashMap<&'a str, Option<f64>>,
}

impl Known<'_> {
    /// The value of an expression, if all figures in it have one.
    fn computed(&self, text: &str) -> Result<f64, &'static str> {
        const WRONG: &str = "its expression cannot be computed";
        let law = Expression::parse_law(text).map_err(|_| WRONG)?;
        let constant = |name: &str| self.parameters.get(name).map(|(_, value, dimension)| (value.clone(), *dimension));
        let varying = |name: &str| self.figures.get(name).map(|figure| figure.dimension);
        let mut graph = Graph::default();
        let (expr, _) = lowered(&mut graph, &law, &varying, &constant).map_err(|_| WRONG)?;
        let (mut symbols, mut values) = (Vec::new(), Vec::new());
        for figure in law.names().into_iter().filter_map(|name| self.figures.get(name)) {
            let value = self.values.get(figure.name.as_str()).copied().flatten();
            values.push(value.ok_or("a figure in its expression has no value in this run")?);
            let symbol = graph.symbol(&figure.name, figure.dimension);
            symbols.extend(graph.symbol_of(symbol));
        }
        let plan = compile(&graph, &symbols, &[(text.to_string(), expr)]).map_err(|_| WRONG)?;
        let (block, mut memory) = (plan.block(), plan.memory());
        memory.iter_mut().zip(&values).for_each(|(place, value)| *place = *value);
        let _ = block.evaluate(&mut memory);
        block.output(0, &memory).filter(|value| value.is_finite()).ok_or("its expression is no number")
    }
}

/// Why a figure of cones has no value: the run ended before the car passed them.
fn ends_before(tracks: &[Track], figure: &str, series: &Series) -> Option<String> {
    let Track { cones, end } = tracks.iter().find(|track| track.cones.figure == figure)?;
    let reached = series.signal(&cones.reached)?.values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (reached < *end).then(|| {
        format!(
            "the figure `{figure}` has no value: the run ends before the car has passed all cones, as its rear axle \
             reaches x = {reached:.1} m and the last cones are at x = {end:.1} m: lengthen `duration` of the \
             manoeuvre `{}`, or drive faster",
            cones.manoeuvre
        )
    })
}

/// The figures of a run, and warnings about those without a value.
pub(in crate::study) fn figures_of(
    all: &[Figure],
    Computed { parameters, tracks, .. }: &Computed,
    (variant, series, ran): (&str, &Series, &Ran<'_>),
) -> (Vec<FigureResult>, Vec<String>) {
    let (mut found, mut notes): (Vec<FigureResult>, Vec<String>) = (Vec::new(), Vec::new());
    // The first of several of one name.
    let mut known = Known {
        figures: all.iter().rev().map(|figure| (figure.name.as_str(), figure)).collect(),
        parameters: parameters.iter().rev().map(|parameter| (parameter.0.as_str(), parameter)).collect(),
        values: HashMap::new(),
    };
    for figure in all.iter().filter(|figure| selects(&figure.variants, variant)) {
        let Figure { name, of, unit, display, .. } = figure;
        let (text, value) = match of {
            FigureOf::Measure(measure) => {
                let judged = judge(measure, series, ran, &[]);
                let early = ends_before(tracks, name, series);
                let value = judged.result.measured.filter(|_| early.is_none());
                notes.extend(early.filter(|_| ran.completed).or(judged.note));
                (judged.result.text, value)
            }
            FigureOf::Value(text) => {
                let value = known.computed(text);
                let note = |why: &str| format!("the figure `{name}` has no value: {why}");
                notes.extend(value.err().filter(|_| ran.completed).map(note));
                (text.clone(), value.ok())
            }
        };
        known.values.entry(name).or_insert(value);
        let (name, unit, display) = (name.clone(), unit.clone(), display.clone());
        found.push(FigureResult { name, text, value, unit, display });
    }
    (found, notes)
}
