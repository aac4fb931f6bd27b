//! A design as a page.

use crate::design_pictures as pictures;
use crate::model::{Body, Cell, Page, cells, row, warnings};
use crate::pareto::pareto;
use crate::text::figure;
use crate::text::number;
use crate::words::{self, design as said};
use kardan::results::{
    Alternative, ChannelResult, CrossCoupling, Design, Exploration, Interaction, Margins, Motion, ObserverResult, Pole,
    Robustness, ScenarioStrain, WithSensor, ZeroMode,
};

/// More poles are counted where there is little room.
const POLES: usize = 40;

/// The page of a design.
pub fn page(design: &Design) -> Page {
    let name = match (design.model.is_empty(), design.controller.is_empty()) {
        (true, true) => "Design".into(),
        (true, _) => design.controller.clone(),
        (_, true) => design.model.clone(),
        _ => format!("{}: {}", design.model, design.controller),
    };
    let strains = strains(&design.strains);
    let new = Body::default;
    Page {
        name,
        description: design.description.clone(),
        verdict: Some(design.verdict()),
        alerts: warnings(&design.warnings),
        sections: Page::sections([
            ("design", "Design", head(design)),
            ("decoupling", "Decoupling", decoupling(design)),
            ("gains", "Gains", new().matrices(&design.gains)),
            ("channels", "Channels", channels(&design.channels)),
            ("poles", "Closed-loop poles", poles(design)),
            ("sampling", "Sampling, delay and limits", design.margins.as_ref().map(margins).unwrap_or_default()),
            ("strain", "Torques in the scenario", strains),
            ("zero-dynamics", "Zero dynamics", zero_dynamics(design)),
            ("observer", "Observer", design.observer.as_ref().map(observer).unwrap_or_default()),
            ("proof", "Transfer matrix of the linear loop, exact", proof(design)),
            ("coupling", "Cross coupling", cross_coupling(design)),
            (
                "passage",
                "With the parameters of the variant",
                new().list(design.passage.iter().flat_map(said::passage)),
            ),
            ("exploration", "Other designs", design.exploration.as_ref().map(exploration).unwrap_or_default()),
            ("box", "Box of plants", design.robustness.as_ref().map(robustness).unwrap_or_default()),
            ("flatness", "Flatness", new().list(design.flatness.iter().flat_map(said::flatness))),
            ("canonical", "Canonically decoupled form", canonical(design)),
            ("controller", "Controller", controller(design)),
            ("remarks", "Notes of the design", new().list(design.notes.iter().cloned())),
        ]),
        data: None,
    }
}

fn head(design: &Design) -> Body {
    if design.controller.is_empty() && design.law.is_empty() {
        return Body::default();
    }
    let definitions = design.definitions.iter().map(|one| row![&one.state, &one.is]);
    Body::default()
        .list(said::head(design))
        .names("States", &design.states)
        .names("Inputs", &design.inputs)
        .names("Outputs", &design.outputs)
        .part("States that stand for combinations of coordinates", Body::default().table(&["state", "is"], definitions))
        .say(said::hidden(design).unwrap_or_default())
}

fn decoupling(design: &Design) -> Body {
    let degree = |degree: &Option<usize>| match degree {
        Some(degree) => Cell::from(*degree),
        None => Cell::Mark(false, said::relative_degree(None)),
    };
    let degrees = design.outputs.iter().zip(&design.relative_degrees);
    Body::default()
        .list(said::decouplability(design))
        .table(&["output", "#relative degree"], degrees.map(|(output, found)| vec![output.into(), degree(found)]))
        .matrices([&design.decoupling_matrix])
}

fn channels(channels: &[ChannelResult]) -> Body {
    let row = |channel: &ChannelResult| {
        let ChannelResult { output, reference, kind, transfer, poles, .. } = channel;
        let poles = words::together(&words::list(&words::pairs(poles), 12));
        row![output, reference, kind, Cell::Code(transfer.clone()), poles]
    };
    let headers = ["output", "reference", "kind", "transfer function", "poles [1/s]"];
    Body::default().table(&headers, channels.iter().map(row))
}

fn poles(design: &Design) -> Body {
    if design.closed_loop_poles.is_empty() {
        return Body::default();
    }
    let row = |&(pole, times): &(Pole, usize)| {
        let size = pole.abs();
        let word = match design.motion(pole) {
            Motion::Decays => Cell::Mark(true, "decays".into()),
            Motion::Grows => Cell::Mark(false, "grows".into()),
            Motion::Stays => Cell::Mark(false, "does not decay".into()),
            Motion::Unknown => Cell::Mark(false, "not decided".into()),
        };
        row![
            words::pair(pole),
            if times > 1 { format!("{times}×") } else { String::new() },
            size,
            if size > 0.0 { number(-pole.re / size) } else { "–".into() },
            said::owner(pole, design),
            word,
        ]
    };
    let headers = ["#pole [1/s]", "#", "#frequency [rad/s]", "#damping", "of", ""];
    Body::default()
        .hint("Linear loop with all controllers, at the design point.")
        .table_of(POLES, &headers, said::joined(&design.closed_loop_poles).iter().map(row))
        .hint(said::floating_poles(design).unwrap_or_default())
        .pictures(pictures::plane(design))
}

fn margins(found: &Margins) -> Body {
    let peaks = found.peaks.iter().map(|peak| {
        let [step, motor, asked, limit] = said::torque_peak(peak);
        let too_much = peak.limit.is_some_and(|limit| peak.peak > limit * (1.0 + 1e-9));
        let asked = if too_much { Cell::Mark(false, asked) } else { Cell::Text(asked) };
        row![step, motor, asked, limit]
    });
    let limits = said::margins(found).into_iter().map(cells);
    let channels = said::channels(found).into_iter().map(cells);
    Body::default()
        .say(&found.verdict)
        .part(
            "Limits of the linear loop",
            Body::default().table(&["the loop tolerates", "#limit", "beyond it grows"], limits),
        )
        .part(
            "How wrong one channel may be before the loop is unstable",
            Body::default().table(&said::CHANNELS, channels),
        )
        .part(
            "Torques that steps ask for",
            Body::default().table(&["step of", "motor", "#asked of it", "#torque limit"], peaks),
        )
}

/// What the scenario asks of the motors; empty if it was not run.
fn strains(found: &[ScenarioStrain]) -> Body {
    let row = |found: &ScenarioStrain| {
        let [asked, limit, time] = said::strain(&found.strain, found.duration);
        let time = if found.strain.strained() { Cell::Mark(false, time) } else { Cell::Text(time) };
        row![&found.strain.motor, &found.variant, asked, limit, time]
    };
    Body::default()
        .table(&["motor", "variant", "#largest torque asked", "#limit", "#time at the limit"], found.iter().map(row))
}

fn zero_dynamics(design: &Design) -> Body {
    let found = &design.zero_dynamics;
    let row = |mode: &ZeroMode| {
        let word = match &mode.warning {
            None => Cell::Mark(true, "dies out".into()),
            Some(_) => Cell::Mark(false, "warning".into()),
        };
        row![
            words::pair(mode.pole),
            mode.natural_frequency,
            mode.damping_ratio,
            words::together(&words::motion(&mode.shape, |value| figure(value, 3))),
            words::together(&words::of_elements(&mode.stored)),
            words::together(&words::of_elements(&mode.dissipated)),
            word,
        ]
    };
    let headers =
        ["#pole [1/s]", "#frequency [rad/s]", "#damping", "largest motions", "stored in", "lost in", "verdict"];
    let warnings = found.modes.iter().filter_map(|mode| Some((mode, mode.warning.as_ref()?)));
    let body = Body::default().list(said::zero_dynamics(found)).table(&headers, found.modes.iter().map(row));
    warnings.fold(body, |body, (mode, text)| body.judge(false, format!("{} 1/s: {text}", words::pair(mode.pole))))
}

fn observer(found: &ObserverResult) -> Body {
    Body::default()
        .list(said::observer(found))
        .names("States", &found.states)
        .part("Poles of its error", super::poles(&found.poles))
        .part("Gain", Body::default().matrices([&found.gain]))
}

/// Names once each, in the order in which they come first.
fn once<'a>(names: impl Iterator<Item = &'a String>) -> Vec<&'a String> {
    let mut out: Vec<&String> = Vec::new();
    names.for_each(|name| {
        if !out.contains(&name) {
            out.push(name);
        }
    });
    out
}

fn proof(design: &Design) -> Body {
    let references = once(design.transfer.iter().map(|entry| &entry.reference));
    let outputs = once(design.transfer.iter().map(|entry| &entry.output));
    let cell = |output: &str, reference: &str| match said::linear(design, reference, output) {
        None => "–".into(),
        Some(entry) if entry.numerator.is_empty() => Cell::Mark(true, said::transfer(entry)),
        Some(entry) => Cell::Code(said::transfer(entry)),
    };
    let row = |output: &&String| {
        let cells = references.iter().map(|reference| cell(output, reference));
        std::iter::once(Cell::from(*output)).chain(cells).collect()
    };
    let from = references.iter().map(|reference| format!("from {reference}"));
    let headers: Vec<String> = std::iter::once("output".to_owned()).chain(from).collect();
    Body::default().judge(design.decoupled == Some(true), said::proof(design).unwrap_or_default()).table_of(
        POLES,
        &headers,
        outputs.iter().map(row),
    )
}

fn cross_coupling(design: &Design) -> Body {
    let found = &design.cross_coupling;
    if found.is_empty() {
        return Body::default();
    }
    let same = said::window(found);
    let over = same.as_ref().map_or(String::new(), |same| format!(", {same}"));
    let with_unit =
        |value: Option<f64>, unit: &str| format!("{} {unit}", number(value.unwrap_or(f64::NAN))).trim_end().to_owned();
    let row = |c: &CrossCoupling| {
        let mut row = row![said::step(c), &c.output, if c.own { "own" } else { "other" }];
        row.extend(match &c.failure {
            Some(_) => row![Cell::Mark(false, "failed".into()), "", ""],
            None => {
                let share = said::relative(c, found).map_or(String::new(), |share| said::share(share, number));
                row![with_unit(c.peak, &c.unit), with_unit(c.rms, &c.unit), share]
            }
        });
        row.extend(same.is_none().then(|| c.window.into()));
        row
    };
    let mut headers = vec!["step of", "output", "channel", "#peak", "#root mean square", "#of its own step"];
    headers.extend(same.is_none().then_some("#window [s]"));
    let body = Body::default()
        .hint(format!("Deviations in the nonlinear simulation{over}, with friction, limits and the true joint angles."))
        .pictures(pictures::couplings(design))
        .table_of(POLES, &headers, found.iter().map(row));
    found
        .iter()
        .filter_map(|c| Some((c, c.failure.as_ref()?)))
        .fold(body, |body, (c, why)| body.judge(false, format!("Step of {}: {why}", said::step(c))))
}

fn exploration(found: &Exploration) -> Body {
    let mut best: Vec<&Alternative> = found.designs.iter().filter(|one| one.best).collect();
    best.retain(|one| one.bandwidth == 1.0);
    best.sort_by(|a, b| b.sample_time.total_cmp(&a.sample_time).then(a.torque.total_cmp(&b.torque)));
    let designs = best.iter().map(|one| cells(said::alternative(found, one)));
    let headers = ["rate", "bandwidth", "effort", "sensors", "#interaction", "#torque", "#noise", "#spectral radius"];
    let sensors = found.sensors.iter().map(|WithSensor { name, design: with }| {
        let [_, _, _, _, interaction, _, noise, radius] = said::alternative(found, with);
        row![name, interaction, noise, radius]
    });
    Body::default()
        .list(said::exploration(found))
        .pictures(pareto(found))
        .part(
            "With the bandwidth of the file, designs that none at no higher rate beats in both interaction and torque",
            Body::default().table_of(POLES, &headers, designs),
        )
        .part(
            "With one more sensor, the best first",
            Body::default().table(&["sensor", "#interaction", "#noise", "#spectral radius"], sensors),
        )
}

fn robustness(found: &Robustness) -> Body {
    let table = |what: &str, all: &[Interaction]| {
        let headers = ["step of", what, "#nominal", "#median", "#90 %", "#99 %", "#largest", "#worst corner", "unit"];
        Body::default().table(&headers, all.iter().map(|one| cells(said::interaction(one))))
    };
    Body::default()
        .list(said::robustness(found))
        .part("What a step does to other channels", table("signal", &found.interactions))
        .part("What a step asks of the motors", table("motor", &found.peaks))
}

fn canonical(design: &Design) -> Body {
    design.canonical.as_ref().map_or_else(Body::default, |found| {
        let all = [&found.transformation, &found.a, &found.b, &found.c];
        Body::default().list(said::canonical(found, design)).fold("Matrices", Body::default().matrices(all))
    })
}

fn controller(design: &Design) -> Body {
    let texts = said::controller(&design.controller_data);
    if texts.is_empty() {
        return Body::default();
    }
    let reads = design.controller_data.reads.iter().map(|one| row![&one.signal, &one.unit]);
    let reads = Body::default().table(&["signal read", "unit"], reads);
    Body::default()
        .list(texts)
        .hint("`kardan design --controller FILE` writes it with every bit of its numbers.")
        .detail(Body::default().fold("Signals in their order", reads))
}
