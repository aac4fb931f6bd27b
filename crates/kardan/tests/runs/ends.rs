//! Runs that end early: formulas of what holds or rubs that have no value from some time on, or would drive, and laws that go to and fro without an end.

use kardan::diagnostics::Diagnostic;
use kardan::results::{Outcome, Run};
use kardan::simulate::Method;
use kardan::study::{Project, Settings, Silent};

use crate::common::{at, runs_only, signal, time_of};

const METHODS: [Method; 3] = [Method::Automatic, Method::Dop853, Method::Radau];

fn by(method: Method, model: &str) -> Run {
    let diagnostics = |diagnostics: Vec<Diagnostic>| panic!("{diagnostics:?}\n{model}");
    let settings = Settings { method, ..runs_only() };
    Project::open(model).run(&settings, &Silent).unwrap_or_else(diagnostics).runs.remove(0)
}

/// A run that ends at a time, for a cause with these words; its balance closes, and its rows reach to its end.
fn ended(method: Method, model: &str, end: f64, fragments: &[&str]) -> Run {
    let run = by(method, model);
    let Outcome::Failed { time, cause } = &run.outcome else { panic!("{method:?}: it ends early\n{model}") };
    assert!((time - end).abs() < 1e-8, "{method:?}: {time} {end}");
    fragments.iter().for_each(|fragment| assert!(cause.contains(fragment), "{method:?}: {cause}"));
    assert!(run.energy.residual.abs() < 1e-9 * run.energy.exchanged.max(1.0), "{method:?}: {:?}", run.energy);
    let last = *run.series.time.last().expect("rows");
    assert!(last <= *time && last > *time - 1.001e-3, "{method:?}: {last} {time}");
    run
}

fn close(value: f64, expected: f64) {
    assert!((value - expected).abs() < 1e-7, "{value} {expected}");
}

/// Shafts a and b of 1 kg m², 1 N m on the first, and an element with keys.
fn two(element: &str) -> String {
    format!(
        "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n[torque.x]\nshaft = \"a\"\nlaw = \"1 N m\"\n{element}\n\
         [scenario]\nduration = \"1 s\"\noutput_step = \"1 ms\"\n"
    )
}

/// It lets go where √(½ − t) falls below ½, at ¼ s, and has no value from ½ s on.
#[test]
fn a_lock_whose_formula_ends_ends_the_run_by_name() {
    for method in METHODS {
        let model = two("[lock.g]\nshaft_1 = \"a\"\nengaged = \"sqrt(0.5 - t/(1 s))\"");
        let run =
            ended(method, &model, 0.5, &["`engaged` of `g` is NaN", "square_root(0.5 - t)", "it is undefined there"]);
        close(time_of(&run, "g is released"), 0.25);
        close(at(&run, "a.w", 0.49), 0.24);
        close(run.energy.stored, 0.5 * 0.25 * 0.25);
        let logarithm = two("[lock.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nengaged = \"ln(0.5 - t/(1 s))\"");
        ended(method, &logarithm, 0.5, &["`engaged` of `g` is NaN", "logarithm(0.5 - t)"]);
    }
}

/// `a.w = t − ⅔ c (½^1.5 − (½ − t)^1.5)` beside a clutch of `c √(½ − t)`; a brake of `c √(0.3 − φ)` takes `⅔ c 0.3^1.5`.
#[test]
fn a_clutch_or_brake_whose_formula_ends_ends_the_run_by_name() {
    for method in METHODS {
        let clutch = two("[clutch.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\ntorque = \"0.1 N m*sqrt(0.5 - t/(1 s))\"");
        let run =
            ended(method, &clutch, 0.5, &["the torque of `g` is NaN", "square_root(0.5 - t)", "it is undefined there"]);
        let transferred = |t: f64| 0.1 / 1.5 * (0.5f64.powf(1.5) - (0.5 - t).powf(1.5));
        close(at(&run, "a.w", 0.49), 0.49 - transferred(0.49));
        close(at(&run, "b.w", 0.49), transferred(0.49));
        let brake = two("[brake.g]\nshaft = \"a\"\ntorque = \"0.1 N m*sqrt(0.3 - a.phi)\"");
        let run = by(method, &brake);
        let Outcome::Failed { cause, .. } = &run.outcome else { panic!("it ends early") };
        assert!(cause.contains("the torque of `g` is NaN, as square_root(0.3 - a.phi)"), "{method:?}: {cause}");
        close(run.energy.input, 0.3);
        close(run.energy.dissipated, 0.1 / 1.5 * 0.3f64.powf(1.5));
        // At rest it holds, and lets go where its load is more.
        let sticking = brake.replace("sqrt(0.3 - a.phi)", "sqrt(400 - 800*t/(1 s))");
        let run = ended(method, &sticking, 0.5, &["the torque of `g` is NaN"]);
        close(time_of(&run, "g slips forward"), 0.375);
    }
}

/// `1.25 w = t − ⅔ c (½^1.5 − (½ − t)^1.5)` behind teeth of ratio 2.
#[test]
fn a_loss_whose_formula_ends_ends_the_run_by_name() {
    let gear = |loss: &str| two(&format!("[gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = 2\nloss = \"{loss}\""));
    let run = ended(
        Method::Automatic,
        &gear("0.1 N m*sqrt(0.5 - t/(1 s))"),
        0.5,
        &["the `loss` of `g` is NaN", "square_root(0.5 - t)", "it is undefined there"],
    );
    let loss_impulse = 0.1 / 1.5 * (0.5f64.powf(1.5) - 0.01f64.powf(1.5));
    close(at(&run, "a.w", 0.49), (0.49 - loss_impulse) / 1.25);
    ended(
        Method::Automatic,
        &gear("0.1 N m*ln(0.5 - t/(1 s))^2"),
        0.5,
        &["the `loss` of `g` is NaN", "logarithm(0.5 - t)"],
    );
    // Teeth at rest hold until then.
    let run =
        ended(Method::Automatic, &gear("2 N m + 0.1 N m*sqrt(0.5 - t/(1 s))"), 0.5, &["the `loss` of `g` is NaN"]);
    assert!(signal(&run, "a.w").iter().all(|speed| *speed == 0.0));
}

/// Torques of 1 N m less 2 N m/s are negative from ½ s on, a loss of 0.1 N m (½ − t) as well: rows and energies are those of that time.
#[test]
fn what_would_drive_ends_the_run_where_it_begins_to() {
    for method in METHODS {
        let clutch = two("[clutch.c]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\ntorque = \"1 N m - t*2 N m/s\"")
            .replace("\"1 N m\"\n", "\"3 N m\"\n");
        let run = ended(method, &clutch, 0.5, &["the torque of `c` becomes negative"]);
        // 3 t − t + t², and t − t².
        close(run.energy.input, 0.875);
        close(run.energy.stored, 0.8125);
        close(run.energy.dissipated, 0.0625);
        let brake = "[shaft.a]\ninertia = \"1 kg m^2\"\n[brake.c]\nshaft = \"a\"\ntorque = \"1 N m - t*2 N m/s\"\n\
                     [scenario]\nduration = \"1 s\"\noutput_step = \"1 ms\"\ninitial = { \"a.w\" = \"3 rad/s\" }\n";
        let run = ended(method, brake, 0.5, &["the torque of `c` becomes negative"]);
        close(run.energy.stored, -0.71875);
        close(run.energy.dissipated, 0.71875);
    }
    let gear = two("[gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = 2\nloss = \"0.1 N m*(0.5 - t/(1 s))\"");
    let run = ended(Method::Automatic, &gear, 0.5, &["the `loss` of `g` becomes negative"]);
    close(run.energy.input, (0.95 / 8.0 + 0.05 / 24.0) / 1.25);
    close(run.energy.stored, 0.5 * 1.25 * 0.39 * 0.39);
}

/// Held noise, a one-way clutch, a bent joint, and a clutch over a table of an angle: its points are looked for up to the end of each step.
#[test]
fn non_smooth_points_are_located_up_to_the_end_of_a_step() {
    let run = by(
        Method::Automatic,
        "[signal.nz]\nkind = \"noise\"\ndeviation = \"1 N m\"\nhold = \"13 ms\"\n[table.tb]\n\
         points = { x = [\"-1 rad\", \"0 rad\", \"1 rad\"], value = [\"1 N m\", \"0 N m\", \"2 N m\"] }\n\
         [shaft.a]\ninertia = \"1 kg m^2\"\nfriction = \"0.1 N m\"\n[shaft.b]\ninertia = \"0.5 kg m^2\"\n\
         [shaft.c]\ninertia = \"0.2 kg m^2\"\nfriction = \"0.05 N m\"\nbreakaway = \"0.1 N m\"\nstribeck_speed = \"0.1 rad/s\"\n\
         [spring_damper.k]\nshaft_1 = \"c\"\nstiffness = \"15 N m/rad\"\ndamping = \"0.05 N m s/rad\"\n\
         [torque.x]\nshaft = \"a\"\nlaw = \"3 N m*sin(7*t/(1 s)) + nz\"\n[universal_joint.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nangle = \"40 deg\"\n\
         [one_way_clutch.e0]\ndriving = \"b\"\ndriven = \"c\"\n[clutch.e1]\nshaft_1 = \"a\"\nshaft_2 = \"c\"\ntorque = \"tb(a.phi)\"\n\
         [scenario]\ninitial = { \"a.w\" = \"1 rad/s\" }\n",
    );
    assert_eq!(run.outcome, Outcome::Completed);
    assert!(run.energy.residual.abs() < 1e-9 * run.energy.exchanged, "{:?}", run.energy);
}

/// A lock lets go at 0.04 s; from then on both shafts, 0.7 kg m², follow 1 N m − 5 N m/s t together, by the clutch or by the one-way clutch. What rounding
/// makes of the torque of the latter while nothing moves shortens no step.
#[test]
fn a_torque_that_is_nothing_but_rounding_shortens_no_step() {
    let run = by(
        Method::Automatic,
        "[shaft.b]\ninertia = \"0.5 kg m^2\"\n[shaft.c]\ninertia = \"0.2 kg m^2\"\n[torque.x]\nshaft = \"c\"\nlaw = \"1 N m - 5 N m/s*t\"\n\
         [one_way_clutch.e0]\ndriving = \"b\"\ndriven = \"c\"\n[lock.e1]\nshaft_1 = \"c\"\nengaged = \"if(t < 0.04 s, 1, 0)\"\n\
         [clutch.e2]\nshaft_1 = \"b\"\nshaft_2 = \"c\"\ntorque = \"1 N m*(1 + sign(b.w))\"\n\
         [scenario]\nduration = \"1 s\"\ninitial = { \"c.w\" = \"1 rad/s\" }\n",
    );
    assert_eq!(run.outcome, Outcome::Completed);
    for shaft in ["b.w", "c.w"] {
        close(at(&run, shaft, 1.0), (0.96 - 2.5 * (1.0 - 0.0016)) / 0.7);
    }
    assert!(run.effort.steps < 200, "{:?}", run.effort);
}

/// A clutch that drives a shaft with 2 N m or nothing, by the sense of its speed, against 1.5 N m; and a torque by hand in place of a friction.
#[test]
fn a_law_that_goes_to_and_fro_ends_the_run_by_name() {
    let clutch = two(
        "[clutch.c]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\ntorque = \"1 N m*(1 - sign(b.w))\"\n[torque.y]\nshaft = \"b\"\nlaw = \"-1.5 N m\"",
    ) + "initial = { \"a.w\" = \"10 rad/s\", \"b.w\" = \"1 rad/s\" }\n";
    let law = "[shaft.b]\ninertia = \"1 kg m^2\"\n[torque.y]\nshaft = \"b\"\nlaw = \"-1 N m*sign(b.w)\"\n\
               [scenario]\nduration = \"2 s\"\noutput_step = \"1 ms\"\ninitial = { \"b.w\" = \"1 rad/s\" }\n";
    for (model, end) in [(&clutch[..], 2.0 / 3.0), (law, 1.0)] {
        let run = by(Method::Automatic, model);
        let Outcome::Failed { time, cause } = &run.outcome else { panic!("it ends early: {:?}", run.effort) };
        assert!((time - end).abs() < 1e-6, "{time}");
        assert!(cause.contains("the motion chatters at b.w = 0") && cause.contains("sqrt(x^2 + x_0^2)"), "{cause}");
        assert!(run.effort.steps < 10_000, "{:?}", run.effort);
    }
}
