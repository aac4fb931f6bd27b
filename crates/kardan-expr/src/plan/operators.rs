//! The words of operators.

use kardan_rt::Operator;

/// Each operator with its word.
pub(super) const OPERATORS: [(Operator, &str); 21] = [
    (Operator::Add, "add"),
    (Operator::Subtract, "subtract"),
    (Operator::Multiply, "multiply"),
    (Operator::Divide, "divide"),
    (Operator::AddProduct, "add_product"),
    (Operator::SubtractProduct, "subtract_product"),
    (Operator::Negate, "negate"),
    (Operator::Absolute, "absolute"),
    (Operator::SquareRoot, "square_root"),
    (Operator::SineCosine, "sine_cosine"),
    (Operator::Tangent, "tangent"),
    (Operator::ArcSine, "arc_sine"),
    (Operator::ArcCosine, "arc_cosine"),
    (Operator::ArcTangent, "arc_tangent"),
    (Operator::ArcTangent2, "arc_tangent_2"),
    (Operator::Exponential, "exponential"),
    (Operator::Logarithm, "logarithm"),
    (Operator::Minimum, "minimum"),
    (Operator::Maximum, "maximum"),
    (Operator::Select, "select"),
    (Operator::Table, "table"),
];

/// The word of an operator in texts.
pub fn word(operator: Operator) -> &'static str {
    OPERATORS.iter().find(|(candidate, _)| *candidate == operator).map_or("", |(_, word)| word)
}
