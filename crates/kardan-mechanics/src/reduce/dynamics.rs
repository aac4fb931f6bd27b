//! The reduced equations of motion, compiled for fast evaluation.

mod motion_plan;
mod numeric_terms;

use std::sync::Arc;

use kardan_rt::functions::exp;

use super::motion::{Motion, SparseRow};
use super::{Kinematics, Reduced};
use crate::assemble::{CoefficientKind, Weakened};
use kardan_expr::expr::{Expr, Floating, Symbol, lower};
use kardan_math::num::Cholesky;
pub use motion_plan::{Extension, MotionPlan};
use numeric_terms::{Directions, Fails, breakaways, falls, row_dot, set_valued};

/// The reduced equations of motion `H_r q̈_r = Gᵀτ − h_r` \[diss. (4.23), (4.24)\], compiled for fast evaluation.
///
/// Terms along constant directions are summed into matrices once; only directions that pass through a
/// configuration-dependent transmission are added at each evaluation.
#[derive(Debug, Clone)]
pub struct Dynamics {
    /// Degrees of freedom.
    pub degrees_of_freedom: usize,
    dampers: Directions,
    springs: Directions,
    /// Springs and dampers that fail in a run.
    failing: Vec<Fails>,
    rests: Vec<f64>,
    frictions: Directions,
    breakaways: Vec<f64>,
    /// Reduced coordinates with an entry in each friction direction.
    friction_entries: Vec<Vec<usize>>,
    /// For each friction direction the excess of breakaway over sliding friction (N m), and the speed over which it
    /// decays (rad/s).
    stribeck: Vec<(f64, f64)>,
    inputs: Directions,
    constant: bool,
    linear: bool,
    plan: Arc<MotionPlan>,
}

/// Memory and results of one evaluation of [`Dynamics`]; belongs to the caller.
#[derive(Debug, Clone)]
pub struct Work {
    /// Angles, speeds, basis, bias.
    pub kinematics: Kinematics,
    /// H_r, row by row, kg m².
    pub inertia: Vec<f64>,
    /// Its factor.
    pub factor: Cholesky,
    /// Passive generalised force `−h_r` without Coulomb friction, N m.
    pub passive: Vec<f64>,
    /// Reduced direction `g` of each friction term, row by row.
    pub friction_rows: Vec<f64>,
    /// Acceleration bias `aᵀk` in each friction direction, rad/s².
    pub friction_bias: Vec<f64>,
    /// Reduced direction of each input, row by row.
    pub input_rows: Vec<f64>,
    /// Where the inertia is the same at every position and computed, whether it is regular.
    regular: Option<bool>,
    /// Memory of the plan.
    memory: Vec<f64>,
    /// Memory of that of angles and speeds alone.
    shafts: Vec<f64>,
}

impl Work {
    /// Sets the inputs of an [`Extension`], from a number on.
    pub fn give(&mut self, dynamics: &Dynamics, first: usize, values: impl IntoIterator<Item = f64>) {
        let first = 2 * dynamics.degrees_of_freedom + first;
        self.memory[first..].iter_mut().zip(values).for_each(|(place, value)| *place = value);
    }

    /// Coefficients of the inertia have changed.
    pub fn forget_inertia(&mut self) {
        self.regular = None;
    }

    /// An output of an [`Extension`] at the last update.
    pub fn more(&self, dynamics: &Dynamics, output: usize) -> f64 {
        let MotionPlan { plan, more, .. } = &*dynamics.plan;
        self.memory[plan.place(more.start + output)]
    }

    /// All values of the plan at the last update.
    pub fn values(&self) -> &[f64] {
        &self.memory
    }
}

/// The constant entries of multiplier constraints.
fn add_multipliers(rows: &[SparseRow], r: usize, constants: &dyn Fn(&[Expr]) -> Vec<f64>, out: &mut Vec<f64>) {
    for row in rows {
        let entries: Vec<Expr> = row.values().copied().collect();
        let mut dense = vec![0.0; r];
        row.keys().zip(constants(&entries)).for_each(|(i, entry)| dense[*i] = entry);
        out.extend(dense);
    }
}

/// Kinematics with its parts that are the same at every position, speed and time: also prescribed speeds that do not
/// change.
fn with_constants(
    mut kinematics: Kinematics,
    reduced: &Reduced,
    motion: &Motion,
    varying: impl Fn(Expr) -> bool,
    constants: impl Fn(&[Expr]) -> Vec<f64>,
) -> Kinematics {
    let zero = vec![0.0; reduced.degrees_of_freedom()];
    kinematics.update(&zero, &zero);
    if let Some(massless) = &reduced.massless {
        kinematics.transform(&massless.transform);
    }
    for (own, exprs) in [(&mut kinematics.speeds, &motion.speeds), (&mut kinematics.bias, &motion.bias)] {
        for ((own, expr), constant) in own.iter_mut().zip(exprs).zip(constants(exprs)) {
            if !varying(*expr) {
                *own = constant;
            }
        }
    }
    kinematics
}

/// Whether the inertia depends only on coefficients that are inputs.
fn inertia_is_constant(motion: &Motion) -> bool {
    let entries: Vec<Expr> = motion.inertia.values().copied().collect();
    let run_parameters: Vec<Symbol> =
        motion.run_parameters.iter().filter_map(|(_, symbol)| motion.graph.symbol_of(*symbol)).collect();
    motion.graph.symbols(&entries).iter().all(|symbol| run_parameters.contains(symbol))
}

impl Dynamics {
    /// Compiles a reduced model; returns it with the memory for its evaluation. Functions of time have their values at
    /// time zero.
    pub fn new(reduced: &Reduced) -> (Self, Work) {
        let mut begin = Vec::new();
        let (dynamics, mut work) = Self::extended(reduced, |motion| {
            begin.extend(motion.timed.values(0.0));
            Extension { inputs: motion.timed.symbols(&motion.graph), outputs: Vec::new() }
        });
        work.give(&dynamics, 0, begin);
        (dynamics, work)
    }

    /// The same with further expressions of the motion and of further inputs.
    ///
    /// # Panics
    /// If these depend on a symbol that is neither of the motion nor among [`Extension::inputs`].
    pub fn extended(reduced: &Reduced, extend: impl FnOnce(&mut Motion) -> Extension) -> (Self, Work) {
        let kinematics = Kinematics::new(reduced);
        let (r, equations) = (reduced.degrees_of_freedom(), &reduced.equations);
        let dampers = Directions::new(&equations.dampers, |x| x.to_f64(), &kinematics);
        let springs = Directions::new(&equations.springs, |x| x.stiffness.to_f64(), &kinematics);
        let (frictions, breakaways) = (set_valued(equations, &kinematics), breakaways(equations));
        let stribeck = falls(equations, &breakaways, &frictions.coefficients);
        let inputs = Directions::new(&equations.inputs, |_| 1.0, &kinematics);
        let rests: Vec<f64> = equations.springs.iter().map(|spring| spring.value.rest.to_f64()).collect();
        let mut motion = Motion::new(reduced);
        let speeds = motion.speeds.clone();
        let extension = extend(&mut motion);
        // The slipping sliders among those that springs couple are inputs.
        let couples = reduced.massless.as_ref().is_some_and(|massless| !massless.coupled_slips().is_empty());
        let speeds = if couples { motion.speeds.clone() } else { speeds };
        let energy = motion.energy(reduced);
        let plan = MotionPlan::new(&motion, r, extension, (energy, &speeds));
        // Constant entries are there from the start.
        let varying = motion.graph.varying();
        let constants = |exprs: &[Expr]| -> Vec<f64> {
            let constant_exprs: Vec<Expr> = exprs.iter().copied().filter(|expr| !varying(*expr)).collect();
            let mut found =
                lower(&motion.graph, &constant_exprs, &mut Floating::<f64>::default(), |_| f64::NAN).into_iter();
            exprs.iter().map(|expr| if varying(*expr) { 0.0 } else { found.next().unwrap_or(f64::NAN) }).collect()
        };
        let mut inertia = vec![0.0; r * r];
        let entries: Vec<Expr> = motion.inertia.values().copied().collect();
        for (&(i, j), entry) in motion.inertia.keys().zip(constants(&entries)) {
            (inertia[i * r + j], inertia[j * r + i]) = (entry, entry);
        }
        let kinematics = with_constants(kinematics, reduced, &motion, &varying, constants);
        let passive = constants(&motion.passive);
        let rows = motion.basis.iter().chain(&motion.frictions).chain(&motion.inputs).flat_map(|row| row.values());
        let mut fixed = rows.chain(motion.inertia.values()).chain(&motion.bias).chain(&motion.friction_bias);
        let affine = motion.graph.affine();
        let steady = equations.multiplier_constraints.is_empty()
            && equations.moving.is_empty()
            && equations.failing.is_empty()
            && equations.laws.iter().all(|law| !law.value.is_of_time());
        let linear = steady
            && fixed.all(|expr| !varying(*expr))
            && motion.passive.iter().chain(&motion.angles).all(|expr| affine(*expr));
        let out = Self {
            degrees_of_freedom: r,
            constant: inertia_is_constant(&motion),
            linear,
            failing: Fails::all(equations),
            rests,
            dampers,
            springs,
            frictions,
            breakaways,
            friction_entries: motion.frictions.iter().map(|row| row.keys().copied().collect()).collect(),
            stribeck,
            inputs,
            plan: Arc::new(plan),
        };
        let mut first: Vec<usize> = (0..r).collect();
        motion.inertia.keys().for_each(|&(i, j)| first[i.max(j)] = first[i.max(j)].min(i.min(j)));
        let mut factor = Cholesky::profiled(first);
        factor.factor(&inertia);
        let mut friction_rows = out.frictions.projected(&kinematics, r);
        add_multipliers(&motion.frictions[out.frictions.rows.len()..], r, &constants, &mut friction_rows);
        let work = Work {
            // Constant entries of a row stay as they are here; each evaluation writes the varying ones.
            friction_rows,
            friction_bias: constants(&motion.friction_bias),
            input_rows: out.inputs.projected(&kinematics, r),
            kinematics,
            inertia,
            factor,
            passive,
            regular: out.plan.inertia.is_empty().then_some(true),
            memory: out.plan.plan.memory(),
            shafts: out.plan.shafts.memory(),
        };
        (out, work)
    }

    /// The plan that is evaluated, and the indices of its results.
    pub fn plan(&self) -> &MotionPlan {
        &self.plan
    }

    /// The same, shared.
    pub fn shared_plan(&self) -> &Arc<MotionPlan> {
        &self.plan
    }

    /// Whether the inertia is the same at every position.
    pub fn has_constant_inertia(&self) -> bool {
        self.constant
    }

    /// Whether, except for friction, angles, accelerations and all directions are linear in position, speed and inputs
    /// (with constants), decided on the exact expressions.
    pub fn is_linear(&self) -> bool {
        self.linear
    }

    /// Number of friction directions; those of unilateral constraints follow them.
    pub fn friction_count(&self) -> usize {
        self.frictions.rows.len()
    }

    /// Coulomb torques of the friction directions, N m; zero for unilateral constraints.
    pub fn friction_torques(&self) -> &[f64] {
        &self.frictions.coefficients
    }

    /// Largest torques of the friction directions at rest, N m; without `breakaway` the Coulomb torques.
    pub fn breakaway_torques(&self) -> &[f64] {
        &self.breakaways
    }

    /// Size of the torque of a friction direction that slides with this speed (rad/s), N m: `c + (c_b − c) exp(−(v/v_s)²)`
    /// (Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30, 1994, (4)).
    pub fn sliding_torque(&self, friction: usize, speed: f64) -> f64 {
        let (torque, (more, scale)) = (self.frictions.coefficients[friction], self.stribeck[friction]);
        let square = (speed / scale) * (speed / scale);
        // Above that the excess is zero, and `exp` would be slow.
        if more == 0.0 || square > 700.0 { torque } else { torque + more * exp(-square) }
    }

    /// Evaluates kinematics, inertia, passive forces, friction and input directions at `q_r` (rad), `q̇_r` (rad/s).
    ///
    /// Returns whether the inertia is numerically positive definite. Allocates nothing.
    pub fn update(&self, position: &[f64], speed: &[f64], work: &mut Work) -> bool {
        let r = self.degrees_of_freedom;
        let MotionPlan { plan, native, angles, speeds, basis, bias, passive, .. } = &*self.plan;
        let Work { kinematics, memory, .. } = work;
        memory[..r].copy_from_slice(&position[..r]);
        memory[r..2 * r].copy_from_slice(&speed[..r]);
        // A value that is not a number is detected where it is used. The code has the same bits as the list.
        let _ = match native {
            Some(native) => native.evaluate(memory),
            None => plan.block().evaluate(memory),
        };
        let put = |list: &[(usize, usize)], memory: &[f64], out: &mut [f64]| {
            list.iter().for_each(|(place, output)| out[*place] = memory[plan.place(*output)]);
        };
        put(angles, memory, &mut kinematics.angles);
        put(speeds, memory, &mut kinematics.speeds);
        put(basis, memory, &mut kinematics.basis);
        put(bias, memory, &mut kinematics.bias);
        put(passive, memory, &mut work.passive);
        put(&self.plan.friction_rows, memory, &mut work.friction_rows);
        put(&self.plan.friction_bias, memory, &mut work.friction_bias);
        put(&self.plan.input_rows, memory, &mut work.input_rows);
        if let Some(regular) = work.regular.filter(|_| self.constant) {
            return regular;
        }
        put(&self.plan.inertia, memory, &mut work.inertia);
        let regular = work.factor.factor(&work.inertia);
        work.regular = Some(regular);
        regular
    }

    /// Evaluates angles and speeds of the shafts alone: [`Kinematics::angles`] and [`Kinematics::speeds`] of the work.
    pub fn update_shafts(&self, position: &[f64], speed: &[f64], work: &mut Work) {
        let r = self.degrees_of_freedom;
        let MotionPlan { angles, speeds, shafts, native_shafts, beside, .. } = &*self.plan;
        let Work { kinematics, shafts: memory, memory: whole, .. } = work;
        memory[..r].copy_from_slice(&position[..r]);
        memory[r..2 * r].copy_from_slice(&speed[..r]);
        beside.iter().enumerate().for_each(|(k, input)| memory[2 * r + k] = whole[*input]);
        let _ = match native_shafts {
            Some(native) => native.evaluate(memory),
            None => shafts.block().evaluate(memory),
        };
        kinematics.set(position, speed);
        angles.iter().enumerate().for_each(|(k, (shaft, _))| kinematics.angles[*shaft] = memory[shafts.place(k)]);
        for (k, (shaft, _)) in speeds.iter().enumerate() {
            kinematics.speeds[*shaft] = memory[shafts.place(angles.len() + k)];
        }
    }

    /// Kinetic and potential energy, J, at the last update.
    pub fn energy(&self, work: &Work) -> f64 {
        let (energy, state_count) = (&self.plan.energy, 2 * self.degrees_of_freedom);
        let mut memory = energy.memory();
        memory[..state_count].copy_from_slice(&work.memory[..state_count]);
        self.plan.beside.iter().enumerate().for_each(|(k, input)| memory[state_count + k] = work.memory[*input]);
        let block = energy.block();
        // A value that is not a number is detected where it is used.
        let _ = block.evaluate(&mut memory);
        memory[energy.place(0)]
    }

    /// Updates springs and dampers from a time on: their failures are in the expressions, and here for sensors that
    /// read them between evaluations.
    pub fn enter_faults(&mut self, time: f64) {
        for Fails { weakened: Weakened { share, moved }, springs, dampers } in &self.failing {
            let remaining_share = 1.0 + share.as_ref().map_or(0.0, |share| share.value(time));
            let moved = moved.as_ref().map_or(0.0, |moved| moved.value(time));
            for (k, stiffness, rest) in springs {
                self.springs.coefficients[*k] = remaining_share * stiffness;
                self.rests[*k] = rest + moved;
            }
            for (k, damping) in dampers {
                self.dampers.coefficients[*k] = remaining_share * damping;
            }
        }
    }

    /// Sets a coefficient of the equations, by its kind and the number of its term, everywhere except in the plan,
    /// which receives it as an input and alone has inertias. For a friction this includes its stick limit.
    pub fn take_coefficient(&mut self, (kind, term): (CoefficientKind, usize), value: f64) {
        match kind {
            CoefficientKind::Inertia => {}
            CoefficientKind::Damping => self.dampers.coefficients[term] = value,
            CoefficientKind::Stiffness => self.springs.coefficients[term] = value,
            CoefficientKind::Friction => {
                self.frictions.coefficients[term] = value;
                self.breakaways[term] = value;
            }
        }
    }

    /// Number of viscous dampers.
    pub fn damper_count(&self) -> usize {
        self.dampers.rows.len()
    }

    /// Torque (N m) and speed (rad/s) of a damper by its number, at the last update.
    pub fn damper_factors(&self, damper: usize, work: &Work) -> [f64; 2] {
        let speed = row_dot(&self.dampers.rows[damper], &work.kinematics.speeds);
        [self.dampers.coefficients[damper] * speed, speed]
    }

    /// Speed in an input direction, rad/s, at the last update.
    pub fn input_speed(&self, input: usize, work: &Work) -> f64 {
        row_dot(&self.inputs.rows[input], &work.kinematics.speeds)
    }

    /// Angle in a friction direction, rad, at the last update.
    pub fn friction_angle(&self, friction: usize, work: &Work) -> f64 {
        row_dot(&self.frictions.rows[friction], &work.kinematics.angles)
    }

    /// The sum of the absolute terms of that angle, rad, which bounds its cancellation.
    pub fn friction_angles(&self, friction: usize, work: &Work) -> f64 {
        self.frictions.rows[friction].iter().map(|(shaft, c)| (c * work.kinematics.angles[*shaft]).abs()).sum()
    }

    /// Speed in a friction direction, rad/s, at the last update.
    pub fn friction_speed(&self, friction: usize, work: &Work) -> f64 {
        row_dot(&self.frictions.rows[friction], &work.kinematics.speeds)
    }

    /// The component of a vector over the reduced coordinates in a friction direction, at the last update.
    pub fn friction_component(&self, friction: usize, vector: &[f64], work: &Work) -> f64 {
        let row = &work.friction_rows[friction * self.degrees_of_freedom..];
        self.friction_entries[friction].iter().map(|&i| row[i] * vector[i]).sum()
    }

    /// The reduced coordinate that a friction direction equals at every position, if there is one and it does at the
    /// last update.
    pub fn only_entry(&self, friction: usize, work: &Work) -> Option<usize> {
        let &[i] = self.friction_entries[friction].as_slice() else { return None };
        (work.friction_rows[friction * self.degrees_of_freedom + i] != 0.0).then_some(i)
    }

    /// Whether the coefficients of a friction direction change with the angles.
    pub fn friction_varies(&self, friction: usize) -> bool {
        let (r, own) = (self.degrees_of_freedom, self.frictions.rows.len());
        // Multiplier constraints follow the frictions.
        let multiplier_varies = || self.plan.friction_rows.iter().any(|(entry, _)| entry / r == friction);
        if friction < own { self.frictions.varying.contains(&friction) } else { multiplier_varies() }
    }

    /// Bound of the cancellation in the speed of a friction direction, rad/s: `Σ |a_j K_ji v_i|` over shafts j and
    /// coordinates i, at the last update; `sizes` are the sizes of the reduced speeds. The speed itself is accurate to
    /// this times the unit roundoff.
    pub fn friction_terms(&self, friction: usize, sizes: &[f64], work: &Work) -> f64 {
        let shaft = |(shaft, c): &(usize, f64)| {
            let row = work.kinematics.row(*shaft).iter().zip(sizes);
            c.abs() * row.map(|(entry, size)| (entry * size).abs()).sum::<f64>()
        };
        self.frictions.rows[friction].iter().map(shaft).sum()
    }

    /// Torque of a spring by its number, N m, at the last update: `s·(aᵀq − rest)`.
    pub fn spring_torque(&self, spring: usize, work: &Work) -> f64 {
        self.springs.coefficients[spring]
            * (row_dot(&self.springs.rows[spring], &work.kinematics.angles) - self.rests[spring])
    }

    /// Stiffness of a spring by its number, N m/rad.
    pub fn spring_stiffness(&self, spring: usize) -> f64 {
        self.springs.coefficients[spring]
    }

    /// Torque of a damper by its number, N m, at the last update: `d·aᵀq̇`.
    pub fn damper_torque(&self, damper: usize, work: &Work) -> f64 {
        self.dampers.coefficients[damper] * row_dot(&self.dampers.rows[damper], &work.kinematics.speeds)
    }
}
