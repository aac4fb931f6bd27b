//! Equations in symbols: what is printed, evaluated at random points, is what the equations in numbers are.

use std::collections::HashMap;

use crate::common::multipliers::Multipliers;
use kardan::project::Project;
use kardan::reduce::{Dynamics, Reduced, Work};
use kardan::results::{SymbolicEquations, SymbolicFormula};
use kardan::study::EquationsForm;

/// Values of names, and functions of one argument by name.
pub(super) struct Point<'a> {
    pub(super) values: HashMap<String, f64>,
    pub(super) functions: &'a dyn Fn(&str, f64) -> Option<f64>,
}

/// A reader of printed formulas of its own: it knows `+ - * / ^`, parentheses, names with marks of rates, and functions.
struct Reader<'a> {
    remaining: &'a [u8],
    point: &'a Point<'a>,
}

impl Reader<'_> {
    fn next(&mut self) -> u8 {
        while let [b' ', remaining @ ..] = self.remaining {
            self.remaining = remaining;
        }
        self.remaining.first().copied().unwrap_or(0)
    }

    fn take(&mut self, sign: u8) -> bool {
        let found = self.next() == sign;
        if found {
            self.remaining = &self.remaining[1..];
        }
        found
    }

    fn sum(&mut self) -> f64 {
        let mut value = if self.take(b'-') { -self.product() } else { self.product() };
        loop {
            match self.next() {
                b'+' if self.take(b'+') => value += self.product(),
                b'-' if self.take(b'-') => value -= self.product(),
                _ => return value,
            }
        }
    }

    fn product(&mut self) -> f64 {
        let mut value = self.power();
        loop {
            match self.next() {
                b'*' if self.take(b'*') => value *= self.power(),
                b'/' if self.take(b'/') => value /= self.power(),
                _ => return value,
            }
        }
    }

    fn power(&mut self) -> f64 {
        let base = self.atom();
        if self.take(b'^') { base.powf(self.atom()) } else { base }
    }

    fn atom(&mut self) -> f64 {
        if self.take(b'(') {
            let value = self.sum();
            assert!(self.take(b')'), "a parenthesis is open");
            return value;
        }
        self.next();
        let is_name = |c: &u8| c.is_ascii_alphanumeric() || b"_.'".contains(c);
        let length = self.remaining.iter().take_while(|c| is_name(c)).count();
        let name = std::str::from_utf8(&self.remaining[..length]).unwrap().to_string();
        self.remaining = &self.remaining[length..];
        if let Ok(number) = name.parse() {
            return number;
        }
        if !self.take(b'(') {
            return *self.point.values.get(&name).unwrap_or_else(|| panic!("`{name}` has no value"));
        }
        let mut arguments = vec![self.sum()];
        while self.take(b',') {
            arguments.push(self.sum());
        }
        assert!(self.take(b')'), "the arguments of `{name}` do not end");
        match (name.as_str(), arguments.as_slice()) {
            ("sin", [x]) => x.sin(),
            ("cos", [x]) => x.cos(),
            ("exp", [x]) => x.exp(),
            ("sqrt", [x]) => x.sqrt(),
            ("sgn", [x]) => x.signum(),
            ("atan2", [y, x]) => y.atan2(*x),
            (_, [x]) => (self.point.functions)(&name, *x).unwrap_or_else(|| panic!("no function `{name}`")),
            _ => panic!("no function `{name}`"),
        }
    }
}

pub(super) fn value(text: &str, point: &Point<'_>) -> f64 {
    let mut reader = Reader { remaining: text.as_bytes(), point };
    let found = reader.sum();
    assert_eq!(reader.next(), 0, "something is left of `{text}`");
    found
}

/// The value of the formula for something; zero if there is none.
pub(super) fn of(list: &[SymbolicFormula], symbol: &str, point: &Point<'_>) -> f64 {
    list.iter().find(|one| one.symbol.text == symbol).map_or(0.0, |one| value(&one.formula.text, point))
}

/// Numbers that look random, always the same.
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((self.0 >> 11) as f64 / (1u64 << 53) as f64)
    }
}

/// A model with numbers in place of `$name:low:high$`, and these by name.
pub(super) fn filled(model: &str, random: &mut Random) -> (String, HashMap<String, f64>) {
    let (mut text, mut values) = (String::new(), HashMap::new());
    for (k, part) in model.split('$').enumerate() {
        if k % 2 == 0 {
            text += part;
            continue;
        }
        let parts: Vec<&str> = part.split(':').collect();
        let [low, high] = [1, 2].map(|k| parts.get(k).map_or([0.0, 0.4, 1.8][k], |end| end.parse().unwrap()));
        // Short decimals, so that the file holds the very number.
        let number = (random.between(low, high) * 1e4).round() / 1e4;
        text += &number.to_string();
        values.insert(parts[0].to_string(), number);
    }
    (text, values)
}

pub(super) fn symbolic(text: &str) -> SymbolicEquations {
    let project = Project::open(text);
    project.symbolic_equations().unwrap_or_else(|diagnostics| panic!("{diagnostics:?}")).0
}

/// Letters by the numbers of the values that they stand for, then those that stand for formulas.
pub(super) fn letters(found: &SymbolicEquations, numbers: &HashMap<String, f64>, point: &mut Point<'_>) {
    for one in &found.values {
        let number = numbers.get(&one.name).copied().unwrap_or(one.value);
        point.values.insert(one.symbol.text.clone(), number);
    }
    for one in found.intermediate_symbols.iter().filter(|one| !one.symbol.text.starts_with("T_")) {
        let number = value(&one.formula.text, point);
        point.values.insert(one.symbol.text.clone(), number);
    }
}

pub(super) fn close(found: f64, expected: f64, size: f64, what: &str) {
    assert!((found - expected).abs() <= 1e-9 * (1.0 + size), "{what}: {found} instead of {expected}");
}

/// Evaluates all that is printed of a model at random values, angles and speeds, against the equations in numbers of the model with these
/// values, whose plan knows nothing of letters. Rounding alone parts them: 1e-9 of one plus the largest entry.
fn compare(model: &str, points: usize) {
    let mut random = Random(20);
    let found = symbolic(&filled(model, &mut random).0);
    for _ in 0..points {
        let (text, numbers) = filled(model, &mut random);
        let project = Project::open(text.as_str());
        let prepared = project.prepared();
        let reduced = &prepared.variants[0].reduced;
        let (dynamics, mut work) = Dynamics::new(reduced);
        let n = reduced.degrees_of_freedom();
        let q: Vec<f64> = (0..n).map(|_| random.between(-2.0, 2.0)).collect();
        let rates: Vec<f64> = (0..n).map(|_| random.between(-2.0, 2.0)).collect();
        dynamics.update(&q, &rates, &mut work);
        let functions = |name: &str, x: f64| {
            let order = name.matches('\'').count();
            let element = name.trim_end_matches('\'').strip_prefix("gamma_")?;
            let curve = &reduced.equations.transmissions.iter().find(|t| t.element == element)?.curve;
            Some([curve.value(x), curve.derivatives(x).0, curve.derivatives(x).1][order])
        };
        let mut point = Point { values: HashMap::new(), functions: &functions };
        for (k, &shaft) in reduced.coordinates.iter().enumerate() {
            let name = reduced.equations.coordinates[shaft].replace(['-', '.'], "_");
            point.values.insert(name.clone(), q[k]);
            point.values.insert(format!("{name}'"), rates[k]);
        }
        letters(&found, &numbers, &mut point);
        let accelerations: Vec<f64> = (0..n).map(|_| random.between(-2.0, 2.0)).collect();
        kinematics(&found, reduced, &work, &accelerations, &mut point);
        for one in found.intermediate_symbols.iter().filter(|one| one.symbol.text.starts_with("T_")) {
            let torque = value(&one.formula.text, &point);
            point.values.insert(one.symbol.text.clone(), torque);
        }
        forces(&found, reduced, &dynamics, &work, &mut point, &mut random);
        constraint_torques(&found, reduced, &dynamics, &work, &accelerations, &point);
    }
}

fn coordinate(reduced: &Reduced, k: usize) -> String {
    reduced.equations.coordinates[k].replace(['-', '.'], "_")
}

/// Angles, speeds and accelerations of what follows.
fn kinematics(found: &SymbolicEquations, reduced: &Reduced, work: &Work, accelerations: &[f64], point: &mut Point<'_>) {
    for (k, &shaft) in reduced.coordinates.iter().enumerate() {
        point.values.insert(format!("{}''", coordinate(reduced, shaft)), accelerations[k]);
    }
    let n = reduced.degrees_of_freedom();
    for shaft in reduced.dependents() {
        let name = coordinate(reduced, shaft);
        let row = &work.kinematics.row(shaft)[..n];
        let acceleration: f64 =
            row.iter().zip(accelerations).map(|(k, a)| k * a).sum::<f64>() + work.kinematics.bias[shaft];
        let exact = [work.kinematics.angles[shaft], work.kinematics.speeds[shaft], acceleration];
        for (order, expected) in exact.into_iter().enumerate() {
            let symbol = format!("{name}{}", "'".repeat(order));
            let own = found.dependent_coordinates.iter().find(|one| one.symbol.text == symbol);
            // Without a line of its own an acceleration is the same sum as the speed.
            if let Some(own) = own {
                close(value(&own.formula.text, point), expected, expected.abs(), &symbol);
            } else {
                assert!(order == 2 && work.kinematics.bias[shaft].abs() < 1e-12, "{symbol} is missing");
            }
            point.values.insert(symbol, expected);
        }
    }
}

fn forces(
    found: &SymbolicEquations,
    reduced: &Reduced,
    dynamics: &Dynamics,
    work: &Work,
    point: &mut Point<'_>,
    random: &mut Random,
) {
    let n = reduced.degrees_of_freedom();
    let names: Vec<String> = reduced.coordinates.iter().map(|&shaft| coordinate(reduced, shaft)).collect();
    for (k, input) in reduced.equations.inputs.iter().enumerate() {
        let torque = random.between(-2.0, 2.0);
        for word in ["", ".tau", ".f", ".v"] {
            point.values.insert(format!("{}{word}", input.element.replace(['-', '.'], "_")), torque);
        }
        point.values.insert(format!("input {k}"), torque);
    }
    let largest = work.inertia.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    for i in 0..n {
        for j in 0..=i {
            let symbol = format!("[{}, {}]", names[i], names[j]);
            close(of(&found.inertia, &format!("H{symbol}"), point), work.inertia[n * i + j], largest, &symbol);
        }
        let damping: f64 = (0..n)
            .map(|j| {
                let (high, low) = (i.max(j), i.min(j));
                let entry = of(&found.damping, &format!("D[{}, {}]", names[high], names[low]), point);
                entry * point.values[&format!("{}'", names[j])]
            })
            .sum();
        let [velocity, stiffness] = [&found.velocity, &found.stiffness].map(|list| of(list, &names[i], point));
        let size = damping.abs() + velocity.abs() + stiffness.abs();
        close(damping + velocity + stiffness, -work.passive[i], size, &format!("forces of {}", names[i]));
        let sliding = |k: usize| friction(reduced, dynamics, work, k) * work.friction_rows[n * k + i];
        let expected: f64 = (0..dynamics.friction_count()).map(sliding).sum();
        close(of(&found.friction, &names[i], point), expected, 10.0, &format!("friction of {}", names[i]));
        let expected: f64 = (0..reduced.equations.inputs.len())
            .map(|k| point.values[&format!("input {k}")] * work.input_rows[n * k + i])
            .sum();
        close(of(&found.input, &names[i], point), expected, 10.0, &format!("inputs of {}", names[i]));
    }
}

/// The torque of a friction in motion.
fn friction(reduced: &Reduced, dynamics: &Dynamics, work: &Work, k: usize) -> f64 {
    let speed = dynamics.friction_speed(k, work);
    let law = &reduced.equations.frictions[k].value;
    let least = law.torque.to_f64();
    let falling = law.stribeck.as_ref().map_or(0.0, |one| {
        let share = speed / one.speed.to_f64();
        (one.breakaway.to_f64() - least) * (-share * share).exp()
    });
    (least + falling) * speed.signum()
}

/// From the equations of the shafts: `Jᵀλ = H q̈ + D q̇ + S q + friction − F u` (4.18).
fn constraint_torques(
    found: &SymbolicEquations,
    reduced: &Reduced,
    dynamics: &Dynamics,
    work: &Work,
    accelerations: &[f64],
    point: &Point<'_>,
) {
    let (equations, n) = (&reduced.equations, reduced.degrees_of_freedom());
    let mut force = vec![0.0; equations.coordinates.len()];
    let shaft_accelerations: Vec<f64> = (0..force.len())
        .map(|shaft| {
            let row = &work.kinematics.row(shaft)[..n];
            row.iter().zip(accelerations).map(|(k, a)| k * a).sum::<f64>() + work.kinematics.bias[shaft]
        })
        .collect();
    let mut add = |row: &[(usize, f64)], of: &[f64], coefficient: f64, rest: f64| {
        let direction: f64 = row.iter().map(|(k, x)| x * of[*k]).sum::<f64>() - rest;
        row.iter().for_each(|(k, x)| force[*k] += x * direction * coefficient);
    };
    equations.inertias.iter().for_each(|one| add(&one.row_f64(), &shaft_accelerations, one.value.to_f64(), 0.0));
    equations.dampers.iter().for_each(|one| add(&one.row_f64(), &work.kinematics.speeds, one.value.to_f64(), 0.0));
    for one in &equations.springs {
        add(&one.row_f64(), &work.kinematics.angles, one.value.stiffness.to_f64(), one.value.rest.to_f64());
    }
    for (k, one) in equations.frictions.iter().enumerate() {
        let torque = friction(reduced, dynamics, work, k);
        one.row_f64().iter().for_each(|(shaft, x)| force[*shaft] += x * torque);
    }
    for (k, one) in equations.inputs.iter().enumerate() {
        let torque = point.values[&format!("input {k}")];
        one.row_f64().iter().for_each(|(shaft, x)| force[*shaft] -= x * torque);
    }
    let mut multipliers = Multipliers::new(reduced);
    let mut expected = vec![0.0; multipliers.elements.len()];
    multipliers.solve(&work.kinematics, &force, &mut expected);
    assert_eq!(found.constraint_torques.len(), expected.len());
    let largest = expected.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    for (element, expected) in multipliers.elements.iter().zip(expected) {
        let own = found.constraint_torques.iter().find(|one| one.symbol.text.rsplit_once('.').unwrap().0 == element);
        close(value(&own.unwrap().formula.text, point), expected, largest, element);
    }
}

/// The steering system of section 6.3: every value of Table 6.4 is free, and so is the bend angle.
const STEERING: &str = r#"
[model]
coordinates = ["rk", "fs", "cj"]
[parameters]
beta = "$beta:0.05:1.2$ rad"
[shaft.wg]
inertia = "$wg.inertia$ kg m^2"
damping = "$wg.damping$ N m s/rad"
friction = "$wg.friction$ N m"
[shaft.cs]
inertia = "$cs.inertia$ kg m^2"
damping = "$cs.damping$ N m s/rad"
friction = "$cs.friction$ N m"
[shaft.fs]
inertia = "$fs.inertia$ kg m^2"
damping = "$fs.damping$ N m s/rad"
friction = "$fs.friction$ N m"
[shaft.cj]
inertia = "$cj.inertia$ kg m^2"
damping = "$cj.damping$ N m s/rad"
friction = "$cj.friction$ N m"
[shaft.rk]
inertia = "$rk.inertia$ kg m^2"
damping = "$rk.damping$ N m s/rad"
friction = "$rk.friction$ N m"
[harmonic_drive.hd]
wave_generator = "wg"
circular_spline = "cs"
flexspline = "fs"
ratio = $hd.ratio:1.5:9$
[universal_joint.cardan]
shaft_1 = "cj"
shaft_2 = "cs"
angle = "beta"
[spring_damper.sp]
shaft_1 = "rk"
shaft_2 = "cj"
stiffness = "$sp.stiffness$ N m/rad"
damping = "$sp.damping$ N m s/rad"
[motor.T_fs]
shaft = "fs"
[motor.T_wg]
shaft = "wg"
[motor.T_rk]
shaft = "rk"
"#;

/// What the steering system has not: a planetary gear, masses, a measured rack, a soft gear, friction that falls, expressions, phases,
/// springs that are relaxed elsewhere, names with hyphens, coordinates of which others are whole fractions.
const MIXED: &str = r#"
[model]
coordinates = ["ring", "arm", "out", "table"]
[parameters]
heavy = "$heavy$ kg"
r = "$r$ m"
k = "$k$ N m/rad"
tilt_1 = "$tilt_1:0.1:0.9$ rad"
[shaft.sun]
inertia = "$sun.inertia$ kg m^2"
damping = "$sun.damping$ N m s/rad"
[shaft.ring]
inertia = "heavy * r^2 / 2 + 0.3 kg m^2 * sin(tilt_1)"
friction = "$ring.friction:0.1:0.5$ N m"
breakaway = "$ring.breakaway:0.6:1$ N m"
stribeck_speed = "$ring.stribeck_speed:1:3$ rad/s"
[shaft.arm]
inertia = "$arm.inertia$ kg m^2"
[shaft.side-shaft]
inertia = "$side-shaft.inertia$ kg m^2"
damping = "$side-shaft.damping$ N m s/rad"
[shaft.out]
inertia = "$out.inertia$ kg m^2"
[mass.bar]
mass = "heavy"
damping = "$bar.damping$ N s/m"
[mass.table]
mass = "3 * heavy"
[mass.rack]
mass = "$rack.mass$ kg"
[planetary.split]
sun = "sun"
ring = "ring"
carrier = "arm"
sun_teeth = $split.sun_teeth:10:20$
ring_teeth = $split.ring_teeth:30:50$
[universal_joint.bend]
shaft_1 = "side-shaft"
shaft_2 = "ring"
angle_1 = "tilt_1"
angle_2 = "$bend.angle_2:0.1:0.9$ rad"
phase = "$bend.phase$ rad"
[spring_damper.twist]
shaft_1 = "side-shaft"
shaft_2 = "out"
stiffness = "k"
rest = "$twist.rest$ rad"
damping = "$twist.damping$ N m s/rad"
[pulley.rope]
shaft = "out"
mass = "bar"
radius = "r"
offset = "$rope.offset$ m"
[spring_damper.pad]
shaft_1 = "bar"
shaft_2 = "table"
stiffness = "$pad.stiffness$ N/m"
friction = "$pad.friction$ N"
[rack_and_pinion.teeth]
pinion = "arm"
rack = "rack"
[[rack_and_pinion.teeth.curve]]
angle = "-3 rad"
position = "-40 mm"
[[rack_and_pinion.teeth.curve]]
angle = "0 rad"
position = "1 mm"
[[rack_and_pinion.teeth.curve]]
angle = "3 rad"
position = "55 mm"
[motor.drive]
shaft = "sun"
[motor.push]
shaft = "rack"
[disturbance.load]
shaft = "bar"
"#;

/// A soft gear, and a circuit beside: nodes, a transformer, a capacitor that is charged at the start.
const SOFT: &str = r#"
[shaft.wg]
inertia = "$wg.inertia$ kg m^2"
[shaft.cs]
inertia = "$cs.inertia$ kg m^2"
[shaft.fs]
inertia = "$fs.inertia$ kg m^2"
[harmonic_drive.hd]
wave_generator = "wg"
circular_spline = "cs"
flexspline = "fs"
ratio = $hd.ratio:2:9$
offset = "$hd.offset$ rad"
stiffness = "$hd.stiffness$ N m/rad"
damping = "$hd.damping$ N m s/rad"
[motor.drive]
shaft = "wg"
[voltage_source.supply]
from = "ground"
to = "a"
[inductor.L1]
from = "a"
to = "b"
inductance = "$L1.inductance$ H"
[transformer.step]
from_1 = "b"
to_1 = "ground"
from_2 = "c"
to_2 = "ground"
ratio = $step.ratio:1.5:4$
[resistor.R1]
from = "c"
to = "d"
resistance = "$R1.resistance$ Ohm"
[capacitor.C1]
from = "d"
to = "ground"
capacitance = "$C1.capacitance$ F"
initial_voltage = "$C1.initial_voltage$ V"
"#;

#[test]
fn printed_formulas_are_the_equations_in_numbers_at_random_points() {
    compare(STEERING, 1000);
    compare(MIXED, 1000);
    compare(SOFT, 200);
}

/// (6.117)-(6.120) by hand, with the Coulomb torque c_cs where (6.120c) prints a damping, at 1000 random points.
#[test]
fn eq_6_117_to_6_120_of_the_source() {
    let mut random = Random(6);
    let found = symbolic(&filled(STEERING, &mut random).0);
    for _ in 0..1000 {
        let (_, numbers) = filled(STEERING, &mut random);
        let mut point = Point { values: HashMap::new(), functions: &|_, _| None };
        let mut motion = |name: &str| {
            let number = random.between(-2.0, 2.0);
            point.values.insert(name.to_string(), number);
            number
        };
        let [rk, _fs, cj] = ["rk", "fs", "cj"].map(&mut motion);
        let [wrk, wfs, wcj] = ["rk'", "fs'", "cj'"].map(&mut motion);
        let [tfs, twg, trk] = ["T_fs.tau", "T_wg.tau", "T_rk.tau"].map(&mut motion);
        letters(&found, &numbers, &mut point);
        let number = |name: &str| numbers[name];
        let [jwg, jcs, jfs, jcj, jrk] = ["wg", "cs", "fs", "cj", "rk"].map(|name| number(&format!("{name}.inertia")));
        let [dwg, dcs, dfs, dcj, drk] = ["wg", "cs", "fs", "cj", "rk"].map(|name| number(&format!("{name}.damping")));
        let [cwg, ccs, cfs, ccj, crk] = ["wg", "cs", "fs", "cj", "rk"].map(|name| number(&format!("{name}.friction")));
        let [i, ssp, dsp] = ["hd.ratio", "sp.stiffness", "sp.damping"].map(number);
        let c = number("beta").cos();
        let r = cj.sin().powi(2) + c * c * cj.cos().powi(2); // (6.119)
        let j = i + 1.0;
        for (symbol, expected) in [
            ("H[rk, rk]", jrk),
            ("H[fs, rk]", 0.0),
            ("H[cj, rk]", 0.0),
            ("H[fs, fs]", jfs + i * i * jwg),
            ("H[cj, fs]", -c / r * i * j * jwg),
            ("H[cj, cj]", jcj + c * c / (r * r) * (jcs + j * j * jwg)),
        ] {
            close(of(&found.inertia, symbol, &point), expected, expected.abs(), symbol);
        }
        // (6.118)
        for (symbol, expected) in [("rk", trk), ("fs", tfs - i * twg), ("cj", c / r * j * twg)] {
            close(of(&found.input, symbol, &point), expected, expected.abs(), "(6.118)");
        }
        // Speeds of what follows (6.108), for the senses of friction.
        for (name, speed) in [("wg'", -i * wfs + c / r * j * wcj), ("cs'", c / r * wcj)] {
            close(of(&found.dependent_coordinates, name, &point), speed, speed.abs(), name);
            point.values.insert(name.into(), speed);
        }
        let slope = c * (c * c - 1.0) * (2.0 * cj).sin();
        let sense = (-i * wfs + c / r * j * wcj).signum();
        let printed = [
            drk * wrk + crk * wrk.signum() + dsp * (wrk - wcj) + ssp * (rk - cj),
            -slope / (r * r) * i * j * jwg * wcj * wcj - c / r * i * j * dwg * wcj
                + (dfs + i * i * dwg) * wfs
                + cfs * wfs.signum()
                - i * cwg * sense,
            c * slope / (r * r * r) * (jcs + j * j * jwg) * wcj * wcj
                + (dcj + c * c / (r * r) * (dcs + j * j * dwg)) * wcj
                - c / r * i * j * dwg * wfs
                + (ccj + c / r * ccs) * wcj.signum()
                + c / r * j * cwg * sense
                + dsp * (wcj - wrk)
                + ssp * (cj - rk),
        ];
        let names = ["rk", "fs", "cj"];
        for (k, expected) in printed.into_iter().enumerate() {
            let parts = [&found.velocity, &found.stiffness, &found.friction].map(|list| of(list, names[k], &point));
            let damping = (0..3).map(|l| {
                let symbol = format!("D[{}, {}]", names[k.max(l)], names[k.min(l)]);
                of(&found.damping, &symbol, &point) * [wrk, wfs, wcj][l]
            });
            let sum = parts.iter().sum::<f64>() + damping.sum::<f64>();
            let size = parts.iter().map(|x| x.abs()).sum::<f64>() + expected.abs();
            close(sum, expected, size, "(6.120)");
        }
    }
}

/// A person's own way of writing: these are the very lines of (6.117)-(6.120) but for the order of factors.
#[test]
fn the_steering_system_is_written_as_in_the_source() {
    let found = symbolic(&filled(STEERING, &mut Random(1)).0);
    let lines = |list: &[SymbolicFormula]| -> Vec<String> {
        list.iter().map(|one| format!("{} = {}", one.symbol.text, one.formula.text)).collect()
    };
    assert_eq!(
        lines(&found.intermediate_symbols),
        ["C_cardan = cos(beta)", "R_cardan = sin(cj)^2 + C_cardan^2*cos(cj)^2"],
    );
    assert_eq!(
        lines(&found.inertia),
        [
            "H[rk, rk] = J_rk",
            "H[fs, fs] = J_fs + i_hd^2*J_wg",
            "H[cj, fs] = -i_hd*(i_hd + 1)*C_cardan*J_wg/R_cardan",
            "H[cj, cj] = J_cj + C_cardan^2*(J_cs + (i_hd + 1)^2*J_wg)/R_cardan^2",
        ],
    );
    assert_eq!(
        lines(&found.velocity),
        [
            "fs = -i_hd*(i_hd + 1)*C_cardan*sin(2*cj)*(C_cardan^2 - 1)*J_wg*cj'^2/R_cardan^2",
            "cj = C_cardan^2*sin(2*cj)*(C_cardan^2 - 1)*(J_cs + (i_hd + 1)^2*J_wg)*cj'^2/R_cardan^3",
        ],
    );
    assert_eq!(lines(&found.stiffness), ["rk = s_sp*(rk - cj)", "cj = s_sp*(cj - rk)"]);
    assert_eq!(
        lines(&found.input),
        ["rk = T_rk.tau", "fs = T_fs.tau - i_hd*T_wg.tau", "cj = (i_hd + 1)*C_cardan*T_wg.tau/R_cardan"],
    );
}

/// A small model as it is printed.
#[test]
fn a_page_of_text() {
    let model = r#"
[model]
name = "hoist"
coordinates = ["drum"]
[parameters]
m = "20 kg"
r = "0.1 m"
idle = "0 N m s/rad"
[shaft.drum]
inertia = "0.2 kg m^2"
damping = "idle"
[mass.cabin]
mass = "m"
[pulley.rope]
shaft = "drum"
mass = "cabin"
radius = "r"
[motor.drive]
shaft = "drum"
"#;
    let project = Project::open(model);
    let (text, _) = project.symbolic_text(EquationsForm::Text).unwrap();
    assert_eq!(
        text,
        "\
Model hoist: shafts 1, masses 1, degrees of freedom 1
Coordinates q: drum (angles in rad, torques in N m, positions in m, forces in N; numbers in SI units)
H q'' + velocity-dependent + D q' + stiffness + friction = F u

Values
  J_drum  drum.inertia  0.2 kg m^2
  m       m             20 kg
  r       r             0.1 m

Dependent coordinates
  cabin   = r*drum
  cabin'  = r*drum'
  cabin'' = r*drum''

Inertia H, symmetric
  H[drum, drum] = J_drum + m*r^2

Input map F u
  drum = drive.tau

Constraint torques (multipliers), from the motion of all coordinates
  rope.f = m*cabin''

Not in the equations, as their value is zero: idle
"
    );
    let refused = project.symbolic_text(EquationsForm::Plan).unwrap_err();
    assert_eq!(refused[0].message, "a plan needs numbers, not symbols");
    let broken = Project::open("[shaft.axle]\ninertia = \"2 kg\"\n");
    assert_eq!(broken.symbolic_equations().unwrap_err()[0].code, "unit::dimension");
}

/// LaTeX holds together: braces and parentheses close in their order, and nothing that means something to it stands alone in a name.
#[test]
fn latex_is_balanced_and_escaped() {
    for model in [STEERING, MIXED, SOFT] {
        let (text, _) = filled(model, &mut Random(3));
        let project = Project::open(text.as_str());
        let (page, _) = project.symbolic_text(EquationsForm::Latex).unwrap();
        let (mut open, mut begun) = (Vec::new(), Vec::new());
        let body: String = page.lines().filter(|line| !line.starts_with('%')).collect::<Vec<_>>().join("\n");
        for (at, sign) in body.char_indices() {
            let before = &body[..at];
            match sign {
                '{' => open.push('{'),
                '}' => assert_eq!(open.pop(), Some('{'), "{before}"),
                '(' if before.ends_with(r"\left") => open.push('('),
                ')' if before.ends_with(r"\right") => assert_eq!(open.pop(), Some('('), "{before}"),
                '#' | '%' | '$' | '~' => panic!("{sign} behind {before}"),
                '\\' if body[at..].starts_with(r"\begin{") => begun.push(body[at + 7..].split('}').next().unwrap()),
                '\\' if body[at..].starts_with(r"\end{") => {
                    assert_eq!(begun.pop(), Some(body[at + 5..].split('}').next().unwrap()));
                }
                _ => {}
            }
        }
        assert!(open.is_empty() && begun.is_empty());
        for part in body.split(r"\mathrm{").skip(1) {
            let name = part.split('}').next().unwrap();
            assert!(!name.replace(r"\_", "").replace(r"\text{-", "").contains(['_', '-']), "{name}");
        }
        assert!(!body.contains("^{2}^") && !body.contains("}}^{2}^"));
    }
}

/// Every built-in model has equations in symbols, and no formula that nobody would read; and its LaTeX, with numbers and with symbols, is some that
/// a reader of its own takes, in lines that fit on a page.
#[test]
fn built_in_models_in_symbols() {
    for builtin in kardan::model::BUILTIN {
        let project = crate::common::project(builtin.source);
        let (found, _) =
            project.symbolic_equations().unwrap_or_else(|reported| panic!("{}: {reported:?}", builtin.name));
        let lists = [&found.inertia, &found.velocity, &found.damping, &found.stiffness, &found.friction, &found.input];
        for one in lists.into_iter().flatten() {
            assert!(one.formula.text.len() < 300, "{}: {} = {}", builtin.name, one.symbol.text, one.formula.text);
        }
        assert!(!found.inertia.is_empty(), "{}", builtin.name);
        let (symbols, _) = project.symbolic_text(EquationsForm::Latex).unwrap();
        let (numbers, _) = project.equations(EquationsForm::Latex).unwrap();
        assert!(displays(&symbols) >= 2 && displays(&numbers) >= 5, "{}", builtin.name);
    }
}

/// Reads a document of formulas; how many there are. Outside of them are comments alone, and a counter for wide matrices.
pub(super) fn displays(page: &str) -> usize {
    let (mut block, mut found) = (String::new(), 0);
    let mut most_columns = 10;
    for line in page.lines() {
        if block.is_empty() && (line.is_empty() || line.starts_with('%')) {
            continue;
        }
        if let Some(suffix) = line.strip_prefix(r"\setcounter{MaxMatrixCols}{") {
            most_columns = suffix.trim_end_matches('}').parse().unwrap();
            continue;
        }
        assert!(!line.trim().is_empty(), "an empty line ends a formula: {block}");
        block += line;
        block += "\n";
        if !line.ends_with(r"\]") && !line.starts_with(r"\end{align*}") {
            continue;
        }
        let whole = std::mem::take(&mut block);
        let formula =
            whole.trim().strip_prefix(r"\[").map_or(whole.trim(), |suffix| suffix.strip_suffix(r"\]").unwrap());
        let storage = pulldown_latex::Storage::new();
        for event in pulldown_latex::Parser::new(formula, &storage) {
            assert!(event.is_ok(), "{}: {formula}", event.err().map(|error| error.to_string()).unwrap_or_default());
        }
        for row in formula.split(r"\\") {
            assert!(row.matches('&').count() < most_columns, "too many columns: {row}");
        }
        found += 1;
    }
    assert!(block.is_empty(), "a formula does not end: {block}");
    found
}

/// Twelve drives in a row would need thousands of terms: that is told, and nothing hangs.
#[test]
fn too_many_terms_are_reported() {
    let mut model = "[shaft.s0]\ninertia = \"1 kg m^2\"\n".to_string();
    for k in 1..40 {
        model += &format!(
            "[shaft.s{k}]\ninertia = \"1 kg m^2\"\n[planetary.p{k}]\nsun = \"s{}\"\nring = \"s{k}\"\ncarrier = \"h{k}\"\n\
             sun_teeth = 20\nring_teeth = 50\n[shaft.h{k}]\n[constraint.c{k}]\ncoefficients = {{ h{k} = 7, s{} = -2 }}\n",
            k - 1,
            k - 1
        );
    }
    let project = Project::open(model.as_str());
    let diagnostics = project.symbolic_equations().unwrap_err();
    assert_eq!(diagnostics[0].code, "symbolic::size", "{diagnostics:?}");
    let gear = |name: &str| format!("[gear.{name}]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = 2\n");
    let shafts = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n";
    let parallel = format!("{shafts}{}{}", gear("g"), gear("h"));
    let diagnostics = Project::open(&parallel).symbolic_equations().unwrap_err();
    assert!(
        diagnostics[0].code == "symbolic::redundant" && diagnostics[0].message.contains("`g`, `h`"),
        "{diagnostics:?}"
    );
    let spring = |name: &str, [one, two]: [&str; 2]| {
        format!("[spring_damper.{name}]\nshaft_1 = \"{one}\"\nshaft_2 = \"{two}\"\nstiffness = \"2 N m/rad\"\n")
    };
    let series = format!("{shafts}[shaft.c]\n{}{}", spring("s", ["a", "c"]), spring("t", ["c", "b"]));
    let diagnostics = Project::open(&series).symbolic_equations().unwrap_err();
    assert_eq!(diagnostics[0].code, "symbolic::massless", "{diagnostics:?}");
}
