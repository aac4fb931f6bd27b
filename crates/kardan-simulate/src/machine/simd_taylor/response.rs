//! Accelerations and constraint torques in lanes. With `H a = f − Gᵀ λ` they follow from forces and biases by matrices that each lane has at
//! its point: of all directions, where inactive ones have rows of zeros.

use kardan_native::Step;
use kardan_rt::Operator;

use super::lanes::{Lane, compiled, symbols};
use crate::compiled_plan::{CompiledPlan, exact};
use crate::machine::Machine;
use crate::machine::expansion::ByPosition;
use kardan_expr::expr::{Expr, Graph};
use kardan_math::num::Rational;

/// Indices into the memory of the plan.
pub(super) struct Places {
    /// Inputs of the plan; the first source among them.
    pub(super) inputs: usize,
    pub(super) sources: usize,
    /// The first of the time-dependent inputs.
    pub(super) timed: usize,
    pub(super) forces: Vec<usize>,
    pub(super) rates: Vec<usize>,
    pub(super) friction_speeds: Vec<usize>,
    /// Further values that are read.
    pub(super) also: Vec<usize>,
    pub(super) by_position: ByPosition,
}

/// Accelerations and constraint torques for forces and biases: `a = A f − B b`, `λ = L f + S b`, in lanes with masks.
pub(super) struct Response<N> {
    pub(super) numbers: CompiledPlan<N>,
    /// Indices of the plan for its first inputs; behind them are 1 for each active direction and for each coordinate
    /// that moves.
    pub(super) from: Vec<usize>,
    /// Directions that have a bias.
    biased: Vec<usize>,
    /// Whether an entry of the matrices, one after the other, exists.
    pub(super) is_nonzero: Vec<bool>,
}

impl<N: Lane> Response<N> {
    pub(super) fn new(machine: &Machine, places: &Places) -> Self {
        let (r, m) = (machine.degrees_of_freedom, machine.modes.len());
        let (mut graph, mut from, mut inputs) = (Graph::default(), Vec::new(), Vec::new());
        let mut input_of = |graph: &mut Graph, place: usize| match from.iter().position(|own| *own == place) {
            Some(input) => inputs[input],
            None => {
                from.push(place);
                inputs.push(symbols(graph, 1)[0]);
                inputs[inputs.len() - 1]
            }
        };
        let mut h: Vec<Expr> = machine.work.inertia.iter().map(|x| graph.number(exact(*x))).collect();
        let ByPosition { inertia, rows, bias } = &places.by_position;
        inertia.iter().for_each(|(i, j, place)| h[i * r + j] = input_of(&mut graph, *place));
        let mut g: Vec<Expr> = machine.work.friction_rows[..m * r].iter().map(|x| graph.number(exact(*x))).collect();
        for (d, row) in rows.iter().enumerate() {
            row.iter().for_each(|(i, place)| g[d * r + i] = input_of(&mut graph, *place));
        }
        let biased: Vec<usize> = (0..m).filter(|d| !rows[*d].is_empty() || bias[*d].is_some()).collect();
        let zero = graph.integer(0);
        let f: Vec<Expr> = places.forces.iter().map(|place| input_of(&mut graph, *place)).collect();
        let b: Vec<Expr> = biased.iter().map(|d| bias[*d].map_or(zero, |place| input_of(&mut graph, place))).collect();
        let (sticking, moves) = (symbols(&mut graph, m), symbols(&mut graph, r));
        inputs.extend(sticking.iter().chain(&moves));
        let outputs = Self::matrices(&mut graph, (&h, &g), (&sticking, &moves), (&f, &b), &biased);
        let is_nonzero = outputs.iter().map(|output| !graph.is_zero(*output)).collect();
        Self { numbers: compiled(&graph, &inputs, outputs), from, biased, is_nonzero }
    }

    /// A, B, L and S row by row, then the accelerations and the torques.
    fn matrices(
        graph: &mut Graph,
        (h, g): (&[Expr], &[Expr]),
        (sticking, moves): (&[Expr], &[Expr]),
        (f, b): (&[Expr], &[Expr]),
        biased: &[usize],
    ) -> Vec<Expr> {
        let (r, m, one) = (moves.len(), sticking.len(), graph.integer(1));
        let h = inverse(graph, h, r);
        let mut w = Vec::new();
        for d in 0..m {
            for i in 0..r {
                let sum = sum_of_products(graph, (0..r).map(|j| (h[i * r + j], g[d * r + j])));
                w.push(graph.multiply(sum, sticking[d]));
            }
        }
        let mut own = Vec::new();
        for d in 0..m {
            for e in 0..m {
                let sum = sum_of_products(graph, (0..r).map(|i| (g[d * r + i], w[e * r + i])));
                let sum = graph.multiply(sum, sticking[d]);
                let difference = graph.subtract(one, sticking[d]);
                let sum = if d == e { graph.add(sum, difference) } else { sum };
                own.push(graph.group(sum));
            }
        }
        let shares = inverse(graph, &own, m);
        let mut of_bias = Vec::new();
        for d in 0..m {
            biased.iter().for_each(|e| of_bias.push(graph.multiply(shares[d * m + e], sticking[*e])));
        }
        let n = biased.len();
        let mut of_force = Vec::new();
        for d in 0..m {
            for i in 0..r {
                of_force.push(sum_of_products(graph, (0..m).map(|e| (shares[d * m + e], w[e * r + i]))));
            }
        }
        let (mut on_force, mut on_bias) = (Vec::new(), Vec::new());
        for i in 0..r {
            for j in 0..r {
                let less = sum_of_products(graph, (0..m).map(|d| (w[d * r + i], of_force[d * r + j])));
                let difference = graph.subtract(h[i * r + j], less);
                on_force.push(graph.multiply(difference, moves[i]));
            }
            for k in 0..n {
                let sum = sum_of_products(graph, (0..m).map(|d| (w[d * r + i], of_bias[d * n + k])));
                on_bias.push(graph.multiply(sum, moves[i]));
            }
        }
        let mut both = |on_f: &[Expr], on_b: &[Expr], row: usize, sign: i64| {
            let of_f = sum_of_products(graph, f.iter().enumerate().map(|(j, f)| (on_f[row * r + j], *f)));
            let of_b = sum_of_products(graph, b.iter().enumerate().map(|(k, b)| (on_b[row * n + k], *b)));
            graph.sum(Rational::ZERO, &[(of_f, Rational::ONE), (of_b, sign.into())])
        };
        let accelerations: Vec<Expr> = (0..r).map(|i| both(&on_force, &on_bias, i, -1)).collect();
        let torques: Vec<Expr> = (0..m).map(|d| both(&of_force, &of_bias, d, 1)).collect();
        [on_force, on_bias, of_force, of_bias, accelerations, torques].concat()
    }

    /// The steps of series for indices from a first one on: matrices, accelerations, torques, then intermediate values;
    /// and how many indices they use.
    pub(super) fn steps(&self, places: &Places, first: usize, steady: &[bool]) -> (usize, Vec<Step>) {
        let ByPosition { inertia, rows, bias: places_of_bias } = &places.by_position;
        let (r, m, n) = (places.forces.len(), rows.len(), self.biased.len());
        let (mut steps, all) = (Vec::new(), self.is_nonzero.len());
        let mut next = first + all;
        let [a, torque] = [first + all - m - r, first + all - m];
        let mut put = |operator: Operator, scaled: bool, operands: [usize; 3], out: Option<usize>| {
            let out = out.unwrap_or_else(|| {
                next += 1;
                next - 1
            });
            let operands = operands.map(|place| place as u32);
            steps.push(Step { operator, scaled, out: out as u32, operands, more: 0 });
            out
        };
        let mut force = places.forces.clone();
        for &(row, column, place) in inertia.iter().filter(|(.., place)| !steady[*place]) {
            force[row] = put(Operator::SubtractProduct, false, [place, a + column, force[row]], None);
        }
        let moving = |d: &usize| places_of_bias[*d].filter(|place| !steady[*place]);
        let mut bias: Vec<Option<usize>> = self.biased.iter().map(moving).collect();
        for (d, row) in rows.iter().enumerate() {
            for &(i, place) in row.iter().filter(|(_, place)| !steady[*place]) {
                force[i] = put(Operator::SubtractProduct, false, [place, torque + d, force[i]], None);
                let own = self.biased.iter().position(|other| *other == d).expect("it has a bias");
                bias[own] = Some(match bias[own] {
                    Some(sum) => put(Operator::AddProduct, false, [place, a + i, sum], None),
                    None => put(Operator::Multiply, false, [place, a + i, 0], None),
                });
            }
        }
        let starts = [0, r * r, r * r + r * n, r * r + r * n + m * r].map(|start| first + start);
        for row in 0..r + m {
            let (on_force, on_bias, row, out, operator) = match row.checked_sub(r) {
                None => (starts[0], starts[1], row, a + row, Operator::SubtractProduct),
                Some(row) => (starts[2], starts[3], row, torque + row, Operator::AddProduct),
            };
            let forces = force.iter().enumerate().map(|(j, f)| (*f, on_force + row * r + j, Operator::AddProduct));
            let biases = bias.iter().enumerate().filter_map(|(k, b)| Some(((*b)?, on_bias + row * n + k, operator)));
            let terms: Vec<_> = forces.chain(biases).filter(|(_, matrix, _)| self.is_nonzero[matrix - first]).collect();
            let mut sum = None;
            for (k, (value, matrix, operator)) in terms.iter().enumerate() {
                let out = (k + 1 == terms.len()).then_some(out);
                sum = Some(match (sum, operator) {
                    (Some(sum), _) => put(*operator, true, [*value, *matrix, sum], out),
                    (None, Operator::AddProduct) => put(Operator::Multiply, true, [*value, *matrix, 0], out),
                    (None, _) => {
                        let product = put(Operator::Multiply, true, [*value, *matrix, 0], None);
                        put(Operator::Negate, false, [product, 0, 0], out)
                    }
                });
            }
        }
        (next - first, steps)
    }
}

/// `Σ a_k b_k`
fn sum_of_products(graph: &mut Graph, pairs: impl Iterator<Item = (Expr, Expr)>) -> Expr {
    let terms: Vec<(Expr, Rational)> = pairs.map(|(a, b)| (graph.multiply(a, b), Rational::ONE)).collect();
    let sum = graph.sum(Rational::ZERO, &terms);
    graph.group(sum)
}

/// The inverse of a positive definite matrix (Gauss and Jordan).
fn inverse(graph: &mut Graph, a: &[Expr], n: usize) -> Vec<Expr> {
    let (zero, one, mut a) = (graph.integer(0), graph.integer(1), a.to_vec());
    for k in 0..n {
        let pivot = graph.divide(one, a[k * n + k]);
        let pivot = graph.group(pivot);
        a[k * n + k] = one;
        for j in 0..n {
            a[k * n + j] = graph.multiply(a[k * n + j], pivot);
        }
        for i in (0..n).filter(|i| *i != k) {
            let factor = std::mem::replace(&mut a[i * n + k], zero);
            for j in 0..n {
                let less = graph.multiply(factor, a[k * n + j]);
                let difference = graph.subtract(a[i * n + j], less);
                a[i * n + j] = graph.group(difference);
            }
        }
    }
    a
}
