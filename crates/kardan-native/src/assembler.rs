//! Instructions of x86-64 with AVX and AVX-512F, as far as plans need them.

use crate::width::Width;

/// A vector register.
pub type Register = u8;

/// A register or a place in memory, as the last operand of an instruction.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Operand {
    /// A register.
    Register(Register),
    /// Bytes from where the memory of the plan begins (rbx).
    Memory(u32),
    /// Bytes from where the constants of the code, or the first coefficients of series, begin (rbp).
    Constant(u32),
}

/// What an instruction does with one number, or all of a register.
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
/// All digits where a comparison holds, none elsewhere; of eight numbers one digit each, in a register of masks.
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
/// The register of masks in use: k1.
const DIGITS: Register = 1;

/// The registers rdi and rsi, which walk through coefficients.
const FIRST: u8 = 7;
const SECOND: u8 = 6;

/// How many terms a convolution of order k has.
#[derive(Clone, Copy)]
pub enum Terms {
    /// k + 1.
    All,
    /// k: the highest of the first one is left out.
    Below,
    /// Half of k + 1, rounded down.
    Half,
}

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
    pub fn operation(&mut self, opcode: Opcode, target: Register, first: Register, last: Operand) {
        let high = |register: Register| u8::from(register < 8);
        let (base_high, mode, low) = match last {
            Operand::Register(register) => (high(register), 0xc0, register & 7),
            Operand::Memory(_) => (1, 0x80, 3),
            Operand::Constant(_) => (1, 0x80, 5),
        };
        let highs = (high(target) << 7) | (1 << 6) | (base_high << 5);
        let first = (!first & 15) << 3;
        let operands = mode | ((target & 7) << 3) | low;
        if self.width == Width::Eight {
            // Three bytes of EVEX: high digits of the registers (inverted, those beyond 15 are not in use) and the map;
            // the first operand (inverted), packed doubles; the length and the mask. Offsets of four bytes count bytes,
            // those of one would not.
            let mask = if opcode == BLEND_EIGHT { DIGITS } else { 0 };
            self.bytes(&[0x62, highs | 0x10 | opcode.map, 0x85 | first, 0x48 | mask, opcode.byte_eight, operands]);
        } else {
            // Two bytes of VEX: high digits of the registers (inverted) and the map; the first operand (inverted), the
            // length and the kind of numbers: 66 for packed doubles, F2 for one.
            let (length, kind) = match self.width {
                Width::One => (0, if opcode.bits { 1 } else { 3 }),
                _ => (4, 1),
            };
            self.bytes(&[0xc4, highs | opcode.map, first | length | kind, opcode.byte, operands]);
        }
        if let Operand::Memory(offset) | Operand::Constant(offset) = last {
            self.bytes(&offset.to_le_bytes());
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

    /// Keeps the arguments in registers that calls leave alone: the memory in rbx, constants in rbp.
    pub fn begin(&mut self) {
        self.bytes(&[0x53, 0x55]); // push rbx, push rbp
        self.bytes(&[0x48, 0x83, 0xec, 0x08]); // sub rsp, 8: calls want multiples of 16
        self.bytes(&[0x48, 0x89, 0xfb, 0x48, 0x89, 0xf5]); // mov rbx, rdi; mov rbp, rsi
    }

    pub fn end(&mut self) {
        self.bytes(&[0xc5, 0xf8, 0x77]); // vzeroupper
        self.bytes(&[0x48, 0x83, 0xc4, 0x08, 0x5d, 0x5b, 0xc3]); // add rsp, 8; pop rbp; pop rbx; ret
    }

    /// The begin of code for series: coefficients of the order sought in rbx, the first ones in rbp, how many orders are below it in rdx, bits
    /// in rcx.
    pub fn begin_series(&mut self, sign: Register) {
        self.bytes(&[0x53, 0x55]); // push rbx, push rbp
        self.bytes(&[0x48, 0x89, 0xfb, 0x48, 0x89, 0xf5]); // mov rbx, rdi; mov rbp, rsi
        self.bytes(&[0xc5, 0x7d, 0x10, 0x01 | (sign & 7) << 3]); // vmovupd sign, [rcx]
    }

    pub fn end_series(&mut self) {
        self.bytes(&[0xc5, 0xf8, 0x77]); // vzeroupper
        self.bytes(&[0x5d, 0x5b, 0xc3]); // pop rbp; pop rbx; ret
    }

    /// `sum = Σ a_j b_(k−j)`: a from its first coefficient upwards, b from that of the order sought downwards, over so many j; `stride` bytes
    /// are between two orders. `product` is overwritten.
    pub fn convolution(&mut self, [sum, product]: [Register; 2], [a, b]: [u32; 2], stride: u32, terms: Terms) {
        self.bytes(&[0x48, 0x8d, 0xbd]); // lea rdi, [rbp + a]
        self.bytes(&a.to_le_bytes());
        self.bytes(&[0x48, 0x8d, 0xb3]); // lea rsi, [rbx + b]
        self.bytes(&b.to_le_bytes());
        self.bytes(match terms {
            Terms::All => &[0x8d, 0x4a, 0x01],              // lea ecx, [rdx + 1]
            Terms::Below => &[0x89, 0xd1],                  // mov ecx, edx
            Terms::Half => &[0x8d, 0x4a, 0x01, 0xd1, 0xe9], // lea ecx, [rdx + 1]; shr ecx, 1
        });
        self.operation(XOR, sum, sum, Operand::Register(sum));
        let again = self.code.len();
        self.multiply(product, SECOND);
        self.operation(ADD, sum, sum, Operand::Register(product));
        self.bytes(&[0x48, 0x81, 0xc7]); // add rdi, stride
        self.bytes(&stride.to_le_bytes());
        self.bytes(&[0x48, 0x81, 0xee]); // sub rsi, stride
        self.bytes(&stride.to_le_bytes());
        self.bytes(&[0xff, 0xc9]); // dec ecx
        let back = again as i64 - (self.code.len() as i64 + 2);
        self.bytes(&[0x75, back as i8 as u8]); // jnz again
    }

    /// `sum = Σ a_j a_(k−j)` over all j: twice the sum over the lower half, and the square in the middle where there is one.
    pub fn square(&mut self, [sum, product]: [Register; 2], a: u32, stride: u32) {
        self.convolution([sum, product], [a, a], stride, Terms::Half);
        self.operation(ADD, sum, sum, Operand::Register(sum));
        self.bytes(&[0xf6, 0xc2, 0x01]); // test dl, 1
        let jump = self.code.len();
        self.bytes(&[0x75, 0]); // jnz behind
        self.multiply(product, FIRST);
        self.operation(ADD, sum, sum, Operand::Register(product));
        self.code[jump + 1] = (self.code.len() - jump - 2) as u8;
    }

    /// `product = [rdi]·[rsi]`, or the square of [rdi].
    fn multiply(&mut self, product: Register, by: u8) {
        let high = u8::from(product < 8) << 7;
        self.bytes(&[0xc5, high | 0x7b, 0x10, (product & 7) << 3 | FIRST]); // vmovsd product, [rdi]
        self.bytes(&[0xc5, high | ((!product & 15) << 3) | 3, 0x59, (product & 7) << 3 | by]); // vmulsd product, product, [by]
    }

    /// Calls a function with addresses of places: two that it reads, two that it writes.
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
