//! The table of the virtual test bench.

use kardan_math::units::Dimension;
use kardan_schema::schema::{Sign, choice, keys};

choice! {
    /// How the motors of a bench move the plant.
    ExcitationPlan {
        /// From one constant speed to the next.
        ConstantSpeeds = "constant_speeds",
        /// By sums of sines.
        Multisine = "multisine",
        /// By random steps of the speeds.
        RandomSteps = "random_steps",
    }
}

keys! {
    /// `[bench]`.
    table Bench {
        optional {
            truth: Overrides,
                "True values of the plant on the bench, unknown to its model: values of parameters and of keys of \
                 elements, also keys that the file does not give: { \"wg.damping\" = \"0.001 N m s/rad\", \
                 \"hd.stiffness\" = \"8000 N m/rad\" }. Left out: drawn from `seed`, each inertia, damping and \
                 friction within `spread` of its value.";
            spread: Number(Sign::NonNegative) = "0.1",
                "How far drawn true values may be from those of the file, as a part of them, below 1.";
            sample_time: Quantity(Dimension::TIME, Sign::Period) = "1 ms",
                "Time between two rows of a log, and between two commands of the servo loops.";
            seed: Number(Sign::NonNegative) = "1",
                "Whole number that noise, drawn true values and drawn excitations come from.";
            plan: Choice(ExcitationPlan::NAMES) = "constant_speeds",
                "How the motors move the plant: from one constant speed to the next, by sums of sines, or by random \
                 steps of the speeds.";
            parameters: Signals,
                "Parameters that the log is to identify best, such as [\"wg.damping\", \"fs.friction\"]; left out: \
                 every inertia, damping, stiffness and friction that this kind of motion can identify at all.";
            signals: Signals,
                "What is logged; left out: the angles of all shafts with an encoder (else of the coordinates), the \
                 torques of all motors, and the torque sensors.";
            speed_limit: Overrides,
                "Largest speed of a shaft or a mass either way: { wg = \"60 rad/s\", cs = \"1 rad/s\" }; each \
                 coordinate needs one. Torques stay within four fifths of the limits of the motors.";
            least_speed: Overrides,
                "Least speed of a shaft at a constant speed, below which it would creep: { fs = \"0.5 rad/s\" }; left \
                 out: a twentieth of its `speed_limit`, if it has friction.";
            speeds: Lists,
                "Grid of constant speeds, by coordinate: { wg = [\"-60 rad/s\", \"60 rad/s\"], cs = [\"1 rad/s\", \"2 \
                 rad/s\"] }; signs are as written. Left out, and for coordinates without a list: `levels` speeds.";
            levels: Number(Sign::Positive) = "8",
                "Speeds of each coordinate from which set points are chosen, evenly from limit to limit, a whole \
                 number from 2 to 50.";
            points: Number(Sign::Positive),
                "Set points (of sines and steps: sections of their own) that the plan chooses, a whole number up to \
                 1000; left out: 16, and of a grid of `speeds` all.";
            dwell: Quantity(Dimension::TIME, Sign::Positive),
                "Shortest time at each constant speed, or length of a section of sines or steps; left out: 1 s, and 4 \
                 s. Constant speeds last up to half as long again, drawn from the seed, so that ripple does not \
                 synchronise with them.";
            ramp: Quantity(Dimension::TIME, Sign::Positive) = "0.5 s", "Shortest time from one speed to the next.";
            duration: Quantity(Dimension::TIME, Sign::Positive) = "10 min",
                "Longest log; kardan rejects a longer plan.";
            torque_noise: Quantity(Dimension::TORQUE, Sign::NonNegative) = "0 N m",
                "Standard deviation of the noise in the logged torques of the motors; that of sensors is their own \
                 `noise`.";
            bandwidth: Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive),
                "Triple pole of the servo loops that play the plan, at most 0.3 in a sample time; left out: 30 rad/s, or that most.";
        }
    }
}
