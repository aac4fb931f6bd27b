//! Faults that sensors can detect and isolate, and the relations that do it.

use crate::groups::distinct;
use crate::model::{Body, Cell, Entry, row};
use crate::phrases;
use crate::text::number;
use kardan_results::{Analysis, FaultPlace, FaultVerdict, Parity, ParityTerm, Residual, SensorSets, Threshold};

/// More names, residuals or sets are counted where space is limited.
const NAMES: usize = 12;
const RESIDUALS: usize = 12;

/// The section.
pub fn parity(analysis: &Analysis) -> Body {
    let Some(found) = &analysis.parity else { return Body::default() };
    let unknown = match found.unknown.is_empty() {
        true => "no other input acts".to_string(),
        false => format!("unknown: {}", phrases::list(&found.unknown, NAMES)),
    };
    let commands = match found.commands.is_empty() {
        true => "no input is known".to_string(),
        false => format!("the torques of {} are known as commanded", phrases::list(&found.commands, NAMES)),
    };
    Body::default()
        .paragraph(format!("Read: {}; {commands}; {unknown}.", phrases::list(&found.sensors, NAMES)))
        .part("Residuals at one instant", residuals(found))
        .part("Faults", faults(found))
        .part("Smallest sets of sensors", sets(&found.sets))
}

/// `wg_encoder − 51 cs_encoder`; derivatives have primes.
fn sum(terms: &[ParityTerm]) -> String {
    let mut out = String::new();
    for (k, term) in terms.iter().enumerate() {
        let size = Entry { value: term.value.abs(), exact: Some(term.coefficient.trim_start_matches('-').into()) };
        let (size, _) = size.rounded_text(6);
        out += match (k, term.value < 0.0) {
            (0, false) => "",
            (0, true) => "−",
            (_, false) => " + ",
            (_, true) => " − ",
        };
        let size = if size == "1" { String::new() } else { format!("{size} ") };
        out += &format!("{size}{}{}", term.signal, "'".repeat(term.derivative));
    }
    out
}

fn residuals(found: &Parity) -> Body {
    if found.residuals.is_empty() {
        return Body::default().paragraph(
            "None: at one instant the readings are independent of each other, so only their trajectories can show a fault.",
        );
    }
    let count = found.residuals.len();
    let plural = if count == 1 { "" } else { "s" };
    let all = match found.exhaustive {
        true => format!(
            "{count} minimal residual{plural}, {} of them independent; these are all. Each is constant for every motion of the model, and needs all of its readings.",
            found.independent
        ),
        false => {
            format!("{count} independent minimal residual{plural}; there are more, made of these, too many to list.")
        }
    };
    let rows = found
        .residuals
        .iter()
        .enumerate()
        .map(|(k, one)| row![format!("r{}", k + 1), Cell::Code(sum(&one.terms)), constant(one), validity(one)]);
    let limit_lines = found.residuals.iter().enumerate();
    let limit_lines = limit_lines.filter_map(|(k, one)| Some(limits(k, one, one.threshold.as_ref()?)));
    let moved =
        found.residuals.iter().enumerate().filter_map(|(k, one)| tolerances(&format!("r{}", k + 1), &one.terms));
    let angles = found.residuals.iter().any(|one| one.up_to_constant);
    Body::default()
        .paragraph(all)
        .table_of(RESIDUALS, &["", "residual", "#is", "valid"], rows)
        .hint(if angles {
            "The mounting of angle and torsion sensors adds a constant to a residual: subtract its initial value. An offset present from the start is then not detected."
        } else {
            ""
        })
        .list(limit_lines)
        .list(moved)
}

fn constant(one: &Residual) -> String {
    match one.constant {
        None => "–".into(),
        Some(0.0) => "0".into(),
        Some(value) => format!("{} {}", number(value), one.unit),
    }
}

fn validity(one: &Residual) -> String {
    match one.linearised_at.is_empty() {
        true => "everywhere".into(),
        false => format!("near the operating point of {}", phrases::list(&one.linearised_at, NAMES)),
    }
}

/// `threshold 2 rad (noise 0.3, steps up to 0.1): no false alarm`
fn threshold(limit: &Threshold, unit: &str) -> String {
    let alarms = match limit.false_alarms_per_hour {
        rate if rate > 0.0 => format!("at most {} false alarms an hour from white Gaussian noise", number(rate)),
        _ => "no false alarm: there is no noise, and no step exceeds it".into(),
    };
    let [value, noise, steps] = [limit.threshold, limit.noise, limit.steps].map(number);
    format!("threshold {value} {unit} (noise {noise}, steps up to {steps}): {alarms}")
}

/// How many samples raise an alarm, and a remark on several sample times.
fn samples(limit: &Threshold) -> (String, &'static str) {
    let samples = if limit.debounce == 1 { "one sample".into() } else { format!("{} samples", limit.debounce) };
    let multirate = " Its sensors have different sample times: add its change within one sample time.";
    (samples, if limit.multirate { multirate } else { "" })
}

fn limits(k: usize, one: &Residual, limit: &Threshold) -> String {
    let smallest = one.terms.iter().zip(&limit.min_detectable);
    let smallest: Vec<String> = smallest.map(|(term, size)| format!("{} {}", term.signal, number(*size))).collect();
    let (samples, multirate) = samples(limit);
    let late = match limit.sample_time > 0.0 {
        true => format!("{samples} beyond it raise an alarm, after {} s at the latest", number(limit.detection_time)),
        false => "it is evaluated at every instant".into(),
    };
    format!(
        "r{}: {}; {late}. Changes detected with 99.9 %: {}.{multirate}",
        k + 1,
        threshold(limit, &one.unit),
        smallest.join(", ")
    )
}

/// The threshold of a residual in time, after its filter.
fn in_time(one: &FaultVerdict, limit: &Threshold) -> Option<String> {
    let filter = number(limit.filter?);
    let times = match one.order? {
        1 => String::new(),
        order => format!("^{order}"),
    };
    let (samples, multirate) = samples(limit);
    Some(format!(
        "{}: the relation behind 1/({filter} s + 1){times}, by the bilinear rule at {} s: {}. A change by {} {} \
         is detected with 99.9 % after {} s, {samples} beyond the threshold.{multirate}",
        place(one),
        number(limit.sample_time),
        threshold(limit, &one.unit),
        limit.min_detectable.first().copied().map(number)?,
        one.fault_unit,
        number(limit.detection_time),
    ))
}

fn tolerances(name: &str, terms: &[ParityTerm]) -> Option<String> {
    let moved: Vec<String> = terms
        .iter()
        .filter(|term| term.tolerance > 0.0)
        .map(|term| format!("{} of {}{}", number(term.tolerance), term.signal, "'".repeat(term.derivative)))
        .collect();
    (!moved.is_empty()).then(|| format!("{name}: tolerances of the model add up to {}.", moved.join(" and ")))
}

fn faults(found: &Parity) -> Body {
    let friction = found.faults.iter().any(|one| one.detectable_despite_friction.is_some());
    let mut columns = vec!["additive fault of", "detectable", "while constant", "not isolable from", "#derivatives"];
    if friction {
        columns.insert(2, "with friction unknown");
    }
    let yes = |validity: bool| Cell::judged(validity, ["yes", "no"]);
    let rows = found.faults.iter().map(|one| {
        let stays = match one.strongly_detectable {
            _ if !one.detectable => "–".into(),
            None => Cell::from("not decided"),
            Some(stays) => yes(stays),
        };
        let same =
            if one.not_isolable_from.is_empty() { "–".into() } else { phrases::list(&one.not_isolable_from, NAMES) };
        let order = one.order.map_or("–".into(), |order| order.to_string());
        let mut cells = row![place(one), yes(one.detectable), stays, same, order];
        if friction {
            cells.insert(2, one.detectable_despite_friction.map_or("–".into(), yes));
        }
        cells
    });
    let relations = found.faults.iter().filter(|one| !one.relation.is_empty()).map(|one| {
        let friction = match one.friction_in_relation.is_empty() {
            true => String::new(),
            false => format!(" (friction of {} moves it too)", phrases::list(&one.friction_in_relation, NAMES)),
        };
        row![place(one), Cell::Code(format!("{} = 0", sum(&one.relation))), friction.trim().to_string()]
    });
    let delay_lines = found.faults.iter().filter_map(|one| in_time(one, one.threshold.as_ref()?));
    let moved = found.faults.iter().filter(|one| one.order.is_some_and(|order| order > 0));
    let moved = moved.filter_map(|one| tolerances(&place(one), &one.relation));
    let decided = match found.exact {
        true => "Decided exactly.",
        false => {
            "Decided modulo random primes, wrong with a probability below 1e-12: for more than 24 states it is not decided exactly."
        }
    };
    Body::default()
        .list(sentences(found))
        .table(&columns, rows)
        .hint(format!(
            "{decided} One fault at a time, with any time function; `no` while constant: a constant fault looks like another initial state or disturbance and is detected only while it changes."
        ))
        .fold(
            "Relations that the faults violate",
            Body::default()
                .table(&["fault of", "relation (a prime: a derivative)", ""], relations)
                .list(delay_lines)
                .list(moved),
        )
}

fn place(one: &FaultVerdict) -> String {
    match one.location {
        FaultPlace::Sensor => one.fault.clone(),
        FaultPlace::Input => format!("{}.tau", one.fault),
    }
}

/// The main results, as text.
fn sentences(found: &Parity) -> Vec<String> {
    let named =
        |which: &dyn Fn(&&FaultVerdict) -> bool| found.faults.iter().filter(which).map(place).collect::<Vec<_>>();
    let silent = named(&|one| !one.detectable);
    let isolable = named(&|one| one.detectable && one.not_isolable_from.is_empty());
    let groups = distinct(found.faults.iter().filter(|one| !one.not_isolable_from.is_empty()).map(|one| {
        let mut group = named(&|other| one.not_isolable_from.contains(&other.fault) || other.fault == one.fault);
        group.sort();
        group
    }));
    let mut out = Vec::new();
    if !silent.is_empty() {
        out.push(format!(
            "No residual detects a fault of {}: the unknowns explain every time function of it.",
            phrases::list(&silent, NAMES)
        ));
    }
    out.extend(phrases::listed("Detectable, and isolable from every other single fault", isolable, NAMES));
    let together = |group: Vec<String>| phrases::listed("Detectable, but not isolable from each other", group, NAMES);
    out.extend(groups.into_iter().filter_map(together));
    out
}

fn sets(found: &[SensorSets]) -> Body {
    let one = |set: &Vec<String>| set.join(" + ");
    let row = |sets: &SensorSets| {
        let which = match (sets.sets.is_empty(), sets.exhaustive) {
            (true, true) => "no set of the candidates".to_string(),
            (true, false) => "not found: there are too many sets to try".into(),
            _ => phrases::list(&sets.sets.iter().map(one).collect::<Vec<_>>(), NAMES),
        };
        row![&sets.goal, which]
    };
    let candidates = found.first().map(|sets| phrases::list(&sets.candidates, NAMES)).unwrap_or_default();
    Body::default()
        .table(&["goal", "smallest sets"], found.iter().map(row))
        .hint(format!("Candidates: {candidates}. All smaller sets were tried, modulo random primes; `[[analysis.sensor]]` adds other locations."))
}
