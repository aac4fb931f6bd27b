//! An analysis as text for the terminal, in 100 columns.

use std::fmt::Write;

use kardan::results::{
    Analysis, Basis, Class, ConstraintForces, LossSearch, Mode, Placement, PlacementSearch, Sensitivity, Structure,
};
use kardan_report::words;

use crate::layout::{cut, heading, more, sentence, table};
use crate::render::visible;
use crate::summary::number;

/// More rows of a table are counted, not shown.
const ROWS: usize = 20;
/// More sets of places are counted, not shown.
const SETS: usize = 8;
/// More names in a row are counted, not shown.
const NAMES: usize = 8;

/// Gives the analysis in sections: class, reduction, modes, structure, least numbers, placement, sensitivity,
/// certificate.
pub fn text(analysis: &Analysis, origin: &str) -> String {
    let mut out = String::new();
    let name = if analysis.name.is_empty() { "analysis" } else { &analysis.name };
    let _ = writeln!(out, "{name} ({origin})");
    if let Some(first) = analysis.description.split("\n\n").map(str::trim).find(|text| !text.is_empty()) {
        sentence(&mut out, first);
    }
    if let Some(why) = &analysis.unfinished {
        sentence(&mut out, &format!("NOT COMPLETE, {why}."));
    }
    if let Some(found) = &analysis.class {
        class(&mut out, found);
    }
    reduction(&mut out, analysis);
    if let Some(forces) = &analysis.constraint_forces {
        constraint_forces(&mut out, forces);
    }
    if let Some(found) = &analysis.elimination {
        heading(&mut out, "Motions without inertia");
        words::elimination(found, &analysis.structure).iter().for_each(|text| sentence(&mut out, text));
    }
    modes(&mut out, &analysis.modes, &analysis.structure);
    structure(&mut out, &analysis.structure);
    least_numbers(&mut out, &analysis.structure);
    placement(&mut out, &analysis.placement);
    if let Some(found) = &analysis.sensitivity {
        sensitivity(&mut out, found);
    }
    certificate(&mut out, analysis);
    visible(&out)
}

fn yes(holds: bool) -> String {
    if holds { "yes" } else { "NO" }.to_owned()
}

fn class(out: &mut String, class: &Class) {
    heading(out, "Class");
    sentence(out, &words::class(class));
    for assumption in class.assumptions.iter().filter(|assumption| !assumption.holds) {
        sentence(out, &format!("broken: {}", assumption.statement));
        let breaches = words::breaches(assumption);
        for (elements, why) in breaches.iter().take(ROWS) {
            sentence(out, &format!("  by {}: {why}", words::list(elements, 2 * NAMES)));
        }
        more(out, breaches.len(), ROWS);
    }
    let constraints: Vec<Vec<String>> = class
        .constraints
        .iter()
        .map(|c| vec![c.element.clone(), c.equation.clone(), words::constraint_kind(c)])
        .collect();
    if !constraints.is_empty() {
        table(out, &["constraint", "equation", "kind"], &constraints, ROWS);
    }
    let point = &class.operating_point;
    let moved: Vec<String> = point
        .angles
        .iter()
        .filter(|(_, angle)| *angle != 0.0)
        .map(|(shaft, angle)| format!("{shaft} = {} rad", number(*angle)))
        .collect();
    let rest = if moved.is_empty() { "all angles 0 rad" } else { "all other angles 0 rad" };
    let at = if moved.is_empty() { rest.into() } else { format!("{}; {rest}", words::list(&moved, NAMES)) };
    if !point.angles.is_empty() {
        sentence(out, &format!("operating point: {at}"));
    }
    let friction: Vec<Vec<String>> = point
        .friction
        .iter()
        .map(|(element, torque, stuck)| {
            let state = if *stuck { "stuck: a constraint here" } else { "slipping: a constant torque here" };
            vec![element.clone(), number(*torque), state.into()]
        })
        .collect();
    if !friction.is_empty() {
        table(out, &["friction", "#Coulomb torque N m", "state"], &friction, ROWS);
    }
}

fn reduction(out: &mut String, analysis: &Analysis) {
    if analysis.coordinates.is_empty() && analysis.bases.is_empty() {
        return;
    }
    heading(out, "Reduction");
    let count = analysis.coordinates.len();
    let plural = if count == 1 { "" } else { "s" };
    sentence(out, &format!("{count} coordinate{plural}: {}", words::list(&analysis.coordinates, NAMES)));
    let rows: Vec<Vec<String>> = analysis.bases.iter().flat_map(bounds).collect();
    if !rows.is_empty() {
        table(out, &["basis", "#not orthogonal by", "matrix", "eigenvalues", "within discs", "unit"], &rows, ROWS);
    }
}

fn bounds(basis: &Basis) -> Vec<Vec<String>> {
    let row = |(k, bounds): (usize, &kardan::results::EigenvalueBounds)| {
        let eigenvalues: Vec<String> = bounds.eigenvalues.iter().map(|&value| number(value)).collect();
        let shown = match &eigenvalues[..] {
            [first, .., last] if eigenvalues.len() > 4 => format!("{first} … {last} ({} in all)", eigenvalues.len()),
            all => all.join(", "),
        };
        let first = k == 0;
        vec![
            if first { basis.name.clone() } else { String::new() },
            if first { number(basis.orthogonality) } else { String::new() },
            bounds.matrix.clone(),
            shown,
            words::discs(bounds, number),
            bounds.unit.clone(),
        ]
    };
    basis.bounds.iter().enumerate().map(row).collect()
}

fn constraint_forces(out: &mut String, forces: &ConstraintForces) {
    heading(out, "Constraint forces");
    let plural = if forces.rank == 1 { "" } else { "s" };
    sentence(
        out,
        &format!(
            "The projector has rank {}: {} independent constraint{plural}; P² - P = 0 within {}.",
            forces.rank,
            forces.rank,
            number(forces.idempotence_residual)
        ),
    );
    let map = &forces.input_to_multiplier;
    let mut headers = vec!["multiplier per unit of input".to_owned()];
    headers.extend(map.columns.iter().take(NAMES).map(|column| format!("#{column}")));
    let row = |(values, name): (&Vec<f64>, &String)| {
        std::iter::once(name.clone()).chain(values.iter().take(NAMES).map(|&value| number(value))).collect()
    };
    let rows: Vec<Vec<String>> = map.values.iter().zip(&map.rows).map(row).collect();
    if !rows.is_empty() {
        table(out, &headers.iter().map(String::as_str).collect::<Vec<_>>(), &rows, ROWS);
    }
}

/// The same where it is decided.
fn told(decided: Option<bool>, holds: bool) -> String {
    decided.map_or_else(|| "NOT DECIDED".to_owned(), |_| yes(holds))
}

fn modes(out: &mut String, modes: &[Mode], structure: &Structure) {
    if modes.is_empty() {
        return;
    }
    heading(out, "Modes");
    let has_energy = modes.iter().any(|mode| !mode.stored.is_empty());
    let mut headers = vec!["##", "#Hz", "#damping", "#eigenvalue 1/s", "reached", "seen", "shape"];
    if has_energy {
        headers.push("energy in");
    }
    let row = |(k, mode): (usize, &Mode)| {
        let mut row = vec![
            (k + 1).to_string(),
            number(mode.natural_frequency / std::f64::consts::TAU),
            number(mode.damping_ratio),
            words::pair(mode.eigenvalue, number),
            told(structure.controllability(), mode.controllable),
            told(structure.observability(), mode.observable),
            words::together(&words::shape(mode, number)),
        ];
        if has_energy {
            row.push(words::together(&words::stored(mode)));
        }
        row
    };
    let rows: Vec<Vec<String>> = modes.iter().enumerate().map(row).collect();
    table(out, &headers, &rows, 2 * ROWS);
}

fn structure(out: &mut String, structure: &Structure) {
    heading(out, "Structure");
    let states = structure.states.len();
    for (what, names) in [("states", &structure.states), ("inputs", &structure.inputs), ("outputs", &structure.outputs)]
    {
        let shown = if names.is_empty() { "none".into() } else { words::list(names, 2 * NAMES) };
        sentence(out, &format!("{what} ({}): {shown}", names.len()));
    }
    let rows = [
        ("controllable", structure.controllability(), Some(structure.controllable_rank)),
        ("observable", structure.observability(), Some(structure.observable_rank)),
        ("minimal", structure.minimality(), None),
    ]
    .map(|(what, holds, rank)| {
        let rank = rank.map_or_else(String::new, |rank| words::rank(rank, states, holds.is_some()));
        vec![what.to_owned(), told(holds, holds == Some(true)), rank]
    });
    table(out, &["", "", ""], &rows, ROWS);
    for (list, verb) in [
        (&structure.uncontrollable, "Not reached by the inputs: "),
        (&structure.unobservable, "Not seen in the outputs: "),
    ] {
        for mode in list.iter().take(ROWS) {
            sentence(out, &format!("{verb}{}", words::failing(mode, number)));
        }
        more(out, list.len(), ROWS);
    }
    relative_degrees(out, structure);
    zeros(out, structure);
}

fn relative_degrees(out: &mut String, structure: &Structure) {
    if structure.relative_degrees.iter().all(Vec::is_empty) {
        return;
    }
    let mut headers = vec!["relative degree of".to_owned(), "#least".to_owned()];
    headers.extend(structure.inputs.iter().take(NAMES).map(|input| format!("#{}", cut(input, 12))));
    let degree = |degree: Option<&usize>| degree.map_or("-".into(), usize::to_string);
    let row = |(degrees, output): (&Vec<Option<usize>>, &String)| {
        let mut row = vec![output.clone(), degree(degrees.iter().flatten().min())];
        row.extend(degrees.iter().take(NAMES).map(|found| degree(found.as_ref())));
        row
    };
    let rows: Vec<Vec<String>> = structure.relative_degrees.iter().zip(&structure.outputs).map(row).collect();
    table(out, &headers.iter().map(String::as_str).collect::<Vec<_>>(), &rows, ROWS);
    if structure.inputs.len() > NAMES {
        let _ = writeln!(out, "  … and {} more inputs; --json gives all", structure.inputs.len() - NAMES);
    }
}

fn zeros(out: &mut String, structure: &Structure) {
    let zeros = &structure.zeros;
    if zeros.values.is_empty() {
        let none = if zeros.growing.is_some() { "none" } else { &zeros.polynomial };
        sentence(out, &format!("zeros: {none}"));
    } else {
        let values = words::list(&words::pairs(&zeros.values, number), NAMES);
        sentence(out, &format!("zeros: {values} 1/s, the roots of {}", zeros.polynomial));
    }
    words::half_plane(zeros).into_iter().for_each(|text| sentence(out, text));
    sentence(out, &words::normal_rank(structure));
}

fn least_numbers(out: &mut String, structure: &Structure) {
    let kind = if structure.kind.is_empty() { String::new() } else { format!(" (case: {})", structure.kind) };
    heading(out, &format!("Least numbers{kind}"));
    let certificate = &structure.certificate;
    sentence(out, &words::least("input", structure.min_inputs, certificate.inputs.as_ref(), structure));
    sentence(out, &words::least("output", structure.min_outputs, certificate.outputs.as_ref(), structure));
    let construction = structure.construction.as_ref().map(words::construction).unwrap_or_default();
    construction.iter().take(ROWS).for_each(|text| sentence(out, text));
    more(out, construction.len(), ROWS);
}

fn placement(out: &mut String, placement: &Placement) {
    let both = [("Motors", "controllable", &placement.inputs), ("Sensors", "observable", &placement.outputs)];
    if both.iter().all(|(_, _, search)| search.is_none()) {
        return;
    }
    heading(out, "Placement");
    for (what, property, search) in both.iter().filter_map(|(what, property, s)| Some((what, property, s.as_ref()?))) {
        sets(out, what, property, search);
    }
}

fn sets(out: &mut String, what: &str, property: &str, search: &PlacementSearch) {
    sentence(out, &format!("{what}: {}", words::search(search)));
    if let Some(why) = &search.none_because {
        sentence(out, &format!("No set makes the model {property}: {why}."));
    }
    if search.sets.is_empty() {
        return;
    }
    let several = search.sets.len() > 1;
    let score = if search.unit.is_empty() { "#score".to_owned() } else { format!("#score {}", search.unit) };
    let rows: Vec<Vec<String>> = search
        .sets
        .iter()
        .enumerate()
        .map(|(k, set)| {
            let mark = if set.efficient && several { "*" } else { "" };
            vec![(k + 1).to_string(), set.places.join(", "), number(set.score), number(set.cost), mark.into()]
        })
        .collect();
    table(out, &["##", "places", &score, "#cost", ""], &rows, SETS);
    if several && search.sets.iter().take(SETS).any(|set| set.efficient) {
        sentence(out, words::EFFICIENT);
    }
}

fn sensitivity(out: &mut String, sensitivity: &Sensitivity) {
    heading(out, "Sensitivity");
    let rows: Vec<Vec<String>> = sensitivity
        .parameters
        .iter()
        .map(|(name, nominal, low, high, unit)| {
            vec![name.clone(), number(*nominal), number(*low), number(*high), unit.clone()]
        })
        .collect();
    if !rows.is_empty() {
        table(out, &["parameter", "#nominal", "#from", "#to", "unit"], &rows, ROWS);
    }
    let say = |out: &mut String, what: &str, search: &Option<LossSearch>| {
        for text in search.iter().flat_map(|search| words::loss(what, search, number)) {
            sentence(out, &text);
        }
    };
    say(out, "controllability", &sensitivity.controllability);
    say(out, "observability", &sensitivity.observability);
}

fn certificate(out: &mut String, analysis: &Analysis) {
    let certificate = &analysis.structure.certificate;
    heading(out, "Certificate");
    sentence(out, &words::certificate(certificate, number));
    for statement in certificate.statements.iter().take(ROWS) {
        sentence(out, &format!("- {statement}"));
    }
    more(out, certificate.statements.len(), ROWS);
    for note in &analysis.notes {
        sentence(out, &format!("note: {note}"));
    }
}

#[cfg(test)]
mod tests {
    use super::text;
    use kardan::results::example;

    #[test]
    fn two_bodies_read_as_a_whole() {
        let shown = text(&example::two_bodies(), "built-in model two-bodies");
        let expected = include_str!("analysis_text_two_bodies.txt");
        assert_eq!(shown, expected, "\n{shown}");
    }

    #[test]
    fn lines_fit_and_long_lists_are_cut() {
        for analysis in [example::two_bodies(), example::train(), kardan::results::Analysis::default()] {
            let shown = text(&analysis, "here");
            for line in shown.lines() {
                assert!(line.chars().count() <= 100, "{line}");
                assert_eq!(line, line.trim_end());
            }
        }
        let shown = text(&example::train(), "here").split_whitespace().collect::<Vec<_>>().join(" ");
        for part in [
            "2 of 3 assumptions do not hold",
            "by joint: its ratio depends on the angle of driver",
            "rack_friction",
            "stuck: a constraint here",
            "… and 6 more; --json gives all",
            "No set makes the model observable: no candidate shows driver",
            "Some zeros lie in the right half-plane",
            "at most 3.1e-17",
            "nonlinear",
            "The motion along joint - 2 rack has no inertia",
            "z1 = 2 joint.w + rack.w",
        ] {
            assert!(shown.contains(part), "{part} missing in\n{shown}");
        }
    }

    #[test]
    fn hostile_names_do_no_harm() {
        let shown = text(&example::hostile("\u{1b}[31m\nx"), "here");
        assert!(!shown.contains('\u{1b}'));
    }
}
