//! Analyses and designs made by hand, for tests of what displays and writes them, here and in other crates.

use super::*;

fn texts(words: &[&str]) -> Vec<String> {
    words.iter().map(|&word| word.into()).collect()
}

fn named(pairs: &[(&str, f64)]) -> Vec<(String, f64)> {
    pairs.iter().map(|&(name, value)| (name.into(), value)).collect()
}

fn matrix(title: &str, unit: &str, names: &[&str], columns: &[&str], values: &[&[f64]]) -> NamedMatrix {
    NamedMatrix {
        title: title.into(),
        unit: unit.into(),
        rows: texts(names),
        columns: texts(columns),
        values: values.iter().map(|row| row.to_vec()).collect(),
    }
}

fn bounds(matrix: &str, unit: &str, eigenvalues: &[f64], centres: &[f64], radii: &[f64]) -> EigenvalueBounds {
    EigenvalueBounds {
        matrix: matrix.into(),
        unit: unit.into(),
        eigenvalues: eigenvalues.to_vec(),
        centres: centres.to_vec(),
        radii: radii.to_vec(),
    }
}

fn entries(list: &[(usize, usize, i64)]) -> Vec<(usize, usize, String)> {
    list.iter().map(|&(row, column, value)| (row, column, value.to_string())).collect()
}

const PRIME: u64 = (1 << 61) - 1;

/// Two bodies with J = 1 kg m^2, s = 1 N m/rad and d = 1 N m s/rad, hence d² = s J: one motor cannot control them.
pub fn two_bodies() -> Analysis {
    let bodies = ["body_1", "body_2"];
    let mode = |eigenvalue: f64, shape: [f64; 2], factor: &str, good: bool| Mode {
        eigenvalue: (eigenvalue, 0.0),
        natural_frequency: eigenvalue.abs(),
        damping_ratio: 1.0,
        shape: vec![("body_1".into(), shape[0], 0.0), ("body_2".into(), shape[1], 0.0)],
        stored: vec![
            ("body_1".into(), EnergyKind::Kinetic, 0.25),
            ("body_2".into(), EnergyKind::Kinetic, 0.25),
            ("spring".into(), EnergyKind::Potential, 0.5),
        ],
        dissipated: named(&[("spring", 0.6), ("body_1", 0.2), ("body_2", 0.2)]),
        factor: factor.into(),
        controllable: good,
        observable: good,
    };
    let factor = |polynomial: &str, root: f64, times: usize, defect: usize| Factor {
        polynomial: polynomial.into(),
        roots: vec![(root, 0.0)],
        algebraic: times,
        geometric: times,
        input_defect: defect,
        output_defect: defect,
    };
    let failing = |shafts: &[(&str, f64)]| FailingMode {
        factor: "s + 1".into(),
        eigenvalue: (-1.0, 0.0),
        defect: 1,
        shafts: named(shafts),
        elements: named(&[("spring", 0.5), ("body_2", 0.5)]),
    };
    let minor = |columns: &[(usize, usize)], rows: &[usize]| Minor {
        prime: PRIME,
        columns: columns.to_vec(),
        rows: rows.to_vec(),
        value: 1,
    };
    let full = || minor(&[(0, 0), (1, 0), (0, 1), (1, 1)], &[0, 1, 2, 3]);
    let search = |places: &[&str], measure: &str| PlacementSearch {
        candidates: places.iter().map(|&place| (place.into(), 1.0)).collect(),
        method: "only all 2 places together are enough".into(),
        exhaustive: true,
        gap: 0.0,
        tried: 1,
        sets: vec![PlacedSet { places: texts(places), cost: 2.0, score: 0.0123, efficient: true }],
        measure: measure.into(),
        unit: "rad^2".into(),
        larger_is_better: true,
        none_because: None,
    };
    let loss = |shaft: &str| LossSearch {
        nearest: Some(Loss {
            distance: 0.0,
            at: vec![("d".into(), 1.0, "N m s/rad".into()), ("s".into(), 1.0, "N m/rad".into())],
            eigenvalue: (-1.0, 0.0),
            residual: 1e-16,
            shafts: named(&[(shaft, 1.0)]),
        }),
        starts: 0,
        proven_distance: 0.0,
        box_verdict: BoxVerdict::Lost,
        method: "the nominal model itself is on the border".into(),
        sampling: None,
    };
    Analysis {
        unfinished: None,
        name: "two-bodies".into(),
        elimination: None,
        description: "Two equal bodies joined by a spring and a damper".into(),
        class: Some(Class {
            constant_linear: true,
            assumptions: [
                "the inertia matrix is constant, symmetric and positive definite (4.27)",
                "the damping matrix is constant, symmetric and positive semidefinite (4.28)",
                "the stiffness matrix is constant, symmetric and positive semidefinite (4.29)",
                "the input matrix is constant (4.30)",
                "the constraints are linear with constant coefficients (4.31)",
            ]
            .map(|statement| Assumption { statement: statement.into(), holds: true, breaches: vec![] })
            .to_vec(),
            constraints: vec![],
            operating_point: OperatingPoint { angles: named(&[("body_1", 0.0), ("body_2", 0.0)]), friction: vec![] },
        }),
        coordinates: texts(&bodies),
        bases: vec![Basis {
            name: "chosen coordinates".into(),
            basis: matrix("basis of the constraint kernel", "", &bodies, &bodies, &[&[1.0, 0.0], &[0.0, 1.0]]),
            inertia: matrix("reduced inertia", "kg m^2", &bodies, &bodies, &[&[1.0, 0.0], &[0.0, 1.0]]),
            damping: matrix("reduced damping", "N m s/rad", &bodies, &bodies, &[&[2.0, -1.0], &[-1.0, 2.0]]),
            stiffness: matrix("reduced stiffness", "N m/rad", &bodies, &bodies, &[&[1.0, -1.0], &[-1.0, 1.0]]),
            input: matrix("input map", "", &bodies, &["motor_1"], &[&[1.0], &[0.0]]),
            orthogonality: 0.0,
            bounds: vec![
                bounds("inertia", "kg m^2", &[1.0, 1.0], &[1.0, 1.0], &[0.0, 0.0]),
                bounds("damping", "N m s/rad", &[1.0, 3.0], &[2.0, 2.0], &[1.0, 1.0]),
                bounds("stiffness", "N m/rad", &[0.0, 2.0], &[1.0, 1.0], &[1.0, 1.0]),
            ],
        }],
        constraint_forces: None,
        modes: vec![
            Mode { stored: vec![], dissipated: vec![], ..mode(0.0, [1.0, 1.0], "s", true) },
            mode(-1.0, [1.0, 1.0], "s + 1", false),
            mode(-1.0, [1.0, -1.0], "s + 1", false),
            mode(-2.0, [1.0, -1.0], "s + 2", true),
        ],
        structure: Structure {
            states: texts(&["body_1.phi", "body_2.phi", "body_1.w", "body_2.w"]),
            inputs: texts(&["motor_1"]),
            outputs: texts(&["body_2.phi"]),
            controllable_rank: 3,
            observable_rank: 3,
            undecided: [false; 2],
            factors: vec![factor("s", 0.0, 1, 0), factor("s + 1", -1.0, 2, 1), factor("s + 2", -2.0, 1, 0)],
            uncontrollable: vec![failing(&[("body_2", 1.0)])],
            unobservable: vec![failing(&[("body_1", 1.0)])],
            relative_degrees: vec![vec![Some(3)]],
            zeros: Zeros { polynomial: "s + 1".into(), values: vec![(-1.0, 0.0)], growing: Some(0), normal_rank: 1 },
            invariant_factors: texts(&["s + 1", "s^3 + 3 s^2 + 2 s"]),
            min_inputs: 2,
            min_outputs: 2,
            kind: "general".into(),
            construction: Some(Construction {
                rows: texts(&["body_1", "body_2"]),
                input: vec![texts(&["1", "0"]), texts(&["0", "1"])],
                steps: [(2, 0, ["1", "0"]), (1, 1, ["0", "1"])]
                    .map(|(defect, column, direction)| ConstructionStep {
                        factor: "s + 1".into(),
                        defect,
                        column,
                        direction: texts(&direction),
                        multiplier: "1".into(),
                    })
                    .to_vec(),
            }),
            certificate: Certificate {
                proven: true,
                failure_probability: 0.0,
                primes: vec![PRIME],
                statements: texts(&["the ranks hold over the rationals: minors that do not vanish, and exact vectors"]),
                pencil: vec![
                    ("E".into(), entries(&[(0, 0, 1), (1, 1, 1), (2, 2, 1), (3, 3, 1)])),
                    (
                        "A".into(),
                        entries(&[
                            (0, 2, 1),
                            (1, 3, 1),
                            (2, 0, -1),
                            (2, 1, 1),
                            (2, 2, -2),
                            (2, 3, 1),
                            (3, 0, 1),
                            (3, 1, -1),
                            (3, 2, 1),
                            (3, 3, -2),
                        ]),
                    ),
                    ("B".into(), entries(&[(2, 0, 1)])),
                    ("C".into(), entries(&[(0, 1, 1)])),
                    ("D".into(), vec![]),
                ],
                inputs: Some(Count {
                    number: 2,
                    witness: vec![vec![0, 0], vec![0, 0], vec![1, 0], vec![0, 1]],
                    minor: full(),
                    common_factor: texts(&["1", "1"]),
                    rows: vec![texts(&["1", "-1", "1", "0"]), texts(&["-1", "1", "0", "1"])],
                }),
                outputs: Some(Count {
                    number: 2,
                    witness: vec![vec![1, 0], vec![0, 1], vec![0, 0], vec![0, 0]],
                    minor: full(),
                    common_factor: texts(&["1", "1"]),
                    rows: vec![texts(&["1", "0", "-1", "0"]), texts(&["0", "1", "0", "-1"])],
                }),
                unreached: Some(Invariant { rows: vec![texts(&["-1", "1", "0", "1"])], action: vec![texts(&["-1"])] }),
                unseen: Some(Invariant { rows: vec![texts(&["1", "0", "-1", "0"])], action: vec![texts(&["-1"])] }),
                reached: Some(minor(&[(0, 0), (0, 1), (0, 2)], &[0, 1, 2])),
                seen: Some(minor(&[(0, 0), (0, 1), (0, 2)], &[0, 1, 2])),
            },
        },
        placement: Placement {
            inputs: Some(search(&bodies, "smallest eigenvalue of the Gramian over 1 s")),
            outputs: Some(search(&["body_1.phi", "body_2.phi"], "smallest eigenvalue of the Gramian over 1 s")),
        },
        sensitivity: Some(Sensitivity {
            parameters: vec![
                ("d".into(), 1.0, 0.9, 1.1, "N m s/rad".into()),
                ("s".into(), 1.0, 0.9, 1.1, "N m/rad".into()),
            ],
            controllability: Some(loss("body_2")),
            observability: Some(loss("body_1")),
        }),
        notes: texts(&["The outputs are those of the scenario."]),
    }
}

/// A chain of eight shafts with a universal joint and friction: everything that two bodies do not show.
pub fn train() -> Analysis {
    let shafts = ["driver", "flexspline", "motor", "output", "rack", "shaft_3", "wave_generator", "wheel"];
    let springs = ["bar", "belt", "coupling", "joint", "mesh", "teeth", "tyre"];
    let pi = std::f64::consts::PI;
    let modes: Vec<Mode> = (0..8)
        .map(|k| {
            let w = [0.0, 3.1, 41.0, 97.0, 260.0, 640.0, 1800.0, 5200.0][k];
            let zeta: f64 = [1.0, 0.21, 0.05, 0.02, 0.11, 0.33, 0.04, 0.6][k];
            let amplitude = |i: usize| (pi * k as f64 * (i as f64 + 0.5) / 8.0).cos();
            let largest = (0..8).map(|i| amplitude(i).abs()).fold(0.0, f64::max);
            let share = |i: usize| amplitude(i).powi(2) / (0..8).map(|i| amplitude(i).powi(2)).sum::<f64>();
            let shape = |i: usize| {
                let value = amplitude(i) / largest;
                (shafts[i].to_string(), value, if k == 1 { 0.4 * value * value } else { 0.0 })
            };
            let kinetic = (0..8).map(|i| (shafts[i].to_string(), EnergyKind::Kinetic, 0.5 * share(i)));
            let potential = (0..7).map(|i| {
                let stretch = (amplitude(i) - amplitude(i + 1)).powi(2);
                let all: f64 = (0..7).map(|i| (amplitude(i) - amplitude(i + 1)).powi(2)).sum();
                (springs[i].to_string(), EnergyKind::Potential, 0.5 * stretch / all)
            });
            Mode {
                eigenvalue: (-zeta * w, w * (1.0 - zeta * zeta).max(0.0).sqrt()),
                natural_frequency: w,
                damping_ratio: zeta,
                shape: (0..8).map(shape).collect(),
                stored: if k == 0 { vec![] } else { kinetic.chain(potential).collect() },
                dissipated: if k == 0 { vec![] } else { named(&[("tyre", 0.7), ("bar", 0.2), ("wheel", 0.1)]) },
                factor: if k == 0 { "s^2".into() } else { format!("s^2 + {} s + {}", 2.0 * zeta * w, w * w) },
                controllable: k != 3,
                observable: k != 5,
            }
        })
        .collect();
    let failing = |mode: &Mode| FailingMode {
        factor: mode.factor.clone(),
        eigenvalue: mode.eigenvalue,
        defect: 1,
        shafts: named(&[("driver", 1.0), ("wheel", 0.8), ("rack", 0.35), ("motor", 0.2), ("output", 0.1)]),
        elements: named(&[("tyre", 0.5), ("wheel", 0.5)]),
    };
    let base = two_bodies();
    let set = |places: &[&str], cost: f64, score: f64| PlacedSet {
        places: texts(places),
        cost,
        score,
        efficient: cost < 3.0,
    };
    Analysis {
        unfinished: None,
        name: "train".into(),
        elimination: Some(Elimination {
            motions: 1,
            direction: "joint - 2 rack".into(),
            removed: texts(&["joint.w", "rack.w"]),
            definitions: vec![("z1".into(), "2 joint.w + rack.w".into())],
        }),
        description: "A chain of eight shafts.\n\nIt has a universal joint and friction.".into(),
        class: Some(Class {
            constant_linear: false,
            assumptions: vec![
                Assumption {
                    statement: "the inertia matrix is constant, symmetric and positive definite (4.27)".into(),
                    holds: true,
                    breaches: vec![],
                },
                Assumption {
                    statement: "the damping is linear (4.28)".into(),
                    holds: false,
                    breaches: vec![("rack_friction".into(), "Coulomb friction of 10.8 N m".into())],
                },
                Assumption {
                    statement: "the constraints are linear with constant coefficients (4.31)".into(),
                    holds: false,
                    breaches: vec![("joint".into(), "its ratio depends on the angle of driver".into())],
                },
            ],
            constraints: vec![
                ConstraintClass {
                    element: "harmonic".into(),
                    equation: "wave_generator + 50 flexspline - 51 output = 0".into(),
                    equality: true,
                    holonomic: true,
                    scleronomic: true,
                    linear: true,
                },
                ConstraintClass {
                    element: "joint".into(),
                    equation: "shaft_3 - atan(tan(driver) / cos(beta)) = 0".into(),
                    equality: true,
                    holonomic: true,
                    scleronomic: true,
                    linear: false,
                },
            ],
            operating_point: OperatingPoint {
                angles: named(&[("driver", 0.3), ("rack", 0.0), ("shaft_3", 0.31)]),
                friction: vec![("rack_friction".into(), 10.8, true), ("column_friction".into(), 0.2, false)],
            },
        }),
        coordinates: texts(&shafts[..6]),
        constraint_forces: Some(ConstraintForces {
            projector: matrix("projector", "", &["driver", "shaft_3"], &["driver", "shaft_3"], &[&[0.5; 2], &[0.5; 2]]),
            rank: 1,
            idempotence_residual: 2.2e-16,
            input_to_torque: matrix("torque", "", &["driver", "shaft_3"], &["motor"], &[&[-0.5], &[-0.5]]),
            input_to_multiplier: matrix("multiplier", "", &["joint"], &["motor"], &[&[0.5]]),
        }),
        structure: Structure {
            states: shafts.iter().flat_map(|shaft| [format!("{shaft}.phi"), format!("{shaft}.w")]).collect(),
            inputs: texts(&["motor", "wheel_motor"]),
            outputs: texts(&["rack.phi", "driver.tau", "wheel.w"]),
            controllable_rank: 14,
            observable_rank: 14,
            undecided: [false; 2],
            factors: vec![Factor {
                polynomial: "s^2".into(),
                roots: vec![(0.0, 0.0)],
                algebraic: 2,
                geometric: 1,
                input_defect: 0,
                output_defect: 0,
            }],
            uncontrollable: vec![failing(&modes[3])],
            unobservable: vec![failing(&modes[5])],
            relative_degrees: vec![vec![Some(2), Some(4)], vec![Some(1), None], vec![None, Some(1)]],
            zeros: Zeros {
                polynomial: "s^3 + 21 s^2 + 10100 s + 100000".into(),
                values: vec![(-10.0, 0.0), (-5.5, 99.9), (-5.5, -99.9), (420.0, 0.0)],
                growing: Some(1),
                normal_rank: 2,
            },
            invariant_factors: texts(&["s^16 + 1"]),
            min_inputs: 1,
            min_outputs: 1,
            kind: "general".into(),
            construction: None,
            certificate: Certificate {
                proven: false,
                failure_probability: 3.1e-17,
                primes: vec![PRIME, 2_305_843_009_213_693_921],
                statements: texts(&["the ranks are those modulo two primes"]),
                inputs: Some(Count {
                    number: 1,
                    witness: vec![vec![1]; 16],
                    minor: Minor {
                        prime: PRIME,
                        columns: (0..16).map(|power| (0, power)).collect(),
                        rows: (0..16).collect(),
                        value: 7,
                    },
                    common_factor: texts(&["0", "1"]),
                    rows: vec![],
                }),
                ..Certificate::default()
            },
        },
        placement: Placement {
            inputs: Some(PlacementSearch {
                candidates: shafts.iter().map(|&shaft| (shaft.into(), 1.0)).collect(),
                method: "bounded search".into(),
                exhaustive: false,
                gap: 0.125,
                tried: 4711,
                sets: (0..14)
                    .map(|k| set(&[shafts[k % 8], shafts[(k + 1 + k / 8) % 8]], 2.0, 8.3e-3 * 0.7f64.powi(k as i32)))
                    .collect(),
                measure: "smallest eigenvalue of the Gramian over 1 s".into(),
                unit: "rad^2/(N m)^2 s".into(),
                larger_is_better: true,
                none_because: None,
            }),
            outputs: Some(PlacementSearch {
                candidates: named(&[("rack.phi", 1.0), ("wheel.w", 3.0)]),
                method: "only all 2 places together are enough".into(),
                exhaustive: true,
                tried: 3,
                none_because: Some("no candidate shows driver and flexspline moving against each other".into()),
                ..PlacementSearch::default()
            }),
        },
        sensitivity: Some(Sensitivity {
            parameters: vec![
                ("bar_stiffness".into(), 120.0, 108.0, 132.0, "N m/rad".into()),
                ("rack_inertia".into(), 0.0042, 0.0040, 0.0044, "kg m^2".into()),
            ],
            controllability: Some(LossSearch {
                nearest: Some(Loss {
                    distance: 2.4,
                    at: vec![
                        ("bar_stiffness".into(), 148.8, "N m/rad".into()),
                        ("rack_inertia".into(), 0.00372, "kg m^2".into()),
                    ],
                    eigenvalue: (-1.2, 88.0),
                    residual: 4e-13,
                    shafts: named(&[("rack", 1.0), ("wheel", 0.4)]),
                }),
                starts: 96,
                proven_distance: 0.0,
                box_verdict: BoxVerdict::NotCertified,
                method: "interval bounds on 512 parts of the box; 3 remain open".into(),
                sampling: Some(Sampling {
                    samples: 10_000,
                    seed: 1,
                    threshold: 1e-9,
                    unit: "rad^2".into(),
                    probability: 0.0012,
                    interval: (0.0007, 0.0021),
                    quantiles: (3.2e-10, 4.4e-6, 9.1e-5),
                }),
            }),
            observability: Some(LossSearch {
                nearest: None,
                starts: 96,
                proven_distance: 4.0,
                box_verdict: BoxVerdict::Certified,
                method: "interval bounds on 16 parts of the box".into(),
                sampling: None,
            }),
        }),
        bases: base.bases,
        modes,
        notes: texts(&[
            "Friction directions at rest are constraints: rack_friction.",
            "The outputs are those of the scenario.",
        ]),
    }
}

/// Names that are markup, numbers that are not finite, lists of unequal length.
pub fn hostile(bad: &str) -> Analysis {
    let mut analysis = two_bodies();
    let bad = || bad.to_string();
    analysis.name = bad();
    analysis.description = bad();
    analysis.coordinates = vec![bad()];
    analysis.notes = vec![bad()];
    analysis.elimination =
        Some(Elimination { motions: 2, direction: bad(), removed: vec![bad(); 50], definitions: vec![(bad(), bad())] });
    if let Some(class) = &mut analysis.class {
        class.constant_linear = false;
        class.assumptions[1].holds = false;
        class.assumptions[1].breaches = vec![(bad(), bad())];
        class.constraints = vec![ConstraintClass { element: bad(), equation: bad(), ..ConstraintClass::default() }];
        class.operating_point =
            OperatingPoint { angles: vec![(bad(), f64::NAN)], friction: vec![(bad(), f64::INFINITY, true)] };
    }
    let mode = &mut analysis.modes[1];
    mode.eigenvalue = (f64::NAN, f64::INFINITY);
    mode.natural_frequency = f64::NAN;
    mode.damping_ratio = f64::NAN;
    mode.shape = vec![(bad(), f64::NAN, f64::INFINITY), ("wheel".into(), -7.0, 0.0)];
    mode.stored = vec![(bad(), EnergyKind::Potential, f64::NAN), ("wheel".into(), EnergyKind::Kinetic, 3.0)];
    mode.dissipated = vec![(bad(), f64::NEG_INFINITY)];
    mode.factor = bad();
    let structure = &mut analysis.structure;
    structure.states[0] = bad();
    structure.inputs[0] = bad();
    structure.outputs = vec![bad(), bad()];
    structure.kind = bad();
    structure.zeros = Zeros { polynomial: bad(), values: vec![(f64::NAN, 0.0)], growing: None, normal_rank: 1 };
    structure.factors[0].polynomial = bad();
    structure.factors[0].roots = vec![(f64::NAN, 1.0)];
    structure.uncontrollable[0].shafts = vec![(bad(), f64::NAN)];
    structure.uncontrollable[0].elements = vec![(bad(), f64::NAN)];
    structure.certificate.statements = vec![bad()];
    structure.certificate.failure_probability = f64::NAN;
    structure.certificate.proven = false;
    analysis.bases[0].name = bad();
    analysis.bases[0].orthogonality = f64::NAN;
    analysis.bases[0].bounds[0].eigenvalues.clear();
    analysis.bases[0].bounds[1].centres = vec![f64::NAN];
    if let Some(search) = &mut analysis.placement.inputs {
        search.measure = bad();
        search.unit = bad();
        search.none_because = Some(bad());
        search.sets = [f64::NAN, -1.0, 0.0, f64::INFINITY]
            .map(|score| PlacedSet { places: vec![bad()], cost: f64::NAN, score, efficient: false })
            .to_vec();
    }
    if let Some(sensitivity) = &mut analysis.sensitivity {
        sensitivity.parameters[0] = (bad(), f64::NAN, f64::NAN, f64::NAN, bad());
        if let Some(Some(loss)) = sensitivity.controllability.as_mut().map(|search| search.nearest.as_mut()) {
            loss.at[0] = (bad(), f64::NAN, bad());
            loss.shafts = vec![(bad(), f64::NAN)];
            loss.distance = f64::NAN;
        }
    }
    analysis
}

fn exact(name: &str, title: &str, unit: &str, rows: &[&str], columns: &[&str], entries: &[&[&str]]) -> ExactMatrix {
    let value = |text: &str| {
        let (above, below) = text.split_once('/').unwrap_or((text, "1"));
        above.parse::<f64>().unwrap() / below.parse::<f64>().unwrap()
    };
    ExactMatrix {
        name: name.into(),
        title: title.into(),
        unit: unit.into(),
        rows: texts(rows),
        columns: texts(columns),
        values: entries.iter().map(|row| row.iter().map(|&text| value(text)).collect()).collect(),
        exact: Some(entries.iter().map(|row| texts(row)).collect()),
    }
}

fn coupling(reference: &str, output: &str, own: bool, peak: f64, rms: f64) -> CrossCoupling {
    CrossCoupling {
        reference: reference.into(),
        step: 1.0,
        step_unit: "rad".into(),
        output: output.into(),
        unit: "rad".into(),
        own,
        peak,
        rms,
        window: 2.0,
        failure: None,
    }
}

/// The steering system with rack and wheel decoupled by static feedback: exact, and stable but for little damping.
pub fn decoupled_steering() -> Design {
    let states = ["rk.phi", "fs.phi", "cj.phi", "rk.w", "fs.w", "cj.w"];
    let (inputs, outputs, references) = (["wg_motor", "rk_motor"], ["rk.phi", "fs.phi"], ["ref_rk", "ref_fs"]);
    let state_gain: [&[&str]; 2] = [
        &["-25500/11", "-26087/55", "25500/11", "-51/110", "-338911/11000", "1989/4400"],
        &["-80", "0", "100", "137/100", "0", "1/50"],
    ];
    let gains = vec![
        exact("K", "state gain, u = -K x + L r", "", &inputs, &states, &state_gain),
        exact("L", "reference gain", "N m/rad", &inputs, &references, &[&["0", "-26087/55"], &["20", "0"]]),
    ];
    let pair = |re: f64, im: f64| [(re, im), (re, -im)];
    let channel = |output: &str, reference: &str| ChannelResult {
        output: output.into(),
        reference: reference.into(),
        kind: "position".into(),
        transfer: "400/(s^2 + 28 s + 400)".into(),
        poles: pair(-14.0, 14.282_856_857_085_7).to_vec(),
    };
    let entry = |output: &str, reference: &str, own: bool| TransferEntry {
        output: output.into(),
        reference: reference.into(),
        numerator: if own { texts(&["400"]) } else { vec![] },
        denominator: if own { texts(&["400", "28", "1"]) } else { texts(&["1"]) },
    };
    let zero = (-93.636_363_636_363_6, 948.853_587_154);
    Design {
        unfinished: None,
        model: "sia-steering".into(),
        description: "Car steering with a harmonic drive in differential mode.".into(),
        variant: "beta-0deg".into(),
        controller: "column".into(),
        law: "decoupling".into(),
        others: texts(&["driver_model"]),
        design_model: "linear, at the initial position, beta = 0 deg".into(),
        states: texts(&states),
        inputs: texts(&inputs),
        outputs: texts(&outputs),
        definitions: vec![],
        hidden: vec![],
        relative_degrees: vec![Some(2), Some(2)],
        decoupling_matrix: exact(
            "G",
            "decoupling matrix",
            "rad/(N m s^2)",
            &outputs,
            &inputs,
            &[&["0", "20"], &["-22000/26087", "0"]],
        ),
        decouplability: Decouplability { rank: 2, normal_rank: 2, ..Decouplability::default() },
        feedback: Some(Feedback::Static),
        observer_data: None,
        blocks_decoupled: None,
        cancels_zeros: true,
        controller_data: ControllerData {
            block: "StateSpace".into(),
            reads: states
                .iter()
                .chain(&references)
                .map(|&name| (name.into(), if name.ends_with(".w") { "rad/s" } else { "rad" }.into()))
                .collect(),
            writes: texts(&inputs),
            sample_time: None,
            single: false,
            matrices: gains.iter().map(|gain| (gain.name.clone(), gain.values.clone())).collect(),
            numbers: named(&[("filter", 0.1)]),
        },
        gains,
        canonical: None,
        channels: vec![channel("rk.phi", "ref_rk"), channel("fs.phi", "ref_fs")],
        exact_poles: true,
        closed_loop_poles: [pair(-14.0, 14.282_856_857_085_7), pair(-14.0, 14.282_856_857_085_7), pair(zero.0, zero.1)]
            .concat(),
        zero_dynamics: ZeroDynamics {
            polynomial: "11 s^2 + 2060 s + 10000000".into(),
            modes: vec![ZeroMode {
                pole: zero,
                natural_frequency: 953.462_589_245_6,
                damping_ratio: 0.098_206_697_3,
                stored: named(&[("torsion_bar", 0.5), ("wg", 0.499_577), ("cs", 0.000_384), ("cj", 0.000_039)]),
                dissipated: named(&[("wg", 0.984), ("torsion_bar", 0.015), ("cs", 0.001)]),
                shape: vec![("wg".into(), 1.0, 0.0), ("cj".into(), 0.0196, 0.0), ("cs".into(), 0.0196, 0.0)],
                warning: Some("lightly damped: 0.098 of critical; what excites it rings for 0.04 s".into()),
            }],
            stable: true,
        },
        observer: None,
        transfer: vec![
            entry("rk.phi", "ref_rk", true),
            entry("rk.phi", "ref_fs", false),
            entry("fs.phi", "ref_rk", false),
            entry("fs.phi", "ref_fs", true),
        ],
        decoupled: Some(true),
        cross_coupling: vec![
            coupling("ref_rk", "rk.phi", true, 1.0460, 0.8912),
            coupling("ref_rk", "fs.phi", false, 0.0, 0.0),
            coupling("ref_fs", "rk.phi", false, 2.41e-4, 1.1e-4),
            coupling("ref_fs", "fs.phi", true, 1.0460, 0.8907),
        ],
        margins: None,
        strains: Vec::new(),
        exploration: None,
        passage: None,
        robustness: None,
        flatness: Some(Flatness {
            outputs: texts(&outputs),
            flat: false,
            remainder: "11 s^2 + 2060 s + 10000000".into(),
            poles: pair(zero.0, zero.1).to_vec(),
            derivatives: vec![4, 4],
            statement: "Not flat: what the outputs leave open follows from a filter of order 2.".into(),
        }),
        warnings: texts(&["The law cancels a mode at -93.636 ± 948.85 j 1/s with 0.098 of critical damping."]),
        notes: texts(&["Channel dynamics that the file does not give: 20 rad/s, damping ratio 0.7."]),
    }
}

/// A torque controller with an observer after a reduction, dynamic feedback, and everything that went wrong: what the
/// steering system does not show.
pub fn observed_train() -> Design {
    let names: Vec<String> = (1..=14).map(|k| format!("z{k}")).collect();
    let states: Vec<&str> = names.iter().map(String::as_str).collect();
    let inputs = ["motor", "wheel_motor", "belt_motor"];
    let outputs = ["rack.phi", "driver.tau", "wheel.w"];
    let wild = |i: usize, j: usize| (1.7 + 31.3 * i as f64 + j as f64).sin() * 10f64.powi(j as i32 % 7);
    let floating = |name: &str, title: &str, unit: &str, rows: &[&str], columns: &[&str]| ExactMatrix {
        name: name.into(),
        title: title.into(),
        unit: unit.into(),
        rows: texts(rows),
        columns: texts(columns),
        values: (0..rows.len()).map(|i| (0..columns.len()).map(|j| wild(i, j)).collect()).collect(),
        exact: None,
    };
    let small = |name: &str| exact(name, "", "", &["1", "2"], &["1", "2"], &[&["0", "1"], &["-2", "-3/7"]]);
    let gains = vec![
        floating("K", "state gain, u = -K x + L r", "N m", &inputs, &states),
        floating("L", "reference gain", "", &inputs, &["ref_rack", "ref_torque", "ref_wheel"]),
    ];
    let entry = |output: &str, reference: &str, numerator: &[&str]| TransferEntry {
        output: output.into(),
        reference: reference.into(),
        numerator: texts(numerator),
        denominator: texts(&["1000000/7", "3300000/11", "12345/7", "21", "1"]),
    };
    Design {
        model: "train".into(),
        description: "A chain of eight shafts.\n\nIt has a universal joint and friction.".into(),
        variant: "train".into(),
        controller: "design".into(),
        law: "lqr".into(),
        design_model: "linear, at the initial position".into(),
        states: names.clone(),
        inputs: texts(&inputs),
        outputs: texts(&outputs),
        definitions: names.iter().map(|z| (z.clone(), "wg.phi - 51 rk.phi + 50 fs.phi".into())).collect(),
        hidden: vec![(-3.0, 4.0), (-3.0, -4.0), (0.0, 0.0)],
        relative_degrees: vec![Some(2), Some(4), None],
        decoupling_matrix: exact(
            "G",
            "decoupling matrix",
            "",
            &outputs,
            &inputs,
            &[&["1/3", "0", "0"], &["2/3", "0", "0"], &["0", "0", "0"]],
        ),
        decouplability: Decouplability {
            rank: 1,
            normal_rank: 2,
            possible: Feedback::Dynamic,
            blocks: vec![vec![0, 1], vec![2]],
            integrators: vec![("motor - 2 wheel_motor".into(), 2)],
            reasons: texts(&[
                "the rows of rack.phi and driver.tau in G are parallel: both feel motor only through the joint",
                "no input reaches wheel.w: the belt is cut",
            ]),
        },
        controller_data: ControllerData {
            block: "Noninteracting".into(),
            reads: vec![("rack.phi".into(), "rad".into())],
            writes: texts(&inputs),
            sample_time: Some(1e-3),
            single: false,
            matrices: vec![("A".into(), vec![vec![0.1 + 0.2, -1.0 / 3.0], vec![5e-324, -0.0]])],
            numbers: named(&[("limit", 1e23), ("gain", f64::MAX)]),
        },
        gains,
        canonical: Some(Canonical {
            sizes: vec![2, 4, 1, 0],
            ranks: vec![5, 3],
            transformation: small("Q"),
            a: small("A"),
            b: small("B"),
            c: small("C"),
        }),
        channels: vec![ChannelResult {
            output: "driver.tau".into(),
            reference: "ref_torque".into(),
            kind: "torque".into(),
            transfer: "1000000/(s^4 + 21 s^3 + 12345/7 s^2 + 300000 s + 1000000)".into(),
            poles: vec![(-10.0, 0.0), (-10.0, 0.0)],
        }],
        exact_poles: true,
        closed_loop_poles: vec![(0.0, 0.0), (-10.0, 0.0), (-10.0, 0.0), (-3.0, 4.0), (-3.0, -4.0), (420.0, 0.0)],
        zero_dynamics: ZeroDynamics {
            polynomial: "s^2 - 420 s".into(),
            modes: vec![
                ZeroMode {
                    pole: (0.0, 0.0),
                    natural_frequency: 0.0,
                    damping_ratio: 1.0,
                    shape: vec![("driver".into(), 1.0, 0.0), ("rack".into(), 0.5, 0.5)],
                    warning: Some("on the imaginary axis: the wheel drifts".into()),
                    ..ZeroMode::default()
                },
                ZeroMode {
                    pole: (420.0, 0.0),
                    natural_frequency: 420.0,
                    damping_ratio: -1.0,
                    stored: named(&[("tyre", 0.9), ("bar", 0.1)]),
                    dissipated: named(&[("tyre", 1.0)]),
                    shape: vec![("driver".into(), 1.0, 0.0)],
                    warning: Some("unstable: the motion grows while the outputs rest".into()),
                },
            ],
            stable: false,
        },
        observer: Some(ObserverResult {
            sensors: texts(&["rack.phi", "wheel.phi"]),
            states: texts(&["rack.phi", "rack.w", "load"]),
            disturbances: texts(&["rack"]),
            poles: vec![(-60.0, 0.0), (-50.0, 20.0), (-50.0, -20.0)],
            method: "kalman".into(),
            gain: floating("observer_gain", "L", "", &["rack.phi", "rack.w", "load"], &["rack.phi", "wheel.phi"]),
            distinguishable: texts(&["A torque along rack can be told from one along wheel."]),
        }),
        transfer: vec![
            entry("rack.phi", "ref_rack", &["1000000/7", "0", "1"]),
            entry("rack.phi", "ref_torque", &["0", "-3/2"]),
            entry("driver.tau", "ref_rack", &[]),
            entry("driver.tau", "ref_torque", &["1"]),
        ],
        decoupled: Some(false),
        cross_coupling: vec![
            coupling("ref_rack", "rack.phi", true, 1.3, 0.9),
            coupling("ref_rack", "driver.tau", false, 0.41, 0.2),
            CrossCoupling {
                failure: Some("the run stopped at 0.3 s: step size below 1e-14".into()),
                peak: f64::NAN,
                rms: f64::NAN,
                ..coupling("ref_torque", "rack.phi", false, 0.0, 0.0)
            },
            coupling("ref_torque", "driver.tau", true, 2.0, 1.1),
        ],
        margins: None,
        exploration: None,
        passage: None,
        robustness: None,
        flatness: Some(Flatness {
            outputs: texts(&outputs),
            flat: true,
            remainder: "1".into(),
            statement: "Flat: states and inputs follow from the outputs and their derivatives.".into(),
            derivatives: vec![4, 2, 3],
            ..Flatness::default()
        }),
        warnings: texts(&["The law cancels an unstable mode at 420 1/s.", "motor exceeds its limit of 3 N m."]),
        notes: texts(&["Weights are those of the file."]),
        ..Design::default()
    }
}

/// Names that are markup, numbers that are not finite, lists of unequal length.
pub fn hostile_design(bad: &str) -> Design {
    let mut design = observed_train();
    let bad = || bad.to_string();
    let matrix = |name: &str| ExactMatrix {
        name: name.into(),
        title: bad(),
        unit: bad(),
        rows: vec![bad()],
        columns: vec![bad(), bad()],
        values: vec![vec![f64::NAN], vec![f64::INFINITY, 1.0, f64::NEG_INFINITY]],
        exact: Some(vec![vec![bad()]]),
    };
    design.model = bad();
    design.description = bad();
    design.variant = bad();
    design.controller = bad();
    design.law = bad();
    design.others = vec![bad()];
    design.design_model = bad();
    design.states[0] = bad();
    design.inputs = vec![bad()];
    design.outputs = vec![bad(), bad()];
    design.definitions[0] = (bad(), bad());
    design.hidden = vec![(f64::NAN, f64::INFINITY)];
    design.decoupling_matrix = matrix(&bad());
    design.decouplability.blocks = vec![vec![0, 99], vec![]];
    design.decouplability.integrators = vec![(bad(), 1)];
    design.decouplability.reasons = vec![bad()];
    design.gains = vec![matrix(&bad()), matrix(&bad()), matrix("")];
    let channel = &mut design.channels[0];
    (channel.output, channel.reference, channel.kind, channel.transfer) = (bad(), bad(), bad(), bad());
    channel.poles = vec![(f64::NAN, 1.0)];
    design.closed_loop_poles[0] = (f64::NAN, f64::NEG_INFINITY);
    design.zero_dynamics.polynomial = bad();
    let mode = &mut design.zero_dynamics.modes[0];
    mode.pole = (f64::INFINITY, f64::NAN);
    mode.natural_frequency = f64::NAN;
    mode.damping_ratio = f64::NAN;
    mode.stored = vec![(bad(), f64::NAN)];
    mode.dissipated = vec![(bad(), f64::INFINITY)];
    mode.shape = vec![(bad(), f64::NAN, f64::INFINITY)];
    mode.warning = Some(bad());
    if let Some(observer) = &mut design.observer {
        observer.sensors = vec![bad()];
        observer.states = vec![bad()];
        observer.disturbances = vec![bad()];
        observer.poles = vec![(f64::NAN, 0.0)];
        observer.method = bad();
        observer.gain = matrix(&bad());
        observer.distinguishable = vec![bad()];
    }
    if let Some(canonical) = &mut design.canonical {
        canonical.transformation = matrix(&bad());
        canonical.ranks.clear();
    }
    design.transfer[0] = TransferEntry { output: bad(), reference: bad(), numerator: vec![bad()], denominator: vec![] };
    design.cross_coupling[0] = CrossCoupling {
        reference: bad(),
        output: bad(),
        unit: bad(),
        step_unit: bad(),
        step: f64::NAN,
        peak: f64::INFINITY,
        rms: f64::NAN,
        window: f64::NAN,
        own: true,
        failure: None,
    };
    design.cross_coupling[2].failure = Some(bad());
    if let Some(flatness) = &mut design.flatness {
        flatness.outputs = vec![bad()];
        flatness.remainder = bad();
        flatness.poles = vec![(f64::NAN, 0.0)];
        flatness.statement = bad();
    }
    let data = &mut design.controller_data;
    data.block = bad();
    data.reads = vec![(bad(), bad())];
    data.writes = vec![bad()];
    data.sample_time = Some(f64::NAN);
    data.matrices = vec![(bad(), vec![vec![f64::NAN]]), (bad(), vec![])];
    data.numbers = vec![(bad(), f64::INFINITY)];
    design.warnings = vec![bad()];
    design.notes = vec![bad()];
    design
}
