//! Tests of `src/element/universal_joint.rs`.

use kardan_rt::functions::sin;

use super::*;
use proptest::prelude::*;

proptest! {
    /// (6.100): sin φ1 cos φ2 = C cos φ1 sin φ2, over many revolutions, without branch jumps.
    #[test]
    fn equation_6_100(c in 0.2f64..4.0, x in -1e3f64..1e3, phase in -3.0f64..3.0) {
        let joint = UniversalJointCurve { ratio: c, phase_in: phase, phase_out: 0.0 };
        let (y, theta) = (joint.value(x), x + phase);
        prop_assert!((sin(y) * cos(theta) - c * cos(y) * sin(theta)).abs() < 1e-12);
        prop_assert!((y - theta).abs() < FRAC_PI_2);
    }

    /// γ⁻¹(γ(x)) = x, and γ′, γ″ agree with differences.
    #[test]
    fn inverse_and_derivatives(c in 0.3f64..3.0, x in -20.0f64..20.0, phase in -3.0f64..3.0) {
        let joint = UniversalJointCurve { ratio: c, phase_in: phase, phase_out: 0.0 };
        prop_assert!((joint.inverse().unwrap().value(joint.value(x)) - x).abs() < 1e-12);
        let h = 1e-5;
        let (slope, curvature) = joint.derivatives(x);
        let difference = (joint.value(x + h) - joint.value(x - h)) / (2.0 * h);
        prop_assert!((difference - slope).abs() < 1e-7 * (1.0 + slope.abs()));
        let second = (joint.derivatives(x + h).0 - joint.derivatives(x - h).0) / (2.0 * h);
        prop_assert!((second - curvature).abs() < 1e-6 * (1.0 + curvature.abs()));
        // (4.15b) for the pair: γ′ of the inverse at the image is 1/γ′.
        prop_assert!((joint.inverse().unwrap().derivatives(joint.value(x)).0 * slope - 1.0).abs() < 1e-12);
    }
}

/// (6.101)-(6.103): two joints in series are one with C = cos β1/cos β2; equal angles cancel.
#[test]
fn double_joint_6_102() {
    let (b1, b2) = (0.5_f64, 0.3_f64);
    let first = UniversalJointCurve { ratio: cos(b1), phase_in: 0.0, phase_out: 0.0 };
    let second = UniversalJointCurve { ratio: cos(b2), phase_in: 0.0, phase_out: 0.0 };
    let both = UniversalJointCurve { ratio: cos(b1) / cos(b2), phase_in: 0.0, phase_out: 0.0 };
    for k in -40..40 {
        let phi_3 = 0.37 * f64::from(k);
        let phi_2 = second.inverse().unwrap().value(phi_3);
        assert!((first.value(phi_2) - both.value(phi_3)).abs() < 1e-13);
    }
}
