//! Tests of `src/sampled/interaction.rs`.

use super::*;

/// Where every error vanishes at rest, the command does not change: u = −K [z; p; d; ξ; r] is the command before. Here the error
/// is τ + d + z/2 − ξ with a decaying z, for delays with and without a share of the command in its own sample.
#[test]
fn the_command_stays_constant_in_equilibrium() {
    let one = |x: f64| Matrix::from_fn(1, 1, |_, _| x);
    for (delay, lag) in [(0.0, 0.0), (0.3e-3, 0.0), (1e-3, 0.0), (0.3e-3, 2e-4)] {
        let problem = Problem {
            a: one(-20.0),
            b: one(4.0),
            w: one(0.0),
            lags: vec![lag],
            targets: vec![Target {
                on_state: vec![0.5],
                on_torque: vec![1.0],
                on_disturbance: vec![1.0],
                acceptable: 0.1,
                bandwidth: 30.0,
            }],
            changes: vec![0.2],
            clock: Clock { period: 1e-3, delay, single: false },
        };
        let found = problem.solve().unwrap();
        let (reference, disturbance) = (3.0, 0.7);
        // z = 4 u/20, u + d + z/2 = r.
        let command = (reference - disturbance) / 1.1;
        let lagged = found.on_lagged.row(0).iter().sum::<f64>() * command;
        let output = -(found.on_state[(0, 0)] * 0.2 * command
            + lagged
            + found.on_past.row(0).iter().sum::<f64>() * command
            + found.on_disturbance[(0, 0)] * disturbance
            + found.on_model[(0, 0)] * reference
            + found.on_reference[(0, 0)] * reference);
        assert!((output - command).abs() < 1e-9, "delay {delay}, lag {lag}: {output} {command}");
    }
}
