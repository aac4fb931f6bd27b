//! The tables of a sweep: its samples, and what varies in them.

use kardan_schema::schema::{Sign, keys};

keys! {
    /// `[sweep]`.
    table Sweep {
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
