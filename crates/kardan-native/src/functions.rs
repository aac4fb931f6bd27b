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

/// The function of an operator for numbers of this type, with instructions of this feature.
macro_rules! function {
    ($operator:ident, $number:ty $(, $feature:literal)?) => {{
        $(#[target_feature(enable = $feature)])?
        unsafe extern "C" fn function(a: *const f64, b: *const f64, first: *mut f64, second: *mut f64) {
            // SAFETY: the code passes addresses within the memory of a plan, which it received for this call; each is
            // as long as this number, and aligned as its lanes are.
            unsafe {
                let (one, other) = results(Operator::$operator, *a.cast::<$number>(), *b.cast::<$number>());
                *second.cast::<$number>() = other;
                *first.cast::<$number>() = one;
            }
        }
        function
    }};
}

/// The functions of operators.
macro_rules! functions {
    ($($operator:ident)*) => {
        /// The function of an operator; none where that is an instruction, or a table.
        pub fn function(operator: Operator, width: Width) -> Option<Function> {
            let function: Function = match (operator, width) {
                $(
                    (Operator::$operator, Width::One) => function!($operator, f64),
                    (Operator::$operator, Width::Four) => function!($operator, Lanes<f64, 4>, "avx2"),
                    (Operator::$operator, Width::Eight) => function!($operator, Lanes<f64, 8>, "avx512f"),
                )*
                _ => return None,
            };
            Some(function)
        }
    };
}

functions! { SineCosine Tangent ArcSine ArcCosine ArcTangent ArcTangent2 Exponential Logarithm }
