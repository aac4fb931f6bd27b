//! Operations with kinks in series: one smooth piece, valid as long as the deciding value does not change sign.

use kardan_native::Step;
use kardan_rt::{Operator, Table};

use super::Plan;

/// Parts of two values that are the same but for rounding.
const SAME: f64 = 1e-12;

/// A value of smooth pieces. Numbers are indices into the values of an order.
#[derive(Debug, Clone)]
enum Kink {
    /// One of two values, selected by whether a value is below another one, or below zero where there is none; without
    /// values, that value times its sign.
    Choice { value: usize, than: Option<usize>, values: Option<[usize; 2]>, sign: usize },
    /// A polynomial between two knots of a table. From `first` on: the coefficients, constant first, the origin, the
    /// argument minus the origin, and the intermediate values of Horner's rule of the previous order.
    Table { value: usize, table: Table, first: usize, piece: usize },
}

/// All that has kinks in the series of a plan.
#[derive(Debug, Clone, Default)]
pub(super) struct Pieces {
    kinks: Vec<Kink>,
    /// The tables' numbers.
    numbers: Vec<f64>,
    /// Which of them begin where two pieces meet: the deciding value vanishes in all orders computed so far.
    open: Vec<usize>,
    /// Whether one of them begins with a jump, which its values do not know of.
    jumps: bool,
}

impl Pieces {
    pub fn new(plan: &Plan) -> Self {
        Self { numbers: plan.numbers.clone(), ..Self::default() }
    }

    /// Writes the steps of an operation that has kinks; `free` is the first unused index, returned behind the used
    /// ones.
    pub fn write(
        &mut self,
        plan: &Plan,
        (operator, operands): (Operator, &[usize]),
        (out, mut free): (usize, usize),
        steps: &mut Vec<Step>,
    ) -> Option<usize> {
        let step = |operator, scaled, out: usize, operands: [usize; 3], more: usize| {
            let operands = operands.map(|place| place as u32);
            Step { operator, scaled, out: out as u32, operands, more: more as u32 }
        };
        match (operator, operands) {
            (Operator::Absolute, &[value]) => {
                steps.push(step(Operator::Multiply, true, out, [value, free, 0], 0));
                self.kinks.push(Kink::Choice { value, than: None, values: None, sign: free });
                free += 1;
            }
            (Operator::Table, &[number, value]) => {
                let table = *plan.tables.get(number)?;
                let (first, terms) = (free, table.terms);
                let (origin, behind) = (first + terms, first + terms + 1);
                free += 2 * terms.max(1) + 1;
                steps.push(step(Operator::Subtract, false, behind, [value, origin, 0], 0));
                // Horner's rule; behind the argument there is an index for each value of it but the last.
                for j in (0..terms.saturating_sub(1)).rev() {
                    let (highest, own) = (j + 2 == terms, if j == 0 { out } else { behind + j });
                    let before = if highest { first + j + 1 } else { behind + j + 1 };
                    // The first factor is the one that varies.
                    let factors = if highest { [behind, before] } else { [before, behind] };
                    steps.push(step(Operator::AddProduct, highest, own, [factors[0], factors[1], first + j], 0));
                }
                self.kinks.push(Kink::Table { value, table, first, piece: 0 });
            }
            (Operator::Minimum | Operator::Maximum | Operator::Select, _) => {
                let ([value, than], values) = match *operands {
                    [a, b] if operator == Operator::Minimum => ([a, b], [a, b]),
                    [a, b] => ([a, b], [b, a]),
                    [a, b, then, otherwise] => ([a, b], [then, otherwise]),
                    _ => return None,
                };
                steps.push(step(Operator::Select, false, out, [values[0], values[1], 0], free));
                self.kinks.push(Kink::Choice { value, than: Some(than), values: Some(values), sign: free });
                free += 1;
            }
            _ => return None,
        }
        Some(free)
    }

    /// The piece of each at the values of order 0: where two meet, at first the one that the plan takes there.
    pub fn begin(&mut self, memory: &mut [f64]) {
        let Self { kinks, numbers, open, jumps } = self;
        open.clear();
        *jumps = false;
        for (k, kink) in kinks.iter_mut().enumerate() {
            let meets = match kink {
                Kink::Choice { value, than, sign, .. } => {
                    let (a, b) = (memory[*value], than.map_or(0.0, |than| memory[than]));
                    memory[*sign] = if a < b { -1.0 } else { 1.0 };
                    a == b
                }
                Kink::Table { value, table, first, piece } => {
                    let (knots, x) = (knots(table, numbers), memory[*value]);
                    *piece = knots.partition_point(|knot| *knot <= x);
                    put_piece(table, numbers, (*first, *piece), x, memory);
                    *piece > 0 && knots[*piece - 1] == x
                }
            };
            if meets {
                open.push(k);
            }
        }
    }

    /// Chooses the piece of operations that begin where two pieces meet, as far as the coefficients of an order decide
    /// it. True where one changes to another piece; that order is then to be computed again.
    pub fn decide(&mut self, memory: &mut [f64], width: usize, k: usize) -> bool {
        let mut changed = false;
        let Self { kinks, numbers, open, jumps } = self;
        open.retain(|kink| {
            if changed {
                // It may depend on values that are to be computed again.
                return true;
            }
            let change = match &mut kinks[*kink] {
                Kink::Choice { value, than, values, sign } => {
                    let (a, b) = (memory[k * width + *value], than.map_or(0.0, |than| memory[k * width + than]));
                    if a == b {
                        return true;
                    }
                    let chosen = if a < b { -1.0 } else { 1.0 };
                    let change = memory[*sign] != chosen;
                    memory[*sign] = chosen;
                    // Lower orders were computed with the other value.
                    let apart = |values: [usize; 2], order: usize| {
                        let [a, b] = values.map(|place| memory[order * width + place]);
                        (a - b).abs() > SAME * (a.abs() + b.abs())
                    };
                    *jumps |= change && values.is_some_and(|values| (0..k).any(|order| apart(values, order)));
                    change
                }
                Kink::Table { value, table, first, piece } => {
                    let slope = memory[k * width + *value];
                    if slope == 0.0 {
                        return true;
                    }
                    if slope < 0.0 {
                        let x = memory[*value];
                        let before = at_piece(table, numbers, *piece, x);
                        *piece -= 1;
                        put_piece(table, numbers, (*first, *piece), x, memory);
                        let after = at_piece(table, numbers, *piece, x);
                        *jumps |= (after - before).abs() > SAME * (after.abs() + before.abs());
                    }
                    slope < 0.0
                }
            };
            changed = change;
            false
        });
        changed
    }

    /// Whether the values jump where they begin.
    pub fn jump(&self) -> bool {
        self.jumps
    }

    /// The value that decides the piece, which is valid as long as it stays positive: indices of two values, the second
    /// subtracted from the first, with a sign; and a constant added.
    pub fn margins<'a>(&'a self, memory: &'a [f64]) -> impl Iterator<Item = (usize, Option<usize>, f64, f64)> + 'a {
        self.kinks.iter().flat_map(move |kink| {
            let margins = match kink {
                Kink::Choice { value, than, sign, .. } => [Some((*value, *than, memory[*sign], 0.0)), None],
                Kink::Table { value, table, piece, .. } => {
                    let knots = knots(table, &self.numbers);
                    let above = piece.checked_sub(1).map(|below| (*value, None, 1.0, -knots[below]));
                    [above, knots.get(*piece).map(|knot| (*value, None, -1.0, *knot))]
                }
            };
            margins.into_iter().flatten()
        })
    }
}

pub(super) fn knots<'a>(table: &Table, numbers: &'a [f64]) -> &'a [f64] {
    &numbers[table.first..][..table.pieces - 1]
}

/// The origin of a piece and its coefficients.
pub(super) fn piece_of<'a>(table: &Table, numbers: &'a [f64], piece: usize) -> (f64, &'a [f64]) {
    let own = &numbers[table.first + table.pieces - 1..];
    (own[piece], &own[table.pieces + piece * table.terms..][..table.terms])
}

fn at_piece(table: &Table, numbers: &[f64], piece: usize, x: f64) -> f64 {
    let (origin, coefficients) = piece_of(table, numbers, piece);
    coefficients.iter().rev().fold(0.0, |value, coefficient| value * (x - origin) + coefficient)
}

/// Writes the values of order 0 of a piece to the indices that the steps of a table read.
fn put_piece(table: &Table, numbers: &[f64], (first, piece): (usize, usize), x: f64, memory: &mut [f64]) {
    let (origin, coefficients) = piece_of(table, numbers, piece);
    let (terms, behind) = (table.terms, x - origin);
    memory[first..first + terms].copy_from_slice(coefficients);
    memory[first + terms] = origin;
    memory[first + terms + 1] = behind;
    let mut value = 0.0;
    for j in (1..terms).rev() {
        value = value * behind + coefficients[j];
        if j + 1 < terms {
            memory[first + terms + 1 + j] = value;
        }
    }
}
