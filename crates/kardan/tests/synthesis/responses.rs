//! Identities of frequency responses, singular values and steps of loops.

use std::f64::consts::{PI, TAU};

use faer::c64;
use kardan::model::builtin;
use kardan::num::{Matrix, Random, discretise, eigenvalues};
use kardan::results::{LoopFunction, LoopResponses};
use kardan::study::{DesignSettings, Silent, design};
use kardan::synthesis::margins::{FrequencyError, Response, channel_margins};

fn drawn(random: &mut Random, rows: usize, columns: usize) -> Matrix<f64> {
    Matrix::from_fn(rows, columns, |_, _| 2.0 * random.unit() - 1.0)
}

/// A loop gain with so many states and channels, its poles moved by this much.
fn loop_gain(random: &mut Random, states: usize, channels: usize, shift: f64) -> Response {
    let a = drawn(random, states, states).plus(&Matrix::identity(states).scale(&shift));
    let (b, c) = (drawn(random, states, channels), drawn(random, channels, states));
    Response::continuous(&a, &b, &c).expect("finite")
}

fn responses(model: &str) -> LoopResponses {
    let source = builtin(model).expect("built in").source;
    design(source, &DesignSettings::default(), &Silent).expect("a design").responses.expect("one sample time")
}

#[test]
fn sensitivity_and_complementary_sensitivity_add_up_to_one() {
    let mut random = Random::new(18);
    for _ in 0..20 {
        let gain = loop_gain(&mut random, 5, 2, -2.0);
        let closed = gain.feedback_transform().expect("proper");
        for frequency in [0.0, 0.3, 1.0, 7.0, 100.0] {
            let [s, t, l] = [closed.sensitivity(), closed.complementary(), gain.clone()]
                .map(|one| one.checked(frequency).expect("no pole"));
            for i in 0..2 {
                for j in 0..2 {
                    let one = f64::from(u8::from(i == j));
                    assert!((s[(i, j)] + t[(i, j)] - one).norm_sqr().sqrt() < 1e-12);
                    // (I + L) S = I
                    let product: c64 = (0..2).map(|k| (l[(i, k)] + f64::from(u8::from(i == k))) * s[(k, j)]).sum();
                    assert!((product - one).norm_sqr().sqrt() < 1e-9, "{product}");
                }
            }
        }
        // Broken again the loop is what it was.
        let again = closed.feedback_transform().expect("proper");
        let [one, other] = [gain, again].map(|one| one.checked(0.7).expect("no pole"));
        assert!((0..4).all(|k| (one[(k / 2, k % 2)] - other[(k / 2, k % 2)]).norm_sqr() < 1e-18));
    }
}

#[test]
fn the_nyquist_plot_encircles_minus_one_as_stability_requires() {
    let mut random = Random::new(3);
    let (mut stable, mut growing) = (0, 0);
    for trial in 0..50 {
        let gain = loop_gain(&mut random, 4, 1, if trial % 2 == 0 { -0.4 } else { -1.8 });
        let (Some(closed), Some(before)) = (gain.feedback_transform(), gain.unstable_poles()) else { continue };
        let after = closed.unstable_poles().expect("converges");
        // 1 + L over the whole axis, as an angle so that no frequency is left out.
        let count = 20_000;
        let at = |k: usize| {
            let place = (PI * (k as f64 + 0.5) / count as f64 - 0.5 * PI).tan();
            let m = gain.at_frequency(place.abs())[(0, 0)];
            1.0 + if place < 0.0 { m.conj() } else { m }
        };
        let values: Vec<c64> = (0..count).map(at).collect();
        let step = |k: usize| {
            let quotient = values[(k + 1) % count] * values[k].conj();
            quotient.im.atan2(quotient.re)
        };
        let turns = (0..count).map(step).sum::<f64>() / TAU;
        assert!((turns - turns.round()).abs() < 1e-6, "{turns}");
        assert_eq!(before as i64 - after as i64, turns.round() as i64, "trial {trial}: {before} poles, then {after}");
        if after == 0 { stable += 1 } else { growing += 1 }
    }
    assert!(stable >= 10 && growing >= 10, "{stable} and {growing} are no test of both");
}

#[test]
fn at_low_frequencies_samples_show_the_loop_in_continuous_time() {
    let mut random = Random::new(7);
    let a = drawn(&mut random, 4, 4).plus(&Matrix::identity(4).scale(&-2.0));
    let (b, c) = (drawn(&mut random, 4, 2), drawn(&mut random, 2, 4));
    let continuous = Response::continuous(&a, &b, &c).expect("finite");
    let difference = |period: f64, frequency: f64| {
        let discrete = discretise(&a, &b, period).expect("finite");
        let sampled = Response::sampled(&discrete.a, &discrete.b, &c, period).expect("finite");
        let (one, other) = (sampled.at_frequency(frequency), continuous.at_frequency(frequency));
        (0..4).map(|k| (one[(k / 2, k % 2)] - other[(k / 2, k % 2)]).norm_sqr().sqrt()).fold(0.0, f64::max)
    };
    // At rest they are the same; otherwise the hold is late by half a sample, so that the difference halves with the sample time.
    assert!(difference(0.1, 0.0) < 1e-12);
    let [coarse, fine] = [1e-2, 5e-3].map(|period| difference(period, 1.0));
    assert!(coarse < 0.01 && (coarse / fine - 2.0).abs() < 0.05, "{coarse} and {fine}");
}

#[test]
fn the_largest_singular_value_is_no_smaller_than_any_other_and_no_larger_than_its_bound() {
    let mut random = Random::new(11);
    for period in [None, Some(0.05)] {
        for _ in 0..10 {
            let a = drawn(&mut random, 5, 5).plus(&Matrix::identity(5).scale(&-2.5));
            let (b, c, d) = (drawn(&mut random, 5, 3), drawn(&mut random, 2, 5), drawn(&mut random, 2, 3));
            let (a, b) = match period {
                None => (a, b),
                Some(period) => {
                    let discrete = discretise(&a, &b, period).expect("finite");
                    (discrete.a, discrete.b)
                }
            };
            let response = Response::state_space([&a, &b, &c, &d], period).expect("finite");
            let Some(largest) = response.largest_gain() else {
                assert!(eigenvalues(&a).expect("converges").iter().any(|(re, _)| *re > 0.0));
                continue;
            };
            let high = response.nyquist().unwrap_or(1e4);
            for k in 0..2000 {
                let values = response.singular_values(high * f64::from(k) / 2000.0 * (1.0 - 1e-9)).expect("no pole");
                assert!(values[0] <= largest.value * (1.0 + 1e-9) && values[0] >= values[1]);
            }
            let at_peak = response.singular_values(largest.frequency.min(1e9)).expect("no pole")[0];
            assert!((at_peak / largest.value - 1.0).abs() < 1e-6, "{at_peak} at {largest:?}");
        }
    }
}

#[test]
fn frequencies_that_are_none_are_refused() {
    let one = |x: f64| Matrix::from_fn(1, 1, |_, _| x);
    let sampled = Response::sampled(&one(0.5), &one(1.0), &one(1.0), 0.01).expect("finite");
    assert!(matches!(sampled.checked(-1.0), Err(FrequencyError::Negative(_))));
    assert!(matches!(sampled.checked(f64::NAN), Err(FrequencyError::Negative(_))));
    assert!(matches!(sampled.checked(f64::INFINITY), Err(FrequencyError::Negative(_))));
    assert!(sampled.checked(100.0 * PI).is_ok() && sampled.checked(0.0).is_ok());
    let error = sampled.checked(315.0).expect_err("beyond half the sample rate");
    assert!(error.to_string().contains("Nyquist frequency of 314.159"), "{error}");
    let integrator = Response::continuous(&one(0.0), &one(1.0), &one(1.0)).expect("finite");
    assert!(matches!(integrator.checked(0.0), Err(FrequencyError::Pole(_))));
    assert_eq!(integrator.largest_gain(), None);
}

#[test]
fn a_loop_that_is_open_has_no_limits() {
    let one = |x: f64| Matrix::from_fn(1, 1, |_, _| x);
    let open = Response::continuous(&one(-1.0), &one(1.0), &one(0.0)).expect("finite");
    let found = channel_margins(&open).expect("nothing to iterate on");
    assert_eq!((found.gain, found.phase, found.delay), ([0.0, f64::INFINITY], f64::INFINITY, Some(f64::INFINITY)));
    assert!((found.disk - 2.0).abs() < 1e-9);
    let [s, t] = [open.sensitivity(), open.complementary()].map(|one| one.largest_gain().expect("stable").value);
    assert!((s - 1.0).abs() < 1e-12 && t == 0.0, "{s} {t}");
    let again = open.feedback_transform().expect("proper");
    assert_eq!(again.checked(1.0).expect("no pole")[(0, 0)].norm_sqr(), 0.0);
}

/// Steps of what a sampled loop holds end where the response to slow sines begins.
fn steps_end_where_responses_begin(found: &LoopResponses) {
    assert!(!found.steps.is_empty());
    for step in &found.steps {
        for signal in step.signals.iter().filter(|signal| !signal.motor) {
            let of = |one: &&kardan::results::ReferenceResponse| {
                one.reference == step.reference && one.output == signal.name
            };
            let response = found.references.iter().find(of).expect("shown");
            let largest = step.signals.iter().filter(|one| one.unit == signal.unit);
            let largest = largest.flat_map(|one| &one.values).fold(0.0f64, |max, x| max.max(x.abs()));
            let (end, start) = (signal.values.last().expect("followed"), response.real[0]);
            // The first frequency is not zero, and the step not quite at rest.
            assert!((end - start).abs() < 2e-2 * largest, "{} → {}: {end} and {start}", step.reference, signal.name);
        }
    }
}

#[test]
fn what_a_design_shows_is_one_loop() {
    for model in ["sia-steering", "sia-steering-ecu"] {
        let found = responses(model);
        let count = found.frequencies.len();
        assert!((100..=600).contains(&count), "{count} frequencies");
        assert!(found.frequencies.windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!(found.nyquist.is_some(), model == "sia-steering-ecu");
        assert!(found.nyquist.is_none_or(|nyquist| (found.frequencies[count - 1] / nyquist - 1.0).abs() < 1e-9));
        for one in &found.sensitivities {
            assert_eq!(one.values.len(), count);
            let largest = one.largest.expect("stable");
            let peak = one.values.iter().map(|values| values[0]).fold(0.0, f64::max);
            assert!(
                peak <= largest.value * (1.0 + 1e-9) && peak > 0.97 * largest.value,
                "{:?}: {peak} of {largest:?}",
                one.function
            );
        }
        // |σ(S) − σ(T)| ≤ 1, as S + T = I.
        let of = |function, readings| {
            found
                .sensitivities
                .iter()
                .find(|one| (one.function, one.at_sensors) == (function, readings))
                .expect("shown")
        };
        for readings in [false, true] {
            let (s, t) = (of(LoopFunction::S, readings), of(LoopFunction::T, readings));
            let apart = s.values.iter().zip(&t.values).map(|(s, t)| (s[0] - t[0]).abs()).fold(0.0, f64::max);
            assert!(apart <= 1.0 + 1e-6, "{apart}");
        }
        if found.nyquist.is_some() {
            steps_end_where_responses_begin(&found);
        }
    }
}
