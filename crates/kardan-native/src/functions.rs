//! Elementary functions as the code calls them: by the addresses of their arguments and results.

use kardan_rt::{Lanes, Number, Operator, functions};

use crate::width::Width;

/// A function: addresses of two operands and two results.
type Function = unsafe extern "C" fn(*const f64, *const f64, *mut f64, *mut f64);

/// The result of an operator for a and b.
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

/// A function of an operator for numbers of this type, with instructions of this feature.
macro_rules! function {
    ($name:ident, $operator:path, $number:ty $(, $feature:literal)?) => {
        $(#[target_feature(enable = $feature)])?
        unsafe extern "C" fn $name(a: *const f64, b: *const f64, first: *mut f64, second: *mut f64) {
            // SAFETY: the code passes addresses within the memory of a plan, which it received for this call; each is
            // as long as this number, and aligned as its lanes are.
            unsafe {
                let (one, other) = results($operator, *a.cast::<$number>(), *b.cast::<$number>());
                *second.cast::<$number>() = other;
                *first.cast::<$number>() = one;
            }
        }
    };
}

/// The functions of operators, by their names for one number, four and eight.
macro_rules! functions {
    ($($operator:path: $one:ident, $four:ident, $eight:ident;)*) => {
        $(
            function!($one, $operator, f64);
            function!($four, $operator, Lanes<f64, 4>, "avx2");
            function!($eight, $operator, Lanes<f64, 8>, "avx512f");
        )*

        /// The function of an operator; none where that is an instruction, or a table.
        pub fn function(operator: Operator, width: Width) -> Option<Function> {
            match (operator, width) {
                $(
                    ($operator, Width::One) => Some($one),
                    ($operator, Width::Four) => Some($four),
                    ($operator, Width::Eight) => Some($eight),
                )*
                _ => None,
            }
        }
    };
}

functions! {
    Operator::SineCosine: sine_cosine, sine_cosine_4, sine_cosine_8;
    Operator::Tangent: tangent, tangent_4, tangent_8;
    Operator::ArcSine: arc_sine, arc_sine_4, arc_sine_8;
    Operator::ArcCosine: arc_cosine, arc_cosine_4, arc_cosine_8;
    Operator::ArcTangent: arc_tangent, arc_tangent_4, arc_tangent_8;
    Operator::ArcTangent2: arc_tangent_2, arc_tangent_2_4, arc_tangent_2_8;
    Operator::Exponential: exponential, exponential_4, exponential_8;
    Operator::Logarithm: logarithm, logarithm_4, logarithm_8;
}
