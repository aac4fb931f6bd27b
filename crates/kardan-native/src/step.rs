//! The recurrence of the Taylor coefficients of one value.
//!
//! The coefficients of a product are sums of products, those of a function follow from its differential equation (Griewank and Walther,
//! Evaluating Derivatives, 2008, chapter 13).

use std::ops::Range;

use kardan_rt::{Number, Operator, Real};

/// How the coefficients of one value follow from those of others, by indices into the values of an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// The operator that computes the value from its operands.
    pub operator: Operator,
    /// Whether the second operand is constant, so that a product or quotient needs only the coefficient of its own
    /// order.
    pub scaled: bool,
    /// Where the value is.
    pub out: u32,
    /// Its operands.
    pub operands: [u32; 3],
    /// The auxiliary value of the rule, if it has one: the cosine of a sine, 1 + t² of a tangent, √(1 − a²) of an arc
    /// sine or cosine, 1 + a² of an arc tangent, a² + b² of an angle of a point. For a selection, the value whose sign
    /// selects: the first operand where it is negative, else the second.
    pub more: u32,
}

impl Step {
    /// Whether there is a rule: for an operation with kinks only for one of two values, as long as it is the same one.
    pub fn has_rule(&self) -> bool {
        use Operator::{Absolute, Maximum, Minimum, Table};
        !matches!(self.operator, Absolute | Minimum | Maximum | Table)
    }

    /// Writes the auxiliary value of the rule into the coefficients of order 0, which contain the values.
    ///
    /// # Panics
    /// If there is no such index.
    pub fn begin<N: Number<One = f64>>(&self, values: &mut [N]) {
        let at = |place: u32| values[place as usize];
        let (one, [a, b, _]) = (N::all(1.0), self.operands);
        let beside = match self.operator {
            Operator::Tangent => one + at(self.out) * at(self.out),
            Operator::ArcSine | Operator::ArcCosine => ((one - at(a)) * (one + at(a))).map(Real::sqrt),
            Operator::ArcTangent => one + at(a) * at(a),
            Operator::ArcTangent2 => at(a) * at(a) + at(b) * at(b),
            _ => return,
        };
        values[self.more as usize] = beside;
    }

    /// Computes the coefficient of order k, at least 1, of the value and of the auxiliary value, in memory with `width`
    /// values per order, order after order. NaN where there is no rule.
    ///
    /// ```
    /// use kardan_native::Step;
    /// use kardan_rt::Operator;
    /// // y = √x at places 1 and 0, x = 4 + 4 t: y = 2 + t + …
    /// let root = Step { operator: Operator::SquareRoot, scaled: false, out: 1, operands: [0, 0, 0], more: 0 };
    /// let mut memory = [4.0, 2.0, 4.0, 0.0];
    /// root.find(&mut memory, 2, 1);
    /// assert_eq!(memory[3], 1.0);
    /// ```
    ///
    /// # Panics
    /// If the memory has no such index.
    pub fn find<N: Number<One = f64>>(&self, memory: &mut [N], width: usize, k: usize) {
        let mut all = Coefficients { memory, width, k };
        let value = self.rule(&mut all).unwrap_or(N::all(f64::NAN));
        all.put(self.out, value);
    }

    /// The coefficient of the value, where there is a rule; that of the auxiliary value is written.
    pub(crate) fn rule<R: Rules>(&self, rules: &mut R) -> Option<R::Value> {
        use Operator::{Add, Divide, Multiply, Subtract};
        let Step { operator, scaled, out, operands: [a, b, c], more } = *self;
        Some(match operator {
            Add | Subtract => rules.apply(operator, rules.now(a), rules.now(b)),
            Operator::Negate => rules.negated(rules.now(a)),
            Divide if scaled => rules.apply(Divide, rules.now(a), rules.begin(b)),
            Divide => {
                let below = rules.sum(out, b, Span::Below);
                rules.quotient(rules.now(a), below, b)
            }
            Multiply | Operator::AddProduct | Operator::SubtractProduct => {
                let product =
                    if scaled { rules.apply(Multiply, rules.now(a), rules.begin(b)) } else { rules.product(a, b) };
                match operator {
                    Operator::AddProduct => rules.apply(Add, product, rules.now(c)),
                    Operator::SubtractProduct => rules.apply(Subtract, rules.now(c), product),
                    _ => product,
                }
            }
            Operator::SquareRoot => {
                let inner = rules.sum(out, out, Span::Inner);
                let rest = rules.apply(Subtract, rules.now(a), inner);
                rules.by_doubled(rest, out)
            }
            Operator::Exponential => rules.sloped(a, out, Span::Upper),
            Operator::Logarithm => {
                let inner = rules.sloped(out, a, Span::Inner);
                rules.quotient(rules.now(a), inner, a)
            }
            Operator::SineCosine => {
                let (cosine, sine) = (rules.sloped(a, out, Span::Upper), rules.sloped(a, more, Span::Upper));
                let cosine = rules.negated(cosine);
                rules.put(more, cosine);
                sine
            }
            Operator::Tangent => {
                let tangent = rules.sloped(a, more, Span::Upper);
                rules.put(out, tangent);
                let square = rules.product(out, out);
                rules.put(more, square);
                tangent
            }
            Operator::ArcTangent | Operator::ArcTangent2 | Operator::ArcSine | Operator::ArcCosine => {
                let square = rules.product(a, a);
                let auxiliary = match operator {
                    Operator::ArcTangent => square,
                    Operator::ArcTangent2 => {
                        let other = rules.product(b, b);
                        rules.apply(Add, square, other)
                    }
                    _ => {
                        let inner = rules.sum(more, more, Span::Inner);
                        let squares = rules.apply(Add, square, inner);
                        let negated = rules.negated(squares);
                        rules.by_doubled(negated, more)
                    }
                };
                rules.put(more, auxiliary);
                let slope = match operator {
                    Operator::ArcTangent2 => {
                        let (turn, back) = (rules.sloped(a, b, Span::Upper), rules.sloped(b, a, Span::Upper));
                        rules.apply(Subtract, turn, back)
                    }
                    Operator::ArcCosine => rules.negated(rules.now(a)),
                    _ => rules.now(a),
                };
                let inner = rules.sloped(out, more, Span::Inner);
                rules.quotient(slope, inner, more)
            }
            Operator::Select => rules.select(rules.begin(more), rules.now(a), rules.now(b)),
            Operator::Absolute | Operator::Minimum | Operator::Maximum | Operator::Table => return None,
        })
    }
}

/// Which terms a sum `Σ a_j b_(k−j)` has.
#[derive(Clone, Copy)]
pub enum Span {
    /// j = 0 … k
    All,
    /// j = 0 … k − 1
    Below,
    /// j = 0 … (k − 1)/2, rounded down
    Half,
    /// j = 1 … k
    Upper,
    /// j = 1 … k − 1
    Inner,
}

impl Span {
    #[inline]
    pub fn orders(self, k: usize) -> Range<usize> {
        match self {
            Self::All => 0..k + 1,
            Self::Below => 0..k,
            Self::Half => 0..k.div_ceil(2),
            Self::Upper => 1..k + 1,
            Self::Inner => 1..k,
        }
    }
}

/// What the rules of steps are written in: numbers, or registers of the code that computes them. k is the order sought.
pub trait Rules {
    /// A number, or where it is. A result is an operand once.
    type Value: Copy;

    /// The coefficient of order k.
    fn now(&self, place: u32) -> Self::Value;

    /// The value itself.
    fn begin(&self, place: u32) -> Self::Value;

    /// Writes the coefficient of order k.
    fn put(&mut self, place: u32, value: Self::Value);

    /// A sum, difference, product or quotient.
    fn apply(&mut self, operator: Operator, first: Self::Value, last: Self::Value) -> Self::Value;

    /// The negative.
    fn negated(&mut self, value: Self::Value) -> Self::Value;

    /// `then` where the sign is negative, else `otherwise`.
    fn select(&mut self, sign: Self::Value, then: Self::Value, otherwise: Self::Value) -> Self::Value;

    /// `Σ a_j b_(k−j)` over some j.
    fn sum(&mut self, a: u32, b: u32, span: Span) -> Self::Value;

    /// The same over all j; of a square two times the sum over the lower half, plus the square in the middle where
    /// there is one.
    fn product(&mut self, a: u32, b: u32) -> Self::Value;

    /// `Σ j a_j b_(k−j)/k` over some j from 1: over all up to k the coefficient of `∫ b ȧ`.
    fn sloped(&mut self, a: u32, b: u32, span: Span) -> Self::Value;

    /// `(whole − part)/b_0`
    #[inline]
    fn quotient(&mut self, whole: Self::Value, part: Self::Value, b: u32) -> Self::Value {
        let rest = self.apply(Operator::Subtract, whole, part);
        self.apply(Operator::Divide, rest, self.begin(b))
    }

    /// `value/(2·b_0)`
    #[inline]
    fn by_doubled(&mut self, value: Self::Value, b: u32) -> Self::Value {
        let doubled = self.apply(Operator::Add, self.begin(b), self.begin(b));
        self.apply(Operator::Divide, value, doubled)
    }
}

/// The coefficients of all values, while those of order k are computed.
struct Coefficients<'a, N> {
    memory: &'a mut [N],
    width: usize,
    k: usize,
}

impl<N: Number<One = f64>> Coefficients<'_, N> {
    #[inline]
    fn at(&self, place: u32, order: usize) -> N {
        self.memory[order * self.width + place as usize]
    }
}

impl<N: Number<One = f64>> Rules for Coefficients<'_, N> {
    type Value = N;

    #[inline]
    fn now(&self, place: u32) -> N {
        self.at(place, self.k)
    }

    #[inline]
    fn begin(&self, place: u32) -> N {
        self.at(place, 0)
    }

    #[inline]
    fn put(&mut self, place: u32, value: N) {
        self.memory[self.k * self.width + place as usize] = value;
    }

    #[inline]
    fn apply(&mut self, operator: Operator, first: N, last: N) -> N {
        match operator {
            Operator::Add => first + last,
            Operator::Subtract => first - last,
            Operator::Multiply => first * last,
            _ => first / last,
        }
    }

    #[inline]
    fn negated(&mut self, value: N) -> N {
        -value
    }

    #[inline]
    fn select(&mut self, sign: N, then: N, otherwise: N) -> N {
        sign.select(N::all(0.0), then, otherwise)
    }

    #[inline]
    fn sum(&mut self, a: u32, b: u32, span: Span) -> N {
        span.orders(self.k).fold(N::all(0.0), |sum, j| sum + self.at(a, j) * self.at(b, self.k - j))
    }

    fn product(&mut self, a: u32, b: u32) -> N {
        if a != b {
            return self.sum(a, b, Span::All);
        }
        let half = self.sum(a, a, Span::Half);
        let doubled = half + half;
        if self.k.is_multiple_of(2) { doubled + self.at(a, self.k / 2) * self.at(a, self.k / 2) } else { doubled }
    }

    #[inline]
    fn sloped(&mut self, a: u32, b: u32, span: Span) -> N {
        let term = |j: usize| N::all(j as f64) * self.at(a, j) * self.at(b, self.k - j);
        span.orders(self.k).fold(N::all(0.0), |sum, j| sum + term(j)) * N::all(1.0 / self.k as f64)
    }
}
