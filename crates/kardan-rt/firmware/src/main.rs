//! Firmware in small: each block of kardan-rt runs once, in both precisions, on data that the compiler cannot see through.
//!
//! The panic handler calls a function that nobody defines. As long as one path leads to a panic, the program does not link:
//! `undefined reference to kardan_rt_has_a_panic_path`.
#![no_std]
#![no_main]

use core::hint::black_box;

use kardan_rt::{
    Bounds, Channel, ComputedTorque, DeadZone, Delay, Gain, Governor, Hysteresis, Integrator, Manual, Measurement,
    Mechanism, ModelObserver, Monitor, Noninteracting, Observer, Operator, Pid, Plan, PositionLoop, RateLimit, Regulator,
    RegulatorState, Row, Run, Saturation, Schedule, ScheduledRegulator, Sensor, Situation, StateMachine, StateSpace,
    Table, Task, TransferFunction, Transition, hold,
};

// On a computer with an operating system the C library brings the entry point and `memcpy`.
#[cfg_attr(not(target_os = "none"), link(name = "c"))]
unsafe extern "C" {
    safe fn kardan_rt_has_a_panic_path() -> !;
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    kardan_rt_has_a_panic_path()
}

/// Numbers of any count, as far as the compiler knows.
macro_rules! any {
    ($values:expr) => {
        black_box(&$values[..])
    };
}

macro_rules! any_mut {
    ($values:expr) => {
        black_box(&mut $values[..])
    };
}

macro_rules! blocks {
    ($name:ident, $number:ty) => {
        /// How many of the blocks gave an answer.
        #[inline(never)]
        fn $name() -> i32 {
            type T = $number;
            let mut good_count = 0i32;
            let mut count = |good: bool| good_count = good_count.wrapping_add(i32::from(black_box(good)));
            let x: &[T] = any!([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]);
            let y: &[T] = any!([0.8, 0.7, 0.6, 0.5]);
            let mut out = [0.0 as T; 16];
            let mut memory = [0.0 as T; 256];

            // Gains, loops and bounds.
            let loops = PositionLoop { natural_frequency: black_box(20.0 as T), damping_ratio: black_box(0.7) };
            count(loops.acceleration(1.0, 0.5, 0.1, black_box(0.0)).is_some());
            let channels = [
                Channel::Position { position_loop: loops, inverse_inertia: black_box(2.0) },
                Channel::Torque { inverse_inertia: black_box(0.5) },
            ];
            let channels = any!(channels);
            for channel in channels {
                count(channel.acceleration(1.0, 0.5, 0.1, black_box(0.0)).is_some());
            }
            let gain = |entries, columns| Gain::new(entries, black_box(columns));
            let (Some(square), Some(wide)) = (gain(y, 2), gain(x, 4)) else { return 0 };
            count(square.add_to(x, any_mut!(out)));
            let bounds = Bounds { torque: black_box(Some(1.3 as T)), change: black_box(Some(0.1)) };
            count(bounds.nearest(black_box(2.0), 1.0).is_finite());
            count(hold(x, any_mut!(out)) == 0);
            // Linear laws.
            let law = Noninteracting { state_gain: wide, acceleration_gain: square, channels };
            let measured = Measurement { state: x, positions: x, speeds: x, references: x, loads: x };
            count(law.torques(measured, any_mut!(memory), any_mut!(out)));
            if let Some(block) = StateSpace::new(y, y, y, y, black_box(2), black_box(2)) {
                count(block.outputs(x, y, any_mut!(out)));
                count(block.rates(x, y, any_mut!(out)));
                count(block.step(any_mut!(out), x, any_mut!(memory)));
            }
            let governor = Governor { on_state: square, on_model: square, on_references: square, bounds: x };
            count(governor.govern(x, x, y, any_mut!(out)));
            let bounds = [bounds, bounds];
            let regulator = Regulator {
                prediction: square,
                input: square,
                output: square,
                correction: square,
                model: square,
                model_input: square,
                feedback: wide,
                bounds: any!(bounds),
                governor: black_box(Some(governor)),
            };
            let (mut estimate, mut model, mut readings) = ([0.0 as T; 2], [0.0 as T; 2], [0.0 as T; 2]);
            let (mut references, mut commands) = ([0.0 as T; 2], [0.0 as T; 2]);
            let own = RegulatorState {
                estimate: any_mut!(estimate),
                model: any_mut!(model),
                readings: any_mut!(readings),
                references: any_mut!(references),
                commands: any_mut!(commands),
                work: any_mut!(memory),
            };
            count(!regulator.step(x, y, own).estimate_frozen);

            let Some(schedule) = Schedule::new(x, black_box(4), black_box(3.0)) else { return 0 };
            count(schedule.at(black_box(1e9), any_mut!(out)));

            // Laws and observers on the nonlinear model.
            let entries = [(0, 1.0 as T), (1, 1.0), (2, 1.0)];
            let row = |first| Row { first: black_box(first), count: black_box(1) };
            let numbers = [0usize, 1];
            // Every operation once, behind four inputs and three constants; no inertia but on the diagonal.
            let run = |operator| Run { operator, count: black_box(1) };
            let runs = [
                run(Operator::Add),
                run(Operator::Subtract),
                run(Operator::Multiply),
                run(Operator::Divide),
                run(Operator::AddProduct),
                run(Operator::SubtractProduct),
                run(Operator::Negate),
                run(Operator::Absolute),
                run(Operator::SquareRoot),
                run(Operator::SineCosine),
                run(Operator::Tangent),
                run(Operator::ArcSine),
                run(Operator::ArcCosine),
                run(Operator::ArcTangent),
                run(Operator::ArcTangent2),
                run(Operator::Exponential),
                run(Operator::Logarithm),
                run(Operator::Minimum),
                run(Operator::Maximum),
                run(Operator::Select),
                run(Operator::Table),
            ];
            let operands = [
                0u32, 1, 2, 3, 0, 2, 1, 6, 0, 1, 2, 3, 1, 2, 0, 1, 2, 3, 2, 0, 1, 1, 3, 0, 1, 2, 0, 1, 2, 3, 0, 1, 2,
                3, 0, 2,
            ];
            let outputs = [
                0u32, 1, 7, 2, 3, 8, 4, 4, 9, 5, 4, 4, 5, 16, 4, 6, 4, 4, 6, 10, 11, 12, 4, 5, 4, 4, 5, 16, 17, 18, 19,
                20, 21, 22, 23, 24, 25, 26, 27, 28, 13, 14, 15, 4, 4, 4, 4, 4, 4, 4, 5,
            ];
            let tables = [Table { first: black_box(0), pieces: black_box(2), terms: black_box(1) }];
            let plan = Plan {
                inputs: black_box(4),
                constants: any!([0.0 as T, 1.0, 2.0]),
                runs: any!(runs),
                operands: any!(operands),
                outputs: any!(outputs),
                tables: any!(tables),
                numbers: x,
            };
            let mechanism = Mechanism {
                shafts: black_box(3),
                coordinates: black_box(2),
                cuts: black_box(0),
                inputs: black_box(2),
                frictions: x,
                plan,
            };
            count(mechanism.evaluate(x, y, any_mut!(memory)).is_some());
            let tasks = [
                Task::Position { shaft: black_box(2), position_loop: loops },
                Task::Torque { shaft: black_box(1) },
                Task::ConstraintTorque { cut: black_box(0) },
            ];
            let law = ComputedTorque {
                mechanism,
                tasks: any!(tasks),
                inputs: any!(numbers),
                friction_width: black_box(Some(0.1)),
            };
            let now = Situation { position: x, speed: y, references: x, disturbances: y };
            count(law.memory() < black_box(256) && law.torques(now, any_mut!(memory), any_mut!(out)));
            let sensors = [Sensor { row: row(2), speed: black_box(false), rest: black_box(0.1 as T) }];
            let scheduled = ScheduledRegulator {
                schedule,
                coordinate: black_box(0),
                model: square,
                model_input: square,
                bounds: any!(bounds),
                governor_bounds: x,
                mechanism,
                sensors: any!(sensors),
                entries: any!(entries),
            };
            let own = RegulatorState {
                estimate: any_mut!(estimate),
                model: any_mut!(model),
                readings: any_mut!(readings),
                references: any_mut!(references),
                commands: any_mut!(commands),
                work: any_mut!(out),
            };
            count(scheduled.scratch(2, 2, 2, black_box(2)) < black_box(256));
            count(!scheduled.step(x, y, own, any_mut!(memory)).estimate_frozen);
            let observer = ModelObserver {
                mechanism,
                inputs: any!(numbers),
                sensors: any!(sensors),
                entries: any!(entries),
                disturbances: any!(numbers),
                gain: x,
                zoh_integral: x,
                friction_width: black_box(Some(0.1)),
            };
            count(observer.rates(x, y, y, any_mut!(memory), any_mut!(out)));
            count(observer.step(any_mut!(out), y, y, any_mut!(memory)));
            // Signals.
            let mut two = black_box([0.0 as T; 2]);
            let mut one = black_box([0.0 as T; 1]);
            let input = black_box(0.3 as T);
            count(Saturation { low: black_box(Some(-1.0)), high: Some(1.0) }.step(input, &mut one));
            count(DeadZone { low: black_box(-1.0), high: 1.0 }.step(input, &mut one));
            count(Hysteresis { upper: black_box(2.0), lower: 1.0, levels: [0.0, 1.0] }.step(input, &mut two));
            count(RateLimit { rise: black_box(0.1), fall: 0.2 }.step(input, &mut two));
            count(Delay.step(input, any_mut!(memory)));
            let sum = Integrator { sample_time: black_box(0.001), low: Some(-1.0), high: black_box(None) };
            count(sum.step(input, 0.0, 0.0, &mut two) && sum.step_trapezoidal(input, 0.0, 0.0, &mut two));
            count(Monitor { threshold: black_box(1.0), debounce: 2.0, hold: 3.0 }.step(input, &mut two));
            let pid = Pid {
                proportional: black_box(2.0 as T),
                integral: Some(3.0),
                derivative: 0.1,
                filter: 0.01,
                weights: [1.0, 0.0],
                bounds: black_box([Some(-1.0), None]),
                tracking: 0.1,
                sample_time: 0.001,
            };
            let mut five = black_box([0.0 as T; 5]);
            count(pid.step(input, 0.1, Manual { on: input, value: 0.0 }, &mut five));
            count(TransferFunction { numerator: x, denominator: y }.step(input, any_mut!(memory)));
            let observer = Observer { a: x, b: y, c: x, gain: y };
            count(observer.step(x, y, any_mut!(memory)));
            let transitions = [Transition { from: 0, to: 1 }, Transition { from: 1, to: 0 }];
            count(StateMachine { transitions: any!(transitions) }.step(x, &mut two));
            good_count
        }
    };
}

blocks!(single, f32);
blocks!(double, f64);

/// Where the linker begins. Gives the number of blocks that answered, so that nothing is left out.
#[unsafe(no_mangle)]
pub extern "C" fn main() -> i32 {
    #[cfg(feature = "a_panic_path")]
    return [1, 2][black_box(2)];
    #[cfg(not(feature = "a_panic_path"))]
    return single().wrapping_add(double());
}
