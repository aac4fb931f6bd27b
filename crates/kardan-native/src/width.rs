//! How many numbers stand side by side.

use kardan_rt::Lanes;

/// How many numbers stand side by side.
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
    /// Bytes of a place in memory.
    #[cfg(all(target_arch = "x86_64", unix))]
    pub fn bytes(self) -> u32 {
        8 * self as u32
    }
}

/// What is as wide as a register can be.
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
