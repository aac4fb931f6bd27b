//! Equations in symbols with constraints that are kept, prescribed motions and what holds by modes: what is printed, evaluated at random points,
//! gives the accelerations and multipliers of the plan of a run.

use std::collections::HashMap;

use kardan::expr::{Expr, Symbol};
use kardan::num::Lu;
use kardan::plan::{Plan, compile};
use kardan::project::Project;
use kardan::reduce::{Acting, Motion, Reduced};
use kardan::results::SymbolicEquations;
use kardan::study::EquationsForm;
use kardan::units::Dimension;

use super::symbolic::{Point, Random, close, displays, filled, letters, of, symbolic, value};

/// What the plan of a run finds at one point, by name.
struct Numeric {
    found: HashMap<String, f64>,
    constraint_torques: Vec<f64>,
}

struct Sample {
    time: f64,
    position: Vec<f64>,
    speed: Vec<f64>,
    acceleration: Vec<f64>,
    inputs: Vec<f64>,
    /// Of frictions, then of what holds, then the opposite of each multiplier.
    frictions: Vec<f64>,
}

/// The equations of a run, and the multipliers that follow from accelerations and what acts, as one plan.
struct Exact {
    motion: Motion,
    plan: Plan,
    names: Vec<String>,
    constraints: usize,
}

impl Exact {
    fn new(reduced: &Reduced) -> Self {
        let mut motion = Motion::new(reduced);
        let equations = &reduced.equations;
        let frictions = equations.set_valued().count() + equations.multiplier_constraints.len();
        let counts = [reduced.degrees_of_freedom(), equations.inputs.len(), frictions];
        let [accelerations, inputs, frictions] = counts.map(|count| -> Vec<Expr> {
            (0..count).map(|_| motion.graph.new_symbol("given".into(), Dimension::NONE)).collect()
        });
        let acting = Acting { accelerations: &accelerations, inputs: &inputs, frictions: &frictions };
        let torques = motion.multipliers(reduced, acting);
        let mut outputs = motion.outputs(reduced);
        let names: Vec<String> = outputs.iter().map(|(name, _)| name.clone()).collect();
        outputs.extend(torques.iter().enumerate().map(|(k, torque)| (format!("constraint {k}"), *torque)));
        let acting = [accelerations, inputs, frictions].concat();
        let symbols: Vec<Symbol> = motion.symbols.iter().copied().chain(motion.timed.symbols(&motion.graph)).collect();
        let acting = acting.into_iter().filter_map(|expr| motion.graph.symbol_of(expr));
        let plan = compile(&motion.graph, &symbols.into_iter().chain(acting).collect::<Vec<_>>(), &outputs).unwrap();
        Self { motion, plan, names, constraints: torques.len() }
    }

    fn at(&self, sample: &Sample) -> Numeric {
        let mut storage = self.plan.memory();
        let motion = sample.position.iter().chain(&sample.speed).copied().chain(self.motion.timed.values(sample.time));
        let acting = sample.acceleration.iter().chain(&sample.inputs).chain(&sample.frictions).copied();
        storage.iter_mut().zip(motion.chain(acting)).for_each(|(place, value)| *place = value);
        assert!(self.plan.block().evaluate(&mut storage));
        let at = |k: usize| storage[self.plan.place(k)];
        let own = self.names.len();
        Numeric {
            // Both sides of a stop have one name: the first one counts.
            found: self.names.iter().enumerate().rev().map(|(k, name)| (name.clone(), at(k))).collect(),
            constraint_torques: (own..own + self.constraints).map(at).collect(),
        }
    }
}

/// Accelerations and multipliers from `H a − Aᵀλ = f`, `A a = c`.
fn solved(inertia: &[f64], rows: &[f64], force: &[f64], right: &[f64]) -> Vec<f64> {
    let (r, count) = (force.len(), right.len());
    let n = r + count;
    let mut matrix = vec![0.0; n * n];
    for i in 0..r {
        (0..r).for_each(|j| matrix[i * n + j] = inertia[i * r + j]);
        for k in 0..count {
            (matrix[i * n + r + k], matrix[(r + k) * n + i]) = (-rows[k * r + i], rows[k * r + i]);
        }
    }
    let mut out: Vec<f64> = force.iter().chain(right).copied().collect();
    let mut factor = Lu::new(n);
    factor.factor(&matrix);
    factor.solve(&mut out);
    out
}

fn word(name: &str) -> String {
    name.replace(['-', '.'], "_")
}

/// Points for each set of values.
const STATES: usize = 4;

/// At random values, times, angles and speeds: matrices, forces, rows and multipliers of both, and what follows from them, to 1e-9 of one plus
/// their size.
fn compare(model: &str, points: usize) {
    let mut random = Random(41);
    let found = symbolic(&filled(model, &mut random).0);
    let project = Project::open(filled(model, &mut random).0);
    let pages = [project.symbolic_text(EquationsForm::Latex), project.equations(EquationsForm::Latex)];
    pages.into_iter().for_each(|page| assert!(displays(&page.unwrap().0) >= 2));
    for _ in 0..points / STATES {
        let (text, numbers) = filled(model, &mut random);
        let project = Project::open(text.as_str());
        let prepared = project.prepared();
        let reduced = &prepared.variants.first().unwrap_or_else(|| panic!("{:?}", project.diagnostics())).reduced;
        let (equations, exact) = (&reduced.equations, Exact::new(reduced));
        for _ in 0..STATES {
            let mut list = |count: usize| -> Vec<f64> { (0..count).map(|_| random.between(-2.0, 2.0)).collect() };
            let r = reduced.degrees_of_freedom();
            let set_valued = equations.set_valued().count();
            let sample = Sample {
                time: list(1)[0].abs(),
                position: list(r),
                speed: list(r),
                acceleration: list(r),
                inputs: list(equations.inputs.len()),
                frictions: list(set_valued + equations.multiplier_constraints.len()),
            };
            let mut point = Point { values: HashMap::from([("t".to_string(), sample.time)]), functions: &|_, _| None };
            let (sample, numeric) = put(&found, (reduced, &exact), &numbers, sample, &mut point);
            check(&found, reduced, &sample, &numeric, &point);
        }
    }
}

/// Gives the names in formulas their values; frictions are what they are in motion.
fn put(
    found: &SymbolicEquations,
    (reduced, plan): (&Reduced, &Exact),
    numbers: &HashMap<String, f64>,
    mut sample: Sample,
    point: &mut Point<'_>,
) -> (Sample, Numeric) {
    let equations = &reduced.equations;
    let exact = plan.at(&sample);
    let mut speeds = vec![0.0; equations.coordinates.len()];
    for (k, name) in equations.coordinates.iter().enumerate() {
        let motion = equations.domain(k).motion();
        let own = reduced.coordinates.iter().position(|other| *other == k);
        let value = |order: usize| match own {
            Some(own) => [&sample.position, &sample.speed][order][own],
            None => exact.found[&motion[order].of(name)],
        };
        speeds[k] = value(1);
        point.values.insert(word(name), value(0));
        point.values.insert(format!("{}'", word(name)), speeds[k]);
    }
    for (k, own) in reduced.coordinates.iter().enumerate() {
        point.values.insert(format!("{}''", word(&equations.coordinates[*own])), sample.acceleration[k]);
    }
    let multiplier_constraints = equations.multiplier_constraints.iter().filter_map(|multiplier_constraints| {
        match &multiplier_constraints.law {
            kardan::equations::MultiplierLaw::Prescribed { order: 1 | 2, function, .. } => {
                Some((&multiplier_constraints.element, function))
            }
            _ => None,
        }
    });
    let mut functions = Vec::new();
    for (element, function) in equations.moving.iter().chain(multiplier_constraints) {
        let rates = [(**function).clone(), function.rate(), function.rate().rate()];
        for (order, rate) in rates.iter().enumerate() {
            functions.push((format!("b_{}{}", word(element), "'".repeat(order)), rate.value(sample.time)));
        }
    }
    point.values.extend(functions.iter().cloned());
    letters(found, numbers, point);
    // Formulas of functions of time are the functions of a run.
    for (name, expected) in functions {
        close(point.values[&name], expected, expected.abs(), &name);
    }
    for (k, friction) in equations.frictions.iter().enumerate() {
        let speed: f64 = friction.row_f64().iter().map(|(shaft, x)| x * speeds[*shaft]).sum();
        sample.frictions[k] = friction.value.torque.to_f64() * speed.signum();
    }
    for (k, input) in equations.inputs.iter().enumerate() {
        for end in ["", ".tau", ".f", ".v"] {
            point.values.insert(format!("{}{end}", word(&input.element)), sample.inputs[k]);
        }
    }
    let first = equations.frictions.len();
    for (k, unilateral) in equations.unilaterals.iter().enumerate() {
        let rubs = matches!(unilateral.value, kardan::equations::UnilateralConstraint::GearLoss(_));
        let names = if rubs { &[".friction"][..] } else { &[".tau", ".f", ".v"][..] };
        // Both sides of a stop are one torque: here all of it is on the first.
        let again = equations.unilaterals[..k].iter().any(|other| other.element == unilateral.element && !rubs);
        if again {
            sample.frictions[first + k] = 0.0;
            continue;
        }
        let sign = if unilateral.value.is_upper() { -1.0 } else { 1.0 };
        for end in names {
            point.values.insert(format!("{}{end}", word(&unilateral.element)), sign * sample.frictions[first + k]);
        }
    }
    let first = first + equations.unilaterals.len();
    for (k, multiplier_constraints) in found.multiplier_constraints.iter().enumerate() {
        point.values.insert(multiplier_constraints.multiplier.text.clone(), -sample.frictions[first + k]);
    }
    let exact = plan.at(&sample);
    for one in &found.dependent_coordinates {
        let name = &one.symbol.text;
        let formula = value(&one.formula.text, point);
        if let Some(expected) = point.values.get(name) {
            close(formula, *expected, expected.abs(), name);
        }
    }
    (sample, exact)
}

fn check(found: &SymbolicEquations, reduced: &Reduced, sample: &Sample, exact: &Numeric, point: &Point<'_>) {
    let (equations, names) = (&reduced.equations, reduced.coordinate_names());
    let (r, count) = (names.len(), equations.multiplier_constraints.len());
    assert_eq!(found.multiplier_constraints.len(), count);
    let number = |name: String| exact.found.get(&name).copied().unwrap_or(0.0);
    let entry = |list, letter: &str, i: usize, j: usize| {
        let symbol = format!("{letter}[{}, {}]", word(&names[i.max(j)]), word(&names[i.min(j)]));
        of(list, &symbol, point)
    };
    let square = |of: &dyn Fn(usize, usize) -> f64| -> Vec<f64> { (0..r * r).map(|k| of(k / r, k % r)).collect() };
    let inertia = [
        square(&|i, j| entry(&found.inertia, "H", i, j)),
        square(&|i, j| number(format!("H[{},{}]", names[i.max(j)], names[i.min(j)]))),
    ];
    let rows: [Vec<f64>; 2] = [
        (0..count * r)
            .map(|k| {
                let constraint = &found.multiplier_constraints[k / r];
                of(&constraint.row, &format!("A[{}, {}]", word(&constraint.element), word(&names[k % r])), point)
            })
            .collect(),
        (0..count * r)
            .map(|k| number(format!("kept[{},{}]", equations.multiplier_constraints[k / r].element, names[k % r])))
            .collect(),
    ];
    let right: [Vec<f64>; 2] = [
        found
            .multiplier_constraints
            .iter()
            .map(|constraint| value(&constraint.accelerations.formula.text, point))
            .collect(),
        equations
            .multiplier_constraints
            .iter()
            .map(|constraint| -number(format!("kept[{}]", constraint.element)))
            .collect(),
    ];
    for (k, constraint) in found.multiplier_constraints.iter().enumerate() {
        for (line, motion) in constraint
            .rates
            .iter()
            .map(|line| (line, &sample.speed))
            .chain([(&constraint.accelerations, &sample.acceleration)])
        {
            let direction: f64 = (0..r).map(|i| rows[1][k * r + i] * motion[i]).sum();
            close(value(&line.symbol.text, point), direction, direction.abs(), &line.symbol.text);
        }
    }
    let force = [symbolic_force(found, &names, sample, point), numeric_force(reduced, &names, sample, exact)];
    for (kind, [own, expected]) in [("H", &inertia), ("A", &rows), ("c", &right), ("f", &force)] {
        let size = expected.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        own.iter().zip(expected).for_each(|(own, expected)| close(*own, *expected, size, kind));
    }
    let [own, expected] = [0, 1].map(|k| solved(&inertia[k], &rows[k], &force[k], &right[k]));
    let size = expected.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
    // Where the rows nearly depend on each other, or nearly vanish, both solutions are rounding.
    if size < 1e4 {
        own.iter().zip(&expected).for_each(|(own, expected)| close(*own, *expected, size, "q'' and lambda"));
    }
    assert_eq!(found.constraint_torques.len(), exact.constraint_torques.len());
    for (one, expected) in found.constraint_torques.iter().zip(&exact.constraint_torques) {
        let mut values = point.values.clone();
        let accelerations = found.dependent_coordinates.iter().filter(|one| one.symbol.text.ends_with("''"));
        for one in accelerations {
            values.insert(one.symbol.text.clone(), value(&one.formula.text, point));
        }
        // Without a line of its own an acceleration is the same sum as the speed.
        for one in found.dependent_coordinates.iter().filter(|one| one.symbol.text.ends_with('\'')) {
            let name = format!("{}'", one.symbol.text);
            let as_speeds = |k: usize| format!("{}'", word(&names[k]));
            let mut accelerated = Point { values: point.values.clone(), functions: point.functions };
            accelerated.values.extend((0..r).map(|k| (as_speeds(k), sample.acceleration[k])));
            if !values.contains_key(&name) && !name.ends_with("'''") {
                values.insert(name, value(&one.formula.text, &accelerated));
            }
        }
        let own = value(&one.formula.text, &Point { values, functions: point.functions });
        close(own, *expected, expected.abs() + 10.0, &one.symbol.text);
    }
}

/// `F u − v − D q̇ − s − friction − held`
fn symbolic_force(found: &SymbolicEquations, names: &[String], sample: &Sample, point: &Point<'_>) -> Vec<f64> {
    let names: Vec<String> = names.iter().map(|name| word(name)).collect();
    let row = |i: usize| {
        let damping: f64 = (0..names.len())
            .map(|j| {
                let symbol = format!("D[{}, {}]", names[i.max(j)], names[i.min(j)]);
                of(&found.damping, &symbol, point) * sample.speed[j]
            })
            .sum();
        let passive = [&found.velocity, &found.stiffness, &found.friction, &found.unilateral_forces];
        let passive: f64 = passive.map(|list| of(list, &names[i], point)).iter().sum();
        of(&found.input, &names[i], point) - damping - passive
    };
    (0..names.len()).map(row).collect()
}

fn numeric_force(reduced: &Reduced, names: &[String], sample: &Sample, exact: &Numeric) -> Vec<f64> {
    let number = |name: String| exact.found.get(&name).copied().unwrap_or(0.0);
    let equations = &reduced.equations;
    let row = |name: &String| {
        let frictions = equations
            .set_valued()
            .zip(&sample.frictions)
            .map(|((element, _), torque)| -torque * number(format!("friction[{element},{name}]")));
        let inputs = equations.inputs.iter().zip(&sample.inputs);
        let inputs = inputs.map(|(input, torque)| torque * number(format!("input[{},{name}]", input.element)));
        number(format!("force[{name}]")) + frictions.chain(inputs).sum::<f64>()
    };
    names.iter().map(row).collect()
}

/// A wheel that rolls and is steered through a gear and a bent joint: rows that name what follows, with friction and damping.
const ROLLING: &str = r#"
[model]
coordinates = ["x", "y", "axle", "column"]
[parameters]
r = "$r:0.1:0.5$ m"
m = "$m$ kg"
[mass.x]
mass = "m"
[mass.y]
mass = "m"
damping = "$y.damping$ N s/m"
[shaft.roll]
inertia = "1/2 * m * r^2"
friction = "$roll.friction$ N m"
[shaft.axle]
inertia = "$axle.inertia$ kg m^2"
damping = "$axle.damping$ N m s/rad"
[universal_joint.cardan]
shaft_1 = "axle"
shaft_2 = "roll"
angle = "$cardan.angle:0.1:1$ rad"
[shaft.column]
inertia = "$column.inertia$ kg m^2"
[shaft.heading]
[gear.steer]
shaft_1 = "column"
shaft_2 = "heading"
ratio = $steer.ratio:2:5$
[constraint.rolls-x]
rates = { x = 1, roll = "-r * cos(heading.phi)" }
[constraint.rolls-y]
rates = { y = 1, roll = "-r * sin(heading.phi)" }
[motor.drive]
shaft = "axle"
[motor.turn]
shaft = "column"
"#;

/// Relations of positions with all functions that they may have, beside a spring and a gear.
const LINKAGE: &str = r#"
[parameters]
a = "$a:0.2:0.6$ m"
l = "$l:1:2$ m"
k = $k:0.2:0.8$
n = 1.5
[shaft.crank]
inertia = "$crank.inertia$ kg m^2"
[shaft.rocker]
inertia = "$rocker.inertia$ kg m^2"
[shaft.far]
inertia = "$far.inertia$ kg m^2"
[mass.slide]
mass = "$slide.mass$ kg"
friction = "$slide.friction$ N"
[gear.pair]
shaft_1 = "rocker"
shaft_2 = "far"
ratio = $pair.ratio:2:5$
[constraint.rod]
expression = "slide.s - a * cos(crank.phi) - sqrt(l^2 - a^2 * sin(crank.phi)^2) + l + a"
[constraint.rocks]
expression = "far.phi - k * atan2(sin(crank.phi), 2 + k * cos(crank.phi)) * exp(-k * far.phi / 9) - (1 + k * sin(crank.phi)^2)^n + 1"
[spring_damper.back]
shaft_1 = "far"
stiffness = "$back.stiffness$ N m/rad"
damping = "$back.damping$ N m s/rad"
[motor.drive]
shaft = "crank"
"#;

/// Motions that are prescribed: angles through a bent joint, offsets, speeds and accelerations, of time alone and by signals; a current.
const DRIVEN: &str = r#"
[parameters]
A = "$A$ rad"
w = "$w:1:4$ rad/s"
v = "$v$ m/s"
[signal.wave]
kind = "sine"
amplitude = "0.3 rad"
frequency = "1.5 Hz"
[signal.push]
kind = "pulses"
high = "1 rad/s^2"
period = "0.7 s"
width = "0.2 s"
start = "0.1 s"
[shaft.a]
inertia = "$a.inertia$ kg m^2"
damping = "$a.damping$ N m s/rad"
[shaft.b]
inertia = "$b.inertia$ kg m^2"
friction = "$b.friction$ N m"
[universal_joint.cardan]
shaft_1 = "a"
shaft_2 = "b"
angle = "$cardan.angle:0.1:1$ rad"
[prescribed_motion.drive]
shaft = "a"
angle = "A * sin(w * t)^2 / (2 + cos(w * t))"
[shaft.c]
inertia = "$c.inertia$ kg m^2"
[shaft.d]
inertia = "$d.inertia$ kg m^2"
damping = "$d.damping$ N m s/rad"
[shaft.e]
inertia = "$e.inertia$ kg m^2"
[spring_damper.s]
shaft_1 = "b"
shaft_2 = "c"
stiffness = "$s.stiffness$ N m/rad"
damping = "$s.damping$ N m s/rad"
[constraint.sum]
coefficients = { c = 2, d = -3 }
offset = "wave + A * t / (1 s)"
[prescribed_motion.pushed]
shaft = "e"
reference = "c"
acceleration = "push"
[mass.belt]
mass = "$belt.mass$ kg"
[prescribed_motion.runs]
shaft = "belt"
speed = "v * (1 - exp(-t / (0.5 s)))"
[mass.cart]
mass = "$cart.mass$ kg"
[prescribed_motion.steady]
shaft = "cart"
speed = "v"
[spring_damper.hook]
shaft_1 = "belt"
shaft_2 = "cart"
stiffness = "$hook.stiffness$ N/m"
[motor.more]
shaft = "c"
"#;

/// What holds by modes: beside a gear and a kept row.
const SWITCHED: &str = r#"
[shaft.a]
inertia = "$a.inertia$ kg m^2"
[shaft.b]
inertia = "$b.inertia$ kg m^2"
[shaft.c]
inertia = "$c.inertia$ kg m^2"
[mass.m]
mass = "$m.mass$ kg"
[gear.g]
shaft_1 = "a"
shaft_2 = "b"
ratio = $g.ratio:2:5$
efficiency = 0.9
loss = "0.1 N m + 0.01 * load"
[clutch.c1]
shaft_1 = "b"
shaft_2 = "c"
torque = "3 N m * (1 - exp(-t/(1 s)))"
[one_way_clutch.f]
driven = "c"
[end_stop.wall]
shaft_1 = "m"
lower = "-1 m"
upper = "0.5 m"
restitution = 0.5
[lock.l]
shaft_1 = "a"
shaft_2 = "ground"
engaged = "t / (1 s)"
[constraint.yoke]
expression = "m.s - 0.3 m * sin(c.phi)"
[motor.drive]
shaft = "a"
"#;

/// Currents that are prescribed: their charges are known, or they are kept.
const CURRENTS: &str = r#"
[parameters]
I = "$I$ A"
w = "$w:1:4$ rad/s"
[current_source.one]
from = "ground"
to = "a"
current = "I * sin(w * t)"
[current_source.two]
from = "ground"
to = "b"
current = "I * exp(-(w * t)^2)"
[current_source.three]
from = "ground"
to = "b"
current = "I"
[resistor.R1]
from = "a"
to = "m"
resistance = "$R1.resistance$ Ohm"
[inductor.L2]
from = "m"
to = "b"
inductance = "$L2.inductance$ H"
[inductor.L1]
from = "b"
to = "ground"
inductance = "$L1.inductance$ H"
[capacitor.C1]
from = "a"
to = "ground"
capacitance = "$C1.capacitance$ F"
"#;

#[test]
fn multiplier_rows_in_symbols_are_those_of_a_run_at_random_points() {
    compare(ROLLING, 1000);
    compare(LINKAGE, 1000);
}

#[test]
fn prescribed_motions_in_symbols_are_those_of_a_run_at_random_points() {
    compare(DRIVEN, 1000);
    compare(CURRENTS, 200);
}

#[test]
fn switched_constraints_appear_in_the_symbolic_equations() {
    compare(SWITCHED, 200);
}

/// The unicycle of (4.4), `y' cos(heading) = x' sin(heading)`, in closed form: with v = r roll' the wheel has the acceleration
/// `v' = r (drive - gain roll') / (inertia + m r^2)` and the ground gives `m v'` along the path and `m v heading'` across it.
#[test]
fn eq_4_4_of_the_source_is_the_unicycle() {
    let builtin = kardan::model::BUILTIN.iter().find(|one| one.name == "unicycle").unwrap();
    let found = symbolic(builtin.source);
    let line = |text: &str| {
        found.multiplier_constraints.iter().any(|constraint| {
            let rates = constraint.rates.as_ref().unwrap();
            format!("{} = {}", rates.symbol.text, rates.formula.text) == text
        })
    };
    assert!(
        line("x' - cos(heading)*r*roll' = 0") && line("y' - sin(heading)*r*roll' = 0"),
        "{:?}",
        found.multiplier_constraints
    );
    let multipliers: Vec<&str> =
        found.multiplier_constraints.iter().map(|constraint| constraint.multiplier.text.as_str()).collect();
    assert_eq!(multipliers, ["rolls_x.f", "rolls_y.f"]);
    let (mut random, names) = (Random(4), ["heading", "roll", "x", "y"]);
    for _ in 0..1000 {
        let mut point = Point { values: HashMap::new(), functions: &|_, _| None };
        let mut own = |name: &str, low: f64, high: f64| {
            let number = random.between(low, high);
            point.values.insert(name.to_string(), number);
            number
        };
        let [m, r, inertia, gain] = ["m", "r", "inertia", "gain"].map(|name| own(name, 0.1, 3.0));
        let [heading_inertia, steering] = ["J_heading", "steering_gain"].map(|name| own(name, 0.1, 3.0));
        let [heading, drive, steer] = ["heading", "drive.tau", "steer.tau"].map(|name| own(name, -3.0, 3.0));
        let [turning, rolling] = ["heading'", "roll'"].map(|name| own(name, -3.0, 3.0));
        let (sine, cosine) = heading.sin_cos();
        let speeds = [turning, rolling, r * rolling * cosine, r * rolling * sine];
        // No motion aside: the nonholonomic constraint of the source.
        assert!((speeds[3] * cosine - speeds[2] * sine).abs() < 1e-12);
        point.values.extend(names.iter().zip(speeds).map(|(name, speed)| (format!("{name}'"), speed)));
        point.values.extend(["rolls_x.f", "rolls_y.f"].map(|name| (name.to_string(), 0.0)));
        let entry = |list, letter: &str, i: usize, j: usize| {
            of(list, &format!("{letter}[{}, {}]", names[i.max(j)], names[i.min(j)]), &point)
        };
        let inertias: Vec<f64> = (0..16).map(|k| entry(&found.inertia, "H", k / 4, k % 4)).collect();
        let rows: Vec<f64> = (0..8)
            .map(|k| {
                let constraint = &found.multiplier_constraints[k / 4];
                of(&constraint.row, &format!("A[{}, {}]", constraint.element, names[k % 4]), &point)
            })
            .collect();
        let force: Vec<f64> = (0..4)
            .map(|i| {
                let damping: f64 = (0..4).map(|j| entry(&found.damping, "D", i, j) * speeds[j]).sum();
                of(&found.input, names[i], &point) - damping - of(&found.velocity, names[i], &point)
            })
            .collect();
        let right: Vec<f64> = found
            .multiplier_constraints
            .iter()
            .map(|constraint| value(&constraint.accelerations.formula.text, &point))
            .collect();
        for constraint in &found.multiplier_constraints {
            let line = constraint.rates.as_ref().unwrap();
            close(value(&line.symbol.text, &point), value(&line.formula.text, &point), 1.0, "A q' = b");
        }
        let own = solved(&inertias, &rows, &force, &right);
        let direction = (drive - gain * rolling) * r / (inertia + m * r * r);
        let across = r * rolling * turning;
        let path = [direction * cosine - across * sine, direction * sine + across * cosine];
        let expected =
            [(steer - steering * turning) / heading_inertia, direction / r, path[0], path[1], m * path[0], m * path[1]];
        let size = expected.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        own.iter().zip(expected).for_each(|(own, expected)| close(*own, expected, size, "unicycle"));
    }
}

/// Names and laws of several lines stay within the comments of a LaTeX page, and functions of time are LaTeX, too.
#[test]
fn comments_of_latex_end_with_their_lines() {
    let source = "[model]\nname = \"a\\nb 100%\"\n[shaft.x]\ninertia = \"1 kg m^2\"\n[shaft.y]\n[gear.g]\nshaft_1 = \"x\"\nshaft_2 = \"y\"\nratio = 2\n\
                  [prescribed_motion.p]\nshaft = \"y\"\nreference = \"z\"\nangle = \"\"\"sin(2 * t / (1 s))^2\n * 1 rad / (2 + t / (1 s))\"\"\"\n[shaft.z]\ninertia = \"1 kg m^2\"\n\
                  [torque.w]\nshaft = \"x\"\nlaw = \"\"\"-2 N m *\nsin(x.phi)\"\"\"\n[motor.m]\nshaft = \"x\"\nripple = \"1 N m\"\nripple_order = 3\n";
    let project = Project::open(source);
    let numbers = project.equations(EquationsForm::Latex).unwrap_or_else(|reported| panic!("{reported:?}")).0;
    assert!(numbers.contains(r"\frac{\sin^{2}(2t)}{2 + t}"), "{numbers}");
    assert!(numbers.starts_with("% Model a b 100%: "), "{numbers}");
    assert!(numbers.contains("% Offsets that depend on the time (p) are constant here"), "{numbers}");
    let symbols = project.symbolic_text(EquationsForm::Latex).unwrap().0;
    assert!(symbols.contains("% Input w, as it is written: -2 N m * sin(x.phi)\n"), "{symbols}");
    assert!(
        symbols.contains("% Not in the equations\n% the ripple of m, m.ripple, which acts beside it\n"),
        "{symbols}"
    );
    assert!(displays(&numbers) >= 5 && displays(&symbols) >= 3);
}

/// What is not written is refused by name, and says what to do; what is written in words says so.
#[test]
fn tables_in_multiplier_rows_are_refused_and_text_is_reported() {
    let source = "[table.cam]\npoints = { x = [\"0 rad\", \"1 rad\", \"2 rad\", \"3 rad\"], value = [\"0 m\", \"1 m\", \"3 m\", \"4 m\"] }\nextrapolation = \"linear\"\ninterpolation = \"cubic\"\n\
                  [shaft.crank]\ninertia = \"1 kg m^2\"\n[mass.slide]\nmass = \"1 kg\"\n[constraint.follows]\nexpression = \"slide.s - cam(crank.phi)\"\n";
    let reported = Project::open(source).symbolic_equations().unwrap_err();
    assert_eq!(reported[0].code, "symbolic::table", "{reported:?}");
    assert!(reported[0].message.starts_with("`follows` calls the table `cam`"), "{reported:?}");
    let text = Project::open(filled(DRIVEN, &mut Random(2)).0).symbolic_text(EquationsForm::Text).unwrap().0;
    for line in
        ["  b_pushed: push\n", "  b_sum: wave + A * t / (1 s)\n", "    e'' - c'' = b_pushed\n", "    cart'' = 0\n"]
    {
        assert!(text.contains(line), "{line}{text}");
    }
}

/// Whatever formulas and laws name is told: accelerations of what follows beside its speeds, parameters of laws and of what holds by modes, and what these
/// follow from.
#[test]
fn what_is_named_is_reported() {
    let shafts: String = ["in", "ring", "out"].map(|name| format!("[shaft.{name}]\ninertia = \"1 kg m^2\"\n")).concat();
    let source = shafts
        + "[parameters]\nc = \"2 N m\"\nk = \"2 * c\"\nmost = \"3 * part\"\npart = \"1 N m\"\n[planetary.p]\nsun = \"in\"\nring = \"ring\"\ncarrier = \"out\"\nsun_teeth = 30\n\
           ring_teeth = 90\n[torque.load]\nshaft = \"ring\"\nlaw = \"-k * sin(ring.phi)\"\n[brake.b]\nshaft = \"ring\"\ntorque = \"most\"\n";
    for coordinates in [["in", "ring"], ["in", "out"], ["ring", "out"]] {
        let found = symbolic(&format!("[model]\ncoordinates = {coordinates:?}\n{source}"));
        for name in ["c", "k", "part", "most"] {
            let value =
                found.values.iter().find(|value| value.name == name).unwrap_or_else(|| panic!("{name} has no value"));
            assert_eq!(
                value.value,
                match name {
                    "c" => 2.0,
                    "k" => 4.0,
                    "part" => 1.0,
                    _ => 3.0,
                }
            );
        }
        let torques =
            found.constraint_torques.iter().map(|torque| torque.formula.text.as_str()).collect::<Vec<_>>().concat();
        for name in ["in", "ring", "out"].map(|name| format!("{name}''")) {
            let is_reported = found.dependent_coordinates.iter().any(|one| one.symbol.text == name);
            assert!(
                !torques.contains(&name) || is_reported || coordinates.iter().any(|own| format!("{own}''") == name),
                "{name}"
            );
        }
    }
}
