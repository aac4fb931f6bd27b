//! The terms of a drivetrain or a circuit: scalar laws along directions. Data only.
//!
//! Everything in a drivetrain acts along a *direction*, a row `a` of coefficients over the shaft angles `q`
//! (see ARCHITECTURE.md, "one idea"). An element is only a few [`Term`]s; assembly, reduction,
//! simulation, identification and structure analysis read these terms and do not depend on the kind of element.

mod domain;
mod formula;
mod multiplier_law;

use std::fmt;
use std::sync::Arc;

pub use domain::Domain;
pub use formula::{Formula, FormulaRow, Meaning};
use kardan_expr::expr::{Expr, Graph, OfTime};
use kardan_math::units::Exact;
pub use multiplier_law::MultiplierLaw;

/// The node at which potentials are zero; it needs no balance, for that follows from those of all other nodes.
pub const GROUND: &str = "ground";

/// A row of coefficients over the coordinates (shaft angles, charges); those not named have the coefficient zero.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Direction {
    /// Name of the coordinate and coefficient; at most one entry for each.
    pub entries: Vec<(String, Exact)>,
}

impl Direction {
    /// The angle of one shaft, or one charge.
    pub fn shaft(name: &str) -> Self {
        Self { entries: vec![(name.to_string(), Exact::one())] }
    }

    /// The difference of two shaft angles, `first − second`; of one to ground if there is no second.
    pub fn difference(first: &str, second: Option<&str>) -> Self {
        let mut out = Self::shaft(first);
        if let Some(second) = second {
            out.entries.push((second.to_string(), Exact::from_integer(-1)));
        }
        out
    }
}

/// A nonlinear holonomic transmission `driven = γ(driving)` with its derivatives in closed form.
///
/// The constraint is `c(q) = q_driven − γ(q_driving) = 0`, its Jacobian row has 1 and `−γ′`, its acceleration term is
/// `j = −γ″·q̇²` \[diss. (4.6)-(4.9)\].
pub trait Curve: fmt::Debug + Send + Sync {
    /// γ(x), rad.
    fn value(&self, x: f64) -> f64;
    /// γ′(x) and γ″(x) (1/rad).
    fn derivatives(&self, x: f64) -> (f64, f64);
    /// γ, γ′ and γ″ at x as expressions.
    fn expressions(&self, graph: &mut Graph, x: Expr) -> [Expr; 3];
    /// The curve of the opposite direction, `driving = γ⁻¹(driven)`; none if it has no closed form: then the driving end must come first.
    fn inverse(&self) -> Option<Arc<dyn Curve>> {
        None
    }
    /// The constant offset `γ(x) − x` if the curve is exactly a shifted identity, which is treated as linear.
    fn shifted_identity(&self) -> Option<f64> {
        None
    }
    /// Whether its derivatives are the same half a turn later.
    fn repeats_each_half_turn(&self) -> bool {
        false
    }
    /// The curve in formulas, where its values have names; without, equations in symbols call it γ.
    fn formulas(&self) -> Option<CurveFormulas> {
        None
    }
}

/// A curve in formulas as a model file has them, over `x`, values of its element and letters.
#[derive(Debug, Clone)]
pub struct CurveFormulas {
    /// Values by the names that they have in the formulas.
    pub values: Vec<(&'static str, Exact)>,
    /// Letters, each in terms of the earlier ones.
    pub letters: Vec<(&'static str, String)>,
    /// γ, γ′ and γ″ at x.
    pub curve: [String; 3],
}

/// The limits of the torque of an input.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Motor {
    /// Largest torque either way, N m.
    pub torque_limit: Option<Exact>,
    /// Largest change of the torque, N m/s.
    pub rate_limit: Option<Exact>,
    /// Time constant of the first-order lag, s.
    pub lag: Option<Exact>,
    /// Torque on the shaft in addition to the torque that the drive reports.
    pub ripple: Option<Box<Ripple>>,
}

/// A torque that a motor adds: `torque · sin(order · angle)` of its shaft against its stator.
#[derive(Debug, Clone, PartialEq)]
pub struct Ripple {
    /// Amplitude, N m.
    pub torque: Exact,
    /// Periods per turn.
    pub order: Exact,
}

/// How friction falls when motion begins: the torque of sliding is `c + (c_b − c) exp(−(v/v_s)²)`, at rest up to `c_b` either way.
#[derive(Debug, Clone, PartialEq)]
pub struct Stribeck<V = Exact> {
    /// c_b, N m, not below c.
    pub breakaway: V,
    /// v_s, rad/s, above zero.
    pub speed: V,
}

/// A unilateral or switched law along a direction a, with contact states of its own.
#[derive(Debug, Clone, PartialEq)]
pub enum UnilateralConstraint {
    /// Coulomb friction with a torque given by an expression; at rest it sticks up to that torque times a factor.
    Friction {
        /// N m, not negative.
        torque: Arc<Formula>,
        /// At least one.
        at_rest: Exact,
    },
    /// aᵀq̇ ≥ 0.
    OneWay,
    /// aᵀq ≥ offset, rigid: an impact reverses the speed with a restitution factor.
    Stop {
        /// Whether a is the reversed direction of its element: then it is the stop at the upper end.
        upper: bool,
        /// rad
        offset: Exact,
        /// The restitution factor, 0 to 1.
        restitution: Exact,
    },
    /// aᵀq ≥ offset, compliant: penetration gives the repulsive force `s δ + d δ̇`, never an attractive one.
    Cushion {
        /// Whether a is the reversed direction of its element.
        upper: bool,
        /// rad
        offset: Exact,
        /// s, N m/rad.
        stiffness: Exact,
        /// d, N m s/rad.
        damping: Exact,
    },
    /// aᵀq̇ = 0 while an expression is above one half.
    Lock {
        /// The expression, without unit.
        engaged: Arc<Formula>,
    },
    /// Load-dependent gear friction: a part of the torque τ of the element's constraint on the first body of a opposes motion along a.
    GearLoss(GearLoss),
}

/// A gear loss: `κ |τ|` plus an expression.
#[derive(Debug, Clone, PartialEq)]
pub struct GearLoss {
    /// κ while the first body of the direction drives.
    pub forth: Exact,
    /// κ while it is driven; the mesh is self-locking if κ is at least one.
    pub back: Exact,
    /// N m, over the magnitudes of τ and of the speed along a; not negative.
    pub loss: Option<Arc<Formula>>,
}

impl UnilateralConstraint {
    /// Whether it acts along the reversed direction of its element.
    pub fn is_upper(&self) -> bool {
        matches!(self, Self::Stop { upper: true, .. } | Self::Cushion { upper: true, .. })
    }

    /// The expressions that its contact states depend on.
    pub fn formula(&self) -> Option<&Arc<Formula>> {
        match self {
            Self::Friction { torque: formula, .. } | Self::Lock { engaged: formula } => Some(formula),
            Self::GearLoss(gear) => gear.loss.as_ref(),
            Self::OneWay | Self::Stop { .. } | Self::Cushion { .. } => None,
        }
    }

    /// The same, to be changed.
    pub fn formula_mut(&mut self) -> Option<&mut Arc<Formula>> {
        match self {
            Self::Friction { torque: formula, .. } | Self::Lock { engaged: formula } => Some(formula),
            Self::GearLoss(gear) => gear.loss.as_mut(),
            Self::OneWay | Self::Stop { .. } | Self::Cushion { .. } => None,
        }
    }
}

/// The purpose of an input.
#[derive(Debug, Clone, PartialEq)]
pub enum InputKind {
    /// A motor that a law or the scenario commands.
    Motor(Motor),
    /// A torque from outside that only the scenario sets.
    Disturbance,
}

impl InputKind {
    /// Whether its torque, or the rate of it, is limited.
    pub fn limited(&self) -> bool {
        matches!(self, Self::Motor(motor) if motor.torque_limit.is_some() || motor.rate_limit.is_some())
    }
}

/// The quantity of a sensor.
#[derive(Debug, Clone, PartialEq)]
pub enum Measured {
    /// The angle of a shaft.
    Angle(String),
    /// The speed of a shaft.
    Speed(String),
    /// The torque of a spring (of its twist), by element.
    SpringTorque(String),
    /// The constraint torque of an element on one of its shafts.
    ConstraintTorque(String, String),
    /// The torque of the springs and dampers of a compliant element on one of its shafts.
    ComplianceTorque(String, String),
    /// The net torque on a shaft: its own inertia times its acceleration.
    NetTorque(String),
    /// A signal, by its name: the output of a block, or a function of time.
    Signal(String),
}

/// A sensor: its quantity and resolution.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// The quantity.
    pub measured: Measured,
    /// Smallest step of the reading in SI units: of the angle (rad), for a torque of the twist, of the signal.
    pub resolution: Option<f64>,
    /// Phase of the sensor within a step at zero, 0 to 1: the reading is `step·⌊x/step + phase⌋`.
    pub phase: f64,
    /// Time between two readings, s; zero-order hold between them.
    pub sample_time: Option<Exact>,
    /// Standard deviation of the noise added to each reading before rounding, SI.
    pub noise: Option<f64>,
}

/// A scalar law along a direction.
#[derive(Debug, Clone)]
pub enum Term {
    /// ½ J (aᵀq̇)²; J in kg m².
    Inertia {
        /// a
        direction: Direction,
        /// J
        inertia: Exact,
    },
    /// ½ s (aᵀq − rest)²; s in N m/rad.
    Spring {
        /// a
        direction: Direction,
        /// s
        stiffness: Exact,
        /// Angle at which the spring is relaxed, rad.
        rest: Exact,
    },
    /// ½ d (aᵀq̇)²; d in N m s/rad.
    Damper {
        /// a
        direction: Direction,
        /// d
        damping: Exact,
    },
    /// Coulomb friction, c·|aᵀq̇|, set-valued at rest; c in N m. With `stribeck` it falls from the breakaway torque to c as the
    /// motion gets faster.
    Friction {
        /// a
        direction: Direction,
        /// c
        torque: Exact,
        /// The breakaway torque, and its decay.
        stribeck: Option<Stribeck>,
    },
    /// A unilateral or switched law along a.
    UnilateralConstraint {
        /// a
        direction: Direction,
        /// How.
        unilateral: UnilateralConstraint,
    },
    /// aᵀq = offset.
    Constraint {
        /// a
        direction: Direction,
        /// rad
        offset: Exact,
    },
    /// The right-hand side of the constraint of this element is this function of the time: a rheonomic row, whose `offset` is its value at
    /// time zero.
    Moving(Arc<OfTime>),
    /// A constraint that a run enforces by its multiplier.
    MultiplierLaw(MultiplierLaw<String>),
    /// aᵀq = offset but for the twist θ = (offset − aᵀq)/scale, which the torque s θ + d θ̇ resists: a spring (and a damper) in
    /// place of a constraint, along the same direction. Its torque over the scale corresponds to the multiplier of the constraint.
    Compliance {
        /// a
        direction: Direction,
        /// rad
        offset: Exact,
        /// Twist along a for one of θ; above zero.
        scale: Exact,
        /// s, N m/rad.
        stiffness: Exact,
        /// d, N m s/rad; none if zero.
        damping: Exact,
    },
    /// q_driven = γ(q_driving).
    Transmission {
        /// y
        driven: String,
        /// x
        driving: String,
        /// γ
        curve: Arc<dyn Curve>,
    },
    /// A torque along a.
    Input {
        /// a
        direction: Direction,
        /// Motor or disturbance.
        kind: InputKind,
    },
    /// A torque along a that an expression gives.
    Torque {
        /// a
        direction: Direction,
        /// N m.
        law: Arc<Formula>,
    },
    /// A measured quantity.
    Output(Sensor),
    /// Declares a coordinate: one that is no angle, or an angle that is not a shaft of the file.
    Coordinate {
        /// Its name.
        name: String,
        /// Its kind.
        domain: Domain,
    },
    /// The quantity of the directions of this element, regardless of their coordinates: a row over shafts and masses is a length.
    Measure(Domain),
    /// A share in the constraint row of a node, `Σ aᵀq = 0`: the charge that has left it through one branch. The sum over
    /// all branches is Kirchhoff's current law; its multiplier is the potential of the node.
    Balance {
        /// The node; [`GROUND`] has no row.
        node: String,
        /// a
        direction: Direction,
    },
}

impl Term {
    /// The direction of its law.
    pub fn direction(&mut self) -> Option<&mut Direction> {
        match self {
            Self::Inertia { direction, .. }
            | Self::Spring { direction, .. }
            | Self::Damper { direction, .. }
            | Self::Friction { direction, .. }
            | Self::UnilateralConstraint { direction, .. }
            | Self::Constraint { direction, .. }
            | Self::Compliance { direction, .. }
            | Self::Input { direction, .. }
            | Self::Torque { direction, .. }
            | Self::Balance { direction, .. } => Some(direction),
            Self::Transmission { .. }
            | Self::Output(_)
            | Self::Coordinate { .. }
            | Self::Measure(_)
            | Self::Moving(_)
            | Self::MultiplierLaw(_) => None,
        }
    }

    /// The coordinates that it uses, without those that it declares.
    pub fn coordinates(&self) -> Vec<&str> {
        let names_of: fn(&Direction) -> Vec<&str> = |row| row.entries.iter().map(|(name, _)| name.as_str()).collect();
        match self {
            Self::Inertia { direction: row, .. }
            | Self::Spring { direction: row, .. }
            | Self::Damper { direction: row, .. }
            | Self::Friction { direction: row, .. }
            | Self::Constraint { direction: row, .. }
            | Self::Compliance { direction: row, .. }
            | Self::Input { direction: row, .. }
            | Self::Balance { direction: row, .. } => names_of(row),
            Self::UnilateralConstraint { direction: row, unilateral } => names_of(row)
                .into_iter()
                .chain(unilateral.formula().into_iter().flat_map(|formula| formula.coordinates()))
                .collect(),
            Self::Torque { direction: row, law } => names_of(row).into_iter().chain(law.coordinates()).collect(),
            Self::Transmission { driven, driving, .. } => vec![driven, driving],
            Self::Output(sensor) => match &sensor.measured {
                Measured::Angle(shaft) | Measured::Speed(shaft) | Measured::NetTorque(shaft) => vec![shaft],
                Measured::ConstraintTorque(_, shaft) | Measured::ComplianceTorque(_, shaft) => vec![shaft],
                Measured::SpringTorque(_) | Measured::Signal(_) => Vec::new(),
            },
            Self::MultiplierLaw(row) => row.coordinates(),
            Self::Coordinate { .. } | Self::Measure(_) | Self::Moving(_) => Vec::new(),
        }
    }

    /// Removes [`GROUND`] from its direction: it does not move.
    pub fn leave_ground(&mut self) {
        if let Self::MultiplierLaw(MultiplierLaw::Prescribed { row, .. }) = self {
            row.retain(|(name, _)| name != GROUND);
        }
        if let Self::Torque { law, .. } = self
            && law.coordinates().any(|name| name == GROUND)
        {
            // A later term of the element replaces it.
            let is_ground =
                |meaning: &Meaning| matches!(meaning, Meaning::Position(name) | Meaning::Rate(name) if name == GROUND);
            Arc::make_mut(law).names.retain(|(_, meaning)| !is_ground(meaning));
        }
        if let Some(direction) = self.direction() {
            direction.entries.retain(|(name, _)| name != GROUND);
        }
    }
}

/// A term with the name of the element it belongs to.
#[derive(Debug, Clone)]
pub struct NamedTerm {
    /// Element name in the model file.
    pub element: String,
    /// The law.
    pub term: Term,
}
