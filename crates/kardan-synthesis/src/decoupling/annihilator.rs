//! Rows that annihilate the reachable space, from several primes.

use kardan_math::num::{Matrix, ModularMatrix, Rational, Reconstruction, Scalar, columns_of, prime_fields, reachable};

/// The result from the primes modulo which the reachable space has the same pivots.
struct Group {
    dimension: usize,
    free: Vec<usize>,
    reconstruction: Reconstruction,
    primes: usize,
    candidate: Option<Vec<Rational>>,
}

/// All rows η with `η Aʲ B = 0` for every j: the left null space of the controllability matrix `[B AB … Aⁿ⁻¹B]`, exact.
///
/// The rows are in reduced echelon form read from the right, so a unit row that lies in the space is one of them. The shape
/// is (n − rank) × n. Method: modulo primes, brought back to fractions N and proven: `N B = 0` and `N A = M N` show that
/// N annihilates, the rank modulo a prime that there is no more.
pub(super) fn annihilator(a: &Matrix<Rational>, b: &Matrix<Rational>) -> Matrix<Rational> {
    let n = a.rows();
    let mut groups: Vec<Group> = Vec::new();
    for field in prime_fields() {
        let image = |m: &Matrix<Rational>| ModularMatrix::from_rational(&field, m);
        let Some((image_a, image_b)) = image(a).zip(image(b)) else { continue };
        let span = reachable(&field, &image_a, &image_b).span;
        let dimension = span.dimension();
        if dimension == n {
            return Matrix::zeros(0, n);
        }
        if groups.iter().any(|group| group.dimension > dimension) {
            continue;
        }
        groups.retain(|group| group.dimension == dimension);
        let (basis, pivots) = span.echelon(&field, n);
        let free: Vec<usize> = (0..n).filter(|j| !pivots.contains(j)).collect();
        let rows = basis.null_space(&field);
        let values: Vec<u64> = (0..rows.rows)
            .flat_map(|i| pivots.iter().map(|&j| field.value(rows.row(i)[j])).collect::<Vec<_>>())
            .collect();
        let at = groups.iter().position(|group| group.free == free).unwrap_or_else(|| {
            let reconstruction = Reconstruction::new();
            groups.push(Group { dimension, free, reconstruction, primes: 0, candidate: None });
            groups.len() - 1
        });
        let group = &mut groups[at];
        group.reconstruction.add(field.prime(), &values);
        group.primes += 1;
        // A candidate of earlier primes that agrees with this one is worth a proof.
        if let Some(candidate) = group.candidate.take_if(|c| group.reconstruction.agrees(field.prime(), c)) {
            let rows = assemble(n, &group.free, &pivots, &candidate);
            if is_proven(&rows, &group.free, a, b) {
                return rows;
            }
        }
        if group.primes.is_power_of_two() {
            group.candidate = group.reconstruction.fractions();
        }
    }
    unreachable!("there are more primes than any fraction needs")
}

fn assemble(n: usize, free: &[usize], pivots: &[usize], values: &[Rational]) -> Matrix<Rational> {
    let mut out = Matrix::<Rational>::zeros(free.len(), n);
    for (i, &column) in free.iter().enumerate() {
        out[(i, column)] = Rational::ONE;
        for (k, &pivot) in pivots.iter().enumerate() {
            out[(i, pivot)] = values[i * pivots.len() + k].clone();
        }
    }
    out
}

fn is_proven(rows: &Matrix<Rational>, free: &[usize], a: &Matrix<Rational>, b: &Matrix<Rational>) -> bool {
    if rows.multiply(b).as_slice().iter().any(|x| !Scalar::is_zero(x)) {
        return false;
    }
    let image = rows.multiply(a);
    columns_of(&image, free).multiply(rows) == image
}

#[cfg(test)]
#[path = "../../tests/unit/decoupling/annihilator.rs"]
mod tests;
