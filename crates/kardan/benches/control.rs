//! Speed of one control step, as firmware and simulation run it: `cargo bench -p kardan --bench control`. Each iteration
//! is one step, so that the times are those per step.

#[path = "../tests/sampled/runtime_blocks/observer.rs"]
mod observer;

use divan::{Bencher, black_box};
use kardan::model::builtin;
use kardan::num::Matrix;
use kardan::reduce::MechanismData;
use kardan::results::DataNumber;
use kardan::study::{self, PreparedVariant};
use kardan::synthesis::{ChannelDesign, Clock, LawRuntime, NoninteractingDesign, Observation, design_noninteracting};
use kardan_rt::{
    Bounds, Channel, ComputedTorque, Gain, Governor, Measurement, Noninteracting, PositionLoop, Real, Regulator,
    RegulatorState, Situation, StateSpace, Task,
};

/// Shows allocations beside the times; there must be none.
#[global_allocator]
static ALLOCATOR: divan::AllocProfiler = divan::AllocProfiler::system();

fn main() {
    divan::main();
}

fn variant(name: &str, number: usize) -> std::sync::Arc<PreparedVariant> {
    study::prepare(builtin(name).expect("built in").source).0.variants.remove(number)
}

fn loops<T>(to: impl Fn(f64) -> T) -> PositionLoop<T> {
    PositionLoop { natural_frequency: to(20.0), damping_ratio: to(0.7) }
}

fn shaft(variant: &PreparedVariant, name: &str) -> usize {
    variant.reduced.coordinate(name).expect("a shaft")
}

fn input(variant: &PreparedVariant, name: &str) -> usize {
    variant.design_models[0].linear.inputs.iter().position(|input| input == name).expect("an input")
}

fn sia_design(variant: &PreparedVariant) -> NoninteractingDesign {
    let channel = |output, motor| ChannelDesign { shaft: shaft(variant, output), input: input(variant, motor) };
    let channels = [channel("fs", "wg_motor"), channel("rk", "rk_motor")];
    design_noninteracting(&variant.design_models[0].linear, &channels, &|_| Default::default())
        .expect("can be decoupled")
}

/// (6.124), (6.130), (6.137) with a position loop on the rack and a torque on the wheel, on the estimate of an observer of
/// 8 states from 3 sensors and 2 motor torques, both loads fed forward.
fn sia_law_with_observer<T: Real + 'static>(bencher: Bencher, to: impl Fn(f64) -> T + Copy) {
    let variant = variant("sia-steering", 0);
    let design = sia_design(&variant);
    let list = |values: &[f64]| values.iter().map(|x| to(*x)).collect::<Vec<T>>();
    let matrix = |m: &Matrix<f64>| list(m.as_slice());
    let (on_state, on_accelerations) =
        (matrix(&design.state_gain.to_f64()), matrix(&design.acceleration_gain.to_f64()));
    let inverse: Vec<f64> = design.effective_inertia.iter().map(|j| 1.0 / kardan::num::rational_to_f64(j)).collect();
    let channels = [
        Channel::Torque { inverse_inertia: to(inverse[0]) },
        Channel::Position { position_loop: loops(to), inverse_inertia: to(inverse[1]) },
    ];
    let law = Noninteracting {
        state_gain: Gain::new(&on_state, 6).expect("whole rows"),
        acceleration_gain: Gain::new(&on_accelerations, 2).expect("whole rows"),
        channels: &channels,
    };
    let shafts = ["wg", "cs", "rk", "cj"].map(|name| shaft(&variant, name));
    let observer = observer::predictor(&variant.design_models[0].linear, shafts, 1e-4);
    let (a, b) = (list(&observer.a), list(&observer.b));
    let observer = StateSpace::new(&a, &b, &[], &[], 8, 5).expect("shapes");
    let (mut state, mut next) = ([T::ZERO; 8], [T::ZERO; 8]);
    let (mut accelerations, mut torques) = ([T::ZERO; 2], [T::ZERO; 2]);
    let signals = [0.1, -0.2, 3.0, 0.07, 0.01].map(to);
    bencher.bench_local(|| {
        let signals = black_box(signals);
        let references = black_box([to(1.0), to(0.3)]);
        let [rk, fs, _, w_rk, w_fs, _, driver, road] = state;
        let measured = Measurement {
            state: state.get(..6).unwrap_or(&[]),
            positions: &[fs, rk],
            speeds: &[w_fs, w_rk],
            references: &references,
            loads: &[driver, road],
        };
        let found = law.torques(measured, &mut accelerations, &mut torques);
        let kept = observer.step(&mut state, &signals, &mut next);
        black_box((torques, found, kept))
    });
}

#[divan::bench(sample_size = 1000)]
fn sia_law_with_observer_f64(bencher: Bencher) {
    sia_law_with_observer(bencher, |x| x);
}

#[divan::bench(sample_size = 1000)]
fn sia_law_with_observer_f32(bencher: Bencher) {
    sia_law_with_observer(bencher, |x| x as f32);
}

/// The same task by the design for 1 kHz with delay and lag: observer, reference model, governor with predictions of 2 motors at
/// up to 24 instants, bounds.
fn sia_regulator<T: Real>(bencher: Bencher, to: impl Fn(f64) -> T + Copy, governed: bool) {
    let data = variant("sia-steering-ecu", 0).designed[0].describe().controller_data;
    let rows = |name: &str| &data.matrices.iter().find(|matrix| matrix.name == name).expect("a matrix").values;
    let part = |name: &str, columns: std::ops::Range<usize>| -> Vec<T> {
        rows(name).iter().flat_map(|row| row[columns.clone()].iter().map(|x| to(*x))).collect()
    };
    let all = |name: &str| part(name, 0..rows(name)[0].len());
    let (n, k, r, p) = (rows("prediction").len(), rows("model").len(), 2, rows("output").len());
    let number = |name: &str| {
        data.numbers
            .iter()
            .find(|DataNumber { name: other, .. }| other == name)
            .map(|DataNumber { value: x, .. }| to(*x))
    };
    let bounds: Vec<Bounds<T>> = data
        .writes
        .iter()
        .map(|input| Bounds { torque: number(&format!("{input} torque_limit")), change: None })
        .collect();
    let names = ["prediction", "input", "output", "correction", "model", "model_input", "feedback"];
    let [prediction, input, output, correction, model, model_input, feedback] = names.map(all);
    let [on_state, on_model, on_references] =
        [0..n, n..n + k, n + k..n + k + r].map(|columns| part("governor", columns));
    let limits = all("governor_bounds");
    let gain = |matrix, columns| Gain::new(matrix, columns).expect("whole rows");
    let governor = Governor {
        on_state: gain(&on_state, n),
        on_model: gain(&on_model, k),
        on_references: gain(&on_references, r),
        bounds: &limits,
    };
    let block = Regulator {
        prediction: gain(&prediction, n),
        input: gain(&input, 2),
        output: gain(&output, n),
        correction: gain(&correction, p),
        model: gain(&model, k),
        model_input: gain(&model_input, r),
        feedback: gain(&feedback, n + k + r),
        bounds: &bounds,
        governor: governed.then_some(governor),
    };
    let zeros = |count: usize| vec![T::ZERO; count];
    let (mut estimate, mut states, mut readings, mut references) = (zeros(n), zeros(k), zeros(p), zeros(r));
    let (mut commands, mut work) = (zeros(2), zeros(Regulator::<T>::work(n, k, r, p)));
    // References that move, so that the governor has something to do.
    let mut sign = to(1e-3);
    bencher.bench_local(|| {
        sign = -sign;
        let memory = RegulatorState {
            estimate: &mut estimate,
            model: &mut states,
            readings: &mut readings,
            references: &mut references,
            commands: &mut commands,
            work: &mut work,
        };
        let health = block.step(black_box(&[sign; 3]), black_box(&[sign, sign]), memory);
        black_box((commands[0], health))
    });
}

#[divan::bench(sample_size = 1000)]
fn sia_regulator_f64(bencher: Bencher) {
    sia_regulator(bencher, |x| x, false);
}

#[divan::bench(sample_size = 1000)]
fn sia_regulator_f32(bencher: Bencher) {
    sia_regulator(bencher, |x| x as f32, false);
}

#[divan::bench(sample_size = 1000)]
fn sia_regulator_with_governor_f64(bencher: Bencher) {
    sia_regulator(bencher, |x| x, true);
}

#[divan::bench(sample_size = 1000)]
fn sia_regulator_with_governor_f32(bencher: Bencher) {
    sia_regulator(bencher, |x| x as f32, true);
}

/// A sample of the law as the simulation runs it, readings and memory copied: with a straight joint the block `Regulator`, with one
/// of 30 deg `ScheduledRegulator`.
fn sia_sample(bencher: Bencher, number: usize, single: bool) {
    let variant = variant("sia-steering-ecu", number);
    let law = variant.designed[0].clone();
    let clock = Clock { single, ..law.clock().expect("it is sampled") };
    let mut runtime = LawRuntime::new(law.block(Some(clock)).expect("finite"), Some(clock), law.inputs().len());
    let mut states = vec![0.0; law.states().len()];
    let (mut next, mut commands, mut sign) = (states.clone(), [0.0; 2], 1e-3);
    bencher.bench_local(|| {
        sign = -sign;
        let seen = Observation {
            time: 0.0,
            angles: &[],
            speeds: &[],
            disturbances: &[],
            references: &[sign, sign],
            readings: &[sign, 0.1, sign],
            states: black_box(&states),
        };
        runtime.command(seen, &mut commands);
        runtime.next(seen, &[], &mut next);
        states.copy_from_slice(&next);
        commands
    });
}

#[divan::bench(sample_size = 1000)]
fn sia_sample_straight_f64(bencher: Bencher) {
    sia_sample(bencher, 0, false);
}

#[divan::bench(sample_size = 1000)]
fn sia_sample_straight_f32(bencher: Bencher) {
    sia_sample(bencher, 0, true);
}

#[divan::bench(sample_size = 1000)]
fn sia_sample_scheduled_f64(bencher: Bencher) {
    sia_sample(bencher, 3, false);
}

#[divan::bench(sample_size = 1000)]
fn sia_sample_scheduled_f32(bencher: Bencher) {
    sia_sample(bencher, 3, true);
}

/// The same task on the nonlinear model with a joint angle of 20 deg, state given.
fn sia_computed_torque<T: Real>(bencher: Bencher, to: impl Fn(f64) -> T + Copy, friction: Option<T>) {
    let variant = variant("sia-steering", 2);
    let data = MechanismData::new(&variant.reduced).cast(to);
    let tasks = [
        Task::Torque { shaft: shaft(&variant, "fs") },
        Task::Position { shaft: shaft(&variant, "rk"), position_loop: loops(to) },
    ];
    let inputs = ["wg_motor", "rk_motor"].map(|name| input(&variant, name));
    let law = ComputedTorque { mechanism: data.block(), tasks: &tasks, inputs: &inputs, friction_width: friction };
    computed_torque(bencher, law, &[0.3, -0.7, 1.1].map(to), &[2.0, -3.0, 5.0].map(to), [1.0, 0.3].map(to));
}

fn computed_torque<T: Real>(
    bencher: Bencher,
    law: ComputedTorque<'_, T>,
    position: &[T],
    speed: &[T],
    references: [T; 2],
) {
    let (mut memory, mut torques) = (vec![T::ZERO; law.memory()], [T::ZERO; 2]);
    bencher.bench_local(|| {
        let now = Situation {
            position: black_box(position),
            speed: black_box(speed),
            references: &black_box(references),
            disturbances: &[],
        };
        let found = law.torques(now, &mut memory, &mut torques);
        black_box((torques, found))
    });
}

#[divan::bench(sample_size = 1000)]
fn sia_computed_torque_f64(bencher: Bencher) {
    sia_computed_torque(bencher, |x| x, None);
}

#[divan::bench(sample_size = 1000)]
fn sia_computed_torque_f32(bencher: Bencher) {
    sia_computed_torque(bencher, |x| x as f32, None);
}

#[divan::bench(sample_size = 1000)]
fn sia_computed_torque_with_friction_f64(bencher: Bencher) {
    sia_computed_torque(bencher, |x| x, Some(0.1));
}

/// (6.20)-(6.27): angle of the circular spline and constraint torque of the flexspline.
#[divan::bench(sample_size = 1000)]
fn hd_partial_computed_torque_f64(bencher: Bencher) {
    let variant = variant("harmonic-drive", 0);
    let data = MechanismData::with_cuts(&variant.reduced, &[("hd", "fs")]).expect("a cut");
    let position_loop = PositionLoop { natural_frequency: 20.0, damping_ratio: 1.0 };
    let tasks = [Task::Position { shaft: shaft(&variant, "cs"), position_loop }, Task::ConstraintTorque { cut: 0 }];
    let inputs = ["wg_motor", "cs_motor"]
        .map(|name| variant.reduced.equations.inputs.iter().position(|input| input.element == name).expect("an input"));
    let law = ComputedTorque { mechanism: data.block(), tasks: &tasks, inputs: &inputs, friction_width: None };
    computed_torque(bencher, law, &[0.3, -0.7], &[2.0, -3.0], [1.0, 0.5]);
}
