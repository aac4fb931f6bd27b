//! Which values the registers hold while code is written.

use crate::assembler::{Assembler, Operand, Register};

/// Registers that hold values; the others are a mask, and constants.
const VALUES: usize = 13;
/// A register for what is needed at once.
pub const MASK: Register = 13;
/// The sign alone.
pub const SIGN: Register = 14;
/// All but the sign.
pub const SIZE: Register = 15;

/// Bits that the code reads: eight times the sign alone, eight times all but the sign.
pub const BITS: [[u64; 8]; 2] = [[1 << 63; 8], [u64::MAX >> 1; 8]];
/// Where the second of them begin, in bytes.
pub const SIZE_OFFSET: u32 = 64;

/// The value of a place in memory that each register holds, and when it was used last. Each result is stored at once, so that a register
/// can be given away at any time.
#[derive(Default)]
pub struct Registers {
    held: [Option<(Operand, u64)>; VALUES],
    now: u64,
}

impl Registers {
    /// The register that was not used for longest: none of those that the operation at hand has in use.
    pub fn free(&mut self) -> Register {
        let age = |held: &Option<(Operand, u64)>| held.map_or(0, |(_, used)| used);
        let oldest = (0..VALUES).min_by_key(|&k| age(&self.held[k])).expect("there are registers");
        self.held[oldest] = None;
        oldest as Register
    }

    /// A value as last operand: from its register, or from memory.
    pub fn operand(&mut self, place: Operand) -> Operand {
        self.of(place).map_or(place, Operand::Register)
    }

    /// The register that holds a value.
    pub fn of(&mut self, place: Operand) -> Option<Register> {
        self.now += 1;
        let k = self.held.iter().position(|held| held.is_some_and(|(other, _)| other == place))?;
        self.held[k] = Some((place, self.now));
        Some(k as Register)
    }

    /// A value in a register.
    pub fn loaded(&mut self, assembler: &mut Assembler, place: Operand) -> Register {
        if let Some(register) = self.of(place) {
            return register;
        }
        let register = self.free();
        assembler.load(register, place);
        self.held[usize::from(register)] = Some((place, self.now));
        register
    }

    /// Stores a result, which stays in its register too.
    pub fn keep(&mut self, assembler: &mut Assembler, register: Register, place: Operand) {
        assembler.store(register, place);
        self.now += 1;
        self.held[usize::from(register)] = Some((place, self.now));
    }

    /// Nothing is held any more.
    pub fn forget(&mut self) {
        self.held = [None; VALUES];
    }
}
