//! Observers of section 6.1.5 for any model: exact gains against golden numbers, exact characteristic polynomials, what sensors
//! can tell apart, the dual Riccati equation, and every refusal.
//!
//! Origin of the golden numbers: `golden/golden.json`, see `tests/runs/golden.rs`.

use crate::common::{self, angle, constrained};
use kardan::analysis::{LinearSystem, OutputSignal, linear_system};
use kardan::equations::Measured;
use kardan::model;
use kardan::num::{Matrix, Polynomial, Rational, Scalar, characteristic_polynomial, rational_to_f64};
use kardan::results::Complex;
use kardan::synthesis::observer::{Noise, ObserverError, distinguishable, extend, kalman, luenberger};
use kardan::synthesis::regulator::ExactPole;

fn integers(rows: &[&[i64]]) -> Matrix<Rational> {
    Matrix::from_fn(rows.len(), rows.first().map_or(0, |row| row.len()), |i, j| Rational::from(rows[i][j]))
}

fn fraction(top: i64, bottom: u32) -> Rational {
    Rational::from_parts(top.into(), bottom.into())
}

fn real(top: i64, bottom: u32) -> ExactPole {
    (fraction(top, bottom), Rational::ZERO)
}

fn names(list: &[&str]) -> Vec<String> {
    list.iter().map(ToString::to_string).collect()
}

/// A built-in model without inputs; sensors are angles of shafts, or the torque of an element (`torque of torsion_bar`).
/// With W of torques on shafts.
fn built_in(name: &str, sensors: &[&str], torques: &[&str]) -> (LinearSystem, Matrix<Rational>) {
    let (system, coordinates, basis) = constrained(model::builtin(name).unwrap().source, &[]);
    let signal = |sensor: &&str| match sensor.strip_prefix("torque of ") {
        Some(element) => {
            OutputSignal { name: format!("{element}.tau"), measured: Measured::SpringTorque(element.into()) }
        }
        None => angle(sensor),
    };
    let outputs: Vec<OutputSignal> = sensors.iter().map(signal).collect();
    let shaft = |name: &&str| system.coordinates.iter().position(|s| s == name).unwrap();
    let shafts: Vec<usize> = torques.iter().map(shaft).collect();
    let r = basis.columns();
    // W for torques on shafts: `[0; Kᵀ e_shaft]`, one column per shaft, of a system with E = diag(I, H_r).
    let entry = |i: usize, j: usize| i.checked_sub(r).map_or(Rational::ZERO, |i| basis[(shafts[j], i)].clone());
    let torques = Matrix::from_fn(2 * r, shafts.len(), entry);
    (linear_system(&system, &coordinates, &basis, &outputs), torques)
}

/// p(A) by Horner.
fn at(p: &Polynomial, a: &Matrix<Rational>) -> Matrix<Rational> {
    let unit = Matrix::identity(a.rows());
    p.coefficients().iter().rev().fold(Matrix::zeros(a.rows(), a.rows()), |m, c| m.multiply(a).plus(&unit.scale(c)))
}

fn product(a: &Polynomial, b: &Polynomial) -> Polynomial {
    let mut out = vec![Rational::ZERO; a.degree() + b.degree() + 1];
    for (i, x) in a.coefficients().iter().enumerate() {
        for (j, y) in b.coefficients().iter().enumerate() {
            out[i + j] = out[i + j].plus(&x.times(y));
        }
    }
    Polynomial::new(out)
}

/// A − LC of the explicit system.
fn error_matrix(system: &LinearSystem, gain: &Matrix<Rational>) -> Matrix<Rational> {
    let explicit = system.explicit().unwrap();
    explicit.a.plus(&gain.multiply(&explicit.c).scale(&Rational::from(-1)))
}

/// golden.json `hd.observer_L_decoupled` and `hd.observer_polynomial`: the observer (6.45), (6.46) of the harmonic drive.
#[test]
fn golden_observer_of_the_harmonic_drive() {
    let (drive, _) = built_in("harmonic-drive", &["wg", "cs"], &[]);
    // Generalised torques on the reduced coordinates.
    let torques = Matrix::from_fn(4, 2, |i, j| if i == j + 2 { Rational::ONE } else { Rational::ZERO });
    let extended = extend(&drive, &torques, &names(&["tau_wg", "tau_cs"]));
    let poles = [real(-50, 1), real(-501, 10), real(-502, 10)];
    let observer = luenberger(&extended, &poles).unwrap();
    assert_eq!((observer.indices.as_slice(), observer.decoupled), (&[3, 3][..], true));
    assert!(observer.notes.is_empty());
    let golden = common::golden();
    let expected = common::rows(&golden["hd"]["observer_L_decoupled"]);
    // Golden order: speeds, angles, torques; here: angles, speeds, torques.
    let order = [2, 3, 0, 1, 4, 5];
    let mut worst = 0.0f64;
    for (row, &state) in expected.iter().zip(&order) {
        for (j, value) in row.iter().enumerate() {
            let own = rational_to_f64(&observer.gain[(state, j)]);
            let error = (own - value).abs() / value.abs();
            worst = worst.max(error);
            assert!(error < 1e-9, "{state} {j}: {own} {value}");
        }
    }
    println!("observer gain of the harmonic drive: largest relative difference from golden {worst:e}");
    let lower = common::list(&golden["hd"]["observer_polynomial"]);
    for p in &observer.polynomials {
        let own: Vec<f64> = p.coefficients().iter().rev().skip(1).map(Scalar::to_f64).collect();
        own.iter().zip(&lower).for_each(|(x, y)| common::close(*x, *y, 1e-15, "observer polynomial"));
    }
    let closed = error_matrix(&extended, &observer.gain);
    assert_eq!(characteristic_polynomial(&closed), product(&observer.polynomials[0], &observer.polynomials[1]));
    // Identical decoupled error dynamics: p(A − LC) = 0 already.
    assert!(at(&observer.polynomials[0], &closed).as_slice().iter().all(Scalar::is_zero));
}

/// golden.json `analysis.ranks.hd.ext_observer`.
#[test]
fn golden_ranks_of_the_harmonic_drive() {
    let golden = &common::golden()["analysis"]["ranks"]["hd"]["ext_observer"];
    for (sensors, key) in [(&["wg", "cs"][..], "obsv_rank"), (&["cs"], "rank_with_phi_cs_only")] {
        let (drive, torques) = built_in("harmonic-drive", sensors, &["wg", "cs"]);
        let reported = distinguishable(&drive, &torques, &names(&["T_wg", "T_cs"])).unwrap();
        assert_eq!(Some(reported.rank as u64), golden[key].as_u64(), "{sensors:?}");
    }
}

/// (6.42), (6.43): of the three torques of a harmonic drive two combinations show in two encoders.
#[test]
fn torques_of_the_harmonic_drive() {
    let all = ["wg", "cs", "fs"];
    for sensors in [&["wg", "cs"][..], &["wg", "fs"], &["cs", "fs"], &all] {
        let (drive, torques) = built_in("harmonic-drive", sensors, &all);
        let torque_names = names(&["T_wg", "T_cs", "T_fs"]);
        let reported = distinguishable(&drive, &torques, &torque_names).unwrap();
        assert_eq!((reported.independent, reported.rank, reported.states), (2, 6, 7));
        let expected = [[(1, 1), (0, 1), (-1, 50)], [(0, 1), (1, 1), (51, 50)]];
        let expected = Matrix::from_fn(2, 3, |i, j| fraction(expected[i][j].0, expected[i][j].1));
        assert_eq!(reported.combinations, expected);
        assert_eq!(reported.hidden, integers(&[&[1, -51, 50]]));
        assert_eq!(reported.resolving, [[0], [1], [2]]);
        assert!(reported.individual.is_empty() && reported.hidden_motions.is_empty());
        let text = reported.sentences.join(" ");
        assert!(
            text.contains(
                "2 combinations of the constant torques T_wg, T_cs and T_fs can be observed: \
             T_wg - 1/50 T_fs and T_cs + 51/50 T_fs."
            ),
            "{text}"
        );
        assert!(text.contains("T_wg : T_cs : T_fs = 1 : -51 : 50 cannot be distinguished from zero torque."), "{text}");
        assert!(text.contains("Measuring any one of T_wg, T_cs and T_fs as well determines the others."), "{text}");
        assert!(text.contains("T_wg = (T_wg - 1/50 T_fs) + 1/50 T_fs."), "{text}");
        assert!(text.contains("T_cs = (T_cs + 51/50 T_fs) - 51/50 T_fs."), "{text}");
        println!("{}", reported.sentences.join("\n"));
        // An observer for all three is refused with the same words.
        let extended = extend(&drive, &torques, &torque_names);
        let error = luenberger(&extended, &[real(-50, 1), real(-51, 1), real(-52, 1)]).unwrap_err();
        let ObserverError::NotObservable { rank, states, hidden, observable, .. } = &error else { panic!("{error}") };
        assert_eq!((*rank, *states), (6, 7));
        assert_eq!(hidden, &["T_wg : T_cs : T_fs = 1 : -51 : 50"]);
        assert_eq!(observable, &["T_wg - 1/50 T_fs", "T_cs + 51/50 T_fs"]);
        println!("{error}");
        // T_fs known: the other two are told (6.43).
        let two = Matrix::from_fn(4, 2, |i, j| torques[(i, j)].clone());
        let reported = distinguishable(&drive, &two, &torque_names[..2]).unwrap();
        assert_eq!(
            (reported.independent, reported.individual.as_slice(), reported.resolving.len()),
            (2, &[0, 1][..], 0)
        );
    }
}

/// golden.json `analysis.ranks.sia.observability`: 25 sensor sets, with and without two unknown torques (driver, rack load).
#[test]
fn golden_sensor_sets_of_the_steering_column() {
    let golden = common::golden();
    let sets = golden["analysis"]["ranks"]["sia"]["observability"].as_object().unwrap();
    assert_eq!(sets.len(), 25);
    for (set, ranks) in sets {
        let sensors: Vec<&str> = set.split('+').map(|s| if s == "tb" { "torque of torsion_bar" } else { s }).collect();
        let (column, torques) = built_in("sia-steering", &sensors, &["fs", "rk"]);
        let reported = distinguishable(&column, &torques, &names(&["driver", "load"])).unwrap();
        assert_eq!(Some(reported.rank as u64), ranks["rank8_with_dist"].as_u64(), "{set}");
        let plain = distinguishable(&column, &Matrix::zeros(6, 0), &[]).unwrap();
        assert_eq!(Some(plain.rank as u64), ranks["rank6"].as_u64(), "{set}");
        // Rank: what is seen of the states plus what is told of the torques, unless a torque hides behind a motion.
        assert_eq!(reported.rank == 8, reported.independent == 2 && reported.hidden_motions.is_empty(), "{set}");
        if reported.rank < 8 {
            println!("{set}: {}", reported.sentences.join(" "));
        }
    }
}

/// A random observable system; entries of A whole numbers.
fn random(n: usize, p: usize, seed: u64) -> LinearSystem {
    let mut random = kardan::num::Random::new(seed);
    let mut entry = |_, _| Rational::from(random.below(7) as i64 - 3);
    let a = Matrix::from_fn(n, n, &mut entry);
    LinearSystem::state_space(a, Matrix::zeros(n, 0), Matrix::from_fn(p, n, &mut entry))
}

/// The characteristic polynomial of A − LC is the product of the p_i, exactly, and the channels obey them one by one:
/// `c̃_i p_i(A − LC) = 0`. Both ways to give poles.
#[test]
fn characteristic_polynomials_are_exact() {
    let mut observable = [false; 3];
    for n in 1..=8usize {
        for p in 1..=3usize {
            for seed in 0..8 {
                let system = random(n, p, 100 * n as u64 + 10 * p as u64 + seed);
                let length = if seed % 2 == 0 { n } else { n.div_ceil(p.min(n)) };
                let poles: Vec<ExactPole> = (0..length).map(|k| real(-3 * k as i64 - 2, 2)).collect();
                let observer = match luenberger(&system, &poles) {
                    Ok(observer) => observer,
                    Err(ObserverError::NotObservable { rank, states, .. }) => {
                        assert!(rank < states);
                        continue;
                    }
                    // Unequal chains: the longest one has another length.
                    Err(ObserverError::WrongNumber { .. }) if seed % 2 == 1 => continue,
                    Err(other) => panic!("{n} {p} {seed}: {other}"),
                };
                assert_eq!(observer.indices.iter().sum::<usize>(), n);
                let closed = error_matrix(&system, &observer.gain);
                let whole =
                    observer.polynomials.iter().fold(Polynomial::new(vec![Rational::ONE]), |a, b| product(&a, b));
                assert_eq!(characteristic_polynomial(&closed), whole, "{n} {p} {seed}");
                for (i, own) in observer.polynomials.iter().enumerate() {
                    assert_eq!(own.degree(), observer.indices[i]);
                    let channel = Matrix::from_fn(1, p, |_, j| observer.combinations[(i, j)].clone());
                    let residual = channel.multiply(&system.c).multiply(&at(own, &closed));
                    assert!(residual.as_slice().iter().all(Scalar::is_zero), "{n} {p} {seed}: channel {i}");
                }
                let redundant = observer.indices.contains(&0);
                assert_eq!(observer.decoupled, observer.combinations == Matrix::identity(p));
                assert_eq!(observer.notes.is_empty(), observer.decoupled);
                observable[if redundant { 2 } else { usize::from(observer.decoupled) }] = true;
            }
        }
    }
    assert_eq!(observable, [true; 3], "chains that couple, that do not, and redundant sensors");
}

/// Chains of two and one state that couple: y₂ contains the error of y₁; their combination does not.
#[test]
fn coupled_chains_are_reported() {
    // y₁ = x₁, y₂ = x₃, x₁' = x₂, x₃' = 5 x₂: the row c₂A depends on c₁A.
    let system = LinearSystem::state_space(
        integers(&[&[0, 1, 0], &[0, 0, 0], &[0, 5, 0]]),
        Matrix::zeros(3, 0),
        integers(&[&[1, 0, 0], &[0, 0, 1]]),
    );
    let observer = luenberger(&system, &[real(-1, 1), real(-2, 1)]).unwrap();
    assert_eq!(observer.indices, [2, 1]);
    assert!(!observer.decoupled);
    assert_eq!(observer.channels, ["y1", "-5 y1 + y2"]);
    assert_eq!(observer.notes.len(), 1);
    assert!(observer.notes[0].contains("that of -5 y1 + y2 is"), "{:?}", observer.notes);
    assert_eq!(observer.polynomials.iter().map(ToString::to_string).collect::<Vec<_>>(), ["s^2 + 3 s + 2", "s + 1"]);
    let dealt = luenberger(&system, &[real(-1, 1), real(-2, 1), real(-7, 1)]).unwrap();
    assert_eq!(dealt.polynomials[1].to_string(), "s + 7");
    assert_eq!(dealt.poles, [(-1.0, 0.0), (-2.0, 0.0), (-7.0, 0.0)].map(Complex::from));
    // A pair where the second chain takes one pole only.
    let pair = [(fraction(-1, 1), fraction(2, 1)), (fraction(-1, 1), fraction(-2, 1))];
    let error = luenberger(&system, &pair).unwrap_err();
    assert_eq!(error, ObserverError::NotSelfConjugate { sensor: "y2".into(), poles: vec![Complex::new(-1.0, 2.0)] });
    let dealt = luenberger(&system, &[pair[0].clone(), pair[1].clone(), real(-4, 1)]).unwrap();
    assert_eq!(dealt.polynomials[0].to_string(), "s^2 + 2 s + 5");
    let error = luenberger(&system, &[real(-1, 1)]).unwrap_err();
    assert_eq!(error, ObserverError::WrongNumber { actual: 1, longest: 2, states: 3 });
    assert!(matches!(luenberger(&system, &[]), Err(ObserverError::WrongNumber { .. })));
    // The same sensor twice: the second adds nothing.
    let redundant =
        LinearSystem::state_space(integers(&[&[0, 1], &[0, 0]]), Matrix::zeros(2, 0), integers(&[&[1, 0], &[2, 0]]));
    let observer = luenberger(&redundant, &[real(-1, 1), real(-1, 1)]).unwrap();
    assert_eq!(observer.indices, [2, 0]);
    assert!(observer.notes[0].starts_with("y2 adds no information"), "{:?}", observer.notes);
    assert!((0..2).all(|i| observer.gain[(i, 1)].is_zero()));
    let singular = LinearSystem { e: Matrix::zeros(2, 2), ..redundant };
    assert_eq!(luenberger(&singular, &[real(-1, 1), real(-1, 1)]), Err(ObserverError::Singular));
    assert_eq!(distinguishable(&singular, &Matrix::zeros(2, 0), &[]).unwrap_err(), ObserverError::Singular);
}

/// One torque by itself, two only together, and one that no sensor shows.
#[test]
fn torques_that_hide() {
    // Two bodies without connection; torques a and b on the first, c on the second; the first one's angle.
    let bodies = LinearSystem::state_space(
        integers(&[&[0, 1, 0, 0], &[0, 0, 0, 0], &[0, 0, 0, 1], &[0, 0, 0, 0]]),
        Matrix::zeros(4, 0),
        integers(&[&[1, 0, 0, 0]]),
    );
    let w = integers(&[&[0, 0, 0], &[1, 2, 0], &[0, 0, 0], &[0, 0, 1]]);
    let reported = distinguishable(&bodies, &w, &names(&["a", "b", "c"])).unwrap();
    assert_eq!((reported.independent, reported.combinations.clone()), (1, integers(&[&[1, 2, 0]])));
    assert_eq!(reported.resolving, [[0, 2], [1, 2]]);
    assert_eq!(reported.hidden_motions, ["x3", "x4"]);
    let text = reported.sentences.join(" ");
    assert!(
        text.contains("With y1 one combination of the constant torques a, b and c can be observed: a + 2 b."),
        "{text}"
    );
    assert!(text.contains("Measuring a and c, or b and c as well determines the others."), "{text}");
    assert!(text.contains("c cannot be distinguished from zero torque."), "{text}");
    assert!(text.contains("Even with all torques known no sensor shows x3."), "{text}");
    let blind = LinearSystem { c: Matrix::zeros(1, 4), ..bodies };
    let reported = distinguishable(&blind, &w, &names(&["a", "b", "c"])).unwrap();
    assert_eq!((reported.independent, reported.rank), (0, 0));
    assert!(
        reported.sentences[0].contains("With y1 no combination of the constant torques a, b and c can be observed."),
        "{:?}",
        reported.sentences
    );
}

/// A P + P Aᵀ + W − P Cᵀ V⁻¹ C P = 0, with arithmetic of its own, and a stable error.
#[test]
fn kalman_filters() {
    let (drive, _) = built_in("harmonic-drive", &["wg", "cs"], &[]);
    let torques = Matrix::from_fn(4, 2, |i, j| if i == j + 2 { Rational::ONE } else { Rational::ZERO });
    let extended = extend(&drive, &torques, &names(&["tau_wg", "tau_cs"]));
    let noise = Noise { process: vec![0.0, 0.0, 1e-2, 1e-4, 1.0, 100.0], measurement: vec![1e-10, 1e-9] };
    let filter = kalman(&extended, &noise).unwrap();
    assert!(filter.residual < 1e-12, "{:e}", filter.residual);
    assert!(filter.poles.iter().all(|p| p.re < 0.0));
    let explicit = extended.explicit().unwrap();
    let (a, c, p) = (explicit.a.to_f64(), explicit.c.to_f64(), &filter.covariance);
    let ap = a.multiply(p);
    let pc = p.multiply(&c.transpose());
    for i in 0..6 {
        for j in 0..6 {
            let quadratic: f64 = (0..2).map(|k| pc[(i, k)] * pc[(j, k)] / noise.measurement[k]).sum();
            let w = if i == j { noise.process[i] } else { 0.0 };
            let remainder = ap[(i, j)] + ap[(j, i)] + w - quadratic;
            let size = (0..6).map(|k| (a[(i, k)] * p[(k, j)]).abs() + (p[(i, k)] * a[(j, k)]).abs()).sum::<f64>();
            // Entries are measured against the standard deviations that they combine, times the speed of the filter.
            let deviation = (p[(i, i)] * p[(j, j)]).sqrt() * filter.poles.last().unwrap().re.abs();
            assert!(
                remainder.abs() < 1e-10 * (size + w + quadratic.abs() + deviation),
                "{i} {j}: {remainder:e} of {size:e}"
            );
        }
        for k in 0..2 {
            let gain = pc[(i, k)] / noise.measurement[k];
            assert!((filter.gain[(i, k)] - gain).abs() < 1e-9 * gain.abs().max(1e-3 * filter.gain[(i, i % 2)].abs()));
        }
    }
}

#[test]
fn kalman_refusals() {
    let (drive, torques) = built_in("harmonic-drive", &["wg", "cs"], &["wg", "cs", "fs"]);
    let all = extend(&drive, &torques, &names(&["T_wg", "T_cs", "T_fs"]));
    let noise = |count: usize| Noise { process: vec![1.0; count], measurement: vec![1.0; 2] };
    let error = kalman(&all, &noise(7)).unwrap_err();
    assert_eq!(
        error,
        ObserverError::NotDetectable {
            modes: vec![Complex::default()],
            hidden: names(&["T_wg : T_cs : T_fs = 1 : -51 : 50"])
        }
    );
    assert_eq!(kalman(&all, &noise(6)), Err(ObserverError::Noises { of: "states", actual: 6, expected: 7 }));
    let short = Noise { measurement: vec![1.0], ..noise(7) };
    assert_eq!(kalman(&all, &short), Err(ObserverError::Noises { of: "sensors", actual: 1, expected: 2 }));
    for (value, sensor) in [(-1.0, false), (f64::NAN, false), (0.0, true), (f64::INFINITY, true)] {
        let mut bad = noise(7);
        if sensor {
            bad.measurement[1] = value;
        } else {
            bad.process[4] = value;
        }
        let Err(ObserverError::Noise { name, .. }) = kalman(&all, &bad) else { panic!("{value}") };
        assert_eq!(name, if sensor { "cs.phi" } else { "T_wg" });
    }
    let two = Matrix::from_fn(4, 2, |i, j| torques[(i, j)].clone());
    let extended = extend(&drive, &two, &names(&["T_wg", "T_cs"]));
    let mut silent = noise(6);
    silent.process[5] = 0.0;
    assert_eq!(kalman(&extended, &silent), Err(ObserverError::Noiseless { combinations: names(&["T_cs"]) }));
}

/// Nothing to see, nothing to estimate: no panic, and an answer where there is one.
#[test]
fn empty_systems() {
    let blind = LinearSystem::state_space(integers(&[&[-1]]), Matrix::zeros(1, 0), Matrix::zeros(0, 1));
    assert!(matches!(luenberger(&blind, &[real(-1, 1)]), Err(ObserverError::NotObservable { rank: 0, states: 1, .. })));
    let filter = kalman(&blind, &Noise { process: vec![2.0], measurement: Vec::new() }).unwrap();
    assert!((filter.covariance[(0, 0)] - 1.0).abs() < 1e-15 && filter.gain.columns() == 0);
    assert_eq!(distinguishable(&blind, &integers(&[&[1]]), &names(&["T"])).unwrap().independent, 0);
    let nothing = LinearSystem::state_space(Matrix::zeros(0, 0), Matrix::zeros(0, 0), Matrix::zeros(0, 0));
    assert_eq!(luenberger(&nothing, &[]).unwrap().gain.rows(), 0);
    assert!(kalman(&nothing, &Noise { process: Vec::new(), measurement: Vec::new() }).is_ok());
    assert_eq!(distinguishable(&nothing, &Matrix::zeros(0, 0), &[]).unwrap().rank, 0);
}
