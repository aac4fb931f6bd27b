//! The start of a run, from angles and speeds that are given for any coordinates.

use std::collections::BTreeMap;

use super::{Kinematics, Reduced};
use kardan_math::num::{Rational, Scalar, rational_from_f64};
use kardan_math::units::Exact;

/// A value that a coordinate, or its rate, has at the start.
#[derive(Debug, Clone, PartialEq)]
pub struct StartValue {
    /// Its number among all coordinates.
    pub coordinate: usize,
    /// SI
    pub value: Exact,
}

/// The given start values contradict each other.
#[derive(Debug, Clone, PartialEq)]
pub struct StartConflict {
    /// Numbers of the given values that are involved.
    pub prescribed: Vec<usize>,
    /// The value of one of them that follows from the others, SI.
    pub follows: Option<(usize, f64)>,
    /// The transmission that does not allow it, where it is one.
    pub transmission: Option<String>,
}

/// Difference of two values relative to the larger one that counts as rounding.
const ROUNDED: f64 = 1e-9;
/// A value that counts as zero, SI.
const LEAST: f64 = 1e-15;

/// A number as powers of π with their factors: these are independent over the fractions, so that equality is decided.
type Graded = BTreeMap<i32, Rational>;

fn graded(value: &Exact) -> Graded {
    BTreeMap::from([(value.pi, value.rational.clone())])
}

fn to_f64(value: &Graded) -> f64 {
    value.iter().map(|(pi, x)| Exact::new(x.clone(), *pi).to_f64()).sum()
}

fn subtract<K: Ord + Copy>(from: &mut BTreeMap<K, Rational>, factor: &Rational, other: &BTreeMap<K, Rational>) {
    for (key, x) in other {
        let entry = from.entry(*key).or_insert(Rational::ZERO);
        *entry = entry.minus(&factor.times(x));
    }
    from.retain(|_, x| !x.is_zero());
}

/// `Σ entries·q = right`, the sum of constraints and of `from` times given values.
#[derive(Debug, Clone, Default)]
struct Row {
    entries: BTreeMap<usize, Rational>,
    right: Graded,
    from: BTreeMap<usize, Rational>,
}

/// Independent rows, each without the pivots of those before it.
#[derive(Debug, Default)]
struct Rows(Vec<(usize, Row)>);

impl Rows {
    /// The part of a row that does not follow from these.
    fn rest(&self, mut row: Row) -> Row {
        for (pivot, own) in &self.0 {
            let Some(entry) = row.entries.get(pivot).cloned() else { continue };
            let factor = entry.over(&own.entries[pivot]);
            subtract(&mut row.entries, &factor, &own.entries);
            subtract(&mut row.right, &factor, &own.right);
            subtract(&mut row.from, &factor, &own.from);
        }
        row
    }

    /// Adds a row; returns the remainder of one that follows from the others.
    fn add(&mut self, row: Row) -> Option<Row> {
        let rest = self.rest(row);
        match rest.entries.keys().next() {
            Some(pivot) => {
                self.0.push((*pivot, rest));
                None
            }
            None => Some(rest),
        }
    }

    /// The value of a coordinate, and the given values that it follows from; `None` while it is free.
    fn value(&self, coordinate: usize) -> Option<(Graded, Vec<usize>)> {
        let entries = BTreeMap::from([(coordinate, Rational::ONE)]);
        let mut rest = self.rest(Row { entries, ..Row::default() });
        rest.right.values_mut().for_each(|x| *x = Rational::ZERO.minus(x));
        rest.entries.is_empty().then(|| (rest.right, rest.from.into_keys().collect()))
    }
}

/// The equations of angles, or of speeds.
struct Start<'a> {
    reduced: &'a Reduced,
    prescribed: &'a [StartValue],
    rows: Rows,
    /// Whether numbers in it were rounded.
    rounded: bool,
}

impl<'a> Start<'a> {
    /// The linear constraints with these right sides, and the given values.
    fn new(reduced: &'a Reduced, prescribed: &'a [StartValue], right: impl Fn(usize) -> (Graded, bool)) -> Self {
        let mut out = Self { reduced, prescribed, rows: Rows::default(), rounded: false };
        for (k, constraint) in reduced.equations.constraints.iter().enumerate() {
            let (right, rounded) = right(k);
            out.rounded |= rounded;
            let entries = constraint.row.iter().cloned().collect();
            // Constraints of a reduced model are independent.
            out.rows.add(Row { entries, right, from: BTreeMap::new() });
        }
        out
    }

    /// Adds the given values.
    fn give(&mut self) -> Result<(), StartConflict> {
        for (number, prescribed) in self.prescribed.iter().enumerate() {
            let entries = BTreeMap::from([(prescribed.coordinate, Rational::ONE)]);
            let from = BTreeMap::from([(number, Rational::ONE)]);
            let Some(rest) = self.rows.add(Row { entries, right: graded(&prescribed.value), from }) else { continue };
            let (value, excess) = (prescribed.value.to_f64(), to_f64(&rest.right));
            if !self.vanishes(&rest.right, value) {
                let prescribed = rest.from.into_keys().collect();
                return Err(StartConflict { prescribed, follows: Some((number, value - excess)), transmission: None });
            }
        }
        Ok(())
    }

    fn vanishes(&self, excess: &Graded, beside: f64) -> bool {
        let exact = excess.values().all(Scalar::is_zero);
        let (excess, follows) = (to_f64(excess), beside - to_f64(excess));
        exact || (self.rounded && excess.abs() <= (ROUNDED * beside.abs().max(follows.abs())).max(LEAST))
    }

    /// Adds the value of a coordinate, where it is free.
    fn set(&mut self, coordinate: usize, value: f64, from: &[usize]) {
        let right = graded(&Exact::new(rational_from_f64(value).unwrap_or(Rational::ZERO), 0));
        let from = from.iter().map(|number| (*number, Rational::ONE)).collect();
        self.rows.add(Row { entries: BTreeMap::from([(coordinate, Rational::ONE)]), right, from });
    }

    /// Sets free reduced coordinates to zero, one after the other, and adds the consequences each time.
    fn close(
        &mut self,
        follow: &mut dyn FnMut(&mut Self) -> Result<(), StartConflict>,
    ) -> Result<Vec<f64>, StartConflict> {
        follow(self)?;
        for &coordinate in &self.reduced.coordinates {
            if self.rows.value(coordinate).is_none() {
                self.set(coordinate, 0.0, &[]);
                follow(self)?;
            }
        }
        let value = |coordinate: &usize| self.rows.value(*coordinate).map_or(0.0, |(value, _)| to_f64(&value));
        Ok(self.reduced.coordinates.iter().map(value).collect())
    }
}

/// The reduced position that has these angles; free coordinates are zero, the coordinates in their order.
///
/// Linear constraints are solved over the fractions and the powers of π; a transmission is evaluated from its known
/// end, and rounded.
///
/// # Errors
/// [`StartConflict`]
pub fn start_position(reduced: &Reduced, prescribed: &[StartValue]) -> Result<Vec<f64>, StartConflict> {
    let equations = &reduced.equations;
    let moves = !equations.moving.is_empty();
    let mut start = Start::new(reduced, prescribed, |k| (graded(&equations.constraints[k].value), moves));
    start.give()?;
    let mut open: Vec<usize> = (0..equations.transmissions.len()).collect();
    start.close(&mut |start| {
        loop {
            let before = open.len();
            let mut unresolved = Vec::new();
            for k in std::mem::take(&mut open) {
                let one = &equations.transmissions[k];
                let resolved = [one.driving, one.driven].map(|shaft| start.rows.value(shaft));
                let value = |resolved: &(Graded, Vec<usize>)| to_f64(&resolved.0);
                match &resolved {
                    [Some(x), None] => {
                        start.rounded = true;
                        start.set(one.driven, one.curve.value(value(x)), &x.1);
                    }
                    [None, Some(y)] => match one.curve.inverse() {
                        Some(inverse) => {
                            start.rounded = true;
                            start.set(one.driving, inverse.value(value(y)), &y.1);
                        }
                        None => unresolved.push(k),
                    },
                    [Some(x), Some(y)] => {
                        let (expected, found) = (one.curve.value(value(x)), value(y));
                        if (expected - found).abs() > ROUNDED * expected.abs().max(found.abs()).max(1.0) {
                            let mut prescribed = [x.1.clone(), y.1.clone()].concat();
                            prescribed.sort_unstable();
                            prescribed.dedup();
                            let transmission = Some(one.element.clone());
                            return Err(StartConflict { prescribed, follows: None, transmission });
                        }
                    }
                    [None, None] => unresolved.push(k),
                }
            }
            open = unresolved;
            if open.len() == before {
                return Ok(());
            }
        }
    })
}

/// The reduced speeds at a reduced position that give these speeds; free speeds are zero, the coordinates in their
/// order.
///
/// # Errors
/// [`StartConflict`]
///
/// # Panics
/// If `position` has not one entry per coordinate.
pub fn start_speed(reduced: &Reduced, position: &[f64], prescribed: &[StartValue]) -> Result<Vec<f64>, StartConflict> {
    let equations = &reduced.equations;
    let rate = |k: usize| {
        let function = equations.moving.get(&equations.constraints[k].element);
        let rate = function.map_or(0.0, |function| function.rate().value(0.0));
        (graded(&Exact::new(rational_from_f64(rate).unwrap_or(Rational::ZERO), 0)), rate != 0.0)
    };
    let mut start = Start::new(reduced, prescribed, rate);
    let numeric = Kinematics::at_rest(reduced, position);
    for transmission in &equations.transmissions {
        let (slope, _) = transmission.curve.derivatives(numeric.angles[transmission.driving]);
        let slope = Rational::ZERO.minus(&rational_from_f64(slope).unwrap_or(Rational::ZERO));
        let entries = BTreeMap::from([(transmission.driven, Rational::ONE), (transmission.driving, slope)]);
        let entries = entries.into_iter().filter(|(_, x)| !x.is_zero()).collect();
        start.rounded = true;
        start.rows.add(Row { entries, ..Row::default() });
    }
    start.give()?;
    start.close(&mut |_| Ok(()))
}
