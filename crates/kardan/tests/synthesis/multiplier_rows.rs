//! Laws and linear models beside constraints that are kept with their multipliers: what these carry at rest turns with their rows. Against closed forms
//! of a crank that lifts a weight, and of a blade across a slope.

use kardan::diagnostics::Diagnostic;
use kardan::results::{Outcome, Run};
use kardan::study::{AnalyzeSettings, DesignSettings, Project, Settings, Silent};

#[track_caller]
fn close(value: f64, expected: f64, tolerance: f64) {
    crate::common::close(value, expected, tolerance, "the closed form");
}

/// Weight, N, crank and rod, m, mass, kg, inertia, kg m².
const WEIGHT: f64 = 2.0 * 9.81;
const CRANK: f64 = 0.1;
const ROD: f64 = 0.3;
const MASS: f64 = 2.0;
const INERTIA: f64 = 0.02;
const DAMPING: f64 = 0.05;

const LIFT: &str = "[model]\nname = \"lift\"\n[shaft.crank]\ninertia = \"0.02 kg m^2\"\ndamping = \"0.05 N m s/rad\"\n\
                    [mass.slide]\nmass = \"2 kg\"\n[constraint.rod]\n\
                    expression = \"slide.s - 0.1 m * sin(crank.phi) - sqrt((0.3 m)^2 - (0.1 m * cos(crank.phi))^2)\"\n\
                    [torque.weight]\nmass = \"slide\"\nlaw = \"-2 kg * 9.81 m/s^2\"\n[motor.m]\nshaft = \"crank\"\n";
const HOLD: &str = "[control.hold]\nlaw = \"pole_placement\"\ninputs = [\"m\"]\npoles = [-10, -12]\n\
                    at = { \"crank.phi\" = \"30 deg\" }\n";
const CHANNEL: &str = "[[control.hold.channels]]\noutput = \"crank.phi\"\nreference = \"ref\"\n";

/// First and second derivative of the position of the weight by the angle.
fn slopes(angle: f64) -> [f64; 2] {
    let (sin, cos) = angle.sin_cos();
    let root = (ROD * ROD - CRANK * CRANK * cos * cos).sqrt();
    let inner = CRANK * CRANK * sin * cos;
    let square = CRANK * CRANK * (cos * cos - sin * sin);
    [CRANK * cos + inner / root, -CRANK * sin + square / root - inner * inner / root.powi(3)]
}

fn run(source: &str) -> Run {
    let mut study =
        Project::open(source).run(&Settings::default(), &Silent).unwrap_or_else(|reported| panic!("{reported:?}"));
    let run = study.runs.remove(0);
    assert_eq!(run.outcome, Outcome::Completed, "{source}");
    run
}

fn values<'a>(run: &'a Run, name: &str) -> &'a [f64] {
    crate::common::signal(run, name)
}

/// The torque of the motor is the weight over the slope, and the multiplier of the rod makes the stiffness, weight times second derivative.
#[test]
fn a_law_is_designed_where_a_rod_carries_a_weight() {
    let source = format!("{LIFT}{HOLD}{CHANNEL}");
    let project = Project::open(&source);
    let plant = &project.prepared().variants[0].design_models[0];
    let [slope, curvature] = slopes((30.0_f64).to_radians());
    close(plant.trim_torque("m"), WEIGHT * slope, 1e-12);
    close(plant.linear.inertia.to_f64()[(0, 0)], INERTIA + MASS * slope * slope, 1e-12);
    close(plant.linear.stiffness.to_f64()[(0, 0)], WEIGHT * curvature, 1e-12);
    let design =
        project.design(&DesignSettings { simulate: true, ..DesignSettings::default() }, &Silent).expect("a design");
    let poles: Vec<f64> = design.closed_loop_poles.iter().map(|pole| pole.re).collect();
    close(poles[0], -10.0, 1e-9);
    close(poles[1], -12.0, 1e-9);
    assert_eq!(design.design_model, "linear, at the operating point");
    let reported = design.notes.iter().find(|note| note.starts_with("operating point: ")).expect("a note");
    assert!(reported.contains("crank.phi = 30.000000 deg") && reported.contains("proven"), "{reported}");
}

/// The run of the model itself stands there to rounding, references too, and small steps go as the linear loop says: with a sample time and an observer.
#[test]
fn a_run_stays_on_its_rod() {
    let clock = "sample_time = \"1 ms\"\n";
    let observer = "[control.hold.observer]\nsensors = [\"crank.phi\"]\npoles = [-60, -70]\ndisturbances = []\n";
    let keys = [String::new(), clock.into(), observer.into(), format!("{clock}{observer}")];
    let scenario = "[scenario]\nduration = \"2 s\"\noutput_step = \"10 ms\"\nstart = \"operating_point\"\n";
    let step = "[[scenario.event]]\nat = \"1 s\"\nsignal = \"ref\"\nto = \"30.01 deg\"\n";
    let point = (30.0_f64).to_radians();
    for keys in keys {
        let source = format!("{LIFT}{HOLD}{keys}{CHANNEL}{scenario}");
        let rests = run(&source);
        assert!(values(&rests, "crank.phi").iter().all(|angle| (angle - point).abs() < 1e-12), "{source}");
        let moves = run(&format!("{source}{step}"));
        let end = *values(&moves, "crank.phi").last().expect("rows");
        // What bends is of second order in 0.01 deg.
        let to = (30.01_f64).to_radians();
        close(end - point, to - point, if keys.contains("sample_time") { 2e-3 } else { 1e-3 });
        if keys.is_empty() {
            // 1 − 6 e^{−10 t} + 5 e^{−12 t}
            for t in [0.05_f64, 0.1, 0.2] {
                let linear = 1.0 - 6.0 * (-10.0 * t).exp() + 5.0 * (-12.0 * t).exp();
                let found = crate::common::at(&moves, "crank.phi", 1.0 + t) - point;
                assert!((found / (to - point) - linear).abs() < 1e-3, "{t}: {found}");
            }
        }
    }
}

/// Without a law: at the equilibrium below, found from the start on the rod, an oscillation whose stiffness is that of the multiplier.
#[test]
fn an_analysis_uses_an_equilibrium_on_the_rod() {
    let source = format!("{LIFT}[scenario]\nduration = \"1 s\"\n");
    let found = Project::open(&source).analyze(&AnalyzeSettings::default(), &Silent).expect("an analysis");
    let [_, curvature] = slopes(-std::f64::consts::FRAC_PI_2);
    let (rate, square) = (DAMPING / INERTIA / 2.0, WEIGHT * curvature / INERTIA);
    close(found.modes[0].eigenvalue.re, -rate, 1e-12);
    close(found.modes[0].eigenvalue.im.abs(), (square - rate * rate).sqrt(), 1e-12);
    let all = found.notes.join("\n");
    assert!(all.contains("proven: there is exactly one") && all.contains("rod 19.62"), "{all}");
    // A run begins there if asked to, and stays.
    let rests = run(&format!("{source}start = \"equilibrium\"\n"));
    let [first, last] = [0, values(&rests, "crank.phi").len() - 1].map(|row| values(&rests, "crank.phi")[row]);
    close(first.rem_euclid(std::f64::consts::TAU), 1.5 * std::f64::consts::PI, 1e-9);
    close(last, first, 1e-9);
    // Named, it stands elsewhere, held by the motor.
    let named = format!("{source}[analysis]\nat = {{ \"crank.phi\" = \"30 deg\" }}\n");
    let found = Project::open(&named).analyze(&AnalyzeSettings::default(), &Silent).expect("an analysis");
    let [slope, curvature] = slopes((30.0_f64).to_radians());
    let inertia = INERTIA + MASS * slope * slope;
    // J s² + d s + W s″ = 0, with s″ < 0 there.
    let root = (DAMPING * DAMPING / 4.0 - inertia * WEIGHT * curvature).sqrt();
    let mut expected = [(-DAMPING / 2.0 - root) / inertia, (-DAMPING / 2.0 + root) / inertia];
    let mut poles: Vec<f64> = found.modes.iter().map(|mode| mode.eigenvalue.re).collect();
    expected.sort_by(f64::total_cmp);
    poles.sort_by(f64::total_cmp);
    close(poles[0], expected[0], 1e-9);
    close(poles[1], expected[1], 1e-9);
    assert!(
        found.notes.iter().any(|note| note.contains("constant torques balance the operating point: m = ")),
        "{:?}",
        found.notes
    );
}

const BLADE: &str = "[model]\nname = \"blade\"\n[mass.x]\nmass = \"2 kg\"\n[mass.y]\nmass = \"2 kg\"\n[shaft.th]\ninertia = \"0.5 kg m^2\"\n\
                     [spring_damper.k]\nshaft_1 = \"th\"\nshaft_2 = \"ground\"\nstiffness = \"8 N m/rad\"\n\
                     [constraint.blade]\nrates = { x = \"sin(th.phi)\", y = \"-cos(th.phi)\" }\n\
                     [torque.slope]\nmass = \"y\"\nlaw = \"-6 N\"\n[motor.m]\nshaft = \"th\"\n";
const STEER: &str = "[control.steer]\nlaw = \"pole_placement\"\ninputs = [\"m\"]\npoles = [-2, -2.5, -3, -3.5]\n\
                     [[control.steer.channels]]\noutput = \"x.s\"\nreference = \"ref\"\n";

/// A nonholonomic row: its stiffness is not symmetric. Turned by θ, the blade pushes along with 6 N θ, so that one motor reaches all.
#[test]
fn what_a_blade_carries_turns_with_it() {
    let source = format!("{BLADE}[analysis]\noutputs = [\"x.s\"]\n[scenario]\nduration = \"1 s\"\n");
    let found = Project::open(&source).analyze(&AnalyzeSettings::default(), &Silent).expect("an analysis");
    assert!(found.structure.controllable() && found.structure.observable());
    assert_eq!(found.structure.relative_degrees, [[Some(4)]]);
    assert!(found.notes.join("\n").contains("blade -6.000000"));
    // Without the slope it carries nothing.
    let level = source.replace("-6 N", "0 N");
    let found = Project::open(&level).analyze(&AnalyzeSettings::default(), &Silent).expect("an analysis");
    assert!(!found.structure.controllable());
    let project = Project::open(format!("{BLADE}{STEER}"));
    let plant = &project.prepared().variants[0].design_models[0];
    let place = |name: &str| plant.linear.coordinates.iter().position(|own| own == name).expect("a coordinate");
    let stiffness = plant.linear.stiffness.to_f64();
    let (x, th) = (place("x"), place("th"));
    assert_eq!(
        [stiffness[(x, th)].abs(), stiffness[(th, x)], stiffness[(th, th)], stiffness[(x, x)]],
        [6.0, 0.0, 8.0, 0.0]
    );
    // x'' = −6 θ/2: down the slope the force is to the other side of the blade.
    assert!(stiffness[(x, th)] > 0.0);
}

/// The run of the blade itself follows a small step as the four poles say.
#[test]
fn a_blade_is_steered_across_its_slope() {
    let step = "[scenario]\nduration = \"5 s\"\noutput_step = \"50 ms\"\n[[scenario.event]]\nat = \"0 s\"\nsignal = \"ref\"\nto = \"1 mm\"\n";
    let found = run(&format!("{BLADE}{STEER}{step}"));
    let poles = [-2.0, -2.5, -3.0, -3.5];
    let linear = |t: f64| {
        let product: f64 = poles.iter().product();
        let part = |k: usize| {
            let denominator: f64 = (0..4).filter(|j| *j != k).map(|j| poles[k] - poles[j]).product();
            product / (poles[k] * denominator) * (poles[k] * t).exp()
        };
        1.0 + (0..4).map(part).sum::<f64>()
    };
    for (t, x) in found.series.time.iter().zip(values(&found, "x.s")) {
        assert!((x / 1e-3 - linear(*t)).abs() < 1e-6, "{t}: {x}");
    }
}

/// A prescribed speed stands still for the law, as if the shaft were the housing.
#[test]
fn a_prescribed_shaft_is_fixed_in_a_design() {
    let chain = |first: &str, spring: &str| {
        format!(
            "[model]\nname = \"chain\"\n{first}[shaft.a]\ninertia = \"0.01 kg m^2\"\n[shaft.b]\ninertia = \"0.03 kg m^2\"\n\
             [spring_damper.wa]\nshaft_1 = \"{spring}\"\nshaft_2 = \"a\"\nstiffness = \"40 N m/rad\"\ndamping = \"0.1 N m s/rad\"\n\
             [spring_damper.ab]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"90 N m/rad\"\n[motor.m]\nshaft = \"a\"\n\
             [control.follow]\nlaw = \"lqr\"\ninputs = [\"m\"]\nmax_acceptable = {{ \"b.phi\" = \"1 deg\", m = \"5 N m\" }}\n\
             [[control.follow.channels]]\noutput = \"b.phi\"\nreference = \"ref\"\n[scenario]\nduration = \"1 s\"\n"
        )
    };
    let hand = "[shaft.w]\ninertia = \"0.02 kg m^2\"\n[prescribed_motion.hand]\nshaft = \"w\"\nspeed = \"0.3 rad/s * sin(3 rad/s * t)\"\n";
    let gains = |source: &str| {
        let design = Project::open(source).design(&DesignSettings::default(), &Silent).expect("a design");
        design.gains.iter().find(|gain| gain.name == "K").expect("a state gain").values[0].clone()
    };
    let prescribed = chain(hand, "w");
    let (driven, housing) = (gains(&prescribed), gains(&chain("", "ground")));
    driven.iter().zip(&housing).for_each(|(a, b)| close(*a, *b, 1e-12));
    let found = run(&prescribed);
    // ∫ 0.3 sin 3t dt
    close(*values(&found, "w.phi").last().expect("rows"), 0.1 * (1.0 - (3.0_f64).cos()), 1e-9);
    assert!(found.energy.residual.abs() < 1e-9 * found.energy.input.abs());
}

fn refused(source: &str) -> Vec<Diagnostic> {
    let (_, diagnostics) = kardan::study::prepare(source);
    assert!(!diagnostics.is_empty());
    diagnostics
}

#[test]
fn missing_linear_models_are_reported() {
    let full = format!("{LIFT}[control.c]\nlaw = \"computed_torque\"\n")
        + "[[control.c.channels]]\noutput = \"crank.phi\"\ninput = \"m\"\nreference = \"ref\"\npoles = [-5, -6]\n";
    let reported = refused(&full);
    assert!(
        reported.iter().any(|one| one
            .message
            .contains("does not support constraints that are not solved for a coordinate: `rod`")),
        "{reported:?}"
    );
    // A crank of 10 cm with a rod of 30 cm ends at 40 cm.
    let far = format!("{LIFT}{HOLD}{CHANNEL}").replace("\"crank.phi\" = \"30 deg\"", "\"slide.s\" = \"1 m\"");
    let reported = refused(&far);
    assert!(reported.iter().any(|one| one.code == "control::operating-point"), "{reported:?}");
}

/// The start of a run on the rod is the default point, wherever it is, and the weight is held there.
#[test]
fn the_start_of_the_run_is_the_point_where_none_is_named() {
    for degrees in [10.0_f64, 20.0, 30.0, 35.0, 40.0, 50.0, 60.0, 70.0, 80.0] {
        let law = HOLD.replace("at = { \"crank.phi\" = \"30 deg\" }\n", "");
        let source = format!(
            "{LIFT}{law}{CHANNEL}[scenario]\nduration = \"1 s\"\ninitial = {{ \"crank.phi\" = \"{degrees} deg\" }}\n"
        );
        let project = Project::open(&source);
        let variant = &project.prepared().variants[0];
        assert!(project.diagnostics().is_empty(), "{degrees}: {:?}", project.diagnostics());
        let crank = variant.reduced.coordinate_names().iter().position(|name| name == "crank").expect("a coordinate");
        let [slope, curvature] = slopes(variant.scenario.position[crank]);
        let plant = &variant.design_models[0];
        close(plant.trim_torque("m"), WEIGHT * slope, 1e-11);
        close(plant.linear.stiffness.to_f64()[(0, 0)], WEIGHT * curvature, 1e-10);
    }
}

/// A ring with gravity: `at` of an analysis is on it and held by the motor wherever it is; with a coordinate of a rolling row all may be named.
#[test]
fn named_points_of_an_analysis_are_met() {
    for x in [0.1, 0.3, 0.55, 0.7, 0.8, 0.9] {
        let source = format!(
            "[mass.x]\nmass = \"2 kg\"\n[mass.y]\nmass = \"2 kg\"\n[constraint.ring]\nexpression = \"y.s + sqrt((1 m)^2 - x.s^2)\"\n\
             [torque.weight]\nmass = \"y\"\nlaw = \"-20 N\"\n[motor.f]\nshaft = \"x\"\n[scenario]\nduration = \"1 s\"\n\
             [analysis]\nat = {{ \"x.s\" = \"{x} m\" }}\n"
        );
        let source = source.replace("[motor.f]\nshaft", "[motor.f]\nmass");
        let found = Project::open(&source)
            .analyze(&AnalyzeSettings::default(), &Silent)
            .unwrap_or_else(|reported| panic!("{reported:?}"));
        // y = −√(1 − x²): m (1 + y′²) and W y″.
        let root = (1.0_f64 - x * x).sqrt();
        let (slope, curvature) = (x / root, 1.0 / root.powi(3));
        let rate = (20.0 * curvature / (2.0 * (1.0 + slope * slope))).sqrt();
        close(found.modes[0].eigenvalue.im.abs(), rate, 1e-9);
        assert!(
            found.notes.iter().any(|note| note.contains("constant torques balance the operating point: f = ")),
            "{:?}",
            found.notes
        );
    }
    let all = format!("{BLADE}[analysis]\nat = {{ \"th.phi\" = \"0 deg\", \"x.s\" = \"1 m\", \"y.s\" = \"2 m\" }}\n");
    assert!(Project::open(&all).analyze(&AnalyzeSettings::default(), &Silent).is_ok());
}

/// What a prescribed speed does at the start is not in the design, and that is said; places that rows do not allow are told by the row.
#[test]
fn frozen_motions_and_unsatisfied_rows_are_reported() {
    let chain = "[shaft.w]\ninertia = \"0.02 kg m^2\"\n[shaft.a]\ninertia = \"0.01 kg m^2\"\n[prescribed_motion.hand]\nshaft = \"w\"\nspeed = \"5 rad/s\"\n\
                 [spring_damper.wa]\nshaft_1 = \"w\"\nshaft_2 = \"a\"\ndamping = \"0.1 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n\
                 [spring_damper.g]\nshaft_1 = \"a\"\nshaft_2 = \"ground\"\nstiffness = \"3 N m/rad\"\n[scenario]\nduration = \"1 s\"\n";
    let law = "[control.c]\nlaw = \"pole_placement\"\ninputs = [\"m\"]\npoles = [-5, -6]\n\
               [[control.c.channels]]\noutput = \"a.phi\"\nreference = \"ref\"\n";
    let (_, warnings) = kardan::study::prepare(&format!("{law}{chain}"));
    assert!(
        warnings.iter().any(|one| one.message.contains("treats the prescribed motion of `hand` as constant")),
        "{warnings:?}"
    );
    let found = Project::open(chain).analyze(&AnalyzeSettings::default(), &Silent).expect("an analysis");
    assert!(found.notes.iter().any(|note| note.contains("`hand`: a prescribed motion is constant there")));
    let far = format!("{LIFT}{HOLD}{CHANNEL}").replace("\"crank.phi\" = \"30 deg\"", "\"slide.s\" = \"0.5 m\"");
    let reported = refused(&far);
    let text = reported.iter().map(|one| one.message.clone()).collect::<Vec<_>>().join("\n");
    assert!(text.contains("no position was found that satisfies `rod`: the smallest error is 0.1"), "{text}");
}

/// A loop that flies apart beside a kept row ends the run with words.
#[test]
fn a_loop_that_diverges_beside_a_row_is_reported() {
    let dead = format!("{LIFT}{HOLD}{CHANNEL}").replace("\"crank.phi\" = \"30 deg\"", "\"slide.s\" = \"0.4 m\"");
    let dead = dead.replace("output = \"crank.phi\"", "output = \"slide.s\"")
        + "[scenario]\nduration = \"2 s\"\nstart = \"operating_point\"\n[[scenario.event]]\nat = \"0.5 s\"\nsignal = \"ref\"\nto = \"0.35 m\"\n";
    let study =
        Project::open(&dead).run(&Settings::default(), &Silent).unwrap_or_else(|reported| panic!("{reported:?}"));
    let Outcome::Failed { cause, .. } = &study.runs[0].outcome else { panic!("it stands at a dead centre") };
    assert!(cause.contains("the loop diverges"), "{cause}");
}

/// A robot on two wheels, straight ahead: `m r² / 4 − J r² / b² = 0`, so that the motor of one wheel does not reach the other one. The same by rows with
/// constant coefficients, by rows of speeds, and by relations.
#[test]
fn rows_with_exact_coefficients_stay_exact() {
    let bodies = "[mass.x]\nmass = \"5 kg\"\n[shaft.h]\ninertia = \"0.2 kg m^2\"\n[shaft.p]\ninertia = \"0.01 kg m^2\"\n\
                  [shaft.q]\ninertia = \"0.01 kg m^2\"\n[motor.mp]\nshaft = \"p\"\n[motor.mq]\nshaft = \"q\"\n";
    let rows = |key: &str| {
        format!(
            "{bodies}[constraint.right]\n{key} = {{ x = 1, h = \"0.2 m\", p = \"-0.1 m\" }}\n[constraint.left]\n{key} = {{ x = 1, h = \"-0.2 m\", q = \"-0.1 m\" }}\n"
        )
    };
    let surfaces = format!(
        "{bodies}[constraint.right]\nexpression = \"x.s + 0.2 m * h.phi - 0.1 m * p.phi\"\n[constraint.left]\nexpression = \"x.s - 0.2 m * h.phi - 0.1 m * q.phi\"\n"
    );
    let verdict = |source: &str| match design_for(source, "mp", "q.phi") {
        Ok(design) => design.verdict().text,
        Err(reported) => reported.into_iter().map(|one| one.message).collect(),
    };
    let by_hand = verdict(&rows("coefficients"));
    assert!(by_hand.contains("q.phi"), "{by_hand}");
    for source in [rows("rates"), surfaces] {
        assert_eq!(verdict(&source), by_hand, "{source}");
    }
}

fn design_for(source: &str, input: &str, output: &str) -> Result<kardan::results::Design, Vec<Diagnostic>> {
    let settings =
        DesignSettings { inputs: vec![input.into()], outputs: vec![output.into()], ..DesignSettings::default() };
    Project::open(source).design(&settings, &Silent)
}

/// Where coefficients are rounded nothing is said to be exact of the model; where they are fractions it is.
#[test]
fn rounded_rows_are_reported() {
    let crank = |angle: &str| {
        format!(
            "[shaft.crank]\ninertia = \"0.02 kg m^2\"\n[mass.slide]\nmass = \"2 kg\"\n[constraint.yoke]\nexpression = \"slide.s - 0.1 m * sin(crank.phi)\"\n\
             [motor.m]\nshaft = \"crank\"\n[scenario]\nduration = \"1 s\"\ninitial = {{ \"crank.phi\" = \"{angle}\" }}\n"
        )
    };
    for (angle, rounded) in [("0 deg", false), ("30 deg", true)] {
        let design = design_for(&crank(angle), "m", "crank.phi").expect("a design");
        assert_eq!(design.verdict().text.contains("proven exactly"), !rounded, "{}", design.verdict().text);
        assert_eq!(design.notes.iter().any(|note| note.contains("`yoke` are rounded")), rounded, "{:?}", design.notes);
    }
}

/// A controller that is tried takes the place of the signals that set its motor, and says so.
#[test]
fn a_trial_takes_the_place_of_signals() {
    let source = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n[motor.m]\nshaft = \"a\"\n[motor.n]\nshaft = \"b\"\n\
                  [scenario]\nduration = \"1 s\"\nsignals = { \"m.tau\" = \"1 N m * sin(t / 1 s)\", \"n.tau\" = \"1 N m * cos(t / 1 s)\" }\n";
    let design = design_for(source, "m", "a.phi").unwrap_or_else(|reported| panic!("{reported:?}"));
    let reported: Vec<_> = design.notes.iter().filter(|note| note.contains("`signals`")).collect();
    assert!(reported.len() == 1 && reported[0].contains("`m.tau`") && !reported[0].contains("`n.tau`"), "{reported:?}");
}
