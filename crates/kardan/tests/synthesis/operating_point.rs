//! Designs at an operating point: against the closed form of a pendulum, whose stiffness at φ is m g l cos φ, and of a joint whose gear is a spring.

use kardan::diagnostics::Diagnostic;
use kardan::export::linear_python;
use kardan::num::rational_to_f64;
use kardan::results::{Design, Outcome, Stability};
use kardan::study::{self, DesignSettings, Settings, Silent};

/// Torque of gravity with the arm level, N m, inertia, and damping.
const LOAD: f64 = 40.0;
const INERTIA: f64 = 2.0;
const DAMPING: f64 = 0.5;

#[track_caller]
fn close(value: f64, expected: f64, tolerance: f64) {
    crate::common::close(value, expected, tolerance, "the closed form");
}

fn pendulum(law: &str, keys: &str) -> String {
    format!(
        "[model]\nname = \"pendulum\"\n[shaft.arm]\ninertia = \"2 kg m^2\"\ndamping = \"0.5 N m s/rad\"\n\
         [torque.gravity]\nshaft = \"arm\"\nlaw = \"{law}\"\n[motor.drive]\nshaft = \"arm\"\ntorque_limit = \"60 N m\"\n\
         [control.hold]\nlaw = \"pole_placement\"\ninputs = [\"drive\"]\npoles = [-5, -7]\n{keys}\
         [[control.hold.channels]]\noutput = \"arm.phi\"\nreference = \"ref\"\n"
    )
}

const GRAVITY: &str = "-40 N m * sin(arm.phi)";
const AT_60: &str = "at = { \"arm.phi\" = \"60 deg\" }\n";
/// From the operating point, with the reference there from the first instant on, and 0.5 deg more after 1 s.
const RUN: &str = "[scenario]\nduration = \"3 s\"\noutput_step = \"10 ms\"\nstart = \"operating_point\"\n\
                   [[scenario.event]]\nat = \"0 s\"\nsignal = \"ref\"\nto = \"60 deg\"\n";

fn designed(source: &str) -> Result<Design, Vec<Diagnostic>> {
    study::design(source, &DesignSettings::default(), &Silent)
}

fn gain(design: &Design) -> Vec<f64> {
    design.gains.iter().find(|gain| gain.name == "K").expect("a state gain").values[0].clone()
}

fn reported(list: &[String], fragment: &str) -> bool {
    list.iter().any(|text| text.contains(fragment))
}

#[test]
fn the_poles_at_the_point_are_those_requested() {
    let design = designed(&pendulum(GRAVITY, AT_60)).expect("a design");
    // s² + (d + k₂)/J s + (m g l cos φ + k₁)/J = (s + 5)(s + 7)
    let cos = (60.0_f64).to_radians().cos();
    let k = gain(&design);
    close(k[0], 35.0 * INERTIA - LOAD * cos, 1e-12);
    close(k[1], 12.0 * INERTIA - DAMPING, 1e-12);
    let poles: Vec<f64> = design.closed_loop_poles.iter().map(|pole| pole.re).collect();
    close(poles[0], -5.0, 1e-9);
    close(poles[1], -7.0, 1e-9);
    // m g l sin φ holds it.
    assert!(
        reported(&design.notes, "arm.phi = 60.000000 deg, balanced by drive = 34.641016 N m; proven"),
        "{:?}",
        design.notes
    );
    assert!(reported(&design.notes, "small motions around it"));
    let numbers = &design.controller_data.numbers;
    let number = |name: &str| numbers.iter().find(|number| number.name == name).expect("a number").value;
    close(number("drive at rest"), LOAD * (60.0_f64).to_radians().sin(), 1e-12);
    close(number("arm.phi at rest"), (60.0_f64).to_radians(), 1e-15);
    // At zero, which is a position at rest, the stiffness is m g l, and nothing is named.
    let zero = designed(&pendulum(GRAVITY, "")).expect("a design");
    close(gain(&zero)[0], 35.0 * INERTIA - LOAD, 1e-12);
    assert!(
        reported(&zero.notes, "at rest without torques of motors; proven: the residual torque is exactly zero"),
        "{:?}",
        zero.notes
    );
    assert_eq!(
        (zero.design_model.as_str(), design.design_model.as_str()),
        ("linear, at zero angles", "linear, at the operating point")
    );
}

/// With an observer, with a sample time, and with both, the loop stands where it is named, to rounding, and goes where it is sent.
#[test]
fn a_run_stays_at_the_operating_point() {
    let observer = "[control.hold.observer]\nsensors = [\"arm.phi\"]\npoles = [-40, -50, -60]\n";
    let sampled = "sample_time = \"1 ms\"\n";
    let by_lqr = |text: String| text.replace("\"pole_placement\"", "\"lqr\"").replace("poles = [-5, -7]\n", "");
    let plain = pendulum(GRAVITY, AT_60);
    let with_clock = pendulum(GRAVITY, &format!("{AT_60}{sampled}"));
    let sources = [
        plain.clone(),
        with_clock.clone(),
        by_lqr(plain.clone()),
        format!("{plain}{observer}"),
        format!("{with_clock}{observer}"),
    ];
    let point = (60.0_f64).to_radians();
    for source in sources {
        let found = study::run(&format!("{source}{RUN}"), &Settings::default(), &Silent).expect("a run");
        let run = &found.runs[0];
        assert_eq!(run.outcome, Outcome::Completed);
        let arm = &run.series.signal("arm.phi").expect("an angle").values;
        assert!(arm.iter().all(|angle| (angle - point).abs() < 1e-12), "{source}");
        if source.contains("lqr") {
            continue; // A slow loop, which would not be at rest again.
        }
        // A step of the reference is followed as the linear loop says, but for what bends: (Δφ)² m g l sin φ/2 over the stiffness of the loop.
        let step = "[[scenario.event]]\nat = \"1 s\"\nsignal = \"ref\"\nto = \"60.5 deg\"\n";
        let found = study::run(&format!("{source}{RUN}{step}"), &Settings::default(), &Silent).expect("a run");
        let end = *found.runs[0].series.signal("arm.phi").expect("an angle").values.last().expect("rows");
        let nonlinearity = (0.5_f64).to_radians().powi(2) * LOAD * point.sin() / 2.0 / 70.0;
        assert!((end - (60.5_f64).to_radians()).abs() < 2.0 * nonlinearity, "{source}: {end}");
    }
}

/// Of a joint whose gear is a spring the motor stands where it winds the spring up; both are found with the torque that holds them.
#[test]
fn unnamed_coordinates_are_those_of_the_equilibrium() {
    let source = "[model]\nname = \"joint\"\ncoordinates = [\"rotor\", \"arm\"]\n[shaft.rotor]\ninertia = \"0.01 kg m^2\"\n\
                  [shaft.arm]\ninertia = \"2 kg m^2\"\n[spring_damper.gear]\nshaft_1 = \"rotor\"\nshaft_2 = \"arm\"\nstiffness = \"800 N m/rad\"\n\
                  [torque.gravity]\nshaft = \"arm\"\nlaw = \"-40 N m * sin(arm.phi)\"\n[motor.drive]\nshaft = \"rotor\"\n\
                  [control.hold]\nlaw = \"pole_placement\"\ninputs = [\"drive\"]\npoles = [-10, -12, \"-20 ± 30j\"]\n\
                  at = { \"arm.phi\" = \"60 deg\" }\n[[control.hold.channels]]\noutput = \"arm.phi\"\nreference = \"ref\"\n";
    let (project, point) = (study::Project::open(source), (60.0_f64).to_radians());
    let plant = &project.prepared().variants[0].design_models[0];
    close(plant.point.position[1], point, 1e-15);
    close(plant.point.position[0], point + LOAD * point.sin() / 800.0, 1e-13);
    close(plant.trim_torque("drive"), LOAD * point.sin(), 1e-12);
    // det(s² H + S) with S = [s, −s; −s, s + m g l cos φ]
    close(plant.linear.stiffness.to_f64()[(1, 1)], 800.0 + LOAD * point.cos(), 1e-12);
    let poles: Vec<(f64, f64)> = project
        .design(&DesignSettings::default(), &Silent)
        .expect("a design")
        .closed_loop_poles
        .iter()
        .map(|p| (p.re, p.im))
        .collect();
    for (expected, found) in [(-10.0, 0.0), (-12.0, 0.0)].into_iter().zip(&poles) {
        close(found.0, expected.0, 1e-6);
        assert!(found.1.abs() < 1e-6);
    }
    let run = format!("{source}{RUN}");
    let found = study::run(&run, &Settings::default(), &Silent).expect("a run");
    let arm = &found.runs[0].series.signal("arm.phi").expect("an angle").values;
    assert!(arm.iter().all(|angle| (angle - point).abs() < 1e-11));
}

/// A motor at the end of a crank: the stiffness that its constant torque makes through the bent joint is that of the second derivative.
#[test]
fn a_loaded_joint_has_the_stiffness_of_its_torque() {
    let source = "[model]\nname = \"bent\"\ncoordinates = [\"a\"]\n[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"0.5 kg m^2\"\n\
                  [universal_joint.joint]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nangle = \"40 deg\"\n[torque.weight]\nshaft = \"a\"\n\
                  law = \"-10 N m * sin(a.phi)\"\n[motor.drive]\nshaft = \"b\"\n\
                  [control.hold]\nlaw = \"pole_placement\"\ninputs = [\"drive\"]\npoles = [-3, -4]\nat = { \"a.phi\" = \"50 deg\" }\n";
    let project = study::Project::open(source);
    let variant = &project.prepared().variants[0];
    let plant = &variant.design_models[0];
    // The torque along a at rest, as a function of the position, with the torque of the motor standing still.
    let u = plant.trim_torque("drive");
    let mut kinematics = kardan::reduce::Kinematics::new(&plant.reduced);
    let b = plant.reduced.coordinate("b").expect("a shaft");
    let mut force = |a: f64| {
        kinematics.update(&[a], &[0.0]);
        -10.0 * a.sin() + kinematics.row(b)[0] * u
    };
    let (point, step) = ((50.0_f64).to_radians(), 1e-5);
    assert!(force(point).abs() < 1e-12 && u.abs() > 5.0);
    let slope = (force(point + step) - force(point - step)) / (2.0 * step);
    close(plant.linear.stiffness.to_f64()[(0, 0)], -slope, 1e-8);
    assert!((slope + 10.0 * point.cos()).abs() > 0.5, "the joint adds to it");
}

fn refused(source: &str, code: &str, fragments: &[&str]) {
    let diagnostics = designed(source).expect_err("a mistake");
    let found =
        diagnostics.iter().find(|diagnostic| diagnostic.code == code).unwrap_or_else(|| panic!("{diagnostics:?}"));
    fragments.iter().for_each(|word| assert!(found.to_string().contains(word), "{found}"));
}

/// A program that pushes a car on, `f = 4 v`, against the drag `0.5 v |v|`: at 10 m/s this has the slope 10 N s/m, so that the loop is stable there up to
/// a factor of 2.5; at rest it is not.
#[test]
fn a_program_is_looked_at_in_motion() {
    let car = |keys: &str| {
        format!(
            "[model]\nname = \"car\"\n[mass.car]\nmass = \"2 kg\"\n[motor.m]\nmass = \"car\"\n\
             [torque.drag]\nmass = \"car\"\nlaw = \"-0.5 kg/m * car.v * abs(car.v)\"\n\
             [control.c]\nlaw = \"program\"\ncommands = {{ m = \"4 N s/m * car.v\" }}\n{keys}\
             [scenario]\nduration = \"2 s\"\ninitial = {{ \"car.v\" = \"10 m/s\" }}\n"
        )
    };
    let stable = |design: &Design| design.margins.as_ref().and_then(|found| found.stable);
    assert_eq!(stable(&designed(&car("")).expect("a warning alone")), Some(false));
    for at in ["at = { \"car.v\" = \"10 m/s\" }\n", "at = { \"car.v\" = \"36 km/h\" }\n", "at = \"t = 0 s\"\n"] {
        let design = designed(&car(at)).unwrap_or_else(|wrong| panic!("{at}: {wrong:?}"));
        assert_eq!(stable(&design), Some(true), "{at}");
        close(design.margins.as_ref().expect("margins").gain_margin.as_ref().expect("stable")[1].value, 2.5, 1e-3);
        assert!(reported(&design.notes, "car.v = 10.000000 m/s"), "{:?}", design.notes);
    }
    let forced = car("at = { \"car.v\" = \"10 m/s\", \"m.f\" = \"1 N\" }\n");
    refused(&forced, "control::operating-point", &["no steady motion was found"]);
    let begins = car("at = { \"car.v\" = \"10 m/s\" }\n") + "start = \"operating_point\"\n";
    refused(&begins, "control::operating-point", &["a run begins there at rest"]);
    refused(&car("at = \"t = 3 s\"\n"), "control::operating-point", &["`t` = 3 s is after the end of the run"]);
    let mixed = pendulum(GRAVITY, "at = { \"arm.w\" = \"1 rad/s\" }\n");
    refused(&mixed, "control::operating-point", &["kardan designs a law of this kind at an equilibrium"]);
}

/// Where a torque has a kink at the operating point, everything is about one side of it, and the opposite one stands beside it: `τ = −40 |sin φ|` is a
/// spring of 40 N m/rad where φ > 0, and one of −40 N m/rad where φ < 0.
#[test]
fn both_sides_of_a_kink_are_reported() {
    let source = pendulum("-40 N m * abs(sin(arm.phi))", "");
    let design = designed(&source).expect("a design");
    close(gain(&design)[0], 35.0 * INERTIA - 40.0, 1e-12);
    assert_eq!(design.margins.as_ref().and_then(|found| found.stable), Some(true));
    // J s² + 24 s + (30 − 40) on the other side: a root to the right.
    let opposite = design.opposite_side.as_ref().expect("a kink");
    assert_eq!([&opposite.reference_side, &opposite.side], ["`sin(arm.phi)` > 0", "`sin(arm.phi)` < 0"]);
    assert_eq!(opposite.margins.stable, Some(false));
    let unstable = "on the side where `sin(arm.phi)` < 0 the loop is unstable";
    assert!(reported(&design.warnings, unstable), "{:?}", design.warnings);
    // One that holds both: J s² + 24 s + 60 ∓ 10.
    let weak = designed(&pendulum("-10 N m * abs(sin(arm.phi))", "")).expect("a design");
    let other_side = weak.opposite_side.expect("a kink").margins;
    assert_eq!(other_side.stable, Some(true));
    // With the torque times g the loop on that side is J s² + … + 60 g − 10: stable above a sixth.
    close(other_side.gain_margin.expect("stable")[0].value, 1.0 / 6.0, 1e-6);
    let settings = study::AnalyzeSettings::default();
    let analysis = study::analyze(&source, &settings, &Silent).expect("an analysis");
    let unit = 40.0 / INERTIA;
    let damped = DAMPING / INERTIA / 2.0;
    close(analysis.modes[0].eigenvalue.im.abs(), (unit - damped * damped).sqrt(), 1e-12);
    let other_side = analysis.opposite_side.expect("a kink");
    assert_eq!(other_side.stability.word, Stability::Unstable, "{}", other_side.stability);
    assert_eq!([other_side.controllable, other_side.observable], [Some(true); 2]);
    let expected = [-damped - (unit + damped * damped).sqrt(), -damped + (unit + damped * damped).sqrt()];
    let mut found: Vec<f64> = other_side.modes.iter().map(|mode| mode.eigenvalue.re).collect();
    found.sort_by(f64::total_cmp);
    found.iter().zip(expected).for_each(|(found, expected)| close(*found, expected, 1e-12));
    let (linear, _) = study::linearise(&source, &settings, false).expect("a linear model");
    assert_eq!(linear.side.as_deref(), Some("`sin(arm.phi)` > 0"));
    assert_eq!(rational_to_f64(&linear.a[(1, 0)]), -unit);
    let other_side = linear.opposite_side.as_ref().expect("a kink");
    assert_eq!(
        (other_side.side.as_deref(), rational_to_f64(&other_side.a[(1, 0)])),
        (Some("`sin(arm.phi)` < 0"), unit)
    );
    assert_eq!(other_side.opposite_side, None);
    assert!(linear_python(&linear).contains("A_opposite = np.array"), "both sides");
}

/// A law with ten conditions at zero: `Σ sign(g)·abs(g)` with `g = φ + k w` is `10 φ + 45 w`; with one more `abs` it has a kink.
#[test]
fn laws_with_many_conditions_have_their_slopes() {
    let many = |law: &dyn Fn(&str) -> String| {
        let term = |k: usize| law(&format!("(arm.phi + {k} s * arm.w)"));
        let sum: Vec<String> = (0..10).map(term).collect();
        format!("-1 N m/rad * ({})", sum.join(" + "))
    };
    let design = |law: &str| {
        let source = format!(
            "[model]\nname = \"many\"\n[shaft.arm]\ninertia = \"2 kg m^2\"\n[motor.drive]\nshaft = \"arm\"\n\
             [control.c]\nlaw = \"program\"\ncommands = {{ drive = \"{law}\" }}\n[scenario]\nduration = \"1 s\"\n"
        );
        designed(&source).unwrap_or_else(|wrong| panic!("{wrong:?}"))
    };
    let disk = |design: &Design| design.margins.as_ref().expect("margins").channels[0].disk;
    let plain = design(&many(&|g| g.to_string()));
    let signed = design(&many(&|g| format!("sign{g} * abs{g}")));
    assert_eq!((&plain.opposite_side, &signed.opposite_side), (&None, &None));
    close(disk(&signed), disk(&plain), 1e-6);
    let kinked = design(&(many(&|g| format!("sign{g} * abs{g}")) + " - 5 N m/rad * abs(arm.phi + 0.5 s * arm.w)"));
    // 15 φ + 47.5 w on the side that is looked at, 5 φ + 42.5 w on the other.
    let [own, other] = [15.0, 5.0].map(|stiffness| {
        let rate = if stiffness > 10.0 { 47.5 } else { 42.5 };
        design(&format!("-{stiffness} N m/rad * arm.phi - {rate} N m s/rad * arm.w"))
    });
    close(disk(&kinked), disk(&own), 1e-6);
    let opposite = kinked.opposite_side.expect("a kink").margins;
    close(opposite.channels[0].disk, disk(&other), 1e-6);
}

/// A product of two signals that are zero has no slope, also beside many conditions: its block, with another clock, is not in the loop.
#[test]
fn slopes_beside_many_conditions_are_exact() {
    let terms = (0..10).map(|k| format!("sign(arm.phi + {k} s * arm.w) * abs(arm.phi + {k} s * arm.w)"));
    let terms: Vec<String> = terms.collect();
    let block = |name: &str, keys: &str| format!("[block.{name}]\nunit = \"rad\"\n{keys}\n");
    let design = |last: &str| {
        let reference = format!(
            "kind = \"gain\"\ngain = 1\nsample_time = \"1 ms\"\ninput = \"0.001 * ({}) + {last}\"",
            terms.join(" + ")
        );
        let source = format!(
            "[model]\nname = \"many\"\n[shaft.arm]\ninertia = \"2 kg m^2\"\ndamping = \"1 N m s/rad\"\n\
             [motor.drive]\nshaft = \"arm\"\n{}{}{}[control.c]\nlaw = \"position_loop\"\nsample_time = \"1 ms\"\n\
             output = \"arm.phi\"\ninput = \"drive\"\nreference = \"ref\"\n[scenario]\nduration = \"1 s\"\n",
            block(
                "slow",
                "kind = \"low_pass\"\ninput = \"arm.w * (1 s)\"\ntime_constant = \"50 ms\"\nsample_time = \"5 ms\""
            ),
            block("held", "kind = \"hold\"\ninput = \"slow\"\nsample_time = \"1 ms\""),
            block("ref", &reference),
        );
        designed(&source).unwrap_or_else(|wrong| panic!("{wrong:?}"))
    };
    let blocks = |design: &Design| {
        let note = design.notes.iter().find(|note| note.contains("closes through")).expect("a note on blocks");
        note.rsplit_once(": ").expect("names").1.to_string()
    };
    let (product, sum) = (design("0.001 * held * arm.phi / (1 rad)"), design("0.001 * held"));
    assert_eq!((blocks(&product).as_str(), blocks(&sum).as_str()), ("`ref`", "`ref`, `slow`"));
    // With one clock there are margins of the reading, and frequency responses.
    assert!(product.margins.expect("margins").channels.iter().any(|channel| channel.is_sensor));
}

#[test]
fn unbalanced_points_and_kinks_are_reported() {
    // 40 N m sin 60° is within 60 N m, 100 N m sin 60° is not.
    refused(
        &pendulum("-100 N m * sin(arm.phi)", AT_60),
        "control::operating-point",
        &["`drive` would have to give 86.602540 N m", "60 N m"],
    );
    // A torque on a shaft that the motor does not reach.
    let more = "[shaft.free]\ninertia = \"1 kg m^2\"\n[torque.push]\nshaft = \"free\"\nlaw = \"2 N m * cos(free.phi)\"\n\
                [spring_damper.s]\nshaft_1 = \"free\"\nshaft_2 = \"arm\"\nstiffness = \"1 N m/rad\"\n";
    let both = "at = { \"arm.phi\" = \"0 deg\", \"free.phi\" = \"0 deg\" }\n";
    let poles = |text: String| text.replace("[-5, -7]", "[-5, -7, -8, -9]");
    refused(
        &poles(pendulum(GRAVITY, both) + more),
        "control::operating-point",
        &["is no equilibrium: 2.000000 N m on `free`"],
    );
    // Not named, it is a warning; the law is designed at zero angles.
    let (_, warnings) = study::prepare(&poles(pendulum(GRAVITY, "") + more));
    let warning = warnings.iter().find(|one| one.code == "control::operating-point").expect("a warning");
    assert!(
        warning.to_string().contains("zero angles, which is no equilibrium of the model: 2.000000 N m on `free`"),
        "{warning}"
    );
    // No kink where it is elsewhere or where both sides agree.
    let kink = "-40 N m * abs(arm.phi - 1)";
    assert_eq!(designed(&pendulum(kink, AT_60)).expect("smooth there").opposite_side, None);
    let drag = designed(&pendulum("-1 N m s^2/rad^2 * arm.w * abs(arm.w)", "")).expect("both sides agree");
    close(gain(&drag)[0], 35.0 * INERTIA, 1e-12);
    // Where the angle of the kink is no number of the machine, rounding does not hide it, and both sides of `x |x|` agree all the same.
    for (kink, at) in [("60 deg", AT_60), ("0.1", "at = { \"arm.phi\" = \"0.1 rad\" }\n")] {
        let bent = designed(&pendulum(&format!("-40 N m * abs(arm.phi - {kink})"), at)).expect("one side");
        assert!(bent.opposite_side.is_some_and(|found| found.side.contains("arm.phi")), "{kink}");
        let smooth = format!("-40 N m * (arm.phi - {kink}) * abs(arm.phi - {kink})");
        close(gain(&designed(&pendulum(&smooth, at)).expect("both sides agree"))[0], 35.0 * INERTIA, 1e-12);
    }
    // Where a slope has no end, or the law no value.
    for (law, at) in [("sqrt(abs(arm.phi - 1))", "1 rad"), ("sqrt(1 - cos(arm.phi))", "0 rad")] {
        let at = format!("at = {{ \"arm.phi\" = \"{at}\" }}\n");
        let slope = "`gravity` has no slope at the operating point";
        refused(
            &pendulum(&format!("-4 N m * {law}"), &at),
            "control::not-differentiable",
            &[slope, "its slope is infinite"],
        );
    }
    refused(&pendulum("-4 N m / (arm.phi)", ""), "control::not-differentiable", &["its value is not a number"]);
    let jump = "-4 N m * sign(arm.phi)";
    refused(&pendulum(jump, ""), "control::not-differentiable", &["it jumps where `arm.phi` = 0"]);
    // An analysis refuses it the same way.
    let settings = study::AnalyzeSettings::default();
    let analysed = |angle: &str| {
        let at = format!("[analysis]\nat = {{ \"arm.phi\" = \"{angle}\" }}\n");
        study::analyze(&(pendulum(jump, AT_60) + &at), &settings, &Silent).map(|_| ())
    };
    let diagnostics = analysed("0 rad").expect_err("a jump");
    assert!(
        diagnostics[0].code == "analysis::not-differentiable"
            && diagnostics[0].to_string().contains("`gravity` has no slope"),
        "{diagnostics:?}"
    );
    assert!(analysed("60 deg").is_ok());
    // A law on the full model has no use for a point, and two controllers have one.
    let full = "[model]\nname = \"full\"\n[shaft.arm]\ninertia = \"2 kg m^2\"\n[torque.gravity]\nshaft = \"arm\"\nlaw = \"-40 N m * sin(arm.phi)\"\n\
                [motor.drive]\nshaft = \"arm\"\n[control.hold]\nlaw = \"computed_torque\"\nat = { \"arm.phi\" = \"60 deg\" }\n\
                [[control.hold.channels]]\noutput = \"arm.phi\"\ninput = \"drive\"\nreference = \"ref\"\n";
    refused(full, "control::operating-point", &["has no operating point"]);
}

/// The built-in joint of a robot, designed at 60 deg: the poles asked for are the roots of its characteristic polynomial, written down by hand with
/// the stiffness m g l cos φ of the arm there; and a run holds it there.
#[test]
fn the_robot_joint_is_designed_where_it_hangs() {
    use kardan::results::Complex;
    let model = kardan::model::builtin("robot-joint").expect("built in").source;
    let before = |text: &'static str, mark: &str| text.split(mark).next().unwrap_or_default();
    let source = before(model, "[[requirement]]").split("[scenario]").next().unwrap_or_default().to_string()
        + "[[variant]]\nname = \"held\"\ncontrols = [\"hold\"]\n[control.hold]\nlaw = \"pole_placement\"\ninputs = [\"motor\"]\n\
           poles = [-20, -25, \"-60 ± 200j\"]\nat = { \"arm.phi\" = \"60 deg\" }\n[[control.hold.channels]]\noutput = \"arm.phi\"\n\
           reference = \"ref\"\n"
        + RUN;
    let settings =
        DesignSettings { control: Some("hold".into()), variant: Some("held".into()), ..DesignSettings::default() };
    let design = study::design(&source, &settings, &Silent).expect("a design");
    let (k, point) = (gain(&design), (60.0_f64).to_radians());
    // At the arm: the drive of 31 kN m/rad, 20 N m s/rad as felt at the flexspline, 1:101.
    let (s, c, n) = (31e3, 20.0 * 1.01 * 1.01, 101.0);
    let load = (3.0 + 5.0) * 9.81 * 0.6;
    let inertia = [1.4e-4, (2.0 + 5.0) * 0.36];
    for (re, im) in [(-20.0, 0.0), (-25.0, 0.0), (-60.0, 200.0)] {
        let pole = Complex { re, im };
        let times = |a: Complex, b: Complex| Complex { re: a.re * b.re - a.im * b.im, im: a.re * b.im + a.im * b.re };
        let entry = |h: f64, d: f64, s: f64| {
            let square = times(pole, pole);
            Complex { re: h * square.re + d * pole.re + s, im: h * square.im + d * pole.im }
        };
        let own = times(
            entry(inertia[0], 2e-4 + c / n / n + k[2], s / n / n + k[0]),
            entry(inertia[1], 0.5 + c, s + load * point.cos()),
        );
        let cross = times(entry(0.0, -c / n + k[3], -s / n + k[1]), entry(0.0, -c / n, -s / n));
        let (error, size) = ((own.re - cross.re).hypot(own.im - cross.im), own.re.hypot(own.im));
        assert!(error < 1e-9 * size, "{re} {im}: {error:e} of {size:e}");
    }
    let run = Settings { variants: vec!["held".into()], runs_only: true, ..Settings::default() };
    let found = study::run(&source, &run, &Silent).expect("a run");
    let arm = &found.runs[0].series.signal("arm.phi").expect("an angle").values;
    // The law has no integrator: friction of 0.02 N m may hold it off by that over the gain of its reference, no more.
    let reference = design.gains.iter().find(|gain| gain.name == "L").expect("a gain").values[0][0];
    assert!(arm.iter().all(|angle| (angle - point).abs() < 0.02 / reference));
    assert!((arm[0] - point).abs() < 1e-15);
}

/// An arm behind a motor that takes a voltage: it is held by the current that the voltage drives through the resistance.
const DRIVEN: &str = "[model]\nname = \"driven\"\n[shaft.arm]\ninertia = \"0.02 kg m^2\"\ndamping = \"0.01 N m s/rad\"\n\
                      [torque.gravity]\nshaft = \"arm\"\nlaw = \"-0.5 N m * sin(arm.phi)\"\n[voltage_source.u]\nfrom = \"ground\"\nto = \"in\"\n\
                      [dc_motor.m]\nfrom = \"in\"\nto = \"ground\"\nshaft = \"arm\"\ntorque_constant = \"0.2 N m/A\"\nresistance = \"1.5 Ohm\"\n\
                      inductance = \"30 mH\"\n";

#[test]
fn a_voltage_balances_a_load_by_its_current() {
    let law = "[control.hold]\nlaw = \"pole_placement\"\ninputs = [\"u\"]\nat = { \"arm.phi\" = \"60 deg\" }\npoles = [-10, -12, -50]\n";
    let channel = "[[control.hold.channels]]\noutput = \"arm.phi\"\nreference = \"ref\"\n";
    let point = (60.0_f64).to_radians();
    let current = 0.5 * point.sin() / 0.2;
    let project = study::Project::open(format!("{DRIVEN}{law}{channel}"));
    let plant = &project.prepared().variants[0].design_models[0];
    close(plant.trim_torque("u"), 1.5 * current, 1e-12);
    let winding = plant.reduced.coordinate("m").expect("a charge");
    close(plant.speeds_at_rest()[winding], current, 1e-12);
    let design = project.design(&DesignSettings::default(), &Silent).expect("a design");
    assert!(reported(&design.notes, "m.i = 2.165064 A; proven"), "{:?}", design.notes);
    let numbers = &design.controller_data.numbers;
    let number = |name: &str| numbers.iter().find(|number| number.name == name).expect("a number").value;
    close(number("m.i at rest"), current, 1e-12);
    let poles: Vec<f64> = design.closed_loop_poles.iter().map(|pole| pole.re).collect();
    for expected in [-10.0, -12.0, -50.0] {
        assert!(poles.iter().any(|pole| (pole - expected).abs() < 1e-7), "{poles:?}");
    }
    let observer = "[control.hold.observer]\nsensors = [\"arm.phi\"]\npoles = [-100, -110, -120]\ndisturbances = []\n";
    let scenario = "[scenario]\nduration = \"3 s\"\noutput_step = \"10 ms\"\nstart = \"operating_point\"\n";
    let step = "[[scenario.event]]\nat = \"1 s\"\nsignal = \"ref\"\nto = \"60.5 deg\"\n";
    for keys in ["", "sample_time = \"1 ms\"\n", observer, &format!("sample_time = \"1 ms\"\n{observer}")] {
        let source = format!("{DRIVEN}{law}{keys}{channel}{scenario}");
        for (step, to, tolerance) in [("", 60.0_f64, 1e-9), (step, 60.5, 3e-5)] {
            let found = study::run(&format!("{source}{step}"), &Settings::default(), &Silent).expect("a run");
            let run = &found.runs[0];
            assert_eq!(run.outcome, Outcome::Completed);
            let end = *run.series.signal("arm.phi").expect("an angle").values.last().expect("rows");
            assert!((end - to.to_radians()).abs() < tolerance, "{source}{step}: {end}");
            let first = run.series.signal("m.i").expect("a current").values[0];
            close(first, current, 1e-9);
            let arm = &run.series.signal("arm.phi").expect("an angle").values;
            assert!(!step.is_empty() || arm.iter().all(|angle| (angle - point).abs() < 1e-9), "{source}");
        }
    }
}

/// A controller that is not in the file is designed at a point too.
#[test]
fn a_law_from_outside_takes_a_point() {
    let bare = pendulum(GRAVITY, "").split("[control.hold]").next().expect("a model").to_string();
    let settings = |at: &[(&str, &str)]| DesignSettings {
        law: Some("decoupling".into()),
        at: at.iter().map(|(signal, value)| (signal.to_string(), value.to_string())).collect(),
        ..DesignSettings::default()
    };
    let design = |at: &[(&str, &str)]| study::design(&bare, &settings(at), &Silent);
    // s² + 2 ζ ω s + ω² with 20 rad/s and 0.7: k₁ = J ω² − m g l cos φ.
    let at_point = design(&[("arm.phi", "60 deg")]).expect("a design");
    close(gain(&at_point)[0], 400.0 * INERTIA - LOAD * 0.5, 1e-12);
    close(gain(&design(&[]).expect("a design"))[0], 400.0 * INERTIA - LOAD, 1e-12);
    let diagnostics = design(&[("arn.phi", "60 deg")]).expect_err("no such shaft");
    assert!(diagnostics.iter().any(|one| one.to_string().contains("did you mean `arm.phi`")), "{diagnostics:?}");
}
