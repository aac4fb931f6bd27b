//! Plans as machine code.
//!
//! [`kardan_rt::Plan`] interprets a list of operations, on every target and in safe code. On x86-64 processors with
//! AVX2 this crate writes the same operations as straight-line instructions, for one number or for four side by side,
//! with AVX-512F also for eight ([`lanes`] tells which). The bits are the same in each lane: each product and each sum
//! is rounded by itself, functions are those of [`kardan_rt::functions`].
//!
//! One evaluation takes half of the time of the interpreter's, four at once a quarter each. Of eight each takes two
//! thirds of that where functions take most of the time. Sums and products gain nothing on processors that store 64
//! bytes in two parts (Zen 4), and lose where places are not at multiples of 64 bytes, which is allowed.
//!
//! ```
//! use kardan_native::Native;
//! use kardan_rt::{Operator, Plan, Run};
//! // y = 3 x + 1
//! let plan = Plan {
//!     inputs: 1,
//!     constants: &[3.0, 1.0],
//!     runs: &[Run { operator: Operator::AddProduct, count: 1 }],
//!     operands: &[1, 0, 2],
//!     outputs: &[3],
//!     tables: &[],
//!     numbers: &[],
//! };
//! let mut memory = [0.0; 4];
//! plan.begin(&mut memory);
//! memory[0] = 2.0;
//! // None where the machine cannot, or must not: then `plan.evaluate` does the same.
//! let done = match Native::new(&plan) {
//!     Some(native) => native.evaluate(&mut memory),
//!     None => plan.evaluate(&mut memory),
//! };
//! assert!(done && plan.output(0, &memory) == Some(7.0));
//! ```

#[cfg(all(target_arch = "x86_64", unix))]
mod assembler;
#[cfg(all(target_arch = "x86_64", unix))]
mod compile;
#[cfg(all(target_arch = "x86_64", unix))]
mod functions;
#[cfg(all(target_arch = "x86_64", unix))]
mod memory;
#[cfg(all(target_arch = "x86_64", unix))]
mod registers;
#[cfg(all(target_arch = "x86_64", unix))]
mod series;
mod step;
mod width;

use std::fmt::{self, Debug, Formatter};
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use kardan_rt::{Lanes, Number, Plan};

pub use step::Step;
use width::Width;

/// Whether no code is to be written.
static OFF: AtomicBool = AtomicBool::new(false);

/// From here on there is no new machine code: [`Native::new`] gives none. Results do not change.
pub fn switch_off() {
    OFF.store(true, Ordering::Relaxed);
}

#[cfg(all(target_arch = "x86_64", unix))]
fn is_able(width: Width) -> bool {
    let wide = width != Width::Eight || std::arch::is_x86_feature_detected!("avx512f");
    !OFF.load(Ordering::Relaxed) && std::arch::is_x86_feature_detected!("avx2") && wide
}

#[cfg(not(all(target_arch = "x86_64", unix)))]
fn is_able(_: Width) -> bool {
    false
}

/// The most numbers side by side for which machine code is written here: 8 with AVX-512F, 4 with AVX2. 1 where there is
/// none, on other processors and systems and after [`switch_off`]: then the interpreter does one after the other.
///
/// ```
/// use kardan_native::lanes;
/// // How many evaluations 100 points take.
/// let passes = 100_usize.div_ceil(lanes());
/// assert_eq!(passes, match lanes() { 8 => 13, 4 => 25, _ => 100 });
/// ```
#[must_use]
pub fn lanes() -> usize {
    [Width::Eight, Width::Four].into_iter().find(|width| is_able(*width)).unwrap_or(Width::One) as usize
}

/// What machine code computes with: `f64`, or four or eight of them. They need no other alignment than `f64`.
pub trait Value: Number<One = f64> + width::Wide {}

impl Value for f64 {}
impl Value for Lanes<f64, 4> {}
impl Value for Lanes<f64, 8> {}

/// A plan as machine code, for memory of entries `N`: one evaluation, or one in each lane.
pub struct Native<N> {
    #[cfg(all(target_arch = "x86_64", unix))]
    code: memory::Executable,
    /// Entries of memory.
    places: usize,
    inputs: usize,
    outputs: Vec<u32>,
    values: PhantomData<fn(N)>,
}

impl<N> Debug for Native<N> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.debug_struct("Native").field("places", &self.places).finish_non_exhaustive()
    }
}

impl<N: Value> Native<N> {
    /// Writes the code of a plan. None on processors without AVX2 (for eight lanes AVX-512F), on other systems, where
    /// memory for code is refused, after [`switch_off`], and for plans with tables.
    #[cfg(all(target_arch = "x86_64", unix))]
    pub fn new(plan: &Plan<'_, f64>) -> Option<Self> {
        if !is_able(N::WIDTH) {
            return None;
        }
        let code = memory::Executable::new(&compile::compile(plan, N::WIDTH)?)?;
        let (places, inputs) = (plan.memory(), plan.inputs);
        Some(Self { code, places, inputs, outputs: plan.outputs.to_vec(), values: PhantomData })
    }

    /// None: there is no code for this processor or system.
    #[cfg(not(all(target_arch = "x86_64", unix)))]
    pub fn new(_: &Plan<'_, f64>) -> Option<Self> {
        None
    }

    /// Does what [`Plan::evaluate`] does, in memory that [`Plan::begin`] has prepared. False where an input or output
    /// of any lane is no number, or the memory is too short.
    #[must_use = "false tells that an output is no number"]
    pub fn evaluate(&self, memory: &mut [N]) -> bool {
        if memory.len() < self.places {
            return false;
        }
        self.run(memory);
        let finite = |x: &N| !x.any(|x| !x.is_finite());
        memory.iter().take(self.inputs).all(finite)
            && self.outputs.iter().all(|output| memory.get(*output as usize).is_some_and(finite))
    }

    #[cfg(all(target_arch = "x86_64", unix))]
    fn run(&self, memory: &mut [N]) {
        // SAFETY: `compile` wrote a function of this type; it reads and writes the places of the plan, each as many
        // numbers as `N` has, and the memory has them all; `new` asked whether the processor can.
        unsafe {
            let run: unsafe extern "C" fn(*mut N, *const u64) = std::mem::transmute(self.code.start());
            run(memory.as_mut_ptr(), registers::BITS.as_ptr().cast());
        }
    }

    #[cfg(not(all(target_arch = "x86_64", unix)))]
    fn run(&self, _: &mut [N]) {}
}

/// Coefficients of Taylor series as machine code: for sums, multiples, products and quotients. Other steps are left to the caller.
///
/// ```
/// use kardan_native::{NativeSeries, Step};
/// use kardan_rt::Operator;
/// // y = x², both at places 0 and 1 of each order.
/// let square = Step { operator: Operator::Multiply, scaled: false, out: 1, operands: [0, 0, 0], more: 0 };
/// if let Some(code) = NativeSeries::new(&[square], 2) {
///     // x = 3 + 5 t
///     let mut memory = [3.0, 9.0, 5.0, 0.0, 0.0, 0.0];
///     code.advance(&mut memory, 1, |_, _| {});
///     code.advance(&mut memory, 2, |_, _| {});
///     assert_eq!([memory[1], memory[3], memory[5]], [9.0, 30.0, 25.0]);
/// }
/// ```
pub struct NativeSeries {
    #[cfg(all(target_arch = "x86_64", unix))]
    code: memory::Executable,
    /// In turn: where code begins, and which steps follow it that have none.
    parts: Vec<(usize, Range<usize>)>,
    /// Values of an order.
    width: usize,
}

impl Debug for NativeSeries {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.debug_struct("NativeSeries").field("parts", &self.parts).field("width", &self.width).finish_non_exhaustive()
    }
}

impl NativeSeries {
    /// Writes the code of steps over so many values. None as [`Native::new`], and where a step names a value that there is not.
    #[cfg(all(target_arch = "x86_64", unix))]
    pub fn new(steps: &[Step], width: usize) -> Option<Self> {
        let values = u32::try_from(width).ok().filter(|width| *width <= u32::MAX / 64)?;
        let known = |step: &Step| step.operands.iter().chain([&step.out]).all(|place| *place < values);
        if !is_able(Width::One) || !steps.iter().all(known) {
            return None;
        }
        let (mut assembler, mut parts, mut first) = (assembler::Assembler::new(Width::One), Vec::new(), 0);
        while first < steps.len() {
            let own = steps[first..].iter().take_while(|step| series::has_code(step)).count();
            let others = steps[first + own..].iter().take_while(|step| !series::has_code(step)).count();
            let begin = assembler.code.len();
            series::write(&mut assembler, &steps[first..first + own], values);
            parts.push((begin, first + own..first + own + others));
            first += own + others;
        }
        Some(Self { code: memory::Executable::new(&assembler.code)?, parts, width })
    }

    /// None: there is no code for this processor or system.
    #[cfg(not(all(target_arch = "x86_64", unix)))]
    pub fn new(_: &[Step], _: usize) -> Option<Self> {
        None
    }

    /// Finds the coefficients of order `k` of all values, from those of operands that are no step's; `memory` holds all coefficients, those
    /// of one order after those of the order before. `other` is asked for steps that have no code, by their numbers, in order.
    ///
    /// # Panics
    /// If the memory has no order `k`.
    #[cfg(all(target_arch = "x86_64", unix))]
    pub fn advance(&self, memory: &mut [f64], k: usize, mut other: impl FnMut(&mut [f64], usize)) {
        let first = k * self.width;
        assert!(memory.len() >= first + self.width, "no coefficients of order {k}");
        for (begin, others) in &self.parts {
            // SAFETY: `series::write` wrote functions of this type; they read and write places of `width` values of the orders from 0 to
            // k, which the memory has; the code begins where it was written.
            unsafe {
                let start = self.code.start().cast::<u8>().add(*begin);
                let run: unsafe extern "C" fn(*mut f64, *mut f64, usize, *const u64) = std::mem::transmute(start);
                let lowest = memory.as_mut_ptr();
                run(lowest.add(first), lowest, k, registers::BITS.as_ptr().cast());
            }
            others.clone().for_each(|step| other(memory, step));
        }
    }

    /// There is no code for this processor or system.
    #[cfg(not(all(target_arch = "x86_64", unix)))]
    pub fn advance(&self, _: &mut [f64], _: usize, _: impl FnMut(&mut [f64], usize)) {}
}
