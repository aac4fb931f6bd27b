//! The symbolic reduction in progress, and its result.

use std::collections::BTreeMap;

use super::elimination::{Assumed, Entry};
use super::terms::{Row, Terms};
use super::{Laurent, Letter, Letters};
use crate::reduce::Reduced;
use kardan_math::units::{Exact, Expression};

/// The form of a prescribed function.
#[derive(Debug, Clone)]
pub enum FunctionSource {
    /// A number.
    Exact(Exact),
    /// An expression of the time `t` and of parameters.
    Formula(Expression),
    /// In words: it names signals or tables, or events set it.
    Text(String),
}

/// A prescribed function.
#[derive(Debug, Clone)]
pub struct TimeFunction {
    /// How.
    pub source: FunctionSource,
    /// Whether it is the rate of the sum in the constraint.
    pub rate: bool,
}

/// A prescribed function and its rates, if they have formulas.
pub(super) type Formulas = [Option<Laurent>; 3];

/// A multiplier constraint over the reduced coordinates.
#[derive(Debug, Clone, Default)]
pub struct SymbolicMultiplier {
    /// The expression that is zero at all times, for a relation of positions.
    pub position: Option<Laurent>,
    /// A, by the number of the reduced coordinate; nonzero entries.
    pub row: BTreeMap<usize, Laurent>,
    /// The terms of `A q̇_r` and of `A q̈_r`.
    pub left: [Vec<Laurent>; 2],
    /// b, unless accelerations alone are prescribed.
    pub rate: Option<Laurent>,
    /// c = ḃ − Ȧ q̇_r
    pub acceleration: Laurent,
}

/// A letter and its definition.
#[derive(Debug, Clone)]
pub struct Definition {
    /// The letter.
    pub letter: Letter,
    /// Its definition.
    pub value: Laurent,
}

/// `H q̈_r + v(q, q̇) + D q̇_r + s(q) + friction + held = F u + Aᵀλ` \[diss. (4.18), (4.23), (6.114)\], each entry a sum of products of letters.
#[derive(Debug, Default)]
pub struct SymbolicMotion {
    /// The meanings of all letters.
    pub letters: Letters,
    /// Letters of curves and of frictions, each after those that it needs.
    pub definitions: Vec<Definition>,
    /// Angles of the dependent coordinates, by number, in the order of elimination.
    pub angles: Vec<(usize, Laurent)>,
    /// Their rates over those of the reduced coordinates.
    pub speeds: Vec<(usize, Laurent)>,
    /// Their accelerations, where they are not the same sums of accelerations.
    pub accelerations: Vec<(usize, Laurent)>,
    /// H on and below the diagonal, nonzero entries.
    pub inertia: BTreeMap<(usize, usize), Laurent>,
    /// v, quadratic in speeds; and the effects of speeds and accelerations of prescribed motions.
    pub velocity: Vec<Laurent>,
    /// D on and below the diagonal, nonzero entries.
    pub damping: BTreeMap<(usize, usize), Laurent>,
    /// s
    pub stiffness: Vec<Laurent>,
    /// Coulomb friction.
    pub friction: Vec<Laurent>,
    /// F u
    pub input: Vec<Laurent>,
    /// Torques of unilateral and switched laws.
    pub unilateral: Vec<Laurent>,
    /// The constraints enforced by their multipliers λ.
    pub multiplier_constraints: Vec<SymbolicMultiplier>,
    /// Aᵀλ
    pub multiplier_forces: Vec<Laurent>,
    /// The speed along a unilateral or switched law: its element, whether it is a gear loss, angle and speed.
    pub directions: Vec<(String, bool, [Laurent; 2])>,
    /// The multipliers of all other constraints, those of transmissions last.
    pub multipliers: Vec<Laurent>,
    /// Expressions that must not be zero.
    pub divisors: Vec<Laurent>,
    /// Expressions that are zero for the values of the model, and were treated as zero.
    pub zeros: Vec<Laurent>,
}

/// The expression of a coordinate.
#[derive(Debug, Clone, Default)]
pub(super) struct ResolvedCoordinate {
    /// Over the reduced coordinates.
    pub(super) basis: BTreeMap<usize, Laurent>,
    /// The speed that is prescribed.
    pub(super) drift: Laurent,
    pub(super) bias: Laurent,
    pub(super) angle: Laurent,
}

pub(super) struct Derivation<'a> {
    pub(super) reduced: &'a Reduced,
    pub(super) terms: Terms,
    pub(super) letters: Letters,
    pub(super) assumed: Assumed,
    pub(super) resolved: Vec<ResolvedCoordinate>,
    /// Angles at the start.
    pub(super) numbers: Vec<f64>,
    /// Of each transmission whether it was taken backwards, and its slope.
    pub(super) slopes: BTreeMap<usize, (bool, Entry)>,
    /// Prescribed functions, by element.
    pub(super) times: BTreeMap<String, Formulas>,
    /// Multiplier constraints over all coordinates.
    pub(super) multiplier_rows: Vec<Row>,
    pub(super) out: SymbolicMotion,
}
