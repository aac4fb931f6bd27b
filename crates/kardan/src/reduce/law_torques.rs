//! Torques that expressions give at measured motions.

use super::law_slopes::unconstrained;
use super::{Motion, Reduced, Timed};
use crate::equations::Formula;
use crate::expr::{Expr, Graph, Symbol};
use crate::plan::{Plan, compile};
use crate::units::Dimension;

/// Why a torque is not linear in a parameter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotLinear {
    /// The parameter.
    pub parameter: String,
    /// Number of the formula.
    pub formula: usize,
    /// Whether where it bends or jumps depends on the parameter; else its derivative does.
    pub kink: bool,
}

/// Torques that formulas give, at any angles and speeds of all shafts: `τ = τ₀ + Σ p ∂τ/∂p` with exact derivatives by parameters p in which
/// they are linear, together.
#[derive(Debug, Clone)]
pub struct LawTorques {
    plan: Plan,
    memory: Vec<f64>,
    shafts: usize,
    formulas: usize,
    parameters: usize,
    timed: Timed,
    /// Of each formula the derivatives by angles (numbers of shafts) and by speeds (behind them), with the number of the output.
    slopes: Vec<Vec<(usize, usize)>>,
    /// Where the formulas jump: the number of the output, and those of its derivatives by angles and speeds.
    jumps: Vec<(usize, Vec<(usize, usize)>)>,
}

impl LawTorques {
    /// Torques of formulas of a model; those of the names `parameters` are left open.
    ///
    /// # Errors
    /// A parameter in which a formula is not linear.
    pub fn new(reduced: &Reduced, formulas: &[&Formula], parameters: &[String]) -> Result<Self, NotLinear> {
        let (n, free) = (reduced.equations.coordinates.len(), unconstrained(reduced));
        let mut motion = Motion::kinematics(&free, false);
        let mut symbol = |name: &str| motion.graph.new_symbol(name.into(), Dimension::NONE);
        let mesh = [symbol("load"), symbol("speed")];
        let open: Vec<(String, Expr)> = parameters.iter().map(|name| (name.clone(), symbol(name))).collect();
        let torques: Vec<Expr> =
            formulas.iter().map(|formula| motion.formula_with(&free, formula, mesh, &open)).collect();
        let own = |graph: &Graph, exprs: &[Expr]| -> Vec<Symbol> {
            exprs.iter().filter_map(|expr| graph.symbol_of(*expr)).collect()
        };
        let (moving, given) = (motion.symbols.clone(), motion.timed.symbols(&motion.graph));
        let graph = &mut motion.graph;
        let opened = own(graph, &open.iter().map(|(_, symbol)| *symbol).collect::<Vec<_>>());
        let shares = shares(graph, &torques, &opened, parameters)?;
        let zero = graph.integer(0);
        let at_zero: Vec<(Symbol, Expr)> = opened.iter().map(|symbol| (*symbol, zero)).collect();
        let rest = graph.substitute(&torques, &at_zero);
        let mut outputs: Vec<Expr> = rest.iter().copied().chain(shares).collect();
        let derivatives = |graph: &mut Graph, outputs: &mut Vec<Expr>, of: Expr| -> Vec<(usize, usize)> {
            let used = graph.symbols(&[of]);
            let by = moving.iter().enumerate().filter(|(_, symbol)| used.contains(symbol)).collect::<Vec<_>>();
            let put = |(place, symbol): (usize, &Symbol)| {
                outputs.push(graph.derivative(of, *symbol));
                (place, outputs.len() - 1)
            };
            by.into_iter().map(put).collect()
        };
        // At the values of the file: how noise of angles and speeds goes through.
        let values = values(graph, formulas, &open);
        let nominal = graph.substitute(&torques, &values);
        let slopes = nominal.iter().map(|torque| derivatives(graph, &mut outputs, *torque)).collect();
        let mut jumps = Vec::new();
        for torque in &torques {
            for at in graph.jumps(*torque) {
                outputs.push(at);
                let place = outputs.len() - 1;
                jumps.push((place, derivatives(graph, &mut outputs, at)));
            }
        }
        let inputs: Vec<Symbol> = moving.iter().copied().chain(own(graph, &mesh)).chain(given).collect();
        let named: Vec<(String, Expr)> = outputs.iter().enumerate().map(|(k, one)| (k.to_string(), *one)).collect();
        let plan = compile(graph, &inputs, &named).expect("a torque depends on motion, load and time");
        Ok(Self {
            memory: plan.memory(),
            plan,
            shafts: n,
            formulas: formulas.len(),
            parameters: parameters.len(),
            timed: motion.timed,
            slopes,
            jumps,
        })
    }

    /// Takes angles (rad) and speeds (rad/s) of all shafts at a time (s); of the loss of a mesh, the size of its load (N m) and of its speed.
    ///
    /// # Panics
    /// If a length does not fit.
    pub fn update(&mut self, angles: &[f64], speeds: &[f64], time: f64, mesh: [f64; 2]) {
        let n = self.shafts;
        self.memory[..n].copy_from_slice(angles);
        self.memory[n..2 * n].copy_from_slice(speeds);
        self.memory[2 * n..2 * n + 2].copy_from_slice(&mesh);
        let given = self.memory[2 * n + 2..].iter_mut();
        given.zip(self.timed.values(time)).for_each(|(place, value)| *place = value);
        // What is no number is seen where it stands.
        let _ = self.plan.block().evaluate(&mut self.memory);
    }

    fn output(&self, output: usize) -> f64 {
        self.memory[self.plan.place(output)]
    }

    /// The torque of a formula with the open parameters at zero, N m.
    pub fn torque(&self, formula: usize) -> f64 {
        self.output(formula)
    }

    /// Its derivative by an open parameter.
    pub fn share(&self, formula: usize, parameter: usize) -> f64 {
        self.output(self.formulas + formula * self.parameters + parameter)
    }

    /// Its derivatives by angles and speeds, at the values of the file: the shaft, whether it is by the speed, and the derivative.
    pub fn slopes(&self, formula: usize) -> impl Iterator<Item = (usize, bool, f64)> + '_ {
        let n = self.shafts;
        self.slopes[formula].iter().map(move |(place, output)| (place % n, *place >= n, self.output(*output)))
    }

    /// Whether no formula jumps within so much time (s) either way, as speeds (rad/s) and accelerations (rad/s²) of the shafts say.
    pub fn is_smooth(&self, half: f64, speeds: &[f64], accelerations: &[f64]) -> bool {
        let rate = |place: usize| match place.checked_sub(self.shafts) {
            Some(shaft) => accelerations[shaft],
            None => speeds[place],
        };
        self.jumps.iter().all(|(place, by)| {
            let change: f64 = by.iter().map(|(place, output)| self.output(*output) * rate(*place)).sum();
            self.output(*place).abs() > half * change.abs()
        })
    }
}

/// The derivatives of torques by parameters in which they are linear.
fn shares(
    graph: &mut Graph,
    torques: &[Expr],
    parameters: &[Symbol],
    names: &[String],
) -> Result<Vec<Expr>, NotLinear> {
    let mut out = Vec::new();
    for (formula, &torque) in torques.iter().enumerate() {
        for (symbol, name) in parameters.iter().zip(names) {
            let share = graph.derivative(torque, *symbol);
            let wrong = |kink| NotLinear { parameter: name.clone(), formula, kink };
            // A jump has no derivative that would tell of it.
            let kinks = graph.kinks(torque);
            if graph.symbols(&kinks).contains(symbol) {
                return Err(wrong(true));
            }
            if graph.symbols(&[share]).iter().any(|used| parameters.contains(used)) {
                return Err(wrong(false));
            }
            out.push(share);
        }
    }
    Ok(out)
}

/// The parameters as the file gives them.
fn values(graph: &mut Graph, formulas: &[&Formula], open: &[(String, Expr)]) -> Vec<(Symbol, Expr)> {
    let mut out = Vec::new();
    for (name, expr) in open {
        let given = formulas.iter().flat_map(|formula| &formula.names).find_map(|(other, meaning)| match meaning {
            crate::equations::Meaning::Constant(value, _) if other == name => Some(value.clone()),
            _ => None,
        });
        let value = graph.number(given.map(|value| value.to_rational()).unwrap_or_default());
        out.extend(graph.symbol_of(*expr).map(|symbol| (symbol, value)));
    }
    out
}
