//! Which faults outputs can detect, and which they can isolate from each other.

use super::LinearSystem;
use super::parity::{ParitySignal, choices, subsets};
use super::parts::{columns_of, joined, limit_space, pencil_at, side_by_side, stacked};
use kardan_math::num::{Matrix, ModularMatrix, PrimeField, Primes, Rational, exact_rank};

/// Most states for which ranks are decided exactly; with more of them they are decided modulo random primes.
pub const MOST_EXACT: usize = 24;

/// Most sets of sensors that are tried.
const MOST_SETS: usize = 4096;

/// The transfer matrix of a system at points where it has the rank that it has over the rational functions.
#[derive(Debug, Clone)]
pub struct Transfer {
    /// At more whole numbers than a minor has zeros: the largest rank is that over the rational functions.
    exact: Vec<Matrix<Rational>>,
    /// At a random number modulo a random prime, two times.
    modular: Vec<(PrimeField, ModularMatrix)>,
    outputs: usize,
}

impl Transfer {
    /// `None` if `det(sE − A)` is zero for all s.
    pub fn new(system: &LinearSystem) -> Option<Self> {
        let (n, outputs) = (system.states.len(), system.outputs.len());
        let mut primes = Primes::unforeseen(super::images::fingerprint(system));
        let modular: Vec<_> = (0..8).filter_map(|_| modulo(system, primes.next()?, primes.next()?)).take(2).collect();
        if modular.len() < 2 {
            return None;
        }
        if n > MOST_EXACT {
            return Some(Self { exact: Vec::new(), modular, outputs });
        }
        let needed = exact_rank(&system.e) + 1;
        let points = (1..).take(needed + n).map(Rational::from);
        let exact: Vec<_> = points.filter_map(|s| at(system, &s)).take(needed).collect();
        (exact.len() == needed).then_some(Self { exact, modular, outputs })
    }

    /// Whether its ranks are exact.
    pub fn is_exact(&self) -> bool {
        !self.exact.is_empty()
    }

    /// The rank of what these faults do to these outputs, over the rational functions.
    pub fn rank(&self, outputs: &[usize], faults: &[ParitySignal]) -> usize {
        if self.exact.is_empty() {
            return self.likely_rank(outputs, faults);
        }
        let ranks = self.exact.iter().map(|point| {
            exact_rank(&Matrix::from_fn(outputs.len(), faults.len(), |i, k| {
                effect(faults[k], outputs[i], |j| point[(outputs[i], j)].clone(), Rational::ONE, Rational::ZERO)
            }))
        });
        largest_up_to(outputs.len().min(faults.len()), ranks)
    }

    /// The same modulo random primes: never larger, and smaller with a tiny probability.
    pub fn likely_rank(&self, outputs: &[usize], faults: &[ParitySignal]) -> usize {
        let ranks = self.modular.iter().map(|(field, point)| {
            let matrix = ModularMatrix::from_fn(outputs.len(), faults.len(), |i, k| {
                effect(faults[k], outputs[i], |j| point.row(outputs[i])[j], field.one(), 0)
            });
            matrix.echelon(field).1.len()
        });
        largest_up_to(outputs.len().min(faults.len()), ranks)
    }

    /// Whether these outputs show a fault at all, whatever the unknown inputs do.
    pub fn detects(&self, outputs: &[usize], fault: ParitySignal, unknown: &[usize]) -> bool {
        let mut columns: Vec<ParitySignal> = unknown.iter().map(|&j| ParitySignal::Input(j)).collect();
        let base_rank = self.rank(outputs, &columns);
        columns.push(fault);
        self.rank(outputs, &columns) > base_rank
    }

    /// Faults that these outputs show, in groups: those of one group cannot be isolated from each other, those of different groups can. The last list
    /// has those that are not shown.
    ///
    /// Two faults that are shown can be isolated if one is shown for any course of the other; that is mutual, and of three faults, if
    /// the first cannot be isolated from the second and the second not from the third, the first cannot be isolated from the third.
    pub fn groups(
        &self,
        outputs: &[usize],
        faults: &[ParitySignal],
        unknown: &[usize],
    ) -> (Vec<Vec<usize>>, Vec<usize>) {
        let mut columns: Vec<ParitySignal> = unknown.iter().map(|&j| ParitySignal::Input(j)).collect();
        let base = self.rank(outputs, &columns);
        let mut rank = |more: &[ParitySignal]| {
            columns.truncate(unknown.len());
            columns.extend_from_slice(more);
            self.rank(outputs, &columns)
        };
        let (mut groups, mut silent): (Vec<Vec<usize>>, Vec<usize>) = Default::default();
        for (k, &fault) in faults.iter().enumerate() {
            if rank(&[fault]) == base {
                silent.push(k);
                continue;
            }
            match groups.iter_mut().find(|group| rank(&[faults[group[0]], fault]) < base + 2) {
                Some(group) => group.push(k),
                None => groups.push(vec![k]),
            }
        }
        (groups, silent)
    }
}

/// What a fault does to an output; `of_input` is what an input does.
fn effect<T>(fault: ParitySignal, output: usize, of_input: impl Fn(usize) -> T, one: T, zero: T) -> T {
    match fault {
        ParitySignal::Input(j) => of_input(j),
        ParitySignal::Output(k) if k == output => one,
        ParitySignal::Output(_) => zero,
    }
}

/// The largest rank, as far as the first one that is the most possible.
fn largest_up_to(most: usize, ranks: impl Iterator<Item = usize>) -> usize {
    let mut best = 0;
    for rank in ranks {
        best = best.max(rank);
        if best == most {
            break;
        }
    }
    best
}

/// `C (sE − A)⁻¹ B + D`; `None` at a pole.
fn at(system: &LinearSystem, s: &Rational) -> Option<Matrix<Rational>> {
    Some(system.c.multiply(&pencil_at(&system.e, &system.a, s).solve(&system.b)?).plus(&system.d))
}

/// The same modulo a prime, at a number that another one gives.
fn modulo(system: &LinearSystem, prime: u64, point: u64) -> Option<(PrimeField, ModularMatrix)> {
    let field = PrimeField::new(prime);
    let image = |matrix| ModularMatrix::from_rational(&field, matrix);
    let [e, a, b, c, d] = [&system.e, &system.a, &system.b, &system.c, &system.d].map(image);
    let s = field.element(point % prime);
    let pencil = a?.plus(&field, field.negate(s), &e?);
    let (x, _) = pencil.solve(&field, &b?)?;
    let found = d?.plus(&field, field.negate(field.one()), &c?.multiply(&field, &x));
    Some((field, found))
}

/// Whether a constant fault remains visible: no initial state and no time function of the unknown inputs gives the same
/// readings from some time on. Exact; `None` for more states than [`MOST_EXACT`].
///
/// Method: the largest space of states, with the fault as one of them, in which some inputs keep the outputs at zero (the recursion of
/// Wonham and Morse, for `E ẋ = A x + B u`); the fault is not detected if it moves in it.
pub fn constant_is_detectable(system: &LinearSystem, fault: ParitySignal, unknown: &[usize]) -> Option<bool> {
    let (n, p, m) = (system.states.len(), system.outputs.len(), unknown.len());
    if n > MOST_EXACT {
        return None;
    }
    let acts = Matrix::from_fn(n, 1, |i, _| match fault {
        ParitySignal::Input(j) => system.b[(i, j)].clone(),
        ParitySignal::Output(_) => Rational::ZERO,
    });
    let shows =
        Matrix::from_fn(p, 1, |i, _| effect(fault, i, |j| system.d[(i, j)].clone(), Rational::ONE, Rational::ZERO));
    // Over the states, the fault and the unknown inputs: E times the rates, the rate of the fault, which is zero, and the outputs.
    let on_rates = side_by_side(&[&system.a, &acts, &columns_of(&system.b, unknown)]);
    let on_outputs = side_by_side(&[&system.c, &shows, &columns_of(&system.d, unknown)]);
    let equations = stacked(&[&on_rates, &Matrix::zeros(1, n + 1 + m), &on_outputs]);
    let of_fault = Matrix::from_fn(1 + p, 1, |i, _| if i == 0 { Rational::ONE } else { Rational::ZERO });
    let rates = joined([&system.e, &Matrix::zeros(n, 1)], [&Matrix::zeros(1 + p, n), &of_fault]);
    let space = limit_space(&equations, &rates, Matrix::identity(n + 1));
    Some((0..space.columns()).all(|j| space[(n, j)].is_zero()))
}

/// The requirement on a set of sensors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Goal {
    /// It detects a fault of an input.
    Shows(usize),
    /// It detects the faults of all inputs that may fail, and of its own sensors.
    ShowsAll,
    /// It also isolates each of them from the others.
    Isolates,
}

/// The smallest sets of outputs that reach a goal.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SmallestSets {
    /// The sets.
    pub sets: Vec<Vec<usize>>,
    /// Whether all smaller sets were tried.
    pub all: bool,
}

/// Tries sets of outputs, small ones first. Ranks are decided modulo random primes.
pub fn smallest_sets(transfer: &Transfer, goal: Goal, failing: &[usize], unknown: &[usize]) -> SmallestSets {
    let likely = Transfer { exact: Vec::new(), ..transfer.clone() };
    let reaches = |set: &[usize]| {
        let own = set.iter().map(|&k| ParitySignal::Output(k));
        let faults: Vec<ParitySignal> = failing.iter().map(|&j| ParitySignal::Input(j)).chain(own).collect();
        match goal {
            Goal::Shows(input) => likely.detects(set, ParitySignal::Input(input), unknown),
            Goal::ShowsAll => faults.iter().all(|&fault| likely.detects(set, fault, unknown)),
            Goal::Isolates => likely.groups(set, &faults, unknown).0.len() == faults.len(),
        }
    };
    let (mut tried, p) = (0, transfer.outputs);
    for size in 1..=p {
        tried += choices(p, size).unwrap_or(usize::MAX).min(2 * MOST_SETS);
        if tried > MOST_SETS {
            return SmallestSets { sets: Vec::new(), all: false };
        }
        let sets: Vec<Vec<usize>> = subsets(p, size).filter(|set| reaches(set)).collect();
        if !sets.is_empty() {
            return SmallestSets { sets, all: true };
        }
    }
    SmallestSets { sets: Vec::new(), all: true }
}

#[cfg(test)]
#[path = "../tests/unit/detect.rs"]
mod tests;
