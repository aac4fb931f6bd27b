//! Kinds of unilateral and switched constraints, and which are engaged.

use crate::friction::Mode;
use kardan_math::num::StateArchive;
use kardan_mechanics::assemble::{DirectionalTerm, Equations};
use kardan_mechanics::equations::{Domain, UnilateralConstraint};

/// The kind of a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    /// Friction, of a constant torque or one that an expression gives; the stick limit is a multiple of the sliding
    /// torque.
    Friction {
        at_rest: f64,
    },
    OneWay,
    Stop {
        offset: f64,
        restitution: f64,
    },
    Cushion {
        offset: f64,
        stiffness: f64,
        damping: f64,
    },
    Lock,
    /// Its bounds and its torque follow from the gear load.
    GearLoss,
}

/// Why a formula of a friction, gear loss or lock ends the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum InvalidBound {
    /// It has no value.
    Undefined,
    /// It is negative: it would drive.
    Negative,
}

/// The unilateral constraints of a machine, which are the directions from `first` on.
#[derive(Debug, Clone, Default)]
pub(crate) struct Unilaterals {
    pub(super) first: usize,
    pub(super) kinds: Vec<Kind>,
    /// Whether a stop is closed, or a lock engaged: then it is part of the convex problem. For others always true.
    pub(super) engaged: Vec<bool>,
    /// Units of the speeds in them.
    pub(super) units: Vec<&'static str>,
    /// Whether torques of friction are expressions.
    pub(super) changes: bool,
    pub(super) has_locks: bool,
    /// Whether speeds have jumped at the last event.
    pub(crate) struck: bool,
    /// Gears whose speed the last impact has changed.
    pub(crate) passed: Vec<usize>,
    /// Contacts that shared an impulse with restitution, and those whose restitution was left out.
    pub(super) shared: Vec<usize>,
    pub(super) dulled: Vec<usize>,
    /// Whether contacts rebound, as their restitution says.
    pub(crate) rebounds: bool,
}

impl Unilaterals {
    pub(super) fn new(equations: &Equations) -> Self {
        let kind = |unilateral: &UnilateralConstraint| match unilateral {
            UnilateralConstraint::Friction { at_rest, .. } => Kind::Friction { at_rest: at_rest.to_f64() },
            UnilateralConstraint::OneWay => Kind::OneWay,
            UnilateralConstraint::Stop { offset, restitution, .. } => {
                Kind::Stop { offset: offset.to_f64(), restitution: restitution.to_f64() }
            }
            UnilateralConstraint::Cushion { offset, stiffness, damping, .. } => {
                Kind::Cushion { offset: offset.to_f64(), stiffness: stiffness.to_f64(), damping: damping.to_f64() }
            }
            UnilateralConstraint::Lock { .. } => Kind::Lock,
            UnilateralConstraint::GearLoss(_) => Kind::GearLoss,
        };
        let unit = |unilateral: &DirectionalTerm<UnilateralConstraint>| {
            if equations.domain_of_unilateral(unilateral) == Domain::Translation { "m/s" } else { "rad/s" }
        };
        let kinds: Vec<Kind> = equations.unilaterals.iter().map(|unilateral| kind(&unilateral.value)).collect();
        Self {
            first: equations.frictions.len(),
            engaged: kinds.iter().map(|kind| !matches!(kind, Kind::Stop { .. } | Kind::Lock)).collect(),
            units: equations.unilaterals.iter().map(unit).collect(),
            changes: kinds.iter().any(|kind| matches!(kind, Kind::Friction { .. })),
            has_locks: kinds.contains(&Kind::Lock),
            kinds,
            rebounds: true,
            ..Self::default()
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }

    /// The kind of a direction.
    pub(super) fn kind(&self, direction: usize) -> Kind {
        direction.checked_sub(self.first).map_or(Kind::Friction { at_rest: 1.0 }, |unilateral| self.kinds[unilateral])
    }

    /// Whether a direction can come to rest or stay there.
    pub(super) fn takes_part(&self, direction: usize) -> bool {
        direction.checked_sub(self.first).is_none_or(|unilateral| self.engaged[unilateral])
    }

    /// Whether it is not part of the convex problem: its torque follows from the state.
    pub(super) fn only_presses(&self, direction: usize) -> bool {
        matches!(self.kind(direction), Kind::Cushion { .. })
    }

    /// Whether a direction that does not stick is in its mode as long as its speed keeps its sign.
    pub(super) fn slips(&self, direction: usize) -> bool {
        matches!(self.kind(direction), Kind::Friction { .. } | Kind::OneWay | Kind::GearLoss)
    }

    /// The event of a direction that has changed into a mode, as text; `None` where that was reported already.
    pub(super) fn describe_mode(&self, direction: usize, mode: Mode) -> Option<&'static str> {
        match (self.kind(direction), mode) {
            (Kind::Friction { .. } | Kind::GearLoss, Mode::Stick) => Some("sticks"),
            (Kind::Friction { .. } | Kind::GearLoss, Mode::Forward) => Some("slips forward"),
            (Kind::Friction { .. } | Kind::GearLoss, Mode::Backward) => Some("slips backward"),
            (Kind::OneWay, Mode::Stick) => Some("locks"),
            (Kind::OneWay, _) => Some("overruns"),
            (Kind::Stop { .. }, Mode::Stick) => Some("is in resting contact"),
            (Kind::Stop { .. }, _) => Some("is left"),
            (Kind::Cushion { .. } | Kind::Lock, _) => None,
        }
    }

    /// The bounds of all directions: of frictions, of unilateral constraints, and of the multiplier constraints, which
    /// have none.
    pub(super) fn bounds(&self, frictions: &[f64], multiplier_count: usize) -> [Vec<f64>; 2] {
        let of = |kind: &Kind| match kind {
            Kind::Friction { .. } | Kind::Cushion { .. } | Kind::GearLoss => [0.0, 0.0],
            Kind::OneWay | Kind::Stop { .. } => [0.0, f64::INFINITY],
            Kind::Lock => [f64::INFINITY; 2],
        };
        [0, 1].map(|sense| {
            let unilaterals = self.kinds.iter().map(|kind| of(kind)[sense]);
            let multipliers = std::iter::repeat_n(f64::INFINITY, multiplier_count);
            frictions[..self.first].iter().copied().chain(unilaterals).chain(multipliers).collect()
        })
    }

    pub(super) fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        self.engaged.iter_mut().for_each(|engaged| archive.flag(engaged));
    }
}

/// The contacts that have closed.
pub(super) struct RestEvents {
    /// Directions that come to rest.
    pub crossing: Vec<usize>,
    /// All that are at rest, where speeds have jumped.
    pub resting: Option<Vec<usize>>,
}
