//! Functions given by exact polynomials between knots.

use kardan_math::num::Rational;

/// A function given by polynomials between knots; the first and the last continue outside them.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct PiecewisePolynomial {
    /// Where the pieces meet, rising.
    pub knots: Vec<Rational>,
    /// Of each piece: where its argument is zero, and its coefficients, constant first.
    pub pieces: Vec<(Rational, Vec<Rational>)>,
}

impl PiecewisePolynomial {
    /// Straight lines through points, level outside them. None if the points do not rise or there are none.
    pub fn through(points: &[(Rational, Rational)]) -> Option<Self> {
        let (first, last) = (points.first()?, points.last()?);
        if points.windows(2).any(|pair| pair[0].0 >= pair[1].0) {
            return None;
        }
        let level = |(x, y): &(Rational, Rational)| (x.clone(), vec![y.clone()]);
        let line = |pair: &[(Rational, Rational)]| {
            let slope = (&pair[1].1 - &pair[0].1) / (&pair[1].0 - &pair[0].0);
            (pair[0].0.clone(), vec![pair[0].1.clone(), slope])
        };
        let pieces = std::iter::once(level(first)).chain(points.windows(2).map(line)).chain([level(last)]);
        Some(Self { knots: points.iter().map(|(x, _)| x.clone()).collect(), pieces: pieces.collect() })
    }

    /// Cubics through points with a slope at each, continued outside the first and the last by straight lines or level. None if the points
    /// do not rise or there are none. Value and slope are continuous exactly.
    pub fn smooth(points: &[(Rational, Rational)], slopes: &[Rational], straight: bool) -> Option<Self> {
        let line = |(x, y): &(Rational, Rational), slope: &Rational| {
            (x.clone(), if straight { vec![y.clone(), slope.clone()] } else { vec![y.clone()] })
        };
        if points.len() != slopes.len() || points.windows(2).any(|pair| pair[0].0 >= pair[1].0) {
            return None;
        }
        let mut pieces = vec![line(points.first()?, slopes.first()?)];
        for (pair, slope) in points.windows(2).zip(slopes.windows(2)) {
            // y0 + d0 t + a t^2 + b t^3 with both ends and both slopes.
            let [(x0, y0), (x1, y1)] = pair else { return None };
            let [d0, d1] = slope else { return None };
            let h = x1 - x0;
            let chord = (y1 - y0) / &h;
            let a = (&chord * Rational::from(3) - d0 * Rational::from(2) - d1) / &h;
            let b = (d0 + d1 - &chord * Rational::from(2)) / (&h * &h);
            pieces.push((x0.clone(), vec![y0.clone(), d0.clone(), a, b]));
        }
        pieces.push(line(points.last()?, slopes.last()?));
        Some(Self { knots: points.iter().map(|(x, _)| x.clone()).collect(), pieces })
    }

    /// The exact value.
    pub fn value(&self, x: &Rational) -> Rational {
        self.at_piece(self.knots.partition_point(|knot| knot <= x), x)
    }

    fn at_piece(&self, piece: usize, x: &Rational) -> Rational {
        let (origin, coefficients) = &self.pieces[piece];
        let x = x - origin;
        coefficients.iter().rev().fold(Rational::ZERO, |value, coefficient| &value * &x + coefficient)
    }

    /// The derivative; at a knot that of the piece behind it.
    #[must_use]
    pub fn derivative(&self) -> Self {
        let piece = |(origin, coefficients): &(Rational, Vec<Rational>)| {
            let factors = coefficients.iter().enumerate().skip(1);
            let derived: Vec<Rational> = factors.map(|(power, c)| c * Rational::from(power as u64)).collect();
            (origin.clone(), if derived.is_empty() { vec![Rational::ZERO] } else { derived })
        };
        Self { knots: self.knots.clone(), pieces: self.pieces.iter().map(piece).collect() }
    }

    /// The table of the opposite argument.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let piece = |(origin, coefficients): &(Rational, Vec<Rational>)| {
            let signs = coefficients.iter().enumerate();
            (-origin, signs.map(|(k, c)| if k % 2 == 1 { -c } else { c.clone() }).collect())
        };
        Self {
            knots: self.knots.iter().rev().map(|knot| -knot).collect(),
            pieces: self.pieces.iter().rev().map(piece).collect(),
        }
    }

    /// Knots at which the value has a jump or a kink.
    pub fn kinks(&self) -> Vec<Rational> {
        let slope = self.derivative();
        let meet = |table: &Self, knot: usize| {
            let x = &table.knots[knot];
            table.at_piece(knot, x) == table.at_piece(knot + 1, x)
        };
        let smooth = |knot: &usize| meet(self, *knot) && meet(&slope, *knot);
        (0..self.knots.len()).filter(|knot| !smooth(knot)).map(|knot| self.knots[knot].clone()).collect()
    }
}
