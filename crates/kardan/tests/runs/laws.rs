//! Torques that are laws of angle, speed, time and signals: against closed forms.

use std::f64::consts::FRAC_PI_2;

use kardan::results::{Outcome, Run};
use kardan::simulate::Method;
use kardan::study::{Project, Settings, Silent};

use crate::common::{run_by, runs_only, signal};

fn by(source: &str, method: Method, tolerance: f64) -> Run {
    run_by(source, method, Some(tolerance))
}

const METHODS: [Method; 4] = [Method::Taylor, Method::Dop853, Method::Radau, Method::Automatic];

/// A motion of one body with an inertia of 1 kg m^2 from a place (rad) and a speed (rad/s), for so long (s).
fn body(law: &str, [place, speed]: [f64; 2], duration: f64) -> String {
    format!(
        "[shaft.a]\ninertia = \"1 kg m^2\"\n[torque.load]\nshaft = \"a\"\nlaw = \"{law}\"\n[scenario]\nduration = \"{duration} s\"\n\
         output_step = \"{} s\"\ninitial = {{ \"a.phi\" = \"{place} rad\", \"a.w\" = \"{speed} rad/s\" }}\n",
        duration / 100.0
    )
}

/// The complete elliptic integral K(k) by the arithmetic-geometric mean.
fn elliptic(k: f64) -> f64 {
    let (mut a, mut b) = (1.0_f64, (1.0 - k * k).sqrt());
    while (a - b).abs() > 1e-15 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    FRAC_PI_2 / a
}

/// `φ̈ = −4 sin φ` from rest at φ₀ is back after `4 K(sin(φ₀/2))/2`, and passes zero with the speed that its height gives it.
#[test]
fn a_pendulum_swings_with_the_period_of_the_elliptic_integral() {
    for degrees in [1.0_f64, 60.0, 90.0, 150.0, 179.0] {
        let start = degrees.to_radians();
        let period = 4.0 * elliptic((0.5 * start).sin()) / 2.0;
        for method in METHODS {
            for tolerance in [1e-11, 1e-9, 1e-6] {
                let run = by(&body("-4 N m * sin(a.phi)", [start, 0.0], period), method, tolerance);
                let (angle, speed) = (signal(&run, "a.phi"), signal(&run, "a.w"));
                let (last, quarter) = (angle.len() - 1, angle.len() / 4);
                // Close to the top what is left out grows for long.
                let allowed = 2e4 * tolerance * if degrees > 170.0 { 1e3 } else { 1.0 };
                assert!(
                    (angle[last] - start).abs() < allowed,
                    "{degrees} {method:?} {tolerance}: {}",
                    angle[last] - start
                );
                let height = (8.0 * (1.0 - start.cos())).sqrt();
                assert!((speed[quarter] + height).abs() < allowed, "{degrees} {method:?}: {}", speed[quarter] + height);
                assert!(run.energy.residual.abs() < 1e3 * tolerance, "{degrees} {method:?}: {:?}", run.energy);
            }
        }
    }
}

/// Motions whose series have long gaps: steps must not take a gap for the end. With `φ̈ = −n φ^(2n−1)` half the square of the speed and half of
/// `φ^(2n)` are constant together.
#[test]
fn gaps_of_a_series_are_not_its_end() {
    for n in [2, 3, 5, 9] {
        for tolerance in [1e-12, 1e-10, 1e-9, 1e-8, 1e-6, 1e-4] {
            let law = format!("-{n} N m * (a.phi/1 rad)^{}", 2 * n - 1);
            for start in [[0.0, 1.0], [1.0, 0.0]] {
                let run = by(&body(&law, start, 20.0), Method::Taylor, tolerance);
                let all = signal(&run, "a.phi").iter().zip(signal(&run, "a.w"));
                for (angle, speed) in all {
                    let energy = 0.5 * (speed * speed + angle.powi(2 * n));
                    assert!((energy - 0.5).abs() < 1e4 * tolerance, "{n} {tolerance} {start:?}: {energy}");
                }
            }
        }
    }
}

/// `v̇ = −c |v| v` slows down as `v₀/(1 + c v₀ t)`, whichever way it goes.
#[test]
fn drag_slows_down_as_its_square() {
    for speed in [30.0_f64, -30.0] {
        for method in METHODS {
            let source = format!(
                "[mass.car]\nmass = \"1000 kg\"\n[torque.drag]\nmass = \"car\"\nlaw = \"-0.5 N s^2/m^2 * car.v * abs(car.v)\"\n\
                 [scenario]\nduration = \"60 s\"\noutput_step = \"1 s\"\ninitial = {{ \"car.v\" = \"{speed} m/s\" }}\n"
            );
            let run = by(&source, method, 1e-10);
            for (t, found) in run.series.time.iter().zip(signal(&run, "car.v")) {
                let exact = speed / (1.0 + 0.0005 * speed.abs() * t);
                assert!((found - exact).abs() < 1e-8, "{method:?} {t}: {found} {exact}");
            }
        }
    }
}

/// A law of time and signals acts as the disturbance that these functions are added to, over every breakpoint.
#[test]
fn a_law_of_time_is_a_disturbance() {
    let plant = "[shaft.a]\ninertia = \"2 kg m^2\"\ndamping = \"0.3 N m s/rad\"\nfriction = \"0.2 N m\"\n\
                 [shaft.b]\ninertia = \"1 kg m^2\"\n[universal_joint.j]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nangle = \"30 deg\"\n\
                 [signal.knocks]\nkind = \"pulses\"\nhigh = \"5 N m\"\nlow = \"1 N m\"\nperiod = \"0.3 s\"\nwidth = \"0.1 s\"\nstart = \"0.1 s\"\n\
                 [parameters]\nsize = \"2 N m\"\n";
    let text = "knocks + size * sin(2 pi t / 0.7 s)";
    let law = format!("{plant}[torque.load]\nshaft = \"b\"\nlaw = \"{text}\"\n[scenario]\nduration = \"3 s\"\n");
    let disturbance = format!(
        "{plant}[disturbance.load]\nshaft = \"b\"\n[scenario]\nduration = \"3 s\"\nsignals = {{ load = \"{text}\" }}\n"
    );
    for method in METHODS {
        let [one, other] = [&law, &disturbance].map(|source| by(source, method, 1e-11));
        for (name, exact) in [("a.phi", 1e-8), ("b.w", 1e-8), ("load.tau", 1e-12), ("j.tau", 1e-7)] {
            let reference = signal(&other, if name == "load.tau" { "load" } else { name });
            for (k, (a, b)) in signal(&one, name).iter().zip(reference).enumerate() {
                assert!((a - b).abs() < exact, "{method:?} {name} {k}: {a} {b}");
            }
        }
        assert!((one.energy.input - other.energy.input).abs() < 1e-7);
    }
}

/// A table of torque over speed, in straight lines, is a damper; over speed and a signal, a damper that the signal opens.
#[test]
fn tables_are_the_laws_of_their_points() {
    let speed = |t: f64| 5.0 * (-t * 2.0).exp();
    let curve = "[table.drag]\npoints = { x = [\"-1 rad/s\", \"0 rad/s\", \"3 rad/s\"], value = [\"2 N m\", \"0 N m\", \"-6 N m\"] }\nextrapolation = \"linear\"\n";
    let surface = "[table.drag]\npoints = { x = [\"0 rad/s\", \"10 rad/s\"], y = [\"0\", \"2\"], value = [\"0 N m\", \"0 N m\", \"0 N m\", \"-40 N m\"] }\n";
    for (table, law) in [(curve, "drag(a.w)"), (surface, "drag(a.w, gate)")] {
        let gate = "[signal.gate]\nkind = \"expression\"\nvalue = \"1 + 0 * t / 1 s\"\n";
        let source = format!("{}{table}{gate}", body(law, [0.0, 5.0], 2.0));
        for method in METHODS {
            let run = by(&source, method, 1e-11);
            for (t, found) in run.series.time.iter().zip(signal(&run, "a.w")) {
                assert!((found - speed(*t)).abs() < 1e-8, "{law} {method:?} {t}: {found}");
            }
        }
    }
}

/// A force between two masses and a torque on a row act as they are written: momentum is kept, and what a gear carries is what its load takes.
#[test]
fn reactions_and_rows_carry_what_acts() {
    let source = "[mass.a]\nmass = \"2 kg\"\n[mass.b]\nmass = \"3 kg\"\n[torque.pull]\nmass = \"a\"\nreaction = \"b\"\n\
                  law = \"-40 N/m * (a.s - b.s - 1 m)\"\n[scenario]\nduration = \"2 s\"\ninitial = { \"a.s\" = \"1.5 m\", \"b.v\" = \"1 m/s\" }\n";
    let run = by(source, Method::Automatic, 1e-11);
    let (own, reduced) = (f64::sqrt(40.0 / 1.2), signal(&run, "a.s").iter().zip(signal(&run, "b.s")));
    for (t, (a, b)) in run.series.time.iter().zip(reduced) {
        assert!((2.0 * a + 3.0 * b - 3.0 - 3.0 * t).abs() < 1e-9, "{t}");
        let twist = 0.5 * (own * t).cos() - (own * t).sin() / own;
        assert!((a - b - 1.0 - twist).abs() < 1e-8, "{t}: {}", a - b - 1.0 - twist);
    }
    // A row: the torque acts with its coefficients.
    let rows = |elements: &str| {
        format!(
            "[shaft.a]\ninertia = \"2 kg m^2\"\n[shaft.b]\ninertia = \"3 kg m^2\"\n{elements}[scenario]\nduration = \"2 s\"\n"
        )
    };
    let row = rows("[torque.r]\ncoefficients = { a = 1, b = -3 }\nlaw = \"1 N m * cos(a.phi)\"\n");
    let both = rows(
        "[torque.r]\nshaft = \"a\"\nlaw = \"1 N m * cos(a.phi)\"\n[torque.s]\nshaft = \"b\"\nlaw = \"-3 N m * cos(a.phi)\"\n",
    );
    let [row, both] = [&row, &both].map(|source| by(source, Method::Automatic, 1e-11));
    for name in ["a.w", "b.w"] {
        assert!(signal(&row, name).iter().zip(signal(&both, name)).all(|(a, b)| (a - b).abs() < 1e-9));
    }
    // φ_b = 2 φ_a: the gear gives b what its inertia takes less what acts on it.
    let geared = rows(
        "[gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = \"1/2\"\n[torque.r]\nshaft = \"b\"\nlaw = \"7 N m\"\n",
    );
    let run = by(&geared, Method::Automatic, 1e-11);
    let (a, b) = (signal(&run, "a.w"), signal(&run, "b.w"));
    let ratio = b[50] / a[50];
    let rate = 7.0 * ratio / (2.0 + 3.0 * ratio * ratio);
    let carried = signal(&run, "g.b.tau")[50];
    assert!((carried - (3.0 * ratio * rate - 7.0)).abs() < 1e-9, "{carried} {ratio} {rate}");
}

/// What is at the top falls with the rate of its pole.
#[test]
fn small_motions_are_those_of_the_slopes() {
    let source = body("4 N m * sin(a.phi)", [1e-9, 0.0], 3.0);
    let run = by(&source, Method::Taylor, 1e-13);
    for (t, angle) in run.series.time.iter().zip(signal(&run, "a.phi")) {
        let exact = 1e-9 * (2.0 * t).cosh();
        assert!((angle - exact).abs() < 1e-9 * exact, "{t}: {angle} {exact}");
    }
}

/// A shaft that turns freely, `φ = 5 rad/s · t`, leaves the points of a table over its angle at 1 rad: told once for the table, whoever calls it, with
/// the first row beyond, and by how much at most. One that is not left is not told.
#[test]
fn a_run_reports_which_table_ranges_it_exceeded() {
    let source = "[model]\nname = \"tables\"\n[shaft.a]\ninertia = \"1 kg m^2\"\n[table.left]\n\
                  points = { x = [\"-1 rad\", \"1 rad\"], value = [\"0 N m\", \"0 N m\"] }\n[table.wide]\n\
                  points = { x = [\"0 rad\", \"5 rad\"], y = [\"0 s\", \"1 s\"], value = [\"0 N m\", \"0 N m\", \"0 N m\", \"0 N m\"] }\n\
                  [table.short]\npoints = { x = [\"0 rad\", \"5 rad\"], y = [\"0 s\", \"0.5 s\"], value = [\"0 N m\", \"0 N m\", \"0 N m\", \"0 N m\"] }\n\
                  [torque.one]\nshaft = \"a\"\nlaw = \"left(a.phi) + wide(a.phi, t)\"\n[torque.two]\nshaft = \"a\"\n\
                  law = \"left(2 * a.phi) + short(a.phi, t)\"\n[scenario]\nduration = \"1 s\"\noutput_step = \"10 ms\"\n\
                  initial = { \"a.w\" = \"5 rad/s\" }\n";
    let found = kardan::study::run(source, &kardan::study::Settings::default(), &kardan::study::Silent).expect("a run");
    let reported: Vec<&String> = found.runs[0].notes.iter().filter(|note| note.contains("outside its range")).collect();
    // Of 2 φ = 10 rad/s · t the row after 0.1 s is the first beyond 1 rad, and at the end 10 rad are asked.
    let curve = [
        "`two` read table `left` outside its range from 0.110000 s on: at 1.000000 s by 9.000000 rad above its last point at 1.000000 rad, \
         where the value of that point is used",
    ];
    let short = [
        "`two` read table `short` outside its range along y from 0.510000 s on: at 1.000000 s by 0.500000 s above its last point at 0.500000 s",
    ];
    assert_eq!(reported.len(), 2, "{reported:?}");
    for (note, messages) in reported.iter().zip([curve, short]) {
        messages.iter().for_each(|message| assert!(note.contains(message), "{note}"));
    }
    // A surface that is left along both: each is told, and what holds there.
    let surface = "[shaft.a]\ninertia = \"1 kg m^2\"\n[table.map]\nextrapolation = \"linear\"\n\
                   points = { x = [\"0 rad/s\", \"10 rad/s\"], y = [0, 1], value = [\"0 N m\", \"0 N m\", \"0 N m\", \"0 N m\"] }\n\
                   [torque.e]\nshaft = \"a\"\nlaw = \"map(a.w, 2 + t / 1 s)\"\n[scenario]\nduration = \"1 s\"\ninitial = { \"a.w\" = \"15 rad/s\" }\n";
    let found =
        kardan::study::run(surface, &kardan::study::Settings::default(), &kardan::study::Silent).expect("a run");
    let reported: Vec<&String> = found.runs[0].notes.iter().filter(|note| note.contains("outside its range")).collect();
    let end = "where it is extrapolated linearly (largest of all rows)";
    assert_eq!(
        reported,
        [
            &format!(
                "`e` read table `map` outside its range along x from 0.000000 s on: at 0.000000 s by 5.000000 rad/s above its last point at 10.000000 rad/s, {end}"
            ),
            &format!(
                "`e` read table `map` outside its range along y from 0.000000 s on: at 1.000000 s by 2.000000 above its last point at 1.000000, {end}"
            ),
        ]
    );
    // Within its points nothing is told.
    let slow = source.replace("\"5 rad/s\"", "\"0.5 rad/s\"").replace("\"0.5 s\"", "\"1 s\"");
    let found = kardan::study::run(&slow, &kardan::study::Settings::default(), &kardan::study::Silent).expect("a run");
    assert!(found.runs[0].notes.iter().all(|note| !note.contains("outside its range")));
}

/// Tables that blocks and signals read beyond their points are told too, also where a sensor is what they are read at; those of lanes are not.
#[test]
fn tables_that_blocks_leave_are_reported() {
    let run = |parts: &str| {
        let source = format!(
            "[shaft.a]\ninertia = \"1 kg m^2\"\n[sensor.enc]\nmeasures = \"angle\"\nshaft = \"a\"\n\
             [table.tb]\npoints = {{ x = [\"0 rad\", \"1 rad\"], value = [\"0 N m\", \"1 N m\"] }}\n{parts}\n\
             [scenario]\nduration = \"1 s\"\noutput_step = \"10 ms\"\ninitial = {{ \"a.w\" = \"1 rad/s\" }}\n"
        );
        let found = kardan::study::run(&source, &kardan::study::Settings::default(), &kardan::study::Silent);
        let notes = found.expect("a run").runs.remove(0).notes;
        notes.into_iter().filter(|note| note.contains("outside its range")).collect::<Vec<_>>()
    };
    let block = "[block.l]\nkind = \"table\"\ntable = \"tb\"\nsample_time = \"10 ms\"\ninput = ";
    let signal = "[signal.s]\nkind = \"expression\"\nvalue = ";
    for (parts, who, by) in [
        (format!("{block}\"2 * enc\""), "l", 1.0),
        (
            format!("{block}\"k\"\n[block.k]\nkind = \"gain\"\ninput = \"enc\"\ngain = 2\nsample_time = \"10 ms\""),
            "l",
            1.0,
        ),
        (format!("{signal}\"tb(a.phi + 3 rad)\""), "s", 3.0),
        (format!("{signal}\"tb(a.phi + t * 0.5 rad/s)\""), "s", 0.5),
    ] {
        let reported = run(&parts);
        let end =
            format!("s by {by:.6} rad above its last point at 1.000000 rad, where the value of that point is used");
        assert!(
            reported.len() == 1 && reported[0].contains(&format!("`{who}` read table `tb` outside its range")),
            "{parts}: {reported:?}"
        );
        assert!(reported[0].contains(&end), "{parts}: {reported:?}");
    }
    assert_eq!(run(&format!("{block}\"enc\"\n{signal}\"tb(0.5 * a.phi)\"")), Vec::<String>::new());
    let lanes = "[path.lane]\nkind = \"iso_3888_1\"\nwidth = \"2 m\"\nstart = \"10 m\"\n";
    assert_eq!(
        run(&format!("{lanes}{signal}\"lane(a.phi * 1 m/rad) * 1 / 1 m + tb(0 rad * enc) / 1 N m\"")),
        Vec::<String>::new()
    );
}

/// Where a function has no value a run ends with what it is of, by whatever method, and does not say that something grows.
#[test]
fn an_undefined_law_ends_the_run_by_name() {
    for method in METHODS {
        let settings = Settings { method, ..runs_only() };
        let project = Project::open(body("-1 N m * sqrt(0.5 - t / (1 s))", [0.0, 0.0], 1.0));
        let run = project.run(&settings, &Silent).unwrap_or_else(|why| panic!("{why:?}")).runs.remove(0);
        let Outcome::Failed { time, cause } = &run.outcome else { panic!("{:?}", run.outcome) };
        assert!((time - 0.5).abs() < 1e-3, "{method:?}: {cause}");
        let named = cause.contains("square_root") && cause.contains("it is undefined there");
        let other =
            ["a function is undefined there", "changes at an infinite rate"].iter().any(|text| cause.contains(text));
        assert!(named || other, "{method:?}: {cause}");
        assert!(!(named && cause.contains("the inertia becomes singular")), "{method:?}: {cause}");
    }
}

/// A command that grows with the time at every instant is no linear law: `ẇ + w = 3 t` gives `w = 3 (t − 1 + e⁻ᵗ)`, by itself and through blocks.
#[test]
fn commands_grow_with_the_time() {
    let gain = "[block.b]\nkind = \"gain\"\ninput = \"t\"\ngain = \"3 N m/s\"\n";
    let signal_t = "[signal.x]\nkind = \"expression\"\nvalue = \"t\"\n";
    let from_ramp = |factor: f64| 3.0 * factor * (-1.0_f64).exp();
    for (command, more, expected) in [
        ("3 N m/s*t", "", from_ramp(1.0)),
        ("3 N m/s*(t + x)", signal_t, from_ramp(2.0)),
        ("-3 N m/s*(t - 1 s)", "", 3.0 * (1.0 - (-1.0_f64).exp()) - from_ramp(1.0)),
        ("b", gain, from_ramp(1.0)),
    ] {
        let source = format!(
            "[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"1 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n{more}\
             [control.c]\nlaw = \"program\"\ncommands = {{ m = \"{command}\" }}\n[scenario]\nduration = \"1 s\"\n"
        );
        for method in METHODS {
            let found = *signal(&by(&source, method, 1e-9), "a.w").last().expect("rows");
            assert!((found - expected).abs() < 1e-9, "{command} {method:?}: {found} and not {expected}");
        }
    }
}
