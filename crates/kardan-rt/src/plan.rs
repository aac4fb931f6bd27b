//! Straight-line plans: lists of operations without branches, heap or indirection.

use crate::dense::sum;
use crate::number::Number;
use crate::{Real, functions};

/// The result of an operation on its operands a, b, c, d.
///
/// Products and sums are rounded one after the other on every target, never contracted, so that the bits are the same everywhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Operator {
    /// a + b
    Add,
    /// a − b
    Subtract,
    /// a·b
    Multiply,
    /// a/b
    Divide,
    /// c + a·b
    AddProduct,
    /// c − a·b
    SubtractProduct,
    /// −a
    Negate,
    /// |a|
    Absolute,
    /// √a
    SquareRoot,
    /// sin a and cos a: two values
    SineCosine,
    /// tan a
    Tangent,
    /// asin a
    ArcSine,
    /// acos a
    ArcCosine,
    /// atan a
    ArcTangent,
    /// The angle of the point (b, a)
    ArcTangent2,
    /// eᵃ
    Exponential,
    /// ln a
    Logarithm,
    /// The smaller of a and b
    Minimum,
    /// The larger of a and b
    Maximum,
    /// c where a < b, else d
    Select,
    /// A [`Table`] at b; a is its number, no value
    Table,
}

impl Operator {
    /// How many operands it has.
    pub const fn operands(self) -> usize {
        match self {
            Self::Select => 4,
            Self::AddProduct | Self::SubtractProduct => 3,
            Self::Add | Self::Subtract | Self::Multiply | Self::Divide | Self::ArcTangent2 | Self::Minimum => 2,
            Self::Maximum | Self::Table => 2,
            _ => 1,
        }
    }

    /// How many values it gives.
    pub const fn values(self) -> usize {
        if matches!(self, Self::SineCosine) { 2 } else { 1 }
    }
}

/// Operations of one kind that do not need each other, one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    /// The operator.
    pub operator: Operator,
    /// How many they are.
    pub count: usize,
}

/// A function given by polynomials between knots; the first and the last extrapolate.
///
/// Its numbers are in [`Plan::numbers`], one after the other: the knots, rising, one fewer than pieces; the point at
/// which the argument of each piece is zero; the coefficients of the pieces, constant first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Table {
    /// Where its numbers begin.
    pub first: usize,
    /// How many pieces it has.
    pub pieces: usize,
    /// Coefficients of a piece.
    pub terms: usize,
}

impl Table {
    /// How many numbers it has.
    pub const fn count(&self) -> usize {
        sum(&[self.pieces.saturating_sub(1), self.pieces, self.pieces.saturating_mul(self.terms)])
    }

    /// The value at x; not finite where the table is not whole.
    #[inline]
    pub(crate) fn at<T: Real>(&self, numbers: &[T], x: T) -> T {
        self.found(numbers, x).map_or(T::NAN, |y| y)
    }

    fn found<T: Real>(&self, numbers: &[T], x: T) -> Option<T> {
        let own = numbers.get(self.first..)?;
        let (knots, own) = own.split_at_checked(self.pieces.checked_sub(1)?)?;
        let (origins, coefficients) = own.split_at_checked(self.pieces)?;
        let piece = knots.partition_point(|knot| *knot <= x);
        let first = piece.checked_mul(self.terms)?;
        let own = coefficients.get(first..first.checked_add(self.terms)?)?;
        let x = x - *origins.get(piece)?;
        Some(own.iter().rev().fold(T::ZERO, |value, coefficient| value * x + *coefficient))
    }
}

/// A list of operations that computes outputs from inputs.
///
/// Its memory contains the inputs first, then the constants, then the values of all operations in their order; operands
/// are indices into it. `kardan::plan` compiles models to such lists.
///
/// ```
/// use kardan_rt::{Operator, Plan, Run};
/// // y = 3·sin x
/// let plan = Plan {
///     inputs: 1,
///     constants: &[3.0],
///     runs: &[Run { operator: Operator::SineCosine, count: 1 }, Run { operator: Operator::Multiply, count: 1 }],
///     operands: &[0, 1, 2],
///     outputs: &[4],
///     tables: &[],
///     numbers: &[],
/// };
/// let mut memory = [0.0; 5];
/// assert_eq!(memory.len(), plan.memory());
/// plan.begin(&mut memory);
/// memory[0] = 0.5;
/// assert!(plan.evaluate(&mut memory));
/// assert_eq!(plan.output(0, &memory), Some(3.0 * kardan_rt::functions::sin(0.5)));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan<'a, T> {
    /// How many inputs it has.
    pub inputs: usize,
    /// The constants.
    pub constants: &'a [T],
    /// The operations, in runs of one kind.
    pub runs: &'a [Run],
    /// Operands of all operations, one after the other: indices into the memory.
    pub operands: &'a [u32],
    /// Where the outputs are.
    pub outputs: &'a [u32],
    /// The tables.
    pub tables: &'a [Table],
    /// Their numbers.
    pub numbers: &'a [T],
}

#[inline]
fn place(number: u32) -> usize {
    usize::try_from(number).map_or(usize::MAX, |place| place)
}

/// The value at an index. An index out of range means that the plan is incomplete.
#[inline]
fn value<N: Number>(computed: &[N], number: u32) -> N {
    computed.get(place(number)).map_or(N::all(N::One::NAN), |x| *x)
}

impl<T: Real> Plan<'_, T> {
    /// Entries of memory that it needs.
    pub fn memory(&self) -> usize {
        let values = |run: &Run| run.count.saturating_mul(run.operator.values());
        self.runs.iter().fold(sum(&[self.inputs, self.constants.len()]), |all, run| sum(&[all, values(run)]))
    }

    /// Writes the constants into the memory; once, before the first evaluation.
    pub fn begin<N: Number<One = T>>(&self, memory: &mut [N]) {
        for (place, constant) in memory.iter_mut().skip(self.inputs).zip(self.constants) {
            *place = N::all(*constant);
        }
    }

    /// Computes all values from the inputs at the begin of the memory. Returns whether all inputs and outputs are
    /// finite; false also where the memory is too short, or the plan is incomplete.
    ///
    /// Costs some 1 ns for each operation; sines, roots and quotients more.
    #[must_use = "false: an output is not finite"]
    pub fn evaluate<N: Number<One = T>>(&self, memory: &mut [N]) -> bool {
        let mut done = sum(&[self.inputs, self.constants.len()]);
        let mut operands = self.operands;
        for Run { operator, count } in self.runs {
            let Some((computed, rest)) = memory.split_at_mut_checked(done) else { return false };
            let values = count.saturating_mul(operator.values());
            let Some(out) = rest.get_mut(..values) else { return false };
            let Some((own, later)) = operands.split_at_checked(count.saturating_mul(operator.operands())) else {
                return false;
            };
            self.run(*operator, own, computed, out);
            operands = later;
            done = sum(&[done, values]);
        }
        memory.iter().take(self.inputs).all(|input| input.all_finite())
            && self.outputs.iter().all(|output| memory.get(place(*output)).is_some_and(|value| value.all_finite()))
    }

    /// An output of the last evaluation; none where there is no such output.
    #[inline]
    pub fn output<N: Number<One = T>>(&self, output: usize, memory: &[N]) -> Option<N> {
        memory.get(place(*self.outputs.get(output)?)).copied().filter(|value| value.all_finite())
    }

    #[inline]
    fn run<N: Number<One = T>>(&self, operator: Operator, operands: &[u32], computed: &[N], out: &mut [N]) {
        // The result of each operation from the values of its operands.
        macro_rules! each {
            ([$($operand:ident),+] => $result:expr) => {
                for (out, [$($operand),+]) in out.iter_mut().zip(operands.as_chunks().0) {
                    $(let $operand = value(computed, *$operand);)+
                    *out = $result;
                }
            };
        }
        match operator {
            Operator::Add => each!([a, b] => a + b),
            Operator::Subtract => each!([a, b] => a - b),
            Operator::Multiply => each!([a, b] => a * b),
            Operator::Divide => each!([a, b] => a / b),
            Operator::AddProduct => each!([a, b, c] => c + a * b),
            Operator::SubtractProduct => each!([a, b, c] => c - a * b),
            Operator::Negate => each!([a] => -a),
            Operator::Absolute => each!([a] => a.map(Real::abs)),
            Operator::SquareRoot => each!([a] => a.map(Real::sqrt)),
            Operator::SineCosine => {
                let Some((sines, cosines)) = out.split_at_mut_checked(operands.len()) else { return };
                for ((sine, cosine), a) in sines.iter_mut().zip(cosines).zip(operands) {
                    (*sine, *cosine) = functions::sin_cos(value(computed, *a));
                }
            }
            Operator::Tangent => each!([a] => functions::tan(a)),
            Operator::ArcSine => each!([a] => functions::asin(a)),
            Operator::ArcCosine => each!([a] => functions::acos(a)),
            Operator::ArcTangent => each!([a] => functions::atan(a)),
            Operator::ArcTangent2 => each!([a, b] => functions::atan2(a, b)),
            Operator::Exponential => each!([a] => functions::exp(a)),
            Operator::Logarithm => each!([a] => functions::ln(a)),
            Operator::Minimum => each!([a, b] => a.select(b, a, b)),
            Operator::Maximum => each!([a, b] => a.select(b, b, a)),
            Operator::Select => each!([a, b, c, d] => a.select(b, c, d)),
            Operator::Table => {
                for (out, [number, x]) in out.iter_mut().zip(operands.as_chunks().0) {
                    let at = |x| self.tables.get(place(*number)).map_or(T::NAN, |table| table.at(self.numbers, x));
                    *out = value(computed, *x).map(at);
                }
            }
        }
    }
}
