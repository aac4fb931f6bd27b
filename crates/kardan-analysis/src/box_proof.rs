//! Proofs that a matrix with toleranced entries has independent columns at every λ: branch and bound over λ and the box of tolerances.

mod cells;
mod contraction;
mod scaled_family;

use faer::c64;

use cells::{Cells, Verdict};
use kardan_math::num::{Matrix, Rational};
use kardan_results::{Complex, Pole};
use scaled_family::{Scaled, without_constant_columns, without_constant_rows};

/// Matrices `L(λ, x) = Σₖ λᵏ (Lₖ₀ + Σᵢ xᵢ Lₖᵢ)`, `k = 0, 1, 2`, over the box `|xᵢ| ≤ 1` and all complex λ in 1/s.
///
/// A constrained mechanical system loses controllability where `[λ²H + λD + S, Cᵀ; C, 0; Fᵀ, 0]` has dependent columns;
/// toleranced parameters p enter it as `pᵢ = centreᵢ (1 + toleranceᵢ xᵢ)`.
#[derive(Debug, Clone)]
pub struct PencilBox {
    /// `L₀₀, L₁₀, L₂₀`: the coefficients of λ⁰, λ¹, λ² at `x = 0`. At least as many rows as columns.
    pub coefficients: [Matrix<Rational>; 3],
    /// `L₀ᵢ, L₁ᵢ, L₂ᵢ`: their change with each xᵢ.
    pub slopes: Vec<[Matrix<Rational>; 3]>,
}

/// The result of [`prove_box`].
#[derive(Debug, Clone, PartialEq)]
pub enum BoxProof {
    /// The columns are independent for every λ and every x in the box. A proof, rounding included.
    Proven {
        /// Cells that were looked at.
        cells: usize,
    },
    /// No proof: a loss lies in the box, or close to it, or the budget was too small.
    ///
    /// Without any cell and at zero if columns are dependent everywhere, or entries too many orders of magnitude apart.
    Undecided {
        /// Cells that were looked at.
        cells: usize,
        /// Centre of the cell that could not be decided, 1/s, imaginary part not negative.
        at: Pole,
        /// The parameter that the next subdivision would have divided; `None` for λ.
        parameter: Option<usize>,
    },
}

/// Proves that `L(λ, x)` has independent columns for every complex λ and every x of the box.
///
/// Never claims more than it has proven; a box that touches a loss is always [`BoxProof::Undecided`], which is reached
/// once cells become too small, or after `budget` cells. `progress` receives from time to time the share of the
/// cells (by volume) is done, from 0 to 1.
///
/// Method: branch and bound over `|λ| ≤ ω` and, with `μ = 1/λ`, over `|μ| ≤ 1/ω`, each a square of which the half with
/// `Im ≥ 0` suffices, times the box. The reversed polynomial is `diag(μ^aᵣ) L(1/μ, x) diag(μ^bⱼ)` with the degree bⱼ of each
/// column and the least aᵣ without negative powers: for the matrix of a constrained system, `[H, Cᵀ; C, 0; Fᵀ, 0]` at
/// `μ = 0`, so that inertias regular on the kernel of C decide the case at infinity. Rows and columns that do
/// not depend on λ and x are eliminated exactly before. In a cell `λ = c + ε, |ε| ≤ δ, x = y + wξ, |ξᵢ| ≤ 1`, for any R,
/// `R L(λ, x) = I + Δ` with `|Δ| ≤ G = |R L(c, y) − I| + Σₚ δᵖ |R ∂ᵖL(c, y)/p!| + Σᵢ wᵢ Σₚ δᵖ |R ∂ᵖLᵢ(c)/p!|` entry by entry
/// (p ≥ 1 in the first sum, p ≥ 0 in the second): no term is neglected, L is quadratic in λ and affine in x. A positive vector d
/// with `G d < d` proves that the spectral radius of Δ is below one, hence `R L` regular. R is the left inverse of `L(c, y)` that
/// is least sensitive to the uncertainties of the cell (weighted least squares); a cell that fails is divided in the direction that
/// contributes most to the spectral radius of G.
///
/// Cost per cell about `m³ + 4 m²n` complex flops for m × n matrices; the number of cells grows with the closeness of a loss,
/// and exponentially with the number of parameters that matter there.
///
/// ```
/// use kardan_analysis::{BoxProof, PencilBox, prove_box};
/// use kardan_math::num::{Matrix, Rational};
/// // λ² + 1 + x/2 over [λ + 2]: no common root.
/// let column = |a: i64, b: i64, of: u32| Matrix::from_fn(2, 1, |i, _| Rational::from_parts([a, b][i].into(), of.into()));
/// let family = PencilBox {
///     coefficients: [column(1, 2, 1), column(0, 1, 1), column(1, 0, 1)],
///     slopes: vec![[column(1, 0, 2), column(0, 0, 1), column(0, 0, 1)]],
/// };
/// assert!(matches!(prove_box(&family, 10_000, &mut |_| {}), BoxProof::Proven { .. }));
/// ```
///
/// # Panics
/// If the matrices differ in shape.
pub fn prove_box(family: &PencilBox, budget: usize, progress: &mut dyn FnMut(f64)) -> BoxProof {
    let mut parts = vec![family.coefficients.clone()];
    parts.extend(family.slopes.iter().cloned());
    let shape = (parts[0][0].rows(), parts[0][0].columns());
    for matrix in parts.iter().flatten() {
        assert_eq!((matrix.rows(), matrix.columns()), shape, "matrices of a family differ in shape");
    }
    let dependent = BoxProof::Undecided { cells: 0, at: Complex::default(), parameter: None };
    let parts = without_constant_rows(parts);
    if parts[0][0].columns() == 0 {
        return BoxProof::Proven { cells: 0 };
    }
    let Some(parts) = without_constant_columns(parts) else { return dependent };
    let (m, n) = (parts[0][0].rows(), parts[0][0].columns());
    if n == 0 {
        return BoxProof::Proven { cells: 0 };
    }
    let Some(scaled) = (if m < n { None } else { Scaled::new(&parts) }) else { return dependent };
    let mut search = Search { budget, cells: 0, done: 0.0, progress };
    for reversed in [true, false] {
        let mut cells = Cells::new(&scaled, reversed);
        // The upper half of the square in two cells.
        for re in [-0.5, 0.5] {
            let open = search.descend(&mut cells, c64::new(re, 0.5), 0.5, &vec![1.0; n], 0.25, None);
            if let Err(open) = open {
                let at = if reversed { c64::new(1.0, 0.0) / open.at } else { open.at };
                let unit = scaled.unit;
                return BoxProof::Undecided {
                    cells: search.cells,
                    at: Complex { re: at.re * unit, im: at.im.abs() * unit },
                    parameter: open.parameter,
                };
            }
        }
    }
    (search.progress)(1.0);
    BoxProof::Proven { cells: search.cells }
}

/// A cell that could not be decided.
struct Open {
    at: c64,
    parameter: Option<usize>,
}

struct Search<'a> {
    budget: usize,
    cells: usize,
    done: f64,
    progress: &'a mut dyn FnMut(f64),
}

/// Half widths below which a cell is not divided; centres then have few enough bits to be exact.
const SMALLEST: f64 = 1.0 / (1u64 << 44) as f64;

impl Search<'_> {
    /// Proves the cell with this centre and half width in λ and the box of `cells`, or divides it.
    ///
    /// `scale`: the sizes of a null vector that would be most dangerous, from the cell above.
    fn descend(
        &mut self,
        cells: &mut Cells,
        at: c64,
        half: f64,
        scale: &[f64],
        share: f64,
        divided: Option<usize>,
    ) -> Result<(), Open> {
        if self.cells >= self.budget {
            return Err(Open { at, parameter: divided });
        }
        self.cells += 1;
        let scale = match cells.decide(at, half, scale) {
            Verdict::Proven => {
                self.done += share;
                if self.cells.is_multiple_of(64) {
                    (self.progress)(self.done);
                }
                return Ok(());
            }
            Verdict::Singular => return Err(Open { at, parameter: divided }),
            Verdict::Open => cells.right.clone(),
        };
        let parameter = cells.direction();
        let Some(i) = parameter else {
            if half <= SMALLEST || cells.hopeless() {
                return Err(Open { at, parameter });
            }
            for (re, im) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
                let at = c64::new(at.re + 0.5 * half * re, at.im + 0.5 * half * im);
                self.descend(cells, at, 0.5 * half, &scale, 0.25 * share, parameter)?;
            }
            return Ok(());
        };
        let (centre, width) = (cells.centre[i], cells.width[i]);
        if width <= SMALLEST || cells.hopeless() {
            return Err(Open { at, parameter });
        }
        cells.width[i] = 0.5 * width;
        for side in [-0.5, 0.5] {
            cells.centre[i] = centre + side * width;
            self.descend(cells, at, half, &scale, 0.5 * share, parameter)?;
        }
        (cells.centre[i], cells.width[i]) = (centre, width);
        Ok(())
    }
}

#[cfg(test)]
#[path = "../tests/unit/box_proof.rs"]
mod tests;
