//! Relative degrees: how many integrators are between an input and an output.

use crate::LinearSystem;
use crate::images::Image;
use kardan_math::num::{Operator, Residue};

/// Relative degree of every input-output pair modulo a prime: never below the true one.
pub(crate) fn relative_degrees(image: &Image) -> Vec<Vec<Option<usize>>> {
    let (n, field) = (image.g.rows, &image.field);
    let (states, outputs) = (Operator::new(&image.g), Operator::new(&image.c));
    let through = |x: &Residue| if *x == 0 { None } else { Some(0) };
    let mut table: Vec<Vec<Option<usize>>> =
        (0..image.c.rows).map(|output| image.d.row(output).iter().map(through).collect()).collect();
    for input in 0..image.b.columns {
        let mut v = image.b.column(input);
        for degree in 1..=n {
            if table.iter().all(|row| row[input].is_some()) || v.iter().all(|&x| x == 0) {
                break;
            }
            for (row, shown) in table.iter_mut().zip(outputs.apply(field, &v)) {
                if shown != 0 {
                    row[input].get_or_insert(degree);
                }
            }
            v = states.apply(field, &v);
        }
    }
    table
}

/// Whether D and `C (E⁻¹A)ᵏ E⁻¹B` vanish for all powers below the relative degrees.
pub(super) fn vanish_exactly(system: &LinearSystem, table: &[Vec<Option<usize>>]) -> bool {
    let n = system.states.len();
    let through = |i: usize, j: usize| table[i][j] != Some(0) && !system.d[(i, j)].is_zero();
    if (0..table.len()).any(|i| (0..table[i].len()).any(|j| through(i, j))) {
        return false;
    }
    let transposed = system.e.transpose();
    let mut v = system.c.transpose();
    let deepest = table.iter().flatten().map(|degree| degree.unwrap_or(n + 1)).max().unwrap_or(0);
    for degree in 1..deepest {
        // Column i of v: the row C_i (E⁻¹A)^(degree−1) E⁻¹.
        let Some(next) = transposed.solve(&v) else { return false };
        let markov = next.transpose().multiply(&system.b);
        for (i, row) in table.iter().enumerate() {
            for (j, found) in row.iter().enumerate() {
                if found.is_none_or(|found| degree < found) && !markov[(i, j)].is_zero() {
                    return false;
                }
            }
        }
        v = next.transpose().multiply(&system.a).transpose();
    }
    true
}
