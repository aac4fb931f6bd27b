//! Krylov spaces over a prime field: spans, reachable subspaces, quotients.

use super::{ModularMatrix, Operator, PrimeField, Residue};

/// A growing subspace with a basis in echelon form.
///
/// Every basis vector stores its combination of the vectors of the current chain (see [`Span::insert`]).
#[derive(Debug, Clone, Default)]
pub struct Span {
    /// The basis vectors as columns: `coordinates[i][k]` is entry i of vector k. Sums over vectors run through memory in
    /// order and are reduced once.
    coordinates: Vec<Vec<Residue>>,
    /// Coefficients over the vectors of the chain; empty for vectors of earlier chains.
    made_of: Vec<Vec<Residue>>,
    /// Pivot position of each vector.
    pub pivots: Vec<usize>,
    /// Entry at the pivot when the vector was added.
    sizes: Vec<Residue>,
    chain: usize,
}

impl Span {
    /// The dimension.
    pub fn dimension(&self) -> usize {
        self.pivots.len()
    }

    /// Forgets how earlier vectors were made: what follows is counted modulo the span so far.
    pub fn start_chain(&mut self) {
        self.made_of.iter_mut().for_each(Vec::clear);
        self.chain = 0;
    }

    /// Adds the next vector of the chain. If it depends on the others, gives the coefficients c with
    /// `v = Σ c_j v_j` modulo earlier chains.
    ///
    /// # Panics
    /// If the vectors differ in length.
    pub fn insert(&mut self, field: &PrimeField, vector: &[Residue]) -> Option<Vec<Residue>> {
        if self.coordinates.is_empty() {
            self.coordinates = vec![Vec::new(); vector.len()];
        }
        assert_eq!(self.coordinates.len(), vector.len(), "a vector of a different length");
        // How often each basis vector is contained: triangular, as a vector has zeros at the pivots of those before it. Where
        // none is contained yet, there is no sum (vectors of a chain of integrators are units).
        let mut factors: Vec<Residue> = Vec::with_capacity(self.dimension());
        let mut first = self.dimension();
        for (k, &pivot) in self.pivots.iter().enumerate() {
            let from = first.min(k);
            let factor = field.minus(vector[pivot], field.dot(&factors[from..], &self.coordinates[pivot][from..k]));
            if factor != 0 {
                first = from;
            }
            factors.push(factor);
        }
        let mut v = vector.to_vec();
        self.pivots.iter().for_each(|&pivot| v[pivot] = 0);
        if first < self.dimension() {
            let mut is_pivot = vec![false; v.len()];
            self.pivots.iter().for_each(|&pivot| is_pivot[pivot] = true);
            for (i, x) in v.iter_mut().enumerate().filter(|(i, _)| !is_pivot[*i]) {
                *x = field.minus(*x, field.dot(&factors[first..], &self.coordinates[i][first..]));
            }
        }
        let mut combination = vec![0; self.chain];
        if self.chain > 0 {
            for (factor, made_of) in factors.into_iter().zip(&self.made_of).skip(first) {
                field.subtract(&mut combination, field.negate(factor), made_of);
            }
        }
        let Some(pivot) = v.iter().position(|&x| x != 0) else { return Some(combination) };
        let size = v[pivot];
        let inverse = field.inverse(size);
        for (x, coordinate) in v.into_iter().zip(&mut self.coordinates) {
            coordinate.push(field.times(x, inverse));
        }
        combination.iter_mut().for_each(|x| *x = field.negate(field.times(*x, inverse)));
        combination.push(inverse);
        self.made_of.push(combination);
        self.pivots.push(pivot);
        self.sizes.push(size);
        self.chain += 1;
        None
    }

    /// The minor of the vectors added (those that were independent), one column each, in the rows of the pivots, sorted.
    pub fn minor(&self, field: &PrimeField) -> Residue {
        // In the order of the pivots the reduced vectors are triangular.
        let product = self.sizes.iter().fold(field.one(), |all, &x| field.times(all, x));
        let disorder = |k: usize| self.pivots[..k].iter().filter(|&&p| p > self.pivots[k]).count();
        let swaps: usize = (0..self.pivots.len()).map(disorder).sum();
        if swaps.is_multiple_of(2) { product } else { field.negate(product) }
    }

    /// The basis of vectors of length n, one row each.
    pub fn basis(&self, n: usize) -> ModularMatrix {
        ModularMatrix::from_fn(self.dimension(), n, |i, j| self.coordinates[j][i])
    }

    /// The basis in reduced row echelon form with its pivots.
    pub fn echelon(&self, field: &PrimeField, n: usize) -> (ModularMatrix, Vec<usize>) {
        self.basis(n).echelon(field)
    }
}

/// The part of a space that a matrix and starting columns reach: `span [B, GB, G²B, …]`.
#[derive(Debug, Clone)]
pub struct Reachable {
    /// `(column of B, power)` of independent vectors that span it.
    pub columns: Vec<(usize, usize)>,
    /// The subspace.
    pub span: Span,
}

/// The reachable part, power by power (the order of the controllability indices).
pub fn reachable(field: &PrimeField, g: &ModularMatrix, b: &ModularMatrix) -> Reachable {
    let mut span = Span::default();
    let operator = Operator::new(g);
    let mut columns = Vec::new();
    let mut chains: Vec<(usize, Vec<Residue>)> = (0..b.columns).map(|j| (j, b.column(j))).collect();
    let mut power = 0;
    while !chains.is_empty() && span.dimension() < g.rows {
        chains.retain(|(input, vector)| {
            let new = span.dimension() < g.rows && {
                span.start_chain();
                span.insert(field, vector).is_none()
            };
            if new {
                columns.push((*input, power));
            }
            new
        });
        if span.dimension() < g.rows {
            chains.iter_mut().for_each(|(_, vector)| *vector = operator.apply(field, vector));
        }
        power += 1;
    }
    Reachable { columns, span }
}

/// The action of a matrix on the quotient by an invariant subspace.
pub fn quotient_action(field: &PrimeField, g: &ModularMatrix, span: &Span) -> ModularMatrix {
    let n = g.rows;
    let (form, pivots) = span.echelon(field, n);
    let free: Vec<usize> = (0..n).filter(|j| !pivots.contains(j)).collect();
    let columns: Vec<Vec<Residue>> = free
        .iter()
        .map(|&j| {
            let mut v = g.column(j);
            for (i, &pivot) in pivots.iter().enumerate() {
                let factor = v[pivot];
                if factor != 0 {
                    field.subtract(&mut v, factor, form.row(i));
                }
            }
            v
        })
        .collect();
    ModularMatrix::from_fn(free.len(), free.len(), |i, j| columns[j][free[i]])
}

#[cfg(test)]
#[path = "../../tests/unit/num/reachable.rs"]
mod tests;
