//! The tables of an identification: logs with their channels, parameters, extra terms and candidates.

use kardan_math::units::Dimension;
use kardan_schema::schema::{Sign, keys};

keys! {
    /// `[log.<name>]`.
    table Log {
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
