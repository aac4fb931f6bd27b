//! Values with their slopes in one pass (forward differentiation), where no derivative is needed as an expression.

use std::collections::HashMap;
use std::rc::Rc;

use kardan_rt::Operator;

use super::{Domain, Expr, Floating, Graph, PiecewisePolynomial, Symbol, lower};
use kardan_math::num::Rational;

/// A value, and its slopes over what moves it: places, rising, each with a slope.
#[derive(Debug, Clone)]
pub struct WithSlopes<V> {
    /// The value.
    pub value: V,
    /// The slopes, as far as they are not zero everywhere.
    pub slopes: Rc<[(usize, V)]>,
}

impl<V> WithSlopes<V> {
    /// Value and slopes by a rule.
    pub fn map<W>(self, mut rule: impl FnMut(V) -> W) -> WithSlopes<W>
    where
        V: Clone,
    {
        let slopes = self.slopes.iter().map(|(place, slope)| (*place, rule(slope.clone()))).collect();
        WithSlopes { value: rule(self.value), slopes }
    }

    /// Value and slopes with those of the same expression over other numbers.
    pub fn zip<W: Clone>(self, other: WithSlopes<W>) -> WithSlopes<(V, W)>
    where
        V: Clone,
    {
        let both = self.slopes.iter().zip(&*other.slopes);
        let slopes = both.map(|((place, one), (_, other))| (*place, (one.clone(), other.clone()))).collect();
        WithSlopes { value: (self.value, other.value), slopes }
    }

    /// Value and slopes, one after the other.
    pub fn all(&self) -> impl Iterator<Item = &V> {
        std::iter::once(&self.value).chain(self.slopes.iter().map(|(_, slope)| slope))
    }

    /// The value, and the slopes by places.
    pub fn split(self) -> (V, Vec<(usize, V)>)
    where
        V: Clone,
    {
        (self.value, self.slopes.to_vec())
    }
}

/// Values of expressions over the numbers of a domain, with their slopes over symbols that have a place.
///
/// Where guards vanish, the slopes are those of the piece that has the value, which may be different ones for two parts of an expression: sides are
/// chosen before ([`super::kinked`]).
///
/// ```
/// use kardan_expr::expr::{Floating, Graph, forward};
/// use kardan_math::units::Dimension;
/// let mut graph = Graph::default();
/// let [x, y] = ["x", "y"].map(|name| graph.symbol(name, Dimension::NONE));
/// let product = graph.multiply(x, y);
/// let place = |symbol| graph.name(symbol).0 == "y";
/// let found = forward(&graph, &[product], Floating::<f64>::default(), |symbol| (3.0, place(symbol).then_some(7)));
/// assert_eq!((found[0].value, &*found[0].slopes), (9.0, &[(7, 3.0)][..]));
/// ```
pub fn forward<D: Domain>(
    graph: &Graph,
    exprs: &[Expr],
    domain: D,
    mut symbol: impl FnMut(Symbol) -> (D::Value, Option<usize>),
) -> Vec<WithSlopes<D::Value>> {
    let mut forward = Forward(domain);
    let one = forward.0.constant(&Rational::ONE);
    lower(graph, exprs, &mut forward, |own| {
        let (value, place) = symbol(own);
        WithSlopes { value, slopes: place.map(|place| (place, one.clone())).into_iter().collect() }
    })
}

/// Slopes of expressions over symbols, by their places, where these have values; where something overflows on the way, from derivatives as expressions.
pub fn slopes_at(graph: &Graph, exprs: &[Expr], (symbols, values): (&[Symbol], &[f64])) -> Vec<Vec<(usize, f64)>> {
    let places: HashMap<Symbol, usize> = symbols.iter().copied().zip(0..).collect();
    let at = |symbol: &Symbol| places.get(symbol).map_or(f64::NAN, |place| values[*place]);
    let found = forward(graph, exprs, Floating::<f64>::default(), |symbol| (at(&symbol), places.get(&symbol).copied()));
    let mut out: Vec<Vec<(usize, f64)>> = found.into_iter().map(|one| one.split().1).collect();
    for (slopes, expr) in out.iter_mut().zip(exprs) {
        for (place, slope) in slopes.iter_mut().filter(|(_, slope)| !slope.is_finite()) {
            let mut graph = graph.clone();
            let derivative = graph.derivative(*expr, symbols[*place]);
            *slope = lower(&graph, &[derivative], &mut Floating::<f64>::default(), |symbol| at(&symbol))[0];
        }
    }
    out
}

/// Numbers of a domain with slopes.
struct Forward<D>(D);

impl<D: Domain> Forward<D> {
    fn op<const N: usize>(&mut self, operator: Operator, operands: [&D::Value; N]) -> D::Value {
        self.0.operation(operator, &operands.map(Clone::clone))
    }

    /// Slopes of what follows from two numbers, of each place by a rule; a number that a place does not move has none there.
    fn of_both(
        &mut self,
        [one, other]: [&[(usize, D::Value)]; 2],
        mut rule: impl FnMut(&mut Self, [Option<&D::Value>; 2]) -> D::Value,
    ) -> Vec<(usize, D::Value)> {
        let mut out = Vec::with_capacity(one.len() + other.len());
        let (mut i, mut j) = (0, 0);
        while i < one.len() || j < other.len() {
            let [first, second] = [one.get(i), other.get(j)].map(|next| next.map_or(usize::MAX, |(place, _)| *place));
            let place = first.min(second);
            let own = (first == place).then(|| &one[i].1);
            let second_slope = (second == place).then(|| &other[j].1);
            out.push((place, rule(self, [own, second_slope])));
            (i, j) = (i + usize::from(first == place), j + usize::from(second == place));
        }
        out
    }

    /// Slopes of a function of one number, each times that of the function.
    fn chain(&mut self, x: &WithSlopes<D::Value>, slope: impl FnOnce(&mut Self) -> D::Value) -> Vec<(usize, D::Value)> {
        if x.slopes.is_empty() {
            return Vec::new();
        }
        let slope = slope(self);
        x.slopes.iter().map(|(place, own)| (*place, self.op(Operator::Multiply, [&slope, own]))).collect()
    }

    /// `a′ b + a b′`
    fn product(&mut self, a: &WithSlopes<D::Value>, b: &WithSlopes<D::Value>) -> Vec<(usize, D::Value)> {
        self.of_both([&a.slopes, &b.slopes], |own, [first, second]| {
            let first = first.map(|slope| own.op(Operator::Multiply, [slope, &b.value]));
            let second = second.map(|slope| own.op(Operator::Multiply, [&a.value, slope]));
            own.sum([first, second])
        })
    }

    fn sum(&mut self, both: [Option<D::Value>; 2]) -> D::Value {
        match both {
            [Some(one), Some(other)] => self.0.operation(Operator::Add, &[one, other]),
            [Some(one), None] | [None, Some(one)] => one,
            [None, None] => self.0.constant(&Rational::ZERO),
        }
    }

    /// Slopes of sums: of the second term with its sign.
    fn added(&mut self, both: [&[(usize, D::Value)]; 2], is_subtracted: bool) -> Vec<(usize, D::Value)> {
        self.of_both(both, |own, [first, second]| {
            let second = second.map(|slope| match is_subtracted {
                true => own.op(Operator::Negate, [slope]),
                false => slope.clone(),
            });
            own.sum([first.cloned(), second])
        })
    }

    /// Slopes of the one of two numbers that is chosen where a is below b, and of the other one elsewhere.
    fn chosen(
        &mut self,
        [a, b]: [&D::Value; 2],
        [then, otherwise]: [&[(usize, D::Value)]; 2],
    ) -> Vec<(usize, D::Value)> {
        let zero = self.0.constant(&Rational::ZERO);
        self.of_both([then, otherwise], |own, both| {
            let [then, otherwise] = both.map(|slope| slope.unwrap_or(&zero));
            own.op(Operator::Select, [a, b, then, otherwise])
        })
    }

    /// `(x y′ − y x′)/(x² + y²)`
    fn of_angle(&mut self, y: &WithSlopes<D::Value>, x: &WithSlopes<D::Value>) -> Vec<(usize, D::Value)> {
        let squares = self.op(Operator::Multiply, [&x.value, &x.value]);
        let squares = self.op(Operator::AddProduct, [&y.value, &y.value, &squares]);
        self.of_both([&y.slopes, &x.slopes], |own, [of_y, of_x]| {
            let first = of_y.map(|slope| own.op(Operator::Multiply, [&x.value, slope]));
            let second = of_x.map(|slope| own.op(Operator::Multiply, [&y.value, slope]));
            let second = second.map(|slope| own.op(Operator::Negate, [&slope]));
            let sum = own.sum([first, second]);
            own.op(Operator::Divide, [&sum, &squares])
        })
    }

    /// The slope of a function of one number, given its value.
    fn slope_of(&mut self, operator: Operator, x: &D::Value, value: &D::Value) -> D::Value {
        let one = self.0.constant(&Rational::ONE);
        match operator {
            Operator::SquareRoot => {
                let doubled = self.op(Operator::Add, [value, value]);
                self.op(Operator::Divide, [&one, &doubled])
            }
            Operator::Tangent => self.op(Operator::AddProduct, [value, value, &one]),
            Operator::ArcSine | Operator::ArcCosine => {
                let rest = self.op(Operator::SubtractProduct, [x, x, &one]);
                let root = self.op(Operator::SquareRoot, [&rest]);
                let slope = self.op(Operator::Divide, [&one, &root]);
                if operator == Operator::ArcSine { slope } else { self.op(Operator::Negate, [&slope]) }
            }
            Operator::ArcTangent => {
                let sum = self.op(Operator::AddProduct, [x, x, &one]);
                self.op(Operator::Divide, [&one, &sum])
            }
            Operator::Exponential => value.clone(),
            Operator::Logarithm => self.op(Operator::Divide, [&one, x]),
            Operator::Absolute => {
                let (zero, minus) = (self.0.constant(&Rational::ZERO), self.op(Operator::Negate, [&one]));
                self.op(Operator::Select, [x, &zero, &minus, &one])
            }
            Operator::SineCosine => self.0.sine_cosine(x)[1].clone(),
            _ => unreachable!("{operator:?} has one operand"),
        }
    }
}

impl<D: Domain> Domain for Forward<D> {
    type Value = WithSlopes<D::Value>;

    fn constant(&mut self, value: &Rational) -> Self::Value {
        WithSlopes { value: self.0.constant(value), slopes: Rc::default() }
    }

    fn operation(&mut self, operator: Operator, x: &[Self::Value]) -> Self::Value {
        let operands: Vec<D::Value> = x.iter().map(|x| x.value.clone()).collect();
        let value = self.0.operation(operator, &operands);
        let slopes = match (operator, x) {
            _ if x.iter().all(|x| x.slopes.is_empty()) => Vec::new(),
            (Operator::Add | Operator::Subtract, [a, b]) => {
                self.added([&a.slopes, &b.slopes], operator == Operator::Subtract)
            }
            (Operator::Multiply, [a, b]) => self.product(a, b),
            (Operator::Divide, [a, b]) => self.of_both([&a.slopes, &b.slopes], |own, [first, second]| {
                let second = second.map(|slope| own.op(Operator::Multiply, [&value, slope]));
                let second = second.map(|slope| own.op(Operator::Negate, [&slope]));
                let sum = own.sum([first.cloned(), second]);
                own.op(Operator::Divide, [&sum, &b.value])
            }),
            (Operator::AddProduct | Operator::SubtractProduct, [a, b, c]) => {
                let product = self.product(a, b);
                self.added([&c.slopes, &product], operator == Operator::SubtractProduct)
            }
            (Operator::Negate, [a]) => self.added([&[], &a.slopes], true),
            (Operator::ArcTangent2, [y, x]) => self.of_angle(y, x),
            (Operator::Minimum, [a, b]) => self.chosen([&a.value, &b.value], [&a.slopes, &b.slopes]),
            (Operator::Maximum, [a, b]) => self.chosen([&a.value, &b.value], [&b.slopes, &a.slopes]),
            (Operator::Select, [a, b, then, otherwise]) => {
                self.chosen([&a.value, &b.value], [&then.slopes, &otherwise.slopes])
            }
            (_, [a]) => self.chain(a, |own| own.slope_of(operator, &a.value, &value)),
            _ => unreachable!("{operator:?} of {} operands", x.len()),
        };
        WithSlopes { value, slopes: slopes.into() }
    }

    fn sine_cosine(&mut self, angle: &Self::Value) -> [Self::Value; 2] {
        let [sine, cosine] = self.0.sine_cosine(&angle.value);
        let of_sine = self.chain(angle, |_| cosine.clone());
        let of_cosine = self.chain(angle, |own| own.op(Operator::Negate, [&sine]));
        [WithSlopes { value: sine, slopes: of_sine.into() }, WithSlopes { value: cosine, slopes: of_cosine.into() }]
    }

    fn table(&mut self, table: &PiecewisePolynomial, x: &Self::Value) -> Self::Value {
        let slopes = self.chain(x, |own| own.0.table(&table.derivative(), &x.value));
        WithSlopes { value: self.0.table(table, &x.value), slopes: slopes.into() }
    }
}
