//! A design in tables, sentences and pictures.

use super::analysis::{codes, items, number, paragraph, rows_of, titled};
use super::design_pictures as pictures;
use super::pareto::pareto;
use super::summary::poles;
use super::table::{Cell, section as framed, table};
use super::tables::mark;
use super::text::{escape, figure, powers, unit};
use super::words::{self, design as said};
use kardan::results::{
    Alternative, Canonical, ChannelResult, CrossCoupling, Design, ExactMatrix, Exploration, Interaction, Margins,
    Motion, ObserverResult, Pole, Robustness, ScenarioStrain, ZeroMode,
};

/// A matrix with more rows or columns is not shown.
const LARGE: usize = 40;
/// Longer fractions are shown as numbers.
const FRACTION: usize = 12;
/// More columns of a matrix go below the first ones.
const ACROSS: usize = 10;

/// The parts that apply: anchor, title, body.
fn parts(design: &Design) -> Vec<(&'static str, &'static str, String)> {
    let all = [
        ("design", "Design", head(design)),
        ("decoupling", "Decoupling", decoupling(design)),
        ("gains", "Gains", matrices(&design.gains)),
        ("channels", "Channels", channels(&design.channels)),
        ("poles", "Closed-loop poles", closed_loop(design)),
        ("sampling", "Sampling, delay and limits", design.margins.as_ref().map(margins).unwrap_or_default()),
        ("strain", "Torques in the scenario", strains(&design.strains)),
        ("zero-dynamics", "Zero dynamics", zero_dynamics(design)),
        ("observer", "Observer", design.observer.as_ref().map(observer).unwrap_or_default()),
        ("proof", "Transfer matrix", proof(design)),
        ("coupling", "Cross coupling", cross_coupling(design)),
        (
            "passage",
            "With the parameters of the variant",
            design.passage.as_ref().map(|found| items(&said::passage(found, number))).unwrap_or_default(),
        ),
        ("exploration", "Other designs", design.exploration.as_ref().map(exploration).unwrap_or_default()),
        ("box", "Box of plants", design.robustness.as_ref().map(robustness).unwrap_or_default()),
        ("flatness", "Flatness", flatness(design)),
        ("canonical", "Canonical form", design.canonical.as_ref().map(|c| canonical(c, design)).unwrap_or_default()),
        ("controller", "Controller", controller(design)),
        ("remarks", "Notes of the design", items(&design.notes)),
    ];
    all.into_iter().filter(|(_, _, body)| !body.is_empty()).collect()
}

/// What stands above the contents: a box for each warning.
pub(super) fn alerts(design: &Design) -> String {
    let alert = |text: &String| {
        format!("<div class=\"failure\" role=\"alert\"><strong>Warning:</strong> {}</div>\n", escape(text))
    };
    design.warnings.iter().map(alert).collect()
}

/// The sections of a page of its own.
pub(super) fn sections(design: &Design) -> Vec<String> {
    parts(design).iter().map(|(anchor, title, body)| framed(anchor, title, body)).collect()
}

/// One section of the report on runs; `index` tells the designs of a report apart.
pub(super) fn section(design: &Design, index: usize) -> String {
    let (good, verdict) = design.verdict();
    let class = if good { "good" } else { "bad" };
    let parts = parts(design);
    let id = format!("design-{}", index + 1);
    let links = parts.iter().map(|(anchor, title, _)| format!("<a href=\"#{id}-{anchor}\">{title}</a>\n"));
    let links = format!("<nav>\n{}</nav>\n", links.collect::<String>());
    let lower = |body: &str| body.replace("<h3>", "<h4>").replace("</h3>", "</h4>");
    let bodies =
        parts.iter().map(|(anchor, title, body)| format!("<h3 id=\"{id}-{anchor}\">{title}</h3>\n{}", lower(body)));
    let bodies: String = bodies.collect();
    let body = format!("<p class=\"{class}\">{}</p>\n{}{links}{bodies}", escape(&verdict), alerts(design));
    framed(&id, &format!("Design of {}", design.controller), &body)
}

fn head(design: &Design) -> String {
    if design.controller.is_empty() && design.law.is_empty() {
        return String::new();
    }
    let mut body = items(&said::head(design));
    for (what, names) in [("States", &design.states), ("Inputs", &design.inputs), ("Outputs", &design.outputs)] {
        body += &format!("<p>{what} ({}): {}</p>\n", names.len(), codes(names, "none"));
    }
    let definition = |(state, is): &(String, String)| vec![Cell::Head(state.clone(), 1), Cell::text(is.clone())];
    let definitions = rows_of(&["state", "is"], design.definitions.iter().map(definition).collect());
    body += &titled("States that stand for combinations of coordinates", &definitions);
    body + &said::hidden(design, number).map(|text| paragraph(&text)).unwrap_or_default()
}

fn decoupling(design: &Design) -> String {
    let mut body = items(&said::decouplability(design));
    let row = |(output, degree): (&String, &Option<usize>)| {
        let degree = match degree {
            Some(degree) => Cell::Number(degree.to_string()),
            None => mark(false, &said::relative_degree(None)),
        };
        vec![Cell::Head(output.clone(), 1), degree]
    };
    let rows = design.outputs.iter().zip(&design.relative_degrees).map(row).collect();
    if !design.decoupling_matrix.values.is_empty() {
        body += &matrices(std::slice::from_ref(&design.decoupling_matrix));
    }
    body + &titled("Relative degrees", &rows_of(&["output", "#derivatives until an input appears"], rows))
}

fn exploration(found: &Exploration) -> String {
    let mut best: Vec<&Alternative> = found.designs.iter().filter(|one| one.best).collect();
    best.retain(|one| one.bandwidth == 1.0);
    best.sort_by(|a, b| b.sample_time.total_cmp(&a.sample_time).then(a.torque.total_cmp(&b.torque)));
    let row = |one: &&Alternative| {
        let [rate, bandwidth, effort, sensors, interaction, torque, noise, radius] =
            said::alternative(found, one, number);
        let mut row = vec![Cell::Head(rate, 1)];
        row.extend([bandwidth, effort, sensors].map(Cell::text));
        row.extend([interaction, torque, noise, radius].map(Cell::Number));
        row
    };
    let headers = ["rate", "bandwidth", "effort", "sensors", "#interaction", "#torque", "#noise", "#spectral radius"];
    let designs = rows_of(&headers, best.iter().map(row).collect());
    let sensor = |(name, with): &(String, Alternative)| {
        let [_, _, _, _, interaction, _, noise, radius] = said::alternative(found, with, number);
        let mut row = vec![Cell::Head(name.clone(), 1)];
        row.extend([interaction, noise, radius].map(Cell::Number));
        row
    };
    let headers = ["sensor", "#interaction", "#noise", "#spectral radius"];
    let sensors = rows_of(&headers, found.sensors.iter().map(sensor).collect());
    items(&said::exploration(found))
        + &pareto(found)
        + &titled(
            "With the bandwidth of the file, designs that none at no higher rate beats in both interaction and torque",
            &designs,
        )
        + &titled("With one more sensor", &sensors)
}

fn robustness(found: &Robustness) -> String {
    let rows = |all: &[Interaction]| {
        let row = |one: &Interaction| {
            let [step, signal, nominal, median, q90, q99, sampled, worst, unit] = said::interaction(one, number);
            let numbers = [nominal, median, q90, q99, sampled, worst].map(Cell::Number);
            let mut row = vec![Cell::Head(step, 1), Cell::text(signal)];
            row.extend(numbers);
            row.push(Cell::text(unit));
            row
        };
        all.iter().map(row).collect::<Vec<_>>()
    };
    let headers =
        |what| ["step of", what, "#nominal", "#median", "#90 %", "#99 %", "#largest", "#worst corner", "unit"];
    items(&said::robustness(found, number))
        + &titled("What a step does to other channels", &rows_of(&headers("signal"), rows(&found.interactions)))
        + &titled("What a step asks of the motors", &rows_of(&headers("motor"), rows(&found.peaks)))
}

/// What the scenario asks of the motors; empty if it was not run.
fn strains(found: &[ScenarioStrain]) -> String {
    let row = |found: &ScenarioStrain| {
        let [asked, limit, time] = said::strain(&found.strain, found.duration, number);
        let time = if found.strain.strained() { mark(false, &time) } else { Cell::Number(time) };
        let variant = Cell::text(found.variant.clone());
        vec![Cell::Head(found.strain.motor.clone(), 1), variant, Cell::Number(asked), Cell::Number(limit), time]
    };
    let headers = ["motor", "variant", "#largest torque asked", "#limit", "#time at the limit"];
    titled("What the scenario asks of the motors", &rows_of(&headers, found.iter().map(row).collect()))
}

fn margins(found: &Margins) -> String {
    let limits = said::margins(found, number).into_iter();
    let limits = limits.map(|[what, limit, motion]| vec![Cell::Head(what, 1), Cell::Number(limit), Cell::text(motion)]);
    let peaks = found.peaks.iter().map(|peak| {
        let [step, motor, asked, limit] = said::torque_peak(peak, number);
        let too_much = peak.limit.is_some_and(|limit| peak.peak > limit * (1.0 + 1e-9));
        let asked = if too_much { mark(false, &asked) } else { Cell::Number(asked) };
        vec![Cell::Head(step, 1), Cell::text(motor), asked, Cell::Number(limit)]
    });
    let limits = rows_of(&["the loop tolerates", "#limit", "beyond it grows"], limits.collect());
    let peaks = rows_of(&["step of", "motor", "#asked of it", "#torque limit"], peaks.collect());
    let channels = said::channels(found, number).into_iter();
    let channels = channels.map(|[what, rest @ ..]| {
        std::iter::once(Cell::Head(what, 1)).chain(rest.into_iter().map(Cell::text)).collect()
    });
    let channels = channels.collect();
    paragraph(&found.verdict)
        + &titled("Limits of the linear loop", &limits)
        + &titled("How wrong one channel may be before the loop is unstable", &rows_of(&said::CHANNELS, channels))
        + &titled("Torques that steps ask for", &peaks)
}

/// Matrices side by side, fractions where they are short.
fn matrices(all: &[ExactMatrix]) -> String {
    let mut rounded = false;
    let blocks: String = all.iter().map(|one| matrix(one, &mut rounded)).collect();
    let hint = "<p class=\"hint\">Long fractions are rounded here; they appear under the pointer and are in the exported \
                data.</p>\n";
    match (blocks.is_empty(), rounded) {
        (true, _) => blocks,
        (_, rounded) => format!("<div class=\"matrices\">\n{blocks}</div>\n{}", if rounded { hint } else { "" }),
    }
}

fn matrix(matrix: &ExactMatrix, rounded: &mut bool) -> String {
    let (height, width) = (matrix.values.len(), matrix.columns.len());
    let unit = if matrix.unit.is_empty() { String::new() } else { format!(" [{}]", unit(&matrix.unit)) };
    let title = escape(&format!("{}{unit}", said::matrix_title(matrix)));
    if height.max(width) > LARGE {
        return format!(
            "<div class=\"matrix\"><h4>{title}</h4>\n<p class=\"hint\">{height} × {width}: too large to be shown, see \
             the exported data.</p>\n</div>\n"
        );
    }
    let mut cell = |row: usize, column: usize| {
        let (text, shortened) = said::entry(matrix, row, column, FRACTION, |value| figure(value, 6));
        *rounded |= shortened;
        let exact = matrix.exact.as_ref().filter(|_| shortened).and_then(|rows| rows.get(row)?.get(column).cloned());
        let text = text.replace('-', "−");
        exact.map_or(Cell::Number(text.clone()), |exact| Cell::Rounded(text, exact))
    };
    let mut tables = String::new();
    let columns: Vec<usize> = (0..width).collect();
    for columns in columns.chunks(ACROSS) {
        let headers = columns.iter().map(|&column| format!("#{}", matrix.columns[column]));
        let headers: Vec<String> = std::iter::once(String::new()).chain(headers).collect();
        let row = |row: usize| {
            let name = matrix.rows.get(row).cloned().unwrap_or_default();
            std::iter::once(Cell::Head(name, 1)).chain(columns.iter().map(|&column| cell(row, column))).collect()
        };
        tables += &table(&headers, &(0..height).map(row).collect::<Vec<_>>());
    }
    format!("<div class=\"matrix\"><h4>{title}</h4>\n{tables}</div>\n")
}

fn pole_list(poles: &[Pole]) -> Cell {
    Cell::Text(words::together(&words::list(&words::pairs(poles, number), 12)))
}

fn channels(channels: &[ChannelResult]) -> String {
    let row = |channel: &ChannelResult| {
        vec![
            Cell::Head(channel.output.clone(), 1),
            Cell::text(channel.reference.clone()),
            Cell::text(channel.kind.clone()),
            Cell::Html(format!("<code>{}</code>", escape(&powers(&channel.transfer)))),
            pole_list(&channel.poles),
        ]
    };
    let headers = ["output", "reference", "kind", "transfer function", "poles [1/s]"];
    rows_of(&headers, channels.iter().map(row).collect())
}

fn closed_loop(design: &Design) -> String {
    if design.closed_loop_poles.is_empty() {
        return String::new();
    }
    let row = |&((re, im), times): &(Pole, usize)| {
        let size = re.hypot(im);
        let word = match design.motion((re, im)) {
            Motion::Decays => mark(true, "decays"),
            Motion::Grows => mark(false, "grows"),
            Motion::Stays => mark(false, "does not decay"),
            Motion::Unknown => mark(false, "not decided"),
        };
        vec![
            Cell::Number(words::pair((re, im), number)),
            Cell::Number(if times > 1 { format!("{times}×") } else { String::new() }),
            Cell::figure(size),
            Cell::Number(if size > 0.0 { figure(-re / size, 4) } else { "–".into() }),
            Cell::text(said::owner((re, im), design)),
            word,
        ]
    };
    let headers = ["#pole [1/s]", "#", "#natural frequency [rad/s]", "#damping ratio", "of", ""];
    let hint = "<p class=\"hint\">Linear loop with all controllers, at the design point.</p>\n";
    let listed = rows_of(&headers, said::joined(&design.closed_loop_poles).iter().map(row).collect());
    let floating =
        said::floating_poles(design).map(|text| format!("<p class=\"hint\">{text}</p>\n")).unwrap_or_default();
    format!("{hint}{listed}{floating}{}", pictures::plane(design))
}

fn zero_dynamics(design: &Design) -> String {
    let found = &design.zero_dynamics;
    let sentences: Vec<String> = said::zero_dynamics(found).iter().map(|text| powers(text)).collect();
    let row = |mode: &ZeroMode| {
        let word = match &mode.warning {
            None => mark(true, "dies out"),
            Some(_) => mark(false, "warning"),
        };
        vec![
            Cell::Number(words::pair(mode.pole, number)),
            Cell::figure(mode.natural_frequency),
            Cell::Number(figure(mode.damping_ratio, 4)),
            Cell::Text(words::together(&words::motion(&mode.shape, |value| figure(value, 3)))),
            Cell::Text(words::together(&words::shares(&mode.stored))),
            Cell::Text(words::together(&words::shares(&mode.dissipated))),
            word,
        ]
    };
    let headers = [
        "#pole [1/s]",
        "#natural frequency [rad/s]",
        "#damping ratio",
        "largest motions",
        "stored in",
        "lost in",
        "verdict",
    ];
    let warning = |mode: &ZeroMode| {
        let warning = escape(mode.warning.as_ref()?);
        Some(format!("<p class=\"bad\">{} 1/s: {warning}</p>\n", words::pair(mode.pole, number)))
    };
    items(&sentences)
        + &rows_of(&headers, found.modes.iter().map(row).collect())
        + &found.modes.iter().filter_map(warning).collect::<String>()
}

fn observer(found: &ObserverResult) -> String {
    let mut body = items(&said::observer(found));
    body += &format!("<p>States ({}): {}</p>\n", found.states.len(), codes(&found.states, "none"));
    if !found.poles.is_empty() {
        body += &titled("Poles of its error", &poles(&found.poles));
    }
    if !found.gain.values.is_empty() {
        body += &titled("Gain", &matrices(std::slice::from_ref(&found.gain)));
    }
    body
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

fn proof(design: &Design) -> String {
    let class = if design.decoupled == Some(true) { "good" } else { "bad" };
    let proof = said::proof(design).map(|text| format!("<p class=\"{class}\">{text}</p>\n")).unwrap_or_default();
    let references = once(design.transfer.iter().map(|entry| &entry.reference));
    let outputs = once(design.transfer.iter().map(|entry| &entry.output));
    let cell = |output: &str, reference: &str| match said::linear(design, reference, output) {
        None => Cell::text("–"),
        Some(entry) if entry.numerator.is_empty() => mark(true, &said::transfer(entry)),
        Some(entry) => Cell::Html(format!("<code>{}</code>", escape(&powers(&said::transfer(entry))))),
    };
    let row = |output: &&String| {
        let cells = references.iter().map(|reference| cell(output, reference));
        std::iter::once(Cell::Head(output.to_string(), 1)).chain(cells).collect()
    };
    let mut headers = vec!["output".to_owned()];
    headers.extend(references.iter().map(|reference| format!("from {reference}")));
    let listed = rows_of(&headers, outputs.iter().map(row).collect());
    let hint = "<p class=\"hint\">Exact, of the linear loop that was designed.</p>\n";
    if listed.is_empty() { proof } else { format!("{proof}{listed}{hint}") }
}

fn cross_coupling(design: &Design) -> String {
    let found = &design.cross_coupling;
    if found.is_empty() {
        return String::new();
    }
    let same = said::window(found, number);
    let with_unit = |value: f64, of: &str| Cell::Number(format!("{} {}", number(value), unit(of)).trim_end().into());
    let row = |c: &CrossCoupling| {
        let mut row = vec![
            Cell::text(said::step(c, number)),
            Cell::text(c.output.clone()),
            Cell::text(if c.own { "own" } else { "other" }),
        ];
        match &c.failure {
            Some(_) => row.extend([mark(false, "failed"), Cell::text(""), Cell::text("")]),
            None => {
                let share = said::relative(c, found).map_or(String::new(), |s| said::share(s, |v| figure(v, 2)));
                row.extend([with_unit(c.peak, &c.unit), with_unit(c.rms, &c.unit), Cell::Number(share)]);
            }
        }
        if same.is_none() {
            row.push(Cell::figure(c.window));
        }
        row
    };
    let mut headers = vec!["step of", "output", "channel", "#peak", "#root mean square", "#of its own step"];
    if same.is_none() {
        headers.push("#window [s]");
    }
    let over = same.as_ref().map(|same| format!(", {same}")).unwrap_or_default();
    let hint = format!(
        "<p class=\"hint\">Deviations in the nonlinear simulation{}, with friction, limits and the true joint \
         angles.</p>\n",
        escape(&over)
    );
    let failure = |c: &CrossCoupling| {
        let why = escape(c.failure.as_ref()?);
        Some(format!("<p class=\"bad\">Step of {}: {why}</p>\n", escape(&said::step(c, number))))
    };
    hint + &pictures::couplings(design)
        + &rows_of(&headers, found.iter().map(row).collect())
        + &found.iter().filter_map(failure).collect::<String>()
}

fn flatness(design: &Design) -> String {
    let sentences = design.flatness.as_ref().map(|found| said::flatness(found, number)).unwrap_or_default();
    items(&sentences.iter().map(|text| powers(text)).collect::<Vec<_>>())
}

fn canonical(found: &Canonical, design: &Design) -> String {
    let all = [&found.transformation, &found.a, &found.b, &found.c].map(Clone::clone);
    let shown = matrices(&all);
    items(&said::canonical(found, design)) + &format!("<details><summary>Matrices</summary>\n{shown}</details>\n")
}

fn controller(design: &Design) -> String {
    let mut body = items(&said::controller(&design.controller_data, number));
    let read = |(signal, of): &(String, String)| vec![Cell::Head(signal.clone(), 1), Cell::text(unit(of))];
    let reads = rows_of(&["signal read", "unit"], design.controller_data.reads.iter().map(read).collect());
    if !reads.is_empty() && !body.is_empty() {
        body += &format!("<details><summary>Signals in their order</summary>\n{reads}</details>\n");
    }
    body
}
