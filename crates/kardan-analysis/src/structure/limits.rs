//! How much work is done for one result.

use kardan_rt::functions::powi;

/// Most primes for one number: enough for some 12000 digits.
const MOST_PRIMES: usize = 700;

/// Least of the numbers of primes that are tried for one number of a large system.
const LEAST_PRIMES: usize = 24;

/// Most primes for one number where a proof is requested.
const PRIMES_FOR_PROOF: usize = 20_000;

/// Primes that are tried where inputs do not reach all.
pub(super) const RANK_TRIALS: usize = 3;

/// Most numbers in one proof by exact rows, where speed is requested.
pub(super) const MOST_NUMBERS: usize = 20_000;

/// How much work is done for one result.
pub(super) struct Limits {
    /// Most primes.
    pub primes: usize,
    /// Most numbers in exact rows.
    pub numbers: usize,
}

impl Limits {
    /// For a system with n states.
    pub fn new(n: usize, certify: bool) -> Self {
        if certify {
            return Self { primes: PRIMES_FOR_PROOF, numbers: usize::MAX };
        }
        Self { primes: most_primes(n), numbers: MOST_NUMBERS }
    }
}

/// How many primes are tried for one number of a system with n states: as many as take a few seconds.
pub(super) fn most_primes(n: usize) -> usize {
    ((2e9 / powi(n as f64, 3)) as usize).clamp(LEAST_PRIMES, MOST_PRIMES)
}
