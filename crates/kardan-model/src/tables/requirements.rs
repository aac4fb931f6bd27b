//! The tables of what runs are measured and judged by: requirements, figures, plots, and effects of faults.

use kardan_math::units::Dimension;
use kardan_schema::schema::{Field, Kind, Sign, choice, keys};

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

keys! {
    /// `[[requirement]]`.
    table Requirement {
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
     straight lines; `kardan run` compares each verdict with that on a second run with more rows, and reports a \
     difference.",
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
    /// `[safety]`.
    table Safety {
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
