//! An analysis or a design in sentences, the same on the page and in the terminal.

pub mod design;

use super::groups::summed;
use super::text::{DIGITS, figure, number, quantity};
use super::ticks::extent;
use kardan_results::{
    BoxVerdict, Certificate, Class, Complex, Construction, Count, Definition, DistanceToUncontrollability,
    EigenvalueBounds, ElementShare, Elimination, FailingMode, MatrixDistance, MatrixDistances, Mode, NamedShare,
    ParameterPoint, PlacementSearch, Pole, PolynomialRoots, Sampling, ShapePart, Structure, Zeros,
};
use kardan_rt::functions::{atan2, hypot};

/// Motions below this fraction of the largest are not named.
const SMALL_MOTION: f64 = 0.05;
/// Shares of the energy below this are not named.
const SMALL_SHARE: f64 = 0.03;
/// Number of parts of a motion that are named.
const NAMED: usize = 3;

/// `a, b, c and 5 more`.
pub fn list<T: AsRef<str>>(names: &[T], limit: usize) -> String {
    let shown: Vec<&str> = names.iter().take(limit).map(AsRef::as_ref).collect();
    match names.len().saturating_sub(limit) {
        0 => shown.join(", "),
        rest => format!("{} and {rest} more", shown.join(", ")),
    }
}

/// `Numbers: a, b, c and 5 more.`; nothing without entries.
pub fn listed<T: AsRef<str>>(what: &str, entries: impl IntoIterator<Item = T>, limit: usize) -> Option<String> {
    let entries: Vec<T> = entries.into_iter().collect();
    (!entries.is_empty()).then(|| format!("{what}: {}.", list(&entries, limit)))
}

/// `-3`, or `-3 ± 4 j` for a conjugate pair of which one is given.
pub fn pair(value: Pole) -> String {
    if value.im == 0.0 { number(value.re) } else { format!("{} ± {} j", number(value.re), number(value.im.abs())) }
}

/// Poles with conjugate pairs joined (the upper one represents both) and equal ones counted.
pub fn joined(values: &[Pole]) -> Vec<(Pole, usize)> {
    let near = |a: Pole, b: Pole| hypot(a.re - b.re, a.im - b.im) <= 1e-9 * hypot(a.re, a.im);
    let mut out: Vec<(Pole, usize)> = Vec::new();
    for &value in values {
        let mirrored = Pole { im: -value.im, ..value };
        if value.im < 0.0 && values.iter().any(|&candidate| near(mirrored, candidate)) {
            continue;
        }
        // Equal poles are counted, close ones are not.
        match out.iter_mut().find(|(counted, _)| *counted == value || *counted == mirrored) {
            Some((_, times)) => *times += 1,
            None => out.push((value, 1)),
        }
    }
    out
}

/// The values with conjugate pairs joined and equal ones counted: `-1 (twice)`, `-3 ± 4 j`.
pub fn pairs(values: &[Pole]) -> Vec<String> {
    let counted = |(value, times): (Pole, usize)| match (pair(value), times) {
        (text, 1) => text,
        (text, 2) => format!("{text} (twice)"),
        (text, _) => format!("{text} ({times} times)"),
    };
    joined(values).into_iter().map(counted).collect()
}

/// Zeros with their unit, or their polynomial where they are not known.
pub fn roots(zeros: Option<&PolynomialRoots>, unit: &str) -> String {
    match zeros {
        None => "not decided".into(),
        Some(zeros) if !zeros.values.is_empty() => format!("{}{unit}", list(&pairs(&zeros.values), 100)),
        Some(zeros) if zeros.polynomial == "1" => "none".into(),
        Some(zeros) => zeros.polynomial.clone(),
    }
}

/// `s^2 + 3/2 s + 2` from the coefficients of 1, s, s², …
pub fn polynomial(coefficients: &[String]) -> String {
    let mut text = String::new();
    for (power, coefficient) in coefficients.iter().enumerate().rev().filter(|(_, c)| *c != "0") {
        let (sign, size) = match coefficient.strip_prefix('-') {
            Some(size) => ("-", size),
            None => ("+", coefficient.as_str()),
        };
        text += &match (text.is_empty(), sign) {
            (true, "+") => String::new(),
            (true, _) => "-".into(),
            (false, sign) => format!(" {sign} "),
        };
        let variable = match power {
            0 => String::new(),
            1 => "s".into(),
            _ => format!("s^{power}"),
        };
        text += &match (size, power) {
            (size, 0) => size.to_owned(),
            ("1", _) => variable,
            _ => format!("{size} {variable}"),
        };
    }
    if text.is_empty() { "0".into() } else { text }
}

/// Whether the model is in the class that the theory is about.
pub fn class(class: &Class) -> String {
    let broken = class.assumptions.iter().filter(|assumption| !assumption.satisfied).count();
    match (class.constant_linear, broken, class.assumptions.len()) {
        (true, ..) => "A constant linear constrained mechanical system: all assumptions hold.".into(),
        (false, 0, _) => "Not a constant linear constrained mechanical system; linearised for this analysis.".into(),
        (false, broken, all) => format!(
            "Not a constant linear constrained mechanical system: {broken} of {all} assumptions {} not hold.{}",
            if broken == 1 { "does" } else { "do" },
            // Shafts without inertia leave a model linear.
            match class
                .assumptions
                .iter()
                .any(|assumption| !assumption.satisfied && !assumption.statement.starts_with("the inertia matrix"))
            {
                true => " The analysis is that of the linearised model.",
                false => "",
            }
        ),
    }
}

/// What kind of constraint: `holonomic, scleronomic, linear`.
pub fn constraint_kind(constraint: &kardan_results::ConstraintClass) -> String {
    let chosen = |satisfied: bool, yes: &'static str, no: &'static str| if satisfied { yes } else { no };
    let holonomic = constraint.holonomic.map(|satisfied| chosen(satisfied, "holonomic", "nonholonomic"));
    [
        chosen(constraint.equality, "equality", "inequality"),
        holonomic.unwrap_or("whether holonomic not decided"),
        chosen(constraint.scleronomic, "scleronomic", "rheonomic"),
        chosen(constraint.linear, "linear", "nonlinear"),
    ]
    .join(", ")
}

/// Eliminated motions without inertia, and their replacement: one sentence each.
pub fn elimination(elimination: &Elimination, structure: &Structure) -> Vec<String> {
    let Elimination { motions, direction, removed, definitions } = elimination;
    let states = structure.states.len();
    let before = (states + removed.len()).saturating_sub(definitions.len());
    let motion = match motions {
        1 => format!("The motion along {direction} has no inertia and is eliminated"),
        _ => {
            format!("{motions} independent motions, one of them along {direction}, have no inertia and are eliminated")
        }
    };
    let remain = if states == 1 { "remains" } else { "remain" };
    let mut sentences = vec![format!("{motion}: of {before} states {states} {remain}.")];
    if !removed.is_empty() {
        let follow = if removed.len() == 1 { "is not a state: it follows" } else { "are not states: they follow" };
        sentences.push(format!("{} {follow} algebraically from the other states and the inputs.", list(removed, 12)));
    }
    sentences.extend(defined("New states", definitions));
    sentences
}

/// States that are combinations of others: `New states: z1 = a.w + b.w.`
pub fn defined(what: &str, definitions: &[Definition]) -> Option<String> {
    listed(what, definitions.iter().map(|one| format!("{} = {}", one.state, one.expression)), 12)
}

/// The interval of all discs: `-1 … 3`.
pub fn discs(bounds: &EigenvalueBounds) -> String {
    let discs = bounds.centres.iter().zip(&bounds.radii);
    let (low, high) = extent(discs.flat_map(|(centre, radius)| [centre - radius, centre + radius]));
    if low <= high { format!("{} … {}", number(low), number(high)) } else { "–".into() }
}

/// The shafts that move most: `rack 1, wheel -0.5`, with a phase where they do not move in phase (`wheel 0.5 at 30°`).
pub fn motion(shape: &[ShapePart]) -> String {
    let size = |part: &&ShapePart| part.value.abs();
    let mut parts: Vec<_> = shape.iter().filter(|part| size(part) >= SMALL_MOTION).collect();
    parts.sort_by(|a, b| size(b).total_cmp(&size(a)));
    let one = |part: &&ShapePart| {
        let ShapePart { name, value: Complex { re, im } } = part;
        if im.abs() <= 0.05 * re.abs() {
            format!("{name} {}", figure(round(*re), 3))
        } else {
            format!("{name} {} at {}°", figure(round(size(part)), 3), figure(atan2(*im, *re).to_degrees().round(), 3))
        }
    };
    first(parts.len(), parts.iter().map(one))
}

/// The first entries, and the number of the others.
fn first(count: usize, texts: impl Iterator<Item = String>) -> String {
    let shown = texts.take(NAMED).collect::<Vec<_>>().join(", ");
    if count > NAMED { format!("{shown} and {} more", count - NAMED) } else { shown }
}

/// The elements that store most of the energy: `spring 50 %, rack 30 %`.
pub fn stored(mode: &Mode) -> String {
    let shares = summed(mode.stored.iter().map(|one| (one.element.as_str(), [one.share])));
    percents(shares.into_iter().map(|(element, [share])| (element, share)).collect())
}

/// The largest shares: `spring 50 %, rack 30 %`.
pub fn of_elements(shares: &[ElementShare]) -> String {
    percents(shares.iter().map(|one| (one.element.as_str(), one.share)).collect())
}

fn percents(mut shares: Vec<(&str, f64)>) -> String {
    let all = shares.iter().filter(|(_, share)| *share > 0.0).count();
    shares.retain(|(_, share)| *share >= SMALL_SHARE);
    if shares.is_empty() && all > 0 {
        return format!("spread over {all}");
    }
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    first(shares.len(), shares.iter().map(|(name, share)| format!("{name} {}", percent(*share))))
}

/// `12 %`.
pub fn percent(share: f64) -> String {
    if share.is_finite() { format!("{:.0} %", 100.0 * share) } else { "– %".into() }
}

fn round(value: f64) -> f64 {
    (100.0 * value).round() / 100.0
}

/// An uncontrollable mode: `The mode at -1 1/s (root of s + 1): body_2 moves; spring 50 % of the energy.`
pub fn failing(mode: &FailingMode) -> String {
    let count = if mode.defect > 1 { format!(", {} independent motions", mode.defect) } else { String::new() };
    let mut text = format!("the mode at {} 1/s (root of {}{count})", pair(mode.eigenvalue), mode.factor);
    let moving: Vec<String> =
        mode.shafts.iter().map(|NamedShare { name, share }| format!("{name} {}", number(round(*share)))).collect();
    if !moving.is_empty() {
        text += &format!("; it moves {} (relative to the largest)", list(&moving, 6));
    }
    let elements = percents(mode.elements.iter().map(|one| (one.name.as_str(), one.share)).collect());
    if !elements.is_empty() {
        text += &format!("; energy in {elements}");
    }
    text + "."
}

/// `rank 4 of 4: every state`; a rank that is not decided is a lower bound.
pub fn rank(rank: usize, states: usize, decided: bool) -> String {
    if !decided {
        return format!("rank at least {rank} of {states}: equality is not proven");
    }
    match states.saturating_sub(rank) {
        0 => format!("rank {rank} of {states}: every state"),
        1 => format!("rank {rank} of {states}: 1 state is missing"),
        missing => format!("rank {rank} of {states}: {missing} states are missing"),
    }
}

/// How many are needed, in one sentence; `what` is `input` or `output`.
pub fn least(what: &str, number: usize, proof: Option<&Count>) -> String {
    let some = if number == 1 { format!("1 {what} is") } else { format!("{number} {what}s are") };
    match proof {
        None => format!("{some} necessary and sufficient; this is not proven (see the certificate)."),
        Some(_) if number == 1 => format!("{some} enough: proven."),
        Some(proof) if proof.common_factor.is_empty() && proof.rows.is_empty() => format!("{some} enough: proven."),
        Some(_) => format!("{some} enough, and fewer are not: proven."),
    }
}

/// The proof of the least number; empty if there is none.
pub fn why_least(what: &str, number: usize, proof: Option<&Count>) -> Vec<String> {
    let Some(proof) = proof else { return Vec::new() };
    let (matrix, line) = if what == "input" { ("a controllability", "column") } else { ("an observability", "row") };
    let (order, plural) = (proof.minor.columns.len(), if number == 1 { "" } else { "s" });
    let mut sentences = Vec::new();
    if order > 0 {
        sentences.push(format!(
            "{number} {what}{plural} can be enough: some integer {what} matrix with {number} {line}{plural} gives \
             {matrix} matrix with a minor of order {order} that is nonzero modulo the prime {}; so it is nonzero.",
            proof.minor.prime
        ));
    }
    if number > 1 && !proof.common_factor.is_empty() {
        sentences.push(format!(
            "Fewer {what}s are not enough: each root of {} has {number} independent eigenvectors, and each needs an {what} of its own.",
            polynomial(&proof.common_factor)
        ));
    } else if number == 1 {
        let none = if what == "input" {
            "Without an input no state is controllable."
        } else {
            "Without an output no state is observable."
        };
        sentences.push(none.into());
    }
    sentences
}

/// The constructed input matrix column by column, and why each part of it is there.
pub fn construction(found: &Construction) -> Vec<String> {
    let sum = |weights: &mut dyn Iterator<Item = &String>| {
        let mut text = String::new();
        for (weight, row) in weights.zip(&found.rows).filter(|(weight, _)| *weight != "0") {
            let size = weight.strip_prefix('-').unwrap_or(weight);
            text += match (text.is_empty(), size == weight) {
                (true, true) => "",
                (true, false) => "-",
                (false, true) => " + ",
                (false, false) => " - ",
            };
            if size != "1" {
                text += &format!("{size} ");
            }
            text += row;
        }
        text
    };
    let columns: Vec<String> = (0..found.input.first().map_or(0, Vec::len))
        .map(|j| format!("input {} acts on {}", j + 1, sum(&mut found.input.iter().filter_map(|row| row.get(j)))))
        .collect();
    let mut out = vec![format!("Enough, for instance: {}.", columns.join("; "))];
    out.extend(found.steps.iter().map(|step| {
        let times = if step.multiplier == "1" { String::new() } else { format!("{} times ", step.multiplier) };
        let added = sum(&mut step.direction.iter());
        let plural = if step.defect == 1 { "motion was" } else { "motions were" };
        let (factor, defect, column) = (&step.factor, step.defect, step.column + 1);
        format!("For the roots of {factor} ({defect} {plural} not controllable): {times}{added} in input {column}.")
    }));
    out
}

/// Whether zeros lie in the right half-plane; `None` if there is no statement.
pub fn half_plane(zeros: &Zeros) -> Option<&'static str> {
    match zeros.growing {
        Some(0) => None,
        Some(_) => Some("Some zeros lie in the right half-plane, decided exactly: the model is not minimum phase."),
        None if zeros.values.is_empty() => {
            Some("Whether zeros lie in the right half-plane is not decided: their polynomial is not expanded.")
        }
        None => Some("Whether zeros lie in the right half-plane is not decided: they are floating-point numbers."),
    }
}

/// Definition of the distances of matrices.
pub const MATRIX_DISTANCE: &str = "Frobenius norm of the change of A and B (of A and C) that loses a mode; it depends on the \
units of the states. The smaller number is a proven lower bound (0 where rounding hides it), the larger one belongs to an exactly known change.";

/// A warning if the data do not distinguish the system from one that has lost a mode.
pub fn lost_in_last_digit(distances: Option<&MatrixDistances>) -> Option<String> {
    let distances = distances?;
    let both = [("controllable", &distances.controllability), ("observable", &distances.observability)];
    let lost: Vec<&str> = both
        .iter()
        .filter(|(_, found)| found.as_ref().is_some_and(|found| found.within_data_uncertainty))
        .map(|(what, _)| *what)
        .collect();
    (!lost.is_empty()).then(|| {
        format!(
            "But within the last digit of the data there is a model that is not {}: see the distance of the matrices.",
            lost.join(" and not ")
        )
    })
}

/// The nearest system that has lost a mode.
pub fn nearest_system(what: &str, found: &MatrixDistance) -> String {
    let mode = pair(found.eigenvalue);
    let names: Vec<&str> = found.states.iter().take(4).map(|one| one.name.as_str()).collect();
    let moved = list(&names, 100);
    match found.within_data_uncertainty {
        true => format!(
            "Warning: a change of {} makes it {what}; that is within the last digit of the data ({}). The mode {mode} 1/s is lost \
             there ({moved}); rely on the result only if the numbers are exact.",
            number(found.upper),
            number(found.data_uncertainty)
        ),
        false => format!("A change of {} makes it {what}: the mode {mode} 1/s is lost ({moved}).", number(found.upper)),
    }
}

/// Normal rank and what it means.
pub fn normal_rank(structure: &Structure) -> String {
    let (inputs, outputs) = (structure.inputs.len(), structure.outputs.len());
    let (rank, full) = (structure.zeros.normal_rank, inputs.min(outputs));
    let meaning = match () {
        () if rank >= full => String::new(),
        () if rank == 0 => ": the inputs do not affect the outputs".into(),
        () if inputs <= outputs => ": some combination of the inputs does not affect the outputs".into(),
        () => ": some combination of the outputs never moves".into(),
    };
    format!("The transfer matrix ({outputs} × {inputs}) has normal rank {rank}{meaning}.")
}

/// The search of the sets and the definition of their score.
pub fn search(search: &PlacementSearch) -> String {
    let gap = if search.exhaustive {
        String::new()
    } else if search.gap.is_finite() {
        format!("; no cheaper set can save more than {}", percent(search.gap))
    } else {
        "; how much a cheaper set could save is not known".into()
    };
    let tried = if search.exhaustive { String::new() } else { format!(" ({} sets tried)", search.tried) };
    let better = if search.larger_is_better { "larger" } else { "smaller" };
    let score = if search.measure.is_empty() {
        String::new()
    } else {
        format!(" Score: {}; {better} is better.", search.measure)
    };
    format!("{}{tried}{gap}.{score}", capital(&search.method))
}

/// The distance of the nearest loss, the verdict over the box and the sampling: one sentence each. `what` is
/// `controllability` or `observability`.
pub fn distance_to_loss(what: &str, search: &DistanceToUncontrollability) -> Vec<String> {
    if search.nearest.is_none() && search.method.is_empty() && search.sampling.is_none() {
        return vec![format!("A loss of {what} within the tolerances was not searched for.")];
    }
    let mut sentences = Vec::new();
    let searched = !search.method.is_empty();
    sentences.push(match &search.nearest {
        None if search.starts == 0 => format!("The nearest loss of {what} was not searched for."),
        None => format!(
            "A search from {} points for the nearest loss of {what} found none within ten tolerances of the parameters.",
            search.starts
        ),
        Some(loss) => {
            let point = |one: &ParameterPoint| format!("{} = {}", one.parameter, quantity(one.value, DIGITS, &one.unit));
            let at: Vec<String> = loss.at.iter().map(point).collect();
            let moving: Vec<&String> = loss.shafts.iter().map(|NamedShare { name, .. }| name).collect();
            let moving = if moving.is_empty() { String::new() } else { format!(", moving {}", list(&moving, 4)) };
            let distance = if loss.distance == 0.0 {
                "at the nominal parameters".into()
            } else {
                let place = if loss.distance <= 1.0 { "inside" } else { "outside" };
                format!("at {} tolerances, {place} the box", number(loss.distance))
            };
            format!(
                "The nearest loss of {what} found lies {distance}: {}. There the mode at {} 1/s is lost{moving} \
                 (residual {}).",
                list(&at, 6),
                pair(loss.eigenvalue),
                number(loss.residual)
            )
        }
    });
    let method = if searched { format!(" ({})", search.method) } else { String::new() };
    sentences.extend(match search.box_verdict {
        BoxVerdict::NotCertified if !searched => None,
        BoxVerdict::Certified => Some(format!("Proven: {what} is nowhere lost in the box of tolerances{method}.")),
        BoxVerdict::Lost => Some(format!("{} is lost inside the box of tolerances{method}.", capital(what))),
        BoxVerdict::NotCertified => {
            Some(format!("Whether {what} is lost somewhere in the box of tolerances is not decided{method}."))
        }
    });
    if search.proven_distance > 0.0 && search.proven_distance != 1.0 {
        let reach = number(search.proven_distance);
        sentences.push(format!("It is proven that there is no loss of {what} within {reach} tolerances."));
    }
    sentences.extend(search.sampling.as_ref().map(sampling));
    sentences
}

fn sampling(sampling: &Sampling) -> String {
    let Sampling { samples, seed, threshold, unit, probability, interval, smallest, median, largest } = sampling;
    format!(
        "Of {samples} samples of the box (seed {seed}) a fraction {} (95 % interval {} … {}) falls below {} {unit}; \
         smallest {}, median {}, largest {} {unit}.",
        number(*probability),
        number(interval.lower),
        number(interval.upper),
        number(*threshold),
        number(*smallest),
        number(*median),
        number(*largest)
    )
}

/// Proven, or the probability of an error.
pub fn certificate(certificate: &Certificate) -> String {
    if certificate.proven {
        "Every result is proven over the rationals.".into()
    } else {
        format!(
            "Results not marked as proven are computed modulo random primes: the probability that any of them is \
             wrong is at most {}. `kardan analyze --certify` proves it.",
            number(certificate.failure_probability)
        )
    }
}

/// A list whose lines break between its entries only.
pub fn unbroken(list: &str) -> String {
    let entry = |entry: &str| match entry.split_once(" and ") {
        Some((entry, more)) => format!("{} and {more}", entry.replace(' ', "\u{a0}")),
        None => entry.replace(' ', "\u{a0}"),
    };
    list.split(", ").map(entry).collect::<Vec<_>>().join(", ")
}

/// The meaning of marked placements.
pub const EFFICIENT: &str = "Marked sets are efficient: every better set costs more.";

pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// A larger factor is only rounding.
const FARTHEST: f64 = 1e9;

/// The range of factors, as text; `write` gets the side and the number.
pub(crate) fn factors([low, high]: [f64; 2], write: impl Fn(usize, f64) -> String) -> [String; 2] {
    let low = if low > 0.0 && low * FARTHEST < 1.0 { "less than 1e-9".into() } else { write(0, low) };
    let high = match high {
        high if high.is_infinite() => "any".into(),
        high if high > FARTHEST => "more than 1e9".into(),
        high => write(1, high),
    };
    [low, high]
}

#[cfg(test)]
#[path = "../tests/unit/phrases.rs"]
mod tests;
