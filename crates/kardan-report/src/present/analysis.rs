//! An analysis of structure as a page.

use super::descriptor::{descriptor, sentence};
use super::optional;
use super::parity::parity;
use crate::analysis_pictures as pictures;
use crate::groups::{distinct, grouped};
use crate::model::{Alert, Body, Cell, Page, row};
use crate::phrases;
use crate::text::{number, with_unit};
use kardan_results::{
    Analysis, Basis, Class, ConstraintForces, DistanceToUncontrollability, EigenvalueBounds, Factor, FailingMode,
    FrictionState, MatrixDistance, MatrixDistances, Mechanism, Mode, OppositeModel, ParameterRange, PlacementSearch,
    PolynomialRoots, Sensitivity, Structure, UncontrollablePoint, Undecided, Verdict,
};

/// More modes are counted where space is limited.
const MODES: usize = 40;
/// More placements are counted where space is limited.
const SETS: usize = 8;
/// More eigenvalues are shown by the first and the last.
const VALUES: usize = 6;

/// The page of an analysis.
pub fn page(analysis: &Analysis) -> Page {
    page_with(analysis, true)
}

/// The same for [`Page::text`]: without the pictures and large matrices that it leaves out.
pub fn text_page(analysis: &Analysis) -> Page {
    page_with(analysis, false)
}

fn page_with(analysis: &Analysis, drawn: bool) -> Page {
    let structure = &analysis.structure;
    let unfinished = analysis.unfinished.as_ref();
    let elimination = analysis.elimination.iter().flat_map(|found| phrases::elimination(found, structure));
    let none = Mechanism::default();
    Page {
        name: if analysis.name.is_empty() { "Structure analysis".into() } else { analysis.name.clone() },
        description: analysis.description.clone(),
        verdict: verdict(analysis),
        alerts: unfinished.map(|why| Alert { kind: "Not complete".into(), text: why.clone() }).into_iter().collect(),
        sections: Page::sections([
            super::mechanism(if drawn { &analysis.mechanism } else { &none }),
            ("class", "Class", optional(&analysis.class, class)),
            ("elimination", "Motions without inertia", Body::default().list(elimination)),
            ("descriptor", "Singular E", descriptor(analysis)),
            ("modes", "Modes", modes(analysis, drawn)),
            ("structure", "Controllability and observability", ranks(structure)),
            ("properties", "Stability and indices", properties(analysis)),
            ("opposite-side", "Opposite side of the kink", optional(&analysis.opposite_side, opposite_side)),
            ("transfer", "Relative degrees and zeros", transfer(structure, analysis.discrete.is_some())),
            ("least", "Least numbers of inputs and outputs", least(structure)),
            ("placement", "Placement", placement(analysis)),
            ("parity", "Monitoring", parity(analysis)),
            ("sensitivity", "Sensitivity", optional(&analysis.sensitivity, sensitivity)),
            ("distance", "Distance of the matrices", optional(&analysis.matrix_distance, distances)),
            ("reduction", "Reduction", reduction(analysis, drawn)),
            (
                "constraint-forces",
                "Constraint forces",
                optional(&analysis.constraint_forces, |forces| constraint_forces(forces, drawn)),
            ),
            ("certificate", "Certificate", certificate(structure)),
            ("remarks", "Notes of the analysis", Body::default().list(analysis.notes.iter().cloned())),
        ]),
        ..Page::default()
    }
}

/// One sentence on the ranks; `true` if both are full.
fn verdict(analysis: &Analysis) -> Option<Verdict> {
    let of_ranks = rank_verdict(analysis);
    let Some((sound, text)) = analysis.descriptor.as_ref().map(sentence) else { return of_ranks };
    Some(match of_ranks {
        None => Verdict { sound, text },
        Some(ranks) => {
            Verdict { sound: sound && ranks.sound, text: format!("{text} Its finite modes: {}", ranks.text) }
        }
    })
}

fn rank_verdict(analysis: &Analysis) -> Option<Verdict> {
    let structure = &analysis.structure;
    let states = structure.states.len();
    if states == 0 {
        return None;
    }
    let (controllable, observable) = (structure.controllable(), structure.observable());
    if structure.undecided != Undecided::default() {
        let word = |decided: Option<bool>, what: &str, rank: usize| match decided {
            Some(true) => what.to_owned(),
            Some(false) => format!("not {what} (rank {rank} of {states})"),
            None => format!("whether {what} is not decided (rank at least {rank} of {states})"),
        };
        let text = format!(
            "Not all results are proven: {}; {}.",
            word(structure.controllability(), "controllable", structure.controllable_rank),
            word(structure.observability(), "observable", structure.observable_rank)
        );
        return Some(Verdict { sound: false, text });
    }
    let counting = analysis.counting.as_ref();
    let but = counting.map_or([false; 2], |found| [found.remaining_controllable, found.remaining_observable]);
    let counts_only = (controllable || but[0]) && (observable || but[1]);
    let text = match (controllable, observable) {
        _ if but != [false; 2] && counts_only => {
            let names = counting.map_or(&[][..], |found| &found.charges[..]);
            let (what, only) = match names.len() {
                1 => ("a charge without effect", "is"),
                _ => ("charges without effect", "are"),
            };
            let names = phrases::list(names, 12);
            match but {
                [true, true] => {
                    format!("Controllable and observable except {names}, {what}: all motions are.")
                }
                [true, false] => {
                    format!("Controllable except {names}, {what}: all motions are; observable.")
                }
                _ => format!("Controllable; observable except {names}, which {only} {what}."),
            }
        }
        (true, true) => format!("Controllable and observable: all {states} states."),
        (false, true) => format!("Not controllable: rank {} of {states}; observable.", structure.controllable_rank),
        (true, false) => format!("Controllable; not observable: rank {} of {states}.", structure.observable_rank),
        (false, false) => format!(
            "Neither controllable (rank {} of {states}) nor observable (rank {} of {states}).",
            structure.controllable_rank, structure.observable_rank
        ),
    };
    let lost = phrases::lost_in_last_digit(analysis.matrix_distance.as_ref());
    let sound = counts_only && analysis.unfinished.is_none() && lost.is_none();
    let text = lost.map_or(text.clone(), |lost| format!("{text} {lost}"));
    Some(Verdict { sound, text })
}

fn properties(analysis: &Analysis) -> Body {
    let Some(found) = &analysis.properties else { return Body::default() };
    let unit = if analysis.discrete.is_some() { "" } else { " 1/s" };
    let judged = |what: &str, decided: Option<bool>| row![what, Cell::decided(decided)];
    let roots = |what: &str, zeros: &Option<PolynomialRoots>| row![what, phrases::roots(zeros.as_ref(), unit)];
    let indices = |names: &[String], all: &Option<Vec<usize>>| match all {
        Some(all) if !all.is_empty() => {
            let one = |(name, index): (&String, &usize)| format!("{name} {index}");
            names.iter().zip(all).map(one).collect::<Vec<_>>().join(", ")
        }
        _ => "–".into(),
    };
    let orders = match &found.infinite_zeros {
        None => "not decided".into(),
        Some(orders) if orders.is_empty() => "none".into(),
        Some(orders) => orders.iter().map(usize::to_string).collect::<Vec<_>>().join(", "),
    };
    let structure = &analysis.structure;
    Body::default()
        .table(
            &["", ""],
            [
                row!["stability", found.stability.to_string()],
                judged("stabilisable", found.stabilisable),
                judged("detectable", found.detectable),
            ],
        )
        .table(
            &["zeros and indices", ""],
            [
                roots("transmission zeros", &found.transmission_zeros),
                roots("input decoupling zeros", &found.input_decoupling_zeros),
                roots("output decoupling zeros", &found.output_decoupling_zeros),
                roots("input-output decoupling zeros", &found.input_output_decoupling_zeros),
                row!["orders of the zeros at infinity", orders],
                row!["controllability indices", indices(&structure.inputs, &found.controllability_indices)],
                row!["observability indices", indices(&structure.outputs, &found.observability_indices)],
            ],
        )
}

fn distances(distances: &MatrixDistances) -> Body {
    let both = [("not controllable", &distances.controllability), ("not observable", &distances.observability)];
    let row = |what: &str, found: &MatrixDistance| {
        row![what, found.lower, found.upper, found.data_uncertainty, phrases::pair(found.eigenvalue)]
    };
    let computed = || both.iter().filter_map(|(what, found)| Some((*what, found.as_ref()?)));
    let rows = computed().map(|(what, found)| row(what, found));
    let headers =
        ["the nearest system that is", "#at least", "#at most", "#last digit of the data", "#mode lost [1/s]"];
    Body::default()
        .table(&headers, rows)
        .list(computed().map(|(what, found)| phrases::nearest_system(what, found)))
        .hint(phrases::MATRIX_DISTANCE)
}

fn class(class: &Class) -> Body {
    let judged = |satisfied: bool| Cell::judged(satisfied, ["satisfied", "broken"]);
    let assumptions = class.assumptions.iter().map(|one| row![&one.statement, judged(one.satisfied)]);
    let broken = class.assumptions.iter().filter(|one| !one.satisfied);
    let breaches = broken.flat_map(|one| {
        let causes = grouped(one.violations.iter().map(|cause| (&cause.reason, &cause.element)));
        let causes = causes.into_iter().map(|(why, elements)| format!("by {}: {why}", phrases::list(&elements, 100)));
        std::iter::once(format!("broken: {}", one.statement)).chain(causes)
    });
    let constraints = class.constraints.iter().map(|c| row![&c.element, &c.equation, phrases::constraint_kind(c)]);
    let reasons = class.constraints.iter().filter_map(|c| Some(format!("{}: {}", c.element, c.reason.as_ref()?)));
    // The two sides of a stop have one.
    let reasons = distinct(reasons);
    let point = &class.operating_point;
    let moved = point.angles.iter().filter(|one| one.angle != 0.0);
    let moved: Vec<String> = moved.map(|one| format!("{} = {} rad", one.shaft, number(one.angle))).collect();
    let rest = if moved.is_empty() { "all angles 0 rad" } else { "all other angles 0 rad" };
    let at = moved.iter().map(String::as_str).chain([rest]).collect::<Vec<_>>().join(", ");
    let moving = point.motion.iter().filter(|one| one.value != 0.0);
    let motion = moving.map(|one| format!("{} = {} {}", one.name, number(one.value), one.unit));
    let friction = point.friction.iter().map(|FrictionState { element, coulomb_torque, stuck }| {
        let state = if *stuck { "stuck: a constraint here" } else { "slipping: a constant torque here" };
        row![element, *coulomb_torque, state]
    });
    Body::default()
        .paragraph(phrases::class(class))
        .detail(Body::default().table(&["assumption", ""], assumptions))
        .list(breaches)
        .table(&["constraint", "equation", "kind"], constraints)
        .list(reasons)
        .paragraph(if point.angles.is_empty() { String::new() } else { format!("Operating point: {at}.") })
        .paragraph(phrases::listed("Motion there", motion, usize::MAX).unwrap_or_default())
        .table(&["friction", "#Coulomb torque [N m]", "state"], friction)
}

/// What the model is on the other side of the kinks at its operating point.
fn opposite_side(other_side: &OppositeModel) -> Body {
    let OppositeModel { reference_side: own, side, controllable, observable, .. } = other_side;
    let judged = |what: &str, decided: Option<bool>| row![what, Cell::decided(decided)];
    Body::default()
        .paragraph(format!(
            "A torque has a kink at the operating point. All other results on this page are for the side where \
             {own}; these are for the side where {side}. A motion passes through both sides: stability on each side \
             does not prove that it is stable."
        ))
        .table(
            &["", ""],
            [
                judged("controllable", *controllable),
                judged("observable", *observable),
                row!["stability", other_side.stability.to_string()],
            ],
        )
        .part("Modes there", modes_table(&other_side.modes, (*controllable, *observable), "#eigenvalue [1/s]"))
}

fn modes(analysis: &Analysis, drawn: bool) -> Body {
    let decided = (analysis.structure.controllability(), analysis.structure.observability());
    let eigenvalue = if analysis.discrete.is_some() { "#eigenvalue" } else { "#eigenvalue [1/s]" };
    let body = modes_table(&analysis.modes, decided, eigenvalue);
    if !drawn || analysis.modes.is_empty() {
        return body;
    }
    body.pictures(pictures::plane(&analysis.modes, &analysis.structure.zeros))
        .pictures(crate::mode_shapes::shapes(&analysis.modes))
        .pictures(pictures::energies(&analysis.modes))
}

/// The modes, and whether each is controllable and observable if that is decided.
fn modes_table(modes: &[Mode], (controllable, observable): (Option<bool>, Option<bool>), eigenvalue: &str) -> Body {
    let energy = modes.iter().any(|mode| !mode.stored.is_empty());
    let row = |(k, mode): (usize, &Mode)| {
        let mut row = row![
            k + 1,
            mode.natural_frequency / std::f64::consts::TAU,
            mode.damping_ratio,
            phrases::pair(mode.eigenvalue),
            Cell::decided(controllable.map(|_| mode.controllable)),
            Cell::decided(observable.map(|_| mode.observable)),
            phrases::unbroken(&phrases::motion(&mode.shape)),
        ];
        if energy {
            row.extend(
                [phrases::stored(mode), phrases::of_elements(&mode.dissipated)]
                    .map(|text| Cell::Text(phrases::unbroken(&text))),
            );
        }
        row
    };
    let mut headers = vec!["##", "#frequency [Hz]", "#damping", eigenvalue, "contr.", "obs.", "largest motions"];
    headers.extend(["stored in", "lost in"].iter().filter(|_| energy));
    Body::default().table_of(MODES, &headers, modes.iter().enumerate().map(row))
}

fn ranks(structure: &Structure) -> Body {
    let states = structure.states.len();
    if states == 0 {
        return Body::default();
    }
    let judged = |what: &str, decided: Option<bool>, rank: Option<usize>| {
        let rank = rank.map_or(String::new(), |rank| phrases::rank(rank, states, decided.is_some()));
        row![what, Cell::decided(decided), rank]
    };
    let failing = |modes: &[FailingMode]| Body::default().list(modes.iter().map(phrases::failing));
    let defect = |decided: Option<bool>, defect: usize| decided.map_or("not decided".into(), |_| defect.to_string());
    let factor = |factor: &Factor| {
        row![
            &factor.polynomial,
            phrases::unbroken(&phrases::pairs(&factor.roots).join(", ")),
            factor.algebraic,
            factor.geometric,
            defect(structure.controllability(), factor.input_defect),
            defect(structure.observability(), factor.output_defect),
        ]
    };
    let headers = [
        "factor of the characteristic polynomial",
        "roots [1/s]",
        "#multiplicity",
        "#eigenvectors",
        "#not controllable",
        "#not observable",
    ];
    let factors = Body::default().table(&headers, structure.factors.iter().map(factor));
    let invariant = &structure.invariant_factors;
    let invariant = match invariant.is_empty() {
        true => Body::default(),
        false => Body::default().names("Invariant factors of s I − A", invariant),
    };
    Body::default()
        .table(
            &["", "", ""],
            [
                judged("controllable", structure.controllability(), Some(structure.controllable_rank)),
                judged("observable", structure.observability(), Some(structure.observable_rank)),
                judged("minimal", structure.minimality(), None),
            ],
        )
        .names("States", &structure.states)
        .names("Inputs", &structure.inputs)
        .names("Outputs", &structure.outputs)
        .part("Uncontrollable modes", failing(&structure.uncontrollable))
        .part("Unobservable modes", failing(&structure.unobservable))
        .detail(Body::default().part("Factors", factors.and(invariant)))
}

fn transfer(structure: &Structure, discrete: bool) -> Body {
    if structure.states.is_empty() {
        return Body::default();
    }
    let degree = |degree: Option<&usize>| Cell::Text(degree.map_or("–".into(), usize::to_string));
    let row = |(degrees, output): (&Vec<Option<usize>>, &String)| {
        let all = [output.into(), degree(degrees.iter().flatten().min())].into_iter();
        all.chain(degrees.iter().map(|found| degree(found.as_ref()))).collect()
    };
    let inputs = structure.inputs.iter().map(|input| format!("#{input}"));
    let headers: Vec<String> = ["output", "#least"].map(String::from).into_iter().chain(inputs).collect();
    let with = |(degrees, _): &(&Vec<Option<usize>>, &String)| degrees.len() + 2 == headers.len();
    let degrees = structure.relative_degrees.iter().zip(&structure.outputs).filter(with);
    let degrees = Body::default().table(&headers, degrees.filter(|(all, _)| !all.is_empty()).map(row));
    let never = structure.relative_degrees.iter().flatten().any(Option::is_none);
    let hint = if never { "–: the input does not affect the output." } else { "" };
    let zeros = &structure.zeros;
    let half_plane = if discrete { String::new() } else { phrases::half_plane(zeros).unwrap_or_default().into() };
    let found = match (zeros.values.is_empty(), zeros.growing) {
        (true, Some(_)) => "There are none.".into(),
        (true, None) => zeros.polynomial.clone(),
        _ => {
            let values = phrases::list(&phrases::pairs(&zeros.values), 100);
            let unit = if discrete { "" } else { " 1/s" };
            format!("{values}{unit}, the roots of {}.", zeros.polynomial)
        }
    };
    let zeros = Body::default().paragraph(found).paragraph(half_plane).paragraph(phrases::normal_rank(structure));
    Body::default().part("Relative degrees", degrees.hint(hint)).part("Invariant zeros", zeros)
}

fn least(structure: &Structure) -> Body {
    if structure.states.is_empty() {
        return Body::default();
    }
    let certificate = &structure.certificate;
    let kind = match structure.kind.as_str() {
        "pure damping" => "The model has no stiffness: each degree of freedom needs an input and an output of its own.",
        "no damping" => "The model has no damping, so its stiffness alone decides these numbers.",
        _ => "",
    };
    let (inputs, outputs) = (certificate.inputs.as_ref(), certificate.outputs.as_ref());
    let why = phrases::why_least("input", structure.min_inputs, inputs);
    let why = Body::default().list(why.into_iter().chain(phrases::why_least("output", structure.min_outputs, outputs)));
    let mut built = structure.construction.as_ref().map(phrases::construction).unwrap_or_default().into_iter();
    let body = Body::default()
        .hint(kind)
        .list([
            phrases::least("input", structure.min_inputs, inputs),
            phrases::least("output", structure.min_outputs, outputs),
        ])
        .paragraph(built.next().unwrap_or_default());
    proof(body, certificate.proven, Body::default().fold("Why these numbers", why))
        .fold("How these inputs were built", Body::default().list(built))
}

/// A folded proof; where space is limited it is shown only on request.
fn proof(body: Body, requested: bool, proof: Body) -> Body {
    if requested { body.and(proof) } else { body.detail(proof) }
}

fn placement(analysis: &Analysis) -> Body {
    let both = [
        ("Motors", "controllable", &analysis.placement.inputs),
        ("Sensors", "observable", &analysis.placement.outputs),
    ];
    both.iter().fold(Body::default(), |body, (title, property, search)| {
        body.part(title, optional(search, |search| sets(search, property)))
    })
}

fn sets(search: &PlacementSearch, property: &str) -> Body {
    let none = search.infeasible_reason.as_ref();
    let none = none.map_or(String::new(), |why| format!("No set makes the model {property}: {why}."));
    let several = search.sets.len() > 1;
    let rows = search.sets.iter().enumerate().map(|(k, set)| {
        let mark = if set.efficient && several { "●" } else { "" };
        row![k + 1, set.places.join(", "), set.score, set.cost, mark]
    });
    let score = with_unit("#score", &search.unit);
    let listed = Body::default().table_of(SETS, &["##", "places", &score, "#cost", ""], rows);
    let efficient = several && search.sets.iter().any(|set| set.efficient);
    let listed = listed.hint(if efficient { phrases::EFFICIENT } else { "" });
    let title = format!("Table of {} set{}", search.sets.len(), if search.sets.len() == 1 { "" } else { "s" });
    Body::default()
        .paragraph(phrases::search(search))
        .judge(false, none)
        .pictures(pictures::ranking(search))
        .fold(&title, listed)
}

fn sensitivity(sensitivity: &Sensitivity) -> Body {
    let at = |search: &Option<DistanceToUncontrollability>, name: &str, nominal: f64| {
        let loss = search.as_ref().and_then(|search| search.nearest.as_ref());
        let value = |loss: &UncontrollablePoint| {
            loss.at.iter().find(|one| one.parameter == name).map_or(nominal, |one| one.value)
        };
        loss.map_or("–".into(), |loss| number(value(loss)))
    };
    let row = |ParameterRange { name, nominal, lower, upper, unit }: &ParameterRange| {
        row![
            format!("{name} [{unit}]"),
            *lower,
            *nominal,
            *upper,
            at(&sensitivity.controllability, name, *nominal),
            at(&sensitivity.observability, name, *nominal),
        ]
    };
    let headers = ["parameter", "#from", "#nominal", "#to", "#not controllable at", "#not observable at"];
    let section = |what: &str, search: &Option<DistanceToUncontrollability>| {
        Body::default().list(search.iter().flat_map(|search| phrases::distance_to_loss(what, search)))
    };
    Body::default()
        .pictures(pictures::margins(sensitivity))
        .table(&headers, sensitivity.parameters.iter().map(row))
        .part("Controllability", section("controllability", &sensitivity.controllability))
        .part("Observability", section("observability", &sensitivity.observability))
}

fn reduction(analysis: &Analysis, drawn: bool) -> Body {
    if analysis.coordinates.is_empty() && analysis.bases.is_empty() {
        return Body::default();
    }
    let headers = ["basis", "#not orthogonal by", "matrix", "eigenvalues", "centres", "radii", "#within discs"];
    let discs = Body::default().table(&headers, analysis.bases.iter().flat_map(bounds));
    let hint = if discs.0.is_empty() { "" } else { "Every eigenvalue lies in at least one disc of its matrix." };
    let body = Body::default()
        .names("Reduced coordinates", &analysis.coordinates)
        .part("Eigenvalues and Geršgorin's discs", discs.hint(hint));
    analysis.bases.iter().filter(|_| drawn).fold(body, |body, basis| {
        let title = format!("Matrices: {} (largest cosine of two columns {})", basis.name, number(basis.orthogonality));
        let all = [&basis.basis, &basis.inertia, &basis.damping, &basis.stiffness, &basis.input];
        body.detail(Body::default().fold(&title, Body::default().matrices(all)))
    })
}

fn bounds(basis: &Basis) -> Vec<Vec<Cell>> {
    let several = |values: &[f64]| match values {
        [first, .., last] if values.len() > VALUES => {
            format!("{} … {} ({})", number(*first), number(*last), values.len())
        }
        all => all.iter().map(|&value| number(value)).collect::<Vec<_>>().join(", "),
    };
    let row = |(k, bounds): (usize, &EigenvalueBounds)| {
        let EigenvalueBounds { matrix, unit, eigenvalues, centres, radii, .. } = bounds;
        row![
            if k == 0 { Cell::Span(basis.name.clone(), basis.bounds.len()) } else { Cell::Under },
            if k == 0 { number(basis.orthogonality) } else { String::new() },
            format!("{matrix} [{unit}]"),
            several(eigenvalues),
            several(centres),
            several(radii),
            phrases::discs(bounds),
        ]
    };
    basis.bounds.iter().enumerate().map(row).collect()
}

fn constraint_forces(forces: &ConstraintForces, drawn: bool) -> Body {
    let plural = if forces.rank == 1 { "" } else { "s" };
    let text = format!(
        "The projector P has rank {}: so many independent constraint{plural}. Largest entry of P^2 − P: {}.",
        forces.rank,
        number(forces.idempotence_residual)
    );
    let body = Body::default().paragraph(text).matrices([&forces.input_to_multiplier]);
    if !drawn {
        return body;
    }
    let projector = Body::default().fold("Projector", Body::default().matrices([&forces.projector]));
    body.detail(Body::default().matrices([&forces.input_to_torque]).and(projector))
}

fn certificate(structure: &Structure) -> Body {
    let certificate = &structure.certificate;
    if structure.states.is_empty() {
        return Body::default();
    }
    let primes: Vec<String> = certificate.primes.iter().map(u64::to_string).collect();
    let primes = if primes.is_empty() { String::new() } else { format!("Primes: {}", phrases::list(&primes, 12)) };
    let hint = "The exported data contain the certificate, so that another program can check it.";
    let statements = Body::default().list(certificate.statements.iter().cloned()).detail(Body::default().hint(primes));
    proof(
        Body::default().paragraph(phrases::certificate(certificate)),
        certificate.proven,
        Body::default().fold("Each statement and how it was decided", statements.hint(hint)),
    )
}

#[cfg(test)]
#[path = "../../tests/unit/present/analysis.rs"]
mod tests;
