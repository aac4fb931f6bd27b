//! What was found, in words and numbers.

use super::asked::Asked;
use super::plant::{Columns, Plant};
use crate::assemble::CoefficientKind as Kind;
use crate::identify::{Coefficient, Extra, Fit, Loss, Samples, Shape, TestKind, residual_tests};
use crate::num::{Definiteness, Matrix, Rational, definiteness, dot, rational_from_f64, rational_to_f64};
use crate::reduce::linearise;
use crate::results::{
    Correlation, FileValue, FrictionCurve, FrictionPoint, Identification, IdentifiedDamping, IdentifiedParameter,
    Interval, NotDetermined, ResidualTest, Trace, TracePoint, Validation,
};

pub(super) struct Fitted<'a> {
    pub plant: &'a Plant,
    pub asked: &'a Asked,
    pub columns: &'a Columns,
    /// The samples of the fit.
    pub samples: &'a Samples,
    pub fit: &'a Fit,
    /// Predictions without having seen, sample by sample, row by row.
    pub unseen: Option<&'a [f64]>,
    pub method: &'a str,
    pub window: f64,
    /// Standard deviations of a window's angles, speeds and accelerations.
    pub noise: &'a [Vec<f64>; 3],
}

/// Parameters that hardly differ from a combination of others.
const CORRELATED: f64 = 0.99;
/// Probability below which a test speaks.
const UNLIKELY: f64 = 0.01;
/// Points of a picture.
const POINTS: usize = 2000;
/// Part of a variance that noise may make up before it is said.
const NOISE: f64 = 0.01;

pub(super) fn summary(fitted: &Fitted<'_>) -> Identification {
    let Fitted { plant, asked, columns, samples, fit, method, window, .. } = fitted;
    let inputs = &plant.reduced.equations.inputs;
    let names = |of: &dyn Fn(usize) -> bool| {
        (0..inputs.len()).filter(|&k| of(k)).map(|k| inputs[k].element.clone()).collect::<Vec<_>>()
    };
    let coordinates = plant.reduced.coordinate_names();
    let parameters = parameters(fitted);
    let mut out = Identification {
        model: plant.model.name.clone(),
        description: plant.model.description.clone(),
        method: (*method).to_string(),
        window: *window,
        measured: names(&|k| plant.torques[k].is_some()),
        eliminated: names(&|k| plant.unmeasured.contains(&k)),
        samples: samples.len(),
        confidence: asked.confidence,
        loss: match asked.loss {
            Loss::Squares => "squares",
            Loss::Huber => "huber",
            Loss::Bisquare => "bisquare",
        }
        .into(),
        outliers: fit.weights.iter().filter(|weight| **weight < 0.1).count(),
        not_determined: NotDetermined {
            by_structure: columns.structural.iter().map(|row| free_combination(row, columns)).collect(),
            by_data: weak(fitted, &parameters),
        },
        correlation: Correlation { names: column_names(fitted), values: fit.correlation.to_rows() },
        condition: fit.condition,
        scale: fit.scale,
        freedom: fit.freedom,
        lags: fit.lags,
        damping: damping(fitted, &parameters),
        tests: tests(fitted),
        validation: validation(fitted),
        curves: curves(fitted),
        traces: traces(fitted),
        coordinates,
        parameters,
        ..Identification::default()
    };
    (out.for_file, out.not_for_file) = for_file(fitted, &out.parameters);
    out.warnings = warnings(fitted, &out);
    if fit.lags > 0 {
        out.notes.push(format!(
            "what is left of one window tells of the next: standard errors take {} of them as correlated (Newey, West)",
            fit.lags
        ));
    }
    if !asked.published.is_empty() && !asked.source.is_empty() {
        out.notes.push(format!("published values: {}", asked.source));
    }
    out
}

/// Names of the columns of the fit, then of the Stribeck speeds.
fn column_names(fitted: &Fitted<'_>) -> Vec<String> {
    let kept = fitted.columns.kept.iter().map(|(k, _)| fitted.columns.asked[*k].name.clone());
    let extras = fitted.asked.extras.iter().map(|extra| extra.name.clone());
    let speeds = fitted.asked.extras.iter().filter(|extra| extra.shape.is_some());
    kept.chain(extras).chain(speeds.map(|extra| format!("{}.stribeck_speed", extra.element))).collect()
}

/// `a.inertia up by 1 and b.inertia down by 9`
fn free_combination(row: &[Rational], columns: &Columns) -> String {
    let parts: Vec<(f64, &str)> = row
        .iter()
        .zip(&columns.asked)
        .filter(|(x, _)| **x != Rational::ZERO)
        .map(|(x, one)| (rational_to_f64(x), one.name.as_str()))
        .collect();
    if let [(_, name)] = parts.as_slice() {
        return format!("{name}: it does not enter the torques of this kind of test");
    }
    let last = parts.last().map_or(1.0, |(x, _)| *x);
    let word = |(x, name): &(f64, &str)| {
        let x = x / last;
        format!("{name} {} by {}", if x > 0.0 { "up" } else { "down" }, short(x.abs()))
    };
    let mut words: Vec<String> = parts.iter().rev().map(word).collect();
    let first = words.remove(0);
    format!("{first} and {} give the same torques", words.join(", "))
}

/// Six digits at most.
pub(super) fn short(x: f64) -> String {
    let text = format!("{x:.6}");
    if x != 0.0 && (x.abs() < 1e-3 || x.abs() >= 1e6) {
        return format!("{x:.4e}");
    }
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

fn parameters(fitted: &Fitted<'_>) -> Vec<IdentifiedParameter> {
    let Fitted { asked, columns, fit, .. } = fitted;
    let published = |name: &str| asked.published.iter().find(|(other, _)| other == name).map(|(_, value)| *value);
    let mut out: Vec<IdentifiedParameter> = Vec::new();
    let undetermined = |column: usize| fit.standard_errors[column].is_infinite();
    let found = |name: String, unit: &'static str, column: usize, before: Option<f64>| {
        let (value, error) = (fit.values[column], fit.standard_errors[column]);
        let bounded = fit.bounded.contains(&column);
        let half = fit.quantile(column, asked.confidence) * error;
        let hidden = !bounded && !undetermined(column) && half.is_nan();
        IdentifiedParameter {
            interval: (!bounded && !undetermined(column) && half.is_finite())
                .then_some(Interval { lower: value - half, upper: value + half }),
            remark: match (bounded, undetermined(column)) {
                (true, _) => "at its bound, zero".into(),
                (_, true) => "these data do not determine it".into(),
                _ if hidden => "no interval: the fit leaves nothing that could tell how large the errors are".into(),
                _ => String::new(),
            },
            published: published(&name),
            standard_error: (!bounded && !error.is_nan()).then_some(error),
            name,
            unit,
            before,
            value: Some(value),
            combination: String::new(),
        }
    };
    for (k, one) in columns.asked.iter().enumerate() {
        let before = asked.wanted[k].before;
        let unit = one.kind.unit();
        match columns.kept.iter().position(|(kept, _)| *kept == k) {
            Some(column) => {
                let mut found = found(one.name.clone(), unit, column, before);
                let with = &columns.kept[column].1;
                found.combination = with
                    .iter()
                    .map(|(other, factor)| {
                        let sign = if *factor < 0.0 { "-" } else { "+" };
                        format!(" {sign} {} {}", short(factor.abs()), columns.asked[*other].name)
                    })
                    .collect();
                if !with.is_empty() {
                    found.remark = "only this combination can be told".into();
                }
                out.push(found);
            }
            None => out.push(IdentifiedParameter {
                name: one.name.clone(),
                unit,
                before,
                value: before,
                standard_error: Some(f64::INFINITY),
                remark: "not determined by a test of this kind, whatever is logged".into(),
                published: published(&one.name),
                ..IdentifiedParameter::default()
            }),
        }
    }
    let first = columns.kept.len();
    let mut speed = first + asked.extras.len();
    for (k, extra) in asked.extras.iter().enumerate() {
        let unit = if extra.shape.is_some() { "N m" } else { "1" };
        out.push(found(extra.name.clone(), unit, first + k, None));
        if extra.shape.is_some() {
            let name = format!("{}.stribeck_speed", extra.element);
            let mut found = found(name, "rad/s", speed, None);
            if extra.speed.is_some() {
                found.remark = "given".into();
                found.interval = None;
            } else if fit.at_end.contains(&k) {
                found.remark = "at the end of the speeds measured: these data do not determine it".into();
                found.interval = None;
                found.standard_error = Some(f64::INFINITY);
            }
            out.push(found);
            speed += 1;
        }
    }
    out
}

/// What a model file can hold of what was found, and what not. Stribeck friction goes there as the torque at which it breaks away.
fn for_file(fitted: &Fitted<'_>, parameters: &[IdentifiedParameter]) -> (Vec<FileValue>, Vec<String>) {
    let Fitted { asked, columns, .. } = fitted;
    let (mut values, mut left) = (Vec::new(), Vec::new());
    let told = |one: &IdentifiedParameter| one.value.filter(|_| one.combination.is_empty() && one.interval.is_some());
    let plain = parameters.iter().take(columns.asked.len());
    for one in plain {
        if let Some(value) = told(one) {
            values.push(FileValue { name: one.name.clone(), value, interval: one.interval });
        } else if one.value == Some(0.0) && one.standard_error.is_none() {
            // At its bound: all others were fitted with it at zero.
            values.push(FileValue { name: one.name.clone(), value: 0.0, interval: None });
        } else {
            left.push(format!("{}: {}", one.name, one.remark));
        }
    }
    for extra in &asked.extras {
        let named = |name: &str| parameters.iter().find(|one| one.name == name);
        let Some(own) = named(&extra.name) else { continue };
        let speed = named(&format!("{}.stribeck_speed", extra.element));
        let friction = format!("{}.friction", extra.element);
        let own_friction = |key: &(String, Kind)| key.0 == extra.element && key.1 == Kind::Friction;
        let with = asked.wanted.iter().position(|one| one.keys.iter().any(own_friction));
        let sliding = match with {
            Some(k) => parameters.get(k).and_then(told),
            None => fitted
                .plant
                .reduced
                .equations
                .frictions
                .iter()
                .find(|term| term.element == extra.element)
                .map(|term| term.value.torque.to_f64()),
        };
        let speed = speed.filter(|one| told(one).is_some() || extra.speed.is_some());
        let speed = speed.and_then(|one| Some((one.value?, told(one).and(one.interval))));
        let both = told(own).filter(|own| *own > 0.0).zip(sliding);
        match (extra.shape, speed, both) {
            (None, ..) => left.push(format!("{}: a model file has no loss in proportion to a torque", extra.name)),
            (Some(Shape::Gaussian), Some((speed, interval)), Some((own, sliding))) => {
                let value = |name: &str, value: f64, interval| FileValue {
                    name: format!("{}.{name}", extra.element),
                    value,
                    interval,
                };
                values.push(value("breakaway", sliding + own, None));
                values.push(value("stribeck_speed", speed, interval));
            }
            (Some(Shape::Gaussian), ..) => {
                left.push(format!("{}: it is not told well enough, or {friction} is not", extra.name));
            }
            (Some(_), ..) => left.push(format!("{}: a model file has the gaussian shape only", extra.name)),
        }
    }
    (values, left)
}

/// What these data hardly tell.
fn weak(fitted: &Fitted<'_>, parameters: &[IdentifiedParameter]) -> Vec<String> {
    let Fitted { fit, columns, .. } = fitted;
    let names = column_names(fitted);
    let mut out = Vec::new();
    for row in &fit.undetermined {
        // The combination in parts of its largest entry, by the size of each column.
        let largest = row.iter().fold(0.0_f64, |max, x| max.max(x.abs()));
        let parts: Vec<String> = row
            .iter()
            .zip(&names)
            .filter(|(x, _)| x.abs() > 1e-6 * largest)
            .map(|(x, name)| format!("{} {name}", short(x / largest)))
            .collect();
        out.push(match parts.as_slice() {
            [_] => format!(
                "{}: what it acts on never moved in the logs",
                names[row.iter().position(|x| x.abs() > 1e-6 * largest).unwrap_or(0)]
            ),
            _ => format!("in these logs {} are always seen together", parts.join(" : ")),
        });
    }
    let count = columns.kept.len() + fitted.asked.extras.len();
    for i in 0..count {
        for j in 0..i {
            let correlation = fit.correlation[(i, j)];
            if correlation.abs() > CORRELATED {
                out.push(format!(
                    "{} and {} are hardly told apart: the correlation of their errors is {correlation:.4}",
                    names[j], names[i]
                ));
            }
        }
    }
    for one in parameters.iter().filter(|one| one.interval.is_some_and(|it| it.lower <= 0.0 && it.upper >= 0.0)) {
        out.push(format!("{} cannot be told from zero", one.name));
    }
    out
}

/// Kᵀ D K at what was found, where dampings were asked for.
fn damping(fitted: &Fitted<'_>, parameters: &[IdentifiedParameter]) -> Option<IdentifiedDamping> {
    let Fitted { plant, columns, .. } = fitted;
    let asked = || columns.asked.iter().filter(|one| one.kind == Kind::Damping);
    let told = |one: &Coefficient| {
        parameters
            .iter()
            .any(|found| found.name == one.name && (found.interval.is_some() || found.standard_error.is_none()))
    };
    if asked().next().is_none() || !asked().all(told) {
        return None;
    }
    let reduced = &plant.reduced;
    let linear = linearise(reduced, &vec![0.0; reduced.degrees_of_freedom()]);
    let r = reduced.degrees_of_freedom();
    let mut sum = Matrix::<Rational>::zeros(r, r);
    for (number, term) in reduced.equations.dampers.iter().enumerate() {
        let asked = columns.asked.iter().position(|one| one.kind == Kind::Damping && one.terms.contains(&number));
        let value = match asked {
            Some(k) => rational_from_f64(written(&columns.asked[k].name, parameters, fitted)?)?,
            None => term.value.to_rational(),
        };
        let g: Vec<Rational> = (0..r)
            .map(|j| {
                term.row.iter().fold(Rational::ZERO, |sum, (s, a)| sum + a.clone() * linear.basis[(*s, j)].clone())
            })
            .collect();
        for i in 0..r {
            for j in 0..r {
                sum[(i, j)] = sum[(i, j)].clone() + value.clone() * g[i].clone() * g[j].clone();
            }
        }
    }
    let passive = !matches!(definiteness(&sum), Definiteness::Indefinite { .. });
    Some(IdentifiedDamping { coordinates: reduced.coordinate_names(), values: sum.to_rows(), passive })
}

/// The value of a parameter with the others of its combination as the file gives them.
fn written(name: &str, parameters: &[IdentifiedParameter], fitted: &Fitted<'_>) -> Option<f64> {
    let found = parameters.iter().find(|one| one.name == name)?;
    let columns = fitted.columns;
    let number = columns.asked.iter().position(|one| one.name == name)?;
    let with = columns.kept.iter().find(|(kept, _)| *kept == number).map_or(&[][..], |(_, with)| with);
    let others: f64 =
        with.iter().map(|(other, factor)| factor * fitted.asked.wanted[*other].before.unwrap_or(0.0)).sum();
    let value = found.value? - others;
    value.is_finite().then_some(value)
}

/// Names of the rows of the balance.
fn row_names(fitted: &Fitted<'_>) -> Vec<String> {
    let names = fitted.plant.reduced.coordinate_names();
    if fitted.samples.rows == names.len() {
        return names;
    }
    (0..fitted.samples.rows).map(|k| format!("row {}, without the torques not measured", k + 1)).collect()
}

fn tests(fitted: &Fitted<'_>) -> Vec<ResidualTest> {
    let chosen: Vec<usize> = (0..fitted.samples.len()).collect();
    let (rows, coordinates) = (row_names(fitted), fitted.plant.reduced.coordinate_names());
    let told = |kind: TestKind| {
        match kind {
        TestKind::Mean(row) => (
            format!("mean zero: {}", rows[row]),
            "a constant torque is left over: an offset of a torque sensor, or friction that differs with the sense".into(),
        ),
        TestKind::Serial => (
            "independent in time".into(),
            "something slow is missing in the model, or friction changes with time or angle; standard errors allow for it \
             where windows are fitted"
                .into(),
        ),
        TestKind::Normal => (
            "normal".to_string(),
            "outliers, or something missing; try the loss huber".to_string(),
        ),
        TestKind::Speed(k) => (
            format!("no dependence on {}.w", coordinates[k]),
            "friction is no straight line over the speed: try the extra term stribeck, or load".into(),
        ),
    }
    };
    residual_tests(fitted.samples, &chosen, fitted.fit)
        .into_iter()
        .map(|test| {
            let (what, meaning) = told(test.what);
            let meaning = if test.probability < UNLIKELY { meaning } else { String::new() };
            ResidualTest { what, probability: test.probability, meaning }
        })
        .collect()
}

fn validation(fitted: &Fitted<'_>) -> Vec<Validation> {
    let Fitted { samples, fit, unseen, .. } = fitted;
    let (n, r) = (samples.len(), samples.rows);
    let rms = |of: &dyn Fn(usize, usize) -> f64, row: usize| {
        ((0..n).map(|k| of(k, row).powi(2)).sum::<f64>() / n.max(1) as f64).sqrt()
    };
    row_names(fitted)
        .into_iter()
        .enumerate()
        .map(|(row, name)| Validation {
            row: name,
            torque: rms(&|k, row| samples.y(k)[row], row),
            seen: rms(&|k, row| samples.y(k)[row] - fit.prediction(samples, k, row), row),
            unseen: unseen.map(|unseen| rms(&|k, row| samples.y(k)[row] - unseen[k * r + row], row)),
        })
        .collect()
}

/// Every so many of a list that it stays short.
fn stride(count: usize) -> usize {
    count.div_ceil(POINTS).max(1)
}

fn traces(fitted: &Fitted<'_>) -> Vec<Trace> {
    let Fitted { samples, fit, unseen, .. } = fitted;
    let step = stride(samples.len());
    let point = |k: usize, row: usize| {
        let place = samples.places[k];
        let predicted = unseen.map_or_else(|| fit.prediction(samples, k, row), |unseen| unseen[k * samples.rows + row]);
        TracePoint { log: place.log, time: place.time, measured: samples.y(k)[row], predicted }
    };
    row_names(fitted)
        .into_iter()
        .enumerate()
        .map(|(row, name)| Trace {
            row: name,
            points: (0..samples.len()).step_by(step).map(|k| point(k, row)).collect(),
        })
        .collect()
}

/// For each friction asked for: what is measured along it less all other terms, over its speed.
fn curves(fitted: &Fitted<'_>) -> Vec<FrictionCurve> {
    let Fitted { plant, asked, columns, samples, fit, .. } = fitted;
    let reduced = &plant.reduced;
    let r = reduced.degrees_of_freedom();
    // Rows are those of the coordinates only where nothing was eliminated.
    if samples.rows != r {
        return Vec::new();
    }
    let basis = linearise(reduced, &vec![0.0; r]).basis;
    let mut elements: Vec<&str> = Vec::new();
    for one in asked.wanted.iter().flat_map(|one| &one.keys).filter(|(_, kind)| matches!(kind, Kind::Friction)) {
        if !elements.contains(&one.0.as_str()) {
            elements.push(&one.0);
        }
    }
    elements.extend(
        asked
            .extras
            .iter()
            .map(|extra| extra.element.as_str())
            .filter(|name| !elements.contains(name))
            .collect::<Vec<_>>(),
    );
    let mut out = Vec::new();
    for element in elements {
        let Some(term) = reduced.equations.frictions.iter().find(|term| term.element == element) else { continue };
        let g: Vec<f64> = (0..r)
            .map(|j| term.row.iter().map(|(s, a)| rational_to_f64(a) * rational_to_f64(&basis[(*s, j)])).sum())
            .collect();
        let Some(row) = (0..r).max_by(|&a, &b| g[a].abs().total_cmp(&g[b].abs())).filter(|&row| g[row] != 0.0) else {
            continue;
        };
        let own = |name: &str| name.rsplit_once('.').is_some_and(|(head, _)| head == element);
        let mut mine = vec![false; samples.columns];
        for (column, (k, _)) in columns.kept.iter().enumerate() {
            let one = &asked.wanted[*k];
            mine[column] =
                one.keys.iter().any(|(e, kind)| e == element && matches!(kind, Kind::Damping | Kind::Friction))
                    && (own(&one.name) || one.parameter);
        }
        let first = columns.kept.len();
        for (k, extra) in asked.extras.iter().enumerate() {
            mine[first + k] = extra.element == element && matches!(columns.extras[k], Extra::Stribeck { .. });
        }
        let mut values = fit.values.clone();
        let mut own_fit = (*fit).clone();
        values.iter_mut().take(samples.columns).zip(&mine).for_each(|(value, mine)| {
            if !mine {
                *value = 0.0;
            }
        });
        own_fit.values = values;
        let mut points = Vec::new();
        let mut line = Vec::new();
        for k in (0..samples.len()).step_by(stride(samples.len())) {
            let speed = dot(&g, samples.motion(k, 1));
            let model = own_fit.prediction(samples, k, row) / g[row];
            let left = (samples.y(k)[row] - fit.prediction(samples, k, row)) / g[row];
            points.push(FrictionPoint { speed, torque: model + left });
            line.push(FrictionPoint { speed, torque: model });
        }
        line.sort_by(|a, b| a.speed.total_cmp(&b.speed));
        out.push(FrictionCurve { element: element.to_string(), points, line });
    }
    out
}

/// Parameters whose signal is noise of the sensors for a good part: errors in what they are multiplied with make them too small.
fn drowned(fitted: &Fitted<'_>) -> Vec<String> {
    let Fitted { plant, columns, samples, noise, .. } = fitted;
    let equations = &plant.reduced.equations;
    let r = plant.reduced.degrees_of_freedom();
    let basis = linearise(&plant.reduced, &vec![0.0; r]).basis;
    let windows = samples.windows.iter().sum::<usize>() as f64 / samples.len().max(1) as f64;
    let mut out = Vec::new();
    for (k, _) in &columns.kept {
        let one = &columns.asked[*k];
        let Some(&term) = one.terms.first() else { continue };
        let (row, part, what) = match one.kind {
            Kind::Inertia => (&equations.inertias[term].row, 2, "acceleration"),
            Kind::Damping => (&equations.dampers[term].row, 1, "speed"),
            Kind::Stiffness => (&equations.springs[term].row, 0, "twist"),
            Kind::Friction => continue,
        };
        let along = |j: usize| row.iter().map(|(s, a)| rational_to_f64(a) * rational_to_f64(&basis[(*s, j)])).sum();
        let g: Vec<f64> = (0..r).map(along).collect();
        let square = (0..samples.len()).map(|s| dot(&g, samples.motion(s, part)).powi(2)).sum::<f64>();
        let variance: f64 = g.iter().zip(&noise[part]).map(|(g, sigma)| (g * sigma).powi(2)).sum();
        let share = variance / windows / (square / samples.len().max(1) as f64);
        if share > NOISE {
            out.push(format!(
                "{:.0} % of the square of the {what} that {} acts on is noise of the sensors, which makes it come out too small by \
                 about that: use a wider window, or move more",
                100.0 * share.min(1.0),
                one.name
            ));
        }
    }
    out
}

fn warnings(fitted: &Fitted<'_>, out: &Identification) -> Vec<String> {
    let Fitted { asked, .. } = fitted;
    let mut warnings = drowned(fitted);
    if let Some(IdentifiedDamping { passive: false, .. }) = &out.damping {
        warnings.push(
            "the damping found is not passive: some motion would gain energy from it; a single equivalent damping may be \
             negative, the reduced matrix may not. Look at the intervals, or ask for fewer parameters"
                .into(),
        );
    }
    for one in out.parameters.iter().filter(|one| one.interval.is_some_and(|it| it.upper < 0.0)) {
        let kind = asked.wanted.iter().find(|wanted| wanted.name == one.name).map(|wanted| wanted.keys[0].1);
        if matches!(kind, Some(Kind::Friction | Kind::Inertia | Kind::Stiffness)) {
            warnings.push(format!(
                "{} is below zero, which no {} can be: check the signs of torques and speeds (`factor = -1`), or set `nonnegative`",
                one.name,
                one.name.rsplit('.').next().unwrap_or("such parameter")
            ));
        }
    }
    warnings
}
