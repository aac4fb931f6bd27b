//! Distribution of the energies of a mode over the elements.

use faer::c64;

use super::shape::{root, row_dot};
use crate::ConstrainedSystem;
use kardan_math::num::{Rational, rational_to_f64};
use kardan_mechanics::assemble::DirectionalTerm;
use kardan_results::{ElementShare, EnergyKind, Mode, ShapePart, StoredShare};

/// The terms of a system by element and kind.
pub(super) struct Elements<'a> {
    inertias: Vec<Element<'a>>,
    springs: Vec<Element<'a>>,
    dampers: Vec<Element<'a>>,
}

impl<'a> Elements<'a> {
    pub fn new(system: &'a ConstrainedSystem) -> Self {
        let [inertias, springs, dampers] = [&system.inertias, &system.springs, &system.dampers].map(|t| by_element(t));
        Self { inertias, springs, dampers }
    }

    pub fn mode(&self, value: c64, vector: &[c64], shape: Vec<ShapePart>) -> Mode {
        let moving = value.norm() > 0.0;
        let speed = if moving { value.norm_sqr() } else { 1.0 };
        let kinetic = energies(&self.inertias, vector, 0.5 * speed);
        let potential = if moving { energies(&self.springs, vector, 0.5) } else { Vec::new() };
        let lost = if moving { energies(&self.dampers, vector, 1.0) } else { Vec::new() };
        let kinetic_count = kinetic.len();
        let stored = shares(kinetic.into_iter().chain(potential).collect()).into_iter().enumerate();
        let kind = |k: usize| if k < kinetic_count { EnergyKind::Kinetic } else { EnergyKind::Potential };
        Mode {
            shape,
            stored: stored
                .map(|(k, ElementShare { element, share })| StoredShare { element, energy: kind(k), share })
                .collect(),
            dissipated: shares(lost),
            ..root(value)
        }
    }
}

/// A coefficient and its direction.
pub(super) type WeightedRow = (f64, Vec<(usize, f64)>);

/// An element and its terms of one kind.
pub(super) type Element<'a> = (&'a str, Vec<WeightedRow>);

/// The terms of each element together, in the order in which the elements first appear.
pub(super) fn by_element(terms: &[DirectionalTerm<Rational>]) -> Vec<Element<'_>> {
    let mut places = std::collections::HashMap::new();
    let mut out: Vec<Element> = Vec::new();
    for term in terms {
        let place = *places.entry(term.element.as_str()).or_insert_with(|| {
            out.push((term.element.as_str(), Vec::new()));
            out.len() - 1
        });
        out[place].1.push((rational_to_f64(&term.value), term.row_f64()));
    }
    out
}

/// `factor Σ c |aᵀx|²` for each element.
pub(super) fn energies<'a>(elements: &[Element<'a>], x: &[c64], factor: f64) -> Vec<(&'a str, f64)> {
    let energy = |(value, row): &WeightedRow| value * row_dot(row, x).norm_sqr();
    elements.iter().map(|(name, terms)| (*name, factor * terms.iter().map(energy).sum::<f64>())).collect()
}

/// Parts of the sum; empty if there is none (negative coefficients can cancel others).
pub(super) fn shares(parts: Vec<(&str, f64)>) -> Vec<ElementShare> {
    let sum: f64 = parts.iter().map(|(_, part)| part).sum();
    let size: f64 = parts.iter().map(|(_, part)| part.abs()).sum();
    if !(sum.abs() > 1e-12 * size) {
        return Vec::new();
    }
    parts.into_iter().map(|(element, part)| ElementShare { element: element.to_string(), share: part / sum }).collect()
}
