//! Analyses and designs: a real one, and others made by hand.

use kardan::project::{Project, builtin};
use kardan::results::*;
use kardan::study::{AnalyzeSettings, Silent};

fn texts(entries: &[&str]) -> Vec<String> {
    entries.iter().map(|&entry| entry.into()).collect()
}

fn named<T>(one: fn(String, f64) -> T, pairs: &[(&str, f64)]) -> Vec<T> {
    pairs.iter().map(|&(name, value)| one(name.into(), value)).collect()
}

fn element_share(element: String, share: f64) -> ElementShare {
    ElementShare { element, share }
}

fn named_share(name: String, share: f64) -> NamedShare {
    NamedShare { name, share }
}

fn angle(shaft: String, angle: f64) -> ShaftAngle {
    ShaftAngle { shaft, angle }
}

fn place(place: String, cost: f64) -> Place {
    Place { place, cost }
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

fn stored(element: &str, energy: EnergyKind, share: f64) -> StoredShare {
    StoredShare { element: element.into(), energy, share }
}

const PRIME: u64 = (1 << 61) - 1;

/// The built-in model of two bodies with d² = s J, where one motor cannot control them. What is equal but for rounding
/// stands in the order of names.
pub fn two_bodies() -> Analysis {
    let source = builtin("two-bodies").expect("a built-in model").source;
    let source = source.replace("\"2 N m/rad", "\"1 N m/rad").replace("\"0.5 N m s/rad", "\"1 N m s/rad");
    let outputs = texts(&["body_2.phi"]);
    let settings = AnalyzeSettings { outputs, certify: true, ..AnalyzeSettings::default() };
    let mut found = Project::open(source).analyze(&settings, &Silent).expect("an analysis");
    let rounded = |share: &mut f64| *share = (1e9 * *share).round() / 1e9;
    for mode in &mut found.modes {
        // All motions are of size one or none; the first of them counts as positive.
        let sign = mode.shape.iter().map(|part| part.value.re.round()).find(|re| *re != 0.0).unwrap_or(1.0);
        mode.shape.iter_mut().for_each(|part| part.value.re = (sign * part.value.re).round());
        mode.stored.sort_by(|a, b| a.element.cmp(&b.element));
        mode.stored.iter_mut().for_each(|one| rounded(&mut one.share));
        mode.dissipated.sort_by(|a, b| a.element.cmp(&b.element));
        mode.dissipated.iter_mut().for_each(|one| rounded(&mut one.share));
    }
    let structure = &mut found.structure;
    for mode in structure.uncontrollable.iter_mut().chain(&mut structure.unobservable) {
        mode.elements.sort_by(|a, b| a.name.cmp(&b.name));
        mode.elements.iter_mut().for_each(|one| rounded(&mut one.share));
    }
    found
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
                let value = Complex { re: value, im: if k == 1 { 0.4 * value * value } else { 0.0 } };
                ShapePart { name: shafts[i].to_string(), value }
            };
            let kinetic = (0..8).map(|i| stored(shafts[i], EnergyKind::Kinetic, 0.5 * share(i)));
            let potential = (0..7).map(|i| {
                let stretch = (amplitude(i) - amplitude(i + 1)).powi(2);
                let all: f64 = (0..7).map(|i| (amplitude(i) - amplitude(i + 1)).powi(2)).sum();
                stored(springs[i], EnergyKind::Potential, 0.5 * stretch / all)
            });
            Mode {
                eigenvalue: Complex { re: -zeta * w, im: w * (1.0 - zeta * zeta).max(0.0).sqrt() },
                natural_frequency: w,
                damping_ratio: zeta,
                shape: (0..8).map(shape).collect(),
                stored: if k == 0 { vec![] } else { kinetic.chain(potential).collect() },
                dissipated: if k == 0 {
                    vec![]
                } else {
                    named(element_share, &[("tyre", 0.7), ("bar", 0.2), ("wheel", 0.1)])
                },
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
        shafts: named(named_share, &[("driver", 1.0), ("wheel", 0.8), ("rack", 0.35), ("motor", 0.2), ("output", 0.1)]),
        elements: named(named_share, &[("tyre", 0.5), ("wheel", 0.5)]),
    };
    let base = two_bodies();
    let set = |places: &[&str], cost: f64, score: f64| PlacedSet {
        places: texts(places),
        cost,
        score,
        efficient: cost < 3.0,
    };
    Analysis {
        opposite_side: None,
        parity: None,
        unfinished: None,
        mechanism: Default::default(),
        name: "train".into(),
        counting: None,
        elimination: Some(Elimination {
            motions: 1,
            direction: "joint - 2 rack".into(),
            removed: texts(&["joint.w", "rack.w"]),
            definitions: vec![Definition { state: "z1".into(), expression: "2 joint.w + rack.w".into() }],
        }),
        description: "A chain of eight shafts.\n\nIt has a universal joint and friction.".into(),
        class: Some(Class {
            constant_linear: false,
            assumptions: vec![
                Assumption {
                    statement: "the inertia matrix is constant, symmetric and positive definite (4.27)".into(),
                    satisfied: true,
                    violations: vec![],
                },
                Assumption {
                    statement: "the damping is linear (4.28)".into(),
                    satisfied: false,
                    violations: vec![Breach {
                        element: "rack_friction".into(),
                        reason: "Coulomb friction of 10.8 N m".into(),
                    }],
                },
                Assumption {
                    statement: "the constraints are linear with constant coefficients (4.31)".into(),
                    satisfied: false,
                    violations: vec![Breach {
                        element: "joint".into(),
                        reason: "its ratio depends on the angle of driver".into(),
                    }],
                },
            ],
            constraints: vec![
                ConstraintClass {
                    element: "harmonic".into(),
                    equation: "wave_generator + 50 flexspline - 51 output = 0".into(),
                    equality: true,
                    holonomic: Some(true),
                    scleronomic: true,
                    linear: true,
                    reason: None,
                },
                ConstraintClass {
                    element: "joint".into(),
                    equation: "shaft_3 - atan(tan(driver) / cos(beta)) = 0".into(),
                    equality: true,
                    holonomic: Some(true),
                    scleronomic: true,
                    linear: false,
                    reason: None,
                },
            ],
            operating_point: OperatingPoint {
                angles: named(angle, &[("driver", 0.3), ("rack", 0.0), ("shaft_3", 0.31)]),
                friction: vec![
                    FrictionState { element: "rack_friction".into(), coulomb_torque: 10.8, stuck: true },
                    FrictionState { element: "column_friction".into(), coulomb_torque: 0.2, stuck: false },
                ],
                ..OperatingPoint::default()
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
            undecided: Undecided::default(),
            factors: vec![Factor {
                polynomial: "s^2".into(),
                roots: vec![Complex::default()],
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
                values: vec![
                    Complex::new(-10.0, 0.0),
                    Complex::new(-5.5, 99.9),
                    Complex::new(-5.5, -99.9),
                    Complex::new(420.0, 0.0),
                ],
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
                        columns: (0..16).map(|power| MinorColumn { input: 0, power }).collect(),
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
                candidates: shafts.iter().map(|&shaft| place(shaft.into(), 1.0)).collect(),
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
                infeasible_reason: None,
            }),
            outputs: Some(PlacementSearch {
                candidates: named(place, &[("rack.phi", 1.0), ("wheel.w", 3.0)]),
                method: "only all 2 places together are enough".into(),
                exhaustive: true,
                tried: 3,
                infeasible_reason: Some("no candidate shows driver and flexspline moving against each other".into()),
                ..PlacementSearch::default()
            }),
        },
        properties: None,
        realisations: None,
        discrete: None,
        descriptor: None,
        matrix_distance: None,
        sensitivity: Some(Sensitivity {
            parameters: vec![
                ParameterRange {
                    name: "bar_stiffness".into(),
                    nominal: 120.0,
                    lower: 108.0,
                    upper: 132.0,
                    unit: "N m/rad".into(),
                },
                ParameterRange {
                    name: "rack_inertia".into(),
                    nominal: 0.0042,
                    lower: 0.0040,
                    upper: 0.0044,
                    unit: "kg m^2".into(),
                },
            ],
            controllability: Some(DistanceToUncontrollability {
                nearest: Some(UncontrollablePoint {
                    distance: 2.4,
                    at: vec![
                        ParameterPoint { parameter: "bar_stiffness".into(), value: 148.8, unit: "N m/rad".into() },
                        ParameterPoint { parameter: "rack_inertia".into(), value: 0.00372, unit: "kg m^2".into() },
                    ],
                    eigenvalue: Complex::new(-1.2, 88.0),
                    residual: 4e-13,
                    shafts: named(named_share, &[("rack", 1.0), ("wheel", 0.4)]),
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
                    interval: Interval { lower: 0.0007, upper: 0.0021 },
                    smallest: 3.2e-10,
                    median: 4.4e-6,
                    largest: 9.1e-5,
                }),
            }),
            observability: Some(DistanceToUncontrollability {
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
    analysis.elimination = Some(Elimination {
        motions: 2,
        direction: bad(),
        removed: vec![bad(); 50],
        definitions: vec![Definition { state: bad(), expression: bad() }],
    });
    if let Some(class) = &mut analysis.class {
        class.constant_linear = false;
        class.assumptions[1].satisfied = false;
        class.assumptions[1].violations = vec![Breach { element: bad(), reason: bad() }];
        class.constraints = vec![ConstraintClass { element: bad(), equation: bad(), ..ConstraintClass::default() }];
        class.operating_point = OperatingPoint {
            angles: vec![ShaftAngle { shaft: bad(), angle: f64::NAN }],
            friction: vec![FrictionState { element: bad(), coulomb_torque: f64::INFINITY, stuck: true }],
            in_motion: true,
            motion: vec![OperatingSignal { name: bad(), unit: bad(), value: f64::NAN }],
        };
    }
    let mode = &mut analysis.modes[1];
    mode.eigenvalue = Complex { re: f64::NAN, im: f64::INFINITY };
    mode.natural_frequency = f64::NAN;
    mode.damping_ratio = f64::NAN;
    mode.shape = vec![
        ShapePart { name: bad(), value: Complex { re: f64::NAN, im: f64::INFINITY } },
        ShapePart { name: "wheel".into(), value: Complex::new(-7.0, 0.0) },
    ];
    mode.stored = vec![
        StoredShare { element: bad(), energy: EnergyKind::Potential, share: f64::NAN },
        StoredShare { element: "wheel".into(), energy: EnergyKind::Kinetic, share: 3.0 },
    ];
    mode.dissipated = vec![ElementShare { element: bad(), share: f64::NEG_INFINITY }];
    mode.factor = bad();
    let structure = &mut analysis.structure;
    structure.states[0] = bad();
    structure.inputs[0] = bad();
    structure.outputs = vec![bad(), bad()];
    structure.kind = bad();
    structure.zeros =
        Zeros { polynomial: bad(), values: vec![Complex { re: f64::NAN, im: 0.0 }], growing: None, normal_rank: 1 };
    structure.factors[0].polynomial = bad();
    structure.factors[0].roots = vec![Complex { re: f64::NAN, im: 1.0 }];
    structure.uncontrollable[0].shafts = vec![NamedShare { name: bad(), share: f64::NAN }];
    structure.uncontrollable[0].elements = vec![NamedShare { name: bad(), share: f64::NAN }];
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
        search.infeasible_reason = Some(bad());
        search.sets = [f64::NAN, -1.0, 0.0, f64::INFINITY]
            .map(|score| PlacedSet { places: vec![bad()], cost: f64::NAN, score, efficient: false })
            .to_vec();
    }
    if let Some(sensitivity) = &mut analysis.sensitivity {
        sensitivity.parameters[0] =
            ParameterRange { name: bad(), nominal: f64::NAN, lower: f64::NAN, upper: f64::NAN, unit: bad() };
        if let Some(Some(loss)) = sensitivity.controllability.as_mut().map(|search| search.nearest.as_mut()) {
            loss.at[0] = ParameterPoint { parameter: bad(), value: f64::NAN, unit: bad() };
            loss.shafts = vec![NamedShare { name: bad(), share: f64::NAN }];
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
        same_channel: own,
        peak: Some(peak),
        rms: Some(rms),
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
    let pair = |re: f64, im: f64| [Pole::new(re, im), Pole::new(re, -im)];
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
    let zero = Pole::new(-93.636_363_636_363_6, 948.853_587_154);
    Design {
        opposite_side: None,
        rounded: Vec::new(),
        mechanism: Default::default(),
        incomplete_reason: None,
        responses: None,
        model: "sia-steering".into(),
        description: "Car steering with a harmonic drive in differential mode.".into(),
        variant: "beta-0deg".into(),
        controller: "column".into(),
        law: "decoupling".into(),
        other_controllers: texts(&["driver_model"]),
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
                .map(|&name| ReadSignal::new(name, if name.ends_with(".w") { "rad/s" } else { "rad" }))
                .collect(),
            writes: texts(&inputs),
            sample_time: None,
            single: false,
            matrices: gains.iter().map(|gain| DataMatrix::new(&gain.name, gain.values.clone())).collect(),
            numbers: named(DataNumber::new, &[("filter", 0.1)]),
        },
        gains,
        canonical: None,
        channels: vec![channel("rk.phi", "ref_rk"), channel("fs.phi", "ref_fs")],
        exact_poles: true,
        integrals_without_effect: Vec::new(),
        closed_loop_poles: [
            pair(-14.0, 14.282_856_857_085_7),
            pair(-14.0, 14.282_856_857_085_7),
            pair(zero.re, zero.im),
        ]
        .concat(),
        zero_dynamics: ZeroDynamics {
            polynomial: "11 s^2 + 2060 s + 10000000".into(),
            modes: vec![ZeroMode {
                pole: zero,
                natural_frequency: 953.462_589_245_6,
                damping_ratio: 0.098_206_697_3,
                stored: named(
                    element_share,
                    &[("torsion_bar", 0.5), ("wg", 0.499_577), ("cs", 0.000_384), ("cj", 0.000_039)],
                ),
                dissipated: named(element_share, &[("wg", 0.984), ("torsion_bar", 0.015), ("cs", 0.001)]),
                shape: vec![
                    ShapePart { name: "wg".into(), value: Complex::new(1.0, 0.0) },
                    ShapePart { name: "cj".into(), value: Complex::new(0.0196, 0.0) },
                    ShapePart { name: "cs".into(), value: Complex::new(0.0196, 0.0) },
                ],
                warning: Some("lightly damped: 0.098 of critical; what excites it rings for 0.04 s".into()),
            }],
            stability: StabilityVerdict::plain(Stability::Stable, StabilityEvidence::Exactly),
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
        motor_loads: Vec::new(),
        exploration: None,
        loop_along_path: None,
        robustness: None,
        flatness: Some(Flatness {
            outputs: texts(&outputs),
            flat: false,
            remainder: "11 s^2 + 2060 s + 10000000".into(),
            poles: pair(zero.re, zero.im).to_vec(),
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
        integrals_without_effect: vec!["V.q".into()],
        model: "train".into(),
        description: "A chain of eight shafts.\n\nIt has a universal joint and friction.".into(),
        variant: "train".into(),
        controller: "design".into(),
        law: "lqr".into(),
        design_model: "linear, at the initial position".into(),
        states: names.clone(),
        inputs: texts(&inputs),
        outputs: texts(&outputs),
        definitions: names
            .iter()
            .map(|z| Definition { state: z.clone(), expression: "wg.phi - 51 rk.phi + 50 fs.phi".into() })
            .collect(),
        hidden: vec![Complex::new(-3.0, 4.0), Complex::new(-3.0, -4.0), Complex::default()],
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
            blocks: vec![texts(&outputs[..2]), texts(&outputs[2..])],
            integrators: vec![Integrators { input: "motor - 2 wheel_motor".into(), count: 2 }],
            reasons: texts(&[
                "the rows of rack.phi and driver.tau in G are parallel: both feel motor only through the joint",
                "no input reaches wheel.w: the belt is cut",
            ]),
        },
        controller_data: ControllerData {
            block: "Noninteracting".into(),
            reads: vec![ReadSignal { signal: "rack.phi".into(), unit: "rad".into() }],
            writes: texts(&inputs),
            sample_time: Some(1e-3),
            single: false,
            matrices: vec![DataMatrix {
                name: "A".into(),
                values: vec![vec![0.1 + 0.2, -1.0 / 3.0], vec![5e-324, -0.0]],
            }],
            numbers: named(DataNumber::new, &[("limit", 1e23), ("gain", f64::MAX)]),
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
            poles: vec![Complex::new(-10.0, 0.0), Complex::new(-10.0, 0.0)],
        }],
        exact_poles: true,
        closed_loop_poles: vec![
            Complex::default(),
            Complex::new(-10.0, 0.0),
            Complex::new(-10.0, 0.0),
            Complex::new(-3.0, 4.0),
            Complex::new(-3.0, -4.0),
            Complex::new(420.0, 0.0),
        ],
        zero_dynamics: ZeroDynamics {
            polynomial: "s^2 - 420 s".into(),
            modes: vec![
                ZeroMode {
                    pole: Complex::default(),
                    natural_frequency: 0.0,
                    damping_ratio: 1.0,
                    shape: vec![
                        ShapePart { name: "driver".into(), value: Complex::new(1.0, 0.0) },
                        ShapePart { name: "rack".into(), value: Complex::new(0.5, 0.5) },
                    ],
                    warning: Some("on the imaginary axis: the wheel drifts".into()),
                    ..ZeroMode::default()
                },
                ZeroMode {
                    pole: Complex::new(420.0, 0.0),
                    natural_frequency: 420.0,
                    damping_ratio: -1.0,
                    stored: named(element_share, &[("tyre", 0.9), ("bar", 0.1)]),
                    dissipated: named(element_share, &[("tyre", 1.0)]),
                    shape: vec![ShapePart { name: "driver".into(), value: Complex::new(1.0, 0.0) }],
                    warning: Some("unstable: the motion grows while the outputs rest".into()),
                },
            ],
            stability: StabilityVerdict::plain(Stability::Unstable, StabilityEvidence::Exactly),
        },
        observer: Some(ObserverResult {
            sensors: texts(&["rack.phi", "wheel.phi"]),
            states: texts(&["rack.phi", "rack.w", "load"]),
            disturbances: texts(&["rack"]),
            poles: vec![Complex::new(-60.0, 0.0), Complex::new(-50.0, 20.0), Complex::new(-50.0, -20.0)],
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
                peak: None,
                rms: None,
                ..coupling("ref_torque", "rack.phi", false, 0.0, 0.0)
            },
            coupling("ref_torque", "driver.tau", true, 2.0, 1.1),
        ],
        margins: None,
        exploration: None,
        loop_along_path: None,
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
    design.other_controllers = vec![bad()];
    design.design_model = bad();
    design.states[0] = bad();
    design.inputs = vec![bad()];
    design.outputs = vec![bad(), bad()];
    design.definitions[0] = Definition { state: bad(), expression: bad() };
    design.hidden = vec![Complex { re: f64::NAN, im: f64::INFINITY }];
    design.decoupling_matrix = matrix(&bad());
    design.decouplability.blocks = vec![vec![bad()], vec![]];
    design.decouplability.integrators = vec![Integrators { input: bad(), count: 1 }];
    design.decouplability.reasons = vec![bad()];
    design.gains = vec![matrix(&bad()), matrix(&bad()), matrix("")];
    let channel = &mut design.channels[0];
    (channel.output, channel.reference, channel.kind, channel.transfer) = (bad(), bad(), bad(), bad());
    channel.poles = vec![Complex { re: f64::NAN, im: 1.0 }];
    design.closed_loop_poles[0] = Complex { re: f64::NAN, im: f64::NEG_INFINITY };
    design.zero_dynamics.polynomial = bad();
    let mode = &mut design.zero_dynamics.modes[0];
    mode.pole = Complex { re: f64::INFINITY, im: f64::NAN };
    mode.natural_frequency = f64::NAN;
    mode.damping_ratio = f64::NAN;
    mode.stored = vec![ElementShare { element: bad(), share: f64::NAN }];
    mode.dissipated = vec![ElementShare { element: bad(), share: f64::INFINITY }];
    mode.shape = vec![ShapePart { name: bad(), value: Complex { re: f64::NAN, im: f64::INFINITY } }];
    mode.warning = Some(bad());
    if let Some(observer) = &mut design.observer {
        observer.sensors = vec![bad()];
        observer.states = vec![bad()];
        observer.disturbances = vec![bad()];
        observer.poles = vec![Complex { re: f64::NAN, im: 0.0 }];
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
        peak: Some(f64::INFINITY),
        rms: None,
        window: f64::NAN,
        same_channel: true,
        failure: None,
    };
    design.cross_coupling[2].failure = Some(bad());
    if let Some(flatness) = &mut design.flatness {
        flatness.outputs = vec![bad()];
        flatness.remainder = bad();
        flatness.poles = vec![Complex { re: f64::NAN, im: 0.0 }];
        flatness.statement = bad();
    }
    let data = &mut design.controller_data;
    data.block = bad();
    data.reads = vec![ReadSignal { signal: bad(), unit: bad() }];
    data.writes = vec![bad()];
    data.sample_time = Some(f64::NAN);
    data.matrices =
        vec![DataMatrix { name: bad(), values: vec![vec![f64::NAN]] }, DataMatrix { name: bad(), values: vec![] }];
    data.numbers = vec![DataNumber { name: bad(), value: f64::INFINITY }];
    design.warnings = vec![bad()];
    design.notes = vec![bad()];
    design
}
