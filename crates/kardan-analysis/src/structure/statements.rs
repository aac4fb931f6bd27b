//! Statements on which results are proven and which are only very probable.

use crate::{LinearSystem, certified};
use kardan_math::num::PrimeField;
use kardan_results::Count;

/// Collects the proven and the only very probable results.
pub(super) struct Statements {
    pub list: Vec<String>,
    /// How many of them are true only with high probability.
    pub open: usize,
    /// The error probability of one of those.
    each: f64,
}

impl Statements {
    /// Every claim is true unless a random prime divides one of a few whole numbers other than zero. With minors of S
    /// of at most H bits (see the bound in [`certified`]) these are: a minor of the block matrix of all [E, −A, B], n H bits;
    /// for the invariant factors of the system, of its uncontrollable and unobservable part, and for the zeros, minors for
    /// the nullities, 2 n (H + n) bits, and leading coefficients of gcds of minors, n H bits, each; the discriminant of the
    /// square-free part, 2 n (H + 2 n) bits; numerators of differences between a coefficient and the candidates for it,
    /// 100 (H + n) bits. For each claim that is less than 32 (size + 4) (H + size) bits altogether.
    pub fn new(system: &LinearSystem) -> Self {
        let size = (system.states.len() + system.inputs.len() + system.outputs.len()) as f64;
        let norm = certified::norm_bits(system) as f64;
        let bad = 32.0 * (size + 4.0) * (norm + size) / 60.0;
        Self { list: Vec::new(), open: 0, each: (bad / PrimeField::CHOICES).min(1.0) }
    }

    /// A claim that is true modulo random primes.
    pub fn modular(&mut self, what: &str) {
        self.open += 1;
        self.list.push(format!("{what}: modulo random primes; wrong with a probability below {:.0e}", self.each));
    }

    /// A rank of which too little is known.
    pub fn undecided(&mut self, what: &str, rank: usize, n: usize, primes: usize) {
        self.list.push(format!(
            "{what} rank: not decided; it is at least {rank} of {n}, and exact left vectors for a proof that it is not more \
             were not found modulo {primes} primes"
        ));
    }

    /// A rank.
    pub fn rank(&mut self, what: &str, rank: usize, n: usize, proven: bool) {
        if !proven {
            return self.modular(&format!("{what} rank {rank} of {n} (at least {rank} is proven)"));
        }
        self.list.push(if rank == n {
            format!("{what} rank {n} of {n}: a minor does not vanish modulo a prime; proven")
        } else {
            format!(
                "{what} rank {rank} of {n}: a minor does not vanish modulo a prime, and {} never reached; proven",
                match n - rank {
                    1 => "an exact left vector is".into(),
                    many => format!("{many} exact left vectors are"),
                }
            )
        });
    }

    /// The least number of inputs or outputs.
    pub fn count(&mut self, what: &str, m: usize, count: Option<&Count>, proven: bool) {
        match count {
            Some(_) if m == 1 => {
                let one = what.trim_end_matches('s');
                self.list.push(format!("1 {one} is enough: a witness with a non-vanishing minor; proven"));
            }
            Some(count) if count.rows.is_empty() => self.list.push(format!(
                "{m} {what} are enough: a witness with a non-vanishing minor; fewer are impossible: there are {m} \
                 invariant factors; proven"
            )),
            Some(count) => self.list.push(format!(
                "{m} {what} are enough: a witness with a non-vanishing minor; fewer are impossible: {} exact rows on which \
                 the system acts as {m} copies of one companion matrix; proven",
                count.rows.len()
            )),
            None if proven => self.list.push(format!(
                "least number of {what} {m}: the number of non-trivial invariant factors; proven"
            )),
            None => self.modular(&format!("least number of {what} {m}")),
        }
    }

    /// A bound for the probability that any claim is wrong.
    pub fn failure_probability(&self) -> f64 {
        (self.open as f64 * self.each).min(1.0)
    }
}
