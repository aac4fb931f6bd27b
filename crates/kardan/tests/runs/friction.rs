//! Set-valued friction: the convex problem behind it, and drivetrains that stick and slip.

use kardan::results::{Outcome, Run};
use kardan::simulate::friction::{Bounds, BoxProblem};
use kardan::simulate::{Machine, Setup};
use kardan::study;
use proptest::prelude::*;

#[derive(Debug, Clone)]
struct Problem {
    w: Vec<f64>,
    r: Vec<f64>,
    /// The largest torques against motion forward and backward.
    c: Vec<f64>,
    b: Vec<f64>,
    room: usize,
}

fn problems() -> impl Strategy<Value = Problem> {
    (1usize..9, 0usize..9, 0usize..4).prop_flat_map(|(m, rank, more)| {
        let entry = prop_oneof![2 => -1.0..1.0f64, 1 => (-2i32..3).prop_map(f64::from)];
        (
            prop::collection::vec(prop::collection::vec(entry.clone(), rank), m),
            prop::collection::vec(-6.0..6.0f64, m),
            prop::bool::ANY,
            prop::collection::vec(prop::option::weighted(0.2, 0..m), m),
            prop::collection::vec(entry.clone(), rank),
            -6.0..6.0f64,
            prop::collection::vec(prop_oneof![3 => Just(0.0), 1 => entry], m),
            prop::collection::vec((-6.0..3.0f64, prop_oneof![3 => Just(1.0), 1 => Just(0.0), 1 => 0.01..10.0f64]), m),
        )
            .prop_map(move |(mut g, scale, scaled, copies, x, load, outside, c)| {
                for i in 0..m {
                    if let Some(other) = copies[i] {
                        g[i] = g[other].clone();
                    }
                }
                let size = |i: usize| if scaled { 10f64.powf(0.5 * scale[i]) } else { 1.0 };
                let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                let w = (0..m * m).map(|k| dot(&g[k / m], &g[k % m]) * size(k / m) * size(k % m)).collect();
                let load = 10f64.powf(load);
                let r = (0..m).map(|i| (dot(&g[i], &x) + outside[i]) * size(i) * load).collect();
                let b = c.iter().map(|(c, part)| part * 10f64.powf(*c)).collect();
                Problem { w, r, c: c.iter().map(|(c, _)| 10f64.powf(*c)).collect(), b, room: m + more }
            })
    })
}

/// The largest violation of the optimality conditions, relative to the size of each row.
fn violation(p: &Problem, lambda: &[f64]) -> f64 {
    let m = p.r.len();
    (0..m)
        .map(|i| {
            let row = &p.w[i * m..(i + 1) * m];
            let alpha = p.r[i] - row.iter().zip(lambda).map(|(w, x)| w * x).sum::<f64>();
            let size = p.r[i].abs() + row.iter().zip(&p.c).map(|(w, c)| (w * c).abs()).sum::<f64>();
            let inside = -p.b[i] <= lambda[i] && lambda[i] <= p.c[i];
            let wrong = if lambda[i] == p.c[i] {
                (-alpha).max(0.0)
            } else if lambda[i] == -p.b[i] {
                alpha.max(0.0)
            } else {
                alpha.abs()
            };
            if !inside {
                f64::INFINITY
            } else if wrong == 0.0 {
                0.0
            } else {
                wrong / size
            }
        })
        .fold(0.0, f64::max)
}

fn objective(p: &Problem, x: &[f64]) -> f64 {
    let m = x.len();
    (0..m).map(|i| x[i] * ((0..m).map(|j| 0.5 * p.w[i * m + j] * x[j]).sum::<f64>() - p.r[i])).sum()
}

fn gauss_seidel(p: &Problem, sweeps: usize) -> Vec<f64> {
    let m = p.r.len();
    let mut x = vec![0.0; m];
    for _ in 0..sweeps {
        for i in (0..m).filter(|i| p.w[i * m + i] > 0.0) {
            let residual = p.r[i] - (0..m).map(|j| p.w[i * m + j] * x[j]).sum::<f64>();
            x[i] = (x[i] + residual / p.w[i * m + i]).clamp(-p.b[i], p.c[i]);
        }
    }
    x
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, failure_persistence: None, ..ProptestConfig::default() })]

    /// Against the optimality conditions, and against projected Gauss-Seidel: nothing that finds has a lower objective.
    #[test]
    fn box_problem_reaches_the_optimum(p in problems()) {
        let mut lambda = vec![0.0; p.r.len()];
        let done = BoxProblem::new(p.room).solve(&p.w, &p.r, Bounds { forward: &p.c, backward: &p.b }, &mut lambda);
        let violation = violation(&p, &lambda);
        prop_assert!(done && violation < 1e-9, "{done} {violation:e} {lambda:?}");
        let (ours, theirs) = (objective(&p, &lambda), objective(&p, &gauss_seidel(&p, 2000)));
        let size: f64 = p.r.iter().zip(&p.c).map(|(r, c)| (r * c).abs()).sum();
        prop_assert!(ours <= theirs + 1e-9 * size, "{ours} > {theirs}");
    }
}

/// Three wheels that freewheels and two stops hold in more ways than one, `a₀ ≥ 0`, `a₁ ≥ a₀`, `a₂ ≥ a₁`, `a₁ ≤ 0`, `a₂ ≤ 0`: nothing moves, and what
/// rounding makes of the torques that hold is no contradiction; that one of them accelerates on its own is.
#[test]
fn rounding_of_constraint_torques_is_no_contradiction() {
    let (inertia, ratio) = ([0.04, 0.06, 0.03 + 0.01 * (7.0f64 / 19.0).powi(2)], 7.0 / 19.0);
    let rows = [[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [0.0, -1.0, 1.0], [0.0, -1.0, 0.0], [0.0, 0.0, -ratio]];
    let w: Vec<f64> = (0..25).map(|i| (0..3).map(|k| rows[i / 5][k] * rows[i % 5][k] / inertia[k]).sum()).collect();
    let (free, inf) = ([0.0; 5], [f64::INFINITY; 5]);
    for f in [6.3e-12, 0.0, -6.3e-12, 1e-9, 1e-13] {
        let force = [-3.490493448979821, f, 0.0];
        let r: Vec<f64> = rows.iter().map(|row| (0..3).map(|k| row[k] * force[k] / inertia[k]).sum()).collect();
        let mut lambda = [0.0; 5];
        let (mut problem, bounds) = (BoxProblem::new(5), Bounds { forward: &free, backward: &inf });
        assert!(problem.solve(&w, &r, bounds, &mut lambda), "{f:e} {:?}", problem.unbounded());
        for (i, r) in r.iter().enumerate() {
            let residual = r - (0..5).map(|j| w[5 * i + j] * lambda[j]).sum::<f64>();
            assert!(residual.abs() <= 1e-12 * 87.3, "{f:e}: {residual:e} along {i}");
        }
        // Along the last one a speed is prescribed that changes.
        let mut pressed = r.clone();
        pressed[4] -= 1e-3;
        assert!(!problem.solve(&w, &pressed, bounds, &mut lambda) && !problem.unbounded().is_empty(), "{f:e}");
    }
}

fn run(source: &str) -> Run {
    let study = crate::common::project(source).run(&crate::common::runs_only(), &study::Silent);
    study.unwrap_or_else(|found| panic!("{found:?}")).runs.remove(0)
}

fn values<'a>(run: &'a Run, signal: &str) -> &'a [f64] {
    &run.series.signal(signal).unwrap_or_else(|| panic!("no signal {signal}")).values
}

fn balanced(run: &Run) {
    let energy = &run.energy;
    let size = energy.input.abs().max(energy.stored.abs()).max(energy.dissipated);
    assert_eq!(run.outcome, Outcome::Completed);
    assert!(energy.residual.abs() <= 1e-8 * size, "{energy:?}");
}

/// The step that the motor or road makes, exactly at the Coulomb torque and next to it:
///
/// ```text
///     T --> [ a ]--c--///
/// ```
#[test]
fn a_torque_of_exactly_c_does_not_move_it() {
    for torque in [0.1f64.next_down(), 0.1, 0.1f64.next_up()] {
        let run = run(&format!(
            r#"
            [shaft.a]
            inertia = "0.01 kg m^2"
            friction = "0.1 N m"
            [disturbance.T]
            shaft = "a"
            [scenario]
            duration = "2 s"
            [[scenario.event]]
            at = "0.5 s"
            signal = "T"
            to = "{torque:?} N m"
            "#
        ));
        balanced(&run);
        assert!(values(&run, "a.phi").iter().all(|x| *x == 0.0), "creeps at {torque:?} N m");
    }
}

/// A ramp of 0.2 N m/s breaks away at `t₁ = c/0.2 = 0.5 s`; from there `J φ = 0.2 (t − t₁)³/6`.
#[test]
fn a_ramp_breaks_away_on_time() {
    let run = run(r#"
        [shaft.a]
        inertia = "0.01 kg m^2"
        friction = "0.1 N m"
        [disturbance.T]
        shaft = "a"
        [scenario]
        duration = "1 s"
        [[scenario.event]]
        at = "0 s"
        signal = "T"
        to = "0.2 N m"
        over = "1 s"
    "#);
    balanced(&run);
    for (t, phi) in run.series.time.iter().zip(values(&run, "a.phi")) {
        let expected = 20.0 * (t - 0.5).max(0.0).powi(3) / 6.0;
        assert!((phi - expected).abs() < 1e-8, "{phi} against {expected} at {t} s");
    }
}

/// Free decay: every half turn of the motion takes 2 c/k off the amplitude, until the spring no longer overcomes c.
///
/// ```text
///     ///==/\/\/==[ a ]--c--///      k = 10 N m/rad, c = 0.1 N m, from 0.105 rad
/// ```
///
/// With gears the same holds for five shafts that all reverse at once, their friction directions all dependent.
#[test]
fn free_decay_stops_after_five_half_turns() {
    let gear = |k: usize| {
        format!(
            "[shaft.g{k}]\ninertia = \"0.01 kg m^2\"\nfriction = \"0.01 N m\"\n\
             [gear.gear{k}]\nshaft_1 = \"a\"\nshaft_2 = \"g{k}\"\nratio = \"{}\"\n",
            if k.is_multiple_of(2) { "-1/2" } else { "2" }
        )
    };
    // Shafts at -2 and 1/2 times the speed of a: inertias and Coulomb torques add up to what the single shaft has.
    let gears: String = (0..4).map(gear).collect();
    let single_shaft = ("0.01", "0.1", String::new());
    let geared = ("0.01", "0.05", gears);
    for (inertia, friction, more) in [single_shaft, geared] {
        let single = more.is_empty();
        let run = run(&format!(
            r#"
            [model]
            coordinates = ["a"]
            [shaft.a]
            inertia = "{inertia} kg m^2"
            friction = "{friction} N m"
            [spring_damper.k]
            shaft_1 = "a"
            stiffness = "10 N m/rad"
            {more}
            [scenario]
            duration = "3 s"
            initial = {{ "a.phi" = "0.105 rad" }}
            "#
        ));
        balanced(&run);
        // 0.05 + 2·2·0.01 + 2·0.01/2 = 0.1 N m; 0.01 + 2·4·0.01 + 2·0.01/4 = 0.095 kg m².
        let omega = if single { 1000f64.sqrt() } else { (10.0f64 / 0.095).sqrt() };
        let half = std::f64::consts::PI / omega;
        let mut times: Vec<f64> = run.events.iter().map(|event| event.time).collect();
        times.dedup();
        assert_eq!(times.len(), 5, "{:?}", run.events);
        for (k, time) in times.iter().enumerate() {
            assert!((time - half * (k + 1) as f64).abs() < 1e-9, "{time}");
        }
        let at_rest = run.series.time.iter().position(|t| *t > times[4]).expect("it stops");
        let phi = &values(&run, "a.phi")[at_rest..];
        assert!((phi[0] + 0.005).abs() < 1e-9, "stops at {}", phi[0]);
        assert!(phi.iter().all(|x| *x == phi[0]), "creeps");
        assert_eq!(run.notes.is_empty(), single);
    }
}

/// A mass pulled through a spring by a shaft at constant speed v sticks until `k v t = c`, then turns with
/// `v (1 − cos ω t)`, and touches rest once a turn exactly when the spring is at c again.
///
/// ```text
///     v --> [ drive ]==/\/\/==[ mass ]--c--///
/// ```
#[test]
fn pulled_mass_touches_rest_at_the_limit() {
    let run = run(r#"
        [model]
        coordinates = ["drive", "mass"]
        [shaft.drive]
        inertia = "1e9 kg m^2"
        [shaft.mass]
        inertia = "0.01 kg m^2"
        friction = "0.5 N m"
        [spring_damper.k]
        shaft_1 = "drive"
        shaft_2 = "mass"
        stiffness = "10 N m/rad"
        [scenario]
        duration = "10 s"
        initial = { "drive.w" = "0.1 rad/s" }
    "#);
    assert_eq!(run.outcome, Outcome::Completed);
    // Against the 5e6 J of the drive.
    assert!(run.energy.residual.abs() < 1e-7, "{:?}", run.energy);
    let (v, omega) = (0.1, 1000f64.sqrt());
    for (t, phi) in run.series.time.iter().zip(values(&run, "mass.phi")) {
        let slip = (t - 0.5f64).max(0.0);
        let expected = v * (slip - (omega * slip).sin() / omega);
        assert!((phi - expected).abs() < 1e-7, "{phi} against {expected} at {t} s");
    }
    assert!(run.effort.events < 250, "{} events", run.effort.events);
}

/// Five shafts, friction on each and in each spring: against time stepping by Moreau with its own projected
/// Gauss-Seidel, which knows no events, modes or reduction. Error of order dt, halved away by Richardson.
///
/// ```text
///     T --> [s0]==/\/\/==[s1]==/\/\/==[s2]==/\/\/==[s3]==/\/\/==[s4]
///            |c   c        |c    ...
/// ```
#[test]
fn chain_agrees_with_time_stepping() {
    const N: usize = 5;
    let inertia = |i: usize| 0.01 * (1 + i % 3) as f64;
    let ground = |i: usize| 0.1 * (1 + i % 4) as f64;
    let stiffness = |i: usize| 100.0 * (1 + i % 2) as f64;
    let (between, damping) = (0.05, 0.02);
    let mut source = String::from(
        "[model]\ncoordinates = [\"s0\", \"s1\", \"s2\", \"s3\", \"s4\"]\n[disturbance.T]\nshaft = \"s0\"\n",
    );
    for i in 0..N {
        source += &format!("[shaft.s{i}]\ninertia = \"{} kg m^2\"\nfriction = \"{} N m\"\n", inertia(i), ground(i));
    }
    for i in 0..N - 1 {
        source += &format!(
            "[spring_damper.k{i}]\nshaft_1 = \"s{i}\"\nshaft_2 = \"s{}\"\nstiffness = \"{} N m/rad\"\n\
             damping = \"{damping} N m s/rad\"\nfriction = \"{between} N m\"\n",
            i + 1,
            stiffness(i)
        );
    }
    source += "[scenario]\nduration = \"1 s\"\n\
               [[scenario.event]]\nat = \"0 s\"\nsignal = \"T\"\nto = \"3 N m\"\n\
               [[scenario.event]]\nat = \"0.25 s\"\nsignal = \"T\"\nto = \"-1 N m\"\n";
    let run = run(&source);
    balanced(&run);
    let reference = |steps: usize| {
        let dt = 1.0 / steps as f64;
        let (mut q, mut v) = ([0.0; N], [0.0; N]);
        let mut p = [0.0; 2 * N - 1];
        for step in 0..steps {
            let mut force = [0.0; N];
            force[0] = if step < steps / 4 { 3.0 } else { -1.0 };
            for i in 0..N - 1 {
                let torque = stiffness(i) * (q[i] - q[i + 1]) + damping * (v[i] - v[i + 1]);
                force[i] -= torque;
                force[i + 1] += torque;
            }
            for i in 0..N {
                v[i] += dt * force[i] / inertia(i);
            }
            let push = |v: &mut [f64; N], k: usize, impulse: f64| {
                if k < N {
                    v[k] -= impulse / inertia(k);
                } else {
                    v[k - N] -= impulse / inertia(k - N);
                    v[k - N + 1] += impulse / inertia(k - N + 1);
                }
            };
            (0..2 * N - 1).for_each(|k| push(&mut v, k, p[k]));
            for _ in 0..60 {
                for k in 0..2 * N - 1 {
                    let (c, speed, w) = if k < N {
                        (ground(k), v[k], 1.0 / inertia(k))
                    } else {
                        (between, v[k - N] - v[k - N + 1], 1.0 / inertia(k - N) + 1.0 / inertia(k - N + 1))
                    };
                    let new = (p[k] + speed / w).clamp(-c * dt, c * dt);
                    push(&mut v, k, new - p[k]);
                    p[k] = new;
                }
            }
            (0..N).for_each(|i| q[i] += dt * v[i]);
        }
        q
    };
    let (coarse, fine) = (reference(40_000), reference(80_000));
    for i in 0..N {
        let ours = *values(&run, &format!("s{i}.phi")).last().expect("rows");
        let theirs = 2.0 * fine[i] - coarse[i];
        assert!(
            (ours - theirs).abs() < 2e-5 + (fine[i] - coarse[i]).abs(),
            "s{i}: {ours} against {theirs} ({})",
            fine[i]
        );
    }
    assert!(run.effort.events > 10, "the test sees no friction events");
}

fn position_loop(motor: &str) -> Run {
    run(&format!(
        r#"
        [model]
        coordinates = ["a", "b"]
        [shaft.a]
        inertia = "0.05 kg m^2"
        friction = "0.1 N m"
        [shaft.b]
        inertia = "0.02 kg m^2"
        [spring_damper.k]
        shaft_1 = "a"
        shaft_2 = "b"
        stiffness = "50 N m/rad"
        [motor.m]
        shaft = "a"
        {motor}
        [control.p]
        law = "position_loop"
        output = "a.phi"
        input = "m"
        natural_frequency = "20 rad/s"
        damping_ratio = 0.7
        reference = "ref"
        [scenario]
        duration = "4 s"
        initial = {{ "b.phi" = "1 rad" }}
        [[scenario.event]]
        at = "0 s"
        signal = "ref"
        to = "90 deg"
        [[scenario.event]]
        at = "2 s"
        signal = "ref"
        to = "-90 deg"
        over = "0.5 s"
        "#
    ))
}

/// The torque is the clamped command in every row, through hundreds of entries into the limit and ways out.
#[test]
fn torque_limit_is_entered_and_exited_on_time() {
    let run = position_loop("torque_limit = \"1 N m\"");
    balanced(&run);
    let (torque, command) = (values(&run, "m.tau"), values(&run, "m.command"));
    for ((torque, command), t) in torque.iter().zip(command).zip(&run.series.time) {
        assert!((torque - command.clamp(-1.0, 1.0)).abs() < 1e-9, "{torque} for {command} at {t} s");
    }
    assert!(torque.contains(&1.0) && torque.contains(&-1.0) && torque.iter().any(|x| x.abs() < 0.9));
}

/// Limit, then rate limit: the torque never changes faster than allowed, and where it differs from the limited command
/// it moves towards it at full rate.
#[test]
fn rate_limit_is_respected_and_used() {
    let run = position_loop("torque_limit = \"1 N m\"\nrate_limit = \"20 N m/s\"");
    balanced(&run);
    let (time, torque, command) = (&run.series.time, values(&run, "m.tau"), values(&run, "m.command"));
    let (mut followed, mut limited) = (0, 0);
    for k in 1..time.len() {
        let rate = (torque[k] - torque[k - 1]) / (time[k] - time[k - 1]);
        assert!(rate.abs() <= 20.0 * (1.0 + 1e-6), "{rate} N m/s at {} s", time[k]);
        let gaps = [k - 1, k].map(|k| command[k].clamp(-1.0, 1.0) - torque[k]);
        if gaps.iter().all(|gap| gap.abs() < 1e-9) {
            followed += 1;
        } else if gaps.iter().all(|gap| gap.abs() > 0.05) && gaps[0] * gaps[1] > 0.0 {
            limited += 1;
            assert!((rate - 20.0 * gaps[0].signum()).abs() < 1e-4, "{rate} N m/s at {} s, gaps {gaps:?}", time[k]);
        }
    }
    assert!(followed > 100 && limited > 100, "{followed} {limited}");
}

/// Three frictions share the torque of one ramp. About the limit an event is seen exactly where the modes decided there are other ones; seen
/// but not done it would be seen again at the next number of the time, and end the run as chatter.
#[test]
fn an_event_is_detected_where_it_happens() {
    let text = r#"
        [shaft.a]
        inertia = "0.013 kg m^2"
        friction = "0.11 N m"
        [shaft.b]
        inertia = "0.0037 kg m^2"
        friction = "0.0123 N m"
        [shaft.c]
        inertia = "0.00071 kg m^2"
        friction = "0.00457 N m"
        [gear.ab]
        shaft_1 = "b"
        shaft_2 = "a"
        ratio = "-3.7"
        [gear.bc]
        shaft_1 = "c"
        shaft_2 = "b"
        ratio = "2.3"
        [shaft.d]
        inertia = "0.0021 kg m^2"
        friction = "0.3 N m"
        [shaft.e]
        inertia = "0.00053 kg m^2"
        friction = "0.7 N m"
        [spring_damper.cd]
        shaft_1 = "c"
        shaft_2 = "d"
        stiffness = "31 N m/rad"
        [spring_damper.de]
        shaft_1 = "d"
        shaft_2 = "e"
        stiffness = "17 N m/rad"
        [disturbance.load]
        shaft = "a"
        [scenario]
        duration = "1 s"
        [[scenario.event]]
        at = "0 s"
        signal = "load"
        to = "0.5 N m"
        over = "1 s"
    "#;
    let (prepared, diagnostics) = kardan::study::prepare(text);
    let variant = prepared.variants.first().unwrap_or_else(|| panic!("{diagnostics:?}"));
    let setup = Setup { reduced: &variant.reduced, laws: &variant.implemented, scenario: &variant.scenario };
    // A torque of a that moves nothing: what all three hold.
    let limit = (0.11 + 3.7 * 0.0123 + 3.7 * 2.3 * 0.00457) / 0.5;
    // Whether an event is seen there, and whether it happens.
    let both = |k: u64| {
        let time = f64::from_bits(f64::to_bits(limit) + k);
        let mut machine = Machine::new(setup);
        let mut state = vec![0.0; machine.size()];
        machine.enter_segment(0.0);
        machine.select_modes(0.0, &mut state, &[], true);
        let detected = machine.breaks_away(time, &state);
        (detected, !machine.select_modes(time, &mut state, &[], false).is_empty())
    };
    // An excess counts from 1e-12 of what cancels in it on, which is some ten thousand units.
    let (mut low, mut high) = (0, 100_000);
    assert!(!both(low).1 && both(high).1);
    while high - low > 1 {
        let middle = (low + high) / 2;
        if both(middle).1 { high = middle } else { low = middle }
    }
    for k in high - 500..high + 500 {
        let (detected, happens) = both(k);
        assert_eq!(detected, happens, "{k}, the limit is at {high}");
    }
}

/// What is no number is named, with its time.
#[test]
fn what_is_no_number_is_named() {
    let text = |inertia: &str, torque: &str| {
        format!(
            "[shaft.a]\ninertia = \"{inertia} kg m^2\"\n[disturbance.T]\nshaft = \"a\"\n[scenario]\nduration = \"2 s\"\n\
             [[scenario.event]]\nat = \"0.5 s\"\nsignal = \"T\"\nto = \"{torque} N m\"\n"
        )
    };
    let Outcome::Failed { time, cause } = run(&text("1e-6", "1e305")).outcome else { panic!("it overflows") };
    assert!(time == 0.5 && cause.contains("the acceleration of a is inf"), "{time} {cause}");
    // With the operation that made it.
    let two = text("1", "1e308").replace("[scenario]", "[disturbance.U]\nshaft = \"a\"\n[scenario]")
        + "[[scenario.event]]\nat = \"0.5 s\"\nsignal = \"U\"\nto = \"1e308 N m\"\n";
    let Outcome::Failed { time, cause } = run(&two).outcome else { panic!("it overflows") };
    let named = cause.contains("the force on a is inf, as T + U = ") && cause.contains(" is inf:");
    assert!(time == 0.5 && named, "{time} {cause}");
}

/// A run that diverges says so and keeps what it has; energy and rows end together.
#[test]
fn divergence_keeps_partial_results() {
    let run = run(r#"
        [shaft.a]
        inertia = "1e-6 kg m^2"
        [disturbance.T]
        shaft = "a"
        [scenario]
        duration = "20 s"
        output_step = "10 ms"
        [[scenario.event]]
        at = "0.5 s"
        signal = "T"
        to = "1 N m"
    "#);
    let Outcome::Failed { time, cause } = &run.outcome else { panic!("it reaches 1e6 rad/s after 1 s") };
    assert!(
        (*time >= 1.5) && *time <= 20.0 && cause.contains("grows without bound") && cause.contains("a.w"),
        "{time} {cause}"
    );
    let last = *run.series.time.last().expect("rows");
    assert!(last < *time && last >= 0.5);
    assert!(
        run.series
            .signals
            .iter()
            .all(|s| s.values.len() == run.series.time.len() && s.values.iter().all(|x| x.is_finite()))
    );
    assert!(run.energy.residual.abs() < 1e-9 * run.energy.input, "{:?}", run.energy);
}

/// ```text
///   a ===+ 60°        b = γ(a),  c = b − a:  w_c = (γ′ − 1) w_a
///         \\=== b      reverses four times a turn while a moves on
///   planetary: b − a − c = 0, friction on c
/// ```
///
/// A direction that reverses because its coefficients cancel must not stop the drive. The loss is the Coulomb torque times
/// the way of c, which swings between ±atan((1−C)/(2√C)) with C = cos 60°.
#[test]
fn a_direction_that_cancels_does_not_stop_the_drive() {
    let torque = 0.05;
    let model = "[model]\ncoordinates = [\"a\"]\n[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"0.01 kg m^2\"\n\
        [shaft.c]\nfriction = \"0.05 N m\"\n[universal_joint.j]\nshaft_1 = \"b\"\nshaft_2 = \"a\"\nangle = \"60 deg\"\n\
        [planetary.p]\ncoefficients = { b = 1, a = -1, c = -1 }\n\
        [scenario]\nduration = \"3 s\"\ninitial = { \"a.w\" = \"10 rad/s\" }\n";
    let run = study::run(model, &crate::common::runs_only(), &study::Silent).expect("a right model").runs.remove(0);
    let last = |name: &str| *run.series.signal(name).expect(name).values.last().expect("rows");
    assert!(run.series.signal("a.w").expect("a.w").values.iter().all(|w| *w > 5.0), "the drive moves on");
    let c = 0.5_f64;
    let swing = ((1.0 - c) / (2.0 * c.sqrt())).atan();
    let extreme = (1.0 / c.sqrt()).atan();
    let half_turns = (last("a.phi") / std::f64::consts::PI).floor();
    let remainder = last("a.phi") - half_turns * std::f64::consts::PI;
    let difference = last("c.phi");
    let way = 4.0 * swing * half_turns
        + match remainder {
            y if y <= extreme => -difference,
            y if y <= std::f64::consts::PI - extreme => 2.0 * swing + difference,
            _ => 4.0 * swing - difference,
        };
    assert!(way > 10.0, "several turns");
    // The step control holds each of some hundred steps to 1e-9 J.
    assert!((run.energy.dissipated - torque * way).abs() < 1e-7, "{} against {}", run.energy.dissipated, torque * way);
    assert!(run.energy.residual.abs() < 1e-7);
}

/// Friction of the shaft `a`: what holds, what slides, and the speed between.
const BREAKAWAY: f64 = 0.1;
const SLIDING: f64 = 0.06;
const SPEED: f64 = 0.5;

fn falling(speed: f64) -> f64 {
    SLIDING + (BREAKAWAY - SLIDING) * (-(speed / SPEED).powi(2)).exp()
}

/// ```text
///     T --> [ a ]--c(w)--///
/// ```
fn pulled(keys: &str, events: &str) -> Run {
    run(&format!(
        "[shaft.a]\ninertia = \"0.01 kg m^2\"\nfriction = \"{SLIDING} N m\"\n{keys}\n[disturbance.T]\nshaft = \"a\"\n\
         [scenario]\nduration = \"2 s\"\n{events}"
    ))
}

fn event(at: f64, to: f64, over: f64) -> String {
    format!("[[scenario.event]]\nat = \"{at} s\"\nsignal = \"T\"\nto = \"{to} N m\"\nover = \"{over} s\"\n")
}

const STRIBECK: &str = "breakaway = \"0.1 N m\"\nstribeck_speed = \"0.5 rad/s\"";

/// At rest up to the breakaway torque either way, then `J ẇ = T − c(w)`, that is `t = ∫ J dw / (T − c(w))`: the quadrature
/// (Simpson, 2000 intervals, error below 1e-12) knows nothing of the integration over time. The shown torque is the law's.
#[test]
fn friction_falls_from_breakaway_as_speed_grows() {
    for torque in [BREAKAWAY.next_down(), BREAKAWAY] {
        let still = pulled(STRIBECK, &event(0.5, -torque, 0.0));
        assert!(values(&still, "a.phi").iter().all(|x| *x == 0.0), "creeps at {torque:?} N m");
    }
    let torque = 0.13;
    let moving = pulled(STRIBECK, &event(0.5, torque, 0.0));
    balanced(&moving);
    let (speeds, shown) = (values(&moving, "a.w"), values(&moving, "a.friction"));
    let mut compared = 0;
    for (k, t) in moving.series.time.iter().enumerate().filter(|(_, t)| **t > 0.5) {
        let (w, n) = (speeds[k], 2000);
        let at = |i: usize| 0.01 / (torque - falling(w * i as f64 / n as f64));
        let inner: f64 = (1..n).map(|i| if i % 2 == 1 { 4.0 } else { 2.0 } * at(i)).sum();
        let expected = w / (3.0 * n as f64) * (at(0) + inner + at(n));
        assert!((t - 0.5 - expected).abs() < 1e-8, "{w} rad/s at {t} s, expected {expected} s later");
        assert!((shown[k] - falling(w)).abs() < 1e-15, "{} at {w} rad/s", shown[k]);
        compared += 1;
    }
    assert!(compared > 1000 && speeds.last().is_some_and(|w| *w > 5.0 * SPEED));
}

/// Steady sliding against a damper: `T = d w + c(w)` at the end.
#[test]
fn steady_sliding_balances_the_law() {
    let run = pulled(&format!("{STRIBECK}\ndamping = \"0.2 N m s/rad\""), &event(0.1, 0.2, 0.0));
    balanced(&run);
    let w = *values(&run, "a.w").last().unwrap();
    assert!(w > 0.2 && (0.2 - 0.2 * w - falling(w)).abs() < 1e-7, "{w}");
}

/// A breakaway torque equal to the friction is plain Coulomb friction, to the last bit.
#[test]
fn equal_breakaway_is_coulomb_friction() {
    let events = event(0.1, 0.2, 0.3) + &event(0.6, -0.3, 0.1) + &event(1.2, 0.0, 0.2);
    let same = "breakaway = \"0.06 N m\"\nstribeck_speed = \"1 rad/s\"";
    let (with_breakaway, coulomb) = (pulled(same, &events), pulled("", &events));
    assert_eq!((&with_breakaway.series, &with_breakaway.events), (&coulomb.series, &coulomb.events));
    assert!(
        with_breakaway.events.iter().filter(|event| event.description.starts_with("a slips")).count() >= 2,
        "{:?}",
        with_breakaway.events
    );
}

/// Pulled through a spring at constant speed below v_s, the mass jerks: every rest ends with the spring at the breakaway torque.
///
/// ```text
///     v --> [ drive ]==/\/\/==[ mass ]--c(w)--///
/// ```
#[test]
fn a_pulled_mass_jerks() {
    let run = run(r#"
        [model]
        coordinates = ["drive", "mass"]
        [shaft.drive]
        inertia = "1e6 kg m^2"
        [shaft.mass]
        inertia = "0.01 kg m^2"
        friction = "0.06 N m"
        breakaway = "0.1 N m"
        stribeck_speed = "0.5 rad/s"
        [spring_damper.k]
        shaft_1 = "drive"
        shaft_2 = "mass"
        stiffness = "10 N m/rad"
        [scenario]
        duration = "3 s"
        initial = { "drive.w" = "0.02 rad/s" }
    "#);
    balanced(&run);
    let breaks: Vec<f64> =
        run.events.iter().filter(|e| e.description == "mass slips forward").map(|e| e.time).collect();
    let rests = run.events.iter().filter(|e| e.description == "mass sticks").count();
    assert!(breaks.len() >= 4 && rests >= breaks.len() - 1, "{:?}", run.events);
    // k v t = c_b for the first time; the drive of 1e6 kg m² keeps its speed to 1e-6.
    assert!((breaks[0] - 0.5).abs() < 1e-5, "{}", breaks[0]);
    let (time, spring) = (&run.series.time, values(&run, "k.tau"));
    for at in &breaks {
        let row = time.iter().position(|t| t > at).unwrap();
        // Between two rows the spring goes on by 10 N m/rad · 0.02 rad/s · 1 ms.
        assert!((spring[row - 1] - BREAKAWAY).abs() < 3e-4, "{} at {at} s", spring[row - 1]);
    }
    assert!(values(&run, "mass.friction").iter().all(|x| x.abs() <= BREAKAWAY * (1.0 + 1e-12)));
}

/// Events of a run without what the scenario does.
fn changes(run: &Run) -> Vec<(f64, String)> {
    let happened =
        run.events.iter().filter(|event| event.description.contains("slips") || event.description.contains("sticks"));
    happened.map(|event| (event.time, event.description.clone())).collect()
}

fn near(value: f64, expected: f64, relative: f64) {
    assert!((value - expected).abs() <= relative * expected.abs(), "{value:e} against {expected:e}");
}

/// A torque of `1 + ε` times the friction for 1 ms, then half of it, from the time `at` on.
fn nudge(at: f64) -> String {
    event(at, 1.0001, 0.0) + &event(at + 1e-3, 0.5, 0.0)
}

/// `ẇ = ε c/J` for 1 ms, then `ẇ = −c/2J`: 1e-7 rad/s at most, at rest again 0.2 us later, after
/// `½ 1e-4 (1e-3)² + ½ 1e-7 · 2e-7` rad.
#[test]
fn a_minimal_slip_is_one_slip() {
    let model = "[shaft.a]\ninertia = \"1 kg m^2\"\nfriction = \"1 N m\"\n[disturbance.T]\nshaft = \"a\"\n\
                 [scenario]\nduration = \"1 s\"\n";
    let run = run(&(model.to_string() + &nudge(0.1)));
    assert_eq!(run.outcome, Outcome::Completed);
    let found = changes(&run);
    assert_eq!(found.iter().map(|(_, what)| what.as_str()).collect::<Vec<_>>(), ["a slips forward", "a sticks"]);
    assert_eq!(found[0].0, 0.1);
    assert!((found[1].0 - 0.101 - 2e-7).abs() < 1e-12, "{:?}", found[1].0);
    near(*values(&run, "a.phi").last().expect("rows"), 5.001e-11, 1e-6);
    assert_eq!(*values(&run, "a.w").last().expect("rows"), 0.0);
}

/// What happens at 2 s does not know that the shaft turned with 500 rad/s before: times and speeds of the same slip.
#[test]
fn a_fast_phase_before_changes_nothing() {
    let model = "[shaft.a]\ninertia = \"1 kg m^2\"\nfriction = \"1 N m\"\n[disturbance.T]\nshaft = \"a\"\n\
                 [scenario]\nduration = \"3 s\"\n";
    let before = event(0.0, 1001.0, 0.0) + &event(0.5, -999.0, 0.0) + &event(0.9995, 0.0, 0.0);
    let run = run(&(model.to_string() + &before + &nudge(2.0)));
    assert_eq!(run.outcome, Outcome::Completed);
    let found = changes(&run);
    let descriptions: Vec<&str> = found.iter().map(|(_, what)| what.as_str()).collect();
    // It slips from the beginning on, which is no event.
    assert_eq!(descriptions, ["a sticks", "a slips forward", "a sticks"], "{found:?}");
    // 500 rad/s, less 1000 rad/s² over 0.4995 s, less 1 rad/s².
    assert!((found[0].0 - 1.4995).abs() < 1e-9, "{}", found[0].0);
    assert_eq!(found[1].0, 2.0);
    assert!((found[2].0 - 2.001 - 2e-7).abs() < 1e-12, "{}", found[2].0);
    let row = run.series.time.iter().position(|t| *t == 2.001).expect("a row at the event");
    near(values(&run, "a.w")[row], 1e-7, 1e-6);
}

/// `w = (10 − 5) 0.2/1e8 = 1e-8 rad/s`, then `−5e-8 rad/s²`: at rest after another 0.2 s and 2e-9 rad.
#[test]
fn a_heavy_mass_stops_once() {
    let run = run(r#"
        [shaft.a]
        inertia = "1e8 kg m^2"
        friction = "5 N m"
        [disturbance.T]
        shaft = "a"
        [scenario]
        duration = "1 s"
        [[scenario.event]]
        at = "0.1 s"
        signal = "T"
        to = "10 N m"
        [[scenario.event]]
        at = "0.3 s"
        signal = "T"
        to = "0 N m"
    "#);
    assert_eq!(run.outcome, Outcome::Completed);
    let found = changes(&run);
    assert_eq!((found.len(), run.effort.events), (2, 1), "{found:?}");
    assert!((found[0].0 - 0.1).abs() == 0.0 && (found[1].0 - 0.5).abs() < 1e-9, "{found:?}");
    near(*values(&run, "a.phi").last().expect("rows"), 2e-9, 1e-6);
}

/// A torque sine whose peak is `1 + ε` times what the friction holds, from an oscillator so heavy that nothing disturbs it. The
/// reference integrates `J φ̈ = c [(1 + ε) cos u − 1] − k φ`, `u = ω (t − t_peak)`, from `cos u = 1/(1 + ε)` on by
/// Runge-Kutta steps of a hundred-thousandth of the slip, the bracket written as `ε cos u − 2 sin²(u/2)`, so that nothing cancels.
/// With Stribeck friction the same: at 1e-9 rad/s nothing of it has fallen.
///
/// ```text
///   ///==/\/\/==[ drive ]==/\/\/==[ mass ]--c--///
/// ```
#[test]
fn a_sine_that_barely_exceeds_the_friction_slips_once() {
    let epsilon = 3.3e-6_f64;
    let omega = ((1e8 + 10.0) / 1e6_f64).sqrt();
    let speed = 0.1 * (1.0 + epsilon) * omega;
    let begin = -2.0 * (epsilon / (2.0 * (1.0 + epsilon))).sqrt().asin();
    let peak = std::f64::consts::FRAC_PI_2 / omega;
    let (mut t, mut phi, mut w) = (begin / omega, 0.0_f64, 0.0_f64);
    let step = -2e-5 * begin / omega;
    let rate = |t: f64, phi: f64| {
        let u = omega * t;
        epsilon * u.cos() - 2.0 * (u / 2.0).sin().powi(2) - 10.0 * phi
    };
    loop {
        let a1 = rate(t, phi);
        let (w2, a2) = (w + 0.5 * step * a1, rate(t + 0.5 * step, phi + 0.5 * step * w));
        let (w3, a3) = (w + 0.5 * step * a2, rate(t + 0.5 * step, phi + 0.5 * step * w2));
        let (w4, a4) = (w + step * a3, rate(t + step, phi + step * w3));
        phi += step / 6.0 * (w + 2.0 * w2 + 2.0 * w3 + w4);
        w += step / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
        t += step;
        if w <= 0.0 {
            break;
        }
    }
    for law in ["friction = \"1 N m\"", "friction = \"0.6 N m\"\nbreakaway = \"1 N m\"\nstribeck_speed = \"0.5 rad/s\""]
    {
        let run = run(&format!(
            r#"
            [model]
            coordinates = ["drive", "mass"]
            [shaft.drive]
            inertia = "1e6 kg m^2"
            [spring_damper.big]
            shaft_1 = "drive"
            stiffness = "1e8 N m/rad"
            [shaft.mass]
            inertia = "1 kg m^2"
            {law}
            [spring_damper.k]
            shaft_1 = "drive"
            shaft_2 = "mass"
            stiffness = "10 N m/rad"
            [scenario]
            duration = "0.3 s"
            initial = {{ "drive.w" = "{speed:?} rad/s" }}
            "#
        ));
        assert_eq!(run.outcome, Outcome::Completed);
        let found = changes(&run);
        let descriptions: Vec<&str> = found.iter().map(|(_, what)| what.as_str()).collect();
        assert_eq!(descriptions, ["mass slips forward", "mass sticks"], "{found:?}");
        // The oscillator is known to 1e-9 or so, which is 3e-4 of what exceeds the friction; the times go with its root, the
        // slip with its square.
        assert!((found[0].0 - peak - begin / omega).abs() < 1e-3 * -begin / omega, "{} s", found[0].0);
        assert!((found[1].0 - peak - t).abs() < 1e-3 * -begin / omega, "{} s", found[1].0);
        near(*values(&run, "mass.phi").last().expect("rows"), phi, 2e-3);
        assert!(run.effort.steps < 1000, "{} steps", run.effort.steps);
    }
}

/// Two masses, three frictions, from sliding to a barely exceeded friction: with all torques and inertias times f, and all times
/// times τ (inertias times τ² more, dampings times τ), the same happens at τ times the time.
#[test]
fn scales_change_no_event() {
    let scaled = |f: f64, tau: f64| {
        let event = |at: f64, to: f64, over: f64| event(at * tau, to * f, over * tau);
        let j = f * tau * tau;
        let source = format!(
            "[model]\ncoordinates = [\"a\", \"b\"]\n\
             [shaft.a]\ninertia = \"{:?} kg m^2\"\nfriction = \"{:?} N m\"\n\
             [shaft.b]\ninertia = \"{:?} kg m^2\"\nfriction = \"{:?} N m\"\n\
             [spring_damper.k]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"{:?} N m/rad\"\ndamping = \"{:?} N m s/rad\"\n\
             friction = \"{:?} N m\"\n[disturbance.T]\nshaft = \"a\"\n\
             [scenario]\nduration = \"{:?} s\"\noutput_step = \"{:?} s\"\n{}",
            0.01 * j,
            0.1 * f,
            0.02 * j,
            0.05 * f,
            20.0 * f,
            0.01 * f * tau,
            0.02 * f,
            2.0 * tau,
            0.001 * tau,
            event(0.1, 2.0, 0.0)
                + &event(0.3, -1.0, 0.2)
                + &event(0.8, 0.0, 0.0)
                + &event(1.5, 0.2500025, 0.0)
                + &event(1.502, 0.0, 0.0)
        );
        let run = run(&source);
        assert_eq!(run.outcome, Outcome::Completed);
        run
    };
    let one = scaled(1.0, 1.0);
    let expected = changes(&one);
    assert!(expected.len() > 8, "{expected:?}");
    for (f, tau) in [(1e8, 1.0), (1e-8, 1.0), (1.0, 1e3), (1.0, 1e-3), (1e8, 1e-3), (1e-8, 1e3)] {
        let run = scaled(f, tau);
        let found = changes(&run);
        let descriptions = |list: &[(f64, String)]| list.iter().map(|(_, what)| what.clone()).collect::<Vec<_>>();
        assert_eq!(descriptions(&found), descriptions(&expected), "f {f:e}, tau {tau:e}");
        for ((time, what), (at, _)) in found.iter().zip(&expected) {
            // Absolute tolerances of the integrator are 1e-12 rad/s, of speeds of 1e-3 rad/s where times are long.
            assert!((time / tau - at).abs() < 1e-5, "{what} at {time} s, f {f:e}, tau {tau:e}, against {at}");
        }
        for signal in ["a.phi", "b.phi"] {
            let last = |run: &Run| *values(run, signal).last().expect("rows");
            assert!((last(&run) - last(&one)).abs() < 1e-6, "{signal}: {} against {}", last(&run), last(&one));
        }
    }
}

const DRIVE_WITH_THREE_FRICTIONS: &str = r#"
    [model]
    name = "drive"
    coordinates = ["wg", "cs"]
    [shaft.wg]
    inertia = "130 kg mm^2"
    friction = "0.036 N m"
    [shaft.cs]
    inertia = "0.01 kg m^2"
    friction = "0.18 N m"
    [shaft.fs]
    inertia = "0.01 kg m^2"
    friction = "0.009 N m"
    [harmonic_drive.hd]
    wave_generator = "wg"
    circular_spline = "cs"
    flexspline = "fs"
    ratio = 50
    [motor.m_wg]
    shaft = "wg"
    [motor.m_cs]
    shaft = "cs"
    [scenario]
    duration = "20 s"
    [[scenario.event]]
    at = "0.1 s"
    signal = "m_wg.tau"
    to = "0.06 N m"
    [[scenario.event]]
    at = "0.1 s"
    signal = "m_cs.tau"
    to = "2 N m"
    [[scenario.event]]
    at = "0.2 s"
    signal = "m_cs.tau"
    to = "-0.1 N m"
    [[scenario.event]]
    at = "0.5 s"
    signal = "m_wg.tau"
    to = "0.01 N m"
"#;

/// Three frictions along two coordinates: one shaft comes to rest, then the two others together. Then everything stands exactly still, and
/// the torques hold each other: `λ_wg − λ_fs/50 = τ_wg`, `λ_cs + 51/50 λ_fs = τ_cs`.
#[test]
fn three_frictions_on_two_coordinates_come_to_rest() {
    let run = run(DRIVE_WITH_THREE_FRICTIONS);
    balanced(&run);
    let last = |signal: &str| *values(&run, signal).last().unwrap();
    for (shaft, limit) in [("wg", 0.036), ("cs", 0.18), ("fs", 0.009)] {
        assert_eq!(last(&format!("{shaft}.w")), 0.0, "{:?}", run.events);
        let most = values(&run, &format!("{shaft}.w")).iter().fold(0.0, |most: f64, w| most.max(w.abs()));
        assert!(most > 0.1, "{shaft} has moved: {most}");
        assert!(last(&format!("{shaft}.friction")).abs() <= limit, "{shaft}");
    }
    let sticks = run.events.iter().filter_map(|event| event.description.strip_suffix(" sticks"));
    assert_eq!(sticks.collect::<Vec<_>>(), ["cs", "fs", "wg"]);
    let [wg, cs, fs] = ["wg", "cs", "fs"].map(|shaft| last(&format!("{shaft}.friction")));
    near(wg - fs / 50.0, 0.01, 1e-9);
    near(cs + 51.0 / 50.0 * fs, -0.1, 1e-9);
}

/// Where rounding lets one of two directions reverse that stop together, the other rests all the same: it depends on those that do.
#[test]
fn a_dependent_friction_direction_sticks_too() {
    let (prepared, _) = kardan::study::prepare(DRIVE_WITH_THREE_FRICTIONS);
    let variant = &prepared.variants[0];
    let setup = Setup { reduced: &variant.reduced, laws: &variant.implemented, scenario: &variant.scenario };
    let names: Vec<String> = variant.reduced.equations.frictions.iter().map(|term| term.element.clone()).collect();
    let coordinates = variant.reduced.coordinate_names();
    let wg = coordinates.iter().position(|name| name == "wg").unwrap();
    let moves = |name: &str| names.iter().position(|other| other == name).unwrap();
    for stopping in ["wg", "fs"] {
        let mut machine = Machine::new(setup);
        let mut state = vec![0.0; machine.size()];
        machine.enter_segment(0.0);
        // The wave generator turns and with it the flexspline; the circular spline rests.
        state[coordinates.len() + wg] = 1.0;
        machine.select_modes(0.0, &mut state, &[], true);
        assert!(machine.shared_friction().is_empty());
        state[coordinates.len() + wg] = 0.0;
        machine.select_modes(0.01, &mut state, &[moves(stopping)], false);
        assert_eq!(machine.shared_friction(), [0, 1, 2], "{stopping} has come to rest");
        assert!(!machine.breaks_away(0.02, &state));
    }
}
