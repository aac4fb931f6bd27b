//! Computation modulo random primes where no proof is requested: factors and zeros.

use super::limits::Limits;
use super::ranks::{RankSample, Reach};
use crate::images::{Image, Images};
use crate::spectrum::{
    self, MOST_EXPANDED, Spectrum, SpectrumText, factor_text, factors, quotient_factors, with_leading_one,
};
use crate::zeros::{self, ZeroStructure};
use kardan_math::num::modular_polynomial::product;
use kardan_math::num::{ModularMatrix, Polynomial, Residue, reachable};
use kardan_results::Zeros;

/// Factors with their roots, invariant factors as text, and the smallest invariant factor.
pub(super) fn spectrum(images: &mut Images<'_>, [reached, observable]: &RankSample, limits: &Limits) -> SpectrumText {
    let first = &reached.image;
    let n = first.g.rows;
    let missed = |Reach { image, span, .. }: &Reach| {
        span.as_ref().map_or_else(Vec::new, |span| quotient_factors(&image.field, &image.g, span))
    };
    let lists = [factors(&first.field, &first.g), missed(reached), missed(observable)];
    let found = Spectrum::new(&first.field, lists);
    let (layout, limit) = (found.layout(), limits.primes);
    // Long polynomials are not brought back, but for the common factor, which is needed.
    let list_count = found.lists[0].len();
    let is_short = |k: usize, p: &[Residue]| p.len() <= MOST_EXPANDED + 1 || k == 0 && list_count > 1;
    let degrees: Vec<usize> = found.polynomials().map(|p| p.len() - 1).collect();
    let chosen: Vec<usize> = found.polynomials().enumerate().filter(|(k, p)| is_short(*k, p)).map(|(k, _)| k).collect();
    let modulo = |image: &Image| {
        let field = &image.field;
        let missed = |g: &ModularMatrix, b: &ModularMatrix| quotient_factors(field, g, &reachable(field, g, b).span);
        let lists = [
            factors(field, &image.g),
            if reached.rank == n { Vec::new() } else { missed(&image.g, &image.b) },
            if observable.rank == n { Vec::new() } else { missed(&image.g.transpose(), &image.c.transpose()) },
        ];
        let also = Spectrum::new(field, lists);
        let all: Vec<&Vec<Residue>> = also.polynomials().collect();
        let lower = |k: &usize| all[*k][..all[*k].len() - 1].iter().map(|&x| field.value(x));
        (also.layout() == layout).then(|| chosen.iter().flat_map(lower).collect::<Vec<u64>>())
    };
    let mut polynomials: Vec<Option<Polynomial>> = vec![None; degrees.len()];
    if !chosen.is_empty()
        && let Some(flat) = images.reconstruct(limit, modulo)
    {
        let mut rest = flat.into_iter();
        for k in chosen {
            polynomials[k] = Some(with_leading_one(rest.by_ref().take(degrees[k])));
        }
    }
    let pieces = polynomials.len() - found.pieces.len();
    let described =
        found.pieces.iter().zip(pieces..).map(|((pattern, _), k)| (pattern, polynomials[k].as_ref(), degrees[k]));
    SpectrumText {
        factors: spectrum::described(described),
        invariant_factors: (0..list_count).map(|k| factor_text(polynomials[k].as_ref(), degrees[k])).collect(),
        common: polynomials[0].clone(),
    }
}

/// Invariant zeros with multiplicity: roots of the product of the invariant polynomials of `[sE − A, −B; C, D]`.
pub(super) fn zeros(images: &mut Images<'_>, first: &Image, limits: &Limits) -> Zeros {
    let n = first.g.rows;
    let found = ZeroStructure::of(first);
    let degree = found.degree();
    let lower = match degree {
        0 => Some(Vec::new()),
        _ if degree > MOST_EXPANDED => None,
        _ => images.reconstruct(limits.primes, |image| {
            let (field, also) = (&image.field, ZeroStructure::of(image));
            let polynomial = also.factors.iter().fold(vec![field.one()], |all, f| product(field, &all, f));
            let same = also.rank == found.rank && also.degree() == degree;
            same.then(|| polynomial[..degree].iter().map(|&x| field.value(x)).collect())
        }),
    };
    zeros::described(found.rank, n, degree, lower.map(with_leading_one).as_ref())
}
