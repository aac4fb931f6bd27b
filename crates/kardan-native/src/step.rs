use kardan_rt::Operator;

/// How the coefficients of one value follow from those of others, by places among the values of an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// What the value is of its operands.
    pub operator: Operator,
    /// Whether the second operand does not change, so that a product or quotient needs the coefficient of its own order alone.
    pub scaled: bool,
    /// Where the value is.
    pub out: u32,
    /// Its operands.
    pub operands: [u32; 3],
    /// What the rule keeps beside, if it does.
    pub more: u32,
}
