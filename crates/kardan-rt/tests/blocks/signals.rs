//! Blocks of signals against their equations.

use kardan_rt::{
    Arithmetic, DeadZone, Delay, Hysteresis, Integrator, Lanes, Manual, Monitor, Observer, Pid, RateLimit, Saturation,
    StateMachine, TransferFunction, Transition,
};

use crate::state_space::numbers;

fn pid() -> Pid<f64> {
    Pid {
        proportional: 2.0,
        integral: Some(5.0),
        derivative: 0.3,
        filter: 0.02,
        weights: [0.7, 0.2],
        bounds: [None; 2],
        tracking: 0.25,
        sample_time: 0.01,
    }
}

const ON: Manual<f64> = Manual { on: 1.0, value: 0.0 };

/// `y_k = Σ b_i u_{k−i} − Σ a_i y_{k−i}`, whatever the order of the two lists.
#[test]
fn a_transfer_function_is_its_difference_equation() {
    for (zeros, poles) in [(1, 0), (3, 2), (2, 4), (5, 5), (0, 2)] {
        let b = numbers(1, zeros);
        let a: Vec<f64> = numbers(2, poles).iter().map(|a| 0.2 * a).collect();
        let block = TransferFunction { numerator: &b, denominator: &a };
        let inputs = numbers(3, 60);
        let mut state = vec![0.0; 1 + poles.max(zeros.saturating_sub(1))];
        let mut outputs: Vec<f64> = Vec::new();
        for k in 0..inputs.len() {
            assert!(block.step(inputs[k], &mut state));
            let past = |list: &[f64], values: &[f64], lag: usize| -> f64 {
                let terms = list.iter().enumerate().filter(|(i, _)| *i + lag <= k);
                terms.map(|(i, c)| c * values[k - i - lag]).sum()
            };
            let expected = past(&b, &inputs, 0) - past(&a, &outputs, 1);
            assert!((state[0] - expected).abs() < 1e-14, "{zeros}, {poles}: {} for {expected} at {k}", state[0]);
            outputs.push(state[0]);
        }
    }
}

/// Its three parts, each by a sum written out here.
#[test]
fn a_pid_is_the_sum_of_its_parts() {
    let Pid { proportional, integral, derivative, filter, weights: [b, c], sample_time: h, .. } = pid();
    let (references, measured) = (numbers(4, 50), numbers(5, 50));
    let mut state = [0.0; 5];
    for k in 0..references.len() {
        assert!(pid().step(references[k], measured[k], ON, &mut state));
        let p = proportional * (b * references[k] - measured[k]);
        let i: f64 = (0..k).map(|j| h * integral.unwrap() * (references[j] - measured[j])).sum();
        let e = |j: usize| c * references[j] - measured[j];
        // What the filter keeps of each step of the derivative after so many samples.
        let filtered_step = |j: usize| (filter / (filter + h)).powi((k - j) as i32) * derivative / (filter + h);
        let d: f64 = (1..=k).map(|j| filtered_step(j) * (e(j) - e(j - 1))).sum();
        assert!((state[0] - (p + i + d)).abs() < 1e-12, "{} for {} at {k}", state[0], p + i + d);
    }
}

/// At a bound the integral comes to rest where the back-calculation takes as much as the error brings: `(v − u)/Tt = Ki e`.
#[test]
fn a_pid_does_not_wind_up() {
    let pid = Pid { bounds: [Some(-1.0), Some(3.0)], derivative: 0.0, ..pid() };
    let mut state = [0.0; 5];
    for _ in 0..2000 {
        assert!(pid.step(2.0, 0.0, ON, &mut state));
    }
    let v = state[1] + pid.proportional * pid.weights[0] * 2.0;
    assert_eq!(state[0], 3.0);
    assert!(((v - 3.0) / pid.tracking - pid.integral.unwrap() * 2.0).abs() < 1e-9, "{v}");
    // Without it the integral would be at 2000 samples · 0.01 s · 5/s · 2 = 200 and hold the bound for as long again.
    let samples = (1..).find(|_| pid.step(-1.0, 0.0, ON, &mut state) && state[0] < 3.0);
    assert!(samples < Some(60), "{samples:?}");
}

/// Switched on at any time, it answers what was commanded before.
#[test]
fn switching_a_pid_on_is_bumpless() {
    let mut state = [0.0; 5];
    let (mut by_hand, signals) = (0.0, numbers(6, 40));
    for signal in &signals[..30] {
        by_hand = 4.0 * signal;
        assert!(pid().step(*signal, 0.3, Manual { on: 0.0, value: by_hand }, &mut state));
        assert_eq!(state[0], by_hand);
    }
    assert!(pid().step(signals[29], 0.3, ON, &mut state));
    let filtered = 0.02 / (0.02 + 0.01);
    // The derivative part alone went on fading within that sample.
    let derivative_decay = (1.0 - filtered) * state[2] / filtered;
    assert!(
        (state[0] - (by_hand - derivative_decay)).abs() < 1e-12,
        "{} for {by_hand} less {derivative_decay}",
        state[0]
    );
}

/// A mass that a force pushes beside an unknown constant one, seen by its position: gains that put all poles of `A − L C` to zero leave no
/// error after as many samples as there are states, to the last bit, as all numbers are short fractions.
#[test]
fn a_dead_beat_observer_knows_all_after_as_many_samples_as_states() {
    // x⁺ = x + v + (u + d)/2, v⁺ = v + u + d, d⁺ = d, y = x; (z − 1)³ with L = [3, 5/2, 1] is z³.
    let (a, b) = ([1.0, 1.0, 0.5, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0], [0.5, 1.0, 0.0]);
    let (c, gain) = ([1.0, 0.0, 0.0], [3.0, 2.5, 1.0]);
    let observer = Observer { a: &a, b: &b, c: &c, gain: &gain };
    let (mut plant, mut state) = ([5.0, -2.0, 0.75], [0.0_f64; 6]);
    for k in 0..20 {
        let u = f64::from(k % 5) - 1.5;
        assert!(observer.step(&[u], &[plant[0]], &mut state));
        assert_eq!(state[..3] == plant, k >= 3, "sample {k}: {state:?} for {plant:?}");
        let [x, v, d] = plant;
        plant = [x + v + (u + d) / 2.0, v + u + d, d];
    }
}

/// All blocks at once, answers one after the other.
fn all<N: Arithmetic>(of: impl Fn(f64) -> N, inputs: impl Iterator<Item = [N; 2]>) -> Vec<N> {
    let pid = Pid {
        proportional: of(2.0),
        integral: Some(of(5.0)),
        derivative: of(0.3),
        filter: of(0.02),
        weights: [of(0.7), of(0.2)],
        bounds: [Some(of(-1.0)), Some(of(1.5))],
        tracking: of(0.25),
        sample_time: of(0.01),
    };
    let (numerator, denominator) = ([of(0.3), of(-0.2), of(0.1)], [of(-0.4), of(0.05)]);
    let filter = TransferFunction { numerator: &numerator, denominator: &denominator };
    let sum = Integrator { sample_time: of(0.1), low: Some(of(-0.2)), high: Some(of(0.3)) };
    let transitions = [Transition { from: 0, to: 2 }, Transition { from: 2, to: 1 }, Transition { from: 1, to: 0 }];
    let (mut a, mut b, mut c, mut d) = ([of(0.0); 1], [of(0.0); 1], [of(0.0); 2], [of(0.0); 2]);
    let (mut e, mut f, mut g, mut h) = ([of(0.0); 4], [of(0.0); 2], [of(0.0); 2], [of(0.0); 5]);
    let (mut i, mut j, mut k, mut l) = ([of(0.0); 3], [of(0.0); 2], [of(0.0); 2], [of(0.0); 4]);
    let (a_matrix, b_matrix) = ([of(0.9), of(0.1), of(-0.2), of(0.8)], [of(0.0), of(0.5)]);
    let observer = Observer { a: &a_matrix, b: &b_matrix, c: &[of(1.0), of(0.25)], gain: &[of(0.5), of(0.3)] };
    let mut outputs = Vec::new();
    for [x, y] in inputs {
        let _ = Saturation { low: Some(of(-0.4)), high: Some(of(0.6)) }.step(x, &mut a);
        let _ = DeadZone { low: of(-0.4), high: of(0.6) }.step(x, &mut b);
        let _ = Hysteresis { upper: of(0.3), lower: of(-0.2), levels: [of(1.0), of(4.0)] }.step(x, &mut c);
        let _ = RateLimit { rise: of(0.2), fall: of(0.1) }.step(x, &mut d);
        let _ = Delay.step(x, &mut e);
        let _ = sum.step(x, y, of(0.05), &mut f);
        let _ = Monitor { threshold: of(0.4), debounce: of(2.0), hold: of(3.0) }.step(x, &mut g);
        let _ = pid.step(x, y, Manual { on: y, value: x }, &mut h);
        let _ = filter.step(x, &mut i);
        let _ = StateMachine { transitions: &transitions }.step(&[x, y, x], &mut j);
        let _ = sum.step_trapezoidal(y, x, of(0.0), &mut k);
        let _ = observer.step(&[x], &[y], &mut l);
        outputs.extend([a[0], b[0], c[0], d[0], e[0], f[0], g[0], h[0], i[0], j[0], k[0], l[0], l[1]]);
    }
    outputs
}

/// Lanes have the bits of one after the other, and what is no number in one of them is that lane's matter alone.
#[test]
fn lanes_do_not_disturb_each_other() {
    let inputs = |lane: u64| -> Vec<[f64; 2]> {
        let (x, y) = (numbers(10 + lane, 200), numbers(20 + lane, 200));
        let bad = |k: usize| lane == 2 && k % 7 == 3;
        x.iter().zip(&y).enumerate().map(|(k, (x, y))| [if bad(k) { f64::NAN } else { 2.0 * x }, *y]).collect()
    };
    let side_by_side = (0..200).map(|k| {
        let of = |input: usize| Lanes([0, 1, 2, 3].map(|lane| inputs(lane)[k][input]));
        [of(0), of(1)]
    });
    let in_lanes = all(|x| Lanes([x; 4]), side_by_side);
    for lane in 0..4 {
        let single = all(|x| x, inputs(lane).into_iter());
        let same = single.iter().zip(&in_lanes).all(|(a, b)| a.to_bits() == b.0[lane as usize].to_bits());
        assert!(same && single.len() == 2600 && single.iter().all(|x| x.is_finite()), "lane {lane}");
    }
}
