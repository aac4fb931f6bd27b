//! Windows to rows of the torque balance.

use kardan_rt::functions::powi;

use super::backlashes::Backlash;
use super::channels::{Quantity, quantity_of};
use super::cutting::{is_cut, teeth};
use super::extra::with_recordings;
use super::laws::law_torques;
use super::plant::{Columns, Plant, Sensors, in_coordinates, silence};
use super::reading::Recording;
use super::request::FitRequest;
use kardan_identify::{
    Coefficient, Errors, Extra, Motion, Reading, Regressor, RegressorOptions, Samples, Steadiness, Teeth, Where,
    steady_segments,
};
use kardan_math::num::{Matrix, Rational, dot, echelon};
use kardan_mechanics::equations::{Domain, Term, UnilateralConstraint};
use kardan_mechanics::reduce::{Reduced, linearise};
use kardan_model::Model;
use kardan_results::{LogRead, WindowCount};

/// Noise that any sensor has, as a part of its largest reading.
const FLOOR: f64 = 1e-7;

/// The data read.
pub(super) struct Material<'a> {
    pub recorded: &'a [Recording],
    pub slots: &'a [Quantity],
    /// s
    pub window: f64,
    /// Uncertainty of a reading of each slot from the sensor step and rounding.
    resolution: Vec<f64>,
    /// Noise of a sample in each slot, over all recordings; an encoder has at least that of its step, any sensor a little.
    pub noise: Vec<f64>,
}

impl<'a> Material<'a> {
    pub fn new(recorded: &'a [Recording], slots: &'a [Quantity], window: f64, model: &Model) -> Self {
        let step = |slot: &Quantity| {
            model.terms.iter().filter(|named| matches!(named.term, Term::Output(_))).find_map(|named| {
                let (quantity, step) = quantity_of(&named.element, model)?;
                (quantity == *slot).then_some(step).flatten()
            })
        };
        let mut out = Self { recorded, slots, window, resolution: Vec::new(), noise: Vec::new() };
        for (k, slot) in slots.iter().enumerate() {
            let readings = out.windows().map(|row| row[k].value.abs());
            let largest = readings.filter(|x| x.is_finite()).fold(0.0, f64::max);
            let resolution = (step(slot).unwrap_or(0.0) / 12.0_f64.sqrt()).max(FLOOR * largest);
            let measured = recorded.iter().map(|one| one.noise[k].0).fold(0.0, f64::max);
            let stated = recorded.iter().any(|one| one.noise[k].1);
            out.noise.push(if stated { measured } else { measured.max(resolution) });
            out.resolution.push(resolution);
        }
        out
    }

    /// The readings of all slots, window by window.
    fn windows(&self) -> impl Iterator<Item = &Vec<Reading>> {
        self.recorded.iter().flat_map(|one| one.windows.values())
    }

    /// Remarks about the logs.
    pub fn remarks(&self) -> Vec<String> {
        let logs = self.recorded.iter().flat_map(|one| &one.logs);
        logs.flat_map(|log| log.remarks.iter().map(|remark| format!("`{}`: {remark}", log.name))).collect()
    }

    /// The logs, with the noise of their channels.
    pub fn logs(&self) -> Vec<LogRead> {
        let mut out = Vec::new();
        for recording in self.recorded {
            let mut logs = recording.logs.clone();
            for channel in logs.iter_mut().flat_map(|log| &mut log.channels) {
                if let Some(slot) = self.slots.iter().position(|slot| slot.signal() == channel.signal) {
                    (channel.noise, channel.stated) = recording.noise[slot];
                }
            }
            out.extend(logs);
        }
        out
    }
}

/// Rows of all windows.
pub(super) struct Built {
    pub samples: Samples,
    pub count: WindowCount,
    /// Standard deviations of a window's angles, speeds and accelerations of the coordinates, SI.
    pub noise: [Vec<f64>; 3],
    /// Data of the backlashes.
    pub backlashes: Vec<Backlash>,
    /// For each sample the number of its window among the complete ones.
    windows_of_samples: Vec<usize>,
}

/// Rows of the torque balance in every window that yields one.
pub(super) fn rows(plant: &Plant, request: &FitRequest, columns: &Columns, material: &Material<'_>) -> Built {
    let mut reduced = plant.reduced.clone();
    // Parameters of a combination are identified with it, not known.
    for &(free, _) in columns.identifiable.iter().flat_map(|(_, with)| with) {
        silence(&mut reduced.equations, &columns.coefficients[free]);
    }
    let (r, m) = (reduced.degrees_of_freedom(), reduced.equations.inputs.len());
    let coefficients: Vec<Coefficient> = columns.identified().cloned().collect();
    let mut motion = Moving::new(plant);
    let mut teeth = teeth(&plant.balance(&reduced, &columns.coefficients, request));
    let (basis, equations) = (plant.basis(), &reduced.equations);
    let frictions = equations.frictions.iter().map(|term| (&term.row, equations.domain_of(term)));
    let gears = equations.gear_losses().map(|(gear, _)| (&gear.row, equations.domain_of_unilateral(gear)));
    let directions = frictions.chain(gears).map(|(row, domain)| (in_coordinates(row, &basis), domain));
    let mut rest_speeds = rest_speeds(plant, request, &directions.collect::<Vec<_>>(), material);
    let of_teeth = rest_speeds.split_off(equations.frictions.len());
    teeth.iter_mut().zip(of_teeth).for_each(|(one, speed)| one.rest_speed = speed);
    let (mut backlashes, cuts): (Vec<Backlash>, Vec<_>) =
        cut_backlashes(plant, columns, request, material).into_iter().unzip();
    let laws =
        law_torques(&reduced, &request.extras, &plant.harmonics).expect("the plant was checked for more of them");
    let options = RegressorOptions {
        extras: columns.extras.clone(),
        laws,
        teeth,
        backlashes: cuts,
        lenient: request.lenient,
        window: material.window,
        rest_speeds,
        errors: has_silent_rows(plant, &reduced, material),
    };
    let mut regressor = Regressor::new(&reduced, &coefficients, &plant.unmeasured, 0.0).with(options);
    let mut samples = Samples::new(regressor.rows(), regressor.columns(), columns.extras.len(), r, m);
    if let Some(columns) = regressor.error_columns() {
        samples.errors = Some(Errors { columns: columns.to_vec(), ..Errors::default() });
    }
    let mut parts = vec![0.0; regressor.columns()];
    let mut carried: Vec<Carried> = Vec::new();
    let mut built = Built {
        samples,
        count: WindowCount::default(),
        noise: [POSITION, SPEED, ACCELERATION].map(|_| vec![0.0; r]),
        backlashes: Vec::new(),
        windows_of_samples: Vec::new(),
    };
    for (log, recording) in material.recorded.iter().enumerate() {
        for ((section, number), row) in &recording.windows {
            built.count.all += 1;
            if !motion.take(plant, row, material) {
                built.count.incomplete += 1;
                continue;
            }
            let since = (*number as f64 + 0.5) * material.window;
            let time = recording.origin + since;
            regressor.at(log, [since, time], &motion.harmonics);
            let before = built.samples.len();
            built.add(
                Where { log, section: *section, time, duration: material.window },
                &motion,
                &mut regressor,
                request.lenient,
            );
            let carried_torques = regressor.carried().iter().map(|one| one.map(|[torque, _]| torque));
            carried.push((log, *section, time, carried_torques.collect()));
            if built.samples.len() > before {
                built.windows_of_samples.push(carried.len() - 1);
            }
            for (k, backlash) in backlashes.iter_mut().enumerate() {
                if let Some(now) = regressor.backlash(k, &motion.torques, &mut parts) {
                    backlash.windows.push((log, *section, time, now));
                    backlash.parts.extend_from_slice(&parts);
                }
            }
        }
    }
    built.backlashes = backlashes;
    built.leave_turning_teeth(&columns.extras, &carried, request.lenient);
    built
}

/// Gear loads in a window: its log, section and middle, and the torque of each where known.
type Carried = (usize, usize, f64, Vec<Option<f64>>);

/// Windows in which a gear load changes its sign, or may: its mean magnitude is not that of its mean, and no single loss is valid.
fn turning(carried: &[Carried], teeth: usize) -> Vec<bool> {
    let near = |a: &Carried, b: &Carried| (a.0, a.1) == (b.0, b.1);
    let of = |k: usize| carried[k].3.get(teeth).copied().flatten();
    (0..carried.len())
        .map(|k| {
            let Some(own) = of(k) else { return false };
            let neighbours = [k.checked_sub(1), (k + 1 < carried.len()).then_some(k + 1)];
            // Within half a window it may change by half of its change to the next window, and is curved.
            neighbours.into_iter().flatten().filter(|&candidate| near(&carried[candidate], &carried[k])).any(
                |candidate| {
                    of(candidate).is_none_or(|candidate| own * candidate <= 0.0 || own.abs() < (own - candidate).abs())
                },
            )
        })
        .collect()
}

/// Whether there are motions without a measured torque that is not always zero.
fn has_silent_rows(plant: &Plant, reduced: &Reduced, material: &Material<'_>) -> bool {
    let acts = |slot: usize| {
        let mut readings = material.windows().map(|row| row[slot].value);
        readings.any(|x| x.is_finite() && x != 0.0)
    };
    let inputs = 0..plant.torques.len();
    let acting: Vec<usize> =
        inputs.filter(|&k| plant.unmeasured.contains(&k) || plant.torques[k].is_some_and(acts)).collect();
    let input = linearise(reduced, &vec![0.0; reduced.degrees_of_freedom()]).input;
    let columns = Matrix::from_fn(input.rows(), acting.len(), |i, j| input[(i, acting[j])].clone());
    echelon(&columns, &(0..acting.len()).collect::<Vec<_>>()).pivots.len() < reduced.degrees_of_freedom()
}

/// The backlash of an element and its cut, if both angles are measured and the measurements determine the torque.
fn cut_backlashes(
    plant: &Plant,
    columns: &Columns,
    request: &FitRequest,
    material: &Material<'_>,
) -> Vec<(Backlash, Teeth)> {
    let free = |name: &String| {
        let number = columns.coefficients.iter().position(|one| one.name == *name);
        number.is_some_and(|number| columns.identifiable.iter().all(|(k, with)| *k != number || !with.is_empty()))
    };
    let equations = &plant.reduced.equations;
    // Within compliant ones the angle changes with the torque.
    let rigid = |element: &str| {
        equations.unilaterals.iter().any(|unilateral| {
            unilateral.element == element && matches!(unilateral.value, UnilateralConstraint::Stop { .. })
        })
    };
    // The steps and digits of the angles of the coordinates along a direction.
    let basis = plant.basis();
    let grain = |row: &[(usize, Rational)]| {
        let parts = in_coordinates(row, &basis).into_iter().zip(&plant.sensors);
        let part = |(a, (angle, _)): (f64, &Sensors)| angle.map_or(0.0, |slot| a * material.resolution[slot]);
        parts.map(part).map(|x| x * x).sum::<f64>().sqrt()
    };
    let enters = |element: &str, cut: &Teeth| {
        equations.frictions.iter().any(|term| term.element == element && is_cut(term, cut))
    };
    let measured = plant.sensors.iter().all(|(angle, _)| angle.is_some());
    let own = plant.backlashes.iter().filter(|element| measured && rigid(element)).filter_map(|element| {
        let number = equations.inputs.iter().position(|input| input.element == *element)?;
        let balance = plant.balance(&plant.reduced, &columns.coefficients, request);
        let (cut, mut untold) = balance.cut_of_backlash(number)?;
        untold.retain(free);
        // Only the fit determines their size at a speed.
        let curved = request.extras.iter().filter(|extra| extra.shape().is_some() && enters(&extra.element, &cut));
        untold.extend(curved.map(|extra| extra.name.clone()));
        let input = &equations.inputs[number];
        let (straight, grain) = (equations.domain_of(input) == Domain::Translation, grain(&input.row));
        Some((Backlash { element: element.clone(), straight, untold, grain, ..Backlash::default() }, cut))
    });
    own.collect()
}

impl Built {
    /// Omits windows in which the load of a gear with unknown loss changes its sign; or only their columns, where that suffices.
    fn leave_turning_teeth(&mut self, extras: &[Extra], carried: &[Carried], lenient: bool) {
        let (p, first) = (self.samples.columns, self.samples.columns - extras.len());
        let mut dropped = vec![false; self.samples.len()];
        for (column, extra) in extras.iter().enumerate() {
            let Extra::Teeth { teeth, .. } = *extra else { continue };
            let turning = turning(carried, teeth);
            for (k, window) in self.windows_of_samples.iter().enumerate().filter(|(_, window)| turning[**window]) {
                debug_assert_eq!(carried[*window].2, self.samples.places[k].time);
                dropped[k] = true;
                if lenient {
                    let rows = self.samples.rows;
                    let own = &mut self.samples.x[k * rows * p..(k + 1) * rows * p];
                    own.chunks_exact_mut(p).for_each(|row| row[first + column] = f64::NAN);
                }
            }
        }
        if !lenient && dropped.contains(&true) {
            self.count.sticking += dropped.iter().filter(|dropped| **dropped).count();
            let retained = (0..dropped.len()).filter(|&k| !dropped[k]).map(|k| k..k + 1);
            self.samples = self.samples.averaged(&retained.collect::<Vec<_>>());
        }
    }

    /// The row of a window, unless a friction sticks in it or its numbers are too large.
    fn add(&mut self, place: Where, motion: &Moving, regressor: &mut Regressor, lenient: bool) {
        let Moving { position, speed, acceleration, torques, variances, .. } = motion;
        let room = self.samples.push(place, [position, speed, acceleration]);
        let certain = regressor.fill_sample(Motion { position, speed, acceleration }, torques, variances, room);
        let last = self.samples.len() - 1;
        let numbers = |x: &f64| x.is_finite() || (lenient && x.is_nan());
        let finite = self.samples.x(last).iter().all(numbers) && self.samples.y(last).iter().all(|x| x.is_finite());
        if !certain || !finite {
            self.samples.pop();
            self.count.sticking += 1;
            return;
        }
        for (most, part) in self.noise.iter_mut().zip([POSITION, SPEED, ACCELERATION]) {
            most.iter_mut().zip(motion.variances_of(part)).for_each(|(most, v)| *most = v.sqrt().max(*most));
        }
    }
}

/// The speeds along directions below which a friction or a gear counts as sticking: stated for the domain, else a fraction of the
/// largest, and above the noise level.
fn rest_speeds(
    plant: &Plant,
    request: &FitRequest,
    directions: &[(Vec<f64>, Domain)],
    material: &Material<'_>,
) -> Vec<f64> {
    let mut motion = Moving::new(plant);
    // The largest speed along each, and that of the noise.
    let mut found = vec![[0.0_f64; 2]; directions.len()];
    for row in material.windows() {
        if motion.take(plant, row, material) {
            for ([largest, hidden], (g, _)) in found.iter_mut().zip(directions) {
                *largest = largest.max(dot(g, &motion.speed).abs());
                let spread: f64 = g.iter().zip(motion.variances_of(SPEED)).map(|(g, v)| g * g * v).sum();
                *hidden = hidden.max(spread.sqrt());
            }
        }
    }
    let rest_speed = |([largest, hidden], (_, domain)): ([f64; 2], &(_, Domain))| match request.rest_speed {
        Some((stated, of)) if of == *domain => stated,
        _ => (0.01 * largest).max(3.0 * hidden),
    };
    found.into_iter().zip(directions).map(rest_speed).collect()
}

impl FitRequest {
    /// Gives terms that differ between recordings a column for each; returns notes about omitted ones, with the reason.
    pub fn split_by_recording(&mut self, plant: &Plant, material: &Material<'_>) -> Vec<String> {
        let names: Vec<String> = material.recorded.iter().map(Recording::name).collect();
        let (extras, notes) = with_recordings(&self.extras, &names, &|element| senses(plant, self, material, element));
        self.extras = extras;
        notes
    }
}

/// Whether an element with friction moved forwards and backwards in each recording, in usable windows.
fn senses(plant: &Plant, request: &FitRequest, material: &Material<'_>, element: &str) -> Vec<[bool; 2]> {
    let frictions = &plant.reduced.equations.frictions;
    let nowhere = vec![[false; 2]; material.recorded.len()];
    let Some(number) = frictions.iter().position(|term| term.element == element) else { return nowhere };
    let g = in_coordinates(&frictions[number].row, &plant.basis());
    let mut motion = Moving::new(plant);
    let domain = plant.reduced.equations.domain_of(&frictions[number]);
    let rest = rest_speeds(plant, request, &[(g.clone(), domain)], material)[0];
    let mut ways = |recording: &Recording| {
        let mut out = [false; 2];
        for row in recording.windows.values() {
            if motion.take(plant, row, material) {
                let speed = dot(&g, &motion.speed);
                out[usize::from(speed < 0.0)] |= speed.abs() > rest;
            }
        }
        out
    };
    material.recorded.iter().map(&mut ways).collect()
}

/// Parts of a motion, in the order of the variances of [`Errors`]; the covariances of accelerations and positions come last.
const ACCELERATION: usize = 0;
const SPEED: usize = 1;
const POSITION: usize = 2;
const CROSS: usize = 3;

/// The motion and the torques in a window, with their variances in the order of [`Errors`].
struct Moving {
    position: Vec<f64>,
    speed: Vec<f64>,
    acceleration: Vec<f64>,
    torques: Vec<f64>,
    variances: Vec<f64>,
    harmonics: Vec<f64>,
}

impl Moving {
    fn new(plant: &Plant) -> Self {
        let (r, m) = (plant.reduced.degrees_of_freedom(), plant.reduced.equations.inputs.len());
        let zero = || vec![0.0; r];
        Self {
            position: zero(),
            speed: zero(),
            acceleration: zero(),
            torques: vec![0.0; m],
            variances: vec![0.0; m + 4 * r],
            harmonics: vec![0.0; plant.harmonics.len()],
        }
    }

    /// The variances of a part of the motion.
    fn variances_of(&self, part: usize) -> &[f64] {
        let r = self.speed.len();
        &self.variances[self.torques.len() + part * r..][..r]
    }

    /// Loads the readings of a window; false if one is missing.
    fn take(&mut self, plant: &Plant, row: &[Reading], material: &Material<'_>) -> bool {
        let mut whole = true;
        let mut reading = |slot: usize| {
            let found = row[slot];
            whole &= found.value.is_finite();
            (found, material.noise[slot] * material.noise[slot] / found.samples.max(1) as f64)
        };
        let (r, window) = (self.speed.len(), material.window);
        let (of_torques, of_motion) = self.variances.split_at_mut(self.torques.len());
        for (k, (angle, speed)) in plant.sensors.iter().enumerate() {
            let mut set = |part: usize, variance: f64| of_motion[part * r + k] = variance;
            if let Some(slot) = angle {
                let (found, variance) = reading(*slot);
                (self.position[k], self.speed[k], self.acceleration[k]) = (found.value, found.first, found.second);
                let of_speed = variance * Reading::FIRST_GAIN / powi(window, 2);
                set(POSITION, variance * Reading::VALUE_GAIN);
                set(SPEED, of_speed);
                set(ACCELERATION, variance * Reading::SECOND_GAIN / powi(window, 4));
                // ∫k k'' = −∫k'²
                set(CROSS, -of_speed);
            }
            if let Some(slot) = speed {
                let (found, variance) = reading(*slot);
                (self.speed[k], self.acceleration[k]) = (found.value, found.first);
                set(SPEED, variance * Reading::VALUE_GAIN);
                set(ACCELERATION, variance * Reading::FIRST_GAIN / powi(window, 2));
                set(CROSS, 0.0);
            }
        }
        for (k, slot) in plant.torques.iter().enumerate() {
            if let Some(slot) = slot {
                let (found, variance) = reading(*slot);
                self.torques[k] = found.value;
                of_torques[k] = variance * Reading::VALUE_GAIN;
            }
        }
        for (value, (_, slot)) in self.harmonics.iter_mut().zip(&plant.harmonics) {
            *value = reading(*slot).0.value;
        }
        whole
    }
}

/// The steady segments of all windows, each a sample.
pub(super) fn settled(built: &Built, request: &FitRequest, window: f64) -> Samples {
    let mut steadiness: Steadiness = request.steadiness;
    if let Some(shortest) = request.shortest {
        steadiness.windows = (shortest / window).ceil().max(1.0) as usize;
    }
    built.samples.averaged(&steady_segments(&built.samples, &built.noise[2], steadiness))
}
