//! Margins of a loop with backlash in contact, besides those at its operating point.

use std::collections::BTreeSet;

use super::channels::errors;
use super::clocks::clocks;
use super::stability::{LoopStability, StabilityProblem};
use super::survey::searches;
use super::warnings::close;
use crate::study::PreparedVariant;
use crate::study::loops::loop_blocks;
use kardan_math::num::Matrix;
use kardan_mechanics::equations::Measured;
use kardan_mechanics::reduce::{Contact, Kinematics, OperatingPoint, Reduced, closed_contacts, contacts, motion_of};
use kardan_results::{ContactMargins, Margins};
use kardan_schema::diagnostics::quoted;
use kardan_synthesis::{LoopBlocks, Plant, Survey};

/// Number of elements with backlash up to which all combinations of open and closed ones are analysed; above it only all closed.
const MAX_BACKLASHES: usize = 3;

/// An element whose backlash is open, with its contacts.
struct Backlash<'a> {
    element: &'a str,
    /// At its lower and at its upper flank, as numbers of unilateral constraints.
    flanks: [usize; 2],
}

/// Elements with backlash that are open at the operating point of a variant.
fn open_plays(variant: &PreparedVariant) -> Vec<Backlash<'_>> {
    let unilaterals = &variant.reduced.equations.unilaterals;
    let found = contacts(&variant.reduced, &variant.point.position);
    let ends: BTreeSet<&str> =
        variant.model.elements.iter().filter(|one| one.kind == "end_stop").map(|one| one.name.as_str()).collect();
    let own = |element: &str| {
        found.iter().filter(|one| unilaterals[one.unilateral].element == element).collect::<Vec<&Contact>>()
    };
    let names: BTreeSet<&str> = found.iter().map(|one| unilaterals[one.unilateral].element.as_str()).collect();
    let backlash = |element: &&str| -> Option<Backlash<'_>> {
        let sides = own(element);
        let is_open = sides.len() == 2 && !sides.iter().any(|one| one.soft && one.is_passed());
        let side = |upper: bool| {
            sides.iter().find(|one| unilaterals[one.unilateral].value.is_upper() == upper).map(|one| one.unilateral)
        };
        let element = unilaterals[sides.first()?.unilateral].element.as_str();
        (is_open && !ends.contains(element)).then_some(Backlash { element, flanks: [side(false)?, side(true)?] })
    };
    names.iter().filter_map(backlash).collect()
}

/// The margins of a controller's loop with backlash in contact: with few elements every combination of closed ones, else all closed. One entry for both
/// flanks if these give the same loop. Also why some are not computed.
pub(in crate::study) fn margins_in_contact(
    variant: &PreparedVariant,
    number: usize,
) -> (Vec<ContactMargins>, Option<String>) {
    let backlashes = open_plays(variant);
    if backlashes.is_empty() || number >= variant.designed.len() {
        return (Vec::new(), None);
    }
    let read = variant.designed.iter().flat_map(|law| law.sensors()).find(|sensor| {
        matches!(&sensor.measured, Measured::SpringTorque(name) if backlashes.iter().any(|backlash| backlash.element == name))
    });
    if let Some(sensor) = read {
        let why = format!(
            "the loop is not analysed with backlash in contact: `{}` reads the torque of the contact",
            sensor.name
        );
        return (Vec::new(), Some(why));
    }
    // Bit k of a choice: whether the element k is closed.
    let all = 1usize << backlashes.len().min(MAX_BACKLASHES);
    let last = if backlashes.len() <= MAX_BACKLASHES { 1 } else { all - 1 };
    let mut out = Vec::new();
    for choice in (last..all).rev() {
        let is_closed = |(k, _): &(usize, &Backlash<'_>)| *k >= MAX_BACKLASHES || choice >> k & 1 == 1;
        let (closed, open): (Vec<_>, Vec<_>) = backlashes.iter().enumerate().partition(is_closed);
        let names = |of: &[(usize, &Backlash<'_>)]| of.iter().map(|(_, one)| one.element.to_string()).collect();
        let (closed_names, open_names): (Vec<String>, Vec<String>) = (names(&closed), names(&open));
        let flank = |upper: usize| {
            let unilaterals: BTreeSet<usize> = closed.iter().map(|(_, backlash)| backlash.flanks[upper]).collect();
            in_contact(variant, &unilaterals)
        };
        let [lower, upper] = [flank(0), flank(1)];
        let same = lower.linear_model() == upper.linear_model();
        let cases: &[(&str, &PreparedVariant)] = match same {
            true => &[("either", &lower)],
            false => &[("lower", &lower), ("upper", &upper)],
        };
        for (flank, variant) in cases {
            let (closed, open, flank) = (closed_names.clone(), open_names.clone(), (*flank).into());
            out.push(ContactMargins { closed, open, flank, ..of_loop(variant, number) });
        }
    }
    let omission = (backlashes.len() > MAX_BACKLASHES).then(|| {
        let names = quoted(backlashes.iter().map(|backlash| backlash.element));
        format!(
            "for {names} kardan lists the margins with all in contact and with all open; those with some in contact \
             were not computed"
        )
    });
    (out, omission)
}

/// A variant with these contacts closed, where they just touch.
fn in_contact(variant: &PreparedVariant, closed: &BTreeSet<usize>) -> PreparedVariant {
    let reduced = &variant.reduced;
    let position = touching(reduced, &variant.point.position, closed);
    let model = closed_contacts(reduced, closed, &position);
    let whole = OperatingPoint { position, ..variant.point.clone() };
    let [position, rates] = motion_of(&model, reduced, &whole);
    with_plants(variant, model, OperatingPoint { position, rates, ..whole })
}

/// A variant with another model of its loop, also of its laws, except those that leave elements out.
pub(in crate::study) fn with_plants(
    variant: &PreparedVariant,
    model: Reduced,
    point: OperatingPoint,
) -> PreparedVariant {
    let plant = |(number, own): (usize, &Plant)| {
        if variant.leaves_out(number) {
            return own.clone();
        }
        let mut plant = Plant::at(model.clone(), point.clone());
        plant.signals.clone_from(&own.signals);
        plant.elements.clone_from(&own.elements);
        plant.frozen.clone_from(&own.frozen);
        plant
    };
    let design_models = variant.design_models.iter().enumerate().map(plant).collect();
    PreparedVariant { design_models, ..variant.with_model(model, point) }
}

/// The nearest position at which these contacts just touch.
fn touching(reduced: &Reduced, position: &[f64], closed: &BTreeSet<usize>) -> Vec<f64> {
    let kinematics = Kinematics::at_rest(reduced, position);
    let all = contacts(reduced, position);
    let gaps: Vec<&Contact> = all.iter().filter(|one| closed.contains(&one.unilateral)).collect();
    let mut rows = vec![vec![0.0; position.len()]; gaps.len()];
    for (one, row) in gaps.iter().zip(&mut rows) {
        kinematics.project(&reduced.equations.unilaterals[one.unilateral].row_f64(), row);
    }
    let matrix = Matrix::from_fn(rows.len(), position.len(), |i, j| rows[i][j]);
    let gap = Matrix::from_fn(gaps.len(), 1, |i, _| gaps[i].gap);
    let Some(shares) = matrix.multiply(&matrix.transpose()).solve(&gap) else { return position.to_vec() };
    let change = matrix.transpose().multiply(&shares);
    position.iter().enumerate().map(|(k, x)| x - change[(k, 0)]).collect()
}

/// Whether the loop of a controller is stable, and the margins of its channels.
fn of_loop(variant: &PreparedVariant, number: usize) -> ContactMargins {
    let (laws, plant) = (&variant.designed, variant.loop_plant());
    let clocks = clocks(&variant.model.controls);
    let blocks = loop_blocks::blocks(variant, &plant).of_loop;
    let survey = Survey { plant: &plant, laws, clocks: &clocks, number, blocks: &blocks };
    let no_blocks = LoopBlocks::default();
    let reduced_survey =
        Survey { blocks: if searches(&blocks, clocks[number]) { &blocks } else { &no_blocks }, ..survey };
    let found = survey.slowest(survey.unchanged());
    let parts = survey.parts().map_or_else(Vec::new, |(parts, _)| parts);
    let problem = StabilityProblem { variant, plant: &plant, parts: &parts, has_blocks: !blocks.is_empty() };
    let decided = found.as_ref().map(|found| problem.decide(found, problem.exact(found).as_ref()));
    let stable = decided.as_ref().and_then(LoopStability::controlled_is_stable);
    let (channels, multiloop) =
        if stable == Some(true) { errors(variant, &reduced_survey) } else { Default::default() };
    ContactMargins { stable, channels, multiloop, ..ContactMargins::default() }
}

/// `mesh1 and mesh2 in contact`, with the flank if it matters.
fn describe_contact(one: &ContactMargins) -> String {
    let flank = match one.flank.as_str() {
        "either" => "on either flank".to_string(),
        flank => format!("on the {flank} flank"),
    };
    let open = match one.open.is_empty() {
        true => String::new(),
        false => format!(" and {} open", quoted(&one.open)),
    };
    format!("{} in contact ({flank}){open}", quoted(&one.closed))
}

/// Text for a loop with backlash: which contacts its margins leave open, and the least disk margin in contact.
pub(in crate::study) fn contacts_verdict(margins: &Margins) -> Option<String> {
    let first = margins.contacts.first()?;
    let mut out =
        vec![format!("All results above are with {} open (backlash).", quoted(first.closed.iter().chain(&first.open)))];
    for one in &margins.contacts {
        let least = one.channels.iter().filter(|one| !one.is_sensor).min_by(|a, b| a.disk.total_cmp(&b.disk));
        out.push(match (one.stable, least) {
            (Some(false), _) => format!("With {} the loop is UNSTABLE.", describe_contact(one)),
            (Some(true), Some(least)) => format!(
                "With {} the least disk margin of a motor is {:.4} (`{}`){}.",
                describe_contact(one),
                least.disk,
                least.name,
                one.multiloop
                    .as_ref()
                    .map_or(String::new(), |all| format!(", of all its motors at once {:.4}", all.disk[0]))
            ),
            _ => format!("With {} the margins are not known.", describe_contact(one)),
        });
    }
    Some(out.join(" "))
}

/// Important warnings for the loop in contact: the worst motor of each combination of contacts.
pub(in crate::study) fn contact_warnings(margins: &Margins) -> Vec<String> {
    let of = |one: &ContactMargins| match one.stable {
        Some(false) if margins.stable != Some(false) => Some("the loop is unstable".to_string()),
        _ => {
            let motors = one.channels.iter().filter(|one| !one.is_sensor);
            motors.min_by(|a, b| a.disk.total_cmp(&b.disk)).and_then(close)
        }
    };
    let verdict = margins.contacts.iter().filter_map(|one| Some((one, of(one)?)));
    verdict.map(|(one, verdict)| format!("with {}: {verdict}", describe_contact(one))).collect()
}
