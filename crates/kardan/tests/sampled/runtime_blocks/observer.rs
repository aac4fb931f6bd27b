//! A sampled observer of the steering system for the test and the benchmark of the runtime blocks: the Kalman predictor
//! of the six states, the driver's torque and the rack's load, from encoders on wave generator and circular spline and
//! the torsion bar. Plain textbook, independent of the library's own designs.

use kardan::num::Matrix;
use kardan::reduce::LinearModel;

/// The numbers of one matrix function: `e^A` by scaling, Taylor and squaring.
fn exponential(a: &Matrix<f64>) -> Matrix<f64> {
    let scaled = a.scale(&0.5f64.powi(12));
    let mut term = Matrix::identity(a.rows());
    let mut sum = term.clone();
    for k in 1..16 {
        term = term.multiply(&scaled).scale(&(1.0 / f64::from(k)));
        sum = sum.plus(&term);
    }
    (0..12).fold(sum, |power, _| power.multiply(&power))
}

/// `x⁺ = Φ x + Γ u` of `ẋ = A x + B u` with u held over the period.
pub fn sampled(a: &Matrix<f64>, b: &Matrix<f64>, period: f64) -> (Matrix<f64>, Matrix<f64>) {
    let (n, m) = (b.rows(), b.columns());
    let both = Matrix::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
        (true, true) => period * a[(i, j)],
        (true, false) => period * b[(i, j - n)],
        _ => 0.0,
    });
    let power = exponential(&both);
    (Matrix::from_fn(n, n, |i, j| power[(i, j)]), Matrix::from_fn(n, m, |i, j| power[(i, n + j)]))
}

/// `ẋ = A x + B u` for x = (q_r, q̇_r) and the inputs named.
pub fn continuous(model: &LinearModel, inputs: &[&str]) -> (Matrix<f64>, Matrix<f64>) {
    let r = model.coordinates.len();
    let h = model.inertia.to_f64();
    let forces = Matrix::from_fn(r, 2 * r + inputs.len(), |i, j| match j {
        j if j < r => -model.stiffness.to_f64()[(i, j)],
        j if j < 2 * r => -model.damping.to_f64()[(i, j - r)],
        j => {
            let name = inputs[j - 2 * r];
            let column = model.inputs.iter().position(|input| input == name).expect("an input");
            model.input.to_f64()[(i, column)]
        }
    });
    let accelerations = h.solve(&forces).expect("positive definite");
    let entry = |i: usize, j: usize| match i < r {
        true => f64::from(u8::from(j == i + r)),
        false => accelerations[(i - r, j)],
    };
    (Matrix::from_fn(2 * r, 2 * r, entry), Matrix::from_fn(2 * r, inputs.len(), |i, j| entry(i, 2 * r + j)))
}

/// A and B of the observer block over the signals (T_wg, T_rk, φ_wg, φ_cs, φ_rk − φ_cj), and the rows of the sensors.
pub struct Observer {
    /// 8 × 8.
    pub a: Vec<f64>,
    /// 8 × 5.
    pub b: Vec<f64>,
    /// 3 × 8.
    #[allow(dead_code)] // the benchmark has no plant
    pub sensors: Matrix<f64>,
}

/// Designs the predictor for a period; `shafts` are the numbers of (wg, cs, rk, cj).
pub fn predictor(model: &LinearModel, [wg, cs, rk, cj]: [usize; 4], period: f64) -> Observer {
    let (a6, b6) = continuous(model, &["wg_motor", "rk_motor", "driver", "T_dist"]);
    // States 6 and 7 are the torques of driver and road.
    let a = Matrix::from_fn(8, 8, |i, j| match (i < 6, j < 6) {
        (true, true) => a6[(i, j)],
        (true, false) => b6[(i, j - 4)],
        _ => 0.0,
    });
    let b = Matrix::from_fn(8, 2, |i, j| if i < 6 { b6[(i, j)] } else { 0.0 });
    let basis = model.basis.to_f64();
    let sensors = Matrix::from_fn(3, 8, |i, j| match i {
        _ if j >= 3 => 0.0,
        0 => basis[(wg, j)],
        1 => basis[(cs, j)],
        _ => basis[(rk, j)] - basis[(cj, j)],
    });
    let (phi, gamma) = sampled(&a, &b, period);
    let turn = std::f64::consts::TAU;
    let steps = [turn / 14_080.0, turn / 32_768.0, 0.01_f64.to_radians()];
    let noise = Matrix::from_fn(3, 3, |i, j| if i == j { steps[i] * steps[i] / 12.0 } else { 0.0 });
    // Random walks of 10 N m/√s; a little on the speeds.
    let drift = Matrix::from_fn(8, 8, |i, j| match i {
        _ if i != j => 0.0,
        0..3 => 0.0,
        3..6 => 1e-4 * period,
        _ => 100.0 * period,
    });
    let mut covariance = Matrix::identity(8);
    let mut gain = Matrix::zeros(8, 3);
    for _ in 0..20_000 {
        let cross_covariance = sensors.multiply(&covariance);
        let innovation = cross_covariance.multiply(&sensors.transpose()).plus(&noise);
        // L = Φ P Cᵀ (C P Cᵀ + R)⁻¹
        gain = innovation.solve(&cross_covariance.multiply(&phi.transpose())).expect("regular").transpose();
        let closed = phi.minus(&gain.multiply(&sensors));
        covariance = closed
            .multiply(&covariance)
            .multiply(&closed.transpose())
            .plus(&gain.multiply(&noise).multiply(&gain.transpose()))
            .plus(&drift);
    }
    let closed = phi.minus(&gain.multiply(&sensors));
    let b = Matrix::from_fn(8, 5, |i, j| if j < 2 { gamma[(i, j)] } else { gain[(i, j - 2)] });
    Observer { a: closed.as_slice().to_vec(), b: b.as_slice().to_vec(), sensors }
}
