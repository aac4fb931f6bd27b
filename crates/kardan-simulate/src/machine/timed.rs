//! The time-dependent inputs of a loop's expressions: the time itself, parts of functions of it, and which sources
//! follow theirs.

use std::sync::Arc;

use kardan_rt::Operator;

use crate::compiled_plan::CompiledPlan;
use crate::scenario::Scenario;
use kardan_expr::expr::{Domain, Expr, Interval, Intervals, Part, polynomial};
use kardan_math::num::StateArchive;
use kardan_mechanics::reduce::{Extension, Motion};

use super::expressions::Places;

/// Relative difference of two times that are equal: breakpoints of two parts, or of a part and an event, that differ by
/// rounding.
pub(crate) const SAME: f64 = 1e-14;

/// The coefficients of a polynomial shifted to a later time.
pub(super) fn shifted([a, b, c, d]: &[f64; 4], x: f64) -> [f64; 4] {
    [polynomial(&[*a, *b, *c, *d], x), b + (2.0 * c + 3.0 * d * x) * x, c + 3.0 * d * x, *d]
}

/// The time-dependent inputs in a run.
#[derive(Default)]
pub(crate) struct Timed {
    parts: Vec<Arc<Part>>,
    /// For each part its present piece: start and coefficients.
    now: Vec<(f64, [f64; 4])>,
    /// Whether the time itself is an input.
    pub time: bool,
    /// Block outputs: their sources, and the present values.
    blocks: Vec<(usize, f64)>,
    /// Sources whose lines are not level, and whether no motor reaches or leaves its limit before the next sample.
    pub ramps: Vec<usize>,
    pub limits_rest: bool,
    /// Sources with a function of time, and 1 where they follow it, 0 where they are set from outside.
    sources: Vec<usize>,
    follows: Vec<f64>,
    /// Whether sources depend on states.
    flows: bool,
    /// Whether all functions are straight lines between breakpoints.
    pub affine: bool,
    /// The inputs: follower flags, parts, the time.
    current: Vec<f64>,
    /// Values of the sources, from their lines and the inputs; `None` if no source has a function.
    plan: Option<CompiledPlan<f64>>,
    /// Their last values.
    pub values: Vec<f64>,
}

impl Timed {
    /// For a loop that was written into a motion; `values` are the sources.
    pub(super) fn new(
        motion: &Motion,
        scenario: &Scenario,
        (extension, places): (&Extension, &Places),
        values: &[Expr],
    ) -> Self {
        let parts: Vec<Arc<Part>> = motion.timed.parts.iter().map(|(part, _)| Arc::clone(part)).collect();
        let sources: Vec<usize> = scenario.signals.iter().map(|signal| signal.source).collect();
        let source = |name: &str| scenario.source(name).expect("an output of a block is a source");
        let flows = scenario.flow.is_some();
        let plan = (flows || !sources.is_empty()).then(|| {
            let inputs = places.sources.clone().chain(places.timed.clone());
            let mut inputs: Vec<_> = inputs.map(|place| extension.inputs[place]).collect();
            if flows {
                inputs.extend(motion.symbols.iter().chain(&extension.inputs[places.states.clone()]));
            }
            let outputs: Vec<(String, Expr)> =
                values.iter().enumerate().map(|(k, value)| (format!("source.{k}"), *value)).collect();
            CompiledPlan::new(&motion.graph, &inputs, &outputs)
        });
        Self {
            now: vec![(0.0, [0.0; 4]); parts.len()],
            parts,
            time: motion.timed.time.is_some(),
            blocks: motion.timed.blocks.iter().map(|(name, _)| (source(name), 0.0)).collect(),
            follows: vec![1.0; sources.len()],
            sources,
            flows,
            affine: scenario.signals.iter().all(|signal| signal.function.is_affine()),
            current: vec![0.0; places.timed.len()],
            plan,
            values: vec![0.0; values.len()],
            ..Self::default()
        }
    }

    /// Whether no value depends on the time.
    pub fn is_empty(&self) -> bool {
        self.current.is_empty()
    }

    /// Takes the pieces of all parts that are valid from a time on.
    pub fn enter(&mut self, time: f64) {
        for (now, part) in self.now.iter_mut().zip(&self.parts) {
            *now = part.pieces.piece(time + SAME * time);
        }
    }

    /// The first breakpoint of a part after a time, s; infinite if there is none.
    pub fn next(&self, time: f64) -> f64 {
        self.parts.iter().filter_map(|part| part.pieces.next(time + SAME * time)).fold(f64::INFINITY, f64::min)
    }

    /// Breakpoints of all parts up to a time.
    pub fn breakpoints(&self, until: f64) -> usize {
        self.parts.iter().map(|part| part.pieces.starts().partition_point(|start| *start < until)).sum()
    }

    /// Parts that a run reports and that have a breakpoint at a time.
    pub fn reported(&self, time: f64) -> impl Iterator<Item = &Part> {
        let begins = move |part: &&Part| {
            let starts = part.pieces.starts();
            let first = starts.partition_point(|start| *start < time - SAME * time);
            starts.get(first).is_some_and(|start| *start <= time + SAME * time)
        };
        self.parts.iter().map(|part| &**part).filter(|part| part.reported).filter(begins)
    }

    /// The inputs at a time of the segment.
    pub fn at(&mut self, time: f64) -> &[f64] {
        let count = self.follows.len();
        let (follows, later) = self.current.split_at_mut(count);
        follows.copy_from_slice(&self.follows);
        for (value, (start, coefficients)) in later.iter_mut().zip(&self.now) {
            *value = polynomial(coefficients, time - start);
        }
        let rest = &mut later[self.now.len()..];
        if self.time {
            rest[0] = time;
        }
        for (value, (_, output)) in rest.iter_mut().skip(usize::from(self.time)).zip(&self.blocks) {
            *value = *output;
        }
        &self.current
    }

    /// The ranges of the inputs over an interval of time of the segment.
    pub fn between(&self, span: Interval) -> Vec<Interval> {
        let of_part = |(start, coefficients): &(f64, [f64; 4])| {
            let later = Intervals.operation(Operator::Subtract, &[span, Interval::point(*start)]);
            let [first, rest @ ..] = coefficients;
            let slopes = rest.iter().rev().map(|c| Interval::point(*c));
            let inner = slopes.reduce(|sum, c| Intervals.operation(Operator::AddProduct, &[sum, later, c]));
            let inner = inner.unwrap_or(Interval::point(0.0));
            if rest.iter().all(|c| *c == 0.0) {
                return Interval::point(*first);
            }
            Intervals.operation(Operator::AddProduct, &[inner, later, Interval::point(*first)])
        };
        let follows = self.follows.iter().map(|follows| Interval::point(*follows));
        let blocks = self.blocks.iter().map(|(_, output)| Interval::point(*output));
        follows.chain(self.now.iter().map(of_part)).chain(self.time.then_some(span)).chain(blocks).collect()
    }

    /// Whether a part or the time changes while the state may be at rest.
    pub fn moves(&self) -> bool {
        self.time || !self.parts.is_empty()
    }

    /// Computes the values of the sources from those of their lines.
    pub fn find_sources(&mut self, lines: &[f64], time: f64, state: &[f64]) {
        self.at(time);
        let Some(plan) = &mut self.plan else { return self.values.copy_from_slice(lines) };
        let memory = &mut plan.memory;
        memory[..lines.len()].copy_from_slice(lines);
        memory[lines.len()..][..self.current.len()].copy_from_slice(&self.current);
        if self.flows {
            let first = lines.len() + self.current.len();
            // Work and loss are behind the states.
            memory[first..][..state.len() - 2].copy_from_slice(&state[..state.len() - 2]);
        }
        plan.evaluate();
        self.values.iter_mut().enumerate().for_each(|(k, value)| *value = *plan.output(k));
    }

    /// Whether no value changes until the segment ends.
    pub fn is_steady(&self) -> bool {
        !self.time && self.now.iter().all(|(_, coefficients)| coefficients[1..].iter().all(|c| *c == 0.0))
    }

    /// The series of all inputs, from a time of the segment on: coefficients of the orders 1 to 3.
    pub fn series(&self, time: f64) -> impl Iterator<Item = [f64; 3]> {
        self.polynomials().map(move |(start, coefficients)| {
            let [_, later @ ..] = shifted(&coefficients, time - start);
            later
        })
    }

    /// The inputs as polynomials of the time in the segment: the start of each, and its coefficients.
    pub fn polynomials(&self) -> impl Iterator<Item = (f64, [f64; 4])> {
        let constant = |value: &f64| (0.0, [*value, 0.0, 0.0, 0.0]);
        let time = self.time.then_some((0.0, [0.0, 1.0, 0.0, 0.0]));
        let blocks = self.blocks.iter().map(move |(_, output)| constant(output));
        self.follows.iter().map(constant).chain(self.now.iter().copied()).chain(time).chain(blocks)
    }

    /// Whether the inputs are polynomials of the time, without block outputs.
    pub fn is_polynomial(&self) -> bool {
        self.blocks.is_empty() && !self.flows
    }

    /// Sets the output of the block of a source from now on.
    pub fn output(&mut self, source: usize, value: f64) {
        let own = self.blocks.iter_mut().filter(|(own, _)| *own == source);
        own.for_each(|(_, output)| *output = value);
    }

    /// Whether a source follows a function of time.
    pub fn follows(&self, source: usize) -> bool {
        self.sources.iter().zip(&self.follows).any(|(own, follows)| *own == source && *follows != 0.0)
    }

    /// A source is set from outside from now on.
    pub fn take_over(&mut self, source: usize) {
        let own = self.sources.iter().zip(&mut self.follows).filter(|(own, _)| **own == source);
        own.for_each(|(_, follows)| *follows = 0.0);
    }

    pub fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.numbers(&mut self.follows);
        self.blocks.iter_mut().for_each(|(_, output)| archive.number(output));
        for (start, coefficients) in &mut self.now {
            archive.number(start);
            archive.numbers(coefficients);
        }
    }
}
