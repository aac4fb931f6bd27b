//! How far away the next change of structure is.

use std::collections::BTreeSet;

use kardan::analysis::{
    ConstrainedSystem, Family, OutputSignal, Parameter, SamplingPlan, Side, distance_to_uncontrollability, sample,
    uncontrollability_pencil,
};
use kardan::assemble::DirectionalTerm;
use kardan::equations::Measured;
use kardan::num::{Rational, echelon};
use kardan::results::{BoxVerdict, Complex, DistanceToUncontrollability, NamedShare, ParameterPoint, Pole};

fn fraction(a: i64, b: u64) -> Rational {
    Rational::from_parts(a.into(), b.into())
}

fn directional_term<T>(element: &str, row: &[(usize, i64)], value: T) -> DirectionalTerm<T> {
    DirectionalTerm { element: element.into(), row: row.iter().map(|&(i, x)| (i, Rational::from(x))).collect(), value }
}

/// Two equal bodies of appendix B over (J, s, d); the force acts on the second.
fn two_bodies(p: &[Rational]) -> Option<ConstrainedSystem> {
    let [j, s, d] = [&p[0], &p[1], &p[2]];
    Some(ConstrainedSystem {
        coordinates: vec!["a".into(), "b".into()],
        inertias: vec![directional_term("a", &[(0, 1)], j.clone()), directional_term("b", &[(1, 1)], j.clone())],
        dampers: vec![
            directional_term("a", &[(0, 1)], d.clone()),
            directional_term("b", &[(1, 1)], d.clone()),
            directional_term("k", &[(0, 1), (1, -1)], d.clone()),
        ],
        springs: vec![directional_term("k", &[(0, 1), (1, -1)], s.clone())],
        loads: Vec::new(),
        constraints: vec![],
        inputs: vec![directional_term("m", &[(1, 1)], ())],
    })
}

fn parameter(name: &str, nominal: Rational, lower: Rational, upper: Rational) -> Parameter {
    Parameter { name: name.into(), nominal, lower, upper, unit: String::new(), confidence: None }
}

fn whole(x: i64) -> Rational {
    Rational::from(x)
}

fn angle(shaft: &str) -> OutputSignal {
    OutputSignal { name: format!("{shaft}.phi"), measured: Measured::Angle(shaft.into()) }
}

fn appendix_b_box() -> [Parameter; 3] {
    [
        parameter("J", whole(1), fraction(4, 5), fraction(6, 5)),
        parameter("s", whole(2), fraction(8, 5), fraction(12, 5)),
        parameter("d", fraction(1, 2), fraction(2, 5), fraction(3, 5)),
    ]
}

const NOMINAL: [Pole; 4] =
    [Complex::new(0.0, 0.0), Complex::new(-0.5, 0.0), Complex::new(-0.75, 1.854), Complex::new(-0.75, -1.854)];

/// Appendix B: controllability is lost on d² = sJ. From (1, 2, 1/2) with 20 % on each the nearest point moves all
/// three by the same part x: (1 + x)/(1 − x) = √8, x = (√8 − 1)/(√8 + 1), 5 x tolerances.
#[test]
fn appendix_b_is_found() {
    let p = appendix_b_box();
    let names = ["a".to_string(), "b".to_string()];
    let root = 8f64.sqrt();
    let expected = 5.0 * (root - 1.0) / (root + 1.0);
    for side in [Side::Inputs, Side::Outputs] {
        let outputs = [angle("b")];
        let family = Family::new(&p, &two_bodies, side, &outputs).unwrap();
        let loss = distance_to_uncontrollability(&family, &names, &NOMINAL, 32).unwrap();
        assert!((loss.distance - expected).abs() < 1e-9, "{loss:?}");
        let [j, s, d] = [0, 1, 2].map(|i| loss.at[i].value);
        assert!((d * d - s * j).abs() < 1e-12, "{loss:?}");
        // The mode that is lost moves the other body alone: λ = −s/d.
        assert!((loss.eigenvalue.re + s / d).abs() < 1e-9 && loss.eigenvalue.im == 0.0);
        assert_eq!(loss.shafts, [NamedShare { name: "a".into(), share: 1.0 }]);
        assert!(loss.residual < 1e-13);
    }
}

/// Each parameter alone: J = d²/s, s = d²/J, d = √(sJ); and tolerances that differ on the two sides.
#[test]
fn one_parameter_at_a_time() {
    let names = ["a".to_string(), "b".to_string()];
    let nominal = [whole(1), whole(2), whole(1)];
    for (k, at, lower, upper, distance) in [
        (0, 0.5, fraction(9, 10), fraction(12, 10), 5.0),
        (1, 1.0, fraction(15, 10), fraction(21, 10), 2.0),
        (2, 2f64.sqrt(), fraction(9, 10), fraction(12, 10), (2f64.sqrt() - 1.0) / 0.2),
    ] {
        let p = [parameter("p", nominal[k].clone(), lower, upper)];
        let build = |values: &[Rational]| {
            let mut all = nominal.clone();
            all[k] = values[0].clone();
            two_bodies(&all)
        };
        let family = Family::new(&p, &build, Side::Inputs, &[]).unwrap();
        let loss = distance_to_uncontrollability(
            &family,
            &names,
            &[Complex::default(), Complex::new(-1.0, 1.0), Complex::new(-2.0, 0.0)],
            32,
        )
        .unwrap();
        assert!((loss.at[0].value - at).abs() < 1e-10, "{loss:?}");
        assert!((loss.distance - distance).abs() < 1e-9, "{loss:?}");
    }
}

/// Tolerances that differ on the two sides, or exist on one only: within γ tolerances d² = sJ can be met unless the ends of
/// both sides keep apart.
#[test]
fn unequal_tolerances() {
    let names = ["a".to_string(), "b".to_string()];
    // J, s, d as (below, nominal, above), in ten thousandths.
    for values in [
        [(10000, 10000, 11615), (15840, 19600, 29880), (9273, 11510, 13683)],
        [(9700, 10000, 10000), (20000, 20000, 20040), (13000, 13400, 13400)],
        [(9999, 10000, 17000), (19900, 20000, 20000), (15000, 16000, 16001)],
        [(10000, 10000, 10200), (20000, 20000, 20300), (15000, 16000, 17000)],
    ] {
        let p = [0, 1, 2].map(|i| {
            let [low, nominal, high] = [values[i].0, values[i].1, values[i].2].map(|x: i64| fraction(x, 10_000));
            parameter(["J", "s", "d"][i], nominal, low, high)
        });
        let end = |i: usize, distance: f64, above: bool| {
            let (low, nominal, high) = (values[i].0 as f64, values[i].1 as f64, values[i].2 as f64);
            (nominal + distance * if above { high - nominal } else { low - nominal }) / 1e4
        };
        let (mut low, mut high) = (0.0, 10.0);
        let nominally_below = end(2, 0.0, true).powi(2) < end(0, 0.0, true) * end(1, 0.0, true);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let (d, product) =
                (end(2, middle, nominally_below), end(0, middle, !nominally_below) * end(1, middle, !nominally_below));
            if (d * d < product) == nominally_below { low = middle } else { high = middle }
        }
        let family = Family::new(&p, &two_bodies, Side::Inputs, &[]).unwrap();
        let loss = distance_to_uncontrollability(
            &family,
            &names,
            &[Complex::default(), Complex::new(-1.0, 0.0), Complex::new(-0.8, 1.3), Complex::new(-1.5, 1.0)],
            48,
        )
        .unwrap();
        assert!((loss.distance - low).abs() < 1e-8 * low, "{loss:?} instead of {low}");
    }
}

/// A loss just beyond an end that is the value itself does not lie in the box, and at no finite distance.
#[test]
fn a_zero_tolerance_side_bounds_the_box() {
    let source = kardan::model::builtin("two-bodies").unwrap().source;
    let with = |d: &str| {
        let source = source.replace("1 kg m^2 ± 20 %", "1 kg m^2").replace("2 N m/rad ± 20 %", "1 N m/rad");
        analysis(&source.replace("0.5 N m s/rad ± 20 %", d))
    };
    for search in both(&with("0.9999 N m s/rad [0.5, 0.9999]")) {
        assert_eq!((&search.nearest, search.box_verdict), (&None, BoxVerdict::Certified));
        assert_eq!(search.proven_distance, 10.0);
    }
    // Five tolerances of 0.00002.
    for search in both(&with("0.9999 N m s/rad [0.5, 0.99992]")) {
        assert!((search.nearest.as_ref().unwrap().distance - 5.0).abs() < 1e-6, "{search:?}");
        assert_eq!(search.box_verdict, BoxVerdict::Certified);
        assert!(search.proven_distance < 5.0 && search.proven_distance > 4.5);
    }
}

/// Twins that differ by 1e-10 of their stiffness are apart, if a parameter says so.
#[test]
fn a_small_distance_is_not_zero() {
    let tiny = |x: i64| fraction(x, 10_000_000_000_000);
    let build = |p: &[Rational]| {
        let spring = |other: i64, value: Rational| directional_term("s", &[(other as usize, 1), (1, -1)], value);
        Some(ConstrainedSystem {
            coordinates: ["a", "b", "c"].map(String::from).to_vec(),
            inertias: (0..3).map(|i| directional_term("j", &[(i, 1)], whole(1))).collect(),
            springs: vec![
                spring(0, whole(2)),
                spring(0, p[0].clone()),
                spring(2, whole(2)),
                // 5 % of a tolerance above p.
                spring(2, tiny(10_050)),
                directional_term("g", &[(1, 1)], whole(1)),
            ],
            inputs: vec![directional_term("m", &[(1, 1)], ())],
            ..ConstrainedSystem::default()
        })
    };
    let p = [parameter("p", tiny(10_000), tiny(9_000), tiny(11_000))];
    let family = Family::new(&p, &build, Side::Inputs, &[]).unwrap();
    let names = ["a", "b", "c"].map(String::from);
    let loss = distance_to_uncontrollability(
        &family,
        &names,
        &[Complex::new(0.0, 0.44), Complex::new(0.0, 1.5), Complex::new(0.0, 2.6)],
        48,
    )
    .unwrap();
    assert!((loss.distance - 0.05).abs() < 1e-3, "{loss:?}");
}

/// Without damping, a pendulum chain: a lost mode has imaginary λ. Bodies 1 and 3 hang on body 2 by springs s and t; a
/// force on body 2 cannot reach the motion of 1 against 3 where s/J₁ = t/J₃.
#[test]
fn undamped_twins_are_found() {
    let build = |p: &[Rational]| {
        Some(ConstrainedSystem {
            coordinates: ["a", "b", "c"].map(String::from).to_vec(),
            inertias: (0..3)
                .map(|i| directional_term("j", &[(i, 1)], if i == 0 { p[0].clone() } else { whole(1) }))
                .collect(),
            springs: vec![
                directional_term("s", &[(0, 1), (1, -1)], p[1].clone()),
                directional_term("t", &[(2, 1), (1, -1)], whole(3)),
                directional_term("g", &[(1, 1)], whole(1)),
            ],
            inputs: vec![directional_term("m", &[(1, 1)], ())],
            ..ConstrainedSystem::default()
        })
    };
    let p = [
        parameter("J", whole(1), fraction(9, 10), fraction(11, 10)),
        parameter("s", whole(2), fraction(18, 10), fraction(22, 10)),
    ];
    let family = Family::new(&p, &build, Side::Inputs, &[]).unwrap();
    let names = ["a", "b", "c"].map(String::from);
    let loss = distance_to_uncontrollability(
        &family,
        &names,
        &[Complex::new(0.0, 0.44), Complex::new(0.0, 1.5), Complex::new(0.0, 2.6)],
        48,
    )
    .unwrap();
    // 2 (1 + x) = 3 (1 − x): x = 1/5, two tolerances.
    assert!((loss.distance - 2.0).abs() < 1e-9, "{loss:?}");
    assert!((loss.at[0].value - 0.8).abs() < 1e-9 && (loss.at[1].value - 2.4).abs() < 1e-9, "{loss:?}");
    assert!(loss.eigenvalue.re.abs() < 1e-9 && (loss.eigenvalue.im - 3f64.sqrt()).abs() < 1e-9, "{loss:?}");
    let moving: Vec<&str> = loss.shafts.iter().map(|NamedShare { name, .. }| name.as_str()).collect();
    assert_eq!(BTreeSet::from_iter(moving), BTreeSet::from(["a", "c"]));
}

/// The twins again, behind gears of ratio i and 2: the ratio stands in the constraints.
#[test]
fn ratios_in_constraints_are_parameters_too() {
    // Shafts: m driven, g = i m behind a gear, a on a spring from g; h = 2 m, c on a spring from h.
    // The motion with m = g = h = 0 is a and c alone; it is reached unless both have the same λ and their torques on m
    // cancel: −i s a − 2 t c = 0 can always be met by a choice of a and c. So a loss needs s/Jₐ = t/J_c, for every i.
    let build = |p: &[Rational]| {
        let gear = |e: &str, k: usize, i: Rational| DirectionalTerm {
            element: e.into(),
            row: vec![(0, &Rational::ZERO - &i), (k, Rational::ONE)],
            value: (),
        };
        Some(ConstrainedSystem {
            coordinates: ["m", "g", "a", "h", "c"].map(String::from).to_vec(),
            inertias: [0, 2, 4].map(|k| directional_term("j", &[(k, 1)], whole(1))).to_vec(),
            springs: vec![
                directional_term("s", &[(1, -1), (2, 1)], p[1].clone()),
                directional_term("t", &[(3, -1), (4, 1)], whole(3)),
            ],
            constraints: vec![gear("u", 1, p[0].clone()), gear("v", 3, whole(2))],
            inputs: vec![directional_term("f", &[(0, 1)], ())],
            ..ConstrainedSystem::default()
        })
    };
    let p = [
        parameter("i", whole(5), fraction(9, 2), fraction(11, 2)),
        parameter("s", whole(2), fraction(18, 10), fraction(22, 10)),
    ];
    let family = Family::new(&p, &build, Side::Inputs, &[]).unwrap();
    assert!(family.exact().1.is_some(), "affine before reduction");
    let names = ["m", "g", "a", "h", "c"].map(String::from);
    let loss = distance_to_uncontrollability(
        &family,
        &names,
        &[Complex::default(), Complex::new(0.0, 7.0), Complex::new(0.0, 1.6)],
        48,
    )
    .unwrap();
    assert!((loss.distance - 5.0).abs() < 1e-9 && (loss.at[1].value - 3.0).abs() < 1e-9, "{loss:?}");
    assert_eq!(loss.at[0].value, 5.0, "the ratio does not matter");
}

/// A family that is not affine (products of parameters) gives what the affine one in the product gives.
#[test]
fn products_of_parameters() {
    let build = |p: &[Rational]| two_bodies(&[whole(1), &p[0] * &p[1], whole(1)]);
    let p = [
        parameter("x", whole(2), fraction(19, 10), fraction(21, 10)),
        parameter("y", whole(1), fraction(19, 20), fraction(21, 20)),
    ];
    let family = Family::new(&p, &build, Side::Inputs, &[]).unwrap();
    assert!(family.exact().1.is_none());
    let names = ["a".to_string(), "b".to_string()];
    let loss = distance_to_uncontrollability(
        &family,
        &names,
        &[Complex::default(), Complex::new(-1.0, 1.0), Complex::new(-2.0, 0.0)],
        32,
    )
    .unwrap();
    // 2 (1 − x)² = 1, 20 x tolerances.
    let x = 1.0 - 0.5f64.sqrt();
    assert!((loss.distance - 20.0 * x).abs() < 1e-8, "{loss:?}");
    assert!((loss.at[0].value * loss.at[1].value - 1.0).abs() < 1e-11);
}

/// With a force on each body nothing can be lost; with no parameters there is nothing to search.
#[test]
fn nothing_to_find() {
    let p = appendix_b_box();
    let build = |p: &[Rational]| {
        let mut system = two_bodies(p)?;
        system.inputs.push(directional_term("n", &[(0, 1)], ()));
        Some(system)
    };
    let family = Family::new(&p, &build, Side::Inputs, &[]).unwrap();
    let names = ["a".to_string(), "b".to_string()];
    assert_eq!(distance_to_uncontrollability(&family, &names, &NOMINAL, 32), None);
    let fixed = |_: &[Rational]| two_bodies(&[whole(1), whole(2), fraction(1, 2)]);
    let family = Family::new(&[], &fixed, Side::Inputs, &[]).unwrap();
    assert_eq!(distance_to_uncontrollability(&family, &names, &NOMINAL, 8), None);
    let none = |_: &[Rational]| None;
    assert!(Family::new(&p, &none, Side::Inputs, &[]).is_none());
}

/// The loss pencil loses rank where, and as often as, the exact structure says.
#[test]
fn uncontrollability_pencil_and_structure_agree() {
    for (s, d, defect) in [(1, 1, 1), (2, 1, 0), (4, 2, 1)] {
        let system = two_bodies(&[whole(1), whole(s), whole(d)]).unwrap();
        for side in [Side::Inputs, Side::Outputs] {
            let pencil = uncontrollability_pencil(&system, side, &[angle("b")]);
            let lambda = fraction(-s, d as u64);
            let at = pencil[0].plus(&pencil[1].scale(&lambda)).plus(&pencil[2].scale(&(&lambda * &lambda)));
            let rank = echelon(&at, &[0, 1]).rank();
            assert_eq!(rank, 2 - defect, "s = {s}, d = {d}");
        }
    }
}

/// A speed does not show where a free body stands, an angle does.
#[test]
fn a_speed_hides_the_rigid_motion() {
    let system = two_bodies(&[whole(1), whole(2), whole(0)]).unwrap();
    let rank =
        |output: OutputSignal| echelon(&uncontrollability_pencil(&system, Side::Outputs, &[output])[0], &[0, 1]).rank();
    assert_eq!(rank(OutputSignal { name: "b.w".into(), measured: Measured::Speed("b".into()) }), 1);
    assert_eq!(rank(angle("b")), 2);
}

/// A free body of inertia J under a force: W(1) = [1/3, 1/2; 1/2, 1]/J², whose smallest eigenvalue is μ/J² with
/// μ = (4 − √13)/6. With J uniform in [1, 3], `P(μ/J² < c) = (3 − √(μ/c))/2`.
#[test]
fn samples_follow_the_distribution() {
    let build = |p: &[Rational]| {
        Some(ConstrainedSystem {
            coordinates: vec!["a".into()],
            inertias: vec![directional_term("a", &[(0, 1)], p[0].clone())],
            inputs: vec![directional_term("m", &[(0, 1)], ())],
            ..ConstrainedSystem::default()
        })
    };
    let smallest = (4.0 - 13f64.sqrt()) / 6.0;
    let plan = SamplingPlan { samples: 4000, seed: 7, horizon: 1.0, threshold: Some(smallest / 4.0) };
    let mut p = [parameter("J", whole(2), whole(1), whole(3))];
    let run = |p: &[Parameter], plan: &SamplingPlan| {
        let family = Family::new(p, &build, Side::Inputs, &[]).unwrap();
        sample(&family, Side::Inputs, 1, &[0], plan, "x").unwrap()
    };
    let found = run(&p, &plan);
    assert!(found.interval.lower < 0.5 && 0.5 < found.interval.upper, "{found:?}");
    assert!(found.interval.upper - found.interval.lower < 0.04);
    assert!(found.smallest >= smallest / 9.0 * (1.0 - 1e-12) && found.largest <= smallest * (1.0 + 1e-12));
    assert_eq!(found, run(&p, &plan), "the seed decides");
    // An interval of 90 % confidence is left on either side by 5 % of a normal distribution: P(J > 3) = 0.05.
    p[0].confidence = Some(0.9);
    let found = run(&p, &SamplingPlan { threshold: Some(smallest / 9.0), ..plan });
    assert!(found.interval.lower < 0.05 && 0.05 < found.interval.upper, "{found:?}");
    // Without a threshold, a tenth of the nominal value.
    let found = run(&p, &SamplingPlan { threshold: None, ..plan });
    assert!((found.threshold - smallest / 40.0).abs() < 1e-12);
}

/// Sampled observability sees multipliers too: the torque of the rigid coupling of two bodies is that on the second one,
/// J₂ q̈ = J₂/(J₁ + J₂) times the damping torque of the first; the angle itself stays unseen.
#[test]
fn sampled_observability_of_a_constraint_torque() {
    let build = |p: &[Rational]| {
        Some(ConstrainedSystem {
            coordinates: vec!["a".into(), "b".into()],
            inertias: vec![directional_term("a", &[(0, 1)], p[0].clone()), directional_term("b", &[(1, 1)], whole(1))],
            springs: vec![directional_term("s", &[(0, 1)], whole(4))],
            constraints: vec![directional_term("c", &[(0, 1), (1, -1)], ())],
            ..ConstrainedSystem::default()
        })
    };
    let p = [parameter("J", whole(1), fraction(1, 2), fraction(3, 2))];
    let outputs =
        [OutputSignal { name: "torque".into(), measured: Measured::ConstraintTorque("c".into(), "b".into()) }];
    let family = Family::new(&p, &build, Side::Outputs, &outputs).unwrap();
    let plan = SamplingPlan { samples: 50, seed: 1, horizon: 1.0, threshold: Some(0.0) };
    let found = sample(&family, Side::Outputs, 2, &[0], &plan, "").unwrap();
    // y = ∓J₂ q̈ = ±4 q/(1 + J): W = (4/(1+J))² ∫ (cos ωt, sin ωt/ω)ᵀ(…) dt with ω² = 4/(1+J); speeds over the horizon.
    let smallest = |j: f64| {
        let w = (4.0 / (1.0 + j)).sqrt();
        let factor = (4.0 / (1.0 + j)).powi(2);
        let a = 0.5 + (2.0 * w).sin() / (4.0 * w);
        let b = w.sin().powi(2) / (2.0 * w * w);
        let c = (0.5 - (2.0 * w).sin() / (4.0 * w)) / (w * w);
        factor * (0.5 * (a + c) - (0.25 * (a - c) * (a - c) + b * b).sqrt())
    };
    assert!(found.smallest >= smallest(1.5) * (1.0 - 1e-9) && found.largest <= smallest(0.5) * (1.0 + 1e-9));
    assert!(found.smallest < smallest(1.3) && found.largest > smallest(0.7), "{found:?}");
}

fn analysis(source: &str) -> kardan::results::Analysis {
    kardan::study::analyze(source, &Default::default(), &kardan::study::Silent).unwrap()
}

fn both(analysis: &kardan::results::Analysis) -> [&DistanceToUncontrollability; 2] {
    let sensitivity = analysis.sensitivity.as_ref().expect("the model has tolerances");
    [sensitivity.controllability.as_ref().unwrap(), sensitivity.observability.as_ref().unwrap()]
}

/// The distance lies between what is proven and what is found.
#[test]
fn built_in_models_are_certified() {
    let two = analysis(kardan::model::builtin("two-bodies").unwrap().source);
    let root = 8f64.sqrt();
    let distance = 5.0 * (root - 1.0) / (root + 1.0);
    for search in both(&two) {
        let nearest = search.nearest.as_ref().unwrap();
        assert!((nearest.distance - distance).abs() < 1e-9);
        assert_eq!(search.box_verdict, BoxVerdict::Certified);
        // What is proven never reaches what is found, and comes close to it.
        assert!(search.proven_distance < distance && search.proven_distance > 0.95 * distance, "{search:?}");
        // In four digits, so that no report rounds it up.
        assert_eq!(format!("{:.3e}", search.proven_distance).parse(), Ok(search.proven_distance));
        assert_eq!(search.sampling.as_ref().unwrap().probability, 0.0);
    }
    let sia = analysis(kardan::model::builtin("sia-steering").unwrap().source);
    for search in both(&sia) {
        assert_eq!(search.box_verdict, BoxVerdict::Certified);
        assert!(search.nearest.as_ref().is_none_or(|loss| loss.distance > search.proven_distance));
    }
    // Without its spring the torsion bar shows nothing beyond it: ten tolerances of 10 %, and exact.
    let nearest = both(&sia)[1].nearest.as_ref().unwrap();
    assert_eq!((nearest.distance, nearest.residual), (10.0, 0.0));
    assert_eq!(
        nearest.at,
        [ParameterPoint { parameter: "torsion_bar.stiffness".into(), value: 0.0, unit: "N m/rad".into() }]
    );
}

#[test]
fn a_loss_inside_the_tolerances_is_reported_and_never_certified() {
    let source = kardan::model::builtin("two-bodies").unwrap().source.replace("± 20 %", "± 60 %");
    for search in both(&analysis(&source)) {
        let nearest = search.nearest.as_ref().unwrap();
        let [j, s, d] = ["J", "s", "d"].map(|name| nearest.at.iter().find(|at| at.parameter == name).unwrap().value);
        assert!((d * d - s * j).abs() < 1e-12 && nearest.distance < 1.0);
        assert_eq!(search.box_verdict, BoxVerdict::Lost);
        assert!(search.proven_distance < nearest.distance && search.proven_distance > 0.9 * nearest.distance);
    }
    // The nominal model itself: J = s = d = 1.
    let source = source.replace("\"2 N m/rad", "\"1 N m/rad").replace("\"0.5 N m s", "\"1 N m s");
    let controllability = analysis(&source).sensitivity.unwrap().controllability.unwrap();
    let nearest = controllability.nearest.unwrap();
    assert_eq!((nearest.distance, nearest.eigenvalue), (0.0, Complex::new(-1.0, 0.0)));
    assert_eq!(controllability.box_verdict, BoxVerdict::Lost);
}

/// A spring of 1e-17 N m/rad between two bodies: to rounding the second one is lost everywhere, in truth nowhere.
#[test]
fn a_loss_due_to_rounding_only_is_none() {
    let build = |p: &[Rational]| {
        let tiny = fraction(1, 100_000_000_000_000_000);
        Some(ConstrainedSystem {
            coordinates: ["a", "b"].map(String::from).to_vec(),
            inertias: vec![directional_term("a", &[(0, 1)], whole(1)), directional_term("b", &[(1, 1)], p[0].clone())],
            springs: vec![
                directional_term("s", &[(0, 1)], whole(1)),
                directional_term("t", &[(1, 1)], whole(2)),
                directional_term("k", &[(0, 1), (1, -1)], tiny),
            ],
            inputs: vec![directional_term("m", &[(0, 1)], ())],
            ..ConstrainedSystem::default()
        })
    };
    let p = [parameter("J", whole(1), fraction(9, 10), fraction(11, 10))];
    let family = Family::new(&p, &build, Side::Inputs, &[]).unwrap();
    let names = ["a", "b"].map(String::from);
    assert_eq!(
        distance_to_uncontrollability(
            &family,
            &names,
            &[Complex::new(0.0, 1.0), Complex { re: 0.0, im: 2f64.sqrt() }],
            32
        ),
        None
    );
}

#[test]
fn tolerances_that_do_not_matter_are_named() {
    let source = kardan::model::builtin("two-bodies")
        .unwrap()
        .source
        .replace("[shaft.body_1]\n", "[shaft.body_1]\nfriction = \"0.1 N m ± 10 %\"\n");
    let found = analysis(&source);
    let note = "these tolerances do not enter the linear model: body_1.friction";
    assert!(found.notes.iter().any(|n| n == note), "{:?}", found.notes);
}

/// Two bodies on one spring, driven at one end: lost where the spring vanishes and nowhere else.
#[test]
fn a_loss_at_zero_is_decided_exactly() {
    let source = "[model]\nname = \"m\"\n[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"2 kg m^2\"\n\
                  [spring_damper.k]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"2 N m/rad [0, 3]\"\n[motor.m]\nshaft = \"a\"\n\
                  [analysis]\noutputs = [\"a.phi\"]\nsamples = 10\n";
    for search in both(&analysis(source)) {
        let nearest = search.nearest.as_ref().unwrap();
        assert_eq!((nearest.distance, nearest.residual, nearest.eigenvalue), (1.0, 0.0, Complex::default()));
        assert_eq!(
            nearest.at,
            [ParameterPoint { parameter: "k.stiffness".into(), value: 0.0, unit: "N m/rad".into() }]
        );
        assert_eq!(nearest.shafts, [NamedShare { name: "b".into(), share: 1.0 }]);
        assert_eq!((search.box_verdict, search.method.as_str()), (BoxVerdict::Lost, "a loss was found in it, exactly"));
        assert!(search.proven_distance > 0.9 && search.proven_distance < 1.0, "{search:?}");
    }
}
