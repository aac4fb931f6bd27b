//! Taylor series of all values of a plan, coefficient by coefficient.
//!
//! The coefficients of a product are sums of products, those of a function follow from its differential equation (Griewank and Walther,
//! Evaluating Derivatives, 2008, chapter 13). So a differential equation whose right side is a plan gives its solution's series one
//! coefficient after the other: each rate gives the next coefficient of its state.

use kardan_rt::Operator;

use super::Plan;

/// One value and how its coefficients follow; its places are those of first coefficients.
#[derive(Debug, Clone, Copy)]
struct Step {
    operator: Operator,
    /// Whether b does not change, so that a product or quotient needs the coefficient of its own order alone.
    scaled: bool,
    out: usize,
    operands: [usize; 3],
    /// What is kept beside: the cosine of a sine, 1 + t² of a tangent, √(1 − a²) of an arc sine or cosine, 1 + a² of an arc tangent, a² + b² of
    /// an angle of a point.
    more: usize,
}

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
///     series.set(0, k, rate / k as f64);
///     series.advance(k);
/// }
/// assert_eq!((series.value(0, 1), series.value(0, 2), series.value(0, 3)), (1.0, 0.0, -1.0 / 6.0));
/// ```
#[derive(Debug, Clone)]
pub struct Series {
    /// Coefficients of a value.
    stride: usize,
    /// Values of the plan, without what rules keep beside.
    values: usize,
    steps: Vec<Step>,
    /// Coefficients, those of a value one after the other.
    memory: Vec<f64>,
}

impl Series {
    /// The series of a plan up to an order, of the values at some places of its memory and of what they need; `steady` tells which inputs
    /// do not change. `None` if one of them has kinks, which have no series.
    pub fn new(plan: &Plan, order: usize, wanted: &[usize], steady: impl Fn(usize) -> bool) -> Option<Self> {
        let stride = order + 1;
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
                let operands = operands.map(|place| place * stride);
                let (out, more) = ((done + k) * stride, more * stride);
                steps.push(Step { operator: run.operator, scaled, out, operands, more });
            }
            done += run.count * run.operator.values();
            operands = later;
        }
        Some(Self { stride, values, steps, memory: vec![0.0; beside * stride] })
    }

    /// The highest order.
    pub fn order(&self) -> usize {
        self.stride - 1
    }

    /// Takes the values of the plan at the point of expansion, from its memory. Those of higher orders are to be found anew.
    pub fn begin(&mut self, values: &[f64]) {
        for (coefficients, value) in self.memory.chunks_exact_mut(self.stride).zip(&values[..self.values]) {
            coefficients[0] = *value;
        }
        for step in &self.steps {
            let at = |place: usize| self.memory[place];
            let [a, b, _] = step.operands;
            let beside = match step.operator {
                Operator::Tangent => 1.0 + at(step.out) * at(step.out),
                Operator::ArcSine | Operator::ArcCosine => ((1.0 - at(a)) * (1.0 + at(a))).sqrt(),
                Operator::ArcTangent => 1.0 + at(a) * at(a),
                Operator::ArcTangent2 => at(a) * at(a) + at(b) * at(b),
                _ => continue,
            };
            self.memory[step.more] = beside;
        }
    }

    /// Sets a coefficient of an input.
    #[inline]
    pub fn set(&mut self, input: usize, order: usize, coefficient: f64) {
        self.memory[input * self.stride + order] = coefficient;
    }

    /// A coefficient of the value at a place of the plan's memory.
    #[inline]
    pub fn value(&self, place: usize, order: usize) -> f64 {
        self.memory[place * self.stride + order]
    }

    /// All coefficients of the value at a place of the plan's memory.
    #[inline]
    pub fn of(&self, place: usize) -> &[f64] {
        &self.memory[place * self.stride..][..self.stride]
    }

    /// Finds the coefficients of an order, at least 1, of all values from those of the inputs.
    pub fn advance(&mut self, k: usize) {
        let per = 1.0 / k as f64;
        for step in &self.steps {
            let memory = self.memory.as_mut_slice();
            let Step { operator, scaled, out, operands: [a, b, c], more } = *step;
            let value = match operator {
                Operator::Add => memory[a + k] + memory[b + k],
                Operator::Subtract => memory[a + k] - memory[b + k],
                Operator::Negate => -memory[a + k],
                Operator::Multiply if scaled => memory[a + k] * memory[b],
                Operator::Divide if scaled => memory[a + k] / memory[b],
                Operator::AddProduct if scaled => memory[c + k] + memory[a + k] * memory[b],
                Operator::SubtractProduct if scaled => memory[c + k] - memory[a + k] * memory[b],
                Operator::Multiply => product(memory, a, b, k),
                Operator::AddProduct => memory[c + k] + product(memory, a, b, k),
                Operator::SubtractProduct => memory[c + k] - product(memory, a, b, k),
                Operator::Divide => {
                    (memory[a + k] - convolution(&memory[out..out + k], &memory[b + 1..=b + k])) / memory[b]
                }
                Operator::SquareRoot => (memory[a + k] - inner(memory, out, k)) / (2.0 * memory[out]),
                Operator::Exponential => sloped(memory, a, out, k) * per,
                Operator::Logarithm => (memory[a + k] - sloped_inner(memory, out, a, k) * per) / memory[a],
                Operator::SineCosine => {
                    let cosine = -sloped(memory, a, out, k) * per;
                    let sine = sloped(memory, a, more, k) * per;
                    memory[more + k] = cosine;
                    sine
                }
                Operator::Tangent => {
                    let tangent = sloped(memory, a, more, k) * per;
                    memory[out + k] = tangent;
                    memory[more + k] = product(memory, out, out, k);
                    tangent
                }
                Operator::ArcTangent => {
                    memory[more + k] = product(memory, a, a, k);
                    (memory[a + k] - sloped_inner(memory, out, more, k) * per) / memory[more]
                }
                Operator::ArcSine | Operator::ArcCosine => {
                    let square = product(memory, a, a, k) + inner(memory, more, k);
                    memory[more + k] = -square / (2.0 * memory[more]);
                    let slope = if operator == Operator::ArcSine { memory[a + k] } else { -memory[a + k] };
                    (slope - sloped_inner(memory, out, more, k) * per) / memory[more]
                }
                Operator::ArcTangent2 => {
                    memory[more + k] = product(memory, a, a, k) + product(memory, b, b, k);
                    let turn = sloped(memory, a, b, k) - sloped(memory, b, a, k);
                    (turn - sloped_inner(memory, out, more, k)) * per / memory[more]
                }
                // Refused when the series were made.
                Operator::Absolute | Operator::Minimum | Operator::Maximum | Operator::Select | Operator::Table => {
                    f64::NAN
                }
            };
            memory[out + k] = value;
        }
    }
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

/// `Σ a_j b_(n−j)` over two lists of n + 1 coefficients.
#[inline]
pub fn convolution(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b.iter().rev()).fold(0.0, |sum, (x, y)| sum + x * y)
}

/// `Σ a_j b_(k−j)` over j = 0 … k.
#[inline]
fn product(memory: &[f64], a: usize, b: usize, k: usize) -> f64 {
    convolution(&memory[a..=a + k], &memory[b..=b + k])
}

/// `Σ a_j a_(k−j)` over j = 1 … k − 1.
#[inline]
fn inner(memory: &[f64], a: usize, k: usize) -> f64 {
    convolution(&memory[a + 1..a + k], &memory[a + 1..a + k])
}

/// `Σ j a_j b_(k−j)` over j = 1 … k: k times the coefficient of `∫ b ȧ`.
#[inline]
fn sloped(memory: &[f64], a: usize, b: usize, k: usize) -> f64 {
    let pairs = memory[a + 1..=a + k].iter().zip(memory[b..b + k].iter().rev());
    pairs.zip(1u32..).fold(0.0, |sum, ((x, y), j)| sum + f64::from(j) * x * y)
}

/// The same over j = 1 … k − 1.
#[inline]
fn sloped_inner(memory: &[f64], a: usize, b: usize, k: usize) -> f64 {
    let pairs = memory[a + 1..a + k].iter().zip(memory[b + 1..b + k].iter().rev());
    pairs.zip(1u32..).fold(0.0, |sum, ((x, y), j)| sum + f64::from(j) * x * y)
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
