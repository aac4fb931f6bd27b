//! What a loop tolerates: motions that nobody holds, and margins of gain, phase, delay and disk, alone and together.

use std::f64::consts::PI;

use crate::common;
use faer::linalg::solvers::Solve;
use faer::{Mat, c64};
use kardan::model::builtin;
use kardan::num::{
    Matrix, Polynomial, Random, Rational, characteristic_polynomial, discretise, eigenvalues, rational_from_f64,
};
use kardan::results::{Verdict, ZeroPoleEvidence};
use kardan::study::{DesignSettings, PreparedVariant, Silent, design};
use kardan::synthesis::margins::{Response, channel_margins, multiloop_margin};
use kardan::synthesis::{
    Change, Clock, LoopBlocks, LoopPlant, SampledLoop, SampledPart, Stability, Survey, Wire, exact_motions, stability,
};

/// Three bodies in a row that roll freely, both twists decoupled, behind motors of this lag.
fn driveline([a, b, c]: [&str; 3], lag: &str, clock: &str) -> String {
    let lag = if lag.is_empty() { String::new() } else { format!("lag = \"{lag}\"\n") };
    format!(
        "[model]\nname = \"line\"\n[shaft.a]\ninertia = \"{a} kg m^2\"\n[shaft.b]\ninertia = \"{b} kg m^2\"\n\
         [shaft.c]\ninertia = \"{c} kg m^2\"\n\
         [spring_damper.s1]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"100 N m/rad\"\ndamping = \"1 N m s/rad\"\n\
         [spring_damper.s2]\nshaft_1 = \"b\"\nshaft_2 = \"c\"\nstiffness = \"200 N m/rad\"\ndamping = \"1 N m s/rad\"\n\
         [motor.m1]\nshaft = \"a\"\n{lag}[motor.m2]\nshaft = \"c\"\n{lag}\
         [sensor.t1]\nmeasures = \"torque\"\nelement = \"s1\"\n[sensor.t2]\nmeasures = \"torque\"\nelement = \"s2\"\n\
         [control.law]\nlaw = \"decoupling\"\n{clock}inputs = [\"m1\", \"m2\"]\n\
         [[control.law.channels]]\noutput = \"t1\"\nreference = \"r1\"\n\
         [[control.law.channels]]\noutput = \"t2\"\nreference = \"r2\"\n\
         [scenario]\nduration = \"1 s\"\noutput_step = \"1 ms\"\n"
    )
}

/// Whether the first controller's loop is stable with this lag of its motors: Routh's table over the rationals, on what its
/// outputs show, with the torques as states behind the exact gains.
fn exactly_stable(variant: &PreparedVariant, lag: f64) -> bool {
    let exact = variant.designed[0].exact().expect("exact");
    let (a, b) = (&exact.plant.a, &exact.plant.b);
    let (n, m) = (a.rows(), b.columns());
    // A − B K is known, and B has full column rank.
    let difference = a.minus(&exact.closed.a);
    let k = b.transpose().multiply(b).solve(&b.transpose().multiply(&difference)).expect("independent motors");
    if lag == 0.0 {
        return stability(&characteristic_polynomial(&exact.closed.a)) == Stability::Stable;
    }
    let rate = Rational::ONE / rational_from_f64(lag).expect("finite");
    let whole = Matrix::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
        (true, true) => a[(i, j)].clone(),
        (true, false) => b[(i, j - n)].clone(),
        (false, true) => -(&rate * &k[(i - n, j)]),
        (false, false) if i == j => -rate.clone(),
        _ => Rational::ZERO,
    });
    stability(&characteristic_polynomial(&whole)) == Stability::Stable
}

fn plant(variant: &PreparedVariant) -> LoopPlant {
    let model = &variant.design_models[0];
    LoopPlant::new(&model.linear, &model.lags())
}

/// With no lag, 2 ms and 5 ms, sampled or not: two poles at zero that nobody holds, the rest stable, and the same lag tolerated
/// in continuous time, up to which the exact polynomial is stable.
#[test]
fn a_driveline_that_rolls_on() {
    let settings = DesignSettings { simulate: false, ..DesignSettings::default() };
    for clock in ["", "sample_time = \"100 us\"\ndelay = \"100 us\"\n"] {
        for lag in ["", "2 ms", "5 ms"] {
            let source = driveline(["1", "2", "3"], lag, clock);
            let found = design(&source, &settings, &Silent).expect("a design");
            let margins = found.margins.expect("margins");
            assert_eq!(margins.stable, Some(true), "{clock} {lag}: {}", margins.verdict);
            assert_eq!(
                (margins.uncontrolled_poles, margins.uncontrolled_modes.join(" ").as_str()),
                (2, "a b c"),
                "{clock} {lag}"
            );
            assert!(margins.verdict.contains("Uncontrolled rigid-body motion of `a`, `b` and `c`: 2 poles at zero"));
            let limit = margins.longest_lag.expect("a limit").value;
            if clock.is_empty() {
                let variant = common::first(&source);
                assert!(exactly_stable(&variant, limit * (1.0 - 1e-8)), "{lag}: {limit}");
                assert!(!exactly_stable(&variant, limit * (1.0 + 1e-8)), "{lag}: {limit}");
            }
            assert!((limit - 0.0966).abs() < 2e-3, "{clock} {lag}: {limit}");
        }
    }
}

/// The driveline beside a wheel that turns against this damping only.
fn with_wheel(damping: &str, lag: &str, clock: &str) -> String {
    let wheel = format!("[shaft.d]\ninertia = \"1 kg m^2\"\ndamping = \"{damping} N m s/rad\"\n[motor.m1]");
    driveline(["1", "2", "3"], lag, clock).replace("[motor.m1]", &wheel)
}

/// Three poles at zero, behind motors with and without a lag, sampled or not: as many as the exact polynomial has, whose other
/// factor is strictly stable.
#[test]
fn three_poles_exactly_at_zero() {
    let settings = DesignSettings { simulate: false, ..DesignSettings::default() };
    for (lag, seconds) in [("", 0.0), ("2 ms", 2e-3), ("5 ms", 5e-3)] {
        for clock in ["", "sample_time = \"1 ms\"\ndelay = \"1 ms\"\n"] {
            let source = with_wheel("1", lag, clock);
            let margins = design(&source, &settings, &Silent).expect("a design").margins.expect("margins");
            let at = format!("{lag} {clock} {}", margins.verdict);
            assert_eq!((margins.stable, margins.uncontrolled_poles), (Some(true), 3), "{at}");
            assert_eq!(margins.uncontrolled_poles_method, ZeroPoleEvidence::Design, "{at}");
            assert_eq!(margins.uncontrolled_modes, ["a", "b", "c", "d"], "{at}");
            assert!(margins.verdict.contains("3 poles at zero, exactly"), "{at}");
            // Free motions are marginal; sampled, the others are certified to be inside the circle.
            assert_eq!(margins.stability.word, Stability::Marginal, "{at}");
            assert!(margins.near_zero_poles.is_empty() && margins.proven, "{at}");
        }
        let variant = common::first(&with_wheel("1", lag, ""));
        let model = &variant.design_models[0].linear;
        let lags = [seconds, seconds];
        let found = exact_motions(model, &lags, &variant.designed).expect("finite");
        let polynomial = characteristic_polynomial(&found.matrix);
        let zeros = polynomial.coefficients().iter().take_while(|x| x.is_zero()).count();
        let quotient = Polynomial::new(polynomial.coefficients()[zeros..].to_vec());
        assert_eq!((zeros, stability(&quotient), found.zeros(), found.sampled), (3, Stability::Stable, 3, 3), "{lag}");
        let gone = found.matrix.multiply(&found.matrix.multiply(&found.matrix.multiply(&found.motions)));
        assert!(gone.as_slice().iter().all(|x| x.is_zero()), "{lag}");
        assert!(found.designed);
    }
}

/// A pole at −1e-9 and at 1e-9 1/s is none at zero, with the right word; also where floating point cannot tell the difference.
#[test]
fn next_to_zero_is_not_zero() {
    let settings = DesignSettings { simulate: false, ..DesignSettings::default() };
    for stiff in [false, true] {
        // A wheel that stands alone tells its pole itself, so there are two of them with a spring.
        let pair = "[shaft.e]\ninertia = \"1 kg m^2\"\n[spring_damper.pair]\nshaft_1 = \"d\"\nshaft_2 = \"e\"\nstiffness = \"100 N m/rad\"\n\
                    damping = \"1 N m s/rad\"\n[motor.m1]";
        let source = |damping: &str| {
            let source = with_wheel(damping, "", "").replace("[motor.m1]", pair);
            if stiff { source.replace("\"100 N m/rad\"", "\"1e9 N m/rad\"") } else { source }
        };
        for (damping, zeros) in [("0", 4), ("2e-9", 3)] {
            let margins = design(&source(damping), &settings, &Silent).expect("a design").margins.expect("margins");
            let at = format!("{stiff} {damping}: {} {:?}", margins.verdict, margins.near_zero_poles);
            assert_eq!((margins.uncontrolled_poles, margins.stable, margins.proven), (zeros, Some(true), true), "{at}");
            assert_eq!(margins.uncontrolled_poles_method, ZeroPoleEvidence::Design, "{at}");
            assert!(
                margins.verdict.contains("In continuous time the loop is marginal (decided exactly): a free motion"),
                "{at}"
            );
            if stiff && zeros == 3 {
                assert_eq!(margins.near_zero_poles.len(), 1, "{at}");
                // To what rounding of a stiffness of 1e9 N m/rad leaves of it.
                assert!((margins.near_zero_poles[0] / -1e-9 - 1.0).abs() < 1e-2, "{at}");
                assert!(margins.verdict.contains("indistinguishable from zero in floating point"), "{at}");
            }
        }
        // No model is allowed to make energy, a loop may.
        let variant = common::first(&source("0"));
        let mut model = variant.design_models[0].linear.clone();
        let wheel = model.coordinates.iter().position(|name| name == "d").expect("a coordinate");
        for (sign, expected) in [(Rational::ONE, Stability::Stable), (Rational::NEG_ONE, Stability::Unstable)] {
            model.damping[(wheel, wheel)] = &Rational::ONE + &sign / Rational::from(1_000_000_000);
            let found = exact_motions(&model, &[0.0, 0.0], &variant.designed).expect("finite");
            let word = found.stability().map(|verdict| verdict.excluding_free().word);
            assert_eq!((found.zeros(), word), (3, Some(expected)), "{stiff}");
        }
    }
}

/// Next to the limit of the lag, where a pair crosses the axis within some 1e-11 1/s, the word is that of the exact polynomial.
#[test]
fn next_to_the_axis_is_decided_exactly() {
    let settings = DesignSettings { simulate: false, ..DesignSettings::default() };
    let of = |lag: f64| {
        let source = driveline(["1", "2", "3"], &format!("{lag:?} s"), "");
        let found = design(&source, &settings, &Silent).expect("a design");
        (found.margins.clone().expect("margins"), found, source)
    };
    let limit = of(0.05).0.longest_lag.expect("a limit").value;
    let mut stable = Vec::new();
    for part in [-1e-9, -1e-11, 1e-11, 1e-9] {
        let lag = limit * (1.0 + part);
        let (margins, found, source) = of(lag);
        let expected = exactly_stable(&common::first(&source), lag);
        assert_eq!((margins.stable, margins.proven), (Some(expected), true), "{part}: {}", margins.verdict);
        // Two poles at zero are those of the driveline, which rolls on.
        let word = if expected { "marginal (decided exactly): a free motion" } else { "UNSTABLE (decided exactly)." };
        let sentence = format!("In continuous time the loop is {word}");
        assert!(margins.verdict.contains(&sentence), "{part}: {}", margins.verdict);
        let Verdict { sound: good, text: verdict } = found.verdict();
        assert!(!good && verdict.contains(if expected { "; stable in continuous time" } else { "unstable" }));
        assert!(margins.low_margins == expected, "nothing may change any more");
        assert_eq!(found.warnings.iter().any(|one| one.contains("this is not a design")), !expected);
        stable.push(expected);
    }
    assert_eq!(stable, [true, true, false, false]);
}

/// Random drivelines: the same verdict as that of the exact polynomial, at any lag.
#[test]
fn verdicts_are_those_of_the_exact_polynomial() {
    let mut random = Random::new(11);
    let (mut stable, mut unstable) = (0, 0);
    for _ in 0..8 {
        let inertias: Vec<String> = (0..3).map(|_| format!("{:.3e}", 10f64.powf(4.0 * random.unit() - 3.0))).collect();
        let variant = common::first(&driveline([&inertias[0], &inertias[1], &inertias[2]], "", ""));
        let (laws, plant) = (&variant.designed, plant(&variant));
        let survey = Survey { plant: &plant, laws, clocks: &[None], number: 0, blocks: &LoopBlocks::default() };
        for lag in [0.0, 1e-6, 1e-4, 2e-3, 5e-3, 0.1, 0.3, 0.9] {
            let change = Change { lag: Some(lag), ..survey.unchanged() };
            let found = survey.slowest(change).expect("eigenvalues");
            let expected = exactly_stable(&variant, lag);
            assert_eq!(found.stable, expected, "{inertias:?}, {lag} s: {found:?}");
            assert_eq!(found.free, 2, "{inertias:?}, {lag} s");
            if expected { stable += 1 } else { unstable += 1 }
        }
    }
    assert!(stable > 15 && unstable >= 5, "{stable} {unstable}");
}

/// A free body whose bearing the law balances exactly: at zero twice, sampled too; and a slow motion that is held is none.
#[test]
fn slow_is_not_free() {
    let source = |spring: &str| {
        driveline(["1", "2", "3"], "", "")
            .replace("[motor.m1]", &format!("{spring}[motor.m1]"))
            .replace("[sensor.t1]", "[shaft.ground]\ninertia = \"1e6 kg m^2\"\n[sensor.t1]")
    };
    // The ground rolls too: with a spring of 1e-7 N m/rad between them they swing at some 1e-4 rad/s.
    let weak = "[spring_damper.weak]\nshaft_1 = \"ground\"\nshaft_2 = \"b\"\nstiffness = \"1e-7 N m/rad\"\n";
    let variant = common::first(&source(weak));
    let (laws, plant) = (&variant.designed, plant(&variant));
    for clock in [None, Some(Clock { period: 1e-3, delay: 0.0, single: false })] {
        let survey = Survey { plant: &plant, laws, clocks: &[clock], number: 0, blocks: &LoopBlocks::default() };
        let found = survey.slowest(survey.unchanged()).expect("eigenvalues");
        assert_eq!(found.free, 2, "the whole rolls, the swing is held: {clock:?}");
    }
}

/// An observer that holds its signals over a sample does not balance a free flexspline exactly: it drifts away slowly, which is
/// told as that, with the growth of the map's largest multiplier; the loop is not refused.
#[test]
fn a_free_motion_that_sampling_moves() {
    let source = builtin("harmonic-drive-spring").expect("built in").source;
    let source = source.replace("law = \"decoupling\"\n", "law = \"decoupling\"\nsample_time = \"0.1 ms\"\n");
    let settings =
        DesignSettings { simulate: false, variant: Some("position-observer".into()), ..DesignSettings::default() };
    let margins = design(&source, &settings, &Silent).expect("a design").margins.expect("margins");
    let prepared = common::prepared(&source);
    let variant = prepared.variants.into_iter().find(|variant| variant.name == "position-observer").expect("a variant");
    let (laws, plant) = (&variant.implemented, plant(&variant));
    let parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, &plant)).collect();
    let largest = SampledLoop::new(&plant, &parts).expect("a map").spectral_radius().expect("eigenvalues");
    assert!(margins.stable == Some(true) && margins.uncontrolled_poles == 2 && largest > 1.0, "{}", margins.verdict);
    assert!((largest.ln() / 1e-4 / margins.drift - 1.0).abs() < 1e-3, "{largest} {}", margins.drift);
    assert!(margins.verdict.contains("not quite free"), "{}", margins.verdict);
}

fn system(rows: &[&[f64]]) -> Matrix<f64> {
    Matrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

/// 25/(s³ + 10 s² + 10 s + 10), the example of Seiler, Packard and Gahinet: factor 3.6 at √10 rad/s (closed form), phase and
/// disk from python-control 0.10.2 (`stability_margins`, and the peak of |S − T|/2 to 1e-10).
#[test]
fn the_example_of_the_literature() {
    let open = system(&[&[0.0, 1.0, 0.0], &[0.0, 0.0, 1.0], &[-10.0, -10.0, -10.0]]);
    let (b, c) = (system(&[&[0.0], &[0.0], &[1.0]]), system(&[&[-25.0, 0.0, 0.0]]));
    let closed = open.plus(&b.multiply(&c));
    let found = channel_margins(&Response::continuous(&closed, &b, &c).expect("finite")).expect("margins");
    assert!((found.gain[1] - 3.6).abs() < 1e-9, "{found:?}");
    assert!((found.gain_frequency[1].expect("a frequency") - 10f64.sqrt()).abs() < 1e-7);
    assert!((found.phase.to_degrees() - 29.110369130415705).abs() < 1e-6, "{found:?}");
    assert!((found.phase_frequency.expect("a frequency") - 1.7844356208299719).abs() < 1e-6);
    assert!((found.disk - 0.4580925477415598).abs() < 1e-7, "{found:?}");
    assert!((found.disk_frequency.expect("a frequency") - 1.9550268977247691).abs() < 1e-3);
    // Delay: the phase over its frequency; the loop with it loses its stability there: L(jω) e^(−jωτ) = −1.
    let (delay, omega) = (found.delay.expect("a delay"), found.delay_frequency.expect("a frequency"));
    let s = c64::new(0.0, omega);
    let l = c64::new(25.0, 0.0) / (s * s * s + 10.0 * s * s + 10.0 * s + 10.0) * c64::cis(-omega * delay);
    assert!((l + 1.0).norm_sqr().sqrt() < 1e-9, "{l}");
    // The double integrator under PD control with damping ratio 1: gain from 0 on, phase from its crossing.
    let closed = system(&[&[0.0, 1.0], &[-1.0, -2.0]]);
    let found = channel_margins(
        &Response::continuous(&closed, &system(&[&[0.0], &[1.0]]), &system(&[&[-1.0, -2.0]])).expect("finite"),
    );
    let found = found.expect("margins");
    let crossing = (2.0 + 5f64.sqrt()).sqrt();
    assert!((found.phase - (2.0 * crossing).atan()).abs() < 1e-9 && found.gain[1].is_infinite(), "{found:?}");
}

/// A peak with a damping ratio of 1e-6 beside a slow loop is not missed: closed form α = 1/max|M + ½|.
#[test]
fn a_narrow_peak() {
    let (omega, zeta) = (731.0, 1e-6);
    let a = system(&[&[-1.0, 0.0, 0.0], &[0.0, 0.0, 1.0], &[0.0, -omega * omega, -2.0 * zeta * omega]]);
    let b = system(&[&[1.0], &[0.0], &[1.0]]);
    let c = system(&[&[-0.5, 0.0, -0.01]]);
    let found = channel_margins(&Response::continuous(&a, &b, &c).expect("finite")).expect("margins");
    let at = 0.01 / (2.0 * zeta * omega);
    let s = c64::new(0.0, omega);
    let exact = (c64::new(0.5 - at, 0.0) - c64::new(0.5, 0.0) / (s + 1.0)).norm_sqr().sqrt();
    let frequency = found.disk_frequency.expect("a frequency");
    assert!((found.disk * exact - 1.0).abs() < 1e-6 && (frequency / omega - 1.0).abs() < 1e-6, "{found:?}");
}

/// Structured singular values from SLICOT's AB13MD (slycot 0.7.1, 6001 frequencies, then a bounded search): in the bracket, to
/// 1e-5. The worst errors that are found make the loop singular.
#[test]
fn errors_of_all_channels_at_once() {
    let a = system(&[
        &[0.0, 1.0, 0.0, 0.0, 0.0],
        &[-4.0, -0.4, 1.0, 0.0, 0.0],
        &[0.0, 0.0, 0.0, 1.0, 0.0],
        &[1.0, 0.0, -9.0, -0.3, 0.5],
        &[0.0, 1.0, 0.0, 0.5, -2.0],
    ]);
    let two = [
        system(&[&[0.0, 0.0], &[1.0, 0.5], &[0.0, 0.0], &[0.2, 1.0], &[0.0, 0.3]]),
        system(&[&[-1.0, -0.5, 0.3, 0.0, 0.2], &[0.4, 0.2, -2.0, -0.6, 0.0]]),
    ];
    let three = [
        system(&[&[0.0, 0.0, 0.1], &[1.0, 0.5, 0.0], &[0.0, 0.0, 0.0], &[0.2, 1.0, 0.0], &[0.0, 0.3, 1.0]]),
        system(&[&[-1.0, -0.5, 0.3, 0.0, 0.2], &[0.4, 0.2, -2.0, -0.6, 0.0], &[0.3, 0.1, 0.2, -0.4, -0.7]]),
    ];
    for ([b, c], alpha) in [(two, 0.38190488195509664), (three, 0.3379359157009795)] {
        let response = Response::continuous(&a, &b, &c).expect("finite");
        let found = multiloop_margin(&response).expect("margins");
        assert!(found.disk[0] <= alpha * (1.0 + 1e-5) && alpha <= found.disk[1] * (1.0 + 1e-5), "{found:?} {alpha}");
        assert!(found.disk[1] < 1.002 * found.disk[0], "{found:?}");
        let m = response.at_frequency(found.frequency);
        let n = m.nrows();
        let singular = Mat::from_fn(n, n, |i, j| {
            let error = c64::new(found.worst[i].0 - 1.0, found.worst[i].1);
            c64::new(f64::from(u8::from(i == j)), 0.0) - error * m[(i, j)]
        });
        let least = singular.singular_values().expect("values").into_iter().fold(f64::MAX, f64::min);
        assert!(least < 1e-9, "{least:e}");
    }
}

/// The value of the transfer from errors of a map, by its definition.
fn defined(map: &Matrix<f64>, b: &Matrix<f64>, c: &Matrix<f64>, z: c64) -> c64 {
    let n = map.rows();
    let shifted = Mat::from_fn(n, n, |i, j| {
        let own = if i == j { z } else { c64::new(0.0, 0.0) };
        own - map[(i, j)]
    });
    let x = shifted.partial_piv_lu().solve(Mat::from_fn(n, 1, |i, _| c64::new(b[(i, 0)], 0.0)));
    (0..n).map(|j| x[(j, 0)] * c[(0, j)]).sum()
}

/// A sampled loop, z⁺ = (Φ + k ΓC) z: the factor that is told puts an eigenvalue on the unit circle.
#[test]
fn the_factor_of_a_map_is_at_the_limit() {
    let map = system(&[&[0.9, 0.2, 0.0], &[-0.3, 0.8, 0.1], &[0.1, 0.0, 0.5]]);
    let (b, c) = (system(&[&[0.1], &[0.3], &[0.2]]), system(&[&[-0.7, -0.4, -0.5]]));
    let response = Response::sampled(&map, &b, &c, 0.01).expect("finite");
    for omega in [0.0, 3.0, 100.0, 314.0] {
        let (found, expected) = (response.at_frequency(omega)[(0, 0)], defined(&map, &b, &c, c64::cis(0.01 * omega)));
        assert!((found - expected).norm_sqr().sqrt() < 1e-12, "{omega}: {found} {expected}");
    }
    let found = channel_margins(&response).expect("margins");
    assert!(found.gain[1].is_finite() && found.gain_frequency[1].expect("a frequency") <= PI / 0.01 + 1e-9);
    let at = |factor: f64| {
        let closed = map.plus(&b.multiply(&c).scale(&(factor - 1.0)));
        eigenvalues(&closed).expect("eigenvalues").iter().map(|(re, im)| re.hypot(*im)).fold(0.0, f64::max)
    };
    assert!((at(found.gain[1]) - 1.0).abs() < 1e-9, "{found:?} {}", at(found.gain[1]));
    assert!(at(0.999 * found.gain[1]) < 1.0 && at(1.001 * found.gain[1]) > 1.0);
}

/// The factor of a motor found from the frequency response is that found by search on the exact loop, in continuous time and
/// sampled, with delay, lag and an observer that does not know of it.
#[test]
fn two_ways_to_the_same_factor() {
    let source = builtin("two-bodies").expect("built in").source;
    let head = source.split("[control.").next().expect("a head").split("[scenario]").next().expect("a head");
    let motor = head.lines().find_map(|line| line.strip_prefix("[motor.")).expect("a motor").replace(']', "");
    let shaft = head.lines().filter_map(|line| line.strip_prefix("[shaft.")).next_back().expect("a shaft");
    let shaft = shaft.split(']').next().expect("a name");
    let mut checked = 0;
    for lag in ["", "lag = \"1 ms\"\n"] {
        for clock in ["", "sample_time = \"1 ms\"\n", "sample_time = \"1 ms\"\ndelay = \"700 us\"\n"] {
            for observer in ["", "observer = { sensors = [\"SHAFT.phi\"] }\n"] {
                let text = format!(
                    "{}[control.law]\nlaw = \"decoupling\"\n{clock}{}inputs = [\"{motor}\"]\n[[control.law.channels]]\noutput = \
                     \"{shaft}.phi\"\nreference = \"r\"\nomega = \"5 rad/s\"\n[scenario]\nduration = \"1 s\"\noutput_step = \"1 ms\"\n",
                    head.replace(&format!("[motor.{motor}]\n"), &format!("[motor.{motor}]\n{lag}")),
                    observer.replace("SHAFT", shaft)
                )
                .replace("omega = \"5 rad/s\"\n", "");
                let settings = DesignSettings { simulate: false, force: true, ..DesignSettings::default() };
                let Ok(found) = design(&text, &settings, &Silent) else { continue };
                let margins = found.margins.expect("margins");
                let (Some([down, up]), true) = (margins.gain_margin, margins.stable == Some(true)) else { continue };
                let own = &margins.channels[0];
                assert!(!own.is_sensor && own.name == motor);
                for (search, value) in [(down.value, own.gain[0]), (up.value, own.gain[1])] {
                    if search > 0.0 && search.is_finite() {
                        assert!((search / value - 1.0).abs() < 1e-6, "{lag}{clock}{observer}: {search} {value}");
                        checked += 1;
                    }
                }
            }
        }
    }
    assert!(checked >= 4, "{checked}");
}

/// Two bodies on a spring, each held by its own controller with its own clock.
fn two_clocks(clocks: [&str; 2]) -> String {
    let control = |name: &str, shaft: &str, clock: &str| {
        format!(
            "[control.{name}]\nlaw = \"position_loop\"\n{clock}output = \"{shaft}.phi\"\ninput = \"m{shaft}\"\n\
             natural_frequency = \"40 rad/s\"\ndamping_ratio = 0.5\ninertia = \"1 kg m^2\"\nreference = \"r{shaft}\"\n"
        )
    };
    format!(
        "[model]\nname = \"two\"\n[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n\
         [spring_damper.s]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"30 N m/rad\"\ndamping = \"0.1 N m s/rad\"\n\
         [motor.ma]\nshaft = \"a\"\n[motor.mb]\nshaft = \"b\"\n{}{}[scenario]\nduration = \"1 s\"\noutput_step = \"1 ms\"\n",
        control("left", "a", clocks[0]),
        control("right", "b", clocks[1])
    )
}

/// Those two bodies stepped by the rule of Runge and Kutta, the first motor's torque times a factor and late: the size of the
/// motion at the end over that in the middle.
fn simulated(periods: [f64; 2], factor: f64, late: f64) -> f64 {
    let step = 1e-5;
    let steps = |time: f64| (time / step).round() as usize;
    let law = |q: f64, w: f64| -(1600.0 * q + 40.0 * w);
    let mut x = [1e-3, 0.0, 0.0, 0.0];
    let mut torque = [0.0, 0.0];
    let mut wire = std::collections::VecDeque::new();
    let mut largest = [0.0f64; 2];
    let total = steps(8.0);
    for k in 0..total {
        if k % steps(periods[0]) == 0 {
            wire.push_back((k + steps(late), law(x[0], x[2])));
        }
        while wire.front().is_some_and(|(at, _)| *at <= k) {
            torque[0] = factor * wire.pop_front().expect("not empty").1;
        }
        if k % steps(periods[1]) == 0 {
            torque[1] = law(x[1], x[3]);
        }
        let rate = |x: [f64; 4]| {
            let spring = 30.0 * (x[0] - x[1]) + 0.1 * (x[2] - x[3]);
            [x[2], x[3], torque[0] - spring, torque[1] + spring]
        };
        let moved = |x: [f64; 4], d: [f64; 4], h: f64| [0, 1, 2, 3].map(|i| x[i] + h * d[i]);
        let a = rate(x);
        let b = rate(moved(x, a, 0.5 * step));
        let c = rate(moved(x, b, 0.5 * step));
        let d = rate(moved(x, c, step));
        x = [0, 1, 2, 3].map(|i| x[i] + step / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
        let size = x.iter().fold(0.0f64, |max, x| max.max(x.abs()));
        if k > total / 2 && k < total / 2 + steps(1.0) {
            largest[0] = largest[0].max(size);
        }
        if k >= total - steps(1.0) {
            largest[1] = largest[1].max(size);
        }
    }
    largest[1] / largest[0]
}

/// With one clock and with two the delay and the factor that a motor tolerates are those at which the stepped motion changes from
/// dying out to growing; with three the map agrees just inside and outside.
#[test]
fn a_late_motor() {
    let settings = DesignSettings { simulate: false, force: true, ..DesignSettings::default() };
    for periods in [[4e-3, 4e-3], [4e-3, 10e-3]] {
        let clocks = periods.map(|time| format!("sample_time = \"{} ms\"\n", 1e3 * time));
        let source = two_clocks([&clocks[0], &clocks[1]]);
        let found = design(&source, &DesignSettings { control: Some("left".into()), ..settings.clone() }, &Silent);
        let margins = found.expect("a design").margins.expect("margins");
        assert_eq!(margins.stable, Some(true), "{}", margins.verdict);
        let motor = margins.channels.iter().find(|one| one.name == "ma").expect("known");
        assert_eq!(motor.multirate_search, periods[0] != periods[1]);
        let late = motor.delay.expect("known");
        assert!(late > 1e-3 && late < 0.04, "{late}");
        assert!(simulated(periods, 1.0, 0.98 * late) < 1.0 && simulated(periods, 1.0, 1.02 * late) > 1.0, "{late}");
        let factor = motor.gain[1];
        assert!(factor > 1.2 && factor < 100.0, "{factor}");
        assert!(
            simulated(periods, 0.98 * factor, 0.0) < 1.0 && simulated(periods, 1.02 * factor, 0.0) > 1.0,
            "{factor}"
        );
        let variant = common::first(&source);
        let (laws, plant) = (&variant.implemented, plant(&variant));
        let radius = |delay: f64| {
            let mut parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, &plant)).collect();
            parts[0].wire = Some(Wire { input: 0, delay });
            SampledLoop::new(&plant, &parts).expect("a map").spectral_radius().expect("eigenvalues")
        };
        assert!(radius(late * (1.0 - 1e-9)) < 1.0 && radius(late * (1.0 + 1e-9)) > 1.0, "{late}");
        // The frequency is that of the stepped motion, some 40 rad/s, not one of its aliases.
        let frequency = motor.delay_frequency.expect("known");
        assert!(frequency > 20.0 && frequency < 120.0, "{frequency}");
    }
}

/// The map for complex factors of a motor: at real ones that of a loop whose motor gives so much, and with one clock the phase
/// and the disk of the frequency response.
#[test]
fn complex_factors_of_a_motor() {
    for clocks in [["4 ms", "4 ms"], ["4 ms", "10 ms"]] {
        let source = two_clocks(
            clocks.map(|time| format!("sample_time = \"{time}\"\ndelay = \"1 ms\"\n")).each_ref().map(String::as_str),
        );
        let variant = common::first(&source);
        let (laws, plant) = (&variant.designed, plant(&variant));
        let times = if clocks[0] == clocks[1] { [4e-3, 4e-3] } else { [4e-3, 10e-3] };
        let clocks = times.map(|period| Some(Clock { period, delay: 1e-3, single: false }));
        let survey = Survey { plant: &plant, laws, clocks: &clocks, number: 0, blocks: &LoopBlocks::default() };
        let lifted = survey.lifted(0).expect("a common period");
        for factor in [0.3, 1.0, 1.7, 4.0] {
            let mut parts: Vec<SampledPart> = laws
                .iter()
                .zip(&clocks)
                .map(|(law, clock)| SampledPart::at(&**law, &plant, *clock).expect("finite"))
                .collect();
            parts[0].gains[0] = factor;
            let map = SampledLoop::new(&plant, &parts).expect("a map");
            let expected = map.spectral_radius().expect("eigenvalues").powf(map.period / map.sample_time);
            let found = lifted.radius((factor, 0.0)).expect("eigenvalues");
            assert!((found / expected - 1.0).abs() < 1e-9, "{factor}: {found} {expected}");
        }
        let (phase, disk) = (lifted.phase(), lifted.disk());
        let edge = |angle: f64| lifted.radius((angle.cos(), angle.sin())).expect("eigenvalues");
        assert!(edge(0.999 * phase) < 1.0 && edge(1.001 * phase) > 1.0, "{phase}");
        if times[0] == times[1] {
            let response = survey.motors().expect("one clock");
            let reference = channel_margins(&response.channel(0)).expect("margins");
            assert!((phase - reference.phase).abs() < 1e-6, "{phase} {reference:?}");
            // 25 directions come close, from above.
            assert!(disk > reference.disk * (1.0 - 1e-6) && disk < 1.02 * reference.disk, "{disk} {reference:?}");
        }
    }
}

/// Two bodies on a spring, the far one held by the motor of the near one: the torque may hardly be larger.
fn far(omega: &str, clock: &str) -> String {
    format!(
        "[model]\nname = \"far\"\n[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n\
         [spring_damper.s]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"100 N m/rad\"\ndamping = \"1 N m s/rad\"\n\
         [motor.m]\nshaft = \"a\"\nlag = \"1 ms\"\n[control.far]\nlaw = \"position_loop\"\n{clock}output = \"b.phi\"\n\
         input = \"m\"\nnatural_frequency = \"{omega} rad/s\"\ndamping_ratio = 0.7\ninertia = \"2 kg m^2\"\nreference = \"r\"\n\
         [scenario]\nduration = \"1 s\"\noutput_step = \"1 ms\"\n"
    )
}

/// A loop whose torque may be wrong by a factor between 1.005 and 1.01 before it is unstable is warned of, with factor and
/// frequency, by `check` and by `design` in words and data; the factor is that of the loop's polynomial, put together by
/// hand, and of its map.
#[test]
fn a_small_gain_margin_of_a_torque_is_reported() {
    let settings = DesignSettings { simulate: false, ..DesignSettings::default() };
    let period = 5e-3;
    for (omega, clock) in [("1.4146", ""), ("1.3936", "sample_time = \"5 ms\"\ndelay = \"5 ms\"\n")] {
        let source = far(omega, clock);
        let found = design(&source, &settings, &Silent).expect("a design");
        let margins = found.margins.as_ref().expect("margins");
        let motor = margins.channels.iter().find(|one| !one.is_sensor).expect("a motor");
        let (factor, frequency) = (motor.gain[1], motor.gain_frequency[1].expect("a frequency"));
        assert!(1.005 < factor && factor < 1.01, "{factor}");
        assert!(margins.stable == Some(true) && margins.low_margins);
        let warning = format!(
            "stable with low margins: the torque of `m` times {factor:.4} makes the loop unstable, at {frequency:.4} rad/s"
        );
        assert!(found.warnings.contains(&warning), "{:?}", found.warnings);
        let reported = kardan::study::check(&source);
        let reported = reported.iter().find(|one| one.code == "control::low-margins").expect("a warning of check");
        assert!(reported.message.contains(&warning), "{}", reported.message);
        assert!(!found.verdict().sound, "no good design");
        assert!(
            found.verdict().text.contains("with low margins") && kardan::export::design_json(&found).contains(&warning)
        );
        let w: f64 = omega.parse().expect("a number");
        let unstable = |factor: f64| {
            if clock.is_empty() {
                // s² (s² + 2 s + 200) (T s + 1) + g (s + 100) (2 ω² + 2.8 ω s)
                let (g, t) = (2.0 * factor, 1e-3);
                let p = [
                    g * 100.0 * w * w,
                    g * (w * w + 140.0 * w),
                    200.0 + g * 1.4 * w,
                    2.0 + 200.0 * t,
                    1.0 + 2.0 * t,
                    t,
                ];
                let p = Polynomial::new(p.iter().map(|x| rational_from_f64(*x).expect("finite")).collect());
                return stability(&p) == Stability::Unstable;
            }
            // Angles, speeds, the torque behind the lag; the command waits for a sample.
            let a = system(&[
                &[0.0, 0.0, 1.0, 0.0, 0.0],
                &[0.0, 0.0, 0.0, 1.0, 0.0],
                &[-100.0, 100.0, -1.0, 1.0, 1.0],
                &[100.0, -100.0, 1.0, -1.0, 0.0],
                &[0.0, 0.0, 0.0, 0.0, -1000.0],
            ]);
            let discrete =
                discretise(&a, &system(&[&[0.0], &[0.0], &[0.0], &[0.0], &[1000.0]]), period).expect("finite");
            let k = [0.0, -2.0 * w * w, 0.0, -2.8 * w, 0.0, 0.0];
            let map = Matrix::from_fn(6, 6, |i, j| match (i < 5, j < 5) {
                (true, true) => discrete.a[(i, j)],
                (true, false) => factor * discrete.b[(i, 0)],
                _ => k[j],
            });
            eigenvalues(&map).expect("eigenvalues").iter().any(|(re, im)| re.hypot(*im) > 1.0)
        };
        assert!(!unstable(factor * (1.0 - 1e-6)) && unstable(factor * (1.0 + 1e-6)), "{factor}");
    }
}

/// One body held by its motor.
fn position_loop(damping_ratio: &str, lag: &str, clock: &str) -> String {
    format!(
        "[model]\nname = \"held\"\n[shaft.a]\ninertia = \"1 kg m^2\"\n[motor.m]\nshaft = \"a\"\nlag = \"{lag}\"\n[control.law]\n\
         law = \"position_loop\"\n{clock}output = \"a.phi\"\ninput = \"m\"\nnatural_frequency = \"10 rad/s\"\n\
         damping_ratio = {damping_ratio}\nreference = \"r\"\n[scenario]\nduration = \"1 s\"\noutput_step = \"1 ms\"\n"
    )
}

/// A small phase margin and a small delay margin are warned of though no factor is too much; a good loop is not.
#[test]
fn warnings_have_no_holes() {
    let settings = DesignSettings { simulate: false, ..DesignSettings::default() };
    let warned = |source: &str| {
        let found = design(source, &settings, &Silent).expect("a design");
        let margins = found.margins.expect("margins");
        let motor = margins.channels.iter().find(|one| !one.is_sensor).expect("a motor").clone();
        (found.warnings.join("; "), motor)
    };
    let (text, motor) = warned(&position_loop("0.05", "1 us", ""));
    assert!(motor.gain[1] > 1.1 && motor.phase.to_degrees() < 15.0, "{motor:?}");
    assert!(text.contains("° of phase in the torque of `m` make the loop unstable, at 1"), "{text}");
    let (text, motor) = warned(&position_loop("0.7", "0.1 s", ""));
    assert!(
        motor.delay.expect("known") < 0.025 && text.contains("% of the lag of its motor, 100.000 ms"),
        "{text} {motor:?}"
    );
    let (text, motor) = warned(&position_loop("0.7", "1 us", "sample_time = \"120 ms\"\n"));
    assert!(motor.delay.expect("known") < 0.03 && text.contains("% of one sample, 120.000 ms"), "{text} {motor:?}");
    let (text, motor) = warned(&position_loop("0.7", "1 us", "sample_time = \"1 ms\"\n"));
    assert!(text.is_empty() && motor.delay.expect("known") > 0.01, "{text} {motor:?}");
    let (text, _) = warned(&position_loop("0.7", "1 us", ""));
    assert!(text.is_empty(), "{text}");
    assert!(
        kardan::study::check(&position_loop("0.7", "0.2 s", ""))
            .iter()
            .any(|one| one.code == "control::unstable-continuous")
    );
}

/// A body in a damper whose motor is told by a program, with a block.
fn body(damping: &str, block: &str, command: &str) -> String {
    format!(
        "[model]\nname = \"body\"\n[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"{damping} N m s/rad\"\n[motor.m]\nshaft = \"a\"\n\
         [block.c]\n{block}\n[control.u]\nlaw = \"program\"\ncommands = {{ m = \"{command}\" }}\n[scenario]\nduration = \"1 s\"\n"
    )
}

/// Where a program without a sample time gets one, its commands are held from sample to sample and its blocks go on: with their states beside angle and speed
/// the exact map has its largest eigenvalue on the unit circle at the rate that is told, within it at a faster one and beyond at a slower one.
#[test]
fn the_slowest_rate_of_a_law_with_blocks_is_that_of_the_exact_map() {
    // Rates of [φ; ω; ξ …] under u, and u over the same.
    type Case<'a> = (&'a str, &'a str, &'a str, Vec<Vec<f64>>, Vec<f64>);
    let cases: [Case<'_>; 4] = [
        (
            "0.5",
            "kind = \"low_pass\"\ninput = \"a.w\"\ntime_constant = \"20 ms\"",
            "-20 N m s/rad * c",
            vec![vec![0.0, 1.0, 0.0], vec![0.0, -0.5, 0.0], vec![0.0, 50.0, -50.0]],
            vec![0.0, 0.0, -20.0],
        ),
        (
            "0",
            "kind = \"lead_lag\"\ninput = \"a.phi\"\nlead = \"0.2 s\"\nlag = \"0.02 s\"",
            "-20 N m/rad * c",
            // (1 + 0.2 s)/(1 + 0.02 s) = 10 − 9/(1 + 0.02 s)
            vec![vec![0.0, 1.0, 0.0], vec![0.0, 0.0, 0.0], vec![50.0, 0.0, -50.0]],
            vec![-200.0, 0.0, 180.0],
        ),
        (
            "0.5",
            "kind = \"integrator\"\ninput = \"a.w\"",
            "-20 N m s/rad * a.w - 5 N m/rad * c",
            vec![vec![0.0, 1.0, 0.0], vec![0.0, -0.5, 0.0], vec![0.0, 1.0, 0.0]],
            vec![0.0, -20.0, -5.0],
        ),
        (
            "0",
            "kind = \"transfer_function\"\ninput = \"a.w\"\nzeros = [-0.1381966011250105, -0.3618033988749895]\npoles = [0, 0]",
            "-0.05 N m/(rad s) * c",
            // (1 + 10 s + 20 s²)/s²
            vec![
                vec![0.0, 1.0, 0.0, 0.0],
                vec![0.0, 0.0, 0.0, 0.0],
                vec![0.0, 1.0, 0.0, 0.0],
                vec![0.0, 0.0, 1.0, 0.0],
            ],
            vec![0.0, -1.0, -0.5, -0.05],
        ),
    ];
    let settings = DesignSettings { simulate: false, ..DesignSettings::default() };
    let mut reported = Vec::new();
    for (damping, block, command, rates, feedback) in cases {
        let margins =
            design(&body(damping, block, command), &settings, &Silent).expect("a design").margins.expect("margins");
        let n = feedback.len();
        let a = Matrix::from_fn(n, n, |i, j| rates[i][j]);
        let b = Matrix::from_fn(n, 1, |i, _| f64::from(u8::from(i == 1)));
        // All eigenvalues but that of the angle, on which nothing but the lead depends.
        let radius = |period: f64, late: f64| {
            let discrete = discretise(&a, &b, period).expect("finite");
            let map = Matrix::from_fn(n + 1, n + 1, |i, j| match (i < n, j < n) {
                (true, true) => discrete.a[(i, j)] + if late == 0.0 { discrete.b[(i, 0)] * feedback[j] } else { 0.0 },
                (true, false) => discrete.b[(i, 0)] * late,
                (false, true) => feedback[j] * late,
                (false, false) => 0.0,
            });
            let mut all = eigenvalues(&map).expect("eigenvalues");
            if feedback[0] == 0.0 {
                let free = (0..all.len()).min_by(|x, y| {
                    let far = |k: &usize| (all[*k].0 - 1.0).hypot(all[*k].1);
                    far(x).total_cmp(&far(y))
                });
                all.remove(free.expect("some"));
            }
            all.into_iter().map(|(re, im)| re.hypot(im)).fold(0.0, f64::max)
        };
        for rate in &margins.rates {
            let Some(limit) = rate.rate.filter(|limit| *limit > 0.0) else { continue };
            if rate.delay != 0.5 {
                assert!(
                    (radius(1.0 / limit, rate.delay) - 1.0).abs() < 1e-6,
                    "{block}: {limit} Hz with {}",
                    rate.delay
                );
                assert!(
                    radius(0.99 / limit, rate.delay) < 1.0 && radius(1.01 / limit, rate.delay) > 1.0,
                    "{block}: {limit} Hz"
                );
            }
            reported.push(limit);
        }
    }
    // With all that the integrator takes in between two samples, and from the z-transform of the loop with two integrators.
    assert!(
        reported.iter().any(|limit| (limit - 9.998_97).abs() < 1e-4)
            && reported.iter().any(|limit| (limit - 1.421_638_6).abs() < 1e-5),
        "{reported:?}"
    );
}

/// No rate makes a loop stable that is not so without samples, and none is told.
#[test]
fn an_unstable_loop_has_no_slowest_rate() {
    let source = body("0.5", "kind = \"low_pass\"\ninput = \"a.w\"\ntime_constant = \"20 ms\"", "2 N m s/rad * c");
    let settings = DesignSettings { simulate: false, force: true, ..DesignSettings::default() };
    let margins = design(&source, &settings, &Silent).expect("a design").margins.expect("margins");
    assert!(margins.stable == Some(false) && margins.rates.is_empty(), "{}", margins.verdict);
}

/// Two bodies that turn freely, held by the twist between them: with a factor g of the angle that is read, det of the loop at rest is 1500 (g − 1), so that any
/// factor below one lets them run away; a speed, whose reading the free angle does not change, has margins; and a differentiating filter between does what the speed
/// does.
#[test]
fn a_reading_that_sees_a_free_motion() {
    let settings = DesignSettings { simulate: false, ..DesignSettings::default() };
    let of = |source: &str| design(source, &settings, &Silent).expect("a design").margins.expect("margins").channels;
    let pair = "[model]\nname = \"pair\"\n[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"0.1 N m s/rad\"\n[shaft.b]\ninertia = \"2 kg m^2\"\n\
                damping = \"0.2 N m s/rad\"\n[spring_damper.k]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"50 N m/rad\"\ndamping = \"0.5 N m s/rad\"\n\
                [motor.m]\nshaft = \"a\"\n[control.u]\nlaw = \"program\"\n\
                commands = { m = \"30 N m/rad * (b.phi - a.phi) - 1 N m s/rad * a.w\" }\n[scenario]\nduration = \"1 s\"\n";
    for clock in ["", "sample_time = \"1 ms\"\ndelay = \"1 ms\"\n"] {
        let channels = of(&pair.replace("[scenario]", &format!("{clock}[scenario]")));
        let [motor, at_a, at_b, speed] = &channels[..] else { panic!("{channels:?}") };
        assert!(
            (at_a.gain[0], at_a.gain_frequency[0], at_a.disk) == (1.0, Some(0.0), 0.0) && at_a.gain[1] > 2.0,
            "{clock}: {at_a:?}"
        );
        assert!((at_b.gain[1], at_b.disk) == (1.0, 0.0) && at_b.gain[0] == 0.0, "{clock}: {at_b:?}");
        // Without this speed the bodies' own damping is left.
        assert!(
            speed.gain[0] == 0.0 && speed.gain[1] > 2.0 && speed.disk > 0.3 && motor.disk > 0.3,
            "{clock}: {speed:?}"
        );
    }
    // 0.5 N m s/rad of damping against 0.2 g: up to g = 2.5, and the disk with these ends, (g − 1)·2/(g + 1) = 6/7.
    let filtered =
        body("0.5", "kind = \"transfer_function\"\ninput = \"a.phi\"\nzeros = [0]\npoles = [-50]", "0.2 N m s/rad * c");
    let channels = of(&filtered);
    for one in &channels {
        assert!(
            one.gain[0] == 0.0 && (one.gain[1] - 2.5).abs() < 1e-9 && (one.disk - 6.0 / 7.0).abs() < 1e-9,
            "{one:?}"
        );
    }
    assert_eq!(channels.len(), 2);
}

/// Beside a spring of 1e12 N m/rad, whose motion is a hundred million times faster, the slow motion is not free: a body of 1.000001 kg m² under its law, whose
/// (S − T)/2 has its peak at ω² = K/J in closed form.
#[test]
fn a_stiff_spring_makes_nothing_free() {
    let source = "[model]\nname = \"stiff\"\n[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1e-6 kg m^2\"\n[spring_damper.k]\nshaft_1 = \"a\"\n\
                  shaft_2 = \"b\"\nstiffness = \"1e12 N m/rad\"\ndamping = \"1 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n[control.c]\nlaw = \"program\"\n\
                  commands = { m = \"-100 N m/rad * a.phi - 14 N m s/rad * a.w\" }\n[scenario]\nduration = \"1 s\"\n";
    let settings = DesignSettings { simulate: false, ..DesignSettings::default() };
    let margins = design(source, &settings, &Silent).expect("a design").margins.expect("margins");
    let (j, d, k) = (1.000_001, 14.0, 100.0);
    let x: f64 = k / j;
    let above = (j * x + k).powi(2) + d * d * x;
    let below = (k - j * x).powi(2) + d * d * x;
    let expected = 2.0 * (below / above).sqrt();
    assert!((margins.channels[0].disk / expected - 1.0).abs() < 1e-6, "{:?} {expected}", margins.channels[0]);
    assert_eq!((margins.stable, margins.uncontrolled_poles), (Some(true), 0));
}

/// A filter that is slow beside its sample time keeps its poles: 0.1 N m s of positive feedback of the speed against 0.02387 N m s/rad of damping grow, up to
/// 0.02387 N m s they do not; the angle that nothing holds is the only free motion.
#[test]
fn a_slow_filter_at_a_fast_clock() {
    let source = |gain: &str| {
        format!(
            "[model]\nname = \"t\"\n[shaft.a]\ninertia = \"0.1319 kg m^2\"\ndamping = \"0.02387 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n\
             [block.c]\nkind = \"transfer_function\"\ninput = \"a.phi / (1 rad)\"\nsample_time = \"0.00005 s\"\npoles = [-0.4289, -1.479, -0.8704]\n\
             zeros = [-35.4, 0.0, -35.51]\n[control.u]\nlaw = \"program\"\nsample_time = \"0.00005 s\"\ncommands = {{ m = \"{gain} N m s * c\" }}\n\
             [scenario]\nduration = \"1 s\"\n"
        )
    };
    let settings = DesignSettings { simulate: false, force: true, ..DesignSettings::default() };
    let of = |gain: &str| design(&source(gain), &settings, &Silent).expect("a design").margins.expect("margins");
    let grows = of("0.1");
    assert_eq!((grows.stable, grows.uncontrolled_poles), (Some(false), 1), "{}", grows.verdict);
    // To 60 digits.
    assert!((grows.spectral_radius.expect("known") - 1.000_009_85).abs() < 1e-8, "{:?}", grows.spectral_radius);
    let stays = of("0.001");
    assert_eq!((stays.stable, stays.uncontrolled_poles), (Some(true), 1), "{}", stays.verdict);
    for one in &stays.channels {
        assert!((one.gain[1] / 23.87 - 1.0).abs() < 1e-4, "{one:?}");
    }
}
