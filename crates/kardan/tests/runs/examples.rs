//! The built-in examples of whole mechanisms against closed forms, with the numbers of their files written out once more.

use std::f64::consts::PI;

use kardan::model::builtin;
use kardan::results::{Outcome, Run};
use kardan::study::{Project, Settings, Silent};

use crate::common::{project, runs_only, signal};

const GRAVITY: f64 = 9.81;

/// All runs of a built-in model; each of its requirements is met in every variant.
fn runs(name: &str) -> Vec<Run> {
    let source = builtin(name).expect("built in").source;
    let project = project(source);
    assert!(project.diagnostics().is_empty(), "{name}");
    let study = project.run(&runs_only(), &Silent).expect("a model without mistakes");
    for run in &study.runs {
        assert_eq!(run.outcome, Outcome::Completed, "{name} {}", run.name);
        assert!(!run.requirements.is_empty(), "{name} {}", run.name);
        assert!(run.requirements.iter().all(|one| one.passed), "{name} {}: {:?}", run.name, run.requirements);
    }
    study.runs
}

fn of<'a>(runs: &'a [Run], variant: &str) -> &'a Run {
    runs.iter().find(|run| run.name == variant).expect("a variant of the model")
}

fn last(run: &Run, name: &str) -> f64 {
    *signal(run, name).last().expect("rows")
}

/// The values of a signal from one time to another.
fn between<'a>(run: &'a Run, name: &str, (from, until): (f64, f64)) -> &'a [f64] {
    let place = |time: f64| run.series.time.partition_point(|t| *t < time);
    &signal(run, name)[place(from)..place(until)]
}

fn near(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((found - expected).abs() <= tolerance, "{what}: {found} instead of {expected}");
}

/// (6.100) of the source, which holds for every angle, at each joint; the speeds by its derivative; the largest Cardan error
/// `atan((1 − c)/(2√c))`, which for 30° is 4.1171° and for yokes a quarter turn off, c = cos² 30° = 3/4, 8.2132°.
#[test]
fn universal_joints_obey_the_cross() {
    let runs = runs("universal-joints");
    let cases = [
        ("single", 0.0, 0.0, Some(4.1171)),
        ("equal", 30.0, 0.0, Some(0.0)),
        ("unequal", 25.0, 0.0, Some(1.3023)),
        ("one-tooth-off", 30.0, 10.0, None),
        ("crossed", 30.0, 90.0, Some(8.2132)),
    ];
    for (variant, angle, phase, largest) in cases {
        let run = of(&runs, variant);
        let (c_1, c_2, phase) = (f64::cos(PI / 6.0), f64::to_radians(angle).cos(), f64::to_radians(phase));
        let [first, middle, second] = ["input", "middle", "output"].map(|name| signal(run, &format!("{name}.phi")));
        let [w_1, w_2, w_3] = ["input", "middle", "output"].map(|name| signal(run, &format!("{name}.w")));
        let cross = |one: f64, other: f64, c: f64| one.sin() * other.cos() - c * one.cos() * other.sin();
        // Rates of both sides: a(1)·w_1 = b·w_2.
        let slopes = |one: f64, other: f64, c: f64| {
            let (on_one, on_other) = (one.cos() * other.cos() + c * one.sin() * other.sin(), one.sin() * other.sin());
            (on_one, on_other + c * one.cos() * other.cos())
        };
        let mut error = 0.0f64;
        for k in 0..first.len() {
            near(cross(first[k], middle[k], c_1), 0.0, 1e-13, variant);
            near(cross(second[k], middle[k] + phase, c_2), 0.0, 1e-13, variant);
            let (left, right) = slopes(first[k], middle[k], c_1);
            near(left * w_1[k], right * w_2[k], 1e-11, variant);
            let (left, right) = slopes(second[k], middle[k] + phase, c_2);
            near(left * w_3[k], right * w_2[k], 1e-11, variant);
            near(w_1[k], 10.0 * PI, 1e-12, variant);
            error = error.max((second[k] - first[k] - second[0]).abs());
        }
        // Rows are 0.9° apart: the largest is missed by half of the square of half of that, and less.
        if let Some(largest) = largest {
            near(error.to_degrees(), largest, 1e-3, variant);
        }
    }
}

/// On the circle: place, heading and the force of the ground at every time. From rest: speed and heading in closed form, the path by
/// Simpson's rule over them.
#[test]
fn the_unicycle_keeps_its_circle() {
    let runs = runs("unicycle");
    let (mass, radius, speed) = (4.0, 0.1, 0.8);
    for (variant, rate) in [("circle", 1.0), ("right-turn", -2.0)] {
        let run = of(&runs, variant);
        let [x, y, heading] = ["x.s", "y.s", "heading.phi"].map(|name| signal(run, name));
        let [force_x, force_y] = ["rolls_x.x.f", "rolls_y.y.f"].map(|name| signal(run, name));
        for (k, t) in run.series.time.iter().enumerate() {
            let angle = rate * t;
            near(x[k], speed / rate * angle.sin(), 1e-9, variant);
            near(y[k], speed / rate * (1.0 - angle.cos()), 1e-9, variant);
            near(heading[k], angle, 1e-9, variant);
            // m times the acceleration
            near(force_x[k], -mass * speed * rate * angle.sin(), 1e-7, variant);
            near(force_y[k], mass * speed * rate * angle.cos(), 1e-7, variant);
        }
    }
    let run = of(&runs, "from-rest");
    let (wheel, body) = (0.5 * 1.2 * radius * radius, 0.02);
    let (lag, turning_lag) = ((wheel + mass * radius * radius) / 0.6, body / 0.3);
    let velocity = |t: f64| speed * (1.0 - (-t / lag).exp());
    let heading = |t: f64| t - turning_lag * (1.0 - (-t / turning_lag).exp());
    let [x, y, found] = ["x.s", "y.s", "heading.phi"].map(|name| signal(run, name));
    let (mut at_x, mut at_y) = (0.0, 0.0);
    for (k, pair) in run.series.time.windows(2).enumerate() {
        let step = pair[1] - pair[0];
        let points = [(pair[0], 1.0), (pair[0] + 0.5 * step, 4.0), (pair[1], 1.0)];
        at_x += step / 6.0 * points.iter().map(|(t, weight)| weight * velocity(*t) * heading(*t).cos()).sum::<f64>();
        at_y += step / 6.0 * points.iter().map(|(t, weight)| weight * velocity(*t) * heading(*t).sin()).sum::<f64>();
        near(found[k + 1], heading(pair[1]), 1e-9, "heading");
        // Simpson's rule: step⁴/2880 times the fourth derivative, some 0.8 m/s / lag⁴ at first.
        near(x[k + 1], at_x, 1e-8, "x");
        near(y[k + 1], at_y, 1e-8, "y");
    }
}

/// Willis' equation with 30 and 78 teeth at every time; uphill at 25 m/s and 2400 rpm the torques follow from the forces of the road.
#[test]
fn the_power_split_is_that_of_willis() {
    let runs = runs("hybrid-driveline");
    for run in &runs {
        let [sun, ring, engine] = ["sun.w", "ring.w", "engine.w"].map(|name| signal(run, name));
        let [on_sun, on_ring, on_engine] =
            ["sun", "ring", "engine"].map(|shaft| signal(run, &format!("split.{shaft}.tau")));
        for k in 0..sun.len() {
            near(30.0 * sun[k] + 78.0 * ring[k], 108.0 * engine[k], 1e-9, &run.name);
            // The gear passes power on.
            let power = [on_sun[k] * sun[k], on_ring[k] * ring[k], on_engine[k] * engine[k]];
            near(power.iter().sum(), 0.0, 1e-9 * power.iter().fold(1.0, |size, one| one.abs() + size), &run.name);
        }
    }
    for (variant, speed, turning) in [("power-split", 25.0, 80.0 * PI), ("electric", 50.0 / 3.6, 0.0)] {
        let run = of(&runs, variant);
        let ring = speed / 0.3 * 4.113;
        near(last(run, "sun.w"), (108.0 * turning - 78.0 * ring) / 30.0, 1e-5, variant);
        let road = (0.01 + 0.04) * 1375.0 * GRAVITY + 0.5 * 1.2 * 0.26 * 2.2 * speed * speed;
        let engine = last(run, "combustion.tau");
        near(last(run, "generator.tau"), -30.0 / 108.0 * engine, 1e-5, variant);
        near(last(run, "traction.tau"), road * 0.3 / 4.113 - 78.0 / 108.0 * engine, 1e-5, variant);
    }
    assert!(last(of(&runs, "power-split"), "combustion.tau") > 50.0);
    assert!(last(of(&runs, "electric"), "combustion.tau") == 0.0);
}

/// At rest the torques at the pinion balance the force at the rack over a radius of 7.16 mm, and the driver feels what the motor leaves
/// him. Hands off, friction of 80 N at the rack and of 0.05 N m at the wheel is all that is left between gust and tyres.
#[test]
fn the_steering_column_balances_the_rack_force() {
    let runs = runs("eps-column");
    let radius = 0.00716;
    for variant in ["manual", "boosted"] {
        let run = of(&runs, variant);
        let force = 80.0 - last(run, "tyres.f");
        let motor = 20.0 * last(run, "boost.tau");
        near(last(run, "teeth.rack.f"), force, 0.01, variant);
        near(last(run, "driver.tau"), force * radius - motor + 0.05, 1e-4, variant);
        near(last(run, "rack.s"), radius * last(run, "pinion.phi"), 1e-15, variant);
        // The twist of the bar.
        let twist = last(run, "hand_wheel.phi") - last(run, "pinion.phi");
        near(last(run, "driver.tau") - 0.05, 115.0 * twist, 1e-4, variant);
        assert!(if variant == "manual" { motor == 0.0 } else { motor > 3.0 });
    }
    let off = of(&runs, "hands-off");
    near(-last(off, "tyres.f"), 600.0, 80.0 + 0.05 / radius, "hands off");
    // Without feedback nothing turns the motor, and the points of the tyres' curve are (0 N, 0 mm) and (900 N, 10 mm).
    assert!((0.0..0.01).contains(&last(off, "rack.s")) && last(off, "assist.tau") == 0.0);
    let lane_keeping = of(&runs, "lane-keeping");
    near(20.0 * last(lane_keeping, "assist.tau") / radius, -600.0, 80.0 + 0.05 / radius + 10.0, "lane keeping");
}

/// Level, the arm of 6 kg with 5 kg at 0.6 m weighs (3 + 5) kg · g · 0.6 m on the drive, which twists by that over 31 kN m/rad: on the
/// motor's side nobody sees it. What is left swings by 1 N m at most; the twist by that over the stiffness.
#[test]
fn the_robot_joint_carries_its_arm() {
    let runs = runs("robot-joint");
    let (load, stiffness, still) = (8.0 * GRAVITY * 0.6, 31000.0, (1.9, 1.999));
    for run in &runs {
        let [arm, rotor, torque] = ["arm.phi", "rotor.phi", "drive.arm.tau"].map(|name| between(run, name, still));
        assert!(!arm.is_empty());
        for ((arm, rotor), torque) in arm.iter().zip(rotor).zip(torque) {
            near(*torque, load * arm.sin(), 1.0, &run.name);
            near(rotor / 101.0 - arm, load * arm.sin() / stiffness, 1.0 / stiffness, &run.name);
            near(rotor / 101.0 - arm, torque / stiffness, 20.0 * 0.01 / stiffness, &run.name);
        }
    }
    for (arm, what) in between(of(&runs, "motor-side"), "arm.phi", still).iter().zip(0..) {
        near(PI / 2.0 - arm, load / stiffness, 1e-4, &format!("motor side, row {what}"));
    }
    for arm in between(of(&runs, "arm-side"), "arm.phi", still) {
        near(*arm, PI / 2.0, 3e-4, "arm side");
    }
}

/// The gain of a linear law knows the linearised torques of engine and air: an observer that does not know them would cancel them twice.
#[test]
fn torques_of_expressions_are_cancelled_once() {
    let source = builtin("hybrid-driveline").unwrap().source;
    let line = source.lines().find(|line| line.starts_with("plant = \"linear\"")).expect("it says how");
    let settings = || Settings { variants: vec!["power-split".into()], ..runs_only() };
    let residual_share = source.replace(line, "");
    let run = Project::open(&residual_share)
        .run(&settings(), &Silent)
        .unwrap_or_else(|reported| panic!("{reported:?}"))
        .runs
        .remove(0);
    let speed = signal(&run, "engine.w");
    assert!((speed[speed.len() - 1] - 2400.0 * PI / 30.0).abs() < 1e-6, "{:?}", speed.last());
    let full = source.replace(line, "plant = \"nonlinear\"");
    let reported = Project::open(&full).run(&settings(), &Silent).expect_err("it is refused");
    assert!(reported.iter().any(|one| one.message.contains("they would be cancelled twice")), "{reported:?}");
}
