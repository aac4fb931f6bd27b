//! Machine code for the Taylor coefficients of a list of steps, one order after the other.

use std::marker::PhantomData;

use crate::assembler::Assembler;
use crate::memory::Executable;
use crate::recurrences::{NUMBERS, ORDERS, sums, write};
use crate::step::Step;
use crate::width::{Value, is_able};

/// Most bytes of code for single orders: reading more takes longer than loops do.
const MOST: usize = 3 << 14;

/// How many orders are to have code of their own: all, or most of them if that is not too long.
fn own_orders(steps: &[Step], order: usize) -> usize {
    let sums: usize = steps.iter().map(sums).sum();
    // Approximate bytes of a term and of the rest of a step.
    let long = |k: &usize| 21 * sums * k + 14 * steps.len();
    let mut room = if sums == 0 { 0 } else { MOST };
    let fits = |k: &usize| {
        let length = long(k);
        let fits = length <= room;
        room = room.saturating_sub(length);
        fits
    };
    let own = (1..=order.min(ORDERS)).take_while(fits).count();
    if 2 * own < order { 0 } else { own }
}

/// Coefficients of Taylor series as machine code, of numbers `N`: of one series, or of one in each lane.
///
/// ```
/// use kardan_native::{NativeSeries, Step};
/// use kardan_rt::{Lanes, Operator};
/// // y = x², both at places 0 and 1 of each order.
/// let square = Step { operator: Operator::Multiply, scaled: false, out: 1, operands: [0, 0, 0], more: 0 };
/// if let Some(code) = NativeSeries::new(&[square], 2, 2) {
///     // x = 3 + 5 t
///     let mut memory = [3.0, 9.0, 5.0, 0.0, 0.0, 0.0];
///     code.advance(&mut memory, 1);
///     code.advance(&mut memory, 2);
///     assert_eq!([memory[1], memory[3], memory[5]], [9.0, 30.0, 25.0]);
/// }
/// if let Some(code) = NativeSeries::new(&[square], 2, 1) {
///     // 3 + 5 t, 1 − t, 2, t
///     let mut memory = [[3.0, 1.0, 2.0, 0.0], [9.0, 1.0, 4.0, 0.0], [5.0, -1.0, 0.0, 1.0], [0.0; 4]].map(Lanes);
///     code.advance(&mut memory, 1);
///     assert_eq!(memory[3], Lanes([30.0, -2.0, 0.0, 0.0]));
/// }
/// ```
#[derive(Debug)]
pub struct NativeSeries<N> {
    code: Executable,
    /// The start of the code of each order from 1, where there is such code; then the start of that for all others.
    starts: Vec<usize>,
    /// Values of an order.
    width: usize,
    values: PhantomData<fn(N)>,
}

impl<N: Value> NativeSeries<N> {
    /// Writes the code of steps with `width` values per order, fastest up to an order. None as
    /// [`Native::new`](crate::Native::new), where a step names a value that does not exist, and where one [has no
    /// rule](Step::has_rule).
    pub fn new(steps: &[Step], width: usize, order: usize) -> Option<Self> {
        // Offsets have 31 bits, also of the orders that have code of their own.
        let values =
            u32::try_from(width).ok().filter(|width| *width <= (i32::MAX as u32 >> 6) / (ORDERS as u32 + 1))?;
        let in_range = |step: &Step| step.operands.iter().chain([&step.out, &step.more]).all(|place| *place < values);
        if !is_able(N::WIDTH) || !steps.iter().all(|step| in_range(step) && step.has_rule()) {
            return None;
        }
        let (mut assembler, mut starts) = (Assembler::new(N::WIDTH), Vec::new());
        for k in 1..=own_orders(steps, order) {
            starts.push(assembler.code.len());
            write(&mut assembler, steps, values, N::WIDTH, Some(k));
        }
        starts.push(assembler.code.len());
        write(&mut assembler, steps, values, N::WIDTH, None);
        Some(Self { code: Executable::new(&assembler.code)?, starts, width, values: PhantomData })
    }

    /// Runs [`Step::find`] for each step in turn: computes the coefficients of order `k` of all values, from those of
    /// operands that no step computes. `memory` contains all coefficients, order after order. For order 0 it does
    /// nothing.
    ///
    /// # Panics
    /// If the memory has no order `k`.
    pub fn advance(&self, memory: &mut [N], k: usize) {
        let needed = k.checked_add(1).and_then(|orders| orders.checked_mul(self.width));
        assert!(needed.is_some_and(|needed| needed <= memory.len()), "no coefficients of order {k}");
        let Some(own) = k.checked_sub(1) else { return };
        let begin = self.starts[own.min(self.starts.len() - 1)];
        // SAFETY: `write` wrote functions of this type, the code of each begins where it was written. They read and
        // write `width` values of each order from 0 to k, which the memory contains, each of as many numbers as `N`
        // has, and read `NUMBERS`; `new` checked that the processor supports it.
        unsafe {
            let start = self.code.start().add(begin);
            let run: unsafe extern "C" fn(*mut N, *mut N, usize, *const f64, f64) = std::mem::transmute(start);
            let lowest = memory.as_mut_ptr();
            run(lowest.add(k * self.width), lowest, k, NUMBERS.as_ptr(), 1.0 / k as f64);
        }
    }
}
