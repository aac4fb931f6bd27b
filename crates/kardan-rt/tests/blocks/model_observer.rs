//! The observer on the nonlinear model: the same as the linear one on a linear model, exact through a bent joint, and safe with
//! whatever is read.

use kardan_rt::{Mechanism, ModelObserver, Operator, Plan, Row, Run, Sensor, StateSpace};

/// A body of 2 kg m² with a motor, a damper of 0.5 N m s/rad and a spring of 8 N m/rad to the ground.
const BODY: Mechanism<'static, f64> = Mechanism {
    shafts: 1,
    coordinates: 1,
    cuts: 0,
    inputs: 1,
    frictions: &[],
    plan: Plan {
        inputs: 2,
        constants: &[0.0, 1.0, 2.0, -0.5, 8.0],
        runs: &[Run { operator: Operator::Multiply, count: 1 }, Run { operator: Operator::SubtractProduct, count: 1 }],
        operands: &[5, 1, 6, 0, 7],
        outputs: &[0, 1, 2, 3, 4, 8, 2, 3],
        tables: &[],
        numbers: &[],
    },
};

const ENCODER: [Sensor<f64>; 1] = [Sensor { row: Row { first: 0, count: 1 }, speed: false, rest: 0.0 }];
const GAIN: [f64; 3] = [30.0, 300.0, 2000.0];

fn observer<'a>(mechanism: Mechanism<'a, f64>, zoh_integral: &'a [f64]) -> ModelObserver<'a, f64> {
    ModelObserver {
        mechanism,
        inputs: &[0],
        sensors: &ENCODER,
        entries: &[(0, 1.0)],
        disturbances: &[0],
        gain: &GAIN,
        zoh_integral,
        friction_width: None,
    }
}

#[test]
fn on_a_linear_model_it_is_the_linear_observer() {
    // A − L C and [B L] of x = (q, w, d).
    let a = [-30.0, 1.0, 0.0, -4.0 - 300.0, -0.25, 0.5, -2000.0, 0.0, 0.0];
    let b = [0.0, 30.0, 0.5, 300.0, 0.0, 2000.0];
    let linear = StateSpace::new(&a, &b, &[], &[], 3, 2).expect("shapes");
    // Any Γ: a step adds Γ times the rates.
    let zoh_integral = [1e-3, 2e-4, -3e-4, 4e-5, 5e-4, 6e-4, 0.0, 7e-4, 8e-4];
    let copied = observer(BODY, &zoh_integral);
    let (mut workspace, mut rates, mut expected) = (vec![0.0; copied.memory()], [0.0; 3], [0.0; 3]);
    for k in 0..50 {
        let x = |s: f64| (s * (1.0 + f64::from(k))).sin();
        let (state, torque, reading) = ([x(0.3), 5.0 * x(0.7), 10.0 * x(1.1)], 3.0 * x(0.2), x(0.5));
        assert!(copied.rates(&state, &[torque], &[reading], &mut workspace, &mut rates));
        assert!(linear.rates(&state, &[torque, reading], &mut expected));
        for i in 0..3 {
            assert!((rates[i] - expected[i]).abs() < 1e-10 * (1.0 + expected[i].abs()), "{rates:?} {expected:?}");
        }
        let mut next = state;
        assert!(copied.step(&mut next, &[torque], &[reading], &mut workspace));
        for i in 0..3 {
            let change: f64 = (0..3).map(|j| zoh_integral[3 * i + j] * rates[j]).sum();
            assert!((next[i] - state[i] - change).abs() < 1e-12 * (1.0 + change.abs()));
        }
    }
}

#[test]
fn invalid_inputs_are_reported_and_leave_the_estimate_unchanged() {
    let zoh_integral = [1e-3, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.0, 1e-3];
    let copied = observer(BODY, &zoh_integral);
    let mut workspace = vec![0.0; copied.memory()];
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for (torque, reading) in [(bad, 0.0), (0.0, bad)] {
            let (mut state, mut rates) = ([0.1, 0.2, 0.3], [7.0; 3]);
            assert!(!copied.step(&mut state, &[torque], &[reading], &mut workspace));
            assert!(!copied.rates(&state, &[torque], &[reading], &mut workspace, &mut rates));
            assert_eq!((state, rates), ([0.1, 0.2, 0.3], [7.0; 3]));
            // The next good sample goes on from there.
            assert!(copied.step(&mut state, &[0.0], &[0.1], &mut workspace));
            assert!(state.iter().all(|x| x.is_finite()));
        }
        assert!(!copied.step(&mut [bad, 0.0, 0.0], &[0.0], &[0.0], &mut workspace));
    }
    let mut state = [0.1, 0.2, 0.3];
    // Lists that are too short, a singular inertia.
    assert!(!copied.step(&mut state[..2], &[0.0], &[0.0], &mut workspace));
    assert!(!copied.step(&mut state, &[0.0], &[], &mut workspace));
    assert!(!copied.step(&mut state, &[0.0], &[0.0], &mut []));
    assert!(!observer(BODY, &zoh_integral[..8]).step(&mut state, &[0.0], &[0.0], &mut workspace));
    let massless = Mechanism { plan: Plan { constants: &[0.0, 1.0, 0.0, -0.5, 8.0], ..BODY.plan }, ..BODY };
    assert!(!observer(massless, &zoh_integral).step(&mut state, &[0.0], &[0.0], &mut workspace));
    assert_eq!(state, [0.1, 0.2, 0.3]);
}

/// Single precision runs the same.
#[test]
fn in_single_precision() {
    let body: Mechanism<'_, f32> = Mechanism {
        shafts: 1,
        coordinates: 1,
        cuts: 0,
        inputs: 1,
        frictions: &[1.0],
        plan: Plan {
            inputs: 2,
            constants: &[0.0, 1.0, 2.0, -0.5],
            runs: &[Run { operator: Operator::Multiply, count: 1 }],
            operands: &[5, 1],
            outputs: &[0, 1, 2, 3, 4, 6, 2, 3, 3, 1],
            tables: &[],
            numbers: &[],
        },
    };
    let sensors = [Sensor { row: Row { first: 0, count: 1 }, speed: true, rest: 0.0 }];
    let copied = ModelObserver {
        mechanism: body,
        inputs: &[0],
        sensors: &sensors,
        entries: &[(0, 1.0)],
        disturbances: &[],
        gain: &[0.0, 10.0],
        zoh_integral: &[],
        friction_width: Some(3.0),
    };
    let (mut workspace, mut rates) = (vec![0.0; copied.memory()], [0.0; 2]);
    assert!(copied.rates(&[0.0, 4.0], &[5.0], &[4.5], &mut workspace, &mut rates));
    // Friction 1·4/√(16 + 9) = 0.8 N m.
    assert_eq!(rates, [4.0, (5.0 - 2.0 - 0.8) / 2.0 + 5.0]);
}
