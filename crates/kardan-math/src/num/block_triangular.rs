//! Splits the states of a square matrix into isolated ones and the others.

use super::Matrix;

/// The states of a square matrix in two sets: the isolated ones and the others.
///
/// A state is isolated if none of the remaining ones acts on it, or if it acts on none of them; then it is removed, and so on. Entries on the
/// diagonal do not count. Put in order these states make the matrix block triangular: their entries on the diagonal are
/// eigenvalues of the matrix, exactly, and the square of the others has all the rest.
///
/// ```
/// use kardan_math::num::{Matrix, isolated};
/// // The first drives an oscillator, whose angle the last one adds up.
/// let rows = [[-5.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [2.0, -4.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]];
/// let [isolated, coupled] = isolated(&Matrix::from_fn(4, 4, |i, j| rows[i][j]));
/// assert_eq!((isolated, coupled), (vec![0, 3], vec![1, 2]));
/// ```
///
/// # Panics
/// If the matrix is not square.
pub fn isolated(matrix: &Matrix<f64>) -> [Vec<usize>; 2] {
    let n = matrix.rows();
    assert_eq!(n, matrix.columns(), "states of a matrix that is not square");
    let acts = |j: usize, i: usize| i != j && matrix[(i, j)] != 0.0;
    // How many others act on a state, and on how many it acts, of those that are left.
    let mut acting: Vec<usize> = (0..n).map(|i| (0..n).filter(|&j| acts(j, i)).count()).collect();
    let mut acted: Vec<usize> = (0..n).map(|j| (0..n).filter(|&i| acts(j, i)).count()).collect();
    let mut unvisited = vec![true; n];
    let mut next: Vec<usize> = (0..n).filter(|&k| acting[k] == 0 || acted[k] == 0).collect();
    while let Some(k) = next.pop() {
        if !std::mem::replace(&mut unvisited[k], false) {
            continue;
        }
        for neighbour in (0..n).filter(|&neighbour| unvisited[neighbour]) {
            acting[neighbour] -= usize::from(acts(k, neighbour));
            acted[neighbour] -= usize::from(acts(neighbour, k));
            if acting[neighbour] == 0 || acted[neighbour] == 0 {
                next.push(neighbour);
            }
        }
    }
    let (coupled, isolated) = (0..n).partition(|&k| unvisited[k]);
    [isolated, coupled]
}

#[cfg(test)]
#[path = "../../tests/unit/num/block_triangular.rs"]
mod tests;
