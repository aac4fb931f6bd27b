//! Taylor series of all values of a plan, coefficient by coefficient.
//!
//! The coefficients of a product are sums of products, those of a function follow from its differential equation (Griewank and Walther,
//! Evaluating Derivatives, 2008, chapter 13). So a differential equation whose right side is a plan gives its solution's series one
//! coefficient after the other: each rate gives the next coefficient of its state.

use kardan_rt::Operator;

use super::Plan;

/// How the coefficient of a value follows from those of its operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Rule {
    Add,
    Subtract,
    Negate,
    /// a·b, b steady
    Scale,
    /// a/b, b steady
    Shrink,
    /// c + a·b, b steady
    AddScaled,
    /// c − a·b, b steady
    SubtractScaled,
    Multiply,
    Divide,
    AddProduct,
    SubtractProduct,
    SquareRoot,
    /// The cosine is in the place `more`.
    SineCosine,
    /// 1 + t² is in the place `more`.
    Tangent,
    /// √(1 − a²) is in the place `more`.
    ArcSine,
    ArcCosine,
    /// 1 + a² is in the place `more`.
    ArcTangent,
    /// a² + b² is in the place `more`.
    ArcTangent2,
    Exponential,
    Logarithm,
}

/// One value; its places are those of first coefficients.
#[derive(Debug, Clone, Copy)]
struct Step {
    rule: Rule,
    out: usize,
    operands: [usize; 3],
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
        let (mut steps, mut done, mut more) = (Vec::new(), inputs + constants, values);
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
                let (rule, operands) = rule(run.operator, &operands, &is_steady)?;
                let keeps = matches!(
                    rule,
                    Rule::Tangent | Rule::ArcSine | Rule::ArcCosine | Rule::ArcTangent | Rule::ArcTangent2
                );
                let beside = if rule == Rule::SineCosine { done + run.count + k } else { more };
                more += usize::from(keeps);
                let operands = operands.map(|place| place * stride);
                steps.push(Step { rule, out: (done + k) * stride, operands, more: beside * stride });
            }
            done += run.count * run.operator.values();
            operands = later;
        }
        Some(Self { stride, values, steps, memory: vec![0.0; more * stride] })
    }

    /// The highest order.
    pub fn order(&self) -> usize {
        self.stride - 1
    }

    /// Takes the values of the plan at the point of expansion, from its memory; all other coefficients become zero.
    pub fn begin(&mut self, values: &[f64]) {
        self.memory.fill(0.0);
        for (coefficients, value) in self.memory.chunks_exact_mut(self.stride).zip(&values[..self.values]) {
            coefficients[0] = *value;
        }
        for step in &self.steps {
            let at = |place: usize| self.memory[place];
            let [a, b, _] = step.operands;
            let beside = match step.rule {
                Rule::Tangent => 1.0 + at(step.out) * at(step.out),
                Rule::ArcSine | Rule::ArcCosine => ((1.0 - at(a)) * (1.0 + at(a))).sqrt(),
                Rule::ArcTangent => 1.0 + at(a) * at(a),
                Rule::ArcTangent2 => at(a) * at(a) + at(b) * at(b),
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
            let Step { rule, out, operands: [a, b, c], more } = *step;
            let value = match rule {
                Rule::Add => memory[a + k] + memory[b + k],
                Rule::Subtract => memory[a + k] - memory[b + k],
                Rule::Negate => -memory[a + k],
                Rule::Scale => memory[a + k] * memory[b],
                Rule::Shrink => memory[a + k] / memory[b],
                Rule::AddScaled => memory[c + k] + memory[a + k] * memory[b],
                Rule::SubtractScaled => memory[c + k] - memory[a + k] * memory[b],
                Rule::Multiply => product(memory, a, b, k),
                Rule::AddProduct => memory[c + k] + product(memory, a, b, k),
                Rule::SubtractProduct => memory[c + k] - product(memory, a, b, k),
                Rule::Divide => {
                    (memory[a + k] - convolution(&memory[out..out + k], &memory[b + 1..=b + k])) / memory[b]
                }
                Rule::SquareRoot => (memory[a + k] - inner(memory, out, k)) / (2.0 * memory[out]),
                Rule::Exponential => sloped(memory, a, out, k) * per,
                Rule::Logarithm => (memory[a + k] - sloped_inner(memory, out, a, k) * per) / memory[a],
                Rule::SineCosine => {
                    let cosine = -sloped(memory, a, out, k) * per;
                    let sine = sloped(memory, a, more, k) * per;
                    memory[more + k] = cosine;
                    sine
                }
                Rule::Tangent => {
                    let tangent = sloped(memory, a, more, k) * per;
                    memory[out + k] = tangent;
                    memory[more + k] = product(memory, out, out, k);
                    tangent
                }
                Rule::ArcTangent => {
                    memory[more + k] = product(memory, a, a, k);
                    (memory[a + k] - sloped_inner(memory, out, more, k) * per) / memory[more]
                }
                Rule::ArcSine | Rule::ArcCosine => {
                    let square = product(memory, a, a, k) + inner(memory, more, k);
                    memory[more + k] = -square / (2.0 * memory[more]);
                    let slope = if rule == Rule::ArcSine { memory[a + k] } else { -memory[a + k] };
                    (slope - sloped_inner(memory, out, more, k) * per) / memory[more]
                }
                Rule::ArcTangent2 => {
                    memory[more + k] = product(memory, a, a, k) + product(memory, b, b, k);
                    let turn = sloped(memory, a, b, k) - sloped(memory, b, a, k);
                    (turn - sloped_inner(memory, out, more, k)) * per / memory[more]
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

/// The rule of an operation, and its operands in the order of the rule; `None` where it has kinks.
fn rule(operator: Operator, operands: &[usize], steady: &[bool]) -> Option<(Rule, [usize; 3])> {
    let at = |k: usize| operands.get(k).copied().unwrap_or(0);
    let all = [at(0), at(1), at(2)];
    let turned = [at(1), at(0), at(2)];
    let product = |whole: Rule, scaled: Rule| match (steady[at(0)], steady[at(1)]) {
        (_, true) => (scaled, all),
        (true, false) => (scaled, turned),
        (false, false) => (whole, all),
    };
    Some(match operator {
        Operator::Add => (Rule::Add, all),
        Operator::Subtract => (Rule::Subtract, all),
        Operator::Negate => (Rule::Negate, all),
        Operator::Multiply => product(Rule::Multiply, Rule::Scale),
        Operator::AddProduct => product(Rule::AddProduct, Rule::AddScaled),
        Operator::SubtractProduct => product(Rule::SubtractProduct, Rule::SubtractScaled),
        Operator::Divide => (if steady[at(1)] { Rule::Shrink } else { Rule::Divide }, all),
        Operator::SquareRoot => (Rule::SquareRoot, all),
        Operator::SineCosine => (Rule::SineCosine, all),
        Operator::Tangent => (Rule::Tangent, all),
        Operator::ArcSine => (Rule::ArcSine, all),
        Operator::ArcCosine => (Rule::ArcCosine, all),
        Operator::ArcTangent => (Rule::ArcTangent, all),
        Operator::ArcTangent2 => (Rule::ArcTangent2, all),
        Operator::Exponential => (Rule::Exponential, all),
        Operator::Logarithm => (Rule::Logarithm, all),
        Operator::Absolute | Operator::Minimum | Operator::Maximum | Operator::Select | Operator::Table => return None,
    })
}
