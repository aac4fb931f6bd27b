//! Alternatives to the design of the file, and the loop over a box of plants.

use crate::model::{Body, row};
use crate::pareto::pareto;
use crate::phrases;
use crate::text::number;
use kardan_results::{
    Alternative, BoxMargin, Exploration, Interaction, Interval, Robustness, Spread, VariedParameter, WithSensor,
};

/// More designs are counted where space is limited.
const DESIGNS: usize = 40;

/// The alternatives to the design of the file.
pub(super) fn exploration(found: &Exploration) -> Body {
    let mut best: Vec<&Alternative> = found.designs.iter().filter(|one| one.best).collect();
    best.retain(|one| one.bandwidth == 1.0);
    best.sort_by(|a, b| b.sample_time.total_cmp(&a.sample_time).then(a.torque.total_cmp(&b.torque)));
    let torque = |x: f64| {
        if found.relative_to_limits { format!("{} %", number(100.0 * x)) } else { format!("{} N m", number(x)) }
    };
    let designs = best.iter().map(|one| {
        row![
            format!("{} Hz", number(1.0 / one.sample_time)),
            format!("× {}", number(one.bandwidth)),
            format!("× {}", number(one.effort)),
            &one.sensors,
            one.interaction,
            torque(one.torque),
            torque(one.noise),
            one.spectral_radius,
        ]
    });
    let headers = ["rate", "bandwidth", "effort", "sensors", "#interaction", "#torque", "#noise", "#spectral radius"];
    let sensors = found.sensors.iter().map(|WithSensor { name, design }| {
        row![name, design.interaction, torque(design.noise), design.spectral_radius]
    });
    Body::default()
        .list(found_designs(found))
        .pictures(pareto(found))
        .part(
            "Designs with the bandwidth of the file; no design at the same or a lower rate is better in both interaction and torque",
            Body::default().table_of(DESIGNS, &headers, designs),
        )
        .part(
            "Designs with one more sensor, the best first",
            Body::default().table(&["sensor", "#interaction", "#noise", "#spectral radius"], sensors),
        )
}

/// The number of designs found, and how to read them.
fn found_designs(found: &Exploration) -> Vec<String> {
    let mut out = vec![format!(
        "{} designs were found, {} combinations have no stable one{}. Interaction: {}, in {}. Torque and noise are {}.",
        found.designs.len(),
        found.failed,
        match found.not_evaluated {
            0 => String::new(),
            count => format!(", {count} are not assessed, as their sample times have no short common period"),
        },
        found.interaction,
        found.unit,
        if found.relative_to_limits { "parts of the motors' limits" } else { "in N m, as no motor has a limit" }
    )];
    out.extend(found.advice.iter().cloned());
    out
}

/// The loop over a box of plants.
pub(super) fn robustness(found: &Robustness) -> Body {
    let size = |x: f64| if x.is_finite() { number(x) } else { "unstable".into() };
    let row = |one: &Interaction| {
        let step = format!("{} by {} {}", one.reference, number(one.step), one.step_unit);
        let Spread { nominal, median, q90, q99, sampled, worst, .. } = one.size;
        let mut row = row![step, &one.signal];
        row.extend([nominal, median, q90, q99, sampled, worst].map(|x| size(x).into()));
        row.push(one.unit.as_str().into());
        row
    };
    let table = |what: &str, all: &[Interaction]| {
        let headers = ["step of", what, "#nominal", "#median", "#90 %", "#99 %", "#largest", "#worst corner", "unit"];
        Body::default().table(&headers, all.iter().map(row))
    };
    Body::default()
        .list(stability(found))
        .part("Coupling of a step into other channels", table("signal", &found.interactions))
        .part("Motor torques after a step", table("motor", &found.peaks))
        .part("Stability margins of one motor", margins(found))
}

/// The least margins over some plants of the box.
fn margins(found: &Robustness) -> Body {
    let Some(first) = found.margins.first() else { return Body::default() };
    let row = |one: &BoxMargin| {
        let [low, high] = phrases::factors(one.gain, |_, factor| number(factor));
        let phase = if one.phase.is_finite() { format!("{}°", number(one.phase.to_degrees())) } else { "any".into() };
        row![&one.motor, format!("{low} to {high}"), phase, one.disk, one.nominal]
    };
    let unstable = match first.unstable {
        0 => String::new(),
        count => format!(" {count} more are not stable or could not be computed."),
    };
    let headers = ["torque of", "factor", "phase", "#least disk margin", "#nominal disk margin"];
    Body::default().table(&headers, found.margins.iter().map(row)).hint(format!(
        "Minimum over {} plants: the worst corners found and some of the samples. Other plants of the box may have less.{unstable}",
        first.plants
    ))
}

/// Stability over the box of plants, and the worst case.
fn stability(found: &Robustness) -> Vec<String> {
    let varied = found
        .parameters
        .iter()
        .filter(|VariedParameter { name: _, factors: Interval { lower: low, upper: high } }| low != high)
        .count();
    let mut out = vec![
        format!("{} coefficients vary: {}.", varied, found.range),
        format!(
            "{} of {} plants, drawn with the seed {}, are stable; {}.",
            found.stable,
            found.samples,
            found.seed,
            if found.worst_stable {
                "so is the worst corner that a search found"
            } else {
                "a corner of the box is not, or not known to be"
            }
        ),
    ];
    let radius = &found.spectral_radius;
    out.push(format!(
        "Spectral radius {} with the nominal plant, at most {} in the samples, {} in the worst corner.",
        number(radius.nominal),
        number(radius.sampled),
        number(radius.worst)
    ));
    if let Some(worst) = found.interactions.iter().max_by(|a, b| a.size.worst.total_cmp(&b.size.worst)) {
        let end = |(one, factor): (&VariedParameter, &f64)| {
            (one.factors.lower != one.factors.upper).then(|| format!("{} {}", one.name, number(*factor)))
        };
        let at: Vec<String> = found.parameters.iter().zip(&worst.size.at).filter_map(end).collect();
        out.push(format!("Worst for {} after {}, as factors: {}.", worst.signal, worst.reference, at.join(", ")));
    }
    out
}
