//! Taylor series of one loop in lanes: each lane at a point of its own, in modes of its own, with coefficients of its own.
//!
//! The plan and its series are computed for all lanes at once. With `H a = f − Gᵀ λ` the accelerations and the
//! constraint torques follow from forces and biases by matrices that each lane has at its point: of all directions,
//! where inactive ones have rows of zeros.

use std::sync::Arc;

use kardan_native::{Aligned, Native, Step, Value};
use kardan_rt::functions::ln;
use kardan_rt::{Lanes, Operator};

use super::Machine;
use super::connected_law::ConnectedLaw;
use super::expansion::{Prospect, margin};
use super::timed::shifted;
use crate::assemble::CoefficientKind;
use crate::expr::{Expr, Function, Graph, Symbol};
use crate::num::{Rational, StateArchive, rational_from_f64};
use crate::plan::{Plan, Series, compile};
use crate::reduce::MotionPlan;
use crate::simulate::drive::Drive;
use crate::simulate::friction::{Mode, NOISE};
use crate::units::Dimension;

/// The number type of lanes.
pub trait Lane: Value + Send {
    /// How many there are.
    const COUNT: usize;

    /// Their numbers.
    fn lanes(&self) -> &[f64];

    /// The same, to be changed.
    fn lanes_mut(&mut self) -> &mut [f64];
}

impl Lane for f64 {
    const COUNT: usize = 1;

    fn lanes(&self) -> &[f64] {
        std::slice::from_ref(self)
    }

    fn lanes_mut(&mut self) -> &mut [f64] {
        std::slice::from_mut(self)
    }
}

macro_rules! lane {
    ($count:literal) => {
        impl Lane for Lanes<f64, $count> {
            const COUNT: usize = $count;

            #[inline(always)]
            fn lanes(&self) -> &[f64] {
                &self.0
            }

            #[inline(always)]
            fn lanes_mut(&mut self) -> &mut [f64] {
                &mut self.0
            }
        }
    };
}

lane!(4);
lane!(8);

/// Most directions and coordinates: matrices of all of them are computed at each point.
const MOST: usize = 12;
/// The last terms of a series, which determine the step length: near a singularity beside the real axis some are small
/// by accident.
const LAST: usize = 4;
/// A term of this size, in tolerances, counts as zero; for a last term beside a first one.
const TINY: f64 = 1e-280;
const TINIEST: f64 = 1e-300;
/// The first terms of a series, which determine its size.
const FIRST_TERMS: usize = 4;
/// Part of the length that these terms allow, in tenths.
const SAFETY: i64 = 9;
/// A step that would be longer than this many hundredths of the remainder ends at the common end.
const NEAR: i64 = 101;
/// Safety margin to a limit, as a part of it.
const CLEAR: f64 = 1e-9;
/// A room that no step uses.
const WIDE: i64 = 1 << 40;

/// Indices into the memory of the plan.
struct Places {
    /// Inputs of the plan; the first source among them.
    inputs: usize,
    sources: usize,
    /// The first of the time-dependent inputs.
    timed: usize,
    forces: Vec<usize>,
    rates: Vec<usize>,
    friction_speeds: Vec<usize>,
    /// Further values that are read.
    also: Vec<usize>,
    /// Entries of the inertia (row, column, index) and of each direction (column, index) that depend on the position;
    /// biases of directions.
    inertia: Vec<(usize, usize, usize)>,
    rows: Vec<Vec<(usize, usize)>>,
    bias: Vec<Option<usize>>,
}

/// A plan of numbers in lanes, with its memory.
struct Numbers<N> {
    plan: Plan,
    native: Option<Native<N>>,
    memory: Aligned<N>,
}

impl<N: Lane> Numbers<N> {
    fn new(graph: &Graph, inputs: &[Expr], outputs: Vec<Expr>) -> Self {
        let inputs: Vec<Symbol> = inputs.iter().filter_map(|input| graph.symbol_of(*input)).collect();
        let outputs: Vec<(String, Expr)> = outputs.into_iter().map(|expr| (String::new(), expr)).collect();
        let plan = compile(graph, &inputs, &outputs).expect("all inputs are given");
        let mut memory = Aligned::new(plan.block().memory());
        plan.block().begin(&mut memory);
        Self { native: Native::new(&plan.block()), plan, memory }
    }

    fn evaluate(&mut self) {
        evaluate(self.native.as_ref(), &self.plan, &mut self.memory);
    }

    fn output(&self, number: usize) -> &N {
        &self.memory[self.plan.place(number)]
    }
}

/// A value that is not a number is detected where it is used.
fn evaluate<N: Lane>(native: Option<&Native<N>>, plan: &Plan, memory: &mut [N]) {
    match native {
        Some(native) => native.find(memory),
        None => {
            let _ = plan.block().evaluate(memory);
        }
    }
}

/// Symbols of a graph, one after the other.
fn symbols(graph: &mut Graph, count: usize) -> Vec<Expr> {
    (0..count).map(|k| graph.new_symbol(k.to_string(), Dimension::NONE)).collect()
}

/// `Σ a_k b_k`
fn sum_of_products(graph: &mut Graph, pairs: impl Iterator<Item = (Expr, Expr)>) -> Expr {
    let terms: Vec<(Expr, Rational)> = pairs.map(|(a, b)| (graph.multiply(a, b), Rational::ONE)).collect();
    let sum = graph.sum(Rational::ZERO, &terms);
    graph.group(sum)
}

/// The inverse of a positive definite matrix (Gauss and Jordan).
fn inverse(graph: &mut Graph, a: &[Expr], n: usize) -> Vec<Expr> {
    let (zero, one, mut a) = (graph.integer(0), graph.integer(1), a.to_vec());
    for k in 0..n {
        let pivot = graph.divide(one, a[k * n + k]);
        let pivot = graph.group(pivot);
        a[k * n + k] = one;
        for j in 0..n {
            a[k * n + j] = graph.multiply(a[k * n + j], pivot);
        }
        for i in (0..n).filter(|i| *i != k) {
            let factor = std::mem::replace(&mut a[i * n + k], zero);
            for j in 0..n {
                let less = graph.multiply(factor, a[k * n + j]);
                let difference = graph.subtract(a[i * n + j], less);
                a[i * n + j] = graph.group(difference);
            }
        }
    }
    a
}

/// Accelerations and constraint torques for forces and biases: `a = A f − B b`, `λ = L f + S b`, in lanes with masks.
struct Response<N> {
    numbers: Numbers<N>,
    /// Indices of the plan for its first inputs; behind them are 1 for each active direction and for each coordinate
    /// that moves.
    from: Vec<usize>,
    /// Directions that have a bias.
    biased: Vec<usize>,
    /// Whether an entry of the matrices, one after the other, exists.
    is_nonzero: Vec<bool>,
}

impl<N: Lane> Response<N> {
    fn new(machine: &Machine, places: &Places) -> Self {
        let (r, m) = (machine.degrees_of_freedom, machine.modes.len());
        let (mut graph, mut from, mut inputs) = (Graph::default(), Vec::new(), Vec::new());
        let number = |graph: &mut Graph, x: f64| graph.number(rational_from_f64(x).unwrap_or(Rational::ZERO));
        let mut input_of = |graph: &mut Graph, place: usize| match from.iter().position(|own| *own == place) {
            Some(input) => inputs[input],
            None => {
                from.push(place);
                inputs.push(symbols(graph, 1)[0]);
                inputs[inputs.len() - 1]
            }
        };
        let mut h: Vec<Expr> = machine.work.inertia.iter().map(|x| number(&mut graph, *x)).collect();
        places.inertia.iter().for_each(|(i, j, place)| h[i * r + j] = input_of(&mut graph, *place));
        let mut g: Vec<Expr> = machine.work.friction_rows[..m * r].iter().map(|x| number(&mut graph, *x)).collect();
        for (d, row) in places.rows.iter().enumerate() {
            row.iter().for_each(|(i, place)| g[d * r + i] = input_of(&mut graph, *place));
        }
        let biased: Vec<usize> = (0..m).filter(|d| !places.rows[*d].is_empty() || places.bias[*d].is_some()).collect();
        let zero = graph.integer(0);
        let f: Vec<Expr> = places.forces.iter().map(|place| input_of(&mut graph, *place)).collect();
        let b: Vec<Expr> =
            biased.iter().map(|d| places.bias[*d].map_or(zero, |place| input_of(&mut graph, place))).collect();
        let (sticking, moves) = (symbols(&mut graph, m), symbols(&mut graph, r));
        inputs.extend(sticking.iter().chain(&moves));
        let outputs = Self::matrices(&mut graph, (&h, &g), (&sticking, &moves), (&f, &b), &biased);
        let is_nonzero = outputs.iter().map(|output| !graph.is_zero(*output)).collect();
        Self { numbers: Numbers::new(&graph, &inputs, outputs), from, biased, is_nonzero }
    }

    /// A, B, L and S row by row, then the accelerations and the torques.
    fn matrices(
        graph: &mut Graph,
        (h, g): (&[Expr], &[Expr]),
        (sticking, moves): (&[Expr], &[Expr]),
        (f, b): (&[Expr], &[Expr]),
        biased: &[usize],
    ) -> Vec<Expr> {
        let (r, m, one) = (moves.len(), sticking.len(), graph.integer(1));
        let h = inverse(graph, h, r);
        let mut w = Vec::new();
        for d in 0..m {
            for i in 0..r {
                let sum = sum_of_products(graph, (0..r).map(|j| (h[i * r + j], g[d * r + j])));
                w.push(graph.multiply(sum, sticking[d]));
            }
        }
        let mut own = Vec::new();
        for d in 0..m {
            for e in 0..m {
                let sum = sum_of_products(graph, (0..r).map(|i| (g[d * r + i], w[e * r + i])));
                let sum = graph.multiply(sum, sticking[d]);
                let difference = graph.subtract(one, sticking[d]);
                let sum = if d == e { graph.add(sum, difference) } else { sum };
                own.push(graph.group(sum));
            }
        }
        let shares = inverse(graph, &own, m);
        let mut of_bias = Vec::new();
        for d in 0..m {
            biased.iter().for_each(|e| of_bias.push(graph.multiply(shares[d * m + e], sticking[*e])));
        }
        let n = biased.len();
        let mut of_force = Vec::new();
        for d in 0..m {
            for i in 0..r {
                of_force.push(sum_of_products(graph, (0..m).map(|e| (shares[d * m + e], w[e * r + i]))));
            }
        }
        let (mut on_force, mut on_bias) = (Vec::new(), Vec::new());
        for i in 0..r {
            for j in 0..r {
                let less = sum_of_products(graph, (0..m).map(|d| (w[d * r + i], of_force[d * r + j])));
                let difference = graph.subtract(h[i * r + j], less);
                on_force.push(graph.multiply(difference, moves[i]));
            }
            for k in 0..n {
                let sum = sum_of_products(graph, (0..m).map(|d| (w[d * r + i], of_bias[d * n + k])));
                on_bias.push(graph.multiply(sum, moves[i]));
            }
        }
        let mut both = |on_f: &[Expr], on_b: &[Expr], row: usize, sign: i64| {
            let of_f = sum_of_products(graph, f.iter().enumerate().map(|(j, f)| (on_f[row * r + j], *f)));
            let of_b = sum_of_products(graph, b.iter().enumerate().map(|(k, b)| (on_b[row * n + k], *b)));
            graph.sum(Rational::ZERO, &[(of_f, Rational::ONE), (of_b, sign.into())])
        };
        let accelerations: Vec<Expr> = (0..r).map(|i| both(&on_force, &on_bias, i, -1)).collect();
        let torques: Vec<Expr> = (0..m).map(|d| both(&of_force, &of_bias, d, 1)).collect();
        [on_force, on_bias, of_force, of_bias, accelerations, torques].concat()
    }

    /// The steps of series for indices from a first one on: matrices, accelerations, torques, then intermediate values;
    /// and how many indices they use.
    fn steps(&self, places: &Places, first: usize, steady: &[bool]) -> (usize, Vec<Step>) {
        let (r, m, n) = (places.forces.len(), places.rows.len(), self.biased.len());
        let (mut steps, all) = (Vec::new(), self.is_nonzero.len());
        let mut next = first + all;
        let [a, torque] = [first + all - m - r, first + all - m];
        let mut put = |operator: Operator, scaled: bool, operands: [usize; 3], out: Option<usize>| {
            let out = out.unwrap_or_else(|| {
                next += 1;
                next - 1
            });
            let operands = operands.map(|place| place as u32);
            steps.push(Step { operator, scaled, out: out as u32, operands, more: 0 });
            out
        };
        let mut force = places.forces.clone();
        for &(row, column, place) in places.inertia.iter().filter(|(.., place)| !steady[*place]) {
            force[row] = put(Operator::SubtractProduct, false, [place, a + column, force[row]], None);
        }
        let moving = |d: &usize| places.bias[*d].filter(|place| !steady[*place]);
        let mut bias: Vec<Option<usize>> = self.biased.iter().map(moving).collect();
        for (d, row) in places.rows.iter().enumerate() {
            for &(i, place) in row.iter().filter(|(_, place)| !steady[*place]) {
                force[i] = put(Operator::SubtractProduct, false, [place, torque + d, force[i]], None);
                let own = self.biased.iter().position(|other| *other == d).expect("it has a bias");
                bias[own] = Some(match bias[own] {
                    Some(sum) => put(Operator::AddProduct, false, [place, a + i, sum], None),
                    None => put(Operator::Multiply, false, [place, a + i, 0], None),
                });
            }
        }
        let starts = [0, r * r, r * r + r * n, r * r + r * n + m * r].map(|start| first + start);
        for row in 0..r + m {
            let (on_force, on_bias, row, out, operator) = match row.checked_sub(r) {
                None => (starts[0], starts[1], row, a + row, Operator::SubtractProduct),
                Some(row) => (starts[2], starts[3], row, torque + row, Operator::AddProduct),
            };
            let forces = force.iter().enumerate().map(|(j, f)| (*f, on_force + row * r + j, Operator::AddProduct));
            let biases = bias.iter().enumerate().filter_map(|(k, b)| Some(((*b)?, on_bias + row * n + k, operator)));
            let terms: Vec<_> = forces.chain(biases).filter(|(_, matrix, _)| self.is_nonzero[matrix - first]).collect();
            let mut sum = None;
            for (k, (value, matrix, operator)) in terms.iter().enumerate() {
                let out = (k + 1 == terms.len()).then_some(out);
                sum = Some(match (sum, operator) {
                    (Some(sum), _) => put(*operator, true, [*value, *matrix, sum], out),
                    (None, Operator::AddProduct) => put(Operator::Multiply, true, [*value, *matrix, 0], out),
                    (None, _) => {
                        let product = put(Operator::Multiply, true, [*value, *matrix, 0], None);
                        put(Operator::Negate, false, [product, 0, 0], out)
                    }
                });
            }
        }
        (next - first, steps)
    }
}

/// Bounds of a polynomial with these terms at 1 from 0 to 1: its least and largest Bernstein coefficient.
fn bernstein(graph: &mut Graph, terms: &[Expr]) -> [Expr; 2] {
    let n = terms.len() - 1;
    let (mut b, mut binomial) = (Vec::new(), Rational::ONE);
    for (i, term) in terms.iter().enumerate() {
        b.push(graph.scale(Rational::ONE / binomial.clone(), *term));
        binomial *= Rational::from_parts((n - i).into(), (i + 1).into());
    }
    for i in 1..=n {
        for j in (i..=n).rev() {
            let sum = graph.add(b[j], b[j - 1]);
            b[j] = graph.group(sum);
        }
    }
    let (mut least, mut most) = (b[0], b[0]);
    for own in &b[1..] {
        (least, most) = (graph.min(least, *own), graph.max(most, *own));
    }
    [least, most]
}

/// A series that is needed separately: its first index among the inputs, its numbers per order, its highest order, and
/// the constant added to its first term.
struct StepLimit {
    first: usize,
    width: usize,
    top: usize,
    floor: Option<usize>,
}

/// The result of a step: inputs are the coefficients of the states, order after order, then those of the speeds of
/// directions, those of the constraint torques, senses, 1 for each active direction, the largest torques, the room, the
/// last length, and coefficients of further values.
struct StepSelection<N> {
    numbers: Numbers<N>,
    speeds: usize,
    torques: usize,
    senses: usize,
    sticking: usize,
    bounds: usize,
    room: usize,
    time_inputs: (usize, usize),
}

impl<N: Lane> StepSelection<N> {
    fn new(
        (size, m): (usize, usize),
        order: usize,
        (relative, absolute): (f64, &[f64]),
        of_time: Option<usize>,
    ) -> Self {
        let mut graph = Graph::default();
        let speeds = (order + 1) * size;
        let torques = speeds + order * m;
        let senses = torques + order * m;
        let [sticking, bounds, room] = [senses + m, senses + 2 * m, senses + 3 * m];
        let time_inputs = (room + 2, of_time.unwrap_or(0));
        let all = symbols(&mut graph, time_inputs.0 + (order + 1) * time_inputs.1);
        // With time as an input, the moving states do not show the rate of quantities that do not act on them; of
        // active constraints one order fewer is known.
        let limits = (0..time_inputs.1).map(|i| StepLimit {
            first: time_inputs.0 + i,
            width: time_inputs.1,
            top: order,
            floor: None,
        });
        let holding = (0..m).filter(|_| of_time.is_some());
        let holding =
            holding.map(|d| StepLimit { first: torques + d, width: m, top: order - 1, floor: Some(bounds + d) });
        let limits: Vec<StepLimit> = limits.chain(holding).collect();
        let length = Self::length(&mut graph, &all, (size, order), (relative, absolute), (room, &limits));
        let mut outputs = vec![length];
        let (zero, wide) = (graph.integer(0), graph.integer(WIDE));
        let mut powers = vec![graph.integer(1)];
        for k in 1..order {
            let power = graph.multiply(powers[k - 1], length);
            powers.push(graph.group(power));
        }
        for d in 0..m {
            let (sense, sticks) = (all[senses + d], all[sticking + d]);
            let slipping = graph.product(&[(sense, 2)]);
            let mut terms = Vec::new();
            for (k, power) in powers.iter().enumerate() {
                let speed = graph.multiply(all[speeds + k * m + d], sense);
                let own = graph.select(zero, sticks, all[torques + k * m + d], speed);
                terms.push(graph.multiply(own, *power));
            }
            let [least, most] = bernstein(&mut graph, &terms);
            let last = graph.apply(Function::Abs, terms[order - 1]);
            let slips = graph.subtract(least, last);
            let clear = graph.scale(rational_from_f64(1.0 - CLEAR).unwrap_or(Rational::ONE), all[bounds + d]);
            let below = graph.negate(least);
            let most = graph.max(most, below);
            let stays = graph.sum(Rational::ZERO, &[(clear, 1.into()), (most, (-1).into()), (last, (-1).into())]);
            let slips = graph.select(zero, slipping, slips, wide);
            outputs.push(graph.select(zero, sticks, stays, slips));
        }
        for i in 0..size {
            let mut sum = all[order * size + i];
            for k in (0..order).rev() {
                let more = graph.multiply(sum, length);
                let more = graph.add(more, all[k * size + i]);
                sum = graph.group(more);
            }
            outputs.push(sum);
        }
        Self {
            numbers: Numbers::new(&graph, &all, outputs),
            speeds,
            torques,
            senses,
            sticking,
            bounds,
            room,
            time_inputs,
        }
    }

    /// Where the last terms are within the tolerance, or the last one would be if all decayed evenly, at most as far as
    /// there is room.
    fn length(
        graph: &mut Graph,
        all: &[Expr],
        (size, order): (usize, usize),
        (relative, absolute): (f64, &[f64]),
        (room, limits): (usize, &[StepLimit]),
    ) -> Expr {
        let number = |graph: &mut Graph, x: f64| graph.number(rational_from_f64(x).unwrap_or(Rational::ZERO));
        let (room, next) = (all[room], all[room + 1]);
        let about = graph.min(room, next);
        let zero = graph.integer(0);
        let mut most = [zero; LAST];
        for (i, absolute) in absolute.iter().enumerate().take(size) {
            let ahead = graph.multiply(about, all[size + i]);
            let ahead = graph.add(all[i], ahead);
            let sizes = [all[i], ahead].map(|x| graph.apply(Function::Abs, x));
            let scale = graph.max(sizes[0], sizes[1]);
            let relative = number(graph, relative);
            let scale = graph.multiply(relative, scale);
            let absolute = number(graph, *absolute);
            let scale = graph.add(absolute, scale);
            for (back, most) in most.iter_mut().enumerate() {
                let term = graph.apply(Function::Abs, all[(order - back) * size + i]);
                let part = graph.divide(term, scale);
                *most = graph.max(*most, part);
            }
        }
        let tiny = number(graph, TINY);
        let sizes = most.map(|most| {
            let most = graph.max(most, tiny);
            graph.apply(Function::Ln, most)
        });
        let least =
            |graph: &mut Graph, all: &[Expr]| all.iter().skip(1).fold(all[0], |least, own| graph.min(least, *own));
        // All of the last terms within the tolerance.
        let lengths: [Expr; LAST] = std::array::from_fn(|back| {
            let part = Rational::from_parts((-1).into(), (order - back).into());
            graph.scale(part, sizes[back])
        });
        let shortest = least(graph, &lengths);
        // An even decay from the whole, 1/relative tolerances, to one: of all terms as far as the slowest of the last
        // ones, and of two orders among these.
        let accuracy = -ln(relative);
        let mut falls: Vec<Expr> = Vec::new();
        for (back, length) in lengths.into_iter().enumerate() {
            let whole = number(graph, accuracy * (1.0 / (order - back) as f64 - 1.0 / order as f64));
            falls.push(graph.add(length, whole));
        }
        for back in 0..LAST - 2 {
            let fall = graph.subtract(sizes[back + 2], sizes[back]);
            let fall = graph.scale(Rational::from_parts(1.into(), 2u8.into()), fall);
            let even = number(graph, -accuracy / order as f64);
            falls.push(graph.add(fall, even));
        }
        let even = least(graph, &falls);
        let found = graph.max(shortest, even);
        let found = limits.iter().fold(found, |found, limit| {
            let own = Self::length_of(graph, all, limit, relative);
            graph.min(found, own)
        });
        let found = graph.apply(Function::Exp, found);
        let found = graph.scale(Rational::from_parts(SAFETY.into(), 10u8.into()), found);
        let near = graph.scale(Rational::from_parts(NEAR.into(), 100u8.into()), found);
        graph.select(near, room, found, room)
    }

    /// The logarithm of the step length that the last terms of a separate series allow, in parts of the largest one of
    /// its first terms.
    fn length_of(graph: &mut Graph, all: &[Expr], limit: &StepLimit, relative: f64) -> Expr {
        let number = |graph: &mut Graph, x: f64| graph.number(rational_from_f64(x).unwrap_or(Rational::ZERO));
        let size = |graph: &mut Graph, k: usize, least: f64| {
            let size = graph.apply(Function::Abs, all[limit.first + k * limit.width]);
            let floor = number(graph, least);
            let size = match limit.floor.filter(|_| k == 0) {
                Some(floor) => graph.add(size, all[floor]),
                None => size,
            };
            let size = graph.max(size, floor);
            graph.apply(Function::Ln, size)
        };
        let first: [Expr; FIRST_TERMS] = std::array::from_fn(|k| size(graph, k, TINY));
        let (accuracy, mut found) = (number(graph, ln(relative)), None);
        for back in 0..LAST {
            let last = size(graph, limit.top - back, TINIEST);
            let mut own = None;
            for (k, first) in first.iter().enumerate() {
                let terms = [(*first, 1.into()), (last, (-1).into()), (accuracy, 1.into())];
                let ratio = graph.sum(Rational::ZERO, &terms);
                let length = graph.scale(Rational::from_parts(1.into(), (limit.top - back - k).into()), ratio);
                own = Some(own.map_or(length, |own| graph.max(own, length)));
            }
            let own = own.expect("first terms");
            found = Some(found.map_or(own, |found| graph.min(found, own)));
        }
        found.expect("last terms")
    }
}

/// Series in lanes.
pub(in crate::simulate) struct SimdTaylor<N> {
    plan: Arc<MotionPlan>,
    native: Option<Native<N>>,
    series: Series<N>,
    places: Places,
    order: usize,
    /// States without the work of the inputs and the loss; degrees of freedom, directions.
    size: usize,
    counts: [usize; 2],
    memory: Aligned<N>,
    response: Response<N>,
    step_selection: StepSelection<N>,
    /// Where the matrices of the response begin among the values of the series, and its accelerations and torques.
    matrices: usize,
    accelerations: usize,
    torques: usize,
    /// Value, slope and start of each source.
    lines: [Vec<N>; 3],
    /// The start and the coefficients of each time-dependent input polynomial.
    timed: [Vec<N>; 5],
    /// The same where the step begins.
    now: [Vec<N>; 4],
    zeros: Vec<N>,
}

/// `x·factor`, lane by lane.
#[inline(always)]
fn scaled<N: Lane>(out: &mut N, x: &N, factor: f64) {
    out.lanes_mut().iter_mut().zip(x.lanes()).for_each(|(out, x)| *out = x * factor);
}

impl<N: Lane> SimdTaylor<N> {
    /// Series of the loop of a machine up to an order.
    ///
    /// # Errors
    /// Why these lanes do not support the machine.
    pub(in crate::simulate) fn new(
        machine: &Machine,
        tolerances: (f64, &[f64]),
        order: usize,
    ) -> Result<Self, &'static str> {
        let (r, m) = (machine.degrees_of_freedom, machine.modes.len());
        if let Some(why) = machine.why_alone() {
            return Err(why);
        }
        let own = &machine.places;
        let plan = Arc::clone(machine.dynamics.shared_plan());
        let MotionPlan { plan: code, inertia, friction_rows, friction_bias, more, .. } = &*plan;
        let place = |output: usize| code.place(output);
        let found = |places: &std::ops::Range<usize>| places.clone().map(|k| place(more.start + k)).collect::<Vec<_>>();
        let by_position = machine.by_position();
        let places = Places {
            inputs: code.inputs.len(),
            sources: 2 * r + own.sources.start,
            timed: 2 * r + own.timed.start,
            forces: found(&own.forces),
            rates: found(&own.rates),
            friction_speeds: found(&own.friction_speeds),
            also: found(&own.also),
            inertia: by_position.inertia,
            rows: by_position.rows,
            bias: by_position.bias,
        };
        let steady = |input: usize| machine.is_steady_input(input);
        let of_motion = [inertia, friction_rows, friction_bias].into_iter().flatten().map(|(_, output)| place(*output));
        let lists = [&places.forces, &places.rates, &places.friction_speeds, &places.also];
        let outputs: Vec<usize> = lists.into_iter().flatten().copied().chain(of_motion).collect();
        let response = Response::new(machine, &places);
        let mut matrices = 0;
        let series = Series::<N>::with(code, order, &outputs, steady, |first, steady| {
            matrices = first;
            response.steps(&places, first, steady)
        })
        .ok_or("a function of its loop has no series")?;
        let mut memory = Aligned::<N>::new(code.block().memory());
        code.block().begin(&mut memory);
        let (size, sources, zero) = (machine.size - 2, machine.lines.len(), N::all(0.0));
        let timed = machine.timed.polynomials().count();
        let torques = matrices + response.is_nonzero.len() - m;
        Ok(Self {
            native: Native::new(&code.block()),
            step_selection: StepSelection::new(
                (size, m),
                order,
                tolerances,
                machine.timed.has_time().then_some(places.also.len()),
            ),
            series,
            order,
            size,
            counts: [r, m],
            memory,
            response,
            matrices,
            accelerations: torques - r,
            torques,
            lines: std::array::from_fn(|_| vec![zero; sources]),
            timed: std::array::from_fn(|_| vec![zero; timed]),
            now: std::array::from_fn(|_| vec![zero; timed]),
            zeros: vec![zero; r + m],
            places,
            plan,
        })
    }

    /// Copies modes, sources and all inputs of a machine at the point that it has evaluated last into a lane, and its
    /// state.
    pub(in crate::simulate) fn load(&mut self, lane: usize, machine: &Machine, state: &[f64]) {
        let [r, m] = self.counts;
        let put = |list: &mut [N], values: &mut dyn Iterator<Item = f64>| {
            list.iter_mut().zip(values).for_each(|(own, value)| own.lanes_mut()[lane] = value);
        };
        let inputs = self.places.inputs;
        put(&mut self.memory[..inputs], &mut machine.work.values()[..inputs].iter().copied());
        let StepSelection { numbers, senses, sticking, bounds, .. } = &mut self.step_selection;
        let active = |k| f64::from(machine.holding.contains(&k));
        put(&mut numbers.memory[*senses..*senses + m], &mut machine.modes.iter().map(|mode| mode.sign()));
        put(&mut numbers.memory[*sticking..*sticking + m], &mut (0..m).map(active));
        put(&mut numbers.memory[*bounds..*bounds + m], &mut machine.bounds[0].iter().copied());
        let Response { numbers, from, .. } = &mut self.response;
        let masks = &mut numbers.memory[from.len()..];
        put(&mut masks[..m], &mut (0..m).map(active));
        put(&mut masks[m..m + r], &mut (0..r).map(|i| f64::from(!machine.still.contains(&i))));
        for (part, list) in self.lines.iter_mut().enumerate() {
            put(list, &mut machine.lines.iter().map(|(value, slope, start)| [*value, *slope, *start][part]));
        }
        for (part, list) in self.timed.iter_mut().enumerate() {
            let own = machine.timed.polynomials();
            put(list, &mut own.map(|(start, coefficients)| if part == 0 { start } else { coefficients[part - 1] }));
        }
        self.stand(lane, state);
    }

    /// The state at which a lane's next series begins.
    fn stand(&mut self, lane: usize, state: &[f64]) {
        let own = &mut self.step_selection.numbers.memory[..self.size];
        own.iter_mut().zip(state).for_each(|(own, value)| own.lanes_mut()[lane] = *value);
    }

    /// Continues a lane from the end of its last step.
    pub(in crate::simulate) fn go_on(&mut self, lane: usize) {
        let Numbers { plan, memory, .. } = &mut self.step_selection.numbers;
        let first = 1 + self.counts[1];
        for i in 0..self.size {
            let end = memory[plan.place(first + i)].lanes()[lane];
            memory[i].lanes_mut()[lane] = end;
        }
    }

    /// Computes all series, each lane from a time of its own on, and then each lane's step length, at most as long as
    /// there is room.
    pub(in crate::simulate) fn expand(&mut self, times: &N, rooms: &N, nexts: &N) {
        self.begin(times);
        let ([r, m], size, order) = (self.counts, self.size, self.order);
        for k in 0..order {
            if k > 0 {
                self.series.set(0, k, &self.step_selection.numbers.memory[k * size..][..size]);
                self.series.set(self.accelerations, k, &self.zeros);
                self.series.advance(k);
            }
            let per = 1.0 / (k + 1) as f64;
            let (computed, next) = self.step_selection.numbers.memory.split_at_mut((k + 1) * size);
            let (now, next) = (&computed[k * size..], &mut next[..size]);
            for i in 0..r {
                scaled(&mut next[i], &now[r + i], per);
                scaled(&mut next[r + i], self.series.at(self.accelerations + i, k), per);
            }
            for (next, place) in next[2 * r..].iter_mut().zip(&self.places.rates) {
                scaled(next, self.series.at(*place, k), per);
            }
            let StepSelection { numbers, speeds, torques, .. } = &mut self.step_selection;
            for d in 0..m {
                numbers.memory[*speeds + k * m + d] = *self.series.at(self.places.friction_speeds[d], k);
                numbers.memory[*torques + k * m + d] = *self.series.at(self.torques + d, k);
            }
        }
        // Values that are read are computed to the same order.
        if !self.places.also.is_empty() {
            self.series.set(0, order, &self.step_selection.numbers.memory[order * size..][..size]);
            self.series.set(self.accelerations, order, &self.zeros);
            self.series.advance(order);
        }
        let StepSelection { numbers, room, time_inputs, .. } = &mut self.step_selection;
        (numbers.memory[*room], numbers.memory[*room + 1]) = (*rooms, *nexts);
        for (i, place) in self.places.also.iter().enumerate().take(time_inputs.1) {
            (0..order + 1)
                .for_each(|k| numbers.memory[time_inputs.0 + k * time_inputs.1 + i] = *self.series.at(*place, k));
        }
        numbers.evaluate();
    }

    /// The values at the points, and the response there.
    fn begin(&mut self, times: &N) {
        let (size, Places { sources, .. }) = (self.size, &self.places);
        self.memory[..size].copy_from_slice(&self.step_selection.numbers.memory[..size]);
        let [values, slopes, starts] = &self.lines;
        for (k, ((value, slope), start)) in values.iter().zip(slopes).zip(starts).enumerate() {
            let lines = value.lanes().iter().zip(slope.lanes()).zip(start.lanes().iter().zip(times.lanes()));
            let own = self.memory[sources + k].lanes_mut().iter_mut().zip(lines);
            own.for_each(|(own, ((value, slope), (start, time)))| *own = value + slope * (time - start));
        }
        let first = self.places.timed;
        for k in 0..self.timed[0].len() {
            for lane in 0..N::COUNT {
                let [start, a, b, c, d] = std::array::from_fn(|part| self.timed[part][k].lanes()[lane]);
                let now = shifted(&[a, b, c, d], times.lanes()[lane] - start);
                self.now.iter_mut().zip(now).for_each(|(own, now)| own[k].lanes_mut()[lane] = now);
            }
        }
        self.memory[first..][..self.now[0].len()].copy_from_slice(&self.now[0]);
        evaluate(self.native.as_ref(), &self.plan.plan, &mut self.memory);
        self.series.begin(&self.memory);
        self.series.set(*sources, 1, slopes);
        (1..).zip(&self.now[1..]).for_each(|(order, own)| self.series.set(first, order, own));
        let Response { numbers, from, is_nonzero, .. } = &mut self.response;
        from.iter().enumerate().for_each(|(k, place)| numbers.memory[k] = self.memory[*place]);
        numbers.evaluate();
        for k in 0..is_nonzero.len() {
            self.series.set(self.matrices + k, 0, std::slice::from_ref(numbers.output(k)));
        }
    }

    /// The step length of each lane.
    pub(in crate::simulate) fn length(&self, lane: usize) -> f64 {
        self.step_selection.numbers.output(0).lanes()[lane]
    }

    /// Whether the series of a lane resolve a step of that length.
    pub(in crate::simulate) fn resolves(&self, lane: usize, length: f64, machine: &Machine) -> bool {
        machine.terms_resolve(length, self.order, |place, order| self.series.at(place, order).lanes()[lane])
    }

    /// Whether a lane certainly stays in the mode of a direction within its step.
    fn keeps(&self, lane: usize, direction: usize) -> bool {
        self.step_selection.numbers.output(1 + direction).lanes()[lane] > 0.0
    }

    /// Whether a lane certainly stays in its modes within its step.
    pub(in crate::simulate) fn stays(&self, lane: usize) -> bool {
        (0..self.counts[1]).all(|direction| self.keeps(lane, direction))
    }

    /// The state of a lane at the end of its step.
    pub(in crate::simulate) fn end(&self, lane: usize, out: &mut [f64]) {
        let first = 1 + self.counts[1];
        for (i, out) in out[..self.size].iter_mut().enumerate() {
            *out = self.step_selection.numbers.output(first + i).lanes()[lane];
        }
    }

    /// The state of a lane at a time after the point of expansion.
    pub(in crate::simulate) fn state(&self, lane: usize, later: f64, out: &mut [f64]) {
        out.fill(0.0);
        let all = &self.step_selection.numbers.memory[..self.step_selection.speeds];
        for coefficients in all.chunks_exact(self.size).rev() {
            let pairs = out.iter_mut().zip(coefficients);
            pairs.for_each(|(out, coefficient)| *out = *out * later + coefficient.lanes()[lane]);
        }
    }

    /// The slope of the state of a lane at a time after the point of expansion.
    pub(in crate::simulate) fn slope(&self, lane: usize, later: f64, out: &mut [f64]) {
        out.fill(0.0);
        let all = self.step_selection.numbers.memory[..self.step_selection.speeds].chunks_exact(self.size);
        for (order, coefficients) in all.enumerate().skip(1).rev() {
            let pairs = out.iter_mut().zip(coefficients);
            pairs.for_each(|(out, coefficient)| *out = *out * later + order as f64 * coefficient.lanes()[lane]);
        }
    }

    /// Coefficients of a value that is read.
    pub(in crate::simulate) fn also(&self, lane: usize, number: usize, out: &mut Vec<f64>) {
        let place = self.places.also[number];
        out.clear();
        out.extend((0..self.order + 1).map(|k| self.series.at(place, k).lanes()[lane]));
    }

    /// Indices of the values that are read in the memory of the plan.
    pub(in crate::simulate) fn also_places(&self) -> &[usize] {
        &self.places.also
    }

    /// What the series of a lane prove about its modes within a step of that length; see [`Machine::prospect`].
    pub(in crate::simulate) fn prospect(&self, lane: usize, length: f64, machine: &mut Machine) -> Prospect {
        let ([r, m], mut scratch) = (self.counts, [0.0; 32]);
        let (scratch, StepSelection { numbers, torques, .. }) = (&mut scratch[..self.order], &self.step_selection);
        // Shared torques stay within all limits, or the result is unknown.
        let shares = !machine.following.is_empty();
        let mut shared = !shares || (0..m).all(|d| !machine.holding.contains(&d) || self.keeps(lane, d));
        if !shared && machine.shares_evenly() {
            let Machine { holding, bounds, torque_distribution, .. } = machine;
            let term = |k: usize, a: usize| numbers.memory[torques + k * m + holding[a]].lanes()[lane];
            let limit = |direction: usize, k: usize| if k == 0 { bounds[0][direction] } else { 0.0 };
            shared = torque_distribution.stays(holding.len(), &bounds[0], (length, self.order), term, limit);
        }
        if !shared {
            return Prospect::Unknown;
        }
        let speeds: Vec<f64> = numbers.memory[r..2 * r].iter().map(|x| x.lanes()[lane]).collect();
        let mut prospect = Prospect::Stays;
        for (d, mode) in machine.modes.iter().enumerate().filter(|(d, _)| !self.keeps(lane, *d)) {
            if *mode != Mode::Stick {
                let own = (0..self.order).map(|k| self.series.at(self.places.friction_speeds[d], k).lanes()[lane]);
                let begin = mode.sign() * own.clone().next().unwrap_or(0.0);
                let noise = || NOISE * machine.dynamics.friction_terms(d, &speeds, &machine.work);
                let rounding = if begin < 0.0 && -begin <= noise() { -begin } else { 0.0 };
                prospect = prospect.and(margin(scratch, length, own, mode.sign(), rounding));
            } else if !shares && machine.holding.contains(&d) {
                let limit = machine.bounds[0][d];
                for sign in [1.0, -1.0] {
                    let own = (0..self.order).map(|k| numbers.memory[torques + k * m + d].lanes()[lane]);
                    prospect = prospect.and(margin(scratch, length, own, sign, limit));
                }
            }
        }
        prospect
    }
}

impl Machine {
    /// Why lanes do not support it: they need a loop that is all in the plan between samples, with frictions as its
    /// only set-valued directions.
    fn why_alone(&self) -> Option<&'static str> {
        let reasons = [
            (self.degrees_of_freedom.max(self.modes.len()) > MOST, "there are many coordinates or frictions"),
            (self.drives.iter().any(|drive| drive.rate.is_some()), "a motor has a rate limit"),
            (self.drives.iter().any(|drive| !drive.faults.is_empty()), "there are faults"),
            (
                !self.limits_meet_steps(),
                "a torque limit applies to a ramp, a time function or a law without sample time",
            ),
            (!self.multiplier_constraints.is_empty(), "there are loop-closing constraints"),
            (!self.gear_losses.is_empty(), "there are gear losses"),
            (!self.unilaterals.is_empty(), "there are stops, clutches or locks"),
            (!self.jenkins.directions.is_empty() || self.relaxes, "there are massless motions"),
            (self.own_laws, "a law without sample time, a program or blocks compute with their own code"),
            (self.moves, "speeds are prescribed"),
            (
                self.laws
                    .iter()
                    .any(|connected_law| !(connected_law.exported.is_empty() && connected_law.outputs.is_empty())),
                "there are programs or blocks",
            ),
            (
                !(self.timed.is_polynomial() && self.kinks.of_time.is_empty()),
                "a function of time has a kink or jump at times not listed in advance",
            ),
            (self.kinks.of_state > 0, "a law of the file has a kink or jump that depends on the motion"),
        ];
        reasons.into_iter().find(|(is_so, _)| *is_so).map(|(_, why)| why)
    }

    /// The next breakpoint of a function of time after a time, s; infinite if there is none.
    pub(in crate::simulate) fn next_piece(&self, time: f64) -> f64 {
        self.timed.next(time)
    }

    /// The states of laws with a clock before a run.
    pub(in crate::simulate) fn sampled_laws(&mut self) -> Vec<u64> {
        let mut archive = StateArchive::taking();
        self.laws
            .iter_mut()
            .filter_map(ConnectedLaw::sampled_runtime_mut)
            .for_each(|sampled_runtime| sampled_runtime.archive_state(&mut archive));
        archive.data()
    }

    /// Takes values of the varying coefficients, laws with a clock, and a seed for the noise of their sensors, and
    /// resets to the start of a run.
    pub(in crate::simulate) fn begin_anew(
        &mut self,
        coefficients: &[(CoefficientKind, usize)],
        values: &[f64],
        (sampled_laws, seed): (&[u64], u64),
    ) {
        for (coefficient, value) in coefficients.iter().zip(values) {
            self.dynamics.take_coefficient(*coefficient, *value);
            if let (CoefficientKind::Friction, term) = coefficient {
                self.bounds.iter_mut().for_each(|bounds| bounds[*term] = *value);
            }
        }
        self.work.give(&self.dynamics, self.places.run_parameters.start, values.iter().copied());
        self.work.forget_inertia();
        self.modes.fill(Mode::Stick);
        for list in [&mut self.holding, &mut self.following, &mut self.turning, &mut self.still] {
            list.clear();
        }
        self.at_rest = false;
        self.prepare_holding();
        self.step_length = 0.0;
        for list in [&mut self.step_speeds, &mut self.active_torque, &mut self.sources, &mut self.commands] {
            list.fill(0.0);
        }
        self.lines.fill((0.0, 0.0, 0.0));
        self.contradiction.clear();
        self.drives.iter_mut().for_each(Drive::begin_anew);
        let mut archive = StateArchive::putting(sampled_laws);
        for sampled_runtime in self.laws.iter_mut().filter_map(ConnectedLaw::sampled_runtime_mut) {
            sampled_runtime.archive_state(&mut archive);
            sampled_runtime.take_springs(&self.dynamics);
            sampled_runtime.draw_anew(seed);
        }
    }

    /// A value of the plan's memory at the point last evaluated.
    pub(in crate::simulate) fn plan_value(&self, place: usize) -> f64 {
        self.work.values()[place]
    }
}
