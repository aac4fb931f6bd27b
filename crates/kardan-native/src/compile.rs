//! From a plan to machine code: one instruction or two for each operation, results kept in registers while there are some free.

use kardan_rt::{Operator, Plan};

use crate::assembler::{
    ADD, AND, Assembler, DIVIDE, MAXIMUM, MINIMUM, MULTIPLY, Operand, ROOT, Register, SUBTRACT, XOR,
};
use crate::functions::function;

/// Registers that hold values; the others are a mask, and constants.
const VALUES: usize = 13;
const MASK: Register = 13;
const SIGN: Register = 14;
const SIZE: Register = 15;

/// Bits that the code reads: four times the sign alone, four times all but the sign.
pub const BITS: [u64; 8] = {
    let (sign, size) = (1 << 63, u64::MAX >> 1);
    [sign, sign, sign, sign, size, size, size, size]
};

/// The code while it is written. Each result is stored at once, so that a register can be given away at any time.
struct Writer {
    assembler: Assembler,
    /// Bytes of a place.
    width: u32,
    /// The place whose value a register holds, and when it was used last.
    held: [Option<(u32, u64)>; VALUES],
    now: u64,
}

/// The code of a plan, for one number or four side by side; none where it has tables, or is too long.
pub fn compile(plan: &Plan<'_, f64>, wide: bool) -> Option<Vec<u8>> {
    let width = if wide { 32 } else { 8 };
    i32::try_from(plan.memory().checked_mul(width as usize)?).ok()?;
    let mut writer = Writer { assembler: Assembler::new(wide), width, held: [None; VALUES], now: 0 };
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
            writer.operation(run.operator, own, next + k, next + count + k, wide)?;
        }
        next += count * run.operator.values() as u32;
    }
    writer.assembler.end();
    Some(writer.assembler.code)
}

impl Writer {
    fn constants(&mut self) {
        self.assembler.load_bits(SIGN, Operand::Constant(0));
        self.assembler.load_bits(SIZE, Operand::Constant(32));
    }

    /// The register that was not used for longest: none of those that the operation at hand has in use.
    fn free(&mut self) -> Register {
        let age = |held: &Option<(u32, u64)>| held.map_or(0, |(_, used)| used);
        let oldest = (0..VALUES).min_by_key(|&k| age(&self.held[k])).expect("there are registers");
        self.held[oldest] = None;
        oldest as Register
    }

    /// A value as last operand: from its register, or from memory.
    fn operand(&mut self, place: u32) -> Operand {
        match self.register_of(place) {
            Some(register) => Operand::Register(register),
            None => Operand::Memory(place * self.width),
        }
    }

    fn register_of(&mut self, place: u32) -> Option<Register> {
        self.now += 1;
        let k = self.held.iter().position(|held| held.is_some_and(|(other, _)| other == place))?;
        self.held[k] = Some((place, self.now));
        Some(k as Register)
    }

    /// A value in a register.
    fn loaded(&mut self, place: u32) -> Register {
        if let Some(register) = self.register_of(place) {
            return register;
        }
        let register = self.free();
        self.assembler.load(register, Operand::Memory(place * self.width));
        self.held[usize::from(register)] = Some((place, self.now));
        register
    }

    fn operation(&mut self, operator: Operator, x: &[u32], out: u32, second: u32, wide: bool) -> Option<()> {
        if let Some(function) = function(operator, wide) {
            let b = x.get(1).unwrap_or(&x[0]);
            // Functions of one value write it twice.
            let second = if operator.values() == 2 { second } else { out };
            let places = [x[0], *b, out, second].map(|place| place * self.width);
            self.assembler.call(function as usize as u64, places);
            self.held = [None; VALUES];
            self.constants();
            return Some(());
        }
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
                let registers = [x[0], x[2], x[3]].map(|place| self.loaded(place));
                let b = self.operand(x[1]);
                let target = self.free();
                self.assembler.select(target, MASK, registers[0], b, [registers[1], registers[2]]);
                self.keep(target, out);
                return Some(());
            }
            _ => return None,
        };
        if operator == Operator::SquareRoot {
            let last = self.operand(last);
            let target = self.free();
            self.assembler.operation(ROOT, target, 0, last);
            self.keep(target, out);
            return Some(());
        }
        let first = self.loaded(first);
        let last = match operator {
            Operator::Negate => Operand::Register(SIGN),
            Operator::Absolute => Operand::Register(SIZE),
            _ => self.operand(last),
        };
        let target = self.free();
        self.assembler.operation(opcode, target, first, last);
        // The product is rounded, then the sum.
        match operator {
            Operator::AddProduct => {
                let sum = self.operand(x[2]);
                self.assembler.operation(ADD, target, target, sum);
            }
            Operator::SubtractProduct => {
                let from = match self.register_of(x[2]) {
                    Some(register) => register,
                    None => {
                        self.assembler.load(MASK, Operand::Memory(x[2] * self.width));
                        MASK
                    }
                };
                self.assembler.operation(SUBTRACT, target, from, Operand::Register(target));
            }
            _ => {}
        }
        self.keep(target, out);
        Some(())
    }

    /// Stores a result, which stays in its register too.
    fn keep(&mut self, register: Register, place: u32) {
        self.assembler.store(register, place * self.width);
        self.now += 1;
        self.held[usize::from(register)] = Some((place, self.now));
    }
}
