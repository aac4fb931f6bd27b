//! The equations of motion of a reduced model as exact expressions of its coordinates and their speeds.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{MasslessDynamics, Reduced, Step};
use crate::assemble::Equations;
use kardan_expr::expr::{Expr, Floating, Graph, OfTime, Part, Symbol, lower};
use kardan_expr::plan::{Plan, compile};
use kardan_math::num::{Rational, rational_from_f64};
use kardan_math::units::{Dimension, Exact, InNames};

/// A direction in reduced coordinates: its entries by number, none of them zero.
pub type SparseRow = BTreeMap<usize, Expr>;

/// Forces on reduced coordinates: for each coordinate the terms of each direction factor, one factor after the other,
/// so that every varying factor multiplies once.
#[derive(Debug, Clone, Default)]
pub struct Forces(Vec<BTreeMap<Expr, Vec<(Expr, Rational)>>>);

impl Forces {
    /// The same with other expressions substituted for symbols of torques.
    pub(super) fn substitute(&mut self, graph: &mut Graph, substitutions: &[(Symbol, Expr)]) {
        for (value, _) in self.0.iter_mut().flat_map(BTreeMap::values_mut).flatten() {
            *value = graph.substitute(&[*value], substitutions)[0];
        }
    }

    /// Adds `factor·value` in a direction.
    pub fn add(&mut self, graph: &mut Graph, row: &SparseRow, value: Expr, factor: &Rational) {
        for (column, entry) in row {
            let (constant, terms) = graph.terms(*entry);
            let constant = (graph.integer(1), constant);
            for (part, share) in terms.into_iter().chain([constant]).filter(|(_, share)| !share.is_zero()) {
                self.0[*column].entry(part).or_default().push((value, share * factor));
            }
        }
    }

    /// The sums.
    pub fn sums(&self, graph: &mut Graph) -> Vec<Expr> {
        let mut sum = |parts: &BTreeMap<Expr, Vec<(Expr, Rational)>>| {
            let product = |(part, terms): (&Expr, &Vec<(Expr, Rational)>)| {
                let inner = graph.sum(Rational::ZERO, terms);
                (graph.multiply(*part, inner), Rational::ONE)
            };
            let products: Vec<(Expr, Rational)> = parts.iter().map(product).collect();
            graph.sum(Rational::ZERO, &products)
        };
        self.0.iter().map(&mut sum).collect()
    }
}

/// `H_r q̈_r = passive + Gᵀτ`, `q̇ = K q̇_r`, `q̈ = K q̈_r + k` \[diss. (4.12)-(4.14), (4.23)\] as expressions.
#[derive(Debug, Clone)]
pub struct Motion {
    /// The graph of all expressions.
    pub graph: Graph,
    /// The reduced coordinates, then their speeds.
    pub symbols: Vec<Symbol>,
    /// Angles of all shafts, rad.
    pub angles: Vec<Expr>,
    /// Speeds of all shafts, rad/s.
    pub speeds: Vec<Expr>,
    /// K, a row for each shaft.
    pub basis: Vec<SparseRow>,
    /// k, rad/s², one for each shaft.
    pub bias: Vec<Expr>,
    /// u, rad/s, one for each shaft: the part of its speed that constraints prescribe, `q̇ = K q̇_r + u`.
    pub carried: Vec<Expr>,
    /// H_r, kg m², the nonzero entries on and below the diagonal.
    pub inertia: BTreeMap<(usize, usize), Expr>,
    /// Forces of springs, dampers and inertias, N m.
    pub passive: Vec<Expr>,
    /// The terms of these sums.
    pub passive_terms: Forces,
    /// Directions of the frictions, and of the unilateral constraints.
    pub frictions: Vec<SparseRow>,
    /// aᵀk in each of them, rad/s²; then the multiplier constraints, like frictions that never slip.
    pub friction_bias: Vec<Expr>,
    /// Directions of the inputs.
    pub inputs: Vec<SparseRow>,
    /// Torques that expressions give, N m.
    pub laws: Vec<Expr>,
    /// Further terms of the multiplier constraints.
    pub multiplier_constraints: Vec<MultiplierTerms>,
    /// The terms that depend on the time.
    pub timed: Timed,
    /// Coefficients that are inputs, by name.
    pub run_parameters: Vec<(String, Expr)>,
    /// Motions without inertia that dampers determine.
    pub(super) relaxing: Option<Box<Relaxing>>,
}

/// The terms of a multiplier constraint that a run needs besides its direction and its bias.
#[derive(Debug, Clone)]
pub struct MultiplierTerms {
    /// Its coefficients over the shafts.
    pub row: Vec<(usize, Expr)>,
    /// φ, which vanishes; none for a row that has no integral.
    pub position: Option<Expr>,
    /// The speed residual, `Σ a_i q̇_i` minus its prescribed value; none where accelerations alone are prescribed.
    pub speed: Option<Expr>,
    /// The prescribed value of `Σ a_i q̇_i`.
    pub rate: Expr,
}

/// The time, and parts of functions of it, as symbols of a motion: created at their first use.
#[derive(Debug, Clone, Default)]
pub struct Timed {
    /// The time, s.
    pub time: Option<Expr>,
    /// The block outputs, each with its symbol.
    pub blocks: Vec<(String, Expr)>,
    /// The expressions substituted for symbols: blocks at every instant.
    pub block_outputs: Vec<(String, Expr)>,
    /// Parts, each with its symbol.
    pub parts: Vec<(Arc<Part>, Expr)>,
    /// Whether the time is fixed at zero: then there are no symbols.
    pub begin: bool,
}

impl Timed {
    /// The inputs: the parts, the time, then the block outputs.
    pub fn symbols(&self, graph: &Graph) -> Vec<Symbol> {
        let blocks = self.blocks.iter().map(|(_, symbol)| *symbol);
        let all = self.parts.iter().map(|(_, symbol)| *symbol).chain(self.time).chain(blocks);
        all.filter_map(|symbol| graph.symbol_of(symbol)).collect()
    }

    /// Their values at a time, of blocks before their first sample.
    pub fn values(&self, time: f64) -> impl Iterator<Item = f64> {
        self.parts
            .iter()
            .map(move |(part, _)| part.pieces.value(time))
            .chain(self.time.map(|_| time))
            .chain(self.blocks.iter().map(|_| 0.0))
    }
}

/// The first-order and slipping motions.
#[derive(Debug, Clone)]
pub(super) struct Relaxing {
    pub massless: MasslessDynamics,
    /// Speeds of all shafts while y is at rest.
    pub base_speeds: Vec<Expr>,
    /// Speed of each slipping motion if it slipped alone.
    pub slip_speeds: Vec<Expr>,
}

impl Motion {
    /// The expressions of a model.
    pub fn new(reduced: &Reduced) -> Self {
        Self::with_time(reduced, false)
    }

    /// The expressions of a model at time zero: functions of time have their values there.
    pub fn at_time_zero(reduced: &Reduced) -> Self {
        Self::with_time(reduced, true)
    }

    fn with_time(reduced: &Reduced, begin: bool) -> Self {
        let mut out = Self::kinematics(reduced, begin);
        out.terms(reduced);
        out.begin_massless_rates(reduced);
        let rows = |out: &mut Self, rows: Vec<&[(usize, Rational)]>| -> Vec<SparseRow> {
            rows.into_iter().map(|row| out.reduced_row(row)).collect()
        };
        let equations = &reduced.equations;
        out.frictions = rows(&mut out, equations.set_valued().map(|(_, row)| row).collect());
        out.inputs = rows(&mut out, equations.inputs.iter().map(|term| term.row.as_slice()).collect());
        for slip in reduced.massless.iter().flat_map(|massless| &massless.slips) {
            out.frictions[slip.friction].clear();
        }
        out.friction_bias = equations.set_valued().map(|(_, row)| out.sum(row, |out, k| out.bias[k])).collect();
        out.add_multiplier_rows(reduced);
        out
    }

    /// A model whose coordinates are all free, as if none followed from others, with their angles and speeds alone; with
    /// `begin` the time is fixed at zero.
    pub(super) fn free(equations: &Equations, begin: bool) -> (Reduced, Self) {
        let free = Reduced {
            coordinates: (0..equations.coordinates.len()).collect(),
            equations: equations.clone(),
            redundant: Vec::new(),
            steps: Vec::new(),
            massless: None,
        };
        let motion = Self::kinematics(&free, begin);
        (free, motion)
    }

    /// Angles, speeds, basis and bias, in the order in which shafts follow from each other; with `begin` the time is
    /// fixed.
    fn kinematics(reduced: &Reduced, begin: bool) -> Self {
        let (n, mut graph) = (reduced.equations.coordinates.len(), Graph::default());
        let mut symbols = |rate: usize| -> Vec<Expr> {
            let symbol = |&coordinate: &usize| {
                let domain = reduced.equations.domain(coordinate);
                let name = domain.motion()[rate].of(&reduced.equations.coordinates[coordinate]);
                graph.new_symbol(name, domain.dimensions()[rate])
            };
            reduced.coordinates.iter().map(symbol).collect()
        };
        let (position, speed) = (symbols(0), symbols(1));
        let mut coefficient = |name: &String| (name.clone(), graph.new_symbol(name.clone(), Dimension::NONE));
        let run_parameters = reduced.equations.run_parameters.iter().map(&mut coefficient).collect();
        let (zero, one) = (graph.integer(0), graph.integer(1));
        let mut out = Self {
            symbols: position.iter().chain(&speed).filter_map(|&symbol| graph.symbol_of(symbol)).collect(),
            graph,
            angles: vec![zero; n],
            speeds: vec![zero; n],
            basis: vec![SparseRow::new(); n],
            bias: vec![zero; n],
            carried: vec![zero; n],
            inertia: BTreeMap::new(),
            passive: Vec::new(),
            passive_terms: Forces(vec![BTreeMap::new(); reduced.degrees_of_freedom()]),
            frictions: Vec::new(),
            friction_bias: Vec::new(),
            inputs: Vec::new(),
            laws: Vec::new(),
            multiplier_constraints: Vec::new(),
            timed: Timed { begin, ..Timed::default() },
            run_parameters,
            relaxing: None,
        };
        for (k, &shaft) in reduced.coordinates.iter().enumerate() {
            (out.angles[shaft], out.speeds[shaft]) = (position[k], speed[k]);
            out.basis[shaft].insert(k, one);
        }
        out.set_relaxing(reduced, &position, &speed);
        out.follow(reduced);
        out
    }

    /// Shafts that follow from others, one after the other.
    fn follow(&mut self, reduced: &Reduced) {
        let moving = self.moving(reduced);
        for Step { shaft, argument, curve } in &reduced.steps {
            let constant = rational_from_f64(argument.constant).unwrap_or(Rational::ZERO);
            let terms = &argument.terms;
            let (speed, bias) = (self.sum(terms, |out, k| out.speeds[k]), self.sum(terms, |out, k| out.bias[k]));
            let angle = self.sum(terms, |out, k| out.angles[k]);
            let angle = self.graph.sum(constant, &[(angle, Rational::ONE)]);
            let carried = self.sum(terms, |out, k| out.carried[k]);
            let [angle, speed, bias, carried] = self.moved([angle, speed, bias, carried], &argument.moving, &moving);
            let row = self.reduced_row(terms);
            let (angle, speed, bias, carried, row) = match curve {
                None => (angle, speed, bias, carried, row),
                Some(curve) => {
                    // y = γ(x): K_y = γ′ K_x, k_y = γ″ ẋ² + γ′ k_x, u_y = γ′ u_x
                    let graph = &mut self.graph;
                    let [value, slope, curvature] = curve.expressions(graph, angle);
                    let bent = graph.product(&[(curvature, 1), (speed, 2)]);
                    let slope_term = graph.multiply(slope, bias);
                    let bias = graph.add(bent, slope_term);
                    let row = row.into_iter().map(|(k, entry)| (k, graph.multiply(slope, entry))).collect();
                    (value, graph.multiply(slope, speed), bias, graph.multiply(slope, carried), row)
                }
            };
            (self.angles[*shaft], self.speeds[*shaft], self.bias[*shaft]) = (angle, speed, bias);
            (self.carried[*shaft], self.basis[*shaft]) = (carried, row);
        }
    }

    /// `Σ c x_k` over a row.
    pub fn sum(&mut self, row: &[(usize, Rational)], of: impl Fn(&Self, usize) -> Expr) -> Expr {
        let terms: Vec<(Expr, Rational)> = row.iter().map(|(k, c)| (of(self, *k), c.clone())).collect();
        self.graph.sum(Rational::ZERO, &terms)
    }

    /// `aᵀK`
    pub fn reduced_row(&mut self, row: &[(usize, Rational)]) -> SparseRow {
        let mut entries: BTreeMap<usize, Vec<(Expr, Rational)>> = BTreeMap::new();
        for (shaft, c) in row {
            for (column, entry) in &self.basis[*shaft] {
                entries.entry(*column).or_default().push((*entry, c.clone()));
            }
        }
        let graph = &mut self.graph;
        let entries = entries.into_iter().map(|(column, terms)| (column, graph.sum(Rational::ZERO, &terms)));
        entries.collect::<Vec<_>>().into_iter().filter(|(_, entry)| !graph.is_zero(*entry)).collect()
    }

    /// Inertia and forces, term by term.
    fn terms(&mut self, reduced: &Reduced) {
        let equations = &reduced.equations;
        let mut inertia: BTreeMap<(usize, usize), Vec<(Expr, Rational)>> = BTreeMap::new();
        let minus = Rational::from(-1);
        let resist = |out: &mut Self, row: &[(usize, Rational)], force: Expr| -> SparseRow {
            let row = out.reduced_row(row);
            out.passive_terms.add(&mut out.graph, &row, force, &minus);
            row
        };
        for (k, damper) in equations.dampers.iter().enumerate() {
            let force = self.damper_torque(reduced, k);
            if reduced.massless.is_some() {
                self.damp_relaxing(reduced, &damper.row, (force, &damper.value), &mut inertia);
            } else {
                resist(self, &damper.row, force);
            }
        }
        for (k, spring) in equations.springs.iter().enumerate() {
            let force = self.spring_torque(reduced, k);
            let row = self.reduced_row(&spring.row);
            self.passive_terms.add(&mut self.graph, &Self::spring_row(reduced, row), force, &minus);
        }
        for body in &equations.inertias {
            let bias = self.sum(&body.row, |out, k| out.bias[k]);
            let force = self.resisting(bias, &body.value);
            let (row, coefficient) = (resist(self, &body.row, force), self.exact(&body.value));
            for (i, first) in &row {
                for (j, second) in row.range(..=i) {
                    let product = self.graph.product(&[(coefficient, 1), (*first, 1), (*second, 1)]);
                    inertia.entry((*i, *j)).or_default().push((product, Rational::ONE));
                }
            }
        }
        self.add_laws(reduced);
        let graph = &mut self.graph;
        self.passive = self.passive_terms.sums(graph);
        self.inertia = inertia.into_iter().map(|(place, terms)| (place, graph.sum(Rational::ZERO, &terms))).collect();
        let zero = graph.integer(0);
        self.inertia.retain(|_, entry| *entry != zero);
    }

    /// The outputs of an evaluation of the equations of motion, by name: angles and speeds of the shafts that follow
    /// from the coordinates, `H[i,j]`, `force[i]` (of springs, dampers and inertias), directions of frictions and
    /// inputs over the coordinates.
    pub fn outputs(&self, reduced: &Reduced) -> Vec<(String, Expr)> {
        let names = reduced.coordinate_names();
        let mut outputs = Vec::new();
        for shaft in reduced.dependents() {
            let quantities = reduced.equations.domain(shaft).motion();
            for (quantity, expr) in quantities.into_iter().zip([self.angles[shaft], self.speeds[shaft]]) {
                outputs.push((quantity.of(&reduced.equations.coordinates[shaft]), expr));
            }
        }
        let entry = |(&(i, j), &expr): (&(usize, usize), &Expr)| (format!("H[{},{}]", names[i], names[j]), expr);
        outputs.extend(self.inertia.iter().map(entry));
        outputs.extend(names.iter().zip(&self.passive).map(|(name, expr)| (format!("force[{name}]"), *expr)));
        let equations = &reduced.equations;
        let frictions = equations.set_valued().map(|(element, _)| element).zip(&self.frictions);
        let inputs = equations.inputs.iter().map(|term| term.element.as_str()).zip(&self.inputs);
        for (kind, (element, row)) in frictions.map(|one| ("friction", one)).chain(inputs.map(|one| ("input", one))) {
            outputs.extend(row.iter().map(|(i, expr)| (format!("{kind}[{element},{}]", names[*i]), *expr)));
        }
        let first = equations.set_valued().count();
        for (k, constraint) in equations.multiplier_constraints.iter().enumerate() {
            let row = self.frictions[first + k].iter();
            outputs.extend(row.map(|(i, expr)| (format!("kept[{},{}]", constraint.element, names[*i]), *expr)));
            outputs.push((format!("kept[{}]", constraint.element), self.friction_bias[first + k]));
        }
        outputs
    }

    /// A function of time as an expression. Its time-dependent terms become part of [`timed`](Self::timed), once for
    /// all functions.
    pub fn of_time(&mut self, function: &OfTime) -> Expr {
        let Timed { time, parts, begin, .. } = &mut self.timed;
        let begin = *begin;
        let mut time = |graph: &mut Graph| match begin {
            true => graph.integer(0),
            false => *time.get_or_insert_with(|| graph.new_symbol("t".into(), Dimension::TIME)),
        };
        let mut part = |graph: &mut Graph, part: &Arc<Part>| match parts.iter().find(|(candidate, _)| candidate == part)
        {
            _ if begin => graph.number(rational_from_f64(part.pieces.value(0.0)).unwrap_or(Rational::ZERO)),
            Some((_, symbol)) => *symbol,
            None => {
                let symbol = graph.new_symbol(part.name.clone(), part.dimension);
                parts.push((Arc::clone(part), symbol));
                symbol
            }
        };
        function.write_into(&mut self.graph, &mut time, &mut part)
    }

    /// The expression of a rational times a power of π; the symbol of a coefficient that is an input.
    pub fn exact(&mut self, value: &Exact) -> Expr {
        if let (false, Some(InNames::Name(name))) = (self.run_parameters.is_empty(), value.in_names())
            && let Some((_, symbol)) = self.run_parameters.iter().find(|(own, _)| own == name)
        {
            return *symbol;
        }
        self.graph.exact(value)
    }

    /// Values of expressions at reduced coordinates and their speeds, where these are given; all other symbols are zero.
    pub(super) fn values_at(&self, exprs: &[Expr], position: &[f64], speed: &[f64]) -> Vec<f64> {
        let value = |symbol: Symbol| {
            let place = self.symbols.iter().position(|own| *own == symbol)?;
            position.iter().chain(speed).nth(place).copied()
        };
        lower(&self.graph, exprs, &mut Floating::<f64>::default(), |symbol| value(symbol).unwrap_or(0.0))
    }

    /// The plan of expressions, by name.
    pub fn compile(&self, outputs: &[(String, Expr)]) -> Plan {
        let inputs: Vec<Symbol> = self.symbols.iter().copied().chain(self.timed.symbols(&self.graph)).collect();
        compile(&self.graph, &inputs, outputs)
            .expect("expressions of a model depend on its coordinates, their speeds and the time")
    }
}
