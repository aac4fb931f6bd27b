//! Motions that constraints prescribe as functions of time: against closed forms, with their multipliers and the power that they give.

use std::f64::consts::PI;

use kardan::results::{Outcome, Run};
use kardan::simulate::Method;

use crate::common::{run_by, signal};

const METHODS: [Method; 4] = [Method::Taylor, Method::Dop853, Method::Radau, Method::Automatic];

fn by(source: &str, method: Method, tolerance: f64) -> Run {
    let run = run_by(source, method, Some(tolerance));
    assert_eq!(run.outcome, Outcome::Completed, "{method:?}");
    run
}

/// The energy that came in is what is stored and what was lost, relative to what came in.
fn balances(run: &Run, bound: f64, what: &str) {
    let energy = &run.energy;
    let size = energy.input.abs() + energy.stored.abs() + energy.dissipated.abs();
    assert!(size > 1e-3, "{what}: nothing happened");
    assert!(energy.residual.abs() < bound * size, "{what}: {energy:?}");
}

/// The work that a prescribed motion gives is the integral of its torque times its rate, by Simpson's rule over the rows.
fn work(run: &Run, torque: &str, rate: impl Fn(f64) -> f64) -> f64 {
    let (time, torque) = (&run.series.time, signal(run, torque));
    let power: Vec<f64> = time.iter().zip(torque).map(|(t, torque)| torque * rate(*t)).collect();
    let step = time[1] - time[0];
    assert_eq!(time.len() % 2, 1);
    (0..time.len() / 2).map(|k| step / 3.0 * (power[2 * k] + 4.0 * power[2 * k + 1] + power[2 * k + 2])).sum()
}

const SHAKER: &str = "\
[shaft.motor]
inertia = \"0.3 kg m^2\"
[shaft.load]
inertia = \"2 kg m^2\"
[spring_damper.s]
shaft_1 = \"motor\"
shaft_2 = \"load\"
stiffness = \"50 N m/rad\"
[prescribed_motion.drive]
shaft = \"motor\"
angle = \"0.2 rad * sin(6 rad/s * t)\"
[scenario]
duration = \"2 s\"
output_step = \"1 ms\"
";

/// `2 φ̈ + 50 φ = 50·0.2 sin 6t` from rest; the torque of the motion is `0.3 θ̈ + 50 (θ − φ)`, and its work the energy of the model.
#[test]
fn a_shaken_body_moves_as_in_closed_form_and_takes_the_torque_that_it_must() {
    let (inertia, own_inertia, stiffness, size, omega) = (2.0, 0.3, 50.0, 0.2, 6.0);
    let own = f64::sqrt(stiffness / inertia);
    let forced = stiffness * size / (stiffness - inertia * omega * omega);
    let phi = |t: f64| forced * ((omega * t).sin() - omega / own * (own * t).sin());
    for method in METHODS {
        let run = by(SHAKER, method, 1e-11);
        let columns =
            ["load.phi", "motor.phi", "motor.w", "drive.tau", "drive.motor.tau"].map(|name| signal(&run, name));
        for (k, &t) in run.series.time.iter().enumerate() {
            let theta = size * (omega * t).sin();
            let torque = -own_inertia * omega * omega * theta + stiffness * (theta - phi(t));
            let expected = [phi(t), theta, size * omega * (omega * t).cos(), torque, torque];
            for (column, expected) in columns.iter().zip(expected) {
                assert!((column[k] - expected).abs() < 2e-9 * 50.0, "{method:?} {t}: {} {expected}", column[k]);
            }
            assert!((columns[0][k] - phi(t)).abs() < 2e-9, "{method:?} {t}");
        }
        balances(&run, 1e-9, "shaker");
        let drive_work = work(&run, "drive.tau", |t| size * omega * (omega * t).cos());
        assert!((drive_work - run.energy.input).abs() < 1e-8, "{method:?}: {drive_work} {:?}", run.energy);
    }
}

/// `a = 2 b + f(t)` without other forces: `(4 J_a + J_b) b̈ = −2 J_a f̈`, and the multiplier is `J_a ä`.
#[test]
fn a_rheonomic_row_between_two_free_bodies_moves_both_as_in_closed_form() {
    let source = |offset: &str, more: &str| {
        format!(
            "[shaft.a]\ninertia = \"3 kg m^2\"\n[shaft.b]\ninertia = \"5 kg m^2\"\n[constraint.c]\n\
             coefficients = {{ a = 1, b = -2 }}\noffset = \"{offset}\"\n{more}[scenario]\nduration = \"2.8 s\"\n\
             output_step = \"10 ms\"\n"
        )
    };
    let wave = "[signal.wave]\nkind = \"sine\"\namplitude = \"10 deg\"\nfrequency = \"1 Hz\"\n";
    let size = 10.0 * PI / 180.0;
    let omega = 2.0 * PI;
    for (offset, more) in [("10 deg * sin(2 pi t / 1 s)", ""), ("wave", wave), ("2 * wave / 2", wave)] {
        for method in METHODS {
            let run = by(&source(offset, more), method, 1e-11);
            let columns = ["a.phi", "b.phi", "c.tau", "c.b.tau"].map(|name| signal(&run, name));
            // The coordinate, which begins at rest, is the one that the row leaves.
            let begins = signal(&run, "b.w")[0];
            for (k, &t) in run.series.time.iter().enumerate() {
                let (f, f_dd) = (size * (omega * t).sin(), -size * omega * omega * (omega * t).sin());
                let share = -2.0 * 3.0 / (4.0 * 3.0 + 5.0);
                let b = share * (f - size * omega * t) + begins * t;
                let torque = 3.0 * (2.0 * share * f_dd + f_dd);
                for (column, expected) in columns.iter().zip([2.0 * b + f, b, torque, -2.0 * torque]) {
                    assert!((column[k] - expected).abs() < 1e-8, "{offset} {method:?} {t}: {} {expected}", column[k]);
                }
            }
            balances(&run, 1e-9, offset);
        }
    }
}

/// Behind a joint that bends, with a damper, a spring, a torque of its own and a load: the energy closes, whoever integrates, and all
/// methods agree.
#[test]
fn the_energy_of_a_prescribed_motion_closes_through_a_joint() {
    let source = "\
[shaft.a]
inertia = \"0.1 kg m^2\"
damping = \"0.2 N m s/rad\"
[shaft.b]
inertia = \"0.4 kg m^2\"
[shaft.c]
inertia = \"1 kg m^2\"
[universal_joint.j]
shaft_1 = \"a\"
shaft_2 = \"b\"
angle = \"40 deg\"
[spring_damper.s]
shaft_1 = \"b\"
shaft_2 = \"c\"
stiffness = \"30 N m/rad\"
damping = \"0.5 N m s/rad\"
[torque.gravity]
shaft = \"b\"
law = \"-2 N m * sin(b.phi)\"
[motor.m]
shaft = \"a\"
[signal.course]
kind = \"table\"
points = { time = [\"0 s\", \"0.5 s\", \"1 s\", \"1.7 s\", \"3 s\"], value = [\"0 rad\", \"2 rad\", \"1 rad\", \"4 rad\", \"4 rad\"] }
interpolation = \"cubic\"
[prescribed_motion.drive]
shaft = \"a\"
angle = \"course + 0.5 rad * sin(3 rad/s * t)\"
[scenario]
duration = \"3 s\"
signals = { \"m.tau\" = \"1 N m * t / 1 s\" }
";
    let runs = METHODS.map(|method| by(source, method, 1e-10));
    for (run, method) in runs.iter().zip(METHODS) {
        balances(run, 1e-8, &format!("{method:?}"));
        for name in ["c.phi", "b.w", "drive.tau", "j.tau"] {
            let pairs = signal(run, name).iter().zip(signal(&runs[0], name));
            pairs.for_each(|(x, y)| assert!((x - y).abs() < 1e-6 * (1.0 + y.abs()), "{method:?} {name}: {x} {y}"));
        }
    }
}

/// The same shaken body where the speed, or the acceleration, of the motor is what is prescribed: kept as rows with multipliers, and in
/// closed form all the same.
#[test]
fn prescribed_speeds_and_accelerations_move_as_the_angle_that_they_add_up_to() {
    let speed = "speed = \"1.2 rad/s * cos(6 rad/s * t)\"";
    let acceleration = "acceleration = \"-7.2 rad/s^2 * sin(6 rad/s * t)\"";
    for (motion, initial) in [(speed, "\"load.phi\" = \"0 rad\""), (acceleration, "\"motor.w\" = \"1.2 rad/s\"")] {
        let source = SHAKER
            .replace("angle = \"0.2 rad * sin(6 rad/s * t)\"", motion)
            .replace("duration", &format!("initial = {{ {initial} }}\nduration"));
        let closed = by(SHAKER, Method::Taylor, 1e-11);
        for method in METHODS {
            let run = by(&source, method, 1e-11);
            for name in ["load.phi", "motor.phi", "motor.w", "drive.tau", "drive.motor.tau"] {
                for (x, y) in signal(&run, name).iter().zip(signal(&closed, name)) {
                    assert!((x - y).abs() < 1e-7, "{motion} {method:?} {name}: {x} {y}");
                }
            }
            balances(&run, 1e-9, motion);
            let drive_work = work(&run, "drive.tau", |t| 1.2 * (6.0 * t).cos());
            assert!((drive_work - run.energy.input).abs() < 1e-7, "{method:?}: {drive_work} {:?}", run.energy);
        }
    }
}

/// A wheel that rolls where it heads \[diss. (4.4)\], free: it runs on a circle with its speed, and the force across is m v ω. In whatever
/// direction it heads, the row is of full rank.
#[test]
fn a_unicycle_runs_on_a_circle() {
    let source = "\
[mass.x]
mass = \"2 kg\"
[mass.y]
mass = \"2 kg\"
[shaft.heading]
inertia = \"0.3 kg m^2\"
[constraint.wheel]
rates = { x = \"-sin(heading.phi)\", y = \"cos(heading.phi)\" }
[scenario]
duration = \"10 s\"
output_step = \"10 ms\"
initial = { \"x.v\" = \"1.5 m/s\", \"heading.w\" = \"2 rad/s\" }
";
    let (mass, v, omega) = (2.0, 1.5, 2.0);
    for method in METHODS {
        let run = by(source, method, 1e-11);
        let [x, y, heading, force, on_x] =
            ["x.s", "y.s", "heading.phi", "wheel.f", "wheel.x.f"].map(|name| signal(&run, name));
        let [vx, vy] = ["x.v", "y.v"].map(|name| signal(&run, name));
        for (k, &t) in run.series.time.iter().enumerate() {
            let angle = omega * t;
            let expected = [v / omega * angle.sin(), v / omega * (1.0 - angle.cos()), angle];
            for (found, expected) in [x[k], y[k], heading[k]].into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-8, "{method:?} {t}: {found} {expected}");
            }
            assert!((force[k] - mass * v * omega).abs() < 1e-7, "{method:?} {t}: {}", force[k]);
            assert!((on_x[k] + angle.sin() * force[k]).abs() < 1e-7, "{method:?} {t}");
            let aside = vy[k] * heading[k].cos() - vx[k] * heading[k].sin();
            assert!(aside.abs() < 1e-8, "{method:?} {t}: {aside}");
        }
        // Nothing comes in, nothing is lost: the constraint does no work.
        let energy = &run.energy;
        assert!(energy.input == 0.0 && energy.stored.abs() < 1e-8 && energy.residual.abs() < 1e-8, "{energy:?}");
    }
}

/// A wheel that rolls without slipping, driven and turned: `(J + m R²) φ̈ = τ`, and the path follows from `ẋ = R φ̇ cos ψ`.
#[test]
fn a_rolling_wheel_follows_the_path_that_it_is_steered_to() {
    let source = "\
[shaft.wheel]
inertia = \"0.2 kg m^2\"
[shaft.heading]
inertia = \"0.1 kg m^2\"
[mass.x]
mass = \"3 kg\"
[mass.y]
mass = \"3 kg\"
[constraint.along]
rates = { x = 1, wheel = \"-0.3 m * cos(heading.phi)\" }
[constraint.across]
rates = { y = 1, wheel = \"-0.3 m * sin(heading.phi)\" }
[torque.drive]
shaft = \"wheel\"
law = \"0.5 N m\"
[torque.turn]
shaft = \"heading\"
law = \"0.1 N m * sin(t / 1 s)\"
[scenario]
duration = \"6 s\"
output_step = \"10 ms\"
";
    let (radius, inertia) = (0.3, 0.2 + 3.0 * 0.3 * 0.3);
    for method in METHODS {
        let run = by(source, method, 1e-11);
        let [wheel, heading, vx, vy, direction, across] =
            ["wheel.phi", "heading.phi", "x.v", "y.v", "along.f", "across.f"].map(|name| signal(&run, name));
        for (k, &t) in run.series.time.iter().enumerate() {
            let (psi, rate, acceleration) = (t - t.sin(), 0.5 / inertia * t, 0.5 / inertia);
            assert!((wheel[k] - 0.5 * acceleration * t * t).abs() < 1e-8, "{method:?} {t}");
            assert!((heading[k] - psi).abs() < 1e-8, "{method:?} {t}");
            assert!((vx[k] - radius * rate * psi.cos()).abs() < 1e-8, "{method:?} {t}");
            assert!((vy[k] - radius * rate * psi.sin()).abs() < 1e-8, "{method:?} {t}");
            // m ẍ and m ÿ
            let yaw_rate = 1.0 - t.cos();
            let [ax, ay] = [
                acceleration * psi.cos() - rate * psi.sin() * yaw_rate,
                acceleration * psi.sin() + rate * psi.cos() * yaw_rate,
            ];
            assert!((direction[k] - 3.0 * radius * ax).abs() < 1e-6, "{method:?} {t}: {}", direction[k]);
            assert!((across[k] - 3.0 * radius * ay).abs() < 1e-6, "{method:?} {t}: {}", across[k]);
        }
        balances(&run, 1e-9, "wheel");
    }
}

/// A slider-crank written as one nonlinear relation: the slider stays where the rod holds it, and the energy stays, over many turns.
#[test]
fn a_nonlinear_relation_of_positions_does_not_drift() {
    let source = "\
[shaft.crank]
inertia = \"0.5 kg m^2\"
[mass.slider]
mass = \"2 kg\"
[constraint.rod]
expression = \"(slider.s - 0.1 m * cos(crank.phi))^2 / (0.3 m) + (0.1 m * sin(crank.phi))^2 / (0.3 m) - 0.3 m\"
[scenario]
duration = \"100 s\"
output_step = \"0.1 s\"
initial = { \"slider.s\" = \"0.4 m\", \"crank.w\" = \"10 rad/s\" }
";
    let (r, l, inertia, mass) = (0.1, 0.3, 0.5, 2.0);
    let place = |phi: f64| r * phi.cos() + (l * l - r * r * phi.sin().powi(2)).sqrt();
    let slope = |phi: f64| -r * phi.sin() - r * r * phi.sin() * phi.cos() / (l * l - r * r * phi.sin().powi(2)).sqrt();
    for method in METHODS {
        let run = by(source, method, 1e-9);
        let [phi, w, s, v] = ["crank.phi", "crank.w", "slider.s", "slider.v"].map(|name| signal(&run, name));
        let energy = |k: usize| 0.5 * inertia * w[k] * w[k] + 0.5 * mass * v[k] * v[k];
        assert!((s[0] - place(phi[0])).abs() < 1e-12, "the start is put on the row: {} {}", s[0], place(phi[0]));
        for k in 0..phi.len() {
            assert!((s[k] - place(phi[k])).abs() < 2e-8, "{method:?} {k}: {} {}", s[k], place(phi[k]));
            assert!((v[k] - slope(phi[k]) * w[k]).abs() < 2e-6, "{method:?} {k}");
            assert!((energy(k) - energy(0)).abs() < 1e-4, "{method:?} {k}: {} {}", energy(k), energy(0));
        }
        assert!(phi[phi.len() - 1] > 900.0, "{method:?}: it turned {} rad", phi[phi.len() - 1]);
    }
}

/// A body that a belt of constant speed drags: a block on a spring sticks until the spring holds the static friction, and slips to where
/// its swing brings it, `x = μ/k + √((x₀ − μ/k)² + (v/ω)²)`; the position of the belt is a straight line in time, so its speed never changes.
#[test]
fn clutches_springs_and_impacts_use_a_constant_prescribed_speed() {
    let scenario = "[scenario]\nduration = \"2 s\"\noutput_step = \"1 ms\"\n";
    let belt = format!(
        "[mass.block]\nmass = \"1 kg\"\n[mass.belt]\n[prescribed_motion.drive]\nmass = \"belt\"\nposition = \"0.1 m/s * t\"\n\
         [spring_damper.k]\nmass_1 = \"block\"\nmass_2 = \"ground\"\nstiffness = \"100 N/m\"\n[clutch.rub]\nshaft_1 = \"belt\"\nshaft_2 = \"block\"\n\
         torque = \"5 N\"\nstatic_factor = 1.5\n{scenario}"
    );
    let run = by(&belt, Method::Automatic, 1e-11);
    let most = signal(&run, "k.f").iter().fold(0.0f64, |most, x| most.max(*x));
    let expected = 100.0 * (0.05 + f64::hypot(0.075 - 0.05, 0.1 / 10.0));
    assert!((most - expected).abs() < 1e-4 * expected, "{most} N for {expected} N");
    balances(&run, 1e-10, "belt");
    // A clutch of 10 N m turns 1 kg m² up to 10 rad/s within 1 s, and loses as much as it gives: ½ J ω².
    let clutch = format!(
        "[shaft.rotor]\n[shaft.disc]\ninertia = \"1 kg m^2\"\n[prescribed_motion.drive]\nshaft = \"rotor\"\nangle = \"10 rad/s * t\"\n\
         [clutch.c]\nshaft_1 = \"rotor\"\nshaft_2 = \"disc\"\ntorque = \"10 N m\"\n{scenario}"
    );
    let run = by(&clutch, Method::Automatic, 1e-11);
    assert!((run.energy.dissipated - 50.0).abs() < 1e-9 && (run.energy.input - 100.0).abs() < 1e-9, "{:?}", run.energy);
    assert!((crate::common::at(&run, "disc.w", 0.5) - 5.0).abs() < 1e-9);
    // A wall that walks strikes a ball at rest: it leaves with (1 + e) times the speed of the wall.
    let wall = format!(
        "[mass.ball]\nmass = \"2 kg\"\n[mass.wall]\n[prescribed_motion.drive]\nmass = \"wall\"\nposition = \"0.1 m/s * t\"\n\
         [end_stop.stop]\nshaft_1 = \"wall\"\nshaft_2 = \"ball\"\nupper = \"-0.05 m\"\nrestitution = 0.5\n{scenario}\
         initial = {{ \"ball.s\" = \"0.1 m\" }}\n"
    );
    let run = by(&wall, Method::Automatic, 1e-11);
    assert_eq!(signal(&run, "ball.v").last(), Some(&(1.5 * 0.1)));
    assert!((crate::common::at(&run, "ball.s", 2.0) - (0.1 + 0.15 * 1.5)).abs() < 1e-12);
    // The blow takes what the ball has, and what it loses: (1 + e) m v · v.
    assert!((run.energy.input - 0.03).abs() < 1e-14 && (run.energy.stored - 0.0225).abs() < 1e-14, "{:?}", run.energy);
    // Friction behind a gear rubs from the first instant on.
    let gear = format!(
        "[shaft.in]\n[shaft.out]\ninertia = \"1 kg m^2\"\n[shaft.mid]\nfriction = \"3 N m\"\ninertia = \"0.1 kg m^2\"\n[gear.g]\nshaft_1 = \"in\"\nshaft_2 = \"mid\"\nratio = 2\n\
         [prescribed_motion.drive]\nshaft = \"in\"\nangle = \"30 rad/s * t\"\n{scenario}"
    );
    let run = by(&gear, Method::Automatic, 1e-11);
    // 3 N m at 15 rad/s for 2 s.
    assert!((run.energy.dissipated - 90.0).abs() < 1e-9, "{:?}", run.energy);
}
