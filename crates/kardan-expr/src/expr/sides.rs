//! Expressions on the sides of a kink or a jump.
//!
//! A *guard* selects a piece by its sign: the argument of `abs`, the difference of what `min`, `max` and `if` compare, the distance of a
//! table's argument from a point. Where it vanishes its derivative is that of one side, and all that has the same guard has to be on the same side:
//! `sign(x)·abs(x)` is x on both. A guard is named with its first term not subtracted and without a factor: `x`, `−2x` and `x³` are one.

use std::collections::{BTreeSet, HashMap, HashSet};

use super::at_once::is_open;
use super::nodes::Node;
use super::piecewise_polynomial::PiecewisePolynomial;
use super::{Expr, Floating, Function, Graph, Interval, Intervals, Style, Surd, Surds, Symbol, lower, printed};
use kardan_math::num::{Rational, Scalar, SparseRow, rational_from_f64, rational_to_f64};

/// A place at which expressions are evaluated, and how it may be left.
pub trait Place {
    /// The number by which derivatives by a symbol are listed; `None`: there are none of it.
    fn place(&self, symbol: Symbol) -> Option<usize>;
    /// The exact value of a symbol, where it is known.
    fn exact(&self, symbol: Symbol) -> Option<Surd>;
    /// Its value.
    fn value(&self, symbol: Symbol) -> f64;
    /// Between which numbers it is.
    fn enclosure(&self, symbol: Symbol) -> Interval;
    /// Its rate in each of the directions in which the place may be left; `None` where it does not change.
    fn moves(&self, symbol: Symbol) -> SparseRow;
    /// Its value next to the place.
    fn beside(&self, symbol: Symbol, direction: Direction<'_>) -> f64 {
        let (value, moves) = (self.value(symbol), self.moves(symbol));
        let step: f64 = moves.iter().map(|(k, x)| rational_to_f64(x) * direction(*k)).sum();
        value + BESIDE * value.abs().max(1.0) * step
    }
}

/// Its distance from a place, relative to its size or to one.
const BESIDE: f64 = 1e-9;

/// A side of a place, by the guards that are below zero there, as they are written; all others that vanish are above.
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Side {
    /// These guards.
    pub below: BTreeSet<String>,
}

/// The expressions on one side.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sided {
    /// The guards that vanish at the place, and whether they are above zero here.
    pub guards: Vec<(Expr, bool)>,
    /// The expressions, each as it is here.
    pub exprs: Vec<Expr>,
}

impl Sided {
    /// The guards as they are written, and whether they are above zero.
    pub fn named(&self, graph: &Graph, names: &mut GuardNames) -> Vec<(String, bool)> {
        self.guards.iter().map(|(guard, above)| (names.of(graph, *guard), *above)).collect()
    }
}

/// Guards of one graph as they are written, each written once.
#[derive(Debug, Default)]
pub struct GuardNames(HashMap<Expr, String>);

impl GuardNames {
    /// None so far.
    pub fn new() -> Self {
        Self::default()
    }

    /// The name of a guard.
    pub fn of(&mut self, graph: &Graph, guard: Expr) -> String {
        self.0.entry(guard).or_insert_with(|| printed(graph, guard, Style::Text, &|name| name.into())).clone()
    }
}

/// The values of expressions at a place, where these are fractions.
pub fn exactly(graph: &Graph, exprs: &[Expr], place: &dyn Place) -> Vec<Option<Rational>> {
    let values = lower(graph, exprs, &mut Surds, |symbol| place.exact(symbol));
    values.into_iter().map(|value| value?.to_rational()).collect()
}

/// Sides of one place that are evaluated.
const MOST_SIDES: usize = 64;

/// A node that has another piece on each side of its guard: below, above.
#[derive(Clone)]
enum Pieces {
    Size(Expr),
    Of([Expr; 2]),
    Table([(Rational, Vec<Rational>); 2], Expr),
}

/// Guards, and whether they are above zero.
type Chosen = Vec<(Expr, bool)>;

/// Which sides of the last of some guards, below and above, can be reached together with the others.
type Reachable<'a> = dyn FnMut(&mut Graph, &[(Expr, bool)]) -> [bool; 2] + 'a;

/// A direction in which a place is left: its part along each of those in which it may be.
pub type Direction<'a> = &'a dyn Fn(usize) -> f64;

/// Gradients of guards at a place, as far as they are computed.
type Gradients = HashMap<Expr, Option<SparseRow>>;

/// A guard of a node, whether it was negated, and the pieces of the node.
type Guarded = (Expr, bool, Pieces);

/// For each node that may have a kink at a place its guards.
type GuardedKinks = HashMap<Expr, Vec<Guarded>>;

impl Graph {
    /// A guard in its named form, and whether it was negated for that.
    pub fn guard(&mut self, guard: Expr) -> (Expr, bool) {
        match self.node(guard).clone() {
            Node::Group(inner) => self.guard(inner),
            Node::Product(factors) if factors.len() == 1 && factors[0].1 % 2 != 0 => self.guard(factors[0].0),
            Node::Sum { constant, terms } => {
                let first = terms[0].1.clone();
                let flipped = first < Rational::ZERO;
                let scaled = self.scale(Rational::ONE / first, guard);
                match constant.is_zero() && terms.len() == 1 {
                    true => {
                        let (inner, again) = self.guard(scaled);
                        (inner, flipped != again)
                    }
                    false => (scaled, flipped),
                }
            }
            _ => (guard, false),
        }
    }

    fn difference_guard(&mut self, a: Expr, b: Expr) -> (Expr, bool) {
        let difference = self.subtract(a, b);
        self.guard(difference)
    }

    /// `select` that is on the upper side of its guard where this vanishes.
    pub(super) fn select_above(&mut self, a: Expr, b: Expr, then: Expr, otherwise: Expr) -> Expr {
        if self.difference_guard(a, b).1 {
            self.select(b, a, otherwise, then)
        } else {
            self.select(a, b, then, otherwise)
        }
    }

    /// `table` that is on the upper side of a point of its argument.
    pub(super) fn table_above(&mut self, table: PiecewisePolynomial, x: Expr) -> Expr {
        if !self.guard(x).1 {
            return self.table(table, x);
        }
        let opposite = self.negate(x);
        self.table(table.mirrored(), opposite)
    }

    /// Expressions that are on the upper side of all guards that a symbol moves, where these vanish; elsewhere they are what they were.
    pub(super) fn above(&mut self, exprs: &[Expr], by: Symbol) -> Vec<Expr> {
        // Of what the symbol moves.
        let mut new: HashMap<Expr, Expr> = HashMap::new();
        for part in self.moved(exprs, by) {
            let of = |part: &Expr| new.get(part).copied().unwrap_or(*part);
            let mut same = true;
            self.each_part(part, |part| same &= of(&part) == part);
            let own = match *self.node(part) {
                Node::Select([a, b, then, otherwise]) if new.contains_key(&a) || new.contains_key(&b) => {
                    let [a, b, then, otherwise] = [a, b, then, otherwise].map(|part| of(&part));
                    self.select_above(a, b, then, otherwise)
                }
                Node::Table(number, x) if new.contains_key(&x) => {
                    let table = self.tables[number as usize].clone();
                    self.table_above(table, of(&x))
                }
                _ if same => part,
                _ => self.rebuilt(part, |part| of(&part)),
            };
            new.insert(part, own);
        }
        exprs.iter().map(|expr| new.get(expr).copied().unwrap_or(*expr)).collect()
    }

    /// The guards of a node, with its pieces below and above.
    fn guards_of(&mut self, part: Expr) -> Vec<Guarded> {
        let ((guard, flipped), pieces) = match self.node(part).clone() {
            Node::Apply(Function::Abs, a) => (self.guard(a), Pieces::Size(a)),
            Node::Min(a, b) => (self.difference_guard(a, b), Pieces::Of([a, b])),
            Node::Max(a, b) => (self.difference_guard(a, b), Pieces::Of([b, a])),
            Node::Select([a, b, then, otherwise]) => (self.difference_guard(a, b), Pieces::Of([then, otherwise])),
            Node::Table(number, x) => {
                let table = self.tables[number as usize].clone();
                let kinks = table.kinks();
                let knots = table.knots.iter().enumerate().filter(|(_, knot)| kinks.contains(knot));
                let of = |(k, knot): (usize, &Rational)| {
                    let distance = self.sum(-knot, &[(x, Rational::ONE)]);
                    let (guard, flipped) = self.guard(distance);
                    (guard, flipped, Pieces::Table([table.pieces[k].clone(), table.pieces[k + 1].clone()], x))
                };
                return knots.map(of).collect();
            }
            _ => return Vec::new(),
        };
        vec![(guard, flipped, pieces)]
    }

    /// Expressions where guards are on chosen sides.
    fn on_side(&mut self, exprs: &[Expr], guarded_kinks: &GuardedKinks, chosen: &[(Expr, bool)]) -> Vec<Expr> {
        let mut new: HashMap<Expr, Expr> = HashMap::new();
        for part in self.needed(exprs) {
            let of = guarded_kinks.get(&part).into_iter().flatten().find_map(|(guard, flipped, pieces)| {
                let (_, above) = chosen.iter().find(|(own, _)| own == guard)?;
                Some((above != flipped, pieces))
            });
            let own = match of {
                Some((true, Pieces::Size(a))) => new[a],
                Some((false, Pieces::Size(a))) => self.negate(new[a]),
                Some((above, Pieces::Of(both))) => new[&both[usize::from(above)]],
                Some((above, Pieces::Table(both, x))) => self.polynomial(&both[usize::from(above)], new[x]),
                None if self.symbol_of(part).is_some() => part,
                None => self.rebuilt(part, |part| new[&part]),
            };
            new.insert(part, own);
        }
        exprs.iter().map(|expr| new[expr]).collect()
    }

    fn polynomial(&mut self, (origin, coefficients): &(Rational, Vec<Rational>), x: Expr) -> Expr {
        let step = self.sum(-origin, &[(x, Rational::ONE)]);
        let powers: Vec<Expr> = (0..coefficients.len()).map(|k| self.power(step, k as i32)).collect();
        let terms: Vec<(Expr, Rational)> = powers.into_iter().zip(coefficients.iter().cloned()).collect();
        self.sum(Rational::ZERO, &terms)
    }

    /// The expressions on all sides of guards that vanish by this: sides that do not exist may be among them. `None`: too many.
    pub fn all_sides(&mut self, exprs: &[Expr], vanishes: &dyn Fn(Expr) -> bool) -> Option<Vec<Sided>> {
        let (guards, guarded_kinks) =
            self.guarded_kinks(exprs, &mut |_, guards| guards.iter().map(|guard| vanishes(*guard)).collect());
        // Guards of what jumps are not known to vanish as well.
        self.on_all_sides(exprs, (&guards, &guarded_kinks), &mut |_, guards| {
            [guards.last().is_some_and(|(guard, _)| vanishes(*guard)); 2]
        })
    }

    /// The expressions on the sides of a place. Where guards vanish to first order there are those sides alone that can be reached from it; the first
    /// is that of the highest guards. `None`: too many.
    pub fn sides(&mut self, exprs: &[Expr], place: &dyn Place) -> Option<Vec<Sided>> {
        let (guards, guarded_kinks) = self.guarded_kinks(exprs, &mut |graph, guards| graph.vanish(guards, place));
        let mut gradients = Gradients::new();
        let mut reachable = |graph: &mut Self, guards: &[(Expr, bool)]| graph.reachable(guards, place, &mut gradients);
        self.on_all_sides(exprs, (&guards, &guarded_kinks), &mut reachable)
    }

    /// The expressions on the side of a place that a direction leads to.
    pub fn one_sided_slope(&mut self, exprs: &[Expr], place: &dyn Place, direction: Direction<'_>) -> Sided {
        let (guards, guarded_kinks) = self.guarded_kinks(exprs, &mut |graph, guards| graph.vanish(guards, place));
        let values = lower(self, &guards, &mut Floating::<f64>::default(), |symbol| place.beside(symbol, direction));
        let moves = |guard: Expr| self.symbols(&[guard]).into_iter().any(|symbol| !place.moves(symbol).is_empty());
        let moving = guards.into_iter().zip(values).filter(|(guard, _)| moves(*guard));
        let guards: Chosen = moving.map(|(guard, value)| (guard, value >= 0.0)).collect();
        Sided { exprs: self.on_side(exprs, &guarded_kinks, &guards), guards }
    }

    /// Guards that may vanish, inner ones first, each once, and what has them.
    fn guarded_kinks(
        &mut self,
        exprs: &[Expr],
        vanish: &mut dyn FnMut(&mut Self, &[Expr]) -> Vec<bool>,
    ) -> (Vec<Expr>, GuardedKinks) {
        let (all, vanishing) = self.all_guards(exprs, vanish);
        if vanishing.is_empty() {
            return Default::default();
        }
        // What jumps there may be anything on the sides, so that guards of it may vanish on one of them.
        let (mut jumps, mut order, mut guarded_kinks) = (HashMap::new(), Vec::new(), GuardedKinks::new());
        for (part, own) in all {
            let inner = self.parts(part).iter().any(|part| jumps[part]);
            let jump = matches!(self.node(part), Node::Select(_));
            let own: Vec<_> = own.into_iter().filter(|(guard, ..)| inner || vanishing.contains(guard)).collect();
            jumps.insert(part, inner || jump && !own.is_empty());
            for (guard, ..) in &own {
                if !order.contains(guard) {
                    order.push(*guard);
                }
            }
            if !own.is_empty() {
                guarded_kinks.insert(part, own);
            }
        }
        (order, guarded_kinks)
    }

    /// The guards of each part of expressions, and those of them that may vanish.
    fn all_guards(
        &mut self,
        exprs: &[Expr],
        vanish: &mut dyn FnMut(&mut Self, &[Expr]) -> Vec<bool>,
    ) -> (Vec<(Expr, Vec<Guarded>)>, BTreeSet<Expr>) {
        let all: Vec<_> = self.needed(exprs).into_iter().map(|part| (part, self.guards_of(part))).collect();
        let mut guards: Vec<Expr> = all.iter().flat_map(|(_, own)| own.iter().map(|(guard, ..)| *guard)).collect();
        guards.sort();
        guards.dedup();
        let vanishing = vanish(self, &guards).into_iter().zip(guards).filter(|(yes, _)| *yes);
        let vanishing = vanishing.map(|(_, guard)| guard).collect();
        (all, vanishing)
    }

    /// The sides of guards, one after the other, as far as they can be reached.
    fn on_all_sides(
        &mut self,
        exprs: &[Expr],
        (guards, guarded_kinks): (&[Expr], &GuardedKinks),
        reachable: &mut Reachable<'_>,
    ) -> Option<Vec<Sided>> {
        // Chosen so far, with what each guard is on the side that was chosen before.
        let mut open: Vec<(usize, Chosen, Chosen)> = vec![Default::default()];
        let mut out = Vec::new();
        while let Some((first, chosen, here)) = open.pop() {
            let next = (first..guards.len()).find_map(|k| {
                let guard = self.on_side(&[guards[k]], guarded_kinks, &chosen)[0];
                let mut tried = here.clone();
                tried.push((guard, true));
                let sides = reachable(self, &tried);
                (sides != [false; 2]).then_some((k, guard, sides))
            });
            let Some((k, guard, sides)) = next else {
                out.push(Sided { exprs: self.on_side(exprs, guarded_kinks, &chosen), guards: chosen });
                if out.len() > MOST_SIDES {
                    return None;
                }
                continue;
            };
            // The upper one is taken first.
            for above in [false, true] {
                if sides[usize::from(above)] {
                    let [chosen, here] = [(&chosen, guards[k]), (&here, guard)]
                        .map(|(list, own)| list.iter().copied().chain([(own, above)]).collect());
                    open.push((k + 1, chosen, here));
                }
            }
        }
        Some(out)
    }

    /// The symbols whose values expressions have in them, and not only as guards.
    pub fn carried(&self, exprs: &[Expr]) -> Vec<Symbol> {
        let (mut open, mut visited) = (exprs.to_vec(), BTreeSet::new());
        while let Some(part) = open.pop() {
            if visited.insert(part) {
                match self.node(part) {
                    Node::Select([.., then, otherwise]) => open.extend([then, otherwise]),
                    _ => open.extend(self.parts(part)),
                }
            }
        }
        visited.into_iter().filter_map(|part| self.symbol_of(part)).collect()
    }

    /// Of symbols that represent expressions those that [carry](Self::carried) one of some symbols, directly or through others; these are among them.
    pub fn carriers(&self, carried: &[Symbol], represented: &[(Symbol, Expr)]) -> HashSet<Symbol> {
        let mut above: HashMap<Expr, Vec<Expr>> = HashMap::new();
        let exprs: Vec<Expr> = represented.iter().map(|(_, expr)| *expr).collect();
        for expr in self.needed(&exprs) {
            match self.node(expr) {
                Node::Select([.., then, otherwise]) => {
                    [then, otherwise].into_iter().for_each(|part| above.entry(*part).or_default().push(expr));
                }
                _ => self.each_part(expr, |part| above.entry(part).or_default().push(expr)),
            }
        }
        for (symbol, expr) in represented {
            above.entry(*expr).or_default().extend(self.of_symbol(*symbol));
        }
        let (mut open, mut visited): (Vec<Expr>, HashSet<Expr>) =
            (carried.iter().filter_map(|symbol| self.of_symbol(*symbol)).collect(), HashSet::new());
        while let Some(expr) = open.pop() {
            if visited.insert(expr) {
                open.extend(above.get(&expr).into_iter().flatten());
            }
        }
        visited.into_iter().filter_map(|expr| self.symbol_of(expr)).collect()
    }

    /// Of each expression the guards that vanish at a place.
    pub(super) fn guards_at(&mut self, exprs: &[Expr], place: &dyn Place) -> Vec<Vec<Expr>> {
        let (parts, vanishing) = self.all_guards(exprs, &mut |graph, guards| graph.vanish(guards, place));
        let mut all: HashMap<Expr, BTreeSet<Expr>> = HashMap::new();
        for (part, own) in parts {
            let own = own.into_iter().map(|(guard, ..)| guard);
            let mut of: BTreeSet<Expr> = own.filter(|guard| vanishing.contains(guard)).collect();
            of.extend(self.parts(part).iter().filter_map(|part| all.get(part)).flatten().copied());
            if !of.is_empty() {
                all.insert(part, of);
            }
        }
        let of = |expr: &Expr| all.get(expr).into_iter().flatten().copied().collect();
        exprs.iter().map(of).collect()
    }

    /// Whether expressions vanish at a place, or are so near to it that it is rounded by as much.
    fn vanish(&self, exprs: &[Expr], place: &dyn Place) -> Vec<bool> {
        // An interval has the exact value in it.
        let enclosure = lower(self, exprs, &mut Intervals, |symbol| place.enclosure(symbol));
        enclosure.into_iter().map(|enclosure| enclosure.contains(0.0)).collect()
    }

    /// Whether a place can be left to below and to above zero of the last of some guards, with the others on their sides; neither where the last one does
    /// not vanish there, or does not change.
    fn reachable(&mut self, guards: &[(Expr, bool)], place: &dyn Place, gradients: &mut Gradients) -> [bool; 2] {
        let Some(((last, _), further_guards)) = guards.split_last() else { return [false; 2] };
        let moving = self.symbols(&[*last]).into_iter().any(|symbol| !place.moves(symbol).is_empty());
        if !moving || !self.vanish(&[*last], place)[0] {
            return [false; 2];
        }
        for (guard, _) in guards {
            if !gradients.contains_key(guard) {
                gradients.insert(*guard, self.gradient(*guard, place));
            }
        }
        let Some(row) = gradients[last].clone() else { return [true; 2] };
        if row.is_empty() {
            // To first order it does not change.
            let opposite = self.negate(*last);
            return [!self.is_never_negative(*last), !self.is_never_negative(opposite)];
        }
        let signed = |row: SparseRow, above: bool| -> SparseRow {
            row.into_iter().map(|(k, x)| (k, if above { x } else { -x })).collect()
        };
        let further_guards: Vec<SparseRow> = further_guards
            .iter()
            .filter_map(|(guard, above)| Some(signed(gradients[guard].clone()?, *above)))
            .filter(|row| !row.is_empty())
            .collect();
        [false, true].map(|above| {
            let mut rows = further_guards.clone();
            rows.push(signed(row.clone(), above));
            is_open(rows)
        })
    }

    /// How an expression changes with the directions in which a place may be left; `None` where it has no end.
    fn gradient(&mut self, expr: Expr, place: &dyn Place) -> Option<SparseRow> {
        let mut out = std::collections::BTreeMap::<usize, Rational>::new();
        for symbol in self.symbols(&[expr]) {
            let moves = place.moves(symbol);
            if moves.is_empty() {
                continue;
            }
            let slope = [self.derivative(expr, symbol)];
            let exact = exactly(self, &slope, place).swap_remove(0);
            let value = || lower(self, &slope, &mut Floating::<f64>::default(), |symbol| place.value(symbol))[0];
            let slope = exact.or_else(|| rational_from_f64(value()))?;
            moves.into_iter().for_each(|(k, x)| *out.entry(k).or_default() += x * &slope);
        }
        Some(out.into_iter().filter(|(_, x)| !Scalar::is_zero(x)).collect())
    }

    /// Whether its form shows that it is zero or more everywhere.
    fn is_never_negative(&self, expr: Expr) -> bool {
        match self.node(expr) {
            Node::Number(value) => *value >= Rational::ZERO,
            Node::Apply(Function::Abs | Function::Sqrt | Function::Exp, _) | Node::Pi => true,
            Node::Group(inner) => self.is_never_negative(*inner),
            Node::Product(factors) => {
                factors.iter().all(|(factor, power)| power % 2 == 0 || self.is_never_negative(*factor))
            }
            Node::Sum { constant, terms } => {
                let positive =
                    |(term, factor): &(Expr, Rational)| *factor > Rational::ZERO && self.is_never_negative(*term);
                *constant >= Rational::ZERO && terms.iter().all(positive)
            }
            _ => false,
        }
    }
}
