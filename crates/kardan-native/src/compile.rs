//! From a plan to machine code: one or two instructions for each operation; results stay in registers while some are
//! free.

use kardan_rt::{Operator, Plan};

use crate::assembler::{ADD, AND, Assembler, DIVIDE, MAXIMUM, MINIMUM, MULTIPLY, Operand, ROOT, SUBTRACT, XOR};
use crate::functions::function;
use crate::registers::{MASK, Registers, SIGN, SIZE, SIZE_OFFSET};
use crate::width::Width;

/// The code while it is written.
struct Writer {
    assembler: Assembler,
    width: Width,
    registers: Registers,
}

/// The code of a plan, for one number or several side by side; none where it has tables, or is too long.
pub fn compile(plan: &Plan<'_, f64>, width: Width) -> Option<Vec<u8>> {
    i32::try_from(plan.memory().checked_mul(width.bytes() as usize)?).ok()?;
    let mut writer = Writer { assembler: Assembler::new(width), width, registers: Registers::new(width) };
    writer.assembler.begin();
    writer.constants();
    let mut next = u32::try_from(plan.inputs + plan.constants.len()).ok()?;
    let mut operands = plan.operands;
    for run in plan.runs {
        let count = u32::try_from(run.count).ok()?;
        for k in 0..count {
            let (own, rest) = operands.split_at_checked(run.operator.operands())?;
            operands = rest;
            if own.iter().any(|place| *place >= next) {
                return None;
            }
            writer.operation(run.operator, own, next + k, next + count + k)?;
        }
        next += count * run.operator.values() as u32;
    }
    writer.assembler.end();
    Some(writer.assembler.code)
}

impl Writer {
    fn constants(&mut self) {
        self.assembler.load_bits(SIGN, Operand::Constant(0));
        self.assembler.load_bits(SIZE, Operand::Constant(SIZE_OFFSET));
    }

    fn operation(&mut self, operator: Operator, x: &[u32], out: u32, second: u32) -> Option<()> {
        if let Some(function) = function(operator, self.width) {
            let b = x.get(1).unwrap_or(&x[0]);
            // Functions of one value write it two times.
            let second = if operator.values() == 2 { second } else { out };
            let places = [x[0], *b, out, second].map(|place| place * self.width.bytes());
            self.assembler.call(function as usize as u64, places);
            self.registers.forget();
            self.constants();
            return Some(());
        }
        let width = self.width.bytes();
        let at = |place: u32| Operand::Memory(place * width);
        let Self { assembler, registers, .. } = self;
        // Which value is to be in a register first, and which follows.
        let (opcode, first, last) = match operator {
            Operator::Add => (ADD, x[0], x[1]),
            Operator::Subtract => (SUBTRACT, x[0], x[1]),
            Operator::Multiply | Operator::AddProduct | Operator::SubtractProduct => (MULTIPLY, x[0], x[1]),
            Operator::Divide => (DIVIDE, x[0], x[1]),
            Operator::Minimum => (MINIMUM, x[0], x[1]),
            Operator::Maximum => (MAXIMUM, x[1], x[0]),
            Operator::Negate => (XOR, x[0], x[0]),
            Operator::Absolute => (AND, x[0], x[0]),
            Operator::SquareRoot => (ROOT, x[0], x[0]),
            Operator::Select => {
                let [a, then, otherwise] = [x[0], x[2], x[3]].map(|place| registers.loaded(assembler, at(place)));
                let b = registers.operand(at(x[1]));
                let target = registers.free();
                assembler.select(target, MASK, a, b, [then, otherwise]);
                registers.store_result(assembler, target, at(out));
                return Some(());
            }
            _ => return None,
        };
        // A root has no first operand.
        let first = if operator == Operator::SquareRoot { 0 } else { registers.loaded(assembler, at(first)) };
        let last = match operator {
            Operator::Negate => Operand::Register(SIGN),
            Operator::Absolute => Operand::Register(SIZE),
            _ => registers.operand(at(last)),
        };
        let target = registers.free();
        assembler.operation(opcode, target, first, last);
        // The product is rounded, then the sum.
        match operator {
            Operator::AddProduct => {
                let sum = registers.operand(at(x[2]));
                assembler.operation(ADD, target, target, sum);
            }
            Operator::SubtractProduct => {
                let from = registers.of(at(x[2])).unwrap_or_else(|| {
                    assembler.load(MASK, at(x[2]));
                    MASK
                });
                assembler.operation(SUBTRACT, target, from, Operand::Register(target));
            }
            _ => {}
        }
        registers.store_result(assembler, target, at(out));
        Some(())
    }
}
