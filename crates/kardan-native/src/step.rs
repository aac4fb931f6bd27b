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
        let value = all.value(self);
        all.put(self.out, value);
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

    #[inline]
    fn now(&self, place: u32) -> N {
        self.at(place, self.k)
    }

    #[inline]
    fn doubled(&self, place: u32) -> N {
        N::all(2.0) * self.at(place, 0)
    }

    #[inline]
    fn put(&mut self, place: u32, value: N) {
        self.memory[self.k * self.width + place as usize] = value;
    }

    /// `Σ a_j b_(k−j)` over some j.
    #[inline]
    fn sum(&self, a: u32, b: u32, orders: Range<usize>) -> N {
        orders.fold(N::all(0.0), |sum, j| sum + self.at(a, j) * self.at(b, self.k - j))
    }

    /// The same over j = 0 … k; of a square each pair once.
    fn product(&self, a: u32, b: u32) -> N {
        if a != b {
            return self.sum(a, b, 0..self.k + 1);
        }
        let half = self.sum(a, a, 0..self.k.div_ceil(2));
        let doubled = half + half;
        if self.k.is_multiple_of(2) { doubled + self.at(a, self.k / 2) * self.at(a, self.k / 2) } else { doubled }
    }

    /// `Σ a_j a_(k−j)` over j = 1 … k − 1.
    fn inner(&self, a: u32) -> N {
        self.sum(a, a, 1..self.k)
    }

    /// `Σ j a_j b_(k−j)/k` over some j from 1: over all up to k the coefficient of `∫ b ȧ`.
    #[inline]
    fn sloped(&self, a: u32, b: u32, orders: Range<usize>) -> N {
        let term = |j: usize| N::all(j as f64) * self.at(a, j) * self.at(b, self.k - j);
        orders.fold(N::all(0.0), |sum, j| sum + term(j)) * N::all(1.0 / self.k as f64)
    }

    fn value(&mut self, step: &Step) -> N {
        let k = self.k;
        let Step { operator, scaled, out, operands: [a, b, c], more } = *step;
        match operator {
            Operator::Add => self.now(a) + self.now(b),
            Operator::Subtract => self.now(a) - self.now(b),
            Operator::Negate => -self.now(a),
            Operator::Multiply if scaled => self.now(a) * self.at(b, 0),
            Operator::Divide if scaled => self.now(a) / self.at(b, 0),
            Operator::AddProduct if scaled => self.now(c) + self.now(a) * self.at(b, 0),
            Operator::SubtractProduct if scaled => self.now(c) - self.now(a) * self.at(b, 0),
            Operator::Multiply => self.product(a, b),
            Operator::AddProduct => self.now(c) + self.product(a, b),
            Operator::SubtractProduct => self.now(c) - self.product(a, b),
            Operator::Divide => (self.now(a) - self.sum(out, b, 0..k)) / self.at(b, 0),
            Operator::SquareRoot => (self.now(a) - self.inner(out)) / self.doubled(out),
            Operator::Exponential => self.sloped(a, out, 1..k + 1),
            Operator::Logarithm => (self.now(a) - self.sloped(out, a, 1..k)) / self.at(a, 0),
            Operator::SineCosine => {
                let (cosine, sine) = (-self.sloped(a, out, 1..k + 1), self.sloped(a, more, 1..k + 1));
                self.put(more, cosine);
                sine
            }
            Operator::Tangent => {
                let tangent = self.sloped(a, more, 1..k + 1);
                self.put(out, tangent);
                self.put(more, self.product(out, out));
                tangent
            }
            Operator::ArcTangent => {
                self.put(more, self.product(a, a));
                (self.now(a) - self.sloped(out, more, 1..k)) / self.at(more, 0)
            }
            Operator::ArcSine | Operator::ArcCosine => {
                let square = self.product(a, a) + self.inner(more);
                self.put(more, -square / self.doubled(more));
                let slope = if operator == Operator::ArcSine { self.now(a) } else { -self.now(a) };
                (slope - self.sloped(out, more, 1..k)) / self.at(more, 0)
            }
            Operator::ArcTangent2 => {
                self.put(more, self.product(a, a) + self.product(b, b));
                let turn = self.sloped(a, b, 1..k + 1) - self.sloped(b, a, 1..k + 1);
                (turn - self.sloped(out, more, 1..k)) / self.at(more, 0)
            }
            Operator::Select => self.at(more, 0).select(N::all(0.0), self.now(a), self.now(b)),
            Operator::Absolute | Operator::Minimum | Operator::Maximum | Operator::Table => N::all(f64::NAN),
        }
    }
}
