//! Code for coefficients of Taylor series: the same as [`Step::find`], in the same order of additions.

use kardan_rt::Operator;

use crate::assembler::{ADD, Assembler, DIVIDE, MULTIPLY, Opcode, Operand, Register, SUBTRACT, XOR};
use crate::registers::{MASK, Registers, SIGN, SIZE};
use crate::step::{Rules, Span, Step};
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
pub fn write(assembler: &mut Assembler, steps: &[Step], values: u32, width: Width, order: Option<usize>) {
    assembler.begin_series(SIGN, PER);
    let bytes = width.bytes();
    let mut writer = Writer { assembler, registers: Registers::new(width), bytes, order_bytes: bytes * values, order };
    for step in steps {
        if let Some(value) = step.rule(&mut writer) {
            writer.put(step.out, value);
        }
        writer.registers.release();
    }
    assembler.end();
}

/// The code while it is written.
struct Writer<'a> {
    assembler: &'a mut Assembler,
    registers: Registers,
    /// From one value to the next, and from one order to the next.
    bytes: u32,
    order_bytes: u32,
    order: Option<usize>,
}

impl Writer<'_> {
    /// The coefficient of order j, where k is sought.
    fn at(&self, place: u32, j: usize, k: usize) -> Operand {
        if j == k { self.now(place) } else { Operand::Constant(self.order_bytes * j as u32 + self.bytes * place) }
    }

    /// `opcode(first, last)`, in the register of an operand that is a result itself.
    fn result(&mut self, opcode: Opcode, first: Operand, last: Operand) -> Operand {
        let own = [first, last].into_iter().find_map(|operand| match operand {
            Operand::Register(own) if own != SIGN => Some(own),
            _ => None,
        });
        let first = self.registers.loaded(self.assembler, first);
        let last = self.registers.operand(last);
        let target = own.unwrap_or_else(|| self.registers.take());
        self.assembler.operation(opcode, target, first, last);
        Operand::Register(target)
    }

    /// `Σ a_j b_(k−j)`, or `Σ j a_j b_(k−j)` from j = 1 on.
    fn sum_of(&mut self, places: [u32; 2], span: Span, sloped: bool) -> Register {
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
    fn terms(&mut self, sum: Register, [a, b]: [u32; 2], k: usize, span: Span, sloped: bool) {
        let orders = span.orders(k);
        if orders.is_empty() {
            self.assembler.operation(XOR, sum, sum, Operand::Register(sum));
            return;
        }
        let (first, last) = (orders.start, orders.end - 1);
        for j in orders {
            let term = if j == first { sum } else { PRODUCT };
            self.term(term, [self.at(a, j, k), self.at(b, k - j, k)], if sloped { j as u32 } else { 1 });
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
        let weight = sloped.then(|| [self.registers.take(), self.registers.take()]);
        if let Some([weight, one]) = weight {
            self.assembler.spread(weight, Operand::Number(8));
            self.assembler.spread(one, Operand::Number(8));
        }
        let skipped = (self.order_bytes * span.orders(1).start as u32) as i32;
        let at = |place: u32| (self.bytes * place) as i32;
        let begin = [at(a) + skipped, at(b) - skipped];
        self.assembler.repeat(span, begin, self.order_bytes, |assembler| {
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
}

impl Rules for Writer<'_> {
    /// Memory, or a register that is reserved for this step: the next operation on it overwrites it.
    type Value = Operand;

    fn now(&self, place: u32) -> Operand {
        Operand::Memory(self.bytes * place)
    }

    fn begin(&self, place: u32) -> Operand {
        Operand::Constant(self.bytes * place)
    }

    fn put(&mut self, place: u32, value: Operand) {
        let (place, register) = (self.now(place), self.registers.loaded(self.assembler, value));
        self.registers.store_result(self.assembler, register, place);
    }

    fn apply(&mut self, operator: Operator, first: Operand, last: Operand) -> Operand {
        let opcode = match operator {
            Operator::Add => ADD,
            Operator::Subtract => SUBTRACT,
            Operator::Multiply => MULTIPLY,
            _ => DIVIDE,
        };
        self.result(opcode, first, last)
    }

    fn negated(&mut self, value: Operand) -> Operand {
        self.result(XOR, value, Operand::Register(SIGN))
    }

    fn select(&mut self, sign: Operand, then: Operand, otherwise: Operand) -> Operand {
        let [then, otherwise, sign] = [then, otherwise, sign].map(|place| self.registers.loaded(self.assembler, place));
        let zero = self.registers.spread(self.assembler, ZERO);
        let value = self.registers.take();
        self.assembler.select(value, PRODUCT, sign, Operand::Register(zero), [then, otherwise]);
        Operand::Register(value)
    }

    fn sum(&mut self, a: u32, b: u32, span: Span) -> Operand {
        Operand::Register(self.sum_of([a, b], span, false))
    }

    fn product(&mut self, a: u32, b: u32) -> Operand {
        if a != b {
            return self.sum(a, b, Span::All);
        }
        let sum = self.sum_of([a, a], Span::Half, false);
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
        Operand::Register(sum)
    }

    fn sloped(&mut self, a: u32, b: u32, span: Span) -> Operand {
        let sum = self.sum_of([a, b], span, true);
        self.result(MULTIPLY, Operand::Register(sum), Operand::Register(PER))
    }
}
