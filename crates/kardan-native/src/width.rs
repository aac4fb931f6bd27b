//! The number of SIMD lanes, and whether there is machine code for it.

use std::sync::atomic::{AtomicBool, Ordering};

use kardan_rt::{Lanes, Number};

/// Whether no code is to be written.
static OFF: AtomicBool = AtomicBool::new(false);

/// From here on there is no new machine code: [`Native::new`](crate::Native::new) returns none. Results do not change.
pub fn switch_off() {
    OFF.store(true, Ordering::Relaxed);
}

#[cfg(all(target_arch = "x86_64", unix))]
pub fn is_able(width: Width) -> bool {
    let wide = width != Width::Eight || std::arch::is_x86_feature_detected!("avx512f");
    !OFF.load(Ordering::Relaxed) && std::arch::is_x86_feature_detected!("avx2") && wide
}

#[cfg(not(all(target_arch = "x86_64", unix)))]
pub fn is_able(_: Width) -> bool {
    false
}

/// The largest number of lanes for which machine code is written here: 8 with AVX-512F, 4 with AVX2. 1 where there is
/// none, on other processors and systems and after [`switch_off`]: then the interpreter evaluates one after the other.
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

/// The number type of machine code: `f64`, or four or eight of them. They need no other alignment than `f64`.
pub trait Value: Number<One = f64> + Wide {}

impl Value for f64 {}
impl Value for Lanes<f64, 4> {}
impl Value for Lanes<f64, 8> {}

/// The number of SIMD lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Width {
    /// A number alone.
    One = 1,
    /// Four, in a register of AVX2.
    Four = 4,
    /// Eight, in a register of AVX-512.
    Eight = 8,
}

impl Width {
    /// Bytes of a value in memory.
    pub fn bytes(self) -> u32 {
        8 * self as u32
    }
}

/// A type as wide as a register can be.
pub trait Wide {
    /// How many numbers it is.
    const WIDTH: Width;
}

impl Wide for f64 {
    const WIDTH: Width = Width::One;
}

impl Wide for Lanes<f64, 4> {
    const WIDTH: Width = Width::Four;
}

impl Wide for Lanes<f64, 8> {
    const WIDTH: Width = Width::Eight;
}
