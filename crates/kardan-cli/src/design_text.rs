//! A design as text for the terminal, in 100 columns.

use std::fmt::Write;

use kardan::results::{
    Alternative, Canonical, ChannelResult, CrossCoupling, Design, ExactMatrix, Exploration, Margins, Motion,
    ObserverResult, Robustness, ScenarioStrain, ZeroMode,
};
use kardan_report::words::{self, design as said};

use crate::layout::{WIDTH, cut, heading, more, sentence, table};
use crate::render::visible;
use crate::summary::{long_number, number};

/// More rows of a table are counted, not shown.
const ROWS: usize = 20;
/// A matrix with more rows or columns is not shown.
const LARGE: usize = 24;
/// Longer fractions are shown as numbers.
const FRACTION: usize = 12;
/// Longer names of rows and columns are cut.
const NAME: usize = 16;
/// More names in a row are counted, not shown.
const NAMES: usize = 16;

/// Gives the design in sections: warnings, what was designed, decoupling, gains, channels, poles, sampling, zero dynamics,
/// observer, proof, cross coupling, flatness, canonical form, controller, notes.
pub fn text(design: &Design, origin: &str) -> String {
    let mut out = String::new();
    let name = if design.model.is_empty() { "design" } else { &design.model };
    let _ = writeln!(out, "{name} ({origin})");
    if let Some(first) = design.description.split("\n\n").map(str::trim).find(|text| !text.is_empty()) {
        sentence(&mut out, first);
    }
    out.push('\n');
    sentence(&mut out, &design.verdict().1);
    for warning in &design.warnings {
        sentence(&mut out, &format!("WARNING: {warning}"));
    }
    head(&mut out, design);
    decoupling(&mut out, design);
    if !design.gains.is_empty() {
        heading(&mut out, "Gains");
        design.gains.iter().for_each(|gain| matrix(&mut out, gain));
    }
    channels(&mut out, &design.channels);
    poles(&mut out, design);
    if let Some(found) = &design.margins {
        margins(&mut out, found);
    }
    strains(&mut out, &design.strains);
    zero_dynamics(&mut out, design);
    if let Some(found) = &design.observer {
        observer(&mut out, found);
    }
    proof(&mut out, design);
    cross_coupling(&mut out, &design.cross_coupling);
    if let Some(found) = &design.passage {
        heading(&mut out, "With the parameters of the variant");
        sentences(&mut out, &said::passage(found, number));
    }
    if let Some(found) = &design.exploration {
        exploration(&mut out, found);
    }
    if let Some(found) = &design.robustness {
        robustness(&mut out, found);
    }
    if let Some(found) = &design.flatness {
        heading(&mut out, "Flatness");
        sentences(&mut out, &said::flatness(found, number));
    }
    if let Some(found) = &design.canonical {
        canonical(&mut out, found, design);
    }
    controller(&mut out, design);
    if !design.notes.is_empty() {
        heading(&mut out, "Notes");
        sentences(&mut out, &design.notes);
    }
    visible(&out)
}

fn sentences(out: &mut String, texts: &[String]) {
    texts.iter().take(ROWS).for_each(|text| sentence(out, text));
    more(out, texts.len(), ROWS);
}

fn head(out: &mut String, design: &Design) {
    heading(out, "Design");
    sentences(out, &said::head(design));
    for (what, names) in [("states", &design.states), ("inputs", &design.inputs), ("outputs", &design.outputs)] {
        let shown = if names.is_empty() { "none".into() } else { words::list(names, NAMES) };
        sentence(out, &format!("{what} ({}): {shown}", names.len()));
    }
    let rows: Vec<Vec<String>> = design.definitions.iter().map(|(state, is)| vec![state.clone(), is.clone()]).collect();
    if !rows.is_empty() {
        table(out, &["state", "stands for"], &rows, ROWS);
    }
    if let Some(hidden) = said::hidden(design, number) {
        sentence(out, &hidden);
    }
}

fn decoupling(out: &mut String, design: &Design) {
    let found = said::decouplability(design);
    if found.is_empty() && design.relative_degrees.is_empty() && design.decoupling_matrix.values.is_empty() {
        return;
    }
    heading(out, "Decoupling");
    sentences(out, &found);
    let degrees = design.outputs.iter().zip(&design.relative_degrees);
    let rows: Vec<Vec<String>> =
        degrees.map(|(output, degree)| vec![output.clone(), said::relative_degree(*degree)]).collect();
    if !rows.is_empty() {
        table(out, &["output", "#relative degree"], &rows, ROWS);
    }
    matrix(out, &design.decoupling_matrix);
}

/// A matrix with its names, in as many pieces as its columns need.
fn matrix(out: &mut String, matrix: &ExactMatrix) {
    let (height, width) = (matrix.values.len(), matrix.columns.len());
    if height == 0 || width == 0 {
        return;
    }
    let unit = if matrix.unit.is_empty() { String::new() } else { format!(" [{}]", matrix.unit) };
    let mut rounded = false;
    let mut entry = |row: usize, column: usize| {
        let (text, shortened) = said::entry(matrix, row, column, FRACTION, long_number);
        rounded |= shortened;
        text
    };
    let fits = height.max(width) <= LARGE;
    let cells: Vec<Vec<String>> = match fits {
        true => (0..height).map(|i| (0..width).map(|j| entry(i, j)).collect()).collect(),
        false => vec![],
    };
    let exact = match (&matrix.exact, rounded) {
        (Some(_), false) => ", exact",
        (Some(_), true) => ", long fractions rounded",
        (None, _) => "",
    };
    sentence(out, &format!("{}{unit}{exact}", said::matrix_title(matrix)));
    if !fits {
        let _ = writeln!(out, "  {height} × {width}; --json gives all");
        return;
    }
    let names: Vec<String> = (0..height).map(|i| cut(matrix.rows.get(i).map_or("", String::as_str), NAME)).collect();
    let left = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let headers: Vec<String> = matrix.columns.iter().map(|name| format!("#{}", cut(name, NAME))).collect();
    let wide = |j: usize| {
        let cells = cells.iter().map(|row| row[j].chars().count());
        cells.chain([headers[j].chars().count() - 1]).max().unwrap_or(0) + 2
    };
    let mut from = 0;
    while from < width {
        let mut room = WIDTH.saturating_sub(left + 2);
        let mut until = from;
        while until < width && (until == from || wide(until) <= room) {
            room = room.saturating_sub(wide(until));
            until += 1;
        }
        let titles: Vec<&str> = std::iter::once("").chain(headers[from..until].iter().map(String::as_str)).collect();
        let rows: Vec<Vec<String>> = names
            .iter()
            .zip(&cells)
            .map(|(name, row)| [std::slice::from_ref(name), &row[from..until]].concat())
            .collect();
        table(out, &titles, &rows, LARGE);
        from = until;
    }
}

fn channels(out: &mut String, channels: &[ChannelResult]) {
    if channels.is_empty() {
        return;
    }
    heading(out, "Channels");
    let row = |channel: &ChannelResult| {
        vec![
            channel.output.clone(),
            channel.reference.clone(),
            channel.kind.clone(),
            channel.transfer.clone(),
            words::together(&words::list(&words::pairs(&channel.poles, number), NAMES)),
        ]
    };
    let rows: Vec<Vec<String>> = channels.iter().map(row).collect();
    table(out, &["output", "reference", "kind", "transfer function", "poles 1/s"], &rows, ROWS);
}

fn poles(out: &mut String, design: &Design) {
    if design.closed_loop_poles.is_empty() {
        return;
    }
    heading(out, "Closed-loop poles");
    let all = said::joined(&design.closed_loop_poles);
    let row = |&((re, im), times): &((f64, f64), usize)| {
        let size = re.hypot(im);
        let damping = if size > 0.0 { number(-re / size) } else { "-".into() };
        let times = if times > 1 { format!("{times}×") } else { String::new() };
        let grows = match design.motion((re, im)) {
            Motion::Decays => String::new(),
            Motion::Grows | Motion::Stays => "DOES NOT DECAY".into(),
            Motion::Unknown => "not decided".into(),
        };
        vec![words::pair((re, im), number), times, number(size), damping, said::owner((re, im), design), grows]
    };
    let rows: Vec<Vec<String>> = all.iter().map(row).collect();
    table(out, &["#pole 1/s", "", "#frequency rad/s", "#damping", "of", ""], &rows, 2 * ROWS);
    said::floating_poles(design).into_iter().for_each(|text| sentence(out, text));
}

fn zero_dynamics(out: &mut String, design: &Design) {
    let found = &design.zero_dynamics;
    let sentences_ = said::zero_dynamics(found);
    if sentences_.is_empty() {
        return;
    }
    heading(out, "Zero dynamics");
    sentences(out, &sentences_);
    let row = |mode: &ZeroMode| {
        vec![
            words::pair(mode.pole, number),
            number(mode.natural_frequency),
            number(mode.damping_ratio),
            words::together(&words::motion(&mode.shape, number)),
            words::together(&words::shares(&mode.stored)),
            words::together(&words::shares(&mode.dissipated)),
        ]
    };
    let rows: Vec<Vec<String>> = found.modes.iter().map(row).collect();
    let headers = ["#pole 1/s", "#frequency rad/s", "#damping", "motion", "energy in", "loss in"];
    if !rows.is_empty() {
        table(out, &headers, &rows, ROWS);
    }
    for mode in found.modes.iter().take(ROWS) {
        if let Some(warning) = &mode.warning {
            sentence(out, &format!("WARNING: {} 1/s: {warning}", words::pair(mode.pole, number)));
        }
    }
}

fn observer(out: &mut String, found: &ObserverResult) {
    heading(out, "Observer");
    sentences(out, &said::observer(found));
    let poles = words::list(&words::pairs(&found.poles, number), NAMES);
    if !poles.is_empty() {
        sentence(out, &format!("poles of its error: {poles} 1/s"));
    }
    matrix(out, &found.gain);
}

fn proof(out: &mut String, design: &Design) {
    if design.transfer.is_empty() && design.decoupled.is_none() {
        return;
    }
    heading(out, "Transfer matrix of the linear loop, exact");
    if let Some(proof) = said::proof(design) {
        sentence(out, proof);
    }
    let rows: Vec<Vec<String>> = design
        .transfer
        .iter()
        .map(|entry| vec![entry.reference.clone(), entry.output.clone(), said::transfer(entry)])
        .collect();
    if !rows.is_empty() {
        table(out, &["from", "to", "transfer function"], &rows, 2 * ROWS);
    }
}

fn margins(out: &mut String, found: &Margins) {
    heading(out, "Sampling, delay and limits");
    sentence(out, &found.verdict);
    let rows: Vec<Vec<String>> = said::margins(found, number).into_iter().map(Vec::from).collect();
    if !rows.is_empty() {
        table(out, &["the loop tolerates", "#limit", "beyond it grows"], &rows, ROWS);
    }
    let rows: Vec<Vec<String>> = said::channels(found, number).into_iter().map(Vec::from).collect();
    if !rows.is_empty() {
        table(out, &said::CHANNELS, &rows, ROWS);
    }
    let rows: Vec<Vec<String>> = found.peaks.iter().map(|peak| said::torque_peak(peak, number).to_vec()).collect();
    if !rows.is_empty() {
        table(out, &["step of", "motor", "#asked of it", "#torque limit"], &rows, ROWS);
    }
}

fn strains(out: &mut String, found: &[ScenarioStrain]) {
    let row = |found: &ScenarioStrain| {
        let [asked, limit, time] = said::strain(&found.strain, found.duration, number);
        vec![found.strain.motor.clone(), found.variant.clone(), asked, limit, time]
    };
    let rows: Vec<Vec<String>> = found.iter().map(row).collect();
    if !rows.is_empty() {
        heading(out, "Torques in the scenario");
        table(out, &["motor", "variant", "#largest torque asked", "#limit", "#time at the limit"], &rows, ROWS);
    }
}

fn exploration(out: &mut String, found: &Exploration) {
    heading(out, "Other designs");
    sentences(out, &said::exploration(found));
    let mut best: Vec<&Alternative> = found.designs.iter().filter(|one| one.best).collect();
    best.retain(|one| one.bandwidth == 1.0);
    best.sort_by(|a, b| b.sample_time.total_cmp(&a.sample_time).then(a.torque.total_cmp(&b.torque)));
    let headers = ["rate", "bandwidth", "effort", "sensors", "#interaction", "#torque", "#noise", "#spectral radius"];
    let rows: Vec<Vec<String>> = best.iter().map(|one| said::alternative(found, one, number).to_vec()).collect();
    if !rows.is_empty() {
        sentence(
            out,
            "With the bandwidth of the file, those that none at no higher rate beats in both interaction and torque:",
        );
        table(out, &headers, &rows, 2 * ROWS);
    }
    let rows: Vec<Vec<String>> = found
        .sensors
        .iter()
        .map(|(name, with)| {
            let [_, _, _, _, interaction, _, noise, radius] = said::alternative(found, with, number);
            vec![name.clone(), interaction, noise, radius]
        })
        .collect();
    if !rows.is_empty() {
        sentence(out, "With one more sensor, the best first:");
        table(out, &["sensor", "#interaction", "#noise", "#spectral radius"], &rows, ROWS);
    }
}

fn robustness(out: &mut String, found: &Robustness) {
    heading(out, "Box of plants");
    sentences(out, &said::robustness(found, number));
    for (what, all) in [("signal", &found.interactions), ("motor", &found.peaks)] {
        let rows: Vec<Vec<String>> = all.iter().map(|one| said::interaction(one, number).to_vec()).collect();
        if !rows.is_empty() {
            let headers =
                ["step of", what, "#nominal", "#median", "#90 %", "#99 %", "#largest", "#worst corner", "unit"];
            table(out, &headers, &rows, ROWS);
        }
    }
}

fn cross_coupling(out: &mut String, found: &[CrossCoupling]) {
    if found.is_empty() {
        return;
    }
    let same = said::window(found, number);
    let over = same.as_ref().map(|same| format!(", {same}")).unwrap_or_default();
    heading(out, &format!("Cross coupling in the nonlinear simulation{over}"));
    let row = |c: &CrossCoupling| {
        let window = if same.is_some() { String::new() } else { number(c.window) };
        let channel = if c.own { "own" } else { "other" }.to_owned();
        let mut row = vec![said::step(c, number), c.output.clone(), channel];
        row.extend(match &c.failure {
            Some(_) => ["failed", "", "", "", ""].map(String::from),
            None => {
                let share = said::relative(c, found).map_or(String::new(), |share| said::share(share, number));
                [number(c.peak), number(c.rms), c.unit.clone(), share, window]
            }
        });
        row
    };
    let rows: Vec<Vec<String>> = found.iter().map(row).collect();
    let window = if same.is_some() { "" } else { "#window s" };
    let headers = ["step of", "output", "channel", "#peak", "#rms", "unit", "#of its own step", window];
    table(out, &headers, &rows, 2 * ROWS);
    for (c, why) in found.iter().filter_map(|c| Some((c, c.failure.as_ref()?))).take(ROWS) {
        sentence(out, &format!("FAILED: {}: {why}", said::step(c, number)));
    }
}

fn canonical(out: &mut String, found: &Canonical, design: &Design) {
    heading(out, "Canonically decoupled form");
    sentences(out, &said::canonical(found, design));
    for part in [&found.transformation, &found.a, &found.b, &found.c] {
        matrix(out, part);
    }
}

fn controller(out: &mut String, design: &Design) {
    let texts = said::controller(&design.controller_data, number);
    if texts.is_empty() {
        return;
    }
    heading(out, "Controller");
    sentences(out, &texts);
    if !design.controller_data.block.is_empty() {
        sentence(out, "`--controller FILE` writes it with every bit of its numbers.");
    }
}

#[cfg(test)]
mod tests {
    use super::text;
    use kardan::results::example;

    #[test]
    fn the_steering_reads_as_a_whole() {
        let shown = text(&example::decoupled_steering(), "built-in model sia-steering");
        let expected = include_str!("design_text_steering.txt");
        assert_eq!(shown, expected, "\n{shown}");
    }

    #[test]
    fn lines_fit_and_what_went_wrong_is_said() {
        for design in [example::decoupled_steering(), example::observed_train(), kardan::results::Design::default()] {
            let shown = text(&design, "here");
            for line in shown.lines() {
                assert!(line.chars().count() <= 100, "{line}");
                assert_eq!(line, line.trim_end());
            }
            assert!(!shown.contains("NaN"));
        }
        let shown = text(&example::observed_train(), "here");
        let shown = shown.split_whitespace().collect::<Vec<_>>().join(" ");
        for part in [
            "Not decoupled; the closed loop is unstable",
            "WARNING: The law cancels an unstable mode at 420 1/s.",
            "wheel.w never",
            "with 2 integrators before motor - 2 wheel_motor",
            "DOES NOT DECAY",
            "NOT stable, decided exactly",
            "WARNING: 420 1/s: unstable",
            "0 (exact)",
            "(-3/2 s)/(s^4 + 21 s^3",
            "FAILED: ref_torque by 1 rad: the run stopped at 0.3 s",
            "not controllable: 0",
        ] {
            assert!(shown.contains(part), "{part} missing in\n{shown}");
        }
    }

    #[test]
    fn hostile_names_do_no_harm() {
        let shown = text(&example::hostile_design("\u{1b}[31m\nx"), "here");
        assert!(!shown.contains('\u{1b}') && !shown.contains("NaN"));
    }
}
