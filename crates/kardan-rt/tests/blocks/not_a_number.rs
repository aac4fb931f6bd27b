//! The promise of every block: what is no number is told, the last answer is kept, and the next good sample is as good as any.
//!
//! One harness walks all blocks in both precisions: each input in turn is NaN, infinite or huge, at each of some samples.

use kardan_rt::{
    Bounds, Channel, ComputedTorque, DeadZone, Delay, Gain, Governor, Hysteresis, Integrator, Manual, Measurement,
    Mechanism, ModelObserver, Monitor, Noninteracting, Observer, Operator, Pid, Plan, PositionLoop, RateLimit, Real,
    Regulator, RegulatorState, Row, Run, Saturation, Schedule, ScheduledRegulator, Sensor, Situation, StateMachine,
    StateSpace, Task, TransferFunction, Transition, hold,
};
use std::fmt::Debug;

/// What the tests need of a precision beside what the blocks do.
trait Number: Real + Debug + 'static {
    const BAD: [Self; 3];
    const HUGE: [Self; 4];
    fn of(x: f64) -> Self;
}

impl Number for f32 {
    const BAD: [Self; 3] = [Self::NAN, Self::INFINITY, Self::NEG_INFINITY];
    const HUGE: [Self; 4] = [Self::MAX, Self::MIN, 2e19, -2e19];
    fn of(x: f64) -> Self {
        x as Self
    }
}

impl Number for f64 {
    const BAD: [Self; 3] = [Self::NAN, Self::INFINITY, Self::NEG_INFINITY];
    const HUGE: [Self; 4] = [Self::MAX, Self::MIN, 2e154, -2e154];
    fn of(x: f64) -> Self {
        x
    }
}

/// What a block does with an input that is no number.
#[derive(Clone, Copy, PartialEq)]
enum Retains {
    /// The answer of the sample before stays, as if there had been no sample.
    Output,
    /// The input of the sample before stays in its place.
    Input,
}

/// A block with its memory: one sample tells whether all was well.
type Step<T> = Box<dyn FnMut(&[T], &mut Vec<T>) -> bool>;

struct Case<T> {
    /// `Type::function` of the crate.
    name: &'static str,
    retains: Retains,
    /// How many inputs there are.
    inputs: usize,
    /// A block at its start; its answer grows in the vector, whose entries stay from sample to sample.
    start: Box<dyn Fn() -> Step<T>>,
}

fn list<T: Number, const N: usize>(values: [f64; N]) -> Vec<T> {
    values.iter().map(|x| T::of(*x)).collect()
}

/// The answer is what the block gives, or stays.
fn take<T: Number>(found: Option<T>, out: &mut Vec<T>) -> bool {
    out.resize(1, T::ZERO);
    if let Some(found) = found {
        out[0] = found;
    }
    found.is_some()
}

fn position_loop<T: Number>() -> PositionLoop<T> {
    PositionLoop { natural_frequency: T::of(3.0), damping_ratio: T::of(0.5) }
}

/// Two bodies, one of which drives a third by `y = q + 0.1 sin q`; a spring between the last two, a damper and friction on the third, one motor
/// on each of the first.
struct Machine<T> {
    entries: Vec<(usize, T)>,
    constants: Vec<T>,
    frictions: Vec<T>,
}

/// The operations behind places 0 to 3 (angles and speeds) and 4 to 9 (constants).
const RUNS: [Run; 13] = {
    const fn run(operator: Operator, count: usize) -> Run {
        Run { operator, count }
    }
    [
        run(Operator::SineCosine, 1), // 10, 11: sin q, cos q
        run(Operator::Multiply, 2),   // 12, 13: 0.1 sin q, 0.1 cos q
        run(Operator::Add, 2),        // 14, 15: y, y′
        run(Operator::Multiply, 3),   // 16, 17, 18: ẏ, w², y′²
        run(Operator::Multiply, 2),   // 19, 20: 0.1 sin q w², 0.5 y′²
        run(Operator::Negate, 1),     // 21: the bias of y
        run(Operator::Add, 1),        // 22: the inertia of q
        run(Operator::Subtract, 1),   // 23: the twist
        run(Operator::Multiply, 3),   // 24, 25, 26: 5 twist, 0.5 ẏ, 0.5 bias
        run(Operator::Multiply, 3),   // 27, 28, 29: times y′
        run(Operator::Add, 1),        // 30: spring and damper
        run(Operator::Negate, 2),     // 31, 32: their force, the centrifugal one
        run(Operator::Add, 1),        // 33: both
    ]
};
#[rustfmt::skip]
const OPERANDS: [u32; 42] = [
    0, 6, 10, 6, 11, 0, 12, 5, 13, 15, 2, 2, 2, 15, 15, 12, 17, 9, 18, 19, 7, 20, 14, 1, 8, 23, 9, 16, 9, 21, 15, 24, 15, 25, 15, 26,
    27, 28, 30, 29, 31, 32,
];
const OUTPUTS: [u32; 30] =
    [0, 1, 14, 2, 3, 16, 4, 4, 21, 5, 4, 4, 5, 15, 4, 22, 4, 4, 5, 33, 24, 32, 4, 5, 4, 4, 5, 15, 4, 16];

impl<T: Number> Machine<T> {
    fn new() -> Self {
        Self {
            entries: vec![(0, T::ONE), (1, T::ONE), (2, T::ONE)],
            constants: list([0.0, 1.0, 0.1, 2.0, 5.0, 0.5]),
            frictions: list([0.5]),
        }
    }

    fn block(&self) -> Mechanism<'_, T> {
        let plan = Plan {
            inputs: 4,
            constants: &self.constants,
            runs: &RUNS,
            operands: &OPERANDS,
            outputs: &OUTPUTS,
            tables: &[],
            numbers: &[],
        };
        Mechanism { shafts: 3, coordinates: 2, cuts: 0, inputs: 2, frictions: &self.frictions, plan }
    }
}

/// Every public function of the crate that computes.
#[allow(clippy::too_many_lines)]
fn cases<T: Number>() -> Vec<Case<T>> {
    let mut cases: Vec<Case<T>> = Vec::new();
    let mut case = |name, retains, inputs, start: Box<dyn Fn() -> Step<T>>| {
        cases.push(Case { name, retains, inputs, start });
    };
    case(
        "Bounds::nearest",
        Retains::Output,
        1,
        Box::new(|| {
            let bounds = Bounds { torque: None, change: None };
            Box::new(move |x, out| {
                out.resize(1, T::ZERO);
                let before = out[0];
                out[0] = bounds.nearest(x[0], before);
                // That the answer is another one tells.
                out[0] == x[0]
            })
        }),
    );
    for kind in [false, true] {
        case(
            "Channel::acceleration",
            Retains::Output,
            4,
            Box::new(move || {
                let inverse_inertia = T::of(4.0);
                let channel = match kind {
                    true => Channel::Position { position_loop: position_loop(), inverse_inertia },
                    false => Channel::Torque { inverse_inertia },
                };
                Box::new(move |x, out| take(channel.acceleration(x[0], x[1], x[2], x[3]), out))
            }),
        );
    }
    for name in ["Plan::evaluate", "Plan::output"] {
        case(
            name,
            Retains::Output,
            2,
            Box::new(|| {
                Box::new(|x, out| {
                    let constants = [T::of(3.0)];
                    let run = |operator| Run { operator, count: 1 };
                    // 3 + x₀ sin x₁
                    let plan = Plan {
                        inputs: 2,
                        constants: &constants,
                        runs: &[run(Operator::SineCosine), run(Operator::AddProduct)],
                        operands: &[1, 0, 3, 2],
                        outputs: &[5],
                        tables: &[],
                        numbers: &[],
                    };
                    let mut workspace = vec![T::ZERO; plan.memory()];
                    plan.begin(&mut workspace);
                    workspace[..2].copy_from_slice(x);
                    let found = plan.evaluate(&mut workspace).then(|| plan.output(0, &workspace)).flatten();
                    take(found, out)
                })
            }),
        );
    }
    case(
        "PositionLoop::acceleration",
        Retains::Output,
        4,
        Box::new(|| Box::new(|x, out| take(position_loop().acceleration(x[0], x[1], x[2], x[3]), out))),
    );
    case(
        "Gain::add_to",
        Retains::Output,
        2,
        Box::new(|| {
            let entries: Vec<T> = list([1.0, 2.0, -3.0, 0.5]);
            Box::new(move |x, out| {
                let mut sum = list::<T, 2>([0.25, -1.0]);
                let good = Gain::new(&entries, 2).unwrap().add_to(x, &mut sum);
                out.resize(2, T::ZERO);
                if good {
                    out.copy_from_slice(&sum);
                } else {
                    assert_eq!(sum, list::<T, 2>([0.25, -1.0]), "something was added all the same");
                }
                good
            })
        }),
    );
    case(
        "Noninteracting::torques",
        Retains::Output,
        12,
        Box::new(|| {
            let gains: Vec<T> = list([1.0, -2.0, 0.5, 0.0, 3.0, 1.0, -1.0, 2.0, 0.25, 0.0, 1.0, -4.0]);
            Box::new(move |x, out| {
                out.resize(2, T::ZERO);
                let inverse_inertia = T::of(0.5);
                let channels = [
                    Channel::Position { position_loop: position_loop(), inverse_inertia },
                    Channel::Torque { inverse_inertia },
                ];
                let law = Noninteracting {
                    state_gain: Gain::new(&gains[..8], 4).unwrap(),
                    acceleration_gain: Gain::new(&gains[8..], 2).unwrap(),
                    channels: &channels,
                };
                let measured = Measurement {
                    state: &x[..4],
                    positions: &x[4..6],
                    speeds: &x[6..8],
                    references: &x[8..10],
                    loads: &x[10..],
                };
                law.torques(measured, &mut [T::ZERO; 2], out)
            })
        }),
    );
    let block: Vec<T> = list([0.5, 0.1, 0.0, 0.25, 1.0, 0.0, 0.0, 1.0, 2.0, 1.0, 0.0, 0.5]);
    for what in ["StateSpace::outputs", "StateSpace::rates", "StateSpace::step"] {
        let data = block.clone();
        case(
            what,
            Retains::Output,
            if what == "StateSpace::step" { 2 } else { 4 },
            Box::new(move || {
                let data = data.clone();
                Box::new(move |x, out| {
                    let of = |rows: std::ops::Range<usize>| &data[rows];
                    let block = StateSpace::new(of(0..4), of(4..8), of(8..10), of(10..12), 2, 2).unwrap();
                    match what {
                        "StateSpace::outputs" => {
                            out.resize(1, T::ZERO);
                            block.outputs(&x[..2], &x[2..], out)
                        }
                        "StateSpace::rates" => {
                            out.resize(2, T::ZERO);
                            block.rates(&x[..2], &x[2..], out)
                        }
                        _ => {
                            out.resize(2, T::ZERO);
                            block.step(out, x, &mut [T::ZERO; 2])
                        }
                    }
                })
            }),
        );
    }
    case(
        "Governor::govern",
        Retains::Output,
        4,
        Box::new(|| {
            let rows: Vec<T> = list([1.0, 0.5, 2.0, 0.3, -1.0, 0.2, 0.7, -2.0]);
            let bounds: Vec<T> = list([1e6, 1e6]);
            Box::new(move |x, out| {
                out.resize(2, T::ZERO);
                let governor = Governor {
                    on_state: Gain::new(&rows[..2], 1).unwrap(),
                    on_model: Gain::new(&rows[2..4], 1).unwrap(),
                    on_references: Gain::new(&rows[4..], 2).unwrap(),
                    bounds: &bounds,
                };
                let mut moved = out.clone();
                let limited = governor.govern(&x[..1], &x[1..2], &x[2..], &mut moved);
                // Each reference is governed on its own: one that is no number does not hold the other back.
                if limited && x.iter().any(|x| !x.is_finite()) {
                    assert!(moved.iter().zip(&*out).any(|(new, old)| new == old));
                } else {
                    out.copy_from_slice(&moved);
                }
                assert!(moved.iter().all(|x| x.is_finite()), "{moved:?}");
                !limited
            })
        }),
    );
    case(
        "Mechanism::evaluate",
        Retains::Output,
        4,
        Box::new(|| {
            let machine = Machine::new();
            Box::new(move |x, out| {
                let mechanism = machine.block();
                let mut workspace = vec![T::ZERO; mechanism.memory()];
                let found = mechanism.evaluate(&x[..2], &x[2..], &mut workspace);
                if let Some(now) = found {
                    let forces = [now.passive, now.centrifugal, now.friction_speeds];
                    *out = [
                        [now.angles, now.speeds, now.bias].concat(),
                        [now.basis, now.inertia].concat(),
                        forces.concat(),
                    ]
                    .concat();
                }
                found.is_some()
            })
        }),
    );
    for friction_width in [None, Some(T::of(0.1))] {
        case(
            "ComputedTorque::torques",
            Retains::Output,
            9,
            Box::new(move || {
                let machine = Machine::new();
                Box::new(move |x, out| {
                    out.resize(2, T::ZERO);
                    let tasks =
                        [Task::Position { shaft: 2, position_loop: position_loop() }, Task::Torque { shaft: 1 }];
                    let law =
                        ComputedTorque { mechanism: machine.block(), tasks: &tasks, inputs: &[0, 1], friction_width };
                    let mut workspace = vec![T::ZERO; law.memory()];
                    let now =
                        Situation { position: &x[..2], speed: &x[2..4], references: &x[4..6], disturbances: &x[6..] };
                    law.torques(now, &mut workspace, out)
                })
            }),
        );
    }
    for friction_width in [None, Some(T::of(0.1))] {
        for what in ["ModelObserver::rates", "ModelObserver::step"] {
            case(
                what,
                Retains::Output,
                if what == "ModelObserver::step" { 4 } else { 9 },
                Box::new(move || {
                    let machine = Machine::new();
                    let sensor = |first, speed| Sensor { row: Row { first, count: 1 }, speed, rest: T::of(0.1) };
                    let sensors = [sensor(2, false), sensor(1, true)];
                    let gain: Vec<T> = list([3.0, 0.5, 0.25, 2.0, 9.0, 1.0, 0.5, 4.0, 1.0, -2.0]);
                    let zoh_integral: Vec<T> = (0..25).map(|k| T::of(if k % 6 == 0 { 0.01 } else { 0.001 })).collect();
                    Box::new(move |x, out| {
                        out.resize(5, T::ZERO);
                        let observer = ModelObserver {
                            mechanism: machine.block(),
                            inputs: &[0, 1],
                            sensors: &sensors,
                            entries: &machine.entries,
                            disturbances: &[2],
                            gain: &gain,
                            zoh_integral: &zoh_integral,
                            friction_width,
                        };
                        let mut workspace = vec![T::ZERO; observer.memory()];
                        match what {
                            "ModelObserver::rates" => observer.rates(&x[..5], &x[5..7], &x[7..], &mut workspace, out),
                            _ => observer.step(out, &x[..2], &x[2..], &mut workspace),
                        }
                    })
                }),
            );
        }
    }
    case(
        "hold",
        Retains::Input,
        3,
        Box::new(|| {
            Box::new(|x, out| {
                out.resize(3, T::ZERO);
                hold(x, out) == 0
            })
        }),
    );
    for governed in [false, true] {
        case(
            "Regulator::step",
            Retains::Input,
            2,
            Box::new(move || {
                let of = |x: f64| vec![T::of(x)];
                let (a, b, c, m) = (of(2.5), of(0.1), of(1.0), of(0.8));
                let (am, bm, k) = (of(0.5), of(0.5), list::<T, 3>([0.5, -1.0, -0.5]));
                let (rows, limits) = (list::<T, 3>([-0.5, 1.0, 0.5]), of(1e3));
                // Estimate, reference model, reading, reference, and the command as the answer.
                let mut states = [of(0.0), of(0.0), of(0.0), of(0.0)];
                Box::new(move |x, out| {
                    out.resize(1, T::ZERO);
                    fn gain<T: Real>(entries: &[T], columns: usize) -> Gain<'_, T> {
                        Gain::new(entries, columns).unwrap()
                    }
                    let governor = governed.then(|| Governor {
                        on_state: gain(&rows[..1], 1),
                        on_model: gain(&rows[1..2], 1),
                        on_references: gain(&rows[2..], 1),
                        bounds: &limits,
                    });
                    let regulator = Regulator {
                        prediction: gain(&a, 1),
                        input: gain(&b, 1),
                        output: gain(&c, 1),
                        correction: gain(&m, 1),
                        model: gain(&am, 1),
                        model_input: gain(&bm, 1),
                        feedback: gain(&k, 3),
                        bounds: &[Bounds { torque: Some(T::of(1e3)), change: None }],
                        governor,
                    };
                    let [estimate, model, readings, references] = &mut states;
                    let mut work = vec![T::ZERO; Regulator::<T>::work(1, 1, 1, 1)];
                    let regulator_state =
                        RegulatorState { estimate, model, readings, references, commands: out, work: &mut work };
                    regulator.step(&x[..1], &x[1..], regulator_state) == kardan_rt::Health::default()
                })
            }),
        );
    }
    case(
        "Schedule::at",
        Retains::Output,
        1,
        Box::new(|| {
            let rows: Vec<T> = list([1.0, -2.0, 0.5, 0.25, 3.0, 4.0]);
            Box::new(move |x, out| {
                out.resize(2, T::ZERO);
                Schedule::new(&rows, 2, T::of(1.5)).unwrap().at(x[0], out)
            })
        }),
    );
    for predictions in [0, 1] {
        case(
            "ScheduledRegulator::step",
            Retains::Input,
            2,
            Box::new(move || {
                let machine = Machine::new();
                let row = |scale: f64| -> Vec<T> {
                    let square = (0..16).map(|k| if k % 5 == 0 { 0.5 * scale } else { 0.01 });
                    let input = [0.0, 0.1, 0.1, 0.0];
                    let output = [1.1 * scale, 0.0, 0.0, 0.0];
                    let correction = [0.4, 0.1, 0.2 * scale, 0.0];
                    let feedback = [0.5, -scale, 0.1, 0.2, -1.0, -0.5];
                    let forces = [0.0, 0.0, 0.0, 0.0, 0.01 * scale, 0.0, 0.0, 0.01, 0.3, 0.2];
                    let governor = [-0.5, 0.1, 0.0, 0.0, 1.0, 0.5];
                    let all = square.chain(input).chain(output).chain(correction).chain(feedback).chain(forces);
                    all.chain(governor.into_iter().take(6 * predictions)).map(T::of).collect()
                };
                let rows = [row(1.0), row(0.9), row(1.05)].concat();
                let sensors = [Sensor { row: Row { first: 2, count: 1 }, speed: false, rest: T::of(0.1) }];
                let (model, limits) = (list::<T, 1>([0.5]), list::<T, 1>([1e3]));
                // Estimate, reference model, reading, reference, and the command as the answer.
                let mut states = [vec![T::ZERO; 4], vec![T::ZERO], vec![T::ZERO], vec![T::ZERO]];
                Box::new(move |x, out| {
                    out.resize(1, T::ZERO);
                    let width = ScheduledRegulator::<T>::width(4, 1, 1, 1, 1, 2, predictions);
                    let regulator = ScheduledRegulator {
                        schedule: Schedule::new(&rows, width, T::of(3.0)).unwrap(),
                        coordinate: 0,
                        model: Gain::new(&model, 1).unwrap(),
                        model_input: Gain::new(&model, 1).unwrap(),
                        bounds: &[Bounds { torque: Some(T::of(1e3)), change: None }],
                        governor_bounds: &limits[..predictions],
                        mechanism: machine.block(),
                        sensors: &sensors,
                        entries: &machine.entries,
                    };
                    let [estimate, model, readings, references] = &mut states;
                    let mut work = vec![T::ZERO; Regulator::<T>::work(4, 1, 1, 1)];
                    let mut scratch = vec![T::ZERO; regulator.scratch(4, 1, 1, 1)];
                    let regulator_state =
                        RegulatorState { estimate, model, readings, references, commands: out, work: &mut work };
                    regulator.step(&x[..1], &x[1..], regulator_state, &mut scratch) == kardan_rt::Health::default()
                })
            }),
        );
    }
    cases.extend(signal_blocks());
    cases
}

/// A block with a memory of so many entries.
fn block<T: Number>(
    entries: usize,
    step: impl Fn(&[T], &mut [T]) -> bool + Copy + 'static,
) -> Box<dyn Fn() -> Step<T>> {
    Box::new(move || {
        let mut state = vec![T::ZERO; entries];
        Box::new(move |x, out| {
            let well = step(x, &mut state);
            out.resize(entries, T::ZERO);
            out.copy_from_slice(&state);
            well
        })
    })
}

/// What has a fixed number of entries.
fn fixed<T: Number, const M: usize>(state: &mut [T]) -> &mut [T; M] {
    state.try_into().expect("as many entries as it has")
}

fn signal_blocks<T: Number>() -> Vec<Case<T>> {
    let of = T::of;
    let retains_output = |name, inputs, start| Case { name, retains: Retains::Output, inputs, start };
    let retains_input = |name, inputs, start| Case { name, retains: Retains::Input, inputs, start };
    vec![
        retains_output(
            "Saturation::step",
            1,
            block(1, move |x, state| Saturation { low: Some(of(-0.1)), high: Some(of(0.2)) }.step(x[0], fixed(state))),
        ),
        retains_output(
            "DeadZone::step",
            1,
            block(1, move |x, state| DeadZone { low: of(-0.1), high: of(0.1) }.step(x[0], fixed(state))),
        ),
        retains_output(
            "Hysteresis::step",
            1,
            block(2, move |x, state| {
                let levels = [of(-1.0), of(2.0)];
                Hysteresis { upper: of(0.2), lower: of(0.1), levels }.step(x[0], fixed(state))
            }),
        ),
        retains_output(
            "RateLimit::step",
            1,
            block(2, move |x, state| RateLimit { rise: of(0.01), fall: of(0.02) }.step(x[0], fixed(state))),
        ),
        retains_input("Delay::step", 1, block(4, |x, state| Delay.step(x[0], state))),
        retains_output(
            "Integrator::step",
            3,
            block(2, move |x, state| {
                Integrator { sample_time: of(0.5), low: Some(of(-4.0)), high: Some(of(4.0)) }.step(
                    x[0],
                    x[1],
                    x[2],
                    fixed(state),
                )
            }),
        ),
        retains_output(
            "Integrator::step_trapezoidal",
            3,
            block(2, move |x, state| {
                let sum = Integrator { sample_time: of(0.5), low: Some(of(-4.0)), high: Some(of(4.0)) };
                sum.step_trapezoidal(x[0], x[1], x[2], fixed(state))
            }),
        ),
        // All residuals are beyond the threshold, as those are that are no numbers.
        retains_input(
            "Monitor::step",
            1,
            block(2, move |x, state| {
                Monitor { threshold: of(-1.0), debounce: of(3.0), hold: of(2.0) }.step(x[0], fixed(state))
            }),
        ),
        retains_output(
            "Pid::step",
            4,
            block(5, move |x, state| {
                let pid = Pid {
                    proportional: of(2.0),
                    integral: Some(of(3.0)),
                    derivative: of(0.5),
                    filter: of(0.1),
                    weights: [of(0.8), of(0.1)],
                    bounds: [Some(of(-3.0)), Some(of(3.0))],
                    tracking: of(0.2),
                    sample_time: of(0.1),
                };
                pid.step(x[0], x[1], Manual { on: x[2], value: x[3] }, fixed(state))
            }),
        ),
        retains_output(
            "TransferFunction::step",
            1,
            block(4, move |x, state| {
                let (numerator, denominator) = ([of(0.5), of(0.25), of(0.125)], [of(-0.5), of(0.125), of(-0.0625)]);
                TransferFunction { numerator: &numerator, denominator: &denominator }.step(x[0], state)
            }),
        ),
        retains_output(
            "Observer::step",
            3,
            block(4, move |x, state| {
                let (a, b) = (list::<T, 4>([0.9, 0.1, -0.2, 0.8]), list::<T, 2>([0.0, 0.5]));
                let (c, gain) = (list::<T, 4>([1.0, 0.0, 0.5, 1.0]), list::<T, 4>([0.5, 0.25, 0.125, 0.5]));
                Observer { a: &a, b: &b, c: &c, gain: &gain }.step(&x[..1], &x[1..], state)
            }),
        ),
        // No guard of an input holds, as those do not that are no numbers; of what is huge nothing is left after one sample.
        retains_input(
            "StateMachine::step",
            2,
            block(1, |x, state| {
                let back = Transition { from: 1, to: 0 };
                let transitions = &[Transition { from: 0, to: 1 }, back, back];
                let mut state_and_time = [state[0], T::ZERO];
                let well = StateMachine { transitions }.step(&[x[0], x[1], T::ONE], &mut state_and_time);
                state[0] = state_and_time[0];
                well
            }),
        ),
    ]
}

/// Good inputs of a sample: another number in every place and at every sample.
fn good<T: Number>(inputs: usize, sample: usize) -> Vec<T> {
    (0..inputs).map(|k| T::of(0.25 + 0.125 * (k as f64) - 0.0625 * (sample as f64))).collect()
}

fn same<T: Number>(a: &[T], b: &[T]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a == b)
}

/// Samples before and behind the bad one.
const SAMPLES: usize = 6;

fn count_checked_samples<T: Number>() -> usize {
    let mut tried = 0;
    for Case { name, retains, inputs, start } in cases::<T>() {
        for at in 1..SAMPLES {
            for input in 0..inputs {
                for (value, bad) in T::BAD.map(|x| (x, true)).into_iter().chain(T::HUGE.map(|x| (x, false))) {
                    let what = format!("{name}, input {input} = {value:?} at sample {at}");
                    let (mut block, mut twin) = (start(), start());
                    let (mut out, mut expected) = (Vec::new(), Vec::new());
                    for sample in 0..SAMPLES {
                        let fine: Vec<T> = good(inputs, sample);
                        if sample != at {
                            assert!(
                                block(&fine, &mut out) || (!bad && sample > at),
                                "{what}: a good sample is refused"
                            );
                            twin(&fine, &mut expected);
                        } else {
                            let mut wrong = fine.clone();
                            wrong[input] = value;
                            let well = block(&wrong, &mut out);
                            assert!(!(bad && well), "{what}: not told");
                            match retains {
                                Retains::Input => {
                                    wrong[input] = good::<T>(inputs, sample - 1)[input];
                                    twin(&wrong, &mut expected);
                                }
                                // A governor that holds a huge wish back moves towards it.
                                Retains::Output if well || (!bad && name == "Governor::govern") => {
                                    twin(&wrong, &mut expected);
                                }
                                Retains::Output => {}
                            }
                        }
                        assert!(out.iter().all(|x| x.is_finite()), "{what}: {out:?} at sample {sample}");
                        // What is huge and a number may stay in a memory for a while; it is finite, and it fades.
                        if bad || retains == Retains::Output {
                            assert!(same(&out, &expected), "{what}: {out:?} is not {expected:?} at sample {sample}");
                        }
                        tried += 1;
                    }
                    if !bad {
                        // The slowest mode of those with states here halves with every sample.
                        let fading = [
                            "StateSpace::step",
                            "Regulator::step",
                            "ScheduledRegulator::step",
                            "TransferFunction::step",
                            "Delay::step",
                        ];
                        let samples = if fading.contains(&name) { 1500 } else { 2 };
                        let fine: Vec<T> = good(inputs, 0);
                        let mut well = false;
                        for _ in 0..samples {
                            well = block(&fine, &mut out);
                            twin(&fine, &mut expected);
                        }
                        let near = |(a, b): (&T, &T)| (*a - *b).abs() <= T::of(1e-5);
                        assert!(well && out.iter().zip(&expected).all(near), "{what}: {out:?} for {expected:?}");
                    }
                }
            }
        }
    }
    tried
}

#[test]
fn every_block_reports_not_a_number_and_keeps_its_state() {
    assert!(count_checked_samples::<f64>() > 10_000);
    assert!(count_checked_samples::<f32>() > 10_000);
}

/// Every public function of every public type stands in the list above, or is one of those that compute nothing.
#[test]
fn the_harness_knows_every_block() {
    const NOTHING_COMPUTED: [&str; 16] = [
        // Views on matrices, and sizes of memory.
        "Gain::new",
        "StateSpace::new",
        "Mechanism::memory",
        "Operator::operands",
        "Operator::values",
        "Plan::memory",
        "Plan::begin",
        "Table::count",
        "ComputedTorque::memory",
        "ModelObserver::memory",
        "ModelObserver::states",
        "Regulator::work",
        "Schedule::new",
        "ScheduledRegulator::width",
        "ScheduledRegulator::scratch",
        // The numbers themselves.
        "Real::is_finite",
    ];
    let case_names: Vec<&str> = cases::<f64>().iter().map(|case| case.name).collect();
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let lib = std::fs::read_to_string(folder.join("lib.rs")).unwrap();
    let exported = |word: &str| {
        lib.lines()
            .filter(|line| line.starts_with("pub use"))
            .any(|line| line.split(|c: char| !c.is_alphanumeric() && c != '_').any(|other| other == word))
    };
    let mut found = Vec::new();
    // Elementary functions say NaN themselves: `tests/functions`.
    let files = |folder| std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
    for path in files(folder.clone()).chain(files(folder.join("signals"))) {
        if path.is_dir() {
            continue;
        }
        let text = std::fs::read_to_string(path).unwrap();
        let mut owner = String::new();
        for line in text.lines() {
            if line.starts_with("impl") {
                let tail = line.trim_start_matches("impl");
                let tail =
                    if tail.starts_with('<') { tail.split_once("> ").map_or(tail, |(_, tail)| tail) } else { tail };
                let tail = tail.trim_start();
                owner = tail.chars().take_while(|c| c.is_alphanumeric()).collect();
            } else if line == "}" {
                owner.clear();
            }
            let tail = line.trim_start();
            let Some(tail) = tail.strip_prefix("pub fn ").or_else(|| tail.strip_prefix("pub const fn ")) else {
                continue;
            };
            let name: String = tail.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            if owner.is_empty() {
                found.extend(exported(&name).then_some(name));
            } else if exported(&owner) {
                found.push(format!("{owner}::{name}"));
            }
        }
    }
    assert!(found.len() >= 15, "only {found:?}");
    for name in &found {
        let listed = case_names.contains(&name.as_str()) || NOTHING_COMPUTED.contains(&name.as_str());
        assert!(listed, "`{name}` is public and not in the harness: what does it do with a reading that is no number?");
    }
    for name in &case_names {
        assert!(found.iter().any(|other| other == name), "`{name}` is no function of the crate");
    }
}
