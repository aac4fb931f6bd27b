//! Operating points in motion: against closed forms of steady drives, and the state of a run against the same state written down.

use kardan::diagnostics::Diagnostic;
use kardan::num::rational_to_f64;
use kardan::results::Linearised;
use kardan::study::{self, AnalyzeSettings, Project, Silent};

use crate::common::close;

fn linear_at(source: &str, at: &[(&str, &str)]) -> Result<Linearised, Vec<Diagnostic>> {
    let at = at.iter().map(|(signal, value)| (signal.to_string(), value.to_string())).collect();
    study::linearise(source, &AnalyzeSettings { at, ..AnalyzeSettings::default() }, false).map(|(found, _)| found)
}

#[track_caller]
fn linear(source: &str, at: &[(&str, &str)]) -> Linearised {
    linear_at(source, at).unwrap_or_else(|all| panic!("{all:?}"))
}

/// The message and the hint of the only mistake.
#[track_caller]
fn refusal(source: &str, at: &[(&str, &str)]) -> String {
    let all = linear_at(source, at).expect_err("it is refused");
    let errors: Vec<&Diagnostic> = all.iter().filter(|one| one.code != "parameter::unused").collect();
    assert_eq!(errors.len(), 1, "{all:?}");
    format!("{} | {}", errors[0].message, errors[0].help.clone().unwrap_or_default())
}

#[track_caller]
fn entry(found: &Linearised, row: &str, column: &str) -> f64 {
    let place = |name: &str| found.states.iter().position(|one| one.name == name).unwrap_or_else(|| panic!("{name}"));
    rational_to_f64(&found.a[(place(row), place(column))])
}

#[track_caller]
fn at(found: &Linearised, signal: &str) -> f64 {
    found
        .operating_point
        .iter()
        .find(|(one, _)| one.name == signal)
        .unwrap_or_else(|| panic!("{signal}: {:?}", found.operating_point))
        .1
}

fn reported(found: &Linearised, text: &str) -> bool {
    found.notes.iter().any(|note| note.contains(text))
}

const CAR: &str = "[mass.car]\nmass = \"1200 kg\"\n[torque.drag]\nmass = \"car\"\nlaw = \"-0.4 N s^2/m^2 * car.v * abs(car.v)\"\n[motor.drive]\nmass = \"car\"\n";

/// m v' = F - c v|v|: the pole of small motions is -2 c v0/m, and c v0^2 balances it.
#[test]
fn quadratic_drag_has_its_pole_and_its_force_at_each_speed() {
    for speed in [20.0_f64, -35.0, 0.5] {
        let found = linear(CAR, &[("car.v", &format!("{speed} m/s"))]);
        close(entry(&found, "car.v", "car.v"), -2.0 * 0.4 * speed.abs() / 1200.0, 1e-15, "the pole");
        close(at(&found, "drive.f"), 0.4 * speed * speed.abs(), 1e-9, "the force");
        close(at(&found, "car.v"), speed, 1e-12, "the speed");
        assert!(reported(&found, "steady at car.v"), "{:?}", found.notes);
    }
    // By the key, in its units, and by the text.
    for key in ["{ \"car.v\" = \"72 km/h\" }", "\"car.v = 72 km/h\""] {
        let found = linear(&format!("{CAR}[analysis]\nat = {key}\n"), &[]);
        close(entry(&found, "car.v", "car.v"), -2.0 * 0.4 * 20.0 / 1200.0, 1e-15, "the pole");
    }
    // With the force given the speed is found: sqrt(F/c).
    let found = linear(CAR, &[("drive.f", "250 N"), ("t", "0 s")]);
    close(at(&found, "car.v"), (250.0_f64 / 0.4).sqrt(), 1e-6, "the speed");
}

/// A motor drives a load through a spring that stiffens: at speed the spring carries the torque of the load, T = k x + k3 x^3, and small motions have its
/// slope there; friction that slides is part of the balance, and its Stribeck slope of the damping.
const SHUFFLE: &str = "
[shaft.motor]
inertia = \"0.2 kg m^2\"
friction = \"3 N m\"
breakaway = \"5 N m\"
stribeck_speed = \"40 rad/s\"
[shaft.load]
inertia = \"3 kg m^2\"
damping = \"0.8 N m s/rad\"
[spring_damper.shaft]
shaft_1 = \"motor\"
shaft_2 = \"load\"
stiffness = \"500 N m/rad\"
damping = \"2 N m s/rad\"
friction = \"7 N m\"
[torque.stiffer]
shaft = \"motor\"
reaction = \"load\"
law = \"-4000 N m/rad^3 * (motor.phi - load.phi)^3\"
[motor.drive]
shaft = \"motor\"
";

#[test]
fn the_shuffle_mode_at_speed_is_that_of_the_twisted_spring() {
    let found = linear(SHUFFLE, &[("load.w", "60 rad/s")]);
    let (speed, load) = (60.0_f64, 0.8 * 60.0);
    let twist = at(&found, "motor.phi") - at(&found, "load.phi");
    close(500.0 * twist + 4000.0 * twist.powi(3), load, 1e-9, "the torque of the spring");
    close(at(&found, "motor.w"), speed, 1e-12, "the speed of the motor");
    let (fall, slide) = (2.0 * (-(speed / 40.0).powi(2)).exp(), 3.0);
    close(at(&found, "drive.tau"), load + slide + fall, 1e-9, "the torque of the motor");
    let stiffness = 500.0 + 3.0 * 4000.0 * twist * twist;
    close(entry(&found, "motor.w", "motor.phi"), -stiffness / 0.2, 1e-6, "the stiffness");
    close(entry(&found, "load.w", "motor.phi"), stiffness / 3.0, 1e-6, "the stiffness");
    // d/dw of the friction: -2 w/v^2 of what falls.
    close(entry(&found, "motor.w", "motor.w"), -(2.0 - 2.0 * speed / 1600.0 * fall) / 0.2, 1e-9, "the damping");
    assert!(
        reported(&found, "sliding at the operating point, its friction is part of the balance: `motor`"),
        "{:?}",
        found.notes
    );
    assert!(reported(&found, "without relative motion at the operating point"), "{:?}", found.notes);
}

/// What is found is the equilibrium of the run too: started there under the torque that was found it stays.
#[test]
fn a_run_from_the_steady_motion_stays_in_it() {
    let found = linear(SHUFFLE, &[("load.w", "60 rad/s")]);
    let value = |signal| at(&found, signal);
    let source = format!(
        "{SHUFFLE}[signal.constant]\nkind = \"expression\"\nvalue = \"{} N m\"\n[scenario]\nduration = \"0.5 s\"\nsignals = {{ \"drive.tau\" = \"constant\" }}\n\
         initial = {{ \"motor.phi\" = \"{} rad\", \"load.phi\" = \"{} rad\", \"motor.w\" = \"60 rad/s\", \"load.w\" = \"60 rad/s\" }}\n",
        value("drive.tau"),
        value("motor.phi"),
        value("load.phi")
    );
    let mut run = Project::open(source.as_str()).simulation(None).unwrap_or_else(|all| panic!("{all:?}"));
    run.advance(0.5).expect("it runs");
    for signal in ["motor.w", "load.w"] {
        let id = run.signal(signal).expect("a signal");
        close(run.get(id), 60.0, 1e-6, signal);
    }
}

/// Road load behind a lock that is engaged: force of the road over ratio and radius, without slip; the mode of the half shafts.
fn car(lock: &str) -> String {
    format!(
        "[shaft.rotor]\ninertia = \"0.06 kg m^2\"\n[shaft.idler]\ninertia = \"0.002 kg m^2\"\n[shaft.diff]\ninertia = \"0.08 kg m^2\"\n\
         [lock.first]\nshaft_1 = \"rotor\"\nshaft_2 = \"idler\"\nengaged = \"{lock}\"\n\
         [gear.g]\nshaft_1 = \"idler\"\nshaft_2 = \"diff\"\nratio = 10\n[shaft.wheel]\ninertia = \"3 kg m^2\"\n\
         [spring_damper.half_shafts]\nshaft_1 = \"diff\"\nshaft_2 = \"wheel\"\nstiffness = \"9000 N m/rad\"\ndamping = \"40 N m s/rad\"\n\
         [mass.car]\nmass = \"1700 kg\"\n[rack_and_pinion.tyre]\npinion = \"wheel\"\nrack = \"car\"\nradius = \"0.3 m\"\n\
         [torque.road]\nmass = \"car\"\nlaw = \"-0.4 N s^2/m^2 * car.v * abs(car.v) - 180 N * (1 + grade)\"\n\
         [signal.grade]\nkind = \"ramp\"\nto = 1.0\nstart = \"1 s\"\nover = \"2 s\"\n[signal.gear]\nkind = \"table\"\n\
         points = {{ time = [\"0 s\", \"5 s\", \"6 s\"], value = [1, 0, 0] }}\ninterpolation = \"hold\"\n[motor.em]\nshaft = \"rotor\"\n\
         [scenario]\nduration = \"6 s\"\ninitial = {{ \"car.v\" = \"20 km/h\" }}\n"
    )
}

#[test]
fn a_car_with_road_load_has_a_linear_model_at_its_speed() {
    let source = car("gear");
    let v = 20.0_f64 / 3.6;
    // By default, as there is no equilibrium at rest, at the speed with which its run begins.
    for at_speed in [&[][..], &[("car.v", "20 km/h")]] {
        let found = linear(&source, at_speed);
        let force = 0.4 * v * v + 180.0;
        close(at(&found, "em.tau"), force * 0.3 / 10.0, 1e-9, "the torque of the motor");
        assert!(reported(&found, "closed at the operating point (locked or sticking): `first`"), "{:?}", found.notes);
        // Masses at the wheel: (rotor + idler) i^2 + diff against wheel + m r^2.
        let [one, other]: [f64; 2] = [(0.06 + 0.002) * 100.0 + 0.08, 3.0 + 1700.0 * 0.09];
        let analysis = study::analyze(
            &source,
            &AnalyzeSettings {
                at: at_speed.iter().map(|(signal, value)| (signal.to_string(), value.to_string())).collect(),
                ..AnalyzeSettings::default()
            },
            &Silent,
        )
        .unwrap_or_else(|all| panic!("{all:?}"));
        let mode = analysis.modes.iter().find(|mode| mode.eigenvalue.im > 0.0).expect("the shuffle mode");
        // Without the drag of the road, which moves it by some parts in a million.
        let (stiffness, damping) = (9000.0 * (1.0 / one + 1.0 / other), 40.0 * (1.0 / one + 1.0 / other));
        close(mode.eigenvalue.abs(), stiffness.sqrt(), 1e-3, "the shuffle mode");
        close(mode.eigenvalue.re, -damping / 2.0, 1e-2, "its damping");
        let motion = &analysis.class.expect("a class").operating_point;
        assert!(motion.in_motion && motion.motion.iter().any(|one| one.name == "em.tau"), "{motion:?}");
    }
    // The grade at 2 s is one half.
    let later = linear(&source, &[("car.v", "20 km/h"), ("t", "2 s")]);
    close(at(&later, "em.tau"), (0.4 * v * v + 270.0) * 0.03, 1e-9, "the torque on the grade");
    // With the lock open nothing drives the car.
    let open = refusal(&source, &[("car.v", "20 km/h"), ("t", "5.5 s")]);
    assert!(
        open.contains("no steady motion was found: `em` cannot balance it")
            && open.contains("the smallest residual is"),
        "{open}"
    );
}

#[test]
fn what_is_no_steady_motion_is_refused_with_what_to_write() {
    // A torque that depends on the angle that turns.
    let engine = "[shaft.engine]\ninertia = \"0.1 kg m^2\"\n[torque.combustion]\nshaft = \"engine\"\nlaw = \"50 N m * (1 + 0.6 * sin(2 * engine.phi))\"\n\
                  [motor.brake]\nshaft = \"engine\"\n";
    let turns = refusal(engine, &[("engine.w", "2000 rpm")]);
    assert!(turns.contains("is not steady: `combustion` depends on `engine.phi`, which changes"), "{turns}");
    assert!(turns.contains("\"engine.phi\" = \"0 deg\""), "{turns}");
    // With the angle it is that of this instant: 100 * 0.6 cos(2 phi) of stiffness.
    let instant = linear(engine, &[("engine.w", "2000 rpm"), ("engine.phi", "30 deg")]);
    close(
        entry(&instant, "engine.w", "engine.phi"),
        100.0 * 0.6 * (60.0_f64).to_radians().cos() / 0.1,
        1e-9,
        "the slope",
    );
    close(at(&instant, "brake.tau"), -50.0 * (1.0 + 0.6 * (60.0_f64).to_radians().sin()), 1e-9, "the brake");
    // Speeds that contradict each other, by a gear and by a spring.
    for element in [
        "[gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = 2\n",
        "[spring_damper.s]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"5 N m/rad\"\n",
    ] {
        let two = format!(
            "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n{element}[motor.m]\nshaft = \"a\"\n"
        );
        let both = refusal(&two, &[("a.w", "3 rad/s"), ("b.w", "4 rad/s")]);
        assert!(both.contains("contradict each other") && both.contains("remove one of them"), "{both}");
    }
    // Two motors of one shaft.
    let pair = "[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"2 N m s/rad\"\n[motor.front]\nshaft = \"a\"\n[motor.rear]\nshaft = \"a\"\n";
    let many = refusal(pair, &[("a.w", "3 rad/s")]);
    assert!(many.contains("more than one choice of the torques of `front`, `rear` balances it"), "{many}");
    assert!(many.contains("\"rear.tau\" = \"0 N m\""), "{many}");
    close(at(&linear(pair, &[("a.w", "3 rad/s"), ("rear.tau", "1 N m")]), "front.tau"), 5.0, 1e-12, "the other motor");
    // No motor.
    let coasting = refusal("[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"2 N m s/rad\"\n", &[("a.w", "3 rad/s")]);
    assert!(
        coasting.contains("there is no motor that could balance it; the smallest residual is -6.000000 N m on `a`"),
        "{coasting}"
    );
    // Names and units.
    let unknown = refusal(CAR, &[("cra.v", "3 m/s")]);
    assert!(
        unknown.contains("`cra.v` is not the angle or speed of a coordinate")
            && unknown.contains("did you mean `car.v`?"),
        "{unknown}"
    );
    let unit = refusal(CAR, &[("car.v", "3 m")]);
    assert!(unit.contains("expected a velocity, found a length"), "{unit}");
    let late = refusal(&format!("{CAR}[scenario]\nduration = \"2 s\"\n"), &[("t", "3 s")]);
    assert!(late.contains("`t` = 3 s is after the end of the run, 2 s"), "{late}");
}

/// The linear model at a time of a run is that at the positions and speeds of the run, and what accelerates is what the run's speeds do.
#[test]
fn the_state_of_a_run_is_an_operating_point() {
    let source = format!(
        "{}[scenario]\nduration = \"2 s\"\n[[scenario.event]]\nsignal = \"drive.tau\"\nat = \"0 s\"\nto = \"30 N m\"\nover = \"0.2 s\"\n",
        SHUFFLE.replace("friction = \"7 N m\"\n", "")
    );
    let at_time = linear(&source, &[("t", "0.7 s")]);
    let linear_of_time = linear(&format!("{source}[analysis]\nat = \"t = 0.7 s\"\n"), &[]);
    assert_eq!(at_time, linear_of_time);
    let state: Vec<(String, String)> = ["motor.phi", "load.phi", "motor.w", "load.w"]
        .iter()
        .map(|signal| {
            (
                signal.to_string(),
                format!("{} {}", at(&at_time, signal), if signal.ends_with(".w") { "rad/s" } else { "rad" }),
            )
        })
        .chain([("drive.tau".to_string(), "30 N m".to_string())])
        .collect();
    let state: Vec<(&str, &str)> = state.iter().map(|(signal, value)| (signal.as_str(), value.as_str())).collect();
    let same = linear(&source, &state);
    let numbers = |found: &Linearised| found.a.as_slice().iter().map(rational_to_f64).collect::<Vec<_>>();
    for (one, other) in numbers(&at_time).iter().zip(numbers(&same)) {
        close(*one, other, 1e-9 * other.abs().max(1.0), "an entry of A");
    }
    // What accelerates: the difference of the run's speeds around that time.
    let speed = |time: f64| {
        let mut run = Project::open(source.as_str()).simulation(None).unwrap_or_else(|all| panic!("{all:?}"));
        run.advance(time).expect("it runs");
        let id = run.signal("load.w").expect("a signal");
        run.get(id)
    };
    let difference = (speed(0.7005) - speed(0.6995)) / 1e-3;
    let note = at_time.notes.iter().find(|note| note.contains("not an equilibrium")).expect("what is left is told");
    let text = note.split("load.w changes by ").nth(1).and_then(|tail| tail.split(' ').next()).expect("a number");
    close(text.parse().expect("a number"), difference, 1e-3 * difference.abs(), "the acceleration of the load");
}
