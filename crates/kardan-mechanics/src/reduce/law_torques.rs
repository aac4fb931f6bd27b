//! Torque expressions at measured motions.

use super::{Motion, Reduced, Timed};
use crate::assemble::Equations;
use crate::equations::{Formula, Meaning};
use kardan_expr::expr::{Expr, Function, Graph, Symbol};
use kardan_expr::plan::{Plan, compile};
use kardan_math::num::{Rational, rational_to_f64};
use kardan_math::units::Dimension;

/// Why a torque is not linear in a parameter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotLinear {
    /// The parameter.
    pub parameter: String,
    /// Number of the formula.
    pub formula: usize,
    /// Whether the location of a kink or jump depends on the parameter; else its derivative does.
    pub kink: bool,
}

/// `cos nφ` or `sin nφ` of the angle of a shaft, by its number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wave {
    /// The shaft.
    pub shaft: usize,
    /// n
    pub order: f64,
    /// Whether it is the sine.
    pub sine: bool,
}

/// The sines and cosines of angles in the laws of torques, both of each.
pub fn law_waves(equations: &Equations) -> Vec<Wave> {
    let (free, mut motion) = Motion::free(equations, false);
    let torques: Vec<Expr> = equations.laws.iter().map(|law| motion.formula(&free, &law.value)).collect();
    let mut out: Vec<Wave> = Vec::new();
    for (_, _, symbol, [order, _]) in motion.graph.waves(&torques) {
        let place = motion.symbols.iter().position(|own| *own == symbol);
        let Some(shaft) = place.filter(|place| *place < equations.coordinates.len()) else { continue };
        let order = rational_to_f64(&order);
        for wave in [false, true].map(|sine| Wave { shaft, order, sine }) {
            if !out.contains(&wave) {
                out.push(wave);
            }
        }
    }
    out
}

/// Expressions with given numbers in place of sines and cosines of angles, where both are given.
fn with_waves(motion: &mut Motion, torques: &[Expr], waves: &[Wave], wave_exprs: &[Expr]) -> Vec<Expr> {
    let mut replacements = Vec::new();
    for (expr, is_sine, symbol, [order, shift]) in motion.graph.waves(torques) {
        let place = motion.symbols.iter().position(|own| *own == symbol);
        let order = rational_to_f64(&order);
        let find = |sine: bool| {
            waves.iter().position(|one| Some(one.shaft) == place && one.order == order && one.sine == sine)
        };
        let (Some(cosine), Some(sine)) = (find(false), find(true)) else { continue };
        let graph = &mut motion.graph;
        let angle = graph.number(shift);
        let [of_cosine, of_sine] = [Function::Cos, Function::Sin].map(|function| graph.apply(function, angle));
        // sin(a + c) = sin a cos c + cos a sin c, cos(a + c) = cos a cos c − sin a sin c.
        let (first, second, sign) = match is_sine {
            true => (wave_exprs[sine], wave_exprs[cosine], 1),
            false => (wave_exprs[cosine], wave_exprs[sine], -1),
        };
        let parts = [graph.multiply(first, of_cosine), graph.multiply(second, of_sine)];
        replacements
            .push((expr, graph.sum(Rational::ZERO, &[(parts[0], Rational::ONE), (parts[1], Rational::from(sign))])));
    }
    motion.graph.replace(torques, &replacements)
}

/// Torques that formulas give, at any angles and speeds of all shafts: `τ = τ₀ + Σ p ∂τ/∂p` with exact derivatives by parameters p in which
/// they are linear, together.
#[derive(Debug, Clone)]
pub struct LawTorques {
    plan: Plan,
    memory: Vec<f64>,
    shafts: usize,
    waves: usize,
    formulas: usize,
    parameters: usize,
    timed: Timed,
    /// Of each formula the derivatives by angles (numbers of shafts) and by speeds (behind them), with the number of the output.
    slopes: Vec<Vec<(usize, usize)>>,
    /// Where the formulas jump: the number of the output, and those of its derivatives by angles and speeds.
    jumps: Vec<(usize, Vec<(usize, usize)>)>,
}

impl LawTorques {
    /// Torques of formulas of a model; those of the names `parameters` are left open. Sines and cosines of `waves` are
    /// inputs: their means over a time are not those of the mean angle.
    ///
    /// # Errors
    /// A parameter in which a formula is not linear.
    pub fn new(
        reduced: &Reduced,
        formulas: &[&Formula],
        parameters: &[String],
        waves: &[Wave],
    ) -> Result<Self, NotLinear> {
        let (free, mut motion) = Motion::free(&reduced.equations, false);
        let mut symbol = |name: &str| motion.graph.new_symbol(name.into(), Dimension::NONE);
        let load_and_speed = [symbol("load"), symbol("speed")];
        let waved: Vec<Expr> = (0..waves.len()).map(|k| symbol(&format!("wave.{k}"))).collect();
        let open: Vec<(String, Expr)> = parameters.iter().map(|name| (name.clone(), symbol(name))).collect();
        let plain: Vec<Expr> =
            formulas.iter().map(|formula| motion.formula_with(&free, formula, load_and_speed, &open)).collect();
        let torques = with_waves(&mut motion, &plain, waves, &waved);
        let own = |graph: &Graph, exprs: &[Expr]| -> Vec<Symbol> {
            exprs.iter().filter_map(|expr| graph.symbol_of(*expr)).collect()
        };
        let (moving, time_symbols) = (motion.symbols.clone(), motion.timed.symbols(&motion.graph));
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
        // At the values of the file: the effect of noise of angles and speeds.
        let values = values(graph, formulas, &open);
        let nominal = graph.substitute(&plain, &values);
        let slopes = nominal.iter().map(|torque| derivatives(graph, &mut outputs, *torque)).collect();
        let mut jumps = Vec::new();
        for torque in &plain {
            for at in graph.jumps(*torque) {
                outputs.push(at);
                let place = outputs.len() - 1;
                jumps.push((place, derivatives(graph, &mut outputs, at)));
            }
        }
        let inputs: Vec<Symbol> = moving
            .iter()
            .copied()
            .chain(own(graph, &load_and_speed))
            .chain(own(graph, &waved))
            .chain(time_symbols)
            .collect();
        let named: Vec<(String, Expr)> = outputs.iter().enumerate().map(|(k, one)| (k.to_string(), *one)).collect();
        let plan = compile(graph, &inputs, &named).expect("a torque depends on motion, load and time");
        Ok(Self {
            memory: plan.memory(),
            plan,
            shafts: reduced.equations.coordinates.len(),
            waves: waves.len(),
            formulas: formulas.len(),
            parameters: parameters.len(),
            timed: motion.timed,
            slopes,
            jumps,
        })
    }

    /// Receives angles (rad) and speeds (rad/s) of all shafts at a time (s); for a gear loss, the size of its load (N
    /// m) and of its speed; and the given sines and cosines.
    ///
    /// # Panics
    /// If a length does not fit.
    pub fn update(&mut self, angles: &[f64], speeds: &[f64], time: f64, load_and_speed: [f64; 2], waves: &[f64]) {
        let n = self.shafts;
        self.memory[..n].copy_from_slice(angles);
        self.memory[n..2 * n].copy_from_slice(speeds);
        self.memory[2 * n..2 * n + 2].copy_from_slice(&load_and_speed);
        let from = 2 * n + 2 + self.waves;
        self.memory[2 * n + 2..from].copy_from_slice(waves);
        let timed_inputs = self.memory[from..].iter_mut();
        timed_inputs.zip(self.timed.values(time)).for_each(|(place, value)| *place = value);
        // A value that is not a number is detected where it is used.
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

    /// Whether no formula jumps within this time (s) before or after, according to the speeds (rad/s) and accelerations
    /// (rad/s²) of the shafts.
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
            // A jump has no derivative that would show it.
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

/// The parameters with the values of the file.
fn values(graph: &mut Graph, formulas: &[&Formula], open: &[(String, Expr)]) -> Vec<(Symbol, Expr)> {
    let mut out = Vec::new();
    for (name, expr) in open {
        let coefficient =
            formulas.iter().flat_map(|formula| formula.all_names()).find_map(|(candidate, meaning)| match meaning {
                Meaning::Constant(value, _) if candidate == name => Some(value.clone()),
                _ => None,
            });
        let value = graph.number(coefficient.map(|value| value.to_rational()).unwrap_or_default());
        out.extend(graph.symbol_of(*expr).map(|symbol| (symbol, value)));
    }
    out
}
