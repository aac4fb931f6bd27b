//! `kardan analyze --parity`: residuals against closed forms and their definition, verdicts on faults against plain ranks.

use kardan::analysis::{LinearSystem, ParitySignal, Relation, Transfer, relations, static_relations};
use kardan::diagnostics::plain;
use kardan::model;
use kardan::num::{Matrix, Random, Rational, Scalar, exact_rank};
use kardan::results::{FaultVerdict, Parity, ParityTerm};
use kardan::study::{self, AnalyzeSettings, ParitySettings, Silent};

fn analyzed(source: &str, settings: AnalyzeSettings) -> Parity {
    let settings = AnalyzeSettings { parity: Some(ParitySettings::default()), ..settings };
    let found =
        study::analyze(source, &settings, &Silent).unwrap_or_else(|reported| panic!("{}", plain(source, &reported)));
    found.parity.expect("it was asked for")
}

fn outputs(source: &str, names: &[&str]) -> Parity {
    let outputs = names.iter().map(|name| name.to_string()).collect();
    analyzed(source, AnalyzeSettings { outputs, ..AnalyzeSettings::default() })
}

fn named_terms(terms: &[ParityTerm]) -> Vec<(&str, usize, &str)> {
    terms.iter().map(|term| (term.signal.as_str(), term.derivative, term.coefficient.as_str())).collect()
}

fn verdict<'a>(parity: &'a Parity, name: &str) -> &'a FaultVerdict {
    parity.faults.iter().find(|one| one.fault == name).unwrap_or_else(|| panic!("no fault of {name}"))
}

/// A planetary gear, its three shafts free but for the gear, each with an encoder.
const PLANETARY: &str = r#"
[shaft.sun]
inertia = "1 kg m^2"
[shaft.ring]
inertia = "2 kg m^2"
[shaft.carrier]
inertia = "3 kg m^2"
[planetary.split]
sun = "sun"
ring = "ring"
carrier = "carrier"
sun_teeth = 30
ring_teeth = 70
offset = "1 rad"
[sensor.a]
measures = "angle"
shaft = "sun"
resolution = "1 mrad"
phase = 0.5
sample_time = "1 ms"
noise = "2 mrad"
[sensor.b]
measures = "angle"
shaft = "ring"
[sensor.c]
measures = "angle"
shaft = "carrier"
[motor.m]
shaft = "sun"
[motor.n]
shaft = "ring"
[scenario]
duration = "1 s"
output_step = "10 ms"
[[scenario.event]]
at = "0.1 s"
signal = "m.tau"
to = "1 N m"
[[scenario.event]]
at = "0.3 s"
signal = "n.tau"
to = "-2 N m"
"#;

/// Willis: 30 sun + 70 ring − 100 carrier is the offset, here one.
#[test]
fn a_planetary_gear_with_three_encoders_has_its_row() {
    let parity = analyzed(PLANETARY, AnalyzeSettings::default());
    assert!(parity.exhaustive && parity.independent == 1 && parity.exact);
    let [residual] = &parity.residuals[..] else { panic!("{:?}", parity.residuals) };
    assert_eq!(named_terms(&residual.terms), [("a", 0, "1"), ("b", 0, "7/3"), ("c", 0, "-10/3")]);
    assert!(residual.up_to_constant && residual.linearised_at.is_empty() && residual.unit == "rad");
    assert!((residual.constant.unwrap() - 1.0 / 30.0).abs() < 1e-15);
    // Two of the three are independent.
    assert_eq!(outputs(PLANETARY, &["a", "b"]).residuals, []);
    for sensor in ["a", "b", "c"] {
        let found = verdict(&parity, sensor);
        // A turn of its constant cannot be told from how it was mounted.
        assert!(found.detectable && found.order == Some(0), "{found:?}");
    }
    // On the columns of a run it vanishes to rounding.
    let study = study::run(PLANETARY, &study::Settings::default(), &Silent).unwrap();
    let column = |name: &str| &study.runs[0].series.signal(name).unwrap().values;
    let [a, b, c] = ["sun.phi", "ring.phi", "carrier.phi"].map(column);
    let largest = a.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    assert!(largest > 0.1);
    for ((a, b), c) in a.iter().zip(b).zip(c) {
        let sum = a + 7.0 / 3.0 * b - 10.0 / 3.0 * c;
        assert!((sum - 1.0 / 30.0).abs() < 1e-14 * (1.0 + 10.0 * largest), "{sum}");
    }
}

/// Noise σ of one sensor, steps of 1 mrad rounded to the nearest, 1 ms: p = (10⁻³·10⁻³/3600)^(1/3) beyond ±3.40881 (from erfc, by bisection).
#[test]
fn thresholds_follow_from_noise_and_steps() {
    let parity = analyzed(PLANETARY, AnalyzeSettings::default());
    let limit = parity.residuals[0].threshold.as_ref().unwrap();
    let close = |a: f64, b: f64| (a - b).abs() < 1e-9 * b;
    assert!(close(limit.noise, 2e-3) && close(limit.steps, 0.5e-3), "{limit:?}");
    assert!(close(limit.threshold, 0.5e-3 + 3.408_806_286_050_114_5 * 2e-3), "{limit:?}");
    assert!(close(limit.detection_time, 3e-3) && limit.debounce == 3 && limit.multirate);
    // Beyond threshold and steps by the quantile 3.40293 of 0.001/3.
    let size = limit.threshold + limit.steps + 3.402_932_835_385_304_5 * 2e-3;
    let factors = [1.0, 7.0 / 3.0, 10.0 / 3.0];
    for (found, factor) in limit.min_detectable.iter().zip(factors) {
        assert!((found - size / factor).abs() < 1e-9, "{limit:?}");
    }
}

/// Sensors that are all read at every instant have no sample times that could differ.
#[test]
fn continuous_sensors_have_one_time() {
    let at_once = PLANETARY.replace("sample_time = \"1 ms\"\nnoise = \"2 mrad\"\n", "");
    let parity = analyzed(&at_once, AnalyzeSettings::default());
    let limit = parity.residuals[0].threshold.as_ref().unwrap();
    assert!(limit.sample_time == 0.0 && !limit.multirate, "{limit:?}");
}

/// Alarms of white noise, drawn: no more than the rate that the threshold promises, and at the end of its promise (one sample: exactly).
#[test]
fn false_alarms_are_as_rare_as_promised() {
    for (debounce, rate) in [(1usize, 3600.0 * 10.0), (3, 3600.0)] {
        let request = ParitySettings { false_alarms_per_hour: rate, debounce, filter: None };
        let settings = AnalyzeSettings { parity: Some(request), ..AnalyzeSettings::default() };
        let plain = PLANETARY.replace("resolution = \"1 mrad\"\nphase = 0.5\n", "");
        let parity = study::analyze(&plain, &settings, &Silent).unwrap().parity.unwrap();
        let limit = parity.residuals[0].threshold.clone().unwrap();
        assert_eq!(limit.steps, 0.0);
        let mut random = Random::new(11);
        let (samples, mut alarms, mut consecutive) = (400_000u32, 0u32, 0);
        for _ in 0..samples {
            consecutive = if (random.normal() * limit.noise).abs() > limit.threshold { consecutive + 1 } else { 0 };
            alarms += u32::from(consecutive == debounce);
        }
        // Expected at most samples · T · rate; five standard deviations of a Poisson count.
        let promised = f64::from(samples) * 1e-3 * rate / 3600.0;
        let counted = f64::from(alarms);
        assert!(counted < promised + 5.0 * promised.sqrt(), "{counted} of {promised}");
        // A run that goes on is one alarm: it begins after a sample within, which is 1 − p of them.
        let p = (1e-3 * rate / 3600.0).powf(1.0 / debounce as f64);
        let expected = promised * (1.0 - p);
        assert!((counted - expected).abs() < 5.0 * expected.sqrt(), "{counted}, {expected}");
    }
}

/// A disk with a motor and an encoder: `φ'' − τ/J = 0`, behind a filter of second order.
const DISK: &str = r#"
[shaft.disk]
inertia = "0.5 kg m^2 ± 10 %"
[motor.m]
shaft = "disk"
[sensor.phi]
measures = "angle"
shaft = "disk"
sample_time = "1 ms"
noise = "0.1 mrad"
"#;

/// `(s/(τs + 1))²` by the bilinear rule is `q² ((z − 1)/(z − p))²` with p = (a − 1)/(a + 1), q = 2/(h (a + 1)), a = 2τ/h: its pulse response is added
/// up in closed form, sample by sample.
#[test]
fn residuals_in_time_have_thresholds_behind_their_filter() {
    let limits = |filter: Option<f64>| {
        let request = ParitySettings { filter, ..ParitySettings::default() };
        let settings = AnalyzeSettings { parity: Some(request), ..AnalyzeSettings::default() };
        let parity = study::analyze(DISK, &settings, &Silent).unwrap().parity.unwrap();
        let motor = verdict(&parity, "m").clone();
        assert_eq!(named_terms(&motor.relation), [("phi", 2, "1"), ("m.tau", 0, "-2")]);
        assert_eq!((motor.order, motor.unit.as_str(), motor.fault_unit.as_str()), (Some(2), "rad/s^2", "N m"));
        // 1/0.45 − 2 = 2/9 is farther than 2 − 1/0.55.
        assert!((motor.relation[1].tolerance - 2.0 / 9.0).abs() < 1e-12 && motor.relation[0].tolerance == 0.0);
        motor.threshold.expect("it has noise")
    };
    let (h, noise) = (1e-3f64, 1e-4f64);
    for (requested_filter, time) in [(None, 0.01f64), (Some(0.05), 0.05), (Some(5e-4), 5e-4)] {
        let limit = limits(requested_filter);
        let (p, q) = ((2.0 * time / h - 1.0) / (2.0 * time / h + 1.0), 2.0 / h / (2.0 * time / h + 1.0));
        // (1 − x)²/(1 − p x)² with x = 1/z: coefficients (k + 1) pᵏ − 2 k pᵏ⁻¹ + (k − 1) pᵏ⁻².
        let power = |k: i32| if k < 0 { 0.0 } else { p.powi(k) };
        let coefficient = |k: i32| {
            let of = |k: i32| if k < 0 { 0.0 } else { f64::from(k + 1) * power(k) };
            of(k) - 2.0 * of(k - 1) + of(k - 2)
        };
        let gain = (0..20_000).map(|k| coefficient(k).powi(2)).sum::<f64>().sqrt() * q * q;
        assert!((limit.noise / (noise * gain) - 1.0).abs() < 1e-9, "{limit:?}, {}", noise * gain);
        assert_eq!((limit.filter, limit.steps, limit.sample_time), (Some(time), 0.0, h));
        // White noise behind a filter is none: one sample's probability bounds the rate. 10⁻³·10⁻³/3600 lies beyond ±6.310699 (erfc).
        assert!((limit.threshold / limit.noise - 6.310_699).abs() < 1e-5, "{}", limit.threshold / limit.noise);
        // A torque that is wrong by one moves it by 2/(τs + 1)², and by 99 % of that where (1 + x) e⁻ˣ = 0.01: x = 6.638.
        let size = (limit.threshold + 3.402_932_835_385_304_5 * limit.noise) / (2.0 * 0.99);
        let share = limit.min_detectable[0] / size;
        assert!(limit.min_detectable.len() == 1 && (0.99 - 1e-9..1.0 + 1e-9).contains(&share), "{limit:?}, {size}");
        if time > h {
            assert!(
                (limit.detection_time - (6.638 * time + 3.0 * h)).abs() < 0.02 * limit.detection_time + h,
                "{limit:?}"
            );
        }
    }
    let request = ParitySettings { filter: Some(60.0), ..ParitySettings::default() };
    let settings = AnalyzeSettings { parity: Some(request), ..AnalyzeSettings::default() };
    let reported = study::analyze(DISK, &settings, &Silent).unwrap_err();
    assert!(
        reported[0].code == "analysis::filter" && reported[0].help.as_ref().is_some_and(|help| help.contains("10 s")),
        "{reported:?}"
    );
}

/// Sensors that are read at every instant are looked at by the fastest controller; without one nothing says how often.
#[test]
fn residuals_in_time_of_continuous_sensors() {
    let plain = DISK.replace("sample_time = \"1 ms\"\nnoise = \"0.1 mrad\"", "resolution = \"1 mrad\"");
    let law = "[control.c]\nlaw = \"program\"\ncommands = { m = \"-1 N m s/rad * disk.w\" }\nsample_time = \"2 ms\"\n";
    let of = |source: &str| verdict(&analyzed(source, AnalyzeSettings::default()), "m").threshold.clone();
    let limit = of(&format!("{plain}{law}")).expect("its steps");
    assert_eq!((limit.sample_time, limit.filter, limit.noise), (2e-3, Some(0.02), 0.0));
    // q² Σ |h| of the steps of one count: the size of the answer to any course of them.
    assert!(limit.steps > 0.0 && limit.threshold == limit.steps && !limit.multirate, "{limit:?}");
    assert!(of(&plain).is_none());
}

/// Alarms behind the filter, drawn: the noise of an encoder through the filter of `kind = "transfer_function"`, no more than promised.
#[test]
fn false_alarms_behind_a_filter_are_as_rare_as_promised() {
    let (rate, debounce) = (3600.0 * 5.0, 2);
    let request = ParitySettings { false_alarms_per_hour: rate, debounce, filter: Some(0.004) };
    let settings = AnalyzeSettings { parity: Some(request), ..AnalyzeSettings::default() };
    let parity = study::analyze(DISK, &settings, &Silent).unwrap().parity.unwrap();
    let limit = verdict(&parity, "m").threshold.clone().unwrap();
    let mut random = Random::new(23);
    let (h, a) = (1e-3, 8.0);
    // (s/(τs + 1)) twice: y⁺ = ((a − 1) y + (2/h)(x⁺ − x))/(a + 1).
    let (mut states, mut alarms, mut consecutive) = ([[0.0f64; 2]; 2], 0u32, 0usize);
    let samples = 400_000u32;
    for _ in 0..samples {
        let mut x = 1e-4 * random.normal();
        for [last, output] in &mut states {
            *output = ((a - 1.0) * *output + 2.0 / h * (x - *last)) / (a + 1.0);
            *last = std::mem::replace(&mut x, *output);
        }
        consecutive = if x.abs() > limit.threshold { consecutive + 1 } else { 0 };
        alarms += u32::from(consecutive == debounce);
    }
    let promised = f64::from(samples) * h * rate / 3600.0;
    assert!(f64::from(alarms) < promised && promised > 1000.0, "{alarms} of {promised}");
}

/// Of a harmonic drive wg − 51 cs + 50 fs: speeds without a constant, and two angles and a speed have no relation at one instant.
#[test]
fn a_harmonic_drive_by_angles_and_by_speeds() {
    let source = model::builtin("harmonic-drive").unwrap().source;
    let angles = outputs(source, &["wg.phi", "cs.phi", "fs.phi"]);
    assert_eq!(
        named_terms(&angles.residuals[0].terms),
        [("wg.phi", 0, "1"), ("cs.phi", 0, "-51"), ("fs.phi", 0, "50")]
    );
    let speeds = outputs(source, &["wg.w", "cs.w", "fs.w"]);
    assert_eq!(named_terms(&speeds.residuals[0].terms), [("wg.w", 0, "1"), ("cs.w", 0, "-51"), ("fs.w", 0, "50")]);
    assert!(angles.residuals[0].up_to_constant && !speeds.residuals[0].up_to_constant);
    assert_eq!(speeds.residuals[0].constant, Some(0.0));
    // Two angles and a speed: in time, fs' follows from them by one derivative.
    let mixed = outputs(source, &["wg.phi", "cs.phi", "fs.w"]);
    assert_eq!(mixed.residuals, []);
    let found = verdict(&mixed, "fs.w");
    assert!(found.detectable && found.order == Some(1), "{found:?}");
    let mut relation = named_terms(&found.relation);
    relation.sort();
    assert_eq!(relation, [("cs.phi", 1, "-51"), ("fs.w", 0, "50"), ("wg.phi", 1, "1")]);
    // An angle that reads another constant is told while it changes alone; a speed goes on.
    assert_eq!((found.strongly_detectable, verdict(&mixed, "wg.phi").strongly_detectable), (Some(true), Some(false)));
}

/// The steering of the source: harmonic drive, joint, torsion bar; the driver is a disturbance.
const STEERING: &str = r#"
[shaft.wg]
inertia = "50 kg mm^2"
[shaft.cs]
inertia = "100 kg mm^2"
friction = "0.02 N m"
[shaft.fs]
inertia = "50000 kg mm^2"
[shaft.cj]
inertia = "10 kg mm^2"
[shaft.rk]
inertia = "50000 kg mm^2"
[harmonic_drive.hd]
wave_generator = "wg"
circular_spline = "cs"
flexspline = "fs"
ratio = 50
[universal_joint.cardan]
shaft_1 = "cj"
shaft_2 = "cs"
angle = "20 deg"
[spring_damper.torsion_bar]
shaft_1 = "rk"
shaft_2 = "cj"
stiffness = "100 N m/rad ± 10 %"
[motor.wg_motor]
shaft = "wg"
[motor.rk_motor]
shaft = "rk"
[disturbance.driver]
shaft = "fs"
[sensor.wg_encoder]
measures = "angle"
shaft = "wg"
[sensor.rk_encoder]
measures = "angle"
shaft = "rk"
[sensor.bar]
measures = "torque"
element = "torsion_bar"
"#;

/// wg + 50 fs = 51 cs, cs = κ cj, cj = rk − bar/s: wg + 50 fs − 51 κ rk + 51 κ bar/s = 0, κ the ratio of the joint where it stands.
#[test]
fn the_steering_with_a_fourth_sensor() {
    let three = outputs(STEERING, &["wg_encoder", "rk_encoder", "bar"]);
    assert_eq!(three.residuals, [], "three motions, three sensors");
    // The driver may do anything at the wheel, friction at the circular spline: the torque of either motor goes through both.
    assert_eq!(three.unknown, ["driver"]);
    assert!(
        three.faults.iter().all(|one| one.detectable && one.detectable_despite_friction.is_some()),
        "{:?}",
        three.faults
    );
    let four = outputs(STEERING, &["wg_encoder", "rk_encoder", "bar", "fs.phi"]);
    assert_eq!((four.independent, four.residuals.len()), (1, 1));
    let residual = &four.residuals[0];
    assert_eq!(residual.linearised_at, ["cardan"]);
    let of = |name: &str| residual.terms.iter().find(|term| term.signal == name).unwrap().value;
    let kappa = -of("rk_encoder") / 51.0;
    assert_eq!((of("wg_encoder"), of("fs.phi")), (1.0, 50.0));
    assert!((of("bar") - 51.0 * kappa / 100.0).abs() < 1e-13, "{residual:?}");
    let cosine = kardan_rt::functions::cos(20f64.to_radians());
    assert!([cosine, 1.0 / cosine].iter().any(|ratio| (kappa - ratio).abs() < 1e-12), "{kappa}");
    // The stiffness of the bar is known to 10 %, so is its share: 1/s at 90 and 110.
    let tolerance = residual.terms.iter().find(|term| term.signal == "bar").unwrap().tolerance;
    assert!((tolerance - 51.0 * kappa * (1.0 / 90.0 - 1.0 / 100.0)).abs() < 1e-12, "{tolerance}");
}

/// Two bodies and a spring: J a″ + s (a − b) = u, a relation of order two; the motor's torque shows in it.
const CHAIN: &str = r#"
[shaft.a]
inertia = "2 kg m^2"
[shaft.b]
inertia = "3 kg m^2"
[spring_damper.spring]
shaft_1 = "a"
shaft_2 = "b"
stiffness = "10 N m/rad"
[motor.m]
shaft = "a"
[disturbance.load]
shaft = "b"
[sensor.at_a]
measures = "angle"
shaft = "a"
[sensor.at_b]
measures = "angle"
shaft = "b"
[sensor.twist]
measures = "torque"
element = "spring"
[[analysis.sensor]]
shaft = "b"
measures = "speed"
"#;

#[test]
fn a_chain_with_a_spring_in_time() {
    let two = outputs(CHAIN, &["at_a", "at_b"]);
    assert_eq!(two.residuals, []);
    assert_eq!((two.commands.as_slice(), two.unknown.as_slice()), (&["m".to_string()][..], &["load".to_string()][..]));
    for fault in ["at_a", "at_b", "m"] {
        let found = verdict(&two, fault);
        // With the load unknown there is one relation: nothing can be told apart.
        assert!(found.detectable && found.order == Some(2) && found.not_isolable_from.len() == 2, "{found:?}");
        assert_eq!(
            named_terms(&found.relation),
            [("at_a", 2, "1"), ("at_a", 0, "5"), ("at_b", 0, "-5"), ("m.tau", 0, "-1/2")]
        );
    }
    // An angle that is wrong by a constant bends the spring for good; so does a torque.
    assert!(two.faults.iter().all(|one| one.strongly_detectable == Some(true)), "{:?}", two.faults);
    // The torque of the spring as well: twist = 10 (a − b) at once, and the faults come apart.
    let three = outputs(CHAIN, &["at_a", "at_b", "twist"]);
    assert_eq!(named_terms(&three.residuals[0].terms), [("at_a", 0, "1"), ("at_b", 0, "-1"), ("twist", 0, "-1/10")]);
    assert!(three.faults.iter().all(|one| one.detectable && one.not_isolable_from.is_empty()), "{:?}", three.faults);
    // One sensor: the load explains any course of b; of a alone the spring's torque is unknown.
    for sensor in ["at_a", "at_b"] {
        let one = outputs(CHAIN, &[sensor]);
        assert!(one.faults.iter().all(|fault| !fault.detectable), "{:?}", one.faults);
    }
}

/// The smallest sets, against the verdicts of each set of the same sensors alone.
#[test]
fn smallest_sets_are_those_whose_verdicts_are_good() {
    let all = ["at_a", "at_b", "twist", "b.w"];
    let parity = analyzed(CHAIN, AnalyzeSettings::default());
    assert_eq!(parity.sets[0].candidates, all);
    let good: [&dyn Fn(&Parity) -> bool; 3] =
        [&|p| verdict(p, "m").detectable, &|p| p.faults.iter().all(|one| one.detectable), &|p| {
            p.faults.iter().all(|one| one.detectable && one.not_isolable_from.is_empty())
        }];
    for (sets, good) in parity.sets.iter().zip(good) {
        let reached: Vec<Vec<&str>> = (1u32..16)
            .map(|mask| (0..4).filter(|k| mask >> k & 1 == 1).map(|k| all[k]).collect::<Vec<_>>())
            .filter(|set| good(&outputs(CHAIN, set)))
            .collect();
        let least = reached.iter().map(Vec::len).min().unwrap();
        let mut expected: Vec<Vec<&str>> = reached.into_iter().filter(|set| set.len() == least).collect();
        let mut found: Vec<Vec<&str>> = sets.sets.iter().map(|set| set.iter().map(String::as_str).collect()).collect();
        expected.sort();
        found.sort();
        assert_eq!(found, expected, "{}", sets.goal);
    }
}

/// The rows of `[sE − A, −B; C, D]` with some columns, at a number: nothing of the transfer matrix.
fn rank_at(system: &LinearSystem, s: &Rational, faults: &[ParitySignal], sensors: &[usize]) -> usize {
    let n = system.states.len();
    let matrix =
        Matrix::from_fn(n + sensors.len(), n + faults.len(), |i, j| match (i.checked_sub(n), j.checked_sub(n)) {
            (None, None) => system.e[(i, j)].times(s).minus(&system.a[(i, j)]),
            (None, Some(k)) => match faults[k] {
                ParitySignal::Input(u) => Rational::ZERO.minus(&system.b[(i, u)]),
                ParitySignal::Output(_) => Rational::ZERO,
            },
            (Some(row), None) => system.c[(sensors[row], j)].clone(),
            (Some(row), Some(k)) => match faults[k] {
                ParitySignal::Input(u) => system.d[(sensors[row], u)].clone(),
                ParitySignal::Output(y) => {
                    if y == sensors[row] {
                        Rational::ONE
                    } else {
                        Rational::ZERO
                    }
                }
            },
        });
    exact_rank(&matrix)
}

fn random_system(random: &mut Random) -> LinearSystem {
    let (n, p, m) = (1 + random.below(4) as usize, 1 + random.below(4) as usize, 1 + random.below(4) as usize);
    let mut sparse = |rows: usize, columns: usize, of: u64| {
        let entry = |random: &mut Random| if random.below(of) == 0 { random.small(3) } else { 0 };
        Matrix::from_fn(rows, columns, |_, _| Rational::from(entry(random)))
    };
    let (a, b, c, d) = (sparse(n, n, 2), sparse(n, m, 2), sparse(p, n, 2), sparse(p, m, 5));
    LinearSystem { d, ..LinearSystem::state_space(a, b, c) }
}

/// Of random systems: ranks agree with those of the pencil at other numbers, relations vanish for all inputs and break by the fault.
#[test]
fn verdicts_of_random_systems_are_those_of_their_pencils() {
    let mut random = Random::new(17);
    let mut counts = [0usize; 4];
    for trial in 0..300 {
        let system = random_system(&mut random);
        let (n, p, m) = (system.states.len(), system.outputs.len(), system.inputs.len());
        let (commands, unknown): (Vec<usize>, Vec<usize>) = (0..m).partition(|_| random.below(2) == 0);
        let sensors: Vec<usize> = (0..p).collect();
        let faults: Vec<ParitySignal> = sensors
            .iter()
            .map(|&k| ParitySignal::Output(k))
            .chain(commands.iter().map(|&k| ParitySignal::Input(k)))
            .collect();
        let hidden: Vec<ParitySignal> = unknown.iter().map(|&k| ParitySignal::Input(k)).collect();
        // More numbers than a minor of the pencil has zeros, none of them those that the library takes.
        let points: Vec<Rational> = (0..=n as i64).map(|k| Rational::from(3 * k + 1) / Rational::from(7)).collect();
        let rank = |more: &[ParitySignal]| {
            let columns: Vec<ParitySignal> = hidden.iter().chain(more).copied().collect();
            points.iter().map(|s| rank_at(&system, s, &columns, &sensors)).max().unwrap()
        };
        let transfer = Transfer::new(&system).unwrap();
        let (groups, silent) = transfer.groups(&sensors, &faults, &unknown);
        let base = rank(&[]);
        for (i, &fault) in faults.iter().enumerate() {
            let shown = rank(&[fault]) > base;
            assert_eq!(shown, !silent.contains(&i), "{trial}: {fault:?} of {system:?}");
            counts[usize::from(shown)] += 1;
            for (j, &other) in faults.iter().enumerate().filter(|(j, _)| *j != i && shown && !silent.contains(j)) {
                let apart = rank(&[fault, other]) > rank(&[other]);
                let same_group = groups.iter().any(|group| group.contains(&i) && group.contains(&j));
                assert_eq!(apart, !same_group, "{trial}: {fault:?}, {other:?} of {system:?}");
                counts[2 + usize::from(apart)] += 1;
            }
        }
        let found = relations(&system, &faults, &commands, &unknown);
        for ((i, fault), found) in faults.iter().enumerate().zip(found) {
            assert_eq!(found.is_some(), !silent.contains(&i), "{trial}: {fault:?} of {system:?}");
            let Some(found) = found else { continue };
            assert!(found.relation.order() <= n);
            check_identity(&system, &found.relation, *fault, &unknown);
        }
        for relation in static_relations(&system, &commands).relations {
            check_static(&system, &relation);
        }
    }
    assert!(counts.iter().all(|count| *count > 50), "{counts:?}");
}

/// `Σ c sᵏ y(s) = 0` with `y = G u` for every unknown input, `Σ c sᵏ y = −(coefficients of u)` for each known one, at several s; and not
/// zero for the fault.
fn check_identity(system: &LinearSystem, relation: &Relation, fault: ParitySignal, unknown: &[usize]) {
    let mut broken = false;
    for point in [5i64, 11, 23] {
        let s = Rational::from(point) / Rational::from(13);
        let pencil = system.e.scale(&s).minus(&system.a);
        let Some(x) = pencil.solve(&system.b) else { continue };
        let transfer = system.c.multiply(&x).plus(&system.d);
        let power = |k: usize| (0..k).fold(Rational::ONE, |all, _| all.times(&s));
        let of = |input: Option<usize>, signal: Option<ParitySignal>| {
            relation.terms.iter().fold(Rational::ZERO, |sum, (term_signal, k, x)| {
                let value = match term_signal {
                    _ if Some(*term_signal) == signal => Rational::ONE,
                    ParitySignal::Output(y) => input.map_or(Rational::ZERO, |u| transfer[(*y, u)].clone()),
                    ParitySignal::Input(_) => Rational::ZERO,
                };
                sum.plus(&x.times(&power(*k)).times(&value))
            })
        };
        for u in 0..system.inputs.len() {
            // A known input is in the relation itself.
            let sum = of(Some(u), (!unknown.contains(&u)).then_some(ParitySignal::Input(u)));
            assert!(sum.is_zero(), "{relation:?} of {system:?}: input {u} gives {sum}");
        }
        broken |= !match fault {
            ParitySignal::Output(y) => of(None, Some(ParitySignal::Output(y))),
            ParitySignal::Input(u) => of(Some(u), None),
        }
        .is_zero();
    }
    assert!(broken, "{fault:?} does not move {relation:?}");
}

/// A static relation vanishes over states and inputs, with E = I.
fn check_static(system: &LinearSystem, relation: &Relation) {
    let (n, m) = (system.states.len(), system.inputs.len());
    for j in 0..n + m {
        let sum = relation.terms.iter().fold(Rational::ZERO, |sum, (term_signal, _, x)| {
            let entry = match term_signal {
                ParitySignal::Output(y) if j < n => system.c[(*y, j)].clone(),
                ParitySignal::Output(y) => system.d[(*y, j - n)].clone(),
                ParitySignal::Input(u) => {
                    if j == n + u {
                        Rational::ONE
                    } else {
                        Rational::ZERO
                    }
                }
            };
            sum.plus(&x.times(&entry))
        });
        assert!(sum.is_zero(), "{relation:?} of {system:?}");
    }
}
