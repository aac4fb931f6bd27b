use super::{Kinematics, Reduced};
use crate::assemble::{Along, FrictionLaw};
use crate::num::{Cholesky, Matrix, dot, multiply};

/// Directions of one kind of term in reduced coordinates: `g = aᵀK`, constant rows precomputed.
#[derive(Debug, Clone)]
struct Directions {
    rows: Vec<Vec<(usize, f64)>>,
    coefficients: Vec<f64>,
    varying: Vec<usize>,
    constant: Vec<usize>,
    template: Vec<f64>,
}

impl Directions {
    fn new<T>(terms: &[Along<T>], coefficient: impl Fn(&T) -> f64, kinematics: &Kinematics, r: usize) -> Self {
        let rows: Vec<Vec<(usize, f64)>> = terms.iter().map(Along::row_f64).collect();
        let is_varying = |row: &Vec<(usize, f64)>| row.iter().any(|(shaft, _)| kinematics.is_varying(*shaft));
        let (varying, constant): (Vec<usize>, Vec<usize>) = (0..rows.len()).partition(|&k| is_varying(&rows[k]));
        let mut template = vec![0.0; rows.len() * r];
        for &k in &constant {
            project(&rows[k], kinematics, &mut template[k * r..(k + 1) * r]);
        }
        let coefficients = terms.iter().map(|term| coefficient(&term.value)).collect();
        Self { rows, coefficients, varying, constant, template }
    }
}

fn project(row: &[(usize, f64)], kinematics: &Kinematics, out: &mut [f64]) {
    out.fill(0.0);
    for (shaft, c) in row {
        for (value, entry) in out.iter_mut().zip(kinematics.row(*shaft)) {
            *value += c * entry;
        }
    }
}

/// `Σ c x_shaft` over a row.
fn along(row: &[(usize, f64)], x: &[f64]) -> f64 {
    row.iter().map(|(shaft, c)| c * x[*shaft]).sum()
}

/// The reduced equations of motion `H_r q̈_r = Gᵀτ − h_r` \[diss. (4.23), (4.24)\], compiled for fast evaluation.
///
/// Terms along constant directions are summed into matrices once; only directions that pass through a
/// configuration-dependent transmission are added at each evaluation.
#[derive(Debug, Clone)]
pub struct Dynamics {
    /// Degrees of freedom.
    pub degrees_of_freedom: usize,
    inertias: Directions,
    dampers: Directions,
    springs: Directions,
    rests: Vec<f64>,
    frictions: Directions,
    breakaways: Vec<f64>,
    /// What the friction of each direction has more when motion begins (N m), and the speed that it falls with (rad/s).
    stribeck: Vec<(f64, f64)>,
    inputs: Directions,
    inertia_constant: Vec<f64>,
    damping_constant: Vec<f64>,
    stiffness_constant: Vec<f64>,
    force_constant: Vec<f64>,
    constant: bool,
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
    /// Acceleration bias `aᵀk` along each friction direction, rad/s².
    pub friction_bias: Vec<f64>,
    /// Reduced direction of each input, row by row.
    pub input_rows: Vec<f64>,
    scratch: Vec<f64>,
}

impl Dynamics {
    /// Compiles a reduced model; the memory for its evaluation comes with it.
    pub fn new(reduced: &Reduced) -> (Self, Work) {
        let kinematics = Kinematics::new(reduced);
        let (r, equations) = (reduced.degrees_of_freedom(), &reduced.equations);
        let inertias = Directions::new(&equations.inertias, |x| x.to_f64(), &kinematics, r);
        let dampers = Directions::new(&equations.dampers, |x| x.to_f64(), &kinematics, r);
        let springs = Directions::new(&equations.springs, |x| x.stiffness.to_f64(), &kinematics, r);
        let frictions = Directions::new(&equations.frictions, |x| x.torque.to_f64(), &kinematics, r);
        let breakaway = |friction: &Along<FrictionLaw>| {
            let FrictionLaw { torque, stribeck } = &friction.value;
            stribeck.as_ref().map_or(torque, |stribeck| &stribeck.breakaway).to_f64()
        };
        let breakaways: Vec<f64> = equations.frictions.iter().map(breakaway).collect();
        let speed = |friction: &Along<FrictionLaw>| friction.value.stribeck.as_ref().map_or(1.0, |s| s.speed.to_f64());
        let stribeck = equations.frictions.iter().zip(&breakaways).zip(&frictions.coefficients);
        let stribeck = stribeck.map(|((friction, most), torque)| (most - torque, speed(friction))).collect();
        let inputs = Directions::new(&equations.inputs, |_| 1.0, &kinematics, r);
        let sum = |d: &Directions| {
            let mut out = Matrix::<f64>::zeros(r, r);
            for &k in &d.constant {
                out.add_outer(&d.coefficients[k], &d.template[k * r..(k + 1) * r]);
            }
            out.as_slice().to_vec()
        };
        let rests: Vec<f64> = equations.springs.iter().map(|spring| spring.value.rest.to_f64()).collect();
        // Constant springs: torque −s (g·q_r + a₀ − rest) with a₀ the twist at q_r = 0.
        let mut at_zero = kinematics.clone();
        at_zero.update(&vec![0.0; r], &vec![0.0; r]);
        let mut force_constant = vec![0.0; r];
        for &k in &springs.constant {
            let twist = along(&springs.rows[k], &at_zero.angles) - rests[k];
            for (force, g) in force_constant.iter_mut().zip(&springs.template[k * r..(k + 1) * r]) {
                *force -= springs.coefficients[k] * twist * g;
            }
        }
        let out = Self {
            degrees_of_freedom: r,
            inertia_constant: sum(&inertias),
            damping_constant: sum(&dampers),
            stiffness_constant: sum(&springs),
            force_constant,
            constant: inertias.varying.is_empty(),
            rests,
            inertias,
            dampers,
            springs,
            frictions,
            breakaways,
            stribeck,
            inputs,
        };
        let mut factor = Cholesky::new(r);
        factor.factor(&out.inertia_constant);
        let work = Work {
            kinematics,
            inertia: out.inertia_constant.clone(),
            factor,
            passive: vec![0.0; r],
            friction_rows: out.frictions.template.clone(),
            friction_bias: vec![0.0; out.frictions.rows.len()],
            input_rows: out.inputs.template.clone(),
            scratch: vec![0.0; r],
        };
        (out, work)
    }

    /// Number of friction directions.
    pub fn friction_count(&self) -> usize {
        self.frictions.rows.len()
    }

    /// Coulomb torques of the friction directions, N m.
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
        // Beyond, nothing is left, and `exp` would be slow to say so.
        if more == 0.0 || square > 700.0 { torque } else { torque + more * (-square).exp() }
    }

    /// Number of inputs.
    pub fn input_count(&self) -> usize {
        self.inputs.rows.len()
    }

    /// Evaluates kinematics, inertia, passive forces, friction and input directions at `q_r` (rad), `q̇_r` (rad/s).
    ///
    /// Returns whether the inertia is numerically positive definite. Allocates nothing.
    pub fn update(&self, position: &[f64], speed: &[f64], work: &mut Work) -> bool {
        let r = self.degrees_of_freedom;
        work.kinematics.update(position, speed);
        multiply(&self.damping_constant, speed, &mut work.passive);
        multiply(&self.stiffness_constant, position, &mut work.scratch);
        for i in 0..r {
            work.passive[i] = self.force_constant[i] - work.passive[i] - work.scratch[i];
        }
        let kinematics = &work.kinematics;
        for &k in &self.dampers.varying {
            project(&self.dampers.rows[k], kinematics, &mut work.scratch);
            let torque = self.dampers.coefficients[k] * dot(&work.scratch, speed);
            work.passive.iter_mut().zip(&work.scratch).for_each(|(force, g)| *force -= torque * g);
        }
        for &k in &self.springs.varying {
            project(&self.springs.rows[k], kinematics, &mut work.scratch);
            let twist = along(&self.springs.rows[k], &kinematics.angles) - self.rests[k];
            let torque = self.springs.coefficients[k] * twist;
            work.passive.iter_mut().zip(&work.scratch).for_each(|(force, g)| *force -= torque * g);
        }
        for &k in &self.frictions.varying {
            project(&self.frictions.rows[k], kinematics, &mut work.friction_rows[k * r..(k + 1) * r]);
            work.friction_bias[k] = along(&self.frictions.rows[k], &kinematics.bias);
        }
        for &k in &self.inputs.varying {
            project(&self.inputs.rows[k], kinematics, &mut work.input_rows[k * r..(k + 1) * r]);
        }
        if self.constant {
            return true;
        }
        work.inertia.copy_from_slice(&self.inertia_constant);
        for &k in &self.inertias.varying {
            project(&self.inertias.rows[k], kinematics, &mut work.scratch);
            let (inertia, bias) = (self.inertias.coefficients[k], along(&self.inertias.rows[k], &kinematics.bias));
            for i in 0..r {
                let scaled = inertia * work.scratch[i];
                work.passive[i] -= scaled * bias;
                for j in 0..r {
                    work.inertia[i * r + j] += scaled * work.scratch[j];
                }
            }
        }
        work.factor.factor(&work.inertia)
    }

    /// Kinetic and potential energy, J, at the last update.
    pub fn energy(&self, work: &Work) -> f64 {
        let kinematics = &work.kinematics;
        let kinetic = self.inertias.rows.iter().zip(&self.inertias.coefficients).map(|(row, inertia)| {
            let speed = along(row, &kinematics.speeds);
            0.5 * inertia * speed * speed
        });
        let potential =
            self.springs.rows.iter().zip(&self.springs.coefficients).zip(&self.rests).map(|((row, s), rest)| {
                let twist = along(row, &kinematics.angles) - rest;
                0.5 * s * twist * twist
            });
        kinetic.chain(potential).sum()
    }

    /// Power lost in the viscous dampers, W, at the last update.
    pub fn damping_power(&self, work: &Work) -> f64 {
        let loss = |(row, d): (&Vec<(usize, f64)>, &f64)| {
            let speed = along(row, &work.kinematics.speeds);
            d * speed * speed
        };
        self.dampers.rows.iter().zip(&self.dampers.coefficients).map(loss).sum()
    }

    /// Speed along an input direction, rad/s, at the last update.
    pub fn input_speed(&self, input: usize, work: &Work) -> f64 {
        along(&self.inputs.rows[input], &work.kinematics.speeds)
    }

    /// Angle along an input direction, rad, at the last update.
    pub fn input_angle(&self, input: usize, work: &Work) -> f64 {
        along(&self.inputs.rows[input], &work.kinematics.angles)
    }

    /// Speed along a friction direction, rad/s, at the last update.
    pub fn friction_speed(&self, friction: usize, work: &Work) -> f64 {
        along(&self.frictions.rows[friction], &work.kinematics.speeds)
    }

    /// Whether the coefficients of a friction direction change with the angles.
    pub fn friction_varies(&self, friction: usize) -> bool {
        self.frictions.varying.contains(&friction)
    }

    /// What may cancel in the speed of a friction direction, rad/s: `Σ |a_j K_ji v_i|` over shafts j and coordinates i, at the
    /// last update; `sizes` are the sizes of the reduced speeds. The speed itself is known to this times the unit roundoff.
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
            * (along(&self.springs.rows[spring], &work.kinematics.angles) - self.rests[spring])
    }

    /// Torque of a damper by its number, N m, at the last update: `d·aᵀq̇`.
    pub fn damper_torque(&self, damper: usize, work: &Work) -> f64 {
        self.dampers.coefficients[damper] * along(&self.dampers.rows[damper], &work.kinematics.speeds)
    }

    /// Generalised constraint force over all shafts, N m: `τ_c = H q̈ + D q̇ + S q + friction − F τ` \[diss. (4.36)\].
    ///
    /// `acceleration` is q̈_r, `inputs` the torques of the inputs, `frictions` the torque of each friction direction
    /// (positive in the sense of its direction's motion). Written to `out`, one entry per shaft.
    pub fn constraint_force(
        &self,
        work: &Work,
        acceleration: &[f64],
        inputs: &[f64],
        frictions: &[f64],
        out: &mut [f64],
    ) {
        let kinematics = &work.kinematics;
        out.fill(0.0);
        let mut add = |row: &[(usize, f64)], torque: f64| {
            for (shaft, c) in row {
                out[*shaft] += torque * c;
            }
        };
        for (row, inertia) in self.inertias.rows.iter().zip(&self.inertias.coefficients) {
            let acceleration: f64 = row
                .iter()
                .map(|(shaft, c)| c * (dot(kinematics.row(*shaft), acceleration) + kinematics.bias[*shaft]))
                .sum();
            add(row, inertia * acceleration);
        }
        for (row, d) in self.dampers.rows.iter().zip(&self.dampers.coefficients) {
            add(row, d * along(row, &kinematics.speeds));
        }
        for ((row, s), rest) in self.springs.rows.iter().zip(&self.springs.coefficients).zip(&self.rests) {
            add(row, s * (along(row, &kinematics.angles) - rest));
        }
        for (row, torque) in self.frictions.rows.iter().zip(frictions) {
            add(row, *torque);
        }
        for (row, torque) in self.inputs.rows.iter().zip(inputs) {
            add(row, -torque);
        }
    }
}
