//! Code for coefficients of Taylor series.

use kardan_rt::Operator;

use crate::assembler::{ADD, Assembler, DIVIDE, MULTIPLY, Operand, SUBTRACT, Terms, XOR};
use crate::registers::{MASK, Registers, SIGN};
use crate::step::Step;

/// Whether there is code for a step: sums, multiples, products and quotients.
pub fn has_code(step: &Step) -> bool {
    use Operator::{Add, AddProduct, Divide, Multiply, Negate, Subtract, SubtractProduct};
    matches!(step.operator, Add | Subtract | Negate | Multiply | Divide | AddProduct | SubtractProduct)
}

/// Writes steps that have code, one after the other; `width` is how many values an order has.
pub fn write(assembler: &mut Assembler, steps: &[Step], width: u32) {
    assembler.begin_series(SIGN);
    let mut registers = Registers::default();
    for step in steps {
        write_step(assembler, &mut registers, step, 8 * width);
    }
    assembler.end_series();
}

fn write_step(assembler: &mut Assembler, registers: &mut Registers, step: &Step, stride: u32) {
    let [a, b, c] = step.operands.map(|place| 8 * place);
    let out = Operand::Memory(8 * step.out);
    let target = match step.operator {
        Operator::Add | Operator::Subtract => {
            let opcode = if step.operator == Operator::Add { ADD } else { SUBTRACT };
            let first = registers.loaded(assembler, Operand::Memory(a));
            let last = registers.operand(Operand::Memory(b));
            let target = registers.free();
            assembler.operation(opcode, target, first, last);
            target
        }
        Operator::Negate => {
            let first = registers.loaded(assembler, Operand::Memory(a));
            let target = registers.free();
            assembler.operation(XOR, target, first, Operand::Register(SIGN));
            target
        }
        Operator::Divide if !step.scaled => {
            // (a_k − Σ q_j b_(k−j)) / b_0 over j below k
            let target = registers.free();
            assembler.convolution([target, MASK], [8 * step.out, b], stride, Terms::Below);
            take_from(assembler, registers, a, target);
            let last = registers.operand(Operand::Constant(b));
            assembler.operation(DIVIDE, target, target, last);
            target
        }
        _ => {
            let target = if step.scaled {
                let opcode = if step.operator == Operator::Divide { DIVIDE } else { MULTIPLY };
                let first = registers.loaded(assembler, Operand::Memory(a));
                let last = registers.operand(Operand::Constant(b));
                let target = registers.free();
                assembler.operation(opcode, target, first, last);
                target
            } else {
                let target = registers.free();
                match a == b {
                    true => assembler.square([target, MASK], a, stride),
                    false => assembler.convolution([target, MASK], [a, b], stride, Terms::All),
                }
                target
            };
            match step.operator {
                Operator::AddProduct => {
                    let sum = registers.operand(Operand::Memory(c));
                    assembler.operation(ADD, target, target, sum);
                }
                Operator::SubtractProduct => take_from(assembler, registers, c, target),
                _ => {}
            }
            target
        }
    };
    registers.keep(assembler, target, out);
}

/// `target = place − target`
fn take_from(assembler: &mut Assembler, registers: &mut Registers, place: u32, target: u8) {
    let from = registers.of(Operand::Memory(place)).unwrap_or_else(|| {
        assembler.load(MASK, Operand::Memory(place));
        MASK
    });
    assembler.operation(SUBTRACT, target, from, Operand::Register(target));
}
