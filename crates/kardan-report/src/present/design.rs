//! A design as a page.

use super::{alternatives, margins, optional, responses};
use crate::design_pictures as pictures;
use crate::groups::distinct;
use crate::model::{Body, Cell, Page, row, warnings};
use crate::phrases::{self, design as design_phrases, list, listed, pairs};
use crate::text::{DIGITS, number, quantity};
use kardan_results::{
    Canonical, ChannelResult, ControllerData, CrossCoupling, DataMatrix, DataNumber, Decouplability, Design, Feedback,
    Flatness, HiddenMotion, Integrators, LoopAlongPath, Motion, NO_RESPONSES, ObserverResult, Pole, Stability,
    ZeroMode,
};

/// More poles are counted where space is limited.
const POLES: usize = 40;
/// More names in a sentence are counted.
const NAMES: usize = 12;
/// Accuracy of poles that are not roots of an exact polynomial.
const FLOATING: &str = "These poles are eigenvalues in floating point; whether a motion decays whose pole is within \
                        a millionth of the fastest one around the axis is not decided.";

/// The page of a design.
pub fn page(design: &Design) -> Page {
    let name = match (design.model.is_empty(), design.controller.is_empty()) {
        (true, true) => "Design".into(),
        (true, _) => design.controller.clone(),
        (_, true) => design.model.clone(),
        _ => format!("{}: {}", design.model, design.controller),
    };
    let motor_loads = design.motor_loads.iter().map(|one| (one.variant.clone(), &one.motor_load, one.duration));
    let new = Body::default;
    Page {
        name,
        description: design.description.clone(),
        verdict: Some(design.verdict()),
        alerts: warnings(&design.warnings),
        sections: Page::sections([
            super::mechanism(&design.mechanism),
            ("design", "Design", head(design)),
            ("decoupling", "Decoupling", decoupling(design)),
            ("gains", "Gains", new().matrices(&design.gains)),
            ("channels", "Channels", channels(&design.channels)),
            ("poles", "Closed-loop poles", poles(design)),
            ("sampling", "Sampling, delay and limits", optional(&design.margins, margins::margins)),
            ("opposite-side", "Opposite side of the kink", optional(&design.opposite_side, margins::opposite_side)),
            ("frequency", "Frequency and step responses", frequency(design)),
            ("strain", "Torques in the scenario", margins::motor_loads(motor_loads)),
            ("zero-dynamics", "Zero dynamics", zero_dynamics(design)),
            ("observer", "Observer", optional(&design.observer, observer)),
            ("proof", "Transfer matrix of the linear loop, exact", proof(design)),
            ("coupling", "Cross coupling", cross_coupling(design)),
            (
                "passage",
                "With the parameters of the variant",
                new().list(design.loop_along_path.iter().flat_map(loop_along_path)),
            ),
            ("exploration", "Other designs", optional(&design.exploration, alternatives::exploration)),
            ("box", "Box of plants", optional(&design.robustness, alternatives::robustness)),
            ("flatness", "Flatness", new().list(design.flatness.iter().flat_map(flatness))),
            ("canonical", "Canonically decoupled form", optional(&design.canonical, |found| canonical(found, design))),
            ("controller", "Controller", controller(design)),
            (
                "remarks",
                "Notes of the design",
                new().list(design.notes.iter().filter(|note| !note.starts_with(NO_RESPONSES)).cloned()),
            ),
        ]),
        ..Page::default()
    }
}

fn frequency(design: &Design) -> Body {
    let margins = design.margins.as_ref().map(|margins| margins.channels.as_slice()).unwrap_or_default();
    match &design.responses {
        Some(found) => responses::responses(found, margins),
        None => Body::default()
            .list(design.notes.iter().filter(|note| note.starts_with(NO_RESPONSES)).map(|note| sentence(note))),
    }
}

fn head(design: &Design) -> Body {
    if design.controller.is_empty() && design.law.is_empty() {
        return Body::default();
    }
    let hidden = match list(&pairs(&design.hidden), NAMES).as_str() {
        "" => String::new(),
        values => {
            format!("The motions at {values} 1/s are not observable in the outputs; the law leaves them unchanged.")
        }
    };
    let definitions = design.definitions.iter().map(|one| row![&one.state, &one.expression]);
    Body::default()
        .list(what_is_designed(design))
        .names("States", &design.states)
        .names("Inputs", &design.inputs)
        .names("Outputs", &design.outputs)
        .part("States that are combinations of coordinates", Body::default().table(&["state", "is"], definitions))
        .paragraph(hidden)
}

/// The controller, its design model, and other parts of the loop: one sentence each.
fn what_is_designed(design: &Design) -> Vec<String> {
    let mut out = vec![format!("Controller {}, law {}.", or_dash(&design.controller), or_dash(&design.law))];
    if !design.design_model.is_empty() {
        out.push(format!("Design model: {}.", design.design_model));
    }
    if !design.variant.is_empty() && design.variant != design.model {
        out.push(format!("Variant: {}.", design.variant));
    }
    if !design.other_controllers.is_empty() {
        out.push(format!(
            "Closed-loop poles and simulation also include: {}. Transfer functions do not.",
            list(&design.other_controllers, NAMES)
        ));
    }
    out
}

fn or_dash(text: &str) -> &str {
    if text.is_empty() { "–" } else { text }
}

fn decoupling(design: &Design) -> Body {
    let degree = |degree: &Option<usize>| match degree {
        Some(degree) => Cell::from(*degree),
        None => Cell::Mark(false, "never".into()),
    };
    let degrees = design.outputs.iter().zip(&design.relative_degrees);
    Body::default()
        .list(decouplability(design))
        .table(&["output", "#relative degree"], degrees.map(|(output, found)| vec![output.into(), degree(found)]))
        .matrices([&design.decoupling_matrix])
}

/// Whether static, block or dynamic feedback decouples the outputs, and why: one sentence each. Empty if not
/// requested.
fn decouplability(design: &Design) -> Vec<String> {
    let found = &design.decouplability;
    let Decouplability { rank, normal_rank, possible, integrators, reasons, .. } = found;
    if *rank == 0 && *normal_rank == 0 && reasons.is_empty() {
        return Vec::new();
    }
    let blocks: Vec<String> = found.blocks.iter().map(|block| format!("{{{}}}", block.join(", "))).collect();
    let in_blocks = if blocks.is_empty() { String::new() } else { format!(": {}", list(&blocks, NAMES)) };
    let added: Vec<String> = integrators
        .iter()
        .map(|Integrators { input, count }| {
            format!("{count} integrator{} before {input}", if *count == 1 { "" } else { "s" })
        })
        .collect();
    let added = if added.is_empty() { String::new() } else { format!(" with {}", list(&added, NAMES)) };
    let mut out = vec![match possible {
        Feedback::Static => "Static state feedback decouples every output from the others.".into(),
        Feedback::Block => format!("Static state feedback decouples blocks of outputs only{in_blocks}."),
        Feedback::Dynamic => {
            format!("Static state feedback does not decouple the outputs, dynamic feedback does{added}.")
        }
        Feedback::Impossible => "No state feedback decouples the outputs.".into(),
    }];
    if *possible != Feedback::Block && !blocks.is_empty() && *possible != Feedback::Static {
        out.push(format!("Static feedback decouples these blocks{in_blocks}."));
    }
    out.extend(reasons.iter().map(|reason| sentence(reason)));
    out.push(format!(
        "G has rank {rank} ({} × {}), the transfer matrix has normal rank {normal_rank}; both exact.",
        design.outputs.len(),
        design.inputs.len()
    ));
    out
}

fn sentence(text: &str) -> String {
    let text = phrases::capital(text);
    if text.ends_with(['.', '!', '?']) { text } else { text + "." }
}

fn channels(channels: &[ChannelResult]) -> Body {
    let row = |channel: &ChannelResult| {
        let ChannelResult { output, reference, kind, transfer, poles, .. } = channel;
        let poles = phrases::unbroken(&list(&pairs(poles), 12));
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
            phrases::pair(pole),
            if times > 1 { format!("{times}×") } else { String::new() },
            size,
            if size > 0.0 { number(-pole.re / size) } else { "–".into() },
            design_phrases::owner(pole, design),
            word,
        ]
    };
    let headers = ["#pole [1/s]", "#", "#frequency [rad/s]", "#damping", "of", ""];
    Body::default()
        .hint("Linear loop with all controllers, at the design point.")
        .table_of(POLES, &headers, phrases::joined(&design.closed_loop_poles).iter().map(row))
        .hint(if design.exact_poles { "" } else { FLOATING })
        .hint(counters(&design.integrals_without_effect))
        .pictures(pictures::plane(design))
}

/// The role of charges without effect in the loop; empty if there are none.
fn counters(charges: &[String]) -> String {
    let of = list(charges, NAMES);
    match charges.len() {
        0 => String::new(),
        1 => format!(
            "The charge {of} is an integrator without effect: nothing depends on it and no law controls it. Its pole is exactly at zero; it \
             is not listed."
        ),
        _ => format!(
            "The charges {of} are integrators without effect: nothing depends on them and no law controls them. Their poles are exactly at \
             zero; they are not listed."
        ),
    }
}

fn zero_dynamics(design: &Design) -> Body {
    let found = &design.zero_dynamics;
    let row = |mode: &ZeroMode| {
        row![
            phrases::pair(mode.pole),
            mode.natural_frequency,
            mode.damping_ratio,
            phrases::unbroken(&phrases::motion(&mode.shape)),
            phrases::unbroken(&phrases::of_elements(&mode.stored)),
            phrases::unbroken(&phrases::of_elements(&mode.dissipated)),
            Cell::judged(mode.warning.is_none(), ["decays", "warning"]),
        ]
    };
    let headers =
        ["#pole [1/s]", "#frequency [rad/s]", "#damping", "largest motions", "stored in", "lost in", "verdict"];
    let warnings = found.modes.iter().filter_map(|mode| Some((mode, mode.warning.as_ref()?)));
    let no_output = "of the plant; no output shows it";
    let unobservable = |pole: &Pole| {
        let decays = Cell::judged(pole.re < 0.0, ["decays", "does not decay"]);
        row![phrases::pair(*pole), pole.abs(), "", no_output, "", "", decays]
    };
    let hidden = design.without_integrals(design.hidden.clone());
    let rows = found.modes.iter().map(row).chain(hidden.iter().filter(|pole| pole.im >= 0.0).map(unobservable));
    let body = Body::default().list(hidden_motions(design)).table(&headers, rows);
    warnings.fold(body, |body, (mode, text)| body.judge(false, format!("{} 1/s: {text}", phrases::pair(mode.pole))))
}

/// Motions that remain while the outputs are constant: one sentence each. Empty if not requested.
fn hidden_motions(design: &Design) -> Vec<String> {
    let found = &design.zero_dynamics;
    match found.kind() {
        HiddenMotion::Unknown => vec![],
        HiddenMotion::None => vec!["There is none: no motion remains with constant outputs.".into()],
        HiddenMotion::Some => {
            let of =
                if found.polynomial.is_empty() { String::new() } else { format!(": roots of {}", found.polynomial) };
            let of = match list(&pairs(&design.without_integrals(design.hidden.clone())), NAMES).as_str() {
                "" => of,
                poles => format!("{of}, and motions of the plant that no output shows, at {poles} 1/s"),
            };
            let verdict = match found.stability.word {
                Stability::Stable => "They are stable, decided exactly: excited motions decay.".to_string(),
                Stability::Undecided => format!("Whether they are stable is {}.", found.stability),
                _ => format!("They are NOT stable: {}. Excited motions do not decay.", found.stability),
            };
            vec![format!("Motions that remain while the outputs are constant{of}."), verdict]
        }
    }
}

fn observer(found: &ObserverResult) -> Body {
    Body::default()
        .list(estimates(found))
        .names("States", &found.states)
        .part("Poles of its error", super::poles(&found.poles))
        .part("Gain", Body::default().matrices([&found.gain]))
}

/// Measurements and estimates of the observer, and distinguishable torques: one sentence each.
fn estimates(found: &ObserverResult) -> Vec<String> {
    let method = match found.method.as_str() {
        "poles" => "placed poles",
        "kalman" => "a Kalman filter",
        other => other,
    };
    let torques = match &found.disturbances[..] {
        [] => String::new(),
        [one] => format!(", among them the torque on {one}"),
        names => format!(", among them the torques on {}", list(names, NAMES)),
    };
    let mut out = vec![format!(
        "Estimates {} state{}{torques}, from {}; designed by {method}.",
        found.states.len(),
        if found.states.len() == 1 { "" } else { "s" },
        list(&found.sensors, NAMES)
    )];
    out.extend(found.distinguishable.iter().map(|text| sentence(text)));
    out
}

fn proof(design: &Design) -> Body {
    let references = distinct(design.transfer.iter().map(|entry| &entry.reference));
    let outputs = distinct(design.transfer.iter().map(|entry| &entry.output));
    let cell = |output: &str, reference: &str| match design_phrases::linear(design, reference, output) {
        None => "–".into(),
        Some(entry) if entry.numerator.is_empty() => Cell::Mark(true, design_phrases::transfer(entry)),
        Some(entry) => Cell::Code(design_phrases::transfer(entry)),
    };
    let row = |output: &&String| {
        let cells = references.iter().map(|reference| cell(output, reference));
        std::iter::once(Cell::from(*output)).chain(cells).collect()
    };
    let from = references.iter().map(|reference| format!("from {reference}"));
    let headers: Vec<String> = std::iter::once("output".to_owned()).chain(from).collect();
    let proven = match design.decoupled {
        Some(true) => "Every entry that belongs to another channel is exactly zero: the linear loop is decoupled.",
        Some(false) => "Entries that belong to other channels do not vanish: the linear loop is NOT decoupled.",
        None => "",
    };
    let table = Body::default().table_of(POLES, &headers, outputs.iter().map(row));
    Body::default().judge(design.decoupled == Some(true), proven).and(table)
}

/// Length of the observation: `over 2 s`; `None` if there are several windows or none.
fn window(couplings: &[CrossCoupling]) -> Option<String> {
    let first = couplings.first()?.window;
    (first.is_finite() && couplings.iter().all(|candidate| candidate.window == first))
        .then(|| format!("over {} s", number(first)))
}

/// `ref_rk by 1 rad`.
fn step(coupling: &CrossCoupling) -> String {
    format!("{} by {}", coupling.reference, quantity(coupling.step, DIGITS, &coupling.step_unit))
}

fn cross_coupling(design: &Design) -> Body {
    let found = &design.cross_coupling;
    if found.is_empty() {
        return Body::default();
    }
    let same = window(found);
    let over = same.as_ref().map_or(String::new(), |same| format!(", {same}"));
    let amount = |value: Option<f64>, unit: &str| quantity(value.unwrap_or(f64::NAN), DIGITS, unit);
    let row = |c: &CrossCoupling| {
        let mut row = row![step(c), &c.output, if c.same_channel { "own" } else { "other" }];
        row.extend(match &c.failure {
            Some(_) => row![Cell::Mark(false, "failed".into()), "", ""],
            None => {
                let share =
                    design_phrases::relative(c, found).map_or(String::new(), |share| design_phrases::share(share, 5));
                row![amount(c.peak, &c.unit), amount(c.rms, &c.unit), share]
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
        .fold(body, |body, (c, why)| body.judge(false, format!("Step of {}: {why}", step(c))))
}

/// The loop with the parameters of the variant, one sentence each.
fn loop_along_path(found: &LoopAlongPath) -> Vec<String> {
    let degrees = |angle: f64| format!("{} deg", number((1e6 * angle.to_degrees()).round() / 1e6));
    let at = |angle: f64| {
        if found.rotated_coordinates.is_empty() { String::new() } else { format!(" at {}", degrees(angle)) }
    };
    let mut out = vec![
        if found.rotated_coordinates.is_empty() {
            "kardan analyses the linearised loop with the parameters of the variant, which are not those of the design."
                .into()
        } else {
            format!(
                "kardan analyses the linearised loop with the parameters of the variant at {} positions: {} rotated \
                 from {} to {}.",
                found.positions,
                found.rotated_coordinates,
                degrees(found.range.start),
                degrees(found.range.end)
            )
        },
        "Law, observer and plant are linearised there in floating point, without Coulomb friction and motor limits; \
         all controllers are in the loop."
            .into(),
    ];
    out.push(match (found.stable, found.growth < -1e30) {
        (true, _) if found.stability == Stability::Undecided => {
            "Not decided: at some position the distance of a motion from the stability limit is within the floating-point error.".into()
        }
        (true, true) => "No motion grows.".into(),
        (true, false) => {
            format!(
                "No motion grows; the slowest motion decays with {} 1/s{}.",
                number(-found.growth),
                at(found.growth_at)
            )
        }
        (false, _) => format!("UNSTABLE: a motion grows with {} 1/s{}.", number(found.growth), at(found.growth_at)),
    });
    out.extend(found.interactions.iter().filter(|_| found.stable).map(|one| {
        format!(
            "{} by {} {} moves {} by at most {} {}{}; {} {} are acceptable.",
            one.reference,
            number(one.step),
            one.step_unit,
            one.signal,
            number(one.largest),
            one.unit,
            at(one.at),
            number(one.acceptable),
            one.unit
        )
    }));
    out
}

/// Whether the outputs are flat and what they determine: one sentence each.
fn flatness(found: &Flatness) -> Vec<String> {
    let mut out = Vec::new();
    if !found.statement.is_empty() {
        out.push(sentence(&found.statement));
    } else if found.flat {
        out.push("The outputs are flat.".into());
    } else {
        out.push("The outputs are not flat.".into());
    }
    if !found.flat && !found.remainder.is_empty() {
        let values = list(&pairs(&found.poles), NAMES);
        let at = if values.is_empty() { String::new() } else { format!(", at {values} 1/s") };
        out.push(format!("The filter that remains has the poles of {}{at}.", found.remainder));
    }
    let degrees = found.outputs.iter().zip(&found.derivatives);
    out.extend(listed("Derivatives needed", degrees.map(|(name, degree)| format!("{name} up to {degree}")), NAMES));
    out
}

fn canonical(found: &Canonical, design: &Design) -> Body {
    let all = [&found.transformation, &found.a, &found.b, &found.c];
    Body::default().list(sizes(found, design)).fold("Matrices", Body::default().matrices(all))
}

/// The sizes of the parts of the canonically decoupled form: one sentence each.
fn sizes(found: &Canonical, design: &Design) -> Vec<String> {
    let channels = found.sizes.len().saturating_sub(2);
    let name = |k: usize| design.outputs.get(k).cloned().unwrap_or_else(|| format!("channel {}", k + 1));
    let own: Vec<String> = (0..channels).map(|k| format!("{} {}", name(k), found.sizes[k])).collect();
    let mut out = Vec::new();
    if let [.., shared, unreached] = found.sizes[..] {
        out.push(format!(
            "States by channel: {}; in no channel of their own: {shared}; not controllable: {unreached}.",
            list(&own, NAMES)
        ));
    }
    let ranks = found.ranks.iter().enumerate().map(|(k, rank)| format!("all but input {}: {rank}", k + 1));
    out.extend(listed("Ranks of the controllability matrices", ranks, NAMES));
    out
}

fn controller(design: &Design) -> Body {
    let texts = block(&design.controller_data);
    if texts.is_empty() {
        return Body::default();
    }
    let reads = design.controller_data.reads.iter().map(|one| row![&one.signal, &one.unit]);
    let reads = Body::default().table(&["signal read", "unit"], reads);
    Body::default()
        .list(texts)
        .hint("`kardan design --controller FILE` writes it with all bits of its numbers.")
        .detail(Body::default().fold("Signals in their order", reads))
}

/// The firmware block: one sentence each; empty if there is none.
fn block(data: &ControllerData) -> Vec<String> {
    if data.block.is_empty() {
        return Vec::new();
    }
    let time = match data.sample_time {
        Some(time) => format!("every {} s", number(time)),
        None => "in continuous time".into(),
    };
    let reads: Vec<&str> = data.reads.iter().map(|one| one.signal.as_str()).collect();
    let matrices = data.matrices.iter().map(|DataMatrix { name, values: rows }| {
        format!("{name} ({} × {})", rows.len(), rows.first().map_or(0, Vec::len))
    });
    let numbers = data.numbers.iter().map(|DataNumber { name, value }| format!("{name} {}", number(*value)));
    let mut out = vec![
        format!("Block {} of kardan-rt, {time}.", data.block),
        format!("Reads {}; writes {}.", list(&reads, NAMES), list(&data.writes, NAMES)),
    ];
    out.extend(listed("Matrices", matrices, NAMES));
    out.extend(listed("Numbers", numbers, NAMES));
    out
}
