//! The symbolic reduction: repeats each step of the numerical one.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::derivation::{Definition, Derivation, ResolvedCoordinate, SymbolicMotion, TimeFunction};
use super::elimination::{Assumed, Entry, Line, eliminate, solved};
use super::terms::{DirectionalTerm, Friction, Row, Spring, Terms, ratio};
use super::{Laurent, Letters, Meaning, Symbol};
use crate::equations::{Curve, NamedTerm, Stribeck};
use crate::reduce::{Affine, Reduced, Step};
use kardan_math::num::{Echelon, Rational, Scalar, echelon, rational_to_f64};

impl SymbolicMotion {
    /// Of terms whose values have names, and the explicit form of the same terms; `start` are the angles of the coordinates at which slopes
    /// decide about pivots, `functions` what constraints prescribe, by element. None if a sum would have thousands of terms.
    pub fn new(
        terms: &[NamedTerm],
        meanings: BTreeMap<String, Meaning>,
        functions: &BTreeMap<String, TimeFunction>,
        reduced: &Reduced,
        start: &[f64],
    ) -> Option<Self> {
        let n = reduced.equations.coordinates.len();
        let mut letters = Letters::new(meanings);
        let terms = Terms::new(&reduced.equations.coordinates, terms, &mut letters);
        let none = || vec![Laurent::default(); reduced.degrees_of_freedom()];
        let out = Self {
            velocity: none(),
            stiffness: none(),
            friction: none(),
            input: none(),
            unilateral: none(),
            multiplier_forces: none(),
            ..Self::default()
        };
        let (assumed, resolved, numbers, slopes) =
            (Assumed::default(), vec![ResolvedCoordinate::default(); n], vec![0.0; n], BTreeMap::new());
        let (times, multiplier_rows) = (BTreeMap::new(), Vec::new());
        let mut derivation =
            Derivation { reduced, terms, letters, assumed, resolved, numbers, slopes, times, multiplier_rows, out };
        derivation.prescribe(functions);
        derivation.explicit(start);
        derivation.forces();
        derivation.add_multipliers();
        derivation.out.multipliers = derivation.multipliers();
        (!derivation.assumed.too_large).then(|| derivation.finish())
    }

    /// All sums in it.
    pub fn all(&self) -> impl Iterator<Item = &Laurent> {
        let pairs = self.angles.iter().chain(&self.speeds).chain(&self.accelerations).map(|(_, value)| value);
        let entries = self.inertia.values().chain(self.damping.values());
        let forces = [&self.velocity, &self.stiffness, &self.friction, &self.input, &self.multipliers, &self.divisors];
        let defined = self.definitions.iter().map(|one| &one.value);
        let multiplier_constraints =
            self.multiplier_constraints.iter().flat_map(|one| one.row.values().chain(&one.position).chain(&one.rate));
        let multiplier_constraints = multiplier_constraints
            .chain(
                self.multiplier_constraints.iter().flat_map(|one| one.left.iter().flatten().chain([&one.acceleration])),
            )
            .chain(&self.multiplier_forces)
            .chain(&self.unilateral);
        let by_symbol = self.directions.iter().flat_map(|(_, _, by_symbol)| by_symbol);
        defined
            .chain(multiplier_constraints)
            .chain(by_symbol)
            .chain(pairs)
            .chain(entries)
            .chain(forces.into_iter().flatten())
            .chain(&self.zeros)
    }
}

impl Derivation<'_> {
    /// Angles, basis and bias of all coordinates.
    fn explicit(&mut self, start: &[f64]) {
        for element in self.reduced.equations.moving.keys() {
            self.prescribed(element, 0);
        }
        for (k, &coordinate) in self.reduced.coordinates.iter().enumerate() {
            let angle = self.letters.of(Symbol::Position(coordinate));
            let basis = BTreeMap::from([(k, Laurent::number(Rational::ONE))]);
            self.resolved[coordinate] = ResolvedCoordinate { basis, angle, ..ResolvedCoordinate::default() };
            self.numbers[coordinate] = start.get(k).copied().unwrap_or(0.0);
        }
        let (matrix, n) = (self.reduced.equations.constraint_matrix(), self.resolved.len());
        let form = |resolved: &[usize]| {
            let unknown = (0..n).filter(|coordinate| !resolved.contains(coordinate));
            echelon(&matrix, &unknown.chain(resolved.iter().copied()).collect::<Vec<_>>())
        };
        let mut resolved = self.reduced.coordinates.clone();
        let mut e = form(&resolved);
        let reduced = self.reduced;
        for Step { shaft, argument, curve } in &reduced.steps {
            let start = self.number(argument);
            let Some(curve) = curve else {
                let found = self.affine(&e, *shaft, &resolved);
                self.numbers[*shaft] = start;
                self.note(*shaft, found);
                continue;
            };
            let found = self.transmission(*shaft, argument, &e, &resolved);
            let (number, from, inverted) = found.expect("a step by a curve is one of a transmission");
            let found =
                if resolved.contains(&from) { self.resolved[from].clone() } else { self.affine(&e, from, &resolved) };
            self.numbers[*shaft] = curve.value(start);
            let slope = self.curve(number, *shaft, curve, found);
            let entry = Entry { symbol: slope, number: ratio(curve.derivatives(start).0) };
            self.slopes.insert(number, (inverted, entry));
            resolved.push(*shaft);
            e = form(&resolved);
        }
    }

    fn number(&self, affine: &Affine) -> f64 {
        let terms = affine.terms.iter().map(|(k, x)| rational_to_f64(x) * self.numbers[*k]);
        affine.constant + terms.sum::<f64>()
    }

    /// The transmission that determines a coordinate: its number, the source, and whether from its driven end.
    fn transmission(
        &self,
        shaft: usize,
        argument: &Affine,
        e: &Echelon,
        resolved: &[usize],
    ) -> Option<(usize, usize, bool)> {
        let transmissions = self.reduced.equations.transmissions.iter().enumerate();
        let mut open = transmissions.filter(|(k, _)| !self.slopes.contains_key(k)).filter_map(|(k, t)| {
            match (t.driven == shaft, t.driving == shaft) {
                (true, _) => Some((k, t.driving, false)),
                (_, true) => Some((k, t.driven, true)),
                _ => None,
            }
        });
        open.find(|(_, from, _)| {
            let row = e.pivots.iter().position(|pivot| pivot == from);
            match row.filter(|_| !resolved.contains(from)) {
                None => argument.terms.len() == 1 && argument.terms[0].0 == *from,
                Some(row) => argument.terms.iter().all(|(k, x)| e.form[(row, *k)] == -x),
            }
        })
    }

    /// The expression of a coordinate that follows from known ones by linear constraints.
    fn affine(&mut self, e: &Echelon, target: usize, resolved: &[usize]) -> ResolvedCoordinate {
        let Some(row) = e.pivots.iter().position(|pivot| *pivot == target) else {
            return self.resolved[target].clone();
        };
        let constraints = self.terms.constraints.iter().enumerate();
        let mut lines: Vec<Line> = constraints
            .filter(|(k, _)| !Scalar::is_zero(&e.transform[(row, *k)]))
            .map(|(_, constraint)| Line { entries: constraint.entries.clone(), right: constraint.offset.clone() })
            .collect();
        let may = |k: usize| k != target && !resolved.contains(&k);
        eliminate(&mut lines, &may, &mut self.letters, &mut self.assumed);
        let contains_target =
            |line: &&Line| line.entries.get(&target).is_some_and(|entry| !Scalar::is_zero(&entry.number));
        let Some(line) = lines.iter().find(contains_target) else { return ResolvedCoordinate::default() };
        let (constant, shares) = solved(line, target, &|k| resolved.contains(&k), &mut self.letters, &mut self.assumed);
        let drift = self.prescribed_rate(&constant);
        let bias = self.prescribed_rate(&drift);
        let mut out = ResolvedCoordinate { angle: constant, drift, bias, ..ResolvedCoordinate::default() };
        for (k, share) in shares {
            let of = self.resolved[k].clone();
            out.drift = out.drift.plus(&self.assumed.product(&share, &of.drift));
            out.angle = out.angle.plus(&self.assumed.product(&share, &of.angle));
            out.bias = out.bias.plus(&self.assumed.product(&share, &of.bias));
            for (column, entry) in of.basis {
                let sum = out.basis.entry(column).or_default();
                *sum = sum.plus(&self.assumed.product(&share, &entry));
            }
        }
        out.basis.retain(|_, entry| !entry.is_zero());
        out
    }

    /// A coordinate that follows from its argument by a curve; returns its slope.
    fn curve(&mut self, number: usize, shaft: usize, curve: &Arc<dyn Curve>, argument: ResolvedCoordinate) -> Laurent {
        let element = self.reduced.equations.transmissions[number].element.clone();
        let [value, slope, curvature] = match curve.formulas() {
            Some(formulas) => {
                let mut names: BTreeMap<&str, Laurent> = BTreeMap::from([("x", argument.angle.clone())]);
                for (name, value) in &formulas.values {
                    names.insert(name, self.letters.exact(value));
                }
                for (name, text) in &formulas.letters {
                    let value = self.letters.formula(text, &names);
                    let letter = self.letters.letter(Symbol::Of(name, element.clone()));
                    self.out.definitions.push(Definition { letter, value });
                    names.insert(name, Laurent::letter(letter));
                }
                formulas.curve.each_ref().map(|text| self.letters.formula(text, &names))
            }
            None => {
                [0, 1, 2].map(|order| self.letters.of(Symbol::Curve(element.clone(), order, argument.angle.clone())))
            }
        };
        let speed = self.rate(&argument.basis, Symbol::Speed).plus(&argument.drift);
        let drift = self.assumed.product(&slope, &argument.drift);
        let bent = self.assumed.product(&curvature, &speed);
        let carried = self.assumed.product(&slope, &argument.bias);
        let bias = self.assumed.product(&bent, &speed).plus(&carried);
        let basis = argument.basis.iter().map(|(k, entry)| (*k, self.assumed.product(&slope, entry))).collect();
        let angle = self.letters.of(Symbol::Position(shaft));
        self.note(shaft, ResolvedCoordinate { basis, drift, bias, angle });
        // Its angle appears by name.
        self.out.angles.last_mut().expect("noted just now").1 = value;
        slope
    }

    fn note(&mut self, shaft: usize, resolved: ResolvedCoordinate) {
        self.out.angles.push((shaft, resolved.angle.clone()));
        let speed = self.rate(&resolved.basis, Symbol::Speed).plus(&resolved.drift);
        self.out.speeds.push((shaft, speed));
        let acceleration = self.rate(&resolved.basis, Symbol::Acceleration).plus(&resolved.bias);
        self.out.accelerations.push((shaft, acceleration));
        self.resolved[shaft] = resolved;
    }

    /// The rate of a row over the reduced coordinates.
    fn rate(&mut self, basis: &BTreeMap<usize, Laurent>, of: fn(usize) -> Symbol) -> Laurent {
        basis.iter().fold(Laurent::default(), |sum, (k, entry)| {
            let rate = self.letters.of(of(self.reduced.coordinates[*k]));
            sum.plus(&entry.times(&rate))
        })
    }

    /// `aᵀK`
    fn reduced_row(&self, row: &Row) -> BTreeMap<usize, Laurent> {
        let mut out: BTreeMap<usize, Laurent> = BTreeMap::new();
        for (shaft, c) in row {
            for (column, entry) in &self.resolved[*shaft].basis {
                let sum = out.entry(*column).or_default();
                *sum = sum.plus(&c.times(entry));
            }
        }
        out.retain(|_, entry| !entry.is_zero());
        out
    }

    /// A row over one quantity of each coordinate.
    fn over(&mut self, row: &Row, symbol: impl Fn(usize) -> Symbol) -> Laurent {
        row.iter().fold(Laurent::default(), |sum, (shaft, c)| sum.plus(&c.times(&self.letters.of(symbol(*shaft)))))
    }

    /// Inertia and forces.
    fn forces(&mut self) {
        let zero = Laurent::default;
        for DirectionalTerm { row, value, .. } in self.terms.inertias.clone() {
            let own = self.reduced_row(&row);
            let bias = row.iter().fold(zero(), |sum, (k, c)| sum.plus(&c.times(&self.resolved[*k].bias)));
            add_square(&mut self.out.inertia, &own, &value, &mut self.assumed);
            add_force(&mut self.out.velocity, &own, &value.times(&bias), &mut self.assumed);
        }
        for DirectionalTerm { row, value, .. } in self.terms.dampers.clone() {
            let own = self.reduced_row(&row);
            let drift = row.iter().fold(zero(), |sum, (k, c)| sum.plus(&c.times(&self.resolved[*k].drift)));
            add_square(&mut self.out.damping, &own, &value, &mut self.assumed);
            add_force(&mut self.out.velocity, &own, &value.times(&drift), &mut self.assumed);
        }
        for DirectionalTerm { row, value: Spring { stiffness, rest }, .. } in self.terms.springs.clone() {
            let own = self.reduced_row(&row);
            let angle = row.iter().fold(zero(), |sum, (k, c)| sum.plus(&c.times(&self.resolved[*k].angle)));
            add_force(&mut self.out.stiffness, &own, &stiffness.times(&angle.minus(&rest)), &mut self.assumed);
        }
        for k in 0..self.terms.frictions.len() {
            let (own, torque) = (self.reduced_row(&self.terms.frictions[k].row), self.friction(k));
            add_force(&mut self.out.friction, &own, &torque, &mut self.assumed);
        }
        for k in 0..self.terms.inputs.len() {
            let (own, input) = (self.reduced_row(&self.terms.inputs[k].row), self.letters.of(Symbol::Input(k)));
            add_force(&mut self.out.input, &own, &input, &mut self.assumed);
        }
        for DirectionalTerm { element, row, value: is_loss } in self.terms.unilaterals.clone() {
            let reduced_row = [Symbol::Position, Symbol::Speed].map(|symbol| self.over(&row, symbol));
            let (own, unilateral) =
                (self.reduced_row(&row), self.letters.of(Symbol::Unilateral(element.clone(), is_loss)));
            add_force(&mut self.out.unilateral, &own, &unilateral, &mut self.assumed);
            self.out.directions.push((element, is_loss, reduced_row));
        }
    }

    /// The torque of a friction: its magnitude in motion times its sign.
    fn friction(&mut self, number: usize) -> Laurent {
        let DirectionalTerm { element, row, value: Friction { torque, stribeck } } =
            self.terms.frictions[number].clone();
        let speed = self.over(&row, Symbol::Speed);
        let sense = self.letters.of(Symbol::Sign(speed.clone()));
        let Some(Stribeck { breakaway, speed: width }) = stribeck else { return torque.times(&sense) };
        let share = self.letters.divide(&speed, &width);
        let exponent = share.times(&share).scaled(&Rational::from(-1));
        let falling = self.letters.of(Symbol::Call("exp", vec![exponent]));
        let value = torque.plus(&breakaway.minus(&torque).times(&falling));
        let letter = self.letters.letter(Symbol::Sliding(element, number));
        if self.out.definitions.iter().all(|one| one.letter != letter) {
            self.out.definitions.push(Definition { letter, value });
        }
        Laurent::letter(letter).times(&sense)
    }

    /// `Jᵀλ = H q̈ + D q̇ + S q + friction − F u` in the coordinates that follow, over motions of all coordinates.
    fn multipliers(&mut self) -> Vec<Laurent> {
        let mut forces = vec![Laurent::default(); self.resolved.len()];
        let mut add = |row: &Row, torque: &Laurent| {
            row.iter().for_each(|(shaft, c)| forces[*shaft] = forces[*shaft].plus(&c.times(torque)));
        };
        for DirectionalTerm { row, value, .. } in self.terms.inertias.clone() {
            let acceleration = self.over(&row, Symbol::Acceleration);
            add(&row, &value.times(&acceleration));
        }
        for DirectionalTerm { row, value, .. } in self.terms.dampers.clone() {
            let speed = self.over(&row, Symbol::Speed);
            add(&row, &value.times(&speed));
        }
        for DirectionalTerm { row, value, .. } in self.terms.springs.clone() {
            let angle = self.over(&row, Symbol::Position);
            add(&row, &value.stiffness.times(&angle.minus(&value.rest)));
        }
        for k in 0..self.terms.frictions.len() {
            let torque = self.friction(k);
            add(&self.terms.frictions[k].row, &torque);
        }
        for k in 0..self.terms.inputs.len() {
            let input = self.letters.of(Symbol::Input(k)).scaled(&Rational::from(-1));
            add(&self.terms.inputs[k].row, &input);
        }
        for DirectionalTerm { element, row, value: is_loss } in self.terms.unilaterals.clone() {
            let unilateral = self.letters.of(Symbol::Unilateral(element, is_loss));
            add(&row, &unilateral);
        }
        for (k, row) in self.multiplier_rows.clone().iter().enumerate() {
            let multiplier = self.letters.of(Symbol::Multiplier(k)).scaled(&Rational::from(-1));
            add(row, &multiplier);
        }
        let equations = &self.reduced.equations;
        let linear = self.terms.constraints.len();
        let count = linear + equations.transmissions.len();
        let mut columns: Vec<BTreeMap<usize, Entry>> = vec![BTreeMap::new(); self.resolved.len()];
        for (k, constraint) in self.terms.constraints.iter().enumerate() {
            constraint.entries.iter().for_each(|(shaft, entry)| drop(columns[*shaft].insert(k, entry.clone())));
        }
        for (k, transmission) in equations.transmissions.iter().enumerate() {
            let one = Entry { symbol: Laurent::number(Rational::ONE), number: Rational::ONE };
            let Some((inverted, slope)) = self.slopes.get(&k).cloned() else { continue };
            let slope = match inverted {
                true => Entry {
                    symbol: self.letters.divide(&one.symbol, &slope.symbol),
                    number: one.number.over(&slope.number),
                },
                false => slope,
            };
            let minus = Rational::from(-1);
            let slope = Entry { symbol: slope.symbol.scaled(&minus), number: &slope.number * &minus };
            columns[transmission.driven].insert(linear + k, one);
            columns[transmission.driving].insert(linear + k, slope);
        }
        let dependents = self.reduced.dependents();
        let mut lines: Vec<Line> = dependents
            .into_iter()
            .map(|shaft| Line { entries: std::mem::take(&mut columns[shaft]), right: forces[shaft].clone() })
            .collect();
        let mut unnamed = Assumed::default();
        let used = eliminate(&mut lines, &|_| true, &mut self.letters, &mut unnamed);
        let mut out = vec![Laurent::default(); count];
        for (unknown, line) in used.into_iter().rev() {
            let (constant, shares) = solved(&line, unknown, &|_| true, &mut self.letters, &mut unnamed);
            let carried = shares.iter().fold(constant, |sum, (k, share)| sum.plus(&unnamed.product(share, &out[*k])));
            out[unknown] = self.letters.cancelled(&carried);
        }
        self.assumed.too_large |= unnamed.too_large;
        self.assumed.zeros.extend(unnamed.zeros);
        self.assumed.divisors.extend(unnamed.divisors);
        out
    }

    fn finish(self) -> SymbolicMotion {
        let Derivation { letters, assumed, resolved, mut out, .. } = self;
        // The acceleration of a dependent coordinate is listed if it has more terms than its speed implies, or if a formula uses it.
        let accelerations = std::mem::take(&mut out.accelerations);
        let used = letters.used_in(out.all());
        let is_used = |shaft: usize| {
            used.iter().any(|letter| matches!(letters.symbol(*letter), Symbol::Acceleration(k) if *k == shaft))
        };
        out.accelerations = accelerations
            .into_iter()
            .filter(|(shaft, _)| !resolved[*shaft].bias.is_zero() || is_used(*shaft))
            .collect();
        let each = |values: &mut Vec<Laurent>| values.iter_mut().for_each(|value| *value = letters.cancelled(value));
        let forces = [&mut out.velocity, &mut out.stiffness, &mut out.friction, &mut out.input];
        for values in forces.into_iter().chain([&mut out.unilateral, &mut out.multiplier_forces]) {
            each(values);
        }
        for pairs in [&mut out.angles, &mut out.speeds, &mut out.accelerations] {
            pairs.iter_mut().for_each(|(_, value)| *value = letters.cancelled(value));
        }
        for entries in [&mut out.inertia, &mut out.damping] {
            entries.values_mut().for_each(|value| *value = letters.cancelled(value));
            entries.retain(|_, value| !value.is_zero());
        }
        SymbolicMotion { letters, divisors: assumed.divisors, zeros: assumed.zeros, ..out }
    }
}

fn add_square(
    to: &mut BTreeMap<(usize, usize), Laurent>,
    row: &BTreeMap<usize, Laurent>,
    value: &Laurent,
    assumed: &mut Assumed,
) {
    for (i, first) in row {
        for (j, second) in row.range(..=i) {
            let product = assumed.product(first, second);
            let product = assumed.product(&product, value);
            let sum = to.entry((*i, *j)).or_default();
            *sum = sum.plus(&product);
        }
    }
}

fn add_force(to: &mut [Laurent], row: &BTreeMap<usize, Laurent>, torque: &Laurent, assumed: &mut Assumed) {
    for (k, entry) in row {
        to[*k] = to[*k].plus(&assumed.product(entry, torque));
    }
}
