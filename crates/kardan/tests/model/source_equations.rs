//! The numbered equations of the source that the code uses, one test each, against closed forms written out here and,
//! where the independent reference has the number, against that too (its origin is told in `tests/runs/golden.rs`).
//!
//! Exact comparisons are between fractions. Where floats are compared, a relative 1e-12 is asked: each value is a sum of
//! at most some fifty products, so that rounding stays below 50 · 2⁻⁵² ≈ 1e-14 of the largest term, and the largest term
//! is at most a hundred times the result. Golden numbers are printed with 16 digits, which fits the same bound.
//!
//! "Erratum" marks a formula that is wrong in print; the test shows that the printed one does not hold.

use crate::common::multipliers::Multipliers;
use crate::common::*;
use kardan::num::{Matrix, Rational};
use kardan::reduce::{Dynamics, LinearModel, Reduced, linearise};
use kardan::results::Pole;
use kardan::study::PreparedVariant;
use kardan::synthesis::{ChannelDesign, NoninteractingDesign, design_noninteracting, effective_inertia};
use kardan::synthesis::{LinearLaw, Observation, closed_loop_poles};

const TOLERANCE: f64 = 1e-12;

// ---- models with free parameters ----------------------------------------------------------------------------------

/// The harmonic drive of section 6.1.
struct Hd {
    i: Q,
    inertia: [Q; 3], // wg, cs, fs
    damping: [Q; 3],
    friction: [Q; 3],
}

impl Hd {
    /// Table 6.1; the dampings of the axes follow from (6.34).
    fn table() -> Self {
        Self {
            i: int(50),
            inertia: [frac(130, 1_000_000), frac(1_025_034, 100_000_000), frac(1_029_741, 100_000_000)],
            damping: [frac(251, 510_000), frac(-123, 10_000), frac(1, 51)],
            friction: [frac(361, 10_000), frac(1847, 10_000), frac(91, 10_000)],
        }
    }

    /// No two parameters alike, so that a mix-up shows.
    fn skew() -> Self {
        Self {
            i: frac(17, 3),
            inertia: [frac(1, 8), frac(3, 5), frac(7, 10)],
            damping: [frac(1, 9), frac(2, 7), frac(3, 11)],
            friction: [frac(1, 10), frac(2, 10), frac(3, 10)],
        }
    }

    fn text(&self) -> String {
        let mut out = "[model]\ncoordinates = [\"wg\", \"cs\"]\n".to_string();
        for (k, name) in ["wg", "cs", "fs"].iter().enumerate() {
            let (inertia, damping, friction) =
                (self.inertia[k].text(), self.damping[k].text(), self.friction[k].text());
            out += &format!(
                "[shaft.{name}]\ninertia = \"{inertia} kg m^2\"\ndamping = \"{damping} N m s/rad\"\n\
                 friction = \"{friction} N m\"\n[motor.{name}_motor]\nshaft = \"{name}\"\n"
            );
        }
        out + &format!(
            "[harmonic_drive.hd]\nwave_generator = \"wg\"\ncircular_spline = \"cs\"\nflexspline = \"fs\"\nratio = \"{}\"\n",
            self.i.text()
        )
    }

    /// n_HD (6.2), in the order (wg, cs, fs).
    fn n(&self) -> [Q; 3] {
        [int(1), -(self.i + int(1)), self.i]
    }

    /// Where (cs, fs, wg), the order of the library, stands in (wg, cs, fs).
    const SORTED: [usize; 3] = [1, 2, 0];
}

/// The harmonic drive with a spring, section 6.2.
struct Hds {
    i: Q,
    inertia: [Q; 4], // wg, cs, fs, rk
    damping: [Q; 4],
    ssp: Q,
    dsp: Q,
}

impl Hds {
    /// Table 6.3.
    fn table() -> Self {
        Self {
            i: int(50),
            inertia: [frac(1, 10_000), int(0), frac(1, 20), frac(1, 20)],
            damping: [frac(1, 2000), int(0), frac(1, 100), frac(1, 100)],
            ssp: int(100),
            dsp: frac(1, 100),
        }
    }

    fn skew() -> Self {
        Self {
            i: frac(17, 3),
            inertia: [frac(1, 8), frac(3, 5), frac(7, 10), frac(2, 3)],
            damping: [frac(1, 9), frac(2, 7), frac(3, 11), frac(1, 6)],
            ssp: frac(13, 2),
            dsp: frac(1, 12),
        }
    }

    fn text(&self) -> String {
        let mut out = "[model]\ncoordinates = [\"wg\", \"rk\", \"fs\"]\n".to_string();
        for (k, name) in ["wg", "cs", "fs", "rk"].iter().enumerate() {
            let (inertia, damping) = (self.inertia[k].text(), self.damping[k].text());
            out += &format!("[shaft.{name}]\ninertia = \"{inertia} kg m^2\"\ndamping = \"{damping} N m s/rad\"\n");
        }
        out + &format!(
            "[harmonic_drive.hd]\nwave_generator = \"wg\"\ncircular_spline = \"cs\"\nflexspline = \"fs\"\nratio = \"{}\"\n\
             [spring_damper.torsion_bar]\nshaft_1 = \"cs\"\nshaft_2 = \"rk\"\nstiffness = \"{} N m/rad\"\n\
             damping = \"{} N m s/rad\"\n[motor.a_wg]\nshaft = \"wg\"\n[motor.b_rk]\nshaft = \"rk\"\n",
            self.i.text(),
            self.ssp.text(),
            self.dsp.text()
        )
    }
}

/// The steering system, section 6.3. Coordinates (rk, fs, cj).
struct Sia {
    i: Q,
    jwg: Q,
    jcs: Q,
    jfs: Q,
    jcj: Q,
    jrk: Q,
    dwg: Q,
    dcs: Q,
    dfs: Q,
    dcj: Q,
    drk: Q,
    ssp: Q,
    dsp: Q,
    cwg: Q,
    ccs: Q,
    cfs: Q,
    ccj: Q,
    crk: Q,
}

impl Sia {
    /// Table 6.4.
    fn table() -> Self {
        Self {
            i: int(50),
            jwg: frac(50, 1_000_000),
            jcs: frac(100, 1_000_000),
            jfs: frac(1, 20),
            jcj: frac(10, 1_000_000),
            jrk: frac(1, 20),
            dwg: frac(5, 10_000),
            dcs: frac(5, 10_000),
            dfs: frac(1, 10),
            dcj: frac(1, 10_000),
            drk: frac(1, 100),
            ssp: int(100),
            dsp: frac(2, 100),
            cwg: frac(5, 10_000),
            ccs: frac(1, 10_000),
            cfs: frac(2, 10),
            ccj: frac(1, 10_000),
            crk: frac(1, 100),
        }
    }

    /// No two parameters alike.
    fn skew() -> Self {
        Self {
            i: frac(9, 2),
            jwg: frac(1, 10),
            jcs: frac(1, 3),
            jfs: frac(3, 4),
            jcj: frac(1, 5),
            jrk: frac(5, 4),
            dwg: frac(1, 20),
            dcs: frac(1, 8),
            dfs: frac(1, 6),
            dcj: frac(1, 25),
            drk: frac(1, 16),
            ssp: frac(15, 2),
            dsp: frac(3, 40),
            cwg: frac(1, 2),
            ccs: frac(1, 3),
            cfs: frac(1, 4),
            ccj: frac(1, 5),
            crk: frac(1, 7),
        }
    }

    fn both() -> [Self; 2] {
        [Self::table(), Self::skew()]
    }

    fn text(&self, joint: &str) -> String {
        let mut out = "[model]\ncoordinates = [\"rk\", \"fs\", \"cj\"]\n".to_string();
        for (name, inertia, damping, friction) in [
            ("wg", self.jwg, self.dwg, self.cwg),
            ("cs", self.jcs, self.dcs, self.ccs),
            ("fs", self.jfs, self.dfs, self.cfs),
            ("cj", self.jcj, self.dcj, self.ccj),
            ("rk", self.jrk, self.drk, self.crk),
        ] {
            out += &format!(
                "[shaft.{name}]\ninertia = \"{} kg m^2\"\ndamping = \"{} N m s/rad\"\nfriction = \"{} N m\"\n",
                inertia.text(),
                damping.text(),
                friction.text()
            );
        }
        out += &format!(
            "[harmonic_drive.hd]\nwave_generator = \"wg\"\ncircular_spline = \"cs\"\nflexspline = \"fs\"\nratio = \"{}\"\n\
             [universal_joint.cardan]\nshaft_1 = \"cj\"\nshaft_2 = \"cs\"\n{joint}\n\
             [spring_damper.bar]\nshaft_1 = \"rk\"\nshaft_2 = \"cj\"\nstiffness = \"{} N m/rad\"\n\
             damping = \"{} N m s/rad\"\n",
            self.i.text(),
            self.ssp.text(),
            self.dsp.text()
        );
        out += "\
[motor.driver]
shaft = \"fs\"
[motor.rk_motor]
shaft = \"rk\"
[motor.wg_motor]
shaft = \"wg\"
[control.column]
law = \"noninteracting\"
[[control.column.channels]]
output = \"rk.phi\"
input = \"rk_motor\"
kind = \"position\"
natural_frequency = \"20 rad/s\"
damping_ratio = 0.7
reference = \"ref_rk\"
load = \"load_rk\"
[[control.column.channels]]
output = \"fs.phi\"
input = \"wg_motor\"
kind = \"torque\"
reference = \"u2\"
[control.driver_model]
law = \"position_loop\"
output = \"fs.phi\"
input = \"driver\"
natural_frequency = \"20 rad/s\"
damping_ratio = 0.7
reference = \"ref_fs\"
load = \"load_fs\"
";
        out
    }

    fn straight(&self) -> std::sync::Arc<PreparedVariant> {
        first(&self.text("angle = \"0 deg\""))
    }

    fn bent(&self, degrees: f64) -> Reduced {
        first(&self.text(&format!("angle = \"{degrees} deg\""))).reduced.clone()
    }

    fn linear(&self) -> LinearModel {
        linearise(&self.straight().reduced, &[0.0; 3])
    }

    /// Jcj + Jcs.
    fn jc(&self) -> Q {
        self.jcj + self.jcs
    }

    /// (6.127)
    fn jcj_effective(&self) -> Q {
        self.jcj + self.jcs + (self.i + int(1)) * (self.i + int(1)) * self.jwg
    }

    /// (6.129)
    fn jfs_effective(&self) -> Q {
        self.jfs + self.jc() / self.jcj_effective() * self.i * self.i * self.jwg
    }

    /// (6.122c)
    fn dcjcj(&self) -> Q {
        self.dcs + self.dcj + (self.i + int(1)) * (self.i + int(1)) * self.dwg + self.dsp
    }

    /// (6.122a)
    fn h(&self) -> Exact {
        let (i, j) = (self.i, self.i + int(1));
        vec![
            vec![self.jrk, int(0), int(0)],
            vec![int(0), self.jfs + i * i * self.jwg, -(i * j * self.jwg)],
            vec![int(0), -(i * j * self.jwg), self.jcj + self.jcs + j * j * self.jwg],
        ]
    }

    /// (6.122b)
    fn d(&self) -> Exact {
        let (i, j) = (self.i, self.i + int(1));
        vec![
            vec![self.drk + self.dsp, int(0), -self.dsp],
            vec![int(0), self.dfs + i * i * self.dwg, -(i * j * self.dwg)],
            vec![-self.dsp, -(i * j * self.dwg), self.dcjcj()],
        ]
    }

    /// (6.122d)
    fn s(&self) -> Exact {
        let (s, o) = (self.ssp, int(0));
        vec![vec![s, o, -s], vec![o, o, o], vec![-s, o, s]]
    }

    /// (6.122e), columns (fs, wg, rk).
    fn f(&self) -> Exact {
        let (o, one) = (int(0), int(1));
        vec![vec![o, o, one], vec![one, -self.i, o], vec![o, self.i + one, o]]
    }

    /// Gains of (6.130) on (rk, fs, cj, rk', fs', cj') and on u2; `sign` is that of the term with φ̇_rk: −1 is right, +1
    /// is printed.
    fn wave_generator_gains(&self, sign: i128) -> (Vec<Q>, Q) {
        let (i, j, t) = (self.i, self.i + int(1), self.jcj_effective());
        let outer = -(j * t / self.jc());
        let inner = [
            -(self.jwg / t * self.ssp),
            int(0),
            self.jwg / t * self.ssp,
            int(sign) * self.jwg / t * self.dsp,
            (self.dfs + self.jc() / t * i * i * self.dwg) / (i * j),
            self.jwg / t * self.dcjcj() - self.dwg,
        ];
        (inner.iter().map(|x| outer * *x).collect(), outer / (i * j))
    }

    /// Gains of (6.124) on the state; on u1 it is Jrk.
    fn rack_gains(&self) -> Vec<Q> {
        vec![self.ssp, int(0), -self.ssp, self.drk + self.dsp, int(0), -self.dsp]
    }

    /// The design of the library, inputs (wg, rk), channels (fs, rk).
    fn design(&self) -> NoninteractingDesign {
        let variant = self.straight();
        let model = linearise(&variant.reduced, &[0.0; 3]);
        let input = |name: &str| model.inputs.iter().position(|input| input == name).expect("an input");
        let shaft = |name: &str| variant.reduced.coordinate(name).expect("a shaft");
        let channels = [
            ChannelDesign { shaft: shaft("fs"), input: input("wg_motor") },
            ChannelDesign { shaft: shaft("rk"), input: input("rk_motor") },
        ];
        let names = |_: &ChannelDesign| (String::new(), String::new());
        design_noninteracting(&model, &channels, &names).expect("the steering system can be decoupled")
    }

    /// `H⁻¹ (F Kx − [S D])` and `H⁻¹ F [Ku for (u1, u2), Tfs]`: the accelerations of (rk, fs, cj) in closed loop.
    fn closed_loop(&self, sign: i128) -> (Exact, Exact) {
        let (wave_generator, on_u2) = self.wave_generator_gains(sign);
        let zero = vec![int(0); 6];
        let feedback = product(&self.f(), &vec![zero, wave_generator, self.rack_gains()]);
        let passive: Exact = self.s().iter().zip(self.d()).map(|(s, d)| [s.as_slice(), &d].concat()).collect();
        let inverse = inverse(&self.h());
        let (o, one) = (int(0), int(1));
        let inputs = vec![vec![o, o, one], vec![o, on_u2, o], vec![self.jrk, o, o]];
        (product(&inverse, &difference(&feedback, &passive)), product(&inverse, &product(&self.f(), &inputs)))
    }

    /// (6.133): the coefficients d̃_cj,rk, d̃_cj,fs, d̃_cj,cj, s̃, f̃2, f̃fs, corrected or as printed.
    fn coefficients(&self, printed: bool) -> [Q; 6] {
        let (i, j, t, c) = (self.i, self.i + int(1), self.jcj_effective(), self.jc());
        let cross = if printed { j * j * self.jwg / c } else { -(t / c) * self.dsp };
        let wheel = j / i * (t / c * self.dfs + if printed { i * i * self.dwg } else { int(0) });
        let own = j * j * (self.jwg * self.dcjcj() - t * self.dwg) / c + if printed { int(0) } else { self.dcjcj() };
        [
            cross,
            wheel,
            own,
            (int(1) + j * j * self.jwg / c) * self.ssp,
            -(j / i) * self.jfs * t / (self.jfs_effective() * c),
            i * j * self.jwg / self.jfs_effective(),
        ]
    }
}

fn column(model: &LinearModel, name: &str) -> Vec<Rational> {
    let k = model.inputs.iter().position(|input| input == name).expect("an input");
    (0..model.input.rows()).map(|i| model.input[(i, k)].clone()).collect()
}

/// Columns of the input matrix by name.
fn columns(model: &LinearModel, names: &[&str]) -> Matrix<Rational> {
    let columns: Vec<Vec<Rational>> = names.iter().map(|name| column(model, name)).collect();
    Matrix::from_fn(model.input.rows(), names.len(), |i, j| columns[j][i].clone())
}

fn exact_row(matrix: &Matrix<Rational>, shaft: usize) -> Vec<Rational> {
    (0..matrix.columns()).map(|j| matrix[(shaft, j)].clone()).collect()
}

/// Sum and product of a conjugate pair.
fn sum_and_product(pair: &[Pole]) -> (f64, f64) {
    let [a, b] = pair else { panic!("not a pair: {pair:?}") };
    (a.re + b.re, a.re * b.re - a.im * b.im)
}

// ---- chapter 4 ----------------------------------------------------------------------------------------------------

/// (4.3): q1 − i q2 + q0 = 0, as a row and as a motion.
#[test]
fn eq_4_3_gear() {
    let variant = first(
        "[shaft.a]\n[shaft.b]\ninertia = \"1 kg m^2\"\n[gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = \"-7/3\"\n\
         offset = \"0.5 rad\"",
    );
    let [row] = variant.reduced.equations.constraints.as_slice() else { panic!("one constraint") };
    assert_eq!(row.row, [(0, int(1).rational()), (1, frac(7, 3).rational())]);
    assert_eq!(row.value.to_f64(), -0.5);
    let (dynamics, mut work) = Dynamics::new(&variant.reduced);
    dynamics.update(&[2.0], &[3.0], &mut work);
    let (q1, q2) = (work.kinematics.angles[0], work.kinematics.angles[1]);
    close(q1 + 7.0 / 3.0 * q2 + 0.5, 0.0, TOLERANCE, "(4.3)");
    close(work.kinematics.speeds[0] + 7.0 / 3.0 * work.kinematics.speeds[1], 0.0, TOLERANCE, "its derivative (4.6)");
}

/// (4.11)-(4.14): q̇ = K q̇_r and q̈ = K q̈_r + k along a curve q_r(t), against differences of γ(q_r(t)).
///
/// Central differences with h = 1e-4: truncation h²/6 · 10⁴ ≈ 2e-5 of the fourth derivatives here, rounding 1e-8; both
/// sides are of the order of 100, so that 1e-5 is asked.
#[test]
fn eq_4_11_to_4_14_explicit_velocity_and_acceleration() {
    let reduced = Sia::skew().bent(35.0);
    let (dynamics, mut work) = Dynamics::new(&reduced);
    let (start, v, a) = ([0.3, -0.7, 1.1], [0.9, -1.3, 2.0], [-2.0, 1.0, 0.5]);
    let position = |t: f64| -> Vec<f64> { (0..3).map(|k| start[k] + t * v[k] + 0.5 * t * t * a[k]).collect() };
    let mut angles = |t: f64| {
        dynamics.update(&position(t), &v, &mut work);
        (
            work.kinematics.angles.clone(),
            work.kinematics.speeds.clone(),
            work.kinematics.bias.clone(),
            work.kinematics.basis.clone(),
        )
    };
    let h = 1e-4;
    let ((before, ..), (now, speeds, bias, basis), (after, ..)) = (angles(-h), angles(0.0), angles(h));
    for shaft in 0..5 {
        let first = (after[shaft] - before[shaft]) / (2.0 * h);
        let second = (after[shaft] - 2.0 * now[shaft] + before[shaft]) / (h * h);
        close(speeds[shaft], first, 1e-5, "(4.11)");
        close(dot(&basis[3 * shaft..3 * shaft + 3], &a) + bias[shaft], second, 1e-5, "(4.12)");
    }
    assert!(bias.iter().any(|k| k.abs() > 0.1), "the bias takes part");
}

/// The implicit Jacobian of the steering system (6.107) and its bias (4.9), in the order of the library
/// (cj, cs, fs, rk, wg), written with the derivative of (6.106) as a function of φ_cs.
fn steering_constraints(i: f64, c: f64, angles: &[f64], speeds: &[f64]) -> (Vec<Vec<f64>>, Vec<f64>) {
    let (sin, cos) = angles[1].sin_cos();
    let r = cos * cos + c * c * sin * sin;
    let jacobian = vec![vec![0.0, -(i + 1.0), i, 0.0, 1.0], vec![1.0, -c / r, 0.0, 0.0, 0.0]];
    let bias = c * (c * c - 1.0) * 2.0 * sin * cos / (r * r) * speeds[1] * speeds[1];
    (jacobian, vec![0.0, bias])
}

/// (4.15): c∘γ = 0, J K = 0 and J k + j = 0 in the steering system with a bent joint.
#[test]
fn eq_4_15_implicit_and_explicit_constraints_agree() {
    let sia = Sia::skew();
    let reduced = sia.bent(35.0);
    let (dynamics, mut work) = Dynamics::new(&reduced);
    for k in 0..20 {
        let position = [0.3, 0.7 * f64::from(k) - 5.0, 0.9 * f64::from(k) - 8.0];
        dynamics.update(&position, &[1.0, -2.0, 3.0], &mut work);
        let kin = &work.kinematics;
        let c = 35.0_f64.to_radians().cos();
        let (jacobian, bias) = steering_constraints(sia.i.f64(), c, &kin.angles, &kin.speeds);
        // (4.15a), with the joint in the form (6.100).
        close(
            dot(&jacobian[0], &kin.angles),
            0.0,
            TOLERANCE * 100.0,
            "c(γ) of the harmonic drive, angles up to 50 rad",
        );
        let (cj, cs) = (kin.angles[0], kin.angles[1]);
        close(cj.sin() * cs.cos() - c * cj.cos() * cs.sin(), 0.0, TOLERANCE, "c(γ) of the joint");
        for (row, j) in jacobian.iter().zip(&bias) {
            for column in 0..3 {
                let basis: Vec<f64> = (0..5).map(|shaft| kin.row(shaft)[column]).collect();
                close(dot(row, &basis), 0.0, TOLERANCE, "(4.15b)");
            }
            close(dot(row, &kin.bias) + j, 0.0, TOLERANCE * 10.0, "(4.15c), biases up to 10 rad/s²");
        }
    }
}

/// (4.19) assembled and solved here against (4.23), and the multipliers (4.18), of the steering system.
#[test]
fn eq_4_19_implicit_and_4_23_explicit_agree() {
    let sia = Sia::skew();
    let reduced = sia.bent(35.0);
    let (dynamics, mut work) = Dynamics::new(&reduced);
    let (position, speed, inputs) = ([0.3, -0.7, 1.1], [2.0, -3.0, 5.0], [0.7, -1.9, 3.1]);
    dynamics.update(&position, &speed, &mut work);
    let result = explicit(&reduced, &dynamics, &work, &inputs, &[0.0; 5]);
    let kin = &work.kinematics;
    let (jacobian, bias) = steering_constraints(sia.i.f64(), 35.0_f64.to_radians().cos(), &kin.angles, &kin.speeds);
    let inertia = [sia.jcj, sia.jcs, sia.jfs, sia.jrk, sia.jwg].map(Q::f64);
    let damping = [sia.dcj, sia.dcs, sia.dfs, sia.drk, sia.dwg].map(Q::f64);
    let bar = sia.ssp.f64() * (kin.angles[3] - kin.angles[0]) + sia.dsp.f64() * (kin.speeds[3] - kin.speeds[0]);
    let external = [bar, 0.0, inputs[0], inputs[1] - bar, inputs[2]];
    let mut matrix = vec![vec![0.0; 7]; 7];
    let mut right = vec![0.0; 7];
    for s in 0..5 {
        matrix[s][s] = inertia[s];
        right[s] = external[s] - damping[s] * kin.speeds[s];
    }
    for (k, row) in jacobian.iter().enumerate() {
        right[5 + k] = -bias[k];
        for s in 0..5 {
            matrix[s][5 + k] = row[s];
            matrix[5 + k][s] = row[s];
        }
    }
    let solution = solve(&matrix, &right);
    let mut multipliers = Multipliers::new(&reduced);
    assert_eq!(multipliers.elements, ["hd", "cardan"]);
    let mut lambda = [0.0; 2];
    multipliers.solve(kin, &result.force, &mut lambda);
    for s in 0..5 {
        close(result.shafts[s], solution[s], TOLERANCE, "acceleration");
    }
    for k in 0..2 {
        close(lambda[k], -solution[5 + k], TOLERANCE, "multiplier; (4.19) holds −λ");
        for s in 0..5 {
            close(multipliers.coefficient(k, s, kin), jacobian[k][s], TOLERANCE, "(6.107)");
        }
    }
    // (4.22): Kᵀ τ_c = 0, and (4.17): no power.
    for column in 0..3 {
        let sum: f64 = (0..5).map(|s| kin.row(s)[column] * result.force[s]).sum();
        close(sum, 0.0, TOLERANCE * 10.0, "(4.22), constraint torques up to 30 N m");
    }
    close(dot(&result.force, &kin.speeds), 0.0, TOLERANCE * 100.0, "(4.17), shares of the power up to 500 W");
}

/// (4.26): the block system of reduced accelerations and constraint torques, built from the library's reduced form.
#[test]
fn eq_4_26_accelerations_with_constraint_torques() {
    let sia = Sia::skew();
    let reduced = sia.bent(35.0);
    let (dynamics, mut work) = Dynamics::new(&reduced);
    let inputs = [0.7, -1.9, 3.1];
    dynamics.update(&[0.3, -0.7, 1.1], &[2.0, -3.0, 5.0], &mut work);
    let result = explicit(&reduced, &dynamics, &work, &inputs, &[0.0; 5]);
    let kin = &work.kinematics;
    let inertia = [sia.jcj, sia.jcs, sia.jfs, sia.jrk, sia.jwg].map(Q::f64);
    let damping = [sia.dcj, sia.dcs, sia.dfs, sia.drk, sia.dwg].map(Q::f64);
    let bar = sia.ssp.f64() * (kin.angles[3] - kin.angles[0]) + sia.dsp.f64() * (kin.speeds[3] - kin.speeds[0]);
    let external = [bar, 0.0, inputs[0], inputs[1] - bar, inputs[2]];
    let mut matrix = vec![vec![0.0; 8]; 8];
    let mut right = vec![0.0; 8];
    for i in 0..3 {
        right[i] = work.passive[i] + (0..3).map(|k| inputs[k] * work.input_rows[3 * k + i]).sum::<f64>();
        matrix[i][..3].copy_from_slice(&work.inertia[3 * i..3 * i + 3]);
    }
    for s in 0..5 {
        right[3 + s] = kin.bias[s] + (damping[s] * kin.speeds[s] - external[s]) / inertia[s];
        matrix[3 + s][3 + s] = 1.0 / inertia[s];
        for column in 0..3 {
            matrix[3 + s][column] = -kin.row(s)[column];
        }
    }
    let solution = solve(&matrix, &right);
    for i in 0..3 {
        close(result.reduced[i], solution[i], TOLERANCE, "q̈_r");
    }
    for s in 0..5 {
        close(result.force[s], solution[3 + s], TOLERANCE, "τ_c");
    }
}

/// (4.34): the columns of K span ker C, and (4.39), (4.38) are congruences with it, exactly.
#[test]
fn eq_4_34_basis_and_eq_4_39_congruence() {
    let hds = Hds::skew();
    let variant = first(&hds.text());
    let equations = &variant.reduced.equations;
    let model = linearise(&variant.reduced, &[0.0; 3]);
    let zero = equations.constraint_matrix().multiply(&model.basis);
    assert!(zero.as_slice().iter().all(|x| *x == Rational::ZERO), "C K = 0");
    for (name, reduced, full) in [
        ("(4.39a)", &model.inertia, equations.inertia_matrix()),
        ("(4.39b)", &model.damping, equations.damping_matrix()),
        ("(4.39c)", &model.stiffness, equations.stiffness_matrix()),
    ] {
        // Entry by entry: Σ K_si M_st K_tj.
        for i in 0..3 {
            for j in 0..3 {
                let mut sum = Rational::ZERO;
                for s in 0..4 {
                    for t in 0..4 {
                        sum += &model.basis[(s, i)] * &full[(s, t)] * &model.basis[(t, j)];
                    }
                }
                assert_eq!(reduced[(i, j)], sum, "{name} ({i}, {j})");
            }
        }
        assert_eq!(full, full.transpose(), "(4.27)-(4.29): symmetric");
    }
    assert_eq!(model.input, model.basis.transpose().multiply(&equations.input_matrix()), "(4.38)");
}

/// P = Cᵀ (C H⁻¹ Cᵀ)⁻¹ C H⁻¹ (4.56), exact, from the matrices of the library.
fn projector(reduced: &Reduced) -> (Matrix<Rational>, Matrix<Rational>) {
    let (c, h) = (reduced.equations.constraint_matrix(), reduced.equations.inertia_matrix());
    let weighted = h.solve(&c.transpose()).expect("no massless shaft").transpose(); // C H⁻¹
    let generalised = weighted.multiply(&c.transpose()).solve(&weighted).expect("lemma 4.1");
    (c.transpose().multiply(&generalised), generalised)
}

/// Theorem 4.5 and (4.57), (4.58): P² = P and Pᵀ K = 0, exactly.
#[test]
fn theorem_4_5_projector_idempotent() {
    for reduced in [
        Sia::table().straight().reduced.clone(),
        Sia::skew().straight().reduced.clone(),
        first(&Hd::skew().text()).reduced.clone(),
    ] {
        let (p, _) = projector(&reduced);
        assert_eq!(p.multiply(&p), p, "(4.57)");
        let basis = linearise(&reduced, &vec![0.0; reduced.degrees_of_freedom()]).basis;
        let zero = p.transpose().multiply(&basis);
        assert!(zero.as_slice().iter().all(|x| *x == Rational::ZERO), "(4.58)");
    }
}

/// (4.56) for the steering system against the reference, which has the order (fs, cs, wg, cj, rk).
#[test]
fn eq_4_56_projector_of_the_steering_system() {
    let reduced = Sia::table().straight().reduced.clone();
    let (p, _) = projector(&reduced);
    let order = ["fs", "cs", "wg", "cj", "rk"].map(|name| reduced.coordinate(name).expect("a shaft"));
    let sorted = Matrix::from_fn(5, 5, |i, j| p[(order[i], order[j])].clone());
    agrees(&sorted, &rows(&golden()["sia"]["projector_P_5x5"]), TOLERANCE, "P");
}

/// (4.53) and (4.55): multipliers and constraint torques of the library are the projection
/// `τ_c = −P (F τ − D q̇ − S q)`.
#[test]
fn eq_4_53_multipliers_and_eq_4_55_constraint_torque_projector() {
    let sia = Sia::skew();
    let reduced = sia.straight().reduced.clone();
    let (p, generalised) = projector(&reduced);
    let equations = &reduced.equations;
    let (dynamics, mut work) = Dynamics::new(&reduced);
    let inputs = [0.7, -1.9, 3.1];
    dynamics.update(&[0.3, -0.7, 1.1], &[2.0, -3.0, 5.0], &mut work);
    let result = explicit(&reduced, &dynamics, &work, &inputs, &[0.0; 5]);
    let kin = &work.kinematics;
    let (d, s, f) = (equations.damping_matrix(), equations.stiffness_matrix(), equations.input_matrix());
    let rows_of = |m: &Matrix<Rational>| m.to_rows();
    let load: Vec<f64> = (0..5)
        .map(|k| dot(&rows_of(&f)[k], &inputs) - dot(&rows_of(&d)[k], &kin.speeds) - dot(&rows_of(&s)[k], &kin.angles))
        .collect();
    let mut lambda = [0.0; 2];
    Multipliers::new(&reduced).solve(kin, &result.force, &mut lambda);
    for k in 0..2 {
        close(lambda[k], -dot(&rows_of(&generalised)[k], &load), TOLERANCE * 10.0, "(4.53), torques up to 100 N m");
    }
    for k in 0..5 {
        close(result.force[k], -dot(&rows_of(&p)[k], &load), TOLERANCE * 10.0, "(4.55), torques up to 100 N m");
    }
}

/// Erratum (4.54): with `Cᵀλ = F τ − D q̇ − S q` as printed, λ has the wrong sign and the shafts leave the constraint.
#[test]
fn erratum_4_54_the_printed_sign_leaves_the_constraint() {
    let reduced = first(&Hd::skew().text()).reduced.clone();
    let (c, h) = (reduced.equations.constraint_matrix(), reduced.equations.inertia_matrix());
    let (_, generalised) = projector(&reduced);
    let load = Matrix::from_fn(3, 1, |i, _| int([5, -7, 11][i]).rational());
    let printed = generalised.multiply(&load);
    let corrected = printed.scale(&int(-1).rational());
    let residual = |lambda: &Matrix<Rational>| {
        let acceleration = h.solve(&c.transpose().multiply(lambda).plus(&load)).expect("no massless shaft");
        c.multiply(&acceleration)[(0, 0)].clone()
    };
    assert_eq!(residual(&corrected), Rational::ZERO);
    assert_ne!(residual(&printed), Rational::ZERO);
    // The library has the corrected one: at rest, with these torques on (cs, fs, wg).
    let (dynamics, mut work) = Dynamics::new(&reduced);
    dynamics.update(&[0.0; 2], &[0.0; 2], &mut work);
    let result = explicit(&reduced, &dynamics, &work, &[5.0, -7.0, 11.0], &[0.0; 3]);
    let mut lambda = [0.0];
    Multipliers::new(&reduced).solve(&work.kinematics, &result.force, &mut lambda);
    close(lambda[0], corrected.to_f64()[(0, 0)], TOLERANCE, "λ");
}

// ---- section 6.1: the harmonic drive ------------------------------------------------------------------------------

/// (6.1), (6.2), (6.4): the row (1, −(i+1), i) with the mounting offset.
#[test]
fn eq_6_1_constraint_of_the_harmonic_drive() {
    let hd = Hd::skew();
    let reduced = first(&(hd.text() + "offset = \"0.25 rad\"\n")).reduced.clone();
    let c = reduced.equations.constraint_matrix();
    same(&c, &[Hd::SORTED.map(|k| hd.n()[k]).to_vec()], "n_HD in the order (cs, fs, wg)");
    let (dynamics, mut work) = Dynamics::new(&reduced);
    dynamics.update(&[0.4, -1.3], &[1.0, 2.0], &mut work);
    let q = &work.kinematics.angles;
    close(q[2] - 20.0 / 3.0 * q[0] + 17.0 / 3.0 * q[1] + 0.25, 0.0, TOLERANCE * 10.0, "(6.1), terms up to 10 rad");
}

/// (6.10): K with the coordinates (wg, cs).
#[test]
fn eq_6_10_basis_of_the_harmonic_drive() {
    let hd = Hd::skew();
    let model = linearise(&first(&hd.text()).reduced, &[0.0; 2]);
    let (o, one) = (int(0), int(1));
    let closed = vec![vec![o, one], vec![-(one / hd.i), (hd.i + one) / hd.i], vec![one, o]];
    same(&model.basis, &closed, "K in the order (cs, fs, wg)");
}

/// (6.12): H_r, D_r and F_r as exact fractions, and against the reference for Table 6.1.
#[test]
fn eq_6_12_reduced_harmonic_drive() {
    for hd in [Hd::table(), Hd::skew()] {
        let model = linearise(&first(&hd.text()).reduced, &[0.0; 2]);
        let (i, j) = (hd.i, hd.i + int(1));
        let form = |[wg, cs, fs]: [Q; 3]| {
            let cross = -(j / (i * i) * fs);
            vec![vec![wg + fs / (i * i), cross], vec![cross, cs + j / i * (j / i) * fs]]
        };
        same(&model.inertia, &form(hd.inertia), "(6.12a)");
        same(&model.damping, &form(hd.damping), "(6.12b)");
        let input = vec![vec![int(1), int(0), -(int(1) / i)], vec![int(0), int(1), j / i]];
        same(&columns(&model, &["wg_motor", "cs_motor", "fs_motor"]), &input, "(6.12c)");
    }
    let (model, golden) = (linearise(&first(&Hd::table().text()).reduced, &[0.0; 2]), golden());
    agrees(&model.inertia, &rows(&golden["hd"]["Hr"]), TOLERANCE, "hd.Hr");
    agrees(&model.damping, &rows(&golden["hd"]["Dr"]), TOLERANCE, "hd.Dr");
    // The built-in model is the one of Table 6.1.
    let builtin =
        linearise(&first(kardan::model::builtin("harmonic-drive").expect("built in").source).reduced, &[0.0; 2]);
    assert_eq!((builtin.inertia, builtin.damping), (model.inertia, model.damping));
}

/// (6.14), (6.15): constraint torques along n_HD, friction torques included.
///
/// Erratum (6.14), (6.16), (6.25): the damping term is D K q̇_r; `D q̇_r` as printed is a 3×3 matrix times a pair.
#[test]
fn eq_6_14_constraint_torques_of_the_harmonic_drive() {
    let hd = Hd::skew();
    let reduced = first(&hd.text()).reduced.clone();
    let (dynamics, mut work) = Dynamics::new(&reduced);
    let (inputs, frictions) = ([0.7, -1.9, 3.1], [0.2, -0.3, 0.1]);
    dynamics.update(&[0.3, -0.7], &[2.0, -3.0], &mut work);
    let result = explicit(&reduced, &dynamics, &work, &inputs, &frictions);
    let [n, inertia, damping] = [hd.n(), hd.inertia, hd.damping].map(|x| Hd::SORTED.map(|k| x[k].f64()));
    let speeds = &work.kinematics.speeds;
    let load = |s: usize| inputs[s] - frictions[s] - damping[s] * speeds[s];
    let above: f64 = (0..3).map(|s| n[s] / inertia[s] * load(s)).sum();
    let below: f64 = (0..3).map(|s| n[s] * n[s] / inertia[s]).sum();
    for s in 0..3 {
        close(result.force[s], -above / below * n[s], TOLERANCE * 10.0, "(6.14), torques up to 10 N m");
    }
}

/// (6.34) for Table 6.1: the dampings of the axes behind the identified d11, d12, d22. The circular spline's is
/// negative, and the model is accepted with a warning because D_r is positive definite.
#[test]
fn eq_6_34_damping_of_axes_table_6_1() {
    let (d11, d12, d22, i) = (frac(5, 10_000), frac(-4, 10_000), frac(81, 10_000), int(50));
    let j = i + int(1);
    let dfs = -(d12 * i * i / j);
    let dwg = d11 - dfs / (i * i);
    let dcs = d22 - j / i * (j / i) * dfs;
    assert_eq!([dwg, dcs, dfs], Hd::table().damping);
    let golden = golden();
    for (name, value) in [("dwg", dwg), ("dcs", dcs), ("dfs", dfs)] {
        close(value.f64(), golden["hd"]["axis_damping"][name].as_f64().expect("a number"), TOLERANCE, name);
    }
    let (_, diagnostics) = kardan::study::prepare(kardan::model::builtin("harmonic-drive").expect("built in").source);
    assert_eq!(diagnostics.iter().map(|d| d.code).collect::<Vec<_>>(), ["damping::negative"]);
    let model = linearise(&first(&Hd::table().text()).reduced, &[0.0; 2]);
    same(&model.damping, &[vec![d11, d12], vec![d12, d22]], "back to the identified ones");
}

/// (6.38): the Coulomb torques in reduced coordinates are K_HDᵀ F_HD,C.
///
/// Erratum (6.38): the transpose is missing in print (the matrix printed is right).
#[test]
fn eq_6_38_coulomb_friction_of_the_harmonic_drive() {
    let reduced = first(&Hd::table().text()).reduced.clone();
    let (dynamics, mut work) = Dynamics::new(&reduced);
    dynamics.update(&[0.0; 2], &[0.0; 2], &mut work);
    let expected = rows(&golden()["hd"]["FCr"]);
    // Columns of the reference: wg, cs, fs; friction directions of the library: cs, fs, wg.
    for (direction, column) in Hd::SORTED.iter().enumerate() {
        for i in 0..2 {
            let value = work.friction_rows[2 * direction + i] * dynamics.friction_torques()[direction];
            close(value, expected[i][*column], TOLERANCE, "F_C,r");
        }
    }
}

// ---- section 6.2: the harmonic drive with a spring ----------------------------------------------------------------

/// (6.53): K with the coordinates (wg, rk, fs).
#[test]
fn eq_6_53_hds_basis() {
    let hds = Hds::skew();
    let model = linearise(&first(&hds.text()).reduced, &[0.0; 3]);
    let (o, one, j) = (int(0), int(1), hds.i + int(1));
    let closed = vec![vec![one / j, o, hds.i / j], vec![o, o, one], vec![o, one, o], vec![one, o, o]];
    same(&model.basis, &closed, "K in the order (cs, fs, rk, wg)");
}

/// (6.54): H_r, D_r, S_r, F_r with an inertia on the circular spline.
#[test]
fn eq_6_54_reduced_hds() {
    let hds = Hds::skew();
    let model = linearise(&first(&hds.text()).reduced, &[0.0; 3]);
    let ([jwg, jcs, jfs, jrk], [dwg, dcs, dfs, drk]) = (hds.inertia, hds.damping);
    let (i, j, o) = (hds.i, hds.i + int(1), int(0));
    let j2 = j * j;
    let h = vec![vec![jwg + jcs / j2, o, i / j2 * jcs], vec![o, jrk, o], vec![i / j2 * jcs, o, jfs + i * i / j2 * jcs]];
    let (dsp, ssp) = (hds.dsp, hds.ssp);
    let d = vec![
        vec![dwg + (dcs + dsp) / j2, -(dsp / j), i / j2 * (dcs + dsp)],
        vec![-(dsp / j), drk + dsp, -(i / j * dsp)],
        vec![i / j2 * (dcs + dsp), -(i / j * dsp), dfs + i * i / j2 * (dcs + dsp)],
    ];
    let s = vec![
        vec![ssp / j2, -(ssp / j), i / j2 * ssp],
        vec![-(ssp / j), ssp, -(i / j * ssp)],
        vec![i / j2 * ssp, -(i / j * ssp), i * i / j2 * ssp],
    ];
    same(&model.inertia, &h, "(6.54a)");
    same(&model.damping, &d, "(6.54b)");
    same(&model.stiffness, &s, "(6.54c)");
    same(&model.input, &[vec![int(1), o], vec![o, int(1)], vec![o, o]], "(6.54d)");
}

/// (6.58): without the circular spline's inertia and damping the spring is s/(i+1)² n nᵀ; and the reference's numbers.
#[test]
fn eq_6_58_generalised_spring() {
    let mut skew = Hds::skew();
    (skew.inertia[1], skew.damping[1]) = (int(0), int(0));
    for hds in [Hds::table(), skew] {
        let model = linearise(&first(&hds.text()).reduced, &[0.0; 3]);
        let (i, j) = (hds.i, hds.i + int(1));
        let n = [int(1), -j, i];
        let outer = |factor: Q| -> Exact { n.iter().map(|x| n.iter().map(|y| factor * *x * *y).collect()).collect() };
        let ([jwg, _, jfs, jrk], [dwg, _, dfs, drk]) = (hds.inertia, hds.damping);
        same(&model.inertia, &diagonal(&[jwg, jrk, jfs]), "(6.58a)");
        same(&model.stiffness, &outer(hds.ssp / (j * j)), "(6.58b)");
        let axes = diagonal(&[-dwg, -drk, -dfs]);
        same(&model.damping, &difference(&outer(hds.dsp / (j * j)), &axes), "(6.58c)");
    }
    let model = linearise(&first(&Hds::table().text()).reduced, &[0.0; 3]);
    let golden = golden();
    agrees(&model.inertia, &rows(&golden["hds"]["Hr"]), TOLERANCE, "hds.Hr");
    agrees(&model.damping, &rows(&golden["hds"]["Dr"]), TOLERANCE, "hds.Dr");
    agrees(&model.stiffness, &rows(&golden["hds"]["Sr"]), TOLERANCE, "hds.Sr");
    let source = kardan::model::builtin("harmonic-drive-spring").expect("built in").source;
    let builtin = linearise(&first(source).reduced, &[0.0; 3]);
    assert_eq!((builtin.inertia, builtin.damping, builtin.stiffness), (model.inertia, model.damping, model.stiffness));
}

/// Erratum (6.60): the input enters q̈_r = … + H_r⁻¹ F_r τ with a plus. A torque on the wave generator alone turns it
/// forward by T/Jwg, and open-loop poles agree with the reference.
#[test]
fn erratum_6_60_a_torque_accelerates_forward() {
    let variant = first(&Hds::table().text());
    let (dynamics, mut work) = Dynamics::new(&variant.reduced);
    dynamics.update(&[0.0; 3], &[0.0; 3], &mut work);
    let result = explicit(&variant.reduced, &dynamics, &work, &[2.0, 0.0], &[]);
    close(result.reduced[0], 2.0 / 1e-4, TOLERANCE, "Jwg φ̈_wg = T_wg");
    assert_eq!(&result.reduced[1..], [0.0, 0.0]);
    let poles = closed_loop_poles(&linearise(&variant.reduced, &[0.0; 3]), &[]).expect("poles");
    compare_poles(&poles, &golden()["hds"]["open_loop_eigs_state6"], "hds");
}

/// Poles in any order. A double pole at zero splits by the square root of the rounding of the matrix, √(1e-16 · 1e4)
/// = 1e-6, which is the tolerance (relative to the largest pole for the others, absolute).
fn compare_poles(poles: &[Pole], expected: &serde_json::Value, what: &str) {
    let mut unmatched = rows(expected);
    assert_eq!(poles.len(), unmatched.len(), "{what}");
    for Pole { re, im } in poles {
        let error = |k: usize| (unmatched[k][0] - re).hypot(unmatched[k][1] - im);
        let nearest = (0..unmatched.len()).min_by(|&a, &b| error(a).total_cmp(&error(b))).expect("as many poles");
        assert!(error(nearest) < 1e-6, "{what}: pole {re} + {im}j is none of {unmatched:?}");
        unmatched.remove(nearest);
    }
}

/// Appendix A: the elliptical orthogonal basis (A.1)-(A.6) makes the inertia diagonal (A.8a); (A.8b), (A.8c) follow.
///
/// Erratum (A.8b): the printed entry (2,2), dcs + i²(i+1)²(Jwg² dfs + Jfs² dwg)/(..)² + dsp, is wrong.
/// Erratum (A.1), (A.8a): `Jsp` is Jrk.
#[test]
fn eq_a_8_elliptical_basis_with_a_8b_corrected() {
    for hds in [Hds::table(), Hds::skew()] {
        let equations = first(&hds.text()).reduced.equations.clone();
        let ([jwg, jcs, jfs, jrk], [dwg, dcs, dfs, drk]) = (hds.inertia, hds.damping);
        let (i, j, o, one) = (hds.i, hds.i + int(1), int(0), int(1));
        let m = jfs + i * i * jwg;
        // Columns u2, u3, u1; rows in the order of the library (cs, fs, rk, wg).
        let basis = [vec![o, one, o], vec![one, i * j * jwg / m, o], vec![o, o, one], vec![-i, j * jfs / m, o]];
        let rational = Matrix::from_fn(4, 3, |a, b| basis[a][b].rational());
        let form = |full: Matrix<Rational>| rational.transpose().multiply(&full).multiply(&rational);
        assert!(equations.constraint_matrix().multiply(&rational).as_slice().iter().all(|x| *x == Rational::ZERO));
        same(&form(equations.inertia_matrix()), &diagonal(&[m, jcs + j * j * jfs * jwg / m, jrk]), "(A.8a)");
        let cross = i * j * (jwg * dfs - jfs * dwg) / m;
        let (dsp, s) = (hds.dsp, hds.ssp);
        let second = dcs + j * j * (i * i * jwg * jwg * dfs + jfs * jfs * dwg) / (m * m) + dsp;
        let damping = vec![vec![dfs + i * i * dwg, cross, o], vec![cross, second, -dsp], vec![o, -dsp, drk + dsp]];
        same(&form(equations.damping_matrix()), &damping, "(A.8b)");
        same(&form(equations.stiffness_matrix()), &[vec![o, o, o], vec![o, s, -s], vec![o, -s, s]], "(A.8c)");
        let printed = dcs + i * i * j * j * (jwg * jwg * dfs + jfs * jfs * dwg) / (m * m) + dsp;
        assert_ne!(printed, second);
    }
    // Table 6.3: 0.05335 instead of the printed formula's 90.33.
    let hds = Hds::table();
    let (jwg, jfs, i, j) = (hds.inertia[0], hds.inertia[2], hds.i, hds.i + int(1));
    let m = jfs + i * i * jwg;
    let value = |inner: Q, outer: Q| (outer * inner / (m * m) + hds.dsp).f64();
    let [dwg, _, dfs, _] = hds.damping;
    close(
        value(i * i * jwg * jwg * dfs + jfs * jfs * dwg, j * j),
        golden()["hds"]["ell_D22_table6_3_Jcs0"].as_f64().expect("a number"),
        TOLERANCE,
        "(A.8b) corrected",
    );
    assert!((value(jwg * jwg * dfs + jfs * jfs * dwg, i * i * j * j) - 90.33).abs() < 0.01);
}

// ---- section 6.3: the steering system -----------------------------------------------------------------------------

/// (6.102), (6.103): two joints are one with C = cos β1/cos β2, also above one; equal angles leave a rigid shaft.
#[test]
fn eq_6_102_double_joint() {
    for (first_angle, second_angle) in [(30.0_f64, 10.0_f64), (10.0, 30.0)] {
        let joint = format!("angle_1 = \"{first_angle} deg\"\nangle_2 = \"{second_angle} deg\"");
        let reduced = first(&Sia::skew().text(&joint)).reduced.clone();
        let (dynamics, mut work) = Dynamics::new(&reduced);
        let c = first_angle.to_radians().cos() / second_angle.to_radians().cos();
        for k in -20..20 {
            dynamics.update(&[0.0, 0.0, 0.37 * f64::from(k)], &[0.0; 3], &mut work);
            let (cj, cs) = (work.kinematics.angles[0], work.kinematics.angles[1]);
            close(cj.sin() * cs.cos(), c * cj.cos() * cs.sin(), TOLERANCE, "(6.102a) in the form (6.100)");
        }
    }
    let rigid = first(&Sia::skew().text("angle_1 = \"25 deg\"\nangle_2 = \"25 deg\"")).reduced.clone();
    assert_eq!((rigid.equations.transmissions.len(), rigid.equations.constraints.len()), (0, 2));
}

/// (6.104)-(6.106): φ_cs from φ_cj over more than a turn without a jump, and its slope; against the reference.
#[test]
fn eq_6_105_and_eq_6_106_universal_joint() {
    for degrees in [10.0_f64, 30.0] {
        let reduced = Sia::table().bent(degrees);
        let (dynamics, mut work) = Dynamics::new(&reduced);
        let c = degrees.to_radians().cos();
        let golden = golden();
        let golden = &golden["sia"]["nonlinear_evaluation"][format!("{degrees}")];
        for (cj, name) in [(1.1, "phi_cs"), (4.0, "phi_cs_at_cj_4")] {
            dynamics.update(&[0.0, 0.0, cj], &[0.0, 0.0, 1.0], &mut work);
            close(work.kinematics.angles[1], golden[name].as_f64().expect("a number"), TOLERANCE, name);
        }
        let mut before = f64::NEG_INFINITY;
        for k in -400..400 {
            let cj = 0.05 * f64::from(k);
            dynamics.update(&[0.0, 0.0, cj], &[0.0, 0.0, 1.0], &mut work);
            let cs = work.kinematics.angles[1];
            assert!(cs > before && (cs - cj).abs() < 0.1, "φ_cs = {cs} at φ_cj = {cj}");
            before = cs;
            let (sin, cos) = cs.sin_cos();
            close(c / (cos * cos + c * c * sin * sin) * work.kinematics.speeds[1], 1.0, TOLERANCE, "(6.106)");
        }
    }
}

/// The point of the reference: rk, fs, cj and their speeds.
const POINT: ([f64; 3], [f64; 3]) = ([0.3, -0.7, 1.1], [2.0, -3.0, 5.0]);

/// R_cj (6.119) at an angle.
fn r_cj(c: f64, angle: f64) -> f64 {
    angle.sin().powi(2) + c * c * angle.cos().powi(2)
}

/// (6.107), (6.108), (6.119): the nullspace, in terms of φ_cj.
#[test]
fn eq_6_108_basis_of_the_steering_system() {
    for (sia, degrees) in Sia::both().iter().flat_map(|sia| [(sia, 10.0_f64), (sia, 30.0)]) {
        let reduced = sia.bent(degrees);
        let (dynamics, mut work) = Dynamics::new(&reduced);
        dynamics.update(&POINT.0, &POINT.1, &mut work);
        let (i, c) = (sia.i.f64(), degrees.to_radians().cos());
        let ratio = c / r_cj(c, 1.1);
        let closed = [
            [0.0, 0.0, 1.0],              // cj
            [0.0, 0.0, ratio],            // cs
            [0.0, 1.0, 0.0],              // fs
            [1.0, 0.0, 0.0],              // rk
            [0.0, -i, (i + 1.0) * ratio], // wg
        ];
        for (shaft, row) in closed.iter().enumerate() {
            for column in 0..3 {
                close(work.kinematics.row(shaft)[column], row[column], TOLERANCE, "(6.108)");
            }
        }
    }
    // The reference's `r` is C_cj/R_cj, the slope of φ_cs over φ_cj.
    against_reference("r", |work, _| vec![work.kinematics.row(1)[2]]);
    against_reference("dr_dphi", |work, _| vec![work.kinematics.bias[1] / (POINT.1[2] * POINT.1[2])]);
}

/// (6.117): the reduced inertia, against the closed form and the reference.
#[test]
fn eq_6_117_inertia() {
    for (sia, degrees) in Sia::both().iter().flat_map(|sia| [(sia, 10.0_f64), (sia, 30.0)]) {
        let reduced = sia.bent(degrees);
        let (dynamics, mut work) = Dynamics::new(&reduced);
        assert!(dynamics.update(&POINT.0, &POINT.1, &mut work), "positive definite");
        let (i, c) = (sia.i.f64(), degrees.to_radians().cos());
        let [jwg, jcs, jfs, jcj, jrk] = [sia.jwg, sia.jcs, sia.jfs, sia.jcj, sia.jrk].map(Q::f64);
        let ratio = c / r_cj(c, 1.1);
        let cross = -ratio * i * (i + 1.0) * jwg;
        let closed = [
            [jrk, 0.0, 0.0],
            [0.0, jfs + i * i * jwg, cross],
            [0.0, cross, jcj + ratio * ratio * (jcs + (i + 1.0) * (i + 1.0) * jwg)],
        ];
        for k in 0..9 {
            close(work.inertia[k], closed[k / 3][k % 3], TOLERANCE, "(6.117)");
        }
    }
    against_reference("M", |work, _| work.inertia.clone());
}

/// (6.118): the reduced input matrix, against the closed form and the reference, columns (fs, wg, rk).
#[test]
fn eq_6_118_input() {
    let in_order = |work: &kardan::reduce::Work| -> Vec<f64> {
        // Inputs of the library: driver, rk_motor, wg_motor.
        (0..3).flat_map(|i| [0, 2, 1].map(|k| work.input_rows[3 * k + i])).collect()
    };
    for (sia, degrees) in Sia::both().iter().flat_map(|sia| [(sia, 10.0_f64), (sia, 30.0)]) {
        let reduced = sia.bent(degrees);
        let (dynamics, mut work) = Dynamics::new(&reduced);
        dynamics.update(&POINT.0, &POINT.1, &mut work);
        let (i, c) = (sia.i.f64(), degrees.to_radians().cos());
        let closed = [0.0, 0.0, 1.0, 1.0, -i, 0.0, 0.0, c / r_cj(c, 1.1) * (i + 1.0), 0.0];
        for (value, expected) in in_order(&work).iter().zip(closed) {
            close(*value, expected, TOLERANCE, "(6.118)");
        }
    }
    against_reference("F", |work, _| in_order(work));
}

/// Compares with the reference's nonlinear evaluation of Table 6.4 at 10 and 30 degrees.
fn against_reference(key: &str, value: impl Fn(&kardan::reduce::Work, &Dynamics) -> Vec<f64>) {
    let golden = golden();
    for degrees in ["10", "30"] {
        let reduced = Sia::table().bent(degrees.parse().expect("a number"));
        let (dynamics, mut work) = Dynamics::new(&reduced);
        dynamics.update(&POINT.0, &POINT.1, &mut work);
        let expected = &golden["sia"]["nonlinear_evaluation"][degrees][key];
        let expected = match expected.as_f64() {
            Some(number) => vec![number],
            None if expected[0].is_array() => rows(expected).concat(),
            None => list(expected),
        };
        let found = value(&work, &dynamics);
        assert_eq!(found.len(), expected.len());
        for (value, expected) in found.iter().zip(expected) {
            close(*value, expected, TOLERANCE, &format!("{key} at {degrees} deg"));
        }
    }
}

/// Coulomb friction in reduced coordinates at the point of the last update, all directions slipping.
fn slipping(work: &kardan::reduce::Work, dynamics: &Dynamics) -> Vec<f64> {
    let torque = |k: usize| dynamics.friction_torques()[k] * dynamics.friction_speed(k, work).signum();
    (0..3).map(|i| (0..dynamics.friction_count()).map(|k| torque(k) * work.friction_rows[3 * k + i]).sum()).collect()
}

/// (6.120): h_r without and with Coulomb friction, against the closed forms and the reference.
///
/// Erratum (6.120c): `d_c,cs` is the Coulomb torque c_cs.
#[test]
fn eq_6_120_forces() {
    for (sia, degrees) in Sia::both().iter().flat_map(|sia| [(sia, 10.0_f64), (sia, 30.0)]) {
        let reduced = sia.bent(degrees);
        let (dynamics, mut work) = Dynamics::new(&reduced);
        dynamics.update(&POINT.0, &POINT.1, &mut work);
        let (i, c) = (sia.i.f64(), degrees.to_radians().cos());
        let (r, j) = (r_cj(c, 1.1), i + 1.0);
        let [jwg, jcs] = [sia.jwg, sia.jcs].map(Q::f64);
        let [dwg, dcs, dfs, dcj, drk] = [sia.dwg, sia.dcs, sia.dfs, sia.dcj, sia.drk].map(Q::f64);
        let [cwg, ccs, cfs, ccj, crk] = [sia.cwg, sia.ccs, sia.cfs, sia.ccj, sia.crk].map(Q::f64);
        let (ssp, dsp) = (sia.ssp.f64(), sia.dsp.f64());
        let ([rk, _, cj], [wrk, wfs, wcj]) = POINT;
        let slope = c * (c * c - 1.0) * (2.0 * cj).sin();
        let smooth = [
            drk * wrk + dsp * (wrk - wcj) + ssp * (rk - cj),
            -slope / (r * r) * i * j * jwg * wcj * wcj - c / r * i * j * dwg * wcj + (dfs + i * i * dwg) * wfs,
            c * slope / (r * r * r) * (jcs + j * j * jwg) * wcj * wcj
                + (dcj + c * c / (r * r) * (dcs + j * j * dwg)) * wcj
                - c / r * i * j * dwg * wfs
                + dsp * (wcj - wrk)
                + ssp * (cj - rk),
        ];
        let wave_generator = (-i * wfs + c / r * j * wcj).signum();
        let coulomb = [
            crk * wrk.signum(),
            cfs * wfs.signum() - i * cwg * wave_generator,
            (ccj + c / r * ccs) * wcj.signum() + c / r * j * cwg * wave_generator,
        ];
        let found = slipping(&work, &dynamics);
        for k in 0..3 {
            close(-work.passive[k], smooth[k], TOLERANCE * 10.0, "(6.120), terms up to 1000 N m");
            close(found[k], coulomb[k], TOLERANCE, "Coulomb part of (6.120)");
        }
        // As printed, with a damping instead of the Coulomb torque, the last one is another number.
        let printed = (ccj + c / r * dcs) * wcj.signum() + c / r * j * cwg * wave_generator;
        assert!((found[2] - printed).abs() > 1e-5, "printed (6.120c) gives {printed} N m too");
    }
    against_reference("h_without_coulomb", |work, _| work.passive.iter().map(|x| -x).collect());
    against_reference("friction_generalised", slipping);
}

/// (6.122): the linear model, exactly, and against the reference.
#[test]
fn eq_6_122() {
    for sia in Sia::both() {
        let model = sia.linear();
        same(&model.inertia, &sia.h(), "(6.122a)");
        same(&model.damping, &sia.d(), "(6.122b)");
        same(&model.stiffness, &sia.s(), "(6.122d)");
        same(&columns(&model, &["driver", "wg_motor", "rk_motor"]), &sia.f(), "(6.122e)");
    }
    let golden = golden();
    let builtin = first(kardan::model::builtin("sia-steering").expect("built in").source);
    for model in [Sia::table().linear(), linearise(&builtin.reduced, &[0.0; 3])] {
        agrees(&model.inertia, &rows(&golden["sia"]["Hr"]), TOLERANCE, "sia.Hr");
        agrees(&model.damping, &rows(&golden["sia"]["Dr"]), TOLERANCE, "sia.Dr");
        agrees(&model.stiffness, &rows(&golden["sia"]["Sr"]), TOLERANCE, "sia.Sr");
        agrees(&columns(&model, &["driver", "wg_motor", "rk_motor"]), &rows(&golden["sia"]["Fr"]), TOLERANCE, "sia.Fr");
    }
    let sia = Sia::table();
    close(sia.dcjcj().f64(), golden["sia"]["coefficients"]["dcjcj"].as_f64().expect("a number"), TOLERANCE, "(6.122c)");
}

/// (6.124): the rack's feedback, exactly, and (6.125): φ̈_rk = u1 under it.
#[test]
fn eq_6_124_rack_feedback() {
    for sia in Sia::both() {
        let design = sia.design();
        same(&Matrix::from_fn(1, 6, |_, j| design.state_gain[(1, j)].clone()), &[sia.rack_gains()], "on the state");
        same(
            &Matrix::from_fn(1, 2, |_, j| design.acceleration_gain[(1, j)].clone()),
            &[vec![int(0), sia.jrk]],
            "on u1",
        );
        let (state, inputs) = sia.closed_loop(-1);
        assert_eq!(state[0], vec![int(0); 6], "(6.125)");
        assert_eq!(inputs[0], [int(1), int(0), int(0)], "(6.125)");
    }
}

/// (6.126), (6.127) and (6.128): the last equation solved for φ̈_cj and put into the second.
///
/// Erratum (6.128): the term with φ̇_rk is `− i(i+1) Jwg/J̃cj d_sp φ̇_rk`.
#[test]
fn eq_6_127_and_6_128_corrected() {
    for sia in Sia::both() {
        let (h, d, s, f) = (sia.h(), sia.d(), sia.s(), sia.f());
        assert_eq!(h[2][2], sia.jcj_effective(), "(6.127)");
        // Second row minus h23/h33 times the last one: φ̈_cj drops out.
        let factor = h[1][2] / h[2][2];
        let row = |m: &Exact| -> Vec<Q> { m[1].iter().zip(&m[2]).map(|(x, y)| *x - factor * *y).collect() };
        let (i, j, t) = (sia.i, sia.i + int(1), sia.jcj_effective());
        let share = i * j * sia.jwg / t;
        assert_eq!(row(&h), [int(0), sia.jfs_effective(), int(0)]);
        let damping =
            [-(share * sia.dsp), sia.dfs + sia.jc() / t * i * i * sia.dwg, share * sia.dcjcj() - i * j * sia.dwg];
        assert_eq!(row(&d), damping);
        assert_ne!(row(&d)[0], share * sia.dsp, "as printed");
        assert_eq!(row(&s), [-(share * sia.ssp), int(0), share * sia.ssp]);
        assert_eq!(row(&f), [int(1), -(sia.jc() / t * i), int(0)]);
    }
    let coefficients = &golden()["sia"]["coefficients"];
    close(Sia::table().jcj_effective().f64(), coefficients["Jcj_t"].as_f64().expect("a number"), TOLERANCE, "J̃cj");
}

/// (6.129): the inertia that the driver feels is 1/(c H⁻¹ cᵀ) along the flexspline.
#[test]
fn eq_6_129_effective_inertia() {
    for sia in Sia::both() {
        let variant = sia.straight();
        let shaft = variant.reduced.coordinate("fs").expect("a shaft");
        assert_eq!(effective_inertia(&sia.linear(), shaft), sia.jfs_effective().rational());
        assert_eq!(sia.design().effective_inertia, [sia.jfs_effective().rational(), sia.jrk.rational()]);
    }
    let expected = golden()["sia"]["coefficients"]["Jfs_t"].as_f64().expect("a number");
    close(Sia::table().jfs_effective().f64(), expected, TOLERANCE, "J̃fs");
}

/// (6.130), corrected: the designed gains are the closed form, exactly, and the reference's numbers.
#[test]
fn eq_6_130_corrected() {
    for sia in Sia::both() {
        let design = sia.design();
        let (gains, on_u2) = sia.wave_generator_gains(-1);
        same(&Matrix::from_fn(1, 6, |_, j| design.state_gain[(0, j)].clone()), &[gains], "on the state");
        // The design asks for accelerations; u2 = J̃fs v.
        let on_acceleration = vec![on_u2 * sia.jfs_effective(), int(0)];
        same(&Matrix::from_fn(1, 2, |_, j| design.acceleration_gain[(0, j)].clone()), &[on_acceleration], "on u2");
    }
    let (design, golden) = (Sia::table().design(), golden());
    agrees(&design.state_gain, &rows(&golden["sia"]["Kx"]), TOLERANCE, "Kx");
    // Ku of the reference has the columns (u1, u2) with u2 a torque.
    let inertia = Sia::table().jfs_effective().rational();
    let scaled = Matrix::from_fn(2, 2, |i, j| match j {
        0 => design.acceleration_gain[(i, 1)].clone(),
        _ => &design.acceleration_gain[(i, 0)] / &inertia,
    });
    agrees(&scaled, &rows(&golden["sia"]["Ku"]), TOLERANCE, "Ku");
}

/// (6.131): J̃fs φ̈_fs = u2 + Tfs holds identically under the corrected (6.130).
#[test]
fn eq_6_131_decoupled() {
    for sia in Sia::both() {
        let (state, inputs) = sia.closed_loop(-1);
        assert_eq!(state[1], vec![int(0); 6]);
        let inverse = int(1) / sia.jfs_effective();
        assert_eq!(inputs[1], [int(0), inverse, inverse]);
    }
}

/// Erratum (6.130): with the printed sign the rack's motion kicks the steering wheel, 0.03918 N m per rad/s.
#[test]
fn erratum_6_130_the_printed_sign_does_not_decouple() {
    for sia in Sia::both() {
        let (state, _) = sia.closed_loop(1);
        let mut expected = vec![int(0); 6];
        expected[3] = int(2) * sia.i * (sia.i + int(1)) * sia.jwg * sia.dsp / sia.jcj_effective() / sia.jfs_effective();
        assert_eq!(state[1], expected);
        // The library's gain is not the printed one.
        assert_ne!(sia.design().state_gain[(0, 3)], sia.wave_generator_gains(1).0[3].rational());
    }
    let sia = Sia::table();
    let kick = (sia.closed_loop(1).0[1][3] * sia.jfs_effective()).f64();
    assert!((kick - 0.03918).abs() < 5e-6, "{kick} N m s/rad");
}

/// (6.132), (6.133), corrected: the remaining equation of φ_cj in closed loop, exactly.
///
/// Errata (6.133a), (6.133b), (6.133c): each printed coefficient differs.
#[test]
fn eq_6_132_6_133_corrected() {
    for sia in Sia::both() {
        let (state, inputs) = sia.closed_loop(-1);
        let t = sia.jcj_effective();
        let scaled: Vec<Q> = state[2].iter().map(|x| *x * t).collect();
        let [on_rk, on_fs, on_cj, s, on_u2, on_driver] = sia.coefficients(false);
        assert_eq!(scaled, [s, int(0), -s, -on_rk, -on_fs, -on_cj], "(6.132), left-hand side");
        assert_eq!([inputs[2][1] * t, inputs[2][2] * t], [on_u2, on_driver], "(6.132), right-hand side");
        assert_eq!(inputs[2][0], int(0), "u1 does not reach φ_cj");
        let printed = sia.coefficients(true);
        assert_ne!(printed[0], on_rk, "(6.133a)");
        assert_ne!(printed[1], on_fs, "(6.133b)");
        assert_ne!(printed[2], on_cj, "(6.133c)");
        assert_eq!(printed[3..], sia.coefficients(false)[3..], "(6.133d-f) are right");
    }
    let (golden, right) = (golden(), Sia::table().coefficients(false));
    for (name, value) in ["d_cj_rk", "d_cj_fs", "d_cj_cj", "s_t", "f2", "ffs"].iter().zip(right) {
        close(value.f64(), golden["sia"]["coefficients"][name].as_f64().expect("a number"), TOLERANCE, name);
    }
    // Numbers of the errata, which print four digits or five.
    let printed = Sia::table().coefficients(true);
    assert!((printed[1].f64() - 121.97).abs() < 0.005 && (printed[2].f64() - 23.05).abs() < 0.005);
}

/// (6.136): the zero dynamics `(Jcj+Jcs) s² + (dcs+dcj+dsp) s + ssp = 0`; two poles of the closed loop.
///
/// Erratum (6.133c): with the printed coefficient the zeros are elsewhere, and for dwg = 0.02 N m s/rad it reports an
/// unstable zero dynamics for a stable one.
#[test]
fn eq_6_136_zero_dynamics() {
    for sia in Sia::both() {
        let [_, _, damping, stiffness, _, _] = sia.coefficients(false);
        let t = sia.jcj_effective();
        assert_eq!(damping / t, (sia.dcs + sia.dcj + sia.dsp) / sia.jc());
        assert_eq!(stiffness / t, sia.ssp / sia.jc());
    }
    let variant = Sia::table().straight();
    let poles = closed_loop_poles(&variant.design_models[0].linear, &variant.designed).expect("poles");
    let golden = golden();
    // Eigenvalues of size 953 come with a few ulp of the matrix norm 1e6: 1e-9 relative is ample.
    let zeros: Vec<Pole> = poles.iter().copied().filter(|pole| pole.abs() > 100.0).collect();
    let (sum, product) = sum_and_product(&zeros);
    let sia = Sia::table();
    close(sum, -((sia.dcs + sia.dcj + sia.dsp) / sia.jc()).f64(), 1e-9, "sum of the zeros");
    close(product, (sia.ssp / sia.jc()).f64(), 1e-9, "product of the zeros");
    for root in rows(&golden["sia"]["zero_dynamics_roots"]) {
        assert!(
            zeros.iter().any(|zero| (zero.re - root[0]).hypot(zero.im - root[1]) < 1e-6),
            "{root:?} among {zeros:?}"
        );
    }
    let printed_at = |sia: &Sia| (sia.coefficients(true)[2] / sia.jcj_effective()).f64() / 2.0;
    assert!((printed_at(&sia) - 88.56).abs() < 0.005, "printed: real part −88.56 instead of −93.64");
    let mut damped = Sia::table();
    damped.dwg = frac(2, 100);
    assert!((damped.coefficients(true)[2].f64() + 27.7).abs() < 0.05, "printed: unstable");
    let variant = damped.straight();
    let poles = closed_loop_poles(&variant.design_models[0].linear, &variant.designed).expect("poles");
    assert!(poles.iter().all(|pole| pole.re < 0.0), "{poles:?}");
}

/// Poles of the steering system, open and closed, against the reference.
#[test]
fn eq_6_135_poles_open_and_closed() {
    let variant = Sia::table().straight();
    let golden = golden();
    let open = closed_loop_poles(&variant.design_models[0].linear, &[]).expect("poles");
    compare_poles(&open, &golden["sia"]["open_loop_eigs"], "open loop");
    let closed = closed_loop_poles(&variant.design_models[0].linear, &variant.designed).expect("poles");
    // The pair −14 ± 14.28j is double (rack and wheel): it splits by √(ulp of 1e6) = 1e-5 at most.
    for expected in rows(&golden["sia"]["closed_loop_eigs"]) {
        assert!(
            closed.iter().any(|pole| (pole.re - expected[0]).hypot(pole.im - expected[1]) < 1e-5),
            "{expected:?}: {closed:?}"
        );
    }
    assert_eq!(closed.len(), 6);
}

/// Angles and speeds of all shafts at a state of the straight steering system, in the library's order.
fn shafts_at(sia: &Sia, position: [f64; 3], speed: [f64; 3]) -> (Vec<f64>, Vec<f64>) {
    let (dynamics, mut work) = Dynamics::new(&sia.straight().reduced);
    dynamics.update(&position, &speed, &mut work);
    (work.kinematics.angles.clone(), work.kinematics.speeds.clone())
}

/// What a law without states sees.
fn observation<'a>(angles: &'a [f64], speeds: &'a [f64], references: &'a [f64]) -> Observation<'a> {
    Observation { time: 0.0, angles, speeds, references, disturbances: &[], readings: &[], states: &[] }
}

/// (6.137) in (6.124): the rack motor's torque from reference, state and load estimate.
///
/// Erratum (6.137): u1 is an acceleration, so that the load estimate enters as torque over Jrk.
#[test]
fn eq_6_137() {
    for sia in Sia::both() {
        let variant = sia.straight();
        let law = variant.designed[0].clone();
        let names: Vec<&str> = law.references().iter().map(|r| r.name.as_str()).collect();
        assert_eq!(names, ["ref_rk", "load_rk", "u2"]);
        let (angles, speeds) = shafts_at(&sia, POINT.0, POINT.1);
        let (reference, load, u2) = (2.5, 0.75, -1.25);
        let mut torques = [0.0; 2];
        law.run().command(observation(&angles, &speeds, &[reference, load, u2]), &mut torques);
        let (omega, xi) = (20.0, 0.7);
        let ([rk, _, cj], [wrk, wfs, wcj]) = POINT;
        let u1 = omega * omega * (reference - rk) - 2.0 * xi * omega * wrk - load / sia.jrk.f64();
        let (drk, dsp, ssp) = (sia.drk.f64(), sia.dsp.f64(), sia.ssp.f64());
        let rack = sia.jrk.f64() * u1 + (drk + dsp) * wrk - dsp * wcj + ssp * (rk - cj);
        assert_eq!(law.inputs(), ["rk_motor", "wg_motor"]);
        close(torques[0], rack, TOLERANCE * 10.0, "(6.124) with (6.137), terms up to 1000 N m");
        // The other channel: (6.130), u2 a torque.
        let (gains, on_u2) = sia.wave_generator_gains(-1);
        let state = [rk, POINT.0[1], cj, wrk, wfs, wcj];
        let gains: Vec<f64> = gains.iter().map(|x| x.f64()).collect();
        close(torques[1], dot(&gains, &state) + on_u2.f64() * u2, TOLERANCE * 10.0, "(6.130), terms up to 2000 N m");
    }
}

/// (6.138): the driver's torque with the effective inertia (6.129).
#[test]
fn eq_6_138() {
    for sia in Sia::both() {
        let variant = sia.straight();
        let law = variant.designed[1].clone();
        assert_eq!(law.inputs(), ["driver"]);
        let (angles, speeds) = shafts_at(&sia, POINT.0, POINT.1);
        let (reference, load) = (2.5, 0.75);
        let mut torque = [0.0];
        law.run().command(observation(&angles, &speeds, &[reference, load]), &mut torque);
        let (omega, xi, inertia) = (20.0, 0.7, sia.jfs_effective().f64());
        let expected =
            omega * omega * inertia * (reference - POINT.0[1]) - 2.0 * xi * omega * inertia * POINT.1[1] - load;
        close(torque[0], expected, TOLERANCE, "(6.138)");
    }
    // Its rows in the reference: Tfs = Tx x.
    let expected = &rows(&golden()["sia"]["closed_loop_T_rows"]["Tx"])[2];
    let variant = Sia::table().straight();
    let LinearLaw { on_angles, on_speeds, .. } = variant.designed[1].linear();
    let basis = variant.design_models[1].linear.basis.to_f64();
    let row = [on_angles.multiply(&basis), on_speeds.multiply(&basis)];
    for k in 0..6 {
        close(row[k / 3][(0, k % 3)], expected[k], TOLERANCE, "Tx of the driver");
    }
    // Those of the column law, in the order (wg, rk) of the reference.
    let LinearLaw { on_angles, on_speeds, .. } = variant.designed[0].linear();
    let row = [on_angles.multiply(&basis), on_speeds.multiply(&basis)];
    let all = rows(&golden()["sia"]["closed_loop_T_rows"]["Tx"]);
    for (golden_row, input) in [(0, 1), (1, 0)] {
        for k in 0..6 {
            close(row[k / 3][(input, k % 3)], all[golden_row][k], TOLERANCE, "Tx of the column");
        }
    }
}

/// Basis rows as fractions are the directions of outputs: c of (6.131) for the flexspline.
#[test]
fn outputs_are_rows_of_the_basis() {
    let variant = Sia::skew().straight();
    let model = &variant.design_models[0].linear;
    let shaft = variant.reduced.coordinate("wg").expect("a shaft");
    let i = Sia::skew().i;
    let expected = [int(0), -i, i + int(1)].map(Q::rational);
    assert_eq!(exact_row(&model.basis, shaft), expected);
    assert_eq!(exact_row(&model.direction(shaft), 0), expected);
}
