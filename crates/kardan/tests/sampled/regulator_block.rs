//! The block `Regulator` of `kardan-rt` with its `Governor` and its `Bounds`: its equations against loops written out entry by
//! entry, its promises (finite commands within the bounds, whatever is read) against numbers of every kind, and saturation
//! against paths that are computed by hand.
//!
//! Tolerances: the loops and the block add the same some twenty products of numbers around 1 in another order, so that 1e-12
//! is asked. Paths computed by hand consist of dyadic fractions and are asked for exactly.

use std::fmt::Debug;

use crate::common::{Dice, close};
use kardan_rt::{Bounds, Gain, Governor, Health, Real, Regulator, RegulatorState};
use proptest::prelude::*;

/// What the tests need of `f32` and `f64` beyond what the blocks need.
trait Number: Real + Debug {
    /// A number whose square overflows.
    const HUGE: Self;
    /// A number that is not normal.
    const SUBNORMAL: Self;
    fn of(x: f64) -> Self;
}

impl Number for f32 {
    const HUGE: Self = 1e38;
    const SUBNORMAL: Self = 1e-45;
    fn of(x: f64) -> Self {
        x as f32
    }
}

impl Number for f64 {
    const HUGE: Self = 1e300;
    const SUBNORMAL: Self = 5e-324;
    fn of(x: f64) -> Self {
        x
    }
}

/// A number in ±1 that `f32` holds exactly.
fn unit(dice: &mut Dice) -> f64 {
    dice.between(-(1 << 20), 1 << 20) as f64 / f64::from(1 << 20)
}

fn list<T: Number>(dice: &mut Dice, length: usize, scale: f64) -> Vec<T> {
    (0..length).map(|_| T::of(scale * unit(dice))).collect()
}

/// A number of any kind; one in `rarity` is not an ordinary one.
fn anything<T: Number>(dice: &mut Dice, rarity: usize) -> T {
    if dice.below(rarity) > 0 {
        return T::of(10.0 * unit(dice));
    }
    match dice.below(7) {
        0 => T::of(f64::NAN),
        1 => T::of(f64::INFINITY),
        2 => T::of(f64::NEG_INFINITY),
        3 => T::HUGE,
        4 => -T::HUGE,
        5 => T::ZERO,
        _ => T::SUBNORMAL,
    }
}

/// A matrix, row by row.
#[derive(Debug, Clone)]
struct Table<T> {
    entries: Vec<T>,
    columns: usize,
}

impl<T: Number> Table<T> {
    fn random(dice: &mut Dice, rows: usize, columns: usize, scale: f64) -> Self {
        Self { entries: list(dice, rows * columns, scale), columns }
    }

    fn of(columns: usize, entries: &[f64]) -> Self {
        Self { entries: entries.iter().map(|x| T::of(*x)).collect(), columns }
    }

    fn gain(&self) -> Gain<'_, T> {
        Gain::new(&self.entries, self.columns.max(1)).expect("whole rows")
    }

    /// An entry; 0 where the matrix has none.
    fn at(&self, i: usize, j: usize) -> T {
        let inside = j < self.columns && i * self.columns + j < self.entries.len();
        if inside { self.entries[i * self.columns + j] } else { T::ZERO }
    }

    /// The first rows and columns only.
    fn part(&self, rows: usize, columns: usize) -> Self {
        let rows = rows.min(self.entries.len().checked_div(self.columns).unwrap_or(0));
        let columns = columns.min(self.columns);
        let entries = (0..rows).flat_map(|i| (0..columns).map(move |j| self.at(i, j))).collect();
        Self { entries, columns }
    }
}

/// The tables of a governor.
#[derive(Debug, Clone)]
struct Governing<T> {
    on_state: Table<T>,
    on_model: Table<T>,
    on_references: Table<T>,
    bounds: Vec<T>,
}

impl<T: Number> Governing<T> {
    fn random(dice: &mut Dice, predictions: usize, [n, k, r]: [usize; 3], scale: f64) -> Self {
        Self {
            on_state: Table::random(dice, predictions, n, scale),
            on_model: Table::random(dice, predictions, k, scale),
            on_references: Table::random(dice, predictions, r, scale),
            bounds: list::<T>(dice, predictions, 2.0).into_iter().map(Real::abs).collect(),
        }
    }

    fn block(&self) -> Governor<'_, T> {
        Governor {
            on_state: self.on_state.gain(),
            on_model: self.on_model.gain(),
            on_references: self.on_references.gain(),
            bounds: &self.bounds,
        }
    }
}

/// States, states of the reference model, references, readings, commands.
type Sizes = [usize; 5];

/// The tables of a regulator: A, B, C, M, Aξ, Bξ, K.
#[derive(Debug, Clone)]
struct Numbers<T> {
    tables: [Table<T>; 7],
    bounds: Vec<Bounds<T>>,
    governing: Option<Governing<T>>,
}

impl<T: Number> Numbers<T> {
    /// Without bounds and governor.
    fn random(dice: &mut Dice, sizes: Sizes, scale: f64) -> Self {
        let [n, k, r, p, m] = sizes;
        let shapes = [(n, n), (n, m), (p, n), (n, p), (k, k), (k, r), (m, n + k + r)];
        let tables = shapes.map(|(rows, columns)| Table::random(dice, rows, columns, scale));
        Self { tables, bounds: Vec::new(), governing: None }
    }

    fn block(&self) -> Regulator<'_, T> {
        let [prediction, input, output, correction, model, model_input, feedback] =
            self.tables.each_ref().map(Table::gain);
        Regulator {
            prediction,
            input,
            output,
            correction,
            model,
            model_input,
            feedback,
            bounds: &self.bounds,
            governor: self.governing.as_ref().map(Governing::block),
        }
    }
}

/// What a regulator remembers, owned.
#[derive(Debug, Clone, PartialEq)]
struct State<T> {
    estimate: Vec<T>,
    model: Vec<T>,
    readings: Vec<T>,
    references: Vec<T>,
    commands: Vec<T>,
    work: Vec<T>,
}

impl<T: Number> State<T> {
    fn zeros([n, k, r, p, m]: Sizes) -> Self {
        let zeros = |count| vec![T::ZERO; count];
        Self {
            estimate: zeros(n),
            model: zeros(k),
            readings: zeros(p),
            references: zeros(r),
            commands: zeros(m),
            // What the work memory holds at first must not matter.
            work: vec![T::of(f64::NAN); Regulator::<T>::work(n, k, r, p)],
        }
    }

    fn step(&mut self, numbers: &Numbers<T>, readings: &[T], references: &[T]) -> Health {
        let state = RegulatorState {
            estimate: &mut self.estimate,
            model: &mut self.model,
            readings: &mut self.readings,
            references: &mut self.references,
            commands: &mut self.commands,
            work: &mut self.work,
        };
        numbers.block().step(readings, references, state)
    }

    /// Everything but the work memory.
    fn persistent(&self) -> [&[T]; 5] {
        [&self.estimate, &self.model, &self.readings, &self.references, &self.commands]
    }
}

/// The equations of the block's documentation, entry by entry: estimate, state of the reference model and commands after one
/// step without bounds and governor.
fn by_hand(numbers: &Numbers<f64>, state: &State<f64>, readings: &[f64], references: &[f64]) -> [Vec<f64>; 3] {
    let [a, b, c, correction, model, model_input, feedback] = &numbers.tables;
    let (x, xi, r) = (&state.estimate, &state.model, references);
    let (n, k, p, m) = (x.len(), xi.len(), readings.len(), state.commands.len());
    let mut corrected = x.clone();
    for i in 0..n {
        for j in 0..p {
            let mut expected = 0.0;
            for l in 0..n {
                expected += c.at(j, l) * x[l];
            }
            corrected[i] += correction.at(i, j) * (readings[j] - expected);
        }
    }
    let mut commands = vec![0.0; m];
    for i in 0..m {
        for j in 0..n {
            commands[i] -= feedback.at(i, j) * corrected[j];
        }
        for j in 0..k {
            commands[i] -= feedback.at(i, n + j) * xi[j];
        }
        for j in 0..r.len() {
            commands[i] -= feedback.at(i, n + k + j) * r[j];
        }
    }
    let mut next_model = vec![0.0; k];
    for i in 0..k {
        for j in 0..k {
            next_model[i] += model.at(i, j) * xi[j];
        }
        for j in 0..r.len() {
            next_model[i] += model_input.at(i, j) * r[j];
        }
    }
    let mut estimate = vec![0.0; n];
    for i in 0..n {
        for j in 0..n {
            estimate[i] += a.at(i, j) * corrected[j];
        }
        for j in 0..m {
            estimate[i] += b.at(i, j) * commands[j];
        }
    }
    [estimate, next_model, commands]
}

/// Asserts agreement of a step with the loops, relative to numbers above 1.
#[track_caller]
fn agree(state: &State<f64>, expected: &[Vec<f64>; 3], what: &str) {
    let found = [&state.estimate, &state.model, &state.commands];
    for ((found, expected), part) in found.into_iter().zip(expected).zip(["estimate", "model", "commands"]) {
        assert_eq!(found.len(), expected.len(), "{what}: {part}");
        for (k, (x, y)) in found.iter().zip(expected).enumerate() {
            close(*x, *y, 1e-12, &format!("{what}: {part} [{k}]"));
        }
    }
}

/// A memory in the middle of its work.
fn in_use(dice: &mut Dice, sizes: Sizes) -> State<f64> {
    let [n, k, r, p, m] = sizes;
    State {
        estimate: list(dice, n, 1.0),
        model: list(dice, k, 1.0),
        readings: list(dice, p, 1.0),
        references: list(dice, r, 1.0),
        commands: list(dice, m, 1.0),
        ..State::zeros(sizes)
    }
}

/// All sizes that occur, none of a kind included.
fn all_sizes() -> Vec<Sizes> {
    let mut all = Vec::new();
    for n in 0..=6 {
        for k in 0..=4 {
            for r in 0..=2 {
                for p in 0..=3 {
                    all.extend([[n, k, r, p, 1], [n, k, r, p, 2]]);
                }
            }
        }
    }
    all
}

/// The equations of the documentation for every size; the readings and references are remembered, and nothing was wrong.
#[test]
fn one_step_is_its_equations() {
    let mut dice = Dice(1);
    for sizes in all_sizes() {
        let [_, _, r, p, _] = sizes;
        let numbers = Numbers::random(&mut dice, sizes, 1.0);
        let mut state = in_use(&mut dice, sizes);
        for _ in 0..3 {
            let (readings, references) = (list(&mut dice, p, 1.0), list(&mut dice, r, 1.0));
            let expected = by_hand(&numbers, &state, &readings, &references);
            let health = state.step(&numbers, &readings, &references);
            assert_eq!(health, Health::default(), "{sizes:?}");
            agree(&state, &expected, &format!("{sizes:?}"));
            assert_eq!((&state.readings, &state.references), (&readings, &references), "{sizes:?}");
        }
    }
}

/// The same step in both precisions, to what `f32` resolves.
#[test]
fn single_precision_is_close_to_double() {
    let mut dice = Dice(2);
    for sizes in all_sizes() {
        let [_, _, r, p, _] = sizes;
        let wide = Numbers::<f64>::random(&mut dice, sizes, 0.5);
        let narrow_list = |list: &[f64]| list.iter().map(|x| *x as f32).collect::<Vec<f32>>();
        let narrow = Numbers::<f32> {
            tables: wide.tables.each_ref().map(|table| Table::of(table.columns, &table.entries)),
            bounds: Vec::new(),
            governing: None,
        };
        let mut state = in_use(&mut dice, sizes);
        let mut narrow_state = State::<f32> {
            estimate: narrow_list(&state.estimate),
            model: narrow_list(&state.model),
            ..State::zeros(sizes)
        };
        let (readings, references) = (list(&mut dice, p, 1.0), list(&mut dice, r, 1.0));
        assert_eq!(state.step(&wide, &readings, &references), Health::default());
        let health = narrow_state.step(&narrow, &narrow_list(&readings), &narrow_list(&references));
        assert_eq!(health, Health::default());
        for (wide, narrow) in state.persistent().iter().zip(narrow_state.persistent()) {
            assert_eq!(wide.len(), narrow.len());
            for (wide, narrow) in wide.iter().zip(narrow) {
                close(f64::from(*narrow), *wide, 1e-5, &format!("{sizes:?}"));
            }
        }
    }
}

/// Asserts that a torque is within the bounds, and reached from the one before within the change that is allowed.
#[track_caller]
fn allowed<T: Number>(bounds: &Bounds<T>, before: T, after: T) {
    if let Some(torque) = bounds.torque {
        assert!(-torque <= after && after <= torque, "{after:?} with {bounds:?}");
    }
    if let Some(change) = bounds.change {
        assert!(before - change <= after && after <= before + change, "{before:?} to {after:?} with {bounds:?}");
    }
}

/// A chain of wishes, each from the torque before: within the bounds, the wish itself if it is, otherwise the limit that it
/// goes beyond.
fn follow_requests<T: Number>(bounds: Bounds<T>, start: T, requests: &[T]) {
    let mut torque = start;
    for &request in requests {
        let next = bounds.nearest(request, torque);
        allowed(&bounds, torque, next);
        let (mut low, mut high) = (T::of(f64::NEG_INFINITY), T::of(f64::INFINITY));
        if let Some(limit) = bounds.torque {
            (low, high) = (-limit, limit);
        }
        if let Some(change) = bounds.change {
            low = if torque - change > low { torque - change } else { low };
            high = if torque + change < high { torque + change } else { high };
        }
        let expected = match request {
            request if request > high => high,
            request if request < low => low,
            // What is no number, and an infinite wish that nothing limits, leave the torque as it was.
            request if request <= high && request.is_finite() => request,
            _ => torque,
        };
        assert!(next == expected, "{request:?} from {torque:?} with {bounds:?}: {next:?}, not {expected:?}");
        assert!(next.is_finite(), "{next:?} with {bounds:?}");
        torque = next;
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn bounds_hold_in_double_precision(
        torque in prop::option::of(prop_oneof![4 => 0.0..100.0, 1 => Just(0.0), 1 => Just(5e-324), 1 => 0.0..1e308]),
        change in prop::option::of(prop_oneof![4 => 0.0..30.0, 1 => Just(0.0), 1 => Just(5e-324), 1 => 0.0..1e308]),
        start in -1.0..=1.0,
        requests in prop::collection::vec(prop_oneof![2 => -200.0..200.0, 1 => prop::num::f64::ANY], 1..20),
    ) {
        follow_requests::<f64>(Bounds { torque, change }, start * torque.unwrap_or(50.0), &requests);
    }

    #[test]
    fn bounds_hold_in_single_precision(
        torque in prop::option::of(prop_oneof![4 => 0.0f32..100.0, 1 => Just(0.0), 1 => Just(1e-45), 1 => 0.0f32..1e38]),
        change in prop::option::of(prop_oneof![4 => 0.0f32..30.0, 1 => Just(0.0), 1 => Just(1e-45), 1 => 0.0f32..1e38]),
        start in -1.0f32..=1.0,
        requests in prop::collection::vec(prop_oneof![2 => -200.0f32..200.0, 1 => prop::num::f32::ANY], 1..20),
    ) {
        follow_requests::<f32>(Bounds { torque, change }, start * torque.unwrap_or(50.0), &requests);
    }
}

/// What happened in a run with numbers of every kind.
#[derive(Debug, Default)]
struct Counts {
    steps: usize,
    invalid_readings: usize,
    invalid_references: usize,
    bounded: usize,
    governed: usize,
    frozen: usize,
    well: usize,
}

fn random_bounds<T: Number>(dice: &mut Dice, count: usize) -> Vec<Bounds<T>> {
    let mut limit = |scale: f64| (dice.below(4) > 0).then(|| T::of(scale * unit(dice)).abs());
    (0..count).map(|_| Bounds { torque: limit(5.0), change: limit(1.0) }).collect()
}

/// Takes over what is finite, as the block must; how many are not, or are missing.
fn take_over<T: Number>(values: &[T], state: &mut [T]) -> usize {
    let mut invalid_count = 0;
    for k in 0..state.len() {
        if k < values.len() && values[k].is_finite() {
            state[k] = values[k];
        } else {
            invalid_count += 1;
        }
    }
    invalid_count
}

/// Random regulators, stable and unstable, fed with numbers of every kind.
fn storm<T: Number>(seed: u64) -> Counts {
    let (mut dice, mut counts) = (Dice(seed), Counts::default());
    for case in 0..400 {
        let sizes = [dice.below(7), dice.below(5), dice.below(3), dice.below(4), 1 + dice.below(2)];
        let [n, k, r, p, m] = sizes;
        let scale = [0.1, 0.3, 1.0, 10.0, 1e20][case % 5];
        let mut numbers = Numbers::<T>::random(&mut dice, sizes, scale);
        numbers.bounds = random_bounds(&mut dice, m);
        if dice.below(2) == 0 {
            let predictions = dice.below(5);
            numbers.governing = Some(Governing::random(&mut dice, predictions, [n, k, r], scale));
        }
        let rarity = [1, 3, 20][case % 3];
        let mut state = State::<T>::zeros(sizes);
        for _ in 0..60 {
            // Sometimes fewer are given than there should be, sometimes more.
            let random_length = |dice: &mut Dice, count: usize| match dice.below(8) {
                0 => dice.below(count + 1),
                1 => count + 1,
                _ => count,
            };
            let readings: Vec<T> = (0..random_length(&mut dice, p)).map(|_| anything(&mut dice, rarity)).collect();
            let references: Vec<T> = (0..random_length(&mut dice, r)).map(|_| anything(&mut dice, rarity)).collect();
            let before = state.clone();
            let health = state.step(&numbers, &readings, &references);

            for ((bounds, before), after) in numbers.bounds.iter().zip(&before.commands).zip(&state.commands) {
                allowed(bounds, *before, *after);
            }
            for part in state.persistent() {
                assert!(part.iter().all(|x| x.is_finite()), "{state:?}");
            }
            let (mut expected_readings, mut expected_references) = (before.readings.clone(), before.references.clone());
            assert_eq!(health.invalid_readings, take_over(&readings, &mut expected_readings), "{readings:?}");
            assert_eq!(health.invalid_references, take_over(&references, &mut expected_references), "{references:?}");
            assert_eq!(state.readings, expected_readings, "{readings:?}");
            assert!(health.commands_bounded <= m);
            if numbers.governing.is_none() {
                assert_eq!(state.references, expected_references, "{references:?}");
                assert!(!health.governed);
            }
            counts.steps += 1;
            counts.invalid_readings += health.invalid_readings;
            counts.invalid_references += health.invalid_references;
            counts.bounded += health.commands_bounded;
            counts.governed += usize::from(health.governed);
            counts.frozen += usize::from(health.estimate_frozen);
            counts.well += usize::from(health == Health::default());
        }
    }
    counts
}

/// Whatever is read: no panic, all that is remembered is finite, commands are within the bounds, and the counts are right.
#[test]
fn nothing_that_is_read_does_harm() {
    for counts in [storm::<f64>(3), storm::<f32>(4)] {
        assert_eq!(counts.steps, 24_000);
        let happened = [
            counts.invalid_readings,
            counts.invalid_references,
            counts.bounded,
            counts.governed,
            counts.frozen,
            counts.well,
        ];
        assert!(happened.iter().all(|count| *count > 500), "all that can happen does: {counts:?}");
    }
}

/// A reading or reference that fails is the last good one, for as long as it fails: bit for bit the same as when that one is
/// given.
#[test]
fn a_failed_reading_is_the_last_good_one() {
    let mut dice = Dice(5);
    let sizes = [4, 2, 2, 3, 2];
    let mut failures = [0; 2];
    for _ in 0..50 {
        let mut numbers = Numbers::<f64>::random(&mut dice, sizes, 0.3);
        numbers.bounds = random_bounds(&mut dice, 2);
        let (mut state, mut reported) = (State::zeros(sizes), State::zeros(sizes));
        let (mut last_readings, mut last_references) = (vec![0.0; 3], vec![0.0; 2]);
        let (mut failing_reading, mut failing_reference) = ([0usize; 3], [0usize; 2]);
        for _ in 0..40 {
            let (mut readings, mut references) = (list(&mut dice, 3, 5.0), list(&mut dice, 2, 5.0));
            let mut fail = |values: &mut [f64], last: &mut [f64], failing: &mut [usize]| {
                for ((value, last), failing) in values.iter_mut().zip(last).zip(failing) {
                    if *failing == 0 && dice.below(5) == 0 {
                        *failing = 1 + dice.below(6);
                    }
                    if *failing > 0 {
                        *failing -= 1;
                        *value = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY][dice.below(3)];
                    } else {
                        *last = *value;
                    }
                }
                values.iter().filter(|x| !x.is_finite()).count()
            };
            let failed_readings = fail(&mut readings, &mut last_readings, &mut failing_reading);
            let failed_references = fail(&mut references, &mut last_references, &mut failing_reference);
            let health = state.step(&numbers, &readings, &references);
            let good = reported.step(&numbers, &last_readings, &last_references);
            assert_eq!(state.persistent(), reported.persistent());
            assert_eq!(
                health,
                Health { invalid_readings: failed_readings, invalid_references: failed_references, ..good },
                "the rest is the same"
            );
            failures[0] += failed_readings;
            failures[1] += failed_references;
        }
    }
    assert!(failures.iter().all(|count| *count > 500), "{failures:?}");
}

/// Matrices that are smaller than the memory count as filled up with zeros.
#[test]
fn small_matrices_are_filled_up_with_zeros() {
    let mut dice = Dice(6);
    let sizes = [4, 3, 2, 3, 2];
    for _ in 0..20 {
        let whole = Numbers::<f64>::random(&mut dice, sizes, 1.0);
        for number in 0..7 {
            for rows in 0..5 {
                for columns in [0, 1, 2, 3, 9] {
                    let mut numbers = whole.clone();
                    numbers.tables[number] = whole.tables[number].part(rows, columns);
                    let mut state = in_use(&mut dice, sizes);
                    let (readings, references) = (list(&mut dice, 3, 1.0), list(&mut dice, 2, 1.0));
                    let expected = by_hand(&numbers, &state, &readings, &references);
                    assert_eq!(state.step(&numbers, &readings, &references), Health::default());
                    agree(&state, &expected, &format!("matrix {number}: {rows} rows, {columns} columns"));
                }
            }
        }
    }
}

/// With too little work memory nothing happens, and that is told.
#[test]
fn too_short_work_buffer_changes_nothing() {
    let mut dice = Dice(7);
    for sizes in all_sizes() {
        let [n, k, r, p, _] = sizes;
        let numbers = Numbers::<f64>::random(&mut dice, sizes, 1.0);
        let enough = 2 * (n + k + r) + p;
        let mut state = in_use(&mut dice, sizes);
        assert_eq!(state.work.len(), enough);
        for short in 0..enough {
            state.work = vec![f64::NAN; short];
            let before = state.clone();
            let health = state.step(&numbers, &[1.0; 3], &[1.0; 2]);
            assert_eq!(health, Health { estimate_frozen: true, ..Health::default() }, "{sizes:?}, {short}");
            assert_eq!(state.persistent(), before.persistent(), "{sizes:?}, {short}");
        }
    }
}

/// Slices of any lengths, whether they fit each other or not: no panic, and commands within the bounds.
#[test]
fn slices_of_any_lengths_do_no_harm() {
    let mut dice = Dice(8);
    let (mut moved, mut short) = (0, 0);
    for _ in 0..8000 {
        let mut numbers = Numbers::<f64>::random(&mut dice, [0; 5], 1.0);
        for table in &mut numbers.tables {
            let (rows, columns) = (dice.below(7), dice.below(9));
            *table = Table::random(&mut dice, rows, columns, 2.0);
        }
        let bounds = dice.below(5);
        numbers.bounds = random_bounds(&mut dice, bounds);
        if dice.below(2) == 0 {
            let mut table = || {
                let (rows, columns) = (dice.below(5), dice.below(7));
                Table::random(&mut dice, rows, columns, 2.0)
            };
            let [on_state, on_model, on_references] = [table(), table(), table()];
            let bounds = dice.below(7);
            let bounds = list(&mut dice, bounds, 2.0);
            numbers.governing = Some(Governing { on_state, on_model, on_references, bounds });
        }
        let sizes: Sizes = std::array::from_fn(|_| dice.below(6));
        let mut state = State::zeros(sizes);
        if dice.below(3) == 0 {
            let work = dice.below(state.work.len() + 1);
            short += usize::from(work < state.work.len());
            state.work.truncate(work);
        }
        for _ in 0..4 {
            let (readings, references) = (dice.below(7), dice.below(7));
            let readings: Vec<f64> = (0..readings).map(|_| anything(&mut dice, 8)).collect();
            let references: Vec<f64> = (0..references).map(|_| anything(&mut dice, 8)).collect();
            let before = state.commands.clone();
            state.step(&numbers, &readings, &references);
            assert!(state.persistent().concat().iter().all(|x| x.is_finite()), "{state:?}");
            for (k, (before, after)) in before.iter().zip(&state.commands).enumerate() {
                // A command without bounds is unlimited.
                let bounds = numbers.bounds.get(k).copied().unwrap_or(Bounds { torque: None, change: None });
                allowed(&bounds, *before, *after);
            }
            moved += usize::from(before != state.commands);
        }
    }
    assert!(moved > 5000 && short > 1000, "{moved}, {short}");
}

/// What the block could not do as asked is told: a wish that is no number or infinite, an estimate or a reference model that
/// overflows.
#[test]
fn what_went_wrong_is_reported() {
    // u = −(K x̂ − r) with an estimate that stays.
    let feedback = |on_state: f64| {
        let tables = [
            Table::of(1, &[1.0]),
            Table::of(1, &[0.0]),
            Table::of(1, &[0.0]),
            Table::of(1, &[0.0]),
            Table::of(1, &[1.0]),
            Table::of(1, &[1.0]),
            Table::of(3, &[on_state, 0.0, -1.0]),
        ];
        Numbers::<f64> { tables, bounds: Vec::new(), governing: None }
    };
    let start = State::<f64> { estimate: vec![1e300], commands: vec![3.0], ..State::zeros([1, 1, 1, 1, 1]) };
    let limited = Bounds { torque: Some(5.0), change: Some(0.5) };

    // The wish is −∞: without bounds the command stays, with bounds it moves as far as it may. Both are told.
    for (bounds, expected) in [(vec![], 3.0), (vec![limited], 2.5)] {
        let (numbers, mut state) = (Numbers { bounds, ..feedback(1e10) }, start.clone());
        let health = state.step(&numbers, &[0.0], &[0.0]);
        assert_eq!(health, Health { commands_bounded: 1, ..Health::default() });
        assert_eq!((state.commands[0], state.estimate[0]), (expected, 1e300));
    }
    // The wish is NaN, the sum of −∞ from the estimate and ∞ from the reference: the command stays.
    for bounds in [vec![], vec![limited]] {
        let (mut numbers, mut state) = (Numbers { bounds, ..feedback(1e10) }, start.clone());
        numbers.tables[6] = Table::of(3, &[1e10, 0.0, -1e10]);
        numbers.tables[5] = Table::of(1, &[0.0]);
        let health = state.step(&numbers, &[0.0], &[1e300]);
        assert_eq!(health, Health { commands_bounded: 1, ..Health::default() });
        assert_eq!((state.commands[0], state.estimate[0]), (3.0, 1e300));
    }
    // A prediction or a correction that overflows is left out; the estimate stays.
    for (number, reading) in [(0, 0.0), (3, 1e300)] {
        let (mut numbers, mut state) = (feedback(0.0), start.clone());
        numbers.tables[number] = Table::of(1, &[1e10]);
        let health = state.step(&numbers, &[reading], &[2.0]);
        assert_eq!(health, Health { estimate_frozen: true, ..Health::default() });
        assert_eq!((state.commands[0], state.estimate[0], state.model[0]), (2.0, 1e300, 2.0));
    }
    // A reference model that overflows stays as well.
    let (mut numbers, mut state) = (feedback(0.0), State { model: vec![7.0], ..start.clone() });
    numbers.tables[5] = Table::of(1, &[1e10]);
    let health = state.step(&numbers, &[0.0], &[1e300]);
    assert_eq!(health, Health { estimate_frozen: true, ..Health::default() });
    assert_eq!((state.commands[0], state.estimate[0], state.model[0]), (1e300, 1e300, 7.0));
    // Commands that the bounds changed are counted one by one.
    let (mut numbers, mut state) = (feedback(0.0), State { commands: vec![0.0; 3], ..start });
    numbers.tables[6] = Table::of(3, &[0.0, 0.0, -1.0, 0.0, 0.0, -2.0, 0.0, 0.0, -3.0]);
    numbers.bounds = vec![Bounds { torque: Some(1.0), change: None }; 3];
    assert_eq!(state.step(&numbers, &[0.0], &[0.5]), Health { commands_bounded: 1, ..Health::default() });
    assert_eq!(state.commands, [0.5, 1.0, 1.0]);
    assert_eq!(state.step(&numbers, &[0.0], &[-0.75]), Health { commands_bounded: 2, ..Health::default() });
    assert_eq!(state.commands, [-0.75, -1.0, -1.0]);
}

/// The sample time of the plant x⁺ = x + T (u + d).
const PERIOD: f64 = 0.125;
/// The gain of u = k (r − x̂) − d̂, which halves the error at each sample.
const GAIN: f64 = 4.0;

/// A regulator of the integrator whose observer takes the reading over, and finds a constant load d from one sample to the
/// next.
fn integrator() -> Numbers<f64> {
    let tables = [
        Table::of(2, &[1.0, PERIOD, 0.0, 1.0]),
        Table::of(1, &[PERIOD, 0.0]),
        Table::of(2, &[1.0, 0.0]),
        Table::of(1, &[1.0, 1.0 / PERIOD]),
        Table::of(1, &[]),
        Table::of(1, &[]),
        Table::of(3, &[GAIN, 1.0, -GAIN]),
    ];
    Numbers { tables, bounds: Vec::new(), governing: None }
}

/// The integrator under a load with a motor of ±1, from rest at 0 with a reference of 1: position before each sample and the
/// command then. At the first two samples the reference is 0, so that the load is known when the step comes.
fn reach(numbers: &Numbers<f64>, load: f64, samples: usize) -> Vec<(f64, f64)> {
    let (mut state, mut x) = (State::zeros([2, 0, 1, 1, 1]), 0.0);
    let mut path = Vec::new();
    for sample in 0..samples {
        let health = state.step(numbers, &[x], &[if sample < 2 { 0.0 } else { 1.0 }]);
        assert!(!health.estimate_frozen && health.invalid_readings == 0);
        path.push((x, state.commands[0]));
        x += PERIOD * (state.commands[0].clamp(-1.0, 1.0) + load);
    }
    path
}

/// The motor at its limit does not wind anything up: the integrator goes at full torque until 4 (1 − x) − d is within the
/// limit, and halves what is left from then on, without any overshoot. All of these numbers are dyadic and exact.
#[test]
fn the_limit_does_not_wind_up() {
    let limit = 1.0;
    let knowing = Numbers { bounds: vec![Bounds { torque: Some(limit), change: None }], ..integrator() };
    // Without a load: 1/8 per sample at full torque, six times; then 4 (1 − 3/4) = 1 needs no limit any more.
    let path = reach(&knowing, 0.0, 40);
    assert_eq!(path[..2], [(0.0, 0.0); 2]);
    for k in 0..=6 {
        assert_eq!(path[2 + k], (k as f64 / 8.0, 1.0), "{k}");
    }
    let mut distance = 0.25;
    for (x, command) in &path[8..] {
        assert_eq!((*x, *command), (1.0 - distance, GAIN * distance));
        distance /= 2.0;
    }
    // With a load of −1/4: it moves the plant by −1/32 first. Found then, it is compensated, and half of the −1/32 is left when
    // the step comes; 3/32 per sample remain at full torque, until 4 (1 − x) + 1/4 is within the limit.
    let path = reach(&knowing, -0.25, 40);
    assert_eq!(path[..2], [(0.0, 0.0), (-1.0 / 32.0, 0.375)]);
    let mut x = -1.0 / 64.0;
    for (found, command) in &path[2..] {
        let torque = (GAIN * (1.0 - x) + 0.25).min(limit);
        assert_eq!((*found, *command), (x, torque));
        assert!(x <= 1.0, "no overshoot");
        x += PERIOD * (torque - 0.25);
    }
    assert_eq!(
        path.iter().filter(|(_, command)| *command == limit).count(),
        9,
        "−1/64 + 9 · 3/32 is the first beyond 13/16"
    );
    assert!((x - 1.0).abs() < 1e-6, "{x}");
    // A block that does not know the limit takes what the motor does not give for a load, and overshoots far.
    let wound_up = reach(&integrator(), 0.0, 40).iter().fold(0.0f64, |most, (x, _)| most.max(*x));
    assert!(wound_up > 1.5, "{wound_up}");
}

/// A regulator that knows the state x and gives u = kr r − kx x, with a governor of the given rows on x and on r.
fn governed([a, b]: [f64; 2], [kx, kr]: [f64; 2], rows: &[[f64; 2]], bound: f64) -> Numbers<f64> {
    let column = |j: usize| Table { entries: rows.iter().map(|row| row[j]).collect(), columns: 1 };
    let tables = [
        Table::of(1, &[a]),
        Table::of(1, &[b]),
        Table::of(1, &[1.0]),
        Table::of(1, &[1.0]),
        Table::of(1, &[]),
        Table::of(1, &[]),
        Table::of(2, &[kx, -kr]),
    ];
    let governing = Governing {
        on_state: column(0),
        on_model: Table::of(1, &[]),
        on_references: column(1),
        bounds: vec![bound; rows.len()],
    };
    Numbers { tables, bounds: Vec::new(), governing: Some(governing) }
}

/// The integrator under a governor goes the way that it goes at its limit, but the bound is never asked to act: the reference
/// climbs by 1/8 from 1/4 on, exactly.
#[test]
fn the_governor_lets_through_what_the_motor_can_give() {
    let numbers = governed([1.0, PERIOD], [GAIN, GAIN], &[[-GAIN, GAIN]], 1.0);
    let (mut state, mut x) = (State::zeros([1, 0, 1, 1, 1]), 0.0);
    for k in 0..30 {
        let health = state.step(&numbers, &[x], &[1.0]);
        assert_eq!(health, Health { governed: k < 6, ..Health::default() }, "{k}");
        assert_eq!(state.references[0], (0.25 + f64::from(k) / 8.0).min(1.0), "{k}");
        assert_eq!(state.commands[0], if k < 6 { 1.0 } else { 0.5f64.powi(k - 6) }, "{k}");
        x += PERIOD * state.commands[0];
    }
    // The other way it is the same.
    state = State::zeros([1, 0, 1, 1, 1]);
    assert!(state.step(&numbers, &[0.0], &[-1.0]).governed);
    assert_eq!((state.references[0], state.commands[0]), (-0.25, -1.0));
    // It goes by what the reading tells: a plant that stands at 1/2 asks for −2 already, and may be asked for 1.
    state = State::zeros([1, 0, 1, 1, 1]);
    assert!(state.step(&numbers, &[0.5], &[1.0]).governed);
    assert_eq!((state.references[0], state.commands[0]), (0.75, 1.0));
    // Without the governor four times as much as the bound is asked for.
    let free = Numbers { governing: None, ..numbers };
    let mut state = State::zeros([1, 0, 1, 1, 1]);
    state.step(&free, &[0.0], &[1.0]);
    assert_eq!(state.commands[0], 4.0);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    /// A first-order loop with the pole p: for a constant reference the command is u∞ + (u₀ − u∞) pᵏ, which never leaves what
    /// lies between u₀, u₁ and u∞. With these three as predictions, no sequence of references drives the command beyond its
    /// bound; with an integrator and p ≥ 0 the first alone is enough, as it is the largest.
    #[test]
    fn exact_predictions_bound_every_command(
        integrates in any::<bool>(),
        (a, p) in (-0.9..1.0f64, -0.95..0.95f64),
        (b, kr) in (0.05..2.0f64, prop_oneof![0.1..5.0f64, -5.0..-0.1f64]),
        bound in 0.1..10.0f64,
        seed in any::<u64>(),
    ) {
        let (a, p) = if integrates { (1.0, p.abs()) } else { (a, p) };
        let kx = (a - p) / b;
        let first = [-kx, kr];
        let second = [-kx * p, kr - kx * b * kr];
        let last = [0.0, kr - kx * b * kr / (1.0 - p)];
        let rows = [first, second, last];
        let numbers = governed([a, b], [kx, kr], &rows[..if integrates { 1 } else { 3 }], bound);
        let (mut state, mut x, mut dice) = (State::zeros([1, 0, 1, 1, 1]), 0.0, Dice(seed));
        let mut reference = 0.0;
        for _ in 0..100 {
            if dice.below(5) == 0 {
                reference = 10.0 * anything::<f64>(&mut dice, 3);
            }
            state.step(&numbers, &[x], &[reference]);
            let command = state.commands[0];
            let rounding = 1e-13 * (bound + (kx * x).abs() + (kr * state.references[0]).abs());
            prop_assert!(command.abs() <= bound + rounding, "{} beyond {}", command, bound);
            x = a * x + b * command;
        }
    }

    /// A reference that does not ask for too much passes as it is, whatever the others do; what is held back is held at a
    /// bound; no prediction gets worse than its bound or than it was; and what is no number never gets in.
    #[test]
    fn references_are_limited_only_where_necessary(seed in any::<u64>()) {
        let mut dice = Dice(seed);
        let (n, k, r, predictions) = (dice.below(4), dice.below(3), 1 + dice.below(2), dice.below(5));
        let mut governing = Governing::<f64>::random(&mut dice, predictions, [n, k, r], 1.0);
        let (state, model) = (list::<f64>(&mut dice, n, 1.0), list::<f64>(&mut dice, k, 1.0));
        // With all digits, so that a detour by differences would be rounded.
        let (start, target) = (list::<f64>(&mut dice, r, 0.9), list::<f64>(&mut dice, r, 3.1));
        let predict = |row: usize, references: &[f64]| {
            let states = (0..n).map(|j| governing.on_state.at(row, j) * state[j]).sum::<f64>();
            let models = (0..k).map(|j| governing.on_model.at(row, j) * model[j]).sum::<f64>();
            states + models + (0..r).map(|j| governing.on_references.at(row, j) * references[j]).sum::<f64>()
        };
        let bits = |list: &[f64]| list.iter().map(|x| x.to_bits()).collect::<Vec<_>>();

        // As random as the bounds are.
        let mut found = start.clone();
        let limited = governing.block().govern(&state, &model, &target, &mut found);
        for (row, bound) in governing.bounds.iter().enumerate() {
            let (before, after) = (predict(row, &start).abs(), predict(row, &found).abs());
            prop_assert!(after <= bound.max(before) + 1e-12, "{before} to {after} with {bound}");
        }
        prop_assert_eq!(limited, bits(&found) != bits(&target));
        for j in 0..r {
            let (low, high) = (start[j].min(target[j]), start[j].max(target[j]));
            prop_assert!(low - 1e-12 <= found[j] && found[j] <= high + 1e-12, "on the way from start to wish");
        }
        // The last reference was moved when all others stood where they are: it stopped at a bound.
        if found[r - 1] != target[r - 1] {
            let mut further = found.clone();
            further[r - 1] += 1e-6 * (target[r - 1] - start[r - 1]).signum();
            let worse = |row: usize| {
                let after = predict(row, &further).abs();
                after > governing.bounds[row] && after > predict(row, &found).abs()
            };
            prop_assert!((0..predictions).any(worse), "it could have gone on from {found:?} to {target:?}");
        }

        // What is no number does not get in, and does not keep the others out.
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for j in 0..r {
                let (mut reported, mut valid) = (target.clone(), target.clone());
                (reported[j], valid[j]) = (bad, start[j]);
                let (mut found, mut expected) = (start.clone(), start.clone());
                governing.block().govern(&state, &model, &reported, &mut found);
                governing.block().govern(&state, &model, &valid, &mut expected);
                prop_assert_eq!(bits(&found), bits(&expected));
            }
        }

        // Bounds that leave room for each reference on its way: everything passes.
        let way = |row: usize| {
            let mut now = start.clone();
            let mut most = predict(row, &now).abs();
            for j in 0..r {
                now[j] = target[j];
                most = most.max(predict(row, &now).abs());
            }
            most * (1.0 + 1e-12) + 1e-12
        };
        let wide = (0..predictions).map(way).collect();
        governing.bounds = wide;
        let mut found = start;
        prop_assert!(!governing.block().govern(&state, &model, &target, &mut found));
        prop_assert_eq!(bits(&found), bits(&target));
    }
}
