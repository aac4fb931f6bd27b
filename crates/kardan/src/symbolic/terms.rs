//! The terms of a model over numbered coordinates, in the names of their values.

use std::collections::BTreeMap;

use super::elimination::Entry;
use super::{Laurent, Letters};
use crate::equations::{Direction, GROUND, NamedTerm, Stribeck, Term};
use crate::num::{Rational, Scalar};
use crate::units::Exact;

/// A row over numbered coordinates.
pub(super) type Row = Vec<(usize, Laurent)>;

/// A law along a direction.
#[derive(Debug, Clone)]
pub(super) struct Along<T> {
    pub(super) element: String,
    pub(super) row: Row,
    pub(super) value: T,
}

/// A spring: stiffness, and where it is relaxed.
#[derive(Debug, Clone)]
pub(super) struct Spring {
    pub(super) stiffness: Laurent,
    pub(super) rest: Laurent,
}

/// A friction: its torque in motion, and what holds at rest and its speed where it falls.
#[derive(Debug, Clone)]
pub(super) struct Friction {
    pub(super) torque: Laurent,
    pub(super) stribeck: Option<[Laurent; 2]>,
}

/// A linear constraint: its entries with their numbers, and its right side.
#[derive(Debug, Clone)]
pub(super) struct Constraint {
    pub(super) entries: BTreeMap<usize, Entry>,
    pub(super) offset: Laurent,
}

/// All terms, by kind; constraints in the order of the assembled ones.
#[derive(Debug, Default)]
pub(super) struct Terms {
    pub(super) inertias: Vec<Along<Laurent>>,
    pub(super) dampers: Vec<Along<Laurent>>,
    pub(super) springs: Vec<Along<Spring>>,
    pub(super) frictions: Vec<Along<Friction>>,
    pub(super) inputs: Vec<Along<()>>,
    pub(super) constraints: Vec<Constraint>,
}

impl Terms {
    /// Of the terms of a model whose coordinates are sorted by name.
    pub(super) fn new(coordinates: &[String], terms: &[NamedTerm], letters: &mut Letters) -> Self {
        let mut sorted: Vec<&NamedTerm> = terms.iter().collect();
        sorted.sort_by(|a, b| a.element.cmp(&b.element));
        let mut out = Self::default();
        let mut balances: BTreeMap<&str, BTreeMap<usize, Entry>> = BTreeMap::new();
        for NamedTerm { element, term } in sorted {
            let numbered = |letters: &mut Letters, along: &Direction| entries(coordinates, along, letters);
            match term {
                Term::Inertia { along, inertia } => {
                    let row = row(numbered(letters, along));
                    out.inertias.push(Along { element: element.clone(), row, value: letters.exact(inertia) });
                }
                Term::Damper { along, damping } => {
                    let row = row(numbered(letters, along));
                    out.dampers.push(Along { element: element.clone(), row, value: letters.exact(damping) });
                }
                Term::Spring { along, stiffness, rest } => {
                    let value = Spring { stiffness: letters.exact(stiffness), rest: letters.exact(rest) };
                    out.springs.push(Along { element: element.clone(), row: row(numbered(letters, along)), value });
                }
                Term::Friction { along, torque, stribeck } => {
                    let falls =
                        |Stribeck { breakaway, speed }: &Stribeck| [letters.exact(breakaway), letters.exact(speed)];
                    let stribeck = stribeck.as_ref().map(falls);
                    let value = Friction { torque: letters.exact(torque), stribeck };
                    out.frictions.push(Along { element: element.clone(), row: row(numbered(letters, along)), value });
                }
                Term::Constraint { along, offset } => {
                    let entries = numbered(letters, along);
                    out.constraints.push(Constraint { entries, offset: letters.exact(offset) });
                }
                Term::Compliance { along, offset, scale, stiffness, damping } => {
                    let turned = -&scale.recip().unwrap_or_else(Exact::one);
                    let shares = along.entries.iter().map(|(name, x)| (name.clone(), x * &turned)).collect();
                    let row = row(numbered(letters, &Direction { entries: shares }));
                    let value =
                        Spring { stiffness: letters.exact(stiffness), rest: letters.exact(&(offset * &turned)) };
                    if !damping.is_zero() {
                        let value = letters.exact(damping);
                        out.dampers.push(Along { element: element.clone(), row: row.clone(), value });
                    }
                    out.springs.push(Along { element: element.clone(), row, value });
                }
                Term::Input { along, .. } | Term::Torque { along, .. } => {
                    out.inputs.push(Along { element: element.clone(), row: row(numbered(letters, along)), value: () });
                }
                Term::Balance { node, along } if node != GROUND => {
                    let shares = balances.entry(node).or_default();
                    for (coordinate, entry) in numbered(letters, along) {
                        let sum = shares.entry(coordinate).or_default();
                        *sum = Entry { symbol: sum.symbol.plus(&entry.symbol), number: sum.number.plus(&entry.number) };
                    }
                }
                Term::Balance { .. }
                | Term::Transmission { .. }
                | Term::Hold { .. }
                | Term::Output(_)
                | Term::Angle { .. }
                | Term::Position { .. }
                | Term::Measure(_)
                | Term::Moving(_)
                | Term::Kept(_)
                | Term::Charge { .. } => {}
            }
        }
        for mut entries in balances.into_values() {
            entries.retain(|_, entry| !Scalar::is_zero(&entry.number));
            if !entries.is_empty() {
                out.constraints.push(Constraint { entries, offset: Laurent::default() });
            }
        }
        out
    }
}

fn entries(coordinates: &[String], along: &Direction, letters: &mut Letters) -> BTreeMap<usize, Entry> {
    let entry = |(name, x): &(String, Exact)| {
        let coordinate = coordinates.iter().position(|other| other == name)?;
        let (symbol, number) = (letters.exact(x), x.to_rational());
        (!Scalar::is_zero(&number)).then_some((coordinate, Entry { symbol, number }))
    };
    along.entries.iter().filter_map(entry).collect()
}

fn row(entries: BTreeMap<usize, Entry>) -> Row {
    entries.into_iter().map(|(coordinate, entry): (usize, Entry)| (coordinate, entry.symbol)).collect()
}

/// An exact number and how it is written.
pub(super) fn ratio(value: f64) -> Rational {
    crate::num::rational_from_f64(value).unwrap_or(Rational::ZERO)
}
