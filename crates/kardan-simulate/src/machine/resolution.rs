//! Whether a step resolves the loop: how far the arguments of its operations move, and the possible effect of
//! operations that it does not resolve.

use super::Machine;
use super::expressions::Places;
use super::kinks::line_range;
use super::resolved::Resolved;
use kardan_expr::expr::Interval;
use kardan_expr::plan::{Over, Resolution};
use kardan_mechanics::reduce::MotionPlan;

/// Part of a tolerance by which unresolved operations may change a value in a step.
const PART: f64 = 0.1;
/// Most halvings of a step to find the point that it must not pass.
const HALVINGS: u32 = 20;

/// What a span of time, part of a step, may hide between its evaluations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Hidden {
    /// Nothing: operations that the whole step does not resolve change every value by at most a part of the tolerances.
    Nothing,
    /// Nothing if it is a step of its own: the operations that it does not resolve itself change every value by no more than that.
    NothingAlone,
    /// Possibly something.
    Unknown,
}

impl Machine {
    /// Prepares the assessment of steps; `also`: further values that are read from the plan's memory.
    pub(crate) fn prepare_resolution(&mut self, also: &[usize]) {
        let MotionPlan { plan, inertia, friction_rows, friction_bias, .. } = self.dynamics.plan();
        let found = |outputs: &std::ops::Range<usize>| self.memory_places(outputs);
        let Places { friction_speeds, commands, jenkins_torques, unilaterals, read_sources, .. } = &self.places;
        let Places { gear_loads, gear_load_by_acceleration, gear_load_by_torque, .. } = &self.places;
        let forces = found(&self.places.forces);
        let rates = [&self.places.rates, &self.places.powers].map(found).concat();
        let outputs = [friction_speeds, commands, jenkins_torques, unilaterals, read_sources];
        let gear_losses = [gear_loads, gear_load_by_acceleration, gear_load_by_torque];
        let outputs = outputs.into_iter().chain(gear_losses).flat_map(found);
        let motion = [inertia, friction_rows, friction_bias].into_iter().flatten();
        let motion = motion.map(|(_, output)| plan.place(*output));
        let outputs: Vec<usize> = outputs.chain(motion).chain(also.iter().copied()).collect();
        let resolved: Vec<usize> = [&forces, &rates, &outputs].into_iter().flatten().copied().collect();
        let resolution = Resolution::new(plan, &resolved, |input| self.is_steady_input(input));
        let arguments: Vec<usize> = resolution.arguments().collect();
        let (inputs, r) = (plan.inputs.len(), self.degrees_of_freedom);
        self.resolved = (!resolution.is_empty()).then(|| {
            Box::new(Resolved {
                resolution,
                forces,
                rates,
                outputs,
                noted: vec![(f64::INFINITY, f64::NEG_INFINITY); plan.block().memory()],
                arguments,
                inputs: vec![Interval::point(0.0); inputs],
                column: vec![0.0; r],
                accelerations: vec![0.0; r],
            })
        });
    }

    /// Whether series of the last expansion resolve a step of that length, by their terms up to an order.
    pub(crate) fn series_resolve(&self, length: f64, order: usize) -> bool {
        let Some(expansion) = &self.expansion else { return true };
        self.terms_resolve(length, order, |place, order| expansion.series.value(place, order))
    }

    /// The same by the terms of the values at indices of the plan's memory, each of an order.
    pub(super) fn terms_resolve(&self, length: f64, order: usize, term: impl Fn(usize, usize) -> f64) -> bool {
        let Some(resolved) = &self.resolved else { return true };
        let extent = |place: usize| {
            let moved = (1..order).rev().fold(0.0, |sum, order| (sum + term(place, order).abs()) * length);
            (term(place, 0).abs(), moved)
        };
        resolved.resolution.moved(extent) <= 1.0
    }

    /// Begins to record the arguments of operations in the evaluations of a step.
    pub(crate) fn begin_notes(&mut self) {
        if let Some(resolved) = &mut self.resolved {
            resolved.arguments.iter().for_each(|place| resolved.noted[*place] = (f64::INFINITY, f64::NEG_INFINITY));
        }
    }

    /// Records them at the point last evaluated.
    pub(crate) fn note_arguments(&mut self) {
        let Some(resolved) = &mut self.resolved else { return };
        let values = self.work.values();
        for place in &resolved.arguments {
            let ((low, high), value) = (&mut resolved.noted[*place], values[*place]);
            (*low, *high) = (low.min(value), high.max(value));
        }
    }

    /// Whether the recorded evaluations resolve the step.
    pub(crate) fn notes_resolve(&self) -> bool {
        let Some(resolved) = &self.resolved else { return true };
        let extent = |place: usize| {
            let (low, high) = resolved.noted[place];
            let apart = if low > 0.0 || high < 0.0 { low.abs().min(high.abs()) } else { low.abs().max(high.abs()) };
            (apart, (high - low).max(0.0))
        };
        resolved.resolution.moved(extent) <= 1.0
    }

    /// The time up to which a step misses no unresolved event: unresolved operations before it are proven negligible by
    /// interval arithmetic. `state` returns the state at a time within it, `between` is memory for such states; allowed
    /// errors are relative and absolute ones.
    pub(crate) fn resolved_until(
        &mut self,
        (from, to): (f64, f64),
        between: &mut [Vec<f64>; 3],
        mut state: impl FnMut(f64, &mut [f64]),
        tolerances: (f64, &[f64]),
    ) -> f64 {
        let (mut open, mut resolved) = (vec![(from, to, 0)], from);
        while let Some((low, high, halvings)) = open.pop() {
            let middle = low + 0.5 * (high - low);
            for (time, out) in [low, middle, high].into_iter().zip(&mut *between) {
                state(time, out);
            }
            let [begin, centre, end] = &*between;
            match self.hidden((low, high), [begin, centre, end], (halvings == 0, tolerances)) {
                Hidden::Nothing => resolved = high,
                Hidden::Unknown if halvings < HALVINGS => {
                    open.extend([(middle, high, halvings + 1), (low, middle, halvings + 1)]);
                }
                Hidden::NothingAlone | Hidden::Unknown => return if resolved > from { resolved } else { high },
            }
        }
        to
    }

    /// What a span of time may hide while the state moves within `states`, at its begin, in its middle and at its end; the `whole` step comes first.
    fn hidden(
        &mut self,
        (from, to): (f64, f64),
        states: [&[f64]; 3],
        (whole, tolerances): (bool, (f64, &[f64])),
    ) -> Hidden {
        let Some(mut resolved) = self.resolved.take() else { return Hidden::Nothing };
        self.evaluate(0.5 * (from + to), states[1]);
        self.find_spans(Interval { low: from, high: to }, states, &mut resolved.inputs);
        let alone = resolved.resolution.find(&resolved.inputs, self.work.values());
        if whole {
            resolved.resolution.mark_step();
        }
        let mut is_negligible = |over: Over| {
            resolved.resolution.find_effects(self.work.values(), over);
            self.is_negligible(&mut resolved, (to - from, states), tolerances)
        };
        let hidden = if (whole && alone) || is_negligible(Over::Step) {
            Hidden::Nothing
        } else if alone || (!whole && is_negligible(Over::Span)) {
            Hidden::NothingAlone
        } else {
            Hidden::Unknown
        };
        self.resolved = Some(resolved);
        hidden
    }

    /// The ranges of all inputs of the plan over a span of time.
    fn find_spans(&self, span: Interval, states: [&[f64]; 3], out: &mut [Interval]) {
        let (r, places, values) = (self.degrees_of_freedom, &self.places, self.work.values());
        out.iter_mut().zip(values).for_each(|(out, value)| *out = Interval::point(*value));
        for k in 0..self.size - 2 {
            let of = states.map(|state| state[k]);
            let (low, high) = (of[0].min(of[1]).min(of[2]), of[0].max(of[1]).max(of[2]));
            // A value that moves between three points may exceed them.
            let more = 0.5 * (high - low);
            let place = if k < 2 * r { k } else { places.states.start + k };
            out[place] = Interval { low: low - more, high: high + more };
        }
        let first = 2 * r;
        for (k, line) in self.lines.iter().enumerate() {
            out[first + places.sources.start + k] = line_range(*line, span);
        }
        out[first + places.timed.start..].iter_mut().zip(self.timed.between(span)).for_each(|(out, own)| *out = own);
    }

    /// Whether unresolved operations change every rate and every value that is read by at most a part of the
    /// tolerances.
    fn is_negligible(
        &self,
        Resolved { resolution, forces, rates, outputs, column, accelerations, .. }: &mut Resolved,
        (length, states): (f64, [&[f64]; 3]),
        (relative, absolute): (f64, &[f64]),
    ) -> bool {
        let (r, values) = (self.degrees_of_freedom, self.work.values());
        let effect = |place: usize| resolution.effect(place, values);
        accelerations.fill(0.0);
        for (i, place) in forces.iter().enumerate() {
            let force = effect(*place);
            if force == 0.0 {
                continue;
            }
            if !force.is_finite() {
                return false;
            }
            column.fill(0.0);
            column[i] = force;
            self.work.factor.solve(column);
            accelerations.iter_mut().zip(column.iter()).for_each(|(sum, own)| *sum += own.abs());
        }
        let allowed = |k: usize| {
            let size = states.iter().fold(0.0f64, |most, state| most.max(state[k].abs()));
            PART * (absolute[k] + relative * size)
        };
        let fits = |i: usize| {
            if self.still.contains(&i) {
                return effect(forces[i]) <= relative * (1.0 + values[forces[i]].abs());
            }
            let speed = accelerations[i] * length;
            speed <= allowed(r + i) && speed * length <= allowed(i)
        };
        let mut rest = rates.iter().enumerate();
        (0..r).all(fits)
            && rest.all(|(k, place)| effect(*place) * length <= allowed(2 * r + k))
            && outputs.iter().all(|place| effect(*place) <= PART * relative * (1.0 + values[*place].abs()))
    }
}
