//! Outputs in the simulation and on the bench, both in one chart.

use kardan_results::{BenchStudy, Experiment, Plot, PlottedReference, Response, Run, Series, Study};

/// The runs of all experiments as a study for charts, with one plot per output for simulation and bench.
pub(super) fn pictured(study: &BenchStudy) -> Study {
    let experiments = &study.closed_loop.experiments;
    let runs = experiments.iter().flat_map(|experiment| {
        let [simulation, bench] = names(experiment);
        [named(&experiment.simulated, simulation, experiment), named(&experiment.measured, bench, experiment)]
    });
    let plots = experiments.iter().flat_map(|one| one.responses.iter().map(move |response| plot(one, response)));
    Study { runs: runs.collect(), plots: plots.collect(), ..Study::default() }
}

/// Names of the two runs of an experiment in the legend.
fn names(experiment: &Experiment) -> [String; 2] {
    ["simulation", "bench"].map(|where_| format!("{where_}, {}", experiment.name))
}

/// The signals of a run that are drawn.
fn named(run: &Run, name: String, experiment: &Experiment) -> Run {
    let drawn = |name: &String| experiment.responses.iter().any(|one| one.signal == *name || one.reference == *name);
    let signals = run.series.signals.iter().filter(|signal| drawn(&signal.name)).cloned().collect();
    let series = Series { time: run.series.time.clone(), signals };
    Run { name, series, events: run.events.clone(), ..Run::default() }
}

fn plot(experiment: &Experiment, response: &Response) -> Plot {
    Plot {
        id: format!("{}-{}", experiment.name, response.output),
        title: format!("{}: {}", experiment.name, response.output),
        caption: "Simulation: the continuous-time controller on its design model, without friction. Bench: the \
                  controller as it runs on the bench plant; sensor noise is not drawn."
            .into(),
        signals: vec![response.signal.clone()],
        references: vec![PlottedReference { signal: response.reference.clone(), opposite: false }],
        variants: names(experiment).to_vec(),
        ..Plot::default()
    }
}
