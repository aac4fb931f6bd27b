//! Roots of polynomials with whole coefficients: each in a disc of its own, refined until every digit is proven.

use dashu_int::ops::{BitTest, SquareRoot, UnsignedAbs};
use dashu_int::{IBig, UBig};
use kardan_rt::functions::{cos, exp2, log2, sin};

use super::root_sides::of_squares;
use super::wide::{Point, Size, Wide, nearest};
use super::{Matrix, Polynomial, Rational, eigenvalues};

/// Bits with which the search begins, and the most bits before it gives up.
const BITS: [usize; 2] = [128, 1 << 16];
/// Most rounds of the simultaneous iteration for one set of starting points.
const ROUNDS: usize = 2000;
/// Most Newton steps for one root.
const STEPS: usize = 100;
/// log₂ of the relative error at which a part of a root is known.
const NEGLIGIBLE: i64 = -66;

/// The roots of a square-free polynomial, coefficients of 1, s, s², … with the first and the last other than zero.
///
/// Both parts of each are off by less than 0.51 units in the last place; a part is zero if and only if it is exactly zero.
/// `None` if the bounds of the search were not enough.
///
/// Method: roots that lie symmetrically to the origin, those on the imaginary axis among them, are the roots of what even and
/// odd part have in common, `q(s²)`; they are found by way of q. All others are off the imaginary axis.
pub(super) fn roots(whole: &[IBig]) -> Option<Vec<(f64, f64)>> {
    let part = |first: usize| whole.iter().skip(first).step_by(2).cloned().map(Rational::from).collect();
    let (even, odd) = (Polynomial::new(part(0)), Polynomial::new(part(1)));
    let squares = even.gcd(&odd);
    if squares.degree() == 0 {
        return upper_half(whole, true, both_of_pair);
    }
    let mut out = upper_half(&squares.whole_coefficients(), false, square_roots)?;
    if 2 * squares.degree() + 1 < whole.len() {
        let all = Polynomial::new(whole.iter().cloned().map(Rational::from).collect());
        let rest = all.divide(&of_squares(&squares)).0;
        out.extend(upper_half(&rest.whole_coefficients(), true, both_of_pair)?);
    }
    Some(out)
}

/// The roots in plain floating point: the fallback where [`roots`] gives up.
pub(super) fn estimates(whole: &[IBig]) -> Vec<(f64, f64)> {
    let part = |x: f64, exponent: i64| nearest(&IBig::from((x * (1i64 << 60) as f64) as i64), exponent - 60);
    let points = Scaled::new(whole).starts(0);
    points.into_iter().map(|z| (part(z.re, z.exponent), part(z.im, z.exponent))).collect()
}

/// Isolates and refines all roots; `put` converts each real one and each one above the real axis to the result.
fn upper_half(whole: &[IBig], both: bool, put: impl Fn(&Point) -> Vec<(f64, f64)>) -> Option<Vec<(f64, f64)>> {
    let polynomial = Scaled::new(whole);
    let discs = (0..3).find_map(|attempt| polynomial.isolated(attempt))?;
    let mut out = Vec::new();
    for disc in discs {
        // A disc that meets the real axis overlaps its mirror image, and no other disc is near: its root is its own conjugate.
        let real = disc.height() <= disc.radius;
        if real || disc.centre.y > IBig::ZERO {
            out.extend(put(&polynomial.refined(disc, real, both)?));
        }
    }
    Some(out)
}

/// A single root, with its conjugate.
fn both_of_pair(z: &Point) -> Vec<(f64, f64)> {
    let (re, im) = (nearest(&z.x, z.exponent), nearest(&z.y, z.exponent));
    if im == 0.0 { vec![(re, im)] } else { vec![(re, im), (re, -im)] }
}

/// The numbers whose square is z or its conjugate: two for a real z, else four. z is known to 2⁻⁶⁶ of its size, its imaginary
/// part to 2⁻⁶⁶ of itself.
fn square_roots(z: &Point) -> Vec<(f64, f64)> {
    // z = (a + j b)·4ᵏ with enough bits; the root is t + j b/2t or b/2t + j t with 2t² = |z| + |a|, in units of 2ᵏ.
    let more = 200usize.saturating_sub(z.bits());
    let more = more + (z.exponent - more as i64).rem_euclid(2) as usize;
    let (a, b) = (&z.x << more, &z.y << more);
    let exponent = (z.exponent - more as i64) / 2;
    if b.is_zero() {
        let root = nearest(&IBig::from(a.clone().unsigned_abs().sqrt()), exponent);
        return if a > IBig::ZERO { vec![(root, 0.0), (-root, 0.0)] } else { vec![(0.0, root), (0.0, -root)] };
    }
    let squared: UBig = (&a * &a).unsigned_abs() + (&b * &b).unsigned_abs();
    // 2t in units of 2ᵏ, and b/2t with as many bits more as it needs.
    let doubled = IBig::from(((squared.sqrt() + a.clone().unsigned_abs()) << 1).sqrt());
    let finer = (doubled.bit_len() + 100).saturating_sub(b.bit_len());
    let large = nearest(&doubled, exponent - 1);
    let small = nearest(&((b.clone() << finer) / &doubled), exponent - finer as i64);
    let (re, im) = if a > IBig::ZERO { (large, small) } else { (small, large) };
    vec![(re, im), (re, -im), (-re, im), (-re, -im)]
}

/// A polynomial with its coefficients as numbers with exponents.
struct Scaled {
    coefficients: Vec<Point>,
    /// Coefficients of the derivative.
    derivative: Vec<Point>,
    sizes: [Vec<Size>; 2],
}

/// A value, an upper bound of its size and of its error.
#[derive(Clone, Copy)]
struct Value {
    value: Wide,
    error: Size,
}

impl Value {
    /// Whether most of it may be error.
    fn is_noise(&self) -> bool {
        self.value.size() <= self.error.scaled(1.0, 3)
    }

    fn most(&self) -> Size {
        self.value.size().scaled(1.001, 0).plus(self.error)
    }

    fn least(&self) -> Size {
        self.value.size().scaled(0.999, 0).less(self.error)
    }
}

/// Contains one root.
struct Disc {
    centre: Point,
    radius: Size,
    /// There is no other root within this distance of the centre.
    free: Size,
    /// One Newton step from the centre.
    next: Point,
}

impl Disc {
    /// Distance of the centre from the real axis.
    fn height(&self) -> Size {
        Point::real(self.centre.y.clone(), self.centre.exponent).wide().size()
    }
}

impl Scaled {
    fn new(whole: &[IBig]) -> Self {
        let coefficients: Vec<Point> = whole.iter().map(|c| Point::real(c.clone(), 0)).collect();
        let terms = whole.iter().enumerate().skip(1);
        let derivative: Vec<Point> = terms.map(|(k, c)| Point::real(c * IBig::from(k), 0)).collect();
        let sizes = [&coefficients, &derivative].map(|list| list.iter().map(|c| c.wide().size()).collect());
        Self { coefficients, derivative, sizes }
    }

    fn degree(&self) -> usize {
        self.derivative.len()
    }

    /// The coefficients of the polynomial and of its derivative, cut to this many bits.
    fn cut(&self, bits: usize) -> [Vec<Point>; 2] {
        [&self.coefficients, &self.derivative].map(|list| list.iter().map(|c| c.clone().cut(bits)).collect())
    }

    /// The value of the polynomial (`which` 0) or its derivative (1) at a point.
    ///
    /// Each operation of Horner's rule and each coefficient is off by a relative 2^(2 − bits) at most, so that the sum is off
    /// by no more than `2 (n + 2) 2^(2 − bits) Σ |c_k| |z|^k`.
    fn value(&self, cut: &[Vec<Point>; 2], which: usize, z: &Point, bits: usize) -> Value {
        let mut terms = cut[which].iter().rev();
        let first = terms.next().cloned().unwrap_or_else(|| Point::real(IBig::ZERO, 0));
        let value = terms.fold(first, |sum, c| sum.times(z).sum(c, bits)).wide();
        let size = z.wide().size();
        let sum = self.sizes[which].iter().rev().fold(Size::ZERO, |sum, c| sum.times(size).plus(*c));
        let error = sum.scaled(1.001 * (cut[which].len() + 2) as f64, 3 - bits as i64);
        Value { value, error }
    }

    /// Discs that contain one root each, and are so far from each other that Newton's method converges in each of them.
    ///
    /// Method: the simultaneous iteration of Ehrlich and Aberth with as many bits as it takes. The discs around zᵢ with the
    /// radii `n |p(zᵢ) / (a_n Π (zᵢ − z_j))|` contain as many roots as there are discs in each connected part (Smith 1970); the
    /// radii are rounded up, with the errors of p(zᵢ).
    fn isolated(&self, attempt: usize) -> Option<Vec<Disc>> {
        let n = self.degree();
        let leading = self.sizes[0][n];
        let mut bits = BITS[0];
        let mut cut = self.cut(bits);
        let mut points: Vec<Point> = self.starts(attempt).into_iter().map(Point::from_wide).collect();
        let mut values: Vec<Option<[Value; 2]>> = vec![None; n];
        let mut since = 0;
        for _ in 0..ROUNDS {
            let now: Vec<[Value; 2]> = (0..n)
                .map(|i| {
                    let both = || [0, 1].map(|which| self.value(&cut, which, &points[i], bits));
                    *values[i].get_or_insert_with(both)
                })
                .collect();
            let neighbourhoods = surroundings(&points);
            let radius =
                |i: usize| now[i][0].most().over(leading.times(neighbourhoods[i].product)).scaled(1.01 * n as f64, 0);
            let radii: Vec<Size> = (0..n).map(radius).collect();
            let open: Vec<usize> =
                (0..n).filter(|&i| radii[i].scaled(16.0 * n as f64, 0) > neighbourhoods[i].nearest).collect();
            if open.is_empty() {
                let disc = |(i, centre): (usize, Point)| {
                    let next = stepped(&centre, newton(&now[i]), bits);
                    Disc { radius: radii[i], free: neighbourhoods[i].nearest.scaled(0.9, 0), next, centre }
                };
                return Some(points.into_iter().enumerate().map(disc).collect());
            }
            since += 1;
            let noisy = open.iter().filter(|&&i| now[i][0].is_noise()).count();
            if noisy == open.len() || noisy > 0 && since > 15 || since > 50 {
                bits *= 2;
                if bits > BITS[1] {
                    return None;
                }
                cut = self.cut(bits);
                open.iter().for_each(|&i| values[i] = None);
                since = 0;
            }
            for i in open.into_iter().filter(|&i| !now[i][0].is_noise()) {
                let step = newton(&now[i]);
                let beside = Wide::ONE.minus(step.times(neighbourhoods[i].repulsion));
                let step = if beside.is_zero() { step } else { step.over(beside) };
                points[i] = stepped(&points[i], step, bits);
                values[i] = None;
            }
            // Two that coincide part.
            for i in (0..n).filter(|&i| neighbourhoods[i].product.is_zero()) {
                let size = points[i].wide();
                points[i] = stepped(&points[i], aside(size, i, -20), bits);
                values[i] = None;
            }
        }
        None
    }

    /// The root in a disc, each part off by less than 2⁻⁶⁶ of itself; without `both` the real part by so much of the size.
    ///
    /// Within `n |p(z)/p′(z)|` of any z there is a root; it is the one of the disc where no other is as near.
    fn refined(&self, disc: Disc, real: bool, both: bool) -> Option<Point> {
        let n = self.degree() as f64;
        let onto_axis = |mut z: Point| {
            if real {
                z.y = IBig::ZERO;
            }
            z
        };
        let mut bits = BITS[0];
        let mut cut = self.cut(bits);
        let mut z = onto_axis(disc.next);
        for _ in 0..STEPS {
            let values = [0, 1].map(|which| self.value(&cut, which, &z, bits));
            let radius = values[0].most().over(values[1].least()).scaled(1.01 * n, 0);
            let distance = z.minus(&disc.centre).wide().size().scaled(1.001, 0);
            if distance.plus(radius) >= disc.free {
                // Newton's step left the disc: from its centre with more bits.
                bits *= 2;
                z = onto_axis(disc.centre.clone());
            } else {
                let is_precise =
                    |part: &IBig| radius <= Point::real(part.clone(), z.exponent).wide().size().scaled(1.0, NEGLIGIBLE);
                let real_part = if both { is_precise(&z.x) } else { radius <= z.wide().size().scaled(1.0, NEGLIGIBLE) };
                if real_part && (real || is_precise(&z.y)) {
                    return Some(z);
                }
                if !values[0].is_noise() {
                    z = onto_axis(stepped(&z, newton(&values), bits));
                    continue;
                }
                bits *= 2;
            }
            if bits > BITS[1] {
                return None;
            }
            cut = self.cut(bits);
        }
        None
    }

    /// Where the search begins: eigenvalues of the companion matrix if they are of the sizes that the roots have, else points
    /// on the circles of Bini; beside the real axis and its symmetry.
    fn starts(&self, attempt: usize) -> Vec<Wide> {
        let radii = self.radii();
        let mut out = if attempt == 0 { self.companion(&radii) } else { None };
        let found = out.get_or_insert_with(|| circles(&radii, attempt));
        found.iter().enumerate().map(|(k, &z)| z.plus(aside(z, k, -36))).collect()
    }

    /// log₂ of the sizes that the roots have roughly, ascending: slopes of Newton's polygon (the upper hull of log |c_k|).
    fn radii(&self) -> Vec<f64> {
        let n = self.degree();
        let sizes = &self.sizes[0];
        let at = |k: usize| sizes[k].log2();
        let mut hull: Vec<usize> = Vec::new();
        for k in (0..=n).filter(|&k| !sizes[k].is_zero()) {
            let slope = |i: usize, j: usize| (at(j) - at(i)) / (j - i) as f64;
            while let [.., i, j] = hull[..]
                && slope(j, k) >= slope(i, j)
            {
                hull.pop();
            }
            hull.push(k);
        }
        let edges = hull.windows(2).map(|edge| (edge[1] - edge[0], edge[0], edge[1]));
        edges.flat_map(|(length, i, j)| std::iter::repeat_n((at(i) - at(j)) / length as f64, length)).collect()
    }

    /// Eigenvalues of the companion matrix, balanced by a power of two; `None` if they are not of the right sizes.
    fn companion(&self, radii: &[f64]) -> Option<Vec<Wide>> {
        let n = self.degree();
        let mean = (radii.iter().sum::<f64>() / n as f64).round() as i64;
        let last = (0..n)
            .map(|k| {
                let size = self.sizes[0][k].over(self.sizes[0][n]).scaled(1.0, mean.checked_mul(k as i64 - n as i64)?);
                let opposite = (self.coefficients[k].x > IBig::ZERO) == (self.coefficients[n].x > IBig::ZERO);
                Some(if opposite { -size.to_f64()? } else { size.to_f64()? })
            })
            .collect::<Option<Vec<f64>>>()?;
        let matrix = Matrix::from_fn(n, n, |i, j| match (i + 1 == j, i + 1 == n) {
            (_, true) => last[j],
            (true, _) => 1.0,
            _ => 0.0,
        });
        let mut found: Vec<Wide> = eigenvalues(&matrix)?.into_iter().map(|(re, im)| Wide::new(re, im, mean)).collect();
        found.sort_by(|a, b| a.size().log2().total_cmp(&b.size().log2()));
        // The k-th size is off by a factor of 2n at most.
        let bound = log2(2.0 * n as f64);
        let fits = |(z, radius): (&Wide, &f64)| (z.size().log2() - radius).abs() <= bound;
        found.iter().zip(radii).all(fits).then_some(found)
    }
}

/// Points on circles of these sizes (log₂, ascending), evenly over each.
fn circles(radii: &[f64], attempt: usize) -> Vec<Wide> {
    let mut out = Vec::with_capacity(radii.len());
    for ring in radii.chunk_by(|a, b| a == b) {
        let whole = ring[0].floor();
        let radius = exp2(ring[0] - whole);
        for k in 0..ring.len() {
            let turn = k as f64 / ring.len() as f64 + 0.11 + 0.618 * (out.len() - k + attempt) as f64;
            let angle = std::f64::consts::TAU * turn;
            out.push(Wide::new(radius * cos(angle), radius * sin(angle), whole as i64));
        }
    }
    out
}

/// A small step from z, 2^`exponent` of its size, for each k in another direction.
fn aside(z: Wide, k: usize, exponent: i64) -> Wide {
    let angle = 1.0 + 2.4 * k as f64;
    z.times(Wide::new(cos(angle), sin(angle), exponent))
}

/// p/p′; zero where p′ is.
fn newton(values: &[Value; 2]) -> Wide {
    if values[1].value.is_zero() { Wide::ZERO } else { values[0].value.over(values[1].value) }
}

/// z less a step, with this many bits.
fn stepped(z: &Point, step: Wide, bits: usize) -> Point {
    let step = Point::from_wide(Wide { re: -step.re, im: -step.im, ..step });
    z.clone().sum(&step, bits).cut(bits)
}

/// The effect of the other points on one.
struct Surroundings {
    /// `Π |zᵢ − z_j|`, at most a millionth too large.
    product: Size,
    /// `min |zᵢ − z_j|`.
    nearest: Size,
    /// `Σ 1/(zᵢ − z_j)`.
    repulsion: Wide,
}

fn surroundings(points: &[Point]) -> Vec<Surroundings> {
    let coarse: Vec<Wide> = points.iter().map(Point::wide).collect();
    let of = |i: usize| {
        let mut out = Surroundings { product: Size::ONE, nearest: Size::LARGEST, repulsion: Wide::ZERO };
        for j in (0..points.len()).filter(|&j| j != i) {
            let mut difference = coarse[i].minus(coarse[j]);
            if difference.is_zero() || difference.exponent < coarse[i].exponent.max(coarse[j].exponent) - 20 {
                difference = points[i].minus(&points[j]).wide();
            }
            let size = difference.size();
            out.product = out.product.times(size);
            if size < out.nearest {
                out.nearest = size;
            }
            if !difference.is_zero() {
                out.repulsion = out.repulsion.plus(Wide::ONE.over(difference));
            }
        }
        out
    };
    (0..points.len()).map(of).collect()
}
