//! The terms of a model over numbered coordinates, in the names of their values.

use std::collections::{BTreeMap, BTreeSet};

use super::elimination::Entry;
use super::{Laurent, Letters, Symbol};
use crate::assemble::by_element;
use crate::equations::{
    Direction, Formula, GROUND, Meaning, MultiplierLaw, NamedTerm, Stribeck, Term, UnilateralConstraint,
};
use kardan_math::num::{Rational, Scalar};
use kardan_math::units::Exact;

/// A row over numbered coordinates.
pub(super) type Row = Vec<(usize, Laurent)>;

/// A law along a direction.
pub(super) type DirectionalTerm<T> = crate::assemble::DirectionalTerm<T, Laurent>;
/// A spring.
pub(super) type Spring = crate::assemble::SpringLaw<Laurent>;
/// A friction.
pub(super) type Friction = crate::assemble::FrictionLaw<Laurent>;

/// A linear constraint: its entries with their numbers, and its right side.
#[derive(Debug, Clone)]
pub(super) struct Constraint {
    pub(super) entries: BTreeMap<usize, Entry>,
    pub(super) offset: Laurent,
}

/// The equation of a multiplier constraint.
#[derive(Debug, Clone)]
pub(super) enum SymbolicMultiplierLaw {
    /// `Σ a_i q̇_i = 0`
    Rates(Row),
    /// φ = 0
    Surface(Laurent),
    /// The sum of speeds (order 1) or accelerations (2) is prescribed.
    Prescribed(Row, usize),
}

/// All terms, by kind; constraints in the order of the assembled ones.
#[derive(Debug, Default)]
pub(super) struct Terms {
    pub(super) inertias: Vec<DirectionalTerm<Laurent>>,
    pub(super) dampers: Vec<DirectionalTerm<Laurent>>,
    pub(super) springs: Vec<DirectionalTerm<Spring>>,
    pub(super) frictions: Vec<DirectionalTerm<Friction>>,
    pub(super) inputs: Vec<DirectionalTerm<()>>,
    pub(super) constraints: Vec<Constraint>,
    /// By element.
    pub(super) multiplier_constraints: Vec<(String, SymbolicMultiplierLaw)>,
    /// Unilateral and switched laws, each torque once: its row, and whether it is a gear loss.
    pub(super) unilaterals: Vec<DirectionalTerm<bool>>,
}

impl Terms {
    /// Of the terms of a model whose coordinates are sorted by name.
    pub(super) fn new(coordinates: &[String], terms: &[NamedTerm], letters: &mut Letters) -> Self {
        let moves = |one: &&NamedTerm| matches!(one.term, Term::Moving(_));
        let moving: BTreeSet<&str> = terms.iter().filter(moves).map(|one| one.element.as_str()).collect();
        let mut out = Self::default();
        let mut balances: BTreeMap<&str, BTreeMap<usize, Entry>> = BTreeMap::new();
        for (element, term) in by_element(terms).into_iter().map(|named| (named.element.clone(), &named.term)) {
            let numbered = |letters: &mut Letters, direction: &Direction| entries(coordinates, direction, letters);
            match term {
                Term::Inertia { direction, inertia } => {
                    let (row, value) = (row(numbered(letters, direction)), letters.exact(inertia));
                    out.inertias.push(DirectionalTerm { element, row, value });
                }
                Term::Damper { direction, damping } => {
                    let (row, value) = (row(numbered(letters, direction)), letters.exact(damping));
                    out.dampers.push(DirectionalTerm { element, row, value });
                }
                Term::Spring { direction, stiffness, rest } => {
                    let value = Spring { stiffness: letters.exact(stiffness), rest: letters.exact(rest) };
                    out.springs.push(DirectionalTerm { element, row: row(numbered(letters, direction)), value });
                }
                Term::Friction { direction, torque, stribeck } => {
                    let stribeck = stribeck.as_ref().map(|Stribeck { breakaway, speed }| {
                        let [breakaway, speed] = [breakaway, speed].map(|x| letters.exact(x));
                        Stribeck { breakaway, speed }
                    });
                    let value = Friction { torque: letters.exact(torque), stribeck };
                    out.frictions.push(DirectionalTerm { element, row: row(numbered(letters, direction)), value });
                }
                Term::Constraint { direction, offset } => {
                    let entries = numbered(letters, direction);
                    let offset = match moving.contains(element.as_str()) {
                        true => letters.of(Symbol::OfTime(element, 0)),
                        false => letters.exact(offset),
                    };
                    out.constraints.push(Constraint { entries, offset });
                }
                Term::Compliance { direction, offset, scale, stiffness, damping } => {
                    let negated = -&scale.recip().unwrap_or_else(Exact::one);
                    let shares = direction.entries.iter().map(|(name, x)| (name.clone(), x * &negated)).collect();
                    let row = row(numbered(letters, &Direction { entries: shares }));
                    let rest = letters.exact(&(offset * &negated));
                    let spring = Spring { stiffness: letters.exact(stiffness), rest };
                    let damping = (!damping.is_zero()).then(|| letters.exact(damping));
                    out.comply(element, row, spring, damping);
                }
                Term::Input { direction, .. } | Term::Torque { direction, .. } => {
                    out.inputs.push(DirectionalTerm { element, row: row(numbered(letters, direction)), value: () });
                }
                Term::Balance { node, direction } if node != GROUND => {
                    let shares = balances.entry(node).or_default();
                    for (coordinate, entry) in numbered(letters, direction) {
                        let sum = shares.entry(coordinate).or_default();
                        *sum = Entry { symbol: sum.symbol.plus(&entry.symbol), number: sum.number.plus(&entry.number) };
                    }
                }
                Term::MultiplierLaw(law) => {
                    out.multiplier_constraints.push((element, multiplier_law(coordinates, law, letters)))
                }
                Term::UnilateralConstraint { direction, unilateral } => {
                    let row = row(numbered(letters, direction));
                    out.unilateral(element, row, unilateral);
                }
                Term::Balance { .. }
                | Term::Transmission { .. }
                | Term::Output(_)
                | Term::Coordinate { .. }
                | Term::Measure(_)
                | Term::Moving(_) => {}
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

impl Terms {
    /// Unilateral and switched laws; both sides of a stop are one torque.
    fn unilateral(&mut self, element: String, mut row: Row, unilateral: &UnilateralConstraint) {
        let is_loss = matches!(unilateral, UnilateralConstraint::GearLoss(_));
        if self.unilaterals.iter().all(|candidate| candidate.element != element || candidate.value != is_loss) {
            let sign = Rational::from(if unilateral.is_upper() { -1 } else { 1 });
            row.iter_mut().for_each(|(_, entry)| *entry = entry.scaled(&sign));
            self.unilaterals.push(DirectionalTerm { element, row, value: is_loss });
        }
    }

    /// A spring, and a damper where it is one, in the place of a constraint.
    fn comply(&mut self, element: String, row: Row, spring: Spring, damping: Option<Laurent>) {
        if let Some(value) = damping {
            self.dampers.push(DirectionalTerm { element: element.clone(), row: row.clone(), value });
        }
        self.springs.push(DirectionalTerm { element, row, value: spring });
    }
}

/// A multiplier constraint over numbered coordinates; expressions with tables have no letters.
fn multiplier_law(coordinates: &[String], law: &MultiplierLaw<String>, letters: &mut Letters) -> SymbolicMultiplierLaw {
    let number = |name: &str| coordinates.iter().position(|other| other == name);
    let mut formula = |formula: &Formula| {
        let mut names: BTreeMap<&str, Laurent> = BTreeMap::new();
        for (name, meaning) in &formula.names {
            if let Meaning::Position(body) = meaning
                && let Some(coordinate) = number(body)
            {
                names.insert(name, letters.of(Symbol::Position(coordinate)));
            }
        }
        letters.read(&formula.expression.root, &names)
    };
    match law {
        MultiplierLaw::Surface(surface) => SymbolicMultiplierLaw::Surface(formula(surface)),
        MultiplierLaw::Rates(row) => {
            let row = row.iter().filter_map(|(name, a)| Some((number(name)?, formula(a))));
            SymbolicMultiplierLaw::Rates(row.filter(|(_, entry)| !entry.is_zero()).collect())
        }
        // No element creates a sum of positions: it is a constraint that the reduction enforces by a multiplier.
        MultiplierLaw::Prescribed { row, order, .. } => {
            let direction = Direction { entries: row.clone() };
            SymbolicMultiplierLaw::Prescribed(self::row(entries(coordinates, &direction, letters)), *order)
        }
    }
}

fn entries(coordinates: &[String], direction: &Direction, letters: &mut Letters) -> BTreeMap<usize, Entry> {
    let entry = |(name, x): &(String, Exact)| {
        let coordinate = coordinates.iter().position(|candidate| candidate == name)?;
        let (symbol, number) = (letters.exact(x), x.to_rational());
        (!Scalar::is_zero(&number)).then_some((coordinate, Entry { symbol, number }))
    };
    direction.entries.iter().filter_map(entry).collect()
}

fn row(entries: BTreeMap<usize, Entry>) -> Row {
    entries.into_iter().map(|(coordinate, entry): (usize, Entry)| (coordinate, entry.symbol)).collect()
}

/// An exact number and how it is written.
pub(super) fn ratio(value: f64) -> Rational {
    kardan_math::num::rational_from_f64(value).unwrap_or(Rational::ZERO)
}
