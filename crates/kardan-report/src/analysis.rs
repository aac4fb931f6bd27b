//! An analysis of structure in tables, sentences and pictures.

use super::analysis_pictures as pictures;
use super::summary::matrices;
use super::table::{Cell, section as framed, table};
use super::tables::mark;
use super::text::{escape, figure, powers, unit};
use super::words;
use kardan::results::{
    Analysis, Basis, Class, ConstraintForces, Factor, FailingMode, Loss, Mode, Placement, PlacementSearch, Sensitivity,
    Structure,
};

/// More rows of a long table are counted, not shown.
const ROWS: usize = 100;

pub(super) fn number(value: f64) -> String {
    figure(value, 5)
}

/// One sentence on the ranks; `true` if nothing is missing.
pub(super) fn verdict(analysis: &Analysis) -> Option<(bool, String)> {
    let structure = &analysis.structure;
    let states = structure.states.len();
    if states == 0 {
        return None;
    }
    let (controllable, observable) = (structure.controllable(), structure.observable());
    if structure.undecided != [false; 2] {
        let word = |decided: Option<bool>, what: &str, rank: usize| match decided {
            Some(true) => what.to_owned(),
            Some(false) => format!("not {what} (rank {rank} of {states})"),
            None => format!("whether {what} is not decided (rank at least {rank} of {states})"),
        };
        let text = format!(
            "Not everything could be proven: {}; {}.",
            word(structure.controllability(), "controllable", structure.controllable_rank),
            word(structure.observability(), "observable", structure.observable_rank)
        );
        return Some((false, text));
    }
    let text = match (controllable, observable) {
        (true, true) => format!("Controllable and observable: all {states} states."),
        (false, true) => format!("Not controllable: rank {} of {states}; observable.", structure.controllable_rank),
        (true, false) => format!("Controllable; not observable: rank {} of {states}.", structure.observable_rank),
        (false, false) => format!(
            "Neither controllable (rank {} of {states}) nor observable (rank {} of {states}).",
            structure.controllable_rank, structure.observable_rank
        ),
    };
    Some((structure.minimal(), text))
}

/// What stands above the contents: that it ended early.
pub(super) fn alerts(analysis: &Analysis) -> String {
    analysis.unfinished.as_ref().map_or(String::new(), |why| {
        format!("<div class=\"failure\" role=\"alert\"><strong>Not complete:</strong> {}</div>\n", escape(why))
    })
}

/// The parts that apply: anchor, title, body.
fn parts(analysis: &Analysis) -> Vec<(&'static str, &'static str, String)> {
    let structure = &analysis.structure;
    let all = [
        ("class", "Class", analysis.class.as_ref().map(class).unwrap_or_default()),
        ("elimination", "Motions without inertia", elimination(analysis)),
        ("modes", "Modes", modes(analysis)),
        ("structure", "Controllability and observability", ranks(structure)),
        ("transfer", "Relative degrees and zeros", transfer(structure)),
        ("least", "Least numbers of inputs and outputs", least(structure)),
        ("placement", "Placement", placement(&analysis.placement)),
        ("sensitivity", "Sensitivity", analysis.sensitivity.as_ref().map(sensitivity).unwrap_or_default()),
        ("reduction", "Reduction", reduction(analysis)),
        (
            "constraint-forces",
            "Constraint forces",
            analysis.constraint_forces.as_ref().map(constraint_forces).unwrap_or_default(),
        ),
        ("certificate", "Certificate", certificate(analysis)),
        ("remarks", "Notes of the analysis", items(&analysis.notes)),
    ];
    all.into_iter().filter(|(_, _, body)| !body.is_empty()).collect()
}

/// The sections of a page of its own.
pub(super) fn sections(analysis: &Analysis) -> Vec<String> {
    parts(analysis).iter().map(|(anchor, title, body)| framed(anchor, title, body)).collect()
}

/// One section of the report on runs; `of` says whose analysis it is.
pub(super) fn section(analysis: &Analysis, of: &str) -> String {
    let verdict = verdict(analysis)
        .map(|(good, text)| format!("<p class=\"{}\">{}</p>\n", if good { "good" } else { "bad" }, escape(&text)));
    let lower = |body: &str| body.replace("<h3>", "<h4>").replace("</h3>", "</h4>");
    let parts = parts(analysis);
    let links = parts.iter().map(|(anchor, title, _)| format!("<a href=\"#analysis-{anchor}\">{title}</a>\n"));
    let links = format!("<nav>\n{}</nav>\n", links.collect::<String>());
    let bodies = parts
        .iter()
        .map(|(anchor, title, body)| format!("<h3 id=\"analysis-{anchor}\">{title}</h3>\n{}", lower(body)))
        .collect::<String>();
    let body = format!("{}<p class=\"hint\">{}</p>\n{links}{bodies}", verdict.unwrap_or_default(), escape(of));
    framed("analysis", "Structure analysis", &body)
}

pub(super) fn paragraph(text: &str) -> String {
    format!("<p>{}</p>\n", escape(text))
}

pub(super) fn items<T: AsRef<str>>(texts: &[T]) -> String {
    let items: String = texts.iter().map(|text| format!("<li>{}</li>\n", escape(text.as_ref()))).collect();
    if items.is_empty() { items } else { format!("<ul>\n{items}</ul>\n") }
}

pub(super) fn codes(names: &[String], none: &str) -> String {
    let names: Vec<String> = names.iter().map(|name| format!("<code>{}</code>", escape(name))).collect();
    if names.is_empty() { none.into() } else { names.join(", ") }
}

/// A table of the first rows; empty if there are none.
pub(super) fn rows_of(headers: &[impl AsRef<str>], mut rows: Vec<Vec<Cell>>) -> String {
    let all = rows.len();
    rows.truncate(ROWS);
    let rest = all - rows.len();
    match (all, rest) {
        (0, _) => String::new(),
        (_, 0) => table(headers, &rows),
        _ => format!("{}<p class=\"hint\">{rest} more are in the exported data.</p>\n", table(headers, &rows)),
    }
}

fn class(class: &Class) -> String {
    let assumption = |assumption: &kardan::results::Assumption| {
        let breach = |(elements, why): &(Vec<&str>, &str)| {
            let elements: Vec<String> =
                elements.iter().take(ROWS).map(|name| format!("<code>{}</code>", escape(name))).collect();
            format!("{}: {}", elements.join(", "), escape(why))
        };
        let breaches: Vec<String> = words::breaches(assumption).iter().take(ROWS).map(breach).collect();
        vec![
            Cell::text(assumption.statement.clone()),
            mark(assumption.holds, if assumption.holds { "holds" } else { "broken" }),
            Cell::Html(breaches.join("<br/>")),
        ]
    };
    let constraints = class
        .constraints
        .iter()
        .map(|c| {
            vec![
                Cell::Head(c.element.clone(), 1),
                Cell::text(c.equation.clone()),
                Cell::text(words::constraint_kind(c)),
            ]
        })
        .collect();
    let point = &class.operating_point;
    let angles: Vec<String> =
        point.angles.iter().map(|(shaft, angle)| format!("{shaft} = {} rad", number(*angle))).collect();
    let friction = point
        .friction
        .iter()
        .map(|(element, torque, stuck)| {
            let state = if *stuck { "stuck: a constraint here" } else { "slipping: a constant torque here" };
            vec![Cell::Head(element.clone(), 1), Cell::figure(*torque), Cell::text(state)]
        })
        .collect();
    let mut body = paragraph(&words::class(class));
    body += &rows_of(&["assumption", "", "broken by"], class.assumptions.iter().map(assumption).collect());
    body += &titled("Constraints", &rows_of(&["element", "equation", "kind"], constraints));
    if !angles.is_empty() {
        body += &titled("Operating point", &paragraph(&words::list(&angles, ROWS)));
    }
    body + &rows_of(&["friction", "#Coulomb torque [N m]", "state"], friction)
}

pub(super) fn titled(title: &str, body: &str) -> String {
    if body.is_empty() { String::new() } else { format!("<h3>{title}</h3>\n{body}") }
}

fn elimination(analysis: &Analysis) -> String {
    let sentences = analysis.elimination.as_ref().map(|found| words::elimination(found, &analysis.structure));
    items(&sentences.unwrap_or_default())
}

fn modes(analysis: &Analysis) -> String {
    if analysis.modes.is_empty() {
        return String::new();
    }
    let told = |decided: Option<bool>, holds: bool| match decided {
        Some(_) => mark(holds, if holds { "yes" } else { "no" }),
        None => Cell::text("not decided"),
    };
    let has_energy = analysis.modes.iter().any(|mode| !mode.stored.is_empty());
    let mut headers = vec!["##", "#frequency [Hz]", "#damping ratio", "#eigenvalue [1/s]", "reached", "seen"];
    headers.push("largest motions");
    if has_energy {
        headers.extend(["stored in", "lost in"]);
    }
    let row = |(k, mode): (usize, &Mode)| {
        let mut row = vec![
            Cell::Number((k + 1).to_string()),
            Cell::figure(mode.natural_frequency / std::f64::consts::TAU),
            Cell::Number(figure(mode.damping_ratio, 4)),
            Cell::Number(words::pair(mode.eigenvalue, number)),
            told(analysis.structure.controllability(), mode.controllable),
            told(analysis.structure.observability(), mode.observable),
            Cell::text(words::together(&words::shape(mode, |value| figure(value, 3)))),
        ];
        if has_energy {
            row.extend([words::stored(mode), words::dissipated(mode)].map(|text| Cell::Text(words::together(&text))));
        }
        row
    };
    let rows = analysis.modes.iter().enumerate().map(row).collect();
    rows_of(&headers, rows)
        + &pictures::plane(&analysis.modes, &analysis.structure.zeros)
        + &pictures::shapes(&analysis.modes)
        + &pictures::energies(&analysis.modes)
}

fn ranks(structure: &Structure) -> String {
    let states = structure.states.len();
    if states == 0 {
        return String::new();
    }
    let judged = |what: &str, good: Option<bool>, rank: usize| {
        let told = match good {
            Some(true) => mark(true, what),
            Some(false) => mark(false, &format!("not {what}")),
            None => mark(false, &format!("{what}: not decided")),
        };
        vec![told, Cell::text(words::rank(rank, states, good.is_some()))]
    };
    let mut body = table(
        &["", ""],
        &[
            judged("controllable", structure.controllability(), structure.controllable_rank),
            judged("observable", structure.observability(), structure.observable_rank),
        ],
    )
    .replace("<thead><tr><th scope=\"col\"></th><th scope=\"col\"></th></tr></thead>", "");
    for (what, names) in [("States", &structure.states), ("Inputs", &structure.inputs), ("Outputs", &structure.outputs)]
    {
        body += &format!("<p>{what} ({}): {}</p>\n", names.len(), codes(names, "none"));
    }
    for (failing, title) in [
        (&structure.uncontrollable, "Modes that the inputs do not reach"),
        (&structure.unobservable, "Modes that the outputs do not show"),
    ] {
        let sentence = |mode: &FailingMode| {
            let written = FailingMode { factor: powers(&mode.factor), ..mode.clone() };
            words::failing(&written, number)
        };
        let texts: Vec<String> = failing.iter().take(ROWS).map(sentence).collect();
        body += &titled(title, &items(&texts));
    }
    let defect = |decided: Option<bool>, defect: usize| decided.map_or("not decided".into(), |_| defect.to_string());
    let factor = |factor: &Factor| {
        vec![
            Cell::Head(powers(&factor.polynomial), 1),
            Cell::text(words::together(&words::pairs(&factor.roots, number).join(", "))),
            Cell::Number(factor.algebraic.to_string()),
            Cell::Number(factor.geometric.to_string()),
            Cell::Number(defect(structure.controllability(), factor.input_defect)),
            Cell::Number(defect(structure.observability(), factor.output_defect)),
        ]
    };
    let headers = [
        "factor of the characteristic polynomial",
        "roots [1/s]",
        "#multiplicity",
        "#eigenvectors",
        "#not reached",
        "#not seen",
    ];
    body += &titled("Factors", &rows_of(&headers, structure.factors.iter().map(factor).collect()));
    if !structure.invariant_factors.is_empty() {
        body += &format!(
            "<p>Invariant factors of <i>s</i>I − A: {}</p>\n",
            codes(&structure.invariant_factors.iter().take(ROWS).map(|text| powers(text)).collect::<Vec<_>>(), "")
        );
    }
    body
}

fn transfer(structure: &Structure) -> String {
    if structure.states.is_empty() {
        return String::new();
    }
    let degree = |degree: Option<&usize>| Cell::Number(degree.map_or("–".into(), usize::to_string));
    let row = |(degrees, output): (&Vec<Option<usize>>, &String)| {
        let mut row = vec![Cell::Head(output.clone(), 1), degree(degrees.iter().flatten().min())];
        row.extend(degrees.iter().map(|found| degree(found.as_ref())));
        row
    };
    let mut headers = vec!["output".to_owned(), "#least".to_owned()];
    headers.extend(structure.inputs.iter().map(|input| format!("#{input}")));
    let rows: Vec<Vec<Cell>> = structure.relative_degrees.iter().zip(&structure.outputs).map(row).collect();
    let mut body = titled("Relative degrees", &rows_of(&headers, rows));
    if !body.is_empty() {
        body += "<p class=\"hint\">– where the input never reaches the output.</p>\n";
    }
    let zeros = &structure.zeros;
    body += "<h3>Invariant zeros</h3>\n";
    if zeros.values.is_empty() {
        let none = if zeros.growing.is_some() { "There are none." } else { &zeros.polynomial };
        body += &paragraph(none);
    } else {
        let values = words::list(&words::pairs(&zeros.values, number), ROWS);
        body += &format!(
            "<p>{} 1/s, the roots of <code>{}</code>.</p>\n",
            escape(&values),
            escape(&powers(&zeros.polynomial))
        );
    }
    body += &words::half_plane(zeros).map(paragraph).unwrap_or_default();
    body + &paragraph(&words::normal_rank(structure))
}

fn least(structure: &Structure) -> String {
    if structure.states.is_empty() {
        return String::new();
    }
    let certificate = &structure.certificate;
    let kind = if structure.kind.is_empty() {
        String::new()
    } else {
        format!("<p class=\"hint\">Case of the theorems: {}.</p>\n", escape(&structure.kind))
    };
    let construction = structure.construction.as_ref().map(words::construction).unwrap_or_default();
    let construction: Vec<String> = construction.iter().map(|text| powers(text)).collect();
    let steps = construction.get(1..).map(items).filter(|steps| !steps.is_empty());
    kind + &items(&[
        powers(&words::least("input", structure.min_inputs, certificate.inputs.as_ref(), structure)),
        powers(&words::least("output", structure.min_outputs, certificate.outputs.as_ref(), structure)),
    ]) + &construction.first().map(|text| paragraph(text)).unwrap_or_default()
        + &steps
            .map(|steps| format!("<details><summary>How these inputs were built</summary>\n{steps}</details>\n"))
            .unwrap_or_default()
}

fn placement(placement: &Placement) -> String {
    let part = |title: &str, property: &str, search: &Option<PlacementSearch>| {
        search.as_ref().map(|search| titled(title, &sets(search, property))).unwrap_or_default()
    };
    part("Motors", "controllable", &placement.inputs) + &part("Sensors", "observable", &placement.outputs)
}

fn sets(search: &PlacementSearch, property: &str) -> String {
    let mut body = paragraph(&words::search(search));
    if let Some(why) = &search.none_because {
        body += &format!("<p class=\"bad\">No set makes the model {property}: {}.</p>\n", escape(why));
    }
    body += &pictures::ranking(search);
    let score = if search.unit.is_empty() { "#score".into() } else { format!("#score [{}]", unit(&search.unit)) };
    let rows: Vec<Vec<Cell>> = search
        .sets
        .iter()
        .enumerate()
        .map(|(k, set)| {
            vec![
                Cell::Number((k + 1).to_string()),
                Cell::text(set.places.join(", ")),
                Cell::figure(set.score),
                Cell::figure(set.cost),
                Cell::text(if set.efficient && search.sets.len() > 1 { "●" } else { "" }),
            ]
        })
        .collect();
    let plural = if rows.len() == 1 { "set" } else { "sets" };
    let title = format!("Table of {} {plural}", rows.len());
    let listed = rows_of(&["##", "places", &score, "#cost", ""], rows);
    if listed.is_empty() {
        return body;
    }
    let mark = if search.sets.len() > 1 && search.sets.iter().any(|set| set.efficient) { words::EFFICIENT } else { "" };
    body + &format!("<details><summary>{title}</summary>\n{listed}<p class=\"hint\">{mark}</p>\n</details>\n")
}

fn sensitivity(sensitivity: &Sensitivity) -> String {
    let at = |search: &Option<kardan::results::LossSearch>, name: &str, nominal: f64| {
        let loss = search.as_ref().and_then(|search| search.nearest.as_ref());
        let value = |loss: &Loss| loss.at.iter().find(|(other, _, _)| other == name).map_or(nominal, |(_, x, _)| *x);
        Cell::Number(loss.map_or("–".into(), |loss| number(value(loss))))
    };
    let row = |(name, nominal, low, high, what): &(String, f64, f64, f64, String)| {
        vec![
            Cell::Head(format!("{name} [{}]", unit(what)), 1),
            Cell::figure(*low),
            Cell::figure(*nominal),
            Cell::figure(*high),
            at(&sensitivity.controllability, name, *nominal),
            at(&sensitivity.observability, name, *nominal),
        ]
    };
    let headers = ["parameter", "#from", "#nominal", "#to", "#not controllable at", "#not observable at"];
    let mut body = pictures::margins(sensitivity);
    body += &rows_of(&headers, sensitivity.parameters.iter().map(row).collect());
    for (title, what, search) in [
        ("Controllability", "controllability", &sensitivity.controllability),
        ("Observability", "observability", &sensitivity.observability),
    ] {
        if let Some(search) = search {
            let sentences: Vec<String> = words::loss(what, search, number).iter().map(|text| powers(text)).collect();
            body += &titled(title, &items(&sentences));
        }
    }
    body
}

fn reduction(analysis: &Analysis) -> String {
    if analysis.coordinates.is_empty() && analysis.bases.is_empty() {
        return String::new();
    }
    let mut body = format!("<p>Reduced coordinates: {}</p>\n", codes(&analysis.coordinates, "none"));
    let rows: Vec<Vec<Cell>> = analysis.bases.iter().flat_map(bounds).collect();
    let headers = ["basis", "matrix", "#eigenvalues", "#centres", "#radii", "#within discs"];
    let listed = rows_of(&headers, rows);
    if !listed.is_empty() {
        body += &titled("Eigenvalues and Geršgorin's discs", &listed);
        body += "<p class=\"hint\">Every eigenvalue lies in at least one disc of its matrix.</p>\n";
    }
    for basis in &analysis.bases {
        let all = [&basis.basis, &basis.inertia, &basis.damping, &basis.stiffness, &basis.input].map(Clone::clone);
        body += &format!(
            "<details><summary>Matrices: {} (largest cosine of two columns {})</summary>\n{}</details>\n",
            escape(&basis.name),
            number(basis.orthogonality),
            matrices(&all)
        );
    }
    body
}

fn bounds(basis: &Basis) -> Vec<Vec<Cell>> {
    let several = |values: &[f64]| {
        let texts: Vec<String> = values.iter().map(|&value| figure(value, 4)).collect();
        match &texts[..] {
            [first, .., last] if texts.len() > 6 => Cell::Number(format!("{first} … {last} ({})", texts.len())),
            all => Cell::Number(all.join(", ")),
        }
    };
    let row = |(k, bounds): (usize, &kardan::results::EigenvalueBounds)| {
        let mut row = Vec::new();
        if k == 0 {
            row.push(Cell::Head(basis.name.clone(), basis.bounds.len()));
        }
        row.push(Cell::text(format!("{} [{}]", bounds.matrix, unit(&bounds.unit))));
        row.extend([&bounds.eigenvalues, &bounds.centres, &bounds.radii].map(|values| several(values)));
        row.push(Cell::Number(words::discs(bounds, number)));
        row
    };
    basis.bounds.iter().enumerate().map(row).collect()
}

fn constraint_forces(forces: &ConstraintForces) -> String {
    let plural = if forces.rank == 1 { "" } else { "s" };
    let text = format!(
        "The projector P has rank {}: so many independent constraint{plural}. Largest entry of P² − P: {}.",
        forces.rank,
        number(forces.idempotence_residual)
    );
    let maps = [forces.input_to_multiplier.clone(), forces.input_to_torque.clone()];
    format!(
        "{}{}<details><summary>Projector</summary>\n{}</details>\n",
        paragraph(&text),
        matrices(&maps),
        matrices(std::slice::from_ref(&forces.projector))
    )
}

fn certificate(analysis: &Analysis) -> String {
    let certificate = &analysis.structure.certificate;
    if analysis.structure.states.is_empty() {
        return String::new();
    }
    let primes: Vec<String> = certificate.primes.iter().map(u64::to_string).collect();
    let primes = if primes.is_empty() {
        String::new()
    } else {
        format!("<p class=\"hint\">Primes: {}</p>\n", words::list(&primes, 12))
    };
    paragraph(&words::certificate(certificate, number))
        + &items(&certificate.statements[..certificate.statements.len().min(ROWS)])
        + &primes
        + "<p class=\"hint\">The exported data hold the certificate itself, for a check by another program.</p>\n"
}
