//! Register allocation: which value each register contains while code is written.

use crate::assembler::{Assembler, Operand, Register};
use crate::width::Width;

/// Registers for values, below those for a mask and constants; for eight numbers there are as many more above them.
const LOWER: usize = 13;
const UPPER: usize = 16;
/// A register for a value that is used at once.
pub const MASK: Register = 13;
/// The sign alone.
pub const SIGN: Register = 14;
/// All but the sign.
pub const SIZE: Register = 15;

/// Bit masks of the code: eight times the sign bit, eight times all other bits.
pub const BITS: [[u64; 8]; 2] = [[1 << 63; 8], [u64::MAX >> 1; 8]];
/// Where the second of them begin, in bytes.
pub const SIZE_OFFSET: u32 = 64;

/// The memory index of the value in each register, and when it was used last. Each result is stored at once, so a
/// register can be reused at any time.
pub struct Registers {
    /// The number of such registers.
    count: usize,
    contents: [Option<(Operand, u64)>; LOWER + UPPER],
    /// The registers that are reserved for now.
    reserved: [bool; LOWER + UPPER],
    now: u64,
}

/// The number of the k-th register for values, and back.
fn number(k: usize) -> Register {
    (if k < LOWER { k } else { k + 3 }) as Register
}

fn index(register: Register) -> usize {
    let register = usize::from(register);
    if register < LOWER { register } else { register - 3 }
}

impl Registers {
    pub fn new(width: Width) -> Self {
        let count = if width == Width::Eight { LOWER + UPPER } else { LOWER };
        Self { count, contents: [None; LOWER + UPPER], reserved: [false; LOWER + UPPER], now: 0 }
    }

    /// The least recently used register that the current operation does not use.
    pub fn free(&mut self) -> Register {
        let age = |contents: &Option<(Operand, u64)>| contents.map_or(0, |(_, used)| used);
        let available = (0..self.count).filter(|&k| !self.reserved[k]);
        let oldest = available.min_by_key(|&k| age(&self.contents[k])).expect("there are registers");
        self.contents[oldest] = None;
        number(oldest)
    }

    /// Whether there are more than a few.
    pub fn are_many(&self) -> bool {
        self.count > LOWER
    }

    /// A register that is reserved until [`release`](Self::release); a few at a time.
    pub fn take(&mut self) -> Register {
        let register = self.free();
        self.reserved[index(register)] = true;
        register
    }

    /// All registers may be reused again.
    pub fn release(&mut self) {
        self.reserved = [false; LOWER + UPPER];
    }

    /// A value as last operand: from its register, or from memory.
    pub fn operand(&mut self, place: Operand) -> Operand {
        self.of(place).map_or(place, Operand::Register)
    }

    /// The register that contains a value.
    pub fn of(&mut self, place: Operand) -> Option<Register> {
        if let Operand::Register(register) = place {
            return Some(register);
        }
        self.now += 1;
        let k = self.contents[..self.count]
            .iter()
            .position(|contents| contents.is_some_and(|(candidate, _)| candidate == place))?;
        self.contents[k] = Some((place, self.now));
        Some(number(k))
    }

    /// A value in a register.
    pub fn loaded(&mut self, assembler: &mut Assembler, place: Operand) -> Register {
        self.found(place, |register| assembler.load(register, place))
    }

    /// A number in all of a register.
    pub fn spread(&mut self, assembler: &mut Assembler, place: Operand) -> Register {
        self.found(place, |register| assembler.spread(register, place))
    }

    fn found(&mut self, place: Operand, load: impl FnOnce(Register)) -> Register {
        if let Some(register) = self.of(place) {
            return register;
        }
        let register = self.free();
        load(register);
        self.contents[index(register)] = Some((place, self.now));
        register
    }

    /// Stores a result, which stays in its register too, and in no other.
    pub fn store_result(&mut self, assembler: &mut Assembler, register: Register, place: Operand) {
        assembler.store(register, place);
        self.now += 1;
        for contents in self.contents[..self.count]
            .iter_mut()
            .filter(|contents| contents.is_some_and(|(candidate, _)| candidate == place))
        {
            *contents = None;
        }
        self.contents[index(register)] = Some((place, self.now));
    }

    /// All registers are free from here on.
    pub fn forget(&mut self) {
        self.contents = [None; LOWER + UPPER];
    }
}
