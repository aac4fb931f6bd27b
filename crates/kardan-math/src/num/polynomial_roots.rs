//! Roots of a polynomial as doubles, and the factors that they lead to.

use dashu_int::IBig;
use kardan_rt::functions::hypot;

use super::{Polynomial, Rational, Scalar, nearby_fraction, roots};

impl Polynomial {
    /// Splits off factors of degree one and two with rational coefficients that are found by way of the roots; each is
    /// confirmed by an exact division. The rest comes last; it may factor further.
    ///
    /// # Panics
    /// If the polynomial is zero.
    pub fn simple_factors(&self) -> Vec<Self> {
        self.simple_factors_with_roots().into_iter().map(|(factor, _)| factor).collect()
    }

    /// The same with the roots of each factor, as [`proven_roots`](Self::proven_roots) gives them; where it gives none, the
    /// polynomial as it is, without roots.
    ///
    /// # Panics
    /// If the polynomial is zero.
    pub fn simple_factors_with_roots(&self) -> Vec<(Self, Vec<(f64, f64)>)> {
        let mut rest = self.clone();
        let Some(mut rest_roots) = self.proven_roots() else { return vec![(rest, Vec::new())] };
        let mut out = Vec::new();
        for (re, im) in rest_roots.clone().into_iter().filter(|root| root.1 >= 0.0) {
            let guess = if im == 0.0 {
                nearby_fraction(-re, 1e-13).map(|x| vec![x, Rational::ONE])
            } else {
                nearby_fraction(-2.0 * re, 1e-13)
                    .zip(nearby_fraction(re * re + im * im, 1e-13))
                    .map(|(x, y)| vec![y, x, Rational::ONE])
            };
            let Some(factor) = guess.map(Self::new) else { continue };
            if factor.degree() > rest.degree() || !rest.may_divide(&factor) {
                continue;
            }
            let (quotient, remainder) = rest.divide(&factor);
            if remainder.coefficients().is_empty() {
                let mut take = |root: (f64, f64)| {
                    rest_roots.iter().position(|candidate| *candidate == root).map(|at| rest_roots.remove(at))
                };
                let roots = if im == 0.0 { vec![take((re, im))] } else { vec![take((re, -im)), take((re, im))] };
                let roots = roots.into_iter().flatten().collect();
                out.push((factor, roots));
                rest = quotient;
            }
        }
        if rest.degree() > 0 {
            out.push((rest, rest_roots));
        }
        out
    }

    /// All roots, each as often as it is one, sorted by size, then imaginary part; conjugate and opposite roots are so to
    /// the last bit.
    ///
    /// They are those of [`proven_roots`](Self::proven_roots); if its bounds are not enough, floating-point estimates replace
    /// them. Decide nothing by these numbers: use exact tests of the polynomial for exact statements.
    ///
    /// ```
    /// use kardan_math::num::{Polynomial, Rational};
    /// let p = Polynomial::new([4, 0, 5, 0, 1].map(Rational::from).to_vec());
    /// assert_eq!(p.roots(), [(0.0, -1.0), (0.0, 1.0), (0.0, -2.0), (0.0, 2.0)]);
    /// ```
    ///
    /// # Panics
    /// If the polynomial is zero.
    pub fn roots(&self) -> Vec<(f64, f64)> {
        self.all_roots(|whole| Some(roots::roots(whole).unwrap_or_else(|| roots::estimates(whole)))).unwrap_or_default()
    }

    /// The same, or `None` where the roots could not be isolated with 65536 bits.
    ///
    /// Real and imaginary part of each root are off by less than 0.51 units in the last place. A part is zero if and only if
    /// it is exactly zero, so that the signs are right; what lies outside the range of doubles is their largest or smallest
    /// number.
    ///
    /// Method: square-free parts; simultaneous iteration with as many bits as it takes until discs around the iterates, their
    /// radii rounded up, contain one root each; Newton's method within each. Cost about degree² operations with 128 bits, more
    /// where roots are close to each other.
    ///
    /// # Panics
    /// If the polynomial is zero.
    pub fn proven_roots(&self) -> Option<Vec<(f64, f64)>> {
        self.all_roots(roots::roots)
    }

    /// Puts together the roots of the square-free parts.
    fn all_roots(&self, of: impl Fn(&[IBig]) -> Option<Vec<(f64, f64)>>) -> Option<Vec<(f64, f64)>> {
        assert!(!self.coefficients().is_empty(), "the zero polynomial has every number as a root");
        let zeros = self.coefficients().iter().take_while(|c| Scalar::is_zero(*c)).count();
        let mut out = vec![(0.0, 0.0); zeros];
        for (part, times) in Self::new(self.coefficients()[zeros..].to_vec()).square_free() {
            let found = of(&part.whole_coefficients())?;
            out.extend(found.into_iter().flat_map(|root| std::iter::repeat_n(root, times)));
        }
        out.sort_by(|a, b| {
            hypot(a.0, a.1).total_cmp(&hypot(b.0, b.1)).then(a.1.total_cmp(&b.1)).then(a.0.total_cmp(&b.0))
        });
        Some(out)
    }
}
