//! Tests of `src/dop853.rs`.

use kardan_rt::functions::{cos, exp, log2, powf, sin, sin_cos};

use super::*;

fn rows() -> Vec<(usize, &'static [Term])> {
    vec![
        (1, &ROW_1),
        (2, &ROW_2),
        (3, &ROW_3),
        (4, &ROW_4),
        (5, &ROW_5),
        (6, &ROW_6),
        (7, &ROW_7),
        (8, &ROW_8),
        (9, &ROW_9),
        (10, &ROW_10),
        (11, &ROW_11),
        (12, &WEIGHTS),
        (13, &ROW_13),
        (14, &ROW_14),
        (15, &ROW_15),
    ]
}

/// `Σ aⱼ vⱼ` and `Σ |aⱼ vⱼ|`, against which rounding is measured.
fn apply(row: &[Term], v: impl Fn(usize) -> f64) -> (f64, f64) {
    row.iter().fold((0.0, 0.0), |(sum, size), (j, a)| (sum + a * v(*j), size + (a * v(*j)).abs()))
}

fn assert_sum(row: &[Term], v: impl Fn(usize) -> f64, expected: f64, what: &str) {
    let (sum, size) = apply(row, v);
    // 1e-15 where terms do not cancel; a few roundings of the terms where they do.
    let tolerance = 1e-15 * size.max(1.0);
    assert!((sum - expected).abs() <= tolerance, "{what}: {sum:e} instead of {expected:e}");
}

#[test]
fn row_sums_are_the_nodes() {
    for (s, row) in rows() {
        assert_sum(row, |_| 1.0, NODES[s], &format!("row {s}"));
        assert!(row.iter().all(|(j, _)| *j < s), "row {s} is explicit");
    }
}

#[test]
fn quadrature_conditions_up_to_order_8() {
    for k in 0..8 {
        assert_sum(&WEIGHTS, |j| powi(NODES[j], k), 1.0 / (k as f64 + 1.0), &format!("Σ b c^{k}"));
    }
    for k in 0..5 {
        assert_sum(&DEFECT_5, |j| powi(NODES[j], k), 0.0, &format!("order 5, c^{k}"));
    }
    for k in 0..3 {
        assert_sum(&DEFECT_3, |j| powi(NODES[j], k), 0.0, &format!("order 3, c^{k}"));
    }
    assert!(apply(&DEFECT_5, |j| powi(NODES[j], 5)).0.abs() > 1e-4);
    assert!(apply(&DEFECT_3, |j| powi(NODES[j], 3)).0.abs() > 1e-4);
}

#[test]
fn nested_conditions_up_to_order_8() {
    // Σ bᵢ cᵢ^p aᵢⱼ cⱼ^q = 1/((q+1)(p+q+2)) for p + q + 2 <= 8.
    let table = rows();
    for p in 0..7 {
        for q in 0..(7 - p) {
            let inner = |i: usize| match table.iter().find(|(s, _)| *s == i) {
                Some((_, row)) => apply(row, |j| powi(NODES[j], q)).0,
                None => 0.0,
            };
            let expected = 1.0 / (f64::from(q + 1) * f64::from(p + q + 2));
            assert_sum(&WEIGHTS, |i| powi(NODES[i], p) * inner(i), expected, &format!("c^{p} A c^{q}"));
        }
    }
}

/// Kepler's problem: position and velocity in the plane, unit gravity.
fn kepler(_: f64, x: &[f64], slope: &mut [f64]) {
    let cube = powf(x[0] * x[0] + x[1] * x[1], 1.5);
    slope[0] = x[2];
    slope[1] = x[3];
    slope[2] = -x[0] / cube;
    slope[3] = -x[1] / cube;
}

const ECCENTRICITY: f64 = 0.3;

/// Its solution from the pericentre, by Kepler's equation `t = E - e sin E`.
fn kepler_solution(t: f64) -> [f64; 4] {
    let e = ECCENTRICITY;
    let mut anomaly = t;
    for _ in 0..50 {
        anomaly -= (anomaly - e * sin(anomaly) - t) / (1.0 - e * cos(anomaly));
    }
    let (sin, cos) = sin_cos(anomaly);
    let (b, rate) = ((1.0 - e * e).sqrt(), 1.0 / (1.0 - e * cos));
    [cos - e, b * sin, -sin * rate, b * cos * rate]
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// One step of length `h` without error control.
fn fixed_step(solver: &mut Dop853, h: f64, rhs: &mut impl FnMut(f64, &[f64], &mut [f64])) {
    if solver.slope_at_end {
        solver.slopes.swap(0, LAST);
    }
    let end = solver.time + h;
    solver.try_step(h, end, rhs);
    rhs(end, &solver.trial, &mut solver.slopes[LAST]);
    solver.accept(end);
    solver.dense_ready = false;
}

#[test]
fn fixed_steps_converge_with_order_8() {
    // x' = x², x(0) = 1 up to t = 0.8: x = 1/(1 - t), five times the start.
    let mut rhs = |_: f64, x: &[f64], slope: &mut [f64]| slope[0] = x[0] * x[0];
    let errors = [24, 48].map(|steps| {
        let mut solver = Dop853::new(1e-10, &[1e-10]);
        solver.start(0.0, &[1.0], &mut rhs);
        for _ in 0..steps {
            fixed_step(&mut solver, 0.8 / f64::from(steps), &mut rhs);
        }
        (solver.state[0] - 5.0).abs()
    });
    let order = log2(errors[0] / errors[1]);
    assert!((7.8..8.2).contains(&order), "order {order}, errors {errors:?}");
}

/// Largest error inside one step of length `h`.
fn interpolation_error(h: f64) -> f64 {
    let mut solver = Dop853::new(1e-10, &[1e-10; 4]);
    solver.start(1.0, &kepler_solution(1.0), &mut kepler);
    fixed_step(&mut solver, h, &mut kepler);
    solver.prepare_dense(&mut kepler);
    let mut x = [0.0; 4];
    let mut worst = 0.0_f64;
    for i in 1..40 {
        let time = 1.0 + h * f64::from(i) / 40.0;
        solver.interpolate(time, &mut x);
        worst = worst.max(distance(&x, &kepler_solution(time)));
    }
    worst
}

#[test]
fn dense_output_has_order_7() {
    // The error inside one step is that of one step of a method of order 7: O(h^8).
    let errors = [0.4, 0.2, 0.1].map(interpolation_error);
    for pair in errors.windows(2) {
        let order = log2(pair[0] / pair[1]) - 1.0;
        assert!((6.6..8.2).contains(&order), "order {order}, errors {errors:?}");
    }
}

#[test]
fn dense_output_is_exact_for_polynomials_of_degree_7() {
    for k in 0..7 {
        let mut rhs = |t: f64, _: &[f64], slope: &mut [f64]| slope[0] = f64::from(k + 1) * powi(t, k);
        let mut solver = Dop853::new(1e-10, &[1e-10]);
        solver.start(0.5, &[powi(0.5_, k + 1)], &mut rhs);
        fixed_step(&mut solver, 1.0, &mut rhs);
        solver.prepare_dense(&mut rhs);
        for i in 0..=16 {
            let time = 0.5 + f64::from(i) / 16.0;
            let mut x = [0.0];
            solver.interpolate(time, &mut x);
            // Terms of size 1e2 (the dense coefficients) times 1.5^7 times rounding.
            assert!((x[0] - powi(time, k + 1)).abs() < 1e-12, "degree {}, time {time}", k + 1);
        }
    }
}

#[test]
fn interpolation_is_exact_at_both_ends_and_smooth_between_steps() {
    let mut solver = Dop853::new(1e-9, &[1e-9; 4]);
    solver.start(0.1, &kepler_solution(0.1), &mut kepler);
    let mut x = [0.0; 4];
    while solver.time < 7.0 {
        solver.step(7.0, &mut kepler).unwrap();
        let evaluations = solver.counts.evaluations;
        solver.prepare_dense(&mut kepler);
        solver.prepare_dense(&mut kepler);
        assert_eq!(solver.counts.evaluations, evaluations + 3);
        solver.interpolate(solver.previous_time, &mut x);
        assert_eq!(x[..], solver.previous[..]);
        solver.interpolate(solver.time, &mut x);
        assert_eq!(x[..], solver.state[..]);
        // The slope at both ends is the right-hand side, by one-sided differences of second order.
        let d = 1e-5 * (solver.time - solver.previous_time);
        for (end, way, from) in [(solver.previous_time, d, &solver.previous[..]), (solver.time, -d, &solver.state[..])]
        {
            let (mut near, mut far, mut slope) = ([0.0; 4], [0.0; 4], [0.0; 4]);
            solver.interpolate(end + way, &mut near);
            solver.interpolate(end + 2.0 * way, &mut far);
            kepler(end, from, &mut slope);
            let difference: Vec<f64> = (0..4).map(|i| (4.0 * near[i] - far[i] - 3.0 * from[i]) / (2.0 * way)).collect();
            // 1e-16 rounding over a difference of about 1e-6.
            assert!(distance(&difference, &slope) < 1e-8);
        }
    }
}

#[test]
fn oscillator_keeps_the_tolerance_over_a_hundred_periods() {
    let mut rhs = |_: f64, x: &[f64], slope: &mut [f64]| {
        slope[0] = x[1];
        slope[1] = -x[0];
    };
    let end = 200.0 * std::f64::consts::PI;
    for tolerance in [1e-6, 1e-9, 1e-12] {
        let mut solver = Dop853::new(tolerance, &[tolerance; 2]);
        solver.start(0.0, &[1.0, 0.0], &mut rhs);
        let mut x = [0.0; 2];
        while solver.time < end {
            solver.step(end, &mut rhs).unwrap();
            solver.prepare_dense(&mut rhs);
            let time = 0.5 * (solver.previous_time + solver.time);
            solver.interpolate(time, &mut x);
            // Local errors add up over the time that has gone by, in the worst case linearly.
            let bound = tolerance * (1.0 + end);
            assert!(distance(&x, &[cos(time), -sin(time)]) < bound);
            assert!(distance(&solver.state, &[cos(solver.time), -sin(solver.time)]) < bound);
        }
        let counts = solver.counts;
        // Two more for each measurement of rounding.
        let scans = counts.evaluations - (2 + 15 * counts.accepted + 11 * counts.rejected);
        assert!(scans.is_multiple_of(2) && scans <= 2 * (counts.accepted + counts.rejected), "{counts:?}");
        assert!(counts.rejected * 10 < counts.accepted, "{counts:?}");
    }
}

/// An oscillation about an angle far from zero, whose allowed errors are a thousand times those of its speed: for
/// any phase at which a step that is far too long is tried, as after an event, no step is accepted whose angle
/// error exceeds its tolerance.
#[test]
fn no_phase_hides_the_error_of_a_step() {
    let mut rhs = |_: f64, x: &[f64], slope: &mut [f64]| {
        slope[0] = x[1];
        slope[1] = 1000.0 - x[0];
    };
    let mut solver = Dop853::new(1e-10, &[1e-13; 2]);
    for k in 0..4000 {
        let phase = f64::from(k) * 1e-3;
        solver.start(0.0, &[1000.0 + cos(phase), -sin(phase)], &mut rhs);
        solver.next = 1.7;
        solver.step(10.0, &mut rhs).unwrap();
        let angle = phase + solver.time;
        assert!(distance(&solver.state, &[1000.0 + cos(angle), -sin(angle)]) < 1e-7, "{phase} {}", solver.time);
    }
}

#[test]
fn lands_on_until_bit_for_bit_and_keeps_its_step() {
    let mut rhs = |t: f64, x: &[f64], slope: &mut [f64]| slope[0] = x[0] * cos(t);
    let mut solver = Dop853::new(1e-10, &[1e-10]);
    solver.start(0.0, &[1.0], &mut rhs);
    while solver.time < 1.0 {
        solver.step(1.0, &mut rhs).unwrap();
    }
    let free = solver.next;
    assert!(free > 0.05);
    // A grid finer than the steps: one step for each point, the proposal stays.
    for i in 1..=100 {
        let until = 1.0 + f64::from(i) * 1e-3 / 3.0;
        solver.step(until, &mut rhs).unwrap();
        assert_eq!(solver.time.to_bits(), until.to_bits());
        assert!(solver.next >= free);
    }
    // The next number, and a sliver that would be left over.
    let until = solver.time.next_up();
    solver.step(until, &mut rhs).unwrap();
    assert_eq!(solver.time, until);
    let until = until + 0.1;
    solver.next = 0.0995;
    solver.step(until, &mut rhs).unwrap();
    assert_eq!(solver.time, until);
    assert!((solver.state[0] - exp(sin(until))).abs() < 1e-9);
}

#[test]
fn never_evaluates_after_until() {
    let latest = std::cell::Cell::new(0.0_f64);
    let mut rhs = |t: f64, x: &[f64], slope: &mut [f64]| {
        latest.set(latest.get().max(t));
        slope[0] = -x[0];
    };
    let mut solver = Dop853::new(1e-8, &[1e-8]);
    solver.start(0.0, &[1.0], &mut rhs);
    for until in [1e-9, 0.3, 0.7, 4.0] {
        while solver.time < until {
            solver.step(until, &mut rhs).unwrap();
            assert!(latest.get() <= until);
        }
    }
}

#[test]
fn restart_takes_the_hint_and_costs_one_evaluation() {
    let mut rhs = |_: f64, x: &[f64], slope: &mut [f64]| slope[0] = -x[0];
    let mut solver = Dop853::new(1e-8, &[1e-8]);
    solver.start(0.0, &[1.0], &mut rhs);
    solver.step(1.0, &mut rhs).unwrap();
    let before = solver.counts.evaluations;
    solver.start(0.25, &[2.0], &mut rhs);
    assert_eq!((solver.previous_time, solver.next), (0.25, 0.0));
    assert_eq!(solver.previous, [2.0]);
    solver.next = 0.125;
    solver.step(1.0, &mut rhs).unwrap();
    assert_eq!(solver.time, 0.375);
    assert_eq!(solver.counts.evaluations, before + 1 + 12);
    assert!((solver.state[0] - 2.0 * exp(-0.125_f64)).abs() < 1e-12);
}

#[test]
fn finite_escape_ends_at_the_pole() {
    // x' = x², x(0) = 1: x = 1/(1 - t).
    let mut rhs = |_: f64, x: &[f64], slope: &mut [f64]| slope[0] = x[0] * x[0];
    let mut solver = Dop853::new(1e-10, &[1e-10]);
    solver.start(0.0, &[1.0], &mut rhs);
    let error = loop {
        match solver.step(2.0, &mut rhs) {
            Ok(()) => assert!(solver.time < 1.0 + 1e-6),
            Err(error) => break error,
        }
    };
    let (StepError::StepTooSmall { time, .. } | StepError::NotFinite { time }) = error;
    // The pole is known as well as the solution: to the tolerance.
    assert!((time - 1.0).abs() < 1e-8, "{error}");
    assert_eq!(solver.time, time);
    assert!(solver.state[0].is_finite());
}

#[test]
fn shrinks_into_the_domain_and_stops_at_its_border() {
    // x' = -sqrt(x) for x > 0.25, NaN beyond: x = (1 - t/2)², the border is reached at t = 1.
    let mut rhs = |_: f64, x: &[f64], slope: &mut [f64]| slope[0] = if x[0] > 0.25 { -x[0].sqrt() } else { f64::NAN };
    let mut solver = Dop853::new(1e-8, &[1e-8]);
    solver.start(0.0, &[1.0], &mut rhs);
    solver.next = 1.9;
    let error = loop {
        if let Err(error) = solver.step(2.0, &mut rhs) {
            break error;
        }
    };
    assert!(matches!(error, StepError::NotFinite { time } if (time - 1.0).abs() < 1e-7), "{error}");
    // At a point without a slope at all, at time 0 and elsewhere.
    for time in [0.0, 3.0] {
        solver.start(time, &[0.0], &mut rhs);
        assert_eq!(solver.step(4.0, &mut rhs), Err(StepError::NotFinite { time }));
    }
}

#[test]
fn jump_of_the_right_hand_side_is_passed_to_tolerance() {
    let mut rhs = |t: f64, _: &[f64], slope: &mut [f64]| slope[0] = if t < 0.3 { 1.0 } else { -1.0 };
    let mut solver = Dop853::new(1e-8, &[1e-8]);
    solver.start(0.0, &[0.0], &mut rhs);
    while solver.time < 1.0 {
        solver.step(1.0, &mut rhs).unwrap();
    }
    assert!((solver.state[0] + 0.4).abs() < 1e-6);
}

/// A stiff spring far from zero: its net force is 1e-10 of the terms that cancel in it.
#[test]
fn rounding_shortens_no_steps_and_is_reported() {
    let mut rhs = |_: f64, x: &[f64], slope: &mut [f64]| {
        (slope[0], slope[1]) = (x[1], 0.0);
        slope[2] = x[3];
        slope[3] = 1e6 * (x[0] - x[2]);
    };
    let mut steps = |tolerance: f64| {
        let mut solver = Dop853::new(tolerance, &[1e-2 * tolerance; 4]);
        solver.start(0.0, &[1.0, 0.0, 1.0 + 1e-6, 0.0], &mut rhs);
        while solver.time < 1.0 {
            solver.step(1.0, &mut rhs).unwrap();
        }
        (solver.counts.accepted, solver.rounding.tolerances, solver.rounding.largest.clone())
    };
    let ((loose, little, _), (tight, much, errors)) = (steps(1e-9), steps(1e-13));
    // Without regard to rounding 1e-13 takes hundreds of times more.
    assert!(tight < 4 * loose, "{loose} {tight}");
    assert!(little < 1.0 && much > 10.0, "{little} {much}");
    assert!(errors[..3].iter().all(|error| *error < errors[3]), "{errors:?}");
}

#[test]
fn uncontrolled_quadrature_does_not_touch_the_steps() {
    let mut plain_rhs = |_: f64, x: &[f64], slope: &mut [f64]| {
        slope[0] = x[1];
        slope[1] = -x[0];
    };
    let mut with = |_: f64, x: &[f64], slope: &mut [f64]| {
        slope[0] = x[1];
        slope[1] = -x[0];
        slope[2] = 1e6 * x[1] * x[1];
    };
    let mut a = Dop853::new(1e-9, &[1e-9; 2]);
    let mut b = Dop853::new(1e-9, &[1e-9, 1e-9, f64::INFINITY]);
    a.start(0.0, &[1.0, 0.0], &mut plain_rhs);
    b.start(0.0, &[1.0, 0.0, 0.0], &mut with);
    while a.time < 10.0 {
        a.step(10.0, &mut plain_rhs).unwrap();
        b.step(10.0, &mut with).unwrap();
        assert_eq!(a.time, b.time);
        assert_eq!(a.state[..], b.state[..2]);
    }
    assert_eq!((a.counts.accepted, a.counts.rejected), (b.counts.accepted, b.counts.rejected));
    // ∫ 1e6 sin² = 1e6 (t/2 - sin(2t)/4).
    assert!((b.state[2] / 1e6 - (5.0 - sin(20.0) / 4.0)).abs() < 1e-7);
}

#[test]
fn nothing_controlled_is_one_long_step_to_until() {
    let mut rhs = |t: f64, _: &[f64], slope: &mut [f64]| slope[0] = t;
    let mut solver = Dop853::new(1e-9, &[f64::INFINITY]);
    solver.start(0.0, &[0.0], &mut rhs);
    while solver.time < 100.0 {
        solver.step(100.0, &mut rhs).unwrap();
    }
    assert!((solver.state[0] - 5000.0).abs() < 1e-9);
    // From 1e-6 on, doubled each time.
    assert!(solver.counts.accepted < 30);
}

#[test]
fn stability_limited_steps_are_rarely_rejected() {
    // x' = -1000 (x - cos t): after the transient the step hangs on the border of stability.
    let mut rhs = |t: f64, x: &[f64], slope: &mut [f64]| slope[0] = -1000.0 * (x[0] - cos(t));
    let mut solver = Dop853::new(1e-6, &[1e-6]);
    solver.start(0.0, &[0.0], &mut rhs);
    while solver.time < 3.0 {
        solver.step(3.0, &mut rhs).unwrap();
    }
    let counts = solver.counts;
    assert!(counts.rejected * 4 < counts.accepted, "{counts:?}");
    // x = (λ² cos t + λ sin t)/(1 + λ²)
    let exact = (1e6 * cos(3.0) + 1e3 * sin(3.0)) / (1e6 + 1.0);
    assert!((solver.state[0] - exact).abs() < 1e-5);
}
