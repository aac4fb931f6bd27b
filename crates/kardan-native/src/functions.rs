//! Elementary functions as the code calls them: by addresses of what they read and write.

use kardan_rt::{Lanes, Number, Operator, functions};

/// A function: addresses of two operands and two results.
type Function = unsafe extern "C" fn(*const f64, *const f64, *mut f64, *mut f64);

/// What an operator computes of a and b.
#[inline(always)]
fn results<N: Number<One = f64>>(operator: Operator, a: N, b: N) -> (N, N) {
    let one = match operator {
        Operator::SineCosine => return functions::sin_cos(a),
        Operator::Tangent => functions::tan(a),
        Operator::ArcSine => functions::asin(a),
        Operator::ArcCosine => functions::acos(a),
        Operator::ArcTangent => functions::atan(a),
        Operator::ArcTangent2 => functions::atan2(a, b),
        Operator::Exponential => functions::exp(a),
        _ => functions::ln(a),
    };
    (one, one)
}

macro_rules! functions {
    ($($name:ident, $wide:ident: $operator:path;)*) => {
        $(
            /// One number.
            unsafe extern "C" fn $name(a: *const f64, b: *const f64, first: *mut f64, second: *mut f64) {
                // SAFETY: the code passes addresses of places in the memory of a plan, which it was given for this call.
                unsafe {
                    let (one, other) = results($operator, *a, *b);
                    *second = other;
                    *first = one;
                }
            }

            /// Four numbers.
            #[target_feature(enable = "avx2")]
            unsafe extern "C" fn $wide(a: *const f64, b: *const f64, first: *mut f64, second: *mut f64) {
                // SAFETY: as above; a place is four numbers long.
                unsafe {
                    let (one, other) = results($operator, *a.cast::<Lanes<f64, 4>>(), *b.cast::<Lanes<f64, 4>>());
                    *second.cast::<Lanes<f64, 4>>() = other;
                    *first.cast::<Lanes<f64, 4>>() = one;
                }
            }
        )*

        /// The function of an operator; none where that is an instruction, or a table.
        pub fn function(operator: Operator, wide: bool) -> Option<Function> {
            match operator {
                $($operator => Some(if wide { $wide } else { $name }),)*
                _ => None,
            }
        }
    };
}

functions! {
    sine_cosine, sine_cosine_wide: Operator::SineCosine;
    tangent, tangent_wide: Operator::Tangent;
    arc_sine, arc_sine_wide: Operator::ArcSine;
    arc_cosine, arc_cosine_wide: Operator::ArcCosine;
    arc_tangent, arc_tangent_wide: Operator::ArcTangent;
    arc_tangent_2, arc_tangent_2_wide: Operator::ArcTangent2;
    exponential, exponential_wide: Operator::Exponential;
    logarithm, logarithm_wide: Operator::Logarithm;
}
