//! The tables of a model beside its elements and laws: header, scenario, requirements, plots, analysis, bench, logs.

use crate::schema::{Field, Kind, Sign, choice, keys};
use crate::units::Dimension;

/// The elements that can stick or lock, by Coulomb friction or otherwise; a test checks that they equal the registry.
pub(super) const HOLDING: &[&str] = &[
    "shaft",
    "mass",
    "harmonic_drive",
    "gear",
    "rack_and_pinion",
    "screw",
    "pulley",
    "spring_damper",
    "universal_joint",
    "clutch",
    "brake",
    "one_way_clutch",
    "lock",
    "end_stop",
];

keys! {
    /// `[model]`.
    table Header {
        required {
        }
        optional {
            name: Text = "model", "Name of the model.";
            description: Text, "A sentence for the report.";
            coordinates: Shafts(0),
                "Shafts (in a circuit: charges) to use as reduced coordinates; left out: chosen so that the equations \
                 stay well scaled.";
        }
    }
}

keys! {
    /// `[scenario]`.
    table Scenario {
        required {
        }
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
    /// `[table.NAME]`.
    table LookupTable {
        required {
        }
        optional {
            points: Lists,
                "The points of a curve: `{ x = [\"0 rad/s\", \"100 rad/s\"], value = [\"5 N m\", \"1 N m\"] }`, or of a surface: \
                 `x`, `y`, and in `value` those for all x at the first y, then at the second, and so on; left out: those of a file.";
            file: Text,
                "A log with the points (CSV, Parquet, MAT or MDF 4), by its path from the folder of the model file; a surface has a \
                 row for each point of its grid, in any order.";
            columns: Names,
                "The columns of x (and y) and of the value: [\"speed\", \"torque\"]; left out: those of the file, if there are two or three.";
            units: Names, "Units of these columns: [\"rpm\", \"N m\"]; left out: those of the file.";
            interpolation: Choice(&["linear", "cubic"]) = "linear",
                "Between two points along x: a straight line, or a cubic that is as monotone as the points are (Steffen, Astron. \
                 Astrophys. 239, 1990). Along y always a straight line.";
            extrapolation: Choice(&["hold", "linear"]) = "hold",
                "Beyond the first and the last point: constant at the value there, or a straight line with the slope there.";
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

choice! {
    /// The measures of a signal in requirements and figures.
    Measure {
        /// The largest value in the window.
        Max = "max",
        /// The smallest value.
        Min = "min",
        /// The largest in size.
        MaxAbs = "max_abs",
        /// The last value.
        Final = "final",
        /// Root of the mean of its squares over the time.
        Rms = "rms",
        /// The same around its mean.
        Ripple = "ripple",
        /// How long the motor of this torque or force, or the source of this voltage, is at its limit, s.
        TimeAtLimit = "time_at_limit",
        /// Overshoot past its target, relative to the step.
        Overshoot = "overshoot",
        /// When it enters the band around its target first, s.
        RiseTime = "rise_time",
        /// When it enters the band around its target for good, s.
        SettlingTime = "settling_time",
        /// Integral of the size of its distance from the target.
        Iae = "iae",
        /// Integral of a power, J.
        Energy = "energy",
        /// Number of events.
        Events = "events",
        /// The value at a time.
        At = "at",
        /// Its mean over the time.
        Mean = "mean",
        /// The largest value less the smallest.
        PeakToPeak = "peak_to_peak",
        /// When it is largest, from the start of the window, s.
        TimeOfMax = "time_of_max",
        /// When it is smallest.
        TimeOfMin = "time_of_min",
        /// Its slope over another signal where that crosses zero rising.
        Gradient = "gradient",
        /// The slope of the straight line that fits it best over another signal.
        Slope = "slope",
        /// How far its branches of rising and falling `over` are apart where that is zero.
        Hysteresis = "hysteresis",
        /// Amplitude at a frequency over that of another signal.
        Gain = "gain",
        /// Its delay against another signal at a frequency, s.
        Lag = "lag",
        /// The same as an angle of that wave.
        PhaseLag = "phase_lag",
    }
}

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
    /// `[[requirement]]`.
    table Requirement {
        required {
        }
        optional {
            signal: Signal,
                "The signal to judge, or an expression of signals, parameters and the time `t`: `cj.phi - cs.phi`, \
                 `motor.tau * shaft.w`; quote names with `-` there: `'my-shaft.phi'`. Give it with `measure`, or give \
                 `figure` alone.";
            measure: Choice(Measure::NAMES) as MEASURE;
            figure: Text, "The figure to judge, by its name, in place of `signal` and `measure`.";
            below: AnyQuantity, "The measure must be less than this.";
            above: AnyQuantity, "The measure must be more than this.";
            target: AnyQuantity as TARGET;
            band: AnyQuantity as BAND;
            over: Signal as OVER;
            at: Quantity(Dimension::TIME, Sign::NonNegative) as AT;
            frequency: Quantity(Dimension::FREQUENCY, Sign::Positive) as FREQUENCY;
            from: Quantity(Dimension::TIME, Sign::NonNegative) as FROM;
            until: Quantity(Dimension::TIME, Sign::Positive) as UNTIL;
            variants: Names as OF_VARIANTS;
        }
    }
}

keys! {
    /// `[[figure]]`.
    table Figure {
        required {
            name: Name, "Its name, by which other figures and requirements use it.";
        }
        optional {
            signal: Signal,
                "The signal that is measured, or an expression of signals, parameters and the time `t`. Give it with `measure`, or give `value` alone.";
            measure: Choice(Measure::NAMES) as MEASURE;
            value: Signal,
                "An expression of parameters and of earlier figures, in place of `signal` and `measure`: `peak_time * sideslip`.";
            display_unit: Text, "Unit in which it is reported, `deg/s`; left out: the SI unit.";
            target: AnyQuantity as TARGET;
            band: AnyQuantity as BAND;
            over: Signal as OVER;
            at: Quantity(Dimension::TIME, Sign::NonNegative) as AT;
            frequency: Quantity(Dimension::FREQUENCY, Sign::Positive) as FREQUENCY;
            from: Quantity(Dimension::TIME, Sign::NonNegative) as FROM;
            until: Quantity(Dimension::TIME, Sign::Positive) as UNTIL;
            variants: Names as OF_VARIANTS;
        }
    }
}

impl Requirement {
    /// A bound on a measure of a signal.
    ///
    /// ```
    /// use kardan::project::{Measure, Requirement};
    /// let _ = Requirement::on("axle.w", Measure::Max).below("50 rad/s");
    /// ```
    pub fn on(signal: impl Into<String>, measure: impl Into<String>) -> Self {
        Self::new().signal(signal).measure(measure)
    }
}

/// The measured signal.
const MEASURE: Field = Field::optional(
    "measure",
    Kind::Choice(Measure::NAMES),
    "Largest, smallest, largest in size, or last value in the window, or that `at` a time; `mean`, `peak_to_peak`; \
     `rms`: root of the mean of its squares over the time; `ripple`: the same about its mean, such as a torque at \
     rest without its static load; `time_of_max`, `time_of_min`: when, from the start of the window, s; \
     `time_at_limit`: how long in the window the motor of this torque or force, or the source of this voltage, is at \
     its limit, s. With x the signal, x0 its first value in the window, r the `target`: `overshoot`: the largest (x - \
     r)/(r - x0), at least 0; `rise_time`, `settling_time`: time from the start of the window to where |x - r| <= \
     `band` first, or for good; `iae`: the integral of |x - r| over the time; `energy`: the integral of a power over \
     the time; `events`: number of events of the element of this signal, of all of them for the signal `t`; events of \
     one located instant, such as an impact and the sticking after it, count separately. With y the signal `over`: \
     `gradient`: dx/dy where y crosses zero rising, the mean of all crossings; `slope`: that of the straight line \
     that fits x over y best; `hysteresis`: how far x where y crosses zero falling is from x where y crosses it \
     rising, means of all crossings; `gain`, `lag`, `phase_lag`: by what the waves of the `frequency` in x and y \
     differ, fitted by least squares with their means over the last whole periods of the window: ratio of amplitudes, \
     and how much later x is, in time (at most half a period either way) or as an angle. Between rows signals are \
     straight lines; the notes report a verdict that this leaves open.",
);

const TARGET: Field = Field::optional(
    "target",
    Kind::AnyQuantity,
    "Value that the signal is to reach, of `overshoot`, `rise_time`, `settling_time` and `iae`; left out: its last value in the \
     window, and zero of `iae`.",
);

const BAND: Field = Field::optional(
    "band",
    Kind::AnyQuantity,
    "How near to its target the signal must come, of `rise_time` and `settling_time`: in its unit, or as a part of the way from \
     its first value in the window to the target, 0.02.",
);

const OVER: Field = Field::optional(
    "over",
    Kind::Signal,
    "The other signal of `gradient`, `slope`, `hysteresis`, `gain`, `lag` and `phase_lag`, or an expression.",
);

const AT: Field =
    Field::optional("at", Kind::Quantity(Dimension::TIME, Sign::NonNegative), "When, of the measure `at`.");

const FREQUENCY: Field = Field::optional(
    "frequency",
    Kind::Quantity(Dimension::FREQUENCY, Sign::Positive),
    "Frequency of the waves, of `gain`, `lag` and `phase_lag`.",
);

const FROM: Field =
    Field::with_default("from", Kind::Quantity(Dimension::TIME, Sign::NonNegative), "0 s", "Start of the window.");

const UNTIL: Field =
    Field::optional("until", Kind::Quantity(Dimension::TIME, Sign::Positive), "End of the window; left out: the end.");

const OF_VARIANTS: Field = Field::optional(
    "variants",
    Kind::Names,
    "Variants that it applies to, a `[[variant]]` with all values of `[variants]`; left out: all.",
);

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

keys! {
    /// `[safety]`.
    table Safety {
        required {
        }
        optional {
            faults: Names, "Names of the `[fault.NAME]` to try; left out: all of them.";
            pairs: Choice(&["no", "yes"]) = "no", "Whether they are tried in pairs too, each with each other.";
            variants: Names,
                "The variants (manoeuvres) to try them in; left out: all that have no `faults` of their own.";
            values: Lists,
                "Values of parameters to try them at, every combination: { v = [\"10 m/s\", \"20 m/s\"] }; left out: those of the file.";
            detected: Text,
                "The condition for detection, of signals, parameters and `t`: `encoder_lost`, `unit.manual or \
                 abs(residual) > 1 deg`; a number is true above 0.5. Left out: nothing is detected, and only the \
                 effects are judged.";
            reaction: Text, "A block of the kind `state_machine`: kardan reports the states that it enters after the fault.";
            detection_time_limit: Quantity(Dimension::TIME, Sign::Positive),
                "The longest time to detection, from the start of the fault; later counts as not detected. Left out: any.";
            effect: Tables(SafetyEffect), "Unwanted effects and their bounds: `[[safety.effect]]`.";
        }
    }
}

keys! {
    /// `[[safety.effect]]`.
    table SafetyEffect {
        required {
            name: Text, "What it is called in the table: \"rack angle\".";
            signal: Text, "The signal that shows it, or an expression of signals, parameters and `t`: `rk.phi - road.phi`.";
        }
        optional {
            measure: Choice(&["max_abs", "max", "min", "final", "rms"]) = "max_abs",
                "What is measured of it in the window: largest in size, largest, smallest, last, root of the mean of its squares.";
            window: Quantity(Dimension::TIME, Sign::Positive),
                "How long after the start of the fault: the time in which a driver does not yet act, \"100 ms\"; left out: to the end.";
            baseline: Choice(&["no fault", "zero"]) = "no fault",
                "What counts as unwanted: the difference to the run of the same variant and values without the fault, or all of it.";
            below: AnyQuantity, "The measure must be less than this.";
            above: AnyQuantity, "The measure must be more than this.";
        }
    }
}

keys! {
    /// `[sweep]`.
    table Sweep {
        required {
        }
        optional {
            samples: Number(Sign::Positive) = "1000", "How many samples, at most ten millions.";
            seed: Number(Sign::NonNegative) = "0", "A whole number: another one, other samples.";
            points: Choice(&["latin_hypercube", "sobol", "halton", "random", "corners", "grid", "saltelli", "morris"]) = "latin_hypercube",
                "How samples fill the space of what varies. `latin_hypercube`: each value has one sample in each of \
                 as many parts of its distribution as there are samples; `sobol` and `halton`: sequences that fill it \
                 evenly; `random`: each sample by itself; `corners`: every combination of least and largest values; \
                 `grid`: every combination of `levels` values of each, from least to largest. Lists use their own \
                 values. `saltelli`: for the indices of Sobol, each parameter exchanged between two samples of \
                 Sobol's sequence, one after another; `morris`: for elementary effects, paths on which one parameter \
                 after another moves. Both are filled up to whole groups.";
            levels: Number(Sign::Positive) = "5", "Values of each parameter on a grid.";
            variants: Names,
                "The variants that run with each sample, all with the same values; left out: all.";
            vary: Tables(SweepVary),
                "What varies and how: `[[sweep.vary]]`. Left out, and no `lists`: everything with a tolerance, \
                 uniformly within it, or normally where the tolerance has a confidence.";
            lists: Lists,
                "Parameters that take listed values, each equally often: { v = [\"10 m/s\", \"20 m/s\"] }.";
            correlated: Tables(SweepCorrelated), "What varies together, with correlations: `[[sweep.correlated]]`.";
        }
    }
}

keys! {
    /// `[[sweep.correlated]]`.
    table SweepCorrelated {
        required {
        }
        optional {
            parameters: Names, "What varies together, in the order of the correlations; with a file, left out: all its names.";
            correlation: Text,
                "The matrix of correlations, row by row: \"1, 0.8; 0.8, 1\". They apply to normal variables, which other distributions follow by their quantiles: each has its own distribution.";
            file: Text,
                "In its place: the output of `kardan identify --json`, identified values with their errors and \
                 correlations; or a JSON object with `names`, `covariance` row by row in SI, and `means`, left out: \
                 the values of this file. All are normal.";
        }
    }
}

keys! {
    /// `[[sweep.vary]]`.
    table SweepVary {
        required {
            parameter: Text, "A name of `[parameters]`, or a key that has a tolerance: `bar.stiffness`, `scenario.initial.a.phi`, `scenario.event.1.at`, `fault.NAME.at`.";
        }
        optional {
            distribution: Choice(&["uniform", "normal", "triangular"]) = "uniform", "How its values are distributed.";
            from: AnyQuantity, "The least value; left out: the end of its tolerance. A normal distribution is truncated there, and unbounded if it is left out.";
            to: AnyQuantity, "The largest value, likewise.";
            mean: AnyQuantity, "The mean of a normal distribution; left out: the value of the file.";
            deviation: AnyQuantity, "Its standard deviation; needed there.";
            peak: AnyQuantity, "Where a triangular distribution is highest; left out: the value of the file.";
        }
    }
}

keys! {
    /// `[[plot]]`.
    table Plot {
        required {
            name: Name, "Name of the file and place in the report: `rack-angle`.";
            title: Text, "Title.";
            signals: Signals,
                "Signals drawn for every variant, or expressions of signals, parameters and the time `t`: [\"cj.phi - \
                 cs.phi\"]; quote names with `-` there: `'my-shaft.phi'`.";
        }
        optional {
            caption: Text, "A sentence beneath the plot.";
            references: Signals,
                "Signals drawn dashed: once where they are the same in all variants, else for each variant. A minus \
                 before the name, `-ref`, draws it with opposite sign, such as for a torque that is measured as a \
                 load.";
            labels: Names,
                "Legend labels of the signals, then of the references: [\"steering wheel\", \"rack\"]; left out, and for those at the end without one: their names.";
            variants: Names, "Variants to draw; left out: all.";
            display_unit: Text,
                "Unit in which the signals of its kind are plotted and reported: `deg`, `rpm`, `mN m`; left out: the \
                 SI unit. Tables and JSON stay in SI.";
            from: Quantity(Dimension::TIME, Sign::NonNegative), "Start of the time that is drawn; left out: the whole run.";
            until: Quantity(Dimension::TIME, Sign::Positive), "End of the time that is drawn; left out: the end of the run.";
            over: Signal, "Signal, or expression of signals, on the horizontal axis; left out: the time.";
            kind: Choice(&["values", "spectrum"]) = "values",
                "`spectrum`: amplitudes over the frequency k/T of the n rows within the time T that is drawn, 2/W times the size \
                 of the sum of w_j (x_j - mean) exp(-2 pi i j k/n), with the window of Hann w_j = (1 - cos(2 pi j/n))/2 and W \
                 the sum of the w_j: a sine with a whole number of periods in T shows its amplitude. The last row is that of \
                 the next period and left out; rows between those of the even grid are not used.";
            x_scale: Choice(&["linear", "log"]) = "linear", "Scale of the horizontal axis; `log` omits what is not above zero.";
            y_scale: Choice(&["linear", "log"]) = "linear", "Scale of the vertical axis.";
        }
    }
}

keys! {
    /// `[analysis]`.
    table Analysis {
        required {
        }
        optional {
            inputs: Elements(&["motor", "disturbance"]), "Inputs to analyse; left out: all motors.";
            outputs: Signals,
                "Outputs to analyse: `<shaft>.phi`, `<shaft>.w` or the name of a sensor; left out: all sensors, else \
                 the outputs that the laws control, else the angles of all coordinates.";
            at: Point,
                "Operating point. Angles of reduced coordinates, { \"rk.phi\" = \"30 deg\" }: at rest there. With \
                 speeds of any shafts or masses, { \"car.v\" = \"20 km/h\" }: in steady motion; kardan computes what \
                 is not given (twists of springs, other speeds, torques of motors) so that nothing accelerates; \
                 sliding friction counts, engaged locks are locked, load-dependent losses are left out. `<motor>.tau` \
                 gives a torque, `t` the time at which functions of time are evaluated. Where all positions and \
                 speeds are given it need not be an equilibrium: kardan reports what accelerates. `\"t = 3.2 s\"` \
                 alone is the state of the run at that time. Left out: the initial position of the scenario, or an \
                 equilibrium near it.";
            stuck: Elements(HOLDING),
                "Elements whose Coulomb friction sticks, hence constrains, or whose clutch, lock or stop is closed; left out: all slide and are open.";
            horizon: Quantity(Dimension::TIME, Sign::Positive) = "1 s", "Time over which the Gramians are taken.";
            motion: Overrides,
                "Angles and speeds of reduced coordinates to reach from rest: { \"rk.phi\" = \"10 deg\" }. Motor locations are then compared by the energy that this needs; left out: by their Gramians.";
            threshold: Number(Sign::Positive),
                "Gramian eigenvalue below which a sample of the parameters counts as lost; left out: a tenth of that \
                 of the nominal values.";
            samples: Number(Sign::Positive),
                "Samples of the parameters within their tolerances, a whole number up to a million; left out: 1000, \
                 or fewer for a large model.";
            actuator: Tables(ActuatorSite), "Candidate locations of motors: `[[analysis.actuator]]`.";
            sensor: Tables(SensorSite), "Candidate locations of sensors: `[[analysis.sensor]]`.";
        }
    }
}

keys! {
    /// `[bench]`.
    table Bench {
        required {
        }
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

keys! {
    /// `[[analysis.actuator]]`.
    table ActuatorSite {
        required {
            shaft: Body, "The shaft or mass that the torque or force would act on.";
        }
        optional {
            cost: Number(Sign::NonNegative) = "1", "Cost of this location.";
        }
    }
}

keys! {
    /// `[[analysis.sensor]]`.
    table SensorSite {
        required {
            shaft: Body, "The shaft or mass that would be measured.";
        }
        optional {
            measures: Choice(&["angle", "speed"]) = "angle", "What would be measured.";
            cost: Number(Sign::NonNegative) = "1", "Cost of this location.";
        }
    }
}

keys! {
    /// `[log.<name>]`.
    table Log {
        required {
        }
        optional {
            file: Text,
                "Which of the given files it describes: a name with the wildcards `*` and `?`. Left out: all. Several \
                 tables of files that were recorded together are joined by time.";
            time: Text, "The column of the time; left out: the one the file marks, or the one called time or t.";
            time_unit: Text, "Unit of the time; left out: that of the file, else s.";
            time_offset: Quantity(Dimension::TIME, Sign::Any) = "0 s",
                "What is added to the time, where clocks differ.";
            sample_time: Quantity(Dimension::TIME, Sign::Period), "Time between rows of a file without a time.";
            delimiter: Text, "Separator between the cells of a text file; left out: detected.";
            decimal: Choice(&["point", "comma"]), "The decimal sign of a text file; left out: detected.";
            names_row: Number(Sign::Positive), "Row of a text file with names; left out: detected.";
            units_row: Number(Sign::Positive), "Row of a text file with units; left out: detected.";
            first_row: Number(Sign::Positive), "Row of a text file in which the numbers begin; left out: detected.";
            channel: Tables(LogChannel),
                "Which column is which signal: `[[log.NAME.channel]]`. Columns that are called like a signal, \
                 `wg.phi`, need none.";
        }
    }
}

keys! {
    /// `[[log.<name>.channel]]`.
    table LogChannel {
        required {
            signal: Text,
                "What was measured: `<shaft>.phi`, `<shaft>.w`, `<motor>.tau`, `<disturbance>.tau`, or a sensor of an \
                 angle or speed.";
        }
        optional {
            column: Text, "The column, or the channel of a binary file, by its name.";
            number: Number(Sign::Positive), "The column by its number, from 1 on, instead.";
            unit: Text, "Its unit; left out: that of the file, else the SI unit of the signal. A speed in `1/min` counts turns.";
            factor: Number(Sign::NonZero) = "1", "Factor on the readings, such as -1 for an opposite sense.";
            scale: AnyQuantity,
                "Value of one unit of a reading, such as \"200 N m\" for one volt, instead of a unit: for readings of another quantity.";
            zero_samples: Number(Sign::Positive),
                "Number of first samples at zero: their mean is subtracted; left out: nothing is.";
            noise: AnyQuantity, "Standard deviation of a sample; left out: estimated from the log.";
        }
    }
}

keys! {
    /// `[identification]`.
    table Identification {
        required {
        }
        optional {
            parameters: Signals,
                "Parameters to identify: `<element>.<key>` with the keys inertia, damping, stiffness, friction, \
                 `<gear>.backlash`, or parameters that replace one or in which torque laws are linear; left out: \
                 every damping and friction of the model, in dynamic tests inertias and stiffnesses too.";
            method: Choice(&["steady", "dynamic"]),
                "`steady`: segments of constant speed; `dynamic`: all samples, with filtered derivatives. Left out: \
                 steady if neither inertias nor stiffnesses are requested and the logs have such segments.";
            window: Quantity(Dimension::TIME, Sign::Positive),
                "Width of the windows in which samples are smoothed; left out: 50 samples of the slowest channel.";
            rest_speed: AnyQuantity,
                "Speed below which the sign of a friction is unknown, of shafts or (m/s) of masses; left out: a hundredth of its largest, or the level of the noise.";
            steady_tolerance: Number(Sign::Positive) = "0.02",
                "Change of a speed in a steady segment, as a part of its largest.";
            shortest_segment: Quantity(Dimension::TIME, Sign::Positive),
                "Shortest steady segment; left out: four windows.";
            inactive_inputs: Elements(&["motor", "disturbance"]),
                "Inputs that were zero during the log; kardan eliminates the torques of others without a channel.";
            nonnegative: Signals,
                "Parameters that may not be below zero; left out: none, as an equivalent damping may be.";
            loss: Choice(&["squares", "huber", "bisquare"]) = "squares",
                "Weight of residuals: the two others give outliers less weight, or none.";
            confidence: Number(Sign::Positive) = "0.95", "Confidence of the intervals, below 1.";
            extra: Tables(Extra),
                "Terms in addition to those of the model: `[[identification.extra]]`. They are fitted where \
                 `parameters` names theirs, or is left out; candidates choose among them.";
            candidate: Tables(Candidate), "Models that `--compare` compares: `[[identification.candidate]]`.";
            published: Overrides,
                "Values from other sources that the report lists beside its own: { \"fs.damping\" = \"0.02 N m s/rad\" }.";
            source: Text, "Where the published values are from.";
        }
    }
}

keys! {
    /// `[[identification.extra]]`.
    table Extra {
        required {
            kind: Choice(&[
                "stribeck", "load", "friction_asymmetry", "damping_asymmetry", "quadratic", "drift", "recordings", "cogging", "ripple",
                "offset", "backlash", "gear_loss"
            ]),
                "Friction: `stribeck`, more of it at low speed (the parameters `<element>.stribeck` and \
                 `<element>.stribeck_speed`); `load`, a loss in proportion to a torque, as in a strain-wave gear \
                 (`<element>.load_loss`); `friction_asymmetry`, half its excess forwards over backwards \
                 (`<element>.friction_asymmetry`); `damping_asymmetry`, the same of the damping (`<element>.damping_asymmetry`); \
                 `quadratic`, with the square of the speed (`<element>.quadratic_damping`); `drift`, its increase per \
                 second of a log (`<element>.friction_drift`); `recordings`, how it differs from log to log \
                 (`<element>.friction_recordings_<log>`); `ripple`, friction over the angle. Others: `cogging`, a \
                 torque over the angle (both with the parameters `..._<order>_cos` and `..._<order>_sin`); `offset` \
                 of a torque sensor (`<input>.offset`); `backlash` of a spring (`<spring>.backlash_torque`, half its \
                 width times the stiffness, and `<spring>.backlash`, the width); `gear_loss`, load-dependent gear \
                 friction (`<gear>.tooth_loss` and `<gear>.tooth_loss_back`, with the efficiencies that follow).";
        }
        optional {
            friction: Element(&["shaft", "mass", "spring_damper"]),
                "The element in whose direction it acts; all kinds but `offset`, `backlash` and `gear_loss` need it.";
            shape: Choice(&["gaussian", "exponential", "peak"]) = "gaussian",
                "Of Stribeck friction over x, the speed by the Stribeck speed: exp(-x^2), exp(-x), or x exp(1 - x).";
            speed: AnyQuantity,
                "The Stribeck speed, if it is known; left out: kardan identifies it too.";
            order: Number(Sign::Positive),
                "Periods in a turn of the element, whose angle must be in the logs (`cogging`, `ripple`).";
            spring: Element(&["spring_damper"]), "The spring that has the backlash.";
            gear: Element(&["gear", "harmonic_drive", "rack_and_pinion", "screw"]), "The element with load-dependent gear friction.";
            min_deflection: AnyQuantity,
                "Twist (of masses: a length) that certainly exceeds the backlash: windows with less do not count.";
            torque: Element(&["motor", "disturbance"]), "The input whose torque loads the gear, or whose sensor has the offset (`load`, `offset`).";
        }
    }
}

keys! {
    /// `[[identification.candidate]]`.
    table Candidate {
        required {
            name: Name, "Its name.";
        }
        optional {
            parameters: Signals, "Its parameters; left out: those of `[identification]`.";
            extras: Names, "Its extra terms, by their parameters: `fs.stribeck`, `wg.load_loss`, `wg.cogging_6`; left out: none.";
        }
    }
}
