//! A descriptor system: the effects of a singular E.

use crate::model::{Body, Cell, row};
use crate::phrases;
use kardan_results::{Analysis, DescriptorSystem, DescriptorVerdicts};

/// More orders are counted.
const ORDERS: usize = 24;

/// The section.
pub fn descriptor(analysis: &Analysis) -> Body {
    let Some(found) = &analysis.descriptor else { return Body::default() };
    let discrete = analysis.discrete.is_some();
    let body = Body::default()
        .list(orders(found, discrete))
        .table(
            &["", "controllable", "observable"],
            [
                verdict("finite modes (R-)", found, |side| side.finite),
                verdict(if discrete { "causal" } else { "impulses (I-)" }, found, |side| Some(side.impulse)),
                verdict("completely (C-)", found, |side| side.complete),
            ],
        )
        .list(missed(found));
    let unit = if discrete { "" } else { " 1/s" };
    body.part("Transfer of all outputs", Body::default().list(transfer(found, unit, discrete)))
        .hint("What follows is about the equivalent state space.")
}

/// Addition to the sentence on the ranks, and whether the system is complete.
pub fn sentence(found: &DescriptorSystem) -> (bool, String) {
    let sides = [(&found.controllability, "controllable"), (&found.observability, "observable")];
    let word = |side: &DescriptorVerdicts, what: &str| match (side.complete, side.impulse) {
        (Some(true), _) => format!("completely {what}"),
        (_, true) => format!("impulse {what}, not completely {what}"),
        (_, false) => format!("not impulse {what}"),
    };
    let parts = sides.map(|(side, what)| word(side, what));
    let sound = sides.iter().all(|(side, _)| side.impulse);
    (sound, format!("Descriptor system of index {}: {}; {}.", found.index, parts[0], parts[1]))
}

fn orders(found: &DescriptorSystem, discrete: bool) -> Vec<String> {
    let blocks: Vec<String> = found.infinite_blocks.iter().map(usize::to_string).collect();
    let free = match (found.impulse_free, discrete) {
        (true, false) => "no impulses",
        (true, true) => "causal",
        (false, false) => "inconsistent initial values or input steps can cause impulses",
        (false, true) => "variables may depend on inputs of later samples",
    };
    let mut all = vec![
        format!(
            "E is singular: rank {} of {}. The pencil sE - A is regular, of index {}: {free}.",
            found.rank_of_e, found.variables, found.index
        ),
        format!(
            "Finite eigenvalues: {}. Blocks at infinity, by order: {}.",
            found.finite_eigenvalues,
            phrases::list(&blocks, ORDERS)
        ),
    ];
    all.extend(phrases::defined("States of the equivalent state space", &found.definitions));
    all
}

fn verdict(what: &str, found: &DescriptorSystem, of: fn(&DescriptorVerdicts) -> Option<bool>) -> Vec<Cell> {
    row![what, Cell::decided(of(&found.controllability)), Cell::decided(of(&found.observability))]
}

fn missed(found: &DescriptorSystem) -> Vec<String> {
    let sides = [(&found.controllability, "not controllable"), (&found.observability, "not observable")];
    let of = |(side, what): &(&DescriptorVerdicts, &str)| {
        let impulses = match side.impulse_defect {
            0 => String::new(),
            count => format!("; impulse rank deficient by {count}"),
        };
        (side.infinite_defect > 0).then(|| format!("Infinite eigenvalues {what}: {}{impulses}.", side.infinite_defect))
    };
    sides.iter().filter_map(of).collect()
}

fn transfer(found: &DescriptorSystem, unit: &str, discrete: bool) -> Vec<String> {
    let mut all = Vec::new();
    if found.polynomial_part.is_empty() {
        all.push(
            "The transfer matrix is proper: the equivalent state space has all outputs, with direct feedthrough."
                .into(),
        );
    } else {
        let entry =
            |one: &kardan_results::ImproperEntry| format!("from {} to {}: {}", one.input, one.output, one.polynomial);
        let entries: Vec<String> = found.polynomial_part.iter().map(entry).collect();
        let what = if discrete { "later values" } else { "derivatives" };
        all.push(format!(
            "The transfer matrix is improper, outputs respond to {what} of inputs. Its polynomial part: {}.",
            phrases::list(&entries, 12)
        ));
        all.push(format!(
            "No state-space model has these outputs: {} left out below.",
            match found.improper_outputs.as_slice() {
                [one] => format!("{one} is"),
                more => format!("{} are", phrases::list(more, 12)),
            }
        ));
    }
    if let Some(rank) = found.normal_rank {
        all.push(format!("Normal rank: {rank}."));
    }
    let finite = phrases::roots(found.zeros.as_ref(), unit);
    let known = found.zeros.as_ref().filter(|zeros| !zeros.values.is_empty());
    let of = known.map_or(String::new(), |zeros| format!(", the roots of {}", zeros.polynomial));
    all.push(format!("Finite invariant zeros: {finite}{of}."));
    let orders = |all: &Vec<i64>| match all.is_empty() {
        true => "none".to_owned(),
        false => phrases::list(&all.iter().map(i64::to_string).collect::<Vec<_>>(), ORDERS),
    };
    let infinite = found.orders_at_infinity.as_ref().map_or("not decided".to_owned(), orders);
    all.push(format!("Orders of the zeros at infinity (negative: poles): {infinite}."));
    all
}
