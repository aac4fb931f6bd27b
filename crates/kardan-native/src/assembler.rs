//! Instructions of x86-64 with AVX and AVX-512F, as far as plans need them.

use crate::step::Span;
use crate::width::Width;

/// A vector register.
pub type Register = u8;

/// A register or an address in memory, as the last operand of an instruction.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Operand {
    /// A register.
    Register(Register),
    /// Bytes from where the memory of the plan begins (rbx).
    Memory(u32),
    /// Bytes from where the constants of the code, or the first coefficients of series, begin (rbp).
    Constant(u32),
    /// Bytes from where whole numbers for series begin (rcx).
    Number(u32),
    /// The coefficient that a loop is at: of the first operand (rdi), and of the second one (rsi).
    First,
    /// See [`Operand::First`].
    Second,
}

/// The operation of an instruction on one number, or on all numbers of a register.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Opcode {
    /// The map of opcodes: 1 for 0F, 2 for 0F 38, 3 for 0F 3A.
    map: u8,
    byte: u8,
    /// The byte for eight numbers: AVX-512F has other instructions bit by bit.
    byte_eight: u8,
    /// Whether it works bit by bit, on whole registers only.
    bits: bool,
}

const fn number(byte: u8) -> Opcode {
    Opcode { map: 1, byte, byte_eight: byte, bits: false }
}

const fn bits(byte: u8, byte_eight: u8) -> Opcode {
    Opcode { map: 1, byte, byte_eight, bits: true }
}

/// The root of the last operand.
pub const ROOT: Opcode = number(0x51);
/// Both, bit by bit.
pub const AND: Opcode = bits(0x54, 0xdb);
/// One of both, bit by bit.
pub const XOR: Opcode = bits(0x57, 0xef);
/// The sum.
pub const ADD: Opcode = number(0x58);
/// The product.
pub const MULTIPLY: Opcode = number(0x59);
/// First less second.
pub const SUBTRACT: Opcode = number(0x5c);
/// The first if it is smaller, else the second.
pub const MINIMUM: Opcode = number(0x5d);
/// First by second.
pub const DIVIDE: Opcode = number(0x5e);
/// The first if it is larger, else the second.
pub const MAXIMUM: Opcode = number(0x5f);
/// All bits set where a comparison is true, none elsewhere; for eight numbers one bit each, in a mask register.
const COMPARE: Opcode = number(0xc2);
const LOAD: Opcode = number(0x10);
const STORE: Opcode = number(0x11);
/// All of a register, from another, and from memory.
const MOVE: Opcode = bits(0x28, 0x28);
const LOAD_BITS: Opcode = bits(0x10, 0x10);
/// The last operand where the highest digit of a mask is set, else the first.
const BLEND: Opcode = Opcode { map: 3, byte: 0x4b, byte_eight: 0x4b, bits: true };
/// Of eight numbers: the last operand where the digit of [`DIGITS`] is set, else the first.
const BLEND_EIGHT: Opcode = Opcode { map: 2, byte: 0x65, byte_eight: 0x65, bits: true };
/// One number in all of a register.
const SPREAD: Opcode = Opcode { map: 2, byte: 0x19, byte_eight: 0x19, bits: true };
/// The register of masks in use: k1.
const DIGITS: Register = 1;

/// Machine code while it is written, for one number or for several side by side.
pub struct Assembler {
    pub code: Vec<u8>,
    width: Width,
}

impl Assembler {
    pub fn new(width: Width) -> Self {
        Self { code: Vec::new(), width }
    }

    pub fn bytes(&mut self, bytes: &[u8]) {
        self.code.extend_from_slice(bytes);
    }

    /// `target = opcode(first, last)`.
    pub fn operation(&mut self, opcode: Opcode, target: Register, first_register: Register, last: Operand) {
        let high = |register: Register| u8::from(register & 8 == 0);
        let (base_high, low, offset) = match last {
            Operand::Register(register) => (high(register), register & 7, None),
            Operand::Memory(offset) => (1, 3, Some(offset)),
            Operand::Constant(offset) => (1, 5, Some(offset)),
            Operand::Number(offset) => (1, 1, Some(offset)),
            Operand::First => (1, 7, None),
            Operand::Second => (1, 6, None),
        };
        // Offsets of one byte count as many bytes as the operand has where registers have eight numbers.
        let unit = match self.width {
            Width::Eight if opcode == SPREAD => 8,
            Width::Eight => 64,
            _ => 1,
        };
        let short = offset.filter(|offset| offset % unit == 0).and_then(|offset| i8::try_from(offset / unit).ok());
        let mode = match last {
            Operand::Register(_) => 0xc0,
            Operand::First | Operand::Second => 0,
            _ => {
                if short.is_some() {
                    0x40
                } else {
                    0x80
                }
            }
        };
        let first = (!first_register & 15) << 3;
        let operands = mode | ((target & 7) << 3) | low;
        let (head, length) = if self.width == Width::Eight {
            // Three bytes of EVEX: high digits of the registers (inverted) and the map; the first operand (inverted), packed doubles; the
            // length, its highest digit and the mask.
            let highest = |register: Register| u8::from(register < 16);
            let last_highest = if let Operand::Register(register) = last { highest(register) } else { 1 };
            let highs = (high(target) << 7) | (last_highest << 6) | (base_high << 5) | (highest(target) << 4);
            let mask = if opcode == BLEND_EIGHT { DIGITS } else { 0 };
            let lengths = 0x40 | (highest(first_register) << 3) | mask;
            ([0x62, highs | opcode.map, 0x85 | first, lengths, opcode.byte_eight, operands], 6)
        } else {
            // VEX: the first operand (inverted), the length and the kind of numbers: 66 for packed doubles, F2 for one.
            let (length, kind) = match self.width {
                Width::One => (0, if opcode.bits { 1 } else { 3 }),
                _ => (4, 1),
            };
            let rest = first | length | kind;
            // Before it high digits of the registers (inverted) and the map, in a byte of its own where they are not the usual ones.
            if opcode.map == 1 && base_high == 1 {
                ([0xc5, (high(target) << 7) | rest, opcode.byte, operands, 0, 0], 4)
            } else {
                let highs = (high(target) << 7) | (1 << 6) | (base_high << 5);
                ([0xc4, highs | opcode.map, rest, opcode.byte, operands, 0], 5)
            }
        };
        self.bytes(&head[..length]);
        match (short, offset) {
            (Some(short), _) => self.bytes(&short.to_le_bytes()),
            (None, Some(offset)) => self.bytes(&offset.to_le_bytes()),
            _ => {}
        }
    }

    /// Loads a register. Numbers in memory alone are loaded, constants as wide as bits are.
    pub fn load(&mut self, target: Register, from: Operand) {
        match from {
            Operand::Register(_) => self.operation(MOVE, target, 0, from),
            _ => self.operation(LOAD, target, 0, from),
        }
    }

    /// Loads a register with as many bits of constants as it has.
    pub fn load_bits(&mut self, target: Register, from: Operand) {
        self.operation(LOAD_BITS, target, 0, from);
    }

    /// Loads all of a register with one number, from memory or from another register.
    pub fn spread(&mut self, target: Register, from: Operand) {
        match self.width {
            Width::One => self.load(target, from),
            _ => self.operation(SPREAD, target, 0, from),
        }
    }

    pub fn store(&mut self, register: Register, to: Operand) {
        self.operation(STORE, register, 0, to);
    }

    /// `target = then where a < b, else otherwise`; `mask` is overwritten.
    pub fn select(
        &mut self,
        target: Register,
        mask: Register,
        a: Register,
        b: Operand,
        [then, otherwise]: [Register; 2],
    ) {
        let eight = self.width == Width::Eight;
        self.operation(COMPARE, if eight { DIGITS } else { mask }, a, b);
        self.bytes(&[1]); // less, false for NaN
        let then = Operand::Register(then);
        if eight {
            self.operation(BLEND_EIGHT, target, otherwise, then);
        } else {
            self.operation(BLEND, target, otherwise, then);
            self.bytes(&[mask << 4]);
        }
    }

    /// Stores the arguments in registers that calls preserve: the memory in rbx, constants in rbp.
    pub fn begin(&mut self) {
        self.bytes(&[0x53, 0x55]); // push rbx, push rbp
        self.bytes(&[0x48, 0x83, 0xec, 0x08]); // sub rsp, 8: calls want multiples of 16
        self.bytes(&[0x48, 0x89, 0xfb, 0x48, 0x89, 0xf5]); // mov rbx, rdi; mov rbp, rsi
    }

    pub fn end(&mut self) {
        self.bytes(&[0xc5, 0xf8, 0x77]); // vzeroupper
        self.bytes(&[0x48, 0x83, 0xc4, 0x08, 0x5d, 0x5b, 0xc3]); // add rsp, 8; pop rbp; pop rbx; ret
    }

    /// The prologue of code for series: coefficients of the current order in rbx, the first ones in rbp, the number of
    /// lower orders in rdx, whole numbers in rcx, which begin with the sign; the order's number in the lowest register,
    /// which is broadcast to all of another one.
    pub fn begin_series(&mut self, sign: Register, number: Register) {
        self.begin();
        self.spread(sign, Operand::Number(0));
        self.spread(number, Operand::Register(0));
    }

    /// Emits code for each term of a sum `Σ a_j b_(k−j)`, a from `first` bytes above the first coefficients, b from
    /// `second` bytes above those of the current order; `order_bytes` bytes are between two orders.
    pub fn repeat(&mut self, span: Span, [first, second]: [i32; 2], order_bytes: u32, term: impl FnOnce(&mut Self)) {
        self.bytes(&[0x48, 0x8d, 0xbd]); // lea rdi, [rbp + first]
        self.bytes(&first.to_le_bytes());
        self.bytes(&[0x48, 0x8d, 0xb3]); // lea rsi, [rbx + second]
        self.bytes(&second.to_le_bytes());
        // The number of terms.
        self.bytes(match span {
            Span::All => &[0x48, 0x8d, 0x42, 0x01],                    // lea rax, [rdx + 1]
            Span::Below | Span::Upper => &[0x48, 0x89, 0xd0],          // mov rax, rdx
            Span::Half => &[0x48, 0x8d, 0x42, 0x01, 0x48, 0xd1, 0xe8], // lea rax, [rdx + 1]; shr rax, 1
            Span::Inner => &[0x48, 0x89, 0xd0, 0x48, 0xff, 0xc8],      // mov rax, rdx; dec rax
        });
        let none = self.code.len();
        if matches!(span, Span::Inner) {
            self.bytes(&[0x74, 0]); // jz behind
        }
        let again = self.code.len();
        term(self);
        self.bytes(&[0x48, 0x81, 0xc7]); // add rdi, order_bytes
        self.bytes(&order_bytes.to_le_bytes());
        self.bytes(&[0x48, 0x81, 0xee]); // sub rsi, order_bytes
        self.bytes(&order_bytes.to_le_bytes());
        self.bytes(&[0x48, 0xff, 0xc8]); // dec rax
        let back = again as i64 - (self.code.len() as i64 + 2);
        self.bytes(&[0x75, back as i8 as u8]); // jnz again
        if matches!(span, Span::Inner) {
            self.code[none + 1] = (self.code.len() - none - 2) as u8;
        }
    }

    /// Does something where the order is even.
    pub fn where_even(&mut self, code: impl FnOnce(&mut Self)) {
        self.bytes(&[0xf6, 0xc2, 0x01]); // test dl, 1
        let jump = self.code.len();
        self.bytes(&[0x75, 0]); // jnz behind
        code(self);
        self.code[jump + 1] = (self.code.len() - jump - 2) as u8;
    }

    /// Calls a function with addresses: two that it reads, two that it writes.
    pub fn call(&mut self, function: u64, places: [u32; 4]) {
        self.bytes(&[0xc5, 0xf8, 0x77]);
        // lea rdi, rsi, rdx, rcx of rbx + offset
        for (modrm, offset) in [0xbb, 0xb3, 0x93, 0x8b].into_iter().zip(places) {
            self.bytes(&[0x48, 0x8d, modrm]);
            self.bytes(&offset.to_le_bytes());
        }
        self.bytes(&[0x48, 0xb8]); // mov rax, function
        self.bytes(&function.to_le_bytes());
        self.bytes(&[0xff, 0xd0]); // call rax
    }
}
