//! The blocks do what their equations say, in both precisions, and never fail on short slices.

use kardan_rt::{Channel, Gain, Measurement, Noninteracting, PositionLoop};

/// (6.137) as an oscillator: with acceleration = u the closed loop is φ̈ + 2ξω φ̇ + ω² φ = ω² ref − load.
#[test]
fn position_loop_6_137() {
    let block = PositionLoop { natural_frequency: 3.0, damping_ratio: 0.5 };
    for (reference, position, speed, load) in [(1.0, 0.0, 0.0, 0.0), (0.5, -2.0, 4.0, 0.25), (0.0, 1.0, -1.0, -7.0)] {
        let expected: f64 = 9.0 * (reference - position) - 2.0 * 0.5 * 3.0 * speed - load;
        assert_eq!(block.acceleration(reference, position, speed, load), Some(expected));
    }
}

/// u = Kx x + Ku v with v from the channels.
#[test]
fn noninteracting_is_linear_in_state_and_accelerations() {
    let state_gain = [1.0, -2.0, 0.5, 0.0, 3.0, 1.0, -1.0, 2.0];
    let acceleration_gain = [0.25, 0.0, 1.0, -4.0];
    let channels = [
        Channel::Position {
            position_loop: PositionLoop { natural_frequency: 2.0, damping_ratio: 1.0 },
            inverse_inertia: 8.0,
        },
        Channel::Torque { inverse_inertia: 0.5 },
    ];
    let law = Noninteracting {
        state_gain: Gain::new(&state_gain, 4).expect("whole rows"),
        acceleration_gain: Gain::new(&acceleration_gain, 2).expect("whole rows"),
        channels: &channels,
    };
    let measured = Measurement {
        state: &[1.0, 2.0, 3.0, 4.0],
        positions: &[0.5, 9.0],
        speeds: &[0.25, 9.0],
        references: &[1.0, 6.0],
        loads: &[0.125, 2.0],
    };
    let (mut accelerations, mut torques) = ([0.0; 2], [7.0; 2]);
    assert!(law.torques(measured, &mut accelerations, &mut torques));
    // v1 = 4 (1 − 0.5) − 4·0.25 − 0.125·8, v2 = (6 − 2)/2
    assert_eq!(accelerations, [0.0, 2.0]);
    assert_eq!(torques, [1.0 - 4.0 + 1.5, 3.0 + 2.0 - 3.0 + 8.0 - 8.0]);
}

#[test]
fn single_precision_agrees() {
    let gains = [2318.1818_f64, -2.391_545_5, 0.4636];
    let single = gains.map(|gain| gain as f32);
    let (mut wide, mut narrow) = ([0.0_f64], [0.0_f32]);
    assert!(Gain::new(&gains, 3).expect("whole rows").add_to(&[0.3, -0.1, 2.0], &mut wide));
    assert!(Gain::new(&single, 3).expect("whole rows").add_to(&[0.3, -0.1, 2.0], &mut narrow));
    // Three products of single precision: a few of its ulps of the largest.
    assert!((wide[0] - f64::from(narrow[0])).abs() < 4.0 * f64::from(f32::EPSILON) * 700.0);
}

#[test]
fn short_slices_do_not_panic() {
    let gain = Gain::new(&[1.0, 2.0, 3.0, 4.0], 2).expect("whole rows");
    let mut out = [0.0];
    assert!(gain.add_to(&[1.0], &mut out));
    assert_eq!(out, [1.0]);
    assert!(Gain::<f64>::new(&[], 0).is_none());
    assert!(Gain::new(&[1.0], 2).is_none());
    // More places than rows: those behind stay.
    let mut long = [1.0; 3];
    assert!(gain.add_to(&[1.0, 1.0], &mut long));
    assert_eq!(long, [4.0, 8.0, 1.0]);
    assert!(Gain::new(&[], usize::MAX).expect("no rows").add_to(&[1.0], &mut long));
}
