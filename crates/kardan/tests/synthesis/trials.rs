//! Small inputs that a tool answered wrongly without a word, with the right answers: closed forms, exact arithmetic, roots of polynomials in 60 digits,
//! integrators of their own. The inputs are in `tests/trials`; those of geared drives and of cars with road load are in `contacts.rs` and in the
//! analysis tests.

use std::f64::consts::PI;
use std::path::Path;

use kardan::project::Project;
use kardan::results::{Analysis, ChannelMargin, Design, Margins, Outcome, Run, Stability, StabilityEvidence};
use kardan::simulate::Method;
use kardan::study::{self, AnalyzeSettings, DesignSettings, Settings, Silent, check};

use crate::common::{close, signal};

fn bytes(name: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/trials").join(name);
    std::fs::read(&path).unwrap_or_else(|why| panic!("{}: {why}", path.display()))
}

fn source(name: &str) -> String {
    String::from_utf8(bytes(&format!("{name}.toml"))).expect("a text")
}

fn run(source: &str, method: Method) -> Run {
    let settings = Settings { method, runs_only: true, ..Settings::default() };
    Project::open(source).run(&settings, &Silent).unwrap_or_else(|wrong| panic!("{wrong:?}")).runs.remove(0)
}

fn ends(run: &Run, name: &str) -> f64 {
    *signal(run, name).last().expect("rows")
}

fn designed(source: &str, settings: DesignSettings) -> Design {
    let settings = DesignSettings { force: true, ..settings };
    study::design(source, &settings, &Silent).unwrap_or_else(|wrong| panic!("{wrong:?}"))
}

fn margins(name: &str) -> Margins {
    designed(&source(name), DesignSettings::default()).margins.expect("margins")
}

fn analyzed(source: &str) -> Analysis {
    study::analyze(source, &AnalyzeSettings::default(), &Silent).unwrap_or_else(|wrong| panic!("{wrong:?}"))
}

fn stability(analysis: &Analysis) -> Stability {
    analysis.properties.as_ref().expect("properties").stability.word
}

const METHODS: [Method; 3] = [Method::Taylor, Method::Dop853, Method::Radau];

#[test]
fn nothing_is_passed_over_in_a_run() {
    for method in METHODS {
        let of = |name: &str| {
            let run = run(&source(name), method);
            assert_eq!(run.outcome, Outcome::Completed, "{name} {method:?}");
            run
        };
        close(ends(&of("gust"), "a.w"), 0.5 * PI.sqrt(), 1e-9, "the impulse of the gust");
        close(ends(&of("switch"), "a.w"), 5.0, 1e-8, "the impulse behind the switch");
        let braked = of("braking");
        close(ends(&braked, "i4.phi"), 50.000_003_289_868, 1e-9, "where the brake stops it");
        assert!(signal(&braked, "i4.w").iter().all(|w| *w > -1e-9), "{method:?}");
        // Integrated by steps of their own, once with the stiff pair beside it and once without.
        for dips in ["dip-0.1", "dip-stiff"] {
            close(ends(&of(dips), "a.phi"), 0.021_745_704_55, 1e-10, "slips at each dip");
        }
        close(ends(&of("dip-0.01"), "a.phi"), 2.447_135_29e-4, 1e-12, "slips at each dip");
    }
    // Two inertias of 1 kg m² at 100 rad/s under −10 tanh(w/0.05) N m: 200 N m s are used up after 20 s.
    for method in [Method::Radau, Method::Automatic] {
        let stopped = run(&source("radau"), method);
        assert_eq!(stopped.outcome, Outcome::Completed);
        assert!(signal(&stopped, "a.w").last().is_some_and(|w| (0.0..0.1).contains(w)), "{method:?}");
    }
}

/// What one contact gives back does not depend on whether another one closes at the same instant with this speed or one a little larger.
#[test]
fn impacts_have_their_restitution_and_cars_tip() {
    let base = source("rebound-chain");
    let after = |speed: &str| {
        let run = run(&base.replace("vc = \"0.3 m/s\"", &format!("vc = \"{speed} m/s\"")), Method::Taylor);
        let speeds = ["a.v", "b.v", "c.v"].map(|name| ends(&run, name));
        let momentum = 0.5 * speeds[0] + 0.8 * speeds[1] + speeds[2];
        close(momentum, 0.5 + speed.parse::<f64>().expect("a number"), 1e-12, "the momentum");
        speeds
    };
    let (below, above) = (after("0.29"), after("0.31"));
    below.iter().zip(above).for_each(|(one, other)| assert!((one - other).abs() < 0.03, "{below:?} {above:?}"));
    assert!(below[1] - below[0] > 0.5 * 0.8, "given back: {below:?}");
    let tips = run(&source("car-tips"), Method::Taylor);
    assert!(tips.warnings.iter().any(|note| note.contains("a real car rolls over there")), "{:?}", tips.warnings);
}

#[test]
fn names_of_variants_are_preserved() {
    let study = Project::open(source("variant-names")).run(&Settings::default(), &Silent).expect("a study");
    let names: Vec<&str> = study.runs.iter().map(|run| run.name.as_str()).collect();
    assert_eq!(names, ["ECU-on-soft", "ECU-off", "ECU-on-hard"]);
}

#[test]
fn all_factors_take_one_side_of_a_kink() {
    let spring = source("signed-spring");
    for law in
        ["sign(a.phi) * abs(a.phi)", "sign(a.phi) * sqrt(a.phi^2)", "if(a.phi > 0 rad, 1, -1) * abs(a.phi)", "a.phi"]
    {
        let found = analyzed(&spring.replace("sign(a.phi) * abs(a.phi)", law));
        assert_eq!((stability(&found), found.modes.len()), (Stability::Stable, 1), "{law}");
        close(found.modes[0].eigenvalue.re, -0.5, 1e-12, law);
        close(found.modes[0].eigenvalue.im.abs(), 99.75f64.sqrt(), 1e-12, law);
        assert_eq!(found.opposite_side, None);
    }
    let assist = source("assist-sampled");
    let radius = |law: &str| {
        let found = designed(&assist.replace("LAW", law), DesignSettings::default()).margins.expect("margins");
        assert_eq!(found.stable, Some(false), "{law}");
        found.spectral_radius.expect("a sampled loop")
    };
    let plain = radius("6 * felt");
    for law in ["sign(felt) * 6 * abs(felt)", "if(felt > 0 N m, 1, -1) * 6 * abs(felt)"] {
        close(radius(law), plain, 1e-12, law);
    }
    let table = source("dual-pinion-table");
    let signed = table
        .replace("input = \"assist_map(felt, car.v_x)\"", "input = \"sign(felt) * assist_map(abs(felt), car.v_x)\"");
    assert_ne!(signed, table);
    let [one, other] =
        [table, signed].map(|source| designed(&source, DesignSettings::default()).margins.expect("margins"));
    assert!(one.channels.len() == other.channels.len() && !one.channels.is_empty());
    one.channels.iter().zip(&other.channels).for_each(|(one, other)| close(one.disk, other.disk, 1e-9, "disk margins"));
}

#[test]
fn margins_and_rates_are_right() {
    let rate = |name: &str, delay: f64| {
        let found = margins(name).rates.into_iter().find(|one| one.delay == delay).expect("a rate");
        found.rate.expect("a rate below 1 MHz")
    };
    assert!(rate("rate-low-pass", 0.0) < 14.0 && rate("rate-lead-lag", 0.0) < 10.0);
    close(rate("rate-integrator", 0.0), 9.999, 1e-4, "rates of an integrator");
    close(rate("rate-triple-integrator", 1.0), 1.421_64, 1e-4, "rates of three integrators");
    // Unstable at 7.404 Hz: stable rates are islands.
    assert!(rate("rate-island", 0.0) > 7.404);
    let channel = |name: &str, reading: &str| -> ChannelMargin {
        let found = margins(name).channels.into_iter().find(|one| one.name == reading);
        found.unwrap_or_else(|| panic!("{name} has no {reading}"))
    };
    // det S = 1500 (g − 1).
    close(channel("reading-free-motion", "a.phi").gain[0], 1.0, 1e-9, "factors below one");
    for side in ["m", "a.phi"] {
        let found = channel("reading-free-speed", side);
        close(found.gain[1], 2.5, 1e-9, side);
        close(found.disk, 6.0 / 7.0, 1e-9, side);
        let found = channel("fast-pole", side);
        close(found.disk, 1.858_52, 1e-5, side);
        close(found.phase, 2.497_67, 1e-5, side);
        close(channel("rigid-spring-margin", "m").disk, 1.146_92, 1e-5, "60 digits");
    }
    // Its slow motions lose no digits beside the fast pole: maps with 60 digits.
    close(rate("fast-pole", 0.0), 30.903_977_632_5, 1e-4, "the rate with a fast pole");
    for (clock, radius) in [("31 ms", 0.980_864_523_232), ("10 ms\"\ndelay = \"5 ms", 0.987_068_598_958)] {
        let sampled =
            source("fast-pole").replace("law = \"program\"", &format!("law = \"program\"\nsample_time = \"{clock}\""));
        let found = designed(&sampled, DesignSettings::default()).margins.expect("margins");
        assert_eq!((found.stable, found.uncontrolled_poles), (Some(true), 0), "{clock}");
        close(found.spectral_radius.expect("sampled"), radius, 1e-6, clock);
    }
    let slow = source("slow-filter-fast-clock");
    let limit = designed(&slow, DesignSettings::default()).margins.and_then(|found| found.gain_margin).expect("stable");
    close(limit[1].value, 23.87, 1e-4, "the limit of the factor");
    let grows =
        designed(&slow.replace("0.001 N m s", "0.1 N m s"), DesignSettings::default()).margins.expect("margins");
    assert_eq!(grows.stable, Some(false));
    close(grows.spectral_radius.expect("sampled") - 1.0, 9.85e-6, 1e-8, "60 digits");
}

#[test]
fn claims_of_certainty_are_earned() {
    for (name, word) in [
        ("double-resonance", Stability::Unstable),
        ("stiff-unstable", Stability::Unstable),
        ("sampled-on-the-circle", Stability::Marginal),
        ("rate-island", Stability::Stable),
        ("rigid-spring-margin", Stability::Stable),
    ] {
        assert_eq!(margins(name).stability.word, word, "{name}");
    }
    assert_eq!(stability(&analyzed(&source("arm-level"))), Stability::Undecided);
    let quadratic = source("singular-equilibrium");
    for start in ["0.3 rad", "-0.3 rad"] {
        assert_eq!(stability(&analyzed(&quadratic.replace("0.3 rad", start))), Stability::Undecided, "from {start}");
    }
    let level = DesignSettings {
        law: Some("decoupling".into()),
        inputs: vec!["m".into()],
        outputs: vec!["rot.phi".into()],
        at: vec![("arm.phi".into(), "90 deg".into())],
        ..DesignSettings::default()
    };
    let found = designed(&source("zero-dynamics-level"), level);
    let zeros = &found.zero_dynamics;
    assert_eq!(zeros.stability.word, Stability::Marginal, "{}", zeros.stability);
    // The pole at zero is one that no output shows, beside the root of the polynomial.
    assert_eq!((zeros.modes.len(), found.hidden.len()), (1, 1));
    // A torque that is zero everywhere; what rounding leaves of its slope is a number with few digits.
    for size in ["1", "1e9", "1e14"] {
        let cancelled = format!(
            "[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"1 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n[torque.t]\nshaft = \"a\"\n\
             law = \"{size} N m * (sin(2 * a.phi)/2 - sin(a.phi) * cos(a.phi))\"\n[control.c]\nlaw = \"program\"\nat = {{ \"a.phi\" = \"1 rad\" }}\n\
             commands = {{ m = \"-0.5 N m s/rad * a.w\" }}\n[analysis]\nat = {{ \"a.phi\" = \"1 rad\" }}\n"
        );
        assert_eq!(stability(&analyzed(&cancelled)), Stability::Undecided, "{size}");
        for clock in ["", "commands = { m = \"0 N m\" }\nsample_time = \"10 ms\""] {
            let sampled = match clock {
                "" => cancelled.clone(),
                clock => cancelled.replace("commands = { m = \"-0.5 N m s/rad * a.w\" }", clock),
            };
            let found = designed(&sampled, DesignSettings::default()).margins.expect("margins");
            assert_eq!(found.stability.word, Stability::Undecided, "{size} {clock}: {}", found.stability);
        }
    }
    // The same as a command, at every instant and sampled, and through a signal.
    let cancelled = "1e9 N m * (sin(2 * a.phi)/2 - sin(a.phi) * cos(a.phi))";
    let signal = format!("[signal.s]\nkind = \"expression\"\nvalue = \"{cancelled}\"\n");
    for (command, signal) in [(cancelled, ""), ("s", &*signal)] {
        for clock in ["", "sample_time = \"10 ms\"\n"] {
            let source = format!(
                "[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"1 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n\
                 [control.c]\nlaw = \"program\"\nat = {{ \"a.phi\" = \"1 rad\" }}\n\
                 commands = {{ m = \"{command} - 0.5 N m s/rad * a.w\" }}\n{clock}{signal}"
            );
            let found = designed(&source, DesignSettings::default()).margins.expect("margins");
            assert_eq!(found.stability.word, Stability::Undecided, "{command} {clock}: {}", found.stability);
            assert_eq!(found.stable, None);
        }
    }
    // Rounded slopes that do not matter are tried.
    let bent = "[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"1 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n\
                [control.c]\nlaw = \"program\"\nat = { \"a.phi\" = \"1 rad\" }\n\
                commands = { m = \"-4 N m * exp(a.phi/(1 rad)) + 1e3 N m * (sin(2 * a.phi)/2 - sin(a.phi) * cos(a.phi))\" }\nsample_time = \"10 ms\"\n";
    let found = designed(bent, DesignSettings::default()).margins.expect("margins");
    assert_eq!(found.stability.word, Stability::Stable, "{}", found.stability);
    assert!(matches!(found.stability.evidence, StabilityEvidence::DespiteRounding | StabilityEvidence::Tried));
    // Free motions of a sampled loop are counted exactly: one verdict for its poles.
    let free = "[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"1 N m s/rad\"\n[shaft.b]\ninertia = \"2 kg m^2\"\n[motor.m]\nshaft = \"a\"\n\
                [control.u]\nlaw = \"program\"\nsample_time = \"1 ms\"\ncommands = { m = \"-3 N m s/rad * a.w - 10 N m/rad * a.phi\" }\n";
    let found = designed(free, DesignSettings::default()).margins.expect("margins");
    assert_eq!((found.stability.word, found.stable, found.uncontrolled_poles), (Stability::Marginal, Some(true), 2));
    let holonomic = |name: &str| {
        let class = analyzed(&source(name)).class.expect("a class");
        class.constraints.iter().find(|one| one.element == "c").and_then(|one| one.holonomic)
    };
    assert_eq!(
        [holonomic("frobenius-prime"), holonomic("coefficient-two"), holonomic("holonomic-exp")],
        [Some(false), Some(true), Some(true)]
    );
    let dependent = check(&source("dependent-rates"));
    let found = dependent.iter().find(|one| one.code == "constraint::dependent").expect("a dependent row");
    assert!(found.message.contains("at every position `c1` is a multiple of `c2`"), "{found}");
    let tiny =
        study::analyze_state_space(&bytes("underflow.json"), &AnalyzeSettings::default(), &Silent).expect("small");
    assert!(tiny.structure.controllable());
    let distance = tiny.matrix_distance.and_then(|found| found.controllability).expect("a distance");
    assert!(distance.lower > 1e-166 && distance.upper <= 5.001e-166, "{distance:?}");
}

/// The slopes at an operating point that is written as a decimal are those at the decimal, not at the nearest double: the square of a difference
/// that is zero there has none.
#[test]
fn operating_points_are_the_decimals_that_they_are_written_as() {
    let square = |by: &str, of: &str, value: &str, law: &str| {
        format!(
            "[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"1 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n[torque.t]\nshaft = \"a\"\n\
             law = \"1e9 N m * (({of} - {value})/({by}))^2{law}\"\n[control.c]\nlaw = \"program\"\ncommands = {{ m = \"0 N m\" }}\n\
             at = {{ \"{of}\" = \"{value}\" }}\n[analysis]\nat = {{ \"{of}\" = \"{value}\" }}\n"
        )
    };
    for value in ["0.1 rad", "0.3 rad", "0.7 rad", "1.234567 rad"] {
        let found = stability(&analyzed(&square("1 rad", "a.phi", value, "")));
        assert!(matches!(found, Stability::Marginal | Stability::Undecided), "{value}: {found:?}");
    }
    for value in ["0.1 rad/s", "0.3 rad/s", "20 rad/s"] {
        let found = designed(&square("1 rad/s", "a.w", value, " - 1 N m s/rad * a.w"), DesignSettings::default());
        let found = found.margins.expect("margins").stability;
        assert_eq!((found.word, found.evidence), (Stability::Marginal, StabilityEvidence::Exactly), "{value}: {found}");
    }
}
