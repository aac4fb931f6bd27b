//! The tables of runs: scenario, events, faults and variants.

use kardan_math::units::Dimension;
use kardan_schema::schema::{Sign, keys};

keys! {
    /// `[scenario]`.
    table Scenario {
        optional {
            duration: Quantity(Dimension::TIME, Sign::Positive) = "1 s", "Length of the run.";
            output_step: Quantity(Dimension::TIME, Sign::Positive) = "1 ms",
                "Time between rows of the results, a twentieth of it during 20 steps after each event.";
            relative_tolerance: Number(Sign::Positive) = "1e-10",
                "Relative error allowed per integration step, from 1e-13 to 1e-3.";
            initial: Overrides,
                "Initial angles and speeds (of masses positions and velocities, in a circuit charges and currents), \
                 of any of them: { \"rk.phi\" = \"10 deg\" }. The others follow from the constraints. Undetermined \
                 values are zero; beside constraints enforced by multipliers they are as near to zero as these allow \
                 (in SI units).";
            start: Choice(&["initial", "equilibrium", "operating_point"]) = "initial",
                "Where the run begins: at the angles of `initial`, at the equilibrium that Newton's method finds from \
                 there, without inputs and friction, or at the operating point of the controllers; the run reports \
                 which one, and what of it is proven.";
            seed: Number(Sign::NonNegative) = "1",
                "Seed of the `noise` of sensors, a whole number: the same seed gives the same noise.";
            event: Tables(Event), "Steps and ramps of signals: `[[scenario.event]]`.";
            signals: Functions,
                "Functions of time added to references, disturbances, motor torques and voltages: expressions of the \
                 time `t`, parameters and the signals of `[signal.NAME]`: { load = \"knocks + 2 N m * sin(2 pi t / 1 \
                 s)\" }.";
            fault: Tables(Fault), "Sensors, motors and control units that fail: `[[scenario.fault]]`.";
        }
    }
}

keys! {
    /// `[[scenario.event]]`.
    table Event {
        required {
            at: Quantity(Dimension::TIME, Sign::NonNegative), "When it happens (or the ramp begins).";
            signal: Signal,
                "A reference, a disturbance, `<motor>.tau` of a motor without a law, `<voltage_source>.v`, or `<current_source>.i` of one without \
                 `current`, in ramps.";
            to: AnyQuantity, "The new value.";
        }
        optional {
            over: Quantity(Dimension::TIME, Sign::NonNegative), "Length of a ramp to the new value; left out: a step.";
        }
    }
}

keys! {
    /// `[[scenario.fault]]`, `[fault.NAME]`.
    table Fault {
        required {
            at: Quantity(Dimension::TIME, Sign::Positive), "When it begins: after the start of the run, which has no fault.";
        }
        optional {
            sensor: Text,
                "A sensor that a controller with a sample time, or a block, reads, by its name or as written there: `wg_encoder`, `rk.phi`. Give one of `sensor`, `motor`, `control` and `element`.";
            motor: Text, "A motor.";
            control: Text, "A controller with a sample time: its control unit fails.";
            element: Text, "A spring_damper, or an element with compliant teeth (`stiffness`): a bar breaks, teeth skip.";
            kind: Choice(&[
                "lost", "stuck", "offset", "drift", "noise", "reversed", "dead", "reduced", "braking", "undervoltage",
                "reset", "missed", "stale", "jitter", "broken", "jump",
            ]),
                "Of a sensor `lost`, if left out (no number: the controller uses the last good one), `stuck` at its \
                 last reading, `offset`, `drift`, `noise` or `reversed` in sign; of a motor `dead`, if left out, \
                 `reduced`, `reversed`, `stuck` at its last torque, `braking` (short-circuited windings) or \
                 `undervoltage` (a part of its torque limit remains); of a controller `reset`, if left out (it \
                 commands zero until the end, then restarts), `missed` (it computes nothing, its commands stay \
                 constant), `stale` (no new readings arrive) or `jitter` (its commands take effect late); of an \
                 element `broken`, if left out (its spring and damper have no torque any more), or `jump` (its spring \
                 continues with another relaxed angle: teeth skip). `broken` and `jump` are permanent.";
            value: AnyQuantity,
                "How much: the offset, the drift per second, or the standard deviation of the noise, in the unit of \
                 the reading; the part that remains of a torque (`reduced`) or of a limit (`undervoltage`); the \
                 braking torque per speed; the largest jitter, drawn evenly from zero to it for each sample; the \
                 angle or distance that teeth skip by, at their spring.";
            until: Quantity(Dimension::TIME, Sign::Positive), "When it ends; left out: never.";
        }
    }
}

keys! {
    /// `[[variant]]`.
    table Variant {
        required {
            name: Name, "Name of the variant: it names the table of its run.";
        }
        optional {
            set: Overrides,
                "Parameter values that make it: { step = \"1 rad\", friction = \"0 N m\" }; left out: those of the \
                 file.";
            manoeuvre: Text,
                "The manoeuvre that it drives, `[manoeuvre.NAME]`: its length, its signal, its parameter values, its figures and criteria. Where a \
                 file has manoeuvres and no variant, each manoeuvre is one.";
            controls: Names,
                "The controllers that are in the loop; left out: all. So controllers for the same motors can be \
                 compared.";
            faults: Names, "Names of `[fault.NAME]` that happen in it; left out: none.";
        }
    }
}
