//! Taylor series of all values of a plan, coefficient by coefficient.
//!
//! The coefficients of each value follow from those of its operands ([`Step`]). So the series of the solution of a
//! differential equation whose right side is a plan follows one coefficient after the other: each rate gives the next
//! coefficient of its state.

use std::ops::{Deref, DerefMut};
use std::sync::Arc;

use kardan_native::{Aligned, NativeSeries, Step, Value};
use kardan_rt::Operator;

use super::pieces::Pieces;
use super::{Operation, Plan};

/// Taylor coefficients of all values of a plan up to an order: of one series, or of one in each lane of `N`, with the same bits.
///
/// ```
/// use kardan_expr::expr::{Function, Graph};
/// use kardan_expr::plan::{Series, compile};
/// use kardan_math::units::Dimension;
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
/// // From x = 0, 0.25, 0.5 and 0.75 side by side.
/// use kardan_rt::Lanes;
/// let mut series = Series::<Lanes<f64, 4>>::new(&plan, 3, &[plan.place(0)], |_| false).unwrap();
/// let mut memory = vec![Lanes([0.0; 4]); plan.memory().len()];
/// memory[0] = Lanes([0.0, 0.25, 0.5, 0.75]);
/// plan.block().begin(&mut memory);
/// assert!(plan.block().evaluate(&mut memory));
/// series.begin(&memory);
/// for k in 1..=3 {
///     let rate = series.value(plan.place(0), k - 1);
///     series.set(0, k, &[rate / Lanes([k as f64; 4])]);
///     series.advance(k);
/// }
/// assert_eq!(series.value(0, 1).0, [0.0, 0.25, 0.5, 0.75].map(kardan_rt::functions::cos));
/// assert_eq!(series.value(0, 3).0[0], -1.0 / 6.0);
/// ```
#[derive(Debug, Clone)]
pub struct Series<N = f64> {
    order: usize,
    /// Values of an order: those of the plan, then the auxiliary values of rules.
    width: usize,
    steps: Vec<Step>,
    /// The steps as machine code, where there is such code.
    native: Option<Arc<NativeSeries<N>>>,
    /// Coefficients, those of an order one after the other.
    memory: Aligned<N>,
}

impl<N: Value> Series<N> {
    /// The series of a plan up to an order, for the values at some indices of its memory and their operands; `steady`
    /// returns which inputs do not change. `None` if one of them has kinks, which have no series.
    pub fn new(plan: &Plan, order: usize, outputs: &[usize], steady: impl Fn(usize) -> bool) -> Option<Self> {
        Self::with(plan, order, outputs, steady, |_, _| (0, Vec::new()))
    }

    /// The same with more values behind those of the plan: `more` receives the index of the first one and which values
    /// of the plan do not change, and returns their number and the steps that compute coefficients. Values that no step
    /// computes keep what they are [set](Self::set) to.
    pub fn with(
        plan: &Plan,
        order: usize,
        outputs: &[usize],
        steady: impl Fn(usize) -> bool,
        more: impl FnOnce(usize, &[bool]) -> (usize, Vec<Step>),
    ) -> Option<Self> {
        Self::with_pieces(plan, order, outputs, steady, None, more)
    }

    /// The same, with pieces where something has kinks.
    fn with_pieces(
        plan: &Plan,
        order: usize,
        outputs: &[usize],
        steady: impl Fn(usize) -> bool,
        mut pieces: Option<&mut Pieces>,
        more: impl FnOnce(usize, &[bool]) -> (usize, Vec<Step>),
    ) -> Option<Self> {
        let (operations, is_steady) = plan.varying(outputs, steady);
        let (mut steps, mut beside) = (Vec::new(), is_steady.len());
        for operation in operations {
            let Operation { operator, out: [out, cosine], .. } = operation;
            let operands = &operation.operands[..operator.operands()];
            if has_kinks(operator) {
                beside = pieces.as_mut()?.write(plan, (operator, operands), (out, beside), &mut steps)?;
                continue;
            }
            let (scaled, operands) = arranged(operator, operands, &is_steady);
            let more = match operator {
                Operator::SineCosine => cosine,
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
            let operands = operands.map(|place| place as u32);
            steps.push(Step { operator, scaled, out: out as u32, operands, more: more as u32 });
        }
        let (count, own) = more(beside, &is_steady);
        beside += count;
        steps.extend(own);
        let native = NativeSeries::new(&steps, beside, order).map(Arc::new);
        Some(Self { order, width: beside, steps, native, memory: Aligned::new(beside * (order + 1)) })
    }

    /// The same without machine code: slower, with the same bits.
    #[must_use]
    pub fn interpreted(self) -> Self {
        Self { native: None, ..self }
    }

    /// The highest order.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Reads the values of the plan at the point of expansion from its memory. Higher orders must be computed again.
    pub fn begin(&mut self, values: &[N]) {
        self.memory[..values.len()].copy_from_slice(values);
        self.steps.iter().for_each(|step| step.begin(&mut self.memory));
    }

    /// Sets the coefficients of an order of inputs one after the other, from a first one on.
    #[inline]
    pub fn set(&mut self, first: usize, order: usize, coefficients: &[N]) {
        self.memory[order * self.width + first..][..coefficients.len()].copy_from_slice(coefficients);
    }

    /// A coefficient of the value at an index of the plan's memory.
    #[inline]
    pub fn value(&self, place: usize, order: usize) -> N {
        self.memory[order * self.width + place]
    }

    /// The same where it lies.
    #[inline]
    pub fn at(&self, place: usize, order: usize) -> &N {
        &self.memory[order * self.width + place]
    }

    /// All coefficients of the value at an index of the plan's memory.
    #[inline]
    pub fn of(&self, place: usize) -> impl DoubleEndedIterator<Item = N> + ExactSizeIterator {
        self.memory[place..].iter().step_by(self.width).copied()
    }

    /// `Σ c_j x_(k−j)` over j = 1 … k, where c are the coefficients of the value at an index.
    #[inline]
    pub fn convolution(&self, place: usize, k: usize, x: impl Fn(usize) -> N) -> N {
        (1..k + 1).fold(N::all(0.0), |sum, j| sum + self.value(place, j) * x(k - j))
    }

    /// Computes the coefficients of an order, at least 1, of all values from those of the inputs.
    pub fn advance(&mut self, k: usize) {
        let Self { width, steps, native, memory, .. } = self;
        match native {
            Some(native) => native.advance(memory, k),
            None => steps.iter().for_each(|step| step.find(memory, *width, k)),
        }
    }
}

fn has_kinks(operator: Operator) -> bool {
    use Operator::{Absolute, Maximum, Minimum, Select, Table};
    matches!(operator, Absolute | Minimum | Maximum | Select | Table)
}

/// Whether an operation scales by a steady number, and its operands with that as the second one.
fn arranged(operator: Operator, operands: &[usize], steady: &[bool]) -> (bool, [usize; 3]) {
    use Operator::{AddProduct, Divide, Multiply, SubtractProduct};
    let at = |k: usize| operands.get(k).copied().unwrap_or(0);
    let all = [at(0), at(1), at(2)];
    match operator {
        Multiply | AddProduct | SubtractProduct if steady[at(0)] && !steady[at(1)] => (true, [at(1), at(0), at(2)]),
        Multiply | AddProduct | SubtractProduct | Divide => (steady[at(1)], all),
        _ => (false, all),
    }
}

/// The series of a plan of which each value with kinks is in one of its smooth pieces.
///
/// ```
/// use kardan_expr::expr::{Function, Graph};
/// use kardan_expr::plan::{PiecedSeries, compile};
/// use kardan_math::units::Dimension;
/// // y = |x| where x = −1 + t: 1 − t, until x vanishes.
/// let mut graph = Graph::default();
/// let x = graph.symbol("x", Dimension::ANGLE);
/// let size = graph.apply(Function::Abs, x);
/// let plan = compile(&graph, &[graph.symbol_of(x).unwrap()], &[("y".into(), size)]).unwrap();
/// let mut series = PiecedSeries::new(&plan, 2, &[plan.place(0)], |_| false);
/// let mut memory = plan.memory();
/// memory[0] = -1.0;
/// assert!(plan.block().evaluate(&mut memory));
/// series.begin(&memory);
/// series.set(0, 1, &[1.0]);
/// series.advance(1);
/// assert_eq!((series.value(plan.place(0), 0), series.value(plan.place(0), 1)), (1.0, -1.0));
/// let margins: Vec<Vec<f64>> = series.margins().map(|(x, sign, more)| x.map(|x| sign * x + more).collect()).collect();
/// assert_eq!(margins, [[1.0, -1.0, 0.0]]);
/// ```
#[derive(Debug, Clone)]
pub struct PiecedSeries {
    series: Series,
    pieces: Pieces,
}

impl PiecedSeries {
    /// See [`Series::new`].
    pub fn new(plan: &Plan, order: usize, outputs: &[usize], steady: impl Fn(usize) -> bool) -> Self {
        let mut pieces = Pieces::new(plan);
        let series = Series::with_pieces(plan, order, outputs, steady, Some(&mut pieces), |_, _| (0, Vec::new()));
        Self { series: series.expect("every function with kinks has pieces"), pieces }
    }

    /// See [`Series::begin`].
    pub fn begin(&mut self, values: &[f64]) {
        self.series.begin(values);
        self.pieces.begin(&mut self.series.memory);
    }

    /// See [`Series::advance`]. An operation that begins where two pieces meet takes the one into which its first
    /// nonzero derivative points.
    pub fn advance(&mut self, k: usize) {
        self.series.advance(k);
        while self.pieces.decide(&mut self.series.memory, self.series.width, k) {
            self.series.advance(k);
        }
    }

    /// Whether a value jumps where the series begin, so that they are valid at one instant only.
    pub fn jump(&self) -> bool {
        self.pieces.jump()
    }

    /// The values that decide the pieces, which are valid as long as none is negative: coefficients, their sign, and a
    /// constant added to the first one.
    pub fn margins(&self) -> impl Iterator<Item = (impl Iterator<Item = f64> + '_, f64, f64)> + '_ {
        self.pieces.margins(&self.series.memory).map(|(of, less, sign, more)| {
            let less = less.map(|place| self.series.of(place));
            let mut less = less.into_iter().flatten();
            (self.series.of(of).map(move |x| x - less.next().unwrap_or(0.0)), sign, more)
        })
    }
}

impl Deref for PiecedSeries {
    type Target = Series;

    fn deref(&self) -> &Series {
        &self.series
    }
}

impl DerefMut for PiecedSeries {
    fn deref_mut(&mut self) -> &mut Series {
        &mut self.series
    }
}
