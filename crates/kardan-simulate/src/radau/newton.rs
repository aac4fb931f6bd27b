//! The linear systems of the iteration, `(σ I − J) x = b` for the real σ and the complex pairs of the tableau, as
//! `(σ E − A) x = E b`: the time and memory of sparse factors depend on the structure, and already for loops of ten
//! states they are below those of dense ones.

use faer::c64;

use super::equations::{Descriptor, Equations};
use super::tableau::Tableau;
use kardan_math::num::{SparseLu, SparseOrder};

/// The systems with their memory: factors of `σ E − A`.
pub(super) struct Systems {
    n: usize,
    pub(super) descriptor: Descriptor,
    /// The order for the places that the descriptor had when it was found.
    order: Option<SparseOrder>,
    ordered: Vec<(usize, usize)>,
    real: SparseLu<f64>,
    pairs: Vec<SparseLu<c64>>,
    numbers: Vec<f64>,
    shifted: Vec<c64>,
    right: Vec<f64>,
    both: Vec<c64>,
}

impl Systems {
    /// For n states.
    pub(super) fn new(n: usize, tableau: &Tableau) -> Self {
        Self {
            n,
            descriptor: Descriptor::default(),
            order: None,
            ordered: Vec::new(),
            real: SparseLu::default(),
            pairs: tableau.pairs.iter().map(|_| SparseLu::default()).collect(),
            numbers: Vec::new(),
            shifted: Vec::new(),
            right: Vec::new(),
            both: Vec::new(),
        }
    }

    /// Computes the derivatives at a time and a state with the rates there; returns the number of evaluations. Where a
    /// derivative is not finite, as that of `1/(exp(x) + 1)` where `exp(x)` overflows, all are differences, of changes
    /// in proportion to `sizes`.
    pub(super) fn linearise(
        &mut self,
        (time, state, slope): (f64, &[f64], &[f64]),
        sizes: impl Iterator<Item = f64>,
        equations: &mut impl Equations,
    ) -> u64 {
        equations.linearise(time, state, &mut self.descriptor);
        if self.descriptor.is_finite() {
            return 1;
        }
        1 + self.descriptor.differ((time, state, slope), sizes.take(self.n), equations)
    }

    /// Factors all systems for steps of one length; false if one is singular or not finite.
    pub(super) fn factor(&mut self, h: f64, tableau: &Tableau) -> bool {
        let Self { descriptor, order, ordered, real, pairs, numbers, shifted, .. } = self;
        if order.is_none() || *ordered != descriptor.places {
            *order = SparseOrder::new(descriptor.size, &descriptor.places);
            ordered.clone_from(&descriptor.places);
        }
        let Some(order) = order else { return false };
        descriptor.shifted(tableau.real / h, numbers);
        let mut regular = real.factor(order, numbers);
        for (lu, (alpha, beta)) in pairs.iter_mut().zip(&tableau.pairs) {
            descriptor.shifted(c64::new(alpha / h, -beta / h), shifted);
            regular &= lu.factor(order, shifted);
        }
        regular
    }

    /// Overwrites b with the solution of the real system.
    pub(super) fn solve(&mut self, b: &mut [f64]) {
        let Self { n, descriptor, order, real, right, .. } = self;
        let Some(order) = order else { return b.fill(f64::NAN) };
        descriptor.weigh(b, right);
        real.solve(order, right);
        b.copy_from_slice(&right[..*n]);
        descriptor.still.iter().for_each(|i| b[*i] = 0.0);
    }

    /// The same for a pair, `[(α/h) I − J, (β/h) I; −(β/h) I, (α/h) I − J]`, which is a complex system for `x + iy`.
    pub(super) fn solve_pair(&mut self, pair: usize, b: &mut [f64]) {
        let Self { n, descriptor, order, pairs, shifted, both, .. } = self;
        let Some(order) = order else { return b.fill(f64::NAN) };
        let (x, y) = b.split_at_mut(*n);
        shifted.clear();
        shifted.extend(x.iter().zip(&*y).map(|(x, y)| c64::new(*x, *y)));
        descriptor.weigh(shifted, both);
        pairs[pair].solve(order, both);
        for (z, (x, y)) in both.iter().zip(x.iter_mut().zip(&mut *y)) {
            (*x, *y) = (z.re, z.im);
        }
        descriptor.still.iter().for_each(|i| (x[*i], y[*i]) = (0.0, 0.0));
    }
}
