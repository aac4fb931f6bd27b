//! Taylor series of all values of a plan, coefficient by coefficient.
//!
//! The coefficients of a product are sums of products, those of a function follow from its differential equation (Griewank and Walther,
//! Evaluating Derivatives, 2008, chapter 13). So a differential equation whose right side is a plan gives its solution's series one
//! coefficient after the other: each rate gives the next coefficient of its state.

use std::sync::Arc;

use kardan_native::{NativeSeries, Step};
use kardan_rt::Operator;

use super::Plan;

/// Taylor coefficients of all values of a plan up to an order.
///
/// ```
/// use kardan::expr::{Function, Graph};
/// use kardan::plan::{Series, compile};
/// use kardan::units::Dimension;
/// // ẋ = cos x from x = 0: x = t − t³/6 + …
/// let mut graph = Graph::default();
/// let x = graph.symbol("x", Dimension::ANGLE);
/// let rate = graph.apply(Function::Cos, x);
/// let plan = compile(&graph, &[graph.symbol_of(x).unwrap()], &[("rate".into(), rate)]).unwrap();
/// let mut series = Series::new(&plan, 3, &[plan.place(0)], |_| false).unwrap();
/// let mut memory = plan.memory();
/// assert!(plan.block().evaluate(&mut memory));
/// series.begin(&memory);
/// for k in 1..=3 {
///     let rate = series.value(plan.place(0), k - 1);
///     series.set(0, k, &[rate / k as f64]);
///     series.advance(k);
/// }
/// assert_eq!((series.value(0, 1), series.value(0, 2), series.value(0, 3)), (1.0, 0.0, -1.0 / 6.0));
/// ```
#[derive(Debug, Clone)]
pub struct Series {
    order: usize,
    /// Values of an order: those of the plan, then what rules keep beside (the cosine of a sine, 1 + t² of a tangent, √(1 − a²) of an arc sine or
    /// cosine, 1 + a² of an arc tangent, a² + b² of an angle of a point).
    width: usize,
    steps: Vec<Step>,
    /// The steps as machine code, where there is such code.
    native: Option<Arc<NativeSeries>>,
    /// Coefficients, those of an order one after the other.
    memory: Vec<f64>,
}

impl Series {
    /// The series of a plan up to an order, of the values at some places of its memory and of what they need; `steady` tells which inputs
    /// do not change. `None` if one of them has kinks, which have no series.
    pub fn new(plan: &Plan, order: usize, wanted: &[usize], steady: impl Fn(usize) -> bool) -> Option<Self> {
        let (inputs, constants) = (plan.inputs.len(), plan.constants.len());
        let values = plan.block().memory();
        let mut is_steady: Vec<bool> =
            (0..values).map(|k| if k < inputs { steady(k) } else { k < inputs + constants }).collect();
        let needed = needed(plan, wanted);
        let (mut steps, mut done, mut beside) = (Vec::new(), inputs + constants, values);
        let mut operands = plan.operands.as_slice();
        for run in &plan.runs {
            let (own, later) = operands.split_at(run.count * run.operator.operands());
            for (k, operands) in own.chunks_exact(run.operator.operands()).enumerate() {
                let operands: Vec<usize> = operands.iter().map(|place| *place as usize).collect();
                let own_steady = operands.iter().all(|place| is_steady[*place]);
                is_steady[done + k] = own_steady;
                if run.operator == Operator::SineCosine {
                    is_steady[done + run.count + k] = own_steady;
                }
                let cosine = run.operator == Operator::SineCosine && needed[done + run.count + k];
                if own_steady || !(needed[done + k] || cosine) {
                    continue;
                }
                let (scaled, operands) = arranged(run.operator, &operands, &is_steady)?;
                let more = match run.operator {
                    Operator::SineCosine => done + run.count + k,
                    Operator::Tangent
                    | Operator::ArcSine
                    | Operator::ArcCosine
                    | Operator::ArcTangent
                    | Operator::ArcTangent2 => {
                        beside += 1;
                        beside - 1
                    }
                    _ => 0,
                };
                let (out, more) = ((done + k) as u32, more as u32);
                let operands = operands.map(|place| place as u32);
                steps.push(Step { operator: run.operator, scaled, out, operands, more });
            }
            done += run.count * run.operator.values();
            operands = later;
        }
        let native = NativeSeries::new(&steps, beside).map(Arc::new);
        Some(Self { order, width: beside, steps, native, memory: vec![0.0; beside * (order + 1)] })
    }

    /// The highest order.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Takes the values of the plan at the point of expansion, from its memory. Those of higher orders are to be found anew.
    pub fn begin(&mut self, values: &[f64]) {
        self.memory[..values.len()].copy_from_slice(values);
        for step in &self.steps {
            let at = |place: u32| self.memory[place as usize];
            let [a, b, _] = step.operands;
            let beside = match step.operator {
                Operator::Tangent => 1.0 + at(step.out) * at(step.out),
                Operator::ArcSine | Operator::ArcCosine => ((1.0 - at(a)) * (1.0 + at(a))).sqrt(),
                Operator::ArcTangent => 1.0 + at(a) * at(a),
                Operator::ArcTangent2 => at(a) * at(a) + at(b) * at(b),
                _ => continue,
            };
            self.memory[step.more as usize] = beside;
        }
    }

    /// Sets the coefficients of an order of inputs one after the other, from a first one on.
    #[inline]
    pub fn set(&mut self, first: usize, order: usize, coefficients: &[f64]) {
        self.memory[order * self.width + first..][..coefficients.len()].copy_from_slice(coefficients);
    }

    /// A coefficient of the value at a place of the plan's memory.
    #[inline]
    pub fn value(&self, place: usize, order: usize) -> f64 {
        self.memory[order * self.width + place]
    }

    /// All coefficients of the value at a place of the plan's memory.
    #[inline]
    pub fn of(&self, place: usize) -> impl DoubleEndedIterator<Item = f64> + ExactSizeIterator {
        self.memory[place..].iter().step_by(self.width).copied()
    }

    /// `Σ c_j x_(k−j)` over j = 1 … k, where c are the coefficients of the value at a place.
    #[inline]
    pub fn convolution(&self, place: usize, k: usize, x: impl Fn(usize) -> f64) -> f64 {
        (1..k + 1).fold(0.0, |sum, j| sum + self.value(place, j) * x(k - j))
    }

    /// Finds the coefficients of an order, at least 1, of all values from those of the inputs.
    pub fn advance(&mut self, k: usize) {
        let Self { width, steps, native, memory, .. } = self;
        let find = |memory: &mut [f64], step: usize| find(&mut Coefficients { memory, width: *width, k }, &steps[step]);
        match native {
            Some(native) => native.advance(memory, k, find),
            None => (0..steps.len()).for_each(|step| find(memory, step)),
        }
    }
}

/// The coefficients of all values, while those of order k are found.
struct Coefficients<'a> {
    memory: &'a mut [f64],
    width: usize,
    k: usize,
}

impl Coefficients<'_> {
    #[inline]
    fn at(&self, place: u32, order: usize) -> f64 {
        self.memory[order * self.width + place as usize]
    }

    #[inline]
    fn now(&self, place: u32) -> f64 {
        self.at(place, self.k)
    }

    #[inline]
    fn put(&mut self, place: u32, value: f64) {
        self.memory[self.k * self.width + place as usize] = value;
    }

    /// `Σ a_j b_(k−j)` over some j.
    #[inline]
    fn sum(&self, a: u32, b: u32, orders: impl Iterator<Item = usize>) -> f64 {
        orders.fold(0.0, |sum, j| sum + self.at(a, j) * self.at(b, self.k - j))
    }

    /// The same over j = 0 … k; of a square each pair once.
    fn product(&self, a: u32, b: u32) -> f64 {
        if a != b {
            return self.sum(a, b, 0..self.k + 1);
        }
        let half = self.sum(a, a, 0..self.k.div_ceil(2));
        let twice = half + half;
        if self.k.is_multiple_of(2) { twice + self.at(a, self.k / 2) * self.at(a, self.k / 2) } else { twice }
    }

    /// `Σ a_j a_(k−j)` over j = 1 … k − 1.
    fn inner(&self, a: u32) -> f64 {
        self.sum(a, a, 1..self.k)
    }

    /// `Σ j a_j b_(k−j)/k` over some j from 1: over all up to k the coefficient of `∫ b ȧ`.
    #[inline]
    fn sloped(&self, a: u32, b: u32, orders: impl Iterator<Item = usize>) -> f64 {
        let per = 1.0 / self.k as f64;
        orders.fold(0.0, |sum, j| sum + j as f64 * self.at(a, j) * self.at(b, self.k - j)) * per
    }
}

/// Finds the coefficient of order k of a value.
fn find(all: &mut Coefficients<'_>, step: &Step) {
    let k = all.k;
    let Step { operator, scaled, out, operands: [a, b, c], more } = *step;
    let value = match operator {
        Operator::Add => all.now(a) + all.now(b),
        Operator::Subtract => all.now(a) - all.now(b),
        Operator::Negate => -all.now(a),
        Operator::Multiply if scaled => all.now(a) * all.at(b, 0),
        Operator::Divide if scaled => all.now(a) / all.at(b, 0),
        Operator::AddProduct if scaled => all.now(c) + all.now(a) * all.at(b, 0),
        Operator::SubtractProduct if scaled => all.now(c) - all.now(a) * all.at(b, 0),
        Operator::Multiply => all.product(a, b),
        Operator::AddProduct => all.now(c) + all.product(a, b),
        Operator::SubtractProduct => all.now(c) - all.product(a, b),
        Operator::Divide => (all.now(a) - all.sum(out, b, 0..k)) / all.at(b, 0),
        Operator::SquareRoot => (all.now(a) - all.inner(out)) / (2.0 * all.at(out, 0)),
        Operator::Exponential => all.sloped(a, out, 1..k + 1),
        Operator::Logarithm => (all.now(a) - all.sloped(out, a, 1..k)) / all.at(a, 0),
        Operator::SineCosine => {
            let (cosine, sine) = (-all.sloped(a, out, 1..k + 1), all.sloped(a, more, 1..k + 1));
            all.put(more, cosine);
            sine
        }
        Operator::Tangent => {
            let tangent = all.sloped(a, more, 1..k + 1);
            all.put(out, tangent);
            let square = all.product(out, out);
            all.put(more, square);
            tangent
        }
        Operator::ArcTangent => {
            let square = all.product(a, a);
            all.put(more, square);
            (all.now(a) - all.sloped(out, more, 1..k)) / all.at(more, 0)
        }
        Operator::ArcSine | Operator::ArcCosine => {
            let square = all.product(a, a) + all.inner(more);
            all.put(more, -square / (2.0 * all.at(more, 0)));
            let slope = if operator == Operator::ArcSine { all.now(a) } else { -all.now(a) };
            (slope - all.sloped(out, more, 1..k)) / all.at(more, 0)
        }
        Operator::ArcTangent2 => {
            let square = all.product(a, a) + all.product(b, b);
            all.put(more, square);
            let turn = all.sloped(a, b, 1..k + 1) - all.sloped(b, a, 1..k + 1);
            (turn - all.sloped(out, more, 1..k)) / all.at(more, 0)
        }
        // Refused when the series were made.
        Operator::Absolute | Operator::Minimum | Operator::Maximum | Operator::Select | Operator::Table => f64::NAN,
    };
    all.put(out, value);
}

/// Which values of a plan's memory some of them need.
fn needed(plan: &Plan, wanted: &[usize]) -> Vec<bool> {
    let mut needed = vec![false; plan.block().memory()];
    wanted.iter().for_each(|place| needed[*place] = true);
    let (mut last, mut operands) = (needed.len(), plan.operands.as_slice());
    for run in plan.runs.iter().rev() {
        let first = last - run.count * run.operator.values();
        let (earlier, own) = operands.split_at(operands.len() - run.count * run.operator.operands());
        for (k, operands) in own.chunks_exact(run.operator.operands()).enumerate() {
            let cosine = run.operator == Operator::SineCosine && needed[first + run.count + k];
            if needed[first + k] || cosine {
                operands.iter().for_each(|place| needed[*place as usize] = true);
            }
        }
        (last, operands) = (first, earlier);
    }
    needed
}

/// Whether an operation scales by a steady number, and its operands with that as the second one; `None` where it has kinks.
fn arranged(operator: Operator, operands: &[usize], steady: &[bool]) -> Option<(bool, [usize; 3])> {
    use Operator::{Absolute, AddProduct, Divide, Maximum, Minimum, Multiply, Select, SubtractProduct, Table};
    let at = |k: usize| operands.get(k).copied().unwrap_or(0);
    let all = [at(0), at(1), at(2)];
    match operator {
        Absolute | Minimum | Maximum | Select | Table => None,
        Multiply | AddProduct | SubtractProduct if steady[at(0)] && !steady[at(1)] => {
            Some((true, [at(1), at(0), at(2)]))
        }
        Multiply | AddProduct | SubtractProduct | Divide => Some((steady[at(1)], all)),
        _ => Some((false, all)),
    }
}
