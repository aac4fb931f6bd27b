//! Springs in series with Coulomb sliders (Jenkins and Iwan elements), whose middle has no inertia, against closed forms.

use crate::common::{at, close, run_by, signal, time_of};
use kardan::diagnostics::Severity;
use kardan::results::Run;
use kardan::simulate::Method;
use kardan::study;

const METHODS: [Method; 3] = [Method::Taylor, Method::Dop853, Method::Radau];

/// ```text
///   [ a ]~~s~~ m --c--|
/// ```
fn jenkins(k: usize, (s, c): (f64, f64)) -> String {
    format!(
        "[shaft.m{k}]\n[spring_damper.s{k}]\nshaft_1 = \"a\"\nshaft_2 = \"m{k}\"\nstiffness = \"{s} N m/rad\"\n\
         [spring_damper.f{k}]\nshaft_1 = \"m{k}\"\nfriction = \"{c} N m\"\n"
    )
}

/// A body on a spring of its own.
fn body(inertia: f64, stiffness: f64) -> String {
    format!(
        "[shaft.a]\ninertia = \"{inertia} kg m^2\"\n[spring_damper.k]\nshaft_1 = \"a\"\nstiffness = \"{stiffness} N m/rad\"\n"
    )
}

fn scenario(duration: f64, rows: u32, initial: &str) -> String {
    format!(
        "[scenario]\nduration = \"{duration} s\"\noutput_step = \"{} s\"\nrelative_tolerance = 1e-11\ninitial = {{ {initial} }}\n",
        duration / f64::from(rows)
    )
}

/// The slider keeps its place exactly while it sticks, and its springs their torque while it slips.
fn sticks_or_slips(run: &Run, k: usize, c: f64) {
    let [m, w, friction, spring] = [format!("m{k}.phi"), format!("m{k}.w"), format!("f{k}.tau"), format!("s{k}.tau")]
        .map(|name| {
            let name = if name.starts_with('f') { format!("f{k}.friction") } else { name };
            signal(run, &name).to_vec()
        });
    for row in 0..m.len() {
        close(friction[row], spring[row], 1e-9 * c, "nothing has an inertia between");
        assert!(friction[row].abs() <= c * (1.0 + 1e-9), "{}", friction[row]);
        if w[row] == 0.0 {
            continue;
        }
        close(friction[row], c * w[row].signum(), 1e-9 * c, "slips with its friction");
    }
    assert!(w.contains(&0.0) && w.iter().any(|w| *w != 0.0));
    for row in 1..m.len() {
        let (from, to) = (run.series.time[row - 1], run.series.time[row]);
        let event = run.events.iter().any(|event| from <= event.time && event.time <= to);
        if w[row] == 0.0 && w[row - 1] == 0.0 && !event {
            assert_eq!(m[row].to_bits(), m[row - 1].to_bits(), "no creep");
        }
    }
}

/// The area of the hysteresis loop: with the amplitude A each cycle takes `4 c (A − c/s)`. A is kept by a large body.
#[test]
fn loop_takes_its_area_each_cycle() {
    let (s, c, amplitude, cycles) = (500.0, 2.0, 0.01, 5.0);
    let (inertia, omega) = (1e7, 2.0 * std::f64::consts::PI);
    let model = body(inertia, inertia * omega * omega)
        + &jenkins(1, (s, c))
        + &scenario(
            cycles,
            200,
            &format!("\"a.phi\" = \"{amplitude} rad\", \"m1.phi\" = \"{} rad\"", amplitude - c / s),
        );
    for method in METHODS {
        let run = run_by(&model, method, None);
        let area = 4.0 * c * (amplitude - c / s);
        close(run.energy.dissipated, cycles * area, 1e-5 * cycles * area, "4 c (A − c/s)");
        // Of the energy of the body: the loss itself is 1e-8 of it.
        assert!(run.energy.residual.abs() <= 1e-8 * 0.5 * inertia * (omega * amplitude).powi(2), "{:?}", run.energy);
        sticks_or_slips(&run, 1, c);
        let slips = run.events.iter().filter(|event| event.description.starts_with("f1 slips")).count();
        assert_eq!(slips, 10, "twice each cycle: {:?}", run.events);
    }
}

/// From rest in the middle: sticks, slips from `s x = c` on, sticks where the body turns round; in closed form.
#[test]
fn first_slip_begins_and_ends_in_closed_form() {
    let (j, k, s, c, v0): (f64, f64, f64, f64, f64) = (0.8, 30.0, 200.0, 1.5, 0.6);
    let model = body(j, k) + &jenkins(1, (s, c)) + &scenario(6.0, 300, &format!("\"a.w\" = \"{v0} rad/s\""));
    let first = ((k + s) / j).sqrt();
    let begins = (c * first / (s * v0)).asin() / first;
    let (x1, v1, second) = (c / s, v0 * (first * begins).cos(), (k / j).sqrt());
    let ends = begins + (v1 / (second * (x1 + c / k))).atan() / second;
    let top = (x1 + c / k) * (second * (ends - begins)).cos() + v1 / second * (second * (ends - begins)).sin() - c / k;
    for method in METHODS {
        let run = run_by(&model, method, None);
        close(time_of(&run, "f1 slips forward"), begins, 1e-9, "begins");
        close(time_of(&run, "f1 sticks"), ends, 1e-8, "ends");
        sticks_or_slips(&run, 1, c);
        assert!(run.energy.residual.abs() <= 1e-8 * 0.5 * j * v0 * v0, "{:?}", run.energy);
        // What is lost until it sticks first is friction times slip.
        let slip = top - c / s;
        let row = run.series.time.iter().position(|t| *t > ends).expect("a row");
        close(signal(&run, "m1.phi")[row], slip, 1e-9, "the slip");
    }
}

/// Four elements in parallel (Iwan): the first loading is `Σ min(s x, c)`, and unloading follows it twice as long (Masing).
#[test]
fn iwan_follows_masing() {
    let elements = [(100.0, 0.2), (80.0, 0.4), (150.0, 1.2), (60.0, 0.9)];
    let (inertia, omega, amplitude) = (1e7, 2.0 * std::f64::consts::PI, 0.01);
    let mut model = body(inertia, inertia * omega * omega);
    elements.iter().enumerate().for_each(|(k, element)| model += &jenkins(k, *element));
    model += &scenario(0.75, 150, &format!("\"a.w\" = \"{} rad/s\"", amplitude * omega));
    for method in METHODS {
        let run = run_by(&model, method, None);
        for (row, time) in run.series.time.iter().enumerate() {
            let x = signal(&run, "a.phi")[row];
            for (k, (s, c)) in elements.iter().enumerate() {
                let loading = |x: f64| (s * x).min(*c);
                let expected =
                    if *time <= 0.25 { loading(x) } else { loading(amplitude) - 2.0 * loading((amplitude - x) / 2.0) };
                close(signal(&run, &format!("s{k}.tau"))[row], expected, 1e-6, &format!("s{k} at {time}"));
            }
        }
    }
}

/// A slider between two bodies, beside ordinary friction and a torque: the balance of energy closes, all methods agree.
#[test]
fn jenkins_element_between_bodies_balances() {
    let model = "[shaft.a]\ninertia = \"0.5 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\nfriction = \"0.3 N m\"\n[shaft.m]\n\
        [spring_damper.s]\nshaft_1 = \"a\"\nshaft_2 = \"m\"\nstiffness = \"40 N m/rad\"\n\
        [spring_damper.f]\nshaft_1 = \"m\"\nshaft_2 = \"b\"\nfriction = \"1 N m\"\n\
        [spring_damper.k]\nshaft_1 = \"b\"\nstiffness = \"5 N m/rad\"\ndamping = \"0.1 N m s/rad\"\n[motor.drive]\nshaft = \"a\"\n"
        .to_string()
        + &scenario(8.0, 80, "\"a.w\" = \"4 rad/s\"")
        + "[[scenario.event]]\nat = \"2 s\"\nsignal = \"drive.tau\"\nto = \"-2 N m\"\n[[scenario.event]]\nat = \"4 s\"\nsignal = \"drive.tau\"\nto = \"0.4 N m\"\n";
    let first = run_by(&model, Method::Taylor, None);
    let scale = first.energy.dissipated;
    assert!(scale > 1.0 && first.events.len() > 6, "{:?}", first.events);
    for method in METHODS {
        let run = run_by(&model, method, None);
        assert!(run.energy.residual.abs() <= 1e-8 * scale, "{:?}", run.energy);
        for time in [1.0, 3.0, 5.0, 8.0] {
            for name in ["a.phi", "b.phi", "m.phi", "f.friction", "s.tau"] {
                close(at(&run, name, time), at(&first, name, time), 1e-6, &format!("{name} at {time}"));
            }
        }
    }
}

/// What would jump, or what sliders hold together, is refused by name.
#[test]
fn what_jumps_is_refused() {
    let refused = |model: &str, fragments: &[&str]| {
        let found = study::check(&(body(1.0, 10.0) + &jenkins(1, (20.0, 1.0)) + model));
        let errors: Vec<_> = found.iter().filter(|one| one.severity == Severity::Error).collect();
        assert_eq!(errors.len(), 1, "{found:#?}");
        for fragment in fragments {
            assert!(errors[0].message.contains(fragment), "{fragment}: {}", errors[0].message);
        }
        assert!(errors[0].help.is_some() && !errors[0].labels.is_empty());
    };
    refused("[motor.push]\nshaft = \"m1\"\n", &["`m1`", "`f1`", "`push`", "jump"]);
    refused(&scenario(1.0, 10, "\"a.phi\" = \"0.1 rad\""), &["2.000000", "`f1`", "sticks up to 1.0"]);
    refused(
        "[spring_damper.d]\nshaft_1 = \"m1\"\ndamping = \"1 N m s/rad\"\n",
        &["`m1`", "the friction of `f1` and the damping of `d` both act on it"],
    );
    let falls = "[shaft.n]\n[spring_damper.t]\nshaft_1 = \"a\"\nshaft_2 = \"n\"\nstiffness = \"1 N m/rad\"\n\
        [spring_damper.g]\nshaft_1 = \"n\"\nfriction = \"1 N m\"\nbreakaway = \"2 N m\"\nstribeck_speed = \"1 rad/s\"\n";
    refused(falls, &["the friction of `g` falls", "`breakaway`", "not determined"]);
    // Two frictions in series, of which either may slip.
    let series = "[shaft.n]\n[shaft.o]\n[spring_damper.t]\nshaft_1 = \"a\"\nshaft_2 = \"n\"\nstiffness = \"1 N m/rad\"\n\
        [spring_damper.g]\nshaft_1 = \"n\"\nshaft_2 = \"o\"\nfriction = \"1 N m\"\n[spring_damper.h]\nshaft_1 = \"o\"\nfriction = \"2 N m\"\n";
    refused(series, &["`g`, `h`", "slip against each other without a spring"]);
    let relaxes = "[shaft.n]\n[spring_damper.t]\nshaft_1 = \"m1\"\nshaft_2 = \"n\"\nstiffness = \"1 N m/rad\"\n\
        [spring_damper.d]\nshaft_1 = \"n\"\ndamping = \"1 N m s/rad\"\n";
    refused(relaxes, &["`f1`", "with a damper"]);
}
