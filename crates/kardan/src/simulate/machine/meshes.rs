//! Teeth that rub: a loss that depends on the torque that the teeth carry, which depends on the accelerations, which depend on the loss.
//!
//! The torque τ that the constraint of a mesh puts on the first body of its direction is affine in accelerations and in what holds and rubs. While
//! teeth slide, the loss `T = s f(|τ|)` against the motion solves `τ = τ₀ + Λ T`, by Newton's method on this piecewise smooth equation; while they are
//! at rest they hold up to `f`, with a loss of its own for each sense, as power would flow the one way or the other.
//!
//! One mesh has one solution as long as `1 − s σ f' Λ > 0` for both signs σ of τ. Where the load drives teeth that would lock themselves against
//! the inertia of that load, this fails (Painlevé): there are two motions or none. Both is told.

use kardan_native::Native;

use super::Machine;
use crate::assemble::Along;
use crate::equations::{Hold, Mesh};
use crate::expr::{Expr, Symbol};
use crate::num::{Rational, dot};
use crate::plan::{Plan, compile};
use crate::reduce::{Acting, Motion, Reduced};
use crate::simulate::friction::Mode;
use crate::units::Dimension;

/// Steps of Newton's method; of losses that are parts of the torque it takes two, and one for each sign that turns.
const MOST_STEPS: usize = 40;
/// What of the loss may be left, relative to it.
const SOLVED: f64 = 1e-14;
/// Signs that are tried as a start where the first one leads nowhere: of so many meshes all.
const MOST_PATTERNS: usize = 10;
/// Rounds of torques and modes until they fit each other.
const MOST_ROUNDS: usize = 40;
/// What rounding leaves of an acceleration, relative to its terms.
const ROUNDING: f64 = 1e-9;

/// What teeth carry, in the expressions of the loop: for each mesh the torque without accelerations and without what holds; for one of each
/// acceleration; for one of each torque of frictions and holds.
pub(super) struct MeshTerms {
    pub now: Vec<Expr>,
    pub by_acceleration: Vec<Expr>,
    pub by_torque: Vec<Expr>,
}

/// The meshes of a model among what holds.
fn meshes(reduced: &Reduced) -> impl Iterator<Item = (usize, &Along<Hold>, &Mesh)> {
    let first = reduced.equations.frictions.len();
    let all = reduced.equations.holds.iter().enumerate();
    all.filter_map(move |(k, hold)| if let Hold::Mesh(mesh) = &hold.value { Some((first + k, hold, mesh)) } else { None })
}

impl MeshTerms {
    pub fn new(motion: &mut Motion, reduced: &Reduced, applied: &[Expr], friction: &[Expr]) -> Self {
        let mut out = Self { now: Vec::new(), by_acceleration: Vec::new(), by_torque: Vec::new() };
        if meshes(reduced).next().is_none() {
            return out;
        }
        let r = reduced.degrees_of_freedom();
        let zeros = vec![motion.graph.integer(0); r];
        let acting = Acting { accelerations: &zeros, inputs: applied, frictions: friction };
        let now = motion.multipliers(reduced, acting);
        let mut symbols = |name: &str, count: usize| -> Vec<Expr> {
            (0..count).map(|k| motion.graph.new_symbol(format!("{name}.{k}"), Dimension::NONE)).collect()
        };
        let (accelerations, torques) = (symbols("unit_acceleration", r), symbols("unit_torque", friction.len()));
        let acting = Acting { accelerations: &accelerations, inputs: applied, frictions: &torques };
        let moved = motion.multipliers(reduced, acting);
        for (_, hold, _) in meshes(reduced) {
            let constraint = constraint_of(reduced, hold);
            let coefficient = first_entry(motion, reduced, constraint, hold);
            let scaled = |motion: &mut Motion, multiplier: Expr| motion.graph.multiply(coefficient, multiplier);
            out.now.push(scaled(motion, now[constraint]));
            for (list, symbols) in [(&mut out.by_acceleration, &accelerations), (&mut out.by_torque, &torques)] {
                for symbol in symbols {
                    let symbol = motion.graph.symbol_of(*symbol).expect("it was made as one");
                    let slope = motion.graph.derivatives(&[moved[constraint]], symbol)[0];
                    list.push(scaled(motion, slope));
                }
            }
        }
        out
    }
}

/// The constraint whose teeth rub.
fn constraint_of(reduced: &Reduced, hold: &Along<Hold>) -> usize {
    let equations = &reduced.equations;
    let linear = equations.constraints.iter().map(|row| &row.element);
    let mut all = linear.chain(equations.transmissions.iter().map(|curve| &curve.element));
    all.position(|element| *element == hold.element).expect("a mesh is of a constraint")
}

/// The coefficient that the constraint has for the first body of the direction.
fn first_entry(motion: &mut Motion, reduced: &Reduced, constraint: usize, hold: &Along<Hold>) -> Expr {
    let body = hold.row.iter().find(|(_, x)| *x > Rational::ZERO).map(|(body, _)| *body);
    let row = motion.constraint_row(reduced, constraint);
    let entry = row.into_iter().find(|(other, _)| Some(*other) == body).map(|(_, entry)| entry);
    entry.unwrap_or_else(|| motion.graph.integer(0))
}

/// The losses over the torques as a plan, with its memory: of each mesh the loss and its slope.
struct Laws {
    plan: Plan,
    native: Option<Native<f64>>,
    memory: Vec<f64>,
    /// What is given before the sizes of the torques, and behind them whether the first bodies drive.
    given: usize,
}

impl Laws {
    fn new(motion: &mut Motion, reduced: &Reduced, given: &[Symbol]) -> Self {
        let count = meshes(reduced).count();
        let mut symbols = |name: &str| -> Vec<Expr> {
            (0..count).map(|k| motion.graph.new_symbol(format!("{name}.{k}"), Dimension::NONE)).collect()
        };
        let (loads, forth) = (symbols("load"), symbols("forth"));
        let mut losses = Vec::new();
        for (k, (_, hold, mesh)) in meshes(reduced).enumerate() {
            let speed = motion.sum(&hold.row, |motion, shaft| motion.speeds[shaft]);
            let back = motion.graph.negate(speed);
            let speed = motion.graph.max(speed, back);
            let [own, other] = [&mesh.forth, &mesh.back].map(|part| motion.exact(part));
            let more = motion.graph.subtract(own, other);
            let more = motion.graph.multiply(forth[k], more);
            let part = motion.graph.add(other, more);
            let mut loss = motion.graph.multiply(part, loads[k]);
            if let Some(formula) = &mesh.loss {
                let added = motion.formula_of(reduced, formula, [loads[k], speed]);
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
        let given: Vec<Symbol> = given.iter().copied().chain(own).collect();
        let plan = compile(&motion.graph, &given, &outputs).expect("losses depend on what is given");
        let native = Native::new(&plan.block());
        Self { native, memory: plan.memory(), plan, given: given.len() - 2 * count }
    }
}

/// Why the motion of teeth is not one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Doubt {
    /// There are two motions; the one in which the first body drives is taken.
    Two,
    /// There is none.
    None,
}

/// The meshes of a machine.
#[derive(Default)]
pub(super) struct Meshes {
    /// Their directions.
    directions: Vec<usize>,
    laws: Option<Laws>,
    /// What they carry, and what they lose while they slide, against the motion along their directions.
    loads: Vec<f64>,
    pub(super) torques: Vec<f64>,
    losses: Vec<f64>,
    slopes: Vec<f64>,
    /// What each sliding mesh (columns) does to what all carry (rows).
    influence: Vec<f64>,
    /// Those that slide, with the senses of their motions, and what all carry without their losses.
    sliding: Vec<(usize, f64)>,
    base: Vec<f64>,
    /// Newton's equations, and a change of the accelerations with what holds against it.
    matrix: Vec<f64>,
    right: Vec<f64>,
    change: Vec<f64>,
    held: Vec<f64>,
    /// Torques of directions that begin to rub with a decision: what is carried now has nothing of them.
    rubbing: Vec<(usize, f64)>,
    /// Of which mesh the motion is not one, at the point last evaluated.
    doubt: Option<(usize, Doubt)>,
    /// Of which there was none at a rate that was asked for.
    pub(super) lost: Option<usize>,
    /// A loss below nothing there.
    negative: Option<(usize, f64)>,
}

impl Meshes {
    /// What is given are the symbols of the loop.
    pub(super) fn new(motion: &mut Motion, reduced: &Reduced, given: &[Symbol]) -> Self {
        let directions: Vec<usize> = meshes(reduced).map(|(direction, ..)| direction).collect();
        if directions.is_empty() {
            return Self::default();
        }
        let count = directions.len();
        let zeros = vec![0.0; count];
        Self {
            laws: Some(Laws::new(motion, reduced, given)),
            directions,
            loads: zeros.clone(),
            torques: zeros.clone(),
            losses: zeros.clone(),
            slopes: zeros,
            influence: vec![0.0; count * count],
            sliding: Vec::with_capacity(count),
            base: Vec::with_capacity(count),
            matrix: Vec::with_capacity(count * count),
            right: Vec::with_capacity(count),
            change: Vec::with_capacity(reduced.degrees_of_freedom()),
            held: Vec::with_capacity(reduced.degrees_of_freedom()),
            rubbing: Vec::new(),
            doubt: None,
            lost: None,
            negative: None,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.directions.is_empty()
    }

    /// Directions of meshes, with what they lose while they slide.
    pub(super) fn losses(&self) -> impl Iterator<Item = (usize, f64)> {
        self.directions.iter().copied().zip(self.torques.iter().copied())
    }

    /// The direction of teeth that have no motion at the point last evaluated.
    pub(super) fn without_motion(&self) -> Option<usize> {
        self.doubt.filter(|(_, doubt)| *doubt == Doubt::None).map(|(direction, _)| direction)
    }

    fn give(&mut self, values: &[f64]) {
        if let Some(laws) = &mut self.laws {
            laws.memory[..laws.given].copy_from_slice(&values[..laws.given]);
        }
    }

    /// Losses and slopes at the torques carried, where the first bodies drive or are driven.
    fn evaluate(&mut self, drives: impl Fn(usize, f64) -> bool) {
        let count = self.directions.len();
        let Some(laws) = &mut self.laws else { return };
        for (k, load) in self.loads.iter().enumerate() {
            laws.memory[laws.given + k] = load.abs();
            laws.memory[laws.given + count + k] = f64::from(u8::from(drives(k, *load)));
        }
        // What is no number is seen where it is used.
        let _ = match &laws.native {
            Some(native) => native.evaluate(&mut laws.memory),
            None => laws.plan.block().evaluate(&mut laws.memory),
        };
        for k in 0..count {
            self.losses[k] = laws.memory[laws.plan.place(k)];
            self.slopes[k] = laws.memory[laws.plan.place(count + k)];
        }
    }

    /// The losses of meshes that slide. False if none is found.
    fn solve(&mut self) -> bool {
        let n = self.sliding.len();
        let patterns = 1usize << n.min(MOST_PATTERNS);
        // First from what is carried without loss, then from losses that would turn the signs.
        for pattern in 0..=patterns {
            let sign = |place: usize| if (pattern.wrapping_sub(1) >> place) & 1 == 1 { 1.0 } else { -1.0 };
            for (place, &(mesh, _)) in self.sliding.iter().enumerate() {
                let base = self.base[mesh];
                self.loads[mesh] = if pattern == 0 { base } else { sign(place) * base.abs() };
            }
            if self.newton() {
                return true;
            }
        }
        false
    }

    /// Losses and slopes of those that slide, at what they carry. Where nothing is carried it is as if the first body drove: that side has one
    /// solution.
    fn evaluate_sliding(&mut self) {
        let sliding = std::mem::take(&mut self.sliding);
        let sense = |mesh: usize| sliding.iter().find(|one| one.0 == mesh).map_or(0.0, |one| one.1);
        self.evaluate(|mesh, load| load * sense(mesh) <= 0.0);
        self.sliding = sliding;
    }

    /// Newton's method from what the meshes carry now: `T = s (f + f′ σ (τ − τ now))` with `τ = base + Λ T`.
    fn newton(&mut self) -> bool {
        let (n, count) = (self.sliding.len(), self.directions.len());
        for _ in 0..MOST_STEPS {
            self.evaluate_sliding();
            self.matrix.clear();
            self.right.clear();
            for (row, &(mesh, s)) in self.sliding.iter().enumerate() {
                let sigma = if self.loads[mesh] == 0.0 { -s } else { self.loads[mesh].signum() };
                let slope = s * self.slopes[mesh] * sigma;
                self.right.push(s * self.losses[mesh] + slope * (self.base[mesh] - self.loads[mesh]));
                for (column, &(other, _)) in self.sliding.iter().enumerate() {
                    let own = if row == column { 1.0 } else { 0.0 };
                    self.matrix.push(own - slope * self.influence[mesh * count + other]);
                }
            }
            if !eliminate(&mut self.matrix[..n * n], &mut self.right[..n]) {
                return false;
            }
            for (&(mesh, _), torque) in self.sliding.iter().zip(&self.right) {
                self.torques[mesh] = *torque;
            }
            for &(mesh, _) in &self.sliding {
                let of = |(other, _): &(usize, f64)| self.influence[mesh * count + other] * self.torques[*other];
                self.loads[mesh] = self.base[mesh] + self.sliding.iter().map(of).sum::<f64>();
            }
            self.evaluate_sliding();
            let solved = |&(mesh, s): &(usize, f64)| {
                let left = (self.torques[mesh] - s * self.losses[mesh]).abs();
                left <= SOLVED * (self.torques[mesh].abs() + self.base[mesh].abs())
            };
            if self.sliding.iter().all(solved) {
                return true;
            }
        }
        false
    }
}

/// Solves a small system in place; false if it is singular.
fn eliminate(matrix: &mut [f64], right: &mut [f64]) -> bool {
    let n = right.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|a, b| matrix[a * n + k].abs().total_cmp(&matrix[b * n + k].abs())).unwrap_or(k);
        if matrix[pivot * n + k] == 0.0 || !matrix[pivot * n + k].is_finite() {
            return false;
        }
        (k..n).for_each(|j| matrix.swap(k * n + j, pivot * n + j));
        right.swap(k, pivot);
        for i in k + 1..n {
            let factor = matrix[i * n + k] / matrix[k * n + k];
            (k..n).for_each(|j| matrix[i * n + j] -= factor * matrix[k * n + j]);
            right[i] -= factor * right[k];
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| matrix[k * n + j] * right[j]).sum();
        right[k] = (right[k] - known) / matrix[k * n + k];
    }
    true
}

/// Notes where the motion of sliding teeth is not one.
fn doubt(meshes: &mut Meshes, solved: bool) {
    let count = meshes.directions.len();
    // The side on which the load drives, where the loss may outgrow what makes it.
    meshes.evaluate(|_, _| false);
    let rest = |mesh: usize| 1.0 - meshes.slopes[mesh] * meshes.influence[mesh * count + mesh];
    let least = meshes.sliding.iter().map(|&(mesh, _)| (mesh, rest(mesh))).min_by(|a, b| a.1.total_cmp(&b.1));
    meshes.doubt = match least {
        Some((mesh, _)) if !solved => Some((meshes.directions[mesh], Doubt::None)),
        Some((mesh, rest)) if rest <= 0.0 => Some((meshes.directions[mesh], Doubt::Two)),
        _ => None,
    };
}

impl Machine {
    /// Accelerations and holding torques in the current modes with the losses of meshes, which `force` then has; and what meshes at rest hold.
    /// Needs the factors of what holds.
    pub(super) fn load_meshes(&mut self) {
        let mut meshes = std::mem::take(&mut self.meshes);
        self.unload(&mut meshes);
        self.accelerate_held();
        self.read_loads(&mut meshes);
        meshes.give(self.work.values());
        meshes.doubt = None;
        meshes.sliding.clear();
        for (mesh, &k) in meshes.directions.iter().enumerate().filter(|(_, k)| self.modes[**k] != Mode::Stick) {
            meshes.sliding.push((mesh, self.modes[k].sign()));
        }
        if !meshes.sliding.is_empty() {
            meshes.base.clone_from(&meshes.loads);
            for place in 0..meshes.sliding.len() {
                let mesh = meshes.sliding[place].0;
                self.find_influence(&mut meshes, mesh);
            }
            let solved = meshes.solve();
            doubt(&mut meshes, solved);
            for &(mesh, _) in &meshes.sliding {
                self.act(meshes.directions[mesh], -meshes.torques[mesh]);
            }
            self.accelerate_held();
            self.read_loads(&mut meshes);
        }
        self.bound_meshes(&mut meshes);
        self.meshes = meshes;
    }

    /// Takes the losses of meshes out of the force.
    fn unload(&mut self, meshes: &mut Meshes) {
        for (&k, torque) in meshes.directions.iter().zip(&mut meshes.torques) {
            self.act(k, std::mem::take(torque));
        }
    }

    /// Adds a torque along a direction to the force.
    fn act(&mut self, direction: usize, torque: f64) {
        if torque != 0.0 {
            let r = self.degrees_of_freedom;
            let row = &self.work.friction_rows[direction * r..(direction + 1) * r];
            self.force.iter_mut().zip(row).for_each(|(force, x)| *force += x * torque);
        }
    }

    /// What meshes carry with the accelerations, and with what holds and slides.
    fn read_loads(&self, meshes: &mut Meshes) {
        let held = self.holding.iter().copied().zip(self.hold_torque.iter().copied());
        self.read_loads_of(meshes, held);
    }

    /// The same with other torques that hold.
    fn read_loads_of(&self, meshes: &mut Meshes, held: impl Iterator<Item = (usize, f64)> + Clone) {
        let r = self.degrees_of_freedom;
        let of = |place: usize| self.work.more(&self.dynamics, place);
        let directions = self.modes.len();
        for mesh in 0..meshes.directions.len() {
            let first = self.places.mesh_by_acceleration.start + mesh * r;
            let moved: f64 = (0..r).map(|i| of(first + i) * self.acceleration[i]).sum();
            let first = self.places.mesh_by_torque.start + mesh * directions;
            let all = held.clone().chain(meshes.losses()).chain(meshes.rubbing.iter().copied());
            let rubbed: f64 = all.map(|(k, torque)| of(first + k) * torque).sum();
            meshes.loads[mesh] = of(self.places.mesh_loads.start + mesh) + moved + rubbed;
        }
    }

    /// What one of the loss of a sliding mesh does to what all carry.
    fn find_influence(&mut self, meshes: &mut Meshes, mesh: usize) {
        let (r, count, holding) = (self.degrees_of_freedom, meshes.directions.len(), self.holding.len());
        let direction = meshes.directions[mesh];
        let Meshes { change, held, influence, .. } = meshes;
        change.clear();
        change.extend(self.work.friction_rows[direction * r..(direction + 1) * r].iter().map(|x| -x));
        held.clear();
        if holding == r {
            held.extend((0..holding).map(|a| dot(&self.weighted[a * r..(a + 1) * r], change)));
            self.hold_factor.solve(held);
            change.fill(0.0);
        } else {
            self.work.factor.solve(change);
            held.extend(self.holding.iter().map(|&k| self.dynamics.along_friction(k, change, &self.work)));
            self.hold_factor.solve(held);
            for (a, torque) in held.iter().enumerate() {
                let row = &self.weighted[a * r..(a + 1) * r];
                change.iter_mut().zip(row).for_each(|(x, weight)| *x -= weight * torque);
            }
        }
        let of = |place: usize| self.work.more(&self.dynamics, place);
        for row in 0..count {
            let first = self.places.mesh_by_acceleration.start + row * r;
            let moved: f64 = (0..r).map(|i| of(first + i) * change[i]).sum();
            let first = self.places.mesh_by_torque.start + row * self.modes.len();
            let holds: f64 = self.holding.iter().zip(&*held).map(|(k, torque)| of(first + k) * torque).sum();
            influence[row * count + mesh] = moved + holds + of(first + direction);
        }
    }

    /// What meshes hold either way at what they carry.
    fn bound_meshes(&mut self, meshes: &mut Meshes) {
        meshes.negative = None;
        // Against motion forward, then backward; the first body drives where the torque of the teeth opposes the motion.
        for (bounds, sense) in self.bounds.iter_mut().zip([1.0, -1.0]) {
            meshes.evaluate(|_, load| load * sense <= 0.0);
            for (&k, loss) in meshes.directions.iter().zip(&meshes.losses) {
                bounds[k] = loss.max(0.0);
                if *loss < 0.0 {
                    meshes.negative = Some((k, *loss));
                }
            }
        }
    }

    /// Whether there are teeth that rub.
    pub(in crate::simulate) fn has_meshes(&self) -> bool {
        !self.meshes.is_empty()
    }

    /// The direction of teeth that could go on in two ways from the point last evaluated.
    pub(in crate::simulate) fn doubtful_mesh(&self) -> Option<usize> {
        self.meshes.doubt.filter(|(_, doubt)| *doubt == Doubt::Two).map(|(direction, _)| direction)
    }

    /// The direction of teeth that had no motion where a rate was asked for, since that was forgotten.
    pub(in crate::simulate) fn lost_mesh(&self) -> Option<usize> {
        self.meshes.lost
    }

    /// Forgets it.
    pub(in crate::simulate) fn forget_lost_mesh(&mut self) {
        self.meshes.lost = None;
    }

    /// Teeth whose loss is below nothing there, with that.
    pub(in crate::simulate) fn driving_mesh(&self) -> Option<(usize, f64)> {
        self.meshes.negative
    }

    /// [`Machine::decide`] where meshes hold what depends on the decision: rounds of modes and of what the teeth then carry, until they fit.
    pub(super) fn decide_loaded(&mut self, resting: &[usize]) -> Vec<Mode> {
        let at_rest = vec![Mode::Stick; resting.len()];
        self.set_modes(resting, &at_rest);
        self.load_meshes();
        let mut found = at_rest.clone();
        let mut tried: Vec<Vec<Mode>> = Vec::new();
        for _ in 0..MOST_ROUNDS {
            // Modes for what the teeth hold now; those that were tried in vain stay at rest as far as they would go back.
            let at = self.decide_with_bounds(resting);
            if tried.contains(&at) {
                break;
            }
            found.clone_from(&at);
            let fits = self.try_modes(resting, &at);
            if fits {
                break;
            }
            for (&k, mode) in resting.iter().zip(&mut found) {
                if !self.goes(k) {
                    *mode = Mode::Stick;
                }
            }
            tried.push(at);
            // The torques of teeth that slide elsewhere stay as they are now; those of these are part of the decision.
            let mut meshes = std::mem::take(&mut self.meshes);
            for (&k, torque) in meshes.directions.iter().zip(&mut meshes.torques).filter(|(k, _)| resting.contains(k)) {
                self.act(k, std::mem::take(torque));
            }
            self.meshes = meshes;
            self.set_modes(resting, &at_rest);
        }
        self.set_modes(resting, &at_rest);
        self.load_meshes();
        found
    }

    /// The directions that stick, where some depend on others, and torques of which each holds the same part of what it can with what the teeth then
    /// carry; nothing where that is more than all of it.
    pub(super) fn shared_torques(&mut self) -> Option<(Vec<usize>, Vec<f64>)> {
        let sticking: Vec<usize> = self.holding.iter().chain(&self.following).copied().collect();
        let mut torques = vec![0.0; sticking.len()];
        let groups = self.groups(&sticking)?;
        let mut meshes = std::mem::take(&mut self.meshes);
        let mut holds = true;
        for round in 0..MOST_ROUNDS {
            let before = torques.clone();
            holds = true;
            for (group, needed) in groups.iter().zip(&self.hold_torque) {
                holds &= self.share_group(&mut meshes, group, *needed, (&sticking, &mut torques));
            }
            if round > 0 && before == torques || groups.len() == 1 {
                break;
            }
        }
        self.read_loads_of(&mut meshes, sticking.iter().copied().zip(torques.iter().copied()));
        self.bound_meshes(&mut meshes);
        self.meshes = meshes;
        holds.then_some((sticking, torques))
    }

    /// The sticking directions that are multiples of each holding one, as places among them with their factors; nothing where one depends on several.
    fn groups(&self, sticking: &[usize]) -> Option<Vec<Vec<(usize, f64)>>> {
        let (r, count) = (self.degrees_of_freedom, self.holding.len());
        let mut groups: Vec<Vec<(usize, f64)>> = (0..count).map(|a| vec![(a, 1.0)]).collect();
        for place in count..sticking.len() {
            let row = &self.work.friction_rows[sticking[place] * r..(sticking[place] + 1) * r];
            let mut shares: Vec<f64> =
                (0..count).map(|a| dot(&self.weighted[a * r..(a + 1) * r], row)).collect();
            self.hold_factor.solve(&mut shares);
            let largest = shares.iter().fold(0.0f64, |most, x| most.max(x.abs()));
            let mut own = (0..count).filter(|&a| shares[a].abs() > ROUNDING * largest);
            match (own.next(), own.next()) {
                (Some(a), None) => groups[a].push((place, shares[a])),
                (None, _) => {}
                _ => return None,
            }
        }
        Some(groups)
    }

    /// Shares what a group must hold; tells whether it can.
    ///
    /// With a part ρ of what each holds and `Σ c T = Q`, the torque of the teeth T is the one unknown: ρ follows from it, what they carry is affine
    /// in it, and `T − ρ f` changes its sign between none of Q and all of it.
    fn share_group(
        &self,
        meshes: &mut Meshes,
        group: &[(usize, f64)],
        needed: f64,
        (sticking, torques): (&[usize], &mut [f64]),
    ) -> bool {
        let most = |(place, factor): &(usize, f64)| {
            let bounds = &self.bounds[usize::from(factor * needed < 0.0)];
            bounds[sticking[*place]]
        };
        group.iter().for_each(|(place, _)| torques[*place] = 0.0);
        if let Some((place, factor)) = group.iter().find(|one| most(one) == f64::INFINITY) {
            torques[*place] = needed / factor;
            return true;
        }
        let teeth = group.iter().find(|(place, _)| meshes.directions.contains(&sticking[*place])).copied();
        let others: Vec<(usize, f64)> = group.iter().filter(|one| Some(one.0) != teeth.map(|t| t.0)).copied().collect();
        let room: f64 = others.iter().map(|one| one.1.abs() * most(one)).sum();
        let part = |of_teeth: f64, torques: &mut [f64]| {
            let left = needed - teeth.map_or(0.0, |(_, factor)| factor * of_teeth);
            let part = if left == 0.0 { 0.0 } else { left.abs() / room };
            for one in &others {
                torques[one.0] = part.min(f64::MAX) * most(one) * (one.1 * left).signum();
            }
            part
        };
        let Some((place, factor)) = teeth else { return part(0.0, torques) <= 1.0 + ROUNDING };
        let mesh = meshes.directions.iter().position(|k| *k == sticking[place]).unwrap_or(0);
        let sense = (factor * needed).signum();
        let whole = (needed / factor).abs();
        let mut last = 0.0;
        // By how much the teeth would hold a larger part than the others do.
        let mut excess = |this: &Self, torque: f64| {
            torques[place] = sense * torque;
            last = part(sense * torque, torques);
            this.read_loads_of(meshes, sticking.iter().copied().zip(torques.iter().copied()));
            meshes.evaluate(|_, load| load * sense <= 0.0);
            torque - last * meshes.losses[mesh]
        };
        // Regula falsi, with the weights of Dowell and Jarratt (BIT 11, 1971, 168).
        let (mut low, mut high) = ((0.0, excess(self, 0.0)), (whole, excess(self, whole)));
        let mut kept = 0;
        for _ in 0..MOST_STEPS {
            let middle = high.0 - high.1 * (high.0 - low.0) / (high.1 - low.1);
            if !(low.0 < middle && middle < high.0) {
                break;
            }
            let value = excess(self, middle);
            if value.abs() <= SOLVED * whole {
                break;
            }
            if value > 0.0 {
                high = (middle, value);
                low.1 *= if kept == 1 { 0.5 } else { 1.0 };
                kept = 1;
            } else {
                low = (middle, value);
                high.1 *= if kept == -1 { 0.5 } else { 1.0 };
                kept = -1;
            }
        }
        last <= 1.0 + ROUNDING
    }

    /// Modes of directions at rest, and which of them hold.
    fn set_modes(&mut self, resting: &[usize], modes: &[Mode]) {
        resting.iter().zip(modes).for_each(|(&k, mode)| self.modes[k] = *mode);
        let sticks = |(&k, mode): (&usize, &Mode)| (*mode == Mode::Stick).then_some(k);
        let sticking: Vec<usize> = resting.iter().zip(modes).filter_map(sticks).collect();
        self.choose_holding(&sticking);
    }

    /// Whether modes of directions at rest fit what the teeth carry in them.
    fn try_modes(&mut self, resting: &[usize], modes: &[Mode]) -> bool {
        let rubs = |(k, mode): &(&usize, &Mode)| **mode != Mode::Stick && !self.meshes.directions.contains(k);
        let torque = |(&k, mode): (&usize, &Mode)| (k, mode.sign() * self.bounds[usize::from(*mode == Mode::Backward)][k]);
        let rubbing: Vec<(usize, f64)> = resting.iter().zip(modes).filter(rubs).map(torque).collect();
        self.set_modes(resting, modes);
        rubbing.iter().for_each(|&(k, torque)| self.act(k, -torque));
        self.meshes.rubbing.clone_from(&rubbing);
        self.load_meshes();
        let fits = self.fits(resting);
        rubbing.iter().for_each(|&(k, torque)| self.act(k, torque));
        self.meshes.rubbing.clear();
        fits
    }

    /// Whether what sticks holds, and what leaves moves as it should, in the modes last evaluated.
    fn fits(&mut self, resting: &[usize]) -> bool {
        let held = if self.following.is_empty() {
            let bounds = self.bounds();
            let holds = |(&k, torque): (&usize, &f64)| torque.abs() <= bounds.of(k, *torque) * (1.0 + ROUNDING);
            self.holding.iter().zip(&self.hold_torque).all(holds)
        } else {
            self.shared_torques().is_some()
        };
        held && resting.iter().all(|k| self.goes(*k))
    }

    /// Whether a direction moves the way that its mode says, in the modes last evaluated.
    fn goes(&self, k: usize) -> bool {
        let r = self.degrees_of_freedom;
        let row = &self.work.friction_rows[k * r..(k + 1) * r];
        let terms = || row.iter().zip(&self.acceleration).map(|(x, a)| x * a);
        let size: f64 = terms().map(f64::abs).sum::<f64>() + self.work.friction_bias[k].abs();
        let sense = self.modes[k].sign();
        sense == 0.0 || sense * (terms().sum::<f64>() + self.work.friction_bias[k]) >= -ROUNDING * size
    }
}
