//! Dimensions of the parts of an expression, whatever their values.

use super::super::{Dimension, UnitError};
use super::tree::{Called, Node};

impl Node {
    /// An error at this part.
    pub fn error(&self, code: &'static str, message: impl Into<String>, help: impl Into<String>) -> UnitError {
        UnitError::new(code, self.span.clone(), message).help(help)
    }

    /// Another kind of quantity is expected here.
    pub(crate) fn unlike(&self, expected: &str, found: &Dimension) -> UnitError {
        let message = format!("expected {expected}, found {}", found.noun());
        self.error("unit::dimension", message, "check the units of this part")
    }

    /// The error for a part that is no finite `f64`.
    pub fn too_large(&self) -> UnitError {
        self.error("number::range", "this part is too large", "check the exponents")
    }

    /// Whether this part can be added to another or compared with it.
    pub fn like(&self, other: &Dimension, own: &Dimension) -> Result<(), UnitError> {
        if other.is_like(own) { Ok(()) } else { Err(self.unlike(&other.noun(), own)) }
    }

    /// Of a power of a part; `whole` if the power is a whole number.
    pub fn power_dimension(
        &self,
        parts: &[Self; 2],
        [base, power]: [&Dimension; 2],
        whole: Option<i32>,
    ) -> Result<Dimension, UnitError> {
        if !power.is_like(&Dimension::NONE) {
            return Err(parts[1].unlike("a number without a unit", power));
        }
        if let Some(whole) = whole {
            return Dimension::NONE.times(base, whole).ok_or_else(|| self.too_large());
        }
        if base.is_like(&Dimension::NONE) {
            return Ok(Dimension::NONE);
        }
        let message = format!("only a number without a unit has a power that is not whole; this is {}", base.noun());
        Err(parts[0].error("unit::dimension", message, "write `sqrt(...)` for the power 1/2"))
    }

    /// Of a function of parts.
    pub fn call_dimension(
        function: Called,
        arguments: &[Self],
        dimensions: &[Dimension],
    ) -> Result<Dimension, UnitError> {
        use Called::{Abs, Acos, Asin, Atan, Atan2, Cos, Exp, Ln, Max, Min, Sign, Sin, Sqrt, Tan};
        let first = &dimensions[0];
        for (argument, dimension) in arguments.iter().zip(dimensions).skip(1) {
            argument.like(first, dimension)?;
        }
        match function {
            Sin | Cos | Tan if !first.is_like(&Dimension::NONE) => Err(arguments[0].unlike("an angle", first)),
            Asin | Acos | Atan | Exp | Ln if !first.is_like(&Dimension::NONE) => {
                Err(arguments[0].unlike("a number without a unit", first))
            }
            Sin | Cos | Tan | Exp | Ln | Sign => Ok(Dimension::NONE),
            Asin | Acos | Atan | Atan2 => Ok(Dimension::ANGLE),
            Abs | Min | Max => Ok(*first),
            Sqrt => {
                let angle = if first.angle % 2 == 0 { first.angle / 2 } else { 0 };
                let mut dimension = Dimension { angle, ..*first };
                if dimension.exponents.iter().any(|power| power % 2 != 0) {
                    let message = format!("{} has no square root", first.noun());
                    return Err(arguments[0].error("unit::dimension", message, "check the units of this part"));
                }
                dimension.exponents.iter_mut().for_each(|power| *power /= 2);
                Ok(dimension)
            }
        }
    }
}
