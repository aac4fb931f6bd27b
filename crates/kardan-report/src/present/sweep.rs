//! The results of a sweep as a page.

use super::optional;
use crate::model::{Body, Cell, Page, Picture, row, warnings};
use crate::samples::{Again, Samples};
use crate::text::{escape, figure, number, quantity, shown};
use kardan_results::{
    DisplayUnit, Sweep, SweptBound, SweptRare, SweptRequirement, SweptRule, SweptValues, SweptWorst, Verdict,
};
use kardan_rt::functions::{log10, powi};

/// Digits of a number.
const DIGITS: usize = 4;
/// Digits of a bound: those that it has, as its file would have them.
const BOUND_DIGITS: usize = 15;
/// Decimals of hundredths.
const MOST_DECIMALS: i32 = 12;
/// Number of parameters named for a figure.
const MOST_SHARES: usize = 4;

/// The page of a sweep with its runs, and how to rerun each.
pub fn page_with(found: &Sweep, samples: &Samples, again: &Again) -> Page {
    let mut page = page(found);
    let explored = if samples.is_empty() { Body::default() } else { explored(samples, found) };
    let more = Page::sections([("samples", "Runs", explored), ("cases", "Least and largest", cases(found, again))]);
    let at = page.sections.iter().position(|one| one.anchor == "figures" || one.anchor == "measured");
    let at = at.unwrap_or(page.sections.len());
    page.sections.splice(at..at, more);
    page.samples = (!samples.is_empty()).then(|| samples.data(found, again));
    page
}

/// The area where the page's script draws, and its content without the script.
fn explored(samples: &Samples, found: &Sweep) -> Body {
    let drawing = "<div class=\"samples\" id=\"samples-plots\"></div>\n";
    let picture = Picture { drawing: drawing.into(), ..Picture::default() };
    Body::default().hint(samples.describe()).pictures([picture]).pictures(samples.still(found))
}

/// The commands that rerun the samples of least and largest numbers.
fn cases(found: &Sweep, again: &Again) -> Body {
    let columns = titles(found, "of", &["", "#value", "#sample", "command for the full run"]);
    let requirements = found.requirements.iter().map(|one| {
        let worst = [one.below.is_none() && one.above.is_some(), one.above.is_none() && one.below.is_some()];
        (&one.text, &one.variant, &one.measured, (one.unit.as_str(), one.display.as_ref()), worst)
    });
    let figures = found
        .figures
        .iter()
        .map(|one| (&one.name, &one.variant, &one.values, (one.unit.as_str(), one.display.as_ref()), [false; 2]));
    let mut rows = Vec::new();
    let mut add = |name: &String, variant: &String, word: String, value: String, sample: u64| {
        let number = found.variants.iter().position(|one| one == variant).unwrap_or(0);
        let command = Cell::Verbatim(again.of(sample, number).unwrap_or_default());
        rows.push(named_row(found, name, variant, row![word, value, sample.to_string(), command]));
    };
    for (name, variant, values, (unit, display), worst) in requirements.chain(figures) {
        let (Some(ends), Some(quantiles)) = (values.extreme_samples, values.quantiles) else { continue };
        let [least, largest] = [0, 6].map(|k| shown(quantiles[k], DIGITS, unit, display));
        if quantiles[0] == quantiles[6] {
            add(name, variant, "the same in all".into(), least, ends[0]);
            continue;
        }
        for (k, (word, value)) in [("least", least), ("largest", largest)].into_iter().enumerate() {
            let word = if worst[k] { format!("{word}, the worst") } else { word.into() };
            add(name, variant, word, value, ends[k]);
        }
    }
    if let Some(worst) = &found.worst {
        let value = worst.measured.map_or_else(String::new, |x| shown(x, DIGITS, &worst.unit, None));
        add(&worst.text, &worst.variant, "the worst that was found".into(), value, worst.sample);
    }
    let body = match &again.full {
        Some(Ok(file)) => {
            let file = escape(file);
            let drawing =
                format!("<p><a href=\"{file}\">Full runs of the worst cases</a>, with all signals and events.</p>\n");
            Body::default().pictures([Picture { drawing, ..Picture::default() }])
        }
        Some(Err(why)) => Body::default().judge(false, format!("There are no full runs of the worst cases: {why}.")),
        None => Body::default(),
    };
    body.table_of(usize::MAX, &columns, rows)
}

/// The page of a sweep.
pub fn page(found: &Sweep) -> Page {
    Page {
        name: format!("Sweep: {}", found.model),
        description: found.description.clone(),
        verdict: Some(verdict(found)),
        alerts: warnings(&found.warnings),
        sections: Page::sections([
            ("worst", "The worst case that was found", optional(&found.worst, |one| worst(found, one))),
            ("rare", "Probability of a rare failure", optional(&found.rare, |one| rare(found, one))),
            ("requirements", "Probability of each requirement", requirements(found)),
            ("rules", "Where requirements fail", rules(found)),
            ("figures", "Figures", figures(found)),
            ("measured", "Measured values of requirements", measured(found)),
            ("indices", "Sobol indices", indices(found)),
            ("effects", "Elementary effects", effects(found)),
            ("failures", "Runs without valid results", failures(found)),
            ("varied", "Varied parameters", varied(found)),
            ("notes", "Notes", Body::default().list(found.notes.iter().cloned())),
        ]),
        ..Page::default()
    }
}

fn verdict(found: &Sweep) -> Verdict {
    if let Some(worst) = &found.worst {
        let margin = format_margin(worst);
        let word = if worst.fails { "fails" } else { "is met" };
        let text = format!("{} {word} in the worst case that {} runs found: {margin}.", worst.text, found.rows);
        return Verdict { sound: !worst.fails && found.missing == 0, text };
    }
    if let Some(rare) = &found.rare {
        let text = match (rare.probability, rare.interval) {
            (Some(probability), Some([low, high])) => {
                let [probability, low, high] = [probability, low, high].map(|x| figure(x, 2));
                format!("{} fails with the probability {probability} (about {low} to {high})", rare.text)
            }
            _ => format!("The failure probability of {} was not found: {}", rare.text, rare.stop_reason),
        };
        return Verdict {
            sound: rare.probability.is_none() && found.missing == 0,
            text: format!("{text}, by {} runs.", found.rows),
        };
    }
    let ended: u64 = found.failures.iter().map(|one| one.count).sum();
    let never = |one: &&SweptRequirement| one.failed > 0;
    let failing = found.requirements.iter().filter(never).count();
    let all = found.requirements.len();
    let mut text = match (all, failing) {
        _ if found.rows == 0 => "No runs were made".into(),
        (0, _) => format!("{} runs", found.rows),
        (_, 0) => format!("Every requirement is met in all of {} runs", found.rows),
        _ => format!("{failing} of {all} requirements fail in some of {} runs", found.rows),
    };
    if ended > 0 {
        text += &format!("; {ended} did not complete");
    }
    if found.missing > 0 {
        text += &format!("; {} were not made", found.missing);
    }
    Verdict { sound: failing == 0 && ended == 0 && found.missing == 0, text: text + "." }
}

fn several(found: &Sweep) -> bool {
    found.variants.len() > 1
}

/// Columns, with that of the variant where there are several.
fn titles(found: &Sweep, first: &str, further_titles: &[&str]) -> Vec<String> {
    let mut out = vec![first.to_string()];
    out.extend(several(found).then(|| "variant".to_string()));
    out.extend(further_titles.iter().map(ToString::to_string));
    out
}

/// Cells of such columns.
fn named_row(found: &Sweep, first: impl Into<Cell>, variant: &str, further_cells: Vec<Cell>) -> Vec<Cell> {
    let mut out = vec![first.into()];
    out.extend(several(found).then(|| variant.into()));
    out.extend(further_cells);
    out
}

fn percent(part: f64) -> String {
    format!("{} %", share(part, DIGITS))
}

/// A part of all in hundredths, without their sign: with this many digits, or near 100 % enough to show two digits of the complement.
fn share(part: f64, digits: usize) -> String {
    let missing = 100.0 * (1.0 - part);
    if !(missing > 0.0 && missing < 1.0) {
        return figure(100.0 * part, digits);
    }
    let decimals = 1 - log10(missing).floor() as i32;
    let digits_text = format!("{:.*}", decimals.max(digits as i32 - 2).clamp(1, MOST_DECIMALS) as usize, 100.0 * part);
    digits_text.trim_end_matches('0').trim_end_matches('.').into()
}

/// A probability with two digits, rounded up: it is a bound.
fn at_most(probability: f64) -> String {
    if !(probability > 0.0 && probability < 1.0) {
        return figure(probability, 2);
    }
    let size = powi(10.0, 1 - log10(probability).floor() as i32);
    // Exact values of two digits stay.
    figure((probability * size - 1e-9).ceil() / size, 2)
}

fn requirements(found: &Sweep) -> Body {
    // Intervals of sequential sampling are wider, and valid simultaneously with that confidence.
    let interval = format!("#{} % interval", number(100.0 * found.confidence));
    let columns = titles(found, "requirement", &["#met in", "#fails in", "#probability", &interval, "#fails at most"]);
    let one = |one: &SweptRequirement| {
        let interval = one.interval.map(|[low, high]| format!("{} to {}", percent(low), percent(high)));
        let cells = row![
            one.passed.to_string(),
            one.failed.to_string(),
            one.probability.map_or_else(String::new, percent),
            interval.unwrap_or_default(),
            one.interval.map_or_else(String::new, |[low, _]| at_most(1.0 - low))
        ];
        named_row(found, Cell::Mark(one.failed == 0, one.text.clone()), &one.variant, cells)
    };
    let hint = "The interval is that of Clopper and Pearson for independent samples; samples of a Latin hypercube or \
                of Sobol's sequence usually spread no more, those of Halton's sequence of many parameters may.";
    let drawn = found.requirements.iter().any(|one| one.interval.is_some());
    let body = Body::default().table_of(usize::MAX, &columns, found.requirements.iter().map(one));
    body.hint(if drawn { hint } else { "" })
}

/// Where requirements fail, each with its rules.
fn rules(found: &Sweep) -> Body {
    let with = found.requirements.iter().filter(|one| !one.rules.is_empty());
    with.fold(Body::default(), |body, one| {
        let variant = if several(found) { format!(" ({})", one.variant) } else { String::new() };
        body.paragraph(format!("{}{variant} fails where:", one.text)).list(one.rules.iter().map(rule))
    })
}

/// A rule as a sentence.
fn rule(rule: &SweptRule) -> String {
    let conditions: Vec<String> = rule.bounds.iter().map(bound).collect();
    let [low, high] = rule.interval.map(|part| share(part, 3));
    let SweptRule { inside, failed, .. } = rule;
    let covers = share(rule.coverage, 3);
    format!(
        "{}: {failed} of {inside} samples there fail ({low} % to {high} %), {covers} % of all failures.",
        conditions.join(" and ")
    )
}

/// `0.2 ≤ grip < 0.41`
fn bound(bound: &SweptBound) -> String {
    let value = |value: f64| quantity(value, BOUND_DIGITS, &bound.unit);
    let name = &bound.parameter;
    match (bound.above.map(value), bound.below.map(value)) {
        (Some(above), Some(below)) => format!("{above} ≤ {name} < {below}"),
        (Some(above), None) => format!("{name} ≥ {above}"),
        (None, Some(below)) => format!("{name} < {below}"),
        (None, None) => name.clone(),
    }
}

/// The columns of numbers.
const COLUMNS: [&str; 7] = ["#mean", "#deviation", "#least", "#5 %", "#median", "#95 %", "#largest"];

/// Cells of numbers; differences of display units have no offset.
fn numbers(values: &SweptValues, unit: &str, display: Option<&DisplayUnit>) -> Vec<Cell> {
    let text =
        |value: Option<f64>| Cell::Text(value.map_or_else(String::new, |value| shown(value, DIGITS, unit, display)));
    let quantile = |k: usize| values.quantiles.map(|quantiles| quantiles[k]);
    [values.mean, values.deviation, quantile(0), quantile(1), quantile(3), quantile(5), quantile(6)].map(text).to_vec()
}

/// Parameters by their effect.
fn shares(values: &SweptValues) -> String {
    let main_shares = values.shares.iter().take(MOST_SHARES).filter(|share| share.slope.abs() > 0.05);
    let main_shares: Vec<String> =
        main_shares.map(|share| format!("{} {}", share.parameter, figure(share.slope, 2))).collect();
    let explained =
        values.r_squared.map_or_else(String::new, |part| format!(" ({} % explained)", number((100.0 * part).round())));
    if main_shares.is_empty() { String::new() } else { main_shares.join(", ") + &explained }
}

const SHARES_HINT: &str = "Parameters: standard deviations of the number per standard deviation of the parameter, by \
    a linear fit in all of them. What it does not explain is nonlinear, or comes from products.";

fn figures(found: &Sweep) -> Body {
    let columns = titles(found, "figure", &[&COLUMNS[..], &["parameters"]].concat());
    let rows = found.figures.iter().map(|one| {
        let mut cells = numbers(&one.values, &one.unit, one.display.as_ref());
        cells.push(Cell::Text(shares(&one.values)));
        named_row(found, &one.name, &one.variant, cells)
    });
    let body = Body::default().table_of(usize::MAX, &columns, rows);
    let values = found.figures.iter().map(|one| (&one.name, &one.variant, &one.values));
    body.list(list_missing_values(found, values)).hint(if found.figures.is_empty() { "" } else { SHARES_HINT })
}

/// How many runs have a number, where some have none.
fn list_missing_values<'a>(
    found: &Sweep,
    all: impl Iterator<Item = (&'a String, &'a String, &'a SweptValues)>,
) -> Vec<String> {
    let fewer = all.filter(|(_, _, values)| values.count < values.runs);
    let sentences = fewer.map(|(name, variant, SweptValues { runs, invalid_runs: ended, count, .. })| {
        let variant = if several(found) { format!(" ({variant})") } else { String::new() };
        let why = match (*ended, runs - count - ended) {
            (0, _) => String::new(),
            (ended, 0) => format!(": {ended} did not complete and are left out"),
            (ended, none) => {
                format!(": {ended} did not complete and are left out, {none} completed without a value")
            }
        };
        format!("{name}{variant}: {count} of {runs} runs have a value{why}.")
    });
    sentences.collect()
}

fn measured(found: &Sweep) -> Body {
    let columns = titles(found, "requirement", &[&COLUMNS[..], &["worst samples", "parameters"]].concat());
    let with = found.requirements.iter().filter(|one| one.measured.count > 0);
    let rows = with.map(|one| {
        let mut cells = numbers(&one.measured, &one.unit, one.display.as_ref());
        let ends = one.measured.extreme_samples.map(|[least, most]| format!("least {least}, largest {most}"));
        cells.extend(row![ends.unwrap_or_default(), shares(&one.measured)]);
        named_row(found, &one.text, &one.variant, cells)
    });
    let values = found.requirements.iter().map(|one| (&one.text, &one.variant, &one.measured));
    Body::default().table_of(usize::MAX, &columns, rows).list(list_missing_values(found, values))
}

/// `margin -0.12 N m`
fn format_margin(worst: &SweptWorst) -> String {
    match worst.margin {
        Some(margin) => format!("margin {}", shown(margin, DIGITS, &worst.unit, None)),
        None => "its run has no number".into(),
    }
}

fn worst(found: &Sweep, worst: &SweptWorst) -> Body {
    let variant = if several(found) { format!(", variant {}", worst.variant) } else { String::new() };
    let before = worst
        .margin_before_search
        .map_or_else(String::new, |x| format!(", {} before the search", shown(x, DIGITS, &worst.unit, None)));
    let SweptWorst { sample, exploration_samples: explored, .. } = worst;
    let rested = match worst.restarts {
        0 => "the search has not converged yet: more samples may find worse ones".to_string(),
        1 => "the search converged once, and restarted elsewhere".to_string(),
        many => format!("the search converged {many} times, and restarted elsewhere"),
    };
    let hint = format!(
        "Sample {sample}{variant}: {}{before}. {explored} samples filled the space; {rested}. A found case is no proof that there is no worse one.",
        format_margin(worst)
    );
    let rows = worst.values.iter().map(|at| row![&at.parameter, quantity(at.value, 9, &at.unit)]);
    Body::default().table_of(usize::MAX, &["parameter", "#value"], rows).hint(hint)
}

fn rare(found: &Sweep, rare: &SweptRare) -> Body {
    let columns = ["#level", "#samples", "#part below", "#margin", "#correlation", "#taken"];
    let rows = rare.levels.iter().enumerate().map(|(k, level)| {
        row![
            (k + 1).to_string(),
            level.samples.to_string(),
            percent(level.fraction),
            shown(level.margin, DIGITS, &rare.unit, None),
            figure(level.correlation, 2),
            level.acceptance_rate.map_or_else(String::new, percent)
        ]
    });
    let mut hint = format!("It ended as {}.", rare.stop_reason);
    if several(found) {
        hint += &format!(" A sample fails where any of its variants does: {}.", rare.variant);
    }
    if let (Some(deviation), Some(most)) = (rare.deviation, rare.deviation_upper_bound) {
        hint += &format!(
            " Standard deviation: {} of the probability by the correlations in the chains, with independent levels; at most {} if the levels depend on each other.",
            percent(deviation),
            percent(most)
        );
    }
    Body::default().table_of(usize::MAX, &columns, rows).hint(hint)
}

/// All numbers with their names and variants.
fn numbers_of(found: &Sweep) -> impl Iterator<Item = (&String, &String, &SweptValues, &str)> {
    let figures = found.figures.iter().map(|one| (&one.name, &one.variant, &one.values, one.unit.as_str()));
    figures.chain(found.requirements.iter().map(|one| (&one.text, &one.variant, &one.measured, one.unit.as_str())))
}

fn indices(found: &Sweep) -> Body {
    let columns = titles(found, "number", &["parameter", "#alone", "#95 % interval", "#in all", "#95 % interval "]);
    let rows = numbers_of(found).flat_map(|(name, variant, values, _)| {
        values.indices.iter().map(move |one| {
            let interval = |[low, high]: [f64; 2]| format!("{} to {}", figure(low, 3), figure(high, 3));
            let cells = row![
                &one.parameter,
                figure(one.first, 3),
                interval(one.first_interval),
                figure(one.total, 3),
                interval(one.total_interval)
            ];
            named_row(found, name, variant, cells)
        })
    });
    let hint = "Parts of the variance: what a parameter explains alone, and what would remain if all others were known. Their difference is its interaction with others.";
    let none = numbers_of(found).all(|(_, _, values, _)| values.indices.is_empty());
    Body::default().table_of(usize::MAX, &columns, rows).hint(if none { "" } else { hint })
}

fn effects(found: &Sweep) -> Body {
    let columns = titles(found, "number", &["parameter", "#size", "#its error", "#mean", "#deviation"]);
    let rows = numbers_of(found).flat_map(|(name, variant, values, unit)| {
        values.effects.iter().map(move |one| {
            let cell = |x: Option<f64>| x.map_or_else(String::new, |x| shown(x, DIGITS, unit, None));
            let [size, size_error, mean, deviation] =
                [Some(one.size), one.size_error, Some(one.mean), one.deviation].map(cell);
            named_row(found, name, variant, row![&one.parameter, size, size_error, mean, deviation])
        })
    });
    let hint = "Change of the number with one parameter alone, over all of its probability (Morris): size μ*, mean \
                μ, deviation σ. A deviation near the size shows nonlinearity or interaction with others.";
    let none = numbers_of(found).all(|(_, _, values, _)| values.effects.is_empty());
    Body::default().table_of(usize::MAX, &columns, rows).hint(if none { "" } else { hint })
}

fn failures(found: &Sweep) -> Body {
    let columns = titles(found, "why", &["#runs", "#first sample"]);
    let rows = found.failures.iter().map(|one| {
        let example = if one.example == one.reason { String::new() } else { format!("; the first: {}", one.example) };
        let cells = row![one.count.to_string(), one.first.to_string()];
        named_row(found, format!("{}{example}", one.reason), &one.variant, cells)
    });
    Body::default().table_of(usize::MAX, &columns, rows)
}

fn varied(found: &Sweep) -> Body {
    let rows = found.varied.iter().map(|one| row![&one.name, &one.distribution]);
    let how = match found.points.as_str() {
        "random" => "random draws",
        "sobol" => "Sobol's sequence",
        "halton" => "Halton's sequence",
        "corners" => "all corners",
        "grid" => "all points of a grid",
        "saltelli" => "pairs of Sobol's sequence, with one parameter after another exchanged",
        "morris" => "paths of Morris",
        "worst" => "a search for the worst case",
        "rare" => "subset simulation",
        _ => "a Latin hypercube",
    };
    let hint = match found.points.as_str() {
        "corners" | "grid" => format!("{} samples: {how}.", found.samples),
        _ if found.stopping_rule.is_some() => format!(
            "{} of at most {} samples by {how}, seed {}: each follows from the seed and its number alone.",
            found.stopping_rule.as_ref().map_or(0, |until| until.samples),
            found.samples,
            found.seed
        ),
        "worst" | "rare" => format!("{} samples at most by {how}, seed {}.", found.samples, found.seed),
        _ => format!(
            "{} samples by {how}, seed {}: each follows from the seed and its number alone.",
            found.samples, found.seed
        ),
    };
    Body::default().table_of(usize::MAX, &["parameter", "distribution"], rows).hint(hint)
}

#[cfg(test)]
#[path = "../../tests/unit/present/sweep.rs"]
mod tests;
