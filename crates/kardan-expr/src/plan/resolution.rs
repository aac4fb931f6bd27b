//! Resolution of an integrator step: how far the arguments of operations move, and what operations can do between
//! samples.
//!
//! A nonpolynomial operation changes its character on a scale of its own: `exp a` when a moves by one, `sin a` by a
//! radian, `1/a` and `√a` when a changes by a fraction of itself. A step over which no argument moves by more than that
//! resolves all of them: its series, or its stages, sample their behaviour. A longer step may miss a whole pulse. Then
//! interval arithmetic decides: the ranges of all values while the inputs move, and from these the largest effect of
//! unresolved operations on each output.

use kardan_rt::{Operator, Table};

use super::pieces::{knots, piece_of};
use super::{Operation, Plan};
use crate::expr::{Domain, Interval, Intervals};

/// Scales that the argument of `exp`, `sin`, `tan` and `atan` may move by: 2 and 2 rad.
const WIDE: f64 = 0.5;
/// Part of a value that outward rounding makes of it.
const ROUNDING: f64 = 1e-14;

impl Operation {
    /// Whether it has a scale.
    fn has_scale(&self) -> bool {
        use Operator::{ArcCosine, ArcSine, ArcTangent, ArcTangent2, Divide, Exponential, Logarithm};
        use Operator::{SineCosine, SquareRoot, Tangent};
        matches!(
            self.operator,
            Exponential
                | SineCosine
                | Tangent
                | ArcTangent
                | ArcTangent2
                | ArcSine
                | ArcCosine
                | SquareRoot
                | Logarithm
                | Divide
        )
    }

    /// The operands that its scale is one of: of a quotient the divisor alone.
    fn arguments(&self) -> &[usize] {
        &self.values()[usize::from(self.operator == Operator::Divide)..]
    }

    /// How far its arguments move, in scales; `extent` returns for an index the size of its value and how far it moves.
    /// More than 1 is not resolved.
    fn moved(&self, extent: impl Fn(usize) -> (f64, f64)) -> f64 {
        let of = |k: usize| extent(self.operands[k]);
        let part = |size: f64, moved: f64| if moved == 0.0 { 0.0 } else { moved / size };
        match self.operator {
            Operator::Exponential | Operator::SineCosine | Operator::Tangent | Operator::ArcTangent => WIDE * of(0).1,
            Operator::ArcSine | Operator::ArcCosine => of(0).1,
            Operator::SquareRoot | Operator::Logarithm => part(of(0).0, of(0).1),
            Operator::Divide => part(of(1).0, of(1).1),
            Operator::ArcTangent2 => part(of(0).0.max(of(1).0), of(0).1 + of(1).1),
            _ => 0.0,
        }
    }

    /// The ranges of its values for those of its operands.
    fn range(&self, tables: &[Table], numbers: &[f64], of: impl Fn(usize) -> Interval) -> [Interval; 2] {
        match self.operator {
            Operator::SineCosine => Intervals.sine_cosine(&of(self.operands[0])),
            Operator::Table => [table(&tables[self.operands[0]], numbers, of(self.operands[1])); 2],
            operator => {
                let operands = self.operands.map(of);
                [Intervals.operation(operator, &operands[..operator.operands()]); 2]
            }
        }
    }

    /// Whether its arguments move within their ranges by more than its scale.
    fn is_far(&self, of: impl Fn(usize) -> Interval) -> bool {
        let extent = |place: usize| {
            let Interval { low, high } = of(place);
            let [least, most] = [low.abs().min(high.abs()), low.abs().max(high.abs())];
            let size = match self.operator {
                // A root begins at zero.
                Operator::SquareRoot if low == 0.0 => most,
                _ if low > 0.0 || high < 0.0 => least,
                _ => 0.0,
            };
            (size, high - low)
        };
        !(self.moved(extent) <= 1.0)
    }
}

/// The operations of a plan by which a step is judged.
#[derive(Debug, Clone)]
pub struct Resolution {
    /// Those that a requested output depends on, and that vary.
    operations: Vec<Operation>,
    /// Those among them that have a scale.
    scaled: Vec<usize>,
    tables: Vec<Table>,
    numbers: Vec<f64>,
    /// The range of each value, and the range of the unresolved operations' contribution to it, where they reach it.
    ranges: Vec<Interval>,
    effects: Vec<Option<Interval>>,
    /// Which operations a span does not resolve: the last one, and the step that it is part of.
    unresolved: [Vec<bool>; 2],
}

/// A span that leaves operations unresolved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Over {
    /// The one for which ranges were last computed.
    Span,
    /// The step that was marked before.
    Step,
}

impl Resolution {
    /// For the values at some indices of a plan's memory and their operands; `steady` returns which inputs do not
    /// change.
    pub fn new(plan: &Plan, outputs: &[usize], steady: impl Fn(usize) -> bool) -> Self {
        let (operations, is_steady) = plan.varying(outputs, steady);
        let varies = |operation: &Operation| {
            operation.has_scale() && operation.arguments().iter().any(|place| !is_steady[*place])
        };
        let unresolved = [(); 2].map(|()| vec![false; operations.len()]);
        Self {
            unresolved,
            scaled: (0..operations.len()).filter(|k| varies(&operations[*k])).collect(),
            operations,
            tables: plan.tables.clone(),
            numbers: plan.numbers.clone(),
            ranges: vec![Interval::point(0.0); is_steady.len()],
            effects: vec![None; is_steady.len()],
        }
    }

    /// Whether no operation has a scale: polynomials between kinks.
    pub fn is_empty(&self) -> bool {
        self.scaled.is_empty()
    }

    /// Indices of the arguments of operations that have a scale.
    pub fn arguments(&self) -> impl Iterator<Item = usize> + '_ {
        self.scaled.iter().flat_map(|k| self.operations[*k].arguments().iter().copied())
    }

    /// The largest movement of arguments, in the scales of their operations: with more than 1 a step may miss an event.
    /// `extent` returns for an index of the plan's memory the size of its value and how far it moves.
    pub fn moved(&self, extent: impl Fn(usize) -> (f64, f64)) -> f64 {
        let all = self.scaled.iter().map(|k| self.operations[*k].moved(&extent));
        // NaN counts as far away.
        all.fold(0.0, |most: f64, moved| if moved <= most { most } else { moved })
    }

    /// Computes the ranges of all values while the inputs move within theirs. True where all operations are resolved.
    pub fn find(&mut self, inputs: &[Interval], values: &[f64]) -> bool {
        let Self { operations, tables, numbers, ranges, unresolved: [unresolved, _], .. } = self;
        let (input_ranges, rest) = ranges.split_at_mut(inputs.len());
        input_ranges.copy_from_slice(inputs);
        rest.iter_mut().zip(&values[inputs.len()..]).for_each(|(range, value)| *range = Interval::point(*value));
        for (operation, is_far) in operations.iter().zip(&mut *unresolved) {
            *is_far = operation.is_far(|place| ranges[place]);
            let found = operation.range(tables, numbers, |place| ranges[place]);
            operation.out.into_iter().zip(found).for_each(|(place, range)| ranges[place] = range);
        }
        !unresolved.contains(&true)
    }

    /// Marks the span of the last ranges as the step that later ones are part of.
    pub fn mark_step(&mut self) {
        let [span, step] = &mut self.unresolved;
        step.copy_from_slice(span);
    }

    /// Computes what operations that are not resolved over a span can do in the last one: they may take any value of their range there, all others take
    /// the value in `values` of the plan.
    pub fn find_effects(&mut self, values: &[f64], over: Over) {
        let Self { operations, tables, numbers, ranges, effects, unresolved: [span, step], .. } = self;
        effects.fill(None);
        let unresolved = if over == Over::Span { span } else { step };
        for (operation, unresolved) in operations.iter().zip(unresolved) {
            let reached = || operation.values().iter().any(|place| effects[*place].is_some());
            let effect = match *unresolved {
                true => operation.out.map(|place| Some(ranges[place])),
                false if reached() => {
                    let of = |place: usize| effects[place].unwrap_or(Interval::point(values[place]));
                    operation.range(tables, numbers, of).map(Some)
                }
                false => [None; 2],
            };
            operation.out.into_iter().zip(effect).for_each(|(place, effect)| effects[place] = effect);
        }
    }

    /// The largest difference between the value at an index and its given value that unresolved operations can cause.
    pub fn effect(&self, place: usize, values: &[f64]) -> f64 {
        let value = values[place];
        let apart = self.effects[place].map_or(0.0, |effect| (effect.high - value).max(value - effect.low));
        if apart <= ROUNDING * value.abs() { 0.0 } else { apart }
    }
}

/// The values of a table over an interval.
fn table(table: &Table, numbers: &[f64], x: Interval) -> Interval {
    let knots = knots(table, numbers);
    let first = knots.partition_point(|knot| *knot <= x.low);
    let last = knots.partition_point(|knot| *knot <= x.high);
    let of_piece = |piece: usize| {
        let from = if piece == first { x.low } else { knots[piece - 1] };
        let until = if piece == last { x.high } else { knots[piece] };
        let (origin, coefficients) = piece_of(table, numbers, piece);
        let argument = [Interval { low: from, high: until }, Interval::point(origin)];
        let argument = Intervals.operation(Operator::Subtract, &argument);
        coefficients.iter().rev().fold(Interval::point(0.0), |value, c| {
            Intervals.operation(Operator::AddProduct, &[value, argument, Interval::point(*c)])
        })
    };
    (first..=last).map(of_piece).reduce(Interval::hull).unwrap_or(Interval::ALL)
}
