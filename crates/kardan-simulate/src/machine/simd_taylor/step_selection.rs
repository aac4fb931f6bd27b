//! The step of each lane: its length by the last terms of the series, whether its modes stay valid within it, and the state at its end.

use kardan_rt::functions::ln;

use super::lanes::{Lane, compiled, symbols};
use crate::compiled_plan::{CompiledPlan, exact};
use kardan_expr::expr::{Expr, Function, Graph};
use kardan_math::num::Rational;

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
pub(super) struct StepSelection<N> {
    pub(super) numbers: CompiledPlan<N>,
    pub(super) speeds: usize,
    pub(super) torques: usize,
    pub(super) senses: usize,
    pub(super) sticking: usize,
    pub(super) bounds: usize,
    pub(super) room: usize,
    pub(super) time_inputs: (usize, usize),
}

impl<N: Lane> StepSelection<N> {
    pub(super) fn new(
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
            let clear = graph.scale(exact(1.0 - CLEAR), all[bounds + d]);
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
        Self { numbers: compiled(&graph, &all, outputs), speeds, torques, senses, sticking, bounds, room, time_inputs }
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
        let (room, next) = (all[room], all[room + 1]);
        let about = graph.min(room, next);
        let zero = graph.integer(0);
        let mut most = [zero; LAST];
        for (i, absolute) in absolute.iter().enumerate().take(size) {
            let ahead = graph.multiply(about, all[size + i]);
            let ahead = graph.add(all[i], ahead);
            let sizes = [all[i], ahead].map(|x| graph.apply(Function::Abs, x));
            let scale = graph.max(sizes[0], sizes[1]);
            let relative = graph.number(exact(relative));
            let scale = graph.multiply(relative, scale);
            let absolute = graph.number(exact(*absolute));
            let scale = graph.add(absolute, scale);
            for (back, most) in most.iter_mut().enumerate() {
                let term = graph.apply(Function::Abs, all[(order - back) * size + i]);
                let part = graph.divide(term, scale);
                *most = graph.max(*most, part);
            }
        }
        let tiny = graph.number(exact(TINY));
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
            let whole = graph.number(exact(accuracy * (1.0 / (order - back) as f64 - 1.0 / order as f64)));
            falls.push(graph.add(length, whole));
        }
        for back in 0..LAST - 2 {
            let fall = graph.subtract(sizes[back + 2], sizes[back]);
            let fall = graph.scale(Rational::from_parts(1.into(), 2u8.into()), fall);
            let even = graph.number(exact(-accuracy / order as f64));
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
        let size = |graph: &mut Graph, k: usize, least: f64| {
            let size = graph.apply(Function::Abs, all[limit.first + k * limit.width]);
            let floor = graph.number(exact(least));
            let size = match limit.floor.filter(|_| k == 0) {
                Some(floor) => graph.add(size, all[floor]),
                None => size,
            };
            let size = graph.max(size, floor);
            graph.apply(Function::Ln, size)
        };
        let first: [Expr; FIRST_TERMS] = std::array::from_fn(|k| size(graph, k, TINY));
        let (accuracy, mut found) = (graph.number(exact(ln(relative))), None);
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
