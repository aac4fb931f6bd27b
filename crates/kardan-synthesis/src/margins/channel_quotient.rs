//! One channel of a response as a quotient of polynomials.

use dashu_int::ops::UnsignedAbs;
use dashu_int::{IBig, UBig};
use faer::c64;
use kardan_rt::functions::exp;

use kardan_math::num::{
    Polynomial, Rational, Scalar, common_denominator, golden, is_hurwitz, rational_from_f64, rational_to_f64,
};

/// Part of a peak by which a level is above it.
pub(super) const LEVEL: f64 = 1e-9;
/// The search range of a peak around a frequency, in the logarithm.
const BESIDE: f64 = 0.3;
/// Levels that are tried.
const ROUNDS: usize = 60;

/// `M(s) = n(s)/d(s)` without common roots. The coefficients are exact for the numbers of a realisation, so that no digits are lost where these are of very
/// different sizes: the error of M is that of the rounding of those numbers alone.
pub(super) struct OneChannel {
    numerator: Polynomial,
    denominator: Polynomial,
    n: OnAxis,
    d: OnAxis,
    /// The coefficients of both, as many of each, whole numbers.
    whole: [Vec<IBig>; 2],
}

/// A polynomial on the imaginary axis: `p(jω) = e(ω²) + jω o(ω²)`.
struct OnAxis {
    even: Polynomial,
    odd: Polynomial,
}

impl OnAxis {
    fn new(polynomial: &Polynomial) -> Self {
        let part = |first: usize| {
            let every = polynomial.coefficients().iter().skip(first).step_by(2).enumerate();
            Polynomial::new(every.map(|(k, c)| if k % 2 == 0 { c.clone() } else { -c.clone() }).collect())
        };
        Self { even: part(0), odd: part(1) }
    }

    /// `|p(jω)|²` over ω².
    fn square(&self) -> Polynomial {
        self.even.times(&self.even).plus(&by_square(&self.odd.times(&self.odd)))
    }
}

/// `x p(x)`
fn by_square(polynomial: &Polynomial) -> Polynomial {
    polynomial.times(&Polynomial::new(vec![Rational::ZERO, Rational::ONE]))
}

fn minus(a: &Polynomial, b: &Polynomial) -> Polynomial {
    a.plus(&b.scale(&Rational::NEG_ONE))
}

/// Real and imaginary part of `qᵐ p(j a/q)` with the highest power m that has a coefficient: of whole numbers without one fraction.
fn homogeneous(coefficients: &[IBig], a: &IBig, q: &UBig) -> [IBig; 2] {
    let mut power = IBig::ONE;
    let q = IBig::from(q.clone());
    coefficients.iter().rev().fold([IBig::ZERO, IBig::ZERO], |[re, im], c| {
        let next = [c * &power - im * a, re * a];
        power *= &q;
        next
    })
}

/// Square roots of the positive real roots, ascending.
fn places(over_square: &Polynomial) -> Vec<f64> {
    if over_square.degree() == 0 {
        return Vec::new();
    }
    over_square.positive_roots().into_iter().map(f64::sqrt).collect()
}

impl OneChannel {
    /// # Panics
    /// If the denominator is zero.
    pub fn new(numerator: &Polynomial, denominator: &Polynomial) -> Self {
        let common = numerator.gcd(denominator);
        let parts = [numerator, denominator].map(|of| of.divide(&common).0);
        // Whole numbers, of which sums and products cost least.
        let scale = common_denominator(parts.iter().flat_map(|part| part.coefficients()));
        let [numerator, denominator] = parts.map(|part| part.scale(&Rational::from(scale.clone())));
        let [n, d] = [&numerator, &denominator].map(OnAxis::new);
        let count = numerator.degree().max(denominator.degree()) + 1;
        let whole = [&numerator, &denominator].map(|of| {
            let mut coefficients = of.whole_coefficients();
            coefficients.resize(count, IBig::ZERO);
            coefficients
        });
        Self { numerator, denominator, n, d, whole }
    }

    /// M + ½
    pub fn balanced(&self) -> Self {
        let two = Rational::from(2);
        Self::new(&self.numerator.scale(&two).plus(&self.denominator), &self.denominator.scale(&two))
    }

    /// How many poles are at zero.
    pub fn poles_at_zero(&self) -> usize {
        self.denominator.coefficients().iter().take_while(|c| Scalar::is_zero(*c)).count()
    }

    /// M at a place on the imaginary axis; infinite at a pole.
    pub fn at(&self, place: f64) -> c64 {
        let (n, d) = (&self.numerator, &self.denominator);
        let Some(omega) = rational_from_f64(place) else {
            let last = d.coefficient(d.degree());
            let ratio = if n.degree() < d.degree() { Rational::ZERO } else { n.coefficient(d.degree()).over(&last) };
            return c64::new(rational_to_f64(&ratio), 0.0);
        };
        let [[a, b], [c, d]] = self.whole.each_ref().map(|of| homogeneous(of, omega.numerator(), omega.denominator()));
        let size = (&c * &c + &d * &d).unsigned_abs();
        if size.is_zero() {
            return c64::new(f64::INFINITY, 0.0);
        }
        let part = |sum: IBig| rational_to_f64(&Rational::from_parts(sum, size.clone()));
        c64::new(part(&a * &c + &b * &d), part(b * c - a * d))
    }

    /// The size of M at a place.
    fn size(&self, place: f64) -> f64 {
        let m = self.at(place);
        kardan_rt::functions::hypot(m.re, m.im)
    }

    /// All places at which M has this size, but for zero and infinity.
    pub fn level(&self, level: f64) -> Vec<f64> {
        let square = rational_from_f64(level).map(|level| level.times(&level)).unwrap_or_default();
        places(&minus(&self.n.square(), &self.d.square().scale(&square)))
    }

    /// The largest size of M over all frequencies, and its place; infinite at a pole on the axis.
    ///
    /// From the largest size at some frequencies the roots of `|n|² = γ² |d|²` show between which frequencies it is exceeded, the middles of these give the next
    /// γ, until no frequency exceeds it (Bruinsma and Steinbuch 1990): no peak is too narrow. Before, the frequency of the largest is refined where `near` is about the
    /// size of M, so that most often one round is enough.
    pub fn peak(&self, starts: &[f64], near: &dyn Fn(f64) -> f64) -> (f64, f64) {
        let mut best = (0.0f64, 0.0f64);
        let evaluate = |place: f64, best: &mut (f64, f64)| {
            let size = self.size(place);
            if size > best.0 {
                *best = (size, place);
            }
        };
        let mut first = (0.0, 0.0);
        for &place in starts {
            match near(place) {
                size if !size.is_finite() => evaluate(place, &mut best),
                size if size > first.0 => first = (size, place),
                _ => {}
            }
        }
        for place in [0.0, f64::INFINITY, first.1] {
            evaluate(place, &mut best);
        }
        if best.0 == 0.0 && self.numerator.is_zero() {
            return best;
        }
        let middle = best.1;
        if best.0.is_finite() && middle > 0.0 && middle.is_finite() {
            evaluate(middle * exp(golden(-BESIDE, BESIDE, &|x| -near(middle * exp(x)))), &mut best);
        }
        for _ in 0..ROUNDS {
            let before = best.0;
            let places = if before.is_finite() { self.level(before * (1.0 + LEVEL)) } else { Vec::new() };
            for (k, place) in places.iter().enumerate() {
                evaluate(places.get(k + 1).map_or(2.0 * place, |next| (place * next).sqrt()), &mut best);
                evaluate(*place, &mut best);
            }
            if best.0 <= before * (1.0 + LEVEL) {
                break;
            }
        }
        best
    }

    /// Places at which M is real, but for zero and infinity.
    pub fn real(&self) -> Vec<f64> {
        places(&minus(&self.n.odd.times(&self.d.even), &self.n.even.times(&self.d.odd)))
    }

    /// Places at which M has the real part −½, but for zero and infinity.
    pub fn half(&self) -> Vec<f64> {
        let real_part = self.n.even.times(&self.d.even).plus(&by_square(&self.n.odd.times(&self.d.odd)));
        places(&real_part.scale(&Rational::from(2)).plus(&self.d.square()))
    }

    /// Whether the loop is stable with this factor of the channel: all roots of `d − (factor − 1) n` are in the left half plane.
    pub fn stable_with(&self, factor: f64) -> bool {
        let more = rational_from_f64(factor - 1.0).unwrap_or_default();
        is_hurwitz(&minus(&self.denominator, &self.numerator.scale(&more)))
    }

    /// Of one pole at zero, r and m of `M = r/s + m + …` there, and on which side of `|factor| = 1` the loop is stable next to one: whether turns of the
    /// phase, however small, make it unstable.
    pub fn at_pole(&self) -> (f64, bool) {
        let (n, d) = (&self.numerator, &self.denominator);
        let r = n.coefficient(0).over(&d.coefficient(1));
        let m = n.coefficient(1).minus(&r.times(&d.coefficient(2))).over(&d.coefficient(1));
        let half = m.plus(&Rational::ONE.over(&Rational::from(2)));
        (rational_to_f64(&r), (r > Rational::ZERO) != (half > Rational::ZERO))
    }
}
