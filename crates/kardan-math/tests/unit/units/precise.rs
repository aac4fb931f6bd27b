//! Tests of `src/units/precise.rs`.

use super::*;

/// Digits of a reference work: e, ln 2, √2, sin 1, cos 1, atan 1/2 (sequences A001113, A002162, A002193, A049469, A049470, A073000 of the
/// On-Line Encyclopedia of Integer Sequences).
#[test]
fn digits_equal_those_of_a_reference_work() {
    let ten = UBig::from(10u8);
    let digits = |x: &RBig, count: usize| (x * RBig::from(ten.pow(count))).floor().to_string();
    let (two, half) = (RBig::from(2), RBig::from_parts(1.into(), 2u8.into()));
    let [sine, cosine] = sine_cosine(&RBig::ONE);
    for (found, expected) in [
        (exponential(&RBig::ONE), "27182818284590452353602874713526624977572470936999"),
        (logarithm(&two), "06931471805599453094172321214581765680755001343602"),
        (square_root(&two).0, "14142135623730950488016887242096980785696718753769"),
        (sine, "08414709848078965066525023216302989996225630607983"),
        (cosine, "05403023058681397174009366074429766037323104206179"),
        (angle(&half, &RBig::ONE), "04636476090008061162142562314612144020285370542861"),
    ] {
        assert_eq!(digits(&found, 49), expected.trim_start_matches('0'), "{expected}");
    }
    assert_eq!(square_root(&RBig::from_parts(9.into(), 4u8.into())), (RBig::from_parts(3.into(), 2u8.into()), true));
}

#[test]
fn identities_are_exact_far_out_and_close_by() {
    let close = |a: &RBig, b: &RBig| assert!((a - b).abs() * RBig::from(UBig::ONE << 200) < RBig::ONE, "{a} {b}");
    for x in ["-700.3", "-1e-30", "0.001", "2.9", "12345.678", "1e15"] {
        let x = super::super::parse_number(x).unwrap().rational;
        let [sine, cosine] = sine_cosine(&x);
        close(&(&sine * &sine + &cosine * &cosine), &RBig::ONE);
        let back = sine_cosine(&angle(&sine, &cosine));
        close(&back[0], &sine);
        close(&back[1], &cosine);
        if x.clone().abs() < RBig::from(1000) {
            close(&logarithm(&exponential(&x)), &x);
        }
    }
}
