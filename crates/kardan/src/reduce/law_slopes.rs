//! Torques that expressions give, around a position at rest.

use super::{Kinematics, Motion, Reduced, Step, kinematics, pressed_cushions};
use crate::assemble::{Along, Equations, RestTorque};
use crate::equations::Hold;
use crate::expr::{Expr, Floating, Interval, Intervals, Rationals, Style, Surd, Surds, Symbol, lower, printed};
use crate::num::{LastDigits, Rational, SparseRow, rational_from_f64, rational_to_f64};

/// A torque that an expression gives, or the multiplier of a row that turns, around a position at rest and at time zero:
/// `τ = τ₀ + gᵀ Δq + hᵀ q̇` over all coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct LawSlopes {
    /// The element.
    pub element: String,
    /// The direction along which it acts.
    pub row: SparseRow,
    /// τ₀, N m.
    pub value: f64,
    /// g, N m/rad.
    pub on_positions: SparseRow,
    /// h, N m s/rad.
    pub on_rates: SparseRow,
    /// Whether an entry is no fraction, as far as is known, and was rounded once.
    pub rounded: bool,
    /// By how much rounding may move each entry of g, and of h.
    pub off: [Vec<f64>; 2],
    /// Why it has no derivative here, in words: what vanishes where the expression bends or jumps (the entries are then those of one side), or
    /// that it or its slope is no number.
    pub kinks: Vec<String>,
}

impl LawSlopes {
    /// Moves rounded entries within what rounding leaves open.
    pub fn move_within(&mut self, digits: &mut LastDigits) {
        for (row, off) in [&mut self.on_positions, &mut self.on_rates].into_iter().zip(&self.off) {
            for ((_, slope), off) in row.iter_mut().zip(off) {
                *slope = if *off > 0.0 { digits.within(slope, *off) } else { digits.near(slope) };
            }
        }
    }
}

/// What a transmission under load adds to the stiffness: a row over the coordinates, and the stiffness along it (N m/rad).
#[derive(Debug, Clone, PartialEq)]
pub struct GeometricStiffness {
    /// The transmission.
    pub element: String,
    /// The row.
    pub row: SparseRow,
    /// N m/rad
    pub stiffness: Rational,
}

/// Where a model is looked at: at rest, and, where that is known, held there.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OperatingPoint {
    /// The reduced position, rad or m.
    pub position: Vec<f64>,
    /// Rates of the reduced coordinates: zero, but for the currents of charges that only count what has flowed, A.
    pub rates: Vec<f64>,
    /// The constant torque of each input that holds it there, N m; `None`: springs are taken as relaxed there.
    pub torques: Option<Vec<f64>>,
}

impl OperatingPoint {
    /// A position with relaxed springs.
    pub fn relaxed(position: &[f64]) -> Self {
        Self { position: position.to_vec(), rates: vec![0.0; position.len()], torques: None }
    }

    /// All coordinates at zero, springs relaxed.
    pub fn zero(reduced: &Reduced) -> Self {
        Self::relaxed(&vec![0.0; reduced.degrees_of_freedom()])
    }
}

/// The stiffness that springs, laws and holding torques make along transmissions whose ratio depends on the angle: `−μ γ″` along the driving
/// side, with μ the torque that acts on the driven one; `laws` are the slopes of the laws there. There is none where no law is and nothing is
/// held: springs are then taken as relaxed.
///
/// # Panics
/// If the position has not one entry per coordinate.
pub fn geometric_stiffness(reduced: &Reduced, point: &OperatingPoint, laws: &[LawSlopes]) -> Vec<GeometricStiffness> {
    let (equations, position) = (&reduced.equations, &point.position);
    if equations.transmissions.is_empty() || laws.is_empty() && point.torques.is_none() {
        return Vec::new();
    }
    let mut numeric = Kinematics::new(reduced);
    numeric.update(position, &vec![0.0; reduced.degrees_of_freedom()]);
    let mut forces = vec![0.0; equations.coordinates.len()];
    let mut act = |row: &[(usize, f64)], torque: f64| row.iter().for_each(|(k, x)| forces[*k] += x * torque);
    for slopes in laws {
        slopes.row.iter().for_each(|(k, x)| act(&[(*k, rational_to_f64(x))], slopes.value));
    }
    for (input, torque) in equations.inputs.iter().zip(point.torques.iter().flatten()) {
        act(&input.row_f64(), *torque);
    }
    for spring in &equations.springs {
        let row = spring.row_f64();
        let twist = row.iter().map(|(k, x)| x * numeric.angles[*k]).sum::<f64>() - spring.value.rest.to_f64();
        act(&row, -spring.value.stiffness.to_f64() * twist);
    }
    for one in pressed_cushions(reduced, position) {
        let hold = &equations.holds[one.hold];
        if let Hold::Cushion { stiffness, .. } = &hold.value {
            act(&hold.row_f64(), -stiffness.to_f64() * one.gap);
        }
    }
    let mut out = Vec::new();
    for step in reduced.steps.iter().rev() {
        let torque = forces[step.shaft()];
        let (Step::Linear { value: affine, .. } | Step::Curve { argument: affine, .. }) = step;
        let entries: Vec<(usize, f64)> = affine.terms.iter().map(|(k, c)| (*k, rational_to_f64(c))).collect();
        let slope = match step {
            Step::Linear { .. } => 1.0,
            Step::Curve { curve, shaft, .. } => {
                let x = affine.constant + entries.iter().map(|(k, c)| c * numeric.angles[*k]).sum::<f64>();
                let (slope, curvature) = curve.derivatives(x);
                let stiffness = rational_from_f64(-torque * curvature).unwrap_or(Rational::ZERO);
                let own = equations.transmissions.iter().find(|t| t.driven == *shaft || t.driving == *shaft);
                if !stiffness.is_zero() {
                    let element = own.map(|t| t.element.clone()).unwrap_or_default();
                    out.push(GeometricStiffness { element, row: affine.terms.clone(), stiffness });
                }
                slope
            }
        };
        entries.iter().for_each(|(k, c)| forces[*k] += c * slope * torque);
    }
    out
}

/// Whether a law is the same linear function of angles and speeds at every position and time, zero where these are; exact.
pub fn is_linear_law(reduced: &Reduced, law: usize) -> bool {
    let formula = &reduced.equations.laws[law].value;
    if formula.is_of_time() {
        return false;
    }
    let free = unconstrained(reduced);
    let mut motion = Motion::free(&free);
    let torque = motion.formula(&free, formula);
    let at_zero = lower(&motion.graph, &[torque], &mut Rationals, |_| Some(Rational::ZERO));
    motion.graph.affine()(torque) && at_zero[0].as_ref().is_some_and(Rational::is_zero)
}

/// Whether all laws are linear: small motions are then all motions, and no position is better than another.
pub fn laws_are_linear(reduced: &Reduced) -> bool {
    (0..reduced.equations.laws.len()).all(|law| is_linear_law(reduced, law))
}

/// All coordinates of a model, as if none followed from others.
pub(super) fn unconstrained(reduced: &Reduced) -> Reduced {
    all_free(&reduced.equations)
}

/// The same of equations.
pub(super) fn all_free(equations: &Equations) -> Reduced {
    Reduced {
        coordinates: (0..equations.coordinates.len()).collect(),
        equations: equations.clone(),
        redundant: Vec::new(),
        steps: Vec::new(),
        relaxation: None,
    }
}

/// What angles of a place may be rounded by, relative.
const ROUNDED: f64 = 4.0 * f64::EPSILON;

/// Values of expressions at a place, over the rationals where they are fractions, and between which numbers they are if its angles are
/// rounded.
type Values<'a> = dyn Fn(&Motion, &[Expr]) -> (Vec<Option<Rational>>, Vec<Interval>) + 'a;

/// What vanishes at a place, or so near to it that the angles are rounded by as much, where a torque bends or jumps. Where it has the same value
/// and derivatives on all sides, as `w·|w|` has at rest, it does neither.
fn kinks_at(motion: &mut Motion, torque: Expr, used: &[Symbol], at: &Values<'_>) -> Vec<String> {
    // What no motion changes is on one side.
    let mut kinks = motion.graph.kinks(torque);
    let varying = motion.graph.varying();
    kinks.retain(|kink| varying(*kink));
    let (known, near) = at(motion, &kinks);
    let exactly = |k: &usize| known[*k].as_ref().is_some_and(Rational::is_zero);
    let vanishing: Vec<usize> = (0..kinks.len()).filter(|k| exactly(k) || near[*k].contains(0.0)).collect();
    let exact = vanishing.iter().all(exactly);
    let vanishing: Vec<Expr> = vanishing.into_iter().map(|k| kinks[k]).collect();
    if vanishing.is_empty() || is_smooth(motion, (torque, used), (&vanishing, exact), at) {
        return Vec::new();
    }
    // Those that bend it by themselves, each once, whatever its sign; where none does, all together.
    let (mut told, mut all) = (Vec::new(), Vec::<[Expr; 2]>::new());
    for kink in vanishing {
        let opposite = motion.graph.negate(kink);
        let is_negative = motion.graph.terms(kink).1.first().is_some_and(|(_, factor)| *factor < Rational::ZERO);
        let pair = if is_negative { [opposite, kink] } else { [kink, opposite] };
        if !all.contains(&pair) {
            all.push(pair);
            told.extend((!is_smooth(motion, (torque, used), (&pair, exact), at)).then_some(pair));
        }
    }
    let text =
        |[kink, _]: &[Expr; 2]| format!("`{}` = 0", printed(&motion.graph, *kink, Style::Text, &|name| name.into()));
    if told.is_empty() { all } else { told }.iter().map(text).collect()
}

/// Whether a torque has the same value and derivatives on all sides of what vanishes at a place.
fn is_smooth(
    motion: &mut Motion,
    (torque, used): (Expr, &[Symbol]),
    (vanishing, exact): (&[Expr], bool),
    at: &Values<'_>,
) -> bool {
    let Some(sides) = motion.graph.sides(torque, &|part| vanishing.contains(&part)) else { return false };
    let mut all = sides.clone();
    used.iter().for_each(|symbol| all.extend(motion.graph.derivatives(&sides, *symbol)));
    let (known, near) = at(motion, &all);
    let same = |k: usize| match (&known[k], &known[k - k % sides.len()]) {
        (Some(one), Some(other)) if exact => one == other,
        _ => {
            let [one, other] = [near[k], near[k - k % sides.len()]];
            one.low <= other.high && other.low <= one.high
        }
    };
    (0..all.len()).all(same)
}

/// An angle, behind all of them a speed, behind these the time, which is zero.
fn value_at(numeric: &Kinematics, place: usize) -> f64 {
    numeric.angles.iter().chain(&numeric.speeds).nth(place).copied().unwrap_or(0.0)
}

/// What a multiplier carries, whose row turns.
fn carried_slopes(along: &Along<RestTorque>) -> LawSlopes {
    LawSlopes {
        element: along.element.clone(),
        row: along.row.clone(),
        value: along.value.value,
        on_positions: along.value.on_positions.clone(),
        on_rates: SparseRow::new(),
        rounded: false,
        off: [vec![0.0; along.value.on_positions.len()], Vec::new()],
        kinks: Vec::new(),
    }
}

/// The torques of all laws around a reduced position (rad), and behind them what multipliers carry there.
///
/// # Panics
/// If `position` has not one entry per coordinate.
pub fn law_slopes(reduced: &Reduced, position: &[f64]) -> Vec<LawSlopes> {
    law_slopes_at(reduced, &OperatingPoint::relaxed(position))
}

/// The same at an operating point, where currents may flow.
///
/// # Panics
/// As [`law_slopes`].
pub fn law_slopes_at(reduced: &Reduced, point: &OperatingPoint) -> Vec<LawSlopes> {
    let position = point.position.as_slice();
    let equations = &reduced.equations;
    let carried = equations.carried.iter().map(carried_slopes);
    if equations.laws.is_empty() {
        return carried.collect();
    }
    let (n, free) = (equations.coordinates.len(), unconstrained(reduced));
    let mut motion = Motion::free(&free);
    let mut numeric = Kinematics::new(reduced);
    numeric.update(position, &point.rates);
    let exact = kinematics::exact_angles(reduced, position);
    let place = |motion: &Motion, symbol: Symbol| motion.symbols.iter().position(|own| *own == symbol).unwrap_or(2 * n);
    let at = |motion: &Motion, exprs: &[Expr]| -> (Vec<Option<Rational>>, Vec<f64>) {
        let of = |symbol| match place(motion, symbol) {
            k if k < n => exact[k].clone(),
            k if k < 2 * n && numeric.speeds[k - n] != 0.0 => None,
            _ => Some(Surd::rational(Rational::ZERO)),
        };
        let rounded = |symbol| value_at(&numeric, place(motion, symbol));
        let known = lower(&motion.graph, exprs, &mut Surds, of);
        (
            known.into_iter().map(|value| value?.to_rational()).collect(),
            lower(&motion.graph, exprs, &mut Floating::<f64>::default(), rounded),
        )
    };
    let between = |motion: &Motion, exprs: &[Expr]| {
        // The angles of the place were rounded, and what follows from them again.
        let around = |symbol| {
            let value = value_at(&numeric, place(motion, symbol));
            // Zero is exact; what a search found near it is not.
            let few = if value == 0.0 { 0.0 } else { ROUNDED * value.abs().max(1.0) };
            Interval { low: value - few, high: value + few }
        };
        (at(motion, exprs).0, lower(&motion.graph, exprs, &mut Intervals, around))
    };
    let mut out = Vec::new();
    for term in &equations.laws {
        let torque = motion.formula(&free, &term.value);
        let (_, value) = at(&motion, &[torque]);
        let used: Vec<Symbol> = motion.graph.symbols(&[torque]);
        let mut kinks = kinks_at(&mut motion, torque, &used, &between);
        let slopes: Vec<Expr> = used.iter().map(|symbol| motion.graph.derivative(torque, *symbol)).collect();
        let (known, near) = at(&motion, &slopes);
        let within = between(&motion, &slopes).1;
        let (mut on_positions, mut on_rates, mut rounded) = (SparseRow::new(), SparseRow::new(), false);
        let mut off = [Vec::new(), Vec::new()];
        let values = known.into_iter().zip(near).zip(within).map(|((known, near), within)| {
            let width = if known.is_none() { within.high - within.low } else { 0.0 };
            (known, near, if width.is_finite() { width } else { 0.0 })
        });
        let mut entries: Vec<(usize, (Option<Rational>, f64, f64))> =
            used.iter().map(|symbol| place(&motion, *symbol)).zip(values).collect();
        entries.sort_by_key(|(place, _)| *place);
        if !value[0].is_finite() {
            kinks.push("its value is no number".into());
        } else if entries.iter().any(|(_, (known, near, _))| known.is_none() && !near.is_finite()) {
            kinks.push("its slope has no end".into());
        }
        for (place, (known, near, width)) in entries {
            rounded |= known.is_none();
            let slope = known.or_else(|| rational_from_f64(near)).unwrap_or(Rational::ZERO);
            if slope.is_zero() {
                continue;
            }
            let (row, number) = if place < n { (&mut on_positions, place) } else { (&mut on_rates, place - n) };
            row.push((number, slope));
            off[usize::from(place >= n)].push(width);
        }
        let (element, row, value) = (term.element.clone(), term.row.clone(), value[0]);
        out.push(LawSlopes { element, row, value, on_positions, on_rates, rounded, off, kinks });
    }
    out.extend(carried);
    out
}
