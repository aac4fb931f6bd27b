//! Stops, clutches, brakes, freewheels, locks and backlash: against closed forms and conserved quantities.

use std::f64::consts::PI;

use kardan::results::{Outcome, Run};
use kardan::simulate::Method;
use kardan::study::{self, EquationsForm, Project, Silent};

use crate::common::{Dice, at, run_by, runs_only, signal, time_of};

const METHODS: [Method; 4] = [Method::Taylor, Method::Dop853, Method::Radau, Method::Automatic];

fn by(source: &str, method: Method) -> Run {
    let run = run_by(source, method, Some(1e-10));
    assert_eq!(run.outcome, Outcome::Completed, "{source}");
    run
}

/// The value of a signal in the last row.
fn last(run: &Run, name: &str) -> f64 {
    *signal(run, name).last().expect("rows")
}

/// The time of the first event that begins with these words.
fn first(run: &Run, prefix: &str) -> f64 {
    let found = run.events.iter().find(|event| event.description.starts_with(prefix));
    found.unwrap_or_else(|| panic!("no event {prefix:?} among {:?}", run.events)).time
}

fn near(value: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((value - expected).abs() <= tolerance, "{what}: {value} instead of {expected}");
}

fn ball(more: &str) -> String {
    format!(
        "[mass.ball]\nmass = \"2 kg\"\n[torque.weight]\nshaft = \"ball\"\nlaw = \"-20 N\"\n[end_stop.ground]\nshaft_1 = \"ball\"\nlower = \"0 m\"\n{more}\n\
         [scenario]\nduration = \"3 s\"\noutput_step = \"10 ms\"\ninitial = {{ \"ball.s\" = \"80 cm\" }}\n"
    )
}

/// From the height h a ball meets the ground after √(2h/g), flies for e times as long each time, and rests after √(2h/g) (1 + e)/(1 − e): exactly there,
/// exactly at rest, held by its weight; the blows have taken the energy of its height.
#[test]
fn a_bouncing_ball_comes_to_rest() {
    for method in METHODS {
        for e in [0.0, 0.25, 0.5, 0.75] {
            let run = by(&ball(&format!("restitution = {e}")), method);
            let rests = (2.0 * 0.8 / 10.0_f64).sqrt() * (1.0 + e) / (1.0 - e);
            let what = format!("{method:?} e = {e}");
            near(time_of(&run, "ground is in resting contact"), rests, 1e-9, &what);
            for (k, time) in run.series.time.iter().enumerate().filter(|(_, time)| **time > rests + 1e-9) {
                assert_eq!(signal(&run, "ball.v")[k], 0.0, "{what} at {time}");
                near(signal(&run, "ball.s")[k], 0.0, 1e-12, &what);
                near(signal(&run, "ground.f")[k], -20.0, 1e-9, &what);
            }
            let second = (2.0 * 0.8 / 10.0_f64).sqrt() * (1.0 + e);
            near(
                at(&run, "ball.s", (100.0 * second).round() / 100.0),
                {
                    let t = (100.0 * second).round() / 100.0 - second / (1.0 + e);
                    if e == 0.0 { 0.0 } else { 4.0 * e * t - 5.0 * t * t }
                },
                1e-9,
                &what,
            );
            near(run.energy.dissipated, 16.0, 1e-9, &what);
            assert!(run.energy.residual.abs() < 1e-9, "{what}: {:?}", run.energy);
        }
    }
}

/// Where nothing bounds a step of series, as in a long run, the speeds at its end are far above those of the last blows: the ball comes to rest all the same.
#[test]
fn a_ball_comes_to_rest_in_long_runs() {
    for (duration, e) in [(60.0, 0.7), (1000.0, 0.7), (3600.0, 0.9)] {
        let source = ball(&format!("restitution = {e}"))
            .replace("3 s", &format!("{duration} s"))
            .replace("10 ms", &format!("{} s", duration / 100.0));
        for method in METHODS {
            let run = by(&source, method);
            let rests = (2.0 * 0.8 / 10.0_f64).sqrt() * (1.0 + e) / (1.0 - e);
            let what = format!("{method:?} {duration} s");
            near(time_of(&run, "ground is in resting contact"), rests, 1e-8, &what);
            near(run.energy.dissipated, 16.0, 1e-9, &what);
            assert!(run.effort.events < 600, "{what}: {:?}", run.effort);
        }
    }
}

/// Elastic blows lose nothing: after a thousand of them the ball is as high as before.
#[test]
fn elastic_impacts_dissipate_nothing() {
    let source = ball("restitution = 1").replace("3 s", "800 s").replace("10 ms", "400 ms");
    let run = by(&source, Method::Automatic);
    let blows = run.events.iter().filter(|event| event.description.starts_with("ground meets 4.0000")).count();
    assert_eq!(blows, 1000, "of {}", run.events.len());
    near(at(&run, "ball.s", 800.0), 0.8, 1e-6, "after 800 s");
    assert_eq!(run.energy.dissipated, 0.0);
}

/// On a soft stop without damping a ball turns round as it came; with damping it presses with `s δ + d δ̇` and is left where that vanishes: of the
/// damped half period only a part, with the speed of the closed form.
#[test]
fn soft_stops_press_and_never_pull() {
    let source = |damping: f64| {
        format!(
            "[mass.a]\nmass = \"2 kg\"\n[end_stop.wall]\nshaft_1 = \"a\"\nupper = \"1 m\"\nstiffness = \"800 N/m\"\ndamping = \"{damping} N s/m\"\n\
             [scenario]\nduration = \"2 s\"\noutput_step = \"1 ms\"\ninitial = {{ \"a.v\" = \"1 m/s\" }}\n"
        )
    };
    for method in METHODS {
        for damping in [0.0, 16.0] {
            let run = by(&source(damping), method);
            let (omega0, delta) = (20.0, damping / 4.0);
            let omega = f64::sqrt(omega0 * omega0 - delta * delta);
            // δ = e^(−δt) sin(ωt)/ω; s δ + d δ̇ = 0 where tan ωt = −2δω/(ω₀² − 2δ²).
            let leaves =
                (f64::atan2(2.0 * delta * omega, -(omega0 * omega0 - 2.0 * delta * delta))).rem_euclid(PI) / omega;
            let leaves = if damping == 0.0 { PI / omega } else { leaves };
            let speed = (-delta * leaves).exp() * ((omega * leaves).cos() - delta / omega * (omega * leaves).sin());
            let what = format!("{method:?} d = {damping}");
            near(time_of(&run, "wall is touched"), 1.0, 1e-9, &what);
            near(time_of(&run, "wall is left"), 1.0 + leaves, 1e-9, &what);
            near(last(&run, "a.v"), speed, 1e-8, &what);
            assert!(signal(&run, "wall.f").iter().all(|force| *force >= -1e-12), "{what}: it pulls");
            near(run.energy.dissipated, 1.0 - speed * speed, 1e-8, &what);
            assert!(run.energy.residual.abs() < 1e-8, "{what}: {:?}", run.energy);
        }
    }
}

/// A clutch that closes between two inertias: momentum stays, `½ J₁J₂/(J₁+J₂) Δω²` is lost, whatever the torque does meanwhile.
#[test]
fn a_clutch_brings_two_inertias_to_one_speed() {
    let source = "\
[shaft.engine]
inertia = \"3 kg m^2\"
[shaft.load]
inertia = \"1 kg m^2\"
[signal.pedal]
kind = \"ramp\"
to = 1
start = \"0.2 s\"
over = \"1 s\"
[clutch.launch]
shaft_1 = \"engine\"
shaft_2 = \"load\"
torque = \"40 N m * pedal\"
static_factor = 1.5
[scenario]
duration = \"2 s\"
output_step = \"10 ms\"
initial = { \"engine.w\" = \"20 rad/s\" }
";
    for method in METHODS {
        let run = by(source, method);
        let what = format!("{method:?}");
        // Δω falls with (1/3 + 1) 40 (t − 0.2)²/2 from 20.
        near(time_of(&run, "launch sticks"), 0.2 + f64::sqrt(20.0 / (0.5 * 40.0 * 4.0 / 3.0)), 1e-9, &what);
        near(last(&run, "engine.w"), 15.0, 1e-9, &what);
        assert_eq!(last(&run, "engine.w") - last(&run, "load.w"), 0.0, "{what}");
        near(run.energy.dissipated, 0.5 * 0.75 * 400.0, 1e-7, &what);
        near(last(&run, "launch.tau"), 0.0, 1e-9, &what);
        assert!(run.energy.residual.abs() < 1e-7, "{what}: {:?}", run.energy);
    }
}

/// A lock that engages at speed is a blow of the same loss, at once; released, the shafts go their own ways.
#[test]
fn a_lock_keeps_momentum() {
    let source = "\
[shaft.a]
inertia = \"3 kg m^2\"
[shaft.b]
inertia = \"1 kg m^2\"
[torque.drive]
shaft = \"b\"
law = \"4 N m\"
[lock.dog]
shaft_1 = \"a\"
shaft_2 = \"b\"
engaged = \"if(t > 0.5 s, 1, 0) * if(t < 1.5 s, 1, 0)\"
[scenario]
duration = \"2 s\"
output_step = \"10 ms\"
initial = { \"a.w\" = \"20 rad/s\" }
";
    // b has 2 rad/s when they meet.
    for method in METHODS {
        let run = by(source, method);
        let what = format!("{method:?}");
        near(at(&run, "a.w", 1.0), 15.5 + 0.5, 1e-6, &what);
        near(
            at(&run, "a.phi", 1.2) - at(&run, "a.phi", 1.0),
            at(&run, "b.phi", 1.2) - at(&run, "b.phi", 1.0),
            1e-12,
            &what,
        );
        near(at(&run, "dog.tau", 1.0), -3.0, 1e-9, &what);
        near(last(&run, "a.w"), 16.5, 1e-6, &what);
        near(last(&run, "b.w"), 18.5, 1e-6, &what);
        near(run.energy.dissipated, 0.5 * 0.75 * 18.0 * 18.0, 1e-5, &what);
        assert!(run.energy.residual.abs() < 1e-6, "{what}: {:?}", run.energy);
    }
}

/// A freewheel carries forward, lets go, and carries again: against the motion that it forces, `w_driven = max` of both histories.
#[test]
fn a_freewheel_carries_one_way() {
    let source = "\
[shaft.pedal]
inertia = \"1 kg m^2\"
[shaft.wheel]
inertia = \"1 kg m^2\"
[torque.foot]
shaft = \"pedal\"
law = \"2 N m * cos(1 rad/s * t)\"
[one_way_clutch.hub]
driving = \"pedal\"
driven = \"wheel\"
[scenario]
duration = \"6 s\"
output_step = \"10 ms\"
";
    for method in METHODS {
        let run = by(source, method);
        let what = format!("{method:?}");
        // Together sin t up to π/2; then the wheel keeps 1 and the pedal has 2 sin t − 1, which is 1 again only at the top: never before 2π.
        near(time_of(&run, "hub overruns"), 0.5 * PI, 1e-7, &what);
        near(at(&run, "wheel.w", 1.0), 1.0_f64.sin(), 1e-8, &what);
        near(last(&run, "wheel.w"), 1.0, 1e-8, &what);
        near(last(&run, "pedal.w"), 2.0 * 6.0_f64.sin() - 1.0, 1e-8, &what);
        near(at(&run, "hub.tau", 1.0), -(1.0_f64.cos()), 1e-8, &what);
        let (pedal, wheel) = (signal(&run, "pedal.w"), signal(&run, "wheel.w"));
        assert!(pedal.iter().zip(wheel).all(|(pedal, wheel)| wheel - pedal >= -1e-12), "{what}");
        assert!(run.energy.residual.abs() < 1e-8, "{what}: {:?}", run.energy);
    }
}

/// A brake that is applied: the wheel stops after J ω/(c − τ), holds what is below its torque at rest, without a trace of motion, and lets go.
#[test]
fn a_brake_sticks_at_rest() {
    let source = "\
[shaft.wheel]
inertia = \"2 kg m^2\"
[torque.slope]
shaft = \"wheel\"
law = \"5 N m\"
[signal.applied]
kind = \"pulses\"
high = 1
period = \"20 s\"
width = \"7.5 s\"
start = \"0.5 s\"
count = 1
[brake.park]
shaft = \"wheel\"
torque = \"15 N m * applied\"
[scenario]
duration = \"10 s\"
output_step = \"10 ms\"
initial = { \"wheel.w\" = \"8.75 rad/s\" }
";
    for method in METHODS {
        let run = by(source, method);
        let what = format!("{method:?}");
        // 10 rad/s at 0.5 s, less 5 rad/s².
        near(time_of(&run, "park sticks"), 2.5, 1e-9, &what);
        let rests: Vec<usize> =
            (0..run.series.time.len()).filter(|&k| (2.51..7.99).contains(&run.series.time[k])).collect();
        let angle = signal(&run, "wheel.phi");
        assert!(rests.iter().all(|&k| signal(&run, "wheel.w")[k] == 0.0 && angle[k] == angle[rests[0]]), "{what}");
        near(at(&run, "park.tau", 5.0), 5.0, 1e-9, &what);
        near(last(&run, "wheel.w"), 5.0, 1e-9, &what);
        assert!(run.energy.residual.abs() < 1e-8, "{what}: {:?}", run.energy);
    }
}

/// What holds stands beside constraints: a rigid gear carries the torque of a brake to the other shaft.
#[test]
fn a_rigid_gear_carries_what_a_brake_takes() {
    let source = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n[gear.mesh]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\n\
                  ratio = 2\n[brake.k]\nshaft = \"b\"\ntorque = \"1 N m\"\n[end_stop.wall]\nshaft_1 = \"a\"\nupper = \"100 rad\"\n\
                  [scenario]\nduration = \"6 s\"\noutput_step = \"10 ms\"\ninitial = { \"a.w\" = \"2 rad/s\" }\n";
    for method in METHODS {
        let run = by(source, method);
        let what = format!("{method:?}");
        // 4 J_a + J_b = 5 kg m² are slowed by 1 N m: b by 0.2, a by 0.4 rad/s².
        near(at(&run, "a.w", 2.0), 1.2, 1e-9, &what);
        near(at(&run, "mesh.tau", 2.0), -0.4, 1e-9, &what);
        near(time_of(&run, "k sticks"), 5.0, 1e-9, &what);
        assert_eq!([last(&run, "a.w"), last(&run, "mesh.tau"), last(&run, "k.tau")], [0.0; 3], "{what}");
        near(run.energy.dissipated, 2.5, 1e-9, &what);
    }
}

/// Through a gear with play nothing is carried within it; at its end teeth meet, and keep the momentum that the ratio gives.
#[test]
fn gear_contact_closes_at_the_end_of_the_backlash() {
    let source = "\
[shaft.a]
inertia = \"1 kg m^2\"
[shaft.b]
inertia = \"4 kg m^2\"
[gear.mesh]
shaft_1 = \"a\"
shaft_2 = \"b\"
ratio = 2
backlash = \"0.2 rad\"
[torque.back]
shaft = \"a\"
law = \"-1 N m * if(t > 2 s, 1, 0)\"
[scenario]
duration = \"10 s\"
output_step = \"10 ms\"
initial = { \"a.w\" = \"1 rad/s\" }
";
    for method in METHODS {
        let run = by(source, method);
        let what = format!("{method:?}");
        // At 0.1 s a meets b: J₁ + J₂/i² = 2, so a has 1/2, b 1/4, and half of the energy is gone.
        near(first(&run, "mesh meets"), 0.1, 1e-9, &what);
        near(at(&run, "a.w", 1.0), 0.5, 1e-9, &what);
        near(at(&run, "b.w", 1.0), 0.25, 1e-9, &what);
        near(at(&run, "a.phi", 1.0) - 2.0 * at(&run, "b.phi", 1.0), 0.1, 1e-9, &what);
        // From 2 s on a falls back through the play of 0.2 rad with 1 rad/s², and takes b along.
        let back = 2.0 + 0.4_f64.sqrt();
        near(at(&run, "b.w", 2.5), 0.25, 1e-9, &what);
        let meets: Vec<f64> = run
            .events
            .iter()
            .filter(|event| event.description.starts_with("mesh meets"))
            .map(|event| event.time)
            .collect();
        assert_eq!(meets.len(), 2, "{what}: {meets:?}");
        near(meets[1], back, 1e-7, &what);
        // It carries back: the torque on a is forward.
        near(at(&run, "mesh.tau", 5.0), 0.5, 1e-8, &what);
        assert!(run.energy.residual.abs() < 1e-8, "{what}: {:?}", run.energy);
    }
}

/// On a belt (so heavy that it keeps its speed) a mass sticks until its spring pulls with what holds at rest, slips until it has the speed of the belt
/// again, and so on: both times as in closed form.
#[test]
fn stick_and_slip_on_a_belt() {
    let source = "\
[mass.belt]
mass = \"1e12 kg\"
[mass.a]
mass = \"1 kg\"
[spring_damper.spring]
shaft_1 = \"a\"
stiffness = \"100 N/m\"
[clutch.contact]
shaft_1 = \"a\"
shaft_2 = \"belt\"
torque = \"10 N\"
static_factor = 1.5
[scenario]
duration = \"5 s\"
output_step = \"10 ms\"
initial = { \"belt.v\" = \"1 m/s\", \"a.v\" = \"1 m/s\", \"a.s\" = \"5 cm\" }
";
    for method in METHODS {
        let run = by(source, method);
        let what = format!("{method:?}");
        // It leaves at 15/100 m; then x = 0.1 + 0.05 cos 10t + 0.1 sin 10t has the speed 1 again where it has come down as far.
        let times = |which: &str| -> Vec<f64> {
            run.events
                .iter()
                .filter(|event| event.description == format!("contact {which}"))
                .map(|event| event.time)
                .collect()
        };
        let (slips, sticks) = (times("slips backward"), times("sticks"));
        near(slips[0], 0.1, 1e-8, &what);
        let slipping = (2.0 * PI - 2.0 * f64::atan2(0.05, 0.1)) / 10.0;
        for (slip, stick) in slips.iter().zip(&sticks) {
            near(stick - slip, slipping, 1e-7, &what);
        }
        // From 0.05 m back to 0.15 m at 1 m/s.
        for (stick, slip) in sticks.iter().zip(&slips[1..]) {
            near(slip - stick, 0.1, 1e-7, &what);
        }
        assert!(slips.len() >= 7, "{what}: {}", slips.len());
    }
}

/// Carriages between walls with stops of any restitution: no energy is gained, none is lost without blows, nothing goes through anything.
#[test]
fn impacts_of_random_carriages_gain_nothing() {
    let mut dice = Dice(20);
    for case in 0..40 {
        let count = 2 + dice.below(4);
        let mut source = String::new();
        for k in 0..count {
            source += &format!("[mass.m{k}]\nmass = \"{} kg\"\n", dice.between(1, 9));
        }
        for k in 0..=count {
            let e = dice.between(0, 10) as f64 / 10.0;
            let (first, second) =
                if k == 0 { ("m0".into(), None) } else { (format!("m{k}"), Some(format!("m{}", k - 1))) };
            source += &match (second, k == count) {
                (None, _) => format!("[end_stop.left]\nshaft_1 = \"{first}\"\nlower = \"-1 m\"\nrestitution = {e}\n"),
                (Some(last), true) => {
                    format!("[end_stop.right]\nshaft_1 = \"{last}\"\nupper = \"1 m\"\nrestitution = {e}\n")
                }
                (Some(other), false) => format!(
                    "[end_stop.s{k}]\nshaft_1 = \"{first}\"\nshaft_2 = \"{other}\"\nlower = \"-20 cm\"\nrestitution = {e}\n"
                ),
            };
        }
        let speeds: Vec<String> = (0..count).map(|k| format!("\"m{k}.v\" = \"{} m/s\"", dice.between(-9, 9))).collect();
        source += &format!(
            "[scenario]\nduration = \"2 s\"\noutput_step = \"10 ms\"\ninitial = {{ {} }}\n",
            speeds.join(", ")
        );
        let run = by(&source, Method::Automatic);
        assert!(run.energy.residual.abs() < 1e-9 * 500.0, "{case}: {:?}\n{source}", run.energy);
        assert!(run.energy.dissipated >= 0.0, "{case}");
        let place = |k: usize, row: usize| signal(&run, &format!("m{k}.s"))[row];
        for row in 0..run.series.time.len() {
            assert!(place(0, row) >= -1.0 - 1e-9 && place(count - 1, row) <= 1.0 + 1e-9, "{case}");
            assert!((1..count).all(|k| place(k, row) - place(k - 1, row) >= -0.2 - 1e-9), "{case}");
        }
    }
}

/// Friction below zero would drive: the run ends there, and what it has is kept. A start beyond a stop is refused before.
#[test]
fn what_cannot_be_ends_the_run() {
    let brake = "[shaft.a]\ninertia = \"1 kg m^2\"\n[brake.b]\nshaft = \"a\"\ntorque = \"1 N m * (0.5 - t/(1 s))\"\n\
                 [scenario]\nduration = \"1 s\"\noutput_step = \"10 ms\"\ninitial = { \"a.w\" = \"9 rad/s\" }\n";
    let ended = |source: &str| {
        crate::common::project(source)
            .run(&runs_only(), &Silent)
            .unwrap_or_else(|reported| panic!("{reported:?}"))
            .runs
            .remove(0)
    };
    let run = ended(brake);
    let Outcome::Failed { time, cause } = &run.outcome else { panic!("{:?}", run.outcome) };
    assert!((time - 0.5).abs() < 1e-6 && cause.contains("negative friction would drive"), "{cause}");
    assert!(run.series.time.len() >= 50, "{}", run.series.time.len());
    let below = ball("restitution = 0.5").replace("80 cm", "-1 cm");
    let reported = study::check(&below);
    let message = "the run begins 0.010000 m beyond the stop of `ground`, which is rigid";
    assert!(
        reported.len() == 1 && reported[0].code == "scenario::stop" && reported[0].message == message,
        "{reported:?}"
    );
    // On the stop it begins, and beyond a soft one.
    assert_eq!(study::check(&below.replace("-1 cm", "0 cm")), []);
    assert_eq!(study::check(&below.replace("restitution = 0.5", "stiffness = \"1 kN/m\"")), []);
}

/// What carries torque by modes stands in the written equations by its name, and laws on the right.
#[test]
fn equations_name_unilateral_and_switched_constraints() {
    let source = "[shaft.a]\ninertia = \"3 kg m^2\"\n[mass.m]\nmass = \"2 kg\"\n[clutch.c]\nshaft_1 = \"a\"\nshaft_2 = \"ground\"\ntorque = \"1 N m\"\n\
                  [end_stop.e]\nshaft_1 = \"m\"\nlower = \"0 m\"\nupper = \"1 m\"\n[torque.w]\nshaft = \"m\"\nlaw = \"-20 N\"\n\
                  [scenario]\nduration = \"1 s\"\n";
    let (text, _) =
        Project::open(source).equations(EquationsForm::Text).unwrap_or_else(|reported| panic!("{reported:?}"));
    assert!(text.contains("  3 a'' + c.tau = 0\n") && text.contains("  2 m'' + e.f = w.f\n"), "{text}");
    let (text, _) =
        Project::open(source).symbolic_text(EquationsForm::Text).unwrap_or_else(|reported| panic!("{reported:?}"));
    for line in [
        "Forces of unilateral and switched constraints\n  a = c.tau\n  m = e.f\n",
        "  c.tau: against a' while it slips, of magnitude 1 N m; up to as much in both directions while it sticks\n",
        "  e.f: zero while m > 0; else the torque that keeps it from going below; zero while m < 1; else the torque that keeps it from going above\n",
        "  w = -20 N\n",
    ] {
        assert!(text.contains(line), "{line}{text}");
    }
}

/// A clutch that is pressed while both its shafts rest moves neither, whatever its torque: it holds from the first instant.
#[test]
fn a_clutch_pressed_at_rest_moves_nothing() {
    let source = "[signal.now]\nkind = \"pulses\"\nhigh = 1\nperiod = \"0.4 s\"\nwidth = \"0.2 s\"\nstart = \"0.1 s\"\n\
                  [shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"0.01 kg m^2\"\n\
                  [clutch.c]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\ntorque = \"30 N m * now\"\n\
                  [scenario]\nduration = \"2 s\"\noutput_step = \"10 ms\"\n";
    for method in METHODS {
        let run = by(source, method);
        assert!(["a.w", "b.w"].iter().all(|speed| signal(&run, speed).iter().all(|x| *x == 0.0)), "{method:?}");
        let reported = |event: &kardan::results::Event| {
            event.description.starts_with("now ") || event.description == "c is released"
        };
        let unexpected: Vec<_> =
            run.events.iter().filter(|event| !reported(event) && event.description != "c sticks").collect();
        assert!(unexpected.is_empty(), "{method:?}: {unexpected:?}");
        let sticks = run.events.iter().filter(|event| event.description == "c sticks").map(|event| event.time);
        assert_eq!(sticks.collect::<Vec<_>>(), [0.1, 0.5, 0.9, 1.3, 1.7], "{method:?}: with the pulse, not behind it");
    }
}

/// Wheels that locks hold together stop with the one that friction brings to rest, all to the last bit, while another one turns on: what rounding
/// left of their speeds would be motion that clutches and stops beside them meet.
#[test]
fn what_several_directions_hold_rests_to_the_last_bit() {
    let source = |c: u32| {
        format!(
            "[shaft.a]\ninertia = \"0.03 kg m^2\"\nfriction = \"0.{c} N m\"\n[shaft.b]\ninertia = \"0.07 kg m^2\"\n[shaft.c]\ninertia = \"0.011 kg m^2\"\n\
             [shaft.free]\ninertia = \"0.02 kg m^2\"\n[lock.ab]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nengaged = \"1\"\n\
             [lock.bc]\nshaft_1 = \"b\"\nshaft_2 = \"c\"\nengaged = \"1\"\n[torque.turns]\nshaft = \"free\"\nlaw = \"0.3 N m\"\n\
             [scenario]\nduration = \"3 s\"\noutput_step = \"10 ms\"\ninitial = {{ \"a.w\" = \"3 rad/s\", \"b.w\" = \"3 rad/s\", \"c.w\" = \"3 rad/s\" }}\n"
        )
    };
    for c in 2..9 {
        let run = by(&source(c), Method::Taylor);
        let rests = 3.0 * 0.111 / (0.1 * f64::from(c));
        near(time_of(&run, "a sticks"), rests, 1e-9, "where it rests");
        for (k, time) in run.series.time.iter().enumerate().filter(|(_, time)| **time > rests + 1e-9) {
            assert_eq!(["a.w", "b.w", "c.w"].map(|name| signal(&run, name)[k]), [0.0; 3], "0.{c} N m at {time}");
        }
    }
}

/// The first harmonic of play of half width h that is driven with the amplitude A, by that: real and imaginary part.
fn describing_function(h: f64, amplitude: f64) -> [f64; 2] {
    let part = 1.0 - 2.0 * h / amplitude;
    let real = (PI / 2.0 + part.asin() + part * (1.0 - part * part).sqrt()) / PI;
    [real, 4.0 * h / (PI * amplitude) * (h / amplitude - 1.0)]
}

/// A servo with play before its load, `L = (2 + 1/s)/(s (s + 1))`, swings where `1 + N(A) L(jω) = 0`. The method takes the first harmonic for the
/// whole motion: a tenth of the amplitude and a twentieth of the period are what it leaves out here.
#[test]
fn backlash_in_a_loop_oscillates_as_its_describing_function_says() {
    let source = "[shaft.motor]\ninertia = \"1 kg m^2\"\ndamping = \"1 N m s/rad\"\n\
                  [shaft.sum]\ninertia = \"1e-4 kg m^2\"\ndamping = \"1 N m s/rad\"\n\
                  [shaft.load]\ninertia = \"1e-4 kg m^2\"\nfriction = \"0.01 N m\"\n\
                  [gear.teeth]\nshaft_1 = \"motor\"\nshaft_2 = \"load\"\nratio = 1\nbacklash = \"0.2 rad\"\n\
                  [torque.integral]\nshaft = \"sum\"\nlaw = \"-1 N m/rad * load.phi\"\n\
                  [torque.control]\nshaft = \"motor\"\nlaw = \"-2 N m/rad * load.phi + 1 N m/rad * sum.phi\"\n\
                  [scenario]\nduration = \"200 s\"\noutput_step = \"10 ms\"\ninitial = { \"motor.phi\" = \"1 rad\", \"load.phi\" = \"1 rad\" }\n";
    let balance = |amplitude: f64, w: f64| {
        let [a, b] = describing_function(0.1, amplitude);
        // L = (2 − j/w)/(−w² + j w)
        let size = w * w * w * w + w * w;
        let [c, d] = [(-2.0 * w * w - 1.0) / size, (w - 2.0 * w) / size];
        [1.0 + a * c - b * d, a * d + b * c]
    };
    let (mut amplitude, mut w) = (0.4, 1.1);
    for _ in 0..50 {
        let [x, y] = balance(amplitude, w);
        let step = 1e-7;
        let by = |moved: [f64; 2]| [(moved[0] - x) / step, (moved[1] - y) / step];
        let ([p, q], [r, s]) = (by(balance(amplitude + step, w)), by(balance(amplitude, w + step)));
        let det = p * s - r * q;
        (amplitude, w) = (amplitude + (r * y - s * x) / det, w + (q * x - p * y) / det);
    }
    let [x, y] = balance(amplitude, w);
    assert!(x.abs() + y.abs() < 1e-12, "{amplitude} {w}");
    let run = by(source, Method::Automatic);
    let cycle = |from: f64, until: f64| {
        let rows: Vec<(f64, f64)> =
            run.series.time.iter().copied().zip(signal(&run, "motor.phi").iter().copied()).collect();
        let rows: Vec<_> = rows.into_iter().filter(|(t, _)| (from..until).contains(t)).collect();
        let most = rows.iter().fold(0.0f64, |most, (_, angle)| most.max(angle.abs()));
        let ups: Vec<f64> =
            rows.windows(2).filter(|two| two[0].1 < 0.0 && two[1].1 >= 0.0).map(|two| two[1].0).collect();
        (most, (ups[ups.len() - 1] - ups[0]) / (ups.len() - 1) as f64)
    };
    let ((before, _), (most, period)) = (cycle(80.0, 140.0), cycle(140.0, 200.0));
    near(most, amplitude, 0.1 * amplitude, "amplitude");
    near(period, 2.0 * PI / w, 0.05 * period, "period");
    near(most, before, 1e-3 * most, "a cycle that lasts");
}

/// Locks that hold one motion together are no friction and have no Coulomb torque; a bound of a requirement is told in digits or as a power of ten.
#[test]
fn locks_that_share_are_not_called_friction() {
    let lock = |name: &str, one: &str, two: &str, at: f64| {
        format!("[lock.{name}]\nshaft_1 = \"{one}\"\nshaft_2 = \"{two}\"\nengaged = \"t/({at} s)\"\n")
    };
    let shafts = ["a", "b", "c"].map(|name| format!("[shaft.{name}]\ninertia = \"2 kg m^2\"\n")).concat();
    let locks = lock("l1", "a", "b", 0.5) + &lock("l2", "b", "c", 0.6) + &lock("l3", "a", "c", 0.7);
    let bound =
        |below: &str| format!("[[requirement]]\nsignal = \"b.w\"\nmeasure = \"max_abs\"\nbelow = \"{below}\"\n");
    let source = shafts
        + &locks
        + "[prescribed_motion.p]\nshaft = \"a\"\nangle = \"3 rad * sin(t / 1 s)\"\n[scenario]\nduration = \"1 s\"\n"
        + &bound("1e-12 rad/s")
        + &bound("3.5 rad/s")
        + &bound("1e9 rad/s");
    let run = by(&source, Method::Taylor);
    let expected = "While `l1`, `l3`, `l2` act together, the split of the torque between them is not unique (nor are constraint torques between them); \
                shown is one that satisfies all limits.";
    assert!(run.notes.iter().any(|note| note == expected), "{:?}", run.notes);
    let texts: Vec<&str> =
        run.requirements.iter().map(|one| one.text.rsplit(" < ").next().unwrap_or_default()).collect();
    assert_eq!(texts, ["1e-12 rad/s", "3.5 rad/s", "1e9 rad/s"]);
}

/// A blow that loses nothing turns the relative speed about and keeps momentum, whatever rounding makes of the energy.
#[test]
fn an_elastic_impact_dissipates_nothing() {
    let mut dice = Dice(77);
    for case in 0..40 {
        let [m1, m2] = [1.0 + case as f64 / 7.0, 2.0];
        let [v1, v2] = [1.1 + dice.below(1000) as f64 / 997.0, -0.7];
        let source = format!(
            "[mass.a]\nmass = \"{m1} kg\"\n[mass.b]\nmass = \"{m2} kg\"\n[end_stop.s]\nmass_1 = \"b\"\nmass_2 = \"a\"\nlower = \"0 m\"\nrestitution = 1\n\
             [scenario]\nduration = \"1 s\"\ninitial = {{ \"a.v\" = \"{v1} m/s\", \"b.s\" = \"0.1 m\", \"b.v\" = \"{v2} m/s\" }}\n"
        );
        let mean = (m1 * v1 + m2 * v2) / (m1 + m2);
        for method in METHODS {
            let run = by(&source, method);
            near(last(&run, "a.v"), 2.0 * mean - v1, 1e-12, &source);
            near(last(&run, "b.v"), 2.0 * mean - v2, 1e-12, &source);
        }
    }
}

/// What rests beyond a rigid stop rests nowhere: equilibria are those within, or on the stop.
#[test]
fn equilibria_respect_rigid_stops() {
    // A spring that relaxes at −5 m, beyond the stop: it rests on that; nothing does where it is drawn away from both.
    let spring = "[mass.a]\nmass = \"1 kg\"\n[torque.g]\nmass = \"a\"\nlaw = \"-10 N - 2 N/m * a.s\"\n[end_stop.k]\nmass_1 = \"a\"\nlower = \"-1 m\"\n";
    let run = "[scenario]\nduration = \"1 s\"\nstart = \"equilibrium\"\n";
    for method in METHODS {
        let run = by(&format!("{spring}{run}"), method);
        assert!(signal(&run, "a.s").iter().all(|value| *value == -1.0));
    }
    let unstable = spring.replace("-10 N - 2 N/m * a.s", "10 N + 2 N/m * a.s");
    let reported = study::check(&format!("{unstable}{run}"));
    let message = "the equilibrium a.s = -5.000000 m lies beyond the stop of `k`, which is rigid";
    assert!(reported.len() == 1 && reported[0].message.contains(message), "{reported:?}");
}

/// A weight of 9.81 N rests on a rigid stop where it is, on a soft one of 1 kN/m 9.81 mm below, on a spring with 2 mm of play one more
/// below: equilibria, at which a run stays.
#[test]
fn equilibria_rest_on_contacts() {
    let weight = "[mass.a]\nmass = \"1 kg\"\n[torque.g]\nmass = \"a\"\nlaw = \"-9.81 N\"\n";
    let run = "[scenario]\nduration = \"1 s\"\nstart = \"equilibrium\"\n";
    for (contact, place) in [
        ("[end_stop.k]\nmass_1 = \"a\"\nlower = \"-3 mm\"\n", -0.003),
        ("[end_stop.k]\nmass_1 = \"a\"\nlower = \"0 m\"\nstiffness = \"1 kN/m\"\n", -0.00981),
        (
            "[spring_damper.k]\nmass_1 = \"a\"\nmass_2 = \"ground\"\nstiffness = \"1 kN/m\"\nbacklash = \"2 mm\"\n",
            -0.01081,
        ),
    ] {
        let source = format!("{weight}{contact}{run}");
        for method in METHODS {
            let run = by(&source, method);
            for value in signal(&run, "a.s") {
                near(*value, place, 1e-9, contact);
            }
        }
    }
}

/// A mass strikes another one with restitution 0.8 while a freewheel pushes it from behind: over all speeds of what pushes the final speeds follow
/// Poisson's law, which bends where the freewheel closes during the compression (at 0.5/1.3 m/s) and jumps nowhere; no energy is gained.
#[test]
fn a_contact_that_closes_at_an_impact_leaves_its_restitution() {
    let [m, n, c, e] = [0.5, 0.8, 1.0, 0.8];
    for step in 0..=60 {
        let pushes = 0.01 * f64::from(step);
        let source = format!(
            "[mass.a]\nmass = \"{m} kg\"\n[mass.b]\nmass = \"{n} kg\"\n[mass.c]\nmass = \"{c} kg\"\n[end_stop.e]\nmass_1 = \"a\"\nmass_2 = \"b\"\n\
             upper = \"0.2 m\"\nrestitution = {e}\n[one_way_clutch.o]\ndriving = \"c\"\ndriven = \"a\"\n[scenario]\nduration = \"0.25 s\"\n\
             initial = {{ \"a.v\" = \"1 m/s\", \"c.v\" = \"{pushes} m/s\" }}\n"
        );
        let run = by(&source, Method::Automatic);
        // Compression: a and b with one speed, and c too if that is faster.
        let pair = m / (m + n);
        let common_speed = if pushes > pair { (m + c * pushes) / (m + n + c) } else { pair };
        let back = e * n * common_speed;
        let b = common_speed + back / n;
        let a = (m + c * pushes - n * b) / (m + c);
        let what = format!("{pushes} m/s");
        near(last(&run, "b.v"), b, 1e-12, &what);
        near(last(&run, "a.v"), a, 1e-12, &what);
        near(last(&run, "c.v"), a, 1e-12, &what);
        let [before, after] = [m + c * pushes * pushes, (m + c) * a * a + n * b * b].map(|doubled| 0.5 * doubled);
        assert!(after <= before, "{what}: {after} J of {before} J");
        near(run.energy.dissipated, before - after, 1e-12, &what);
        let shared = run.notes.iter().any(|note| note.contains("`e`, `o` act together"));
        assert_eq!(shared, pushes > pair, "{what}: {:?}", run.notes);
    }
}

/// Balls in a row with stops between them, some of which touch: with restitution 1 everywhere all energy stays, whichever contacts meet at one instant; three
/// equal balls of which two touch part the impulse as their compression does.
#[test]
fn elastic_chains_conserve_energy() {
    let mut dice = Dice(54);
    for case in 0..60 {
        let count = 3 + dice.below(3);
        let mut source = String::new();
        let (mut places, mut energy, mut momentum) = (vec![0.0], 0.0, 0.0);
        let mut initial = Vec::new();
        for k in 0..count {
            let (mass, speed) = (dice.between(1, 9) as f64, dice.between(-9, 9) as f64);
            source += &format!("[mass.m{k}]\nmass = \"{mass} kg\"\n");
            if k > 0 {
                source += &format!(
                    "[end_stop.s{k}]\nmass_1 = \"m{k}\"\nmass_2 = \"m{}\"\nlower = \"0 m\"\nrestitution = 1\n",
                    k - 1
                );
                // Contacts that meet at one instant, and some that touch from the begin.
                places.push(places[k - 1] + [0.0, 0.5, 1.0][dice.below(3)]);
            }
            initial.push(format!("\"m{k}.v\" = \"{speed} m/s\", \"m{k}.s\" = \"{} m\"", places[k]));
            energy += 0.5 * mass * speed * speed;
            momentum += mass * speed;
        }
        source += &format!("[scenario]\nduration = \"3 s\"\ninitial = {{ {} }}\n", initial.join(", "));
        let run = by(&source, Method::Automatic);
        let of = |k: usize| {
            let mass: f64 = source
                .split(&format!("[mass.m{k}]\nmass = \""))
                .nth(1)
                .unwrap()
                .split(' ')
                .next()
                .unwrap()
                .parse()
                .unwrap();
            (mass, last(&run, &format!("m{k}.v")))
        };
        let all: Vec<(f64, f64)> = (0..count).map(of).collect();
        near(all.iter().map(|(m, v)| m * v).sum(), momentum, 1e-9, &source);
        near(
            all.iter().map(|(m, v)| 0.5 * m * v * v).sum(),
            energy,
            1e-9 * energy,
            &format!("{case}: {:?}\n{source}", run.notes),
        );
    }
    let cradle = "[mass.a]\nmass = \"1 kg\"\n[mass.b]\nmass = \"1 kg\"\n[mass.c]\nmass = \"1 kg\"\n[end_stop.s]\nmass_1 = \"b\"\nmass_2 = \"a\"\nlower = \"0 m\"\n\
                  restitution = 1\n[end_stop.t]\nmass_1 = \"c\"\nmass_2 = \"b\"\nlower = \"0 m\"\nrestitution = 1\n[scenario]\nduration = \"2 s\"\n\
                  initial = { \"a.v\" = \"3 m/s\", \"b.s\" = \"1 m\", \"c.s\" = \"1 m\" }\n";
    let run = by(cradle, Method::Automatic);
    for (name, speed) in [("a.v", -1.0), ("b.v", 2.0), ("c.v", 2.0)] {
        near(last(&run, name), speed, 1e-12, name);
    }
    assert!(run.notes.iter().any(|note| note.contains("`s`, `t` act together")), "{:?}", run.notes);
}

/// What is thrown between two walls that leave it no room knocks without an end: the run goes on without its restitution, and says so.
#[test]
fn endless_impacts_are_reported() {
    let source = "[mass.a]\nmass = \"1 kg\"\n[end_stop.s]\nmass_1 = \"a\"\nlower = \"-1 m\"\nrestitution = 1\n[mass.w]\nmass = \"1e9 kg\"\n\
                  [end_stop.t]\nmass_1 = \"w\"\nmass_2 = \"a\"\nlower = \"0 m\"\nrestitution = 1\n[constraint.held]\ncoefficients = { w = 1 }\noffset = \"-1 m\"\n\
                  [scenario]\nduration = \"1 s\"\ninitial = { \"a.s\" = \"-1 m\", \"a.v\" = \"1 m/s\", \"w.s\" = \"-1 m\" }\n";
    let run = by(source, Method::Automatic);
    near(last(&run, "a.v"), 0.0, 1e-12, "it rests");
    near(run.energy.dissipated, 0.5, 1e-12, "its energy");
    assert!(
        run.notes.iter().any(|note| note.contains("computed the last ones without restitution")),
        "{:?}",
        run.notes
    );
}
