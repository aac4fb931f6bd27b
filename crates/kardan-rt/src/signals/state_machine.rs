//! The block of a state machine and its transitions.

use super::{half, is_on, one, smaller, zero};
use crate::Arithmetic;

/// A way from one state of a [`StateMachine`] to another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Transition {
    /// Number of the state that it leaves.
    pub from: usize,
    /// Number of the state that it leads to.
    pub to: usize,
}

/// A state machine: it is in one of its states, numbered from 0, and takes a transition whose guard is true.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StateMachine<'a> {
    /// Its transitions; where two are possible, it takes the first.
    pub transitions: &'a [Transition],
}

impl StateMachine<'_> {
    /// One sample: takes the first transition from the present state whose guard is above a half. A guard that is not a
    /// number counts as false, and the block returns false. The entries of its memory are the number of its state, and
    /// samples since it came there.
    ///
    /// ```
    /// use kardan_rt::{StateMachine, Transition};
    /// let machine = StateMachine { transitions: &[Transition { from: 0, to: 1 }, Transition { from: 1, to: 2 }, Transition { from: 1, to: 0 }] };
    /// let mut entries = [0.0; 2];
    /// for (guards, expected) in [([0.0, 1.0, 1.0], [0.0, 1.0]), ([1.0, 1.0, 0.0], [1.0, 0.0]), ([0.0, 1.0, 1.0], [2.0, 0.0]), ([1.0, 1.0, 1.0], [2.0, 1.0])] {
    ///     assert!(machine.step(&guards, &mut entries) && entries == expected);
    /// }
    /// ```
    #[must_use = "false: a guard was not a number, and counts as false"]
    pub fn step<N: Arithmetic>(&self, guards: &[N], entries: &mut [N; 2]) -> bool {
        let [state, since] = *entries;
        // Samples that are counted for ever stop where numbers are no longer exact.
        let (mut next, mut time) = (state, smaller(since + one(), N::whole(1 << 24)));
        let mut good = true;
        for (Transition { from, to }, guard) in self.transitions.iter().zip(guards).rev() {
            good &= guard.all_finite();
            // |state − from| < 1/2
            let away = state - N::whole(*from);
            let away = away.select(zero(), -away, away);
            let here = away.select(half(), one(), zero());
            let fires = here * is_on(guard.finite_or(zero()));
            next = half::<N>().select(fires, N::whole(*to), next);
            time = half::<N>().select(fires, zero(), time);
        }
        *entries = [next, time];
        good
    }
}
