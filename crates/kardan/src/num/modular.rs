use super::{Matrix, Operator, PrimeField, Primes, Random, Rational, Reconstruction, Residue, recurrence};

/// A matrix over a [`PrimeField`], row by row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModularMatrix {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
    data: Vec<Residue>,
}

impl ModularMatrix {
    /// Zeros.
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Self { rows, columns, data: vec![0; rows * columns] }
    }

    /// Ones on the diagonal.
    pub fn identity(field: &PrimeField, n: usize) -> Self {
        let mut out = Self::zeros(n, n);
        for i in 0..n {
            out.data[i * n + i] = field.one();
        }
        out
    }

    /// Entry by entry.
    pub fn from_fn(rows: usize, columns: usize, mut f: impl FnMut(usize, usize) -> Residue) -> Self {
        let data = (0..rows * columns).map(|k| f(k / columns, k % columns)).collect();
        Self { rows, columns, data }
    }

    /// The image of a rational matrix; `None` if p divides a denominator.
    pub fn from_rational(field: &PrimeField, matrix: &Matrix<Rational>) -> Option<Self> {
        let data = matrix
            .as_slice()
            .iter()
            .map(|x| if x.is_zero() { Some(0) } else { field.rational(x) })
            .collect::<Option<Vec<_>>>()?;
        Some(Self { rows: matrix.rows(), columns: matrix.columns(), data })
    }

    /// Uniform entries.
    pub fn random(field: &PrimeField, rows: usize, columns: usize, random: &mut Random) -> Self {
        Self::from_fn(rows, columns, |_, _| random.below(field.prime()))
    }

    /// Row `i`.
    pub fn row(&self, i: usize) -> &[Residue] {
        &self.data[i * self.columns..(i + 1) * self.columns]
    }

    /// Row `i`.
    pub fn row_mut(&mut self, i: usize) -> &mut [Residue] {
        &mut self.data[i * self.columns..(i + 1) * self.columns]
    }

    /// Column `j`.
    pub fn column(&self, j: usize) -> Vec<Residue> {
        (0..self.rows).map(|i| self.data[i * self.columns + j]).collect()
    }

    /// The transpose.
    pub fn transpose(&self) -> Self {
        Self::from_fn(self.columns, self.rows, |i, j| self.data[j * self.columns + i])
    }

    /// `self · x`.
    pub fn apply(&self, field: &PrimeField, x: &[Residue]) -> Vec<Residue> {
        (0..self.rows).map(|i| field.dot(self.row(i), x)).collect()
    }

    /// `self · other`.
    pub fn multiply(&self, field: &PrimeField, other: &Self) -> Self {
        let mut out = Self::zeros(self.rows, other.columns);
        let mut columns = None;
        for i in 0..self.rows {
            let row = self.row(i);
            if 4 * row.iter().filter(|&&x| x != 0).count() < row.len() {
                for (k, &x) in row.iter().enumerate().filter(|(_, x)| **x != 0) {
                    field.subtract(out.row_mut(i), field.negate(x), other.row(k));
                }
            } else {
                let columns = columns.get_or_insert_with(|| other.transpose());
                for (j, x) in out.row_mut(i).iter_mut().enumerate() {
                    *x = field.dot(row, columns.row(j));
                }
            }
        }
        out
    }

    /// `self + factor · other`.
    pub fn plus(&self, field: &PrimeField, factor: Residue, other: &Self) -> Self {
        let mut out = self.clone();
        field.subtract(&mut out.data, field.negate(factor), &other.data);
        out
    }

    /// The solution X of `self · X = right` and the determinant of `self`; `None` if it is singular.
    pub fn solve(&self, field: &PrimeField, right: &Self) -> Option<(Self, Residue)> {
        let (n, width) = (self.rows, self.columns + right.columns);
        let mut joined =
            Self::from_fn(
                n,
                width,
                |i, j| {
                    if j < n { self.data[i * n + j] } else { right.data[i * right.columns + j - n] }
                },
            );
        let mut determinant = field.one();
        for k in 0..n {
            let pivot = (k..n).find(|&i| joined.data[i * width + k] != 0)?;
            if pivot != k {
                joined.swap(pivot, k);
                determinant = field.negate(determinant);
            }
            determinant = field.times(determinant, joined.data[k * width + k]);
            joined.clear(field, k, k, k);
        }
        Some((Self::from_fn(n, right.columns, |i, j| joined.data[i * width + n + j]), determinant))
    }

    /// The determinant.
    ///
    /// # Panics
    /// If the matrix is not square.
    pub fn determinant(&self, field: &PrimeField) -> Residue {
        assert_eq!(self.rows, self.columns, "the determinant of a matrix that is not square");
        let n = self.rows;
        let mut rest = self.clone();
        let mut determinant = field.one();
        for k in 0..n {
            let Some(pivot) = (k..n).find(|&i| rest.data[i * n + k] != 0) else { return 0 };
            if pivot != k {
                rest.swap(pivot, k);
                determinant = field.negate(determinant);
            }
            determinant = field.times(determinant, rest.data[k * n + k]);
            let inverse = field.inverse(rest.data[k * n + k]);
            let row = rest.row(k)[k..].to_vec();
            for i in k + 1..n {
                let factor = rest.data[i * n + k];
                if factor != 0 {
                    field.subtract(&mut rest.data[i * n + k..(i + 1) * n], field.times(factor, inverse), &row);
                }
            }
        }
        determinant
    }

    /// Exchanges two rows.
    fn swap(&mut self, i: usize, j: usize) {
        for k in 0..self.columns {
            self.data.swap(i * self.columns + k, j * self.columns + k);
        }
    }

    /// Divides row `pivot` by its entry in `column` and clears that column in all other rows; entries left of `from` of
    /// the pivot row are zero.
    fn clear(&mut self, field: &PrimeField, pivot: usize, column: usize, from: usize) {
        let width = self.columns;
        let inverse = field.inverse(self.data[pivot * width + column]);
        for x in &mut self.data[pivot * width + from..(pivot + 1) * width] {
            *x = field.times(*x, inverse);
        }
        let row = self.data[pivot * width + from..(pivot + 1) * width].to_vec();
        for i in 0..self.rows {
            let factor = self.data[i * width + column];
            if i != pivot && factor != 0 {
                field.subtract(&mut self.data[i * width + from..(i + 1) * width], factor, &row);
            }
        }
    }

    /// Brings the matrix to reduced row echelon form, drops zero rows and gives the pivot columns.
    pub fn echelon(mut self, field: &PrimeField) -> (Self, Vec<usize>) {
        let mut pivots = Vec::new();
        for column in 0..self.columns {
            let rank = pivots.len();
            let Some(pivot) = (rank..self.rows).find(|&i| self.data[i * self.columns + column] != 0) else { continue };
            self.swap(rank, pivot);
            self.clear(field, rank, column, column);
            pivots.push(column);
        }
        self.rows = pivots.len();
        self.data.truncate(self.rows * self.columns);
        (self, pivots)
    }

    /// A basis of `{x : self · x = 0}`, one row per vector, in reduced row echelon form read from the right.
    pub fn null_space(self, field: &PrimeField) -> Self {
        let n = self.columns;
        let (form, pivots) = self.echelon(field);
        let free: Vec<usize> = (0..n).filter(|j| !pivots.contains(j)).collect();
        let mut out = Self::zeros(free.len(), n);
        for (k, &j) in free.iter().enumerate() {
            out.data[k * n + j] = field.one();
            for (i, &pivot) in pivots.iter().enumerate() {
                out.data[k * n + pivot] = field.negate(form.data[i * n + j]);
            }
        }
        out
    }

    /// Coefficients of `det(xI − self)`, of 1, x, x², …; leading coefficient one.
    ///
    /// Method: similarity to Hessenberg form, then the recursion on its leading minors; O(n³).
    pub fn characteristic_polynomial(&self, field: &PrimeField) -> Vec<Residue> {
        let n = self.rows;
        let mut h = self.clone();
        for k in 1..n.saturating_sub(1) {
            let Some(pivot) = (k..n).find(|&i| h.data[i * n + k - 1] != 0) else { continue };
            if pivot != k {
                h.swap(pivot, k);
                for i in 0..n {
                    h.data.swap(i * n + pivot, i * n + k);
                }
            }
            let inverse = field.inverse(h.data[k * n + k - 1]);
            let row = h.row(k).to_vec();
            let mut factors = vec![0; n];
            for i in k + 1..n {
                let factor = field.times(h.data[i * n + k - 1], inverse);
                if factor != 0 {
                    field.subtract(&mut h.data[i * n..(i + 1) * n], factor, &row);
                    factors[i] = factor;
                }
            }
            for i in 0..n {
                let sum = field.dot(&h.data[i * n + k + 1..(i + 1) * n], &factors[k + 1..]);
                h.data[i * n + k] = field.plus(h.data[i * n + k], sum);
            }
        }
        // p_k(x) = (x − h_kk) p_{k−1} − Σ_j h_jk (Π_{i=j+1..k} h_{i,i−1}) p_{j−1}
        let mut polynomials: Vec<Vec<Residue>> = vec![vec![field.one()]];
        for k in 0..n {
            let mut next = vec![0; k + 2];
            next[1..].copy_from_slice(&polynomials[k]);
            let mut product = field.one();
            for j in (0..=k).rev() {
                let factor = field.times(h.data[j * n + k], product);
                field.subtract(&mut next, factor, &polynomials[j]);
                if j > 0 {
                    product = field.times(product, h.data[j * n + j - 1]);
                }
            }
            polynomials.push(next);
        }
        polynomials.swap_remove(n)
    }
}

/// The rank of a rational matrix, exact.
///
/// A minor that does not vanish modulo a prime proves that the rank is not smaller. Null vectors, found modulo primes, brought
/// back to fractions and checked, prove that it is not larger. Cost: O(n³) for a regular matrix; otherwise that for each of as
/// many primes as the fractions need.
///
/// ```
/// use kardan::num::{Matrix, Rational, exact_rank};
/// let p = Rational::from((1u64 << 61) - 1);
/// let m = Matrix::from_fn(2, 2, |i, j| if i == j { p.clone() } else { Rational::ZERO });
/// assert_eq!((exact_rank(&m), exact_rank(&Matrix::from_fn(2, 3, |_, _| p.clone()))), (2, 1));
/// ```
pub fn exact_rank(matrix: &Matrix<Rational>) -> usize {
    let (rows, columns) = (matrix.rows(), matrix.columns());
    let (mut best, mut groups) = (0, Vec::<(Vec<usize>, Reconstruction, usize)>::new());
    for prime in Primes::new(1) {
        let field = PrimeField::new(prime);
        let Some(image) = ModularMatrix::from_rational(&field, matrix) else { continue };
        let (form, pivots) = image.echelon(&field);
        let rank = pivots.len();
        if rank == rows.min(columns) {
            return rank;
        }
        if rank < best {
            continue;
        }
        if rank > best {
            (best, groups) = (rank, Vec::new());
        }
        let free: Vec<usize> = (0..columns).filter(|j| !pivots.contains(j)).collect();
        let values = (0..rank).flat_map(|i| free.iter().map(move |&j| (i, j)));
        let values: Vec<u64> = values.map(|(i, j)| field.value(form.row(i)[j])).collect();
        let at = groups.iter().position(|(other, ..)| *other == pivots).unwrap_or_else(|| {
            groups.push((pivots, Reconstruction::new(), 0));
            groups.len() - 1
        });
        let (pivots, known, primes) = &mut groups[at];
        known.add(prime, &values);
        *primes += 1;
        let Some(found) = primes.is_power_of_two().then(|| known.fractions()).flatten() else { continue };
        // Column j is that combination of the pivot columns.
        let depends = |k: usize, i: usize| {
            let sum =
                (0..rank).fold(Rational::ZERO, |sum, l| sum + &matrix[(i, pivots[l])] * &found[l * free.len() + k]);
            sum == matrix[(i, free[k])]
        };
        if (0..free.len()).all(|k| (0..rows).all(|i| depends(k, i))) {
            return rank;
        }
    }
    unreachable!("there are more primes than any fraction needs")
}

/// A growing subspace with a basis in echelon form.
///
/// Every basis vector remembers how it was made of the vectors of the current chain (see [`Span::insert`]).
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
        assert_eq!(self.coordinates.len(), vector.len(), "a vector of another length");
        // How often each basis vector is contained: triangular, as a vector has zeros at the pivots of those before it.
        let mut factors: Vec<Residue> = Vec::with_capacity(self.dimension());
        for (k, &pivot) in self.pivots.iter().enumerate() {
            let before = field.dot(&factors, &self.coordinates[pivot][..k]);
            factors.push(field.minus(vector[pivot], before));
        }
        let mut v = vector.to_vec();
        self.pivots.iter().for_each(|&pivot| v[pivot] = 0);
        let mut is_pivot = vec![false; v.len()];
        self.pivots.iter().for_each(|&pivot| is_pivot[pivot] = true);
        for (i, x) in v.iter_mut().enumerate().filter(|(i, _)| !is_pivot[*i]) {
            *x = field.minus(*x, field.dot(&factors, &self.coordinates[i]));
        }
        let mut combination = vec![0; self.chain];
        if self.chain > 0 {
            for (factor, made_of) in factors.into_iter().zip(&self.made_of) {
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

    /// The basis in reduced row echelon form with its pivots.
    pub fn echelon(&self, field: &PrimeField, n: usize) -> (ModularMatrix, Vec<usize>) {
        ModularMatrix::from_fn(self.dimension(), n, |i, j| self.coordinates[j][i]).echelon(field)
    }
}

/// The part of a space that a matrix and starting columns reach: `span [B, GB, G²B, …]`.
#[derive(Debug, Clone)]
pub struct Reachable {
    /// `(column of B, power)` of independent vectors that span it.
    pub columns: Vec<(usize, usize)>,
    /// These vectors, one row each.
    pub vectors: Vec<Vec<Residue>>,
    /// The subspace.
    pub span: Span,
}

/// The reachable part, power by power (the order of the controllability indices).
pub fn reachable(field: &PrimeField, g: &ModularMatrix, b: &ModularMatrix) -> Reachable {
    let mut span = Span::default();
    let operator = Operator::new(g);
    let (mut columns, mut vectors) = (Vec::new(), Vec::new());
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
                vectors.push(vector.clone());
            }
            new
        });
        if span.dimension() < g.rows {
            chains.iter_mut().for_each(|(_, vector)| *vector = operator.apply(field, vector));
        }
        power += 1;
    }
    Reachable { columns, vectors, span }
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

/// The non-trivial invariant factors of `sI − G`, each dividing the next, monic, coefficients of 1, s, s², …
///
/// The vectors drawn decide about the time only, never about the answer:
///
/// - If a sequence `uᵀGᵏv` obeys no recurrence shorter than n, the recurrence of degree n is that of the characteristic
///   polynomial and there is one factor (the minimal polynomial has degree n).
/// - Otherwise chains `v, Gv, G²v, …` fill the space one after the other. Chain k ends with
///   `f_k(G) v_k = Σ_{j<k} h_kj(G) v_j`. It is checked that f_k divides f_{k−1} and all h_kj: then the vectors
///   `v_k − Σ (h_kj/f_k)(G) v_j`, corrected in turn, generate the space as a direct sum of cyclic parts with annihilators
///   `f_1, f_2, …`, so these are the invariant factors. Chains that fail (probability below n²/p) are drawn anew.
///
/// O(n³); O(n²) for a sparse matrix with one factor.
pub fn invariant_factors(field: &PrimeField, g: &ModularMatrix, random: &mut Random) -> Vec<Vec<Residue>> {
    let n = g.rows;
    if n == 0 {
        return Vec::new();
    }
    let operator = Operator::new(g);
    let mut draw = || (0..n).map(|_| random.below(field.prime())).collect::<Vec<Residue>>();
    let (left, mut v) = (draw(), draw());
    let mut sequence = Vec::with_capacity(2 * n);
    for _ in 0..2 * n {
        sequence.push(field.dot(&left, &v));
        v = operator.apply(field, &v);
    }
    let whole = recurrence(field, &sequence);
    if whole.len() == n + 1 {
        return vec![whole];
    }
    loop {
        if let Some(factors) = chain_factors(field, &operator, n, &mut draw) {
            return factors;
        }
    }
}

/// One attempt with chains; `None` if the vectors were special.
fn chain_factors(
    field: &PrimeField,
    operator: &Operator,
    n: usize,
    mut draw: impl FnMut() -> Vec<Residue>,
) -> Option<Vec<Vec<Residue>>> {
    use super::modular_polynomial::remainder;
    let mut span = Span::default();
    let mut begins = Vec::new();
    let mut factors: Vec<Vec<Residue>> = Vec::new();
    while span.dimension() < n {
        let begin = span.dimension();
        let mut v = draw();
        let relation = loop {
            match span.insert(field, &v) {
                None => v = operator.apply(field, &v),
                Some(relation) => break relation,
            }
        };
        let mut factor: Vec<Residue> = relation[begin..].iter().map(|&c| field.negate(c)).collect();
        factor.push(field.one());
        let earlier = begins.iter().enumerate().map(|(k, &from)| &relation[from..*begins.get(k + 1).unwrap_or(&begin)]);
        let splits = earlier.chain(factors.last().map(Vec::as_slice)).all(|h| remainder(field, h, &factor).is_empty());
        if factor.len() == 1 || !splits {
            return None;
        }
        begins.push(begin);
        factors.push(factor);
    }
    factors.reverse();
    Some(factors)
}

#[cfg(test)]
mod tests {
    use super::super::modular_polynomial::product;
    use super::*;
    use crate::num::random_prime;

    fn field() -> PrimeField {
        PrimeField::new(random_prime(&mut Random::new(1)))
    }

    fn companion(f: &PrimeField, polynomial: &[Residue]) -> ModularMatrix {
        let d = polynomial.len() - 1;
        ModularMatrix::from_fn(d, d, |i, j| match (i + 1 == j, i + 1 == d) {
            (_, true) => f.negate(polynomial[j]),
            (true, _) => f.one(),
            _ => 0,
        })
    }

    /// Companion blocks of known invariant factors, hidden by a random similarity, are found again.
    #[test]
    fn hidden_invariant_factors_are_found() {
        let f = field();
        let mut random = Random::new(7);
        for _ in 0..20 {
            let linear = |x: i64| vec![f.integer(-x), f.one()];
            let (a, b, c) = (random.small(5), random.small(5), random.small(5));
            let first = linear(a);
            let second = product(&f, &first, &linear(b));
            let third = product(&f, &product(&f, &second, &linear(c)), &linear(a));
            let blocks = [companion(&f, &first), companion(&f, &second), companion(&f, &third)];
            let n = 7;
            let mut g = ModularMatrix::zeros(n, n);
            let mut at = 0;
            for block in &blocks {
                for i in 0..block.rows {
                    g.row_mut(at + i)[at..at + block.columns].copy_from_slice(block.row(i));
                }
                at += block.rows;
            }
            let t = ModularMatrix::random(&f, n, n, &mut random);
            let hidden = t.multiply(&f, &g);
            let (hidden, _) = t.transpose().solve(&f, &hidden.transpose()).unwrap();
            let hidden = hidden.transpose();
            let found = invariant_factors(&f, &hidden, &mut random);
            assert_eq!(found, [first, second, third.clone()]);
            let all = found.iter().fold(vec![f.one()], |all, next| product(&f, &all, next));
            assert_eq!(hidden.characteristic_polynomial(&f), all);
        }
    }

    /// X of `solve` solves, the determinant is multiplicative, null vectors are null vectors.
    #[test]
    fn elimination_is_what_it_says() {
        let f = field();
        let mut random = Random::new(3);
        let (a, b) = (ModularMatrix::random(&f, 6, 6, &mut random), ModularMatrix::random(&f, 6, 6, &mut random));
        let (x, determinant) = a.solve(&f, &b).unwrap();
        assert_eq!(a.multiply(&f, &x), b);
        let product = a.multiply(&f, &b).determinant(&f);
        assert_eq!(product, f.times(determinant, b.determinant(&f)));
        let wide = ModularMatrix::from_fn(4, 6, |i, j| a.row(i)[j]);
        let null = wide.clone().null_space(&f);
        assert_eq!(null.rows, 2);
        assert!((0..2).all(|k| wide.apply(&f, null.row(k)).iter().all(|&x| x == 0)));
        assert_eq!(ModularMatrix::zeros(0, 0).characteristic_polynomial(&f), [f.one()]);
    }

    /// The minor that a span keeps is the determinant; special chains are not taken for the answer.
    #[test]
    fn minors_and_defective_matrices() {
        let f = field();
        let mut random = Random::new(11);
        let m = ModularMatrix::random(&f, 5, 5, &mut random);
        let mut span = Span::default();
        (0..5).for_each(|j| assert!(span.insert(&f, &m.column(j)).is_none()));
        assert_eq!(span.minor(&f), m.determinant(&f));
        // Two Jordan blocks: the first chain starts in a proper part of the space.
        let g = ModularMatrix::from_fn(4, 4, |i, j| if j == i + 1 && i != 2 { f.one() } else { 0 });
        let factors = invariant_factors(&f, &g, &mut random);
        assert_eq!(factors, [vec![0, f.one()], vec![0, 0, 0, f.one()]]);
        let start: Vec<Vec<Residue>> = vec![vec![0, 0, 0, f.one()], vec![0, 0, f.one(), 0]];
        let mut vectors = start.into_iter();
        let special = chain_factors(&f, &Operator::new(&g), 4, || vectors.next().unwrap());
        assert_eq!(special, None);
    }

    /// The reachable part of a double chain with one input, and what is left of it.
    #[test]
    fn the_quotient_is_what_is_not_reached() {
        let f = field();
        // Diagonal 1, 2, 3; the input reaches the first two.
        let g = ModularMatrix::from_fn(3, 3, |i, j| if i == j { f.element(i as u64 + 1) } else { 0 });
        let b = ModularMatrix::from_fn(3, 1, |i, _| if i < 2 { f.one() } else { 0 });
        let part = reachable(&f, &g, &b);
        assert_eq!(part.columns, [(0, 0), (0, 1)]);
        let rest = quotient_action(&f, &g, &part.span);
        assert_eq!((rest.rows, rest.row(0)[0]), (1, f.element(3)));
    }
}
