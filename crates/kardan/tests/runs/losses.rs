//! Teeth that rub: efficiencies, losses over load and speed, teeth that lock themselves, and motions that are not one.

use kardan::diagnostics::Diagnostic;
use kardan::results::{Energy, Outcome, Run};
use kardan::study::{Project, Silent};

use crate::common::{at, runs_only, signal};

/// A motor with 0.3 kg m², a load with 0.5 kg m² behind a gear of ratio 4, torques on both, and keys of the gear.
fn drive(keys: &str, motor: &str, load: &str, initial: &str) -> String {
    format!(
        "[shaft.motor]\ninertia = \"0.3 kg m^2\"\n[shaft.load]\ninertia = \"0.5 kg m^2\"\n\
         [gear.gear]\nshaft_1 = \"motor\"\nshaft_2 = \"load\"\nratio = 4\n{keys}\n\
         [torque.drive]\nshaft = \"motor\"\nlaw = \"{motor}\"\n[torque.push]\nshaft = \"load\"\nlaw = \"{load}\"\n\
         [scenario]\nduration = \"2 s\"\noutput_step = \"10 ms\"\n{initial}\n"
    )
}

fn tried(model: &str) -> Run {
    let diagnostics = |diagnostics: Vec<Diagnostic>| panic!("{diagnostics:?}\n{model}");
    Project::open(model).run(&runs_only(), &Silent).unwrap_or_else(diagnostics).runs.remove(0)
}

fn only(model: &str) -> Run {
    let run = tried(model);
    assert_eq!(run.outcome, Outcome::Completed);
    let Energy { input, stored, dissipated, residual, .. } = run.energy;
    assert!(residual.abs() <= 1e-9 * input.abs().max(stored.abs()).max(dissipated), "{:?}", run.energy);
    run
}

/// Both ways of the power: with λ the torque of the teeth on the motor and κ the loss for one of it, `J₁ a = τ₁ + λ − κ|λ|` and
/// `J₂ a / i = τ₂ − i λ`.
#[test]
fn efficiencies_hold_for_each_way_of_the_power() {
    let (j1, j2, i) = (0.3, 0.5, 4.0);
    let (forth, back) = (0.8, 0.7);
    let keys = "efficiency = 0.8\nefficiency_back = 0.7";
    // The motor drives: λ < 0, τ₁ + λ/η.
    let run = only(&drive(keys, "1 N m", "0 N m", ""));
    let a = 1.0 / (j1 + j2 / (forth * i * i));
    assert!((at(&run, "motor.w", 2.0) - 2.0 * a).abs() < 1e-9, "{} {}", at(&run, "motor.w", 2.0), 2.0 * a);
    let carried = -j2 * a / (i * i);
    assert!((at(&run, "gear.tau", 1.0) - carried).abs() < 1e-9);
    assert!((at(&run, "gear.friction", 1.0) - carried.abs() * (1.0 / forth - 1.0)).abs() < 1e-9);
    // The load drives: λ > 0, λ η.
    let run = only(&drive(keys, "0 N m", "10 N m", ""));
    let a = back * 10.0 / i / (j1 + back * j2 / (i * i));
    assert!((at(&run, "motor.w", 2.0) - 2.0 * a).abs() < 1e-9, "{} {}", at(&run, "motor.w", 2.0), 2.0 * a);
    // Backward all is the same with the other sign.
    let run = only(&drive(keys, "0 N m", "-10 N m", ""));
    assert!((at(&run, "motor.w", 2.0) + 2.0 * a).abs() < 1e-9);
    // The power that is lost is that of the loss.
    let loss = 0.5 * (at(&run, "gear.friction", 1.0) * at(&run, "motor.w", 2.0)).abs() * 2.0;
    assert!((run.energy.dissipated - loss).abs() < 1e-9 * loss, "{:?} {loss}", run.energy);
}

/// Teeth that hardly let anything through move all the same, one gear or two behind each other: 1 N m on the first of shafts of 1 kg m² with ratios of
/// 10, or of 2 and 2, with nothing but `J/η i²` behind each.
#[test]
fn low_efficiency_moves_at_any_torque() {
    let shafts =
        |names: &[&str]| names.iter().map(|n| format!("[shaft.{n}]\ninertia = \"1 kg m^2\"\n")).collect::<String>();
    let gear = |first: &str, second: &str, ratio: f64, part: f64| {
        format!(
            "[gear.{first}{second}]\nshaft_1 = \"{first}\"\nshaft_2 = \"{second}\"\nratio = {ratio}\nefficiency = {part:?}\n"
        )
    };
    let more = "[torque.t]\nshaft = \"a\"\nlaw = \"1 N m\"\n[scenario]\nduration = \"1 s\"\n";
    for part in [0.1, 0.009, 1e-4, 1e-6, 1e-8] {
        let one = only(&(shafts(&["a", "b"]) + &gear("a", "b", 10.0, part) + more));
        let expected = 1.0 / (1.0 + 0.01 / part);
        assert!((at(&one, "a.w", 1.0) - expected).abs() < 1e-7 * expected, "{part}: {}", at(&one, "a.w", 1.0));
        if part < 1e-4 {
            continue;
        }
        let two = only(&(shafts(&["a", "b", "c"]) + &gear("a", "b", 2.0, part) + &gear("b", "c", 2.0, part) + more));
        let expected = 1.0 / (1.0 + (1.0 + 0.25 / part) * 0.25 / part);
        assert!((at(&two, "a.w", 1.0) - expected).abs() < 1e-7 * expected, "{part}: {}", at(&two, "a.w", 1.0));
    }
}

/// At rest teeth hold up to their loss: a load that pushes 10 N m is held by the motor with anything from η·2.5 to 2.5/η N m.
#[test]
fn a_load_sticks_between_two_torques() {
    let keys = "efficiency = 0.8\nefficiency_back = 0.7";
    for (motor, moves) in [(-1.7499, 1.0), (-1.7501, 0.0), (-2.5, 0.0), (-3.1249, 0.0), (-3.1251, -1.0)] {
        let run = only(&drive(keys, &format!("{motor} N m"), "10 N m", ""));
        let speed = at(&run, "motor.w", 2.0);
        assert!(if moves == 0.0 { speed == 0.0 } else { speed * moves > 0.0 }, "{motor} N m: {speed} rad/s");
    }
}

/// A worm whose lead angle is below its friction angle: no load moves it, and it is not moved by any for ten hours; lowered by the motor it
/// takes the torque (κ − 1) λ.
#[test]
fn a_worm_locks_itself() {
    let keys = "efficiency = 0.4\nefficiency_back = -0.5";
    for load in ["10 N m", "-1000 N m", "1e6 N m * sin(2 pi * 1 Hz * t)"] {
        let run = only(&drive(keys, "0 N m", load, ""));
        assert!(signal(&run, "motor.phi").iter().all(|angle| *angle == 0.0), "{load}");
    }
    let ten_hours = drive(keys, "0 N m", "50 N m * (1 + sin(2 pi * t / 1000 s))", "")
        .replace("2 s\"\noutput_step = \"10 ms", "36000 s\"\noutput_step = \"600 s");
    let run = only(&ten_hours);
    assert!(signal(&run, "motor.phi").iter().chain(signal(&run, "load.w")).all(|x| *x == 0.0));
    // Lowering: J₁ a = τ₁ + λ (1 − κ), J₂ a/i = τ₂ − i λ; κ = 1.5.
    let run = only(&drive(keys, "2 N m", "10 N m", ""));
    let a = (2.0 - 0.5 * 10.0 / 4.0) / (0.3 - 0.5 * 0.5 / 16.0);
    assert!((at(&run, "motor.w", 2.0) - 2.0 * a).abs() < 1e-9, "{} {}", at(&run, "motor.w", 2.0), 2.0 * a);
    let run = only(&drive(keys, "1.2499 N m", "10 N m", ""));
    assert_eq!(at(&run, "motor.w", 2.0), 0.0);
}

/// `loss = c + k load + d speed` makes `J a = −(c + k λ) − d w` while the gear coasts: an exponential until it stops.
#[test]
fn losses_over_load_and_speed_follow_their_expression() {
    let keys = "loss = \"0.1 N m + 0.25 * load + 0.05 N m s/rad * speed\"";
    let run = only(&drive(keys, "0 N m", "2 N m", "initial = { \"motor.w\" = \"3 rad/s\" }"));
    // λ > 0: λ = τ₂/i − J₂ a/i², J₁ a = λ (1 − k) − c − d w.
    let (j1, j2, i, k, c, d) = (0.3, 0.5, 4.0, 0.25, 0.1, 0.05);
    let inertia = j1 + (1.0 - k) * j2 / (i * i);
    let last = ((1.0 - k) * 2.0 / i - c) / d;
    let speed = |t: f64| last + (3.0 - last) * (-d / inertia * t).exp();
    for t in [0.5, 1.0, 2.0] {
        assert!((at(&run, "motor.w", t) - speed(t)).abs() < 1e-9, "{} {}", at(&run, "motor.w", t), speed(t));
    }
}

/// The same law as a table over speed and load, with a parameter for how warm it is.
#[test]
fn a_loss_map_is_a_table() {
    let map = "[table.map]\npoints = { x = [\"0 rad/s\", \"100 rad/s\"], y = [\"0 N m\", \"10 N m\"], \
               value = [\"0.1 N m\", \"0.1 N m\", \"2.1 N m\", \"2.1 N m\"] }\n";
    let keys = "loss = \"(2 - warm) * map(speed, load)\"";
    let run = only(&format!("[parameters]\nwarm = 0.5\n{map}{}", drive(keys, "1 N m", "0 N m", "")));
    let (part, least) = (1.5 * 0.2, 1.5 * 0.1);
    let a = (1.0 - least) / (0.3 + 0.5 / 16.0 * (1.0 + part));
    assert!(
        (at(&run, "motor.w", 2.0) - 2.0 * a).abs() < 1e-9,
        "{} {} {}",
        at(&run, "motor.w", 2.0),
        2.0 * a,
        at(&run, "gear.friction", 1.0)
    );
}

/// A loss map that is left is told, with the size of the speed or of the load that it was asked.
#[test]
fn exceeding_a_loss_map_is_reported() {
    let run = |argument: &str, unit: &str, last: f64| {
        let map = format!(
            "[table.map]\npoints = {{ x = [\"0 {unit}\", \"{last} {unit}\"], value = [\"0.1 N m\", \"0.1 N m\"] }}\n"
        );
        only(&format!("{map}{}", drive(&format!("loss = \"map({argument})\""), "-1 N m", "0 N m", "")))
    };
    let acceleration = (1.0 - 0.1) / (0.3 + 0.5 / 16.0);
    let reported = |run: &kardan::results::Run| run.notes.iter().find(|note| note.contains("table `map`")).cloned();
    let by = "`gear` read table `map` outside its range from";
    for (argument, unit, last, largest) in
        [("speed", "rad/s", 1.0, 2.0 * acceleration), ("load", "N m", 0.05, 0.5 / 16.0 * acceleration)]
    {
        let note = reported(&run(argument, unit, last)).expect("a note");
        let excess = format!("s by {:.6} {unit} above its last point at {last:.6} {unit}", largest - last);
        assert!(note.contains(by) && note.contains(&excess), "{note}: {excess}");
        assert_eq!(reported(&run(argument, unit, 2.0 * largest)), None);
    }
}

/// A loss that grows with the time and follows a signal: `J a = 1 − λ − (0.1 + 0.2 t)`, and twice as much from 1 s on.
#[test]
fn losses_may_depend_on_time_and_signals() {
    let signal =
        "[signal.worn]\nkind = \"pulses\"\nlow = 1\nhigh = 2\nstart = \"1 s\"\nperiod = \"9 s\"\nwidth = \"8 s\"\n";
    let model = drive("loss = \"worn * (0.1 N m + 0.2 N m * t / (1 s))\"", "1 N m", "0 N m", "");
    let run = only(&format!("{signal}{model}"));
    let inertia = 0.3 + 0.5 / 16.0;
    let half = (1.0 - 0.1 - 0.1) / inertia;
    assert!((at(&run, "motor.w", 1.0) - half).abs() < 1e-9, "{} {half}", at(&run, "motor.w", 1.0));
    let whole = half + (1.0 - 0.2 - 0.6) / inertia;
    assert!((at(&run, "motor.w", 2.0) - whole).abs() < 1e-9, "{} {whole}", at(&run, "motor.w", 2.0));
}

/// With friction c₁ before the teeth and c₂ behind them, they hold a load up to `c₂ + c₁/(1 − κ)`, whoever holds how much.
#[test]
fn frictions_on_both_sides_stick_with_the_gear_loss() {
    let (c1, c2, kappa) = (0.2, 1.5, 0.3);
    let most = c2 + 4.0 * c1 / (1.0 - kappa);
    for (part, sticks) in [(0.999, true), (1.001, false)] {
        let model = drive("efficiency = 0.8\nefficiency_back = 0.7", "0 N m", &format!("{} N m", part * most), "")
            .replace("\"0.3 kg m^2\"", "\"0.3 kg m^2\"\nfriction = \"0.2 N m\"")
            .replace("\"0.5 kg m^2\"", "\"0.5 kg m^2\"\nfriction = \"1.5 N m\"");
        let run = only(&model);
        assert_eq!(at(&run, "motor.w", 2.0) == 0.0, sticks, "{part}");
    }
}

/// What holds nothing does not help teeth to hold: a freewheel on the way that it turns freely, and teeth that lose nothing on that way.
#[test]
fn lossless_elements_do_not_help_to_stick() {
    for (keys, more, load) in [
        ("efficiency = 0.8\nefficiency_back = 0.7", "[one_way_clutch.free]\ndriven = \"motor\"\n", 10.0f64),
        ("efficiency = 0.8\nefficiency_back = 1", "", 10.0),
        ("efficiency = 0.8\nefficiency_back = 1", "", -10.0),
    ] {
        let model = drive(keys, "0 N m", &format!("{load} N m"), "");
        let model = match more {
            "" => model.replace("\"0.3 kg m^2\"", "\"0.3 kg m^2\"\nfriction = \"0.2 N m\""),
            more => format!("{more}{model}"),
        };
        let run = only(&model);
        let (back, c) = if more.is_empty() { (1.0, 0.2) } else { (0.7, 0.0) };
        let a = load.signum() * (back * 2.5 - c) / (0.3 + back * 0.5 / 16.0);
        assert!(
            (at(&run, "motor.w", 2.0) - 2.0 * a).abs() < 1e-9,
            "{keys} {more}: {} {}",
            at(&run, "motor.w", 2.0),
            2.0 * a
        );
    }
}

/// Two gears behind each other with friction before them hold `c i₁ i₂ / ((1 − κ₁)(1 − κ₂))`.
#[test]
fn gears_in_series_stick() {
    let most = 0.2 * 4.0 * 3.0 / ((1.0 - 0.3) * (1.0 - 0.4));
    for (part, sticks) in [(-0.999, true), (0.5, true), (0.999, true), (1.001, false), (-1.001, false)] {
        let load = part * most;
        let run = only(&format!(
            "[shaft.motor]\ninertia = \"0.3 kg m^2\"\nfriction = \"0.2 N m\"\n[shaft.between]\ninertia = \"0.1 kg m^2\"\n\
             [shaft.load]\ninertia = \"0.5 kg m^2\"\n\
             [gear.first]\nshaft_1 = \"motor\"\nshaft_2 = \"between\"\nratio = 4\nefficiency = 0.8\nefficiency_back = 0.7\n\
             [gear.second]\nshaft_1 = \"between\"\nshaft_2 = \"load\"\nratio = 3\nefficiency = 0.7\nefficiency_back = 0.6\n\
             [torque.push]\nshaft = \"load\"\nlaw = \"{load} N m\"\n[scenario]\nduration = \"2 s\"\noutput_step = \"10 ms\"\n"
        ));
        assert_eq!(at(&run, "motor.w", 2.0) == 0.0, sticks, "{part}");
        if sticks {
            // Torques at rest balance on each shaft, and none is above what it may be.
            let value = |name: &str| at(&run, name, 1.0);
            let (first, second) = (value("first.tau"), value("second.tau"));
            assert!((value("motor.friction") + value("first.friction") - first).abs() < 1e-9);
            assert!((value("second.friction") - second + 4.0 * first).abs() < 1e-9);
            assert!((3.0 * second - load).abs() < 1e-9);
            assert!(
                value("motor.friction").abs() <= 0.2 + 1e-9
                    && value("first.friction").abs() <= 0.3 * first.abs() + 1e-9
            );
            assert!(value("second.friction").abs() <= 0.4 * second.abs() + 1e-9);
        }
    }
}

/// A harmonic drive of which nothing is fixed loses what its efficiency says of the power that comes through it relative to its circular spline.
#[test]
fn a_harmonic_drive_loses_relative_to_its_circular_spline() {
    let run = only(
        "[shaft.wg]\ninertia = \"1e-4 kg m^2\"\n[shaft.cs]\ninertia = \"0.05 kg m^2\"\n[shaft.fs]\ninertia = \"0.04 kg m^2\"\n\
         [harmonic_drive.hd]\nwave_generator = \"wg\"\ncircular_spline = \"cs\"\nflexspline = \"fs\"\nratio = 50\nefficiency = 0.7\n\
         [torque.motor]\nshaft = \"wg\"\nreaction = \"cs\"\nlaw = \"0.2 N m\"\n\
         [torque.load]\nshaft = \"fs\"\nlaw = \"3 N m\"\n[scenario]\nduration = \"1 s\"\noutput_step = \"10 ms\"\n",
    );
    for t in [0.3, 0.9] {
        let value = |name: &str| at(&run, name, t);
        let slip = value("wg.w") - value("cs.w");
        let (carried, loss) = (value("hd.tau"), value("hd.friction"));
        let part = if carried * slip < 0.0 { 1.0 / 0.7 - 1.0 } else { 0.3 };
        assert!((loss - slip.signum() * part * carried.abs()).abs() < 1e-9, "{loss} {carried} {slip}");
        // Momentum of each shaft: the loss acts on wg and back on cs.
        let change = |name: &str| (at(&run, name, t + 0.01) - at(&run, name, t - 0.01)) / 0.02;
        assert!((1e-4 * change("wg.w") - (0.2 + carried - loss)).abs() < 1e-6);
        assert!((0.05 * change("cs.w") - (-0.2 - 51.0 * carried + loss)).abs() < 1e-6);
        assert!((0.04 * change("fs.w") - (3.0 + 50.0 * carried)).abs() < 1e-6);
    }
}

/// With a stiffness the loss follows the torque of the spring: where the flexspline is loaded slowly, the wave generator gives way beyond the loss.
#[test]
fn an_elastic_harmonic_drive_loses_a_part_of_its_spring_torque() {
    let run = only(
        "[shaft.wg]\ninertia = \"1e-4 kg m^2\"\n[shaft.cs]\ninertia = \"1 kg m^2\"\n[shaft.fs]\ninertia = \"0.04 kg m^2\"\n\
         [constraint.fixed]\ncoefficients = { cs = 1 }\n\
         [harmonic_drive.hd]\nwave_generator = \"wg\"\ncircular_spline = \"cs\"\nflexspline = \"fs\"\nratio = 50\n\
         stiffness = \"1e4 N m/rad\"\ndamping = \"10 N m s/rad\"\nefficiency = 0.7\nefficiency_back = 0.6\nloss = \"0.01 N m\"\n\
         [torque.motor]\nshaft = \"wg\"\nlaw = \"0.3 N m\"\n\
         [torque.load]\nshaft = \"fs\"\nlaw = \"4 N m * sin(2 pi * 2 Hz * t)\"\n[scenario]\nduration = \"1 s\"\noutput_step = \"1 ms\"\n",
    );
    let column = |name: &str| signal(&run, name);
    let (carried, loss, speed) = (column("hd.tau"), column("hd.friction"), column("wg.w"));
    let mut slid = 0;
    for k in 0..carried.len() {
        let forth = carried[k] * speed[k] <= 0.0;
        let part = if forth { 1.0 / 0.7 - 1.0 } else { 0.4 };
        if speed[k] != 0.0 {
            slid += 1;
            assert!((loss[k] - speed[k].signum() * (0.01 + part * carried[k].abs())).abs() < 1e-9, "{k}");
        } else {
            let most = 0.01 + (1.0 / 0.7 - 1.0f64).max(0.4) * carried[k].abs();
            assert!(loss[k].abs() <= most + 1e-9, "{k}");
        }
    }
    assert!(slid > 100, "{slid}");
}

/// A screw of 5 mm lead: it lifts 100 kg with m g lead / η, and holds them by itself where its thread locks.
#[test]
fn a_screw_lifts_and_locks() {
    let screw = |back: f64, torque: f64| {
        only(&format!(
            "[shaft.screw]\ninertia = \"1e-3 kg m^2\"\n[mass.table]\nmass = \"100 kg\"\n\
             [screw.thread]\nshaft = \"screw\"\nnut = \"table\"\nlead = \"5 mm/rev\"\nefficiency = 0.35\nefficiency_back = {back}\n\
             [torque.motor]\nshaft = \"screw\"\nlaw = \"{torque} N m\"\n\
             [torque.weight]\nshaft = \"table\"\nlaw = \"-100 kg * 9.81 m/s^2\"\n[scenario]\nduration = \"1 s\"\noutput_step = \"10 ms\"\n"
        ))
    };
    let lead = 0.005 / (2.0 * std::f64::consts::PI);
    let needed = 981.0 * lead / 0.35;
    assert!(at(&screw(-0.8, needed * 1.001), "table.s", 1.0) > 0.0);
    assert_eq!(at(&screw(-0.8, needed * 0.999), "table.s", 1.0), 0.0);
    assert_eq!(at(&screw(-0.8, 0.0), "table.s", 1.0), 0.0);
    let run = screw(0.2, 0.0);
    let a = -0.2 * 981.0 * lead / (1e-3 + 0.2 * 100.0 * lead * lead);
    assert!((at(&run, "screw.w", 1.0) - a).abs() < 1e-7, "{} {a}", at(&run, "screw.w", 1.0));
}

/// A worm that turns a heavy load: where the load drives it against its own inertia, two motions go on or none (Painlevé). Both are told.
#[test]
fn gear_jamming_is_reported() {
    // Λ = (50/16)/(0.3 + 50/16) = 0.912, κ = 1.5: 1 − κ Λ < 0.
    let heavy = |motor: &str, load: &str| {
        drive("efficiency = 0.4\nefficiency_back = -0.5", motor, load, "initial = { \"motor.w\" = \"5 rad/s\" }")
            .replace("\"0.5 kg m^2\"", "\"50 kg m^2\"")
    };
    // No motion fits: it stops at once, with all its energy, and holds.
    let run = only(&heavy("0 N m", "4 N m"));
    assert!(run.events[0].description.starts_with("gear jams: its load drives it"), "{:?}", run.events);
    assert!(signal(&run, "motor.w")[1..].iter().all(|speed| *speed == 0.0));
    let energy = 0.5 * (0.3 + 50.0 / 16.0) * 25.0;
    assert!((run.energy.dissipated - energy).abs() < 1e-9 * energy, "{:?}", run.energy);
    // A motor that drives, and is then turned off: it jams where the load begins to push.
    let run = only(&heavy("8 N m * cos(2 pi * 0.5 Hz * t)", "0 N m"));
    let jamming = run.events.iter().find(|event| event.description.starts_with("gear jams")).expect("it jams");
    assert!((jamming.time - 0.5).abs() < 1e-6, "{jamming:?}");
    // 5 rad/s, and 8 N m on J₁ + J₂/(i² η) for a quarter of a period.
    let speed = 5.0 + 8.0 / (0.3 + 50.0 / 16.0 / 0.4) / std::f64::consts::PI;
    let energy = 0.5 * (0.3 + 50.0 / 16.0) * speed * speed;
    assert!(
        jamming.description.ends_with(&format!("the impact dissipates {energy:.6} J")),
        "{} {energy}",
        jamming.description
    );
    let run = tried(&heavy("8 N m", "0 N m"));
    assert_eq!(run.outcome, Outcome::Completed);
    assert!(
        run.events.iter().any(|event| event.description.contains("two motions are possible from here")),
        "{:?}",
        run.events
    );
    let a = 8.0 / (0.3 + 50.0 / 16.0 / 0.4);
    assert!((at(&run, "motor.w", 2.0) - 5.0 - 2.0 * a).abs() < 1e-9);
}

/// A loss that grows with the time: from `κ Λ = 1` on two motions go on, within a step.
#[test]
fn two_motions_are_reported_from_their_beginning() {
    let run = tried(
        &drive("loss = \"1.6 * t / (1 s) * load\"", "8 N m", "0 N m", "initial = { \"motor.w\" = \"5 rad/s\" }")
            .replace("\"0.5 kg m^2\"", "\"50 kg m^2\""),
    );
    let influence = (50.0 / 16.0) / (0.3 + 50.0 / 16.0);
    let reported: Vec<f64> = run
        .events
        .iter()
        .filter(|event| event.description.contains("two motions are possible from here"))
        .map(|event| event.time)
        .collect();
    assert!(reported.len() == 1 && (reported[0] - 1.0 / (1.6 * influence)).abs() < 1e-12, "{:?}", run.events);
}

/// A flywheel of 1 kg m² at 2 rad/s beside teeth that jam, 0.5 and 0.2 kg m² at 1 and 2 rad/s: a clutch of 0.3 N m between them gives no impulse, whether it
/// sticks or slips, and only brakes it then; a lock does.
#[test]
fn bounded_torques_give_no_impulse_at_gear_jamming() {
    let model = |between: &str, speed: f64| {
        format!(
            "[shaft.w]\ninertia = \"0.5 kg m^2\"\n[shaft.c]\ninertia = \"0.2 kg m^2\"\n[shaft.f]\ninertia = \"1 kg m^2\"\n[gear.g]\nshaft_1 = \"w\"\n\
             shaft_2 = \"c\"\nratio = 0.5\nefficiency = 0.9\nefficiency_back = -5\n{between}\nshaft_1 = \"f\"\nshaft_2 = \"c\"\n[torque.x]\nshaft = \"c\"\n\
             law = \"1 N m\"\n[scenario]\nduration = \"1 s\"\noutput_step = \"10 ms\"\n\
             initial = {{ \"w.w\" = \"1 rad/s\", \"c.w\" = \"2 rad/s\", \"f.w\" = \"{speed} rad/s\" }}\n"
        )
    };
    let clutch = "[clutch.e]\ntorque = \"0.3 N m\"";
    for speed in [2.0, 3.0, 1.5] {
        let run = only(&model(clutch, speed));
        let jamming = run.events.iter().find(|event| event.description.starts_with("g jams")).expect("it jams");
        assert!(
            jamming.time == 0.0 && jamming.description.ends_with("the impact dissipates 0.650000 J"),
            "{jamming:?}"
        );
        for time in [0.0, 0.5, 1.0] {
            assert!((at(&run, "f.w", time) - (speed - 0.3 * time)).abs() < 1e-9, "{speed} {}", at(&run, "f.w", time));
        }
        assert_eq!([at(&run, "c.w", 1.0), at(&run, "w.w", 1.0)], [0.0, 0.0]);
        let slipped = 0.5 * (speed * speed - (speed - 0.3) * (speed - 0.3));
        assert!((run.energy.dissipated - 0.65 - slipped).abs() < 1e-9, "{:?}", run.energy);
    }
    let run = only(&model("[lock.e]\nengaged = \"1\"", 2.0));
    let jamming = run.events.iter().find(|event| event.description.starts_with("g jams")).expect("it jams");
    assert!(jamming.description.ends_with("the impact dissipates 2.650000 J"), "{jamming:?}");
    assert_eq!(at(&run, "f.w", 1.0), 0.0);
}

/// Play closes, the teeth jam while a clutch slips, and the balance of energy closes.
#[test]
fn a_slipping_clutch_at_jamming_gears_with_backlash_balances_its_energy() {
    let run = only(
        "[shaft.w]\ninertia = \"0.5 kg m^2\"\n[shaft.c]\ninertia = \"0.2 kg m^2\"\n[shaft.f]\ninertia = \"1 kg m^2\"\n[gear.g]\nshaft_1 = \"w\"\nshaft_2 = \"c\"\n\
         ratio = 0.5\nefficiency = 0.9\nefficiency_back = -5\nbacklash = \"0.05 rad\"\n[clutch.e]\nshaft_1 = \"f\"\nshaft_2 = \"c\"\ntorque = \"0.3 N m\"\n\
         [torque.x]\nshaft = \"c\"\nlaw = \"3 N m*sin(7*t/(1 s))\"\n[scenario]\nduration = \"1 s\"\noutput_step = \"1 ms\"\ninitial = { \"f.w\" = \"0.4 rad/s\" }\n",
    );
    assert!(run.events.iter().any(|event| event.description.starts_with("g jams")), "{:?}", run.events);
    // 0.3 N m on 1 kg m² change its speed by 3e-4 rad/s a row at most.
    assert!(signal(&run, "f.w").windows(2).all(|pair| (pair[1] - pair[0]).abs() < 3.001e-4));
    assert!(run.warnings.is_empty(), "{:?}", run.warnings);
}

/// A rigid blow passes teeth that lock themselves, and the run says so; a stop that gives leaves it to the teeth.
#[test]
fn an_impact_through_a_gear_is_reported() {
    let model = |stop: &str| {
        format!(
            "[shaft.h]\ninertia = \"1 kg m^2\"\n[shaft.l]\ninertia = \"0.5 kg m^2\"\n[shaft.w]\ninertia = \"1e-3 kg m^2\"\n[gear.worm]\nshaft_1 = \"w\"\n\
             shaft_2 = \"l\"\nratio = 20\nefficiency = 0.4\nefficiency_back = -0.5\n[end_stop.e]\nshaft_1 = \"h\"\nshaft_2 = \"l\"\nupper = \"0 rad\"\n{stop}\n\
             [scenario]\nduration = \"0.2 s\"\ninitial = {{ \"h.phi\" = \"-0.1 rad\", \"h.w\" = \"2 rad/s\" }}\n"
        )
    };
    let reported = |run: &Run| {
        run.notes.iter().any(|note| note.starts_with("A rigid impact passed through the gear `worm` without gear loss"))
    };
    let run = tried(&model("restitution = 0"));
    assert!(reported(&run), "{:?}", run.notes);
    // The momentum of the one, 2 kg m² rad/s, on the inertia of all.
    assert!((signal(&run, "l.w").last().expect("rows") - 2.0 / (1.0 + 0.5 + 0.4)).abs() < 1e-9);
    let run = tried(&model("stiffness = \"1e4 N m/rad\""));
    assert!(!reported(&run) && signal(&run, "l.w").iter().all(|speed| speed.abs() < 1e-9), "{:?}", run.notes);
}

/// `J₁ + η J₂ / i² < 0` is foretold; what jams and starts again and again ends by name, after as many jams.
#[test]
fn gear_jamming_is_predicted_and_ends_by_name() {
    // ½ · 50 / 16 = 1.5625 kg m².
    for (inertia, jams) in [("1.56", 1), ("1.57", 0)] {
        let model = drive("efficiency = 0.4\nefficiency_back = -0.5", "1 N m", "0 N m", "")
            .replace("\"0.5 kg m^2\"", "\"50 kg m^2\"")
            .replace("\"0.3 kg m^2\"", &format!("\"{inertia} kg m^2\""));
        let project = Project::open(&model);
        let reported = project.diagnostics().iter().filter(|diagnostic| diagnostic.code == "gear::jamming").count();
        assert_eq!(reported, jams, "{inertia}: {:?}", project.diagnostics());
    }
    let screw = "[shaft.a]\ndamping = \"0.1 N m s/rad\"\n[mass.n]\nmass = \"1 kg\"\n[screw.s]\nshaft = \"a\"\nnut = \"n\"\nlead = \"5 mm/rev\"\n\
                 efficiency = 0.4\nefficiency_back = -0.2\n[motor.m]\nshaft = \"a\"\n[scenario]\nduration = \"1 s\"\n\
                 signals = { \"m.tau\" = \"1 N m - 1 N m/s * t\" }\n";
    let run = tried(screw);
    let Outcome::Failed { time, cause } = &run.outcome else { panic!("it jams without an end") };
    assert!(
        *time < 0.5 && cause.contains("`s` jams more than 200 times, each within 1e-3 s of the time before"),
        "{time} {cause}"
    );
    assert!(cause.contains("Give it less loss (a larger `efficiency_back`)"), "{cause}");
    assert!(run.energy.residual_share().is_some_and(|part| part < 1e-6), "{:?}", run.energy);
}

#[test]
fn a_loss_below_nothing_ends_the_run() {
    let run = tried(&drive("loss = \"0.1 N m - 0.05 N m s/rad * speed\"", "1 N m", "0 N m", ""));
    let Outcome::Failed { cause, .. } = &run.outcome else { panic!("{run:?}") };
    assert!(cause.contains("the `loss` of `gear` becomes negative"), "{cause}");
}
