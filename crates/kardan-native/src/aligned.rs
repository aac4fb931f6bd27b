//! Memory for values that begins at a multiple of 64 bytes.

use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use crate::width::Value;

/// The block that a processor reads at once.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Line(#[expect(dead_code, reason = "read as values")] [f64; 8]);

/// Memory for values that begins at a multiple of 64 bytes, so that none of them crosses such a multiple: code for
/// lanes then takes two thirds of the time. This alignment is optional.
///
/// ```
/// use kardan_native::Aligned;
/// use kardan_rt::Lanes;
/// let mut memory = Aligned::<Lanes<f64, 4>>::new(3);
/// memory[2] = Lanes([1.0, 2.0, 3.0, 4.0]);
/// assert_eq!(memory[..], [Lanes([0.0; 4]), Lanes([0.0; 4]), Lanes([1.0, 2.0, 3.0, 4.0])]);
/// ```
#[derive(Debug, Clone)]
pub struct Aligned<N> {
    lines: Vec<Line>,
    count: usize,
    values: PhantomData<N>,
}

impl<N: Value> Aligned<N> {
    /// Memory for `count` values, all of them 0.
    pub fn new(count: usize) -> Self {
        let numbers = count.checked_mul(N::WIDTH as usize).expect("the size exceeds the address space");
        Self { lines: vec![Line([0.0; 8]); numbers.div_ceil(8)], count, values: PhantomData }
    }
}

impl<N: Value> Deref for Aligned<N> {
    type Target = [N];

    fn deref(&self) -> &[N] {
        // SAFETY: a value consists of `WIDTH` numbers, one after the other and nothing else, and the lines have that
        // many.
        unsafe { std::slice::from_raw_parts(self.lines.as_ptr().cast(), self.count) }
    }
}

impl<N: Value> DerefMut for Aligned<N> {
    fn deref_mut(&mut self) -> &mut [N] {
        // SAFETY: as above; all numbers are values.
        unsafe { std::slice::from_raw_parts_mut(self.lines.as_mut_ptr().cast(), self.count) }
    }
}
