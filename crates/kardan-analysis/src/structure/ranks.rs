//! The controllable and the observable part: ranks modulo primes, and left vectors that prove them.

use std::sync::Arc;

use super::error::StructureError;
use super::left_vectors::{InvariantRows, invariant_rows};
use super::limits::{Limits, RANK_TRIALS};
use crate::images::{Image, Images};
use crate::{LinearSystem, Side};
use kardan_math::num::{PrimeField, Primes, Span, exact_rank, reachable};
use kardan_results::{Minor, MinorColumn};

/// What inputs reach modulo one prime.
#[derive(Clone)]
pub(super) struct Reach {
    pub image: Arc<Image>,
    pub rank: usize,
    pub minor: Minor,
    /// Where not all is reached.
    pub span: Option<Span>,
}

impl Reach {
    fn of(image: Arc<Image>) -> Self {
        let part = reachable(&image.field, &image.g, &image.b);
        let rank = part.span.dimension();
        let minor = minor(&image.field, part.columns, &part.span);
        let span = (rank < image.g.rows).then_some(part.span);
        Self { image, rank, minor, span }
    }
}

/// Of a system, and of the transposed one: what outputs show.
pub(super) type RankSample = [Reach; 2];

fn sample([image, dual]: [Arc<Image>; 2]) -> RankSample {
    rayon::join(|| Reach::of(image), || Reach::of(dual)).into()
}

/// The one with the largest ranks of at most so many.
fn best(mut next: impl FnMut() -> [Arc<Image>; 2], most: usize) -> RankSample {
    let sum = |sample: &RankSample| sample.iter().map(|reach| reach.rank).sum::<usize>();
    let mut best: Option<RankSample> = None;
    for _ in 0..most {
        let found = sample(next());
        let full = is_full(&found);
        if best.as_ref().is_none_or(|best| sum(best) < sum(&found)) {
            best = Some(found);
        }
        if full {
            break;
        }
    }
    best.expect("at least one prime")
}

fn is_full(sample: &RankSample) -> bool {
    sample.iter().all(|reach| reach.rank == reach.image.g.rows)
}

/// Whether no rank is below that of another prime.
fn reaches(sample: &RankSample, other: &RankSample) -> bool {
    sample.iter().zip(other).all(|(own, other)| own.rank >= other.rank)
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
    /// Left vectors that no input reaches, and vectors that no output shows; `None` if there are none, or they were not found.
    pub rows: [Option<InvariantRows>; 2],
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
            let image = |side| move || Image::of(system, side, prime).map(Arc::new);
            if let (Some(image), Some(dual)) = rayon::join(image(Side::Inputs), image(Side::Outputs)) {
                return sample([image, dual]);
            }
        };
        let mut stated = next_own();
        loop {
            let mut trials = 0;
            let mut next = || -> [Arc<Image>; 2] {
                let pair = images.get(trials).zip(dual_images.get(trials)).expect("E is regular, and primes are many");
                trials += 1;
                pair.into()
            };
            let found = if is_full(&stated) {
                // Full rank needs no second opinion.
                let mut found = stated.clone();
                found.iter_mut().zip(next()).for_each(|(reach, image)| reach.image = image);
                found
            } else {
                best(next, RANK_TRIALS)
            };
            while !reaches(&stated, &found) {
                stated = next_own();
            }
            let rows = |images: &mut Images<'_>, rank: usize| match n - rank {
                0 => Ok(None),
                missing => invariant_rows(images, missing, limits),
            };
            if reaches(&found, &stated)
                && let Ok(unreached) = rows(images, found[0].rank)
                && let Ok(unobservable) = rows(dual_images, found[1].rank)
            {
                return Ok(Self { found, stated, rows: [unreached, unobservable] });
            }
            // The result modulo these primes is wrong.
            images.forget(trials);
            dual_images.forget(trials);
        }
    }

    /// Whether the ranks of inputs and outputs are proven: that they are not smaller always is.
    pub fn proven(&self) -> [bool; 2] {
        std::array::from_fn(|k| self.found[k].span.is_none() || self.rows[k].is_some())
    }
}
