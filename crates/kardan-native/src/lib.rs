//! Plans as machine code.
//!
//! [`kardan_rt::Plan`] interprets a list of operations, on every target and in safe code. On x86-64 processors with
//! AVX2 this crate writes the same operations as straight-line instructions, for one number or for four in SIMD lanes,
//! with AVX-512F also for eight ([`lanes`] returns the number). The bits are the same in each lane: each product and
//! each sum is rounded separately, functions are those of [`kardan_rt::functions`].
//!
//! One evaluation takes half of the interpreter's time, four at once a quarter each. Of eight each takes two thirds of
//! that where functions take most of the time. Sums and products are not faster on processors that store 64 bytes in
//! two parts (Zen 4), and slower where addresses are not multiples of 64 bytes, which is allowed.
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

mod aligned;
mod assembler;
mod compile;
#[cfg(all(target_arch = "x86_64", unix))]
mod functions;
#[cfg(all(target_arch = "x86_64", unix))]
mod memory;
mod recurrences;
mod registers;
mod series;
mod step;
mod width;

/// Without functions and executable memory there is no code.
#[cfg(not(all(target_arch = "x86_64", unix)))]
mod functions {
    pub fn function(_: kardan_rt::Operator, _: crate::width::Width) -> Option<fn()> {
        None
    }
}

#[cfg(not(all(target_arch = "x86_64", unix)))]
mod memory {
    #[derive(Debug)]
    pub enum Executable {}

    impl Executable {
        pub fn new(_: &[u8]) -> Option<Self> {
            None
        }

        pub fn start(&self) -> *const u8 {
            match *self {}
        }
    }
}

use std::marker::PhantomData;

use kardan_rt::Plan;

pub use aligned::Aligned;
pub use series::NativeSeries;
pub use step::Step;
use width::is_able;
pub use width::{Value, lanes, switch_off};

/// A plan as machine code, for memory of entries `N`: one evaluation, or one in each lane.
#[derive(Debug)]
pub struct Native<N> {
    code: memory::Executable,
    /// Entries of memory.
    places: usize,
    inputs: usize,
    outputs: Vec<u32>,
    values: PhantomData<fn(N)>,
}

impl<N: Value> Native<N> {
    /// Writes the code of a plan. None on processors without AVX2 (for eight lanes AVX-512F), on other systems, where
    /// memory for code is refused, after [`switch_off`], and for plans with tables.
    pub fn new(plan: &Plan<'_, f64>) -> Option<Self> {
        if !is_able(N::WIDTH) {
            return None;
        }
        let code = memory::Executable::new(&compile::compile(plan, N::WIDTH)?)?;
        let (places, inputs) = (plan.memory(), plan.inputs);
        Some(Self { code, places, inputs, outputs: plan.outputs.to_vec(), values: PhantomData })
    }

    /// Evaluates as [`Plan::evaluate`], in memory that [`Plan::begin`] has prepared. False where an input or output of
    /// any lane is not a number, or the memory is too short.
    #[must_use = "false: an output is not finite"]
    pub fn evaluate(&self, memory: &mut [N]) -> bool {
        if memory.len() < self.places {
            return false;
        }
        self.run(memory);
        let finite = |x: &N| x.all_finite();
        memory.iter().take(self.inputs).all(finite)
            && self.outputs.iter().all(|output| memory.get(*output as usize).is_some_and(finite))
    }

    /// The same without checks for NaN and infinity.
    ///
    /// # Panics
    /// If the memory is too short.
    pub fn find(&self, memory: &mut [N]) {
        assert!(memory.len() >= self.places, "the memory of a plan has a place for each value");
        self.run(memory);
    }

    fn run(&self, memory: &mut [N]) {
        // SAFETY: `compile` wrote a function of this type; it reads and writes the values of the plan, each of as many
        // numbers as `N` has, and the memory contains them all; `new` checked that the processor supports it.
        unsafe {
            let run: unsafe extern "C" fn(*mut N, *const u64) = std::mem::transmute(self.code.start());
            run(memory.as_mut_ptr(), registers::BITS.as_ptr().cast());
        }
    }
}
