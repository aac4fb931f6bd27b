//! Code for coefficients of Taylor series: the same as [`Step::find`], in the same order of additions.

use std::ops::Range;

use kardan_rt::Operator;

use crate::assembler::{ADD, Assembler, DIVIDE, MULTIPLY, Opcode, Operand, Register, SUBTRACT, Terms, XOR};
use crate::registers::{MASK, Registers, SIGN, SIZE};
use crate::step::Step;
use crate::width::Width;

/// Orders that code of their own may have.
pub const ORDERS: usize = 32;
/// Constants of the code: the sign bit, then the whole numbers from 1, then 0.
pub static NUMBERS: [f64; ORDERS + 2] = numbers();
/// The register with `1/k`.
const PER: Register = SIZE;
/// A register for a value that is used at once.
const PRODUCT: Register = MASK;

/// Where 0 is in them.
const ZERO: Operand = Operand::Number(8 * (ORDERS as u32 + 1));

const fn numbers() -> [f64; ORDERS + 2] {
    let (mut numbers, mut j) = ([0.0; ORDERS + 2], 1);
    numbers[0] = -0.0;
    while j <= ORDERS {
        numbers[j] = j as f64;
        j += 1;
    }
    numbers
}

/// Which terms a sum `Σ a_j b_(k−j)` has.
#[derive(Clone, Copy)]
enum Span {
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
    fn orders(self, k: u32) -> Range<u32> {
        match self {
            Self::All => 0..k + 1,
            Self::Below => 0..k,
            Self::Half => 0..k.div_ceil(2),
            Self::Upper => 1..k + 1,
            Self::Inner => 1..k,
        }
    }

    /// How many they are, and the first of them.
    fn terms(self) -> (Terms, u32) {
        match self {
            Self::All => (Terms::More, 0),
            Self::Below => (Terms::Order, 0),
            Self::Half => (Terms::Half, 0),
            Self::Upper => (Terms::Order, 1),
            Self::Inner => (Terms::Less, 1),
        }
    }
}

/// About how many sums over all orders a rule forms.
pub fn sums(step: &Step) -> usize {
    match step.operator {
        Operator::Add | Operator::Subtract | Operator::Negate | Operator::Select => 0,
        _ if step.scaled => 0,
        Operator::SineCosine | Operator::Tangent | Operator::ArcTangent | Operator::ArcSine | Operator::ArcCosine => 2,
        Operator::ArcTangent2 => 4,
        _ => 1,
    }
}

/// Writes a function for steps that have rules, with `width` values per order: for one order, or with loops for any
/// order from 1 on.
pub fn write(assembler: &mut Assembler, steps: &[Step], values: u32, width: Width, order: Option<u32>) {
    assembler.begin_series(SIGN, PER);
    let bytes = width.bytes();
    let mut writer = Writer { assembler, registers: Registers::new(width), bytes, order_bytes: bytes * values, order };
    for step in steps {
        writer.step(step);
        writer.registers.release();
    }
    assembler.end_series();
}

/// The code while it is written.
struct Writer<'a> {
    assembler: &'a mut Assembler,
    registers: Registers,
    /// From one value to the next, and from one order to the next.
    bytes: u32,
    order_bytes: u32,
    order: Option<u32>,
}

impl Writer<'_> {
    /// The coefficient of the order sought.
    fn now(&self, place: u32) -> Operand {
        Operand::Memory(self.bytes * place)
    }

    /// The value itself.
    fn begin(&self, place: u32) -> Operand {
        Operand::Constant(self.bytes * place)
    }

    /// The coefficient of order j, where k is sought.
    fn at(&self, place: u32, j: u32, k: u32) -> Operand {
        if j == k { self.now(place) } else { Operand::Constant(self.order_bytes * j + self.bytes * place) }
    }

    /// `target = opcode(target, last)`
    fn apply(&mut self, opcode: Opcode, target: Register, last: Operand) {
        let last = self.registers.operand(last);
        self.assembler.operation(opcode, target, target, last);
    }

    fn put(&mut self, place: u32, register: Register) {
        let place = self.now(place);
        self.registers.store_result(self.assembler, register, place);
    }

    /// `opcode(first, last)`
    fn pair(&mut self, opcode: Opcode, first: Operand, last: Operand) -> Register {
        let first = self.registers.loaded(self.assembler, first);
        let last = self.registers.operand(last);
        let target = self.registers.take();
        self.assembler.operation(opcode, target, first, last);
        target
    }

    /// `target = place − target`
    fn take_from(&mut self, place: Operand, target: Register) {
        let from = self.registers.of(place).unwrap_or_else(|| {
            self.assembler.load(PRODUCT, place);
            PRODUCT
        });
        self.assembler.operation(SUBTRACT, target, from, Operand::Register(target));
    }

    /// `Σ a_j b_(k−j)`, or `Σ j a_j b_(k−j)` from j = 1 on.
    fn sum(&mut self, places: [u32; 2], span: Span, sloped: bool) -> Register {
        let sum = self.registers.take();
        match self.order {
            Some(k) => self.terms(sum, places, k, span, sloped),
            None => self.repeated(sum, places, span, sloped),
        }
        sum
    }

    /// The sum for an order, term by term.
    ///
    /// Sums begin with 0, which makes 0 of −0 where all terms are −0. To add it to the second term does the same, and the first one, which is
    /// often the last to be known, has one addition less behind it.
    fn terms(&mut self, sum: Register, [a, b]: [u32; 2], k: u32, span: Span, sloped: bool) {
        let orders = span.orders(k);
        if orders.is_empty() {
            self.assembler.operation(XOR, sum, sum, Operand::Register(sum));
            return;
        }
        let (first, last) = (orders.start, orders.end - 1);
        for j in orders {
            let term = if j == first { sum } else { PRODUCT };
            self.term(term, [self.at(a, j, k), self.at(b, k - j, k)], if sloped { j } else { 1 });
            if j == (first + 1).min(last) {
                let zero = self.registers.spread(self.assembler, ZERO);
                self.assembler.operation(ADD, term, term, Operand::Register(zero));
            }
            if j > first {
                self.assembler.operation(ADD, sum, sum, Operand::Register(PRODUCT));
            }
        }
    }

    /// The sum in a loop, for any order.
    fn repeated(&mut self, sum: Register, [a, b]: [u32; 2], span: Span, sloped: bool) {
        self.assembler.operation(XOR, sum, sum, Operand::Register(sum));
        let (terms, from) = span.terms();
        let weight = sloped.then(|| [self.registers.take(), self.registers.take()]);
        if let Some([weight, one]) = weight {
            self.assembler.spread(weight, Operand::Number(8));
            self.assembler.spread(one, Operand::Number(8));
        }
        let (skipped, at) = ((self.order_bytes * from) as i32, |place: u32| (self.bytes * place) as i32);
        let begin = [at(a) + skipped, at(b) - skipped];
        self.assembler.repeat(terms, begin, self.order_bytes, |assembler| {
            match weight {
                Some([weight, _]) => assembler.operation(MULTIPLY, PRODUCT, weight, Operand::First),
                None => assembler.load(PRODUCT, Operand::First),
            }
            assembler.operation(MULTIPLY, PRODUCT, PRODUCT, Operand::Second);
            assembler.operation(ADD, sum, sum, Operand::Register(PRODUCT));
            if let Some([weight, one]) = weight {
                assembler.operation(ADD, weight, weight, Operand::Register(one));
            }
        });
    }

    /// `term = weight·a·b`
    fn term(&mut self, term: Register, [a, b]: [Operand; 2], weight: u32) {
        let a = if weight == 1 {
            self.factor(a)
        } else {
            let weight = self.registers.spread(self.assembler, Operand::Number(8 * weight));
            let a = self.last_factor(a);
            self.assembler.operation(MULTIPLY, term, weight, a);
            term
        };
        let b = self.last_factor(b);
        self.assembler.operation(MULTIPLY, term, a, b);
    }

    /// Whether registers store a coefficient for other terms: always those of the current order, others where there are
    /// many registers.
    fn stays_in_register(&self, place: Operand) -> bool {
        self.registers.are_many() || matches!(place, Operand::Memory(_))
    }

    /// A coefficient in a register.
    fn factor(&mut self, place: Operand) -> Register {
        if self.stays_in_register(place) {
            return self.registers.loaded(self.assembler, place);
        }
        self.assembler.load(PRODUCT, place);
        PRODUCT
    }

    /// A coefficient in memory or in a register.
    fn last_factor(&mut self, place: Operand) -> Operand {
        if self.stays_in_register(place) { self.registers.operand(place) } else { place }
    }

    /// `Σ a_j b_(k−j)` over all j; for a square two times the sum over the lower half, plus the square in the middle
    /// where there is one.
    fn product(&mut self, a: u32, b: u32) -> Register {
        if a != b {
            return self.sum([a, b], Span::All, false);
        }
        let sum = self.sum([a, a], Span::Half, false);
        self.assembler.operation(ADD, sum, sum, Operand::Register(sum));
        match self.order {
            Some(k) if k % 2 == 0 => {
                self.term(PRODUCT, [self.at(a, k / 2, k); 2], 1);
                self.assembler.operation(ADD, sum, sum, Operand::Register(PRODUCT));
            }
            Some(_) => {}
            None => self.assembler.where_even(|assembler| {
                assembler.load(PRODUCT, Operand::First);
                assembler.operation(MULTIPLY, PRODUCT, PRODUCT, Operand::First);
                assembler.operation(ADD, sum, sum, Operand::Register(PRODUCT));
            }),
        }
        sum
    }

    /// `Σ j a_j b_(k−j)/k`
    fn sloped(&mut self, a: u32, b: u32, span: Span) -> Register {
        let sum = self.sum([a, b], span, true);
        self.assembler.operation(MULTIPLY, sum, sum, Operand::Register(PER));
        sum
    }

    fn step(&mut self, step: &Step) {
        let Step { operator, scaled, out, operands: [a, b, c], more: _ } = *step;
        let (now_a, now_b) = (self.now(a), self.now(b));
        let value = match operator {
            Operator::Add => self.pair(ADD, now_a, now_b),
            Operator::Subtract => self.pair(SUBTRACT, now_a, now_b),
            Operator::Negate => self.pair(XOR, now_a, Operand::Register(SIGN)),
            Operator::Divide if scaled => self.pair(DIVIDE, now_a, self.begin(b)),
            Operator::Divide => {
                let value = self.sum([out, b], Span::Below, false);
                self.quotient(now_a, value, b)
            }
            Operator::Multiply | Operator::AddProduct | Operator::SubtractProduct => {
                let product = if scaled { self.pair(MULTIPLY, now_a, self.begin(b)) } else { self.product(a, b) };
                match operator {
                    Operator::AddProduct => self.apply(ADD, product, self.now(c)),
                    Operator::SubtractProduct => self.take_from(self.now(c), product),
                    _ => {}
                }
                product
            }
            _ => self.function(step),
        };
        self.put(out, value);
    }

    /// `(place − value)/b_0`
    fn quotient(&mut self, place: Operand, value: Register, b: u32) -> Register {
        self.take_from(place, value);
        self.apply(DIVIDE, value, self.begin(b));
        value
    }

    fn function(&mut self, step: &Step) -> Register {
        let Step { operator, out, operands: [a, b, _], more, .. } = *step;
        let now_a = self.now(a);
        match operator {
            Operator::Select => {
                let now_b = self.now(b);
                let [then, otherwise] = [now_a, now_b].map(|place| self.registers.loaded(self.assembler, place));
                let sign = self.registers.loaded(self.assembler, self.begin(more));
                let zero = self.registers.spread(self.assembler, ZERO);
                let value = self.registers.take();
                self.assembler.select(value, PRODUCT, sign, Operand::Register(zero), [then, otherwise]);
                value
            }
            Operator::SquareRoot => {
                let value = self.sum([out, out], Span::Inner, false);
                self.take_from(now_a, value);
                self.by_doubled(value, out);
                value
            }
            Operator::Exponential => self.sloped(a, out, Span::Upper),
            Operator::Logarithm => {
                let value = self.sloped(out, a, Span::Inner);
                self.quotient(now_a, value, a)
            }
            Operator::SineCosine => {
                let cosine = self.sloped(a, out, Span::Upper);
                let sine = self.sloped(a, more, Span::Upper);
                self.apply(XOR, cosine, Operand::Register(SIGN));
                self.put(more, cosine);
                sine
            }
            Operator::Tangent => {
                let tangent = self.sloped(a, more, Span::Upper);
                self.put(out, tangent);
                let square = self.product(out, out);
                self.put(more, square);
                tangent
            }
            Operator::ArcTangent => {
                let square = self.product(a, a);
                self.put(more, square);
                let value = self.sloped(out, more, Span::Inner);
                self.quotient(now_a, value, more)
            }
            Operator::ArcTangent2 => {
                let (square, other) = (self.product(a, a), self.product(b, b));
                self.apply(ADD, square, Operand::Register(other));
                self.put(more, square);
                let (turn, back) = (self.sloped(a, b, Span::Upper), self.sloped(b, a, Span::Upper));
                let value = self.sloped(out, more, Span::Inner);
                self.apply(SUBTRACT, turn, Operand::Register(back));
                self.apply(SUBTRACT, turn, Operand::Register(value));
                self.apply(DIVIDE, turn, self.begin(more));
                turn
            }
            _ => self.arc(step),
        }
    }

    /// An arc sine, or an arc cosine.
    fn arc(&mut self, step: &Step) -> Register {
        let Step { operator, out, operands: [a, ..], more, .. } = *step;
        let (square, other) = (self.product(a, a), self.sum([more, more], Span::Inner, false));
        self.apply(ADD, square, Operand::Register(other));
        self.apply(XOR, square, Operand::Register(SIGN));
        self.by_doubled(square, more);
        self.put(more, square);
        let value = self.sloped(out, more, Span::Inner);
        if operator == Operator::ArcSine {
            return self.quotient(self.now(a), value, more);
        }
        let slope = self.pair(XOR, self.now(a), Operand::Register(SIGN));
        self.apply(SUBTRACT, slope, Operand::Register(value));
        self.apply(DIVIDE, slope, self.begin(more));
        slope
    }

    /// `value /= 2·b_0`
    fn by_doubled(&mut self, value: Register, b: u32) {
        let doubled = self.pair(ADD, self.begin(b), self.begin(b));
        self.apply(DIVIDE, value, Operand::Register(doubled));
    }
}
