//! The finest partition of outputs into blocks that can be decoupled.

use std::collections::BTreeMap;

use super::silverman::structure_of_rows;
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Rational, reduced_form};

/// Up to this many outputs all partitions are tried (4140 for eight).
const MOST_OUTPUTS: usize = 8;

/// The finest partition of the outputs into blocks that regular static state feedback can decouple from each other.
///
/// `None` if the transfer matrix has not full row rank. One block of all outputs always works, blocks of one are what is
/// ordinarily called decoupling.
///
/// Criterion (Dion, Int. J. Control 37 (1983); Dion and Commault): the orders at infinity of the
/// blocks on their own add up to those of the whole; equivalently the rows D̄ of the
/// [structure algorithms](super::structure_algorithm) of the blocks are independent together. Partitions are tried from many
/// blocks to few, among equals in the order in which the first outputs are alone or together; with more than eight outputs
/// blocks whose rows depend on each other are merged instead, which gives blocks that work, not always the finest.
///
/// Regular feedback uses all inputs; with more inputs than outputs, feedback that drops some can do more in special cases
/// (Morgan's problem).
///
/// `system` has E = I. Cost: at most one structure algorithm per set of outputs.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_synthesis::inversion::finest_blocks;
/// let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// // y₁′ = u₁, y₂′ = x₃ + u₁, x₃′ = u₂ and y₃′ = u₃.
/// let system = LinearSystem::state_space(
///     matrix(&[&[0, 0, 0, 0], &[0, 0, 1, 0], &[0, 0, 0, 0], &[0, 0, 0, 0]]),
///     matrix(&[&[1, 0, 0], &[1, 0, 0], &[0, 1, 0], &[0, 0, 1]]),
///     matrix(&[&[1, 0, 0, 0], &[0, 1, 0, 0], &[0, 0, 0, 1]]),
/// );
/// assert_eq!(finest_blocks(&system), Some(vec![vec![0, 1], vec![2]]));
/// ```
pub fn finest_blocks(system: &LinearSystem) -> Option<Vec<Vec<usize>>> {
    let m = system.c.rows();
    let all: Vec<usize> = (0..m).collect();
    let whole = structure_of_rows(system, &all);
    if whole.rank() < m {
        return None;
    }
    if m > MOST_OUTPUTS {
        return Some(merged(system));
    }
    let total: usize = whole.orders.iter().flatten().sum();
    let mut orders = BTreeMap::from([(all, total)]);
    let mut sum_of_orders = |block: &Vec<usize>| {
        *orders.entry(block.clone()).or_insert_with(|| structure_of_rows(system, block).orders.iter().flatten().sum())
    };
    partitions(m).into_iter().find(|blocks| blocks.iter().map(&mut sum_of_orders).sum::<usize>() == total)
}

/// All partitions of 0…m−1, those with most blocks first.
fn partitions(m: usize) -> Vec<Vec<Vec<usize>>> {
    let mut all: Vec<Vec<Vec<usize>>> = vec![Vec::new()];
    for output in 0..m {
        all = all
            .into_iter()
            .flat_map(|blocks| {
                (0..=blocks.len()).map(move |at| {
                    let mut next = blocks.clone();
                    match next.get_mut(at) {
                        Some(block) => block.push(output),
                        None => next.push(vec![output]),
                    }
                    next
                })
            })
            .collect();
    }
    all.sort_by_key(|blocks| std::cmp::Reverse(blocks.len()));
    all
}

/// Merges blocks whose rows of D̄ depend on each other until none do.
fn merged(system: &LinearSystem) -> Vec<Vec<usize>> {
    let p = system.b.columns();
    let mut blocks: Vec<Vec<usize>> = (0..system.c.rows()).map(|output| vec![output]).collect();
    loop {
        let mut owners = Vec::new();
        let mut rows: Vec<Vec<Rational>> = Vec::new();
        for (number, block) in blocks.iter().enumerate() {
            let d = structure_of_rows(system, block).d;
            rows.extend((0..d.rows()).map(|i| d.row(i).to_vec()));
            owners.extend(block.iter().map(|_| number));
        }
        let d = Matrix::from_fn(rows.len(), p, |i, j| rows[i][j].clone());
        let dependent = reduced_form(&d).dependent_rows();
        let Some(rows) = dependent.first() else { return blocks };
        let mut tied: Vec<usize> = rows.iter().map(|&row| owners[row]).collect();
        tied.dedup();
        let mut block: Vec<usize> = tied.iter().flat_map(|&number| blocks[number].clone()).collect();
        block.sort_unstable();
        tied.iter().rev().for_each(|&number| {
            blocks.remove(number);
        });
        blocks.push(block);
        blocks.sort();
    }
}

#[cfg(test)]
#[path = "../../tests/unit/inversion/partition.rs"]
mod tests;
