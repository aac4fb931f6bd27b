//! Points of the pictures: torques over time, frictions over speed.

use super::extra::Law;
use super::fitted::Fitted;
use super::plant::in_coordinates;
use kardan_math::num::dot;
use kardan_mechanics::assemble::CoefficientKind as Kind;
use kardan_results::signal_name;
use kardan_results::{FrictionCurve, FrictionPoint, Trace, TracePoint};

/// Points of a picture.
const POINTS: usize = 2000;

/// A subset of a list at a constant step, of limited length.
fn picture_step(count: usize) -> usize {
    count.div_ceil(POINTS).max(1)
}

/// Measured and predicted torques.
pub(super) fn traces(fitted: &Fitted<'_>) -> Vec<Trace> {
    let Fitted { samples, fit, cross_validated, .. } = fitted;
    let step = picture_step(samples.len());
    let point = |k: usize, row: usize| {
        let place = samples.places[k];
        let predicted = cross_validated
            .map_or_else(|| fit.prediction(samples, k, row), |cross_validated| cross_validated[k * samples.rows + row]);
        TracePoint { log: place.log, time: place.time, measured: samples.y(k)[row], predicted }
    };
    let trace = |(row, name, unit): (usize, String, String)| Trace {
        row: name,
        unit,
        points: (0..samples.len()).step_by(step).map(|k| point(k, row)).collect(),
    };
    fitted.rows().map(trace).collect()
}

/// For each requested friction: the measured torque along it less all other terms, over its speed.
pub(super) fn curves(fitted: &Fitted<'_>) -> Vec<FrictionCurve> {
    let Fitted { plant, request, samples, .. } = fitted;
    // Rows are those of the coordinates only without eliminated torques.
    if samples.rows != plant.reduced.degrees_of_freedom() {
        return Vec::new();
    }
    let basis = plant.basis();
    let keys = request.unknowns.iter().flat_map(|one| &one.keys).filter(|(_, kind)| *kind == Kind::Friction);
    let all = keys.map(|(element, _)| element).chain(request.extras.iter().map(|extra| &extra.element));
    // Terms of an input or a spring have no friction of that name, and no curve.
    let mut elements: Vec<&String> = Vec::new();
    for element in all {
        if !elements.contains(&element) {
            elements.push(element);
        }
    }
    let frictions = &plant.reduced.equations.frictions;
    let curve = |element: &String| {
        let term = frictions.iter().find(|term| term.element == *element)?;
        curve(fitted, element, &in_coordinates(&term.row, &basis))
    };
    elements.into_iter().filter_map(curve).collect()
}

/// The curve of a friction along a direction, in the row of the balance with its largest share.
fn curve(fitted: &Fitted<'_>, element: &str, direction: &[f64]) -> Option<FrictionCurve> {
    let Fitted { request, columns, samples, fit, .. } = fitted;
    let row = (0..direction.len()).max_by(|&a, &b| direction[a].abs().total_cmp(&direction[b].abs()))?;
    let share = direction[row];
    if share == 0.0 {
        return None;
    }
    let losses = |kind: &Kind| matches!(kind, Kind::Damping | Kind::Friction);
    let of_element = |number: usize| {
        let one = &request.unknowns[number];
        one.keys.iter().any(|(candidate, kind)| candidate == element && losses(kind))
            && (one.parameter || signal_name::parameter(&one.name).is_some_and(|(owner, _)| owner == element))
    };
    let identifiable = columns.identifiable.iter().map(|(number, _)| of_element(*number));
    let of_speed = |law: &Law| {
        matches!(law, Law::Stribeck { .. } | Law::FrictionAsymmetry | Law::DampingAsymmetry | Law::Quadratic)
    };
    let own = identifiable.chain(request.extras.iter().map(|one| one.element == element && of_speed(&one.law)));
    let mut own_fit = (*fit).clone();
    for (value, own) in own_fit.values.iter_mut().zip(own) {
        if !own {
            *value = 0.0;
        }
    }
    let (mut points, mut line) = (Vec::new(), Vec::new());
    for k in (0..samples.len()).step_by(picture_step(samples.len())) {
        let speed = dot(direction, samples.motion(k, 1));
        let model = own_fit.prediction(samples, k, row) / share;
        let residual = fitted.residual(k, row) / share;
        points.push(FrictionPoint { speed, torque: model + residual });
        line.push(FrictionPoint { speed, torque: model });
    }
    line.sort_by(|a, b| a.speed.total_cmp(&b.speed));
    let domain = fitted.domain(element);
    let units = [domain.motion()[1].unit(), domain.effort().unit()];
    Some(FrictionCurve { element: element.to_string(), units, points, line })
}
