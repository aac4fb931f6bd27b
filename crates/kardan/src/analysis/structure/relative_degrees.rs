//! Relative degrees: how many integrators stand between an input and an output.

use super::fractions::multiply_sparse;
use crate::analysis::LinearSystem;
use crate::analysis::images::Image;
use crate::num::Operator;

/// Relative degree of every input-output pair modulo a prime: never below the true one.
pub(in crate::analysis) fn relative_degrees(image: &Image) -> Vec<Vec<Option<usize>>> {
    let (n, field) = (image.g.rows, &image.field);
    let columns = Operator::new(&image.g.transpose());
    let inputs = image.b.transpose();
    let mut table = Vec::new();
    for output in 0..image.c.rows {
        let mut row: Vec<Option<usize>> =
            image.d.row(output).iter().map(|&x| if x == 0 { None } else { Some(0) }).collect();
        let mut v = image.c.row(output).to_vec();
        for degree in 1..=n {
            if row.iter().all(Option::is_some) || v.iter().all(|&x| x == 0) {
                break;
            }
            for (input, entry) in row.iter_mut().enumerate() {
                if entry.is_none() && field.dot(&v, inputs.row(input)) != 0 {
                    *entry = Some(degree);
                }
            }
            v = columns.apply(field, &v);
        }
        table.push(row);
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
        let markov = multiply_sparse(&next.transpose(), &system.b);
        for (i, row) in table.iter().enumerate() {
            for (j, found) in row.iter().enumerate() {
                if found.is_none_or(|found| degree < found) && !markov[(i, j)].is_zero() {
                    return false;
                }
            }
        }
        v = multiply_sparse(&next.transpose(), &system.a).transpose();
    }
    true
}
