//! Load-dependent gear friction: the loss depends on the gear load, which depends on the accelerations, which depend on
//! the loss.
//!
//! The torque τ of a gear's constraint on the first body of its direction is affine in accelerations and in the torques
//! of active and sliding directions. While a gear slides, the loss `T = s f(|τ|)` against the motion solves
//! `τ = τ₀ + Λ T`, by Newton's method on this piecewise smooth equation; at rest its limit is `f`, with a loss of its
//! own for each sense, as power would flow one way or the other.
//!
//! One gear has one solution as long as `1 − s σ f′ Λ > 0` for both signs σ of τ. Where the load drives a gear that
//! would self-lock against the inertia of that load, this fails (Painlevé): there are two motions or none. kardan
//! reports both cases.

use super::gear_loss_terms::gear_losses;
use super::unilateral_kinds::InvalidBound;
use crate::compiled_plan::{CompiledPlan, symbols};
use kardan_expr::expr::{Expr, Symbol};
use kardan_math::num::Lu;
use kardan_mechanics::reduce::{Motion, Reduced};

/// Steps of Newton's method; for losses proportional to the torque it takes two, and one for each sign that changes.
const MOST_STEPS: usize = 40;
/// The allowed residual of the loss, relative to it and to the rounding error of the torques that it depends on.
const SOLVED: f64 = 1e-14;
/// Signs that are tried as a start where the first one fails: for this many gears all.
const MOST_PATTERNS: usize = 10;

/// The losses over the torques as a plan: for each gear the loss and its slope.
struct Laws {
    compiled: CompiledPlan<f64>,
    /// The inputs before the sizes of the torques, and behind them whether the first bodies drive.
    arguments: usize,
}

impl Laws {
    fn new(motion: &mut Motion, reduced: &Reduced, inputs: &[Symbol]) -> Self {
        let count = gear_losses(reduced).count();
        let [loads, forth] = ["load", "forth"].map(|name| symbols(&mut motion.graph, name, count));
        let mut losses = Vec::new();
        for (k, (_, unilateral, gear)) in gear_losses(reduced).enumerate() {
            let speed = motion.sum(&unilateral.row, |motion, shaft| motion.speeds[shaft]);
            let back = motion.graph.negate(speed);
            let speed = motion.graph.max(speed, back);
            let [own, back_loss] = [&gear.forth, &gear.back].map(|part| motion.exact(part));
            let more = motion.graph.subtract(own, back_loss);
            let more = motion.graph.multiply(forth[k], more);
            let part = motion.graph.add(back_loss, more);
            let mut loss = motion.graph.multiply(part, loads[k]);
            if let Some(formula) = &gear.loss {
                let added = motion.formula_with(reduced, formula, [loads[k], speed], &[]);
                loss = motion.graph.add(loss, added);
            }
            losses.push(loss);
        }
        let slope = |motion: &mut Motion, (loss, load): (&Expr, &Expr)| {
            let load = motion.graph.symbol_of(*load).expect("it was made as one");
            motion.graph.derivatives(&[*loss], load)[0]
        };
        let slopes: Vec<Expr> = losses.iter().zip(&loads).map(|pair| slope(motion, pair)).collect();
        let outputs = losses.into_iter().chain(slopes).enumerate().map(|(k, expr)| (format!("loss.{k}"), expr));
        let outputs: Vec<(String, Expr)> = outputs.collect();
        let own = loads.iter().chain(&forth).filter_map(|symbol| motion.graph.symbol_of(*symbol));
        let arguments: Vec<Symbol> = motion.symbols.iter().chain(inputs).copied().chain(own).collect();
        let compiled = CompiledPlan::new(&motion.graph, &arguments, &outputs);
        Self { compiled, arguments: arguments.len() - 2 * count }
    }
}

/// The gear losses of a machine.
#[derive(Default)]
pub(crate) struct GearLosses {
    /// Their directions.
    pub(super) directions: Vec<usize>,
    laws: Option<Laws>,
    /// Their loads, and their losses while they slide, against the motion in their directions.
    pub(super) loads: Vec<f64>,
    pub(super) torques: Vec<f64>,
    pub(super) losses: Vec<f64>,
    pub(super) slopes: Vec<f64>,
    /// The effect of each sliding gear (columns) on all loads (rows).
    pub(super) influence: Vec<f64>,
    /// The sliding gears, with the senses of their motions, and all loads without their losses.
    pub(super) sliding: Vec<(usize, f64)>,
    pub(super) base: Vec<f64>,
    /// Newton's equations, and a change of the accelerations with the reaction of the active constraints.
    matrix: Vec<f64>,
    factor: Lu,
    right: Vec<f64>,
    pub(super) change: Vec<f64>,
    pub(super) multipliers: Vec<f64>,
    /// Torques of directions that begin to slide with a decision: the present loads do not include them.
    pub(super) starting_friction: Vec<(usize, f64)>,
    /// The gear with two motions at the point last evaluated, of which kardan takes the one in which the first body
    /// drives; the gear without a consistent motion there.
    pub(crate) ambiguous: Option<usize>,
    pub(super) jammed: Option<usize>,
    /// The latter at a requested rate, since that was reset.
    pub(crate) lost: Option<usize>,
    /// The most negative loss there.
    pub(super) negative: Option<(usize, f64)>,
    /// The gear whose loss is undefined there.
    pub(super) undefined: Option<usize>,
    /// The same among the sliding gears, detected in the last solution.
    undefined_sliding: Option<usize>,
}

impl GearLosses {
    /// `inputs` are the inputs of the loop besides the motion.
    pub(super) fn new(motion: &mut Motion, reduced: &Reduced, inputs: &[Symbol]) -> Self {
        let directions: Vec<usize> = gear_losses(reduced).map(|(direction, ..)| direction).collect();
        if directions.is_empty() {
            return Self::default();
        }
        let count = directions.len();
        let zeros = vec![0.0; count];
        Self {
            laws: Some(Laws::new(motion, reduced, inputs)),
            directions,
            loads: zeros.clone(),
            torques: zeros.clone(),
            losses: zeros.clone(),
            slopes: zeros,
            influence: vec![0.0; count * count],
            sliding: Vec::with_capacity(count),
            base: Vec::with_capacity(count),
            matrix: vec![0.0; count * count],
            factor: Lu::new(count),
            right: vec![0.0; count],
            change: Vec::with_capacity(reduced.degrees_of_freedom()),
            multipliers: Vec::with_capacity(reduced.degrees_of_freedom()),
            ..Self::default()
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.directions.is_empty()
    }

    /// Directions of gears, with their losses while they slide.
    pub(super) fn losses(&self) -> impl Iterator<Item = (usize, f64)> {
        self.directions.iter().copied().zip(self.torques.iter().copied())
    }

    /// Gears whose loss is undefined at the point last evaluated, or below minus `least`.
    pub(super) fn invalid_bound(&self, least: f64) -> Option<(usize, InvalidBound)> {
        let negative = || self.negative.filter(|(_, loss)| *loss < -least);
        let undefined = self.undefined.map(|direction| (direction, InvalidBound::Undefined));
        undefined.or_else(|| Some((negative()?.0, InvalidBound::Negative)))
    }

    /// The gear whose loss is undefined at the point last evaluated, with the undefined operation where that is found.
    pub(super) fn explain(&mut self) -> Option<(usize, Option<String>)> {
        let direction = self.undefined?;
        let gear = self.directions.iter().position(|own| *own == direction)?;
        // An undefined loss invalidates all loads.
        self.loads.iter_mut().filter(|load| !load.is_finite()).for_each(|load| *load = 0.0);
        for drives in [true, false] {
            self.evaluate(|_, _| drives);
            if !self.losses[gear].is_finite() {
                let from = self.laws.as_ref().and_then(|laws| laws.compiled.plan.not_finite(&laws.compiled.memory));
                return Some((direction, from));
            }
        }
        Some((direction, None))
    }

    pub(super) fn give(&mut self, values: &[f64]) {
        if let Some(laws) = &mut self.laws {
            laws.compiled.memory[..laws.arguments].copy_from_slice(&values[..laws.arguments]);
        }
    }

    /// Losses and slopes at the loads, where the first bodies drive or are driven.
    pub(super) fn evaluate(&mut self, drives: impl Fn(usize, f64) -> bool) {
        let count = self.directions.len();
        let Some(Laws { compiled, arguments }) = &mut self.laws else { return };
        for (k, load) in self.loads.iter().enumerate() {
            compiled.memory[*arguments + k] = load.abs();
            compiled.memory[*arguments + count + k] = f64::from(u8::from(drives(k, *load)));
        }
        compiled.evaluate();
        for k in 0..count {
            self.losses[k] = *compiled.output(k);
            self.slopes[k] = *compiled.output(count + k);
        }
    }

    /// The losses of sliding gears. False if no solution is found.
    pub(super) fn solve(&mut self) -> bool {
        let n = self.sliding.len();
        self.undefined_sliding = None;
        let patterns = 1usize << n.min(MOST_PATTERNS);
        // First from the loads without loss, then from losses that would reverse the signs.
        for pattern in 0..=patterns {
            let sign = |place: usize| if (pattern.wrapping_sub(1) >> place) & 1 == 1 { 1.0 } else { -1.0 };
            for (place, &(gear, _)) in self.sliding.iter().enumerate() {
                let base = self.base[gear];
                self.loads[gear] = if pattern == 0 { base } else { sign(place) * base.abs() };
            }
            if self.newton() {
                return true;
            }
        }
        false
    }

    /// Losses and slopes of sliding gears, at their loads. At zero load it is as if the first body drove: that side has
    /// one solution.
    fn evaluate_sliding(&mut self) {
        let sliding = std::mem::take(&mut self.sliding);
        let sense = |gear: usize| sliding.iter().find(|one| one.0 == gear).map_or(0.0, |one| one.1);
        self.evaluate(|gear, load| load * sense(gear) <= 0.0);
        self.sliding = sliding;
    }

    /// Newton's method from the present loads: `T = s (f + f′ σ (τ − τ now))` with `τ = base + Λ T`.
    fn newton(&mut self) -> bool {
        let count = self.directions.len();
        for _ in 0..MOST_STEPS {
            self.evaluate_sliding();
            let undefined = self.sliding.iter().map(|(gear, _)| *gear).find(|gear| !self.losses[*gear].is_finite());
            if undefined.is_some() {
                self.undefined_sliding = undefined;
                return false;
            }
            self.matrix.fill(0.0);
            self.right.fill(0.0);
            (0..count).for_each(|gear| self.matrix[gear * count + gear] = 1.0);
            for &(gear, s) in &self.sliding {
                let sigma = if self.loads[gear] == 0.0 { -s } else { self.loads[gear].signum() };
                let slope = s * self.slopes[gear] * sigma;
                self.right[gear] = s * self.losses[gear] + slope * (self.base[gear] - self.loads[gear]);
                for &(sliding_mesh, _) in &self.sliding {
                    self.matrix[gear * count + sliding_mesh] -= slope * self.influence[gear * count + sliding_mesh];
                }
            }
            if !self.factor.factor(&self.matrix) {
                return false;
            }
            self.factor.solve(&mut self.right);
            self.torques.copy_from_slice(&self.right);
            for &(gear, _) in &self.sliding {
                self.loads[gear] = self.base[gear] + self.parts(gear).sum::<f64>();
            }
            self.evaluate_sliding();
            let solved = |&(gear, s): &(usize, f64)| {
                let residual = (self.torques[gear] - s * self.losses[gear]).abs();
                // With a large loss the load is small, a difference of large torques.
                let parts = self.parts(gear).fold(self.base[gear].abs(), |sum, part| sum + part.abs());
                let size = self.torques[gear].abs() + self.base[gear].abs() + self.slopes[gear].abs() * parts;
                residual <= SOLVED * size + f64::MIN_POSITIVE
            };
            if self.sliding.iter().all(solved) {
                return true;
            }
        }
        false
    }

    /// Notes where the motion of sliding gears is not unique.
    pub(super) fn note_ambiguity(&mut self, solved: bool) {
        if let Some(gear) = self.undefined_sliding.filter(|_| !solved) {
            // No motion, because a value is undefined.
            self.undefined = Some(self.directions[gear]);
            self.torques.fill(0.0);
            return;
        }
        let count = self.directions.len();
        // The side on which the load drives, where the loss may grow faster than its cause.
        self.evaluate(|_, _| false);
        let rest = |gear: usize| 1.0 - self.slopes[gear] * self.influence[gear * count + gear];
        let all = self.sliding.iter().map(|&(gear, _)| (gear, rest(gear)));
        let least = all.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(gear, rest)| (self.directions[gear], rest));
        self.jammed = least.filter(|_| !solved).map(|(direction, _)| direction);
        self.ambiguous = least.filter(|(_, rest)| solved && *rest <= 0.0).map(|(direction, _)| direction);
    }

    /// The contributions of the losses of sliding gears to a gear load.
    fn parts(&self, gear: usize) -> impl Iterator<Item = f64> {
        let influence = &self.influence[gear * self.directions.len()..];
        self.sliding.iter().map(|(sliding_mesh, _)| influence[*sliding_mesh] * self.torques[*sliding_mesh])
    }
}
