//! What a loop tolerates: motions that nobody holds, and margins of gain, phase, delay and disk, alone and together.

mod common;

use std::f64::consts::PI;

use faer::linalg::solvers::Solve;
use faer::{Mat, c64};
use kardan::model::builtin;
use kardan::num::{Matrix, Random, Rational, eigenvalues, rational_from_f64};
use kardan::study::{DesignSettings, PreparedVariant, Silent, design};
use kardan::synthesis::decoupling::characteristic_polynomial;
use kardan::synthesis::margins::{Response, channel_margins, together};
use kardan::synthesis::{Change, Clock, LoopPlant, SampledLoop, SampledPart, Stability, Survey, stability};

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
    let difference = a.plus(&exact.closed.a.scale(&Rational::NEG_ONE));
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
            assert_eq!((margins.free_poles, margins.free.join(" ").as_str()), (2, "a b c"), "{clock} {lag}");
            assert!(margins.verdict.contains("Nobody holds a motion of `a`, `b` and `c`: 2 poles at zero"));
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

/// Random drivelines: the same verdict as that of the exact polynomial, at any lag.
#[test]
fn verdicts_are_those_of_the_exact_polynomial() {
    let mut random = Random::new(11);
    let (mut stable, mut unstable) = (0, 0);
    for _ in 0..8 {
        let inertias: Vec<String> = (0..3).map(|_| format!("{:.3e}", 10f64.powf(4.0 * random.unit() - 3.0))).collect();
        let variant = common::first(&driveline([&inertias[0], &inertias[1], &inertias[2]], "", ""));
        let (laws, plant) = (&variant.designed, plant(&variant));
        let survey = Survey { plant: &plant, laws, clocks: &[None], number: 0 };
        for lag in [0.0, 1e-6, 1e-4, 2e-3, 5e-3, 0.1, 0.3, 0.9] {
            let change = Change { lag: Some(lag), ..survey.unchanged() };
            let found = survey.slowest(change).expect("eigenvalues");
            let expected = exactly_stable(&variant, lag);
            assert_eq!(found.stable, expected, "{inertias:?}, {lag} s: {found:?}");
            assert_eq!(found.free.columns(), 2, "{inertias:?}, {lag} s");
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
        let survey = Survey { plant: &plant, laws, clocks: &[clock], number: 0 };
        let found = survey.slowest(survey.unchanged()).expect("eigenvalues");
        assert_eq!(found.free.columns(), 2, "the whole rolls, the swing is held: {clock:?}");
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
    let (laws, plant) = (&variant.running, plant(&variant));
    let parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, &plant)).collect();
    let largest = SampledLoop::new(&plant, &parts).expect("a map").spectral_radius().expect("eigenvalues");
    assert!(margins.stable == Some(true) && margins.free_poles == 2 && largest > 1.0, "{}", margins.verdict);
    assert!((largest.ln() / 1e-4 / margins.drift - 1.0).abs() < 1e-3, "{largest} {}", margins.drift);
    assert!(margins.verdict.contains("does not stay quite free"), "{}", margins.verdict);
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
    assert!((found.disk_frequency - 1.9550268977247691).abs() < 1e-3);
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
    assert!((found.disk * exact - 1.0).abs() < 1e-6 && (found.disk_frequency / omega - 1.0).abs() < 1e-6, "{found:?}");
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
        let found = together(&response).expect("margins");
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
                assert!(!own.reading && own.name == motor);
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
