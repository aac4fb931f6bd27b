//! Torques as laws: their slopes, equilibria, and what analyses say of them.

use kardan::num::rational_to_f64;
use kardan::reduce::{Dynamics, Reduced, equilibria, linearise};
use kardan::study::{AnalyzeSettings, Project, Silent, analyze, check};

use crate::common::{Dice, first, runs_only};

/// Two joints in a row on a steering-like shaft, springs with preload, and laws of everything.
fn loaded(random: &mut Dice) -> String {
    let mut number = |low: i64, high: i64| random.between(low, high) as f64 / 10.0;
    let [j1, j2, s, rest, angle1, angle2, g, d, c] = [
        number(1, 30),
        number(1, 30),
        number(10, 300),
        number(-10, 10),
        number(50, 500),
        number(50, 500),
        number(10, 100),
        number(1, 20),
        number(-30, 30),
    ];
    format!(
        "[shaft.a]\ninertia = \"{j1} kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n[shaft.c]\ninertia = \"{j2} kg m^2\"\n[shaft.d]\ninertia = \"2 kg m^2\"\n\
         [universal_joint.j]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nangle = \"{angle1} deg\"\n[universal_joint.k]\nshaft_1 = \"b\"\nshaft_2 = \"c\"\nangle = \"{angle2} deg\"\nphase = \"20 deg\"\n\
         [spring_damper.s]\nshaft_1 = \"c\"\nshaft_2 = \"d\"\nstiffness = \"{s} N m/rad\"\ndamping = \"0.5 N m s/rad\"\nrest = \"{rest} deg\"\n\
         [torque.g]\nshaft = \"c\"\nlaw = \"-{g} N m * sin(c.phi - 0.3 rad) - {d} N m s/rad * a.w * cos(d.phi)\"\n\
         [torque.h]\ncoefficients = {{ a = 1, d = -2 }}\nlaw = \"{c} N m/rad * b.phi * exp(d.phi - a.phi)\"\n\
         [torque.i]\nshaft = \"d\"\nreaction = \"b\"\nlaw = \"atan2(sin(a.phi) * 1 N m, 2 N m) * 3 N m + 0.2 N m * (d.w * 1 s)^3\"\n"
    )
}

/// The linear model's stiffness and damping are the negative derivatives of all forces at rest by positions and speeds, which differences of the
/// nonlinear equations show; also where joints are under load.
#[test]
fn linear_models_are_the_derivatives_of_the_forces() {
    let mut random = Dice(20);
    for _ in 0..60 {
        let source = loaded(&mut random);
        let variant = first(&source);
        let reduced = &variant.reduced;
        let r = reduced.degrees_of_freedom();
        let position: Vec<f64> = (0..r).map(|_| random.between(-100, 100) as f64 / 100.0).collect();
        let linear = linearise(reduced, &position);
        let step = 1e-5;
        for k in 0..r {
            let moved = |by: f64, speeds: bool| {
                let (mut q, mut v) = (position.clone(), vec![0.0; r]);
                *(if speeds { &mut v[k] } else { &mut q[k] }) += by;
                forces(reduced, &q, &v)
            };
            for (speeds, matrix) in [(false, &linear.stiffness), (true, &linear.damping)] {
                let (above, below) = (moved(step, speeds), moved(-step, speeds));
                for i in 0..r {
                    let slope = (above[i] - below[i]) / (2.0 * step);
                    let own = rational_to_f64(&matrix[(i, k)]);
                    assert!(
                        (own + slope).abs() < 1e-6 * (1.0 + own.abs()) * 100.0,
                        "{i} {k} {speeds}: {own} {slope}\n{source}"
                    );
                }
            }
        }
    }
}

fn forces(reduced: &Reduced, position: &[f64], speed: &[f64]) -> Vec<f64> {
    let (dynamics, mut work) = Dynamics::new(reduced);
    dynamics.update(position, speed, &mut work);
    work.passive
}

/// What is found is an equilibrium, and where it is proven no torque vanishes nearby.
#[test]
fn equilibria_are_free_of_torque() {
    let mut random = Dice(21);
    let mut proven = 0;
    for _ in 0..30 {
        let source = loaded(&mut random);
        let variant = first(&source);
        let reduced = &variant.reduced;
        let found = equilibria(reduced, &vec![0.1; reduced.degrees_of_freedom()]);
        assert_eq!((found.constant, found.free.len()), (None, 0));
        for one in &found.found {
            let residual = forces(reduced, &one.position, &vec![0.0; one.position.len()]);
            assert!(
                residual.iter().all(|torque| torque.abs()
                    < 1e-9 * (1.0 + one.position.iter().fold(0.0, |m: f64, x| m.max(x.abs().exp())))),
                "{residual:?} {one:?}\n{source}"
            );
            proven += usize::from(one.radius.is_some());
        }
    }
    assert!(proven >= 20, "{proven}");
}

const PENDULUM: &str = "[shaft.arm]\ninertia = \"2 kg m^2\"\n[torque.gravity]\nshaft = \"arm\"\nlaw = \"-18 N m * sin(arm.phi)\"\n\
                        [motor.m]\nshaft = \"arm\"\n";

/// The pendulum hangs with poles at ±3j and stands with poles at ±3 1/s; each is found or named, and the class says where the theory ends.
#[test]
fn a_pendulum_is_analysed_where_it_rests() {
    let analysed = |more: &str| {
        let settings = AnalyzeSettings::default();
        analyze(&format!("{PENDULUM}{more}"), &settings, &Silent).unwrap_or_else(|wrong| panic!("{wrong:?}"))
    };
    let poles = |more: &str| -> Vec<(f64, f64)> {
        let mut all: Vec<(f64, f64)> =
            analysed(more).modes.iter().map(|mode| (mode.eigenvalue.re, mode.eigenvalue.im.abs())).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all
    };
    let hanging = poles("[scenario]\ninitial = { \"arm.phi\" = \"50 deg\" }\n");
    assert!(hanging.iter().all(|(re, im)| re.abs() < 1e-9 && (im - 3.0).abs() < 1e-9), "{hanging:?}");
    let inverted = poles("[analysis]\nat = { \"arm.phi\" = \"180 deg\" }\n");
    assert!(inverted.len() == 2 && inverted[0].1 == 0.0, "{inverted:?}");
    assert!((inverted[0].0 + 3.0).abs() < 1e-9 && (inverted[1].0 - 3.0).abs() < 1e-9, "{inverted:?}");
    let analysis = analysed("");
    let class = analysis.class.as_ref().unwrap();
    assert!(
        !class.constant_linear && class.assumptions.iter().any(|one| !one.satisfied && one.statement.contains("4.36"))
    );
    assert!(analysis.notes.iter().any(|note| note.contains("arm.phi = 0.000000 deg, proven")), "{:?}", analysis.notes);
    assert!(
        analysis.notes.iter().any(|note| note.contains("other equilibria") && note.contains("180.000000 deg")),
        "{:?}",
        analysis.notes
    );
    assert!(analysis.structure.controllable());
}

/// A law that jumps with a speed is told to be friction.
#[test]
fn a_sign_of_a_speed_is_friction() {
    let reported = |law: &str| check(&PENDULUM.replace("-18 N m * sin(arm.phi)", law));
    let jumps = reported("-2 N m * sign(arm.w)");
    assert!(jumps.len() == 1 && jumps[0].code == "law::discontinuous", "{jumps:?}");
    assert!(reported("-2 N m * sign(arm.phi) - 1 N m s^2/rad^2 * arm.w * abs(arm.w)").is_empty());
}

/// A run may begin where the model rests, and stays there.
#[test]
fn a_run_may_begin_at_an_equilibrium() {
    let source = "[mass.body]\nmass = \"2 kg\"\n[spring_damper.s]\nmass_1 = \"body\"\nstiffness = \"100 N/m\"\n\
                  [torque.gravity]\nmass = \"body\"\nlaw = \"-2 kg * 9.81 m/s^2 - 500 N/m^3 * body.s^3\"\n\
                  [scenario]\nstart = \"equilibrium\"\nduration = \"1 s\"\n";
    let study = Project::open(source).run(&runs_only(), &Silent).unwrap_or_else(|wrong| panic!("{wrong:?}"));
    let run = &study.runs[0];
    let place = &run.series.signal("body.s").unwrap().values;
    // 100 x + 500 x³ = −19.62, by bisection.
    let (mut low, mut high) = (-1.0_f64, 0.0_f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if 100.0 * middle + 500.0 * middle.powi(3) < -19.62 { low = middle } else { high = middle }
    }
    assert!(place.iter().all(|x| (x - low).abs() < 1e-12), "{} {low}", place[0]);
    assert!(
        run.notes
            .iter()
            .any(|note| note.starts_with("the run begins at the equilibrium body.s = -0.1") && note.contains("proven")),
        "{:?}",
        run.notes
    );
    let falling =
        source.replace("stiffness = \"100 N/m\"", "damping = \"1 N s/m\"").replace(" - 500 N/m^3 * body.s^3", "");
    let refused = check(&falling);
    assert!(
        refused.iter().any(|reported| reported.code == "scenario::equilibrium"
            && reported.message.contains("-19.62 N act on `body` at every position")),
        "{refused:?}"
    );
}

/// Where there is no equilibrium that is said, and whether it is proven.
#[test]
fn no_equilibrium_is_reported() {
    let refused = |law: &str| {
        let source = PENDULUM.replace("-18 N m * sin(arm.phi)", law);
        let wrong = analyze(&source, &AnalyzeSettings::default(), &Silent).unwrap_err();
        wrong[0].message.clone()
    };
    let message = refused("-3 N m");
    assert_eq!(message, "there is no equilibrium: -3 N m act on `arm` at every position");
    // No number of the graph: a table at a place, a cosine of a number; rates are zero.
    let spun = "[table.tb]\npoints = { x = [\"0 rad/s\", \"5 rad/s\"], value = [\"1 N m\", \"2 N m\"] }\n";
    let source = format!("{}{spun}", PENDULUM.replace("-18 N m * sin(arm.phi)", "tb(arm.w)"));
    let wrong = analyze(&source, &AnalyzeSettings::default(), &Silent).unwrap_err();
    assert_eq!(wrong[0].message, "there is no equilibrium: 1 N m act on `arm` at every position");
    let message = refused("cos(1) * 2 N m");
    assert!(message.starts_with("there is no equilibrium: 1.0806046117362"), "{message}");
    let message = refused("-2 N m + sin(arm.phi) * 1 N m");
    assert!(
        message.starts_with(
            "no equilibrium was found from 25 starts within a turn (that there is none is not proven); the smallest residual is 1.0"
        ),
        "{message}"
    );
    let named = format!(
        "{}[analysis]\nat = {{ \"arm.phi\" = \"30 deg\" }}\n",
        PENDULUM.replace("-18 N m * sin(arm.phi)", "-3 N m")
    );
    assert!(analyze(&named, &AnalyzeSettings::default(), &Silent).is_ok());
}

/// What is told of an equilibrium is true of it: unique, one of a continuum, flat, or one of several.
#[test]
fn equilibria_are_reported_as_what_they_are() {
    let reported = |law: &str, more: &str| {
        let source = format!(
            "{}{more}[scenario]\nduration = \"10 ms\"\nstart = \"equilibrium\"\n",
            PENDULUM.replace("-18 N m * sin(arm.phi)", law)
        );
        let study = Project::open(&source).run(&runs_only(), &Silent).unwrap_or_else(|wrong| panic!("{wrong:?}"));
        let notes = study.runs[0].notes.clone();
        notes
            .iter()
            .filter(|note| note.contains("equilibri") || note.contains("begins at"))
            .cloned()
            .collect::<Vec<_>>()
    };
    let every = "no torque depends on the position, so that every one is an equilibrium";
    assert_eq!(reported("0 N m * arm.phi", ""), [format!("the run begins at arm.phi = 0.000000 deg; {every}")]);
    // -phi^3 is isolated at zero, but its derivative vanishes there.
    let flat = "the run begins at arm.phi = 0.000000 deg, where no residual torque remains; that there is exactly one nearby is not proven, as the \
                derivative of the torques is singular there, or nearly";
    assert_eq!(reported("-1 N m * (arm.phi)^3", ""), [flat]);
    let one = "the run begins at the equilibrium arm.phi = 0.000000 deg, proven: there is exactly one within 1e-12 of it, relative to a radian or \
               metre or its size";
    assert_eq!(reported("-1 N m * arm.phi / (1 rad)", ""), [one]);
    let beside = reported("-1 N m * arm.phi / (1 rad)", "[shaft.free]\ninertia = \"1 kg m^2\"\n");
    let among = "within 1e-12 of it among positions with the same `free`, relative";
    assert!(beside.len() == 1 && beside[0].contains(among), "{beside:?}");
    let several = reported("-18 N m * sin(3 * arm.phi)", "");
    assert!(
        several[1].starts_with("other equilibria, of those that 24 starts within a turn led to (there may be more): "),
        "{several:?}"
    );
}
