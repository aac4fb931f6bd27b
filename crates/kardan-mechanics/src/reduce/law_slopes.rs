//! Slopes of torque expressions, around a position at rest.

use super::{Kinematics, Motion, Reduced, Step, kinematics, pressed_cushions};
use crate::assemble::{DirectionalTerm, RestTorque, row_f64};
use crate::equations::{Formula, UnilateralConstraint};
use kardan_expr::expr::{Expr, Interval, Linear, Place, Rationals, Side, Surd, Symbol, bending, linear_sides, lower};
use kardan_math::num::{LastDigits, Rational, SparseRow, rational_from_f64, rational_to_f64};

/// A torque that an expression gives, or the multiplier of a row that rotates, around a position at rest and at time
/// zero: `τ = τ₀ + gᵀ Δq + hᵀ q̇` over all coordinates.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LawSlopes {
    /// The element.
    pub element: String,
    /// The direction in which it acts.
    pub row: SparseRow,
    /// τ₀, N m.
    pub value: f64,
    /// g, N m/rad.
    pub on_positions: SparseRow,
    /// h, N m s/rad.
    pub on_rates: SparseRow,
    /// Slopes by block outputs, N m for each unit, where these are given.
    pub on_outputs: Vec<(String, f64)>,
    /// Whether an entry is not known to be a fraction, and was rounded once.
    pub rounded: bool,
    /// The rounding error of each entry of g, and of h.
    pub off: [Vec<f64>; 2],
    /// Why it has no slope here, as text: that it jumps, or that it or its slope is not a number.
    pub undefined: Vec<String>,
    /// The expressions that vanish where the law jumps.
    pub jumps: Vec<String>,
    /// The expressions that vanish where the law has a kink here: its slopes differ on the two sides, and the entries
    /// are those of one of them.
    pub kinks: Vec<String>,
}

impl LawSlopes {
    /// Moves rounded entries within their rounding error.
    pub fn perturb(&mut self, digits: &mut LastDigits) {
        for (row, off) in [&mut self.on_positions, &mut self.on_rates].into_iter().zip(&self.off) {
            for ((_, slope), off) in row.iter_mut().zip(off) {
                *slope = if *off > 0.0 { digits.perturbed(slope, *off) } else { digits.near(slope) };
            }
        }
    }
}

/// The operating point of a model: at rest, and, where that is computed, in balance.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OperatingPoint {
    /// The reduced position, rad or m.
    pub position: Vec<f64>,
    /// Rates of the reduced coordinates: zero, except for the currents of charges that are integrators without effect,
    /// A.
    pub rates: Vec<f64>,
    /// The constant torque of each input that balances it, N m; `None`: springs are taken as relaxed there.
    pub torques: Option<Vec<f64>>,
    /// The side of the operating point that is used, where it is at a kink.
    pub side: Side,
}

impl OperatingPoint {
    /// A position with relaxed springs.
    pub fn unloaded(position: &[f64]) -> Self {
        Self { position: position.to_vec(), rates: vec![0.0; position.len()], torques: None, side: Side::default() }
    }

    /// All coordinates at zero, springs relaxed.
    pub fn zero(reduced: &Reduced) -> Self {
        Self::unloaded(&vec![0.0; reduced.degrees_of_freedom()])
    }
}

/// The stiffness (N m/rad) that springs, laws and balancing torques add at transmissions whose ratio depends on the angle:
/// `−μ γ″` along the driving side, with μ the torque that acts on the driven one; `laws` are the slopes of the laws
/// there; each as a row over the coordinates and the stiffness in its direction (N m/rad). Without laws and balancing
/// torques there is none: springs are then taken as relaxed.
///
/// # Panics
/// If the position has not one entry per coordinate.
pub fn geometric_stiffness(
    reduced: &Reduced,
    point: &OperatingPoint,
    laws: &[LawSlopes],
) -> Vec<DirectionalTerm<Rational>> {
    let (equations, position) = (&reduced.equations, &point.position);
    if equations.transmissions.is_empty() || laws.is_empty() && point.torques.is_none() {
        return Vec::new();
    }
    let numeric = Kinematics::at_rest(reduced, position);
    let mut forces = vec![0.0; equations.coordinates.len()];
    let mut act = |row: &[(usize, f64)], torque: f64| row.iter().for_each(|(k, x)| forces[*k] += x * torque);
    laws.iter().for_each(|slopes| act(&row_f64(&slopes.row), slopes.value));
    for (input, torque) in equations.inputs.iter().zip(point.torques.iter().flatten()) {
        act(&input.row_f64(), *torque);
    }
    for spring in &equations.springs {
        let row = spring.row_f64();
        let twist = row.iter().map(|(k, x)| x * numeric.angles[*k]).sum::<f64>() - spring.value.rest.to_f64();
        act(&row, -spring.value.stiffness.to_f64() * twist);
    }
    for one in pressed_cushions(reduced, position) {
        let unilateral = &equations.unilaterals[one.unilateral];
        if let UnilateralConstraint::Cushion { stiffness, .. } = &unilateral.value {
            act(&unilateral.row_f64(), -stiffness.to_f64() * one.gap);
        }
    }
    let mut out = Vec::new();
    for Step { shaft, argument, curve } in reduced.steps.iter().rev() {
        let torque = forces[*shaft];
        let entries = row_f64(&argument.terms);
        let slope = match curve {
            None => 1.0,
            Some(curve) => {
                let x = argument.constant + entries.iter().map(|(k, c)| c * numeric.angles[*k]).sum::<f64>();
                let (slope, curvature) = curve.derivatives(x);
                let stiffness = rational_from_f64(-torque * curvature).unwrap_or(Rational::ZERO);
                let own = equations.transmissions.iter().find(|t| t.driven == *shaft || t.driving == *shaft);
                if !stiffness.is_zero() {
                    let element = own.map(|t| t.element.clone()).unwrap_or_default();
                    out.push(DirectionalTerm { element, row: argument.terms.clone(), value: stiffness });
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
    let (free, mut motion) = Motion::free(&reduced.equations, true);
    let torque = motion.formula(&free, formula);
    let at_zero = lower(&motion.graph, &[torque], &mut Rationals, |_| Some(Rational::ZERO));
    motion.graph.affine()(torque) && at_zero[0].as_ref().is_some_and(Rational::is_zero)
}

/// Whether all laws are linear: small motions are then all motions, and no position is better than another.
pub fn laws_are_linear(reduced: &Reduced) -> bool {
    (0..reduced.equations.laws.len()).all(|law| is_linear_law(reduced, law))
}

/// The relative rounding error of angles of a position.
const ROUNDED: f64 = 4.0 * f64::EPSILON;

/// A model at rest at a position, with the motions that its constraints allow.
struct RestPoint {
    /// Angles, behind all of them speeds.
    symbols: Vec<Symbol>,
    exact: Vec<Option<Surd>>,
    numeric: Kinematics,
    basis: Vec<SparseRow>,
    /// The block outputs.
    outputs: Vec<(Symbol, f64)>,
    /// Constant symbols: functions of time at their start values.
    fixed: Vec<(Symbol, f64)>,
}

impl RestPoint {
    fn new(reduced: &Reduced, point: &OperatingPoint, motion: &Motion) -> Self {
        let numeric = Kinematics::at(reduced, &point.position, &point.rates);
        let basis = kinematics::exact_basis(reduced, &point.position);
        Self {
            symbols: motion.symbols.clone(),
            exact: [kinematics::exact_angles(reduced, &point.position), exact_speeds(&basis, &point.rates)].concat(),
            numeric,
            basis,
            outputs: Vec::new(),
            fixed: Vec::new(),
        }
    }

    /// The number of coordinates.
    fn coordinates(&self) -> usize {
        self.basis.len()
    }
}

/// The speeds of all shafts, where they are known exactly.
fn exact_speeds(basis: &[SparseRow], rates: &[f64]) -> Vec<Option<Surd>> {
    let speed = |row: &SparseRow| {
        let zero = Surd::rational(Rational::ZERO);
        row.iter().try_fold(zero, |sum, (k, x)| Some(sum.plus(&Surd::recognise_double(rates[*k])?.scale(x))))
    };
    basis.iter().map(speed).collect()
}

impl Place for RestPoint {
    fn place(&self, symbol: Symbol) -> Option<usize> {
        let moving = self.symbols.iter().position(|own| *own == symbol).filter(|place| *place < 2 * self.basis.len());
        let output = || self.outputs.iter().position(|(own, _)| *own == symbol);
        moving.or_else(|| Some(2 * self.basis.len() + output()?))
    }

    fn exact(&self, symbol: Symbol) -> Option<Surd> {
        match self.place(symbol) {
            Some(k) if k < self.exact.len() => self.exact[k].clone(),
            _ => Surd::recognise_double(self.value(symbol)),
        }
    }

    fn value(&self, symbol: Symbol) -> f64 {
        let outputs = self.outputs.iter().map(|(_, value)| value);
        let mut all = self.numeric.angles.iter().chain(&self.numeric.speeds).chain(outputs);
        let fixed = || self.fixed.iter().find(|(own, _)| *own == symbol).map_or(0.0, |(_, value)| *value);
        self.place(symbol).and_then(|place| all.nth(place).copied()).unwrap_or_else(fixed)
    }

    fn enclosure(&self, symbol: Symbol) -> Interval {
        let value = self.value(symbol);
        // Zero is exact; a value that a search found near it is not.
        let half_width = if value == 0.0 { 0.0 } else { ROUNDED * value.abs().max(1.0) };
        Interval { low: value - half_width, high: value + half_width }
    }

    fn moves(&self, symbol: Symbol) -> SparseRow {
        let n = self.basis.len();
        let Some(place) = self.place(symbol) else { return SparseRow::new() };
        if place >= 2 * n {
            return vec![(place, Rational::ONE)];
        }
        // Speeds are directions behind those of angles.
        self.basis[place % n].iter().map(|(k, x)| (k + place / n * n, x.clone())).collect()
    }
}

/// The contribution of a multiplier whose row changes direction.
fn carried_slopes(rest_term: &DirectionalTerm<RestTorque>) -> LawSlopes {
    LawSlopes {
        element: rest_term.element.clone(),
        row: rest_term.row.clone(),
        value: rest_term.value.value,
        on_positions: rest_term.value.on_positions.clone(),
        off: [vec![0.0; rest_term.value.on_positions.len()], Vec::new()],
        ..LawSlopes::default()
    }
}

/// The torques of all laws around an operating point, where currents may flow, on its side of any kink there; then those
/// of multipliers there.
///
/// # Panics
/// If the point has not one entry per coordinate.
pub fn law_slopes_at(reduced: &Reduced, point: &OperatingPoint) -> Vec<LawSlopes> {
    let laws = law_slopes_with(reduced, point, &|_| true, None).into_iter();
    laws.chain(reduced.equations.carried.iter().map(carried_slopes)).collect()
}

/// The torques of some laws around an operating point with the block outputs there, by which torques have slopes too;
/// without them, block outputs are constant zero.
///
/// # Panics
/// As [`law_slopes_at`].
pub fn law_slopes_with(
    reduced: &Reduced,
    point: &OperatingPoint,
    which: &dyn Fn(&Formula) -> bool,
    output: Option<&dyn Fn(&str) -> f64>,
) -> Vec<LawSlopes> {
    let equations = &reduced.equations;
    if equations.laws.is_empty() {
        return Vec::new();
    }
    // Block outputs are symbols where they are given, and functions of time with them.
    let (free, mut motion) = Motion::free(equations, output.is_none());
    let mut rest_point = RestPoint::new(reduced, point, &motion);
    let mut out = Vec::new();
    for term in equations.laws.iter().filter(|law| which(&law.value)) {
        let torque = motion.formula(&free, &term.value);
        let blocks = || motion.timed.blocks.iter();
        let symbol = |(name, own): &(String, Expr)| Some((motion.graph.symbol_of(*own)?, output?(name)));
        rest_point.outputs = blocks().filter_map(symbol).collect();
        rest_point.fixed = motion.timed.symbols(&motion.graph).into_iter().zip(motion.timed.values(0.0)).collect();
        let names: Vec<String> = blocks().map(|(name, _)| name.clone()).collect();
        let sides = linear_sides(&mut motion.graph, &[torque], &rest_point);
        let (element, row) = (term.element.clone(), term.row.clone());
        out.push(slopes_of(sides, (rest_point.coordinates(), &names), &point.side, (element, row)));
    }
    out
}

/// The slopes of a law on one side of the position, with notes on the other sides.
fn slopes_of(
    sides: Option<Vec<Linear>>,
    (coordinates, blocks): (usize, &[String]),
    side: &Side,
    (element, row): (String, SparseRow),
) -> LawSlopes {
    let nothing = LawSlopes { element, row, value: f64::NAN, ..LawSlopes::default() };
    let Some(sides) = sides else {
        // A loop reports it with the jumps, and leaves it out.
        let many = "more than 64 branches";
        return LawSlopes { undefined: vec![format!("it has {many}")], jumps: vec![many.into()], ..nothing };
    };
    let own = sides.iter().find(|one| one.is_on(side)).unwrap_or(&sides[0]);
    let value = &own.values[0];
    let jumps = bending(&sides, &|one, other| one.same_values(other));
    let kinks = bending(&sides, &|one, other| one.same_slopes(other));
    let mut undefined: Vec<String> = jumps.iter().map(|guard| format!("it jumps where `{guard}` = 0")).collect();
    if undefined.is_empty() && !value.value.is_finite() {
        undefined.push("its value is not a number".into());
    } else if undefined.is_empty() && own.slopes[0].iter().any(|(_, slope)| !slope.is_number()) {
        undefined.push("its slope is infinite".into());
    }
    let (mut on_positions, mut on_rates, mut rounded) = (SparseRow::new(), SparseRow::new(), false);
    let mut on_outputs = Vec::new();
    let mut off = [Vec::new(), Vec::new()];
    for (place, number) in &own.slopes[0] {
        if let Some(block) = place.checked_sub(2 * coordinates) {
            on_outputs.push((blocks[block].clone(), number.exact.as_ref().map_or(number.value, rational_to_f64)));
            continue;
        }
        rounded |= number.exact.is_none();
        let slope = number.exact.clone().or_else(|| rational_from_f64(number.value)).unwrap_or(Rational::ZERO);
        // Rounding may have left nothing of a slope.
        if slope.is_zero() && number.rounding() == 0.0 {
            continue;
        }
        let behind = place.checked_sub(coordinates);
        let row = if behind.is_some() { &mut on_rates } else { &mut on_positions };
        row.push((behind.unwrap_or(*place), slope));
        off[usize::from(behind.is_some())].push(number.rounding());
    }
    LawSlopes {
        value: value.value,
        on_positions,
        on_rates,
        on_outputs,
        rounded,
        off,
        undefined,
        jumps,
        kinks,
        ..nothing
    }
}
