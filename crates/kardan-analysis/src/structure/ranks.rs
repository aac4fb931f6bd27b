//! The controllable and the observable part: ranks modulo primes, and left vectors that prove them.

use std::sync::Arc;

use super::error::StructureError;
use super::left_vectors::{InvariantRows, invariant_rows};
use super::limits::{Limits, RANK_TRIALS};
use crate::LinearSystem;
use crate::images::{Image, Images};
use kardan_math::num::{PrimeField, Primes, Span, exact_rank, reachable};
use kardan_results::{Minor, MinorColumn};

/// The controllable and the observable part modulo one prime.
#[derive(Clone)]
pub(super) struct RankSample {
    pub image: Arc<Image>,
    /// The image of the transposed system.
    pub dual: Arc<Image>,
    pub reached: Reach,
    pub observable: Reach,
}

impl RankSample {
    fn of(image: Arc<Image>, dual: Arc<Image>) -> Self {
        let (reached, observable) = rayon::join(|| Reach::of(&image), || Reach::of(&dual));
        Self { image, dual, reached, observable }
    }

    /// The one with the largest ranks of at most so many.
    fn best(mut next: impl FnMut() -> (Arc<Image>, Arc<Image>), most: usize) -> Self {
        let mut best: Option<Self> = None;
        for _ in 0..most {
            let (image, dual) = next();
            let sample = Self::of(image, dual);
            let full = sample.is_full();
            if best.as_ref().is_none_or(|best| best.sum() < sample.sum()) {
                best = Some(sample);
            }
            if full {
                break;
            }
        }
        best.expect("at least one prime")
    }

    fn is_full(&self) -> bool {
        [self.reached.rank, self.observable.rank] == [self.image.g.rows; 2]
    }

    fn sum(&self) -> usize {
        self.reached.rank + self.observable.rank
    }

    /// Whether no rank is below that of another prime.
    fn reaches(&self, other: &Self) -> bool {
        self.reached.rank >= other.reached.rank && self.observable.rank >= other.observable.rank
    }
}

/// The reachable part modulo one prime.
#[derive(Clone)]
pub(super) struct Reach {
    pub rank: usize,
    pub minor: Minor,
    /// Where not all is reached.
    pub span: Option<Span>,
}

impl Reach {
    fn of(image: &Image) -> Self {
        let part = reachable(&image.field, &image.g, &image.b);
        let rank = part.span.dimension();
        let minor = minor(&image.field, part.columns, &part.span);
        Self { rank, minor, span: (rank < image.g.rows).then_some(part.span) }
    }
}

/// The minor that shows the rank of the span.
pub(super) fn minor(field: &PrimeField, columns: Vec<(usize, usize)>, span: &Span) -> Minor {
    let mut rows = span.pivots.clone();
    rows.sort_unstable();
    let columns = columns.into_iter().map(|(input, power)| MinorColumn { input, power }).collect();
    Minor { prime: field.prime(), columns, rows, value: field.value(span.minor(field)) }
}

/// The ranks of a system, and what proves them.
pub(super) struct Ranks {
    /// Modulo primes that were drawn.
    pub found: RankSample,
    /// The same ranks or more, modulo a prime that follows from the system: for the certificate.
    pub stated: RankSample,
    /// Left vectors that no input reaches; `None` if all is reached, or they were not found.
    pub unreached: Option<InvariantRows>,
    /// Vectors that no output shows.
    pub unobservable: Option<InvariantRows>,
}

impl Ranks {
    /// Of a system; the images are those of it and of its dual, drawn with the same primes.
    pub fn decide(
        system: &LinearSystem,
        [images, dual_images]: [&mut Images<'_>; 2],
        own: &mut Primes,
        limits: &Limits,
    ) -> Result<Self, StructureError> {
        let n = system.states.len();
        if images.get(0).is_none() {
            let rank = exact_rank(&system.e);
            if rank < n {
                return Err(StructureError::SingularDescriptor { rank, states: n });
            }
            while images.get(0).is_none() {}
            while dual_images.get(0).is_none() {}
        }
        let mut next_own = || loop {
            let prime = own.next().expect("primes are many");
            if let (Some(image), Some(dual)) = rayon::join(|| Image::new(system, prime), || Image::dual(system, prime))
            {
                return RankSample::of(Arc::new(image), Arc::new(dual));
            }
        };
        let mut stated = next_own();
        loop {
            let mut trials = 0;
            let mut sample = || {
                let pair = images.get(trials).zip(dual_images.get(trials)).expect("E is regular, and primes are many");
                trials += 1;
                pair
            };
            let found = if stated.is_full() {
                // Full rank needs no second opinion.
                let (image, dual) = sample();
                RankSample { image, dual, ..stated.clone() }
            } else {
                RankSample::best(sample, RANK_TRIALS)
            };
            while !stated.reaches(&found) {
                stated = next_own();
            }
            let rows = |images: &mut Images<'_>, rank: usize| match n - rank {
                0 => Ok(None),
                missing => invariant_rows(images, missing, limits),
            };
            if found.reaches(&stated)
                && let Ok(unreached) = rows(images, found.reached.rank)
                && let Ok(unobservable) = rows(dual_images, found.observable.rank)
            {
                return Ok(Self { found, stated, unreached, unobservable });
            }
            // The result modulo these primes is wrong.
            images.forget(trials);
            dual_images.forget(trials);
        }
    }

    /// Whether the ranks of inputs and outputs are proven: that they are not smaller always is.
    pub fn proven(&self) -> [bool; 2] {
        let n = self.found.image.g.rows;
        let ranks = [(self.found.reached.rank, &self.unreached), (self.found.observable.rank, &self.unobservable)];
        ranks.map(|(rank, rows)| rank == n || rows.is_some())
    }
}
