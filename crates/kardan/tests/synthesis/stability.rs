//! One verdict on stability: its words against constructed poles, and the same in text, JSON and certificate.

use kardan::analysis::{Plane, stability_of};
use kardan::num::{Matrix, Rational};
use kardan::results::{Analysis, Design, Margins, Stability, StabilityEvidence};
use kardan::study::{AnalyzeSettings, DesignSettings, Silent, analyze, design};
use proptest::prelude::*;

fn designed(source: &str, settings: &DesignSettings) -> Design {
    let settings = DesignSettings { force: true, ..settings.clone() };
    design(source, &settings, &Silent).unwrap_or_else(|diagnostics| panic!("{diagnostics:?}\n{source}"))
}

fn margins(source: &str) -> Margins {
    designed(source, &DesignSettings::default()).margins.expect("margins")
}

fn analyzed(source: &str, certify: bool) -> Analysis {
    analyze(source, &AnalyzeSettings { certify, ..AnalyzeSettings::default() }, &Silent).expect("an analysis")
}

/// A program law of one motor on one body, or more.
fn program(shafts: &str, command: &str, more: &str) -> String {
    format!(
        "[model]\nname = \"trial\"\n{shafts}\n[control.c]\nlaw = \"program\"\ncommands = {{ m = \"{command}\" }}\n{more}\n\
         [scenario]\nduration = \"1 s\"\n"
    )
}

const RESONATORS: &str = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n\
    [spring_damper.ka]\nshaft_1 = \"a\"\nstiffness = \"1 N m/rad\"\n\
    [spring_damper.kb]\nshaft_1 = \"b\"\nstiffness = \"1 N m/rad\"\n[motor.m]\nshaft = \"b\"";

/// (s² + 1)² with one motion for each double root grows like t; with two motions it is marginal; detuned to 1 and 4 it is marginal with
/// both frequencies.
#[test]
fn equal_resonances_in_a_row_grow_and_beside_each_other_do_not() {
    let found = margins(&program(RESONATORS, "0.1 N m/rad*a.phi", ""));
    assert_eq!((found.stability.word, found.proven, found.stable), (Stability::Unstable, true, Some(false)));
    assert!(
        found.verdict.contains("UNSTABLE (decided exactly") && found.verdict.contains("grows like t"),
        "{}",
        found.verdict
    );
    assert!(found.rates.is_empty() && found.gain_margin.is_none() && found.channels.is_empty());
    let found = margins(&program(RESONATORS, "0 N m/rad*a.phi", ""));
    let border: Vec<(f64, usize, usize)> =
        found.stability.border.iter().map(|motion| (motion.frequency, motion.poles, motion.growth_exponent)).collect();
    assert_eq!((found.stability.word, border), (Stability::Marginal, vec![(1.0, 4, 0)]));
    assert!(found.verdict.contains("marginal") && !found.verdict.contains("UNSTABLE"));
    let detuned = RESONATORS.replacen("1 N m/rad", "4 N m/rad", 1);
    let found = margins(&program(&detuned, "0.1 N m/rad*a.phi", ""));
    let border: Vec<f64> = found.stability.border.iter().map(|motion| motion.frequency).collect();
    assert_eq!((found.stability.word, border), (Stability::Marginal, vec![1.0, 2.0]));
}

/// 0.0005 ± 10j beside 10¹⁵ rad²/s²: unstable by the signs of exact roots, whatever floating point takes for zero.
#[test]
fn a_slow_instability_beside_a_stiff_spring() {
    let shafts = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1e-6 kg m^2\"\n\
        [spring_damper.k]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"1e9 N m/rad\"\ndamping = \"1 N m s/rad\"\n\
        [motor.m]\nshaft = \"a\"";
    for (damping, word) in [("-1e-3", Stability::Unstable), ("1e-3", Stability::Stable), ("0", Stability::Stable)] {
        let found = designed(
            &program(shafts, &format!("-100 N m/rad*a.phi - ({damping})*1 N m s/rad*a.w"), ""),
            &DesignSettings::default(),
        );
        let margins = found.margins.as_ref().expect("margins");
        assert_eq!((margins.stability.word, margins.proven, found.exact_poles), (word, true, true), "{damping}");
        let grows = found.closed_loop_poles.iter().any(|pole| pole.re > 0.0);
        assert_eq!(grows, word == Stability::Unstable, "{:?}", found.closed_loop_poles);
    }
}

/// `z² − (2 − k T²/2 − d T) z + 1 + k T²/2 − d T` with k = 100, T = 10 ms: on the circle for d = k T/2 = 0.5, exactly; within it for more
/// damping, outside for less.
#[test]
fn a_sampled_body_on_the_unit_circle() {
    let shafts = "[shaft.a]\ninertia = \"1 kg m^2\"\n[motor.m]\nshaft = \"a\"";
    let of = |damping: &str| {
        margins(&program(shafts, &format!("-100 N m/rad*a.phi - {damping} N m s/rad*a.w"), "sample_time = \"10 ms\""))
    };
    let found = of("0.5");
    assert_eq!((found.stability.word, found.stability.evidence), (Stability::Marginal, StabilityEvidence::Exactly));
    assert!((found.stability.border[0].frequency - (1.99f64 / 2.0).acos() / 0.01).abs() < 1e-9);
    assert!(found.verdict.contains("marginal (decided exactly)"), "{}", found.verdict);
    for (damping, word) in [("0.50000001", Stability::Stable), ("0.49999999", Stability::Unstable)] {
        let found = of(damping);
        assert_eq!((found.stability.word, found.proven), (word, true), "{damping}: {}", found.verdict);
    }
}

/// A slope of 1e-28 N m/rad makes the linear loop unstable, exactly; nothing in a run grows by it, so that none is refused.
#[test]
fn growth_below_rounding_refuses_no_run() {
    let shafts = "[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"0.1 N m s/rad\"\n[torque.l]\nshaft = \"a\"\n\
                  law = \"0.3 N m/(1 + ((a.phi - 18.75 rad)/(0.31 rad))^16)\"\n[motor.m]\nshaft = \"a\"";
    let source = program(shafts, "-0.2 N m s/rad*a.w", "sample_time = \"0.1 s\"");
    let found = margins(&source);
    assert_eq!(found.stability.word, Stability::Unstable);
    assert!(
        matches!(found.uncontrolled_poles_method, kardan::results::ZeroPoleEvidence::ToRounding(_)),
        "{}",
        found.verdict
    );
    let settings = kardan::study::Settings { runs_only: true, ..kardan::study::Settings::default() };
    let ran = kardan::project::Project::open(&*source).run(&settings, &kardan::study::Silent);
    assert!(ran.is_ok(), "{ran:?}");
}

/// A body with damping of its own, whose exponential is no fraction: certified beside the circle; an oscillator that no law
/// touches is on it, and nothing tells that from the digits of its exponential.
#[test]
fn sampled_loops_with_transcendental_maps() {
    let shafts = "[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"0.3 N m s/rad\"\n[motor.m]\nshaft = \"a\"";
    let clock = "sample_time = \"10 ms\"";
    let of = |shafts: &str, gain: f64| {
        margins(&program(shafts, &format!("-100 N m/rad*a.phi - {gain} N m s/rad*a.w"), clock)).stability
    };
    // The limit of the exact determinant: between 0.19 and 0.21.
    for (gain, word) in [(0.19, Stability::Unstable), (0.21, Stability::Stable)] {
        let found = of(shafts, gain);
        assert_eq!((found.word, found.evidence), (word, StabilityEvidence::Certified), "{gain}");
    }
    let rings = format!(
        "{shafts}\n[shaft.o]\ninertia = \"1 kg m^2\"\n[spring_damper.k]\nshaft_1 = \"o\"\nstiffness = \"30 N m/rad\""
    );
    assert_eq!(of(&rings, 0.5).word, Stability::Undecided);
}

const ARM: &str = "[model]\nname = \"arm\"\n[shaft.arm]\ninertia = \"1 kg m^2\"\ndamping = \"0.1 N m s/rad\"\n\
    [torque.g]\nshaft = \"arm\"\nlaw = \"LAW\"\n[motor.m]\nshaft = \"arm\"\n[scenario]\nduration = \"1 s\"\n\
    [analysis]\nat = { \"arm.phi\" = \"AT deg\" }\ninputs = [\"m\"]\noutputs = [\"arm.phi\"]\n";

/// cos 90° is zero and cos 60° a half: the eigenvalue of a level arm is exactly zero, which decides nothing about the arm; next to 90° the
/// sign of the slope decides. A spring that balances the slope at 60° exactly leaves zero, one at 50° hangs on rounding.
#[test]
fn slopes_at_round_angles_are_exact() {
    let of = |law: &str, at: &str| {
        let found = analyzed(&ARM.replace("LAW", law).replace("AT", at), true);
        (found.properties.expect("properties").stability, found.modes)
    };
    for at in ["90", "-90", "270", "450"] {
        let (found, modes) = of("-9.81 N m*sin(arm.phi)", at);
        assert_eq!((found.word, found.border.len(), modes[0].eigenvalue.abs()), (Stability::Undecided, 1, 0.0), "{at}");
        assert!(found.why.contains("linearisation"), "{}", found.why);
    }
    for (at, word) in [("89", Stability::Stable), ("91", Stability::Unstable), ("0", Stability::Stable)] {
        let (found, _) = of("-9.81 N m*sin(arm.phi)", at);
        assert_eq!(found.word, word, "{at}");
    }
    let balanced = "-10 N m*sin(arm.phi) + 5 N m/rad*arm.phi";
    assert_eq!(of(balanced, "60").1[0].eigenvalue.abs(), 0.0);
    // cos² 30° = 3/4, sin 45° cos 45° = 1/2.
    assert_eq!(of("-8 N m*sin(arm.phi)^2 + 4 N m/rad*(sqrt(3))*arm.phi", "30").0.word, Stability::Undecided);
    assert_eq!(of("-8 N m*sin(arm.phi)*cos(arm.phi) + 4 N m/rad*arm.phi", "30").1[0].eigenvalue.abs(), 0.0);
}

/// A slope that cancels to what rounding leaves of it decides nothing.
#[test]
fn what_hangs_on_rounded_slopes_is_not_decided() {
    // cos 50° = 0.642787609686539326… (Abramowitz and Stegun): the spring balances it to the last digit of a double.
    let law = "-1 N m*sin(arm.phi) + 0.64278760968653932632 N m/rad*arm.phi";
    let found = analyzed(&ARM.replace("LAW", law).replace("AT", "50"), true).properties.expect("properties");
    assert_eq!(found.stability.word, Stability::Undecided, "{}", found.stability);
}

/// From either side Newton's method ends beside a double root, whose slope is zero: not decided, whatever the sign of the residue.
#[test]
fn a_singular_equilibrium_is_not_decided() {
    for start in ["0.3", "-0.3", "0.01"] {
        let source = format!(
            "[model]\nname = \"quad\"\n[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"1 N m s/rad\"\n\
             [torque.g]\nshaft = \"a\"\nlaw = \"-1 N m*a.phi^2/(1 rad^2)\"\n[motor.m]\nshaft = \"a\"\n\
             [scenario]\nduration = \"1 s\"\ninitial = {{ \"a.phi\" = \"{start} rad\" }}\nstart = \"equilibrium\"\n"
        );
        let found = analyzed(&source, false).properties.expect("properties").stability;
        assert_eq!(found.word, Stability::Undecided, "{start}: {found}");
    }
}

/// The joint at 60° has the ratio 1/2 exactly: the two bodies behind it balance a mode at −1/2 that the motor does not reach.
#[test]
fn a_joint_at_sixty_degrees_has_half_the_ratio() {
    let source = "[model]\nname = \"joint\"\n[shaft.a]\ninertia = \"1 kg m^2\"\n\
        [shaft.b]\ninertia = \"4 kg m^2\"\ndamping = \"4 N m s/rad\"\n[shaft.c]\ninertia = \"1 kg m^2\"\n\
        [universal_joint.u]\nshaft_1 = \"b\"\nshaft_2 = \"c\"\nangle = \"60 deg\"\n\
        [spring_damper.k]\nshaft_1 = \"a\"\nshaft_2 = \"c\"\nstiffness = \"1 N m/rad\"\ndamping = \"2 N m s/rad\"\n\
        [motor.m]\nshaft = \"a\"\n[analysis]\ninputs = [\"m\"]\noutputs = [\"a.phi\"]\n[scenario]\nduration = \"1 s\"\n";
    let found = analyzed(source, true);
    assert_eq!((found.structure.controllable_rank, found.structure.observable_rank), (3, 3));
    let properties = found.properties.expect("properties");
    assert_eq!(properties.input_decoupling_zeros.expect("zeros").polynomial, "s + 1/2");
    assert_eq!(
        (properties.stability.word, properties.stability.evidence),
        (Stability::Marginal, StabilityEvidence::Exactly)
    );
}

/// A zero at zero that the outputs do not show at all is a motion behind them.
#[test]
fn zero_dynamics_of_a_level_arm_have_a_zero_at_zero() {
    let source = "[model]\nname = \"zd\"\n[shaft.rot]\ninertia = \"0.01 kg m^2\"\ndamping = \"0.01 N m s/rad\"\n\
        [shaft.arm]\ninertia = \"1 kg m^2\"\ndamping = \"0.1 N m s/rad\"\n\
        [spring_damper.k]\nshaft_1 = \"arm\"\nshaft_2 = \"rot\"\ndamping = \"0.1 N m s/rad\"\n\
        [torque.g]\nshaft = \"arm\"\nlaw = \"-9.81 N m*(sin(arm.phi)-1)\"\n[motor.m]\nshaft = \"rot\"\n\
        [scenario]\nduration = \"1 s\"\n";
    let settings = DesignSettings {
        law: Some("decoupling".into()),
        inputs: vec!["m".into()],
        outputs: vec!["rot.phi".into()],
        at: vec![("arm.phi".into(), "90 deg".into())],
        ..DesignSettings::default()
    };
    let found = designed(source, &settings);
    let stability = &found.zero_dynamics.stability;
    assert_eq!((stability.word, stability.border[0].frequency), (Stability::Marginal, 0.0), "{stability}");
    assert!(!found.verdict().sound && found.verdict().text.contains("the zero dynamics are marginal"));
}

/// With `a` at zero, `b` swings at 1 rad/s and drives `c`, which swings as fast and which `a` does not show: (s² + 1)² with one motion that grows like t.
#[test]
fn what_no_output_shows_may_grow_with_the_zeros() {
    let source = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n[shaft.c]\ninertia = \"1 kg m^2\"\n\
        [spring_damper.s1]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"1 N m/rad\"\n\
        [spring_damper.s2]\nshaft_1 = \"c\"\nstiffness = \"1 N m/rad\"\nDRIVE[motor.m]\nshaft = \"a\"\n[scenario]\nduration = \"1 s\"\n";
    let settings = DesignSettings {
        law: Some("decoupling".into()),
        inputs: vec!["m".into()],
        outputs: vec!["a.phi".into()],
        ..DesignSettings::default()
    };
    let drive = "[torque.t]\nshaft = \"c\"\nlaw = \"0.5 N m/rad*b.phi\"\n";
    for (drive, word, growth) in [(drive, Stability::Unstable, 1), ("", Stability::Marginal, 0)] {
        let found = designed(&source.replace("DRIVE", drive), &settings).zero_dynamics.stability;
        let motion = found.border[0];
        assert_eq!((found.word, motion.poles, motion.growth_exponent), (word, 4, growth), "{found}");
        assert_eq!((motion.frequency, found.evidence), (1.0, StabilityEvidence::Exactly), "{found}");
    }
}

/// The set of stable rates of this loop has a gap at 7.404 Hz (exact sampled map), which steps of 4 % pass over: what is told is
/// stable at all rates above, looked at in steps of 1/1000, and is said to be searched.
#[test]
fn the_slowest_stable_rate_lies_above_islands() {
    let shafts = "[shaft.a0]\ninertia = \"1.0 kg m^2\"\ndamping = \"0.1 N m s/rad\"\n[shaft.a1]\ninertia = \"0.1 kg m^2\"\n\
        [spring_damper.k0]\nshaft_1 = \"a0\"\nshaft_2 = \"a1\"\nstiffness = \"49.0 N m/rad\"\ndamping = \"0.0001 N m s/rad\"\n\
        [motor.m]\nshaft = \"a0\"";
    let source = program(shafts, "-1.0 N m/rad*a0.phi - 1.4 N m s/rad*a0.w", "");
    let found = margins(&source);
    assert!(found.verdict.contains("searched from fast to slow rates in steps of 4 %"), "{}", found.verdict);
    let rate = found.rates[0].rate.expect("a rate");
    assert!(rate > 7.404, "{rate}");
}

/// Words in text, JSON and certificate are the same, over laws and models.
#[test]
fn text_and_json_show_one_verdict() {
    let body = "[shaft.a]\ninertia = \"1 kg m^2\"\n[motor.m]\nshaft = \"a\"";
    let damped = "[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"2 N m s/rad\"\n[motor.m]\nshaft = \"a\"";
    let mut verdicts = std::collections::BTreeSet::new();
    for (shafts, command, more) in [
        (body, "-9 N m/rad*a.phi - 1 N m s/rad*a.w", ""),
        (body, "-9 N m/rad*a.phi", ""),
        (body, "9 N m/rad*a.phi", ""),
        (body, "0 N m", ""),
        (damped, "0 N m", ""),
        (damped, "-0.1 N m/rad*a.phi", "sample_time = \"10 ms\""),
        (damped, "0.1 N m/rad*a.phi", "sample_time = \"10 ms\""),
        (body, "-100 N m/rad*a.phi - 0.5 N m s/rad*a.w", "sample_time = \"10 ms\""),
        (RESONATORS, "0.1 N m/rad*a.phi", ""),
    ] {
        let source = program(shafts, command, more);
        let found = designed(&source, &DesignSettings::default());
        let margins = found.margins.as_ref().expect("margins");
        let json = serde_json::to_value(&found).expect("JSON");
        let word = margins.stability.word();
        assert_eq!(json["margins"]["stability"], word.to_lowercase(), "{command}");
        assert_eq!(json["margins"]["stable"], serde_json::json!(margins.stability.is_stable()), "{command}");
        assert!(margins.verdict.contains(&format!("the loop is {word}")), "{command}: {}", margins.verdict);
        let reported = found.verdict();
        let grows = margins.stability.word == Stability::Unstable;
        assert_eq!(reported.text.contains("the loop is unstable"), grows, "{command}: {}", reported.text);
        assert_eq!(
            reported.sound,
            margins.stable == Some(true) && !margins.low_margins,
            "{command}: {}",
            reported.text
        );
        // The word beside each pole is that of the loop.
        for pole in &found.closed_loop_poles {
            use kardan::results::Motion;
            let motion = found.motion(*pole);
            assert_ne!(motion, Motion::Unknown, "{command}: {pole:?}");
            if margins.stability.word == Stability::Stable {
                assert_eq!(motion, Motion::Decays, "{command}: {pole:?}");
            }
        }
        verdicts.insert(word);
    }
    assert_eq!(verdicts.len(), 3, "{verdicts:?}");
}

/// A block on the diagonal: its matrix, the part of it that decides, and whether it is on the border.
fn block(kind: u8, re: &Rational, im: i64) -> Vec<Vec<Rational>> {
    let im = Rational::from(im);
    let (zero, one) = (Rational::ZERO, Rational::ONE);
    match kind {
        0 => vec![vec![re.clone()]],
        1 => vec![vec![re.clone(), im.clone()], vec![-im, re.clone()]],
        2 => vec![vec![re.clone(), one], vec![zero, re.clone()]],
        _ => {
            let pair = |i: usize, j: usize| match (i % 2, j % 2) {
                (0, 0) | (1, 1) => re.clone(),
                (0, 1) => im.clone(),
                _ => -im.clone(),
            };
            let entry = |i: usize, j: usize| match (i / 2, j / 2) {
                (a, b) if a == b => pair(i, j),
                (0, 1) if i % 2 == j % 2 => one.clone(),
                _ => zero.clone(),
            };
            (0..4).map(|i| (0..4).map(|j| entry(i, j)).collect()).collect()
        }
    }
}

/// Real parts on either side of the axis, on it, and within 10⁻¹⁴ of it; sizes over twelve decades.
fn real_part() -> impl Strategy<Value = Rational> {
    let tiny = Rational::ONE / Rational::from(10i64.pow(15));
    prop_oneof![
        3 => (-1_000_000_000_000i64..=-1).prop_map(Rational::from),
        3 => (1i64..=1_000_000).prop_map(|x| -Rational::ONE / Rational::from(x)),
        2 => Just(Rational::ZERO),
        1 => prop_oneof![Just(-7i64), Just(7)].prop_map(move |x| &tiny * Rational::from(x)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Blocks with known poles, behind a similarity with whole numbers and determinant one: the exact word in continuous time, and behind
    /// `z = (1 + sT/2)/(1 − sT/2)` with T = 2⁻¹⁰ that of the sampled system.
    #[test]
    fn constructed_poles_get_their_word(
        blocks in proptest::collection::vec((0u8..4, real_part(), 1i64..4), 1..4),
        mix in proptest::collection::vec(-2i64..=2, 64),
    ) {
        let all: Vec<Vec<Vec<Rational>>> = blocks.iter().map(|(kind, re, im)| block(*kind, re, *im)).collect();
        let n: usize = all.iter().map(Vec::len).sum();
        let mut a = Matrix::<Rational>::zeros(n, n);
        let mut first = 0;
        for block in &all {
            for (i, row) in block.iter().enumerate() {
                row.iter().enumerate().for_each(|(j, x)| a[(first + i, first + j)] = x.clone());
            }
            first += block.len();
        }
        // Unit lower times unit upper triangle.
        let entry = |i: usize, j: usize| Rational::from(mix[(i * n + j) % mix.len()]);
        let lower = Matrix::from_fn(n, n, |i, j| if i == j { Rational::ONE } else if i > j { entry(i, j) } else { Rational::ZERO });
        let upper = Matrix::from_fn(n, n, |i, j| if i == j { Rational::ONE } else if i < j { entry(i, j) } else { Rational::ZERO });
        let t = lower.multiply(&upper);
        let hidden = t.solve(&a.multiply(&t)).expect("regular");
        let outside = blocks.iter().any(|(_, re, _)| *re > Rational::ZERO);
        let chained = blocks.iter().any(|(kind, re, _)| *re == Rational::ZERO && *kind >= 2);
        let border = blocks.iter().any(|(_, re, _)| *re == Rational::ZERO);
        let expected = match (outside || chained, border) {
            (true, _) => Stability::Unstable,
            (false, true) => Stability::Marginal,
            (false, false) => Stability::Stable,
        };
        let found = stability_of(&hidden, Plane::Continuous);
        prop_assert_eq!(found.word, expected, "{:?}", found);
        let half = hidden.scale(&(Rational::ONE / Rational::from(2048)));
        let one = Matrix::<Rational>::identity(n);
        if let Some(sampled) = one.minus(&half).solve(&one.plus(&half)) {
            let found = stability_of(&sampled, Plane::Discrete);
            prop_assert_eq!(found.word, expected, "{:?}", found);
        }
    }
}
