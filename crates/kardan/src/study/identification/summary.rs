//! The result, as text and numbers.

use kardan_rt::functions::powi;

use super::extra::Law;
use super::fitted::Fitted;
use super::numbers::{rms, short};
use super::parameters::{damping, for_file, parameters};
use super::pictures::{curves, traces};
use super::plant::{Columns, in_coordinates};
use kardan_identify::{Excitation, Loss, TestKind, residual_statistics};
use kardan_math::num::{Rational, dot, rational_to_f64};
use kardan_mechanics::assemble::CoefficientKind as Kind;
use kardan_results::signal_name;
use kardan_results::{
    Correlation, Identification, IdentifiedDamping, IdentifiedParameter, NotDetermined, ResidualTest, Validation,
};

/// Correlation from which two parameters are hard to distinguish.
const CORRELATED: f64 = 0.99;
/// Probability below which a test fails.
pub(super) const UNLIKELY: f64 = 0.01;
/// Permitted residual of a balance without a measured torque, as a fraction of its largest torque and as a multiple of the noise; and the fraction of the torques by
/// the file's coefficients below which its coefficients count as zero.
const OPEN: f64 = 0.05;
const LOUD: f64 = 10.0;
const NOTHING: f64 = 1e-3;
/// Fraction of noise in a variance from which kardan warns.
const NOISE: f64 = 0.01;

pub(super) fn summary(fitted: &Fitted<'_>) -> Identification {
    let Fitted { whole, plant, request, columns, samples, fit, .. } = fitted;
    let inputs = &plant.reduced.equations.inputs;
    let names = |of: &dyn Fn(usize) -> bool| {
        (0..inputs.len()).filter(|&k| of(k)).map(|k| inputs[k].element.clone()).collect::<Vec<_>>()
    };
    let coordinates = plant.reduced.coordinate_names();
    let parameters = parameters(fitted);
    let for_file = for_file(fitted, &parameters);
    let mut out = Identification {
        model: plant.model.name.clone(),
        description: plant.model.description.clone(),
        mechanism: plant.model.mechanism.clone(),
        method: match whole.chosen.method {
            Excitation::Steady => "steady",
            Excitation::Free => "dynamic",
        }
        .into(),
        window: whole.material.window,
        measured: names(&|k| plant.torques[k].is_some()),
        eliminated: names(&|k| plant.unmeasured.contains(&k)),
        samples: samples.len(),
        confidence: request.confidence,
        loss: match request.loss {
            Loss::Squares => "squares",
            Loss::Huber => "huber",
            Loss::Bisquare => "bisquare",
        }
        .into(),
        outliers: fit.weights.iter().filter(|weight| **weight < 0.1).count(),
        unidentifiable: NotDetermined {
            structurally: columns.structural.iter().map(|row| free_combination(row, columns)).collect(),
            practically: weak(fitted, &parameters),
        },
        correlation: Correlation { names: fitted.column_names(), values: fit.correlation.to_rows() },
        condition: fit.condition,
        scale: fit.scale,
        degrees_of_freedom: fit.freedom,
        lags: fit.lags,
        damping: damping(fitted, &parameters),
        tests: tests(fitted),
        validation: validation(fitted),
        curves: curves(fitted),
        traces: traces(fitted),
        coordinates,
        parameters,
        for_file,
        ..Identification::default()
    };
    out.warnings = warnings(fitted, &out);
    if fit.lags > 0 {
        out.notes.push(format!(
            "residuals of successive windows are correlated: standard errors account for {} lags (Newey, West)",
            fit.lags
        ));
    }
    if !request.published.is_empty() && !request.source.is_empty() {
        out.notes.push(format!("published values: {}", request.source));
    }
    out
}

/// `a.inertia up by 1 and b.inertia down by 9`
fn free_combination(row: &[Rational], columns: &Columns) -> String {
    let entering = row.iter().zip(&columns.coefficients).filter(|(x, _)| **x != Rational::ZERO);
    let parts: Vec<(f64, &str)> = entering.map(|(x, one)| (rational_to_f64(x), one.name.as_str())).collect();
    if let [(_, name)] = parts.as_slice() {
        return format!("{name}: it does not enter the torques of this kind of test");
    }
    let last = parts.last().map_or(1.0, |(x, _)| *x);
    let word = |(x, name): &(f64, &str)| {
        let x = x / last;
        format!("{name} {} by {}", if x > 0.0 { "up" } else { "down" }, short(x.abs()))
    };
    let mut terms: Vec<String> = parts.iter().rev().map(word).collect();
    let first = terms.remove(0);
    format!("{first} and {} give the same torques", terms.join(", "))
}

/// Poorly determined parameters.
fn weak(fitted: &Fitted<'_>, parameters: &[IdentifiedParameter]) -> Vec<String> {
    let Fitted { fit, columns, .. } = fitted;
    let names = fitted.column_names();
    let mut out = Vec::new();
    for row in &fit.undetermined {
        // The combination as fractions of its largest entry, scaled by the size of each column.
        let largest = row.iter().fold(0.0_f64, |max, x| max.max(x.abs()));
        let parts: Vec<_> = row.iter().zip(&names).filter(|(x, _)| x.abs() > 1e-6 * largest).collect();
        out.push(match parts.as_slice() {
            [(_, name)] => format!("{name}: what it acts on never moved in the logs"),
            _ => {
                let parts: Vec<String> =
                    parts.iter().map(|(x, name)| format!("{} {name}", short(*x / largest))).collect();
                format!("in these logs {} always occur together", parts.join(" : "))
            }
        });
    }
    let count = columns.identifiable.len() + fitted.request.extras.len();
    for i in 0..count {
        for j in 0..i {
            let correlation = fit.correlation[(i, j)];
            if correlation.abs() > CORRELATED {
                out.push(format!(
                    "{} and {} are hard to distinguish: the correlation of their errors is {correlation:.4}",
                    names[j], names[i]
                ));
            }
        }
    }
    for one in parameters.iter().filter(|one| one.interval.is_some_and(|it| it.lower <= 0.0 && it.upper >= 0.0)) {
        out.push(format!("{} is not distinguishable from zero", one.name));
    }
    out
}

/// The hypothesis of a test.
pub(super) fn test_name(test: TestKind, rows: &[String], speeds: &[String]) -> String {
    match test {
        TestKind::Mean(row) => format!("mean zero: {}", rows[row]),
        TestKind::Serial => "independent in time".into(),
        TestKind::Normal => "normal".into(),
        TestKind::Speed(k) => format!("no dependence on {}", speeds[k]),
    }
}

/// The meaning of a failed test.
fn meaning(test: TestKind, loss: Loss) -> &'static str {
    match test {
        TestKind::Mean(_) => {
            "constant residual torque: an offset of a torque sensor, or friction that depends on the direction; --suggest tries them"
        }
        TestKind::Serial => {
            "the model lacks slow dynamics, or friction changes with time, angle or log; standard errors allow for it where \
             windows are fitted; --suggest tries such terms"
        }
        TestKind::Normal if loss == Loss::Squares => "outliers, or a missing term; try the loss huber",
        TestKind::Normal => "outliers, which the loss weights less, or a missing term",
        TestKind::Speed(_) => {
            "friction is not linear in the speed: --suggest tries other curves; or a loss depends on a torque (load)"
        }
    }
}

fn tests(fitted: &Fitted<'_>) -> Vec<ResidualTest> {
    let (rows, speeds) = (fitted.plant.row_names(fitted.samples.rows), fitted.plant.speed_names());
    residual_statistics(fitted.samples, fitted.fit)
        .into_iter()
        .map(|test| ResidualTest {
            hypothesis: test_name(test.what, &rows, &speeds),
            probability: test.probability,
            if_rejected: if test.probability < UNLIKELY {
                meaning(test.what, fitted.request.loss).into()
            } else {
                String::new()
            },
        })
        .collect()
}

fn validation(fitted: &Fitted<'_>) -> Vec<Validation> {
    let Fitted { samples, cross_validated, .. } = fitted;
    let (n, r) = (samples.len(), samples.rows);
    let of_row = |(row, name, unit): (usize, String, String)| Validation {
        row: name,
        unit,
        torque: rms(n, |k| samples.y(k)[row]),
        in_sample: rms(n, |k| fitted.residual(k, row)),
        cross_validated: cross_validated.map(|predicted| rms(n, |k| samples.y(k)[row] - predicted[k * r + row])),
    };
    fitted.rows().map(of_row).collect()
}

/// Rows without a measured torque whose balance does not close, and those with vanishing coefficients: no torque determines their
/// magnitude, and a missing term has no other effect.
fn open_balances(fitted: &Fitted<'_>) -> Vec<String> {
    let Fitted { samples, fit, columns, .. } = fitted;
    let Some(errors) = &samples.errors else { return Vec::new() };
    let (n, p, rows, m) = (samples.len(), samples.columns, samples.rows, samples.inputs);
    let (size, _) = samples.error_sizes();
    let driven = |row: usize| {
        let width = m + 3 * samples.degrees_of_freedom;
        (0..n).any(|k| errors.slopes[k * size + row * width..][..m].iter().any(|x| *x != 0.0))
    };
    let part = |row: usize, column: usize| rms(n, |k| samples.x(k)[row * p + column]);
    let noise = |row: usize| rms(n, |k| samples.covariance(k)[row * (rows + 1)].max(0.0).sqrt());
    let mut out = Vec::new();
    for (row, name, _) in fitted.rows().filter(|(row, ..)| !driven(*row)) {
        let measured = rms(n, |k| samples.y(k)[row]);
        let sizes = |values: &dyn Fn(usize) -> f64| {
            (0..columns.identifiable.len()).map(|k| part(row, k) * values(k).abs()).fold(measured, f64::max)
        };
        let largest = sizes(&|k| fit.values[k]);
        let before = sizes(&|k| columns.coefficients[columns.identifiable[k].0].value);
        let residual = rms(n, |k| fitted.residual(k, row));
        if largest < NOTHING * before {
            out.push(format!(
                "the coefficients of {name}, on which no measured torque acts, vanish: a term of it is missing, or its motion is \
                 noise; log a torque on it, or fix one of its coefficients"
            ));
        } else if residual > OPEN * largest && residual > LOUD * noise(row) {
            out.push(format!(
                "the balance of {name}, on which no measured torque acts, does not close: the residual is {:.0} % of its largest torque, \
                 far more than noise; a friction or another term of it is missing: request it",
                100.0 * residual / largest
            ));
        }
    }
    out
}

/// Parameters whose signal contains much sensor noise: errors of their regressor make them too small.
fn drowned(fitted: &Fitted<'_>) -> Vec<String> {
    let Fitted { whole, plant, columns, samples, .. } = fitted;
    let equations = &plant.reduced.equations;
    let basis = plant.basis();
    let windows = samples.windows.iter().sum::<usize>() as f64 / samples.len().max(1) as f64;
    let mut out = Vec::new();
    for one in columns.identified() {
        let Some(&term) = one.terms.first() else { continue };
        let (part, what) = match one.kind {
            Kind::Inertia => (2, "acceleration"),
            Kind::Damping => (1, "speed"),
            Kind::Stiffness => (0, "twist"),
            Kind::Friction => continue,
        };
        let g = in_coordinates(equations.coefficient_row((one.kind, term)), &basis);
        let square = (0..samples.len()).map(|s| powi(dot(&g, samples.motion(s, part)), 2)).sum::<f64>();
        let variance: f64 = g.iter().zip(&whole.chosen.built.noise[part]).map(|(g, sigma)| powi(g * sigma, 2)).sum();
        let share = variance / windows / (square / samples.len().max(1) as f64);
        if share > NOISE {
            out.push(format!(
                "{:.0} % of the square of the {what} that {} acts on is sensor noise, which makes the estimate too small by \
                 about that share: use a wider window, or larger motions",
                100.0 * share.min(1.0),
                one.name
            ));
        }
    }
    out
}

fn warnings(fitted: &Fitted<'_>, out: &Identification) -> Vec<String> {
    let Fitted { request, .. } = fitted;
    let mut warnings = drowned(fitted);
    warnings.extend(open_balances(fitted));
    if let Some(IdentifiedDamping { passive: false, .. }) = &out.damping {
        warnings.push(
            "the identified damping is not passive: some motion would gain energy from it; a single equivalent damping may be \
             negative, the reduced matrix may not. Check the intervals, or request fewer parameters"
                .into(),
        );
    }
    for extra in &request.extras {
        let Law::Backlash { clear } = extra.law else { continue };
        let name = format!("{}.backlash", extra.element);
        let width = out.parameters.iter().find(|one| one.name == name).and_then(|one| Some((one.value?, one)));
        if let Some((width, one)) = width.filter(|(width, _)| *width / 2.0 >= clear) {
            warnings.push(format!(
                "half of {name} is {} {}, not less than `min_deflection = {}`: kardan uses windows in which the backlash may be open; write a larger `min_deflection`",
                short(width / 2.0),
                one.unit,
                short(clear)
            ));
        }
    }
    for one in out.parameters.iter().filter(|one| one.interval.is_some_and(|it| it.upper < 0.0)) {
        let kind = request.unknowns.iter().find(|own| own.name == one.name).map(|own| own.keys[0].1);
        if matches!(kind, Some(Kind::Friction | Kind::Inertia | Kind::Stiffness)) {
            warnings.push(format!(
                "{} is negative, which is impossible for {}: check the signs of torques and speeds (`factor = -1`), or set `nonnegative`",
                one.name,
                signal_name::parameter(&one.name).map_or(one.name.as_str(), |(_, key)| key)
            ));
        }
    }
    warnings
}
