//! Plans as machine code.
//!
//! [`kardan_rt::Plan`] interprets a list of operations, on every target and in safe code. On x86-64 processors with AVX2 this crate writes
//! the same operations as straight-line instructions, for one number or for four side by side, with the same bits: each product and each
//! sum is rounded by itself, functions are those of [`kardan_rt::functions`]. It takes half of the time, four at once a quarter each.
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

use std::fmt::{self, Debug, Formatter};
use std::marker::PhantomData;
use std::sync::atomic::{AtomicBool, Ordering};

use kardan_rt::{Lanes, Number, Plan};

/// Whether no code is to be written.
static OFF: AtomicBool = AtomicBool::new(false);

/// From here on there is no new machine code: [`Native::new`] gives none. Results do not change.
pub fn switch_off() {
    OFF.store(true, Ordering::Relaxed);
}

mod sealed {
    /// How many numbers stand side by side.
    pub trait Width {
        /// Whether they are four.
        const WIDE: bool;
    }

    impl Width for f64 {
        const WIDE: bool = false;
    }

    impl Width for kardan_rt::Lanes<f64, 4> {
        const WIDE: bool = true;
    }
}

/// What machine code computes with: `f64`, or four of them.
pub trait Value: Number<One = f64> + sealed::Width {}

impl Value for f64 {}
impl Value for Lanes<f64, 4> {}

/// A plan as machine code.
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
    /// Writes the code of a plan. None on other processors and systems, where memory for code is refused, and for plans with tables.
    #[cfg(all(target_arch = "x86_64", unix))]
    pub fn new(plan: &Plan<'_, f64>) -> Option<Self> {
        if OFF.load(Ordering::Relaxed) || !std::arch::is_x86_feature_detected!("avx2") {
            return None;
        }
        let code = memory::Executable::new(&compile::compile(plan, N::WIDE)?)?;
        let (places, inputs) = (plan.memory(), plan.inputs);
        Some(Self { code, places, inputs, outputs: plan.outputs.to_vec(), values: PhantomData })
    }

    /// None: there is no code for this processor or system.
    #[cfg(not(all(target_arch = "x86_64", unix)))]
    pub fn new(_: &Plan<'_, f64>) -> Option<Self> {
        None
    }

    /// Does what [`Plan::evaluate`] does, in memory that [`Plan::begin`] has prepared.
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
        // SAFETY: `compile` wrote a function of this type; it reads and writes the places of the plan, each a number or four of them, and
        // the memory has them all.
        unsafe {
            let run: unsafe extern "C" fn(*mut N, *const u64) = std::mem::transmute(self.code.start());
            run(memory.as_mut_ptr(), compile::BITS.as_ptr());
        }
    }

    #[cfg(not(all(target_arch = "x86_64", unix)))]
    fn run(&self, _: &mut [N]) {}
}
