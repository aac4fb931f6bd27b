//! The description of a kind of signal, and the writer of its function of time.

use std::sync::Arc;

use crate::element::KeyError;
use kardan_expr::expr::{Expr, Function, Graph, Named, Part, Pieces};
use kardan_math::num::{Rational, rational_to_f64};
use kardan_math::units::{Dimension, Exact, UnitError};
use kardan_schema::schema::{Field, Values};

/// Breakpoints that the signals of a scenario may have together: at each of them a step of the integrator ends.
pub const MOST_BREAKPOINTS: usize = 100_000;

/// The description of a kind of signal.
#[derive(Debug, Clone, Copy)]
pub struct SignalKind {
    /// The word after `kind =`, and the name of the file here.
    pub keyword: &'static str,
    /// Summary in one sentence.
    pub summary: &'static str,
    /// Its formula, and its values before its start and after its end.
    pub formula: &'static str,
    /// Its keys besides `kind`.
    pub fields: &'static [Field],
    /// An example, valid TOML.
    pub example: &'static str,
    /// Checks of several keys together.
    pub check: fn(&Values) -> Vec<KeyError>,
    /// Its function of time.
    pub write: fn(&Values, &mut SignalWriter<'_>) -> Result<Expr, Refused>,
}

/// An error of a signal.
#[derive(Debug, Clone, PartialEq)]
pub enum Refused {
    /// A key and its error.
    Key(&'static str, KeyError),
    /// A part of an expression.
    Expression(UnitError),
}

impl Refused {
    /// A code, the key, the message and the help.
    pub(super) fn new(code: &'static str, key: &'static str, message: String, help: impl Into<String>) -> Self {
        Self::Key(code, KeyError::new(key, message, help))
    }
}

/// Points of a table, SI.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Samples {
    /// Times, s.
    pub times: Vec<f64>,
    /// Values.
    pub values: Vec<f64>,
}

/// The writer of a signal.
pub struct SignalWriter<'a> {
    /// The graph.
    pub graph: &'a mut Graph,
    /// The time in it, s.
    pub time: Expr,
    /// The name of the signal.
    pub name: &'a str,
    /// Dimension of its values.
    pub dimension: Dimension,
    /// End time of the pieces, s.
    pub horizon: f64,
    /// The seed of the scenario.
    pub seed: u64,
    /// Remaining number of breakpoints.
    pub room: &'a mut usize,
    /// Parts so far, with their symbols.
    pub parts: &'a mut Vec<(Expr, Arc<Part>)>,
    /// Symbols of the names in an expression.
    pub names: &'a [(String, Named)],
    /// Points of a table.
    pub samples: Option<&'a Samples>,
}

impl SignalWriter<'_> {
    /// A number.
    pub fn exact(&mut self, value: &Exact) -> Expr {
        self.graph.exact(value)
    }

    /// A part of pieces in the order of their starts. Those after the horizon are left out.
    ///
    /// # Errors
    /// Too many breakpoints.
    pub fn pieces(
        &mut self,
        what: &str,
        (dimension, reported): (Dimension, bool),
        pieces: impl Iterator<Item = (f64, [f64; 4])>,
    ) -> Result<Expr, Refused> {
        let horizon = self.horizon;
        let made: Vec<_> = pieces.take_while(|(start, _)| *start < horizon).take(*self.room + 1).collect();
        if made.len() > *self.room {
            let message =
                format!("more than {MOST_BREAKPOINTS} breakpoints up to {horizon} s, with all signals together");
            let help = "at each of them a step of the integrator ends: make its times longer, or the duration shorter";
            return Err(Refused::new("signal::breakpoints", "kind", message, help));
        }
        *self.room -= made.len();
        let name = if what.is_empty() { self.name.to_string() } else { format!("{}.{what}", self.name) };
        let symbol = self.graph.new_symbol(name.clone(), dimension);
        let part = Part { name, dimension, pieces: Pieces::new(made), reported };
        self.parts.push((symbol, Arc::new(part)));
        Ok(symbol)
    }

    /// Whether it is on (1, else 0), and the time since a start up to an end (s); before it zero.
    ///
    /// # Errors
    /// Those of [`pieces`](Self::pieces).
    pub fn clock(&mut self, start: &Exact, over: Option<&Exact>) -> Result<(Expr, Expr), Refused> {
        let end = over.map(|over| start.to_rational() + over.to_rational());
        let end = end.map(|end| rational_to_f64(&end)).filter(|end| *end < self.horizon);
        if start.is_zero() && end.is_none() {
            return Ok((self.graph.integer(1), self.time));
        }
        let begin = start.to_f64();
        let mut on = vec![(0.0, [0.0; 4]), (begin, [1.0, 0.0, 0.0, 0.0])];
        let mut clock = vec![(0.0, [0.0; 4]), (begin, [0.0, 1.0, 0.0, 0.0])];
        if let (Some(end), Some(over)) = (end, over) {
            on.push((end, [0.0; 4]));
            clock.push((end, [over.to_f64(), 0.0, 0.0, 0.0]));
        }
        let on = self.pieces("on", (Dimension::NONE, false), on.into_iter())?;
        let clock = self.pieces("clock", (Dimension::TIME, false), clock.into_iter())?;
        Ok((on, clock))
    }

    /// `offset + on·amplitude·sin(angle)`
    pub fn wave(&mut self, values: &Values, on: Expr, angle: Expr) -> Expr {
        let [amplitude, offset] = ["amplitude", "offset"].map(|key| self.graph.exact(&values.exact_or_default(key)));
        let angle = self.graph.group(angle);
        let sine = self.graph.apply(Function::Sin, angle);
        let wave = self.graph.product(&[(on, 1), (amplitude, 1), (sine, 1)]);
        self.graph.add(offset, wave)
    }

    /// `2π·x + phase`
    pub fn turns(&mut self, x: Expr, phase: &Exact) -> Expr {
        let (pi, phase) = (self.graph.pi(), self.graph.exact(phase));
        let half_turns = self.graph.multiply(pi, x);
        self.graph.sum(Rational::ZERO, &[(half_turns, Rational::from(2)), (phase, Rational::ONE)])
    }
}

/// Times `start + k·step`, each the number nearest to its exact value.
pub(super) fn times(start: &Exact, step: &Exact) -> impl Iterator<Item = f64> {
    let (start, step) = (start.to_rational(), step.to_rational());
    (0u64..).map(move |k| rational_to_f64(&(&start + &step * Rational::from(k))))
}
